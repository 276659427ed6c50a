"""What several commands are given, checked before any work."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import memo
from memo.cli.delivery import InputError
from memo.files import read_tsai_xml


def load_camera(path: Path, name: str | None) -> Any:
    if not path.is_file():
        raise InputError(f"{path}: no such camera file")
    if path.suffix.lower() == ".xml":
        return memo.Camera.from_tsai(**read_tsai_xml(path))
    return memo.Camera.from_toml(str(path), name=name)


def checked_height(height_m: float) -> float:
    if 50 <= height_m <= 250:
        raise InputError(f"--height {height_m:g} looks like centimetres: give --height {height_m / 100:g}")
    if not (math.isfinite(height_m) and 0.5 <= height_m <= 2.5):
        raise InputError(f"--height {height_m:g} is not the height of a person in metres (0.5 to 2.5)")
    return height_m


def frame_range(text: str) -> tuple[int, int | None]:
    """`--frames A:B` as first frame and the one after the last, None for the end."""
    start, colon, stop = text.partition(":")
    try:
        first, end = int(start or 0), int(stop) if stop else None
    except ValueError:
        first, end, colon = 0, None, ""
    if not colon or first < 0 or (end is not None and end <= first):
        raise InputError(f"--frames {text} is not A:B with 0 <= A < B")
    return first, end


def check_apart(read: Iterable[Path | None], written: Iterable[Path]) -> None:
    """Refuses to write over what is read, by whatever name or link, or into a folder that is read."""
    for file in written:
        for source in read:
            if source is None:
                continue
            if file.resolve() == source.resolve() or (
                file.exists() and source.exists() and file.samefile(source)
            ):
                raise InputError(f"{file}: is what was read; write to another place")
            if source.is_dir() and file.parent.resolve() == source.resolve():
                raise InputError(f"{source}: is the folder that was read; write to another place")


def check_writable(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise InputError(f"{out}: cannot be written to: {error.strerror}") from None
