"""The texts and tables on the page of a run of `memo track`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import memo
from memo.camera_motion import outcome
from memo.gait import DEFINITIONS, GAIT_COLUMNS, cadence_sentences, digits_of
from memo.plausible import LIKELY_MISTAKEN
from memo.report import normative
from memo.report.cycles import none_sentence
from memo.report.page import UNKNOWN, number, rows_table, text
from memo.report.pictures import Picture
from memo.report.run_folder import RunFolder
from memo.wording import counted

__all__ = ["measured", "track_text"]

_DEEPEST = 4
_MOST_SENTENCES = 8
_MOST_TABLES = 3


def track_text(run: RunFolder, notes: list[str], pictures: list[Picture]) -> dict[str, str]:
    """HTML for the placeholders of `track.html`."""
    status, tone = _status(run)
    return {
        "version": text(memo.__version__),
        "folder": text(run.path.resolve().name),
        "name": text(run.name),
        "status": text(status),
        "tone": tone,
        "sentences": _folded(
            [f"<p>{text(said)}</p>" for said in _sentences(run)], _MOST_SENTENCES, "sentence"
        ),
        "warnings": _warnings(run, notes),
        "parameters": _parameters(run),
        "fits": _fits(run),
        "walks": _walks(run),
        "events": _events(run),
        "left_out": _left_out(run),
        "band_source": text(normative.SOURCE),
        "no_cycles": text(none_sentence(run.cycles)),
        "how": _how(run),
        "moved": text(_moved_sentence(pictures)),
        "nobody": " hidden" if run.frames else "",
        "somebody": "" if run.frames else " hidden",
    }


def _status(run: RunFolder) -> tuple[str, str]:
    """The state of the run in two words, and its colour."""
    status = (run.run.get("summary") or {}).get("status")
    told = str(status or ("tracked" if run.frames else "nobody tracked"))
    if run.run.get("interrupted"):
        told = f"{told}, interrupted"
    if not run.frames:
        return told, "bad"
    doubtful = any(p_swapped > LIKELY_MISTAKEN for _, p_swapped in _swapped(run)) or _unsteady(run)
    walks = dict.fromkeys(run.columns["walk"].tolist())
    doubtful = (
        doubtful or _moved_too_far(run) or any(run.verdict(walk) not in (None, "well") for walk in walks)
    )
    return told, "fair" if doubtful or told != "tracked" else "good"


def _folded(items: list[str], most: int, what: str) -> str:
    """Pieces of HTML; if there are many, those after the first `most` are folded."""
    shown, folded = items[:most], items[most:]
    if not folded:
        return "".join(shown)
    number_of = counted(len(folded), f"more {what}")
    more = f"<details><summary>{number_of}</summary>{''.join(folded)}</details>"
    return "".join(shown) + more


def _unsteady(run: RunFolder) -> bool:
    """Whether the steps of a walk were hardly visible."""
    table = run.parameters
    if not table:
        return False
    cadences = (table["parameter"] == "cadence") & (table["side"] == "")
    return any(cadence_sentences(table, walk) for walk in dict.fromkeys(table["walk"][cadences].tolist()))


def _moved_too_far(run: RunFolder) -> bool:
    """Whether the camera moved beyond what can be steadied, or a view was lost."""
    motion = (run.run.get("summary") or {}).get("camera_motion")
    return motion is not None and outcome(motion) == "beyond"


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
    tracked = counted(len(set(frames)), "frame")
    return [f"{counted(walks, 'walk')} in {tracked}, {min(frames)} to {max(frames)}."]


def _warnings(run: RunFolder, notes: list[str]) -> str:
    told = []
    if run.run.get("interrupted"):
        count = counted(run.run["frames_read"], "frame")
        told.append(f"The run was interrupted after {count}: later frames were not read.")
    swapped = {walk: p_swapped for walk, p_swapped in _swapped(run) if p_swapped > LIKELY_MISTAKEN}
    if swapped and (not run.run or len(_sentences(run)) > _MOST_SENTENCES):  # else visible sentences state it
        up_to = "up to " * (len(swapped) > 1)
        told.append(
            f"Left and right may be swapped in {_numbered(list(swapped))} "
            f"(probability {up_to}{max(swapped.values()):.0%})."
        )
    if backward := _backward(run):
        verb = "goes" if len(backward) == 1 else "go"
        told.append(
            f"{_numbered(backward).capitalize()} {verb} backwards: backward walking has no gait cycles here."
        )
    if run.frames and not run.run.get("camera_given", True):
        told.append(
            "The camera was assumed: depths depend on the assumed field of view; heights and sideways "
            "positions do not."
        )
    if run.missing:
        told.append(f"Not in the folder: {', '.join(run.missing)}. It may be from an older memo.")
    if run.overlay is None and run.frames:
        told.append(
            "There is no overlay.mp4: it was not requested, was removed, or its drawing was interrupted."
        )
    return "".join(f"<li>{text(warning)}</li>" for warning in told + notes)


def _numbered(walks: list[int]) -> str:
    """`walk 2`, or `walks 0, 2 and 5`."""
    *most, last = [str(walk) for walk in walks]
    return f"walks {', '.join(most)} and {last}" if most else f"walk {last}"


def _swapped(run: RunFolder) -> list[tuple[int, float]]:
    """The probability that the sides are interchanged, by walk: it is the same in all rows of a walk."""
    walks, p_swapped = run.columns["walk"], run.columns["p_swapped"]
    return [(int(walk), float(p_swapped[walks == walk][0])) for walk in np.unique(walks)]


def _backward(run: RunFolder) -> list[int]:
    """The walks with a speed opposite to the direction the person faces."""
    walks, speeds = run.columns["walk"], run.columns["speed_mps"]
    return [int(walk) for walk in np.unique(walks) if _middle(speeds[walks == walk]) < 0]


def _middle(values: Any) -> float:
    """The median of the known values; NaN if there are none."""
    known = np.sort(values[np.isfinite(values)])
    return float(known[len(known) // 2]) if len(known) else float("nan")


def _moved_sentence(pictures: list[Picture]) -> str:
    """Describes how much moves, if nobody was tracked."""
    looked = [picture for picture in pictures if picture.moved is not None]
    if not looked:
        return ""
    heights = [bottom - top + 1 for picture in looked for _, top, _, bottom in picture.regions[:1]]
    if not heights:
        return f"Nothing moves in the {counted(len(looked), 'frame')} of this page."
    return (
        f"Something moves in {len(heights)} of the {counted(len(looked), 'frame')} of this page; the "
        f"largest moving region is up to {max(heights)} px high. What changed since the previous frame is "
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
                str(walk),
                str(int(table["person"][first])),
                f"{table['frame'][first]} to {table['frame'][last]}",
                f"{number(table['time_s'][first])} to {number(table['time_s'][last])}",
                f"{number(table['x_m'][first])} to {number(table['x_m'][last])}",
                number(_middle(table["speed_mps"][rows_of])),
                number(p_swapped, 3),
            )
        )
    header = ("walk", "person", "frames", "time, s", "X, m", "median speed, m/s", "P(left and right swapped)")
    return rows_table("Walks in this video", header, rows)


def _left_out(run: RunFolder) -> str:
    """The panel with those who moved and were not followed; empty if there are none, or in older results."""
    left_out = run.run.get("left_out") or []
    if not left_out:
        return ""
    rows = []
    for left in left_out:
        boxes = left.get("boxes") or [[0, 0, 0, 0, 0]]
        frame, *box = boxes[len(boxes) // 2]
        rows.append(
            (
                f"{int(left['first_frame'])} to {int(left['last_frame'])}",
                str(int(left["frames"])),
                f"{number(left['start_s'])} to {number(left['end_s'])}",
                f"{', '.join(str(int(value)) for value in box)} in frame {int(frame)}",
                text(left["sentence"]),
            )
        )
    header = ("frames", "seen in", "time, s", "left, top, width, height, px", "why it was not followed")
    table = rows_table("Those who moved and were not followed", header, rows)
    count = (run.run.get("summary") or {}).get("left_out", len(rows))
    more = f"<p>The {len(rows)} of {count} who were seen longest.</p>" if count > len(rows) else ""
    return (
        '<section class="panel" aria-labelledby="left-title"><h2 id="left-title">Not followed</h2>'
        f"{more}{table}</section>"
    )


def _parameters(run: RunFolder) -> str:
    """A table of gait parameters for each walk, and their definitions."""
    if not run.parameters or not len(run.parameters["walk"]):
        return "<p>There are none: gait_parameters.csv is missing or has no rows.</p>"
    columns = [run.parameters[name] for name in GAIT_COLUMNS]
    lines = [dict(zip(GAIT_COLUMNS, line, strict=True)) for line in zip(*columns, strict=True)]
    of_walk: dict[int, list[dict[str, Any]]] = {}
    for line in lines:
        of_walk.setdefault(line["walk"], []).append(line)
    tables = ""
    for person in dict.fromkeys(line["person"] for line in lines):
        own = [_of_walk(run, walk, of) for walk, of in of_walk.items() if of[0]["person"] == person]
        tables += _of_person(person, _folded(own, _MOST_TABLES, "walk"))
    named = dict.fromkeys(line["parameter"] for line in lines)
    meanings = {name.replace("_", " "): DEFINITIONS[name] for name in named if name in DEFINITIONS}
    told = f"<details open><summary>Definitions</summary>{_listed(meanings)}</details>"
    return tables + told


def _of_person(person: int, inside: str) -> str:
    """A part of the page that belongs to one person."""
    return f'<div data-person="{person}">{inside}</div>'


def _of_walk(run: RunFolder, walk: int, lines: list[dict[str, Any]]) -> str:
    """The table of gait parameters of a walk."""
    several = len(run.people) > 1
    name = f"Walk {walk}" + f" (person {lines[0]['person']})" * several
    known = [line for line in lines if np.isfinite(line["value"])]
    if not known:
        return f"<p>{name}: too short or too uncertain for any.</p>"
    rows = []
    for parameter, unit in dict.fromkeys((line["parameter"], line["unit"]) for line in known):
        cells = {line["side"]: measured(line) for line in known if line["parameter"] == parameter}
        in_words = text(parameter.replace("_", " ")) + (f", {text(unit)}" if unit else "")
        rows.append((in_words, *(cells.get(side, UNKNOWN) for side in ("", "right", "left"))))
    header = ("parameter", "both", "right", "left")
    return rows_table(f"{name}: value, 95 % interval, number of steps", header, rows)


def _fits(run: RunFolder) -> str:
    """A table for each walk: how well the outline of each part of the model fits."""
    tables = ""
    for person, walks in run.people.items():
        own = [_fit_of_walk(run, walk) for walk in walks]
        tables += _of_person(person, _folded(own, _MOST_TABLES, "walk"))
    return tables


def _fit_of_walk(run: RunFolder, walk: int) -> str:
    fit, name = run.fit(walk), f"Walk {walk}"
    if not fit.get("measured"):
        return f"<p>{name}: {text(fit.get('problem') or 'the person was not measured')}.</p>"
    caption = f"{name}: the model fits {text(fit['fits'])}"
    parts = fit.get("parts")
    if not parts:  # of an older version
        return f"<p>{caption}.</p>"
    off = set(fit.get("off_parts", ()))
    rows = [
        (
            f"<b>{text(part)}</b>" if part in off else text(part),
            *_off_and_missed(of, "off_px", "missed_percent"),
        )
        for part, of in parts.items()
    ]
    rows.append(("whole outline", *_off_and_missed(fit, "outline_off_px", "outline_missed_percent")))
    return rows_table(caption, ("part", "off, px", "no edge, %"), rows)


def _off_and_missed(of: Mapping[str, Any], *keys: str) -> list[str]:
    return [UNKNOWN if of[key] is None else number(of[key], 1) for key in keys]


def measured(line: Mapping[str, Any]) -> str:
    """A value with its interval and the number of steps it is based on, as HTML."""
    digits = digits_of(line["unit"])
    value = number(line["value"], digits)
    if line["n"] == 0:
        return f'{value} <small class="interval">not measured</small>'
    interval = "no interval"
    if np.isfinite(line["ci_low"]) and np.isfinite(line["ci_high"]):
        interval = f"{number(line['ci_low'], digits)} to {number(line['ci_high'], digits)}"
    return f'{value} <small class="interval">{interval} (n = {line["n"]})</small>'


def _listed(values: dict[str, Any]) -> str:
    """Names and values as a list in HTML."""
    return f"<dl>{''.join(f'<dt>{text(n)}</dt><dd>{text(v)}</dd>' for n, v in values.items())}</dl>"


def _events(run: RunFolder) -> str:
    """A table of heel strikes and toe-offs for each person."""
    people = run.people
    several = len(_swapped(run)) > 1
    header = (*(("walk",) if several else ()), "event", "side", "time, s", "frame")
    tables = ""
    for person, walks in people.items():
        rows = [
            (
                *((str(run.walk_of(event)),) if several else ()),
                text(str(event["event"]).replace("_", " ")),
                text(event["side"]),
                number(event["time_s"], 3),
                number(event["frame"], 1),
            )
            for event in run.events
            if run.walk_of(event) in walks
        ]
        if rows:
            caption = "Heel strikes and toe-offs" + f" of person {person}" * (len(people) > 1)
            tables += _of_person(person, rows_table(caption, header, rows))
    return tables


def _how(run: RunFolder) -> str:
    """The options of the run, as a list of names and values."""
    if not run.run:
        return "<p>There is no run.json in the folder: the options of the run are unknown.</p>"
    told = run.run
    first, stop = told["frames"]
    given = {
        "memo": told.get("memo"),
        "video": told.get("video"),
        "frames": f"{first} to {'the end' if stop is None else stop - 1}, {told['frames_read']} read",
        "frames per second": _value(told.get("rate_hz")),
        "rate given": _value(told.get("fps_given")),
        "camera": "as given" if told.get("camera_given") else "assumed",
        **{f"option {name}": _value(value) for name, value in (told.get("options") or {}).items()},
        **{f"camera {name}": _value(value) for name, value in (told.get("camera") or {}).items()},
        **{f"result {name}": _value(value) for name, value in (told.get("summary") or {}).items()},
    }
    return _listed(given)


def _value(value: Any, depth: int = 0) -> str:
    """A value of run.json as short text."""
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
