"""Sentences about the height of a person, the tilt of a camera, and values that contradict each other.

The core decides (`memo_core::track::height`, `plausible` and `fit`); this module words it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from memo.wording import enumerated

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from memo._memo import CameraTilt, Walk

__all__ = [
    "LIKELY_MISTAKEN",
    "assumed_height_sentences",
    "beside_sentences",
    "contradiction_sentences",
    "given_height_sentences",
    "has_usual_steps",
    "implausible_sentences",
    "measured_height_sentences",
    "running_sentences",
    "tilt_sentences",
]

LIKELY_MISTAKEN = 0.2
"""A mistake that is likelier is reported, and nothing that depends on it (as in `memo_core::track`)."""

#: A camera whose roll is known worse than this is not known to be level, degrees.
_UNKNOWN_ROLL_DEG = 2.0
#: People begin to run at this squared speed over gravity and length of the leg (Kram, Domingo and Ferris,
#: J Exp Biol 200:821, 1997). Drawn walks of six people reach 0.25.
_RUNNING_FROUDE = 0.5
#: Length of the leg as a share of the height (Drillis and Contini 1966).
_LEG = 0.53
_GRAVITY_MPS2 = 9.81


def assumed_height_sentences(
    walk: Walk, *, camera_given: bool = False, heights_given: bool = False
) -> list[str]:
    """Says that the height is that of an average person, if it is, and why."""
    height_m, sd_m = walk.height.height_m, walk.height.sd_m
    if walk.height.source != "assumed":
        return []
    why = "No height and no camera were given"
    if camera_given:
        why = "No height was given, and the picture does not show it"
    elif heights_given:
        why = "No height was given for this person, and no camera"
    return [
        f"{why}, so the person is taken to be {height_m:.2f} m tall: all sizes, "
        f"distances and speeds may be too large or too small by {2 * sd_m / height_m:.0%} (two standard "
        "deviations)."
    ]


def given_height_sentences(given_m: Sequence[float], walks: Iterable[tuple[int, Walk]]) -> list[str]:
    """Of heights of several people: those in another order than given, and those of nobody.

    `walks`: persons with their walks.
    """
    taken = [(person, walk.height.height_m) for person, walk in walks if walk.height.source == "given"]
    taken_m = dict(taken)
    said = []
    if any(list(given_m[person : person + 1]) != [height_m] for person, height_m in taken_m.items()):
        each = [f"person {person} is {height_m:.2f} m tall" for person, height_m in sorted(taken_m.items())]
        said.append(
            "The picture shows that the heights are not given in the order in which people appear: "
            f"{enumerated(each)}."
        )
    left_m = list(given_m)
    for _, height_m in set(taken):  # walks of one person may differ
        if height_m in left_m:
            left_m.remove(height_m)
    if left_m:
        heights = enumerated([f"{height_m:.2f} m" for height_m in left_m])
        said.append(f"Given, but not used, as nobody was taken to be so tall: {heights}.")
    return said


def tilt_sentences(tilt: CameraTilt | None) -> list[str]:
    """How a camera that was not given is tilted, and what shows it; nothing about a given one."""
    if tilt is None:
        return []
    sd = f"(standard deviation {tilt.roll_sd_deg:.1f}°)"
    if tilt.roll_sd_deg > _UNKNOWN_ROLL_DEG:
        return [
            "The picture shows too few upright lines to tell whether the camera was level: hip angles may "
            f"be off by its roll {sd}."
        ]
    seen = f"From {tilt.upright_lines:.0f} upright lines in the picture: the camera was"
    looks = f"looked {abs(tilt.pitch_deg):.0f}° {'down' if tilt.pitch_deg > 0 else 'up'}wards"
    pitched = f" and {looks} (standard deviation {tilt.pitch_sd_deg:.0f}°)"
    if abs(tilt.pitch_deg) < 2 * tilt.pitch_sd_deg:
        pitched = ""
    if abs(tilt.roll_deg) < 2 * tilt.roll_sd_deg:
        return [f"{seen} not rolled to a side {sd}{pitched}."]
    way = "anticlockwise" if tilt.roll_deg > 0 else "clockwise"
    return [f"{seen} rolled {way} by {abs(tilt.roll_deg):.1f}° {sd}{pitched}."]


def measured_height_sentences(walk: Walk, *, camera_given: bool = True) -> list[str]:
    """The measured height, where none was given, or where it contradicts the given one.

    Without a given camera, the height of somebody who was followed at that time gives the scale.
    """
    height = walk.height
    if height.source == "measured" and not camera_given:
        return [
            f"The person is {height.height_m:.2f} m tall if the height of the other person, who was followed "
            "at that time, is right: without a calibrated camera, it is measured against that height and as "
            "wrong as that one."
        ]
    if height.source == "measured" and walk.measured_height is None:
        return [
            f"The person is taken to be {height.height_m:.2f} m tall, as the moving region at the start of "
            "the walk suggests: the outline was not fitted, so the height was not measured."
        ]
    if height.source == "measured":
        sd = f"(standard deviation {height.sd_m:.2f} m)"
        doubt = ""
        if walk.fit is not None and walk.fit.verdict == "poorly":
            doubt = ", but by a model that fits poorly: the error may be much larger"
        return [f"The person is {height.height_m:.2f} m tall, measured in the picture {sd}{doubt}."]
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


def beside_sentences(walk: Walk) -> list[str]:
    """Says that more moves beside the legs than the people who are followed."""
    if not walk.is_beside_somebody:
        return []
    return [
        "Beside the legs something else moves that is not followed: perhaps somebody behind this person, a "
        "skirt, a bag or a dog. Check the overlay."
    ]


def has_usual_steps(walk: Walk) -> bool:
    """Whether step length and cadence go together as in people of this height; steps may be miscounted."""
    ratio = walk.walk_ratio
    return ratio is None or ratio.low <= ratio.value <= ratio.high


def implausible_sentences(walk: Walk) -> list[str]:
    """Says that steps and cadence do not go together, or that the feet do not stand on the ground."""
    said = []
    if walk.walk_ratio is not None and not has_usual_steps(walk):
        ratio, least, most = walk.walk_ratio.value, walk.walk_ratio.low, walk.walk_ratio.high
        why = "the frame rate is too high, or the steps are short and quick"
        if ratio > most:
            why = "the frame rate is too low, or the person walks unusually slowly"
        said.append(
            "Few people of this height walk so: the step length over cadence is "
            f"{1000 * ratio:.2f} mm per step per minute, and {1000 * least:.2f} to {1000 * most:.2f} are "
            f"usual. Perhaps {why}."
        )
    if walk.fit is not None and walk.fit.is_off_ground and walk.fit.sole_m is not None:
        where = "above" if walk.fit.sole_m > 0 else "below"
        said.append(f"The feet are {100 * abs(walk.fit.sole_m):.0f} cm {where} the ground: check the camera.")
    return said


def running_sentences(walk: Walk, speed_mps: float) -> list[str]:
    """Says that somebody is too fast to walk: the model of a walker fits runners as well."""
    if not speed_mps**2 > _RUNNING_FROUDE * _GRAVITY_MPS2 * _LEG * walk.height.height_m:
        return []
    return [
        f"This is not walking: at {speed_mps:.2f} m/s people of this height run. Use no angle, event or gait "
        "parameter of it. If the person walks, check the frame rate."
    ]
