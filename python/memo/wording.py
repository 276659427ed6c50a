"""Counts, lists and intervals in messages."""

from __future__ import annotations

from typing import TYPE_CHECKING, SupportsInt

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["counted", "enumerated", "shows_zero"]


def counted(count: SupportsInt, one: str, several: str | None = None) -> str:
    """A count with its noun: "1 frame", "2 frames", "2 branches" if that plural is given."""
    number = int(count)
    return f"{number} {one if number == 1 else several or f'{one}s'}"


def enumerated(items: Sequence[str]) -> str:
    """One, two or more things: "a", "a and b", "a, b and c"."""
    return " and ".join(part for part in (", ".join(items[:-1]), *items[-1:]) if part)


def shows_zero(value: float, digits: int) -> bool:
    """Whether a number reads as zero with that many digits: then its interval touches zero in print."""
    return float(f"{value:.{digits}f}") == 0
