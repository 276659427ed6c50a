"""Wrong input at the border of Rust and Python: a value or an ordinary exception, whatever was given.

The calls are those of `border_fuzz`, in a process of its own, so that one that ends the process or does not
end fails here and is named.
"""

import os
import subprocess
import sys
from pathlib import Path

import border_fuzz
import memo
import numpy as np
import pytest

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


def test_a_figure_of_no_size_is_refused():
    points = np.random.default_rng(0).random((30, 3, 2))
    with pytest.raises(ValueError, match="size must be"):
        memo.planar(points, np.arange(30) / 25, 1.0, size_px=5e-324)


@pytest.mark.parametrize("size", [(16, 12), (180, 144), (240, 180)])
def test_small_pictures_are_calibrated(size):
    camera = memo.Camera.level(size, 45.0, 1.5, 5.0)
    row, column = np.divmod(np.arange(10), 5)
    places = np.stack([0.7 * column - 1.4, 0.4 * column + 1.5 * row, 0.8 + 1.1 * row + 0.1 * column], axis=1)
    focal_px = camera.parameters()["matrix"][0][0]
    found = memo.calibrate_points(places, camera.project(places), size, focal_px=focal_px)
    np.testing.assert_allclose(found.camera.position, camera.position, atol=1e-4)
