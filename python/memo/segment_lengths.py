"""Segment lengths of a person: read from files, and checked."""

from __future__ import annotations

import io
import json
import math
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from memo import _memo
from memo.given import nothing_at
from memo.spreadsheet import CsvRows, Error

__all__ = ["checked_lengths", "read_lengths"]

_MAX_LENGTHS_FILE_BYTES = 64 << 20


def read_lengths(path: str | PathLike[str]) -> dict[str, float]:
    """The 17 segment lengths of a file, metres, by name, such as `right_hip_to_right_knee`.

    A table (CSV) with a name and a length in each row, or JSON `{name: length}`; also a `postures.json`,
    whose lengths can be used for other sequences of the same person.
    """
    path = Path(path)
    try:
        if path.is_file() and path.stat().st_size > _MAX_LENGTHS_FILE_BYTES:
            raise ValueError(f"{path}: too large for a file of lengths")
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"{path}: not a text file") from None
    except FileNotFoundError:
        raise ValueError(nothing_at(path)) from None
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror or error}") from None
    named = _json_lengths(path, text) if text.lstrip()[:1] == "{" else _csv_lengths(path, text)
    return checked_lengths(str(path), named)


def _json_lengths(path: Path, text: str) -> dict[str, Any]:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not JSON: {error}") from None
    lengths = data.get("lengths", data)
    if not isinstance(lengths, dict):
        raise ValueError(f"{path}: `lengths` is not an object of names and lengths")
    return {
        name: value.get("length_m") if isinstance(value, dict) else value for name, value in lengths.items()
    }


def _csv_lengths(path: Path, text: str) -> dict[str, Any]:
    named: dict[str, Any] = {}
    known = set(_memo.segment_names())
    try:
        rows = list(CsvRows(io.StringIO(text, newline=""), strip=True))
    except Error as error:
        raise ValueError(f"{path}: not a table: {error}") from None
    for line, cells in enumerate(rows, start=1):
        if not any(cells) or (line == 1 and cells[0] not in known):  # blank, or the header
            continue
        if len(cells) < 2:
            raise ValueError(f"{path}: row {line} has no length beside the name")
        if cells[0] in named:
            raise ValueError(f"{path}: row {line}: {cells[0]} appears twice")
        named[cells[0]] = cells[1]
    return named


def checked_lengths(where: str, lengths: Mapping[str, Any]) -> dict[str, float]:
    """All 17 lengths by name; ValueError with the place for others."""
    names = _memo.segment_names()
    absent = [name for name in names if name not in lengths]
    unknown = [str(name)[:60] for name in lengths if name not in names]
    if unknown:
        raise ValueError(f"{where}: no segment {', '.join(unknown[:3])}; the names are {', '.join(names)}")
    if absent:
        raise ValueError(f"{where}: {len(absent)} of 17 lengths missing: {', '.join(absent)}")
    return {name: _length_m(where, name, lengths[name]) for name in names}


def _length_m(where: str, name: str, value: Any) -> float:
    try:
        length_m = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError):
        length_m = math.nan
    if not 0 < length_m < math.inf:
        raise ValueError(f"{where}: {name} is {str(value)[:60]}, not a length in metres")
    return length_m
