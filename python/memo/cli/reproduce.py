"""`memo reproduce`: a paper's tables and figures again.

(Typer reads annotations where they stand, hence no `from __future__ import annotations` here.)
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from memo.cli.delivery import Exit, guarded
from memo.cli.given import check_writable

if TYPE_CHECKING:
    import typer


class Experiment(StrEnum):
    """What can be reproduced: the names of `memo.reproduce.EXPERIMENTS`."""

    LEE_CHEN = "lee-chen"


def add_reproduce(app: "typer.Typer") -> None:
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
        raise typer.Exit(guarded(lambda: _reproduce(experiment, folder)))


def _reproduce(experiment: Experiment, out: Path) -> Exit:
    from memo.reproduce import EXPERIMENTS

    check_writable(out)
    reproduction = EXPERIMENTS[experiment.value](out)
    print("\n".join(reproduction.lines))
    print(f"Written to {out}: {', '.join(path.name for path in reproduction.written)}.")
    return Exit.DONE
