"""What the caller tells a reader that a file may not say: up axis, frame rate, unit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from memo.formats.motion import FormatError, Up

__all__ = ["METRIC_M", "Given", "chosen_up", "unit_of", "unit_of_legs"]

UNITS_M = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1.0),
    **dict.fromkeys(("cm", "centimeters", "centimetres"), 0.01),
    **dict.fromkeys(("mm", "millimeters", "millimetres"), 0.001),
}

METRIC_M = {unit: UNITS_M[unit] for unit in ("m", "cm", "mm")}
_LEG_M = (0.45, 1.3)  # thigh and shank, from children to giants


@dataclass(frozen=True)
class Given:
    """What the caller said; None where a reader is to find out."""

    up: Up | None = None
    """Overrules what the file says."""
    rate_hz: float | None = None
    """Frame rate of a table without times."""
    unit_m: float | None = None
    """Metres in one unit of length, for BVH and for tables that name none."""

    def check_used(self, *used: str) -> None:
        """Refuses what was given besides what a reader uses."""
        for name, what in (("rate_hz", "a frame rate (--fps)"), ("unit_m", "a unit (--unit)")):
            if name not in used and getattr(self, name) is not None:
                raise FormatError(f"the file says it itself: leave out {what}")


def unit_of(text: str, where: str) -> tuple[str, float]:
    """The unit of length named in a file and its length in metres."""
    unit = text.strip().lower()
    if unit not in UNITS_M:
        raise FormatError(f"{where}: {text.strip()!r}, wanted m, cm or mm")
    return unit, UNITS_M[unit]


def unit_of_legs(leg: float | None, units_m: Mapping[str, float], usual: str) -> tuple[float, str]:
    """Metres in the first unit that makes legs, thigh and shank, a human length; a sentence that says so.

    `leg`: their length in the file's unit, None where there are none to measure: `usual` then.
    """
    if leg is None:
        return units_m[usual], f"The file names no unit, and has no legs to measure: {usual} was assumed."
    for unit, unit_m in units_m.items():
        if _LEG_M[0] <= leg * unit_m <= _LEG_M[1]:
            made = f"which makes the legs {leg * unit_m:.2f} m long"
            return unit_m, f"The file names no unit: {unit} was taken, {made}."
    raise FormatError(f"no unit is named, and legs of {leg:g} fit none: give --unit, the metres in one unit")


def chosen_up(
    given: Given, said: str | None, usual: Up, because: str, stands: Up | None = None
) -> tuple[Up, tuple[str, ...]]:
    """The up axis: as given, else as the file says, else as the figure stands, else the usual one.

    The last two are told.
    """
    if given.up is not None:
        return given.up, ()
    if said is not None:
        up: Up | None = {"y": "y", "z": "z"}.get(said.lower().removeprefix("+"))  # type: ignore[assignment]
        if up is None:
            raise FormatError(f"the up axis is {said!r}, wanted Y or Z: give --from-up")
        return up, ()
    silent = "The file does not say which axis is up:"
    if stands is not None:
        return stands, (f"{silent} {stands.upper()} was taken, as the figure stands.",)
    return usual, (f"{silent} {usual.upper()} was assumed, as {because}.",)
