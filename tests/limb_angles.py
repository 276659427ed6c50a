"""Joint angles of stick figures by their definition, with rotations of SciPy."""

import memo
import numpy as np
from scipy.spatial.transform import Rotation

PLACE = {name: place for place, name in enumerate(memo._memo.joint_names())}


def angles_of(figures):
    """Degrees (T,) by name, as in `Postures.angles_deg`, of (T, 14, 3) figures; knees without their sign."""
    return _of_side(figures, "right") | _of_side(figures, "left")


def ankles_of(figures, toes):
    """Degrees (T,) of the ankles of (T, 14, 3) figures with toes (T, 2, 3), as in `Postures.angles_deg`: by
    how much a foot is turned, about the line of the hips, from where it is when a person stands upright."""
    return {f"{side}_ankle": _ankle(figures, toes[:, k], side) for k, side in enumerate(("right", "left"))}


def _ankle(figures, toe, side):
    shank, foot = _segment(figures, f"{side}_ankle", f"{side}_knee"), toe - figures[:, PLACE[f"{side}_ankle"]]
    up, to_right = _unit(shank), _segment(figures, "left_hip", "right_hip")
    to_right = _unit(to_right - np.sum(to_right * up, axis=1, keepdims=True) * up)
    # In standing the ankle is 0.17, the tip of the toe 0.05 of the shank's length above the ground.
    lower = np.arcsin(0.12 * np.linalg.norm(shank, axis=1) / np.linalg.norm(foot, axis=1))
    standing = np.cos(lower)[:, None] * np.cross(up, to_right) - np.sin(lower)[:, None] * up
    flat = _unit(foot - np.sum(foot * to_right, axis=1, keepdims=True) * to_right)
    return np.degrees(
        np.arctan2(np.sum(to_right * np.cross(standing, flat), axis=1), np.sum(standing * flat, axis=1))
    )


def _of_side(figures, side):
    hip, hip_adduction = _turn(figures, side, "hip", "knee")
    shoulder, shoulder_adduction = _turn(figures, side, "shoulder", "elbow")
    return {
        f"{side}_hip": hip,
        f"{side}_hip_adduction": hip_adduction,
        f"{side}_knee": _bend(figures, side, "hip", "knee", "ankle"),
        f"{side}_shoulder": shoulder,
        f"{side}_shoulder_adduction": shoulder_adduction,
        f"{side}_elbow": _bend(figures, side, "shoulder", "elbow", "wrist"),
    }


def _turn(figures, side, start, end):
    """Flexion and adduction of a limb that hung along the trunk, R_z(flexion) R_x(adduction) (0, -1, 0)."""
    to_right = _unit(_segment(figures, f"left_{start}", f"right_{start}"))
    ahead = _unit(np.cross(_segment(figures, "pelvis", "neck"), to_right))
    axes = np.stack([ahead, np.cross(to_right, ahead), to_right], axis=-1)
    limb = np.einsum("tji,tj->ti", axes, _unit(_segment(figures, f"{side}_{start}", f"{side}_{end}")))
    flexion, about_x = np.arctan2(limb[:, 0], -limb[:, 1]), np.arcsin(np.clip(-limb[:, 2], -1, 1))
    again = Rotation.from_euler("ZX", np.column_stack([flexion, about_x])).apply([0, -1, 0])
    assert np.allclose(again, limb, atol=1e-6)
    return np.degrees(flexion), np.degrees(about_x if side == "right" else -about_x)


def _bend(figures, side, *joints):
    """The angle between two segments, of Kahan's formula."""
    start, middle, end = (f"{side}_{joint}" for joint in joints)
    upper, lower = _unit(_segment(figures, start, middle)), _unit(_segment(figures, middle, end))
    apart, together = (np.linalg.norm(vectors, axis=1) for vectors in (upper - lower, upper + lower))
    return np.degrees(2 * np.arctan2(apart, together))


def _segment(figures, start, end):
    return figures[:, PLACE[end]] - figures[:, PLACE[start]]


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
