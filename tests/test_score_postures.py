"""The figures of `score_postures`: by hand on a few numbers, and what memo must reach on recordings."""

import numpy as np
import pytest
import score_postures as scores
from conftest import SHARED_DATA

needs_mocap = pytest.mark.skipif(
    not (SHARED_DATA / "mocap" / "joints").is_dir(), reason="no recordings (set MEMO_SHARED_DATA)"
)


def test_a_calibration_error_is_the_mean_gap_between_stated_and_true_rates():
    stated = np.array([0.01] * 10 + [0.22] * 10)
    mirrored = np.array([0.0] * 9 + [1.0] + [1.0] * 4 + [0.0] * 6)
    rows = scores.reliability(stated, mirrored)
    assert [row[0] for row in rows] == [10, 10]
    assert scores.calibration_error(stated, mirrored) == pytest.approx((0.09 + 0.18) / 2)
    assert scores.calibration_error(np.full(4, 0.5), np.array([0.0, 1.0, 0.0, 1.0])) == 0.0


def test_a_front_is_to_the_left_of_the_right_side():
    figure = np.zeros((1, 14, 3))
    figure[0, [1, 4], 1], figure[0, [2, 5], 1] = -0.2, 0.2
    figure[0, 0, 2] = 0.5
    assert scores.fronts(figure)[0] == pytest.approx([1.0, 0.0, 0.0])
    assert scores.sides(figure)[0] == pytest.approx([0.0, 0.8, 0.0])


@needs_mocap
def test_a_person_who_jumps_sideways_to_the_view_is_turned_the_right_way():
    job = scores.Job("other motions", "02", "CMU_02_04_jump", "bare", 90.0, 2.0)
    found = scores.found(job)
    assert found.facing < 0.03
    assert found.smooth_cm < min(found.linked_cm, 0.6 * found.flat_cm)


@needs_mocap
def test_a_walk_in_much_noise_is_smoothed():
    found = scores.found(scores.Job("walks", "tuning", "BTK_BELT_C", "bare", 90.0, 5.0))
    assert found.smooth_cm < 0.7 * found.linked_cm


@needs_mocap
def test_the_distance_of_walkers_of_known_height_is_not_too_large_on_average():
    jobs = [scores.Job("walks", "others", name, "height", 90.0, 2.0) for name in scores.WALKS["others"]]
    assert abs(np.mean([scores.found(job).bias_cm for job in jobs])) < 6.0
