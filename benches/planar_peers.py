"""What planar closed forms and fits cost beside the same in numpy and scipy, in the same process.

    pip install scipy
    python benches/planar_peers.py [--problems 1000000]

Each round runs memo, then its peer; a ratio is the median over rounds of (peer's time / memo's time), so that
load on the machine falls on both. The numpy closed forms are Horn's ellipse, vectorised over all problems, on
the same arrays; the fit is scipy's least squares on the same residuals from three starts, a triple at a time.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import memo
import numpy as np
from scipy.optimize import least_squares

ROUNDS = 7


def slopes(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Slopes of planes in which |a| = |b| and |c| = |d|, rows of (p, q)."""

    def powers(a: Any, b: Any) -> Any:
        m, s = a - b, a + b
        return m[:, 0] * s[:, 0], m[:, 0] * s[:, 1] + s[:, 0] * m[:, 1], m[:, 1] * s[:, 1]

    (u0, u1, u2), (v0, v1, v2) = powers(a, b), powers(c, d)
    form_a, form_b, form_c = u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0
    sign = np.copysign(0.5, form_a + form_c)
    mean, half, cross = sign * (form_a + form_c), sign * (form_a - form_c), 2 * sign * form_b
    spread = np.sqrt(half * half + cross * cross)
    along = spread + np.abs(half)
    scale = 1 / np.sqrt((mean - spread) * along)
    large, small = along * scale, cross * scale
    return np.where(half >= 0, large, small), np.where(half >= 0, small, large)


def numpy_rods(views: Any) -> Any:
    p, q = slopes(views[:, 0], views[:, 1], views[:, 0], views[:, 2])
    return p[:, None] * views[..., 0] + q[:, None] * views[..., 1]


def numpy_hinges(views: Any) -> Any:
    p, q = slopes(views[:, 0], views[:, 1], views[:, 2], views[:, 3])
    return p[:, None] * views[..., 0] + q[:, None] * views[..., 1]


def scipy_hinge(first: Any, pivot: Any, second: Any) -> Any:
    ends = [first - pivot, second - pivot]

    def residuals(x: Any) -> Any:
        g, parts = x[:2], []
        for d, c in zip(ends, x[2:], strict=True):
            z = d @ g
            gradient = np.hypot(d[:, 0] + z * g[0], d[:, 1] + z * g[1])
            parts.append(((d**2).sum(axis=1) + z**2 - c) / (2 * gradient + 1e-12))
        return np.concatenate(parts)

    starts = [[1.0, 0.0], [-0.5, 0.87], [-0.5, -0.87]]
    lengths = [(d**2).sum(axis=1).max() for d in ends]
    fits = [least_squares(residuals, [*start, *lengths], method="lm") for start in starts]
    return min(fits, key=lambda fit: fit.cost)


def compare(what: str, views: Any, ours: Callable[[Any], object], peer: Callable[[Any], object]) -> None:
    times: list[tuple[float, float]] = []
    for _ in range(ROUNDS):
        marks = [time.perf_counter()]
        for work in (ours, peer):
            work(views)
            marks.append(time.perf_counter())
        times.append((marks[1] - marks[0], marks[2] - marks[1]))
    own, other = (min(t[i] for t in times) / len(views) * 1e9 for i in (0, 1))
    ratio = statistics.median(b / a for a, b in times)
    print(f"{what:44}{own:12.1f} ns{other:12.1f} ns{ratio:10.1f}")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--problems", type=int, default=1_000_000)
    count = parser.parse_args().problems
    random = np.random.default_rng(1)
    print(f"{'one problem (best of rounds)':44}{'memo':>15}{'peer':>15}{'peer/memo':>10}")
    for name, shape, ours, peer in (
        ("rod, three views, numpy", 3, memo.planar_rods, numpy_rods),
        ("hinge, two views, numpy", 4, memo.planar_hinges, numpy_hinges),
    ):
        views = random.normal(size=(count, shape, 2))
        with np.errstate(invalid="ignore", divide="ignore"):
            assert np.allclose(ours(views), peer(views), rtol=1e-6, atol=1e-6, equal_nan=True)
            compare(f"{name}, {count} at once", views, ours, peer)
    walk = memo.walker_motion(120)
    shown = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30, noise_sd_px=1.0)
    tracks, times_s = shown.positions_px[:, :12], shown.times_s
    triples = [(a, o, b) for o in range(12) for a in range(12) for b in range(a + 1, 12) if o not in (a, b)]
    sample = triples[:: len(triples) // 40]

    def fit_sample() -> None:
        for a, o, b in sample:
            scipy_hinge(tracks[:, a], tracks[:, o], tracks[:, b])

    # memo: all triples, pairs and the cover; scipy: the triples alone, from a sample of them.
    own, other = [], []
    for _ in range(3):
        start = time.perf_counter()
        memo.planar(tracks, times_s, 1.0, window_s=100.0)
        middle = time.perf_counter()
        fit_sample()
        own.append((middle - start) / len(triples))
        other.append((time.perf_counter() - middle) / len(sample))
    ratio = statistics.median(b / a for a, b in zip(own, other, strict=True))
    print(f"{'triple, 120 views, scipy':44}{min(own) * 1e9:12.0f} ns{min(other) * 1e9:12.0f} ns{ratio:10.1f}")


if __name__ == "__main__":
    main()
