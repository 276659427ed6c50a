"""MOTChallenge rows: written from tracks, read by motmetrics, and what is refused."""

import memo
import motmetrics
import numpy as np
import pytest
from conftest import shared_video
from memo.files import write_track_csv
from memo.formats import FormatError
from memo.formats.motchallenge import boxes_from_contours, read_motchallenge, write_motchallenge
from memo.run import RunError, Source, write_run


@pytest.fixture(scope="module")
def scene():
    return memo.demo_scene(0, frames=50)


@pytest.fixture(scope="module")
def track(scene):
    """A walk tracked in a drawn scene."""
    return memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)


def overlap(one, other):
    """Intersection over union of boxes (N, 4) left, top, right, bottom."""
    low, high = np.maximum(one[:, :2], other[:, :2]), np.minimum(one[:, 2:], other[:, 2:])
    common = np.clip(high - low, 0, None).prod(axis=1)
    areas = [(boxes[:, 2:] - boxes[:, :2]).prod(axis=1) for boxes in (one, other)]
    return common / (sum(areas) - common)


def test_rows_are_read_by_motmetrics(tmp_path, track):
    write_motchallenge(tmp_path / "walk.txt", track)
    table = motmetrics.io.loadtxt(str(tmp_path / "walk.txt"), fmt="mot15-2D").reset_index()
    boxes = boxes_from_contours(map(track.contours, range(len(track))))
    np.testing.assert_array_equal(table["FrameId"], track.columns["frame"] + 1)
    assert set(table["Id"]) == {1}
    # motmetrics takes the 1 of MATLAB's pixels off; its names of the last columns are those of 2016.
    np.testing.assert_allclose(table[["X", "Y"]], boxes[:, :2], atol=0.0051)
    np.testing.assert_allclose(table[["Width", "Height"]], boxes[:, 2:] - boxes[:, :2], atol=0.0051)
    np.testing.assert_allclose(table["Confidence"], track.columns["similarity"], atol=1e-5)
    np.testing.assert_allclose(table["ClassId"], track.columns["x_m"], atol=1e-4)
    np.testing.assert_allclose(table["Visibility"], track.columns["y_m"], atol=1e-4)
    assert [line.split(",")[-1] for line in (tmp_path / "walk.txt").read_text().split()] == len(boxes) * [
        "0.0000"
    ]


def test_boxes_hold_the_walker_that_was_drawn(tmp_path, scene, track):
    """Against the drawing: the box of all that differs from the wall."""
    write_motchallenge(tmp_path / "walk.txt", track)
    rows = read_motchallenge(tmp_path / "walk.txt")
    change = np.abs(scene.frames.astype(float) - np.median(scene.frames, axis=0)) > 30
    seen = []
    for frame in rows["frame"]:
        v, u = np.nonzero(change[frame])
        low = [np.percentile(u, 0.5), np.percentile(v, 0.5)]
        seen.append([*low, np.percentile(u, 99.5), np.percentile(v, 99.5)])
    assert np.median(overlap(boxes_of(rows), np.array(seen))) > 0.85


def saved(folder, scene, track, columns=None):
    """The folder that `memo track` makes of a track, or of the columns of its table."""
    folder.mkdir()
    write_track_csv(folder / "track.csv", track.columns if columns is None else columns)
    write_run(folder, track, {"height_m": scene.height_m}, Source(None, (0, None), 25.0), len(scene.frames))
    return folder


def boxes_of(rows):
    low = np.column_stack([rows["left_px"], rows["top_px"]])
    return np.column_stack([low, low + np.column_stack([rows["width_px"], rows["height_px"]])])


def test_a_saved_track_has_the_boxes_of_its_contours(tmp_path, scene, track):
    folder = saved(tmp_path / "run", scene, track)
    for name in (folder, folder / "track.csv"):
        assert write_motchallenge(tmp_path / "walk.txt", name) == len(track)
        boxes = boxes_of(read_motchallenge(tmp_path / "walk.txt"))
        # The table has tenths of millimetres.
        np.testing.assert_allclose(
            boxes, boxes_from_contours(map(track.contours, range(len(track)))), atol=0.06
        )


def test_rows_without_a_place_have_no_box(tmp_path, scene, track):
    columns = {name: values.copy() for name, values in track.columns.items()}
    columns["x_m"][3] = columns["phase"][5] = columns["similarity"][7] = np.nan
    write_motchallenge(tmp_path / "walk.txt", saved(tmp_path / "run", scene, track, columns))
    rows = read_motchallenge(tmp_path / "walk.txt")
    kept = np.delete(np.arange(len(track)), [3, 5])
    np.testing.assert_array_equal(rows["frame"], columns["frame"][kept])
    assert rows["conf"][5] == -1
    np.testing.assert_allclose(rows["x_m"], columns["x_m"][kept], atol=1e-4)


def test_y_up_is_turned_about_x(tmp_path, track):
    write_motchallenge(tmp_path / "z.txt", track)
    write_motchallenge(tmp_path / "y.txt", track, up="y")
    first = [list(map(float, (tmp_path / f"{up}.txt").read_text().split("\n")[0].split(","))) for up in "zy"]
    (x, y, z), (right, height, back) = first[0][7:], first[1][7:]
    assert (right, height, back) == (x, 0, -y) and z == 0 and y != 0
    z_up, y_up = read_motchallenge(tmp_path / "z.txt"), read_motchallenge(tmp_path / "y.txt", up="y")
    assert all(np.array_equal(z_up[name], y_up[name]) for name in z_up)
    with pytest.raises(FormatError, match='up must be "z" or "y"'):
        write_motchallenge(tmp_path / "x.txt", track, up="x")


def test_the_rows_of_pets_are_read_as_motmetrics_reads_them():
    clip = shared_video("pets09_s2l1")
    rows = read_motchallenge(clip / "gt.txt")
    table = motmetrics.io.loadtxt(str(clip / "gt.txt"), fmt="mot15-2D").reset_index()
    np.testing.assert_array_equal(rows["frame"] + 1, table["FrameId"])
    np.testing.assert_array_equal(rows["id"], table["Id"])
    boxes = np.column_stack([rows[name] for name in ("left_px", "top_px", "width_px", "height_px")])
    np.testing.assert_allclose(boxes, table[["X", "Y", "Width", "Height"]], atol=1e-9)
    # Its x, y are where the people stand: below the middle of their boxes.
    camera = memo.Camera.from_file(clip / "View_001.xml")
    feet = camera.project(np.column_stack([rows["x_m"], rows["y_m"], rows["z_m"]]))
    below = np.column_stack([boxes[:, 0] + boxes[:, 2] / 2, boxes[:, 1] + boxes[:, 3]])
    assert np.median(np.linalg.norm(feet - below, axis=1)) < 3


@pytest.mark.parametrize(
    ("row", "expected"),
    [
        ("1, 2, 3, 4, 5, 6", [0, 2, 2, 3, 5, 6, np.nan, np.nan, np.nan, np.nan]),
        ("1 2 3 4 5 6 0.5", [0, 2, 2, 3, 5, 6, 0.5, np.nan, np.nan, np.nan]),
        ("1,-1,3,4,5,6,0.5,-1,-1,-1", [0, -1, 2, 3, 5, 6, 0.5, np.nan, np.nan, np.nan]),
        ("1,2,3,4,5,6,1,1,0.8", [0, 2, 2, 3, 5, 6, 1, np.nan, np.nan, np.nan]),
        ("7,2,3,4,5,6,1,-1,2,0", [6, 2, 2, 3, 5, 6, 1, -1, 2, 0]),
    ],
)
def test_rows_of_all_years(tmp_path, row, expected):
    (tmp_path / "a.txt").write_text(f"\ufeff{row}\r\n\n", encoding="utf-8")
    columns = read_motchallenge(tmp_path / "a.txt")
    np.testing.assert_array_equal([float(values[0]) for values in columns.values()], expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "has no rows"),
        ("1,2,3\n", "line 1: 3 numbers; MOTChallenge rows have 6, 7, 9 or 10"),
        ("1,2,3,4,5,6\n1,2,3,4,5,six\n", "line 2: 'six' is not a number"),
        ("1,2,3,4,5,nan\n", "'nan' is not a number"),
        ("1,2,3,4,5,1e999\n", "'1e999' is not a number"),
        ("0,2,3,4,5,6\n", "number of a frame, from 1"),
        ("1.5,2,3,4,5,6\n", "number of a frame, from 1"),
        ("1,2,3,4,-5,6\n", "a box of -5 by 6 pixels"),
        (b"1,2,3,4,5,6\n\xff", "not text in UTF-8"),
    ],
)
def test_broken_rows_are_refused(tmp_path, text, message):
    path = tmp_path / "a.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(FormatError, match=message) as error:
        read_motchallenge(path)
    assert str(path) in str(error.value) and "\n" not in str(error.value)


def test_what_is_no_run_is_refused(tmp_path, scene, track):
    with pytest.raises(FormatError, match="cannot be read"):
        read_motchallenge(tmp_path / "nowhere.txt")
    folder = saved(tmp_path / "run", scene, track, {**track.columns, "walk": np.full(len(track), 1)})
    with pytest.raises(RunError, match=r"run\.json: has 1 walk, the table has a walk 1"):
        write_motchallenge(tmp_path / "a.txt", folder)
    (folder / "run.json").unlink()
    with pytest.raises(RunError, match=r"holds no run\.json, so it is not the folder of a memo track"):
        write_motchallenge(tmp_path / "a.txt", folder)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
