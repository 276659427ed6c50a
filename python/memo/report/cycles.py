"""Gait cycles as a page draws them: cycles, means with their intervals, and the band of average walking."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from memo.report import normative
from memo.report.page import columns

__all__ = ["JOINTS", "drawn_cycles", "none_sentence"]

JOINTS = ("hip", "knee", "ankle")
"""The joints that a page draws."""

_DIGITS = 2


def drawn_cycles(table: Mapping[str, npt.NDArray[Any]]) -> dict[str, Any]:
    """Data for the script: `walks` (their numbers), `curves` and `band`.

    A curve has `walk`, `side`, `joint`, `curve`, `ys` (degrees at 0 to 100 %); a mean has `half` of its 95 %
    interval and `n` too.
    """
    if not table:
        return {"walks": [], "curves": [], "band": normative.band()}
    shown = np.isin(table["joint"], JOINTS)
    keys = list(zip(*(table[name][shown] for name in ("walk", "side", "joint", "curve")), strict=True))
    cycles = np.nan_to_num(table["cycle"][shown], nan=-1)
    rows: dict[Any, list[int]] = {}
    for row, (key, cycle) in enumerate(zip(keys, cycles, strict=True)):
        rows.setdefault((*key, float(cycle)), []).append(row)
    values = {name: table[name][shown] for name in ("angle_deg", "ci_low_deg", "ci_high_deg", "n", "percent")}
    return {
        "walks": sorted({int(walk) for walk in table["walk"]}),
        "curves": [_curve(key, {name: of[at] for name, of in values.items()}) for key, at in rows.items()],
        "band": normative.band(),
    }


def _curve(key: Any, values: Mapping[str, npt.NDArray[Any]]) -> dict[str, Any]:
    walk, side, joint, curve, _ = key
    order = np.argsort(values["percent"])
    drawn = {"walk": int(walk), "side": side, "joint": joint, "curve": curve}
    drawn["ys"] = columns(values["angle_deg"][order], _DIGITS)
    if curve == "mean":
        half = (values["ci_high_deg"] - values["ci_low_deg"]) / 2
        drawn |= {"half": columns(half[order], _DIGITS), "n": int(values["n"].max(initial=0))}
    return drawn


def none_sentence(table: Mapping[str, npt.NDArray[Any]]) -> str:
    """Why there are no cycles to draw; empty if there are."""
    if not table:
        return "cycles.csv is not in the folder: track the video again with this memo."
    if not len(table["walk"]):
        return (
            "There are no measured cycles: they need a fit of the person, walking forward, known sides, and "
            "an initial contact in the video."
        )
    return ""
