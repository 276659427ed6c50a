"""One person's image points over time: the common type of all formats.

A point at (0, 0) or without coordinates is missing, NaN here. Frames are numbered without gaps: missing
frames become missing points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.missing import real_numbers
from memo.table import data_frame
from memo.wording import counted

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["Array", "Keypoints", "KeypointsError", "OptionError", "Someone", "Source", "layouts"]

Array = npt.NDArray[np.float64]

MAX_FRAME = 10**9
MAX_COORDINATE_PX = 1e6
# A sequence may have gaps, but a video's frame numbers are not mostly gaps.
_MAX_FRAMES_PER_SEEN = 20
_MAX_GAP = 1000
_LARGEST_PART = 1.5  # of width or height; points may lie a little outside the picture


class KeypointsError(ValueError):
    """Keypoints that cannot be read or written; the message says which file and why, in one line."""

    def __init__(self, message: str) -> None:
        # Names and cells of damaged files may contain any characters.
        super().__init__("".join(character if character.isprintable() else "?" for character in message))


class OptionError(KeypointsError):
    """Keypoints that need another value of an option of `read_keypoints`."""

    def __init__(self, message: str, option: str) -> None:
        super().__init__(f"{message} ({option})")
        self.message = message
        self.option = option


def layouts() -> dict[str, tuple[str, ...]]:
    """The known orders of points: the names of the joints of each layout."""
    return {name: tuple(_memo.keypoint_layout(name)[1]) for name in _memo.keypoint_layouts()}


class Someone(NamedTuple):
    """One of the people in a file."""

    name: str
    """As in the file; if it does not name people, their number, the most prominent person first."""
    frames: int
    """Number of frames in which the person was detected."""
    first_frame: int
    last_frame: int
    size_px: float
    """Median diagonal of the bounding box of the points, pixels."""


@dataclass(frozen=True)
class Source:
    """The source of points, and how they are written back."""

    path: Path
    #: Writes a file or folder like the one read, with other points; None if there was no file.
    write_like: Callable[[Path, Keypoints], None] | None
    #: For each frame the person's place in the file, or None.
    places: tuple[Any, ...] = ()
    #: For a folder: all its files.
    files: tuple[Path, ...] = ()


@dataclass(frozen=True, repr=False, eq=False)
class Keypoints:
    """One person's image points over time."""

    points: Array
    """(T, K, 2) pixels, u right and v down; NaN where missing."""
    scores: Array
    """(T, K) the detector's confidence; 0 if missing."""
    names: tuple[str, ...]
    """The K joints, in the spelling of memo."""
    times_s: Array
    """(T,) seconds."""
    frames: npt.NDArray[np.int64]
    """(T,) frame numbers, without gaps."""
    layout: str | None
    """Name of the detector's order of points; `None` for a table, which names its points."""
    image_size: tuple[int, int] | None
    """Width and height of the images, pixels, if the file gives them."""
    people: npt.NDArray[np.int64]
    """(T,) number of people in the file in each frame."""
    source: Source
    """What is needed to write back."""
    everyone: tuple[Someone, ...] = ()
    """The people in the file, the most prominent first, by size times score in all frames."""
    doubts: tuple[str, ...] = ()
    """Where the person may have been exchanged with another, in sentences."""

    @classmethod
    def from_arrays(
        cls,
        points: npt.ArrayLike,
        scores: npt.ArrayLike | None = None,
        *,
        names: Sequence[str] | str,
        times_s: npt.ArrayLike | None = None,
        fps: float | None = None,
        frames: npt.ArrayLike | None = None,
        image_size: tuple[int, int] | None = None,
    ) -> Keypoints:
        """Keypoints in memory: `points` (T, K, 2) pixels, NaN or masked if missing; `scores` (T, K), else 1.

        `names`: the K joints, or the name of a layout such as "COCO_17". `frames` (T,): increasing whole
        numbers, else 0, 1, ...; their gaps become missing points. Either `times_s` (T,), seconds, or `fps`.
        """
        layout, own_names = _named(names)
        given = real_numbers(points)
        if given.ndim != 3 or given.shape[1:] != (len(own_names), 2) or not len(given):
            raise KeypointsError(f"wanted points of shape (T, {len(own_names)}, 2), got {given.shape}")
        count = len(given)
        confidence = np.ones(given.shape[:2]) if scores is None else real_numbers(scores)
        if confidence.shape != given.shape[:2]:
            raise KeypointsError(f"wanted scores of shape {given.shape[:2]}, got {confidence.shape}")
        numbers, times = _timeline(frames, times_s, fps, count)
        missing = np.isnan(given).any(axis=2)
        given[missing] = np.nan
        confidence[missing] = 0
        if np.isinf(given).any() or not np.isfinite(confidence).all():
            raise KeypointsError("points must be finite or NaN, scores finite")
        every = np.arange(numbers[0], numbers[-1] + 1)
        rows = numbers - numbers[0]
        all_points = np.full((len(every), len(own_names), 2), np.nan)
        all_scores = np.zeros((len(every), len(own_names)))
        all_points[rows], all_scores[rows] = given, confidence
        return cls(
            points=all_points,
            scores=all_scores,
            names=own_names,
            times_s=np.interp(every, numbers, times),
            frames=every.astype(np.int64),
            layout=layout,
            image_size=None if image_size is None else checked_size(image_size),
            people=np.isfinite(all_points).any(axis=(1, 2)).astype(np.int64),
            source=Source(Path("arrays"), None),
        )

    def to_pandas(self) -> pandas.DataFrame:
        """One row per frame, with the columns of `write_csv`, as a `pandas.DataFrame`."""
        columns: dict[str, npt.NDArray[Any]] = {"frame": self.frames, "time_s": self.times_s}
        for index, name in enumerate(self.names):
            columns[f"{name}_u_px"], columns[f"{name}_v_px"] = self.points[:, index].T
            columns[f"{name}_score"] = self.scores[:, index]
        return data_frame(columns)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the paths of the points in the picture into `ax`, or new Axes, and returns them.
        Needs matplotlib."""
        from memo.plot import new_axes, plot_keypoints

        return plot_keypoints(new_axes() if ax is None else ax, self)

    def __repr__(self) -> str:
        seen = np.isfinite(self.points).all(axis=2).mean()
        crowd = f", up to {counted(self.people.max(), 'person', 'people')}" if self.people.max() > 1 else ""
        return (
            f"Keypoints({counted(len(self.names), 'point')}{f' of {self.layout}' if self.layout else ''}, "
            f"frames {self.frames[0]} to {self.frames[-1]}, {seen:.0%} seen{crowd})"
        )

    def check_pixels(self) -> None:
        """Refuses coordinates that are fractions of the picture's width and height, 0 to 1 or -1 to 1."""
        there = np.isfinite(self.points).all(axis=2)
        largest = float(np.abs(self.points[there]).max(initial=0))
        if there.sum() > 1 and largest <= _LARGEST_PART:
            raise KeypointsError(
                f"{self.source.path}: coordinates up to {largest:.3g}: these are fractions of the picture's "
                "width and height, and pixels are needed: multiply by them"
            )

    def replaced(self, points: npt.ArrayLike, scores: npt.ArrayLike) -> Keypoints:
        """The same keypoints with other points and scores of the same shapes; masked points are NaN."""
        new_points, new_scores = real_numbers(points), real_numbers(scores)
        for name, new, own in (("points", new_points, self.points), ("scores", new_scores, self.scores)):
            if new.shape != own.shape:
                raise KeypointsError(f"wanted {name} of shape {own.shape}, got {new.shape}")
        return replace(self, points=new_points, scores=new_scores)

    def write(self, path: str | PathLike[str]) -> None:
        """Writes a file or folder like the one read, with these points in it.

        Everything else is unchanged: other people, other fields, other columns. The result appears complete
        or not at all. The input is never overwritten, nor a folder that holds anything but an earlier result.
        `write_keypoints` writes a format of your choice.
        """
        out = Path(path)
        source = self.source.path
        if self.source.write_like is None:
            raise KeypointsError(f"{source}: no file was read; use write_keypoints")
        if out.resolve() == source.resolve() or (out.exists() and source.exists() and out.samefile(source)):
            raise KeypointsError(f"{out}: is the input; write to another place")
        self.source.write_like(out, self)


def frame_range(where: object, seen: set[int]) -> range:
    """The frames from the first to the last seen; refused if nearly all of them would be gaps."""
    first, last = min(seen), max(seen)
    span = last - first + 1
    if span > _MAX_FRAMES_PER_SEEN * len(seen) + _MAX_GAP:
        raise KeypointsError(f"{where}: frames {first} to {last}, but only {len(seen)} of them exist")
    return range(first, last + 1)


def check_rate(fps: Any) -> None:
    """Refuses a frame rate that is none; None is no rate."""
    if fps is not None and not (isinstance(fps, Real) and 0 < float(fps) < math.inf):
        raise KeypointsError(f"the frame rate must be positive, got {fps}")


def checked_size(size: Any) -> tuple[int, int]:
    """Width and height of a picture in pixels, as given by a user."""
    if (
        not isinstance(size, tuple | list | np.ndarray)
        or len(size) != 2
        or not all(is_whole(side) and 0 < side <= MAX_COORDINATE_PX for side in size)
    ):
        raise KeypointsError(f"image_size {size!r}: wanted width and height in whole pixels")
    return int(size[0]), int(size[1])


def is_whole(value: Any) -> bool:
    """Whether this is a whole number of Python or NumPy, and not True or False."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def check_finite(keypoints: Keypoints) -> None:
    """Refuses values that no format can store."""
    if np.isinf(keypoints.points).any() or not np.isfinite(keypoints.scores).all():
        raise KeypointsError("points must be finite or NaN, scores finite")


def _named(names: Sequence[str] | str) -> tuple[str | None, tuple[str, ...]]:
    """The layout, if one is named, and the joints in the spelling of memo."""
    try:
        if isinstance(names, str):
            layout, joints = _memo.keypoint_layout(names)
            return layout, tuple(joints)
        spelt = [_memo.joint_name(name) for name in names]
    except ValueError as error:
        raise KeypointsError(str(error)) from None
    unknown = [name for name, joint in zip(names, spelt, strict=True) if joint is None]
    if unknown or len(set(spelt)) < len(spelt):
        raise KeypointsError(f"names of different known joints are needed, got {', '.join(unknown or names)}")
    return None, tuple(joint for joint in spelt if joint is not None)


def _timeline(
    frames: npt.ArrayLike | None, times_s: npt.ArrayLike | None, fps: float | None, count: int
) -> tuple[npt.NDArray[np.int64], Array]:
    """Frame numbers and times, checked."""
    numbers = np.arange(count) if frames is None else np.asarray(np.ma.filled(frames, -1))
    whole = numbers.shape == (count,) and numbers.dtype.kind in "iu"
    if not whole or numbers[0] < 0 or numbers[-1] > MAX_FRAME or (np.diff(numbers) <= 0).any():
        raise KeypointsError(f"wanted {count} increasing frame numbers, whole and not below 0")
    frame_range("arrays", set(numbers.tolist()))
    if (times_s is None) == (fps is None):
        raise KeypointsError("give either times_s or fps")
    check_rate(fps)
    times = real_numbers(times_s) if fps is None else numbers / fps
    if times.shape != (count,) or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise KeypointsError(f"wanted {count} increasing times_s")
    return numbers.astype(np.int64), times
