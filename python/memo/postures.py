"""Postures from one view: from keypoints and a camera, all possible postures and the most probable motion.

The postures are computed by the core (Lee and Chen 1985, with additions for a detector's points). This module
passes the keypoints on as 14 joints and names the results.

Limits: sizes need a scale; without lengths, height, ground or distance, the height of an average adult is
assumed. Without a camera, a level one is assumed: if it was tilted, the postures are tilted.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from memo import _memo, sides
from memo.keypoints import Keypoints, KeypointsError, read_keypoints
from memo.notebook import Shown
from memo.segment_lengths import checked_lengths, read_lengths
from memo.table import data_frame
from memo.tracked_person import GIVEN_HEIGHT_SD, TrackedPerson, tracked_person
from memo.wording import counted

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

__all__ = ["Interpretations", "Postures", "Reason", "ReasonTotal", "SecondBest", "posture"]

_log = logging.getLogger(__name__)

RULES = ("physical", "walking", "walking-general")
STRENGTHS = ("measured", "paper")
ANCHORS = ("auto", "ground", "trunk", "extent", "head", "combined")

_LIMB_ENDS = ("elbow", "wrist", "knee", "ankle")

_DISTANCES_M = (0.1, 1000.0)
_MOST_GROUPS = 1 << 31

_UNDECIDED_P = 0.2

Array = npt.NDArray[np.float64]
Whole = npt.NDArray[np.int64]


class Reason(NamedTuple):
    """What one constraint cut in one frame."""

    constraint: str
    joint: str
    """The joint at whose level of the tree the constraint cut branches."""
    branches: int
    """Number of branches cut, each with its whole subtree."""


class ReasonTotal(NamedTuple):
    """What one constraint cut in all frames: a row of `reasons.csv`."""

    constraint: str
    kind: str
    """Kind of constraint: an angle, a distance, a collision or a rule."""
    joint: str
    branches: int
    frames: int
    """Number of frames in which it cut a branch."""
    sentence: str
    """Description of the constraint."""


class Interpretations(NamedTuple):
    """All postures of one frame, kept or cut. World, metres."""

    survivors_m: Array
    """(K, 14, 3) the postures left, in the order of the tree."""
    cut_m: Array
    """(C, 14, 3) the branches cut; joints below the level at which the branch was cut are NaN, because they
    may be at any of their places."""
    cut_by: tuple[str, ...]
    """(C,) the constraint that cut each branch, as in `Reason`."""


@dataclass(frozen=True, repr=False)
class SecondBest:
    """The second most probable motion: where it differs, and how much less probable it is."""

    joints: tuple[str, ...]
    """The joints at the ends of the segments mirrored in depth."""
    first_frame: int
    last_frame: int
    """Frame numbers, both included."""
    postures_m: Array
    """(n, 14, 3) world, metres, in the frames from first to last."""
    margin_nats: float
    """Natural logarithm of the probability ratio of the best motion to this one."""
    p: float
    """Probability of this motion compared with the best."""

    def __repr__(self) -> str:
        where = f"frames {self.first_frame}-{self.last_frame}"
        return f"SecondBest({', '.join(self.joints)} mirrored in {where}, p = {self.p:.2g})"


@dataclass(frozen=True, repr=False, eq=False)
class Postures(Shown):
    """The postures of one person over T frames. World: right-handed, Z up, metres; NaN where unknown."""

    frames: Whole
    """(T,) frame numbers of the keypoints."""
    times_s: Array
    """(T,) seconds."""
    joints: tuple[str, ...]
    """Names of the 14 joints, in the order of the levels of the tree and of every axis of 14."""
    camera: _memo.Camera
    """The camera, given or assumed."""
    camera_assumed: bool
    """Whether the camera was assumed. It is then at the origin of the world, and level."""
    points_px: Array
    """(T, 14, 2) image points: pixels, u right, v down; NaN if not visible."""
    weights: Array
    """(T, 14) the detector's confidence, 0 to 1."""
    lengths_m: dict[str, float]
    """The 17 segment lengths, metres."""
    length_sd_m: dict[str, float]
    """Their standard deviations, metres."""
    length_basis: dict[str, str]
    """Source of each length."""
    scale_from: str
    """Source of the scale: "lengths", "height", "track", "ground", "distance" or "assumed"."""
    anchor_m: Array
    """(T,) distance of the neck, the root of the tree, from the camera's centre, metres."""
    anchor_sd_m: Array
    """(T,) its standard deviation, metres."""
    anchor_source: tuple[str, ...]
    """(T,) its source."""
    anchor_conflicts: tuple[str, ...]
    """Contradictions between sources of the distance, in sentences."""
    level_reached: Whole
    """(T, 14) nodes of the tree at each level that no constraint cut."""
    level_survived: Whole
    """(T, 14) number of these that lead to a posture left."""
    level_without_root: Whole
    """(T, 14) nodes whose segment is too short to reach the joint's ray: the nearest point is used."""
    reasons: tuple[tuple[Reason, ...], ...]
    """(T,) what was cut in each frame, and by which constraint."""
    reason_totals: tuple[ReasonTotal, ...]
    """The same, summed over all frames."""
    survivors: Whole
    """(T,) postures left in each frame."""
    groups_m: tuple[Array, ...]
    """(T,) of (G, 14, 3) metres: one posture per group of similar postures, for the `max_groups` largest
    groups; if more than 1024 postures are left, groups of up to 1024 of them, evenly spaced."""
    group_sizes: tuple[Whole, ...]
    """(T,) of (G,): number of grouped postures in each group."""
    group_counts: tuple[int | None, ...]
    """(T,) total number of groups; None if more than 1024 postures are left."""
    cut_all: tuple[tuple[str, ...] | None, ...]
    """(T,) if no posture is left: what the least violating posture violates, as sentences; else None."""
    interpretations: tuple[Interpretations, ...] | None
    """(T,) every posture of each frame with its reason; None without `keep_all`."""
    problems: tuple[str | None, ...]
    """(T,) why a frame cannot be used, such as a neck that is not visible; else None."""
    linked_m: Array
    """(T, 14, 3) metres: the most probable motion. It uses either root of every segment and may break limits
    at a cost, so a frame's posture need not be among those left."""
    linked_breaks: tuple[tuple[str, ...], ...]
    """(T,) names of the constraints that the posture in the motion breaks."""
    smoothed_m: Array
    """(T, 14, 3) metres: the same, smoothed in space: close to the image points, with constant lengths."""
    toes_m: Array
    """(T, 2, 3) metres: tips of the right and the left big toe; NaN without keypoints of toes."""
    angles_deg: dict[str, Array]
    """(T,) each: angles of the smoothed motion in degrees, NaN where unknown. `right_hip` is the flexion of
    the thigh against the trunk, `right_knee` of the shank against the thigh, `right_ankle` of the foot
    against the shank (0 in standing, to the front positive; needs keypoints of toes), `right_shoulder` of the
    upper arm against the trunk, `right_elbow` of the forearm against the upper arm; `right_hip_adduction`
    and `right_shoulder_adduction` are towards the body. Signs are those of OpenSim's models."""
    sd_m: Array
    """(T, 14) standard deviation of each joint of the smoothed motion, metres."""
    gap_m: Array
    """(T, 14) amount by which a segment was too short to reach the joint's ray, metres."""
    margin_nats: Array
    """(T,) how much more probable the motion is than the best other one in this frame; else infinite."""
    p_mirrored: Array
    """(T, 14) probability that the segment ending at a joint, with its subtree, is mirrored in depth,
    calibrated for each set of rules; with rules that do not fit the motion it is too small."""
    second: SecondBest | None
    """The second most probable motion, if there is a relevant one."""
    heading_source: str
    """Source of the direction of walking."""
    rules: str
    """The rules that cut postures and whose habits chose among them: "physical" if those asked for leave no
    posture in a third of the frames, or if the most probable motion breaks limits of the body, or swings the
    segments of a limb against each other, in three tenths of the frames."""
    warnings: tuple[str, ...]
    """Warnings to read before the numbers are used."""
    repair: sides.SideRepair | None
    """Exchanges of right and left made beforehand; None if they were not requested."""

    @property
    def found(self) -> npt.NDArray[np.bool_]:
        """(T,) whether any joint of the motion is known."""
        known = np.isfinite(self.smoothed_m).all(axis=-1)
        return np.asarray(np.any(known, axis=1), np.bool_)

    @property
    def is_possible(self) -> bool:
        """Whether any posture in the motion breaks no constraint. Otherwise the rules and the limits of
        bodies allow no such sequence, whatever postures are left in single frames."""
        return any(there and not breaks for there, breaks in zip(self.found, self.linked_breaks, strict=True))

    @property
    def all_groups_given(self) -> npt.NDArray[np.bool_]:
        """(T,) whether all groups are in `groups_m`, not only the largest."""
        given = [len(sizes) for sizes in self.group_sizes]
        return np.array([own == count for own, count in zip(given, self.group_counts, strict=True)], np.bool_)

    @property
    def undecided(self) -> npt.NDArray[np.bool_]:
        """(T,) whether at least one joint is undecided; `undecided_joints` says which."""
        return np.asarray(self.undecided_joints.any(axis=1), np.bool_)

    @property
    def undecided_joints(self) -> npt.NDArray[np.bool_]:
        """(T, 14) whether the segment that ends at a joint is undecided: mirrored with a probability over
        0.2."""
        return np.asarray(self.p_mirrored > _UNDECIDED_P, np.bool_)

    @property
    def limbs_known(self) -> bool:
        """Whether the motion has the end of a limb segment: an elbow, wrist, knee or ankle."""
        limbs = [place for place, name in enumerate(self.joints) if name.endswith(_LIMB_ENDS)]
        return bool(np.isfinite(self.smoothed_m[:, limbs]).any())

    def in_camera(self, points_m: Array) -> Array:
        """World points (..., 3) in the camera's axes: x right, y down, z forward, metres."""
        flat = np.ascontiguousarray(points_m, np.float64).reshape(-1, 3)
        return self.camera.camera_from_world(flat).reshape(np.shape(points_m))

    def typical_row(self) -> int:
        """The first row with as many postures left as the median frame, of those with a posture."""
        rows = np.flatnonzero(self.found & (self.survivors > 0))
        if not len(rows):
            rows = np.flatnonzero(self.found)
        if not len(rows):
            return 0
        counts = self.survivors[rows]
        return int(rows[np.argmin(np.abs(counts - np.median(counts)))])

    def to_pandas(self) -> pandas.DataFrame:
        """The columns of `postures.csv` as a `pandas.DataFrame`, one row per frame."""
        from memo.posture_files import posture_columns

        return data_frame(posture_columns(self))

    def plot(self, row: int | None = None, ax: Axes | None = None) -> Axes:
        """Draws into `ax`, or new Axes, and returns them: the motion as a strip of stick figures, or
        all groups of postures of one row from the side. Needs matplotlib."""
        from memo.plot import new_axes
        from memo.posture_plot import plot_from_the_side, plot_strip

        ax = new_axes() if ax is None else ax
        if row is None:
            return plot_strip(ax, self)
        if not 0 <= row < len(self.frames):
            raise IndexError(f"row {row} of postures with {counted(len(self.frames), 'row')}")
        return plot_from_the_side(ax, self, row)

    def __len__(self) -> int:
        return len(self.frames)

    def __repr__(self) -> str:
        left = self.summary["survivors_median"]
        found = f"{self.found.sum()} of {counted(len(self), 'frame')}"
        sure = f"{self.undecided.sum()} undecided"
        way = "in the motion" if self.is_possible else "in a motion that breaks a constraint in each"
        return f"Postures({found} {way}, {sure}, median of {left:g} postures left, {self.scale_from})"

    @property
    def summary(self) -> dict[str, Any]:
        """The overall figures: counts, medians, scale, the second best motion, warnings."""
        left = self.survivors[self.survivors > 0]
        most = max(self.reason_totals, key=lambda total: total.branches, default=None)
        second = self.second
        return {
            "frames": len(self.frames),
            "frames_with_survivors": len(left),
            "frames_in_motion": int(self.found.sum()),
            "possible": self.is_possible,
            "survivors_median": float(np.median(left)) if len(left) else 0.0,
            "scale_from": self.scale_from,
            "camera_assumed": self.camera_assumed,
            "heading_source": self.heading_source,
            "rules": self.rules,
            "undecided_frames": int(self.undecided.sum()),
            "most_cut": None if most is None else most._asdict(),
            "second": None
            if second is None
            else {
                "joints": list(second.joints),
                "first_frame": second.first_frame,
                "last_frame": second.last_frame,
                "margin_nats": second.margin_nats,
                "p": second.p,
            },
            "frames_breaking": sum(map(bool, self.linked_breaks)),
            "exchanged": {} if self.repair is None else self.repair.exchanged,
            "guessed": {} if self.repair is None else self.repair.guessed,
            "warnings": list(self.warnings),
        }


def posture(
    keypoints: Keypoints | str | PathLike[str],
    camera: _memo.Camera | None = None,
    lengths: Mapping[str, float] | str | PathLike[str] | None = None,
    height_m: float | None = None,
    *,
    fov_deg: float | None = None,
    rules: str | None = None,
    strength: str | None = None,
    anchor: str | None = None,
    distance_m: float | Sequence[float] | Array | None = None,
    distance_sd_m: float | None = None,
    moving_direction: Sequence[float] | None = None,
    track: str | PathLike[str] | None = None,
    unswap: bool = True,
    noise_px: float | None = None,
    group_m: float | None = None,
    max_groups: int | None = None,
    keep_all: bool = False,
    fps: float | None = None,
    layout: str | None = None,
    person: int | str | tuple[float, float, int] | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Postures:
    """All postures of a person that one view allows, and the most probable motion.

    A segment can end at either of two places on its joint's line of sight. The motion uses one of them
    in each frame; it may break limits at a cost, so it need not use the postures left (`linked_breaks`).

    `keypoints`: the result of `read_keypoints`, or a file or folder for it, with `fps`, `layout`, `person`.
    `camera`: calibrated; without one, a level camera with the horizontal field of view `fov_deg` is assumed,
    and the keypoints must give the size of the picture (`read_keypoints(image_size=)`). The ground is then
    unknown, and distances are at least 18 % uncertain; figures relative to their necks depend little on it.
    The default is across the width of the picture, or across its height if that is larger.
    `lengths`: the 17 segment lengths by name, metres, or a file for `read_lengths`; else `height_m`, crown
    to sole, refined by the frames; with neither they are estimated, with the ground as scale.
    `rules`: "physical", "walking" or "walking-general" (holds for any way of
    walking); `strength`: "measured" limits or those of the "paper". Measured rules that do not fit the
    motion are dropped, with a warning (`Postures.rules`).
    `anchor`: source of the distance of the neck, "auto", "ground", "trunk", "extent", "head" or
    "combined"; or `distance_m`, one number or (T,), 0.1 to 1000, NaN if unknown, with its standard
    deviation `distance_sd_m`.
    `moving_direction`: (3,) world, direction of walking; by default taken from the motion. With
    "physical", the direction that the person mostly faces; by default not used.
    `track`: folder of `memo track` of the same video. The walk nearest to the keypoints gives the camera, the
    distance of the neck and, unless they are given, the height and the moving direction. Frames more than
    half a second from the walk have no postures.
    `unswap`: first exchange right and left where a detector confused them.
    `noise_px`: standard deviation of a keypoint. `group_m`: postures form one group if no joint differs by
    more; `max_groups`: number of groups returned per frame, the largest; `group_counts` counts them all.
    `keep_all`: return every posture of every frame with what cut it (`interpretations`), up to 8192 of 336
    bytes each.
    `progress` is called at intervals with the work done and the total.

    Defaults: `fov_deg` 62, `rules` "walking", `strength` "measured", `anchor` "auto", `distance_sd_m` 0.05,
    `noise_px` 2, `group_m` 0.1, `max_groups` 64.

    Raises ValueError or TypeError, with one line, for unusable input.
    """
    _check_known("rules", rules, RULES)
    _check_known("strength", strength, STRENGTHS)
    _check_known("anchor", anchor, (*ANCHORS, "given"))
    if max_groups is not None:
        max_groups = _checked_count("max_groups", max_groups)
    for name, value in (("height_m", height_m), ("noise_px", noise_px), ("group_m", group_m)):
        if value is not None:
            _checked_numbers(name, value, dimensions=0)
    distance_m, distance_sd_m = _checked_distances(distance_m, distance_sd_m)
    if moving_direction is not None:
        moving_direction = _checked_direction(moving_direction)
    if lengths is not None and height_m is not None:
        raise ValueError("give either lengths or a height")
    if distance_m is None and anchor == "given":
        raise ValueError("the anchor 'given' needs a distance")
    if distance_m is not None and anchor not in (None, "auto", "given"):
        raise ValueError(f"a distance is given: leave the anchor {anchor} out")
    if isinstance(lengths, str | PathLike):
        lengths = read_lengths(lengths)
    elif lengths is not None:
        lengths = checked_lengths("lengths", lengths)
    if not isinstance(keypoints, Keypoints):
        keypoints = read_keypoints(keypoints, fps=fps, layout=layout, person=person)
    elif (fps, layout, person) != (None, None, None):
        raise ValueError("fps, layout and person apply to keypoints read from a file only")
    _check_joints_there(keypoints)
    keypoints.check_pixels()
    tracked: TrackedPerson | None = None
    own_height_m = height_m
    if track is not None:
        if camera is not None or distance_m is not None or anchor not in (None, "auto", "given"):
            raise ValueError("the track has a camera and distances: leave camera, distance and anchor out")
        tracked = tracked_person(track, keypoints)
        camera = tracked.camera
        distance_m, distance_sd_m = tracked.distance_m, tracked.distance_sd_m
        if lengths is None and height_m is None:
            height_m = tracked.height_m
        moving_direction = moving_direction or tracked.moving_direction
    size = _size_of(keypoints, camera, fov_deg)
    repair = sides.unswap(keypoints) if unswap else None
    used = keypoints if repair is None else repair.keypoints
    points_px, weights = _stick_points(used)
    found = _memo.posture(
        used.times_s,
        points_px,
        weights,
        camera,
        size=size,
        fov_deg=fov_deg,
        lengths=lengths,
        height_m=height_m,
        noise_px=noise_px,
        rules=rules and rules.replace("-", "_"),
        strength=strength,
        anchor="given" if distance_m is not None else anchor,
        distance_m=distance_m,
        distance_sd_m=distance_sd_m,
        moving_direction=moving_direction,
        head_points=_points_seen(_memo.head_points, used, 1),
        foot_points=_points_seen(_memo.foot_points, used, 0),
        group_m=group_m,
        max_groups=max_groups,
        keep_all=keep_all,
        progress=progress,
    )
    postures = _named(found, used, camera is None, points_px, weights, repair, keep_all)
    if tracked is not None:
        postures = _with_track(postures, tracked, own_height_m)
    for warning in postures.warnings:
        _log.warning("%s", warning)
    return postures


def _with_track(postures: Postures, tracked: TrackedPerson, height_m: float | None) -> Postures:
    """Names the track as the source of what is from it; warns of a given height that contradicts it."""
    is_own = height_m is None and postures.scale_from == "height"
    warnings = postures.warnings
    if height_m is not None:
        sd_m = math.hypot(tracked.height_sd_m, GIVEN_HEIGHT_SD * height_m)
        if abs(height_m - tracked.height_m) > 3 * sd_m:
            warnings += (
                f"the height given, {height_m:.2f} m, and that of the tracked walk, "
                f"{tracked.height_m:.2f} m, differ by more than three standard deviations ({sd_m:.2f} m)",
            )
    sources = tuple("track" if source == "given" else source for source in postures.anchor_source)
    return replace(
        postures,
        scale_from="track" if is_own else postures.scale_from,
        anchor_source=sources,
        warnings=warnings,
    )


def _check_known(what: str, value: str | None, known: Sequence[str]) -> None:
    if value is None:
        return
    if not isinstance(value, str):
        raise TypeError(f"{what} must be a name, one of {', '.join(known)}, got {_shown(value)}")
    if value.replace("_", "-") not in known:
        raise ValueError(f"{what} must be one of {', '.join(known)}, got {_shown(value)}")


def _shown(value: object) -> str:
    return " ".join(str(value).split())[:60]


def _checked_count(what: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{what} must be a whole number, got {_shown(value)}")
    if not 0 <= value <= _MOST_GROUPS:
        raise ValueError(f"{what} must be 0 to {_MOST_GROUPS}, got {value}")
    return int(value)


def _checked_numbers(what: str, value: Any, dimensions: int) -> Array:
    """Numbers in an array of at most this many dimensions."""
    try:
        numbers = np.asarray(value)
        is_numeric = numbers.dtype.kind in "iuf"
    except ValueError:  # rows of different lengths
        is_numeric = False
    if not is_numeric or numbers.ndim > dimensions:
        wanted = "a number or one per frame" if dimensions else "a number"
        raise TypeError(f"{what} must be {wanted}, got {_shown(value)}")
    return numbers.astype(np.float64)


def _checked_distances(distance_m: Any, distance_sd_m: float | None) -> tuple[Any, float | None]:
    if distance_sd_m is not None:
        sd_m = float(_checked_numbers("distance_sd_m", distance_sd_m, dimensions=0))
        if distance_m is None:
            raise ValueError(f"distance_sd_m needs distance_m, got {sd_m:g} alone")
        if not 0 < sd_m <= _DISTANCES_M[1]:
            raise ValueError(
                f"distance_sd_m must be positive and at most {_DISTANCES_M[1]:g} m, got {sd_m:g}"
            )
        distance_sd_m = sd_m
    if distance_m is None:
        return None, None
    distances_m = _checked_numbers("distance_m", distance_m, dimensions=1)
    if distances_m.ndim == 0 and np.isnan(distances_m):
        raise ValueError("distance_m must be a distance, got nan")
    least_m, most_m = _DISTANCES_M
    wrong = distances_m[~np.isnan(distances_m) & ~((distances_m >= least_m) & (distances_m <= most_m))]
    if wrong.size:
        raise ValueError(
            f"distance_m must be {least_m:g} to {most_m:g} m (NaN: unknown), got {wrong.flat[0]:g}"
        )
    return (distances_m if distances_m.ndim else float(distances_m)), distance_sd_m


def _checked_direction(direction: Any) -> list[float]:
    numbers = _checked_numbers("moving_direction", direction, dimensions=1)
    if numbers.shape != (3,):
        raise ValueError(f"moving_direction must be three numbers, got {_shown(direction)}")
    return [float(number) for number in numbers]


def _detector(keypoints: Keypoints) -> str | list[str]:
    return list(keypoints.names) if keypoints.layout is None else keypoints.layout


def _check_joints_there(keypoints: Keypoints) -> None:
    """Refuses keypoints in which a joint of the figure has no corresponding point."""
    count = len(keypoints.names)
    everywhere, _ = _memo.stick_joints(_detector(keypoints), np.ones((1, count, 2)), np.ones((1, count)))
    joints = _memo.joint_names()
    absent = [name for name, point in zip(joints, everywhere[0], strict=True) if np.isnan(point).any()]
    if absent:
        raise KeypointsError(
            f"{keypoints.source.path}: no point for {', '.join(absent)}; it has {', '.join(keypoints.names)}"
        )


def _size_of(
    keypoints: Keypoints, camera: _memo.Camera | None, fov_deg: float | None
) -> tuple[int, int] | None:
    """Without a camera, the size of the picture for the assumed one; a camera must be for that size."""
    if camera is None:
        if keypoints.image_size is None:
            raise ValueError(
                "without a camera, the size of the picture is needed: give image_size to read_keypoints"
            )
        if fov_deg is not None and not 5 <= float(_checked_numbers("fov_deg", fov_deg, dimensions=0)) <= 170:
            raise ValueError(f"fov_deg must be a field of view of 5 to 170 degrees, got {fov_deg:g}")
        return keypoints.image_size
    if fov_deg is not None:
        raise ValueError("the camera already has a field of view: leave fov_deg out")
    if keypoints.image_size is None or keypoints.image_size == tuple(camera.size):
        return None
    (width, height), (own_width, own_height) = camera.size, keypoints.image_size
    raise ValueError(
        f"the camera is for {width}x{height} pixels, the keypoints are for {own_width}x{own_height}"
    )


def _head_down(linked_m: Array) -> list[str]:
    """A warning if the neck is below the pelvis in the motion found, as happens if v increases upwards."""
    joints = _memo.joint_names()
    above_m = linked_m[:, joints.index("neck"), 2] - linked_m[:, joints.index("pelvis"), 2]
    known = np.isfinite(above_m)
    upside_down = int((above_m[known] < 0).sum())
    if 2 * upside_down <= known.sum():
        return []
    return [
        f"the neck is below the pelvis in {upside_down} of {counted(int(known.sum()), 'frame')}: "
        "v of the keypoints must increase downwards"
    ]


def _stick_points(keypoints: Keypoints) -> tuple[Array, Array]:
    """The 14 joints (T, 14, 2) and their weights (T, 14)."""
    # Older AlphaPose scores go up to 6; the core takes weights from 0 to 1.
    scores = np.clip(keypoints.scores, 0, 1)
    return _memo.stick_joints(_detector(keypoints), keypoints.points, scores)


def _points_seen(part: Callable[..., tuple[Array, Array]], keypoints: Keypoints, first: int) -> Array | None:
    """The points of head or feet, if any from the first on is visible: the head's neck alone shows none."""
    points_px, _ = part(_detector(keypoints), keypoints.points, np.clip(keypoints.scores, 0, 1))
    return points_px if np.isfinite(points_px[:, first:]).any() else None


def _named(
    found: _memo.PostureSequence,
    keypoints: Keypoints,
    camera_assumed: bool,
    points_px: Array,
    weights: Array,
    repair: sides.SideRepair | None,
    keep_all: bool,
) -> Postures:
    second = found.second
    return Postures(
        frames=keypoints.frames,
        times_s=keypoints.times_s,
        joints=tuple(_memo.joint_names()),
        camera=found.camera,
        camera_assumed=camera_assumed,
        points_px=points_px,
        weights=weights,
        lengths_m=found.lengths_m,
        length_sd_m=found.length_sd_m,
        length_basis=found.length_basis,
        scale_from=found.scale_from,
        anchor_m=found.anchor_m,
        anchor_sd_m=found.anchor_sd_m,
        anchor_source=tuple(found.anchor_source),
        anchor_conflicts=tuple(found.anchor_conflicts),
        level_reached=found.level_reached,
        level_survived=found.level_survived,
        level_without_root=found.level_without_root,
        reasons=tuple(tuple(Reason(*row) for row in frame) for frame in found.reasons),
        reason_totals=tuple(ReasonTotal(*row) for row in found.reason_totals),
        survivors=found.survivors,
        groups_m=tuple(found.groups_m),
        group_sizes=tuple(found.group_sizes),
        group_counts=tuple(found.group_counts),
        interpretations=tuple(
            Interpretations(survivors_m, cut_m, tuple(cut_by))
            for survivors_m, cut_m, cut_by in found.interpretations
        )
        if keep_all
        else None,
        problems=tuple(found.problems),
        cut_all=tuple(None if why is None else tuple(why) for why in found.cut_all),
        linked_m=found.linked_m,
        linked_breaks=tuple(map(tuple, found.linked_breaks)),
        smoothed_m=found.smoothed_m,
        toes_m=found.toes_m,
        angles_deg=found.angles_deg,
        sd_m=found.sd_m,
        gap_m=found.gap_m,
        margin_nats=found.margin_nats,
        p_mirrored=found.p_mirrored,
        second=None
        if second is None
        else SecondBest(
            joints=tuple(second.joints),
            first_frame=int(keypoints.frames[second.first_row]),
            last_frame=int(keypoints.frames[second.first_row + len(second.postures_m) - 1]),
            postures_m=second.postures_m,
            margin_nats=second.margin_nats,
            p=second.p,
        ),
        heading_source=found.heading_source,
        rules=found.rules.replace("_", "-"),
        warnings=(*keypoints.doubts, *_head_down(found.linked_m), *found.warnings),
        repair=repair,
    )
