"""Point-light displays and the linkage found in them, through the built core."""

import csv
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

memo = pytest.importorskip("memo")
figure = pytest.importorskip("memo.linkage")

LIMBS = {(0, 1), (1, 2), (3, 4), (4, 5), (6, 7), (7, 8), (9, 10), (10, 11)}


def walk(frames=66):
    return memo.walker_motion(frames)


def display(**options):
    points = walk()
    return memo.pointlight(points.positions, points.times_s, points.names, **options)


def test_a_display_has_its_shapes_and_labels():
    shown = display(noise_dots=5, azimuth_deg=30)
    assert shown.positions_px.shape == (66, 18, 2)
    assert shown.labels[0].tolist() == [*range(13), *[-1] * 5]
    assert shown.visible.all()
    limited = display(lifetime_frames=2, life_dots=6)
    assert limited.labels.shape == (66, 6)
    assert (limited.limb_ends == limited.labels + 1).all()


def test_the_orthographic_view_is_the_documented_one():
    points = walk()
    shown = display(locomotion="translating").positions_px
    assert np.allclose(shown, points.positions[..., [0, 2]] * [200, -200])


def test_bad_options_are_told():
    for options, part in (
        ({"locomotion": "flying"}, "treadmill"),
        ({"px_per_m": float("nan")}, "pixels per metre"),
        ({"lifetime_frames": 2, "life_dots": 13, "life_sites": "joints"}, "nowhere to jump"),
    ):
        with pytest.raises(ValueError, match=part):
            display(**options)
    with pytest.raises(ValueError, match="3 times"):
        memo.pointlight(walk(4).positions, [0.0, 1.0, 2.0], ["a"] * 13)


def test_masked_points_are_unseen():
    shown = display(seed=3)
    masked = np.zeros(shown.positions_px.shape, bool)
    masked[10:14, 2] = True
    hidden = np.ma.array(np.where(masked, -9999, shown.positions_px), mask=masked)
    found = memo.planar(hidden, shown.times_s)
    wanted = memo.planar(np.where(masked, np.nan, shown.positions_px), shown.times_s)
    assert found.links() == wanted.links()
    np.testing.assert_array_equal(found.points.positions, wanted.points.positions)
    names = [f"p{k}" for k in range(hidden.shape[1])]
    assert np.isnan(figure.Points(names, shown.times_s, hidden).positions[masked]).all()


def test_points_that_do_not_fit_are_refused():
    for names, times_s, shape in (
        (["a"], [0.0], (2, 1, 2)),
        (["a"], [0.0], (1, 2, 2)),
        ([], [0.0], (1, 1, 4)),
    ):
        with pytest.raises(
            ValueError, match=r"wanted times_s \(T,\) and positions \(T, ., 2 or 3\) of . name"
        ):
            figure.Points(names, np.array(times_s), np.zeros(shape))


def test_limbs_are_found_again():
    shown = display(azimuth_deg=30, noise_sd_px=1.0)
    found = memo.planar(shown.positions_px, shown.times_s, 1.0)
    assert [window.status for window in found.windows] == ["interpreted"]
    assert {(a, b) for a, b, *_ in found.links()} == LIMBS
    assert found.depth.shape == (66, 13)
    with pytest.raises(ValueError, match="too few"):
        memo.planar(shown.positions_px[:3], shown.times_s[:3])


def test_points_files_are_read_as_written(tmp_path):
    shown = display()
    names = [f"dot{i}" for i in range(13)]
    positions = shown.positions_px.copy()
    positions[3, 4] = np.nan
    points = figure.Points(names, shown.times_s, positions)
    figure.write_points_csv(tmp_path / "dots.csv", points)
    read = figure.read_points_csv(tmp_path / "dots.csv", 2)
    assert read.names == names
    assert np.allclose(read.positions, positions, atol=1e-4, equal_nan=True)
    with pytest.raises(ValueError, match="NAME_x"):
        figure.read_points_csv(tmp_path / "dots.csv", 3)


def test_names_tell_limbs_from_their_mirrors():
    shown = display(azimuth_deg=30, noise_sd_px=0.5)
    tracks = shown.positions_px[:, :12]
    names = walk().names[:12]
    found = memo.planar(tracks, shown.times_s, 0.5, names=names, focal_px=1500.0)
    chains = found.windows[0].chains
    assert all(chain.reflection_margin_deg > 0 for chain in chains)
    # Seen from the walker's right and rear: who walks to the right also walks away.
    assert all(chain.slope[0] * chains[0].slope[0] > 0 for chain in chains)
    assert 0 < found.perspective_px < 20
    # The mirror image of a walker is a walker with the sides exchanged.
    exchanged = [("L" if name[0] == "R" else "R") + name[1:] for name in names]
    again = memo.planar(tracks * [-1, 1], shown.times_s, 0.5, names=exchanged).windows[0].chains
    assert all(chain.slope[0] * chains[0].slope[0] < 0 for chain in again)
    with pytest.raises(ValueError, match="11 names"):
        memo.planar(tracks, shown.times_s, 0.5, names=names[:11])


def test_scales_are_divided_out():
    shown = display(azimuth_deg=30)
    scales = np.linspace(0.8, 1.25, 66)
    plain = memo.planar(shown.positions_px, shown.times_s)
    scaled = memo.planar(shown.positions_px * scales[:, None, None], shown.times_s, scales=scales)
    assert [link[:2] for link in plain.links()] == [link[:2] for link in scaled.links()]
    assert np.allclose([link[2] for link in plain.links()], [link[2] for link in scaled.links()], rtol=1e-6)
    with pytest.raises(ValueError, match="scale"):
        memo.planar(shown.positions_px, shown.times_s, scales=scales[:5])


def test_limbs_keep_their_lengths_where_the_scale_changes(tmp_path):
    shown, names = display(azimuth_deg=60), walk().names
    scales = np.linspace(0.7, 1.4, 66)
    points = figure.Points(names, shown.times_s, shown.positions_px * scales[:, None, None], scales)
    found = memo.planar(points.positions, points.times_s, scales=scales)
    figure.write_figure_csv(tmp_path, found, points)
    rows = list(csv.DictReader((tmp_path / "points3d.csv").read_text().splitlines()))
    a, b = (
        np.array([[float(row[f"{name}_{axis}_px"]) for axis in "uvz"] for row in rows])
        for name in ("RHP", "RKN")
    )
    lengths = np.linalg.norm(a - b, axis=1)
    assert lengths.max() < 1.02 * lengths.min()
    with pytest.raises(ValueError, match="frame 0: scale 0 must be positive"):
        figure.Points(names, points.times_s, points.positions, scales * 0).at_one_scale()


def found_with(verdicts, status="interpreted", **more):
    """A figure of one window for each verdict, with the link 0 - 1 as long as the window's number."""

    def window(number, verdict):
        link = memo._memo.PlanarLink((0, 1), float(number), 0.1, 1.0, 0.9)
        chain = SimpleNamespace(verdict=verdict, links=[link])
        return SimpleNamespace(**{"status": status, "method": "cover", "chains": [chain], **more})

    windows = [window(number, verdict) for number, verdict in enumerate(verdicts)]
    return figure.PlanarFigure(windows, np.zeros((8, 2)), ["planar"] * 8)


def test_links_are_given_with_the_verdicts_on_their_chains():
    from memo.cli.planar import _about_links

    found = found_with(["not planar", "planar", "edge-on", "planar"])
    assert found.links() == [(0, 1, 1.5, 0.9, 4, "planar")]
    assert found.verdicts() == {(0, 1): {"planar": 2, "not planar": 1, "edge-on": 1}}
    assert _about_links(found, ["a", "b"]) == [
        "  a - b: 2 px long, confidence 90%, planar in 2, not planar in 1, edge-on in 1 of 4 windows",
        '"not planar": the limb leaves its plane; its length and depth are less exact.',
    ]
    guess = found_with(["not planar", "planar"], status="lost")
    assert found.is_body and not guess.is_body
    assert guess.links() == [(0, 1, 0.5, 0.9, 2, "not planar")]
    assert repr(guess).startswith("PlanarFigure(no body; best guess: 1 link of 2 points, 0 of 2 windows")


def test_links_of_windows_without_a_body_do_not_count_beside_one():
    found = found_with(["planar", "planar"])
    found.windows[1].status = "lost"
    assert found.links() == [(0, 1, 0.0, 0.9, 1, "planar")]


def test_closed_forms_lift_planted_rods_and_hinges():
    angles = np.random.default_rng(3).uniform(0, 2 * np.pi, (500, 4))
    points = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    plane = np.array([0.6, -0.9])
    normal = np.sqrt(1 + plane @ plane)
    along = plane / np.linalg.norm(plane)
    views = points - np.outer((points @ along).ravel(), along).reshape(points.shape) * (1 - 1 / normal)
    for depth, given in (
        (memo.planar_rods(views[:, :3].copy()), views[:, :3]),
        (memo.planar_hinges(views), views),
    ):
        truth = given @ plane
        error = np.minimum(np.abs(depth - truth).max(axis=1), np.abs(depth + truth).max(axis=1))
        assert np.nanmedian(error) < 1e-10
        assert np.isnan(error).mean() < 0.02
    with pytest.raises(ValueError, match=r"\(N, 3, 2\)"):
        memo.planar_rods(views)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("time_s,a_u_px,a_v_px\n0,1,x\n", "column a_v_px: x is not a number"),
        ("time_s,a_u_px,a_v_px\n0,1,2\n0,1,2\n", "column time_s: times must increase"),
        ("time_s,a_u_px,b_v_px\n0,1,2\n", "point a has no column a_v_px"),
        ("time_s,a_u_px,a_v_px\n0,1\n", "row 0 has 2 cells"),
        ("time_s,a_u_px,a_v_px\n0,1,inf\n", "row 0, column a_v_px: infinite"),
        ("time_s,a,b\n0,1,2\n", "no columns NAME_u_px"),
        ("time_s,a_u_px,a_u_px\n0,1,2\n", "column a_u_px occurs 2 times"),
    ],
)
def test_bad_tracks_are_named(tmp_path, text, part):
    (tmp_path / "bad.csv").write_text(text)
    with pytest.raises(ValueError, match=part):
        figure.read_points_csv(tmp_path / "bad.csv", 2)


def test_files_from_elsewhere_are_read_or_named(tmp_path):
    path = tmp_path / "points.csv"
    path.write_text("time_s,a_u,a_v\n0,1,2\n1,1,2\n", encoding="utf-8-sig")
    assert figure.read_points_csv(path, 2).times_s.tolist() == [0, 1]
    path.write_bytes(b"\xff\xfe\x00a")
    with pytest.raises(ValueError, match=r"points\.csv: not text in UTF-8"):
        figure.read_points_csv(path, 2)


def test_scales_are_written_and_read(tmp_path):
    scales = np.array([0.5, 1.25])
    points = figure.Points(["a"], np.array([0.0, 1.0]), np.ones((2, 1, 2)), scales)
    figure.write_points_csv(tmp_path / "points.csv", points)
    assert figure.read_points_csv(tmp_path / "points.csv", 2).scales.tolist() == scales.tolist()


def test_labels_hold_any_name(tmp_path):
    from memo.cli.pointlight import _write_labels

    shown = display()
    names = ['a,"b"', *walk().names[1:]]
    _write_labels(tmp_path / "labels.csv", names, names, shown)
    rows = csv.DictReader((tmp_path / "labels.csv").read_text().splitlines())
    assert next(rows) == dict(frame="0", dot=names[0], shows=names[0], limb_end="", fraction="", visible="1")


@pytest.mark.filterwarnings("error")
def test_frames_without_points_are_drawn(tmp_path):
    pytest.importorskip("av"), pytest.importorskip("matplotlib")
    from memo import linkage_plot

    shown = display(azimuth_deg=30)
    tracks = shown.positions_px.copy()
    tracks[30:36] = np.nan
    points = figure.Points(walk().names, shown.times_s, tracks)
    found = memo.planar(tracks, points.times_s, 0.5)
    assert found.interpreted
    linkage_plot.write_linkage_png(tmp_path / "linkage.png", points, found)
    linkage_plot.write_turned_png(tmp_path / "turned.png", points, found)
    linkage_plot.write_turned_video(tmp_path / "turned.mp4", points, found)
    assert np.isfinite(tracks[linkage_plot._fullest(tracks)]).all()


@pytest.mark.parametrize(
    ("text", "rate_hz", "part"),
    [
        ("time_s,a_u,a_v\n0,1,2\n0.02,1,2\n", 25.0, "time_s has 50 frames per second, not 25"),
        ("a_u,a_v\n1,2\n", 0.0, "positive and finite, got 0"),
        ("time_s,a_u,a_v\n0,1,2\n", float("nan"), "positive and finite, got nan"),
        ("# filtered at 6 Hz, 100 Hz\na_u,a_v\n1,2\n", None, r"several rates \(6, 100 Hz\): give --fps"),
        ("# ...Hz\na_u,a_v\n1,2\n", None, "no frame rate in a comment"),
    ],
)
def test_doubtful_frame_rates_are_refused(tmp_path, text, rate_hz, part):
    (tmp_path / "points.csv").write_text(text)
    with pytest.raises(ValueError, match=part):
        figure.read_points_csv(tmp_path / "points.csv", 2, rate_hz)


@pytest.mark.parametrize(
    ("text", "rate_hz"),
    [
        ("# 50 Hz\na_u,a_v\n1,2\n1,2\n", None),
        ("# filtered at 6 Hz, 100 Hz\na_u,a_v\n1,2\n1,2\n", 50.0),
        ("time_s,a_u,a_v\n0,1,2\n0.02,1,2\n", 50.0),
    ],
)
def test_frame_rates_are_used(tmp_path, text, rate_hz):
    (tmp_path / "points.csv").write_text(text)
    assert figure.read_points_csv(tmp_path / "points.csv", 2, rate_hz).times_s.tolist() == [0, 0.02]


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "memo.cli", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_limbs_are_found_in_keypoints(tmp_path):
    from memo.keypoints import Keypoints, write_keypoints

    shown = display(azimuth_deg=30, noise_sd_px=1.0)
    names = ["nose" if name == "HEAD" else name for name in walk().names]
    seen = Keypoints.from_arrays(shown.positions_px + 500, names=names, times_s=shown.times_s)
    rate_hz = 1 / (shown.times_s[1] - shown.times_s[0])
    for written in ("openpose", "coco", "csv"):
        path = tmp_path / {"openpose": "walk_json", "coco": "walk.json", "csv": "walk.csv"}[written]
        write_keypoints(path, seen, written)
        points = figure.read_tracks(path, rate_hz)
        assert set(points.names) == figure.JOINT_NAMES and points.positions.shape == (66, 12, 2)
        found = memo.planar(points.positions, points.times_s, 1.0)
        links = {frozenset((points.names[a][1:], points.names[b][1:])) for a, b, *_ in found.links()}
        assert links == {frozenset(pair) for pair in (("SH", "EL"), ("EL", "WR"), ("HP", "KN"), ("KN", "AN"))}
        assert len(found.links()) == 8
    options = ["--fps", rate_hz, "--noise-px", 1, "--no-video", "--out", tmp_path / "out"]
    done = run("planar", tmp_path / "walk_json", *options)
    assert done.returncode == 0 and "RHP - RKN: " in done.stdout
    for path, reason in ((tmp_path / "none.csv", "no such file"), (tmp_path / "walk_json", "frame rate")):
        with pytest.raises(ValueError, match=reason):
            figure.read_tracks(path)


def test_commands_make_and_read_a_display(tmp_path):
    pytest.importorskip("typer"), pytest.importorskip("av"), pytest.importorskip("matplotlib")
    made = run("pointlight", "--out", tmp_path, "--azimuth-deg", "30", "--seconds", "1.1")
    assert made.returncode == 0, made.stderr
    read = run("planar", tmp_path / "dots.csv", "--out", tmp_path, "--noise-px", "0", "--no-video")
    assert read.returncode == 0, read.stderr
    with open(tmp_path / "links.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    links = {(row["a"], row["b"]) for row in rows}
    assert "planar" in {row["verdict"] for row in rows}
    assert ("RHP", "RKN") in links and len(links) == 8
    assert (tmp_path / "linkage.png").stat().st_size > 1000
    absent = run("planar", tmp_path / "absent.csv")
    assert absent.returncode == 1 and absent.stderr.startswith("memo: ")


def test_a_failure_promises_no_links_that_are_not_there():
    from memo.cli.planar import _about_figure

    points = figure.Points(["a", "b"], np.arange(8) / 30, np.zeros((8, 2, 2)))
    assert _about_figure(found_with(["edge-on"], "still"), points, 0.5)[-1].endswith("is in links.csv.")
    nothing = found_with(["edge-on"], "still", chains=[])
    assert _about_figure(nothing, points, 0.5)[-1].endswith("shows motion in planes.")


def test_tracks_without_a_window_are_told(tmp_path):
    from memo.cli.planar import _about_figure

    points = figure.Points(["a", "b"], np.arange(8) / 30, np.zeros((8, 2, 2)))
    nothing = figure.PlanarFigure([], np.full((8, 2), np.nan), ["unknown"] * 8)
    assert _about_figure(nothing, points, 0.5)[0].startswith("No window")
    assert len(figure.write_figure_csv(tmp_path, nothing, points)) == 4


def test_points_seen_but_not_joined_are_not_called_unseen():
    tracks = np.random.default_rng(1).normal(0, 100, (150, 2, 2)).cumsum(axis=0)
    tracks[75:] = np.nan
    states = [window.status for window in memo.planar(tracks, np.arange(150) / 60, window_s=0.5).windows]
    assert states[0] == "nothing linked" and states[-1] == "unseen"


def test_a_spanning_tree_is_told(tmp_path):
    from memo.cli.planar import _about_figure

    shown = display(azimuth_deg=30)
    tracks = np.concatenate([shown.positions_px, shown.positions_px[:, :6] + 400], axis=1)
    points = figure.Points([f"d{i}" for i in range(19)], shown.times_s, tracks)
    found = memo.planar(tracks, shown.times_s)
    said = _about_figure(found, points, 0.5)
    assert "19 are too many points" in said[1]
    assert "too many points for a verdict. The best guess is in links.csv" in said[2]
    assert not found.interpreted and found.links()
    figure.write_figure_csv(tmp_path, found, points)
    rows = csv.DictReader((tmp_path / "windows.csv").read_text().splitlines())
    assert {row["method"] for row in rows} == {"forest"}


def test_the_way_to_the_limbs_is_told_where_there_is_one(tmp_path):
    pytest.importorskip("typer"), pytest.importorskip("av"), pytest.importorskip("matplotlib")
    out = tmp_path / "my dots"
    made = run("pointlight", "--out", out, "--seconds", "0.3", "--noise-px", "1.5")
    assert f"memo planar '{out / 'dots.csv'}' --noise-px 1.5" in made.stdout
    assert "memo planar" in run("pointlight", "--out", out, "--seconds", "0.3", "--noise-dots", "3").stdout
    others = (("--seconds", "0.1"), ("--seconds", "0.3", "--scramble-position"))
    for options in (*others, ("--seconds", "0.3", "--noise-dots", "4")):
        made = run("pointlight", "--out", out, *options)
        assert made.returncode == 0 and "memo planar" not in made.stdout


def test_senseless_options_are_refused(tmp_path):
    pytest.importorskip("typer")
    (tmp_path / "dots.csv").write_text("# 30 Hz\na_u,a_v,b_u,b_v\n" + "1,2,3,4\n" * 10)
    for code, command, part in (
        (1, ("planar", tmp_path / "dots.csv", "--focal-px", "0"), "--focal-px 0 must be positive"),
        (1, ("planar", tmp_path / "dots.csv", "--turn-deg", "nan"), "--turn-deg nan must be finite"),
        (1, ("planar", tmp_path / "dots.csv", "--names"), "no column names a joint"),
        (2, ("pointlight", "--period", "1"), "--period needs --scramble-phase"),
        (2, ("pointlight", "--scramble-phase", "--period", "0"), "--period 0 must be positive"),
    ):
        refused = run(*command, "--out", tmp_path)
        assert refused.returncode == code and part in refused.stderr


def test_keypoints_are_read_as_for_posture(tmp_path, memo_command):
    import detector_files as made

    options = ["--no-video", "--noise-px", 2, "--fps", 30, "--out", tmp_path / "out"]
    files = {
        "mediapipe.json": made.mediapipe,
        "labels": made.yolo_labels,
        "dlc.csv": made.deeplabcut,
        "sleap.csv": made.sleap_csv,
    }
    for name, write in files.items():
        write(tmp_path / name)
        code, said, err = memo_command("planar", tmp_path / name, "--image-size", "1280x720", *options)
        assert code in (0, 3) and said.startswith(("Windows: ", "No window", "2 people")) and not err, name
    assert (
        "2 people in the file: 0 (19 frames"
        in memo_command("planar", tmp_path / "mediapipe.json", "--image-size", "1280x720", *options)[1]
    )
    made.deeplabcut(tmp_path / "two.csv", individuals=("anna", "ben"))
    _, said, _ = memo_command("planar", tmp_path / "two.csv", *options)
    assert said.startswith("2 people in the file: ") and "anna (20 frames of frames 0 to 19, " in said
    points = []
    for name in ("anna", "ben"):
        _, said, err = memo_command("planar", tmp_path / "two.csv", *options, "--person", name)
        assert "people" not in said and not err
        points.append(np.genfromtxt(tmp_path / "out" / "points3d.csv", delimiter=",", names=True)["RKN_u_px"])
    both = np.isfinite(points).all(axis=0)  # the scores of some points are too low
    assert both.sum() >= 10
    np.testing.assert_allclose(points[1][both], points[0][both] + 300)
    code, _, err = memo_command("planar", tmp_path / "two.csv", *options, "--person", "carl")
    assert code == 1 and "no person carl: the file names anna, ben" in err


def test_frames_keep_their_numbers_and_points_with_low_scores_are_missing(tmp_path):
    (tmp_path / "dots.csv").write_text("frame,time_s,a_u_px,a_v_px\n19,0,1,2\n20,1,1,2\n")
    assert figure.read_points_csv(tmp_path / "dots.csv", 2).numbers == [19, 20]
    header = ",".join(f"right_{joint}_{what}" for joint in ("knee", "ankle") for what in ("x", "y", "score"))
    (tmp_path / "keypoints.csv").write_text(f"frame,{header}\n7,1,2,0.9,3,4,0.19\n8,1,2,0.2,3,4,0.9\n")
    points = figure.read_tracks(tmp_path / "keypoints.csv", 25.0)
    assert points.numbers == [7, 8]
    np.testing.assert_array_equal(np.isfinite(points.positions).all(axis=2), [[True, False], [True, True]])


def test_options_for_people_are_refused_for_points(tmp_path, memo_command):
    (tmp_path / "dots.csv").write_text("time_s,a_u_px,a_v_px\n0,1,2\n1,1,2\n")
    options = ["--person", "0", "--image-size", "10x10", "--out", tmp_path / "out"]
    code, _, err = memo_command("planar", tmp_path / "dots.csv", *options)
    assert code == 1 and "is a table of points and not of keypoints: leave --person, --image-size out" in err
