"""Tracks a video into a folder of results, for `memo track` and the processes of `memo batch`.

Frames go to the tracker; tables, overlay, plots and page are written. Doubts about the video go to `remark`,
progress goes to `progress`; nothing is printed. Results are in pixels of the video, even if its pictures were
averaged down. Needs `av`, and matplotlib for plots.
"""

from __future__ import annotations

import shutil
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

import memo
from memo import _memo
from memo.camera_motion import CameraMotion, write_camera_motion_csv
from memo.cycles import write_cycles_csv
from memo.exits import Exit
from memo.files import write_events_csv, write_track_csv
from memo.gait import write_gait_parameters_csv
from memo.given import Box, InputError, Point, check_apart, check_writable, nothing_at
from memo.left_out import LeftOut
from memo.panning import again
from memo.run import NAME as RUN
from memo.run import Source, write_run
from memo.unfinished import new_folder

if TYPE_CHECKING:
    from memo.tracking import Track
    from memo.video import Frame, VideoReader

__all__ = [
    "Recorded",
    "Recording",
    "Stop",
    "draw_overlay",
    "draw_plots",
    "follow",
    "track_recording",
    "write_tables",
]

_TABLES = ("track.csv", "events.csv", "gait_parameters.csv", "cycles.csv")
_DRAWN = (
    "camera_motion.csv",
    "overlay.mp4",
    "motion.png",
    "angles.png",
    "similarity.png",
    "start.png",
    "report.html",
    "comparison.html",
)
_LARGEST_PX = 1920  # longest tested side; for a walk enlarged to 2560 or more, the facing direction was wrong
# So many unused bits are of a recording with fewer bits, or of a scene an eighth as bright as it could be.
_FEW_BITS = 3
_AGAIN = {"fov_deg": "with the field of view that the pan shows", "reach_px": "in larger pictures"}
_OF_A_WALK = ("message", "start_s", "end_s", "direction", "gait", "p_swapped")

Progress = Callable[[str, int, "int | None"], object]
"""Called with the name of the step, the amount done and the total."""

Stop = AbstractContextManager[Any]
"""Yields an object with `requested`: whether to stop after the frame that was taken last."""


def _unseen(step: str, done: int, total: int | None) -> None:
    """The progress for callers that want none."""


def _never() -> Stop:
    return nullcontext(SimpleNamespace(requested=False))


@dataclass(frozen=True)
class Recording:
    """A video, its known parameters, and what to write."""

    video: Path
    options: Mapping[str, Any]
    """Options of `Tracker`; the camera is that of the whole picture."""
    frames: tuple[int, int | None] = (0, None)
    """First frame and one past the last; None for the end."""
    fps: float | None = None
    """Frame rate in place of the time stamps."""
    shrink: int | None = None
    """Pixels averaged to one, per axis; None: chosen by `VideoReader`."""
    overlay: bool = True
    plots: bool = True
    page: bool = False
    follow: Point | Box | None = None
    """Of several people, only the one who is there."""
    boxes: Path | None = None
    """MOTChallenge rows of the boxes around people, in place of looking for what moves."""
    camera_file: Path | None = None
    """The file that the camera was read from, if any; results do not overwrite it."""


@dataclass
class Recorded:
    """A track with its tables read once, frames numbered as in the video, and the files written for it."""

    columns: dict[str, Any]
    events: list[dict[str, Any]]
    start: _memo.WalkStart | None
    measured: dict[str, Any]
    contours: Callable[[int], Any] = field(repr=False)
    summary: dict[str, Any]
    sentences: list[str]
    gait_parameters: dict[str, Any]
    cycles: dict[str, Any]
    camera: Any
    shrink: int
    records: list[dict[str, Any]]
    camera_motion: CameraMotion
    left_out: list[LeftOut]
    run: tuple[Mapping[str, Any], Source, int, bool]
    """Options, source, frames read and whether frames were left: the input of `write_run`."""
    written: list[Path] = field(default_factory=list)
    followed: int | None = None
    """The person chosen by a point or a box, counted among everybody who was tracked."""
    not_there: str | None = None
    """If nobody was tracked there: who was tracked where in its frame."""

    @property
    def interrupted(self) -> bool:
        """Whether requested frames were left unread."""
        return self.run[3]

    @property
    def source(self) -> Source:
        """Where the frames came from."""
        return self.run[1]

    @property
    def exit(self) -> Exit:
        """The exit code that reports whether anybody was tracked, at the place if one was given."""
        is_there = len(self.columns["frame"]) and self.not_there is None
        return Exit.TRACKED if is_there else Exit.NOBODY

    @property
    def document(self) -> dict[str, Any]:
        """The findings for JSON: the figures of the longest walk, and each walk."""
        return {
            **self.summary,
            "rows": len(self.columns["frame"]),
            "each_walk": [{name: walk[name] for name in _OF_A_WALK} for walk in self.records],
            "sentences": self.sentences,
        }


def track_recording(
    recording: Recording,
    out: Path,
    *,
    progress: Progress = _unseen,
    remark: Callable[[str], object] = lambda sentence: None,
    stop: Stop | None = None,
    tracked: Callable[[Recorded], object] = lambda recorded: None,
) -> Recorded:
    """Tracks a video and writes the results into the folder `out`.

    Refuses a folder where they would replace the video, the boxes or the camera file, or lie among the images
    of the video. If stopped after a frame, it writes the tables of what was tracked until then, and draws
    nothing. `tracked` is called when the tables are written, before anything is drawn.
    """
    from memo.video import VideoDamageWarning

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VideoDamageWarning)  # damage becomes a remark
        return _track_recording(recording, out, progress, remark, stop, tracked)


def _track_recording(
    recording: Recording,
    out: Path,
    progress: Progress,
    remark: Callable[[str], object],
    stop: Stop | None,
    tracked: Callable[[Recorded], object],
) -> Recorded:
    from memo.video import VideoReader

    video = recording.video
    if not video.exists():
        raise InputError(nothing_at(video))
    written = [out / name for name in (*_TABLES, RUN, *_DRAWN)]
    check_apart([video, recording.boxes, recording.camera_file], written)
    check_writable(out)

    def opened() -> VideoReader:
        start, end = recording.frames
        return VideoReader(video, start=start, stop=end, rate_hz=recording.fps, shrink=recording.shrink)

    def lumas() -> Iterator[npt.NDArray[np.uint8]]:
        with opened() as frames:
            yield from (frame.luma for frame in frames)

    with opened() as reader:
        options = _fitted(recording.options, reader)
        for doubt in _doubts(reader, "camera" in options):
            remark(f"{video}: {doubt}")
        source = Source(
            video=video,
            frames=recording.frames,
            rate_hz=reader.rate_hz,
            fps_given=recording.fps,
            camera_given="camera" in options,
            shrink=reader.shrink,
            size=reader.full_size,
            boxes=recording.boxes,
        )
        tracker, place = memo.Tracker(**options), recording.follow
        boxes = None if recording.boxes is None else _boxes(recording.boxes, reader)
        recorded = follow(reader, tracker, source, out, reader.frame_count, progress, stop, place, boxes)
        while not recorded.interrupted:
            changes = again(recorded.camera_motion, options, lumas)
            if not changes:
                break
            remark(f"{video}: the camera pans: tracking again, {_AGAIN[max(changes)]}")
            options |= changes
            with opened() as once_more:
                tracker, count = memo.Tracker(**options), once_more.frame_count
                recorded = follow(once_more, tracker, source, out, count, progress, stop, place, boxes)
        if recorded.not_there is not None:
            remark(f"{video}: {recorded.not_there}")
        if reader.damage:
            remark(f"{video}: {reader.damage}")
    write_tables(recorded, out)
    tracked(recorded)
    if recorded.interrupted:
        return recorded
    if recording.overlay and len(recorded.columns["frame"]):
        with opened() as reader:
            draw_overlay(recorded, out, reader, reader.frame_count, progress=progress)
    if recording.plots:
        draw_plots(recorded, out)
    if recording.page:
        from memo.report import write_report

        recorded.written.append(write_report(out, out / "report.html", progress=progress).path)
    return recorded


def follow(
    frames: Iterable[Frame],
    tracker: Any,
    source: Source,
    out: Path,
    count: int | None = None,
    progress: Progress = _unseen,
    stop: Stop | None = None,
    place: Point | Box | None = None,
    boxes: Mapping[int, npt.NDArray[np.float64]] | None = None,
) -> Recorded:
    """Passes all frames to the tracker, with the boxes of each frame; a stop ends it after the current frame.

    An error in between is raised again after the tables of what was tracked until then are written.
    """
    frames_read = 0
    try:
        with _never() if stop is None else stop as asked:
            for frame in _told(frames, "tracking", count, progress):
                own = None if boxes is None else boxes.get(frame.index, np.empty((0, 4)))
                tracker.update(frame.luma, frame.time_s, own)
                frames_read += 1
                if asked.requested:
                    break
    except ValueError as error:
        recorded = _recorded(tracker, source, frames_read, True, place)
        if not len(recorded.columns["frame"]):
            raise
        write_tables(recorded, out)
        raise InputError(f"{error}; the tables hold what was tracked until then") from error
    return _recorded(tracker, source, frames_read, asked.requested, place)


def draw_overlay(
    recorded: Recorded,
    out: Path,
    frames: Iterable[Frame],
    count: int | None = None,
    *,
    progress: Progress = _unseen,
) -> None:
    """Writes `overlay.mp4` of the frames that were tracked."""
    from memo.overlay import write_overlay

    path, source = out / "overlay.mp4", recorded.source
    drawn_on = _told(frames, "drawing", count, progress)
    write_overlay(path, drawn_on, recorded, rate_hz=source.rate_hz, shrink=source.shrink)
    recorded.written.append(path)


def draw_plots(recorded: Recorded, out: Path) -> None:
    """Writes the plots, if anybody was tracked."""
    if len(recorded.columns["frame"]):
        from memo.plot import write_plots

        recorded.written += write_plots(recorded, out)


def _told(frames: Iterable[Frame], step: str, count: int | None, progress: Progress) -> Iterator[Frame]:
    """Yields the same frames, and reports each when it is done."""
    progress(step, 0, count)
    for done, frame in enumerate(frames, 1):
        yield frame
        progress(step, done, count)


def _fitted(options: Mapping[str, Any], reader: VideoReader) -> dict[str, Any]:
    """The options with the camera for the frames as they are read."""
    camera = options.get("camera")
    if camera is None:
        return dict(options)
    if tuple(camera.size) == reader.full_size:
        return {**options, "camera": camera.shrunk(reader.shrink)}
    (width, height), (video_width, video_height) = camera.size, reader.full_size
    turned = (
        "; was it calibrated in the other orientation?"
        if (width, height) == (video_height, video_width)
        else ""
    )
    raise InputError(
        f"{reader.path}: the camera is for {width}x{height} pixels, the video has "
        f"{video_width}x{video_height}{turned}"
    )


def _boxes(path: Path, reader: VideoReader) -> dict[int, npt.NDArray[np.float64]]:
    """By frame of the video, the boxes (N, 4) within the picture, in pixels of frames as they are read."""
    from memo.formats.motchallenge import read_motchallenge

    rows = read_motchallenge(path)
    boxes = np.stack([rows[f"{name}_px"] for name in ("left", "top", "width", "height")], axis=1)
    boxes = boxes / reader.shrink
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    # Rows with a confidence of 0 are not to be considered.
    shown = (high >= 1).all(axis=1) & (low <= np.subtract(reader.size, 1)).all(axis=1)
    shown &= (boxes[:, 2:] >= 1).all(axis=1) & (rows["conf"] != 0)
    if not shown.any():
        raise InputError(f"{path}: no box is within the {reader.size[0]}x{reader.size[1]} pixels of a frame")
    frames = rows["frame"]
    return {int(frame): boxes[shown & (frames == frame)] for frame in np.unique(frames[shown])}


def _doubts(reader: VideoReader, camera_given: bool) -> Iterator[str]:
    """Reports what may make the results wrong, in sentences."""
    if max(reader.size) > _LARGEST_PX:
        width, height = reader.size
        yield (
            f"{width}x{height} pixels are more than memo was tested on: the direction in which the person "
            "faces and which leg is which may be wrong; leave --shrink out"
        )
    if reader.unused_bits >= _FEW_BITS:
        yield (
            f"no pixel of the first frame uses the upper {reader.unused_bits} bits of its values: if the "
            "recording has fewer bits, scale it to the full range, or it is taken to be nearly black"
        )
    if not camera_given and reader.pixel_aspect != 1:
        yield f"pixels are {reader.pixel_aspect:.3f} times as wide as high; give a --camera"


def _recorded(
    tracker: Any, source: Source, frames_read: int, interrupted: bool, place: Point | Box | None
) -> Recorded:
    """The track in pixels of the video, frames numbered as in the video (the tracker counts from 0)."""
    track: Track = tracker.finish()
    if source.shrink > 1:
        track = track.of_video(source.shrink, source.size)
    first_frame = source.frames[0]
    followed = None
    if isinstance(place, Box):
        box = place._replace(frame=place.frame - first_frame)
        followed = track.person_in(*box)
    elif place is not None:
        followed = track.person_at(place.u_px, place.v_px, place.frame - first_frame)
    not_there = None
    if followed is not None:
        track = track.of_person(followed)
    elif place is not None:
        not_there = _not_there(track, place, first_frame, frames_read)
    track.camera_motion = replace(track.camera_motion, first_frame=first_frame)
    track.left_out = [left.of_video(1, first_frame) for left in track.left_out]

    def renumbered(table: Mapping[str, Any]) -> dict[str, Any]:
        return {**table, "frame": np.asarray(table["frame"]) + first_frame} if "frame" in table else {**table}

    start = track.start
    if start is not None:
        frames, *others = start.__getnewargs__()
        start = _memo.WalkStart(frames + first_frame, *others)
    return Recorded(
        columns=renumbered(track.columns),
        events=[{**event, "frame": event["frame"] + first_frame} for event in track.events],
        start=start,
        measured=renumbered(track.measured),
        contours=track.contours,
        summary=dict(track.summary),
        sentences=list(track.sentences),
        gait_parameters=dict(track.gait_parameters),
        cycles=dict(track.cycles),
        camera=track.camera,
        shrink=source.shrink,
        records=track.records,
        camera_motion=track.camera_motion,
        left_out=track.left_out,
        run=(tracker.options, source, frames_read, interrupted),
        followed=followed,
        not_there=not_there,
    )


def _not_there(track: Track, place: Point | Box, first_frame: int, frames_read: int) -> str:
    """Says who was tracked in the frame of a place where nobody was, and where."""
    said = f"nobody was tracked at {place}"
    if not first_frame <= place.frame < first_frame + frames_read:
        read = f"the frames that were read are {first_frame} to {first_frame + frames_read - 1}"
        return f"{said}, as {read}: the results are those of everybody"
    if not len(track):
        return said
    columns, middles = track.columns, []
    for row, (low, high) in track.extents(place.frame - first_frame):
        u_px, v_px = (low + high) / 2
        middles.append(f"person {columns['person'][row]} at {u_px:.0f},{v_px:.0f}@{place.frame}")
    if middles:
        return f"{said}, but {' and '.join(middles)}: the results are those of everybody"
    known = []
    for person in sorted(set(track.people)):
        own = columns["frame"][columns["person"] == person] + first_frame
        known.append(f"person {person} (frames {own.min()} to {own.max()})")
    return (
        f"{said}, nor anywhere in this frame, but {' and '.join(known)}: the results are those of everybody"
    )


def write_tables(recorded: Recorded, out: Path) -> None:
    """Writes the tables and run.json; removes pictures and the camera's motion of an earlier run.

    They take the place of earlier ones together, when all of them are complete. A run that was stopped before
    anybody was tracked leaves those of an earlier run.
    """
    if recorded.interrupted and not len(recorded.columns["frame"]) and (out / RUN).exists():
        return
    new = new_folder(out)
    try:
        table, events, gait, cycles = (new / name for name in _TABLES)
        write_track_csv(table, recorded.columns)
        write_events_csv(events, recorded.events)
        write_gait_parameters_csv(gait, recorded.gait_parameters)
        write_cycles_csv(cycles, recorded.cycles)
        written = [table, events, gait, cycles, write_run(new, recorded, *recorded.run)]
        motion = recorded.camera_motion
        if motion.moved or motion.is_unexplained or motion.is_unevenly_lit:
            written.append(new / "camera_motion.csv")
            write_camera_motion_csv(written[-1], motion)
        for stale in _DRAWN:  # from an earlier run: they do not match the new tables
            (out / stale).unlink(missing_ok=True)
        recorded.written = [path.replace(out / path.name) for path in written]
    finally:
        shutil.rmtree(new, ignore_errors=True)
