"""The files of postures: tables, JSON, and all postures as arrays."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from memo.files import write_columns_csv, write_json
from memo.postures import Postures, ReasonTotal
from memo.unfinished import complete_file

__all__ = ["EVERY_POSTURE", "WRITTEN", "posture_columns", "write_postures"]

_TENTH_MM = 4
"""Digits of metres in postures.json."""


#: The files of `write_postures`.
WRITTEN = (
    "postures.csv",
    "postures_camera.csv",
    "levels.csv",
    "reasons.csv",
    "postures.json",
    "interpretations.npz",
)

#: The one of them that is only written if all postures were kept.
EVERY_POSTURE = "interpretations.npz"


def write_postures(postures: Postures, out: str | PathLike[str]) -> list[Path]:
    """Writes postures.csv, postures_camera.csv, levels.csv, reasons.csv and postures.json into a folder, and
    interpretations.npz if all postures were kept (`keep_all`)."""
    out = Path(out)
    tables: dict[str, Callable[[Postures], dict[str, npt.ArrayLike]]] = {
        "postures.csv": posture_columns,
        "postures_camera.csv": _camera_columns,
        "levels.csv": _level_columns,
        "reasons.csv": _reason_columns,
    }
    for name, columns in tables.items():
        write_columns_csv(out / name, columns(postures))
    write_json(out / "postures.json", _document(postures))
    written = [*(out / name for name in tables), out / "postures.json"]
    # From an earlier run: it would not match the new tables.
    (out / EVERY_POSTURE).unlink(missing_ok=True)
    if postures.interpretations is not None:
        _write_every_posture(out / EVERY_POSTURE, postures)
        written.append(out / EVERY_POSTURE)
    return written


def _write_every_posture(path: Path, postures: Postures) -> None:
    """All frames one after the other, of each frame first the survivors, for `numpy.load`."""
    every = postures.interpretations or ()
    counts = [len(one.survivors_m) + len(one.cut_m) for one in every]
    figures = [figures_m for one in every for figures_m in (one.survivors_m, one.cut_m)]
    cut_by = [by for one in every for by in (*[""] * len(one.survivors_m), *one.cut_by)]
    with complete_file(path) as temporary, open(temporary, "wb") as file:
        np.savez_compressed(
            file,
            frame=np.repeat(postures.frames, counts),
            posture_m=np.concatenate([np.zeros((0, len(postures.joints), 3)), *figures]),
            cut_by=np.array(cut_by, dtype=str),
            joints=np.array(postures.joints),
        )


def posture_columns(postures: Postures) -> dict[str, npt.ArrayLike]:
    """One row per frame: the smoothed motion in the world and its uncertainty; `groups` empty if unknown."""
    columns: dict[str, npt.ArrayLike] = {
        "frame": postures.frames,
        "time_s": postures.times_s,
        "survivors": postures.survivors,
        "groups": np.array(["" if n is None else n for n in postures.group_counts], dtype=object),
        "groups_given": np.array([len(sizes) for sizes in postures.group_sizes], np.int64),
        "margin_nats": postures.margin_nats,
        "anchor_m": postures.anchor_m,
        "anchor_sd_m": postures.anchor_sd_m,
    }
    for k, joint in enumerate(postures.joints):
        columns |= {f"{joint}_{axis}_m": postures.smoothed_m[:, k, i] for i, axis in enumerate("xyz")}
        columns[f"{joint}_sd_m"] = postures.sd_m[:, k]
        columns[f"{joint}_p_mirrored"] = postures.p_mirrored[:, k]
    return columns | {f"{name}_deg": values for name, values in postures.angles_deg.items()}


def _camera_columns(postures: Postures) -> dict[str, npt.ArrayLike]:
    """One row per frame: the smoothed motion in the camera's axes (x right, y down, z forward)."""
    in_camera = postures.in_camera(postures.smoothed_m)
    columns: dict[str, npt.ArrayLike] = {"frame": postures.frames, "time_s": postures.times_s}
    for k, joint in enumerate(postures.joints):
        columns |= {f"{joint}_{axis}_m": in_camera[:, k, i] for i, axis in enumerate("xyz")}
    return columns


def _level_columns(postures: Postures) -> dict[str, npt.ArrayLike]:
    """One row per frame and level of the tree."""
    count = len(postures.joints)
    return {
        "frame": np.repeat(postures.frames, count),
        "time_s": np.repeat(postures.times_s, count),
        "level": np.tile(np.arange(count), len(postures.frames)),
        "joint": np.tile(postures.joints, len(postures.frames)),
        "reached": postures.level_reached.ravel(),
        "survived": postures.level_survived.ravel(),
        "without_root": postures.level_without_root.ravel(),
    }


def _reason_columns(postures: Postures) -> dict[str, npt.ArrayLike]:
    """One row per constraint, the one that cut most first."""
    totals = sorted(postures.reason_totals, key=lambda total: -total.branches)
    columns = {name: [getattr(total, name) for total in totals] for name in ReasonTotal._fields}
    return {name: np.array(values, dtype=object) for name, values in columns.items()}


def _document(postures: Postures) -> dict[str, Any]:
    """All results, as in postures.json."""
    second = postures.second
    return {
        **postures.summary,
        "joints": postures.joints,
        "lengths": {
            name: {
                "length_m": length_m,
                "sd_m": postures.length_sd_m.get(name),
                "basis": postures.length_basis.get(name),
            }
            for name, length_m in postures.lengths_m.items()
        },
        "anchor_conflicts": postures.anchor_conflicts,
        "reason_totals": [total._asdict() for total in postures.reason_totals],
        "second": None
        if second is None
        else {**postures.summary["second"], "postures_m": np.round(second.postures_m, _TENTH_MM)},
        "flips": [] if postures.repair is None else postures.repair.flips,
        "per_frame": [_frame_document(postures, row) for row in range(len(postures.frames))],
    }


def _frame_document(postures: Postures, row: int) -> dict[str, Any]:
    return {
        "frame": postures.frames[row],
        "time_s": postures.times_s[row],
        "points_px": np.round(postures.points_px[row], 2),
        "weights": np.round(postures.weights[row], 3),
        "anchor_m": postures.anchor_m[row],
        "anchor_sd_m": postures.anchor_sd_m[row],
        "anchor_source": postures.anchor_source[row],
        "level_reached": postures.level_reached[row],
        "level_survived": postures.level_survived[row],
        "level_without_root": postures.level_without_root[row],
        "reasons": [reason._asdict() for reason in postures.reasons[row]],
        "survivors": postures.survivors[row],
        "group_count": postures.group_counts[row],
        "group_sizes": postures.group_sizes[row],
        "groups_m": np.round(postures.groups_m[row], _TENTH_MM),
        "cut_all": postures.cut_all[row],
        "problem": postures.problems[row],
        "linked_breaks": postures.linked_breaks[row],
        "margin_nats": postures.margin_nats[row],
        "linked_m": np.round(postures.linked_m[row], _TENTH_MM),
        "smoothed_m": np.round(postures.smoothed_m[row], _TENTH_MM),
        "sd_m": np.round(postures.sd_m[row], _TENTH_MM),
        "gap_m": np.round(postures.gap_m[row], _TENTH_MM),
        "p_mirrored": np.round(postures.p_mirrored[row], 4),
    }
