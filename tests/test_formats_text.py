"""TRC, MOT, STO and tables: what memo writes, read by others; real files and damaged ones, read by memo."""

import io

import numpy as np
import pandas as pd
import pytest
from memo.files import JOINTS
from memo.formats import FormatError, Motion, read_motion, write_motion
from motions import ANGLES, assert_same_points, shared_motion, walk


def by_pandas(path, skip, **options):
    return pd.read_csv(path, sep="\t", skiprows=skip, **options)


def test_a_stranger_reads_the_trc_that_is_written(tmp_path):
    motion, path = walk(start_s=0.4), tmp_path / "walk.trc"
    left_out = write_motion(path, motion)
    assert left_out == [
        "A TRC file cannot store events: left out.",
        "A TRC file cannot store joint angles: left out.",
    ]
    table = by_pandas(path, 6, header=None).to_numpy()
    assert table.shape == (20, 2 + 36) and table[:, 0].tolist() == [*range(1, 21)]
    assert np.allclose(table[:, 1], motion.times_s, atol=1e-7)
    x, y, z = (table[:, 2 + k :: 3] for k in range(3))
    for column, wanted in ((x, 0), (y, 2)):
        assert np.allclose(column, motion.points[..., wanted], atol=1e-7, equal_nan=True)
    assert np.allclose(z, -motion.points[..., 1], atol=1e-7, equal_nan=True)
    head = path.read_text().split("\n")[:6]
    assert head[2].split("\t") == ["50", "50", "20", "12", "m", "50", "1", "20"]
    assert [name for name in head[3].split("\t")[2:] if name] == [*JOINTS]
    assert head[4].split("\t")[2:5] == ["X1", "Y1", "Z1"] and head[5] == ""


def test_a_reader_of_trc_reads_it(tmp_path):
    trc = pytest.importorskip("trc")
    motion, path = walk(), tmp_path / "walk.trc"
    write_motion(path, motion, "z")
    data = trc.TRCData()
    data.load(str(path))
    assert tuple(data["Markers"]) == JOINTS and data["DataRate"] == 50 and data["Units"] == "m"
    for k, name in enumerate(JOINTS):
        assert np.allclose(data[name], motion.points[:, k], atol=1e-7, equal_nan=True)


def test_opensim_reads_trc_and_mot(tmp_path):
    opensim = pytest.importorskip("opensim")
    motion = walk()
    write_motion(tmp_path / "walk.trc", motion)
    write_motion(tmp_path / "walk.mot", motion)
    table = opensim.TimeSeriesTableVec3(str(tmp_path / "walk.trc"))
    assert tuple(table.getColumnLabels()) == JOINTS and table.getTableMetaDataString("Units") == "m"
    for frame in range(20):
        row = table.getRowAtIndex(frame)
        read = np.array([[row.getElt(0, k).get(axis) for axis in range(3)] for k in range(12)])
        wanted = motion.points[frame] @ [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
        assert np.allclose(read, wanted, atol=1e-7, equal_nan=True)
    angles = opensim.TimeSeriesTable(str(tmp_path / "walk.mot"))
    assert angles.getTableMetaDataString("inDegrees") == "yes"
    knee = angles.getDependentColumn("knee_angle_r").to_numpy()
    assert np.allclose(knee, np.delete(motion.angles["right_knee"], 4), atol=1e-7)
    assert opensim.Storage(str(tmp_path / "walk.mot")).getSize() == 19


def test_a_stranger_reads_the_mot_that_is_written(tmp_path):
    motion = walk()
    for name in ("walk.mot", "walk.sto"):
        left_out = write_motion(tmp_path / name, motion)
        assert left_out == [
            "Left out: 1 instant at which an angle or the pelvis is missing.",
            "A MOT or STO file cannot store events: left out.",
            "A MOT or STO file cannot store points except the pelvis: left out.",
        ]
        lines = (tmp_path / name).read_text().split("\n")
        assert lines[1:7] == ["version=1", "nRows=19", "nColumns=10", "inDegrees=yes", "up=Y", "endheader"]
        table = by_pandas(tmp_path / name, 7)
        assert [*table] == [
            *("time", "pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz"),
            *("hip_flexion_r", "knee_angle_r", "knee_angle_l"),
        ]
        known = np.isfinite(motion.angles["left_knee"])
        assert np.allclose(table["time"], motion.times_s[known], atol=1e-7)
        assert np.allclose(table["knee_angle_l"], motion.angles["left_knee"][known], atol=1e-7)
        read = read_motion(tmp_path / name)
        assert read.names == ("pelvis",) and read.notes == ()
        assert [*read.angles] == ["pelvis_tilt", "pelvis_list", "pelvis_rotation", *ANGLES]
        assert read.points[:, 0] == pytest.approx(table[["pelvis_tx", "pelvis_tz", "pelvis_ty"]] * [1, -1, 1])
        again = tmp_path / "again.mot"
        write_motion(again, read)
        assert np.allclose(by_pandas(again, 7)[[*table]], table, atol=1e-6)


@pytest.mark.parametrize("name", ["nRows=9", "datarows 9", "endheader", "inDegrees=no", "a\nnRows=9"])
def test_no_name_of_a_mot_is_a_key_of_its_header(tmp_path, name):
    motion, path = walk(), tmp_path / f"{name}.mot"
    write_motion(path, motion)
    head = path.read_text().split("\n")[:7]
    assert head[0] == f"motion {' '.join(name.split())}"
    assert head[1:] == ["version=1", "nRows=19", "nColumns=10", "inDegrees=yes", "up=Y", "endheader"]
    known = np.isfinite(motion.angles["left_knee"])
    assert np.allclose(read_motion(path).angles["right_hip"], motion.angles["right_hip"][known], atol=1e-6)


@pytest.mark.parametrize("title", ["nRows=9", "endheader", "inDegrees=no", "inDegrees = maybe"])
def test_lines_of_a_mots_header_count_more_than_its_title(tmp_path, title):
    path = tmp_path / "titled.mot"
    path.write_text(f"{title}\nnRows=1\ninDegrees=yes\nendheader\ntime\tlumbar\n0\t30\n")
    motion = read_motion(path)
    assert motion.angles["lumbar"].tolist() == [30] and motion.notes == ()
    # A table may have no title: the first line is then a key.
    path.write_text("inDegrees=no\nDataType=double\nendheader\ntime\tlumbar\n0\t1\n")
    assert read_motion(path).angles["lumbar"] == pytest.approx(180 / np.pi)
    path.write_text("endheader\ntime\tlumbar\n0\t1\n")
    assert read_motion(path).angles["lumbar"].tolist() == [1]


def about(axis, angle_deg):
    """(3, 3) rotation about x, y or z."""
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    turn = np.eye(3)
    turn[[i, j], [i, j]], turn[j, i], turn[i, j] = c, s, -s
    return turn


def test_the_legs_hang_from_the_pelvis_of_a_mot_as_they_do_in_the_motion(tmp_path):
    motion, path = walk(gaps=False), tmp_path / "walk.mot"
    write_motion(path, motion)
    hip, knee, other = (
        motion.points[:, JOINTS.index(f"{j}")] for j in ("right_hip", "right_knee", "left_hip")
    )
    y_up = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    for frame, row in by_pandas(path, 7).iterrows():
        pelvis = about("z", row.pelvis_tilt) @ about("x", row.pelvis_list) @ about("y", row.pelvis_rotation)
        right = (hip - other)[frame] @ y_up
        assert np.allclose(pelvis[:, 2], right / np.linalg.norm(right), atol=1e-7)
        # OpenSim's hip: flexion about Z, then adduction about X; the figure's thighs are not adducted.
        thigh = (knee - hip)[frame] @ y_up
        bent = pelvis @ about("z", row.hip_flexion_r) @ [0, -1, 0]
        assert np.allclose(bent, thigh / np.linalg.norm(thigh), atol=1e-7)
        # The hips of Rajagopal's model.
        place = [row.pelvis_tx, row.pelvis_ty, row.pelvis_tz]
        between = (hip + other)[frame] / 2 @ y_up
        assert np.allclose(pelvis.T @ (between - place), [-0.056276, -0.07849, 0], atol=1e-6)
    notes = write_motion(path, motion, "z")
    assert "OpenSim's pelvis angles are those of a world with Y up: left out." in notes
    assert "pelvis_tilt" not in by_pandas(path, 7)
    knee_alone = {"left_knee": motion.angles["left_knee"]}
    for angles in (knee_alone, knee_alone | {"right_hip": np.full(20, np.nan)}):
        no_hip = Motion(JOINTS, motion.times_s, motion.points, angles=angles)
        assert "position needs both hips, a knee and the flexion of that hip" in write_motion(path, no_hip)[0]
        assert [*by_pandas(path, 7)] == ["time", "knee_angle_l"]


def test_a_pelvis_that_is_hardly_known_is_named_among_what_is_left_out(tmp_path):
    motion, path = walk(gaps=False), tmp_path / "walk.mot"
    motion.points[:12, JOINTS.index("right_hip")] = np.nan
    motion.angles["right_knee"][:12] = np.nan
    pelvis = "pelvis_tilt, pelvis_list, pelvis_rotation, pelvis_tx, pelvis_ty, pelvis_tz"
    assert write_motion(path, motion) == [
        f"Left out, missing at most instants: {pelvis}, knee_angle_r.",
        "A MOT or STO file cannot store events: left out.",
        "A MOT or STO file cannot store points: left out.",
    ]
    assert [*by_pandas(path, 7)] == ["time", "hip_flexion_r", "knee_angle_l"]


def test_the_pelvis_angles_are_those_of_plug_in_gait(tmp_path):
    """Plug-in Gait's own come from four markers, memo's from the hips, the right knee and the flexions."""
    motion = read_motion(shared_motion("mocap", "formats", "PiG__PiG_Motion-FlatFoot-Hole.c3d"))
    write_motion(tmp_path / "pig.mot", motion)
    table = by_pandas(tmp_path / "pig.mot", 7)
    rows = np.searchsorted(motion.times_s, table["time"] - 1e-6)
    assert len(rows) > 300
    for name, axis in (("pelvis_tilt", "x"), ("pelvis_list", "y"), ("pelvis_rotation", "z")):
        off_deg = table[name] - motion.angles[f"RPelvisAngles_{axis}"][rows]
        # The walk goes along -X, and angles of Plug-in Gait are against the direction of the walk.
        assert np.abs(off_deg + 180 * (axis == "z")).max() < 0.01, name
    assert np.allclose(table["hip_adduction_l"], motion.angles["LHipAngles_y"][rows], atol=1e-6)


def test_the_states_file_of_a_simulation_is_read(tmp_path):
    path = tmp_path / "states.sto"
    labels = ["time", *(f"/jointset/ground_pelvis/pelvis_t{axis}/value" for axis in "xyz")]
    labels += [
        "/jointset/hip_r/hip_flexion_r/value",
        "/jointset/hip_r/hip_flexion_r/speed",
        "/forceset/soleus_r/x",
    ]
    row = "0 1 2 3 0.5 7 8".replace(" ", "\t")
    path.write_text("x\ninDegrees=no\nnColumns=7\nnRows=1\nendheader\n" + "\t".join(labels) + f"\n{row}\n")
    motion = read_motion(path)
    assert motion.names == ("pelvis",) and motion.points[0, 0].tolist() == [1, -3, 2]
    assert {name: values.tolist() for name, values in motion.angles.items()} == {
        "right_hip": [pytest.approx(np.rad2deg(0.5))]
    }
    assert (
        motion.notes[-1] == "Left out, not angles: 2 columns, the first /jointset/hip_r/hip_flexion_r/speed."
    )


def test_the_metres_of_a_planar_model_are_no_angles(tmp_path):
    path = tmp_path / "planar.mot"
    rows = "".join(f"{k}\t{-0.1 * k}\t{1 + 0.01 * k}\t0.95\t0.5\n" for k in range(3))
    labels = "time\tpelvis_tilt\tpelvis_tx\tpelvis_ty\thip_flexion_r\n"
    path.write_text("x\nnRows=3\nnColumns=5\ninDegrees=no\nendheader\n" + labels + rows)
    motion = read_motion(path)
    table = by_pandas(path, 5)
    assert motion.names == () and [*motion.angles] == ["pelvis_tilt", "right_hip"]
    assert motion.angles["pelvis_tilt"] == pytest.approx(np.rad2deg(table["pelvis_tilt"]))
    assert motion.notes == ("Left out, positions without all of x, y and z: pelvis_tx, pelvis_ty.",)
    write_motion(tmp_path / "again.mot", motion)
    assert [*by_pandas(tmp_path / "again.mot", 7)] == ["time", "pelvis_tilt", "hip_flexion_r"]


def test_knees_with_the_sign_of_gait2392_are_turned(tmp_path):
    path = tmp_path / "gait2392.mot"
    rows = "".join(f"{k}\t{-60 * k}\t{3 - k}\n" for k in range(3))
    path.write_text(
        "x\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\ntime\tknee_angle_r\tknee_angle_l\n" + rows
    )
    motion = read_motion(path)
    assert motion.angles["right_knee"].tolist() == [0, 60, 120]
    assert motion.angles["left_knee"].tolist() == [3, 2, 1]
    assert motion.notes == ("Knees bend towards negative angles, as in gait2392: their sign was reversed.",)


@pytest.mark.parametrize("up", ["z", "y"])
def test_memo_reads_its_own_tables_back(tmp_path, up):
    motion = walk(start_s=0.4)
    for name in ("walk.trc", "walk.csv"):
        write_motion(tmp_path / name, motion, up)
        read = read_motion(tmp_path / name)
        assert_same_points(read, motion, 1e-6)
        assert read.metadata["up"] == up and read.notes == ()
    assert np.allclose(read.angles["right_knee"], motion.angles["right_knee"], atol=1e-6)
    table = pd.read_csv(tmp_path / "walk.csv", comment="#")
    wanted = motion.points[:, 3, 2] if up == "z" else -motion.points[:, 3, 1]
    assert np.allclose(table["right_hip_z_m"], wanted, atol=1e-6)


def test_the_trc_of_pose2sim_is_read_as_pandas_reads_it():
    path = shared_motion(
        "keypoints", "pose2sim_balancing", "S00_P00_T01_BalancingTrial_0-100_filt_butterworth.trc"
    )
    motion = read_motion(path)
    table = by_pandas(path, 5, header=None).to_numpy()
    x, y, z = (table[:, 2 + k : 65 : 3] for k in range(3))
    assert np.array_equal(motion.points, np.stack([x, -z, y], axis=-1))
    assert np.array_equal(motion.times_s, table[:, 1])
    assert motion.names[:3] == ("RHip", "RKnee", "RAnkle") and motion.names[-1] == "LWrist"
    assert motion.notes == (
        "The file does not say which axis is up: Y was assumed, from the figure's posture.",
    )
    assert motion.at_constant_rate()[0] == 60
    assert np.array_equal(read_motion(path, up="z").points, np.stack([x, y, z], axis=-1))


def test_millimetres_empty_cells_and_missing_blank_rows_are_read(tmp_path):
    path = tmp_path / "old.trc"
    path.write_bytes(
        b"PathFileType\t4\t(X/Y/Z)\tC:\\trials\\old.trc\t\r\n"
        b"DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\r\n"
        b"120.000000\t120.000000\t2\t2\tmm\t120.000000\t1\t2\r\n"
        b"Frame#\tTime\tL.Kn\xe9e\t\t\tV Sacral\t\t\t\r\n"
        b"\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\r\n"
        b"1\t0.000\t1000\t2000\t3000\t\t\t\t\r\n"
        b"2\t0.008\t1001\t2000\t3000\t10\t20\t30\t\r\n"
    )
    motion = read_motion(path)
    assert motion.names == ("L.Knée", "V Sacral")
    assert motion.points[0, 0].tolist() == [1, -3, 2] and np.isnan(motion.points[0, 1]).all()
    assert motion.points[1, 1] == pytest.approx([0.01, -0.03, 0.02])


MOT = """old
datacolumns 5
datarows 2
range 0 0.1
endheader
Time hip_flexion_r toes_tx toes_ty toes_tz
0 10 1 2 3
0.1 20 1 2 3
"""


def test_the_older_header_radians_and_forces_of_mot(tmp_path):
    path = tmp_path / "old.mot"
    path.write_text(MOT)
    motion = read_motion(path)
    assert motion.names == ("toes",) and motion.points[0, 0].tolist() == [1, -3, 2]
    assert motion.angles["right_hip"].tolist() == [10, 20]
    assert [note.split(":")[0] for note in motion.notes] == [
        "The file does not say which axis is up",
        "The file does not say whether angles are in degrees",
    ]
    path.write_text(
        "x\nnRows=1\nnColumns=3\ninDegrees=no\nendheader\n\ntime\tlumbar\tground_force_vx\n0\t1\t700\n"
    )
    motion = read_motion(path)
    assert motion.angles["lumbar"] == pytest.approx([180 / np.pi])
    assert motion.notes == ("Left out, not angles: 1 column, the first ground_force_vx.",)


def edited(text, line, edit):
    lines = text.split("\n")
    lines[line - 1] = edit(lines[line - 1])
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("line", "edit", "says"),
    [
        (1, lambda line: "time,x", "line 1: not a TRC file"),
        (1, lambda line: line.replace("X/Y/Z", "X/Z/Y"), r"line 1: coordinates in the order '\(X/Z/Y\)'"),
        (1, lambda line: line.replace("up=Y", "up=X"), "the up axis is 'x'"),
        (
            3,
            lambda line: line.replace("\tm\t", "\tinch\t"),
            "line 3, field Units: 'inch', wanted m, cm or mm",
        ),
        (3, lambda line: line.replace("\t20\t12", "\t21\t12"), "field NumFrames: 21, but there are 20 rows"),
        (3, lambda line: line.replace("\t12\t", "\t13\t"), "line 4: 12 labels, NumMarkers is 13"),
        (
            3,
            lambda line: line.replace("\t12\t", "\t1e99\t"),
            "line 3, field NumMarkers: wanted a whole number",
        ),
        (3, lambda line: "100" + line[2:], "field DataRate: 100 Hz, but the column Time has 50 Hz"),
        (4, lambda line: line.replace("left_hip", "left_knee"), "point 'left_knee' is empty or occurs twice"),
        (5, lambda line: line.replace("Y3", "Z3"), "line 5: wanted X1 Y1 Z1"),
        (9, lambda line: line + "\t1", "line 9: 39 cells, wanted 38"),
        (
            9,
            lambda line: line.replace("NaN", "1e400"),
            "line 10|line 9, column right_.*: '1e400' is not a finite",
        ),
        (
            10,
            lambda line: line.replace("0.0600000", "0.04"),
            "line 10, column Time: 0.04 does not come after",
        ),
    ],
)
def test_what_is_wrong_in_a_trc_is_said_with_its_line(tmp_path, line, edit, says):
    path = tmp_path / "bad.trc"
    write_motion(path, walk())
    good = path.read_text()
    if "1e400" in says:
        line = 10
    path.write_text(edited(good, line, edit))
    assert path.read_text() != good
    with pytest.raises(FormatError, match=says) as caught:
        read_motion(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize(
    ("was", "becomes", "says"),
    [
        ("endheader", "", "no line endheader among the first"),
        ("datacolumns 5", "nColumns=4", "field ncolumns: 4, but there are 5 labels"),
        ("datarows 2", "nRows=9", "field nrows: 9, but there are 2 rows"),
        ("Time hip", "t hip", "line 6: wanted a row of labels that begins with time"),
        ("toes_ty", "toes_tx", "line 6: column toes_tx occurs twice"),
        ("0.1 20", "0.0 20", "line 8, column time: 0.0 does not come after 0"),
        ("20 1 2 3", "20 1 2", "line 8: 4 cells, wanted 5"),
        ("20 1 2 3", "20 1 2,5 3", "line 8, column toes_ty: '2,5' is not a finite number"),
        ("old", "inDegrees=maybe", "field inDegrees: 'maybe', wanted yes or no"),
        ("old", "DataType=Vec3", "field DataType: tables of vec3 are not read"),
    ],
)
def test_what_is_wrong_in_a_mot_is_said_with_its_line(tmp_path, was, becomes, says):
    path = tmp_path / "bad.mot"
    path.write_text(MOT.replace(was, becomes, 1))
    with pytest.raises(FormatError, match=says):
        read_motion(path)


def test_what_is_wrong_in_a_table_is_said_with_its_column(tmp_path):
    path = tmp_path / "bad.csv"
    for text, says in (
        ("time_s,a_x_m,a_y_m\n0,1,2\n", "point a has no column a_z_m"),
        ("time_s,a_x_m,a_y_m,a_z_m\n0,1,2,far\n", "row 0, column a_z_m: far is not a number"),
        ("time_s,knee_deg,a_x_m,a_y_m,a_z_m\n0,x,1,2,3\n", "row 0, column knee_deg: x is not a number"),
        ("a_x_m,a_y_m,a_z_m\n1,2,3\n", "no column time_s and no frame rate"),
        ("time_s,b\n0,1\n", "no columns NAME_x_m"),
    ):
        path.write_text(text)
        with pytest.raises(FormatError, match=says):
            read_motion(path)
    path.write_text("a_x_m,a_y_m,a_z_m\n1,2,3\n4,5,6\n")
    assert read_motion(path, rate_hz=4).times_s.tolist() == [0, 0.25]


def test_what_a_format_has_no_place_for_at_all_is_refused(tmp_path):
    points = Motion(("a",), [0, 1], np.zeros((2, 1, 3)))
    angles = Motion((), [0, 1], np.zeros((2, 0, 3)), angles={"knee": [1, 2]})
    broken = Motion(("a\tb",), [0, 1], np.zeros((2, 1, 3)))
    for name, motion, says in (
        ("x.mot", points, "holds joint angles, and there are none"),
        ("x.trc", angles, "holds points, and there are none"),
        ("x.csv", angles, "holds points, and there are none"),
        ("x.trc", broken, "not a valid label for a TRC file"),
        ("x.xyz", points, "cannot write a motion to .xyz: wanted .bvh, .c3d"),
    ):
        with pytest.raises(FormatError, match=says):
            write_motion(tmp_path / name, motion)
    assert [*tmp_path.iterdir()] == []
    (tmp_path / "x.xyz").touch()
    with pytest.raises(FormatError, match=r"cannot read a motion from .xyz"):
        read_motion(tmp_path / "x.xyz")


def test_a_table_is_read_by_the_oldest_parser_there_is(tmp_path):
    write_motion(tmp_path / "walk.csv", walk())
    text = (tmp_path / "walk.csv").read_text()
    table = np.genfromtxt(io.StringIO(text), delimiter=",", names=True)
    assert np.allclose(table["left_ankle_z_m"], walk().points[:, -1, 2], atol=1e-6)


@pytest.mark.parametrize(
    ("unit", "unit_m", "prefix"), [("mm", 0.001, "body_"), ("cm", 0.01, ""), ("m", 1, "")]
)
def test_tables_without_a_unit_are_read_in_the_one_that_fits(tmp_path, unit, unit_m, prefix):
    """FreeMoCap's and anipose's tables: NAME_x without a unit, no times."""
    motion, path = walk(), tmp_path / "body_3d_xyz.csv"
    columns = {
        f"{prefix}{name}_{axis}": motion.points[:, k, i] / unit_m
        for k, name in enumerate(JOINTS)
        for i, axis in enumerate("xyz")
    }
    pd.DataFrame(columns).to_csv(path, index=False)
    with pytest.raises(FormatError, match="no column time_s and no frame rate in a comment: give --fps"):
        read_motion(path)
    read = read_motion(path, rate_hz=50)
    assert np.allclose(read.points, motion.points, equal_nan=True)
    assert read.notes == (
        "The file does not say which axis is up: Z was assumed, from the figure's posture.",
        f"The file names no unit: {unit} was assumed, which makes the legs 0.87 m long.",
    )
    found = read_motion(path, rate_hz=50, unit_m=2 * unit_m, up="z")
    assert np.allclose(found.points, 2 * motion.points, equal_nan=True) and found.notes == ()
    path.write_text("# metres, Z up, 50 Hz\n" + path.read_text())
    assert np.allclose(read_motion(path).points, motion.points / unit_m, equal_nan=True)
    hand = [column for column in columns if "hip" not in column]
    pd.DataFrame(columns)[hand].to_csv(path, index=False)
    read = read_motion(path, rate_hz=50)
    assert read.notes[1] == "The file names no unit, and has no legs to measure: m was assumed."


def test_units_that_fit_nobody_or_are_named_twice_are_refused(tmp_path):
    motion, path = walk(gaps=False), tmp_path / "walk.csv"
    write_motion(path, motion)
    with pytest.raises(FormatError, match="the columns name their unit: leave out a unit"):
        read_motion(path, unit_m=0.001)
    table = pd.read_csv(path)
    table.columns = [name.removesuffix("_m") for name in table.columns]
    table.loc[:, [name for name in table if name[-2:] in ("_x", "_y", "_z")]] *= 20
    table.to_csv(path, index=False)
    with pytest.raises(FormatError, match=r"legs of 17.4 fit none: give --unit"):
        read_motion(path)


@pytest.mark.parametrize("up", ["z", "y"])
def test_the_up_axis_of_a_trc_that_does_not_say_it_is_the_one_along_which_the_figure_stands(tmp_path, up):
    motion, path = walk(), tmp_path / "walk.trc"
    write_motion(path, motion, up)
    path.write_text(path.read_text().replace(f"\tup={up.upper()}\n", "\n", 1))
    read = read_motion(path)
    said = f"The file does not say which axis is up: {up.upper()} was assumed, from the figure's posture."
    assert read.notes == (said,) and read.metadata["up"] == up
    assert np.allclose(read.points, motion.points, atol=1e-6, equal_nan=True)
    lying = Motion(JOINTS, motion.times_s, motion.points[..., [2, 0, 1]])
    write_motion(path, lying, "y")
    path.write_text(path.read_text().replace("\tup=Y\n", "\n", 1))
    assert "Y was assumed, as OpenSim's files have" in read_motion(path).notes[0]
