"""The papers' experiments again, beside the numbers printed there.

`lee_chen(out)` computes, writes and returns what there is to say of Lee and Chen (1985). Every function whose
name starts with `plot_` draws into the Axes it is given and returns them; nothing is shown.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from memo import _memo
from memo.files import complete_file
from memo.plot import LEFT, RIGHT
from memo.posture_plot import draw_figure

__all__ = ["EXPERIMENTS", "Reproduction", "lee_chen", "plot_posture", "plot_superposition"]

SEQUENCES = ("SEQ1", "SEQ2")
FRAMES = (1, 3, 5)

NOT_REPRODUCED = """What cannot be reproduced
  Tables 3 and 4, number for number: the paper prints neither the joints of its sequences nor their gait
  phases and cadence, and the program that drew them (Cutting 1978) is not public. Lengths, head, cameras
  and frame interval are the paper's; joint angles are average gait curves; shoulders turn by 4 and pelvis
  by 6 degrees; the cadence is an ordinary one. The phase of frame 1 is that of fifty which brings frame 1
  of both tables nearest, so that agreement there says that such a walker exists, not that it is the paper's.
  Table 2, to its digits: Table A.2 (b) is printed with five digits, which is too few for the linear solution.
  From the projections before rounding it is met to the 0.03 cm by which it differs from its own geometry.
  Figs. 6-8, line for line, for the same reasons; they are drawn in depth and height without perspective."""

Points = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Reproduction:
    """What an experiment gave: lines to be read and files written."""

    lines: list[str]
    written: list[Path]


def lee_chen(out: str | PathLike[str]) -> Reproduction:
    """Tables 2, 3 and 4, the last stage and Figs. 6-8 of Lee and Chen (1985), into the folder `out`."""
    out = Path(out)
    head = _memo.lee_chen_head()
    lines = [*_head_lines(head), ""]
    written = [_write_csv(out / "table2.csv", *_head_rows(head))]
    for number, sequence in zip((3, 4), SEQUENCES, strict=True):
        merged, apart = (_memo.lee_chen_counts(sequence, merge_m) for merge_m in (0.04, 0.0))
        lines += [*_count_lines(number, sequence, merged, apart), ""]
        written.append(_write_csv(out / f"table{number}.csv", *_count_rows(merged, apart)))
    stages = _last_stages()
    lines += [*_stage_lines(stages), "", *NOT_REPRODUCED.splitlines()]
    written.append(_write_csv(out / "last_stage.csv", *_stage_rows(stages)))
    return Reproduction(lines, written + _write_figures(out))


EXPERIMENTS: dict[str, Callable[[str | PathLike[str]], Reproduction]] = {"lee-chen": lee_chen}
"""What can be reproduced, by the name it has on the command line."""


# Table 2.


def _head_numbers(column: dict[str, Any]) -> dict[str, float]:
    """Every number of Table 2 by the name it has in the text, in the table's order."""
    numbers: dict[str, float] = {}
    for part, name in (("(a)", "transform"), ("(b)", "rotation")):
        for (row, place), value in np.ndenumerate(column[name]):
            numbers[f"{part} {name[0].upper()}{row + 1}{(1, 2, 4 if name[0] == 't' else 3)[place]}"] = value
    for axis, value in zip("xyz", column["camera_position"], strict=True):
        numbers[f"(c) {axis}0"] = value
    for point, position in column["points"].items():
        for axis, value in zip("xyz", position, strict=True):
            numbers[f"(d) {point} {axis}"] = value
    numbers["f"] = column["focal"]
    return numbers


def _head_rows(head: Sequence[dict[str, Any]]) -> tuple[list[str], list[list[Any]]]:
    columns = [_head_numbers(column) for column in head]
    header = ["quantity", *(column["method"] for column in head)]
    rows = [[name, *(f"{column[name]:z.5f}" for column in columns)] for name in columns[0]]
    return header, rows


def _head_lines(head: Sequence[dict[str, Any]]) -> list[str]:
    header, rows = _head_rows(head)
    lines = ["Table 2. The head in frame 1 of SEQ1; centimetres, the paper's axes"]
    for number, method in enumerate(header[1:]):
        lines.append(f"  [{number}] {method}")
    lines.append(" " * 18 + "".join(f"{f'[{number}]':>12}" for number in range(len(head))))
    lines += [f"  {name:<16}" + "".join(f"{value:>12}" for value in values) for name, *values in rows]
    for number, column in enumerate(head):
        sd = column["camera_position_sd"]
        if sd is not None:
            lines.append(f"  [{number}] camera position known to ±({sd[0]:.3f}, {sd[1]:.3f}, {sd[2]:.3f}) cm")
    return lines


# Tables 3 and 4.


def _count_lines(number: int, sequence: str, merged: dict[str, Any], apart: dict[str, Any]) -> list[str]:
    phases = ", ".join(f"{phase:.2f}" for phase in merged["phases"])
    lines = [
        f"Table {number}. Nodes of each level that lead to a posture, {sequence}, frames 1, 3, 5"
        f" at gait phases {phases}",
        "  printed number in brackets; roots nearer than 4 cm are one, on the right only equal ones",
        " " * 19 + f"{'physical constraints':<30}{'and rules 1 and 2':<30}{'physical':<18}rules 1, 2",
    ]
    for level, joint in enumerate(_memo.joint_names()):
        cells = [
            "".join(f"{ours:>4} {f'({theirs})':<5}" for ours, theirs in zip(*pair, strict=True))
            for pair in (
                (merged[half][level], merged[f"printed_{half}"][level]) for half in ("physical", "rules_1_2")
            )
        ]
        apart_cells = ["".join(f"{n:>5}" for n in apart[half][level]) for half in ("physical", "rules_1_2")]
        lines.append(
            f"  {level:>2} {joint.replace('_', ' '):<14}"
            + "".join(f"{c:<30}" for c in cells)
            + "".join(f"{c:<18}" for c in apart_cells).rstrip()
        )
    kept = all(all(frame) for table in (merged, apart) for frame in table["truth_kept"])
    lines.append(f"  The true posture is {'always' if kept else 'NOT always'} among those left.")
    return lines


def _count_rows(merged: dict[str, Any], apart: dict[str, Any]) -> tuple[list[str], list[list[Any]]]:
    tables = {
        "physical": merged["physical"],
        "rules_1_2": merged["rules_1_2"],
        "printed_physical": merged["printed_physical"],
        "printed_rules_1_2": merged["printed_rules_1_2"],
        "unmerged_physical": apart["physical"],
        "unmerged_rules_1_2": apart["rules_1_2"],
    }
    header = ["level", "joint", *(f"{name}_frame{frame}" for name in tables for frame in FRAMES)]
    rows = [
        [level, joint, *(int(n) for table in tables.values() for n in table[level])]
        for level, joint in enumerate(_memo.joint_names())
    ]
    return header, rows


# The last stage: rules 1 to 5 and grouping.

Stages = dict[tuple[str, str], list[dict[str, Any]]]


def _last_stages() -> Stages:
    return {
        (sequence, reading): _memo.lee_chen_last_stage(sequence, reading)
        for sequence in SEQUENCES
        for reading in ("as_printed", "rigid_torso")
    }


def _stage_lines(stages: Stages) -> list[str]:
    lines = [
        "Rules 1 to 5 and grouping within 10 cm; frames 1, 3, 5 from each of ten phases on",
        "  printed, of frame 1 alone: two postures from SEQ1, one from SEQ2",
    ]
    for (sequence, reading), frames in stages.items():
        groups = [frame["groups"] for frame in frames]
        kept = sum(frame["truth_kept"] for frame in frames)
        lines.append(
            f"  {sequence} {reading.replace('_', ' '):<12} groups: median {median(groups):g},"
            f" {min(groups)} to {max(groups)}; true posture kept in {kept} of {len(frames)} frames"
        )
        broken = Counter(cause for frame in frames for cause in {_without_side(b) for b in frame["broken"]})
        if broken:
            causes = ", ".join(f"{cause} ({count})" for cause, count in sorted(broken.items()))
            lines.append(f"    it breaks (in frames): {causes}")
    lines += [
        "  As printed, rule 3 refuses arms that swing forward, since the lengths put both shoulders 3.7 cm",
        "  behind the neck. Rigid torso: instead of rule 3 at the shoulder, the neck must lie ahead of the",
        "  line of the shoulders (a rigid torso is not its mirror image); knees are flexed from 25 degrees.",
    ]
    return lines


def _without_side(constraint: str) -> str:
    return constraint.removeprefix("left_").removeprefix("right_").replace("_", " ")


def _stage_rows(stages: Stages) -> tuple[list[str], list[list[Any]]]:
    header = ["sequence", "reading", "phase", "postures", "groups", "truth_kept", "truth_breaks"]
    rows = [
        [
            *(sequence, reading, f"{frame['phase']:.3f}", frame["postures"], frame["groups"]),
            *(int(frame["truth_kept"]), " ".join(frame["broken"])),
        ]
        for (sequence, reading), frames in stages.items()
        for frame in frames
    ]
    return header, rows


def _write_csv(path: Path, header: Iterable[Any], rows: Iterable[Iterable[Any]]) -> Path:
    with complete_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)
    return path


# Figs. 6, 7 and 8.


def plot_posture(ax: Axes, joints: Points, *, alpha: float = 1.0) -> Axes:
    """A posture (14, 3) in camera axes from the side: depth to the right, height upwards; right limbs solid,
    left dashed."""
    draw_figure(ax, np.column_stack([joints[:, 2], -joints[:, 1]]), alpha=alpha)
    ax.set_aspect("equal")
    return ax


def plot_superposition(ax: Axes, figures: Points, truth: Points) -> Axes:
    """All postures (N, 14, 3) in one, with the true one's joints as dots (Fig. 7)."""
    for joints in figures:
        plot_posture(ax, joints, alpha=0.45)
    ax.plot(truth[:, 2], -truth[:, 1], linestyle="none", marker=".", color="black", label="true joints")
    for name, style, colour in (("right limbs", "-", RIGHT), ("left limbs", "--", LEFT)):
        ax.plot([], [], color=colour, linestyle=style, label=name)
    ax.legend(frameon=False, loc="lower left", bbox_to_anchor=(0, 1), ncols=3, fontsize=8, borderaxespad=0)
    ax.set(xlabel="distance from the camera, m", ylabel="height against the camera, m")
    return ax


def _write_figures(out: Path) -> list[Path]:
    first, second = (_memo.lee_chen_figures(sequence) for sequence in SEQUENCES)

    def superposed(figure: Figure) -> None:
        ax = figure.subplots()
        ax.spines[["top", "right"]].set_visible(False)
        plot_superposition(ax, first["figures"], first["truth"])

    return [
        _save(out / "fig6.png", _panel_size(first), lambda figure: _draw_panels(figure, first)),
        _save(out / "fig7.png", (5, 7), superposed),
        _save(out / "fig8.png", _panel_size(second), lambda figure: _draw_panels(figure, second)),
    ]


def _panel_grid(left: dict[str, Any]) -> tuple[int, int]:
    count = len(left["groups"])
    columns = min(8, count)
    return -(-count // columns), columns


def _panel_size(left: dict[str, Any]) -> tuple[float, float]:
    rows, columns = _panel_grid(left)
    return max(1.4 * columns, 4.8), 2.9 * rows + 0.5


def _draw_panels(figure: Figure, left: dict[str, Any]) -> None:
    """A panel for each group of postures (Figs. 6 and 8); of a group that holds it the true one is drawn."""
    rows, columns = _panel_grid(left)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    for ax in axes.flat:
        ax.set_axis_off()
    for number, (ax, (representative, members)) in enumerate(zip(axes.flat, left["groups"], strict=False)):
        is_true = left["true_one"] in members
        plot_posture(ax, left["figures"][left["true_one"] if is_true else representative])
        marks = ["rules 3-5"] * any(left["passes"][i] for i in members) + ["true"] * is_true
        ax.set_title(f"({chr(ord('a') + number)}) {', '.join(marks)}", fontsize=8)
    figure.suptitle(
        "camera to the left; right limbs solid, left dashed; marked: what rules 3-5 leave", fontsize=8
    )


def _save(path: Path, size_in: tuple[float, float], draw: Callable[[Figure], None]) -> Path:
    figure = Figure(figsize=size_in, dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure)
    with complete_file(path) as temporary:
        figure.savefig(temporary, format="png")
    return path
