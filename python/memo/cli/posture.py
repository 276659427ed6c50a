"""`memo posture`: all postures that one view allows, and the most probable motion, from keypoints.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

from collections import Counter
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import memo
from memo.cli.delivery import Delivery, guarded, with_count
from memo.cli.unswap import exchanges, one_of_several
from memo.exits import Exit
from memo.given import InputError, UsageError, check_apart, check_writable, checked_height, given_camera
from memo.posture_files import WRITTEN, write_postures
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo posture walk_json --camera camera.toml --fps 30 --height 1.75
  memo posture joints.csv --camera camera.toml --lengths lengths.csv --rules physical
  memo posture walk_json --image-size 1920x1080 --fps 30 --height 1.75

Exit codes: 0 postures were written; 1 the input cannot be used; 2 wrong usage; \
3 no posture is left in any frame (the tables give the reasons); 4 the app extra is not installed; \
6 postures are left, but every one in the motion breaks a constraint: no possible sequence by these \
rules (all files are written); 130 interrupted (no file is left half written)."""

_DRAWN = "postures.png"
_MOST_BREAKS = 3

_SCALES = {
    "lengths": "the lengths given",
    "height": "the height given",
    "track": "the height of the tracked walk",
    "ground": "the distance from the camera, from the feet on the ground",
    "distance": "the distance given",
    "assumed": "the height of an average adult, assumed",
}
_SOURCES = {
    "given": "as given",
    "track": "from the track",
    "ground": "from the ground",
    "trunk": "from the trunk",
    "extent": "from the whole figure",
    "head": "from the head",
    "combined": "from several sources combined",
    "neighbours": "from neighbouring frames",
}


class Rules(StrEnum):
    """Constraints on a posture beyond those of the body: `memo.postures.RULES`."""

    PHYSICAL = "physical"
    WALKING = "walking"
    WALKING_GENERAL = "walking-general"


class Strength(StrEnum):
    """How strict the limits are: `memo.postures.STRENGTHS`."""

    MEASURED = "measured"
    PAPER = "paper"


class Anchor(StrEnum):
    """Source of the distance: `memo.postures.ANCHORS`."""

    AUTO = "auto"
    GROUND = "ground"
    TRUNK = "trunk"
    EXTENT = "extent"
    HEAD = "head"
    COMBINED = "combined"


def add_posture(app: "typer.Typer") -> None:
    import typer

    from memo.cli.camera_options import CAMERA_HELP, CameraName, CameraSize, CameraUnit, CameraVUp
    from memo.cli.keypoint_options import Fps, ImageSize, KeypointsPath, LayoutName, Person, reading_of

    usual = memo._memo.defaults("posture")
    usual_rules, usual_strength = Rules(usual["rules"]), Strength(usual["strength"])
    usual_anchor = Anchor(usual["anchor"])

    @app.command(epilog=EPILOG)
    def posture(
        keypoints: KeypointsPath,
        camera: Annotated[
            Path | None,
            typer.Option(
                help=f"{CAMERA_HELP} Without it, a level camera is assumed "
                "for pictures of --image-size; see --fov-deg."
            ),
        ] = None,
        camera_name: CameraName = None,
        camera_unit: CameraUnit = None,
        camera_size: CameraSize = None,
        camera_v_up: CameraVUp = None,
        fov_deg: Annotated[
            float | None,
            typer.Option(
                help="Horizontal field of view without --camera, degrees; default: 62 across the longer side."
            ),
        ] = None,
        lengths: Annotated[
            Path | None, typer.Option(help="The 17 segment lengths, metres: CSV, JSON or a postures.json.")
        ] = None,
        height: Annotated[
            float | None, typer.Option(help="Without --lengths: height of the person, metres.")
        ] = None,
        rules: Annotated[Rules, typer.Option(help="Constraints for what the person does.")] = usual_rules,
        strength: Annotated[
            Strength, typer.Option(help="Limits as measured on people, or as printed in the paper.")
        ] = usual_strength,
        anchor: Annotated[Anchor, typer.Option(help="Source of the distance.")] = usual_anchor,
        distance: Annotated[
            float | None, typer.Option(help="Distance of the neck from the camera, metres, if known.")
        ] = None,
        track: Annotated[
            Path | None,
            typer.Option(
                help="Folder of memo track of the same video: its walk gives camera, height and distance."
            ),
        ] = None,
        noise_px: Annotated[
            float, typer.Option(help="Standard deviation of a keypoint, pixels.", min=0)
        ] = usual["noise_px"],
        fps: Fps = None,
        layout: LayoutName = None,
        person: Person = None,
        image_size: ImageSize = None,
        unswap: Annotated[
            bool, typer.Option(help="First exchange right and left where the detector confused them.")
        ] = True,
        frame: Annotated[
            int | None, typer.Option(help="Frame to draw; default: one with a typical number of postures.")
        ] = None,
        keep_all: Annotated[
            bool,
            typer.Option("--keep-all", help="Write every posture of every frame, kept or cut, as arrays."),
        ] = False,
        out: Annotated[
            Path | None, typer.Option(help="Folder for the results; default: memo-out/KEYPOINTS.")
        ] = None,
        plots: Annotated[bool, typer.Option(help="Write postures.png.")] = True,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Finds the 3D postures that KEYPOINTS allow, and the most probable motion.

        The most probable motion may break a constraint at a cost: it can contain postures that were excluded.
        """
        folder = out or Path("memo-out") / keypoints.resolve().stem
        delivery = Delivery(folder, plots=plots, as_json=as_json, quiet=quiet)
        options: dict[str, Any] = {"rules": rules.value, "strength": strength.value, "anchor": anchor.value}
        options |= {"unswap": unswap, "noise_px": noise_px, "keep_all": keep_all}

        def work() -> Exit:
            reading = reading_of(fps, layout, person, image_size)
            scale = _scale(lengths, height) | {"distance_m": _checked_distance(distance)}
            check_apart([keypoints, camera, lengths], [delivery.out / name for name in (*WRITTEN, _DRAWN)])
            view = {"name": camera_name, "unit": camera_unit, "size": camera_size, "v_up": camera_v_up}
            seen_by = {"track": track} if track is not None else {}
            if track is not None and (camera is not None or fov_deg is not None or distance is not None):
                raise UsageError(
                    "--track has a camera and distances: leave --camera, --fov-deg, --distance out"
                )
            seen_by |= given_camera(camera, view, fov_deg)
            return _posture(keypoints, reading, seen_by | scale | options, frame, delivery)

        raise typer.Exit(guarded(work))


def _posture(
    path: Path,
    reading: dict[str, Any],
    options: dict[str, Any],
    frame: int | None,
    delivery: Delivery,
) -> Exit:
    from memo.cli.keypoint_options import keypoints_of

    check_writable(delivery.out)
    with with_count("finding postures", delivery) as progress:
        keypoints = keypoints_of(path, reading)
        row = None if frame is None else _row(keypoints, frame)
        if not {"camera", "track"} & options.keys() and keypoints.image_size is None:
            if (path / "run.json").is_file():
                raise InputError(f"--camera is needed, or --track {path} to take the camera from this track")
            raise InputError("--camera is needed, or the size of the picture to assume one: --image-size")
        postures = memo.posture(keypoints, **options, progress=progress)
        (delivery.out / _DRAWN).unlink(
            missing_ok=True
        )  # from an earlier run: it does not match the new tables
        written = write_postures(postures, delivery.out)
        if delivery.plots and postures.found.any():
            from memo.posture_plot import write_posture_plot

            written.append(write_posture_plot(postures, delivery.out / _DRAWN, row))
    first, *others = _lines(postures)
    lines = [first + one_of_several(keypoints, reading["person"] is None), *others]
    alarm = None if postures.is_possible else _impossible(postures)
    delivery.tell(postures.summary, lines, written, alarm=alarm)
    if not (postures.survivors > 0).any():
        return Exit.NOBODY
    return Exit.DONE if postures.is_possible else Exit.IMPOSSIBLE


# Options, checked before any work.


def _scale(lengths: Path | None, height_m: float | None) -> dict[str, Any]:
    if lengths is not None and height_m is not None:
        raise UsageError("--lengths already hold the height: leave --height out")
    if lengths is not None:
        return {"lengths": memo.read_lengths(lengths)}
    return {} if height_m is None else {"height_m": checked_height(height_m)}


def _checked_distance(distance_m: float | None) -> float | None:
    if distance_m is not None and not 0.1 <= distance_m <= 1000:
        raise InputError(f"--distance {distance_m:g} is not a distance in metres (0.1 to 1000)")
    return distance_m


def _row(keypoints: memo.Keypoints, frame: int) -> int:
    first, last = int(keypoints.frames[0]), int(keypoints.frames[-1])
    if not first <= frame <= last:
        raise InputError(f"--frame {frame} is not among the frames {first} to {last}")
    return frame - first


# What is printed.


def _impossible(postures: memo.Postures) -> str | None:
    """States that the motion is impossible, and what it breaks most; None if there is no motion."""
    most = _most_broken(postures)
    if not most:
        return None
    frames = counted(postures.found.sum(), "frame")
    return (
        f"No possible sequence (--rules {postures.rules}): in every frame of the motion, {frames}, the "
        f"posture breaks a constraint; most often {most}."
    )


def _most_broken(postures: memo.Postures) -> str:
    """The constraints that the motion breaks most often, with the numbers of frames; empty if none."""
    breaks = Counter(name for names in postures.linked_breaks for name in names)
    often = ((name.replace("_", " "), count) for name, count in breaks.most_common(_MOST_BREAKS))
    return ", ".join(f"{name} in {count}" for name, count in often)


def _lines(postures: memo.Postures) -> list[str]:
    """At most five lines; the alarm is printed before them and the files after them."""
    lines = [_frames_line(postures), *_reason_line(postures), _scale_line(postures), _second_line(postures)]
    return lines + [f"Check before use: {'; '.join(postures.warnings)}"] * bool(postures.warnings)


def _frames_line(postures: memo.Postures) -> str:
    left = postures.survivors > 0
    line = f"{counted(len(postures.frames), 'frame')}, of which {left.sum()} have possible postures"
    if left.any():
        counts = [
            (len(sizes), True) if count is None else (count, False)
            for count, sizes in zip(postures.group_counts, postures.group_sizes, strict=True)
        ]
        middle, is_more = sorted(counts[row] for row in np.flatnonzero(left))[left.sum() // 2]
        groups = counted(middle, "group") + " or more" * is_more
        line += f", {np.median(postures.survivors[left]):.0f} each in {groups} (medians)"
    line += _why_none(postures)
    breaking = sum(map(bool, postures.linked_breaks))
    if breaking:
        line += f"; in {counted(breaking, 'frame')} the chosen posture breaks a constraint"
        line += f" ({_most_broken(postures)})"
    repair = postures.repair
    if repair is not None and any((*repair.exchanged.values(), *repair.guessed.values())):
        line += f"; right and left were exchanged: {exchanges(repair)}"
    return f"{line}."


def _why_none(postures: memo.Postures) -> str:
    """For frames without a posture: what excludes the first, if it is the only reason."""
    if (postures.survivors > 0).any():
        return ""
    why = next((why for why in postures.cut_all if why), None)
    if why is not None:
        return f": in the first, the nearest posture breaks {', '.join(why)}"
    problem = next((problem for problem in postures.problems if problem), None)
    return "" if problem is None else f": in the first, {problem}"


def _reason_line(postures: memo.Postures) -> list[str]:
    most = max(postures.reason_totals, key=lambda total: total.branches, default=None)
    if most is None:
        return []
    name, sentence = most.constraint.replace("_", " "), most.sentence.rstrip(".")
    cut = f"{counted(most.branches, 'branch', 'branches')} in {counted(most.frames, 'frame')}"
    return [f"Most branches are cut by {name}: {cut} ({sentence})."]


def _scale_line(postures: memo.Postures) -> str:
    known = np.isfinite(postures.anchor_m)
    line = f"Sizes are based on {_SCALES.get(postures.scale_from, postures.scale_from)}"
    if known.any():
        sources = [source for source, there in zip(postures.anchor_source, known, strict=True) if there]
        usual = max(dict.fromkeys(sources), key=sources.count)
        distance_m, sd_m = np.median(postures.anchor_m[known]), np.median(postures.anchor_sd_m[known])
        sd = f"standard deviation {sd_m:.2f} m"
        line += f"; the neck is {distance_m:.2f} m away ({sd}), {_SOURCES.get(usual, usual)}"
    if postures.camera_assumed:
        line += "; no --camera, so a level one is assumed: if it was tilted, so are the postures"
    return f"{line}."


def _second_line(postures: memo.Postures) -> str:
    second = postures.second
    if not postures.limbs_known:
        return "No elbow, wrist, knee or ankle is known: the limbs are undetermined."
    if second is None:
        return "No other motion is possible: the depth directions of the limbs are determined."
    joints = " and ".join(joint.replace("_", " ") for joint in second.joints)
    undecided = f"{postures.undecided.sum()} of {counted(len(postures.frames), 'frame')}"
    where = f"frames {second.first_frame} to {second.last_frame}"
    if second.first_frame == second.last_frame:
        where = f"frame {second.first_frame}"
    return (
        f"Least certain depth: {joints} in {where}, mirrored with a probability of {second.p:.0%}."
        f" At this noise at least one joint is undecided in {undecided}."
    )
