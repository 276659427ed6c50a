"""The page of two walks: their gait cycles in one plot each, and the differences of their gait parameters."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import memo
from memo.compare import (
    JUDGED,
    CurveDifference,
    ParameterDifference,
    curve_differences,
    difference_sentences,
    parameter_differences,
)
from memo.plausible import LIKELY_MISTAKEN
from memo.report import normative
from memo.report.cycles import drawn_cycles
from memo.report.page import Page, number, rows_table, text
from memo.report.run_folder import RunFolder, read_run_folder
from memo.report.track_text import measured
from memo.wording import counted

__all__ = ["comparison_page"]

_NO_DIFFERENCE = "no difference can be told"
_UNSURE_SIDES = "not judged: left and right, or the heading, may be wrong"
_FITS_POORLY = "not judged: the model fits a walk poorly"


def comparison_page(
    folders: tuple[Path, Path], walks: tuple[int | None, int | None]
) -> tuple[Page, dict[str, Any]]:
    """The page of a walk of each folder, by default the longest, and its contents.

    The contents are `walks`, `compared` (which walk is A and which is B), `sentences` and `notes`.
    ValueError names a folder that lacks a table or the walk.
    """
    runs = (read_run_folder(folders[0]), read_run_folder(folders[1]))
    chosen = (_walk(runs[0], walks[0]), _walk(runs[1], walks[1]))
    if runs[0].path.resolve() == runs[1].path.resolve() and chosen[0] == chosen[1]:
        raise ValueError(f"{runs[0].path}: walk {chosen[0]} is compared with itself; give two walks")
    parameters = parameter_differences(runs[0].parameters, runs[1].parameters, chosen)
    curves = curve_differences(runs[0].cycles, runs[1].cycles, chosen)
    are_sides_sure = all(
        max(_p_swapped(run, walk), run.p_other_heading(walk)) <= LIKELY_MISTAKEN
        for run, walk in zip(runs, chosen, strict=True)
    )
    names = _names(runs, chosen)
    verdicts = [run.verdict(walk) for run, walk in zip(runs, chosen, strict=True)]
    poor = [name for name, verdict in zip(names, verdicts, strict=True) if verdict == "poorly"]
    sentences = [
        f"{name}: the model fits the person poorly, so no difference between the walks is stated: it may be "
        "an error of the fit."
        for name in poor
    ]
    if not poor:
        told = [one for one in parameters if are_sides_sure or not one.is_of_a_side]
        sentences = difference_sentences(("A", "B"), told, curves if are_sides_sure else [])
    unjudged = _FITS_POORLY if poor else None if are_sides_sure else _UNSURE_SIDES
    each = zip(names, runs, chosen, strict=True)
    notes = [note for name, run, walk in each for note in _doubts(name, run, walk)]
    page = Page(
        title=f"memo: {names[0]} and {names[1]}",
        layout="comparison",
        scripts=("base.js", "cycles.js"),
        filled={
            "version": text(memo.__version__),
            "first": text(names[0]),
            "second": text(names[1]),
            "sentences": "".join(f"<p>{text(said)}</p>" for said in sentences),
            "warnings": "".join(f"<li>{text(note)}</li>" for note in notes),
            "parameters": _parameter_table(parameters, unjudged),
            "curves": _curve_table(curves, unjudged),
            "band_source": text(normative.SOURCE),
        },
        data={"cycles": _cycles(runs, chosen)},
    )
    compared = f"A is {names[0]}, B is {names[1]}."
    return page, {"walks": list(chosen), "compared": compared, "sentences": sentences, "notes": notes}


def _walk(run: RunFolder, wanted: int | None) -> int:
    """The number of the wanted walk, else of the longest."""
    needed = {"track.csv": run.columns, "gait_parameters.csv": run.parameters, "cycles.csv": run.cycles}
    absent = [name for name, table in needed.items() if not table]
    if absent:
        raise ValueError(f"{run.path}: two walks are compared by {', '.join(needed)}; missing: {absent[0]}")
    walks, rows = np.unique(run.columns["walk"], return_counts=True)
    if not len(walks):
        raise ValueError(f"{run.path}: nobody was tracked, so there is no walk to compare")
    if wanted is None:
        return int(walks[np.argmax(rows)])
    if wanted not in walks:
        raise ValueError(f"{run.path}: has no walk {wanted}, but {counted(len(walks), 'walk')} from 0")
    return wanted


def _names(runs: tuple[RunFolder, RunFolder], walks: tuple[int, int]) -> list[str]:
    """The folders, with as much of their paths as tells them apart, and the walk of one with several."""
    paths = [run.path.resolve() for run in runs]
    most = max(len(path.parts) for path in paths) if paths[0] != paths[1] else 1
    tails = ([Path(*path.parts[-count:]) for path in paths] for count in range(1, most + 1))
    names = next(pair for pair in tails if pair[0] != pair[1] or most == 1)
    several = [len(np.unique(run.columns["walk"])) > 1 for run in runs]
    each = zip(names, walks, several, strict=True)
    return [f"{name}, walk {walk}" if is_one else str(name) for name, walk, is_one in each]


def _p_swapped(run: RunFolder, walk: int) -> float:
    return float(run.columns["p_swapped"][run.columns["walk"] == walk][0])


def _doubts(name: str, run: RunFolder, walk: int) -> list[str]:
    p_swapped = _p_swapped(run, walk)
    told = []
    rows = (run.parameters["walk"] == walk) & (run.parameters["parameter"] == "speed")
    if (run.parameters["value"][rows] < 0).any():
        told.append(f"{name}: the person walks backwards.")
    verdict = run.verdict(walk)
    if verdict not in (None, "well", "not measured"):
        advice = "do not use its angles" if verdict == "poorly" else "check its overlay before use"
        told.append(f"{name}: the model fits the person {verdict}; {advice}.")
    if p_swapped > LIKELY_MISTAKEN:
        told.append(f"{name}: left and right may be swapped (probability {p_swapped:.0%}).")
    if run.p_other_heading(walk) > LIKELY_MISTAKEN:
        chance = f"probability {run.p_other_heading(walk):.0%}"
        told.append(f"{name}: on the treadmill, the mirrored heading may be the true one ({chance}).")
    if not (run.cycles["walk"] == walk).any():
        told.append(f"{name}: it has no measured gait cycles.")
    return told


def _cycles(runs: tuple[RunFolder, RunFolder], walks: tuple[int, int]) -> dict[str, Any]:
    """The curves of both walks with `of`, "a" or "b", and the band."""
    drawn = [drawn_cycles(run.cycles) for run in runs]
    curves = [
        {**curve, "of": of}
        for of, cycles, walk in zip("ab", drawn, walks, strict=True)
        for curve in cycles["curves"]
        if curve["walk"] == walk
    ]
    return {"curves": curves, "band": normative.band()}


def _parameter_table(parameters: list[ParameterDifference], unjudged: str | None) -> str:
    rows = [
        (_parameter(one.first), measured(one.first), measured(one.second), _difference(one, unjudged))
        for one in parameters
        if np.isfinite(one.first["value"]) or np.isfinite(one.second["value"])
    ]
    header = ("parameter", "A", "B", "B less A")
    return rows_table("Gait parameters: value, 95 % interval, number of steps", header, rows)


def _parameter(row: Any) -> str:
    side = f", {row['side']}" if row["side"] else ""
    unit = f", {row['unit']}" if row["unit"] else ""
    return text(str(row["parameter"]).replace("_", " ") + side + unit)


def _difference(one: ParameterDifference, unjudged: str | None) -> str:
    """The difference with its interval, and whether it can be told, as HTML; else why it is not judged."""
    if not np.isfinite(one.value):
        return number(one.value)
    if unjudged is not None and (one.is_of_a_side or unjudged != _UNSURE_SIDES):
        return unjudged
    digits = one.digits
    interval = f"{number(one.value - one.half, digits)} to {number(one.value + one.half, digits)}"
    told = "" if one.is_sure else f"; {_NO_DIFFERENCE}"
    return f'{number(one.value, digits)} <small class="interval">{interval}{told}</small>'


def _curve_table(curves: list[CurveDifference], unjudged: str | None) -> str:
    rows = [
        (text(f"{curve.side} {curve.joint}"), number(curve.rms_deg, 1), _largest(curve, unjudged))
        for curve in curves
    ]
    header = ("joint", "RMS difference, °", "largest sure difference B less A, °")
    return rows_table("Mean gait cycles", header, rows)


def _largest(curve: CurveDifference, unjudged: str | None) -> str:
    if unjudged is not None:
        return unjudged
    if curve.joint not in JUDGED:
        return "not judged: its errors are larger than stated"
    if not curve.is_sure:
        return _NO_DIFFERENCE
    percent, value, half = curve.largest
    interval = f"{number(value - half, 1)} to {number(value + half, 1)}"
    where = f"at {percent} % of the cycle; sure for {curve.sure_share:.0%} of it"
    return f'{number(value, 1)} <small class="interval">{interval}, {where}</small>'
