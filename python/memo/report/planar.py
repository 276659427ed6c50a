"""The page of `memo planar`: unnamed dots, the links found between them, and their depths in 3D."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import memo
from memo.files import read_text_columns
from memo.report.choice import Choice
from memo.report.page import Page, number, rows_table, text
from memo.report.pictures import Thinned
from memo.wording import counted

__all__ = ["planar_page"]

_BYTES = 20_000_000
_TABLES = {
    "windows.csv": (
        *("window", "start_s", "end_s", "status", "method", "planar", "refuted", "undecided"),
        *("evidence_nats", "least_nats"),
    ),
    "links.csv": ("window", "a", "b", "verdict", "length_px", "length_sd_px", "confidence"),
    "chains.csv": ("window", "chain", "verdict", "tilt_deg", "residual_px", "motion_px"),
}
_NUMBERS = (
    *("start_s", "end_s", "length_px", "length_sd_px", "confidence", "tilt_deg", "residual_px", "motion_px"),
    *("planar", "refuted", "undecided", "evidence_nats", "least_nats"),
)

Row = dict[str, Any]


def planar_page(folder: Path, choice: Choice) -> tuple[Page, dict[str, Any]]:
    """The page of a folder of `memo planar`, the number of frames in it and what could not be shown."""
    windows, links, chains = (_table(folder / name, columns) for name, columns in _TABLES.items())
    names, rows = _points(folder / "points3d.csv")
    thinned: Thinned[Row] = Thinned(_BYTES, choice.every)
    for row in rows:
        if choice.takes(row["frame"]) and thinned.wants_next():
            thinned.keep(row, len(repr(row)))
    notes = choice.told(thinned.every)
    interpreted = sum(window["status"] == "interpreted" for window in windows)
    title = folder.resolve().name
    page = Page(
        title=f"memo: {title}",
        layout="planar",
        filled={
            "version": text(memo.__version__),
            "name": text(title),
            "status": text("limbs found" if interpreted else "nothing claimed"),
            "tone": "good" if interpreted else "bad",
            "sentences": "".join(f"<p>{text(line)}</p>" for line in _sentences(windows, links, interpreted)),
            "warnings": "".join(f"<li>{text(note)}</li>" for note in notes),
            "windows": _shown("Windows in time", windows, _TABLES["windows.csv"]),
            "links": _shown("Links", links, _TABLES["links.csv"]),
            "chains": _shown("Chains of two links that swing in a plane", chains, _TABLES["chains.csv"]),
        },
        data={"names": names, "frames": thinned.items, "windows": windows, "links": links, "chains": chains},
    )
    return page, {"frames": len(thinned.items), "every": thinned.every, "notes": notes}


def _table(path: Path, columns: tuple[str, ...]) -> list[Row]:
    """Rows of a table; numbers as float, None for empty cells. ValueError names the file and the row."""
    cells = read_text_columns(path, columns)
    return [
        {name: _cell(path, line, name, row[name], name in _NUMBERS) for name in columns}
        for line, row in _rows(cells)
    ]


def _points(path: Path) -> tuple[list[str], list[Row]]:
    """Names of the points, and for each frame their u, v and depth, pixels; None if unknown."""
    cells = read_text_columns(path)
    names = [name.removesuffix("_z_px") for name in cells if name.endswith("_z_px")]
    wanted = [f"{name}_{axis}_px" for name in names for axis in "uvz"]
    absent = {"frame", "time_s", "source", *wanted} - set(cells)
    if absent or not names:
        missing = sorted(absent) or ["NAME_u_px, NAME_v_px, NAME_z_px"]
        raise ValueError(f"{path}: columns missing: {missing}")
    return names, [_point_row(path, line, row, names) for line, row in _rows(cells)]


def _rows(cells: dict[str, list[str]]) -> Iterator[tuple[int, dict[str, str]]]:
    """Number of each row, counting the header as the first, and its cells by column."""
    for line, row in enumerate(zip(*cells.values(), strict=True), start=2):
        yield line, dict(zip(cells, row, strict=True))


def _point_row(path: Path, line: int, row: dict[str, str], names: list[str]) -> Row:
    def cell(name: str) -> Any:
        return _cell(path, line, name, row[name], True)

    frame = cell("frame")
    if frame is None:
        raise ValueError(f"{path}: row {line}: frame is empty")
    return {
        "frame": int(frame),
        "time_s": cell("time_s"),
        "source": row["source"],
        "points": [[cell(f"{name}_{axis}_px") for axis in "uvz"] for name in names],
    }


def _cell(path: Path, line: int, name: str, written: str, is_number: bool) -> Any:
    if not is_number:
        return written
    if not written:
        return None
    try:
        value = float(written)
    except ValueError:
        raise ValueError(f"{path}: row {line}: {name} {written[:40]!r} is not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{path}: row {line}: {name} {written[:40]!r} is not finite")
    return value


def _sentences(windows: list[Row], links: list[Row], interpreted: int) -> list[str]:
    if not interpreted:
        return ["memo found no limb: no stretch of frames shows the joints of a body."]
    read = {window["window"] for window in windows if window["status"] == "interpreted"}
    found = {(link["a"], link["b"]) for link in links if link["window"] in read}
    return [
        f"{counted(len(found), 'link')} in {interpreted} of {counted(len(windows), 'window')}.",
        "Each chain may also be its mirror image in depth; the depth of one chain relative to another is "
        "undetermined.",
    ]


def _shown(caption: str, rows: list[Row], columns: tuple[str, ...]) -> str:
    """A table of the page; counts without decimals."""

    def cell(name: str, value: Any) -> str:
        if name not in _NUMBERS:
            return text(value)
        return number(value, 0 if name in ("planar", "refuted", "undecided") else 2)

    cells = [[cell(name, row[name]) for name in columns] for row in rows]
    return rows_table(caption, [name.replace("_", " ") for name in columns], cells)
