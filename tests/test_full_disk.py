"""A disk that is full, or becomes full, is told in one line and leaves nothing half written."""

import resource
import shutil
import subprocess
import sys
from collections import namedtuple

import pytest
from memo import cli

COMMAND = [sys.executable, "-m", "memo.cli"]


def test_a_full_disk_is_told_before_work_starts(monkeypatch, tmp_path, capsys):
    usage = namedtuple("usage", "total used free")(10**9, 10**9, 5000)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    monkeypatch.setattr(sys, "argv", ["memo", "demo", "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert stopped.value.code == 1
    assert "the disk is full (4 kB free)" in capsys.readouterr().err
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize(("command", "most_bytes"), [("demo", 0), ("pointlight", 3_000), ("demo", 60_000)])
def test_a_disk_that_becomes_full_leaves_whole_files_alone(tmp_path, command, most_bytes):
    """No file can grow beyond so many bytes, as on a disk that is filling up."""

    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    out = tmp_path / "out"
    done = subprocess.run(
        [*COMMAND, command, "--out", str(out)],
        preexec_fn=limited,
        capture_output=True,
        text=True,
        timeout=100,
    )
    assert done.returncode == 1, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert "Traceback" not in done.stderr
    left = list(out.iterdir()) if out.exists() else []
    assert [path.name for path in left if path.name.startswith(".")] == []
    for path in left:
        assert 0 < path.stat().st_size <= most_bytes
        if path.suffix == ".csv":
            assert path.read_text().endswith("\n")


def test_earlier_tables_stay_together_if_new_ones_do_not_fit(
    write_video, luma_frames, tmp_path, monkeypatch, core
):
    """Not some of this run beside others of that."""
    out, video = tmp_path / "out", write_video("walk.mp4", luma_frames())
    memo_track = ["track", str(video), "--out", str(out), "--no-overlay", "--no-plots"]

    def run(height):
        monkeypatch.setattr(sys, "argv", ["memo", *memo_track, "--height", height])
        with pytest.raises(SystemExit) as stopped:
            cli.main()
        return stopped.value.code or 0

    assert run("1.60") == 0
    earlier = {path.name: path.read_bytes() for path in out.iterdir()}

    def full(path, *_):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("memo.recording.write_cycles_csv", full)
    assert run("1.86") == 1
    assert {path.name: path.read_bytes() for path in out.iterdir()} == earlier
