"""Calls every binding with sizes, types and numbers that nobody intends, as a program of its own.

`python tests/border_fuzz.py --seed 0 --calls 100 [NAME ...]` prints a line of JSON for each call that ended
in anything but a value or one of `DOCUMENTED`; a call that takes longer than `LIMIT_S` ends the program with
a traceback and the exit code 1. The last line of the log names the call under way.
`NAME:NUMBER` repeats one call.
"""

import argparse
import faulthandler
import inspect
import json
import os
import sys
import tempfile
import time
import warnings
import zlib
from pathlib import Path

import memo
import memo.calibration
import memo.explain
import memo.gait
import memo.keypoints
import numpy as np
from memo import _memo

LIMIT_S = 60
"""For one call; far more than any needs, on a machine busy with other things."""

DOCUMENTED = (ValueError, TypeError, OverflowError, OSError, KeyError, IndexError)
"""What wrong input may raise; `KeypointsError` and others of memo's own are of these kinds."""

WRONG_NUMBERS = [
    *(
        0.0,
        -0.0,
        -1.0,
        1.0,
        0.5,
        3.0,
        np.nan,
        np.inf,
        -np.inf,
        5e-324,
        1e-300,
        1e-9,
        1e9,
        1e18,
        1e38,
        1e300,
        -1e300,
    ),
    *(0, 1, -1, 2, 255, 256, 2**31 - 1, 2**31, 2**32, 2**53, 2**63 - 1, 2**63, -(2**62), 2**64, 10**400),
    *(
        True,
        None,
        "1",
        b"1",
        [],
        [1.0],
        np.float32(0.1),
        np.int8(-1),
        np.array(1.0),
        np.array([1.0, 2.0]),
        1j,
        {},
    ),
]
WRONG_OBJECTS = [
    None,
    0,
    1.5,
    "text",
    b"bytes",
    [],
    [[]],
    {},
    (),
    [1, "a"],
    object(),
    np.array(3),
    [None],
    "ä\0",
    np.nan,
]
SIZES = [0, 1, 2, 3, 4, 5, 7, 8, 13, 16, 17, 31, 64, 97]


class Draw:
    """The arguments of one call: as intended, but each of them wrong with the same small probability."""

    def __init__(self, seed, wrong=None):
        self.random = np.random.default_rng(seed)
        self.wrong = self.random.choice([0.0, 0.02, 0.05, 0.2]) if wrong is None else wrong

    def is_wrong(self):
        return self.random.random() < self.wrong

    def one(self, options):
        return options[self.random.integers(len(options))]

    def number(self, low, high):
        """A number of a range, its ends included."""
        if self.is_wrong():
            return self.one(WRONG_NUMBERS)
        return self.one(
            [low, high, float(self.random.uniform(low, high)), float(self.random.uniform(low, high))]
        )

    def whole(self, low, high):
        if self.is_wrong():
            return self.one(WRONG_NUMBERS)
        return int(self.random.integers(low, high, endpoint=True))

    def choice(self, *options):
        """One of some arguments of which not all need be right."""
        return self.one(WRONG_OBJECTS) if self.is_wrong() else self.one(options)

    def maybe(self, draw):
        """None, as often as not."""
        return None if self.random.random() < 0.5 else draw()

    def options(self, **draws):
        """Some of the keyword arguments."""
        return {name: draw() for name, draw in draws.items() if self.random.random() < 0.3}

    def pair(self, low, high):
        return (
            self.one(WRONG_OBJECTS) if self.is_wrong() else (self.number(low, high), self.number(low, high))
        )

    def triple(self, low, high):
        if self.is_wrong():
            return self.one(WRONG_OBJECTS)
        return tuple(self.number(low, high) for _ in range(3))

    def size(self, most=97, least=0):
        """How many: 0, 1, 2, a prime, a power of two; fewer than `least` only to be wrong."""
        least = 0 if self.is_wrong() else least
        return self.one([size for size in SIZES if least <= size <= most])

    def picture(self):
        """Width and height of a camera's pictures."""
        if self.is_wrong():
            return self.one(
                [
                    (0, 0),
                    (0, 5),
                    (1, 1),
                    (2**32 - 1, 2**32 - 1),
                    (2**32, 1),
                    (-1, 5),
                    (1.5, 2),
                    *WRONG_OBJECTS,
                ]
            )
        return self.one(
            [(640, 480), (180, 144), (240, 180), (64, 48), (1920, 1080), (1, 1), (2, 3), (7, 400), (97, 31)]
        )

    def laid_out(self, array):
        """The same numbers, or nearly, in another type or memory layout, or another shape."""
        if not self.is_wrong():
            return array
        ways = [
            lambda: array.astype(
                self.one(
                    [
                        bool,
                        np.uint8,
                        np.int8,
                        np.uint16,
                        np.int64,
                        np.float16,
                        np.float32,
                        complex,
                        object,
                        "S3",
                        "U3",
                        ">f8",
                    ]
                )
            ),
            lambda: np.asfortranarray(array),
            lambda: array[::-1],
            lambda: array[..., ::-1],
            lambda: array[::2],
            lambda: array[..., ::2],
            lambda: np.repeat(array, 2, axis=-1)[..., ::2] if array.ndim else array,
            lambda: array.T,
            lambda: array[:0],
            lambda: array[..., :0],
            lambda: array[None],
            lambda: array.ravel(),
            lambda: array.tolist(),
            lambda: np.broadcast_to(array[:1], array.shape) if array.ndim and len(array) else array,
            lambda: np.ma.masked_array(array),
            lambda: np.asmatrix(array) if array.ndim == 2 else array,
            lambda: self.frozen(array),
            lambda: self.one(WRONG_OBJECTS),
        ]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                return self.one(ways)()
            except (ValueError, TypeError, OverflowError):
                return array

    def frozen(self, array):
        array = array.copy()
        array.flags.writeable = False
        return array

    def spoilt(self, array):
        """Numbers of an array replaced by wrong ones."""
        array = np.asarray(array, np.float64).copy()
        if self.is_wrong() and array.size:
            value = self.one(
                [np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-300, 1e9, 1e18, 1e38, 1e150, 1e300, -1e300]
            )
            if self.random.random() < 0.3:
                array[...] = value
            else:
                array.ravel()[self.random.random(array.size) < self.one([0.02, 0.3, 0.9])] = value
        if self.random.random() < 0.15:
            array = np.round(array)
        return self.laid_out(array)

    def numbers(self, low, high, *shape):
        if self.random.random() < 0.1:
            return self.spoilt(np.full(shape, self.random.uniform(low, high)))
        return self.spoilt(self.random.uniform(low, high, shape))

    def frames(self, count, shape=None):
        """Grey frames of one size: noise, flat, stripes, a moving block."""
        height, width = shape or (self.size(least=1), self.size(least=1))
        kind = self.random.integers(5)
        frames = np.zeros((count, height, width), np.uint8)
        if kind == 0:
            frames[...] = self.random.integers(0, 256, frames.shape)
        elif kind == 1:
            frames[...] = self.one([0, 128, 255])
        elif kind == 2:
            frames[...] = 255 * ((np.arange(width) // max(1, self.size(7))) % 2)
        else:
            frames[...] = self.random.integers(100, 110, frames.shape)
            for index in range(count):
                left = int(self.random.integers(-3, width + 3)) if kind == 4 else 3 * index
                frames[
                    index, height // 5 : height - height // 6, max(0, left) : max(0, left + width // 4)
                ] = 220
        return [self.laid_out(frame) for frame in frames]

    def mask(self, shape=None):
        height, width = shape or (self.size(least=1), self.size(least=1))
        share = self.one([0.0, 0.02, 0.5, 0.97, 1.0])
        return self.laid_out(self.random.random((height, width)) < share)

    def camera(self):
        if self.random.random() < 0.05:
            return self.one(WRONG_OBJECTS)
        return self.one(CAMERAS)

    def times(self, count):
        """Times of frames, s."""
        if self.is_wrong():
            wrong = [
                np.zeros(count),
                -np.arange(count),
                np.full(count, np.nan),
                1e300 * np.arange(count),
                1e-300 * np.arange(count),
                np.arange(count + 1) / 25,
                np.array([]),
                np.append(np.arange(count - 1) / 25, self.one([1e3, 1e6, 1e18, 1e300, np.inf]))[:count],
                np.sort(self.random.random(count)),
                1e17 + np.arange(count) / 25.0,
            ]
            return self.laid_out(self.one(wrong))
        return np.arange(count) / self.one([25.0, 60.0, 1.0, 1000.0])

    def called_back(self):
        return self.maybe(lambda: lambda done, total: None)


def cameras():
    level = memo.Camera.level((640, 480), 45.0, 1.2, 4.0)
    tsai = memo.Camera.from_tsai(
        size=(768, 576),
        pixel_mm=(0.023, 0.023),
        focal_mm=5.5,
        kappa1_per_mm2=0.0051,
        centre_px=(384.0, 288.0),
        sx=1.0,
        translation_mm=(-4000.0, 200.0, 9000.0),
        rotation_rad=(1.9, 0.3, -0.2),
    )
    brown = memo.Camera.from_parameters(level.parameters() | {"distortions": [-0.3, 0.1, 0.001, -0.001, 0.0]})
    return [level, tsai, brown, level.shrunk(4), memo.Camera.level((1, 1), 90.0, 0.1, 0.1)]


def tracked():
    """A tracker that has found a walk, and the walk."""
    scene = _memo.Scene(5, frames=14)
    tracker = _memo.Tracker(scene.height_m, start_frames=5, adapt=False)
    for index in range(len(scene)):
        tracker.update(np.ascontiguousarray(scene.frame(index)[::2, ::2]), scene.time_s(index))
    tracker.finish()
    return tracker, tracker.take_finished()[0]


CAMERAS = cameras()
TRACKER, WALK = tracked()
LENGTHS = {name: 0.3 for name in _memo.segment_names()}
NAMES_14 = _memo.joint_names()
LAYOUTS = _memo.keypoint_layouts()
_SCRATCH = tempfile.TemporaryDirectory(prefix="memo-fuzz-")
SCRATCH = Path(_SCRATCH.name)


# A case calls one binding. Its name is that of the binding; `bindings` says which there must be.

CASES = {}

NO_CALLS = {"__doc__", "__module__", "__hash__", "__slotnames__", "__lt__", "__le__", "__gt__", "__ge__"}
"""Names that Python gives to a class: the last four for `__eq__`, `__slotnames__` when one is pickled."""


def case(*names):
    def kept(function):
        for name in names:
            CASES[name] = lambda d, name=name: function(d, name) if len(names) > 1 else function(d)
        return function

    return kept


@case("_camera")
def _(d):
    restore, (size, focal, centre, lens, rotation, translation) = d.one(CAMERAS).__reduce__()
    return restore(
        size if d.random.random() < 0.5 else d.picture(),
        d.choice(focal, d.pair(1, 1e4)),
        d.choice(centre, centre),
        d.choice(
            lens, ("none", []), ("tsai", [d.number(-1, 1)]), ("brown", [d.number(-1, 1)] * d.size(5, 5))
        ),
        d.one([d.numbers(-1, 1, 9), rotation[1:]]) if d.is_wrong() else rotation,
        d.choice(translation, d.triple(-9, 9)),
    )


@case("_panic")
def _(d):
    """What it raises is tested elsewhere."""


def damaged(d, text):
    """A file's content with numbers put for each @, and sometimes characters exchanged or the end missing."""
    first, *rest = text.split("@")
    content = bytearray((first + "".join(f"{d.whole(1, 9)}{part}" for part in rest)).encode())
    if d.is_wrong() and content:
        for _ in range(d.size(8)):
            content[d.random.integers(len(content))] = d.one(b'0123456789.[]{}<>"=-+einfa,:\n\0\xff')
    return bytes(content[: d.random.integers(len(content)) if d.is_wrong() and content else None])


def path_of(d, texts):
    """A file of a kind, or of another."""
    suffix = d.one(sorted(texts))
    path = (SCRATCH / "file").with_suffix(d.one(sorted(texts)) if d.is_wrong() else suffix)
    path.write_bytes(damaged(d, d.one(texts[suffix])))
    return d.choice(path, str(path)) if not d.is_wrong() else d.one([SCRATCH, SCRATCH / "none"])


@case("Camera.from_toml", "Camera.from_file")
def _(d, name):
    if name == "Camera.from_toml":
        return memo.Camera.from_toml(
            path_of(d, {".toml": CAMERA_FILES[".toml"]}), d.maybe(lambda: d.choice("cam", "cam"))
        )
    options = {"unit": d.choice("m", "cm", "mm"), "size": d.picture(), "v_up": d.choice(True, False)}
    options |= d.options(name=lambda: d.choice("cam", "other"), lens_only=lambda: d.choice(True, False))
    return memo.Camera.from_file(path_of(d, CAMERA_FILES), **options)


CAMERA_FILES = {
    ".toml": [
        """[cam]
name = "cam"
size = [640, 480]
matrix = [[80@, 0.0, 320.0], [0.0, 80@, 240.0], [0.0, 0.0, 1.0]]
distortions = [0.0@, 0.0, 0.0, 0.0]
rotation = [1.@, 0.1, @]
translation = [0.@, 1.0, 4.0]
fisheye = false
"""
    ],
    ".json": [
        """{"camera_matrix": [[80@, 0, 320], [0, 800, 240], [0, 0, 1]], "image_width": 64@,
"image_height": 480, "dist_coeffs": [0, 0, 0, 0, 0.@], "rvec": [1.@, 0, 0], "tvec": [@, 1, 4]}"""
    ],
    ".yaml": [
        """%YAML:1.0
---
image_width: 64@
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 80@, 0, 320, 0, 800, 240, 0, 0, 1 ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0, 0, 0.@, 0, 0 ]
rvec: [ 1, 0, 0 ]
tvec: [ @, 1, 4 ]
"""
    ],
    ".xml": [
        """<?xml version="1.0"?><Camera>
<Geometry width="76@" height="576" ncx="795" nfx="752" dx="0.00@" dy="0.008" dpx="0.007" dpy="0.006"/>
<Intrinsic focal="@" kappa1="0.00@" cx="320" cy="240" sx="1"/>
<Extrinsic tx="@" ty="1" tz="1" rx="@" ry="1" rz="1"/></Camera>"""
    ],
    ".csv": [
        "@00,2,3,320,5,60@,7,240,0.01,0.2,0.0@\n",
        "1\n2\n3\n@\n5\n6\n7\n@\n9\n10\n11\n",
    ],
}


@case("Camera.from_tsai")
def _(d):
    return memo.Camera.from_tsai(
        size=d.picture(),
        pixel_mm=d.pair(0.001, 0.1),
        focal_mm=d.number(1, 50),
        kappa1_per_mm2=d.number(-0.01, 0.01),
        centre_px=d.pair(0, 700),
        sx=d.number(0.5, 1.5),
        translation_mm=d.triple(-9000, 9000),
        rotation_rad=d.triple(-4, 4),
    ).parameters()


@case("Camera.level")
def _(d):
    camera = memo.Camera.level(d.picture(), d.number(1, 179), d.number(0.1, 5), d.number(0, 50))
    return (
        camera.parameters(),
        repr(camera),
        camera.project([(0.0, 5.0, 1.0)]),
        camera.ground_points([(1.0, 400.0)]),
    )


@case("Camera.__new__", "Camera.matrix", "Camera.rotation", "Camera.translation")
def _(d, name):
    usual = memo.Camera.level((64, 48), 60.0, 1.2, 5.0)
    wrong = [np.eye(4), np.zeros(3), "K", None, [], np.full((3, 3), np.nan), 1e300 * np.eye(3)]

    def given(*right):
        return d.one(wrong) if d.is_wrong() else d.choice(*right)

    camera = memo.Camera(
        given(usual.matrix, usual.matrix.tolist()),
        given(usual.rotation, np.array([1.4, 0.2, -0.3])),
        given(usual.translation),
        d.picture(),
        distortion=given(None, [-0.2, 0.1, 0.001, 0.001], np.zeros(5)),
    )
    camera.project(np.ones((2, 0, 3)))
    return camera if name == "Camera.__new__" else getattr(camera, name.partition(".")[2])


@case("Camera.from_parameters")
def _(d):
    parameters = d.one(CAMERAS).parameters()
    for key in list(parameters):
        if d.is_wrong():
            value = d.one([*WRONG_OBJECTS, d.numbers(-1, 1, 3), d.numbers(-1, 1, 3, 3), d.numbers(-1, 1, 5)])
            parameters[key] = value.tolist() if isinstance(value, np.ndarray) else value
    if d.is_wrong():
        del parameters[d.one(sorted(parameters))]
    return memo.Camera.from_parameters(d.choice(parameters, parameters))


PLACES = [SCRATCH / "out.toml", SCRATCH, SCRATCH / "no" / "folder", "\0", 3]


@case("Camera.to_toml")
def _(d):
    return d.one(CAMERAS).to_toml(
        d.one(PLACES) if d.is_wrong() else PLACES[0], d.choice("cam", "", "a.b", '"')
    )


@case("Camera.pixel_height")
def _(d):
    return d.one(CAMERAS).pixel_height(d.triple(-9, 9), d.number(0, 3))


@case("Camera.shrunk")
def _(d):
    return d.one(CAMERAS).shrunk(d.whole(1, d.one([1, 4, 2000])))


@case(
    "Camera.parameters",
    "Camera.size",
    "Camera.position",
    "Camera.__reduce__",
    "Camera.__repr__",
    "Camera.__eq__",
    "Camera.__ne__",
)
def _(d, name):
    found = getattr(d.one(CAMERAS), name.split(".")[1])
    return (
        found(*([d.choice(*CAMERAS)] if name.endswith(("eq__", "ne__")) else []))
        if callable(found)
        else found
    )


@case("Camera.camera_from_world", "Camera.project")
def _(d, name):
    return getattr(d.one(CAMERAS), name.split(".")[1])(d.numbers(-9, 9, d.size(), 3))


@case("Camera.ground_points")
def _(d):
    return d.one(CAMERAS).ground_points(
        d.numbers(-100, 900, d.size(), 2), **d.options(z_m=lambda: d.number(-1, 3))
    )


@case("Camera.position_from_rectangle", "Camera.position_on_ground")
def _(d, name):
    bottom, top = d.pair(0, 640), d.pair(0, 480)
    return getattr(d.one(CAMERAS), name.split(".")[1])(bottom, top, d.number(0.5, 2.5))


@case(
    "Scene.__new__",
    "Scene.frame",
    "Scene.time_s",
    "Scene.truth",
    "Scene.angles_deg",
    "Scene.camera",
    "Scene.height_m",
    "Scene.speed_mps",
    "Scene.heading_rad",
    "Scene.__len__",
)
def _(d, name):
    options = d.options(
        frames=lambda: d.whole(0, 200),
        noise_sd=lambda: d.number(0, 300),
        leftward=lambda: d.choice(None, True, False),
        late_left=lambda: d.number(0, 1),
    )
    scene = _memo.Scene(d.whole(0, 2**62), **options)
    if name in ("Scene.frame", "Scene.time_s", "Scene.truth"):
        return getattr(scene, name.split(".")[1])(d.whole(0, len(scene)))
    if name == "Scene.angles_deg":
        return scene.angles_deg(d.number(-3, 3))
    return (
        None
        if name == "Scene.__new__"
        else len(scene)
        if name == "Scene.__len__"
        else getattr(scene, name.split(".")[1])
    )


@case(
    "ClothedScene.__new__",
    "ClothedScene.frame",
    "ClothedScene.time_s",
    "ClothedScene.truth",
    "ClothedScene.contacts",
    "ClothedScene.camera",
    "ClothedScene.height_m",
    "ClothedScene.speed_mps",
    "ClothedScene.heading_rad",
    "ClothedScene.heading_at",
    "ClothedScene.__len__",
)
def _(d, name):
    options = d.options(
        frames=lambda: d.whole(1, 200),
        noise_sd=lambda: d.number(0, 255),
        leftward=lambda: d.choice(None, True, False),
        late_left=lambda: d.number(-0.1, 0.1),
        slant_rad=lambda: d.number(-1, 1),
        turn_rad=lambda: d.number(-5, 5),
        pause_s=lambda: (d.number(0, 3), d.number(0, 5)),
        mover=lambda: d.choice("walker", "rider", "waver", "trolley", "treadmill"),
    )
    scene = _memo.ClothedScene(d.whole(0, 2**62), **options)
    member = name.split(".")[1]
    if member in ("frame", "time_s", "truth", "heading_at"):
        return getattr(scene, member)(d.whole(0, len(scene)))
    if member == "contacts":
        return scene.contacts()
    if member == "__new__":
        return scene
    return len(scene) if member == "__len__" else getattr(scene, member)


def tracker_options(d):
    return d.options(
        fov_deg=lambda: d.number(5, 170),
        gait=lambda: d.choice("dense", "sampled_10"),
        adapt=lambda: d.choice(True, False),
        start_frames=lambda: d.whole(5, 20),
        treadmill=lambda: d.choice(None, True, False),
        compensate_gain=lambda: d.choice(True, False),
        background=lambda: d.choice(True, False),
        measure=lambda: d.choice("rohr", "lowe"),
        full_gradient=lambda: d.number(1, 99),
        full_velocity=lambda: d.number(0.1, 9),
        part_weights=lambda: d.choice(
            None, [1.0] * 14, [1e38] * 14, [0.0] * 13 + [1.0], [d.number(1, 9)] * 14
        ),
        reach_px=lambda: [d.whole(0, 90) for _ in range(4)],
        reach_from_rad=lambda: [d.number(-1, 1) for _ in range(3)],
    )


def new_tracker(d, kind):
    options = tracker_options(d)
    if d.random.random() < 0.1:
        options["camera"] = d.camera()
    return kind(d.number(1.2, 2.1), **options)


def scene_frames(d, count):
    """Frames that a tracker can start on: a drawn walker in a small picture."""
    scene = _memo.Scene(int(d.random.integers(4)), frames=max(14, count))
    step = d.one([2, 2, 3, 5, 8])
    return [d.laid_out(np.ascontiguousarray(scene.frame(index)[::step, ::step])) for index in range(count)]


def tracks(d, tracker):
    count = d.size(16, 7)
    frames = scene_frames(d, count) if d.random.random() < 0.3 else d.frames(count)
    if frames and d.is_wrong():
        frames[-1] = d.frames(1)[0]
    times = d.times(count)
    for index, frame in enumerate(frames):
        time_s = (
            times[index]
            if isinstance(times, np.ndarray) and times.ndim == 1 and index < len(times)
            else d.number(0, 9)
        )
        height, width = frame.shape if isinstance(frame, np.ndarray) and frame.ndim == 2 else (8, 8)
        whole = np.array([[0.0, 0, width, height]])
        boxes = d.spoilt(whole) if d.random.random() < 0.5 else None
        yield tracker.update(frame, time_s, boxes)


@case(
    "Tracker.__new__",
    "Tracker.update",
    "Tracker.finish",
    "Tracker.take_finished",
    "Tracker.people",
    "Tracker.seek_report",
    "Tracker.left_out",
    "Tracker.camera_motion",
    "Tracker.lost_views",
    "Tracker.wider",
)
def _(d, name):
    tracker = new_tracker(d, _memo.Tracker)
    if name == "Tracker.__new__":
        return
    all(True for _ in tracks(d, tracker))
    tracker.people(), tracker.seek_report(), tracker.camera_motion(), tracker.lost_views(), tracker.wider()
    tracker.finish()
    for left in tracker.left_out():
        (repr(left), left._repr_html_())
    for walk in tracker.take_finished():
        (repr(walk), walk._repr_html_(), walk.contours(0))
    tracker.finish() if d.is_wrong() else None


@case("Steadier.__new__", "Steadier.update", "Steadier.losses", "Steadier.wider")
def _(d, name):
    options = d.options(
        fov_deg=lambda: d.number(5, 170),
        still_px=lambda: d.number(0, 3),
        reach_px=lambda: [d.whole(0, 90) for _ in range(4)],
        reach_from_rad=lambda: [d.number(-1, 1) for _ in range(3)],
    )
    steadier = _memo.Steadier(d.maybe(d.camera), **options)
    for frame in d.frames(d.size(7)):
        steadier.update(frame)
    steadier.losses()
    steadier.wider()


@case("FieldSeeker.__new__", "FieldSeeker.update", "FieldSeeker.found")
def _(d, name):
    seeker = _memo.FieldSeeker()
    for frame in d.frames(d.size(7)):
        seeker.update(frame)
    return seeker.found()


@case("memo.field_of_view")
def _(d):
    return memo.field_of_view(d.frames(d.size(7)))


@case("Walk.contours")
def _(d):
    return WALK.contours(d.whole(0, len(WALK)))


@case("fit_walk", "memo.fit_walk")
def _(d, name):
    rows = WALK.columns["frame"].tolist()
    scene = _memo.Scene(5, frames=14)
    shown = [d.laid_out(np.ascontiguousarray(scene.frame(index)[::2, ::2])) for index in range(14)]
    (empty,) = [shown[0]] if d.random.random() < 0.5 else d.frames(1, shown[0].shape)
    options = d.options(
        empty=lambda: d.maybe(lambda: empty),
        height_sd=lambda: d.number(0.001, 0.2),
        frame_sd_deg=lambda: d.number(0.1, 20),
    )
    if name == "memo.fit_walk":
        return memo.fit_walk(WALK, d.frames(14) if d.is_wrong() else shown, **options)
    return _memo.fit_walk(WALK, d.frames(d.size()) if d.is_wrong() else [shown[k] for k in rows], **options)


def record(d):
    record = dict(WALK.record)
    for key in list(record):
        if d.random.random() < 0.3 * d.wrong:
            value = record[key]
            whole = (
                [[0] * len(value), [2**63] * len(value), value[1:], [10**6] * len(value)]
                if isinstance(value, list)
                else []
            )
            record[key] = d.one(
                [
                    *whole,
                    *WRONG_NUMBERS,
                    *WRONG_OBJECTS,
                    [d.number(-9, 9)] * len(record["frame"]),
                    [[0, 0, 0, 0]] * len(record["frame"]),
                ]
            )
    return d.choice(record, record)


@case("Explainer.__new__", "Explainer.update", "Explainer.finish")
def _(d, name):
    wanted = d.choice(set(range(14)), set(), {3}, {10**9})
    records = [record(d) for _ in range(d.size(2))]
    explainer = _memo.Explainer(d.choice(TRACKER, TRACKER), d.choice(records, records), wanted)
    if name == "Explainer.__new__":
        return
    scene = _memo.Scene(5, frames=14)
    for index in range(d.size(8)):
        time_s = d.number(0, 1) if d.is_wrong() else scene.time_s(index)
        explainer.update(d.laid_out(np.ascontiguousarray(scene.frame(index)[::2, ::2])), time_s)
    if name == "Explainer.finish":
        explainer.finish()


@case("recorded_contours")
def _(d):
    return _memo.recorded_contours(record(d), [d.whole(0, 20) for _ in range(d.size(5))])


@case("population_height_m")
def _(d):
    return _memo.population_height_m()


@case("defaults")
def _(d):
    return _memo.defaults(
        d.choice("edge_segments", "fit_walk", "planar", "pointlight", "posture", "track", "walker_motion")
    )


@case("change_mask")
def _(d):
    a, b = d.frames(2)
    return memo.change_mask(a, d.one([a, b, *d.frames(1)]), **d.options(threshold=lambda: d.number(0, 255)))


@case("moving_regions")
def _(d):
    return memo.moving_regions(d.mask())


@case("silhouettes")
def _(d):
    return memo.silhouettes(
        d.frames(3) + d.frames(1) if d.is_wrong() else d.frames(d.size(8, 1)),
        **d.options(threshold=lambda: d.number(0, 255)),
    )


@case("similarity")
def _(d):
    options = d.options(
        c_l=lambda: d.number(0, 5),
        c_d=lambda: d.number(0, 5),
        c_r=lambda: d.number(0, 5),
        sigma_phi_rad=lambda: d.number(0, 3),
    )
    return memo.similarity(
        d.numbers(-50, 700, d.size(), 2, 2), d.numbers(-50, 700, d.size(), 2, 2), **options
    )


@case("shrunk")
def _(d):
    (frame,) = d.frames(1)
    return _memo.shrunk(frame, d.whole(1, 4))


@case("edge_segments")
def _(d):
    (frame,) = d.frames(1)
    options = d.options(
        sigma_px=lambda: d.number(0.4, 5),
        low=lambda: d.number(1, 9),
        high=lambda: d.number(9, 30),
        min_length_px=lambda: d.number(1, 20),
    )
    return memo.edge_segments(
        frame, d.maybe(lambda: d.mask(np.shape(frame)[:2] if np.ndim(frame) >= 2 else None)), **options
    )


@case("camera_tilt")
def _(d):
    (frame,) = d.frames(1)
    still = d.maybe(lambda: d.mask(np.shape(frame)[:2] if np.ndim(frame) >= 2 else None))
    return memo.camera_tilt(frame, still, **d.options(fov_deg=lambda: d.number(1, 180)))


@case("velocity_field")
def _(d):
    first, second = d.frames(2)
    return memo.velocity_field(first, second, d.mask(np.shape(first)[:2] if np.ndim(first) >= 2 else None))


@case("normal_cycle")
def _(d):
    return _memo.normal_cycle(d.choice("hip", "knee"))


@case("euler_angles")
def _(d):
    return _memo.euler_angles(
        d.numbers(-1, 1, d.size(), 3 if d.random.random() < 0.9 else d.size(4), 3),
        d.choice("YXZ", "ZXY", "XYZ"),
    )


@case("walker_motion")
def _(d):
    options = d.options(
        rate_hz=lambda: d.number(1, 500),
        speed_mps=lambda: d.number(0.1, 3),
        heading_deg=lambda: d.number(-400, 400),
        phase=lambda: d.number(-2, 2),
        height_m=lambda: d.number(1, 2.2),
    )
    if d.random.random() < 0.3:
        return memo.walker_motion(cycles=d.whole(0, 4), **options)
    return memo.walker_motion(d.whole(0, 200), **options)


@case("pointlight")
def _(d):
    frames, count = d.size(31, 1), d.size(13, 1)
    names = d.choice([f"p{k}" for k in range(count)], memo.walker_motion(1).names[:count])
    limbs = [
        (int(d.random.integers(max(1, count))), int(d.random.integers(max(1, count))))
        for _ in range(d.size(5))
    ]
    options = d.options(
        azimuth_deg=lambda: d.number(-400, 400),
        elevation_deg=lambda: d.number(-90, 90),
        px_per_m=lambda: d.number(1, 900),
        camera=d.camera,
        locomotion=lambda: d.choice("treadmill", "translating", "pelvis"),
        cycles=lambda: d.whole(0, 4),
        tempo=lambda: d.number(0.1, 10),
        inverted=lambda: d.choice(True, False),
        mirrored=lambda: d.choice(True, False),
        reversed=lambda: d.choice(True, False),
        scramble_position=lambda: d.choice(True, False),
        scramble_axes=lambda: d.choice("both", "horizontal", "vertical"),
        scramble_limit_px=lambda: d.number(0, 300),
        scramble_phase=lambda: d.choice(None, "periodic", "shortened"),
        period_s=lambda: d.number(0, 1),
        max_shift_s=lambda: d.number(0, 1),
        lifetime_frames=lambda: d.whole(1, 40),
        life_dots=lambda: d.whole(1, 9),
        life_sites=lambda: d.choice("limbs", "joints"),
        limbs=lambda: d.choice(None, limbs),
        synchronous=lambda: d.choice(True, False),
        noise_dots=lambda: d.whole(0, 40),
        noise_kind=lambda: d.choice("scrambled", "linear", "flicker"),
        noise_area=lambda: d.number(0, 9),
        noise_speed_px_s=lambda: d.number(0, 900),
        noise_sd_px=lambda: d.number(0, 9),
        seed=lambda: d.whole(0, 2**62),
    )
    return memo.pointlight(d.numbers(-2, 2, frames, count, 3), d.times(frames), names, **options)


def shown(d):
    walk = memo.walker_motion(d.size(9, 1))
    return memo.pointlight(walk.positions, walk.times_s, walk.names, noise_dots=d.size(4))


@case("pointlight_cycle")
def _(d):
    frames, actors = d.size(97, 64), d.size(2, 1)
    lengths = [d.size(97) if d.is_wrong() else frames for _ in range(actors)]
    motions = [memo.walker_motion(length, rate_hz=25) for length in lengths]
    names = [d.choice(motion.names, ["LAN"], []) if d.is_wrong() else motion.names for motion in motions]
    period = d.options(period_s=lambda: d.number(0.8, 1.3))
    return memo.pointlight_cycle([m.positions for m in motions], d.times(frames), names, **period)


@case("pointlight_together")
def _(d):
    displays = [shown(d) for _ in range(d.size(3))]
    offsets = [(d.number(-90, 90), d.number(-90, 90)) for _ in range(d.size(3))]
    return memo.pointlight_together(displays, d.choice(None, offsets))


@case("PointLightDisplay.frames")
def _(d):
    options = d.options(
        size_px=lambda: (d.whole(1, 90), d.whole(1, 90)),
        centre_px=lambda: (d.number(-90, 90), d.number(-90, 90)),
        dot_px=lambda: d.number(0, 40),
        shape=lambda: d.choice("disc", "square", "gaussian"),
        colour=lambda: (d.whole(0, 255), d.whole(0, 255), d.whole(0, 255)),
        background=lambda: (d.whole(0, 255), d.whole(0, 255), d.whole(0, 255)),
        smooth=lambda: d.choice(True, False),
        alpha=lambda: d.choice(True, False),
        start=lambda: d.whole(0, 12),
        stop=lambda: d.whole(0, 12),
    )
    return shown(d).frames(**options)


def swinging(d, frames, count):
    """Points (T, K, 2) that swing about each other in a plane, or jump."""
    if d.random.random() < 0.3:
        return d.numbers(0, 600, frames, count, 2)
    at = 300.0 + np.zeros((frames, max(1, count), 2))
    angle = np.cumsum(
        d.random.normal(0, d.one([0.02, 0.2]), (frames, max(1, count))), axis=0
    ) + d.random.uniform(0, 6, max(1, count))
    for k in range(1, max(1, count)):
        at[:, k] = at[:, int(d.random.integers(k))] + 60 * np.stack(
            [0.6 * np.cos(angle[:, k]), np.sin(angle[:, k])], axis=-1
        )
    at[d.random.random(at.shape[:2]) < d.one([0.0, 0.0, 0.1, 0.5])] = np.nan
    return d.spoilt(at[:, :count])


def planar_arguments(d):
    frames, count = d.size(64, 8), d.size(8, 2) if d.random.random() < 0.97 else 31
    options = d.options(
        window_s=lambda: d.number(0.01, 5),
        size_px=lambda: d.number(1, 900),
        carry=lambda: d.choice(True, False),
        false_target_rate=lambda: d.choice(0.01, 0.05),
        max_tilt_deg=lambda: d.number(10, 89),
        names=lambda: d.choice(
            [f"p{k}" for k in range(count)],
            (["RKN", "RAN", "right_hip", "LSH", "x", "LEL", "LWR", "y"] * 4)[:count],
        ),
        scales=lambda: d.numbers(0.5, 2, frames),
        focal_px=lambda: d.number(100, 3000),
        progress=d.called_back,
    )
    return (swinging(d, frames, count), d.times(frames), d.number(0, 5)), options


@case("planar")
def _(d):
    arguments, options = planar_arguments(d)
    return _memo.planar(*arguments, **options)


def explanation(scene):
    """The evidence of the walk in a frame."""
    explainer = _memo.Explainer(TRACKER, [WALK.record], {int(WALK.columns["frame"][4])})
    for index in range(14):
        frame = np.ascontiguousarray(scene.frame(index)[::2, ::2])
        for found in explainer.update(frame, scene.time_s(index)):
            return found


def results():
    """One object of each class of results, by its name."""
    scene = _memo.Scene(5, frames=14)
    walk = memo.walker_motion(40)
    shown = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30.0)
    limbs = _memo.planar(shown.positions_px[:, :6], walk.times_s, 0.5, window_s=0.5)
    camera, places = CAMERAS[0], np.random.default_rng(0).uniform((-1, 4, 0), (1, 6, 2), (12, 3))
    ground = places * (3, 3, 0) - (0, 6, 0)
    ends = [camera.project(ground + np.array([0, 0, height_m])) for height_m in (0, 1.75)]
    joints, _ = _memo.lee_chen_walker("SEQ1", 4)
    pixels = 800.0 * joints[..., :2] / joints[..., 2:] + (320.0, 240.0)
    postures = _memo.posture(np.arange(4) / 25, pixels, np.ones((4, 14)), camera, height_m=1.75)
    window = next(window for window in limbs.windows if window.chains)
    motion, cycle = _memo.FrameMotion(0, "still", [0.0, 0.0, 0.0], 0.1, 0.1, 1.0), np.zeros((5, 101, 6))
    made = [
        *(WALK, WALK.start, WALK.start.line, WALK.height, WALK.gait_parameters[0], explanation(scene)),
        _memo.WalkerState(0, 3, 0.1, 0.2, 0.0, 1.0, 0.0, 0.25, 0.1, 1.3),
        *(_memo.SeekReport(9, 3, 1, 0, 13, 1, 2, 0.3), motion, _memo.LostView(4, "cut")),
        _memo.SteadiedFrame(motion, np.zeros((3, 4), np.uint8), np.zeros((3, 4), bool)),
        _memo.LeftOut(3, 20, 0.12, 0.8, 15, "too slow", 0.1, [[3, 10, 20, 30, 80], [20, 11, 20, 30, 80]]),
        _memo.GaitEvent(0.1, 2.5, "toe_off", "left"),
        _memo.GaitCycle("left", "mean", float("nan"), float("nan"), cycle),
        *(_memo.Departure("left", "knee", 6.0, 2.0, 30, 0.2), _memo.WalkRatio(0.006, 0.004, 0.011)),
        *(_memo.Treadmill(1.2, 0.03, -0.4, 0.3), _memo.CameraTilt(1.0, -2.0, 0.7, 3.0, 12.5)),
        *(walk, shown, limbs, window, window.chains[0], window.chains[0].links[0], postures),
        _memo.SecondMotion(["neck"], 0, joints, 1.0, 0.3),
        _memo.WalkFit(
            0.6,
            200.0,
            0.01,
            0.02,
            1.5,
            0.01,
            0.004,
            False,
            False,
            False,
            "well",
            {"head": 0.02, "left shank": 0.3},
            {"head": 0.5},
            ["left shank"],
            {"thigh": 0.4},
            {"right_hip_deg": 1.1, "phase": 0.02},
            np.zeros((2, 5, 50)),
        ),
        *_memo.unswap(walk.times_s, shown.positions_px, groups={"legs": {"hip": [(6, 9)]}}).values(),
        memo.calibrate_points(places, camera.project(places), camera.size),
        memo.calibrate_walker(*ends, camera.size, 1.75, focal_px=camera.matrix[0, 0]),
        *(_memo.lee_chen_counts("SEQ1"), _memo.lee_chen_last_stage("SEQ1", "rigid_torso")[0]),
        *(_memo.lee_chen_figures("SEQ1"), _memo.lee_chen_head()[0], _memo.lee_chen_inputs()),
        *(_memo.hoffman_flinchbaugh_rods(9, 0), _memo.hoffman_flinchbaugh_hinges(9, 1, 0)),
        _memo.hoffman_flinchbaugh_rod(np.random.default_rng(0).uniform(-9, 9, (1, 3, 2))),
        *(_memo.image_stages(*map(scene.frame, (4, 5, 6))), _memo.walk_similarity(WALK, 0, [])),
    ]
    return {type(result).__name__: result for result in made}


RESULTS = results()


@case(
    *(
        f"{kind}.{part}"
        for kind, result in RESULTS.items()
        for part in vars(type(result))
        if part not in NO_CALLS and f"{kind}.{part}" not in ("PointLightDisplay.frames", "Walk.contours")
    )
)
def _(d, name):
    kind, part = name.split(".")
    fields = RESULTS[kind].__getnewargs__()
    given = [d.one(WRONG_OBJECTS) if d.is_wrong() else field for field in fields]
    made = type(RESULTS[kind])(*d.one([given, given, given[1:], [*given, 1]] if d.is_wrong() else [given]))
    found = getattr(made, part)
    return repr(made), made.__getnewargs__(), made._repr_html_(), found


@case("planar_rods", "planar_hinges")
def _(d, name):
    return getattr(memo, name)(d.numbers(-50, 50, d.size(), 3 if name == "planar_rods" else 4, 2))


@case("keypoint_layouts", "joint_names", "segment_names", "rohr_numbers", "lee_chen_inputs", "lee_chen_head")
def _(d, name):
    return getattr(_memo, name)()


@case("keypoint_layout", "joint_name")
def _(d, name):
    return getattr(_memo, name)(
        d.choice(
            *(LAYOUTS if name == "keypoint_layout" else NAMES_14),
            "coco-17",
            "RightKnee",
            d.one(["", "x" * 10_000, "\U0001f600"]),
        )
    )


@case("guess_layout")
def _(d):
    return _memo.guess_layout(d.numbers(0, 600, d.size(16), d.one([14, 17, 18, 25, 33, 0, 1, 133]), 2))


def layout_or_names(d):
    """A layout or names, and how many points it has."""
    layout = d.one(LAYOUTS)
    names = list(_memo.keypoint_layout(layout)[1])
    if d.random.random() < 0.3:
        names = [d.one([*names, *NAMES_14, "x"]) for _ in range(d.size(17))]
        return d.choice(names, names), len(names)
    return d.choice(layout, names), len(names)


@case("stick_joints", "head_points", "foot_points")
def _(d, name):
    layout, count = layout_or_names(d)
    frames = d.size(16)
    return getattr(memo, name)(layout, d.numbers(0, 600, frames, count, 2), d.numbers(0, 1, frames, count))


@case("side_pairs")
def _(d):
    return _memo.side_pairs(layout_or_names(d)[0])


@case("follow_everyone")
def _(d):
    people, count = d.size(31), d.size(17)
    frames = np.sort(d.random.integers(0, d.one([1, 8, 2**62]), people, endpoint=True)).tolist()
    return _memo.follow_everyone(
        d.choice(frames, frames), d.numbers(0, 600, people, count, 2), d.numbers(0, 1, people, count)
    )


@case("unswap")
def _(d):
    frames, count = d.size(31, 1), d.size(13, 8)
    order = d.random.permutation(count + int(d.is_wrong())).tolist()
    pairs = [order[k : k + 2] for k in range(0, len(order) - 1, 2)]
    groups = {
        f"g{k}": {f"l{i}": [pair] for i, pair in enumerate((pairs * 4)[: d.size(17) if d.is_wrong() else 4])}
        for k in range(d.size(3, 1))
    }
    options = d.options(
        scores=lambda: d.numbers(0, 1, frames, count),
        as_is_nats=lambda: d.number(0, 9),
        partial_begin_nats=lambda: d.number(0, 9),
        partial_stay_nats=lambda: d.number(0, 9),
        decided_at=lambda: d.number(0.6, 0.99),
    )
    return _memo.unswap(
        d.times(frames), swinging(d, frames, count), groups=d.choice(groups, groups), **options
    )


def stick_points(d, frames):
    """Points (T, 14, 2) of a walking figure, some of them missing."""
    joints, _ = _memo.lee_chen_walker(d.one(["SEQ1", "SEQ2"]), frames)
    points = (
        800.0 * joints[..., :2] / joints[..., 2:]
        + (320.0, 240.0)
        + d.random.normal(0, d.one([0, 2, 30]), (frames, 14, 2))
    )
    points[d.random.random(points.shape[:2]) < d.one([0.0, 0.0, 0.1, 0.7])] = np.nan
    return d.spoilt(points)


def lengths(d):
    named = {name: d.number(0.05, 0.6) for name in LENGTHS} if d.is_wrong() else dict(LENGTHS)
    return {**named, "other": 1.0} if d.is_wrong() else d.choice(named, named)


def posture_options(d, frames):
    size = d.one(
        [
            {"height_m": d.number(1.2, 2.1)},
            {"lengths": lengths(d)},
            *[{"lengths": lengths(d), "height_m": 1.7}] * d.is_wrong(),
        ]
    )
    if d.random.random() < 0.2:
        distances = [d.number(1, 20), d.numbers(1, 20, frames), d.random.uniform(1, 20, frames).tolist()]
        size |= {"anchor": "given", "distance_m": d.one(distances)} | d.options(
            distance_sd_m=lambda: d.number(0.01, 1)
        )
    return size | d.options(
        noise_px=lambda: d.number(0, 9),
        rules=lambda: d.choice("walking", "physical", "walking_general"),
        strength=lambda: d.choice("measured", "paper"),
        anchor=lambda: d.choice("auto", "ground", "trunk", "extent", "head", "combined", "given"),
        moving_direction=lambda: d.triple(-1, 1),
        group_m=lambda: d.number(0.01, 0.5),
        max_groups=lambda: d.whole(0, 100),
        keep_all=lambda: d.one([False, True]),
        progress=d.called_back,
    )


@case("posture")
def _(d):
    frames = d.size(5, 1)
    options = posture_options(d, frames) | d.options(
        head_points=lambda: d.numbers(0, 600, frames, 6, 2),
        foot_points=lambda: d.numbers(0, 600, frames, 4, 2),
    )
    assumed = {"size": d.picture()} | d.options(fov_deg=lambda: d.number(5, 170))
    options |= d.one([{"camera": d.camera()}, assumed])
    return _memo.posture(d.times(frames), stick_points(d, frames), d.numbers(0, 1, frames, 14), **options)


@case("posture_tree")
def _(d):
    joints, _ = _memo.lee_chen_walker(d.one(["SEQ1", "SEQ2"]), 1)
    rays = joints[0] / np.linalg.norm(joints[0], axis=1, keepdims=True)
    rays[d.random.random(14) < d.one([0.0, 0.1, 0.7])] = np.nan
    options = d.options(
        rules=lambda: d.choice("walking", "physical", "walking_general"),
        strength=lambda: d.choice("measured", "paper"),
        noise_rad=lambda: d.number(0, 0.1),
    )
    return _memo.posture_tree(
        d.spoilt(rays), d.triple(-9, 9) if d.is_wrong() else joints[0, 0].tolist(), lengths(d), **options
    )


@case("calibrate_points")
def _(d):
    count, camera, size = d.size(17, 6), d.one(CAMERAS), d.picture()
    places = d.random.uniform(-1, 1, (count, 3)) * d.one(
        [(1, 1, 1), (2, 3, 2), (1, 1, 0), (1, 0, 0), (1, 1, 1e-6)]
    ) + (0, 5, 1)
    pixels = camera.project(places) + d.random.normal(0, d.one([0, 0, 0.5, 50]), (count, 2))
    options = d.options(**d.one([{"focal_px": lambda: d.number(50, 5000)}, {"lens": d.camera}]))
    return memo.calibrate_points(
        d.spoilt(places), d.spoilt(np.nan_to_num(pixels)), d.choice(size, camera.size, camera.size), **options
    )


@case("calibrate_walker")
def _(d):
    count, camera = d.size(31, 5), d.one(CAMERAS)
    places = np.stack([np.linspace(-2, 2, count), np.linspace(2, 9, count), np.zeros(count)], axis=1)
    feet, heads = camera.project(places), camera.project(places + np.array([0, 0, 1.75]))
    noise = d.random.normal(0, d.one([0, 0.5, 0.5, 50]), (2, count, 2))
    options = d.options(
        foot_share=lambda: d.numbers(0, 0.2, count),
        head_share=lambda: d.numbers(0.8, 1, count),
        **d.one([{"focal_px": lambda: d.number(50, 5000)}, {"lens": d.camera}]),
    )
    feet, heads = d.spoilt(np.nan_to_num(feet) + noise[0]), d.spoilt(np.nan_to_num(heads) + noise[1])
    return memo.calibrate_walker(
        feet, heads, d.choice(d.picture(), camera.size), d.number(0.5, 2.5), **options
    )


@case("walker_sightings")
def _(d):
    count = d.size(17)
    names = [d.one([*NAMES_14, "nose", "left_eye", "x"]) for _ in range(count)]
    return memo.walker_sightings(d.choice(names, names), d.numbers(0, 600, d.size(31), count, 2))


SEQUENCES = ("SEQ1", "SEQ2")


@case("lee_chen_counts", "lee_chen_figures")
def _(d, name):
    options = d.options(merge_m=lambda: d.number(0, 1)) if name == "lee_chen_counts" else {}
    return getattr(_memo, name)(d.choice(*SEQUENCES), **options)


@case("lee_chen_last_stage")
def _(d):
    return _memo.lee_chen_last_stage(
        d.choice(*SEQUENCES),
        d.choice("as_printed", "rigid_torso"),
        **d.options(merge_m=lambda: d.number(0, 1)),
    )


@case("lee_chen_walker")
def _(d):
    return _memo.lee_chen_walker(d.choice(*SEQUENCES), d.whole(0, 100))


@case("hoffman_flinchbaugh_rods", "hoffman_flinchbaugh_false_targets", "hoffman_flinchbaugh_degenerate")
def _(d, name):
    return getattr(_memo, name)(d.whole(0, 50), d.whole(0, 2**62))


@case("hoffman_flinchbaugh_hinges")
def _(d):
    return _memo.hoffman_flinchbaugh_hinges(d.whole(0, 50), d.whole(0, 3), d.whole(0, 2**62))


@case("hoffman_flinchbaugh_rod")
def _(d):
    return _memo.hoffman_flinchbaugh_rod(d.numbers(-50, 50, d.choice(1, 1, 2), 3, 2))


@case("rohr_deviations")
def _(d):
    return _memo.rohr_deviations(d.whole(0, 2**62))


@case("gait_curves")
def _(d):
    return _memo.gait_curves(d.choice("dense", "sampled_10"), d.numbers(-3, 3, d.size()))


@case("body_parts")
def _(d):
    return _memo.body_parts(d.number(0.5, 2.5))


@case("model_contours")
def _(d):
    walkers = [
        (d.number(-3, 3), d.number(0, 9), d.number(-4, 4), d.number(-2, 2), d.number(1, 2.2))
        for _ in range(d.size(4))
    ]
    return _memo.model_contours(
        d.camera(),
        d.choice(walkers, walkers),
        **d.options(gait=lambda: d.choice("dense", "sampled_10"), hidden=lambda: d.choice(True, False)),
    )


@case("image_stages")
def _(d):
    frames = scene_frames(d, 3) if d.random.random() < 0.2 else d.frames(3)
    return _memo.image_stages(*(frames if not d.is_wrong() else frames[:2] + d.frames(1)))


@case("search_windows")
def _(d):
    return _memo.search_windows(d.numbers(-50, 700, d.size(), 2, 2), **d.options(c_r=lambda: d.number(0, 9)))


@case("walk_filtered")
def _(d):
    return _memo.walk_filtered(d.choice(WALK, WALK))


@case("walk_lines")
def _(d):
    return _memo.walk_lines(
        d.choice(WALK, WALK), d.whole(0, len(WALK)), **d.options(phase=lambda: d.number(-2, 2))
    )


@case("walk_similarity")
def _(d):
    options = d.options(along_m=lambda: d.number(0, 0.2), height_m=lambda: d.number(0, 0.2))
    return _memo.walk_similarity(
        d.choice(WALK, WALK),
        d.whole(0, len(WALK) - 1),
        d.numbers(0, 300, d.size(31), d.one([4, 6, 3])),
        **options,
    )


# The public functions of Python over them.


@case("memo.Tracker")
def _(d):
    tracker = new_tracker(d, memo.Tracker)
    all(True for _ in tracks(d, tracker))
    repr(tracker)
    found = tracker.finish()
    tables = ("columns", "events", "gait_parameters", "cycles", "records", "measured")
    return [getattr(found, name) for name in (*tables, "summary", "sentences")]


@case("memo.track")
def _(d):
    count = d.size(8, 1)
    given = {"times_s": d.times(count)} if d.random.random() < 0.5 else {"fps": d.number(1, 100)}
    return memo.track(
        d.choice(d.frames(count), d.frames(count)),
        height_m=d.number(1.2, 2.1),
        **given,
        **(tracker_options(d)),
    ).summary


@case("memo.demo_scene")
def _(d):
    options = d.options(
        noise_sd=lambda: d.number(0, 300),
        leftward=lambda: d.choice(None, True, False),
        late_left=lambda: d.number(-0.1, 0.1),
        turn_deg=lambda: d.number(-250, 250),
        mover=lambda: d.choice("walker", "rider", "waver", "trolley", "treadmill"),
        progress=d.called_back,
    )
    return repr(memo.demo_scene(d.whole(0, 2**62), frames=d.whole(0, 14), **options))


@case("memo.planar")
def _(d):
    arguments, options = planar_arguments(d)
    found = memo.planar(*arguments, **options)
    return repr(found), found.links()


def keypoints(d):
    layout = d.one(LAYOUTS)
    count = len(memo.layouts()[layout])
    frames = d.size(5, 1)
    numbers = (
        np.cumsum(d.random.integers(1, 4, frames))
        if not d.is_wrong()
        else d.one([[3] * frames, [0, 2**40], [2**62] * frames, [-1]])
    )
    times = {"times_s": d.times(frames)} if d.random.random() < 0.5 else {"fps": d.number(1, 100)}
    names = d.choice(layout, list(memo.layouts()[layout])) if not d.is_wrong() else ["a"] * count
    return memo.Keypoints.from_arrays(
        d.numbers(0, 600, frames, count, 2),
        d.numbers(0, 1, frames, count),
        names=names,
        **times,
        **d.options(frames=lambda: numbers, image_size=d.picture),
    )


@case("memo.Keypoints")
def _(d):
    found = keypoints(d)
    return repr(found), found.check_pixels(), found.replaced(found.points, d.spoilt(found.scores))


@case("memo.unswap")
def _(d):
    return repr(
        memo.unswap(
            d.choice(*[keypoints(d)] * 3), **d.options(groups=lambda: d.choice(("legs",), ("arms", "legs")))
        )
    )


@case("memo.posture")
def _(d):
    options = {**posture_options(d, 4), **d.options(unswap=lambda: d.choice(True, False))}
    options |= d.one([{"camera": d.camera()}, d.options(fov_deg=lambda: d.number(5, 170))])
    found = memo.posture(d.choice(*[keypoints(d)] * 3), **options)
    return repr(found), found.summary


@case("memo.read_keypoints")
def _(d):
    options = d.options(person=lambda: d.whole(0, 0)) | ({"layout": d.one(LAYOUTS)} if d.is_wrong() else {})
    return memo.read_keypoints(path_of(d, KEYPOINT_FILES), fps=d.number(1, 99), **options)


KEYPOINT_FILES = {
    ".csv": [
        "frame,joint,x,y,score\n0,neck,@,2,1\n1,neck,3,@,1\n",
        "frame,neck_x,neck_y,neck_score\n0,1,2,1\n1,1,2,0.@\n",
    ],
    ".json": [
        '[{"image_id": "@.jpg", "category_id": 1, "keypoints": ['
        + "1, 2, 0.@, " * 16
        + '1, 2, 1], "score": 1}]'
    ],
    ".txt": [""],
}


@case("memo.read_lengths")
def _(d):
    texts = {
        ".csv": ["".join(f"{name},0.@\n" for name in LENGTHS)],
        ".json": ['{"lengths": {' + ", ".join(f'"{name}": 0.@' for name in LENGTHS) + "}}"],
    }
    return memo.read_lengths(path_of(d, texts))


@case("memo.write_keypoints")
def _(d):
    return memo.write_keypoints(
        d.one(PLACES) if d.is_wrong() else Path(tempfile.mkdtemp(dir=SCRATCH)) / "w",
        keypoints(d),
        d.choice(*memo.keypoints.WRITERS),
    )


@case("memo.layouts")
def _(d):
    return memo.layouts()


@case("memo.calibration.rectangles")
def _(d):
    return memo.calibration.rectangles(d.choice(d.frames(d.size(8)), d.frames(3) + d.frames(1)))


@case("memo.calibration.standing_place")
def _(d):
    return memo.calibration.standing_place(d.one(CAMERAS))


@case("memo.calibration.draw_ground")
def _(d):
    return memo.calibration.draw_ground(
        d.frames(1)[0], d.one(CAMERAS), d.maybe(lambda: d.numbers(0, 600, d.size(5), 2))
    )


ELSEWHERE = {
    "DemoScene": "what demo_scene gives",
    "InternalError": "an exception",
    "KeypointsError": "an exception",
    "PlanarFigure": "what planar gives",
    "Postures": "what posture gives",
    "SideRepair": "what unswap gives",
    "Track": "what track gives",
}
"""Public names without a case of their own."""


def bindings():
    """What can be called or read of the compiled module, and the public functions of Python over it."""
    found = set()
    for name, part in vars(_memo).items():
        if name.startswith("__"):
            continue
        if not inspect.isclass(part):
            found.add(name)
        elif not issubclass(part, BaseException):
            found |= {f"{name}.{own}" for own in vars(part) if own not in NO_CALLS}
    for name in memo.__all__:
        part = getattr(memo, name)
        if callable(part) and part is not getattr(_memo, name, None) and name not in ELSEWHERE:
            found.add(f"memo.{name}")
    return found


def draw_of(name, number, seed, wrong=None):
    return Draw([seed, number, zlib.crc32(name.encode())], wrong)


def attempt(name, number, seed):
    """One call; what went wrong, or None."""
    d = draw_of(name, number, seed)
    try:
        CASES[name](d)
    except DOCUMENTED:
        return None
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        return {
            "call": f"{name}:{number}",
            "seed": seed,
            "raised": type(error).__name__,
            "message": str(error)[:500],
        }
    return None


def global_pool():
    """A failure where Rayon's global pool was started: a forked child would wait for its threads for ever.

    It has `RAYON_NUM_THREADS` threads without names; those of the pool that knows its process have names.
    Only Linux tells.
    """
    tasks = Path("/proc/self/task")
    if "RAYON_NUM_THREADS" not in os.environ or not tasks.exists():
        return None
    time.sleep(0.2)  # threads that have sent their result end
    names = [(task / "comm").read_text().strip() for task in tasks.iterdir()]
    nameless = sum(not name.startswith("memo-") for name in names)
    is_there = nameless > int(os.environ["RAYON_NUM_THREADS"])
    return {"call": "all", "raised": "nothing", "message": f"threads {names}"} if is_there else None


def main():
    """Makes the calls that the command line asks for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--calls", type=int, default=100)
    parser.add_argument("--log", type=argparse.FileType("w"), default=sys.stderr)
    parser.add_argument("names", nargs="*")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    os.chdir(SCRATCH)
    wanted = []
    for name in given.names or sorted(CASES):
        name, _, number = name.partition(":")
        wanted.append((name, [int(number)] if number else range(given.calls)))
    for name, numbers in wanted:
        for number in numbers:
            given.log.write(f"{name}:{number}\n")
            given.log.flush()
            faulthandler.dump_traceback_later(LIMIT_S, exit=True)
            failure = attempt(name, number, given.seed)
            faulthandler.cancel_dump_traceback_later()
            if failure is not None:
                print(json.dumps(failure), flush=True)
    if (failure := global_pool()) is not None:
        print(json.dumps(failure))


if __name__ == "__main__":
    main()
