"""The page of a run of `memo track`: pictures, the walker in 3D, curves, parameters, and why.

Bookkeeping alone: what is drawn was computed by the core, in the run or when a frame is explained again.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import memo
from memo.explain import Why, explain
from memo.files import JOINTS
from memo.gait import DEFINITIONS, GAIT_COLUMNS
from memo.report import normative
from memo.report.choice import Choice, ordinal
from memo.report.page import UNKNOWN, Page, columns, number, rows_table, text
from memo.report.pictures import Picture, Thinned, colour_frames, jpeg_uri, mask_uri, packed
from memo.report.run_folder import RunFolder, read_run_folder
from memo.video import VideoReader

__all__ = ["track_page"]

_LONGEST_PX = 720
_PICTURES_BYTES = 14_000_000
_WHY_BYTES = 8_000_000
_MOST_EXPLAINED = 400
_CROP_MARGIN = 0.25
_MOST_REGIONS = 5
_DEEPEST = 4
_LIKELY_SWAPPED = 0.2

_CHANGED = (0, 158, 115)  # of the palette of Okabe and Ito, like the colours of the sides
_EDGE = (240, 228, 66)

# What goes into the page of every row, with digits that no curve shows.
_SHOWN = {
    "time_s": 4,
    "x_m": 4,
    "y_m": 4,
    "z_m": 4,
    "heading_rad": 5,
    "phase": 4,
    "p_swapped": 6,
    "speed_mps": 3,
    "sd_x_m": 4,
    "sd_y_m": 4,
    "sd_z_m": 4,
    "sd_phase": 4,
    "similarity": 4,
    "right_hip_deg": 2,
    "right_knee_deg": 2,
    "left_hip_deg": 2,
    "left_knee_deg": 2,
}

Item = TypeVar("Item")
Watch = Callable[[Iterable[Item], str, "int | None"], Iterable[Item]]


def track_page(
    folder: Path, choice: Choice, watch: Watch[Any], video: Path | None = None
) -> tuple[Page, dict[str, Any]]:
    """The page of a run folder, and what went into it: how many pictures and explanations, and notes."""
    run = read_run_folder(folder, video)
    notes: list[str] = []
    pictures, drawn, size, every = _pictures(run, choice, watch, notes)
    explained, why_every = _explained(run, choice, watch, notes)
    counts = {
        "pictures": len(pictures),
        "every": every if pictures else None,
        "explained": len(explained),
        "explained_every": why_every if explained else None,
    }
    notes += choice.told(every if pictures else 1)
    if explained and why_every > 1:
        notes.append(f"Every {ordinal(why_every)} tracked frame is explained.")
    page = Page(
        title=f"memo: {run.name}",
        layout="track",
        filled=_filled(run, notes, pictures),
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
            "events": run.events,
            "camera": _camera(run),
            "band": normative.band(),
            "why": explained,
        },
    )
    return page, counts | {"notes": notes}


# What goes in as data.


def _pictures(
    run: RunFolder, choice: Choice, watch: Watch[Any], notes: list[str]
) -> tuple[list[Picture], bool, Sequence[int] | None, int]:
    """The frames as JPEG, whether the model is drawn on them already, the size in pixels that positions
    refer to, and every how many-th frame they are."""
    if run.video is not None:
        try:
            kept, every, size = _video_pictures(run, run.video, choice, watch, notes)
            return kept, False, size, every
        except (ValueError, OSError) as error:
            notes.append(f"The video cannot be read any more ({_one_line(error)}).")
    if run.overlay is not None:
        try:
            kept, every = _overlay_pictures(run, run.overlay, choice, watch)
            return kept, True, None, every
        except (ValueError, OSError) as error:
            notes.append(f"The overlay cannot be read ({_one_line(error)}).")
    notes.append("There are no pictures: neither the video nor overlay.mp4 can be read.")
    return [], False, run.size, 1


def _video_pictures(
    run: RunFolder, video: Path, choice: Choice, watch: Watch[Any], notes: list[str]
) -> tuple[list[Picture], int, tuple[int, int]]:
    stop = run.first_frame + run.run["frames_read"] if run.run else None
    thinned: Thinned[Picture] = Thinned(_PICTURES_BYTES, choice.every)
    nobody = not run.frames  # then what moves is shown, for that is where memo looks for a walker
    with VideoReader(video, start=run.first_frame, stop=stop, rate_hz=run.run.get("fps_given")) as reader:
        size = run.size
        if size is not None and tuple(size) != reader.size:
            raise ValueError(f"it has {reader.size[0]}x{reader.size[1]} pixels, the run {size[0]}x{size[1]}")
        before = None
        for frame in watch(reader, "reading the video", reader.frame_count):
            if choice.takes(frame.index) and thinned.wants_next():
                moved = _moved(before, frame.luma) if nobody else (None, ())
                picture = Picture(frame.index, frame.time_s, jpeg_uri(frame.luma, _LONGEST_PX), *moved)
                thinned.keep(picture, picture.size_bytes)
            before = frame.luma.copy() if nobody else None
        if reader.damage:
            notes.append(f"The video: {reader.damage}.")
    return thinned.items, thinned.every, reader.size


def _overlay_pictures(
    run: RunFolder, overlay: Path, choice: Choice, watch: Watch[Any]
) -> tuple[list[Picture], int]:
    thinned: Thinned[Picture] = Thinned(_PICTURES_BYTES, choice.every)
    times = dict(zip(run.frames, run.columns["time_s"], strict=True))
    for index, time_s, rgb in watch(colour_frames(overlay), "reading the overlay", None):
        frame = index + run.first_frame
        if choice.takes(frame) and thinned.wants_next():
            picture = Picture(frame, float(times.get(frame, time_s)), jpeg_uri(rgb, _LONGEST_PX))
            thinned.keep(picture, picture.size_bytes)
    return thinned.items, thinned.every


def _moved(before: Any, now: Any) -> tuple[str | None, tuple[tuple[int, ...], ...]]:
    """What changed between two frames, and the regions of it in which a walker is looked for."""
    if before is None:
        return None, ()
    changed = memo.change_mask(before, now)
    regions = memo.moving_regions(changed)[:, :4].astype(int).tolist()
    return mask_uri(changed, _CHANGED), tuple(tuple(region) for region in regions[:_MOST_REGIONS])


def _explained(
    run: RunFolder, choice: Choice, watch: Watch[Any], notes: list[str]
) -> tuple[list[dict[str, Any]], int]:
    """Frames with what was seen in them, and every how many-th of the tracked ones they are."""
    frames = [frame for frame in run.frames if choice.takes(frame)]
    if not (choice.why and run.run and frames):
        return [], 1
    every = choice.every or -(-len(frames) // _MOST_EXPLAINED)
    chosen = frames[::every]
    thinned: Thinned[dict[str, Any]] = Thinned(_WHY_BYTES, 1 if choice.every else None)
    try:
        for why in watch(explain(run.path, chosen, video=run.video), "explaining frames", len(chosen)):
            if thinned.wants_next():
                item = _why(why)
                thinned.keep(item, len(json.dumps(item)))
    except (ValueError, OSError) as error:
        notes.append(f"Frames cannot be explained ({_one_line(error)}).")
    return thinned.items, every * thinned.every


def _why(why: Why) -> dict[str, Any]:
    """What was seen around the walker in one frame; pixels count from the corner of the part shown."""
    left, top, right, bottom = _around(why)
    corner = np.array([left, top], np.float64)
    part = np.s_[top:bottom, left:right]
    edges = np.zeros(why.luma.shape, bool)
    places = np.round(why.edge_points).astype(int)
    inside = places[((places >= 0) & (places < why.luma.shape[::-1])).all(axis=1)]
    edges[inside[:, 1], inside[:, 0]] = True

    def lines(segments: Any, clipped: bool = False) -> str:
        segments = np.asarray(segments, np.float64).reshape(-1, 2, 2)
        if clipped:
            near = (segments.max(axis=1) >= corner) & (segments.min(axis=1) <= (right, bottom))
            segments = segments[near.all(axis=1)]
        return packed(segments - corner)

    return {
        "frame": int(why.frame),
        "corner": [left, top],
        "size": [right - left, bottom - top],
        "luma": jpeg_uri(why.luma[part], _LONGEST_PX),
        "change": mask_uri(why.change_mask[part], _CHANGED),
        "edges": mask_uri(edges[part], _EDGE),
        "segments": lines(why.segments, clipped=True),
        "model": lines(why.model),
        "part": [int(number) for number in why.model_part],
        "matched": columns(why.matched, 2),
        "matched_edges": lines(why.matched_edges),
        "phase_grid": columns(why.phase_grid, 3),
        "similarity": columns(why.similarity, 4),
        "phase": columns(why.phase, 4),
    }


def _around(why: Why) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of the part of the frame with the model and a margin; all without a model."""
    height, width = why.luma.shape
    points = np.asarray(why.model, np.float64).reshape(-1, 2)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return 0, 0, width, height
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
    margin = _CROP_MARGIN * max(right - left, bottom - top)
    left, top = max(0, int(left - margin)), max(0, int(top - margin))
    right, bottom = min(width, int(right + margin) + 1), min(height, int(bottom + margin) + 1)
    return (left, top, right, bottom) if left < right and top < bottom else (0, 0, width, height)


def _track(run: RunFolder) -> dict[str, Any]:
    """The rows: what is plotted, and joints as (rows, 12, 3) metres and (rows, 12, 2) pixels."""
    table = run.columns
    points = [np.stack([table[f"{joint}_{axis}_m"] for axis in "xyz"], axis=1) for joint in JOINTS]
    pixels = [np.stack([table[f"{joint}_{axis}_px"] for axis in "uv"], axis=1) for joint in JOINTS]
    return {
        "frame": [int(frame) for frame in table["frame"]],
        "walk": [int(walk) for walk in table["walk"]],
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


# What goes in as text.


def _filled(run: RunFolder, notes: list[str], pictures: list[Picture]) -> dict[str, str]:
    status, tone = _status(run)
    return {
        "version": text(memo.__version__),
        "folder": text(run.path.resolve().name),
        "name": text(run.name),
        "status": text(status),
        "tone": tone,
        "sentences": "".join(f"<p>{text(sentence)}</p>" for sentence in _sentences(run)),
        "warnings": _warnings(run, notes),
        "parameters": _parameters(run),
        "walks": _walks(run),
        "events": _events(run),
        "band_source": text(normative.SOURCE),
        "how": _how(run),
        "moved": text(_moved_sentence(pictures)),
        "nobody": " hidden" if run.frames else "",
        "somebody": "" if run.frames else " hidden",
    }


def _status(run: RunFolder) -> tuple[str, str]:
    """What became of the run in two words, and how it is coloured."""
    status = (run.run.get("summary") or {}).get("status")
    if not run.frames:
        return str(status or "nobody tracked"), "bad"
    return str(status or "tracked"), "good" if status in (None, "tracked") else "fair"


def _sentences(run: RunFolder) -> list[str]:
    told = [str(sentence) for sentence in run.run.get("sentences") or ()]
    message = (run.run.get("summary") or {}).get("message")
    if not told and message:
        told = [str(message)]
    if told:
        return told
    frames = run.frames
    if not frames:
        return ["Nobody was tracked in this video."]
    walks = len(set(run.columns["walk"].tolist()))
    return [f"{_counted(walks, 'walk')} in {_counted(len(frames), 'frame')}, {frames[0]} to {frames[-1]}."]


def _warnings(run: RunFolder, notes: list[str]) -> str:
    told = []
    for walk, p_swapped in _swapped(run):
        if not run.run and p_swapped > _LIKELY_SWAPPED:  # else the sentences say so
            told.append(f"Left and right of walk {walk + 1} may be swapped (probability {p_swapped:.0%}).")
    for walk in _backward(run):
        told.append(f"Walk {walk + 1} goes backwards: the band of normal gait is of people who walk forward.")
    if run.frames and not run.run.get("camera_given", True):
        told.append(
            "The camera was guessed: depths rest on the assumed field of view; heights and sideways "
            "positions do not."
        )
    if run.missing:
        told.append(f"Not in the folder: {', '.join(run.missing)}. It may be from an older memo.")
    if run.overlay is None and run.frames:
        told.append("There is no overlay.mp4: it was not wanted, or the run was interrupted.")
    return "".join(f"<li>{text(warning)}</li>" for warning in told + notes)


def _swapped(run: RunFolder) -> list[tuple[int, float]]:
    """The probability that the sides are interchanged, walk by walk: it is the same in all rows of one."""
    walks, p_swapped = run.columns["walk"], run.columns["p_swapped"]
    return [(int(walk), float(p_swapped[walks == walk][0])) for walk in np.unique(walks)]


def _backward(run: RunFolder) -> list[int]:
    """The walks with a speed against the direction faced."""
    walks, speeds = run.columns["walk"], run.columns["speed_mps"]
    return [int(walk) for walk in np.unique(walks) if _middle(speeds[walks == walk]) < 0]


def _middle(values: Any) -> float:
    """The middle one of the known values; NaN without any."""
    known = np.sort(values[np.isfinite(values)])
    return float(known[len(known) // 2]) if len(known) else float("nan")


def _moved_sentence(pictures: list[Picture]) -> str:
    """How much moves, where nobody was tracked."""
    looked = [picture for picture in pictures if picture.moved is not None]
    if not looked:
        return ""
    heights = [bottom - top + 1 for picture in looked for _, top, _, bottom in picture.regions[:1]]
    if not heights:
        return f"Nothing moves in the {_counted(len(looked), 'frame')} of this page."
    return (
        f"Something moves in {len(heights)} of the {_counted(len(looked), 'frame')} of this page; the "
        f"largest thing that does is up to {max(heights)} px high. What changed since the frame before is "
        "green, with a box around each moving region."
    )


def _walks(run: RunFolder) -> str:
    if not run.frames:
        return ""
    table = run.columns
    rows = []
    for walk, p_swapped in _swapped(run):
        rows_of = np.flatnonzero(table["walk"] == walk)
        first, last = rows_of[0], rows_of[-1]
        rows.append(
            (
                str(walk + 1),
                f"{table['frame'][first]} to {table['frame'][last]}",
                f"{number(table['time_s'][first])} to {number(table['time_s'][last])}",
                f"{number(table['x_m'][first])} to {number(table['x_m'][last])}",
                number(_middle(table["speed_mps"][rows_of])),
                number(p_swapped, 3),
            )
        )
    header = ("walk", "frames", "time, s", "X, m", "median speed, m/s", "P(left and right swapped)")
    return rows_table("Walks in this video (the files count them from 0)", header, rows)


def _parameters(run: RunFolder) -> str:
    """A table of gait parameters for each walk, and what they mean."""
    if not run.parameters or not len(run.parameters["walk"]):
        return "<p>There are none: gait_parameters.csv is not there, or holds no line.</p>"
    columns = [run.parameters[name] for name in GAIT_COLUMNS]
    lines = [dict(zip(GAIT_COLUMNS, line, strict=True)) for line in zip(*columns, strict=True)]
    tables = []
    for walk in dict.fromkeys(line["walk"] for line in lines):
        known = [line for line in lines if line["walk"] == walk and np.isfinite(line["value"])]
        if not known:
            tables.append(f"<p>Walk {walk + 1}: too short or too uncertain for any.</p>")
            continue
        rows = []
        for name, unit in dict.fromkeys((line["parameter"], line["unit"]) for line in known):
            cells = {line["side"]: _measured(line) for line in known if line["parameter"] == name}
            in_words = text(name.replace("_", " ")) + (f", {text(unit)}" if unit else "")
            rows.append((in_words, *(cells.get(side, UNKNOWN) for side in ("", "right", "left"))))
        header = ("parameter", "both", "right", "left")
        tables.append(rows_table(f"Walk {walk + 1}: value, 95 % interval, number of steps", header, rows))
    named = dict.fromkeys(line["parameter"] for line in lines)
    meanings = {name.replace("_", " "): DEFINITIONS[name] for name in named if name in DEFINITIONS}
    return f"{''.join(tables)}<details open><summary>What they are</summary>{_listed(meanings)}</details>"


def _measured(line: dict[str, Any]) -> str:
    """A value with its interval and how many steps it rests on, as HTML."""
    digits = 1 if line["unit"] in ("%", "1/min") else 3
    interval = "no interval"
    if np.isfinite(line["ci_low"]) and np.isfinite(line["ci_high"]):
        interval = f"{number(line['ci_low'], digits)} to {number(line['ci_high'], digits)}"
    value = number(line["value"], digits)
    return f'{value} <small class="interval">{interval} (n = {line["n"]})</small>'


def _listed(values: dict[str, Any]) -> str:
    """Names and values as a list in HTML."""
    return f"<dl>{''.join(f'<dt>{text(n)}</dt><dd>{text(v)}</dd>' for n, v in values.items())}</dl>"


def _events(run: RunFolder) -> str:
    if not run.events:
        return ""
    rows = [
        (
            text(str(event["event"]).replace("_", " ")),
            text(event["side"]),
            number(event["time_s"], 3),
            number(event["frame"], 1),
        )
        for event in run.events
    ]
    return rows_table("Heel strikes and toe-offs", ("event", "side", "time, s", "frame"), rows)


def _how(run: RunFolder) -> str:
    """How it was run, as a list of names and values."""
    if not run.run:
        return "<p>There is no run.json in the folder: with which options it was run is not known.</p>"
    told = run.run
    first, stop = told["frames"]
    given = {
        "memo": told.get("memo"),
        "video": told.get("video"),
        "frames": f"{first} to {'the end' if stop is None else stop - 1}, {told['frames_read']} read",
        "frames per second": _value(told.get("rate_hz")),
        "rate given": _value(told.get("fps_given")),
        "camera": "as given" if told.get("camera_given") else "guessed",
        **{f"option {name}": _value(value) for name, value in (told.get("options") or {}).items()},
        **{f"camera {name}": _value(value) for name, value in (told.get("camera") or {}).items()},
        **{f"result {name}": _value(value) for name, value in (told.get("summary") or {}).items()},
    }
    return _listed(given)


def _value(value: Any, depth: int = 0) -> str:
    """A value of run.json in the fewest words."""
    if depth > _DEEPEST:
        return "\N{HORIZONTAL ELLIPSIS}"
    if value is None:
        return UNKNOWN
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
    if isinstance(value, list):
        return ", ".join(
            f"({_value(item, depth + 1)})" if isinstance(item, list) else _value(item, depth + 1)
            for item in value
        )
    if isinstance(value, dict):
        return "; ".join(f"{name} {_value(item, depth + 1)}" for name, item in value.items())
    return str(value)


def _counted(count: int, one: str) -> str:
    return f"{count} {one}{'' if count == 1 else 's'}"


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())
