"""The projected joints of a track as keypoints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from memo.files import JOINTS
from memo.keypoints.points import Keypoints, KeypointsError

__all__ = ["keypoints_of_track"]


def keypoints_of_track(columns: Mapping[str, npt.ArrayLike]) -> Keypoints:
    """The twelve joints of `Track.columns` in the picture, with scores of 1: they are not detections.

    Frames between walks have none. Two walks in one frame are refused: select the rows of one.
    """
    frames = np.asarray(columns["frame"], np.int64)
    if not len(frames):
        raise KeypointsError("a track without rows")
    if len(set(frames.tolist())) < len(frames):
        raise KeypointsError("two walks in one frame: select the rows of one `walk`")
    points = np.stack(
        [np.column_stack([columns[f"{joint}_u_px"], columns[f"{joint}_v_px"]]) for joint in JOINTS], axis=1
    )
    order = np.argsort(frames)
    times_s = np.asarray(columns["time_s"], np.float64)
    return Keypoints.from_arrays(points[order], names=JOINTS, times_s=times_s[order], frames=frames[order])
