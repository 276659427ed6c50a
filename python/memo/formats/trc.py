"""TRC (Motion Analysis; OpenSim, Pose2Sim): marker positions as tab-separated text.

Three header rows (path; names and values of eight fields), two rows of labels, a blank row, then one row per
frame: number, time, X Y Z of every marker. Missing values are written as `NaN`, which OpenSim and programs
that split at white space can read; empty cells are read too.

The format has no field for the up axis. OpenSim's convention is Y up, the default in writing. In
reading it is the axis along which the figure stands, if its joints are known by name, else Y. Files
written here have `up=Y` in a fifth cell of the first row, which other readers skip.

Units are those of the field `Units` (m, cm, mm). The rate must agree with the column of times.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from memo.formats.motion import FormatError, Motion, Up, from_z_up, to_z_up
from memo.formats.names import standing_up
from memo.formats.reading import Given, chosen_up, unit_of
from memo.formats.text import number, numbers, read_lines, whole_number
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = ["read_trc", "write_trc"]

_FIELDS = (
    "DataRate",
    "CameraRate",
    "NumFrames",
    "NumMarkers",
    "Units",
    "OrigDataRate",
    "OrigDataStartFrame",
    "OrigNumFrames",
)


def read_trc(path: Path, given: Given) -> Motion:
    """Reads a TRC file; the header's rate and counts must agree with the rows."""
    given.check_used()
    lines = read_lines(path)
    if len(lines) < 6 or not lines[0].startswith("PathFileType"):
        raise FormatError("line 1: not a TRC file (these begin with PathFileType and five rows of header)")
    first = lines[0].split("\t")
    order = "".join(c for c in (first[2] if len(first) > 2 else "XYZ").upper() if c.isalpha())
    if order != "XYZ":
        raise FormatError(f"line 1: coordinates in the order {first[2]!r}, wanted (X/Y/Z)")
    fields = _fields(lines[1], lines[2])
    markers = whole_number(fields["NumMarkers"], "line 3, field NumMarkers", 10**6)
    names = _names(lines[3], lines[4], markers)
    unit, unit_m = unit_of(fields["Units"], "line 3, field Units")
    table = _rows(lines, names, whole_number(fields["NumFrames"], "line 3, field NumFrames"))
    times_s = table[:, 1]
    rate_hz = _checked_rate(fields, times_s)
    marked = next((cell.strip()[3:].lower() for cell in first[3:] if cell.lower().startswith("up=")), None)
    points = table[:, 2:].reshape(len(table), markers, 3) * unit_m
    up, note = chosen_up(
        given, marked, "y", "OpenSim's files have", standing_up(names, points, given.markers)
    )
    points = to_z_up(points, up)
    metadata = {"format": "trc", "up": up, "unit": unit, "rate_hz": rate_hz}
    return Motion(tuple(names), times_s, points, metadata=metadata, notes=note)


def write_trc(path: Path, motion: Motion, up: Up) -> list[str]:
    """Writes the points in metres; returns what was left out, in sentences."""
    if not motion.names:
        raise FormatError("a TRC file holds points, and there are none")
    rate_hz, motion = motion.at_constant_rate()
    for name in motion.names:
        if not name.isprintable() or name != name.strip():
            raise FormatError(f"point {name!r}: not a valid label for a TRC file")
    frames, markers = motion.points.shape[:2]
    rate = f"{rate_hz:.10g}"
    values = [rate, rate, str(frames), str(markers), "m", rate, "1", str(frames)]
    axes = [f"{axis}{k}" for k in range(1, markers + 1) for axis in "XYZ"]
    head = [
        ["PathFileType", "4", "(X/Y/Z)", path.name.replace("\t", " "), f"up={up.upper()}"],
        list(_FIELDS),
        values,
        ["Frame#", "Time", *(cell for name in motion.names for cell in (name, "", ""))],
        ["", "", *axes],
        [],
    ]
    turned = from_z_up(motion.points, up).reshape(frames, 3 * markers)
    with complete_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        file.writelines("\t".join(row) + "\n" for row in head)
        for number_, (time_s, row) in enumerate(zip(motion.times_s, turned, strict=True), 1):
            cells = ("NaN" if x != x else f"{x:.7f}" for x in row.tolist())
            file.write(f"{number_}\t{time_s:.7f}\t" + "\t".join(cells) + "\n")
    return [f"A TRC file cannot store {what}: left out." for what in _without_place(motion)]


def _without_place(motion: Motion) -> list[str]:
    return ["events"] * bool(motion.events) + ["joint angles"] * bool(motion.angles)


def _fields(keys: str, values: str) -> dict[str, str]:
    """The named values of the second and third row."""
    found = dict(zip(_cells(keys), _cells(values), strict=False))
    for name in ("NumFrames", "NumMarkers", "Units"):
        if name not in found:
            raise FormatError(f"line 2: no field {name} with a value")
    return found


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in (line.split("\t") if "\t" in line else line.split()) if cell.strip()]


def _names(labels: str, axes: str, markers: int) -> list[str]:
    cells = _cells(labels)
    if [cell.lower() for cell in cells[:2]] != ["frame#", "time"]:
        raise FormatError(f"line 4: wanted Frame#, Time and {counted(markers, 'label')}, got {cells[:3]}")
    names = cells[2:]
    if len(names) != markers:
        raise FormatError(f"line 4: {counted(len(names), 'label')}, NumMarkers is {markers}")
    given = [axis[:1].upper() for axis in _cells(axes)]
    if given != ["X", "Y", "Z"] * markers:
        raise FormatError(f"line 5: wanted X1 Y1 Z1 ... Z{markers}, got {counted(len(given), 'cell')}")
    return names


def _rows(lines: list[str], names: list[str], frames: int) -> np.ndarray:
    """(T, 2 + 3 K): frame number, time, coordinates."""
    columns = ["Frame#", "Time", *(f"{name} {axis}" for name in names for axis in "XYZ")]
    rows = []
    for index, line in enumerate(lines[5:], 6):
        if not line.strip():
            continue
        cells = line.split("\t") if "\t" in line else line.split()
        while len(cells) > len(columns) and not cells[-1].strip():
            cells.pop()
        if len(cells) != len(columns):
            raise FormatError(f"line {index}: {counted(len(cells), 'cell')}, wanted {len(columns)}")
        rows.append(numbers([cell.strip() for cell in cells], index, columns))
        if not rows[-1][1] == rows[-1][1]:
            raise FormatError(f"line {index}, column Time: empty")
        if len(rows) > 1 and not rows[-1][1] > rows[-2][1]:
            raise FormatError(f"line {index}, column Time: {cells[1]} does not come after {rows[-2][1]:g}")
    if len(rows) != frames:
        raise FormatError(
            f"line 3, field NumFrames: {frames}, but there are {counted(len(rows), 'row')} of numbers"
        )
    return np.array(rows).reshape(len(rows), len(columns))


def _checked_rate(fields: dict[str, str], times_s: np.ndarray) -> float | None:
    """DataRate, if the times agree with it within a hundredth."""
    if "DataRate" not in fields:
        return None
    rate_hz = number(fields["DataRate"], "line 3, field DataRate")
    if not rate_hz > 0:
        raise FormatError(f"line 3, field DataRate: {fields['DataRate']} is not a rate")
    if len(times_s) > 1:
        timed_hz = 1 / float(np.median(np.diff(times_s)))
        # Times with three decimals are off by up to a millisecond from frame to frame.
        if abs(1 / timed_hz - 1 / rate_hz) > 0.01 / rate_hz + 1e-3:
            raise FormatError(
                f"line 3, field DataRate: {rate_hz:g} Hz, but the column Time has {timed_hz:.4g} Hz"
            )
    return rate_hz
