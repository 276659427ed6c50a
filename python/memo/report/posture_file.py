"""Reads the `postures.json` of `memo posture` and checks the parts that the page shows."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

__all__ = ["FRAME_SHAPES", "read_postures_json"]

# The shape of the numbers of a frame; "joints" means their number, None any number, () a single number.
FRAME_SHAPES: dict[str, tuple[Any, ...]] = {
    "time_s": (),
    "anchor_m": (),
    "anchor_sd_m": (),
    "survivors": (),
    "group_count": (),
    "margin_nats": (),
    "points_px": ("joints", 2),
    "weights": ("joints",),
    "groups_m": (None, "joints", 3),
    "linked_m": ("joints", 3),
    "smoothed_m": ("joints", 3),
    "sd_m": ("joints",),
    "gap_m": ("joints",),
    "p_mirrored": ("joints",),
}


def read_postures_json(path: Path) -> dict[str, Any]:
    """The document; ValueError names the part of it that is wrong."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not JSON: {error}") from None
    wrong = next(_wrong(document), None)
    if wrong is not None:
        raise ValueError(f"{path}: {wrong} is missing or not in the format of memo posture")
    return document  # type: ignore[no-any-return]


def _wrong(document: Any) -> Iterator[str]:
    """Yields each part that is wrong."""
    if not (isinstance(document, dict) and document.get("joints") and _are_words(document["joints"])):
        yield "joints"
        return
    joints = len(document["joints"])
    frames = document.get("per_frame")
    if not isinstance(frames, list):
        yield "per_frame"
        return
    for row, frame in enumerate(frames):
        yield from _wrong_in_frame(frame, row, joints)
    yield from _wrong_in_second(document.get("second"), joints)
    totals = document.get("reason_totals", [])
    if not isinstance(totals, list) or not all(map(_is_total, totals)):
        yield "reason_totals"
    if document.get("most_cut") is not None and not _is_total(document["most_cut"]):
        yield "most_cut"
    lengths = document.get("lengths", {})
    if not isinstance(lengths, dict) or not all(map(_is_length, lengths.values())):
        yield "lengths"
    yield from (name for name in ("warnings", "anchor_conflicts") if not _are_words(document.get(name, [])))


def _wrong_in_frame(frame: Any, row: int, joints: int) -> Iterator[str]:
    if not (isinstance(frame, dict) and _is_whole(frame.get("frame"))):
        yield f"frame in row {row} of per_frame"
        return
    where = f"of frame {frame['frame']}"
    for name, shape in FRAME_SHAPES.items():
        if name not in frame or not _has_shape(frame[name], shape, joints):
            yield f"{name} {where}"
    for name in ("cut_all", "linked_breaks"):
        if frame.get(name) is not None and not _are_words(frame[name]):
            yield f"{name} {where}"
    if not isinstance(frame.get("problem"), str | None):
        yield f"problem {where}"


def _wrong_in_second(second: Any, joints: int) -> Iterator[str]:
    if second is None:
        return
    if not isinstance(second, dict):
        yield "second"
        return
    if not _are_words(second.get("joints")):
        yield "joints of second"
    yield from (
        f"{name} of second" for name in ("first_frame", "last_frame") if not _is_whole(second.get(name))
    )
    yield from (
        f"{name} of second" for name in ("p", "margin_nats") if not _has_shape(second.get(name), (), 0)
    )
    if not _has_shape(second.get("postures_m"), (None, "joints", 3), joints):
        yield "postures_m of second"


def _has_shape(value: Any, shape: tuple[Any, ...], joints: int) -> bool:
    """Whether a value is nested lists of numbers or null, with the depth and the lengths of the shape."""
    if not shape:
        return value is None or (isinstance(value, int | float) and not isinstance(value, bool))
    count = joints if shape[0] == "joints" else shape[0]
    if not isinstance(value, list) or (count is not None and len(value) != count):
        return False
    return all(_has_shape(item, shape[1:], joints) for item in value)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _are_words(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _is_total(total: Any) -> bool:
    """Whether this is the count of cuts of one constraint."""
    return isinstance(total, dict) and all(_is_whole(total.get(name)) for name in ("branches", "frames"))


def _is_length(length: Any) -> bool:
    return isinstance(length, dict) and all(
        _has_shape(length.get(name), (), 0) for name in ("length_m", "sd_m")
    )
