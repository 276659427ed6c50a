"""COCO: results, a list of `{image_id, keypoints, score}`, and annotations, an object with `annotations`.

The visibility 0, 1, 2 of annotations becomes the score 0, 0.5, 1. The number of an image, or the last number
in its name, is the frame number; names of images of several cameras or videos are refused. Written files are
results with the 17 COCO points, whatever the source of the points; they hold no frame rate.

Annotations may name their points (`keypoints` of a category). Those that are joints of memo in any usual
spelling are kept, others are left out; if none is, the number of points decides, as in results. Only people
count: the category `person`, or category 1 if the file names no category, unless all entries are of one
category.
"""

from __future__ import annotations

import json
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from memo import _memo
from memo.keypoints.alphapose import image_number, is_by_image, read_by_image
from memo.keypoints.deeplabcut import known_joints
from memo.keypoints.found import (
    Found,
    Person,
    check_all_placed,
    triples,
    with_points,
)
from memo.keypoints.layout import in_layout
from memo.keypoints.points import MAX_COORDINATE_PX, Array, Keypoints, KeypointsError, Source, layouts
from memo.keypoints.text import check_one_series, content_of, json_text, parsed, short, write_text
from memo.wording import counted

__all__ = ["read_coco", "write_coco"]

_PERSON = 1  # COCO's category


def read_coco(path: Path, data: Any) -> Found:
    """All people in a file of results or annotations."""
    if is_by_image(data):
        return read_by_image(path, data)
    if isinstance(data, dict) and ("people" in data or "bodies" in data):
        raise KeypointsError(f"{path}: one frame of OpenPose; give the folder of all frames")
    is_annotations = isinstance(data, dict)
    categories = _categories(data.get("categories")) if is_annotations else {}
    entries = _entries(path, data)
    person = _person_category(path, entries, categories)
    only = next(iter(categories.values())) if person is None and len(categories) == 1 else None
    points = _named_points(path, categories.get(person, only))
    people = []
    frames = []
    images: dict[int, str] = {}
    for place, entry in enumerate(entries):
        where = f"{path}: entry {place}"
        if not isinstance(entry, dict) or "image_id" not in entry or "keypoints" not in entry:
            raise KeypointsError(f"{where}: needs image_id and keypoints")
        frame = image_number(entry["image_id"], where)
        if isinstance(entry["image_id"], str):
            check_one_series(path, images, frame, entry["image_id"])
        if _category(entry) not in (None, person):
            frames.append(frame)
            continue
        values = triples(entry["keypoints"], f"{where}, keypoints")
        if is_annotations:
            values[:, 2] /= 2
        if len(values):
            people.append(Person(frame, _kept(values, points, f"{where}, keypoints"), place))
            frames.append(frame)
    factor = 2 if is_annotations else 1
    return Found(
        Source(path, partial(_write_like, factor=factor, kept=None if points is None else points.places)),
        people,
        names=None if points is None else points.joints,
        image_size=_image_size(data.get("images")) if is_annotations else None,
        frames=tuple(frames),
    )


class _Points(NamedTuple):
    """The points of a category that are joints."""

    total: int  # with those that are no joints
    places: tuple[int, ...]
    joints: tuple[str, ...]


def _category(entry: Any) -> int | str | None:
    """The category of an entry, None if it has none."""
    category = entry.get("category_id") if isinstance(entry, dict) else None
    return category if type(category) in (int, str) else None


def _categories(categories: Any) -> dict[Any, dict[str, Any]]:
    """The categories of a file by their `id`."""
    if not isinstance(categories, list):
        return {}
    known = [one for one in categories if isinstance(one, dict) and type(one.get("id")) in (int, str)]
    return {one["id"]: one for one in known}


def _person_category(path: Path, entries: list[Any], categories: dict[Any, dict[str, Any]]) -> Any:
    """The category of people among those of the entries; None if they have none."""
    used = list(dict.fromkeys(one for entry in entries if (one := _category(entry)) is not None))
    names = {one: str(categories.get(one, {}).get("name", "")).strip().lower() for one in used}
    if len(used) < 2:
        return next(iter(used), None)
    called = [one for one in used if names[one] == "person"]
    if not any(names.values()):
        called = [one for one in used if one == _PERSON]
    if len(called) != 1:
        raise KeypointsError(
            f"{path}: entries of the categories {short(', '.join(names[one] or str(one) for one in used))}, "
            f"of which {'none is' if not called else 'several are'} `person`; keep the entries of people"
        )
    return called[0]


def _named_points(path: Path, category: dict[str, Any] | None) -> _Points | None:
    """The joints that a category names; None if it names none, or the points of COCO in their order."""
    named = category.get("keypoints") if category is not None else None
    if not isinstance(named, list) or not named or not all(isinstance(name, str) for name in named):
        return None
    if not any(map(_is_joint, named)):
        return None
    joints = known_joints(path, named)
    if tuple(joints.values()) == layouts()["COCO_17"] and len(named) == len(joints):
        return None
    return _Points(len(named), tuple(named.index(name) for name in joints), tuple(joints.values()))


def _is_joint(name: str) -> bool:
    try:
        return _memo.joint_name(name) is not None
    except ValueError:  # similar to a joint
        return False


def _kept(values: Array, points: _Points | None, where: str) -> Array:
    if points is None:
        return values
    if len(values) != points.total:
        raise KeypointsError(
            f"{where}: {counted(len(values), 'point')}, and the category names {points.total}"
        )
    return values[list(points.places)]


def write_coco(path: str | PathLike[str], keypoints: Keypoints) -> tuple[str, ...]:
    """Writes results: an entry for every frame with a point; its score is the mean of its points' scores.

    Returns the joints that COCO cannot store, which are left out.
    """
    values, left_out = in_layout(keypoints, "COCO_17")
    entries = []
    for frame, person in zip(keypoints.frames.tolist(), values, strict=True):
        there = person[:, :2].any(axis=1)
        if there.any():
            entries.append(
                {
                    "image_id": frame,
                    "category_id": _PERSON,
                    "keypoints": person.ravel().tolist(),
                    "score": float(person[there, 2].mean()),
                }
            )
    write_text(Path(path), json.dumps(entries, separators=(",", ":")))
    return left_out


def _entries(path: Path, data: Any) -> list[Any]:
    entries = data.get("annotations") if isinstance(data, dict) else data
    if not isinstance(entries, list):
        raise KeypointsError(f"{path}: neither COCO results (a list) nor COCO annotations (`annotations`)")
    return entries


def _image_size(images: Any) -> tuple[int, int] | None:
    """Width and height, if all images have the same size."""
    if not isinstance(images, list) or not all(isinstance(image, dict) for image in images):
        return None
    sizes = [(image.get("width"), image.get("height")) for image in images]
    lengths = [length for size in sizes[:1] for length in size]
    whole = all(type(length) is int and 0 < length < MAX_COORDINATE_PX for length in lengths)
    return sizes[0] if sizes and whole and all(size == sizes[0] for size in sizes) else None


def _write_like(out: Path, keypoints: Keypoints, factor: int, kept: tuple[int, ...] | None) -> None:
    """`factor` of the scores in the file; `kept`: the places of the joints among its points, if not all."""
    source = keypoints.source
    check_all_placed(keypoints)
    content = content_of(source.path)
    data = parsed(source.path, content)
    entries = _entries(source.path, data)
    for row, place in enumerate(source.places):
        if place is None:
            continue
        entry = entries[place] if place < len(entries) else None
        if not isinstance(entry, dict) or "keypoints" not in entry:
            raise KeypointsError(f"{source.path}: has changed since it was read: entry {place} is gone")
        where = f"{source.path}: entry {place}, keypoints"
        changed = with_points(entry["keypoints"], keypoints, row, where, factor, kept)
        if changed is not None:
            entry["keypoints"] = changed
    write_text(out, json_text(data, content))
