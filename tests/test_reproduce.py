"""The papers' experiments: what the tables hold, what is said, what is left behind."""

import csv

import numpy as np
import pytest
from memo import _memo, cli
from memo.cli.delivery import Exit
from memo.cli.reproduce import Experiment
from memo.reproduce import EXPERIMENTS, lee_chen, plot_posture, plot_superposition

# Tables 3 and 4, last row, as the paper prints them: left ankle, frames 1, 3, 5, then with rules 1 and 2.
PRINTED_LEAVES = {"SEQ1": ([192, 96, 80], [32, 20, 28]), "SEQ2": ([44, 32, 8], [6, 5, 4])}


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory):
    out = tmp_path_factory.mktemp("lee-chen")
    return out, lee_chen(out)


def read_csv(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("sequence", ["SEQ1", "SEQ2"])
def test_counts_stand_beside_the_printed_ones_and_double_at_most(sequence):
    table = _memo.lee_chen_counts(sequence)
    for half, printed in zip(("physical", "rules_1_2"), PRINTED_LEAVES[sequence], strict=True):
        counts = table[half]
        assert counts.shape == (14, 3) and (counts[0] == 1).all()
        assert (counts[1:] <= 2 * counts[:-1]).all()
        assert table[f"printed_{half}"][-1].tolist() == printed
    assert np.all(table["truth_kept"])


def test_frame_1_of_seq1_has_the_printed_counts():
    table = _memo.lee_chen_counts("SEQ1")
    for half in ("physical", "rules_1_2"):
        assert table[half][:, 0].tolist() == table[f"printed_{half}"][:, 0].tolist()


@pytest.mark.parametrize(("sequence", "postures"), [("SEQ1", 2), ("SEQ2", 1)])
def test_the_last_stage_leaves_two_postures_from_the_front_and_one_from_the_side(sequence, postures):
    frames = _memo.lee_chen_last_stage(sequence, "rigid_torso")
    assert len(frames) == 30
    assert all(frame["truth_kept"] and not frame["broken"] for frame in frames)
    assert np.median([frame["groups"] for frame in frames]) == postures


def test_figures_have_the_lengths_of_the_paper():
    left = _memo.lee_chen_figures("SEQ1")
    joint = {name: place for place, name in enumerate(_memo.joint_names())}
    thighs = left["figures"][:, joint["right_knee"]] - left["figures"][:, joint["right_hip"]]
    assert len(left["figures"]) == 32
    # A merged root is the middle of two less than 4 cm apart.
    assert np.allclose(np.linalg.norm(thighs, axis=1), 0.38, atol=0.001)
    assert sorted(i for _, members in left["groups"] for i in members) == list(range(32))
    assert left["passes"][left["true_one"]]


@pytest.mark.parametrize("sequence", ["SEQ3", ""])
def test_an_unknown_sequence_is_refused_by_name(sequence):
    with pytest.raises(ValueError, match="SEQ1 or SEQ2"):
        _memo.lee_chen_counts(sequence)
    with pytest.raises(ValueError, match="as_printed or rigid_torso"):
        _memo.lee_chen_last_stage("SEQ1", "loose")
    with pytest.raises(ValueError, match="merge_m"):
        _memo.lee_chen_counts("SEQ1", float("nan"))


def test_the_head_is_where_the_paper_puts_it():
    printed, *methods = _memo.lee_chen_head()
    assert list(printed["camera_position"]) == [400.00116, -0.01535, 0.00595]
    for method in methods:
        assert method["transform"].shape == (4, 3)
        assert abs(method["camera_position"][0] - 400) < 5, method["method"]
        rotation = method["rotation"]
        assert np.allclose(rotation, printed["rotation"], atol=0.02)
    known = methods[-1]
    assert np.allclose(known["camera_position"], (400, 0, 0), atol=4 * max(known["camera_position_sd"]))


def test_tables_and_figures_are_written_and_every_number_is_in_them(reproduced):
    out, reproduction = reproduced
    assert sorted(path.name for path in reproduction.written) == sorted(p.name for p in out.iterdir())
    table = read_csv(out / "table3.csv")
    assert [row["joint"] for row in table] == _memo.joint_names()
    assert table[-1]["printed_physical_frame1"] == "192"
    assert [int(row["physical_frame3"]) for row in table] == _memo.lee_chen_counts("SEQ1")["physical"][
        :, 1
    ].tolist()
    assert len(read_csv(out / "table2.csv")) == 12 + 9 + 3 + 18 + 1
    assert len(read_csv(out / "last_stage.csv")) == 120
    for name in ("fig6.png", "fig7.png", "fig8.png"):
        assert (out / name).read_bytes().startswith(b"\x89PNG")


def test_it_is_said_what_cannot_be_reproduced(reproduced):
    text = "\n".join(reproduced[1].lines)
    assert "What cannot be reproduced" in text and "Cutting" in text
    assert "(192)" in text and "400.00116" in text
    assert max(map(len, reproduced[1].lines)) <= 130


def test_a_posture_is_drawn_from_the_side_with_the_left_limbs_dashed():
    from matplotlib.figure import Figure

    left = _memo.lee_chen_figures("SEQ2")
    ax = Figure().subplots()
    assert plot_posture(ax, left["truth"]) is ax
    limbs = [line for line in ax.lines if len(line.get_xdata()) == 3]
    assert [line.get_linestyle() for line in limbs] == ["-", "-", "--", "--"]
    joint = {name: place for place, name in enumerate(_memo.joint_names())}
    knee = left["truth"][joint["right_knee"]]
    assert limbs[1].get_xdata()[1] == knee[2] and limbs[1].get_ydata()[1] == -knee[1]
    before = len(ax.lines)
    assert plot_superposition(ax, left["figures"], left["truth"]) is ax
    assert len(ax.lines) > before + 12 * len(left["figures"])


def test_the_command_writes_into_the_folder_and_names_what_it_wrote(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["memo", "reproduce", "lee-chen", "--out", str(tmp_path / "here")])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == Exit.DONE
    said = capsys.readouterr().out
    assert "Table 3." in said and "fig7.png" in said
    assert (tmp_path / "here" / "table4.csv").is_file()


def test_the_command_knows_every_experiment_and_refuses_others(monkeypatch, capsys):
    assert {experiment.value for experiment in Experiment} == set(EXPERIMENTS)
    monkeypatch.setattr("sys.argv", ["memo", "reproduce", "cutting"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    assert ended.value.code == 2
    assert "lee-chen" in capsys.readouterr().err
