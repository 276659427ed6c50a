"""Scores memo in street scenes with several people beside two trackers of boxes.

    python tests/score_crowds.py [--only PATTERN] [--runs FOLDER]

The clips are TUD-Stadtmitte (10 people, a camera at eye height) and PETS 2009 S2.L1 view 1 (people 50 to
150 px tall, seen from 7 m above, 7 frames per second) of the recordings (`conftest.SHARED_DATA`), with the
people's boxes. memo's boxes are those of the model's visible contours, as `memo convert` writes them. The two
others follow the regions that change against the temporal median (`silhouettes`, `moving_regions`):

* `kalman`: a Kalman filter of constant velocity per box, boxes assigned by the Hungarian method on their
  overlap (Bewley et al. 2016, SORT: overlap 0.3, told from the third box on, ended after 10 frames without);
* `blobs`: each region goes on with the nearest centre of the frame before, within half of its height.

MOTA, IDF1, identity switches, recall and precision are motmetrics', with an overlap of at least a half. Then,
of every walk of memo of 20 frames and more, the share of frames with such an overlap, and in TUD-Stadtmitte
the heel strikes of people in side view against those marked by eye (`annotated/stadtmitte_strikes.csv`).

Cannot do: where people are in depth; gait.
"""

from __future__ import annotations

import argparse
import csv
import re
import sys
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import memo
import motmetrics
import numpy as np
from conftest import SHARED_DATA, ran
from memo.formats.motchallenge import write_motchallenge
from memo.video import VideoReader
from scipy.optimize import linear_sum_assignment

#: Options of `memo track` by clip.
CLIPS: dict[str, tuple[str, ...]] = {
    "tud_stadtmitte": ("--fov-deg", "15.2"),
    "pets09_s2l1": ("--camera", "View_001.xml", "--camera-size", "768x576"),
}
OVERLAP = 0.5
#: A heel strike is that of memo within so many frames: a quarter of a second, half a step.
REACH_FRAMES = 6.25
LEAST_REGION_PX = 20
#: Heel strikes marked by eye, by clip.
STRIKES = {"tud_stadtmitte": Path(__file__).parent / "annotated" / "stadtmitte_strikes.csv"}

Array = np.ndarray
#: Frame from 1, identity, and left, top, width, height in pixels.
Rows = list[tuple[int, int, Array]]


def regions_of(frames: Sequence[Array]) -> list[Array]:
    """(n, 4) boxes of what changes in each frame."""
    found = []
    for mask in memo._memo.silhouettes(frames):
        left, top, right, bottom, _ = memo._memo.moving_regions(mask).T
        boxes = np.stack([left, top, right - left + 1, bottom - top + 1], axis=1)
        found.append(boxes[boxes[:, 3] >= LEAST_REGION_PX])
    return found


def overlaps(a: Array, b: Array) -> Array:
    """(n, m) intersections over unions of boxes."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    shared = np.clip(high - low, 0, None).prod(axis=2)
    return shared / (a[:, 2:].prod(axis=1)[:, None] + b[:, 2:].prod(axis=1)[None] - shared)


class Box:
    """The Kalman filter of one box: centre, area and aspect, and the velocities of the first three (SORT)."""

    step = np.eye(7) + np.eye(7, k=4)
    seen = np.eye(4, 7)
    process = np.diag([1, 1, 1, 1, 0.01, 0.01, 0.0001])
    noise = np.diag([1.0, 1, 10, 10])

    def __init__(self, identity: int, box: Array) -> None:
        self.identity, self.hits, self.missed = identity, 1, 0
        self.state = np.append(self.measured(box), np.zeros(3))
        self.covariance = np.diag([10.0, 10, 10, 10, 1e4, 1e4, 1e4])

    @staticmethod
    def measured(box: Array) -> Array:
        left, top, width, height = box
        return np.array([left + width / 2, top + height / 2, width * height, width / height])

    def predicted(self) -> Array:
        self.state = self.step @ self.state
        self.covariance = self.step @ self.covariance @ self.step.T + self.process
        u, v, area, aspect = self.state[:4]
        width = np.sqrt(max(area, 1.0) * max(aspect, 0.01))
        height = max(area, 1.0) / width
        return np.array([u - width / 2, v - height / 2, width, height])

    def update(self, box: Array) -> None:
        innovation = self.seen @ self.covariance @ self.seen.T + self.noise
        gain = np.linalg.solve(innovation, self.seen @ self.covariance).T
        self.state = self.state + gain @ (self.measured(box) - self.seen @ self.state)
        self.covariance = self.covariance - gain @ self.seen @ self.covariance
        self.hits, self.missed = self.hits + 1, 0


def by_kalman(regions: Iterable[Array]) -> Rows:
    """Boxes assigned to predicted ones by their overlap."""
    rows: Rows = []
    alive: list[Box] = []
    count = 0
    for frame, boxes in enumerate(regions, 1):
        expected = np.array([box.predicted() for box in alive]).reshape(-1, 4)
        shared = overlaps(expected, boxes)
        pairs = [(i, j) for i, j in zip(*linear_sum_assignment(-shared), strict=True) if shared[i, j] >= 0.3]
        for box in alive:
            box.missed += 1
        for i, j in pairs:
            alive[i].update(boxes[j])
        for j in set(range(len(boxes))) - {j for _, j in pairs}:
            count += 1
            alive.append(Box(count, boxes[j]))
            pairs.append((len(alive) - 1, j))
        rows += [(frame, alive[i].identity, boxes[j]) for i, j in pairs if alive[i].hits >= 3 or frame <= 3]
        alive = [box for box in alive if box.missed <= 10]
    return rows


def by_nearest(regions: Iterable[Array]) -> Rows:
    """Boxes that go on with the nearest box of the frame before."""
    rows: Rows = []
    before: list[tuple[int, Array]] = []
    count = 0
    for frame, boxes in enumerate(regions, 1):
        free, now = list(before), []
        for box in boxes:
            apart = [
                np.linalg.norm((old + old[..., [2, 3, 0, 1]] / 2 - box - box[[2, 3, 0, 1]] / 2)[:2])
                for _, old in free
            ]
            if apart and min(apart) < box[3] / 2:
                identity = free.pop(int(np.argmin(apart)))[0]
            else:
                count += 1
                identity = count
            now.append((identity, box))
        rows += [(frame, identity, box) for identity, box in now]
        before = now
    return rows


def by_memo(clip: Path, options: Sequence[str], out: Path) -> Rows:
    """Boxes of the contours of a run, which is made where there is none."""
    if not (out / "track.csv").is_file():
        given = [str(clip / option) if (clip / option).is_file() else option for option in options]
        ran("track", clip / "video.mp4", *given, "--no-plots", "--quiet", "--out", out)
    write_motchallenge(out / "boxes.txt", out)
    rows = np.loadtxt(out / "boxes.txt", delimiter=",", ndmin=2)
    return [(int(row[0]), int(row[1]), row[2:6] - [1, 1, 0, 0]) for row in rows]


def true_rows(clip: Path) -> Rows:
    rows = np.loadtxt(clip / "gt.txt", delimiter=",")
    return [(int(row[0]), int(row[1]), row[2:6] - [1, 1, 0, 0]) for row in rows if row[6] != 0]


def scored(truth: Rows, found: Rows) -> dict[str, Any]:
    """motmetrics' figures."""
    accumulator = motmetrics.MOTAccumulator()
    for frame in sorted({row[0] for row in truth}):
        own, other = ([row for row in rows if row[0] == frame] for rows in (truth, found))
        boxes = [np.array([row[2] for row in rows]).reshape(-1, 4) for rows in (own, other)]
        distance = 1 - overlaps(*boxes)
        distance[distance > 1 - OVERLAP] = np.nan
        accumulator.update([row[1] for row in own], [row[1] for row in other], distance, frameid=frame)
    names = ["mota", "idf1", "num_switches", "recall", "precision", "num_objects"]
    summary = motmetrics.metrics.create().compute(accumulator, metrics=names, return_dataframe=False)
    return {"people": len({row[1] for row in found}), **summary}


def share_on_somebody(truth: Rows, found: Rows) -> dict[int, float]:
    """Of every walk of 20 frames and more, the share of frames with an overlap with anybody of a half."""
    at: dict[int, list[Array]] = {}
    for frame, _, box in truth:
        at.setdefault(frame, []).append(box)
    walks: dict[int, list[float]] = {}
    for frame, identity, box in found:
        boxes = np.array(at.get(frame, [])).reshape(-1, 4)
        walks.setdefault(identity, []).append(float(overlaps(box[None], boxes).max(initial=0)))
    return {k: float(np.mean(np.array(v) >= OVERLAP)) for k, v in walks.items() if len(v) >= 20}


@dataclass(frozen=True)
class Strike:
    """A heel strike, marked or found."""

    frame: float
    """From 0."""
    person: int
    """Of the boxes."""
    side: str


def marked_strikes(file: Path) -> list[Strike]:
    """Those marked by eye; who walks to the right has the right foot nearer to the camera."""
    with file.open() as lines:
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    near = {"right": ("right", "left"), "left": ("left", "right")}
    return [
        Strike(float(row["frame"]), int(row["id"]), near[row["walks"]][row["foot"] == "far"]) for row in rows
    ]


def strikes_of(run: Path) -> list[Strike]:
    """Those of a run; the boxes of MOTChallenge count people from 1."""
    with (run / "events.csv").open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["event"] == "heel_strike"]
    return [Strike(float(row["frame"]), int(row["person"]) + 1, row["side"]) for row in rows]


def strike_errors(
    marked: Sequence[Strike], found: Sequence[Strike], truth: Rows, rows: Rows
) -> tuple[int, list[tuple[float, bool]]]:
    """How many strikes are marked where memo is on the person, and of each one found the error in frames and
    whether its side is right."""

    def on(strike: Strike) -> set[int]:
        """Who of memo is on the person of a marked strike."""
        at = round(strike.frame) + 1
        boxes = [box for frame, identity, box in truth if (frame, identity) == (at, strike.person)]
        own = [(identity, box) for frame, identity, box in rows if frame == at]
        return {who for who, box in own for other in boxes if overlaps(box[None], other[None]) >= OVERLAP}

    seen, errors = 0, []
    for strike in marked:
        who = on(strike)
        seen += bool(who)
        near = [f for f in found if f.person in who and abs(f.frame - strike.frame) <= REACH_FRAMES]
        if near:
            best = min(near, key=lambda f: abs(f.frame - strike.frame))
            errors.append((best.frame - strike.frame, best.side == strike.side))
    return seen, errors


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="PATTERN", default="", help="clips whose name has this (regex)")
    parser.add_argument(
        "--runs", type=Path, metavar="FOLDER", help="keeps the runs of memo, or uses those there"
    )
    args = parser.parse_args()
    runs = args.runs or Path(tempfile.mkdtemp())
    print(f"{'clip':15} {'tracker':8} people   MOTA   IDF1 switches recall precision")
    for name, options in CLIPS.items():
        clip = SHARED_DATA / "video" / name
        if not re.search(args.only, name):
            continue
        if not clip.is_dir():
            print(f"{name:15} not there: {clip}", file=sys.stderr)
            continue
        with VideoReader(clip / "video.mp4") as video:
            frames = [np.array(frame.luma) for frame in video]
        truth, regions = true_rows(clip), regions_of(frames)
        began = time.perf_counter()
        of_memo = by_memo(clip, options, runs / name)
        took_s = time.perf_counter() - began
        for tracker, rows in (
            ("memo", of_memo),
            ("kalman", by_kalman(regions)),
            ("blobs", by_nearest(regions)),
        ):
            s = scored(truth, rows)
            print(
                f"{name:15} {tracker:8} {s['people']:6d} {s['mota']:6.2f} {s['idf1']:6.2f} "
                f"{s['num_switches']:8.0f} {s['recall']:6.2f} {s['precision']:9.2f}"
            )
        alone = ", ".join(
            f"{identity}: {share:.2f}" for identity, share in share_on_somebody(truth, of_memo).items()
        )
        print(f"{name:15} walks of memo on somebody: {alone or 'none'}; {took_s:.0f} s")
        if name in STRIKES:
            seen, errors = strike_errors(
                marked_strikes(STRIKES[name]), strikes_of(runs / name), truth, of_memo
            )
            print(
                f"{name:15} heel strikes found: {len(errors)} of {seen}, frames late: "
                f"{' '.join(f'{error:+.1f}' for error, _ in errors)}; "
                f"sides right: {sum(right for _, right in errors)} of {len(errors)}"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
