"""MediaPipe: the results of its Pose Landmarker, saved as JSON, one entry per frame.

MediaPipe writes no file itself. An entry is a result, `{"pose_landmarks": [...]}` (as `dataclasses.asdict`
gives in Python) or `{"landmarks": [...]}` (in JavaScript), of the Pose solution before it
(`{"pose_landmarks": {"landmark": [...]}}`), or the list of people or landmarks in it; empty or null if
nobody was found. A landmark is `{x, y, z, visibility, presence}`, x and y as fractions of the width and
height. An array (T, 33, 4) or (T, people, 33, 4) of x, y, z and visibility is read too, and one with three
numbers of each landmark if these show whether the third is z, which has both signs, or the visibility, which
has not. `timestamp_ms` beside a result gives its time. Source: google-ai-edge/mediapipe
`mediapipe/tasks/python/vision/pose_landmarker.py` and
`mediapipe/tasks/python/components/containers/landmark.py`.

Pixel u = x width - 0.5, because 0 and 1 are the edges of the image. Scores are the visibility, else 1. The
world landmarks are not used, because a network estimates them from the picture, and they are refused if they
are saved alone; so are landmarks in pixels.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.points import Array, KeypointsError, OptionError, Source
from memo.keypoints.text import short

__all__ = ["is_mediapipe", "is_nobody", "read_mediapipe"]

_RESULTS = ("pose_landmarks", "landmarks", "poseLandmarks")
_WORLD = ("pose_world_landmarks", "worldLandmarks", "poseWorldLandmarks")
_LANDMARKS = 33
_HIPS = (23, 24)
_LARGEST_FRACTION = 1.5  # of most points; some may lie farther outside of the picture
_AT_ORIGIN = 1e-3
_ARE_WORLD = "these are world landmarks; save the landmarks in the picture (pose_landmarks)"


def is_mediapipe(data: Any) -> bool:
    """Whether this is a list with the landmarks of each frame."""
    if not isinstance(data, list):
        return False
    if any(_is_only_world(entry) for entry in data):
        return True
    first = _first_person(data)
    return bool(first) and (_is_landmark(first[0]) or (_is_row(first[0]) and len(first) == _LANDMARKS))


def is_nobody(entry: Any) -> bool:
    """Whether this is the entry of a frame in which nobody was found."""
    people = _people(entry) if entry != {} else []
    return people is not None and all(person in (None, []) for person in people)


def _first_person(data: list[Any]) -> list[Any]:
    people = next((people for entry in data if entry and (people := _people(entry))), None)
    first = people[0] if people else None
    return first if isinstance(first, list) else []


def read_mediapipe(path: Path, data: list[Any], image_size: tuple[int, int] | None) -> Found:
    """All people in a file."""
    if any(_is_only_world(entry) for entry in data):
        raise KeypointsError(f"{path}: {_ARE_WORLD}")
    is_array = _is_row(_first_person(data)[0])
    entries = _from_array(path, data) if is_array else _from_objects(path, data)
    if image_size is None:
        raise OptionError(
            f"{path}: MediaPipe's coordinates are fractions of the picture: give its width and height",
            "image_size",
        )
    people = [
        Person(frame, _in_pixels(values, image_size, f"{path}: entry {frame}, person {place}"), None)
        for frame, those in enumerate(entries)
        for place, values in enumerate(those)
    ]
    return Found(
        Source(path, None),
        people,
        times_s=_times_s(path, data),
        image_size=image_size,
        frames=tuple(range(len(data))),
    )


def _times_s(path: Path, data: list[Any]) -> dict[int, float] | None:
    """The time of each entry, if they have times."""
    times_s = {
        frame: _number(entry["timestamp_ms"], f"{path}: entry {frame}, timestamp_ms") / 1000
        for frame, entry in enumerate(data)
        if isinstance(entry, dict) and "timestamp_ms" in entry
    }
    if times_s and len(times_s) < len(data):
        raise KeypointsError(f"{path}: {len(times_s)} of {len(data)} entries have timestamp_ms: all or none")
    return times_s or None


def _is_only_world(entry: Any) -> bool:
    """Whether an entry has world landmarks and none in the picture."""
    if not isinstance(entry, dict) or any(key in entry for key in _RESULTS):
        return False
    return any(key in entry for key in _WORLD)


def _check_fractions(path: Path, values: Array) -> None:
    """Refuses landmarks (N, 33, 3 or 4) of all people that are in pixels or world landmarks."""
    places = values[np.isfinite(values).all(axis=2)][:, :2]
    if not len(places):
        raise KeypointsError(f"{path}: no person in any frame")
    if np.median(np.abs(places)) > _LARGEST_FRACTION:
        raise KeypointsError(
            f"{path}: landmarks with coordinates up to {np.abs(places).max():.0f}, which are no fractions of "
            'the picture; pass pixels to memo.Keypoints.from_arrays(points, names="MEDIAPIPE_33")'
        )
    hips = values[:, _HIPS, :2].mean(axis=1)
    if np.nanmax(np.abs(hips), initial=0) < _AT_ORIGIN:
        raise KeypointsError(f"{path}: the hips are at 0 in every frame: {_ARE_WORLD}")


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
    if isinstance(entry, list) and entry and (_is_landmark(entry[0]) or _is_row(entry[0])):
        return [entry]
    return entry if isinstance(entry, list) else None


def _is_landmark(value: Any) -> bool:
    return isinstance(value, dict) and {"x", "y"} <= value.keys()


def _is_row(value: Any) -> bool:
    """Whether this is a landmark as a row of an array."""
    return (
        isinstance(value, list) and len(value) in (3, 4) and all(type(each) in (int, float) for each in value)
    )


def _from_array(path: Path, data: list[Any]) -> list[list[Array]]:
    """The people of each frame, (33, 3) each: x, y and visibility; NaN where a landmark is missing."""
    people = [
        [_row_values(person, f"{path}: entry {frame}") for person in _people(entry) or [] if person]
        for frame, entry in enumerate(data)
    ]
    everybody = [person for those in people for person in those]
    if len({person.shape[1] for person in everybody}) > 1:
        raise KeypointsError(f"{path}: landmarks with three numbers and with four")
    values = np.stack(everybody)
    _check_fractions(path, values)
    last = values[np.isfinite(values).all(axis=2)][:, -1]
    is_share = last.any() and last.min() >= 0 and last.max() <= 1
    if last.any() and not is_share and (values.shape[2] == 4 or last.min() >= 0):
        raise KeypointsError(
            f"{path}: an array whose last numbers ({last.min():.3g} to {last.max():.3g}) are no visibility; "
            "wanted (T, 33, 4): x, y, z and visibility of each landmark"
        )

    def seen(person: Array) -> Array:
        return np.column_stack([person[:, :2], person[:, -1] if is_share else np.ones(_LANDMARKS)])

    return [[seen(person) for person in those] for those in people]


def _row_values(person: Any, where: str) -> Array:
    """(33, 3 or 4) numbers; a row without any number but 0 is missing."""
    if not isinstance(person, list) or len(person) != _LANDMARKS or not all(map(_is_row, person)):
        raise KeypointsError(f"{where}: wanted {_LANDMARKS} landmarks of 3 or 4 numbers each")
    if len({len(row) for row in person}) > 1:
        raise KeypointsError(f"{where}: landmarks with three numbers and with four")
    try:
        values = np.array(person, np.float64)
    except OverflowError:
        raise KeypointsError(f"{where}: a number too large") from None
    values[~np.isfinite(values).all(axis=1) | ~values.any(axis=1)] = np.nan
    return values


def _from_objects(path: Path, data: list[Any]) -> list[list[Array]]:
    """The people of each entry, (33, 3) each: x, y and visibility."""
    entries = []
    for frame, entry in enumerate(data):
        where = f"{path}: entry {frame}"
        found = _people(entry)
        if found is None:
            got = ", ".join(entry) if isinstance(entry, dict) else short(entry)
            raise KeypointsError(f"{where}: wanted one of {', '.join(_RESULTS)}, or a list; got {short(got)}")
        entries.append(
            [_values(landmarks, f"{where}, person {place}") for place, landmarks in enumerate(found)]
        )
    _check_fractions(path, np.stack([person for people in entries for person in people]))
    return entries


def _values(landmarks: Any, where: str) -> Array:
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
            _number(landmark["x"], f"{place}, x"),
            _number(landmark["y"], f"{place}, y"),
            1.0 if visibility is None else _number(visibility, f"{place}, visibility"),
        )
    return values


def _in_pixels(values: Array, image_size: tuple[int, int], where: str) -> Array:
    return with_missing(values * (*image_size, 1) - (0.5, 0.5, 0), where)


def _number(value: Any, where: str) -> float:
    try:
        if type(value) in (int, float) and math.isfinite(value):
            return float(value)
    except OverflowError:
        pass
    raise KeypointsError(f"{where}: {short(value)} is not a number")
