"""The common type of all motion files, and its clock.

World right-handed, Z up, metres, seconds, degrees for joint angles. A file whose up axis is Y is rotated
about X: `x, y, z` of the world are `x, -z, y` of the file, so that X is unchanged.

Formats with a frame rate instead of time stamps need a constant rate: `Motion.at_constant_rate` finds it,
inserts empty frames for missing frames, and refuses time stamps that fit no rate. Nothing is
interpolated unless `resampled` or `filled` is called, and nothing is ever extrapolated.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from memo.missing import real_numbers
from memo.wording import counted

__all__ = ["FormatError", "GaitEvent", "Motion", "Up", "from_z_up", "to_z_up"]

Array = npt.NDArray[np.float64]

Up = Literal["z", "y"]

EVENT_KINDS = ("heel_strike", "toe_off")
SIDES = ("right", "left")

MAX_FRAMES = 10_000_000
MAX_POINTS = 30_000_000  # frames times points
STAMP_ERROR_S = 1.1e-3  # containers round time stamps to milliseconds; two rounded ones define the grid
_ROUNDING_S = 0.501e-3  # half a millisecond, and a microsecond for six decimals in text
_LATEST_S = 1e9
_LONGEST_GAP = 20  # largest ratio of empty frames to frames


class FormatError(ValueError):
    """A file that cannot be read or written; one line names the file, the place in it, and the reason."""

    def __init__(self, message: str) -> None:
        # Names and cells of damaged files may contain anything, and messages of libraries have several lines.
        line = " ".join(message.split())[:600]
        super().__init__("".join(c if c.isprintable() else "?" for c in line))


class GaitEvent(NamedTuple):
    """A heel strike or toe-off."""

    time_s: float
    """Seconds on the clock of `Motion.times_s`."""
    kind: str
    """ "heel_strike" or "toe_off"."""
    side: str
    """ "right" or "left"."""


@dataclass(frozen=True)
class Motion:
    """Points in space over T frames. World: right-handed, Z up, metres."""

    names: tuple[str, ...]
    """The K points, in the spelling of the file."""
    times_s: Array
    """(T,) seconds, increasing."""
    points: Array
    """(T, K, 3) metres; NaN if a point is missing, in all three coordinates."""
    events: tuple[GaitEvent, ...] = ()
    """In order of time."""
    angles: Mapping[str, Array] = field(default_factory=dict)
    """Joint angles (T,) in degrees, NaN where missing: `right_knee` is flexion, as in `track.csv`."""
    metadata: Mapping[str, Any] = field(default_factory=dict)
    """Other facts in the file: `format`, `up`, `unit`, `rate_hz`; and `references`, what each joint angle is
    between, by the name of the angle, if it is known."""
    notes: tuple[str, ...] = ()
    """Assumptions and omissions in reading, in sentences."""
    frames: npt.NDArray[np.int64] | None = None
    """(T,) numbers of the frames in the video, from 0, increasing; None if the file has none."""

    def __post_init__(self) -> None:
        times_s, points = real_numbers(self.times_s), real_numbers(self.points)
        angles = {name: real_numbers(values) for name, values in self.angles.items()}
        if times_s.ndim != 1 or points.shape != (len(times_s), len(self.names), 3):
            wanted = f"times (T,) and points (T, {len(self.names)}, 3)"
            raise FormatError(f"wanted {wanted}, got {times_s.shape} and {points.shape}")
        if not len(times_s):
            raise FormatError("no frames")
        if not self.names and not angles:
            raise FormatError("neither points nor angles")
        for what, names in (("point", self.names), ("angle", tuple(angles))):
            if len(set(names)) < len(names) or "" in names:
                wrong = next(name for name, count in Counter(names).items() if count > 1 or not name)
                raise FormatError(f"the name of {what} {wrong!r} is empty or occurs twice")
        for name, values in angles.items():
            if values.shape != times_s.shape:
                raise FormatError(f"angle {name}: wanted {times_s.shape}, got {values.shape}")
            if np.isinf(values).any():
                raise FormatError(f"angle {name}: infinite in frame {np.flatnonzero(np.isinf(values))[0]}")
        if self.frames is not None and np.shape(self.frames) != times_s.shape:
            raise FormatError(f"frame numbers: wanted {times_s.shape}, got {np.shape(self.frames)}")
        _check_clock(times_s)
        if np.isinf(points).any():
            frame, point = np.argwhere(np.isinf(points))[0][:2]
            raise FormatError(f"point {self.names[point]}: infinite in frame {frame}")
        points[np.isnan(points).any(axis=2)] = np.nan
        for event in self.events:
            if event.kind not in EVENT_KINDS or event.side not in SIDES or not math.isfinite(event.time_s):
                raise FormatError(f"not a gait event: {tuple(event)}")
        for name, value in (("times_s", times_s), ("points", points), ("angles", angles)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "events", tuple(sorted(self.events)))

    def at_constant_rate(self) -> tuple[float, Motion]:
        """The frame rate in Hz and the motion on its grid, with empty frames for missing frames.

        Raises `FormatError` if the time stamps fit no constant rate within a millisecond.
        """
        steps, rate_hz = self._steps()
        count = int(steps[-1]) + 1
        times_s = self.times_s[0] + np.arange(count) / rate_hz
        if count == len(steps):
            return rate_hz, replace(self, times_s=times_s)
        points = np.full((count, len(self.names), 3), np.nan)
        points[steps] = self.points
        angles = {name: np.full(count, np.nan) for name in self.angles}
        for name, values in self.angles.items():
            angles[name][steps] = values
        return rate_hz, replace(self, times_s=times_s, points=points, angles=angles, frames=None)

    def resampled(self, rate_hz: float) -> Motion:
        """The motion at another rate, each value interpolated linearly between the two frames around it.

        The new frames begin at the first time stamp, end before the last, and have no numbers in the video. A
        value is missing if one of the two is, or if they are more than three usual intervals apart.
        """
        if not (math.isfinite(rate_hz) and rate_hz > 0):
            raise FormatError(f"a rate must be positive and finite, got {rate_hz:g}")
        span_s = float(self.times_s[-1] - self.times_s[0])
        most = min(MAX_FRAMES, MAX_POINTS // max(1, len(self.names)))
        if span_s * rate_hz > most:
            raise FormatError(f"{span_s:g} s at {rate_hz:g} Hz are more than {counted(most, 'frame')}")
        count = int(span_s * rate_hz + 1e-6) + 1
        times_s = self.times_s[0] + np.arange(count) / rate_hz
        if len(self.times_s) == 1:
            return replace(self, metadata={**self.metadata, "rate_hz": rate_hz}, frames=None)
        intervals = np.diff(self.times_s)
        gap_s = 3 * float(np.median(intervals))
        if span_s > _LONGEST_GAP * intervals[intervals <= gap_s].sum() + 60:
            first_s, last_s = self.times_s[0], self.times_s[-1]
            raise FormatError(f"the times {first_s:g} to {last_s:g} s are mostly gaps: split the motion")
        after = np.clip(np.searchsorted(self.times_s, times_s, side="right"), 1, len(self.times_s) - 1)
        weight = np.clip((times_s - self.times_s[after - 1]) / intervals[after - 1], 0, 1)
        weight[np.abs(weight) < 1e-9], weight[np.abs(weight - 1) < 1e-9] = 0, 1
        weight[(intervals[after - 1] > gap_s) & (weight > 0) & (weight < 1)] = np.nan
        points = np.empty((count, len(self.names), 3))
        for k in range(len(self.names)):  # one point at a time, to keep only one copy of the whole
            points[:, k] = _between(self.points[after - 1, k], self.points[after, k], weight[:, None])
        return replace(
            self,
            times_s=times_s,
            points=points,
            angles={
                name: _between(v[after - 1], v[after - 1] + _turn_deg(v[after] - v[after - 1]), weight)
                for name, v in self.angles.items()
            },
            metadata={**self.metadata, "rate_hz": rate_hz},
            frames=None,
        )

    def filled(self, longest_s: float) -> tuple[Motion, int]:
        """The motion with gaps up to `longest_s` interpolated linearly, and the number of values filled.

        A gap is as long as the time between the frames at its two ends. Values missing at the beginning or
        at the end of a point's or an angle's track stay missing, and missing frames stay missing.
        """
        points, filled = self.points.copy(), 0
        for k in range(len(self.names)):
            filled += self._bridge(points[:, k], longest_s)
        angles = {name: values.copy() for name, values in self.angles.items()}
        for values in angles.values():
            filled += self._bridge(values[:, None], longest_s, are_angles=True)
        return replace(self, points=points, angles=angles), filled

    def _bridge(self, track: Array, longest_s: float, *, are_angles: bool = False) -> int:
        """Fills the gaps of a track (T, D) in place; returns the number of frames filled."""
        filled = 0
        known = np.flatnonzero(np.isfinite(track[:, 0]))
        wide = np.diff(known) > 1
        for a, b in zip(known[:-1][wide], known[1:][wide], strict=True):
            if self.times_s[b] - self.times_s[a] <= longest_s * (1 + 1e-9):
                part = (self.times_s[a + 1 : b] - self.times_s[a]) / (self.times_s[b] - self.times_s[a])
                change = track[b] - track[a]
                change = _turn_deg(change) if are_angles else change
                track[a + 1 : b] = track[a] + part[:, None] * change
                filled += int(b - a - 1)
        return filled

    def _steps(self) -> tuple[npt.NDArray[np.int64], float]:
        """(T,) numbers of the frames on the grid, from 0, and the rate of the grid."""
        if len(self.times_s) == 1:
            rate_hz = self.metadata.get("rate_hz")
            if rate_hz is None:
                raise FormatError("one frame has no frame rate: give --rate")
            return np.zeros(1, np.int64), float(rate_hz)
        intervals = np.diff(self.times_s)
        usual_s = float(np.median(intervals))
        if usual_s < 1e-6:
            raise FormatError(f"frames {usual_s:g} s apart: more than a million per second")
        follows = np.round(intervals / usual_s) == 1
        # The usual interval of stamps in milliseconds is itself in milliseconds: over a gap that miscounts.
        period_s, error_s = _mean_period(self.times_s, follows) if follows.any() else (usual_s, 0.0)
        ratios = np.where(follows, 1.0, np.round(intervals / period_s))
        if ratios.sum() >= _LONGEST_GAP * len(self.times_s) + 1000:
            raise FormatError(
                f"the times {self.times_s[0]:g} to {self.times_s[-1]:g} s are mostly gaps at"
                f" {1 / period_s:.4g} Hz: split the motion"
            )
        if not follows.all() and _in_milliseconds(self.times_s):
            for rate_hz in _nominal_near(period_s, error_s, self.metadata.get("rate_hz")):
                most_s = min(_ROUNDING_S, 0.25 / rate_hz)
                counts = np.where(follows, 1.0, np.round(intervals * rate_hz))
                steps = np.concatenate([[0.0], np.cumsum(counts)])
                if counts.min() >= 1 and _off_s(self.times_s, steps, rate_hz) <= most_s:
                    return steps.astype(np.int64), rate_hz
        steps = np.concatenate([[0.0], np.cumsum(ratios)])
        slope = np.polyfit(steps, self.times_s, 1)[0] if ratios.min() >= 1 else period_s
        rate_hz = _nominal(1 / float(slope), float(steps[-1]), self.metadata.get("rate_hz"))
        off_s = _off_s(self.times_s, steps, rate_hz)
        if ratios.min() < 1 or off_s > min(STAMP_ERROR_S, 0.25 / rate_hz):
            rates = f"{1 / intervals.max():.4g} to {1 / intervals.min():.4g}"
            raise FormatError(
                f"the time stamps have no constant rate ({rates} Hz from frame to frame,"
                f" {1 / period_s:.4g} Hz in the middle):"
                f" give --rate {round(1 / period_s) or 1} to interpolate"
            )
        return steps.astype(np.int64), rate_hz


def to_z_up(points: npt.ArrayLike, up: Up) -> Array:
    """Points (..., 3) with the given up axis, in axes with Z up."""
    points = np.asarray(points, np.float64)
    return points if up == "z" else np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)


def from_z_up(points: npt.ArrayLike, up: Up) -> Array:
    """Points (..., 3) of a world with Z up, in axes with the given up axis."""
    points = np.asarray(points, np.float64)
    return points if up == "z" else np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def _check_clock(times_s: Array) -> None:
    bad = np.flatnonzero(~(np.abs(times_s) < _LATEST_S))
    if len(bad):
        raise FormatError(f"frame {bad[0]}: the time {times_s[bad[0]]:g} s is not a valid time")
    late = np.flatnonzero(~(np.diff(times_s) > 0))
    if len(late):
        a, b = times_s[late[0]], times_s[late[0] + 1]
        raise FormatError(f"frame {late[0] + 1}: times must increase, {b:g} s follows {a:g} s")


def _mean_period(times_s: Array, follows: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """The period of the frames that follow each other, and how far stamps in milliseconds may move it.

    The slope of parallel lines through all runs without a gap, by least squares.
    """
    run = np.concatenate([[0], np.cumsum(~follows)])
    frames = np.arange(len(times_s), dtype=np.float64)
    frames -= (np.bincount(run, frames) / np.bincount(run))[run]  # from the middle of the run
    spread = float(frames @ frames)
    # Rounding errors have a standard deviation of 0.29 ms: this is nearly four of those of the slope.
    return float(frames @ (times_s - times_s[0])) / spread, STAMP_ERROR_S / math.sqrt(spread)


def _in_milliseconds(times_s: Array) -> bool:
    """Whether all stamps are whole milliseconds, up to the sixth decimal of text."""
    return bool((np.abs(times_s - np.round(times_s, 3)) < 1e-6).all())


def _nominal_near(period_s: float, error_s: float, said_hz: float | None) -> list[float]:
    """Rates whose period is this one up to its error: that of the file, whole numbers, NTSC rates."""
    low_hz = 1 / (period_s + error_s)
    high_hz = 1 / max(period_s - error_s, period_s / 2)  # at twice the rate every second frame is absent
    rates = [] if said_hz is None else [float(said_hz)]
    for ratio in (1.0, 1.001):
        wholes = range(math.ceil(low_hz * ratio), math.floor(high_hz * ratio) + 1)
        rates += sorted((whole / ratio for whole in wholes), key=lambda rate: abs(1 / rate - period_s))
    return [rate for rate in rates if low_hz <= rate <= high_hz]


def _off_s(times_s: Array, steps: Array, rate_hz: float) -> float:
    """The largest distance of a stamp from the grid, put where this is least."""
    drift_s = times_s - steps / rate_hz
    return float(drift_s.max() - drift_s.min()) / 2


def _nominal(rate_hz: float, steps: float, said_hz: float | None) -> float:
    """The rate in the file, a whole number or an NTSC rate, if the stamps cannot tell it from their own."""
    wholes = [rate for rate in (round(rate_hz), round(rate_hz * 1.001) / 1.001) if rate > 0]
    near = [rate for rate in wholes if abs(rate / rate_hz - 1) < 1e-4]
    for nominal in ([] if said_hz is None else [float(said_hz)]) + near:
        if abs(steps / nominal - steps / rate_hz) < STAMP_ERROR_S / 4:
            return float(nominal)
    return rate_hz


def _between(a: Array, b: Array, weight: Array) -> Array:
    """a at weight 0, b at 1, linear between; a missing neighbour matters only if it has weight."""
    mixed = (1 - weight) * a + weight * b
    return np.where(weight == 0, a, np.where(weight == 1, b, mixed))


def _turn_deg(difference: Array) -> Array:
    """The same rotation by at most half a turn."""
    return difference - 360 * np.round(difference / 360)
