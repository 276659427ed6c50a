"""The differences of AlphaPose from COCO and OpenPose.

Its usual results are a COCO list with names of images instead of numbers (read by `coco`). With
`--format open` or `cmu` they are one object of OpenPose frames by the name of the image:
`{"7.jpg": {"people": [...]}}`. Scores above 1, from older versions, are kept.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from memo.keypoints.found import Found, Person, check_all_placed
from memo.keypoints.openpose import change_person, frame_people
from memo.keypoints.points import MAX_FRAME, Keypoints, KeypointsError, Source
from memo.keypoints.text import (
    check_one_series,
    content_of,
    json_text,
    last_number,
    parsed,
    short,
    write_text,
)

__all__ = ["image_number", "is_by_image", "read_by_image"]


def image_number(image_id: Any, where: str) -> int:
    """The frame number from the number of an image or, in AlphaPose, its name."""
    number = last_number(Path(image_id).stem) if isinstance(image_id, str) else image_id
    if isinstance(number, bool) or not isinstance(number, int):
        raise KeypointsError(f"{where}: image_id {short(image_id)} has no frame number")
    if not 0 <= number <= MAX_FRAME:
        raise KeypointsError(f"{where}: image_id {short(image_id)} is not a frame number")
    return number


def is_by_image(data: Any) -> bool:
    """Whether this is an object of frames by the name of their image."""
    first = next(iter(data.values()), None) if isinstance(data, dict) else None
    return isinstance(first, dict) and ("people" in first or "bodies" in first)


def read_by_image(path: Path, data: dict[str, Any]) -> Found:
    """All people in an object of frames by the name of their image."""
    people = []
    names: dict[int, str] = {}
    for image, frame_data in data.items():
        where = f"{path}: {short(image)}"
        frame = image_number(image, where)
        check_one_series(path, names, frame, image)
        for place, values in frame_people(frame_data, where):
            people.append(Person(frame, values, (image, place)))
    return Found(Source(path, _write_by_image), people, frames=tuple(names))


def _write_by_image(out: Path, keypoints: Keypoints) -> None:
    check_all_placed(keypoints)
    source = keypoints.source
    content = content_of(source.path)
    data = parsed(source.path, content)
    for row, place in enumerate(source.places):
        if place is not None:
            image, person = place
            frame = data.get(image) if isinstance(data, dict) else None
            change_person(frame, person, keypoints, row, f"{source.path}: {short(image)}")
    write_text(out, json_text(data, content))
