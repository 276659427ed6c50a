"""The content of a file of keypoints before one person is chosen, and the common numbers x, y, score."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from memo.keypoints.points import (
    MAX_COORDINATE_PX,
    Array,
    Keypoints,
    KeypointsError,
    Source,
    check_finite,
)
from memo.keypoints.text import short

__all__ = ["Found", "Person", "check_all_placed", "different", "triples", "with_missing", "with_points"]


@dataclass(frozen=True)
class Person:
    """One person in one frame."""

    frame: int
    values: Array  # (K, 3): x, y, score
    place: Any
    #: The person's name in the file, if it names people, or the number of a track.
    name: str | None = None


@dataclass(frozen=True)
class Found:
    """All people in a file."""

    source: Source
    people: list[Person]
    names: tuple[str, ...] | None = None
    times_s: dict[int, float] | None = None
    image_size: tuple[int, int] | None = None
    #: Frames in the file, some perhaps without people.
    frames: tuple[int, ...] = ()
    #: Whether the names are numbers of a tracker, of which one person may have several.
    are_tracks: bool = False


# Numbers x, y, score.


def triples(numbers: Any, where: str) -> Array:
    """Numbers x, y, score, x, y, score, ... as (K, 3); NaN, NaN, 0 where missing."""
    if not isinstance(numbers, list) or len(numbers) % 3:
        raise KeypointsError(f"{where}: not a list of x, y, score")
    for index, number in enumerate(numbers):
        if number is not None and type(number) not in (int, float):
            raise KeypointsError(f"{where}[{index}]: {short(number)} is not a number")
    try:
        flat = np.array([math.nan if number is None else number for number in numbers], np.float64)
    except OverflowError:
        raise KeypointsError(f"{where}: a number too large") from None
    return with_missing(flat.reshape(-1, 3), where)


def with_missing(values: Array, where: str) -> Array:
    """(K, 3) with NaN, NaN, 0 where a point is missing."""
    if (np.abs(values[:, :2]) > MAX_COORDINATE_PX).any() or np.isinf(values[:, 2]).any():
        raise KeypointsError(f"{where}: coordinates beyond {MAX_COORDINATE_PX:g} pixels")
    missing = np.isnan(values[:, :2]).any(axis=1) | (values[:, :2] == 0).all(axis=1)
    values[missing] = (np.nan, np.nan, 0)
    values[np.isnan(values[:, 2]), 2] = 0
    return values


def with_points(
    numbers: Any,
    keypoints: Keypoints,
    row: int,
    where: str,
    factor: int = 1,
    kept: tuple[int, ...] | None = None,
) -> list[Any] | None:
    """The numbers with the points of a row; unchanged numbers keep their digits; None if nothing changed.

    `kept`: the places of the joints among the points, if they are not all of them in their order.
    """
    before = triples(numbers, where)
    places = range(len(before)) if kept is None else kept
    if max(places, default=-1) >= len(before):
        raise KeypointsError(f"{where}: has changed since it was read")
    before = before[list(places)]
    before[:, 2] /= factor
    after = np.column_stack([keypoints.points[row], keypoints.scores[row]])
    if before.shape != after.shape:
        raise KeypointsError(f"{where}: has changed since it was read")
    changed = list(numbers)
    joints = different(before, after)
    for joint in joints:
        x, y, score = after[joint].tolist()
        if math.isnan(x) or math.isnan(y):
            new = [0, 0, 0]
        else:
            new = [x, y, round(score * factor) if factor > 1 else score]
        changed[3 * places[joint] : 3 * places[joint] + 3] = new
    return changed if len(joints) else None


def different(before: Array, after: Array) -> list[int]:
    """Joints that differ; the score of a missing point is not compared."""
    missing = np.isnan(before[:, :2]).any(axis=1) & np.isnan(after[:, :2]).any(axis=1)
    same = missing | (before == after).all(axis=1)
    return [int(joint) for joint in np.flatnonzero(~same)]


def check_all_placed(keypoints: Keypoints) -> None:
    """Refuses points that the file read has no person for."""
    for row, place in enumerate(keypoints.source.places):
        if place is None and not np.isnan(keypoints.points[row]).all():
            raise KeypointsError(
                f"{keypoints.source.path}: frame {keypoints.frames[row]} has no person to write points to"
            )
    check_finite(keypoints)
