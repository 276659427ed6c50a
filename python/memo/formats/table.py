"""Tables of joints: CSV with one header row, `<joint>_x_m`, `<joint>_y_m`, `<joint>_z_m` and `<angle>_deg`.

Times are the column `time_s`, or follow from a rate in a comment ("# metres, Z up, 100 Hz") or from the
caller. Z is up, as in all tables of memo, unless a comment before the header says `Y up`; with Y up such
a comment is written, with Z up none, so that any program reads the file. Empty cells are missing.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np

from memo.files import complete_file
from memo.formats.motion import FormatError, Motion, Up, from_z_up, to_z_up
from memo.formats.reading import Given, chosen_up
from memo.formats.text import MAX_TEXT_BYTES
from memo.linkage import read_number_table

__all__ = ["read_table", "write_table"]


def read_table(path: Path, given: Given) -> Motion:
    """Reads points and angles of a table; other columns are passed over."""
    if path.stat().st_size > MAX_TEXT_BYTES:
        raise FormatError(f"more than the {MAX_TEXT_BYTES >> 20} MiB that are read")
    try:
        table = read_number_table(path)
        angles = {
            name.removesuffix("_deg"): table.numbers[:, index]
            for name, index in table.column.items()
            if name.endswith("_deg") and name != "_deg"
        }
        names, points = table.points(3)
        times_s = table.times_s(given.rate_hz)
    except ValueError as error:
        raise FormatError(str(error).removeprefix(f"{path}: ")) from None
    said = re.search(r"\b([yz])[ -]up\b", "\n".join(table.comments), re.IGNORECASE)
    up, _ = chosen_up(given, said.group(1) if said else "z", "z", "memo's tables have")
    return Motion(
        tuple(names),
        times_s,
        to_z_up(points, up),
        angles=angles,
        metadata={"format": "csv", "up": up, "unit": "m"},
    )


def write_table(path: Path, motion: Motion, up: Up) -> list[str]:
    """Writes points and angles with six digits after the point; returns what was left out, in sentences."""
    if not motion.names:
        raise FormatError(
            "a table of joints holds points, and there are none: write angles to a .mot or .sto file"
        )
    for name in (*motion.names, *motion.angles):
        if not name.isprintable():
            raise FormatError(f"{name!r} is no name for a column")
    columns = {f"{name}_deg": values for name, values in motion.angles.items()}
    turned = from_z_up(motion.points, up)
    for k, name in enumerate(motion.names):
        columns |= {f"{name}_{axis}_m": turned[:, k, i] for i, axis in enumerate("xyz")}
    table = np.column_stack(list(columns.values()))
    with complete_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        if up != "z":
            file.write("# metres, Y up\n")
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["frame", "time_s", *columns])
        for frame in range(len(table)):
            cells = ("" if x != x else f"{x:.6f}" for x in table[frame].tolist())
            rows.writerow([frame, f"{motion.times_s[frame]:.6f}", *cells])
    return ["A table of joints has no place for events: left out."] if motion.events else []
