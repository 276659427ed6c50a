"""Counts in messages."""

from __future__ import annotations

from typing import SupportsInt

__all__ = ["counted"]


def counted(count: SupportsInt, one: str, several: str | None = None) -> str:
    """A count with its noun: "1 frame", "2 frames", "2 branches" if that plural is given."""
    number = int(count)
    return f"{number} {one if number == 1 else several or f'{one}s'}"
