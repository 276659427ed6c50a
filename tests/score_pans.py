"""Scores walkers whom a camera follows that turns in its place.

    python tests/score_pans.py [--people 20]

The scenes are those of `panned.py`: people of `memo.demo_scene` before a textured wall, frames of 360
columns of which the person walks through two and more. Each is tracked with the camera and the height,
with the height alone (`assumed`), and with the camera in the first view only, as before pictures could
be larger. Printed are the share of frames with a place, root mean squares of the place in centimetres
along, across and up, of hip and knee in degrees, and of the horizontal field of view that the pan shows
its error and its standard deviation.
"""

from __future__ import annotations

import argparse

import memo
import numpy as np
from panned import Panned, panned_scene

FPS = 25.0
FIGURES = ("cover", "along", "across", "up", "hip", "knee")


def scored(panned: Panned, **given) -> list[float]:
    """The figures of one way to track."""
    truth = panned.scene.truth
    columns = memo.track(panned.frames, fps=FPS, height_m=panned.scene.height_m, **given).columns
    own = np.isin(columns["frame"], truth["frame"])
    rows = np.searchsorted(truth["frame"], columns["frame"][own])
    if not len(rows):
        return [0.0, *[float("nan")] * 5]
    off = {name: columns[name][own] - truth[name][rows] for name in ("x_m", "y_m", "z_m")}
    # The world of an assumed camera is another one.
    scale = 100 if "camera" in given else float("nan")
    rms = [scale * float(np.sqrt(np.mean(off[f"{axis}_m"] ** 2))) for axis in "xyz"]
    for joint in ("hip", "knee"):
        both = [
            columns[f"{side}_{joint}_deg"][own] - truth[f"{side}_{joint}_deg"][rows]
            for side in ("right", "left")
        ]
        rms.append(float(np.sqrt(np.nanmean(np.square(both)))))
    return [len(np.unique(rows)) / len(truth["frame"]), *rms]


def _told(values, worst) -> str:
    """The median and the worst of what was measured."""
    known = values[np.isfinite(values)]
    return f"{np.median(known):.2f} ({worst(known):.2f})" if len(known) else "-"


def main() -> None:
    """Prints a row per person and way, then the medians and the worst of each way."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--people", type=int, default=20, metavar="N", help="seeds 0 to N - 1")
    people = range(parser.parse_args().people)
    print(f"{'person':>6}  {'':>10}  " + "  ".join(f"{name:>6}" for name in FIGURES))
    ways: dict[str, list[list[float]]] = {"camera": [], "assumed": [], "first view": []}
    fields = []
    for seed in people:
        panned = panned_scene(seed)
        given = {
            "camera": {"camera": panned.camera},
            "assumed": {},
            "first view": {"camera": panned.camera, "reach_px": (0, 0, 0, 0)},
        }
        for way, figures in ways.items():
            figures.append(scored(panned, **given[way]))
            print(
                f"{seed:>6}  {way:>10}  " + "  ".join(f"{figure:6.2f}" for figure in figures[-1]), flush=True
            )
        found = memo.field_of_view(panned.frames)
        if found is not None:
            fields.append([found.horizontal_deg - panned.field_of_view_deg, found.sd_deg])
    for way, figures in ways.items():
        of_each = dict(zip(FIGURES, np.array(figures).T, strict=True))
        said = (_told(values, min if name == "cover" else max) for name, values in of_each.items())
        print(f"{'median':>6}  {way:>10}  " + "  ".join(said))
    off, sd = np.array(fields).T
    print(
        f"field of view: {len(fields)} of {len(people)} found, RMS error {np.sqrt(np.mean(off**2)):.2f}°, "
        f"worst {np.abs(off).max():.2f}°, standard deviation {np.median(sd):.2f}°, within 1.64 of it: "
        f"{np.mean(np.abs(off) < 1.64 * sd):.0%}"
    )


if __name__ == "__main__":
    main()
