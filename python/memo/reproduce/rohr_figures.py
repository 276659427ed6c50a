"""The figures of Rohr (1994) in kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from memo import _memo
from memo.plot import LEFT, MEASURED, NEUTRAL, RIGHT, plot_start
from memo.reproduce.result import Drawing
from memo.reproduce.sequence import Look, Sequence

__all__ = ["figures", "similarity_peaks", "start_outliers"]

CONTOUR = "#f0e442"
Array = npt.NDArray[np.float64]


def figures(scene: Sequence, filmed: Sequence | None) -> list[Drawing]:
    """All figures: those of a real sequence from `filmed`, if given, and the synthetic ones from `scene`."""
    shown = filmed or scene
    first, second = shown.examples
    return [
        *_of_the_model(),
        *_of_the_evidence(shown, first),
        *_of_the_position(shown),
        *_of_the_comparison(shown, first, second),
        *_of_a_sequence(scene, filmed),
        *(_of_a_side(shown, *side) for side in ((32, "right"), (33, "left"))),
    ]


def _on(sequence: Sequence, look: Look | None = None) -> str:
    at = "" if look is None else f", frame {look.frame}"
    return f"In kind, on {sequence.label}{at}; the paper's sequence is not published"


_PICTURE = (6.4, 4.8)
_PERSON = (4.5, 5.5)


def _of_the_model() -> list[Drawing]:
    """Section 3."""
    why = "Memo's body and gait; the paper's sizes and samples are not printed"
    curves = "Motion curves over the walking cycle: ten samples and their spline, and fifty"
    half = "Movement states for half of the walking cycle"
    return [
        Drawing("fig4", "Fig. 4", "The body: all contours, and those not hidden", _draw_body, (6, 5.5), why),
        Drawing("fig5", "Fig. 5", "Several persons, hidden contours removed", _draw_several, (8, 4.5), why),
        Drawing("fig6", "Fig. 6", curves, _draw_gait, (9, 6), why),
        Drawing("fig7", "Fig. 7", half, _draw_states, (11, 3), why),
    ]


def _of_the_evidence(shown: Sequence, look: Look) -> list[Drawing]:
    """Section 4.1."""
    why = _on(shown, look)
    cleaned = "After the binary operations, with the surrounding rectangle"

    def draw_change(figure: Figure) -> object:
        return _draw_mask(figure, look.stages.changed)

    return [
        Drawing("fig8", "Fig. 8", "Grey-value image", lambda f: _draw_image(f, look), _PICTURE, why),
        Drawing("fig9", "Fig. 9", "Result of the change detection, eq. (1)", draw_change, _PICTURE, why),
        Drawing("fig10", "Fig. 10", cleaned, lambda f: _draw_cleaned(f, look), _PICTURE, why),
        Drawing("fig11", "Fig. 11", "Outline", lambda f: _draw_outline(f, look), _PERSON, why),
        Drawing("fig12", "Fig. 12", "Velocity field", lambda f: _draw_velocities(f, look), (5, 5.5), why),
    ]


def _of_the_position(shown: Sequence) -> list[Drawing]:
    """Section 4.2."""
    axes = "Coordinate systems of scene, camera and image"
    midpoints = "Midpoints of the bottom and top edges of the rectangles"
    positions = "Positions from single rectangles on the ground plane"
    z_up = f"{_on(shown)}; memo's axes: Z up where the paper has Y"
    why = _on(shown)
    return [
        Drawing("fig13", "Fig. 13", axes, lambda f: _draw_axes(f, shown), (6.5, 5.5), z_up),
        Drawing("fig14", "Fig. 14", midpoints, lambda f: _draw_midpoints(f, shown), _PICTURE, why),
        Drawing("fig15", "Fig. 15", positions, lambda f: _draw_positions(f, shown), (7, 3.6), why),
    ]


def _of_the_comparison(shown: Sequence, first: Look, second: Look) -> list[Drawing]:
    """Sections 4.3 and 5.1, on two frames."""
    why, other = _on(shown, first), _on(shown, second)
    cut = "An edge cut to its window, and the model contour"
    curve, surface = (
        "Similarity over pose, with fixed position",
        "Similarity over pose and position, at the best height of each",
    )

    def draw_surface(figure: Figure) -> None:
        _draw_surface(figure, shown, first)

    def draw_state(look: Look) -> Callable[[Figure], object]:
        return lambda f: _draw_state(f, shown, look)

    def draw_curve(look: Look) -> Callable[[Figure], object]:
        return lambda f: _draw_similarity(f, shown, look)

    return [
        Drawing(
            "fig16",
            "Fig. 16",
            "Enclosing rectangle and edge lines",
            lambda f: _draw_edges(f, first),
            _PERSON,
            why,
        ),
        Drawing(
            "fig17",
            "Fig. 17",
            "Search windows of the model",
            lambda f: _draw_windows(f, shown, first),
            _PERSON,
            why,
        ),
        Drawing("fig18", "Fig. 18", cut, lambda f: _draw_comparison(f, shown, first), (6.5, 3.6), why),
        Drawing("fig19", "Fig. 19", curve, draw_curve(first), (6, 3.4), why),
        Drawing("fig19_surface", "Fig. 19", surface, draw_surface, (7, 4), f"{why}; not in the paper"),
        Drawing("fig20", "Fig. 20", "Determined motion state", draw_state(first), _PERSON, why),
        Drawing(
            "fig21", "Fig. 21", "Similarity over pose, another image", draw_curve(second), (6, 3.4), other
        ),
        Drawing(
            "fig22", "Fig. 22", "Determined motion state, another image", draw_state(second), _PERSON, other
        ),
    ]


def _of_a_sequence(scene: Sequence, filmed: Sequence | None) -> list[Drawing]:
    """Section 6: start, filter and models, synthetic and, if there is one, of a real sequence."""
    truth = f"{_on(scene)}; dashed: the truth"
    rows = [
        ("fig23", "Fig. 23", "The start on a synthetic sequence", _draw_start, scene, _on(scene)),
        (
            "fig26",
            "Fig. 26",
            "X, Y and pose: measured, and after the Kalman filter with one sigma",
            _draw_filter,
            scene,
            truth,
        ),
        ("fig27", "Fig. 27", "Estimated models, synthetic sequence", _draw_models, scene, _on(scene)),
    ]
    if filmed is not None:
        why = _on(filmed)
        rows += [
            ("fig24", "Figs. 24, 25", "The start on a real sequence", _draw_start, filmed, why),
            ("fig28", "Figs. 28, 30", "As Fig. 26, on a real sequence", _draw_filter, filmed, why),
            ("fig29", "Figs. 29, 31", "Estimated models, real sequence", _draw_models, filmed, why),
        ]
    sizes = {_draw_start: (6, 3.6), _draw_filter: (8, 6.5)}
    return [
        Drawing(
            name,
            item,
            caption,
            _drawn_of(draw, of),
            sizes[draw] if draw in sizes else _models_size(of),
            why,
        )
        for name, item, caption, draw, of, why in rows
    ]


def _drawn_of(draw: Callable[[Figure, Sequence], object], of: Sequence) -> Callable[[Figure], object]:
    return lambda figure: draw(figure, of)


def _of_a_side(shown: Sequence, number: int, side: str) -> Drawing:
    """Figs. 32 and 33."""
    caption = f"Hip and knee of the {side} side: estimated, and the model's optimal movement"
    if shown.truth is not None:
        caption += ", with the truth"
    return Drawing(
        f"fig{number}",
        f"Fig. {number}",
        caption,
        lambda f: _draw_angles(f, shown, side),
        (7, 5),
        _on(shown),
    )


# Numbers that rows share with figures.


def similarity_curve(sequence: Sequence, look: Look) -> tuple[Array, npt.NDArray[np.float32]]:
    """Phases and similarities of a frame over the whole cycle, with fixed position."""
    found = _memo.walk_similarity(sequence.walk, look.row, look.stages.edges)
    return found.phase, found.scores[:, 0, 0]


def similarity_peaks(sequence: Sequence, look: Look) -> tuple[float, float, float]:
    """The best phase, the best of those about half a cycle away from it, and how far they are apart."""
    phase, score = similarity_curve(sequence, look)
    best = phase[np.argmax(score)]
    away = (phase - best) % 1
    near_half = np.abs(away - 0.5) <= 0.15
    other = phase[near_half][np.argmax(score[near_half])]
    apart = (other - best) % 1
    return float(best), float(other), float(min(apart, 1 - apart))


def start_outliers(sequence: Sequence) -> tuple[int, int]:
    """Number of frames of the start that prefer a phase over a quarter cycle off the line, and the total."""
    start = sequence.walk.start
    line = start.line.phase_at_start + start.line.rate_hz * (start.time_s - start.time_s[0])
    off = np.abs((start.phase - line + 0.5) % 1 - 0.5)
    return int(np.sum(off > 0.25)), len(off)


# The model: Figs. 4-7.


def _lines(ax: Axes, segments: Array, colour: Any = "black", width: float = 1.0, **more: Any) -> None:
    ax.add_collection(LineCollection(list(segments), colors=colour, linewidths=width, **more))


def _contours_only(ax: Axes, segments: Array, colour: Any = "black", width: float = 1.0) -> None:
    _lines(ax, segments, colour, width)
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.invert_yaxis()
    ax.set_axis_off()


def _camera() -> _memo.Camera:
    return _memo.Camera.level((640, 480), 50.0, 1.2, 6.0)


def _draw_body(figure: Figure) -> None:
    left, right = figure.subplots(1, 2, sharey=True)
    for ax, hidden, title in ((left, True, "all contours"), (right, False, "hidden ones removed")):
        segments, _, _ = _memo.model_contours(_camera(), [(0, 0, -0.9, 0.05, 1.75)], hidden=hidden)
        _contours_only(ax, segments)
        ax.set_title(title, fontsize=9)
    right.invert_yaxis()  # shared with the left


def _draw_several(figure: Figure) -> None:
    people = [
        *((-1.3, -0.8, 0.3, 0.10, 1.80), (-0.6, 0.3, 0.1, 0.45, 1.65), (0.1, -0.5, 3.0, 0.80, 1.72)),
        *((0.9, 0.6, 2.6, 0.30, 1.85), (1.5, -0.9, -0.4, 0.60, 1.60), (0.4, 1.6, 0.0, 0.95, 1.78)),
    ]
    segments, _, who = _memo.model_contours(_camera(), people)
    colours = np.array(["#000000", "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9"])[who]
    _contours_only(figure.subplots(), segments, colours)


def _draw_gait(figure: Figure) -> None:
    phases = np.linspace(0, 1, 201)
    ten, fifty = (_memo.gait_curves(gait, phases.tolist()) for gait in ("sampled_10", "dense"))
    instants = np.arange(10) / 10
    samples = _memo.gait_curves("sampled_10", instants.tolist())
    axes = figure.subplots(2, 2, sharex=True)
    for column, (ax, name) in enumerate(zip(axes.flat, ("hip", "knee", "shoulder", "elbow"), strict=True)):
        ax.plot(phases, fifty[:, column], color=NEUTRAL, linestyle="--", linewidth=1, label="fifty samples")
        ax.plot(phases, ten[:, column], color=RIGHT, linewidth=1.4, label="spline of ten")
        ax.plot(instants, samples[:, column], color=RIGHT, marker="o", linestyle="none", label="ten samples")
        ax.set(ylabel=f"{name} flexion, degrees", xlim=(0, 1))
        ax.spines[["top", "right"]].set_visible(False)
    for ax in axes[-1]:
        ax.set(xlabel="pose (phase of the walking cycle)")
    axes[0, 0].legend(frameon=False, fontsize=8)


def _draw_states(figure: Figure) -> None:
    states, spacing = 10, 115.0  # pixels
    ax = figure.subplots()
    for k in range(states):
        segments, _, _ = _memo.model_contours(
            _camera(), [(0, 0, 0, 0.5 * k / (states - 1), 1.75)], gait="sampled_10"
        )
        _lines(ax, segments + np.array([spacing * k, 0]))
        below: dict[str, Any] = {
            "xycoords": ("data", "axes fraction"),
            "xytext": (0, -12),
            "textcoords": "offset points",
        }
        place = (segments[..., 0].mean() + spacing * k, 0)
        ax.annotate(f"{0.5 * k / (states - 1):.2f}", place, ha="center", fontsize=8, **below)
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.invert_yaxis()
    ax.set_axis_off()


# One image: Figs. 8-12 and 16-22.


def _grey(ax: Axes, luma: npt.NDArray[np.uint8], *, faint: bool = False) -> None:
    ax.imshow(luma, cmap="gray", vmin=0, vmax=255, alpha=0.45 if faint else None, interpolation="nearest")
    ax.set_axis_off()


def _about(ax: Axes, look: Look, margin: float = 0.12) -> None:
    """Shows the part of the image about the rectangle."""
    left, top, right, bottom = look.stages.rectangle
    edge = margin * (bottom - top)
    ax.set(xlim=(left - edge, right + edge), ylim=(bottom + edge, top - edge))
    ax.set_aspect("equal")


def _rectangle(ax: Axes, look: Look, colour: str) -> None:
    left, top, right, bottom = look.stages.rectangle
    ax.plot([left, right, right, left, left], [top, top, bottom, bottom, top], color=colour, linewidth=1)


def _draw_image(figure: Figure, look: Look) -> None:
    _grey(figure.subplots(), look.luma)


def _draw_mask(figure: Figure, mask: npt.NDArray[np.bool_]) -> Axes:
    ax = figure.subplots()
    ax.imshow(~mask, cmap="gray", interpolation="nearest")
    ax.set(xticks=[], yticks=[])
    return ax


def _draw_cleaned(figure: Figure, look: Look) -> None:
    _rectangle(_draw_mask(figure, look.stages.cleaned), look, RIGHT)


def _draw_outline(figure: Figure, look: Look) -> None:
    ax = figure.subplots()
    for outline in look.stages.outlines:
        closed = np.vstack([outline, outline[:1]])
        ax.plot(closed[:, 0], closed[:, 1], color="black", linewidth=1)
    _rectangle(ax, look, RIGHT)
    _about(ax, look)
    ax.set_axis_off()


def _draw_velocities(figure: Figure, look: Look) -> None:
    u, v = _memo.velocity_field(look.luma, look.after, look.stages.cleaned)
    left, top, right, bottom = look.stages.rectangle
    step = max(4, (bottom - top) // 40)
    y, x = np.mgrid[top : bottom + 1 : step, left : right + 1 : step]
    ax = figure.subplots()
    _grey(ax, look.luma, faint=True)
    arrows = ax.quiver(
        x, y, u[y, x], v[y, x], color=RIGHT, angles="xy", scale_units="xy", scale=1 / 2, width=0.003
    )
    ax.quiverkey(arrows, 0.8, 1.03, 5, "5 px per frame", labelpos="E", fontproperties={"size": 8})
    _about(ax, look)


def _draw_edges(figure: Figure, look: Look) -> None:
    ax = figure.subplots()
    _lines(ax, look.stages.edges[:, :4].reshape(-1, 2, 2), "black", 1.2)
    _rectangle(ax, look, RIGHT)
    _about(ax, look)
    ax.set_axis_off()


def _draw_windows(figure: Figure, sequence: Sequence, look: Look) -> None:
    lines, _ = _memo.walk_lines(sequence.walk, look.row)
    windows = _memo.search_windows(lines)
    ax = figure.subplots()
    _grey(ax, look.luma, faint=True)
    for corners in windows:
        ax.fill(corners[:, 0], corners[:, 1], facecolor=LEFT, edgecolor=LEFT, alpha=0.18, linewidth=0.8)
    _lines(ax, lines, "black", 1.4)
    _about(ax, look)


def _draw_comparison(figure: Figure, sequence: Sequence, look: Look) -> None:
    """The longest contour matched to an edge neither parallel to it nor on it."""
    lines, _ = _memo.walk_lines(sequence.walk, look.row)
    edges = np.ascontiguousarray(look.stages.edges[:, :4].reshape(-1, 2, 2))
    _, matches = _memo.similarity(lines, edges)
    if not len(matches):
        figure.text(0.5, 0.5, "no edge near the contours", ha="center")
        return
    lengths = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
    telling = (np.degrees(matches[:, 4]) > 1.5) & (matches[:, 3] > 1)
    among = matches[telling] if telling.any() else matches
    line, edge, overlap, distance, angle, value = among[np.argmax(among[:, 5])]
    start, end = lines[int(line)]
    along = (end - start) / lengths[int(line)]
    turn = np.array([along, [-along[1], along[0]]])
    window, cut_from = (turn @ (points - start).T for points in (
        _memo.search_windows(lines[[int(line)]])[0], edges[int(edge)]))  # fmt: skip
    ax = figure.subplots()
    ax.fill(*window, facecolor=LEFT, alpha=0.15)
    ax.plot([0, lengths[int(line)]], [0, 0], color="black", linewidth=2.5, label="model contour")
    ax.plot(*cut_from, color=RIGHT, linewidth=2, label="grey-value edge")
    ax.set_aspect("equal")
    ax.set(xlabel="along the contour, px", ylabel="across, px")
    ax.set_title(
        f"l_M = {lengths[int(line)]:.1f} px, l = {overlap:.1f} px, d = {distance:.1f} px,"
        f" Δφ = {np.degrees(angle):.1f}°: s = {value:.1f} px",
        fontsize=9,
        loc="left",
    )
    ax.legend(frameon=False, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.25), ncols=2)


def _draw_similarity(figure: Figure, sequence: Sequence, look: Look) -> None:
    phase, score = similarity_curve(sequence, look)
    best, other, _ = similarity_peaks(sequence, look)
    ax = figure.subplots()
    ax.plot(phase, score, color=NEUTRAL, marker=".", linewidth=1)
    ax.axvline(best, color=RIGHT, linewidth=1, label=f"best, {best:.2f}")
    ax.axvline(
        other, color=LEFT, linewidth=1, linestyle="--", label=f"best about half a cycle away, {other:.2f}"
    )
    ax.set(xlim=(0, 1), xlabel="pose", ylabel="similarity s(p)")
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=8, ncols=2, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0)


def _draw_surface(figure: Figure, sequence: Sequence, look: Look) -> None:
    found = _memo.walk_similarity(sequence.walk, look.row, look.stages.edges, along_m=0.4, height_m=0.1)
    surface = found.scores.max(axis=2)
    ax = figure.subplots()
    image = ax.pcolormesh(found.phase, 100 * found.along, surface.T, cmap="viridis", shading="nearest")
    best = found.best
    ax.plot(best[0], 100 * best[1], marker="x", color="white", markersize=9)
    ax.set(xlabel="pose", ylabel="position along the path, cm from the track's")
    ax.set_title(f"best at pose {best[0]:.2f}, {100 * best[1]:+.0f} cm", fontsize=9, loc="left")
    figure.colorbar(image, ax=ax, label="similarity s(p)")


def _draw_state(figure: Figure, sequence: Sequence, look: Look) -> None:
    best, _, _ = similarity_peaks(sequence, look)
    lines, _ = _memo.walk_lines(sequence.walk, look.row, best)
    ax = figure.subplots()
    _grey(ax, look.luma)
    _lines(ax, lines, CONTOUR, 1.4)
    _about(ax, look)
    ax.set_title(f"pose {best:.2f}", fontsize=9, loc="left")


# Position and camera: Figs. 13-15.


def _draw_axes(figure: Figure, sequence: Sequence) -> None:
    """The camera, its image plane, the walker and both systems of axes in the world."""
    camera, look = sequence.camera, sequence.examples[0]
    columns = sequence.track.columns
    position = np.array(camera.position)
    torso = np.array([columns[f"{axis}_m"][look.row] for axis in "xyz"])
    # Directions of the camera's axes in the world: rows of its rotation.
    rotation = camera.camera_from_world(np.vstack([np.zeros(3), np.eye(3)]))
    axes_in_world = (rotation[1:] - rotation[0]).T
    ax: Any = figure.add_subplot(projection="3d")
    for origin, directions, names, length in (
        (np.zeros(3), np.eye(3), "XYZ", 1.0),
        (position, axes_in_world, "xyz", 1.0),
    ):
        for direction, name, colour in zip(directions, names, ("#d55e00", "#009e73", "#0072b2"), strict=True):
            tip = origin + length * direction
            ax.plot(*np.transpose([origin, tip]), color=colour, linewidth=1.6)
            ax.text(*(origin + 1.15 * length * direction), name, color=colour)
    for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
        for side, colour in (("right", RIGHT), ("left", LEFT)):
            points = [[columns[f"{side}_{j}_{a}_m"][look.row] for a in "xyz"] for j in chain]
            ax.plot(*np.transpose(points), color=colour, linewidth=1.8)
    trunk = [
        np.mean(
            [[columns[f"{side}_{j}_{a}_m"][look.row] for a in "xyz"] for side in ("right", "left")], axis=0
        )
        for j in ("shoulder", "hip")
    ]
    ax.plot(*np.transpose(trunk), color=NEUTRAL, linewidth=1.8)
    ax.plot(*np.transpose([position, torso]), color=NEUTRAL, linewidth=0.7, linestyle=":")
    width, height = (0.5 * side for side in camera.size)
    scale = 0.9 / width
    corners = np.array(
        [[a * width, b * height, 0] for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
    )
    frame = position + (scale * corners + [0, 0, 1.5]) @ axes_in_world
    ax.plot(*frame.T, color=NEUTRAL, linewidth=1)
    ax.text(*frame[0], "image", fontsize=8, color=NEUTRAL)
    ax.text(*(position - [0, 0, 0.35]), "camera", fontsize=8)
    ax.text(0, 0, -0.3, "scene", fontsize=8)
    ax.set(xticklabels=[], yticklabels=[], zticklabels=[])
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.pane.set_visible(False)
    ax.grid(False)
    ax.set_aspect("equal")
    ax.set_box_aspect(None, zoom=1.2)
    ax.view_init(elev=20, azim=-30)


def _draw_midpoints(figure: Figure, sequence: Sequence) -> None:
    ax = figure.subplots()
    _grey(ax, sequence.examples[0].luma, faint=True)
    _, left, top, right, bottom = sequence.rectangles.T
    middle = 0.5 * (left + right)
    for rows, colour, label in ((top, LEFT, "top"), (bottom, RIGHT, "bottom")):
        ax.plot(middle, rows, color=colour, marker=".", linewidth=0.8, label=label)
    ax.legend(frameon=True, fontsize=8, loc="upper right")


def _draw_positions(figure: Figure, sequence: Sequence) -> None:
    soles = sequence.soles_m()
    ax = figure.subplots()
    ax.plot(soles[:, 0], soles[:, 1], color=NEUTRAL, marker=".", linewidth=0.8, label="single rectangles")
    columns = sequence.track.columns
    ax.plot(columns["x_m"], columns["y_m"], color=RIGHT, linewidth=1.4, label="the track's path")
    if sequence.truth is not None:
        ax.plot(
            sequence.true("x_m"),
            sequence.true("y_m"),
            color="black",
            linestyle="--",
            linewidth=1,
            label="truth",
        )
    ax.set(xlabel="X, m", ylabel="Y (away from the camera), m")
    ax.margins(y=0.3)
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0)


# Over time: Figs. 23-33.


def _draw_start(figure: Figure, sequence: Sequence) -> None:
    ax = figure.subplots()
    ax.spines[["top", "right"]].set_visible(False)
    plot_start(ax, sequence.track)


def _draw_filter(figure: Figure, sequence: Sequence) -> None:
    """Left the best hypothesis of each frame, right the Kalman filter before smoothing."""
    frames = sequence.track.columns["frame"]
    measured, filtered = sequence.walk.measured, _memo.walk_filtered(sequence.walk)
    axes = figure.subplots(3, 2, sharex=True, sharey="row")
    names = (("x_m", "X, m"), ("z_m", "Y (height), m"), ("phase", "pose"))
    for column, ((left, right), (name, label)) in enumerate(zip(axes, names, strict=True)):
        left.plot(frames, measured[:, column], **MEASURED)
        value, sd = filtered[:, column].copy(), filtered[:, 3 + column]
        if name == "phase":
            value[1:][np.abs(np.diff(value)) > 0.5] = np.nan
        right.plot(frames, value, color=NEUTRAL, linewidth=1.3)
        right.fill_between(frames, value - sd, value + sd, color=NEUTRAL, alpha=0.25, linewidth=0)
        if sequence.truth is not None:
            true = sequence.true(name).copy()
            if name == "phase":
                true[1:][np.abs(np.diff(true)) > 0.5] = np.nan
            for ax in (left, right):
                ax.plot(frames, true, color=RIGHT, linestyle="--", linewidth=0.9)
        left.set(ylabel=label)
        for ax in (left, right):
            ax.spines[["top", "right"]].set_visible(False)
        if name == "z_m":  # the range of the search, so that its noise is shown in proportion
            middle = np.nanmedian(measured[:, column])
            left.set(ylim=(middle - 0.15, middle + 0.15))
        if name == "phase":
            left.set(ylim=(0, 1))
    axes[0, 0].set_title("measured", fontsize=10)
    axes[0, 1].set_title("Kalman filter, ± one sigma", fontsize=10)
    for ax in axes[-1]:
        ax.set(xlabel="image number")


def _models_size(sequence: Sequence) -> tuple[float, float]:
    """Two by two images fill it."""
    height, width = sequence.shown[0][1].shape
    return 9.0, 9.0 * height / width + 0.5


def _draw_models(figure: Figure, sequence: Sequence) -> None:
    axes = figure.subplots(2, 2)
    frames = sequence.track.columns["frame"]
    for ax, (row, luma) in zip(axes.flat, sequence.shown, strict=False):
        _grey(ax, luma)
        _lines(ax, sequence.track.contours(row), CONTOUR, 1.0)
        ax.set(xlim=(0, luma.shape[1]), ylim=(luma.shape[0], 0))
        ax.set_title(f"image {frames[row]}", fontsize=9, loc="left")


def _draw_angles(figure: Figure, sequence: Sequence, side: str) -> None:
    """Hip above, knee below: estimated (solid), the truth if known (dashed), the model at a steady pace."""
    columns = sequence.track.columns
    frames = columns["frame"]
    phase = np.unwrap(columns["phase"], period=1.0)
    steady = np.polynomial.Polynomial.fit(frames, phase, 1)(frames) + (0.5 if side == "left" else 0.0)
    model = _memo.gait_curves("dense", steady.tolist())
    axes = figure.subplots(2, 1, sharex=True)
    for column, (ax, joint) in enumerate(zip(axes, ("hip", "knee"), strict=True)):
        name = f"{side}_{joint}_deg"
        ax.plot(frames, columns[name], color=RIGHT if side == "right" else LEFT, linewidth=4, alpha=0.45,
                label="estimated")  # fmt: skip
        if sequence.truth is not None:
            ax.plot(frames, sequence.true(name), color="black", linestyle="--", linewidth=1, label="truth")
        ax.plot(
            frames,
            model[:, column],
            color=NEUTRAL,
            linestyle=":",
            linewidth=1.4,
            label="model at a steady pace",
        )
        ax.set(ylabel=f"{joint}, degrees")
        ax.spines[["top", "right"]].set_visible(False)
    axes[0].legend(
        frameon=False, fontsize=8, ncols=3, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0
    )
    axes[-1].set(xlabel="image number")
