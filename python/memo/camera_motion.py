"""The camera in every frame: whether it stood still, how far it turned, and where a view ended."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from memo.files import write_columns_csv
from memo.wording import counted

if TYPE_CHECKING:
    from memo._memo import FrameMotion, LostView

__all__ = ["CAMERA_MOTION_COLUMNS", "CameraMotion", "FieldOfView", "outcome", "write_camera_motion_csv"]

CAMERA_MOTION_COLUMNS = (
    *("frame", "state", "rx_rad", "ry_rad", "rz_rad", "shift_px", "shift_rms_px", "support"),
)
"""Columns of `camera_motion.csv`, in order."""

_STATES = ("still", "turned", "uneven_light", "unknown", "lost")
_TOLD_DEG = 2.0
"""From this angle on, it is said by how much the camera turned, degrees: shakes of hands are smaller."""
_UNEXPLAINED = 0.1
"""From this share of frames without a known turn, or with uneven light, on, they are reported. Of a zoom by
5 % before a wall of bricks nine in ten frames have no known turn; of 25 recordings of a camera that stood
still or shook, none has."""


class FieldOfView(NamedTuple):
    """How much of a scene a picture shows from its left to its right border."""

    horizontal_deg: float
    """The angle between the borders, degrees."""
    sd_deg: float
    """Its standard deviation."""


@dataclass(frozen=True)
class CameraMotion:
    """The camera in the frames of a video; empty if it was not looked for (`steady=False`)."""

    rows: Sequence[FrameMotion] = ()
    """The camera in each frame, in frames and pixels as given to the tracker."""
    lost: Sequence[LostView] = ()
    """Where a view ended."""
    first_frame: int = 0
    """Number in the video of the first frame given."""
    shrink: int = 1
    """Pixels of the video per pixel of a frame, along each axis."""
    camera_given: bool = False
    """Whether a calibration was given."""
    wider: Mapping[str, Any] | None = None
    """Of a camera that pans, the options of `Tracker` with which it sees all of the frames (`reach_px` and
    `reach_from_rad`); None if it did."""
    field_of_view: FieldOfView | None = None
    """The field of view of a camera that is not calibrated, if it was measured in a pan."""

    @property
    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """One array per column of `camera_motion.csv`, in pixels and frames of the video."""
        turns = np.array([row.turn_rad for row in self.rows], np.float64).reshape(-1, 3)
        return {
            "frame": np.array([row.frame + self.first_frame for row in self.rows], np.int64),
            "state": np.array([row.state for row in self.rows], object),
            "rx_rad": turns[:, 0],
            "ry_rad": turns[:, 1],
            "rz_rad": turns[:, 2],
            "shift_px": np.array([row.shift_px * self.shrink for row in self.rows], np.float64),
            "shift_rms_px": np.array([row.rms_px * self.shrink for row in self.rows], np.float64),
            "support": np.array([row.support for row in self.rows], np.float64),
        }

    @property
    def moved(self) -> bool:
        """True if frames were steadied or a view ended."""
        return bool(self.lost) or any(row.state == "turned" for row in self.rows)

    @property
    def is_unexplained(self) -> bool:
        """True if there is texture, but no turn of the camera explains a good part of the frames."""
        return _is_unexplained(_counts([row.state for row in self.rows]))

    @property
    def is_unevenly_lit(self) -> bool:
        """True if in a good part of the frames the light differs from place to place."""
        lit = [row.state == "uneven_light" for row in self.rows]
        return sum(lit) > _UNEXPLAINED * len(lit)

    @property
    def summary(self) -> dict[str, Any]:
        """Number of frames per state, displacement of the steadied frames (pixels), and lost views."""
        columns = self.columns
        counts = _counts(columns["state"].tolist())
        turned = columns["state"] == "turned"
        largest, rms = columns["shift_px"][turned], columns["shift_rms_px"][turned]
        turns_rad = np.linalg.norm([columns[f"r{axis}_rad"][turned] for axis in "xyz"], axis=0)
        return {
            "moved": self.moved,
            "largest_deg": float(np.degrees(turns_rad.max(initial=0.0))),
            "largest_px": float(largest.max()) if turned.any() else 0.0,
            "rms_px": float(np.sqrt(np.mean(rms**2))) if turned.any() else 0.0,
            **counts,
            "lost": [[view.frame + self.first_frame, view.reason] for view in self.lost],
        }

    @property
    def sentences(self) -> list[str]:
        """What to know of a camera that moved; none of one that stood still."""
        summary, said = self.summary, []
        if steadied := summary["frames_turned"]:
            where = "in the frames that could be steadied, " * (outcome(summary) == "beyond")
            turns = f"It turns by up to {summary['largest_deg']:.0f}°. " * (
                summary["largest_deg"] >= _TOLD_DEG
            )
            said.append(
                f"The camera moved: {where}the picture shifts by up to {summary['largest_px']:.1f} px "
                f"({summary['rms_px']:.1f} px root mean square) against the first frame. {turns}"
                f"Of {counted(len(self.rows), 'frame')}, {counted(steadied, 'was', 'were')} turned back."
            )
        if self.field_of_view is not None:
            said.append(
                f"The picture shows {self.field_of_view.horizontal_deg:.1f}° from left to right (standard "
                f"deviation {self.field_of_view.sd_deg:.1f}°), as the camera's pan tells."
            )
        if self.wider is not None:
            said.append(
                "The camera pans, and who was beyond its first view was not followed. With frames that can "
                "be read twice, memo finds out how far; otherwise give "
                + " and ".join(f"{name}={list(value)}" for name, value in self.wider.items())
                + "."
            )
        if self.is_unexplained:
            said.append(
                f"In {counted(summary['frames_unknown'], 'frame')} of {len(self.rows)} the camera did more "
                "than turn, or turned too far, by an unknown amount: perhaps it zoomed or was carried along, "
                "or the background has too little texture. Places, directions and speeds are wrong where it "
                "moved."
            )
        if self.is_unevenly_lit:
            said.append(
                f"In {counted(summary['frames_uneven_light'], 'frame')} of {len(self.rows)} the light is "
                "another one from place to place, perhaps of a lamp that flickers; the camera stood still. "
                "What it lights up can be taken for motion: check the overlay."
            )
        for frame, reason in summary["lost"][:5]:
            said.append(f"{_WHAT[reason].format(frame=frame)} {_THEN[self.camera_given]}")
        if len(summary["lost"]) > 5:
            said.append(f"{counted(len(summary['lost']) - 5, 'more view')} ended like this.")
        return said


def outcome(summary: Mapping[str, Any]) -> str:
    """What `CameraMotion.summary` means for the results: the camera stood "still", its frames were
    "steadied", or it moved "beyond" what can be steadied or a view was lost; empty if it was not looked for.
    """
    if summary["lost"] or _is_unexplained(summary):
        return "beyond"
    if summary["frames_turned"]:
        return "steadied"
    return "still" if any(summary.get(f"frames_{state}") for state in _STATES) else ""


def _counts(states: Sequence[str]) -> dict[str, int]:
    return {f"frames_{state}": states.count(state) for state in _STATES}


def _is_unexplained(counts: Mapping[str, Any]) -> bool:
    unknown, lost = counts["frames_unknown"], counts["frames_lost"]
    total = sum(counts.get(f"frames_{state}", 0) for state in _STATES)
    return bool(total > unknown + lost and unknown > _UNEXPLAINED * total)


_WHAT = {
    "cut": "The view changes at frame {frame} (a cut).",
    "zoom": "The picture is zoomed from about frame {frame} on, or the camera moves forwards or backwards.",
    "other view": "The view is another one from about frame {frame} on.",
}
_THEN = {
    True: "The given camera is that of the first view, so frames of another one are not used.",
    False: "A walk ends there; what follows is tracked as a scene of its own.",
}


def write_camera_motion_csv(path: str | PathLike[str], motion: CameraMotion) -> None:
    """Writes the camera of every frame, one row per frame."""
    write_columns_csv(path, motion.columns)
