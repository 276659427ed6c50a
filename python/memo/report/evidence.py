"""What is visible around the walker in one frame, small enough for a page."""

from __future__ import annotations

from typing import Any

import numpy as np

from memo.explain import Why
from memo.pixels import of_averaged
from memo.report.page import columns
from memo.report.pictures import LONGEST_PX, jpeg_uri, mask_uri, packed

__all__ = ["CHANGED", "evidence"]

CHANGED = (0, 158, 115)  # from the palette of Okabe and Ito, like the colours of the sides
_EDGE = (240, 228, 66)
_CROP_MARGIN = 0.25


def evidence(why: Why) -> dict[str, Any]:
    """What is visible around the walker in one frame; pixels count from the corner of the part shown.

    Masks have one pixel per pixel of the picture that was tracked.
    """
    n = why.shrink
    left, top, right, bottom = _around(why)
    corner = np.array([left, top], np.float64)
    part, seen = np.s_[top:bottom, left:right], np.s_[top:bottom:n, left:right:n]
    edges = np.zeros(why.luma.shape, bool)[::n, ::n]
    places = np.round(of_averaged(why.edge_points, n)).astype(int)
    inside = places[((places >= 0) & (places < edges.shape[::-1])).all(axis=1)]
    edges[inside[:, 1], inside[:, 0]] = True

    def lines(segments: Any, clipped: bool = False) -> str:
        segments = np.asarray(segments, np.float64).reshape(-1, 2, 2)
        if clipped:
            near = (segments.max(axis=1) >= corner) & (segments.min(axis=1) <= (right, bottom))
            segments = segments[near.all(axis=1)]
        return packed(segments - corner, n)

    return {
        "frame": int(why.frame),
        "walk": int(why.walk),
        "corner": [left, top],
        "size": [right - left, bottom - top],
        "step_px": n / 16,
        "luma": jpeg_uri(why.luma[part], LONGEST_PX),
        "change": mask_uri(why.change_mask[seen], CHANGED),
        "edges": mask_uri(edges[top // n : bottom // n, left // n : right // n], _EDGE),
        "segments": lines(why.segments, clipped=True),
        "model": lines(why.model),
        "part": [int(number) for number in why.model_part],
        "matched": columns(why.matched, 2),
        "matched_edges": lines(why.matched_edges),
        "phase_grid": columns(why.phase_grid, 3),
        "similarity": columns(why.similarity, 4),
        "phase": columns(why.phase, 4),
    }


def _around(why: Why) -> tuple[int, int, int, int]:
    """Left, top, right, bottom of the part of the frame with the model and a margin; without a model, all.

    They are multiples of `why.shrink`.
    """
    n = why.shrink
    height, width = (side // n * n for side in why.luma.shape)
    points = np.asarray(why.model, np.float64).reshape(-1, 2)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return 0, 0, width, height
    (left, top), (right, bottom) = points.min(axis=0), points.max(axis=0)
    margin = _CROP_MARGIN * max(right - left, bottom - top)
    left, top = (max(0, int((low - margin) / n) * n) for low in (left, top))
    right, bottom = (
        min(side, (int((high + margin) / n) + 1) * n) for high, side in ((right, width), (bottom, height))
    )
    return (left, top, right, bottom) if left < right and top < bottom else (0, 0, width, height)
