"""The folder of a run: its layout, one run at a time, and records that survive a kill at any byte.

```
OUT/NAME/              results of one video; the folder appears when it is complete
OUT/status.csv         every video of the manifest and its state
OUT/gait_parameters.csv
OUT/logs/NAME.log      messages of the last attempt
OUT/.batch/records/    one small file per video, the source of `status.csv`
OUT/.batch/K-of-N.lock held while shard K of N runs     K-of-N.run  the run that holds it
OUT/.batch/K-of-N.work unfinished files; emptied before and after each run
```
Every file is written among the unfinished files and then renamed. Locks belong to the operating system and
end with the process; on a network file system they work if it supports them (NFS does, unless mounted with
`nolock`).
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import time
import uuid
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from memo.run import NAME as RUN
from memo.unfinished import complete_file, new_folder

__all__ = ["STATES", "BatchError", "OutFolder", "Record", "check_ours"]

STATES = ("done", "nobody", "elsewhere", "failed", "crashed", "timeout")
"""A walker was tracked; there is none in the video; none is where `follow` says; the input cannot be used;
the process died; timeout."""


class BatchError(ValueError):
    """A run cannot start here, and why."""


@dataclass(frozen=True)
class Record:
    """The outcome of a video."""

    name: str
    state: str
    """One of `STATES`."""
    message: str
    seconds: float
    """Wall time of the last attempt."""
    attempt: int
    """Number of the attempt, from 1, since the row or the video last changed."""
    memo: str
    """Version of memo."""
    fingerprint: dict[str, Any]
    """What the result depends on, see `Row.fingerprint`."""
    walks: int | None = None
    """Number of walks tracked, 0 if nobody is where `follow` says; `None` if unknown."""
    remarks: tuple[str, ...] | list[str] = ()
    """Other remarks on the results: doubts, damage of the video, differences of the sides."""

    @property
    def finished(self) -> bool:
        """Whether there are results: a walker, or the finding that there is none, at all or at a place."""
        return self.state in ("done", "nobody", "elsewhere")


@dataclass(frozen=True)
class OutFolder:
    """The folder of a run as one shard uses it; `shard` is (1, 1) if one machine does all."""

    out: Path
    shard: tuple[int, int] = (1, 1)

    @property
    def _state(self) -> Path:
        return self.out / ".batch"

    @property
    def _shard_name(self) -> str:
        return f"{self.shard[0]}-of-{self.shard[1]}"

    @property
    def _run_file(self) -> Path:
        return self._state / f"{self._shard_name}.run"

    @property
    def work(self) -> Path:
        """Folder of this shard's unfinished files."""
        return self._state / f"{self._shard_name}.work"

    def results(self, name: str) -> Path:
        """The folder of a video's results."""
        return self.out / name

    def log(self, name: str) -> Path:
        """Messages of the last attempt at a video."""
        return self.out / "logs" / f"{name}.log"

    # Records.

    def _record_file(self, name: str) -> Path:
        return self._state / "records" / f"{name}.json"

    def record(self, name: str) -> Record | None:
        """The outcome of a video, if there is one and its results still exist."""
        try:
            record = Record(**json.loads(self._record_file(name).read_text(encoding="utf-8")))
        except (FileNotFoundError, NotADirectoryError, TypeError, ValueError):
            return None
        return None if record.finished and not self.results(name).is_dir() else record

    def write_record(self, record: Record) -> None:
        """Stores the outcome of a video."""
        with self.replaced(self._record_file(record.name)) as temporary:
            temporary.write_text(json.dumps(asdict(record), indent=1), encoding="utf-8")

    def names(self) -> list[str]:
        """All videos that have records."""
        return sorted(file.stem for file in (self._state / "records").glob("*.json"))

    def forget(self, name: str) -> None:
        """Removes a video's record, then its results: results without a record do not count."""
        self._record_file(name).unlink(missing_ok=True)
        self._remove_results(name)

    def place(self, finished: Path, name: str) -> None:
        """Gives a finished folder its final name."""
        for file in [*finished.rglob("*"), finished]:
            _settle(file)
        self._remove_results(name)
        os.replace(finished, self.results(name))
        _settle(self.out)

    def check_place(self, name: str) -> None:
        """Refuses to replace anything that is not a folder of results."""
        place = self.results(name)
        if place.is_symlink() or (place.exists() and not (place / RUN).is_file()):
            raise BatchError(
                f"{place}: is not a folder of results of memo and would be replaced; "
                "move it, or give the row another name"
            )

    def _remove_results(self, name: str) -> None:
        """Removes a folder of results as a whole: a killed process leaves nothing of it in place."""
        self.check_place(name)
        if self.results(name).exists():
            unfinished = self.unfinished()
            os.replace(self.results(name), unfinished / "results")
            shutil.rmtree(unfinished)

    @contextlib.contextmanager
    def replaced(self, path: Path) -> Iterator[Path]:
        """Yields a name among the unfinished files; the file written there is then renamed to `path`."""
        with complete_file(path, within=self.work) as temporary:
            yield temporary
            _settle(temporary)

    def unfinished(self) -> Path:
        """A new empty folder among the unfinished files."""
        return new_folder(self.work)

    def running(self) -> int:
        """Number of videos that this shard is working on, on any machine."""
        with contextlib.suppress(OSError):
            return sum(entry.is_dir() for entry in os.scandir(self.work))
        return 0

    # One run at a time.

    @contextlib.contextmanager
    def taken(self) -> Iterator[str]:
        """Locks the folder for one run and yields the run's name; raises `BatchError` if it is locked."""
        check_ours(self.out)
        lock = self._state / f"{self._shard_name}.lock"
        try:
            for folder in (self._state / "records", self.out / "logs", self.work):
                folder.mkdir(parents=True, exist_ok=True)
            lock.touch()
        except OSError as error:
            raise BatchError(f"{self.out}: cannot be written to: {error.strerror}") from None
        with _locked(lock) as free:
            if not free:
                raise BatchError(f"{self.out}: another run uses this folder")
            self._check_other_shards()
            _empty(self.work)
            run = uuid.uuid4().hex
            with self.replaced(self._run_file) as temporary:
                temporary.write_text(run)
            try:
                yield run
            finally:
                self.stop()
                _empty(self.work)

    def _check_other_shards(self) -> None:
        """Refuses to run beside a run with other shards, and removes leftovers of ended ones."""
        for lock in self._state.glob("*-of-*.lock"):
            shards = re.fullmatch(r"(\d+)-of-(\d+)", lock.stem)
            if shards is None or int(shards[2]) == self.shard[1]:
                continue
            with _locked(lock) as free:
                if not free:
                    raise BatchError(
                        f"{self.out}: shard {shards[1]}/{shards[2]} runs here; use as many shards"
                    )
                _empty(lock.with_suffix(".work"))

    def stop(self) -> None:
        """Tells every process of this shard's run, on any machine, to abandon its video."""
        self._run_file.unlink(missing_ok=True)

    def is_current(self, run: str) -> bool:
        """Whether a run is the one that holds this shard."""
        try:
            return self._run_file.read_text() == run
        except OSError:
            return False

    @contextlib.contextmanager
    def merging(self) -> Iterator[None]:
        """Locks the tables of all shards while one of them reads the records and writes."""
        path = self._state / "tables.lock"
        while True:
            with _locked(path) as free:
                if free:
                    yield
                    return
            time.sleep(0.1)


def check_ours(out: Path) -> None:
    """Refuses to write into a folder that holds files other than those of an earlier run."""
    if out.exists() and not out.is_dir():
        raise BatchError(f"{out}: is a file")
    if out.is_dir() and not (out / ".batch").is_dir() and any(out.iterdir()):
        raise BatchError(f"{out}: holds files that `memo batch` did not write; give an empty folder")


# Files open for a lock. A forked process would hold the lock longer than the process that took it.
_LOCKS: set[int] = set()


def _drop_inherited_locks() -> None:
    for descriptor in _LOCKS:
        os.close(descriptor)
    _LOCKS.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_drop_inherited_locks)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[bool]:
    """Locks a file until the block or this process ends; yields whether that was possible."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    _LOCKS.add(descriptor)
    try:
        yield _lock(descriptor)
    finally:
        _LOCKS.discard(descriptor)
        os.close(descriptor)


def _lock(descriptor: int) -> bool:
    try:
        if os.name == "nt":
            import msvcrt

            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (BlockingIOError, PermissionError):
        return False
    return True


def _settle(path: Path) -> None:
    """Has the system write a file or folder to the disk, so that a rename never precedes its content."""
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY if os.name != "nt" else os.O_RDWR)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _empty(work: Path) -> None:
    """Removes files of killed processes; those that are still ending may write for another moment."""
    for _ in range(50):
        shutil.rmtree(work, ignore_errors=True)
        if not work.exists():
            break
        time.sleep(0.02)
    work.mkdir(parents=True, exist_ok=True)
