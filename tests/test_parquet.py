"""Parquet tables: units in the metadata, read by pyarrow, pandas and fastparquet, and what is refused."""

import subprocess
import sys
from decimal import Decimal

import fastparquet
import memo
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from memo.files import TRACK_COLUMNS, read_columns_csv, read_track, write_columns_csv, write_track_csv
from memo.formats import FormatError, Motion, read_motion, write_motion
from memo.formats.parquet import read_parquet, write_parquet
from memo.table import column_unit


def track_columns(count=20):
    rng = np.random.default_rng(3)
    columns = {name: np.round(rng.normal(size=count), 2) for name in TRACK_COLUMNS}
    columns["x_m"][4] = np.nan
    whole = {name: np.zeros(count, np.int64) for name in ("walk", "person")}
    return columns | {"frame": np.arange(count)} | whole


GAIT = {
    "walk": np.array([0, 0]),
    "parameter": np.array(["cadence", "stride_length"]),
    "side": np.array(["", "right"], object),
    "value": np.array([112.0, np.nan]),
    "unit": np.array(["1/min", "m"]),
    "ci_low": np.array([110.0, np.nan]),
    "n": np.array([4, ""], object),
}


def test_units_are_in_the_metadata_of_columns(tmp_path):
    write_parquet(
        tmp_path / "a.parquet", track_columns(), units={"walk": "1", "person": "1"}, about={"table": "track"}
    )
    schema = pq.read_schema(tmp_path / "a.parquet")
    units = {field.name: (field.metadata or {}).get(b"unit") for field in schema}
    assert units["x_m"] == b"m" and units["time_s"] == b"s" and units["right_knee_deg"] == b"deg"
    assert units["heading_rad"] == b"rad" and units["speed_mps"] == b"m/s" and units["left_hip_u_px"] == b"px"
    assert units["phase"] == b"cycle" and units["p_swapped"] == b"1" and units["walk"] == b"1"
    assert units["sd_x_m"] == b"m" and units["sd_phase"] == b"cycle" and units["frame"] is None
    assert all(units[name] for name in TRACK_COLUMNS if name != "frame")
    assert schema.metadata[b"memo"].decode() == memo.__version__ and schema.metadata[b"table"] == b"track"


@pytest.mark.parametrize("read", [pd.read_parquet, lambda path: fastparquet.ParquetFile(path).to_pandas()])
def test_tables_are_read_by_pandas_and_fastparquet(tmp_path, read):
    columns = track_columns()
    write_parquet(tmp_path / "a.parquet", columns)
    table = read(str(tmp_path / "a.parquet"))
    assert list(table.columns) == list(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(table[name].to_numpy(), values)
    assert pq.read_table(tmp_path / "a.parquet")["x_m"].null_count == 1  # unknown is null, not NaN


def test_texts_and_empty_cells(tmp_path):
    write_parquet(tmp_path / "a.parquet", GAIT)
    kinds = dict(
        zip(*(lambda s: (s.names, map(str, s.types)))(pq.read_schema(tmp_path / "a.parquet")), strict=True)
    )
    assert kinds["parameter"] == "string" and kinds["value"] == "double" and kinds["n"] == "int64"
    found = read_parquet(tmp_path / "a.parquet")
    assert found["side"].tolist() == ["", "right"] and found["unit"].tolist() == ["1/min", "m"]
    np.testing.assert_array_equal(found["n"], [4, np.nan])
    np.testing.assert_array_equal(found["value"], GAIT["value"])
    assert found["walk"].dtype == np.int64


def test_a_track_is_read_from_either_file(tmp_path):
    columns = track_columns()
    write_track_csv(tmp_path / "track.csv", columns)
    (tmp_path / "other").mkdir()
    write_parquet(tmp_path / "other" / "track.parquet", columns)
    paths = [tmp_path, tmp_path / "track.csv", tmp_path / "other", tmp_path / "other" / "track.parquet"]
    for path in paths:
        found = read_track(path)
        assert list(found) == list(TRACK_COLUMNS) and found["walk"].dtype == found["frame"].dtype == np.int64
        for name in TRACK_COLUMNS:
            np.testing.assert_array_equal(found[name], columns[name])
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match="a folder without track"):
        read_track(tmp_path / "empty")
    write_parquet(tmp_path / "a.parquet", GAIT)
    with pytest.raises(ValueError, match="columns missing"):
        read_track(tmp_path / "a.parquet")
    write_parquet(tmp_path / "a.parquet", columns | {"x_m": np.array(20 * ["far"])})
    with pytest.raises(ValueError, match="column x_m holds no numbers"):
        read_track(tmp_path / "a.parquet")


def test_every_table_of_a_run_goes_to_parquet(tmp_path):
    write_columns_csv(tmp_path / "a.csv", {"time_s": [0.04, np.nan], "level": [1, 2]})
    (tmp_path / "gait.csv").write_text("walk,parameter,side,value\n0,cadence,,112.5\n0,step_length,right,\n")
    for name, kinds in (("a", "fi"), ("gait", "iOOf")):
        columns = read_columns_csv(tmp_path / f"{name}.csv")
        assert "".join(values.dtype.kind for values in columns.values()) == kinds
        write_parquet(tmp_path / f"{name}.parquet", columns)
        again = read_parquet(tmp_path / f"{name}.parquet")
        assert list(again) == list(columns)
        for column, values in columns.items():
            np.testing.assert_array_equal(again[column], values)
    for text, message in (
        ("", "the names in the header"),
        ("a,a\n", "the names in the header"),
        ("a,b\n1\n", "row 2 has 1 cell, the header 2"),
        (b"\xff\n", "not a table"),
    ):
        (tmp_path / "b.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
        with pytest.raises(ValueError, match=message):
            read_columns_csv(tmp_path / "b.csv")


def test_files_of_others_are_read(tmp_path):
    table = pd.DataFrame(
        {
            "a_m": np.float32([1, 2]),
            "b": pd.Categorical(["x", "y"]),
            "c": [True, False],
            "d": np.uint8([1, 2]),
        }
    )
    table.to_parquet(tmp_path / "a.parquet", compression="gzip")
    fastparquet.write(str(tmp_path / "b.parquet"), table)
    for name in ("a", "b"):
        found = read_parquet(tmp_path / f"{name}.parquet")
        assert [values.tolist() for values in found.values()] == [[1, 2], ["x", "y"], [True, False], [1, 2]]
        assert found["a_m"].dtype == np.float64 and found["d"].dtype == np.int64


def test_decimals_dates_and_columns_of_nulls_are_read(tmp_path):
    table = pa.table(
        {
            "time_s": pa.array([Decimal(0), Decimal(4), Decimal(8)], pa.decimal128(10, 2)),
            "head_x_m": pa.array([1.5, None, float("nan")]),
            "head_y_m": pa.array([1.0, 1.0, 1.0], pa.float32()),
            "head_z_m": pa.array([1, None, 2], pa.int16()),
            "when": pa.array([0, 1, None], pa.timestamp("us")),
            "nothing": pa.nulls(3),
        }
    )
    pq.write_table(table, tmp_path / "a.parquet")
    found = read_parquet(tmp_path / "a.parquet")
    assert found["time_s"].dtype == np.float64 and found["time_s"].tolist() == [0, 4, 8]
    assert np.isnan(found["nothing"]).all() and np.isnan(found["head_x_m"][1:]).all()
    assert found["when"].tolist() == ["1970-01-01 00:00:00.000000", "1970-01-01 00:00:00.000001", ""]
    motion = read_motion(tmp_path / "a.parquet")
    assert motion.names == ("head",) and motion.times_s.tolist() == [0, 4, 8]
    assert np.isnan(motion.points[1:]).all() and motion.points[0, 0].tolist() == [1.5, 1, 1]


@pytest.mark.parametrize("reader", ["polars", "duckdb"])
def test_other_engines_read_null_and_write_what_memo_reads(tmp_path, reader):
    engine = pytest.importorskip(reader)
    points = np.arange(6.0).reshape(2, 1, 3)
    points[1] = np.nan
    motion = Motion(("head",), np.array([0.0, 0.04]), points)
    path, back = tmp_path / "a.parquet", tmp_path / "b.parquet"
    write_motion(path, motion)
    if reader == "polars":
        table = engine.read_parquet(path)
        assert table["head_x_m"].null_count() == 1 and table["head_x_m"].dtype == engine.Float64
        table.write_parquet(back)
    else:
        assert engine.sql(f"select count(head_x_m), avg(head_x_m) from '{path}'").fetchall() == [(1, 0.0)]
        engine.sql(f"copy (select *, 0.04 * time_s::decimal(9, 2) as d from '{path}') to '{back}'")
    read = read_motion(back)
    assert np.array_equal(read.points, points, equal_nan=True) and read.times_s.tolist() == [0, 0.04]


def test_what_cannot_be_read_is_refused(tmp_path):
    path = tmp_path / "a.parquet"
    with pytest.raises(FormatError, match="no such file"):
        read_parquet(path)
    with pytest.raises(FormatError, match="not Parquet that can be read"):
        read_parquet(tmp_path)
    for data in (b"", b"PAR1", b"frame,x\n1,2\n", b"PAR1\xff\xff\xff\x7fPAR1"):
        path.write_bytes(data)
        with pytest.raises(FormatError, match="not Parquet that can be read") as error:
            read_parquet(path)
        assert str(path) in str(error.value) and "\n" not in str(error.value)
    pq.write_table(pa.table({"a": pa.array([[1], [2, 3]])}), path)
    with pytest.raises(FormatError, match=r"column a: list<.*> is neither number, text nor truth value"):
        read_parquet(path)
    pq.write_table(pa.table([pa.array([1]), pa.array([2])], names=["a", "a"]), path)
    with pytest.raises(FormatError, match="appears twice"):
        read_parquet(path)
    pq.write_table(pa.table({"a": pa.array([2**63], pa.uint64())}), path)
    with pytest.raises(FormatError, match="not Parquet that can be read"):
        read_parquet(path)


def test_what_cannot_be_written_is_refused_and_leaves_nothing(tmp_path):
    for columns, message in [
        ({"a": [1, 2], "b": [1]}, "columns of one length"),
        ({}, "columns of one length"),
        ({"a": np.ones((2, 2))}, r"column a: wanted one value per row, got shape \(2, 2\)"),
        ({"a": np.ones(2, complex)}, "column a"),
    ]:
        with pytest.raises(FormatError, match=message):
            write_parquet(tmp_path / "a.parquet", columns)
    assert list(tmp_path.iterdir()) == []


def test_without_pyarrow_the_extra_is_named(tmp_path):
    code = f"""
import sys
from decimal import Decimal
sys.modules["pyarrow"] = None
from memo.formats import FormatError, parquet
try:
    parquet.write_parquet({str(tmp_path / "a.parquet")!r}, {{"a": [1]}})
except FormatError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == 'Parquet needs pyarrow: pip install "pyarrow>=17"\n'


def test_units_of_names():
    assert (
        column_unit("cadence_per_min") == "1/min"
        and column_unit("reason") is None
        and column_unit("rate_hz") == "Hz"
    )
    assert (
        column_unit("margin_nats") == "nat"
        and column_unit("anchor_sd_m") == "m"
        and column_unit("stance_percent") == "%"
    )
