"""Fixtures: the stand-in core, small videos written for one test, and where the development footage lies."""

import os
import signal
import sys
from fractions import Fraction
from pathlib import Path

import av
import fake_core
import memo
import numpy as np
import pytest
from hypothesis import settings
from memo import cli

#: Third-party footage with ground truth; not part of this repository.
SHARED_DATA = Path(
    os.environ.get("MEMO_SHARED_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data"
)

# The same cases every time, as for the property tests in Rust; others: `pytest --hypothesis-profile=default`.
settings.register_profile("repeatable", derandomize=True, database=None)
settings.load_profile("repeatable")

# Started in the background by a script, Python is told to ignore Ctrl-C, and so would be what tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_xdist_make_scheduler(config, log):
    """Tests of a file run in one process: what several of them need is made once. Files keep their order."""
    from xdist.scheduler import LoadFileScheduling

    config.option.loadscopereorder = False
    return LoadFileScheduling(config, log)


def shared_video(name):
    """The folder of a clip of the shared footage; skips the test where it is absent."""
    folder = SHARED_DATA / "video" / name
    if not folder.is_dir():
        pytest.skip(f"no footage in {folder} (set MEMO_SHARED_DATA)")
    return folder


def ran(*arguments):
    """Runs `memo ARGUMENTS` in this process, without an error."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["memo", *map(str, arguments)])
        with pytest.raises(SystemExit) as exited:
            cli.main()
    assert not exited.value.code


def grey_video(path, frames, rate=25):
    """Writes frames, unchanged (lossless), as a grey video; returns its path."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=rate, options={"qp": "0", "preset": "ultrafast"})
        stream.height, stream.width = frames[0].shape
        stream.pix_fmt = "gray"
        for frame in frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="gray")))
        container.mux(stream.encode(None))
    return path


def opencv_pixels(table, points):
    """Pixels (N, 2) of points (N, 3) by OpenCV, from the keys of a camera.toml."""
    cv2 = pytest.importorskip("cv2")
    keys = ("rotation", "translation", "matrix", "distortions")
    pixels, _ = cv2.projectPoints(points, *(np.array(table[key]) for key in keys))
    return pixels.reshape(-1, 2)


@pytest.fixture
def core(monkeypatch):
    """Puts the stand-in core in place of the compiled one."""
    for name, part in fake_core.PARTS.items():
        monkeypatch.setattr(memo, name, part, raising=False)
    return fake_core


@pytest.fixture
def memo_command(monkeypatch, capsys):
    """Runs `memo ARGUMENTS` in this process; gives the exit code, what it printed and what it complained."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["memo", *map(str, arguments)])
        with pytest.raises(SystemExit) as exited:
            cli.main()
        said = capsys.readouterr()
        return exited.value.code or 0, said.out, said.err

    return run


@pytest.fixture
def luma_frames():
    """Makes (count, height, width) grey values that differ in every frame and have no symmetry."""

    def make(count=8, size=(50, 36), seed=0):
        width, height = size
        v, u = np.mgrid[:height, :width]
        ramp = 20 + 3 * u + v + (5 * np.arange(count) % 30)[:, None, None]
        noise = np.random.default_rng(seed).integers(0, 8, (count, height, width))
        return (ramp + noise).clip(16, 235).astype(np.uint8)

    return make


@pytest.fixture
def write_video(tmp_path):
    """Writes grey values, unchanged (lossless), as the luma plane of a video; returns its path."""

    def write(name, luma, *, times_s=None, rate=25, codec="libx264", options=None, **open_options):
        path = tmp_path / name
        options = {"qp": "0", "g": "5"} | (options or {}) if codec == "libx264" else {}
        with av.open(str(path), "w", **open_options) as container:
            stream = container.add_stream(codec, rate=rate, options=options)
            stream.height, stream.width = luma.shape[1:]
            stream.pix_fmt = "yuv420p"
            if times_s is not None:
                stream.codec_context.time_base = Fraction(1, 90000)
            for index, plane in enumerate(luma):
                chroma = np.full((plane.shape[0] // 2, plane.shape[1]), 100, np.uint8)
                frame = av.VideoFrame.from_ndarray(np.vstack([plane, chroma]), format="yuv420p")
                if times_s is None:
                    frame.pts, frame.time_base = index, Fraction(1, rate)
                else:
                    frame.pts, frame.time_base = round(times_s[index] * 90000), Fraction(1, 90000)
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
        return path

    return write
