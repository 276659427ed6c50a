"""Finds limbs in displays of motion-captured people through `memo.planar` and counts what is right.

    python tests/score_links.py [--noise 0,1,2] [--out NOW.pickle]

Up to 2.4 s of a recording at 50 to 75 Hz are seen in parallel projection at 200 px per metre, from the side
and turned out of it, with independent noise in every coordinate and windows of the default length. Displays:

* `walker`: the joints; shown are all twelve, or fewer, or with the head and a joint of another recording, or
  with the toes, heels, neck and head that the recording has;
* `scattered`: each joint's motion relative to the pelvis, put at a random place in the walker's area, or in
  half of it;
* `mixed`: at each joint's place that joint of a random recording of the same group, at a random instant.

Tuned and unseen people of walks and hard walks (crouched, stiff, limping, brisk; altered recordings) as in
`score_postures.py`. The factors of the evidence and its limits were chosen on the tuned people and on memo's
own walker (`drawn`), whose trunk is rigid. Three of the four unseen recordings are of one person, so their
mixed displays are less mixed.

Printed: of the limb links of all windows, before any verdict, recall and precision by the angle from the
side; the share of windows that are interpreted, by angle; the same of scattered and mixed displays, which are
false; of other motions the share interpreted and how many of their limb links are right. Links inside the
trunk count neither way.

Cannot do: perspective, and dots that are no joints other than these.
"""

from __future__ import annotations

import argparse
import itertools
import pickle
import sys
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import memo
import numpy as np
from conftest import SHARED_DATA
from score_postures import HARD, OTHER, WALKS

JOINTS = ("RSH", "REL", "RWR", "LSH", "LEL", "LWR", "RHP", "RKN", "RAN", "LHP", "LKN", "LAN")
#: Further points of some recordings, after the joints; then the two points that are added.
FURTHER = ("RTO", "LTO", "NEC", "HED", "RHEE", "LHEE", "C7")
HEAD, STRAY = 19, 20
LIMBS = frozenset(frozenset((first, first + 1)) for first in (0, 1, 3, 4, 6, 7, 9, 10))
TRUNK = frozenset((0, 3, 6, 9, 14, 15, 18, HEAD))
FEET = (frozenset((8, 12, 16)), frozenset((11, 13, 17)))
GROUPS = {
    "tuned": WALKS["tuning"] + HARD["tuning"],
    "unseen": WALKS["others"] + HARD["others"],
    "other 01, 03": OTHER["01, 03"],
    "other 02": OTHER["02"],
    "drawn": tuple(f"drawn {speed}" for speed in (0.6, 0.9, 1.2, 1.6)),
}
ANGLES_DEG = (0, 15, 30, 45, 60, 75, -45, -75)
PX_PER_M, RATE_HZ, SECONDS = 200.0, 60.0, 2.4
#: Links longer than this share of the size are counted as long.
LONG = 1.2
LEGS = (6, 7, 8, 9, 10, 11)
SHOWN: dict[str, tuple[int, ...]] = {"all": tuple(range(12)), "legs, an arm": (0, 1, 2, *LEGS), "legs": LEGS}


class Display(NamedTuple):
    """One call."""

    kind: str
    shown: str
    group: str
    name: str
    angle_deg: int
    noise_px: float


class Window(NamedTuple):
    """What one window of a call holds: right, found and true limb links, and the verdict.

    Links within a foot are found and right, but need not be found.
    """

    display: Display
    right: int
    found: int
    recalled: int
    true: int
    interpreted: bool
    features: dict[str, float]


def recording(name: str) -> tuple[float, np.ndarray]:
    """Frame rate, and joints and further points (T, 19, 3), metres, NaN for those that it does not have.

    `drawn` walkers are memo's own, with a rigid trunk.
    """
    if name.startswith("drawn"):
        speed_mps = float(name.split()[1])
        walk = memo.walker_motion(240, rate_hz=RATE_HZ, speed_mps=speed_mps)
        joints = walk.positions[:, [walk.names.index(joint) for joint in JOINTS]]
        return RATE_HZ, np.concatenate([joints, np.full((len(joints), len(FURTHER), 3), np.nan)], axis=1)
    path = SHARED_DATA / "mocap" / "joints" / f"{name}.csv"
    with path.open(encoding="utf-8") as lines:
        rate_hz = float(lines.readline().split(",")[2].split()[0])
        heads = lines.readline().strip().split(",")
    rows = np.loadtxt(path, delimiter=",", skiprows=2)
    every = max(1, round(rate_hz / RATE_HZ))
    joints = np.full((len(rows[::every]), len(JOINTS) + len(FURTHER), 3), np.nan)
    for k, joint in enumerate((*JOINTS, *FURTHER)):
        if f"{joint}_x" in heads:
            joints[:, k] = rows[::every][:, [heads.index(f"{joint}_{axis}") for axis in "xyz"]]
    return rate_hz / every, joints


def seen(joints: np.ndarray, angle_deg: float) -> np.ndarray:
    """(T, K, 2) pixels of points (T, K, 3), turned out of the side view."""
    way = (joints[-1, [6, 9]] - joints[0, [6, 9]]).mean(axis=0) * (1, 1, 0)
    if np.linalg.norm(way) < 0.5:
        left = (joints[:, 3] - joints[:, 0]).mean(axis=0)
        way = np.array([left[1], -left[0], 0.0])
    way /= np.linalg.norm(way)
    angle = np.radians(angle_deg)
    right = np.cos(angle) * way + np.sin(angle) * np.array([-way[1], way[0], 0.0])
    return PX_PER_M * np.stack([joints @ right, -joints[..., 2]], axis=-1)


def about_pelvis(points_px: np.ndarray) -> np.ndarray:
    """Points relative to the middle of the hips."""
    return points_px - points_px[:, [6, 9]].mean(axis=1, keepdims=True)


def tracks(
    display: Display, recordings: dict[str, tuple[float, np.ndarray]]
) -> tuple[np.ndarray, list[int], float]:
    """(T, K, 2) pixels of a display, which joints they are (`HEAD`, `STRAY`: none), and the frame rate."""
    random = np.random.default_rng(zlib.crc32(repr(display).encode()))
    rate_hz, joints = recordings[display.name]
    frames = min(len(joints), int(SECONDS * rate_hz))
    first = random.integers(0, len(joints) - frames + 1)
    points = seen(joints[first : first + frames], display.angle_deg)
    pelvis = points[:, [6, 9]].mean(axis=1, keepdims=True)

    def joint_of_another(joint: int) -> np.ndarray:
        other = about_pelvis(
            seen(recordings[str(random.choice(GROUPS[display.group]))][1], display.angle_deg)
        )[:, joint]
        there_and_back = np.concatenate([other, other[-2:0:-1]])
        return there_and_back[
            (random.integers(len(there_and_back)) + np.arange(frames)) % len(there_and_back)
        ]

    if display.kind == "scattered":
        own = about_pelvis(points)
        middle = own.mean(axis=0)
        low, high = (
            np.minimum(np.nanmin(middle, axis=0), (-60, np.inf)),
            np.maximum(np.nanmax(middle, axis=0), (60, -np.inf)),
        )
        points = pelvis + own - middle + random.choice([0.5, 1.0]) * random.uniform(low, high, middle.shape)
    elif display.kind == "mixed":
        points = pelvis + np.stack([joint_of_another(joint) for joint in range(points.shape[1])], axis=1)
    which = list(SHOWN.get(display.shown, range(12)))
    if display.shown == "as recorded":
        which = [joint for joint in range(points.shape[1]) if np.isfinite(points[:, joint]).any()]
    if display.shown == "one missing":
        which.remove(int(random.integers(12)))
    points = points[:, which]
    if display.shown == "two more":
        up = points[:, [0, 3]].mean(axis=1) - pelvis[:, 0]
        head = pelvis[:, 0] + up + 50 * up / np.linalg.norm(up, axis=1, keepdims=True)
        stray = joint_of_another(int(random.choice([1, 2, 4, 5, 7, 8, 10, 11])))
        stray = pelvis[:, 0] + stray - stray.mean(axis=0) + random.uniform((-70, -140), (70, 140))
        points, which = np.concatenate([points, head[:, None], stray[:, None]], axis=1), [*which, HEAD, STRAY]
    return points + random.normal(0.0, display.noise_px, points.shape), which, rate_hz


def windows(display: Display, recordings: dict[str, tuple[float, np.ndarray]]) -> list[Window]:
    """Calls memo and counts."""
    points, which, rate_hz = tracks(display, recordings)
    noise_px = max(display.noise_px, 0.01)
    figure = memo.planar(points, np.arange(len(points)) / rate_hz, noise_px)
    true = {limb for limb in LIMBS if limb <= set(which)}
    counted = []
    for window in figure.windows:
        links = {frozenset(which[k] for k in link.points) for chain in window.chains for link in chain.links}
        limbs = {link for link in links if not link <= TRUNK}
        counted.append(
            Window(
                display,
                right=len(limbs & true) + sum(any(link <= foot for foot in FEET) for link in limbs),
                found=len(limbs),
                recalled=len(limbs & true),
                true=len(true),
                interpreted=window.status == "interpreted",
                features=features(window, noise_px, len(which)),
            )
        )
    return counted


def features(window: Any, noise_px: float, points: int) -> dict[str, float]:
    """The sums of which the evidence of a figure is made, in the order of its factors."""
    residuals = [np.sqrt(max(0.0, chain.residual**2 - 2 * noise_px**2)) for chain in window.chains]
    groups = len(window.chains) + len(window.alone)
    return {
        "points": points,
        "noise": points * noise_px / window.size,
        "residuals": sum(residuals) / window.size,
        "long": sum(max(0.0, link.length / window.size - LONG) for c in window.chains for link in c.links),
        "statistics": sum(
            3.0 if chain.verdict == "edge-on" else min(np.log1p(chain.statistic), 3.0)
            for chain in window.chains
        ),
        "planes": apart(window.chains),
        "loose": max(groups - 1 - len(window.joints), 0),
        "rods": sum(len(chain.links) == 1 for chain in window.chains),
        "alone": len(window.alone),
        "confidences": sum(np.log(max(link.confidence, 0.02)) for c in window.chains for link in c.links),
        "evidence": np.nan if window.evidence_nats is None else window.evidence_nats,
    }


def apart(chains: Sequence[Any]) -> float:
    """How far the planes of chains are from their median, which their signs do not change."""
    p, q = np.array([chain.slope for chain in chains]).reshape(-1, 2).T
    planes = np.stack([p * p, q * q, np.sqrt(2) * p * q], axis=1) / (1 + p * p + q * q)[:, None]
    return float(np.linalg.norm(planes - np.median(planes, axis=0), axis=1).sum()) if len(chains) else 0.0


def displays(noises_px: Sequence[float]) -> list[Display]:
    """All calls."""
    return [
        Display(kind, shown, group, name, angle_deg, noise_px)
        for group, names in GROUPS.items()
        for name in names
        for angle_deg in ANGLES_DEG
        for noise_px in noises_px
        for kind in ("walker", "scattered", "mixed")
        for shown in ("all", "as recorded", "one missing", "two more", "legs, an arm", "legs")
        if (shown in ("all", "as recorded") or not group.startswith("other"))
        and (group != "drawn" or (kind != "mixed" and shown != "as recorded"))
    ]


def report(counted: Sequence[Window]) -> str:
    """The tables."""
    noises_px = sorted({window.display.noise_px for window in counted})

    def select(**wanted: Any) -> list[Window]:
        def fits(window: Window) -> bool:
            return all(getattr(window.display, name) == value for name, value in wanted.items())

        return [window for window in counted if fits(window)]

    def share(chosen: Sequence[Window], value: Callable[[Window], float]) -> str:
        return f"{np.mean([value(window) for window in chosen]):6.3f}" if chosen else "     -"

    def interpreted(window: Window) -> float:
        return float(window.interpreted)

    def links(chosen: Sequence[Window]) -> str:
        right, found = (sum(getattr(w, name) for w in chosen) for name in ("right", "found"))
        recalled, true = (sum(getattr(w, name) for w in chosen) for name in ("recalled", "true"))
        return f"{recalled / max(true, 1):.3f}/{right / max(found, 1):.3f}"

    lines = ["Limb links of all windows, recall/precision, by the angle from the side"]
    angles = sorted({abs(angle) for angle in ANGLES_DEG})
    lines.append(f"{'':28}" + "".join(f"{angle:>14}" for angle in angles))
    walkers = ("tuned", "unseen", "drawn")
    names = {group: [(group, None)] for group in walkers} | {
        "unseen but Gait": [("unseen", name) for name in GROUPS["unseen"] if "Gait" not in name]
    }
    for label, parts in names.items():
        for noise_px in noises_px:
            cells = []
            for angle in angles:
                chosen = [
                    window
                    for group, name in parts
                    for window in select(kind="walker", shown="all", group=group, noise_px=noise_px)
                    if abs(window.display.angle_deg) == angle and name in (None, window.display.name)
                ]
                cells.append(f"{links(chosen):>14}")
            lines.append(f"{label:18}{noise_px:6.0f} px   " + "".join(cells))
    lines.append("")
    lines.append("Windows interpreted: walkers at 0-30 deg, walkers at 45-75 deg, scattered, mixed")
    for shown in dict.fromkeys(window.display.shown for window in counted):
        for group in walkers:
            for noise_px in noises_px:
                chosen = select(shown=shown, group=group, noise_px=noise_px)
                own = [window for window in chosen if window.display.kind == "walker"]
                lines.append(
                    f"{shown:14}{group:8}{noise_px:4.0f} px  "
                    + share([w for w in own if abs(w.display.angle_deg) < 45], interpreted)
                    + share([w for w in own if abs(w.display.angle_deg) >= 45], interpreted)
                    + share([w for w in chosen if w.display.kind == "scattered"], interpreted)
                    + share([w for w in chosen if w.display.kind == "mixed"], interpreted)
                )
    lines.append("")
    lines.append("Other motions: windows interpreted, limb links recall/precision in these; false displays")
    for group in GROUPS:
        if group in walkers:
            continue
        for shown, noise_px in itertools.product(("all", "as recorded"), noises_px):
            chosen = select(shown=shown, group=group, noise_px=noise_px)
            own = [window for window in chosen if window.display.kind == "walker"]
            false = [window for window in chosen if window.display.kind != "walker"]
            read = [window for window in own if window.interpreted]
            cells = f"{share(own, interpreted)}  {links(read)} {share(false, interpreted)}"
            lines.append(f"{shown:14}{group:14}{noise_px:4.0f} px  {cells}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--noise", default="0,1,2", help="noises, px, by commas")
    parser.add_argument("--out", type=Path, help="file for the counts of all windows")
    chosen = parser.parse_args(arguments)
    recordings = {name: recording(name) for names in GROUPS.values() for name in names}
    wanted = displays([float(noise) for noise in chosen.noise.split(",")])
    counted: list[Window] = []
    for done, display in enumerate(wanted, start=1):
        counted += windows(display, recordings)
        if done % 200 == 0 or done == len(wanted):
            print(f"{done} of {len(wanted)}", file=sys.stderr, flush=True)
    if chosen.out:
        chosen.out.write_bytes(pickle.dumps([tuple(window) for window in counted]))
    print(report(counted))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
