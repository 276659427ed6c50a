"""Rows of CSV files: text stays text in a spreadsheet, and memo reads it back unchanged.

Names of markers, people, videos and joints come from files and users. A spreadsheet evaluates a cell that
begins with `=`, `+`, `-`, `@`, a tab or a carriage return as a formula, which may run programs or send data
away (OWASP, "CSV Injection"). `write_rows` puts an apostrophe before such text, also if such text begins a
cell for a program that splits lines at semicolons or tabs. Numbers are not changed, negative ones neither.
`CsvRows` removes the apostrophe again. Every CSV file of memo is read and written here.

Readers that do not know the apostrophe, such as pandas, show it, in such cells only.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator
from typing import Any, TextIO

__all__ = ["CsvRows", "Error", "as_given", "harmless", "write_rows"]

Error = csv.Error

# Where a program may begin a cell; the characters that start a formula there, with the wide characters that
# East Asian editions accept too, and after spaces, which some drop. The text's own apostrophes are skipped.
_BEGIN = r"(?:^|(?<=[;\t\r\n]))"
_FORMULA = r"(?='*(?:[\t\r\n]|[^\S\t\r\n]*[=+\-@\uFF1D\uFF0B\uFF0D\uFF20]))"
_UNMARKED = re.compile(_BEGIN + _FORMULA)
_MARKED = re.compile(_BEGIN + "'" + _FORMULA)
_NUMBER = re.compile(r"\s*[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?\s*", re.ASCII)


def harmless(cell: str) -> str:
    """The cell as written: with an apostrophe where a spreadsheet would begin a formula."""
    return cell if _NUMBER.fullmatch(cell) else _UNMARKED.sub("'", cell)


def as_given(cell: str) -> str:
    """The text of a cell that `harmless` wrote."""
    return _MARKED.sub("", cell)


def write_rows(
    file: TextIO, rows: Iterable[Iterable[Any]], *, delimiter: str = ",", line_end: str = "\n"
) -> None:
    """Writes rows of text and numbers to a file opened with `newline=""`."""
    # Before Python 3.13 `csv` quotes only the line ends that it writes itself.
    line = io.StringIO(newline="")
    table = csv.writer(line, delimiter=delimiter, lineterminator="\r\n")
    for row in rows:
        table.writerow([harmless(cell) if isinstance(cell, str) else cell for cell in row])
        file.write(line.getvalue().removesuffix("\r\n") + line_end)
        line.seek(0)
        line.truncate()


class CsvRows(Iterator[list[str]]):
    """The rows of a CSV file, with the cells given to `write_rows`; `strip` first removes outer spaces."""

    def __init__(
        self, lines: Iterable[str], *, delimiter: str = ",", strict: bool = False, strip: bool = False
    ) -> None:
        self._rows = csv.reader(lines, delimiter=delimiter, strict=strict, skipinitialspace=strip)
        self._strip = strip

    @property
    def line_num(self) -> int:
        """Number of lines read."""
        return self._rows.line_num

    def __next__(self) -> list[str]:
        cells = next(self._rows)
        return [as_given(cell.strip() if self._strip else cell) for cell in cells]
