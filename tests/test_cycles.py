"""Gait cycles: against scipy's interpolation and numpy's means; their table, files and sentences."""

from itertools import pairwise

import memo
import numpy as np
import pandas
import pytest
import scipy.interpolate
import score_cycles
from conftest import SHARED_DATA
from memo import _memo
from memo.cycles import (
    CYCLE_COLUMNS,
    cycle_table,
    departure_sentences,
    read_cycles_csv,
    write_cycles_csv,
)
from memo.files import ANGLES


@pytest.fixture(scope="module")
def track():
    scene = memo.demo_scene(0)
    return memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)


def rows_of(table, **wanted):
    """The rows of a table with these values."""
    chosen = np.all([table[name] == value for name, value in wanted.items()], axis=0)
    return {name: values[chosen] for name, values in table.items()}


def test_cycles_are_those_between_contacts_as_scipy_resamples_them(track):
    table, columns, compared = track.cycles, track.columns, 0
    for side in ("right", "left"):
        strikes = [e["time_s"] for e in track.events if e["event"] == "heel_strike" and e["side"] == side]
        assert len(strikes) > 1
        for cycle, (start_s, end_s) in enumerate(pairwise(strikes)):
            for joint in ANGLES:
                rows = rows_of(table, side=side, joint=joint, curve="cycle", cycle=cycle)
                assert rows["percent"].tolist() == list(range(101))
                assert set(rows["start_s"]) == {start_s} and set(rows["end_s"]) == {end_s}
                angle, sd = (columns[f"{first}{side}_{joint}_deg"] for first in ("", "sd_"))
                if not np.isfinite(angle).all():
                    continue
                times_s, at_s = columns["time_s"], np.linspace(start_s, end_s, 101)
                slopes = np.gradient(angle, times_s, edge_order=2)
                cubic = scipy.interpolate.CubicHermiteSpline(times_s, angle, slopes)
                np.testing.assert_allclose(rows["angle_deg"], cubic(at_s), atol=1e-9)
                np.testing.assert_allclose(rows["sd_deg"], np.interp(at_s, times_s, sd), atol=1e-9)
                spline = scipy.interpolate.CubicSpline(times_s, angle)  # nearly the same
                assert np.abs(rows["angle_deg"] - spline(at_s)).max() < 0.5
                compared += 1
    assert compared >= 6


def test_means_are_those_of_numpy_and_within_their_intervals(track):
    table = track.cycles
    for side in ("right", "left"):
        rows = rows_of(table, side=side, joint="knee")
        cycles = rows["angle_deg"][rows["curve"] == "cycle"].reshape(-1, 101)
        sds = rows["sd_deg"][rows["curve"] == "cycle"].reshape(-1, 101)
        mean = rows_of(rows, curve="mean")
        assert set(mean["n"]) == {len(cycles)} and np.isnan(mean["cycle"]).all()
        np.testing.assert_allclose(mean["angle_deg"], cycles.mean(axis=0), atol=1e-9)
        np.testing.assert_allclose(mean["sd_deg"], np.sqrt((sds**2).mean(axis=0)), atol=1e-9)
        if len(cycles) > 1:
            np.testing.assert_allclose(mean["cycle_sd_deg"], cycles.std(axis=0, ddof=1), atol=1e-9)
        else:
            assert np.isnan(mean["cycle_sd_deg"]).all()
        assert (mean["ci_low_deg"] < mean["angle_deg"] - 1.9 * mean["sd_deg"]).all()
        middle = (mean["ci_low_deg"] + mean["ci_high_deg"]) / 2
        np.testing.assert_allclose(middle, mean["angle_deg"], atol=1e-9)


def test_the_table_is_a_data_frame_and_survives_a_file(track, tmp_path):
    table = track.cycles
    frame = track.to_pandas("cycles")
    assert tuple(frame.columns) == CYCLE_COLUMNS and frame.attrs["units"]["angle_deg"] == "deg"
    write_cycles_csv(tmp_path / "cycles.csv", table)
    again = read_cycles_csv(tmp_path / "cycles.csv")
    for name in CYCLE_COLUMNS:
        if again[name].dtype == object:
            assert again[name].tolist() == table[name].tolist()
        else:
            np.testing.assert_allclose(again[name], table[name], atol=0.00501)
    frame.to_parquet(tmp_path / "cycles.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "cycles.parquet"), frame)
    with pytest.raises(ValueError, match=r"table must be one of .*, got 'toes'"):
        track.to_pandas("toes")


def test_cycles_have_the_number_of_the_person(tmp_path):
    curve = _memo.GaitCycle("right", "mean", np.nan, np.nan, np.zeros((5, 101, 6)))
    table = cycle_table([[curve], [curve], [curve]], [0, 1, 0])
    assert table["person"].tolist() == [0] * 505 + [1] * 505 + [0] * 505
    assert cycle_table([[curve], [curve]])["person"].tolist() == [0] * 505 + [1] * 505
    # A table of an older run, without the column.
    header, row = ",".join(n for n in CYCLE_COLUMNS if n != "person"), "2,left,hip,mean,,,,0,1.0,,,,,1"
    (tmp_path / "old.csv").write_text(f"{header}\n{row}\n")
    assert read_cycles_csv(tmp_path / "old.csv")["person"].tolist() == [2]


def test_a_table_without_its_columns_is_refused(tmp_path):
    empty = cycle_table([])
    assert tuple(empty) == CYCLE_COLUMNS and all(len(values) == 0 for values in empty.values())
    with pytest.raises(ValueError, match=r"cycles: missing \['percent'\], unknown \['toe'\]"):
        write_cycles_csv(tmp_path / "c.csv", {("toe" if n == "percent" else n): v for n, v in empty.items()})
    (tmp_path / "bad.csv").write_text("walk,side\n0,right\n")
    with pytest.raises(ValueError, match="columns missing"):
        read_cycles_csv(tmp_path / "bad.csv")


def test_departures_are_said_with_their_interval():
    [said] = departure_sentences([_memo.Departure("left", "knee", -14.6, 5.2, 71, 0.312)])
    assert said == (
        "The left knee is less flexed than in healthy adults: at 71% of the cycle it is 15° below their band "
        "(95% interval 9 to 20°), and the whole interval is outside for 31% of the cycle."
    )
    assert "more flexed" in departure_sentences([_memo.Departure("right", "hip", 6.0, 2.0, 3, 0.1)])[0]
    assert departure_sentences([_memo.Departure("right", "hip", 6.0, 5.7, 3, 0.1)]) == []  # "6° (0 to 12)"


def test_average_walking_is_the_clinical_average_lowered_to_joint_centres():
    for joint, offset in (("hip", 7.7), ("knee", 9.6)):
        average, sd = _memo.normal_cycle(joint).T
        np.testing.assert_allclose(average, score_cycles.clinical(joint) - offset, atol=1e-9)
        assert sd[0] == sd[-1] and 3 < sd.min() < sd.max() < 8
    with pytest.raises(ValueError, match="joint must be 'hip' or 'knee'"):
        _memo.normal_cycle("toe")


@pytest.mark.parametrize("person", ["Gait", "BMC2"])
def test_people_not_used_for_the_correction_are_within_the_band(person):
    if not (SHARED_DATA / "mocap").is_dir():
        pytest.skip(f"no recordings in {SHARED_DATA} (set MEMO_SHARED_DATA)")
    for (_, joint), curve in score_cycles.recorded_curves(person).items():
        assert score_cycles.inside(curve, joint) >= 90
        lowered = curve + {"hip": 7.7, "knee": 9.6}[joint]
        assert score_cycles.inside(curve, joint) >= score_cycles.inside(lowered, joint)
