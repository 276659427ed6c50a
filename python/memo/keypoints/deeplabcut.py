"""DeepLabCut: the tables of its predictions and labels, CSV and HDF5 (H5).

The first rows, or the levels of the columns, are `scorer`, perhaps `individuals`, `bodyparts` and `coords`
(x, y, likelihood); the first column is the frame, or the path of an image with the frame's number at its
end. Individuals are people. Source: DeepLabCut/DeepLabCut `docs/standardDeepLabCut_UserGuide.md`; H5 is the
table `df_with_missing` that its `DataFrame.to_hdf(..., format="table")` writes.

Tables of points in space (`triangulate`) are refused, and so are labels of several scorers.

Body parts have the names of the project's `config.yaml`. Those that are joints of memo in any usual
spelling are kept (`rightknee`, `RKnee`); others are left out.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.hdf5 import opened
from memo.keypoints.points import MAX_FRAME, Array, KeypointsError, Source
from memo.keypoints.text import check_one_series, last_number, short
from memo.spreadsheet import CsvRows, Error
from memo.wording import counted

__all__ = [
    "is_deeplabcut",
    "is_deeplabcut_h5",
    "known_joints",
    "read_deeplabcut",
    "read_deeplabcut_h5",
    "table_rows",
]

_LEVELS = ("scorer", "individuals", "bodyparts", "coords")
_SCORE = "likelihood"


def is_deeplabcut(content: str) -> bool:
    """Whether this is the text of a table of DeepLabCut."""
    lines = content.lstrip("\ufeff").split("\n", 4)[:4]
    first = [line.partition(",")[0].strip() for line in lines]
    return first[0] == "scorer" and "bodyparts" in first and "coords" in first


def read_deeplabcut(path: Path, content: str) -> Found:
    """All individuals in a CSV table."""
    rows = table_rows(path, content)
    levels = {row[0].strip(): row for row in rows[:4] if row[0].strip() in _LEVELS}
    count = len(levels)
    if not {"bodyparts", "coords"} <= levels.keys() or len({len(row) for row in levels.values()}) > 1:
        lengths = ", ".join(f"{name} {len(row)}" for name, row in levels.items())
        raise KeypointsError(f"{path}: rows scorer, bodyparts and coords of one length wanted; got {lengths}")
    # Labels have up to three columns with the parts of the path of the image.
    indexed = next((i for i, cell in enumerate(levels["coords"]) if cell.strip() in ("x", "y")), 1)
    columns = [
        tuple(cell.strip() for cell in column)
        for column in zip(*(levels[name][indexed:] for name in _LEVELS if name in levels), strict=True)
    ]
    frames, values = [], []
    images: dict[int, str] = {}
    for number, row in enumerate(rows[count:], start=count + 1):
        if len(row) != indexed + len(columns):
            raise KeypointsError(
                f"{path}: row {number} has {counted(len(row), 'cell')}, the header {indexed + len(columns)}"
            )
        try:
            values.append([float(cell) if cell.strip() else np.nan for cell in row[indexed:]])
        except ValueError:
            raise KeypointsError(f"{path}: row {number}: a cell is not a number") from None
        frames.append(_frame(path, "/".join(row[:indexed]), f"{path}: row {number}", images))
    table = np.array(values, np.float64).reshape(len(values), len(columns))
    return _people(path, columns, "individuals" in levels, frames, table)


def table_rows(path: Path, content: str) -> list[list[str]]:
    """The rows of a CSV table that are not blank."""
    try:
        rows = list(CsvRows(io.StringIO(content.lstrip("\ufeff"), newline=""), delimiter=","))
    except Error as error:
        raise KeypointsError(f"{path}: not a table: {error}") from None
    return [row for row in rows if any(row)]


def is_deeplabcut_h5(file: Any) -> bool:
    return "df_with_missing" in file


def read_deeplabcut_h5(path: Path) -> Found:
    """All individuals in an H5 table."""
    with opened(path) as file:
        group = file["df_with_missing"]
        if "table" not in group:
            raise KeypointsError(f"{path}: df_with_missing has no table; write it with format='table'")
        rows = group["table"][()]
        named = group["table"].attrs.get("values_block_0_kind")
        if named is None or "values_block_0" not in (rows.dtype.names or ()):
            raise KeypointsError(
                f"{path}: df_with_missing/table is not a table of pandas with one block of numbers"
            )
        columns = [tuple(map(str, column)) for column in _unpickled(bytes(named), path)]
    values = np.asarray(rows["values_block_0"], np.float64)
    if values.ndim != 2 or values.shape[1] != len(columns) or not columns or len(set(map(len, columns))) > 1:
        raise KeypointsError(
            f"{path}: {counted(len(columns), 'name')} of columns for numbers of shape {values.shape}"
        )
    index = rows["index"] if "index" in rows.dtype.names else np.arange(len(rows))
    images: dict[int, str] = {}
    frames = [
        _frame(
            path,
            one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one),
            f"{path}: row {number}",
            images,
        )
        for number, one in enumerate(index.tolist())
    ]
    return _people(path, columns, len(columns[0]) == len(_LEVELS), frames, values)


class _OnlyData(pickle.Unpickler):
    """Reads lists, tuples, texts and numbers; refuses everything that would run code."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"{module}.{name} is not plain data")


def _unpickled(content: bytes, path: Path) -> Sequence[Any]:
    try:
        found = _OnlyData(io.BytesIO(content)).load()
    except Exception as error:  # a damaged pickle may raise anything
        raise KeypointsError(
            f"{path}: the names of the columns cannot be read: {short(str(error))}"
        ) from None
    if not isinstance(found, list) or not all(isinstance(column, tuple) for column in found):
        raise KeypointsError(
            f"{path}: the names of the columns are {type(found).__name__}, not a list of tuples"
        )
    return found


def _frame(path: Path, text: str, where: str, images: dict[int, str]) -> int:
    """The frame of a row, from its number or the path of its image, which `images` collects."""
    frame = last_number(text.rpartition(".")[0] if "." in text and not text.isdecimal() else text)
    if frame is None or frame > MAX_FRAME:
        raise KeypointsError(f"{where}: {short(text)} has no frame number")
    if not text.strip().isdecimal():
        check_one_series(path, images, frame, text)
    return frame


def _people(
    path: Path, columns: list[tuple[str, ...]], has_individuals: bool, frames: list[int], values: Array
) -> Found:
    """The individuals in a table with columns (scorer, [individual,] body part, coordinate)."""
    if len(set(frames)) < len(frames):
        raise KeypointsError(f"{path}: two rows of one frame")
    if any(column[-1] == "z" for column in columns):
        raise KeypointsError(f"{path}: coords x, y and z: these are points in space, not image points")
    scorer = _scorer(path, columns, values)
    places = {
        (column[1] if has_individuals else "", column[-2], column[-1]): i
        for i, column in enumerate(columns)
        if column[0] == scorer
    }
    parts = list(dict.fromkeys(part for _, part, _ in places))
    joints = known_joints(path, parts)
    people = []
    for individual in dict.fromkeys(name for name, _, _ in places):
        own = np.full((len(frames), len(joints), 3), np.nan)
        for index, part in enumerate(joints):
            for axis, coordinate in enumerate(("x", "y", _SCORE)):
                place = places.get((individual, part, coordinate))
                if place is not None:
                    own[:, index, axis] = values[:, place]
                elif coordinate == _SCORE:
                    own[:, index, axis] = 1.0  # labels have no likelihood
        for frame, one in zip(frames, own, strict=True):
            if np.isfinite(one[:, :2]).any():
                values_of = with_missing(one, f"{path}: frame {frame}")
                people.append(Person(frame, values_of, None, individual or None))
    return Found(Source(path, None), people, names=tuple(joints.values()), frames=tuple(frames))


def _scorer(path: Path, columns: list[tuple[str, ...]], values: Array) -> str | None:
    """The only scorer with points, or the first one if none has any; several are refused."""
    scorers = dict.fromkeys(column[0] for column in columns)
    used = [
        scorer
        for scorer in scorers
        if any(
            column[0] == scorer and column[-1] in ("x", "y") and np.isfinite(values[:, index]).any()
            for index, column in enumerate(columns)
        )
    ]
    if len(used) > 1:
        raise KeypointsError(
            f"{path}: points of {len(used)} scorers ({short(', '.join(used))}); keep the columns of one"
        )
    return next(iter([*used, *scorers]), None)


def known_joints(path: Path, names: Sequence[str]) -> dict[str, str]:
    """The joint of each name that is one; refused if there is none, or two names for one."""
    joints: dict[str, str] = {}
    for name in names:
        try:
            joint = _memo.joint_name(name)
        except ValueError:  # similar to a joint, such as neck1
            continue
        if joint is not None:
            joints[name] = joint
    twice = [name for name in joints if list(joints.values()).count(joints[name]) > 1]
    if twice or not joints:
        wanted = "names of different joints, such as left_knee, are needed"
        raise KeypointsError(f"{path}: {wanted}; got {short(', '.join(twice or names) or 'none')}")
    return joints
