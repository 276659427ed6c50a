"""Finds postures of motion-captured people through `memo.posture` and tables their errors.

    python tests/score_postures.py [--only PATTERN] [--rows lengths,height,bare] [--rules R] [--out NOW.json]

A person about 290 px tall is seen at 30 fps from 6 m, from the front, at 45 degrees and from the side, up to
5 s per motion, with independent noise in every coordinate of a keypoint and right and left as they are. Rows
are pooled over the motions of people for tuning and of the others:

* walks and hard walks (crouched, stiff, limping, brisk; altered recordings), rules "walking";
* other motions (jumps, playground, bending, fencing, ...), rules "physical" unless `--rules` names others.
  Their two groups of people swap their parts: what is tuned on one is reported on the other.

"but Gait" is "others" without BTK_Gait, whose skeleton is impossible: the knees cross, the right one is 7 cm
to the left of the left one over the whole walk, and straight legs bend by 22 degrees.

Kinds of rows: `lengths`, with the true lengths and toes; `bare`, the same without toes; `height`, with the
body height alone; `assumed`, with the body height and without the camera, whose field of view is drawn from
45 to 75 degrees and whose height from 0.9 to 2.2 m, at the distance at which the person is 290 px tall.
Figures are then compared in the axes of the camera, so its tilt is no error.

Errors are in cm. `smooth` and `linked` are the mean distance of the 13 joints other than the neck from where
they are, both relative to the neck; `flat` puts all joints as far away as the neck; `fast` is `smooth` over
wrists and ankles. `facing` is the share of frames whose trunk is turned about the vertical by more than 60
degrees, `lean` that of frames whose trunk's axis is off by more than 30 degrees. `signs` is the share of limb
segments mirrored in depth in the smoothed motion, of those whose mirror image is more than 10 cm away. `ece`
is the expected calibration error of `p_mirrored` on the same segments; `undec` is the share of these that are
undecided, `ratio` how many times as often they are mirrored as the others. `bias`, `rms` and `sd` are of the
neck's distance: mean error, its RMS over clips, and the stated standard deviation. `hip`, `knee`, `ankle`,
`shldr` and `elbow` are RMS errors of the flexion of both sides, degrees; ankles only with toes.

Cannot do: real detections, occlusion, cameras with distortion.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import re
import sys
import time
import zlib
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import memo
import numpy as np
from conftest import SHARED_DATA
from limb_angles import angles_of, ankles_of
from memo.keypoints import Keypoints

WALKS = {
    "tuning": ("BTK_ANTO_M_hole", "BTK_BELT_C", "CMU_02_01", "CMU_12_01"),
    "others": ("BTK_Gait", "BMC_walk2"),
}
HARD = {
    "tuning": ("ANTO_crouch", "BELT_stiff", "CMU02_limp", "CMU12_brisk"),
    "others": ("Gait_crouch", "Gait_limp"),
}
OTHER = {
    "01, 03": ("CMU_01_01", "CMU_01_05", "CMU_01_09", "CMU_01_14", "CMU_03_03"),
    "02": ("CMU_02_04_jump", "CMU_02_05_punch", "CMU_02_06", "CMU_02_07", "CMU_02_08"),
}
KINDS = {"walks": (WALKS, "walking"), "hard walks": (HARD, "walking"), "other motions": (OTHER, "physical")}

CODES = {
    side[0].upper() + code: f"{side}_{joint}"
    for side in ("right", "left")
    for code, joint in (
        *(("SH", "shoulder"), ("EL", "elbow"), ("WR", "wrist")),
        *(("HP", "hip"), ("KN", "knee"), ("AN", "ankle"), ("TO", "big_toe")),
    )
}
AZIMUTHS_DEG = (0.0, 45.0, 90.0)
NOISES_PX = (0.0, 2.0, 5.0)
RATE_HZ, MOST_S = 30.0, 5.0
DISTANCE_M, CAMERA_HEIGHT_M, FOCAL_PX, SIZE = 6.0, 1.3, 1000.0, (1280, 960)
#: Fields of view and heights of cameras that are not told.
FOV_DEG, CAMERA_HEIGHTS_M = (45.0, 75.0), (0.9, 2.2)
#: Angles that are compared.
ANGLES = ("hip", "knee", "ankle", "shoulder", "elbow")
#: Share of the pelvis between the middles of shoulders and hips, as `memo` places it in the image.
PELVIS_FROM_SHOULDERS = 45.98 / (45.98 + 10.09)
#: Heights of the shoulders and of the ankles over the body height (Drillis and Contini 1966).
SHOULDER_OVER_HEIGHT, ANKLE_OVER_HEIGHT = 0.818, 0.039
TURNED_DEG, LEANING_DEG, DISTINCT_M = 60.0, 30.0, 0.10
BINS = np.array([0.0, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5000001])

STARTS = (0, 0, 0, 0, 3, 3, 1, 2, 6, 7, 4, 5, 10, 11)
"""Starting joint of each joint in the order of the tree."""
LIMBS, ENDS = tuple(range(6, 14)), (8, 9, 12, 13)


@dataclass(frozen=True)
class Job:
    """One call of `memo.posture`."""

    kind: str
    people: str
    motion: str
    row: str
    azimuth_deg: float
    noise_px: float
    rules: str | None = None
    """None: those of the kind."""


@dataclass(frozen=True)
class Score:
    """What one call found. The last three lists are of limb segments in depth."""

    job: Job
    smooth_cm: float
    linked_cm: float
    flat_cm: float
    fast_cm: float
    absolute_cm: float
    facing: float
    lean: float
    bias_cm: float
    sd_cm: float
    probabilities: tuple[float, ...]
    mirrored: tuple[int, ...]
    undecided: tuple[int, ...]
    angles_deg: tuple[float, ...]
    seconds: float


# The motions


def motion(name: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The points (T, 3) of a recording by memo's names and their times, at `RATE_HZ`."""
    path = SHARED_DATA / "mocap" / "joints" / f"{name}.csv"
    with path.open(encoding="utf-8") as lines:
        rate_hz = float(lines.readline().split(",")[2].split()[0])
        heads = lines.readline().strip().split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=2)
    recorded_s = np.arange(len(rows)) / rate_hz
    times_s = np.arange(0.0, min(recorded_s[-1], MOST_S), 1.0 / RATE_HZ)
    column = {head: rows[:, i] for i, head in enumerate(heads)}
    points = {}
    for code, joint in CODES.items():
        if f"{code}_x" in column:
            axes = [np.interp(times_s, recorded_s, column[f"{code}_{axis}"]) for axis in "xyz"]
            points[joint] = np.stack(axes, axis=-1)
    return points, times_s


def stick(points: dict[str, np.ndarray]) -> np.ndarray:
    """(T, 14, 3) joints of the stick figure: neck between the shoulders, pelvis on the trunk."""
    shoulders, hips = (
        0.5 * (points[f"right_{joint}"] + points[f"left_{joint}"]) for joint in ("shoulder", "hip")
    )
    made = {"neck": shoulders, "pelvis": shoulders + PELVIS_FROM_SHOULDERS * (hips - shoulders)}
    return np.stack([(points | made)[name] for name in memo._memo.joint_names()], axis=1)


def segment_lengths(figures: np.ndarray) -> dict[str, float]:
    """Median distances over the frames of the 17 segments, by their names."""
    place = {name: k for k, name in enumerate(memo._memo.joint_names())}

    def ends(segment: str) -> tuple[int, int]:
        first, second = segment.split("_to_")
        return place[first], place[second]

    both = {segment: ends(segment) for segment in memo._memo.segment_names()}
    return {
        segment: float(np.median(np.linalg.norm(figures[:, a] - figures[:, b], axis=-1)))
        for segment, (a, b) in both.items()
    }


def body_height_m(lengths: dict[str, float], figures: np.ndarray) -> float:
    """Body height, from the length of a straight body from shoulders to ankles."""
    trunk = np.median(np.linalg.norm(figures[:, 0] - 0.5 * (figures[:, 4] + figures[:, 5]), axis=-1))
    legs = [lengths[f"{s}_hip_to_{s}_knee"] + lengths[f"{s}_knee_to_{s}_ankle"] for s in ("right", "left")]
    return float((trunk + np.mean(legs)) / (SHOULDER_OVER_HEIGHT - ANKLE_OVER_HEIGHT))


def heading_of(figures: np.ndarray) -> np.ndarray:
    """Horizontal unit vector of travel, or of the trunk's mean front if the person stays."""
    way = (figures[-3:, 3].mean(axis=0) - figures[:3, 3].mean(axis=0)) * (1.0, 1.0, 0.0)
    if np.linalg.norm(way) < 1.0:
        way = fronts(figures).mean(axis=0) * (1.0, 1.0, 0.0)
    return way / np.linalg.norm(way)


def camera_for(
    figures: np.ndarray, azimuth_deg: float, focal_px: float = FOCAL_PX, height_m: float = CAMERA_HEIGHT_M
) -> memo.Camera:
    """A camera that looks at the middle of the motion; at azimuth 0 the person comes towards it."""
    heading = heading_of(figures)
    aside = np.array([-heading[1], heading[0], 0.0])
    angle = math.radians(azimuth_deg)
    middle = 0.5 * (figures[:, 3].min(axis=0) + figures[:, 3].max(axis=0))
    back = math.cos(angle) * heading + math.sin(angle) * aside
    position = np.array([*middle[:2], height_m]) + DISTANCE_M * focal_px / FOCAL_PX * back
    target = np.array([*middle[:2], 0.9])
    z = (target - position) / np.linalg.norm(target - position)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    matrix = [[focal_px, 0.0, SIZE[0] / 2], [0.0, focal_px, SIZE[1] / 2], [0.0, 0.0, 1.0]]
    return memo.Camera(np.array(matrix), rotation, -rotation @ position, SIZE)


def fronts(figures: np.ndarray) -> np.ndarray:
    """(T, 3) unit vectors to the front of each trunk."""
    left = figures[:, 2] + figures[:, 5] - figures[:, 1] - figures[:, 4]
    front = np.cross(left, figures[:, 0] - figures[:, 3])
    return front / np.linalg.norm(front, axis=-1, keepdims=True)


def sides(figures: np.ndarray) -> np.ndarray:
    """(T, 3) horizontal vectors from right to left."""
    return (figures[:, 2] + figures[:, 5] - figures[:, 1] - figures[:, 4]) * (1.0, 1.0, 0.0)


def trunks(figures: np.ndarray) -> np.ndarray:
    """(T, 3) vectors from pelvis to neck."""
    return figures[:, 0] - figures[:, 3]


def _apart(got: np.ndarray, true: np.ndarray, degrees: float) -> float:
    """Share of vectors that are farther apart than an angle."""
    cosine = (got * true).sum(axis=-1) / np.linalg.norm(got, axis=-1) / np.linalg.norm(true, axis=-1)
    return float((cosine < math.cos(math.radians(degrees))).mean())


# One call


def found(job: Job) -> Score:
    """Calls memo and compares."""
    points, times_s = motion(job.motion)
    figures = stick(points)
    lengths = segment_lengths(figures)
    view: dict[str, Any] = {}
    if job.row == "assumed":
        drawn = np.random.default_rng(zlib.crc32(f"view {job.motion} {job.azimuth_deg}".encode()))
        half_rad = math.radians(drawn.uniform(*FOV_DEG)) / 2
        view = {"focal_px": SIZE[0] / 2 / math.tan(half_rad), "height_m": drawn.uniform(*CAMERA_HEIGHTS_M)}
    camera = camera_for(figures, job.azimuth_deg, **view)
    names = [name for name in points if job.row == "lengths" or "toe" not in name]
    pixels = camera.project(np.concatenate([points[name] for name in names])).reshape(len(names), -1, 2)
    random = np.random.default_rng(zlib.crc32(f"{job.motion} {job.azimuth_deg} {job.noise_px}".encode()))
    pixels = pixels.transpose(1, 0, 2) + random.normal(0.0, job.noise_px, (len(times_s), len(names), 2))
    keypoints = Keypoints.from_arrays(pixels, names=names, times_s=times_s, image_size=SIZE)
    body: dict[str, Any] = {"lengths": lengths}
    if job.row in ("height", "assumed"):
        body = {"height_m": body_height_m(lengths, figures)}
    started = time.perf_counter()
    postures = memo.posture(
        keypoints,
        None if job.row == "assumed" else camera,
        **body,
        rules=job.rules or KINDS[job.kind][1],
        noise_px=max(job.noise_px, 0.5),
        unswap=False,
        max_groups=1,
    )
    nothing = np.full((len(times_s), 3), np.nan)
    toes = np.stack([points.get(f"{side}_big_toe", nothing) for side in ("right", "left")], axis=1)
    return compare(job, postures, figures, toes, camera, time.perf_counter() - started)


def compare(
    job: Job,
    postures: memo.Postures,
    figures: np.ndarray,
    toes: np.ndarray,
    camera: memo.Camera,
    seconds: float,
) -> Score:
    """The figures of one call."""
    rows = np.flatnonzero(postures.found)
    position, true = np.asarray(camera.position), figures[rows]
    # The figures as the camera sees them, in the world: an assumed camera has a world of its own.
    smooth, linked = (
        postures.in_camera(found_m[rows]) @ np.asarray(camera.rotation) + position
        for found_m in (postures.smoothed_m, postures.linked_m)
    )

    def off(got: np.ndarray, joints: Sequence[int] = range(1, 14)) -> float:
        apart = (got - got[:, :1]) - (true - true[:, :1])
        return 100.0 * float(np.nanmean(np.linalg.norm(apart, axis=-1)[:, list(joints)]))

    rays = true - position
    neck_m = np.linalg.norm(rays[:, 0], axis=-1)
    depth = np.asarray(camera.rotation)[2]
    flat = position + rays * ((rays[:, :1] @ depth) / (rays @ depth))[..., None]
    probabilities, mirrored, undecided = signs(postures, rows, smooth, true, rays)
    truth = angles_of(true) | ankles_of(true, toes[rows])

    def angle_rms(joint: str) -> float:
        errors = [
            postures.angles_deg[f"{s}_{joint}"][rows] - truth[f"{s}_{joint}"] for s in ("right", "left")
        ]
        squares = np.square((np.array(errors) + 180) % 360 - 180)
        return float(np.sqrt(np.nanmean(squares))) if np.isfinite(squares).any() else math.nan

    return Score(
        job,
        smooth_cm=off(smooth),
        linked_cm=off(linked),
        flat_cm=off(flat),
        fast_cm=off(smooth, ENDS),
        absolute_cm=100.0 * float(np.nanmean(np.linalg.norm(smooth - true, axis=-1))),
        facing=_apart(sides(smooth), sides(true), TURNED_DEG),
        lean=_apart(trunks(smooth), trunks(true), LEANING_DEG),
        bias_cm=100.0 * float(np.nanmean(postures.anchor_m[rows] - neck_m)),
        sd_cm=100.0 * float(np.nanmean(postures.anchor_sd_m[rows])),
        probabilities=tuple(np.round(probabilities, 4).tolist()),
        mirrored=tuple(mirrored.astype(int).tolist()),
        undecided=tuple(undecided.astype(int).tolist()),
        angles_deg=tuple(angle_rms(joint) for joint in ANGLES),
        seconds=seconds,
    )


def signs(
    postures: memo.Postures, rows: np.ndarray, smooth: np.ndarray, true: np.ndarray, rays: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of limb segments in depth: the stated probability, whether mirrored, whether undecided."""
    units = rays / np.linalg.norm(rays, axis=-1, keepdims=True)

    def along(figure: np.ndarray) -> np.ndarray:
        segments = figure - figure[:, list(STARTS)]
        return np.einsum("tji,tji->tj", segments, units)[:, list(LIMBS)]

    extent, got = along(true), along(smooth)
    stated = postures.p_mirrored[rows][:, list(LIMBS)]
    counted = (2 * np.abs(extent) > DISTINCT_M) & np.isfinite(got) & np.isfinite(stated)
    undecided = postures.undecided_joints[rows][:, list(LIMBS)]
    return stated[counted], (extent * got < 0)[counted], undecided[counted]


# Tables


def pooled(scores: Sequence[Score]) -> dict[str, float]:
    """The row of some calls."""
    stated = np.concatenate([score.probabilities for score in scores])
    mirrored = np.concatenate([score.mirrored for score in scores]).astype(float)
    undecided = np.concatenate([score.undecided for score in scores]).astype(bool)
    rate, other = _mean(mirrored[undecided]), _mean(mirrored[~undecided])
    bias = np.array([score.bias_cm for score in scores])
    names = ("smooth_cm", "fast_cm", "linked_cm", "flat_cm", "absolute_cm")
    return {name.removesuffix("_cm"): _mean([getattr(s, name) for s in scores]) for name in names} | {
        "facing": 100.0 * _mean([score.facing for score in scores]),
        "lean": 100.0 * _mean([score.lean for score in scores]),
        "signs": 100.0 * _mean(mirrored),
        "ece": calibration_error(stated, mirrored),
        "undec": 100.0 * _mean(undecided),
        "ratio": rate / other if other else math.nan,
        "bias": _mean(bias),
        "rms": math.sqrt(_mean(bias**2)),
        "sd": _mean([score.sd_cm for score in scores]),
        **{
            name: math.sqrt(_mean([score.angles_deg[k] ** 2 for score in scores]))
            for k, name in enumerate(("hip", "knee", "ankle", "shldr", "elbow"))
        },
        "ms": 1000.0 * _mean([score.seconds for score in scores]),
    }


def calibration_error(stated: np.ndarray, mirrored: np.ndarray) -> float:
    """Mean over bins of |mean stated probability - rate|, weighted by the number of segments."""
    rows = reliability(stated, mirrored)
    return sum(count * abs(mean - rate) for count, mean, rate in rows) / max(len(stated), 1)


def reliability(stated: np.ndarray, mirrored: np.ndarray) -> list[tuple[int, float, float]]:
    """Per bin of `BINS` that is not empty: number of segments, mean stated probability, rate of mirrored."""
    which = np.digitize(stated, BINS)
    bins = [which == k for k in np.unique(which)]
    return [(int(b.sum()), _mean(stated[b]), _mean(mirrored[b])) for b in bins]


def _mean(values: Any) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def report(scores: Sequence[Score]) -> str:
    """One line per kind of row, kind of motion, people and noise; then the reliability tables."""
    groups: dict[tuple[Any, ...], list[Score]] = {}
    for score in scores:
        job = score.job
        people = [job.people] + ["but Gait"] * (job.people == "others" and "Gait" not in job.motion)
        for group in people:
            groups.setdefault((job.row, job.kind, group, job.noise_px), []).append(score)
    lines = []
    for (row, kind, people, noise_px), members in groups.items():
        cells = pooled(members)
        if not lines:
            heads = " ".join(f"{name:>8}" for name in cells)
            lines.append(f"{'row':8}{'motions':15}{'people':8}{'px':>3} {heads}")
        numbers = " ".join(f"{v:8.3f}" if name == "ece" else f"{v:8.1f}" for name, v in cells.items())
        lines.append(f"{row:8}{kind:15}{people:8}{noise_px:3.0f} {numbers}")
    for kind in KINDS:
        members = [score for score in scores if score.job.kind == kind and score.job.row == "lengths"]
        if members:
            stated = np.concatenate([score.probabilities for score in members])
            mirrored = np.concatenate([score.mirrored for score in members]).astype(float)
            cells = [f"{p:.3f}: {rate:.3f} ({n})" for n, p, rate in reliability(stated, mirrored)]
            lines += ["", f"{kind}, stated p_mirrored: rate of mirrored segments (number)", "; ".join(cells)]
    return "\n".join(lines)


# The command


def jobs(rows: Sequence[str], only: str, noises_px: Sequence[float], rules: str | None) -> list[Job]:
    """All calls; the body height alone is tried with the second noise only."""
    return [
        Job(kind, people, name, row, azimuth_deg, noise_px, rules)
        for row in rows
        for kind, (groups, _) in KINDS.items()
        for people, names in groups.items()
        for noise_px in noises_px
        if row == "lengths" or noise_px == NOISES_PX[1]
        for name in names
        if re.search(only, name)
        for azimuth_deg in AZIMUTHS_DEG
    ]


def main() -> int:
    """Finds, prints, stores; 1 if a call failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="PATTERN", default="", help="motions whose name has this (regex)")
    parser.add_argument("--rows", default="lengths,bare,height,assumed", help="kinds of rows, with commas")
    parser.add_argument("--noise", default="0,2,5", help="standard deviations of the noise, pixels")
    parser.add_argument("--rules", help="rules of all motions, whatever their kind")
    parser.add_argument("--out", type=Path, metavar="FILE.json", help="stores the figures of every call")
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    every = jobs(
        args.rows.split(","), args.only, [float(noise) for noise in args.noise.split(",")], args.rules
    )
    done: dict[Job, Score] = {}
    failed = False
    # The core has threads of its own: a forked copy of them would wait for ever.
    with ProcessPoolExecutor(args.workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        running = {pool.submit(found, job): job for job in every}
        for future in as_completed(running):
            try:
                done[running[future]] = future.result()
            except Exception as error:
                failed = True
                print(f"{running[future]}: {type(error).__name__}: {error}", file=sys.stderr, flush=True)
    scores = [done[job] for job in every if job in done]
    print(report(scores))
    if args.out:
        args.out.write_text(json.dumps([asdict(score) for score in scores]), encoding="utf-8")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
