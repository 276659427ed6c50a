"""Pictures small enough for a page: JPEG of frames, 1-bit PNG of masks, and thinning to a budget of bytes."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, Generic, TypeVar

import av
import numpy as np
import numpy.typing as npt
from PIL import Image

__all__ = ["LONGEST_PX", "Picture", "Thinned", "colour_frames", "jpeg_uri", "mask_uri", "packed"]

LONGEST_PX = 720
"""The longer side of a picture in a page."""

_JPEG_QUALITY = 72
_SIXTEENTH_PX = 16
_REACH_PX = 32767 // _SIXTEENTH_PX

Kept = TypeVar("Kept")


@dataclass(frozen=True, slots=True)
class Picture:
    """One frame of a video as the page shows it."""

    frame: int
    """Number in the video, from 0."""
    time_s: float
    """Seconds since frame 0."""
    uri: str
    """The JPEG as a data URI."""
    moved: str | None = None
    """What changed since the previous frame, as a PNG of the tracked picture; None if not requested."""
    regions: tuple[tuple[int, ...], ...] = ()
    """Left, top, right and bottom of moving regions, largest first, pixels of the video."""

    @property
    def size_bytes(self) -> int:
        """Size that it adds to a page."""
        return len(self.uri) + len(self.moved or "")


class Thinned(Generic[Kept]):
    """Every n-th of the items offered; if the budget is exceeded, n doubles and every second item is dropped.

    So neither their number nor their size need be known in advance. With `every` given, n is fixed.
    """

    def __init__(self, budget_bytes: int, every: int | None = None) -> None:
        self.every: int = every or 1
        self._fixed = every is not None
        self._budget_bytes = budget_bytes
        self._offered = 0
        self._kept: dict[int, tuple[Kept, int]] = {}

    def wants_next(self) -> bool:
        """Whether to keep the next item offered; counts it as offered."""
        self._offered += 1
        return (self._offered - 1) % self.every == 0

    def keep(self, item: Kept, size_bytes: int) -> None:
        """Keeps the last item offered."""
        self._kept[self._offered - 1] = item, size_bytes
        while not self._fixed and len(self._kept) > 1 and self._bytes > self._budget_bytes:
            self.every *= 2
            self._kept = {at: kept for at, kept in self._kept.items() if at % self.every == 0}

    @property
    def _bytes(self) -> int:
        return sum(size for _, size in self._kept.values())

    @property
    def items(self) -> list[Kept]:
        """The items kept, in order."""
        return [item for item, _ in self._kept.values()]


def jpeg_uri(pixels: npt.NDArray[np.uint8], longest_px: int = LONGEST_PX) -> str:
    """(H, W) grey or (H, W, 3) RGB pixels as JPEG, reduced if a side is longer than `longest_px`."""
    image = Image.fromarray(np.ascontiguousarray(pixels))
    image.thumbnail((longest_px, longest_px), Image.Resampling.BILINEAR)
    return _uri("jpeg", image, quality=_JPEG_QUALITY, optimize=True)


def mask_uri(mask: npt.NDArray[np.bool_], colour: tuple[int, int, int]) -> str:
    """(H, W) mask as a PNG of one bit per pixel: `colour` where it is true, transparent elsewhere."""
    image = Image.fromarray(np.ascontiguousarray(mask).astype(np.uint8), "P")
    image.putpalette([0, 0, 0, *colour])
    return _uri("png", image, transparency=0, bits=1)


def packed(points_px: npt.ArrayLike, shrink: int = 1) -> str:
    """Pixel coordinates of any shape, flat, as base64 of 16-bit integers in sixteenths of `shrink` pixels."""
    finite = np.nan_to_num(np.asarray(points_px, np.float64) / shrink, posinf=_REACH_PX, neginf=-_REACH_PX)
    sixteenths = np.round(np.clip(finite, -_REACH_PX, _REACH_PX) * _SIXTEENTH_PX)
    return base64.b64encode(sixteenths.astype("<i2").tobytes()).decode("ascii")


def colour_frames(path: str | PathLike[str]) -> Iterator[tuple[int, float, npt.NDArray[np.uint8]]]:
    """Number, time in seconds and (H, W, 3) RGB pixels of the frames of a video written by memo."""
    try:
        with av.open(str(Path(path).absolute())) as container:
            for index, frame in enumerate(container.decode(video=0)):
                yield index, frame.time or 0.0, np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
    except (av.error.FFmpegError, IndexError) as error:
        raise ValueError(f"{path}: cannot be read as a video: {error}") from None


def _uri(kind: str, image: Any, **options: Any) -> str:
    written = io.BytesIO()
    image.save(written, kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(written.getvalue()).decode('ascii')}"
