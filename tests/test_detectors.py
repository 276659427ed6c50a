"""Files of detectors: all points are where the detector put them, and damage is described."""

import json
import math

import detector_files as made
import memo
import numpy as np
import pytest

READ = {
    "mediapipe": (made.mediapipe, "walk.json", {5}, 33),
    "mmpose_demo": (made.mmpose_demo, "results.json", set(), 26),
    "mmpose_whole_body": (made.mmpose_whole_body, "walk.json", set(), 23),
    "mmpose_images": (made.mmpose_images, "predictions", {4}, 17),
    "easy_vitpose": (made.easy_vitpose, "walk_result.json", {4}, 17),
    "yolo_labels": (made.yolo_labels, "labels", {4}, 17),
    "yolo_json": (made.yolo_json, "walk.json", {4}, 17),
    "deeplabcut": (made.deeplabcut, "walkDLC_resnet50.csv", set(), 7),
    "deeplabcut_h5": (made.deeplabcut, "walkDLC_resnet50.h5", set(), 7),
    "sleap": (made.sleap_csv, "analysis.csv", set(), 7),
    "sleap_h5": (made.sleap_h5, "analysis.h5", set(), 7),
    "openpose": (made.openpose, "walk_json", {4}, 25),
    "alphapose": (made.alphapose, "alphapose-results.json", {4}, 26),
    "coco": (made.coco, "coco.json", {4}, 17),
    "sports2d": (made.sports2d, "walk_Sports2D_px_person00.trc", set(), 11),
}


@pytest.mark.parametrize("name", READ)
def test_points_are_where_the_detector_put_them(tmp_path, name):
    write, file, absent, count = READ[name]
    if file.endswith(".h5"):
        pytest.importorskip("h5py")
    if name == "deeplabcut_h5":
        pytest.importorskip("tables")
    points, scores = write(tmp_path / file)
    read = memo.read_keypoints(tmp_path / file, fps=made.FPS, image_size=made.SIZE)
    seen = np.array([frame not in absent for frame in range(made.FRAMES)])
    assert read.points.shape == (made.FRAMES, count, 2)
    assert np.abs(read.points[seen] - points[seen]).max() < 0.01  # label files have six digits
    assert np.allclose(read.scores[seen], scores[seen], atol=1e-4)
    assert np.isnan(read.points[~seen]).all()
    assert read.people.tolist() == [
        0
        if frame in absent
        else 2
        if (name, frame) == ("mediapipe", 3)
        else 2
        if name == "sleap_h5" and frame > 7
        else 1
        for frame in range(made.FRAMES)
    ]
    assert np.allclose(read.times_s, np.arange(made.FRAMES) / made.FPS)
    assert read.frames.tolist() == list(range(made.FRAMES))


def test_feet_and_face_are_kept_where_the_layout_has_them(tmp_path):
    made.mediapipe(tmp_path / "a.json"), made.mmpose_whole_body(tmp_path / "b.json")
    for file in ("a.json", "b.json"):
        names = memo.read_keypoints(tmp_path / file, fps=25, image_size=made.SIZE).names
        assert {"left_big_toe", "right_heel", "nose", "left_ear"} <= set(names)
    assert "right_small_toe" in names


@pytest.mark.parametrize("shape", ["frames", "landmarks", "javascript", "solution"])
def test_mediapipe_is_read_in_each_form_in_which_people_save_it(tmp_path, shape):
    points, _ = made.mediapipe(tmp_path / "walk.json")
    results = json.loads((tmp_path / "walk.json").read_text())
    change = {
        "frames": lambda people: people,
        "landmarks": lambda people: people[0] if people else None,
        "javascript": lambda people: {"landmarks": people, "worldLandmarks": []},
        "solution": lambda people: {"pose_landmarks": {"landmark": people[0]} if people else None},
    }[shape]
    saved = [change(result["pose_landmarks"]) for result in results]
    (tmp_path / "other.json").write_text(json.dumps(saved))
    read = memo.read_keypoints(tmp_path / "other.json", fps=30, image_size=made.SIZE)
    seen = np.arange(made.FRAMES) != 5
    assert np.abs(read.points[seen] - points[seen]).max() < 1e-6 and read.layout == "MEDIAPIPE_33"


@pytest.mark.parametrize("shape", ["x y z v", "x y v", "x y z", "people"])
def test_arrays_of_mediapipe_are_read(tmp_path, shape):
    points, scores = made.walker("MEDIAPIPE_33")
    z = 0.2 * np.sin(np.arange(33)) * np.ones((made.FRAMES, 1))
    columns = {"x": (points[..., 0] + 0.5) / 1280, "y": (points[..., 1] + 0.5) / 720, "z": z, "v": scores}
    if shape == "people":
        whole = np.dstack([columns[name] for name in "xyzv"])
        data = [[frame, (0.3 * np.array(frame)).tolist()] for frame in whole.tolist()]
    else:
        data = np.dstack([columns[name] for name in shape.split()]).tolist()
    data[5], data[6] = None, []
    if shape != "people":
        data[7][3], data[8][4] = [0.0] * len(data[7][3]), [math.nan] * len(data[8][4])
    (tmp_path / "array.json").write_text(json.dumps(data))
    read = memo.read_keypoints(tmp_path / "array.json", fps=30, image_size=made.SIZE)
    seen = np.ones((made.FRAMES, 33), bool)
    seen[5:7] = False
    if shape != "people":
        seen[7, 3] = seen[8, 4] = False
    assert np.abs(read.points[seen] - points[seen]).max() < 1e-6 and np.isnan(read.points[~seen]).all()
    assert np.allclose(read.scores[seen], 1 if shape == "x y z" else scores[seen])
    assert len(read.everyone) == 1 + (shape == "people")


def test_texts_of_yolo_are_read(tmp_path):
    points, _ = made.yolo_json(tmp_path / "walk.json")
    frames = json.loads((tmp_path / "walk.json").read_text())
    (tmp_path / "texts.json").write_text(json.dumps([json.dumps(frame) for frame in frames]))
    read = memo.read_keypoints(tmp_path / "texts.json", fps=30)
    assert np.allclose(read.points[0], points[0], atol=0.01) and np.isnan(read.points[4]).all()


def landmarks(values):
    """Landmarks as `dataclasses.asdict` gives them."""
    return [
        {"x": x, "y": y, "z": z, "visibility": 0.9, "presence": 0.9, "name": None}
        for x, y, z in np.asarray(values, float).tolist()
    ]


WORLD = np.random.default_rng(0).normal(0, 0.4, (33, 3))
WORLD[[23, 24]] = (-0.1, 0, 0), (0.1, 0, 0)
NOBODY = "no person in any frame"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        ([], NOBODY),
        ([{"pose_landmarks": []}] * 3, NOBODY),
        ([{"pose_landmarks": None}, {"landmarks": []}, {}], NOBODY),
        ([[], [], []], NOBODY),
        ([None, []], NOBODY),
        (["[]", "[]"], NOBODY),
        ([{"frame_id": 0, "instances": []}], NOBODY),
        ({"meta_info": {}, "instance_info": []}, NOBODY),
        (None, "holds null and no keypoints: wanted a list with an entry for each frame, or an object"),
        ("walk", 'holds "walk" and no keypoints'),
        (3, "holds 3 and no keypoints"),
        (["[]", "{"], "entry 1: not JSON"),
        (["a", 3], "a list whose first entry is str: no known form of keypoints"),
        (np.ones((4, 17, 3)).tolist(), r"an array of shape \(4, 17, 3\), which does not name its points"),
        ((500 * np.ones((4, 33, 3))).tolist(), "coordinates up to 500, which are no fractions"),
        (np.zeros((4, 33, 4)).tolist(), NOBODY),
        (np.tile([0.5, 0.5, 0.1, 7.0], (4, 33, 1)).tolist(), r"last numbers \(7 to 7\) are no visibility"),
        (np.tile([0.5, 0.5, 7.0], (4, 33, 1)).tolist(), r"\(7 to 7\) are no visibility; wanted \(T, 33, 4\)"),
        ([[[0.5, 0.5, 0.5, 1.0]] * 23 + [[0.0, 0.0, 0.1, 1.0]] * 10], "these are world landmarks"),
        ([landmarks(WORLD)] * 4, "hips are at 0 in every frame: these are world landmarks"),
        ([{"pose_landmarks": [landmarks(WORLD)]}] * 4, "these are world landmarks; save the landmarks in"),
        ([{"pose_world_landmarks": [landmarks(WORLD)]}] * 4, "these are world landmarks; save the landmarks"),
        ([{"worldLandmarks": []}, {"worldLandmarks": [landmarks(WORLD)]}], "these are world landmarks"),
        ([landmarks(300 + 200 * WORLD)] * 4, "coordinates up to [0-9]+, which are no fractions"),
        ([[[0.5, 0.5, 0.1]] * 32 + [[0.5, 0.5]]], "wanted 33 landmarks of 3 or 4 numbers each"),
        ([[[10**400, 0.5, 0.1]] * 33], "a number too large"),
        ([[{"x": 10**400, "y": 0.5}] * 33], "landmark 0, x: 1.* is not a number"),
        ([[10**400]], "no known form of keypoints"),
        ([[[0.5, 0.5, 0.1]] * 33, [[0.5, 0.5, 0.1, 1]] * 33], "with three numbers and with four"),
    ],
)
def test_files_without_keypoints_are_refused_for_their_reason(tmp_path, data, words):
    (tmp_path / "a.json").write_text(json.dumps(data))
    with pytest.raises(memo.keypoints.KeypointsError, match=words):
        memo.read_keypoints(tmp_path / "a.json", fps=30, image_size=made.SIZE)


def test_mediapipe_gives_the_times_that_were_saved(tmp_path):
    made.mediapipe(tmp_path / "walk.json")
    results = json.loads((tmp_path / "walk.json").read_text())
    timed = [{**result, "timestamp_ms": 40 * frame + 7} for frame, result in enumerate(results)]
    (tmp_path / "walk.json").write_text(json.dumps(timed))
    read = memo.read_keypoints(tmp_path / "walk.json", image_size=made.SIZE)
    assert np.allclose(read.times_s, 0.007 + 0.04 * np.arange(made.FRAMES))
    del timed[2]["timestamp_ms"]
    (tmp_path / "walk.json").write_text(json.dumps(timed))
    with pytest.raises(memo.keypoints.KeypointsError, match="19 of 20 entries have timestamp_ms"):
        memo.read_keypoints(tmp_path / "walk.json", image_size=made.SIZE)


def test_variants_of_yolo_sleap_and_deeplabcut(tmp_path):
    points, scores = made.yolo_labels(tmp_path / "labels", confidence=False)
    read = memo.read_keypoints(tmp_path / "labels", fps=30, image_size=made.SIZE)
    assert np.allclose(read.points[0], points[0], atol=0.01) and (read.scores[0] == 1).all()
    points, _ = made.yolo_json(tmp_path / "n.json", normalized=True)
    read = memo.read_keypoints(tmp_path / "n.json", fps=30, image_size=made.SIZE)
    assert np.allclose(read.points[0], points[0], atol=0.02)
    points, _ = made.deeplabcut(tmp_path / "two.csv", individuals=("anna", "ben"))
    read = memo.read_keypoints(tmp_path / "two.csv", fps=30, person="ben")
    assert np.allclose(read.points, points + 300) and read.people.tolist() == [2] * made.FRAMES
    assert {someone.name for someone in read.everyone} == {"anna", "ben"}
    with pytest.raises(memo.keypoints.KeypointsError, match="no person 1: the file names anna, ben"):
        memo.read_keypoints(tmp_path / "two.csv", fps=30, person=1)
    pytest.importorskip("h5py")
    points, scores = made.sleap_h5(tmp_path / "s.h5", dims=("frame", "track", "node", "xy"))
    read = memo.read_keypoints(tmp_path / "s.h5", fps=30)
    assert np.allclose(read.points, points) and np.allclose(read.scores, scores)


@pytest.mark.parametrize("ending", [".csv", ".h5"])
def test_deeplabcut_tables_in_space_and_of_several_scorers_are_refused(tmp_path, ending):
    pytest.importorskip("h5py")
    pandas = pytest.importorskip("pandas")
    path = tmp_path / f"walk{ending}"

    def with_bob(factor):
        """The columns of two scorers side by side."""
        return lambda table: pandas.concat(
            [table, table.rename(columns={"DLC_resnet50": "bob"}) * factor], axis=1
        )

    made.deeplabcut(path, change=lambda table: table.rename(columns={"likelihood": "z"}))  # `triangulate`
    with pytest.raises(memo.keypoints.KeypointsError, match="points in space, not image points"):
        memo.read_keypoints(path, fps=30)
    made.deeplabcut(path, change=with_bob(2))
    with pytest.raises(memo.keypoints.KeypointsError, match=r"of 2 scorers \(DLC_resnet50, bob\); keep"):
        memo.read_keypoints(path, fps=30)
    points, _ = made.deeplabcut(path, change=with_bob(np.nan))
    assert np.allclose(memo.read_keypoints(path, fps=30).points, points)


@pytest.mark.parametrize("ending", [".csv", ".h5"])
def test_deeplabcut_labels_of_two_videos_are_refused(tmp_path, ending):
    pytest.importorskip("h5py")
    pytest.importorskip("pandas")

    def labelled(*videos):
        """The labels of images that were taken from these videos in turn."""
        images = [
            f"labeled-data/{videos[frame % len(videos)]}/img{7 * frame:03d}.png"
            for frame in range(made.FRAMES)
        ]
        return lambda table: table.drop(columns="likelihood", level="coords").set_axis(images)

    path = tmp_path / f"CollectedData_anna{ending}"
    points, _ = made.deeplabcut(path, change=labelled("walk1"))
    read = memo.read_keypoints(path, fps=30)
    assert read.frames[-1] == 133 and np.allclose(read.points[::7], points)
    made.deeplabcut(path, change=labelled("walk1", "walk2"))
    with pytest.raises(
        memo.keypoints.KeypointsError, match=r"img000.png and .*walk2/img007.png differ by more"
    ):
        memo.read_keypoints(path, fps=30)


def test_sleap_tables_of_two_videos_are_refused(tmp_path):
    made.sleap_csv(tmp_path / "sleap.csv")
    header, *rows = (tmp_path / "sleap.csv").read_text().splitlines()
    one = [f"{header},video_path", *(f"{row},a.mp4" for row in rows)]
    (tmp_path / "one.csv").write_text("\n".join(one))
    assert len(memo.read_keypoints(tmp_path / "one.csv", fps=30).frames) == made.FRAMES
    (tmp_path / "two.csv").write_text("\n".join([*one, *(f"{row},b.mp4" for row in rows)]))
    with pytest.raises(
        memo.keypoints.KeypointsError, match=r"video_path: a.mp4 and b.mp4; export each video"
    ):
        memo.read_keypoints(tmp_path / "two.csv", fps=30)


def test_a_track_of_sleap_twice_in_a_frame_is_refused(tmp_path):
    made.sleap_csv(tmp_path / "sleap.csv")
    lines = (tmp_path / "sleap.csv").read_text().splitlines()
    (tmp_path / "sleap.csv").write_text("\n".join([*lines, lines[4]]))
    with pytest.raises(memo.keypoints.KeypointsError, match="person track_0 appears twice in frame 3"):
        memo.read_keypoints(tmp_path / "sleap.csv", fps=30)


def test_numbers_of_frames_are_kept_where_the_first_one_is_0_or_they_are_of_images(tmp_path):
    made.yolo_labels(tmp_path / "labels")
    (tmp_path / "images").mkdir()
    for file in (tmp_path / "labels").iterdir():
        number = int(file.stem.removeprefix("walk_"))
        (tmp_path / "images" / f"walk_{number:04d}.txt").write_text(file.read_text())
    (tmp_path / "labels" / "walk_0.txt").write_text("")
    made.mmpose_demo(tmp_path / "demo.json")
    demo = json.loads((tmp_path / "demo.json").read_text())
    demo["instance_info"].insert(0, {"frame_id": 0, "instances": []})
    (tmp_path / "demo.json").write_text(json.dumps(demo))
    for name, first in (("labels", 0), ("images", 1), ("demo.json", 0)):
        read = memo.read_keypoints(tmp_path / name, fps=made.FPS, image_size=made.SIZE)
        assert (read.frames[0], read.frames[-1]) == (first, made.FRAMES), name


def with_tracks(folder, confidence):
    """As `model.track(video, save_txt=True)`: another person is track 3; frame 9 has no tracks."""
    points, _ = made.yolo_labels(folder)
    for file in folder.iterdir():
        line = file.read_text().strip()
        cells = line.split()
        other = " ".join([*cells[:5], *(f"{float(cell) * 0.4:g}" for cell in cells[5:])])
        behind = [f"{' 0.8' * confidence}{'' if file.stem == 'walk_10' else f' {track}'}" for track in (7, 3)]
        both = [line + behind[0], other + behind[1]]
        file.write_text("\n".join(both[:: 1 if int(file.stem[5:]) % 2 else -1]) + "\n")
    return points


@pytest.mark.parametrize("confidence", [False, True])
def test_tracks_of_yolo_are_people(tmp_path, confidence):
    points = with_tracks(tmp_path / "labels", confidence)
    reading = {"fps": made.FPS, "image_size": made.SIZE}
    tracked = np.array([frame not in (4, 9) for frame in range(made.FRAMES)])
    for person, scale in ((7, 1), ("7", 1), (3, 0.4)):
        read = memo.read_keypoints(tmp_path / "labels", person=person, **reading)
        assert np.allclose(read.points[tracked], scale * points[tracked], atol=0.02)
        assert np.isnan(read.points[~tracked]).all()
    assert [(one.name, one.frames) for one in read.everyone] == [("7", 18), ("3", 18)]
    followed = memo.read_keypoints(tmp_path / "labels", **reading)
    assert np.isfinite(followed.points[9]).all()
    with pytest.raises(memo.keypoints.KeypointsError, match="no person 0: the file names 3, 7"):
        memo.read_keypoints(tmp_path / "labels", person=0, **reading)


def test_confidences_are_no_tracks_and_json_has_tracks_too(tmp_path):
    made.yolo_labels(tmp_path / "labels")
    for file in (tmp_path / "labels").iterdir():
        file.write_text(file.read_text().strip() + (" 1\n" if file.stem == "walk_3" else " 0.91\n"))
    read = memo.read_keypoints(tmp_path / "labels", fps=30, image_size=made.SIZE)
    assert [one.name for one in read.everyone] == ["0"]
    for file in (tmp_path / "labels").iterdir():  # two people, each as certain as can be
        cells = file.read_text().split()[:-1]
        other = [*cells[:5], *(f"{float(cell) * 0.4:g}" for cell in cells[5:])]
        file.write_text(f"{' '.join(cells)} 1\n{' '.join(other)} 1\n")
    read = memo.read_keypoints(tmp_path / "labels", fps=30, image_size=made.SIZE)
    assert [(one.name, one.frames) for one in read.everyone] == [("0", 19), ("1", 19)]
    points, _ = made.yolo_json(tmp_path / "yolo.json")
    frames = json.loads((tmp_path / "yolo.json").read_text())
    for people in frames:
        people.extend({**person, "track_id": 5} for person in people[:1])
        for person in people[:1]:
            person["track_id"] = 12
            person["keypoints"] = {**person["keypoints"], "x": [3.0] * 17}
    (tmp_path / "yolo.json").write_text(json.dumps(frames))
    read = memo.read_keypoints(tmp_path / "yolo.json", fps=30, person=5)
    seen = np.arange(made.FRAMES) != 4
    assert np.allclose(read.points[seen], points[seen], atol=0.01)


def saved(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


DAMAGE = {
    "a fraction without size": (
        lambda f: (made.mediapipe(f / "a.json"), f / "a.json")[1],
        "fractions of the picture.*image_size",
    ),
    "landmarks missing": (
        lambda f: saved(f, "a.json", json.dumps([[[{"x": 0.1, "y": 0.2}] * 32]])),
        "entry 0, person 0: wanted 33 landmarks, got 32",
    ),
    "a landmark of text": (
        lambda f: saved(f, "a.json", json.dumps([[[{"x": "0.1", "y": 0.2}] * 33]])),
        "landmark 0, x: 0.1 is not a number",
    ),
    "instances without scores": (
        lambda f: saved(f, "a.json", json.dumps([{"frame_id": 0, "instances": [{"keypoints": [[1, 2]]}]}])),
        "instance 0: wanted keypoints and keypoint_scores, got keypoints",
    ),
    "points in space": (
        lambda f: saved(
            f,
            "a.json",
            json.dumps([{"frame_id": 0, "instances": [{"keypoints": [[1, 2, 3]], "keypoint_scores": [1]}]}]),
        ),
        r"wanted points \(K, 2\) in the picture.*got \(1, 3\)",
    ),
    "a frame twice": (
        lambda f: saved(f, "a.json", json.dumps([{"frame_id": 3, "instances": []}] * 2)),
        "frame_id 3 is also that of entry 0",
    ),
    "no frame number": (
        lambda f: saved(f, "a.json", json.dumps({"instance_info": [{"frame_id": "x", "instances": []}]})),
        "frame_id x is not a frame number",
    ),
    "a detection model": (
        lambda f: saved(f, "a.json", json.dumps([[{"class": 0, "box": {}, "name": "person"}]])),
        "wanted keypoints with x and y .* got class, box, name",
    ),
    "one picture": (
        lambda f: saved(f, "a.json", json.dumps([{"class": 0, "box": {}, "name": "person"}])),
        "the people of one picture",
    ),
    "a skeleton of a mouse": (
        lambda f: saved(f, "a.json", json.dumps({"keypoints": [], "skeleton": {"0": "whisker"}})),
        "wanted different names of joints, got none",
    ),
    "body parts of a mouse": (
        lambda f: saved(f, "a.csv", "scorer,s,s\nbodyparts,whisker,whisker\ncoords,x,y\n0,1,2\n"),
        "names of different joints, such as left_knee, are needed; got whisker",
    ),
    "a short row": (
        lambda f: saved(f, "a.csv", "scorer,s,s\nbodyparts,nose,nose\ncoords,x,y\n0,1\n"),
        "row 4 has 2 cells, the header 3",
    ),
    "nodes without y": (
        lambda f: saved(f, "a.csv", "track,frame_idx,nose.x\n,0,1\n"),
        "no column nose.y",
    ),
    "a frame that is none": (
        lambda f: saved(f, "a.csv", "track,frame_idx,nose.x,nose.y\n,x,1,2\n"),
        "row 2, frame_idx: x is not a number",
    ),
    "a project of SLEAP": (lambda f: saved(f, "a.slp", "x"), "export its analysis"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_is_described(tmp_path, damage):
    write, words = DAMAGE[damage]
    with pytest.raises(memo.keypoints.KeypointsError, match=words):
        memo.read_keypoints(write(tmp_path), fps=30, image_size=None if "size" in damage else made.SIZE)


def test_damaged_labels_and_sizes_are_described(tmp_path):
    made.yolo_labels(tmp_path / "labels")
    with pytest.raises(memo.keypoints.KeypointsError, match="image_size"):
        memo.read_keypoints(tmp_path / "labels", fps=30)
    (tmp_path / "labels" / "walk_2.txt").write_text("0 0.5 0.5 0.1 0.1\n")
    with pytest.raises(
        memo.keypoints.KeypointsError, match=r"walk_2.txt: line 1: 5 numbers; wanted class, box"
    ):
        memo.read_keypoints(tmp_path / "labels", fps=30, image_size=made.SIZE)
    for size in ((0, 9), (1280.0, 720.0), "1280x720", (1, 2, 3)):
        with pytest.raises(memo.keypoints.KeypointsError, match="wanted width and height in whole pixels"):
            memo.read_keypoints(tmp_path / "labels", fps=30, image_size=size)


def test_h5_files_of_other_programs_and_damaged_ones_are_described(tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file.create_dataset("speed", data=[1.0])
    (tmp_path / "text.h5").write_text("not HDF5")
    made.sleap_h5(tmp_path / "short.h5")
    with h5py.File(tmp_path / "short.h5", "r+") as file:
        del file["node_names"]
        file.create_dataset("node_names", data=[b"nose"])
    with h5py.File(tmp_path / "code.h5", "w") as file:
        table = np.zeros(1, [("index", "i8"), ("values_block_0", "f8", (2,))])
        file.create_dataset("df_with_missing/table", data=table)
        # A pickle that would call a function: DeepLabCut's has lists, tuples and texts only.
        file["df_with_missing/table"].attrs["values_block_0_kind"] = np.bytes_(b"cos\ngetcwd\n(tR.")
    for file, words in (
        ("other.h5", "neither DeepLabCut's .* got speed"),
        ("text.h5", "not an HDF5 file"),
        ("short.h5", "1 node_names"),
        ("code.h5", "names of the columns cannot be read: .*getcwd is not plain data"),
    ):
        with pytest.raises(memo.keypoints.KeypointsError, match=words):
            memo.read_keypoints(tmp_path / file, fps=30)


def test_without_h5py_the_error_says_how_to_install_it(tmp_path, monkeypatch):
    (tmp_path / "a.h5").write_bytes(b"")
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(memo.keypoints.KeypointsError, match=r'HDF5 needs h5py: pip install "h5py'):
        memo.read_keypoints(tmp_path / "a.h5", fps=30)


def test_commands_take_the_size_of_the_picture(tmp_path, memo_command):
    made.mediapipe(tmp_path / "walk.json")
    common = ["unswap", tmp_path / "walk.json", "--fps", "30", "--format", "csv", "--out", tmp_path / "out"]
    code, _, err = memo_command(*common)
    assert code == 1 and "give its width and height (--image-size)" in err
    code, _, err = memo_command("planar", *common[1:4], "--out", tmp_path / "out")
    assert code == 1 and "give its width and height (--image-size)" in err
    code, _, err = memo_command("convert", tmp_path / "walk.json", tmp_path / "c.json", "--fps", 30)
    assert code == 1 and "give its width and height (--image-size)" in err
    arguments = [tmp_path / "walk.json", tmp_path / "c.json", "--image-size", "1280x720"]
    code, _, err = memo_command("convert", *arguments)
    assert code == 1 and "has no time stamps; give its frame rate (--fps)" in err
    assert memo_command("convert", *arguments, "--fps", 30)[0] == 0
    assert memo.read_keypoints(tmp_path / "c.json", fps=30).people.sum() == made.FRAMES - 1
    code, _, err = memo_command(
        "calibrate", "walker", tmp_path / "walk.json", "--height", "1.8", "--out", tmp_path
    )
    assert code == 1 and "give its width and height (--size)" in err
    code, _, err = memo_command(*common, "--image-size", "720p")
    assert code == 1 and "--image-size 720p is not two whole numbers such as 1920x1080" in err
    code, said, err = memo_command(*common, "--image-size", "1280x720", "--json")
    assert code == 0 and json.loads(said)["frames"] == made.FRAMES, err


@pytest.mark.parametrize("name", READ)
def test_damaged_files_raise_one_kind_of_error(tmp_path, name):
    write, file, _, _ = READ[name]
    if file.endswith(".h5"):
        pytest.importorskip("h5py"), pytest.importorskip("tables")
    write(tmp_path / file)
    files = sorted((tmp_path / file).iterdir()) if (tmp_path / file).is_dir() else [tmp_path / file]
    random = np.random.default_rng(0)
    whole = files[0].read_bytes()
    start = 0 if len(whole) < 4000 or file.endswith(".h5") else 400  # heads decide more than numbers
    for _ in range(60):
        content = bytearray(whole)
        for place in random.integers(
            0, random.choice([start or len(content), len(content)]), random.integers(1, 4)
        ):
            content[place] = random.choice(list(b'[]{},:"0.-ex\n\x00\xff'))
        files[0].write_bytes(content[: random.choice([len(content), random.integers(len(content))])])
        try:
            memo.read_keypoints(tmp_path / file, fps=30, image_size=made.SIZE)
        except memo.keypoints.KeypointsError as error:
            assert str(tmp_path) in str(error) and "\n" not in str(error)


@pytest.mark.parametrize("command", ["posture", "unswap"])
@pytest.mark.parametrize(
    ("person", "words"),
    [
        ("1,1@-1", "--person 1,1@-1 is not a point in a frame: X,Y@F, such as 320,240@50"),
        ("nan,nan@50", "--person nan,nan@50 is not a point in a frame"),
        ("@", "--person @ is not a point in a frame"),
        ("340,250", "a place needs its frame: X,Y@F in pixels, such as 340,250@50"),
        ("7", "no person 7: there is 1 person, and the first is 0"),
        ("anna", "no person anna: the file does not name people"),
    ],
)
def test_a_person_that_is_none_is_said_in_one_line(tmp_path, memo_command, command, person, words):
    made.yolo_json(tmp_path / "yolo.json")
    options = ["--fps", "30", "--image-size", "1280x720", "--person", person, "--out", tmp_path / "out"]
    code, said, err = memo_command(command, tmp_path / "yolo.json", *options)
    assert code == 1 and said == "" and words in err and len(err.splitlines()) == 1
