"""Tables: CSV, wide (`frame` or `time_s`, `<joint>_x`, `<joint>_y`, optionally `<joint>_score`) or long
(`frame` or `time_s`, `joint`, `x`, `y`, optionally `score`), either with `person` for several people.

Coordinates may also end on `_x_px` and `_y_px` or `_u_px` and `_v_px`, as in `track.csv`; scores on
`_confidence`, `_likelihood` or `_visibility`. Written tables are wide, `_u_px` and `_v_px`.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.keypoints.found import Found, Person, check_all_placed, different, with_missing
from memo.keypoints.points import MAX_FRAME, Array, Keypoints, KeypointsError, Source, check_finite
from memo.keypoints.text import LONGEST_NAME, content_of, short, write_text
from memo.spreadsheet import CsvRows, Error, write_rows
from memo.wording import counted

__all__ = ["PERSON_COLUMNS", "read_csv", "read_parquet_table", "write_csv"]

_AXES_SUFFIXES = (("_x", "_y"), ("_x_px", "_y_px"), ("_u_px", "_v_px"))
_SCORE_SUFFIXES = ("_score", "_confidence", "_likelihood", "_visibility")
_LONG_COLUMNS = ("joint", "x", "y")
PERSON_COLUMNS = ("person", "person_id", "track_id")


def write_csv(path: str | PathLike[str], keypoints: Keypoints) -> tuple[str, ...]:
    """Writes a wide table: `frame`, `time_s`, and `_u_px`, `_v_px`, `_score` of every joint; nothing is lost.

    Cells of missing points are empty. Returns the joints left out: none.
    """
    check_finite(keypoints)
    suffixes = ("_u_px", "_v_px", "_score")
    table: list[list[Any]] = [
        ["frame", "time_s", *(name + end for name in keypoints.names for end in suffixes)]
    ]
    for row, frame in enumerate(keypoints.frames.tolist()):
        values = np.column_stack([keypoints.points[row], keypoints.scores[row]])
        missing = np.isnan(values[:, :2]).any(axis=1)
        cells = [
            ["", "", ""] if gone else map(repr, own)
            for gone, own in zip(missing, values.tolist(), strict=True)
        ]
        table.append([frame, repr(float(keypoints.times_s[row])), *(cell for own in cells for cell in own)])
    text = io.StringIO(newline="")
    write_rows(text, table)
    write_text(Path(path), text.getvalue())
    return ()


@dataclass(frozen=True)
class Columns:
    """The columns of a table."""

    frame: int | None
    time_s: int | None
    person: int | None
    names: tuple[str, ...]
    #: Wide: columns x, y, score of each joint. Long: of all joints.
    values: tuple[tuple[int, int, int | None], ...]
    #: Long: the column that names the joint.
    joint: int | None


def read_csv(path: Path, content: str) -> Found:
    """All people in a table."""
    rows, _ = _rows(path, content)
    return _everybody(path, rows, Source(path, _write_like))


def read_parquet_table(path: Path) -> Found:
    """All people in a Parquet table, which is read like CSV but cannot be written back."""
    from memo.formats.motion import FormatError
    from memo.formats.parquet import read_parquet

    try:
        columns = read_parquet(path)
    except FormatError as error:
        raise KeypointsError(str(error)) from None
    texts = [
        ["" if value != value else str(value) for value in values.tolist()] for values in columns.values()
    ]
    rows = [list(columns), *map(list, zip(*texts, strict=True))]
    return _everybody(path, rows, Source(path, None))


def _everybody(path: Path, rows: list[list[str]], source: Source) -> Found:
    columns = _columns(path, rows)
    read = _long_people if columns.joint is not None else wide_people
    frames, times_s = row_frames(path, rows, columns)
    people = read(path, rows, columns, frames)
    for (_, one), (_, other) in pairwise(
        sorted((person.frame, index) for index, person in enumerate(people))
    ):
        if columns.person is None and people[one].frame == people[other].frame:
            raise KeypointsError(
                f"{path}: frame {people[one].frame} appears twice and there is no column `person`"
            )
    return Found(source, people, columns.names, times_s, frames=tuple(frames.values()))


def _rows(path: Path, content: str) -> tuple[list[list[str]], str]:
    """The rows of a table, its header first, and the character between cells."""
    header = content.split("\n", 1)[0]
    delimiter = max(",;\t", key=header.count)
    try:
        rows = list(CsvRows(io.StringIO(content, newline=""), delimiter=delimiter))
    except Error as error:
        raise KeypointsError(f"{path}: not a table: {error}") from None
    for line, row in enumerate(rows, start=1):
        if row and len(row) != len(rows[0]):
            raise KeypointsError(
                f"{path}: row {line} has {counted(len(row), 'cell')}, the header {len(rows[0])}"
            )
    return rows, delimiter


def _columns(path: Path, rows: list[list[str]]) -> Columns:
    header = [cell.strip() for cell in rows[0]] if rows else []
    lower = {cell.lower(): index for index, cell in reversed(list(enumerate(header)))}
    frame, time_s = lower.get("frame"), lower.get("time_s")
    person = next((lower[name] for name in PERSON_COLUMNS if name in lower), None)
    if frame is None and time_s is None:
        raise KeypointsError(f"{path}: a table of keypoints needs a column `frame` or `time_s`")
    if all(name in lower for name in _LONG_COLUMNS):
        if "z" in lower:
            raise KeypointsError(f"{path}: columns x, y and z: these are points in space, not image points")
        joint, x, y = (lower[name] for name in _LONG_COLUMNS)
        spelt = dict.fromkeys(row[joint] for row in rows[1:] if row)
        names = tuple(dict.fromkeys(name for text in spelt if (name := joint_of(path, text)) is not None))
        values: list[tuple[int, int, int | None]] = [(x, y, lower.get("score"))]
    else:
        joint = None
        names, values = _wide_columns(path, header)
    if not names:
        raise KeypointsError(
            f"{path}: no joint in it, such as right_knee_x and right_knee_y, or joint, x and y; "
            f"got the columns {short(', '.join(header))}"
        )
    return Columns(frame, time_s, person, names, tuple(values), joint)


def _wide_columns(path: Path, header: list[str]) -> tuple[tuple[str, ...], list[tuple[int, int, int | None]]]:
    places = {cell: index for index, cell in reversed(list(enumerate(header)))}
    found: dict[str, tuple[int, int, int | None]] = {}
    for index, cell in enumerate(header):
        for x_suffix, y_suffix in _AXES_SUFFIXES:
            stem = cell.removesuffix(x_suffix)
            if stem == cell or (name := joint_of(path, stem)) is None:
                continue
            if stem + "_z" in places:
                raise KeypointsError(f"{path}: {stem}_z: these are points in space, not image points")
            if stem + y_suffix not in places:
                raise KeypointsError(f"{path}: column {cell} without {stem}{y_suffix}")
            if name in found:
                raise KeypointsError(f"{path}: column {cell}: {name} appears twice")
            score = next((places[stem + end] for end in _SCORE_SUFFIXES if stem + end in places), None)
            found[name] = (index, places[stem + y_suffix], score)
    return tuple(found), list(found.values())


def joint_of(path: Path, text: str) -> str | None:
    """The joint that a table names, None if it is not a joint; a misspelt joint is refused."""
    if len(text) > LONGEST_NAME:
        return None
    try:
        return _memo.joint_name(text)
    except ValueError as error:
        raise KeypointsError(f"{path}: {error}") from None


def row_frames(
    path: Path, rows: list[list[str]], columns: Columns
) -> tuple[dict[int, int], dict[int, float] | None]:
    """The frame of each row that is not blank, and the time of each frame.

    Without a column `frame`, frames are numbered in order of time.
    """
    lines = [line for line, row in enumerate(rows[1:], start=1) if any(row)]
    at_s = (
        {} if columns.time_s is None else {line: _time_s(path, rows, columns.time_s, line) for line in lines}
    )
    rank = {time_s: frame for frame, time_s in enumerate(sorted(set(at_s.values())))}
    frames: dict[int, int] = {}
    times_s: dict[int, float] = {}
    for line in lines:
        where = f"{path}: row {line + 1}"
        frame = rank[at_s[line]] if columns.frame is None else _frame(where, rows[line][columns.frame])
        frames[line] = frame
        if line in at_s and times_s.setdefault(frame, at_s[line]) != at_s[line]:
            raise KeypointsError(
                f"{where}: frame {frame} at two times, {times_s[frame]:g} and {at_s[line]:g}"
            )
    return frames, times_s if columns.time_s is not None else None


def _time_s(path: Path, rows: list[list[str]], column: int, line: int) -> float:
    where = f"{path}: row {line + 1}"
    time_s = number_of(rows[line][column], f"{where}, time_s")
    if math.isnan(time_s):
        raise KeypointsError(f"{where}: no time_s")
    return time_s


def _frame(where: str, cell: str) -> int:
    number = number_of(cell, f"{where}, frame")
    if not (0 <= number <= MAX_FRAME and number == int(number)):
        raise KeypointsError(f"{where}: frame {short(cell)} is not a frame number")
    return int(number)


def wide_people(path: Path, rows: list[list[str]], columns: Columns, frames: dict[int, int]) -> list[Person]:
    return [
        Person(
            frame,
            _cells(path, [(line, rows[line], own) for own in columns.values]),
            line,
            _name(rows[line], columns) or None,
        )
        for line, frame in frames.items()
    ]


def _name(row: list[str], columns: Columns) -> str:
    """The name of the person of a row; empty in a table of one person."""
    return "" if columns.person is None else row[columns.person].strip()


def _long_people(path: Path, rows: list[list[str]], columns: Columns, frames: dict[int, int]) -> list[Person]:
    lines: dict[tuple[int, str], dict[int, int]] = {}
    assert columns.joint is not None
    numbers = {name: index for index, name in enumerate(columns.names)}
    for line, frame in frames.items():
        name = joint_of(path, rows[line][columns.joint])
        if name is None:
            continue
        who = _name(rows[line], columns)
        joints = lines.setdefault((frame, who), {})
        if numbers[name] in joints:
            raise KeypointsError(f"{path}: row {line + 1}: {name} appears twice in frame {frame}")
        joints[numbers[name]] = line
    people = []
    for (frame, who), joints in lines.items():
        values = np.full((len(numbers), 3), (np.nan, np.nan, 0.0))
        own = _cells(path, [(line, rows[line], columns.values[0]) for line in joints.values()])
        values[list(joints)] = own
        people.append(Person(frame, values, joints, who or None))
    return people


def _cells(path: Path, cells: Iterable[tuple[int, list[str], tuple[int, int, int | None]]]) -> Array:
    """x, y, score from the rows and columns given; the score is 1 if the table has none."""
    values = []
    for line, row, (x, y, score) in cells:
        where = f"{path}: row {line + 1}"
        confidence = 1.0 if score is None else number_of(row[score], where)
        values.append((number_of(row[x], where), number_of(row[y], where), confidence))
    array = np.array(values, np.float64).reshape(-1, 3)
    return with_missing(array, f"{path}: row {line + 1}" if values else str(path))


def number_of(text: str, where: str) -> float:
    """A cell's number; NaN if it is empty."""
    try:
        number = float(text) if text.strip() else math.nan
    except ValueError:
        raise KeypointsError(f"{where}: {short(text)} is not a number") from None
    if math.isinf(number):
        raise KeypointsError(f"{where}: {short(text)} is not finite")
    return number


def _write_like(out: Path, keypoints: Keypoints) -> None:
    source = keypoints.source
    check_all_placed(keypoints)
    content = content_of(source.path)
    rows, delimiter = _rows(source.path, content)
    columns = _columns(source.path, rows)
    if columns.names != keypoints.names:
        raise KeypointsError(f"{source.path}: has changed since it was read: other joints")
    added: dict[int, list[list[str]]] = {}
    for row, place in enumerate(source.places):
        if place is not None:
            set_cells(rows, columns, keypoints, row, place, added)
    text = io.StringIO(newline="")
    table = (cells for line, row in enumerate(rows) for cells in [row, *added.get(line, ())])
    write_rows(text, table, delimiter=delimiter, line_end="\r\n" if "\r\n" in content else "\n")
    write_text(out, text.getvalue())


def set_cells(
    rows: list[list[str]],
    columns: Columns,
    keypoints: Keypoints,
    row: int,
    place: Any,
    added: dict[int, list[list[str]]],
) -> None:
    """Changes the cells of the joints that differ; a long table gets rows for new joints."""
    wide = columns.joint is None
    lines = dict.fromkeys(range(len(columns.names)), place) if wide else place
    path = keypoints.source.path
    if max(lines.values()) >= len(rows) or not all(rows[line] for line in lines.values()):
        raise KeypointsError(f"{path}: has changed since it was read: row {max(lines.values()) + 1} is gone")
    before = np.full((len(columns.names), 3), (np.nan, np.nan, 0.0))
    owns = {joint: columns.values[joint if wide else 0] for joint in range(len(columns.names))}
    before[list(lines)] = _cells(path, [(line, rows[line], owns[joint]) for joint, line in lines.items()])
    after = np.column_stack([keypoints.points[row], keypoints.scores[row]])
    for joint in different(before, after):
        if joint in lines:
            cells = rows[lines[joint]]
        else:
            last = max(lines.values())
            cells = ["" for _ in rows[last]]
            for kept in (columns.frame, columns.time_s, columns.person):
                if kept is not None:
                    cells[kept] = rows[last][kept]
            if columns.joint is not None:
                cells[columns.joint] = columns.names[joint]
            added.setdefault(last, []).append(cells)
        x, y, score = owns[joint]
        missing = np.isnan(after[joint, :2]).any()
        cells[x], cells[y] = ("", "") if missing else map(repr, after[joint, :2].tolist())
        if score is not None:
            cells[score] = "" if missing else repr(float(after[joint, 2]))
