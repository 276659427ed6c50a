"""`memo report`: a folder of results as one HTML file, readable without a network and without memo.

The page holds pictures, a 3D figure that can be turned, curves and tables, and for a tracked walk what
the model was matched to in each frame. It needs the `app` extra.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from memo.given import nothing_at
from memo.report.choice import Choice
from memo.report.comparison import comparison_page
from memo.report.page import Page
from memo.report.planar import planar_page
from memo.report.posture import posture_page
from memo.report.track import track_page
from memo.unfinished import complete_file

__all__ = ["KINDS", "Report", "write_comparison", "write_report"]

KINDS = {"track.csv": "memo track", "postures.json": "memo posture", "points3d.csv": "memo planar"}
"""The file that identifies a kind of folder, and the command that writes it."""


@dataclass(frozen=True)
class Report:
    """What was written."""

    path: Path
    """The HTML file."""
    kind: str
    """The command whose results it shows."""
    bytes: int
    """Size of the file."""
    contents: dict[str, Any]
    """Number of pictures and explanations in the page, their spacing in frames (of a comparison: `walks` and
    `sentences`), and
    `notes`: what could not be shown, and why."""


def write_report(
    folder: str | PathLike[str],
    out: str | PathLike[str] | None = None,
    *,
    frames: tuple[int, int | None] = (0, None),
    every: int | None = None,
    why: bool = True,
    video: str | PathLike[str] | None = None,
    progress: Callable[[str, int, int | None], object] | None = None,
) -> Report:
    """Writes `out`, by default `report.html` in the folder, from the results of a command (`KINDS`).

    `frames` are those from the first up to, not including, the second; every `every`-th of them is shown,
    by default as many as keep the file under about 25 MB. `why=False` leaves out the explanations of the
    frames of a walk, for which the video is read again. `video` is the path of the video, if it was moved.
    `progress` is called with the current step, the number of its frames done and the total, None if
    unknown.

    Raises ValueError if the folder holds no such results or a table in it cannot be used.
    """
    folder = Path(folder)
    kind = _kind(folder)
    choice = Choice(*frames, every, why)
    if kind == "memo track":
        page, contents = track_page(folder, choice, progress, None if video is None else Path(video))
    else:
        page, contents = (posture_page if kind == "memo posture" else planar_page)(folder, choice)
    return _written(page, folder / "report.html" if out is None else Path(out), kind, contents)


def write_comparison(
    first: str | PathLike[str],
    second: str | PathLike[str],
    out: str | PathLike[str] | None = None,
    *,
    walks: tuple[int | None, int | None] = (None, None),
) -> Report:
    """Writes `out`, by default `comparison.html` in the first folder: a walk of each of two folders of
    `memo track` beside each other.

    `walks` are their numbers in the folders, by default those of the longest. The folders may be the same if
    the walks differ. Raises ValueError if a folder lacks a table or the walk.
    """
    folders = (Path(first), Path(second))
    for folder in folders:
        if (kind := _kind(folder)) != "memo track":
            raise ValueError(f"{folder}: holds results of {kind}; walks of memo track are compared")
    page, contents = comparison_page(folders, walks)
    path = folders[0] / "comparison.html" if out is None else Path(out)
    return _written(page, path, "memo track", contents)


def _written(page: Page, path: Path, kind: str, contents: dict[str, Any]) -> Report:
    # A file name that is no text is shown by its bytes.
    written = page.html().encode("utf-8", "backslashreplace")
    with complete_file(path) as temporary:
        temporary.write_bytes(written)
    return Report(path, kind, len(written), contents)


def _kind(folder: Path) -> str:
    if folder.is_file():
        raise ValueError(f"{folder}: is a file; give the folder it is in")
    if not folder.is_dir():
        raise ValueError(nothing_at(folder, "folder"))
    found = [command for name, command in KINDS.items() if (folder / name).is_file()]
    if len(found) == 1:
        return found[0]
    if found:
        raise ValueError(
            f"{folder}: holds results of {' and of '.join(found)}; give a folder with one of them"
        )
    known = ", ".join(f"{name} of {command}" for name, command in KINDS.items())
    raise ValueError(f"{folder}: holds no results for a report ({known})")
