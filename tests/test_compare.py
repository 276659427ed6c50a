"""Two walks compared: planted differences are found with their intervals, and only those."""

import numpy as np
import pytest
from memo import _memo
from memo.compare import curve_differences, difference_sentences, parameter_differences
from memo.cycles import cycle_table
from memo.gait import gait_table

PERCENT = np.arange(101)


def cycles(knee_deg, half_deg, *, sides=("right",), joints=(1,)):
    """The table of a walk with only means, of these joints."""
    values = np.full((5, 101, 6), np.nan)
    values[..., 5] = 0
    for joint in joints:
        angle = np.broadcast_to(knee_deg, 101).astype(float)
        values[joint] = np.column_stack(
            [angle, np.ones(101), np.full(101, np.nan), angle - half_deg, angle + half_deg, np.ones(101)]
        )
    return cycle_table([[_memo.GaitCycle(side, "mean", np.nan, np.nan, values) for side in sides]])


def parameters(**values):
    """A table of gait parameters: name to (value, half width)."""
    rows = [(name, "", v, "m", v - half, v + half, 3) for name, (v, half) in values.items()]
    return gait_table([[_memo.GaitParameter(*row) for row in rows]])


def test_intervals_are_combined_and_decide():
    first = parameters(step_length=(0.60, 0.03), stride_length=(1.2, 0.06), speed=(np.nan, np.nan))
    second = parameters(step_length=(0.66, 0.04), stride_length=(1.25, 0.06), speed=(1.0, 0.1))
    step, stride, speed = parameter_differences(first, second, (0, 0))
    assert step.value == pytest.approx(0.06) and step.half == pytest.approx(0.05) and step.is_sure
    assert stride.value == pytest.approx(0.05) and stride.half == pytest.approx(0.06 * 2**0.5)
    assert not stride.is_sure and np.isnan(speed.value) and not speed.is_sure
    assert difference_sentences(("A", "B"), [step, stride, speed], []) == [
        "Step length: 0.060 m (0.010 to 0.110) larger in B than in A."
    ]
    [nearly] = parameter_differences(
        parameters(step_length=(0.6, 0.0)), parameters(step_length=(0.66, 0.0598)), (0, 0)
    )
    assert nearly.value > nearly.half and not nearly.is_sure, "the interval reads 0.000 to 0.120"


def test_of_a_symmetry_both_values_are_told():
    def symmetry(percent, half):
        row = ("step_time_symmetry", "", percent, "%", percent - half, percent + half, 3)
        return gait_table([[_memo.GaitParameter(*row)]])

    [one] = parameter_differences(symmetry(-8.0, 2.0), symmetry(-2.0, 2.0), (0, 0))
    assert one.is_of_a_side
    assert difference_sentences(("A", "B"), [one], []) == [
        "Step time symmetry: -8.0 % in A and -2.0 % in B, a difference of 6.0 % (3.2 to 8.8)."
    ]


def test_curves_differ_where_their_interval_excludes_zero():
    bump = np.where((PERCENT >= 60) & (PERCENT < 80), 20.0, 0.0)
    [knee] = curve_differences(cycles(10.0, 3.0), cycles(10.0 - bump, 4.0, sides=("right", "left")), (0, 0))
    assert (knee.side, knee.joint) == ("right", "knee")
    assert knee.rms_deg == pytest.approx(np.sqrt(np.mean(bump**2)))
    assert knee.sure_share == pytest.approx(20 / 101) and knee.largest == (60, -20.0, pytest.approx(5.0))
    assert difference_sentences(("A", "B"), [], [knee]) == [
        "The right knee is 20° (15 to 25) less flexed in B than in A at 60% of the cycle; its interval "
        "excludes zero for 20% of it."
    ]


def test_differences_that_are_small_short_or_not_judged_are_not_told():
    short = np.where(PERCENT < 5, 20.0, 0.0)
    for first, second in (
        (cycles(10.0, 3.0), cycles(14.9, 4.0)),
        (cycles(10.0, 3.0), cycles(10.0 + short, 4.0)),
        (cycles(10.0, 3.0, joints=(2, 3)), cycles(60.0, 4.0, joints=(2, 3))),
    ):
        curves = curve_differences(first, second, (0, 0))
        assert curves and not any(curve.is_sure for curve in curves)
        assert difference_sentences(("A", "B"), [], curves) == [
            "No difference between the two walks can be told."
        ]


def test_a_table_with_points_outside_the_cycle_is_refused():
    broken = cycles(10.0, 3.0)
    broken["percent"][broken["joint"] == "knee"] += 1
    with pytest.raises(ValueError, match="percent of a cycle must be 0 to 100, got 1 to 101"):
        curve_differences(broken, cycles(10.0, 3.0), (0, 0))
