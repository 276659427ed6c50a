"""Motions for the tests of file formats: small ones made here, and the real files of the shared data."""

import numpy as np
import pytest
from conftest import SHARED_DATA
from memo.files import JOINTS
from memo.formats import GaitEvent, Motion

ANGLES = ("right_hip", "right_knee", "left_knee")


def shared_motion(*parts):
    """A real motion file; skips the test where it is absent."""
    path = SHARED_DATA.joinpath(*parts)
    if not path.is_file():
        pytest.skip(f"no {path} (set MEMO_SHARED_DATA)")
    return path


def stick_figure(frames=20, rate_hz=50.0, start_s=0.0, joints=JOINTS):
    """(T, 12, 3) and (T,) of a figure with rigid limbs that walks along a slanting line."""
    times_s = start_s + np.arange(frames) / rate_hz
    phase = 2 * np.pi * (times_s - start_s)
    forward, left = np.array([0.8, 0.6, 0.0]), np.array([-0.6, 0.8, 0.0])
    down = np.array([0.0, 0.0, -1.0])
    hips = np.outer(1.2 * times_s, forward) + [0.3, -2.0, 0.95] + 0.02 * np.outer(np.cos(2 * phase), down)
    points = {}
    for side, sign in (("right", -1), ("left", 1)):
        swing = 0.4 * sign * np.sin(phase)

        def limb(start, angles, lengths, names, side=side):
            for angle, length, name in zip(angles, lengths, names, strict=True):
                start = start + length * (np.outer(np.sin(angle), forward) + np.outer(np.cos(angle), down))
                points[f"{side}_{name}"] = start

        points[f"{side}_hip"] = hips + 0.1 * sign * left
        points[f"{side}_shoulder"] = hips + 0.2 * sign * left + [0, 0, 0.5]
        bend = swing - 0.3 * (1 - np.cos(phase))
        limb(points[f"{side}_hip"], (swing, bend), (0.45, 0.42), ("knee", "ankle"))
        limb(points[f"{side}_shoulder"], (-swing, 0.4 - swing), (0.3, 0.25), ("elbow", "wrist"))
    return np.stack([points[joint] for joint in joints], axis=1), times_s


def walk(frames=20, rate_hz=50.0, start_s=0.0, gaps=True):
    """A motion with everything a format may hold: joints, gaps, angles with gaps, events."""
    points, times_s = stick_figure(frames, rate_hz, start_s)
    if gaps:
        points[3:6, 2] = np.nan
        points[0, 7] = np.nan
    angles = {name: 30 * np.sin(times_s + k) for k, name in enumerate(ANGLES)}
    if gaps:
        angles["left_knee"][4] = np.nan
    events = (
        GaitEvent(start_s + 0.1234, "heel_strike", "right"),
        GaitEvent(start_s + 0.25, "toe_off", "left"),
    )
    return Motion(JOINTS, times_s, points, events, angles)


def assert_same_points(read, wrote, atol):
    assert read.names == wrote.names
    assert np.isnan(read.points).tolist() == np.isnan(wrote.points).tolist()
    assert np.nanmax(np.abs(read.points - wrote.points)) <= atol
    assert np.abs(read.times_s - wrote.times_s).max() <= 1e-6
