"""MOTChallenge rows: `frame, id, bb_left, bb_top, bb_width, bb_height, conf, x, y, z`.

(Leal-Taixe et al., *MOTChallenge 2015: Towards a Benchmark for Multi-Target Tracking*, section 2.3: frames,
numbers of people and pixels count from 1; x, y, z is where the feet stand, in metres, -1 where unknown.)

What is written of a track: a row a frame and walk, `id` 1 for the first walk; the box of the model's visible
contours; the point of the ground below the torso; the track's similarity as `conf`. Of a saved track only
joints are known, and the box is that of the body they belong to, see `boxes_from_joints`.

What it cannot do: clip boxes to the picture (no field says its size); say how sure x and y are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from memo.files import JOINTS, complete_file

if TYPE_CHECKING:
    from memo.tracking import Track

__all__ = [
    "BoxesError",
    "boxes_from_contours",
    "boxes_from_joints",
    "read_motchallenge",
    "write_motchallenge",
]

Array = npt.NDArray[np.float64]

_MAX_BYTES = 256 << 20
_MAX_NUMBER = 1e9
_BOX = ("left_px", "top_px", "width_px", "height_px")
_WORLD = ("x_m", "y_m", "z_m")

# Of the model, in body heights (crates/memo-core/src/model/body.rs): what reaches beyond the joints.
_UPPER_ARM = 0.186
_CROWN_ABOVE_SHOULDERS = 0.182
_HEAD_HALF_WIDTHS = (0.054, 0.044)  # along and across the way the person faces
_HAND = 0.070
_TOE, _HEEL = 0.117, 0.035  # before and behind the ankle
_SOLE_BELOW_ANKLE = 0.039
_LIMB_HALF_WIDTH = 0.030


class BoxesError(ValueError):
    """MOTChallenge rows that cannot be read or written; the message says which file and line, in one line."""

    def __init__(self, message: str) -> None:
        # Cells of damaged files may hold anything.
        super().__init__("".join(character if character.isprintable() else "?" for character in message))


def write_motchallenge(
    path: str | PathLike[str], track: Track | Mapping[str, npt.ArrayLike], *, up: Literal["z", "y"] = "z"
) -> None:
    """Writes a track, or the columns of `track.csv`; frames without a box in the picture have no row.

    `up="y"`: the ground is the plane of x and z, `x, y, z` of the world are `x, z, -y` of the file.
    """
    columns: Mapping[str, npt.ArrayLike]
    if isinstance(track, Mapping):
        columns, boxes = track, boxes_from_joints(track)
    else:
        columns, boxes = track.columns, boxes_from_contours(track)
    _check_up(up)
    of = {
        name: np.asarray(columns[name], np.float64) for name in ("frame", "walk", "similarity", "x_m", "y_m")
    }
    lines = []
    for row in np.lexsort([of["walk"], of["frame"]]).tolist():
        box = boxes[row]
        if not np.isfinite(box).all():
            continue
        size = box[2:] - box[:2]
        sure, x, y = (of[name][row] for name in ("similarity", "x_m", "y_m"))
        ground = (x, y, 0.0) if up == "z" else (x, 0.0, 0.0 - y)
        cells = [
            f"{of['frame'][row] + 1:.0f},{of['walk'][row] + 1:.0f}",
            *(f"{value:.2f}" for value in (*(box[:2] + 1), *size)),
            f"{sure:.5f}" if math.isfinite(sure) else "-1",
            *((f"{value:.4f}" for value in ground) if np.isfinite(ground).all() else 3 * ["-1"]),
        ]
        lines.append(",".join(cells) + "\n")
    with complete_file(path) as temporary:
        temporary.write_text("".join(lines), encoding="ascii")


def read_motchallenge(
    path: str | PathLike[str], *, up: Literal["z", "y"] = "z"
) -> dict[str, npt.NDArray[Any]]:
    """Reads results, detections or ground truth: columns `frame`, `id`, `left_px`, `top_px`, `width_px`,
    `height_px`, `conf`, `x_m`, `y_m`, `z_m` in the order of the file; frames and pixels from 0.

    Rows of 6, 7, 9 (class and visibility last, as of 2016) or 10 numbers, between commas or spaces; NaN where
    a row has no world coordinates. `up` is the file's up axis; the result has Z up.
    """
    _check_up(up)
    path = Path(path)
    rows = (_row(line, f"{path}: line {number}") for number, line in _lines(path))
    values: Array = np.fromiter(rows, np.dtype((np.float64, 10)))  # type: ignore[assignment]
    if not len(values):
        raise BoxesError(f"{path}: no row in it")
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
        raise BoxesError(f'up must be "z" or "y", got {up!r}')


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The lines that are not blank, by their number."""
    try:
        size = path.stat().st_size
        if size > _MAX_BYTES:
            raise BoxesError(f"{path}: {size >> 20} MiB; at most {_MAX_BYTES >> 20} MiB are read")
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BoxesError(f"{path}: not text in UTF-8 (byte {error.start})") from None
    except OSError as error:
        raise BoxesError(f"{path}: cannot be read: {error.strerror or error}") from None
    return ((number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip())


def _row(line: str, where: str) -> list[float]:
    """The ten numbers of a row, NaN for those it has not."""
    cells = line.split(",") if "," in line else line.split()
    if len(cells) not in (6, 7, 9, 10):
        raise BoxesError(f"{where}: {len(cells)} numbers; MOTChallenge rows have 6, 7, 9 or 10")
    values = []
    for cell in cells:
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not abs(value) <= _MAX_NUMBER or "_" in cell:
            raise BoxesError(f"{where}: {cell.strip()[:40]!r} is not a number")
        values.append(value)
    if values[0] != int(values[0]) or values[0] < 1 or values[1] != int(values[1]):
        raise BoxesError(f"{where}: the number of a frame, from 1, and that of a person are needed")
    if values[4] < 0 or values[5] < 0:
        raise BoxesError(f"{where}: a box of {values[4]:g} by {values[5]:g} pixels")
    world = values[7:] if len(values) == 10 and values[7:] != [-1, -1, -1] else 3 * [math.nan]
    return [*values[:6], values[6] if len(values) > 6 else math.nan, *world]


# Boxes.


def boxes_from_contours(track: Track) -> Array:
    """(N, 4) left, top, right, bottom in pixels of the model's visible contours; NaN where none are."""
    boxes = np.full((sum(map(len, track.walks)), 4), np.nan)
    for row, box in enumerate(boxes):
        points = track.contours(row).reshape(-1, 2)
        if len(points):
            box[:] = *points.min(axis=0), *points.max(axis=0)
    return boxes


def boxes_from_joints(columns: Mapping[str, npt.ArrayLike]) -> Array:
    """(N, 4) left, top, right, bottom in pixels of the body around the joints of `track.csv`; NaN if unknown.

    Head, hands and feet are where the model has them, given its joints, and come into the picture by the
    affine map that takes the twelve joints of the row to their pixels: the camera, near the body. On tracked
    walks the sides are on average within 1 % of the body height of `boxes_from_contours`, the top within 3 %,
    as the height of a fitted person's shoulders is not in the table.
    """
    in_world = _joints(columns, ("x_m", "y_m", "z_m"))
    in_picture = _joints(columns, ("u_px", "v_px"))
    heading_rad = np.asarray(columns["heading_rad"], np.float64)
    boxes = np.full((len(in_world), 4), np.nan)
    known = np.isfinite(in_world).all(axis=(1, 2)) & np.isfinite(in_picture).all(axis=(1, 2))
    for row in np.flatnonzero(known & np.isfinite(heading_rad)):
        points, half_width_m = _ends(in_world[row], heading_rad[row])
        affine, *_ = np.linalg.lstsq(_homogeneous(in_world[row]), in_picture[row], rcond=None)
        ends = _homogeneous(points) @ affine
        half_width_px = half_width_m * np.linalg.norm(affine[:3], 2)
        low = np.minimum(in_picture[row].min(axis=0) - half_width_px, ends.min(axis=0))
        high = np.maximum(in_picture[row].max(axis=0) + half_width_px, ends.max(axis=0))
        boxes[row] = *low, high[0], ends[:, 1].max()
    return boxes


def _joints(columns: Mapping[str, npt.ArrayLike], axes: tuple[str, ...]) -> Array:
    """(N, 12, axes)"""
    absent = sorted({f"{joint}_{axis}" for joint in JOINTS for axis in axes} - set(columns))
    if absent:
        raise BoxesError(f"not the columns of a track: no {absent[0]}")
    return np.stack(
        [
            np.stack([np.asarray(columns[f"{joint}_{axis}"], np.float64) for axis in axes], axis=-1)
            for joint in JOINTS
        ],
        axis=1,
    )


def _ends(joints: Array, heading_rad: float) -> tuple[Array, float]:
    """Ends of head, hands and feet (M, 3) and half the width of a limb, metres, from the joints (12, 3)."""
    at = dict(zip(JOINTS, joints, strict=True))
    height_m = float(np.linalg.norm(at["right_shoulder"] - at["right_elbow"])) / _UPPER_ARM
    forward = np.array([math.cos(heading_rad), math.sin(heading_rad), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    left = np.cross(up, forward)
    crown = (at["right_shoulder"] + at["left_shoulder"]) / 2 + height_m * _CROWN_ABOVE_SHOULDERS * up
    along, across = height_m * _HEAD_HALF_WIDTHS[0] * forward, height_m * _HEAD_HALF_WIDTHS[1] * left
    ends = [crown + along, crown - along, crown + across, crown - across]
    for side in ("right", "left"):
        ends.append(at[f"{side}_wrist"] + height_m * _HAND * _unit(at[f"{side}_wrist"] - at[f"{side}_elbow"]))
        ankle = at[f"{side}_ankle"]
        down = _unit(ankle - at[f"{side}_knee"])
        toes = _unit(np.cross(down, left))
        toes = toes if toes @ forward > 0 else -toes
        sole = ankle + height_m * _SOLE_BELOW_ANKLE * down
        ends += [sole + height_m * _TOE * toes, sole - height_m * _HEEL * toes]
    return np.array(ends), height_m * _LIMB_HALF_WIDTH


def _unit(vector: Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0 else vector


def _homogeneous(points: Array) -> Array:
    return np.column_stack([points, np.ones(len(points))])
