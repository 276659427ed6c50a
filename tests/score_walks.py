"""Tracks every drawn walk through `memo.track` and tables its errors against the truth beside the video.

    python tests/score_walks.py [--only PATTERN] [--shrink N] [--out NOW.json] [--before EARLIER.json]

One row per clip, then pooled rows for the people that memo is tuned on and for the others. Errors are
tracked minus true. Angles are those of `truth.joint_angles_deg`, of the tracked joints as of the true ones,
both seen on the vertical plane of the true walking direction. An RMS is over both sides and all tracked
frames; pooled, it is the root mean square of the clips' RMS. "centred" is after removing the mean error of
each of the joints. The torso is the midpoint of mid-shoulders and mid-hips; distance is horizontal, across
the walk, positive away from the camera.

The clips are those of the recordings (`conftest.SHARED_DATA`), or those of another folder (`--clips`) that
has a `clips.csv` with the columns `clip` and `height_m`, and one folder per clip with `video.mp4`,
`truth.csv`, `events.csv` and `camera.toml`.

Cannot do: walks that turn (one walking direction per clip), or several people.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import re
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import truth as gt
from conftest import SHARED_DATA

MOCAP_HEIGHTS_M = {"mocap_a": 1.86, "mocap_b": 1.66, "mocap_c_yaw25": 1.61}
DEMO, DEMO_HEIGHT_M, DEMO_START, DEMO_STOP = "sports2d_demo4", 1.65, 45, 146

#: People whose walks memo may be tuned on. Those of the `mocap_*` clips are among them, drawn with other
#: bodies and from other cameras, and are still reported with the others.
TUNING = ("ANTO", "BELT", "CMU02", "CMU12")
PEOPLE = ("tuning", "others")
GROUPS = {
    "yaw": ("yaw",),
    "clothes2, far12, pitch12": ("clothes2", "far12", "pitch12"),
    "crouch, stiff, limp, brisk": ("crouch", "stiff", "limp", "brisk"),
    "side view, all but clothes2": (),
}
"""Groups of clips, each with what the clip's name contains; a clip is in the first that fits."""

#: An event is found if a tracked one of the same side is at most this far from it.
REACH_S = 0.15
#: From this `p_swapped` on, memo says that the sides are open.
OPEN = 0.2
#: 90 % of a normal distribution is within so many standard deviations.
HALF_WIDTH_SD = 1.64
#: True steps that differ by less, per cent, count as symmetric.
SYMMETRIC_PERCENT = 4.0
JOINTS = ("hip", "knee", "shoulder", "elbow", "ankle")
SYMMETRY = ("step_time_symmetry", "step_length_symmetry")
GAIT_UNITS = {
    **{"cadence": "1/min", "speed": "m/s", "stride_time": "s", "step_time": "s"},
    **{"stride_length": "m", "step_length": "m", **dict.fromkeys(SYMMETRY, "%")},
    **{"stance": "%", "swing": "%", "single_support": "%", "double_support": "%"},
    **{"hip_range": "deg", "knee_range": "deg", "knee_peak": "deg"},
}
"""Gait parameters of which `true_gait` knows the truth, with the unit that it gives them in."""


@dataclass(frozen=True)
class Clip:
    """A drawn walk."""

    name: str
    folder: Path
    height_m: float


@dataclass(frozen=True)
class Timing:
    """Events of one kind."""

    true: int = 0
    """Number of true ones."""
    errors_ms: tuple[float, ...] = ()
    """Of those found."""


@dataclass(frozen=True)
class Claim:
    """The mean error of a quantity over the frames and the standard deviation stated for this mean."""

    error: float
    sd: float


@dataclass(frozen=True)
class Swap:
    """The probability stated for a walk that its sides are exchanged, and whether they are."""

    probability: float
    is_swapped: bool
    verdict: str = ""
    """On the fit: `well`, `in part`, `poorly`, or empty without one."""


@dataclass(frozen=True)
class Interval:
    """A row of the gait parameters that has an interval, with what is true."""

    parameter: str
    side: str
    value: float
    low: float
    high: float
    true: float
    """NaN where the truth does not say."""


@dataclass(frozen=True)
class ClipScore:
    """All figures of one clip, degrees and metres; NaN where there is nothing to compare."""

    name: str
    coverage: float
    """Share of the truth's frames that are tracked."""
    walks: int
    rms_deg: Mapping[str, float] = field(default_factory=dict)
    centred_deg: Mapping[str, float] = field(default_factory=dict)
    along_m: float = math.nan
    height_m: float = math.nan
    distance_m: float = math.nan
    distance_bias_m: float = math.nan
    contacts: Timing = field(default_factory=Timing)
    toe_offs: Timing = field(default_factory=Timing)
    claims: Mapping[str, Claim] = field(default_factory=dict)
    gait: tuple[Interval, ...] = ()
    true_symmetry: Mapping[str, float] = field(default_factory=dict)
    swaps: tuple[Swap, ...] = ()
    """One per walk whose true sides are known."""

    @property
    def person(self) -> str:
        """Who walks."""
        parts = self.name.split("_")
        return "_".join(parts[:2]) if parts[0] == "mocap" else parts[0]

    @property
    def sides(self) -> tuple[int, int, int]:
        """Numbers of walks with sides right, wrong, and open."""
        said = [swap.is_swapped for swap in self.swaps if swap.probability <= OPEN]
        return said.count(False), said.count(True), len(self.swaps) - len(said)

    @property
    def people(self) -> str:
        """Which of `PEOPLE`."""
        return "tuning" if self.person in TUNING else "others"

    @property
    def group(self) -> str:
        """Which of `GROUPS`."""
        return next(
            group for group, marks in GROUPS.items() if not marks or any(m in self.name for m in marks)
        )

    @classmethod
    def of_json(cls, stored: Mapping[str, Any]) -> ClipScore:
        """The score that `asdict` and JSON, which has null in place of NaN, have stored."""
        values = {name: _nan_for_null(value) for name, value in stored.items()}
        return cls(
            **values
            | {
                "claims": {name: Claim(**claim) for name, claim in values["claims"].items()},
                "gait": tuple(Interval(**row) for row in values["gait"]),
                "swaps": tuple(Swap(**swap) for swap in values["swaps"]),
            }
            | {
                kind: Timing(values[kind]["true"], tuple(values[kind]["errors_ms"]))
                for kind in ("contacts", "toe_offs")
            }
        )


@dataclass(frozen=True)
class DemoScore:
    """The woman annotated by eye: her angles after removing each mean, and her events in frames."""

    rms_deg: Mapping[str, float]
    centred_deg: Mapping[str, float]
    contacts_true: int
    contacts_frames: tuple[float, ...]
    toe_offs_true: int
    toe_offs_frames: tuple[float, ...]


# One clip


def score(
    name: str,
    track: gt.Columns,
    events: Sequence[Mapping[str, Any]],
    gait: Mapping[str, np.ndarray],
    truth: gt.Columns,
    true_events: gt.Columns,
    camera_m: Sequence[float],
    mean_sds: Sequence[Mapping[str, float]] = (),
    verdicts: Sequence[str] = (),
) -> ClipScore:
    """The figures of a track: its columns, its events and its gait parameters against those of the truth.

    `camera_m` is where the camera stands, world x and y; `mean_sds` are the standard deviations of the means
    over each walk, none if nothing is stated; `verdicts` are those on the fits of the walks.
    """
    true = true_gait(truth, true_events)
    common: dict[str, Any] = {
        "contacts": event_timing(events, true_events, "heel_strike"),
        "toe_offs": event_timing(events, true_events, "toe_off"),
        "gait": gait_intervals(gait, true),
        "true_symmetry": {name: value for (name, _), value in true.items() if name in SYMMETRY},
    }
    if not np.isfinite(gt.points(track, "")).all(axis=1).any():
        return ClipScore(name, 0.0, 0, **common)
    track = gt.tracked_rows(track, name)
    in_track, in_truth = gt.common_frames(track["frame"], truth["frame"])
    here = {column: values[in_track] for column, values in track.items()}
    forward = walking_direction(truth)
    away = _away(truth, forward, camera_m)
    torso = gt.points(here, "") - gt.true_torso(truth)[in_truth]
    phase = gt.phase_errors(here, gt.true_strikes(true_events))

    codes = {code: code for code in (*gt.JOINTS, *gt.TOES) if f"{code}_x_m" in truth}
    true_deg = gt.joint_angles_deg(truth, codes, forward)
    names = {code: joint for code, joint in (gt.JOINTS | gt.TOES).items() if f"{joint}_x_m" in here}
    tracked_deg = gt.joint_angles_deg(here, names, forward)
    for side in ("right", "left"):
        if f"{side}_ankle_deg" in here:
            tracked_deg.setdefault(f"{side}_ankle", here[f"{side}_ankle_deg"])
    errors_deg = {
        joint: gt.wrap(tracked_deg[joint] - true_deg[joint][in_truth], 360.0)
        for joint in true_deg
        if joint in tracked_deg
    }
    stated_deg = {
        f"{joint}_deg": gt.wrap(here[f"{joint}_deg"] - angle[in_truth], 360.0)
        for joint, angle in true_deg.items()
        if f"{joint}_deg" in here
    }
    place = {"along_m": torso @ forward, "across_m": torso @ away, "height_m": torso[:, 2]}
    return ClipScore(
        name,
        coverage=in_truth.size / truth["frame"].size,
        walks=np.unique(track["walk"]).size,
        swaps=_swaps(here, phase, verdicts),
        rms_deg={joint: _both_sides_rms(errors_deg, joint, centred=False) for joint in JOINTS},
        centred_deg={joint: _both_sides_rms(errors_deg, joint, centred=True) for joint in JOINTS},
        along_m=_rms(place["along_m"]),
        height_m=_rms(place["height_m"]),
        distance_m=_rms(place["across_m"]),
        distance_bias_m=_mean(place["across_m"]),
        claims=_claims(here, {**place, "phase": phase, **stated_deg}, mean_sds),
        **common,
    )


def walking_direction(truth: gt.Columns) -> np.ndarray:
    """Unit horizontal direction from where the right hip is in the first three frames to the last three.

    It differs by a fraction of a degree from that of `truth`, which is a line fitted to the torso, and by
    as little do the angles; earlier figures for these clips are of this one.
    """
    hip = gt.points(truth, "RHP_")
    way = (hip[-3:].mean(axis=0) - hip[:3].mean(axis=0)) * (1.0, 1.0, 0.0)
    return way / np.linalg.norm(way)


def _away(truth: gt.Columns, forward: np.ndarray, camera_m: Sequence[float]) -> np.ndarray:
    """Horizontal unit vector across the walk that points away from the camera."""
    across = np.array([-forward[1], forward[0], 0.0])
    seen = gt.true_torso(truth).mean(axis=0)[:2] - np.asarray(camera_m, float)[:2]
    return across if seen @ across[:2] >= 0.0 else -across


def _swaps(track: gt.Columns, phase_error: np.ndarray, verdicts: Sequence[str]) -> tuple[Swap, ...]:
    """Per walk, the stated probability that the sides are exchanged, and whether they are."""
    swaps = []
    for walk in np.unique(track["walk"]):
        rows = track["walk"] == walk
        known = phase_error[rows & np.isfinite(phase_error)]
        if known.size:
            is_swapped = bool(np.mean(np.abs(known) > 0.25) > 0.5)
            verdict = verdicts[int(walk)] if verdicts else ""
            swaps.append(Swap(float(np.median(track["p_swapped"][rows])), is_swapped, verdict))
    return tuple(swaps)


def _both_sides_rms(errors: Mapping[str, np.ndarray], joint: str, *, centred: bool) -> float:
    """RMS over the right and the left joint, each without its own mean if `centred`."""
    sides = [errors[f"{side}_{joint}"] for side in ("right", "left") if f"{side}_{joint}" in errors]
    if not sides:
        return math.nan
    return _rms(np.concatenate([e - _mean(e) if centred else e for e in sides]))


def _claims(
    track: gt.Columns, errors: Mapping[str, np.ndarray], mean_sds: Sequence[Mapping[str, float]]
) -> dict[str, Claim]:
    """Mean errors of all quantities for whose mean over a walk the track states a standard deviation.

    Over several walks, the standard deviation is the mean of those of the rows. Angles and the phase count
    only in walks whose sides memo does not leave open.
    """
    if not mean_sds:
        return {}
    claims = {}
    sure = track["p_swapped"] <= OPEN
    for name, error in errors.items():
        quantity = name.removesuffix("_m").removesuffix("_deg")
        of_walks = np.array([sds.get(name, math.nan) for sds in mean_sds])
        sd = of_walks[track["walk"].astype(int)]
        is_place = name.endswith("_m")
        rows = np.isfinite(error) & np.isfinite(sd) & (is_place | sure)
        if rows.any():
            mean = gt.circular_mean(error[rows], 1.0) if name == "phase" else _mean(error[rows])
            claims["distance" if quantity == "across" else quantity] = Claim(mean, _mean(sd[rows]))
    return claims


def event_timing(events: Sequence[Mapping[str, Any]], true: gt.Columns, kind: str) -> Timing:
    """Tracked minus true times of the true events that have a tracked one of their side within `REACH_S`."""
    errors = []
    is_kind = true["event"] == kind
    for time_s, side in zip(true["time_s"][is_kind], true["side"][is_kind], strict=True):
        off = [e["time_s"] - time_s for e in events if e["event"] == kind and e["side"] == side]
        nearest = min(off, key=abs, default=math.inf)
        if abs(nearest) <= REACH_S:
            errors.append(1e3 * float(nearest))
    return Timing(int(is_kind.sum()), tuple(errors))


# Gait parameters


def true_gait(truth: gt.Columns, events: gt.Columns) -> dict[tuple[str, str], float]:
    """Gait parameters, as `memo.gait.DEFINITIONS` has them, of the steps in the clip, by name and side.

    They are means over the clip's few steps. Strides are from a side's heel strike to its next; without one,
    whatever needs them is missing, for a single step may be the shorter or the longer one. A step reaches
    from where one ankle is when its heel strikes to where the other is at its strike.
    """
    strikes = gt.true_strikes(events)
    strike_s = np.interp(strikes.frames, truth["frame"], truth["time_s"])
    forward = walking_direction(truth)
    speed = float(np.polyfit(truth["time_s"], gt.true_torso(truth) @ forward, 1)[0])
    gait = {("speed", ""): speed}
    strides_s = np.concatenate([np.diff(strike_s[strikes.sides == side]) for side in ("right", "left")])
    if strides_s.size:
        stride_s = float(strides_s.mean())
        gait |= {
            ("cadence", ""): 120.0 / stride_s,
            ("stride_time", ""): stride_s,
            ("stride_length", ""): speed * stride_s,
            ("step_time", ""): stride_s / 2.0,
            ("step_length", ""): speed * stride_s / 2.0,
            **_true_support(events, stride_s),
            **_true_motion(gt.true_angles_deg(truth, forward)),
        }
    foot_m = {
        side: np.interp(strikes.frames, truth["frame"], gt.points(truth, f"{code}AN_") @ forward)
        for code, side in (("R", "right"), ("L", "left"))
    }
    for side, other in (("right", "left"), ("left", "right")):
        ends = 1 + np.flatnonzero((strikes.sides[1:] == side) & (strikes.sides[:-1] == other))
        if ends.size:
            gait["step_time", side] = float(np.mean(strike_s[ends] - strike_s[ends - 1]))
            gait["step_length", side] = float(np.mean(foot_m[side][ends] - foot_m[other][ends - 1]))
    for step, symmetry in zip(("step_time", "step_length"), SYMMETRY, strict=True):
        if (step, "right") in gait and (step, "left") in gait:
            right, left = gait[step, "right"], gait[step, "left"]
            gait[symmetry, ""] = 200.0 * (right - left) / (right + left)
    return gait


def _true_motion(angles_deg: Mapping[str, np.ndarray]) -> dict[tuple[str, str], float]:
    """Ranges of hip and knee and the largest flexion of the knee over the clip, degrees."""
    motion: dict[tuple[str, str], float] = {}
    for side in ("right", "left"):
        hip, knee = (angles_deg[f"{side}_{joint}"] for joint in ("hip", "knee"))
        motion["hip_range", side] = float(np.ptp(hip))
        motion["knee_range", side] = float(np.ptp(knee))
        motion["knee_peak", side] = float(knee.max())
    return motion


def _true_support(events: gt.Columns, stride_s: float) -> dict[tuple[str, str], float]:
    """Shares of the cycle, per cent: stance and swing of each side, and double support."""

    def until_off(side: str, foot: str, most_s: float) -> list[float]:
        """Times from this side's strikes to the next toe-off of a foot."""
        strike = (events["event"] == "heel_strike") & (events["side"] == side)
        off = events["time_s"][(events["event"] == "toe_off") & (events["side"] == foot)]
        waits = [min(off[off > at] - at, default=math.inf) for at in events["time_s"][strike]]
        return [float(wait) for wait in waits if wait <= most_s]

    support: dict[tuple[str, str], float] = {}
    for side in ("right", "left"):
        if stance_s := until_off(side, side, stride_s):
            support["stance", side] = 100.0 * float(np.mean(stance_s)) / stride_s
    both_s = [
        float(np.mean(found))
        for side, other in (("right", "left"), ("left", "right"))
        if (found := until_off(side, other, stride_s / 2.0))
    ]
    if both_s:
        support["double_support", ""] = 200.0 * float(np.mean(both_s)) / stride_s
    stances = [support["stance", side] for side in ("right", "left") if ("stance", side) in support]
    if len(stances) == 2:
        support["stance", ""] = float(np.mean(stances))
    swings = {("swing", side): 100.0 - v for (name, side), v in support.items() if name == "stance"}
    # One foot stands alone while the other swings.
    others = {"right": "left", "left": "right"}
    single = {
        ("single_support", side): swings["swing", other]
        for side, other in others.items()
        if ("swing", other) in swings
    }
    if both_s:
        single["single_support", ""] = 100.0 - support["double_support", ""]
    return support | swings | single


def gait_intervals(
    gait: Mapping[str, np.ndarray], true: Mapping[tuple[str, str], float]
) -> tuple[Interval, ...]:
    """The rows of a table of gait parameters that have an interval."""
    columns = (gait[name] for name in ("parameter", "side", "unit", "value", "ci_low", "ci_high"))
    return tuple(
        Interval(
            *(str(parameter), str(side), float(value), float(low), float(high)),
            true=true.get((parameter, side), math.nan) if GAIT_UNITS.get(parameter) == unit else math.nan,
        )
        for parameter, side, unit, value, low, high in zip(*columns, strict=True)
        if np.isfinite([low, high]).all()
    )


# From the video


def track_clip(clip: Clip, shrink: int = 1) -> ClipScore:
    """Tracks a clip, given its camera and the walker's height, and scores it."""
    import memo

    camera = memo.Camera.from_toml(clip.folder / "camera.toml")
    found = track_video(clip.folder / "video.mp4", clip.height_m, camera.shrunk(shrink), shrink=shrink)
    return score(
        clip.name,
        found.columns,
        found.events,
        found.gait_parameters,
        gt.read_columns(clip.folder / "truth.csv"),
        gt.read_columns(clip.folder / "events.csv"),
        camera.position,
        [walk.fit.mean_sd if walk.fit else {} for walk in found.walks],
        [walk.fit.verdict if walk.fit else "" for walk in found.walks],
    )


def track_demo(folder: Path) -> DemoScore:
    """Tracks the woman's forward walk and scores it."""
    import memo

    camera = memo.Camera.from_toml(folder / "camera.toml")
    found = track_video(folder / "demo4.mp4", DEMO_HEIGHT_M, camera, DEMO_START, DEMO_STOP)
    columns = dict(found.columns)
    columns["frame"] = columns["frame"] + DEMO_START
    events = [event | {"frame": event["frame"] + DEMO_START} for event in found.events]
    return score_demo(columns, events, folder / "annotation")


def track_video(
    video: Path, height_m: float | None, camera: Any, start: int = 0, stop: int | None = None, shrink: int = 1
) -> Any:
    """`memo.track` of the frames of a video."""
    import memo
    from memo.video import VideoReader

    with VideoReader(video, start=start, stop=stop, shrink=shrink) as reader:
        frames = [(frame.luma.copy(), frame.time_s) for frame in reader]
    lumas, times_s = zip(*frames, strict=True)
    return memo.track(lumas, height_m=height_m, times_s=times_s, camera=camera)


def score_demo(track: gt.Columns, events: Sequence[Mapping[str, Any]], annotation: Path) -> DemoScore:
    """The figures of a track of the annotated clip, whose near side is the left; frames are the video's."""
    spreads = gt.annotated_angles(gt.tracked_rows(track), gt.read_columns(annotation / "angles.csv"), "left")
    true = gt.annotated_events(annotation, "left", gt.MIN_CERTAINTY)
    fps = 30.0
    seconds = [{**event, "time_s": event["frame"] / fps} for event in events]
    timings = [
        event_timing(seconds, true | {"time_s": true["frame"] / fps}, kind)
        for kind in ("heel_strike", "toe_off")
    ]
    contacts, offs = ([round(ms * fps / 1e3, 3) for ms in timing.errors_ms] for timing in timings)
    legs = {name: spread for name, spread in spreads.items() if name.endswith(("_hip", "_knee"))}
    return DemoScore(
        rms_deg={name: spread.rms for name, spread in legs.items()},
        centred_deg={n: math.sqrt(max(s.rms**2 - s.mean**2, 0.0)) for n, s in legs.items()},
        contacts_true=timings[0].true,
        contacts_frames=tuple(contacts),
        toe_offs_true=timings[1].true,
        toe_offs_frames=tuple(offs),
    )


# Many clips


def row(clips: Sequence[ClipScore]) -> dict[str, float]:
    """The figures of one clip, or of several pooled."""

    def pooled(values: Iterable[float]) -> float:
        return _rms(np.array(list(values), float))

    figures: dict[str, float] = {
        "clips": len(clips),
        "coverage": _mean(np.array([clip.coverage for clip in clips])),
        "walks": sum(clip.walks for clip in clips),
    }
    for index, verdict in enumerate(("right", "wrong", "open")):
        figures[f"sides_{verdict}"] = sum(clip.sides[index] for clip in clips)
    for joint in JOINTS:
        figures[f"{joint}_deg"] = pooled(clip.rms_deg.get(joint, math.nan) for clip in clips)
        figures[f"{joint}_centred_deg"] = pooled(clip.centred_deg.get(joint, math.nan) for clip in clips)
    figures["along_cm"] = 100.0 * pooled(clip.along_m for clip in clips)
    figures["height_cm"] = 100.0 * pooled(clip.height_m for clip in clips)
    figures["distance_cm"] = 100.0 * pooled(clip.distance_m for clip in clips)
    figures["distance_bias_cm"] = 100.0 * _mean(np.array([clip.distance_bias_m for clip in clips]))
    for kind in ("contacts", "toe_offs"):
        timings: list[Timing] = [getattr(clip, kind) for clip in clips]
        errors = np.array([error for timing in timings for error in timing.errors_ms])
        figures[f"{kind}_true"] = sum(timing.true for timing in timings)
        figures[f"{kind}_found"] = errors.size
        figures[f"{kind}_mean_ms"] = _mean(errors)
        figures[f"{kind}_sd_ms"] = float(errors.std(ddof=1)) if errors.size > 1 else math.nan
    return figures


def pooled_rows(clips: Sequence[ClipScore]) -> dict[str, dict[str, float]]:
    """The pooled rows, group by group and in each first the people memo is tuned on."""
    order = ["side view, all but clothes2", *(group for group, marks in GROUPS.items() if marks)]
    rows = {}
    for group in order:
        for people in PEOPLE:
            chosen = [clip for clip in clips if (clip.group, clip.people) == (group, people)]
            if chosen:
                rows[f"{group}; {people}"] = row(chosen)
    return rows


@dataclass(frozen=True)
class Hit:
    """One statement of memo with its range, and whether the truth is in it."""

    person: str
    people: str
    holds: bool
    error: float
    half_width: float


def claim_hits(clips: Sequence[ClipScore]) -> dict[str, list[Hit]]:
    """By quantity, whether the mean errors of the clips are within `HALF_WIDTH_SD` of their stated sd."""
    hits: dict[str, list[Hit]] = {}
    for clip in clips:
        for name, claim in clip.claims.items():
            half = HALF_WIDTH_SD * claim.sd
            holds = abs(claim.error) <= half
            hits.setdefault(name, []).append(Hit(clip.person, clip.people, holds, claim.error, half))
    return hits


def gait_hits(clips: Sequence[ClipScore]) -> dict[str, list[Hit]]:
    """By gait parameter, whether the truth of the clips, of either side, is in the interval."""
    hits: dict[str, list[Hit]] = {}
    for clip in clips:
        for found in clip.gait:
            if math.isfinite(found.true):
                holds = found.low <= found.true <= found.high
                half, error = (found.high - found.low) / 2.0, found.value - found.true
                hits.setdefault(found.parameter, []).append(Hit(clip.person, clip.people, holds, error, half))
    return hits


def share(hits: Sequence[Hit]) -> tuple[float, float]:
    """Share that hold, and its standard error with the people, not their clips, as independent."""
    if not hits:
        return math.nan, math.nan
    people = sorted({hit.person for hit in hits})
    mean = sum(hit.holds for hit in hits) / len(hits)
    if len(people) < 2:
        return mean, math.nan
    left = [sum(hit.holds - mean for hit in hits if hit.person == person) for person in people]
    return mean, math.sqrt(len(people) / (len(people) - 1) * sum(e * e for e in left)) / len(hits)


@dataclass(frozen=True)
class Asymmetries:
    """Clips by their true asymmetry and by what the interval says, for one parameter."""

    symmetric: tuple[str, ...]
    """Clips with symmetric steps and an interval."""
    false: tuple[str, ...]
    """Those of them whose interval excludes 0."""
    asymmetric: tuple[str, ...]
    found: tuple[str, ...]
    """Clips with asymmetric steps whose interval excludes 0 on the true side of it."""


def asymmetries(clips: Sequence[ClipScore], parameter: str) -> Asymmetries:
    """Clips whose steps are called asymmetric, and those whose are; several walks of a clip count once."""
    lists: dict[str, list[str]] = {name: [] for name in ("symmetric", "false", "asymmetric", "found")}
    for clip in clips:
        said = [found for found in clip.gait if found.parameter == parameter]
        true = clip.true_symmetry.get(parameter, math.nan)
        if not said or math.isnan(true):
            continue
        if abs(true) < SYMMETRIC_PERCENT:
            lists["symmetric"].append(clip.name)
            if any(found.low > 0 or found.high < 0 for found in said):
                lists["false"].append(clip.name)
        else:
            lists["asymmetric"].append(clip.name)
            if any(found.low > 0 if true > 0 else found.high < 0 for found in said):
                lists["found"].append(clip.name)
    return Asymmetries(**{name: tuple(names) for name, names in lists.items()})


def _rms(values: np.ndarray) -> float:
    """Over the finite entries; NaN if there are none."""
    return gt.Spread.of(values).rms


def _mean(values: np.ndarray) -> float:
    return gt.Spread.of(values).mean


def swap_bands(clips: Sequence[ClipScore]) -> list[tuple[str, list[Swap]]]:
    """The walks by the probability stated that their sides are exchanged."""
    ends = (-1.0, 0.02, 0.1, OPEN, 0.35, 1.0)
    swaps = [swap for clip in clips for swap in clip.swaps]
    return [
        (f"{max(low, 0.0):.2f}-{high:.2f}", [swap for swap in swaps if low < swap.probability <= high])
        for low, high in pairwise(ends)
    ]


# Printing

Row = Mapping[str, float]
COLUMNS: dict[str, Callable[[Row], str]] = {
    "cover": lambda r: _number(r["coverage"], 2),
    "walks": lambda r: f"{r['walks']:.0f}",
    "r/w/open": lambda r: "/".join(f"{r[f'sides_{verdict}']:.0f}" for verdict in ("right", "wrong", "open")),
    "hip": lambda r: _number(r["hip_deg"], 1),
    "knee": lambda r: _number(r["knee_deg"], 1),
    "hip centred": lambda r: _number(r["hip_centred_deg"], 1),
    "knee centred": lambda r: _number(r["knee_centred_deg"], 1),
    "shoulder": lambda r: _number(r["shoulder_deg"], 1),
    "elbow": lambda r: _number(r["elbow_deg"], 1),
    "ankle": lambda r: _number(r["ankle_deg"], 1),
    "along": lambda r: _number(r["along_cm"], 1),
    "height": lambda r: _number(r["height_cm"], 1),
    "distance": lambda r: _number(r["distance_cm"], 1),
    "dist bias": lambda r: _number(r["distance_bias_cm"], 1, "+"),
    "contacts": lambda r: _timing(r, "contacts"),
    "toe-offs": lambda r: _timing(r, "toe_offs"),
}
"""Heads of the columns, degrees, centimetres and milliseconds, and what stands below them."""


def _number(value: float, digits: int, sign: str = "") -> str:
    return f"{value:{sign}.{digits}f}" if math.isfinite(value) else "-"


def _timing(figures: Row, kind: str) -> str:
    true, found = figures[f"{kind}_true"], figures[f"{kind}_found"]
    if not true:
        return "-"
    mean, sd = (_number(figures[f"{kind}_{name}_ms"], 0, s) for name, s in (("mean", "+"), ("sd", "")))
    return f"{found:.0f}/{true:.0f} {mean} sd {sd}"


def _aligned(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(f"{cell:<{w}}" if i == 0 else f"{cell:>{w}}" for i, (cell, w) in enumerate(cells)).rstrip()
        for cells in (list(zip(line, widths, strict=True)) for line in rows)
    )


def _beside(now: str, before: str | None) -> str:
    return now if before is None or now == before == "-" else f"{now} ({before})"


def error_table(rows: Mapping[str, Row], before: Mapping[str, Row]) -> str:
    """One line per named row; what it was before in brackets."""
    lines = [["", "clips", *COLUMNS]]
    for name, figures in rows.items():
        old = before.get(name)
        cells = [_beside(text(figures), None if old is None else text(old)) for text in COLUMNS.values()]
        lines.append([name, f"{figures['clips']:.0f}", *cells])
    return _aligned(lines)


def share_table(hits: Mapping[str, Sequence[Hit]], before: Mapping[str, Sequence[Hit]]) -> str:
    """One line per quantity: shares that hold, by people and by person, errors and half widths."""
    people = sorted({hit.person for found in hits.values() for hit in found}, key=str.lower)
    heads = (*PEOPLE, "all", "mean error", "rms error", "half width", *people)
    lines = [["", *heads]]

    def cells(found: Sequence[Hit]) -> list[str]:
        errors, halves = (np.array([getattr(hit, n) for hit in found]) for n in ("error", "half_width"))
        groups = [[hit for hit in found if hit.people == who] for who in PEOPLE]
        return [
            *(_share(group) for group in [*groups, found]),
            _number(_mean(errors), 3, "+"),
            _number(_rms(errors), 3),
            _number(_mean(halves), 3),
        ]

    for name, found in hits.items():
        old = cells(before[name]) if before.get(name) else [None] * 6
        of_people = [[hit.holds for hit in found if hit.person == person] for person in people]
        counts = [f"{sum(holds)}/{len(holds)}" if holds else "-" for holds in of_people]
        pairs = zip(cells(found), old, strict=True)
        lines.append([name, *(_beside(now, was) for now, was in pairs), *counts])
    return _aligned(lines)


def _share(hits: Sequence[Hit]) -> str:
    mean, error = share(hits)
    if not hits:
        return "-"
    return f"{100 * mean:.0f} % ± {_number(100 * error, 0)} of {len(hits)}"


def demo_lines(now: DemoScore, before: DemoScore | None) -> str:
    """The figures of the woman annotated by eye."""

    def texts(score: DemoScore) -> dict[str, str]:
        legs = {
            f"{name.replace('_', ' ')} deg": f"{rms:.1f}, centred {score.centred_deg[name]:.1f}"
            for name, rms in score.rms_deg.items()
        }
        return legs | {
            f"{label}, frames": f"{len(frames)}/{true}: " + " ".join(f"{f:+.1f}" for f in frames)
            for label, frames, true in (
                ("contacts", score.contacts_frames, score.contacts_true),
                ("toe-offs", score.toe_offs_frames, score.toe_offs_true),
            )
        }

    old = texts(before) if before else {}
    return _aligned([[name, _beside(text, old.get(name))] for name, text in texts(now).items()])


def asymmetry_lines(clips: Sequence[ClipScore], before: Sequence[ClipScore]) -> str:
    """Per symmetry, false and found asymmetries."""

    def text(clips: Sequence[ClipScore], parameter: str) -> str:
        said = asymmetries(clips, parameter)
        names = f": {' '.join(said.false)}" if said.false else ""
        return (
            f"{len(said.false)} of {len(said.symmetric)} clips with symmetric steps called "
            f"asymmetric{names}; {len(said.found)} of {len(said.asymmetric)} asymmetric ones found"
        )

    return "\n".join(
        f"{parameter}: {_beside(text(clips, parameter), text(before, parameter) if before else None)}"
        for parameter in SYMMETRY
    )


def swap_table(clips: Sequence[ClipScore]) -> str:
    """One line per band of probabilities: the mean of those stated, and how often it was so."""
    lines = [["stated", "walks", "mean", "exchanged", "poor fits", "exchanged"]]
    for band, swaps in swap_bands(clips):
        stated = np.array([swap.probability for swap in swaps])
        poor = [swap.is_swapped for swap in swaps if swap.verdict == "poorly"]
        counts = [sum(swap.is_swapped for swap in swaps), len(poor), sum(poor)]
        lines.append([band, f"{len(swaps)}", _number(_mean(stated), 3), *map(str, counts)])
    return _aligned(lines)


def report(
    clips: Sequence[ClipScore],
    demo: DemoScore | None,
    before: Sequence[ClipScore] = (),
    demo_before: DemoScore | None = None,
) -> str:
    """All tables; the earlier run is pooled over the clips that are in both."""
    clips = sorted(clips, key=lambda clip: (clip.people == "others", clip.name))
    names = {clip.name for clip in clips}
    before = [clip for clip in before if clip.name in names]
    parts = []
    if clips:
        heads = "degrees, cm and ms; contacts: found/true, mean, sd"
        rows, old = ({clip.name: row([clip]) for clip in every} for every in (clips, before))
        parts = [
            f"Errors, {heads}\n{error_table(rows, old)}",
            f"Pooled\n{error_table(pooled_rows(clips), pooled_rows(before))}",
            "Mean errors of clips within 1.64 stated sd (90 % if honest), ± by people; m, cycles, deg\n"
            + share_table(claim_hits(clips), claim_hits(before)),
            "True gait parameters of clips in their 95 % intervals, ± by people\n"
            + share_table(gait_hits(clips), gait_hits(before)),
            f"Probability that right and left are exchanged\n{swap_table(clips)}",
            f"Asymmetries (true ones from {SYMMETRIC_PERCENT:g} %)\n{asymmetry_lines(clips, before)}",
        ]
        unjudged = sorted({g.parameter for clip in clips for g in clip.gait} - gait_hits(clips).keys())
        if unjudged:
            parts.append(f"Gait parameters with intervals, but without a truth: {', '.join(unjudged)}")
    if demo:
        parts.append(f"{DEMO}, annotated by eye\n{demo_lines(demo, demo_before)}")
    return "\n\n".join(parts)


# Storing


def stored(clips: Sequence[ClipScore], demo: DemoScore | None) -> dict[str, Any]:
    """All numbers, for JSON."""
    shares = {
        name: {
            what: {
                **dict(zip(("share", "standard_error"), share(found), strict=True)),
                "hits": [asdict(hit) for hit in found],
            }
            for what, found in hits.items()
        }
        for name, hits in (("claims", claim_hits(clips)), ("gait", gait_hits(clips)))
    }
    return {
        "clips": [asdict(clip) for clip in clips],
        "demo": asdict(demo) if demo else None,
        "rows": {clip.name: row([clip]) for clip in clips},
        "pooled": pooled_rows(clips),
        "shares": shares,
        "asymmetries": {name: asdict(asymmetries(clips, name)) for name in SYMMETRY},
    }


def read_stored(path: Path) -> tuple[list[ClipScore], DemoScore | None]:
    """The scores of a file of `--out`."""
    run = json.loads(path.read_text(encoding="utf-8"))
    demo = DemoScore(**_nan_for_null(run["demo"])) if run["demo"] else None
    return [ClipScore.of_json(clip) for clip in run["clips"]], demo


def _nan_for_null(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _nan_for_null(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_nan_for_null(item) for item in value]
    return math.nan if value is None else value


# The command


def clips_of(folder: Path) -> list[Clip]:
    """The clips that the `clips.csv` of a folder lists."""
    table = gt.read_columns(folder / "clips.csv")
    listed = zip(table["clip"].tolist(), table["height_m"].tolist(), strict=True)
    return [Clip(name, folder / name, height_m) for name, height_m in listed]


def shared_clips() -> list[Clip]:
    """All drawn walks of the recordings."""
    mocap = [Clip(name, SHARED_DATA / "video" / name, height) for name, height in MOCAP_HEIGHTS_M.items()]
    return clips_of(SHARED_DATA / "walks") + mocap


def _run(
    clips: Sequence[Clip], with_demo: bool, workers: int, shrink: int
) -> tuple[list[ClipScore], DemoScore | None, bool]:
    """The scores, and whether any clip failed; one line of progress per clip."""
    # The tracker has threads of its own: a forked copy of them would wait for ever.
    context = multiprocessing.get_context("spawn")
    scores: list[ClipScore] = []
    demo: DemoScore | None = None
    failed = False
    started = time.monotonic()
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        jobs: dict[Any, str] = {pool.submit(track_clip, clip, shrink): clip.name for clip in clips}
        if with_demo:
            jobs[pool.submit(track_demo, SHARED_DATA / "video" / DEMO)] = DEMO
        for done, job in enumerate(as_completed(jobs), start=1):
            said = "done"
            try:
                result = job.result()
            except Exception as error:
                failed, said = True, f"FAILED: {type(error).__name__}: {error}"
            else:
                if isinstance(result, DemoScore):
                    demo = result
                else:
                    scores.append(result)
            elapsed = time.monotonic() - started
            print(f"{done}/{len(jobs)} {elapsed:4.0f} s  {jobs[job]}: {said}", file=sys.stderr, flush=True)
    return sorted(scores, key=lambda clip: clip.name), demo, failed


def main() -> int:
    """Tracks, prints, stores; 1 if a clip could not be scored."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="PATTERN", default="", help="clips whose name has this (regex)")
    parser.add_argument("--clips", type=Path, metavar="DIR", help="other clips, listed in DIR/clips.csv")
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="stores all numbers")
    parser.add_argument(
        "--before", type=Path, metavar="FILE.json", help="numbers of an earlier run, to compare"
    )
    parser.add_argument(
        "--shrink", type=int, default=1, metavar="N", help="N x N pixels of the clips become one"
    )
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    chosen = re.compile(args.only)
    clips = [
        clip for clip in (clips_of(args.clips) if args.clips else shared_clips()) if chosen.search(clip.name)
    ]
    with_demo = args.clips is None and args.shrink == 1 and bool(chosen.search(DEMO))
    if not clips and not with_demo:
        parser.error(f"no clip's name has {args.only!r}")
    before, demo_before = read_stored(args.before) if args.before else ([], None)
    scores, demo, failed = _run(clips, with_demo, args.workers, args.shrink)
    print(report(scores, demo, before, demo_before))
    if args.out:
        from memo.files import write_json

        write_json(args.out, stored(scores, demo))
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
