"""`memo convert`: results and motion files in the formats of other programs.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import json
import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from memo.cli.delivery import Delivery, guarded, with_elapsed
from memo.exits import Exit
from memo.files import plain
from memo.given import InputError, check_apart, check_writable, nothing_at
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo convert memo-out/walk walk.trc --names pose2sim
  memo convert memo-out/walk walk.bvh --walk 0
  memo convert walk.c3d walk.csv --rate 50

Exit codes: 0 TARGET was written; 1 the input cannot be used; 2 wrong usage; \
4 the app extra is not installed."""


class Axis(StrEnum):
    z = "z"
    y = "y"


class Naming(StrEnum):
    memo = "memo"
    pose2sim = "pose2sim"
    gait2392 = "gait2392"


def add_convert(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EPILOG)
    def convert(
        source: Annotated[
            Path,
            typer.Argument(
                metavar="SOURCE",
                help="A folder of `memo track` or `memo posture`, or a motion file:"
                " .c3d, .bvh, .amc, .trc, .mot, .sto, .csv, .parquet; for keypoints also a detector's files.",
            ),
        ],
        target: Annotated[
            Path,
            typer.Argument(
                metavar="TARGET",
                help=".trc, .csv, .parquet: joints; .mot, .sto: joint angles;"
                " .c3d: joints, angles and events; .bvh: a skeleton; .json: keypoints as COCO results;"
                " no ending: a folder of OpenPose keypoints; .txt: a track as MOTChallenge rows.",
            ),
        ],
        up: Annotated[
            Axis | None,
            typer.Option(help="Up axis of TARGET; default: y for .trc, .mot, .sto and .bvh, else z."),
        ] = None,
        from_up: Annotated[
            Axis | None, typer.Option(help="Up axis of SOURCE, in place of the one it names.")
        ] = None,
        rate: Annotated[
            float | None, typer.Option(help="Frame rate to which TARGET is interpolated linearly, Hz.")
        ] = None,
        fill: Annotated[
            float | None, typer.Option(help="Longest gap to interpolate linearly, seconds.")
        ] = None,
        names: Annotated[
            Naming | None,
            typer.Option(
                help="Names of the joints in TARGET: those of memo, of Pose2Sim's OpenSim models,"
                " or the joint angles of OpenSim's gait2392 (.mot); default: as in SOURCE."
            ),
        ] = None,
        is_clinical: Annotated[
            bool,
            typer.Option(
                "--clinical",
                help="Hip angles of a track against the pelvis, with its average tilt, not the vertical.",
            ),
        ] = False,
        walk: Annotated[
            int | None, typer.Option(help="One walk of a track, counted from 0; default: all.")
        ] = None,
        fps: Annotated[float | None, typer.Option(help="Frame rate of a table without times.")] = None,
        image_size: Annotated[
            str | None,
            typer.Option(
                help="Width and height of the picture, pixels: for keypoints that are fractions of it.",
                metavar="WxH",
            ),
        ] = None,
        unit: Annotated[
            str | None,
            typer.Option(help="Unit of lengths, if SOURCE names none: m, cm, mm, or its length in metres."),
        ] = None,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Writes SOURCE in another format, chosen by the ending of TARGET's name."""
        delivery = Delivery(target.parent, as_json=as_json, quiet=quiet)

        def work() -> Exit:
            given = {"rate_hz": _checked(fps, "--fps"), "unit_m": _unit_m(unit)}
            reading = {"up": None if from_up is None else from_up.value, "walk": walk, **given}
            changes = (_checked(rate, "--rate"), _checked(fill, "--fill"))
            if target.suffix.lower() in _IN_PICTURE:
                asked = {"--from-up": from_up, "--rate": rate, "--fill": fill, "--walk": walk, "--unit": unit}
                asked |= {"--names": names, "--clinical": is_clinical or None}
                return _convert_picture(source, target, up, fps, image_size, asked, delivery)
            if image_size is not None:
                raise InputError("--image-size: has no meaning for data in space")
            return _convert(source, target, reading, (up, names, is_clinical), *changes, delivery)

        raise typer.Exit(guarded(work))


_WITHOUT_ANGLES = (".bvh", ".trc")


def _convert(
    source: Path,
    target: Path,
    reading: dict[str, Any],
    writing: tuple[Axis | None, Naming | None, bool],
    rate_hz: float | None,
    fill_s: float | None,
    delivery: Delivery,
) -> Exit:
    from memo.formats import WRITERS, clinical, read_motion, usual_up, write_motion
    from memo.formats.run_folder import sources

    if target.suffix.lower() not in WRITERS:
        endings = ", ".join(sorted({*WRITERS, ".txt", ".json"}))
        raise InputError(f"{target}: the ending must be one of {endings}")
    if target.is_dir():
        raise InputError(f"{target}: is a folder")
    if writing[2] and target.suffix.lower() in _WITHOUT_ANGLES:
        raise InputError(f"--clinical: has no effect, as a {target.suffix} file holds no joint angles")
    if not source.exists():
        raise InputError(nothing_at(source, "file or folder"))
    check_writable(target.parent)
    check_apart(sources(source) if source.is_dir() else [source], [target])
    with with_elapsed("converting", delivery):
        up, names, is_clinical = writing
        motion = read = read_motion(source, **reading)
        if is_clinical:
            motion = clinical(motion)
        notes = [*motion.notes]
        if fill_s is not None:
            motion, filled = motion.filled(fill_s)
            notes.append(f"Interpolated linearly: {counted(filled, 'missing value')}.")
        if rate_hz is not None:
            motion = motion.resampled(rate_hz)
            notes.append(f"Interpolated linearly to {rate_hz:g} Hz: {counted(len(motion.times_s), 'frame')}.")
        target_up = usual_up(target) if up is None else up.value
        notes += write_motion(target, motion, target_up, names=None if names is None else names.value)
    summary = {
        "source": str(source),
        "target": str(target),
        "frames": len(read.times_s),
        "first_s": float(read.times_s[0]),
        "last_s": float(read.times_s[-1]),
        "points": list(read.names),
        "missing": float(np.isnan(read.points[..., 0]).mean()) if read.names else 0.0,
        "angles": list(read.angles),
        "events": len(read.events),
        "up": target_up,
        "notes": notes,
    }
    _tell(summary, target, delivery)
    return Exit.DONE


# Data in the picture rather than in the world: boxes and keypoints.

_IN_PICTURE = (".txt", ".json", "")


def _convert_picture(
    source: Path,
    target: Path,
    up: Axis | None,
    fps: float | None,
    image_size: str | None,
    asked: dict[str, Any],
    delivery: Delivery,
) -> Exit:
    """Writes boxes of a track (.txt), or keypoints: COCO results (.json), an OpenPose folder (no ending)."""
    kind = {".txt": "MOTChallenge rows", ".json": "COCO results", "": "OpenPose keypoints"}[
        target.suffix.lower()
    ]
    unused = [name for name, value in asked.items() if value is not None]
    unused += ["--up"] * (up is not None and target.suffix.lower() != ".txt")
    unused += ["--image-size"] * (image_size is not None and target.suffix.lower() == ".txt")
    if unused:
        raise InputError(f"{', '.join(unused)}: has no meaning for {kind}")
    if not source.exists():
        raise InputError(nothing_at(source, "file or folder"))
    check_writable(target.parent)
    check_apart([source], [target])
    if target.suffix.lower() == ".txt":
        from memo.formats.motchallenge import write_motchallenge

        try:
            rows = write_motchallenge(target, source, up="z" if up is None else up.value)
        except UnicodeDecodeError:
            raise InputError(f"{source}: not a track of `memo track` (not text in UTF-8)") from None
        summary: dict[str, Any] = {"rows": rows, "notes": []}
        told = f"{counted(summary['rows'], 'row')} of the track"
    else:
        from memo.cli.keypoint_options import keypoints_of, size_of
        from memo.keypoints.writing import write_keypoints

        keypoints = keypoints_of(source, {"fps": fps, "image_size": size_of(image_size)})
        left_out = write_keypoints(target, keypoints, "coco" if target.suffix else "openpose")
        notes = [f"Left out, the format cannot store them: {', '.join(left_out)}."] if left_out else []
        if len(keypoints.everyone) > 1:
            others = counted(len(keypoints.everyone) - 1, "other person is", "other people are")
            notes.append(f"Only the most prominent person was written: {others} in {source}.")
        summary = {"frames": len(keypoints.frames), "points": list(keypoints.names), "notes": notes}
        told = f"{counted(len(keypoints.frames), 'frame')}, {counted(len(keypoints.names), 'point')}"
    summary = {"source": str(source), "target": str(target), **summary}
    if delivery.as_json:
        print(json.dumps(plain({**summary, "files": [str(target)]})))
    elif delivery.talks:
        print(f"Read {told}.", *summary["notes"], f"Written to {target}: {kind}.", sep="\n")
    return Exit.DONE


def _tell(summary: dict[str, Any], target: Path, delivery: Delivery) -> None:
    if delivery.as_json:
        print(json.dumps(plain({**summary, "files": [str(target)]})))
    elif delivery.talks:
        span = f"{summary['first_s']:.2f} to {summary['last_s']:.2f} s"
        held = [counted(summary["frames"], "frame"), counted(len(summary["points"]), "point")]
        held += [counted(len(summary["angles"]), "joint angle")] * bool(summary["angles"])
        held += [counted(summary["events"], "event")] * bool(summary["events"])
        missing = f"; {summary['missing']:.1%} of the points missing" if summary["missing"] else ""
        print(f"Read {', '.join(held)}, {span}{missing}.")
        for note in summary["notes"]:
            print(note)
        print(f"Written to {target}, {summary['up'].upper()} up.")


# Options, checked before any work.


def _checked(value: float | None, option: str) -> float | None:
    if value is not None and not (math.isfinite(value) and value > 0):
        raise InputError(f"{option} {value:g} must be positive and finite")
    return value


def _unit_m(unit: str | None) -> float | None:
    from memo.formats.reading import UNITS_M

    if unit is None:
        return None
    try:
        return UNITS_M[unit.lower()] if unit.lower() in UNITS_M else _checked(float(unit), "--unit")
    except ValueError:
        raise InputError(f"--unit {unit} is neither m, cm, mm nor a number of metres") from None
