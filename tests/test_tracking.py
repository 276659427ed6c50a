"""What tracking promises apart from being right: clear refusals, repeatability, bounded memory."""

import os
import subprocess
import sys

import memo
import numpy as np
import pytest
from conftest import shared_video
from memo.files import TRACK_COLUMNS
from memo.video import VideoReader

GREY = np.zeros((48, 64), np.uint8)
A_FRAME = r"numpy array of shape \(H, W\), dtype uint8; got "


def update_all(*timed_frames):
    """Gives (frame, time) pairs to a new tracker."""
    tracker = memo.Tracker(1.75)
    for frame, time_s in timed_frames:
        tracker.update(frame, time_s)
    return tracker


# Bad input


@pytest.mark.parametrize(
    ("frame", "error", "got"),
    [
        (GREY.astype(np.uint16), TypeError, r"shape \[48, 64\], dtype uint16"),
        (np.full(GREY.shape, np.nan), TypeError, r"shape \[48, 64\], dtype float64"),
        (GREY > 0, TypeError, r"shape \[48, 64\], dtype bool"),
        (GREY.astype(object), TypeError, r"shape \[48, 64\], dtype object"),
        (np.zeros((48, 64, 3), np.uint8), ValueError, r"shape \[48, 64, 3\], dtype uint8"),
        (GREY[0], ValueError, r"shape \[64\], dtype uint8"),
        (GREY.tolist(), TypeError, "list"),
        (None, TypeError, "NoneType"),
        ("frame.png", TypeError, "str"),
    ],
    ids=["uint16", "nan", "bool", "object", "colour", "row", "list", "none", "path"],
)
def test_what_is_no_grey_frame_is_refused(frame, error, got):
    with pytest.raises(error, match=A_FRAME + got):
        memo.Tracker(1.75).update(frame, 0.0)


def test_a_frame_without_pixels_is_refused():
    with pytest.raises(ValueError, match="frame of 5x0 pixels"):
        update_all((np.zeros((0, 5), np.uint8), 0.0))


def test_frames_keep_their_size():
    with pytest.raises(ValueError, match="expected 64x48, got 64x50"):
        update_all((GREY, 0.0), (np.zeros((50, 64), np.uint8), 0.04))


@pytest.mark.parametrize(("first_s", "then_s"), [(0, 0), (1, 0.5)])
def test_times_increase(first_s, then_s):
    with pytest.raises(ValueError, match=r"must increase: (0|0\.5) s came after [01] s"):
        update_all((GREY, first_s), (GREY, then_s))


def test_the_camera_is_for_these_frames():
    camera = memo.Camera.level((640, 480), 60, 1.5, 6)
    with pytest.raises(ValueError, match="640x480 images, the frames are 64x48"):
        memo.Tracker(1.75, camera).update(GREY, 0.0)


@pytest.mark.parametrize("height_m", [0, -1.7, 17, np.nan, np.inf])
def test_height_is_that_of_a_person(height_m):
    with pytest.raises(ValueError, match=r"between 0\.4 and 2\.6 metres, got "):
        memo.Tracker(height_m)


def test_height_in_centimetres_is_recognized():
    with pytest.raises(ValueError, match=r"metres, got 175 \(that looks like centimetres\)"):
        memo.track([GREY], height_m=175, fps=25)


@pytest.mark.parametrize(
    ("timing", "reason"),
    [
        ({}, "either times_s or fps"),
        ({"fps": 25, "times_s": [0]}, "either times_s or fps"),
        ({"times_s": [0, 0.04]}, "times_s has 2 values, but there are more frames"),
        ({"fps": 0}, "positive number, got 0"),
        ({"fps": -25}, "positive number, got -25"),
        ({"fps": np.nan}, "positive number, got nan"),
    ],
    ids=str,
)
def test_every_frame_needs_a_time(timing, reason):
    with pytest.raises(ValueError, match=reason):
        memo.track([GREY] * 3, height_m=1.75, **timing)


@pytest.mark.parametrize(
    ("options", "error", "reason"),
    [
        ({"gait": "run"}, ValueError, "'dense' or 'sampled_10', got \"run\""),
        ({"camera": "camera.toml"}, TypeError, "'str' object is not an instance of 'Camera'"),
        ({"speed": 1}, TypeError, "speed"),
    ],
    ids=str,
)
def test_options_are_those_documented(options, error, reason):
    with pytest.raises(error, match=reason):
        memo.track([GREY], height_m=1.75, fps=25, **options)


# Nobody


@pytest.mark.parametrize("count", [0, 1, 2, 40])
def test_nobody_is_a_result(count):
    track = memo.track([GREY] * count, height_m=1.75, fps=25)
    assert len(track) == 0 and track.summary["status"] == "nobody" and track.summary["walks"] == 0
    assert track.events == [] and track.start is None and track.camera is None
    assert list(track.columns) == list(TRACK_COLUMNS)
    assert all(column.shape == (0,) for column in track.columns.values())
    assert all(column.shape == (0,) for column in track.measured.values())
    with pytest.raises(IndexError, match="row 0 of a track with 0 rows"):
        track.contours(0)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (7, 500)])
def test_frames_too_small_for_a_person_are_no_error(size):
    noise = np.random.default_rng(0).integers(0, 256, (30, *size), dtype=np.uint8)
    track = memo.track(noise, height_m=1.75, fps=25)
    assert len(track) == 0
    said = f"Nobody less than 30 pixels high is seen, and the picture has only {size[1]}x{size[0]}."
    assert track.summary["message"].endswith(said) and track.sentences[0].endswith(said)
    averaged = track.of_video(3, (3 * size[1], 3 * size[0])).summary["message"]
    assert f"less than 90 pixels high is seen, and the picture has only {3 * size[1]}x" in averaged


def test_noise_is_not_a_walker():
    noise = np.random.default_rng(1).integers(0, 256, (40, 96, 128), dtype=np.uint8)
    assert len(memo.track(noise, height_m=1.75, fps=25)) == 0


def test_progress_is_told_after_every_frame():
    told = []
    memo.track([GREY] * 2, height_m=1.75, fps=25, progress=lambda *counts: told.append(counts))
    memo.track(iter([GREY] * 2), height_m=1.75, fps=25, progress=lambda *counts: told.append(counts))
    assert told == [(1, 2), (2, 2), (1, None), (2, None)]


# On a real walk


READ = """
import sys, memo
from memo.video import VideoReader
with VideoReader(sys.argv[1]) as reader:
    frames = [frame.luma.copy() for frame in reader]
"""
FINGERPRINT = (
    READ
    + """
import hashlib
track = memo.track(frames, height_m=1.75, fps=25)
assert len(track) > 40
tables = [*track.columns.values(), *track.measured.values(), track.contours(20)]
print(hashlib.sha256(b"".join(table.tobytes() for table in tables)).hexdigest(), track.events)
"""
)
MEMORY = (
    READ
    + """
def resident_kb():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))

tracker, walks = memo.Tracker(1.75, adapt=False), 0
for index in range(9 * len(frames)):
    tracker.update(frames[index % len(frames)], index / 25)
    walks += len(tracker.take_finished())
    if index + 1 in (2 * len(frames), 9 * len(frames)):
        print(walks, resident_kb())
"""
)


def python(script, *arguments, **environment):
    """What a script prints when run by a Python of its own."""
    command = [sys.executable, "-c", script, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def small_walker():
    return shared_video("weizmann_ido_walk") / "ido_walk.avi"


@pytest.fixture(scope="module")
def walk(small_walker):
    """43 frames of a man who walks from left to right, 75 pixels tall."""
    with VideoReader(small_walker) as reader:
        return [frame.luma.copy() for frame in reader]


def average_walker(frames):
    """The columns found without a fit to the person, which the small image does not allow anyway."""
    return memo.track(frames, height_m=1.75, fps=25, adapt=False).columns


def test_the_stream_can_be_ended_at_any_frame(walk):
    tracker = memo.Tracker(1.75, adapt=False)
    states = [tracker.update(frame, index / 25) for index, frame in enumerate(walk[:30])]
    assert states[0] is None and states[-1].time_s == pytest.approx(28 / 25), "known one frame later"
    columns = tracker.finish().columns
    np.testing.assert_array_equal(columns["frame"], np.arange(30))


def test_only_the_values_of_a_frame_count(walk):
    plain, by_columns = average_walker(walk), average_walker([np.asfortranarray(frame) for frame in walk])
    for name in TRACK_COLUMNS:
        np.testing.assert_array_equal(plain[name], by_columns[name], err_msg=name)


def test_a_mirrored_walk_is_the_mirrored_result(walk):
    """But for the sides, which this clip does not tell."""
    plain, mirrored = average_walker(walk), average_walker([frame[:, ::-1] for frame in walk])
    np.testing.assert_array_equal(mirrored["frame"], plain["frame"])
    np.testing.assert_allclose(mirrored["x_m"], -plain["x_m"], atol=0.02)
    np.testing.assert_allclose(mirrored["z_m"], plain["z_m"], atol=0.01)
    phase = (mirrored["phase"] - plain["phase"] + 0.25) % 0.5 - 0.25
    np.testing.assert_allclose(phase, 0, atol=0.02)


def test_same_result_with_any_number_of_threads(small_walker):
    one, two = (python(FINGERPRINT, small_walker, RAYON_NUM_THREADS=threads) for threads in "12")
    assert one == two and "heel_strike" in one


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="needs Linux's /proc")
def test_memory_does_not_grow_with_the_stream(small_walker):
    """One frame is 25 kB: 301 more of them, or their edges, would show."""
    (_, early_kb), (walks, late_kb) = (
        map(int, line.split()) for line in python(MEMORY, small_walker).splitlines()
    )
    assert walks >= 8 and late_kb - early_kb < 3000


@pytest.mark.parametrize("time_s", [np.nan, np.inf, -np.inf])
def test_times_are_numbers(time_s):
    with pytest.raises(ValueError, match="must be a finite number of seconds, got"):
        memo.Tracker().update(np.zeros((48, 64), np.uint8), time_s)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fov_deg": 0.0}, "field of view must be between 5 and 170 degrees, got 0"),
        ({"fov_deg": np.nan}, "field of view must be between"),
        ({"start_frames": 1}, "start_frames must be between 5 and 100, got 1"),
        ({"start_frames": -1}, "start_frames must be between"),
        ({"gait": "moonwalk"}, "gait must be 'dense' or 'sampled_10', got \"moonwalk\""),
        ({"measure": "x"}, "measure must be 'rohr' or 'lowe'"),
        ({"full_velocity": 0.0}, "full_velocity must be positive and finite"),
    ],
)
def test_senseless_options_are_refused(options, message):
    with pytest.raises(ValueError, match=message):
        memo.Tracker(**options)


def test_a_stream_that_ended_takes_no_frames():
    tracker = memo.Tracker()
    tracker.finish()
    with pytest.raises(ValueError, match="the stream has ended"):
        tracker.update(np.zeros((48, 64), np.uint8), 0.0)


def test_times_and_frames_must_match_in_number():
    frames = np.zeros((3, 48, 64), np.uint8)
    with pytest.raises(ValueError, match="times_s has 2 values, but there are more frames"):
        memo.track(frames, times_s=[0.0, 0.1], height_m=1.7)
    with pytest.raises(ValueError, match="times_s has more values than the 3 frames"):
        memo.track(frames, times_s=[0.0, 0.1, 0.2, 0.3], height_m=1.7)


def test_too_few_frames_are_said_with_their_number():
    frames = memo.demo_scene(0, frames=9).frames
    assert memo.track(frames, fps=25, height_m=1.7).summary["message"] == (
        "Nobody was seen walking: something moves in only 9 frames, and a walk is found in 13."
    )
    assert memo.track([frames[0]] * 9, fps=25, height_m=1.7).summary["message"] == "Nobody was seen walking."
    tracker = memo.Tracker(1.7, start_frames=30)
    for k, frame in enumerate(frames):
        tracker.update(frame, k / 25)
    assert repr(tracker) == "Tracker(seeking, 9 frames seen)"
    assert tracker.finish().summary["message"].endswith("and a walk is found in 30.")
