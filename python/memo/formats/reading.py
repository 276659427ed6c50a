"""What the caller tells a reader that a file may not say: up axis, frame rate, unit."""

from __future__ import annotations

from dataclasses import dataclass

from memo.formats.motion import FormatError, Up

__all__ = ["Given", "chosen_up", "unit_of"]

UNITS_M = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), 1.0),
    **dict.fromkeys(("cm", "centimeters", "centimetres"), 0.01),
    **dict.fromkeys(("mm", "millimeters", "millimetres"), 0.001),
}


@dataclass(frozen=True)
class Given:
    """What the caller said; None where a reader is to find out."""

    up: Up | None = None
    """Overrules what the file says."""
    rate_hz: float | None = None
    """Frame rate of a table without times."""
    unit_m: float | None = None
    """Metres in one unit of length, for BVH, which has none."""


def unit_of(text: str, where: str) -> tuple[str, float]:
    """The unit of length named in a file and its length in metres."""
    unit = text.strip().lower()
    if unit not in UNITS_M:
        raise FormatError(f"{where}: {text.strip()!r}, wanted m, cm or mm")
    return unit, UNITS_M[unit]


def chosen_up(given: Given, said: str | None, usual: Up, because: str) -> tuple[Up, tuple[str, ...]]:
    """The up axis: as given, else as the file says, else the usual one, which is told."""
    if given.up is not None:
        return given.up, ()
    if said is not None:
        up: Up | None = {"y": "y", "z": "z"}.get(said.lower().removeprefix("+"))  # type: ignore[assignment]
        if up is None:
            raise FormatError(f"the up axis is {said!r}, wanted Y or Z: give --from-up")
        return up, ()
    sentence = f"The file does not say which axis is up: {usual.upper()} was assumed, as {because}."
    return usual, (sentence,)
