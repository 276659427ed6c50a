"""Keypoints: read and written in the formats of the detectors, and what is refused.

`MEMO_FUZZ_EXAMPLES=20000 pytest tests/test_keypoints.py -k damaged` tries so many damaged files a format.
"""

import csv
import json
import math
import os
import pickle
import re
import shutil
from collections import Counter
from pathlib import Path

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from memo import _memo
from memo.keypoints import Keypoints, KeypointsError, layouts, read_keypoints

FUZZ_EXAMPLES = int(os.environ.get("MEMO_FUZZ_EXAMPLES", "100"))

#: Heights (fraction of the body) and sides of a standing figure, for files that look like people.
HEIGHTS = {
    "ankle": 0.05,
    "knee": 0.28,
    "hip": 0.52,
    "wrist": 0.5,
    "elbow": 0.65,
    "shoulder": 0.82,
    "neck": 0.82,
}


def figure(names, u=300.0, height_px=400.0, seed=0):
    """(K, 3) a standing person with feet at v = 600, each point its own score."""
    rng = np.random.default_rng(seed)

    def point(name):
        part = name.split("_", 1)[-1]
        side = {"right": -1, "left": 1}.get(name.split("_")[0], 0)
        height = HEIGHTS.get(part, 0.04 if "toe" in part or part == "heel" else 0.93)
        return u + 0.1 * height_px * side, 600 - height_px * height

    points = np.array([point(name) for name in names]) + rng.normal(0, 0.5, (len(names), 2))
    return np.round(np.column_stack([points, rng.uniform(0.5, 0.99, len(names))]), 3)


def triples(values):
    return [number for row in values.tolist() for number in row]


def openpose_frame(*people, version=1.3):
    return {
        "version": version,
        "people": [
            {"person_id": [-1], "pose_keypoints_2d": triples(person), "face_keypoints_2d": [1.5, 2.5, 0.5]}
            for person in people
        ],
    }


def write_openpose(folder, frames, compact=True):
    """Writes {frame: JSON} as OpenPose names its files."""
    folder.mkdir(parents=True)
    for frame, data in frames.items():
        text = json.dumps(data, separators=(",", ":") if compact else None)
        (folder / f"walk_{frame:012d}_keypoints.json").write_text(text)
    return folder


def one_line(error):
    return "\n" not in str(error.value)


# OpenPose.


def test_openpose_missing_points_missing_frames_and_empty_frames(tmp_path):
    names = layouts()["BODY_25"]
    person = figure(names)
    person[4] = 0
    frames = {3: openpose_frame(person), 4: openpose_frame(), 6: openpose_frame(person + np.array([2, 0, 0]))}
    found = read_keypoints(write_openpose(tmp_path / "json", frames), fps=50)
    assert found.layout == "BODY_25" and found.names == names
    assert found.frames.tolist() == [3, 4, 5, 6] and found.people.tolist() == [1, 0, 0, 1]
    np.testing.assert_allclose(found.times_s, [0.06, 0.08, 0.10, 0.12])
    assert np.isnan(found.points[1:3]).all() and (found.scores[1:3] == 0).all()
    assert np.isnan(found.points[0, 4]).all() and found.scores[0, 4] == 0
    np.testing.assert_array_equal(np.delete(found.points[0], 4, 0), np.delete(person[:, :2], 4, 0))


@pytest.mark.parametrize("layout", ["BODY_25", "BODY_25B", "COCO_18", "HALPE_26", "MEDIAPIPE_33"])
def test_the_layout_is_seen_from_the_points_and_may_be_given(tmp_path, layout):
    folder = write_openpose(tmp_path / "json", {0: openpose_frame(figure(layouts()[layout]))})
    assert read_keypoints(folder, fps=25).layout == layout
    assert read_keypoints(folder, fps=25, layout=layout.lower()).layout == layout


def test_the_layout_given_wins(tmp_path):
    folder = write_openpose(tmp_path / "json", {0: openpose_frame(figure(layouts()["BODY_25"]))})
    assert read_keypoints(folder, fps=25, layout="BODY_25B").names == layouts()["BODY_25B"]
    with pytest.raises(KeypointsError, match="has 25 points per person, COCO_17 has 17"):
        read_keypoints(folder, fps=25, layout="COCO_17")
    with pytest.raises(KeypointsError, match="did you mean `BODY_25`"):
        read_keypoints(folder, fps=25, layout="BODY_52")


def crossing(folder):
    """A tall walker who passes a short one; the order in the file changes, a ghost stands in frame 0."""
    names = layouts()["COCO_18"]
    frames, walker = {}, []
    for t in range(40):
        people = [figure(names, 100 + 10 * t, 400, t), figure(names, 500 - 2 * t, 250, 100 + t)]
        walker.append(people[0])
        people = people[:: 1 if t % 3 else -1]
        frames[t] = openpose_frame(*people, *([figure(names, 900, 80)] if t == 0 else []))
    return write_openpose(folder, frames), np.array(walker)


def test_the_most_prominent_person_is_followed(tmp_path):
    folder, walker = crossing(tmp_path / "json")
    found = read_keypoints(folder, fps=25)
    np.testing.assert_array_equal(found.points, walker[..., :2])
    np.testing.assert_array_equal(found.scores, walker[..., 2])
    assert found.people.tolist() == [3] + 39 * [2]


def test_a_person_is_chosen_by_number_or_place_whatever_the_order_of_the_lists(tmp_path):
    folder, walker = crossing(tmp_path / "json")
    found = read_keypoints(folder, fps=25, person=0)
    np.testing.assert_array_equal(found.points, walker[..., :2])
    short = read_keypoints(folder, fps=25, person=1)
    assert not np.isnan(short.points).any() and (np.ptp(short.points[:, :, 1], axis=1) < 260).all()
    ghost = read_keypoints(folder, fps=25, person=2)
    assert np.isnan(ghost.points[1:]).all() and not np.isnan(ghost.points[0]).any()
    assert [(one.name, one.frames, one.first_frame, one.last_frame) for one in found.everyone] == [
        ("0", 40, 0, 39),
        ("1", 40, 0, 39),
        ("2", 1, 0, 0),
    ]
    sizes_px = [one.size_px for one in found.everyone]
    assert sizes_px == sorted(sizes_px, reverse=True)
    # Places in the picture, in frames before and after they pass each other.
    for frame in (0, 39):
        for own in (found, short):
            u, v = own.points[frame, 3]
            np.testing.assert_array_equal(
                read_keypoints(folder, fps=25, person=(u + 1, v - 1, frame)).points, own.points
            )
    least, size_px = np.nanmin(found.points[5, :, 1]), found.everyone[0].size_px
    highest = found.points[5, np.nanargmin(found.points[5, :, 1])]
    above = (highest[0], least - 0.9 * size_px, 5)
    np.testing.assert_array_equal(read_keypoints(folder, fps=25, person=above).points, found.points)
    for person, said in [
        (7, "no person 7: there are 3 people, and the first is 0"),
        ("anna", "no person anna: the file does not name people"),
        ((10, 10, 77), "nobody is seen in frame 77"),
        (
            (-900, 10, 5),
            r"nobody is at -900,10 in frame 5: the nearest person is at \d+,\d+, with the nearest point",
        ),
        ((10, 10), "is no number"),
        (-1, "is no number"),
        (True, "is no number"),
        ((math.nan, 10, 1), "is no number"),
    ]:
        with pytest.raises(KeypointsError, match=said):
            read_keypoints(folder, fps=25, person=person)


def test_two_who_may_have_been_exchanged_are_said(tmp_path):
    """Two people of the same size who meet, and step on from the same place."""
    names = layouts()["COCO_18"]
    frames = {}
    for t in range(40):
        apart = 4 * abs(t - 20)
        people = [figure(names, 300 + apart, 400, t), figure(names, 300 - apart, 400, 100 + t)]
        frames[t] = openpose_frame(*people[:: 1 if t % 3 else -1])
    folder = write_openpose(tmp_path / "json", frames)
    found = read_keypoints(folder, fps=25)
    assert len(found.doubts) == 1
    assert re.fullmatch(
        r"from frame \d+ on, person 0 may be person 1: they meet there \(probability 0\.\d+\)",
        found.doubts[0],
    )
    assert read_keypoints(crossing(tmp_path / "others")[0], fps=25).doubts == ()


def crowd_lists(folder, noise_px, seed):
    """Joints of people who really walk, as a detector gives them: noisy, in any order, hidden ones missing,
    nobody in one of twenty lists, and somebody twice in one of thirty."""
    rng = np.random.default_rng(seed)
    people = []
    for path in sorted(folder.glob("truth_*.csv")):
        rows = list(csv.DictReader(path.open()))
        names = [name.removesuffix("_u_px") for name in rows[0] if name.endswith("_u_px")]
        joints = [[[float(row[f"{name}_{axis}_px"]) for axis in "uv"] for name in names] for row in rows]
        people.append(dict(zip((int(row["frame"]) for row in rows), np.array(joints), strict=True)))
    lists = []
    for row in csv.DictReader((folder / "visible.csv").open()):
        present = []
        for who, own in enumerate(people):
            share = float(row[f"person_{who}"] or 0)
            joints = own.get(int(row["frame"]))
            if joints is None or share < 0.3 or rng.random() < 0.05:
                continue
            for _ in range(1 + (rng.random() < 0.03)):
                seen = joints + rng.normal(0, noise_px, joints.shape)
                seen[rng.random(len(seen)) > max(share, 0.5)] = np.nan
                present.append((who, int(row["frame"]), seen))
        lists += [present[k] for k in rng.permutation(len(present))]
    return lists


@pytest.mark.parametrize(("noise_px", "most_wrong"), [(1, 0.01), (3, 0.06)])
def test_people_keep_their_numbers_in_shuffled_lists(noise_px, most_wrong):
    """Shuffled detections of people of 175 px who cross or walk side by side, with motion-captured joints.

    Following the nearest person from frame to frame, without velocities and one person at a time, is on
    somebody else in 15 to 30 % of the frames."""
    folder = SHARED_DATA / "people"
    if not folder.is_dir():
        pytest.skip(f"{folder} is not here")
    wrong = []
    for scene in ("cross2", "three", "pair"):
        for seed in range(10):
            who, frames, points = zip(*crowd_lists(folder / scene, noise_px, seed), strict=True)
            scores = np.ones((len(who), len(points[0])))
            numbers, _ = _memo.follow_everyone(list(frames), np.array(points), scores)
            pairs = Counter(zip(who, numbers, strict=True))
            known = sum(count for (_, number), count in pairs.items() if number is not None)
            own = [
                max(count for (who, number), count in pairs.items() if who == one and number is not None)
                for one in set(who)
            ]
            assert known >= 0.93 * len(who)
            wrong.append(1 - sum(own) / known)
    print(f"{noise_px} px: {np.mean(wrong):.1%} of the detections are of another person")
    assert np.mean(wrong) <= most_wrong


def test_writing_openpose_changes_the_person_and_nothing_else(tmp_path):
    folder, _ = crossing(tmp_path / "json")
    found = read_keypoints(folder, fps=25)
    points, scores = found.points.copy(), found.scores.copy()
    pairs = [pair for pair in _memo.side_pairs(found.layout) if pair[0] == "legs"]
    for _, _, right, left in pairs:
        points[5, [right, left]] = points[5, [left, right]]
        scores[5, [right, left]] = scores[5, [left, right]]
    points[6, 2] = np.nan
    found.replaced(points, scores).write(tmp_path / "out" / "json")
    for frame, file in enumerate(sorted(folder.iterdir())):
        before, after = file.read_text(), (tmp_path / "out" / "json" / file.name).read_text()
        if frame not in (5, 6):
            assert after == before
            continue
        before, after = json.loads(before), json.loads(after)
        changed = [p for p, q in zip(before["people"], after["people"], strict=True) if p != q]
        assert len(changed) == 1
        for one in (before, after):
            next(p for p in one["people"] if p["face_keypoints_2d"]).pop("pose_keypoints_2d")
            for person in one["people"]:
                person.pop("pose_keypoints_2d", None)
        assert before == after
    again = read_keypoints(tmp_path / "out" / "json", fps=25)
    np.testing.assert_array_equal(again.points, points)
    assert again.scores[6, 2] == 0
    scores[6, 2] = 0
    np.testing.assert_array_equal(again.scores, scores)


def test_openpose_results_replace_only_earlier_results(tmp_path):
    names = layouts()["COCO_18"]
    folder = write_openpose(
        tmp_path / "json", {0: openpose_frame(figure(names)), 1: openpose_frame(figure(names))}
    )
    found = read_keypoints(folder, fps=25)
    found.write(tmp_path / "out")
    found.replaced(found.points + 1, found.scores).write(tmp_path / "out")
    assert read_keypoints(tmp_path / "out", fps=25).points[0, 0, 0] == found.points[0, 0, 0] + 1
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with pytest.raises(KeypointsError, match=r"holds other files \(notes.txt\)"):
        found.write(tmp_path / "out")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(KeypointsError, match="is a file"):
        found.write(tmp_path / "file")
    for same in (folder, tmp_path / "out" / ".." / "json"):
        with pytest.raises(KeypointsError, match="write to another place"):
            found.write(same)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["file", "json", "out"]


def test_a_result_appears_complete_or_not_at_all(tmp_path):
    names = layouts()["COCO_18"]
    folder = write_openpose(tmp_path / "json", {t: openpose_frame(figure(names)) for t in range(3)})
    found = read_keypoints(folder, fps=25)
    (folder / "walk_000000000002_keypoints.json").write_text('{"people": []}')
    with pytest.raises(KeypointsError, match="has changed since it was read"):
        found.replaced(found.points + 1, found.scores).write(tmp_path / "out")
    assert [entry.name for entry in tmp_path.iterdir()] == ["json"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "not JSON"),
        ("{", "not JSON: .* in line 1"),
        ("[1]", "no list `people`"),
        ('{"people": 3}', "no list `people`"),
        ('{"people": [3]}', r"people\[0\] has no pose_keypoints_2d"),
        ('{"people": [{"pose_keypoints_2d": [1, 2]}]}', "not a list of x, y, score"),
        ('{"people": [{"pose_keypoints_2d": [1, "2", 3]}]}', r"pose_keypoints_2d\[1\]: 2 is not a number"),
        ('{"people": [{"pose_keypoints_2d": [1, true, 3]}]}', "True is not a number"),
        ('{"people": [{"pose_keypoints_2d": [1, 1e999, 3]}]}', "beyond 1e"),
        ('{"people": [{"pose_keypoints_2d": [1, 2, 3]}]}', "no keypoint layout has 1 point;"),
        ('{"people": [{"pose_keypoints_2d": [1, ' + "9" * 400 + ", 3]}]}", "too large"),
        ("[" * 100_000, "not JSON that can be read"),
        ("9" * 5000, "not JSON that can be read"),
    ],
)
def test_broken_openpose_files_are_refused(tmp_path, text, message):
    folder = tmp_path / "json"
    folder.mkdir()
    (folder / "a_7.json").write_text(text)
    with pytest.raises(KeypointsError, match=message) as error:
        read_keypoints(folder, fps=25)
    assert str(folder) in str(error.value) and one_line(error) and len(str(error.value)) < 600


def test_files_named_by_time_stamps_are_refused_by_name(tmp_path):
    names = layouts()["COCO_18"]
    frame = json.dumps(openpose_frame(figure(names)))
    # Nanoseconds and milliseconds: no part of these numbers counts frames.
    for folder, stamps in (
        ("ns", (1700000000033333338, 1700000000066666676, 1700000000100000004)),
        ("ms", (1700000000033, 1700000000067, 1700000000100)),
    ):
        (tmp_path / folder).mkdir()
        for stamp in stamps:
            (tmp_path / folder / f"{stamp}_keypoints.json").write_text(frame)
        said = f"{stamps[0]}_keypoints.json: {stamps[0]} in the name is not a frame number"
        with pytest.raises(KeypointsError, match=said) as error:
            read_keypoints(tmp_path / folder, fps=30)
        assert one_line(error)


def test_folders_that_are_no_sequence_are_refused(tmp_path):
    names = layouts()["COCO_18"]
    frame = json.dumps(openpose_frame(figure(names)))
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(KeypointsError, match="a folder without keypoints: wanted JSON files, one for each"):
        read_keypoints(empty, fps=25)
    (empty / "frame.json").write_text(frame)
    with pytest.raises(KeypointsError, match="no frame number"):
        read_keypoints(empty, fps=25)
    mixed = tmp_path / "mixed"
    mixed.mkdir()
    for name in ("cam1.001.json", "cam2.001.json"):
        (mixed / name).write_text(frame)
    with pytest.raises(KeypointsError, match="both frame 1; one camera per folder"):
        read_keypoints(mixed, fps=25)
    (mixed / "cam2.001.json").rename(mixed / "cam2.900000000.json")
    with pytest.raises(KeypointsError, match="only 2 of them exist"):
        read_keypoints(mixed, fps=25)
    with pytest.raises(KeypointsError, match="no such file"):
        read_keypoints(tmp_path / "nowhere", fps=25)
    nobody = write_openpose(tmp_path / "nobody", {0: openpose_frame()})
    with pytest.raises(KeypointsError, match="no person in any frame"):
        read_keypoints(nobody, fps=25)


@pytest.mark.parametrize(
    "options",
    [{"fps": 0}, {"fps": math.nan}, {"fps": -3}, {}, {"fps": 25, "person": -1}, {"fps": 25, "person": True}],
)
def test_senseless_options_are_refused(tmp_path, options):
    folder = write_openpose(tmp_path / "json", {0: openpose_frame(figure(layouts()["COCO_18"]))})
    with pytest.raises(KeypointsError):
        read_keypoints(folder, **options)


# COCO and AlphaPose.


def test_alphapose_is_read_and_written(tmp_path):
    names = layouts()["HALPE_26"]
    people = np.array([figure(names, 100 + 8 * t, seed=t) for t in range(5)])
    entries = [
        {"image_id": f"{t}.jpg", "category_id": 1, "keypoints": triples(people[t]), "score": 2.5, "idx": 1}
        for t in (0, 1, 3, 4)
    ]
    path = tmp_path / "alphapose-results.json"
    path.write_text(json.dumps(entries))
    found = read_keypoints(path, fps=30)
    assert found.layout == "HALPE_26" and found.frames.tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(found.points[[0, 1, 3, 4]], people[[0, 1, 3, 4], :, :2])
    assert np.isnan(found.points[2]).all()
    points = found.points.copy()
    points[1, [11, 12]] = points[1, [12, 11]]
    found.replaced(points, found.scores).write(tmp_path / "out.json")
    written = json.loads((tmp_path / "out.json").read_text())
    assert [e for e in written if e["image_id"] != "1.jpg"] == [
        e for e in entries if e["image_id"] != "1.jpg"
    ]
    entries[1]["keypoints"][33:35], entries[1]["keypoints"][36:38] = (
        entries[1]["keypoints"][36:38],
        entries[1]["keypoints"][33:35],
    )
    assert written == entries


@pytest.mark.parametrize(
    ("images", "message"),
    [
        (["camA_0000.jpg", "camB_0000.jpg"], "camA_0000.jpg and camB_0000.jpg are both frame 0; one camera"),
        (
            ["cam1_0000.jpg", "cam2_0001.jpg"],
            "cam1_0000.jpg and cam2_0001.jpg differ by more than the number",
        ),
        (
            ["a/0000.jpg", "b/0001.jpg"],
            "a/0000.jpg and b/0001.jpg differ by more than the number of the frame",
        ),
        (["walk_9.jpg", "walk_10.jpg"], None),
        (["000009.jpg", "000010.jpg", "000010.jpg"], None),
    ],
)
def test_one_list_is_of_one_camera(tmp_path, images, message):
    path = tmp_path / "alphapose-results.json"
    person = figure(layouts()["COCO_17"])
    entries = [
        {"image_id": image, "category_id": 1, "keypoints": triples(person), "score": 2.5} for image in images
    ]
    path.write_text(json.dumps(entries))
    if message is None:
        assert read_keypoints(path, fps=30).frames.tolist() == [9, 10]
        return
    with pytest.raises(KeypointsError, match=message) as error:
        read_keypoints(path, fps=30)
    assert str(path) in str(error.value) and one_line(error)
    path.write_text(json.dumps({image: openpose_frame(person) for image in images}))  # --format open
    with pytest.raises(KeypointsError, match=message):
        read_keypoints(path, fps=30)


def test_coco_annotations_keep_their_visibility(tmp_path):
    names = layouts()["COCO_17"]
    values = figure(names)
    values[:, 2] = [2, 1] * 8 + [2]
    values[3] = 0
    data = {
        "images": [{"id": 7, "width": 640, "height": 480, "file_name": "a.png"}],
        "annotations": [{"id": 1, "image_id": 7, "keypoints": triples(values), "bbox": [1, 2, 3, 4]}],
        "categories": [{"id": 1, "name": "person"}],
    }
    path = tmp_path / "person_keypoints.json"
    path.write_text(json.dumps(data, separators=(",", ":")))
    found = read_keypoints(path, fps=25)
    assert found.image_size == (640, 480) and found.layout == "COCO_17" and found.frames.tolist() == [7]
    assert found.scores[0, :4].tolist() == [1, 0.5, 1, 0] and np.isnan(found.points[0, 3]).all()
    found.write(tmp_path / "same.json")
    assert (tmp_path / "same.json").read_text() == path.read_text()
    scores = found.scores.copy()
    scores[0, 0] = 0.5
    found.replaced(found.points, scores).write(tmp_path / "out.json")
    data["annotations"][0]["keypoints"][2] = 1
    assert json.loads((tmp_path / "out.json").read_text()) == data


def annotations(people, names=None, **category):
    """COCO annotations of one person per image, as labelling programs export them."""
    own = {"id": 1, "name": "person", "supercategory": "person", "skeleton": [], **category}
    return {
        "images": [
            {"id": t, "width": 640, "height": 480, "file_name": f"{t}.png"} for t in range(len(people))
        ],
        "annotations": [
            {"id": t, "image_id": t, "category_id": own["id"], "keypoints": triples(person)}
            for t, person in enumerate(people)
        ],
        "categories": [own if names is None else own | {"keypoints": list(names)}],
    }


def test_the_names_of_points_in_coco_annotations_count(tmp_path):
    path = tmp_path / "walk.json"
    coco = layouts()["COCO_17"]
    people = np.array([figure(coco, 100 + 8 * t, seed=t) for t in range(4)])
    people[..., 2] = 2
    path.write_text(json.dumps(annotations(people, coco)))
    assert read_keypoints(path, fps=25).layout == "COCO_17"
    order = [*range(16, -1, -1)]
    names = [coco[k] for k in order]
    names[2], names[-1] = "tail", "Nose"
    path.write_text(json.dumps(annotations(people[:, order], names)))
    found = read_keypoints(path, fps=25)
    joints = tuple(name for name in coco[::-1] if name != coco[order[2]])
    assert found.names == joints and found.layout is None
    for name in ("nose", "right_ankle"):
        at = people[:, coco.index(name), :2]
        np.testing.assert_array_equal(found.points[:, joints.index(name)], at)
    found.write(tmp_path / "same.json")
    assert (tmp_path / "same.json").read_text() == path.read_text()
    points = found.points.copy()
    points[1, joints.index("nose")] = 7, 9
    found.replaced(points, found.scores).write(tmp_path / "out.json")
    wanted = json.loads(path.read_text())
    wanted["annotations"][1]["keypoints"][-3:] = [7, 9, 2]
    assert json.loads((tmp_path / "out.json").read_text()) == wanted
    path.write_text(json.dumps(annotations(people, [f"kp{k}" for k in range(17)])))
    assert read_keypoints(path, fps=25).layout == "COCO_17"
    for names, message in (
        (coco[:5], "entry 0, keypoints: 17 points, and the category names 5"),
        (["left_knee", "LKnee", *coco[2:]], "names of different joints"),
    ):
        path.write_text(json.dumps(annotations(people, names)))
        with pytest.raises(KeypointsError, match=message):
            read_keypoints(path, fps=25)


def test_only_the_people_among_the_categories_of_coco_count(tmp_path):
    path = tmp_path / "a.json"
    names = layouts()["COCO_17"]
    people = np.array([figure(names, 100 + 8 * t, seed=t) for t in range(4)])
    dogs = [
        {"image_id": t, "category_id": 17, "keypoints": triples(2 * figure(names, 300)), "score": 0.9}
        for t in range(6)
    ]
    results = [
        {"image_id": t, "category_id": 1, "keypoints": triples(person), "score": 0.9}
        for t, person in enumerate(people)
    ]
    path.write_text(json.dumps([*dogs, *results]))
    found = read_keypoints(path, fps=25)
    np.testing.assert_array_equal(found.points[:4], people[..., :2])
    assert found.people.tolist() == [1, 1, 1, 1, 0, 0]
    data = annotations(people, id=3)
    data["annotations"] += dogs
    data["categories"].append({"id": 17, "name": "dog"})
    path.write_text(json.dumps(data))
    np.testing.assert_array_equal(read_keypoints(path, fps=25).points[:4], people[..., :2])
    path.write_text(json.dumps(dogs))  # whatever the number, if there is only one
    assert read_keypoints(path, fps=25).people.tolist() == 6 * [1]
    path.write_text(json.dumps([*dogs, *({**one, "category_id": 2} for one in results)]))
    with pytest.raises(KeypointsError, match="categories 17, 2, of which none is `person`; keep the entries"):
        read_keypoints(path, fps=25)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "no person in any frame"),
        ("{}", "neither COCO results"),
        ('{"people": []}', "give the folder"),
        ('[{"image_id": 1}]', "entry 0: needs image_id and keypoints"),
        ('[{"image_id": "a.png", "keypoints": [1, 2, 3]}]', "image_id a.png has no frame number"),
        ('[{"image_id": "1700000000033333338.png", "keypoints": [1, 2, 3]}]', "is not a frame number"),
        (f'[{{"image_id": "{"7" * 5000}.png", "keypoints": [1, 2, 3]}}]', "has no frame number"),
        ('[{"image_id": 1e99, "keypoints": [1, 2, 3]}]', "no frame number"),
        ('[{"image_id": -1, "keypoints": [1, 2, 3]}]', "not a frame number"),
        (
            '[{"image_id": 1, "keypoints": [1, 2, 3]}, {"image_id": 2, "keypoints": [1, 2, 3, 4, 5, 6]}]',
            "different numbers of points",
        ),
    ],
)
def test_broken_coco_files_are_refused(tmp_path, text, message):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(KeypointsError, match=message) as error:
        read_keypoints(path, fps=25)
    assert str(path) in str(error.value) and one_line(error)


# Tables.

WIDE = """frame,time_s,RKnee_x,RKnee_y,RKnee_score,left_knee_x,left_knee_y,left_knee_score,note
0,0.00,100.5,200.25,0.9,110,205,0.8,"a, b"
1,0.04,101.5,201.25,0.9,,,,
3,0.12,103.5,203.25,0.7,113,208,0.6,end
"""

LONG = """time_s;joint;x;y;score
0.0;RKN;100.5;200.25;0.9
0.0;LKN;110;205;0.8
0.04;LKN;111;206;0.8
0.0;C7;50;60;1
"""


def test_a_wide_table_is_read_and_written(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(WIDE)
    found = read_keypoints(path)
    assert found.names == ("right_knee", "left_knee") and found.layout is None
    np.testing.assert_allclose(found.times_s, [0, 0.04, 0.08, 0.12])
    assert np.isnan(found.points[1, 1]).all() and np.isnan(found.points[2]).all()
    assert found.points[3].tolist() == [[103.5, 203.25], [113, 208]] and found.scores[3].tolist() == [
        0.7,
        0.6,
    ]
    found.write(tmp_path / "same.csv")
    assert (tmp_path / "same.csv").read_text() == WIDE
    swapped = found.replaced(found.points[:, ::-1], found.scores[:, ::-1])
    swapped.write(tmp_path / "out.csv")
    rows = list(csv.DictReader((tmp_path / "out.csv").open()))
    assert [row["note"] for row in rows] == ["a, b", "", "end"]
    assert rows[1]["RKnee_x"] == "" and rows[1]["left_knee_x"] == "101.5" and rows[0]["time_s"] == "0.00"
    again = read_keypoints(tmp_path / "out.csv")
    np.testing.assert_array_equal(again.points, swapped.points)
    np.testing.assert_array_equal(again.scores, swapped.scores)
    assert read_keypoints(path, fps=100).times_s.tolist() == [0, 0.01, 0.02, 0.03]


@pytest.mark.parametrize("options", [{}, {"fps": 5}])
def test_rows_without_frame_numbers_are_read_in_order_of_time(tmp_path, options):
    path = tmp_path / "a.csv"
    path.write_text("time_s,left_knee_x,left_knee_y\n0.4,3,1\n0.0,1,1\n0.2,2,1\n")
    found = read_keypoints(path, **options)
    assert found.points[:, 0, 0].tolist() == [1, 2, 3]
    np.testing.assert_allclose(found.times_s, [0, 0.2, 0.4])
    found.write(tmp_path / "same.csv")
    assert (tmp_path / "same.csv").read_text() == path.read_text()


def test_a_long_table_is_read_and_written(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(LONG)
    found = read_keypoints(path)
    assert found.names == ("right_knee", "left_knee") and found.times_s.tolist() == [0, 0.04]
    assert found.points[0].tolist() == [[100.5, 200.25], [110, 205]] and np.isnan(found.points[1, 0]).all()
    found.write(tmp_path / "same.csv")
    assert (tmp_path / "same.csv").read_text() == LONG
    swapped = found.replaced(found.points[:, ::-1], found.scores[:, ::-1])
    swapped.write(tmp_path / "out.csv")
    again = read_keypoints(tmp_path / "out.csv")
    np.testing.assert_array_equal(again.points, swapped.points)
    assert "0.0;C7;50;60;1" in (tmp_path / "out.csv").read_text()


def test_tables_of_several_people(tmp_path):
    path = tmp_path / "a.csv"
    rows = ["frame,person,right_hip_x,right_hip_y,right_ankle_x,right_ankle_y"]
    for t in range(10):
        rows += [f"{t},2,{900 - t},300,{900 - t},350", f"{t},1,{100 + t},100,{100 + t},500"]
    path.write_text("\n".join(rows))
    found = read_keypoints(path, fps=10)
    np.testing.assert_array_equal(found.points[:, 0, 0], 100 + np.arange(10))
    for name, at in (("1", 103), (1, 103), (2, 897)):
        assert read_keypoints(path, fps=10, person=name).points[3, 0, 0] == at
    with pytest.raises(KeypointsError, match="no person 0: the file names 1, 2"):
        read_keypoints(path, fps=10, person=0)
    path.write_text("\n".join(rows).replace("person", "someone"))
    with pytest.raises(KeypointsError, match="frame 0 appears twice and there is no column `person`"):
        read_keypoints(path, fps=10)


def test_without_a_choice_the_most_prominent_name_is_read(tmp_path):
    path = tmp_path / "a.csv"
    rows = ["frame,person,right_hip_x,right_hip_y,right_ankle_x,right_ankle_y"]
    for t in range(20):  # they change sides between two frames, as after a cut
        for name, u, height in (("anna", 300 + t, 300), ("bob", 900 + t, 250)):
            u = u if t < 10 else 1200 - u
            rows.append(f"{t},{name},{u},100,{u},{100 + height}")
    path.write_text("\n".join(rows))
    found = read_keypoints(path, fps=10)
    np.testing.assert_array_equal(found.points, read_keypoints(path, fps=10, person="anna").points)
    assert found.everyone[0].name == "anna" and np.isfinite(found.points).all()
    rows = ["frame,person,right_hip_x,right_hip_y"]  # one point each has no size
    rows += [f"{t},{name},{u},50" for t in range(20) for name, u in (("i1", 100 + t), ("i2", 500 - t))]
    path.write_text("\n".join(rows))
    assert read_keypoints(path, fps=10).points[:, 0, 0].tolist() == [100 + t for t in range(20)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a,b\n1,2\n", "needs a column `frame` or `time_s`"),
        ("frame,b\n1,2\n", "no joint in it"),
        ("frame,left_nkee_x,left_nkee_y\n1,2,3\n", "did you mean `left_knee`"),
        ("frame,left_knee_x\n1,2\n", "column left_knee_x without left_knee_y"),
        ("frame,left_knee_x,left_knee_y,left_knee_z\n1,2,3,4\n", "points in space"),
        ("frame,left_knee_x,left_knee_y,LKN_x,LKN_y\n1,2,3,4,5\n", "left_knee appears twice"),
        ("frame,left_knee_x,left_knee_y\n1,2\n", "row 2 has 2 cells, the header 3"),
        ("frame,left_knee_x,left_knee_y\n1,two,3\n", "row 2: two is not a number"),
        ("frame,left_knee_x,left_knee_y\n1,inf,3\n", "row 2: inf is not finite"),
        ("frame,left_knee_x,left_knee_y\n1,2e9,3\n", "row 2: coordinates beyond"),
        ("frame,left_knee_x,left_knee_y\n1.5,2,3\n", "row 2: frame 1.5 is not a frame number"),
        ("frame,left_knee_x,left_knee_y\n,2,3\n", "row 2: frame  is not"),
        ("frame,left_knee_x,left_knee_y\n1,2,3\n1,2,3\n", "frame 1 appears twice"),
        ("frame,time_s,left_knee_x,left_knee_y\n1,1,2,3\n2,1,2,3\n", "time_s must increase"),
        ("frame,time_s,left_knee_x,left_knee_y\n1,,2,3\n", "row 2: no time_s"),
        ("frame,joint,x,y,z\n1,LKN,2,3,4\n", "columns x, y and z: these are points in space"),
        (
            "frame,person,LKN_x,LKN_y\n3,a,2,3\n4,a,2,3\n4,b,7,8\n4,a,9,3\n",
            "person a appears twice in frame 4",
        ),
        ("frame,joint,x,y\n1,LKN,2,3\n1,left_knee,2,3\n", "row 3: left_knee appears twice in frame 1"),
        ("frame,left_knee_x,left_knee_y\n", "no person in any frame"),
        ("frame,left_knee_x,left_knee_y\n1,2,3\n900000000,2,3\n", "only 2 of them"),
        ("\x00,\x01", "needs a column"),
        ("\n\nx", "row 3 has 1 cell,"),
        ("   \n", "is empty"),
        ('frame,"a\nb",x\n1,2,3\n', r"got the columns frame, a\?b, x"),
        ('frame,"right\nkne_x","b"\n1,2,3\n', r"unknown joint `right\?kne`"),
    ],
)
def test_broken_tables_are_refused(tmp_path, text, message):
    path = tmp_path / "a.csv"
    path.write_text(text)
    with pytest.raises(KeypointsError, match=message) as error:
        read_keypoints(path, **({} if "time_s" in text else {"fps": 25}))
    assert str(path) in str(error.value) and one_line(error)


def test_points_without_a_place_in_the_file_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(WIDE)
    found = read_keypoints(path)
    points = found.points.copy()
    points[2] = 5
    with pytest.raises(KeypointsError, match="frame 2 has no person to write points to"):
        found.replaced(points, found.scores).write(tmp_path / "out.csv")
    with pytest.raises(KeypointsError, match="finite"):
        found.replaced(np.full_like(points, np.inf) * [[[1]], [[1]], [[np.nan]], [[1]]], found.scores).write(
            tmp_path / "out.csv"
        )
    with pytest.raises(KeypointsError, match="wanted points of shape"):
        found.replaced(points[:2], found.scores)
    with pytest.raises(KeypointsError, match="write to another place"):
        found.write(path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.csv"]


# Damaged files.


def samples():
    """A small good file of each format: name in a folder of its own, bytes."""
    names = layouts()
    body = [figure(names["BODY_25"], 100 + 5 * t, seed=t) for t in range(2)]
    halpe = [figure(names["HALPE_26"], 100 + 5 * t, seed=t) for t in range(2)]
    coco = figure(names["COCO_17"])
    results = [{"image_id": f"{t}.jpg", "keypoints": triples(halpe[t]), "score": 2.5} for t in range(2)]
    annotations = {
        "images": [{"id": 1, "width": 640, "height": 480}],
        "annotations": [{"image_id": 1, "keypoints": triples(coco)}],
    }
    return {
        "openpose": json.dumps(openpose_frame(*body)).encode(),
        "results": json.dumps(results).encode(),
        "annotations": json.dumps(annotations).encode(),
        "wide": WIDE.encode(),
        "long": LONG.encode(),
    }


@st.composite
def damages(draw):
    """A few edits: where (as a fraction), how many bytes go, which come."""
    tokens = [
        b"",
        b"9",
        b"-",
        b"e9",
        b"[",
        b"]",
        b"{",
        b"}",
        b",",
        b'"',
        b"\n",
        b"null",
        b"NaN",
        b"1e999",
        b"\x00",
    ]
    coming = st.one_of(
        st.sampled_from(tokens), st.binary(max_size=6), st.text(max_size=4).map(lambda t: t.encode())
    )
    edit = st.tuples(st.floats(0, 1), st.integers(0, 40), coming)
    return draw(st.lists(edit, min_size=1, max_size=5))


@pytest.mark.parametrize("name", ["openpose", "results", "annotations", "wide", "long"])
@settings(
    max_examples=FUZZ_EXAMPLES,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(edits=damages())
def test_damaged_files_raise_one_kind_of_error(tmp_path, name, edits):
    data = samples_once()[name]
    for where, gone, come in edits:
        start = round(where * len(data))
        data = data[:start] + come + data[start + gone :]
    path = tmp_path / "in"
    if name == "openpose":
        path.mkdir(exist_ok=True)
        (path / "a_1.json").write_bytes(data)
    else:
        path.write_bytes(data)
    try:
        found = read_keypoints(path, fps=25)
    except KeypointsError as error:
        assert "\n" not in str(error)
        return
    assert (
        found.points.size < 1_000_000 and np.isfinite(found.scores).all() and not np.isinf(found.points).any()
    )
    points = np.roll(found.points, 1, axis=1)
    try:
        found.replaced(points, found.scores).write(tmp_path / "out")
    except KeypointsError:
        return
    again = read_keypoints(tmp_path / "out", fps=25, layout=found.layout)
    if found.people.max() == 1:
        np.testing.assert_array_equal(again.points, points)
    shutil.rmtree(tmp_path / "out") if name == "openpose" else (tmp_path / "out").unlink()


_SAMPLES: dict[str, bytes] = {}


def samples_once():
    if not _SAMPLES:
        _SAMPLES.update(samples())
    return _SAMPLES


# The core's names.


def test_the_core_names_joints_and_pairs():
    assert layouts()["STICK_14"][0] == "neck" and len(layouts()) == 8
    assert _memo.joint_name("RKN") == "right_knee" and _memo.joint_name("C7") is None
    with pytest.raises(ValueError, match="did you mean"):
        _memo.joint_name("right_kne")
    pairs = _memo.side_pairs("BODY_25")
    assert (
        ("legs", "knee", 10, 13) in pairs
        and ("arms", "wrist", 4, 7) in pairs
        and ("head", "ear", 17, 18) in pairs
    )


def test_stick_joints_of_a_track():
    names = layouts()["COCO_17"]
    values = np.array([figure(names, 100 + t, seed=t) for t in range(3)])
    values[1, 5] = np.nan
    points, weights = memo.stick_joints("COCO_17", values[..., :2], values[..., 2])
    assert points.shape == (3, 14, 2) and weights.shape == (3, 14)
    shoulders, hips = values[0, 5:7, :2].mean(0), values[0, 11:13, :2].mean(0)
    np.testing.assert_allclose(points[0, 0], shoulders)
    np.testing.assert_allclose(points[0, 3], hips + (shoulders - hips) * 10.09 / 56.07)
    assert np.isnan(points[1, [0, 2, 3]]).all() and (weights[1, [0, 2, 3]] == 0).all()
    assert weights[0, 0] == values[0, 5:7, 2].min()
    same, _ = memo.stick_joints(names, values[..., :2], values[..., 2])
    np.testing.assert_array_equal(same, points)
    head, _ = memo.head_points("COCO_17", values[..., :2], values[..., 2])
    np.testing.assert_array_equal(head[0, 1:], values[0, [0, 2, 1, 4, 3], :2])
    feet, weights = memo.foot_points("COCO_17", values[..., :2], values[..., 2])
    assert np.isnan(feet).all() and feet.shape == (3, 4, 2) and (weights == 0).all()
    body_25 = np.arange(50.0).reshape(1, 25, 2)
    feet, _ = memo.foot_points("BODY_25", body_25, np.ones((1, 25)))
    np.testing.assert_array_equal(feet[0], body_25[0, [22, 19, 24, 21]])  # R and L big toe, R and L heel
    with pytest.raises(ValueError, match="expected 17 points, got 16"):
        memo.stick_joints("COCO_17", np.zeros((3, 16, 2)), np.zeros((3, 16)))
    with pytest.raises(ValueError, match="shape"):
        memo.stick_joints("COCO_17", np.zeros((3, 17, 3)), np.zeros((3, 17)))
    with pytest.raises(TypeError, match="dtype float64"):
        memo.stick_joints("COCO_17", np.zeros((3, 17, 2), np.float32), np.zeros((3, 17)))


# Real files.


def pose2sim_sample():
    folder = SHARED_DATA / "keypoints" / "pose2sim_balancing"
    if not folder.is_dir():
        pytest.skip(f"no keypoints in {folder} (set MEMO_SHARED_DATA)")
    return folder


def trc_joints(path: Path):
    """Joints by name, (T, 3) each, in the calibration's world."""
    lines = path.read_text().splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name]
    rows = np.array([[float(cell) for cell in line.split("\t")] for line in lines[5:] if line.strip()])
    values = rows[:, 2:].reshape(len(rows), -1, 3)[..., [2, 0, 1]]
    return {name: np.ascontiguousarray(values[:, index]) for index, name in enumerate(names)}


@pytest.mark.parametrize("camera_name", ["cam_02", "cam_04"])
def test_joints_of_a_real_sequence_lie_on_its_triangulated_ones(camera_name):
    folder = pose2sim_sample()
    found = read_keypoints(folder / f"{camera_name.replace('_', '')}_json", fps=60, layout="BODY_25B")
    assert len(found.frames) == 100 and (found.people == 1).all()
    camera = memo.Camera.from_toml(folder / "Calib_qualisys.toml", name=camera_name)
    space = trc_joints(next(folder.glob("*.trc")))
    distances = {}
    for spelling, points in space.items():
        name = {"Neck": "upper_neck"}.get(spelling) or _memo.joint_name(spelling)
        seen = found.points[:, found.names.index(name)]
        distances[name] = np.nanmedian(np.linalg.norm(camera.project(points) - seen, axis=1))
    assert len(distances) == 21
    assert np.median(list(distances.values())) < 9, distances
    assert max(distances.values()) < 40, distances


@pytest.mark.parametrize("camera_name", ["cam02", "cam04"])
def test_the_layout_of_a_real_sequence_is_recognised(camera_name):
    assert read_keypoints(pose2sim_sample() / f"{camera_name}_json", fps=60).layout == "BODY_25B"


def test_a_real_sequence_is_written_as_it_was(tmp_path):
    folder = pose2sim_sample() / "cam02_json"
    found = read_keypoints(folder, fps=60)
    found.write(tmp_path / "same")
    for file in folder.iterdir():
        assert (tmp_path / "same" / file.name).read_bytes() == file.read_bytes()
    found.replaced(found.points + 1, found.scores).write(tmp_path / "moved")
    np.testing.assert_array_equal(read_keypoints(tmp_path / "moved", fps=60).points, found.points + 1)


def test_keypoints_in_a_notebook(tmp_path):
    from memo.keypoints import write_csv

    points = np.random.default_rng(0).uniform(0, 500, (4, 3, 2))
    points[2, 1] = np.nan
    seen = Keypoints.from_arrays(points, names=["right_hip", "left_hip", "nose"], fps=25)
    assert repr(seen) == "Keypoints(3 points, frames 0 to 3, 92% seen)"
    frame = seen.to_pandas()
    write_csv(tmp_path / "points.csv", seen)
    with (tmp_path / "points.csv").open(newline="") as file:
        assert next(csv.reader(file)) == list(frame)
    assert np.array_equal(frame["left_hip_v_px"], points[:, 1, 1], equal_nan=True)
    assert frame.attrs["units"]["nose_u_px"] == "px" and frame["left_hip_score"][2] == 0
    ax = seen.plot()
    assert ax.yaxis_inverted() and ax.get_title(loc="left") == "frame 0"
    again = pickle.loads(pickle.dumps(seen))
    assert np.array_equal(again.points, seen.points, equal_nan=True) and again != seen
