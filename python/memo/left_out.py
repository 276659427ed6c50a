"""Who moved and was not followed: frames, boxes in the picture, and the reason in a sentence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo.wording import counted

if TYPE_CHECKING:
    from memo import _memo

__all__ = ["LeftOut", "left_out_sentences", "over_ground", "stays_in_place", "too_far_apart"]

_MOST_SENTENCES = 3
_NOBODY_MPS = 12.0
"""Nobody runs faster than this: a thing, or a camera that moved, is."""
_WHOLE = 0.8
"""Boxes at least this high, as a share of the median height, show all of somebody."""
_LEAST_ON_THE_SPOT = 40
"""A walk on a treadmill starts after so many frames (`TrackerOptions::path_frames` of the core)."""


@dataclass(frozen=True)
class LeftOut:
    """Somebody or something that moved and was not followed.

    Frames and pixels are those of the `Track`.
    """

    first_frame: int
    last_frame: int
    start_s: float
    """Time of the first frame, seconds."""
    end_s: float
    """Time of the last frame, seconds."""
    frames: int
    """Number of frames in which it was seen."""
    boxes: npt.NDArray[np.int64]
    """Up to 16 rows from the first frame to the last: frame, left, top, width and height, pixels."""
    reason: str
    """"cut off", "too small", "wrong size", "other height", "too wide", "too slow", "too fast",
    "not walking", "too brief", "beside somebody", "too many", "frames too far apart" or "over ground"."""
    value: float | None
    """The figure of the reason: height in pixels or metres, speed in m/s (across the picture, or over the
    ground for "over ground"), seconds, or a number of frames."""

    @property
    def sentence(self) -> str:
        """The reason in a sentence."""
        return _SENTENCES[self.reason](self)

    @property
    def place(self) -> tuple[int, int, int]:
        """The middle of the box, pixels, and its frame, in the middle of its time."""
        frame, left, top, width, height = self.boxes[len(self.boxes) // 2].tolist()
        return left + width // 2, top + height // 2, frame

    @property
    def record(self) -> dict[str, Any]:
        """All of it for `run.json`."""
        return {
            "first_frame": self.first_frame,
            "last_frame": self.last_frame,
            "start_s": self.start_s,
            "end_s": self.end_s,
            "frames": self.frames,
            "reason": self.reason,
            "value": self.value,
            "sentence": self.sentence,
            "boxes": self.boxes.tolist(),
        }

    @classmethod
    def of(cls, found: _memo.LeftOut) -> LeftOut:
        """One that the core found, in frames and pixels as given to the tracker."""
        return cls(
            first_frame=found.first_frame,
            last_frame=found.last_frame,
            start_s=found.start_s,
            end_s=found.end_s,
            frames=found.frames,
            boxes=np.array(found.boxes, np.int64).reshape(-1, 5),
            reason=found.reason,
            value=found.value,
        )

    def of_video(self, shrink: int, first_frame: int = 0) -> LeftOut:
        """The same in pixels of a video whose frames were averaged `shrink` by `shrink`, and whose frame
        `first_frame` was the first one given to the tracker."""
        of_pixels = self.reason == "too small" and self.value is not None
        return replace(
            self,
            first_frame=self.first_frame + first_frame,
            last_frame=self.last_frame + first_frame,
            boxes=self.boxes * np.array([1, *4 * [shrink]]) + np.array([first_frame, 0, 0, 0, 0]),
            value=self.value * shrink if of_pixels and self.value is not None else self.value,
        )


def left_out_sentences(left_out: Sequence[LeftOut], count: int) -> list[str]:
    """How many were left out, and why those who were seen longest; `count` is that of all."""
    if not left_out:
        return []
    longest = sorted(left_out, key=lambda left: -left.frames)[:_MOST_SENTENCES]
    which = "" if len(longest) == count else f" The {len(longest)} seen longest:"
    people = counted(count, "moving person or thing was", "moving people or things were")
    said = [f"{people} not followed.{which}"]
    for left in longest:
        u_px, v_px, frame = left.place
        when = f"Frames {left.first_frame} to {left.last_frame}, at {u_px},{v_px} in frame {frame}"
        said.append(f"{when}: {left.sentence}")
    return said


def over_ground(left_out: Sequence[LeftOut]) -> str | None:
    """That somebody moved over the ground although a treadmill was asked for; None if nobody did."""
    moved = [left for left in left_out if left.reason == "over ground"]
    if not moved:
        return None
    somebody = _moved(max(moved, key=_metres))
    return f"Nobody walks on a treadmill: somebody {somebody}. Leave --treadmill (treadmill=True) out."


def too_far_apart(left_out: Sequence[LeftOut]) -> str | None:
    """That steps cannot be followed in frames so far apart; None if nobody was left out for this."""
    apart = [left for left in left_out if left.reason == "frames too far apart"]
    return f"Nobody was seen walking: {_apart(apart[0])}" if apart else None


def stays_in_place(left: LeftOut) -> bool:
    """Whether it was refused as a walk over the ground, but may be one on a treadmill by its boxes: they are
    there for long enough, at one place and equally high."""
    if left.reason not in ("not walking", "too slow") or left.frames < _LEAST_ON_THE_SPOT:
        return False
    heights = left.boxes[:, 4]
    whole = left.boxes[heights >= _WHOLE * np.median(heights)]
    middles, heights = whole[:, 1] + whole[:, 3] / 2, whole[:, 4]
    return bool(2 * np.ptp(middles) < np.median(heights) and _WHOLE * heights.max() < heights.min())


def _apart(left: LeftOut) -> str:
    return (
        f"the frames are {left.value or 0:.2g} s apart, and steps can be followed only in frames that are at "
        "most 0.25 s apart. Check the frame rate, and that times are in seconds."
    )


def _metres(left: LeftOut) -> float:
    return (left.value or 0.0) * (left.end_s - left.start_s)


def _moved(left: LeftOut) -> str:
    return f"moves over the ground by {_metres(left):.1f} m, at {left.value or 0.0:.2f} m/s"


def _fast(left: LeftOut) -> str:
    if left.value is not None and left.value > _NOBODY_MPS:
        return "it moved across the picture faster than anybody runs: it is a thing, or the camera moved."
    return f"it moved across the picture at {left.value or 0:.1f} m/s, faster than people walk."


_SENTENCES: dict[str, Callable[[LeftOut], str]] = {
    "cut off": lambda left: "the border of the picture cut it off.",
    "too small": lambda left: f"only {left.value or 0:.0f} px high, too small to see limbs.",
    "wrong size": lambda left: "too small or too large for a person who stands on the ground there.",
    "other height": lambda left: (
        f"it is {left.value or 0:.2f} m tall where it stands on the ground, and no walk of somebody of the "
        "given height fits it: check height and camera."
    ),
    "too wide": lambda left: "wider than one person: several people who move as one region, or a thing.",
    "too slow": lambda left: (
        f"it hardly moved across the picture ({left.value or 0:.2f} m/s), and no walk on a treadmill, "
        "towards the camera or away from it was found."
    ),
    "too fast": _fast,
    "not walking": lambda left: "its contours do not fit a person who walks.",
    "too brief": lambda left: (
        f"wholly visible and apart from others in at most {counted(left.value or 0, 'frame')} in a row, too "
        "few to start."
    ),
    "beside somebody": lambda left: "it was not told apart from somebody who was followed there.",
    "too many": lambda left: "eight larger regions moved at the same time; no more are looked at.",
    "frames too far apart": _apart,
    "over ground": lambda left: f"somebody {_moved(left)}, and not on a treadmill.",
}
