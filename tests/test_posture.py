"""Postures as they are called: walkers drawn with numpy alone are found again, files say the same, mistakes
are told in one line."""

import csv
import json
import math
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA
from memo.report import write_report
from scipy.spatial.transform import Rotation

SIDES = ("right", "left")
#: The levels of the tree.
JOINTS = [
    *("neck", "right_shoulder", "left_shoulder", "pelvis", "right_hip", "left_hip"),
    *(f"{side}_{joint}" for joint in ("elbow", "wrist", "knee", "ankle") for side in SIDES),
]
AT = {name: place for place, name in enumerate(JOINTS)}
LIMB_JOINTS = [name for name in JOINTS if name not in ("neck", "pelvis")]
RATE_HZ, FRAMES = 25, 40
NOISE_PX = 1.0

#: Metres. Neck and pelvis lie on the middle line, as a detector's do.
SHOULDER, HIP, TRUNK, UPPER_ARM, FOREARM, THIGH, SHANK = 0.19, 0.09, 0.50, 0.3, 0.25, 0.43, 0.42
ANKLE_HEIGHT = 0.08
PELVIS_ON_TRUNK = 45.98 / (45.98 + 10.09)

SIZE, FOCAL_PX = (1280, 720), 1100.0
CAMERA_AT = np.array([0.0, -5.0, 1.3])
#: Rows: the camera's x, y and z in the world. It looks along world y, 4 degrees downwards.
DOWN = math.radians(4)
TURN = np.array([[1, 0, 0], [0, -math.sin(DOWN), -math.cos(DOWN)], [0, math.cos(DOWN), -math.sin(DOWN)]])


def walker(heading_deg=25.0, frames=FRAMES):
    """(T, 14, 3) world, metres: a walker with rigid limbs, the lower foot always on the ground."""
    heading = math.radians(heading_deg)
    ahead = np.array([math.cos(heading), math.sin(heading), 0])
    left = np.array([-ahead[1], ahead[0], 0])
    up = np.array([0, 0, 1.0])
    cycle_hz, swing = 0.9, math.radians(25)
    speed_mps = 2 * cycle_hz * 2 * (THIGH + SHANK) * math.sin(swing) * 0.95

    def hanging(angle):
        return math.sin(angle) * ahead - math.cos(angle) * up

    figures = np.empty((frames, 14, 3))
    for t in range(frames):
        phase = 2 * math.pi * cycle_hz * t / RATE_HZ + 0.4
        figure = dict.fromkeys(JOINTS, np.zeros(3))
        hips = np.zeros(3)
        figure["neck"] = hips + TRUNK * up
        figure["pelvis"] = hips + (1 - PELVIS_ON_TRUNK) * TRUNK * up
        for side, sign, own in (("right", -1, phase), ("left", 1, phase + math.pi)):
            thigh = swing * math.sin(own) + math.radians(4)
            knee = math.radians(6) + math.radians(48) * max(0.0, math.cos(own)) ** 2
            arm = -math.radians(20) * math.sin(own)
            elbow = math.radians(25) - math.radians(10) * math.sin(own)
            figure[f"{side}_hip"] = hips + sign * HIP * left
            figure[f"{side}_knee"] = figure[f"{side}_hip"] + THIGH * hanging(thigh)
            figure[f"{side}_ankle"] = figure[f"{side}_knee"] + SHANK * hanging(thigh - knee)
            figure[f"{side}_shoulder"] = figure["neck"] + sign * SHOULDER * left
            figure[f"{side}_elbow"] = figure[f"{side}_shoulder"] + UPPER_ARM * hanging(arm)
            figure[f"{side}_wrist"] = figure[f"{side}_elbow"] + FOREARM * hanging(arm + elbow)
        joints = np.array([figure[name] for name in JOINTS])
        along = speed_mps * (t - (frames - 1) / 2) / RATE_HZ * ahead
        figures[t] = joints + along + (ANKLE_HEIGHT - joints[:, 2].min()) * up
    return figures


def project(points):
    """Pixels (..., 2) of world points (..., 3), written out."""
    in_camera = (points - CAMERA_AT) @ TURN.T
    centre = (np.array(SIZE) - 1) / 2
    return FOCAL_PX * in_camera[..., :2] / in_camera[..., 2:] + centre


def true_lengths(figures):
    """Name -> metres, by the names alone: `a_to_b` is from a to b."""
    ends = {name: name.split("_to_") for name in memo._memo.segment_names()}
    figure = figures[0]
    return {name: float(np.linalg.norm(figure[AT[a]] - figure[AT[b]])) for name, (a, b) in ends.items()}


def write_camera(path):
    centre = [(length - 1) / 2 for length in SIZE]
    turn = Rotation.from_matrix(TURN).as_rotvec().tolist()
    shift = (-TURN @ CAMERA_AT).tolist()
    path.write_text(
        f"[side]\nname = 'side'\nsize = {list(map(float, SIZE))}\n"
        f"matrix = [[{FOCAL_PX}, 0.0, {centre[0]}], [0.0, {FOCAL_PX}, {centre[1]}], [0.0, 0.0, 1.0]]\n"
        f"distortions = [0.0, 0.0, 0.0, 0.0]\nrotation = {turn}\ntranslation = {shift}\n"
    )
    return path


def write_table(
    path, figures, noise_px=NOISE_PX, without=(), names=LIMB_JOINTS, change=lambda pixels: pixels
):
    pixels = project(figures) + np.random.default_rng(3).normal(0, noise_px, (*figures.shape[:2], 2))
    pixels = change(pixels)
    names = [name for name in names if name not in without]
    header = ["frame", *(f"{name}_{axis}" for name in names for axis in "xy")]
    rows = [[t, *(f"{x:.3f}" for name in names for x in frame[AT[name]])] for t, frame in enumerate(pixels)]
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([header, *rows])
    return path


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A folder with walk.csv, camera.toml and lengths.csv, and the truth."""
    folder, truth = tmp_path_factory.mktemp("scene"), walker()
    write_table(folder / "walk.csv", truth)
    write_camera(folder / "camera.toml")
    lengths = "".join(f"{name},{length_m:.4f}\n" for name, length_m in true_lengths(truth).items())
    (folder / "lengths.csv").write_text("segment,length_m\n" + lengths)
    return folder, truth


@pytest.fixture(scope="module")
def found(scene):
    """What the Python call finds in the scene, with the lengths known and the ground as anchor."""
    folder, _ = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    return memo.posture(folder / "walk.csv", camera, folder / "lengths.csv", fps=RATE_HZ, noise_px=NOISE_PX)


@pytest.fixture
def memo_posture(memo_command):
    return partial(memo_command, "posture")


def errors_m(estimated, truth):
    return np.linalg.norm(estimated - truth, axis=-1)


def read_table(path):
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    return rows, {name: [row[name] for row in rows] for name in rows[0]}


def joints_of(columns):
    cells = [[columns[f"{name}_{axis}_m"] for axis in "xyz"] for name in JOINTS]
    return np.array([[[float(x or "nan") for x in axis] for axis in joint] for joint in cells]).transpose(
        2, 0, 1
    )


def test_the_camera_of_the_test_is_that_of_the_package(scene):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    np.testing.assert_allclose(camera.position, CAMERA_AT, atol=1e-9)
    np.testing.assert_allclose(camera.project(truth[0]), project(truth[0]), atol=1e-6)
    np.testing.assert_allclose(camera.camera_from_world(truth[0]), (truth[0] - CAMERA_AT) @ TURN.T, atol=1e-9)


def test_a_walk_is_found_again(found, scene):
    """Ray directions are known to 1 px in 1100, distances through the ground and the trunk."""
    _, truth = scene
    error_m = errors_m(found.smoothed_m, truth)
    assert np.isfinite(error_m).all()
    assert np.median(error_m) < 0.06 and np.percentile(error_m, 95) < 0.15
    shape_m = errors_m(found.smoothed_m - found.smoothed_m[:, :1], truth - truth[:, :1])
    assert np.median(shape_m) < 0.05, "postures apart from where the neck is"
    assert np.median(error_m / found.sd_m) < 2.5, "the standard deviations stated are of this size"


def test_the_true_posture_is_among_those_left(found, scene):
    """Within what a group joins (0.10 m) and where the neck is believed to be."""
    _, truth = scene
    near = 0
    for t, groups in enumerate(found.groups_m):
        if len(groups):
            shape = groups - groups[:, :1] - (truth[t] - truth[t, :1])
            near += np.linalg.norm(shape, axis=-1).max(axis=1).min() < 0.15
    assert near >= 0.9 * len(truth)


def test_a_given_distance_is_kept(scene):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    distance_m = np.linalg.norm(truth[:, 0] - CAMERA_AT, axis=1)
    known = {"lengths": true_lengths(truth), "distance_m": distance_m, "noise_px": NOISE_PX}
    found = memo.posture(folder / "walk.csv", camera, **known, fps=RATE_HZ)
    np.testing.assert_allclose(
        np.linalg.norm(found.linked_m[:, 0] - CAMERA_AT, axis=1), distance_m, atol=1e-6
    )
    assert np.median(errors_m(found.smoothed_m, truth)) < 0.03


def test_height_alone_and_nothing_at_all_are_enough(scene):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    for scale in ({"height_m": 1.75}, {}):
        found = memo.posture(folder / "walk.csv", camera, **scale, fps=RATE_HZ)
        assert set(found.lengths_m) == set(memo._memo.segment_names()) == set(found.length_basis)
        assert np.median(errors_m(found.smoothed_m, truth)) < 0.15, scale
        assert found.scale_from


def test_what_is_found_fits_what_was_seen(found):
    pixels = found.camera.project(found.linked_m.reshape(-1, 3)).reshape(*found.points_px.shape)
    misses_px = np.linalg.norm(pixels - found.points_px, axis=-1)[found.gap_m == 0]
    assert np.nanmedian(misses_px) < 0.5 and misses_px.size > 200


def test_the_command_says_what_the_call_says(found, scene, tmp_path, memo_posture):
    folder, _ = scene
    out = tmp_path / "out"
    arguments = (folder / "walk.csv", "--camera", folder / "camera.toml", "--lengths", folder / "lengths.csv")
    code, said, complaint = memo_posture(*arguments, "--fps", RATE_HZ, "--out", out)
    assert (code, complaint) == (0, "")
    assert 4 <= len(said.splitlines()) <= 6 and said.startswith(f"{FRAMES} frames, of which ")
    assert {path.name for path in out.iterdir()} == {
        *("postures.csv", "postures_camera.csv", "levels.csv", "reasons.csv", "postures.json", "postures.png")
    }
    camera = memo.Camera.from_toml(folder / "camera.toml")
    called = memo.posture(folder / "walk.csv", camera, folder / "lengths.csv", fps=RATE_HZ)
    rows, columns = read_table(out / "postures.csv")
    assert [int(row["frame"]) for row in rows] == list(range(FRAMES))
    np.testing.assert_allclose(np.array(columns["time_s"], float), np.arange(FRAMES) / RATE_HZ, atol=1e-6)
    np.testing.assert_allclose(joints_of(columns), called.smoothed_m, atol=1e-4)
    _, in_camera = read_table(out / "postures_camera.csv")
    np.testing.assert_allclose(joints_of(in_camera), (called.smoothed_m - CAMERA_AT) @ TURN.T, atol=1e-4)
    assert [int(n) for n in columns["survivors"]] == called.survivors.tolist()


@pytest.fixture(scope="module")
def backwards(scene, tmp_path_factory):
    """The walk played backwards: every joint bends as none of a person's who walks on does."""
    _, truth = scene
    return write_table(tmp_path_factory.mktemp("backwards") / "back.csv", truth[::-1])


def test_a_motion_that_breaks_a_constraint_in_every_frame_is_no_possible_sequence(
    scene, backwards, tmp_path, memo_posture, monkeypatch
):
    folder, _ = scene
    arguments = (backwards, "--camera", folder / "camera.toml", "--lengths", folder / "lengths.csv")
    arguments += ("--fps", RATE_HZ, "--strength", "paper", "--out", tmp_path)
    monkeypatch.setenv("FORCE_COLOR", "1")
    code, said, _ = memo_posture(*arguments)
    document = json.loads((tmp_path / "postures.json").read_text())
    assert all(frame["linked_breaks"] for frame in document["per_frame"])
    assert document["frames_with_survivors"] > 0  # in single frames something is left
    assert code == 6 and document["possible"] is False
    alarm = said.splitlines()[0]
    assert alarm.startswith("\x1b[1;31mNo possible sequence (--rules walking): in every frame")
    assert "40 frames" in alarm
    report = write_report(tmp_path)
    page = report.path.read_text()
    assert '<span class="status bad">no possible sequence</span>' in page
    assert "is no possible sequence by these rules" in page
    code, said, _ = memo_posture(*arguments, "--json", "--no-plots")
    assert code == 6 and json.loads(said)["possible"] is False
    monkeypatch.delenv("FORCE_COLOR")
    _, said, _ = memo_posture(*arguments, "--no-plots")
    assert said.startswith("No possible sequence") and "\x1b" not in said


def test_one_posture_that_breaks_nothing_makes_a_motion_possible(found):
    broken = (("left_leg_not_upright",),) * len(found)
    assert found.is_possible and found.summary["possible"]
    assert not replace(found, linked_breaks=broken).is_possible
    assert "breaks a constraint in each" in repr(replace(found, linked_breaks=broken))
    assert replace(found, linked_breaks=((), *broken[1:])).is_possible
    nowhere = found.smoothed_m.copy()
    nowhere[0] = np.nan  # the frame without a break is none of the motion
    assert not replace(found, linked_breaks=((), *broken[1:]), smoothed_m=nowhere).is_possible


def test_tables_and_document_agree(scene, tmp_path, memo_posture):
    folder, _ = scene
    arguments = (folder / "walk.csv", "--camera", folder / "camera.toml", "--height", "1.75", "--no-plots")
    code, said, _ = memo_posture(*arguments, "--fps", RATE_HZ, "--out", tmp_path, "--json")
    summary, document = json.loads(said), json.loads((tmp_path / "postures.json").read_text())
    assert code == 0 and all(Path(file).is_file() for file in summary["files"])
    assert not (tmp_path / "postures.png").exists()
    assert summary["frames"] == FRAMES and summary["warnings"] == document["warnings"]
    levels, _ = read_table(tmp_path / "levels.csv")
    assert len(levels) == FRAMES * 14 and [row["joint"] for row in levels[:14]] == JOINTS
    reasons, columns = read_table(tmp_path / "reasons.csv")
    assert list(columns) == ["constraint", "kind", "joint", "branches", "frames", "sentence"]
    totals: dict[tuple[str, str], int] = {}
    for t, frame in enumerate(document["per_frame"]):
        assert frame["frame"] == t and np.shape(frame["smoothed_m"]) == (14, 3)
        assert np.shape(frame["groups_m"])[:1] == (len(frame["group_sizes"]),)
        given = len(frame["group_sizes"])
        assert given == min(frame["group_count"], 64) and min(frame["group_sizes"], default=1) >= 1
        missing = frame["survivors"] - sum(frame["group_sizes"])
        assert missing >= frame["group_count"] - given >= 0 and (missing == 0) == (
            given == frame["group_count"]
        )
        assert [int(row["reached"]) for row in levels[14 * t : 14 * t + 14]] == frame["level_reached"]
        assert [int(row["survived"]) for row in levels[14 * t : 14 * t + 14]] == frame["level_survived"]
        assert (frame["cut_all"] is None) == (frame["survivors"] > 0) and frame["problem"] is None
        assert frame["level_survived"][-1] == frame["survivors"] <= frame["level_reached"][-1]
        for reason in frame["reasons"]:
            key = reason["constraint"], reason["joint"]
            totals[key] = totals.get(key, 0) + reason["branches"]
    broken = [frame["linked_breaks"] for frame in document["per_frame"]]
    assert summary["frames_breaking"] == sum(map(bool, broken))
    assert totals == {(row["constraint"], row["joint"]): int(row["branches"]) for row in reasons}
    assert all(row["sentence"] for row in reasons)
    again = memo.read_lengths(tmp_path / "postures.json")
    assert again == {name: length["length_m"] for name, length in document["lengths"].items()}


def test_a_chosen_frame_is_drawn_and_quiet_is_quiet(scene, tmp_path, memo_posture):
    folder, _ = scene
    arguments = (folder / "walk.csv", "--camera", folder / "camera.toml", "--fps", RATE_HZ, "--out", tmp_path)
    pictures = []
    for frame in (3, 30):
        assert memo_posture(*arguments, "--frame", frame, "--quiet") == (0, "", "")
        pictures.append((tmp_path / "postures.png").read_bytes())
    assert pictures[0] != pictures[1] and pictures[0][:4] == b"\x89PNG"


@pytest.mark.filterwarnings("error")
def test_a_frame_of_which_nothing_is_known_is_drawn_too(scene, tmp_path, memo_posture):
    folder, _ = scene
    rows = [line.split(",") for line in (folder / "walk.csv").read_text().splitlines()]
    rows[6][1:] = [""] * (len(rows[6]) - 1)
    (tmp_path / "gap.csv").write_text("\n".join(",".join(row) for row in rows))
    arguments = (
        tmp_path / "gap.csv",
        "--camera",
        folder / "camera.toml",
        "--fps",
        RATE_HZ,
        "--out",
        tmp_path,
    )
    code, _, complaint = memo_posture(*arguments, "--frame", "5")
    assert (code, complaint) == (0, "") and (tmp_path / "postures.png").is_file()


def test_where_nothing_is_left_it_is_said_why(scene, tmp_path, memo_posture):
    """True walking breaks the rules as tight as they are printed."""
    folder, truth = scene
    spread = np.linalg.norm(truth[:, AT["right_ankle"]] - truth[:, AT["left_ankle"]], axis=1)
    options = ("--camera", folder / "camera.toml", "--lengths", folder / "lengths.csv", "--fps", "25")
    options += ("--strength", "paper", "--out", tmp_path / "out")
    kept, document = truth[spread > 0.6], None
    while document is None or not all(frame["cut_all"] for frame in document["per_frame"]):
        if document:
            kept = kept[[frame["frame"] for frame in document["per_frame"] if frame["cut_all"]]]
        path = write_table(tmp_path / "strides.csv", kept)
        code, said, _ = memo_posture(path, *options)
        document = json.loads((tmp_path / "out" / "postures.json").read_text())
    assert code == 3 and "of which 0 have possible postures: in the first, the nearest posture breaks" in said
    assert all(frame["cut_all"] and not frame["groups_m"] for frame in document["per_frame"])
    assert document["frames_in_motion"] == len(document["per_frame"]) > 3
    assert all(frame["linked_breaks"] for frame in document["per_frame"])
    assert f"in {len(document['per_frame'])} frames the chosen posture breaks a constraint" in said


def test_exchanged_sides_are_put_right_first(scene, tmp_path):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    wrong = truth.copy()
    right, left = (
        [AT[f"{side}_{joint}"] for joint in ("hip", "knee", "ankle")] for side in ("right", "left")
    )
    for t in (9, 10, 28):
        wrong[t, right], wrong[t, left] = truth[t, left], truth[t, right]
    path = write_table(tmp_path / "wrong.csv", wrong)
    put_right, as_is = (
        memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ, unswap=unswap)
        for unswap in (True, False)
    )
    assert put_right.repair is not None and put_right.repair.exchanged["legs"] == 3 and as_is.repair is None
    np.testing.assert_array_equal(put_right.points_px[9][right], as_is.points_px[9][left])


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["absent.csv"], "absent.csv: no such file or folder"),
        (["legless.csv"], "no point for right_knee, left_knee"),
        (["walk.csv", "--camera", "absent.toml"], "absent.toml: no such camera file"),
        (["walk.csv", "--camera", "walk.csv"], "walk.csv"),
        (["walk.csv", "--camera-name", "top"], "no camera `top` in the file"),
        (["walk.csv", "--height", "175"], "looks like centimetres: give --height 1.75"),
        (["walk.csv", "--height", "-1"], "not the height of a person"),
        (["walk.csv", "--height", "nan"], "not the height of a person"),
        (["walk.csv", "--lengths", "absent.csv"], "absent.csv: no such file"),
        (["walk.csv", "--lengths", "."], "cannot be read"),
        (["walk.csv", "--lengths", "negative.csv"], "neck_to_pelvis is -0.4, not a length in metres"),
        (["walk.csv", "--lengths", "missing.csv"], "1 of 17 lengths missing: neck_to_pelvis"),
        (["walk.csv", "--lengths", "unknown.json"], "no segment tail"),
        (["walk.csv", "--lengths", "broken.json"], "broken.json: not JSON"),
        (["walk.csv", "--lengths", "twice.csv"], "neck_to_pelvis appears twice"),
        (["walk.csv", "--lengths", "short.csv"], "row 2 has no length beside the name"),
        (["walk.csv", "--lengths", "image.png"], "not a text file"),
        (["walk.csv", "--lengths", "lengths.csv", "--height", "1.8"], "leave --height out"),
        (["walk.csv", "--distance", "0"], "--distance 0 is not a distance in metres"),
        (["walk.csv", "--distance", "nan"], "--distance nan is not a distance in metres"),
        (["walk.csv", "--distance", "4", "--anchor", "ground"], "leave the anchor ground out"),
        (["walk.csv", "--anchor", "head"], "six points"),
        (["walk.csv", "--frame", "40"], "--frame 40 is not among the frames 0 to 39"),
        (["walk.csv", "--fps", "0"], "frame rate must be positive"),
        (["walk.csv", "--layout", "BODY_25"], "leave the layout BODY_25 out"),
        (["walk.csv", "--person", "3"], "no person 3: there is 1 person, and the first is 0"),
        (["walk.csv", "--out", "walk.csv"], "cannot be written to"),
        (["upside.csv"], "from the extent: the figure is upside down in this camera"),
        (["upside.csv"], "from the trunk: no distance fits"),
        (["parts.csv"], "parts.csv: coordinates up to 0.7"),
    ],
    ids=lambda value: "_".join(value[1:]) if isinstance(value, list) else "",
)
def test_mistakes_are_told_in_one_line(scene, tmp_path, monkeypatch, memo_posture, arguments, reason):
    folder, truth = scene
    for name in ("walk.csv", "lengths.csv"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    write_table(tmp_path / "legless.csv", truth, without=("right_knee", "left_knee"))
    lengths = (folder / "lengths.csv").read_text().splitlines()
    rows = [line for line in lengths if not line.startswith("neck_to_pelvis,")]
    (tmp_path / "negative.csv").write_text("\n".join([*rows, "neck_to_pelvis,-0.4"]))
    (tmp_path / "missing.csv").write_text("\n".join(rows))
    (tmp_path / "twice.csv").write_text("\n".join([*lengths, "neck_to_pelvis,0.4"]))
    (tmp_path / "short.csv").write_text("segment\nneck_to_pelvis\n")
    (tmp_path / "unknown.json").write_text(json.dumps(true_lengths(truth) | {"tail": 0.3}))
    (tmp_path / "broken.json").write_text('{"neck_to_pelvis": ')
    write_table(tmp_path / "upside.csv", truth, change=lambda pixels: [0, SIZE[1]] + pixels * [1, -1])
    write_table(tmp_path / "parts.csv", truth, change=lambda pixels: pixels / SIZE)
    (tmp_path / "image.png").write_bytes(b"\x89PNG\xff\xfe")
    monkeypatch.chdir(tmp_path)
    defaults = {"--camera": folder / "camera.toml", "--fps": RATE_HZ, "--out": "out"}
    for name, value in defaults.items():
        if name not in arguments:
            arguments = [*arguments, name, value]
    code, said, complaint = memo_posture(*arguments)
    assert (code, said) == (2 if reason == "leave --height out" else 1, "")
    assert complaint.startswith("memo: ") and complaint.count("\n") == 1 and reason in complaint
    assert not list(tmp_path.glob("out/postures*"))


def test_usage_mistakes_are_told_by_the_command_line(scene, memo_posture):
    folder, _ = scene
    walk, camera = folder / "walk.csv", folder / "camera.toml"
    assert memo_posture("--camera", camera)[0] == 2
    assert memo_posture(walk, "--camera", camera, "--rules", "flying")[0] == 2
    assert memo_posture(walk, "--camera", camera, "--anchor", "moon")[0] == 2
    code, _, complaint = memo_posture(walk, "--camera", camera, "--track", folder)
    assert code == 2 and "leave --camera, --fov-deg, --distance out" in complaint


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"rules": "flying"}, "rules must be one of physical"),
        ({"strength": "weak"}, "strength must be one of"),
        ({"anchor": "moon"}, "anchor must be one of"),
        ({"anchor": "given"}, "needs a distance"),
        ({"lengths": {}, "height_m": 1.8}, "either lengths or a height"),
        ({"lengths": {"neck_to_pelvis": 0.4}}, "16 of 17 lengths missing"),
        ({"height_m": 180.0}, "centimetres"),
        ({"height_m": math.nan}, "height"),
        ({"noise_px": -1.0}, "noise_px"),
        ({"group_m": math.nan}, "group_m"),
        ({"moving_direction": (0.0, 0.0, 1.0)}, "moving_direction"),
        ({"distance_m": [4.0, 5.0]}, r"as many distances \(or one\) as times \(40\)"),
        ({"distance_m": 1e300}, "distance_m must be 0.1 to 1000 m"),
        ({"distance_m": 1e-300}, "distance_m must be 0.1 to 1000 m"),
        ({"distance_m": math.nan}, "distance_m must be a distance"),
        ({"distance_m": 5.0, "distance_sd_m": -5.0}, "distance_sd_m must be positive"),
        ({"distance_sd_m": -5.0}, "distance_sd_m needs distance_m, got -5 alone"),
        ({"max_groups": -1}, "max_groups must be 0 to"),
        ({"moving_direction": (1.0, 0.0)}, "moving_direction must be three numbers"),
    ],
    ids=lambda value: "_".join(value) if isinstance(value, dict) else "",
)
def test_mistakes_in_python(scene, options, reason):
    folder, _ = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    with pytest.raises(ValueError, match=reason) as raised:
        memo.posture(folder / "walk.csv", camera, fps=RATE_HZ, **options)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"max_groups": 1.5}, "max_groups must be a whole number, got 1.5"),
        ({"distance_m": "a"}, "distance_m must be a number or one per frame, got a"),
        ({"distance_m": [[4.0], [5.0, 6.0]]}, "distance_m must be a number or one"),
        ({"distance_m": 4.0, "distance_sd_m": "b"}, "distance_sd_m must be a number, got b"),
        ({"rules": 1}, "rules must be a name, one of physical"),
        ({"noise_px": "much"}, "noise_px must be a number, got much"),
        ({"height_m": [1.8]}, "height_m must be a number"),
        ({"moving_direction": "north"}, "moving_direction must be"),
    ],
    ids=lambda value: "_".join(value) if isinstance(value, dict) else "",
)
def test_wrong_types_in_python(scene, options, reason):
    folder, _ = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    with pytest.raises(TypeError, match=reason) as raised:
        memo.posture(folder / "walk.csv", camera, fps=RATE_HZ, **options)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("read", ["keypoints", "lengths", "linked", "folder"])
def test_what_is_read_is_never_written_over(scene, tmp_path, memo_posture, read):
    folder, _ = scene
    keypoints, options = folder / "walk.csv", []
    if read == "keypoints":
        keypoints = tmp_path / "postures.csv"
        keypoints.write_bytes((folder / "walk.csv").read_bytes())
    elif read == "linked":
        (tmp_path / "levels.csv").symlink_to(tmp_path / "walk.csv")
        keypoints = tmp_path / "walk.csv"
        keypoints.write_bytes((folder / "walk.csv").read_bytes())
    elif read == "lengths":
        lengths = (folder / "lengths.csv").read_text().splitlines()[1:]
        (tmp_path / "postures.json").write_text(json.dumps(dict(row.split(",") for row in lengths)))
        options = ["--lengths", tmp_path / "postures.json"]
    else:
        keypoints = tmp_path
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    arguments = (keypoints, "--camera", folder / "camera.toml", "--fps", "25", *options)
    code, said, complaint = memo_posture(*arguments, "--out", tmp_path)
    assert (code, said) == (1, "") and complaint.count("\n") == 1 and "write to another place" in complaint
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_distance_less_sure_than_long_is_none(scene, tmp_path, memo_posture):
    """All joints in one pixel."""
    folder, truth = scene
    path = write_table(tmp_path / "dot.csv", truth[:8], change=lambda pixels: np.full_like(pixels, 400.0))
    arguments = (path, "--camera", folder / "camera.toml", "--lengths", folder / "lengths.csv", "--fps", "25")
    code, said, complaint = memo_posture(*arguments, "--out", tmp_path / "out")
    assert (code, complaint) == (3, "")
    assert "of which 0 have possible postures: in the first, the distance of the neck is not known: " in said
    assert "too uncertain" in said and "m away" not in said and "depth directions of the limbs" not in said
    document = json.loads((tmp_path / "out" / "postures.json").read_text())
    for frame in document["per_frame"]:
        assert frame["anchor_m"] is None and "not known" in frame["problem"] and frame["cut_all"] is None


def test_nothing_is_decided_about_limbs_that_are_not_seen(scene, tmp_path, memo_posture):
    folder, truth = scene
    trunk = ["right_shoulder", "left_shoulder", "right_hip", "left_hip"]
    options = ("--camera", folder / "camera.toml", "--lengths", folder / "lengths.csv", "--fps", RATE_HZ)
    options = (*options, "--distance", "5", "--out", tmp_path / "out")
    header = (folder / "walk.csv").read_text().splitlines()[0].split(",")

    def emptied(keep):
        rows = [line.split(",") for line in (folder / "walk.csv").read_text().splitlines()[1:]]
        names = [name.rsplit("_", 1)[0] for name in header]
        for row in rows:
            row[1:] = [x if name in keep else "" for name, x in zip(names[1:], row[1:], strict=True)]
        (tmp_path / "some.csv").write_text("\n".join(",".join(row) for row in [header, *rows]))
        return tmp_path / "some.csv"

    code, said, complaint = memo_posture(emptied(trunk), *options)
    assert (code, complaint) == (0, "") and "the limbs are undetermined" in said
    assert "depth directions of the limbs" not in said
    path = write_table(tmp_path / "neck.csv", truth, names=JOINTS)
    rows = [line.split(",") for line in path.read_text().splitlines()]
    rows[1:] = [[*row[:3], *[""] * (len(row) - 3)] for row in rows[1:]]
    path.write_text("\n".join(",".join(row) for row in rows))
    code, said, complaint = memo_posture(path, *options)
    assert (code, complaint) == (3, "")
    assert (
        "of which 0 have possible postures: in the first, no joint connected to the neck is visible" in said
    )


def test_points_beyond_the_picture_are_noticed(found, scene, tmp_path):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    assert not any("picture" in warning for warning in found.warnings)
    path = write_table(tmp_path / "large.csv", truth, change=lambda pixels: 2 * pixels)
    large = memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ)
    (said,) = (warning for warning in large.warnings if "picture" in warning)
    beyond = (np.nan_to_num(large.points_px) > np.array(SIZE) + 5.5).any(axis=-1).sum()
    assert said.startswith(f"{beyond} of {large.points_px[..., 0].size} points") and "1280x720" in said


def test_a_figure_on_its_head_is_noticed(found, scene, tmp_path):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    path = write_table(tmp_path / "upwards.csv", truth, change=lambda pixels: [0, SIZE[1]] + pixels * [1, -1])
    upwards = memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ, anchor="given", distance_m=5.0)
    said = "the neck is below the pelvis in 40 of 40 frames: v of the keypoints must increase downwards"
    assert upwards.warnings[0] == said
    assert not any("below the pelvis" in warning for warning in found.warnings)


def test_it_is_told_that_one_of_several_people_was_followed(scene, tmp_path, memo_posture):
    folder, _ = scene
    header, *rows = (folder / "walk.csv").read_text().splitlines()
    other = [",".join([row.split(",")[0], *["5"] * header.count(",")]) for row in rows[:7]]
    crowd = [f"person,{header}", *(f"0,{row}" for row in rows), *(f"1,{row}" for row in other)]
    (tmp_path / "crowd.csv").write_text("\n".join(crowd))
    arguments = [tmp_path / "crowd.csv", "--camera", folder / "camera.toml", "--fps", RATE_HZ, "--no-plots"]
    arguments += ["--lengths", folder / "lengths.csv", "--out", tmp_path / "out"]
    _, said, _ = memo_posture(*arguments)
    assert (
        "2 people in the file: 0 (40 frames of frames 0 to 39, 320 px); 1 (7 frames of frames 0 to 6, 0 px). "
        "The most prominent one was taken; --person selects another."
    ) in said
    assert "people" not in memo_posture(*arguments, "--person", 0)[1]


def test_every_posture_is_kept_with_what_cut_the_others(found, scene, tmp_path, memo_posture):
    folder, _ = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    known = {"fps": RATE_HZ, "noise_px": NOISE_PX, "keep_all": True}
    kept = memo.posture(folder / "walk.csv", camera, folder / "lengths.csv", **known)
    assert found.interpretations is None and len(kept.interpretations) == len(kept)
    for row, (survivors_m, cut_m, cut_by) in enumerate(kept.interpretations):
        assert survivors_m.shape == (kept.survivors[row], 14, 3)
        # As many branches of each constraint as were counted.
        counted = {reason.constraint: reason.branches for reason in kept.reasons[row]}
        assert Counter(cut_by) == counted and len(cut_m) == len(cut_by)
        # Every joint lies on its line of sight, but for noise where a segment is too short to reach it.
        for figures_m in (survivors_m, cut_m):
            px = camera.project(figures_m.reshape(-1, 3)).reshape(*figures_m.shape[:2], 2)
            off_px = np.hypot(*np.moveaxis(px - kept.points_px[row], -1, 0))
            assert np.nanmedian(off_px) < 0.5 and np.nanquantile(off_px, 0.99) < 12
        assert np.isfinite(survivors_m).all() and np.isnan(cut_m).any() and np.isfinite(cut_m[:, 0]).all()
        # The groups stand for the survivors.
        for figure_m in kept.groups_m[row]:
            assert np.isclose(survivors_m, figure_m, atol=1e-9).all(axis=(1, 2)).any()
    np.testing.assert_array_equal(kept.smoothed_m, found.smoothed_m)
    arguments = [folder / "walk.csv", "--camera", folder / "camera.toml", "--fps", RATE_HZ, "--no-plots"]
    arguments += ["--lengths", folder / "lengths.csv", "--noise-px", NOISE_PX]
    arguments += ["--out", tmp_path / "out", "--keep-all"]
    assert "interpretations.npz" in memo_posture(*arguments)[1]
    with np.load(tmp_path / "out" / "interpretations.npz") as arrays:
        left = arrays["frame"][arrays["cut_by"] == ""]
        assert np.bincount(left).tolist() == kept.survivors.tolist()
        assert arrays["posture_m"].shape == (len(arrays["frame"]), 14, 3)
        assert tuple(arrays["joints"]) == kept.joints
    memo_posture(*arguments[:-1])
    assert not (tmp_path / "out" / "interpretations.npz").exists(), "not beside tables of another run"


def test_one_frame_has_no_way(scene, tmp_path):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    path = write_table(tmp_path / "one.csv", truth[:1])
    said = " ".join(memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ).warnings)
    assert "no way to take the moving direction from" in said and "NaN" not in said
    physical = memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ, rules="physical")
    assert not any("moving direction" in warning for warning in physical.warnings)


def test_the_scale_is_said_to_be_of_the_ground_or_of_a_distance(scene, tmp_path, memo_posture):
    folder, truth = scene
    arguments = (folder / "walk.csv", "--camera", folder / "camera.toml", "--fps", RATE_HZ, "--out", tmp_path)
    assert "from the feet on the ground;" in memo_posture(*arguments, "--no-plots")[1]
    distance_m = np.linalg.norm(truth[:, AT["neck"]] - CAMERA_AT, axis=1).mean()
    said = memo_posture(*arguments, "--no-plots", "--distance", distance_m)[1]
    assert "Sizes are based on the distance given;" in said


def test_bodies_that_cannot_be_are_told_whatever_the_rules(scene, tmp_path):
    """Knees bent forwards: each is mirrored in the line from hip to ankle. Elbows are as they were, so that
    somebody the other way round is as impossible."""
    folder, truth = scene
    bent = truth.copy()
    for side in SIDES:
        hip, knee, ankle = (truth[:, AT[f"{side}_{joint}"]] for joint in ("hip", "knee", "ankle"))
        along = (ankle - hip) / np.linalg.norm(ankle - hip, axis=1, keepdims=True)
        foot = hip + ((knee - hip) * along).sum(axis=1, keepdims=True) * along
        bent[:, AT[f"{side}_knee"]] = 2 * foot - knee
    camera = memo.Camera.from_toml(folder / "camera.toml")
    distance_m = np.linalg.norm(truth[:, AT["neck"]] - CAMERA_AT, axis=1)
    path = write_table(tmp_path / "bent.csv", bent)
    known = {"lengths": true_lengths(truth), "distance_m": distance_m, "fps": RATE_HZ}
    wrong = memo.posture(path, camera, **known, rules="physical")
    right = memo.posture(folder / "walk.csv", camera, **known)
    assert wrong.summary["frames_breaking"] > FRAMES // 2 > 10 > right.summary["frames_breaking"]
    assert all(name.endswith("extension") for names in wrong.linked_breaks for name in names[:1])
    (said,) = (warning for warning in wrong.warnings if "breaks a limit of bodies" in warning)
    assert said.startswith(f"in {wrong.summary['frames_breaking']} of {FRAMES} frames")


def test_frames_without_a_neck_are_a_problem_and_no_violation(scene):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    keypoints = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ)
    points = keypoints.points.copy()
    points[7] = np.nan
    found = memo.posture(keypoints.replaced(points, keypoints.scores), camera, true_lengths(truth))
    assert [t for t, problem in enumerate(found.problems) if problem] == [7] and found.survivors[7] == 0
    assert found.problems[7] == "the neck is not seen" and found.cut_all[7] is None
    assert found.group_counts[7] == 0


def test_groups_are_counted_beyond_those_given(scene, tmp_path, found):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    few = memo.posture(
        folder / "walk.csv", camera, true_lengths(truth), fps=RATE_HZ, noise_px=NOISE_PX, max_groups=2
    )
    assert max(few.group_counts) > 2 == max(map(len, few.group_sizes))
    for count, sizes in zip(few.group_counts, few.group_sizes, strict=True):
        assert len(sizes) == min(count, 2)
    middle = project(truth).mean(axis=1, keepdims=True)
    path = write_table(tmp_path / "far.csv", truth, change=lambda pixels: middle + 0.01 * (pixels - middle))
    far = memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ)
    is_large = far.survivors > 1024
    assert is_large.any() and [count is None for count in far.group_counts] == is_large.tolist()
    assert not far.all_groups_given[is_large].any()


def test_sides_exchanged_in_all_frames_face_against_the_way(scene, tmp_path):
    """Seen from the front, where the shoulders tell."""
    folder, _ = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    truth = walker(heading_deg=-90)
    other = [
        name.replace("right", "LEFT").replace("left", "right").replace("LEFT", "left") for name in JOINTS
    ]
    said = {}
    for name, figures in {"as_is": truth, "exchanged": truth[:, [AT[joint] for joint in other]]}.items():
        path = write_table(tmp_path / f"{name}.csv", figures)
        said[name] = " ".join(memo.posture(path, camera, true_lengths(truth), fps=RATE_HZ).warnings)
    assert "faces against the way" in said["exchanged"] and "faces against" not in said["as_is"]


def test_help_says_whose_times_are_taken(memo_posture, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    code, said, _ = memo_posture("--help")
    assert code == 0 and "used in place of" in said


def test_keypoints_read_before_are_taken_too(scene):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    keypoints = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ)
    first = memo.posture(keypoints, camera, true_lengths(truth))
    again = memo.posture(folder / "walk.csv", camera, true_lengths(truth), fps=RATE_HZ)
    np.testing.assert_array_equal(first.smoothed_m, again.smoothed_m)
    with pytest.raises(ValueError, match="read from a file only"):
        memo.posture(keypoints, camera, fps=RATE_HZ)


def test_missing_joints_stay_unknown_and_the_others_are_found(scene, tmp_path):
    folder, truth = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    keypoints = memo.read_keypoints(folder / "walk.csv", fps=RATE_HZ)
    points = keypoints.points.copy()
    points[:, keypoints.names.index("left_wrist")] = np.nan
    found = memo.posture(keypoints.replaced(points, keypoints.scores), camera, true_lengths(truth))
    others = [place for name, place in AT.items() if name != "left_wrist"]
    assert np.isnan(found.smoothed_m[:, AT["left_wrist"]]).all()
    assert np.median(errors_m(found.smoothed_m, truth)[:, others]) < 0.08
    assert not np.isnan(found.sd_m[:, others]).any()


def test_a_camera_of_another_picture_is_refused(tmp_path, scene):
    folder, _ = scene
    camera = memo.Camera.from_toml(folder / "camera.toml")
    annotations = {
        "images": [{"id": 0, "width": 640, "height": 480, "frame_id": 0}],
        "annotations": [{"image_id": 0, "category_id": 1, "keypoints": [100.0, 100.0, 2] * 17}],
        "categories": [{"id": 1, "name": "person"}],
    }
    (tmp_path / "coco.json").write_text(json.dumps(annotations))
    with pytest.raises(ValueError, match="640x480"):
        memo.posture(tmp_path / "coco.json", camera, fps=25)


@pytest.mark.parametrize("camera", ["02", "04"])
def test_real_detections(tmp_path, memo_posture, camera):
    """A balancing person, BODY_25B of one camera, against the triangulation of four: the true one is among
    those left, and it is said that another motion is as likely."""
    folder = SHARED_DATA / "keypoints" / "pose2sim_balancing"
    if not folder.is_dir():
        pytest.skip(f"no keypoints in {folder} (set MEMO_SHARED_DATA)")
    code, said, complaint = memo_posture(
        folder / f"cam{camera}_json",
        *("--camera", folder / "Calib_qualisys.toml", "--camera-name", f"cam_{camera}", "--fps", "60"),
        *("--rules", "physical", "--out", tmp_path),
    )
    assert (code, complaint) == (0, "") and len(said.splitlines()) <= 6
    document = json.loads((tmp_path / "postures.json").read_text())
    truth = triangulated(folder / "S00_P00_T01_BalancingTrial_0-100_filt_butterworth.trc")
    assert len(document["per_frame"]) == len(truth) == 100
    found = zip(document["per_frame"], truth, strict=True)
    nearest_m = [nearest_group_m(frame["groups_m"], true) for frame, true in found]
    assert np.median(nearest_m) < 0.12 and max(nearest_m) < 0.2
    assert document["second"]["p"] > 0.2
    assert "mirrored with a probability of " in said


def nearest_group_m(groups_m, true):
    """Mean distance of the limb joints, both about the middle of the shoulders, in the nearest group."""
    limbs = np.array(groups_m, float)[:, [AT[name] for name in LIMB_JOINTS]]
    shape, true_shape = (points - points[..., :2, :].mean(axis=-2, keepdims=True) for points in (limbs, true))
    return np.nanmean(np.linalg.norm(shape - true_shape, axis=-1), axis=-1).min()


def triangulated(path):
    """(T, 12, 3) world, metres, of the limb joints in a TRC, whose y points up."""
    lines = path.read_text().splitlines()
    markers = [cell for cell in lines[3].split("\t") if cell.strip()][2:]
    values = np.array([[float(cell) for cell in line.split("\t") if cell.strip()] for line in lines[5:]])
    points = values[:, 2:].reshape(len(values), -1, 3)[..., [2, 0, 1]]
    short = [f"{name[0].upper()}{name.split('_')[1].capitalize()}" for name in LIMB_JOINTS]
    return points[:, [markers.index(name) for name in short]]


def test_what_is_undecided_does_not_depend_on_rounding(scene):
    """Segments that are too short to reach their rays have an extent of zero, or of a rounding error."""
    folder, truth = scene
    pixels = project(truth) + np.random.default_rng(3).normal(0, 3.0, (*truth.shape[:2], 2))
    lengths_m = {name: 0.94 * length_m for name, length_m in true_lengths(truth).items()}
    camera = memo.Camera.from_toml(folder / "camera.toml")

    def posture(noise_px):
        moved = pixels + np.random.default_rng(0).normal(0, noise_px, pixels.shape)
        points = memo.Keypoints.from_arrays(moved, names=JOINTS, fps=25, image_size=SIZE)
        return memo.posture(points, camera=camera, lengths=lengths_m, noise_px=3)

    as_given, nearly = posture(0.0), posture(1e-9)
    assert (as_given.gap_m > 0).sum() > 20
    np.testing.assert_allclose(nearly.p_mirrored, as_given.p_mirrored, atol=1e-4)
    np.testing.assert_array_equal(nearly.undecided_joints, as_given.undecided_joints)


def test_what_is_undecided_of_a_mirrored_scene_is_the_mirror_image(scene):
    """Camera and points mirrored, right and left exchanged: the same problem.

    Segments that are too short to reach their rays are among them.
    """
    folder, truth = scene
    pixels = project(truth) + np.random.default_rng(3).normal(0, 3.0, (*truth.shape[:2], 2))
    lengths_m = {name: 0.94 * length_m for name, length_m in true_lengths(truth).items()}
    camera = memo.Camera.from_toml(folder / "camera.toml")
    mirror = np.diag([-1.0, 1.0, 1.0])
    rotation, translation = mirror @ camera.rotation @ mirror, mirror @ camera.translation
    other_camera = memo.Camera(camera.matrix, rotation, translation, camera.size)
    other_pixels = pixels.copy()
    other_pixels[..., 0] = 2 * camera.matrix[0, 2] - pixels[..., 0]

    def exchanged(name):
        return name.replace("right", "-").replace("left", "right").replace("-", "left")

    def of_joints(name):
        return name if name in lengths_m else "_to_".join(reversed(name.split("_to_")))

    other_lengths_m = {of_joints(exchanged(name)): length_m for name, length_m in lengths_m.items()}
    other_names = [exchanged(name) for name in JOINTS]
    sides = [JOINTS.index(name) for name in other_names]

    def posture(pixels, names, camera, lengths_m):
        points = memo.Keypoints.from_arrays(pixels, names=names, fps=25, image_size=SIZE)
        return memo.posture(points, camera=camera, lengths=lengths_m, noise_px=3)

    found = posture(pixels, JOINTS, camera, lengths_m)
    other = posture(other_pixels, other_names, other_camera, other_lengths_m)
    assert (found.gap_m > 0).sum() > 20 and found.undecided_joints.sum() > 20
    np.testing.assert_allclose(other.smoothed_m[:, sides] * [-1, 1, 1], found.smoothed_m, atol=1e-6)
    np.testing.assert_allclose(other.p_mirrored[:, sides], found.p_mirrored, atol=1e-4)


def test_a_frame_is_undecided_if_a_joint_in_it_is(scene, tmp_path, memo_posture):
    """In the object, the sentence, the document and the page, as in the table."""
    folder, truth = scene
    noise = np.random.default_rng(3).normal(0, 3.0, (*truth.shape[:2], 2))
    path = write_table(tmp_path / "noisy.csv", truth, change=lambda pixels: pixels + noise)
    arguments = [path, "--camera", folder / "camera.toml", "--fps", RATE_HZ, "--noise-px", 3]
    code, said, _ = memo_posture(*arguments, "--height", 1.75, "--no-plots", "--out", tmp_path / "out")
    rows, _ = read_table(tmp_path / "out" / "postures.csv")
    frames = sum(any(float(row[f"{name}_p_mirrored"] or 0) > 0.2 for name in JOINTS) for row in rows)
    assert code == 0 and 0 < frames < FRAMES
    assert f"at least one joint is undecided in {frames} of {FRAMES} frames" in said
    assert json.loads((tmp_path / "out" / "postures.json").read_text())["undecided_frames"] == frames
    page = write_report(tmp_path / "out").path.read_text()
    assert f"Some joint is undecided in {frames} of {FRAMES} frames" in " ".join(page.split())
