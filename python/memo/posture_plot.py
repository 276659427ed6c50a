"""Plots of postures: the postures left in a frame, and the motion over time.

Every function draws into the given Axes and returns them; nothing is shown. `write_posture_plot` saves
them in one PNG file. Right limbs are solid, left limbs dashed.
"""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from memo import _memo
from memo.plot import LEFT, NEUTRAL, RIGHT
from memo.unfinished import complete_file
from memo.wording import counted

if TYPE_CHECKING:
    from memo.postures import Postures

__all__ = ["draw_figure", "plot_from_above", "plot_from_the_side", "plot_strip", "write_posture_plot"]

TRUNK = (
    *(("neck", joint) for joint in ("right_shoulder", "left_shoulder", "pelvis")),
    *((joint, "pelvis") for joint in ("right_shoulder", "left_shoulder", "right_hip", "left_hip")),
)
ARM, LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")

STRIP_FIGURES = 12
_STRIP_STEP_M = 0.75
_NEAR_GROUND_M = 0.6

Array = npt.NDArray[np.float64]


def draw_figure(ax: Axes, joints: Array, *, width: float = 1.0, alpha: float = 1.0) -> Axes:
    """A stick figure of 14 points (14, 2) in the axes' coordinates; `width` times the usual line width."""
    at = dict(zip(_memo.joint_names(), joints, strict=True))
    for start, end in TRUNK:
        ax.plot(*np.transpose([at[start], at[end]]), color=NEUTRAL, linewidth=width, alpha=alpha)
    for side, colour, style, own in (("right", RIGHT, "-", 1.8), ("left", LEFT, (0, (3, 2)), 1.2)):
        for limb in (ARM, LEG):
            chain = np.transpose([at[f"{side}_{joint}"] for joint in limb])
            ax.plot(*chain, color=colour, linestyle=style, linewidth=own * width, alpha=alpha)
    ax.plot(*at["neck"], marker="o", markersize=4 * np.sqrt(width), color=NEUTRAL, alpha=alpha)
    return ax


def plot_from_the_side(ax: Axes, postures: Postures, row: int) -> Axes:
    """All groups of a frame, thin, and its posture in the motion, thick: away from the camera and up."""
    camera, away, _ = _view(postures, postures.smoothed_m[row], postures.groups_m[row])

    def plane(points: Array) -> Array:
        return np.stack([(points - camera) @ away, points[..., 2]], axis=-1)

    _draw_choice(ax, postures, row, plane)
    _draw_ground(ax, postures)
    ax.set(xlabel="away from the camera, m", ylabel=_height_name(postures))
    ax.set_title("from the side", loc="left", fontsize=9)
    return ax


def plot_from_above(ax: Axes, postures: Postures, row: int) -> Axes:
    """The same as `plot_from_the_side`, away from the camera and to its left."""
    camera, away, leftwards = _view(postures, postures.smoothed_m[row], postures.groups_m[row])

    def plane(points: Array) -> Array:
        return np.stack([(points - camera) @ away, (points - camera) @ leftwards], axis=-1)

    _draw_choice(ax, postures, row, plane)
    ax.set(xlabel="away from the camera, m", ylabel="to its left, m")
    ax.set_title("from above", loc="left", fontsize=9)
    return ax


def plot_strip(ax: Axes, postures: Postures) -> Axes:
    """The motion from the side, one figure beside the other, in frames spread evenly over the known ones."""
    known = np.flatnonzero(postures.found)
    rows = known[np.unique(np.linspace(0, len(known) - 1, STRIP_FIGURES).round().astype(int))]
    along, name = _strip_direction(postures, known)
    for place, row in enumerate(rows):
        joints = postures.smoothed_m[row]
        across = joints @ along
        draw_figure(ax, np.column_stack([across - np.nanmean(across) + _STRIP_STEP_M * place, joints[:, 2]]))
    _draw_ground(ax, postures)
    ax.set_xticks(_STRIP_STEP_M * np.arange(len(rows)), [f"{postures.times_s[row]:.2f}" for row in rows])
    ax.set(xlabel="time, s", ylabel=_height_name(postures))
    ax.set_title(f"the motion from the side; to the right: {name}", loc="left", fontsize=9)
    ax.set_aspect("equal")
    return ax


def write_posture_plot(postures: Postures, path: str | PathLike[str], row: int | None = None) -> Path:
    """Writes a frame's postures from the side and from above, and the motion below, as PNG."""
    path = Path(path)
    row = postures.typical_row() if row is None else row
    figure = Figure(figsize=(9, 7.5), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.8, 1))
    side, above, strip = (figure.add_subplot(part) for part in (grid[0, 0], grid[0, 1], grid[1, :]))
    for ax in (side, above, strip):
        ax.spines[["top", "right"]].set_visible(False)
    plot_from_the_side(side, postures, row)
    plot_from_above(above, postures, row)
    plot_strip(strip, postures)
    for name, style, colour in (("right limbs", "-", RIGHT), ("left limbs", "--", LEFT)):
        above.plot([], [], color=colour, linestyle=style, label=name)
    above.legend(frameon=False, fontsize=8, loc="upper right", bbox_to_anchor=(1, 1.12), ncols=2)
    figure.suptitle(_headline(postures, row), fontsize=10)
    with complete_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return path


def _height_name(postures: Postures) -> str:
    """The world of an assumed camera begins at the camera: its ground is unknown."""
    return "height above the camera, m" if postures.camera_assumed else "height, m"


def _headline(postures: Postures, row: int) -> str:
    survivors, drawn = int(postures.survivors[row]), len(postures.group_sizes[row])
    groups = counted(drawn, "group")
    if not postures.all_groups_given[row]:
        groups = f"the largest {groups}"
    left = f"{counted(survivors, 'posture')} left, {groups} drawn thin" if survivors else "no posture left"
    return f"frame {postures.frames[row]}, {postures.times_s[row]:.2f} s: {left}; thick: the motion"


def _draw_choice(ax: Axes, postures: Postures, row: int, plane: Callable[[Array], Array]) -> None:
    groups = postures.groups_m[row]
    alpha = float(np.clip(2.5 / max(len(groups), 1), 0.12, 0.5))
    for joints in plane(groups):
        draw_figure(ax, joints, width=0.6, alpha=alpha)
    draw_figure(ax, plane(postures.smoothed_m[row]), width=1.7)
    ax.set_aspect("equal", adjustable="datalim")


def _draw_ground(ax: Axes, postures: Postures) -> None:
    """The line z = 0, if the person stands near it (some worlds have another origin)."""
    if not postures.camera_assumed and abs(np.nanmin(postures.smoothed_m[..., 2])) < _NEAR_GROUND_M:
        ax.axhline(0, color=NEUTRAL, linewidth=0.6, linestyle=":")


def _view(postures: Postures, *shown: Array) -> tuple[Array, Array, Array]:
    """The camera, and horizontal unit vectors from it to the person and to its left."""
    camera = np.asarray(postures.camera.position)
    points = np.concatenate([part.reshape(-1, 3) for part in shown])
    known = points[np.isfinite(points).all(axis=1)]
    away = (known.mean(axis=0) - camera) * (1, 1, 0) if len(known) else np.zeros(3)
    length = np.linalg.norm(away)
    away = away / length if length > 1e-6 else np.array([0.0, 1.0, 0.0])
    return camera, away, np.array([-away[1], away[0], 0.0])


def _strip_direction(postures: Postures, known: npt.NDArray[np.intp]) -> tuple[Array, str]:
    """The direction of walking; for a person who stays in place, away from the camera."""
    middles = np.nanmean(postures.smoothed_m[known], axis=1) * (1, 1, 0)
    quarter = max(len(known) // 4, 1)
    travel = middles[-quarter:].mean(axis=0) - middles[:quarter].mean(axis=0)
    length = np.linalg.norm(travel)
    if postures.heading_source != "travel" or length < 1e-6:
        return _view(postures, postures.smoothed_m[known])[1], "away from the camera"
    return travel / length, "the direction of walking"
