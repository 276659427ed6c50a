"""Reads one person's keypoints from a file or folder of any known detector."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.given import nothing_at
from memo.keypoints.found import Found, Person
from memo.keypoints.points import (
    Array,
    Keypoints,
    KeypointsError,
    OptionError,
    Someone,
    check_rate,
    checked_size,
    frame_range,
    is_whole,
)
from memo.keypoints.recognising import everybody_in
from memo.pixels import of_video, shrink_of_table
from memo.wording import counted

__all__ = ["read_keypoints"]

_LEAST_BODY_PX = 20  # who is seen by a point or two has no size
_OF_A_TRACK = ("track.csv", "track.parquet")


def read_keypoints(
    path: str | PathLike[str],
    *,
    person: int | str | tuple[float, float, int] | None = None,
    fps: float | None = None,
    layout: str | None = None,
    image_size: tuple[int, int] | None = None,
) -> Keypoints:
    """Reads one person's keypoints; the format is recognised by the content.

    `person` chooses one of several people: the number, 0 being the most prominent (size times mean score,
    summed over all frames); the name, if a table, DeepLabCut or SLEAP names people, or the number of a
    track of YOLO; or a place `(u_px, v_px, frame)` where the person is. Frames count from 0, also in files
    whose first one is 1 (labels of YOLO, demos of MMPose). Everyone is followed from frame to frame, whatever
    the order of the detector's lists; who is not found for a while is expected on their way. By default the
    most prominent person is chosen, by the name if the file names people (tracks of YOLO are no names: one
    person may have several). `Keypoints.everyone` lists all, `doubts` says where two may be exchanged.
    `fps` is needed unless a table has `time_s`, which it replaces. `layout` names the order of points if the
    file does not: without it the number of points decides, and between BODY_25 and BODY_25B (both 25) whether
    the points that would be neck and middle of the hips lie there. `image_size`, width and height in pixels,
    is needed if coordinates are fractions of the picture (MediaPipe, labels of YOLO), and for postures
    without a camera. For a run of `memo track` (a folder with `track.csv` or `track.parquet`) the projected
    joints are read.
    """
    path = Path(path)
    check_rate(fps)
    _check_person(person)
    if image_size is not None:
        image_size = checked_size(image_size)
    try:
        if not path.exists():
            raise KeypointsError(nothing_at(path, "file or folder"))
        run = next((path / name for name in _OF_A_TRACK if (path / name).is_file()), path)
        found = everybody_in(run, image_size)
    except OSError as error:
        raise KeypointsError(f"{path}: cannot be read: {error.strerror or error}") from None
    keypoints = _assembled(found, person, fps, layout)
    if image_size is not None:
        keypoints = replace(keypoints, image_size=_own_size(keypoints, image_size))
    shrink = shrink_of_table(found.source.path) if found.source.path.name in _OF_A_TRACK else 1
    return keypoints if shrink == 1 else replace(keypoints, points=of_video(keypoints.points, shrink))


def _own_size(keypoints: Keypoints, image_size: tuple[int, int]) -> tuple[int, int]:
    """The size of the picture, which must be the file's, if the file gives it."""
    width, height = keypoints.image_size or image_size
    if (width, height) != image_size:
        given = f"{image_size[0]}x{image_size[1]}"
        raise OptionError(
            f"{keypoints.source.path}: is for {width}x{height} pixels, not {given}", "image_size"
        )
    return width, height


def _check_person(person: Any) -> None:
    if isinstance(person, tuple | list):
        is_place = (
            len(person) == 3
            and all(isinstance(number, Real) and math.isfinite(number) for number in person)
            and person[2] == int(person[2])
        )
    else:
        is_place = isinstance(person, str) or (is_whole(person) and person >= 0)
    if person is not None and not is_place:
        raise KeypointsError(
            f"person {person!r} is no number (0, 1, ...), name, or place of a person: (u_px, v_px, frame)"
        )


def _assembled(
    found: Found, person: int | str | tuple[float, float, int] | None, fps: float | None, layout: str | None
) -> Keypoints:
    path = found.source.path
    people = sorted(found.people, key=lambda one: one.frame)
    if not people:
        raise KeypointsError(f"{path}: no person in any frame")
    _check_names(path, people)
    frames = frame_range(path, {one.frame for one in people} | set(found.frames))
    counts = {len(one.values) for one in people}
    if len(counts) > 1:
        raise KeypointsError(f"{path}: people with different numbers of points: {sorted(counts)}")
    values = np.stack([one.values for one in people])
    all_points, all_scores = np.ascontiguousarray(values[..., :2]), np.ascontiguousarray(values[..., 2])
    name, names = _layout(found, layout, all_points)
    numbers, met = _memo.follow_everyone([one.frame for one in people], all_points, all_scores)
    everyone = _everyone(people, _names(people, numbers), all_points, all_scores)
    if person is None and not found.are_tracks and any(one.name is not None for one in people):
        person = everyone[0].name
    who = _chosen(path, people, person, numbers, all_points)
    chosen = [name == who for name in (_names(people, numbers) if isinstance(who, str) else numbers)]

    count = len(frames)
    points = np.full((count, len(names), 2), np.nan)
    scores = np.zeros((count, len(names)))
    places: list[Any] = [None] * count
    seen = np.zeros(count, np.int64)
    for index, one in enumerate(people):
        row = one.frame - frames[0]
        seen[row] += 1
        if chosen[index]:
            points[row], scores[row], places[row] = all_points[index], all_scores[index], one.place
    return Keypoints(
        points=points,
        scores=scores,
        names=names,
        times_s=_times_s(path, frames, found.times_s, fps),
        frames=np.arange(frames[0], frames[-1] + 1, dtype=np.int64),
        layout=name,
        image_size=found.image_size,
        people=seen,
        source=replace(found.source, places=tuple(places)),
        everyone=everyone,
        doubts=() if isinstance(who, str) else tuple(_doubts(who, met)),
    )


def _check_names(path: Path, people: Sequence[Person]) -> None:
    """Refuses a person of one name at two places in a frame."""
    named = Counter((one.frame, one.name) for one in people if one.name is not None)
    twice = next((each for each, count in named.items() if count > 1), None)
    if twice is not None:
        raise KeypointsError(f"{path}: person {twice[1]} appears twice in frame {twice[0]}")


def _layout(found: Found, layout: str | None, points: Array) -> tuple[str | None, tuple[str, ...]]:
    path = found.source.path
    if found.names is not None:
        if layout is not None:
            raise KeypointsError(f"{path}: the file names its joints; leave the layout {layout} out")
        return None, found.names
    try:
        name, names = _memo.keypoint_layout(_memo.guess_layout(points) if layout is None else layout)
    except ValueError as error:
        raise KeypointsError(f"{path}: {error}") from None
    if len(names) != points.shape[1]:
        raise KeypointsError(
            f"{path}: has {counted(points.shape[1], 'point')} per person, {name} has {len(names)}"
        )
    return name, tuple(names)


def _names(people: Sequence[Person], numbers: Sequence[int | None]) -> list[str | None]:
    """The name of each detection's person: as in the file, else the number."""
    if any(one.name is not None for one in people):
        return [one.name for one in people]
    return [None if number is None else str(number) for number in numbers]


def _everyone(
    people: Sequence[Person], names: Sequence[str | None], points: Array, scores: Array
) -> tuple[Someone, ...]:
    own: dict[str, list[int]] = {}
    for index, name in enumerate(names):
        if name is not None:
            own.setdefault(name, []).append(index)
    sizes_px = _sizes_px(points)
    seen = np.isfinite(points).all(axis=2)
    prominence = sizes_px * np.where(seen, scores, 0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)
    ordered = sorted(own.items(), key=lambda item: -float(np.sum(prominence[item[1]])))
    return tuple(
        Someone(
            name,
            len(indices),
            people[indices[0]].frame,
            people[indices[-1]].frame,
            float(np.median(sizes_px[indices])),
        )
        for name, indices in ordered
    )


def _sizes_px(points: Array) -> Array:
    """The diagonal of the box around each detection's points, 0 without points."""
    low, high = (extreme(points, axis=1) for extreme in (_least, _greatest))
    sizes_px: Array = np.hypot(*(high - low).T)
    return sizes_px


def _least(points: Array, axis: int) -> Array:
    least: Array = np.where(np.isfinite(points), points, np.inf).min(axis=axis, initial=np.inf)
    return np.where(np.isfinite(least), least, 0)


def _greatest(points: Array, axis: int) -> Array:
    return -_least(-points, axis)


def _chosen(
    path: Path,
    people: Sequence[Person],
    person: int | str | tuple[float, float, int] | None,
    numbers: Sequence[int | None],
    points: Array,
) -> int | str:
    """The number of the person meant, or the name, if people are chosen by the file's names."""
    if person is None:
        return 0
    if isinstance(person, tuple | list):
        return _at(path, people, (float(person[0]), float(person[1]), int(person[2])), numbers, points)
    names = {one.name for one in people} - {None}
    if names or isinstance(person, str):
        if str(person) not in names:
            known = f"names {', '.join(sorted(filter(None, names)))}" if names else "does not name people"
            raise KeypointsError(f"{path}: no person {person}: the file {known}")
        return str(person)
    count = max((number for number in numbers if number is not None), default=-1) + 1
    if person >= count:
        there = f"there {'is' if count == 1 else 'are'} {counted(count, 'person', 'people')}"
        raise KeypointsError(f"{path}: no person {person}: {there}, and the first is 0")
    return int(person)


def _at(
    path: Path,
    people: Sequence[Person],
    place: tuple[float, float, int],
    numbers: Sequence[int | None],
    points: Array,
) -> int:
    """The person whose points are nearest to a place in a frame, at most a body's size away."""
    u_px, v_px, frame = place
    there = [
        (float(np.hypot(*(seen - (u_px, v_px)).T).min()), number, seen)
        for one, number, own in zip(people, numbers, points, strict=True)
        if one.frame == frame and number is not None and len(seen := own[np.isfinite(own).all(axis=1)])
    ]
    if not there:
        raise KeypointsError(f"{path}: nobody is seen in frame {frame}")
    away_px, nearest, seen = min(there, key=lambda each: each[0])
    sizes_px = [size for size, number in zip(_sizes_px(points), numbers, strict=True) if number == nearest]
    if away_px > max(np.median(sizes_px), _LEAST_BODY_PX):
        u, v = np.median(seen, axis=0)
        raise KeypointsError(
            f"{path}: nobody is at {u_px:g},{v_px:g} in frame {frame}: the nearest person is at "
            f"{u:.0f},{v:.0f}, with the nearest point {away_px:.0f} px away"
        )
    return nearest


def _doubts(person: int, met: Iterable[tuple[int, int, int, float]]) -> Iterable[str]:
    for one, other, frame, probability in met:
        if person in (one, other):
            second = other if person == one else one
            yield (
                f"from frame {frame} on, person {person} may be person {second}: "
                f"they meet there (probability {probability:.2f})"
            )


def _times_s(path: Path, frames: range, times_s: dict[int, float] | None, fps: float | None) -> Array:
    if fps is not None:
        return np.array(frames) / fps
    if times_s is None:
        raise OptionError(f"{path}: has no time stamps; give its frame rate", "fps")
    ordered = sorted(times_s.items())
    for (before, early), (after, late) in pairwise(ordered):
        if late <= early:
            raise KeypointsError(
                f"{path}: time_s must increase: {early:g} at frame {before}, {late:g} at {after}"
            )
    return np.interp(np.array(frames), *np.array(ordered, np.float64).T)
