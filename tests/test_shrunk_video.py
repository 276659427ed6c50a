"""A large video that is averaged down: whatever carries pixels has those of the video as it was given.

The scene is drawn small and each pixel of it repeated n times each way, with a rest at the right and at the
bottom that does not fill n pixels. Averaged, it is the small scene again, so its track is known; the pixels
of the large video follow from where the centres of n pixels lie, and from its own camera.
"""

import base64
import csv
import json
import re
import shutil
import sys
from types import SimpleNamespace

import av
import memo
import numpy as np
import pytest
from conftest import grey_video, ran
from memo import cli
from memo.explain import explain
from memo.files import JOINTS, read_track_csv
from memo.formats.motchallenge import read_motchallenge
from memo.keypoints import read_keypoints
from memo.linkage import read_tracks
from memo.overlay import draw_row
from memo.report import write_report
from memo.run import RunError, Source, contours_of_run, read_run, write_run
from memo.video import VideoReader

PIXELS = [f"{joint}_{axis}_px" for joint in JOINTS for axis in "uv"]
FIRST, STOP = 10, 47


def full(pixels, n):
    """Where the n by n pixels of the video have their middle: 0 to n - 1 for pixel 0."""
    return n * np.asarray(pixels) + (n - 1) / 2


def enlarged(scene, n):
    """The frames, and the camera as OpenCV's parameters have it, n times as large and with a rest."""
    rest = n - 1
    frames = [
        np.pad(np.kron(frame, np.ones((n, n), np.uint8)), ((0, rest), (0, rest)), mode="edge")
        for frame in scene.frames[FIRST:STOP]
    ]
    small = scene.camera.parameters()
    (fx, _, cx), (_, fy, cy), last = small["matrix"]
    matrix = [[n * fx, 0, full(cx, n)], [0, n * fy, full(cy, n)], last]
    size = [n * side + rest for side in small["size"]]
    return frames, memo.Camera.from_parameters(small | {"size": size, "matrix": matrix})


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """By n: the folder of a run with the camera given, one with it guessed, the video and the camera."""
    folder = tmp_path_factory.mktemp("shrunk")
    scene = memo.demo_scene(3)
    rate = round(1 / (scene.times_s[1] - scene.times_s[0]))
    found = {}
    for n in (1, 2, 3):
        frames, camera = enlarged(scene, n)
        video = folder / f"{n}.mkv"
        grey_video(video, frames, rate)
        camera.to_toml(folder / f"{n}.toml")
        options = ("--height", scene.height_m, "--shrink", n, "--no-plots", "--quiet")
        given, guessed = folder / f"given_{n}", folder / f"guessed_{n}"
        ran("track", video, *options, "--camera", folder / f"{n}.toml", "--out", given)
        if n < 3:
            ran("track", video, *options, "--no-overlay", "--out", guessed)
        found[n] = SimpleNamespace(given=given, guessed=guessed, video=video, camera=camera, frames=frames)
    assert len(read_track_csv(found[1].given / "track.csv")["frame"]) > 25
    return found


SIZES = pytest.mark.parametrize("n", [2, 3])
RUNS = pytest.mark.parametrize(("n", "run"), [(2, "given"), (3, "given"), (2, "guessed")])


@RUNS
def test_the_track_is_that_of_the_small_video_in_pixels_of_the_large_one(runs, n, run):
    small, large = (read_track_csv(getattr(runs[k], run) / "track.csv") for k in (1, n))
    for name, values in small.items():
        wanted = full(values, n) if name in PIXELS else values
        np.testing.assert_allclose(large[name], wanted, atol=0.03 if name in PIXELS else 2e-3, err_msg=name)


@RUNS
def test_the_camera_of_the_run_projects_joints_to_their_pixels(runs, n, run):
    folder = getattr(runs[n], run)
    record, table = read_run(folder), read_track_csv(folder / "track.csv")
    cameras = [memo.Camera.from_parameters(record["camera"])]
    if run == "given":
        cameras.append(runs[n].camera)
    for camera in cameras:
        assert tuple(camera.size) == runs[n].frames[0].shape[::-1]
        for joint in JOINTS:
            places = np.column_stack([table[f"{joint}_{axis}_m"] for axis in "xyz"])
            pixels = np.column_stack([table[f"{joint}_{axis}_px"] for axis in "uv"])
            # Digits of metres after the fourth are not in the table.
            np.testing.assert_allclose(camera.project(places), pixels, atol=0.06 * n, err_msg=joint)


def test_who_gives_frames_has_pixels_of_them(runs):
    n = 2
    given = runs[n]
    with VideoReader(given.video, shrink=n) as reader:
        frames = [(np.array(frame.luma), frame.time_s) for frame in reader]
        size = reader.full_size
    small = given.camera.shrunk(n)
    track = memo.track(
        [luma for luma, _ in frames], height_m=1.75, times_s=[time for _, time in frames], camera=small
    )
    pixels = np.column_stack([track.columns[f"left_hip_{axis}_px"] for axis in "uv"])
    places = np.column_stack([track.columns[f"left_hip_{axis}_m"] for axis in "xyz"])
    np.testing.assert_allclose(small.project(places), pixels, atol=1e-6)
    whole = track.of_video(n, size)
    np.testing.assert_allclose(whole.columns["left_hip_v_px"], full(pixels[:, 1], n), atol=1e-9)
    np.testing.assert_allclose(whole.columns["left_hip_z_m"], track.columns["left_hip_z_m"])
    np.testing.assert_allclose(whole.contours(5), full(track.contours(5), n), atol=1e-9)
    assert tuple(whole.camera.size) == tuple(size) and whole.summary == track.summary
    source = Source(given.video, (0, None), 25.0, shrink=n, size=size)
    with pytest.raises(RunError, match=r"give track\.of_video\(2\)"):
        write_run(given.given.parent, track, {"height_m": 1.75}, source, len(frames))


def pictures(path):
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


@SIZES
def test_the_overlay_is_drawn_where_the_walker_is(runs, n):
    small, large = (pictures(runs[k].given / "overlay.mp4") for k in (1, n))
    assert len(small) == len(large) == STOP - FIRST
    for one, other in zip(small[::8], large[::8], strict=True):
        assert one.shape == other.shape
        assert np.mean(np.abs(one.astype(int) - other) > 40) < 2e-3


@pytest.mark.parametrize("n", [2, 3, 8])
def test_a_row_is_drawn_on_an_averaged_frame_as_the_small_one_is_on_its_own(runs, n):
    """To a grey level: half a pixel of the video is seen in the smoothed edges of lines."""
    table = read_track_csv(runs[1].given / "track.csv")
    contours = contours_of_run(runs[1].given, table)
    small = SimpleNamespace(columns=table, contours=lambda row: contours[row])
    columns = {name: full(values, n) if name in PIXELS else values for name, values in table.items()}
    large = SimpleNamespace(columns=columns, contours=lambda row: full(contours[row], n))
    frame = np.zeros((480, 640), np.uint8)
    wanted, drawn = draw_row(frame, small, 9), draw_row(frame, large, 9, shrink=n)
    assert (wanted > 60).any()
    assert np.abs(wanted.astype(int) - drawn).max() <= 1


@SIZES
def test_contours_and_boxes_are_those_of_the_video(runs, n, tmp_path):
    tables = {k: read_track_csv(runs[k].given / "track.csv") for k in (1, n)}
    contours = {k: contours_of_run(runs[k].given, table) for k, table in tables.items()}
    np.testing.assert_allclose(contours[n][9], full(contours[1][9], n), atol=0.1 * n)
    boxes = {}
    for k in (1, n):
        ran("convert", runs[k].given, tmp_path / f"{k}.txt", "--quiet")
        boxes[k] = read_motchallenge(tmp_path / f"{k}.txt")
    for side, moved in (("left_px", True), ("top_px", True), ("width_px", False), ("height_px", False)):
        wanted = full(boxes[1][side], n) if moved else n * boxes[1][side]
        np.testing.assert_allclose(boxes[n][side], wanted, atol=0.2 * n, err_msg=side)


def test_contours_of_a_part_of_a_video_are_those_of_its_frames(runs, tmp_path):
    first, n = 6, 1
    ran(
        *("track", runs[n].video, "--camera", runs[n].video.with_suffix(".toml"), "--height", 1.75),
        *("--frames", f"{first}:", "--no-plots", "--no-overlay", "--quiet", "--out", tmp_path),
    )
    part, whole = (read_track_csv(folder / "track.csv") for folder in (tmp_path, runs[n].given))
    in_whole = contours_of_run(runs[n].given, whole)
    for row, found in list(enumerate(contours_of_run(tmp_path, part)))[5:-5:5]:
        assert len(found) > 20
        at = np.flatnonzero(whole["frame"] == part["frame"][row])[0]
        # The same person is fitted to somewhat other frames, and moves by 3 pixels a frame.
        middle = [np.mean([np.min(lines[..., 0]), np.max(lines[..., 0])]) for lines in (found, in_whole[at])]
        assert middle[0] == pytest.approx(middle[1], abs=4)


@SIZES
def test_keypoint_files_are_of_the_video(runs, n, tmp_path):
    for name in ("walk.json", "walk"):
        for k in (1, n):
            ran("convert", runs[k].given, tmp_path / str(k) / name, "--quiet")
        small, large = (read_keypoints(tmp_path / str(k) / name, fps=25) for k in (1, n))
        np.testing.assert_allclose(large.points, full(small.points, n), atol=0.05)
    dots, wanted = (read_tracks(runs[k].given / "track.csv").positions for k in (n, 1))
    np.testing.assert_allclose(dots, full(wanted, n), atol=0.03)


@SIZES
def test_what_a_frame_was_matched_to_lies_on_the_video(runs, n):
    small, large = (next(explain(runs[k].given)) for k in (1, n))
    assert (small.shrink, large.shrink, large.frame) == (1, n, small.frame)
    np.testing.assert_array_equal(large.luma, runs[n].frames[large.frame])
    assert large.change_mask.shape == large.luma.shape
    np.testing.assert_array_equal(
        large.change_mask[: n * 480, : n * 640], np.kron(small.change_mask, np.ones((n, n), bool))
    )
    assert not large.change_mask[n * 480 :].any() and not large.change_mask[:, n * 640 :].any()
    for name in ("edge_points", "segments", "model", "matched_edges"):
        np.testing.assert_allclose(getattr(large, name), full(getattr(small, name), n), atol=1e-3 * n)
    for name in ("model_px", "overlap_px", "distance_px", "similarity_px"):
        np.testing.assert_allclose(getattr(large, name), n * getattr(small, name), atol=1e-3 * n)
    left, top, right, bottom = small.window_px
    assert large.window_px == (n * left, n * top, n * right + n - 1, n * bottom + n - 1)
    for name in ("similarity", "matched", "angle_rad", "phase_grid"):
        np.testing.assert_allclose(getattr(large, name), getattr(small, name), atol=1e-3)


def page_of(folder):
    report = write_report(folder)
    text = report.path.read_text(encoding="utf-8")
    report.path.unlink()
    return json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1]), report


def lines_of(why, name):
    """What the script of the page makes of packed lines."""
    numbers = np.frombuffer(base64.b64decode(why[name]), "<i2") * why["step_px"]
    return numbers.reshape(-1, 2, 2) + why["corner"]


@SIZES
def test_the_page_shows_all_of_it_on_the_video(runs, n):
    small, large = (page_of(runs[k].given)[0] for k in (1, n))
    width, height = large["pictures"]["size"]
    assert [width, height] == [n * side for side in small["pictures"]["size"]]
    in_small, in_large = (np.array(page["track"]["points_px"], float) for page in (small, large))
    np.testing.assert_allclose(in_large, full(in_small, n), atol=0.3)
    assert len(large["why"]) == len(small["why"]) > 25
    for one, other in zip(small["why"][::9], large["why"][::9], strict=True):
        np.testing.assert_allclose(lines_of(other, "model"), full(lines_of(one, "model"), n), atol=0.1 * n)
        np.testing.assert_allclose(other["size"], n * np.array(one["size"]), atol=2 * n)
        assert np.abs(np.array(other["corner"]) - n * np.array(one["corner"])).max() <= 2 * n
        assert other["part"] == one["part"]


def test_regions_that_move_are_of_the_video(tmp_path):
    """Where nobody is tracked, the page shows where memo looked."""
    frames = np.full((8, 120, 160), 90, np.uint8)
    for k, frame in enumerate(frames):
        frame[20:90, 30 + 6 * k : 50 + 6 * k] = 200
    found = {}
    for n in (1, 2):
        video = tmp_path / f"{n}.mkv"
        grey_video(video, np.kron(frames, np.ones((1, n, n), np.uint8)), 25)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["memo", "track", str(video), "--shrink", str(n), "--quiet"])
            patch.chdir(tmp_path)
            with pytest.raises(SystemExit) as exited:
                cli.main()
        assert exited.value.code == 3
        found[n] = page_of(tmp_path / "memo-out" / str(n))[0]["pictures"]["regions"]
    assert any(found[1])
    for one, other in zip(found[1], found[2], strict=True):
        assert other == [
            [2 * left, 2 * top, 2 * right + 1, 2 * bottom + 1] for left, top, right, bottom in one
        ]


@pytest.fixture
def older(runs, tmp_path):
    """A run of 2 by 2 pixels as older versions of memo left it: table and camera of the small pictures."""
    folder = tmp_path / "older"
    shutil.copytree(runs[2].given, folder)
    with open(runs[1].given / "track.csv", newline="") as file:
        small = list(csv.reader(file))
    with open(folder / "track.csv", "w", newline="") as file:
        csv.writer(file).writerows(small)
    record = json.loads((folder / "run.json").read_text())
    del record["pixels_of"]
    record["camera"] = {"name": "camera", **runs[2].camera.shrunk(2).parameters()}
    (folder / "run.json").write_text(json.dumps(record))
    return folder


def test_an_older_folder_is_read_in_pixels_of_the_video(runs, older, tmp_path):
    table, newer = (read_track_csv(folder / "track.csv") for folder in (older, runs[2].given))
    for name in PIXELS:
        np.testing.assert_allclose(table[name], newer[name], atol=0.03, err_msg=name)
    camera = memo.Camera.from_parameters(read_run(older)["camera"])
    points = np.array([[0.0, 0.0, 1.0], [0.4, 0.3, 0.2]])
    np.testing.assert_allclose(camera.project(points), runs[2].camera.project(points), atol=1e-6)
    for read in (
        lambda run: read_keypoints(run).points,
        lambda run: read_tracks(run / "track.csv").positions,
    ):
        np.testing.assert_allclose(read(older), read(runs[2].given), atol=0.03)
    for folder, name in ((older, "older.txt"), (runs[2].given, "newer.txt")):
        ran("convert", folder, tmp_path / name, "--quiet")
    boxes, newer_boxes = (read_motchallenge(tmp_path / name) for name in ("older.txt", "newer.txt"))
    np.testing.assert_allclose(boxes["left_px"], newer_boxes["left_px"], atol=0.2)
    (page, _), (newer_page, _) = page_of(older), page_of(runs[2].given)
    assert page["pictures"]["size"] == newer_page["pictures"]["size"] and page["why"]
    shown = [np.array(one["track"]["points_px"], float) for one in (page, newer_page)]
    np.testing.assert_allclose(*shown, atol=0.2)
