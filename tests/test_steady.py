"""A camera in the hand: its rotation against OpenCV's, and walks shaken and still."""

import csv
from types import SimpleNamespace

import cv2
import memo
import memo.video
import numpy as np
import pytest
from conftest import SHARED_DATA, shared_video
from memo import _memo
from memo.camera_motion import CameraMotion, outcome

SIZE = (320, 240)


def textured(seed):
    """A smooth random wall, larger than the picture."""
    wall = np.random.default_rng(seed).uniform(0, 255, (500, 600)).astype(np.float32)
    return cv2.GaussianBlur(wall, None, 2.0) * 4 - 380


def shot(wall, camera, turn_rad):
    """The wall through OpenCV: the picture of a camera turned by a rotation vector."""
    matrix = np.array(camera.parameters()["matrix"])
    turn = cv2.Rodrigues(np.array(turn_rad, float))[0]
    from_wall = matrix @ turn @ np.linalg.inv(matrix) @ np.array([[1, 0, -140], [0, 1, -130], [0, 0, 1.0]])
    seen = cv2.warpPerspective(wall, from_wall, SIZE, flags=cv2.INTER_CUBIC)
    noise = np.random.default_rng(5).normal(0, 1, seen.shape)
    return np.clip(seen + noise, 0, 255).astype(np.uint8)


def test_a_picture_turned_by_opencv_is_turned_back():
    camera = _memo.Camera.level(SIZE, 50.0, 1.0, 5.0)
    matrix, wall = np.array(camera.parameters()["matrix"]), textured(1)
    steadier = _memo.Steadier(camera)
    first = shot(wall, camera, [0, 0, 0])
    assert steadier.update(first).motion.state == "still"
    places = np.array([[[0, 0]], [[319, 0]], [[0, 239]], [[319, 239]], [[160, 120]]], float)
    for turn_rad in ([0.01, -0.015, 0.01], [-0.004, 0.02, -0.02]):
        steadied = steadier.update(shot(wall, camera, turn_rad))
        found = steadied.motion

        def moved(turn):
            rotation = cv2.Rodrigues(np.array(turn, float))[0]
            return cv2.perspectiveTransform(places, matrix @ rotation @ np.linalg.inv(matrix))

        off_px = np.linalg.norm(moved(found.turn_rad) - moved(turn_rad), axis=2).max()
        assert found.state == "turned" and off_px < 0.1, (off_px, found.turn_rad)
        seen = ~steadied.unseen
        differs = np.abs(steadied.picture.astype(int) - first)[seen]
        assert seen.mean() > 0.85 and differs.mean() < 3, differs.mean()


def test_a_cut_ends_in_a_sentence():
    camera = _memo.Camera.level(SIZE, 50.0, 1.0, 5.0)
    frames = [shot(textured(1 + (k >= 6)), camera, [0, 0, 0]) for k in range(14)]
    track = memo.track(frames, height_m=1.75, fps=25, camera=camera)
    assert track.summary["camera_motion"]["lost"] == [[6, "cut"]]
    assert any("frame 6 (a cut)" in sentence for sentence in track.sentences)
    given = memo.track(frames, height_m=1.75, fps=25, camera=camera, steady=False)
    assert given.camera_motion.rows == [] and given.camera_motion.sentences == []


def test_a_slow_zoom_is_reported():
    camera, wall = _memo.Camera.level(SIZE, 50.0, 1.0, 5.0), textured(1)
    first = shot(wall, camera, [0, 0, 0])
    frames = []
    for k in range(60):
        zoom = cv2.getRotationMatrix2D((159.5, 119.5), 0, 1 + 0.006 * k)
        frames.append(cv2.warpAffine(first, zoom, SIZE, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT))
    track = memo.track(frames, height_m=1.75, fps=25, camera=camera)
    assert track.camera_motion.moved or track.camera_motion.is_unexplained
    said = [sentence for sentence in track.sentences if "zoomed" in sentence or "another one" in sentence]
    assert said, (track.sentences, track.camera_motion.summary)


@pytest.mark.parametrize(
    ("states", "is_reported"),
    [
        (["still"] * 20, False),
        (["unknown"] * 20, False),  # before a plain wall nothing is known of the camera
        (["still"] * 19 + ["unknown"], False),
        (["still"] * 2 + ["unknown"] * 18, True),
        (["still", "turned"] * 5 + ["unknown"] * 10, True),
        (["still"] * 19 + ["turned"], False),
        (["uneven_light"] * 20, False),
        (["uneven_light"] * 10 + ["unknown"] * 10, True),
    ],
)
def test_frames_that_no_turn_explains_are_reported(states, is_reported):
    rows = [
        SimpleNamespace(frame=k, state=state, turn_rad=(0, 0, 0), shift_px=1.0, rms_px=0.5, support=0.5)
        for k, state in enumerate(states)
    ]
    motion = CameraMotion(rows)
    uneven = states.count("uneven_light")
    light = f"In {uneven} frames of 20 the light is another one from place to place"
    assert any(sentence.startswith(light) for sentence in motion.sentences) == bool(uneven)
    said = [sentence for sentence in motion.sentences if "the camera did more than turn" in sentence]
    assert motion.is_unexplained == is_reported and len(said) == is_reported
    turned = states.count("turned")
    assert turned != 1 or "Of 20 frames, 1 was turned back." in motion.sentences[0]
    limited = "in the frames that could be steadied, the picture shifts by up to 1.0 px"
    assert not turned or (limited in motion.sentences[0]) == is_reported


@pytest.mark.parametrize(
    ("states", "lost", "expected"),
    [
        ([], [], ""),  # not looked for
        (["unknown"] * 20, [], "still"),
        (["still"] * 20, [], "still"),
        (["still", "turned"] * 10, [], "steadied"),
        (["turned"] * 10 + ["unknown"] * 10, [], "beyond"),
        (["uneven_light"] * 20, [], "still"),
        (["still"] * 20, [SimpleNamespace(frame=3, reason="cut")], "beyond"),
    ],
)
def test_the_outcome_of_a_camera_s_motion(states, lost, expected):
    rows = [
        SimpleNamespace(frame=k, state=state, turn_rad=(0, 0, 0), shift_px=1.0, rms_px=0.5, support=0.5)
        for k, state in enumerate(states)
    ]
    assert outcome(CameraMotion(rows, lost).summary) == expected


def test_a_hand_held_recording_is_steadied():
    scene = SHARED_DATA / "people" / "shake3"
    if not scene.is_dir():
        pytest.skip("the recordings are not here")
    camera = memo.Camera.from_file(scene / "camera.toml")
    focal = camera.parameters()["matrix"][0][0]
    steadier = _memo.Steadier(camera)
    with open(scene / "camera_motion.csv") as file, memo.video.VideoReader(scene / "video.mp4") as video:
        off_px = []
        for frame, row in zip(video, csv.DictReader(file), strict=True):
            found = steadier.update(frame.luma).motion
            yaw, pitch, roll = (float(row[name]) for name in ("u_px", "v_px", "roll_rad"))
            about = [
                cv2.Rodrigues(np.array(turn, float))[0]
                for turn in ([0, 0, roll], [pitch / focal, 0, 0], [0, yaw / focal, 0])
            ]
            rest = cv2.Rodrigues(
                cv2.Rodrigues(np.array(found.turn_rad))[0].T @ about[0] @ about[1] @ about[2]
            )
            off_px.append(focal * np.linalg.norm(rest[0]))
    assert np.sqrt(np.mean(np.square(off_px))) < 0.15 and steadier.losses() == []


def test_a_cut_between_rooms_that_look_alike_ends_the_view():
    """Both have brick walls of the same brightness; the second has another camera and another person."""
    folders = [shared_video("mocap_a"), SHARED_DATA / "people" / "diagonal"]
    if not folders[1].is_dir():
        pytest.skip(f"no {folders[1]}")
    frames = []
    for folder, count in zip(folders, (45, 40), strict=True):
        with memo.video.VideoReader(folder / "video.mp4") as reader:
            frames += [frame.luma.copy() for frame, _ in zip(reader, range(count), strict=False)]
    camera = memo.Camera.from_toml(folders[0] / "camera.toml")
    track = memo.track(frames, fps=25, camera=camera, height_m=1.86)
    assert "The view changes at frame 45 (a cut)." in track.sentences[0]
    assert len(track.walks) == 1 and track.columns["frame"].max() < 45
