"""Two walks compared: differences of gait parameters and of mean gait cycles, with their 95 % intervals.

The interval of a difference combines those of the two walks as independent errors. For two walks of one
person before one camera it is too wide, because such walks share the error of the height and most of that of
the body. A difference whose interval touches zero cannot be told. Curves of hip and knee are judged; those of
the other joints have larger errors than their intervals state.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from memo.cycles import mean_cycle
from memo.files import ANGLES, SIDES
from memo.gait import GAIT_COLUMNS, digits_of
from memo.wording import shows_zero

__all__ = [
    "JUDGED",
    "LEAST_SHARE",
    "CurveDifference",
    "ParameterDifference",
    "curve_differences",
    "difference_sentences",
    "parameter_differences",
]

JUDGED = ("hip", "knee")
"""Joints whose intervals hold: tests/score_cycles.py."""

LEAST_SHARE = 0.1
"""A difference of curves over a smaller share of the cycle may be chance, because a cycle has many points."""

Table = Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class ParameterDifference:
    """One gait parameter of two walks; the rows have the columns of `gait_parameters.csv`."""

    first: Mapping[str, Any]
    second: Mapping[str, Any]

    @property
    def value(self) -> float:
        """Second less first, in their unit; NaN if one was not measured."""
        return float(self.second["value"] - self.first["value"])

    @property
    def half(self) -> float:
        """Half the 95 % interval."""
        halves = [  # one end may be that of what is possible
            np.maximum(row["ci_high"] - row["value"], row["value"] - row["ci_low"])
            for row in (self.first, self.second)
        ]
        return float(np.hypot(*halves))

    @property
    def is_sure(self) -> bool:
        """Whether the interval excludes zero, also as it is printed."""
        least = abs(self.value) - self.half
        return least > 0 and not shows_zero(least, self.digits)

    @property
    def digits(self) -> int:
        """Decimals that are printed."""
        return digits_of(str(self.first["unit"]))

    @property
    def is_of_a_side(self) -> bool:
        """Whether it is another one if left and right are exchanged."""
        return str(self.first["side"]) != "" or self.is_symmetry

    @property
    def is_symmetry(self) -> bool:
        """Whether its sign says which side has more."""
        return str(self.first["parameter"]).endswith("_symmetry")


@dataclass(frozen=True)
class CurveDifference:
    """The mean cycle of one joint and side in two walks, degrees; second less first."""

    side: str
    joint: str
    values_deg: npt.NDArray[np.float64]
    """At 0 to 100 % of the cycle; NaN where one of them was not measured."""
    half_deg: npt.NDArray[np.float64]
    """Half the 95 % interval."""

    @property
    def rms_deg(self) -> float:
        """Root mean square over the cycle."""
        return float(np.sqrt(np.nanmean(self.values_deg**2)))

    @property
    def sure_share(self) -> float:
        """Share of the measured points whose interval excludes zero."""
        known = np.isfinite(self.values_deg)
        return float(np.mean(np.abs(self.values_deg[known]) > self.half_deg[known]))

    @property
    def is_sure(self) -> bool:
        """Whether the walks differ in a joint that is judged, by an interval that excludes zero also as it is
        printed, for long enough that it is not chance."""
        if self.joint not in JUDGED or self.sure_share < LEAST_SHARE:
            return False
        _, value, half = self.largest
        return not shows_zero(abs(value) - half, 0)

    @property
    def largest(self) -> tuple[int, float, float]:
        """Per cent of the cycle, difference and half its interval where the sure difference is largest."""
        sure = np.where(np.abs(self.values_deg) > self.half_deg, np.abs(self.values_deg), -1.0)
        percent = int(np.argmax(sure))
        return percent, float(self.values_deg[percent]), float(self.half_deg[percent])


def parameter_differences(first: Table, second: Table, walks: tuple[int, int]) -> list[ParameterDifference]:
    """The gait parameters of two walks, one of each table, in the order of `gait_parameters.csv`."""
    rows = [_rows(table, walk) for table, walk in zip((first, second), walks, strict=True)]
    return [ParameterDifference(row, rows[1][key]) for key, row in rows[0].items() if key in rows[1]]


def _rows(table: Table, walk: int) -> dict[tuple[str, str], dict[str, Any]]:
    """The rows of a walk by parameter and side."""
    found = {}
    for row in np.flatnonzero(table["walk"] == walk):
        line = {name: table[name][row] for name in GAIT_COLUMNS}
        if line["parameter"] == "speed" and line["value"] < 0:  # backwards
            ends = {"ci_low": -line["ci_high"], "ci_high": -line["ci_low"]}
            line |= {"value": -line["value"], **ends}
        found[str(line["parameter"]), str(line["side"])] = line
    return found


def curve_differences(first: Table, second: Table, walks: tuple[int, int]) -> list[CurveDifference]:
    """The mean cycles of a walk of each table of `cycles.csv` that both walks have, right before left."""
    found = []
    for side in SIDES:
        for joint in ANGLES:
            means = [
                mean_cycle(table, walk, side, joint)
                for table, walk in zip((first, second), walks, strict=True)
            ]
            values = means[1]["angle_deg"] - means[0]["angle_deg"]
            if np.isfinite(values).any():
                halves = [(mean["ci_high_deg"] - mean["ci_low_deg"]) / 2 for mean in means]
                found.append(CurveDifference(side, joint, values, np.hypot(*halves)))
    return found


def difference_sentences(
    names: tuple[str, str], parameters: Iterable[ParameterDifference], curves: Iterable[CurveDifference]
) -> list[str]:
    """Reports only differences that are sure; one sentence if there are none."""
    said = []
    for one in (one for one in parameters if one.is_sure):
        row, size, digits = one.first, abs(one.value), one.digits
        unit = {"deg": "°", "": "", "1/min": " per minute"}.get(str(row["unit"]), f" {row['unit']}")
        side = f", {row['side']}" if row["side"] else ""
        name = f"{str(row['parameter']).replace('_', ' ').capitalize()}{side}"
        by = f"{size:.{digits}f}{unit} ({size - one.half:.{digits}f} to {size + one.half:.{digits}f})"
        if one.is_symmetry:
            values = zip((row["value"], one.second["value"]), names, strict=True)
            each = " and ".join(f"{value:+.{digits}f}{unit} in {name}" for value, name in values)
            said.append(f"{name}: {each}, a difference of {by}.")
        else:
            larger = "larger" if one.value > 0 else "smaller"
            said.append(f"{name}: {by} {larger} in {names[1]} than in {names[0]}.")
    for curve in (curve for curve in curves if curve.is_sure):
        percent, value, half = curve.largest
        said.append(
            f"The {curve.side} {curve.joint} is {abs(value):.0f}° ({abs(value) - half:.0f} to "
            f"{abs(value) + half:.0f}) {'more' if value > 0 else 'less'} flexed in {names[1]} than in "
            f"{names[0]} at {percent}% of the cycle; its interval excludes zero for "
            f"{curve.sure_share:.0%} of it."
        )
    return said or ["No difference between the two walks can be told."]
