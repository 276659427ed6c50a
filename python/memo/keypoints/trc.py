"""TRC with image points in pixels and depths of zero, as Sports2D writes it (`*_px_*.trc`).

Sports2D writes `m` as the unit of pixels too: in this case the file's name, or the name in its first line,
shows that they are pixels. A TRC file of points in space is refused here.
"""

from __future__ import annotations

import math
from pathlib import Path

from memo.keypoints.found import Found, check_all_placed
from memo.keypoints.points import Keypoints, KeypointsError, Source
from memo.keypoints.table import Columns, joint_of, number_of, row_frames, set_cells, wide_people
from memo.keypoints.text import content_of, short, write_text
from memo.wording import counted

__all__ = ["is_trc", "read_trc"]

_HEADER_LINES = 5


def is_trc(content: str) -> bool:
    """Whether this is a TRC file, in pixels or not."""
    return content.startswith("PathFileType")


def read_trc(path: Path, content: str) -> Found:
    """The one person of a TRC file in pixels."""
    rows, columns = _table(path, content)
    frames, times_s = row_frames(path, rows, columns)
    people = wide_people(path, rows, columns, frames)
    if len(set(frames.values())) < len(frames):
        raise KeypointsError(f"{path}: a frame appears twice")
    return Found(Source(path, _write_like), people, columns.names, times_s, frames=tuple(frames.values()))


def _table(path: Path, content: str) -> tuple[list[list[str]], Columns]:
    """The rows by line, the header lines empty, and the columns; refused if they are not image points."""
    lines = [line.rstrip("\r").split("\t") for line in content.split("\n")]
    if len(lines) < _HEADER_LINES:
        raise KeypointsError(
            f"{path}: a TRC file of {counted(len(lines), 'line')}; its header alone has {_HEADER_LINES}"
        )
    facts = {name.strip(): value.strip() for name, value in zip(lines[1], lines[2], strict=False)}
    markers = lines[3][2::3]
    while markers and not markers[-1].strip():
        markers.pop()
    columns = _columns(path, markers)
    _check_pixels(path, facts.get("Units", ""), lines[0][-1])
    width = 2 + 3 * len(markers)
    rows: list[list[str]] = [[]] * _HEADER_LINES
    for number, cells in enumerate(lines[_HEADER_LINES:], start=_HEADER_LINES + 1):
        if not any(cell.strip() for cell in cells):
            rows.append([])
            continue
        where = f"{path}: line {number}"
        if len(cells) < width or any(cell.strip() for cell in cells[width:]):
            raise KeypointsError(
                f"{where} has {counted(len(cells), 'cell')};"
                f" {width} for {counted(len(markers), 'point')} are wanted"
            )
        depths = {number_of(cell, where) for cell in cells[4:width:3] if cell.strip()}
        if depths - {0.0} and not all(map(math.isnan, depths - {0.0})):
            raise KeypointsError(f"{where}: these are points in space, not image points")
        rows.append(cells)
    return rows, columns


def _columns(path: Path, markers: list[str]) -> Columns:
    found: dict[str, tuple[int, int, int | None]] = {}
    for index, marker in enumerate(markers):
        name = joint_of(path, marker.strip()) if marker.strip() else None
        if name in found:
            raise KeypointsError(f"{path}: {short(marker)}: {name} appears twice")
        if name is not None:
            found[name] = (2 + 3 * index, 3 + 3 * index, None)
    if not found:
        raise KeypointsError(f"{path}: no joint in its fourth line, such as RKnee")
    return Columns(0, 1, None, tuple(found), tuple(found.values()), None)


def _check_pixels(path: Path, unit: str, own_name: str) -> None:
    if unit.lower() in ("px", "pixel", "pixels") or "_px" in path.name or "_px" in own_name:
        return
    raise KeypointsError(
        f"{path}: unit {short(unit)}: image points are needed; those of Sports2D have _px in the file's name"
    )


def _write_like(out: Path, keypoints: Keypoints) -> None:
    check_all_placed(keypoints)
    source = keypoints.source
    content = content_of(source.path)
    if not is_trc(content):
        raise KeypointsError(f"{source.path}: has changed since it was read: it is no longer a TRC file")
    rows, columns = _table(source.path, content)
    if columns.names != keypoints.names:
        raise KeypointsError(f"{source.path}: has changed since it was read: other joints")
    for row, line in enumerate(source.places):
        if line is not None:
            set_cells(rows, columns, keypoints, row, line, {})
    ends = "\r\n" if "\r\n" in content else "\n"
    lines = content.replace("\r\n", "\n").split("\n")
    write_text(
        out, ends.join("\t".join(cells) if cells else line for cells, line in zip(rows, lines, strict=True))
    )
