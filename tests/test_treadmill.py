"""Walks on a treadmill: the whole chain on a drawn person, and what the summary says."""

import types

import memo
import numpy as np
import pytest
from memo import _memo
from memo.treadmill import treadmill_figures, treadmill_sentence


def walk(*treadmill, heading_rad=0.4):
    return types.SimpleNamespace(
        treadmill=_memo.Treadmill(*treadmill) if treadmill else None,
        columns={"heading_rad": np.full(9, heading_rad)},
    )


def test_over_ground_there_is_no_belt():
    assert treadmill_figures(walk()) == {"treadmill": False}


def test_the_sentence_has_the_belt_and_a_likely_other_heading():
    said = treadmill_sentence(walk(1.204, 0.031, None, None), 8.04, 108.2)
    assert said == (
        "Somebody walks on a treadmill for 8.0 s, belt speed 1.20 m/s (standard deviation 0.03 m/s), "
        "108 steps per minute."
    )
    assert treadmill_sentence(walk(1.2, 0.03, -0.4, 0.01), 8.0, np.nan).endswith(
        "1.20 m/s (standard deviation 0.03 m/s)."
    )
    open_heading = treadmill_sentence(walk(1.2, 0.03, -0.4, 0.31), 8.0, np.nan)
    assert "The heading is 23 degrees, or 337 degrees (probability 31%)." in open_heading


def test_the_figures_name_the_belt_and_both_headings():
    figures = treadmill_figures(walk(1.2, 0.03, -0.4, 0.31))
    assert figures == {
        "treadmill": True,
        "belt_mps": 1.2,
        "belt_sd_mps": 0.03,
        "heading_rad": pytest.approx(0.4),
        "other_heading_rad": -0.4,
        "p_other_heading": 0.31,
    }
    assert treadmill_figures(walk(1.2, 0.03, None, None))["p_other_heading"] is None


@pytest.fixture(scope="module")
def scene():
    return memo.demo_scene(1, frames=48, mover="treadmill")


def test_a_drawn_walk_on_the_spot_is_a_walk_on_a_treadmill(scene):
    track = memo.track(scene.frames, times_s=scene.times_s, camera=scene.camera, height_m=scene.height_m)
    summary = track.summary
    assert (summary["walks"], summary["treadmill"], len(track)) == (1, True, 48)
    belt = scene.truth["speed_mps"][0]
    assert abs(summary["belt_mps"] / belt - 1) < 0.05
    assert "on a treadmill" in summary["message"] and "belt speed" in track.sentences[1]
    # The body stays, and the speed is that on the belt.
    assert np.ptp(track.columns["x_m"]) < 0.2
    assert np.median(track.columns["speed_mps"]) == pytest.approx(belt, rel=0.06)


def test_a_treadmill_can_be_excluded(scene):
    track = memo.track(
        scene.frames, times_s=scene.times_s, camera=scene.camera, height_m=scene.height_m, treadmill=False
    )
    assert not any(walk.treadmill for walk in track.walks)
