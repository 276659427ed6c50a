"""MOTChallenge rows: `frame, id, bb_left, bb_top, bb_width, bb_height, conf, x, y, z`.

(Leal-Taixe et al., *MOTChallenge 2015: Towards a Benchmark for Multi-Target Tracking*, section 2.3: frames,
people and pixels are counted from 1; x, y, z is the position of the feet, in metres, -1 if unknown.)

Of a track, one row per frame and person is written: `id` 1 for the first person, in all of that person's
walks; the box of the model's visible contours; the point on the ground below the torso; the track's
similarity as `conf`. For a folder of `memo track` the contours are computed again, with the person and camera
in `run.json`.

Limits: boxes are not clipped to the picture (no field has its size); x and y have no uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo.files import read_text, read_track
from memo.formats.motion import FormatError
from memo.run import contours_of_run
from memo.unfinished import complete_file
from memo.wording import counted

if TYPE_CHECKING:
    from memo.tracking import Track

__all__ = ["boxes_from_contours", "read_motchallenge", "write_motchallenge"]

Array = npt.NDArray[np.float64]

_MAX_NUMBER = 1e9
_BOX = ("left_px", "top_px", "width_px", "height_px")
_WORLD = ("x_m", "y_m", "z_m")


def write_motchallenge(
    path: str | PathLike[str], track: Track | str | PathLike[str], *, up: str = "z"
) -> int:
    """Writes a track, or the track of a folder of `memo track`; returns the number of rows.

    Frames without a box in the picture have no row. `up="y"`: the ground is the plane of x and z, `x, y, z`
    of the world are `x, z, -y` of the file.
    """
    _check_up(up)
    if isinstance(track, str | PathLike):
        of = read_track(track)
        boxes = boxes_from_contours(contours_of_run(track, of))
    else:
        of = track.columns
        boxes = boxes_from_contours(map(track.contours, range(len(track))))
    lines = []
    for row in np.lexsort([of["person"], of["frame"]]).tolist():
        box = boxes[row]
        if not np.isfinite(box).all():
            continue
        size = box[2:] - box[:2]
        sure, x, y = (of[name][row] for name in ("similarity", "x_m", "y_m"))
        ground = (x, y, 0.0) if up == "z" else (x, 0.0, 0.0 - y)
        cells = [
            f"{of['frame'][row] + 1:.0f},{of['person'][row] + 1:.0f}",
            *(f"{value:.2f}" for value in (*(box[:2] + 1), *size)),
            f"{sure:.5f}" if math.isfinite(sure) else "-1",
            *(
                (f"{round(value, 4) + 0.0:.4f}" for value in ground)
                if np.isfinite(ground).all()
                else 3 * ["-1"]
            ),
        ]
        lines.append(",".join(cells) + "\n")
    with complete_file(path) as temporary:
        temporary.write_text("".join(lines), encoding="ascii")
    return len(lines)


def read_motchallenge(path: str | PathLike[str], *, up: str = "z") -> dict[str, npt.NDArray[Any]]:
    """Reads results, detections or ground truth: columns `frame`, `id`, `left_px`, `top_px`, `width_px`,
    `height_px`, `conf`, `x_m`, `y_m`, `z_m` in the order of the file; frames and pixels from 0.

    Rows of 6, 7, 9 (class and visibility last, as of 2016) or 10 numbers, between commas or spaces; NaN if
    a row has no world coordinates. `up` is the file's up axis; the result has Z up.
    """
    _check_up(up)
    path = Path(path)
    rows = (_row(line, f"{path}: line {number}") for number, line in _lines(path))
    values: Array = np.fromiter(rows, np.dtype((np.float64, 10)))  # type: ignore[assignment]
    if not len(values):
        raise FormatError(f"{path}: has no rows")
    columns: dict[str, npt.NDArray[Any]] = {
        "frame": values[:, 0].astype(np.int64) - 1,
        "id": values[:, 1].astype(np.int64),
    }
    boxes = values[:, 2:6] - (1, 1, 0, 0)
    columns |= {name: boxes[:, k] for k, name in enumerate(_BOX)}
    columns["conf"] = values[:, 6]
    world = values[:, 7:] if up == "z" else values[:, [7, 9, 8]] * (1, -1, 1)
    return columns | {name: world[:, k] for k, name in enumerate(_WORLD)}


def _check_up(up: str) -> None:
    if up not in ("z", "y"):
        raise FormatError(f'up must be "z" or "y", got {up!r}')


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines that are not blank, by their number."""
    try:
        text = read_text(path, FormatError)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    return ((number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip())


def _row(line: str, where: str) -> list[float]:
    """The ten numbers of a row, NaN for missing ones."""
    cells = line.split(",") if "," in line else line.split()
    if len(cells) not in (6, 7, 9, 10):
        raise FormatError(f"{where}: {counted(len(cells), 'number')}; MOTChallenge rows have 6, 7, 9 or 10")
    values = []
    for cell in cells:
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not abs(value) <= _MAX_NUMBER or "_" in cell:
            raise FormatError(f"{where}: {cell.strip()[:40]!r} is not a number")
        values.append(value)
    if values[0] != int(values[0]) or values[0] < 1 or values[1] != int(values[1]):
        raise FormatError(f"{where}: the number of a frame, from 1, and the number of a person are needed")
    if values[4] < 0 or values[5] < 0:
        raise FormatError(f"{where}: a box of {values[4]:g} by {values[5]:g} pixels")
    world = values[7:] if len(values) == 10 and values[7:] != [-1, -1, -1] else 3 * [math.nan]
    return [*values[:6], values[6] if len(values) > 6 else math.nan, *world]


# Boxes.


def boxes_from_contours(contours: Iterable[Array]) -> Array:
    """(N, 4) left, top, right, bottom in pixels, for N lists of contours (n, 2, 2); NaN for empty lists."""
    points = [row.reshape(-1, 2) for row in contours]
    boxes = [[*row.min(axis=0), *row.max(axis=0)] if len(row) else 4 * [math.nan] for row in points]
    return np.array(boxes, np.float64).reshape(-1, 4)
