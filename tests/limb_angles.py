"""Joint angles of stick figures by their definition, with rotations of SciPy."""

import memo
import numpy as np
from scipy.spatial.transform import Rotation

PLACE = {name: place for place, name in enumerate(memo._memo.joint_names())}


def angles_of(figures):
    """Degrees (T,) by name, as in `Postures.angles_deg`, of (T, 14, 3) figures; knees without their sign."""
    return _of_side(figures, "right") | _of_side(figures, "left")


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
