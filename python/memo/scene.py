"""The synthetic scene of `memo demo`: a walker whose motion is known exactly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import ANGLES, JOINTS, SIDES
from memo.table import data_frame
from memo.wording import counted

if TYPE_CHECKING:
    import pandas

__all__ = ["DemoScene", "demo_scene"]


@dataclass(frozen=True, repr=False, eq=False)
class DemoScene:
    """Frames with ground truth."""

    #: Grey frames, (T, H, W) uint8.
    frames: npt.NDArray[np.uint8]
    #: Times of the frames, seconds, (T,).
    times_s: npt.NDArray[np.float64]
    camera: _memo.Camera
    #: Body height of the walker, metres.
    height_m: float
    #: Columns of `track.csv` that have a truth, one row per frame with the walker in it.
    truth: dict[str, npt.NDArray[Any]]

    def to_pandas(self) -> pandas.DataFrame:
        """The truth as a `pandas.DataFrame`, a row a frame with the walker in it."""
        return data_frame(self.truth)

    def __repr__(self) -> str:
        frames, height, width = self.frames.shape
        return f"DemoScene({counted(frames, 'frame')} of {width}x{height}, walker of {self.height_m:.2f} m)"


def demo_scene(
    seed: int = 0,
    *,
    frames: int = 80,
    noise_sd: float = 5.0,
    leftward: bool | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> DemoScene:
    """Draws a scene: camera, walker, clothes and wall follow from the seed; `noise_sd` in grey levels.
    `progress` is called with the frames drawn and in all.

    The walker is the model itself, so what tracking reaches here is bounded by the method alone.
    """
    scene = _memo.Scene(seed, frames=frames, noise_sd=noise_sd, leftward=leftward)
    images = []
    for index in range(len(scene)):
        images.append(scene.frame(index))
        if progress is not None:
            progress(index + 1, len(scene))
    drawn = np.stack(images)
    times_s = np.array([scene.time_s(index) for index in range(len(scene))])
    return DemoScene(drawn, times_s, scene.camera, scene.height_m, _truth(scene))


def _truth(scene: _memo.Scene) -> dict[str, npt.NDArray[Any]]:
    rows = [(index, known) for index in range(len(scene)) if (known := scene.truth(index)) is not None]
    phases = np.array([phase for _, (_, phase, _) in rows])
    joints = np.array([points.reshape(12, 3) for _, (_, _, points) in rows])
    pixels = np.array([scene.camera.project(np.ascontiguousarray(points)) for points in joints])
    angles = np.array([scene.angles_deg(phase) for phase in phases])
    columns: dict[str, npt.NDArray[Any]] = {
        "frame": np.array([index for index, _ in rows]),
        "time_s": np.array([scene.time_s(index) for index, _ in rows]),
        "phase": phases,
        "heading_rad": np.full(len(rows), scene.heading_rad),
        "speed_mps": np.full(len(rows), scene.speed_mps),
    }
    torso = np.array([centre for _, (centre, _, _) in rows])
    columns |= {f"{axis}_m": torso[:, k] for k, axis in enumerate("xyz")}
    names = [f"{side}_{angle}_deg" for side in SIDES for angle in ANGLES]
    columns |= {name: angles[:, k] for k, name in enumerate(names)}
    for k, joint in enumerate(JOINTS):
        columns |= {f"{joint}_{axis}_m": joints[:, k, i] for i, axis in enumerate("xyz")}
        columns |= {f"{joint}_{axis}_px": pixels[:, k, i] for i, axis in enumerate("uv")}
    return columns
