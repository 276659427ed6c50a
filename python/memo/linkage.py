"""Point-light displays, and the linkage found in unnamed tracks (Hoffman and Flinchbaugh 1982).

Input and output are arrays; the core computes them. Tracks are (T, K, 2) pixels with NaN for unseen points.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import JOINTS, read_text, write_table
from memo.given import nothing_at
from memo.keypoints import Keypoints, read_keypoints
from memo.keypoints.recognising import is_no_table
from memo.keypoints.table import PERSON_COLUMNS
from memo.missing import real_numbers
from memo.notebook import Shown
from memo.pixels import of_video, shrink_of_table
from memo.table import data_frame, read_number_table
from memo.wording import counted

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = [
    "WRITTEN",
    "FigureLink",
    "PlanarFigure",
    "Points",
    "holds_keypoints",
    "limb_points",
    "planar",
    "read_points_csv",
    "read_tracks",
    "write_figure_csv",
    "write_points_csv",
]

_log = logging.getLogger(__name__)

Array = npt.NDArray[np.float64]

_SHORT = {
    joint: joint[0].upper() + short
    for joint in JOINTS
    for long, short in (
        ("shoulder", "SH"),
        ("elbow", "EL"),
        ("wrist", "WR"),
        ("hip", "HP"),
        ("knee", "KN"),
        ("ankle", "AN"),
    )
    if joint.endswith(long)
}


# As `min_weight` of `memo.posture`.
_LEAST_SCORE = 0.2

JOINT_NAMES = frozenset(_SHORT.values())
"""Names of joints that `read_points_csv` gives to points."""


@dataclass(frozen=True, repr=False, eq=False)
class Points:
    """Points over time: `positions` (T, K, 2) pixels or (T, K, 3) metres, NaN or masked for unseen points.

    `scales` (T,): scale of each frame, if a person approaches or recedes. `frames` (T,): their numbers in the
    source, if they do not count from 0.
    """

    names: list[str]
    times_s: Array
    positions: Array
    scales: Array | None = None
    frames: npt.NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "positions", real_numbers(self.positions))
        object.__setattr__(self, "times_s", real_numbers(self.times_s))
        times, shape, count = self.times_s.shape, self.positions.shape, len(self.names)
        if len(times) != 1 or shape not in ((*times, count, 2), (*times, count, 3)):
            raise ValueError(
                f"wanted times_s (T,) and positions (T, {count}, 2 or 3) of {counted(count, 'name')}, "
                f"got {times} and {shape}"
            )

    @property
    def numbers(self) -> list[int]:
        """The numbers of the frames."""
        return list(range(len(self.times_s))) if self.frames is None else self.frames.tolist()

    def __repr__(self) -> str:
        frames, count, dimensions = self.positions.shape
        return f"Points({counted(count, 'point')} in {dimensions}D, {counted(frames, 'frame')})"

    def at_one_scale(self) -> Points:
        """The same points divided by the scales, like depths."""
        if self.scales is None:
            return self
        bad = np.flatnonzero(~((self.scales > 0) & np.isfinite(self.scales)))
        if len(bad):
            raise ValueError(f"frame {bad[0]}: scale {self.scales[bad[0]]:g} must be positive and finite")
        return replace(self, positions=self.positions / self.scales[:, None, None], scales=None)


class FigureLink(NamedTuple):
    """Two points at a constant distance in space, over the windows in which they are linked."""

    a: int
    """The first point."""
    b: int
    """The second point; its number is larger."""
    length_px: float
    """Mean length."""
    confidence: float
    """Mean share of the weight of all figures that contain the link, 0 to 1; NaN for a spanning tree."""
    windows: int
    """Number of windows."""
    verdict: str
    """The most frequent verdict on the motion of its chain: "planar", "not planar", "little motion",
    "edge-on", "few views" or "unfalsifiable"."""


@dataclass(frozen=True, repr=False, eq=False)
class PlanarFigure(Shown):
    """The linkage found in tracks, window by window.

    `depth` (T, K) is each point's depth relative to the first point of its chain
    in pixels, NaN if unknown, up to a reflection of each undecided chain; `sources` gives its source per
    frame. `perspective_px`: the largest displacement of a point by perspective, if a focal length was given.
    `points`: the tracks as given, with the names of the points or their numbers.
    """

    windows: list[_memo.PlanarWindow]
    depth: Array
    sources: list[str]
    perspective_px: float | None = None
    points: Points | None = None

    @property
    def interpreted(self) -> list[_memo.PlanarWindow]:
        """The windows that could be interpreted."""
        return [window for window in self.windows if window.status == "interpreted"]

    @property
    def is_body(self) -> bool:
        """Whether any window is interpreted: whether there is evidence that the points belong to a body."""
        return bool(self.interpreted)

    def links(self) -> list[FigureLink]:
        """The linkage: the links of the interpreted windows. Without one, those of all windows: then they are
        the best guess for points that need not belong together (`is_body`)."""
        found: dict[tuple[int, int], list[tuple[float, float, str]]] = {}
        for link, verdict in self._judged():
            found.setdefault(link.points, []).append((link.length, link.confidence, verdict))

        def pooled(a: int, b: int) -> FigureLink:
            lengths, sure, verdicts = zip(*found[a, b], strict=True)
            usual = Counter(verdicts).most_common(1)[0][0]
            return FigureLink(a, b, float(np.mean(lengths)), float(np.mean(sure)), len(lengths), usual)

        return [pooled(*points) for points in sorted(found)]

    def verdicts(self) -> dict[tuple[int, int], dict[str, int]]:
        """For each of the `links`, the number of windows with each verdict on its chain."""
        counts: dict[tuple[int, int], Counter[str]] = {}
        for link, verdict in self._judged():
            counts.setdefault(link.points, Counter())[verdict] += 1
        return {points: dict(counts[points].most_common()) for points in sorted(counts)}

    def to_pandas(self) -> pandas.DataFrame:
        """The links as a `pandas.DataFrame`: names of the points `a` and `b`, `length_px`, `confidence`,
        `windows` and `verdict`."""
        links = self.links()
        names = [str(number) for number in range(self.depth.shape[1])]
        if self.points is not None:
            names = self.points.names
        columns = {name: [getattr(link, name) for link in links] for name in FigureLink._fields}
        return data_frame(columns | {end: [names[point] for point in columns[end]] for end in ("a", "b")})

    def plot(self, window: int | None = None, ax: Axes | None = None) -> Axes:
        """Draws the linkage of a window, by default the first interpreted one, into `ax`, or new Axes,
        and returns them. Needs matplotlib."""
        from memo.linkage_plot import plot_linkage, telling_window
        from memo.plot import new_axes

        if self.points is None or not self.windows:
            raise ValueError("there is nothing to plot: no window")
        if window is None:
            window = telling_window(self)
        if not 0 <= window < len(self.windows):
            raise IndexError(f"no window {window}: there are {counted(len(self.windows), 'window')}")
        return plot_linkage(new_axes() if ax is None else ax, self.points, self, window)

    def __repr__(self) -> str:
        guess = "" if self.is_body else "no body; best guess: "
        return (
            f"PlanarFigure({guess}{counted(len(self.links()), 'link')} of "
            f"{counted(self.depth.shape[1], 'point')}, "
            f"{len(self.interpreted)} of {counted(len(self.windows), 'window')} interpreted)"
        )

    def _judged(self) -> list[tuple[_memo.PlanarLink, str]]:
        """Links of the interpreted windows, or of all, with the verdicts on their chains."""
        chains = (chain for window in self.interpreted or self.windows for chain in window.chains)
        return [(link, chain.verdict) for chain in chains for link in chain.links]


def planar(
    tracks: Array,
    times_s: Sequence[float] | Array,
    noise_px: float | None = None,
    *,
    progress: Callable[[int, int], object] | None = None,
    **options: Any,
) -> PlanarFigure:
    """Links unnamed tracks (T, K, 2), NaN or masked where unseen, into limbs that swing in planes.

    `noise_px`: standard deviation of each coordinate. Options: `window_s`, length of the windows; `size_px`
    of the figure, by default that of the points; `carry`: lengths through windows in which the figure is
    lost; `false_target_rate`, 0.01 or 0.05; `max_tilt_deg` of a plane from the image; `names` of the points
    if they are joints (`RKN`, `right_knee`): joint limits then tell limbs from their mirror images; `scales`
    (T,) of the frames; `focal_px`, to report the error due to perspective. `progress` is called with the
    windows done and in all.

    Defaults: `noise_px` 0.5, `window_s` 1.2, `false_target_rate` 0.01, `max_tilt_deg` 80.
    """
    tracks, at_s = real_numbers(tracks), real_numbers(times_s)
    if options.get("scales") is not None:
        options["scales"] = real_numbers(options["scales"])
    found = _memo.planar(tracks, at_s, noise_px, progress=progress, **options)
    names = options.get("names") or [str(number) for number in range(tracks.shape[1])]
    points = Points(list(names), at_s, tracks)
    figure = PlanarFigure(found.windows, found.depth, found.sources, found.perspective_px, points)
    _log.info("%r", figure)
    return figure


def read_points_csv(path: str | PathLike[str], dimensions: int, rate_hz: float | None = None) -> Points:
    """Points from a CSV file with a header: 2 or 3 columns per point, and `time_s` or a frame rate.

    With 2 `dimensions` the columns of a point are NAME_u_px, NAME_v_px (or NAME_u, NAME_v), with 3 they are
    NAME_x_m, NAME_y_m, NAME_z_m (or NAME_x, NAME_y, NAME_z). A comment line before the header may hold the
    frame rate ("100 Hz"), or `rate_hz` gives it; it must agree with `time_s` if that exists. Empty cells
    are unseen points.
    """
    table = read_number_table(path)
    names, positions = table.points(dimensions)
    scales = table.numbers[:, table.column["scale"]] if "scale" in table.column else None
    frames = None
    if "frame" in table.column:
        numbers = table.numbers[:, table.column["frame"]]
        frames = numbers.astype(np.int64) if np.isfinite(numbers).all() else None
    names = [_SHORT.get(name, name) for name in names]
    return Points(names, table.times_s(rate_hz), positions, scales, frames)


def read_tracks(path: str | PathLike[str], rate_hz: float | None = None) -> Points:
    """Image points to search for limbs: from a CSV file for `read_points_csv`, or from keypoints.

    Keypoints are anything that `read_keypoints` accepts, of the most prominent person; a CSV file of
    keypoints is recognised by the form of a detector, its scores, a column `joint` or `person`, or columns
    NAME_x without NAME_z. For another person read the keypoints and pass them to `limb_points`.
    """
    path = Path(path)
    if not path.exists():
        raise ValueError(nothing_at(path, "file or folder"))
    if holds_keypoints(path):
        return limb_points(read_keypoints(path, fps=rate_hz))
    points = read_points_csv(path, 2, rate_hz)
    shrink = shrink_of_table(path) if path.name == "track.csv" else 1
    return replace(points, positions=of_video(points.positions, shrink))


def limb_points(keypoints: Keypoints) -> Points:
    """The shoulders, elbows, wrists, hips, knees and ankles of one person.

    Points with a score below 0.2 are taken as missing, as in `memo.posture`.
    """
    limbs = [name for name in keypoints.names if name in _SHORT]
    if len(limbs) < 2:
        raise ValueError(
            f"{keypoints.source.path}: fewer than two joints of arms or legs; "
            f"it has {', '.join(keypoints.names)}"
        )
    places = [keypoints.names.index(name) for name in limbs]
    is_seen = keypoints.scores[:, places] >= _LEAST_SCORE
    seen = np.where(is_seen[..., None], keypoints.points[:, places], np.nan)
    names = [_SHORT[name] for name in limbs]
    return Points(names, keypoints.times_s, seen, frames=np.asarray(keypoints.frames, np.int64))


def holds_keypoints(path: Path) -> bool:
    """Whether `read_keypoints` reads this file or folder, and not `read_points_csv`."""
    if is_no_table(path):
        return True
    lines = read_text(path).splitlines()
    header = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    columns = [cell.strip() for cell in header.replace(";", ",").replace("\t", ",").split(",")]

    def some(end: str) -> bool:
        return any(column.endswith(end) for column in columns)

    is_long = not {"joint", *PERSON_COLUMNS}.isdisjoint(columns)
    return is_long or some("_score") or (some("_x") and not some("_z"))


def write_points_csv(path: str | PathLike[str], points: Points) -> None:
    """Writes points in the format of `read_points_csv`."""
    axes = ("u_px", "v_px") if points.positions.shape[2] == 2 else ("x", "y", "z")
    header = ["frame", "time_s", *(f"{name}_{axis}" for name in points.names for axis in axes)]
    rows = [
        [str(frame), f"{time_s:.6f}", *_cells(row.ravel())]
        for frame, time_s, row in zip(points.numbers, points.times_s, points.positions, strict=True)
    ]
    if points.scales is not None:
        header.append("scale")
        for row, scale in zip(rows, points.scales, strict=True):
            row.append(f"{scale:.9g}" if np.isfinite(scale) else "")
    write_table(path, header, rows)


WRITTEN = ("windows.csv", "links.csv", "chains.csv", "points3d.csv")
"""The files that `write_figure_csv` writes."""


def write_figure_csv(out: Path, figure: PlanarFigure, points: Points) -> list[Path]:
    """Writes links.csv, chains.csv, windows.csv and points3d.csv, all at scale 1; returns their paths."""
    points = points.at_one_scale()
    name = points.names.__getitem__
    links, chains, windows = [], [], []
    for number, window in enumerate(figure.windows):
        start_s, end_s = (float(points.times_s[frame]) for frame in (window.start, window.end - 1))
        verdicts = [str(count) for count in (window.planar, window.refuted, window.undecided)]
        times = [f"{start_s:.3f}", f"{end_s:.3f}"]
        evidence = [window.evidence_nats, window.least_nats]
        evidence_cells = _cells([np.nan if nats is None else nats for nats in evidence])
        windows.append([str(number), *times, window.status, window.method, *verdicts, *evidence_cells])
        for chain in window.chains:
            label = "-".join(name(point) for point in chain.points)
            values = [chain.tilt_deg, chain.residual, chain.motion, chain.statistic, chain.threshold]
            angles = chain.angle_deg
            bend = [np.nanmin(angles), np.nanmax(angles)] if np.isfinite(angles).any() else [np.nan] * 2
            margin = chain.reflection_margin_deg
            numbers = [*chain.slope, *values, *bend, np.nan if margin is None else margin]
            chains.append([str(number), label, chain.verdict, *_cells(numbers)])
            for link in chain.links:
                a, b = link.points
                numbers = [link.length, link.length_sd, link.margin, link.confidence]
                labels = [str(number), window.status, name(a), name(b), chain.verdict]
                links.append([*labels, *_cells(numbers)])
    written = [out / file for file in WRITTEN]
    window_header = ["window", "start_s", "end_s", "status", "method", "planar", "refuted", "undecided"]
    window_header += ["evidence_nats", "least_nats"]
    write_table(written[0], window_header, windows)
    link_numbers = ["length_px", "length_sd_px", "margin_px", "confidence"]
    write_table(written[1], ["window", "status", "a", "b", "verdict", *link_numbers], links)
    chain_numbers = ["p", "q", "tilt_deg", "residual_px", "motion_px", "statistic", "threshold"]
    chain_header = ["window", "chain", "verdict", *chain_numbers, "least_angle_deg", "most_angle_deg"]
    chain_header.append("reflection_margin_deg")
    write_table(written[2], chain_header, chains)
    space = np.concatenate([points.positions, figure.depth[..., None]], axis=2)
    header = ["frame", "time_s", "source", *(f"{n}_{axis}_px" for n in points.names for axis in "uvz")]
    rows = (
        [str(number), f"{points.times_s[row]:.6f}", figure.sources[row], *_cells(space[row].ravel())]
        for row, number in enumerate(points.numbers)
    )
    write_table(written[3], header, rows)
    return written


def _cells(values: Any) -> list[str]:
    return [f"{value:.4f}" if np.isfinite(value) else "" for value in values]
