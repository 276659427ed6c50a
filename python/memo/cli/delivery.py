"""How a command delivers: exit codes, folders of results, messages, progress, interrupts.

The base install needs only numpy, so everything from the `app` extra is imported inside functions.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from memo.exits import Exit
from memo.files import plain
from memo.given import UsageError

if TYPE_CHECKING:
    from rich.console import Console

    from memo.video import Frame


@dataclass(frozen=True)
class Delivery:
    """Where results are written, which of them, and how much is printed."""

    out: Path
    overlay: bool = True
    plots: bool = True
    as_json: bool = False
    quiet: bool = False

    @property
    def talks(self) -> bool:
        """Whether results are printed as sentences."""
        return not (self.quiet or self.as_json)

    def tell(
        self,
        summary: Mapping[str, Any],
        lines: Iterable[str],
        written: Sequence[Path],
        alarm: str | None = None,
    ) -> None:
        """Prints what was found and written: as JSON, as `lines` and file names, or not at all.

        An `alarm` is printed before the lines, in red on a terminal.
        """
        if self.as_json:
            print(json.dumps(plain({**summary, "files": [str(path) for path in written]})))
        elif self.talks:
            if alarm is not None:
                _print_red(alarm)
            for line in lines:
                print(line)
            print(f"Written to {self.out}: {', '.join(path.name for path in written)}.")


def _print_red(line: str) -> None:
    from rich.console import Console

    Console(soft_wrap=True).print(line, style="bold red", markup=False, highlight=False)


def guarded(work: Callable[[], Exit]) -> Exit:
    """Runs a command and prints a user's mistake as one line. With MEMO_DEBUG set, the traceback is kept.

    Wrong usage of options has an exit code of its own.

    A closed pipe passes through to `main`, which handles it.
    """
    from memo.video import VideoDamageWarning

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VideoDamageWarning)  # damage is reported in one line instead
            return work()
    except BrokenPipeError:
        raise
    except (ValueError, TypeError, OSError, OverflowError) as error:
        if os.environ.get("MEMO_DEBUG"):
            raise
        complain(" ".join(str(error).split()))
        return Exit.WRONG_USAGE if isinstance(error, UsageError) else Exit.BAD_INPUT
    except KeyboardInterrupt:
        complain("interrupted")
        return Exit.INTERRUPTED


def complain(message: str) -> None:
    print(f"memo: {message}", file=sys.stderr)


def with_progress(
    frames: Iterable[Frame], what: str, count: int | None, delivery: Delivery
) -> Iterator[Frame]:
    """Yields the same frames; on a terminal, shows a bar with the time left."""
    from rich.progress import track

    console = terminal(delivery)
    yield from track(frames, what, total=count, console=console, transient=True, disable=console is None)


def with_elapsed(what: str, delivery: Delivery) -> contextlib.AbstractContextManager[object]:
    """During one step of unknown length: on a terminal, shows its name and the time elapsed."""
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = terminal(delivery)
    if console is None:
        return contextlib.nullcontext()
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    progress = Progress(*columns, console=console, transient=True)
    progress.add_task(what, total=None)
    return progress


@contextlib.contextmanager
def with_count(what: str, delivery: Delivery) -> Iterator[Callable[[int, int | None], None]]:
    """Yields a callback for the `progress` of a long call; on a terminal, shows a bar with the time left."""
    from rich.progress import Progress

    console = terminal(delivery)
    with Progress(console=console, transient=True, disable=console is None) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


@contextlib.contextmanager
def with_steps(delivery: Delivery) -> Iterator[Callable[..., None]]:
    """Yields a callback for the `progress` of a call of several steps. It takes the name of the step and, if
    known, the amount done and the total; on a terminal, these and the time since the start are shown."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = terminal(delivery)
    columns = (BarColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=console is None) as progress:
        task = progress.add_task("", total=None)

        def show(step: str, done: int = 0, total: int | None = None) -> None:
            # Set on the task: `update` cannot reset a total once known.
            progress.tasks[0].total = total
            progress.update(task, description=step, completed=done)

        yield show


def terminal(delivery: Delivery) -> Console | None:
    """The terminal that shows progress, if there is one and progress is wanted."""
    from rich.console import Console

    console = Console(stderr=True)
    return None if delivery.quiet or not console.is_terminal else console


class Interrupt(contextlib.AbstractContextManager["Interrupt"]):
    """Turns the first Ctrl-C, or request to end, into one of its own, so that no frame is half processed; a
    second one acts as usual."""

    def __init__(self) -> None:
        self.requested: bool = False

    def __enter__(self) -> Interrupt:
        ends = (signal.SIGINT, signal.SIGTERM)
        self._before = {end: signal.signal(end, self._request) for end in ends}
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()

    def _request(self, *_: object) -> None:
        self.requested = True
        self._restore()

    def _restore(self) -> None:
        for end, before in self._before.items():
            signal.signal(end, before)
