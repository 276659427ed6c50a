"""Writes keypoints in a chosen format."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike

from memo.keypoints.coco import write_coco
from memo.keypoints.openpose import write_openpose
from memo.keypoints.points import Keypoints, KeypointsError
from memo.keypoints.table import write_csv

__all__ = ["WRITERS", "write_keypoints"]

WRITERS: dict[str, Callable[[str | PathLike[str], Keypoints], tuple[str, ...]]] = {
    "openpose": write_openpose,
    "coco": write_coco,
    "csv": write_csv,
}
"""Formats and their writers: these take path and keypoints and return the joints left out."""


def write_keypoints(path: str | PathLike[str], keypoints: Keypoints, file_format: str) -> tuple[str, ...]:
    """Writes one person's keypoints: "openpose" (a folder), "coco" (results, JSON) or "csv".

    Returns the joints that the format cannot store, which are left out.
    """
    if file_format not in WRITERS:
        raise KeypointsError(f"unknown format {file_format!r}: wanted {', '.join(WRITERS)}")
    return WRITERS[file_format](path, keypoints)
