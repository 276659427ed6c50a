"""Converts pixels of pictures that were averaged down to pixels of their video.

Pixel centres are whole numbers, so that n pixels averaged to one have their centre at

    u_video = n (u + 1/2) - 1/2

independent of any rest at the right and at the bottom.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["camera_of_video", "columns_of_video", "of_averaged", "of_video", "shrink_of_table"]

Array = npt.NDArray[np.float64]


def of_video(pixels: npt.ArrayLike, n: int) -> Array:
    """Pixels of pictures averaged n by n, of any shape, as pixels of the video."""
    return np.asarray((np.asarray(pixels, np.float64) + 0.5) * n - 0.5)


def of_averaged(pixels: npt.ArrayLike, n: int) -> Array:
    """Pixels of the video as pixels of its pictures averaged n by n."""
    return np.asarray((np.asarray(pixels, np.float64) + 0.5) / n - 0.5)


def columns_of_video(columns: Mapping[str, npt.NDArray[Any]], n: int) -> dict[str, npt.NDArray[Any]]:
    """Columns of a track, with those in pixels (`_u_px`, `_v_px`) converted to pixels of the video."""
    return {
        name: of_video(values, n) if n > 1 and name.endswith(("_u_px", "_v_px")) else values
        for name, values in columns.items()
    }


def camera_of_video(
    parameters: Mapping[str, Any], n: int, size: Sequence[int] | None = None
) -> dict[str, Any]:
    """`Camera.parameters()` of pictures averaged n by n, converted to the video with that `size`, pixels.

    Without a size, it is n times that of the pictures.
    """
    found = dict(parameters)
    found["size"] = [n * side for side in parameters["size"]] if size is None else list(size)
    if "matrix" in parameters:
        (fx, skew, cx), (_, fy, cy), last = parameters["matrix"]
        cx, cy = of_video([cx, cy], n).tolist()
        found["matrix"] = [[n * fx, n * skew, cx], [0.0, n * fy, cy], last]
    return found


def shrink_of_table(path: str | PathLike[str]) -> int:
    """Pixels of the video per pixel of a `track.csv` (or of the one in a folder), along each axis.

    It is 1, except for tables of older versions of memo, which held pixels of the pictures that were tracked.
    Their `run.json` has no `pixels_of`.
    """
    path = Path(path)
    try:
        text = ((path if path.is_dir() else path.parent) / "run.json").read_text(encoding="utf-8")
        run = json.loads(text)
    except (OSError, ValueError, RecursionError):
        return 1
    if not isinstance(run, dict) or "pixels_of" in run:
        return 1
    shrink = run.get("shrink", 1)
    return shrink if isinstance(shrink, int) and not isinstance(shrink, bool) and shrink > 1 else 1
