"""`memo reproduce`: the numbers that the papers print, beside those of memo.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from memo.cli.delivery import Delivery, complain, guarded, with_steps
from memo.exits import Exit
from memo.given import InputError, check_apart, check_writable, checked_height, load_camera
from memo.wording import counted

if TYPE_CHECKING:
    import typer

    from memo.reproduce import Clip, Reproduction


class Paper(StrEnum):
    """What can be reproduced: the names of `memo.reproduce.EXPERIMENTS`, and all of them."""

    ALL = "all"
    ROHR = "rohr"
    LEE_CHEN = "lee-chen"
    HOFFMAN_FLINCHBAUGH = "hoffman-flinchbaugh"


EPILOG = """Examples:
  memo reproduce
  memo reproduce lee-chen --out tables
  memo reproduce rohr --video walk.mp4 --height 1.68

Exit codes: 0 done, even if results differ; 1 the input cannot be used; 2 wrong usage; \
3 nobody was tracked in --video; 4 the app extra is not installed; 130 interrupted."""

HELP = "rohr: tracking (1994); lee-chen: postures (1985); hoffman-flinchbaugh: biological motion (1982)."


def add_reproduce(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EPILOG)
    def reproduce(
        paper: Annotated[Paper, typer.Argument(metavar="PAPER", help=HELP)] = Paper.ALL,
        out: Annotated[
            Path | None,
            typer.Option(help="Folder for rows and figures; default: memo-out/reproduce, or PAPER in it."),
        ] = None,
        video: Annotated[
            Path | None,
            typer.Option(help="rohr: make figures of a real sequence from this video of one walker."),
        ] = None,
        height: Annotated[float | None, typer.Option(help="Height of the walker in --video, metres.")] = None,
        camera: Annotated[
            Path | None, typer.Option(help="Calibration of --video, as for memo track.")
        ] = None,
        camera_name: Annotated[str | None, typer.Option(help="Which camera of a file with several.")] = None,
        fps: Annotated[
            float | None, typer.Option(help="True frame rate of --video, for slow motion.")
        ] = None,
        as_json: Annotated[bool, typer.Option("--json", help="Print the rows as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Computes the tables, figures and numbers of the papers again, beside the printed ones.

        Each row is "same", "differs" (with the reason), "in kind" (computed from other input than the
        paper's) or "cannot" (it cannot be computed).
        """
        folder = out or (Path("memo-out/reproduce") / ("" if paper is Paper.ALL else paper.value))

        def work() -> Exit:
            clip = _clip(paper, video, height, camera, camera_name, fps)
            return _reproduce(paper, clip, Delivery(folder, as_json=as_json, quiet=quiet))

        raise typer.Exit(guarded(work))


def _clip(
    paper: Paper,
    video: Path | None,
    height: float | None,
    camera: Path | None,
    camera_name: str | None,
    fps: float | None,
) -> "Clip | None":
    given = {
        "--video": video,
        "--height": height,
        "--camera": camera,
        "--camera-name": camera_name,
        "--fps": fps,
    }
    named = [name for name, value in given.items() if value is not None]
    if named and paper not in (Paper.ROHR, Paper.ALL):
        raise InputError(f"{named[0]} is for rohr; {paper.value} has no image sequence")
    if video is None:
        if named:
            raise InputError(f"{named[0]} needs --video")
        return None
    if camera is None and camera_name is not None:
        raise InputError("--camera-name needs --camera")
    from memo.reproduce import Clip

    height_m = checked_height(1.75 if height is None else height)
    return Clip(video, height_m, None if camera is None else load_camera(camera, camera_name), fps)


def _reproduce(paper: Paper, clip: "Clip | None", delivery: Delivery) -> Exit:
    from memo.reproduce import EXPERIMENTS, NobodyTracked
    from memo.reproduce.result import write_index

    names = list(EXPERIMENTS) if paper is Paper.ALL else [paper.value]
    check_writable(delivery.out)
    if clip is not None:
        check_apart([Path(clip.video)], [delivery.out / "reproduction.md"])
    made: list[Reproduction] = []
    written: list[Path] = []
    try:
        with with_steps(delivery) as progress:
            for name in names:
                options: dict[str, Any] = {"clip": clip} if name == "rohr" else {}
                made.append(EXPERIMENTS[name](progress=progress, **options))
            for reproduction in made:
                folder = delivery.out / (reproduction.name if paper is Paper.ALL else "")
                written += reproduction.write(folder, progress)
            if paper is Paper.ALL:
                written.append(write_index(delivery.out, made))
    except NobodyTracked as error:
        complain(str(error))
        return Exit.NOBODY
    if delivery.as_json:
        delivery.tell({"papers": [_summary(reproduction) for reproduction in made]}, [], written)
    elif delivery.talks:
        for reproduction in made:
            _print(reproduction)
        figures = sum(path.suffix == ".png" for path in written)
        files = f"reproduction.md and .csv, {counted(figures, 'figure')} and the tables"
        if paper is Paper.ALL:
            files = f"reproduction.md; in {', '.join(names[:-1])} and {names[-1]}: {files}"
        print(f"Written to {delivery.out}: {files}.")
    return Exit.DONE


def _print(reproduction: "Reproduction") -> None:
    """Prints the rows as a table as wide as the terminal, and the number of rows per verdict."""
    from rich.console import Console
    from rich.table import Table

    console = Console(soft_wrap=False)
    if not console.is_terminal:
        console.width = 200
    table = Table(title=reproduction.title, title_justify="left", expand=True)
    for name, ratio in (("item", 3), ("quantity", 5), ("printed", 3), ("ours", 3)):
        table.add_column(name, ratio=ratio, overflow="fold")
    table.add_column("verdict", no_wrap=True)
    table.add_column("why", ratio=6, overflow="fold")
    colours = {"same": "green", "differs": "red", "in kind": "yellow", "cannot": "dim"}
    for row in reproduction.rows:
        cells = (row.item, row.quantity, row.printed, row.ours, row.verdict.value, row.why)
        table.add_row(*(_plain(cell) for cell in cells), style=colours[row.verdict.value])
    console.print(table)
    counts = ", ".join(f"{count} {verdict}" for verdict, count in reproduction.counts.items())
    console.print(f"{reproduction.name}: {counts}.", highlight=False)


def _plain(text: str) -> str:
    """Text that rich does not read as markup."""
    from rich.markup import escape

    return escape(text)


def _summary(reproduction: "Reproduction") -> dict[str, Any]:
    return {
        "name": reproduction.name,
        "title": reproduction.title,
        "counts": reproduction.counts,
        "rows": [
            {
                **{name: getattr(row, name) for name in ("item", "quantity", "printed", "ours", "why")},
                "verdict": row.verdict.value,
            }
            for row in reproduction.rows
        ],
    }
