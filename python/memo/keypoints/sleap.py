"""SLEAP: analysis files, HDF5 (H5) and CSV.

- H5: `tracks` (track, xy, node, frame), `node_names`, perhaps `point_scores` (track, node, frame), or in
  another order that the attribute `dims` of each data set gives. Source: talmolab/sleap
  `sleap/info/write_tracking_h5.py`, talmolab/sleap-io `sleap_io/io/analysis_h5.py`.
- CSV: a row per frame and track, `track`, `frame_idx`, `instance.score`, and `NODE.x`, `NODE.y`,
  `NODE.score`, perhaps the video, of which there must be one. Source: talmolab/sleap-io `sleap_io/io/csv.py`.

Tracks are people. Nodes that are joints of memo in any usual spelling are kept; others are left out. A
project (`.slp`) is not read: export the analysis.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from memo.keypoints.deeplabcut import known_joints, table_rows
from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.hdf5 import opened
from memo.keypoints.points import MAX_FRAME, Array, KeypointsError, Source
from memo.keypoints.text import short
from memo.wording import counted

__all__ = ["is_sleap", "is_sleap_h5", "read_sleap", "read_sleap_h5"]

_TRACKS = ("track", "xy", "node", "frame")  # SLEAP's own order
_SCORES = ("track", "node", "frame")
_VIDEO = ("video", "video_path", "video_name", "video_idx")


def is_sleap(content: str) -> bool:
    """Whether this is the text of an analysis table."""
    header = [cell.strip() for cell in content.lstrip("\ufeff").partition("\n")[0].split(",")]
    return "frame_idx" in header and any(cell.endswith(".x") for cell in header)


def read_sleap(path: Path, content: str) -> Found:
    """All instances in a CSV table."""
    rows = table_rows(path, content)
    places = {cell.strip(): index for index, cell in enumerate(rows[0])}
    joints = known_joints(path, [cell.removesuffix(".x") for cell in places if cell.endswith(".x")])
    lacking = [f"{node}.y" for node in joints if f"{node}.y" not in places]
    if lacking:
        raise KeypointsError(f"{path}: no column {', '.join(lacking)}")
    people = []
    videos: dict[str, str] = {}
    for number, row in enumerate(rows[1:], start=2):
        where = f"{path}: row {number}"
        if len(row) != len(rows[0]):
            raise KeypointsError(f"{where} has {counted(len(row), 'cell')}, the header {len(rows[0])}")
        _check_one_video(path, videos, {name: row[places[name]].strip() for name in _VIDEO if name in places})

        def value(column: str, row: list[str] = row, where: str = where) -> float:
            try:
                return float(row[places[column]] or "nan") if column in places else 1.0
            except ValueError:
                raise KeypointsError(
                    f"{where}, {column}: {short(row[places[column]])} is not a number"
                ) from None

        frame = value("frame_idx")
        if not (0 <= frame <= MAX_FRAME and frame == int(frame)):
            raise KeypointsError(
                f"{where}: frame_idx {short(row[places['frame_idx']])} is not a frame number"
            )
        values = np.array([[value(f"{node}.{end}") for end in ("x", "y", "score")] for node in joints])
        if np.isfinite(values[:, :2]).any():
            track = row[places["track"]].strip() if "track" in places else ""
            people.append(Person(int(frame), with_missing(values, where), None, track or None))
    return Found(Source(path, None), people, names=tuple(joints.values()))


def _check_one_video(path: Path, videos: dict[str, str], cells: dict[str, str]) -> None:
    """Refuses a row of another video than those before, whose columns `videos` collects."""
    for column, video in cells.items():
        first = videos.setdefault(column, video)
        if first != video:
            raise KeypointsError(
                f"{path}: {column}: {short(first)} and {short(video)}; export each video to its own file"
            )


def is_sleap_h5(file: Any) -> bool:
    return "tracks" in file and "node_names" in file


def read_sleap_h5(path: Path) -> Found:
    """All tracks in an H5 file."""
    with opened(path) as file:
        tracks = _ordered(path, file["tracks"], _TRACKS)
        names = [_text(name) for name in np.ravel(file["node_names"][()]).tolist()]
        scores = np.ones(tracks.shape[:1] + tracks.shape[2:])
        named = np.ravel(file["track_names"][()]).tolist() if "track_names" in file else []
        if "point_scores" in file and file["point_scores"].size:
            scores = _ordered(path, file["point_scores"], _SCORES)
    count, _, nodes, frames = tracks.shape
    if tracks.shape[1] != 2 or nodes != len(names) or scores.shape != (count, nodes, frames):
        raise KeypointsError(
            f"{path}: tracks of shape {tracks.shape} (track, xy, node, frame), "
            f"{len(names)} node_names and point_scores {scores.shape}"
        )
    joints = known_joints(path, names)
    track_names = [_text(name) for name in named] if len(named) == count else [None] * count
    nodes_kept = [names.index(node) for node in joints]
    values = np.concatenate([tracks, scores[:, None]], axis=1)[:, :, nodes_kept].transpose(3, 0, 2, 1)
    people = [
        Person(frame, with_missing(one.copy(), f"{path}: frame {frame}"), None, track)
        for frame, of_frame in enumerate(values)
        for one, track in zip(of_frame, track_names, strict=True)
        if np.isfinite(one[:, :2]).any()
    ]
    return Found(Source(path, None), people, names=tuple(joints.values()), frames=tuple(range(frames)))


def _ordered(path: Path, dataset: Any, order: tuple[str, ...]) -> Array:
    """The numbers of a data set with its axes in this order."""
    given = dataset.attrs.get("dims")
    try:
        axes = order if given is None else tuple(json.loads(_text(given)))
        values = np.asarray(dataset[()], np.float64)
    except (TypeError, ValueError):
        raise KeypointsError(f"{path}: {dataset.name}: numbers with the axes {order} wanted") from None
    if sorted(axes) != sorted(order) or values.ndim != len(order):
        raise KeypointsError(f"{path}: {dataset.name}: wanted the axes {order}, got {axes} of {values.shape}")
    return np.transpose(values, [axes.index(axis) for axis in order])


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
