"""COCO: results, a list of `{image_id, keypoints, score}`, and annotations, an object with `annotations`.

The visibility 0, 1, 2 of annotations becomes the score 0, 0.5, 1. The number of an image, or the last number
in its name, is the frame number; names of images of several cameras or videos are refused. Written files are
results with the 17 COCO points, whatever the source of the points; they hold no frame rate.
"""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path
from typing import Any

from memo.keypoints.alphapose import image_number, is_by_image, read_by_image
from memo.keypoints.found import (
    MAX_COORDINATE_PX,
    Found,
    Person,
    check_all_placed,
    triples,
    with_points,
)
from memo.keypoints.layout import in_layout
from memo.keypoints.points import Keypoints, KeypointsError, Source
from memo.keypoints.text import check_one_series, content_of, json_text, parsed, write_text

__all__ = ["read_coco", "write_coco"]

_PERSON = 1  # COCO's category


def read_coco(path: Path, data: Any) -> Found:
    """All people in a file of results or annotations."""
    if is_by_image(data):
        return read_by_image(path, data)
    if isinstance(data, dict) and ("people" in data or "bodies" in data):
        raise KeypointsError(f"{path}: one frame of OpenPose; give the folder of all frames")
    is_annotations = isinstance(data, dict)
    people = []
    images: dict[int, str] = {}
    for place, entry in enumerate(_entries(path, data)):
        where = f"{path}: entry {place}"
        if not isinstance(entry, dict) or "image_id" not in entry or "keypoints" not in entry:
            raise KeypointsError(f"{where}: needs image_id and keypoints")
        values = triples(entry["keypoints"], f"{where}, keypoints")
        if is_annotations:
            values[:, 2] /= 2
        frame = image_number(entry["image_id"], where)
        if isinstance(entry["image_id"], str):
            check_one_series(path, images, frame, entry["image_id"])
        if len(values):
            people.append(Person(frame, values, place))
    size = _image_size(data.get("images")) if is_annotations else None
    return Found(
        Source(path, _write_annotations if is_annotations else _write_results), people, image_size=size
    )


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


def _write_results(out: Path, keypoints: Keypoints) -> None:
    _write_like(out, keypoints, 1)


def _write_annotations(out: Path, keypoints: Keypoints) -> None:
    _write_like(out, keypoints, 2)


def _write_like(out: Path, keypoints: Keypoints, factor: int) -> None:
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
        changed = with_points(entry["keypoints"], keypoints, row, where, factor)
        if changed is not None:
            entry["keypoints"] = changed
    write_text(out, json_text(data, content))
