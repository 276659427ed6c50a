"""Tracking from Python: `track` for files, `Tracker` for streams, `Track` for the result."""

from __future__ import annotations

import copy
import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from dataclasses import replace
from numbers import Integral
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.camera_motion import CameraMotion, FieldOfView
from memo.cycles import cycle_table, departure_sentences
from memo.files import EVENT_COLUMNS, TRACK_COLUMNS
from memo.gait import cadence_sentences, gait_table, lookup, symmetry_sentences
from memo.left_out import LeftOut, left_out_sentences, over_ground, stays_in_place, too_far_apart
from memo.notebook import table
from memo.panning import again
from memo.pixels import camera_of_video, columns_of_video, of_video
from memo.plausible import (
    LIKELY_MISTAKEN,
    assumed_height_sentences,
    beside_sentences,
    contradiction_sentences,
    given_height_sentences,
    has_usual_steps,
    implausible_sentences,
    measured_height_sentences,
    running_sentences,
    tilt_sentences,
)
from memo.table import data_frame
from memo.treadmill import is_heading_open, treadmill_figures, treadmill_sentence
from memo.turning import turned_deg, turning_words
from memo.wording import counted

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["Track", "Tracker", "fit_walk", "track"]

_log = logging.getLogger(__name__)

_ANGLE_COLUMNS = tuple(name for name in TRACK_COLUMNS if name.endswith("_deg"))
_WHOLE_NUMBERS = {"frame": np.int64, "walk": np.int64, "person": np.int64}


class Tracker:
    """Tracks everybody who walks through a stream of frames, in bounded memory.

    `height_m` is the body height from crown to sole, of everybody or of each person in order of appearance
    (given `camera`, a person has the one that the image shows if that is clear);
    people beyond such a list are measured. None measures it in the image of `camera`; without a camera
    either, that of the population is assumed, and standard deviations and intervals of all lengths contain
    its spread. Without `camera`, one is assumed from the image size, the horizontal field of view
    `fov_deg` and the height; the default is across the width of the image, or across its height if that is
    larger. The results lag one frame behind the input, or a thirtieth of a second at a higher frame rate.

    `gait`: "dense" or "sampled_10" (the paper's ten samples).
    `adapt=False` does not fit the person: angles are those of the average gait, moved by the tracked phase.
    `start_frames`: number of frames in the starting phase; at more than 30 frames per second, as many as
    last as long.
    `treadmill`: whether the person walks on a treadmill; None finds out.
    `compensate_gain`: follow exposure drift between frames.
    `background`: keep a slowly varying background, for people who stop.
    `steady`: estimate how the camera turns, and turn frames back to the view of the first one. Frames of a
    camera at rest are left as they are.
    `measure`: "rohr" (eq. 7) or "lowe" (eq. 10).
    `full_gradient`, `full_velocity`: edges of smaller gradient (grey levels per pixel) or image speed (pixels
    per frame) are weighted in proportion, w_G and w_V of eq. 11; None weights all equally.
    `part_weights`: w_K, 14 numbers in the order of `Track.contour_parts`.
    `reach_px`: how far the pictures in which people are followed go on beyond a frame, for a camera that
    pans: left, top, right and bottom, pixels; 0 by default. `reach_from_rad`: the rotation vector from the
    first frame's camera to the one of these pictures. What a video needs is `CameraMotion.wider` of a
    first `Track`.

    Defaults: `fov_deg` 62, `gait` "dense", `start_frames` 13, `measure` "rohr".
    """

    def __init__(
        self,
        height_m: float | Sequence[float] | None = None,
        camera: _memo.Camera | None = None,
        *,
        fov_deg: float | FieldOfView | None = None,
        gait: str | None = None,
        adapt: bool = True,
        start_frames: int | None = None,
        treadmill: bool | None = None,
        compensate_gain: bool = False,
        background: bool = False,
        steady: bool = True,
        measure: str | None = None,
        full_gradient: float | None = None,
        full_velocity: float | None = None,
        part_weights: Sequence[float] | None = None,
        reach_px: Sequence[int] | None = None,
        reach_from_rad: Sequence[float] | None = None,
    ) -> None:
        self._field_of_view = fov_deg if isinstance(fov_deg, FieldOfView) else None
        if isinstance(fov_deg, FieldOfView):
            fov_deg = fov_deg.horizontal_deg
        self.options: dict[str, Any] = {
            "height_m": height_m,
            "fov_deg": fov_deg,
            "gait": gait,
            "adapt": adapt,
            "start_frames": start_frames,
            "treadmill": treadmill,
            "compensate_gain": compensate_gain,
            "background": background,
            "steady": steady,
            "measure": measure,
            "full_gradient": full_gradient,
            "full_velocity": full_velocity,
            "part_weights": part_weights,
            "reach_px": reach_px,
            "reach_from_rad": reach_from_rad,
        }
        """All options but the camera; a run's record has them as they were, whatever the defaults become."""
        usual = _memo.defaults("track")
        for name in ("gait", "start_frames", "measure"):
            if self.options[name] is None:
                self.options[name] = usual[name]
        self._core = _memo.Tracker(camera=camera, **self.options)
        self._camera = camera
        self._size: tuple[int, int] | None = None
        self._walks: list[_memo.Walk] = []

    def update(
        self, frame: npt.NDArray[np.uint8], time_s: float, boxes: npt.ArrayLike | None = None
    ) -> _memo.WalkerState | None:
        """Takes the next frame, (H, W) uint8; times must increase.

        `boxes`: (N, 4) boxes around the people in the frame, from a detector or another tracker: left, top,
        width and height in pixels, from crown to sole. With boxes, possibly none, nobody is looked for
        elsewhere; None looks for what moves.

        Returns the filtered state of the first person being followed, or None if there is none; `people` has
        everybody's.
        """
        self._core.update(frame, time_s, boxes)
        height, width = frame.shape
        self._size = width, height
        return next(iter(self._core.people()), None)

    def people(self) -> list[_memo.WalkerState]:
        """The filtered states of everybody who is followed, in order of appearance: as from `update`."""
        return self._core.people()

    def take_finished(self) -> list[_memo.Walk]:
        """The walks that have ended since the last call; on an endless stream, call it regularly."""
        return self._core.take_finished()

    def finish(self) -> Track:
        """Ends the stream and returns all walks not returned before."""
        self._core.finish()
        self._walks += self._core.take_finished()
        wider = self._core.wider()
        motion = CameraMotion(
            self._core.camera_motion(),
            self._core.lost_views(),
            camera_given=self._camera is not None,
            wider=None if wider is None else dict(zip(("reach_px", "reach_from_rad"), wider, strict=True)),
            field_of_view=self._field_of_view,
        )
        found = Track(
            self._walks,
            self._core.seek_report(),
            self._camera,
            camera_motion=motion,
            left_out=[LeftOut.of(left) for left in self._core.left_out()],
            options=self.options,
            size=self._size,
        )
        if _log.isEnabledFor(logging.INFO):
            for sentence in found.sentences:
                _log.info("%s", sentence)
        return found

    def __repr__(self) -> str:
        seen = self._core.seek_report().frames
        return f"Tracker({'following' if self._core.people() else 'seeking'}, {counted(seen, 'frame')} seen)"


def track(
    frames: Iterable[npt.NDArray[np.uint8]],
    *,
    height_m: float | Sequence[float] | None = None,
    times_s: Iterable[float] | None = None,
    fps: float | None = None,
    camera: _memo.Camera | None = None,
    boxes: Iterable[npt.ArrayLike] | None = None,
    progress: Callable[[int, int | None], object] | None = None,
    fov_deg: float | FieldOfView | None = None,
    gait: str | None = None,
    adapt: bool = True,
    start_frames: int | None = None,
    treadmill: bool | None = None,
    compensate_gain: bool = False,
    background: bool = False,
    steady: bool = True,
    measure: str | None = None,
    full_gradient: float | None = None,
    full_velocity: float | None = None,
    part_weights: Sequence[float] | None = None,
    reach_px: Sequence[int] | None = None,
    reach_from_rad: Sequence[float] | None = None,
) -> Track:
    """Tracks everybody who walks through frames, (H, W) uint8 each, given `times_s` or `fps`.

    `height_m`: body height, or those of people in order of appearance; None measures or assumes it
    (`Tracker`).
    `boxes`: of each frame, the (N, 4) boxes around the people in it (`Tracker.update`); None looks for what
    moves.
    `progress` is called with the number of frames done and the total, None if `frames` has no length;
    the options from `fov_deg` on are those of `Tracker`. Pixels in the result are those of the given frames.
    Frames of a camera that pans are tracked again in larger pictures (`reach_px`), and without `camera` and
    `fov_deg` with the field of view that the pan shows (`field_of_view`), unless they can be read only once;
    `progress` then begins again.
    An interrupt (Ctrl-C) passes through; use `Tracker` to keep what was tracked until then.
    """
    if (times_s is None) == (fps is None):
        raise ValueError("give either times_s or fps")
    if fps is not None and not (np.isfinite(fps) and fps > 0):
        raise ValueError(f"fps must be a positive number, got {fps}")
    options: dict[str, Any] = {"camera": camera, "fov_deg": fov_deg}
    options |= {"reach_px": reach_px, "reach_from_rad": reach_from_rad}
    is_read_once = any(given is not None and iter(given) is given for given in (frames, times_s, boxes))
    while True:
        tracker = Tracker(
            height_m,
            gait=gait,
            adapt=adapt,
            start_frames=start_frames,
            treadmill=treadmill,
            compensate_gain=compensate_gain,
            background=background,
            steady=steady,
            measure=measure,
            full_gradient=full_gradient,
            full_velocity=full_velocity,
            part_weights=part_weights,
            **options,
        )
        _feed(tracker, frames, times_s, fps, boxes, progress)
        found = tracker.finish()
        changes = {} if is_read_once else again(found.camera_motion, options, lambda: frames)
        if not changes:
            return found
        options |= changes


def fit_walk(
    walk: _memo.Walk,
    frames: Iterable[npt.NDArray[np.uint8]],
    *,
    empty: npt.NDArray[np.uint8] | None = None,
    height_sd: float | None = None,
    frame_sd_deg: float | None = None,
) -> _memo.Walk:
    """Fits the person of a tracked walk again, to pictures of one's own; returns a walk with this fit.

    `frames` are pictures of all frames from the first one that was tracked, (H, W) uint8 each, as large as
    the frames: the frames themselves, frames that were cleaned, or silhouettes from a segmentation, 255 on
    the person and 0 elsewhere. `empty` is the picture without people, 0 everywhere for silhouettes; None
    takes the median of the frames where the person is elsewhere; of a camera that moves it is as the first
    frame's camera shows it, and of one that pans it must be None or black. Other people are taken for part
    of the scene. The walk must be one that was tracked in this process, not one from a file or from a pickle.

    `height_sd`: standard deviation of a given body height, as a share of it. `frame_sd_deg`: standard
    deviation of hip and knee about the person's own curves; ankle and arms have twice as much. If the model
    does not fit, the new walk has `fit` None and the reason in `fit_problem`.

    Defaults: `height_sd` 0.012, `frame_sd_deg` 3.0.
    """
    wanted = walk.columns["frame"].tolist()
    own = set(wanted)
    pictures = {number: frame for number, frame in enumerate(frames) if number in own}
    if absent := [number for number in wanted if number not in pictures]:
        raise ValueError(f"the walk goes on to frame {absent[-1]}, but there are fewer frames")
    return _memo.fit_walk(
        walk,
        [pictures[number] for number in wanted],
        empty=empty,
        height_sd=height_sd,
        frame_sd_deg=frame_sd_deg,
    )


_ABSENT: Any = object()


def _feed(
    tracker: Tracker,
    frames: Iterable[npt.NDArray[np.uint8]],
    times_s: Iterable[float] | None,
    fps: float | None,
    boxes: Iterable[npt.ArrayLike] | None,
    progress: Callable[[int, int | None], object] | None,
) -> None:
    """Gives the tracker all frames with their times and boxes."""
    count = len(frames) if isinstance(frames, Sized) else None
    given = {"times_s": times_s, "boxes": boxes}
    each = {name: iter(values) for name, values in given.items() if values is not None}
    index = -1
    for index, frame in enumerate(frames):
        own: dict[str, Any] = {name: next(values, _ABSENT) for name, values in each.items()}
        for name, value in own.items():
            if value is _ABSENT:
                raise ValueError(f"{name} has {counted(index, 'value')}, but there are more frames than that")
        time_s = float(own["times_s"]) if "times_s" in own else index / float(fps or 1)
        tracker.update(frame, time_s, own.get("boxes"))
        if progress is not None:
            progress(index + 1, count)
    for name, values in each.items():
        if next(values, _ABSENT) is not _ABSENT:
            raise ValueError(f"{name} has more values than the {counted(index + 1, 'frame')}")


ALONG_SIGHT = float(np.cos(np.radians(35)))
"""Paths that are within this angle of the line of sight, as its cosine, lead towards the camera or away."""

_MOST_SHRINK = 1000

_REACH_M = 1.0
_REACH_MPS = 2.5
"""Nobody walks farther than this within a second; the places themselves may be off by `_REACH_M`."""

SMALLEST_PX = 30
"""People less high in the tracked images have no limbs that are seen, as in `memo_core::track::left_out`."""

_FRAMES = ("columns", "gait_parameters", "cycles")


class Track:
    """All walks of a video: the contents of `track.csv` and `events.csv`, and all intermediate results.

    Pixels are those of the frames given to the tracker, or those of the video from which they were averaged
    (`of_video`).
    """

    def __init__(
        self,
        walks: Sequence[_memo.Walk],
        seek_report: _memo.SeekReport,
        camera: _memo.Camera | None = None,
        *,
        shrink: int = 1,
        video_size: tuple[int, int] | None = None,
        camera_motion: CameraMotion | None = None,
        left_out: Sequence[LeftOut] = (),
        options: Mapping[str, Any] | None = None,
        size: tuple[int, int] | None = None,
    ) -> None:
        self.walks: list[_memo.Walk] = list(walks)
        self._people = {person: k for k, person in enumerate(sorted({walk.person for walk in walks}))}
        self.seek_report: _memo.SeekReport = seek_report
        self.shrink: int = shrink
        """Pixels of the video per pixel of a given frame, per axis: 1 unless set by `of_video`."""
        self._camera = camera
        self._options: Mapping[str, Any] = _memo.defaults("track") if options is None else options
        self._is_everybody = True
        self._video_size = video_size
        self._size = size
        self.camera_motion: CameraMotion = camera_motion or CameraMotion()
        """The camera in every frame; the world of the results is that of the first one."""
        self.left_out: list[LeftOut] = list(left_out)
        """Who or what moved and was not followed, in order of the first frames; at most the 100 who were seen
        longest, of `seek_report.left_out`."""

    def of_video(self, shrink: int, size: tuple[int, int] | None = None) -> Track:
        """The same track in pixels of the video whose frames were averaged `shrink` by `shrink`, as
        `VideoReader` with `shrink` does; `size`: width and height of the video, pixels.

        It changes the columns in pixels, the contours and the camera.
        """
        shrink = self._checked_shrink(shrink, size)
        scaled = copy.copy(self)
        scaled.shrink, scaled._video_size = shrink, size
        scaled.camera_motion = replace(self.camera_motion, shrink=shrink)
        scaled.left_out = [left.of_video(shrink // self.shrink) for left in self.left_out]
        return scaled

    def _checked_shrink(self, shrink: int, size: tuple[int, int] | None) -> int:
        """`shrink` of a video whose frames have the size of those that were tracked."""
        is_whole = isinstance(shrink, Integral) and not isinstance(shrink, bool)
        if not (is_whole and 1 <= shrink <= _MOST_SHRINK):
            raise ValueError(f"shrink must be a whole number from 1 to {_MOST_SHRINK}, got {shrink!r}")
        if shrink % self.shrink:
            raise ValueError(
                f"the track is of a video whose frames were averaged {self.shrink} by {self.shrink}: "
                f"shrink must be a multiple of {self.shrink}, got {shrink}"
            )
        camera = self._main.camera if self._main is not None else self._camera
        if size is not None and camera is not None:
            averaged, tracked = tuple(side // shrink for side in size), tuple(camera.size)
            if averaged != tracked:
                of, wanted, got = ("x".join(map(str, sides)) for sides in (size, tracked, averaged))
                raise ValueError(
                    f"size {of} averaged {shrink} by {shrink} is {got}, but the tracked frames are {wanted}"
                )
        return int(shrink)

    @property
    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """One array per column of `track.csv`; one walk after another. Of a walk whose person could not be
        measured, angles are NaN."""
        if not self.walks:
            return {name: np.empty(0, _WHOLE_NUMBERS.get(name, float)) for name in TRACK_COLUMNS}
        people = self.people
        tables = [
            {**walk.columns, "walk": np.full(len(walk), k), "person": np.full(len(walk), people[k])}
            for k, walk in enumerate(self.walks)
        ]
        columns = {name: np.concatenate([table[name] for table in tables]) for name in TRACK_COLUMNS}
        return columns_of_video(columns, self.shrink)

    @property
    def people(self) -> list[int]:
        """The person of each walk, counted from 0 in order of appearance."""
        return [self._people[walk.person] for walk in self.walks]

    def person_at(self, u_px: float, v_px: float, frame: int) -> int | None:
        """The person whose model covers a point of the picture in a frame; of several, the one whose middle
        is nearest. None if there is nobody."""
        persons, found, point = self.columns["person"], [], np.array([u_px, v_px])
        for row, (low, high) in self.extents(frame):
            if (low <= point).all() and (point <= high).all():
                found.append((float(np.linalg.norm(point - (low + high) / 2)), int(persons[row])))
        return min(found)[1] if found else None

    def person_in(
        self, left_px: float, top_px: float, width_px: float, height_px: float, frame: int
    ) -> int | None:
        """The person who overlaps most with a box in a frame: intersection over union of the box and that
        around the model. None if nobody shares half of the smaller of the two."""
        persons, found = self.columns["person"], []
        start, size = np.array([left_px, top_px]), np.array([width_px, height_px])
        for row, (low, high) in self.extents(frame):
            shared = float(np.prod(np.clip(np.minimum(high, start + size) - np.maximum(low, start), 0, None)))
            areas = float(np.prod(high - low)), float(np.prod(size))
            if shared > 0 and 2 * shared >= min(areas):
                found.append((shared / (sum(areas) - shared), -int(persons[row])))
        return -max(found)[1] if found else None

    def extents(self, frame: int) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
        """The rows of a frame, each with the box around its model: (2, 2) pixels, the corners at the upper
        left and the lower right."""
        for row in np.flatnonzero(self.columns["frame"] == frame).tolist():
            points = self.contours(row).reshape(-1, 2)
            points = points[np.isfinite(points).all(axis=1)]
            if len(points):
                yield row, np.stack([points.min(axis=0), points.max(axis=0)])

    def of_person(self, person: int) -> Track:
        """The walks of one person alone, who keeps the number of the column `person`."""
        walks = [walk for walk, own in zip(self.walks, self.people, strict=True) if own == person]
        if not walks:
            there = ", ".join(map(str, sorted(set(self.people)))) or "nobody"
            raise ValueError(f"there is no person {person}; people of the track: {there}")
        alone = copy.copy(self)
        alone.walks = walks
        alone._is_everybody = False
        return alone

    @property
    def events(self) -> list[dict[str, Any]]:
        """Heel strikes and toe-offs, one walk after another: `time_s, frame, event, side, walk, person`."""
        people = self.people
        return [
            dict(
                zip(
                    EVENT_COLUMNS,
                    (event.time_s, event.frame, event.event, event.side, k, people[k]),
                    strict=True,
                )
            )
            for k, walk in enumerate(self.walks)
            for event in walk.events
        ]

    @property
    def gait_parameters(self) -> dict[str, npt.NDArray[Any]]:
        """The columns of `gait_parameters.csv`, see `memo.gait.DEFINITIONS`; one walk after another."""
        return gait_table((walk.gait_parameters for walk in self.walks), self.people)

    @property
    def cycles(self) -> dict[str, npt.NDArray[Any]]:
        """The columns of `cycles.csv`: every gait cycle of each side at 0 to 100 %, and their mean. A walk
        whose sides are ambiguous has none, as it has no gait parameters by side."""
        return cycle_table((walk.cycles if _has_sides(walk) else [] for walk in self.walks), self.people)

    @property
    def sentences(self) -> list[str]:
        """The findings in sentences, one walk after another."""
        said = self.camera_motion.sentences + self._flicker_sentences() + self._height_sentences()
        left_out = left_out_sentences(self.left_out, self.seek_report.left_out)
        if self._options.get("treadmill") is False and any(map(stays_in_place, self.left_out)):
            left_out.append(_PERHAPS_ON_A_TREADMILL)
        if not self.walks:
            return [self.summary["message"], *said, *left_out]
        for index, walk in enumerate(self.walks):
            camera_given = self.camera_motion.camera_given
            told = assumed_height_sentences(
                walk, camera_given=camera_given, heights_given=self._options.get("height_m") is not None
            )
            told += [sentence for sentence in [fit_sentence(walk)] if sentence is not None]
            told += [self._message(walk), *self._joined(index)]
            told += measured_height_sentences(walk, camera_given=self._camera is not None)
            unseen = cadence_sentences(self.gait_parameters, index)
            told += unseen
            told += running_sentences(walk, self._pace(walk)[0])
            told += implausible_sentences(walk)
            told += beside_sentences(walk)
            if walk.p_swapped > LIKELY_MISTAKEN:
                chance = f"probability {walk.p_swapped:.0%}"
                told.append(f"Left and right may be swapped ({chance}): check them before use.")
            if _is_in_place(walk) and has_usual_steps(walk):
                is_sure = walk.p_swapped <= LIKELY_MISTAKEN and not is_heading_open(walk)
                told += symmetry_sentences(self.gait_parameters, index) if is_sure and not unseen else []
                told += departure_sentences(walk.departures) if is_sure else []
            whose = ""
            if len(self.walks) > 1:
                whose = f"Walk {index} (person {self.people[index]}): "
            elif self.people[index] > 0:
                whose = f"Person {self.people[index]}: "
            said += [whose + sentence for sentence in told]
        return said + tilt_sentences(self.walks[0].camera_tilt) + left_out

    def _height_sentences(self) -> list[str]:
        given = np.atleast_1d(np.asarray(self._options.get("height_m"))).tolist()
        if not (self.walks and self._is_everybody and len(given) > 1):
            return []
        return given_height_sentences(given, zip(self.people, self.walks, strict=True))

    def _flicker_sentences(self) -> list[str]:
        seek = self.seek_report
        if not seek.frames_relit:
            return []
        return [
            f"The brightness of the picture changes by up to {seek.largest_flicker:.0%}: "
            f"of {counted(seek.frames, 'frame')}, {counted(seek.frames_relit, 'was', 'were')} made as bright "
            "as the others."
        ]

    def _joined(self, index: int) -> list[str]:
        """Says why a walk has the person of an earlier one: it begins near where that one ended."""
        people = self.people
        earlier = [k for k in range(index) if people[k] == people[index]]
        if not earlier:
            return []
        before = max(earlier, key=lambda k: self.walks[k].columns["time_s"][-1])
        old, new = self.walks[before].columns, self.walks[index].columns
        apart_m = np.hypot(new["x_m"][0] - old["x_m"][-1], new["y_m"][0] - old["y_m"][-1])
        later_s = new["time_s"][0] - old["time_s"][-1]
        if apart_m > _REACH_M + _REACH_MPS * max(later_s, 0.0):
            return [
                f"This may be the same person as in walk {before}, but the places do not agree: it begins "
                f"{later_s:.1f} s later, {apart_m:.1f} m from where that walk ended, and nobody walks so far "
                "in that time. At least one of the two is in a wrong place."
            ]
        return [
            f"This is the same person as in walk {before}: it begins {later_s:.1f} s later, "
            f"{apart_m:.1f} m from where that walk ended."
        ]

    @property
    def records(self) -> list[dict[str, Any]]:
        """Every walk: its times, direction, certainty and fit, and what `memo.explain` needs besides the
        video."""
        return [
            {
                "message": self._message(walk),
                "start_s": float(walk.columns["time_s"][0]),
                "end_s": float(walk.columns["time_s"][-1]),
                "direction": self._way(walk),
                "gait": walk.direction,
                "p_swapped": walk.p_swapped,
                "p_other_heading": walk.treadmill.p_other_heading if walk.treadmill else None,
                "person": person,
                "fit": _fit(walk),
                **walk.record,
            }
            for walk, person in zip(self.walks, self.people, strict=True)
        ]

    @property
    def camera(self) -> _memo.Camera | None:
        """The camera given, or the one assumed for the longest walk."""
        main = self._main
        camera = main.camera if main is not None else self._camera
        if camera is None or self.shrink == 1:
            return camera
        return _memo.Camera.from_parameters(
            camera_of_video(camera.parameters(), self.shrink, self._video_size)
        )

    @property
    def start(self) -> _memo.WalkStart | None:
        """The starting phase of the longest walk; None if there is no walk."""
        return self._main.start if self._main is not None else None

    @property
    def measured(self) -> dict[str, npt.NDArray[Any]]:
        """Raw measurements `x`, `z` (metres) and `phase` before filtering, one per row; NaN if missing."""
        tables = [walk.measured for walk in self.walks]
        x, z, phase = np.concatenate(tables).T if tables else np.empty((3, 0))
        return {"x": x, "z": z, "phase": phase}

    def contours(self, row: int) -> npt.NDArray[np.float64]:
        """Visible model contours of a row, (segments, 2, 2) pixels."""
        contours = self._located(row)[0]
        return contours if self.shrink == 1 else of_video(contours, self.shrink)

    def contour_parts(self, row: int) -> npt.NDArray[np.uint8]:
        """The body part of each segment of `contours`: 0 head, 1 torso, 2-4 right arm, 5-7 left arm,
        8-10 right leg, 11-13 left leg."""
        return self._located(row)[1]

    def _located(self, row: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8]]:
        left = row
        for walk in self.walks:
            if 0 <= left < len(walk):
                return walk.contours(left)
            left -= len(walk)
        raise IndexError(f"row {row} of a track with {counted(len(self), 'row')}")

    @property
    def _main(self) -> _memo.Walk | None:
        return max(self.walks, key=lambda walk: (walk.direction == "forward", len(walk)), default=None)

    @property
    def summary(self) -> dict[str, Any]:
        """The findings: `status` ("tracked", "walking backwards", "never fully visible", "not walking" or
        "nobody"), `message` as a sentence, and the figures of the longest walk."""
        main = self._main
        if main is None:
            return {
                "status": self._why_nobody(),
                "message": self._nobody_message(),
                "walks": 0,
                "people": 0,
                "left_out": self.seek_report.left_out,
                "frames_relit": self.seek_report.frames_relit,
                "camera_motion": self.camera_motion.summary,
            }
        speed, cadence = self._pace(main)
        return {
            "status": "tracked" if main.direction == "forward" else "walking backwards",
            "message": self._message(main),
            "walks": len(self.walks),
            "people": max(self.people) + 1,
            "left_out": self.seek_report.left_out,
            "frames_relit": self.seek_report.frames_relit,
            "direction": self._way(main),
            "turned_deg": turned_deg(main),
            "gait": main.direction,
            "p_other_gait": main.p_other_direction,
            "p_swapped": main.p_swapped,
            "speed_mps": -speed if main.direction == "backward" else speed,
            **treadmill_figures(main),
            "cadence_steps_per_min": cadence,
            "height_m": main.height.height_m,
            "height_sd_m": main.height.sd_m,
            "height_source": main.height.source,
            "measured_height_m": main.measured_height.height_m if main.measured_height else None,
            "measured_height_sd_m": main.measured_height.sd_m if main.measured_height else None,
            "doubts": [
                *contradiction_sentences(main),
                *running_sentences(main, speed),
                *implausible_sentences(main),
                *beside_sentences(main),
            ],
            "fit": _fit(main),
            "camera_motion": self.camera_motion.summary,
        }

    @classmethod
    def _message(cls, walk: _memo.Walk) -> str:
        times_s = walk.columns["time_s"]
        speed, cadence = cls._pace(walk)
        if walk.treadmill is not None:
            return treadmill_sentence(walk, times_s[-1] - times_s[0], cadence)
        manner = "walks" if walk.direction == "forward" else "walks backwards"
        sure = walk.p_other_direction < 0.1
        # The feet show where the person goes, and not which way the person faces.
        way = cls._way(walk) + " (whether forwards or backwards is not seen)" * walk.is_frontal
        return (
            f"Somebody {manner} {way}{turning_words(walk)} for {times_s[-1] - times_s[0]:.1f} s"
            f" at {speed:.2f} m/s"
            + (f", {cadence:.0f} steps per minute" if np.isfinite(cadence) else "")
            + ("." if sure else f"; the direction is not certain (p = {1 - walk.p_other_direction:.2f}).")
        )

    @staticmethod
    def _pace(walk: _memo.Walk) -> tuple[float, float]:
        """Speed, m/s, never negative, and cadence, steps per minute; NaN for a walk that is too short."""
        table = gait_table([walk.gait_parameters])
        speed, cadence = (float(lookup(table, 0, name)["value"]) for name in ("speed", "cadence"))
        if np.isnan(speed):
            speed = float(np.median(walk.columns["speed_mps"]))
        return abs(speed), cadence

    @staticmethod
    def _way(walk: _memo.Walk) -> str:
        if walk.treadmill is not None:
            return "on a treadmill"
        columns = walk.columns
        ends = np.column_stack([columns[f"right_hip_{axis}_m"][[0, -1]] for axis in "xyz"])
        ahead, sight = (ends[1] - ends[0])[:2], (ends.mean(0) - walk.camera.position)[:2]
        along = float(ahead @ sight) / float(np.linalg.norm(ahead) * np.linalg.norm(sight))
        if abs(along) > ALONG_SIGHT:
            return "away from the camera" if along > 0 else "towards the camera"
        first_px, last_px = walk.camera.project(ends)[:, 0]  # in one view, wherever the camera looked
        return "left to right" if last_px > first_px else "right to left"

    def _why_nobody(self) -> str:
        seek = self.seek_report
        if over_ground(self.left_out):
            return "not walking"
        if seek.frames_with_candidate == 0:
            return "nobody"
        if seek.refused_starts:
            return "not walking"
        if seek.frames_cut_off > 0.5 * seek.frames_with_candidate:
            return "never fully visible"
        return "nobody"

    def _nobody_message(self) -> str:
        if known := over_ground(self.left_out) or too_far_apart(self.left_out):
            return known
        moving, needed = self.seek_report.frames_with_candidate, self.seek_report.start_frames
        why = self._why_nobody()
        if why == "nobody" and 0 < moving < needed:
            return (
                f"Nobody was seen walking: something moves in only {counted(moving, 'frame')}, and a walk is "
                f"found in {needed}."
            )
        if self._size is not None and min(self._size) < 1.5 * SMALLEST_PX:
            width, height = (self.shrink * side for side in self._size)
            least = counted(self.shrink * SMALLEST_PX, "pixel")
            has = f"the picture has only {width}x{height}"
            return f"{_NOBODY[why]} Nobody less than {least} high is seen, and {has}."
        if why == "not walking" and self._options.get("treadmill"):
            return f"{_NOBODY[why]} {_ONLY_ON_A_TREADMILL}"
        if why == "not walking" and self._camera is None:
            return _NOT_WALKING_WITHOUT_CAMERA
        return _NOBODY[why]

    def to_pandas(self, table: str = "columns") -> pandas.DataFrame:
        """A table as a `pandas.DataFrame`: "columns" (one row per frame), "gait_parameters" or "cycles"."""
        if table not in _FRAMES:
            raise ValueError(f"table must be one of {', '.join(_FRAMES)}, got {table!r}")
        return data_frame(getattr(self, table))

    def plot(self, what: str = "knee", ax: Axes | None = None) -> Axes:
        """Draws a quantity over time into `ax`, or new Axes, and returns them.

        `what`: "hip", "knee", "shoulder" or "elbow" (flexion of both sides, degrees, with the heel strikes),
        or a column of `track.csv`, with one standard deviation where it has one. Needs matplotlib.
        """
        from memo.plot import new_axes, plot_over_time

        return plot_over_time(new_axes() if ax is None else ax, self, what)

    def __len__(self) -> int:
        return sum(map(len, self.walks))

    def _repr_html_(self) -> str:
        rows: list[tuple[str, object]] = [(f"walk {k}", walk) for k, walk in enumerate(self.walks)]
        rows += [(f"finding {k + 1}", sentence) for k, sentence in enumerate(self.sentences)]
        return table(repr(self), *zip(*rows, strict=True))

    def __repr__(self) -> str:
        walks = counted(len(self.walks), "walk")
        return f"Track({counted(len(self), 'row')}, {walks}: {self.summary['message']})"


_NOBODY = {
    "nobody": "Nobody was seen walking.",
    "not walking": "Something moves, but not like a walking person of this height seen by this camera.",
    "never fully visible": "Somebody moves, but is never fully visible for long enough to start.",
}
_PERHAPS_ON_A_TREADMILL = (
    "Something moves in one place for as long as a walk on a treadmill needs to start: if somebody walks "
    "there, leave --no-treadmill (treadmill=False) out."
)
_ONLY_ON_A_TREADMILL = "With --treadmill (treadmill=True), only walks on a treadmill are tracked."
_NOT_WALKING_WITHOUT_CAMERA = (
    "Something moves, but not like a person of this height who walks across the picture. Somebody who walks "
    "towards the camera or away from it is tracked only with a calibrated camera."
)


def _fit(walk: _memo.Walk) -> dict[str, Any]:
    """How well the model fits the person, or why it does not."""
    fit = walk.fit
    if fit is None:
        return {"measured": False, "problem": walk.fit_problem}
    return {
        "measured": True,
        "fits": fit.verdict,
        "outline_off_px": fit.residual_px,
        "outline_missed_percent": 100 * fit.missed,
        "parts": {
            name: {"off_px": fit.part_residual_px.get(name), "missed_percent": 100 * missed}
            for name, missed in fit.part_missed.items()
        },
        "off_parts": fit.off_parts,
        "worst_length_sd": fit.worst_length_sd,
        "crown_off_percent": None if fit.crown_off is None else 100 * fit.crown_off,
        "lengths_m": fit.lengths_m,
        "mean_sd": fit.mean_sd,
    }


def _is_in_place(walk: _memo.Walk) -> bool:
    """Whether a difference of the sides or from average walking can be due to the person: not if the fit
    failed or is poor, as where one leg is hidden."""
    return walk.fit.verdict != "poorly" if walk.fit is not None else walk.fit_problem is None


def _has_sides(walk: _memo.Walk) -> bool:
    """Whether it is known which side is which, and so whether values by side are stated."""
    is_known = max(walk.p_swapped, walk.p_other_direction) <= LIKELY_MISTAKEN
    return is_known and not is_heading_open(walk)


_MOST_PARTS = 3


def _parts_in_words(fit: _memo.WalkFit) -> str:
    """The parts of the body that are off, the worst first."""

    def off(name: str) -> str:
        off_px = fit.part_residual_px.get(name)
        beside = "" if off_px is None else f", {off_px:.1f} px off"
        return f"the {name} ({fit.part_missed[name]:.0%} without an edge{beside})"

    *first, last = map(off, fit.off_parts[:_MOST_PARTS])
    return f"{', '.join(first)} and {last}" if first else last


def fit_sentence(walk: _memo.Walk) -> str | None:
    """The verdict on the fit, the first thing to know of a walk; None if none was asked for."""
    fit = walk.fit
    if fit is None:
        if walk.fit_problem is None:
            return None
        return f"The joint angles were not measured: {walk.fit_problem}."
    near = f"its outline is on average {fit.residual_px:.1f} px from the edges in the video"
    missed = f"{fit.missed:.0%} of it has no edge"
    if fit.verdict == "well":
        return f"The model fits the person well: {near}, and {missed}."
    too_far = (
        f", {fit.residual_px / fit.height_px:.1%} of the person's height, which is too far"
        if fit.is_far
        else ""
    )
    seen = f"{near}{too_far}; {missed}"
    if fit.worst_length_sd >= 3:
        seen += f"; a length of the body is {fit.worst_length_sd:.1f} standard deviations from the average"
    if fit.is_beside_the_crown and fit.crown_off is not None:
        where = "below" if fit.crown_off > 0 else "above"
        seen += f"; its head is {abs(fit.crown_off):.0%} of the height {where} the person's"
    if fit.off_parts:
        seen += f"; worst at {_parts_in_words(fit)}"
    unsure = "Check the overlay before use."
    if fit.verdict == "poorly":
        unsure = "The model may be in a wrong place: check the overlay, and do not use the angles."
    if all(np.isnan(walk.columns[name]).all() for name in _ANGLE_COLUMNS):
        unsure = "No joint angle is known well enough to be stated. " + unsure
    return f"The model fits the person {fit.verdict}: {seen}. {unsure}"
