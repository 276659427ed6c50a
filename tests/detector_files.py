"""Small files of detectors, each written as the tool writes it, of a known walker in 1280 x 720 pixels.

Each writer follows the tool's own code, which the docstring of the reader names. Those of DeepLabCut are the
calls of pandas that DeepLabCut makes.
"""

import json

import memo
import numpy as np
from memo.keypoints import layouts

SIZE = (1280, 720)
FPS = 30.0
FRAMES = 20


def walker(layout):
    """(T, K, 2) pixels in the order of a layout, and (T, K) scores; other points are spread out."""
    motion = memo.walker_motion(FRAMES, rate_hz=FPS)
    flat = np.stack([640 + 200 * motion.positions[..., 0], 700 - 300 * motion.positions[..., 2]], axis=-1)
    full = [memo._memo.joint_name(name) for name in motion.names[:12]]
    names = layouts()[layout] if isinstance(layout, str) else layout
    points = np.stack(
        [
            flat[:, full.index(name)] if name in full else flat.mean(axis=1) + np.array([3, -2]) * place
            for place, name in enumerate(names)
        ],
        axis=1,
    )
    scores = 0.5 + 0.4 * np.cos(np.arange(FRAMES)[:, None] + np.arange(len(names)))
    return points, np.round(scores, 3)


def mediapipe(path, step_ms=None):
    """`[asdict(result) for result in results]`, with another person in frame 3, nobody in frame 5."""
    points, scores = walker("MEDIAPIPE_33")
    results = []
    for frame in range(FRAMES):
        people = [] if frame == 5 else [_landmarks(points[frame], scores[frame])]
        if frame == 3:
            people.append(_landmarks(points[frame] * 0.2 + 30, scores[frame] * 0.5))
        results.append({"pose_landmarks": people, "pose_world_landmarks": [], "segmentation_masks": None})
        if step_ms is not None:
            results[-1]["timestamp_ms"] = step_ms * frame
    path.write_text(json.dumps(results))
    return points, scores


def _landmarks(points, scores):
    fractions = (points + 0.5) / SIZE
    return [
        {"x": x, "y": y, "z": -0.1, "visibility": visibility, "presence": 0.9}
        for (x, y), visibility in zip(fractions.tolist(), scores.tolist(), strict=True)
    ]


def _instances(points, scores):
    low, high = points.min(axis=0), points.max(axis=0)
    box = {"bbox": [[*low.tolist(), *high.tolist()]], "bbox_score": 0.9}
    return [{"keypoints": points.tolist(), "keypoint_scores": scores.tolist(), **box}]


def mmpose_demo(path, layout="HALPE_26"):
    """As `demo/topdown_demo_with_mmdet.py --save-predictions`: its frames count from 1."""
    points, scores = walker(layout)
    names = {"mid_hip": "hip", "head_top": "head"}
    meta = {"keypoint_id2name": {str(i): names.get(n, n) for i, n in enumerate(layouts()[layout])}}
    frames = [
        {"frame_id": frame + 1, "instances": _instances(points[frame], scores[frame])}
        for frame in range(FRAMES)
    ]
    path.write_text(json.dumps({"meta_info": meta, "instance_info": frames}, indent="\t"))
    return points, scores


def mmpose_whole_body(path):
    """As `MMPoseInferencer("wholebody")(video, pred_out_dir=...)`: 133 points without names."""
    feet = [f"{side}_{part}" for side in ("left", "right") for part in ("big_toe", "small_toe", "heel")]
    points, scores = walker([*layouts()["COCO_17"], *feet, *[f"other{k}" for k in range(110)]])
    frames = [{"frame_id": t, "instances": _instances(points[t], scores[t])} for t in range(FRAMES)]
    path.write_text(json.dumps(frames, indent="  "))
    return points[:, :23], scores[:, :23]


def mmpose_images(folder):
    """As `MMPoseInferencer` with a folder of images: a file per image."""
    points, scores = walker("COCO_17")
    folder.mkdir()
    for frame in range(FRAMES):
        people = [] if frame == 4 else _instances(points[frame], scores[frame])
        (folder / f"img{frame:04d}.json").write_text(json.dumps(people))
    return points, scores


def easy_vitpose(path):
    points, scores = walker("COCO_17")
    frames = [
        {"0": np.column_stack([points[t][:, ::-1], scores[t]]).tolist()} if t != 4 else {}
        for t in range(FRAMES)
    ]
    skeleton = {str(index): name for index, name in enumerate(layouts()["COCO_17"])}
    path.write_text(json.dumps({"keypoints": frames, "skeleton": skeleton}))
    return points, scores


def yolo_labels(folder, confidence=True):
    """As `model.predict(video, save_txt=True)`: a file per frame with a person, counted from 1."""
    points, scores = walker("COCO_17")
    folder.mkdir()
    for frame in range(FRAMES):
        if frame == 4:
            continue
        fractions = points[frame] / SIZE
        values = np.column_stack([fractions, scores[frame]]) if confidence else fractions
        line = ("%g " * (5 + values.size)).rstrip() % (0, 0.5, 0.5, 0.2, 0.6, *values.ravel().tolist())
        (folder / f"walk_{frame + 1}.txt").write_text(line + "\n")
    return points, scores if confidence else np.ones_like(scores)


def yolo_json(path, normalized=False):
    """`[json.loads(result.to_json()) for result in results]`."""
    points, scores = walker("COCO_17")
    frames = []
    for frame in range(FRAMES):
        x, y = (points[frame] / (SIZE if normalized else 1)).round(5).T.tolist()
        keypoints = {"x": x, "y": y, "visible": scores[frame].tolist()}
        box = {"x1": 1.0, "y1": 2.0, "x2": 3.0, "y2": 4.0}
        person = {"name": "person", "class": 0, "confidence": 0.9, "box": box, "keypoints": keypoints}
        frames.append([] if frame == 4 else [person])
    path.write_text(json.dumps(frames))
    return points, scores


PARTS = {
    "RightKnee": "right_knee",
    "leftknee": "left_knee",
    "right_ankle": "right_ankle",
    "LAnkle": "left_ankle",
    "nose": "nose",
    "right_hip": "right_hip",
    "left_hip": "left_hip",
    "background_mark": None,
}
"""Names as users of DeepLabCut and SLEAP choose them, and the joints they are."""


def deeplabcut(path, individuals=("person1",), change=lambda table: table):
    """As DeepLabCut writes its predictions, CSV or H5: `DataFrame.to_csv`, `DataFrame.to_hdf`.

    `change` makes another table of it.
    """
    import pandas

    points, scores = walker([joint or "mark" for joint in PARTS.values()])
    values = np.dstack([points, scores]).reshape(FRAMES, -1)
    values = np.hstack([values + 300 * index for index in range(len(individuals))])
    levels = {"scorer": ["DLC_resnet50"], "individuals": individuals, "bodyparts": list(PARTS)}
    if len(individuals) == 1:
        del levels["individuals"]
    levels["coords"] = ["x", "y", "likelihood"]
    columns = pandas.MultiIndex.from_product(levels.values(), names=list(levels))
    table = change(pandas.DataFrame(values, columns=columns))
    if path.suffix == ".h5":
        table.to_hdf(path, key="df_with_missing", format="table", mode="w")
    else:
        table.to_csv(path)
    kept = [index for index, joint in enumerate(PARTS.values()) if joint]
    return points[:, kept], scores[:, kept]


def sleap_h5(path, dims=("track", "xy", "node", "frame")):
    """As SLEAP's analysis: two tracks, the second of which begins late."""
    import h5py

    points, scores = walker([joint or "mark" for joint in PARTS.values()])
    order = ("frame", "track", "node", "xy")
    tracks = np.stack([points, np.where(np.arange(FRAMES)[:, None, None] < 8, np.nan, points * 0.3)], axis=1)
    both = np.stack([scores, 0.2 * scores], axis=1)
    with h5py.File(path, "w") as file:
        own = [axis for axis in dims if axis != "xy"]
        data = file.create_dataset("tracks", data=tracks.transpose([order.index(axis) for axis in dims]))
        rest = file.create_dataset("point_scores", data=both.transpose([order.index(axis) for axis in own]))
        if dims != ("track", "xy", "node", "frame"):  # SLEAP itself writes no names of axes
            data.attrs["dims"], rest.attrs["dims"] = json.dumps(dims), json.dumps(own)
        file.create_dataset("node_names", data=[name.encode() for name in PARTS])
        file.create_dataset("track_names", data=[b"track_0", b"track_1"])
    kept = [index for index, joint in enumerate(PARTS.values()) if joint]
    return points[:, kept], scores[:, kept]


def sleap_csv(path):
    points, scores = walker([joint or "mark" for joint in PARTS.values()])
    head = ",".join(f"{name}.x,{name}.y,{name}.score" for name in PARTS)
    rows = [f"track,frame_idx,instance.score,{head}"]
    for frame in range(FRAMES):
        values = np.column_stack([points[frame], scores[frame]]).ravel().tolist()
        rows.append(f"track_0,{frame},0.9," + ",".join(map(repr, values)))
    path.write_text("\n".join(rows) + "\n")
    kept = [index for index, joint in enumerate(PARTS.values()) if joint]
    return points[:, kept], scores[:, kept]


def openpose(folder):
    """As `openpose --write_json FOLDER`: a file per frame, counted from 0, with a list of people."""
    points, scores = walker("BODY_25")
    folder.mkdir()
    for frame in range(FRAMES):
        values = np.column_stack([points[frame], scores[frame]]).ravel().tolist()
        people = [] if frame == 4 else [{"person_id": [-1], "pose_keypoints_2d": values}]
        name = f"walk_{frame:012d}_keypoints.json"
        (folder / name).write_text(json.dumps({"version": 1.3, "people": people}))
    return points, scores


def alphapose(path):
    """As AlphaPose's `write_json`: an entry per person, with the name of the image, counted from 0."""
    points, scores = walker("HALPE_26")
    entries = [
        {
            **{"image_id": f"{frame}.jpg", "category_id": 1, "score": 2.9, "box": [1.0, 2.0, 3.0, 4.0]},
            **{"idx": [0.0], "keypoints": np.column_stack([points[frame], scores[frame]]).ravel().tolist()},
        }
        for frame in range(FRAMES)
        if frame != 4
    ]
    path.write_text(json.dumps(entries))
    return points, scores


def coco(path):
    """Results in the format of COCO."""
    points, scores = walker("COCO_17")
    entries = [
        {
            **{"image_id": frame, "category_id": 1, "score": 0.9},
            "keypoints": np.column_stack([points[frame], scores[frame]]).ravel().tolist(),
        }
        for frame in range(FRAMES)
        if frame != 4
    ]
    path.write_text(json.dumps(entries))
    return points, scores


def trc_text(names, values, *, rate_hz=25, unit="m", own_name="walk_Sports2D_px_person00.trc", end="\n"):
    """A file as Sports2D writes it: frames from 0, `m` for pixels too, empty cells where missing."""
    cells = "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, len(names) + 1))
    count = len(values)
    rows = [
        f"PathFileType\t4\t(X/Y/Z)\t{own_name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate_hz:g}\t{rate_hz:g}\t{count}\t{len(names)}\t{unit}\t{rate_hz:g}\t0\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t\t",
        "\t\t" + cells,
    ]
    for t, points in enumerate(values):
        own = ["" if np.isnan(number) else f"{number:.3f}" for point in points for number in (*point, 0.0)]
        rows.append("\t".join([str(t), f"{t / rate_hz:.3f}", *own]))
    return end.join([*rows, ""])


SPORTS2D = ["Hip", "RHip", "RKnee", "RAnkle", "RBigToe", "LHip", "LKnee", "LAnkle", "LBigToe", "Neck", "Head"]


def sports2d(path):
    """As Sports2D writes image points: TRC in pixels, with times, without scores."""
    joints = ["mid_hip", "right_hip", "right_knee", "right_ankle", "right_big_toe"]
    joints += ["left_hip", "left_knee", "left_ankle", "left_big_toe", "neck", "head_top"]
    points, _ = walker(joints)
    path.write_text(trc_text(SPORTS2D, points, rate_hz=FPS))
    return points, np.ones(points.shape[:2])
