"""Joint angles of postures, and postures without a calibrated camera."""

import math

import memo
import numpy as np
import pytest
from limb_angles import PLACE, angles_of, ankles_of
from memo.formats import read_motion
from test_posture import (
    FOCAL_PX,
    NOISE_PX,
    RATE_HZ,
    SIZE,
    errors_m,
    found,  # noqa: F401 (fixture)
    memo_posture,  # noqa: F401 (fixture)
    read_table,
    scene,  # noqa: F401 (fixture)
    walker,
)


def test_angles_are_those_of_the_smoothed_figures(found):  # noqa: F811
    expected = angles_of(found.smoothed_m)
    assert set(found.angles_deg) == set(expected) | {"right_ankle", "left_ankle"}
    for name, values in expected.items():
        own = found.angles_deg[name]
        # A knee that is hardly bent may bend to the front.
        own = np.where(own < 0, -own, own) if name.endswith("knee") else own
        assert np.allclose(own, values, atol=1e-5), name


def test_angles_are_those_the_walker_was_drawn_with(found):  # noqa: F811
    truth = angles_of(walker())
    for joint, most_deg in (("hip", 4), ("knee", 6), ("shoulder", 8), ("elbow", 12)):
        errors = [
            found.angles_deg[f"{side}_{joint}"] - truth[f"{side}_{joint}"] for side in ("right", "left")
        ]
        assert np.sqrt(np.mean(np.square(errors))) < most_deg, joint
    assert np.abs(truth["right_hip_adduction"]).max() < 1e-6


def test_missing_joints_have_no_angle(scene):  # noqa: F811
    folder, _ = scene
    keypoints = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ)
    for joint in ("right_wrist", "left_ankle"):
        keypoints.points[:, keypoints.names.index(joint)] = np.nan
    camera = memo.Camera.from_toml(folder / "camera.toml")
    angles = memo.posture(keypoints, camera, folder / "lengths.csv").angles_deg
    unknown = {name for name, values in angles.items() if np.isnan(values).all()}
    assert unknown == {"right_elbow", "left_knee", "right_ankle", "left_ankle"}


def test_toes_give_the_ankles(scene):  # noqa: F811
    """Feet that turn by 20 degrees, their toes outwards by 8, seen with and without noise."""
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    rng = np.random.default_rng(4)
    swing = np.radians(80 + 20 * np.sin(2 * math.pi * 0.9 * np.arange(len(truth)) / RATE_HZ))
    toes = []
    for side, outwards in (("right", 1), ("left", -1)):
        ankle, knee = (truth[:, PLACE[f"{side}_{joint}"]] for joint in ("ankle", "knee"))
        to_right = truth[:, PLACE["right_hip"]] - truth[:, PLACE["left_hip"]]
        to_right /= np.linalg.norm(to_right, axis=1, keepdims=True)
        down = (ankle - knee) / np.linalg.norm(ankle - knee, axis=1, keepdims=True)
        ahead = np.cross(to_right, down)
        foot = np.cos(swing)[:, None] * down + np.sin(swing)[:, None] * ahead
        toes.append(ankle + 0.17 * (foot + outwards * math.tan(math.radians(8)) * to_right))
    toes = np.stack(toes, axis=1)
    true = ankles_of(truth, toes)
    points = np.concatenate([truth, toes], axis=1)
    names = [*PLACE, "right_big_toe", "left_big_toe"]
    pixels = camera.project(points.reshape(-1, 3)).reshape(*points.shape[:2], 2)
    times_s = np.arange(len(truth)) / RATE_HZ
    for noise_px, most_deg in ((0.0, 6), (NOISE_PX, 9)):
        noisy = pixels + rng.normal(0, noise_px, pixels.shape)
        keypoints = memo.keypoints.Keypoints.from_arrays(noisy, names=names, times_s=times_s)
        found = memo.posture(keypoints, camera, folder / "lengths.csv", noise_px=max(noise_px, 0.5))  # noqa: F811
        own = ankles_of(found.smoothed_m, found.toes_m)
        for name, values in own.items():
            assert np.allclose(found.angles_deg[name], values, atol=1e-5), name
            rms_deg = np.sqrt(np.mean(np.square(values - true[name])))
            assert rms_deg < most_deg, (name, noise_px, rms_deg)


def test_the_table_has_them_and_opensim_gets_them(scene, tmp_path, memo_posture, memo_command):  # noqa: F811
    folder, _ = scene
    options = ("--camera", folder / "camera.toml", "--lengths", folder / "lengths.csv", "--no-plots")
    assert memo_posture(folder / "walk.csv", *options, "--fps", RATE_HZ, "--out", tmp_path)[0] == 0
    _, table = read_table(tmp_path / "postures.csv")
    assert memo_command("convert", tmp_path, tmp_path / "walk.mot")[0] == 0
    motion = read_motion(tmp_path / "walk.mot")
    assert np.allclose(motion.angles["right_hip"], np.array(table["right_hip_deg"], float), atol=1e-5)
    labels = (tmp_path / "walk.mot").read_text().split("endheader")[1].split()
    for label in (
        "hip_flexion_r",
        "hip_adduction_l",
        "knee_angle_r",
        "arm_flex_l",
        "arm_add_r",
        "pelvis_tilt",
    ):
        assert label in labels, labels[:40]


# Without a camera.


def uncalibrated(path, **options):
    keypoints = memo.read_keypoints(path, fps=RATE_HZ, image_size=SIZE)
    return memo.posture(keypoints, height_m=1.62, noise_px=NOISE_PX, **options)


def test_without_a_camera_the_figures_stay_and_distances_are_unsure(scene):  # noqa: F811
    folder, truth = scene
    true_fov = math.degrees(2 * math.atan(SIZE[0] / 2 / FOCAL_PX))
    own = uncalibrated(folder / "walk.csv", fov_deg=true_fov)
    assumed = uncalibrated(folder / "walk.csv")
    assert own.camera_assumed and assumed.summary["camera_assumed"]
    assert own.camera.position == (0, 0, 0) and not own.warnings
    # The camera looked down by four degrees, and the height is a guess from the lengths.
    for postures in (own, assumed):
        here = postures.smoothed_m - postures.smoothed_m[:, :1]
        there = truth - truth[:, :1]
        assert np.median(errors_m(here, there)) < 0.1
    true_m = np.linalg.norm(truth[:, 0] - [0, -5, 1.3], axis=1)
    for postures in (own, assumed):
        off = np.median(postures.anchor_m - true_m)
        assert abs(off) < 2.5 * np.median(postures.anchor_sd_m)
    # A field of view of 62 degrees in place of 60.
    ratio = math.tan(math.radians(true_fov / 2)) / math.tan(math.radians(31))
    assert np.median(assumed.anchor_m / own.anchor_m) == pytest.approx(ratio, rel=0.02)
    assert np.median(assumed.anchor_sd_m / assumed.anchor_m) > 0.18


def test_a_given_distance_needs_no_focal_length(scene):  # noqa: F811
    folder, _ = scene
    given = uncalibrated(folder / "walk.csv", distance_m=5.0, distance_sd_m=0.04)
    assert np.allclose(given.anchor_sd_m, 0.04)


def test_an_assumed_camera_needs_the_size_of_the_picture(scene, memo_posture, tmp_path):  # noqa: F811
    folder, _ = scene
    keypoints = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ)
    with pytest.raises(ValueError, match="size of the picture is needed"):
        memo.posture(keypoints, height_m=1.7)
    camera = memo.Camera.from_toml(folder / "camera.toml")
    with pytest.raises(ValueError, match="leave fov_deg out"):
        memo.posture(keypoints, camera, fov_deg=50.0)
    for fov_deg in (4.0, 171.0, math.nan):
        with pytest.raises(ValueError, match="fov_deg must be"):
            uncalibrated(folder / "walk.csv", fov_deg=fov_deg)
    walk = (folder / "walk.csv", "--fps", RATE_HZ, "--no-plots", "--out", tmp_path / "out")
    code, _, complaint = memo_posture(*walk)
    assert code == 1 and "--image-size" in complaint
    for options, wanted, reason in (
        (("--camera", folder / "camera.toml", "--fov-deg", 50), 2, "leave --fov-deg out"),
        (("--image-size", "1280x720", "--fov-deg", 3), 1, "not a field of view"),
        (("--image-size", "1280x720", "--camera-unit", "mm"), 2, "--camera-unit needs --camera"),
    ):
        code, _, complaint = memo_posture(*walk, *options)
        assert code == wanted and reason in complaint, complaint
    code, said, complaint = memo_posture(*walk, "--image-size", "1280x720", "--height", 1.62)
    assert code == 0 and "level one is assumed" in said, (said, complaint)


def test_a_size_that_contradicts_the_file_is_refused(scene, tmp_path):  # noqa: F811
    folder, _ = scene
    keypoints = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ, image_size=SIZE)
    assert keypoints.image_size == SIZE
    camera = memo.Camera.level((640, 480), 60, 1.2, 4.0)
    with pytest.raises(ValueError, match="640x480 pixels, the keypoints are for 1280x720"):
        memo.posture(keypoints, camera)


def test_an_upright_picture_is_taken_for_one_of_a_turned_camera(scene):  # noqa: F811
    folder, _ = scene
    upright = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ, image_size=(1280, 2276))
    (focal_px, *_), *_ = memo.posture(upright, height_m=1.62).camera.parameters()["matrix"]
    assert focal_px == pytest.approx(2276 / 2 / math.tan(math.radians(31)))


def test_a_plot_without_a_camera_has_no_ground(scene, found):  # noqa: F811
    folder, _ = scene
    plotted = [postures.plot() for postures in (found, uncalibrated(folder / "walk.csv"))]
    assert [ax.get_ylabel() for ax in plotted] == ["height, m", "height above the camera, m"]
    level = [[line for line in ax.lines if list(line.get_ydata()) == [0, 0]] for ax in plotted]
    assert [len(lines) for lines in level] == [1, 0]
