"""`run.json`: the input and the findings of `memo track`, so that its folder can be read and explained.

Keys: `schema` (`SCHEMA`; 1 where it is missing), `memo` (version), `command`, `video` (absolute path, null
where frames were drawn), `frames` ([first, stop], stop null for the end), `frames_read`, `interrupted`
(whether requested frames were left unread: Ctrl-C, or an error in the video), `rate_hz`, `fps_given`, `boxes`
(absolute path of the boxes around people, null without), `shrink` (pixels of the video, along each axis, per
pixel of the pictures that were tracked), `pixels_of` ("video": the unit of the pixels of `track.csv` and of
`camera`), `camera_given`, `camera` (of the video: the camera given, or the one assumed for the longest walk;
the keys of a Pose2Sim TOML, and for Tsai's lens `tsai_kappa` with the distortions nearest to it; null if
nobody was tracked without a camera), `options` (of `Tracker`), `summary` and `sentences` (of `Track`),
`walks` (per walk `message`, `start_s`, `end_s`, `direction`, `gait`, `p_swapped`, `fit`, and the input of
`memo.explain` and `contours_of_run`: pixels there are those of the pictures that were tracked, and frames are
counted from the first one read).

Without `pixels_of`, as in folders of older versions, table and camera are those of the pictures that were
tracked; `read_run`, `read_track_csv` and `read_keypoints` convert them to the video.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo._memo import __version__
from memo.files import write_json
from memo.pixels import camera_of_video, of_video
from memo.wording import counted

__all__ = ["SCHEMA", "RunError", "Source", "contours_of_run", "read_run", "write_run"]

NAME = "run.json"

SCHEMA = 3
"""Version of the files in the folder of a run; docs/reference/files.md says what changed with each."""


class RunError(ValueError):
    """A folder without a run of `memo track`, or whose video is missing; the message says which."""


@dataclass(frozen=True)
class Source:
    """The source of the frames of a run."""

    video: Path | None
    """The video as given, `None` for drawn frames."""
    frames: tuple[int, int | None]
    """First frame and one past the last; `None` for the end of the video."""
    rate_hz: float
    """Average frame rate."""
    fps_given: float | None = None
    """The rate given in place of the time stamps."""
    camera_given: bool = False
    """Whether a calibration was given."""
    shrink: int = 1
    """Pixels of the video per pixel of a frame, along each axis."""
    size: tuple[int, int] | None = None
    """Width and height of the video, pixels, if known."""
    boxes: Path | None = None
    """The file with boxes around people, if one was given."""


def write_run(
    folder: str | PathLike[str],
    track: Any,
    options: Mapping[str, Any],
    source: Source,
    frames_read: int,
    interrupted: bool = False,
) -> Path:
    """Writes `run.json` of a `Track` into a folder; returns its path.

    The track, and the `track.csv` beside it, are in pixels of the video (`Track.of_video`).
    """
    path = Path(folder) / NAME
    if track.shrink != source.shrink:
        raise RunError(
            f"the pictures were shrunk by {source.shrink}, but the pixels of the track are those of pictures "
            f"shrunk by {track.shrink}: give track.of_video({source.shrink})"
        )
    camera = None if track.camera is None else {"name": "camera", **track.camera.parameters()}
    write_json(
        path,
        {
            "schema": SCHEMA,
            "memo": __version__,
            "command": "track",
            "video": None if source.video is None else str(source.video.absolute()),
            "frames": source.frames,
            "frames_read": frames_read,
            "interrupted": interrupted,
            "rate_hz": source.rate_hz,
            "fps_given": source.fps_given,
            "shrink": source.shrink,
            "pixels_of": "video",
            "camera_given": source.camera_given,
            "boxes": None if source.boxes is None else str(source.boxes.absolute()),
            "camera": camera,
            "options": dict(options),
            "summary": track.summary,
            "sentences": track.sentences,
            "walks": track.records,
            "left_out": [left.record for left in track.left_out],
        },
    )
    return path


_KINDS: dict[str, tuple[type, ...]] = {
    "schema": (int,),
    "memo": (str,),
    "command": (str,),
    "video": (str, type(None)),
    "frames": (list,),
    "frames_read": (int,),
    "interrupted": (bool,),
    "rate_hz": (int, float),
    "fps_given": (int, float, type(None)),
    "shrink": (int,),
    "pixels_of": (str,),
    "camera_given": (bool,),
    "camera": (dict, type(None)),
    "options": (dict,),
    "summary": (dict,),
    "sentences": (list,),
    "walks": (list,),
    "left_out": (list,),
}


def read_run(folder: str | PathLike[str]) -> dict[str, Any]:
    """Reads `run.json` of a folder; checks that all keys exist and have the right type.

    `schema`, `interrupted`, `shrink`, `pixels_of` and `left_out` may be missing, as in older folders; they
    are then 1, `False`, 1, "video" and empty, and the camera is converted to that of the video. A schema
    newer than `SCHEMA` is refused.
    """
    path = Path(folder) / NAME
    try:
        run = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise RunError(f"{folder}: holds no {NAME}, so it is not the folder of a memo track") from None
    except OSError as error:
        raise RunError(f"{path}: cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:
        raise RunError(f"{path}: not JSON: {error}") from None
    if not isinstance(run, dict):
        raise RunError(f"{path}: must be an object, got {type(run).__name__}")
    run.setdefault("schema", 1)
    run.setdefault("interrupted", False)
    run.setdefault("shrink", 1)
    of_pictures = "pixels_of" not in run
    run.setdefault("pixels_of", "video")
    run.setdefault("left_out", [])
    for key, kinds in _KINDS.items():
        if key not in run:
            raise RunError(f"{path}: {key} is missing")
        if not isinstance(run[key], kinds):
            wanted = " or ".join("null" if kind is type(None) else kind.__name__ for kind in kinds)
            raise RunError(f"{path}: {key} must be {wanted}, got {json.dumps(run[key])[:60]}")
    first, stop = run["frames"] if len(run["frames"]) == 2 else (None, None)
    if not isinstance(first, int) or first < 0 or not (stop is None or isinstance(stop, int)):
        raise RunError(f"{path}: frames must be [first, stop], got {json.dumps(run['frames'])[:60]}")
    if not 1 <= run["schema"] <= SCHEMA:
        raise RunError(
            f"{path}: schema must be 1 to {SCHEMA}, got {run['schema']}: a newer memo may have written it"
        )
    if run["shrink"] < 1:
        raise RunError(f"{path}: shrink must be at least 1, got {run['shrink']}")
    if run["frames_read"] < 0:
        raise RunError(f"{path}: frames_read must not be negative, got {run['frames_read']}")
    for key in ("walks", "left_out"):
        if not all(isinstance(item, dict) for item in run[key]):
            raise RunError(f"{path}: {key} must be objects")
    if of_pictures and run["shrink"] > 1 and run["camera"] is not None:
        try:
            run["camera"] = camera_of_video(run["camera"], run["shrink"])
        except (KeyError, TypeError, ValueError):
            raise RunError(f"{path}: camera is not that of a run") from None
    return run


def contours_of_run(
    path: str | PathLike[str], columns: Mapping[str, npt.NDArray[Any]]
) -> list[npt.NDArray[np.float64]]:
    """Visible contours of the model, (n, 2, 2) pixels of the video, for each row of a track.

    They are those of `Track.contours`. `path` is the folder of a run or a table in it, `columns` are those of
    the table. A row with an unknown position or phase has none, nor has one of a frame that the run did not
    track.
    """
    folder = Path(path) if Path(path).is_dir() else Path(path).parent
    run = read_run(folder)
    contours: list[npt.NDArray[np.float64]] = [np.empty((0, 2, 2))] * len(columns["walk"])
    known = np.isfinite(np.asarray(columns["x_m"], np.float64) + np.asarray(columns["phase"], np.float64))
    first = run["frames"][0]  # the record counts from the first frame read
    frames = np.where(known, np.asarray(columns["frame"], np.int64), -1)
    for walk in np.unique(columns["walk"]).tolist():
        if not 0 <= walk < len(run["walks"]):
            raise RunError(
                f"{folder / NAME}: has {counted(len(run['walks']), 'walk')}, the table has a walk {walk}"
            )
        rows = np.flatnonzero(columns["walk"] == walk)
        try:
            found = _memo.recorded_contours(run["walks"][walk], (frames[rows] - first).tolist())
        except (TypeError, ValueError, OverflowError) as error:
            raise RunError(f"{folder / NAME}: {error}") from None
        for row, (segments, _) in zip(rows.tolist(), found, strict=True):
            contours[row] = of_video(segments, run["shrink"])
    return contours
