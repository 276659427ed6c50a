"""Plants what a track says of heights and reads it back from the lines of all walks."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import memo
import numpy as np
import pytest
import score_heights as sh
from score_walks import Clip

CLIP = Clip("somebody", Path("somebody"), 1.80)


def walk(height_m: float | None, sd_m: float = 0.02, *, contradicted: bool = False) -> SimpleNamespace:
    measured = None if height_m is None else SimpleNamespace(height_m=height_m, sd_m=sd_m)
    return SimpleNamespace(measured_height=measured, height_is_contradicted=contradicted)


def track_of(walks: list[SimpleNamespace], rows: list[int]) -> SimpleNamespace:
    return SimpleNamespace(walks=walks, columns={"walk": np.array(rows)})


def said(error_cm: float, sd_cm: float = 2.0, *, contradicted: bool = False) -> sh.Said:
    height_m = CLIP.height_m + 0.01 * error_cm
    found = track_of([walk(height_m, 0.01 * sd_cm, contradicted=contradicted)], [0])
    return sh.said_of(CLIP, found)


def test_the_longest_walk_speaks_for_the_clip():
    found = track_of([walk(1.50), walk(1.83, 0.03, contradicted=True)], [0, 0, 1, 1, 1])
    row = sh.said_of(CLIP, found)
    assert (row.walks, row.is_contradicted, row.sd_m) == (2, True, 0.03)
    assert row.error_cm == pytest.approx(3.0)


def test_nobody_and_a_person_without_a_measured_height_are_not_measured():
    for found in (track_of([], []), track_of([walk(None)], [0, 0])):
        row = sh.said_of(CLIP, found)
        assert math.isnan(row.error_cm) and not row.is_contradicted
        assert sh.report(1.0, [row]) == "1 times the height: measured in 0 of 1 clips"


def test_the_line_counts_what_was_planted():
    rows = [said(3.0), said(-4.0, contradicted=True), said(0.0), sh.said_of(CLIP, track_of([], []))]
    assert sh.report(0.0, rows) == (
        "without a height: measured in 3 of 4 clips, contradicted in 1; "
        "measured minus true -0.3 cm, rms 2.9, worst -4.0; within 1.64 sd 2"
    )


def test_a_drawn_walk_is_measured_through_the_public_call(tmp_path):
    """The names that are read are those of a track, and its height is about that of the person."""
    scene = memo.demo_scene(3)
    found = memo.track(scene.frames, camera=scene.camera, times_s=scene.times_s)
    row = sh.said_of(Clip("demo", tmp_path, scene.height_m), found)
    assert row.walks == 1 and abs(row.error_cm) < 400.0 * row.sd_m
