"""Files that the detectors themselves write, read back. Each test is skipped where its tool is not installed.

pip install mediapipe sleap-io ultralytics
"""

import dataclasses
import json

import memo
import numpy as np
import pytest
from detector_files import FRAMES, PARTS, SIZE, walker

NUMBERS = (3, 5)
"""Numbers that the tracker gave two people."""


def test_results_of_mediapipe(tmp_path):
    """`dataclasses.asdict` of `PoseLandmarkerResult`, as on the page of keypoints."""
    vision = pytest.importorskip("mediapipe.tasks.python.vision")
    landmark = pytest.importorskip("mediapipe.tasks.python.components.containers.landmark")
    points, scores = walker("MEDIAPIPE_33")
    entries = []
    for frame in range(FRAMES):
        fractions = (points[frame] + 0.5) / SIZE
        people = [
            [
                landmark.NormalizedLandmark(x=x, y=y, z=0.0, visibility=score, presence=0.9)
                for (x, y), score in zip(fractions.tolist(), scores[frame].tolist(), strict=True)
            ]
        ]
        result = vision.PoseLandmarkerResult(
            pose_landmarks=[] if frame == 4 else people, pose_world_landmarks=[], segmentation_masks=None
        )
        entries.append(dataclasses.asdict(result) | {"timestamp_ms": 40 * frame})
    path = tmp_path / "mediapipe.json"
    path.write_text(json.dumps(entries, default=lambda mask: None))
    read = memo.read_keypoints(path, image_size=SIZE)
    kept = [frame for frame in range(FRAMES) if frame != 4]
    seen = np.isfinite(read.points).all(axis=(1, 2))
    np.testing.assert_allclose(read.points[seen], points[kept], atol=1e-6)
    np.testing.assert_allclose(read.scores[seen], scores[kept], atol=1e-6)
    np.testing.assert_allclose(read.times_s[seen], 0.04 * np.array(kept))


@pytest.fixture
def yolo():
    """Makes the results of two people in all frames, as Ultralytics does."""
    results = pytest.importorskip("ultralytics.engine.results")
    torch = pytest.importorskip("torch")
    points, scores = walker("COCO_17")
    other = points * 0.3 + 40

    def result(frame, *, tracked):
        people = [(points[frame], scores[frame]), (other[frame], scores[frame] * 0.5)]
        boxes = []
        for (places, confidence), number in zip(people, NUMBERS, strict=True):
            own = [number] if tracked else []
            boxes.append([*places.min(axis=0), *places.max(axis=0), *own, confidence.mean(), 0.0])
        keypoints = np.stack([np.column_stack(person) for person in people])
        return results.Results(
            np.zeros((SIZE[1], SIZE[0], 3), np.uint8),
            path="walk.mp4",
            names={0: "person"},
            boxes=torch.tensor(np.array(boxes, np.float32)),
            keypoints=torch.tensor(keypoints.astype(np.float32)),
        )

    return result, points, scores, other


@pytest.mark.parametrize("tracked", [False, True])
@pytest.mark.parametrize("save_conf", [False, True])
def test_labels_of_ultralytics(tmp_path, yolo, tracked, save_conf):
    result, points, scores, other = yolo
    folder = tmp_path / "labels"
    folder.mkdir()
    for frame in range(FRAMES):
        result(frame, tracked=tracked).save_txt(folder / f"walk_{frame + 1}.txt", save_conf=save_conf)
    read = memo.read_keypoints(folder, fps=30, image_size=SIZE)
    np.testing.assert_allclose(read.points, points, atol=0.02)
    np.testing.assert_allclose(read.scores, scores, atol=1e-3)
    assert read.times_s[0] == 0
    if tracked:
        small = memo.read_keypoints(folder, fps=30, image_size=SIZE, person=NUMBERS[1])
        np.testing.assert_allclose(small.points, other, atol=0.02)


@pytest.mark.parametrize("tracked", [False, True])
def test_json_of_ultralytics(tmp_path, yolo, tracked):
    result, points, scores, _ = yolo
    texts = [result(frame, tracked=tracked).to_json() for frame in range(FRAMES)]
    for name, entries in (("lists", [json.loads(text) for text in texts]), ("texts", texts)):
        path = tmp_path / f"{name}.json"
        path.write_text(json.dumps(entries))
        read = memo.read_keypoints(path, fps=30)
        np.testing.assert_allclose(read.points, points, atol=0.01)
        np.testing.assert_allclose(read.scores, scores, atol=1e-3)


@pytest.mark.parametrize("kind", ["h5", "csv"])
def test_analyses_of_sleap(tmp_path, kind):
    """As sleap-io, SLEAP's library of files, exports them."""
    sio = pytest.importorskip("sleap_io")
    joints = [joint or "mark" for joint in PARTS.values()]
    points, scores = walker(joints)
    skeleton, track = sio.Skeleton(list(PARTS)), sio.Track("anna")
    video = sio.Video("walk.mp4", open_backend=False)
    frames = [
        sio.LabeledFrame(
            video=video,
            frame_idx=frame,
            instances=[
                sio.PredictedInstance.from_numpy(
                    points[frame], point_scores=scores[frame], score=0.9, skeleton=skeleton, track=track
                )
            ],
        )
        for frame in range(FRAMES)
    ]
    labels = sio.Labels(frames, videos=[video], skeletons=[skeleton], tracks=[track])
    path = tmp_path / f"walk.{kind}"
    if kind == "h5":
        sio.save_file(labels, path, format="analysis_h5")
    else:
        sio.save_csv(labels, path, format="sleap")
    read = memo.read_keypoints(path, fps=30)
    assert set(read.names) == set(filter(None, PARTS.values()))
    kept = [joints.index(name) for name in read.names]
    np.testing.assert_allclose(read.points, points[:, kept], atol=1e-3)
    np.testing.assert_allclose(read.scores, scores[:, kept], atol=1e-3)
