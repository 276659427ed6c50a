"""Reads frames from a video file or a folder of images: luma and time stamps, upright.

It returns the luma plane as the camera stored it (without colour conversion: a conversion to
`gray` differs from it by several grey levels), rotated upright by the display matrix, with the video's
own time stamps. Luma of full range (0 to 255: images, and videos marked so) is brought to the limited range
(16 to 235) of most video, so that the same scene has the same grey levels in every format. Frames are read
one at a time, so memory does not grow with the length of the video.

Limits: no seeking (a start frame is reached by decoding), no deinterlacing, no change of size in a video.
"""

from __future__ import annotations

import re
import warnings
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice, pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from av.video.reformatter import ColorRange

from memo import _memo
from memo.given import nothing_at
from memo.wording import counted, enumerated

__all__ = ["Frame", "VideoDamageWarning", "VideoError", "VideoReader"]

Luma = npt.NDArray[np.uint8]

_IMAGE_SUFFIXES = {".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".ppm", ".tif", ".tiff"}
# In pictures of a walk twice as large, the facing direction was wrong: the contour search spans a few pixels.
_LONGEST_PX = 1280
# Fewer missing frames come from edit lists and rounding, not from a recording that was cut off.
_MISSING_FRAMES_TOLERATED = 2


class VideoError(ValueError):
    """A video that cannot be read; the message names the video and the reason, in one line."""


class VideoDamageWarning(UserWarning):
    """A video was read as far as requested, but not every frame of it could be decoded."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame of a video."""

    index: int
    """Position in the video, 0 for the first frame."""
    time_s: float
    """Seconds since the first frame."""
    luma: Luma
    """(H, W) grey values, upright; may be a strided view of the decoder's memory."""


class VideoReader:
    """Iterates over the frames of a video file or of a folder of images; use it in a `with` statement.

    `start` and `stop` select frames like a slice. `rate_hz` replaces the time stamps: it is needed for a
    folder of images, and for slow-motion video stored at another rate than it was recorded.

    `shrink=n` averages n by n pixels to one, and leaves out columns at the right and rows at the bottom that
    do not fill one; `None` selects the smallest n that makes the picture at most 1280 pixels long and high,
    as in `memo track`.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        *,
        start: int = 0,
        stop: int | None = None,
        rate_hz: float | None = None,
        shrink: int | None = 1,
    ) -> None:
        if start < 0 or (stop is not None and stop <= start):
            raise VideoError(f"frames {start}:{'' if stop is None else stop} is not a range of frames")
        if rate_hz is not None and not 0 < rate_hz < float("inf"):
            raise VideoError(f"the frame rate must be positive, got {rate_hz}")
        self.path: Path = Path(path)
        self.damage: str | None = None
        """After iteration: what could not be read, `None` if everything was read."""
        self._start, self._stop, self._rate_hz = start, stop, rate_hz
        self._source = _open_source(self.path, rate_hz)
        self._decoded = self._source.decoded()
        try:
            self._first = next(self._decoded, None)
            if self._first is None:
                raise VideoError(f"{self.path}: no frame of it can be decoded")
            self.unused_bits: int = _unused_bits(self._first)
            """Upper bits that no pixel of the first frame uses: 4 for values of 12 bits in 16."""
            height, width = _upright(_luma(self._first), self._first).shape
            self.shrink: int = -(-max(width, height) // _LONGEST_PX) if shrink is None else shrink
            """Pixels of the video per pixel of a frame, along each axis."""
            if not 1 <= self.shrink <= min(width, height):
                raise VideoError(f"{self.path}: {width}x{height} pixels cannot be shrunk by {self.shrink}")
        except BaseException:
            self.close()
            raise
        self.full_size: tuple[int, int] = (width, height)
        """Width and height of the upright video, pixels."""
        self.size: tuple[int, int] = (width // self.shrink, height // self.shrink)
        """Width and height of the frames, pixels."""

    @property
    def rate_hz(self) -> float:
        """Average frame rate, frames per second."""
        return self._rate_hz or self._source.rate_hz

    @property
    def pixel_aspect(self) -> float:
        """Width over height of a stored pixel: 1 unless the video is anamorphic."""
        return self._source.pixel_aspect

    @property
    def frame_count(self) -> int | None:
        """Number of frames in the iteration, from the container's header; `None` if it is unknown."""
        announced = self._source.announced
        if announced is None:
            return None if self._stop is None else self._stop - self._start
        return max(0, min(announced, self._stop or announced) - self._start)

    def __enter__(self) -> VideoReader:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Closes the file."""
        self._source.close()

    def __iter__(self) -> Iterator[Frame]:
        index = -1
        for index, (time_s, decoded) in enumerate(islice(self._timed(), self._stop)):
            if index >= self._start:
                yield Frame(index, time_s, self._checked(index, decoded))
        if index < self._start:
            raise VideoError(
                f"{self.path}: frame {self._start} was requested, but it has {counted(index + 1, 'frame')}"
            )
        self._report_damage(index + 1)

    def _timed(self) -> Iterator[tuple[float, av.VideoFrame]]:
        """Decoded frames with their time; the rate is used if a stamp is missing or does not increase."""
        first, self._first = self._first, None
        if first is None:
            raise VideoError(f"{self.path}: its frames can be read once; open it again")
        step_s = 1.0 / self.rate_hz
        time_s = -step_s
        for index, decoded in enumerate(chain([first], self._decoded)):
            if self._rate_hz is not None:
                stamp_s = (index if self._source.place is None else self._source.place) * step_s
            elif decoded.time is None or first.time is None:
                stamp_s = -1.0
            else:
                stamp_s = decoded.time - first.time
            time_s = stamp_s if stamp_s > time_s else time_s + step_s
            yield time_s, decoded

    def _checked(self, index: int, decoded: av.VideoFrame) -> Luma:
        luma = _upright(_luma(decoded), decoded)
        if luma.shape != self.full_size[::-1]:
            (width, height), (now_height, now_width) = self.full_size, luma.shape
            raise VideoError(
                f"{self.path}: frame {index} is {now_width}x{now_height}, the previous ones {width}x{height}"
            )
        return luma if self.shrink == 1 else _memo.shrunk(luma, self.shrink)

    def _report_damage(self, read: int) -> None:
        announced, undecodable = self._source.announced, self._source.undecodable
        missing = 0 if announced is None else min(announced, self._stop or announced) - read
        if undecodable:
            self.damage = (
                f"{counted(undecodable, 'piece')} could not be decoded; {counted(read, 'frame')} could"
            )
        elif self._source.absent:
            absent = counted(self._source.absent, "image is", "images are")
            self.damage = f"{absent} missing by the numbers in the names; the others keep their times"
        elif self._source.counted and missing > _MISSING_FRAMES_TOLERATED:
            self.damage = f"cut off: its header says {counted(announced or 0, 'frame')}, {read} could be read"
        if self.damage:
            warnings.warn(f"{self.path}: {self.damage}", VideoDamageWarning, stacklevel=3)


class _File:
    """The first video stream of a container."""

    def __init__(self, path: Path) -> None:
        try:
            # A relative path with a colon in it would be read as a protocol.
            self._container = av.open(str(path.absolute()), metadata_errors="replace")
        except av.error.InvalidDataError:
            raise VideoError(f"{path}: not a video, or its index is missing (recording cut off)") from None
        except (av.error.FFmpegError, OSError) as error:
            raise VideoError(f"{path}: cannot be opened: {error.strerror or error}") from None
        if not self._container.streams.video:
            self._container.close()
            raise VideoError(f"{path}: holds no video stream")
        self._stream = self._container.streams.video[0]
        if self._stream.codec_context is None:
            self._container.close()
            raise VideoError(f"{path}: no decoder for its video stream")
        self._stream.thread_type = "AUTO"
        self.undecodable = self.absent = 0
        self.place: int | None = None
        self.counted = self._stream.frames > 0
        self.rate_hz = float(self._stream.average_rate or self._stream.guessed_rate or 25)
        self.announced = self._stream.frames or self._frames_from_duration()
        self.pixel_aspect = float(self._stream.sample_aspect_ratio or 1)

    def _frames_from_duration(self) -> int | None:
        duration = self._container.duration
        return round(duration / av.time_base * self.rate_hz) if duration else None

    def decoded(self) -> Iterator[av.VideoFrame]:
        """All frames; pieces that cannot be decoded are counted and left out."""
        for packet in self._packets():
            try:
                frames = packet.decode()
            except av.error.FFmpegError:
                self.undecodable += 1
            else:
                yield from frames
        try:
            yield from self._stream.codec_context.decode(None)
        except av.error.EOFError:
            pass  # the last packet has flushed the decoder already
        except av.error.FFmpegError:
            self.undecodable += 1

    def _packets(self) -> Iterator[av.Packet]:
        try:
            yield from self._container.demux(self._stream)
        except av.error.FFmpegError:
            self.undecodable += 1

    def close(self) -> None:
        self._container.close()


class _Folder:
    """Images of a folder, in the order of the numbers in their names."""

    counted = False
    pixel_aspect = 1.0

    def __init__(self, path: Path, rate_hz: float | None) -> None:
        # macOS adds a file `._NAME` to each file on a disk of another system.
        names = [
            file
            for file in path.iterdir()
            if file.suffix.lower() in _IMAGE_SUFFIXES and not file.name.startswith(".")
        ]
        if not names:
            raise VideoError(f"{path}: a folder without images")
        if several := _series(names):
            raise VideoError(
                f"{path}: holds several series of images, {enumerated(several)}; "
                "give a folder that holds one of them"
            )
        if rate_hz is None:
            raise VideoError(f"{path}: a folder of images has no time stamps; give its frame rate")
        names.sort(key=_natural_order)
        places = _places(names)
        self._images: Iterator[tuple[int, Path]] = iter(zip(places, names, strict=True))
        self.place: int | None = None
        """Which frame of the recording the latest image is, by its number."""
        self.absent = 0
        """Images that are missing between the first and the latest."""
        self.announced = len(names)
        self.rate_hz = rate_hz
        self.undecodable = 0

    def decoded(self) -> Iterator[av.VideoFrame]:
        for read, (place, image) in enumerate(self._images):
            self.place, self.absent = place, place - read
            if image.stat().st_size == 0:
                self.undecodable += 1
                continue
            file = _File(image)
            try:
                yield from file.decoded()
            finally:
                self.undecodable += file.undecodable
                file.close()

    def close(self) -> None:
        self._images = iter(())


def _open_source(path: Path, rate_hz: float | None) -> _File | _Folder:
    if path.is_dir():
        return _Folder(path, rate_hz)
    if not path.exists():
        raise VideoError(nothing_at(path))
    if path.is_file() and path.stat().st_size == 0:
        raise VideoError(f"{path}: the file is empty")
    return _File(path)


def _natural_order(path: Path) -> list[tuple[int, str]]:
    """Sorts frame9 before frame10."""
    return [(int(digits or 0), text) for text, digits in re.findall(r"(\D*)(\d*)", path.name)]


def _series(names: list[Path]) -> list[str]:
    """The series, such as left_* and right_*, whose images have the same numbers; none if there is only one.

    Other images whose names differ by more than their numbers are of one series.
    """
    series: defaultdict[tuple[int, ...], set[str]] = defaultdict(set)
    for path in names:
        if numbers := tuple(int(digits) for digits in re.findall(r"\d+", path.name)):
            series[numbers].add(re.sub(r"\d+", "*", path.name))
    return next((sorted(alike) for alike in series.values() if len(alike) > 1), [])


def _places(names: list[Path]) -> list[int]:
    """Which frames of the recording sorted images are: some are missing where the numbers in the names jump.

    Gaps are known if one number changes, mostly by the same step.
    """
    orders = [_natural_order(path) for path in names]
    in_order = list(range(len(names)))
    if len(orders) < 3 or len({tuple(text for _, text in order) for order in orders}) > 1:
        return in_order
    numbers = [
        list(column) for column in zip(*([number for number, _ in order] for order in orders), strict=True)
    ]
    changing = [column for column in numbers if len(set(column)) > 1]
    if len(changing) != 1:
        return in_order
    steps = [after - before for before, after in pairwise(changing[0])]
    usual = max(set(steps), key=steps.count)
    if usual <= 0 or 2 * steps.count(usual) < len(steps) or any(step % usual for step in steps):
        return in_order
    return [(number - changing[0][0]) // usual for number in changing[0]]


def _luma(decoded: av.VideoFrame) -> Luma:
    """The luma plane itself if there is one of 8 bits and limited range; else the nearest equivalent."""
    kind = decoded.format
    if kind.is_rgb or kind.has_palette:
        return _bt601(np.asarray(decoded.to_ndarray(format="rgb24"), np.uint8))
    is_full = _is_full_range(decoded)
    first = kind.components[0]
    own_plane = all(component.plane != first.plane for component in kind.components[1:])
    if first.bits != 8 or not own_plane or decoded.planes[0].line_size < 0:
        same = ColorRange.JPEG if is_full else ColorRange.MPEG
        wanted = "yuv420p" if len(kind.components) > 1 else "gray"
        decoded = decoded.reformat(format=wanted, src_color_range=same, dst_color_range=same)
    plane = decoded.planes[0]
    rows = np.frombuffer(memoryview(plane), np.uint8).reshape(-1, plane.line_size)
    luma: Luma = rows[: decoded.height, : decoded.width]
    return _LIMITED[luma] if is_full else luma


def _unused_bits(decoded: av.VideoFrame) -> int:
    first = decoded.format.components[0]
    if first.bits <= 8 or decoded.format.name not in ("gray16le", "gray16be", "rgb48le", "rgb48be"):
        return 0
    return first.bits - int(decoded.to_ndarray().max()).bit_length()


def _is_full_range(decoded: av.VideoFrame) -> bool:
    """Whether luma is 0 to 255 from black to white, as in JPEG, and not 16 to 235, as in most video."""
    name, stated = decoded.format.name, decoded.color_range
    if stated != ColorRange.UNSPECIFIED:
        return bool(stated == ColorRange.JPEG)
    return name.startswith(("yuvj", "gray"))


_LIMITED: Luma = np.rint(16 + np.arange(256) * 219 / 255).astype(np.uint8)
"""Grey level in limited range of each one in full range (ITU-R BT.601)."""


def _bt601(rgb: Luma) -> Luma:
    """Y = 16 + 219 / 255 (0.299 R + 0.587 G + 0.114 B), ITU-R BT.601 in limited range, in fixed point."""
    red, green, blue = np.moveaxis(rgb.astype(np.uint32), 2, 0)
    weighted = 77 * red + 150 * green + 29 * blue
    luma: Luma = (16 + (219 * weighted + 255 * 128) // (255 * 256)).astype(np.uint8)
    return luma


def _upright(luma: Luma, decoded: av.VideoFrame) -> Luma:
    """Applies the display matrix (x' = a x + c y, y' = b x + d y): quarter turns and reflections as views."""
    matrix = _display_matrix(decoded)
    if matrix is None:
        return luma
    a, b, c, d = matrix
    if max(abs(b), abs(c)) < 0.01 * min(abs(a), abs(d)):
        return luma[:: 1 if d > 0 else -1, :: 1 if a > 0 else -1]
    if max(abs(a), abs(d)) < 0.01 * min(abs(b), abs(c)):
        return luma.T[:: 1 if b > 0 else -1, :: 1 if c > 0 else -1]
    raise VideoError(f"the video is turned by {decoded.rotation} degrees; only quarter turns can be read")


def _display_matrix(decoded: av.VideoFrame) -> tuple[int, int, int, int] | None:
    side_data: Any = decoded.side_data.get("DISPLAYMATRIX")
    if side_data is None:
        return None
    a, b, _, c, d = np.frombuffer(memoryview(side_data), np.int32)[:5].tolist()
    return a, b, c, d
