"""Tables: reads tables of numbers from CSV, finds units of columns, converts results for pandas."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo.files import read_text
from memo.spreadsheet import CsvRows, Error
from memo.wording import counted

if TYPE_CHECKING:
    import pandas

__all__ = ["NumberTable", "column_unit", "data_frame", "read_number_table"]

Array = npt.NDArray[np.float64]

_UNITS = {
    "_mps": "m/s",
    "_per_min": "1/min",
    "_percent": "%",
    "_deg": "deg",
    "_rad": "rad",
    "_nats": "nat",
    "_px": "px",
    "_hz": "Hz",
    "_m": "m",
    "_s": "s",
    "phase": "cycle",
    "p_swapped": "1",
    "p_mirrored": "1",
    "probability": "1",
    "similarity": "1",
}


def column_unit(name: str) -> str | None:
    """The unit at the end of a column's name, None for counts, names and frame numbers."""
    return next((unit for end, unit in _UNITS.items() if name.endswith(end)), None)


def data_frame(columns: Mapping[str, Any]) -> pandas.DataFrame:
    """Columns of one length as a `pandas.DataFrame`; `attrs["units"]` has the units of those that have one.

    Raises ImportError, with the command to install it, if there is no pandas.
    """
    try:
        import pandas
    except ImportError:
        raise ImportError("to_pandas() needs pandas: pip install pandas") from None
    frame = pandas.DataFrame({name: np.asarray(values) for name, values in columns.items()})
    units = {name: column_unit(str(name)) for name in columns}
    frame.attrs["units"] = {name: unit for name, unit in units.items() if unit is not None}
    return frame


@dataclass(frozen=True)
class NumberTable:
    """A CSV file of numbers with one header row, and the comments before it."""

    path: str | PathLike[str]
    column: dict[str, int]
    """Index of each column, by its name."""
    numbers: Array
    """(rows, columns), NaN for empty cells."""
    comments: list[str]

    def points(self, dimensions: int) -> tuple[list[str], Array]:
        """Names and positions (T, K, 2) or (T, K, 3) of the points, as in `read_points_csv`."""
        known = {2: (("u_px", "v_px"), ("u", "v")), 3: (("x_m", "y_m", "z_m"), ("x", "y", "z"))}[dimensions]
        for axes in known:
            names = list(
                dict.fromkeys(
                    name.removesuffix(f"_{axis}")
                    for axis in axes
                    for name in self.column
                    if name.endswith(f"_{axis}") and name != f"_{axis}"
                )
            )
            if not names:
                continue
            for name in names:
                absent = [f"{name}_{axis}" for axis in axes if f"{name}_{axis}" not in self.column]
                if absent:
                    raise ValueError(f"{self.path}: point {name} has no column {absent[0]}")
            picked = [[self.column[f"{name}_{axis}"] for axis in axes] for name in names]
            return names, self.numbers[:, np.array(picked)]
        wanted = " or ".join(", ".join(f"NAME_{axis}" for axis in axes) for axes in known)
        raise ValueError(f"{self.path}: no columns {wanted}; it has {', '.join([*self.column][:6])}")

    def times_s(self, rate_hz: float | None) -> Array:
        """The column time_s, which must agree with a given rate; else from the rate given or stated."""
        return _times(self.path, self.column, self.numbers, self.comments, rate_hz)


def read_number_table(path: str | PathLike[str]) -> NumberTable:
    """Reads a CSV file of numbers; words are refused in columns of coordinates and times."""
    lines = read_text(path).splitlines()
    comments = [line for line in lines if line.startswith("#")]
    try:
        told = (line for line in lines if line.strip() and not line.startswith("#"))
        rows = list(CsvRows(told, strip=True))
    except Error as error:
        raise ValueError(f"{path}: not a CSV file: {error}") from None
    if len(rows) < 2:
        raise ValueError(f"{path}: has no header and rows of numbers")
    header, body = rows[0], rows[1:]
    twice = next((name for name, count in Counter(header).items() if count > 1), None)
    if twice is not None:
        raise ValueError(f"{path}: column {twice} occurs {counted(header.count(twice), 'time')}")
    for number, row in enumerate(body):
        if len(row) != len(header):
            raise ValueError(
                f"{path}: row {number} has {counted(len(row), 'cell')}, the header {len(header)}"
            )
    table = np.full((len(body), len(header)), np.nan)
    for number, row in enumerate(body):
        for index, cell in enumerate(row):
            table[number, index] = _number(path, number, header[index], cell)
    return NumberTable(path, {name: index for index, name in enumerate(header)}, table, comments)


def _number(path: str | PathLike[str], row: int, column: str, cell: str) -> float:
    """A cell's number, NaN if it is empty; words are allowed only outside the columns of points."""
    if not cell.strip():
        return np.nan
    try:
        value = float(cell)
    except ValueError:
        if column.rpartition("_")[2] not in ("u", "v", "px", "x", "y", "z", "m", "s", "deg", "scale"):
            return np.nan
        raise ValueError(f"{path}: row {row}, column {column}: {cell} is not a number") from None
    if np.isinf(value):
        raise ValueError(f"{path}: row {row}, column {column}: infinite; leave unseen points empty")
    return value


def _times(
    path: str | PathLike[str],
    column: dict[str, int],
    table: Array,
    comments: list[str],
    rate_hz: float | None,
) -> Array:
    """The column time_s, which must agree with a given rate; else from the rate given or in a comment."""
    if rate_hz is not None and not (rate_hz > 0 and np.isfinite(rate_hz)):
        raise ValueError(f"a frame rate must be positive and finite, got {rate_hz:g}")
    if "time_s" not in column:
        return np.arange(len(table)) / (_stated_rate(path, comments) if rate_hz is None else rate_hz)
    times_s = table[:, column["time_s"]]
    late = np.flatnonzero(~(np.diff(times_s) > 0))
    if len(late):
        raise ValueError(f"{path}: row {late[0] + 1}, column time_s: times must increase")
    if rate_hz is not None and len(times_s) > 1:
        timed_hz = 1 / float(np.median(np.diff(times_s)))
        if abs(timed_hz / rate_hz - 1) > 0.02:
            raise ValueError(f"{path}: column time_s has {timed_hz:.4g} frames per second, not {rate_hz:g}")
    return times_s


def _stated_rate(path: str | PathLike[str], comments: list[str]) -> float:
    """The frame rate in the comments, if exactly one number is before "Hz"."""
    stated = {float(rate) for rate in re.findall(r"(?<![\w.,-])(\d+(?:\.\d*)?) *Hz\b", "\n".join(comments))}
    if len(stated) > 1:
        rates = ", ".join(f"{rate:g}" for rate in sorted(stated))
        raise ValueError(f"{path}: the comments have several rates ({rates} Hz): give --fps")
    if not stated or 0 in stated:
        raise ValueError(f"{path}: no column time_s and no frame rate in a comment: give --fps")
    return stated.pop()
