"""Gait cycles of walks: the table of `cycles.csv`, and sentences about departures from average walking.

The core computes the numbers (`memo_core::track::cycles` and `memo_core::track::normal_gait`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import count
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo.files import ANGLES, read_typed_columns, write_columns_csv
from memo.wording import shows_zero

if TYPE_CHECKING:
    from memo._memo import Departure, GaitCycle

__all__ = [
    "CYCLE_COLUMNS",
    "cycle_table",
    "departure_sentences",
    "mean_cycle",
    "read_cycles_csv",
    "write_cycles_csv",
]

_VALUES = ("angle_deg", "sd_deg", "cycle_sd_deg", "ci_low_deg", "ci_high_deg", "n")

CYCLE_COLUMNS = ("walk", "person", "side", "joint", "curve", "cycle", "start_s", "end_s", "percent", *_VALUES)
"""Columns of `cycles.csv`, in order; an empty cell means unknown."""

_POINTS = 101
_WHOLE = ("walk", "person", "percent", "n")
_TEXTS = ("side", "joint", "curve")


def cycle_table(
    walks: Iterable[Iterable[GaitCycle]], people: Iterable[int] | None = None
) -> dict[str, npt.NDArray[Any]]:
    """The columns of `cycles.csv` from the curves of each walk, as `_memo.Walk.cycles` gives them.

    `people` are the numbers of the persons of the walks, by default another one each.
    """
    blocks: list[dict[str, npt.NDArray[Any]]] = []
    for (walk, curves), person in zip(enumerate(walks), people or count(), strict=False):
        counts: dict[str, int] = {}
        for found in curves:
            side, curve, values = found.side, found.curve, found.values
            cycle = float("nan") if curve == "mean" else counts.setdefault(side, 0)
            counts[side] = counts.get(side, 0) + 1
            joints, points, _ = values.shape
            alike = {"walk": walk, "person": person, "side": side, "curve": curve, "cycle": cycle}
            block = {name: np.full(joints * points, value) for name, value in alike.items()}
            block |= {name: np.full(joints * points, getattr(found, name)) for name in ("start_s", "end_s")}
            block["joint"] = np.repeat(ANGLES, points)
            block["percent"] = np.tile(np.arange(points), joints)
            block |= dict(zip(_VALUES, values.reshape(-1, len(_VALUES)).T, strict=True))
            blocks.append(block)
    return {
        name: np.concatenate([np.empty(0), *(block[name] for block in blocks)]).astype(_kind(name))
        if name not in _TEXTS
        else np.array([text for block in blocks for text in block[name].tolist()], dtype=object)
        for name in CYCLE_COLUMNS
    }


def _kind(name: str) -> type:
    return np.int64 if name in _WHOLE else np.float64


def write_cycles_csv(path: str | PathLike[str], table: Mapping[str, npt.ArrayLike]) -> None:
    """Writes the columns of a table of cycles, which must be `CYCLE_COLUMNS`."""
    absent, unknown = set(CYCLE_COLUMNS) - set(table), set(table) - set(CYCLE_COLUMNS)
    if absent or unknown:
        raise ValueError(f"cycles: missing {sorted(absent)}, unknown {sorted(unknown)}")
    write_columns_csv(path, {name: table[name] for name in CYCLE_COLUMNS})


def read_cycles_csv(path: str | PathLike[str]) -> dict[str, npt.NDArray[Any]]:
    """Reads what `write_cycles_csv` wrote; NaN for empty numbers, whole numbers as int64.

    Tables of older runs have no column `person`: every walk is another person's.
    """
    return read_typed_columns(path, CYCLE_COLUMNS, whole=_WHOLE, texts=_TEXTS, instead={"person": "walk"})


def mean_cycle(
    table: Mapping[str, npt.NDArray[Any]], walk: int, side: str, joint: str
) -> dict[str, npt.NDArray[np.float64]]:
    """The mean of a joint at 0 to 100 %: `angle_deg`, `ci_low_deg` and so on; all NaN where there is none."""
    chosen = (table["walk"] == walk) & (table["curve"] == "mean")
    chosen &= (table["side"] == side) & (table["joint"] == joint)
    found = {name: np.full(_POINTS, np.nan) for name in _VALUES}
    percent = table["percent"][chosen]
    if ((percent < 0) | (percent >= _POINTS)).any():
        raise ValueError(
            f"percent of a cycle must be 0 to {_POINTS - 1}, got {percent.min()} to {percent.max()}"
        )
    for name, values in found.items():
        values[percent] = table[name][chosen]
    return found


def departure_sentences(departures: Iterable[Departure]) -> list[str]:
    """Reports each joint whose mean cycle is outside of average walking with its whole interval, also as
    printed."""
    return [
        f"The {d.side} {d.joint} is {'more' if d.excess_deg > 0 else 'less'} flexed than in healthy adults: "
        f"at {d.at_percent}% of the cycle it is {abs(d.excess_deg):.0f}° "
        f"{'above' if d.excess_deg > 0 else 'below'} their band (95% interval "
        f"{abs(d.excess_deg) - d.half_deg:.0f} to {abs(d.excess_deg) + d.half_deg:.0f}°), and the whole "
        f"interval is outside for {d.share:.0%} of the cycle."
        for d in departures
        if not shows_zero(abs(d.excess_deg) - d.half_deg, 0)
    ]
