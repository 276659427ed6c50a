"""The page of a run of `memo track`: pictures, the walker in 3D, curves, parameters, and explanations.

This module computes nothing: the core computed what is drawn, in the run or when a frame is explained.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import memo
from memo.explain import explain
from memo.files import JOINTS
from memo.report.choice import Choice, ordinal
from memo.report.cycles import drawn_cycles, none_sentence
from memo.report.evidence import CHANGED, evidence
from memo.report.page import Page, columns
from memo.report.pictures import LONGEST_PX, Picture, Thinned, colour_frames, jpeg_uri, mask_uri
from memo.report.run_folder import RunFolder, read_run_folder
from memo.report.track_text import track_text
from memo.video import VideoReader

__all__ = ["track_page"]

_PICTURES_BYTES = 14_000_000
_WHY_BYTES = 8_000_000
_MOST_EXPLAINED = 400
_MOST_REGIONS = 5


# Columns of each row in the page, rounded below the resolution of a curve.
_SHOWN = {
    "time_s": 4,
    "x_m": 4,
    "y_m": 4,
    "z_m": 4,
    "heading_rad": 5,
    "phase": 5,
    "p_swapped": 6,
    "speed_mps": 4,
    "sd_x_m": 4,
    "sd_y_m": 4,
    "sd_z_m": 4,
    "sd_phase": 4,
    "similarity": 5,
}

Item = TypeVar("Item")
Progress = Callable[[str, int, "int | None"], object]


def track_page(
    folder: Path, choice: Choice, progress: Progress | None, video: Path | None = None
) -> tuple[Page, dict[str, Any]]:
    """The page of a run folder, and its contents: the number of pictures and explanations, and notes."""
    run = read_run_folder(folder, video)
    notes: list[str] = []
    pictures, drawn, size, every = _pictures(run, choice, progress, notes, must_be_there=video is not None)
    explained, why_every = _explained(run, pictures, choice, progress, notes)
    counts = {
        "pictures": len(pictures),
        "every": every if pictures else None,
        "explained": len({item["frame"] for item in explained}),
        "explained_every": why_every if explained else None,
    }
    notes += choice.told(every if pictures else 1)
    if explained and why_every > 1:
        notes.append(f"Every {ordinal(why_every)} tracked frame in it is explained.")
    page = Page(
        title=f"memo: {run.name}",
        layout="track",
        scripts=("base.js", "view3d.js", "cycles.js"),
        filled=track_text(run, notes, pictures),
        data={
            "name": run.name,
            "pictures": {
                "frame": [picture.frame for picture in pictures],
                "time_s": [round(picture.time_s, 4) for picture in pictures],
                "uri": [picture.uri for picture in pictures],
                "moved": [picture.moved for picture in pictures],
                "regions": [picture.regions for picture in pictures],
                "size": size,
                "drawn": drawn,
            },
            "track": _track(run),
            "events": [event | {"walk": run.walk_of(event)} for event in run.events],
            "camera": _camera(run),
            "cycles": drawn_cycles(run.cycles),
            "no_cycles": none_sentence(run.cycles),
            "why": explained,
        },
    )
    return page, counts | {"notes": notes}


class _NoFrames(ValueError):
    """None of the requested frames exists."""


def _counted(
    progress: Progress | None, step: str, items: Iterable[Item], total: int | None
) -> Iterator[Item]:
    """Yields the items, and reports each when it is done."""
    for done, item in enumerate(items, 1):
        yield item
        if progress is not None:
            progress(step, done, total)


def _pictures(
    run: RunFolder, choice: Choice, progress: Progress | None, notes: list[str], must_be_there: bool
) -> tuple[list[Picture], bool, Sequence[int] | None, int]:
    """The frames as JPEG, whether the model is already drawn on them, the size in pixels that positions
    refer to, and the spacing of the frames. A video that the user named must exist."""
    if run.video is not None:
        try:
            kept, every, size = _video_pictures(run, run.video, choice, progress, notes)
            return kept, False, size, every
        except _NoFrames:
            raise
        except (ValueError, OSError) as error:
            if must_be_there:
                about = "" if str(run.video) in str(error) else f"{run.video}: "
                raise ValueError(f"{about}{_one_line(error)}") from None
            notes.append(f"The video can no longer be read ({_one_line(error)}).")
    if run.overlay is not None:
        try:
            kept, every = _overlay_pictures(run, run.overlay, choice, progress)
            return kept, True, None, every
        except _NoFrames:
            raise
        except (ValueError, OSError) as error:
            notes.append(f"The overlay cannot be read ({_one_line(error)}).")
    notes.append("There are no pictures: neither the video nor overlay.mp4 can be read.")
    return [], False, run.size, 1


def _video_pictures(
    run: RunFolder, video: Path, choice: Choice, progress: Progress | None, notes: list[str]
) -> tuple[list[Picture], int, tuple[int, int]]:
    stop = run.first_frame + run.run["frames_read"] if run.run else None
    thinned: Thinned[Picture] = Thinned(_PICTURES_BYTES, choice.every)
    nobody = not run.frames  # then moving regions are shown: memo looks for a walker there
    rate_hz, shrink = run.run.get("fps_given"), run.run.get("shrink", 1)
    with VideoReader(video, start=run.first_frame, stop=stop, rate_hz=rate_hz, shrink=shrink) as reader:
        size = run.size
        if size is not None and tuple(side // shrink for side in size) != reader.size:
            width, height = reader.full_size
            raise ValueError(f"it has {width}x{height} pixels, the run {size[0]}x{size[1]}")
        before = None
        for frame in _counted(progress, "reading the video", reader, reader.frame_count):
            if choice.takes(frame.index) and thinned.wants_next():
                moved = _moved(before, frame.luma, shrink) if nobody else (None, ())
                picture = Picture(frame.index, frame.time_s, jpeg_uri(frame.luma, LONGEST_PX), *moved)
                thinned.keep(picture, picture.size_bytes)
            before = frame.luma.copy() if nobody else None
        if not thinned.items and choice.chosen:
            raise _NoFrames(f"{video}: no frame of the run is among those requested; {_read(run)}")
        if reader.damage:
            notes.append(f"The video: {reader.damage}.")
    # All of the video except a rest at the right and at the bottom that averaged pictures leave out.
    return thinned.items, thinned.every, (shrink * reader.size[0], shrink * reader.size[1])


def _read(run: RunFolder) -> str:
    """States which frames the run read."""
    count = run.run.get("frames_read")
    return f"it read {run.first_frame} to {run.first_frame + count - 1}" if count else "it read none"


def _overlay_pictures(
    run: RunFolder, overlay: Path, choice: Choice, progress: Progress | None
) -> tuple[list[Picture], int]:
    thinned: Thinned[Picture] = Thinned(_PICTURES_BYTES, choice.every)
    times = dict(zip(run.frames, run.columns["time_s"], strict=True))
    for index, time_s, rgb in _counted(progress, "reading the overlay", colour_frames(overlay), None):
        frame = index + run.first_frame
        if choice.takes(frame) and thinned.wants_next():
            picture = Picture(frame, float(times.get(frame, time_s)), jpeg_uri(rgb, LONGEST_PX))
            thinned.keep(picture, picture.size_bytes)
    if not thinned.items and choice.chosen:
        raise _NoFrames(f"{overlay}: no frame of the run is among those requested; {_read(run)}")
    return thinned.items, thinned.every


def _moved(before: Any, now: Any, shrink: int) -> tuple[str | None, tuple[tuple[int, ...], ...]]:
    """What changed between two frames, and the regions of it that are searched for a walker, in pixels of
    the video."""
    if before is None:
        return None, ()
    changed = memo.change_mask(before, now)
    found = memo.moving_regions(changed)[:_MOST_REGIONS, :4].astype(int)
    regions = np.hstack([found[:, :2] * shrink, (found[:, 2:] + 1) * shrink - 1]).tolist()
    return mask_uri(changed, CHANGED), tuple(tuple(region) for region in regions)


def _explained(
    run: RunFolder, pictures: list[Picture], choice: Choice, progress: Progress | None, notes: list[str]
) -> tuple[list[dict[str, Any]], int]:
    """Frames with their evidence, and their spacing among the tracked frames in the page."""
    shown = {picture.frame for picture in pictures}
    frames = sorted(shown & set(run.frames))
    if not (choice.why and run.run and frames):
        return [], 1
    every = -(-len(frames) // _MOST_EXPLAINED) if choice.every is None else 1
    chosen = frames[::every]
    rows = sum(map(set(chosen).__contains__, run.frames))
    # A frame is kept with all its people or not at all.
    thinned: Thinned[list[dict[str, Any]]] = Thinned(_WHY_BYTES, 1 if choice.every else None)
    items: list[dict[str, Any]] = []
    frame, is_wanted = None, False
    try:
        for why in _counted(progress, "explaining frames", explain(run.path, chosen, video=run.video), rows):
            if why.frame != frame:
                frame, is_wanted, items = why.frame, thinned.wants_next(), []
            if is_wanted:
                items.append(evidence(why))
                thinned.keep(items, sum(len(json.dumps(item)) for item in items))
    except (ValueError, OSError) as error:
        notes.append(f"Frames cannot be explained ({_one_line(error)}).")
    return [item for items in thinned.items for item in items], every * thinned.every


def _track(run: RunFolder) -> dict[str, Any]:
    """The rows: what is plotted, and joints as (rows, 12, 3) metres and (rows, 12, 2) pixels."""
    table = run.columns
    points = [np.stack([table[f"{joint}_{axis}_m"] for axis in "xyz"], axis=1) for joint in JOINTS]
    pixels = [np.stack([table[f"{joint}_{axis}_px"] for axis in "uv"], axis=1) for joint in JOINTS]
    return {
        "frame": [int(frame) for frame in table["frame"]],
        "walk": [int(walk) for walk in table["walk"]],
        "person": [int(person) for person in table["person"]],
        **{name: columns(table[name], digits) for name, digits in _SHOWN.items()},
        "joints": list(JOINTS),
        "points_m": columns(np.stack(points, axis=1), 3),
        "points_px": columns(np.stack(pixels, axis=1), 1),
    }


def _camera(run: RunFolder) -> dict[str, Any] | None:
    camera = run.run.get("camera")
    if camera is None or not {"rotation", "translation"} <= set(camera):
        return None
    return {"rotation": camera["rotation"], "translation": camera["translation"]}


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
