"""The tables over all videos: the state of each, and the gait parameters of every walk."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from memo.batch.folder import BatchError, OutFolder
from memo.batch.manifest import Row
from memo.camera_motion import outcome
from memo.files import read_text_columns
from memo.gait import GAIT_COLUMNS
from memo.spreadsheet import write_rows

__all__ = ["STATUS_COLUMNS", "write_status", "write_table"]

STATUS_COLUMNS = ("name", "state", "walks", "attempt", "seconds", "message", "remarks", "video")
"""Columns of `status.csv`, in order; a state is one of `STATES`, or `waiting`."""

_UNITS = {"1/min": "_per_min", "m": "_m", "s": "_s", "m/s": "_mps", "%": "_percent", "deg": "_deg", "": ""}
_LEADING = (
    *("name", "state", "walk", "person", "height_m", "camera_given", "camera_motion", "left_out"),
    *("start_s", "end_s", "direction", "gait", "p_swapped", "fits"),
)


def write_status(folder: OutFolder, rows: Sequence[Row], path: Path) -> None:
    """Writes `status.csv`: every video of the manifest, in its order."""
    cells: list[list[Any]] = []
    for row in rows:
        record = folder.record(row.name)
        if record is None:
            cells.append([row.name, "waiting", "", "", "", "", "", str(row.video)])
        else:
            walks = "" if record.walks is None else record.walks
            told = (f"{record.seconds:.1f}", record.message, "; ".join(record.remarks))
            cells.append([row.name, record.state, walks, record.attempt, *told, str(row.video)])
    _write(path, STATUS_COLUMNS, cells)


def write_table(folder: OutFolder, rows: Sequence[Row], path: Path) -> dict[str, str]:
    """Writes the `gait_parameters.csv` of all videos: one row per walk, or one for a video without walks.

    A parameter has columns such as `stride_time_right_s`, and with `_ci_low`, `_ci_high` (95 %) and `_n`.
    Returns the videos whose results cannot be read, with the reason: their rows have name and state only.
    """
    table: list[dict[str, Any]] = []
    unreadable: dict[str, str] = {}
    for row in rows:
        record = folder.record(row.name)
        common = {"name": row.name, "state": "waiting" if record is None else record.state}
        walks = [common]
        if record is not None and record.finished:
            try:
                walks = _walks(folder.results(row.name), common, asked=record.state != "elsewhere")
            except OSError as error:
                unreadable[row.name] = f"{error.filename or folder.results(row.name)}: {error.strerror}"
            except ValueError as error:
                unreadable[row.name] = str(error)
        table += walks
    parameters = dict.fromkeys(column for walk in table for column in walk if column not in _LEADING)
    header = (*_LEADING, *parameters)
    _write(path, header, ([walk.get(column, "") for column in header] for walk in table))
    return unreadable


def _walks(results: Path, common: dict[str, Any], *, asked: bool) -> list[dict[str, Any]]:
    """One dict per walk of the video, by column; one without a walk if it has none that was asked for."""
    given, seen = _run(results / "run.json")
    common = {**common, **given}
    if not asked:
        return [common]
    walks: dict[str, dict[str, Any]] = {}
    lines = read_text_columns(results / "gait_parameters.csv", GAIT_COLUMNS, {"person": "walk"})
    for walk, person, parameter, side, value, unit, low, high, n in zip(*lines.values(), strict=True):
        column = f"{parameter}{'_' if side else ''}{side}{_UNITS.get(unit, '')}"
        cells = {column: value, f"{column}_ci_low": low, f"{column}_ci_high": high, f"{column}_n": n}
        walks.setdefault(walk, {**common, "walk": walk, "person": person, **seen.get(walk, {})}).update(cells)
    return list(walks.values()) or [common]


def _run(path: Path) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """Values common to all walks of a video; and times and direction of each walk, by its number."""
    try:
        run = json.loads(path.read_text(encoding="utf-8"))
        height_m = run["options"]["height_m"]
        several = isinstance(height_m, list)
        summary = run.get("summary") or {}
        given = {
            "height_m": ",".join(map(str, height_m)) if several else height_m,
            "camera_given": "yes" if run["camera_given"] else "no",
            "camera_motion": outcome(summary["camera_motion"]) if "camera_motion" in summary else "",
            "left_out": summary.get("left_out", ""),
        }
        seen = {
            str(number): {
                **{name: _seconds(walk.get(name)) for name in ("start_s", "end_s")},
                "direction": walk["direction"],
                "gait": walk["gait"],
                "p_swapped": f"{walk['p_swapped']:.6f}",
                "fits": _fits(walk.get("fit")),
                **({"height_m": f"{walk['height_m']:.3f}"} if several else {}),
            }
            for number, walk in enumerate(run["walks"])
        }
        return given, seen
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BatchError(f"{path}: not in the format of memo track: {error!r}") from None


def _fits(fit: dict[str, Any] | None) -> str:
    """The verdict on the fit of a walk; empty for results of older versions, which do not have it."""
    if fit is None:
        return ""
    return str(fit["fits"]) if fit["measured"] else "not measured"


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"


def _write(path: Path, header: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    # A file name that is not UTF-8 is written as Python escapes it.
    with open(path, "w", newline="", encoding="utf-8", errors="backslashreplace") as file:
        write_rows(file, chain([header], rows))
