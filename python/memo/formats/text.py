"""Lines and rows of numbers in text files, with line and column in every error message."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from memo.files import MAX_TEXT_BYTES
from memo.formats.motion import FormatError

__all__ = ["number", "numbers", "read_lines", "whole_number"]


def read_lines(path: Path) -> list[str]:
    """The lines of a text file, with or without a byte order mark."""
    size = path.stat().st_size
    if size > MAX_TEXT_BYTES:
        raise FormatError(f"{size >> 20} MiB are more than the {MAX_TEXT_BYTES >> 20} MiB that memo reads")
    data = path.read_bytes()
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        # Older programs write names in the code page of their machine; numbers are the same in all of them.
        if b"\0" in data[:4096]:
            raise FormatError(f"byte {error.start}: not a text file") from None
        text = data.decode("latin-1")
    if "\0" in text:
        raise FormatError(f"byte {text.index(chr(0))}: not a text file")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def number(cell: str, where: str) -> float:
    """The finite number in a cell; NaN if it is empty or says so."""
    try:
        value = float(cell) if cell.strip() else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value) or "_" in cell:
        raise FormatError(f"{where}: {cell.strip()[:40]!r} is not a finite number")
    return value


def whole_number(cell: str, where: str, largest: int = 10**9) -> int:
    """The whole number from 0 in a cell."""
    value = number(cell, where)
    if not (0 <= value <= largest and value == int(value)):
        raise FormatError(f"{where}: wanted a whole number from 0 to {largest}, got {cell.strip()[:40]!r}")
    return int(value)


def numbers(cells: Sequence[str], line: int, columns: Sequence[str]) -> list[float]:
    """The numbers of a row; `line` counts from 1, `columns` are the names of its cells."""
    try:
        values = [float(cell) if cell else math.nan for cell in cells]
        if not any(map(math.isinf, values)) and not any("_" in cell for cell in cells):
            return values
    except ValueError:
        pass
    pairs = zip(cells, columns, strict=True)
    return [number(cell, f"line {line}, column {column}") for cell, column in pairs]
