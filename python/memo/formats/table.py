"""Tables of joints: CSV with one header row, `<joint>_x_m`, `<joint>_y_m`, `<joint>_z_m` and `<angle>_deg`.

Clinical hip angles (`memo convert --clinical`) are `right_hip_clinical_deg`, so that nobody takes them for
those against the vertical.

Times are in the column `time_s`, or follow from a rate in a comment ("# metres, Z up, 100 Hz") or from
the caller. Z is up, as in all tables of memo, unless a comment before the header says `Y up`. This comment
is written only with Y up, so that any program can read files with Z up. Empty cells are missing.

Tables of other programs (FreeMoCap, anipose) name their columns `<joint>_x`, without a unit: it is the one
that gives the legs a human length, metres if there are none. Up is the axis along which the figure stands,
else Z. Both are reported.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
import numpy.typing as npt

from memo.formats.clinical import CLINICAL, CLINICAL_HIP
from memo.formats.motion import FormatError, Motion, Up, from_z_up, to_z_up
from memo.formats.names import joint_places, standing_up
from memo.formats.reading import METRIC_M, Given, chosen_up, unit_of_legs
from memo.spreadsheet import write_rows
from memo.table import NumberTable, read_number_table
from memo.unfinished import complete_file

__all__ = ["motion_columns", "motion_of_table", "read_table", "write_table"]

_MOST_FRAMES = 1 << 53  # larger whole numbers are not exact in the table


def read_table(path: Path, given: Given) -> Motion:
    """Reads points and angles of a table; other columns are ignored."""
    given.check_used("rate_hz", "unit_m")
    try:
        return motion_of_table(read_number_table(path), given)
    except ValueError as error:
        raise FormatError(str(error).removeprefix(f"{path}: ")) from None


def motion_of_table(table: NumberTable, given: Given) -> Motion:
    """The motion in a table of columns as named by `motion_columns`, from any kind of file."""
    angles = {
        name.removesuffix("_deg"): table.numbers[:, index]
        for name, index in table.column.items()
        if name.endswith("_deg") and name != "_deg"
    }
    hips = {f"{side}_hip{CLINICAL}": f"{side}_hip" for side in ("right", "left")}
    hips = {column: hip for column, hip in hips.items() if column in angles and hip not in angles}
    angles = {hips.get(name, name): values for name, values in angles.items()}
    references = {"references": dict.fromkeys(hips.values(), CLINICAL_HIP)} if hips else {}
    names, points = table.points(3)
    comments = "\n".join(table.comments)
    said = re.search(r"\b([yz])[ -]up\b", comments, re.IGNORECASE)
    names_unit = f"{names[0]}_x_m" in table.column
    stated = said.group(1) if said else "z" if names_unit else None
    stands = standing_up(names, points, given.markers)
    up, notes = chosen_up(given, stated, "z", "memo's tables have", stands)
    unit_m = 1.0
    if names_unit:
        if given.unit_m is not None:
            raise FormatError("the columns name their unit: leave out a unit (--unit)")
    elif given.unit_m is not None:
        unit_m = given.unit_m
    elif not re.search(r"\bmet(er|re)s\b", comments, re.IGNORECASE):
        unit_m, note = unit_of_legs(_leg(names, points, given.markers), METRIC_M, "m")
        notes = (*notes, note)
    return Motion(
        tuple(names),
        table.times_s(given.rate_hz),
        to_z_up(points * unit_m, up),
        angles=angles,
        metadata={"format": "csv", "up": up, "unit": "m", **references},
        notes=notes,
        frames=_frames(table),
    )


def _frames(table: NumberTable) -> npt.NDArray[np.int64] | None:
    """The column `frame`, if it holds whole numbers that increase."""
    if "frame" not in table.column:
        return None
    numbers = table.numbers[:, table.column["frame"]]
    are_whole = (numbers == np.round(numbers)) & (np.abs(numbers) < _MOST_FRAMES)
    return numbers.astype(np.int64) if are_whole.all() and (np.diff(numbers) > 0).all() else None


def _leg(
    names: list[str], points: npt.NDArray[np.float64], markers: Mapping[str, Sequence[str]] | None
) -> float | None:
    """Length of thigh and shank in the file's unit, the median over time; None if unknown."""
    found = joint_places(names, markers)
    for side in ("right", "left"):
        chain = [f"{side}_{part}" for part in ("hip", "knee", "ankle")]
        if all(joint in found for joint in chain):
            joints = np.stack([points[:, found[joint]].mean(axis=1) for joint in chain], axis=1)
            parts = np.diff(joints, axis=1)
            lengths = np.linalg.norm(parts, axis=2).sum(axis=1)
            if np.isfinite(lengths).any():
                return float(np.nanmedian(lengths))
    return None


def write_table(path: Path, motion: Motion, up: Up) -> list[str]:
    """Writes points and angles with six decimals; returns what was left out, in sentences."""
    if not motion.names:
        raise FormatError(
            "a table of joints holds points, and there are none: write angles to a .mot or .sto file"
        )
    for name in (*motion.names, *motion.angles):
        if not name.isprintable():
            raise FormatError(f"{name!r} is not a valid column name")
    columns = motion_columns(motion, up)
    table = np.column_stack([columns[name] for name in columns if name != "time_s"])
    with complete_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        if up != "z":
            file.write("# metres, Y up\n")
        frames = np.arange(len(table)) if motion.frames is None else motion.frames
        rows = (
            [frame, f"{time_s:.6f}", *("" if x != x else f"{x:.6f}" for x in row)]
            for frame, time_s, row in zip(frames.tolist(), motion.times_s, table.tolist(), strict=True)
        )
        write_rows(file, chain([["frame", *columns]], rows))
    return ["A table of joints cannot store events: left out."] if motion.events else []


def motion_columns(motion: Motion, up: Up) -> dict[str, npt.NDArray[np.float64]]:
    """The columns of a table of the motion, (T,) each, `time_s` first, for all tabular formats."""
    references = motion.metadata.get("references", {})
    columns = {"time_s": motion.times_s}
    for name, values in motion.angles.items():
        columns[f"{name}{CLINICAL if references.get(name) == CLINICAL_HIP else ''}_deg"] = values
    turned = from_z_up(motion.points, up)
    for k, name in enumerate(motion.names):
        columns |= {f"{name}_{axis}_m": turned[:, k, i] for i, axis in enumerate("xyz")}
    return columns
