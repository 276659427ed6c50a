"""Result files, among them `track.csv`, `events.csv` and `flips.csv`.

The tables are comma separated with one header row; metres, radians if the name ends in `_rad`, degrees if
it ends in `_deg`; an unknown value is an empty cell. A file appears under its name only when complete,
and a spreadsheet does not read its texts as formulas (`memo.spreadsheet`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from memo.missing import real_numbers
from memo.pixels import columns_of_video, shrink_of_table
from memo.spreadsheet import CsvRows, Error, write_rows
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = [
    "EVENT_COLUMNS",
    "FLIP_COLUMNS",
    "JOINTS",
    "MAX_TEXT_BYTES",
    "TRACK_COLUMNS",
    "complete_file",
    "plain",
    "read_columns_csv",
    "read_events_csv",
    "read_text",
    "read_text_columns",
    "read_track",
    "read_track_csv",
    "read_typed_columns",
    "write_columns_csv",
    "write_events_csv",
    "write_flips_csv",
    "write_json",
    "write_table",
    "write_track_csv",
]

SIDES = ("right", "left")
ANGLES = ("hip", "knee", "ankle", "shoulder", "elbow")
JOINTS = tuple(
    f"{side}_{joint}" for side in SIDES for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")
)

TRACK_COLUMNS = (
    *("frame", "time_s", "x_m", "y_m", "z_m", "heading_rad", "phase", "p_swapped", "speed_mps"),
    *("sd_x_m", "sd_y_m", "sd_z_m", "sd_phase"),
    *(f"{first}{side}_{angle}_deg" for side in SIDES for angle in ANGLES for first in ("", "sd_")),
    *(f"{joint}_{axis}" for joint in JOINTS for axis in ("x_m", "y_m", "z_m", "u_px", "v_px")),
    *("similarity", "walk", "person"),
)
"""Columns of `track.csv`, in order; `walk` and `person` count the walks and the people of a video from 0."""

_OF_PEOPLE = {"walk", "person"}
"""Columns that tables of events of run.json's schemas 1 and 2 do not have."""

_SINCE_FIT = {"person"} | {
    name for name in TRACK_COLUMNS if name.endswith("_deg") and ("sd_" in name or "ankle" in name)
}
"""Columns that tables of run.json's schemas 1 and 2 do not have."""

EVENT_COLUMNS = ("time_s", "frame", "event", "side", "walk", "person")
"""Columns of `events.csv`, in order; `frame` has a fraction if the event is between two frames."""

FLIP_COLUMNS = ("frame", "time_s", "last_frame", "group", "levels", "verdict", "probability", "reason")
"""Columns of `flips.csv`, in order: exchanges of right and left, and runs of frames without a decision."""

# Digits after the point: well below the resolution of a single camera, so that rounding has no effect.
_DIGITS = {
    "frame": 2,
    "_m": 4,
    "_mps": 4,
    "_px": 2,
    "_deg": 2,
    "_rad": 5,
    "_s": 6,
    "_nats": 3,
    "value": 4,
    "ci_low": 4,
    "ci_high": 4,
    "phase": 5,
    "p_swapped": 6,
    "p_mirrored": 4,
    "probability": 6,
    "similarity": 5,
    "support": 4,
    "walk": 0,
    "person": 0,
    "cycle": 0,
}

MAX_TEXT_BYTES = 256 << 20

Column = npt.NDArray[Any]


def write_track_csv(path: str | PathLike[str], columns: Mapping[str, npt.ArrayLike]) -> None:
    """Writes the columns of a track, which must be exactly `TRACK_COLUMNS` in any order."""
    absent, unknown = set(TRACK_COLUMNS) - set(columns), set(columns) - set(TRACK_COLUMNS)
    if absent or unknown:
        raise ValueError(f"track columns: missing {sorted(absent)}, unknown {sorted(unknown)}")
    write_columns_csv(path, {name: columns[name] for name in TRACK_COLUMNS})


def write_columns_csv(path: str | PathLike[str], columns: Mapping[str, npt.ArrayLike]) -> None:
    """Writes columns of one length in their order; the end of a name determines the number of digits."""
    if not isinstance(columns, Mapping):
        raise TypeError(f"wanted columns by their names, got {type(columns).__name__}")
    texts = {name: _texts(name, _one_column(name, values)) for name, values in columns.items()}
    lengths = {name: len(text) for name, text in texts.items()}
    if len(set(lengths.values())) > 1:
        raise ValueError(f"columns of different lengths: {lengths}")
    write_table(path, columns, zip(*texts.values(), strict=True))


def _one_column(name: str, values: npt.ArrayLike) -> Column:
    """The values of a column, NaN where they are masked."""
    column: Column = real_numbers(values) if np.ma.is_masked(values) else np.asarray(values)
    if column.ndim != 1:
        raise ValueError(f"column {name}: wanted one value per row, got shape {column.shape}")
    return column


def read_columns_csv(path: str | PathLike[str]) -> dict[str, Column]:
    """Reads any table of memo: a column is int64, float64 with NaN for empty cells, or texts."""
    return {name: _column(cells) for name, cells in read_text_columns(path).items()}


def _column(cells: Sequence[str]) -> Column:
    """Cells as whole numbers, numbers or texts, the first type that fits all of them."""
    for kind, texts in ((np.int64, cells), (np.float64, [cell or "nan" for cell in cells])):
        try:
            return np.array(texts, dtype=object).astype(kind)
        except (ValueError, OverflowError):
            pass
    return np.array(cells, dtype=object)


def write_json(path: str | PathLike[str], value: Any) -> None:
    """Writes a value as JSON, null if it is not finite."""
    with complete_file(path) as temporary, open(temporary, "w", encoding="utf-8") as file:
        json.dump(plain(value), file, separators=(",", ":"))


def plain(value: Any) -> Any:
    """The value in JSON types: no numpy types, and null for values that are not finite."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def read_track_csv(path: str | PathLike[str]) -> dict[str, Column]:
    """Reads a file of `write_track_csv`: `frame` and `walk` as int64, others as float64, empty cells NaN.

    Pixels are those of the video, even if an older version of memo wrote those of shrunk pictures and
    `run.json` beside the table records this.
    """
    present = set(read_text_columns(path))
    names = [name for name in TRACK_COLUMNS if name in present or name not in _SINCE_FIT]
    whole = tuple(name for name in ("frame", "walk", "person") if name in names)
    columns = _with_absent(read_typed_columns(path, names, whole=whole))
    return columns_of_video(columns, shrink_of_table(path))


def _with_absent(columns: Mapping[str, Column]) -> dict[str, Column]:
    """All columns of a track; those that tables written before did not have are unknown, and each walk is
    another person's."""
    unknown = np.full(len(columns["frame"]), np.nan)
    absent = {name: columns["walk"] if name == "person" else unknown for name in TRACK_COLUMNS}
    return {name: columns.get(name, absent[name]) for name in TRACK_COLUMNS}


def read_track(path: str | PathLike[str]) -> dict[str, Column]:
    """The columns of `track.csv` or `track.parquet`, or of the one in a folder, as in `read_track_csv`.

    Parquet needs the extra `parquet`.
    """
    path = Path(path)
    if path.is_dir():
        names = [path / name for name in ("track.csv", "track.parquet") if (path / name).is_file()]
        if not names:
            raise ValueError(f"{path}: a folder without track.csv or track.parquet")
        path = names[0]
    if path.suffix.lower() != ".parquet":
        return read_track_csv(path)
    from memo.formats.parquet import read_parquet

    columns = read_parquet(path)
    absent = sorted(set(TRACK_COLUMNS) - set(columns) - _SINCE_FIT)
    if absent:
        raise ValueError(f"{path}: columns missing: {absent}")
    columns = _with_absent(columns)
    texts = [name for name in TRACK_COLUMNS if columns[name].dtype.kind not in "iuf"]
    if texts:
        raise ValueError(f"{path}: column {texts[0]} holds no numbers")
    return columns_of_video({name: columns[name] for name in TRACK_COLUMNS}, shrink_of_table(path))


def write_events_csv(path: str | PathLike[str], events: Iterable[Mapping[str, Any]]) -> None:
    """Writes gait events: dicts with the keys of `EVENT_COLUMNS`; walk and person are 0 if not given."""
    first = {"walk": 0, "person": 0}
    rows = [_cells(f"event {place}", {**first, **event}, EVENT_COLUMNS) for place, event in enumerate(events)]
    write_table(path, EVENT_COLUMNS, rows)


def _cells(what: str, values: Mapping[str, Any], names: Sequence[str]) -> list[str]:
    """The texts of a row of a table."""
    absent = [name for name in names if name not in values]
    if absent:
        raise ValueError(f"{what} has no {', '.join(absent)}")
    return [_texts(name, np.asarray([values[name]]))[0] for name in names]


def write_flips_csv(path: str | PathLike[str], flips: Iterable[Mapping[str, Any]]) -> None:
    """Writes the changes of right and left: dicts with the keys of `FLIP_COLUMNS`."""
    rows = [_cells(f"flip {place}", flip, FLIP_COLUMNS) for place, flip in enumerate(flips)]
    write_table(path, FLIP_COLUMNS, rows)


def read_events_csv(path: str | PathLike[str]) -> list[dict[str, Any]]:
    """Reads a file of `write_events_csv`; those of run.json's schemas 1 and 2 have no walk and no person."""
    present = set(read_text_columns(path))
    names = [name for name in EVENT_COLUMNS if name in present or name not in _OF_PEOPLE]
    whole = tuple(name for name in names if name in _OF_PEOPLE)
    columns = read_typed_columns(path, names, whole=whole, texts=("event", "side"))
    if np.isnan([columns["time_s"], columns["frame"]]).any():
        raise ValueError(f"{path}: an event without its time or frame")
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def read_typed_columns(
    path: str | PathLike[str],
    names: Sequence[str],
    *,
    whole: Sequence[str] = (),
    texts: Sequence[str] = (),
    instead: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, Column]:
    """These columns of a table: int64 for `whole`, objects for `texts`, else float64 with NaN if empty.

    `instead` names the column whose values stand for an absent one.
    """
    columns: dict[str, Column] = {}
    for name, cells in read_text_columns(path, names, instead).items():
        kind = np.int64 if name in whole else np.float64
        try:
            filled = cells if name in texts else [cell or "nan" for cell in cells]
            columns[name] = np.array(filled, dtype=object)
            if name not in texts:
                columns[name] = columns[name].astype(kind)
        except (ValueError, OverflowError) as error:
            raise ValueError(f"{path}: column {name}: {error}") from None
    return columns


def read_text_columns(
    path: str | PathLike[str], names: Sequence[str] = (), instead: Mapping[str, str] = MappingProxyType({})
) -> dict[str, list[str]]:
    """The columns of a table that has at least these (default: all), cell by cell as written.

    `instead` names the column whose cells stand for an absent one.

    It reads every table of memo; ValueError names the file and the row.
    """
    try:
        with open(Path(path), newline="", encoding="utf-8-sig") as file:
            header, *rows = list(CsvRows(file)) or [[]]
    except (Error, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a table: {error}") from None
    sources = {name: name if name in header else instead.get(name, name) for name in names or header}
    absent = set(sources.values()) - set(header)
    if absent:
        raise ValueError(f"{path}: columns missing: {sorted(absent)}")
    if not header or len(set(header)) < len(header):
        raise ValueError(f"{path}: the names in the header must be different, got {header[:8]}")
    for line, row in enumerate(rows, start=2):
        if row and len(row) != len(header):
            raise ValueError(f"{path}: row {line} has {counted(len(row), 'cell')}, the header {len(header)}")
    place = {name: index for index, name in enumerate(header)}
    return {name: [row[place[source]] for row in rows if row] for name, source in sources.items()}


def read_text(
    path: str | PathLike[str], error: type[ValueError] = ValueError, most_bytes: int = MAX_TEXT_BYTES
) -> str:
    """A text in UTF-8, with or without a byte order mark; raises `error` if it is not, or is too long."""
    path = Path(path)
    size = path.stat().st_size
    if size > most_bytes:
        raise error(f"{path}: {size >> 20} MiB; at most {most_bytes >> 20} MiB are read")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        raise error(f"{path}: not text in UTF-8 (byte {wrong.start})") from None


def _texts(name: str, values: Column) -> list[str]:
    if values.dtype.kind in "iuUO":
        return [str(value) for value in values]
    digits = next((digits for suffix, digits in _DIGITS.items() if name.endswith(suffix)), None)
    if digits is None:
        raise ValueError(f"column {name}: numbers need a name with a unit at its end, such as {name}_m")
    return [f"{value:.{digits}f}" if np.isfinite(value) else "" for value in values]


def write_table(path: str | PathLike[str], header: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Writes a table of texts and numbers."""
    with complete_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        write_rows(file, chain([header], rows))
