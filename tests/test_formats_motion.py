"""The motion value: its clock, resampling, gaps, up axis, and which point is which joint."""

import tempfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from memo.files import JOINTS
from memo.formats import FormatError, GaitEvent, Motion, read_motion, write_motion
from memo.formats.motion import from_z_up, to_z_up
from memo.formats.names import joint_points, joints_found, mapped_points
from motions import shared_motion, walk


def line(times_s, **parts):
    """One point that is at (t, 2 t, 3 t)."""
    times_s = np.asarray(times_s, float)
    return Motion(("a",), times_s, times_s[:, None, None] * [1.0, 2, 3], **parts)


@pytest.mark.parametrize("rate_hz", [25, 29.97, 30000 / 1001, 50, 120, 1000, 7.3])
@pytest.mark.parametrize("digits", [3, 6])
def test_the_rate_is_found_in_rounded_stamps(rate_hz, digits):
    if digits == 3 and rate_hz == 1000:
        pytest.skip("stamps of a millisecond hold no such rate")
    found, motion = line(np.round(4 + np.arange(300) / rate_hz, digits)).at_constant_rate()
    assert found == pytest.approx(rate_hz, rel=2e-5)
    assert np.allclose(motion.times_s, 4 + np.arange(300) / rate_hz, atol=1.1e-3)


def test_absent_frames_become_empty_ones():
    kept = np.r_[0:10, 13:20, 60:64]
    rate_hz, motion = line(kept / 30, angles={"knee": kept.astype(float)}).at_constant_rate()
    assert rate_hz == 30 and len(motion.times_s) == 64
    assert np.flatnonzero(np.isfinite(motion.points[:, 0, 0])).tolist() == kept.tolist()
    assert np.allclose(motion.points[kept, 0, 0], kept / 30)
    assert motion.angles["knee"][61] == 61 and np.isnan(motion.angles["knee"][11])


@pytest.mark.parametrize("rate_hz", [24, 25, 29.97, 30, 50, 59.94, 60, 100, 120, 240, 29.83, 7.3])
@pytest.mark.parametrize("gap", [1, 20, 60, 100, 1000, 3000])
@pytest.mark.parametrize("whole_ms", [np.round, np.floor])
def test_frames_are_counted_over_a_gap_in_stamps_of_milliseconds(rate_hz, gap, whole_ms):
    kept = np.r_[0:60, 60 + gap : 120 + gap, 122 + gap : 182 + gap]
    found, motion = line(whole_ms(1000 * kept / rate_hz + 1e-6) / 1000).at_constant_rate()
    assert found == pytest.approx(rate_hz, rel=1e-5)
    assert np.flatnonzero(np.isfinite(motion.points[:, 0, 0])).tolist() == kept.tolist()


def test_exact_stamps_near_a_whole_rate_keep_their_own():
    kept = np.r_[0:40, 1540:1580]
    found, motion = line(kept / 29.99).at_constant_rate()
    assert found == pytest.approx(29.99, rel=1e-9) and len(motion.times_s) == 1580


@pytest.mark.parametrize("rate_hz", [24, 29.97, 30, 59.94, 60, 120, 240])
def test_jittered_stamps_are_refused_with_the_rate_they_have(rate_hz):
    kept = np.r_[0:200, 300:500]
    off = np.random.default_rng(3).uniform(-0.3, 0.3, len(kept))
    for digits in (3, 6):
        with pytest.raises(FormatError, match=rf"give --rate {round(rate_hz)} to interpolate"):
            line(np.round((1 + kept + off) / rate_hz, digits)).at_constant_rate()


def test_stamps_without_a_rate_are_refused_with_what_came():
    times_s = np.cumsum(np.random.default_rng(0).uniform(0.02, 0.05, 50))
    with pytest.raises(
        FormatError, match=r"no constant rate \(20.* to 49.* Hz from frame to frame.*--rate \d+"
    ):
        line(times_s).at_constant_rate()
    with pytest.raises(FormatError, match="mostly gaps at 100 Hz"):
        line([0, 0.01, 0.02, 5000]).at_constant_rate()
    with pytest.raises(FormatError, match="0 to 5000 s are mostly gaps: split the motion"):
        line([0, 0.01, 0.02, 5000]).resampled(30)
    with pytest.raises(FormatError, match="one frame has no frame rate"):
        line([0]).at_constant_rate()


def test_resampling_is_linear_and_never_beyond_the_ends():
    times_s = np.cumsum(np.random.default_rng(1).uniform(0.02, 0.05, 50))
    motion = line(times_s).resampled(100)
    assert motion.times_s[0] == times_s[0]
    assert times_s[-1] - 0.01 < motion.times_s[-1] <= times_s[-1]
    assert np.allclose(motion.points[:, 0], motion.times_s[:, None] * [1, 2, 3])
    assert motion.at_constant_rate()[0] == 100
    same = line(np.arange(20) / 50).resampled(50)
    assert np.array_equal(same.points, line(np.arange(20) / 50).points)


def test_resampling_bridges_no_gap_and_turns_the_short_way():
    points = np.arange(10.0)[:, None, None] * np.ones(3)
    points[4] = np.nan
    kept = np.arange(10) / 10
    kept[7:] += 0.5  # half a second without frames
    angle = np.array([170.0, -170, -150, 0, 0, 0, 0, 0, 0, 0])
    motion = Motion(("a",), kept, points, angles={"heading": angle}).resampled(20)
    x = motion.points[:, 0, 0]
    assert np.isnan(x[[7, 8, 9]]).all() and np.isfinite(x[[6, 10]]).all()
    inside = (motion.times_s > 0.6 + 1e-9) & (motion.times_s < 1.2 - 1e-9)
    assert inside.sum() == 11 and np.isnan(x[inside]).all()
    assert motion.angles["heading"][1] == pytest.approx(180)


def test_short_gaps_are_filled_on_demand():
    motion = walk()
    filled, count = motion.filled(0.081)
    assert count == 4 and np.isfinite(filled.points[3:6, 2]).all()  # and one of an angle
    part = (filled.points[4, 2] - filled.points[2, 2]) / (filled.points[6, 2] - filled.points[2, 2])
    assert part == pytest.approx([0.5, 0.5, 0.5])
    assert np.isnan(filled.points[0, 7]).all()  # nothing before it
    assert motion.filled(0.079)[1] == 1  # the angle's gap is of 0.04 s


def test_gaps_of_angles_are_filled_the_short_way_round():
    values = np.array([np.nan, 170.0, np.nan, np.nan, -160.0, np.nan])
    motion = Motion((), np.arange(6) / 50, np.empty((6, 0, 3)), angles={"right_knee": values})
    filled, count = motion.filled(0.061)
    assert count == 2
    np.testing.assert_allclose(filled.angles["right_knee"], [np.nan, 170, 180, 190, -160, np.nan])
    assert np.isnan(values[2])  # the motion itself stays as it was
    assert motion.filled(0.059)[1] == 0


def test_up_axes_are_turned_not_mirrored():
    axes = from_z_up(np.eye(3), "y")
    assert np.linalg.det(axes) == 1 and axes[2].tolist() == [0, 1, 0] and axes[0].tolist() == [1, 0, 0]
    assert np.array_equal(to_z_up(axes, "y"), np.eye(3)) and np.array_equal(to_z_up(axes, "z"), axes)


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"names": ("a", "a"), "points": np.zeros((2, 2, 3))}, "point 'a' is empty or occurs twice"),
        ({"names": ("",)}, "point '' is empty or occurs twice"),
        (
            {"points": np.zeros((2, 3))},
            r"wanted times \(T,\) and points \(T, 1, 3\), got \(2,\) and \(2, 3\)",
        ),
        ({"points": np.full((2, 1, 3), np.inf)}, "point a: infinite in frame 0"),
        ({"times_s": [0, 0]}, "frame 1: times must increase, 0 s follows 0 s"),
        ({"times_s": [0, np.nan]}, "frame 1: the time nan s is not a valid time"),
        ({"times_s": [0, 1e300]}, "frame 1: the time 1e[+]300 s is not a valid time"),
        ({"angles": {"k": [1]}}, r"angle k: wanted \(2,\), got \(1,\)"),
        ({"events": (GaitEvent(0, "jump", "left"),)}, "not a gait event"),
        ({"times_s": [], "points": np.zeros((0, 1, 3))}, "no frames"),
    ],
)
def test_no_motion_is_made_of_what_is_none(parts, says):
    with pytest.raises(FormatError, match=says):
        Motion(**{"names": ("a",), "times_s": [0, 1], "points": np.zeros((2, 1, 3))} | parts)


@pytest.mark.parametrize(
    "spelled",
    [
        lambda side, part: f"{side}_{part}",
        lambda side, part: f"{side[0].upper()}{part.capitalize()}",
        lambda side, part: f"{side[0].upper()}_{part.capitalize()}",
        lambda side, part: f"{side.capitalize()}{part.capitalize()}",
        lambda side, part: f"{part}_{side[0]}",
        lambda side, part: f"{part.upper()} {side}",
        lambda side, part: f"Anna:{side[0].upper()}{part.upper()}",
        lambda side, part: side[0].upper() + {"hip": "HP"}.get(part, part[:2].upper()).replace("KN", "KN"),
    ],
)
def test_joints_are_known_by_many_spellings(spelled):
    names = ["spare", *(spelled(*joint.split("_")) for joint in JOINTS)]
    assert joints_found(names) == {joint: k for k, joint in enumerate(JOINTS, 1)}


def test_masked_numbers_of_a_motion_are_missing():
    values = np.arange(6.0).reshape(2, 1, 3)
    motion = Motion(("a",), [0, 1], np.ma.masked_equal(values, 4), angles={"b": np.ma.masked_less([1, 9], 5)})
    assert np.isnan(motion.points[1]).all() and np.isfinite(motion.points[0]).all()
    np.testing.assert_array_equal(motion.angles["b"], [np.nan, 9])


def test_joints_of_several_subjects_are_never_one_body(tmp_path):
    anna = [f"Anna:{name}" for name in JOINTS if name != "left_knee"]
    names = (*anna, *(f"Bob:{name}" for name in JOINTS), "Wand:W1", "Wand:W2")
    points = np.arange(2 * len(names) * 3.0).reshape(2, -1, 3)
    motion = Motion(names, [0, 0.01], points, angles={"right_knee": [5, 6]})
    with pytest.raises(FormatError, match=r"joints of 2 subjects \(Anna, Bob\), and those of one are wanted"):
        joint_points(motion)
    for ending in ("bvh", "mot"):
        with pytest.raises(FormatError, match=r"2 subjects \(Anna, Bob\)"):
            write_motion(tmp_path / f"both.{ending}", motion)
    write_motion(tmp_path / "both.trc", motion)  # of all points, under their own names
    assert read_motion(tmp_path / "both.trc").names == names
    with pytest.raises(FormatError, match=r"2 subjects \(Anna, Bob\)"):
        write_motion(tmp_path / "both.trc", motion, names="pose2sim")
    bob = {joint: [f"Bob:{joint}"] for joint in JOINTS}
    assert (mapped_points(names, points, bob)[1] == points[:, 11:23]).all()
    spelt = {joint: [f"bob:{joint.replace('_', '').upper()}"] for joint in JOINTS}
    assert (mapped_points(names, points, spelt)[1] == points[:, 11:23]).all()
    plain = {joint: [joint] for joint in JOINTS}
    mostly = {joint: [f"Anna:{joint}"] for joint in JOINTS} | {"left_knee": ["left_knee"]}
    for wanted, example in ((plain, "Anna:right_shoulder"), (mostly, "Anna:left_knee")):
        with pytest.raises(FormatError, match=rf'2 subjects \(Anna, Bob\): name those .* "{example}"'):
            mapped_points(names, points, wanted)
    with pytest.raises(FormatError, match=r"no points for Anna:left_knee \(left_knee\)"):
        mapped_points(names, points, {joint: [f"Anna:{joint}"] for joint in JOINTS})
    only = [*(f"Bob:{name}" for name in JOINTS), "Wand:W1", "head"]
    assert joints_found(only) == {name: k for k, name in enumerate(JOINTS)} | {"head": 13}
    assert mapped_points(only, points[:, :14], plain)[0][0] == "RSH"


def test_a_skeletons_shoulder_is_its_arm_and_no_marker_is_a_joint():
    bones = ["Hips", "RightShoulder", "RightArm", "RightForeArm", "RightHand", "RightUpLeg", "RightLeg"]
    bones += ["RightFoot", *(name.replace("Right", "Left") for name in bones[1:]), "LeftFoot"]
    assert joints_found(bones)["right_shoulder"] == 2
    motion = Motion(tuple(bones), [0, 1], np.arange(2 * len(bones) * 3.0).reshape(2, -1, 3))
    assert joint_points(motion).points[0, 0].tolist() == motion.points[0, 2].tolist()
    markers = Motion(("RSHO", "RELB", "RKNE", "RANK"), [0, 1], np.zeros((2, 4, 3)))
    with pytest.raises(
        FormatError, match=r"no points for right_shoulder, .*; the file has RSHO, RELB, RKNE, RANK"
    ):
        joint_points(markers)


def test_plug_in_gaits_virtual_points_are_the_joint_centres_published_with_the_file():
    motion = joint_points(read_motion(shared_motion("mocap", "formats", "PiG__PiG_Motion-FlatFoot-Hole.c3d")))
    table = read_motion(shared_motion("mocap", "joints", "BTK_ANTO_M_hole.csv"))
    for name in motion.names[:12]:
        read = motion.points[:, motion.names.index(name)]
        wanted = table.points[:, table.names.index(name)]
        assert np.abs(read - wanted).max() < 0.6e-4  # rounded to a tenth of a millimetre


@pytest.mark.parametrize("ending", ["c3d", "trc", "csv"])
@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    frames=st.integers(1, 30),
    names=st.lists(
        st.from_regex(r"[A-Za-z][A-Za-z0-9_.:*-]{0,20}", fullmatch=True), min_size=1, max_size=9, unique=True
    ),
    rate_hz=st.floats(1, 1000),
    up=st.sampled_from(["z", "y"]),
)
def test_any_motion_comes_back(ending, seed, frames, names, rate_hz, up):
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 3, (frames, len(names), 3))
    points[rng.random((frames, len(names))) < 0.2] = np.nan
    times_s = np.arange(frames) / rate_hz
    motion = Motion(tuple(names), times_s, points, metadata={"rate_hz": rate_hz})
    with tempfile.TemporaryDirectory() as folder:
        write_motion(f"{folder}/any.{ending}", motion, up)
        read = read_motion(f"{folder}/any.{ending}")
    assert read.names == motion.names and read.metadata["up"] == up
    assert np.allclose(read.points, points, atol=2e-6, equal_nan=True)
    assert np.allclose(read.times_s, times_s, rtol=1e-6, atol=1e-6)
