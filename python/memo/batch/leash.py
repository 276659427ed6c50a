"""The child process of a run: `python -m memo.batch.leash track ARGUMENTS --out FOLDER --json`.

Tracks one video as `memo track` does, but ends with its parent process, however that ended: where the kernel
supports it (Linux), the kernel kills the child; everywhere, its standard input, a pipe, reports that the
other end is closed. It needs nothing of the command line: only `av`, and matplotlib for plots. An error that
is not a mistake in the input has its own exit code.
"""

import contextlib
import json
import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from memo.batch.manifest import Row
from memo.batch.task import DEFECT, OUT_OF_MEMORY
from memo.exits import Exit
from memo.extras import install
from memo.files import plain
from memo.given import frame_range, heights, place_in_frame, tracker_options

_READING = ("name", "unit", "size", "v_up")


def main() -> None:
    """Runs the arguments of this process."""
    _hold_on_to_parent()
    _go_first_when_memory_ends()
    try:
        raise SystemExit(_track(sys.argv[1:]))
    except MemoryError:
        _complain("out of memory")
        raise SystemExit(OUT_OF_MEMORY) from None
    except Exception:
        traceback.print_exc()
        raise SystemExit(DEFECT) from None


def _track(arguments: Sequence[str]) -> Exit:
    """Tracks a video; prints the findings as JSON, and remarks and mistakes of the input as lines."""
    if absent := [name for name in ("av", "matplotlib") if find_spec(name) is None]:
        _complain(f"a video needs {', '.join(absent)}: {install('app', *absent)}")
        return Exit.NO_EXTRA
    from memo.recording import Recording, track_recording

    command, *given, flag, out, as_json = arguments
    if (command, flag, as_json) != ("track", "--out", "--json"):
        raise RuntimeError(f"expected track ARGUMENTS --out FOLDER --json, got {arguments}")
    video, found = Row.of_arguments(given)
    options: dict[str, Any] = dict(found)
    try:
        reading = {name: options.pop(f"camera_{name}", None) for name in _READING}
        height_m, camera = options.pop("height_m", None), options.pop("camera", None)
        tall = None if height_m is None else heights(str(height_m))
        steady, treadmill = options.pop("steady", True), options.pop("treadmill", None)
        follow = options.pop("follow", None)
        recording = Recording(
            video,
            tracker_options(tall, camera, reading, options.pop("fov_deg", None), steady, treadmill),
            frame_range(options.pop("frames", ":")),
            page=options.pop("report", False),
            follow=None if follow is None else place_in_frame(follow),
            camera_file=camera,
            **options,
        )
        recorded = track_recording(recording, Path(out), remark=_complain)
    except (ValueError, TypeError, OSError, OverflowError) as error:
        if os.environ.get("MEMO_DEBUG"):
            raise
        _complain(" ".join(str(error).split()))
        return Exit.BAD_INPUT
    files = [str(path) for path in recorded.written]
    print(json.dumps(plain({**recorded.document, "not_there": recorded.not_there, "files": files})))
    return recorded.exit


def _complain(message: str) -> None:
    print(f"memo: {message}", file=sys.stderr)


def _hold_on_to_parent() -> None:
    if sys.platform == "linux":
        import ctypes

        pr_set_pdeathsig = 1  # linux/prctl.h
        with contextlib.suppress(OSError, AttributeError):  # a C library without prctl
            ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL, 0, 0, 0)
    threading.Thread(target=_end_with_stdin, daemon=True).start()


def _end_with_stdin() -> None:
    """Waits for the other end of standard input to close, which happens whenever the parent ends."""
    with contextlib.suppress(OSError):
        while os.read(0, 4096):
            pass
    os._exit(1)


def _go_first_when_memory_ends() -> None:
    """If the machine runs out of memory, the kernel ends this process rather than its parent."""
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("500")


if __name__ == "__main__":
    main()
