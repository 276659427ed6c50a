"""A walk fitted again to pictures of one's own: frames, silhouettes, pictures of nobody; what is refused."""

import pickle

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA
from memo.files import TRACK_COLUMNS
from memo.video import VideoReader

SEED = 0


@pytest.fixture(scope="module")
def scene():
    return memo.demo_scene(SEED, frames=90)


@pytest.fixture(scope="module")
def walk(scene):
    (walk,) = memo.track(list(scene.frames), fps=25, camera=scene.camera, height_m=scene.height_m).walks
    return walk


@pytest.fixture(scope="module")
def empty(scene):
    """The room without the person, who is nowhere for half of the frames."""
    return np.median(scene.frames, axis=0).astype(np.uint8)


@pytest.fixture(scope="module")
def silhouettes(scene, empty):
    return ((np.abs(scene.frames.astype(int) - empty) > 14) * 255).astype(np.uint8)


def off_deg(walk, scene):
    """Root mean square errors of hip and knee over both sides."""
    true_row = {frame: row for row, frame in enumerate(scene.truth["frame"].tolist())}
    rows = [true_row[frame] for frame in walk.columns["frame"].tolist()]
    off = {
        joint: [
            walk.columns[f"{side}_{joint}_deg"] - scene.truth[f"{side}_{joint}_deg"][rows]
            for side in ("right", "left")
        ]
        for joint in ("hip", "knee")
    }
    return {joint: np.sqrt(np.nanmean(np.square(values))) for joint, values in off.items()}


def test_the_same_frames_give_the_same_person(scene, walk):
    again = memo.fit_walk(walk, scene.frames)
    for name in ("right_hip_deg", "left_knee_deg", "x_m"):
        assert np.nanmax(np.abs(again.columns[name] - walk.columns[name])) < 0.5
    assert again.fit.residual_px == pytest.approx(walk.fit.residual_px, rel=0.02)
    assert again.fit.lengths_m == pytest.approx(walk.fit.lengths_m, rel=0.005)


def test_silhouettes_measure_the_person(scene, walk, empty, silhouettes):
    again = memo.fit_walk(walk, silhouettes, empty=np.zeros_like(empty))
    off = off_deg(again, scene)
    assert off["hip"] < 3 and off["knee"] < 5
    # They are other evidence, and the walk that was given is as it was.
    assert np.nanmax(np.abs(again.columns["right_knee_deg"] - walk.columns["right_knee_deg"])) > 0.1
    assert again is not walk and again.fit.verdict != "poorly"


def test_silhouettes_keep_noise_from_the_fit(scene, walk, empty, silhouettes):
    noisy = np.clip(scene.frames + np.random.default_rng(SEED).normal(0, 40, scene.frames.shape), 0, 255)
    poor = memo.fit_walk(walk, noisy.astype(np.uint8), empty=empty)
    clean = off_deg(memo.fit_walk(walk, silhouettes, empty=np.zeros_like(empty)), scene)
    assert poor.fit is None or off_deg(poor, scene)["knee"] > clean["knee"]


def test_options_count(scene, walk):
    stiff = memo.fit_walk(walk, scene.frames, frame_sd_deg=0.01)
    free = memo.fit_walk(walk, scene.frames, frame_sd_deg=10)
    sd = [np.nanmean(fitted.columns["sd_right_knee_deg"]) for fitted in (stiff, free)]
    assert sd[0] < sd[1]


def test_pictures_of_nobody_leave_a_reason(scene, walk, empty):
    again = memo.fit_walk(walk, [empty] * len(scene.frames), empty=empty)
    assert again.fit is None and again.fit_problem
    assert len(again) == len(walk) and np.all(np.isnan(again.columns["sd_right_hip_deg"]))


@pytest.mark.parametrize("level", [0, 90], ids=["black", "grey"])
def test_pictures_without_any_edge_are_no_fit(scene, walk, level):
    """Nothing is missed of an outline of which nothing could be seen."""
    again = memo.fit_walk(walk, np.full_like(scene.frames, level))
    assert again.fit is None and again.fit_problem


def test_silhouettes_of_zeros_and_ones_are_no_fit(scene, walk, empty, silhouettes):
    again = memo.fit_walk(walk, silhouettes // 255, empty=np.zeros_like(empty))
    assert again.fit is None


def test_a_foot_that_is_never_seen_has_no_contacts(scene, walk, empty):
    """The left shank and foot are painted over with the room in every frame."""
    rows = walk.columns["frame"]
    frames = np.array(scene.frames)
    height, width = empty.shape
    columns, lines = np.arange(width), np.arange(height)
    for k, frame in enumerate(rows):
        knee, ankle = (
            [walk.columns[f"left_{joint}_{axis}_px"][k] for axis in "uv"] for joint in ("knee", "ankle")
        )
        below = lines >= knee[1]
        for line in lines[below]:
            share = min(1.0, (line - knee[1]) / max(ankle[1] - knee[1], 1.0))
            middle = knee[0] + share * (ankle[0] - knee[0])
            hidden = np.abs(columns - middle) < (14 if share < 0.9 else 34)
            frames[frame, line, hidden] = empty[line, hidden]
    seen = memo.fit_walk(walk, scene.frames)
    hidden = memo.fit_walk(walk, frames, empty=empty)
    sides = [{event.side for event in of.events} for of in (seen, hidden)]
    assert sides[0] == {"right", "left"}
    assert "left" not in sides[1]


def test_angles_of_a_person_who_was_not_measured_are_empty(scene, empty):
    track = memo.track(list(scene.frames), fps=25, camera=scene.camera, height_m=scene.height_m)
    lost = memo.Track([memo.fit_walk(track.walks[0], [empty] * len(scene.frames))], track.seek_report)
    assert len(lost) == len(track)
    for columns in (lost.columns, lost.walks[0].columns):
        assert all(np.isnan(columns[name]).all() for name in TRACK_COLUMNS if name.endswith("_deg"))
    for kept in ("x_m", "phase", "right_knee_x_m"):  # the result of the tracker
        assert np.isfinite(lost.columns[kept]).all()


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"frames": 30}, "the walk goes on to frame 89, but there are fewer frames"),
        ({"rows": 479}, "pictures must be 640x480 like the frames, got 640x479"),
        ({"empty_rows": 479}, "pictures must be 640x480 like the frames, got 640x479"),
        ({"height_sd": 0.0}, "height_sd must be positive and finite, got 0"),
        ({"frame_sd_deg": -1.0}, "frame_sd_deg must be positive and finite, got -1"),
        ({"frame_sd_deg": float("nan")}, "frame_sd_deg must be positive and finite, got NaN"),
    ],
)
def test_what_does_not_fit_the_walk_is_refused(scene, walk, empty, change, complaint):
    frames = scene.frames[: change.pop("frames", None), : change.pop("rows", None)]
    empty = empty[: change.pop("empty_rows", None)]
    with pytest.raises(ValueError, match=complaint):
        memo.fit_walk(walk, frames, empty=empty, **change)


def test_colour_is_refused(scene, walk):
    with pytest.raises(ValueError, match="wanted a grey frame"):
        memo.fit_walk(walk, np.repeat(scene.frames[..., None], 3, axis=3))


def test_a_walk_of_another_process_is_refused(scene, walk):
    with pytest.raises(RuntimeError, match="another process"):
        memo.fit_walk(pickle.loads(pickle.dumps(walk)), scene.frames)


def refitted(frames, walk):
    """The same walk fitted again to its own frames, and how far its knees move by that, degrees."""
    again = memo.fit_walk(walk, frames)
    assert again.fit is not None, again.fit_problem
    moved = [
        again.columns[f"{side}_knee_deg"] - walk.columns[f"{side}_knee_deg"] for side in ("right", "left")
    ]
    return again, float(np.sqrt(np.nanmean(np.square(moved))))


def test_a_walk_on_a_treadmill_is_fitted_again():
    scene = memo.demo_scene(2, frames=120, mover="treadmill")
    (walk,) = memo.track(scene.frames, fps=25, camera=scene.camera, height_m=scene.height_m).walks
    again, moved_deg = refitted(scene.frames, walk)
    assert moved_deg < 0.2
    assert again.treadmill.belt_mps == pytest.approx(walk.treadmill.belt_mps, rel=0.05)


def shared_scene(name):
    folder = SHARED_DATA / "people" / name
    if not folder.is_dir():
        pytest.skip(f"no scene in {folder} (set MEMO_SHARED_DATA)")
    with VideoReader(folder / "video.mp4") as reader:
        frames = [frame.luma.copy() for frame in reader]
    return frames, memo.Camera.from_toml(folder / "camera.toml")


def test_pictures_of_a_camera_in_the_hand_are_turned_back():
    frames, camera = shared_scene("shake3")
    (walk,) = memo.track(frames, fps=25, camera=camera, height_m=1.84).walks
    _, moved_deg = refitted(frames, walk)
    assert moved_deg < 0.1


def test_each_of_several_people_is_fitted_again():
    """Other people are taken for part of the scene, so who is covered by them is measured otherwise."""
    frames, camera = shared_scene("cross2")
    walks = memo.track(frames, fps=25, camera=camera, height_m=[1.62, 1.84]).walks
    assert len(walks) == 2
    for walk in walks:
        again, moved_deg = refitted(frames, walk)
        assert moved_deg < 0.5 and again.person == walk.person
