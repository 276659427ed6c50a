"""Results as tables in notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from html import escape

import numpy as np

__all__ = ["Shown", "table"]

_LONGEST = 100


class Shown:
    """A dataclass that notebooks show as a table of its fields."""

    def _repr_html_(self) -> str:
        names = [field.name for field in fields(self)]  # type: ignore[arg-type]
        return table(repr(self), names, [getattr(self, name) for name in names])


def table(title: str, names: Iterable[str], values: Iterable[object]) -> str:
    """HTML: a title, and a row for each named value; long values are described, not shown."""
    rows = "".join(
        f'<tr><th style="text-align:left">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(_short(value))}</td></tr>'
        for name, value in zip(names, values, strict=True)
    )
    return f"<p><b>{escape(title)}</b></p><table>{rows}</table>"


def _short(value: object) -> str:
    """A value as text of one line."""
    if isinstance(value, np.ndarray):
        return f"array {value.shape} {value.dtype}"
    if isinstance(value, float | np.floating):
        return f"{value:.6g}"
    shown = str(value) if isinstance(value, str) else repr(value)
    if len(shown) <= _LONGEST and "\n" not in shown:
        return shown
    if isinstance(value, Mapping):
        return f"{len(value)} by name: {', '.join(map(str, list(value)[:3]))}, ..."
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"{len(value)} x {type(value[0]).__name__}"
    return f"{' '.join(shown.split())[:_LONGEST]}..."
