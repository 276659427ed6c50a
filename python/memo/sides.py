"""Corrects right and left in keypoints: the pairs that change sides together, and a row for every change.

The core decides; this module passes it the pairs of legs and arms and reports the result.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import FLIP_COLUMNS
from memo.keypoints import Keypoints, KeypointsError, read_keypoints
from memo.notebook import Shown
from memo.table import data_frame
from memo.wording import counted

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["SideRepair", "unswap"]

#: Points that move with each joint: heel and toes with the ankle, fingers with the wrist.
_LEVELS = {
    "legs": {"hip": "hip", "knee": "knee", "ankle": "ankle heel big_toe small_toe"},
    "arms": {"shoulder": "shoulder", "elbow": "elbow", "wrist": "wrist pinky index thumb"},
}


@dataclass(frozen=True, repr=False, eq=False)
class SideRepair(Shown):
    """Keypoints with corrected right and left, and the changes."""

    keypoints: Keypoints
    """As read, with entries of right and left exchanged where they had been confused."""
    flips: list[dict[str, Any]]
    """Rows of `flips.csv`: for every frame in which levels of a group were exchanged, one of those that
    surely were (`flipped`) and one of the others (`guessed`); one for every run of frames in which the group
    is undecided. `probability` is that the labels were exchanged in the input, the least of the levels."""
    exchanged: dict[str, int]
    """Number of frames in which levels were exchanged with certainty, by group."""
    guessed: dict[str, int]
    """Number of frames in which levels were exchanged only by the best guess, by group."""
    undecided: dict[str, int]
    """Number of frames in which the labels are only the best guess, exchanged or not, by group. Frames in
    which no joint of the group is seen are not counted here or elsewhere."""
    p_global: dict[str, float]
    """Probability, by group, that the majority of the labels is right, from the majority alone."""

    def to_pandas(self) -> pandas.DataFrame:
        """The rows of `flips.csv` as a `pandas.DataFrame`."""
        return data_frame({name: [row[name] for row in self.flips] for name in FLIP_COLUMNS})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws, over time, where each group was exchanged and where it is undecided, into `ax`, or
        new Axes, and returns them. Needs matplotlib."""
        from memo.plot import new_axes, plot_exchanges

        return plot_exchanges(new_axes() if ax is None else ax, self)

    def __repr__(self) -> str:
        groups = ", ".join(
            f"{group}: {count} exchanged, {self.guessed[group]} guessed, {self.undecided[group]} undecided"
            for group, count in self.exchanged.items()
        )
        return f"SideRepair({groups}; of {counted(len(self.keypoints.frames), 'frame')})"


def unswap(
    keypoints: Keypoints | str | PathLike[str],
    groups: Sequence[str] = ("legs", "arms"),
    *,
    fps: float | None = None,
    layout: str | None = None,
    person: int | str | tuple[float, float, int] | None = None,
) -> SideRepair:
    """Exchanges right and left, separately in legs and arms, where the motion shows that they were confused.

    `keypoints`: the result of `read_keypoints`, or a file or folder for it, with `fps`, `layout`, `person`.
    It corrects only changes over time: the left leg is the one that most frames call left, so labels
    exchanged in all frames, or in most, cannot be detected. Nothing is moved, invented or removed.
    """
    unknown = [group for group in groups if group not in _LEVELS]
    if isinstance(groups, str) or unknown:
        raise ValueError(f"groups must be a list of {' and '.join(_LEVELS)}, got {groups!r}")
    if not isinstance(keypoints, Keypoints):
        keypoints = read_keypoints(keypoints, fps=fps, layout=layout, person=person)
    elif (fps, layout, person) != (None, None, None):
        raise ValueError("fps, layout and person apply to keypoints read from a file only")
    pairs = {group: levels for group in groups if (levels := _levels(keypoints.names, group))}
    if not pairs:
        raise KeypointsError(
            f"{keypoints.source.path}: no pair of right and left joints of {' or '.join(groups)}; "
            f"it has {', '.join(keypoints.names)}"
        )
    # Older AlphaPose scores go up to 6; the core takes weights from 0 to 1.
    weights = np.clip(keypoints.scores, 0, 1)
    found = _memo.unswap(keypoints.times_s, keypoints.points, weights, groups=pairs)
    points, scores = keypoints.points.copy(), keypoints.scores.copy()
    for group, levels in pairs.items():
        for level, at in enumerate(levels.values()):
            rows = np.flatnonzero(found[group].level_flipped[:, level])[:, None]
            for left, right in at:
                points[rows, [left, right]] = points[rows, [right, left]]
                scores[rows, [left, right]] = scores[rows, [right, left]]
    seen = {group: _seen(keypoints, levels) for group, levels in pairs.items()}
    exchanged = {group: found[group].level_flipped.any(axis=1) & seen[group] for group in pairs}
    surely = {group: _surely(found[group]).any(axis=1) & seen[group] for group in pairs}
    decided = {group: found[group].decided for group in pairs}
    flips = [row for group in pairs for row in _rows(keypoints, group, found[group], seen[group])]
    return SideRepair(
        keypoints=keypoints.replaced(points, scores),
        flips=sorted(flips, key=lambda row: (row["frame"], row["group"], row["verdict"])),
        exchanged={group: int(surely[group].sum()) for group in pairs},
        guessed={group: int((exchanged[group] & ~surely[group]).sum()) for group in pairs},
        undecided={group: int((~decided[group] & seen[group]).sum()) for group in pairs},
        p_global={group: found[group].p_global for group in pairs},
    )


def _levels(names: Sequence[str], group: str) -> dict[str, list[tuple[int, int]]]:
    """The (left, right) pairs of a group's levels that exist."""
    at = {part: (left, right) for own, part, right, left in _memo.side_pairs(names) if own == group}
    levels = {
        level: [at[part] for part in parts.split() if part in at] for level, parts in _LEVELS[group].items()
    }
    return {level: pairs for level, pairs in levels.items() if pairs}


def _surely(found: _memo.LimbSides) -> npt.NDArray[np.bool_]:
    """(T, L) whether each level was exchanged with certainty."""
    return found.level_flipped & found.level_decided


def _seen(keypoints: Keypoints, levels: dict[str, list[tuple[int, int]]]) -> npt.NDArray[np.bool_]:
    """(T,) whether any joint of a group is seen."""
    joints = [joint for pairs in levels.values() for pair in pairs for joint in pair]
    there = np.isfinite(keypoints.points[:, joints]).all(axis=2)
    return np.asarray(np.any(there, axis=1), np.bool_)


def _rows(
    keypoints: Keypoints, group: str, found: _memo.LimbSides, seen: npt.NDArray[np.bool_]
) -> Iterator[dict[str, Any]]:
    probability, reasons = found.level_p_flipped, found.reason
    surely = _surely(found)
    guessed = found.level_flipped & ~surely

    def row(first: int, last: int, told: int, levels: Any, verdict: str, p: float) -> dict[str, Any]:
        return {
            "frame": int(keypoints.frames[first]),
            "time_s": float(keypoints.times_s[first]),
            "last_frame": int(keypoints.frames[last]),
            "group": group,
            "levels": " ".join(levels),
            "verdict": verdict,
            "probability": p,
            "reason": reasons[told],
        }

    for verdict, flipped in {"flipped": surely, "guessed": guessed}.items():
        for t in np.flatnonzero(flipped.any(axis=1) & seen).tolist():
            levels = [name for name, own in zip(found.levels, flipped[t], strict=True) if own]
            yield row(t, t, t, levels, verdict, float(probability[t][flipped[t]].min()))
    doubt = np.flatnonzero(~found.decided & seen)
    for run in np.split(doubt, np.flatnonzero(np.diff(doubt) > 1) + 1):
        if len(run):
            least_sure = run[np.argmin(np.abs(found.p_flipped[run] - 0.5))]
            p = float(found.p_flipped[least_sure])
            yield row(run[0], run[-1], least_sure, found.levels, "undecided", p)
