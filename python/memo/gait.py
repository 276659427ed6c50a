"""Gait parameters of walks: the table, the definitions of its rows, and sentences about them.

The core computes the numbers (`memo_core::track::gait_parameters`). All intervals are 95 % intervals for
the height: given, known to 2 cm, measured or assumed. Lengths scale with it. They describe the person's
walking, of which the visible steps are a sample; the mean of just these steps is known better. Their
coverage is measured on drawn people who vary as real people do (`tests/gait_parameters.rs` of the core).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import count
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo.files import read_typed_columns, write_columns_csv
from memo.wording import shows_zero

if TYPE_CHECKING:
    from memo._memo import GaitParameter

__all__ = [
    "DEFINITIONS",
    "GAIT_COLUMNS",
    "cadence_sentences",
    "digits_of",
    "gait_table",
    "read_gait_parameters_csv",
    "symmetry_sentences",
    "write_gait_parameters_csv",
]

GAIT_COLUMNS = ("walk", "person", "parameter", "side", "value", "unit", "ci_low", "ci_high", "n")
"""Columns of `gait_parameters.csv`, in order; an empty cell means unknown."""

DEFINITIONS: dict[str, str] = {
    "cadence": "Steps per minute. Measured: the rate of the gait phase over all frames of the walk. "
    "Interval: scatter of the frames about that rate, each step one independent observation, or "
    "that of steps that vary by 3 %, whichever is larger.",
    "speed": "Speed of the trunk along its straight path, negative when walking backwards; on a treadmill "
    "relative to the belt, whose speed is measured from the feet in stance. Measured: the "
    "rate of its position over all frames. Interval: scatter as for cadence, and the scale (distance from "
    "the camera, estimated from the person's height in the picture; without a camera file also the assumed "
    "field of view, as far as the path runs along the line of sight).",
    "stride_time": "Duration of a cycle of two steps, 120 / cadence. Measured.",
    "stride_length": "Distance covered by the trunk in a cycle (on a treadmill: on the belt), speed "
    "times stride time. Measured; interval "
    "with the scale.",
    "step_time": "From the other foot's heel strike to this side's; without a side, half the stride "
    "time. Measured between the initial contacts of the fitted feet, as in events.csv. Interval: scatter "
    "over the steps (Student's t, with a prior scatter of 3 % "
    "that counts as 4 steps), and the asymmetry of people's heel strikes relative to the average gait.",
    "step_length": "Distance covered by the trunk from the other foot's heel strike to this side's; without "
    "a side, half the stride length. The model's feet land equally far ahead of the trunk, so a difference "
    "in the reach of the two feet is not measured; the interval allows for 1.2 cm of it, besides the "
    "intervals of step_time and speed.",
    "step_time_symmetry": "100 (right - left) / mean of the two step times; 0 is symmetric, positive "
    "when the right step takes longer. Interval as for the sides; small asymmetries are not resolved.",
    "step_length_symmetry": "100 (right - left) / mean of the two step lengths; 0 is symmetric, positive "
    "when the right step is longer. Only the part of a difference that affects the timing of the steps is "
    "measured.",
    "stance": "Share of the cycle in which a foot is on the ground: from the initial contact to the toe-off "
    "of the fitted foot, of each side and of both together. Interval: scatter over the steps, errors that a "
    "person's contacts have in common (21 ms) and toe-offs (55 ms, because shoes bend at the toes and the "
    "model's foot does not), and by side 6.5 ms of that side's own.",
    "swing": "Share of the cycle in which a foot is off the ground, 100 - stance.",
    "single_support": "Share of the cycle in which one foot alone is on the ground, 100 - double_support; by "
    "side, in which that foot is, the other's swing. Without a side it is the sum of both sides; stance and "
    "swing are their means.",
    "double_support": "Share of the cycle in which both feet are on the ground, 2 stance - 100; empty where "
    "that is below 0.",
    "hip_range": "Range of the thigh's angle against the vertical over at least one cycle, degrees.",
    "knee_range": "Range of the knee's flexion over at least one cycle, degrees.",
    "knee_peak": "Largest flexion of the knee, degrees.",
}
"""Definition of every parameter: what it is, whether it is measured, and what its interval covers."""

SYMMETRY = "step_time_symmetry", "step_length_symmetry"

Table = dict[str, npt.NDArray[Any]]


def gait_table(
    walks: Iterable[Iterable[GaitParameter]],
    people: Iterable[int] | None = None,
) -> Table:
    """The columns of `gait_parameters.csv` from the core's rows, one walk after another.

    `people` are the numbers of the persons of the walks, by default another one each.
    """
    lines = [
        (walk, person, line.parameter, line.side, line.value, line.unit, line.low, line.high, line.n)
        for (walk, table), person in zip(enumerate(walks), people or count(), strict=False)
        for line in table
    ]
    kinds: tuple[Any, ...] = (np.int64, np.int64, object, object, float, object, float, float, np.int64)
    columns = list(zip(*lines, strict=True)) or [()] * len(GAIT_COLUMNS)
    return {
        name: np.array(column, dtype=kind)
        for name, column, kind in zip(GAIT_COLUMNS, columns, kinds, strict=True)
    }


def lookup(
    table: Mapping[str, npt.NDArray[Any]], walk: int, parameter: str, side: str = ""
) -> dict[str, Any]:
    """One row of the table as a dict of its columns."""
    here = (table["walk"] == walk) & (table["parameter"] == parameter) & (table["side"] == side)
    return {name: table[name][here][0] for name in GAIT_COLUMNS}


_STEADY = 0.2


def digits_of(unit: str) -> int:
    """Digits after the point of a gait parameter in this unit."""
    return 1 if unit in ("%", "1/min", "deg") else 3


def cadence_sentences(table: Mapping[str, npt.NDArray[Any]], walk: int) -> list[str]:
    """Warns of a walk whose steps were hardly visible: its cadence is known to no better than a fifth."""
    cadence = lookup(table, walk, "cadence")
    value, low, high = (float(cadence[name]) for name in ("value", "ci_low", "ci_high"))
    if not high - low > 2 * _STEADY * value:  # also if it is unknown
        return []
    return [
        f"Its steps were hardly visible (95 % interval {max(low, 0):.0f} to {high:.0f} per minute): use no "
        "gait parameter of this walk."
    ]


def symmetry_sentences(table: Mapping[str, npt.NDArray[Any]], walk: int) -> list[str]:
    """Reports a difference between the sides, only if its interval excludes zero, also as it is printed."""
    said = []
    for parameter, unit, per_unit, digits in (("step_length", "cm", 100, 0), ("step_time", "s", 1, 2)):
        symmetry = lookup(table, walk, f"{parameter}_symmetry")
        if not symmetry["ci_low"] * symmetry["ci_high"] > 0:
            continue
        right, left = (lookup(table, walk, parameter, side)["value"] for side in ("right", "left"))
        less, more = ("left", "right") if right > left else ("right", "left")
        by = per_unit * abs(right - left)
        ends = sorted(abs(symmetry[end]) * (right + left) / 200 * per_unit for end in ("ci_low", "ci_high"))
        if shows_zero(ends[0], digits):
            continue
        said.append(
            f"The {less} step {'is' if unit == 'cm' else 'takes'} {by:.{digits}f} {unit} "
            f"{'shorter' if unit == 'cm' else 'less'} than the {more} "
            f"({ends[0]:.{digits}f} to {ends[1]:.{digits}f})."
        )
    return said


def write_gait_parameters_csv(path: str | PathLike[str], table: Mapping[str, npt.ArrayLike]) -> None:
    """Writes the columns of a table of gait parameters, which must be `GAIT_COLUMNS`."""
    absent, unknown = set(GAIT_COLUMNS) - set(table), set(table) - set(GAIT_COLUMNS)
    if absent or unknown:
        raise ValueError(f"gait parameters: missing {sorted(absent)}, unknown {sorted(unknown)}")
    write_columns_csv(path, {name: table[name] for name in GAIT_COLUMNS})


def read_gait_parameters_csv(path: str | PathLike[str]) -> Table:
    """Reads what `write_gait_parameters_csv` wrote; NaN for empty numbers, whole numbers as int64.

    Tables of older runs have no column `person`: every walk is another person's.
    """
    texts = ("parameter", "side", "unit")
    return read_typed_columns(
        path, GAIT_COLUMNS, whole=("walk", "person", "n"), texts=texts, instead={"person": "walk"}
    )
