"""For calibration: tables of points, people and boards in pictures, and the ground drawn over a picture.

Needs the `app` extra; the search for checkerboards needs the `checkerboard` extra.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import memo
from memo.extras import install
from memo.given import nothing_at
from memo.spreadsheet import CsvRows, Error
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = [
    "BoardLens",
    "Boards",
    "PointTable",
    "draw_ground",
    "find_boards",
    "lens_from_boards",
    "read_picture",
    "read_points_csv",
    "rectangles",
    "standing_place",
    "write_picture",
]

Array = npt.NDArray[np.float64]
Luma = npt.NDArray[np.uint8]

PERSON_M = 1.7
POINT_COLUMNS = ("x_m", "y_m", "z_m", "u_px", "v_px")
"""Columns that a table of points must have; others are ignored."""

_X, _Y, _Z, _GRID, _PERSON = (230, 60, 60), (60, 200, 60), (90, 140, 255), (255, 255, 255), (240, 228, 66)
_REACH_M = 25.0  # reach of the drawn grid from the ground in the picture's lower half
_MOST_LINES = 80
# Views of 10 to 120 degrees, as focal lengths in longer sides of the picture.
_USUAL_FOCAL = (0.29, 6.0)
# Of drawn boards tilted by up to 2 degrees to either side, focal lengths came out up to 30 times too long
# with standard deviations of 0.1 %, of those tilted by up to 4 degrees 2 to 11 % too short; from 8 degrees on
# they are right to 2 %.
_LEAST_TILT_DEG = 10.0


@dataclass(frozen=True)
class PointTable:
    """Measured points."""

    places: Array
    """(N, 3) metres."""
    pixels: Array
    """(N, 2) pixels."""
    lines: tuple[int, ...]
    """(N,) lines of the file, from 1."""


def read_points_csv(path: str | PathLike[str]) -> PointTable:
    """Reads `x_m,y_m,z_m,u_px,v_px`; every error names file, line and column."""
    rows: list[list[float]] = []
    lines: list[int] = []
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            table = CsvRows(file, strip=True)
            header = next(table, [])
            absent = [name for name in POINT_COLUMNS if name not in header]
            if absent:
                hint = "" if len(header) > 1 else "; columns must be separated by commas"
                raise ValueError(f"{path}: line 1: missing columns {', '.join(absent)}{hint}")
            for cells in table:
                if not any(cells):
                    continue
                row = dict(zip_longest(header, cells[: len(header)]))
                rows.append([_number(path, table.line_num, name, row[name]) for name in POINT_COLUMNS])
                lines.append(table.line_num)
    except (Error, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a table of points: {error}") from None
    except FileNotFoundError:
        raise ValueError(nothing_at(path)) from None
    except OSError as error:
        raise ValueError(f"{path}: cannot be read: {error.strerror}") from None
    numbers = np.array(rows, np.float64).reshape(-1, 5)
    return PointTable(
        np.ascontiguousarray(numbers[:, :3]), np.ascontiguousarray(numbers[:, 3:]), tuple(lines)
    )


def _number(path: str | PathLike[str], line: int, name: str, text: str | None) -> float:
    try:
        number = float(text or "")
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{path}: line {line}: {name} must be a finite number, got {text!r}")
    return number


def read_picture(path: str | PathLike[str]) -> Luma:
    """Grey values (H, W) of an image, or of the first frame of a video."""
    import av

    from memo.video import VideoError

    if not Path(path).exists():
        raise VideoError(nothing_at(path, "picture"))
    try:
        with av.open(str(Path(path).absolute())) as container:
            for frame in container.decode(video=0):
                return np.asarray(frame.to_ndarray(format="gray"), np.uint8)
    except (av.FFmpegError, IndexError, OSError) as error:
        raise VideoError(f"{path}: cannot be read as a picture: {error}") from None
    raise VideoError(f"{path}: holds no picture")


def rectangles(frames: Sequence[Luma]) -> tuple[Array, Array]:
    """Feet and heads (N, 2), pixels, of the silhouettes that do not touch the picture's border.

    They are the middles of the lowest and of the highest tenth of rows: arms and legs would shift the
    middle of the bounding box.
    """
    feet, heads = [], []
    for mask in memo.silhouettes(list(frames)):
        rows = np.flatnonzero(mask.any(axis=1))
        columns = np.flatnonzero(mask.any(axis=0))
        height, width = mask.shape
        if not len(rows) or rows[0] < 2 or rows[-1] > height - 3 or columns[0] < 2 or columns[-1] > width - 3:
            continue
        tall = rows[-1] - rows[0] + 1
        if tall < 20 or tall < 1.5 * (columns[-1] - columns[0] + 1):
            continue  # legs apart, or nobody visible
        low, high = (
            np.flatnonzero(mask[rows[0] + int(first * tall) : rows[0] + max(int(last * tall), 1)].any(axis=0))
            for first, last in ((0.9, 1.0), (0.0, 0.1))
        )
        if len(low) and len(high):
            feet.append(((low[0] + low[-1]) / 2, rows[-1] + 0.5))
            heads.append(((high[0] + high[-1]) / 2, rows[0] - 0.5))
    return np.array(feet, np.float64).reshape(-1, 2), np.array(heads, np.float64).reshape(-1, 2)


# The ground drawn over a picture.


def standing_place(camera: memo.Camera) -> tuple[tuple[float, float, float], str] | None:
    """A place on the ground in the picture and its name: the origin, else a place in the lower middle."""
    width, height = camera.size
    pixels = [(width / 2, height * share) for share in (0.6, 0.7, 0.8, 0.9, 0.97, 0.5)]
    shown = [(float(x), float(y), float(z)) for x, y, z in camera.ground_points(pixels)]
    candidates = [(0.0, 0.0, 0.0), *shown]
    for place, name in zip(candidates, ["the origin"] + ["the picture's middle"] * len(pixels), strict=True):
        if not np.isfinite(place).all():
            continue
        u, v = camera.project(np.array([place]))[0]
        if 0 <= u < width and 0 <= v < height and np.isfinite(camera.pixel_height(place, PERSON_M)):
            return place, name
    return None


def draw_ground(luma: Luma, camera: memo.Camera, marks: Array | None = None) -> npt.NDArray[np.uint8]:
    """The picture (H, W, 3) with squares of 1 m on the ground, axes of 1 m, and a person of 1.7 m.

    `marks` (N, 2, 2) are segments from given to projected pixels.
    """
    from memo.overlay import draw_segments, draw_text

    rgb = np.stack([luma // 3 * 2 + 20] * 3, axis=2).astype(np.uint8)
    thin, thick = max(1.0, luma.shape[0] / 700), max(2.0, luma.shape[0] / 300)
    draw_segments(rgb, _projected(camera, _grid(camera)), _GRID, thin, opacity=0.6)
    for axis, colour in enumerate((_X, _Y, _Z)):
        tip = np.eye(3)[axis]
        draw_segments(rgb, _projected(camera, [np.stack([np.zeros(3), tip])]), colour, thick)
    place = standing_place(camera)
    if place is not None:
        draw_segments(rgb, _projected(camera, _person(camera, np.array(place[0]))), _PERSON, thick)
        px = camera.pixel_height(place[0], PERSON_M)
        draw_text(rgb, f"person {PERSON_M} m at {place[1]}: {px:.0f} px", _PERSON)
    draw_text(rgb, "squares 1 m; axes x red, y green, z blue", line=1)
    if marks is not None and len(marks):
        draw_segments(rgb, np.asarray(marks, np.float64), (255, 60, 255), thick)
        around = np.array([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]]) * 3 * thick
        crosses = (marks[:, None, None, 0] + around[None]).reshape(-1, 2, 2)
        draw_segments(rgb, crosses, (255, 60, 255), thin)
    return rgb


def _grid(camera: memo.Camera) -> list[Array]:
    """Lines on the ground at a spacing of one metre, over the visible ground."""
    width, height = camera.size
    u, v = np.meshgrid(np.linspace(0, width - 1, 15), np.linspace(0, height - 1, 25))
    ground = camera.ground_points(np.column_stack([u.ravel(), v.ravel()]))[:, :2]
    ground = ground[np.isfinite(ground).all(axis=1)]
    if not len(ground):
        return []
    near = ground[np.argmin(np.hypot(*(ground - np.array(camera.position)[:2]).T))]
    seen = ground[np.hypot(*(ground - near).T) < _REACH_M]
    low, high = np.floor(seen.min(axis=0)), np.ceil(seen.max(axis=0))
    lines: list[Array] = []
    for axis in (0, 1):
        other = 1 - axis
        along = np.arange(low[other], high[other] + 0.01, 0.25)
        for at in np.arange(low[axis], high[axis] + 0.5)[:_MOST_LINES]:
            line = np.zeros((len(along), 3))
            line[:, axis], line[:, other] = at, along
            lines.append(line)
    return lines


def _person(camera: memo.Camera, foot: Array) -> list[Array]:
    """A line figure that faces the camera: legs, trunk, arms, head."""
    to_camera = np.array(camera.position) - foot
    side = np.array([-to_camera[1], to_camera[0], 0.0])
    side /= max(np.hypot(*side[:2]), 1e-9)

    def at(across: float, share: float) -> Array:
        return np.asarray(foot + side * across + np.array([0, 0, PERSON_M * share]))

    turn = np.linspace(0, 2 * math.pi, 25)
    head = np.stack([at(0.09 * math.cos(a), 0.935 + 0.065 * math.sin(a)) for a in turn])
    strokes: list[list[tuple[float, float]]] = [
        [(-0.12, 0), (-0.1, 0.28), (-0.09, 0.53), (0.09, 0.53), (0.1, 0.28), (0.12, 0)],
        [(0, 0.53), (0, 0.87)],
        [(-0.27, 0.48), (-0.24, 0.63), (-0.18, 0.81), (0.18, 0.81), (0.24, 0.63), (0.27, 0.48)],
    ]
    return [head, *(np.stack([at(across, share) for across, share in stroke]) for stroke in strokes)]


def _projected(camera: memo.Camera, lines: Iterable[Array]) -> Array:
    """Lines of world points as segments (N, 2, 2) in pixels."""
    pieces = [np.zeros((0, 2, 2))]
    for line in lines:
        # Short pieces, so that a lens bends straight lines and pieces behind the camera can be left out.
        share = np.linspace(0, 1, 9)[:-1, None]
        fine = [start + (end - start) * share for start, end in pairwise(line)]
        pixels = camera.project(np.ascontiguousarray(np.concatenate([*fine, line[-1:]])))
        pieces.append(np.stack([pixels[:-1], pixels[1:]], axis=1))
    segments = np.concatenate(pieces)
    far = 20 * max(camera.size)
    return np.asarray(segments[(np.abs(segments) < far).all(axis=(1, 2))])


def write_picture(path: Path, rgb: npt.NDArray[np.uint8]) -> Path:
    """Writes a picture as PNG."""
    from matplotlib.image import imsave

    with complete_file(path) as temporary:
        imsave(temporary, rgb, format="png")
    return path


# Checkerboards.


@dataclass(frozen=True)
class Boards:
    """Boards found in pictures of the same size."""

    size: tuple[int, int]
    """Width and height of the pictures, pixels."""
    corners: tuple[int, int]
    """Inner corners along both sides of the board."""
    found: dict[Path, Array]
    """The corners (N, 2) in each picture, row by row, pixels."""
    without: dict[Path, str]
    """Pictures that are not used, with the reason."""
    are_squares: bool
    """Whether the given numbers were squares; else they were inner corners."""


def _cv2() -> Any:
    try:
        import cv2
    except ImportError:
        packages = install("checkerboard", "opencv-python-headless")
        raise ValueError(f"checkerboards need OpenCV: {packages}") from None
    return cv2


def find_boards(
    paths: Sequence[Path],
    squares: tuple[int, int],
    progress: Callable[[int, int], object] | None = None,
) -> Boards:
    """Searches pictures for a board of this many squares, then for one of this many inner corners.

    `progress` is called with the pictures searched and the total, again from 0 for the inner corners.
    """
    without: dict[Path, str] = {}
    pictures: dict[Path, Luma] = {}
    for path in paths:
        try:
            pictures[path] = np.ascontiguousarray(read_picture(path))
        except ValueError as error:
            without[path] = str(error)
    if not pictures:
        raise ValueError("no picture could be read")
    sizes = [luma.shape[::-1] for luma in pictures.values()]
    size = max(dict.fromkeys(sizes), key=sizes.count)
    for path in [path for path, luma in pictures.items() if luma.shape[::-1] != size]:
        width, height = pictures.pop(path).shape[::-1]
        without[path] = f"{width}x{height} pixels, most have {size[0]}x{size[1]}"
    for are_squares in (True, False):
        corners = (squares[0] - are_squares, squares[1] - are_squares)
        if min(corners) < 2:
            continue
        found = {}
        for done, (path, picture) in enumerate(pictures.items(), 1):
            board = _corners(picture, corners)
            if board is not None:
                found[path] = board
            if progress is not None:
                progress(done, len(pictures))
        if found:
            break
    without |= {path: "no board was found" for path in pictures if path not in found}
    return Boards((int(size[0]), int(size[1])), corners, found, without, are_squares)


def _corners(luma: Luma, corners: tuple[int, int]) -> Array | None:
    cv2 = _cv2()
    flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, board = cv2.findChessboardCornersSB(luma, corners, flags=flags)
    return np.asarray(board, np.float64).reshape(-1, 2) if found else None


def board_places(corners: tuple[int, int], square_m: float) -> Array:
    """Places (N, 3) of the inner corners, metres, the board in z = 0."""
    across, along = np.meshgrid(np.arange(corners[0]), np.arange(corners[1]))
    places = np.stack([across.ravel(), along.ravel(), np.zeros(across.size)], axis=1)
    return np.asarray(places * square_m, np.float64)


@dataclass(frozen=True)
class BoardLens:
    """A lens calibrated from boards."""

    text: str
    """The lens as a TOML section without rotation and translation."""
    rms_px: float
    focal_px: tuple[float, float]
    focal_sd_px: tuple[float, float]
    error_px: dict[Path, float]
    """Root mean square distance of the corners in each picture."""


def lens_from_boards(boards: Boards, square_m: float) -> BoardLens:
    """Focal lengths, principal point and k1, k2, p1, p2 by OpenCV's `calibrateCameraExtended`."""
    cv2 = _cv2()
    if len(boards.found) < 3:
        raise ValueError(
            f"the board was found in {counted(len(boards.found), 'picture')}:"
            " 3 are needed, with different tilts of the board"
        )
    places = board_places(boards.corners, square_m).astype(np.float32)
    pixels = [found.astype(np.float32).reshape(-1, 1, 2) for found in boards.found.values()]
    rms, matrix, lens, turns, _, sd, _, errors = cv2.calibrateCameraExtended(
        [places] * len(pixels), pixels, boards.size, None, None, flags=cv2.CALIB_FIX_K3
    )
    sd = np.asarray(sd).ravel()
    focal, focal_sd = (float(matrix[0, 0]), float(matrix[1, 1])), (float(sd[0]), float(sd[1]))
    normals = np.array([cv2.Rodrigues(turn)[0][:, 2] for turn in turns])
    tilted_deg = np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1, 1)))
    longest = max(boards.size)
    is_unusual = not _USUAL_FOCAL[0] * longest < min(focal) <= max(focal) < _USUAL_FOCAL[1] * longest
    is_loose = max(focal_sd) > 0.25 * min(focal)
    if not np.isfinite(matrix).all() or is_loose or is_unusual or tilted_deg < _LEAST_TILT_DEG:
        raise ValueError(
            f"the boards do not determine the focal length ({focal[0]:.0f} ± {focal_sd[0]:.0f} px): their "
            f"tilts differ by up to {tilted_deg:.0f} degrees; tilt the board towards the camera, by another "
            "angle in every picture, so that they differ by 20 degrees or more"
        )
    rows = ", ".join(str([float(x) for x in row]) for row in matrix)
    text = (
        f'[lens]\nname = "lens"\nsize = [{boards.size[0]}, {boards.size[1]}]\nmatrix = [{rows}]\n'
        f"distortions = {[float(k) for k in np.ravel(lens)[:4]]}\nfisheye = false\n"
    )
    error_px = dict(zip(boards.found, map(float, np.ravel(errors)), strict=True))
    return BoardLens(text, float(rms), focal, focal_sd, error_px)
