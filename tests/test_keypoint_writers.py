"""Keypoints written in formats of choice, and read back by somebody else's readers."""

import json
import math

import memo
import numpy as np
import pandas as pd
import pytest
from detector_files import SPORTS2D, deeplabcut, trc_text
from memo.files import TRACK_COLUMNS, write_track_csv
from memo.formats.parquet import write_parquet
from memo.keypoints import (
    Keypoints,
    KeypointsError,
    keypoints_of_track,
    layouts,
    read_keypoints,
    write_coco,
    write_csv,
    write_keypoints,
    write_openpose,
)
from pose_format.utils.openpose import load_openpose_directory
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from test_keypoints import figure, pose2sim_sample, triples


def walker(layout, count=6):
    """Keypoints of a figure that moves to the right; one point and one frame are missing."""
    names = layouts()[layout]
    values = np.array([figure(names, 100 + 8 * t, seed=t) for t in range(count)])
    values[1, 4, :2] = np.nan
    values[2, :, :2] = np.nan
    return Keypoints.from_arrays(
        values[..., :2], values[..., 2], names=layout, fps=25, frames=np.arange(7, 7 + count)
    )


def point(keypoints, name):
    return keypoints.points[:, keypoints.names.index(name)]


# OpenPose, read by pose-format.

#: BODY_25's points as OpenPose's documentation numbers them.
BODY_25 = (
    *("nose", "neck", "right_shoulder", "right_elbow", "right_wrist", "left_shoulder", "left_elbow"),
    *("left_wrist", "mid_hip", "right_hip", "right_knee", "right_ankle", "left_hip", "left_knee"),
    *("left_ankle", "right_eye", "left_eye", "right_ear", "left_ear", "left_big_toe", "left_small_toe"),
    *("left_heel", "right_big_toe", "right_small_toe", "right_heel"),
)


def in_pose_format(folder):
    """(T, 25, 2) points and (T, 25) confidences of the one person, as pose-format reads a folder."""
    body = load_openpose_directory(str(folder)).body
    assert body.data.shape[1] == 1
    return np.asarray(body.data.filled(np.nan))[:, 0, :25], body.confidence[:, 0, :25]


@pytest.mark.parametrize("layout", ["BODY_25", "BODY_25B", "HALPE_26", "COCO_17"])
def test_openpose_files_are_read_by_pose_format(tmp_path, layout):
    keypoints = walker(layout)
    left_out = write_openpose(tmp_path / "walk", keypoints)
    assert set(left_out) == set(keypoints.names) - set(BODY_25)
    points, confidence = in_pose_format(tmp_path / "walk")
    assert len(points) == 13 and (confidence[:7] == 0).all()  # pose-format counts frames from 0
    for index, name in enumerate(BODY_25):
        if name in keypoints.names:
            np.testing.assert_allclose(points[7:, index], point(keypoints, name), rtol=1e-6)
            scores = keypoints.scores[:, keypoints.names.index(name)]
            np.testing.assert_allclose(confidence[7:, index], scores, rtol=1e-6)
        elif name == "neck":
            middle = (point(keypoints, "right_shoulder") + point(keypoints, "left_shoulder")) / 2
            np.testing.assert_allclose(points[7:, index], middle, rtol=1e-6)
        elif name == "mid_hip":
            middle = (point(keypoints, "right_hip") + point(keypoints, "left_hip")) / 2
            np.testing.assert_allclose(points[7:, index], middle, rtol=1e-6)
        else:
            assert (confidence[:, index] == 0).all()


def test_openpose_files_have_openpose_s_names_and_fields(tmp_path):
    write_openpose(tmp_path / "walk", walker("BODY_25"), name="cam1")
    names = sorted(file.name for file in (tmp_path / "walk").iterdir())
    assert names == [f"cam1_{frame:012d}_keypoints.json" for frame in range(7, 13)]
    frame = json.loads((tmp_path / "walk" / names[0]).read_text())
    assert frame["version"] == 1.3 and list(frame["people"][0])[:2] == ["person_id", "pose_keypoints_2d"]
    assert len(frame["people"][0]["pose_keypoints_2d"]) == 75
    assert json.loads((tmp_path / "walk" / names[2]).read_text())["people"] == []
    missing = json.loads((tmp_path / "walk" / names[1]).read_text())["people"][0]["pose_keypoints_2d"]
    assert missing[12:15] == [0, 0, 0]


@pytest.mark.parametrize(("write", "layout"), [(write_openpose, "BODY_25"), (write_coco, "COCO_17")])
def test_what_is_written_is_read_again(tmp_path, write, layout):
    keypoints = walker(layout)
    assert write(tmp_path / "out", keypoints) == ()
    again = read_keypoints(tmp_path / "out", fps=25)
    assert again.layout == layout
    np.testing.assert_array_equal(again.frames, keypoints.frames)
    np.testing.assert_array_equal(again.points, keypoints.points)
    np.testing.assert_array_equal(again.scores, keypoints.scores)


def test_an_openpose_folder_replaces_an_earlier_one_and_no_other(tmp_path):
    write_openpose(tmp_path / "walk", walker("BODY_25"))
    keypoints = walker("BODY_25").replaced(walker("BODY_25").points + 1, walker("BODY_25").scores)
    write_openpose(tmp_path / "walk", keypoints)
    np.testing.assert_array_equal(read_keypoints(tmp_path / "walk", fps=25).points, keypoints.points)
    with pytest.raises(KeypointsError, match="holds other files"):
        write_openpose(tmp_path / "walk", walker("BODY_25", 3))
    with pytest.raises(KeypointsError, match="finite"):
        write_openpose(
            tmp_path / "new", keypoints.replaced(np.full_like(keypoints.points, math.inf), keypoints.scores)
        )
    assert [entry.name for entry in tmp_path.iterdir()] == ["walk"]


def test_half_a_character_in_json_is_written_as_it_was_read(tmp_path):
    frame = {"note": "\ud800", "people": [{"pose_keypoints_2d": triples(figure(layouts()["BODY_25"]))}]}
    (tmp_path / "json").mkdir()
    (tmp_path / "json" / "a_1.json").write_text(json.dumps(frame))
    found = read_keypoints(tmp_path / "json", fps=25)
    found.replaced(found.points + 1, found.scores).write(tmp_path / "out")
    assert json.loads((tmp_path / "out" / "a_1.json").read_bytes())["note"] == "\ud800"


# COCO, read and judged by pycocotools.


def ground_truth(path, keypoints):
    """COCO annotations of the keypoints, made here."""
    annotations = []
    for frame, points in zip(keypoints.frames.tolist(), keypoints.points, strict=True):
        seen = np.isfinite(points).all(axis=1)
        if seen.any():
            low, size = points[seen].min(axis=0), np.ptp(points[seen], axis=0)
            triple = [
                [*map(float, p), 2] if there else [0, 0, 0] for p, there in zip(points, seen, strict=True)
            ]
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": frame,
                    "category_id": 1,
                    "keypoints": [number for one in triple for number in one],
                    "num_keypoints": int(seen.sum()),
                    "bbox": [*low.tolist(), *size.tolist()],
                    "area": float(size.prod()),
                    "iscrowd": 0,
                }
            )
    images = [{"id": frame, "width": 640, "height": 640} for frame in keypoints.frames.tolist()]
    path.write_text(
        json.dumps(
            {"images": images, "annotations": annotations, "categories": [{"id": 1, "name": "person"}]}
        )
    )
    return COCO(str(path))


def average_precision(truth, results):
    judged = COCOeval(truth, truth.loadRes(str(results)), "keypoints")
    judged.evaluate()
    judged.accumulate()
    judged.summarize()
    return judged.stats[0]


def test_coco_results_are_read_and_judged_by_pycocotools(tmp_path):
    keypoints = walker("COCO_17")
    truth = ground_truth(tmp_path / "truth.json", keypoints)
    assert write_coco(tmp_path / "results.json", keypoints) == ()
    results = truth.loadRes(str(tmp_path / "results.json"))
    assert results.getImgIds() == list(range(7, 13))
    for frame, points in zip(keypoints.frames.tolist(), keypoints.points, strict=True):
        entries = results.loadAnns(results.getAnnIds(imgIds=[frame]))
        assert len(entries) == (0 if frame == 9 else 1)
        for entry in entries:
            x, y = np.array(entry["keypoints"]).reshape(17, 3)[:, :2].T
            np.testing.assert_array_equal(np.column_stack([x, y]), np.nan_to_num(points))
    assert average_precision(truth, tmp_path / "results.json") == pytest.approx(1)
    moved = keypoints.replaced(keypoints.points + 40, keypoints.scores)
    write_coco(tmp_path / "moved.json", moved)
    assert average_precision(truth, tmp_path / "moved.json") < 0.5


def test_coco_takes_seventeen_of_halpe_s_points(tmp_path):
    keypoints = walker("HALPE_26")
    left_out = write_coco(tmp_path / "results.json", keypoints)
    assert "neck" in left_out and "left_heel" in left_out and len(left_out) == 9
    entries = json.loads((tmp_path / "results.json").read_text())
    assert entries[0]["image_id"] == 7 and entries[0]["category_id"] == 1
    assert entries[0]["score"] == pytest.approx(keypoints.scores[0, :17].mean())
    values = np.array(entries[0]["keypoints"]).reshape(17, 3)
    np.testing.assert_array_equal(values[:, :2], keypoints.points[0, :17])


# Tables, read by pandas.


def test_tables_are_read_by_pandas_and_lose_nothing(tmp_path):
    keypoints = walker("HALPE_26")
    assert write_csv(tmp_path / "a.csv", keypoints) == ()
    table = pd.read_csv(tmp_path / "a.csv")
    assert table["frame"].tolist() == list(range(7, 13)) and len(table.columns) == 2 + 3 * 26
    np.testing.assert_allclose(table["left_heel_u_px"], point(keypoints, "left_heel")[:, 0], rtol=1e-15)
    again = read_keypoints(tmp_path / "a.csv")
    assert again.names == keypoints.names
    np.testing.assert_array_equal(again.points, keypoints.points)
    np.testing.assert_array_equal(again.scores, keypoints.scores)
    np.testing.assert_array_equal(again.times_s, keypoints.times_s)


# A table of Parquet, a track, arrays.


def track_columns(frames):
    """Columns of a track with joints in the picture."""
    rng = np.random.default_rng(5)
    columns = {name: np.round(rng.uniform(1, 500, len(frames)), 2) for name in TRACK_COLUMNS}
    return columns | {
        "frame": np.array(frames),
        "walk": np.zeros(len(frames), np.int64),
        "person": np.zeros(len(frames), np.int64),
        "time_s": np.array(frames) / 25,
    }


@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_the_folder_of_a_track_gives_its_projected_joints(tmp_path, kind):
    columns = track_columns([3, 4, 6])
    if kind == "csv":
        write_track_csv(tmp_path / "track.csv", columns)
    else:
        write_parquet(tmp_path / "track.parquet", columns)
    expected = keypoints_of_track(columns)
    for path in (tmp_path, tmp_path / f"track.{kind}"):
        found = read_keypoints(path)
        assert found.names == expected.names and found.frames.tolist() == [3, 4, 5, 6]
        np.testing.assert_array_equal(found.points, expected.points)
        assert np.isnan(found.points[2]).all() and found.scores[[0, 1, 3]].min() == 1
        np.testing.assert_allclose(found.times_s, [0.12, 0.16, 0.20, 0.24])


def test_a_track_goes_to_openpose(tmp_path):
    keypoints = keypoints_of_track(track_columns([0, 1]))
    assert write_openpose(tmp_path / "walk", keypoints) == ()
    points, _ = in_pose_format(tmp_path / "walk")
    np.testing.assert_allclose(
        points[:, BODY_25.index("left_knee")], point(keypoints, "left_knee"), rtol=1e-6
    )
    with pytest.raises(KeypointsError, match="two walks in one frame"):
        keypoints_of_track(track_columns([0, 0]))
    with pytest.raises(KeypointsError, match="without rows"):
        keypoints_of_track(track_columns([]))


@pytest.mark.parametrize(
    ("points", "options", "message"),
    [
        ((3, 16, 2), {}, r"wanted points of shape \(T, 17, 2\), got \(3, 16, 2\)"),
        ((0, 17, 2), {}, "wanted points of shape"),
        ((3, 17, 2), {"scores": np.ones((2, 17))}, "wanted scores of shape"),
        ((3, 17, 2), {"fps": 0}, "frame rate must be positive"),
        ((3, 17, 2), {"fps": None}, "either times_s or fps"),
        ((3, 17, 2), {"fps": None, "times_s": [0, 2, 1]}, "increasing times_s"),
        ((3, 17, 2), {"frames": [0, 1, 1]}, "increasing frame numbers"),
        ((3, 17, 2), {"frames": [0, 1.5, 2]}, "increasing frame numbers"),
        ((3, 17, 2), {"frames": [0, 1, 10**8]}, "only 3 of them exist"),
        ((3, 17, 2), {"names": "COCO_71"}, "did you mean"),
        ((3, 17, 2), {"names": ["C7"] * 17}, "names of different known joints"),
        ((3, 17, 2), {"scores": np.full((3, 17), np.nan)}, "scores finite"),
        ((3, 17, 2), {"scores": np.ma.masked_all((3, 17))}, "scores finite"),
        ((3, 17, 2), {"frames": np.ma.array([0, 1, 2], mask=[0, 1, 0])}, "increasing frame numbers"),
        ((3, 17, 2), {"fps": [25]}, r"frame rate must be positive, got \[25\]"),
        ((3, 17, 2), {"image_size": (0, 5)}, r"image_size \(0, 5\): wanted width and height in whole pixels"),
        ((3, 17, 2), {"image_size": (640.5, 480)}, "width and height in whole pixels"),
        ((3, 17, 2), {"image_size": (True, 480)}, "width and height in whole pixels"),
        ((3, 17, 2), {"image_size": "ab"}, "image_size 'ab': wanted width and height in whole pixels"),
        ((3, 17, 2), {"image_size": 5}, "image_size 5: wanted width and height in whole pixels"),
        ((3, 17, 2), {"image_size": (1, 2, 3)}, "width and height in whole pixels"),
    ],
)
def test_arrays_that_are_no_keypoints_are_refused(points, options, message):
    with pytest.raises(KeypointsError, match=message):
        Keypoints.from_arrays(np.ones(points), **({"names": "COCO_17", "fps": 25} | options))


def test_masked_points_are_missing():
    names = ["left_hip", "right_hip", "left_knee", "right_knee"]
    values = np.random.default_rng(1).uniform(9, 99, (6, 4, 2))
    gone = np.zeros(values.shape, bool)
    gone[2], gone[3, 1, 0] = True, True
    masked = np.ma.array(np.where(gone, -9999, values), mask=gone)
    for points in (masked, list(masked), masked.astype(np.float32)):
        keypoints = Keypoints.from_arrays(points, names=names, fps=25)
        assert np.isnan(keypoints.points[2]).all() and np.isnan(keypoints.points[3, 1]).all()
        assert not keypoints.scores[2].any() and np.isfinite(keypoints.points).sum() == 48 - 10
    other = keypoints.replaced(masked, keypoints.scores)
    assert np.isnan(other.points[gone]).all() and np.isfinite(other.points[~gone]).all()
    whole = np.ma.masked_equal(np.array([[[1, 2]], [[-1, -1]]]), -1)
    assert np.isnan(Keypoints.from_arrays(whole, names=["nose"], fps=25).points[1]).all()
    with pytest.raises(TypeError, match="wanted real numbers, got complex ones"):
        Keypoints.from_arrays(values * 1j, names=names, fps=25)


def test_sizes_and_numbers_of_numpy_are_whole_numbers(tmp_path):
    keypoints = Keypoints.from_arrays(
        np.ones((2, 1, 2)), names=["nose"], fps=np.float32(25), image_size=np.array([640, 480])
    )
    assert keypoints.image_size == (640, 480)
    write_keypoints(tmp_path / "a.csv", keypoints, "csv")
    read = read_keypoints(tmp_path / "a.csv", person=np.int64(0), image_size=(np.int64(640), 480))
    assert read.image_size == (640, 480) and type(read.image_size[0]) is int


def test_columns_that_are_no_track_are_named():
    with pytest.raises(
        KeypointsError, match="not the columns of a track: no frame, time_s, right_shoulder_u"
    ):
        keypoints_of_track({})


def test_keypoints_from_arrays_are_mended_and_have_no_file_to_be_like(tmp_path):
    names = ["left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle"]
    keypoints = Keypoints.from_arrays(
        np.random.default_rng(1).uniform(0, 99, (40, 6, 2)), names=names, fps=25
    )
    assert memo.unswap(keypoints).keypoints.points.shape == (40, 6, 2)
    with pytest.raises(KeypointsError, match="use write_keypoints"):
        keypoints.write(tmp_path / "out.csv")
    write_keypoints(tmp_path / "out.csv", keypoints, "csv")
    np.testing.assert_array_equal(read_keypoints(tmp_path / "out.csv").points, keypoints.points)
    with pytest.raises(KeypointsError, match="unknown format 'c3d': wanted openpose, coco, csv"):
        write_keypoints(tmp_path / "out", keypoints, "c3d")


# TRC in pixels.


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_trc_in_pixels_is_read_and_written(tmp_path, end):
    values = np.round(np.random.default_rng(2).uniform(10, 900, (5, len(SPORTS2D), 2)), 3)
    values[1, 3] = np.nan
    path = tmp_path / "walk_px_person00.trc"
    text = trc_text(SPORTS2D, values, end=end)
    path.write_bytes(text.encode())
    found = read_keypoints(path)
    assert found.names[:4] == ("mid_hip", "right_hip", "right_knee", "right_ankle")
    assert found.names[-2:] == ("neck", "head_top") and found.layout is None
    np.testing.assert_array_equal(found.points, values)
    np.testing.assert_allclose(found.times_s, np.arange(5) / 25)
    assert found.frames.tolist() == [0, 1, 2, 3, 4] and found.scores[1, 3] == 0
    found.write(tmp_path / "same.trc")
    assert (tmp_path / "same.trc").read_bytes() == text.encode()
    points = found.points.copy()
    points[2, [1, 5]] = points[2, [5, 1]]
    found.replaced(points, found.scores).write(tmp_path / "out_px.trc")
    before, after = text.split(end), (tmp_path / "out_px.trc").read_bytes().decode().split(end)
    assert [row for row, (a, b) in enumerate(zip(before, after, strict=True)) if a != b] == [7]
    np.testing.assert_array_equal(read_keypoints(tmp_path / "out_px.trc").points, points)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace("_px_", "_m_"), "unit m: image points are needed"),
        (lambda text: text.replace("\t0.000\t", "\t0.500\t"), "points in space"),
        (lambda text: text.replace("LHip", "RHip"), "right_hip appears twice"),
        (lambda text: text.replace("RKnee", "right_kne"), "did you mean"),
        (lambda text: text[:200], "header alone has 5"),
        (lambda text: text.replace("\n1\t", "\n0\t"), "at two times"),
        (lambda text: text.replace("\n1\t0.040\t", "\n1\t0.000\t"), "time_s must increase"),
        (lambda text: text.replace("\n1\t", "\none\t"), "one is not a number"),
        (
            lambda text: text.replace("\n2\t0.080\t", "\n2\t0.080\n"),
            "has 2 cells; 35 for 11",
        ),
        (lambda text: "\n".join(text.split("\n")[:5]), "no person in any frame"),
    ],
)
def test_broken_trc_is_refused(tmp_path, change, message):
    text = trc_text(SPORTS2D, np.random.default_rng(2).uniform(10, 900, (5, len(SPORTS2D), 2)))
    path = tmp_path / "a.trc"
    path.write_text(change(text))
    assert change(text) != text
    with pytest.raises(KeypointsError, match=message) as error:
        read_keypoints(path)
    assert str(path) in str(error.value)


def test_trc_of_points_in_space_is_refused():
    with pytest.raises(KeypointsError, match="image points are needed"):
        read_keypoints(next(pose2sim_sample().glob("*.trc")))


# AlphaPose by image.


@pytest.mark.parametrize(("people", "points"), [("people", "pose_keypoints_2d"), ("bodies", "joints")])
def test_alphapose_in_openpose_s_and_cmu_s_form(tmp_path, people, points):
    """As AlphaPose's `write_json` writes `--format open` and `cmu`: one object, and a folder `sep-json`."""
    names = layouts()["COCO_18"]
    values = np.array([figure(names, 100 + 8 * t, seed=t) for t in range(3)])
    frames = {
        f"{t}.jpg": {"version": "AlphaPose v0.3", people: [{points: triples(values[t])}]} for t in range(3)
    }
    (tmp_path / "alphapose-results.json").write_text(json.dumps(frames))
    (tmp_path / "sep-json").mkdir()
    for name, frame in frames.items():
        (tmp_path / "sep-json" / name.replace(".jpg", ".json")).write_text(json.dumps(frame))
    for path in ("alphapose-results.json", "sep-json"):
        found = read_keypoints(tmp_path / path, fps=25)
        assert found.layout == "COCO_18"
        np.testing.assert_array_equal(found.points, values[..., :2])
        np.testing.assert_array_equal(found.scores, values[..., 2])
        found.replaced(found.points + 1, found.scores).write(tmp_path / f"out-{path}")
        np.testing.assert_array_equal(
            read_keypoints(tmp_path / f"out-{path}", fps=25).points, found.points + 1
        )
    frames["a_1.jpg"] = frames["1.jpg"]
    (tmp_path / "alphapose-results.json").write_text(json.dumps(frames))
    with pytest.raises(KeypointsError, match=r"1.jpg and a_1.jpg are both frame 1"):
        read_keypoints(tmp_path / "alphapose-results.json", fps=25)


# The command.


def test_unswap_writes_the_format_asked_for(tmp_path, memo_command):
    source = pose2sim_sample() / "cam02_json"
    expected = memo.unswap(read_keypoints(source, fps=60)).keypoints
    written = {"same": "cam02_json", "openpose": "cam02_json", "coco": "cam02.json", "csv": "cam02.csv"}
    for chosen, name in written.items():
        out = tmp_path / chosen
        code, said, _ = memo_command("unswap", source, "--fps", 60, "--format", chosen, "--out", out)
        assert code == 0 and name in said
        assert sorted(entry.name for entry in out.iterdir()) == sorted([name, "flips.csv"])
        found = read_keypoints(out / name, fps=60)
        common = [joint for joint in found.names if joint in expected.names]
        assert len(common) >= 17 and found.frames.tolist() == expected.frames.tolist()
        for joint in common:
            np.testing.assert_array_equal(point(found, joint), point(expected, joint))
        if chosen in ("openpose", "coco"):
            assert f"{chosen} cannot store upper_neck, head_top" in said
    points, _ = in_pose_format(tmp_path / "openpose" / "cam02_json")
    np.testing.assert_allclose(
        points[:, BODY_25.index("right_knee")], point(expected, "right_knee"), rtol=1e-6
    )


def test_unswap_of_parquet_needs_a_format(tmp_path, memo_command):
    write_parquet(tmp_path / "track.parquet", track_columns(list(range(30))))
    code, _, complaint = memo_command("unswap", tmp_path / "track.parquet", "--out", tmp_path / "out")
    assert code == 1 and "give --format" in complaint
    code, _, _ = memo_command(
        "unswap", tmp_path / "track.parquet", "--format", "csv", "--out", tmp_path / "out"
    )
    assert code == 0 and len(read_keypoints(tmp_path / "out" / "track.csv").names) == 12


def test_convert_says_that_others_are_left_out(tmp_path, memo_command):
    deeplabcut(tmp_path / "two.csv", individuals=("anna", "ben"))
    code, said, _ = memo_command("convert", tmp_path / "two.csv", tmp_path / "one.json", "--fps", 30)
    assert code == 0 and "Only the most prominent person was written: 1 other person is in " in said
