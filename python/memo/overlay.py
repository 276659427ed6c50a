"""Draws the tracked model over its video.

Lines are rasterised with numpy: a pixel is covered by clamp(w / 2 + 1/2 - distance to the segment, 0, 1),
which is anti-aliased to one pixel and exact along straight stretches. No image library is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from fractions import Fraction
from functools import lru_cache
from numbers import Integral
from os import PathLike
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from memo.pixels import of_averaged, of_video
from memo.unfinished import complete_file
from memo.video import Frame, Luma

__all__ = ["draw_row", "draw_rows", "draw_segments", "draw_text", "write_overlay"]

Rgb = npt.NDArray[np.uint8]
Segments = npt.NDArray[np.float64]
Colour = tuple[int, int, int]

# From the palette of Okabe and Ito, distinguishable with any colour vision and on any grey.
CONTOUR: Colour = (240, 228, 66)
RIGHT: Colour = (230, 110, 0)
LEFT: Colour = (86, 180, 233)
WHITE: Colour = (255, 255, 255)
PEOPLE: tuple[Colour, ...] = (CONTOUR, (0, 158, 115), (204, 121, 167), (245, 245, 245), (150, 100, 245))
"""Of the contours of people, in order of appearance; none is close to those of the sides."""

_CHAINS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
_LEGIBLE_HEIGHT_PX = 480
_PIECE_PX = 8.0  # about the length of the segments of a contour
_TRAIL_S = 1.0  # about one stride
# The fastest preset: half the time of "veryfast" for 2.7 times the size, 3.7 Mbit/s of a walk in 720p.
_ENCODER = {"preset": "ultrafast", "crf": "20"}
_TIME_BASE = Fraction(1, 90000)  # finer than any video clock, so variable frame rates survive


def write_overlay(
    path: str | PathLike[str],
    frames: Iterable[Frame],
    track: Any,
    *,
    rate_hz: float = 25.0,
    shrink: int = 1,
) -> int:
    """Writes an H.264 MP4 of `frames`, with the track drawn on its frames; returns the number of frames.

    The video keeps the time stamps of `frames`; `rate_hz` is only its nominal rate. `shrink`: pixels of the
    track per pixel of the frames, along each axis; the overlay is as large as the frames.
    """
    rows: dict[int, list[int]] = {}
    for row, frame in enumerate(track.columns["frame"]):
        rows.setdefault(int(frame), []).append(row)
    written = 0
    with complete_file(path) as temporary, _h264(str(temporary), rate_hz) as write, _behind(write) as encode:
        for frame in frames:
            if frame.index in rows:
                rgb = draw_rows(frame.luma, track, rows[frame.index], shrink=shrink)
            else:
                rgb = _enlarged(frame.luma, _scale(frame.luma))
                draw_text(rgb, f"frame {frame.index} at {frame.time_s:.2f} s")
            encode(rgb, frame.time_s)
            written += 1
        if not written:
            raise ValueError(f"{path}: no frames to draw on")
    return written


def draw_row(luma: Luma, track: Any, row: int, *, shrink: int = 1) -> Rgb:
    """The frame of one row of the track with model contours, limbs, ankle trails and legend on it.

    A small frame is enlarged by a whole number, so that lines and letters stay thin. `shrink`: pixels of the
    track per pixel of `luma`, along each axis. A frame of another size than the track's is refused.
    """
    return draw_rows(luma, track, [row], shrink=shrink)


def draw_rows(luma: Luma, track: Any, rows: Sequence[int], *, shrink: int = 1) -> Rgb:
    """A frame with everybody in it: its rows of the track, each as `draw_row` draws one. Of several people,
    each has a colour and a number."""
    _check_frame(luma, track, shrink)
    scale = _scale(luma)
    rgb = _enlarged(luma, scale)
    width_px = max(1.0, rgb.shape[0] / 360)
    columns = track.columns

    def placed(segments: Segments) -> Segments:
        return of_video(of_averaged(segments, shrink), scale)

    def draw(segments: Segments, colour: Colour, width_px: float, opacity: float = 1.0) -> None:
        draw_segments(rgb, placed(segments), colour, width_px, opacity=opacity)

    several = bool((columns["person"] > 0).any())
    for row in rows:
        contours = track.contours(row)
        if len(contours):
            colour = PEOPLE[int(columns["person"][row]) % len(PEOPLE)] if several else CONTOUR
            draw(np.stack(contours), colour, width_px)
        for side, colour in (("left", LEFT), ("right", RIGHT)):
            draw(_trail(columns, side, row), colour, width_px, opacity=0.5)
            draw(_limbs(columns, side, row), colour, 1.5 * width_px)
    for row in rows if several else ():
        drawn = np.concatenate([np.reshape(track.contours(row), (-1, 2, 2)), _limbs(columns, "left", row)])
        _number(rgb, int(columns["person"][row]), placed(drawn).reshape(-1, 2))
    _legend(rgb, columns, rows, several)
    return rgb


def _check_frame(luma: Luma, track: Any, shrink: int) -> None:
    """Refuses a frame that is not one of the track's by its size."""
    if luma.ndim != 2:
        raise ValueError(f"a frame must be grey values of shape (height, width), got shape {luma.shape}")
    camera = getattr(track, "camera", None)
    if camera is None:
        return
    size, of_track = luma.shape[1::-1], tuple(camera.size)
    # Averaging leaves out columns and rows at the border; the camera may not have those.
    could_be = [
        whole - shrink < shrink * side < whole + getattr(track, "shrink", 1)
        for side, whole in zip(size, of_track, strict=True)
    ]
    if not all(could_be):
        got, wanted = ("x".join(map(str, sides)) for sides in (size, of_track))
        averaged = f" averaged {shrink} by {shrink}" if shrink > 1 else ""
        raise ValueError(f"the track is of frames of size {wanted}{averaged}, got a frame of {got}")


def _checked_colour(colour: Sequence[int]) -> npt.NDArray[np.float32]:
    channels = np.asarray(colour, dtype=object)
    if channels.shape != (3,) or not all(
        isinstance(channel, Integral) and 0 <= int(channel) <= 255 for channel in channels
    ):
        raise ValueError(f"a colour must be three whole numbers from 0 to 255, got {colour!r}")
    return channels.astype(np.float32)


def _number(rgb: Rgb, person: int, points_px: Segments) -> None:
    """The number of a person over the highest of the points, in the person's colour."""
    points_px = points_px[np.isfinite(points_px).all(axis=1)]
    if not len(points_px):
        return
    u_px, v_px = points_px[np.argmin(points_px[:, 1])]
    height_px = _text_height_px(rgb)
    at = (round(u_px - 0.3 * height_px), round(v_px - 2 * height_px))
    draw_text(rgb, str(person), PEOPLE[person % len(PEOPLE)], at=at)


def _legend(rgb: Rgb, columns: Mapping[str, Any], rows: Sequence[int], several: bool) -> None:
    """Time, phase and the sides; of several people a line each."""
    first = rows[0]
    when = f"frame {columns['frame'][first]} at {columns['time_s'][first]:.2f} s"
    if not several:
        draw_text(rgb, f"{when}, phase {columns['phase'][first]:.2f}")
        draw_text(rgb, f"P(left and right swapped) {columns['p_swapped'][first]:.0%}", line=1)
        sides = 2
    else:
        draw_text(rgb, f"{when}; P: left and right swapped")
        for line, row in enumerate(sorted(rows, key=lambda row: int(columns["person"][row])), start=1):
            person = int(columns["person"][row])
            text = f"person {person}: phase {columns['phase'][row]:.2f}, P {columns['p_swapped'][row]:.0%}"
            draw_text(rgb, text, PEOPLE[person % len(PEOPLE)], line=line)
        sides = 1 + len(rows)
    draw_text(rgb, "right", RIGHT, line=sides)
    draw_text(rgb, "left", LEFT, line=sides + 1)


def draw_segments(
    rgb: Rgb, segments: Segments, colour: Colour, width_px: float, *, opacity: float = 1.0
) -> None:
    """Draws (N, 2, 2) segments in pixels; those with a NaN and parts outside the image are left out.

    `colour`: red, green and blue, 0 to 255; `opacity`: 0 to 1.
    """
    ink = _checked_colour(colour)
    if not 0 <= opacity <= 1:
        raise ValueError(f"opacity must be from 0 to 1, got {opacity}")
    if not (width_px > 0 and np.isfinite(width_px)):
        raise ValueError(f"width_px must be positive and finite, got {width_px}")
    reach_px = width_px / 2 + 0.5
    size = np.array(rgb.shape[1::-1])
    pieces = _pieces(_clipped(segments[np.isfinite(segments).all(axis=(1, 2))], size, reach_px + 1))
    corners = np.floor(pieces.min(axis=1) - reach_px).astype(int)
    pixels = np.arange(int(_PIECE_PX + 2 * reach_px) + 2)
    u = corners[:, 0, None, None] + pixels
    v = corners[:, 1, None, None] + pixels[:, None]
    covered = np.clip(reach_px - _distances(pieces, u, v), 0, opacity)
    seen = (covered > 0) & (u >= 0) & (u < size[0]) & (v >= 0) & (v < size[1])
    at, place = np.unique((v * size[0] + u)[seen], return_inverse=True)
    coverage = np.zeros(len(at))
    np.maximum.at(coverage, place, covered[seen])
    rows, columns = np.divmod(at, size[0])
    rgb[rows, columns] = _blended(rgb[rows, columns], coverage, ink)


def draw_text(
    rgb: Rgb, text: str, colour: Colour = WHITE, *, line: int = 0, at: tuple[int, int] | None = None
) -> None:
    """Writes text on a dark background, clipped at the image's edge: a line of those in the upper left
    corner, or with its upper left corner `at` a pixel."""
    shade = _checked_colour(colour)
    ink = np.concatenate([_ink(character, _text_height_px(rgb)) for character in text], axis=1)
    left, top = (4, 4 + line * ink.shape[0]) if at is None else at
    ink = ink[max(-top, 0) :, max(-left, 0) :]
    left, top = max(left, 0), max(top, 0)
    ground = rgb[top : top + ink.shape[0], left : left + ink.shape[1]]
    ground[:] = _blended(ground // 3, ink[: ground.shape[0], : ground.shape[1]], shade)


def _text_height_px(rgb: Rgb) -> int:
    return max(11, rgb.shape[0] // 40)


def _scale(luma: Luma) -> int:
    return max(1, round(_LEGIBLE_HEIGHT_PX / luma.shape[0]))


def _enlarged(luma: Luma, scale: int) -> Rgb:
    """Grey values as RGB, each pixel repeated `scale` times in both directions."""
    if scale > 1:
        luma = np.repeat(np.repeat(luma, scale, axis=0), scale, axis=1)
    return np.stack([luma] * 3, axis=2)


def _clipped(segments: Segments, size: npt.NDArray[np.int_], margin_px: float) -> Segments:
    """The parts inside the image of (width, height) or at most `margin_px` outside it."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    divisor = np.where(along == 0, 1e-12, along)  # parallel to a side: it crosses far outside the segment
    meets = np.stack([(-margin_px - start) / divisor, (size + margin_px - start) / divisor])
    enters = np.maximum(meets.min(axis=0).max(axis=1), 0)
    leaves = np.minimum(meets.max(axis=0).min(axis=1), 1)
    kept = enters <= leaves
    ends = np.stack([enters, leaves], axis=1)[kept]
    return start[kept, None] + ends[:, :, None] * along[kept, None]


def _pieces(segments: Segments) -> Segments:
    """The segments cut into pieces no longer than `_PIECE_PX`, which all fit into squares of one size."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    counts = np.maximum(np.ceil(np.hypot(*along.T) / _PIECE_PX), 1).astype(int)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    of = np.repeat(np.arange(len(segments)), counts)
    ends = np.stack([number, number + 1], axis=1) / counts[of, None]
    return start[of, None] + ends[:, :, None] * along[of, None]


def _distances(
    segments: Segments, u: npt.NDArray[np.int_], v: npt.NDArray[np.int_]
) -> npt.NDArray[np.float64]:
    """Distances of the pixels (u, v) from the segments, one segment after another."""
    start, along = segments[:, 0, :, None, None], (segments[:, 1] - segments[:, 0])[:, :, None, None]
    from_u, from_v = u - start[:, 0], v - start[:, 1]
    along_u, along_v = along[:, 0], along[:, 1]
    length_sq = np.maximum(along_u**2 + along_v**2, 1e-12)
    t = np.clip((from_u * along_u + from_v * along_v) / length_sq, 0, 1)
    distances: npt.NDArray[np.float64] = np.sqrt((from_u - t * along_u) ** 2 + (from_v - t * along_v) ** 2)
    return distances


def _blended(rgb: Rgb, coverage: npt.NDArray[np.floating], ink: npt.NDArray[np.float32]) -> Rgb:
    mixed = rgb + coverage[..., None] * (ink - rgb) + 0.5
    return mixed.astype(np.uint8)


@lru_cache(maxsize=256)
def _ink(character: str, height_px: int) -> npt.NDArray[np.float32]:
    """Coverage of a character in its cell; the font comes from matplotlib, with equal widths."""
    dpi = 72.0
    figure = Figure(figsize=(round(0.6 * height_px) / dpi, round(1.4 * height_px) / dpi), dpi=dpi)
    canvas = FigureCanvasAgg(figure)
    figure.text(0.5, 0.35, character, size=height_px, family="monospace", ha="center")
    canvas.draw()
    shade = np.asarray(canvas.buffer_rgba())[:, :, 0]
    return (1 - shade / 255).astype(np.float32)


def _limbs(columns: dict[str, Any], side: str, row: int) -> Segments:
    """Shoulder-elbow-wrist and hip-knee-ankle of one side."""
    return np.concatenate([_segments([_joint(columns, side, j)[row] for j in chain]) for chain in _CHAINS])


def _trail(columns: dict[str, Any], side: str, row: int) -> Segments:
    """Positions of the ankle of one side during the last second of the same walk."""
    walk = np.flatnonzero(columns["walk"] == columns["walk"][row])[0]
    time_s = columns["time_s"]
    first = walk + int(np.searchsorted(time_s[walk : row + 1], time_s[row] - _TRAIL_S))
    return _segments(_joint(columns, side, "ankle")[first : row + 1])


def _joint(columns: dict[str, Any], side: str, joint: str) -> npt.NDArray[np.float64]:
    return np.column_stack([columns[f"{side}_{joint}_{axis}"] for axis in ("u_px", "v_px")])


def _segments(points: npt.ArrayLike) -> Segments:
    """The segments between consecutive points."""
    points = np.asarray(points, np.float64)
    return np.stack([points[:-1], points[1:]], axis=1)


@contextmanager
def _behind(write: Callable[..., None]) -> Iterator[Callable[..., None]]:
    """Yields `write` as a call that returns at once; it works in the background, one call at a time."""
    with ThreadPoolExecutor(1) as thread:
        pending: list[Future[None]] = []

        def finish() -> None:
            if pending:
                pending.pop().result()

        def start(*arguments: Any) -> None:
            finish()
            pending.append(thread.submit(write, *arguments))

        yield start
        finish()


@contextmanager
def _h264(path: str, rate_hz: float) -> Iterator[Any]:
    """Yields a function (rgb, time_s) that appends a frame; the video is complete when the block ends."""
    with av.open(str(Path(path).absolute()), "w", format="mp4") as container:
        rate = Fraction(rate_hz).limit_denominator(1001)
        stream = container.add_stream("libx264", rate=rate, options=_ENCODER)
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = _TIME_BASE

        def encode(rgb: Rgb, time_s: float) -> None:
            odd_height, odd_width = rgb.shape[0] % 2, rgb.shape[1] % 2
            even = rgb
            if odd_height or odd_width:
                even = np.pad(rgb, ((0, odd_height), (0, odd_width), (0, 0)), mode="edge")
            if not stream.codec_context.is_open:
                stream.height, stream.width = even.shape[:2]
            picture = av.VideoFrame.from_ndarray(even, format="rgb24")
            picture.pts, picture.time_base = round(time_s / _TIME_BASE), _TIME_BASE
            container.mux(stream.encode(picture))

        yield encode
        container.mux(stream.encode(None))
