"""`memo ... | head`: where nobody reads any more, every command ends silently, with its results written."""

import json
import os
import subprocess
import sys

import memo
import numpy as np
import pytest
from memo.files import write_json
from memo.formats import Motion, write_motion
from memo.linkage import Points, write_points_csv

#: Runs commands, each in a fork of one process, with one of its two outputs closed at the other end.
DRIVER = """
import json, os, sys
import typer, rich.console, rich.progress, memo.cli
found = []
for arguments in json.loads(sys.argv[1]):
    for closed in json.loads(sys.argv[2]):
        unread, gone = os.pipe(), os.pipe()
        os.close(gone[0])
        child = os.fork()
        if not child:
            os.dup2(gone[1], closed)
            os.dup2(unread[1], 3 - closed)
            for descriptor in (*unread, gone[1]):
                os.close(descriptor)
            sys.argv = ["memo", *arguments]
            code = 70
            try:
                memo.cli.main()
            except SystemExit as ended:
                code = ended.code or 0
            except BaseException:
                import traceback
                traceback.print_exc()
            try:
                sys.stdout.flush()
            except BrokenPipeError:
                code = 120  # what Python itself would say, with a complaint
            os._exit(code)
        os.close(unread[1]); os.close(gone[1])
        said = b"".join(iter(lambda: os.read(unread[0], 65536), b"")).decode()
        os.close(unread[0])
        found.append([arguments, closed, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), said])
print(json.dumps(found))
"""

COMMANDS = (
    *(
        "track",
        "report",
        "convert",
        "batch",
        "posture",
        "unswap",
        "pointlight",
        "planar",
        "reproduce",
        "demo",
    ),
    *("calibrate", "calibrate points", "calibrate walker", "calibrate checkerboard"),
)


def ended(commands, outputs=(1, 2), unbuffered=False):
    """Command, which output was closed (1 or 2), exit code, and what was said to the other."""
    driver = [sys.executable, "-c", DRIVER, json.dumps([list(map(str, command)) for command in commands])]
    driver.append(json.dumps(outputs))
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    environment |= {"PYTHONUNBUFFERED": "1"} if unbuffered else {}
    done = subprocess.run(driver, capture_output=True, text=True, check=True, env=environment)
    return json.loads(done.stdout)


def test_help_of_every_command_may_be_read_in_part():
    commands = [["--help"], ["--version"], *([*command.split(), "--help"] for command in COMMANDS)]
    for command, _, code, said in ended(commands, outputs=[1]):
        assert (code, said) == (141, ""), command


def test_every_subcommand_is_among_them():
    import typer
    from memo.cli import _app

    app = typer.main.get_command(_app())
    below = {f"calibrate {name}" for name in app.commands["calibrate"].commands}
    assert set(app.commands) | below == set(COMMANDS)


@pytest.fixture
def folder(tmp_path):
    """Small files for commands that print what they did."""
    times_s = np.arange(9) / 25
    write_motion(tmp_path / "a.trc", Motion(("right_knee",), times_s, np.ones((9, 1, 3))))
    write_points_csv(
        tmp_path / "dots.csv", Points(["a", "b"], times_s, np.random.default_rng(0).random((9, 2, 2)))
    )
    person = {"pose_keypoints_2d": [10.0, 20.0, 0.9] * 25}
    (tmp_path / "json").mkdir()
    for frame in range(3):
        write_json(tmp_path / "json" / f"k_{frame}_keypoints.json", {"people": [person]})
    camera = memo.Camera.level((640, 480), 60.0, 1.0, 5.0)
    places = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (0.0, 1.6)])
    table = np.hstack([places, camera.project(places)])
    np.savetxt(tmp_path / "p.csv", table, delimiter=",", header="x_m,y_m,z_m,u_px,v_px", comments="")
    (tmp_path / "walk.mp4").write_text("x")
    (tmp_path / "m.csv").write_text("video\nwalk.mp4\n")
    return tmp_path


@pytest.mark.parametrize("unbuffered", [False, True])
def test_commands_end_silently_with_their_results_written(folder, unbuffered):
    """A pipe is found closed at the end, or, where nothing is held back, with the first line printed."""
    commands = [
        ["convert", folder / "a.trc", folder / "a.csv"],
        ["convert", folder / "a.trc", folder / "b.csv", "--json"],
        ["planar", folder / "dots.csv", "--no-video", "--out", folder / "planar"],
        ["unswap", folder / "json", "--fps", "25", "--layout", "BODY_25", "--out", folder / "unswap"],
        ["calibrate", "points", folder / "p.csv", "--size", "640x480", "--out", folder / "camera"],
        ["pointlight", "--seconds", "0.2", "--out", folder / "light"],
        ["batch", folder / "m.csv", "--check", "--out", folder / "batch"],
    ]
    for command, closed, code, said in ended(commands, unbuffered=unbuffered):
        as_wanted = (code, said) == (141, "") if closed == 1 else code in (0, 3) and bool(said)
        assert as_wanted, (command, code, said)
    written = ("a.csv", "b.csv", "planar/links.csv", "unswap/json", "camera/camera.toml", "light/display.mp4")
    assert [name for name in written if not (folder / name).exists()] == []


def test_complaints_nobody_reads_end_a_command_silently(folder):
    for command, closed, code, said in ended([["track", folder / "none.mp4"], ["batch"], ["nonsense"]]):
        assert (code, said) == (141, "") if closed == 2 else code in (1, 2) and bool(said), command


@pytest.mark.parametrize(
    ("output", "code", "said"),
    [
        (">&-", 0, ""),
        pytest.param(
            ">/dev/full",
            1,
            "memo: [Errno 28] No space left on device",
            marks=pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full"),
        ),
    ],
)
def test_an_output_that_is_closed_or_full_is_no_traceback(output, code, said):
    command = f"{sys.executable} -m memo.cli --version {output}"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr.strip()) == (code, said)


def test_an_output_in_ascii_has_all_sentences():
    code = "import sys; from memo.cli import main, delivery; sys.argv = ['memo', '--version']\ntry: main()\n"
    code += "except SystemExit: print('29\\xb0 gr\\udcfc\\udcdf')"
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=60
    )
    assert done.stdout.endswith("29\\xb0 gr\\udcfc\\udcdf\n") and not done.stderr
