"""Tracks one video in its own process, so that no failure affects other videos."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from memo._memo import __version__
from memo.batch.folder import BatchError, OutFolder, Record

__all__ = ["DEFECT", "OUT_OF_MEMORY", "Task", "perform"]

DEFECT = 70
OUT_OF_MEMORY = 71
"""Exit codes of the child besides those of `memo`: an unexpected exception; out of memory."""

_THREADS = ("RAYON_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
_COMMAND = (sys.executable, "-m", "memo.batch.leash")
_LOOK_AT_MEMORY_S = 0.1
_LOOK_S = 0.5  # interval at which a waiting process checks that its run still exists


@dataclass(frozen=True)
class Task:
    """All that a worker, perhaps on another machine, needs to do one video."""

    name: str
    arguments: tuple[str, ...]
    """Arguments of `memo track`, without the folder of results."""
    fingerprint: dict[str, Any]
    attempt: int
    folder: OutFolder
    run: str
    timeout_s: float | None = None
    memory_mb: int | None = None
    threads: int = 1
    command: tuple[str, ...] | None = None


class _Stopped(Exception):
    """The run of this video has ended."""


def perform(task: Task) -> Record | None:
    """Does one video and records its outcome; `None` if the run was stopped before.

    On success the folder of results is complete under its final name before a record of it exists; otherwise
    there is no such folder. Raises `BatchError` if the disk or the system does not allow it.
    """
    try:
        return _perform(task)
    except OSError as error:
        if task.folder.is_current(task.run):
            raise BatchError(f"{task.name}: {' '.join(str(error).split())}") from None
        return None  # the run has ended and removed its files


def _perform(task: Task) -> Record | None:
    if not task.folder.is_current(task.run):
        return None
    task.folder.forget(task.name)
    unfinished = task.folder.unfinished()
    try:
        return _tracked(task, unfinished / "results")
    finally:  # also if the run has ended and cleaned up before this folder existed
        shutil.rmtree(unfinished, ignore_errors=True)


def _tracked(task: Task, results: Path) -> Record | None:
    """Runs the child, and moves its results and its record into place."""
    start = time.monotonic()
    with tempfile.TemporaryFile() as said, open(task.folder.log(task.name), "w+b") as complaints:
        command = [*(task.command or _COMMAND), "track", *task.arguments, "--out", str(results), "--json"]
        try:
            code = _watch(task, command, said, complaints, start)
        except _Stopped:
            return None
        said_text, complaint_text = _read(said), _read(complaints)
    state, message = _verdict(task, code, complaint_text)
    walks: int | None = None
    remarks: list[str] = []
    if state in ("done", "nobody") and not (results / "track.csv").is_file():
        state, message = "crashed", "it ended without an error and without track.csv"
    elif state in ("done", "nobody"):
        walks, message, remarks = _told(said_text, complaint_text)
        if state == "nobody" and walks:  # tracked, but at another place
            state, walks = "elsewhere", 0
    if not task.folder.is_current(task.run):
        return None
    if state in ("done", "nobody", "elsewhere"):
        task.folder.place(results, task.name)
    record = Record(
        name=task.name,
        state=state,
        message=message,
        seconds=round(time.monotonic() - start, 3),
        attempt=task.attempt,
        memo=__version__,
        fingerprint=task.fingerprint,
        walks=walks,
        remarks=remarks,
    )
    task.folder.write_record(record)
    if not task.folder.log(task.name).stat().st_size:
        task.folder.log(task.name).unlink()
    return record


def _watch(
    task: Task, command: Sequence[str], said: IO[bytes], complaints: IO[bytes], start: float
) -> int | str:
    """Runs the command; returns its exit code, minus the signal that killed it, or the limit it exceeded."""
    threads = dict.fromkeys(_THREADS, str(task.threads))
    look_s = _LOOK_S if task.memory_mb is None else _LOOK_AT_MEMORY_S
    with _started(command, said, complaints, {**os.environ, **threads}) as child:
        while True:
            try:
                return child.wait(look_s)
            except subprocess.TimeoutExpired:
                if task.timeout_s is not None and time.monotonic() - start > task.timeout_s:
                    return "timeout"
                if task.memory_mb is not None and _resident_mb(child.pid) > task.memory_mb:
                    return "memory"
                if not task.folder.is_current(task.run):
                    raise _Stopped from None


def _resident_mb(pid: int) -> float:
    """Memory that a process occupies; 0 if unknown."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


@contextlib.contextmanager
def _started(
    command: Sequence[str], said: IO[bytes], complaints: IO[bytes], environment: dict[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    """A child in its own process group, whose standard input stays open while it should run."""
    child = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=said,
        stderr=complaints,
        env=environment,
        start_new_session=True,
    )
    try:
        yield child
    finally:
        if child.poll() is None:
            if os.name == "nt":
                child.kill()
            else:
                os.killpg(child.pid, signal.SIGKILL)
            child.wait()
        assert child.stdin is not None
        child.stdin.close()


def _verdict(task: Task, code: int | str, complaints: str) -> tuple[str, str]:
    """The state of a video and one line with the reason, from how its process ended."""
    lines = [line.strip() for line in complaints.splitlines()]
    lines = [line for line in lines if line and not line.startswith(("note:", "stack backtrace:"))]  # Rust's
    last = lines[-1].removeprefix("memo: ") if lines else ""
    if code == "timeout":
        return "timeout", f"ended after {task.timeout_s:g} s"
    if code == "memory":
        return "crashed", f"ended because it used more than {task.memory_mb} MB of memory"
    assert isinstance(code, int)
    if code in (0, 3):
        return ("done" if code == 0 else "nobody"), ""  # `_told` adds the message
    if code == OUT_OF_MEMORY:
        return "crashed", "out of memory"
    if code < 0:
        with contextlib.suppress(ValueError):
            last = ": ".join(part for part in (f"killed by {signal.Signals(-code).name}", last) if part)
        return "crashed", last or f"killed by signal {-code}"
    if code == DEFECT or code not in (1, 2, 4):
        return "crashed", last or f"exit code {code}"
    return "failed", last or f"exit code {code}"


def _told(said: str, complaints: str) -> tuple[int | None, str, list[str]]:
    """The number of walks, the message about each, and other remarks.

    `said` is the JSON of the child; its `sentences` hold the message of each walk and the other remarks. If
    nobody was tracked at the place of `follow`, the message says so and the other sentences are of no use.
    """
    complained = [
        line.removeprefix("memo: ") for line in complaints.splitlines() if line.startswith("memo: ")
    ]
    try:
        summary = json.loads(said)
        if (not_there := summary.get("not_there")) and summary["walks"]:
            remarks = [line for line in complained if not line.endswith(not_there)]
            return int(summary["walks"]), not_there[0].upper() + not_there[1:] + ".", remarks
        messages = [walk["message"] for walk in summary["each_walk"]] or [summary["message"]]
        others = [line for line in summary["sentences"] if not line.endswith(tuple(messages))]
        several = len(messages) > 1
        told = [f"Walk {k}: {message}" if several else message for k, message in enumerate(messages)]
        return int(summary["walks"]), " ".join(told), complained + others
    except (ValueError, TypeError, KeyError):
        return None, "", complained


def _read(file: IO[bytes]) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")
