"""The command line: one command per file of this package.

This package alone decides how results are delivered: what is checked before work starts, which files are
written, which messages are printed and which exit code is returned. The base install needs only numpy, so
everything from the `app` extra is imported inside functions, after `main` has checked that it is installed.
(Typer evaluates annotations in their module, so commands do not use `from __future__ import annotations`.)
"""

import contextlib
import io
import os
import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated, NoReturn

import memo
from memo.cli.batch import add_batch
from memo.cli.calibrate import add_calibrate
from memo.cli.convert import add_convert
from memo.cli.delivery import complain
from memo.cli.demo import add_demo
from memo.cli.planar import add_planar
from memo.cli.pointlight import add_pointlight
from memo.cli.posture import add_posture
from memo.cli.report import add_report
from memo.cli.reproduce import add_reproduce
from memo.cli.track import add_track
from memo.cli.unswap import add_unswap
from memo.exits import Exit
from memo.extras import install

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo demo
  memo track walk.mp4 --height 1.68
  memo report memo-out/walk

Exit codes: see the --help of each command; 141 if the program that reads the output has ended, as in
memo ... | head."""

EXTRA = ("av", "matplotlib", "rich", "typer")


def main() -> None:
    """Entry point of the `memo` command."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # None if it is closed
            stream.reconfigure(errors="backslashreplace")  # degrees in ASCII, names that are no text
    try:
        try:
            _run()
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()  # buffered output may meet a closed pipe, too
    except BrokenPipeError:
        _end_unread()
    except OSError as error:  # a full disk behind the output
        complain(str(error))
        _end_unread(Exit.BAD_INPUT)
    except SystemExit as ended:  # click and rich raise SystemExit for a closed pipe
        if isinstance(ended.__context__, BrokenPipeError):
            _end_unread()
        raise


def _run() -> None:
    absent = [name for name in EXTRA if find_spec(name) is None]
    if absent:
        complain(f"the command line needs {', '.join(absent)}: {install('app', *absent)}")
        raise SystemExit(Exit.NO_EXTRA)
    try:
        _app()()
    except KeyboardInterrupt:  # while the extra is still being imported
        raise SystemExit(Exit.INTERRUPTED) from None


def _end_unread(exit_code: Exit = Exit.PIPE_CLOSED) -> NoReturn:
    """Ends without further output, as usual for a program whose reader has ended, as in `memo ... | head`."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            os.dup2(nowhere, stream.fileno())
    raise SystemExit(exit_code)


def _app() -> "typer.Typer":
    import typer

    app = typer.Typer(
        name="memo",
        help="3D motion of a walker from one fixed camera.",
        epilog=EPILOG,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )

    def version(wanted: bool) -> None:
        if wanted:
            print(f"memo {memo.__version__}")
            raise typer.Exit

    @app.callback()
    def options(
        version: Annotated[bool, typer.Option("--version", callback=version, is_eager=True)] = False,
    ) -> None: ...

    add_track(app)
    add_report(app)
    add_convert(app)
    add_batch(app)
    add_calibrate(app)
    add_posture(app)
    add_unswap(app)
    add_pointlight(app)
    add_planar(app)
    add_reproduce(app)
    add_demo(app)
    return app
