"""A stand-in for the compiled core, so that what surrounds it is tested fast and with planted answers.

Its tracker looks at nothing but brightness: a black video has nobody in it, any other a walker whose
motion is a formula.
"""

import os
import time
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from memo import _memo
from memo.camera_motion import CameraMotion
from memo.cycles import cycle_table
from memo.files import JOINTS, TRACK_COLUMNS
from memo.gait import gait_table

SPEED_MPS = 1.3
STRIDES_PER_S = 0.9
N_PHASE = 50
_HEIGHTS_M = {"shoulder": 1.42, "elbow": 1.1, "wrist": 0.85, "hip": 0.92, "knee": 0.5, "ankle": 0.1}


class Camera:
    """A level camera 5 m before the walker."""

    def __init__(self, size):
        self.size = size

    @staticmethod
    def from_toml(path, name=None):
        tables = tomllib.loads(Path(path).read_text())
        if name is not None and name not in tables:
            raise ValueError(f"{path}: no camera named {name!r}")
        table = tables[name] if name else next(iter(tables.values()))
        return Camera(tuple(table["size"]))

    def shrunk(self, n):
        return Camera(tuple(side // n for side in self.size))

    @staticmethod
    def from_file(path, name=None, unit=None, *, size=None, v_up=None, lens_only=False):
        return Camera.from_toml(path, name)

    def parameters(self):
        return {"size": list(self.size)}

    def project(self, points):
        width, height = self.size
        focal = width * 0.9
        return np.column_stack(
            [width / 2 + focal * points[:, 0] / 5, height * 0.55 + focal * (1 - points[:, 2]) / 5]
        )


class Track:
    """A walk from left to right through the middle of the picture."""

    shrink = 1

    def __init__(self, times_s, camera, status):
        times_s = np.asarray(times_s, float)
        self._given = (times_s, status)
        self.camera = camera
        self.camera_motion = CameraMotion()
        self.left_out = []
        self.columns = walk(times_s, camera)
        self.events = [
            {"time_s": float(times_s[i]), "frame": i + 0.25, "event": "heel_strike", "side": side}
            for i, side in enumerate(["right", "left"][: len(times_s)])
        ]
        self.summary = {
            "status": status,
            "message": f"{len(times_s)} frames, {status}.",
            "speed_mps": np.float64(SPEED_MPS),
            "p_swapped": 0.4,
            "unknown": float("nan"),
        }
        self.sentences = [self.summary["message"]]
        if status == "tracked":
            self.sentences.append("Left and right may be swapped (probability 40%): check them before use.")
        self.gait_parameters = gait_table(
            [[_memo.GaitParameter("speed", "", SPEED_MPS, "m/s", 1.2, 1.4, 3)]] if len(times_s) else []
        )
        self.cycles = cycle_table([])
        self.records = []
        phases = np.arange(N_PHASE) / N_PHASE
        best = self.columns["phase"][:12]
        similarity = 0.5 + 0.4 * np.cos(2 * np.pi * (phases[None, :] - best[:, None])).astype(np.float32)
        lines = [_memo.PhaseLine(0.0, 1.0, 0.9)] * 4
        frames = np.arange(len(best))
        self.start = (
            _memo.WalkStart(frames, times_s[:12], best, similarity, *lines, 0.1) if len(best) else None
        )
        noise = np.random.default_rng(0).normal(0, 0.02, (3, len(times_s)))
        self.measured = {
            key: self.columns[name] + extra
            for key, name, extra in zip(("x", "z", "phase"), ("x_m", "z_m", "phase"), noise, strict=True)
        }

    def of_video(self, shrink, size=None):
        times_s, status = self._given
        track = Track(times_s, Camera(size), status)
        track.shrink = shrink
        return track

    def contours(self, row):
        u, v = self.columns["left_hip_u_px"][row], self.columns["left_hip_v_px"][row]
        return [np.array([[u - 5, v - 20], [u - 5, v + 5]]), np.array([[u + 5, v - 20], [u + 5, v + 5]])]


class Tracker:
    """Remembers when frames came and whether any of them was not black."""

    def __init__(self, height_m=1.75, camera=None, fov_deg=60.0):
        self.camera, self.times_s, self.seen = camera, [], False
        self.options = {"height_m": height_m, "fov_deg": fov_deg}

    def update(self, frame, time_s, boxes=None):
        assert frame.dtype == np.uint8 and frame.ndim == 2
        self.camera = self.camera or Camera(frame.shape[::-1])
        self.times_s.append(time_s)
        self.seen = self.seen or frame.max() > 40
        time.sleep(float(os.environ.get("FAKE_CORE_FRAME_S", "0")))
        if started := os.environ.get("FAKE_CORE_STARTED"):
            Path(started).touch()

    def finish(self):
        return Track(self.times_s if self.seen else [], self.camera, "tracked" if self.seen else "nobody")


def walk(times_s, camera):
    """The columns of a walk by formula: one stride is 1 / STRIDES_PER_S seconds."""
    count = len(times_s)
    columns = {name: np.zeros(count) for name in TRACK_COLUMNS}
    phase = (STRIDES_PER_S * times_s) % 1
    swing = np.sin(2 * np.pi * phase)
    columns |= {"frame": np.arange(count), "time_s": times_s, "phase": phase}
    columns |= {"x_m": -1.5 + SPEED_MPS * times_s, "z_m": 1.2 + 0.02 * swing**2}
    columns |= {"p_swapped": 0.4 * np.ones(count), "speed_mps": SPEED_MPS * np.ones(count)}
    columns |= {name: 0.02 * np.ones(count) for name in ("sd_x_m", "sd_y_m", "sd_z_m", "sd_phase")}
    for side, sign in (("right", 1), ("left", -1)):
        columns[f"{side}_hip_deg"] = 10 + 20 * sign * swing
        columns[f"{side}_knee_deg"] = 30 - 25 * sign * swing
    for joint in JOINTS:
        side, name = joint.split("_")
        reach = {"elbow": 0.1, "wrist": 0.2, "knee": 0.15, "ankle": 0.35}.get(name, 0.0)
        forward = reach * swing * (1 if side == "right" else -1)
        points = np.column_stack(
            [columns["x_m"] + forward, np.zeros(count), np.full(count, _HEIGHTS_M[name])]
        )
        pixels = camera.project(points) if count else np.zeros((0, 2))
        for axis, values in zip(("x_m", "y_m", "z_m", "u_px", "v_px"), [*points.T, *pixels.T], strict=True):
            columns[f"{joint}_{axis}"] = values
    return columns


def demo_scene(seed=0):
    """Twenty frames of noise with a known walk."""
    camera = Camera((160, 120))
    times_s = np.arange(20) / 25
    frames = np.random.default_rng(seed).integers(0, 255, (20, 120, 160), dtype=np.uint8)
    events = {
        "time_s": np.array([0.2, 0.5]),
        "event": np.array(["heel_strike"] * 2),
        "side": np.array(["left", "right"]),
    }
    truth = walk(times_s, camera)
    return SimpleNamespace(
        frames=frames, times_s=times_s, camera=camera, height_m=1.75, truth=truth, events=events
    )


PARTS = {"Camera": Camera, "Tracker": Tracker, "demo_scene": demo_scene}
