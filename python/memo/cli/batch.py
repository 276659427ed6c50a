"""`memo batch`: tracks the videos of a manifest, each in its own process.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import contextlib
import json
import shlex
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from memo.batch import OPTIONS, BatchResult, ManifestError, Progress, RayExecutor, Record, run
from memo.batch.engine import (
    check_folder,
    check_inputs,
    check_places,
    default_out,
    described,
    is_to_do,
    notes_on,
    prepared,
)
from memo.batch.folder import OutFolder
from memo.cli.delivery import Delivery, complain, guarded, terminal
from memo.exits import Exit
from memo.given import InputError
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo batch trials.csv --check
  memo batch trials.csv --out trials
  memo batch trials.csv --out trials --resume
  memo batch trials.csv --out trials --shard 2/4

Exit codes: 0 every video was tracked or shows nobody, or nobody where follow says; 1 the manifest or \
the folder cannot be used; 2 wrong usage; 4 the app extra is not installed; 5 some videos failed or are \
left, see status.csv; 130 interrupted."""

_FEW = 5  # videos named in a message if there are many
_LONGEST_LINE = 300  # characters of a printed message; status.csv has the whole message


class Backend(StrEnum):
    """What runs the processes."""

    LOCAL = "local"
    RAY = "ray"


def add_batch(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EPILOG)
    def batch(
        manifest: Annotated[
            Path,
            typer.Argument(
                metavar="MANIFEST",
                help=f"CSV or TOML, one row per video: video, name, {', '.join(OPTIONS)}.",
            ),
        ],
        jobs: Annotated[
            int | None, typer.Option(help="Videos tracked at a time; default: number of processors.", min=1)
        ] = None,
        resume: Annotated[
            bool, typer.Option("--resume", help="Continue a run that ended or was killed.")
        ] = False,
        retry_failed: Annotated[
            bool, typer.Option("--retry-failed", help="Continue, and repeat videos that failed.")
        ] = False,
        check: Annotated[
            bool, typer.Option("--check", help="Only report what is wrong in the manifest.")
        ] = False,
        skip_bad: Annotated[
            bool, typer.Option("--skip-bad", help="Record bad rows as failed instead of refusing to start.")
        ] = False,
        shard: Annotated[
            str, typer.Option(help="Part I of N, for several machines that share one folder.", metavar="I/N")
        ] = "1/1",
        timeout: Annotated[float | None, typer.Option(help="Maximum time per video, seconds.")] = None,
        max_memory: Annotated[int | None, typer.Option(help="Maximum memory per video, MB (Linux).")] = None,
        out: Annotated[
            Path | None, typer.Option(help="Folder for the results; default: memo-out/MANIFEST.")
        ] = None,
        overlay: Annotated[bool, typer.Option(help="Write overlay.mp4; a row can override it.")] = False,
        plots: Annotated[bool, typer.Option(help="Write plots; a row can override it.")] = False,
        report: Annotated[bool, typer.Option(help="Write report.html; a row can override it.")] = False,
        backend: Annotated[Backend, typer.Option(help="What runs the processes.")] = Backend.LOCAL,
        ray_address: Annotated[
            str | None, typer.Option(help="Address of the Ray cluster; default: a running or a local one.")
        ] = None,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Tracks the videos of MANIFEST. A video that fails or crashes does not affect the others.

        A run that was killed continues with --resume.
        """
        delivery = Delivery(out or default_out(manifest), overlay, plots, as_json, quiet)

        def work() -> Exit:
            try:
                return checked_work()
            except ModuleNotFoundError as error:  # Ray
                complain(str(error))
                return Exit.NO_EXTRA
            except ManifestError as error:
                for problem in error.problems:
                    complain(problem)
                return Exit.BAD_INPUT

        def checked_work() -> Exit:
            if check:
                return _check(manifest, delivery)
            if ray_address is not None and backend is not Backend.RAY:
                raise InputError("--ray-address needs --backend ray")
            if jobs is not None and backend is Backend.RAY:
                raise InputError("--jobs is for --backend local; Ray starts as many as it has processors")
            options = {
                "jobs": jobs,
                "shard": _parsed_shard(shard),
                "resume": resume,
                "retry_failed": retry_failed,
                "skip_bad": skip_bad,
                "report": report,
                "timeout_s": timeout,
                "memory_mb": max_memory,
            }
            return _batch(manifest, delivery, options, backend, ray_address)

        raise typer.Exit(guarded(work))


def _parsed_shard(text: str) -> tuple[int, int]:
    part, _, parts = text.partition("/")
    if not (part.isdecimal() and parts.isdecimal() and 1 <= int(part) <= int(parts)):
        raise InputError(f"--shard {text} is not I/N with 1 <= I <= N")
    return int(part), int(parts)


def _check(manifest: Path, delivery: Delivery) -> Exit:
    """Reports what is wrong with the manifest, and where results would be written."""
    read = prepared(manifest, overlay=delivery.overlay, plots=delivery.plots)
    check_inputs(delivery.out, read.rows)
    check_folder(delivery.out, read.rows)
    folder = OutFolder(delivery.out)
    check_places(folder, [row for row in read.rows if is_to_do(folder.record(row.name), row.fingerprint)])
    if delivery.as_json:
        print(json.dumps({"videos": len(read.rows), "names": [row.name for row in read.rows]}))
    elif delivery.talks:
        names = [row.name for row in read.rows]
        more = ", ..." if len(names) > _FEW else ""
        print(f"{counted(len(names), 'video')} can be run; their folders: {', '.join(names[:_FEW])}{more}")
        for note in notes_on(read.rows):
            print(note)
    return Exit.DONE


def _batch(
    manifest: Path, delivery: Delivery, options: dict[str, Any], backend: Backend, ray_address: str | None
) -> Exit:
    if backend is Backend.RAY:
        prepared(manifest, skip_bad=options["skip_bad"])  # report mistakes before looking for a cluster
    try:
        with (
            _termination_as_interrupt(),
            _executor(backend, ray_address) as executor,
            _shown(delivery) as show,
        ):
            result = run(
                manifest,
                delivery.out,
                executor=executor,
                overlay=delivery.overlay,
                plots=delivery.plots,
                progress=show,
                **options,
            )
    except KeyboardInterrupt:
        again = [argument for argument in sys.argv[1:] if argument != "--resume"]
        complain("interrupted: finished videos are kept; to do the rest, run")
        complain(f"  memo {shlex.join([*again, '--resume'])}")
        return Exit.INTERRUPTED
    _tell(result, delivery)
    return Exit.SOME_FAILED if result.unfinished else Exit.DONE


def _executor(
    backend: Backend, ray_address: str | None
) -> contextlib.AbstractContextManager[Executor | None]:
    return RayExecutor(ray_address) if backend is Backend.RAY else contextlib.nullcontext()


@contextlib.contextmanager
def _termination_as_interrupt() -> Iterator[None]:
    """Cluster schedulers send SIGTERM before they end a job: treat it as Ctrl-C."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _tell(result: BatchResult, delivery: Delivery) -> None:
    summary = {
        "videos": len(result.records) + len(result.left),
        **result.counts,
        "walks": result.walks,
        "left": len(result.left),
        "seconds": round(result.seconds, 3),
        "out": str(delivery.out),
        "notes": result.notes,
    }
    delivery.tell(summary, [*described(result), *_failures(result)], result.files)


def _failures(result: BatchResult) -> Iterator[str]:
    """Names the first videos without results, and how to repeat them."""
    failed = [record for record in result.records if not record.finished]
    for record in failed[:_FEW]:
        yield f"  {_line(record)}"
    if len(failed) > _FEW:
        yield f"  and {len(failed) - _FEW} more: see status.csv and logs/"
    if failed:
        yield "--retry-failed repeats them."


def _line(record: Record) -> str:
    walks = f"{counted(record.walks, 'walk')}, " if record.walks is not None and record.walks > 1 else ""
    remarks = " (remarks: status.csv)" if record.remarks else ""
    message = record.message
    if len(message) > _LONGEST_LINE:
        message = message[:_LONGEST_LINE].rpartition(" ")[0] + " ..."
    return f"{record.name}: {record.state}, {walks}{record.seconds:.1f} s. {message}{remarks}"


# While it runs.


@contextlib.contextmanager
def _shown(delivery: Delivery) -> Iterator[Callable[[Progress], None] | None]:
    """Shows the progress of the run: a bar on a terminal, else one line per video."""
    console = terminal(delivery)
    if delivery.quiet:
        yield None
    elif console is None:
        yield _Lines().show
    else:
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
        from rich.progress import Progress as Bar

        columns = (
            *(BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}", markup=False)),
            *(TimeElapsedColumn(), TextColumn("left:"), TimeRemainingColumn()),
        )
        with Bar(*columns, console=console, transient=True, speed_estimate_period=3600) as bar:
            task = bar.add_task("", total=None)

            def show(now: Progress) -> None:
                if bar.tasks[task].total is None:  # earlier runs do not count for the speed
                    bar.reset(task, total=now.total, completed=now.ended)
                bar.update(task, completed=now.ended, description=_counted(now))
                if now.record is not None and not now.record.finished:
                    console.print(_line(now.record), markup=False, highlight=False)

            yield show


def _counted(now: Progress) -> str:
    counts = [f"{count} {state}" for state, count in now.counts.items() if count]
    return ", ".join([*counts, f"{now.running} running"])


class _Lines:
    """Prints one line per finished video, for logs."""

    def __init__(self) -> None:
        self._start_s: float | None = None

    def show(self, now: Progress) -> None:
        if self._start_s is None:
            self._start_s, self._before = time.monotonic(), now.ended
        if now.record is None:
            return
        each_s = (time.monotonic() - self._start_s) / max(1, now.ended - self._before)
        left_s = (now.total - now.ended) * each_s
        left = f"{left_s / 60:.0f} min left" if left_s > 90 else f"{left_s:.0f} s left"
        print(f"[{now.ended}/{now.total}, {left}] {_line(now.record)}", file=sys.stderr, flush=True)
