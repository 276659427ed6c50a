"""Who moves and is not followed: one entry with its frames, its place and the reason, in every output."""

import json

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA, grey_video, ran
from memo.exits import Exit
from memo.left_out import LeftOut, left_out_sentences
from memo.report import write_report

SEEDS = (1, 2)


def tracked(frames, scene, **options):
    return memo.track(list(frames), fps=25, height_m=scene.height_m, **options)


def mean_u_px(scene):
    """Mean column of shoulders and hips, by frame."""
    joints = [f"{side}_{joint}_u_px" for side in ("right", "left") for joint in ("shoulder", "hip")]
    middles = np.mean([scene.truth[name] for name in joints], axis=0)
    return dict(zip(scene.truth["frame"].tolist(), middles, strict=True))


@pytest.fixture(scope="module", params=SEEDS)
def scene(request):
    return memo.demo_scene(request.param)


@pytest.fixture(scope="module")
def headless(scene):
    """The picture from the shoulders down: its border cuts everybody off."""
    shoulders = np.minimum(scene.truth["right_shoulder_v_px"], scene.truth["left_shoulder_v_px"])
    return scene.frames[:, int(shoulders.min()) + 15 :]


@pytest.mark.parametrize("apart_s", [1.0, 40.0])
def test_steps_are_not_counted_in_frames_that_are_far_apart(apart_s):
    """As if one of the times of a video were in milliseconds, or its frame rate far too low."""
    scene = memo.demo_scene(1)
    times_s = apart_s * np.arange(len(scene.frames))
    track = memo.track(scene.frames, times_s=times_s, height_m=scene.height_m)
    assert not track.walks and {left.reason for left in track.left_out} == {"frames too far apart"}
    assert f"the frames are {apart_s:.2g} s apart" in track.summary["message"]
    assert "times are in seconds" in track.summary["message"]


def test_who_is_followed_is_not_left_out(scene):
    track = tracked(scene.frames, scene, camera=scene.camera)
    assert len(track.walks) == 1
    assert track.left_out == [] and track.summary["left_out"] == 0
    assert not any("not followed" in sentence for sentence in track.sentences)


def test_who_is_cut_off_is_left_out_where_the_person_was(scene, headless):
    track = tracked(headless, scene)
    assert track.walks == []
    (left,) = track.left_out
    assert left.reason == "cut off"
    middles = mean_u_px(scene)
    shown = [frame for frame, u_px in middles.items() if 40 < u_px < 600]
    assert left.first_frame <= min(shown) + 2 and left.last_frame >= max(shown) - 2
    for frame, u_left, _, width, _ in left.boxes.tolist():
        if frame in shown:
            assert abs(u_left + width / 2 - middles[frame]) < 30
    assert track.sentences[1:] == left_out_sentences(track.left_out, 1)
    assert "cut it off" in track.sentences[-1]


@pytest.mark.parametrize("n", [8, 10])
def test_who_is_too_small_is_left_out_as_too_small(scene, n):
    count, height, width = len(scene.frames), scene.frames.shape[1] // n, scene.frames.shape[2] // n
    far = scene.frames[:, : height * n, : width * n].reshape(count, height, n, width, n).mean((2, 4))
    random = np.random.default_rng(0)
    frames = np.repeat(random.normal(110, 3, (1, 240, 320)), count, axis=0)
    frames[:, 100 : 100 + height, 100 : 100 + width] = far
    frames += random.normal(0, 1, frames.shape)
    track = tracked(frames.clip(0, 255).astype(np.uint8), scene)
    assert track.walks == [] and track.left_out
    middles = mean_u_px(scene)
    for left in track.left_out:
        assert left.reason == "too small" and left.value is not None and left.value < 30
        for frame, u_left, _, box_width, _ in left.boxes.tolist():
            if frame in middles:
                assert abs(u_left + box_width / 2 - (100 + middles[frame] / n)) < 8


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("mover", ["trolley", "rider", "waver"])
def test_what_is_no_walker_is_left_out(mover, seed):
    scene = memo.demo_scene(seed, mover=mover)
    track = tracked(scene.frames, scene, camera=scene.camera)
    assert track.walks == []
    (left,) = track.left_out
    assert left.reason == ("not walking" if mover != "waver" else "wrong size")
    assert left.frames > 70 and left.frames <= len(scene.frames)


def test_a_walk_over_the_ground_is_none_on_a_treadmill(scene):
    track = tracked(scene.frames, scene, camera=scene.camera, treadmill=True)
    message = track.summary["message"]
    assert track.walks == [] and track.summary["status"] == "not walking"
    assert "moves over the ground by" in message and "Leave --treadmill" in message
    said_m = float(message.split("by ")[1].split(" m")[0])
    true_m = abs(scene.truth["x_m"][-1] - scene.truth["x_m"][0])
    assert said_m == pytest.approx(true_m, rel=0.15)


def test_every_output_of_a_run_has_them(headless, memo_command, tmp_path):
    video = grey_video(tmp_path / "video.mkv", headless[:, : headless.shape[1] // 2 * 2])
    code, said, _ = memo_command(
        "track", video, "--frames", "5:", "--no-overlay", "--no-plots", "--out", tmp_path
    )
    assert code == Exit.NOBODY and "not followed" in said
    found = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))
    (left,) = found["left_out"]
    assert found["summary"]["left_out"] == 1
    assert left["reason"] == "cut off" and "border" in left["sentence"]
    assert left["first_frame"] >= 5 and left["boxes"][0][0] == left["first_frame"]
    page = write_report(tmp_path).path.read_text(encoding="utf-8")
    assert "Not followed" in page and left["sentence"] in page


def test_pixels_and_frames_are_those_of_the_video():
    boxes = np.array([[3, 10, 20, 30, 60], [9, 12, 20, 30, 60]])
    small = LeftOut(3, 9, 0.12, 0.36, 7, boxes, "too small", 28.0)
    shown = small.of_video(3, first_frame=100)
    assert (shown.first_frame, shown.last_frame, shown.value) == (103, 109, 84.0)
    assert shown.boxes.tolist() == [[103, 30, 60, 90, 180], [109, 36, 60, 90, 180]]
    assert shown.place == (81, 150, 109) and "84 px" in shown.sentence


def test_only_the_longest_are_told():
    def seen(frames, reason):
        return LeftOut(0, frames - 1, 0.0, 0.04 * frames, frames, np.ones((1, 5), int), reason, 1.0)

    reasons = ["cut off", "too small", "wrong size", "other height", "too wide", "too slow"]
    reasons += ["too fast", "not walking", "too brief", "beside somebody", "too many", "over ground"]
    left_out = [seen(10 + k, reason) for k, reason in enumerate(reasons)]
    said = left_out_sentences(left_out, 120)
    assert said[0] == "120 moving people or things were not followed. The 3 seen longest:"
    assert len(said) == 4 and "over the ground" in said[1] and "eight larger" in said[2]
    assert "Leave --treadmill" not in said[1]  # somebody else may walk on the treadmill
    assert all(left.sentence.endswith(".") for left in left_out)
    assert left_out_sentences([], 0) == []


def test_a_speed_is_called_that_across_the_picture():
    def said(reason, value):
        return LeftOut(0, 79, 0.0, 3.2, 80, np.ones((1, 5), int), reason, value).sentence

    assert said("too slow", 0.06).startswith("it hardly moved across the picture (0.06 m/s), and no walk on ")
    assert said("too fast", 3.4) == "it moved across the picture at 3.4 m/s, faster than people walk."
    assert "41.8" not in said("too fast", 41.8) and "the camera moved" in said("too fast", 41.8)


@pytest.mark.parametrize("scene_name", ["three", "pair", "cross2", "toward"])
def test_nobody_is_left_out_where_everybody_is_followed(scene_name, tmp_path):
    scene = SHARED_DATA / "people" / scene_name
    if not scene.is_dir():
        pytest.skip(f"no scene in {scene} (set MEMO_SHARED_DATA)")
    given = [scene / "video.mp4", "--camera", scene / "camera.toml"]
    ran("track", *given, "--no-overlay", "--no-plots", "--quiet", "--out", tmp_path)
    run = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))
    assert run["left_out"] == [] and run["summary"]["people"] == len(list(scene.glob("truth_*.csv")))


def test_a_point_where_nobody_is_finds_nobody(memo_command, tmp_path):
    scene = memo.demo_scene(1)
    empty = np.repeat(np.median(scene.frames, axis=0).astype(np.uint8)[None], 6, axis=0)
    video = grey_video(tmp_path / "video.mkv", np.concatenate([scene.frames, empty]))
    scene.camera.to_toml(tmp_path / "camera.toml")
    frame, last = len(scene.frames) // 2, len(scene.frames) + 5
    given = ["track", video, "--camera", tmp_path / "camera.toml", "--no-overlay", "--no-plots"]

    def followed(point):
        code, _, complained = memo_command(*given, "--out", tmp_path, "--follow", point)
        return code, " ".join(complained.split())

    code, complained = followed(f"3,3@{frame}")
    assert code == Exit.NOBODY
    assert f"nobody was tracked at 3,3@{frame}, but person 0 at " in complained
    place = complained.split("person 0 at ")[1].split("@")[0]
    u_px, _ = map(int, place.split(","))
    assert abs(u_px - mean_u_px(scene)[frame]) < 25
    code, complained = followed(f"{place}@{frame}")
    assert code == Exit.TRACKED and "nobody" not in complained
    around = f"{u_px - 40},100,80,300@{frame}"
    code, complained = followed(around)
    assert code == Exit.TRACKED and "nobody" not in complained
    code, complained = followed(f"0,0,9,9@{frame}")
    assert code == Exit.NOBODY and f"nobody was tracked at 0,0,9,9@{frame}, but person 0 at " in complained
    code, complained = followed(f"{place}@{last}")
    assert code == Exit.NOBODY and "nor anywhere in this frame, but person 0 (frames " in complained
    code, complained = followed(f"{place}@100000")
    assert code == Exit.NOBODY and f"the frames that were read are 0 to {last}:" in complained


def test_a_flickering_lamp_changes_little(scene):
    lamp = 1 + 0.3 * np.sin(2 * np.pi * 0.37 * np.arange(len(scene.frames)))
    frames = (scene.frames * lamp[:, None, None]).clip(0, 255).astype(np.uint8)
    steady, flickering = (tracked(f, scene, camera=scene.camera) for f in (scene.frames, frames))
    assert steady.summary["frames_relit"] == 0 < flickering.summary["frames_relit"]
    assert abs(len(flickering) - len(steady)) <= 3
    off_m = np.interp(flickering.columns["time_s"], scene.truth["time_s"], scene.truth["x_m"])
    assert np.sqrt(np.mean((flickering.columns["x_m"] - off_m) ** 2)) < 0.05
    assert any("brightness of the picture changes by up to" in said for said in flickering.sentences)
