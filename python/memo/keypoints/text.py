"""Text and JSON of keypoint files: read within a size limit, written complete or not at all."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from memo.files import read_text
from memo.keypoints.points import KeypointsError
from memo.unfinished import write_complete

__all__ = [
    "check_one_series",
    "content_of",
    "json_text",
    "last_number",
    "parsed",
    "short",
    "write_text",
]

MAX_FRAME_FILE_BYTES = 64 << 20
MAX_FILE_BYTES = 512 << 20
LONGEST_NAME = 60
_MOST_DIGITS = 255  # names of files are not longer; Python converts 4300


def content_of(path: Path, most: int = MAX_FILE_BYTES) -> str:
    """The text of a file in UTF-8 of at most this many bytes."""
    try:
        return read_text(path, KeypointsError, most)
    except OSError as error:
        raise KeypointsError(f"{path}: cannot be read: {error.strerror or error}") from None


def parsed(where: object, content: str) -> Any:
    """The JSON of a file, or of a text in it."""
    try:
        return json.loads(content)
    except json.JSONDecodeError as error:
        raise KeypointsError(f"{where}: not JSON: {error.msg} in line {error.lineno}") from None
    except (ValueError, RecursionError) as error:
        raise KeypointsError(f"{where}: not JSON that can be read: {short(str(error))}") from None


def json_text(data: Any, like: str) -> str:
    """The data as JSON, with or without spaces as in the original text."""
    compact = re.search(r'"\s*:\s', like) is None
    surrogates = re.search(r"\\u[dD][89a-fA-F]", like) is not None
    return json.dumps(data, ensure_ascii=surrogates, separators=(",", ":") if compact else None)


def write_text(out: Path, text: str) -> None:
    """Writes a file that appears complete or not at all."""
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_complete(out, text)
    except OSError as error:
        raise KeypointsError(f"{out}: cannot be written: {error.strerror or error}") from None


def last_number(text: str) -> int | None:
    """The last number in a name: the frame number, if it is at most `MAX_FRAME`."""
    digits = re.findall(r"[0-9]+", text)
    return int(digits[-1]) if digits and len(digits[-1]) <= _MOST_DIGITS else None


def check_one_series(path: Path, names: dict[int, str], frame: int, name: str) -> None:
    """Adds the image of a frame to those before; refuses one that is not of their camera or video.

    Images of one camera have names that differ by the last number alone, that of the frame.
    """
    first = next(iter(names.values()), name)
    other = names.setdefault(frame, name)
    if other != name:
        raise KeypointsError(
            f"{path}: {short(other)} and {short(name)} are both frame {frame}; one camera per file"
        )
    if _without_frame(first) != _without_frame(name):
        raise KeypointsError(
            f"{path}: {short(first)} and {short(name)} differ by more than the number of the frame; "
            "one camera and one video per file"
        )


def _without_frame(name: str) -> str:
    """The name of an image without its ending and the number of its frame."""
    stem = name.rpartition(".")[0] or name
    return re.sub(r"[0-9]+(?=[^0-9]*$)", "*", stem, count=1)


def short(value: Any) -> str:
    """A value as text for a message."""
    text = (
        value
        if isinstance(value, str)
        else type(value).__name__
        if isinstance(value, dict | list)
        else repr(value)
    )
    return text if len(text) <= LONGEST_NAME else f"{text[: LONGEST_NAME - 3]}..."
