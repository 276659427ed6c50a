"""A slow reference of the similarity of model lines and grey-value edges (Rohr 1994, eqs. 7 and 11).

For a model line of length l_M and an edge cut to the window around it (length l_M, half width r = c_r l_M):

    s_i = l exp(-((l_M - l)^2 / (c_l l_M)^2 + d^2 / (c_d r)^2 + dphi^2 / sigma_phi^2) / 2)   (7)
    s   = (sum over i of the largest s_i of any edge) / (sum over i of l_M), all weights 1    (11)

l is the length of the cut edge projected onto the model line, d the distance of the cut edge's midpoint from
the line, dphi the angle between the two lines without direction. The paper leaves r open; a window of fixed
proportions keeps the measure independent of scale, as it demands of the exponent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Parameters:
    """The constants of eq. (7); the paper prints no values."""

    c_l: float = 1.0
    c_d: float = 0.5
    c_r: float = 0.25
    sigma_phi_rad: float = np.radians(12.0)


@dataclass(frozen=True)
class Match:
    """An edge cut to the window of a model line."""

    l_px: float
    d_px: float
    dphi_rad: float
    score: float


@dataclass(frozen=True)
class Similarity:
    """The outcome of eq. (11)."""

    total: float
    #: Per model line the index of its best edge, -1 when no edge scores.
    best_edges: list[int]
    #: Per model line the s_i of its best edge, pixels.
    scores: list[float]


def similarity(model_px: np.ndarray, edges_px: np.ndarray, parameters: Parameters) -> Similarity:
    """Eq. (11) for model lines (N, 2, 2) and edges (M, 2, 2), each two end points (u, v) in pixels."""
    best_edges, scores = [], []
    for line in model_px:
        matches = [match(line, edge, parameters) for edge in edges_px]
        line_scores = [found.score if found else 0.0 for found in matches]
        best = int(np.argmax(line_scores)) if line_scores else -1
        score = line_scores[best] if line_scores else 0.0
        best_edges.append(best if score > 0.0 else -1)
        scores.append(score)
    lengths = [float(np.linalg.norm(line[1] - line[0])) for line in model_px]
    total = sum(scores) / sum(lengths) if sum(lengths) > 0.0 else 0.0
    return Similarity(total, best_edges, scores)


def match(line_px: np.ndarray, edge_px: np.ndarray, p: Parameters) -> Match | None:
    """Eq. (7) for one model line and one edge; `None` when the edge misses the window."""
    along = line_px[1] - line_px[0]
    l_m = float(np.linalg.norm(along))
    if l_m == 0.0:
        return None
    axes = np.array([along, [-along[1], along[0]]]) / l_m
    edge = (edge_px - line_px[0]) @ axes.T  # x along the model line from its start, y across
    r = p.c_r * l_m
    cut = cut_to_window(edge, low=np.array([0.0, -r]), high=np.array([l_m, r]))
    if cut is None:
        return None
    length = abs(float(cut[1, 0] - cut[0, 0]))
    distance = abs(float(cut[:, 1].mean()))
    dx, dy = np.abs(edge[1] - edge[0])
    angle = float(np.arctan2(dy, dx))
    exponent = ((l_m - length) / (p.c_l * l_m)) ** 2 + (distance / (p.c_d * r)) ** 2
    exponent += (angle / p.sigma_phi_rad) ** 2
    return Match(length, distance, angle, length * float(np.exp(-exponent / 2.0)))


def cut_to_window(segment: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """The part of a segment (2, 2) inside a rectangle, cut by one side after the other; `None` outside."""
    for axis in (0, 1):
        for sign, bound in ((1.0, low[axis]), (-1.0, high[axis])):
            inside = sign * (segment[:, axis] - bound)  # >= 0 on the kept side
            if (inside < 0.0).all():
                return None
            if (inside < 0.0).any():
                t = inside[0] / (inside[0] - inside[1])
                crossing = segment[0] + t * (segment[1] - segment[0])
                kept = segment[inside >= 0.0][0]
                segment = np.array([crossing, kept] if inside[0] < 0.0 else [kept, crossing])
    return segment
