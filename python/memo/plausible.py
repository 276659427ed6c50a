"""Sentences about the body height of a walk and about values that contradict each other.

The core decides (`memo_core::track::height`, `plausible` and `fit`); this module words it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from memo._memo import Walk

__all__ = [
    "assumed_height_sentences",
    "contradiction_sentences",
    "implausible_sentences",
    "measured_height_sentences",
]


def assumed_height_sentences(walk: Walk, *, camera_given: bool = False) -> list[str]:
    """Says that the height is that of an average person, if it is, and why."""
    height_m, sd_m = walk.height.height_m, walk.height.sd_m
    if walk.height.source != "assumed":
        return []
    why = "No height and no camera were given"
    if camera_given:
        why = "No height was given, and the picture does not show it"
    return [
        f"{why}, so the person is taken to be {height_m:.2f} m tall: all sizes, "
        f"distances and speeds may be too large or too small by {2 * sd_m / height_m:.0%} (two standard "
        "deviations)."
    ]


def measured_height_sentences(walk: Walk) -> list[str]:
    """The measured height, where none was given, or where it contradicts the given one."""
    height = walk.height
    if height.source == "measured":
        return [
            f"The person is {height.height_m:.2f} m tall, measured in the picture "
            f"(standard deviation {height.sd_m:.2f} m)."
        ]
    return contradiction_sentences(walk)


def contradiction_sentences(walk: Walk) -> list[str]:
    """Says that the given height contradicts the picture by more than three standard deviations."""
    if not walk.height_is_contradicted or walk.measured_height is None:
        return []
    seen = walk.measured_height
    return [
        f"The given height of {walk.height.height_m:.2f} m contradicts the picture, in which the person is "
        f"{seen.height_m:.2f} m tall (standard deviation {seen.sd_m:.2f} m): check height and camera."
    ]


def implausible_sentences(walk: Walk) -> list[str]:
    """Says that steps and cadence do not go together, or that the feet do not stand on the ground."""
    said = []
    if walk.walk_ratio is not None:
        ratio, least, most = walk.walk_ratio.value, walk.walk_ratio.low, walk.walk_ratio.high
        if not least <= ratio <= most:
            rate = "high" if ratio < least else "low"
            said.append(
                "People of this height do not walk so: their step length over cadence is "
                f"{1000 * least:.1f} to {1000 * most:.1f} mm per step per minute, not {1000 * ratio:.1f}. "
                f"Perhaps the frame rate is too {rate}."
            )
    if walk.fit is not None and walk.fit.is_off_ground and walk.fit.sole_m is not None:
        where = "above" if walk.fit.sole_m > 0 else "below"
        said.append(f"The feet are {100 * abs(walk.fit.sole_m):.0f} cm {where} the ground: check the camera.")
    return said
