"""The command line: `memo track`, `unswap`, `reproduce`, `demo`, `pointlight`, `planar`.

This file alone knows how results are delivered: what is checked before work starts, what is written,
what is said and which exit code says it. The base install has numpy alone, so everything from the `app`
extra is imported inside functions, after `main` has looked for it. (Typer reads annotations where they
stand, hence no `from __future__ import annotations` here.)
"""

import contextlib
import json
import math
import os
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np

import memo
from memo.files import (
    JOINTS,
    complete_file,
    read_tsai_xml,
    write_events_csv,
    write_flips_csv,
    write_track_csv,
)

if TYPE_CHECKING:
    import typer

    from memo.video import Frame

T = TypeVar("T")

EXTRA = ("av", "matplotlib", "rich", "typer")

EXIT_CODES = """Exit codes: 0 a walker was tracked; 1 the input cannot be used; 2 wrong usage;
3 the video was read but no walker was tracked; 4 the app extra is not installed; 130 interrupted
(what was tracked until then is written)."""

UNSWAP_EXIT_CODES = """Exit codes: 0 the keypoints were written; 1 the input cannot be used; 2 wrong usage;
4 the app extra is not installed; 130 interrupted (nothing is written)."""

_DRAWN = ("overlay.mp4", "motion.png", "angles.png", "similarity.png", "start.png")

_LIKELY_SWAPPED = 0.2  # from one in five on, left and right should be looked at before they are used


class Exit(IntEnum):
    """What the exit codes mean."""

    TRACKED = 0
    DONE = 0  # where nobody is to be tracked
    BAD_INPUT = 1
    NOBODY = 3
    NO_EXTRA = 4
    INTERRUPTED = 130


class Experiment(StrEnum):
    """What can be reproduced: the names of `memo.reproduce.EXPERIMENTS`."""

    LEE_CHEN = "lee-chen"


class InputError(ValueError):
    """A mistake in what the user gave; the message is one line."""


@dataclass(frozen=True)
class Delivery:
    """Where results go, which of them, and how much is said."""

    out: Path
    overlay: bool = True
    plots: bool = True
    as_json: bool = False
    quiet: bool = False

    @property
    def talks(self) -> bool:
        """Whether results are told in sentences."""
        return not (self.quiet or self.as_json)


def main() -> None:
    """Entry point of the `memo` command."""
    absent = [name for name in EXTRA if find_spec(name) is None]
    if absent:
        _complain(f'the command line needs {", ".join(absent)}: pip install "memo-motion[app]"')
        raise SystemExit(Exit.NO_EXTRA)
    try:
        _app()()
    except KeyboardInterrupt:  # while the extra is still being imported
        raise SystemExit(Exit.INTERRUPTED) from None


def _app() -> "typer.Typer":
    import typer

    app = typer.Typer(
        name="memo",
        help="3D motion of a walker from one fixed camera.",
        epilog=EXIT_CODES,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )

    def version(wanted: bool) -> None:
        if wanted:
            print(f"memo {memo.__version__}")
            raise typer.Exit

    @app.callback()
    def options(
        version: Annotated[bool, typer.Option("--version", callback=version, is_eager=True)] = False,
    ) -> None: ...

    _add_track(app)
    _add_unswap(app)
    _add_demo(app)
    _add_pointlight(app)
    _add_planar(app)
    _add_reproduce(app)
    return app


def _add_track(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EXIT_CODES)
    def track(
        video: Annotated[Path, typer.Argument(help="A video file, or a folder of images (then --fps too).")],
        camera: Annotated[Path | None, typer.Option(help="Calibration: TOML, or Tsai XML.")] = None,
        camera_name: Annotated[str | None, typer.Option(help="Which camera of a TOML with several.")] = None,
        height: Annotated[float, typer.Option(help="Height of the walker, metres.")] = 1.75,
        fov_deg: Annotated[
            float | None, typer.Option(help="Without --camera: horizontal field of view, degrees.")
        ] = None,
        out: Annotated[Path | None, typer.Option(help="Folder for the results; memo-out/VIDEO.")] = None,
        frames: Annotated[str, typer.Option(help="Frames A up to, not including, B.", metavar="A:B")] = ":",
        fps: Annotated[
            float | None, typer.Option(help="True frame rate, in place of the time stamps (slow motion).")
        ] = None,
        overlay: Annotated[bool, typer.Option(help="Write overlay.mp4.")] = True,
        plots: Annotated[bool, typer.Option(help="Write plots.")] = True,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Tracks one person who walks through VIDEO."""
        delivery = Delivery(out or Path("memo-out") / video.stem, overlay, plots, as_json, quiet)

        def work() -> Exit:
            tracker_options = _tracker_options(height, camera, camera_name, fov_deg)
            return _track_video(video, _frame_range(frames), fps, tracker_options, delivery)

        raise typer.Exit(_guarded(work))


def _add_unswap(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=UNSWAP_EXIT_CODES)
    def unswap(
        keypoints: Annotated[
            Path, typer.Argument(help="OpenPose folder, COCO or AlphaPose JSON, or a table (CSV).")
        ],
        fps: Annotated[
            float | None, typer.Option(help="Frame rate; needed where no times are given.")
        ] = None,
        layout: Annotated[
            str | None, typer.Option(help="Order of the points, such as BODY_25B, if it is seen wrongly.")
        ] = None,
        person: Annotated[
            int | None, typer.Option(help="Place of the person in each frame's list; else followed.", min=0)
        ] = None,
        out: Annotated[Path | None, typer.Option(help="Folder for the results; memo-out/KEYPOINTS.")] = None,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Exchanges right and left in KEYPOINTS where a detector confused them."""
        delivery = Delivery(out or Path("memo-out") / keypoints.resolve().stem, as_json=as_json, quiet=quiet)
        options = {"fps": fps, "layout": layout, "person": person}
        raise typer.Exit(_guarded(lambda: _unswap(keypoints, options, delivery)))


def _add_demo(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EXIT_CODES)
    def demo(
        out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("memo-out/demo"),
        seed: Annotated[int, typer.Option(help="Which scene is drawn.", min=0)] = 0,
    ) -> None:
        """Draws a walker whose motion is known, tracks it and compares."""
        raise typer.Exit(_guarded(lambda: _demo(out, seed)))


def _add_pointlight(app: "typer.Typer") -> None:
    import typer

    @app.command()
    def pointlight(
        motion: Annotated[
            Path | None,
            typer.Argument(
                help="CSV of NAME_x, NAME_y, NAME_z in metres, or a folder with track.csv; a walker."
            ),
        ] = None,
        out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("memo-out/pointlight"),
        azimuth_deg: Annotated[float, typer.Option(help="Viewer about the vertical; 90 = from +x.")] = 0.0,
        elevation_deg: Annotated[float, typer.Option(help="Viewer above the horizontal.")] = 0.0,
        px_per_m: Annotated[float, typer.Option(help="Scale.")] = 200.0,
        locomotion: Annotated[str, typer.Option(help="treadmill, translating or pelvis.")] = "treadmill",
        inverted: Annotated[bool, typer.Option(help="Upside down.")] = False,
        mirrored: Annotated[bool, typer.Option(help="Facing the other way.")] = False,
        reversed_: Annotated[bool, typer.Option("--reversed", help="Played backwards.")] = False,
        scramble_position: Annotated[
            bool, typer.Option(help="Every dot's motion at a random place.")
        ] = False,
        scramble_phase: Annotated[bool, typer.Option(help="Every dot's motion shifted in time.")] = False,
        period: Annotated[
            float | None, typer.Option(help="Period of the motion, seconds; all of it.")
        ] = None,
        lifetime: Annotated[int | None, typer.Option(help="Limited lifetime of the dots, frames.")] = None,
        dots: Annotated[int, typer.Option(help="With --lifetime: dots shown.")] = 8,
        on: Annotated[str, typer.Option(help="With --lifetime: limbs or joints.")] = "limbs",
        noise_dots: Annotated[int, typer.Option(help="Number of noise dots.")] = 0,
        noise_kind: Annotated[str, typer.Option(help="scrambled, linear or flicker.")] = "scrambled",
        noise_px: Annotated[float, typer.Option(help="Standard deviation of pixel noise.")] = 0.0,
        seconds: Annotated[float, typer.Option(help="Without MOTION: duration.")] = 2.4,
        fps: Annotated[float | None, typer.Option(help="Frame rate where the file has none.")] = None,
        seed: Annotated[int, typer.Option(help="Of everything random.", min=0)] = 0,
    ) -> None:
        """Makes a point-light display: dots.csv, labels.csv and display.mp4."""
        options = {
            "azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg,
            "px_per_m": px_per_m,
            "locomotion": locomotion,
            "inverted": inverted,
            "mirrored": mirrored,
            "reversed": reversed_,
            "scramble_position": scramble_position,
            "scramble_phase": "periodic" if scramble_phase else None,
            "period_s": period,
            "lifetime_frames": lifetime,
            "life_dots": dots,
            "life_sites": on,
            "noise_dots": noise_dots,
            "noise_kind": noise_kind,
            "noise_sd_px": noise_px,
            "seed": seed,
        }
        raise typer.Exit(_guarded(lambda: _pointlight(motion, out, seconds, fps, options)))


def _add_planar(app: "typer.Typer") -> None:
    import typer

    @app.command(
        epilog="Exit codes: 0 a linkage was found; 1 the input cannot be used; 2 wrong usage; "
        "3 no window shows planar motion; 4 the app extra is not installed."
    )
    def planar(
        tracks: Annotated[Path, typer.Argument(help="CSV of NAME_u_px, NAME_v_px and time_s (or --fps).")],
        out: Annotated[Path | None, typer.Option(help="Folder for the results; memo-out/TRACKS.")] = None,
        noise_px: Annotated[float, typer.Option(help="Standard deviation of the tracks' coordinates.")] = 0.5,
        window: Annotated[float, typer.Option(help="Length of the windows in time, seconds.")] = 1.2,
        fps: Annotated[float | None, typer.Option(help="Frame rate where the file has no time_s.")] = None,
        carry: Annotated[
            bool, typer.Option(help="Carry lengths through windows in which it is lost.")
        ] = False,
        names: Annotated[bool, typer.Option(help="Write the points' names into the pictures.")] = True,
        video: Annotated[bool, typer.Option(help="Write turned.mp4, the limbs from a new side.")] = True,
    ) -> None:
        """Links unnamed points into limbs that swing in planes, with lengths and depths."""
        folder = out or Path("memo-out") / tracks.stem
        options = {"window_s": window, "carry": carry}
        raise typer.Exit(_guarded(lambda: _planar(tracks, folder, noise_px, fps, names, video, options)))


def _pointlight(
    motion: Path | None, out: Path, seconds: float, fps: float | None, options: dict[str, Any]
) -> Exit:
    from memo.figure import Points, read_points_csv, write_points_csv
    from memo.figure_plot import write_display_video

    if motion is None:
        points = _walker_points(seconds, fps or 60.0)
    else:
        points = read_points_csv(motion / "track.csv" if motion.is_dir() else motion, 3, fps)
    _check_writable(out)
    display = _new_display(points, options)
    shown, labels = display["positions_px"], display["labels"]
    stays = bool((labels == labels[0]).all()) and options["lifetime_frames"] is None
    named = [points.names[k] if stays and k >= 0 else f"dot{i:02d}" for i, k in enumerate(labels[0])]
    write_points_csv(out / "dots.csv", Points(named, display["times_s"], shown))
    _write_labels(out / "labels.csv", points.names, named, display)
    write_display_video(out / "display.mp4", display["times_s"], shown)
    print(f"{shown.shape[1]} dots in {shown.shape[0]} frames.")
    print(f"Written to {out}: dots.csv, labels.csv, display.mp4.")
    if stays:
        print(f"To find the limbs in it again: memo planar {out / 'dots.csv'}")
    return Exit.TRACKED


def _write_labels(path: Path, names: list[str], dots: list[str], display: dict[str, Any]) -> None:
    """A row for each frame and dot: the joint, or both ends of the limb, or "noise"."""
    with complete_file(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        file.write("frame,dot,shows,limb_end,fraction,visible\n")
        for frame, row in enumerate(display["labels"]):
            for dot, label in enumerate(row):
                end = int(display["limb_ends"][frame, dot])
                shows = names[label] if label >= 0 else "noise"
                limb = f"{names[end]},{display['fractions'][frame, dot]:.4f}" if end >= 0 else ","
                file.write(f"{frame},{dots[dot]},{shows},{limb},{int(display['visible'][frame, dot])}\n")


def _planar(
    tracks: Path,
    out: Path,
    noise_px: float,
    fps: float | None,
    names: bool,
    video: bool,
    options: dict[str, Any],
) -> Exit:
    from memo.figure import read_points_csv, write_figure_csv
    from memo.figure_plot import write_linkage_png, write_turned_video

    points = read_points_csv(tracks, 2, fps)
    _check_writable(out)
    delivery = Delivery(out)
    print(f"{len(points.names)} points in {len(points.times_s)} frames: looking for limbs ...", flush=True)
    figure = _new_figure(points, noise_px, options)
    written = write_figure_csv(out, figure, points)
    write_linkage_png(out / "linkage.png", points, figure, names=names)
    written.append(out / "linkage.png")
    (out / "turned.mp4").unlink(missing_ok=True)  # of an earlier run
    if video and figure.interpreted:

        def progress(frames: Iterable[int]) -> Iterable[int]:
            return _with_progress(frames, "drawing", len(points.times_s), delivery)

        write_turned_video(out / "turned.mp4", points, figure, progress=progress)
        written.append(out / "turned.mp4")
    for line in _about_figure(figure, points):
        print(line)
    print(f"Written to {out}: {', '.join(path.name for path in written)}.")
    return Exit.TRACKED if figure.interpreted else Exit.NOBODY


def _about_figure(figure: Any, points: Any) -> list[str]:
    """What was found, in sentences."""
    states = [window["status"] for window in figure.windows]
    told = [f"{states.count(state)} {state}" for state in dict.fromkeys(states)]
    lines = [f"Windows: {', '.join(told)}."]
    if not figure.interpreted:
        return [*lines, "No window shows planar motion: nothing is claimed. The best guess is in links.csv."]
    for a, b, length, confidence, count in figure.links():
        where = (
            "" if count == len(figure.interpreted) else f", in {count} of {len(figure.interpreted)} windows"
        )
        sure = "" if math.isnan(confidence) else f", confidence {confidence:.0%}"
        lines.append(f"  {points.names[a]} - {points.names[b]}: {length:.0f} px long{sure}{where}")
    return [
        *lines,
        "Every chain may also be its mirror image in depth; depths of chains to each other are open.",
    ]


def _add_reproduce(app: "typer.Typer") -> None:
    import typer

    @app.command()
    def reproduce(
        experiment: Annotated[Experiment, typer.Argument(help="lee-chen: Lee and Chen 1985, postures.")],
        out: Annotated[
            Path | None, typer.Option(help="Folder for tables and figures; memo-out/EXPERIMENT.")
        ] = None,
    ) -> None:
        """Computes a paper's tables and figures again, beside the printed numbers."""
        folder = out or Path("memo-out") / experiment.value
        raise typer.Exit(_guarded(lambda: _reproduce(experiment, folder)))


def _track_video(
    video: Path,
    frame_range: tuple[int, int | None],
    fps: float | None,
    tracker_options: dict[str, Any],
    delivery: Delivery,
) -> Exit:
    from memo.video import VideoReader

    _check_writable(delivery.out)

    def opened() -> VideoReader:
        return VideoReader(video, start=frame_range[0], stop=frame_range[1], rate_hz=fps)

    with opened() as reader:
        _check_camera_fits(tracker_options, reader)
        if "camera" not in tracker_options and reader.pixel_aspect != 1:
            _complain(f"{video}: pixels are {reader.pixel_aspect:.3f} times as wide as high; give a --camera")
        tracker = _new_tracker(tracker_options)
        track, interrupted = _follow(reader, tracker, reader.frame_count, frame_range[0], delivery)
        if reader.damage:
            _complain(f"{video}: {reader.damage}")
    if interrupted:
        return _deliver_interrupted(track, delivery)
    with opened() as reader:
        written = _write_all(track, reader, reader.frame_count, reader.rate_hz, delivery)
    _report(track, written, delivery)
    if "camera" not in tracker_options and delivery.talks:
        print("No --camera: depths rest on the assumed field of view; heights and sideways positions do not.")
    return _exit_code(track)


def _unswap(path: Path, options: dict[str, Any], delivery: Delivery) -> Exit:
    from rich.console import Console

    _check_writable(delivery.out)
    console = Console(stderr=True)
    silent = delivery.quiet or not console.is_terminal
    with contextlib.nullcontext() if silent else console.status("looking at right and left"):
        repair = memo.unswap(memo.read_keypoints(path, **options))
        written = [delivery.out / path.resolve().name, delivery.out / "flips.csv"]
        if written[0].name == written[1].name:
            raise InputError(f"{path}: is called as the table of changes; rename it")
        repair.keypoints.write(written[0])
        write_flips_csv(written[1], repair.flips)
    _report_sides(repair, written, delivery)
    return Exit.DONE


def _report_sides(repair: Any, written: list[Path], delivery: Delivery) -> None:
    count = len(repair.keypoints.frames)
    if delivery.as_json:
        summary = {"frames": count, "exchanged": repair.exchanged, "undecided": repair.undecided}
        print(json.dumps({**summary, "files": [str(path) for path in written]}))
    elif delivery.talks:
        done = " and ".join(f"{group} in {frames}" for group, frames in repair.exchanged.items())
        doubt = " and ".join(f"{group} in {frames}" for group, frames in repair.undecided.items() if frames)
        undecided = f"undecided: {doubt}" if doubt else "none undecided"
        names = ", ".join(path.name for path in written)
        print(
            f"Right and left exchanged, of {count} frames: {done} ({undecided}); "
            f"written to {delivery.out}: {names}."
        )


def _demo(out: Path, seed: int) -> Exit:
    delivery = Delivery(out)
    _check_writable(out)
    scene, frames = _draw_scene(seed)
    tracker = _new_tracker({"height_m": scene.height_m, "camera": scene.camera})
    track, interrupted = _follow(frames, tracker, len(frames), 0, delivery)
    if interrupted:
        return _deliver_interrupted(track, delivery)
    rate_hz = 1 / float(np.median(np.diff(scene.times_s)))
    written = _write_all(track, frames, len(frames), rate_hz, delivery)
    _report(track, written, delivery)
    for line in _against_truth(track.columns, scene.truth):
        print(line)
    print("Next, your own video of one person walking across the picture, camera on a tripod:")
    print("  memo track VIDEO --height 1.75")
    return _exit_code(track)


def _reproduce(experiment: Experiment, out: Path) -> Exit:
    from memo.reproduce import EXPERIMENTS

    _check_writable(out)
    reproduction = EXPERIMENTS[experiment.value](out)
    print("\n".join(reproduction.lines))
    print(f"Written to {out}: {', '.join(path.name for path in reproduction.written)}.")
    return Exit.DONE


# The core is called here and nowhere else in this file.


def _new_tracker(options: dict[str, Any]) -> Any:
    return memo.Tracker(**options)


def _new_display(points: Any, options: dict[str, Any]) -> dict[str, Any]:
    positions = np.ascontiguousarray(points.positions, dtype=np.float64)
    return memo.pointlight(positions, points.times_s, points.names, **options)


def _walker_points(seconds: float, rate_hz: float) -> Any:
    from memo.figure import Points

    if not (math.isfinite(seconds * rate_hz) and 0 < seconds * rate_hz <= 100_000):
        raise InputError(f"--seconds {seconds:g} at {rate_hz:g} frames a second cannot be shown")
    walk = memo.walker_motion(max(1, round(seconds * rate_hz)), rate_hz=rate_hz)
    return Points(walk["names"], walk["times_s"], walk["positions"])


def _new_figure(points: Any, noise_px: float, options: dict[str, Any]) -> Any:
    return memo.planar(points.positions, points.times_s, noise_px, **options)


def _draw_scene(seed: int) -> tuple[Any, "list[Frame]"]:
    from memo.video import Frame

    scene = memo.demo_scene(seed=seed)
    timed = zip(scene.times_s, scene.frames, strict=True)
    return scene, [Frame(index, float(time_s), luma) for index, (time_s, luma) in enumerate(timed)]


def _load_camera(path: Path, name: str | None) -> Any:
    if not path.is_file():
        raise InputError(f"{path}: no such camera file")
    if path.suffix.lower() == ".xml":
        return memo.Camera.from_tsai(**read_tsai_xml(path))
    return memo.Camera.from_toml(str(path), name=name)


def _follow(
    frames: "Iterable[Frame]", tracker: Any, count: int | None, first_frame: int, delivery: Delivery
) -> tuple[Any, bool]:
    """Gives all frames to the tracker; an interrupt ends it after the current frame.

    An error in the middle is raised again once the tables hold what was tracked until then.
    """
    try:
        with _Interrupt() as interrupt:
            for frame in _with_progress(frames, "tracking", count, delivery):
                tracker.update(frame.luma, frame.time_s)
                if interrupt.requested:
                    break
    except ValueError as error:
        track = _snapshot(tracker.finish(), first_frame)
        if not len(track.columns["frame"]):
            raise
        _write_tables(track, delivery)
        raise InputError(f"{error}; the tables hold what was tracked until then") from error
    return _snapshot(tracker.finish(), first_frame), interrupt.requested


def _snapshot(track: Any, first_frame: int) -> Any:
    """The track's tables, read once, with frames numbered as in the video (the tracker counts from 0)."""

    def renumbered(table: dict[str, Any]) -> dict[str, Any]:
        return {**table, "frame": np.asarray(table["frame"]) + first_frame} if "frame" in table else table

    return SimpleNamespace(
        columns=renumbered(dict(track.columns)),
        events=[{**event, "frame": event["frame"] + first_frame} for event in track.events],
        start=renumbered(dict(track.start)),
        measured=renumbered(dict(track.measured)),
        contours=track.contours,
        summary=dict(track.summary),
    )


# What the user gave, checked before any work.


def _tracker_options(
    height_m: float, camera: Path | None, camera_name: str | None, fov_deg: float | None
) -> dict[str, Any]:
    options: dict[str, Any] = {"height_m": _checked_height(height_m)}
    if camera is not None and fov_deg is not None:
        raise InputError("--camera already holds the field of view: leave --fov-deg out")
    if camera is None and camera_name is not None:
        raise InputError("--camera-name needs --camera")
    if camera is not None:
        options["camera"] = _load_camera(camera, camera_name)
    if fov_deg is not None:
        if not 5 <= fov_deg <= 170:
            raise InputError(f"--fov-deg {fov_deg:g} is not a field of view in degrees (5 to 170)")
        options["fov_deg"] = fov_deg
    return options


def _checked_height(height_m: float) -> float:
    if 50 <= height_m <= 250:
        raise InputError(f"--height {height_m:g} looks like centimetres: give --height {height_m / 100:g}")
    if not (math.isfinite(height_m) and 0.5 <= height_m <= 2.5):
        raise InputError(f"--height {height_m:g} is not the height of a person in metres (0.5 to 2.5)")
    return height_m


def _frame_range(text: str) -> tuple[int, int | None]:
    start, colon, stop = text.partition(":")
    try:
        first, end = int(start or 0), int(stop) if stop else None
    except ValueError:
        first, end, colon = 0, None, ""
    if not colon or first < 0 or (end is not None and end <= first):
        raise InputError(f"--frames {text} is not A:B with 0 <= A < B")
    return first, end


def _check_writable(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise InputError(f"{out}: cannot be written to: {error.strerror}") from None


def _check_camera_fits(tracker_options: dict[str, Any], reader: Any) -> None:
    camera = tracker_options.get("camera")
    if camera is None or tuple(camera.size) == reader.size:
        return
    (width, height), (video_width, video_height) = camera.size, reader.size
    raise InputError(f"the camera is for {width}x{height} pixels, the video has {video_width}x{video_height}")


# What is written and said.


def _write_tables(track: Any, delivery: Delivery) -> list[Path]:
    for stale in _DRAWN:  # of an earlier run: they would stand beside tables they do not belong to
        (delivery.out / stale).unlink(missing_ok=True)
    table, events = delivery.out / "track.csv", delivery.out / "events.csv"
    write_track_csv(table, track.columns)
    write_events_csv(events, track.events)
    return [table, events]


def _write_all(
    track: Any, frames: "Iterable[Frame]", count: int | None, rate_hz: float, delivery: Delivery
) -> list[Path]:
    written = _write_tables(track, delivery)
    if not len(track.columns["frame"]):
        return written
    if delivery.overlay:
        from memo.overlay import write_overlay

        path = delivery.out / "overlay.mp4"
        write_overlay(path, _with_progress(frames, "drawing", count, delivery), track, rate_hz=rate_hz)
        written.append(path)
    if delivery.plots:
        from memo.plot import write_plots

        written += write_plots(track, delivery.out)
    return written


def _deliver_interrupted(track: Any, delivery: Delivery) -> Exit:
    _report(track, _write_tables(track, delivery), delivery)
    _complain("interrupted: the tables hold what was tracked until then; no overlay, no plots")
    return Exit.INTERRUPTED


def _report(track: Any, written: list[Path], delivery: Delivery) -> None:
    if delivery.as_json:
        files = [str(path) for path in written]
        print(json.dumps(_plain({**track.summary, "rows": len(track.columns["frame"]), "files": files})))
        return
    if not delivery.talks:
        return
    print(track.summary["message"])
    p_swapped = track.summary.get("p_swapped")
    if p_swapped is not None and p_swapped > _LIKELY_SWAPPED:
        print(f"Left and right may be swapped (probability {p_swapped:.0%}): look before you use them.")
    print(f"Written to {delivery.out}: {', '.join(path.name for path in written)}.")


def _exit_code(track: Any) -> Exit:
    return Exit.TRACKED if len(track.columns["frame"]) else Exit.NOBODY


def _against_truth(columns: dict[str, Any], truth: dict[str, Any]) -> list[str]:
    """Root mean square differences from the scene's truth, in sentences; none without a tracked frame."""
    rows = np.searchsorted(truth["frame"], columns["frame"])
    if not len(rows):
        return []

    def rms(names: Iterable[str]) -> float:
        return math.sqrt(np.nanmean([(columns[name] - np.asarray(truth[name])[rows]) ** 2 for name in names]))

    phase = (columns["phase"] - np.asarray(truth["phase"])[rows] + 0.5) % 1 - 0.5
    joints = math.sqrt(3) * rms(f"{joint}_{axis}_m" for joint in JOINTS for axis in "xyz")
    angles = rms(f"{side}_{joint}_deg" for side in ("right", "left") for joint in ("hip", "knee"))
    return [
        f"Against the drawn truth, root mean square over {len(rows)} frames:",
        "  torso " + ", ".join(f"{axis} {100 * rms([f'{axis}_m']):.1f} cm" for axis in "xyz"),
        f"  phase {math.sqrt(np.mean(phase**2)):.3f} of a cycle, hips and knees {angles:.1f} degrees",
        f"  joints {100 * joints:.1f} cm in space",
    ]


def _plain(value: Any) -> Any:
    """The value as JSON knows it: no numpy types, and null for what is not finite."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _with_progress(frames: Iterable[T], what: str, count: int | None, delivery: Delivery) -> Iterator[T]:
    """The same frames; on a terminal, a bar with the time left."""
    from rich.console import Console
    from rich.progress import track

    console = Console(stderr=True)
    silent = delivery.quiet or not console.is_terminal
    yield from track(frames, what, total=count, console=console, transient=True, disable=silent)


def _guarded(work: Callable[[], Exit]) -> Exit:
    """Runs a command; a user's mistake becomes one line. With MEMO_DEBUG set the traceback is kept."""
    from memo.video import VideoDamageWarning

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VideoDamageWarning)  # damage is told in one line instead
            return work()
    except (ValueError, TypeError, OSError, OverflowError) as error:
        if os.environ.get("MEMO_DEBUG"):
            raise
        _complain(" ".join(str(error).split()))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        _complain("interrupted")
        return Exit.INTERRUPTED


def _complain(message: str) -> None:
    print(f"memo: {message}", file=sys.stderr)


class _Interrupt(contextlib.AbstractContextManager["_Interrupt"]):
    """Turns the first Ctrl-C into a request, so that no frame is left half way; the second is raised."""

    def __init__(self) -> None:
        self.requested = False

    def __enter__(self) -> "_Interrupt":
        self._before = signal.signal(signal.SIGINT, self._request)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)

    def _request(self, *_: object) -> None:
        self.requested = True
        signal.signal(signal.SIGINT, self._before)


if __name__ == "__main__":
    main()
