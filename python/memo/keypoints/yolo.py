"""YOLO-pose of Ultralytics: label files (`save_txt=True`) and the JSON of its results.

- A folder with a text file per frame, `NAME_1.txt`, ...: `class x y width height`, then `x y` or `x y
  confidence` of each of the 17 points, all as fractions of the picture, then the box's confidence
  (`save_conf`) and the number of the track (`model.track`), each only if there is one. A frame without
  people has no file. The first frame of a video is 1.
- `results.to_json()`: `[{"name", "class", "confidence", "box", "track_id", "keypoints": {"x": [...],
  "y": [...], "visible": [...]}}]`, in pixels or, if normalized, in fractions: a folder with a file per frame,
  or one file with a list of these lists.

Source: ultralytics/ultralytics `ultralytics/engine/results.py`, `Results.save_txt`, `Results.summary`, and
`ultralytics/data/loaders.py`, `LoadImagesAndVideos`.
The numbers of tracks are names of people. Points at (0, 0) are missing. Only models with the 17 points of
COCO can be read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.points import Array, KeypointsError, OptionError, Source
from memo.keypoints.text import content_of, short
from memo.wording import counted

__all__ = ["is_detections", "read_detections", "read_labels"]

_POINTS = 17
_BOX = 5  # class and box before the points of a line
_LARGEST_FRACTION = 1.5
_PERSON = 0


def is_detections(detections: Any) -> bool:
    """Whether this is the JSON of the results of one frame; results of AlphaPose have `image_id` too."""
    first = detections[0] if isinstance(detections, list) and detections else None
    return isinstance(first, dict) and "box" in first and "image_id" not in first


def read_detections(
    path: Path, frames: Sequence[tuple[int, str, Any]], image_size: tuple[int, int] | None
) -> Found:
    """All people in the results of several frames, each with its number and its place for messages."""
    people = []
    for frame, where, detections in frames:
        if not isinstance(detections, list):
            raise KeypointsError(f"{where}: wanted a list of detections, got {short(detections)}")
        for place, detection in enumerate(detections):
            if isinstance(detection, dict) and detection.get("class", _PERSON) != _PERSON:
                continue
            values = _of_detection(detection, f"{where}, detection {place}")
            track = detection.get("track_id")
            people.append(Person(frame, values, None, str(track) if type(track) is int else None))
    if people and all(np.nanmax(one.values[:, :2], initial=0) <= _LARGEST_FRACTION for one in people):
        people = [replace(one, values=_in_pixels(one.values, path, image_size)) for one in people]
    return Found(
        Source(path, None),
        people,
        image_size=image_size,
        frames=tuple(frame for frame, _, _ in frames),
        are_tracks=True,
    )


def read_labels(path: Path, files: dict[int, Path], image_size: tuple[int, int] | None) -> Found:
    """All people in a folder of label files, by the number of their frame."""
    first = _first_number(files)
    people = []
    behind: list[list[float]] = []
    for number, file in files.items():
        frame = number - first
        for place, line in enumerate(content_of(file).splitlines(), start=1):
            if not line.strip():
                continue
            found = _of_line(line, f"{file}: line {place}")
            if found is not None:
                values, more = found
                people.append(Person(frame, _in_pixels(values, path, image_size), None))
                behind.append(more)
    people = [replace(one, name=name) for one, name in zip(people, _tracks(people, behind), strict=True)]
    frames = tuple(number - first for number in files)
    return Found(Source(path, None), people, image_size=image_size, frames=frames, are_tracks=True)


def _first_number(files: dict[int, Path]) -> int:
    """The number of the first frame: 1 in a video; pictures, with digits of equal count, keep theirs."""
    is_video = all(file.stem.endswith(f"_{number}") for number, file in files.items())
    return 1 if is_video and min(files) > 0 else 0


def _of_detection(detection: Any, where: str) -> Array:
    points = detection.get("keypoints") if isinstance(detection, dict) else None
    if not isinstance(points, dict) or not {"x", "y"} <= points.keys():
        got = ", ".join(detection) if isinstance(detection, dict) else short(detection)
        raise KeypointsError(f"{where}: wanted keypoints with x and y (of a -pose model), got {short(got)}")
    x, y = points["x"], points["y"]
    visible = points.get("visible", [1.0] * len(x) if isinstance(x, list) else None)
    try:
        values = np.array([x, y, visible], np.float64).T
    except (TypeError, ValueError):
        raise KeypointsError(f"{where}: x, y and visible must be lists of numbers of one length") from None
    if values.shape != (_POINTS, 3):
        raise KeypointsError(f"{where}: wanted {_POINTS} points, got {len(values)}")
    return with_missing(values, where)


def _tracks(people: list[Person], behind: list[list[float]]) -> list[str | None]:
    """The number of each track, from what is behind the points: [], [confidence], [track] or both.

    All lines have the confidence or none has it, and a line has no track while it belongs to none. Whole
    numbers alone that two lines of a frame share are confidences of 1.
    """
    most = max(map(len, behind), default=0)
    if most == 1:
        lone = [(one.frame, *more) for one, more in zip(people, behind, strict=True) if more]
        if len(set(lone)) < len(lone) or not all(number.is_integer() for _, number in lone):
            most = 0
    if most == 0:
        return [None] * len(behind)
    return [str(int(more[-1])) if len(more) == most else None for more in behind]


def _of_line(line: str, where: str) -> tuple[Array, list[float]] | None:
    """(17, 3) fractions and confidence of a line, and the numbers behind them; None if not a person."""
    try:
        numbers = [float(cell) for cell in line.split()]
    except ValueError:
        raise KeypointsError(f"{where}: not numbers: {short(line)}") from None
    if not all(map(math.isfinite, numbers)):
        raise KeypointsError(f"{where}: numbers that are not finite")
    if numbers and numbers[0] != _PERSON:
        return None
    for each in (3, 2):
        end = _BOX + each * _POINTS
        if 0 <= len(numbers) - end <= 2:
            points = np.array(numbers[_BOX:end]).reshape(_POINTS, each)
            whole = points if each == 3 else np.column_stack([points, np.ones(_POINTS)])
            return whole, numbers[end:]
    raise KeypointsError(
        f"{where}: {counted(len(numbers), 'number')}; wanted class, box and {_POINTS} points "
        "of 2 or 3 numbers, as a -pose model has"
    )


def _in_pixels(values: Array, path: Path, image_size: tuple[int, int] | None) -> Array:
    if image_size is None:
        raise OptionError(
            f"{path}: coordinates are fractions of the picture: give its width and height", "image_size"
        )
    return with_missing(values * (*image_size, 1.0), str(path))
