"""C3D: what memo writes, read by ezc3d and c3d; real and older files, read by memo."""

import struct

import c3d
import ezc3d
import numpy as np
import pytest
from memo.files import JOINTS
from memo.formats import FormatError, Motion, read_motion, write_motion
from motions import ANGLES, assert_same_points, shared_motion, walk

BLOCK = 512


def by_ezc3d(path):
    """(T, P, 3) millimetres, labels and parameters, as ezc3d reads them."""
    file = ezc3d.c3d(str(path))
    parameters = file["parameters"]
    labels = [*parameters["POINT"]["LABELS"]["value"]]
    for number in range(2, 50):
        labels += parameters["POINT"].get(f"LABELS{number}", {"value": []})["value"]
    return file["data"]["points"][:3].transpose(2, 1, 0), labels, parameters


def by_c3d(path):
    """(T, P, 5) millimetres, residual and camera count, as the Python library reads them."""
    with open(path, "rb") as file:
        reader = c3d.Reader(file)
        frames = np.array([points for _, points, _ in reader.read_frames(copy=True)])
        return frames, [label.strip() for label in reader.point_labels], reader


def test_others_read_the_points_angles_and_events_written(tmp_path):
    motion, path = walk(start_s=0.4), tmp_path / "walk.c3d"
    assert write_motion(path, motion) == []
    points, labels, parameters = by_ezc3d(path)
    assert tuple(labels[:12]) == JOINTS and labels[12:] == ["RHipAngles", "RKneeAngles", "LKneeAngles"]
    assert np.isnan(points[:, :12]).tolist() == np.isnan(motion.points).tolist()
    assert np.nanmax(np.abs(points[:, :12] - 1000 * motion.points)) < 2e-4
    for k, name in enumerate(ANGLES):
        assert np.allclose(points[:, 12 + k, 0], motion.angles[name], atol=1e-5, equal_nan=True)
    event = parameters["EVENT"]
    assert event["USED"]["value"] == [2]
    assert event["LABELS"]["value"] == ["Foot Strike", "Foot Off"]
    assert event["CONTEXTS"]["value"] == ["Right", "Left"]
    assert np.allclose(event["TIMES"]["value"], [[0, 0], [0.5234, 0.65]])
    assert parameters["POINT"]["UNITS"]["value"] == ["mm"]
    assert parameters["POINT"]["ANGLES"]["value"] == labels[12:]
    assert parameters["POINT"]["Y_SCREEN"]["value"] == ["+Z"]
    frames, labels, reader = by_c3d(path)
    assert tuple(labels[:12]) == JOINTS
    assert reader.first_frame == 21 and reader.last_frame == 40 and reader.point_rate == 50
    invalid = frames[:, :12, 3] == -1
    assert invalid.tolist() == np.isnan(motion.points[..., 0]).tolist()
    assert np.abs(frames[:, :12, :3] - 1000 * motion.points)[~invalid].max() < 2e-4


def test_memo_reads_back_all_of_it(tmp_path):
    motion, path = walk(start_s=0.4), tmp_path / "walk.c3d"
    for up in ("z", "y"):
        write_motion(path, motion, up)
        read = read_motion(path)
        assert_same_points(read, motion, 2e-7)
        assert read.metadata["up"] == up and read.notes == ()
        assert [event[1:] for event in read.events] == [event[1:] for event in motion.events]
        assert np.allclose([e.time_s for e in read.events], [e.time_s for e in motion.events], atol=1e-6)
        assert set(read.angles) == set(ANGLES)
        for name in ANGLES:
            assert np.allclose(read.angles[name], motion.angles[name], atol=1e-5, equal_nan=True)
    points, _, _ = by_ezc3d(path)  # with Y up: the world's z is the file's y
    assert np.nanmax(np.abs(points[:, :12, 1] - 1000 * motion.points[..., 2])) < 2e-4


def test_more_frames_points_and_events_than_the_old_counters_hold(tmp_path):
    path = tmp_path / "many.c3d"
    long = Motion(("a",), np.arange(70_000) / 200, np.arange(210_000.0).reshape(-1, 1, 3) / 1e4)
    write_motion(path, long)
    assert np.abs(by_ezc3d(path)[0] - 1000 * long.points).max() < 2e-3
    assert_same_points(read_motion(path), long, 2e-6)
    names = tuple(f"marker_{k}" for k in range(600))
    base = walk(frames=300)
    many_events = tuple(
        base.events[0]._replace(time_s=k / 100, kind=("heel_strike", "toe_off")[k % 2]) for k in range(400)
    )
    wide = Motion(names, base.times_s, np.random.default_rng(0).normal(size=(300, 600, 3)), many_events)
    write_motion(path, wide)
    points, labels, parameters = by_ezc3d(path)
    assert tuple(labels) == names and np.abs(points - 1000 * wide.points).max() < 1e-3
    assert len(parameters["EVENT"]["LABELS"]["value"]) == 255
    assert len(parameters["EVENT"]["LABELS2"]["value"]) == 145
    read = read_motion(path)
    assert_same_points(read, wide, 1e-6)
    assert [e.kind for e in read.events] == [e.kind for e in many_events]


def test_a_real_file_is_read_as_ezc3d_reads_it():
    path = shared_motion("mocap", "formats", "PiG__PiG_Motion-FlatFoot-Hole.c3d")
    motion = read_motion(path)
    points, labels, parameters = by_ezc3d(path)
    picked = points[:, [labels.index(name) for name in motion.names]] * 0.001
    assert np.array_equal(picked, motion.points, equal_nan=True)
    knee = points[:, labels.index("RKneeAngles"), 0]
    assert np.array_equal(knee, motion.angles["right_knee"], equal_nan=True)
    assert motion.points.shape == (320, 113, 3) and motion.times_s[0] == 1.42
    event = parameters["EVENT"]
    kinds = {"Foot Strike": "heel_strike", "Foot Off": "toe_off"}
    columns = zip(
        event["TIMES"]["value"][1], event["LABELS"]["value"], event["CONTEXTS"]["value"], strict=True
    )
    assert [*motion.events] == sorted((s, kinds[label], side.lower()) for s, label, side in columns)
    assert motion.notes == (
        "Left out: 54 forces, moments or powers.",
        "Left out: 380 analog values per frame.",
    )


@pytest.mark.parametrize("ending", [".c3d", ".trc", ".csv", ".mot"])
def test_a_real_file_survives_every_format(tmp_path, ending):
    motion = read_motion(shared_motion("mocap", "formats", "PiG__PiG_Motion-FlatFoot-Hole.c3d"))
    path = tmp_path / f"again{ending}"
    write_motion(path, motion)
    read = read_motion(path)
    if ending == ".mot":
        kept = np.searchsorted(motion.times_s, read.times_s - 1e-6)
        assert len(kept) > 200
        assert read.angles["right_hip"] == pytest.approx(motion.angles["right_hip"][kept], abs=1e-6)
        return
    assert_same_points(read, motion, 1e-6)
    if ending == ".c3d":
        assert read.events == motion.events and [*read.angles] == [*motion.angles]
        for name, values in motion.angles.items():
            assert np.array_equal(read.angles[name], values, equal_nan=True)


def vax(values):
    """32-bit floats in DEC's F format: 16-bit words swapped, exponent larger by two."""
    words = (np.asarray(values, np.float32) * np.float32(4)).view("<u2").reshape(-1, 2)
    return np.ascontiguousarray(words[:, ::-1]).tobytes()


def older(data, processor, whole_numbers):
    """A file written by memo as programs on another processor, or with integers, would have written it."""
    order = ">" if processor == 86 else "<"
    real = vax if processor == 85 else lambda values: np.asarray(values, order + "f4").tobytes()
    out = bytearray(data)
    scale = 0.1 if whole_numbers else -1.0

    def swap(at, kind):
        if kind == 2:
            out[at : at + 2] = struct.pack(order + "H", *struct.unpack("<H", data[at : at + 2]))
        else:
            out[at : at + 4] = real(np.frombuffer(data[at : at + 4], "<f4"))

    for at in (2, 4, 6, 8, 10, 16, 18, 298):
        swap(at, 2)
    out[12:16] = real([scale])
    swap(20, 4)
    out[BLOCK + 3] = processor
    at = BLOCK + 4
    while data[at]:
        length, group = data[at], data[at + 1]
        (offset,) = struct.unpack_from("<h", data, at + 2 + length)
        swap(at + 2 + length, 2)
        if group < 128:
            kind, rank = struct.unpack_from("<bB", data, at + 4 + length)
            begin = at + 6 + length + rank
            count = int(np.prod(list(data[at + 6 + length : begin])))
            for k in range(count if kind > 1 else 0):
                swap(begin + kind * k, kind)
            if data[at + 2 : at + 2 + length] == b"SCALE":
                out[begin : begin + 4] = real([scale])
        at += 2 + length + offset
    start = (struct.unpack_from("<H", data, 16)[0] - 1) * BLOCK
    frames, points = struct.unpack_from("<4H", data, 2)[3], struct.unpack_from("<H", data, 2)[0]
    values = np.frombuffer(data, "<f4", 4 * frames * points, start).reshape(-1, 4).copy()
    if whole_numbers:
        values[:, :3] = np.round(values[:, :3] / scale)
        return bytes(out[:start]) + values.astype(order + "i2").tobytes()
    return bytes(out[:start]) + real(values.ravel())


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize("whole_numbers", [False, True])
def test_processors_and_integers_are_read_as_another_library_reads_them(tmp_path, processor, whole_numbers):
    motion, path = walk(), tmp_path / "old.c3d"
    write_motion(path, motion)
    path.write_bytes(older(path.read_bytes(), processor, whole_numbers))
    read = read_motion(path)
    assert_same_points(read, motion, 6e-5 if whole_numbers else 2e-7)
    assert [e[1:] for e in read.events] == [e[1:] for e in motion.events]
    frames, _, _ = by_c3d(path)
    known = frames[:, :12, 3] >= 0
    assert np.isfinite(read.points[..., 0]).tolist() == known.tolist()
    assert np.abs(frames[:, :12, :3] - 1000 * read.points)[known].max() < 1e-3


def test_header_events_count_where_there_is_no_group(tmp_path):
    path = tmp_path / "header.c3d"
    write_motion(path, Motion(("a",), 1 + np.arange(10) / 10, np.zeros((10, 1, 3))))
    data = bytearray(path.read_bytes())
    struct.pack_into("<H", data, 300, 2)
    struct.pack_into("<2f", data, 304, 0.25, 0.5)
    data[396:404] = b"RHS LTO "
    path.write_bytes(data)
    assert [tuple(event) for event in read_motion(path).events] == [
        (1.25, "heel_strike", "right"),
        (1.5, "toe_off", "left"),
    ]


def wrong(data, at, replacement):
    return data[:at] + replacement + data[at + len(replacement) :]


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (lambda data: b"", "byte 1: not a C3D file"),
        (lambda data: wrong(data, 1, b"Q"), "byte 1: not a C3D file"),
        (lambda data: wrong(data, 0, b"\xff"), "byte 0: the parameters begin at block 255"),
        (lambda data: wrong(data, 515, b"\x57"), "byte 515: processor 87"),
        (lambda data: wrong(data, 2, b"\xff\xff"), "65535 points in the header, parameter POINT:USED has 15"),
        (lambda data: data[:-600], "room for 20 frames of 240 bytes is needed"),
        (lambda data: data.replace(b"mm", b"ly"), "parameter POINT:UNITS: 'ly', wanted m, cm or mm"),
        (lambda data: data.replace(b"+Z", b"+X"), r"the up axis is '\+X'"),
        (lambda data: wrong(data, 523, b"\xff\x7f"), "byte 516, parameter TRIAL: .* outside the section"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, damage, says):
    path = tmp_path / "bad.c3d"
    write_motion(path, walk())
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(FormatError, match=says) as caught:
        read_motion(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_loop_in_the_parameters_ends(tmp_path):
    path = tmp_path / "loop.c3d"
    write_motion(path, walk())
    data = path.read_bytes()
    at = data.index(b"LABELS") + 6
    path.write_bytes(wrong(data, at, struct.pack("<h", -40)))
    with pytest.raises(FormatError, match="parameter LABELS: the next one is -40 bytes further"):
        read_motion(path)


def test_labels_that_fit_no_file_are_refused(tmp_path):
    for name, says in (("é", "ASCII"), ("x" * 128, "127 ASCII"), ("RKneeAngles", "label of an angle")):
        motion = Motion((name,), [0, 1], np.zeros((2, 1, 3)), angles={"right_knee": [0, 0]})
        with pytest.raises(FormatError, match=says):
            write_motion(tmp_path / "x.c3d", motion)
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize(
    ("start_s", "first", "says"),
    [
        (0.52, 13, None),
        (0.5204, 13, None),  # a stamp in milliseconds would be as far off
        (0.513, 13, "this motion, from 0.513 s, begins at 0.52 s"),
        (-1.013, 0, "this motion, from -1.013 s, begins at 0 s"),
    ],
)
def test_a_change_of_the_first_time_is_reported(tmp_path, start_s, first, says):
    motion, path = walk(rate_hz=25, start_s=start_s), tmp_path / "walk.c3d"
    notes = write_motion(path, motion)
    assert notes == ([f"A C3D file counts whole frames from 0 s: {says}."] if says else [])
    file = ezc3d.c3d(str(path))
    assert file["header"]["points"]["first_frame"] == first
    # The events are as far from the first frame as before.
    times_s = file["parameters"]["EVENT"]["TIMES"]["value"][1]
    assert np.allclose(times_s - first / 25, [0.1234, 0.25], atol=1e-6)


def test_angles_that_would_share_a_place_are_refused(tmp_path):
    angles = {"foo": [0.0, 1], "foo_y": [2.0, 3]}
    write_motion(tmp_path / "x.c3d", Motion(("a",), [0, 1], np.zeros((2, 1, 3)), angles=angles))
    points, labels, _ = by_ezc3d(tmp_path / "x.c3d")
    assert labels == ["a", "foo"] and points[:, 1].tolist() == [[0, 2, 0], [1, 3, 0]]
    (tmp_path / "x.c3d").unlink()
    for one, other, label in (("foo", "foo_x", "foo"), ("right_knee", "RKneeAngles_x", "RKneeAngles")):
        for names in ((one, other), (other, one)):
            motion = Motion(("a",), [0, 1], np.zeros((2, 1, 3)), angles={key: [7, 7] for key in names})
            says = f"angles {names[0]} and {names[1]} are both x of the label {label}"
            with pytest.raises(FormatError, match=says):
                write_motion(tmp_path / "x.c3d", motion)
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("up", ["z", "y"])
def test_without_y_screen_up_is_the_axis_along_which_the_figure_stands(tmp_path, up):
    motion, path = walk(), tmp_path / "walk.c3d"
    write_motion(path, motion, up)
    path.write_bytes(path.read_bytes().replace(b"Y_SCREEN", b"Q_SCREEN"))
    read = read_motion(path)
    said = f"The file does not say which axis is up: {up.upper()} was assumed, from the figure's posture."
    assert read.notes == (said,)
    assert np.allclose(read.points, motion.points, atol=1e-6, equal_nan=True)
