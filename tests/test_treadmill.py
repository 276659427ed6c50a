"""Walks on a treadmill: the whole chain on a drawn person, and what the summary says."""

import types

import memo
import numpy as np
import pytest
from memo import _memo
from memo.left_out import LeftOut, stays_in_place
from memo.tracking import Track
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


def test_an_option_that_hides_the_walk_is_named():
    scene = memo.demo_scene(0, frames=48, mover="treadmill")
    given = {"times_s": scene.times_s, "camera": scene.camera, "height_m": scene.height_m}
    track = memo.track(scene.frames, **given, treadmill=False)
    assert track.walks == []
    assert "leave --no-treadmill (treadmill=False) out" in track.sentences[-1]
    assert not any("treadmill" in said for said in memo.track(scene.frames, **given).sentences[2:])


@pytest.mark.parametrize(
    ("reason", "frames", "left_px", "heights_px", "stays"),
    [
        ("not walking", 80, 0, (200, 198), True),
        ("too slow", 80, 40, (200, 190), True),
        ("too slow", 39, 0, (200, 198), False),
        ("cut off", 80, 0, (200, 198), False),
        ("not walking", 80, 180, (200, 198), False),  # goes on
        ("too slow", 80, 10, (190, 300), False),  # comes nearer
    ],
)
def test_who_stays_in_place_may_be_on_a_treadmill(reason, frames, left_px, heights_px, stays):
    boxes = [(0, 100, 50, 60, heights_px[0]), (60, 100 + left_px, 50, 60, heights_px[1])]
    boxes.append((79, 120, 50, 20, 30))  # a part alone
    left = LeftOut(0, 79, 0.0, 3.2, frames, np.array(boxes), reason, None)
    assert stays_in_place(left) == stays


def test_with_the_option_other_walks_are_not_tracked():
    seek = _memo.SeekReport(90, 79, 0, 17, 13, 0, 0, 0.0)
    asked, free = (Track([], seek, options={"treadmill": option}).summary for option in (True, None))
    assert "only walks on a treadmill" in asked["message"] and "treadmill" not in free["message"]
