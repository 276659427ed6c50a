"""The child's side of a run: `python -m memo.batch.leash ARGUMENTS OF memo`.

Runs `memo` so that it ends with the process that started it, however that ended: the kernel kills it where it
knows how (Linux), and everywhere its standard input, a pipe, reports the other end closed. What is no mistake
in the input ends with an exit code of its own.
"""

import contextlib
import os
import signal
import sys
import threading
import traceback
from pathlib import Path

from memo.batch.task import DEFECT, OUT_OF_MEMORY


def main() -> None:
    """Runs `memo` with the arguments of this process."""
    _hold_on_to_parent()
    _go_first_when_memory_ends()
    sys.argv = ["memo", *sys.argv[1:]]
    try:
        from memo.cli import main as memo

        memo()
    except MemoryError:
        print("memo: out of memory", file=sys.stderr)
        raise SystemExit(OUT_OF_MEMORY) from None
    except Exception:
        traceback.print_exc()
        raise SystemExit(DEFECT) from None


def _hold_on_to_parent() -> None:
    if sys.platform == "linux":
        import ctypes

        pr_set_pdeathsig = 1  # linux/prctl.h
        with contextlib.suppress(OSError, AttributeError):  # a C library without prctl
            ctypes.CDLL(None).prctl(pr_set_pdeathsig, signal.SIGKILL, 0, 0, 0)
    threading.Thread(target=_end_with_stdin, daemon=True).start()


def _end_with_stdin() -> None:
    """Waits for the other end of standard input to close, as it does whenever the parent ends."""
    with contextlib.suppress(OSError):
        while os.read(0, 4096):
            pass
    os._exit(1)


def _go_first_when_memory_ends() -> None:
    """Where the machine runs out of memory, the kernel shall end this process, not its parent."""
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("500")


if __name__ == "__main__":
    main()
