"""A camera that turns in its place after a walker: drawn people before a textured wall."""

import json

import cv2
import memo
import numpy as np
import pytest
from conftest import grey_video
from memo.explain import explain
from panned import WIDTH, panned_scene


@pytest.fixture(scope="module", params=[0, 1])
def panned(request):
    return panned_scene(request.param)


@pytest.fixture(scope="module")
def track(panned):
    return memo.track(panned.frames, fps=25, height_m=panned.scene.height_m, camera=panned.camera)


def off_m(columns, truth):
    """Root mean square errors along the world's axes."""
    rows = np.searchsorted(truth["frame"], columns["frame"])
    return [np.sqrt(np.mean((columns[f"{axis}_m"] - truth[f"{axis}_m"][rows]) ** 2)) for axis in "xyz"]


def test_a_walker_is_followed_beyond_the_first_view(panned, track):
    truth = panned.scene.truth
    (walk,) = track.walks
    columns = walk.columns
    assert len(columns["frame"]) > 0.95 * len(panned.frames)
    along, across, up = off_m(columns, truth)
    assert along < 0.03 and across < 0.15 and up < 0.03, (along, across, up)
    # Pixels are those of each frame, of OpenCV's projection.
    given = panned.scene.camera.parameters()
    for row in range(0, len(columns["frame"]), 10):
        frame = columns["frame"][row]
        turn = panned.turned[frame] @ cv2.Rodrigues(np.array(given["rotation"]))[0]
        at = np.array([columns[f"right_hip_{axis}_m"][row] for axis in "xyz"])
        seen = panned.matrix @ (turn @ at + panned.turned[frame] @ np.array(given["translation"]))
        told = [columns[f"right_hip_{axis}_px"][row] for axis in "uv"]
        assert np.hypot(*(seen[:2] / seen[2] - told)) < 1.5, frame
    assert track.camera_motion.wider is None
    assert not any("pans" in sentence for sentence in track.sentences)


def test_frames_that_are_read_once_are_tracked_in_the_first_view(panned, track):
    given = {"fps": 25, "height_m": panned.scene.height_m, "camera": panned.camera}
    once = memo.track(iter(panned.frames), **given)
    wider = once.camera_motion.wider
    assert max(wider["reach_px"]) > 100 and len(once) < 0.8 * len(track)
    (said,) = (sentence for sentence in once.sentences if sentence.startswith("The camera pans"))
    assert all(f"{name}={value}" in said for name, value in wider.items())
    # With a reach of 0 nothing is tracked again; with the reach in the sentence, the whole walk is.
    assert len(memo.track(panned.frames, **given, reach_px=(0, 0, 0, 0))) == len(once)
    wide = memo.track(iter(panned.frames), **given, **wider)
    np.testing.assert_array_equal(wide.columns["x_m"], track.columns["x_m"])
    for left in once.left_out:
        assert (left.boxes[:, 1] >= 0).all() and (left.boxes[:, 1] + left.boxes[:, 3] <= WIDTH).all(), left


def test_the_person_is_fitted_again_to_the_frames(panned, track):
    (walk,) = track.walks
    again = memo.fit_walk(walk, panned.frames)
    for name in ("right_hip_deg", "left_knee_deg"):
        off = np.abs(again.columns[name] - walk.columns[name])
        assert np.nanmedian(off) < 1.0, name


def test_the_command_reads_the_video_again(panned, track, tmp_path, memo_command):
    video, camera = tmp_path / "pan.mkv", tmp_path / "camera.toml"
    grey_video(video, panned.frames)
    names = ("size", "matrix", "distortions", "rotation", "translation")
    given = panned.camera.parameters()
    camera.write_text("[cam]\n" + "".join(f"{name} = {list(given[name])}\n" for name in names))
    options = ["--camera", camera, "--height", panned.scene.height_m, "--out", tmp_path / "run"]
    code, _, said = memo_command("track", video, *options)
    assert code == 0
    assert "the camera pans: tracking again, in larger pictures" in said
    run = json.loads((tmp_path / "run" / "run.json").read_text())
    assert max(run["options"]["reach_px"]) > 100 and run["camera"]["size"] == [WIDTH, len(panned.frames[0])]
    (why,) = explain(tmp_path / "run", [60])
    assert why.frame == 60 and why.luma.shape[1] > WIDTH + 150


def test_the_pan_shows_the_field_of_view_of_an_assumed_camera(panned, track):
    true_deg = panned.field_of_view_deg
    # The camera stands still at first: what it shows then tells nothing.
    found = memo.field_of_view(panned.frames)
    assert abs(found.horizontal_deg - true_deg) < 2.5 * found.sd_deg < 1, (found, true_deg)
    free = memo.track(panned.frames, fps=25, height_m=panned.scene.height_m)
    assert len(free) > 0.9 * len(track)
    (said,) = (sentence for sentence in free.sentences if "pan tells" in sentence)
    assert f"shows {found.horizontal_deg:.1f}°" in said or abs(found.horizontal_deg - true_deg) < 0.5
    speed = [np.ptp(one.columns["x_m"]) / np.ptp(one.columns["time_s"]) for one in (free, track)]
    assert speed[0] == pytest.approx(speed[1], rel=0.05)
    # A field of view that is given is not measured.
    given = memo.track(panned.frames, fps=25, height_m=panned.scene.height_m, fov_deg=true_deg)
    assert len(given) > 0.9 * len(track) and not any("pan tells" in sentence for sentence in given.sentences)


def test_a_camera_at_rest_shows_no_field_of_view(panned):
    assert memo.field_of_view([panned.frames[0]] * 12) is None
    assert memo.field_of_view([]) is None
    assert memo.field_of_view(list(panned.scene.frames)[:40]) is None
