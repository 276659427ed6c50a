"""Plots of a tracked walk, after the figures of Rohr (1994).

Every function draws into the given Axes and returns them; nothing is shown. `write_plots` saves
all of them as PNG files.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from memo.files import ANGLES
from memo.unfinished import complete_file

__all__ = [
    "new_axes",
    "plot_angles",
    "plot_exchanges",
    "plot_motion",
    "plot_over_time",
    "plot_similarity",
    "plot_start",
    "write_plots",
]

RIGHT = "#d55e00"
LEFT = "#0072b2"
NEUTRAL = "#444444"
SIDE_COLOURS = {"right": RIGHT, "left": LEFT}
MEASURED: dict[str, Any] = {"linestyle": "none", "marker": ".", "markersize": 4, "color": NEUTRAL}


def new_axes() -> Axes:
    """Axes of a new pyplot figure, which notebooks show automatically."""
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def plot_similarity(ax: Axes, track: Any, start_row: int = 0) -> Axes:
    """Similarity of model and image edges over the gait phase, in one frame of the start (Fig. 19)."""
    start = track.start
    curve = np.asarray(start.similarity)[start_row]
    ax.plot(np.arange(len(curve)) / len(curve), curve, color=NEUTRAL, linewidth=1.2)
    best = start.phase[start_row]
    ax.axvline(best, color=RIGHT, linewidth=1, label=f"best, {best:.2f}")
    ax.axvline((best + 0.5) % 1, color=LEFT, linewidth=1, linestyle="--", label="half a cycle away")
    ax.set(xlim=(0, 1), xlabel="gait phase", ylabel="similarity")
    ax.set_title(f"frame {start.frame[start_row]}", loc="left")
    _legend_above(ax)
    return ax


def plot_start(ax: Axes, track: Any) -> Axes:
    """Best phase of each frame of the starting phase, with the tracked line and the line half a cycle away
    (Fig. 23)."""
    frames, phases = np.asarray(track.start.frame), np.asarray(track.start.phase)
    ax.plot(frames, phases, **{**MEASURED, "markersize": 7, "label": "best in the frame"})
    line = _phase_line(track.columns, frames)
    if line is not None:
        ends = np.linspace(frames[0], frames[-1], 200)
        for offset, style, label in ((0.0, "-", "tracked"), (0.5, ":", "half a cycle away")):
            ax.plot(*_cut_at_wraps(line(ends) + offset, ends)[::-1], color=RIGHT, ls=style, label=label)
    ax.set(ylim=(0, 1), xlabel="frame", ylabel="gait phase")
    _legend_above(ax)
    return ax


def plot_motion(axes: Sequence[Sequence[Axes]], track: Any) -> Sequence[Sequence[Axes]]:
    """Position and phase over the frames: measured left, filtered with one sigma right (Fig. 26).

    `axes` is a grid of three rows (x, z, phase) and two columns.
    """
    columns, measured = track.columns, track.measured
    frames = columns["frame"]
    measured_frames = np.asarray(measured.get("frame", frames))
    for (left, right), key in zip(axes, ("x", "z", "phase"), strict=True):
        name = key if key == "phase" else f"{key}_m"
        left.plot(measured_frames, measured[key], **MEASURED)
        curve = _apart(columns["walk"], columns[name], frames, columns[f"sd_{name}"])
        value, at, sd = _cut_at_wraps(*curve) if key == "phase" else curve
        right.plot(at, value, color=NEUTRAL, linewidth=1.2)
        right.fill_between(at, value - sd, value + sd, color=NEUTRAL, alpha=0.25, linewidth=0)
        left.set(ylabel=name.replace("_m", ", m"))
        right.sharey(left)
    axes[0][0].set(title="measured")
    axes[0][1].set(title="filtered, ± one standard deviation")
    for ax in axes[-1]:
        ax.set(xlabel="frame")
    return axes


def plot_angles(axes: Sequence[Axes], track: Any) -> Sequence[Axes]:
    """Hip and knee flexion over time, right and left, with the heel strikes (Figs. 32 and 33).

    `axes` are two: hip and knee.
    """
    for ax, joint in zip(axes, ("hip", "knee"), strict=True):
        plot_over_time(ax, track, joint)
        ax.set(xlabel="")
    for ax in axes[1:]:
        legend = ax.get_legend()
        if legend is not None:
            legend.remove()
    axes[-1].set(xlabel="time, s (dotted: heel strikes)")
    return axes


def plot_over_time(ax: Axes, track: Any, what: str) -> Axes:
    """Over time: flexion of a joint ("hip", "knee", "shoulder", "elbow") on both sides, with the heel
    strikes, or one column with its standard deviation, if it has one."""
    columns = track.columns
    time_s = columns["time_s"]
    if what in ANGLES:
        for side, colour in SIDE_COLOURS.items():
            at, value = _apart(columns["walk"], time_s, columns[f"{side}_{what}_deg"])
            ax.plot(at, value, color=colour, linewidth=1.2, label=side)
        for event in track.events:
            if event["event"] == "heel_strike":
                ax.axvline(event["time_s"], color=SIDE_COLOURS[event["side"]], linewidth=0.6, linestyle=":")
        ax.set(ylabel=f"{what} flexion, degrees")
        _legend_above(ax)
    elif what in columns:
        sd = columns.get(f"sd_{what}", np.full(len(time_s), np.nan))
        value, at, sd = _apart(columns["walk"], columns[what], time_s, sd)
        if what == "phase":
            value, at, sd = _cut_at_wraps(value, at, sd)
        ax.plot(at, value, color=NEUTRAL, linewidth=1.2)
        ax.fill_between(at, value - sd, value + sd, color=NEUTRAL, alpha=0.25, linewidth=0)
        ax.set(ylabel=what)
    else:
        wanted = ", ".join((*ANGLES, *columns))
        raise ValueError(f"nothing named {what!r} to plot; there are {wanted}")
    ax.set(xlabel="time, s")
    return ax


def plot_keypoints(ax: Axes, keypoints: Any) -> Axes:
    """The paths of the points in the picture: right orange, left blue, others grey; dots in one frame."""
    colours = {"right": RIGHT, "left": LEFT}
    seen = np.isfinite(keypoints.points).all(axis=2)
    row = int(seen.sum(axis=1).argmax())
    for index, name in enumerate(keypoints.names):
        colour = colours.get(name.partition("_")[0], NEUTRAL)
        ax.plot(*keypoints.points[:, index].T, color=colour, linewidth=0.6, alpha=0.5)
        ax.plot(*keypoints.points[row, index], ".", color=colour)
    ax.set(aspect="equal", xlabel="u, px", ylabel="v, px")
    ax.invert_yaxis()
    ax.set_title(f"frame {keypoints.frames[row]}", loc="left")
    return ax


def plot_exchanges(ax: Axes, repair: Any) -> Axes:
    """Where right and left were exchanged in keypoints, one bar over time per group; grey if undecided."""
    keypoints = repair.keypoints
    frame_s = float(np.median(np.diff(keypoints.times_s))) if len(keypoints.times_s) > 1 else 1.0
    at_s = dict(zip(keypoints.frames.tolist(), keypoints.times_s.tolist(), strict=True))
    groups = list(repair.exchanged)
    shades = {"flipped": RIGHT, "guessed": "#e8b48a", "undecided": "#cccccc"}
    for verdict in ("undecided", "guessed", "flipped"):
        for place, group in enumerate(groups):
            spans = [
                (row["time_s"], at_s[row["last_frame"]] - row["time_s"] + frame_s)
                for row in repair.flips
                if (row["group"], row["verdict"]) == (group, verdict)
            ]
            label = verdict if place == 0 else None
            ax.broken_barh(spans, (place - 0.4, 0.8), color=shades[verdict], label=label)
    ends = keypoints.times_s[[0, -1]] + [0, frame_s] if len(keypoints.times_s) else [0, 1]
    ax.set(xlim=ends, xlabel="time, s", yticks=range(len(groups)), yticklabels=groups)
    _legend_above(ax)
    return ax


def write_plots(track: Any, out_dir: str | PathLike[str]) -> list[Path]:
    """Writes motion.png and angles.png, and similarity.png and start.png if the track has a start."""
    plots: dict[str, tuple[tuple[int, int], tuple[float, float], Callable[[Any], object]]] = {
        "motion": ((3, 2), (8, 6), lambda axes: plot_motion(axes, track)),
        "angles": ((2, 1), (6, 5), lambda axes: plot_angles(axes[:, 0], track)),
    }
    if track.start is not None:
        middle = len(track.start.frame) // 2
        plots["similarity"] = ((1, 1), (5, 3), lambda axes: plot_similarity(axes[0, 0], track, middle))
        plots["start"] = ((1, 1), (5, 3), lambda axes: plot_start(axes[0, 0], track))
    return [_save(Path(out_dir) / f"{name}.png", *how) for name, how in plots.items()]


def _save(
    path: Path, grid: tuple[int, int], size_in: tuple[float, float], draw: Callable[[Any], object]
) -> Path:
    figure = Figure(figsize=size_in, dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(*grid, squeeze=False, sharex="col")
    for ax in axes.flat:
        ax.spines[["top", "right"]].set_visible(False)
    draw(axes)
    with complete_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return path


def _phase_line(
    columns: dict[str, Any], start: npt.NDArray[np.int64]
) -> Callable[[npt.NDArray[np.float64]], Any] | None:
    """The straight line through the tracked phases of the walk that starts in these frames, for comparison
    with the starting phase: of several, the longest."""
    walks = columns["walk"][np.isin(columns["frame"], start)]
    lengths = {walk: int((columns["walk"] == walk).sum()) for walk in walks.tolist()}
    own = columns["walk"] == max(lengths, key=lambda walk: lengths[walk], default=0)
    frames, phases = columns["frame"][own], columns["phase"][own]
    if len(frames) < 2:
        return None
    return np.polynomial.Polynomial.fit(frames, np.unwrap(phases, period=1.0), 1)


def _cut_at_wraps(phases: npt.ArrayLike, *others: npt.ArrayLike) -> list[npt.NDArray[np.float64]]:
    """Phases in [0, 1), and the others, with a NaN at each wrap: no line is drawn across it."""
    wrapped = np.mod(phases, 1.0)
    anew = 1 + np.flatnonzero(np.abs(np.diff(wrapped)) > 0.5)
    return [np.insert(np.asarray(values, np.float64), anew, np.nan) for values in (wrapped, *others)]


def _apart(walks: npt.ArrayLike, *others: npt.ArrayLike) -> list[npt.NDArray[np.float64]]:
    """The others with a NaN between two walks: no line is drawn from one to the next."""
    anew = 1 + np.flatnonzero(np.diff(walks))
    return [np.insert(np.asarray(values, np.float64), anew, np.nan) for values in others]


def _legend_above(ax: Axes) -> None:
    ax.legend(frameon=False, ncols=3, loc="lower right", bbox_to_anchor=(1, 1), borderaxespad=0)
