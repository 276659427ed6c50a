"""The meaning of the exit codes of `memo`."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["Exit"]


class Exit(IntEnum):
    """The meaning of the exit codes."""

    TRACKED = 0
    DONE = 0  # for commands that track nobody
    BAD_INPUT = 1
    WRONG_USAGE = 2  # of options; also Typer's own
    NOBODY = 3  # or no posture is left
    NO_EXTRA = 4
    SOME_FAILED = 5  # some of many videos failed
    IMPOSSIBLE = 6  # every posture of a motion breaks a constraint
    INTERRUPTED = 130
    PIPE_CLOSED = 141  # the reader of the output has ended; the code that a shell uses
