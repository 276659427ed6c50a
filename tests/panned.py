"""Walkers seen by a camera that turns after them: cut out of wider pictures of a camera at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import memo
import numpy as np

WIDTH = 360
"""Of the frames; the wider pictures have 640 columns."""


@dataclass(frozen=True)
class Panned:
    """A walker, and the frames of the camera that turns, with its camera in the first one."""

    scene: Any
    frames: list[Any]
    camera: Any
    turned: list[Any]
    """Rotations from the camera at rest to that of each frame."""
    matrix: Any
    """Of the camera that turns, as OpenCV has it."""

    @property
    def field_of_view_deg(self) -> float:
        """From the left border of a frame to the right one."""
        return float(2 * np.degrees(np.arctan(WIDTH / 2 / self.matrix[0, 0])))


def panned_scene(seed: int) -> Panned:
    """The walker of `memo.demo_scene` before a textured wall."""
    scene = memo.demo_scene(seed)
    given, truth = scene.camera.parameters(), scene.truth
    matrix, height = np.array(given["matrix"]), scene.frames[0].shape[0]
    from_world, shift = cv2.Rodrigues(np.array(given["rotation"]))[0], np.array(given["translation"])
    narrow = matrix.copy()
    narrow[0, 2] = (WIDTH - 1) / 2
    torsos = np.stack([truth[f"{axis}_m"] for axis in "xyz"], axis=1) @ from_world.T + shift
    aside = np.arctan2(torsos[:, 0], torsos[:, 2])
    # As far as the wide picture goes.
    most = np.arctan(matrix[0, 2] / matrix[0, 0]) - np.arctan(WIDTH / 2 / matrix[0, 0])
    turns_rad = np.clip(np.interp(np.arange(len(scene.frames)), truth["frame"], aside), -most, most)
    turned = [cv2.Rodrigues(np.array([0, -turn_rad, 0]))[0] for turn_rad in turns_rad]
    frames = [
        cv2.warpPerspective(
            frame, narrow @ turn @ np.linalg.inv(matrix), (WIDTH, height), flags=cv2.INTER_CUBIC
        )
        for frame, turn in zip(_textured(scene.frames), turned, strict=True)
    ]
    first = {
        "size": [WIDTH, height],
        "matrix": narrow.tolist(),
        "rotation": cv2.Rodrigues(turned[0] @ from_world)[0].ravel().tolist(),
        "translation": (turned[0] @ shift).tolist(),
    }
    return Panned(scene, frames, memo.Camera.from_parameters({**given, **first}), turned, narrow)


def _textured(frames):
    """The same frames with a texture on all that does not move."""
    frames = np.asarray(frames, float)
    wall = np.random.default_rng(3).uniform(-1, 1, frames[0].shape).astype(np.float32)
    wall = cv2.GaussianBlur(wall, None, 2.0)
    empty = np.median(frames, axis=0)
    for frame in frames:
        moves = cv2.medianBlur((np.abs(frame - empty) > 14).astype(np.uint8), 5)
        still = cv2.dilate(moves, np.ones((5, 5))) == 0
        yield np.clip(frame + still * 18 / wall.std() * wall, 0, 255).astype(np.uint8)
