"""MediaPipe: the results of its Pose Landmarker, saved as JSON, one entry per frame.

MediaPipe writes no file itself. An entry is a result, `{"pose_landmarks": [...]}` (as `dataclasses.asdict`
gives in Python) or `{"landmarks": [...]}` (in JavaScript), of the Pose solution before it
(`{"pose_landmarks": {"landmark": [...]}}`), or the list of people or landmarks in it; empty or null if
nobody was found. A landmark is `{x, y, z, visibility, presence}`, x and y as fractions of the width and
height. `timestamp_ms` beside a result gives its time. Source: google-ai-edge/mediapipe
`mediapipe/tasks/python/vision/pose_landmarker.py` and
`mediapipe/tasks/python/components/containers/landmark.py`.

Pixel u = x width - 0.5, because 0 and 1 are the edges of the image. Scores are the visibility, else 1. The
world landmarks are not used: they are estimated by a network from the picture.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.points import Array, KeypointsError, Source
from memo.keypoints.text import short

__all__ = ["is_mediapipe", "read_mediapipe"]

_RESULTS = ("pose_landmarks", "landmarks", "poseLandmarks")
_LANDMARKS = 33


def is_mediapipe(data: Any) -> bool:
    """Whether this is a list with the landmarks of each frame."""
    if not isinstance(data, list):
        return False
    people = next((people for entry in data if entry and (people := _people(entry))), None)
    first = people[0] if people else None
    return isinstance(first, list) and bool(first) and _is_landmark(first[0])


def read_mediapipe(path: Path, data: list[Any], image_size: tuple[int, int] | None) -> Found:
    """All people in a file."""
    if image_size is None:
        raise KeypointsError(
            f"{path}: MediaPipe's coordinates are fractions of the picture: "
            "give its width and height (image_size)"
        )
    people = []
    times_s = {}
    for frame, entry in enumerate(data):
        where = f"{path}: entry {frame}"
        if isinstance(entry, dict) and "timestamp_ms" in entry:
            times_s[frame] = _number(entry["timestamp_ms"], f"{where}, timestamp_ms") / 1000
        found = _people(entry)
        if found is None:
            got = ", ".join(entry) if isinstance(entry, dict) else short(entry)
            raise KeypointsError(f"{where}: wanted one of {', '.join(_RESULTS)}, or a list; got {short(got)}")
        for place, landmarks in enumerate(found):
            values = _values(landmarks, image_size, f"{where}, person {place}")
            people.append(Person(frame, values, None))
    if times_s and len(times_s) < len(data):
        raise KeypointsError(f"{path}: {len(times_s)} of {len(data)} entries have timestamp_ms: all or none")
    return Found(
        Source(path, None),
        people,
        times_s=times_s or None,
        image_size=image_size,
        frames=tuple(range(len(data))),
    )


def _people(entry: Any) -> list[Any] | None:
    """The people of an entry, each a list of landmarks; None if it is something else."""
    if isinstance(entry, dict):
        key = next((key for key in _RESULTS if key in entry), None)
        if key is None:
            return None
        entry = entry[key]
    if isinstance(entry, dict) and "landmark" in entry:
        entry = [entry["landmark"]]
    if entry is None:
        return []
    if isinstance(entry, list) and entry and _is_landmark(entry[0]):
        return [entry]
    return entry if isinstance(entry, list) else None


def _is_landmark(value: Any) -> bool:
    return isinstance(value, dict) and {"x", "y"} <= value.keys()


def _values(landmarks: Any, image_size: tuple[int, int], where: str) -> Array:
    if not isinstance(landmarks, list) or len(landmarks) != _LANDMARKS:
        got = f"{len(landmarks)}" if isinstance(landmarks, list) else short(landmarks)
        raise KeypointsError(f"{where}: wanted {_LANDMARKS} landmarks, got {got}")
    values = np.empty((_LANDMARKS, 3))
    for index, landmark in enumerate(landmarks):
        place = f"{where}, landmark {index}"
        if not _is_landmark(landmark):
            raise KeypointsError(f"{place}: wanted x and y, got {short(landmark)}")
        visibility = landmark.get("visibility")
        values[index] = (
            _number(landmark["x"], f"{place}, x") * image_size[0] - 0.5,
            _number(landmark["y"], f"{place}, y") * image_size[1] - 0.5,
            1.0 if visibility is None else _number(visibility, f"{place}, visibility"),
        )
    return with_missing(values, where)


def _number(value: Any, where: str) -> float:
    if type(value) not in (int, float) or not math.isfinite(value):
        raise KeypointsError(f"{where}: {short(value)} is not a number")
    return float(value)
