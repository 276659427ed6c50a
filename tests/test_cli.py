"""The command line as a user meets it: exit codes, what is said, what is left behind."""

import dataclasses
import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from types import SimpleNamespace

import av
import memo
import numpy as np
import pytest
import typer
from conftest import shared_video
from memo import cli, recording
from memo.cli.demo import from_truth, strikes_from_truth
from memo.files import (
    TRACK_COLUMNS,
    complete_file,
    read_events_csv,
    read_track_csv,
    write_events_csv,
    write_track_csv,
)
from memo.given import default_out
from memo.run import read_run

TESTS = Path(__file__).parent
ROOT = TESTS.parent
WITH_FAKE_CORE = f"""
import sys
sys.path.insert(0, {str(TESTS)!r})
import fake_core, memo, memo.cli
for name, part in fake_core.PARTS.items():
    setattr(memo, name, part)
memo.cli.main()
"""
TELLS_FRAME_50 = """
import sys, pathlib, memo, memo.cli
started = pathlib.Path(sys.argv.pop(1))
class Telling(memo.Tracker):
    frames = 0
    def update(self, *frame):
        self.frames += 1
        if self.frames == 50:
            started.touch()
        return super().update(*frame)
memo.Tracker = Telling
memo.cli.main()
"""
TABLES = {"track.csv", "events.csv", "gait_parameters.csv", "cycles.csv", "run.json"}
CAMERA = "[side]\nname = 'side'\nsize = [50, 36]\n[front]\nname = 'front'\nsize = [640, 480]\n"


@pytest.fixture
def memo_command(core, memo_command):
    """With the stand-in core."""
    return memo_command


@pytest.fixture
def video(write_video, luma_frames):
    return write_video("walk.mp4", luma_frames(count=20))


def test_version_and_help(memo_command):
    assert memo_command("--version") == (0, f"memo {memo.__version__}\n", "")
    code, said, _ = memo_command("track", "--help")
    assert code == 0 and "Exit codes" in said and "--no-overlay" in said
    assert memo_command("track")[0] == 2


def test_the_package_runs_as_a_module():
    ran = subprocess.run([sys.executable, "-m", "memo", "--version"], capture_output=True, text=True)
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, f"memo {memo.__version__}\n", "")


def every_command(group=None, context=None):
    """Each command of the command line by its words, such as `memo calibrate points`, with its context."""
    group = group or typer.main.get_command(cli._app())
    context = context or group.make_context("memo", [], resilient_parsing=True)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = type(context)(command, info_name=name, parent=context)
        if hasattr(command, "list_commands"):
            yield from every_command(command, inner)
        else:
            yield inner.command_path, command


@pytest.mark.parametrize(("words", "command"), list(every_command()))
def test_each_command_shows_its_help(words, command, memo_command):
    code, said, complained = memo_command(*words.split()[1:], "--help")
    assert (code, complained) == (0, "")
    for parameter in command.params:
        # Where rich writes the help, brackets are markup.
        assert "[" not in (parameter.help or "") and all(
            name in said for name in parameter.opts if name.startswith("--")
        ), parameter.name


@pytest.mark.parametrize(("words", "command"), list(every_command()))
def test_each_command_shows_examples_that_parse(words, command):
    """A paragraph of examples, options as they are, then the exit codes; arguments in capitals."""
    examples, codes = command.epilog.split("\n\n")
    head, *lines = examples.splitlines()
    assert head == "Examples:" and codes.startswith("Exit codes: 0 ")
    assert len(lines) >= 2 and "\n" not in codes
    for line in lines:
        assert line.startswith(f"  {words}")
        command.make_context(words, shlex.split(line.removeprefix(f"  {words}")))
    names = [parameter.name for parameter in command.params]
    assert names[-2:] == ["as_json", "quiet"] or words == "memo convert"
    arguments = [parameter for parameter in command.params if parameter.param_type_name == "argument"]
    assert all((argument.metavar or "").isupper() for argument in arguments)


def test_tracking_leaves_everything(memo_command, video, tmp_path):
    out = tmp_path / "out"
    code, said, complaint = memo_command("track", video, "--out", out)
    assert (code, complaint) == (0, "")
    assert {path.name for path in out.iterdir()} == {
        *TABLES,
        "overlay.mp4",
        *("similarity.png", "start.png", "motion.png", "angles.png"),
    }
    assert said.startswith("20 frames, tracked.\nLeft and right may be swapped (probability 40%)")
    columns = read_track_csv(out / "track.csv")
    np.testing.assert_array_equal(columns["frame"], np.arange(20))
    np.testing.assert_allclose(columns["time_s"], np.arange(20) / 25, atol=1e-4)


def test_results_go_to_memo_out_by_default(memo_command, video, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert memo_command("track", video, "--no-overlay", "--no-plots")[0] == 0
    assert {path.name for path in (tmp_path / "memo-out" / "walk").iterdir()} == TABLES


def test_results_of_another_video_are_not_replaced_unasked(memo_command, video, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    out, plain = Path("memo-out/walk"), ("--no-overlay", "--no-plots")
    other = tmp_path / "p2" / "walk.mp4"
    other.parent.mkdir()
    shutil.copy(video, other)
    (tmp_path / "link").symlink_to(video.parent)
    assert memo_command("track", video, *plain)[0] == 0
    for same in (video, Path("link") / "walk.mp4"):
        assert memo_command("track", same, "--height", "1.8", *plain)[0] == 0
    before = (out / "run.json").read_bytes()
    code, _, complaint = memo_command("track", other, *plain)
    latest = tmp_path / "link" / "walk.mp4"
    assert (code, complaint) == (
        1,
        f"memo: {out}: holds the results of {latest}; give another folder with --out\n",
    )
    assert (out / "run.json").read_bytes() == before
    assert memo_command("track", other, "--out", out, *plain)[0] == 0
    (out / ".batch").mkdir()
    code, _, complaint = memo_command("track", other, *plain)
    assert (code, complaint) == (
        1,
        f"memo: {out}: holds the results of memo batch; give another folder with --out\n",
    )


def test_the_default_folder_of_images_has_the_whole_name(tmp_path):
    (tmp_path / "s01.t1").mkdir()
    (tmp_path / "s01.mp4").touch()
    assert default_out(tmp_path / "s01.t1") == Path("memo-out/s01.t1")
    assert default_out(tmp_path / "s01.mp4") == default_out(tmp_path / "s01.avi") == Path("memo-out/s01")


@pytest.mark.parametrize("source", [".", "..", "../walk", "link"])
def test_results_of_a_folder_have_its_name_however_it_is_given(
    memo_command, luma_frames, tmp_path, monkeypatch, source
):
    walk = tmp_path / "walk"
    (walk / "sub").mkdir(parents=True)
    for number, luma in enumerate(luma_frames(count=4)):
        height, width = luma.shape
        (walk / f"{number}.pgm").write_bytes(b"P5 %d %d 255\n" % (width, height) + luma.tobytes())
    (walk / "link").symlink_to(walk)
    here = walk / "sub" if source == ".." else walk
    monkeypatch.chdir(here)
    assert memo_command("track", source, "--fps", "25", "--no-overlay", "--no-plots")[0] == 0
    name = "link" if source == "link" else "walk"
    assert {path.name for path in (here / "memo-out").iterdir()} == {name}
    assert {path.name for path in (here / "memo-out" / name).iterdir()} == TABLES


def test_chosen_frames_keep_their_numbers(memo_command, video, tmp_path):
    assert memo_command("track", video, "--frames", "5:12", "--out", tmp_path / "out")[0] == 0
    columns = read_track_csv(tmp_path / "out" / "track.csv")
    np.testing.assert_array_equal(columns["frame"], np.arange(5, 12))
    np.testing.assert_allclose(columns["time_s"], np.arange(5, 12) / 25, atol=1e-4)
    assert [event["frame"] for event in read_events_csv(tmp_path / "out" / "events.csv")] == [5.25, 6.25]
    with av.open(str(tmp_path / "out" / "overlay.mp4")) as overlay:
        assert overlay.streams.video[0].frames == 7


def test_summary_as_json(memo_command, video, tmp_path):
    _, said, _ = memo_command("track", video, "--json", "--no-plots", "--out", tmp_path / "out")
    summary = json.loads(said)
    assert summary["status"] == "tracked" and summary["speed_mps"] == 1.3 and summary["rows"] == 20
    assert summary["unknown"] is None
    assert all(Path(file).is_file() for file in summary["files"])


def test_quiet_says_nothing(memo_command, video, tmp_path):
    assert memo_command("track", video, "--quiet", "--no-plots", "--out", tmp_path) == (0, "", "")


def test_nobody_there(memo_command, write_video, tmp_path):
    empty = write_video("empty.mp4", np.full((8, 36, 50), 16, np.uint8))
    code, said, _ = memo_command("track", empty, "--out", tmp_path / "out")
    assert code == 3 and said.startswith("0 frames, nobody.")
    assert read_track_csv(tmp_path / "out" / "track.csv")["x_m"].shape == (0,)
    assert not (tmp_path / "out" / "overlay.mp4").exists()


def test_camera_is_chosen_by_name(memo_command, video, tmp_path):
    camera = tmp_path / "cameras.toml"
    camera.write_text(CAMERA)
    arguments = ("track", video, "--no-plots", "--no-overlay", "--out", tmp_path, "--camera", camera)
    assert memo_command(*arguments, "--camera-name", "side")[0] == 0
    code, _, complaint = memo_command(*arguments, "--camera-name", "front")
    assert code == 1 and "640x480 pixels, the video has 50x36" in complaint
    code, _, complaint = memo_command(*arguments, "--camera-name", "top")
    assert code == 1 and "no camera named 'top'" in complaint


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["--height", "170"], "looks like centimetres: give --height 1.7"),
        (["--height", "1,75"], "--height 1,75: write decimal points, 1.75 for one height"),
        (["--height", "2,2"], "--height 2,2: write decimal points"),
        (["--height", "0"], "height of a person in metres"),
        (["--height", "-1.7"], "height of a person in metres"),
        (["--height", "nan"], "height of a person in metres"),
        (["--height", "17"], "height of a person in metres"),
        (["--fov-deg", "0"], "field of view"),
        (["--fov-deg", "nan"], "field of view"),
        (["--camera", "absent.toml"], "absent.toml: no such camera file"),
        (["--camera", __file__, "--fov-deg", "60"], "leave --fov-deg out"),
        (["--camera", __file__], ""),
        (["--camera-name", "side"], "needs --camera"),
        (["--frames", "5"], "--frames 5 is not A:B"),
        (["--frames", "9:3"], "--frames 9:3 is not A:B"),
        (["--frames", "a:b"], "--frames a:b is not A:B"),
        (["--frames", "100:"], "frame 100 was requested, but it has 20 frames"),
        (["--fps", "0"], "frame rate must be positive"),
        (["--out", __file__], "cannot be written to"),
    ],
    ids=lambda value: "_".join(value) if isinstance(value, list) else "",
)
def test_mistakes_are_told_in_one_line(memo_command, video, tmp_path, monkeypatch, arguments, reason):
    monkeypatch.chdir(tmp_path)
    code, said, complaint = memo_command("track", video, *arguments)
    assert (code, said) == (2 if reason in ("leave --fov-deg out", "needs --camera") else 1, "")
    assert complaint.startswith("memo: ") and complaint.count("\n") == 1 and reason in complaint


@pytest.mark.parametrize("given", ["video", "--boxes", "--camera"])
def test_results_never_replace_what_they_come_from(memo_command, video, tmp_path, given):
    """The name of the input is that of a file which `memo track` writes or removes."""
    folder = tmp_path / "run"
    folder.mkdir()
    name, content = {
        "video": ("overlay.mp4", video.read_bytes()),
        "--boxes": ("track.csv", b"1,-1,5,5,20,20,1\n"),
        "--camera": ("run.json", CAMERA.encode()),
    }[given]
    source = folder / name
    source.write_bytes(content)
    more = {"video": (source,), "--boxes": (video, "--boxes", source)}
    more["--camera"] = (video, "--camera", source, "--camera-name", "side")
    code, said, complaint = memo_command("track", *more[given], "--out", folder)
    assert (code, said) == (1, "")
    assert complaint == f"memo: {source}: is the input; write to another place\n"
    assert [path.name for path in folder.iterdir()] == [name] and source.read_bytes() == content
    link = tmp_path / "link"
    link.symlink_to(folder, target_is_directory=True)
    assert memo_command("track", *more[given], "--out", link)[0] == 1
    assert source.read_bytes() == content


def test_results_do_not_go_among_the_images_of_the_video(memo_command, luma_frames, tmp_path):
    frames = tmp_path / "frames"
    frames.mkdir()
    names = ("angles.png", "motion.png", "similarity.png", "start.png")
    for name, luma in zip(names, luma_frames(count=4), strict=True):
        with av.open(str(frames / name), "w", format="image2", options={"update": "1"}) as container:
            stream = container.add_stream("png", rate=1)
            stream.height, stream.width = luma.shape
            stream.pix_fmt = "gray"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(luma, format="gray")))
            container.mux(stream.encode(None))
    before = {path.name: path.read_bytes() for path in frames.iterdir()}
    code, _, complaint = memo_command("track", frames, "--fps", "25", "--out", frames)
    assert code == 1 and complaint == f"memo: {frames}: is the input folder; write to another place\n"
    assert {path.name: path.read_bytes() for path in frames.iterdir()} == before
    assert memo_command("track", frames, "--fps", "25", "--out", frames / "run")[0] == 0
    assert before.items() <= {path.name: path.read_bytes() for path in frames.glob("*.png")}.items()


def test_bad_videos_are_told_in_one_line(memo_command, tmp_path):
    for name in ("absent.mp4", "text.mp4"):
        (tmp_path / "text.mp4").write_text("no video " * 99)
        code, _, complaint = memo_command("track", tmp_path / name, "--out", tmp_path / "out")
        assert code == 1 and complaint.startswith("memo: ") and complaint.count("\n") == 1


def test_a_damaged_video_is_tracked_and_told(memo_command, write_video, luma_frames, tmp_path):
    path = write_video("cut.mp4", luma_frames(count=60), container_options={"movflags": "faststart"})
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * 0.6)])
    code, _, complaint = memo_command("track", path, "--no-plots", "--out", tmp_path / "out")
    assert code == 0 and complaint.count("\n") == 1 and "could" in complaint
    assert 10 < len(read_track_csv(tmp_path / "out" / "track.csv")["frame"]) < 60


def test_a_picture_larger_than_any_tested_is_told(memo_command, write_video, luma_frames, tmp_path):
    path = write_video("large.mp4", luma_frames(count=3, size=(1924, 32)))
    undrawn = ("track", path, "--no-plots", "--no-overlay", "--out", tmp_path / "out")
    _, said, complaint = memo_command(*undrawn)
    assert not complaint and "Tracked at 962x16 of the 1924x32 pixels" in said
    _, said, complaint = memo_command(*undrawn, "--shrink", "1")
    assert "Tracked at" not in said
    assert complaint.count("\n") == 1 and "1924x32 pixels are more than memo was tested on" in complaint


def test_demo_compares_with_the_truth(memo_command, tmp_path):
    code, said, _ = memo_command("demo", "--out", tmp_path, "--seed", "3")
    assert code == 0 and "torso x 0.0 cm" in said and "memo track VIDEO" in said
    assert (tmp_path / "overlay.mp4").exists() and (tmp_path / "track.csv").exists()
    code, said, _ = memo_command("demo", "--out", tmp_path, "--seed", "3", "--json")
    assert code == 0 and json.loads(said)["rms_from_truth"]["x_m"] == pytest.approx(0, abs=5e-4)
    assert memo_command("demo", "--out", tmp_path, "--quiet") == (0, "", "")


def test_truth_is_compared_by_frame_number(core):
    camera = core.Camera((160, 120))
    truth = core.walk(np.arange(30) / 25, camera)
    columns = {name: values[10:].copy() for name, values in truth.items()}
    columns["x_m"] += 0.03
    columns["phase"] = (columns["phase"] + 0.99) % 1
    differences = from_truth(columns, truth)
    assert differences["frames"] == 20 and differences["phase"] == pytest.approx(0.01)
    assert differences["x_m"] == pytest.approx(0.03) and differences["y_m"] == 0


def test_heel_strikes_are_compared_by_time_and_side():
    def strike(time_s, side, event="heel_strike"):
        return {"time_s": time_s, "event": event, "side": side}

    drawn = [strike(0.1, "left"), strike(0.5, "right"), strike(0.6, "right", "toe_off"), strike(1.0, "left")]
    columns = {name: np.array([event[name] for event in drawn]) for name in ("time_s", "event", "side")}

    def compared(*found, until_s=2.0):
        tracked = {"time_s": np.linspace(0.0, until_s, 50)}
        return strikes_from_truth(SimpleNamespace(columns=tracked, events=list(found)), columns)

    both = compared(strike(0.13, "left"), strike(0.46, "right"), strike(1.0, "right"), strike(1.2, "left"))
    assert both["heel_strikes"] == 3 and both["heel_strikes_found"] == 2
    assert both["heel_strike_s"] == pytest.approx(np.sqrt((0.03**2 + 0.04**2) / 2))
    assert compared(strike(0.1, "left"), until_s=0.7)["heel_strikes"] == 2
    assert compared(strike(0.1, "right"), strike(0.1, "left", "toe_off")) == {
        "heel_strikes": 3,
        "heel_strikes_found": 0,
    }
    assert strikes_from_truth(SimpleNamespace(columns={"time_s": np.array([])}, events=[]), columns) == {}


def interrupted(process, started, after_s=0.3, end=signal.SIGINT):
    """Sends a signal a little after work has begun; gives the exit code and what was complained."""
    deadline = time.monotonic() + 30
    while not started() and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.02)
    time.sleep(after_s)
    process.send_signal(end)
    _, complaint = process.communicate(timeout=60)
    return process.returncode, complaint


@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_writes_what_was_tracked(write_video, luma_frames, tmp_path, end):
    video, started = write_video("long.mp4", luma_frames(count=400)), tmp_path / "started"
    process = subprocess.Popen(
        [sys.executable, "-c", WITH_FAKE_CORE, "track", str(video), "--out", str(tmp_path / "out")],
        env=os.environ | {"FAKE_CORE_FRAME_S": "0.02", "FAKE_CORE_STARTED": str(started)},
        stderr=subprocess.PIPE,
        text=True,
    )
    code, complaint = interrupted(process, started.exists, end=end)
    assert code == 130 and complaint.count("\n") == 1 and "interrupted" in complaint
    assert 1 <= len(read_track_csv(tmp_path / "out" / "track.csv")["frame"]) < 400
    assert read_run(tmp_path / "out")["interrupted"] is True


def test_an_interrupt_before_anybody_was_tracked_leaves_earlier_results(
    memo_command, write_video, luma_frames, tmp_path, monkeypatch
):
    video, out = write_video("walk.mp4", luma_frames()), tmp_path / "out"
    assert memo_command("track", video, "--out", out)[0] == 0
    earlier = {path.name: path.read_bytes() for path in out.iterdir()}

    def stopped(*_):
        recorded = real(*_)
        recorded.columns = {name: values[:0] for name, values in recorded.columns.items()}
        return dataclasses.replace(recorded, run=(*recorded.run[:3], True))

    real = recording.follow
    monkeypatch.setattr(recording, "follow", stopped)
    code, said, complaint = memo_command("track", video, "--out", out)
    assert (code, said) == (130, "") and "holds the results of an earlier run" in complaint
    assert {path.name: path.read_bytes() for path in out.iterdir()} == earlier


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (OSError(28, "No space left"), 1)])
def test_what_was_found_is_told_though_it_cannot_be_drawn(
    memo_command, write_video, luma_frames, tmp_path, monkeypatch, error, code
):
    def broken(*_, **__):
        raise error

    video = write_video("walk.mp4", luma_frames())
    _, told, _ = memo_command("track", video, "--out", tmp_path / "whole", "--no-plots", "--json")
    monkeypatch.setattr(recording, "draw_overlay", broken)
    found, said, _ = memo_command("track", video, "--out", tmp_path / "out", "--no-plots", "--json")
    assert found == code
    assert (
        json.loads(said)["sentences"] == json.loads(told)["sentences"]
        and (tmp_path / "out" / "run.json").exists()
    )


def test_tables_need_no_second_look_at_the_video(
    memo_command, write_video, luma_frames, tmp_path, monkeypatch
):
    video, out = write_video("walk.mp4", luma_frames()), tmp_path / "out"
    real = recording.follow

    def then_gone(*arguments):
        recorded = real(*arguments)
        video.unlink()
        return recorded

    monkeypatch.setattr(recording, "follow", then_gone)
    code, _, complaint = memo_command("track", video, "--out", out)
    assert code == 1 and "walk.mp4: no such file" in complaint and (out / "track.csv").exists()
    write_video("walk.mp4", luma_frames())
    assert memo_command("track", video, "--out", tmp_path / "other", "--no-overlay")[0] == 0


@pytest.mark.parametrize("absent", ["typer", "av", "matplotlib", "rich"])
def test_without_the_extra_it_says_what_to_install(absent):
    code = f"import sys; sys.modules[{absent!r}] = None; import memo.cli; memo.cli.main()"
    done = subprocess.run([sys.executable, "-c", code, "demo"], capture_output=True, text=True)
    assert done.returncode == 4 and done.stderr.count("\n") == 1
    said, _, command = done.stderr.strip().partition(": pip install ")
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["app"]
    assert absent in said and shlex.split(command) == wanted


def test_base_import_needs_numpy_alone():
    code = "import sys, memo, memo.files, memo.cli; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"av", "matplotlib", "rich", "typer"} & set(loaded.split())


def test_tables_survive_writing(tmp_path, core):
    columns = core.walk(np.arange(9) / 25, core.Camera((160, 120)))
    columns["left_knee_deg"][4] = np.nan
    write_track_csv(tmp_path / "track.csv", columns)
    header = (tmp_path / "track.csv").read_text().splitlines()[0]
    assert header == ",".join(TRACK_COLUMNS)
    back = read_track_csv(tmp_path / "track.csv")
    assert back["frame"].dtype == np.int64
    for name in TRACK_COLUMNS:
        np.testing.assert_allclose(back[name], columns[name], atol=0.005)
    event = {"time_s": 0.25, "frame": 6.25, "event": "toe_off", "side": "left"}
    events = [event | {"walk": 0, "person": 0}, event | {"walk": 2, "person": 1}]
    write_events_csv(tmp_path / "events.csv", events)
    assert read_events_csv(tmp_path / "events.csv") == events


def test_tables_refuse_other_columns(tmp_path, core):
    columns = core.walk(np.arange(3) / 25, core.Camera((160, 120)))
    for broken in (
        {name: columns[name] for name in TRACK_COLUMNS[1:]},
        columns | {"other": columns["x_m"]},
        columns | {"x_m": np.zeros(2)},
    ):
        with pytest.raises(ValueError, match=r"track columns|columns of different lengths"):
            write_track_csv(tmp_path / "track.csv", broken)
    assert not list(tmp_path.iterdir())


def test_a_file_that_fails_half_way_leaves_the_old_one(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(RuntimeError), complete_file(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_ci_runs_the_commands_of_the_readme():
    block = (ROOT / "README.md").read_text().split("```sh\n")[1:3]
    commands = [part.split("```")[0].strip() for part in block]
    run = (ROOT / ".ci" / "run").read_text()
    assert all(command in run for command in commands)


def test_the_python_example_of_the_readme(core, video, monkeypatch, capsys):
    example = (ROOT / "README.md").read_text().split("```python\n")[1].split("```")[0]
    monkeypatch.chdir(video.parent)
    exec(example, {})
    assert "20 frames, tracked." in capsys.readouterr().out and Path("track.csv").exists()


def test_demo_of_the_compiled_core(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "memo.cli", "demo", "--out", str(tmp_path)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    columns = read_track_csv(tmp_path / "track.csv")
    assert len(columns["frame"]) > 20 and "Against the drawn truth" in done.stdout


def test_interrupt_of_the_compiled_core(tmp_path):
    clip, started = shared_video("mocap_a"), tmp_path / "started"
    options = ["--camera", clip / "camera.toml", "--height", "1.86", "--out", tmp_path / "out"]
    process = subprocess.Popen(
        [sys.executable, "-c", TELLS_FRAME_50, started, "track", clip / "video.mp4", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    code, complaint = interrupted(process, started.exists, after_s=0)
    assert code == 130 and complaint.count("\n") == 1 and "interrupted" in complaint
    frames = read_track_csv(tmp_path / "out" / "track.csv")["frame"]
    assert frames[0] <= 12 and 45 <= frames[-1] < 90, "the walk up to the interrupt, not to its end"
    assert {path.name for path in (tmp_path / "out").iterdir()} == TABLES


def test_a_frame_that_fails_costs_only_what_follows(tmp_path):
    clip = tmp_path / "frames"
    clip.mkdir()
    scene = memo.demo_scene(seed=1, frames=60)
    for index, frame in enumerate([*scene.frames, np.zeros((240, 320), np.uint8)]):
        picture = av.VideoFrame.from_ndarray(frame, format="gray")
        with av.open(str(clip / f"{index:03d}.png"), "w", format="image2", options={"update": "1"}) as file:
            stream = file.add_stream("png", rate=1)
            stream.width, stream.height, stream.pix_fmt = frame.shape[1], frame.shape[0], "gray"
            file.mux(stream.encode(picture))
            file.mux(stream.encode(None))
    out = tmp_path / "out"
    command = [sys.executable, "-c", "import memo.cli; memo.cli.main()", "track", str(clip), "--fps", "25"]
    done = subprocess.run([*command, "--out", str(out)], capture_output=True, text=True)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "the tables hold what was tracked until then" in done.stderr
    assert len(read_track_csv(out / "track.csv")["frame"]) > 40
