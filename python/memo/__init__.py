"""3D human motion from one fixed camera by explicit geometry.

Frames are numpy arrays (H, W) uint8; metres and seconds throughout; world Z up; gait phase in [0, 1) with
0 at the right heel strike.

Progress is logged to the logger "memo", which is silent unless your program sets up logging.
"""

import logging as _logging

from memo import explain, gait
from memo._memo import (
    Camera,
    InternalError,
    __version__,
    calibrate_points,
    calibrate_walker,
    camera_tilt,
    change_mask,
    edge_segments,
    foot_points,
    head_points,
    moving_regions,
    planar_hinges,
    planar_rods,
    pointlight,
    pointlight_cycle,
    pointlight_together,
    silhouettes,
    similarity,
    stick_joints,
    velocity_field,
    walker_motion,
    walker_sightings,
)
from memo.keypoints import Keypoints, KeypointsError, layouts, read_keypoints, write_keypoints
from memo.linkage import PlanarFigure, planar
from memo.panning import field_of_view
from memo.postures import Postures, posture
from memo.scene import DemoScene, demo_scene
from memo.segment_lengths import read_lengths
from memo.sides import SideRepair, unswap
from memo.tracking import Track, Tracker, fit_walk, track

_logging.getLogger("memo").addHandler(_logging.NullHandler())

__all__ = [
    "Camera",
    "DemoScene",
    "InternalError",
    "Keypoints",
    "KeypointsError",
    "PlanarFigure",
    "Postures",
    "SideRepair",
    "Track",
    "Tracker",
    "__version__",
    "calibrate_points",
    "calibrate_walker",
    "camera_tilt",
    "change_mask",
    "demo_scene",
    "edge_segments",
    "explain",
    "field_of_view",
    "fit_walk",
    "foot_points",
    "gait",
    "head_points",
    "layouts",
    "moving_regions",
    "planar",
    "planar_hinges",
    "planar_rods",
    "pointlight",
    "pointlight_cycle",
    "pointlight_together",
    "posture",
    "read_keypoints",
    "read_lengths",
    "silhouettes",
    "similarity",
    "stick_joints",
    "track",
    "unswap",
    "velocity_field",
    "walker_motion",
    "walker_sightings",
    "write_keypoints",
]
