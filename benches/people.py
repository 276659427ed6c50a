"""How many frames a second memo tracks, by the number of people.

python benches/people.py SCENES [SCENE ...] [--rounds 5]

SCENES has a folder per scene with `video.mp4` and `camera.toml`; without names, one, two and three
people are tracked (`diagonal`, `cross2`, `three`). Videos are decoded before. Each round tracks every
scene with the fits of the persons and without (`adapt=False`), so that load on the machine falls on all.
The fastest round and the median are printed.
"""

from __future__ import annotations

import argparse
import statistics
import time
from pathlib import Path
from typing import Any

import memo
from memo.video import VideoReader

SCENES = ("diagonal", "cross2", "three")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    clips = {name: _read(given.folder / name) for name in given.scenes}
    ways = {"with fits": True, "without": False}
    rates: dict[tuple[str, str], list[float]] = {}
    people: dict[str, int] = {}
    for _ in range(given.rounds):
        for name, (camera, frames) in clips.items():
            for way, adapt in ways.items():
                tracker = memo.Tracker(camera=camera, adapt=adapt)
                began_s = time.perf_counter()
                for luma, time_s in frames:
                    tracker.update(luma, time_s)
                track = tracker.finish()
                lasted_s = time.perf_counter() - began_s
                rates.setdefault((name, way), []).append(len(frames) / lasted_s)
                people[name] = len(track.people)
    print("scene      people   frames per second with fits: best (median)   without")
    for name in clips:
        fits, alone = (rates[name, way] for way in ways)
        columns = [f"{max(r):5.0f} ({statistics.median(r):.0f})" for r in (fits, alone)]
        print(f"{name:12} {people[name]:3}   {columns[0]:>42}   {columns[1]:>13}")


def _read(folder: Path) -> tuple[memo.Camera, list[tuple[Any, float]]]:
    camera = memo.Camera.from_toml(folder / "camera.toml")
    with VideoReader(folder / "video.mp4") as video:
        return camera, [(frame.luma.copy(), frame.time_s) for frame in video]


if __name__ == "__main__":
    main()
