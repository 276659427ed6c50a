"""Lee and Chen (1985): Tables 1 to 4, A.1 and A.2, the last stage, and the figures."""

from __future__ import annotations

from collections import Counter
from statistics import median
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memo import _memo
from memo.plot import LEFT, NEUTRAL, RIGHT
from memo.posture_plot import draw_figure
from memo.reproduce.result import (
    Drawing,
    Progress,
    Reproduction,
    Row,
    Table,
    cannot,
    compared,
    in_kind,
    unseen,
)

__all__ = ["lee_chen", "plot_posture", "plot_superposition"]

SEQUENCES = ("SEQ1", "SEQ2")
FRAMES = (1, 3, 5)

NOTE = """Lengths, head, cameras, frame interval and joint limits are the paper's. It prints neither the
joints of its sequences nor their gait phases and cadence, and the program that drew them (Cutting 1978) is
not public. So a new walker is made from average gait curves, with shoulders that turn by 4 and a pelvis
that turns by 6 degrees, at an ordinary cadence. The phase of frame 1 is the one of fifty that brings frame 1
of Tables 3 and 4 nearest, so agreement there shows that such a walker exists, not that it is the
paper's."""

WALKER = "on the new walker"

# Table 1: the name in memo, the joint, extension or adduction and flexion or abduction.
TABLE_1 = {
    "shoulder swing": ("shoulder, extension and flexion", "50 180"),
    "shoulder abduction": ("shoulder, adduction and abduction", "50 180"),
    "hip swing, straight knee": ("hip, extension and flexion", "40 90"),
    "hip swing": ("hip, the same if flexion at the knee is allowed", "40 120"),
    "hip abduction": ("hip, adduction and abduction", "30 45"),
    "elbow": ("elbow, extension and flexion", "0 160"),
    "knee": ("knee, extension and flexion", "0 130"),
    "pelvis flexion": ("pelvis, extension and flexion", "30 75"),
    "pelvis rotation": ("pelvis, rotation to either side", "30 30"),
    "pelvis bending": ("pelvis, bending to either side", "35 35"),
    "neck flexion": ("neck, extension and flexion", "55 45"),
    "neck rotation": ("neck, rotation to either side", "70 70"),
    "neck bending": ("neck, bending to either side", "40 40"),
}

# Table A.1, with the names of memo's segments, without their sides.
TABLE_A1 = {
    "neck to shoulder": ("20.5", "neck_to_{}_shoulder"),
    "neck to pelvis": ("46.3", "neck_to_pelvis"),
    "shoulder to pelvis": ("50.2", "{}_shoulder_to_pelvis"),
    "shoulder to elbow": ("30", "{0}_shoulder_to_{0}_elbow"),
    "elbow to wrist": ("26", "{0}_elbow_to_{0}_wrist"),
    "pelvis to hip": ("19", "pelvis_to_{}_hip"),
    "hip to knee": ("38", "{0}_hip_to_{0}_knee"),
    "knee to ankle": ("37", "{0}_knee_to_{0}_ankle"),
    "shoulder to shoulder": ("40.3", "right_shoulder_to_left_shoulder"),
    "hip to hip": ("32.2", "right_hip_to_left_hip"),
}

# Table A.2: points in the head's axes, centimetres, and their projections.
TABLE_A2 = {
    "neck": ("-34.168 52.103 0.000", "-0.00024 0.59320"),
    "nose": ("-29.168 61.603 0.000", "-0.00025 0.70944"),
    "right eye": ("-32.168 65.103 5.500", "-0.06329 0.74631"),
    "left eye": ("-31.168 65.103 -5.500", "0.06280 0.74631"),
    "right ear": ("-35.168 60.103 8.500", "-0.09680 0.68273"),
    "left ear": ("-35.168 60.103 -8.500", "0.09631 0.68273"),
}

Points = npt.NDArray[np.float64]


def lee_chen(progress: Progress = unseen) -> Reproduction:
    """Every table and figure of Lee and Chen (1985)."""
    progress("lee-chen: inputs and Table 2", 0, 3)
    inputs, head = _memo.lee_chen_inputs(), _memo.lee_chen_head()
    progress("lee-chen: Tables 3 and 4", 1, 3)
    counts = {
        sequence: [_memo.lee_chen_counts(sequence, merge_m) for merge_m in (0.04, 0.0)]
        for sequence in SEQUENCES
    }
    progress("lee-chen: rules 1 to 5 over ten phases", 2, 3)
    stages = _last_stages()
    left = {sequence: _memo.lee_chen_figures(sequence) for sequence in SEQUENCES}
    rows = [*_input_rows(inputs), *_head_rows(head)]
    for number, sequence in zip((3, 4), SEQUENCES, strict=True):
        rows += _count_rows(number, sequence, *counts[sequence])
    rows += [*_stage_rows(stages, left), *_cannot_rows()]
    tables = [_head_table(head), _stage_table(stages)]
    tables += [
        _count_table(number, *counts[sequence]) for number, sequence in zip((3, 4), SEQUENCES, strict=True)
    ]
    return Reproduction(
        "lee-chen",
        "Lee and Chen 1985, Determination of 3D Human Body Postures from a Single View",
        NOTE,
        rows,
        _figures(left),
        tables,
    )


# Input: section 2, Table 1, the appendix.


def _input_rows(inputs: _memo.TableInputs) -> list[Row]:
    joints, segments = _memo.joint_names(), _memo.segment_names()
    rows = [
        compared("section 1, Fig. 1", "joints of the stick figure", "14", len(joints)),
        compared("section 1, Fig. 1", "segments of the stick figure", "17", len(segments)),
        compared(
            *("section 3.1", "body configurations of the tree", "8196", 2 ** (len(joints) - 1)),
            "a misprint: 2^13 is 8192",
        ),
        compared("appendix", "seconds per frame", "0.2", inputs.frame_s),
    ]
    for sequence, printed, camera in zip(SEQUENCES, ("400 0 0", "300 0 300"), inputs.cameras_cm, strict=True):
        quantity = f"camera of {sequence}, centimetres"
        rows.append(
            compared("appendix", quantity, printed, np.round(camera, 9), "position of the image plane")
        )
    for name, (least, most) in inputs.angles:
        quantity, printed = TABLE_1[name]
        rows.append(compared("Table 1", f"{quantity}, degrees", printed, np.round([-least, most], 9) + 0.0))
    lengths = dict(inputs.lengths_cm)
    for name, (printed, pattern) in TABLE_A1.items():
        found = sorted({round(lengths[pattern.format(side)], 9) for side in ("right", "left")})
        rows.append(compared("Table A.1", f"{name}, centimetres", printed, found, "both sides"))
    for (name, (printed, _)), ours in zip(TABLE_A2.items(), inputs.head_cm, strict=True):
        why = (
            "a misprint: y' in A.2(b) and the depth in Table 2(d) both imply -31.168, as for the left eye"
            if name == "right eye"
            else ""
        )
        rows.append(compared("Table A.2 (a)", f"{name}, centimetres", printed, np.round(ours, 9), why))
    projections = inputs.projections_cm
    for axis, letter in enumerate("xy"):
        printed = " ".join(projection.split()[axis] for _, projection in TABLE_A2.values())
        why = "from A.2(a) seen from (400, 0, 0) with f = 5" + (
            "; all six are printed 0.00024 further left: the sequence's camera was 0.02 cm to the side, as"
            " t41 of Table 2 shows too"
            if letter == "x"
            else ""
        )
        quantity = f"{letter}' of the six points, centimetres"
        rows.append(compared("Table A.2 (b)", quantity, printed, projections[:, axis], why))
    return rows


# Table 2.


def _head_numbers(column: _memo.HeadColumn) -> dict[str, float]:
    """Every number of Table 2 by its name in the text, in the table's order."""
    numbers: dict[str, float] = {}
    for part, name, last, matrix in (("(a)", "T", 4, column.transform), ("(b)", "R", 3, column.rotation)):
        for (row, place), number in np.ndenumerate(matrix):
            numbers[f"{part} {name}{row + 1}{(1, 2, last)[place]}"] = float(number)
    for axis, value in zip("xyz", column.camera_position, strict=True):
        numbers[f"(c) {axis}0"] = value
    for point, position in column.points.items():
        for axis, value in zip("xyz", position, strict=True):
            numbers[f"(d) {point} {axis}"] = value
    numbers["f"] = column.focal
    return numbers


def _head_table(head: list[_memo.HeadColumn]) -> Table:
    columns = [_head_numbers(column) for column in head]
    rows = [[name, *(f"{column[name]:z.5f}" for column in columns)] for name in columns[0]]
    return Table("table2", ["quantity", *(column.method for column in head)], rows)


def _head_rows(head: list[_memo.HeadColumn]) -> list[Row]:
    """Table 2 compared with the linear solution from projections without rounding."""
    by_method = {column.method: column for column in head}
    printed, exact = head[0], by_method["linear, exact projections"]
    rounded, known = by_method["linear, A.2(b) as printed"], by_method["least squares, f = 5"]
    how = (
        "eqs. (1)-(5) from projections without rounding; the table differs from its own geometry by that much"
    )

    def row(quantity: str, name: str, *, within: float, place: Any = ...) -> Row:
        text = " ".join(f"{value:.5f}" for value in np.atleast_1d(np.asarray(getattr(printed, name))[place]))
        return compared(
            "Table 2", quantity, text, np.asarray(getattr(exact, name))[place], how, within=within
        )

    rows = [
        row(f"(a) [T], row {k + 1}", "transform", within=1e-4 if k < 3 else 0.03, place=k) for k in range(4)
    ]
    rows += [row(f"(b) [R], row {k + 1}", "rotation", within=1e-4, place=k) for k in range(3)]
    rows.append(row("(c) camera position, centimetres", "camera_position", within=0.03))
    for name, point in printed.points.items():
        text = " ".join(f"{value:.5f}" for value in point)
        quantity = f"(d) {name.replace('_', ' ')}, centimetres"
        rows.append(compared("Table 2", quantity, text, exact.points[name], how, within=0.03))
    place = " ".join(f"{value:.5f}" for value in printed.camera_position)
    sd = ", ".join(f"{value:.3f}" for value in known.camera_position_sd or [])
    rows += [
        compared(
            *("Table 2", "(c) by eq. (3) from A.2(b) as printed", place, rounded.camera_position),
            "the system is ill-conditioned and five digits are too few for it",
        ),
        compared(
            *("Table 2", "(c) by least squares from A.2(b), f known", place, known.camera_position),
            f"over true rotations; standard deviations ({sd}) from the rounding of A.2(b)",
            within=0.05,
        ),
    ]
    return rows


# Tables 3 and 4.

HALVES = ("physical", "rules_1_2")


def _count_rows(number: int, sequence: str, merged: _memo.CountTable, apart: _memo.CountTable) -> list[Row]:
    rows = []
    equal = 0
    for level, joint in enumerate(_memo.joint_names()):
        printed, ours = ([one[half][level] for half in HALVES] for one in (merged.printed, merged.counts))
        here = int(np.sum(np.asarray(printed) == np.asarray(ours)))
        equal += here
        texts = ["; ".join(" ".join(map(str, half)) for half in cells) for cells in (printed, ours)]
        roots = "; ".join(" ".join(map(str, apart.counts[half][level])) for half in HALVES)
        rows.append(
            in_kind(
                f"Table {number}",
                f"level {level}, {joint.replace('_', ' ')}: frames 1 3 5, then with rules 1 and 2",
                *(texts[0], texts[1]),
                f"{here} of 6 are equal, {WALKER}; roots nearer than 4 cm are one (where only equal ones:"
                f" {roots})",
            )
        )
    phases = ", ".join(f"{phase:.2f}" for phase in merged.phases)
    kept = " and ".join(f"{sum(map(all, table.truth_kept))} of 3" for table in (merged, apart))
    ratio = max(float(np.max(table[1:] / table[:-1])) for table in merged.counts.values())
    rows += [
        in_kind(
            *(f"Table {number}", f"numbers equal to the printed ones, {sequence}", "84", str(equal)),
            f"{WALKER}, frames 1, 3, 5 at gait phases {phases}",
        ),
        in_kind(
            *(f"Table {number}", "frames whose true posture is left", "3 of 3", kept),
            f"{WALKER}, with and without rules 1 and 2; roots merged and not",
        ),
        in_kind(
            *(f"Table {number}", "largest ratio of two levels", "2", f"{ratio:g}"),
            f"two candidates per joint, {WALKER}",
        ),
    ]
    return rows


def _count_table(number: int, merged: _memo.CountTable, apart: _memo.CountTable) -> Table:
    columns = {
        **merged.counts,
        **{f"printed_{half}": table for half, table in merged.printed.items()},
        **{f"unmerged_{half}": table for half, table in apart.counts.items()},
    }
    header = ["level", "joint", *(f"{name}_frame{frame}" for name in columns for frame in FRAMES)]
    rows = [
        [level, joint, *(int(n) for table in columns.values() for n in table[level])]
        for level, joint in enumerate(_memo.joint_names())
    ]
    return Table(f"table{number}", header, rows)


# The last stage: rules 1 to 5 and grouping.

Stages = dict[tuple[str, str], list[_memo.LastStage]]
READINGS = {
    "rigid_torso": "instead of rule 3 at the shoulder, the neck must be ahead of the line of the shoulders,"
    " as a rigid torso is not its mirror image; knees are flexed from 25 degrees",
    "as_printed": "rule 3 refuses arms that swing forward, since the lengths put both shoulders 3.7 cm behind"
    " the neck",
}


def _last_stages() -> Stages:
    return {
        (sequence, reading): _memo.lee_chen_last_stage(sequence, reading)
        for sequence in SEQUENCES
        for reading in READINGS
    }


def _stage_rows(stages: Stages, left: dict[str, _memo.FrameSurvivors]) -> list[Row]:
    rows = []
    for sequence, survivors, groups in (("SEQ1", "32", "16"), ("SEQ2", "6", "6")):
        found = left[sequence]
        rows += [
            in_kind(
                *("section 4.2", f"postures of frame 1 of {sequence} after rules 1 and 2", survivors),
                *(str(len(found.figures)), WALKER),
            ),
            in_kind(
                *("section 4.2", f"the same after grouping, {sequence}", groups, str(len(found.groups))),
                f"{WALKER}; within 5 cm, as the grouping distance is not printed",
            ),
        ]
    for (sequence, reading), frames in stages.items():
        final = {"SEQ1": "2", "SEQ2": "1"}[sequence]
        groups_left = [frame.groups for frame in frames]
        kept = sum(frame.truth_kept for frame in frames)
        name = reading.replace("_", " ")
        rows.append(
            in_kind(
                *(
                    "section 4.2",
                    f"postures that rules 1 to 5 and grouping leave of {sequence}, {name}",
                    final,
                ),
                f"median {median(groups_left):g}, {min(groups_left)} to {max(groups_left)}",
                f"printed for frame 1 only; {WALKER}, frames 1, 3, 5 for each of ten starting phases;"
                f" {READINGS[reading]}",
            )
        )
        broken = Counter(cause for frame in frames for cause in {_without_side(b) for b in frame.broken})
        causes = ", ".join(f"{cause} ({count})" for cause, count in sorted(broken.items()))
        rows.append(
            in_kind(
                *("section 4.2", f"frames of {sequence} whose true posture is left, {name}"),
                *("1 of 1", f"{kept} of {len(frames)}"),
                f"{WALKER}; it breaks, in frames: {causes}" if broken else f"{WALKER}; it breaks no rule",
            )
        )
    return rows


def _without_side(constraint: str) -> str:
    return constraint.removeprefix("left_").removeprefix("right_").replace("_", " ")


def _stage_table(stages: Stages) -> Table:
    header = ["sequence", "reading", "phase", "postures", "groups", "truth_kept", "truth_breaks"]
    rows = [
        [
            *(sequence, reading, f"{frame.phase:.3f}", frame.postures, frame.groups),
            *(int(frame.truth_kept), " ".join(frame.broken)),
        ]
        for (sequence, reading), frames in stages.items()
        for frame in frames
    ]
    return Table("last_stage", header, rows)


def _cannot_rows() -> list[Row]:
    unpublished = "the joints of the sequences are not printed, and the program that drew them is not public"
    return [
        cannot(
            "Tables 3 and 4", "the printed numbers on the paper's own sequences", "168 numbers", unpublished
        ),
        cannot("Figs. 6-8, A.1", "the printed figures line for line", "4 figures", unpublished),
        cannot(
            *("section 5", "a unique posture in every frame from a sequence", "no numbers"),
            "announced with a reference to a dissertation; `memo posture` links frames by its own method",
        ),
    ]


# The figures.


def plot_posture(ax: Axes, joints: Points, *, alpha: float = 1.0) -> Axes:
    """A posture (14, 3) in camera axes from the side: depth to the right, height upwards; right limbs solid,
    left limbs dashed."""
    draw_figure(ax, np.column_stack([joints[:, 2], -joints[:, 1]]), alpha=alpha)
    ax.set_aspect("equal")
    return ax


def plot_superposition(ax: Axes, figures: Points, truth: Points) -> Axes:
    """All postures (N, 14, 3) in one plot, with the joints of the true posture as dots (Fig. 7)."""
    for joints in figures:
        plot_posture(ax, joints, alpha=0.45)
    ax.plot(truth[:, 2], -truth[:, 1], linestyle="none", marker=".", color="black", label="true joints")
    for name, style, colour in (("right limbs", "-", RIGHT), ("left limbs", "--", LEFT)):
        ax.plot([], [], color=colour, linestyle=style, label=name)
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=3, fontsize=8, borderaxespad=0)
    ax.set(xlabel="distance from the camera, m", ylabel="height relative to the camera, m")
    return ax


def _figures(left: dict[str, _memo.FrameSurvivors]) -> list[Drawing]:
    first, second = (left[sequence] for sequence in SEQUENCES)
    return [*_figures_of_the_method(first, second), *_figures_of_what_is_left(first, second), _fig_a1()]


ON_WALKER = f"{WALKER[:1].upper()}{WALKER[1:]}"


def _figures_of_the_method(first: _memo.FrameSurvivors, second: _memo.FrameSurvivors) -> list[Drawing]:
    """Figs. 1 to 5."""
    return [
        Drawing(
            "fig1",
            "Fig. 1",
            "The stick figure of 14 joints and 17 segments",
            _draw_model,
            (5, 6.5),
            ON_WALKER,
        ),
        Drawing(
            *(
                "fig2",
                "Fig. 2",
                "The head's axes and the cameras of both sequences, from above and from the side",
            ),
            *(_draw_cameras, (6, 7), "Positions as printed in the appendix; the new walker"),
        ),
        Drawing(
            *(
                "fig3",
                "Fig. 3",
                "The two positions at which a segment of known length can end on its line of sight",
            ),
            *(lambda figure: _draw_two_ends(figure, first), (6, 4.2)),
            f"{ON_WALKER}, frame 1 of SEQ1",
        ),
        Drawing(
            *(
                "fig4",
                "Fig. 4",
                "The pruned interpretation tree: every path down is one of the postures left",
            ),
            *(lambda figure: _draw_tree(figure, first), (10, 6)),
            f"{ON_WALKER}, frame 1 of SEQ1 after rules 1 and 2",
        ),
        Drawing(
            *(
                "fig5",
                "Fig. 5",
                "Each shoulder can be at two positions; their distance decides which belong together",
            ),
            *(lambda figure: _draw_rigid(figure, second), (8, 5)),
            f"{ON_WALKER}, frame 1 of SEQ2, from above",
        ),
    ]


def _figures_of_what_is_left(first: _memo.FrameSurvivors, second: _memo.FrameSurvivors) -> list[Drawing]:
    """Figs. 6 to 8."""
    from_side = f"{ON_WALKER}; depth and height without perspective"
    return [
        Drawing(
            *("fig6", "Fig. 6", "Postures left of frame 1 of SEQ1, grouped"),
            *(lambda figure: _draw_panels(figure, first), _panel_size(first), from_side),
        ),
        Drawing(
            *("fig7", "Fig. 7", "The same postures in one picture"),
            *(lambda figure: plot_superposition(_plain(figure), first.figures, first.truth), (5, 7)),
            from_side,
        ),
        Drawing(
            *("fig8", "Fig. 8", "Postures left of frame 1 of SEQ2"),
            *(lambda figure: _draw_panels(figure, second), _panel_size(second), from_side),
        ),
    ]


def _fig_a1() -> Drawing:
    return Drawing(
        *(
            "figA1",
            "Fig. A.1",
            "The image sequences: SEQ1 above, SEQ2 (in a dissertation, not in the paper) below",
        ),
        *(_draw_sequences, (10, 6), f"{ON_WALKER}; central projection"),
    )


def _plain(figure: Figure) -> Axes:
    ax = figure.subplots()
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def _draw_model(figure: Figure) -> None:
    figures, _ = _memo.lee_chen_walker("SEQ2", 1)
    ax = figure.subplots()
    seen = figures[0, :, :2] / figures[0, :, 2:] * [1, -1]
    draw_figure(ax, seen)
    for name, place in zip(_memo.joint_names(), seen, strict=True):
        side = -1 if name.startswith("right") else 1
        ax.annotate(
            name.replace("_", " "), place, xytext=(6 * side, 0), textcoords="offset points", fontsize=8,
            ha="right" if side < 0 else "left", va="center",
        )  # fmt: skip
    ax.set_aspect("equal")
    ax.margins(x=0.6)
    ax.set_axis_off()


def _draw_cameras(figure: Figure) -> None:
    inputs = _memo.lee_chen_inputs()
    figures, _ = _memo.lee_chen_walker("SEQ1", 1)
    # Camera axes of SEQ1 in the head's: x to the walker's right hand is its left in the image.
    lens = inputs.cameras_cm[0][0] / 100 + 0.05
    forward, up, right = lens - figures[0, :, 2], -figures[0, :, 1], -figures[0, :, 0]
    above, aside = figure.subplots(2, 1, sharex=True, height_ratios=(3.5, 1.7))
    for ax, across, label in ((above, right, "z, to the walker's right, m"), (aside, up, "y, up, m")):
        draw_figure(ax, np.column_stack([forward, across]))
        ax.plot(0, 0, marker="+", color="black", markersize=10)
        for axis in ((0.5, 0), (0, 0.5)):
            ax.annotate("", axis, (0, 0), arrowprops={"arrowstyle": "->", "color": "black"})
        ax.set(xlabel="x, moving direction, m", ylabel=label, aspect="equal")
        ax.spines[["top", "right"]].set_visible(False)
    for sequence, (x, y, z) in zip(SEQUENCES, np.asarray(inputs.cameras_cm) / 100, strict=True):
        for ax, across in ((above, z), (aside, y)):
            ax.plot([x, 0], [across, 0], color=NEUTRAL, linewidth=0.8, linestyle=":")
            ax.plot(x, across, marker="s", color=RIGHT)
            ax.annotate(sequence, (x, across), xytext=(0, 7), textcoords="offset points", ha="center")
    above.set_title("from above", loc="left", fontsize=9)
    aside.set_title("from the side", loc="left", fontsize=9)


def _distinct(points: Points) -> Points:
    """Rows that differ by more than a millimetre, in their order."""
    kept: list[Points] = []
    for point in points:
        if all(np.linalg.norm(point - other) > 1e-3 for other in kept):
            kept.append(point)
    return np.array(kept)


def _two_ends(left: _memo.FrameSurvivors) -> tuple[str, Points, Points]:
    """Among joints that the postures put at two positions behind the same joint, the pair farthest apart:
    name of the segment, its start (3,) and both ends (2, 3)."""
    names = _memo.joint_names()
    found = []
    for side in ("right", "left"):
        for start, end in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle")):
            starts, ends = (left.figures[:, names.index(f"{side}_{joint}")] for joint in (start, end))
            for place in _distinct(starts):
                both = _distinct(ends[np.linalg.norm(starts - place, axis=1) < 1e-3])
                if len(both) == 2:
                    found.append(
                        (float(np.linalg.norm(both[1] - both[0])), f"{side} {start} to {end}", place, both)
                    )
    _, name, place, both = max(found, key=lambda pair: pair[0])
    return name, place, both


def _draw_two_ends(figure: Figure, left: _memo.FrameSurvivors) -> None:
    """In the plane of the line of sight and the known joint: the segment's circle cuts the line twice."""
    name, start, ends = _two_ends(left)
    ray = ends[0] / np.linalg.norm(ends[0])
    along = float(start @ ray)
    off = float(np.linalg.norm(start - along * ray))
    length = float(np.linalg.norm(ends[0] - start))
    ax = _plain(figure)
    turn = np.linspace(0, 2 * np.pi, 200)
    ax.plot(along + length * np.cos(turn), off + length * np.sin(turn), color=NEUTRAL, linewidth=0.8)
    places = ends @ ray
    ends_at = (along - 1.25 * length, along + 1.25 * length)
    ax.plot(ends_at, [0, 0], color="black", linewidth=1)
    ax.annotate("line of sight; camera to the left", (ends_at[0], 0), xytext=(0, -12),
                textcoords="offset points", fontsize=8)  # fmt: skip
    known, sought = name.split(" ", 1)[1].split(" to ")
    for place, label, colour in zip(sorted(places), ("nearer", "farther"), (RIGHT, LEFT), strict=True):
        ax.plot([along, place], [off, 0], color=colour, linewidth=2, marker="o", label=f"{sought}, {label}")
    ax.plot(along, off, marker="o", color="black", linestyle="none", label=f"{known}, known")
    ax.set(aspect="equal", xlabel="along the line of sight, m", ylabel="distance from it, m")
    ax.legend(frameon=False, loc="center left", bbox_to_anchor=(1, 0.5))
    ax.set_title(f"{name}, {100 * length:.0f} cm", loc="left", fontsize=9)


def _draw_tree(figure: Figure, left: _memo.FrameSurvivors) -> None:
    """The postures as paths through the tree, side by side in the order of the tree."""
    keys = np.round(left.figures, 3)
    order = sorted(range(len(keys)), key=lambda leaf: keys[leaf].ravel().tolist())
    ax = figure.subplots()
    names = _memo.joint_names()
    places: list[dict[bytes, float]] = []
    for level in range(len(names)):
        at: dict[bytes, list[int]] = {}
        for x, leaf in enumerate(order):
            at.setdefault(keys[leaf, : level + 1].tobytes(), []).append(x)
        places.append({key: float(np.mean(leaves)) for key, leaves in at.items()})
    true_one = left.true_one
    for leaf in range(len(keys)):
        path = [places[level][keys[leaf, : level + 1].tobytes()] for level in range(len(names))]
        ax.plot(path, range(len(names)), color=NEUTRAL, linewidth=0.7, marker=".", markersize=4, zorder=1)
        if leaf == true_one:
            ax.plot(path, range(len(names)), color=RIGHT, linewidth=1.8, zorder=2, label="the true posture")
    for level, nodes in enumerate(places):
        ax.annotate(f"{len(nodes)}", (len(order) + 0.5, level), va="center", fontsize=8)
    ax.annotate("nodes", (len(order) + 0.5, -0.8), va="center", fontsize=8)
    ax.set_yticks(
        range(len(names)), [f"{k} {name.replace('_', ' ')}" for k, name in enumerate(names)], fontsize=8
    )
    ax.invert_yaxis()
    ax.set_xticks([])
    ax.spines[["top", "right", "bottom", "left"]].set_visible(False)
    ax.tick_params(length=0)
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), borderaxespad=0)


def _draw_rigid(figure: Figure, left: _memo.FrameSurvivors) -> None:
    """From above: lines of sight, the two positions of each shoulder, and the distance of each pair."""
    names = _memo.joint_names()
    neck = left.truth[0]

    def roots(joint: str) -> Points:
        """Both positions on the line of sight: they are symmetric about its point nearest to the neck."""
        true = left.truth[names.index(joint)]
        ray = true / np.linalg.norm(true)
        both = np.array([true, 2 * (neck @ ray) * ray - true])
        return both[np.argsort(both[:, 2])]

    right, other = roots("right_shoulder"), roots("left_shoulder")
    wanted = dict(_memo.lee_chen_inputs().lengths_cm)["right_shoulder_to_left_shoulder"]
    ax = _plain(figure)
    for letter, places, colour in (("A", right, RIGHT), ("B", other, LEFT)):
        near, far = min(places[:, 2]) - 0.25, max(places[:, 2]) + 0.25
        ray = places[0] / places[0, 2]
        ax.plot([near, far], [ray[0] * near, ray[0] * far], color=colour, linewidth=0.8, linestyle=":")
        for number, place in enumerate(places, 1):
            ax.plot(place[2], place[0], marker="o", color=colour)
            up = 1 if letter == "B" else -1
            above: dict[str, Any] = {
                "xytext": (0, 9 * up),
                "textcoords": "offset points",
                "ha": "center",
                "va": "center",
            }
            ax.annotate(f"{letter}{number}", (place[2], place[0]), color=colour, **above)
    ax.plot(neck[2], neck[0], marker="o", color=NEUTRAL)
    ax.annotate("neck", (neck[2], neck[0]), xytext=(8, 0), textcoords="offset points", va="center")
    for a, first in enumerate(right, 1):
        for b, second in enumerate(other, 1):
            apart = 100 * float(np.linalg.norm(first - second))
            fits = abs(apart - wanted) < 2
            ax.plot([first[2], second[2]], [first[0], second[0]], color=NEUTRAL, zorder=0,
                    linewidth=1.8 if fits else 0.6, linestyle="-" if fits else "--",
                    label=f"A{a} B{b}: {apart:.1f} cm" + (", kept" if fits else ", cut"))  # fmt: skip
    ax.set(aspect="equal", xlabel="distance from the camera, m", ylabel="to the right, m")
    figure.legend(
        frameon=False,
        fontsize=8,
        title=f"shoulder to shoulder {wanted:g} cm",
        loc="outside lower center",
        ncols=2,
    )


def _draw_sequences(figure: Figure) -> None:
    grid = figure.subplots(2, 5, sharex="row", sharey="row")
    for sequence, axes in zip(SEQUENCES, grid, strict=True):
        figures, phases = _memo.lee_chen_walker(sequence, 5)
        for number, (ax, joints, phase) in enumerate(zip(axes, figures, phases, strict=True), 1):
            draw_figure(ax, joints[:, :2] / joints[:, 2:] * [1, -1])
            ax.set_aspect("equal")
            ax.set_axis_off()
            ax.set_title(f"{sequence}, frame {number}, phase {phase % 1:.2f}", fontsize=8)


def _panel_grid(left: _memo.FrameSurvivors) -> tuple[int, int]:
    count = len(left.groups)
    columns = min(8, count)
    return -(-count // columns), columns


def _panel_size(left: _memo.FrameSurvivors) -> tuple[float, float]:
    rows, columns = _panel_grid(left)
    return max(1.4 * columns, 4.8), 2.9 * rows + 0.5


def _draw_panels(figure: Figure, left: _memo.FrameSurvivors) -> None:
    """One panel per group of postures (Figs. 6 and 8); if a group holds the true posture, it is drawn."""
    rows, columns = _panel_grid(left)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for ax in axes.flat:
        ax.set_axis_off()
    for number, (ax, (representative, members)) in enumerate(zip(axes.flat, left.groups, strict=False)):
        is_true = left.true_one in members
        plot_posture(ax, left.figures[left.true_one if is_true else representative])
        marks = ["rules 3-5"] * any(left.passes[i] for i in members) + ["true"] * is_true
        ax.set_title(f"({chr(ord('a') + number)}) {', '.join(marks)}", fontsize=8)
    figure.suptitle(
        "camera to the left; right limbs solid, left dashed; marked: left by rules 3-5", fontsize=8
    )
