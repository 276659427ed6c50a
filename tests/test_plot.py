"""Drawing and plotting: the rasteriser against its definition, videos and figures by what is in them."""

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from memo.overlay import (
    CONTOUR,
    LEFT,
    PEOPLE,
    RIGHT,
    draw_row,
    draw_rows,
    draw_segments,
    draw_text,
    write_overlay,
)
from memo.plot import (
    _cut_at_wraps,
    _phase_line,
    plot_angles,
    plot_motion,
    plot_similarity,
    plot_start,
    write_plots,
)
from memo.video import Frame, VideoReader

WHITE = (255, 255, 255)
pixel = st.floats(-15, 40)
anything = st.floats(-1e7, 1e7) | st.just(float("nan"))


def canvas(height=40, width=60):
    return np.zeros((height, width, 3), np.uint8)


def test_a_horizontal_line_of_one_pixel_fills_its_row():
    rgb = canvas()
    draw_segments(rgb, np.array([[[-5.0, 7.0], [70.0, 7.0]]]), WHITE, 1.0)
    assert (rgb[7] == 255).all() and rgb.sum() == 3 * 255 * 60


def test_a_line_between_rows_is_shared_by_them():
    rgb = canvas()
    draw_segments(rgb, np.array([[[-5.0, 7.25], [70.0, 7.25]]]), WHITE, 1.0)
    np.testing.assert_allclose(rgb[7:9, 30, 0], [191, 64], atol=1)


@given(st.tuples(pixel, pixel), st.tuples(pixel, pixel), st.floats(1, 5))
@settings(max_examples=60, deadline=None)
def test_every_pixel_follows_its_distance(start, end, width_px):
    rgb = canvas(20, 30)
    draw_segments(rgb, np.array([[start, end]]), WHITE, width_px)
    v, u = np.mgrid[:20, :30]
    beside = np.subtract(end, start)
    from_start, from_end = np.stack([u, v], -1) - start, np.stack([u, v], -1) - end
    distance = np.minimum(np.linalg.norm(from_start, axis=2), np.linalg.norm(from_end, axis=2))
    between = (from_start @ beside > 0) & (from_end @ beside < 0)
    cross = np.abs(from_start[..., 0] * beside[1] - from_start[..., 1] * beside[0])
    distance[between] = cross[between] / np.linalg.norm(beside)
    expected = 255 * np.clip(width_px / 2 + 0.5 - distance, 0, 1)
    assert np.abs(rgb[..., 0] - expected).max() <= 1.5


@given(st.lists(st.tuples(anything, anything, anything, anything), max_size=5))
@settings(max_examples=60, deadline=None)
def test_points_far_away_or_unknown_do_no_harm(rows):
    rgb = canvas(height=8, width=8)
    draw_segments(rgb, np.array(rows).reshape(-1, 2, 2), WHITE, 2.0)


def test_overlapping_segments_are_not_blended_twice():
    once, twice = canvas(), canvas()
    segment = np.array([[5.0, 5.0], [50.0, 30.0]])
    draw_segments(once, segment[None], WHITE, 1.5, opacity=0.5)
    draw_segments(twice, np.stack([segment, segment]), WHITE, 1.5, opacity=0.5)
    np.testing.assert_array_equal(once, twice)


def test_text_leaves_ink_and_stays_in_the_picture():
    rgb = canvas(height=20, width=30)
    draw_text(rgb, "a text that is far too long")
    draw_text(rgb, "below the picture", line=9)
    for at in ((-5, -5), (28, 18), (-500, 3), (3, 500)):
        draw_text(rgb, "12", at=at)
    assert rgb.max() > 150


def test_people_have_numbers_over_their_heads_in_colours_unlike_the_sides(core):
    for colour in PEOPLE:
        assert all(np.abs(np.subtract(colour, side)).max() > 60 for side in (LEFT, RIGHT)), colour
    track = core.Track([0.0, 0.0], core.Camera((640, 480)), "tracked")
    track.columns |= {"frame": np.array([0, 0]), "person": np.array([0, 1]), "walk": np.array([0, 1])}
    heads_u = (200.0, 500.0)
    track.contours = lambda row: [np.array([[heads_u[row], 150.0], [heads_u[row], 400.0]])]
    grey = np.full((480, 640), 100, np.uint8)
    both, one = draw_rows(grey, track, [0, 1]), draw_rows(grey, track, [1])
    for u, person, rgb in ((200, 0, both), (500, 1, both), (500, 1, one)):
        number = rgb[125:145, u - 10 : u + 10].reshape(-1, 3).astype(int)
        assert np.abs(number - PEOPLE[person]).max(axis=1).min() < 40, (u, person)
    assert (one[125:145, 190:210] == 100).all()


def test_numbers_over_heads_are_those_of_the_legend_and_of_the_files(core, monkeypatch):
    track = core.Track([0.0, 0.0], core.Camera((640, 480)), "tracked")
    track.columns |= {"frame": np.array([0, 0]), "person": np.array([0, 1]), "walk": np.array([0, 1])}
    track.contours = lambda row: [np.array([[200.0 + 300 * row, 150.0], [200.0 + 300 * row, 400.0]])]
    written = []
    monkeypatch.setattr("memo.overlay.draw_text", lambda rgb, text, *place, **given: written.append(text))
    draw_rows(np.full((480, 640), 100, np.uint8), track, [0, 1])
    assert written[:2] == ["0", "1"]
    assert [text.split(":")[0] for text in written[3:5]] == ["person 0", "person 1"]


@pytest.fixture
def track(core):
    tracker = core.Tracker(camera=core.Camera((161, 121)))
    for index in range(30):
        tracker.update(np.full((121, 161), 100, np.uint8), index / 25)
    return tracker.finish()


def test_overlay_keeps_times_and_draws_only_where_the_track_is(tmp_path, core):
    size = (481, 361)  # H.264 needs even sizes
    track = core.Track(np.arange(30) / 25, core.Camera(size), "tracked")
    track.columns["frame"] = np.arange(1, 31)  # frame 0 is before the track
    grey = np.full(size[::-1], 100, np.uint8)
    times_s = [0.0, 0.04, 0.3, 0.31]
    path = tmp_path / "overlay.mp4"
    assert write_overlay(path, [Frame(i, t, grey) for i, t in enumerate(times_s)], track) == 4
    with VideoReader(path) as reader:
        assert reader.size == (482, 362)
        np.testing.assert_allclose([frame.time_s for frame in reader], times_s, atol=1e-3)
    with av.open(str(path)) as container:
        pictures = [frame.to_ndarray(format="rgb24").astype(int) for frame in container.decode(video=0)]
    (u, v), _ = track.contours(0)[0]
    before, tracked = (picture[round(v) + 10, round(u)] for picture in pictures[:2])
    assert np.ptp(before) < 10 and tracked[0] - tracked[2] > 30  # grey, then yellow
    assert list(tmp_path.iterdir()) == [path]


def test_small_frames_are_enlarged_about_pixel_centres(core):
    track = core.Track([0.0], core.Camera((180, 144)), "tracked")
    track.contours = lambda row: [np.array([[100.0, 50.0], [100.0, 70.0]])]
    rgb = draw_row(np.zeros((144, 180), np.uint8), track, 0)
    assert rgb.shape == (432, 540, 3)
    yellow = np.flatnonzero((rgb[180] == CONTOUR).all(axis=1))
    assert yellow.mean() == 301  # the middle of the nine pixels that pixel 100 became


def test_frames_of_another_size_and_impossible_inks_are_refused(core):
    track = core.Track([0.0], core.Camera((180, 144)), "tracked")
    for frame, words in (
        (np.zeros((10, 180), np.uint8), "the track is of frames of size 180x144, got a frame of 180x10"),
        (np.zeros((180, 144), np.uint8), "got a frame of 144x180"),
        (np.zeros((144, 180, 3), np.uint8), r"grey values of shape \(height, width\), got shape"),
    ):
        with pytest.raises(ValueError, match=words):
            draw_row(frame, track, 0)
    with pytest.raises(ValueError, match="180x144 averaged 2 by 2, got a frame of 180x144"):
        draw_row(np.zeros((144, 180), np.uint8), track, 0, shrink=2)
    assert draw_row(np.zeros((72, 90), np.uint8), track, 0, shrink=2).shape[2] == 3
    segment = np.array([[[5.0, 5.0], [50.0, 30.0]]])
    for colour in ((256, 0, 0), (-1, 0, 0), (0.5, 0, 0), (1, 2), None, "red"):
        for draw in (
            lambda ink: draw_segments(canvas(), segment, ink, 2.0),
            lambda ink: draw_text(canvas(), "a", ink),
        ):
            with pytest.raises(ValueError, match="a colour must be three whole numbers from 0 to 255, got"):
                draw(colour)
    for opacity in (-1, 2, float("nan")):
        with pytest.raises(ValueError, match="opacity must be from 0 to 1, got"):
            draw_segments(canvas(), segment, WHITE, 2.0, opacity=opacity)
    for width in (0, -1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="width_px must be positive and finite"):
            draw_segments(canvas(), segment, WHITE, width)


def test_overlay_of_nothing_leaves_no_file(tmp_path, track):
    with pytest.raises(ValueError, match="no frames"):
        write_overlay(tmp_path / "overlay.mp4", [], track)
    assert not list(tmp_path.iterdir())


def axes(*grid):
    return Figure().subplots(*grid, squeeze=False)


def test_similarity_shows_the_curve_of_its_frame(track):
    ax = plot_similarity(axes(1, 1)[0, 0], track, 3)
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), track.start.similarity[3])
    assert ax.lines[1].get_xdata()[0] == track.start.phase[3]


def test_start_line_passes_through_the_tracked_phases(track):
    ax = plot_start(axes(1, 1)[0, 0], track)
    frames, phases = ax.lines[1].get_data()
    known = ~np.isnan(phases)
    off = (phases - frames * 0.9 / 25 + 0.5)[known] % 1 - 0.5
    assert known.sum() > 190 and np.abs(off).max() < 1e-6
    frames, swapped = ax.lines[2].get_data()
    known = ~np.isnan(swapped)
    np.testing.assert_allclose(swapped[known], (frames[known] * 0.9 / 25 + 0.5) % 1, atol=1e-6)


def test_two_frames_have_a_line_and_one_has_none():
    two = {"frame": np.array([4, 6]), "phase": np.array([0.9, 0.1]), "walk": np.array([0, 0])}
    assert _phase_line(two, np.array([4]))(5) == pytest.approx(1.0)
    assert _phase_line({name: values[:1] for name, values in two.items()}, np.array([4])) is None


def test_the_line_of_phase_is_that_of_the_longest_walk_that_starts_there():
    frames, phases = np.array([4, 5, 4, 5, 6]), np.array([0.1, 0.2, 0.5, 0.52, 0.54])
    both = {"frame": frames, "phase": phases, "walk": np.array([0, 0, 1, 1, 1])}
    assert _phase_line(both, np.array([4, 5]))(6) == pytest.approx(0.54)


def test_a_line_is_cut_where_the_phase_starts_anew_forwards_and_backwards():
    for phases in ([0.7, 0.9, 0.1, 0.3], [0.3, 0.1, 0.9, 0.7]):
        cut, frames = _cut_at_wraps(phases, range(4))
        np.testing.assert_array_equal(frames, [0, 1, np.nan, 2, 3])
        np.testing.assert_array_equal(cut[[0, 1, 3, 4]], phases)


def test_motion_shows_measured_left_and_filtered_right(track):
    grid = plot_motion(axes(3, 2), track)
    for row, (key, name) in zip(grid, (("x", "x_m"), ("z", "z_m"), ("phase", "phase")), strict=True):
        np.testing.assert_array_equal(row[0].lines[0].get_ydata(), track.measured[key])
        filtered = row[1].lines[0].get_ydata()
        np.testing.assert_allclose(filtered[~np.isnan(filtered)], track.columns[name])
        assert len(row[1].collections) == 1  # the band


def test_angles_show_both_sides_and_heel_strikes(track):
    hip, knee = plot_angles(axes(2, 1)[:, 0], track)
    np.testing.assert_array_equal(knee.lines[1].get_ydata(), track.columns["left_knee_deg"])
    assert len(hip.lines) == 2 + len(track.events)


def test_all_plots_are_saved(tmp_path, track):
    paths = write_plots(track, tmp_path)
    assert {path.name for path in paths} == {"similarity.png", "start.png", "motion.png", "angles.png"}
    for path in paths:
        with VideoReader(path) as reader:
            assert min(reader.size) > 300
    track.start = None
    assert {path.name for path in write_plots(track, tmp_path)} == {"motion.png", "angles.png"}
