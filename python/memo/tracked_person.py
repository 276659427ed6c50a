"""What a walk that `memo track` found in the video tells `memo.posture` about the person of the keypoints.

The walk gives the camera, the height, the direction of walking and the distance of the neck in each frame.
Which walk it is follows from the image: the one whose joints are nearest to the keypoints.

Limits: the walk's joints are those of its body model, so its segment lengths are not those of a detector's
points and are not used: with them the joints of drawn walks are 7.6 and 6.5 instead of 6.0 and 5.5 cm off.
Nor is its phase: linking finds the same one by the limbs, and the errors stay the same. Frames farther than
half a second from the walk have no distance.
"""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import JOINTS, read_track
from memo.given import nothing_at
from memo.keypoints import Keypoints
from memo.run import read_run

__all__ = ["GIVEN_HEIGHT_SD", "TrackedPerson", "tracked_person"]

#: Of a height that a user gives, as a share of it: the usual `height_sd` of `Tracker`.
GIVEN_HEIGHT_SD = 0.012

_BEYOND_S = 0.5
_PACE_S = 0.5
_FARTHEST = 0.3
_LEAST_SD_M = 0.05
_STRAIGHT_RAD = np.radians(30.0)

Array = npt.NDArray[np.float64]


class TrackedPerson(NamedTuple):
    """A person of a track, as `memo.posture` takes it."""

    person: int
    """Number of the person in the track."""
    camera: _memo.Camera
    """The camera of the track."""
    height_m: float
    """The person's height, crown to sole."""
    height_sd_m: float
    """Its standard deviation."""
    moving_direction: tuple[float, float, float] | None
    """Direction of walking in the world; None for who turns, walks backwards or on a treadmill."""
    distance_m: Array
    """(T,) distance of the neck from the camera in each frame of the keypoints; NaN if unknown."""
    distance_sd_m: float
    """Its standard deviation."""


def tracked_person(folder: str | PathLike[str], keypoints: Keypoints) -> TrackedPerson:
    """The person of a folder of `memo track` whose joints are nearest to the keypoints in the image.

    Raises ValueError if there is no such folder, or it holds no walk, shares no time with the keypoints, or
    nobody is near.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise ValueError(nothing_at(folder, "folder of memo track"))
    columns, run = read_track(folder), read_run(folder)
    if run["camera"] is None or not len(columns["frame"]):
        raise ValueError(f"{folder}: nobody was tracked")
    camera = _memo.Camera.from_parameters(run["camera"])
    walk = _nearest_walk(folder, columns, keypoints)
    rows = np.flatnonzero(columns["walk"] == walk)
    record: dict[str, Any] = run["walks"][walk] if walk < len(run["walks"]) else {}
    summary = run["summary"]
    height_m = float(record.get("drawn_height_m") or record.get("height_m") or summary["height_m"])
    known = summary.get("height_sd_m") and summary.get("height_m")
    share = summary["height_sd_m"] / summary["height_m"] if known else GIVEN_HEIGHT_SD
    neck_m = 0.5 * (_joint(columns, "right_shoulder", rows) + _joint(columns, "left_shoulder", rows))
    path_m = _over_time(columns["time_s"][rows], neck_m, keypoints.times_s)
    return TrackedPerson(
        person=int(columns["person"][rows[0]]),
        camera=camera,
        height_m=height_m,
        height_sd_m=share * height_m,
        moving_direction=_direction(columns["heading_rad"][rows], neck_m, record),
        distance_m=np.linalg.norm(path_m - np.asarray(camera.position), axis=-1),
        distance_sd_m=_distance_sd(columns, rows, neck_m - np.asarray(camera.position)),
    )


def _joint(columns: dict[str, Any], joint: str, rows: npt.NDArray[np.int64]) -> Array:
    """(n, 3) world, metres."""
    return np.stack([columns[f"{joint}_{axis}_m"][rows] for axis in "xyz"], axis=-1).astype(np.float64)


def _nearest_walk(folder: Path, columns: dict[str, Any], keypoints: Keypoints) -> int:
    shared = [joint for joint in JOINTS if joint in keypoints.names]
    places = [keypoints.names.index(joint) for joint in shared]
    nearest_row = np.abs(keypoints.times_s[:, None] - columns["time_s"]).argmin(axis=0)
    step_s = float(np.median(np.diff(keypoints.times_s))) if len(keypoints.times_s) > 1 else 0.04
    off: dict[int, list[float]] = {}
    for row, walk in enumerate(columns["walk"]):
        own = nearest_row[row]
        if abs(keypoints.times_s[own] - columns["time_s"][row]) > 0.6 * step_s:
            continue
        seen = keypoints.points[own, places]
        model = np.array([[columns[f"{joint}_{axis}_px"][row] for axis in "uv"] for joint in shared])
        apart = np.linalg.norm(seen - model, axis=-1)
        size = np.ptp(model[:, 1])
        if np.isfinite(apart).any() and size > 0:
            off.setdefault(int(walk), []).append(float(np.nanmedian(apart) / size))
    if not off:
        raise ValueError(f"{folder}: its walks share no time with the keypoints")
    nearest = min(off, key=lambda walk: float(np.median(off[walk])))
    if np.median(off[nearest]) > _FARTHEST:
        raise ValueError(
            f"{folder}: nobody of the track is where the keypoints are; the nearest is "
            f"{np.median(off[nearest]):.1f} of the body's height away"
        )
    return nearest


def _over_time(times_s: Array, points_m: Array, at_s: Array) -> Array:
    """(T, 3) points at other times; at the ends they move on for a moment as they did."""
    found = np.stack([np.interp(at_s, times_s, axis) for axis in points_m.T], axis=-1)
    for end, sign in ((0, -1), (-1, 1)):
        near = np.abs(times_s - times_s[end]) <= _PACE_S
        if near.sum() < 3:
            continue
        pace = np.polyfit(times_s[near], points_m[near], 1)[0]
        beyond = sign * (at_s - times_s[end]) > 0
        found[beyond] += (at_s[beyond] - times_s[end])[:, None] * pace
    outside = (at_s < times_s[0] - _BEYOND_S) | (at_s > times_s[-1] + _BEYOND_S)
    found[outside] = np.nan
    return found


def _direction(
    headings_rad: Array, neck_m: Array, record: dict[str, Any]
) -> tuple[float, float, float] | None:
    """The direction of a straight walk forwards."""
    mean = np.nanmean(np.exp(1j * headings_rad))
    turned = np.nanmax(np.abs(np.angle(np.exp(1j * headings_rad) / mean)))
    stays = np.linalg.norm(neck_m[-1] - neck_m[0]) < 0.5
    if record.get("gait") == "backward" or turned > _STRAIGHT_RAD or stays:
        return None
    return (float(mean.real / abs(mean)), float(mean.imag / abs(mean)), 0.0)


def _distance_sd(columns: dict[str, Any], rows: npt.NDArray[np.int64], rays_m: Array) -> float:
    """Median standard deviation of the torso's position along the ray to the neck."""
    units = rays_m / np.linalg.norm(rays_m, axis=-1, keepdims=True)
    sd_m = np.stack([columns[f"sd_{axis}_m"][rows] for axis in "xyz"], axis=-1)
    along = np.sqrt(np.sum((units * sd_m) ** 2, axis=-1))
    known = along[np.isfinite(along)]
    return max(float(np.median(known)) if len(known) else _LEAST_SD_M, _LEAST_SD_M)
