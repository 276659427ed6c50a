"""Values that the caller gives a reader if a file may not have them: up axis, frame rate, unit, joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from memo.formats.motion import FormatError, Up

__all__ = ["METRIC_M", "Given", "chosen_up", "unit_of", "unit_of_legs"]

UNITS_M = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1.0),
    **dict.fromkeys(("cm", "centimeters", "centimetres"), 0.01),
    **dict.fromkeys(("mm", "millimeters", "millimetres"), 0.001),
}

METRIC_M = {unit: UNITS_M[unit] for unit in ("m", "cm", "mm")}
_LEG_M = (0.45, 1.3)  # thigh and shank, from children to very tall adults


@dataclass(frozen=True)
class Given:
    """The caller's values; None if the reader is to find them."""

    up: Up | None = None
    """Overrides the up axis of the file."""
    rate_hz: float | None = None
    """Frame rate of an AMC file, or of a table without times."""
    unit_m: float | None = None
    """Metres in one unit of length, for BVH, AMC and tables that name none."""
    markers: Mapping[str, Sequence[str]] | None = None
    """Names of the points at whose mean a joint is, by which figures are measured; others by usual names."""

    def check_used(self, *used: str) -> None:
        """Refuses values that the reader does not use."""
        for name, what in (("rate_hz", "a frame rate (--fps)"), ("unit_m", "a unit (--unit)")):
            if name not in used and getattr(self, name) is not None:
                raise FormatError(f"the file has its own: leave out {what}")


def unit_of(text: str, where: str) -> tuple[str, float]:
    """The unit of length named in a file and its length in metres."""
    unit = text.strip().lower()
    if unit not in UNITS_M:
        raise FormatError(f"{where}: {text.strip()!r}, wanted m, cm or mm")
    return unit, UNITS_M[unit]


def unit_of_legs(leg: float | None, units_m: Mapping[str, float], usual: str) -> tuple[float, str]:
    """Metres in the first unit that gives the legs, thigh and shank, a human length; and a sentence on it.

    `leg`: their length in the file's unit, None if there are no legs to measure; the unit is then `usual`.
    """
    if leg is None:
        return units_m[usual], f"The file names no unit, and has no legs to measure: {usual} was assumed."
    for unit, unit_m in units_m.items():
        if _LEG_M[0] <= leg * unit_m <= _LEG_M[1]:
            made = f"which makes the legs {leg * unit_m:.2f} m long"
            return unit_m, f"The file names no unit: {unit} was assumed, {made}."
    raise FormatError(f"no unit is named, and legs of {leg:g} fit none: give --unit, the metres in one unit")


def chosen_up(
    given: Given, said: str | None, usual: Up, because: str, stands: Up | None = None
) -> tuple[Up, tuple[str, ...]]:
    """The up axis: as given, else from the file, else from the figure's posture, else the usual one.

    The last two are reported.
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
        return stands, (f"{silent} {stands.upper()} was assumed, from the figure's posture.",)
    return usual, (f"{silent} {usual.upper()} was assumed, as {because}.",)
