"""What all postures of a frame cost beside the same tree in numpy and in Python, in the same process.

    python benches/posture_peers.py [--frames 1000] [--rounds 5] [--threads 1]

A walker of Table A.1 (Lee and Chen 1985) is seen from the front, at 45 degrees and from the side, without
noise. The peers are written from the paper: both roots of every segment (eqs. 6-7), then every constraint of
"physical" at the strength "paper": rigid distances, Table 1 without the neck, whose angles need a head, arm
against torso, arm against leg and leg against leg. One text of the constraints serves three peers:

    numpy, all       2^13 combinations at once, every constraint on all of them
    numpy, levels    a level at a time, cut nodes dropped
    Python           depth first, a node at a time, on floats

They ask a constraint of every node; memo asks it once for all nodes at which its joints stand in the same
places, which is a part of the difference, as are noise, weights and reasons of cuts, which they do not have.

memo's time is that of the tree, from rays to the joints of all survivors as an array; `posture`, the call for
keypoints, is timed beside it and has the neck, warnings, grouping, linking, smoothing and its tables in it as
well. Survivors are compared before anything is timed. Each round runs memo, then every peer; a ratio is the
median over rounds of (peer's time / memo's time), so that load on the machine falls on both.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

NECK, R_SHOULDER, L_SHOULDER, PELVIS, R_HIP, L_HIP, R_ELBOW, L_ELBOW = range(8)
R_WRIST, L_WRIST, R_KNEE, L_KNEE, R_ANKLE, L_ANKLE = range(8, 14)
STARTS = (-1, 0, 0, 0, 3, 3, 1, 2, 6, 7, 4, 5, 10, 11)
ARMS = ((R_SHOULDER, R_ELBOW, R_WRIST), (L_SHOULDER, L_ELBOW, L_WRIST))
LEGS = ((R_HIP, R_KNEE, R_ANKLE), (L_HIP, L_KNEE, L_ANKLE))

# Table A.1: segments in the order of the joints they end at, then the distances within the rigid parts.
LENGTHS = (0.0, 0.205, 0.205, 0.463, 0.19, 0.19, 0.30, 0.30, 0.26, 0.26, 0.38, 0.38, 0.37, 0.37)
RIGID = {
    (R_SHOULDER, L_SHOULDER): 0.403,
    (R_SHOULDER, PELVIS): 0.502,
    (L_SHOULDER, PELVIS): 0.502,
    (R_HIP, L_HIP): 0.322,
}
RIGID_TOLERANCE_M = 0.02
LIMB_CLEARANCE_M = 0.03
SHOULDER_PART = 1 / 3  # of the upper arm is within the torso's corner

# Table 1, degrees.
SHOULDER, HIP_SWING, HIP_ABDUCTION, PELVIS_FLEXION = (-50, 180), (-40, 120), (-30, 45), (-30, 75)
ELBOW_MAX, KNEE_MAX, PELVIS_ROTATION, PELVIS_BENDING = 160, 130, 30, 35
HIP_STRAIGHT_KNEE, STRAIGHT_KNEE = 90, 10

SIZE, FIELD_OF_VIEW_DEG, CAMERA_HEIGHT_M, DISTANCE_M = (1920, 1080), 55.0, 1.2, 4.0

# A vector is a triple of floats, or of arrays of them.
Vector = tuple[Any, Any, Any]
Points = dict[int, Vector]


class Maths(NamedTuple):
    """Functions of floats or of arrays."""

    sqrt: Callable[[Any], Any]
    atan2: Callable[[Any, Any], Any]
    clip: Callable[[Any, float, float], Any]


ARRAYS = Maths(np.sqrt, np.arctan2, np.clip)
FLOATS = Maths(math.sqrt, math.atan2, lambda x, low, high: min(max(x, low), high))


def minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def step(a: Vector, s: Any, b: Vector) -> Vector:
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


def dot(a: Vector, b: Vector) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(m: Maths, a: Vector) -> Vector:
    s = 1 / m.sqrt(dot(a, a))
    return a[0] * s, a[1] * s, a[2] * s


def axes(m: Maths, down: Vector, across: Vector) -> tuple[Vector, Vector, Vector]:
    y = unit(m, down)
    x = unit(m, cross(y, across))
    return x, y, cross(x, y)


def torso(m: Maths, p: Points) -> tuple[Vector, Vector, Vector]:
    return axes(m, minus(p[PELVIS], p[NECK]), minus(p[L_SHOULDER], p[R_SHOULDER]))


def within(m: Maths, y: Any, x: Any, limits: tuple[float, float]) -> Any:
    """Whether the angle of (x, y) is in a circular range of degrees."""
    middle, half = (math.radians(sum(limits) / 2), math.radians((limits[1] - limits[0]) / 2))
    c, s = math.cos(middle), math.sin(middle)
    return abs(m.atan2(y * c - x * s, x * c + y * s)) <= half


def hinge(m: Maths, z: Vector, u: Vector, v: Vector, sense: float) -> tuple[Any, Any]:
    """The angle between two segments and whether it is that of a flexion: sense (v x u) z >= 0."""
    w = cross(v, u)
    return m.atan2(m.sqrt(dot(w, w)), dot(u, v)), sense * dot(z, w) >= 0


def segments_apart(m: Maths, a: Vector, b: Vector, c: Vector, d: Vector) -> Any:
    """Whether two segments are the clearance apart: the least of a quadratic on the unit square."""
    u, v, r = minus(b, a), minus(d, c), minus(a, c)
    uu, vv, uv, ur, vr = dot(u, u), dot(v, v), dot(u, v), dot(u, r), dot(v, r)
    # An inner minimum, else one on an edge: all five, and the least of them.
    s = m.clip((uv * vr - ur * vv) / (uu * vv - uv * uv + 1e-300), 0, 1)
    candidates = [(s, m.clip((vr + s * uv) / vv, 0, 1))]
    candidates += [(e, m.clip((vr + e * uv) / vv, 0, 1)) for e in (0.0, 1.0)]
    candidates += [(m.clip((e * uv - ur) / uu, 0, 1), e) for e in (0.0, 1.0)]
    apart = True
    for s, t in candidates:
        gap = step(step(r, s, u), -t, v)
        apart = apart & (dot(gap, gap) >= LIMB_CLEARANCE_M**2)
    return apart


def passes_torso(p: Points, start: Vector, end: Vector) -> Any:
    """Whether a segment passes a triangle of the torso: signs of the volumes on its corners."""
    passes = False
    for a, b, c in ((R_SHOULDER, L_SHOULDER, L_HIP), (R_SHOULDER, L_HIP, R_HIP)):
        normal = cross(minus(p[b], p[a]), minus(p[c], p[a]))
        way = minus(end, start)
        sides = dot(normal, minus(start, p[a])) * dot(normal, minus(end, p[a])) < 0
        to = [minus(p[corner], start) for corner in (a, b, c)]
        x, y, z = (dot(way, cross(to[i], to[(i + 1) % 3])) for i in range(3))
        passes = passes | (sides & (((x >= 0) & (y >= 0) & (z >= 0)) | ((x <= 0) & (y <= 0) & (z <= 0))))
    return passes


def holds(m: Maths, joint: int, p: Points) -> Any:
    """Whether the constraints hold whose last joint this is."""
    good = True
    for (a, b), length in RIGID.items():
        if b == joint:
            between = minus(p[b], p[a])
            good = good & (abs(m.sqrt(dot(between, between)) - length) <= RIGID_TOLERANCE_M)
    if joint == L_HIP:
        return good & pelvis_holds(m, p)
    for side in (0, 1):
        sign = (-1.0, 1.0)[side]
        if joint == ARMS[side][1]:
            good = good & upper_arm_holds(m, p, *ARMS[side][:2], sign)
        elif joint == ARMS[side][2]:
            good = good & forearm_holds(m, p, *ARMS[side])
        elif joint == LEGS[side][1]:
            good = good & thigh_holds(m, p, *LEGS[side][:2], sign)
        elif joint == LEGS[side][2]:
            good = good & shank_holds(m, p, *LEGS[side])
    return good & legs_clear(m, p, joint) if joint >= R_KNEE else good


def pelvis_holds(m: Maths, p: Points) -> Any:
    x, y, z = torso(m, p)
    middle = step(p[R_HIP], 1.0, p[L_HIP])
    down = step((middle[0] * 0.5, middle[1] * 0.5, middle[2] * 0.5), -1.0, p[PELVIS])
    normal, long_axis, _ = axes(m, down, minus(p[L_HIP], p[R_HIP]))
    forward = dot(normal, x)
    rotation, bending = (-PELVIS_ROTATION, PELVIS_ROTATION), (-PELVIS_BENDING, PELVIS_BENDING)
    return (
        within(m, -dot(normal, y), forward, PELVIS_FLEXION)
        & within(m, dot(normal, z), forward, rotation)
        & within(m, dot(long_axis, z), abs(dot(long_axis, y)), bending)
    )


def upper_arm_holds(m: Maths, p: Points, shoulder: int, elbow: int, sign: float) -> Any:
    x, y, z = torso(m, p)
    u = minus(p[elbow], p[shoulder])
    down = dot(y, u)
    clear_of = step(p[shoulder], SHOULDER_PART, u)
    angles = within(m, dot(x, u), down, SHOULDER) & within(m, sign * dot(z, u), down, SHOULDER)
    return angles & (passes_torso(p, clear_of, p[elbow]) ^ True)


def forearm_holds(m: Maths, p: Points, shoulder: int, elbow: int, wrist: int) -> Any:
    z = torso(m, p)[2]
    angle, flexed = hinge(m, z, minus(p[elbow], p[shoulder]), minus(p[wrist], p[elbow]), 1.0)
    return flexed & (angle <= math.radians(ELBOW_MAX)) & (passes_torso(p, p[elbow], p[wrist]) ^ True)


def thigh_holds(m: Maths, p: Points, hip: int, knee: int, sign: float) -> Any:
    x, y, z = torso(m, p)
    u = minus(p[knee], p[hip])
    down = dot(y, u)
    return within(m, dot(x, u), down, HIP_SWING) & within(m, sign * dot(z, u), down, HIP_ABDUCTION)


def shank_holds(m: Maths, p: Points, hip: int, knee: int, ankle: int) -> Any:
    x, y, z = torso(m, p)
    u = minus(p[knee], p[hip])
    angle, flexed = hinge(m, z, u, minus(p[ankle], p[knee]), -1.0)
    swing = m.atan2(dot(x, u), dot(y, u))
    bent = (swing <= math.radians(HIP_STRAIGHT_KNEE)) | (angle > math.radians(STRAIGHT_KNEE))
    return flexed & (angle <= math.radians(KNEE_MAX)) & bent


def legs_clear(m: Maths, p: Points, joint: int) -> Any:
    """Arms, and legs of the other side, against the segment that ends at a knee or an ankle."""
    others = [(arm[i], arm[i + 1]) for arm in ARMS for i in (0, 1)]
    others += [(leg[i], leg[i + 1]) for leg in LEGS if joint not in leg for i in (0, 1) if leg[i + 1] < joint]
    clear = True
    for a, b in others:
        clear = clear & segments_apart(m, p[STARTS[joint]], p[joint], p[a], p[b])
    return clear


def roots(start: Vector, ray: Vector, length: float) -> tuple[Any, Any]:
    """k of eq. (7) on a unit ray: its middle and the square of its half-width."""
    middle = dot(start, ray)
    return middle, length * length - dot(start, start) + middle * middle


def along(ray: Vector, k: Any) -> Vector:
    return ray[0] * k, ray[1] * k, ray[2] * k


def grown(points: Points, rays: list[Vector], joint: int) -> Points:
    """Every node's near and far successor; one, the nearest point of the ray, where there is no real root."""
    middle, square = roots(points[STARTS[joint]], rays[joint], LENGTHS[joint])
    half = np.sqrt(np.maximum(square, 0))
    two = np.nonzero(square > 0)[0]
    node = np.concatenate([np.arange(len(half)), two])
    k = np.concatenate([middle - half, (middle + half)[two]])
    found = {j: (p[0][node], p[1][node], p[2][node]) for j, p in points.items()}
    return {**found, joint: along(rays[joint], k)}


def kept(points: Points, good: Any) -> Points:
    return {j: (p[0][good], p[1][good], p[2][good]) for j, p in points.items()}


def root_of(neck: Vector) -> Points:
    return {NECK: tuple(np.full(1, c) for c in neck)}  # type: ignore[dict-item]


def figures_of(points: Points) -> Any:
    return np.stack([np.stack(points[j], axis=-1) for j in range(14)], axis=1)


def numpy_all(rays: list[Vector], neck: Vector) -> Any:
    points = root_of(neck)
    for joint in range(1, 14):
        points = grown(points, rays, joint)
    good = np.ones(len(points[L_ANKLE][0]), bool)
    for joint in range(1, 14):
        good &= holds(ARRAYS, joint, points)
    return figures_of(kept(points, good))


def numpy_levels(rays: list[Vector], neck: Vector) -> Any:
    points = root_of(neck)
    for joint in range(1, 14):
        points = grown(points, rays, joint)
        good = holds(ARRAYS, joint, points)
        if good is not True:
            points = kept(points, good)
    return figures_of(points)


def python_depth_first(rays: list[Vector], neck: Vector) -> Any:
    points: Points = {NECK: neck}
    leaves: list[list[Vector]] = []

    def descend(joint: int) -> None:
        if joint == 14:
            leaves.append([points[j] for j in range(14)])
            return
        middle, square = roots(points[STARTS[joint]], rays[joint], LENGTHS[joint])
        half = math.sqrt(max(square, 0.0))
        for k in (middle - half, middle + half) if square > 0 else (middle,):
            points[joint] = along(rays[joint], k)
            if holds(FLOATS, joint, points):
                descend(joint + 1)

    descend(1)
    return np.array(leaves).reshape(-1, 14, 3)


def walker(turned_deg: float, phases: Any) -> Any:
    """Walkers on the spot (T, 14, 3), camera axes, turned from facing the camera."""
    a = math.radians(turned_deg)
    forward, left = np.array([math.sin(a), 0, -math.cos(a)]), np.array([math.cos(a), 0, math.sin(a)])
    down = np.array([0.0, 1.0, 0.0])
    figures = np.zeros((len(phases), 14, 3))
    figures[:, NECK] = [0.0, -0.2, DISTANCE_M]

    def put(joint: int, direction: Any) -> None:
        unit_ = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
        figures[:, joint] = figures[:, STARTS[joint]] + LENGTHS[joint] * unit_

    def swung(deg: Any, outward: float) -> Any:
        swing = np.radians(deg)[:, None]
        return np.sin(swing) * forward + np.cos(swing) * down + outward * left

    put(PELVIS, down)
    for side, sign in ((0, -1.0), (1, 1.0)):
        s = sign * np.sin(2 * np.pi * phases)
        c = sign * np.cos(2 * np.pi * phases)
        shoulder, elbow, wrist = ARMS[side]
        hip, knee, ankle = LEGS[side]
        put(shoulder, 0.2015 * sign * left - 0.0377 * forward)
        put(hip, 0.161 * sign * left + 0.1009 * down)
        put(elbow, swung(-4 + 18 * s, 0.10 * sign))
        put(wrist, swung(18 + 22 * s, 0.04 * sign))
        put(knee, swung(6 - 22 * s, 0.02 * sign))
        put(ankle, swung(-14 - 22 * s + 12 * c, 0.01 * sign))
    return figures


def contained(figures: Any, among: Any) -> tuple[int, float]:
    """How many figures are among others to 1e-6 m, and the largest distance of one from its nearest."""
    if len(figures) == 0 or len(among) == 0:
        return 0, 0.0
    far = np.array([np.abs(among - figure).max(axis=(1, 2)).min() for figure in figures])
    return int((far <= 1e-6).sum()), float(far.max())


def seen(figures: Any) -> tuple[Any, Any]:
    """Pixels (T, 14, 2) of figures and the unit rays through them (T, 14, 3)."""
    focal_px = 0.5 * SIZE[0] / math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2)
    flat = figures[..., :2] / figures[..., 2:]
    rays = np.concatenate([flat, np.ones_like(flat[..., :1])], axis=-1)
    pixels = focal_px * flat + (np.array(SIZE) - 1) / 2
    return pixels, rays / np.linalg.norm(rays, axis=-1, keepdims=True)


def memo_lengths() -> dict[str, float]:
    from memo import _memo

    return dict(zip(_memo.segment_names(), (*LENGTHS[1:], *RIGID.values()), strict=True))


def memo_tree(rays: Any, neck: Vector, lengths: dict[str, float]) -> Any:
    from memo import _memo

    return _memo.posture_tree(rays, neck, lengths, rules="physical", strength="paper")


def memo_postures(camera: Any, pixels: Any, distance_m: float, **options: Any) -> dict[str, Any]:
    from memo import _memo

    times_s = np.arange(len(pixels)) / 60
    weights = np.ones(pixels.shape[:2])
    given = {"lengths": memo_lengths(), "anchor": "given", "distance_m": distance_m, **options}
    return _memo.posture(times_s, pixels, weights, camera, **given)  # type: ignore[no-any-return]


def compare_frames(camera: Any, rounds: int) -> None:
    phases = np.arange(24) / 24
    physical = {"rules": "physical", "strength": "paper"}
    names = ("memo, tree", "memo, posture", "numpy, levels", "numpy, all", "Python")
    for view, turned_deg in (("front", 0.0), ("45 deg", 45.0), ("side", 90.0)):
        figures = walker(turned_deg, phases)
        pixels, rays = seen(figures)
        neck = tuple(figures[0, NECK].tolist())
        distance_m = float(np.linalg.norm(figures[0, NECK]))
        agree(view, figures, rays, neck)
        lengths = memo_lengths()
        times: list[list[float]] = []
        for t in range(0, len(phases), 6):
            ray_list = [tuple(ray) for ray in rays[t].tolist()]
            work: list[Callable[[], object]] = [
                partial(memo_tree, rays[t], neck, lengths),
                partial(memo_postures, camera, pixels[t : t + 1], distance_m, **physical),
                *(partial(peer, ray_list, neck) for peer in (numpy_levels, numpy_all, python_depth_first)),
            ]
            for _ in range(rounds):
                marks = [time.perf_counter()]
                for one in work:
                    one()
                    marks.append(time.perf_counter())
                times.append(np.diff(marks).tolist())
        for i, name in enumerate(names):
            ms = 1e3 * statistics.median(row[i] for row in times)
            ratio = statistics.median(row[i] / row[0] for row in times)
            print(f"  {name:20}{ms:12.3f}{ratio:12.1f}")


def agree(view: str, figures: Any, rays: Any, neck: Vector) -> None:
    """memo and every peer have the same survivors, no more and no fewer."""
    counts, truths, worst = [], 0, 0.0
    for t, figure in enumerate(figures):
        ray_list = [tuple(ray) for ray in rays[t].tolist()]
        expected = numpy_levels(ray_list, neck)
        for found in (
            memo_tree(rays[t], neck, memo_lengths()),
            numpy_all(ray_list, neck),
            python_depth_first(ray_list, neck),
        ):
            assert len(found) == len(expected), f"{view}, frame {t}: {len(found)} and {len(expected)}"
            # Survivors differ among themselves by more than the tolerance, so this is one to one.
            among, far = contained(found, expected)
            back, _ = contained(expected, found)
            assert among == back == len(expected), f"{view}, frame {t}: {among} and {back}, {far} m apart"
            worst = max(worst, far)
        truths += contained(figure[None], expected)[0]
        counts.append(len(expected))
    print(
        f"{view}: {len(figures)} frames, {min(counts)} to {max(counts)} survivors, {sum(counts)} in all,"
        f"\n  the same of memo and every peer within {worst:.0e} m; the truth among them in {truths} frames"
    )


def agree_anywhere(views: int) -> None:
    """The same for limbs in any direction, every other view with noise, so that segments lack roots."""
    random = np.random.default_rng(5)
    some = total = 0
    for i in range(views):
        figure = walker(random.uniform(0, 360), random.uniform(0, 1, 1))[0]
        spread = random.choice([0.3, 0.9])
        for limb in (*ARMS, *LEGS):
            for start, end in pairwise(limb):
                direction = np.array([0, 1, 0]) + spread * random.normal(size=3)
                figure[end] = figure[start] + LENGTHS[end] * direction / np.linalg.norm(direction)
        _, rays = seen(figure)
        rays[1:] += (i % 2) * 0.002 * random.normal(size=(13, 3))
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        neck = tuple(figure[NECK].tolist())
        expected = numpy_levels([tuple(ray) for ray in rays.tolist()], neck)
        found = memo_tree(rays, neck, memo_lengths())
        assert len(found) == contained(found, expected)[0] == len(expected), f"view {i}"
        some += len(found) > 0
        total += len(found)
    print(f"limbs anywhere: {views} views, {some} with survivors, {total} in all, the same of memo and numpy")


def time_sequences(camera: Any, frames: int) -> None:
    figures = walker(45.0, np.arange(frames) / 60)
    pixels, _ = seen(figures)
    pixels += np.random.default_rng(1).normal(size=pixels.shape)
    distance_m = float(np.linalg.norm(figures[0, NECK]))
    # Facing the camera and turned to its right; world x right, y into the depth.
    direction = (math.sin(math.radians(45)), -math.cos(math.radians(45)), 0.0)
    for rules, strength in (("walking", "measured"), ("physical", "measured"), ("physical", "paper")):
        options = {"rules": rules, "strength": strength, "noise_px": 1.0, "moving_direction": direction}
        took = []
        for _ in range(3):
            start = time.perf_counter()
            found = memo_postures(camera, pixels, distance_m, **options)
            took.append(time.perf_counter() - start)
        survivors = int(np.median(found["survivors"]))
        per_frame = 1e3 * statistics.median(took) / frames
        print(
            f"  {rules + ', ' + strength:24}{survivors:6} survivors{per_frame:10.3f} ms a frame"
            f"{1e3 / per_frame:10.0f} frames/s"
        )


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--frames", type=int, default=1000)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--threads", type=int, default=1)
    options = parser.parse_args()
    os.environ["RAYON_NUM_THREADS"] = str(options.threads)
    import memo

    camera = memo.Camera.level(SIZE, FIELD_OF_VIEW_DEG, CAMERA_HEIGHT_M, DISTANCE_M)
    print(f"memo {memo.__version__} on {options.threads} thread(s), numpy {np.__version__}; ms a frame\n")
    print("All postures of one frame, physical constraints as printed (medians)")
    compare_frames(camera, options.rounds)
    agree_anywhere(400)
    print(f"\nA sequence of {options.frames} frames at 60 Hz, noise 1 px")
    time_sequences(camera, options.frames)


if __name__ == "__main__":
    main()
