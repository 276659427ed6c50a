"""`memo unswap`: corrects exchanged right and left labels in keypoints.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import memo
from memo.cli.delivery import Delivery, guarded, with_elapsed
from memo.exits import Exit
from memo.files import write_flips_csv
from memo.given import InputError, check_apart, check_writable
from memo.keypoints import Someone, write_keypoints
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo unswap walk_json --fps 30
  memo unswap walk.json --fps 30 --format csv --out sides

Exit codes: 0 the keypoints were written; 1 the input cannot be used; 2 wrong usage; \
4 the app extra is not installed; 130 interrupted (nothing is written)."""


class Written(StrEnum):
    """Format of the keypoints written: that of the file read, or one of `memo.keypoints.WRITERS`."""

    SAME = "same"
    OPENPOSE = "openpose"
    COCO = "coco"
    CSV = "csv"


_MOST_SHOWN = 4
_ENDS = {Written.OPENPOSE: "_json", Written.COCO: ".json", Written.CSV: ".csv"}


def add_unswap(app: "typer.Typer") -> None:
    import typer

    from memo.cli.keypoint_options import Fps, ImageSize, KeypointsPath, LayoutName, Person, reading_of

    @app.command(epilog=EPILOG)
    def unswap(
        keypoints: KeypointsPath,
        fps: Fps = None,
        layout: LayoutName = None,
        person: Person = None,
        image_size: ImageSize = None,
        written: Annotated[
            Written,
            typer.Option(
                "--format",
                help="Write the file unchanged except for the exchanges (same), or only this person as "
                "OpenPose (BODY_25, a folder), COCO results (17 points) or a table.",
            ),
        ] = Written.SAME,
        out: Annotated[
            Path | None, typer.Option(help="Folder for the results; default: memo-out/KEYPOINTS.")
        ] = None,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Exchanges right and left in KEYPOINTS where a detector confused them for a time.

        Labels that are exchanged in all frames, or in most, cannot be detected.
        """
        delivery = Delivery(out or Path("memo-out") / keypoints.resolve().stem, as_json=as_json, quiet=quiet)

        def work() -> Exit:
            return _unswap(keypoints, reading_of(fps, layout, person, image_size), written, delivery)

        raise typer.Exit(guarded(work))


def _unswap(path: Path, reading: dict[str, Any], as_format: Written, delivery: Delivery) -> Exit:
    from memo.cli.keypoint_options import keypoints_of

    check_writable(delivery.out)
    with with_elapsed("looking at right and left", delivery):
        keypoints = keypoints_of(path, reading)
        repair = memo.unswap(keypoints)
        source = repair.keypoints.source.path.resolve()
        stem = source.stem.removesuffix("_json")
        name = source.name if as_format is Written.SAME else stem + _ENDS[as_format]
        written = [delivery.out / name, delivery.out / "flips.csv"]
        check_apart([path, source], written)
        if written[0].name == written[1].name:
            raise InputError(f"{path}: has the name of the table of changes; rename it")
        if as_format is Written.SAME and repair.keypoints.source.write_like is None:
            raise InputError(
                f"{path}: cannot be written in its own format; give --format openpose, coco or csv"
            )
        left_out: tuple[str, ...] = ()
        if as_format is Written.SAME:
            repair.keypoints.write(written[0])
        else:
            left_out = write_keypoints(written[0], repair.keypoints, as_format.value)
        write_flips_csv(written[1], repair.flips)
    frames = len(repair.keypoints.frames)
    summary = {
        "frames": frames,
        "exchanged": repair.exchanged,
        "guessed": repair.guessed,
        "undecided": repair.undecided,
        "p_global": repair.p_global,
        "left_out": left_out,
        "doubts": keypoints.doubts,
    }
    lines = [f"Exchanged right and left: {exchanges(repair)}. {_majority()}."]
    lines[0] += one_of_several(keypoints, reading["person"] is None)
    lines += [f"Warning: {doubt}." for doubt in keypoints.doubts]
    if left_out:
        lines.append(f"{as_format.value} cannot store {', '.join(left_out)}.")
    delivery.tell(summary, lines, written)
    return Exit.DONE


def one_of_several(keypoints: memo.Keypoints, is_open: bool) -> str:
    """A sentence to append on who is in the file, if it was open which of several people is meant."""
    everyone = keypoints.everyone
    if not is_open or len(everyone) < 2:
        return ""
    shown = [_shown(someone) for someone in everyone[:_MOST_SHOWN]]
    if len(everyone) > _MOST_SHOWN:
        shown.append(counted(len(everyone) - _MOST_SHOWN, "other"))
    return (
        f" {counted(len(everyone), 'person', 'people')} in the file: {'; '.join(shown)}. "
        "The most prominent one was taken; "
        "--person selects another."
    )


def _shown(someone: Someone) -> str:
    frames = f"frames {someone.first_frame} to {someone.last_frame}"
    return f"{someone.name} ({counted(someone.frames, 'frame')} of {frames}, {someone.size_px:.0f} px)"


def exchanges(repair: memo.SideRepair) -> str:
    """Describes in how many frames the sides were exchanged, in how many of these only by the best guess,
    and in how many they are undecided."""
    total = {group: frames + repair.guessed[group] for group, frames in repair.exchanged.items()}
    done = f"{_by_group(total)} of {counted(len(repair.keypoints.frames), 'frame')}"
    doubt = _by_group({group: frames for group, frames in repair.undecided.items() if frames})
    guessed = _by_group({group: frames for group, frames in repair.guessed.items() if frames})
    guess = f"of these only by the best guess: {guessed}; " if guessed else ""
    return f"{done} ({guess}{f'undecided: {doubt}' if doubt else 'none undecided'})"


def _by_group(frames: dict[str, int]) -> str:
    return " and ".join(f"{group} in {count}" for group, count in frames.items())


def _majority() -> str:
    """What the repair assumes."""
    return "This assumes that most frames are labelled correctly, which cannot be checked"
