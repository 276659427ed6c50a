"""CSV files in a spreadsheet: no text of a user's becomes a formula, and memo reads it back as it was.

The judge is written from OWASP's page on CSV injection: it reads a file with Python's own `csv`, split at
commas, semicolons and tabs as spreadsheets of different countries do, and calls a formula what is no number
and begins with one of the characters on that page.
"""

import csv
import io
import math
import re
from pathlib import Path
from types import SimpleNamespace

import memo
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from memo.files import (
    EVENT_COLUMNS,
    FLIP_COLUMNS,
    read_columns_csv,
    read_events_csv,
    read_text_columns,
    read_track_csv,
    write_columns_csv,
    write_events_csv,
    write_flips_csv,
)
from memo.formats import Motion, read_motion, write_motion
from memo.keypoints import read_keypoints
from memo.linkage import Points, read_points_csv, write_points_csv
from memo.reproduce.result import Reproduction, Row, Table, Verdict
from memo.spreadsheet import CsvRows, as_given, harmless, write_rows

NAMES = ("=HYPERLINK(1)", "+1+1", "-2+cmd|' /C calc'!A0", "@SUM(A1)", "\uff1d1+1", "x;=1+1", "'=1", "a")
NASTY = st.text(st.sampled_from("=+-@\t\r\n';, \"ae1.\uff1d\uff20"), max_size=8)
ANY = st.one_of(NASTY, st.text(max_size=8), st.sampled_from(NAMES))


def is_evaluated(cell):
    """Whether a spreadsheet takes the cell for a formula."""
    try:
        return not math.isfinite(float(cell)) and cell[:1] in "+-"
    except ValueError:
        return cell.lstrip().startswith(tuple("=+-@\uff1d\uff0b\uff0d\uff20"))


def formulas(text):
    """The cells of a file's text that may be evaluated, at whichever character its lines are split."""
    rows = {
        delimiter: list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
        for delimiter in ",;\t"
    }
    found = [cell for table in rows.values() for row in table for cell in row if is_evaluated(cell)]
    return found + [cell for row in rows[","] for cell in row if cell.startswith(("\t", "\r", "\n"))]


def formulas_in(path):
    """The cells of a file that may be evaluated."""
    with open(path, newline="", encoding="utf-8") as file:
        return formulas(file.read())


def written(rows, **options):
    file = io.StringIO(newline="")
    write_rows(file, rows, **options)
    return file.getvalue()


def test_the_judge_knows_a_formula():
    assert all(map(is_evaluated, NAMES[:5]))
    assert not any(map(is_evaluated, ["a", "-1.5", "'=1", ""]))
    assert formulas("a,x;=1+1\n") == ["=1+1"]


@given(
    st.lists(st.lists(ANY, min_size=1, max_size=4), max_size=4),
    st.sampled_from(",;\t"),
    st.sampled_from(["\n", "\r\n"]),
)
@example([["'=1", "''=1", "'-1", "-1", "'", "''"]], ",", "\n")
def test_rows_come_back_as_they_were_given(rows, delimiter, line_end):
    text = written(rows, delimiter=delimiter, line_end=line_end)
    assert list(CsvRows(io.StringIO(text, newline=""), delimiter=delimiter)) == rows


@given(st.lists(st.lists(ANY, min_size=1, max_size=4), max_size=4))
def test_no_row_holds_a_formula(rows):
    assert formulas(written(rows)) == []


@given(ANY, ANY)
def test_different_texts_stay_different(one, other):
    assert (harmless(one) == harmless(other)) == (one == other) and as_given(harmless(one)) == one


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers())
def test_numbers_stay_numbers(number, whole):
    for text in (
        repr(number),
        f"{number:.4f}",
        f"{number:+e}",
        str(whole),
        f"+{abs(whole)}",
        f" {number:.2f}",
    ):
        assert harmless(text) == text
    assert written([[number, whole]]) == f"{number!r},{whole}\n"


def test_every_csv_file_is_read_and_written_in_one_place():
    package = Path(memo.__file__).parent
    importers = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if re.search(r"^\s*(import|from) csv\b", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert importers == {"spreadsheet.py"}


# What is written by whom.


def write_all_columns(path):
    names = np.array(NAMES, dtype=object)
    write_columns_csv(path, {"=name": names, "value": -np.arange(8.0)})
    columns = read_columns_csv(path)
    assert columns["=name"].tolist() == list(NAMES) and columns["value"].tolist() == [-x for x in range(8)]


def write_events(path):
    rows = [dict(zip(EVENT_COLUMNS, (0.5, 1.25, name, name, 0, 1), strict=True)) for name in NAMES]
    write_events_csv(path, rows)
    assert read_events_csv(path) == rows


def write_flips(path):
    rows = [dict(zip(FLIP_COLUMNS, (1, 0.5, 2, name, name, name, 0.5, name), strict=True)) for name in NAMES]
    write_flips_csv(path, rows)
    assert read_text_columns(path)["reason"] == list(NAMES)


def write_joints(path):
    motion = Motion(NAMES, np.arange(3) / 10, -np.ones((3, len(NAMES), 3)), angles={"=knee": -np.ones(3)})
    write_motion(path, motion)
    again = read_motion(path)
    assert again.names == NAMES and list(again.angles) == ["=knee"] and (again.points == -1).all()


def write_points(path):
    write_points_csv(path, Points(list(NAMES), np.arange(3) / 10, -np.ones((3, len(NAMES), 2))))
    again = read_points_csv(path, 2)
    assert again.names == list(NAMES) and (again.positions == -1).all()


def write_labels(path):
    write_joints(path.with_name("motion.csv"))
    from memo.cli.pointlight import _write_labels

    display = SimpleNamespace(
        labels=np.array([[0, 1, -1]]),
        limb_ends=np.array([[2, -1, -1]]),
        fractions=np.array([[0.25, 0, 0]]),
        visible=np.ones((1, 3), bool),
    )
    _write_labels(path, list(NAMES), list(NAMES), display)
    columns = read_text_columns(path)
    assert columns["dot"] == list(NAMES[:3]) and columns["shows"] == [*NAMES[:2], "noise"]
    assert columns["limb_end"] == [NAMES[2], "", ""]


def write_keypoints_like(path):
    """A detector's table with a column of somebody else's, written as it was read."""
    source = path.with_name("keypoints.csv")
    rows = [[k, -1.5, "-2", name] for k, name in enumerate(NAMES)]
    with open(source, "w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([["frame", "right_knee_x", "right_knee_y", "=note"], *rows])
    read_keypoints(source, fps=25).write(path)
    assert read_text_columns(path)["=note"] == read_text_columns(source)["=note"]
    assert read_text_columns(path)["right_knee_y"] == ["-2"] * len(NAMES)


def write_rows_of_a_paper(path):
    row = Row("=item", "+quantity", "@printed", "-ours", Verdict.DIFFERS, "=why")
    table = Table("=t", ["=head"], [["-x"]])
    made = Reproduction("paper", "title", "note", [row], [], [table])
    made.write(path.parent, lambda *_: None)
    (path.parent / "reproduction.csv").rename(path)
    assert read_text_columns(path)["ours"] == ["-ours"]
    assert formulas_in(path.parent / "=t.csv") == []


WRITERS = (
    write_all_columns,
    write_events,
    write_flips,
    write_joints,
    write_points,
    write_labels,
    write_keypoints_like,
    write_rows_of_a_paper,
)


@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_names_are_no_formulas_and_come_back(write, tmp_path):
    path = tmp_path / "table.csv"
    write(path)
    assert formulas_in(path) == []


def test_tables_of_what_is_no_table_are_refused_in_one_line(tmp_path):
    path = tmp_path / "a.csv"
    refused = [
        (ValueError, r"column frame: wanted one value per row, got shape \(1, 2\)", {"frame": [[1, 2]]}),
        (ValueError, "columns of different lengths: {'a': 2, 'b': 1}", {"a": ["x", "y"], "b": ["z"]}),
        (ValueError, "column speed: numbers need a name with a unit at its end", {"speed": [0.5]}),
        (TypeError, "wanted columns by their names, got NoneType", None),
    ]
    for error, message, columns in refused:
        with pytest.raises(error, match=message):
            write_columns_csv(path, columns)
    with pytest.raises(ValueError, match="event 1 has no time_s, side"):
        write_events_csv(
            path,
            [
                {"time_s": 0.5, "frame": 1.0, "event": "toe_off", "side": "left"},
                {"frame": 1.0, "event": "toe_off"},
            ],
        )
    with pytest.raises(ValueError, match="flip 0 has no frame, time_s"):
        write_flips_csv(path, [{}])
    assert not path.exists()
    write_columns_csv(path, {"x_m": np.ma.array([1.0, -9999], mask=[False, True])})
    np.testing.assert_array_equal(read_columns_csv(path)["x_m"], [1, np.nan])
    with pytest.raises(TypeError, match="int"):  # not the file with this number
        read_track_csv(0)
