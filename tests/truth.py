"""Judges a tracked walk (`track.csv`, `events.csv`) against ground truth.

Three kinds of truth: joints of motion capture, a clip annotated by eye near the image plane, and a clip
too small to tell left from right. Everything here is computed from the files alone and shares no code with
the tracker. Errors are tracked minus true. Angles are degrees, flexion positive; phase is in cycles,
0 = right heel strike, 0.5 = left.

Cannot do: judge the phase before the first or after the last annotated heel strike (those frames count for
position and angles only), or walks that turn (one walking direction per clip).
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Columns = dict[str, np.ndarray]

#: Joint codes of the motion-capture truth and the names of the same joints in `track.csv`.
JOINTS = {
    side[0].upper() + code: f"{side}_{joint}"
    for side in ("right", "left")
    for code, joint in (
        ("SH", "shoulder"),
        ("EL", "elbow"),
        ("WR", "wrist"),
        ("HP", "hip"),
        ("KN", "knee"),
        ("AN", "ankle"),
    )
}
#: The same of the toes, which not every truth or track has.
TOES = {"RTO": "right_toe", "LTO": "left_toe"}
STRIKE_PHASE = {"right": 0.0, "left": 0.5}
#: A phase nearer than this to the truth (or to its half-cycle twin) counts as there.
NEAR_PHASE = 0.1
#: Below this probability of swapped sides the tracker claims to know the sides.
SURE_SWAPPED = 0.1
#: Clearly a strike of the forward walk; annotations below are guesses at the ends of the clip.
MIN_CERTAINTY = 0.7


@dataclass(frozen=True)
class Spread:
    """Errors of one quantity over the frames, in its own unit."""

    rms: float
    mean: float
    max: float
    count: int

    @classmethod
    def of(cls, errors: np.ndarray) -> Spread:
        """Summary of the finite entries; NaN when there are none."""
        e = errors[np.isfinite(errors)]
        if e.size == 0:
            return cls(np.nan, np.nan, np.nan, 0)
        return cls(float(np.sqrt(np.mean(e**2))), float(e.mean()), float(np.abs(e).max()), e.size)


@dataclass(frozen=True)
class PhaseErrors:
    """Circular errors of the gait phase, cycles."""

    median_abs: float
    #: Circular mean; meaningless when neither `near_truth` nor `near_half` is large.
    bias: float
    p95_abs: float
    #: Fraction of frames within `NEAR_PHASE` of the truth.
    near_truth: float
    #: Fraction of frames within `NEAR_PHASE` of the truth half a cycle on.
    near_half: float
    count: int


@dataclass(frozen=True)
class Sides:
    """Whether left and right are told apart, over the frames with a known phase."""

    #: Fraction with the phase on the true side of the cycle and `p_swapped` < 0.5.
    right: float
    #: Fraction half a cycle off although `p_swapped` < `SURE_SWAPPED`: the error that must not happen.
    surely_wrong: float
    #: Fraction with `p_swapped` between `SURE_SWAPPED` and 1 - `SURE_SWAPPED`.
    undecided: float
    #: Mean square of `p_swapped` minus what was the case; 0.25 for always answering 0.5.
    brier: float
    median_p_swapped: float


@dataclass(frozen=True)
class Strikes:
    """Heel strikes matched one to one with true ones of the same side."""

    #: True strikes, frames.
    true_frames: tuple[float, ...]
    #: Tracked minus true per true strike, frames; NaN where nothing matched.
    errors_frames: tuple[float, ...]
    #: Tracked strikes between the first and the last true one (half a step more on each end) left over.
    extra: int

    @property
    def matched(self) -> int:
        """Number of true strikes with a counterpart."""
        return int(np.isfinite(self.errors_frames).sum())

    def within(self, frames: float) -> int:
        """Number of true strikes with a counterpart at most `frames` away."""
        return int(np.sum(np.abs(self.errors_frames) <= frames))


@dataclass(frozen=True)
class MocapEvaluation:
    """A track against motion-captured joints."""

    #: Fraction of the frames of the truth that have a tracked row.
    tracked: float
    #: Torso error along the walking direction, metres; positive = ahead.
    along_m: Spread
    #: Horizontally across the walk, metres; positive = to the walker's left.
    across_m: Spread
    #: Along the horizontal viewing direction, metres; positive = too far away.
    depth_m: Spread
    height_m: Spread
    heading_deg: Spread
    #: Fraction of frames within two of the stated standard deviations: x, y, z, phase (0.95 when honest).
    within_2sd: Mapping[str, float]
    phase: PhaseErrors
    sides: Sides
    #: Per angle, e.g. `right_hip`, degrees.
    angles_deg: Mapping[str, Spread]
    joint_median_m: float
    joint_p95_m: float
    joint_median_px: float
    strikes: Strikes

    def figures(self) -> dict[str, str]:
        """Labelled figures for `table`."""
        return {
            "tracked": f"{self.tracked:.2f}",
            "along m": _spread(self.along_m, 3),
            "across m": _spread(self.across_m, 3),
            "depth m": _spread(self.depth_m, 3),
            "height m": _spread(self.height_m, 3),
            "heading deg": _spread(self.heading_deg, 1),
            "within 2 sd": " ".join(f"{name} {value:.2f}" for name, value in self.within_2sd.items()),
            **_phase_figures(self.phase),
            **_sides_figures(self.sides),
            **{f"{name} deg": _spread(value, 1) for name, value in self.angles_deg.items()},
            "joints m": f"median {self.joint_median_m:.3f} p95 {self.joint_p95_m:.3f}",
            "joints px": f"median {self.joint_median_px:.1f}",
            "strikes": _strikes_figure(self.strikes),
        }


@dataclass(frozen=True)
class AnnotatedEvaluation:
    """A track against a clip annotated by eye (one near and one far side)."""

    #: First and last tracked frame, and the number of tracked frames.
    first_frame: int
    last_frame: int
    frames: int
    phase: PhaseErrors
    sides: Sides
    strikes: Strikes
    #: Per angle, e.g. `near_hip`, degrees, over the annotated frames.
    angles_deg: Mapping[str, Spread]
    #: Median distance from the annotated joint and the annotator's own standard deviation, pixels.
    joints_px: Mapping[str, tuple[float, float]]

    def figures(self) -> dict[str, str]:
        """Labelled figures for `table`."""
        joints = {
            f"{name} px": f"median {error:.1f} (annotator's sd {sd:.1f})"
            for name, (error, sd) in self.joints_px.items()
        }
        return {
            "frames": f"{self.first_frame}-{self.last_frame}, {self.frames} rows",
            **_phase_figures(self.phase),
            **_sides_figures(self.sides),
            "strikes": _strikes_figure(self.strikes),
            **{f"{name} deg": _spread(value, 1) for name, value in self.angles_deg.items()},
            **joints,
        }


@dataclass(frozen=True)
class HalfCycleEvaluation:
    """A track of a clip in which only the phase modulo half a cycle can be demanded."""

    first_frame: int
    last_frame: int
    frames: int
    #: Median and 95 % of the distance to the truth modulo half a cycle, cycles (at most 0.25).
    folded_median_abs: float
    folded_p95_abs: float
    #: Circular mean of the folded errors, cycles.
    folded_bias: float
    sides: Sides

    def figures(self) -> dict[str, str]:
        """Labelled figures for `table`."""
        return {
            "frames": f"{self.first_frame}-{self.last_frame}, {self.frames} rows",
            "phase mod 0.5": f"median {self.folded_median_abs:.3f} bias {self.folded_bias:+.3f} "
            f"p95 {self.folded_p95_abs:.3f}",
            **_sides_figures(self.sides),
        }


def evaluate_mocap(
    track_csv: Path | str,
    truth_csv: Path | str,
    events_csv: Path | str,
    tracked_events_csv: Path | str | None = None,
    view_direction: tuple[float, float] = (0.0, 1.0),
) -> MocapEvaluation:
    """Judges a track against motion-captured joints and the heel strikes of `events_csv`.

    Without `tracked_events_csv` the tracked strikes are where the tracked phase crosses 0 and 0.5.
    `view_direction` is the camera's horizontal viewing direction in world (x, y).
    """
    track, truth = read_track(track_csv), read_columns(truth_csv)
    in_track, in_truth = common_frames(track["frame"], truth["frame"])
    forward = walking_direction(truth)
    left = np.array([-forward[1], forward[0], 0.0])
    view = np.array([*view_direction, 0.0]) / np.hypot(*view_direction)
    error = points(track, "")[in_track] - true_torso(truth)[in_truth]

    strikes = true_strikes(read_columns(events_csv))
    phase_error = phase_errors(track, strikes)
    distance_m, distance_px = _joint_distances(track, truth, in_track, in_truth)
    true_deg = true_angles_deg(truth, forward)
    heading = np.degrees(track["heading_rad"][in_track] - np.arctan2(forward[1], forward[0]))
    return MocapEvaluation(
        tracked=in_track.size / truth["frame"].size,
        along_m=Spread.of(error @ forward),
        across_m=Spread.of(error @ left),
        depth_m=Spread.of(error @ view),
        height_m=Spread.of(error[:, 2]),
        heading_deg=Spread.of(wrap(heading, 360.0)),
        within_2sd=_within_2sd(track, in_track, error, phase_error),
        phase=_phase_summary(phase_error),
        sides=_sides(phase_error, track["p_swapped"]),
        angles_deg={
            name: Spread.of(wrap(track[f"{name}_deg"][in_track] - angle[in_truth], 360.0))
            for name, angle in true_deg.items()
        },
        joint_median_m=float(np.nanmedian(distance_m)),
        joint_p95_m=float(np.nanpercentile(distance_m, 95)),
        joint_median_px=float(np.nanmedian(distance_px)),
        strikes=match_strikes(_tracked_strikes(track, tracked_events_csv), strikes),
    )


def evaluate_demo4(
    track_csv: Path | str, events_csv: Path | str | None, annotation_dir: Path | str
) -> AnnotatedEvaluation:
    """Judges the track of `sports2d_demo4`, whose near side is the walker's left.

    `events_csv` holds the tracked events; `None` takes them from the tracked phase. A walk counts as
    tracked when six of six strikes lie `within(2)` frames on their legs.
    """
    return _evaluate_annotated(track_csv, events_csv, Path(annotation_dir), near="left")


def evaluate_weizmann(track_csv: Path | str, annotation_dir: Path | str) -> HalfCycleEvaluation:
    """Judges the track of `weizmann_ido_walk` (near side = right), where left and right can't be told:
    the phase modulo half a cycle must be right, and `p_swapped` should say "undecided"."""
    track = read_track(track_csv)
    strikes = annotated_strikes(Path(annotation_dir), near="right", min_certainty=0.0)
    error = phase_errors(track, strikes)
    folded = wrap(error[np.isfinite(error)], 0.5)
    frames = track["frame"]
    return HalfCycleEvaluation(
        first_frame=int(frames[0]),
        last_frame=int(frames[-1]),
        frames=frames.size,
        folded_median_abs=_median(np.abs(folded)),
        folded_p95_abs=_percentile(np.abs(folded), 95),
        folded_bias=circular_mean(folded, 0.5),
        sides=_sides(error, track["p_swapped"]),
    )


def _evaluate_annotated(
    track_csv: Path | str, events_csv: Path | str | None, annotation: Path, near: str
) -> AnnotatedEvaluation:
    track = read_track(track_csv)
    strikes = annotated_strikes(annotation, near, MIN_CERTAINTY)
    phase_error = phase_errors(track, strikes)
    frames = track["frame"]
    return AnnotatedEvaluation(
        first_frame=int(frames[0]),
        last_frame=int(frames[-1]),
        frames=frames.size,
        phase=_phase_summary(phase_error),
        sides=_sides(phase_error, track["p_swapped"]),
        strikes=match_strikes(_tracked_strikes(track, events_csv), strikes),
        angles_deg=annotated_angles(track, read_columns(annotation / "angles.csv"), near),
        joints_px=_annotated_joints(track, read_columns(annotation / "joints.csv"), near),
    )


# Reading


def read_columns(path: Path | str) -> Columns:
    """The columns of a CSV file: numbers as float (blank = NaN), anything else as text."""
    with open(path, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows:
        raise ValueError(f"{path}: no rows")
    return {name: _as_array([row[name] for row in rows]) for name in rows[0]}


def read_track(path: Path | str) -> Columns:
    """A `track.csv` sorted by frame, rows without a finite torso dropped (they are not tracked)."""
    return tracked_rows(read_columns(path), path)


def tracked_rows(track: Columns, source: Path | str = "track") -> Columns:
    """The rows of a track with a finite torso, sorted by frame; `source` is for complaints."""
    needed = {"frame", "x_m", "y_m", "z_m", "heading_rad", "phase", "p_swapped"}
    if missing := sorted(needed - track.keys()):
        raise ValueError(f"{source}: columns missing: {missing}")
    finite = np.isfinite(points(track, "")).all(axis=1)
    order = np.argsort(track["frame"], kind="stable")
    order = order[finite[order]]
    if order.size == 0:
        raise ValueError(f"{source}: no row with a finite torso")
    if (repeated := np.flatnonzero(np.diff(track["frame"][order]) == 0)).size:
        raise ValueError(f"{source}: frame {track['frame'][order][repeated[0]]:g} occurs more than once")
    return {name: column[order] for name, column in track.items()}


def _as_array(texts: Sequence[str]) -> np.ndarray:
    try:
        return np.array([float(text) if text.strip() else np.nan for text in texts])
    except ValueError:
        return np.array(texts)


def points(columns: Columns, prefix: str) -> np.ndarray:
    """(N, 3) points of the columns `{prefix}x_m`, `{prefix}y_m`, `{prefix}z_m`."""
    return np.stack([columns[f"{prefix}{axis}_m"] for axis in "xyz"], axis=1)


def _pixels(columns: Columns, prefix: str) -> np.ndarray:
    return np.stack([columns[f"{prefix}{axis}_px"] for axis in "uv"], axis=1)


def common_frames(tracked: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Row indices, in the track and in the truth, of the frames they share."""
    common, in_track, in_truth = np.intersect1d(tracked, true, assume_unique=True, return_indices=True)
    if common.size == 0:
        raise ValueError(
            f"no common frame: track {tracked[0]:g}-{tracked[-1]:g}, truth {true[0]:g}-{true[-1]:g}"
        )
    return in_track, in_truth


# What the truth says


def true_torso(truth: Columns) -> np.ndarray:
    """(N, 3) torso centres: midpoint of mid-shoulders and mid-hips, metres."""
    return np.mean([points(truth, f"{joint}_") for joint in ("RSH", "LSH", "RHP", "LHP")], axis=0)


def walking_direction(truth: Columns) -> np.ndarray:
    """Unit horizontal direction of the straight line fitted to the torso over time."""
    time = truth["time_s"] - truth["time_s"].mean()
    velocity = time @ true_torso(truth)[:, :2] / (time @ time)
    return np.array([*velocity, 0.0]) / np.hypot(*velocity)


def true_angles_deg(truth: Columns, forward: np.ndarray) -> dict[str, np.ndarray]:
    """Hip and knee angles of `joint_angles_deg`."""
    angles = joint_angles_deg(truth, {code: code for code in JOINTS}, forward)
    return {name: angle for name, angle in angles.items() if name.endswith(("_hip", "_knee"))}


def joint_angles_deg(
    columns: Columns, names: Mapping[str, str], forward: np.ndarray
) -> dict[str, np.ndarray]:
    """Flexion of the joints in the vertical plane of the walking direction, `right_hip` and so on.

    `names` gives the joints' names in the columns by their codes. hip = thigh against the vertical, forward
    positive; knee = thigh - shank; shoulder = upper arm against the vertical; elbow = forearm - upper arm;
    ankle, where there are toes, = foot - shank - 90 degrees, toes up positive.
    """
    angles = {}
    for code, side in (("R", "right"), ("L", "left")):
        at = {
            joint: points(columns, f"{names[code + joint]}_")
            for joint in ("SH", "EL", "WR", "HP", "KN", "AN", "TO")
            if code + joint in names
        }
        thigh, shank, upper_arm, forearm = (
            limb_angle_deg(at[end] - at[start], forward)
            for start, end in (("HP", "KN"), ("KN", "AN"), ("SH", "EL"), ("EL", "WR"))
        )
        angles[f"{side}_hip"] = thigh
        angles[f"{side}_knee"] = wrap(thigh - shank, 360.0)
        angles[f"{side}_shoulder"] = upper_arm
        angles[f"{side}_elbow"] = wrap(forearm - upper_arm, 360.0)
        if "TO" in at:
            foot = limb_angle_deg(at["TO"] - at["AN"], forward)
            angles[f"{side}_ankle"] = wrap(foot - shank - 90.0, 360.0)
    return angles


def limb_angle_deg(limb: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Angle of hanging limbs against the vertical, positive when they point forward."""
    return np.degrees(np.arctan2(limb @ forward, -limb[:, 2]))


@dataclass(frozen=True)
class StrikeList:
    """Heel strikes in order of time."""

    frames: np.ndarray
    sides: np.ndarray

    def stride_frames(self) -> float:
        """Mean duration of a whole cycle, frames."""
        cycles = self.cycles()
        return float((self.frames[-1] - self.frames[0]) / (cycles[-1] - cycles[0]))

    def cycles(self) -> np.ndarray:
        """Phase at each strike counted on over the cycles (a missed strike makes a step of one cycle)."""
        phase = np.array([STRIKE_PHASE[side] for side in self.sides])
        step = np.diff(phase) % 1.0
        return phase[0] + np.concatenate([[0.0], np.cumsum(np.where(step == 0.0, 1.0, step))])


def true_strikes(events: Columns) -> StrikeList:
    """The heel strikes of an events table with columns `frame`, `event`, `side`."""
    strike = events["event"] == "heel_strike"
    frames, sides = events["frame"][strike], events["side"][strike]
    order = np.argsort(frames, kind="stable")
    if order.size < 2:
        raise ValueError(f"{order.size} heel strikes: at least two are needed to interpolate the phase")
    return StrikeList(frames[order], sides[order])


def annotated_strikes(annotation: Path, near: str, min_certainty: float) -> StrikeList:
    """Heel strikes marked by eye, near and far turned into sides."""
    return true_strikes(annotated_events(annotation, near, min_certainty))


def annotated_events(annotation: Path, near: str, min_certainty: float) -> Columns:
    """Columns `frame`, `event` and `side` of the events marked by eye, near and far turned into sides."""
    events = read_columns(annotation / "events.csv")
    far = "left" if near == "right" else "right"
    keep = events["certainty"] >= min_certainty
    side = np.where(events["leg"] == "near", near, far)
    return {"frame": events["frame"][keep], "event": events["event"][keep], "side": side[keep]}


# Comparing


def phase_errors(track: Columns, strikes: StrikeList) -> np.ndarray:
    """Tracked minus true phase per tracked frame, in [-0.5, 0.5); NaN outside the strikes' range."""
    true = np.interp(track["frame"], strikes.frames, strikes.cycles(), left=np.nan, right=np.nan)
    return wrap(track["phase"] - true, 1.0)


def _phase_summary(errors: np.ndarray) -> PhaseErrors:
    e = errors[np.isfinite(errors)]
    size = np.abs(e)
    return PhaseErrors(
        median_abs=_median(size),
        bias=circular_mean(e, 1.0),
        p95_abs=_percentile(size, 95),
        near_truth=_fraction(size <= NEAR_PHASE),
        near_half=_fraction(0.5 - size <= NEAR_PHASE),
        count=e.size,
    )


def _sides(phase_error: np.ndarray, p_swapped: np.ndarray) -> Sides:
    known = np.isfinite(phase_error)
    swapped, p = np.abs(phase_error[known]) > 0.25, p_swapped[known]
    return Sides(
        right=_fraction(~swapped & (p < 0.5)),
        surely_wrong=_fraction(swapped & (p < SURE_SWAPPED)),
        undecided=_fraction((p >= SURE_SWAPPED) & (p <= 1.0 - SURE_SWAPPED)),
        brier=float(np.mean((p - swapped) ** 2)) if p.size else np.nan,
        median_p_swapped=_median(p),
    )


def match_strikes(tracked: Sequence[tuple[float, str]], true: StrikeList) -> Strikes:
    """Pairs strikes of the same side, nearest first, at most a quarter of a stride apart."""
    reach = true.stride_frames() / 4.0
    pairs = sorted(
        (abs(frame - true_frame), i, j)
        for i, (true_frame, true_side) in enumerate(zip(true.frames, true.sides, strict=True))
        for j, (frame, side) in enumerate(tracked)
        if side == true_side and abs(frame - true_frame) <= reach
    )
    errors, used = np.full(true.frames.size, np.nan), set()
    for _, i, j in pairs:
        if np.isnan(errors[i]) and j not in used:
            errors[i] = tracked[j][0] - true.frames[i]
            used.add(j)
    first, last = true.frames[0] - reach, true.frames[-1] + reach
    extra = sum(first <= frame <= last and j not in used for j, (frame, _) in enumerate(tracked))
    return Strikes(tuple(map(float, true.frames)), tuple(map(float, errors)), extra)


def _tracked_strikes(track: Columns, events_csv: Path | str | None) -> list[tuple[float, str]]:
    if events_csv is None:
        return strikes_from_phase(track["frame"], track["phase"])
    events = read_columns(events_csv)
    strike = events["event"] == "heel_strike"
    return [(float(f), str(s)) for f, s in zip(events["frame"][strike], events["side"][strike], strict=True)]


def strikes_from_phase(frames: np.ndarray, phase: np.ndarray) -> list[tuple[float, str]]:
    """Frames at which the phase advances over 0 (right) or 0.5 (left), linear between rows."""
    strikes = []
    for f0, f1, p0, p1 in zip(frames[:-1], frames[1:], phase[:-1], phase[1:], strict=True):
        step = wrap(p1 - p0, 1.0)
        for side, at in STRIKE_PHASE.items():
            ahead = (at - p0) % 1.0
            if 0.0 < ahead <= step:
                strikes.append((float(f0 + (f1 - f0) * ahead / step), side))
    return sorted(strikes)


def _joint_distances(
    track: Columns, truth: Columns, in_track: np.ndarray, in_truth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Distances of all twelve joints in all common frames, metres and pixels."""
    metres, pixels = [], []
    for code, name in JOINTS.items():
        offset_m = points(track, f"{name}_")[in_track] - points(truth, f"{code}_")[in_truth]
        offset_px = _pixels(track, f"{name}_")[in_track] - _pixels(truth, f"{code}_")[in_truth]
        metres.append(np.linalg.norm(offset_m, axis=1))
        pixels.append(np.linalg.norm(offset_px, axis=1))
    return np.concatenate(metres), np.concatenate(pixels)


def _within_2sd(
    track: Columns, in_track: np.ndarray, torso_error: np.ndarray, phase_error: np.ndarray
) -> dict[str, float]:
    """Fraction of errors within two stated standard deviations (world axes) where the track states any."""
    errors = {f"{axis}_m": (torso_error[:, i], in_track) for i, axis in enumerate("xyz")}
    known = np.flatnonzero(np.isfinite(phase_error))
    errors["phase"] = (phase_error[known], known)
    return {
        name.removesuffix("_m"): _fraction(np.abs(error) <= 2.0 * track[f"sd_{name}"][rows])
        for name, (error, rows) in errors.items()
        if f"sd_{name}" in track
    }


def annotated_angles(track: Columns, angles: Columns, near: str) -> dict[str, Spread]:
    """Errors of the annotated angles; the far leg's are those corrected for the annotator's single hip."""
    far = "left" if near == "right" else "right"
    pairs = {
        "near_hip": (f"{near}_hip_deg", "near_thigh_vs_vertical_deg"),
        "near_knee": (f"{near}_knee_deg", "near_knee_flexion_deg"),
        "near_elbow": (f"{near}_elbow_deg", "near_elbow_flexion_deg"),
        "far_hip": (f"{far}_hip_deg", "far_thigh_parallax_corrected_deg"),
        "far_knee": (f"{far}_knee_deg", "far_knee_flexion_parallax_corrected_deg"),
    }
    in_track, in_truth = common_frames(track["frame"], angles["frame"])
    return {
        name: Spread.of(wrap(track[tracked][in_track] - angles[true][in_truth], 360.0))
        for name, (tracked, true) in pairs.items()
    }


def _annotated_joints(track: Columns, joints: Columns, near: str) -> dict[str, tuple[float, float]]:
    """Median pixel distance and mean annotation sd per joint (the annotated hip is the near one)."""
    far = "left" if near == "right" else "right"
    names = {f"near_{j}": f"{near}_{j}" for j in ("shoulder", "elbow", "wrist", "knee", "ankle")}
    names |= {"hip": f"{near}_hip", "far_knee": f"{far}_knee", "far_ankle": f"{far}_ankle"}
    in_track, in_truth = common_frames(track["frame"], joints["frame"])
    result = {}
    for annotated, tracked in names.items():
        true = np.stack([joints[f"{annotated}_x"], joints[f"{annotated}_y"]], axis=1)[in_truth]
        distance = np.linalg.norm(_pixels(track, f"{tracked}_")[in_track] - true, axis=1)
        result[annotated] = (_median(distance), float(np.nanmean(joints[f"{annotated}_sd"][in_truth])))
    return result


# Small statistics


def wrap(value: np.ndarray, period: float) -> np.ndarray:
    """The value modulo the period, in [-period/2, period/2)."""
    return (value + period / 2.0) % period - period / 2.0


def circular_mean(values: np.ndarray, period: float) -> float:
    if values.size == 0:
        return np.nan
    turn = 2.0 * np.pi / period
    return float(np.angle(np.exp(1j * turn * values).mean()) / turn)


def _median(values: np.ndarray) -> float:
    return _percentile(values, 50)


def _percentile(values: np.ndarray, percent: float) -> float:
    finite = values[np.isfinite(values)]
    return float(np.percentile(finite, percent)) if finite.size else np.nan


def _fraction(hits: np.ndarray) -> float:
    return float(hits.mean()) if hits.size else np.nan


# Printing


def table(evaluations: Mapping[str, MocapEvaluation | AnnotatedEvaluation | HalfCycleEvaluation]) -> str:
    """One line per figure, one column per named evaluation. Spreads read rms (mean, max)."""
    columns = {name: evaluation.figures() for name, evaluation in evaluations.items()}
    labels = list(dict.fromkeys(label for figures in columns.values() for label in figures))
    rows = [["", *columns], *([label, *(f.get(label, "") for f in columns.values())] for label in labels)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows)
    return "\n".join(lines)


def _spread(spread: Spread, digits: int) -> str:
    return f"{spread.rms:.{digits}f} ({spread.mean:+.{digits}f}, {spread.max:.{digits}f})"


def _phase_figures(phase: PhaseErrors) -> dict[str, str]:
    return {
        "phase": f"median {phase.median_abs:.3f} bias {phase.bias:+.3f} p95 {phase.p95_abs:.3f}",
        "phase near truth/half": f"{phase.near_truth:.2f}/{phase.near_half:.2f} of {phase.count}",
    }


def _sides_figures(sides: Sides) -> dict[str, str]:
    known = f"{sides.right:.2f}/{sides.surely_wrong:.2f}, undecided {sides.undecided:.2f}"
    return {
        "sides right/surely wrong": known,
        "p_swapped": f"median {sides.median_p_swapped:.3f} Brier {sides.brier:.3f}",
    }


def _strikes_figure(strikes: Strikes) -> str:
    errors = " ".join("miss" if np.isnan(e) else f"{e:+.1f}" for e in strikes.errors_frames)
    matched = f"{strikes.matched} of {len(strikes.errors_frames)}, {strikes.within(2.0)} within 2 frames"
    return f"{matched}, {strikes.extra} extra: {errors}"


def main() -> None:
    """Prints the table of one track: `truth.py mocap|demo4|weizmann track.csv clip_directory`."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kind", choices=["mocap", "demo4", "weizmann"])
    parser.add_argument("track", type=Path, help="track.csv")
    parser.add_argument("clip", type=Path, help="directory with truth.csv and events.csv, or annotation/")
    parser.add_argument("--events", type=Path, help="tracked events.csv; default: crossings of the phase")
    args = parser.parse_args()
    if args.kind == "mocap":
        files = (args.clip / "truth.csv", args.clip / "events.csv")
        evaluation = evaluate_mocap(args.track, *files, tracked_events_csv=args.events)
    elif args.kind == "demo4":
        evaluation = evaluate_demo4(args.track, args.events, args.clip / "annotation")
    else:
        evaluation = evaluate_weizmann(args.track, args.clip / "annotation")
    print(table({args.clip.name: evaluation}))


if __name__ == "__main__":
    main()
