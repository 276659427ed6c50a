"""The projected joints of a track as keypoints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from memo.files import JOINTS
from memo.keypoints.points import Keypoints, KeypointsError
from memo.keypoints.text import short
from memo.missing import real_numbers

__all__ = ["keypoints_of_track"]

_COLUMNS = ("frame", "time_s", *(f"{joint}_{axis}_px" for joint in JOINTS for axis in "uv"))


def keypoints_of_track(columns: Mapping[str, npt.ArrayLike]) -> Keypoints:
    """The twelve joints of `Track.columns` in the picture, with scores of 1: they are not detections.

    Frames between walks have none. Two walks in one frame are refused: select the rows of one.
    """
    absent = [name for name in _COLUMNS if name not in columns]
    if absent:
        raise KeypointsError(f"not the columns of a track: no {short(', '.join(absent))}")
    frames = np.asarray(columns["frame"], np.int64)
    if not len(frames):
        raise KeypointsError("a track without rows")
    if len(set(frames.tolist())) < len(frames):
        raise KeypointsError("two walks in one frame: select the rows of one `walk`")
    pixels = [[real_numbers(columns[f"{joint}_{axis}_px"]) for axis in "uv"] for joint in JOINTS]
    points = np.stack([np.column_stack(both) for both in pixels], axis=1)
    order = np.argsort(frames)
    times_s = real_numbers(columns["time_s"])
    return Keypoints.from_arrays(points[order], names=JOINTS, times_s=times_s[order], frames=frames[order])
