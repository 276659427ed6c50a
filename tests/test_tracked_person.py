"""Postures with the help of a walk that was tracked in the same video; the track is written by hand."""

import json
import math

import memo
import numpy as np
import pytest
import score_tracked
import score_walks
from memo.files import JOINTS as LIMB_JOINTS
from memo.files import TRACK_COLUMNS, write_track_csv
from memo.tracked_person import tracked_person
from test_posture import AT, CAMERA_AT, RATE_HZ, errors_m, project, walker, write_camera, write_table

needs_recordings = pytest.mark.skipif(
    not (score_walks.SHARED_DATA / "walks").is_dir(), reason="no recordings (set MEMO_SHARED_DATA)"
)
HEADING_RAD = math.radians(25.0)


def track_folder(folder, figures, *, frames, shift_px=0.0, record=(), walks=None, off_m=(0.0, 0.0, 0.0)):
    """A folder of `memo track` that shows a walker in some frames, `off_m` from the true place."""
    folder.mkdir()
    rows = np.arange(len(figures))[frames]
    columns = {name: np.zeros(len(rows)) for name in TRACK_COLUMNS}
    columns |= {"frame": rows, "time_s": rows / RATE_HZ, "heading_rad": np.full(len(rows), HEADING_RAD)}
    columns |= {f"sd_{axis}_m": np.full(len(rows), 0.08) for axis in "xyz"}
    columns["walk"] = columns["person"] = np.zeros(len(rows), int) if walks is None else walks
    pixels = project(figures) + shift_px
    for joint in LIMB_JOINTS:
        for i, axis in enumerate("xyz"):
            columns[f"{joint}_{axis}_m"] = figures[rows, AT[joint], i] + off_m[i]
        for i, axis in enumerate("uv"):
            columns[f"{joint}_{axis}_px"] = pixels[rows, AT[joint], i]
    write_track_csv(folder / "track.csv", columns)
    camera = memo.Camera.from_toml(write_camera(folder / "camera.toml"))
    run = {
        **{"schema": 3, "memo": memo.__version__, "command": "memo track", "video": None},
        **{"frames": [0, None], "frames_read": len(figures), "interrupted": False, "rate_hz": RATE_HZ},
        **{"fps_given": None, "shrink": 1, "pixels_of": "video", "camera_given": True},
        **{"camera": memo.files.plain(camera.parameters()), "options": {}, "summary": {"height_m": 1.7}},
        **{"sentences": [], "walks": [{"gait": "forward", "drawn_height_m": 1.8, **dict(record)}] * 2},
    }
    (folder / "run.json").write_text(json.dumps(run))
    return folder


@pytest.fixture(scope="module")
def keypoints(tmp_path_factory):
    path = write_table(tmp_path_factory.mktemp("walk") / "walk.csv", walker())
    return memo.read_keypoints(path, fps=RATE_HZ)


def test_a_tracked_walk_gives_camera_height_direction_and_distance(tmp_path, keypoints):
    truth = walker()
    folder = track_folder(tmp_path / "track", truth, frames=slice(None))
    found = tracked_person(folder, keypoints)
    true_m = np.linalg.norm(truth[:, AT["neck"]] - CAMERA_AT, axis=1)
    assert np.allclose(found.distance_m, true_m, atol=1e-3)
    assert found.height_m == 1.8 and found.person == 0 and found.distance_sd_m == pytest.approx(0.08)
    assert found.moving_direction == pytest.approx(
        (math.cos(HEADING_RAD), math.sin(HEADING_RAD), 0), abs=1e-5
    )
    postures = memo.posture(keypoints, track=folder, noise_px=1)
    assert not postures.camera_assumed and postures.scale_from == "track"
    assert set(postures.anchor_source) == {"track"} and not any("height" in w for w in postures.warnings)
    assert postures.heading_source == "given" and postures.found.all()
    assert np.nanmean(errors_m(postures.smoothed_m, truth)) < 0.15
    given = memo.posture(keypoints, track=folder, height_m=1.6, moving_direction=(0, 1, 0), noise_px=1)
    assert given.heading_source == "given" and given.scale_from == "height"
    assert sum(given.lengths_m.values()) < 0.98 * sum(postures.lengths_m.values())


def test_the_neck_moves_on_for_half_a_second(tmp_path, keypoints):
    truth = walker()
    folder = track_folder(tmp_path / "track", truth, frames=slice(15, 25), off_m=(0.01, 0.0, 0.0))
    found = tracked_person(folder, keypoints)
    beyond = round(0.5 * RATE_HZ)
    known = np.isfinite(found.distance_m)
    inside = slice(max(15 - beyond, 0), min(24 + beyond + 1, len(truth)))
    assert known[inside].all() and known.sum() == len(truth[inside])
    true_m = np.linalg.norm(truth[:, AT["neck"]] - CAMERA_AT, axis=1)
    assert np.nanmax(np.abs(found.distance_m - true_m)) < 0.12


def test_who_turns_walks_backwards_or_stays_has_no_direction(tmp_path, keypoints):
    truth = walker()
    backward = track_folder(
        tmp_path / "backward", truth, frames=slice(None), record={"gait": "backward"}.items()
    )
    assert tracked_person(backward, keypoints).moving_direction is None
    here = truth - truth[:, AT["neck"]][:, None] + truth[20, AT["neck"]]
    stays = track_folder(
        tmp_path / "stays", here, frames=slice(None), shift_px=project(truth) - project(here)
    )
    assert tracked_person(stays, keypoints).moving_direction is None


def test_the_person_is_who_is_nearest(tmp_path, keypoints):
    truth = walker()
    walks = np.arange(len(truth)) // 20
    folder = track_folder(tmp_path / "two", truth, frames=slice(None), walks=walks)
    columns = memo.files.read_track(folder)
    for name in columns:
        if name.endswith("u_px"):
            columns[name] = np.where(columns["walk"] == 0, columns[name] + 300, columns[name])
    write_track_csv(folder / "track.csv", columns)
    assert tracked_person(folder, keypoints).person == 1


def test_what_cannot_help_is_refused(tmp_path, keypoints, memo_command):
    truth = walker()
    folder = track_folder(tmp_path / "track", truth, frames=slice(None))
    camera = memo.Camera.from_toml(folder / "camera.toml")
    for more in ({"camera": camera}, {"distance_m": 4.0}, {"anchor": "ground"}):
        with pytest.raises(ValueError, match="leave camera, distance and anchor out"):
            memo.posture(keypoints, track=folder, **more)
    far = track_folder(tmp_path / "far", truth, frames=slice(None), shift_px=400.0)
    with pytest.raises(ValueError, match="nobody of the track is where the keypoints are"):
        memo.posture(keypoints, track=far)
    late = memo.keypoints.Keypoints.from_arrays(
        keypoints.points, names=list(keypoints.names), times_s=keypoints.times_s + 100
    )
    with pytest.raises(ValueError, match="its walks share no time with the keypoints"):
        memo.posture(late, track=folder)
    with pytest.raises(ValueError, match=r"without track\.csv"):
        memo.posture(keypoints, track=tmp_path)
    empty = track_folder(tmp_path / "empty", truth, frames=slice(0, 0))
    with pytest.raises(ValueError, match="nobody was tracked"):
        memo.posture(keypoints, track=empty)


def test_the_command_takes_a_track(tmp_path, memo_command):
    path = write_table(tmp_path / "walk.csv", walker())
    folder = track_folder(tmp_path / "track", walker(), frames=slice(None))
    arguments = (
        "posture",
        path,
        "--fps",
        RATE_HZ,
        "--track",
        folder,
        "--no-plots",
        "--out",
        tmp_path / "out",
    )
    code, said, complaint = memo_command(*arguments)
    assert code == 0, complaint
    assert "Sizes are based on the height of the tracked walk; the neck is " in said
    assert " m), from the track." in said
    code, said, _ = memo_command(*arguments, "--height", 1.5)
    assert "Sizes are based on the height given; the neck is " in said and " m), from the track." in said
    assert (
        "the height given, 1.50 m, and that of the tracked walk, 1.80 m, differ by more than three standard "
        "deviations (0.03 m)"
    ) in said
    assert "height given, " not in memo_command(*arguments, "--height", 1.78)[1]
    code, _, complaint = memo_command(*arguments, "--camera", folder / "camera.toml")
    assert code == 2 and "--track has a camera and distances: leave --camera" in complaint
    arguments = [tmp_path / "nothere" if argument == folder else argument for argument in arguments]
    code, _, complaint = memo_command(*arguments)
    assert code == 1 and complaint == f"memo: {tmp_path / 'nothere'}: no such folder of memo track\n"


def test_biases_of_clips_do_not_cancel_when_pooled():
    clip = score_walks.ClipScore("BMC2__plain", 1.0, 1, (1, 0, 0))
    rows = [score_tracked.Row(clip, "track", (5.0, 4.0, bias, 6.0, 8.0)) for bias in (3.0, -4.0)]
    assert score_tracked.pooled(rows) == pytest.approx((5.0, 4.0, math.sqrt(12.5), 6.0, 8.0))


@needs_recordings
def test_a_tracked_walk_corrects_the_distance_of_a_person_with_low_shoulders():
    clip = next(clip for clip in score_walks.shared_clips() if clip.name == "BELT_C__table_flip")
    height, track = score_tracked.rows_of(clip)
    assert (height.way, track.way) == score_tracked.WAYS
    absolute, relative, bias = track.values[:3]
    assert absolute < 0.5 * height.values[0] and relative < height.values[1]
    assert abs(bias) < 2 * track.values[4]


def test_a_track_as_keypoints_is_a_camera_too(tmp_path, memo_command):
    folder = track_folder(tmp_path / "track", walker(), frames=slice(None))
    code, said, complaint = memo_command("posture", folder, "--height", 1.75, "--out", tmp_path / "out")
    wanted = f"memo: --camera is needed, or --track {folder} to take the camera from this track"
    assert (code, said) == (1, "") and " ".join(complaint.split()) == wanted
