"""Files and folders that appear under their names complete or not at all.

Until then they are in the same folder under a name of `.memo-` and sixteen random digits, so that nobody can
place a file or a link there beforehand, and an existing one is never opened (O_EXCL). Permissions are those
of any new file. Files left by a killed process are recognised by their name; `memo batch --resume` removes
them.
"""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path

__all__ = ["complete_file", "complete_folder", "is_unfinished", "new_file", "new_folder", "write_complete"]

_PREFIX = ".memo-"
_DIGITS = 16
_NAME = re.compile(rf"{re.escape(_PREFIX)}[0-9a-f]{{{_DIGITS}}}")


def is_unfinished(name: str) -> bool:
    """Whether a file or folder of this name was never completed."""
    return _NAME.fullmatch(name) is not None


def new_file(folder: str | PathLike[str]) -> Path:
    """Creates an empty file under a name that nobody can guess."""
    path = _nameless(folder)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
    os.close(os.open(path, flags, 0o666))
    return path


def new_folder(folder: str | PathLike[str]) -> Path:
    """Creates an empty folder under a name that nobody can guess."""
    path = _nameless(folder)
    path.mkdir()
    return path


@contextmanager
def complete_file(path: str | PathLike[str], *, within: str | PathLike[str] | None = None) -> Iterator[Path]:
    """Yields the path of a new file beside `path`, or `within` a folder; on success it becomes `path`."""
    path = Path(path)
    with _named_in_errors(path):
        temporary = new_file(path.parent if within is None else within)
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        if error.filename is not None and Path(error.filename) == temporary:
            raise type(error)(error.errno, error.strerror, str(path)) from None
        raise
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def complete_folder(path: str | PathLike[str]) -> Iterator[Path]:
    """Yields the path of a new folder beside `path`; on success it replaces `path`."""
    path = Path(path)
    with _named_in_errors(path):
        temporary = new_folder(path.parent)
    before = _nameless(path.parent)
    try:
        yield temporary
        if path.exists():
            os.rename(path, before)
        os.rename(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        if before.exists():
            if path.exists():
                shutil.rmtree(before, ignore_errors=True)
            else:
                os.rename(before, path)


def write_complete(path: str | PathLike[str], text: str) -> None:
    """Writes a text in UTF-8."""
    with complete_file(path) as temporary:
        temporary.write_bytes(text.encode("utf-8"))


def _nameless(folder: str | PathLike[str]) -> Path:
    return Path(folder) / f"{_PREFIX}{secrets.token_hex(_DIGITS // 2)}"


@contextmanager
def _named_in_errors(path: Path) -> Iterator[None]:
    """Errors name the requested file, not the temporary one."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None
