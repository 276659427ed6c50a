"""The same walk in other pictures: mirrored, compressed, noisy, of other contrast.

The clip shows dark clothes before a dark wall (`conftest.SHARED_DATA`): every change of the pictures counts.
"""

import io

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA
from memo.gait import lookup
from memo.video import VideoReader
from PIL import Image

CLIP, HEIGHT_M = "BELT_C__clothes2", 1.66
#: Of six clips, one changed by 1.9 degrees, this one by 0.6 at most.
MOST_OFF_DEG = 1.0
OTHER = {"right": "left", "left": "right"}


def compressed(picture):
    packed = io.BytesIO()
    Image.fromarray(picture).save(packed, "JPEG", quality=60)
    return np.asarray(Image.open(packed))


def with_noise(picture):
    noise = np.random.default_rng(int(picture.sum())).normal(0, 2, picture.shape)
    return np.clip(np.rint(picture + noise), 0, 255).astype(np.uint8)


def with_contrast(share):
    return lambda picture: np.clip(np.rint(128 + share * (picture - 128.0)), 0, 255).astype(np.uint8)


PICTURES = {
    "mirrored": lambda picture: np.ascontiguousarray(picture[:, ::-1]),
    "compressed": compressed,
    "noisy": with_noise,
    "dull": with_contrast(0.85),
    "harsh": with_contrast(1.15),
}


@pytest.fixture(scope="module")
def tracked():
    """Tracks the clip with its pictures changed."""
    clip = SHARED_DATA / "walks" / CLIP
    if not clip.is_dir():
        pytest.skip(f"the recording {CLIP} is not there: {clip}")
    camera = memo.Camera.from_toml(str(clip / "camera.toml"))
    with VideoReader(clip / "video.mp4") as video:
        frames, times_s = zip(*[(frame.luma, frame.time_s) for frame in video], strict=True)

    def track(change=lambda picture: picture):
        return memo.track([change(f) for f in frames], times_s=times_s, camera=camera, height_m=HEIGHT_M)

    return track


@pytest.fixture(scope="module")
def plain(tracked):
    return tracked()


@pytest.mark.parametrize("name", PICTURES)
def test_other_pictures_of_a_walk_give_the_same_numbers(tracked, plain, name):
    other = tracked(PICTURES[name])
    assert len(other.walks) == len(plain.walks) == 1
    for parameter in ("cadence", "speed", "step_length"):
        rows = [lookup(track.gait_parameters, 0, parameter) for track in (plain, other)]
        half = max(row["ci_high"] - row["value"] for row in rows)
        assert abs(rows[0]["value"] - rows[1]["value"]) < half, (parameter, rows)
    frames = np.intersect1d(plain.columns["frame"], other.columns["frame"])
    assert len(frames) > 0.9 * len(plain)
    at = [np.isin(track.columns["frame"], frames) for track in (plain, other)]
    for side in ("right", "left"):
        there = OTHER[side] if name == "mirrored" else side
        for joint in ("hip", "knee"):
            angle, sd = (plain.columns[f"{first}{side}_{joint}_deg"][at[0]] for first in ("", "sd_"))
            again = other.columns[f"{there}_{joint}_deg"][at[1]]
            off = np.sqrt(np.nanmean((angle - again) ** 2))
            assert off < min(MOST_OFF_DEG, np.nanmean(sd)), (side, joint, off)


def test_how_times_are_rounded_does_not_decide():
    """Within a tenth of what is stated: the fit ends at another step of its descent."""
    scene = memo.demo_scene(0, frames=80)

    def columns(times_s):
        return memo.track(scene.frames, times_s=times_s, camera=scene.camera, height_m=scene.height_m).columns

    expected = columns(scene.times_s)
    for times_s in (scene.times_s * (1 + 1e-12), scene.times_s * (1 - 1e-12), scene.times_s + 7.7):
        found = columns(times_s)
        np.testing.assert_array_equal(found["frame"], expected["frame"])
        for name in ("x_m", "y_m", "phase", "right_knee_deg"):
            most = 0.1 * expected[f"sd_{name}"]
            assert np.all(np.abs(found[name] - expected[name]) <= most), name
