"""A camera that pans: its field of view, and how its frames must be tracked again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from itertools import islice
from typing import Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.camera_motion import CameraMotion, FieldOfView

__all__ = ["again", "field_of_view"]


def field_of_view(frames: Iterable[npt.NDArray[np.uint8]]) -> FieldOfView | None:
    """Measures the horizontal field of view of a camera that pans.

    `frames` are (H, W) uint8, from when the camera begins to turn; after 500 frames, or when the middle
    of the picture has moved by two fifths of its longer side, no more are read. The camera turns in its
    place, by at least a sixth of the picture, before a background with texture. Returns None if it does
    not, or if no field of view explains the frames better than others. Pixels are taken to be square,
    and the lens to bend no straight lines. `memo.track` and `memo.Tracker` take the result as
    `fov_deg`.
    """
    seeker = _memo.FieldSeeker()
    for frame in frames:
        if not seeker.update(frame):
            break
    found = seeker.found()
    return None if found is None else FieldOfView(*found)


def again(
    motion: CameraMotion,
    options: Mapping[str, Any],
    frames: Callable[[], Iterable[npt.NDArray[np.uint8]]],
) -> dict[str, Any]:
    """The options of `Tracker` with which frames should be tracked again; none if they need not be.

    `motion` is that of a track with `options`, whose `fov_deg` and `reach_px` are absent or None if they were
    not given. `frames` reads the same frames once more.
    """
    if not motion.moved:
        return {}
    is_assumed = options.get("camera") is None and options.get("fov_deg") is None
    if is_assumed and (motion.is_unexplained or motion.wider is not None):
        turned = next((k for k, row in enumerate(motion.rows) if row.state != "still"), 0)
        measured = field_of_view(islice(frames(), max(turned - 1, 0), None))
        if measured is not None:
            return {"fov_deg": measured}
    return {} if options.get("reach_px") is not None else dict(motion.wider or {})
