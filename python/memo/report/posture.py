"""The page of `memo posture`: the image points, the most probable motion in 3D, and the alternatives."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import memo
from memo.report.choice import Choice
from memo.report.page import UNKNOWN, Page, number, rows_table, text
from memo.report.pictures import Thinned
from memo.report.posture_file import FRAME_SHAPES, read_postures_json
from memo.wording import counted

__all__ = ["posture_page"]

_BYTES = 20_000_000
_MOST_GROUPS = 12


_IMPOSSIBLE = "no possible sequence"


def posture_page(folder: Path, choice: Choice) -> tuple[Page, dict[str, Any]]:
    """The page of a folder of `memo posture`, the number of frames in it and what could not be shown."""
    document = read_postures_json(folder / "postures.json")
    thinned: Thinned[dict[str, Any]] = Thinned(_BYTES, choice.every)
    for frame in document["per_frame"]:
        if choice.takes(frame["frame"]) and thinned.wants_next():
            item = {name: frame[name] for name in ("frame", *FRAME_SHAPES)}
            item |= {name: frame.get(name) for name in ("problem", "cut_all", "linked_breaks")}
            item["groups_m"] = item["groups_m"][:_MOST_GROUPS]
            thinned.keep(item, len(json.dumps(item)))
    notes = choice.told(thinned.every)
    name = folder.resolve().name
    second = document.get("second")
    page = Page(
        title=f"memo: {name}",
        layout="posture",
        filled=_filled(document, name, notes),
        data={
            "joints": document["joints"],
            "frames": thinned.items,
            "second": None if not second else _second(second, document["per_frame"]),
        },
    )
    return page, {"frames": len(thinned.items), "every": thinned.every, "notes": notes}


def _second(second: dict[str, Any], frames: list[dict[str, Any]]) -> dict[str, Any]:
    """The second most probable motion, its postures by frame number."""
    first, last = second["first_frame"], second["last_frame"]
    within = [frame["frame"] for frame in frames if first <= frame["frame"] <= last]
    at = dict(zip(map(str, within), second["postures_m"], strict=False))
    return {name: second[name] for name in ("joints", "first_frame", "last_frame", "p")} | {"at": at}


def _filled(document: dict[str, Any], name: str, notes: list[str]) -> dict[str, str]:
    left = document.get("frames_with_survivors") or 0
    status = "no posture left" if not left else "postures left" if _is_possible(document) else _IMPOSSIBLE
    warnings = [*document.get("warnings", ()), *document.get("anchor_conflicts", ()), *notes]
    return {
        "version": text(memo.__version__),
        "name": text(name),
        "status": text(status),
        "tone": "good" if status == "postures left" else "bad",
        "sentences": "".join(f"<p>{text(sentence)}</p>" for sentence in _sentences(document)),
        "warnings": "".join(f"<li>{text(warning)}</li>" for warning in warnings),
        "reasons": _reasons(document),
        "lengths": _lengths(document),
    }


def _is_possible(document: dict[str, Any]) -> bool:
    """Whether any posture in the motion breaks no constraint; older documents do not state it."""
    frames = document["per_frame"]
    found = [frame for frame in frames if any(None not in joint for joint in frame["smoothed_m"])]
    return not found or not all(frame.get("linked_breaks") for frame in found)


def _sentences(document: dict[str, Any]) -> list[str]:
    count = len(document["per_frame"])
    left = f"{document.get('frames_with_survivors', UNKNOWN)} of {counted(count, 'frame')}"
    told = [
        f"Postures are left in {left}, "
        f"{number(document.get('survivors_median'), 0)} in the median; the posture in the most probable "
        f"motion breaks a constraint in {document.get('frames_breaking', UNKNOWN)}."
    ]
    if not _is_possible(document):
        told.insert(0, "The motion is no possible sequence by these rules: every posture breaks one.")
    most = document.get("most_cut")
    if most:
        often = f"{counted(most['branches'], 'branch', 'branches')} in {counted(most['frames'], 'frame')}"
        told.append(f"Most branches are cut by: {most.get('sentence')} ({often}).")
    second = document.get("second")
    if second:
        joints = " and ".join(joint.replace("_", " ") for joint in second["joints"])
        told.append(
            f"The second most probable motion mirrors {joints} in depth in frames {second['first_frame']} to "
            f"{second['last_frame']}; its probability is {number(second.get('p'))}, its margin over the "
            f"whole sequence {number(second.get('margin_nats'))} nats. Some joint is undecided in "
            f"{document.get('undecided_frames', UNKNOWN)} of {counted(count, 'frame')}."
        )
    return told


def _reasons(document: dict[str, Any]) -> str:
    totals = sorted(document.get("reason_totals", ()), key=lambda total: -total["branches"])
    if not totals:
        return "<p>Nothing was cut.</p>"
    rows = [
        (
            text(total.get("sentence")),
            text(str(total.get("joint")).replace("_", " ")),
            text(total["branches"]),
            text(total["frames"]),
        )
        for total in totals
    ]
    return rows_table(
        "Constraints, the one that cut most first", ("constraint", "at", "branches", "frames"), rows
    )


def _lengths(document: dict[str, Any]) -> str:
    rows = [
        (
            text(name.replace("_", " ")),
            number(100 * (length.get("length_m") or float("nan")), 1),
            number(100 * (length.get("sd_m") or float("nan")), 1),
            text(length.get("basis")),
        )
        for name, length in document.get("lengths", {}).items()
    ]
    caption = f"Lengths of the segments; scale from: {text(document.get('scale_from'))}"
    return rows_table(caption, ("segment", "length, cm", "sd, cm", "from"), rows)
