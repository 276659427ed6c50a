"""`memo report`: writes the results of a run as one HTML file.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from memo.cli.delivery import Delivery, guarded, with_steps
from memo.exits import Exit
from memo.given import InputError, frame_range, nothing_at
from memo.wording import counted

if TYPE_CHECKING:
    import typer

    from memo.report import Report

EPILOG = """Examples:
  memo report memo-out/walk --open
  memo report memo-out/walk --frames 45:146 --every 2
  memo report memo-out/before memo-out/after
  memo report memo-out/walk --walks 0,1

Exit codes: 0 the page was written; 1 the folder cannot be used; 2 wrong usage; \
4 the app extra is not installed; 130 interrupted (an older page stays unchanged)."""


def add_report(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EPILOG)
    def report(
        folder: Annotated[
            Path,
            typer.Argument(
                metavar="DIR", help="Folder of results of memo track, memo posture or memo planar."
            ),
        ],
        other: Annotated[
            Path | None,
            typer.Argument(metavar="OTHER", help="Another folder of memo track: compare a walk of each."),
        ] = None,
        frames: Annotated[str, typer.Option(help="Frames A up to, not including, B.", metavar="A:B")] = ":",
        every: Annotated[
            int | None, typer.Option(help="Every N-th frame; default: as many as fit in about 25 MB.", min=1)
        ] = None,
        why: Annotated[bool, typer.Option(help="Show what the model was matched to in each frame.")] = True,
        video: Annotated[Path | None, typer.Option(help="The video, if it was moved.")] = None,
        walks: Annotated[
            str | None,
            typer.Option(help="Compare walk A of DIR and B of OTHER (or of DIR), from 0.", metavar="A,B"),
        ] = None,
        out: Annotated[
            Path | None,
            typer.Option(help="The file to write; default: DIR/report.html or DIR/comparison.html."),
        ] = None,
        open_: Annotated[bool, typer.Option("--open", help="Open the page in the browser.")] = False,
        as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Makes one HTML file of the results in DIR, readable without memo or a network."""

        def work() -> Exit:
            is_comparison = other is not None or walks is not None
            default = folder / ("comparison.html" if is_comparison else "report.html")
            path = default if out is None else _checked_file(out)
            delivery = Delivery(path.parent, as_json=as_json, quiet=quiet)
            if is_comparison:
                if frames != ":" or every is not None or not why or video is not None:
                    raise InputError("--frames, --every, --no-why and --video have no effect on a comparison")
                report = compared(folder, other or folder, path, walks)
            else:
                if video is not None and not video.exists():
                    raise InputError(nothing_at(video, "video"))
                options = {"frames": frame_range(frames), "every": every, "why": why, "video": video}
                report = write_page(folder, path, delivery, **options)
            told = {"kind": report.kind, "bytes": report.bytes, **report.contents}
            delivery.tell(told, _lines(report), [report.path])
            if open_:
                webbrowser.open(report.path.resolve().as_uri())
            return Exit.DONE

        raise typer.Exit(guarded(work))


def compared(folder: Path, other: Path, path: Path, walks: str | None) -> "Report":
    """Writes the comparison of a walk of each folder."""
    from memo.report import write_comparison

    return write_comparison(folder, other, path, walks=_walks(walks))


def write_page(folder: Path, path: Path, delivery: Delivery, **options: Any) -> "Report":
    """Writes the page of a folder, with progress."""
    from memo.report import write_report

    with with_steps(delivery) as progress:
        return write_report(folder, path, progress=progress, **options)


def _lines(report: "Report") -> list[str]:
    """Describes the page in sentences."""
    contents = report.contents
    if "walks" in contents:
        return [contents["compared"], *contents["sentences"], *contents["notes"]]
    if report.kind == "memo track":
        evidence = f"{contents['explained']} of them with their evidence"
        line = f"{counted(contents['pictures'], 'frame')} shown, {evidence}"
    else:
        line = counted(contents["frames"], "frame")
    return [f"{line}; {report.bytes / 1e6:.1f} MB.", *contents["notes"]]


def _walks(given: str | None) -> tuple[int | None, int | None]:
    """The numbers of two walks, as in 0,1; None where not given."""
    if given is None:
        return None, None
    parts = given.split(",")
    if len(parts) != 2 or not all(part.isascii() and part.isdigit() for part in parts):
        raise InputError(f"--walks must be two numbers of walks, such as 0,1, got {given!r}")
    return int(parts[0]), int(parts[1])


def _checked_file(path: Path) -> Path:
    if path.is_dir():
        raise InputError(f"{path}: is a folder; --out names the file to write")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
    if path.is_file():
        with path.open("rb") as file:
            is_page = file.read(15).lower() == b"<!doctype html>"
        if not is_page:
            raise InputError(f"{path}: exists and is no HTML page; give another name")
    return path
