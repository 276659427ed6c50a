"""ViTPose by easy_ViTPose: the JSON of its `inference.py --save-json`.

`{"keypoints": [{"0": [[y, x, score], ...], ...}, ...], "skeleton": {"0": "nose", ...}}`: per frame the
people by the number of their track, with the row before the column. Source: JunkyByte/easy_ViTPose
`inference.py` and `easy_ViTPose/vit_utils/visualization.py` (`joints_dict`). ViTPose in MMPose writes the
files of MMPose.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.points import Array, KeypointsError, Source
from memo.keypoints.text import short

__all__ = ["is_vitpose", "read_vitpose"]


def is_vitpose(data: Any) -> bool:
    return isinstance(data, dict) and {"keypoints", "skeleton"} <= data.keys()


def read_vitpose(path: Path, data: dict[str, Any]) -> Found:
    """All people in a file."""
    frames, skeleton = data["keypoints"], data["skeleton"]
    if not isinstance(frames, list) or not isinstance(skeleton, dict):
        raise KeypointsError(f"{path}: wanted a list `keypoints` and an object `skeleton`")
    joints = {int(index): _joint(str(name)) for index, name in skeleton.items() if str(index).isdecimal()}
    places = sorted(index for index, joint in joints.items() if joint is not None)
    names = tuple(str(joints[place]) for place in places)
    if not names or len(set(names)) < len(names):
        raise KeypointsError(
            f"{path}: skeleton: wanted different names of joints, got {short(', '.join(names)) or 'none'}"
        )
    people = []
    for frame, by_track in enumerate(frames):
        where = f"{path}: frame {frame}"
        if not isinstance(by_track, dict):
            raise KeypointsError(f"{where}: wanted the people by track, got {short(by_track)}")
        for track, points in by_track.items():
            people.append(
                Person(frame, _values(points, len(skeleton), f"{where}, track {track}")[places], None)
            )
    return Found(Source(path, None), people, names=names, frames=tuple(range(len(frames))))


def _values(points: Any, count: int, where: str) -> Array:
    try:
        values = np.array(points, np.float64)
    except (TypeError, ValueError):
        raise KeypointsError(f"{where}: wanted y, x and score of each point, in numbers") from None
    if values.shape != (count, 3):
        raise KeypointsError(f"{where}: wanted ({count}, 3) numbers y, x, score, got {values.shape}")
    return with_missing(values[:, [1, 0, 2]], where)


def _joint(name: str) -> str | None:
    try:
        return _memo.joint_name(name)
    except ValueError:  # similar to a joint
        return None
