"""Which detector wrote a file or a folder, recognised by its content, and all people in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from memo.keypoints.coco import read_coco
from memo.keypoints.deeplabcut import (
    is_deeplabcut,
    is_deeplabcut_h5,
    read_deeplabcut,
    read_deeplabcut_h5,
)
from memo.keypoints.found import Found
from memo.keypoints.hdf5 import ENDINGS, opened
from memo.keypoints.mediapipe import is_mediapipe, is_nobody, read_mediapipe
from memo.keypoints.mmpose import is_instances, is_mmpose, read_images, read_mmpose
from memo.keypoints.openpose import numbered_files, read_openpose
from memo.keypoints.points import KeypointsError
from memo.keypoints.sleap import is_sleap, is_sleap_h5, read_sleap, read_sleap_h5
from memo.keypoints.table import read_csv, read_parquet_table
from memo.keypoints.text import MAX_FRAME_FILE_BYTES, content_of, parsed, short
from memo.keypoints.trc import is_trc, read_trc
from memo.keypoints.vitpose import is_vitpose, read_vitpose
from memo.keypoints.yolo import is_detections, read_detections, read_labels

__all__ = ["everybody_in", "is_no_table"]

ImageSize = tuple[int, int] | None

_NO_TEXT = (".parquet", ".slp", *ENDINGS)
_TEXTS = ((is_trc, read_trc), (is_deeplabcut, read_deeplabcut), (is_sleap, read_sleap))


def everybody_in(path: Path, image_size: ImageSize) -> Found:
    """All people in a file or folder; `image_size` turns fractions of the picture into pixels."""
    if path.is_dir():
        return _in_folder(path, image_size)
    if not path.is_file():
        raise KeypointsError(f"{path}: neither a file nor a folder")
    ending = path.suffix.lower()
    if ending == ".parquet":
        return read_parquet_table(path)
    if ending in ENDINGS:
        return _in_hdf5(path)
    if ending == ".slp":
        raise KeypointsError(f"{path}: a project of SLEAP; export its analysis (.h5 or .csv)")
    content = content_of(path)
    if not content.strip():
        raise KeypointsError(f"{path}: the file is empty")
    if _is_json(path, content):
        return _in_json(path, _with_people(path, parsed(path, content)), image_size)
    for is_own, read in _TEXTS:
        if is_own(content):
            return read(path, content)
    return read_csv(path, content)


def is_no_table(path: Path) -> bool:
    """Whether `everybody_in` reads this file or folder as something else than a table in CSV."""
    if path.is_dir() or path.suffix.lower() in _NO_TEXT:
        return True
    content = content_of(path)
    return _is_json(path, content) or any(is_own(content) for is_own, _ in _TEXTS)


def _is_json(path: Path, content: str) -> bool:
    return path.suffix.lower() == ".json" or content.lstrip()[:1] in ("{", "[")


def _in_folder(folder: Path, image_size: ImageSize) -> Found:
    if (folder / "postures.json").is_file():
        raise KeypointsError(f"{folder}: a folder of `memo posture` holds joints in space, and no keypoints")
    endings = {entry.suffix.lower() for entry in folder.iterdir() if not entry.name.startswith(".")}
    if ".txt" in endings and ".json" not in endings:
        return read_labels(folder, numbered_files(folder, ".txt"), image_size)
    files = numbered_files(folder)
    first = next(iter(files.values()))
    if not _is_list_of_people(parsed(first, content_of(first, MAX_FRAME_FILE_BYTES))):
        return read_openpose(folder)
    images = [
        (frame, file, parsed(file, content_of(file, MAX_FRAME_FILE_BYTES))) for frame, file in files.items()
    ]
    people = next((data for _, _, data in images if data), None)
    if people is None:
        raise KeypointsError(f"{folder}: no person in any frame")
    if is_instances(people):
        return read_images(folder, images)
    if is_detections(people):
        frames = [(frame, str(file), data) for frame, file, data in images]
        return read_detections(folder, frames, image_size)
    raise KeypointsError(
        f"{folder}: its JSON files hold lists, neither MMPose's (keypoints, keypoint_scores) nor YOLO's "
        f"(box, keypoints); got {_described(people)}"
    )


def _with_people(path: Path, data: Any) -> Any:
    """The list or object of a JSON file, with its texts read; refused if it has nobody."""
    if isinstance(data, list) and data and all(isinstance(entry, str) for entry in data):
        data = [parsed(f"{path}: entry {frame}", text) for frame, text in enumerate(data)]
    if not isinstance(data, dict | list):
        raise KeypointsError(
            f"{path}: holds {short(json.dumps(data))} and no keypoints: wanted a list with an entry for each "
            "frame, or an object"
        )
    if isinstance(data, list) and all(map(is_nobody, data)):
        raise KeypointsError(f"{path}: no person in any frame")
    return data


def _in_json(path: Path, data: Any, image_size: ImageSize) -> Found:
    if is_mmpose(data):
        return read_mmpose(path, data)
    if is_vitpose(data):
        return read_vitpose(path, data)
    if is_mediapipe(data):
        return read_mediapipe(path, data, image_size)
    if isinstance(data, list) and is_detections(next((entry for entry in data if entry), None)):
        frames = [(frame, f"{path}: entry {frame}", entry) for frame, entry in enumerate(data)]
        return read_detections(path, frames, image_size)
    if is_detections(data) or is_instances(data):
        raise KeypointsError(f"{path}: the people of one picture; give the folder of all")
    if isinstance(data, list) and not isinstance(data[0], dict):
        raise KeypointsError(f"{path}: {_unknown_list(data)}")
    return read_coco(path, data)


def _unknown_list(data: list[Any]) -> str:
    """What is wanted in place of a list of no known form."""
    try:
        shape = np.array(data, np.float64).shape
    except (TypeError, ValueError, OverflowError):
        return f"a list whose first entry is {_described(data[0])}: no known form of keypoints"
    return (
        f"an array of shape {shape}, which does not name its points: read it with NumPy and pass it to "
        'memo.Keypoints.from_arrays(points, names="COCO_17")'
    )


def _in_hdf5(path: Path) -> Found:
    with opened(path) as file:
        is_dlc, is_analysis, names = is_deeplabcut_h5(file), is_sleap_h5(file), sorted(map(str, file))
    if is_dlc:
        return read_deeplabcut_h5(path)
    if is_analysis:
        return read_sleap_h5(path)
    raise KeypointsError(
        f"{path}: neither DeepLabCut's (df_with_missing) nor SLEAP's analysis (tracks, node_names); "
        f"got {short(', '.join(names)) or 'nothing'}"
    )


def _is_list_of_people(data: Any) -> bool:
    return isinstance(data, list) and all(isinstance(person, dict) for person in data)


def _described(data: Any) -> str:
    first = data[0] if isinstance(data, list) and data else data
    return short(", ".join(map(str, first)) if isinstance(first, dict) else type(first).__name__)
