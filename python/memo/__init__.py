"""3D human motion from one fixed camera by explicit geometry.

Frames are numpy arrays (H, W) uint8; metres and seconds throughout; world Z up; gait phase in [0, 1) with
0 at the right heel strike.
"""

from memo._memo import (
    Camera,
    __version__,
    change_mask,
    edge_segments,
    moving_regions,
    pointlight,
    silhouettes,
    similarity,
    velocity_field,
    walker_motion,
)
from memo.figure import PlanarFigure, planar
from memo.scene import DemoScene, demo_scene
from memo.tracking import Track, Tracker, track

__all__ = [
    "Camera",
    "DemoScene",
    "PlanarFigure",
    "Track",
    "Tracker",
    "__version__",
    "change_mask",
    "demo_scene",
    "edge_segments",
    "moving_regions",
    "planar",
    "pointlight",
    "silhouettes",
    "similarity",
    "track",
    "velocity_field",
    "walker_motion",
]
