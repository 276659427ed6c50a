"""What the exit codes of `memo` mean."""

from __future__ import annotations

from enum import IntEnum

__all__ = ["Exit"]


class Exit(IntEnum):
    """What the exit codes mean."""

    TRACKED = 0
    DONE = 0  # where nobody is to be tracked
    BAD_INPUT = 1
    NOBODY = 3  # or no posture of anybody
    NO_EXTRA = 4
    SOME_FAILED = 5  # of many videos
    IMPOSSIBLE = 6  # every posture of a motion breaks a constraint
    INTERRUPTED = 130
    PIPE_CLOSED = 141  # nobody reads what is printed any more, as a shell says it
