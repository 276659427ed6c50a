"""RTMPose and every other model of MMPose, ViTPose included: the JSON files that MMPose writes.

- `demo/topdown_demo_with_mmdet.py --save-predictions` and other demos: `{"meta_info", "instance_info"}`,
  with a list of `{"frame_id", "instances"}` in which the first frame of the video is 1;
  `meta_info.keypoint_id2name` names the points.
- `MMPoseInferencer(..., pred_out_dir=...)` of a video: a list of `{"frame_id", "instances"}`, from 0; of a
  folder of images: a folder of JSON files, each a list of instances. The dictionaries that it yields, as a
  list.

An instance is `{"keypoints": [[x, y], ...], "keypoint_scores": [...], "bbox", "bbox_score"}`. Sources:
open-mmlab/mmpose `mmpose/structures/utils.py` (`split_instances`),
`mmpose/apis/inferencers/base_mmpose_inferencer.py`, and its demos (`frame_idx`).

Of the 133 points of COCO-WholeBody the 17 of the body and the 6 of the feet are kept; points of hands and
the outline of the face have no names here.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.keypoints.found import Found, Person, with_missing
from memo.keypoints.points import MAX_FRAME, Array, KeypointsError, Source, layouts
from memo.keypoints.text import short

__all__ = ["is_instances", "is_mmpose", "read_images", "read_mmpose"]

_WHOLE_BODY = 133
_FEET = ("big_toe", "small_toe", "heel")


def is_mmpose(data: Any) -> bool:
    """Whether this is the JSON of MMPose for a whole video."""
    if isinstance(data, dict):
        return "instance_info" in data or "predictions" in data
    first = next((entry for entry in data if entry), None) if isinstance(data, list) else None
    if isinstance(first, dict):
        return "instances" in first or "predictions" in first
    return isinstance(first, list) and is_instances(first)


def is_instances(people: Any) -> bool:
    """Whether this is a list of instances, which MMPose writes for one image."""
    first = people[0] if isinstance(people, list) and people else None
    return isinstance(first, dict) and "keypoint_scores" in first


def read_mmpose(path: Path, data: Any) -> Found:
    """All people in a file."""
    named = _names_of(data.get("meta_info")) if isinstance(data, dict) else None
    entries = list(_frames(path, data))
    is_demo = isinstance(data, dict) and "instance_info" in data
    first = 1 if is_demo and min((number for number, _, _ in entries), default=0) > 0 else 0
    people: list[Person] = []
    frames = []
    for number, instances, where in entries:
        frame = number - first
        frames.append(frame)
        if not isinstance(instances, list):
            raise KeypointsError(f"{where}: wanted a list of people, got {short(instances)}")
        for place, instance in enumerate(instances):
            people.append(Person(frame, _values(instance, f"{where}, instance {place}"), None))
    return _with_names(path, people, tuple(frames), named)


def read_images(path: Path, images: Sequence[tuple[int, Path, Any]]) -> Found:
    """All people in a folder with a list of instances per image."""
    people = []
    for frame, file, data in images:
        if not (data == [] or is_instances(data)):
            raise KeypointsError(f"{file}: not a list of MMPose's instances as the other files are")
        for place, instance in enumerate(data):
            people.append(Person(frame, _values(instance, f"{file}: instance {place}"), None))
    return _with_names(path, people, tuple(frame for frame, _, _ in images), None)


def _frames(path: Path, data: Any) -> Iterator[tuple[int, Any, str]]:
    """Frame number, instances and place of each frame."""
    entries = data.get("instance_info", data.get("predictions")) if isinstance(data, dict) else data
    if not isinstance(entries, list):
        raise KeypointsError(f"{path}: instance_info or predictions: wanted a list, got {short(entries)}")
    seen: dict[int, int] = {}
    for index, entry in enumerate(entries):
        where = f"{path}: entry {index}"
        frame, people = index, entry
        if (
            isinstance(entry, dict) and "predictions" in entry
        ):  # as the inferencer yields them, a batch of one
            people = entry["predictions"]
            people = people[0] if isinstance(people, list) and len(people) == 1 else people
        elif isinstance(entry, dict):
            if not {"frame_id", "instances"} <= entry.keys():
                raise KeypointsError(f"{where}: wanted frame_id and instances, got {short(', '.join(entry))}")
            frame, people = entry["frame_id"], entry["instances"]
        if type(frame) is not int or not 0 <= frame <= MAX_FRAME:
            raise KeypointsError(f"{where}: frame_id {short(frame)} is not a frame number")
        if frame in seen:
            raise KeypointsError(f"{where}: frame_id {frame} is also that of entry {seen[frame]}")
        seen[frame] = index
        yield frame, people, where


def _values(instance: Any, where: str) -> Array:
    """(K, 3) x, y, score of an instance."""
    if not isinstance(instance, dict) or not {"keypoints", "keypoint_scores"} <= instance.keys():
        got = ", ".join(instance) if isinstance(instance, dict) else type(instance).__name__
        raise KeypointsError(f"{where}: wanted keypoints and keypoint_scores, got {short(got)}")
    try:
        points = np.array(instance["keypoints"], np.float64)
        scores = np.array([math.nan if s is None else s for s in instance["keypoint_scores"]], np.float64)
    except (TypeError, ValueError):
        raise KeypointsError(f"{where}: keypoints and scores must be numbers") from None
    if points.ndim != 2 or points.shape[1] != 2 or scores.shape != points.shape[:1]:
        raise KeypointsError(
            f"{where}: wanted points (K, 2) in the picture and a score for each, "
            f"got {points.shape} and {scores.shape}"
        )
    return with_missing(np.column_stack([points, scores]), where)


def _names_of(meta: Any) -> list[str | None] | None:
    """The joint of each point, None if it is not one of memo; None if the file does not name its points."""
    table = meta.get("keypoint_id2name") if isinstance(meta, dict) else None
    if not isinstance(table, dict) or set(table) != {str(index) for index in range(len(table))}:
        return None
    return [_joint(str(table[str(index)])) for index in range(len(table))]


def _joint(name: str) -> str | None:
    try:
        return _memo.joint_name(name)
    except ValueError:  # similar to a joint, such as left_thumb2
        return None


def _with_names(
    path: Path, people: list[Person], frames: tuple[int, ...], named: list[str | None] | None
) -> Found:
    """Only the points that have names, if the file names them or has the points of the whole body."""
    source = Source(path, None)
    counts = {len(person.values) for person in people}
    if named is None and counts == {_WHOLE_BODY}:
        feet = [f"{side}_{part}" for side in ("left", "right") for part in _FEET]
        named = [*layouts()["COCO_17"], *feet, *[None] * (_WHOLE_BODY - 17 - len(feet))]
    if named is None or counts != {len(named)} or len(set(named) - {None}) < len(named) - named.count(None):
        return Found(source, people, frames=frames)
    places = [index for index, joint in enumerate(named) if joint is not None]
    if not places:
        raise KeypointsError(f"{path}: keypoint_id2name names no joint that memo knows")
    kept = [Person(person.frame, person.values[places], None) for person in people]
    return Found(source, kept, names=tuple(str(named[place]) for place in places), frames=frames)
