"""Right and left put right: planted exchanges found, the file written, the command as a user meets it."""

import csv
import json
from functools import partial

import memo
import numpy as np
import pytest
from memo import _memo
from memo.files import FLIP_COLUMNS
from memo.keypoints import KeypointsError, read_keypoints, write_csv

NAMES = [f"{side}_{part}" for part in ("hip", "knee", "ankle", "heel") for side in ("right", "left")]
LEVELS = {"hip": [(1, 0)], "knee": [(3, 2)], "ankle": [(5, 4), (7, 6)]}
EXCHANGED = [12, 13, 14, 30, 47]


def walk(frames=60, rate_hz=25.0):
    """(T, 8, 2) legs that swing like pendulums, walking to the right; they cross each half second."""
    t = np.arange(frames) / rate_hz
    swing = np.sin(2 * np.pi * t)[:, None] * [1, -1]
    hip = np.stack([100 + 200 * t[:, None] + 4 * swing, np.full((frames, 2), 300.0)], axis=-1)
    knee = hip + np.stack([70 * np.sin(0.45 * swing), 70 * np.cos(0.45 * swing)], axis=-1)
    bent = 0.45 * swing - 0.3 * (1 + np.sin(2 * np.pi * t - 0.75)[:, None] * [1, -1])
    ankle = knee + np.stack([65 * np.sin(bent), 65 * np.cos(bent)], axis=-1)
    points = np.stack([hip, knee, ankle, ankle + np.array([-8, 6])], axis=1).reshape(frames, 8, 2)
    return points + np.random.default_rng(5).normal(0, 0.5, points.shape)


def write_table(path, points):
    header = ["frame", *(f"{name}_{axis}" for name in NAMES for axis in "xy"), "remark"]
    rows = [[t, *np.round(frame.ravel(), 2).tolist(), f"f{t}"] for t, frame in enumerate(points)]
    with path.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows])
    return path


@pytest.fixture
def confused(tmp_path):
    """A table in which the legs are exchanged in some frames, and the points as they should be."""
    points = walk()
    wrong = points.copy()
    for t in EXCHANGED:
        wrong[t] = points[t].reshape(4, 2, 2)[:, ::-1].reshape(8, 2)
    return write_table(tmp_path / "walk.csv", wrong), np.round(points, 2)


@pytest.fixture
def memo_unswap(memo_command):
    return partial(memo_command, "unswap")


def test_planted_exchanges_are_undone_and_reported(confused):
    path, truth = confused
    repair = memo.unswap(read_keypoints(path, fps=25))
    np.testing.assert_array_equal(repair.keypoints.points, truth)
    assert repair.exchanged == {"legs": len(EXCHANGED)}
    flips = [row for row in repair.flips if row["verdict"] == "flipped"]
    assert [row["frame"] for row in flips] == EXCHANGED
    assert all(row["group"] == "legs" and row["levels"] == "hip knee ankle" for row in flips)
    assert all(0 <= row["probability"] <= 1 and row["reason"] for row in repair.flips)


def test_an_exchange_that_is_a_guess_is_called_one(confused, tmp_path, memo_unswap):
    """Every other frame is exchanged: motion tells them apart, no majority tells which half is right."""
    path, truth = confused
    points = truth.copy()
    points[1::2] = truth[1::2].reshape(-1, 4, 2, 2)[:, :, ::-1].reshape(-1, 8, 2)
    path = write_table(tmp_path / "half.csv", points)
    repair = memo.unswap(read_keypoints(path, fps=25))
    changed = (repair.keypoints.points != np.round(points, 2)).any(axis=(1, 2))
    assert repair.exchanged == {"legs": 0} and repair.guessed == {"legs": int(changed.sum())} == {"legs": 30}
    assert {row["verdict"] for row in repair.flips} == {"guessed", "undecided"}
    assert repair.p_global["legs"] == pytest.approx(0.5, abs=0.1)
    code, out, _ = memo_unswap(path, "--fps", 25, "--out", tmp_path / "out")
    undecided = f"undecided: legs in {repair.undecided['legs']}"
    said = f"legs in 30 of 60 frames (of these only by the best guess: legs in 30; {undecided})."
    assert code == 0 and f"Exchanged right and left: {said}" in out
    assert "most frames are labelled correctly" in out


def test_frames_without_the_person_are_neither_undecided_nor_exchanged(tmp_path, memo_unswap):
    points = walk()
    points[20:45] = np.nan
    names = [*NAMES, "nose"]
    whole = np.concatenate([points, np.full((60, 1, 2), 50.0)], axis=1)
    keypoints = memo.keypoints.Keypoints.from_arrays(whole, names=names, fps=25)
    repair = memo.unswap(keypoints)
    decided = memo._memo.unswap(
        keypoints.times_s, keypoints.points, keypoints.scores, groups={"legs": LEVELS}
    )["legs"].decided
    assert not decided[20:45].all(), "frames without points are undecided"
    assert repair.undecided == {"legs": int((~decided).sum() - (~decided[20:45]).sum())}
    hidden = {frame for row in repair.flips for frame in range(row["frame"], row["last_frame"] + 1)}
    assert hidden.isdisjoint(range(20, 45))
    write_csv(tmp_path / "walk.csv", keypoints)
    said = memo_unswap(tmp_path / "walk.csv", "--out", tmp_path / "out")[1]
    assert "none undecided" in said or f"undecided: legs in {repair.undecided['legs']}" in said


def test_the_majority_is_what_is_taken_for_right(confused):
    path, _ = confused
    repair = memo.unswap(read_keypoints(path, fps=25))
    assert repair.guessed == {"legs": 0} and repair.p_global["legs"] > 0.99


def test_help_says_what_cannot_be_seen(memo_unswap, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    code, out, _ = memo_unswap("--help")
    assert code == 0 and "in all frames, or in most, cannot be detected" in out and "in place of" in out


def test_keypoints_without_pairs_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("frame,nose_x,nose_y,left_knee_x,left_knee_y\n0,1,2,3,4\n")
    with pytest.raises(KeypointsError, match="no pair of right and left joints of legs or arms"):
        memo.unswap(read_keypoints(path, fps=25))


def test_the_command_writes_the_table_and_every_change(confused, tmp_path, memo_unswap):
    path, truth = confused
    code, out, err = memo_unswap(path, "--fps", 25, "--out", tmp_path / "out")
    assert code == 0 and err == "" and len(out.splitlines()) == 2
    assert "Exchanged right and left: legs in 5 of 60 frames (none undecided)." in out
    written = tmp_path / "out" / "walk.csv"
    np.testing.assert_array_equal(read_keypoints(written, fps=25).points, truth)
    rows = list(csv.DictReader(written.open()))
    assert [row["remark"] for row in rows] == [f"f{t}" for t in range(60)]
    with (tmp_path / "out" / "flips.csv").open() as file:
        flips = list(csv.DictReader(file))
    assert tuple(flips[0]) == FLIP_COLUMNS
    assert [int(row["frame"]) for row in flips if row["verdict"] == "flipped"] == EXCHANGED
    assert flips[0]["time_s"] == "0.480000"
    again, _, _ = memo_unswap(path, "--fps", 25, "--out", tmp_path / "out")
    assert again == 0
    code, out, _ = memo_unswap(path, "--fps", 25, "--out", tmp_path / "out", "--json")
    assert code == 0 and json.loads(out)["exchanged"] == {"legs": 5}
    assert memo_unswap(path, "--fps", 25, "--out", tmp_path / "out", "--quiet")[1:] == ("", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["walk.csv"], "give its frame rate (--fps)"),
        (["nowhere", "--fps", "25"], "no such file"),
        (["walk.csv", "--fps", "-1"], "frame rate must be positive"),
        (["walk.csv", "--fps", "25", "--layout", "BODY_25"], "leave the layout BODY_25 out"),
        (["walk.csv", "--fps", "25", "--person", "3"], "no person 3: there is 1 person, and the first is 0"),
        (["walk.csv", "--fps", "25", "--out", "."], "write to another place"),
        (["walk.csv", "--fps", "25", "--out", "walk.csv"], "cannot be written to"),
    ],
)
def test_mistakes_are_told_in_one_line(confused, tmp_path, monkeypatch, memo_unswap, arguments, message):
    monkeypatch.chdir(tmp_path)
    before = confused[0].read_bytes()
    code, out, err = memo_unswap(*arguments)
    assert code == 1 and out == "" and len(err.splitlines()) == 1
    assert message in err and err.startswith("memo: ")
    assert confused[0].read_bytes() == before


def test_the_command_writes_an_openpose_folder(tmp_path, monkeypatch, memo_unswap):
    points = walk()
    joints = memo.layouts()["COCO_18"]
    at = [joints.index(name) if name in joints else None for name in NAMES]
    folder = tmp_path / "json"
    folder.mkdir()
    for t, frame in enumerate(points.round(2)):
        values = np.zeros((18, 3))
        for place, point in zip(at, frame, strict=True):
            if place is not None:
                values[place] = [*point, 0.9]
        if t in EXCHANGED:
            values[[8, 9, 10, 11, 12, 13]] = values[[11, 12, 13, 8, 9, 10]]
        people = [{"pose_keypoints_2d": values.ravel().tolist(), "hand_left_keypoints_2d": [t]}]
        (folder / f"walk_{t:012d}_keypoints.json").write_text(json.dumps({"people": people}))
    monkeypatch.chdir(folder)
    code, out, err = memo_unswap(".", "--fps", 25, "--out", tmp_path / "out")
    assert (code, err) == (0, "") and "legs in 5" in out
    written = sorted((tmp_path / "out" / "json").iterdir())
    assert [file.name for file in written] == sorted(file.name for file in folder.iterdir())
    for t, file in enumerate(written):
        data = json.loads(file.read_text())
        assert data["people"][0]["hand_left_keypoints_2d"] == [t]
        values = np.array(data["people"][0]["pose_keypoints_2d"]).reshape(18, 3)
        np.testing.assert_array_equal(values[[8, 11], :2], points[t, :2].round(2))


def test_a_file_is_read_as_for_posture_and_mistakes_are_told(tmp_path):
    names = ["right_hip", "left_hip", "right_knee", "left_knee"]
    points = np.random.default_rng(0).uniform(0, 500, (9, 4, 2))
    write_csv(tmp_path / "points.csv", memo.Keypoints.from_arrays(points, names=names, fps=25))
    read = memo.read_keypoints(tmp_path / "points.csv", fps=25)
    assert memo.unswap(tmp_path / "points.csv", fps=25).flips == memo.unswap(read).flips
    for options, reason in (
        ({"fps": 25}, "read from a file only"),
        ({"groups": "legs"}, "a list of legs and arms"),
    ):
        with pytest.raises(ValueError, match=reason):
            memo.unswap(read, **options)
    with pytest.raises(memo.KeypointsError, match="frame rate must be positive"):
        memo.read_keypoints(tmp_path / "points.csv", fps="25")


def test_a_level_is_exchanged_with_others_only_if_its_own_labels_are_rather_wrong():
    """Ankles alone are exchanged; hips and knees, which coincide within the noise, say little."""
    times_s = np.arange(76) / 25
    surely = 0
    for seed in range(6):
        points = walk(76) + np.random.default_rng(seed).normal(0, 3, (76, 8, 2))
        points[10:16, 4:] = points[10:16, [5, 4, 7, 6]]
        repair = memo.unswap(memo.Keypoints.from_arrays(points, names=NAMES, times_s=times_s))
        found = _memo.unswap(times_s, points, groups={"legs": LEVELS})["legs"]
        decided = found.level_flipped & found.decided[:, None]
        assert (found.level_p_flipped[decided] >= 0.5).all()
        for row in repair.flips:
            assert row["verdict"] != "flipped" or row["probability"] >= 0.9, row
        frames = {row["frame"] for row in repair.flips if row["verdict"] == "flipped"}
        assert repair.exchanged["legs"] == len(frames)
        surely += len(frames & set(range(10, 16)))
    assert surely >= 30, "of 36"
