"""`memo pointlight`: shows a motion as moving dots.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import math
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import memo
from memo.cli.delivery import Delivery, guarded
from memo.exits import Exit
from memo.files import write_table
from memo.given import InputError, check_writable, nothing_at
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo pointlight --azimuth-deg 60
  memo pointlight --azimuth-deg 60 --scramble-position --seed 3 --out control
  memo pointlight walk.c3d --out mine

Exit codes: 0 the display was written; 1 the input cannot be used; 2 wrong usage; \
4 the app extra is not installed."""

FEWEST_FRAMES = 8
"""`memo planar` does not link fewer dots."""

_SECONDS = 2.4


def add_pointlight(app: "typer.Typer") -> None:
    import typer

    usual = memo._memo.defaults("pointlight")

    @app.command(epilog=EPILOG)
    def pointlight(
        motion: Annotated[
            Path | None,
            typer.Argument(
                metavar="MOTION",
                help="CSV of NAME_x, NAME_y, NAME_z in metres, a folder with track.csv, or a motion file"
                " (.c3d, .bvh, .trc); default: an average walker.",
            ),
        ] = None,
        azimuth_deg: Annotated[
            float, typer.Option(help="Azimuth of the viewer, degrees; 90 looks from +x.")
        ] = usual["azimuth_deg"],
        elevation_deg: Annotated[float, typer.Option(help="Elevation of the viewer, degrees.")] = usual[
            "elevation_deg"
        ],
        px_per_m: Annotated[float, typer.Option(help="Scale, pixels per metre.")] = usual["px_per_m"],
        locomotion: Annotated[str, typer.Option(help="treadmill, translating or pelvis.")] = usual[
            "locomotion"
        ],
        inverted: Annotated[bool, typer.Option("--inverted", help="Upside down.")] = False,
        mirrored: Annotated[bool, typer.Option("--mirrored", help="Facing the other way.")] = False,
        reversed_: Annotated[bool, typer.Option("--reversed", help="Played backwards.")] = False,
        scramble_position: Annotated[
            bool, typer.Option("--scramble-position", help="Move each dot's motion to a random place.")
        ] = False,
        scramble_phase: Annotated[
            bool, typer.Option("--scramble-phase", help="Shift each dot's motion in time.")
        ] = False,
        period: Annotated[
            float | None, typer.Option(help="Period of the motion, seconds; default: its whole length.")
        ] = None,
        lifetime: Annotated[int | None, typer.Option(help="Limited lifetime of the dots, frames.")] = None,
        dots: Annotated[
            int | None, typer.Option(help=f"With --lifetime: dots shown; default: {usual['life_dots']}.")
        ] = None,
        on: Annotated[
            str | None,
            typer.Option(
                help=f"With --lifetime: limbs or joints; default: {usual['life_sites']}.", metavar="TEXT"
            ),
        ] = None,
        noise_dots: Annotated[int, typer.Option(help="Number of noise dots.")] = usual["noise_dots"],
        noise_kind: Annotated[
            str | None,
            typer.Option(
                help=f"With --noise-dots: scrambled, linear or flicker; default: {usual['noise_kind']}."
            ),
        ] = None,
        noise_px: Annotated[
            float, typer.Option(help="Standard deviation of the dots' noise, pixels.")
        ] = usual["noise_sd_px"],
        seconds: Annotated[
            float | None, typer.Option(help=f"Without MOTION: duration, seconds; default: {_SECONDS:g}.")
        ] = None,
        fps: Annotated[float | None, typer.Option(help="Frame rate, if the file has none.")] = None,
        seed: Annotated[int, typer.Option(help="Seed of everything random.", min=0)] = usual["seed"],
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
        delivery = Delivery(out, as_json=as_json, quiet=quiet)
        idle = {
            "--dots needs --lifetime": dots is not None and lifetime is None,
            "--on needs --lifetime": on is not None and lifetime is None,
            "--noise-kind needs --noise-dots": noise_kind is not None and not noise_dots,
            "--seconds cannot be used with MOTION": seconds is not None and motion is not None,
        }

        def work() -> Exit:
            for says, is_so in idle.items():
                if is_so:
                    raise InputError(says)
            return _pointlight(motion, _SECONDS if seconds is None else seconds, fps, options, delivery)

        raise typer.Exit(guarded(work))


def _pointlight(
    motion: Path | None, seconds: float, fps: float | None, options: dict[str, Any], delivery: Delivery
) -> Exit:
    from memo.linkage import Points, write_points_csv
    from memo.linkage_plot import write_display_video

    notes: Sequence[str] = ()
    _check_period(options["period_s"], options["scramble_phase"] is not None)
    if motion is None:
        points = _walker_points(
            seconds, memo._memo.defaults("walker_motion")["rate_hz"] if fps is None else fps
        )
    else:
        points, notes = _read_points(motion, fps)
    out = delivery.out
    check_writable(out)
    display = _new_display(points, options)
    shown, labels = display.positions_px, display.labels
    stays = bool((labels == labels[0]).all()) and options["lifetime_frames"] is None
    named = [points.names[k] if stays and k >= 0 else f"dot{i:02d}" for i, k in enumerate(labels[0])]
    write_points_csv(out / "dots.csv", Points(named, display.times_s, shown))
    _write_labels(out / "labels.csv", points.names, named, display)
    write_display_video(out / "display.mp4", display.times_s, shown)
    written = [out / "dots.csv", out / "labels.csv", out / "display.mp4"]
    summary = {"dots": shown.shape[1], "frames": shown.shape[0], "notes": list(notes)}
    delivery.tell(
        summary, [*notes, f"{counted(shown.shape[1], 'dot')} in {counted(shown.shape[0], 'frame')}."], written
    )
    scrambled = options["scramble_position"] or options["scramble_phase"]
    if delivery.talks and stays and not scrambled and len(shown) >= FEWEST_FRAMES:
        given = f"{shlex.quote(str(out / 'dots.csv'))} --noise-px {options['noise_sd_px']:g}"
        print(f"To find the limbs in it again: memo planar {given}")
    return Exit.DONE


def _read_points(path: Path, fps: float | None) -> tuple[Any, Sequence[str]]:
    """All points of a table; of a motion file or the folder of a track, only the joints."""
    from memo.formats import READERS, FormatError, read_motion
    from memo.formats.names import joint_points
    from memo.linkage import Points, read_points_csv

    if not path.exists():
        raise InputError(nothing_at(path, "file or folder"))
    if not path.is_dir() and path.suffix.lower() not in READERS.keys() - {".csv"}:
        return read_points_csv(path, 3, fps), ()
    motion = read_motion(path)
    if fps is not None:
        raise InputError(f"{path}: already has times: leave --fps out")
    try:
        joints = joint_points(motion)
    except FormatError as error:
        raise InputError(f"{path}: {error}") from None
    return Points(list(joints.names), joints.times_s, joints.points), motion.notes


def _check_period(period_s: float | None, scrambles_phase: bool) -> None:
    if period_s is None:
        return
    if not (period_s > 0 and math.isfinite(period_s)):
        raise InputError(f"--period {period_s:g} must be positive and finite")
    if not scrambles_phase:
        raise InputError("--period needs --scramble-phase")


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


def _new_display(points: Any, options: dict[str, Any]) -> memo._memo.PointLightDisplay:
    positions = np.ascontiguousarray(points.positions, dtype=np.float64)
    return memo.pointlight(positions, points.times_s, points.names, **options)


def _walker_points(seconds: float, rate_hz: float) -> Any:
    from memo.linkage import Points

    if not (math.isfinite(seconds * rate_hz) and 0 < seconds * rate_hz <= 100_000):
        raise InputError(f"--seconds {seconds:g} at {rate_hz:g} frames per second cannot be shown")
    walk = memo.walker_motion(max(1, round(seconds * rate_hz)), rate_hz=rate_hz)
    return Points(walk.names, walk.times_s, walk.positions)
