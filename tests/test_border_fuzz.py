"""Wrong input at the border of Rust and Python: a value or an ordinary exception, whatever was given.

The calls are those of `border_fuzz`, in a process of its own, so that one that ends the process or does not
end fails here and is named.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import border_fuzz
import memo
import numpy as np
import pytest
from memo import _memo

FULL = bool(os.environ.get("MEMO_FULL"))
CALLS = 1500 if FULL else 5
LIMIT_S = 3600 if FULL else 300


def test_every_binding_and_public_function_is_called():
    """A new one fails this until it has a case in `border_fuzz`."""
    assert border_fuzz.bindings() <= set(border_fuzz.CASES)


def test_with_right_arguments_every_case_gives_a_value():
    for name, case in border_fuzz.CASES.items():
        for number in range(60):
            try:
                case(border_fuzz.draw_of(name, number, seed=0, wrong=0.0))
            except border_fuzz.DOCUMENTED as error:
                why = error
            else:
                break
        else:
            pytest.fail(f"{name} never gives a value; last: {why}")


@pytest.mark.parametrize("seed", range(4) if FULL else [0])
def test_wrong_input_gives_a_value_or_a_documented_exception(tmp_path, seed):
    log = tmp_path / "log"
    program = Path(border_fuzz.__file__)
    threads = {"RAYON_NUM_THREADS": "7", "OPENBLAS_NUM_THREADS": "1", "RUST_BACKTRACE": "0"}
    run = subprocess.run(
        [sys.executable, program, "--seed", str(seed), "--calls", str(CALLS), "--log", log],
        env={**os.environ, **threads},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
    )
    last = log.read_text().split()[-1]
    assert run.returncode == 0, f"{last} with seed {seed} ended the process: {run.stderr[-3000:]}"
    assert run.stdout == ""


@pytest.mark.parametrize(
    ("name", "call"),
    [
        ("frames", "memo._memo.Scene(frames=2**62)"),
        ("frames", "memo.demo_scene(frames=2**31)"),
        ("frames", "memo._memo.lee_chen_walker('SEQ1', 2**31)"),
        ("trials", "memo._memo.hoffman_flinchbaugh_rods(2**40, 0)"),
        ("trials", "memo._memo.hoffman_flinchbaugh_hinges(2**40, 0, 0)"),
        ("trials", "memo._memo.hoffman_flinchbaugh_false_targets(2**40, 0)"),
        ("trials", "memo._memo.hoffman_flinchbaugh_degenerate(2**40, 0)"),
    ],
)
def test_numbers_beyond_all_memory_and_time_are_refused(name, call):
    """In a process of its own: not refused, they end it, or it does not end."""
    program = f"import memo\ntry:\n    {call}\nexcept ValueError as error:\n    print(error)"
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert run.stdout.startswith(f"{name} must be"), run.stderr


CAMERA = memo.Camera.level((640, 480), 45.0, 1.2, 4.0)
WALKER = memo.walker_motion(20)
DISPLAY = memo.pointlight(WALKER.positions, WALKER.times_s, WALKER.names)


def displayed(**options):
    return memo.pointlight(WALKER.positions, WALKER.times_s, WALKER.names, **options)


WHOLE_NUMBERS = {
    "Camera size": lambda n: memo.Camera(CAMERA.matrix, CAMERA.rotation, CAMERA.translation, (n, 5)),
    "Camera.level size": lambda n: memo.Camera.level((5, n), 45.0, 1.2, 4.0),
    "Camera.from_parameters camera: size": lambda n: memo.Camera.from_parameters(
        CAMERA.parameters() | {"size": [n, 5]}
    ),
    "Camera.shrunk n": CAMERA.shrunk,
    "calibrate_points size": lambda n: memo.calibrate_points(np.zeros((6, 3)), np.zeros((6, 2)), (n, 5)),
    "shrunk n": lambda n: _memo.shrunk(np.zeros((9, 9), np.uint8), n),
    "walker_motion frames": memo.walker_motion,
    "walker_motion cycles": lambda n: memo.walker_motion(cycles=n),
    "demo_scene seed": memo.demo_scene,
    "demo_scene frames": lambda n: memo.demo_scene(frames=n),
    "Scene seed": _memo.Scene,
    "Scene.time_s index": lambda n: _memo.Scene().time_s(n),
    "pointlight seed": lambda n: displayed(seed=n),
    "pointlight cycles": lambda n: displayed(cycles=n),
    "pointlight noise_dots": lambda n: displayed(noise_dots=n),
    "pointlight lifetime_frames": lambda n: displayed(lifetime_frames=n),
    "pointlight life_dots": lambda n: displayed(lifetime_frames=2, life_dots=n),
    "pointlight limbs": lambda n: displayed(lifetime_frames=2, limbs=[(0, n)]),
    "frames start": lambda n: DISPLAY.frames(start=n),
    "frames stop": lambda n: DISPLAY.frames(stop=n),
    "frames size_px": lambda n: DISPLAY.frames(size_px=(n, 9)),
    "frames colour": lambda n: DISPLAY.frames(colour=(n, 0, 0)),
    "frames background": lambda n: DISPLAY.frames(background=(0, 0, n)),
    "Tracker start_frames": lambda n: memo.Tracker(1.7, start_frames=n),
    "hoffman_flinchbaugh_rods trials": lambda n: _memo.hoffman_flinchbaugh_rods(n, 0),
    "hoffman_flinchbaugh_rods seed": lambda n: _memo.hoffman_flinchbaugh_rods(1, n),
    "lee_chen_walker frames": lambda n: _memo.lee_chen_walker("SEQ1", n),
    "rohr_deviations seed": _memo.rohr_deviations,
}


@pytest.mark.parametrize("number", [-1, 2**64, np.int64(-(2**40))])
@pytest.mark.parametrize("argument", WHOLE_NUMBERS)
def test_whole_numbers_that_a_type_does_not_hold_are_refused_by_name(argument, number):
    name = argument.split(maxsplit=1)[1]
    with pytest.raises(ValueError, match=rf"^{name} must be .*, got .*\d") as refused:
        WHOLE_NUMBERS[argument](number)
    assert "\n" not in str(refused.value)


def test_numbers_beyond_all_digits_are_refused():
    with pytest.raises(ValueError, match=r"^seed must be between 0 and \d+, got a value of type int$"):
        displayed(seed=10**5000)


@pytest.mark.parametrize("index", [-1, 80, 2**64])
def test_a_frame_that_a_scene_does_not_have_is_an_index_error(index):
    with pytest.raises(IndexError, match=f"^frame {index} of a scene with 80 frames$"):
        _memo.Scene().frame(index)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: memo.stick_joints(5, np.zeros((1, 17, 2)), np.ones((1, 17))),
            "^layout_or_names must be the name of a layout or a list of the names of points, got 5$",
        ),
        (
            lambda: memo.head_points([1], np.zeros((1, 17, 2)), np.ones((1, 17))),
            r"^layout_or_names must be .*, got \[1\]$",
        ),
        (
            lambda: memo.Tracker("x"),
            "^height_m must be a number of metres or a list with one for each person, got 'x'$",
        ),
        (
            lambda: _memo.posture(
                np.zeros(1), np.zeros((1, 14, 2)), np.ones((1, 14)), size=(640, 480), distance_m="x"
            ),
            "^distance_m must be a number of metres or one for each frame, got 'x'$",
        ),
    ],
)
def test_a_type_error_states_the_types_of_python_in_one_line(call, words):
    with pytest.raises(TypeError) as refused:
        call()
    assert re.search(words, str(refused.value))


def test_a_figure_of_no_size_is_refused():
    points = np.random.default_rng(0).random((30, 3, 2))
    with pytest.raises(ValueError, match="size must be"):
        memo.planar(points, np.arange(30) / 25, 1.0, size_px=5e-324)


@pytest.mark.parametrize("focal_px", [-500.0, 0.0, np.nan, np.inf])
def test_a_focal_length_that_no_camera_has_is_refused(focal_px):
    points = np.random.default_rng(0).random((30, 3, 2))
    with pytest.raises(ValueError, match=r"^focal_px must be positive and finite, got "):
        memo.planar(points, np.arange(30) / 25, 1.0, focal_px=focal_px)


@pytest.mark.parametrize("size", [(16, 12), (180, 144), (240, 180)])
def test_small_pictures_are_calibrated(size):
    camera = memo.Camera.level(size, 45.0, 1.5, 5.0)
    row, column = np.divmod(np.arange(10), 5)
    places = np.stack([0.7 * column - 1.4, 0.4 * column + 1.5 * row, 0.8 + 1.1 * row + 0.1 * column], axis=1)
    focal_px = camera.parameters()["matrix"][0][0]
    found = memo.calibrate_points(places, camera.project(places), size, focal_px=focal_px)
    np.testing.assert_allclose(found.camera.position, camera.position, atol=1e-4)
