"""Tracks an image sequence and examines it again: the input of Rohr's figures of a sequence."""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.reproduce.result import Progress
from memo.scene import model_scene
from memo.tracking import Track, Tracker

__all__ = ["Clip", "Look", "NobodyTracked", "Sequence", "clip_sequence", "scene_sequence"]

Luma = npt.NDArray[np.uint8]
Frames = Iterator[tuple[int, float, Luma]]

SEED = 0
RECTANGLES = 60  # largest number of frames of a clip whose rectangles are computed


class NobodyTracked(ValueError):
    """The video was read, but nobody was tracked in it; the message says why."""


@dataclass(frozen=True)
class Clip:
    """A video of one person who walks past a fixed camera, and its known parameters."""

    video: str | PathLike[str]
    height_m: float = 1.75
    camera: _memo.Camera | None = None
    fps: float | None = None


@dataclass(frozen=True)
class Look:
    """One frame with its neighbours and the results of the image stages."""

    row: int
    """Row of the walk."""
    frame: int
    luma: Luma
    after: Luma
    stages: _memo.ImageStages


@dataclass(frozen=True)
class Sequence:
    """A tracked sequence: its longest walk, the frames examined, and rectangles over time."""

    label: str
    """Its name: "the synthetic scene" or the name of a video."""
    height_m: float
    walk: _memo.Walk
    track: Track
    """Only the longest walk."""
    examples: tuple[Look, Look]
    """Two frames of the start."""
    shown: list[tuple[int, Luma]]
    """Four rows of the walk, spread evenly, with their frames."""
    rectangles: npt.NDArray[np.float64]
    """(N, 5): frame, left, top, right, bottom, pixels."""
    truth: dict[str, npt.NDArray[Any]] | None
    """Columns of `track.csv` with known truth, if there are any."""

    @property
    def camera(self) -> _memo.Camera:
        """The camera given or assumed."""
        return self.walk.camera

    def soles_m(self) -> npt.NDArray[np.float64]:
        """Positions (N, 3) from single rectangles, eqs. (3)-(6), without those no upright person spans."""
        found = []
        for _, left, top, right, bottom in self.rectangles:
            middle = 0.5 * (left + right)
            with contextlib.suppress(ValueError):
                place = self.camera.position_from_rectangle((middle, bottom), (middle, top), self.height_m)
                found.append(place)
        return np.array(found).reshape(-1, 3)

    def true(self, name: str) -> npt.NDArray[Any]:
        """The truth of a column in the frames of the track; only if there is one."""
        if self.truth is None:
            raise ValueError(f"{self.label} has no truth")
        at = np.searchsorted(self.truth["frame"], self.track.columns["frame"])
        return self.truth[name][at]


def scene_sequence(progress: Progress) -> Sequence:
    """The synthetic scene, tracked with the model it was drawn with, as the paper's was."""
    scene = model_scene(SEED)

    def frames() -> Frames:
        yield from (
            (k, float(t), f) for k, (t, f) in enumerate(zip(scene.times_s, scene.frames, strict=True))
        )

    tracker, count = Tracker(scene.height_m, scene.camera, adapt=False), len(scene.frames)
    return _sequence("the synthetic scene", scene.height_m, frames, count, tracker, scene.truth, progress)


def clip_sequence(clip: Clip, progress: Progress) -> Sequence:
    """A video. Raises `NobodyTracked` if no walker is found."""
    from memo.video import VideoReader

    def frames() -> Frames:
        with VideoReader(clip.video, rate_hz=clip.fps, shrink=None) as reader:
            yield from ((frame.index, frame.time_s, frame.luma) for frame in reader)

    with VideoReader(clip.video, rate_hz=clip.fps, shrink=None) as reader:
        count, shrink = reader.frame_count, reader.shrink
    # As in the paper, the walker of the figures is the average one.
    tracker = Tracker(clip.height_m, clip.camera and clip.camera.shrunk(shrink), adapt=False)
    return _sequence(Path(clip.video).name, clip.height_m, frames, count, tracker, None, progress)


def _sequence(
    label: str,
    height_m: float,
    frames: Callable[[], Frames],
    count: int | None,
    tracker: Tracker,
    truth: dict[str, npt.NDArray[Any]] | None,
    progress: Progress,
) -> Sequence:
    for done, (_, time_s, luma) in enumerate(frames()):
        progress(f"rohr: tracking {label}", done, count)
        tracker.update(luma, time_s)
    whole = tracker.finish()
    if not whole.walks:
        raise NobodyTracked(f"{label}: {whole.summary['message']}")
    longest = max(whole.walks, key=lambda walk: (walk.direction == "forward", len(walk)))
    track = Track([longest], whole.seek_report, whole.camera)
    row_of = {int(frame): row for row, frame in enumerate(track.columns["frame"])}
    example_rows = _spread(sorted(row_of[int(f)] for f in longest.start.frame if int(f) in row_of), 2)
    shown_rows = _spread(range(len(track)), 4)
    step = max(1, len(track) // RECTANGLES)
    examples: list[Look] = []
    shown: list[tuple[int, Luma]] = []
    rectangles: list[list[float]] = []
    window: deque[tuple[int, Luma]] = deque(maxlen=3)
    for done, (index, _, luma) in enumerate(frames()):
        progress(f"rohr: examining {label} again", done, count)
        window.append((index, np.array(luma)))
        if len(window) < 3 or window[1][0] not in row_of:
            continue
        (_, before), (at, here), (_, after) = window
        row = row_of[at]
        if row not in example_rows and row not in shown_rows and row % step:
            continue
        stages = _memo.image_stages(before, here, after)
        if stages is not None:
            rectangles.append([at, *stages.rectangle])
            if row in example_rows:
                examples.append(Look(row, at, here, after, stages))
        if row in shown_rows:
            shown.append((row, here))
    if len(examples) < 2:
        raise NobodyTracked(f"{label}: nothing moves in the frames of the start")
    return Sequence(
        label, height_m, longest, track, (examples[0], examples[1]), shown, np.array(rectangles), truth
    )


def _spread(rows: Any, count: int) -> list[int]:
    """This many of the rows, spread evenly and away from both ends."""
    places = (np.arange(count) + 0.5) / count * len(rows)
    return [rows[int(place)] for place in places]
