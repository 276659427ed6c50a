"""Explanations of a finished run: the tracker's own numbers again, and clear refusals."""

import copy
import json
import shutil
from itertools import islice
from pathlib import Path

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA, ran, shared_video
from memo import _memo
from memo.explain import Why, explain
from memo.files import read_track_csv
from memo.run import RunError, read_run

FIRST, STOP = 10, 60
GRID_STEP = 0.02  # the tracker's, cycles
NARROWEST = 0.06  # half width of its narrowest search, cycles


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a run over some frames of a clip, and its raw measurements."""
    clip = shared_video("mocap_a")
    folder = tmp_path_factory.mktemp("run")
    options = ["--camera", clip / "camera.toml", "--height", "1.86", "--frames", f"{FIRST}:{STOP}"]
    ran("track", clip / "video.mp4", *options, "--out", folder, "--no-overlay", "--no-plots", "--quiet")
    return folder


@pytest.fixture(scope="module")
def whys(run):
    return list(explain(run))


def cycles_between(a, b):
    return np.abs((np.asarray(a) - b + 0.5) % 1.0 - 0.5)


def test_every_tracked_frame_has_the_similarity_of_its_row(run, whys):
    columns = read_track_csv(run / "track.csv")
    assert [why.frame for why in whys] == columns["frame"].tolist()
    np.testing.assert_allclose([why.time_s for why in whys], columns["time_s"], atol=1e-6)
    # track.csv has five digits; the search's fast exponential differs by 1e-6.
    np.testing.assert_allclose([why.chosen_similarity for why in whys], columns["similarity"], atol=8e-6)
    for why in whys:
        at_chosen = why.similarity[np.argmin(cycles_between(why.phase_grid, why.phase))]
        assert at_chosen == pytest.approx(why.chosen_similarity, abs=3e-6)
        counted = why.model_px[why.model_px >= 1].sum()
        assert why.similarity_px.sum() / counted == pytest.approx(why.chosen_similarity, abs=1e-6)


def test_the_curve_is_highest_at_the_measured_phase(run, whys):
    phases = read_track_csv(run / "track.csv")["phase"]
    highest = 0
    for why, smoothed in zip(whys, phases, strict=True):
        off = cycles_between(why.phase_grid, why.phase)
        steps = off / GRID_STEP
        searched = (off < NARROWEST - 1e-6) & (np.abs(steps - np.round(steps)) < 1e-6)
        assert searched.sum() == 5
        assert why.similarity[searched].max() <= why.chosen_similarity + 3e-6
        highest += cycles_between(why.phase_grid[np.argmax(why.similarity)], why.phase) < GRID_STEP
        assert cycles_between(smoothed, why.phase) < 0.1
    # In the others the half-cycle twin looks better in this one frame.
    assert highest > 0.6 * len(whys)


def test_what_a_frame_shows_belongs_together(whys):
    clip = shared_video("mocap_a")
    with memo.video.VideoReader(clip / "video.mp4", start=30, stop=31) as reader:
        luma = np.array(next(iter(reader)).luma)
    why = next(why for why in whys if why.frame == 30)
    np.testing.assert_array_equal(why.luma, luma)
    assert why.change_mask.shape == luma.shape and 1000 < why.change_mask.sum() < 40_000
    left, top, right, bottom = why.window_px
    points = why.edge_points
    assert len(points) > 200
    assert (points >= [left - 1, top - 1]).all() and (points <= [right + 1, bottom + 1]).all()
    count = len(why.model)
    assert why.model.shape == (count, 2, 2) and why.segments.shape[1:] == (2, 2)
    for column in (
        why.model_part,
        why.matched,
        why.overlap_px,
        why.distance_px,
        why.angle_rad,
        why.model_edge,
    ):
        assert column.shape == (count,)
    answered = why.model_edge >= 0
    np.testing.assert_array_equal(np.isfinite(why.overlap_px), answered)
    assert (why.matched[~answered] == 0).all() and ((why.matched >= 0) & (why.matched <= 1)).all()
    assert set(why.model_part) <= set(range(14))
    used = {tuple(edge.ravel()) for edge in why.matched_edges}
    assert used == {tuple(why.segments[edge].ravel()) for edge in why.model_edge[answered]}
    assert why.twin_similarity < why.chosen_similarity


def test_each_line_s_terms_give_its_similarity(whys):
    """Eq. (7) by hand: s = l exp(-((l_M - l)²/sigma_l² + d²/sigma_d² + dphi²/sigma_phi²) / 2)."""
    for why in whys[::10]:
        answered = why.model_edge >= 0
        length, overlap = why.model_px[answered], why.overlap_px[answered]
        missing = (length - overlap) / length
        away = why.distance_px[answered] / (0.5 * 0.25 * length)
        turned = why.angle_rad[answered] / np.radians(12)
        by_hand = overlap * np.exp(-0.5 * (missing**2 + away**2 + turned**2))
        np.testing.assert_allclose(why.similarity_px[answered], by_hand, rtol=1e-4)


def test_chosen_frames_come_one_by_one(run):
    progress = []
    found = explain(run, [40, 25, 40], lambda done, total: progress.append((done, total)))
    assert progress == []
    why = next(found)
    assert isinstance(why, Why) and why.frame == 25
    assert progress[-1] == (25 - FIRST + 2, 40 - FIRST + 2), "no further than needed"
    assert [why.frame for why in found] == [40]
    assert progress[-1][0] == progress[-1][1]
    assert list(explain(run, [])) == []


def test_pictures_of_a_camera_in_the_hand_are_steadied_as_they_were(tmp_path):
    scene = SHARED_DATA / "people" / "shake3"
    if not scene.is_dir():
        pytest.skip(f"no scene in {scene} (set MEMO_SHARED_DATA)")
    options = ["--camera", scene / "camera.toml", "--height", "1.84", "--no-overlay", "--no-plots", "--quiet"]
    ran("track", scene / "video.mp4", *options, "--out", tmp_path)
    rows = read_track_csv(tmp_path / "track.csv")
    asked = rows["frame"][::20].tolist()
    found = {why.frame: why.chosen_similarity for why in explain(tmp_path, asked)}
    for frame, similarity in zip(rows["frame"], rows["similarity"], strict=True):
        if frame in found:
            assert abs(found.pop(frame) - similarity) < 1e-3
    assert not found


def test_the_last_frame_has_no_next_one(run, whys):
    assert whys[-1].frame == STOP - 1
    (alone,) = explain(run, [STOP - 1])
    assert alone.chosen_similarity == whys[-1].chosen_similarity


def test_frames_that_were_not_tracked_are_refused(run):
    with pytest.raises(RunError, match=r"frame 3 was not tracked; tracked are 1\d to 59"):
        explain(run, [3, 30])


def edited(run, tmp_path, **changes):
    record = read_run(run)
    (tmp_path / "run.json").write_text(json.dumps({**record, **changes}))
    return tmp_path


def test_a_video_that_was_moved_is_told_and_can_be_given(run, tmp_path):
    gone = edited(run, tmp_path, video="/nowhere/walk.mp4")
    with pytest.raises(RunError, match=r"no longer at /nowhere/walk\.mp4; give its path as video="):
        explain(gone)
    moved = shutil.copy(read_run(run)["video"], tmp_path / "moved.mp4")
    (why,) = explain(gone, [30], video=moved)
    assert why.frame == 30
    with pytest.raises(RunError, match="did not come from a video"):
        explain(edited(run, tmp_path, video=None))


def test_another_video_is_noticed(run, tmp_path, write_video):
    other = write_video("other.mp4", np.zeros((33, 480, 640), np.uint8))
    with pytest.raises(
        RunError, match=r"other\.mp4: not the video of .*run\.json: the similarity in frame 30"
    ):
        list(explain(run, [30], video=other))
    short = write_video("short.mp4", np.zeros((30, 480, 640), np.uint8))
    with pytest.raises(ValueError, match=r"short\.mp4: ends before frame 30"):
        list(explain(run, [30], video=short))
    small = write_video("small.mp4", np.zeros((33, 48, 64), np.uint8))
    with pytest.raises(ValueError, match="expected 640x480, got 64x48"):
        list(explain(run, [30], video=small))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "holds no run.json"),
        ("{", "not JSON"),
        ("[1]", "must be an object, got list"),
        ("{}", "memo is missing"),
    ],
)
def test_a_folder_of_something_else_is_refused(tmp_path, text, said):
    if text is not None:
        (tmp_path / "run.json").write_text(text)
    with pytest.raises(RunError, match=said):
        explain(tmp_path)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"schema": 4}, "schema must be 1 to 3, got 4: a newer memo may have written it"),
        ({"schema": 0}, "schema must be 1 to 3, got 0"),
        ({"schema": "2"}, "schema must be int"),
        ({"video": 3}, "video must be str or null, got 3"),
        ({"frames": [0]}, r"frames must be \[first, stop\]"),
        ({"frames": [-1, None]}, r"frames must be \[first, stop\]"),
        ({"frames_read": -1}, "frames_read must not be negative"),
        ({"walks": [1]}, "walks must be objects"),
        ({"walks": [{}]}, "frame must be whole numbers"),
        ({"options": {"height_m": 17}}, "between 0.4 and 2.6 metres"),
        ({"options": {"size": 1}}, "size"),
    ],
)
def test_a_broken_record_is_refused_with_its_field(run, tmp_path, changes, said):
    with pytest.raises(RunError, match=said):
        explain(edited(run, tmp_path, **changes))


def numbers_in(value, path=()):
    """Paths of all numbers in nested dicts and lists."""
    if isinstance(value, dict | list):
        keys = value.keys() if isinstance(value, dict) else range(min(len(value), 3))
        for key in keys:
            yield from numbers_in(value[key], (*path, key))
    else:
        yield path


def test_no_number_of_a_record_breaks_the_core(run):
    """Every number is replaced by absurd ones; what comes is an explanation or a ValueError."""
    record = read_run(run)
    walk = record["walks"][0]
    wanted = walk["frame"][0]
    with memo.video.VideoReader(record["video"], start=FIRST, stop=FIRST + wanted + 2) as reader:
        frames = [(np.array(frame.luma), frame.time_s) for frame in islice(reader, wanted, wanted + 2)]
    walk["frame"] = [frame - wanted for frame in walk["frame"]]
    tracker = _memo.Tracker(**record["options"])
    outcomes = {"explained": 0, "refused": 0}
    for path in numbers_in(walk):
        for absurd in (None, "x", -1, 0, 10**9, 1e300, -1e300, 1e-300):
            broken = copy.deepcopy(walk)
            place = broken
            for key in path[:-1]:
                place = place[key]
            place[path[-1]] = absurd
            try:
                explainer = _memo.Explainer(tracker, [broken], {0})
                for luma, time_s in frames:
                    explainer.update(luma, time_s)
                outcomes["explained"] += 1
            except (ValueError, TypeError, OverflowError):
                outcomes["refused"] += 1
    assert outcomes["explained"] > 50 and outcomes["refused"] > 50, outcomes


def test_the_run_says_what_was_given_and_found(run):
    record = read_run(run)
    assert record["memo"] == memo.__version__ and record["command"] == "track"
    assert Path(record["video"]) == (shared_video("mocap_a") / "video.mp4").absolute()
    assert record["frames"] == [FIRST, STOP] and record["frames_read"] == STOP - FIRST
    assert record["camera_given"] is True and record["fps_given"] is None and record["rate_hz"] == 25
    assert record["options"]["height_m"] == 1.86 and record["summary"]["status"] == "tracked"
    assert record["sentences"][1] == record["summary"]["message"]
    given = memo.Camera.from_toml(str(shared_video("mocap_a") / "camera.toml"))
    again = memo.Camera.from_parameters(record["camera"])
    points = np.array([[0.0, 0.0, 1.0], [1.0, 0.3, 0.2]])
    np.testing.assert_allclose(again.project(points), given.project(points), atol=1e-9)


def test_parameters_of_a_tsai_camera_lose_nothing():
    clip = shared_video("pets09_s2l1")
    camera = memo.Camera.from_file(clip / "View_001.xml")
    parameters = json.loads(json.dumps(camera.parameters()))
    ground = camera.ground_points([(100.0, 300.0), (600.0, 500.0)])
    again = memo.Camera.from_parameters(parameters)
    np.testing.assert_allclose(again.ground_points([(100.0, 300.0), (600.0, 500.0)]), ground, atol=1e-9)
    del parameters["tsai_kappa"]
    near = memo.Camera.from_parameters(parameters)
    np.testing.assert_allclose(near.project(ground), camera.project(ground), atol=0.11)
    with pytest.raises(ValueError, match="camera: matrix is missing"):
        memo.Camera.from_parameters({"size": [640, 480]})


def test_a_record_without_the_grid_along_the_path_is_explained_almost_alike(run, tmp_path, whys):
    """Earlier versions did not record it: then hidden lines are those at the best position."""
    walks = read_run(run)["walks"]
    for walk in walks:
        del walk["middle_along_m"], walk["alongs"]
    chosen = [why.frame for why in whys[::10]]
    earlier = list(explain(edited(run, tmp_path, walks=walks), chosen))
    assert [why.frame for why in earlier] == chosen
    off = [a.chosen_similarity - b.chosen_similarity for a, b in zip(earlier, whys[::10], strict=True)]
    assert 0 < np.abs(off).max() < 0.02


def test_half_a_grid_along_the_path_is_refused(run, tmp_path):
    walks = read_run(run)["walks"]
    del walks[0]["alongs"]
    with pytest.raises(RunError, match="alongs: is missing, or middle_along_m is"):
        list(explain(edited(run, tmp_path, walks=walks)))
