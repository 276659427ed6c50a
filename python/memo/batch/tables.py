"""The tables over all videos: what became of each, and the gait parameters of every walk."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from memo.batch.folder import OutFolder
from memo.batch.manifest import Row

__all__ = ["STATUS_COLUMNS", "write_status", "write_table"]

STATUS_COLUMNS = ("name", "state", "attempt", "seconds", "message", "video")
"""Columns of `status.csv`, in order; a state is one of `STATES`, or `waiting`."""

_UNITS = {"1/min": "_per_min", "m": "_m", "s": "_s", "m/s": "_mps", "%": "_percent", "deg": "_deg", "": ""}
_SUMMARY = ("direction", "gait", "p_swapped")  # of the summary of a video, in this order


def write_status(folder: OutFolder, rows: Sequence[Row], path: Path) -> None:
    """Writes `status.csv`: every video of the manifest, in its order."""
    cells: list[list[Any]] = []
    for row in rows:
        record = folder.record(row.name)
        if record is None:
            cells.append([row.name, "waiting", "", "", "", str(row.video)])
        else:
            seconds = f"{record.seconds:.1f}"
            cells.append([row.name, record.state, record.attempt, seconds, record.message, str(row.video)])
    _write(path, STATUS_COLUMNS, cells)


def write_table(folder: OutFolder, rows: Sequence[Row], path: Path) -> None:
    """Writes the `gait_parameters.csv` of all videos: one row a walk, and one for each video without a walk.

    A parameter has columns such as `stride_time_right_s`, and with `_ci_low`, `_ci_high` (95 %) and `_n`.
    """
    table = [walk for row in rows for walk in _walks(folder, row)]
    leading = ("name", "state", "walk", *_SUMMARY)
    parameters = dict.fromkeys(column for walk in table for column in walk if column not in leading)
    header = (*leading, *parameters)
    _write(path, header, ([walk.get(column, "") for column in header] for walk in table))


def _walks(folder: OutFolder, row: Row) -> list[dict[str, Any]]:
    """One dict a walk of the video, by column; one without a walk if it has none."""
    record = folder.record(row.name)
    state = "waiting" if record is None else record.state
    if record is None or not record.finished:
        return [{"name": row.name, "state": state}]
    results = folder.results(row.name)
    common = {"name": row.name, "state": state, **_summary(results / "run.json")}
    walks: dict[str, dict[str, Any]] = {}
    for cells in _read(results / "gait_parameters.csv"):
        walk = walks.setdefault(cells["walk"], {**common, "walk": cells["walk"]})
        side = f"_{cells['side']}" if cells["side"] else ""
        column = f"{cells['parameter']}{side}{_UNITS.get(cells['unit'], '')}"
        walk[column] = cells["value"]
        walk |= {f"{column}_{name}": cells[name] for name in ("ci_low", "ci_high", "n")}
    return list(walks.values()) or [common]


def _summary(path: Path) -> dict[str, Any]:
    if not path.is_file():
        return {}
    summary: Mapping[str, Any] = json.loads(path.read_text(encoding="utf-8"))["summary"]
    return {name: summary[name] for name in _SUMMARY if summary.get(name) is not None}


def _read(path: Path) -> list[dict[str, str]]:
    if not path.is_file():
        return []
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _write(path: Path, header: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)
