"""Finds postures of a man who balances on a beam, from a detector's points, and tables their errors.

    python tests/score_detections.py

OpenPose BODY_25B of two cameras, 100 frames at 60 fps, against joints triangulated from four cameras
(Pose2Sim). He does not walk, leans to the sides by up to 44 degrees, and stands 7 cm above the ground. The
detector's points are 8 to 9 px from the triangulated ones, mostly to one side for the whole sequence, so
smoothing does not reduce it.

`height` is his body height by the rule of `score_postures.py` from his triangulated segments, `lengths` the
lengths of these segments. Rules "default" is what `memo.posture` does without being told. Columns as in
`score_postures.py`; `best` is the error of the posture nearest to the truth of those left in each frame,
`stated` the mean stated `p_mirrored` of the limb segments counted in `signs`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import memo
import numpy as np
from conftest import SHARED_DATA
from score_postures import body_height_m, segment_lengths, signs, stick

FOLDER = SHARED_DATA / "keypoints" / "pose2sim_balancing"
CAMERAS = ("cam_02", "cam_04")
RATE_HZ = 60.0


def triangulated() -> np.ndarray:
    """(T, 14, 3) true joints, metres, world axes with Z up."""
    lines = next(FOLDER.glob("*.trc")).read_text(encoding="utf-8").splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name]
    rows = np.array([[float(cell) for cell in line.split("\t")] for line in lines[5:] if line.strip()])
    values = rows[:, 2:].reshape(len(rows), -1, 3)[..., [2, 0, 1]]
    named = {memo._memo.joint_name(name): values[:, k] for k, name in enumerate(names) if name != "Neck"}
    return stick({name: points for name, points in named.items() if name})


def off_cm(got: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Mean distance of the 13 joints other than the neck, both relative to it, per figure."""
    apart = (got - got[..., :1, :]) - (true - true[..., :1, :])
    return 100.0 * np.nanmean(np.linalg.norm(apart, axis=-1)[..., 1:], axis=-1)


def row(name: str, figures: np.ndarray, rules: str | None, **body: object) -> str:
    """One line of the table."""
    camera = memo.Camera.from_toml(FOLDER / "Calib_qualisys.toml", name=name)
    postures = memo.posture(
        FOLDER / f"{name.replace('_', '')}_json", camera, fps=RATE_HZ, rules=rules, keep_all=True, **body
    )
    assert postures.found.all(), "every frame has a posture"
    rays = figures - np.asarray(camera.position)
    depth = np.asarray(camera.rotation)[2]
    flat = rays * ((rays[:, :1] @ depth) / (rays @ depth))[..., None]
    assert postures.interpretations is not None
    left = [found.survivors_m for found in postures.interpretations]
    best = [off_cm(s, true).min() for s, true in zip(left, figures, strict=True) if len(s)]
    stated, mirrored, _ = signs(postures, np.arange(len(figures)), postures.smoothed_m, figures, rays)
    neck_m = np.linalg.norm(rays[:, 0], axis=-1)
    cells = (
        off_cm(postures.smoothed_m, figures).mean(),
        off_cm(postures.linked_m, figures).mean(),
        off_cm(flat, figures).mean(),
        np.mean(best),
        100.0 * mirrored.mean(),
        100.0 * stated.mean(),
        100.0 * (postures.anchor_m - neck_m).mean(),
        100.0 * postures.anchor_sd_m.mean(),
    )
    return f"{name} {next(iter(body)):9} {rules or 'default':9}" + "".join(f"{cell:9.1f}" for cell in cells)


def main() -> int:
    """Prints the table; 1 without the recording."""
    if not Path(FOLDER).is_dir():
        print(f"no keypoints in {FOLDER} (set MEMO_SHARED_DATA)", file=sys.stderr)
        return 1
    figures = triangulated()
    lengths = segment_lengths(figures)
    height_m = round(body_height_m(lengths, figures), 2)
    heads = ("smooth", "linked", "flat", "best", "signs", "stated", "bias", "sd")
    print(f"{'camera':7}{'known':10}{'rules':9}" + "".join(f"{head:>9}" for head in heads), flush=True)
    for rules in ("physical", None):
        for name in CAMERAS:
            print(row(name, figures, rules, height_m=height_m), flush=True)
            print(row(name, figures, rules, lengths=lengths), flush=True)
    print(f"body height {height_m} m; cm, signs and stated in %")
    return 0


if __name__ == "__main__":
    sys.exit(main())
