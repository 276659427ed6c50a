"""Builds one HTML file from text, data and the assets beside this module; it needs no network.

Everything from files is escaped: text by `text`, data by `_json`. The page's content security policy
allows only the script and the style written here, and loads nothing.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt

from memo.files import plain

__all__ = ["UNKNOWN", "Page", "columns", "number", "rows_table", "text"]

UNKNOWN = "\N{EN DASH}"


@dataclass
class Page:
    """The parts of a page."""

    title: str
    layout: str
    """The asset with the page's body, NAME.html; NAME.js beside it is its script."""
    filled: dict[str, str]
    """HTML for the placeholders of the body, by name."""
    data: dict[str, Any]
    """The data that the script draws."""
    scripts: Sequence[str] = field(default=("base.js", "view3d.js"))
    """Assets that come before NAME.js."""

    def html(self) -> str:
        """The whole file."""
        style = _asset("page.css")
        script = "\n".join(map(_asset, (*self.scripts, f"{self.layout}.js")))
        body = _filled(_asset(f"{self.layout}.html"), {"player": _asset("player.html"), **self.filled})
        places = {
            "title": text(self.title),
            "style": style,
            "style_hash": _hash(style),
            "script": script,
            "script_hash": _hash(script),
            "data": _json(self.data),
            "body": body,
        }
        return _filled(_asset("page.html"), places)


def text(value: object) -> str:
    """Any value as text in HTML."""
    return html.escape(UNKNOWN if value is None else str(value))


def number(value: object, digits: int = 2) -> str:
    """A number with that many digits after the point; a dash if unknown."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.generic):
        return text(value)
    try:
        value = float(value)
    except OverflowError:  # a whole number too large for a float
        return UNKNOWN
    if not math.isfinite(value):
        return UNKNOWN
    return f"{value:.{digits}f}".replace("-", "\N{MINUS SIGN}")


def rows_table(caption: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are already HTML; the first cell of a row names it."""
    head = "".join(f'<th scope="col">{name}</th>' for name in header)
    body = "".join(
        f'<tr><th scope="row">{first}</th>' + "".join(f"<td>{cell}</td>" for cell in rest) + "</tr>"
        for first, *rest in rows
    )
    return (
        f'<div class="scrolled" tabindex="0" role="region" aria-label="{caption}"><table>'
        f"<caption>{caption}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def columns(values: npt.ArrayLike, digits: int) -> list[Any]:
    """Numbers of any shape as nested lists for JSON, rounded; None where not finite."""
    rounded: list[Any] = plain(np.round(np.asarray(values, np.float64), digits))
    return rounded


def _filled(template: str, places: Mapping[str, str]) -> str:
    """The template with every `@@name@@` replaced, each exactly once, and none inside inserted text."""
    parts = template.split("@@")
    return "".join(places[part] if at % 2 else part for at, part in enumerate(parts))


def _asset(name: str) -> str:
    return (files(__package__) / "assets" / name).read_text(encoding="utf-8")


def _hash(inline: str) -> str:
    return base64.b64encode(hashlib.sha256(inline.encode()).digest()).decode("ascii")


def _json(value: Any) -> str:
    """JSON that cannot end its HTML element: it has no `<`, `>` or `&`."""
    dumped = json.dumps(plain(value), separators=(",", ":"), allow_nan=False)
    return dumped.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
