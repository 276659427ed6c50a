"""The reference of eqs. (7) and (11) against values on paper, invariances and a cut by sampling."""

from __future__ import annotations

import numpy as np
import pytest
from similarity_reference import Match, Parameters, cut_to_window, match, similarity

P = Parameters(c_l=0.7, c_d=0.5, c_r=0.25, sigma_phi_rad=np.radians(15.0))
LINE = np.array([[10.0, 20.0], [50.0, 20.0]])  # 40 px long, window half width 10 px


def segment(*ends: float) -> np.ndarray:
    return np.array(ends, dtype=float).reshape(2, 2)


def beside(offset_px: float) -> np.ndarray:
    return LINE + np.array([0.0, offset_px])


def total(model: np.ndarray, edges: list[np.ndarray] | np.ndarray, parameters: Parameters = P) -> float:
    return similarity(np.asarray(model), np.asarray(edges).reshape(-1, 2, 2), parameters).total


def test_an_edge_on_the_line_scores_its_whole_length():
    assert match(LINE, LINE, P) == Match(40.0, 0.0, 0.0, 40.0)
    assert total([LINE], [LINE]) == 1.0


def test_distance_alone():
    found = match(LINE, beside(4.0), P)
    assert match(LINE, beside(-4.0), P) == found
    assert (found.l_px, found.d_px, found.dphi_rad) == (40.0, 4.0, 0.0)
    assert found.score == pytest.approx(40.0 * np.exp(-0.5 * (4.0 / 5.0) ** 2))  # c_d r = 0.5 * 10 px


def test_length_alone():
    found = match(LINE, segment(20, 20, 30, 20), P)
    assert found.score == pytest.approx(10.0 * np.exp(-0.5 * (30.0 / 28.0) ** 2))  # c_l l_M = 0.7 * 40 px


def test_angle_alone():
    # Through the middle of the line at slope 3/4, cut where it leaves the window: 10 px up, 40/3 px along.
    found = match(LINE, segment(10, 5, 50, 35), P)
    angle = np.arctan2(3.0, 4.0)
    assert (found.l_px, found.d_px, found.dphi_rad) == pytest.approx((80.0 / 3.0, 0.0, angle), abs=1e-12)
    expected = np.exp(-0.5 * ((40.0 / 3.0 / 28.0) ** 2 + (angle / np.radians(15.0)) ** 2))
    assert found.score == pytest.approx(80.0 / 3.0 * expected)


def test_distance_is_measured_after_the_cut():
    # Slope 1/5 from 2 to 12 px beside the line; the window ends after 40 px, at 10 px: l = 40, middle 6.
    found = match(LINE, segment(10, 22, 60, 32), P)
    assert (found.l_px, found.d_px) == pytest.approx((40.0, 6.0))


def test_what_lies_beyond_the_window_does_not_count():
    assert match(LINE, segment(-500, 22, 700, 22), P) == match(LINE, segment(10, 22, 50, 22), P)


@pytest.mark.parametrize(
    "edge",
    [(10, 31, 50, 31), (51, 20, 90, 20), (-20, 20, 9, 20), (5, 27, 12, 34), (52, 14, 49, 6)],
    ids=["beside", "after", "before", "past the corner", "past the other corner"],
)
def test_edges_outside_the_window_do_not_match(edge):
    assert match(LINE, segment(*edge), P) is None
    assert total([LINE], [segment(*edge)]) == 0.0


def test_an_upright_edge_projects_to_nothing():
    found = match(LINE, segment(30, 0, 30, 40), P)
    assert (found.l_px, found.d_px, found.score) == (0.0, 0.0, 0.0)
    assert found.dphi_rad == pytest.approx(np.pi / 2.0)


def test_the_best_edge_counts_and_lengths_weigh():
    short, far = segment(10, 20, 30, 20), beside(9.0)
    other = segment(100, 100, 100, 220)
    edges = np.array([far, short, beside(1.0), beside(9.5)])
    result = similarity(np.array([LINE, other]), edges, P)
    assert result.best_edges == [2, -1]
    assert result.scores == [pytest.approx(40.0 * np.exp(-0.5 * 0.04)), 0.0]
    assert result.total == pytest.approx(result.scores[0] / 160.0)


def test_nothing_to_compare_is_no_similarity():
    none = np.empty((0, 2, 2))
    assert total([LINE], none) == 0.0
    assert total(none, [LINE]) == 0.0
    assert similarity(np.array([segment(3, 3, 3, 3)]), LINE[None], P).best_edges == [-1]


def random_scene(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    model = rng.uniform(0.0, 100.0, (12, 2, 2))
    edges = rng.uniform(-20.0, 120.0, (30, 2, 2))
    edges[:12] = model + rng.normal(0.0, 3.0, model.shape)
    return model, edges


@pytest.mark.parametrize("seed", range(10))
def test_invariance_to_motion_scale_and_direction(seed):
    rng = np.random.default_rng(seed)
    model, edges = random_scene(rng)
    reference = total(model, edges)
    assert 0.2 < reference < 1.0
    angle, scale, shift = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.1, 10.0), rng.normal(0.0, 100.0, 2)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = [scale * points @ turn.T + shift for points in (model, edges)]
    mirrored = [points * [1.0, -1.0] for points in (model, edges)]
    for changed in [moved, mirrored, (model[:, ::-1], edges), (model, edges[:, ::-1]), (model[::-1], edges)]:
        assert total(*changed) == pytest.approx(reference, rel=1e-9)


@pytest.mark.parametrize("seed", range(5))
def test_more_edges_never_lower_the_similarity(seed):
    model, edges = random_scene(np.random.default_rng(seed))
    totals = [total(model, edges[:count]) for count in range(0, 31, 5)]
    assert totals == sorted(totals)


def test_cut_agrees_with_points_of_the_segment():
    rng = np.random.default_rng(1)
    low, high, missed = np.array([0.0, -1.0]), np.array([4.0, 1.0]), 0
    t = np.linspace(0.0, 1.0, 20001)
    for _ in range(300):
        ends = rng.uniform([-3.0, -3.0], [7.0, 3.0], (2, 2))
        points = ends[0] + t[:, None] * (ends[1] - ends[0])
        inside = points[((points >= low) & (points <= high)).all(axis=1)]
        cut = cut_to_window(ends, low, high)
        if cut is None:
            missed += 1
            assert len(inside) == 0
        else:
            np.testing.assert_allclose(cut, inside[[0, -1]], atol=1e-3)
    assert 50 < missed < 250
