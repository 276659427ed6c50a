"""What every result can do beside holding numbers: a short repr, pandas, plots, pickling; and long calls that
can be watched and interrupted."""

import copy
import html
import logging
import pickle
import re
import signal
import subprocess
import sys
import types

import matplotlib
import memo
import numpy as np
import pandas
import pytest
from matplotlib import pyplot
from matplotlib.axes import Axes
from memo import notebook
from memo.gait import lookup

matplotlib.use("Agg")

CAMERA = memo.Camera.level((1280, 720), 60.0, 1.2, 4.0)


def walk_keypoints(frames=60):
    """Projections of the synthetic walker's joints, and their names."""
    walk = memo.walker_motion(frames, rate_hz=30, heading_deg=20)
    pixels = np.stack([CAMERA.project(np.ascontiguousarray(row)) for row in walk.positions])
    return np.asarray(walk.times_s), pixels, list(walk.names)


def dots(frames=60):
    """Times and dots of a point-light display of the walker, with their names."""
    walk = memo.walker_motion(frames, rate_hz=30)
    shown = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30)
    return shown.times_s, shown.positions_px, list(walk.names)


@pytest.fixture(scope="module")
def track():
    scene = memo.demo_scene(0, frames=60)
    return memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)


@pytest.fixture(scope="module")
def keypoints(tmp_path_factory):
    times_s, pixels, names = walk_keypoints()
    path = tmp_path_factory.mktemp("keypoints") / "walk.csv"
    header = ["frame", "time_s", *(f"{name}_{axis}" for name in names for axis in ("u_px", "v_px"))]
    rows = (
        [str(t), f"{time_s:.6f}", *(f"{value:.4f}" for value in row.ravel())]
        for t, (time_s, row) in enumerate(zip(times_s, pixels, strict=True))
    )
    path.write_text("\n".join(",".join(row) for row in [header, *rows]))
    return memo.read_keypoints(path)


@pytest.fixture(scope="module")
def results(track, keypoints):
    times_s, tracks, names = dots()
    return {
        "track": track,
        "postures": memo.posture(keypoints, CAMERA, height_m=1.75),
        "figure": memo.planar(tracks, times_s, names=names),
        "repair": memo.unswap(keypoints),
        "scene": memo.demo_scene(1, frames=20),
    }


NAMES = ["track", "postures", "figure", "repair", "scene"]


@pytest.mark.parametrize("name", NAMES)
def test_a_repr_fits_in_two_lines(results, name):
    text = repr(results[name])
    assert text.startswith(type(results[name]).__name__ + "(")
    assert len(text) < 220
    assert "array" not in text


@pytest.mark.parametrize("name", NAMES)
def test_notebooks_show_a_table(results, name):
    shown = results[name]._repr_html_()
    title, rows = shown.split("<table>")
    assert html.unescape(title) == f"<p><b>{results[name]!r}</b></p>" and rows.count("<tr>") >= 2
    assert len(shown) < 10_000, "long values are described"


def test_a_table_describes_what_is_long_and_escapes_what_is_not():
    values = [np.zeros((3, 2)), 1 / 3, "<b>", [1] * 200, {"a" * 200: 1}, "word " * 60, None]
    shown = notebook.table("<i>", [f"v{k}" for k in range(7)], values)
    cells = re.findall(r"<td[^>]*>(.*?)</td>", shown)
    assert cells[:4] == ["array (3, 2) float64", "0.333333", "&lt;b&gt;", "200 x int"]
    assert cells[4].startswith("1 by name: aaa") and cells[5].startswith("word word") and cells[6] == "None"
    assert "&lt;i&gt;" in shown and max(map(len, cells)) < 250


def test_a_walk_shows_its_attributes(track):
    shown = track.walks[0]._repr_html_()
    assert "Walk(person 0" in shown and "<th" in shown and "columns" in shown and "by name" in shown


@pytest.mark.parametrize("name", NAMES)
def test_a_result_is_a_data_frame(results, name):
    frame = results[name].to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    if name == "track":
        assert list(frame.columns) == list(results[name].columns)
        assert frame.attrs["units"]["x_m"] == "m" and frame.attrs["units"]["sd_phase"] == "cycle"
        np.testing.assert_array_equal(frame["phase"], results[name].columns["phase"])
    if name == "postures":
        assert len(frame) == len(results[name])
    if name == "figure":
        assert len(frame) == 8
        assert frame["length_px"].gt(0).all()


@pytest.mark.parametrize("name", ["track", "postures", "figure", "repair"])
def test_a_plot_goes_where_it_is_wanted(results, name):
    _, ax = pyplot.subplots()
    assert results[name].plot(ax=ax) is ax
    assert ax.has_data() or name == "repair"  # nothing was exchanged
    own = results[name].plot()
    assert isinstance(own, Axes)
    assert own is not ax
    pyplot.close("all")


def test_plots_say_what_there_is(results):
    assert results["track"].plot("x_m").get_ylabel() == "x_m"
    with pytest.raises(ValueError, match="nothing named 'toe' to plot; there are hip, knee"):
        results["track"].plot("toe")
    assert results["postures"].plot(row=5).has_data()
    with pytest.raises(IndexError, match="row 99 of postures with 60 rows"):
        results["postures"].plot(row=99)
    with pytest.raises(IndexError, match="window 99"):
        results["figure"].plot(window=99)
    pyplot.close("all")


def test_without_pandas_it_is_said_what_to_install(monkeypatch, results):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match="pip install pandas"):
        results["track"].to_pandas()


@pytest.mark.parametrize("name", NAMES)
def test_a_result_survives_pickling(results, name):
    result = results[name]
    again = pickle.loads(pickle.dumps(result))
    assert repr(again) == repr(result)
    for ours, theirs in zip(again.to_pandas().items(), result.to_pandas().items(), strict=True):
        pandas.testing.assert_series_equal(ours[1], theirs[1])


def test_results_of_the_core_keep_every_field():
    walk = memo.walker_motion(60, rate_hz=30)
    shown = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30)
    window = memo.planar(shown.positions_px, walk.times_s).windows[0]
    places = np.random.default_rng(0).uniform([-2, 2, 0], [2, 6, 2], (12, 3))
    camera = memo.calibrate_points(places, CAMERA.project(places), CAMERA.size)
    for found in (walk, shown, window, window.chains[0], window.chains[0].links[0], camera):
        again = pickle.loads(pickle.dumps(found))
        assert repr(again) == repr(found) and len(repr(found)) < 120
        for name in [name for name in dir(found) if not name.startswith("_")]:
            ours, theirs = getattr(again, name), getattr(found, name)
            if callable(ours):
                continue
            if name in ("chains", "links"):
                ours, theirs = list(map(repr, ours)), list(map(repr, theirs))
            np.testing.assert_equal(ours, theirs, err_msg=name)
        with pytest.raises(AttributeError):
            setattr(found, name, None)


def test_a_pickled_track_answers_all_it_did(track):
    again = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(track))))
    assert again.summary == track.summary
    assert again.events == track.events
    assert again.camera == track.camera
    np.testing.assert_array_equal(again.contours(7), track.contours(7))
    np.testing.assert_array_equal(again.contour_parts(7), track.contour_parts(7))
    np.testing.assert_array_equal(again.measured["phase"], track.measured["phase"])
    np.testing.assert_array_equal(again.start.similarity, track.start.similarity)


def test_cameras_are_pickled_to_the_last_bit():
    tsai = memo.Camera.from_tsai(
        size=(768, 576),
        pixel_mm=(0.0051273271277, 0.00465),
        focal_mm=5.5549183034,
        kappa1_per_mm2=0.0051113043639,
        centre_px=(324.22149053, 282.56650051),
        sx=1.0937855397,
        translation_mm=(-4.8441913843e03, 5.5109448682e02, 4.9667438357e03),
        rotation_rad=(1.9007833770e00, 4.9730769727e-01, 1.8415452559e-01),
    )
    points = np.random.default_rng(0).uniform([-5, -5, 0], [5, 5, 2], (50, 3))
    for camera in (tsai, CAMERA):
        again = pickle.loads(pickle.dumps(camera))
        assert again == camera
        np.testing.assert_array_equal(again.project(points), camera.project(points))
    assert tsai != CAMERA


def test_the_logger_is_silent_unless_asked(caplog):
    program = "import memo, numpy as np; memo.track([np.zeros((64, 64), np.uint8)] * 3, height_m=1.7, fps=25)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == done.stderr == ""
    with caplog.at_level(logging.INFO, logger="memo"):
        memo.track([np.zeros((64, 64), np.uint8)] * 3, height_m=1.7, fps=25)
    assert "Nobody was seen" in caplog.text


# Watching and interrupting


def counted(call):
    """What a call tells its `progress`."""
    told = []
    call(lambda done, total: told.append((done, total)))
    return told


def test_long_calls_tell_how_far_they_are(keypoints):
    times_s, tracks, names = dots(240)
    calls = {
        "posture": lambda progress: memo.posture(keypoints, CAMERA, height_m=1.75, progress=progress),
        "planar": lambda progress: memo.planar(tracks, times_s, names=names, progress=progress),
        "demo_scene": lambda progress: memo.demo_scene(0, frames=5, progress=progress),
    }
    for name, call in calls.items():
        told = counted(call)
        done = [counts[0] for counts in told]
        assert done == sorted(set(done)), name
        assert told[-1][0] == told[-1][1], name


class Alarm(Exception):
    pass


def raise_alarm(*_):
    raise Alarm


@pytest.fixture
def alarm():
    """A signal whose handler raises, as that of Ctrl-C does, a moment from now."""
    if not hasattr(signal, "setitimer"):
        pytest.skip("no timers on this system")
    before = signal.signal(signal.SIGALRM, raise_alarm)
    yield lambda after_s: signal.setitimer(signal.ITIMER_REAL, after_s)
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


def test_a_signal_ends_a_long_call(alarm):
    _, tracks, _ = dots()
    many, counts = 400, []
    long_px = np.concatenate([tracks] * many)
    long_s = np.arange(len(long_px)) / 30
    alarm(0.1)
    with pytest.raises(Alarm):
        memo.planar(long_px, long_s, progress=lambda *told: counts.append(told))
    assert not counts or counts[-1][0] < counts[-1][1]


def test_a_callback_that_raises_ends_the_call():
    times_s, tracks, names = dots(600)

    def refuse(done, total):
        raise Alarm

    with pytest.raises(Alarm):
        memo.planar(tracks, times_s, names=names, progress=refuse)


def test_a_tracker_loses_nothing_when_a_frame_is_interrupted(track, alarm):
    scene = memo.demo_scene(0, frames=60)
    tracker = memo.Tracker(scene.height_m, scene.camera)
    taken_all_the_same = 0
    for frame, time_s in zip(scene.frames, scene.times_s.tolist(), strict=True):
        try:
            alarm(0.02)
            tracker.update(frame, time_s)
            alarm(0)
        except Alarm:
            try:
                tracker.update(frame, time_s)  # the signal came before the core had it
            except ValueError:
                taken_all_the_same += 1
    again = tracker.finish()
    for name, column in track.columns.items():
        np.testing.assert_array_equal(again.columns[name], column, err_msg=name)
    assert taken_all_the_same > 0


def test_a_point_of_the_picture_chooses_a_person(track):
    columns = track.columns
    row = len(track) // 2
    frame = int(columns["frame"][row])
    middle = [columns[f"right_hip_{axis}_px"][row] for axis in "uv"]
    assert track.person_at(*middle, frame) == 0
    assert track.person_at(middle[0] + 300, middle[1], frame) is None
    assert track.person_at(*middle, 10_000) is None
    alone = track.of_person(0)
    assert len(alone) == len(track) and alone.summary == track.summary
    with pytest.raises(ValueError, match=r"no person 1; people of the track: 0"):
        track.of_person(1)


def test_a_box_in_the_picture_chooses_a_person(track):
    frame = int(track.columns["frame"][len(track) // 2])
    ((_, (low, high)),) = track.extents(frame)
    width, height = high - low
    assert track.person_in(*low, width, height, frame) == 0
    assert track.person_in(*(low + 0.4 * (high - low)), width / 5, height / 5, frame) == 0  # of a part
    assert track.person_in(low[0] + 0.8 * width, low[1], width, height, frame) is None
    assert track.person_in(*low, width, height, 10_000) is None
    beside = np.array([0.3 * width, 0])
    boxes = [(0, np.stack([low, high])), (1, np.stack([low + beside, high + beside]))]
    two = types.SimpleNamespace(columns={"person": np.array([0, 1])}, extents=lambda frame: boxes)
    for at, person in ((0.1, 0), (0.2, 1)):
        left = low[0] + at * width
        assert memo.Track.person_in(two, left, low[1], width, height, frame) == person


def test_a_person_alone_keeps_the_number(track):
    two = copy.copy(track)
    two.walks, two._people = track.walks * 2, {track.walks[0].person: 1}
    alone = two.of_person(1).of_video(2)
    assert alone.people == [1, 1] and set(alone.columns["person"]) == {1}
    assert {event["person"] for event in alone.events} == {1}
    assert any(sentence.startswith("Walk 1 (person 1)") for sentence in alone.sentences)


class Altered:
    """A walk with some of its values replaced."""

    def __init__(self, walk, **values):
        self._walk, self._values = walk, values

    def __getattr__(self, name):
        values = self.__dict__["_values"]
        return values[name] if name in values else getattr(self.__dict__["_walk"], name)

    def __len__(self):
        return len(self._walk)


def altered(track, *walks):
    other = copy.copy(track)
    other.walks = list(walks)
    other._people = {walk.person: 0 for walk in walks}
    return other


def test_the_speed_of_a_walk_backwards_has_one_sign_in_all_results(track):
    walk = track.walks[0]
    assert track.summary["speed_mps"] > 0.5
    speeds = [
        line if line.parameter != "speed" else type(line)("speed", "", -line.value, "m/s", -2.0, -0.5, line.n)
        for line in walk.gait_parameters
    ]
    backwards = altered(track, Altered(walk, direction="backward", gait_parameters=speeds))
    row = lookup(backwards.gait_parameters, 0, "speed")
    assert backwards.summary["speed_mps"] == row["value"] < -0.5
    assert "backwards" in backwards.summary["message"] and " at -" not in backwards.summary["message"]


@pytest.mark.parametrize("open_by", ["p_swapped", "p_other_direction"])
def test_a_walk_whose_sides_are_open_has_no_cycles_by_side(track, open_by):
    walk = track.walks[0]
    sure = altered(track, Altered(walk, p_swapped=0.1, p_other_direction=0.0))
    unsure = altered(track, Altered(walk, **{"p_swapped": 0.1, "p_other_direction": 0.0, open_by: 0.42}))
    assert len(sure.cycles["walk"]) and not len(unsure.cycles["walk"])
    both = altered(track, unsure.walks[0], sure.walks[0])
    assert set(both.cycles["walk"]) == {1}


def test_a_person_who_cannot_have_walked_so_far_is_not_called_the_same(track):
    walk = track.walks[0]
    columns = walk.columns
    for later_s, apart_m, is_same in (
        (0.0, 6.2, False),
        (0.0, 0.5, True),
        (3.0, 6.2, True),
        (-0.5, 3.0, False),
    ):
        moved = dict(columns)
        moved["time_s"] = columns["time_s"] - columns["time_s"][0] + columns["time_s"][-1] + later_s
        moved["x_m"] = columns["x_m"] - columns["x_m"][0] + columns["x_m"][-1] + apart_m
        moved["y_m"] = columns["y_m"] - columns["y_m"][0] + columns["y_m"][-1]
        said = " ".join(altered(track, walk, Altered(walk, columns=moved)).sentences)
        assert ("This is the same person as in walk 0: it begins" in said) is is_same, said
        assert ("the places do not agree" in said) is not is_same
        assert f"{apart_m:.1f} m from where that walk ended" in said


def test_a_video_of_another_size_is_refused(track):
    width, height = track.walks[0].camera.size
    for shrink in (0, -1, 1.5, True, 10**9, "2"):
        with pytest.raises(ValueError, match="shrink must be a whole number from 1 to 1000, got"):
            track.of_video(shrink)
    with pytest.raises(
        ValueError, match=f"size {width}x{height} averaged 2 by 2 is .*, but the tracked frames"
    ):
        track.of_video(2, (width, height))
    whole = track.of_video(np.int64(2), (2 * width + 1, 2 * height))
    assert tuple(whole.camera.size) == (2 * width + 1, 2 * height)
    assert whole.of_video(4).shrink == 4
    with pytest.raises(ValueError, match="shrink must be a multiple of 2, got 3"):
        whole.of_video(3)
