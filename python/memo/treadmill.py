"""What a summary says of a walk on a treadmill."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from memo import _memo
    from memo.tracking import StoredWalk

    Walk: TypeAlias = _memo.Walk | StoredWalk

__all__ = ["treadmill_figures", "treadmill_sentence"]

LIKELY_HEADING = 0.2
"""From this probability on, the other heading is reported in the sentence."""


def treadmill_figures(walk: Walk) -> dict[str, Any]:
    """The figures of the summary: `treadmill`, and on one the belt and the heading that looks alike."""
    if walk.treadmill is None:
        return {"treadmill": False}
    belt, belt_sd, other = walk.treadmill
    return {
        "treadmill": True,
        "belt_mps": belt,
        "belt_sd_mps": belt_sd,
        "heading_rad": _heading_rad(walk),
        "other_heading_rad": other[0] if other else None,
        "p_other_heading": other[1] if other else None,
    }


def treadmill_sentence(walk: Walk, seconds: float, cadence: float) -> str:
    """What the person does, with the speed of the belt."""
    assert walk.treadmill is not None
    belt, belt_sd, other = walk.treadmill
    steps = f", {cadence:.0f} steps per minute" if np.isfinite(cadence) else ""
    pace = f"belt speed {belt:.2f} \u00b1 {belt_sd:.2f} m/s{steps}"
    said = f"Somebody walks on a treadmill for {seconds:.1f} s, {pace}."
    if other is not None and other[1] >= LIKELY_HEADING:
        here, there = (np.degrees(angle) % 360 for angle in (_heading_rad(walk), other[0]))
        said += (
            f" The heading is {here:.0f} degrees, or {there:.0f} degrees with left and right exchanged "
            f"(probability {other[1]:.0%})."
        )
    return said


def _heading_rad(walk: Walk) -> float:
    return float(np.median(walk.columns()["heading_rad"]))
