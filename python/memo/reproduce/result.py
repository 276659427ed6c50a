"""The result of a reproduction: rows of printed and own values with verdicts, figures, tables, files."""

from __future__ import annotations

import contextlib
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from memo.files import read_text_columns, write_table
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = [
    "EQUAL",
    "Drawing",
    "Progress",
    "Reproduction",
    "Row",
    "Table",
    "Verdict",
    "cannot",
    "compared",
    "in_kind",
    "unseen",
    "write_index",
]

Progress = Callable[[str, int, int | None], object]
"""Called with the progress of a reproduction: the step, the amount done and the total (None: unknown)."""


def unseen(step: str, done: int, total: int | None) -> None:
    """The progress for callers that want none."""


EQUAL = "equal (0)"
"""The printed value for the difference of an equation's two sides."""

ROW_COLUMNS = ("item", "quantity", "printed", "ours", "verdict", "why")
"""Columns of `reproduction.csv`, in order."""


class Verdict(StrEnum):
    """The result of comparing a printed value."""

    SAME = "same"
    """Computed again from what the paper gives, and equal to the printed digits or within a stated bound."""
    DIFFERS = "differs"
    """Computed again from what the paper gives, and not equal; the row gives the reason."""
    IN_KIND = "in kind"
    """Made from other input, because the paper's is not published. Not the paper's number."""
    CANNOT = "cannot"
    """Not made; the row gives the reason."""


@dataclass(frozen=True)
class Row:
    """One printed value beside memo's value for it."""

    item: str
    """Place in the paper: "Table 3, left ankle", "Fig. 19", "section 6"."""
    quantity: str
    printed: str
    ours: str
    verdict: Verdict
    why: str
    """How it was computed and compared, or why it was not."""

    def __post_init__(self) -> None:
        empty = [name for name in ROW_COLUMNS if not getattr(self, name).strip()]
        if empty:
            raise ValueError(f"{self.item}, {self.quantity}: nothing in {', '.join(empty)}")


@dataclass(frozen=True)
class Drawing:
    """A figure: drawn into a matplotlib Figure when it is written."""

    name: str
    """Name of the file without its ending: "fig19"."""
    item: str
    caption: str
    draw: Callable[[Figure], object] = field(repr=False)
    size_in: tuple[float, float] = (6.4, 4.8)
    why: str = ""
    """The data it is made from."""
    verdict: Verdict = Verdict.IN_KIND

    @property
    def row(self) -> Row:
        """The figure as a row."""
        return Row(self.item, self.caption, "figure", f"{self.name}.png", self.verdict, self.why)

    def write(self, folder: Path) -> Path:
        """Draws into `folder`; returns the file's path."""
        figure = Figure(figsize=self.size_in, dpi=120, layout="constrained")
        FigureCanvasAgg(figure)
        self.draw(figure)
        path = folder / f"{self.name}.png"
        with complete_file(path) as temporary:
            figure.savefig(temporary, format="png")
        return path


@dataclass(frozen=True)
class Table:
    """A table with more details than the rows."""

    name: str
    header: Sequence[str]
    rows: Sequence[Sequence[Any]] = field(repr=False)

    def write(self, folder: Path) -> Path:
        """Writes `folder`/name.csv; returns its path."""
        path = folder / f"{self.name}.csv"
        write_table(path, self.header, self.rows)
        return path


@dataclass(frozen=True)
class Reproduction:
    """A paper: every table, figure and number of it that could be checked, and those that cannot."""

    name: str
    """Its name on the command line."""
    title: str
    """Authors, year, title."""
    note: str
    """In a few sentences, what was made and from which input."""
    numbers: Sequence[Row] = field(repr=False)
    figures: Sequence[Drawing] = field(repr=False)
    tables: Sequence[Table] = field(default=(), repr=False)

    @property
    def rows(self) -> list[Row]:
        """The numbers and then the figures, one row each."""
        return [*self.numbers, *(figure.row for figure in self.figures)]

    @property
    def counts(self) -> dict[str, int]:
        """Number of rows with each verdict."""
        found = Counter(row.verdict for row in self.rows)
        return {verdict.value: found[verdict] for verdict in Verdict}

    def write(self, folder: str | PathLike[str], progress: Progress = unseen) -> list[Path]:
        """Writes reproduction.md, reproduction.csv, the tables and the figures; returns their paths."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self._remove_others(folder)
        written = [folder / "reproduction.md", folder / "reproduction.csv"]
        for done, drawing in enumerate(self.figures):
            progress(f"{self.name}: drawing {drawing.item}", done, len(self.figures))
            written.append(drawing.write(folder))
        written += [table.write(folder) for table in self.tables]
        write_table(
            written[1], ROW_COLUMNS, ([getattr(row, name) for name in ROW_COLUMNS] for row in self.rows)
        )
        with complete_file(written[0]) as temporary:
            temporary.write_text(self.markdown(), encoding="utf-8")
        return written

    def _remove_others(self, folder: Path) -> None:
        """Figures of an earlier run that this run does not draw: they would not match the new rows."""
        with contextlib.suppress(OSError, ValueError):
            columns = read_text_columns(folder / "reproduction.csv", ("printed", "ours"))
            rows = zip(*columns.values(), strict=True)
            earlier = {ours for printed, ours in rows if printed == "figure"}
            for name in earlier - {f"{drawing.name}.png" for drawing in self.figures}:
                if Path(name).name == name:
                    (folder / name).unlink(missing_ok=True)

    def markdown(self) -> str:
        """The rows as a table and the figures with their captions."""
        counts = ", ".join(f"{count} {verdict}" for verdict, count in self.counts.items())
        lines = [f"# {self.title}", "", self.note, "", f"{counted(len(self.rows), 'row')}: {counts}.", ""]
        lines += [f"| {' | '.join(ROW_COLUMNS)} |", "|---|---|---|---|---|---|"]
        for row in self.rows:
            cells = (getattr(row, name).replace("|", "\\|").replace("\n", " ") for name in ROW_COLUMNS)
            lines.append(f"| {' | '.join(cells)} |")
        for drawing in self.figures:
            lines += ["", f"## {drawing.item}", "", f"{drawing.caption}. {drawing.why}", ""]
            lines.append(f"![{drawing.item}]({drawing.name}.png)")
        return "\n".join([*lines, ""])


def write_index(folder: Path, reproductions: Sequence[Reproduction]) -> Path:
    """Writes `folder`/reproduction.md, with each paper's counts of verdicts and links to its folder."""
    lines = ["# Papers reproduced", "", f"| paper | {' | '.join(Verdict)} |", "|---|" + "---|" * len(Verdict)]
    for made in reproductions:
        counts = " | ".join(str(count) for count in made.counts.values())
        lines.append(f"| [{made.title}]({made.name}/reproduction.md) | {counts} |")
    path = folder / "reproduction.md"
    with complete_file(path) as temporary:
        temporary.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return path


_NUMBER = re.compile(r"[-+]?\d+(?:\.(\d+))?")


def compared(
    item: str, quantity: str, printed: str, ours: npt.ArrayLike, why: str = "", *, within: float | None = None
) -> Row:
    """A row whose verdict follows from the numbers: same if each differs from the printed one by at most
    half a unit of its last digit, or by at most `within`.

    `printed` holds as many numbers as `ours`, and may hold words between. A row that differs needs a `why`.
    """
    found = list(_NUMBER.finditer(printed))
    values = np.atleast_1d(np.asarray(ours, dtype=float)).ravel()
    if len(found) != len(values):
        raise ValueError(
            f"{item}, {quantity}: {counted(len(found), 'number')} printed, {len(values)} of ours"
        )
    digits = [len(number.group(1) or "") for number in found]
    allowed = [0.5 * 10.0**-d if within is None else within for d in digits]
    wanted = [float(number.group()) for number in found]
    is_same = all(
        abs(a - b) <= tolerance * (1 + 1e-6) for a, b, tolerance in zip(values, wanted, allowed, strict=True)
    )
    if within is not None and within < 1e-4 and not any(digits):
        text = " ".join(f"{value:.1e}" for value in values)
    else:
        text = " ".join(_digits(value, d) for value, d in zip(values, digits, strict=True))
    how = "equal to the digits printed" if within is None else f"within {within:g}"
    said = f"{how}; {why}" if is_same and why else how if is_same else why
    return Row(item, quantity, printed, text, Verdict.SAME if is_same else Verdict.DIFFERS, said)


def _digits(value: float, digits: int) -> str:
    """A value with one more digit than printed, or as a whole number if it is one."""
    if digits == 0 and float(value).is_integer():
        return f"{value:.0f}"
    return f"{value:z.{digits + 1}f}"


def in_kind(item: str, quantity: str, printed: str, ours: str, why: str) -> Row:
    """A row made from other input than the paper's."""
    return Row(item, quantity, printed, ours, Verdict.IN_KIND, why)


def cannot(item: str, quantity: str, printed: str, why: str) -> Row:
    """A row that was not made."""
    return Row(item, quantity, printed, "not made", Verdict.CANNOT, why)
