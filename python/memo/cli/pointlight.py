"""`memo pointlight`: shows a motion as moving dots.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import math
import re
import shlex
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import memo
from memo.cli.delivery import Delivery, guarded
from memo.exits import Exit
from memo.files import write_table
from memo.given import InputError, UsageError, check_apart, check_writable, nothing_at
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo pointlight --cycles 2 --azimuth-deg 60
  memo pointlight --cycles 2 --azimuth-deg 60 --scramble-position --seed 3 --out control
  memo pointlight walk.c3d --markers joints.toml --cycles 2 --png --lossless --out mine

Exit codes: 0 the display was written; 1 the input cannot be used; 2 wrong usage; \
4 the app extra is not installed."""

FEWEST_FRAMES = 8
"""`memo planar` does not link dots of fewer frames."""

MOST_DOTS = 16
"""`memo planar` gives no verdict on more dots."""

_SECONDS = 2.4
_TABLES = ("dots.csv", "labels.csv")

_MOST_SPEED_MPS = 4.0
"""Of people who walk: race walkers."""

_OPTIONS = {
    "period_s": "--period",
    "noise_sd_px": "--noise-px",
    "scramble_limit_px": "--scramble-limit-px",
    "area_scale of the noise dots": "--noise-area",
    "pixels per metre": "--px-per-m",
    "size_px": "--size",
    "centre_px": "--centre",
    "dot_px": "--dot-px",
    "offsets_px": "--apart-m",
}
"""The option for each argument that messages of `memo.pointlight` and of its displays name."""

_MOST_SEED = 2**63 - 1

_SAME_TIME_S = 1e-3  # files round times to milliseconds

_SAME_FRAMES = 1e-3

_SAME_CYCLE = 1.03
"""Cycles of actors who walk in step differ by less, longest over shortest."""

_SEAM = 1.25
"""A step from end to start, as a multiple of the dot's largest step: at most 1.05 in recorded walks."""

_NOISE_SDS = 6.0
"""Noise moves a dot from one frame to the next by less, in standard deviations of a coordinate."""


class Locomotion(StrEnum):
    """Treatment of the forward motion."""

    TREADMILL = "treadmill"
    TRANSLATING = "translating"
    PELVIS = "pelvis"


class Axes(StrEnum):
    """Directions of the shifts of scrambled dots."""

    BOTH = "both"
    HORIZONTAL = "horizontal"
    VERTICAL = "vertical"


class Sites(StrEnum):
    """Places of dots with a limited lifetime."""

    LIMBS = "limbs"
    JOINTS = "joints"


class NoiseKind(StrEnum):
    """Motion of noise dots."""

    SCRAMBLED = "scrambled"
    LINEAR = "linear"
    FLICKER = "flicker"


class Shape(StrEnum):
    """Shape of a dot."""

    DISC = "disc"
    SQUARE = "square"
    GAUSSIAN = "gaussian"


def add_pointlight(app: "typer.Typer") -> None:
    import typer

    usual = memo._memo.defaults("pointlight")
    usual_locomotion = Locomotion(usual["locomotion"])
    drawn = memo._memo.defaults("pointlight_frames")
    usual_shape = Shape(drawn["shape"])

    @app.command(epilog=EPILOG)
    def pointlight(
        motion: Annotated[
            list[Path] | None,
            typer.Argument(
                metavar="MOTION...",
                help="CSV of NAME_x, NAME_y, NAME_z in metres, a folder with track.csv, or a motion file"
                " (.c3d, .bvh, .trc, .amc); several: one actor each; default: an average walker.",
            ),
        ] = None,
        markers: Annotated[
            Path | None,
            typer.Option(
                help='TOML with the markers of each joint: right_hip = "RASI", or a list to average.'
            ),
        ] = None,
        apart_m: Annotated[
            float | None,
            typer.Option(help="Sideways distance between actors, metres; default: as recorded."),
        ] = None,
        cycles: Annotated[
            int | None, typer.Option(help="Number of whole cycles, which loop without a jump.", min=1)
        ] = None,
        speed: Annotated[
            float | None, typer.Option(help="Without MOTION: walking speed, m/s, up to 4; default: 1.3.")
        ] = None,
        tempo: Annotated[
            float | None,
            typer.Option(help="With MOTION and --cycles: times as fast; default: 1.", min=0.1, max=10),
        ] = None,
        azimuth_deg: Annotated[
            float, typer.Option(help="Direction of the viewer, degrees: 0 from the side, 90 from the front.")
        ] = usual["azimuth_deg"],
        elevation_deg: Annotated[
            float, typer.Option(help="Elevation of the viewer, degrees.", min=-90, max=90)
        ] = usual["elevation_deg"],
        px_per_m: Annotated[float, typer.Option(help="Scale, pixels per metre.")] = usual["px_per_m"],
        locomotion: Annotated[
            Locomotion, typer.Option(help="On the spot, as recorded, or with the pelvis fixed.")
        ] = usual_locomotion,
        inverted: Annotated[bool, typer.Option("--inverted", help="Upside down.")] = False,
        mirrored: Annotated[bool, typer.Option("--mirrored", help="Facing the other way.")] = False,
        reversed_: Annotated[bool, typer.Option("--reversed", help="Played backwards.")] = False,
        scramble_position: Annotated[
            bool, typer.Option("--scramble-position", help="Move each dot's motion to a random place.")
        ] = False,
        scramble_axes: Annotated[
            Axes | None,
            typer.Option(
                help=f"With --scramble-position: directions of the shifts; default: {usual['scramble_axes']}."
            ),
        ] = None,
        scramble_limit_px: Annotated[
            float | None,
            typer.Option(help="With --scramble-position: largest shift; default: the figure's extent."),
        ] = None,
        scramble_phase: Annotated[
            bool, typer.Option("--scramble-phase", help="Shift each dot's motion in time.")
        ] = False,
        period: Annotated[
            float | None, typer.Option(help="Period of the motion, seconds; default: the one found.")
        ] = None,
        lifetime: Annotated[
            int | None, typer.Option(help="Limited lifetime of the dots, frames.", min=1)
        ] = None,
        dots: Annotated[
            int | None,
            typer.Option(
                help=f"With --lifetime: dots shown per figure; default: {usual['life_dots']}.", min=1
            ),
        ] = None,
        on: Annotated[
            Sites | None,
            typer.Option(help=f"With --lifetime: places of the dots; default: {usual['life_sites']}."),
        ] = None,
        noise_dots: Annotated[int, typer.Option(help="Number of noise dots in the display.", min=0)] = usual[
            "noise_dots"
        ],
        noise_kind: Annotated[
            NoiseKind | None,
            typer.Option(help=f"With --noise-dots: their motion; default: {usual['noise_kind']}."),
        ] = None,
        noise_area: Annotated[
            float | None,
            typer.Option(
                help="With --noise-dots: size of their region, as a multiple of the figure's; "
                f"default: {usual['noise_area']}."
            ),
        ] = None,
        noise_px: Annotated[
            float, typer.Option(help="Standard deviation of the dots' noise, pixels.", min=0)
        ] = usual["noise_sd_px"],
        seconds: Annotated[
            float | None, typer.Option(help=f"Without MOTION: duration, seconds; default: {_SECONDS:g}.")
        ] = None,
        fps: Annotated[float | None, typer.Option(help="Frame rate, if the file has none.")] = None,
        seed: Annotated[int, typer.Option(help="Seed of everything random.", min=0, max=_MOST_SEED)] = usual[
            "seed"
        ],
        size: Annotated[
            str, typer.Option(help="Width and height of the picture, pixels.", metavar="WxH")
        ] = "{}x{}".format(*drawn["size_px"]),
        centre: Annotated[
            str | None,
            typer.Option(help="Pixel of dots.csv in the middle; default: of the figure.", metavar="U,V"),
        ] = None,
        dot_px: Annotated[float, typer.Option(help="Size of a dot, pixels.")] = drawn["dot_px"],
        shape: Annotated[Shape, typer.Option(help="Shape of a dot.")] = usual_shape,
        colour: Annotated[str, typer.Option(help="Of the dots.")] = _hexadecimal(drawn["colour"]),
        background: Annotated[str, typer.Option(help="Colour behind the dots.")] = _hexadecimal(
            drawn["background"]
        ),
        hard: Annotated[bool, typer.Option("--hard", help="Dots without smooth edges.")] = False,
        lossless: Annotated[
            bool, typer.Option("--lossless", help="display.mkv (FFV1) in place of display.mp4.")
        ] = False,
        png: Annotated[bool, typer.Option("--png", help="Also pictures with alpha, in frames/.")] = False,
        out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("memo-out/pointlight"),
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Makes a point-light display: dots.csv, labels.csv and display.mp4."""
        options = {
            "azimuth_deg": azimuth_deg,
            "elevation_deg": elevation_deg,
            "px_per_m": px_per_m,
            "locomotion": locomotion,
            "cycles": cycles,
            "tempo": tempo,
            "inverted": inverted,
            "mirrored": mirrored,
            "reversed": reversed_,
            "scramble_position": scramble_position,
            "scramble_axes": scramble_axes,
            "scramble_limit_px": scramble_limit_px,
            "scramble_phase": "periodic" if scramble_phase else None,
            "period_s": period,
            "lifetime_frames": lifetime,
            "life_dots": dots,
            "life_sites": on,
            "noise_dots": noise_dots,
            "noise_kind": noise_kind,
            "noise_area": noise_area,
            "noise_sd_px": noise_px,
            "seed": seed,
        }
        delivery = Delivery(out, as_json=as_json, quiet=quiet)
        idle = {
            "--dots needs --lifetime": dots is not None and lifetime is None,
            "--on needs --lifetime": on is not None and lifetime is None,
            "--noise-kind needs --noise-dots": noise_kind is not None and not noise_dots,
            "--noise-area needs --noise-dots": noise_area is not None and not noise_dots,
            "--scramble-axes needs --scramble-position": scramble_axes is not None and not scramble_position,
            "--scramble-limit-px needs --scramble-position": scramble_limit_px is not None
            and not scramble_position,
            "--hard has no effect with --shape gaussian": hard and shape is Shape.GAUSSIAN,
            "--seconds cannot be used with MOTION": seconds is not None and bool(motion),
            "--seconds cannot be used with --cycles": seconds is not None and cycles is not None,
            "--speed cannot be used with MOTION": speed is not None and bool(motion),
            "--markers needs MOTION": markers is not None and not motion,
            "--tempo needs MOTION and --cycles": tempo is not None and not (motion and cycles),
            "--apart-m needs several MOTION": apart_m is not None and len(motion or ()) < 2,
            "--period needs --scramble-phase, or MOTION and --cycles": period is not None
            and not (scramble_phase or (motion and cycles)),
        }

        positive = {
            "--period": period,
            "--fps": fps,
            "--seconds": seconds,
            "--px-per-m": px_per_m,
            "--dot-px": dot_px,
            "--apart-m": apart_m,
            "--noise-area": noise_area,
            "--scramble-limit-px": scramble_limit_px,
        }

        def work() -> Exit:
            for says, is_so in idle.items():
                if is_so:
                    raise UsageError(says)
            if not math.isfinite(azimuth_deg):
                raise UsageError(f"--azimuth-deg {azimuth_deg:g} must be finite")
            for option, value in positive.items():
                if value is not None and not (value > 0 and math.isfinite(value)):
                    raise UsageError(f"{option} {value:g} must be positive and finite")
            if speed is not None and not 0 < speed <= _MOST_SPEED_MPS:
                raise UsageError(
                    f"--speed {speed:g} is not a walking speed in m/s (up to {_MOST_SPEED_MPS:g})"
                )
            picture = {
                "size_px": _numbers("--size", size, "x", int),
                "centre_px": None if centre is None else _numbers("--centre", centre, ",", float),
                "dot_px": dot_px,
                "shape": shape,
                "colour": _rgb("--colour", colour),
                "background": _rgb("--background", background),
                "smooth": not hard,
            }
            notes: list[str] = []
            read = [path for path in (*(motion or ()), markers) if path is not None and path.is_file()]
            check_apart(read, [out / name for name in _TABLES])
            if motion:
                actors, notes = _read_actors(motion, markers, fps)
            else:
                length_s = _SECONDS if seconds is None else seconds
                walk, cycle_s = _walker_points(length_s, fps, cycles is not None, speed)
                actors = [walk]
                if cycles is not None:
                    options["period_s"] = cycle_s
            display, names = _display_of(actors, motion or [], options, apart_m)
            return _deliver(display, names, options, picture, (lossless, png), notes, delivery)

        raise typer.Exit(guarded(work))


def _deliver(
    display: memo._memo.PointLightDisplay,
    names: list[str],
    options: dict[str, Any],
    picture: dict[str, Any],
    also: tuple[bool, bool],
    notes: Sequence[str],
    delivery: Delivery,
) -> Exit:
    from memo.display import even_size, frames_left, remove_display, write_display_png, write_display_video
    from memo.linkage import Points, write_points_csv

    out, (lossless, png) = delivery.out, also
    try:
        display.frames(stop=0, **picture)  # before anything is written
    except ValueError as error:
        raise UsageError(_in_options(str(error))) from None
    check_writable(out)
    remove_display(out)
    shown, labels = display.positions_px, display.labels
    stays = bool((labels == labels[0]).all()) and options["lifetime_frames"] is None
    named = [names[k] if stays and k >= 0 else f"dot{i:02d}" for i, k in enumerate(labels[0])]
    written = [*(out / name for name in _TABLES), out / f"display.{'mkv' if lossless else 'mp4'}"]
    write_points_csv(written[0], Points(named, display.times_s, shown))
    _write_labels(written[1], names, named, display)
    write_display_video(written[2], display, lossless=lossless, **picture)
    if png:
        write_display_png(out / "frames", display, **picture)
        written.append(out / "frames")
    lines = [*notes, f"{counted(shown.shape[1], 'dot')} in {counted(shown.shape[0], 'frame')}."]
    if not lossless and any(side % 2 for side in picture["size_px"]):
        even, asked = (
            "x".join(map(str, size)) for size in (even_size(picture["size_px"]), picture["size_px"])
        )
        lines.append(f"display.mp4 is {even}, as its sides must be even numbers; --lossless keeps {asked}.")
    left, (width, height) = frames_left(display, picture["size_px"], picture["centre_px"])
    if left:
        lines.append(
            f"Dots leave the picture in {counted(left, 'frame')}; --size {width}x{height} holds them."
        )
    loops = _loops(display, options)
    if loops:
        lines.append(f"The cycle of {display.period_s:.4g} s loops.")
    elif options["cycles"] is not None and display.period_s is not None and len(shown) > 1:
        lines.append(
            f"A cycle takes {display.period_s:.4g} s, but the last frame does not lead into the first."
        )
    summary = {
        "dots": shown.shape[1],
        "frames": shown.shape[0],
        "period_s": display.period_s,
        "loops": loops,
        "centre_px": list(display.centre_px),
        "frames_with_dots_outside": left,
        "notes": list(notes),
    }
    delivery.tell(summary, lines, written)
    scrambled = options["scramble_position"] or options["scramble_phase"]
    can_be_linked = len(shown) >= FEWEST_FRAMES and shown.shape[1] <= MOST_DOTS
    if delivery.talks and stays and not scrambled and can_be_linked:
        given = f"{shlex.quote(str(out / 'dots.csv'))} --noise-px {options['noise_sd_px']:g}"
        print(f"To find the limbs in it again: memo planar {given}")
    return Exit.DONE


def _loops(display: memo._memo.PointLightDisplay, options: dict[str, Any]) -> bool:
    """Whether the last frame leads into the first: the display is whole cycles, in which no dot moves farther
    from the end to the start than within a cycle. Dots that jump or move on their own lead nowhere."""
    frames = len(display.times_s)
    own_way = options["lifetime_frames"] is not None or (
        options["noise_dots"] and options["noise_kind"] not in (None, "scrambled")
    )
    if display.period_s is None or own_way or frames < 2:
        return False
    frames_per_cycle = display.period_s / float(np.median(np.diff(display.times_s)))
    cycles = round(frames / frames_per_cycle)
    if cycles < 1 or abs(cycles * frames_per_cycle - frames) > _SAME_FRAMES:
        return False
    moved_by_noise = _NOISE_SDS * options["noise_sd_px"]
    for path in np.moveaxis(display.positions_px, 1, 0):
        known = np.flatnonzero(np.isfinite(path[:, 0]))
        if len(known) < 2:
            continue
        within = known[known < round(frames_per_cycle)]
        steps = np.linalg.norm(np.diff(path[within], axis=0), axis=1) / np.diff(within)
        apart = np.linalg.norm(path[known[0]] - path[known[-1]]) / (known[0] + frames - known[-1])
        if apart > _SEAM * steps.max(initial=0) + moved_by_noise + 1e-6:
            return False
    return True


def _hexadecimal(colour: tuple[int, int, int]) -> str:
    return "#" + "".join(f"{channel:02x}" for channel in colour)


def _rgb(option: str, text: str) -> tuple[int, int, int]:
    from PIL import ImageColor

    try:
        red, green, blue = ImageColor.getrgb(text)[:3]
    except ValueError:
        raise UsageError(f"{option} {text}: wanted a colour such as #ffcc00 or white") from None
    return red, green, blue


def _numbers(option: str, text: str, separator: str, kind: type[int] | type[float]) -> tuple[Any, Any]:
    try:
        first, second = (kind(part) for part in text.split(separator))
    except ValueError:
        wanted = "640x480" if kind is int else "120.5,-80"
        raise UsageError(f"{option} {text}: wanted two numbers such as {wanted}") from None
    if kind is int and min(first, second) < 1:
        raise UsageError(f"{option} {text}: wanted a width and height of at least 1")
    return first, second


def _read_actors(paths: list[Path], markers: Path | None, fps: float | None) -> tuple[list[Any], list[str]]:
    """The points of each file at the times that all have in common; of recordings that do not overlap in
    time, from the first frame of each, as many frames as the shortest has."""
    read = [_read_points(path, markers, fps) for path in paths]
    actors, notes = (
        [points for points, _ in read],
        list(dict.fromkeys(note for _, own in read for note in own)),
    )
    if len(actors) == 1:
        return actors, notes
    firsts, clock_notes = _first_frames([points.times_s for points in actors])
    notes += clock_notes
    left = [len(points.times_s) - first for points, first in zip(actors, firsts, strict=True)]
    if not any(firsts) and max(left) > min(left):
        notes.append(f"Cut to {counted(min(left), 'frame')}, the length of the shortest motion.")
    shown = [slice(first, first + min(left)) for first in firsts]
    clocks = [
        points.times_s[frames] - points.times_s[frames.start]
        for points, frames in zip(actors, shown, strict=True)
    ]
    for path, clock in zip(paths, clocks, strict=True):
        if not np.allclose(clock, clocks[0], atol=_SAME_TIME_S):
            raise InputError(f"{path}: has other times than {paths[0]}: give motions of one frame rate")
    cut = [
        replace(points, times_s=clocks[0], positions=points.positions[frames])
        for points, frames in zip(actors, shown, strict=True)
    ]
    return cut, notes


def _first_frames(clocks: list[Any]) -> tuple[list[int], list[str]]:
    """The frame of each actor with which a common display begins, and what the user should know of it."""
    starts_s = [float(times_s[0]) for times_s in clocks]
    if max(starts_s) - min(starts_s) < _SAME_TIME_S:
        return [0] * len(clocks), []
    start_s, end_s = max(starts_s), min(float(times_s[-1]) for times_s in clocks)
    if start_s >= end_s:
        return [0] * len(clocks), [
            "The motions were recorded at different times: all begin with their first frames."
        ]
    firsts = [int(np.argmin(np.abs(times_s - start_s))) for times_s in clocks]
    frames = min(len(times_s) - first for times_s, first in zip(clocks, firsts, strict=True))
    return firsts, [
        f"Cut to the {counted(frames, 'frame')} from {start_s:.4g} to {end_s:.4g} s, which all motions have"
        " in common."
    ]


def _read_points(path: Path, markers: Path | None, fps: float | None) -> tuple[Any, Sequence[str]]:
    """All points of a table; of a motion file or the folder of a track, only the joints."""
    from memo.formats import READERS, FormatError, read_motion
    from memo.formats.names import joint_points, mapped_points, read_marker_map
    from memo.linkage import Points, read_points_csv

    if not path.exists():
        raise InputError(nothing_at(path, "file or folder"))
    wanted = None if markers is None else read_marker_map(markers)
    notes: Sequence[str] = ()
    if not path.is_dir() and path.suffix.lower() not in READERS.keys() - {".csv"}:
        points = read_points_csv(path, 3, fps)
    else:
        motion = read_motion(path, markers=wanted)
        if fps is not None:
            raise InputError(f"{path}: already has times: leave --fps out")
        if wanted is None:
            try:
                motion = joint_points(motion)
            except FormatError as error:
                raise InputError(f"{path}: {error}; name the markers of each joint with --markers") from None
        points, notes = Points(list(motion.names), motion.times_s, motion.points), motion.notes
    if wanted is None:
        return points, notes
    try:
        names, positions = mapped_points(points.names, points.positions, wanted)
    except FormatError as error:
        raise InputError(f"{path}: {error}") from None
    return Points(names, points.times_s, positions), notes


def _display_of(
    actors: list[Any], paths: Sequence[Path], options: dict[str, Any], apart_m: float | None
) -> tuple[memo._memo.PointLightDisplay, list[str]]:
    """One display of all actors, each with its own seed and its share of the noise dots, and the names of all
    points."""
    share, rest = divmod(options["noise_dots"], len(actors))
    several = len(actors) > 1
    if several and options["cycles"] is not None:
        options = {**options, **_common_cycle(actors, paths, options)}
    displays = []
    for index, points in enumerate(actors):
        own = {**options, "seed": options["seed"] + index, "noise_dots": share + (index < rest)}
        try:
            displays.append(memo.pointlight(_positions(points), points.times_s, points.names, **own))
        except ValueError as error:
            raise InputError(_of_file(str(error), paths[index] if several else None)) from None
    if not several:
        return displays[0], actors[0].names
    names = [f"actor{index}_{name}" for index, points in enumerate(actors, 1) for name in points.names]
    try:
        return memo.pointlight_together(displays, _offsets_px(displays, options, apart_m)), names
    except ValueError as error:
        raise UsageError(_in_options(str(error))) from None


def _common_cycle(actors: list[Any], paths: Sequence[Path], options: dict[str, Any]) -> dict[str, float]:
    """The period and the start of one cycle of all actors, so that they stay in step with each other."""
    asked_s = options["period_s"]
    own_s = []
    for points, path in zip(actors, paths, strict=True):
        try:
            cycle = memo.pointlight_cycle(
                [_positions(points)], points.times_s, [points.names], period_s=asked_s
            )
        except ValueError as error:
            raise InputError(_of_file(str(error), path)) from None
        own_s.append(cycle[0])
    interval_s = float(np.mean(np.diff(actors[0].times_s))) if len(actors[0].times_s) > 1 else 0.0
    if max(own_s) > max(_SAME_CYCLE * min(own_s), min(own_s) + interval_s / 2):
        tempo = options["tempo"] or 1.0
        shown_s = [round(period_s / tempo / interval_s) * interval_s for period_s in own_s]
        raise InputError(
            f"the cycles of the motions take {', '.join(f'{period_s:.4g}' for period_s in shown_s)} s, so"
            " they cannot loop together: leave --cycles out, or give each its own tempo in Python and join"
            " the displays with memo.pointlight_together"
        )
    positions = [_positions(points) for points in actors]
    names = [points.names for points in actors]
    try:
        period_s, start_s = memo.pointlight_cycle(positions, actors[0].times_s, names, period_s=asked_s)
    except ValueError as error:
        raise InputError(_in_options(str(error))) from None
    return {"period_s": period_s, "cycle_start_s": start_s}


def _offsets_px(
    displays: list[memo._memo.PointLightDisplay], options: dict[str, Any], apart_m: float | None
) -> Any:
    """How far each display moves: sideways if actors are to stand apart, heights stay. `memo.pointlight`
    flips each about its own middle; the scene of all is flipped about the middle of all."""
    middles = np.array([display.centre_px for display in displays])
    offsets = np.zeros_like(middles)
    if apart_m is not None:
        sides = (np.arange(len(displays)) - (len(displays) - 1) / 2) * apart_m * options["px_per_m"]
        offsets[:, 0] = middles[:, 0].mean() + sides - middles[:, 0]
    placed = middles + offsets
    is_flipped = np.array([options["mirrored"], options["inverted"]])
    return offsets + np.where(is_flipped, 2 * (placed.mean(axis=0) - placed), 0.0)


def _positions(points: Any) -> Any:
    return np.ascontiguousarray(points.positions, dtype=np.float64)


def _of_file(message: str, path: Path | None) -> str:
    """A message with the command's options, and the file if it is about one of several."""
    message = _in_options(message)
    is_of_option = message.startswith("--") and " must be " in message
    return message if path is None or is_of_option else f"{path}: {message}"


def _in_options(message: str) -> str:
    """A message of `memo.pointlight` or of its displays, with the command's options for their arguments."""
    message = message.replace(', or shift the phases with "shortened"', "")
    unknown = r"at the best lag, the mismatch is inf of .* wanted\)"
    message = re.sub(unknown, "no lag fits better than those around it", message)
    for argument, option in _OPTIONS.items():
        message = re.sub(rf"\b{argument}\b", option, message)
    return message


def _walker_points(
    seconds: float, fps: float | None, one_cycle: bool, speed: float | None
) -> tuple[Any, float]:
    """The average walker, and the duration of a cycle."""
    from memo.linkage import Points

    rate_hz = memo._memo.defaults("walker_motion")["rate_hz"] if fps is None else fps
    if one_cycle:
        walk = memo.walker_motion(cycles=1, rate_hz=rate_hz, speed_mps=speed)
    else:
        if not (math.isfinite(seconds * rate_hz) and 0 < seconds * rate_hz <= 100_000):
            raise UsageError(f"--seconds {seconds:g} at {rate_hz:g} frames per second cannot be shown")
        walk = memo.walker_motion(max(1, round(seconds * rate_hz)), rate_hz=rate_hz, speed_mps=speed)
    return Points(walk.names, walk.times_s, walk.positions), walk.cycle_s


def _write_labels(
    path: Path, names: list[str], dots: list[str], display: memo._memo.PointLightDisplay
) -> None:
    """One row per frame and dot: the joint, or both ends of the limb, or "noise"."""
    rows = []
    for frame, row in enumerate(display.labels):
        for dot, label in enumerate(row):
            end = int(display.limb_ends[frame, dot])
            shows = names[label] if label >= 0 else "noise"
            limb = [names[end], f"{display.fractions[frame, dot]:.4f}"] if end >= 0 else ["", ""]
            rows.append([frame, dots[dot], shows, *limb, int(display.visible[frame, dot])])
    write_table(path, ["frame", "dot", "shows", "limb_end", "fraction", "visible"], rows)
