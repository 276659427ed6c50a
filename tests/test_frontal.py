"""Walks towards the camera and away from it: the whole chain on a drawn person, and what the summary says."""

import pickle

import memo
import numpy as np
import pytest
from conftest import grey_video, ran
from memo import _memo
from memo.explain import explain
from memo.files import read_track_csv
from memo.report import write_report
from memo.tracking import Track


@pytest.fixture(scope="module")
def scene():
    """A person who comes straight towards the camera, but for five degrees."""
    return memo.demo_scene(4, frames=90, slant_deg=-85, leftward=False)


@pytest.fixture(scope="module")
def track(scene):
    return memo.track(list(scene.frames), fps=25, camera=scene.camera, height_m=scene.height_m)


def test_the_scene_comes_nearer(scene):
    distance = np.hypot(
        scene.truth["x_m"] - scene.camera.position[0], scene.truth["y_m"] - scene.camera.position[1]
    )
    assert np.all(np.diff(distance) < 0) and np.ptp(distance) > 3


def test_place_and_phase_are_found_and_the_sides_stay_open(scene, track):
    (walk,) = track.walks
    assert walk.is_frontal and len(walk) > 72
    columns = walk.columns
    truth = {name: scene.truth[name][columns["frame"]] for name in ("heading_rad", "x_m", "y_m", "phase")}
    off_m = np.hypot(columns["x_m"] - truth["x_m"], columns["y_m"] - truth["y_m"])
    assert np.median(off_m) < 0.3
    assert np.median(off_m) < 2 * np.median(np.hypot(columns["sd_x_m"], columns["sd_y_m"]))
    off = np.degrees(np.angle(np.exp(1j * (columns["heading_rad"] - truth["heading_rad"]))))
    assert np.abs(off).max() < 6
    half_cycles = 2 * (columns["phase"] - truth["phase"])
    assert np.median(np.abs(half_cycles - np.round(half_cycles))) / 2 < 0.05
    assert np.all(columns["p_swapped"] == 0.5)


def test_who_goes_away_is_placed_where_the_feet_are():
    scene = memo.demo_scene(2, frames=90, slant_deg=85, leftward=False)
    (walk,) = memo.track(list(scene.frames), fps=25, camera=scene.camera, height_m=scene.height_m).walks
    assert walk.is_frontal and len(walk) > 72
    columns = walk.columns
    off_m = np.stack([columns[name] - scene.truth[name][columns["frame"]] for name in ("x_m", "y_m")])
    heading = scene.truth["heading_rad"][columns["frame"]]
    along_m = off_m[0] * np.cos(heading) + off_m[1] * np.sin(heading)
    # Of a shoe that ends at the ankle and a half of the foot, 0.25 m too near to the camera.
    assert abs(along_m.mean()) < 0.12


def test_two_who_come_nearer_side_by_side_are_both_followed(scene):
    """The same person a second time, 210 pixels to the right and 12 frames later."""
    frames = np.array(scene.frames)
    empty = np.median(frames, axis=0).astype(int)
    later, aside = 12, 210
    moved = np.roll(frames, (later, aside), axis=(0, 2))
    is_person = np.roll(np.abs(frames - empty) > 6, (later, aside), axis=(0, 2))
    is_person[:later] = False
    is_person[:, :, :aside] = False
    both = np.where(is_person, moved, frames)
    found = memo.track(list(both), fps=25, camera=scene.camera)
    assert [walk.is_frontal for walk in found.walks] == [True, True]
    assert len({walk.person for walk in found.walks}) == 2
    (alone,) = memo.track(list(frames), fps=25, camera=scene.camera).walks
    first = min(found.walks, key=lambda walk: walk.columns["frame"][0])
    of_both = np.isin(alone.columns["frame"], first.columns["frame"])
    assert of_both.sum() > 60
    rows = np.isin(first.columns["frame"], alone.columns["frame"])
    assert np.median(np.abs(first.columns["y_m"][rows] - alone.columns["y_m"][of_both])) < 0.15


def test_only_what_the_rhythm_shows_is_an_event(track):
    """When feet leave the ground is not seen, only assumed: after 61 % of the cycle."""
    assert {event["event"] for event in track.events} == {"heel_strike"}


def test_the_summary_says_what_was_measured_and_what_not(track):
    summary = track.summary
    assert "walks towards the camera" in summary["message"] and "not certain" not in summary["message"]
    assert summary["direction"] == "towards the camera" and summary["p_swapped"] == 0.5
    assert "towards the camera (whether forwards or backwards is not seen) for" in summary["message"]
    assert not summary["fit"]["measured"] and "from the front" in summary["fit"]["problem"]


def test_a_stored_walk_keeps_it(track):
    (walk,) = pickle.loads(pickle.dumps(track)).walks
    assert walk.is_frontal


def test_without_a_calibrated_camera_nobody_is_followed_by_the_feet(scene):
    track = memo.track(list(scene.frames[:45]), fps=25, height_m=scene.height_m)
    assert not any(walk.is_frontal for walk in track.walks)


def test_somebody_who_is_not_followed_without_a_camera_is_told_what_to_give():
    seek = _memo.SeekReport(90, 79, 0, 17, 13, 0, 0, 0.0)
    without, calibrated = Track([], seek), Track([], seek, _memo.Camera.level((640, 480), 50.0, 1.0, 5.0))
    assert without.summary["status"] == calibrated.summary["status"] == "not walking"
    assert "tracked only with a calibrated camera" in without.summary["message"]
    assert "calibrated" not in calibrated.summary["message"]


def test_frames_are_explained_and_reported(scene, tmp_path):
    video = grey_video(tmp_path / "video.mkv", scene.frames)
    scene.camera.to_toml(tmp_path / "camera.toml")
    ran("track", video, "--camera", tmp_path / "camera.toml", "--no-plots", "--quiet", "--out", tmp_path)
    columns = read_track_csv(tmp_path / "track.csv")
    whys = list(explain(tmp_path))
    assert [why.frame for why in whys] == columns["frame"].tolist()
    np.testing.assert_allclose([why.chosen_similarity for why in whys], columns["similarity"], atol=8e-6)
    assert "towards the camera" in write_report(tmp_path).path.read_text(encoding="utf-8")
