"""Plants known errors in the track of a synthetic walker and reads them back from the table of all walks."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import score_walks as sw
import truth as gt
from memo.files import write_json
from test_truth import FPS, FRAMES, UP, Walker, keep, perfect_track, write_annotation, write_csv

EVERY_SECOND = np.where(np.arange(FRAMES.size) % 2 == 0, 1.0, -1.0)
NO_GAIT = {name: np.array([]) for name in ("parameter", "side", "unit", "value", "ci_low", "ci_high")}
HEADING = 0.4


def columns_of(walker: Walker) -> dict[str, np.ndarray]:
    """The truth's columns of a walker."""
    columns = {"frame": FRAMES, "time_s": FRAMES / FPS}
    for code, points in walker.joints().items():
        columns |= {f"{code}_{axis}_m": points[:, i] for i, axis in enumerate("xyz")}
    return columns


def track_of(walker: Walker) -> dict[str, np.ndarray]:
    return perfect_track(walker) | {"walk": np.zeros(FRAMES.size)}


def table_of(events: list[tuple[float, str, str]]) -> dict[str, np.ndarray]:
    """The truth's columns of events (time, event, side)."""
    time_s, event, side = map(np.array, zip(*events, strict=True))
    return {"time_s": time_s, "frame": time_s * FPS, "event": event, "side": side}


def strikes_of(walker: Walker) -> list[tuple[float, str, str]]:
    return [(frame / FPS, "heel_strike", side) for frame, side in walker.strikes()]


def as_tracked(events: list[tuple[float, str, str]]) -> list[dict]:
    return [{"time_s": t, "frame": t * FPS, "event": event, "side": side} for t, event, side in events]


def scored(walker: Walker, track: dict[str, np.ndarray], *, name: str = "ANTO__x", **other) -> sw.ClipScore:
    """The score of a track against a walker whom the camera sees from the right."""
    camera_m = walker.path().mean(axis=0) - 6.0 * walker.left
    given = {"events": [], "gait": NO_GAIT, "true_events": table_of(strikes_of(walker)), **other}
    return sw.score(name, track, truth=columns_of(walker), camera_m=camera_m[:2], **given)


@pytest.mark.parametrize("heading", [0.0, HEADING, np.pi, -2.0])
def test_a_perfect_track_has_no_error(heading):
    walker = Walker(heading)
    clip = scored(walker, track_of(walker), events=as_tracked(strikes_of(walker)))
    assert (clip.coverage, clip.walks, clip.sides) == (1.0, 1, (1, 0, 0))
    for figures in (clip.rms_deg, clip.centred_deg):
        assert [figures[joint] for joint in sw.JOINTS[:4]] == pytest.approx([0.0] * 4, abs=1e-6)
        assert np.isnan(figures["ankle"])
    torso = [clip.along_m, clip.height_m, clip.distance_m, clip.distance_bias_m]
    assert torso == pytest.approx([0.0] * 4, abs=1e-9)
    assert clip.contacts.true == 7
    assert clip.contacts.errors_ms == pytest.approx([0.0] * 7, abs=1e-6)
    assert clip.toe_offs.true == 0


def test_rms_is_over_both_sides_and_centred_without_each_mean():
    wrong = Walker(HEADING)
    wrong.angles_deg["right_hip"] = wrong.angles_deg["right_hip"] + 4.0 + 3.0 * EVERY_SECOND
    wrong.angles_deg["left_hip"] = wrong.angles_deg["left_hip"] - 2.0
    wrong.angles_deg["left_knee"] = wrong.angles_deg["left_knee"] + 6.0
    clip = scored(Walker(HEADING), track_of(wrong))
    assert clip.rms_deg["hip"] == pytest.approx(np.sqrt((16.0 + 9.0 + 4.0) / 2.0))
    assert clip.centred_deg["hip"] == pytest.approx(np.sqrt(9.0 / 2.0))
    assert clip.rms_deg["knee"] == pytest.approx(np.sqrt(36.0 / 2.0))
    assert clip.centred_deg["knee"] == pytest.approx(0.0, abs=1e-6)


def test_angles_are_those_of_the_joints_seen_on_the_true_plane():
    walker = Walker(HEADING)
    track = track_of(walker)
    for axis, forward in zip("xy", walker.forward, strict=False):
        track[f"right_elbow_{axis}_m"] += 0.3 * np.tan(np.radians(10.0)) * forward
        track[f"right_elbow_{axis}_m"] += 0.2 * walker.left["xy".index(axis)]  # out of the plane: not seen
    clip = scored(walker, track)
    assert clip.rms_deg["shoulder"] == pytest.approx(10.0 / np.sqrt(2.0))
    forearm = -np.degrees(np.arctan2(0.3 * np.tan(np.radians(10.0)), 0.25))
    assert clip.rms_deg["elbow"] == pytest.approx((10.0 - forearm) / np.sqrt(2.0))
    track["right_knee_deg"] += 50.0  # a column, not a joint
    assert scored(walker, track).rms_deg == pytest.approx(clip.rms_deg, nan_ok=True)


@pytest.mark.parametrize("as_joint", [True, False])
def test_an_ankle_is_judged_if_both_have_one(as_joint):
    walker = Walker(HEADING)
    truth, track = columns_of(walker), track_of(walker)
    foot = 0.2 * walker.forward
    raised = 0.2 * (np.cos(np.radians(5.0)) * walker.forward + np.sin(np.radians(5.0)) * UP)
    joints = walker.joints()
    for code, side in (("R", "right"), ("L", "left")):
        shank = walker.angles_deg[f"{side}_hip"] - walker.angles_deg[f"{side}_knee"]
        if not as_joint:
            track[f"{side}_ankle_deg"] = 5.0 - shank
        for i, axis in enumerate("xyz"):
            truth[f"{code}TO_{axis}_m"] = joints[f"{code}AN"][:, i] + foot[i]
            if as_joint:
                track[f"{side}_toe_{axis}_m"] = joints[f"{code}AN"][:, i] + raised[i]
    events = table_of(strikes_of(walker))
    clip = sw.score("ANTO__x", track, [], NO_GAIT, truth, events, (0.0, -6.0))
    assert clip.rms_deg["ankle"] == pytest.approx(5.0)
    assert clip.centred_deg["ankle"] == pytest.approx(0.0, abs=1e-6)
    assert clip.rms_deg["hip"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("camera_side", [1.0, -1.0])
def test_the_torso_is_split_along_the_walk_up_and_away_from_the_camera(camera_side):
    walker = Walker(HEADING)
    track = track_of(walker)
    offset = np.outer(0.03 + 0.01 * EVERY_SECOND, walker.forward) + 0.2 * walker.left - 0.05 * UP
    for i, axis in enumerate("xyz"):
        track[f"{axis}_m"] += offset[:, i]
    camera_m = walker.path().mean(axis=0) - camera_side * 6.0 * walker.left
    events = table_of(strikes_of(walker))
    clip = sw.score("ANTO__x", track, [], NO_GAIT, columns_of(walker), events, camera_m[:2])
    assert clip.along_m == pytest.approx(np.sqrt(0.03**2 + 0.01**2))
    assert (clip.distance_bias_m, clip.distance_m) == pytest.approx((0.2 * camera_side, 0.2))
    assert clip.height_m == pytest.approx(0.05)


def test_coverage_and_walks_count_tracked_frames():
    track = keep(track_of(Walker()), np.arange(FRAMES.size) % 4 != 0)
    track["z_m"][:5] = np.nan
    track["walk"][40:] = 1.0
    clip = scored(Walker(), track)
    assert (clip.coverage, clip.walks, clip.sides) == (pytest.approx(0.70), 2, (2, 0, 0))


def test_a_clip_in_which_nobody_is_tracked_still_counts():
    empty = keep(track_of(Walker()), np.zeros(FRAMES.size, bool))
    clip = scored(Walker(), empty)
    assert (clip.coverage, clip.walks, clip.sides, clip.contacts.true) == (0.0, 0, (0, 0, 0), 7)
    figures = sw.row([clip, scored(Walker(), track_of(Walker()))])
    assert figures["coverage"] == 0.5 and figures["contacts_true"] == 14
    assert figures["hip_deg"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("shift", "p_swapped", "sides"),
    [(0.0, 0.2, (1, 0, 0)), (0.5, 0.05, (0, 1, 0)), (0.5, 0.21, (0, 0, 1)), (0.0, 0.5, (0, 0, 1))],
)
def test_sides_are_right_wrong_or_open(shift, p_swapped, sides):
    track = track_of(Walker())
    track["phase"] = (track["phase"] + shift) % 1.0
    track["p_swapped"][:] = p_swapped
    clip = scored(Walker(), track, mean_sds=[{"phase": 0.02}])
    assert clip.sides == sides
    assert clip.swaps == (sw.Swap(pytest.approx(p_swapped), shift != 0.0),)
    assert ("phase" in clip.claims) == (sides[2] == 0)
    if sides[1]:  # a claim of the wrong side is a wrong phase
        assert abs(clip.claims["phase"].error) == pytest.approx(0.5)


def test_events_are_matched_to_the_nearest_of_their_side_and_kind():
    true = [(1.0, "heel_strike", "right"), (2.0, "heel_strike", "left"), (3.0, "heel_strike", "right")]
    true += [(4.0, "heel_strike", "left"), (5.0, "toe_off", "left")]
    tracked = [
        *[(1.02, "heel_strike", "right"), (0.9, "heel_strike", "right")],  # the nearer counts
        *[(2.0, "heel_strike", "right"), (2.0, "toe_off", "left")],  # neither is it
        (3.16, "heel_strike", "right"),  # too late
        (3.86, "heel_strike", "left"),
        (5.05, "toe_off", "left"),
    ]
    walker = Walker()
    clip = scored(walker, track_of(walker), events=as_tracked(tracked), true_events=table_of(true))
    assert clip.contacts.true == 4
    assert clip.contacts.errors_ms == pytest.approx([20.0, -140.0])
    assert clip.toe_offs.true == 1
    assert clip.toe_offs.errors_ms == pytest.approx([50.0])
    figures = sw.row([clip])
    assert [figures[f"contacts_{n}"] for n in ("true", "found")] == [4, 2]
    assert figures["contacts_mean_ms"] == pytest.approx(-60.0)
    assert figures["contacts_sd_ms"] == pytest.approx(np.sqrt(2.0) * 80.0)


def test_claims_are_mean_errors_with_the_sd_of_their_means():
    walker = Walker(HEADING)
    track = track_of(walker)
    for i, axis in enumerate("xyz"):
        track[f"{axis}_m"] += 0.03 * walker.forward[i] - 0.2 * walker.left[i] + 0.05 * UP[i]
    track["phase"] = (track["phase"] - 0.03) % 1.0
    track["right_knee_deg"] += 5.0 + 8.0 * EVERY_SECOND
    track["left_hip_deg"] -= 5.0
    track["left_hip_deg"][60:] += 3.0
    track["walk"][60:] = 1.0
    place = {"along_m": 0.02, "across_m": 0.1, "height_m": 0.04, "phase": 0.02}
    stated = [
        {**place, "right_knee_deg": 3.1, "left_hip_deg": 3.0},
        {**place, "height_m": 0.06, "right_knee_deg": 3.1},
    ]
    clip = scored(walker, track, mean_sds=stated)
    expected = {
        **{"along": (0.03, 0.02), "distance": (-0.2, 0.1), "height": (0.05, 0.048), "phase": (-0.03, 0.02)},
        "right_knee": (5.0, 3.1),
        "left_hip": (-5.0, 3.0),  # of the second walk, nothing is stated
    }
    assert clip.claims.keys() == expected.keys()
    for name, claim in clip.claims.items():
        assert (claim.error, claim.sd) == pytest.approx(expected[name]), name
    holds = {name: hits[0].holds for name, hits in sw.claim_hits([clip]).items()}
    assert holds == {
        **{"along": True, "distance": False, "height": True, "phase": True},
        **{"right_knee": True, "left_hip": False},
    }


def test_without_stated_sd_nothing_is_claimed():
    assert scored(Walker(), track_of(Walker())).claims == {}
    assert scored(Walker(), track_of(Walker()), mean_sds=[{}]).claims == {}


def gait_walker() -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Truth of 1 m/s, left steps of 0.4 s and 0.5 m and right steps of 0.6 s and 0.5 m.

    The right thigh is at 20 degrees to and fro, the left one at 10.
    """
    time_s = np.arange(0.0, 4.0, 1.0 / FPS)
    truth = {"frame": time_s * FPS, "time_s": time_s}
    for code in gt.JOINTS:
        truth |= {f"{code}_x_m": time_s, f"{code}_y_m": 0.0 * time_s, f"{code}_z_m": 1.0 + 0.0 * time_s}
    truth["RAN_x_m"] = time_s + 0.1  # right steps 0.6 + 0.1 m, left ones 0.4 - 0.1 m
    to_and_fro = (-1.0) ** np.arange(time_s.size)
    for side, swing_deg in (("R", 20.0), ("L", 10.0)):
        truth[f"{side}KN_x_m"] = time_s + 0.4 * np.tan(np.radians(swing_deg)) * to_and_fro
        truth[f"{side}KN_z_m"], truth[f"{side}AN_z_m"] = (height + 0.0 * time_s for height in (0.6, 0.2))
    events = [
        *[(0.4 + k, "heel_strike", "right") for k in range(3)],
        *[(0.8 + k, "heel_strike", "left") for k in range(3)],
        *[(1.06 + k, "toe_off", "right") for k in range(3)],  # stance 0.66 s
        *[(0.46 + k, "toe_off", "left") for k in range(3)],  # stance 0.66 s
    ]
    return truth, table_of(events)


def right_knee_deg(thigh_deg: float) -> float:
    """Of a thigh of 0.4 m height over a shank of 0.4 m, the ankle 0.1 m ahead of the hip."""
    ahead_m = 0.1 - 0.4 * np.tan(np.radians(thigh_deg))
    return float(thigh_deg - np.degrees(np.arctan2(ahead_m, 0.4)))


def test_true_gait_parameters_are_those_planted():
    gait = sw.true_gait(*gait_walker())
    expected = {
        ("cadence", ""): 120.0,
        ("speed", ""): 1.0,
        ("stride_time", ""): 1.0,
        ("stride_length", ""): 1.0,
        ("step_time", ""): 0.5,
        ("step_length", ""): 0.5,
        ("step_time", "right"): 0.6,
        ("step_time", "left"): 0.4,
        ("step_length", "right"): 0.7,
        ("step_length", "left"): 0.3,
        ("step_time_symmetry", ""): 40.0,
        ("step_length_symmetry", ""): 80.0,
        ("stance", "right"): 66.0,
        ("stance", "left"): 66.0,
        ("stance", ""): 66.0,
        ("swing", "right"): 34.0,
        ("swing", "left"): 34.0,
        ("swing", ""): 34.0,
        # After a right strike 0.06 s until the left toe is off, after a left one 0.26 s: 32 % of a cycle.
        ("double_support", ""): 32.0,
        ("single_support", ""): 68.0,
        ("single_support", "right"): 34.0,
        ("single_support", "left"): 34.0,
        ("hip_range", "right"): 40.0,
        ("hip_range", "left"): 20.0,
        # The left ankle is below the hip, so the shank leans as far back as the thigh leans forward.
        ("knee_range", "left"): 40.0,
        ("knee_peak", "left"): 20.0,
        ("knee_range", "right"): right_knee_deg(20.0) - right_knee_deg(-20.0),
        ("knee_peak", "right"): right_knee_deg(20.0),
    }
    assert gait == pytest.approx(expected, abs=1e-6)


def test_a_single_step_tells_no_stride():
    truth, events = gait_walker()
    first = {name: values[[0, 3]] for name, values in events.items()}  # 0.4 s right, 0.8 s left
    gait = sw.true_gait(truth, first)
    expected = {("speed", ""): 1.0, ("step_time", "left"): 0.4, ("step_length", "left"): 0.3}
    assert gait == pytest.approx(expected, abs=1e-6)


def gait_table(rows: list[tuple[str, str, str, float, float, float]]) -> dict[str, np.ndarray]:
    return dict(zip(NO_GAIT, map(np.array, zip(*rows, strict=True)), strict=True))


def test_intervals_are_judged_by_parameter_side_and_unit():
    table = gait_table(
        [
            ("cadence", "", "1/min", 118.0, 115.0, 121.0),
            ("step_time", "right", "s", 0.5, 0.45, 0.55),
            ("step_time", "left", "s", 0.4, 0.3, 0.5),
            ("speed", "", "km/h", 3.6, 3.0, 4.0),  # in a unit the truth is not in
            ("stance", "", "%", 61.0, np.nan, np.nan),  # assumed: no interval
            ("foot_clearance", "", "m", 0.02, 0.01, 0.03),
        ]
    )
    truth, events = gait_walker()
    found = sw.gait_intervals(table, sw.true_gait(truth, events))
    assert [row.parameter for row in found] == [
        "cadence",
        "step_time",
        "step_time",
        "speed",
        "foot_clearance",
    ]
    clip = sw.ClipScore("ANTO__x", 1.0, 1, gait=found)
    hits = sw.gait_hits([clip])
    assert {name: [hit.holds for hit in of] for name, of in hits.items()} == {
        "cadence": [True],
        "step_time": [False, True],
    }
    assert (hits["cadence"][0].error, hits["cadence"][0].half_width) == pytest.approx((-2.0, 3.0))


def test_asymmetries_are_false_where_the_true_steps_are_symmetric():
    def clip(name: str, true: float, low: float, high: float) -> sw.ClipScore:
        said = sw.Interval("step_time_symmetry", "", (low + high) / 2.0, low, high, true)
        symmetry = {"step_time_symmetry": true}
        return sw.ClipScore(name, 1.0, 1, gait=(said,), true_symmetry=symmetry)

    clips = [
        clip("silent", 3.9, -5.0, 9.0),
        clip("false", -3.9, 1.0, 9.0),
        clip("found", -20.0, -30.0, -4.0),
        clip("wrong way", -20.0, 2.0, 9.0),
        clip("missed", 4.1, -3.0, 11.0),
    ]
    said = sw.asymmetries(clips, "step_time_symmetry")
    assert said.symmetric == ("silent", "false") and said.false == ("false",)
    assert said.asymmetric == ("found", "wrong way", "missed") and said.found == ("found",)
    assert sw.asymmetries(clips, "step_length_symmetry").symmetric == ()


def test_shares_take_people_not_clips_as_independent():
    def hits(**people: list[bool]) -> list[sw.Hit]:
        return [sw.Hit(p, "tuning", holds, 0.0, 1.0) for p, of in people.items() for holds in of]

    mean, error = sw.share(hits(A=[True] * 5, B=[False] * 5))
    assert (mean, error) == pytest.approx((0.5, 0.5))
    mean, error = sw.share(hits(A=[True, False], B=[True, False]))
    assert (mean, error) == pytest.approx((0.5, 0.0))
    assert np.isnan(sw.share(hits(A=[True, False]))[1]) and np.isnan(sw.share([])[0])


def test_pooled_figures_are_root_mean_squares_of_the_clips():
    def clip(hip: float, bias: float, errors_ms: tuple[float, ...]) -> sw.ClipScore:
        figures = {"rms_deg": {"hip": hip}, "distance_m": abs(bias), "distance_bias_m": bias}
        return sw.ClipScore(
            "ANTO__x", 1.0, 1, swaps=(sw.Swap(0.01, False),), contacts=sw.Timing(4, errors_ms), **figures
        )

    figures = sw.row(
        [clip(3.0, 0.1, (10.0, 20.0, 30.0)), clip(5.0, -0.3, (-20.0,)), clip(np.nan, np.nan, ())]
    )
    assert figures["hip_deg"] == pytest.approx(np.sqrt((9.0 + 25.0) / 2.0))
    assert figures["distance_bias_cm"] == pytest.approx(-10.0)
    assert figures["distance_cm"] == pytest.approx(np.sqrt((100.0 + 900.0) / 2.0))
    assert (figures["contacts_true"], figures["contacts_found"]) == (12, 4)
    assert figures["contacts_mean_ms"] == pytest.approx(10.0)
    assert (figures["clips"], figures["walks"], figures["sides_right"]) == (3, 3, 3)
    assert np.isnan(figures["knee_deg"])


@pytest.mark.parametrize(
    ("name", "person", "people", "group"),
    [
        ("ANTO_hole__table", "ANTO", "tuning", "side view, all but clothes2"),
        ("BELT__stiff_right", "BELT", "tuning", "crouch, stiff, limp, brisk"),
        ("CMU02__clothes2", "CMU02", "tuning", "clothes2, far12, pitch12"),
        ("Gait__clothes1", "Gait", "others", "side view, all but clothes2"),
        ("BMC2__yaw30", "BMC2", "others", "yaw"),
        ("mocap_a", "mocap_a", "others", "side view, all but clothes2"),
        ("mocap_c_yaw25", "mocap_c", "others", "yaw"),
        ("CMU07__far12", "CMU07", "others", "clothes2, far12, pitch12"),
    ],
)
def test_clips_have_a_person_and_a_group(name, person, people, group):
    clip = sw.ClipScore(name, 1.0, 1)
    assert (clip.person, clip.people, clip.group) == (person, people, group)
    assert list(sw.pooled_rows([clip])) == [f"{group}; {people}"]


def test_stated_probabilities_stand_beside_how_often_sides_are_exchanged():
    swaps = (
        sw.Swap(0.0, False),
        sw.Swap(0.02, True, "poorly"),
        sw.Swap(0.3, True),
        sw.Swap(1.0, False, "poorly"),
    )
    clip = sw.ClipScore("ANTO__x", 1.0, 4, swaps=swaps)
    lines = [line.split() for line in sw.swap_table([clip, clip]).splitlines()[1:]]
    assert lines == [
        ["0.00-0.02", "4", "0.010", "2", "2", "2"],
        ["0.02-0.10", "0", "-", "0", "0", "0"],
        ["0.10-0.20", "0", "-", "0", "0", "0"],
        ["0.20-0.35", "2", "0.300", "2", "0", "0"],
        ["0.35-1.00", "2", "1.000", "0", "2", "0"],
    ]
    assert clip.sides == (1, 1, 2)


def demo(tmp_path: Path) -> sw.DemoScore:
    walker = Walker(np.pi)
    annotation = write_annotation(tmp_path / "annotation", walker, near="left")
    track = track_of(walker)
    track["left_knee_deg"] += 5.0
    turn = np.where(np.arange(FRAMES.size) % 10 == 0, 2.0, -2.0)  # every fifth frame is annotated
    track["right_hip_deg"] += turn - 1.0
    events = [(frame + 1.0 if i == 3 else frame, side) for i, (frame, side) in enumerate(walker.strikes())]
    tracked = [{"frame": f, "event": "heel_strike", "side": side, "time_s": 0.0} for f, side in events[:6]]
    return sw.score_demo(track, tracked, annotation)


def test_the_annotated_clip_is_centred_and_timed_in_frames(tmp_path):
    score = demo(tmp_path)
    assert score.rms_deg["near_knee"] == pytest.approx(5.0, abs=1e-6)
    assert score.centred_deg["near_knee"] == pytest.approx(0.0, abs=1e-5)
    assert score.rms_deg["far_hip"] == pytest.approx(np.sqrt(5.0))
    assert score.centred_deg["far_hip"] == pytest.approx(2.0)
    assert score.contacts_true == 7
    assert score.contacts_frames == pytest.approx([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    assert (score.toe_offs_true, score.toe_offs_frames) == (1, ())


def test_a_stored_run_is_read_back_and_stands_beside_the_new(tmp_path):
    walker = Walker(HEADING)
    wrong = Walker(HEADING)
    wrong.angles_deg["right_hip"] = wrong.angles_deg["right_hip"] + 4.0
    table = gait_table([("cadence", "", "1/min", 100.0, 99.0, 101.0), ("other", "", "s", 1.0, 0.5, 1.5)])
    events = as_tracked(strikes_of(walker))
    given = {"gait": table, "events": events, "mean_sds": [{"right_hip_deg": 2.0}]}
    before = [scored(walker, track_of(wrong), name=n, **given) for n in ("ANTO__x", "gone")]
    now = [scored(walker, track_of(walker), gait=table, events=events)]
    write_json(tmp_path / "run.json", sw.stored(before, demo(tmp_path)))
    read, demo_read = sw.read_stored(tmp_path / "run.json")
    assert sw.report(read, demo_read) == sw.report(before, sw.DemoScore(**vars(demo_read)))
    assert read[0].gait[0] == before[0].gait[0] and np.isnan(read[0].gait[1].true)
    assert read[0].claims.keys() == before[0].claims.keys() != set()
    pooled = json.loads((tmp_path / "run.json").read_text())["pooled"]
    assert pooled["side view, all but clothes2; tuning"]["hip_deg"] == pytest.approx(4.0 / np.sqrt(2.0))

    lines = sw.report(now, None, read).splitlines()
    clip = next(line for line in lines if line.startswith("ANTO__x"))
    assert "0.0 (2.8)" in clip and "7/7 +0 sd 0 (7/7 +0 sd 0)" in clip and "- (-)" not in clip
    assert not any(line.startswith("gone") for line in lines)
    assert any(
        line.startswith("side view, all but clothes2; tuning") and "0.0 (2.8)" in line for line in lines
    )
    assert lines[-1].endswith("without a truth: other")


def test_clips_come_from_the_table_of_a_folder(tmp_path):
    write_csv(
        tmp_path / "clips.csv", {"clip": ["A__x", "B__y"], "height_m": [1.7, 1.8], "drawn_with": ["", ""]}
    )
    clips = sw.clips_of(tmp_path)
    assert clips == [sw.Clip("A__x", tmp_path / "A__x", 1.7), sw.Clip("B__y", tmp_path / "B__y", 1.8)]
