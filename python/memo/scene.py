"""Drawn scenes with ground truth: a person in clothes (`memo demo`), and the model itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import JOINTS, SIDES
from memo.notebook import Shown
from memo.table import data_frame
from memo.wording import counted

if TYPE_CHECKING:
    import pandas

__all__ = ["DemoScene", "demo_scene", "model_scene"]

#: Called with the number of frames drawn and the total.
Progress = Callable[[int, int], object]
Columns = dict[str, npt.NDArray[Any]]


@dataclass(frozen=True, repr=False, eq=False)
class DemoScene(Shown):
    """Frames with ground truth."""

    #: Grey frames, (T, H, W) uint8.
    frames: npt.NDArray[np.uint8]
    #: Times of the frames, seconds, (T,).
    times_s: npt.NDArray[np.float64]
    camera: _memo.Camera
    #: Body height of the walker, metres.
    height_m: float
    #: Columns of `track.csv` that have a truth, one row per frame with the walker in it.
    truth: Columns
    #: Columns `time_s`, `event` and `side` of `events.csv`: when the drawn feet touch and leave the floor;
    #: empty for a scene drawn from the model, which has no floor to touch.
    events: Columns = field(default_factory=dict)

    def to_pandas(self) -> pandas.DataFrame:
        """The truth as a `pandas.DataFrame`, one row per frame with the walker in it."""
        return data_frame(self.truth)

    def __repr__(self) -> str:
        frames, height, width = self.frames.shape
        return f"DemoScene({counted(frames, 'frame')} of {width}x{height}, walker of {self.height_m:.2f} m)"


def demo_scene(
    seed: int = 0,
    *,
    frames: int = 80,
    noise_sd: float | None = None,
    leftward: bool | None = None,
    late_left: float | None = None,
    turn_deg: float = 0.0,
    slant_deg: float | None = None,
    pause_s: tuple[float, float] | None = None,
    mover: Literal["walker", "rider", "waver", "trolley", "treadmill"] = "walker",
    progress: Progress | None = None,
) -> DemoScene:
    """Draws a person in clothes who walks through a room, 25 frames per second.

    Body, gait and picture share nothing with the model used in tracking: round limbs in clothes, joint curves
    with deviations of 5 to 10 degrees from the average, unequal sides, a textured wall and a contact shadow.
    Proportions, clothes, gait, heading, camera, room and all options that are None follow from the seed.

    `noise_sd` is the standard deviation of the sensor noise in grey levels, `late_left` the share of a cycle
    by which the left foot strikes late (-0.1 to 0.1), `turn_deg` how far a walker turns to the left in all
    (-229 to 229): the path is an arc. `slant_deg` turns the path out of the image plane, to the left (-91 to
    91): a person who walks to the right goes away at 90. `pause_s` is when and for how long the person stands
    still, in the posture of that moment; before and after it the person is slower. Movers other than a walker
    must be refused by the tracker: a `rider` carried along in one posture, a `waver` who stands and swings
    the arms, a `trolley`; they have no truth. `progress` is called with the number of frames drawn and the
    total.
    """
    scene = _memo.ClothedScene(
        seed,
        frames=frames,
        noise_sd=noise_sd,
        leftward=leftward,
        late_left=late_left,
        turn_rad=float(np.radians(turn_deg)),
        slant_rad=None if slant_deg is None else float(np.radians(slant_deg)),
        pause_s=pause_s,
        mover=mover,
    )
    rows = [(index, *known) for index in range(len(scene)) if (known := scene.truth(index)) is not None]
    truth = _truth(scene, [(index, centre, phase, *pose) for index, centre, phase, pose in rows])
    truth["heading_rad"] = np.array([scene.heading_at(index) for index, *_ in rows], float)
    contacts = scene.contacts()
    events: Columns = {
        "time_s": np.array([time_s for time_s, _, _ in contacts], float),
        "event": np.array([kind for _, kind, _ in contacts], "U11"),
        "side": np.array([side for _, _, side in contacts], "U5"),
    }
    return _drawn(scene, truth, events, progress)


def model_scene(
    seed: int = 0,
    *,
    frames: int = 80,
    noise_sd: float = 5.0,
    leftward: bool | None = None,
    progress: Progress | None = None,
) -> DemoScene:
    """Draws the model itself as a walker before a wall, as in Rohr 1994 (Figs. 23, 26, 27).

    The errors of tracking here come from the method alone, not from differences between people and the model.
    Options as for `demo_scene`.
    """
    scene = _memo.Scene(seed, frames=frames, noise_sd=noise_sd, leftward=leftward)
    rows = [(index, *known) for index in range(len(scene)) if (known := scene.truth(index)) is not None]
    posed = [(index, centre, phase, joints, scene.angles_deg(phase)) for index, centre, phase, joints in rows]
    return _drawn(scene, _truth(scene, posed), {}, progress)


def _drawn(
    scene: _memo.Scene | _memo.ClothedScene, truth: Columns, events: Columns, progress: Progress | None
) -> DemoScene:
    images = []
    for index in range(len(scene)):
        images.append(scene.frame(index))
        if progress is not None:
            progress(index + 1, len(scene))
    times_s = np.array([scene.time_s(index) for index in range(len(scene))])
    return DemoScene(np.stack(images), times_s, scene.camera, scene.height_m, truth, events)


def _truth(
    scene: _memo.Scene | _memo.ClothedScene,
    rows: list[tuple[int, tuple[float, float, float], float, npt.NDArray[np.float64], list[float]]],
) -> Columns:
    """Columns from rows of frame, torso centre, phase, joints (2, 6, 3) and angles in degrees."""
    joints = np.array([points for _, _, _, points, _ in rows]).reshape(-1, 12, 3)
    pixels = np.array([scene.camera.project(np.ascontiguousarray(points)) for points in joints]).reshape(
        -1, 12, 2
    )
    angles = np.array([angles for *_, angles in rows]).reshape(-1, 8)
    torso = np.array([centre for _, centre, *_ in rows]).reshape(-1, 3)
    columns: Columns = {
        "frame": np.array([index for index, *_ in rows], int),
        "time_s": np.array([scene.time_s(index) for index, *_ in rows]),
        "phase": np.array([phase for _, _, phase, *_ in rows]),
        "heading_rad": np.full(len(rows), scene.heading_rad),
        "speed_mps": np.full(len(rows), scene.speed_mps),
    }
    columns |= {f"{axis}_m": torso[:, k] for k, axis in enumerate("xyz")}
    drawn = ("hip", "knee", "shoulder", "elbow")
    names = [f"{side}_{angle}_deg" for side in SIDES for angle in drawn]
    columns |= {name: angles[:, k] for k, name in enumerate(names)}
    for k, joint in enumerate(JOINTS):
        columns |= {f"{joint}_{axis}_m": joints[:, k, i] for i, axis in enumerate("xyz")}
        columns |= {f"{joint}_{axis}_px": pixels[:, k, i] for i, axis in enumerate("uv")}
    return columns
