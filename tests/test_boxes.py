"""Boxes around people from elsewhere, in place of looking for what moves: drawn walks, and files of boxes."""

import json

import memo
import numpy as np
import pytest
from conftest import ran
from memo.files import read_track_csv
from memo.formats.motion import FormatError
from memo.recording import Recording, track_recording

SEEDS = (0, 3)


def boxes_of(scene, rng, sd=0.02):
    """Boxes (0 or 1, 4) of each frame around the true joints, floor to crown, off by `sd` of the height."""
    boxes = [np.empty((0, 4)) for _ in scene.frames]
    width_px = scene.frames.shape[2]
    sideways = np.stack([values for name, values in scene.truth.items() if name.endswith("_u_px")], axis=1)
    for row, frame in enumerate(scene.truth["frame"].tolist()):
        x_m, y_m = (scene.truth[name][row] for name in ("x_m", "y_m"))
        upright = scene.camera.project(np.array([[x_m, y_m, 0], [x_m, y_m, scene.height_m]]))
        top, height = upright[1, 1], upright[0, 1] - upright[1, 1]
        left, right = sideways[row].min() - 0.06 * height, sideways[row].max() + 0.06 * height
        box = np.array([left, top, right - left, height]) + rng.normal(0, sd * height, 4)
        if box[0] + box[2] > 1 and box[0] < width_px - 2:
            boxes[frame] = box[None]
    return boxes


def in_flicker(frames, rng):
    """The frames with upright strips whose brightness changes from frame to frame."""
    strips = rng.integers(-25, 26, (len(frames), 1, frames.shape[2] // 40 + 1))
    return np.clip(frames + np.repeat(strips, 40, axis=2)[:, :, : frames.shape[2]], 0, 255).astype(np.uint8)


def off_m(track, scene):
    """Root mean square errors of the place of the torso on the ground, along x and along y, metres."""
    true_row = {frame: row for row, frame in enumerate(scene.truth["frame"].tolist())}
    rows = [true_row[frame] for frame in track.columns["frame"].tolist()]
    return [np.sqrt(np.mean((track.columns[name] - scene.truth[name][rows]) ** 2)) for name in ("x_m", "y_m")]


def is_on(track, scene):
    """Nearly right along the path; across it people sway by 2 cm, and those of the scene do not."""
    along_m, across_m = off_m(track, scene)
    return along_m < 0.03 and across_m < 0.05


@pytest.mark.parametrize("seed", SEEDS)
def test_boxes_find_a_walker_where_the_whole_picture_changes(seed):
    scene, rng = memo.demo_scene(seed, frames=90), np.random.default_rng(seed)
    known = {"times_s": scene.times_s, "camera": scene.camera, "height_m": scene.height_m}
    shown = len(scene.truth["frame"])
    still = memo.track(list(scene.frames), boxes=boxes_of(scene, rng), **known)
    assert len(still.walks) == 1 and len(still) >= 0.9 * shown and is_on(still, scene)
    # Strips of light that flicker hide who moves, but not whom a detector sees.
    frames = list(in_flicker(scene.frames.astype(int), rng))
    sought = memo.track(frames, **known)
    given = memo.track(frames, boxes=boxes_of(scene, rng), **known)
    assert len(sought) < 0.6 * shown
    assert len(given.walks) == 1 and len(given) >= 0.9 * shown and is_on(given, scene)


def test_without_a_box_nobody_is_looked_for():
    scene = memo.demo_scene(0, frames=30)
    boxes = [np.empty((0, 4))] * len(scene.frames)
    assert not memo.track(list(scene.frames), times_s=scene.times_s, boxes=boxes).walks
    stream = memo.Tracker(1.7)
    for frame, time_s in zip(scene.frames, scene.times_s, strict=True):
        assert stream.update(frame, time_s, []) is None
    assert not stream.finish().walks


def test_boxes_that_are_none_are_refused():
    frames = [np.zeros((40, 60), np.uint8)] * 3
    for boxes, says in [
        ([[0, 0, 5]], "boxes must have shape"),
        ([[[0, 0, 5, 5]]], "those of one frame"),
        ([[0, 0, 0, 5]], "box 0 must be left, top, width and height of pixels in a 60x40 picture"),
        ([[0, 0, 5, 5], [1, np.nan, 5, 5]], "box 1 must be"),
        ([[60, 0, 5, 5]], "box 0 must be"),
        ([[-9, 0, 5, 5]], "box 0 must be"),
    ]:
        with pytest.raises(ValueError, match=says):
            memo.track(frames, fps=25, boxes=[boxes] * 3)
    with pytest.raises(TypeError, match="boxes must have shape"):
        memo.track(frames, fps=25, boxes=["walker"] * 3)
    with pytest.raises(ValueError, match="boxes has 2 values, but there are more frames than that"):
        memo.track(frames, fps=25, boxes=[[]] * 2)
    with pytest.raises(ValueError, match="boxes has more values than the 3 frames"):
        memo.track(frames, fps=25, boxes=[[]] * 4)


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    """A video of a drawn walk before flickering strips, and a file of boxes."""
    import av

    folder = tmp_path_factory.mktemp("boxes")
    scene, rng = memo.demo_scene(0, frames=90), np.random.default_rng(0)
    with av.open(folder / "walk.mp4", "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": "16"})
        stream.height, stream.width = scene.frames.shape[1:]
        stream.pix_fmt = "yuv420p"
        for luma in in_flicker(scene.frames.astype(int), rng):
            picture = av.VideoFrame.from_ndarray(np.repeat(luma[:, :, None], 3, axis=2), format="rgb24")
            container.mux(stream.encode(picture))
        container.mux(stream.encode())
    rows = [
        # MOTChallenge counts frames and pixels from 1; a confidence of 0 marks a row that does not count.
        f"{frame + 1},-1,{left + 1:.1f},{top + 1:.1f},{width:.1f},{height:.1f},1,-1,-1,-1\n"
        f"{frame + 1},-1,1,1,40,90,0,-1,-1,-1\n"
        for frame, boxes in enumerate(boxes_of(scene, rng))
        for left, top, width, height in boxes
    ]
    (folder / "boxes.txt").write_text("".join(rows))
    return folder, scene


@pytest.mark.parametrize("more", [(), ("--frames", "5:"), ("--shrink", "2")])
def test_a_file_of_boxes_is_used(clip, tmp_path, more):
    folder, scene = clip
    given = ["--height", f"{scene.height_m:.2f}", "--boxes", folder / "boxes.txt", *more]
    ran("track", folder / "walk.mp4", *given, "--no-overlay", "--no-plots", "--quiet", "--out", tmp_path)
    track = read_track_csv(tmp_path / "track.csv")
    assert len(track["frame"]) >= 75 and len(set(track["walk"].tolist())) == 1
    true_row = {frame: row for row, frame in enumerate(scene.truth["frame"].tolist())}
    rows = [true_row[frame] for frame in track["frame"].tolist()]
    off_px = track["left_knee_u_px"] - scene.truth["left_knee_u_px"][rows]
    assert np.abs(np.median(off_px)) < 4
    assert json.loads((tmp_path / "run.json").read_text())["boxes"] == str(folder / "boxes.txt")


def test_files_without_a_box_in_the_picture_are_refused(clip, tmp_path):
    folder, _ = clip
    far = tmp_path / "far.txt"
    far.write_text("1,-1,5000,1,40,90,1\n")
    with pytest.raises(ValueError, match="no box is within the"):
        track_recording(Recording(folder / "walk.mp4", {}, boxes=far), tmp_path / "out")
    with pytest.raises(FormatError, match="cannot be read"):
        track_recording(Recording(folder / "walk.mp4", {}, boxes=tmp_path / "no.txt"), tmp_path / "out")
