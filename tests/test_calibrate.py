"""`memo calibrate` and what it calls, against planted cameras, OpenCV and recorded scenes."""

import json
import re
import tomllib

import memo
import numpy as np
import pytest
from conftest import opencv_pixels, shared_video
from memo.calibration import board_places, draw_ground, read_picture, write_picture
from memo.keypoints.points import layouts

cv2 = pytest.importorskip("cv2")

SIZE = (1280, 720)


def look_at(position, target, roll_deg=0.0):
    """Rotation and translation of a camera, OpenCV axes."""
    forward = np.subtract(target, position)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    a = np.radians(roll_deg)
    rotation = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]) @ rotation
    return rotation, -rotation @ position


def project(points, focal, pose, k=(0, 0), centre=(639.5, 359.5)):
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    pixels, _ = cv2.projectPoints(
        np.asarray(points, float), cv2.Rodrigues(pose[0])[0], pose[1], matrix, np.array([*k, 0, 0], float)
    )
    return pixels.reshape(-1, 2)


def spread(count, seed=0):
    return np.random.default_rng(seed).uniform([-2, -1.5, 0], [2, 2, 2], (count, 3))


POSE = look_at(np.array([1.5, -6.0, 1.6]), np.array([0.0, 0.0, 0.9]), 1.0)


# Points.


@pytest.mark.parametrize("count", [6, 8, 30])
def test_a_planted_camera_is_recovered(count):
    places = spread(count)
    found = memo.calibrate_points(places, project(places, 1100, POSE), SIZE)
    assert found.estimates["focal_px"][0] == pytest.approx(1100, abs=1e-3)
    np.testing.assert_allclose(found.camera.position, [1.5, -6.0, 1.6], atol=1e-5)
    assert found.outliers == [] and set(found.estimates) == {"focal_px", "x_m", "y_m", "z_m"}


def test_what_the_points_ask_for_is_fitted():
    places = spread(40)
    pixels = project(places, 1100, POSE, k=(-0.25, 0.0), centre=(610.0, 380.0))
    pixels += np.random.default_rng(1).normal(0, 0.3, pixels.shape)
    estimates = memo.calibrate_points(places, pixels, SIZE).estimates
    for name, planted in {"focal_px": 1100, "centre_u_px": 610, "centre_v_px": 380, "k1": -0.25}.items():
        value, sd = estimates[name]
        assert abs(value - planted) < 4 * sd, name


def test_a_plane_and_a_known_focal_length():
    floor = np.array([[x, y, 0.0] for x in (-1.5, 0, 1.5) for y in (-1.0, 1.0, 3.0)])
    found = memo.calibrate_points(floor, project(floor, 1100, POSE), SIZE)
    assert found.is_planar
    np.testing.assert_allclose(found.camera.position, [1.5, -6.0, 1.6], atol=1e-4)
    corners = floor[[0, 2, 6, 8]]
    found = memo.calibrate_points(corners, project(corners, 1100, POSE), SIZE, focal_px=1100.0)
    np.testing.assert_allclose(found.camera.position, [1.5, -6.0, 1.6], atol=1e-4)


def test_poses_are_those_of_opencv(tmp_path):
    """Least squares with a known lens: the same minimum as solvePnP refined by Levenberg and Marquardt."""
    places = spread(20, seed=5)
    matrix, lens = np.array([[1100, 0, 630], [0, 1090, 350], [0, 0, 1.0]]), np.array([-0.2, 0.03, 0.001, 0.0])
    rvec = cv2.Rodrigues(POSE[0])[0]
    pixels = cv2.projectPoints(places, rvec, POSE[1], matrix, lens)[0].reshape(-1, 2)
    pixels += np.random.default_rng(2).normal(0, 0.5, pixels.shape)
    _, rvec, tvec = cv2.solvePnP(places, pixels, matrix, lens, flags=cv2.SOLVEPNP_ITERATIVE)
    rvec, tvec = cv2.solvePnPRefineLM(places, pixels, matrix, lens, rvec, tvec)
    theirs = (-cv2.Rodrigues(rvec)[0].T @ tvec).ravel()
    path = tmp_path / "lens.json"
    path.write_text(json.dumps({"size": SIZE, "K": matrix.tolist(), "D": lens.tolist()}))
    known = memo.Camera.from_file(path, lens_only=True)
    ours = memo.calibrate_points(places, pixels, SIZE, lens=known)
    sd = [ours.estimates[name][1] for name in ("x_m", "y_m", "z_m")]
    # Ours are residuals before the lens, theirs behind it: a tenth of the deviation apart at most.
    assert (np.abs(np.array(ours.camera.position) - theirs) < 0.2 * np.array(sd)).all()


def test_deviations_are_those_of_repetition():
    places = spread(15, seed=4)
    exact = project(places, 1100, POSE)
    random = np.random.default_rng(0)
    values, deviations = [], []
    for _ in range(60):
        found = memo.calibrate_points(places, exact + random.normal(0, 1.0, exact.shape), SIZE)
        if "centre_u_px" in found.estimates or "k1" in found.estimates or found.outliers:
            continue
        values.append([found.estimates[name][0] for name in ("focal_px", "x_m", "y_m", "z_m")])
        deviations.append([found.estimates[name][1] for name in ("focal_px", "x_m", "y_m", "z_m")])
    assert len(values) > 45
    ratio = np.std(values, axis=0) / np.sqrt(np.mean(np.square(deviations), axis=0))
    assert ((ratio > 0.7) & (ratio < 1.3)).all(), ratio


def test_a_mistaken_point_is_left_out():
    places = spread(12)
    pixels = project(places, 1100, POSE) + np.random.default_rng(0).normal(0, 0.5, (12, 2))
    pixels[4] += [60, -25]
    found = memo.calibrate_points(places, pixels, SIZE)
    assert found.outliers == [4]
    assert np.hypot(*found.residuals_px[4]) == pytest.approx(65, abs=6)


def test_faults_say_what_is_missing():
    places, pixels = spread(8), project(spread(8), 1100, POSE)

    def refused(places, pixels, reason, **options):
        with pytest.raises(ValueError, match=reason):
            memo.calibrate_points(np.ascontiguousarray(places), np.ascontiguousarray(pixels), SIZE, **options)

    refused(places[:5], pixels[:5], "5 points: 6 are needed, or 4 if all lie in one plane")
    refused(places[:3], pixels[:3], "3 points: 6 are needed")
    line = np.linspace(0, 1, 8)[:, None] * [1.0, 0.5, 0.2]
    refused(line, project(line, 1100, POSE), "on one line")
    refused(places, np.full((8, 2), [5.0, 6.0]), "pixels lie on one line")
    refused(places * [-1, 1, 1], pixels, "mirrored picture")
    floor = np.array([[x, y, 0.0] for x in (-1.5, 0, 1.5) for y in (-1.0, 1.0, 3.0)])
    refused(floor * [1, -1, 1], project(floor, 1100, POSE), "mirrored picture")
    refused(places[::-1], pixels, "no camera shows the points|mirrored picture")
    broken = pixels.copy()
    broken[3, 1] = np.nan
    refused(places, broken, "point 3: v_px must be finite")
    refused(np.vstack([places[:7], places[:1]]), pixels, "points 0 and 7 have the same place")
    wall = np.array([[x, 0.0, z] for x in (-1, 0, 1) for z in (0.2, 1, 1.8)])
    head_on = look_at(np.array([0, -6.0, 1.0]), np.array([0, 0, 1.0]))
    refused(wall, project(wall, 1100, head_on), "do not tell focal length from distance")
    found = memo.calibrate_points(wall, project(wall, 1100, head_on), SIZE, focal_px=1100.0)
    np.testing.assert_allclose(found.camera.position, [0, -6, 1], atol=1e-4)
    refused(places, pixels, "focal length must be positive", focal_px=-1.0)


def test_points_from_the_command_line(memo_command, tmp_path):
    places = spread(10)
    pixels = project(places, 1100, POSE) + np.random.default_rng(0).normal(0, 0.4, (10, 2))
    pixels[7] += 80
    table = tmp_path / "points.csv"
    rows = np.column_stack([places, pixels])
    np.savetxt(table, rows, delimiter=",", header="x_m,y_m,z_m,u_px,v_px", comments="")
    out = tmp_path / "out"
    code, said, _ = memo_command("calibrate", "points", table, "--size", "1280x720", "--out", out)
    assert code == 0 and "Left out" in said and "line 9 (1" in said and "A 1.7 m person is" in said
    assert read_picture(out / "ground.png").shape == (720, 1280)
    section = tomllib.loads((out / "camera.toml").read_text())["cam"]
    ours = memo.Camera.from_file(out / "camera.toml").project(places)
    np.testing.assert_allclose(ours, opencv_pixels(section, places), atol=1e-9, rtol=0)
    code, said, _ = memo_command(
        "calibrate", "points", table, "--size", "1280x720", "--out", out, "--json", "--fov-deg", "60.4"
    )
    assert code == 0 and json.loads(said)["left_out_lines"] == [9]
    for content, reason in {
        "x_m,y_m,z_m,u_px\n1,2,3,4\n": "line 1: missing columns v_px",
        "x_m,y_m,z_m,u_px,v_px\n1,2,3,4,nan\n": "line 2: v_px must be a finite number, got 'nan'",
        "x_m,y_m,z_m,u_px,v_px\n1,2,3,4\n": "line 2: v_px must be a finite number, got None",
        "": "line 1: missing columns",
        "x_m;y_m;z_m;u_px;v_px\n1;2;3;4;5\n": "line 1: missing columns .*; columns must be separated by",
        "x_m,y_m,z_m,u_px,v_px\n1,2,3,2000,5\n": "1 of 1 point outside a picture of 1280x720 pixels",
        "x_m,y_m,z_m,u_px,v_px\n0,0,0,9,5\n0,2e3,0,9,9\n": "x_m, y_m and z_m are spread over 2000 m: are",
    }.items():
        table.write_text(content)
        code, _, complaint = memo_command("calibrate", "points", table, "--size", "1280x720", "--out", out)
        assert code == 1 and re.search(f"points.csv: {reason}", complaint) and complaint.count("\n") == 1
    code, _, complaint = memo_command("calibrate", "points", tmp_path, "--size", "1280x720", "--out", out)
    assert code == 1 and f"{tmp_path}: cannot be read: Is a directory" in complaint
    code, _, complaint = memo_command("calibrate", "points", table, "--out", out)
    assert code == 1 and "give --size WxH or --picture" in complaint


# A walker.

HIGH = look_at(np.array([0.0, -8.0, 4.0]), np.array([0.0, 0.0, 0.5]))


def walked(places, focal, pose, height_m=1.75, noise_px=0.0, seed=0):
    random = np.random.default_rng(seed)
    feet = project(np.column_stack([places, np.zeros(len(places))]), focal, pose)
    heads = project(np.column_stack([places, np.full(len(places), height_m)]), focal, pose)
    return feet + random.normal(0, noise_px, feet.shape), heads + random.normal(0, noise_px, heads.shape)


def round_walk(count=60):
    turn = np.linspace(0, 2 * np.pi, count)
    return np.column_stack([2.5 * np.cos(turn), 3.0 * np.sin(turn)])


def test_a_walk_near_and_far_tells_the_camera():
    found = memo.calibrate_walker(*walked(round_walk(), 1100, HIGH), SIZE, 1.75)
    estimates = found.estimates
    assert estimates["focal_px"][0] == pytest.approx(1100, rel=1e-3)
    assert estimates["height_m"][0] == pytest.approx(4.0, rel=1e-3)
    assert estimates["pitch_deg"][0] == pytest.approx(np.degrees(np.arctan2(3.5, 8)), abs=0.02)
    # Distances between places are those walked, whatever the axes.
    places = found.places[:, :2]
    apart = np.linalg.norm(places[:30] - places[30:], axis=1)
    np.testing.assert_allclose(
        apart, np.linalg.norm(round_walk()[:30] - round_walk()[30:], axis=1), rtol=1e-4
    )


def test_walker_deviations_are_those_of_repetition():
    values, deviations = [], []
    for seed in range(60):
        found = memo.calibrate_walker(
            *walked(round_walk(40), 1100, HIGH, noise_px=1.5, seed=seed), SIZE, 1.75
        )
        values.append([found.estimates[name][0] for name in ("focal_px", "pitch_deg", "height_m")])
        deviations.append([found.estimates[name][1] for name in ("focal_px", "pitch_deg", "height_m")])
    ratio = np.std(values, axis=0) / np.sqrt(np.mean(np.square(deviations), axis=0))
    assert ((ratio > 0.7) & (ratio < 1.3)).all(), ratio
    assert abs(np.mean(values, axis=0)[0] - 1100) < 25


def test_what_a_walk_does_not_tell_is_said():
    across = np.column_stack([np.linspace(-2, 2, 40), np.zeros(40)])
    level = look_at(np.array([0.0, -7.0, 1.2]), np.array([0.0, 0.0, 1.2]))
    feet, heads = walked(across, 1100, level, noise_px=0.5)
    with pytest.raises(ValueError, match=r"does not tell the focal length.*give the field of view"):
        memo.calibrate_walker(feet, heads, SIZE, 1.75)
    found = memo.calibrate_walker(feet, heads, SIZE, 1.75, focal_px=1100.0)
    assert found.estimates["height_m"][0] == pytest.approx(1.2, abs=0.1)
    assert abs(found.estimates["pitch_deg"][0]) < 1.0
    for arguments, reason in {
        (1.0, 0, 3): "3 sightings of the whole person.*4 are needed",
        (75.0, 0, 40): "height must be 0.5 to 2.5",
        (1.75, 1, 40): "the head is not above the feet",
    }.items():
        height, swapped, count = arguments
        ends = (heads, feet) if swapped else (feet, heads)
        with pytest.raises(ValueError, match=reason):
            memo.calibrate_walker(ends[0][:count], ends[1][:count], SIZE, height)
    broken = heads.copy()
    broken[5] = np.inf
    with pytest.raises(ValueError, match="sighting 5"):
        memo.calibrate_walker(feet, broken, SIZE, 1.75)


def test_wrong_detections_are_left_out():
    feet, heads = walked(round_walk(), 1100, HIGH, noise_px=1.0)
    heads[[7, 20, 41]] += [[30, -60], [-45, 80], [100, 0]]
    found = memo.calibrate_walker(feet, heads, SIZE, 1.75)
    assert {7, 20, 41} <= set(found.outliers) and len(found.outliers) < 6
    assert found.estimates["focal_px"][0] == pytest.approx(1100, rel=0.1)


def pets_boxes(person):
    """Boxes of one person in the middle of the picture, and the published camera."""
    folder = shared_video("pets09_s2l1")
    rows = np.loadtxt(folder / "gt.txt", delimiter=",")
    u, v, w, h = rows[rows[:, 1] == person][:, 2:6].T
    inside = (u > 5) & (u + w < 763) & (v > 5) & (v + h < 571)
    feet, heads = np.column_stack([u + w / 2, v + h])[inside] - 1, np.column_stack([u + w / 2, v])[inside] - 1
    return np.ascontiguousarray(feet), np.ascontiguousarray(heads), folder


def test_pets_from_annotated_boxes():
    """Boxes of several people of unknown heights, 53 to 153 px, from 7 m above: hard for all else."""
    ends = zip(*(pets_boxes(person)[:2] for person in (1, 9, 15, 19)), strict=True)
    feet, heads = (np.concatenate(points) for points in ends)
    true = memo.Camera.from_file(pets_boxes(15)[2] / "View_001.xml")
    with pytest.raises(ValueError, match="does not tell the focal length"):
        memo.calibrate_walker(*pets_boxes(15)[:2], (768, 576), 1.75)
    found = memo.calibrate_walker(feet, heads, (768, 576), 1.75, focal_px=1190.0)
    assert found.camera.position[2] == pytest.approx(true.position[2], rel=0.12)
    pixels = [(u, v) for u, v in feet.tolist()]
    ours, published = found.camera.ground_points(pixels), true.ground_points(pixels)
    apart = [np.linalg.norm(places[:-40] - places[40:], axis=1) for places in (ours, published)]
    print(found.estimates, np.median(apart[0] / apart[1]), np.std(apart[0] / apart[1]))
    assert np.median(apart[0] / apart[1]) == pytest.approx(1, abs=0.15)


@pytest.mark.parametrize(
    ("name", "height_m"), [("mocap_a", 1.86), ("mocap_b", 1.66), ("mocap_c_yaw25", 1.61)]
)
def test_recorded_walks_one_way_tell_little(memo_command, tmp_path, name, height_m):
    """People lean, and only coming back tells by how much: refused, or the deviations hold the errors."""
    folder = shared_video(name)
    true = memo.Camera.from_file(folder / "camera.toml")
    section = tomllib.loads((folder / "camera.toml").read_text())["cam"]
    fov_deg = 2 * np.degrees(np.arctan(section["size"][0] / 2 / section["matrix"][0][0]))
    arguments = ("calibrate", "walker", folder / "video.mp4", "--height", height_m, "--out", tmp_path)
    code, _, complaint = memo_command(*arguments)
    assert code == 1 and "does not tell" in complaint
    code, said, complaint = memo_command(*arguments, "--fov-deg", fov_deg, "--json")
    if code == 0:
        estimates = json.loads(said)["estimates"]
        looks_down_deg = np.degrees(np.linalg.norm(section["rotation"][:1])) - 90  # no roll, no yaw
        for what, truth in [("height_m", true.position[2]), ("pitch_deg", looks_down_deg), ("roll_deg", 0)]:
            found = estimates[what]
            assert abs(found["value"] - truth) < 2 * found["sd"], (what, found, truth)
    else:
        assert "does not tell how far the camera looks down" in complaint


def test_keypoints_are_taken_where_the_ankles_pass(tmp_path):
    names = ["nose", "right_ear", "left_ear", "right_ankle", "left_ankle"]
    points = np.zeros((60, 5, 2))
    swing = np.cos((np.arange(60) + 0.5) / 60 * 12 * np.pi)
    points[:, 0], points[:, 1], points[:, 2] = [105, 55], [100, 50], [102, 50]
    points[:, 3] = np.column_stack([100 + 60 * swing, np.full(60, 290)])
    points[:, 4] = np.column_stack([100 - 60 * swing, np.full(60, 294)])
    feet, heads, foot_share, head_share = memo.walker_sightings(names, points)
    assert len(feet) == 12
    np.testing.assert_allclose(feet, [[100, 294]] * 12)
    np.testing.assert_allclose(heads, [[101, 50]] * 12)
    assert set(foot_share) == {0.042} and set(head_share) == {0.926}
    points[:, 1:3] = np.nan
    assert set(memo.walker_sightings(names, points)[3]) == {0.91}


def seen_walker(layout, pose, height_m=1.75, frames=300, noise_px=2.0):
    """Keypoints of somebody who walks an oval before a camera of 1100 px.

    Ears at 0.926 and standing ankles at 0.042 of the height, as calibration takes them; the ankles swing.
    """
    turn = np.arange(frames) * 0.02
    middle = np.column_stack([2.0 * np.cos(turn), 2.5 * np.sin(turn), 0 * turn])
    forward = np.column_stack([-2.0 * np.sin(turn), 2.5 * np.cos(turn), 0 * turn])
    forward /= np.linalg.norm(forward, axis=1)[:, None]
    left, up = np.cross([0.0, 0.0, 1.0], forward), np.array([0.0, 0.0, 1.0])
    stride = np.arange(frames) / 25 * 2 * np.pi * 0.9
    sway = 0.02 * (np.cos(2 * stride) - 1)[:, None] * up
    body = {"nose": (0.91, 0.0, 0.11), "neck": (0.82, 0.0, 0.0), "mid_hip": (0.53, 0.0, 0.0)}
    sides = {"ear": (0.926, 0.07, 0), "eye": (0.936, 0.03, 0.1), "shoulder": (0.82, 0.19, 0)}
    sides |= {"elbow": (0.63, 0.22, 0), "wrist": (0.48, 0.22, 0.1), "hip": (0.53, 0.09, 0)}
    for side, sign in (("right", -1), ("left", 1)):
        body |= {f"{side}_{name}": (at, sign * out, on) for name, (at, out, on) in sides.items()}
    seen = {
        name: middle + at * height_m * up + sway + out * left + on * forward
        for name, (at, out, on) in body.items()
    }
    for side, sign in (("right", -1), ("left", 1)):
        swing = sign * np.sin(stride), np.maximum(0, -sign * np.cos(stride))
        ankle = middle + 0.042 * height_m * up + sign * 0.05 * left
        ankle = ankle + 0.33 * swing[0][:, None] * forward + 0.1 * swing[1][:, None] * up
        seen[f"{side}_ankle"] = ankle
        seen[f"{side}_knee"] = (ankle + seen[f"{side}_hip"]) / 2 + 0.05 * forward
    names = layouts()[layout]
    missing = np.full((frames, 2), np.nan)
    points = [project(seen[name], 1100, pose) if name in seen else missing for name in names]
    noise = np.random.default_rng(0).normal(0, noise_px, (frames, len(names), 2))
    return memo.Keypoints.from_arrays(np.stack(points, axis=1) + noise, names=layout, fps=25.0)


@pytest.mark.parametrize(
    ("layout", "written", "name"),
    [("BODY_25", "openpose", "walk_json"), ("COCO_17", "coco", "walk.json"), ("BODY_25", "csv", "walk.csv")],
)
def test_a_tilted_camera_from_keypoints_of_a_detector(memo_command, tmp_path, layout, written, name):
    pose = look_at(np.array([0.0, -7.0, 3.0]), np.array([0.0, 0.0, 0.8]), 1.0)
    truth = {"focal_px": 1100, "pitch_deg": np.degrees(np.arctan2(2.2, 7)), "roll_deg": 1.0, "height_m": 3.0}
    memo.write_keypoints(tmp_path / name, seen_walker(layout, pose), written)
    arguments = ("calibrate", "walker", tmp_path / name, "--height", 1.75, "--out", tmp_path / "out")
    code, said, _ = memo_command(*arguments, "--size", "1280x720", "--json")
    assert code == 0
    summary = json.loads(said)
    assert 15 < summary["sightings"] < 40  # where the ankles pass each other
    for estimate, value in truth.items():
        found = summary["estimates"][estimate]
        assert abs(found["value"] - value) < 2.5 * found["sd"], (estimate, found)
        assert found["sd"] < {"focal_px": 40, "pitch_deg": 0.5, "roll_deg": 0.3, "height_m": 0.05}[estimate]
    camera = memo.Camera.from_file(tmp_path / "out" / "camera.toml")
    assert abs(camera.position[2] - 3.0) < 0.1
    code, _, complaint = memo_command(*arguments, "--size", "720x1280")
    assert code == 1 and "outside a picture of 720x1280 pixels" in complaint and complaint.count("\n") == 1


def test_a_video_has_its_own_size(memo_command, tmp_path):
    video = shared_video("mocap_a") / "video.mp4"
    arguments = ("calibrate", "walker", video, "--height", 1.86, "--out", tmp_path)
    code, _, complaint = memo_command(*arguments, "--size", "1280x960")
    assert code == 1 and "1280x960 and 640x480 pixels" in complaint
    code, _, complaint = memo_command(*arguments, "--layout", "BODY_25")
    assert code == 1 and "--layout: has no meaning for a video" in complaint


def test_points_are_taken_as_numpy_takes_them():
    camera = memo.Camera.level(SIZE, 60, 1.2, 5.0)
    pixels = np.array([[600, 500], [100, 650]])
    ground = camera.ground_points(pixels)
    assert ground.shape == (2, 3)
    for same in (pixels.astype(np.float32), pixels.tolist(), [tuple(pixel) for pixel in pixels], pixels[::1]):
        np.testing.assert_array_equal(camera.ground_points(same), ground)
    np.testing.assert_array_equal(camera.ground_points(np.fliplr(pixels)[:, ::-1]), ground)
    np.testing.assert_allclose(camera.project(ground.tolist()), pixels, atol=1e-9)
    assert camera.ground_points(np.empty((0, 2))).shape == (0, 3)
    assert np.isnan(camera.ground_points([[np.nan, 500.0]])).all()
    for wrong in (np.zeros((2, 3)), np.zeros(3), np.float64(1.0)):
        with pytest.raises(ValueError, match=r"wanted pixels: numpy array of shape \(\.\.\., 2\); got"):
            camera.ground_points(wrong)
    for wrong in ([[1.0, 2.0], [3.0]], [["a", "b"]], "ab", None, np.zeros((2, 2), bool)):
        with pytest.raises(
            TypeError, match=r"wanted pixels: numpy array of shape \(\.\.\., 2\) of numbers; got"
        ):
            camera.ground_points(wrong)


def test_four_points_on_the_floor_have_deviations_that_hold():
    """One equation more than unknowns: the residual alone says little of the noise."""
    truth = memo.Camera.level((640, 480), 49.0, 1.3, 6.0)
    places = np.array([[-1.2, -0.5, 0.0], [1.3, -0.4, 0.0], [1.1, 2.1, 0.0], [-1.0, 2.4, 0.0]])
    rng, off = np.random.default_rng(3), []
    for _ in range(60):
        pixels = truth.project(places) + rng.normal(0, 0.5, (4, 2))
        value, sd = memo.calibrate_points(places, pixels, (640, 480)).estimates["focal_px"]
        off.append(abs(value - truth.matrix[0, 0]) / sd)
    assert np.mean(np.array(off) > 3) <= 0.05 and np.median(off) > 0.2


# Checkerboards.


def rendered_board(pose, focal=550.0, size=(640, 360), squares=(10, 7), square_m=0.03, k=(-0.15, 0.02)):
    """A board in its plane z = 0, seen through a lens; anti-aliased by 3x3 rays a pixel."""
    u, v = np.meshgrid((np.arange(size[0] * 3) - 1) / 3, (np.arange(size[1] * 3) - 1) / 3)
    matrix = np.array([[focal, 0, 319.5], [0, focal, 179.5], [0, 0, 1]])
    rays = cv2.undistortPoints(np.stack([u.ravel(), v.ravel()], 1)[:, None], matrix, np.array([*k, 0, 0]))
    rays = np.column_stack([rays.reshape(-1, 2), np.ones(u.size)]) @ pose[0]
    place = -pose[0].T @ pose[1]
    hit = place + rays * (-place[2] / rays[:, 2:])
    cell = np.floor(hit[:, :2] / square_m).astype(int) + 1
    inside = ((cell >= 0) & (cell < squares)).all(axis=1)
    luma = np.where(inside, np.where(cell.sum(axis=1) % 2, 230, 25), 200).reshape(u.shape)
    return luma.reshape(size[1], 3, size[0], 3).mean(axis=(1, 3)).astype(np.uint8)


def test_rendered_boards(memo_command, tmp_path):
    folder = tmp_path / "boards"
    folder.mkdir()
    eyes = [(0.42, 0.07, 0.3), (-0.18, 0.08, 0.3), (0.13, 0.36, 0.28), (0.11, -0.21, 0.28)]
    eyes += [(0.14, 0.0, 0.5), (0.34, 0.3, 0.25), (-0.1, -0.15, 0.25)]
    for i, eye in enumerate(eyes):
        luma = rendered_board(look_at(np.array(eye), np.array([0.12, 0.075, 0])))
        cv2.imwrite(str(folder / f"board{i}.png"), luma)
    cv2.imwrite(str(folder / "empty.png"), np.full((360, 640), 90, np.uint8))
    cv2.imwrite(str(folder / "small.png"), np.full((72, 128), 90, np.uint8))
    (folder / "torn.png").write_bytes(b"no picture")
    floor = tmp_path / "floor.png"
    eye = np.array([0.1, -0.55, 0.35])
    cv2.imwrite(str(floor), rendered_board(look_at(eye, np.array([0.12, 0.075, 0]))))
    out = tmp_path / "out"
    arguments = ("calibrate", "checkerboard", folder, "--square-mm", 30, "--out", out)
    code, said, complaint = memo_command(*arguments, "--squares", "10x7", "--floor", floor, "--json")
    assert code == 0, complaint
    summary = json.loads(said)
    assert set(summary["not_used"]) == {"empty.png", "small.png", "torn.png"}
    print(summary)
    for focal_px, sd in zip(summary["focal_px"], summary["focal_sd_px"], strict=True):
        assert abs(focal_px - 550) < max(4 * sd, 3)
    assert summary["rms_px"] < 0.2 and summary["floor_rms_px"] < 0.3
    camera = memo.Camera.from_file(out / "camera.toml")
    assert camera.position[2] == pytest.approx(0.35, abs=5e-3)
    code, said, complaint = memo_command(*arguments, "--squares", "9x6")
    assert (
        code == 0
        and "9x6 counts the inner corners, not the squares" in said
        and "give lens.toml as --lens" in said
    )
    code, _, complaint = memo_command(*arguments, "--squares", "5x4")
    assert code == 1 and complaint.count("\n") == 1  # too few boards, or corners too near to one another


def test_boards_that_are_hardly_tilted_are_refused(memo_command, tmp_path):
    folder = tmp_path / "boards"
    folder.mkdir()
    for i, (x, y) in enumerate([(0.004, 0.0), (0.012, 0.0), (-0.01, 0.008), (0.0, -0.012), (0.008, 0.01)]):
        middle = np.array([0.12, 0.075, 0.0])
        luma = rendered_board(look_at(middle + np.array([x, y, 0.4]), middle))
        cv2.imwrite(str(folder / f"board{i}.png"), luma)
    arguments = ("calibrate", "checkerboard", folder, "--squares", "10x7", "--square-mm", 30)
    code, _, complaint = memo_command(*arguments, "--out", tmp_path / "out")
    assert code == 1 and "tilts differ by up to" in complaint and "20 degrees or more" in complaint
    assert not (tmp_path / "out" / "lens.toml").exists()


def test_the_ground_is_drawn(tmp_path):
    camera = memo.Camera.level((320, 240), 60.0, 1.4, 5.0)
    rgb = draw_ground(np.full((240, 320), 90, np.uint8), camera)
    u, v = camera.project(np.array([[0.5, 0.0, 0.0]]))[0]
    red, green, blue = rgb[round(v), round(u)].astype(int)
    assert red > green + 60 and red > blue + 60
    assert (rgb[:100] == rgb[50, 5]).all() or rgb[:60].std() < 60
    assert read_picture(write_picture(tmp_path / "ground.png", rgb)).shape == (240, 320)
    assert board_places((3, 2), 0.5).tolist() == [
        *([0, 0, 0], [0.5, 0, 0], [1, 0, 0]),
        *([0, 0.5, 0], [0.5, 0.5, 0], [1, 0.5, 0]),
    ]
