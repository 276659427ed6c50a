"""What a summary says of a walk on a treadmill."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from memo.plausible import LIKELY_MISTAKEN

if TYPE_CHECKING:
    from memo._memo import Walk

__all__ = ["is_heading_open", "treadmill_figures", "treadmill_sentence"]


def is_heading_open(walk: Walk) -> bool:
    """True if a walk on a treadmill may well have the other heading that looks alike."""
    return walk.treadmill is not None and (walk.treadmill.p_other_heading or 0) > LIKELY_MISTAKEN


def treadmill_figures(walk: Walk) -> dict[str, Any]:
    """The figures of the summary: `treadmill`, and on one the belt and the heading that looks alike."""
    if walk.treadmill is None:
        return {"treadmill": False}
    return {
        "treadmill": True,
        "belt_mps": walk.treadmill.belt_mps,
        "belt_sd_mps": walk.treadmill.belt_sd_mps,
        "heading_rad": _heading_rad(walk),
        "other_heading_rad": walk.treadmill.other_heading_rad,
        "p_other_heading": walk.treadmill.p_other_heading,
    }


def treadmill_sentence(walk: Walk, seconds: float, cadence: float) -> str:
    """What the person does, with the speed of the belt."""
    found = walk.treadmill
    assert found is not None
    steps = f", {cadence:.0f} steps per minute" if np.isfinite(cadence) else ""
    sd = f"standard deviation {found.belt_sd_mps:.2f} m/s"
    pace = f"belt speed {found.belt_mps:.2f} m/s ({sd}){steps}"
    said = f"Somebody walks on a treadmill for {seconds:.1f} s, {pace}."
    if is_heading_open(walk):
        assert found.other_heading_rad is not None
        here, there = (np.degrees(angle) % 360 for angle in (_heading_rad(walk), found.other_heading_rad))
        chance = f"probability {found.p_other_heading:.0%}"
        said += f" The heading is {here:.0f} degrees, or {there:.0f} degrees ({chance})."
    return said


def _heading_rad(walk: Walk) -> float:
    return float(np.median(walk.columns["heading_rad"]))
