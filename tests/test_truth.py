"""Plants known errors in the track of a synthetic walker and reads them back from the evaluation."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import truth as gt

FPS = 25.0
STRIDE_FRAMES = 30.0
FRAMES = np.arange(12.0, 112.0)
UP = np.array([0.0, 0.0, 1.0])
JOINT_OFFSETS = {"SH": (0.18, 0.45), "HP": (0.09, 0.0)}  # (to the left or right, above the hips), metres


class Walker:
    """A walker of closed form: pendulum thighs, knees that flex in swing, constant speed and heading."""

    def __init__(self, heading_rad: float = 0.0):
        self.heading_rad = heading_rad
        self.forward = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
        self.left = np.array([-self.forward[1], self.forward[0], 0.0])
        self.cycles = (FRAMES - 20.0) / STRIDE_FRAMES  # right strike at frame 20
        self.angles_deg = {}
        for side, shift in (("right", 0.0), ("left", 0.5)):
            turn = 2.0 * np.pi * (self.cycles + shift)
            self.angles_deg[f"{side}_hip"] = 25.0 * np.cos(turn)
            self.angles_deg[f"{side}_knee"] = 30.0 * (1.0 - np.cos(turn + 1.0))

    def path(self) -> np.ndarray:
        """(N, 3) points of the ground below the pelvis."""
        return np.outer(FRAMES / FPS * 1.3, self.forward)

    def joints(self) -> dict[str, np.ndarray]:
        """(N, 3) joint centres by code."""
        pelvis = self.path() + 0.9 * UP
        joints = {}
        for code, side, sign in (("R", "right", -1.0), ("L", "left", 1.0)):
            for joint, (aside, above) in JOINT_OFFSETS.items():
                joints[code + joint] = pelvis + sign * aside * self.left + above * UP
            thigh = np.radians(self.angles_deg[f"{side}_hip"])
            shank = thigh - np.radians(self.angles_deg[f"{side}_knee"])
            joints[code + "KN"] = joints[code + "HP"] + 0.42 * self.hanging(thigh)
            joints[code + "AN"] = joints[code + "KN"] + 0.40 * self.hanging(shank)
            joints[code + "EL"] = joints[code + "SH"] - 0.3 * UP
            joints[code + "WR"] = joints[code + "EL"] - 0.25 * UP
        return joints

    def hanging(self, angle_rad: np.ndarray) -> np.ndarray:
        """Unit vectors that hang down, turned forward by the angle."""
        return np.outer(np.sin(angle_rad), self.forward) - np.outer(np.cos(angle_rad), UP)

    def strikes(self) -> list[tuple[float, str]]:
        """True heel strikes inside the clip."""
        return [(20.0 + 15.0 * k, "right" if k % 2 == 0 else "left") for k in range(7)]


def pixels(points: np.ndarray) -> np.ndarray:
    """Some projection: 100 px a metre, seen askew so that no two joints fall together."""
    return 100.0 * points @ np.array([[1.0, 0.0], [0.3, 0.1], [0.0, -1.0]])


def write_csv(path: Path, columns: dict[str, np.ndarray | list]) -> Path:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path


def write_truth(directory: Path, walker: Walker) -> tuple[Path, Path]:
    columns = {"frame": FRAMES, "time_s": FRAMES / FPS}
    for code, points in walker.joints().items():
        columns |= {f"{code}_{axis}_m": points[:, i] for i, axis in enumerate("xyz")}
        columns |= {f"{code}_{axis}_px": pixels(points)[:, i] for i, axis in enumerate("uv")}
    events = write_events(directory / "true_events.csv", walker.strikes())
    return write_csv(directory / "truth.csv", columns), events


def write_events(path: Path, strikes: list[tuple[float, str]]) -> Path:
    frames, sides = zip(*strikes, strict=True)
    toe_off = {"time_s": [0.5], "frame": [13.0], "event": ["toe_off"], "side": ["right"]}
    columns = {
        "time_s": [f / FPS for f in frames],
        "frame": list(frames),
        "event": ["heel_strike"] * len(frames),
        "side": list(sides),
    }
    return write_csv(path, {name: toe_off[name] + columns[name] for name in columns})


def perfect_track(walker: Walker) -> dict[str, np.ndarray]:
    joints = walker.joints()
    torso = np.mean([joints[code] for code in ("RSH", "LSH", "RHP", "LHP")], axis=0)
    ones = np.ones(FRAMES.size)
    track = {"frame": FRAMES, "time_s": FRAMES / FPS}
    track |= {f"{axis}_m": torso[:, i] for i, axis in enumerate("xyz")}
    track |= {"heading_rad": walker.heading_rad * ones, "p_swapped": 0.01 * ones}
    track |= {"phase": walker.cycles % 1.0}
    track |= {f"sd_{name}": 0.02 * ones for name in ("x_m", "y_m", "z_m", "phase")}
    track |= {f"{name}_deg": angle for name, angle in walker.angles_deg.items()}
    track |= {f"{side}_elbow_deg": 20.0 * ones for side in ("right", "left")}
    for code, name in gt.JOINTS.items():
        track |= {f"{name}_{axis}_m": joints[code][:, i] for i, axis in enumerate("xyz")}
        track |= {f"{name}_{axis}_px": pixels(joints[code])[:, i] for i, axis in enumerate("uv")}
    return {name: column.copy() for name, column in track.items()}


def keep(track: dict[str, np.ndarray], rows: np.ndarray) -> dict[str, np.ndarray]:
    return {name: column[rows] for name, column in track.items()}


def mocap(tmp_path: Path, walker: Walker, track: dict[str, np.ndarray], **options) -> gt.MocapEvaluation:
    file = write_csv(tmp_path / "track.csv", track)
    return gt.evaluate_mocap(file, *write_truth(tmp_path, walker), **options)


@pytest.mark.parametrize("heading_deg", [0.0, 180.0, 25.0, -90.0])
def test_perfect_track_has_no_error(tmp_path, heading_deg):
    walker = Walker(np.radians(heading_deg))
    result = mocap(tmp_path, walker, perfect_track(walker))
    assert result.tracked == 1.0
    assert result.phase.count == 91 and result.phase.near_truth == 1.0 and result.phase.near_half == 0.0
    assert result.sides.right == 1.0 and result.sides.surely_wrong == 0.0
    assert set(result.within_2sd.values()) == {1.0}
    spreads = [result.along_m, result.across_m, result.depth_m, result.height_m, result.heading_deg]
    errors = [s.max for s in [*spreads, *result.angles_deg.values()]]
    errors += [result.phase.p95_abs, result.joint_p95_m, result.joint_median_px]
    errors += [abs(e) for e in result.strikes.errors_frames]
    assert np.max(errors) < 1e-6
    assert result.strikes.matched == 7 and result.strikes.extra == 0


@pytest.mark.parametrize("heading_deg", [0.0, 180.0, 25.0])
def test_torso_errors_are_split_along_the_walk(tmp_path, heading_deg):
    walker = Walker(np.radians(heading_deg))
    track = perfect_track(walker)
    offset = 0.03 * walker.forward + 0.20 * walker.left - 0.05 * UP
    for i, axis in enumerate("xyz"):
        track[f"{axis}_m"] += offset[i]
    track["heading_rad"] += np.radians(4.0) + 2.0 * np.pi
    result = mocap(tmp_path, walker, track)
    for spread, planted in [(result.along_m, 0.03), (result.across_m, 0.20), (result.height_m, -0.05)]:
        assert spread.mean == pytest.approx(planted)
        assert [spread.rms, spread.max] == pytest.approx([abs(planted)] * 2)
    assert result.depth_m.mean == pytest.approx(offset[1])
    assert result.heading_deg.mean == pytest.approx(4.0)
    inside = {axis: float(abs(offset[i]) <= 0.04) for i, axis in enumerate("xyz")}
    assert {axis: result.within_2sd[axis] for axis in "xyz"} == inside


def test_rms_mean_and_max_differ_where_they_should(tmp_path):
    track = perfect_track(Walker())
    track["x_m"][:50] += 0.10
    track["x_m"][50] -= 0.40
    along = mocap(tmp_path, Walker(), track).along_m
    assert along.mean == pytest.approx((50 * 0.10 - 0.40) / 100)
    assert along.rms == pytest.approx(np.sqrt((50 * 0.01 + 0.16) / 100))
    assert along.max == pytest.approx(0.40)


def test_torso_is_the_middle_of_shoulders_and_hips():
    walker = Walker(0.4)
    truth = {}
    for code, points in walker.joints().items():
        truth |= {f"{code}_{axis}_m": points[:, i] for i, axis in enumerate("xyz")}
    expected = walker.path() + (0.9 + 0.225) * UP
    np.testing.assert_allclose(gt.true_torso(truth), expected, atol=1e-12)
    truth["time_s"] = FRAMES / FPS
    np.testing.assert_allclose(gt.walking_direction(truth), walker.forward, atol=1e-12)


def test_missing_and_lost_frames_lower_the_tracked_fraction(tmp_path):
    track = keep(perfect_track(Walker()), np.arange(100) % 4 != 0)
    track["z_m"][:5] = np.nan
    result = mocap(tmp_path, Walker(), track)
    assert result.tracked == pytest.approx(0.70)
    assert result.phase.p95_abs < 1e-6
    assert np.nanmax(np.abs(result.strikes.errors_frames)) < 1e-6


@pytest.mark.parametrize("shift", [0.03, -0.07])
def test_phase_shift_is_found_with_its_sign(tmp_path, shift):
    track = perfect_track(Walker())
    track["phase"] = (track["phase"] + shift) % 1.0
    result = mocap(tmp_path, Walker(), track)
    assert result.phase.bias == pytest.approx(shift)
    assert [result.phase.median_abs, result.phase.p95_abs] == pytest.approx([abs(shift)] * 2)
    assert result.phase.near_truth == 1.0 and result.sides.right == 1.0
    assert result.within_2sd["phase"] == float(abs(shift) <= 0.04)
    # A phase ahead by `shift` crosses 0 and 0.5 earlier by the same part of the stride.
    found = np.array(result.strikes.errors_frames)
    np.testing.assert_allclose(found[np.isfinite(found)], -shift * STRIDE_FRAMES, atol=1e-6)


@pytest.mark.parametrize(("p_swapped", "surely_wrong", "undecided"), [(0.02, 1.0, 0.0), (0.4, 0.0, 1.0)])
def test_half_cycle_twin_is_not_right(tmp_path, p_swapped, surely_wrong, undecided):
    track = perfect_track(Walker())
    track["phase"] = (track["phase"] + 0.5) % 1.0
    track["p_swapped"][:] = p_swapped
    result = mocap(tmp_path, Walker(), track)
    assert (result.phase.near_truth, result.phase.near_half) == (0.0, 1.0)
    assert (result.sides.right, result.sides.surely_wrong) == (0.0, surely_wrong)
    assert result.sides.undecided == undecided
    assert result.sides.brier == pytest.approx((1.0 - p_swapped) ** 2)
    assert result.strikes.matched == 0 and result.strikes.extra >= 6


def test_a_third_of_a_cycle_is_near_neither_twin(tmp_path):
    track = perfect_track(Walker())
    track["phase"][FRAMES >= 60.0] += 0.33
    phase = mocap(tmp_path, Walker(), track).phase
    assert (phase.near_truth, phase.near_half) == (pytest.approx(40 / 91), 0.0)
    assert (phase.median_abs, phase.p95_abs) == pytest.approx((0.33, 0.33))


def test_right_phase_with_sides_given_up_is_not_right(tmp_path):
    track = perfect_track(Walker())
    track["p_swapped"][:] = 0.6
    sides = mocap(tmp_path, Walker(), track).sides
    assert (sides.right, sides.surely_wrong, sides.undecided) == (0.0, 0.0, 1.0)


def test_angle_errors_stay_with_their_joint(tmp_path):
    track = perfect_track(Walker())
    track["left_knee_deg"] += 7.0
    track["right_hip_deg"] += np.where(np.arange(100) % 2 == 0, 3.0, -3.0)
    angles = mocap(tmp_path, Walker(), track).angles_deg
    assert [angles["left_knee"].mean, angles["left_knee"].rms] == pytest.approx([7.0] * 2)
    assert [angles["right_hip"].mean, angles["right_hip"].rms] == pytest.approx([0.0, 3.0], abs=1e-9)
    assert angles["right_knee"].max < 1e-9 and angles["left_hip"].max < 1e-9


def test_joint_median_and_pixels(tmp_path):
    track = perfect_track(Walker())
    for name in gt.JOINTS.values():
        track[f"{name}_y_m"] += 0.12
        track[f"{name}_u_px"] += 3.0
        track[f"{name}_v_px"] -= 4.0
    for axis in "xyz":
        track[f"right_wrist_{axis}_m"] += 5.0  # one joint of twelve must not move a median
    result = mocap(tmp_path, Walker(), track)
    assert result.joint_median_m == pytest.approx(0.12)
    assert result.joint_median_px == pytest.approx(5.0)
    assert result.joint_p95_m > 5.0


def test_strikes_are_matched_by_side_and_once(tmp_path):
    walker = Walker()
    events = [(f + 1.5, side) for f, side in walker.strikes()[:4]]
    events += [(walker.strikes()[4][0], "left")]  # wrong side
    events += [(walker.strikes()[5][0] - 1.0, "left"), (walker.strikes()[5][0] + 3.0, "left")]  # one too many
    file = write_events(tmp_path / "events.csv", events)
    strikes = mocap(tmp_path, walker, perfect_track(walker), tracked_events_csv=file).strikes
    np.testing.assert_allclose(strikes.errors_frames, [1.5, 1.5, 1.5, 1.5, np.nan, -1.0, np.nan])
    assert (strikes.matched, strikes.extra, strikes.within(1.0)) == (5, 2, 1)


def test_one_tracked_strike_answers_one_true_one():
    true = gt.StrikeList(np.array([10.0, 18.0, 40.0]), np.array(["right", "right", "left"]))
    strikes = gt.match_strikes([(13.0, "right"), (40.0, "left")], true)
    np.testing.assert_allclose(strikes.errors_frames, [3.0, np.nan, 0.0])


def test_phase_truth_spans_a_missed_strike():
    strikes = gt.StrikeList(np.array([10.0, 20.0, 40.0]), np.array(["right", "left", "left"]))
    np.testing.assert_allclose(strikes.cycles(), [0.0, 0.5, 1.5])
    assert strikes.stride_frames() == 20.0
    track = {"frame": np.array([9.0, 10, 15, 30, 41]), "phase": np.array([0.0, 0.98, 0.30, 0.0, 0.5])}
    errors = gt.phase_errors(track, strikes)
    np.testing.assert_allclose(errors, [np.nan, -0.02, 0.05, 0.0, np.nan], atol=1e-12)


def test_bad_files_are_refused_with_their_reason(tmp_path):
    track = perfect_track(Walker())
    with pytest.raises(ValueError, match="occurs more than once"):
        mocap(tmp_path, Walker(), {n: np.concatenate([c, c[-1:]]) for n, c in track.items()})
    with pytest.raises(ValueError, match="no common frame"):
        mocap(tmp_path, Walker(), track | {"frame": FRAMES + 1000.0})
    with pytest.raises(ValueError, match="p_swapped"):
        mocap(tmp_path, Walker(), {n: c for n, c in track.items() if n != "p_swapped"})


def write_annotation(directory: Path, walker: Walker, near: str) -> Path:
    """An annotation folder in the form of the ones made by eye, every fifth frame, without error."""
    directory.mkdir()
    far = "left" if near == "right" else "right"
    legs = ["near" if side == near else "far" for _, side in walker.strikes()]
    frames = [frame for frame, _ in walker.strikes()]
    count = len(frames)
    # The first strike is a guess ten frames off, which its certainty tells.
    write_csv(
        directory / "events.csv",
        {
            "frame": [frames[0] - 10.0, *frames, 30.0],
            "event": ["heel_strike"] * (count + 1) + ["toe_off"],
            "leg": [legs[0], *legs, "far"],
            "certainty": [0.5] + [0.8] * (count + 1),
            "note": ["guess, out of range"] + [""] * (count + 1),
        },
    )
    every = np.arange(FRAMES.size) % 5 == 0
    angles = {"frame": FRAMES[every]}
    for name, angle in {
        "near_thigh_vs_vertical_deg": f"{near}_hip",
        "near_knee_flexion_deg": f"{near}_knee",
        "far_thigh_parallax_corrected_deg": f"{far}_hip",
        "far_knee_flexion_parallax_corrected_deg": f"{far}_knee",
    }.items():
        angles[name] = walker.angles_deg[angle][every]
    angles["near_elbow_flexion_deg"] = np.full(every.sum(), 20.0)
    write_csv(directory / "angles.csv", angles)
    by_name = {gt.JOINTS[code]: pixels(points)[every] for code, points in walker.joints().items()}
    joints = {"frame": FRAMES[every]}
    for name, (side, joint) in {
        **{f"near_{j}": (near, j) for j in ("shoulder", "elbow", "wrist", "knee", "ankle")},
        **{"hip": (near, "hip"), "far_knee": (far, "knee"), "far_ankle": (far, "ankle")},
    }.items():
        uv = by_name[f"{side}_{joint}"]
        blank = [""] + [f"{x:.9f}" for x in uv[1:, 0]]  # a hidden joint is left blank
        joints |= {f"{name}_x": blank, f"{name}_y": uv[:, 1], f"{name}_sd": np.full(every.sum(), 4.0)}
    write_csv(directory / "joints.csv", joints)
    return directory


def test_demo4_reads_the_near_side_as_left(tmp_path):
    walker = Walker(np.pi)
    annotation = write_annotation(tmp_path / "annotation", walker, near="left")
    track = keep(perfect_track(walker), FRAMES >= 15.0)
    track["left_knee_deg"] += 5.0
    track["right_hip_deg"] -= 2.0
    track["left_wrist_u_px"] += 6.0
    file = write_csv(tmp_path / "track.csv", track)
    late = [(frame + 2.0 * (i == 3), side) for i, (frame, side) in enumerate(walker.strikes())]
    events = write_events(tmp_path / "events.csv", late)
    result = gt.evaluate_demo4(file, events, annotation)
    assert (result.first_frame, result.last_frame, result.frames) == (15, 111, 97)
    assert result.strikes.matched == 7 and result.strikes.within(2.0) == 7 and result.strikes.within(1.9) == 6
    assert result.phase.p95_abs < 1e-6 and result.sides.right == 1.0
    expected = {"near_hip": 0.0, "near_knee": 5.0, "near_elbow": 0.0, "far_hip": -2.0, "far_knee": 0.0}
    assert {n: s.mean for n, s in result.angles_deg.items()} == pytest.approx(expected, abs=1e-6)
    assert len(result.joints_px) == 8
    for name, figures in result.joints_px.items():
        assert figures == pytest.approx((6.0 if name == "near_wrist" else 0.0, 4.0), abs=1e-6), name


def test_demo4_does_not_accept_the_other_leg(tmp_path):
    walker = Walker(np.pi)
    annotation = write_annotation(tmp_path / "annotation", walker, near="right")  # sides exchanged
    file = write_csv(tmp_path / "track.csv", perfect_track(walker))
    result = gt.evaluate_demo4(file, None, annotation)
    assert result.strikes.matched == 0 and result.sides.right == 0.0 and result.sides.surely_wrong == 1.0
    assert result.angles_deg["near_hip"].rms > 20.0


@pytest.mark.parametrize(("half_cycle_off", "sides_right"), [(False, 1.0), (True, 0.0)])
def test_weizmann_folds_the_half_cycle(tmp_path, half_cycle_off, sides_right):
    walker = Walker()
    annotation = write_annotation(tmp_path / "annotation", walker, near="right")
    track = keep(perfect_track(walker), FRAMES >= 20.0)  # before lies the guessed strike
    track["phase"] = (track["phase"] + 0.03 + 0.5 * half_cycle_off) % 1.0
    track["p_swapped"][:] = 0.45
    result = gt.evaluate_weizmann(write_csv(tmp_path / "track.csv", track), annotation)
    folded = [result.folded_median_abs, result.folded_bias, result.folded_p95_abs]
    assert folded == pytest.approx([0.03] * 3)
    assert (result.sides.right, result.sides.surely_wrong, result.sides.undecided) == (sides_right, 0.0, 1.0)


def test_table_lines_up_and_shows_every_figure(tmp_path):
    result = mocap(tmp_path, Walker(), perfect_track(Walker()))
    text = gt.table({"a": result, "b": result})
    lines = text.splitlines()
    assert len(lines) == 1 + len(result.figures())
    assert lines[0].split() == ["a", "b"]
    assert any(line.startswith("along m") and "0.000 (" in line for line in lines)
