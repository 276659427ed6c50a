"""Scores people in clothes who turn.

    python tests/score_turning.py [--turns 40 69 110 -150] [--people 18]

The scenes are `memo.demo_scene`s of 90 frames, with the camera and the height. Of each turn: how many people
have one number; then, as median over people and worst, the share of frames with a place, root mean squares of
the place along and across the way in centimetres, median and 95th percentile of the error of the heading in
degrees, and median error of the phase modulo half a cycle.

Cannot do: joint angles; turns around a corner.
"""

from __future__ import annotations

import argparse

import memo
import numpy as np

FPS = 25.0
FIGURES = ("cover", "along", "across", "heading", "95 %", "phase")


def scored(seed: int, turn_deg: float) -> tuple[list[float], int]:
    """The figures of one person, and how many numbers it has."""
    scene = memo.demo_scene(seed, frames=90, turn_deg=turn_deg)
    walks = memo.track(list(scene.frames), fps=FPS, camera=scene.camera, height_m=scene.height_m).walks
    truth = {name: np.asarray(scene.truth[name]) for name in ("frame", "x_m", "y_m", "heading_rad", "phase")}
    row_of = {int(frame): row for row, frame in enumerate(truth["frame"])}
    offs = []
    for walk in walks:
        columns = walk.columns
        rows = [(k, row_of[int(frame)]) for k, frame in enumerate(columns["frame"]) if int(frame) in row_of]
        for k, row in rows:
            x, y = (columns[name][k] - truth[name][row] for name in ("x_m", "y_m"))
            cos, sin = np.cos(truth["heading_rad"][row]), np.sin(truth["heading_rad"][row])
            turned = np.angle(np.exp(1j * (columns["heading_rad"][k] - truth["heading_rad"][row])))
            cycles = 2 * (columns["phase"][k] - truth["phase"][row])
            offs.append([x * cos + y * sin, y * cos - x * sin, abs(turned), abs(cycles - round(cycles)) / 2])
    if not offs:
        return [0.0, *[float("nan")] * 5], 0
    along, across, turned, phase = np.array(offs).T
    metres = [100 * float(np.sqrt(np.mean(off**2))) for off in (along, across)]
    heading = [float(np.degrees(np.quantile(turned, share))) for share in (0.5, 0.95)]
    figures = [len(offs) / len(row_of), *metres, *heading, float(np.median(phase))]
    return figures, len({walk.person for walk in walks})


def main() -> None:
    """Prints a row per turn."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--turns", type=float, nargs="+", default=[40, 69, 110, -150], metavar="DEG")
    parser.add_argument("--people", type=int, default=18, metavar="N", help="seeds 1 to N")
    options = parser.parse_args()
    print(f"{'turn':>6}  {'one number':>10}  " + "  ".join(f"{name:>13}" for name in FIGURES))
    for turn_deg in options.turns:
        people = [scored(seed, turn_deg) for seed in range(1, options.people + 1)]
        figures = np.array([figures for figures, _ in people])
        worst = np.nanmin(figures, 0), np.nanmax(figures, 0)
        cells = []
        for k, name in enumerate(FIGURES):
            digits = 3 if name == "phase" else 2 if name == "cover" else 1
            bad = worst[0][k] if name == "cover" else worst[1][k]
            cells.append(f"{np.nanmedian(figures[:, k]):.{digits}f} ({bad:.{digits}f})")
        ones = f"{sum(count == 1 for _, count in people)} of {len(people)}"
        print(f"{turn_deg:6g}  {ones:>10}  " + "  ".join(f"{cell:>13}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
