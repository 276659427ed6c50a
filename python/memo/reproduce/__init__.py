"""Repeats the papers' experiments, beside the numbers printed there.

One function per paper returns a `Reproduction`: rows of the printed value, memo's value, a verdict and the
reason, and figures that are drawn when written. Rows are compared to the printed digits; a result from
other input than the paper's is "in kind", and what cannot be made is a row with the reason.
"""

from __future__ import annotations

from collections.abc import Callable

from memo.reproduce.hoffman_flinchbaugh import hoffman_flinchbaugh
from memo.reproduce.lee_chen import lee_chen
from memo.reproduce.result import Drawing, Reproduction, Row, Table, Verdict
from memo.reproduce.rohr import Clip, NobodyTracked, rohr

__all__ = [
    "EXPERIMENTS",
    "Clip",
    "Drawing",
    "NobodyTracked",
    "Reproduction",
    "Row",
    "Table",
    "Verdict",
    "hoffman_flinchbaugh",
    "lee_chen",
    "rohr",
]

EXPERIMENTS: dict[str, Callable[..., Reproduction]] = {
    "rohr": rohr,
    "lee-chen": lee_chen,
    "hoffman-flinchbaugh": hoffman_flinchbaugh,
}
"""What can be reproduced, by its name on the command line."""
