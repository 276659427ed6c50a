"""Tables as Parquet, the unit of every column in its metadata. Needs the extra `parquet` (pyarrow).

Columns and their names are those of the CSV files. An unknown value is null: NaN and the empty texts
of columns that otherwise hold numbers. The unit is stored under `unit` in the metadata of a column (`cycle`
for `phase`, `1` for a pure number), the version that wrote the file under `memo` in that of the table.

Limits: no nested columns, and no tables beyond 100 million cells.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from os import PathLike
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from memo._memo import __version__
from memo.extras import install
from memo.formats.motion import FormatError, Motion, Up
from memo.formats.reading import Given
from memo.formats.table import motion_columns, motion_of_table
from memo.given import nothing_at
from memo.table import NumberTable, column_unit
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = ["read_parquet", "read_parquet_motion", "write_parquet", "write_parquet_motion"]

_MAX_CELLS = 100_000_000


def write_parquet(
    path: str | PathLike[str],
    columns: Mapping[str, npt.ArrayLike],
    *,
    units: Mapping[str, str] | None = None,
    about: Mapping[str, str] | None = None,
) -> None:
    """Writes columns of one length: numbers, texts or truth values.

    `units` are those of columns whose names do not end in a unit; `about` is stored in the table's metadata.
    """
    pa, pq = _arrow()
    arrays = {name: _array(pa, name, np.asarray(values)) for name, values in columns.items()}
    lengths = {name: len(array) for name, array in arrays.items()}
    if not lengths or len(set(lengths.values())) > 1:
        raise FormatError(f"{path}: columns of one length are needed, got {lengths}")
    known = {name: (units or {}).get(name) or column_unit(name) for name in arrays}
    fields = [
        pa.field(name, array.type, metadata=None if known[name] is None else {"unit": known[name]})
        for name, array in arrays.items()
    ]
    schema = pa.schema(fields, metadata={"memo": __version__, **(about or {})})
    with complete_file(path) as temporary:
        pq.write_table(pa.table(list(arrays.values()), schema=schema), temporary)


def read_parquet(path: str | PathLike[str]) -> dict[str, npt.NDArray[Any]]:
    """Reads any flat table: whole numbers as int64 (float64 where some are null), texts and dates as objects.

    Decimals, which DuckDB makes of `0.04 * frame`, become float64; null becomes NaN, or an empty text.
    """
    path = Path(path)
    pa, pq = _arrow()
    try:
        with pq.ParquetFile(path, memory_map=False) as file:
            cells = file.metadata.num_rows * file.metadata.num_columns
            if not 0 <= cells <= _MAX_CELLS:
                raise FormatError(f"{path}: {counted(cells, 'cell')}; at most {_MAX_CELLS} are read")
            schema = file.schema_arrow
            _check_flat(pa, path, schema)
            table = file.read(use_threads=False)
        table.validate(full=True)
        return {name: _values(pa, table.column(index)) for index, name in enumerate(schema.names)}
    except FileNotFoundError:
        raise FormatError(nothing_at(path)) from None
    except (pa.ArrowException, OSError, UnicodeDecodeError, MemoryError, OverflowError) as error:
        raise FormatError(f"{path}: not Parquet that can be read: {error}") from None


def read_parquet_motion(path: Path, given: Given) -> Motion:
    """The points and angles of a table, like `memo.formats.table`; its up axis is in `about`."""
    given.check_used("rate_hz", "unit_m")
    try:
        columns = read_parquet(path)
    except FormatError as error:
        raise FormatError(str(error).removeprefix(f"{path}: ")) from None
    known = [name for name, values in columns.items() if values.dtype.kind in "fi"]
    if not known:
        raise FormatError("has no column of numbers")
    numbers = np.column_stack([columns[name].astype(np.float64) for name in known])
    up = _about(path).get("up")
    comments = [] if up is None else [f"# {up} up"]
    table = NumberTable(path, {name: index for index, name in enumerate(known)}, numbers, comments)
    try:
        return motion_of_table(table, given)
    except ValueError as error:
        raise FormatError(str(error).removeprefix(f"{path}: ")) from None


def write_parquet_motion(path: Path, motion: Motion, up: Up) -> list[str]:
    """Writes points and angles, the up axis in the table's metadata; returns what was left out."""
    write_parquet(path, motion_columns(motion, up), about={"up": up})
    return ["A table of joints cannot store events: left out."] if motion.events else []


def _about(path: Path) -> dict[str, str]:
    """The table's own metadata."""
    _, pq = _arrow()
    found = pq.read_schema(path).metadata or {}
    return {key.decode(errors="replace"): value.decode(errors="replace") for key, value in found.items()}


def _arrow() -> tuple[ModuleType, ModuleType]:
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        raise FormatError(f"Parquet needs pyarrow: {install('parquet', 'pyarrow')}") from None


def _array(pa: ModuleType, name: str, values: npt.NDArray[Any]) -> Any:
    """A column for Arrow, null if unknown."""
    if values.ndim != 1:
        raise FormatError(f"column {name}: wanted one value per row, got shape {values.shape}")
    if values.dtype.kind not in "fiubUO":
        raise FormatError(f"column {name}: {values.dtype} is neither number, text nor truth value")
    if values.dtype.kind == "f":
        return pa.array(values, mask=np.isnan(values))
    if values.dtype.kind == "O":
        known = [None if value is None or value == "" else value for value in values.tolist()]
        numbers = all(value is None or type(value) in (int, float) for value in known)
        return pa.array(known if numbers and any(value is not None for value in known) else map(str, values))
    return pa.array(values)


def _check_flat(pa: ModuleType, path: Path, schema: Any) -> None:
    if len(set(schema.names)) < len(schema.names):
        raise FormatError(f"{path}: a column name appears twice")
    types = pa.types
    for name, kind in zip(schema.names, schema.types, strict=True):
        own = kind.value_type if types.is_dictionary(kind) else kind
        checks = (
            types.is_integer,
            types.is_floating,
            types.is_decimal,
            types.is_null,
            types.is_boolean,
            types.is_temporal,
            types.is_string,
            types.is_large_string,
        )
        if not any(check(own) for check in checks):
            raise FormatError(f"{path}: column {name}: {kind} is neither number, text nor truth value")


def _values(pa: ModuleType, column: Any) -> npt.NDArray[Any]:
    kind = column.type
    if pa.types.is_dictionary(kind):
        column = column.cast(kind.value_type)
        kind = kind.value_type
    as_floats = (pa.types.is_floating, pa.types.is_decimal, pa.types.is_null)
    if any(is_kind(kind) for is_kind in as_floats) or (pa.types.is_integer(kind) and column.null_count):
        return np.asarray(column.cast(pa.float64()).to_numpy(), np.float64)
    if pa.types.is_integer(kind):
        return np.asarray(column.cast(pa.int64()).to_numpy())
    if pa.types.is_boolean(kind) and not column.null_count:
        return np.asarray(column.to_numpy())
    if pa.types.is_temporal(kind):
        column = column.cast(pa.string())
    return np.array(["" if value is None else value for value in column.to_pylist()], dtype=object)
