"""Point-light displays as files: lossless or small video, and PNG pictures with alpha.

All pictures are drawn by `PointLightDisplay.frames` at the scale of the display; nothing is scaled to fit.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from os import PathLike
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from PIL import Image

from memo._memo import PointLightDisplay
from memo.overlay import _h264
from memo.unfinished import complete_file, complete_folder

__all__ = ["even_size", "frames_left", "remove_display", "write_display_png", "write_display_video"]

_MILLISECONDS = Fraction(1, 1000)  # the clock of Matroska
_NUMBERED = re.compile(r"\d{5,}\.png")


def write_display_video(
    path: str | PathLike[str], display: PointLightDisplay, *, lossless: bool = False, **picture: Any
) -> None:
    """Writes a display as H.264 (MP4); `lossless` as FFV1 (Matroska), whose pixels are those of `frames`.

    Sides of an MP4 are even: an odd one is one pixel longer than in `frames` (`even_size`).

    `picture`: arguments of `PointLightDisplay.frames`, such as `size_px` and `dot_px`.
    """
    writer = _ffv1 if lossless else _h264
    rate_hz = _rate_hz(display.times_s)
    with complete_file(path) as temporary, writer(str(temporary), rate_hz) as write:
        for index, time_s in enumerate(display.times_s):
            (frame,) = display.frames(start=index, stop=index + 1, **picture)
            write(frame, float(time_s - display.times_s[0]))


def write_display_png(folder: str | PathLike[str], display: PointLightDisplay, **picture: Any) -> list[Path]:
    """Writes each frame as `00000.png`, `00001.png`, ... with alpha; returns the paths.

    Every pixel has the colour of the dots, and its alpha is how much of the pixel they cover, so that the
    pictures can be laid over any background. Earlier pictures of these names are removed; other files stay.
    """
    folder = Path(folder)
    names = [f"{index:05d}.png" for index in range(len(display.times_s))]
    with complete_folder(folder) as temporary:
        for index, name in enumerate(names):
            (frame,) = display.frames(start=index, stop=index + 1, alpha=True, **picture)
            Image.fromarray(frame).save(temporary / name)
        for path in folder.iterdir() if folder.is_dir() else ():
            if path.is_dir():
                shutil.copytree(path, temporary / path.name, symlinks=True)
            elif not _NUMBERED.fullmatch(path.name):
                shutil.copy2(path, temporary / path.name, follow_symlinks=False)
    return [folder / name for name in names]


def remove_display(folder: str | PathLike[str]) -> None:
    """Removes the pictures of an earlier display: `display.mp4`, `display.mkv` and the pictures in `frames`.

    Other files stay, and `frames` if it holds any.
    """
    for name in ("display.mp4", "display.mkv"):
        (Path(folder) / name).unlink(missing_ok=True)
    pictures = Path(folder) / "frames"
    if pictures.is_dir() and not pictures.is_symlink():
        for path in pictures.iterdir():
            if _NUMBERED.fullmatch(path.name):
                path.unlink()
        if not any(pictures.iterdir()):
            pictures.rmdir()


def even_size(size_px: tuple[int, int]) -> tuple[int, int]:
    """Width and height of an MP4 of pictures of this size: an odd side has one pixel more."""
    width, height = (side + side % 2 for side in size_px)
    return width, height


def frames_left(
    display: PointLightDisplay, size_px: tuple[int, int], centre_px: tuple[float, float] | None = None
) -> tuple[int, tuple[int, int]]:
    """In how many frames the middle of a dot is outside the picture, and the size that holds all."""
    apart = np.abs(display.positions_px - (display.centre_px if centre_px is None else centre_px))
    outside = (apart > np.array(size_px) / 2).any(axis=2) & display.visible
    needed = 2 * np.nanmax(apart, axis=(0, 1), initial=0)
    width, height = (
        max(side, int(np.ceil(least / 2)) * 2) for side, least in zip(size_px, needed, strict=True)
    )
    return int(outside.any(axis=1).sum()), (width, height)


@contextmanager
def _ffv1(path: str, rate_hz: float) -> Iterator[Any]:
    """Yields a function (rgb, time_s) that appends a frame without loss."""
    with av.open(str(Path(path).absolute()), "w", format="matroska") as container:
        stream = container.add_stream("ffv1", rate=Fraction(rate_hz).limit_denominator(1001))
        stream.pix_fmt = "bgr0"
        stream.codec_context.time_base = _MILLISECONDS

        def encode(rgb: npt.NDArray[np.uint8], time_s: float) -> None:
            if not stream.codec_context.is_open:
                stream.height, stream.width = rgb.shape[:2]
            picture = av.VideoFrame.from_ndarray(rgb, format="rgb24").reformat(format="bgr0")
            picture.pts, picture.time_base = round(time_s / _MILLISECONDS), _MILLISECONDS
            container.mux(stream.encode(picture))

        yield encode
        container.mux(stream.encode(None))


def _rate_hz(times_s: npt.NDArray[np.float64]) -> float:
    return 1 / float(np.median(np.diff(times_s))) if len(times_s) > 1 else 25.0
