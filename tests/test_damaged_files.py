"""Damaged files of keypoints and tables: read, or refused with the format's error, soon and in little memory.

Each format is tried in a process of its own, with bounded memory, so that a crash of a library is a failed
test too. `MEMO_FULL=1 pytest tests/test_damaged_files.py` tries 100,000 files a format.
"""

import json
import os
import random
import resource
import shutil
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from memo.formats import FormatError
from memo.formats.motchallenge import read_motchallenge
from memo.formats.parquet import read_parquet, write_parquet
from memo.keypoints import (
    Keypoints,
    KeypointsError,
    layouts,
    read_keypoints,
    write_coco,
    write_csv,
    write_openpose,
)

FILES = 100_000 if os.environ.get("MEMO_FULL") else 200
LONGEST_S = 3.0  # of the processor, for one file of a few kilobytes
MOST_MEMORY = 3 << 30
MOST_RESIDENT_KB = 400 << 10

TOKENS = (
    *(b"9", b"-", b"e9", b"[", b"]", b"{", b"}", b",", b":", b'"', b"\n", b"\r", b"\t", b"null", b"true"),
    *(b"NaN", b"-Infinity", b"1e999", b"1e308", b"9" * 400, b"0", b"-1", b"1.5", b"0x1F", b"1_0", b"\x00"),
    *(b"\xff", b"\xc3\x28", b"\xed\xa0\x80", b"\xef\xbb\xbf", b"\xe2\x80\xa8", b"[" * 3000, b'{"a":' * 2000),
    *(b'"people":[],', b'"image_id":7,', b'"keypoints":{},', b"\\ud800", b"\\u0000", b"'", b'"""', b";"),
)


def walker(layout, count=2):
    """A standing figure of random points, moving to the right."""
    rng = np.random.default_rng(7)
    points = rng.uniform(100, 500, (count, len(layouts()[layout]), 2)).round(2)
    return Keypoints.from_arrays(points, np.full(points.shape[:2], 0.5), names=layout, fps=25)


def good_file(name, folder):
    """A small good file of a format, bytes."""
    path = folder / "good"
    if name == "openpose":
        write_openpose(path, walker("BODY_25"))
        return min(path.iterdir()).read_bytes()
    if name == "results":
        write_coco(path, walker("COCO_17"))
    elif name == "annotations":
        write_coco(path, walker("COCO_17"))
        images = [{"id": 0, "width": 640, "height": 480}]
        path.write_text(json.dumps({"images": images, "annotations": json.loads(path.read_bytes())}))
    elif name == "by_image":
        write_openpose(path, walker("COCO_18"))
        return b'{"0.jpg":' + min(path.iterdir()).read_bytes() + b',"1.jpg":{"version":"v","people":[]}}'
    elif name == "wide":
        write_csv(path, walker("MOCAP_12"))
    elif name == "long":
        rows = [
            f"{t};{joint};{9 * t + k}.5;{k};0.5"
            for t in range(4)
            for k, joint in enumerate(("LKN", "RKN", "C7"))
        ]
        path.write_text("\n".join(["time_s;joint;x;y;score", *rows, ""]))
    elif name == "trc":
        from detector_files import SPORTS2D, trc_text

        values = np.random.default_rng(7).uniform(10, 900, (3, len(SPORTS2D), 2))
        path.write_text(trc_text(SPORTS2D, values))
    elif name == "motchallenge":
        path.write_text("".join(f"{t},1,10.5,20.25,30,90,0.5,{t / 10},2.5,0.0000\n" for t in range(1, 9)))
    elif name == "parquet":
        columns = {"frame": np.arange(20), "x_m": np.linspace(0, 1, 20), "ok": np.arange(20) % 2 == 0}
        texts = {"side": np.array(["right", "left"] * 10), "n": np.array([1, ""] * 10, object)}
        write_parquet(path, columns | texts)
    return path.read_bytes()


READERS = {
    **dict.fromkeys(
        ("openpose", "results", "annotations", "by_image", "wide", "long", "trc"),
        (read_keypoints, KeypointsError),
    ),
    "motchallenge": (read_motchallenge, FormatError),
    "parquet": (read_parquet, FormatError),
}


def damaged(good, rng, binary):
    """The bytes with one to four edits; of binary files, half in the last 800 bytes: Parquet's footer."""
    data = bytearray(good)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        at = rng.randrange(len(data) + 1)
        if binary and rng.random() < 0.5:
            at = max(0, len(data) - rng.randrange(800))
        kind = rng.random()
        if binary and rng.random() < 0.7 and at < len(data):
            data[at] ^= 1 << rng.randrange(8)
        elif kind < 0.05:
            del data[at:]
        elif kind < 0.25:
            del data[at : at + rng.choice((1, 2, 5, 20, 100))]
        elif kind < 0.40 and at < len(data):
            data[at] = rng.choice((data[at] ^ (1 << rng.randrange(8)), rng.randrange(256), 0, 127, 255))
        elif kind < 0.55:
            start = rng.randrange(len(data) + 1)
            data[at:at] = data[start : start + rng.choice((1, 5, 30, 200, 1000))]
        elif kind < 0.60:
            data[:0] = rng.choice((b"\xef\xbb\xbf", b"\xff\xfe", b" ", b"\n"))
        elif binary:
            data[at:at] = rng.randbytes(rng.randrange(1, 9))
        elif kind < 0.8:
            data[at : at + rng.randrange(2)] = str(rng.randrange(10)).encode()
        else:
            token = rng.choice(TOKENS)
            data[at : at + rng.choice((0, 0, 1, len(token)))] = token
    return bytes(data)


def try_files(name, count, folder, seed=1):
    """Reads so many damaged files; how many were read and how many refused. All else is raised."""
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    read, error_kind = READERS[name]
    good = good_file(name, folder)
    rng = random.Random(f"{name} {seed}")
    path = folder / "in"
    if name == "openpose":
        path.mkdir()
    file = (
        path / "a_1.json" if name == "openpose" else path.with_suffix(".parquet" if name == "parquet" else "")
    )
    options = {"fps": 25} if read is read_keypoints else {}
    counts = Counter()
    for _ in range(count):
        data = damaged(good, rng, name == "parquet")
        file.write_bytes(data)
        start = time.process_time()
        try:
            found = read(path if name == "openpose" else file, **options)
            counts["read"] += 1
            if read is read_keypoints:
                assert found.points.size < 1_000_000 and np.isfinite(found.scores).all()
                assert not np.isinf(found.points).any() and np.isfinite(found.times_s).all()
                write_again(found, folder, counts)
        except error_kind as error:
            counts["refused"] += 1
            assert "\n" not in str(error) and str(path) in str(error) and len(str(error)) < 1000, error
        except BaseException:
            (folder / "failed").write_bytes(data)
            raise
        took = time.process_time() - start
        assert took < LONGEST_S, f"{took:.1f} s for {data[:200]!r}"
    return counts


def write_again(found, folder, counts):
    """What was read, with points exchanged, written like the file and as a table, and read again."""
    changed = found.replaced(np.roll(found.points, 1, axis=1), np.roll(found.scores, 1, axis=1))
    write_csv(folder / "table", changed)
    table = read_keypoints(folder / "table")
    np.testing.assert_array_equal(table.points, zero_is_missing(changed.points))
    (folder / "table").unlink()  # replacing a file waits for the disk
    out = folder / "out_px"
    try:
        changed.write(out)
    except KeypointsError as error:
        assert "no person to write points to" in str(error)  # a person without any of the points
        counts["not written"] += 1
        return
    again = read_keypoints(out, fps=25, layout=found.layout)
    if found.people.max() == 1:
        np.testing.assert_array_equal(again.points, changed.points)
    shutil.rmtree(out) if out.is_dir() else out.unlink()


def zero_is_missing(points):
    return np.where((points == 0).all(axis=2, keepdims=True), np.nan, points)


@pytest.mark.parametrize("name", READERS)
def test_damaged_files_are_read_or_refused(tmp_path, name):
    done = subprocess.run(
        [sys.executable, __file__, name, str(FILES), str(tmp_path)], capture_output=True, text=True
    )
    assert done.returncode == 0, f"exit code {done.returncode}: {done.stderr[-2000:]}"
    told = json.loads(done.stdout)
    print(name, told)
    assert (
        told["read"] + told["refused"] == FILES
        and told.get("not written", 0) < told["read"] / 4
        and told["read"]
        and told["refused"]
    )
    assert told["resident_kb"] < MOST_RESIDENT_KB


def peak_kb():
    """Most memory this process had; not `ru_maxrss`, which begins with that of the process before exec."""
    try:
        status = Path("/proc/self/status").read_text()
    except OSError:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return int(next(line for line in status.splitlines() if line.startswith("VmHWM")).split()[1])


if __name__ == "__main__":
    tried = try_files(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
    print(json.dumps(tried | {"resident_kb": peak_kb()}))
