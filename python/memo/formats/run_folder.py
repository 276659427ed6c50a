"""The folders that `memo track` and `memo posture` write, as motions.

Several walks of one person in a `track.csv` are one motion; between them the person was not tracked and there
are no frames. For formats that need a frame at every instant, those frames are empty. Of the walks of several
people, one must be chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from memo.files import ANGLES, JOINTS, SIDES, read_events_csv, read_track_csv
from memo.formats.motion import FormatError, GaitEvent, Motion
from memo.formats.reading import Given
from memo.formats.table import read_table
from memo.wording import counted, enumerated

__all__ = ["read_run_folder", "sources"]

_OF_BOTH = {
    "knee": "shank against thigh, 0 if straight",
    "ankle": "foot against shank, 0 at a right angle, dorsiflexion positive",
    "shoulder": "upper arm against trunk, 0 along it",
    "elbow": "forearm against upper arm, 0 if straight",
}
_REFERENCES = {
    "track": {"hip": "thigh against the vertical, 0 if vertical", **_OF_BOTH},
    "postures": {"hip": "thigh against trunk, 0 along it", **_OF_BOTH},
}
"""What the angles of `track.csv` and `postures.csv` are between: docs/reference/conventions.md."""


_ANGLES_BEFORE = {
    "knee": ("hip",),
    "ankle": ("hip", "knee"),
    "elbow": ("shoulder",),
    "wrist": ("shoulder", "elbow"),
}
"""The angles that a joint's place follows from, beside that of hip or shoulder."""


def sources(path: Path) -> list[Path]:
    """The files that are read for a folder of results, or for the `track.csv` in one."""
    folder = path if path.is_dir() else path.parent
    if (folder / "track.csv").exists():
        return [folder / "track.csv", folder / "events.csv"]
    return [folder / "postures.csv"]


def read_run_folder(path: Path, given: Given, walk: int | None) -> Motion:
    """Reads `track.csv` with `events.csv`, or `postures.csv`; from a track one walk, or all."""
    given.check_used()
    table, *others = sources(path)
    if not table.is_file():
        raise FormatError("holds neither track.csv of `memo track` nor postures.csv of `memo posture`")
    if given.up == "y":
        raise FormatError(f"{table.name} always has Z up")
    if table.name == "track.csv":
        return _track(table, others[0], walk)
    if walk is not None:
        raise FormatError("a walk can be chosen only for track.csv")
    motion = read_table(table, given)
    return replace(motion, metadata={**motion.metadata, "references": _references("postures", motion.angles)})


def _references(source: str, angles: Iterable[str]) -> dict[str, str]:
    """The references of those angles whose references are known."""
    known = _REFERENCES[source]
    joints = {name: name.partition("_")[2] for name in angles}
    return {name: known[joint] for name, joint in joints.items() if joint in known}


def _track(table: Path, events_table: Path, walk: int | None) -> Motion:
    columns = _read(read_track_csv, table)
    events = _read(read_events_csv, events_table) if events_table.is_file() else []
    chosen = np.ones(len(columns["walk"]), bool) if walk is None else columns["walk"] == walk
    if not len(chosen):
        raise FormatError("track.csv has no frames: nobody was tracked")
    if not chosen.any():
        raise FormatError(f"there is no walk {walk}, only {columns['walk'].min()} to {columns['walk'].max()}")
    one_of = f"choose one of the walks 0 to {columns['walk'].max()} (memo convert --walk)"
    people, first = np.unique(columns["person"][chosen], return_index=True)
    if len(people) > 1:
        one, other, *_ = sorted(columns["walk"][chosen][first].tolist())
        raise FormatError(
            f"walks {one} and {other} are of different people: {one_of}, or track one person alone "
            "(memo track --follow)"
        )
    times_s = columns["time_s"][chosen]
    if (np.diff(times_s) <= 0).any():
        raise FormatError(f"the times of its walks overlap: {one_of}")
    names = tuple(joint for joint in JOINTS if np.isfinite(columns[f"{joint}_x_m"][chosen]).any())
    points = (
        np.stack(
            [np.stack([columns[f"{name}_{axis}_m"][chosen] for axis in "xyz"], axis=-1) for name in names],
            axis=1,
        )
        if names
        else np.empty((len(times_s), 0, 3))
    )
    names_of_angles = [f"{side}_{angle}" for side in SIDES for angle in ANGLES]
    angles = {name: columns[f"{name}_deg"][chosen] for name in names_of_angles}
    angles = {name: values for name, values in angles.items() if np.isfinite(values).any()}
    walks = len(np.unique(columns["walk"]))
    notes = (
        [f"{counted(walks, 'walk')}: between them the person was not tracked."]
        if walk is None and walks > 1
        else []
    )
    points, assumed = _measured(names, points, angles)
    notes += assumed
    kept = [
        GaitEvent(event["time_s"], event["event"], event["side"])
        for event in events
        if walk is None or (event.get("walk", walk) == walk and times_s[0] <= event["time_s"] <= times_s[-1])
    ]
    metadata = {"format": "track", "up": "z", "unit": "m", "references": _references("track", angles)}
    frames = columns["frame"][chosen].astype(np.int64)
    return Motion(names, times_s, points, tuple(kept), angles, metadata, tuple(notes), frames)


def _measured(
    names: tuple[str, ...], points: np.ndarray, angles: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, list[str]]:
    """The points without those that are nothing but average gait, and which of the others are.

    `track.csv` has the likeliest posture in every frame. Where an angle was not measured, joints beyond it
    are those of average gait.
    """
    unknown = np.ones(len(points), bool)

    def is_assumed(joint: str) -> np.ndarray:
        side, _, name = joint.partition("_")
        needed = [angles.get(f"{side}_{angle}") for angle in _ANGLES_BEFORE.get(name, ())]
        of_angles = [unknown if values is None else ~np.isfinite(values) for values in needed]
        is_known = np.isfinite(points[:, names.index(joint)]).all(axis=1)
        return is_known & np.any(of_angles, axis=0) if of_angles else ~unknown

    frames = {name: is_assumed(name) for name in names}
    counts = {name: int(assumed.sum()) for name, assumed in frames.items() if assumed.any()}
    if not counts:
        return points, []
    if not any(np.isfinite(values).any() for values in angles.values()):
        points = points.copy()
        for name in counts:
            points[frames[name], names.index(name)] = np.nan
        return points, ["No angle was measured: joints beyond hips and shoulders are left empty."]
    told = enumerated([f"{name.replace('_', ' ')} in {count}" for name, count in counts.items()])
    return points, [
        f"These joints are those of average gait in some of {counted(len(points), 'frame')}, "
        f"because an angle before them was not measured: {told}."
    ]


def _read(reader: Callable[[Path], Any], path: Path) -> Any:
    try:
        return reader(path)
    except ValueError as error:
        raise FormatError(f"{path.name}: {str(error).removeprefix(f'{path}: ')}") from None
