"""OpenPose: a folder with one JSON file per frame; the last number in a file's name is its frame number.

Written files have the 25 points of BODY_25, whatever the source of the keypoints; they hold no frame rate.
The `sep-json` of AlphaPose in CMU's form is the same with `bodies` and `joints`.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

from memo.keypoints.found import Found, Person, check_all_placed, triples, with_points
from memo.keypoints.layout import in_layout
from memo.keypoints.points import MAX_FRAME, Array, Keypoints, KeypointsError, Source
from memo.keypoints.text import MAX_FRAME_FILE_BYTES, content_of, json_text, last_number, parsed
from memo.unfinished import complete_folder

__all__ = ["frame_people", "numbered_files", "read_openpose", "write_openpose"]

_MAX_FRAME_FILES = 1_000_000
_LISTS = ("people", "bodies")
_POSE_KEYS = ("pose_keypoints_2d", "pose_keypoints", "joints")
#: The other fields that OpenPose writes for a person, here empty.
_OTHER_KEYS = (
    *("face_keypoints_2d", "hand_left_keypoints_2d", "hand_right_keypoints_2d"),
    *("pose_keypoints_3d", "face_keypoints_3d", "hand_left_keypoints_3d", "hand_right_keypoints_3d"),
)


def read_openpose(folder: Path) -> Found:
    """All people in a folder of frames."""
    files = numbered_files(folder)
    people = []
    for frame, file in files.items():
        data = parsed(file, content_of(file, MAX_FRAME_FILE_BYTES))
        for place, values in frame_people(data, str(file)):
            people.append(Person(frame, values, (file, place)))
    source = Source(folder, _write_like, files=tuple(files.values()))
    return Found(source, people, frames=tuple(files))


def write_openpose(
    folder: str | PathLike[str], keypoints: Keypoints, *, name: str | None = None
) -> tuple[str, ...]:
    """Writes `NAME_000000000007_keypoints.json` for every frame, BODY_25; default NAME: that of the folder.

    Returns the joints that BODY_25 cannot store, which are left out. Neck and middle of the hips are the
    middles of shoulders and hips if the keypoints have none. A frame without any point has no people.
    """
    out = Path(folder)
    if not len(keypoints.frames):
        raise KeypointsError(f"{out}: no frame to write")
    values, left_out = in_layout(keypoints, "BODY_25")
    stem = out.resolve().name if name is None else name
    texts = {
        f"{stem}_{frame:012d}_keypoints.json": _frame_text(values[row])
        for row, frame in enumerate(keypoints.frames.tolist())
    }
    _write_folder(out, texts)
    return left_out


def _frame_text(values: Array) -> str:
    people = []
    if values.any():
        person = {"person_id": [-1], "pose_keypoints_2d": values.ravel().tolist()}
        people.append(person | {key: [] for key in _OTHER_KEYS})
    return json.dumps({"version": 1.3, "people": people}, separators=(",", ":"))


def frame_people(data: Any, where: str) -> Iterator[tuple[int, Array]]:
    """Place and values of the people with body points in a frame."""
    people = _people(data)
    if people is None:
        raise KeypointsError(f"{where}: not OpenPose's JSON: no list `people`")
    for place, person in enumerate(people):
        key = _pose_key(person)
        if key is None:
            raise KeypointsError(f"{where}: people[{place}] has no {_POSE_KEYS[0]}")
        if person[key]:
            yield place, triples(person[key], f"{where}: people[{place}].{key}")


def change_person(data: Any, place: int, keypoints: Keypoints, row: int, where: str) -> bool:
    """Puts the points of a row into a person of a frame; False if they are there already."""
    people = _people(data)
    person = people[place] if people is not None and place < len(people) else None
    key = _pose_key(person)
    if person is None or key is None:
        raise KeypointsError(f"{where}: has changed since it was read: people[{place}] is gone")
    changed = with_points(person[key], keypoints, row, f"{where}: people[{place}].{key}")
    if changed is not None:
        person[key] = changed
    return changed is not None


def _people(data: Any) -> list[Any] | None:
    lists = [data[key] for key in _LISTS if key in data] if isinstance(data, dict) else []
    return lists[0] if lists and isinstance(lists[0], list) else None


def _pose_key(person: Any) -> str | None:
    return next((key for key in _POSE_KEYS if isinstance(person, dict) and key in person), None)


def numbered_files(folder: Path, ending: str = ".json") -> dict[int, Path]:
    """The files of a folder with this ending by the last number in their names, in order."""
    numbered: dict[int, Path] = {}
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() != ending or file.name.startswith(".") or not file.is_file():
            continue
        frame = last_number(file.stem)
        if frame is None:
            raise KeypointsError(f"{file}: no frame number in the name")
        if frame > MAX_FRAME:
            raise KeypointsError(
                f"{file}: {frame} in the name is not a frame number, which is at most {MAX_FRAME}:"
                " number the files by frame"
            )
        if frame in numbered:
            other = numbered[frame].name
            raise KeypointsError(
                f"{folder}: {other} and {file.name} are both frame {frame}; one camera per folder"
            )
        numbered[frame] = file
        if len(numbered) > _MAX_FRAME_FILES:
            raise KeypointsError(f"{folder}: more than {_MAX_FRAME_FILES} files")
    if not numbered:
        raise KeypointsError(
            f"{folder}: a folder without keypoints: wanted JSON files, one for each frame (OpenPose, MMPose, "
            "YOLO), label files of YOLO (.txt), or a track.csv"
        )
    return dict(sorted(numbered.items()))


def _write_like(out: Path, keypoints: Keypoints) -> None:
    source = keypoints.source
    check_all_placed(keypoints)
    rows = {place[0]: (row, place[1]) for row, place in enumerate(source.places) if place is not None}
    contents: dict[str, str | Path] = {}
    for file in source.files:
        contents[file.name] = file
        if file in rows:
            row, place = rows[file]
            content = content_of(file, MAX_FRAME_FILE_BYTES)
            data = parsed(file, content)
            if change_person(data, place, keypoints, row, str(file)):
                contents[file.name] = json_text(data, content)
    _write_folder(out, contents)


def _write_folder(out: Path, contents: Mapping[str, str | Path]) -> None:
    """Writes files, each a text or a copy of another file, as a folder, complete or not at all."""
    _check_replaceable(out, contents.keys())
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with complete_folder(out) as temporary:
            for name, content in contents.items():
                if isinstance(content, Path):
                    shutil.copyfile(content, temporary / name)
                else:
                    (temporary / name).write_text(content, encoding="utf-8")
    except OSError as error:
        raise KeypointsError(f"{out}: cannot be written: {error.strerror or error}") from None


def _check_replaceable(out: Path, names: Any) -> None:
    if not out.exists():
        return
    if not out.is_dir():
        raise KeypointsError(f"{out}: is a file; the output is a folder")
    others = sorted(entry.name for entry in out.iterdir() if entry.name not in names or not entry.is_file())
    if others:
        raise KeypointsError(f"{out}: holds other files ({others[0]}); choose an empty or new folder")
