"""Keypoints in the order of points of another detector."""

from __future__ import annotations

import numpy as np

from memo.keypoints.points import Array, Keypoints, check_finite, layouts

__all__ = ["in_layout"]

#: Points that detectors define as the middle of two others.
_MIDDLES = {"neck": ("right_shoulder", "left_shoulder"), "mid_hip": ("right_hip", "left_hip")}


def in_layout(keypoints: Keypoints, layout: str) -> tuple[Array, tuple[str, ...]]:
    """(T, K, 3) x, y, score in the order of a layout, 0, 0, 0 if missing; and the joints it cannot store.

    If the keypoints have no neck or middle of the hips, it is the middle of the shoulders or hips, as in the
    training data of BODY_25, with the smaller of the two scores. No other point is made up.
    """
    check_finite(keypoints)
    values = np.dstack([keypoints.points, keypoints.scores])
    own = {name: values[:, index] for index, name in enumerate(keypoints.names)}
    for name, sides in _MIDDLES.items():
        if name not in own and all(side in own for side in sides):
            right, left = (own[side] for side in sides)
            own[name] = np.column_stack(
                [(right[:, :2] + left[:, :2]) / 2, np.minimum(right[:, 2], left[:, 2])]
            )
    names = layouts()[layout]
    placed = np.zeros((len(values), len(names), 3))
    for index, name in enumerate(names):
        if name in own:
            placed[:, index] = own[name]
    placed[np.isnan(placed[..., :2]).any(axis=2)] = 0
    return placed, tuple(name for name in keypoints.names if name not in names)
