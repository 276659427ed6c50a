"""Pictures and animations of the linkages found in point-light displays."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from memo.linkage import PlanarFigure, Points
from memo.overlay import _h264
from memo.unfinished import complete_file

__all__ = [
    "plot_linkage",
    "telling_window",
    "write_linkage_png",
    "write_turned_png",
    "write_turned_video",
]

COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#444444")


def plot_linkage(ax: Axes, points: Points, figure: PlanarFigure, window: int, *, names: bool = True) -> Axes:
    """The points in the middle of a window, where most are visible, with trails, links and confidence."""
    part = figure.windows[window]
    tracks = points.positions[part.start : part.end]
    middle = tracks[_fullest(tracks)]
    against = tracks - _centre(tracks) + _centre(middle[None])
    ax.plot(against[..., 0], against[..., 1], color="#bbbbbb", linewidth=0.6, zorder=1)
    for index, chain in enumerate(part.chains):
        colour = COLOURS[index % len(COLOURS)]
        for link in chain.links:
            a, b = link.points
            ends = middle[[a, b]]
            ax.plot(ends[:, 0], ends[:, 1], color=colour, linewidth=3)
            if np.isfinite(link.confidence):
                text = f" {link.length:.0f} px, {link.confidence:.0%}"
                ax.annotate(text, ends.mean(axis=0), fontsize=7, color=colour)
    for a, b, _ in part.joints:
        ax.plot(middle[[a, b], 0], middle[[a, b], 1], color="#888888", linewidth=1, linestyle=":")
    ax.plot(middle[:, 0], middle[:, 1], "o", color="black", markersize=5)
    if names:
        for name, place in zip(points.names, middle, strict=True):
            ax.annotate(name, place, fontsize=7, xytext=(-4, 4), textcoords="offset points", ha="right")
    ax.set(aspect="equal", xlabel="u, px", ylabel="v, px")
    ax.invert_yaxis()
    start_s, end_s = points.times_s[part.start], points.times_s[part.end - 1]
    ax.set_title(f"{start_s:.2f} to {end_s:.2f} s: {part.status}", loc="left")
    return ax


def telling_window(figure: PlanarFigure) -> int:
    """The first interpreted window, or else the first window."""
    states = [window.status for window in figure.windows]
    return states.index("interpreted") if "interpreted" in states else 0


def write_linkage_png(
    path: str | PathLike[str], points: Points, figure: PlanarFigure, *, names: bool = True
) -> None:
    """The first interpreted window, or else the first window, as a picture."""
    window = telling_window(figure)
    drawing = Figure(figsize=(7, 8), layout="constrained")
    FigureCanvasAgg(drawing)
    plot_linkage(drawing.subplots(), points, figure, window, names=names)
    with complete_file(path) as temporary:
        drawing.savefig(temporary, dpi=120, format="png")


def write_turned_video(
    path: str | PathLike[str],
    points: Points,
    figure: PlanarFigure,
    *,
    turn_deg: float = 50.0,
    progress: Callable[[int, int], object] | None = None,
) -> None:
    """The display on the left, and on the right its limbs seen from `turn_deg` to the side.

    Each chain's first point is drawn at depth 0: the depth of one chain relative to another is
    undetermined, and each undecided chain may be reflected. `progress` is called with the frames drawn
    and the total.
    """
    flat, turned = _turned(points, figure, turn_deg)
    links_at = _links_by_frame(figure, len(flat))
    drawing = Figure(figsize=(9.6, 5.4), layout="constrained", facecolor="black")
    canvas = FigureCanvasAgg(drawing)
    left, right = drawing.subplots(1, 2)
    reach = np.nanmax(np.abs(flat - np.nanmean(flat, axis=(0, 1)))) * 1.1
    for ax in (left, right):
        ax.set(
            xlim=(-reach, reach),
            ylim=(np.nanmean(flat[..., 1]) + reach, np.nanmean(flat[..., 1]) - reach),
            aspect="equal",
            facecolor="black",
        )
        ax.set_axis_off()
    left.set_title("as seen", color="white")
    (dots,) = left.plot([], [], "o", color="white", markersize=5, animated=True)
    title = right.set_title(" ", color="white")
    title.set_animated(True)
    most = max(map(len, links_at), default=0)
    lines = [right.plot([], [], "o-", linewidth=3, animated=True)[0] for _ in range(most)]
    canvas.draw()
    empty = canvas.copy_from_bbox(drawing.bbox)  # what is the same in all frames
    with complete_file(path) as temporary, _h264(str(temporary), _rate(points.times_s)) as write:
        for frame in range(len(flat)):
            canvas.restore_region(empty)
            dots.set_data(flat[frame, :, 0], flat[frame, :, 1])
            left.draw_artist(dots)
            for line, (index, a, b) in zip(lines, links_at[frame], strict=False):
                line.set_data(*turned[frame, [a, b]].T)
                line.set_color(COLOURS[index % len(COLOURS)])
                right.draw_artist(line)
            title.set_text(f"turned {turn_deg:g} deg: {figure.sources[frame]}")
            right.draw_artist(title)
            write(np.asarray(canvas.buffer_rgba())[..., :3].copy(), float(points.times_s[frame]))
            if progress is not None:
                progress(frame + 1, len(flat))


def _centre(tracks: Any) -> Any:
    """Mean of the visible points in each frame (T, 1, 2), NaN if there is none."""
    seen = np.isfinite(tracks).all(axis=2, keepdims=True)
    count = seen.sum(axis=1, keepdims=True)
    total = np.where(seen, tracks, 0).sum(axis=1, keepdims=True)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _fullest(tracks: Any) -> int:
    """The frame nearest to the middle among those with most points."""
    seen = np.isfinite(tracks).all(axis=2).sum(axis=1)
    fullest = np.flatnonzero(seen == seen.max())
    return int(fullest[np.argmin(np.abs(fullest - len(tracks) // 2))])


def _turned(points: Points, figure: PlanarFigure, turn_deg: float) -> tuple[Any, Any]:
    """The points held in place horizontally (T, K, 2), as seen and rotated about the vertical."""
    tracks, depth = points.at_one_scale().positions, figure.depth
    centre = _centre(tracks)
    flat = tracks - centre + _centre(centre.swapaxes(0, 1)) * [0, 1]
    turn = np.deg2rad(turn_deg)
    return flat, np.stack([flat[..., 0] * np.cos(turn) - depth * np.sin(turn), flat[..., 1]], axis=-1)


def write_turned_png(
    path: str | PathLike[str], points: Points, figure: PlanarFigure, *, turn_deg: float = 50.0
) -> None:
    """Five instants of the first interpreted window: as seen above, the limbs from `turn_deg` aside below."""
    flat, turned = _turned(points, figure, turn_deg)
    window = figure.interpreted[0]
    links_at = _links_by_frame(figure, len(flat))
    drawing = Figure(figsize=(10, 6.5), layout="constrained")
    FigureCanvasAgg(drawing)
    grid = drawing.subplots(2, 5, sharex=True, sharey=True)
    for column, frame in enumerate(np.linspace(window.start, window.end - 1, 5).astype(int)):
        for ax, places in zip(grid[:, column], (flat, turned), strict=True):
            for index, a, b in links_at[frame]:
                ends = places[frame, [a, b]]
                ax.plot(ends[:, 0], ends[:, 1], "o-", color=COLOURS[index % len(COLOURS)], markersize=4)
            ax.set(aspect="equal")
            ax.set_axis_off()
        grid[0, column].plot(flat[frame, :, 0], flat[frame, :, 1], "o", color="black", markersize=3)
        grid[0, column].set_title(f"{points.times_s[frame]:.2f} s")
        grid[1, column].set_title(f"turned {turn_deg:g} deg")
    grid[0, 0].invert_yaxis()
    with complete_file(path) as temporary:
        drawing.savefig(temporary, dpi=110, format="png")


def _links_by_frame(figure: PlanarFigure, frames: int) -> list[list[tuple[int, int, int]]]:
    """For each frame, (chain, point, point) of the interpreted window whose middle is nearest."""
    read = figure.interpreted

    def links(frame: int) -> list[tuple[int, int, int]]:
        if not read:
            return []
        window = min(read, key=lambda w: abs(w.start + w.end - 2 * frame - 1))
        return [(index, *link.points) for index, chain in enumerate(window.chains) for link in chain.links]

    return [links(frame) for frame in range(frames)]


def _rate(times_s: Any) -> float:
    return 1 / float(np.median(np.diff(times_s))) if len(times_s) > 1 else 25.0
