"""Keypoints of a detector: read from what it wrote, written back in the same format.

Formats, told apart by their content:

- OpenPose: a folder of JSON files, one a frame; the last number in a file's name is the number of its frame.
- COCO results, also AlphaPose (COCO-17, Halpe-26): one JSON list of `{image_id, keypoints, score}`.
- COCO annotations: one JSON object with `annotations`; visibility 0, 1, 2 becomes the score 0, 0.5, 1.
- Tables: CSV, wide (`frame` or `time_s`, `<joint>_x`, `<joint>_y`, optionally `<joint>_score`) or long
  (`frame` or `time_s`, `joint`, `x`, `y`, optionally `score`), either with `person` for several people.

A point at (0, 0) or without coordinates is missing: NaN here. Missing frames inside the sequence are missing
points. Writing changes the points that differ from what was read, and nothing else in the file.

What it cannot do: follow a person through a crowd (see `read_keypoints`), read 3D points, guess a frame rate.
"""

from __future__ import annotations

import csv
import io
import json
import math
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import complete_file

__all__ = ["Keypoints", "KeypointsError", "layouts", "read_keypoints"]

Array = npt.NDArray[np.float64]

_MAX_FRAME_FILE_BYTES = 64 << 20
_MAX_FILE_BYTES = 512 << 20
_MAX_FRAME_FILES = 1_000_000
_MAX_FRAME = 10**9
_MAX_COORDINATE_PX = 1e6
_LONGEST_NAME = 60
# A sequence may have gaps, but frame numbers that are mostly gaps are not those of a video.
_MAX_FRAMES_PER_SEEN = 20
_MAX_GAP = 1000

_POSE_KEYS = ("pose_keypoints_2d", "pose_keypoints")
_AXES_SUFFIXES = (("_x", "_y"), ("_x_px", "_y_px"), ("_u_px", "_v_px"))
_SCORE_SUFFIXES = ("_score", "_confidence", "_likelihood", "_visibility")
_LONG_COLUMNS = ("joint", "x", "y")
_PERSON_COLUMNS = ("person", "person_id", "track_id")


class KeypointsError(ValueError):
    """Keypoints that cannot be read or written; the message says which file and why, in one line."""

    def __init__(self, message: str) -> None:
        # Names and cells of damaged files may hold anything.
        super().__init__("".join(character if character.isprintable() else "?" for character in message))


@dataclass(frozen=True)
class Keypoints:
    """One person's image points over time."""

    points: Array
    """(T, K, 2) pixels, u right and v down; NaN where missing."""
    scores: Array
    """(T, K) the detector's confidence; 0 where missing."""
    names: tuple[str, ...]
    """The K joints, in this project's spelling."""
    times_s: Array
    """(T,) seconds."""
    frames: npt.NDArray[np.int64]
    """(T,) frame numbers, without gaps."""
    layout: str | None
    """Name of the detector's order of points; `None` for a table, which names its points itself."""
    image_size: tuple[int, int] | None
    """Width and height of the images, pixels, where the file tells."""
    people: npt.NDArray[np.int64]
    """(T,) how many people the file has in each frame."""
    source: _Source
    """What is needed to write back."""

    def replaced(self, points: npt.ArrayLike, scores: npt.ArrayLike) -> Keypoints:
        """The same with other points and scores of the same shapes."""
        new_points = np.array(points, np.float64)
        new_scores = np.array(scores, np.float64)
        for name, new, own in (("points", new_points, self.points), ("scores", new_scores, self.scores)):
            if new.shape != own.shape:
                raise KeypointsError(f"wanted {name} of shape {own.shape}, got {new.shape}")
        return replace(self, points=new_points, scores=new_scores)

    def write(self, path: str | PathLike[str]) -> None:
        """Writes a file or folder like the one that was read, with these points in it.

        All else stays as it was: other people, other fields, other columns. The result appears complete or
        not at all. The input is never overwritten, nor a folder that holds anything but an earlier result.
        """
        out = Path(path)
        source = self.source.path
        if out.resolve() == source.resolve() or (out.exists() and out.samefile(source)):
            raise KeypointsError(f"{out}: is what was read; write to another place")
        if self.source.kind == "openpose":
            _write_openpose(out, self)
        elif self.source.kind == "csv":
            _write_csv(out, self)
        else:
            _write_coco(out, self)


def layouts() -> dict[str, tuple[str, ...]]:
    """The orders of points known: the names of the joints of each layout."""
    return {name: tuple(_memo.keypoint_layout(name)[1]) for name in _memo.keypoint_layouts()}


def read_keypoints(
    path: str | PathLike[str],
    *,
    person: int | None = None,
    fps: float | None = None,
    layout: str | None = None,
) -> Keypoints:
    """Reads one person's keypoints; the format is seen from the content.

    `person` is the place in each frame's list of people. Without it, where a frame has several: the person
    with the greatest product of size and mean score in all frames, and from there, forwards and backwards,
    the nearest in each next frame, if within 0.3 of the person's size (more after a gap). `fps` is needed
    unless a table has `time_s`, which it replaces. `layout` names the order of points where the file does
    not: without it their number decides, and between BODY_25 and BODY_25B (both 25) whether the points that
    would be neck and middle of the hips lie there.
    """
    path = Path(path)
    if fps is not None and not 0 < fps < math.inf:
        raise KeypointsError(f"the frame rate must be positive, got {fps}")
    if person is not None and (isinstance(person, bool) or not isinstance(person, int) or person < 0):
        raise KeypointsError(f"person {person!r} is not a place in the list of people: 0, 1, ...")
    try:
        if not path.exists():
            raise KeypointsError(f"{path}: no such file or folder")
        found = _found(path)
    except OSError as error:
        raise KeypointsError(f"{path}: cannot be read: {error.strerror or error}") from None
    return _assembled(found, person, fps, layout)


# What a file holds, before one person is chosen.


@dataclass(frozen=True)
class _Source:
    """Where points came from, to write them back to."""

    kind: str
    path: Path
    #: For each frame what tells the person's place in the file, or None.
    places: tuple[Any, ...] = ()
    #: For an OpenPose folder: all its files.
    files: tuple[Path, ...] = ()


@dataclass(frozen=True)
class _Person:
    frame: int
    values: Array  # (K, 3): x, y, score
    place: Any


@dataclass(frozen=True)
class _Found:
    source: _Source
    people: list[_Person]
    names: tuple[str, ...] | None = None
    times_s: dict[int, float] | None = None
    image_size: tuple[int, int] | None = None
    #: Frames that are there, though perhaps without anybody.
    frames: tuple[int, ...] = ()


def _found(path: Path) -> _Found:
    if path.is_dir():
        return _read_openpose(path)
    if not path.is_file():
        raise KeypointsError(f"{path}: neither a file nor a folder")
    content = _content(path, _MAX_FILE_BYTES)
    if not content.strip():
        raise KeypointsError(f"{path}: the file is empty")
    if content.lstrip()[:1] in ("{", "["):
        return _read_coco(path, _parsed(path, content))
    return _read_csv(path, content)


def _assembled(found: _Found, person: int | None, fps: float | None, layout: str | None) -> Keypoints:
    path = found.source.path
    people = sorted(found.people, key=lambda one: one.frame)
    if not people:
        raise KeypointsError(f"{path}: no person in any frame")
    frames = _frame_range(path, {one.frame for one in people} | set(found.frames))
    counts = {len(one.values) for one in people}
    if len(counts) > 1:
        raise KeypointsError(f"{path}: people with different numbers of points: {sorted(counts)}")
    values = np.stack([one.values for one in people])
    all_points, all_scores = np.ascontiguousarray(values[..., :2]), np.ascontiguousarray(values[..., 2])
    name, names = _layout(found, layout, all_points)
    chosen = _chosen(path, people, person, all_points, all_scores)

    count = len(frames)
    points = np.full((count, len(names), 2), np.nan)
    scores = np.zeros((count, len(names)))
    places: list[Any] = [None] * count
    seen = np.zeros(count, np.int64)
    for index, one in enumerate(people):
        row = one.frame - frames[0]
        seen[row] += 1
        if chosen[index]:
            points[row], scores[row], places[row] = all_points[index], all_scores[index], one.place
    return Keypoints(
        points=points,
        scores=scores,
        names=names,
        times_s=_times_s(path, frames, found.times_s, fps),
        frames=np.arange(frames[0], frames[-1] + 1, dtype=np.int64),
        layout=name,
        image_size=found.image_size,
        people=seen,
        source=replace(found.source, places=tuple(places)),
    )


def _frame_range(path: Path, seen: set[int]) -> range:
    first, last = min(seen), max(seen)
    span = last - first + 1
    if span > _MAX_FRAMES_PER_SEEN * len(seen) + _MAX_GAP:
        raise KeypointsError(f"{path}: frames {first} to {last}, but only {len(seen)} of them are there")
    return range(first, last + 1)


def _layout(found: _Found, layout: str | None, points: Array) -> tuple[str | None, tuple[str, ...]]:
    path = found.source.path
    if found.names is not None:
        if layout is not None:
            raise KeypointsError(f"{path}: a table names its joints itself; leave the layout {layout} out")
        return None, found.names
    try:
        name, names = _memo.keypoint_layout(_memo.guess_layout(points) if layout is None else layout)
    except ValueError as error:
        raise KeypointsError(f"{path}: {error}") from None
    if len(names) != points.shape[1]:
        raise KeypointsError(f"{path}: has {points.shape[1]} points a person, {name} has {len(names)}")
    return name, tuple(names)


def _chosen(
    path: Path, people: Sequence[_Person], person: int | None, points: Array, scores: Array
) -> Sequence[bool]:
    if person is None:
        return _memo.follow_person([one.frame for one in people], points, scores)
    chosen = [
        place == person
        for _, same_frame in groupby(people, key=lambda one: one.frame)
        for place, _ in enumerate(same_frame)
    ]
    if not any(chosen):
        raise KeypointsError(f"{path}: no frame has a person {person} (the first is 0)")
    return chosen


def _times_s(path: Path, frames: range, times_s: dict[int, float] | None, fps: float | None) -> Array:
    if fps is not None:
        return np.array(frames) / fps
    if times_s is None:
        raise KeypointsError(f"{path}: has no time stamps; give its frame rate (fps)")
    ordered = sorted(times_s.items())
    for (before, early), (after, late) in pairwise(ordered):
        if late <= early:
            raise KeypointsError(
                f"{path}: time_s must increase: {early:g} at frame {before}, {late:g} at {after}"
            )
    return np.interp(np.array(frames), *np.array(ordered, np.float64).T)


# OpenPose.


def _read_openpose(folder: Path) -> _Found:
    files = _numbered_files(folder)
    people = []
    for frame, file in files.items():
        for place, values in _openpose_people(file, _parsed(file, _content(file, _MAX_FRAME_FILE_BYTES))):
            people.append(_Person(frame, values, (file, place)))
    source = _Source("openpose", folder, files=tuple(files.values()))
    return _Found(source, people, frames=tuple(files))


def _numbered_files(folder: Path) -> dict[int, Path]:
    """The JSON files of a folder by the last number in their names, in order."""
    numbered: dict[int, Path] = {}
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() != ".json" or file.name.startswith(".") or not file.is_file():
            continue
        frame = _last_number(file.stem)
        if frame is None:
            raise KeypointsError(f"{file}: no frame number in the name")
        if frame in numbered:
            other = numbered[frame].name
            raise KeypointsError(
                f"{folder}: {other} and {file.name} are both frame {frame}; one camera a folder"
            )
        numbered[frame] = file
        if len(numbered) > _MAX_FRAME_FILES:
            raise KeypointsError(f"{folder}: more than {_MAX_FRAME_FILES} files")
    if not numbered:
        raise KeypointsError(f"{folder}: a folder without JSON files")
    return dict(sorted(numbered.items()))


def _openpose_people(file: Path, data: Any) -> Iterator[tuple[int, Array]]:
    """Place and values of the people with body points in a frame."""
    people = data.get("people") if isinstance(data, dict) else None
    if not isinstance(people, list):
        raise KeypointsError(f"{file}: not OpenPose's JSON: no list `people`")
    for place, person in enumerate(people):
        key = _pose_key(person)
        if key is None:
            raise KeypointsError(f"{file}: people[{place}] has no {_POSE_KEYS[0]}")
        if person[key]:
            yield place, _triples(person[key], f"{file}: people[{place}].{key}")


def _pose_key(person: Any) -> str | None:
    return next((key for key in _POSE_KEYS if isinstance(person, dict) and key in person), None)


def _write_openpose(out: Path, keypoints: Keypoints) -> None:
    source = keypoints.source
    rows = {place[0]: row for row, place in enumerate(source.places) if place is not None}
    _check_all_placed(keypoints)
    _check_replaceable(out, {file.name for file in source.files})
    out.parent.mkdir(parents=True, exist_ok=True)
    temporary = out.with_name(f".{os.getpid()}-{out.name}")
    before = out.with_name(f".{os.getpid()}-before-{out.name}")
    try:
        temporary.mkdir()
        for file in source.files:
            row = rows.get(file)
            text = None if row is None else _openpose_text(file, source.places[row][1], keypoints, row)
            if text is None:
                shutil.copyfile(file, temporary / file.name)
            else:
                (temporary / file.name).write_text(text, encoding="utf-8")
        if out.exists():
            out.rename(before)
        temporary.rename(out)
    except OSError as error:
        raise KeypointsError(f"{out}: cannot be written: {error.strerror or error}") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if before.exists():
            if out.exists():
                shutil.rmtree(before, ignore_errors=True)
            else:
                before.rename(out)


def _openpose_text(file: Path, place: int, keypoints: Keypoints, row: int) -> str | None:
    """The file with the person's points, None where it stays as it is."""
    content = _content(file, _MAX_FRAME_FILE_BYTES)
    data = _parsed(file, content)
    people = data.get("people") if isinstance(data, dict) else None
    person = people[place] if isinstance(people, list) and place < len(people) else None
    key = _pose_key(person)
    if person is None or key is None:
        raise KeypointsError(f"{file}: has changed since it was read: people[{place}] is gone")
    changed = _with_points(person[key], keypoints, row, f"{file}: people[{place}].{key}")
    if changed is None:
        return None
    person[key] = changed
    return _json_text(data, content)


def _check_replaceable(out: Path, names: set[str]) -> None:
    if not out.exists():
        return
    if not out.is_dir():
        raise KeypointsError(f"{out}: is a file; a folder is to be written")
    others = sorted(entry.name for entry in out.iterdir() if entry.name not in names or not entry.is_file())
    if others:
        raise KeypointsError(f"{out}: holds other files ({others[0]}); choose an empty or new folder")


# COCO results, AlphaPose, COCO annotations.


def _read_coco(path: Path, data: Any) -> _Found:
    if isinstance(data, dict) and "people" in data:
        raise KeypointsError(f"{path}: one frame of OpenPose; give the folder of all frames")
    people = []
    for place, entry in enumerate(_coco_entries(path, data)):
        where = f"{path}: entry {place}"
        if not isinstance(entry, dict) or "image_id" not in entry or "keypoints" not in entry:
            raise KeypointsError(f"{where}: needs image_id and keypoints")
        values = _triples(entry["keypoints"], f"{where}, keypoints")
        if isinstance(data, dict):
            values[:, 2] /= 2
        if len(values):
            people.append(_Person(_image_number(entry["image_id"], where), values, place))
    kind = "annotations" if isinstance(data, dict) else "results"
    size = _image_size(data.get("images")) if isinstance(data, dict) else None
    return _Found(_Source(kind, path), people, image_size=size)


def _coco_entries(path: Path, data: Any) -> list[Any]:
    entries = data.get("annotations") if isinstance(data, dict) else data
    if not isinstance(entries, list):
        raise KeypointsError(f"{path}: neither COCO results (a list) nor COCO annotations (`annotations`)")
    return entries


def _image_number(image_id: Any, where: str) -> int:
    number = _last_number(Path(image_id).stem) if isinstance(image_id, str) else image_id
    if isinstance(number, bool) or not isinstance(number, int):
        raise KeypointsError(f"{where}: image_id {_short(image_id)} has no frame number")
    if not 0 <= number <= _MAX_FRAME:
        raise KeypointsError(f"{where}: image_id {_short(image_id)} is not the number of a frame")
    return number


def _image_size(images: Any) -> tuple[int, int] | None:
    """Width and height, if all images have the same."""
    if not isinstance(images, list) or not all(isinstance(image, dict) for image in images):
        return None
    sizes = [(image.get("width"), image.get("height")) for image in images]
    lengths = [length for size in sizes[:1] for length in size]
    whole = all(type(length) is int and 0 < length < _MAX_COORDINATE_PX for length in lengths)
    return sizes[0] if sizes and whole and all(size == sizes[0] for size in sizes) else None


def _write_coco(out: Path, keypoints: Keypoints) -> None:
    source = keypoints.source
    _check_all_placed(keypoints)
    content = _content(source.path, _MAX_FILE_BYTES)
    data = _parsed(source.path, content)
    entries = _coco_entries(source.path, data)
    factor = 2 if source.kind == "annotations" else 1
    for row, place in enumerate(source.places):
        if place is None:
            continue
        entry = entries[place] if place < len(entries) else None
        if not isinstance(entry, dict) or "keypoints" not in entry:
            raise KeypointsError(f"{source.path}: has changed since it was read: entry {place} is gone")
        where = f"{source.path}: entry {place}, keypoints"
        changed = _with_points(entry["keypoints"], keypoints, row, where, factor)
        if changed is not None:
            entry["keypoints"] = changed
    _write_text(out, _json_text(data, content))


# JSON.


def _content(path: Path, most: int) -> str:
    try:
        size = path.stat().st_size
        if size > most:
            raise KeypointsError(f"{path}: {size >> 20} MiB; at most {most >> 20} MiB are read")
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise KeypointsError(f"{path}: not text in UTF-8 (byte {error.start})") from None
    except OSError as error:
        raise KeypointsError(f"{path}: cannot be read: {error.strerror or error}") from None


def _parsed(path: Path, content: str) -> Any:
    try:
        return json.loads(content)
    except json.JSONDecodeError as error:
        raise KeypointsError(f"{path}: not JSON: {error.msg} in line {error.lineno}") from None
    except (ValueError, RecursionError) as error:
        raise KeypointsError(f"{path}: not JSON that can be read: {_short(str(error))}") from None


def _json_text(data: Any, like: str) -> str:
    """The data as JSON, with or without spaces as in the text it came from."""
    compact = re.search(r'"\s*:\s', like) is None
    return json.dumps(data, ensure_ascii=False, separators=(",", ":") if compact else None)


def _triples(numbers: Any, where: str) -> Array:
    """Numbers x, y, score, x, y, score, ... as (K, 3); NaN, NaN, 0 where missing."""
    if not isinstance(numbers, list) or len(numbers) % 3:
        raise KeypointsError(f"{where}: not a list of x, y, score")
    for index, number in enumerate(numbers):
        if number is not None and type(number) not in (int, float):
            raise KeypointsError(f"{where}[{index}]: {_short(number)} is not a number")
    try:
        flat = np.array([math.nan if number is None else number for number in numbers], np.float64)
    except OverflowError:
        raise KeypointsError(f"{where}: a number too large") from None
    return _with_missing(flat.reshape(-1, 3), where)


def _with_missing(values: Array, where: str) -> Array:
    if (np.abs(values[:, :2]) > _MAX_COORDINATE_PX).any() or np.isinf(values[:, 2]).any():
        raise KeypointsError(f"{where}: coordinates beyond {_MAX_COORDINATE_PX:g} pixels")
    missing = np.isnan(values[:, :2]).any(axis=1) | (values[:, :2] == 0).all(axis=1)
    values[missing] = (np.nan, np.nan, 0)
    values[np.isnan(values[:, 2]), 2] = 0
    return values


def _with_points(
    numbers: Any, keypoints: Keypoints, row: int, where: str, factor: int = 1
) -> list[Any] | None:
    """The numbers with the points of a row; those that are the same keep their digits; None if all are."""
    before = _triples(numbers, where)
    before[:, 2] /= factor
    after = np.column_stack([keypoints.points[row], keypoints.scores[row]])
    if before.shape != after.shape:
        raise KeypointsError(f"{where}: has changed since it was read")
    changed = list(numbers)
    different = _different(before, after)
    for joint in different:
        x, y, score = after[joint].tolist()
        if math.isnan(x) or math.isnan(y):
            changed[3 * joint : 3 * joint + 3] = [0, 0, 0]
        else:
            changed[3 * joint : 3 * joint + 3] = [x, y, round(score * factor) if factor > 1 else score]
    return changed if len(different) else None


def _different(before: Array, after: Array) -> list[int]:
    """Joints that differ; a missing point has no score that could."""
    missing = np.isnan(before[:, :2]).any(axis=1) & np.isnan(after[:, :2]).any(axis=1)
    same = missing | (before == after).all(axis=1)
    return [int(joint) for joint in np.flatnonzero(~same)]


def _check_all_placed(keypoints: Keypoints) -> None:
    for row, place in enumerate(keypoints.source.places):
        if place is None and not np.isnan(keypoints.points[row]).all():
            raise KeypointsError(
                f"{keypoints.source.path}: frame {keypoints.frames[row]} has no person to write points to"
            )
    if np.isinf(keypoints.points).any() or not np.isfinite(keypoints.scores).all():
        raise KeypointsError("points must be finite or NaN, scores finite")


# Tables.


@dataclass(frozen=True)
class _Columns:
    """Where a table has what."""

    frame: int | None
    time_s: int | None
    person: int | None
    names: tuple[str, ...]
    #: Wide: columns x, y, score of each joint. Long: of all joints.
    values: tuple[tuple[int, int, int | None], ...]
    #: Long: the column that names the joint.
    joint: int | None


def _read_csv(path: Path, content: str) -> _Found:
    rows, _ = _rows(path, content)
    columns = _columns(path, rows)
    read = _long_people if columns.joint is not None else _wide_people
    frames, times_s = _row_frames(path, rows, columns)
    people = read(path, rows, columns, frames)
    for (_, one), (_, other) in pairwise(
        sorted((person.frame, index) for index, person in enumerate(people))
    ):
        if columns.person is None and people[one].frame == people[other].frame:
            raise KeypointsError(
                f"{path}: frame {people[one].frame} stands there twice and no column `person`"
            )
    return _Found(_Source("csv", path), people, columns.names, times_s, frames=tuple(frames.values()))


def _rows(path: Path, content: str) -> tuple[list[list[str]], str]:
    """The rows of a table, its header first, and the character between cells."""
    header = content.split("\n", 1)[0]
    delimiter = max(",;\t", key=header.count)
    try:
        rows = list(csv.reader(io.StringIO(content, newline=""), delimiter=delimiter))
    except csv.Error as error:
        raise KeypointsError(f"{path}: not a table: {error}") from None
    for line, row in enumerate(rows, start=1):
        if row and len(row) != len(rows[0]):
            raise KeypointsError(f"{path}: row {line} has {len(row)} cells, the header {len(rows[0])}")
    return rows, delimiter


def _columns(path: Path, rows: list[list[str]]) -> _Columns:
    header = [cell.strip() for cell in rows[0]] if rows else []
    lower = {cell.lower(): index for index, cell in reversed(list(enumerate(header)))}
    frame, time_s = lower.get("frame"), lower.get("time_s")
    person = next((lower[name] for name in _PERSON_COLUMNS if name in lower), None)
    if frame is None and time_s is None:
        raise KeypointsError(f"{path}: a table of keypoints needs a column `frame` or `time_s`")
    if all(name in lower for name in _LONG_COLUMNS):
        joint, x, y = (lower[name] for name in _LONG_COLUMNS)
        spelt = dict.fromkeys(row[joint] for row in rows[1:] if row)
        names = tuple(dict.fromkeys(name for text in spelt if (name := _joint(path, text)) is not None))
        values: list[tuple[int, int, int | None]] = [(x, y, lower.get("score"))]
    else:
        joint = None
        names, values = _wide_columns(path, header)
    if not names:
        raise KeypointsError(
            f"{path}: no joint in it, such as right_knee_x and right_knee_y, or joint, x and y; "
            f"got the columns {_short(', '.join(header))}"
        )
    return _Columns(frame, time_s, person, names, tuple(values), joint)


def _wide_columns(path: Path, header: list[str]) -> tuple[tuple[str, ...], list[tuple[int, int, int | None]]]:
    places = {cell: index for index, cell in reversed(list(enumerate(header)))}
    found: dict[str, tuple[int, int, int | None]] = {}
    for index, cell in enumerate(header):
        for x_suffix, y_suffix in _AXES_SUFFIXES:
            stem = cell.removesuffix(x_suffix)
            if stem == cell or (name := _joint(path, stem)) is None:
                continue
            if stem + "_z" in places:
                raise KeypointsError(f"{path}: {stem}_z: these are points in space, image points are needed")
            if stem + y_suffix not in places:
                raise KeypointsError(f"{path}: column {cell} without {stem}{y_suffix}")
            if name in found:
                raise KeypointsError(f"{path}: column {cell}: {name} stands there twice")
            score = next((places[stem + end] for end in _SCORE_SUFFIXES if stem + end in places), None)
            found[name] = (index, places[stem + y_suffix], score)
    return tuple(found), list(found.values())


def _joint(path: Path, text: str) -> str | None:
    """The joint a table names, None for what is none; a misspelt one is refused."""
    if len(text) > _LONGEST_NAME:
        return None
    try:
        return _memo.joint_name(text)
    except ValueError as error:
        raise KeypointsError(f"{path}: {error}") from None


def _row_frames(
    path: Path, rows: list[list[str]], columns: _Columns
) -> tuple[dict[int, int], dict[int, float] | None]:
    """The frame of each row that is not blank, and the time of each frame."""
    frames: dict[int, int] = {}
    times_s: dict[int, float] = {}
    frame_at: dict[float, int] = {}
    for line, row in enumerate(rows[1:], start=1):
        if not any(row):
            continue
        where = f"{path}: row {line + 1}"
        time_s = math.nan if columns.time_s is None else _number(row[columns.time_s], f"{where}, time_s")
        if columns.time_s is not None and math.isnan(time_s):
            raise KeypointsError(f"{where}: no time_s")
        if columns.frame is None:
            frame = frame_at.setdefault(time_s, len(frame_at))
        else:
            number = _number(row[columns.frame], f"{where}, frame")
            if not (0 <= number <= _MAX_FRAME and number == int(number)):
                raise KeypointsError(
                    f"{where}: frame {_short(row[columns.frame])} is not the number of a frame"
                )
            frame = int(number)
        frames[line] = frame
        if times_s.setdefault(frame, time_s) != time_s and columns.time_s is not None:
            raise KeypointsError(f"{where}: frame {frame} at two times, {times_s[frame]:g} and {time_s:g}")
    return frames, times_s if columns.time_s is not None else None


def _wide_people(
    path: Path, rows: list[list[str]], columns: _Columns, frames: dict[int, int]
) -> list[_Person]:
    return [
        _Person(frame, _cells(path, [(line, rows[line], own) for own in columns.values]), line)
        for line, frame in frames.items()
    ]


def _long_people(
    path: Path, rows: list[list[str]], columns: _Columns, frames: dict[int, int]
) -> list[_Person]:
    lines: dict[tuple[int, str], dict[int, int]] = {}
    assert columns.joint is not None
    numbers = {name: index for index, name in enumerate(columns.names)}
    for line, frame in frames.items():
        name = _joint(path, rows[line][columns.joint])
        if name is None:
            continue
        who = "" if columns.person is None else rows[line][columns.person].strip()
        joints = lines.setdefault((frame, who), {})
        if numbers[name] in joints:
            raise KeypointsError(f"{path}: row {line + 1}: {name} stands twice in frame {frame}")
        joints[numbers[name]] = line
    people = []
    for (frame, _), joints in lines.items():
        values = np.full((len(numbers), 3), (np.nan, np.nan, 0.0))
        own = _cells(path, [(line, rows[line], columns.values[0]) for line in joints.values()])
        values[list(joints)] = own
        people.append(_Person(frame, values, joints))
    return people


def _cells(path: Path, cells: Iterable[tuple[int, list[str], tuple[int, int, int | None]]]) -> Array:
    """x, y, score out of the rows and columns named; the score is 1 where the table has none."""
    values = []
    for line, row, (x, y, score) in cells:
        where = f"{path}: row {line + 1}"
        confidence = 1.0 if score is None else _number(row[score], where)
        values.append((_number(row[x], where), _number(row[y], where), confidence))
    array = np.array(values, np.float64).reshape(-1, 3)
    return _with_missing(array, f"{path}: row {line + 1}" if values else str(path))


def _number(text: str, where: str) -> float:
    """A cell's number; NaN where it is empty."""
    try:
        number = float(text) if text.strip() else math.nan
    except ValueError:
        raise KeypointsError(f"{where}: {_short(text)} is not a number") from None
    if math.isinf(number):
        raise KeypointsError(f"{where}: {_short(text)} is not finite")
    return number


def _write_csv(out: Path, keypoints: Keypoints) -> None:
    source = keypoints.source
    _check_all_placed(keypoints)
    content = _content(source.path, _MAX_FILE_BYTES)
    rows, delimiter = _rows(source.path, content)
    columns = _columns(source.path, rows)
    if columns.names != keypoints.names:
        raise KeypointsError(f"{source.path}: has changed since it was read: other joints")
    added: dict[int, list[list[str]]] = {}
    for row, place in enumerate(source.places):
        if place is not None:
            _set_cells(rows, columns, keypoints, row, place, added)
    text = io.StringIO(newline="")
    table = csv.writer(text, delimiter=delimiter, lineterminator="\r\n" if "\r\n" in content else "\n")
    for line, cells in enumerate(rows):
        table.writerow(cells)
        table.writerows(added.get(line, ()))
    _write_text(out, text.getvalue())


def _set_cells(
    rows: list[list[str]],
    columns: _Columns,
    keypoints: Keypoints,
    row: int,
    place: Any,
    added: dict[int, list[list[str]]],
) -> None:
    """Changes the cells of the joints that differ; a long table gets rows for joints it did not have."""
    wide = columns.joint is None
    lines = dict.fromkeys(range(len(columns.names)), place) if wide else place
    path = keypoints.source.path
    if max(lines.values()) >= len(rows) or not all(rows[line] for line in lines.values()):
        raise KeypointsError(f"{path}: has changed since it was read: row {max(lines.values()) + 1} is gone")
    before = np.full((len(columns.names), 3), (np.nan, np.nan, 0.0))
    owns = {joint: columns.values[joint if wide else 0] for joint in range(len(columns.names))}
    before[list(lines)] = _cells(path, [(line, rows[line], owns[joint]) for joint, line in lines.items()])
    after = np.column_stack([keypoints.points[row], keypoints.scores[row]])
    for joint in _different(before, after):
        if joint in lines:
            cells = rows[lines[joint]]
        else:
            last = max(lines.values())
            cells = ["" for _ in rows[last]]
            for kept in (columns.frame, columns.time_s, columns.person):
                if kept is not None:
                    cells[kept] = rows[last][kept]
            if columns.joint is not None:
                cells[columns.joint] = columns.names[joint]
            added.setdefault(last, []).append(cells)
        x, y, score = owns[joint]
        missing = np.isnan(after[joint, :2]).any()
        cells[x], cells[y] = ("", "") if missing else map(repr, after[joint, :2].tolist())
        if score is not None:
            cells[score] = "" if missing else repr(float(after[joint, 2]))


def _write_text(out: Path, text: str) -> None:
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with complete_file(out) as temporary:
            temporary.write_bytes(text.encode("utf-8", "surrogatepass"))
    except OSError as error:
        raise KeypointsError(f"{out}: cannot be written: {error.strerror or error}") from None


def _last_number(text: str) -> int | None:
    digits = re.findall(r"[0-9]{1,18}", text)
    number = int(digits[-1]) if digits else None
    return number if number is not None and number <= _MAX_FRAME else None


def _short(value: Any) -> str:
    """A value as it goes into a message."""
    text = (
        value
        if isinstance(value, str)
        else type(value).__name__
        if isinstance(value, dict | list)
        else repr(value)
    )
    return text if len(text) <= _LONGEST_NAME else f"{text[: _LONGEST_NAME - 3]}..."
