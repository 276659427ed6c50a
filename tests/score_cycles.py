"""Gait cycles against motion capture: the band of average walking, intervals of means, repeated walks.

    python tests/score_cycles.py RUNS [--only PATTERN]

RUNS has one folder of `memo track` per drawn walk, with the walk's name; a missing one is tracked and written
there. Four tables:

1. The clinical average curves against the true joint centres of each motion-captured person: mean difference,
   and the share of the cycle within two standard deviations of the corrected average
   (`memo_core::track::normal_gait`).
2. The same share for the mean cycles that memo measured.
3. How much of the true mean cycles, and of the true differences between any two of them, is in the 95 %
   intervals; the ankle on people with toes.
4. RMS difference between the mean cycles of two walks, measured and true.

Nobody of these people was recorded in two walks. Two clips of one person are drawn from the same walk, with
other clothes, cameras and bodies, so their true curves are nearly equal; an altered walk (limp, crouch) truly
differs.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Mapping
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import truth as gt
from conftest import SHARED_DATA
from memo import _memo
from memo.compare import LEAST_SHARE, curve_differences
from memo.cycles import mean_cycle, read_cycles_csv
from scipy.interpolate import CubicSpline
from scipy.signal import butter, filtfilt
from score_walks import GROUPS, Clip, shared_clips, walking_direction

JOINTS = ("hip", "knee")
"""Joints with a band of average walking."""
RECORDED = {
    **{"ANTO": "BTK_ANTO_M_hole", "BELT": "BTK_BELT_C", "CMU02": "CMU_02_01", "CMU12": "CMU_12_01"},
    **{"Gait": "BTK_Gait", "BMC2": "BMC_walk2"},
}
"""The recording of each person."""
DRAWN = {"mocap_a": "ANTO", "mocap_b": "BELT", "mocap_c_yaw25": "CMU12"}
"""Who walks in the clips whose names do not say it."""
ALTERED = GROUPS["crouch, stiff, limp, brisk"]
PERCENT = np.arange(101)
ENDS = ("ci_low_deg", "ci_high_deg")
#: Contact: the ankle's forward speed falls below this share of the walking speed.
STRIKE_SHARE = 0.4

Curves = dict[tuple[str, str], np.ndarray]
"""The mean cycle by side and joint."""


# True cycles


def clip_curves(folder: Path) -> Curves:
    """The true mean cycles of a drawn walk."""
    columns = gt.read_columns(folder / "truth.csv")
    codes = {code: code for code in (*gt.JOINTS, *gt.TOES) if f"{code}_x_m" in columns}
    angles = gt.joint_angles_deg(columns, codes, walking_direction(columns))
    events = gt.read_columns(folder / "events.csv")
    strikes_s = {
        side: events["time_s"][(events["event"] == "heel_strike") & (events["side"] == side)]
        for side in ("right", "left")
    }
    return mean_curves(columns["time_s"], angles, strikes_s)


def recorded_curves(name: str) -> Curves:
    """The true mean cycles of a recording."""
    path = SHARED_DATA / "mocap" / "joints" / f"{RECORDED[name]}.csv"
    with open(path, encoding="utf-8") as file:
        rate_hz = float(re.search(r"([\d.]+) Hz", file.readline())[1])
        names = file.readline().strip().split(",")
        values = np.loadtxt(file, delimiter=",")
    smooth = butter(2, 6 / (rate_hz / 2))
    columns = {
        re.sub("(_[xyz])$", r"\1_m", name): filtfilt(*smooth, value)
        for name, value in zip(names, values.T, strict=True)
    }
    forward = walking_direction(columns)
    angles = gt.joint_angles_deg(columns, {code: code for code in gt.JOINTS}, forward)
    walking = np.gradient(gt.points(columns, "RHP_") @ forward).mean()
    strikes_s = {
        side: strikes(np.gradient(gt.points(columns, f"{side[0].upper()}AN_") @ forward) / walking) / rate_hz
        for side in ("right", "left")
    }
    return mean_curves(np.arange(len(values)) / rate_hz, angles, strikes_s)


def strikes(speed: np.ndarray) -> np.ndarray:
    """Samples at which a swinging foot stops; `speed` is in walking speeds."""
    falls = np.flatnonzero((speed[:-1] >= STRIKE_SHARE) & (speed[1:] < STRIKE_SHARE))
    swung = [fall for fall in falls if speed[max(0, fall - 50) : fall].max(initial=0) > 1.6]
    return np.array([k + (speed[k] - STRIKE_SHARE) / (speed[k] - speed[k + 1]) for k in swung])


def mean_curves(
    times_s: np.ndarray, angles: Mapping[str, np.ndarray], strikes_s: Mapping[str, np.ndarray]
) -> Curves:
    """Mean cycles between successive strikes of a side."""
    found: Curves = {}
    for side, at_s in strikes_s.items():
        cycles = [a + (b - a) * PERCENT / 100 for a, b in pairwise(at_s) if b - a < 1.8]
        for joint in (joint for joint in (*JOINTS, "ankle") if cycles and f"{side}_{joint}" in angles):
            spline = CubicSpline(times_s, angles[f"{side}_{joint}"])
            found[side, joint] = np.mean([spline(cycle) for cycle in cycles], axis=0)
    return found


# Measured cycles


def longest(folder: Path) -> tuple[Mapping[str, np.ndarray], int]:
    """The table of cycles of a run, and the number of its longest walk."""
    table = read_cycles_csv(folder / "cycles.csv")
    return table, int(np.bincount(table["walk"]).argmax()) if len(table["walk"]) else 0


def measured(folder: Path, column: str = "angle_deg") -> Curves:
    """A column of the mean cycles of the longest walk of a run; NaN where not measured."""
    table, walk = longest(folder)
    keys = [(side, joint) for side in ("right", "left") for joint in (*JOINTS, "ankle")]
    means = {key: mean_cycle(table, walk, *key)[column] for key in keys}
    return {key: mean for key, mean in means.items() if np.isfinite(mean).any()}


def track(clip: Clip, runs: Path) -> Path:
    """The folder of the run of a clip; tracks it if there is none."""
    from memo import Camera
    from memo.recording import Recording, track_recording

    folder = runs / clip.name
    if not (folder / "cycles.csv").is_file():
        print(f"tracking {clip.name}", file=sys.stderr, flush=True)
        folder.mkdir(parents=True, exist_ok=True)
        options = {"height_m": clip.height_m, "camera": Camera.from_file(clip.folder / "camera.toml")}
        track_recording(Recording(clip.folder / "video.mp4", options, overlay=False, plots=False), folder)
    return folder


# Tables


def clinical(joint: str) -> np.ndarray:
    """The clinical average, degrees."""
    scene = _memo.Scene(0, frames=5)
    return np.array([scene.angles_deg(percent / 100)[JOINTS.index(joint)] for percent in PERCENT])


def inside(curve: np.ndarray, joint: str) -> float:
    """Share of the known points within two standard deviations of the corrected average, per cent."""
    average, sd = _memo.normal_cycle(joint).T
    known = np.isfinite(curve)
    return float(100 * np.mean(np.abs(curve - average)[known] <= 2 * sd[known]))


def rms(difference: np.ndarray) -> float:
    """Root mean square of the known values."""
    return float(np.sqrt(np.nanmean(difference**2)))


def band_lines(curves: Mapping[str, Curves]) -> Iterator[str]:
    """Mean difference to the clinical average, and share within the band, right / left."""
    for name, of in curves.items():
        cells = []
        for joint in JOINTS:
            sides = [of[side, joint] for side in ("right", "left") if (side, joint) in of]
            off = " / ".join(f"{np.nanmean(curve - clinical(joint)):+5.1f}" for curve in sides)
            share = " / ".join(f"{inside(curve, joint):3.0f}" for curve in sides)
            cells.append(f"{joint} {off} deg, {share} % inside")
        yield f"{name:18s} " + "; ".join(cells)


def coverage_lines(truths: Mapping[str, Curves], folders: Mapping[str, Path]) -> Iterator[str]:
    """Share of the points of the true means in the intervals, RMS error and mean half width; differences."""
    for joint in (*JOINTS, "ankle"):
        hits, errors, halves = [], [], []
        for name, true in truths.items():
            mean, low, high = (measured(folders[name], part) for part in ("angle_deg", *ENDS))
            for key in (key for key in true.keys() & mean.keys() if key[1] == joint):
                hits.append(np.mean((low[key] <= true[key]) & (true[key] <= high[key])))
                errors.append(rms(mean[key] - true[key]))
                halves.append(np.nanmean((high[key] - low[key]) / 2))
        yield (
            f"{joint}: {len(hits)} means, {100 * np.mean(hits):.0f} % of the true values in the interval; "
            f"RMS error {np.sqrt(np.mean(np.square(errors))):.1f} deg, half width {np.mean(halves):.1f} deg"
        )
        found = list(difference_hits(joint, truths, folders))
        signs = [sign for _, sign in found if sign is not None]
        share = 100 * np.mean([hit for hit, _ in found])
        yield (
            f"{joint}: {len(found)} differences, {share:.0f} % of the true ones in the interval; "
            f"{len(signs)} sure, {sum(signs)} of them with the true sign"
        )


def difference_hits(
    joint: str, truths: Mapping[str, Curves], folders: Mapping[str, Path]
) -> Iterator[tuple[float, bool | None]]:
    """For any two walks: share of the true difference in the interval; whether a sure one has its sign."""
    tables = {name: longest(folder) for name, folder in folders.items()}
    for a, b in combinations(truths, 2):
        (first, walk_a), (second, walk_b) = tables[a], tables[b]
        for one in curve_differences(first, second, (walk_a, walk_b)):
            key = (one.side, one.joint)
            if one.joint != joint or not (key in truths[a] and key in truths[b]):
                continue
            true = truths[b][key] - truths[a][key]
            percent, value, _ = one.largest
            is_sure = one.sure_share >= LEAST_SHARE
            sign = bool(np.sign(true[percent]) == np.sign(value)) if is_sure else None
            yield float(np.mean(np.abs(one.values_deg - true) <= one.half_deg)), sign


def person(clip: str) -> str:
    """Who walks in a clip."""
    return DRAWN.get(clip, clip.split("_")[0])


def repeat_lines(truths: Mapping[str, Curves], folders: Mapping[str, Path]) -> Iterator[str]:
    """RMS difference between two clips of a person, both sides, measured and (true)."""
    means = {name: measured(folder) for name, folder in folders.items()}
    pooled: dict[tuple[bool, str], list[tuple[float, float]]] = {}
    for a, b in combinations(truths, 2):
        altered = any(word in clip for clip in (a, b) for word in ALTERED)
        if person(a) != person(b):
            continue
        for joint in JOINTS:
            keys = [(side, joint) for side in ("right", "left")]
            keys = [key for key in keys if all(key in of[clip] for of in (means, truths) for clip in (a, b))]
            if keys:
                now, true = (
                    np.mean([rms(of[a][key] - of[b][key]) for key in keys]) for of in (means, truths)
                )
                pooled.setdefault((altered, joint), []).append((now, true))
                yield f"{a:18s} {b:18s} {joint:4s} {now:4.1f} ({true:4.1f})"
    for (altered, joint), found in sorted(pooled.items()):
        kind = "with an altered walk" if altered else "of the same walk"
        middle = np.median(found, axis=0)
        yield f"{len(found)} pairs {kind}, {joint}: median {middle[0]:.1f} measured, {middle[1]:.1f} true"


def main() -> int:
    """Tracks what is missing and prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", type=Path, metavar="RUNS")
    parser.add_argument("--only", metavar="PATTERN", default="", help="clips whose name has this (regex)")
    args = parser.parse_args()
    print("1. True joint centres against the clinical average, right / left")
    print("\n".join(band_lines({name: recorded_curves(name) for name in RECORDED})))
    clips = [clip for clip in shared_clips() if re.search(args.only, clip.name)]
    folders = {clip.name: track(clip, args.runs) for clip in clips}
    print("\n2. Measured mean cycles, right / left")
    print("\n".join(band_lines({name: measured(folder) for name, folder in folders.items()})))
    truths = {clip.name: clip_curves(clip.folder) for clip in clips}
    print("\n3. True mean cycles, and their differences, in the 95 % intervals")
    print("\n".join(coverage_lines(truths, folders)))
    print("\n4. Two clips of a person, RMS difference in degrees, measured (true)")
    print("\n".join(repeat_lines(truths, folders)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
