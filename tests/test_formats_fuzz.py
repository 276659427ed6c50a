"""Damaged motion files: every one is read or refused by a `FormatError`, in bounded time and memory.

Each format is tried in a process of its own, whose memory is limited; a file that takes seconds ends it.
MEMO_FULL=1 tries 100,000 files a format: `MEMO_FULL=1 pytest -s tests/test_formats_fuzz.py`.
"""

import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from memo.files import TRACK_COLUMNS, write_track_csv
from memo.formats import FormatError, read_motion, write_motion
from motions import walk
from test_formats_c3d import older

ENDINGS = ("bvh", "c3d", "csv", "mot", "trc", "track.csv")
COUNT = 100_000 if os.environ.get("MEMO_FULL") else 250
MEMORY = 1 << 30  # bytes beyond what the process has at the start
SECONDS = 5.0

WORDS = (
    *("nan", "inf", "-inf", "1e400", "-1e308", "1e30", "999999999999999999999", "-1", "0", "0.0", "1_0", "٣"),
    *("", "{", "}", "\t", "\n", ",", '"', "#", "=", ":", "\0", "é", "x" * 5000, "NumFrames", "endheader"),
    *("MOTION", "End Site", "JOINT a {", "ROOT b", "OFFSET", "CHANNELS 6", "Frames: 2147483648", "nRows=1e9"),
)
NUMBERS = (b"\0", b"\xff", b"\x7f", b"\x80", b"\xff\xff", b"\xff\x7f", b"\0\x80", b"\xff\xff\xff\x7f")
NUMBERS += tuple(np.array(x, "<f4").tobytes() for x in (np.nan, np.inf, -1e38, 1e38, 0, -1, 1e-40))


def mutated(data, rng, is_text):
    """The same file with one to four damages."""
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        size = len(data)
        if not size:
            break
        # Half of all damage goes where the sizes are.
        at = rng.randrange(min(size, 2000) if rng.random() < 0.5 else size)
        span = rng.choice((1, 2, 8, 64, 512))
        kind = rng.randrange(8 if is_text else 6)
        if kind == 0:
            for _ in range(rng.randint(1, 8)):
                data[rng.randrange(size)] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del data[at:]
        elif kind == 2:
            data[at:at] = rng.randbytes(span)
        elif kind == 3:
            del data[at : at + span]
        elif kind == 4:
            data[at:at] = data[at : at + span] * rng.choice((1, 2, 50))
        elif kind == 5:
            number = rng.choice(NUMBERS)
            data[at : at + len(number)] = number
        elif kind == 6:  # another word
            between = rng.choice((b" ", b"\t", b",", b"\n"))
            words = data.split(between)
            words[rng.randrange(min(len(words), 60))] = rng.choice(WORDS).encode()
            data = bytearray(between.join(words))
        else:  # lines exchanged, repeated or gone
            lines = data.split(b"\n")
            a, b = rng.randrange(min(len(lines), 40)), rng.randrange(len(lines))
            lines[a : a + rng.randint(0, 1)] = [lines[b]] * rng.choice((0, 1, 1, 30))
            data = bytearray(b"\n".join(lines))
    return bytes(data)


def try_many(ending, count, seed, bases):
    """Reads damaged files; prints how many were read and how many refused, and the longest time of one."""

    def too_long(*_):
        raise TimeoutError(f"more than {SECONDS} s")

    before = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (before + MEMORY, resource.RLIM_INFINITY))
    signal.signal(signal.SIGALRM, too_long)
    warnings.simplefilter("error")
    rng = random.Random(seed)
    done, longest = {"read": 0, "refused": 0}, 0.0
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as folder:
        path = Path(folder, ending if ending == "track.csv" else f"damaged.{ending}")
        for number in range(count):
            data = mutated(bases[number % len(bases)], rng, ending != "c3d")
            path.write_bytes(data)
            signal.setitimer(signal.ITIMER_REAL, SECONDS)
            begun = time.perf_counter()
            try:
                motion = read_motion(path)
                assert np.isfinite(motion.times_s).all() and not np.isinf(motion.points).any()
                done["read"] += 1
                with contextlib.suppress(FormatError):
                    motion.at_constant_rate()
                with contextlib.suppress(FormatError):
                    motion.resampled(30)
            except FormatError as error:
                message = str(error)
                assert "\n" not in message and message.startswith(f"{path}: ")
                assert "memory" not in message, message
                done["refused"] += 1
            except BaseException:
                kept = Path(tempfile.gettempdir(), f"memo-fuzz-{number}.{ending}")
                kept.write_bytes(data)
                print(f"file {number}, kept as {kept}", file=sys.stderr)
                raise
            finally:
                signal.setitimer(signal.ITIMER_REAL, 0)
            longest = max(longest, time.perf_counter() - begun)
    print(done["read"], done["refused"], f"{longest:.3f}")


def whole_files(folder, ending):
    """Small files without damage; of C3D also those of other processors."""
    if ending == "track.csv":
        columns = {name: np.arange(6.0) for name in TRACK_COLUMNS}
        columns |= {"frame": np.arange(6), "walk": np.array([0, 0, 0, 1, 1, 1]), "person": np.zeros(6, int)}
        write_track_csv(folder / "whole.csv", columns)
        return [(folder / "whole.csv").read_bytes()]
    files = []
    for motion in (walk(12, gaps=False), walk(5, rate_hz=100, gaps=False)):
        for up in ("z", "y"):
            write_motion(folder / f"whole.{ending}", motion, up)
            files.append((folder / f"whole.{ending}").read_bytes())
    if ending == "c3d":
        files += [older(files[0], processor, whole) for processor in (84, 85, 86) for whole in (False, True)]
    return files


@pytest.mark.parametrize("ending", ENDINGS)
def test_damaged_files_are_read_or_refused(tmp_path, ending):
    for k, data in enumerate(whole_files(tmp_path, ending)):
        (tmp_path / f"{k}.{ending}").write_bytes(data)
    code = f"import test_formats_fuzz as f; f.main({ending!r}, {COUNT}, {str(tmp_path)!r})"
    child = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=Path(__file__).parent, check=False
    )
    assert child.returncode == 0, child.stderr[-2000:]
    read, refused, longest = child.stdout.split()
    print(f"{ending}: {read} read, {refused} refused, longest {longest} s")
    assert int(read) + int(refused) == COUNT and int(read) > 0 and int(refused) > COUNT // 3


def main(ending, count, folder):
    bases = [path.read_bytes() for path in sorted(Path(folder).glob(f"[0-9].{ending}"))]
    try_many(ending, count, 7, bases)
