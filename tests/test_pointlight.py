"""Pictures of point-light displays, measured with OpenCV; loops, scrambling, actors and marker files."""

import csv
import json
import sys
from pathlib import Path
from types import SimpleNamespace

import memo
import numpy as np
import pytest
from fake_psychopy import SCREENS, stand_in
from motions import shared_motion

WALKER = memo.walker_motion(cycles=2)
MOTION = (WALKER.positions, WALKER.times_s, WALKER.names)


def spots(picture):
    """Centres (N, 2) of the bright spots of a picture, by OpenCV, spots that touch as one."""
    cv2 = pytest.importorskip("cv2")
    grey = picture[..., 0]
    _, areas, boxes, _ = cv2.connectedComponentsWithStats((grey > 0).astype(np.uint8))
    centres = []
    for index, (left, top, width, height, _) in enumerate(boxes[1:], start=1):
        part = np.s_[top : top + height, left : left + width]
        moments = cv2.moments(np.where(areas[part] == index, grey[part], 0).astype(np.float32))
        centres.append((left + moments["m10"] / moments["m00"], top + moments["m01"] / moments["m00"]))
    return np.array(centres)


def figure_height_px(display, **picture):
    """Vertical distance of the uppermost and the lowest spot over all frames."""
    frames = range(0, len(display.times_s), 10)
    v = np.concatenate([spots(*display.frames(start=t, stop=t + 1, **picture))[:, 1] for t in frames])
    return v.max() - v.min()


def test_every_condition_is_drawn_at_one_scale():
    height_m = np.ptp(WALKER.positions[::10, :, 2])
    upright = memo.pointlight(*MOTION, px_per_m=150)
    for options in ({}, {"inverted": True}, {"locomotion": "translating"}, {"azimuth_deg": 60.0}):
        display = memo.pointlight(*MOTION, px_per_m=150, **options)
        assert figure_height_px(display, size_px=(700, 400), dot_px=6) == pytest.approx(
            150 * height_m, abs=0.3
        )
    for options in (
        {"scramble_position": True},
        {"scramble_phase": "periodic"},
        {"noise_dots": 30},
        {"scramble_position": True, "noise_dots": 30},
    ):
        display = memo.pointlight(*MOTION, px_per_m=150, **options)
        assert np.allclose(display.centre_px, upright.centre_px)
        local = display.positions_px[:, :13] - display.positions_px[:, :13].mean(axis=0)
        before = upright.positions_px - upright.positions_px.mean(axis=0)
        assert np.allclose(
            np.ptp(local, axis=0), np.ptp(before, axis=0)
        )  # each trajectory as large as before


def test_a_spot_is_where_the_dot_is_to_a_part_of_a_pixel():
    display = memo.pointlight(*MOTION, azimuth_deg=70.0, px_per_m=400)
    (picture,) = display.frames(size_px=(501, 801), dot_px=9, start=7, stop=8)
    wanted = display.positions_px[7] - display.centre_px + (250, 400)
    found = spots(picture)
    alone = [w for w in wanted if np.sort(np.hypot(*(wanted - w).T))[1] > 12]
    assert len(alone) >= 8
    for place in alone:
        assert np.hypot(*(found - place).T).min() < 0.05


def test_the_loop_continues_where_it_starts_also_for_a_recording_that_drifts():
    frames = np.arange(170) / 60
    walk = memo.walker_motion(170)
    drift = np.stack([0.01 * frames**2, 0.02 * np.sin(2 * frames), 0.01 * frames], axis=-1)
    recorded = walk.positions + drift[:, None]
    for motion in (MOTION, (recorded, walk.times_s, walk.names)):
        display = memo.pointlight(*motion, cycles=2)
        assert display.period_s == pytest.approx(walk.cycle_s, abs=0.02)
        paths = display.positions_px
        steps = np.linalg.norm(np.diff(paths, axis=0), axis=2).max(axis=1)
        seam = np.linalg.norm(paths[0] - paths[-1], axis=1).max()
        assert seam <= steps.max()
        assert np.allclose(paths[: len(paths) // 2], paths[len(paths) // 2 :])


def test_phase_scrambling_keeps_each_trajectory_and_its_spectrum():
    display = memo.pointlight(*MOTION, cycles=2)
    shifted = memo.pointlight(*MOTION, cycles=2, scramble_phase="periodic", seed=5)
    spectrum, other = (np.abs(np.fft.rfft(d.positions_px, axis=0)) for d in (display, shifted))
    assert np.allclose(spectrum, other, atol=1e-6)
    shifts = set()
    for before, after in zip(
        display.positions_px.swapaxes(0, 1), shifted.positions_px.swapaxes(0, 1), strict=True
    ):
        turns = [s for s in range(len(before)) if np.allclose(np.roll(before, s, axis=0), after)]
        assert turns
        shifts.add(turns[0])
    assert len(shifts) > 6
    seam = np.linalg.norm(shifted.positions_px[0] - shifted.positions_px[-1], axis=1)
    steps = np.linalg.norm(np.diff(display.positions_px, axis=0), axis=2).max(axis=0)
    assert (seam <= steps + 1e-9).all()


def test_scrambling_keeps_heights_or_stays_within_a_limit():
    upright = memo.pointlight(*MOTION).positions_px
    level = memo.pointlight(*MOTION, scramble_position=True, scramble_axes="horizontal").positions_px
    assert np.array_equal(level[..., 1], upright[..., 1]) and not np.allclose(level[..., 0], upright[..., 0])
    near = memo.pointlight(*MOTION, scramble_position=True, scramble_limit_px=20).positions_px
    assert 10 < np.abs(near - upright).max() <= 20 + 1e-9
    for options, words in (
        ({"scramble_axes": "vertical"}, "need scramble_position"),
        ({"scramble_position": True, "scramble_axes": "up"}, "one of both, horizontal, vertical"),
        ({"tempo": 2.0}, "tempo needs cycles"),
        ({"period_s": 1.0}, "only with cycles"),
    ):
        with pytest.raises(ValueError, match=words):
            memo.pointlight(*MOTION, **options)
    still = np.random.default_rng(0).normal(size=(80, 3, 3))
    with pytest.raises(ValueError, match=r"no period found.*give period_s"):
        memo.pointlight(still, np.arange(80) / 60, ["a", "b", "c"], cycles=1)
    with pytest.raises(ValueError, match=r"up to 0.07 s: no lag fits better than those around it; give"):
        memo.pointlight(still[:6], np.arange(6) / 60, ["a", "b", "c"], cycles=1)


def test_a_walk_of_whole_cycles_has_the_nearest_speed():
    slow = memo.walker_motion(cycles=3, speed_mps=0.9, rate_hz=100)
    assert len(slow.times_s) == 3 * round(slow.cycle_s * 100)
    assert slow.cycle_s * 100 == pytest.approx(round(slow.cycle_s * 100))
    hips = slow.positions[:, [6, 9]].mean(axis=1)
    speed = (hips[-1, 0] - hips[0, 0]) / slow.times_s[-1]
    assert speed == pytest.approx(0.9, abs=0.01)
    with pytest.raises(ValueError, match="either frames or cycles"):
        memo.walker_motion(10, cycles=1)
    for speed in (-1.0, 0.0, float("nan"), 1e-9):
        with pytest.raises(ValueError, match="cycle in frames"):
            memo.walker_motion(cycles=1, speed_mps=speed)


def test_actors_share_a_picture_and_keep_what_they_show():
    one, other = memo.pointlight(*MOTION), memo.pointlight(*MOTION, mirrored=True, noise_dots=5)
    both = memo.pointlight_together([one, other], [(-100, 0), (100, 0)])
    assert both.points == 26 and both.positions_px.shape[1] == 13 + 18
    assert np.allclose(both.positions_px[:, 13:], other.positions_px + np.array([100, 0]))
    assert both.labels[0].tolist() == [*range(26), *[-1] * 5]
    shorter = memo.pointlight(WALKER.positions[:9], WALKER.times_s[:9], WALKER.names)
    with pytest.raises(ValueError, match="actor 1 has other times"):
        memo.pointlight_together([one, shorter])


def test_pictures_have_the_colours_asked_for_and_alpha_mixes_to_the_same():
    display = memo.pointlight(*MOTION, px_per_m=100)
    options = {"size_px": (200, 220), "dot_px": 7, "colour": (250, 120, 0), "stop": 3}
    opaque = display.frames(background=(20, 30, 40), **options).astype(float)
    clear = display.frames(alpha=True, **options).astype(float)
    assert opaque.shape == (3, 220, 200, 3) and clear.shape == (3, 220, 200, 4)
    share = clear[..., 3:] / 255
    assert np.abs(share * clear[..., :3] + (1 - share) * (20, 30, 40) - opaque).max() <= 1
    hard = display.frames(smooth=False, shape="square", **options)
    assert {tuple(pixel) for pixel in hard.reshape(-1, 3).tolist()} == {(250, 120, 0), (0, 0, 0)}
    for options, words in (
        ({"dot_px": 0}, "dot_px"),
        ({"size_px": (0, 9)}, "size_px"),
        ({"shape": "star"}, "one of disc, square, gaussian"),
        ({"size_px": (16000, 16000)}, "draw fewer at a time"),
    ):
        with pytest.raises(ValueError, match=words):
            display.frames(**options)


def test_lossless_video_and_pictures_hold_the_pixels_of_frames(tmp_path):
    av, image = pytest.importorskip("av"), pytest.importorskip("PIL.Image")
    from memo.display import write_display_png, write_display_video

    display = memo.pointlight(WALKER.positions[:8], WALKER.times_s[:8], WALKER.names, px_per_m=60)
    picture = {"size_px": (161, 121), "colour": (255, 200, 30), "background": (9, 80, 3)}
    write_display_video(tmp_path / "d.mkv", display, lossless=True, **picture)
    with av.open(str(tmp_path / "d.mkv")) as video:
        read = [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]
    assert np.array_equal(read, display.frames(**picture))
    paths = write_display_png(tmp_path / "png", display, **picture)
    assert [path.name for path in paths] == [f"{index:05d}.png" for index in range(8)]
    read = [np.asarray(image.open(path)) for path in paths]
    assert np.array_equal(read, display.frames(alpha=True, **picture))


def write_markers(path):
    """A table of a walker by markers with names of their own; two markers at each wrist."""
    names = [f"m{index}" for index in range(13)] + ["extra"]
    points = np.concatenate([WALKER.positions, WALKER.positions[:, [2]] + (0.02, 0, 0)], axis=1)
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["time_s", *(f"{name}_{axis}" for name in names for axis in "xyz")])
        for time_s, frame in zip(WALKER.times_s, points, strict=True):
            out.writerow([repr(float(time_s)), *map(repr, frame.ravel().tolist())])


def test_markers_are_named_by_a_table_and_missing_ones_are_listed(tmp_path, memo_command):
    write_markers(tmp_path / "walk.csv")
    names = dict(zip(memo.keypoints.layouts()["MOCAP_12"], range(12), strict=True))
    lines = [f'{joint} = "M{index}"' for joint, index in names.items() if joint != "right_wrist"]
    (tmp_path / "map.toml").write_text("\n".join([*lines, 'right_wrist = ["m2", "extra"]', 'head = "m12"']))
    arguments = ["pointlight", tmp_path / "walk.csv", "--markers", tmp_path / "map.toml", "--size", "90x90"]
    code, out, err = memo_command(*arguments, "--out", tmp_path / "out", "--json")
    assert code == 0, err
    assert json.loads(out)["frames"] == len(WALKER.times_s)
    with open(tmp_path / "out" / "dots.csv", newline="") as file:
        row = next(csv.DictReader(file))
    usual = memo.pointlight(*MOTION).positions_px[0]
    assert "HEAD_u_px" in row
    assert float(row["RWR_u_px"]) == pytest.approx(usual[2, 0] + 0.01 * 200, abs=1e-3)
    assert float(row["LKN_v_px"]) == pytest.approx(usual[10, 1], abs=1e-3)
    (tmp_path / "map.toml").write_bytes(b"\xef\xbb\xbf" + (tmp_path / "map.toml").read_bytes())
    code, _, err = memo_command(*arguments, "--out", tmp_path / "marked")
    assert code == 0, err
    (tmp_path / "bad.toml").write_text('right_knee = "RKNE"\nleft_knee = ["m10", "nothing"]\n')
    arguments[3] = tmp_path / "bad.toml"
    code, _, err = memo_command(*arguments, "--out", tmp_path / "bad")
    assert code == 1 and "no points for RKNE (right_knee), nothing (left_knee)" in err
    for text, words in (
        ('tail = "m1"\n', "got tail"),
        ('right_hip = "m1"\nleft_hip = "m2"\nright_hip = "m3"\n', "right_hip has two entries; list the"),
        ('head = "m1"\nHEAD = "m3"\n', "head has two entries; list the"),
        ('right_hip = "m1"\n  RHP = "m3"\n', "right_hip has two entries; list the"),
        ("", "names no joint; wanted lines such as right_hip ="),
        ("# right_hip\n", "names no joint; wanted lines such as right_hip ="),
        ('right_hip = "m1\n', "not TOML"),
        ("right_hip = []\n", "right_hip: wanted the name of a marker"),
    ):
        (tmp_path / "bad.toml").write_text(text)
        code, _, err = memo_command(*arguments, "--out", tmp_path / "bad")
        assert code == 1 and err.startswith(f"memo: {tmp_path / 'bad.toml'}: "), err
        assert words in err and "overwrite" not in err and "walk.csv" not in err


@pytest.mark.parametrize(
    ("options", "wanted", "words"),
    [
        ("jump.csv --cycles 1", 1, "no period found up to 1.07 s: at the best lag, the mismatch is 0."),
        ("jump.csv --cycles 1", 1, "wanted); give --period\n"),
        ("short.csv --cycles 1", 1, "no lag fits better than those around it; give --period\n"),
        ("--speed 9", 2, "--speed 9 is not a walking speed in m/s (up to 4)"),
        ("--speed 9 --cycles 1", 2, "--speed 9 is not a walking speed in m/s (up to 4)"),
        ("--speed nan", 2, "--speed nan is not a walking speed"),
        ("--noise-dots -3", 2, "Invalid value for '--noise-dots'"),
        ("--lifetime 0", 2, "Invalid value for '--lifetime'"),
        ("--azimuth-deg nan", 2, "--azimuth-deg nan must be finite"),
        ("--px-per-m 0", 2, "--px-per-m 0 must be positive"),
        ("--shape star", 2, "Invalid value for '--shape'"),
        ("--shape gaussian --hard", 2, "--hard has no effect with --shape gaussian"),
        ("--noise-dots 3 --noise-kind star", 2, "Invalid value for '--noise-kind'"),
        ("--size 20000x9", 2, "--size must be between 1 and 16384 pixels"),
        ("--fps 0 --cycles 1", 2, "--fps 0 must be positive and finite"),
        ("walk.csv --cycles 1 --period 9", 1, "--period of 9 s needs a longer motion"),
    ],
)
def test_errors_name_the_options_of_the_command(tmp_path, memo_command, monkeypatch, options, wanted, words):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    write_table("walk.csv", WALKER)
    write_table("short.csv", memo.walker_motion(4))
    still = memo.walker_motion(80)
    still.positions[:] += np.random.default_rng(0).normal(size=still.positions.shape)
    write_table("jump.csv", still)
    code, said, err = memo_command("pointlight", *options.split())
    assert code == wanted and words in err and not said, err
    assert "period_s" not in err and "shortened" not in err


def test_the_average_walker_loops_at_few_frames_per_second(tmp_path, memo_command):
    common = ["pointlight", "--cycles", "1", "--size", "64x64", "--out", tmp_path]
    for options in (["--speed", "2", "--fps", "5"], ["--speed", "4", "--fps", "25"]):
        code, said, err = memo_command(*common, *options)
        assert code == 0 and " loops." in said, err


def test_no_picture_of_an_earlier_display_stays(tmp_path, memo_command):
    out = tmp_path / "out"
    common = ["pointlight", "--size", "64x64", "--out", out]
    assert memo_command(*common, "--seconds", "0.1", "--png")[0] == 0
    for name in ("note.txt", "cover.png"):
        (out / "frames" / name).write_text("mine")
    (out / "notes.txt").write_text("mine")
    assert memo_command(*common, "--seconds", "0.2", "--lossless")[0] == 0
    left = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert left == {
        *("dots.csv", "labels.csv", "display.mkv", "notes.txt", "frames/note.txt", "frames/cover.png")
    }
    assert memo_command(*common, "--seconds", "0.1", "--png")[0] == 0
    assert len(list((out / "frames").iterdir())) == 6 + 2
    for name in ("note.txt", "cover.png"):
        assert (out / "frames" / name).read_text() == "mine"
        (out / "frames" / name).unlink()
    assert memo_command(*common, "--seconds", "0.1", "--dot-px", "0")[0] != 0
    assert (out / "frames" / "00000.png").exists() and not (out / "display.mkv").exists()
    assert memo_command(*common, "--seconds", "0.1")[0] == 0
    assert not (out / "frames").exists()


@pytest.mark.parametrize("up", ["y", "z"])
def test_a_file_has_the_same_size_under_other_names(tmp_path, memo_command, up):
    from memo.formats import Motion, read_motion, write_motion

    joints = memo.keypoints.layouts()["MOCAP_12"]
    in_mm = Motion((*joints, "head"), WALKER.times_s, 10 * WALKER.positions)  # BVH files are written in cm
    write_motion(tmp_path / "walk.bvh", in_mm, up)
    text = (tmp_path / "walk.bvh").read_text()
    names = [line.split()[1] for line in text.splitlines() if line.split()[:1] in (["ROOT"], ["JOINT"])]
    for name in names:
        text = text.replace(f"ROOT {name}\n", f"ROOT q_{name}\n").replace(
            f"JOINT {name}\n", f"JOINT q_{name}\n"
        )
    (tmp_path / "renamed.bvh").write_text(text)
    bones = {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot"}
    lines = [f'{s}_{part} = "q_{s.capitalize()}{bones[part]}"' for s in ("right", "left") for part in bones]
    (tmp_path / "map.toml").write_text("\n".join(lines))
    shown, notes = [], []
    for name, also in (("walk", []), ("renamed", ["--markers", tmp_path / "map.toml"])):
        out = tmp_path / name
        code, said, err = memo_command("pointlight", tmp_path / f"{name}.bvh", *also, "--out", out, "--json")
        assert code == 0, err
        notes.append(json.loads(said)["notes"])
        with open(out / "dots.csv", newline="") as file:
            shown.append([[float(row["RHP_v_px"]), float(row["LAN_v_px"])] for row in csv.DictReader(file)])
    assert notes[0] == notes[1] and "mm was assumed" in notes[0][1]
    assert np.allclose(shown[0], shown[1], atol=1e-3)
    hip, ankle = (WALKER.positions[:, WALKER.names.index(name), 2] for name in ("RHP", "LAN"))
    assert np.ptp(np.mean(shown[0], axis=0)) == pytest.approx(200 * np.mean(hip - ankle), abs=2)
    assert read_motion(tmp_path / "renamed.bvh").notes != tuple(notes[0])


def test_the_region_of_noise_dots_has_the_size_asked_for(tmp_path, memo_command):
    common = ["pointlight", "--seconds", "0.5", "--size", "64x64", "--out", tmp_path, "--noise-dots", "400"]
    sizes = []
    for options in ([], ["--noise-area", "3"]):
        code, _, err = memo_command(*common, "--noise-kind", "flicker", *options)
        assert code == 0, err
        with open(tmp_path / "dots.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        uv = np.array([[float(row[key]) for key in row if key.endswith("_px")] for row in rows])
        figure, noise = uv[:, : 2 * 13].reshape(-1, 2), uv[:, 2 * 13 :].reshape(-1, 2)
        sizes.append(np.ptp(noise, axis=0) / np.ptp(figure, axis=0))
        middles = [(part.min(axis=0) + part.max(axis=0)) / 2 for part in (figure, noise)]
        assert np.allclose(*middles, atol=5)
    assert np.allclose(sizes, [[1.5, 1.5], [3, 3]], rtol=0.02)
    for area, code, words in (
        ("0", 2, "--noise-area 0 must be positive"),
        ("2000", 1, "--noise-area must be"),
    ):
        ended, _, err = memo_command(*common, "--noise-area", area)
        assert ended == code and words in err


def test_several_actors_share_the_noise_dots_and_loop_only_with_equal_cycles(tmp_path, memo_command):
    files = []
    for index, speed in enumerate((1.0, 1.6, 1.3)):
        files.append(tmp_path / f"{index}.csv")
        write_table(files[-1], memo.walker_motion(150, speed_mps=speed))
    common = ["--size", "64x64", "--out", tmp_path / "out"]
    for options, dots in (([], 3 * 13 + 20), (["--lifetime", "3", "--dots", "4"], 3 * 4 + 20)):
        code, said, err = memo_command(
            "pointlight", *files, "--noise-dots", "20", *options, *common, "--json"
        )
        assert code == 0 and json.loads(said)["dots"] == dots, err
    with open(tmp_path / "out" / "labels.csv", newline="") as file:
        first = [row["shows"] for row in csv.DictReader(file) if row["frame"] == "0"]
    assert first.count("noise") == 20
    code, said, err = memo_command("pointlight", *files[:2], "--cycles", "2", *common)
    assert code == 1 and "take 1.267, 0.8 s" in err and "leave --cycles out" in err
    code, said, err = memo_command("pointlight", files[0], files[0], "--cycles", "2", *common)
    assert code == 0 and " loops." in said, err


def written_dots(folder):
    """Pixels (T, N, 2) of `dots.csv`, and the names of the dots."""
    with open(folder / "dots.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    names = [name.removesuffix("_u_px") for name in rows[0] if name.endswith("_u_px")]
    return np.array([[[float(row[f"{n}_{x}_px"]) for x in "uv"] for n in names] for row in rows]), names


def actor(path, number, *, frames=slice(None), shift_m=(0, 0, 0), noise_m=0.0, **walk):
    """Writes a walker as the file of one actor."""
    made = memo.walker_motion(200, **walk)
    noise = np.random.default_rng(number).normal(size=made.positions.shape) * noise_m
    points = (made.positions + noise + np.array(shift_m))[frames]
    write_table(path, SimpleNamespace(positions=points, times_s=made.times_s[frames], names=made.names))
    return path


@pytest.mark.parametrize("noise_m", [0.0, 0.004])
def test_actors_keep_their_timing_in_repeated_cycles(tmp_path, memo_command, noise_m):
    files = [
        actor(tmp_path / f"{k}.csv", k, phase=phase, noise_m=noise_m, shift_m=(2 * k, 0, 0))
        for k, phase in enumerate((0.0, 0.3))
    ]
    code, said, err = memo_command(
        "pointlight", *files, "--cycles", "1", "--size", "64x64", "--out", tmp_path / "out"
    )
    assert code == 0 and " loops." in said, err
    uv, names = written_dots(tmp_path / "out")
    step = [uv[:, names.index(f"actor{k}_RAN"), 0] - uv[:, names.index(f"actor{k}_RHP"), 0] for k in (1, 2)]
    first, second = (np.angle(np.fft.fft(one)[1]) / (2 * np.pi) for one in step)
    assert (second - first) % 1 == pytest.approx(0.3, abs=0.01)


def test_a_scene_of_actors_is_flipped_as_a_whole(tmp_path, memo_command):
    files = [
        actor(tmp_path / "a.csv", 0, frames=slice(0, 60), shift_m=(-1, 0, 0)),
        actor(tmp_path / "b.csv", 1, frames=slice(0, 60), shift_m=(1, 0, 0), height_m=1.2, heading_deg=180.0),
    ]
    shown = {}
    for options in ("", "--mirrored", "--inverted", "--apart-m 2 --mirrored", "--apart-m 2"):
        out = tmp_path / "out"
        code, _, err = memo_command("pointlight", *files, *options.split(), "--size", "64x64", "--out", out)
        assert code == 0, err
        shown[options] = written_dots(out)[0]
    for flipped, as_recorded, axis in (
        ("--mirrored", "", 0),
        ("--inverted", "", 1),
        ("--apart-m 2 --mirrored", "--apart-m 2", 0),
    ):
        sums = shown[flipped][..., axis] + shown[as_recorded][..., axis]
        assert np.ptp(sums) < 1e-3, flipped  # one line for all dots of all actors
        other = 1 - axis
        assert np.allclose(shown[flipped][..., other], shown[as_recorded][..., other], atol=1e-3)


def test_actors_side_by_side_stay_on_their_ground(tmp_path, memo_command):
    files = [
        actor(tmp_path / "a.csv", 0),
        actor(tmp_path / "b.csv", 1, height_m=1.2),
    ]
    shown = []
    for options in ([], ["--apart-m", "1.5"]):
        out = tmp_path / "out"
        code, _, err = memo_command("pointlight", *files, *options, "--size", "64x64", "--out", out)
        assert code == 0, err
        shown.append(written_dots(out)[0])
    assert np.allclose(shown[0][..., 1], shown[1][..., 1], atol=1e-3)
    left, right = (shown[1][:, part, 0] for part in (slice(13), slice(13, None)))
    middles = [(part.min() + part.max()) / 2 for part in (left, right)]
    assert middles[1] - middles[0] == pytest.approx(1.5 * 200, abs=0.01)
    for apart in ("nan", "0", "-1", "1e9"):
        code, _, err = memo_command("pointlight", *files, "--apart-m", apart, "--size", "64x64")
        assert code == 2 and err.startswith("memo: --apart-m ") and "offsets_px" not in err, err


def test_files_of_one_recording_keep_their_clock(tmp_path, memo_command):
    whole = actor(tmp_path / "a.csv", 0, frames=slice(0, 120))
    late = actor(tmp_path / "b.csv", 0, frames=slice(30, 150))
    out = tmp_path / "out"
    common = ["--locomotion", "translating", "--size", "64x64", "--out", out]
    code, said, err = memo_command("pointlight", whole, late, *common)
    assert code == 0 and "Cut to the 90 frames from 0.5 to 1.983 s, which all motions have in common." in said
    uv, _ = written_dots(out)
    assert np.allclose(uv[:, :13], uv[:, 13:], atol=1e-3) and len(uv) == 90  # the same person twice
    later = actor(tmp_path / "c.csv", 0, frames=slice(140, 200))
    code, said, err = memo_command("pointlight", whole, later, *common)
    assert code == 0 and "recorded at different times: all begin with their first frames." in said, err
    assert "Cut to 60 frames, the length of the shortest motion." in said
    assert len(written_dots(out)[0]) == 60


def test_the_file_of_an_actor_is_named_in_errors(tmp_path, memo_command):
    files = [actor(tmp_path / "a.csv", 0), actor(tmp_path / "b.csv", 1, frames=slice(0, 20))]
    for wrong in (files, files[::-1]):
        code, _, err = memo_command("pointlight", *wrong, "--cycles", "1", "--out", tmp_path / "out")
        assert code == 1 and err.startswith(f"memo: {wrong[0]}: no period found"), err
    code, _, err = memo_command("pointlight", *files, "--noise-dots", "9", "--noise-area", "2000")
    assert code == 1 and err.startswith("memo: --noise-area must be"), err


def test_the_pelvis_is_fixed_by_any_name_of_the_hips():
    hips = [WALKER.names.index(name) for name in ("RHP", "LHP")]
    for right, left in (("RHP", "LHP"), ("RHip", "LHip"), ("right_hip", "left_hip"), ("R_HIP", "L_HIP")):
        names = list(WALKER.names)
        names[hips[0]], names[hips[1]] = right, left
        display = memo.pointlight(WALKER.positions, WALKER.times_s, names, locomotion="pelvis")
        assert np.ptp(display.positions_px[:, hips].mean(axis=1), axis=0).max() < 1e-9
    with pytest.raises(
        ValueError, match=r"needs a right and a left hip: names such as RHP and LHP wanted, got a, b"
    ):
        memo.pointlight(WALKER.positions[:, :2], WALKER.times_s, ["a", "b"], locomotion="pelvis")


def test_a_common_cycle_is_found_for_several_actors():
    one, other = memo.walker_motion(150), memo.walker_motion(150, phase=0.4)
    period_s, start_s = memo.pointlight_cycle(
        [one.positions, other.positions], one.times_s, [one.names, other.names]
    )
    assert period_s == pytest.approx(one.cycle_s, abs=0.02) and 0 <= start_s <= 150 / 60 - period_s
    with pytest.raises(ValueError, match="at least one actor"):
        memo.pointlight_cycle([], one.times_s, [])
    with pytest.raises(ValueError, match="positions are of 1 actor, but names are 2 lists"):
        memo.pointlight_cycle([one.positions], one.times_s, [one.names, one.names])
    for start in (-1.0, float("nan"), 2.4):
        with pytest.raises(ValueError, match="cycle_start_s must be"):
            memo.pointlight(one.positions, one.times_s, one.names, cycles=1, cycle_start_s=start)


def test_idle_shifts_and_starts_are_refused():
    for options, words in (
        ({"max_shift_s": 0.1}, "max_shift_s needs scramble_phase"),
        ({"max_shift_s": float("nan")}, "max_shift_s needs scramble_phase"),
        ({"max_shift_s": 0.1, "scramble_phase": "periodic", "cycles": 1}, "max_shift_s needs scramble_phase"),
        ({"cycle_start_s": 0.1}, "cycle_start_s has an effect only with cycles"),
    ):
        with pytest.raises(ValueError, match=words):
            memo.pointlight(*MOTION, **options)


def test_the_size_of_a_video_with_odd_sides_is_stated(tmp_path, memo_command):
    common = ["pointlight", "--seconds", "0.1", "--out", tmp_path]
    av = pytest.importorskip("av")
    for size, shown, lossless in (
        ("33x21", (34, 22), False),
        ("33x21", (33, 21), True),
        ("32x22", (32, 22), False),
    ):
        code, said, err = memo_command(*common, "--size", size, *["--lossless"] * lossless)
        assert code == 0, err
        with av.open(str(tmp_path / ("display.mkv" if lossless else "display.mp4"))) as video:
            stream = video.streams.video[0]
            assert (stream.width, stream.height) == shown
        assert ("display.mp4 is 34x22" in said) is (shown == (34, 22))


def test_the_command_reports_dots_that_leave_the_picture_and_refuses_bad_pictures(tmp_path, memo_command):
    out = tmp_path / "out"
    common = ["pointlight", "--cycles", "1", "--size", "200x200", "--px-per-m", "150", "--out", out]
    code, said, _ = memo_command(*common, "--locomotion", "translating", "--lossless", "--png")
    assert code == 0 and "Dots leave the picture" in said
    needed = said.split("--size ")[1].split(" ")[0]
    assert len(list((out / "frames").iterdir())) == len(memo.walker_motion(cycles=1).times_s)
    code, said, _ = memo_command(*common[:4], needed, *common[5:], "--locomotion", "translating")
    assert code == 0 and "Dots leave" not in said
    for options, words in (
        (["--colour", "no"], "wanted a colour"),
        (["--size", "9"], "wanted two numbers such as 640x480"),
        (["--dot-px", "0"], "--dot-px 0"),
        (["--scramble-axes", "both"], "--scramble-position"),
        (["--tempo", "2"], "--tempo needs MOTION"),
        (["--apart-m", "2"], "several MOTION"),
    ):
        code, _, err = memo_command(*common, *options)
        assert code == 2 and words in err, (options, err)


def write_table(path, walk, missing=()):
    """The points of a walk as a table; frames and points of `missing` are left empty."""
    points = walk.positions.copy()
    for frames, point in missing:
        points[frames, point] = np.nan
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["time_s", *(f"{name}_{axis}" for name in walk.names for axis in "xyz")])
        for time_s, frame in zip(walk.times_s, points, strict=True):
            out.writerow([repr(float(time_s)), *("" if x != x else repr(x) for x in frame.ravel().tolist())])


@pytest.mark.parametrize(
    ("motion", "options", "loops"),
    [
        (None, "--cycles 1", True),
        (None, "--cycles 2 --reversed --azimuth-deg 50", True),
        (None, "--cycles 1 --scramble-phase --scramble-position --noise-dots 9", True),
        (None, "--cycles 1 --noise-px 3", True),
        (100, "--cycles 1", True),
        ("cycle", "--scramble-phase", True),
        (None, "--scramble-phase", False),
        (100, "--scramble-phase", False),
        (None, "--cycles 1 --lifetime 3 --noise-dots 10 --noise-kind linear", False),
        (None, "--cycles 1 --lifetime 3", False),
        (None, "--cycles 1 --noise-dots 10 --noise-kind linear", False),
        (None, "--cycles 1 --locomotion translating", False),
        (1, "--cycles 1", False),
        (None, "", False),
    ],
)
def test_a_loop_is_reported_only_where_the_last_frame_leads_into_the_first(
    tmp_path, memo_command, motion, options, loops
):
    files = [] if motion is None else [tmp_path / "walk.csv"]
    if motion is not None:
        walk = memo.walker_motion(cycles=1) if motion == "cycle" else memo.walker_motion(motion)
        write_table(tmp_path / "walk.csv", walk)
    common = ["pointlight", *files, *options.split(), "--size", "64x64", "--out", tmp_path / "out"]
    code, said, err = memo_command(*common)
    assert code == 0, err
    assert (" loops." in said) is loops
    assert ("does not lead" in said) is (not loops and "--cycles" in options and motion != 1)
    assert json.loads(memo_command(*common, "--json")[1])["loops"] is loops


def test_a_dot_that_jumps_where_it_is_missing_is_no_loop(tmp_path, memo_command):
    walk = memo.walker_motion(62)
    walk.positions[:, 3, 1] += 0.01 * np.arange(62)  # a shoulder that drifts away
    common = ["pointlight", tmp_path / "walk.csv", "--cycles", "1", "--period", "1", "--azimuth-deg", "90"]
    for missing, loops in (((), True), ([(slice(60, 62), 3)], False)):
        write_table(tmp_path / "walk.csv", walk, missing)
        said = memo_command(*common, "--out", tmp_path / "out")[1]
        assert (" loops." in said, "does not lead" in said) == (loops, not loops)


def test_the_documented_program_shows_each_frame_upright_and_as_drawn(monkeypatch):
    page = Path(__file__).resolve().parents[1] / "docs/methods/point-light-displays.md"
    program = page.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    monkeypatch.setitem(sys.modules, "psychopy", stand_in())
    known = {}
    exec(compile(program, str(page), "exec"), known)
    assert np.array_equal([screen[60:540, 200:600] for screen in SCREENS], known["frames"])
    assert np.all(SCREENS[0][:60] == 128) and len(SCREENS) == round(known["walker"].cycle_s * 60)
    head = spots((SCREENS[0] > 190).astype(np.uint8) * 255)[:, 1].min()
    assert head < 300 - 60  # the head is above the middle of the screen


@pytest.mark.parametrize(
    "clip",
    ["BTK_Gait", "Gait_limp", "CMU12_brisk", "BTK_BELT_C", "BTK_ANTO_M_hole", "CMU02_limp", "CMU_02_01"],
)
def test_recorded_walks_loop_with_the_period_of_their_knees(clip):
    from memo.linkage import read_points_csv

    points = read_points_csv(shared_motion("mocap", "joints", f"{clip}.csv"), 3)
    display = memo.pointlight(points.positions, points.times_s, points.names, azimuth_deg=45, cycles=2)
    # By another way, from the knee alone: the lag of its highest autocorrelation from 0.7 to 1.6 s.
    hip, knee, ankle = (points.positions[:, points.names.index(name)] for name in ("RHP", "RKN", "RAN"))
    bend = np.linalg.norm(ankle - hip, axis=1) / np.linalg.norm(ankle - knee, axis=1)
    bend = bend - bend.mean()
    interval_s = np.diff(points.times_s).mean()
    lags = np.arange(int(0.7 / interval_s), min(int(1.6 / interval_s), int(0.8 * len(bend))))
    alike = [np.corrcoef(bend[lag:], bend[:-lag])[0, 1] for lag in lags]
    assert display.period_s == pytest.approx(lags[np.argmax(alike)] * interval_s, rel=0.05)
    paths = display.positions_px
    middle = len(paths) // 2
    steps = np.linalg.norm(np.diff(paths, axis=0), axis=2)
    bends = np.linalg.norm(np.diff(paths, n=2, axis=0), axis=2)
    assert (steps[middle - 1] <= 1.05 * steps[: middle - 1].max(axis=0)).all()
    assert (bends[middle - 2 : middle] <= bends[: middle - 2].max(axis=0)).all()
