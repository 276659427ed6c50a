"""Equations as MathML, written into the page at build time: reading them needs no script and no network.

A displayed equation ends in `\\tag{7}` where it has that number in its paper.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from math_core import LatexToMathML

_TAG = re.compile(r"\\tag\{(.+?)\}")
_converter = LatexToMathML()


def visit_inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(_converter.convert_with_local_state(node.astext(), displaystyle=False))
    raise nodes.SkipNode


def visit_displayed(translator: Any, node: nodes.math_block) -> None:
    text = node.astext()
    equation = _converter.convert_with_local_state(_TAG.sub("", text), displaystyle=True)
    number = "".join(f'<span class="eqno">({tag})</span>' for tag in _TAG.findall(text))
    translator.body.append(f'<div class="math equation">{equation}{number}</div>\n')
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
