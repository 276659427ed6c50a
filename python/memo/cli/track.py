"""`memo track`: one person through a video.

(Typer reads annotations where they stand, hence no `from __future__ import annotations` here.)
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import memo
from memo.cli.delivery import Delivery, Exit, InputError, Interrupt, complain, guarded, with_progress
from memo.cli.given import check_writable, checked_fov, checked_height, frame_range, load_camera
from memo.cli.report import write_page
from memo.files import write_events_csv, write_track_csv
from memo.gait import write_gait_parameters_csv
from memo.run import Source, write_run

if TYPE_CHECKING:
    import typer

    from memo.video import Frame

EPILOG = """Examples:
  memo track walk.mp4 --height 1.68
  memo track walk.mp4 --height 1.68 --camera camera.toml --report
  memo track slow.mp4 --height 1.68 --fps 240 --frames 100:900

Exit codes: 0 a walker was tracked; 1 the input cannot be used; 2 wrong usage; \
3 the video was read but no walker was tracked; 4 the app extra is not installed; 130 interrupted \
(what was tracked until then is written)."""

_DRAWN = ("overlay.mp4", "motion.png", "angles.png", "similarity.png", "start.png", "report.html")
_LARGEST_PX = 1920  # of a side; a walk enlarged to 2560 and more lost the way it faces
_OF_A_WALK = ("message", "start_s", "end_s", "direction", "gait", "p_swapped")


def add_track(app: "typer.Typer") -> None:
    import typer

    from memo.cli.camera_options import CAMERA_HELP, CameraName, CameraSize, CameraUnit, CameraVUp

    @app.command(epilog=EPILOG)
    def track(
        video: Annotated[
            Path,
            typer.Argument(metavar="VIDEO", help="A video file, or a folder of images (then --fps too)."),
        ],
        camera: Annotated[Path | None, typer.Option(help=CAMERA_HELP)] = None,
        camera_name: CameraName = None,
        camera_unit: CameraUnit = None,
        camera_size: CameraSize = None,
        camera_v_up: CameraVUp = None,
        height: Annotated[float, typer.Option(help="Height of the walker, metres.")] = 1.75,
        fov_deg: Annotated[
            float | None, typer.Option(help="Without --camera: horizontal field of view, degrees.")
        ] = None,
        frames: Annotated[str, typer.Option(help="Frames A up to, not including, B.", metavar="A:B")] = ":",
        fps: Annotated[
            float | None, typer.Option(help="True frame rate, in place of the time stamps (slow motion).")
        ] = None,
        shrink: Annotated[
            int | None,
            typer.Option(
                help="Average N by N pixels to one; of itself until the picture has at most 1280.",
                metavar="N",
                min=1,
            ),
        ] = None,
        out: Annotated[Path | None, typer.Option(help="Folder for the results; memo-out/VIDEO.")] = None,
        overlay: Annotated[bool, typer.Option(help="Write overlay.mp4.")] = True,
        plots: Annotated[bool, typer.Option(help="Write plots.")] = True,
        page: Annotated[
            bool, typer.Option("--report/--no-report", help="Write report.html (memo report).")
        ] = False,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Tracks one person who walks through VIDEO."""
        delivery = Delivery(out or Path("memo-out") / video.stem, overlay, plots, as_json, quiet)

        def work() -> Exit:
            reading = {"name": camera_name, "unit": camera_unit, "size": camera_size, "v_up": camera_v_up}
            tracker_options = checked_options(height, camera, reading, fov_deg)
            return _track_video(video, frame_range(frames), fps, shrink, tracker_options, page, delivery)

        raise typer.Exit(guarded(work))


def _track_video(
    video: Path,
    frame_range: tuple[int, int | None],
    fps: float | None,
    shrink: int | None,
    tracker_options: dict[str, Any],
    page: bool,
    delivery: Delivery,
) -> Exit:
    from memo.video import VideoReader

    check_writable(delivery.out)

    def opened() -> VideoReader:
        start, stop = frame_range
        return VideoReader(video, start=start, stop=stop, rate_hz=fps, shrink=shrink)

    with opened() as reader:
        tracker_options = _fitted(tracker_options, reader)
        if max(reader.size) > _LARGEST_PX:
            width, height = reader.size
            complain(
                f"{video}: {width}x{height} pixels are more than memo was tested on: which way the person "
                "faces and which leg is which may be wrong; leave --shrink out"
            )
        if "camera" not in tracker_options and reader.pixel_aspect != 1:
            complain(f"{video}: pixels are {reader.pixel_aspect:.3f} times as wide as high; give a --camera")
        tracker = new_tracker(tracker_options)
        source = Source(video, frame_range, reader.rate_hz, fps, "camera" in tracker_options, reader.shrink)
        shrunk_to = "" if reader.shrink == 1 else "{}x{} of the {}x{}".format(*reader.size, *reader.full_size)
        track, interrupted = follow(reader, tracker, reader.frame_count, source, delivery)
        if reader.damage:
            complain(f"{video}: {reader.damage}")
    if interrupted:
        return deliver_interrupted(track, delivery)
    with opened() as reader:
        written = write_all(track, reader, reader.frame_count, reader.rate_hz, delivery)
    if page:
        written.append(write_page(delivery.out, delivery.out / "report.html", delivery).path)
    report(track, written, delivery)
    if shrunk_to and delivery.talks:
        print(f"Tracked at {shrunk_to} pixels of the video (--shrink).")
    if "camera" not in tracker_options and delivery.talks and len(track.columns["frame"]):
        print("No --camera: depths rest on the assumed field of view; heights and sideways positions do not.")
    return exit_code(track)


def new_tracker(options: dict[str, Any]) -> Any:
    return memo.Tracker(**options)


def follow(
    frames: "Iterable[Frame]", tracker: Any, count: int | None, source: Source, delivery: Delivery
) -> tuple[Any, bool]:
    """Gives all frames to the tracker; an interrupt ends it after the current frame.

    An error in the middle is raised again once the tables hold what was tracked until then.
    """
    frames_read = 0
    try:
        with Interrupt() as interrupt:
            for frame in with_progress(frames, "tracking", count, delivery):
                tracker.update(frame.luma, frame.time_s)
                frames_read += 1
                if interrupt.requested:
                    break
    except ValueError as error:
        track = _snapshot(tracker, source, frames_read, interrupted=True)
        if not len(track.columns["frame"]):
            raise
        _write_tables(track, delivery)
        raise InputError(f"{error}; the tables hold what was tracked until then") from error
    return _snapshot(tracker, source, frames_read, interrupt.requested), interrupt.requested


def _snapshot(tracker: Any, source: Source, frames_read: int, interrupted: bool) -> Any:
    """The track's tables, read once, with frames numbered as in the video (the tracker counts from 0)."""
    track = tracker.finish()
    first_frame = source.frames[0]

    def renumbered(table: dict[str, Any]) -> dict[str, Any]:
        return {**table, "frame": np.asarray(table["frame"]) + first_frame} if "frame" in table else table

    return SimpleNamespace(
        columns=renumbered(dict(track.columns)),
        events=[{**event, "frame": event["frame"] + first_frame} for event in track.events],
        start=renumbered(dict(track.start)),
        measured=renumbered(dict(track.measured)),
        contours=track.contours,
        summary=dict(track.summary),
        sentences=list(track.sentences),
        gait_parameters=dict(track.gait_parameters),
        camera=track.camera,
        records=track.records,
        run=(tracker.options, source, frames_read, interrupted),
    )


# What the user gave, checked before any work.


def checked_options(
    height_m: float, camera: Path | None, reading: dict[str, Any], fov_deg: float | None
) -> dict[str, Any]:
    options: dict[str, Any] = {"height_m": checked_height(height_m)}
    if camera is not None and fov_deg is not None:
        raise InputError("--camera already holds the field of view: leave --fov-deg out")
    for name, value in reading.items():
        if camera is None and value is not None:
            raise InputError(f"--camera-{name.replace('_', '-')} needs --camera")
    if camera is not None:
        options["camera"] = load_camera(camera, **reading)
    if fov_deg is not None:
        options["fov_deg"] = checked_fov(fov_deg)
    return options


def _fitted(tracker_options: dict[str, Any], reader: Any) -> dict[str, Any]:
    """The options with the camera of the frames as they are read."""
    camera = tracker_options.get("camera")
    if camera is None:
        return tracker_options
    if tuple(camera.size) == reader.full_size:
        return {**tracker_options, "camera": camera.shrunk(reader.shrink)}
    (width, height), (video_width, video_height) = camera.size, reader.full_size
    turned = "; was it calibrated turned?" if (width, height) == (video_height, video_width) else ""
    raise InputError(
        f"{reader.path}: the camera is for {width}x{height} pixels, the video has "
        f"{video_width}x{video_height}{turned}"
    )


# What is written and said.


def _write_tables(track: Any, delivery: Delivery) -> list[Path]:
    for stale in _DRAWN:  # of an earlier run: they would stand beside tables they do not belong to
        (delivery.out / stale).unlink(missing_ok=True)
    table, events = delivery.out / "track.csv", delivery.out / "events.csv"
    write_track_csv(table, track.columns)
    write_events_csv(events, track.events)
    gait = delivery.out / "gait_parameters.csv"
    write_gait_parameters_csv(gait, track.gait_parameters)
    return [table, events, gait, write_run(delivery.out, track, *track.run)]


def write_all(
    track: Any, frames: "Iterable[Frame]", count: int | None, rate_hz: float, delivery: Delivery
) -> list[Path]:
    written = _write_tables(track, delivery)
    if not len(track.columns["frame"]):
        return written
    if delivery.overlay:
        from memo.overlay import write_overlay

        path = delivery.out / "overlay.mp4"
        write_overlay(path, with_progress(frames, "drawing", count, delivery), track, rate_hz=rate_hz)
        written.append(path)
    if delivery.plots:
        from memo.plot import write_plots

        written += write_plots(track, delivery.out)
    return written


def deliver_interrupted(track: Any, delivery: Delivery) -> Exit:
    report(track, _write_tables(track, delivery), delivery)
    complain("interrupted: the tables hold what was tracked until then; no overlay, no plots")
    return Exit.INTERRUPTED


def report(
    track: Any, written: list[Path], delivery: Delivery, more: Mapping[str, Any] | None = None
) -> None:
    """Says what was found; the JSON has the figures of the longest walk, `each_walk`, and `more`."""
    summary = {
        **track.summary,
        "rows": len(track.columns["frame"]),
        "each_walk": [{name: walk[name] for name in _OF_A_WALK} for walk in track.records],
        "sentences": track.sentences,
        **(more or {}),
    }
    delivery.tell(summary, track.sentences, written)


def exit_code(track: Any) -> Exit:
    return Exit.TRACKED if len(track.columns["frame"]) else Exit.NOBODY
