"""A run over a manifest: plans the work, has it done, and reports the result of each video."""

from __future__ import annotations

import contextlib
import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any

from memo._memo import __version__
from memo.batch.folder import STATES, BatchError, OutFolder, Record, check_ours
from memo.batch.manifest import TAKEN, Manifest, ManifestError, Row, read_manifest
from memo.batch.tables import write_status, write_table
from memo.batch.task import Task, perform
from memo.wording import counted

__all__ = ["BatchResult", "Progress", "prepared", "run"]

_ATTEMPTS_OF_WORKERS = 3  # a worker may be lost for reasons unrelated to the video, so others try
_BYTES_A_VIDEO = 1 << 20  # size of results without an overlay
_RESERVE_BYTES = 50 << 20  # with less free space, errors are blamed on the disk
_TELL_S = 0.5
_FEW = 3  # names given as examples


@dataclass(frozen=True)
class Progress:
    """Progress of a run."""

    total: int
    """Videos of this shard."""
    counts: Mapping[str, int]
    """Number of videos in each of `STATES`, including those of earlier runs."""
    running: int
    record: Record | None
    """The video that has just ended, if this call reports one."""

    @property
    def ended(self) -> int:
        """Number of videos that have ended, with or without results."""
        return sum(self.counts.values())


@dataclass(frozen=True)
class BatchResult:
    """The result of a run."""

    out: Path
    records: list[Record]
    """One per video of this shard, in the order of the manifest, including those of earlier runs."""
    left: list[str]
    """Names of the videos that have not ended."""
    seconds: float
    """Wall time of this run."""
    done_now: int
    """Number of videos that ended in this run."""
    notes: list[str] = field(default_factory=list)
    """Sentences with notes for the user."""

    @property
    def counts(self) -> dict[str, int]:
        """Number of videos in each of `STATES`."""
        counted = Counter(record.state for record in self.records)
        return {state: counted[state] for state in STATES}

    @property
    def walks(self) -> int:
        """Number of walks tracked in all videos."""
        return sum(record.walks or 0 for record in self.records)

    @property
    def unfinished(self) -> int:
        """Number of videos without results: failed, crashed, timed out, or left."""
        return len(self.left) + sum(not record.finished for record in self.records)

    @property
    def files(self) -> list[Path]:
        """The tables over all videos."""
        return [self.out / "status.csv", self.out / "gait_parameters.csv"]


def run(
    manifest: str | PathLike[str] | Iterable[Mapping[str, Any]],
    out: str | PathLike[str] | None = None,
    *,
    jobs: int | None = None,
    executor: Executor | None = None,
    shard: tuple[int, int] = (1, 1),
    resume: bool = False,
    retry_failed: bool = False,
    skip_bad: bool = False,
    overlay: bool = False,
    plots: bool = False,
    report: bool = False,
    timeout_s: float | None = None,
    memory_mb: int | None = None,
    command: Sequence[str] | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> BatchResult:
    """Tracks the videos of a manifest, each in its own process, with results in `out/NAME`.

    If not given, `out` is `memo-out/` and the name of the manifest's file.

    `jobs` videos run at a time (default: the number of processors), or as many as the `executor` accepts: any
    of `concurrent.futures`, Dask's `client.get_executor()`, `memo.batch.RayExecutor`; its workers need memo
    and the same paths. `shard=(2, 4)` does every fourth row of the manifest, from the second on; parts may
    run at the same time on machines that share `out`.

    A run in a folder that holds results needs `resume`: finished videos stay, unfinished ones are done, and
    those that changed since, in the manifest or on the disk, are done again. `retry_failed` also repeats
    failed videos. Rows that cannot be tracked as written are refused, or recorded as failed if `skip_bad`.

    `timeout_s` and `memory_mb` (resident, on Linux) apply to each video. `command` replaces
    `python -m memo.batch.leash`; it receives the arguments of `memo` and must end when its standard input
    closes. `progress` is called for each video, and in between.

    Raises `ManifestError` (with all problems) or `BatchError` before any work, and `BatchError` when
    the disk is full. When interrupted, it ends the running processes, writes the tables and raises
    `KeyboardInterrupt`.
    """
    read = prepared(manifest, skip_bad=skip_bad, overlay=overlay, plots=plots, report=report)
    _check_numbers(jobs, shard, timeout_s, memory_mb)
    start = time.monotonic()
    out = default_out(manifest) if out is None else Path(out)
    folder = OutFolder(out.absolute(), shard)
    mine = read.rows[shard[0] - 1 :: shard[1]]
    resume = resume or retry_failed
    check_inputs(folder.out, read.rows)
    check_folder(folder.out, [row for row in mine if folder.record(row.name) is None])
    with folder.taken() as name:
        known = _known(mine, folder, out, resume)
        fingerprints = {row.name: row.fingerprint for row in mine}
        to_do = [row for row in mine if is_to_do(known[row.name], fingerprints[row.name], retry_failed)]
        check_places(folder, to_do)
        notes = _notes(read, folder, known, to_do, fingerprints)
        _record_problems(folder, to_do)
        processors = _processors()
        jobs = jobs or processors
        threads = 1 if executor is not None else max(1, processors // jobs)
        limits = {"timeout_s": timeout_s, "memory_mb": memory_mb, "threads": threads}
        shared = {"folder": folder, "run": name, "command": tuple(command) if command else None, **limits}
        tasks = _tasks([row for row in to_do if not row.problems], known, fingerprints, shared)
        teller = _Teller(read.rows, mine, folder, progress)
        teller.expect(tasks)
        try:
            teller.tell()
            with ThreadPoolExecutor(jobs) if executor is None else contextlib.nullcontext(executor) as crew:
                notes += _work(tasks, crew, folder, teller)
        except BaseException:
            with contextlib.suppress(OSError):  # the first error is the one to report
                _write_tables(folder, read.rows)
            raise
        notes += _write_tables(folder, read.rows)
    return _result(folder, mine, time.monotonic() - start, teller.told, notes)


def _known(mine: Sequence[Row], folder: OutFolder, out: Path, resume: bool) -> dict[str, Record | None]:
    """The records of what has been done before, which needs `resume`."""
    known = {row.name: folder.record(row.name) for row in mine}
    if not resume and any(known.values()):
        done = sum(record is not None for record in known.values())
        raise BatchError(f"{out}: videos have been run here ({done} of {len(mine)}); resume to go on")
    return known


def _tasks(
    rows: Iterable[Row],
    known: Mapping[str, Record | None],
    fingerprints: Mapping[str, dict[str, Any]],
    shared: Mapping[str, Any],
) -> list[Task]:
    """A task for each row, with values that all share."""
    return [
        Task(
            name=row.name,
            arguments=tuple(row.arguments),
            fingerprint=fingerprints[row.name],
            attempt=_attempt(known[row.name], fingerprints[row.name]),
            **shared,
        )
        for row in rows
    ]


def _result(
    folder: OutFolder, rows: Sequence[Row], seconds: float, done_now: int, notes: list[str]
) -> BatchResult:
    found = {row.name: folder.record(row.name) for row in rows}
    return BatchResult(
        out=folder.out,
        records=[record for record in found.values() if record is not None],
        left=[name for name, record in found.items() if record is None],
        seconds=seconds,
        done_now=done_now,
        notes=notes,
    )


def _record_problems(folder: OutFolder, rows: Iterable[Row]) -> None:
    """Records the rows that cannot be tracked as written as failed."""
    for row in rows:
        if row.problems:
            folder.forget(row.name)
            message = "; ".join(row.problems)
            folder.write_record(Record(row.name, "failed", message, 0.0, 1, __version__, row.fingerprint))


def default_out(manifest: object) -> Path:
    """Default folder of the results."""
    return Path("memo-out") / (Path(manifest).stem if isinstance(manifest, str | PathLike) else "batch")


def prepared(
    manifest: str | PathLike[str] | Iterable[Mapping[str, Any]],
    *,
    skip_bad: bool = False,
    overlay: bool = False,
    plots: bool = False,
    report: bool = False,
) -> Manifest:
    """The manifest, read and checked; raises `ManifestError` with all problems that prevent a run."""
    read = read_manifest(manifest, {"overlay": overlay, "plots": plots, "report": report})
    problems = read.problems + [problem for row in read.rows for problem in row.problems if not skip_bad]
    if problems:
        raise ManifestError(problems)
    return read


# Before the work.


def _check_numbers(
    jobs: int | None, shard: tuple[int, int], timeout_s: float | None, memory_mb: int | None
) -> None:
    if jobs is not None and jobs < 1:
        raise BatchError(f"the number of videos at a time must be at least 1, got {jobs}")
    if not 1 <= shard[0] <= shard[1]:
        raise BatchError(f"shard {shard[0]}/{shard[1]} is not one of 1/{shard[1]} to {shard[1]}/{shard[1]}")
    if timeout_s is not None and not timeout_s > 0:
        raise BatchError(f"a time limit of {timeout_s:g} s is too short")
    if memory_mb is not None and memory_mb < 1:
        raise BatchError(f"a memory limit of {memory_mb} MB is too small")


def is_to_do(record: Record | None, fingerprint: dict[str, Any], retry_failed: bool = False) -> bool:
    """Whether a resumed run does a video, given the record of an earlier run."""
    if record is None or record.fingerprint != fingerprint:
        return True
    return retry_failed and not record.finished


def _attempt(record: Record | None, fingerprint: dict[str, Any]) -> int:
    """Number of the next attempt."""
    same = record is not None and record.fingerprint == fingerprint
    return record.attempt + 1 if record is not None and same else 1


def notes_on(rows: Sequence[Row]) -> list[str]:
    """Notes on the manifest for the user."""
    without = sum(not {"height_m", "camera"} & set(row.options) for row in rows)
    if not without:
        return []
    return [f"{counted(without, 'video')} without height_m and camera: the height is assumed, see summary."]


def _notes(
    manifest: Manifest,
    folder: OutFolder,
    known: Mapping[str, Record | None],
    to_do: Sequence[Row],
    fingerprints: Mapping[str, dict[str, Any]],
) -> list[str]:
    """Notes on the plan for the user."""
    notes = notes_on(manifest.rows)
    changed = [row for row in to_do if (record := known[row.name]) is not None and record.finished]
    if changed:
        what = Counter(
            key
            for row in changed
            for key in {**fingerprints[row.name], **known[row.name].fingerprint}  # type: ignore[union-attr]
            if fingerprints[row.name].get(key) != known[row.name].fingerprint.get(key)  # type: ignore[union-attr]
        )
        told = ", ".join(f"{key} of {count}" for key, count in what.most_common())
        notes.append(f"{counted(len(changed), 'video')} changed since the last run and done again ({told}).")
    strange = set(folder.names()) - {row.name for row in manifest.rows}
    if strange:
        named = _named(sorted(strange))
        notes.append(f"{counted(len(strange), 'video')} no longer in the manifest ({named}): left unchanged.")
    older = {record.memo for record in known.values() if record is not None} - {__version__}
    if older:
        notes.append(f"Some videos were tracked by memo {', '.join(sorted(older))}, not {__version__}.")
    return notes


def check_inputs(out: Path, rows: Sequence[Row]) -> None:
    """Refuses input in the places of results, which are removed before a video is tracked."""
    places = {(out / name).resolve() for name in (*TAKEN, *(row.name for row in rows))}
    problems = []
    for row in rows:
        for file in (row.video, *(value for value in row.options.values() if isinstance(value, Path))):
            lies_in = [file.resolve(), *file.resolve().parents]
            if place := next((place for place in lies_in if place in places), None):
                problems.append(f"{row.place}: {file}: is where results go ({place}); give another folder")
    if problems:
        raise ManifestError(problems)


def check_places(folder: OutFolder, to_do: Sequence[Row]) -> None:
    """Refuses rows whose results would replace anything else."""
    problems = []
    for row in to_do:
        try:
            folder.check_place(row.name)
        except BatchError as error:
            problems.append(f"{row.place}: {error}")
    if problems:
        raise ManifestError(problems)


def check_folder(out: Path, to_do: Sequence[Row]) -> None:
    """Refuses a folder of other files, and a disk without room for the results.

    An overlay is assumed to be as large as its video.
    """
    check_ours(out)
    there = next(folder for folder in [out, *out.absolute().parents] if folder.exists())
    if not os.access(there, os.W_OK):
        raise BatchError(f"{out}: cannot be written to")
    needed = _RESERVE_BYTES + sum(
        _BYTES_A_VIDEO + (row.video.stat().st_size if row.options.get("overlay") else 0)
        for row in to_do
        if not row.problems
    )
    free = shutil.disk_usage(there).free
    if free < needed:
        raise BatchError(f"{out}: {free >> 20} MB are free, about {needed >> 20} MB are needed")


def _processors() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# The work.


class _Teller:
    """Counts videos that ended, reports them, and keeps `status.csv` up to date."""

    def __init__(
        self,
        rows: Sequence[Row],
        mine: Sequence[Row],
        folder: OutFolder,
        progress: Callable[[Progress], None] | None,
    ) -> None:
        self._rows, self._mine, self._folder, self._progress = rows, mine, folder, progress
        self._counts: Counter[str] = Counter()
        self._next_status_s = 0.0
        self.told = 0
        """Number of videos that ended."""

    def expect(self, tasks: Iterable[Task]) -> None:
        """Counts the videos of earlier runs: all except those done in this run."""
        names = {task.name for task in tasks}
        for row in self._mine:
            record = self._folder.record(row.name)
            if record is not None and row.name not in names:
                self._counts[record.state] += 1

    def tell(self, record: Record | None = None) -> None:
        """Reports the progress of the run, and a video that ended."""
        if record is not None:
            self.told += 1
            self._counts[record.state] += 1
        now_s = time.monotonic()
        if now_s >= self._next_status_s:
            _write_status(self._folder, self._rows)
            took_s = time.monotonic() - now_s
            self._next_status_s = now_s + max(5.0, 50 * took_s)
        if self._progress is not None:
            counts = {state: self._counts[state] for state in STATES}
            self._progress(Progress(len(self._mine), counts, self._folder.running(), record))


def _work(tasks: Sequence[Task], executor: Executor, folder: OutFolder, teller: _Teller) -> list[str]:
    """Has the executor do all tasks; returns sentences about problems beyond single videos."""
    waiting: dict[Future[Record | None], Task] = {}
    ended: SimpleQueue[Future[Record | None]] = SimpleQueue()
    losses: Counter[str] = Counter()

    def submit(task: Task) -> None:
        future = executor.submit(perform, task)
        waiting[future] = task
        future.add_done_callback(ended.put)

    try:
        broken = _submit_all(tasks, submit)
        while waiting:
            try:
                future = ended.get(timeout=_TELL_S)
            except Empty:
                teller.tell()
                continue
            task = waiting.pop(future)
            try:
                record = future.result()
            except BatchError as error:
                raise BatchError(str(error).strip().splitlines()[-1]) from error
            except BrokenExecutor as error:
                broken = error
                record = _own_record(task)
            except Exception as error:  # of the executor: the worker is lost, and its work too
                record = _own_record(task)
                losses[task.name] += 1
                if record is None and losses[task.name] < _ATTEMPTS_OF_WORKERS:
                    submit(task)
                elif record is None:
                    record = _record_loss(task, error)
            if record is not None:
                if not record.finished and shutil.disk_usage(folder.out).free < _RESERVE_BYTES:
                    folder.forget(task.name)
                    raise BatchError(f"{folder.out}: the disk is full; make room and resume")
                teller.tell(record)
    except BaseException:
        folder.stop()
        for future in waiting:
            future.cancel()
        wait(waiting, timeout=30)
        raise
    notes = []
    if broken is not None:
        notes.append(f"The executor failed: {broken} Resume to do the videos that are left.")
    if losses:
        one = "worker was lost; its video was given to another"
        several = "workers were lost; their videos were given to others"
        notes.append(f"{counted(losses.total(), one, several)}.")
    return notes


def _submit_all(tasks: Iterable[Task], submit: Callable[[Task], None]) -> BrokenExecutor | None:
    for task in tasks:
        try:
            submit(task)
        except BrokenExecutor as error:
            return error
    return None


def _own_record(task: Task) -> Record | None:
    """The record that a worker wrote before it was lost, if it did."""
    record = task.folder.record(task.name)
    return record if record is not None and record.fingerprint == task.fingerprint else None


def _record_loss(task: Task, error: Exception) -> Record:
    """Records that one worker after another was lost with a video."""
    task.folder.forget(task.name)
    text = " ".join(str(error).split())[:200]
    message = f"{_ATTEMPTS_OF_WORKERS} workers were lost with this video: {type(error).__name__}: {text}"
    record = Record(task.name, "crashed", message, 0.0, task.attempt, __version__, task.fingerprint)
    task.folder.write_record(record)
    return record


def _write_status(folder: OutFolder, rows: Sequence[Row]) -> None:
    with folder.merging(), folder.replaced(folder.out / "status.csv") as temporary:
        write_status(folder, rows, temporary)


def _write_tables(folder: OutFolder, rows: Sequence[Row]) -> list[str]:
    """Writes both tables; returns a note on videos whose results cannot be read."""
    _write_status(folder, rows)
    with folder.merging(), folder.replaced(folder.out / "gait_parameters.csv") as temporary:
        unreadable = write_table(folder, rows, temporary)
    if not unreadable:
        return []
    names, reason = _named(list(unreadable)), next(iter(unreadable.values()))
    return [
        f"{counted(len(unreadable), 'video')} without values in gait_parameters.csv ({names}): {reason}; "
        "remove the folder of results and resume to track a video again."
    ]


def described(result: BatchResult) -> Iterator[str]:
    """The result in sentences."""
    counts = result.counts
    told = {
        "done": "tracked",
        "nobody": "without a walker",
        "elsewhere": "with nobody where follow says",
        "failed": "failed",
        "crashed": "crashed",
        "timeout": "took too long",
    }
    parts = [f"{counts[state]} {words}" for state, words in told.items() if counts[state]]
    if result.left:
        parts.append(f"{len(result.left)} left")
    total = len(result.records) + len(result.left)
    yield f"{counted(total, 'video')}: {', '.join(parts) or 'nothing done'}."
    yield from _of_walks(result.records)
    if result.done_now:
        each = result.seconds / result.done_now
        done = counted(result.done_now, "video")
        yield f"{done} in this run took {result.seconds:.0f} s, {each:.2f} s each."
    yield from result.notes


def _of_walks(records: Sequence[Record]) -> Iterator[str]:
    """Reports the number of walks, if a video has several, and the number of remarks."""
    several = [record.name for record in records if (record.walks or 0) > 1]
    if several:
        walks = sum(record.walks or 0 for record in records)
        yield (
            f"{counted(walks, 'walk')}; several in {counted(len(several), 'video')} ({_named(several)}): "
            "gait_parameters.csv has one row per walk; its column person tells people of a video apart."
        )
    remarked = [record.name for record in records if record.remarks]
    if remarked:
        yield f"Remarks on {counted(len(remarked), 'video')} ({_named(remarked)}): see status.csv."


def _named(names: Sequence[str]) -> str:
    """The first names, as examples."""
    return ", ".join(names[:_FEW]) + ", ..." * (len(names) > _FEW)
