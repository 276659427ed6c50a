"""Reads one person's keypoints from a file or folder of any known detector."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.given import nothing_at
from memo.keypoints.found import MAX_COORDINATE_PX, Found, Person
from memo.keypoints.points import Array, Keypoints, KeypointsError, frame_range
from memo.keypoints.recognising import everybody_in
from memo.pixels import of_video, shrink_of_table
from memo.wording import counted

__all__ = ["read_keypoints"]

_OF_A_TRACK = ("track.csv", "track.parquet")


def read_keypoints(
    path: str | PathLike[str],
    *,
    person: int | None = None,
    fps: float | None = None,
    layout: str | None = None,
    image_size: tuple[int, int] | None = None,
) -> Keypoints:
    """Reads one person's keypoints; the format is recognised by the content.

    `person` is the index in each frame's list of people. Without it, if a frame has several people: the
    person with the greatest product of size and mean score over all frames, and from there, forwards and
    backwards, the nearest in each next frame, if within 0.3 of the person's size (more after a gap). `fps` is
    needed unless a table has `time_s`, which it replaces. `layout` names the order of points if the file does
    not: without it the number of points decides, and between BODY_25 and BODY_25B (both 25) whether the
    points that would be neck and middle of the hips lie there. `image_size`, width and height in pixels, is
    needed if coordinates are fractions of the picture (MediaPipe, labels of YOLO), and for postures without a
    camera. For a run of `memo track` (a folder with `track.csv` or `track.parquet`) the projected joints are
    read.
    """
    path = Path(path)
    if fps is not None and (isinstance(fps, str) or not 0 < fps < math.inf):
        raise KeypointsError(f"the frame rate must be positive, got {fps}")
    if person is not None and (isinstance(person, bool) or not isinstance(person, int) or person < 0):
        raise KeypointsError(f"person {person!r} is not an index in the list of people: 0, 1, ...")
    if image_size is not None and not _is_size(image_size):
        raise KeypointsError(f"image_size {image_size!r}: wanted width and height in whole pixels")
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
    if (width, height) != tuple(image_size):
        given = f"{image_size[0]}x{image_size[1]}"
        raise KeypointsError(
            f"{keypoints.source.path}: is for {width}x{height} pixels, not {given} (image_size)"
        )
    return width, height


def _is_size(size: Any) -> bool:
    return (
        isinstance(size, tuple | list)
        and len(size) == 2
        and all(type(side) is int and 0 < side <= MAX_COORDINATE_PX for side in size)
    )


def _assembled(found: Found, person: int | None, fps: float | None, layout: str | None) -> Keypoints:
    path = found.source.path
    people = sorted(found.people, key=lambda one: one.frame)
    if not people:
        raise KeypointsError(f"{path}: no person in any frame")
    frames = frame_range(path, {one.frame for one in people} | set(found.frames))
    counts = {len(one.values) for one in people}
    if len(counts) > 1:
        raise KeypointsError(f"{path}: people with different numbers of points: {sorted(counts)}")
    values = np.stack([one.values for one in people])
    all_points, all_scores = np.ascontiguousarray(values[..., :2]), np.ascontiguousarray(values[..., 2])
    name, names = _layout(found, layout, all_points)
    chosen = _chosen(path, people, person, all_points, all_scores)

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
    )


def _layout(found: Found, layout: str | None, points: Array) -> tuple[str | None, tuple[str, ...]]:
    path = found.source.path
    if found.names is not None:
        if layout is not None:
            raise KeypointsError(f"{path}: a table names its joints; leave the layout {layout} out")
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


def _chosen(
    path: Path, people: Sequence[Person], person: int | None, points: Array, scores: Array
) -> Sequence[bool]:
    if person is None:
        return _memo.follow_person([one.frame for one in people], points, scores)
    chosen = [
        place == person
        for _, same_frame in groupby(people, key=lambda one: one.frame)
        for place, _ in enumerate(same_frame)
    ]
    if not any(chosen):
        raise KeypointsError(f"{path}: no frame has a person {person} (the first is 0)")
    return chosen


def _times_s(path: Path, frames: range, times_s: dict[int, float] | None, fps: float | None) -> Array:
    if fps is not None:
        return np.array(frames) / fps
    if times_s is None:
        raise KeypointsError(f"{path}: has no time stamps; give its frame rate (fps)")
    ordered = sorted(times_s.items())
    for (before, early), (after, late) in pairwise(ordered):
        if late <= early:
            raise KeypointsError(
                f"{path}: time_s must increase: {early:g} at frame {before}, {late:g} at {after}"
            )
    return np.interp(np.array(frames), *np.array(ordered, np.float64).T)
