"""Drawn scenes with truth: what `memo.demo_scene` and `model_scene` give."""

import itertools

import memo
import numpy as np
import pytest
from memo.files import JOINTS
from memo.scene import model_scene


@pytest.fixture(scope="module")
def scene():
    return memo.demo_scene(2, frames=40)


def test_a_seed_gives_the_same_scene_again(scene):
    again = memo.demo_scene(2, frames=40)
    assert (again.frames == scene.frames).all() and again.truth.keys() == scene.truth.keys()
    assert all((again.truth[name] == scene.truth[name]).all() for name in scene.truth)
    assert (memo.demo_scene(3, frames=3).frames != scene.frames[:3]).any()


def test_the_truth_has_a_row_per_frame_and_its_joints_are_where_the_camera_shows_them(scene):
    truth = scene.truth
    assert (truth["frame"] == np.arange(40)).all() and (truth["time_s"] == scene.times_s).all()
    for joint in JOINTS:
        points = np.column_stack([truth[f"{joint}_{axis}_m"] for axis in "xyz"])
        pixels = np.column_stack([truth[f"{joint}_{axis}_px"] for axis in "uv"])
        assert np.allclose(scene.camera.project(points), pixels)
    # The picture changes where the person is.
    middle = np.median(scene.frames, axis=0)
    changed = np.abs(scene.frames.astype(float) - middle) > 25
    u = (truth["right_hip_u_px"] + truth["left_hip_u_px"]) / 2
    columns = [np.flatnonzero(frame.sum(axis=0) > 12).mean() for frame in changed[[0, -1]]]
    assert np.abs(np.array(columns) - u[[0, -1]]).max() < 25


def test_the_knee_bends_as_the_joints_say(scene):
    truth = scene.truth
    hip, knee, ankle = (
        np.column_stack([truth[f"right_{joint}_{axis}_m"] for axis in "xyz"])
        for joint in ("hip", "knee", "ankle")
    )
    thigh, shank = knee - hip, ankle - knee
    cosine = (thigh * shank).sum(axis=1) / np.linalg.norm(thigh, axis=1) / np.linalg.norm(shank, axis=1)
    # The angles are those in the plane of the path; limbs leave it by a few degrees.
    assert np.abs(np.degrees(np.arccos(cosine)) - np.abs(truth["right_knee_deg"])).max() < 6


def test_events_alternate_and_lie_within_the_scene(scene):
    strikes = scene.events["event"] == "heel_strike"
    sides = scene.events["side"][strikes]
    assert set(scene.events["event"]) == {"heel_strike", "toe_off"} and strikes.sum() >= 2
    assert (sides[1:] != sides[:-1]).all()
    assert (np.diff(scene.events["time_s"]) > 0).all()
    assert scene.events["time_s"].min() >= 0 and scene.events["time_s"].max() <= scene.times_s[-1]


def test_a_late_left_side_is_late():
    events = memo.demo_scene(1, frames=80, late_left=0.06).events
    strikes = events["event"] == "heel_strike"
    times_s, sides = events["time_s"][strikes], events["side"][strikes]
    step_s = {side: np.diff(times_s)[sides[1:] == side].mean() for side in ("left", "right")}
    stride_s = sum(step_s.values())
    assert (step_s["left"] - step_s["right"]) / stride_s == pytest.approx(2 * 0.06, abs=0.03)


@pytest.mark.parametrize("mover", ["rider", "waver", "trolley"])
def test_what_does_not_walk_has_no_truth_and_is_not_tracked(mover):
    scene = memo.demo_scene(1, frames=26, mover=mover)
    assert len(scene.truth["frame"]) == 0 and len(scene.events["time_s"]) == 0
    track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
    assert len(track) == 0 and track.summary["status"] != "tracked"


def test_one_frame_is_a_scene_and_senseless_options_are_refused():
    assert len(memo.demo_scene(0, frames=1).frames) == 1
    for options in (
        {"frames": 0},
        {"mover": "cat"},
        {"late_left": 0.5},
        {"noise_sd": -1.0},
        {"noise_sd": np.nan},
    ):
        with pytest.raises(ValueError, match=f"{next(iter(options)).split('_')[0]}"):
            memo.demo_scene(0, **options)


def test_the_model_as_a_walker_is_tracked_to_the_centimetre():
    scene = model_scene(1)
    track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
    rows = np.searchsorted(scene.truth["frame"], track.columns["frame"])
    assert len(track) > 50
    assert np.sqrt(np.mean((track.columns["x_m"] - scene.truth["x_m"][rows]) ** 2)) < 0.015
    assert np.nanmax(np.abs(track.columns["right_knee_deg"] - scene.truth["right_knee_deg"][rows])) < 5


def test_in_a_pause_the_person_stands_still_in_truth_and_picture():
    scene = memo.demo_scene(1, frames=60, noise_sd=0.0, pause_s=(0.9, 0.8))
    place_m = np.column_stack([scene.truth["x_m"], scene.truth["y_m"]])
    moves = np.linalg.norm(np.diff(place_m, axis=0), axis=1) > 1e-9
    from_s, to_s = scene.times_s[:-1], scene.times_s[1:]
    assert np.array_equal(moves, (from_s < 0.9 - 1e-9) | (to_s > 1.7 + 1e-9))
    changed = np.array([(a != b).any() for a, b in itertools.pairwise(scene.frames)])
    assert np.array_equal(changed, moves)
    with pytest.raises(ValueError, match=r"pause.at_s must be 0.8 to 10000 s, got 0.5"):
        memo.demo_scene(pause_s=(0.5, 1.0))


def test_walks_before_and_after_a_pause_are_of_one_person():
    scene = memo.demo_scene(206, frames=120, pause_s=(2.4, 0.8))
    track = memo.track(
        scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera, adapt=False
    )
    assert track.people == [0, 0] and len(track.walks) == 2
    begins = {sentence.split(":")[0] for sentence in track.sentences}
    assert begins == {"Walk 0 (person 0)", "Walk 1 (person 0)"}
    (why,) = [sentence for sentence in track.sentences if "same person" in sentence]
    old, new = (walk.columns for walk in track.walks)
    later_s = new["time_s"][0] - old["time_s"][-1]
    assert why.startswith("Walk 1 ") and f"as in walk 0: it begins {later_s:.1f} s later" in why
