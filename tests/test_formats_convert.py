"""`memo convert`, and motion files given to `memo pointlight`: what is said, written and refused."""

import csv
import io
import json
import os
from pathlib import Path

import ezc3d
import numpy as np
import pandas
import pytest
from memo.files import (
    JOINTS,
    TRACK_COLUMNS,
    read_track_csv,
    write_columns_csv,
    write_events_csv,
    write_track_csv,
)
from memo.formats import READERS, WRITERS, Motion, read_motion, write_motion
from memo.formats.clinical import PELVIC_TILT_DEG
from motions import shared_motion, stick_figure, walk

FRAMES = np.r_[10:40, 50:75]
"""Of the track: two walks with ten frames between them."""


@pytest.fixture
def memo_command(memo_command):
    """With the lines of complaints joined."""

    def run(*arguments):
        code, said, complaint = memo_command(*arguments)
        return code, said, " ".join(complaint.split())

    return run


def write_track(folder, times_s=None):
    """A folder as `memo track` writes it, with two walks."""
    folder.mkdir(exist_ok=True)
    points, _ = stick_figure(80, 25)
    columns = {name: np.zeros(len(FRAMES)) for name in TRACK_COLUMNS}
    columns |= {"frame": FRAMES, "time_s": FRAMES / 25 if times_s is None else times_s}
    columns["walk"] = (FRAMES >= 50).astype(int)
    columns["right_knee_deg"] = FRAMES + 0.5
    for k, joint in enumerate(JOINTS):
        for i, axis in enumerate("xyz"):
            columns[f"{joint}_{axis}_m"] = points[FRAMES, k, i]
    write_track_csv(folder / "track.csv", columns)
    event = {"frame": 15.5, "event": "heel_strike", "side": "right"}
    write_events_csv(folder / "events.csv", [event | {"time_s": 0.62}, event | {"time_s": 2.5, "walk": 1}])
    return points


def test_joints_that_are_those_of_average_gait_are_named_or_left_empty(tmp_path, memo_command):
    """`track.csv` has a posture in every frame, also where an angle was not measured."""
    write_track(tmp_path / "run")
    table = tmp_path / "run" / "track.csv"
    columns = read_track_csv(table)
    columns["left_elbow_deg"][:20] = np.nan
    columns["right_hip_deg"][5:8] = np.nan
    write_track_csv(table, columns)
    target = tmp_path / "walk.csv"
    code, out, _ = memo_command("convert", tmp_path / "run", target)
    assert code == 0
    said = "right knee in 3, right ankle in 3 and left wrist in 20."
    assert "in some of 55 frames, because an angle before them was not measured" in out and said in out
    assert np.isfinite(read_motion(target).points).all()

    angles = [name for name in columns if name.endswith("_deg") and not name.startswith("sd_")]
    write_track_csv(table, columns | {name: np.full(len(FRAMES), np.nan) for name in angles})
    code, out, _ = memo_command("convert", tmp_path / "run", target)
    assert code == 0
    assert "No angle was measured: joints beyond hips and shoulders are left empty." in out
    read = read_motion(target)
    known = {name for k, name in enumerate(read.names) if np.isfinite(read.points[:, k]).any()}
    assert known == {"right_shoulder", "left_shoulder", "right_hip", "left_hip"}


def test_a_track_is_written_in_every_format(tmp_path, memo_command):
    points = write_track(tmp_path / "run")
    for ending in ("trc", "c3d", "csv", "parquet", "mot", "sto"):
        target = tmp_path / "out" / f"walk.{ending}"
        code, out, err = memo_command("convert", tmp_path / "run", target)
        assert (code, err) == (0, "")
        assert "Read 55 frames, 12 points, 10 joint angles, 2 events, 0.40 to 2.96 s." in out
        assert "2 walks: between them the person was not tracked." in out
        up = "Z" if ending in ("c3d", "csv", "parquet") else "Y"
        assert out.endswith(f"Written to {target}, {up} up.\n")
        read = read_motion(target)
        assert read.angles["right_knee"][5] == 15.5 if ending != "trc" else not read.angles
        if ending in ("trc", "c3d"):
            assert len(read.times_s) == 65 and np.isnan(read.points[30:40]).all()
            assert np.nanmax(np.abs(read.points - points[10:75])) < 1e-4
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        f"walk.{ending}" for ending in ("c3d", "csv", "mot", "parquet", "sto", "trc")
    ]


def test_tables_keep_the_frame_numbers_of_the_input(tmp_path, memo_command):
    write_track(tmp_path / "run")

    def frames(source, *options):
        target = tmp_path / "again.csv"
        assert memo_command("convert", source, target, *options)[0] == 0
        with target.open(newline="") as file:
            return [int(row["frame"]) for row in csv.DictReader(file)]

    assert frames(tmp_path / "run") == FRAMES.tolist()
    assert frames(tmp_path / "run", "--walk", 1) == [*range(50, 75)]
    (tmp_path / "again.csv").rename(tmp_path / "table.csv")
    assert frames(tmp_path / "table.csv") == [*range(50, 75)]
    assert memo_command("convert", tmp_path / "run", tmp_path / "walk.c3d", "--quiet")[0] == 0
    assert frames(tmp_path / "walk.c3d") == [*range(10, 75)]
    resampled = frames(tmp_path / "run", "--rate", 50)
    assert resampled == [*range(len(resampled))], "these are not frames of the video"


def test_joints_get_the_names_of_pose2sim_and_keep_their_places(tmp_path, memo_command):
    points = write_track(tmp_path / "run")
    target = tmp_path / "walk.trc"
    assert memo_command("convert", tmp_path / "run", target, "--names", "pose2sim")[::2] == (0, "")
    read = read_motion(target)
    assert {"RShoulder", "LElbow", "RWrist", "LHip", "RKnee", "LAnkle"} < {*read.names}
    right_hip = read.points[:30, read.names.index("RHip")]
    np.testing.assert_allclose(right_hip, points[10:40, JOINTS.index("right_hip")], atol=1e-4)
    # Back again, and points that are no joints of memo.
    assert memo_command("convert", target, tmp_path / "back.csv", "--names", "memo")[0] == 0
    assert {*read_motion(tmp_path / "back.csv").names} == {*JOINTS}
    other = Motion(("LHip", "RHip", "Ball"), np.arange(3) / 25, np.zeros((3, 3, 3)))
    notes = write_motion(tmp_path / "ball.csv", other, names="memo")
    assert notes[0] == "Not joints of memo, so they keep their names: Ball."
    assert read_motion(tmp_path / "ball.csv").names == ("left_hip", "right_hip", "Ball")


def test_angles_for_gait2392_have_its_signs_and_no_arms(tmp_path, memo_command):
    write_track(tmp_path / "run")
    usual, target = tmp_path / "usual.mot", tmp_path / "walk.mot"
    assert memo_command("convert", tmp_path / "run", usual)[0] == 0
    code, out, _ = memo_command("convert", tmp_path / "run", target, "--names", "gait2392")
    assert code == 0
    arms = "right_shoulder, right_elbow, left_shoulder, left_elbow"
    assert f"The model has no arms: {arms} left out." in out
    tables = {path: path.read_text().partition("endheader\n")[2] for path in (usual, target)}
    rows = {path: np.genfromtxt(io.StringIO(told), names=True) for path, told in tables.items()}
    np.testing.assert_allclose(rows[target]["knee_angle_r"], -rows[usual]["knee_angle_r"])
    np.testing.assert_allclose(rows[target]["hip_flexion_r"], rows[usual]["hip_flexion_r"])
    assert "elbow_flex_r" not in rows[target].dtype.names
    # The pelvis of the unscaled models begins 1.4 cm apart along the walk and 1.2 cm in height.
    apart = [rows[target][f"pelvis_t{axis}"] - rows[usual][f"pelvis_t{axis}"] for axis in "xyz"]
    np.testing.assert_allclose(
        np.linalg.norm(apart, axis=0), np.hypot(0.0707 - 0.056276, 0.07849 - 0.0661), atol=1e-5
    )
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "walk.trc", "--names", "gait2392")
    assert code == 1 and "markers on the skin" in err and "--names pose2sim" in err


def test_clinical_hips_are_against_the_pelvis(tmp_path, memo_command):
    write_track(tmp_path / "run")
    target = tmp_path / "walk.mot"
    code, out, _ = memo_command("convert", tmp_path / "run", target, "--clinical", "--walk", 0)
    assert code == 0 and "the level of the hip curves is not measured" in out
    plain, raised = read_motion(tmp_path / "run", walk=0), read_motion(target)
    for name in ("right_hip", "left_hip"):
        np.testing.assert_allclose(raised.angles[name], plain.angles[name] + 11.4)
    np.testing.assert_allclose(raised.angles["right_knee"], plain.angles["right_knee"])
    for ending in (".trc", ".bvh"):
        code, said, err = memo_command("convert", tmp_path / "run", tmp_path / f"b{ending}", "--clinical")
        wanted = f"memo: --clinical: has no effect, as a {ending} file holds no joint angles"
        assert (code, said, err) == (1, "", wanted)
    code, _, err = memo_command("convert", target, tmp_path / "b.mot", "--clinical")
    assert code == 1 and "need a folder of `memo track`" in err


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_tables_name_the_reference_of_clinical_hips(tmp_path, memo_command, ending):
    if ending == "parquet":
        pytest.importorskip("pyarrow")
    write_track(tmp_path / "run")
    tables = {}
    for option in ("", "--clinical"):
        target = tmp_path / f"walk{option}.{ending}"
        code, _, err = memo_command(
            "convert", tmp_path / "run", target, "--walk", 0, *[option] * bool(option)
        )
        assert code == 0, err
        tables[option] = read_motion(target)
    plain, raised = tables[""], tables["--clinical"]
    for name in ("right_hip", "left_hip"):
        np.testing.assert_allclose(raised.angles[name], plain.angles[name] + 11.4, atol=2e-6)
    if ending == "csv":
        header = (tmp_path / "walk--clinical.csv").read_text().splitlines()[0].split(",")
        assert "right_hip_clinical_deg" in header and "right_hip_deg" not in header
        assert "right_knee_deg" in header and "right_knee_clinical_deg" not in header
        assert "right_hip_deg" in (tmp_path / "walk.csv").read_text().splitlines()[0].split(",")
    # The reference is known again when the table is read.
    code, _, err = memo_command("convert", tmp_path / f"walk--clinical.{ending}", tmp_path / "again.mot")
    assert code == 0, err
    head = (tmp_path / "again.mot").read_text().partition("endheader")[0].splitlines()
    assert any(line.startswith("hip_flexion_r: thigh against a pelvis tilted forwards") for line in head)
    code, _, err = memo_command("convert", tmp_path / f"walk--clinical.{ending}", tmp_path / "again.csv")
    assert code == 0 and "right_hip_clinical_deg" in (tmp_path / "again.csv").read_text().splitlines()[0], err


def test_files_with_angles_state_their_references(tmp_path, memo_command):
    write_track(tmp_path / "run")
    against = {
        "": "thigh against the vertical",
        "--clinical": "thigh against a pelvis tilted forwards by 11.4",
    }
    for option, hip in against.items():
        for name in ("walk.mot", "walk.c3d"):
            code, _, _ = memo_command(
                "convert", tmp_path / "run", tmp_path / name, "--walk", 0, *[option] * bool(option)
            )
            assert code == 0
        head = (tmp_path / "walk.mot").read_text().partition("endheader")[0].splitlines()
        assert any(line.startswith(f"hip_flexion_r: {hip}") for line in head)
        assert "knee_angle_l: shank against thigh, 0 if straight" in head
        point = ezc3d.c3d(str(tmp_path / "walk.c3d"))["parameters"]["POINT"]
        said = dict(zip(point["LABELS"]["value"], point["DESCRIPTIONS"]["value"], strict=True))
        assert (
            said["LHipAngles"].startswith(hip) and said["RKneeAngles"] == "shank against thigh, 0 if straight"
        )
        assert said["right_hip"] == ""


def test_plug_in_gait_states_hips_against_the_pelvis():
    """The equation of `memo.formats.clinical`, in the angles and joint centres of a clinical model."""
    motion = read_motion(shared_motion("mocap", "formats", "PiG__PiG_Motion-FlatFoot-Hole.c3d"))
    place = {name: motion.points[:, k] for k, name in enumerate(motion.names)}
    pelvis = place["PELO"][np.isfinite(place["PELO"][:, 0])]
    ahead = (pelvis[-1] - pelvis[0])[:2]
    ahead /= np.linalg.norm(ahead)

    def against_vertical(upper, lower):
        limb = place[lower] - place[upper]
        return np.degrees(np.arctan2(limb[:, :2] @ ahead, -limb[:, 2]))

    for side in ("right", "left"):
        letter = side[0].upper()
        thigh = against_vertical(f"{letter}FEP", f"{letter}FEO")
        shank = against_vertical(f"{letter}FEO", f"{letter}TIO")
        hip = motion.angles[f"{side}_hip"] - thigh - motion.angles[f"{letter}PelvisAngles_x"]
        assert abs(np.nanmean(hip)) < 0.6
        assert abs(np.nanmean(motion.angles[f"{side}_knee"] - (thigh - shank))) < 0.15
        level = np.nanmean(motion.angles[f"{side}_hip"] - thigh)
        assert abs(level - PELVIC_TILT_DEG[0]) < 2 * PELVIC_TILT_DEG[1]


def test_parquet_tells_its_up_axis(tmp_path, memo_command):
    points = write_track(tmp_path / "run")
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "walk.parquet", "--up", "y")
    assert (code, err) == (0, "")
    hip_up_m = pandas.read_parquet(tmp_path / "walk.parquet")["right_hip_y_m"]
    np.testing.assert_allclose(hip_up_m, points[FRAMES, JOINTS.index("right_hip"), 2], atol=1e-4)
    again = read_motion(tmp_path / "walk.parquet")
    np.testing.assert_allclose(again.points, points[FRAMES], atol=1e-4)


def test_keypoints_of_a_track(tmp_path, memo_command):
    write_track(tmp_path / "run")
    for target, said in [("a.json", "COCO results"), ("a_json", "OpenPose")]:
        code, out, err = memo_command("convert", tmp_path / "run", tmp_path / target)
        assert (code, err) == (0, "")
        assert said in out
        assert (tmp_path / target).exists()
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "b.txt", "--rate", 50)
    assert (code, err) == (1, "memo: --rate: has no meaning for MOTChallenge rows")
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "b.json", "--up", "y")
    assert (code, err) == (1, "memo: --up: has no meaning for COCO results")
    code, _, err = memo_command("convert", tmp_path / "nobody", tmp_path / "b.txt")
    assert code == 1 and "no such file or folder" in err
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "b.txt")
    assert (code, err) == (
        1,
        f"memo: {tmp_path / 'run'}: holds no run.json, so it is not the folder of a memo track",
    )


def test_one_walk_its_events_and_the_summary_as_json(tmp_path, memo_command):
    write_track(tmp_path / "run")
    target = tmp_path / "run" / "walk.c3d"  # beside what was read
    code, out, _ = memo_command("convert", tmp_path / "run", target, "--walk", 1, "--json", "--up", "y")
    summary = json.loads(out)
    assert (
        code == 0
        and summary["frames"] == 25
        and summary["up"] == "y"
        and summary["events"] == 1
        and summary["notes"] == []
    )
    assert summary["points"] == [*JOINTS] and summary["files"] == [str(target)]
    file = ezc3d.c3d(str(target))
    assert file["header"]["points"]["first_frame"] == 50
    assert file["parameters"]["EVENT"]["TIMES"]["value"].ravel().tolist() == [0, 2.5]
    assert file["parameters"]["POINT"]["Y_SCREEN"]["value"] == ["+Y"]
    code, _, err = memo_command("convert", tmp_path / "run", target, "--walk", 7)
    assert code == 1 and "there is no walk 7, only 0 to 1" in err


@pytest.mark.parametrize("at_once", [False, True])
def test_walks_of_different_people_are_not_joined(tmp_path, memo_command, at_once):
    times_s = FRAMES / 25 - (1.6 if at_once else 0.0) * (FRAMES >= 50)
    write_track(tmp_path / "run", times_s)
    columns = read_track_csv(tmp_path / "run" / "track.csv")
    write_track_csv(tmp_path / "run" / "track.csv", columns | {"person": columns["walk"]})
    for target in ("a.trc", "a.csv", "a.bvh"):
        code, said, err = memo_command("convert", tmp_path / "run", tmp_path / target)
        assert (code, said) == (1, "") and not (tmp_path / target).exists()
        assert "walks 0 and 1 are of different people: choose one of the walks 0 to 1 (memo convert " in err
        assert "--walk" in err and "memo track --follow" in err
        assert memo_command("convert", tmp_path / "run", tmp_path / target, "--walk", 1, "--quiet")[0] == 0
    assert len(read_motion(tmp_path / "a.csv").times_s) == 25


def test_bvh_takes_one_walk_or_says_why_not(tmp_path, memo_command):
    points = write_track(tmp_path / "run")
    target = tmp_path / "walk.bvh"
    code, _, err = memo_command("convert", tmp_path / "run", target)
    assert code == 1 and not target.exists()
    assert "is missing in 10 frames, the first at 1.6 s" in err and "--walk" in err
    code, out, _ = memo_command("convert", tmp_path / "run" / "track.csv", target, "--walk", 0)
    assert code == 0 and "A BVH file cannot store events: left out." in out
    read = read_motion(target)
    foot = read.points[:, read.names.index("LeftFoot")]
    assert np.abs(foot - points[10:40, JOINTS.index("left_ankle")]).max() < 3e-4


def test_irregular_stamps_are_refused_and_interpolated_on_demand(tmp_path, memo_command):
    times_s = 0.4 + np.cumsum(np.random.default_rng(0).uniform(0.02, 0.06, len(FRAMES)))
    write_track(tmp_path / "run", times_s)
    for ending in ("trc", "c3d", "bvh"):
        target = tmp_path / f"walk.{ending}"
        code, _, err = memo_command("convert", tmp_path / "run", target)
        assert code == 1 and "the time stamps have no constant rate (16" in err and "give --rate" in err
        assert not target.exists()
        assert memo_command("convert", tmp_path / "run", target, "--rate", 50, "--quiet") == (0, "", "")
        assert read_motion(target).at_constant_rate()[0] == pytest.approx(50)
    span_s = times_s[-1] - times_s[0]
    said = memo_command("convert", tmp_path / "run", tmp_path / "walk.trc", "--rate", 50)[1]
    assert said.startswith("Read 55 frames, 12 points, 10 joint angles, 2 events, ")
    assert f"Interpolated linearly to 50 Hz: {int(span_s * 50) + 1} frames." in said
    said = memo_command("convert", tmp_path / "run", tmp_path / "walk.trc", "--rate", 50, "--json")[1]
    summary = json.loads(said)
    assert (summary["frames"], summary["last_s"]) == (55, pytest.approx(times_s[-1], abs=1e-6))
    assert memo_command("convert", tmp_path / "run", tmp_path / "walk.csv")[0] == 0
    assert read_motion(tmp_path / "walk.csv").times_s == pytest.approx(times_s, abs=1e-6)


def test_postures_are_converted_with_short_gaps_filled(tmp_path, memo_command):
    points, times_s = stick_figure(30)
    points[5:7, 2] = np.nan
    columns = {"frame": np.arange(30), "time_s": times_s}
    for k, joint in enumerate(JOINTS):
        columns |= {f"{joint}_{axis}_m": points[:, k, i] for i, axis in enumerate("xyz")}
        columns[f"{joint}_sd_m"] = np.zeros(30)
    (tmp_path / "run").mkdir()
    write_columns_csv(tmp_path / "run" / "postures.csv", columns)
    target = tmp_path / "postures.bvh"
    assert memo_command("convert", tmp_path / "run", target)[0] == 1
    (tmp_path / "run" / "postures.json").write_text("{}")
    wanted = f"memo: {tmp_path / 'run'}: a folder of `memo posture` holds joints in space, and no keypoints"
    for keypoints in ("a.json", "a_json"):
        code, said, err = memo_command("convert", tmp_path / "run", tmp_path / keypoints)
        assert (code, said, err) == (1, "", wanted)
    code, out, _ = memo_command("convert", tmp_path / "run", target, "--fill", 0.1)
    assert code == 0 and "Interpolated linearly: 2 missing values." in out
    assert read_motion(target).metadata["up"] == "y"


def test_up_axis_and_unit_can_be_given(tmp_path, memo_command):
    write_motion(tmp_path / "a.trc", walk(), "z")
    code, _, _ = memo_command("convert", tmp_path / "a.trc", tmp_path / "b.csv", "--from-up", "y")
    x, y, z = np.moveaxis(walk().points, -1, 0)
    assert code == 0
    assert np.allclose(
        read_motion(tmp_path / "b.csv").points, np.stack([x, -z, y], -1), atol=1e-6, equal_nan=True
    )
    write_motion(tmp_path / "a.bvh", walk(gaps=False))
    assert memo_command("convert", tmp_path / "a.bvh", tmp_path / "m.csv", "--unit", "mm")[0] == 0
    small, right = read_motion(tmp_path / "m.csv"), read_motion(tmp_path / "a.bvh")
    assert np.allclose(10 * small.points, right.points, atol=1e-5)


def test_mistakes_are_told_in_one_line_before_any_work(tmp_path, memo_command):
    write_motion(tmp_path / "a.trc", walk())
    a, b = tmp_path / "a.trc", tmp_path / "b.c3d"
    (tmp_path / "empty").mkdir()
    before = a.read_bytes()
    for arguments, says in (
        ((a, a), "a.trc: is the input; write to another place"),
        ((a, tmp_path / "b.xls"), "b.xls: the ending must be one of .bvh, .c3d, .csv, .json, .mot"),
        ((a, tmp_path / "empty.xls"), "the ending must be one of"),
        ((tmp_path / "none.trc", b), "none.trc: no such file or folder"),
        ((tmp_path / "empty", b), "empty: holds neither track.csv of `memo track` nor postures.csv"),
        ((a, b, "--rate", 0), "--rate 0 must be positive and finite"),
        ((a, b, "--rate", "1e12"), "at 1e+12 Hz are more than"),
        ((a, b, "--unit", "feet"), "--unit feet is neither m, cm, mm nor a number of metres"),
        ((a, b, "--fps", 50), "the file has its own: leave out a frame rate (--fps)"),
        ((a, b, "--unit", "mm"), "the file has its own: leave out a unit (--unit)"),
        ((a, b, "--walk", 0), "a walk can be chosen only for track.csv"),
        ((a, tmp_path / "a.mot"), "holds joint angles, and there are none"),
        ((a, a / "b.c3d"), "cannot be written to"),
    ):
        code, out, err = memo_command("convert", *arguments)
        assert (code, out) == (1, "") and says in err and err.startswith("memo: "), err
    assert memo_command("convert", a, b, "--up", "x")[0] == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.trc", "empty"]
    assert a.read_bytes() == before


@pytest.mark.parametrize("folder", ["file", "file/below", "/proc", "/proc/self/below"])
def test_a_folder_that_cannot_be_is_told_before_the_source_is_read(tmp_path, memo_command, folder):
    """Not even root can write into a file, or make one in /proc."""
    if folder.startswith("/proc") and not Path("/proc/self").is_dir():
        pytest.skip("no /proc here")
    (tmp_path / "file").write_text("mine")
    (tmp_path / "a.trc").write_text("broken")
    code, said, err = memo_command("convert", tmp_path / "a.trc", tmp_path / folder / "a.c3d")
    assert (code, said) == (1, "") and f"{tmp_path / folder}: cannot be written to" in err
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is unwritable to root")
def test_an_unwritable_folder_is_told_before_the_source_is_read(tmp_path, memo_command):
    (tmp_path / "sealed").mkdir(mode=0o500)
    (tmp_path / "a.trc").write_text("broken")
    code, _, err = memo_command("convert", tmp_path / "a.trc", tmp_path / "sealed" / "a.c3d")
    assert code == 1 and "cannot be written to" in err


def test_damaged_tracks_are_told_with_the_column(tmp_path, memo_command):
    write_track(tmp_path / "run")
    table = tmp_path / "run" / "track.csv"
    table.write_text(table.read_text().replace("25.50", "many", 1))
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "x.trc")
    assert code == 1 and "run: track.csv: column right_knee_deg: could not convert" in err
    table.write_text(table.read_text().split("\n")[0] + "\n")
    code, _, err = memo_command("convert", tmp_path / "run", tmp_path / "x.trc")
    assert code == 1 and "track.csv has no frames: nobody was tracked" in err


def test_what_fails_half_way_leaves_nothing(tmp_path, monkeypatch):
    def fail(*_):
        raise OSError("the disk is full")

    for ending in sorted(WRITERS):
        with monkeypatch.context() as patch:
            patch.setattr(os, "replace", fail)
            with pytest.raises(OSError, match="full"):
                write_motion(tmp_path / f"a{ending}", walk(gaps=False))
    assert [*tmp_path.iterdir()] == []


def test_another_format_is_one_entry_in_each_table(tmp_path, memo_command, monkeypatch):
    def write_names(path, motion, up):
        path.write_text(" ".join(motion.names))
        return []

    def read_names(path, given):
        names = path.read_text().split()
        return Motion(tuple(names), [0.0], np.zeros((1, len(names), 3)))

    monkeypatch.setitem(WRITERS, ".names", write_names)
    monkeypatch.setitem(READERS, ".names", read_names)
    write_motion(tmp_path / "a.trc", walk())
    assert memo_command("convert", tmp_path / "a.trc", tmp_path / "a.names")[0] == 0
    assert memo_command("convert", tmp_path / "a.names", tmp_path / "b.csv")[0] == 0
    assert read_motion(tmp_path / "b.csv", rate_hz=None).names == JOINTS


@pytest.mark.parametrize(
    "path",
    ["formats/cmu_12_01_walk.bvh", "formats/PiG__PiG_Motion-FlatFoot-Hole.c3d", "joints/CMU_12_01.csv"],
)
def test_real_motion_files_make_point_light_displays(tmp_path, memo_command, path):
    source = shared_motion("mocap", *path.split("/"))
    code, _, err = memo_command("pointlight", source, "--out", tmp_path, "--locomotion", "translating")
    assert (code, err) == (0, "")
    with open(tmp_path / "dots.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    if path.endswith(".csv"):
        return
    motion = read_motion(source)
    ankle = motion.names.index({"b": "RightFoot", "P": "RTIO"}["b" if "bvh" in path else "P"])
    v_px = np.array([float(row["RAN_v_px"]) for row in rows])
    assert np.allclose(v_px, -200 * motion.points[:, ankle, 2], atol=1e-3)
    assert {name for name in rows[0] if name.endswith("_u_px")} >= {"RSH_u_px", "LAN_u_px", "HEAD_u_px"}


def test_pointlight_says_which_joints_a_file_lacks(tmp_path, memo_command):
    write_motion(tmp_path / "markers.trc", Motion(("RSHO", "LKNE"), np.arange(9) / 10, np.zeros((9, 2, 3))))
    code, _, err = memo_command("pointlight", tmp_path / "markers.trc", "--out", tmp_path / "out")
    assert code == 1 and "markers.trc: no points for right_shoulder" in err and "RSHO, LKNE" in err
    write_track(tmp_path / "run")
    code, out, _ = memo_command("pointlight", tmp_path / "run", "--out", tmp_path / "out")
    assert code == 0 and "12 dots" in out
    assert (Path(tmp_path) / "out" / "display.mp4").exists()
