"""Input of commands and manifests, checked before any work.

Messages name the options of the command line; a manifest replaces them with its columns.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import memo
from memo.run import NAME as RUN
from memo.run import read_run

__all__ = [
    "Box",
    "InputError",
    "Point",
    "UsageError",
    "check_apart",
    "check_default_out",
    "check_writable",
    "checked_fov",
    "checked_height",
    "default_out",
    "frame_range",
    "given_camera",
    "heights",
    "is_url",
    "load_camera",
    "nothing_at",
    "place_in_frame",
    "point_in_frame",
    "tracker_options",
    "two_sides",
]


class InputError(ValueError):
    """A mistake in the user's input; the message is one line."""


class UsageError(InputError):
    """Options that have no meaning, or none together."""


class Point(NamedTuple):
    """A point of the picture, pixels of the video, in a frame of the video."""

    u_px: float
    v_px: float
    frame: int

    def __str__(self) -> str:
        return f"{self.u_px:g},{self.v_px:g}@{self.frame}"


class Box(NamedTuple):
    """A box in the picture, pixels of the video, in a frame of the video."""

    left_px: float
    top_px: float
    width_px: float
    height_px: float
    frame: int

    def __str__(self) -> str:
        return f"{self.left_px:g},{self.top_px:g},{self.width_px:g},{self.height_px:g}@{self.frame}"


_NUMBER = r"(\d+(?:\.\d+)?)"
_POINT = re.compile(rf"{_NUMBER},{_NUMBER}@(\d+)")
_BOX = re.compile(rf"{_NUMBER},{_NUMBER},{_NUMBER},{_NUMBER}@(\d+)")
# At least two letters: one letter is a Windows drive. `Path` removes one of the two slashes.
_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):/+(.*)", re.DOTALL)


def is_url(path: str | PathLike[str]) -> bool:
    """Whether a path looks like a URL."""
    return _URL.fullmatch(os.fspath(path)) is not None


def nothing_at(path: str | PathLike[str], what: str = "file") -> str:
    """The message for a path that does not exist; for a URL, that it must be downloaded first."""
    address = _URL.fullmatch(os.fspath(path))
    if address is None:
        return f"{path}: no such {what}"
    return f"{address[1]}://{address[2]}: is a URL: download it first and give the path of the file"


def load_camera(
    path: Path,
    name: str | None,
    unit: str | None = None,
    size: str | None = None,
    v_up: bool | None = None,
    *,
    lens_only: bool = False,
) -> Any:
    """The camera of a calibration file."""
    if not path.is_file():
        raise InputError(nothing_at(path, "camera file"))
    sides = None if size is None else two_sides(size, "--camera-size")
    return memo.Camera.from_file(path, name, unit, size=sides, v_up=v_up, lens_only=lens_only)


def two_sides(text: str, option: str, example: str = "1280x720") -> tuple[int, int]:
    """Two whole numbers as in 1280x720."""
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and 0 < int(width) < 10**6 and 0 < int(height) < 10**6):
        raise InputError(f"{option} {text} is not two whole numbers such as {example}")
    return int(width), int(height)


def checked_fov(fov_deg: float) -> float:
    """A field of view, degrees."""
    if not 5 <= fov_deg <= 170:
        raise InputError(f"--fov-deg {fov_deg:g} is not a field of view in degrees (5 to 170)")
    return fov_deg


def heights(text: str | None) -> float | list[float] | None:
    """One height of everybody, or heights of people in order of appearance as in 1.80,1.65; metres."""
    if text is None:
        return None
    try:
        each = [float(part) for part in text.split(",")]
    except ValueError:
        raise InputError(f"--height {text} is not a height in metres, or several as in 1.80,1.65") from None
    if len(each) > 1 and not all("." in part for part in text.split(",")):
        raise InputError(
            f"--height {text}: write decimal points, 1.75 for one height and 1.80,1.65 for several people"
        )
    return each[0] if len(each) == 1 else each


def point_in_frame(text: str, option: str) -> Point:
    """A point of the picture in a frame, as in 320,240@50: pixels, and the frame's number in the video."""
    point = _POINT.fullmatch(text.strip())
    if point is None:
        raise InputError(f"{option} {text} is not a point in a frame: X,Y@F, such as 320,240@50")
    return Point(float(point[1]), float(point[2]), int(point[3]))


def place_in_frame(text: str) -> Point | Box:
    """`--follow`: a point in a frame, or a box around somebody: left, top, width and height, as in
    280,120,80,240@50."""
    if point := _POINT.fullmatch(text.strip()):
        return Point(float(point[1]), float(point[2]), int(point[3]))
    box = _BOX.fullmatch(text.strip())
    if box is None or not (float(box[3]) > 0 and float(box[4]) > 0):
        raise InputError(
            f"--follow {text} is neither a point in a frame, X,Y@F such as 320,240@50, nor a box: left, top, "
            "width and height above 0, L,T,W,H@F such as 280,120,80,240@50"
        )
    return Box(float(box[1]), float(box[2]), float(box[3]), float(box[4]), int(box[5]))


def checked_height(height_m: float) -> float:
    """The height of a person, metres."""
    if 50 <= height_m <= 250:
        raise InputError(f"--height {height_m:g} looks like centimetres: give --height {height_m / 100:g}")
    if not (math.isfinite(height_m) and 0.5 <= height_m <= 2.5):
        raise InputError(f"--height {height_m:g} is not the height of a person in metres (0.5 to 2.5)")
    return height_m


def tracker_options(
    height_m: float | Sequence[float] | None,
    camera: Path | None,
    reading: Mapping[str, Any],
    fov_deg: float | None,
    steady: bool = True,
    treadmill: bool | None = None,
) -> dict[str, Any]:
    """Options of `Tracker`; camera, `reading` and field of view as for `given_camera`."""
    options: dict[str, Any] = {}
    if isinstance(height_m, Sequence):
        options["height_m"] = [checked_height(one) for one in height_m]
    elif height_m is not None:
        options["height_m"] = checked_height(height_m)
    options |= given_camera(camera, reading, fov_deg)
    if not steady:
        options["steady"] = False
    if treadmill is not None:
        options["treadmill"] = treadmill
    return options


def given_camera(camera: Path | None, reading: Mapping[str, Any], fov_deg: float | None) -> dict[str, Any]:
    """The calibrated camera, or the field of view of an assumed one, if given.

    `reading` has the options for the camera file: `name`, `unit`, `size`, `v_up`.
    """
    if camera is not None and fov_deg is not None:
        raise UsageError("--camera already holds the field of view: leave --fov-deg out")
    for name, value in reading.items():
        if camera is None and value is not None:
            raise UsageError(f"--camera-{name.replace('_', '-')} needs --camera")
    if camera is not None:
        return {"camera": load_camera(camera, **reading)}
    return {} if fov_deg is None else {"fov_deg": checked_fov(fov_deg)}


def frame_range(text: str) -> tuple[int, int | None]:
    """`--frames A:B` as the first frame and one past the last, None for the end."""
    start, colon, stop = text.partition(":")
    try:
        first, end = int(start or 0), int(stop) if stop else None
    except ValueError:
        first, end, colon = 0, None, ""
    if not colon or first < 0 or (end is not None and end <= first):
        raise InputError(f"--frames {text} is not A:B with 0 <= A < B")
    return first, end


def check_apart(read: Iterable[Path | None], written: Iterable[Path]) -> None:
    """Refuses to overwrite the input, under any name or link, or to write into an input folder."""
    for file in written:
        for source in read:
            if source is None:
                continue
            if file.resolve() == source.resolve() or (
                file.exists() and source.exists() and file.samefile(source)
            ):
                raise InputError(f"{file}: is the input; write to another place")
            if source.is_dir() and file.parent.resolve() == source.resolve():
                raise InputError(f"{source}: is the input folder; write to another place")


def default_out(source: Path) -> Path:
    """The folder for the results of a source, named like it; also `.` and `..` have a name."""
    path = Path(os.path.abspath(source))
    return Path("memo-out") / (path.name if path.is_dir() else path.stem)


def check_default_out(out: Path, video: Path) -> None:
    """Refuses to replace results of another video, or of a batch, in a folder that the user did not name."""
    if (out / ".batch").exists():
        raise InputError(f"{out}: holds the results of memo batch; give another folder with --out")
    if (out / RUN).is_file():
        other = read_run(out)["video"]
        if other is None or Path(other).resolve() != video.resolve():
            raise InputError(
                f"{out}: holds the results of {other or 'drawn frames'}; give another folder with --out"
            )


_LEAST_FREE_BYTES = 4 << 20  # tables and pictures of a short video


def check_writable(out: Path) -> None:
    """Makes the folder; refuses a folder that cannot be written to or whose disk is full."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out) as file:
            file.write(b"memo")
        free = shutil.disk_usage(out).free
    except OSError as error:
        raise InputError(f"{out}: cannot be written to: {error.strerror}") from None
    if free < _LEAST_FREE_BYTES:
        raise InputError(f"{out}: the disk is full ({free >> 10} kB free)")
