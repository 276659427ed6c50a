"""The measured body height, and the sentences about heights and frame rates that contradict the video."""

import types

import memo
import numpy as np
import pytest
from conftest import shared_video
from memo import _memo
from memo.files import TRACK_COLUMNS
from memo.gait import lookup
from memo.plausible import (
    assumed_height_sentences,
    beside_sentences,
    contradiction_sentences,
    given_height_sentences,
    has_usual_steps,
    implausible_sentences,
    measured_height_sentences,
    running_sentences,
)
from memo.tracking import fit_sentence
from memo.video import VideoReader

SCENE_FRAMES = 45


@pytest.fixture(scope="module")
def scene():
    return memo.demo_scene(0, frames=SCENE_FRAMES)


def tracked(scene, **given):
    return memo.track(scene.frames, times_s=given.pop("times_s", scene.times_s), **given)


def walk(**values):
    usual = {
        "height": _memo.BodyHeight(1.7, 0.02, "given"),
        "measured_height": _memo.BodyHeight(1.71, 0.04, "measured"),
        "height_is_contradicted": False,
        "walk_ratio": _memo.WalkRatio(0.006, 0.004, 0.011),
        "fit": types.SimpleNamespace(sole_m=0.002, is_off_ground=False, verdict="well"),
        "unexplained": 0.003,
        "is_beside_somebody": False,
    }
    return types.SimpleNamespace(**usual | values)


def test_the_height_is_measured_in_a_calibrated_camera(scene):
    track = tracked(scene, camera=scene.camera)
    summary = track.summary
    assert summary["height_source"] == "measured"
    error_m = summary["height_m"] - scene.height_m
    assert abs(error_m) < min(0.06, 1.96 * summary["height_sd_m"]), summary
    assert any("tall, measured in the picture" in said for said in track.sentences)
    assert summary["doubts"] == []


@pytest.mark.parametrize(
    ("given_m", "taken", "said"),
    [
        ((1.80, 1.65), [(0, 1.80, "given"), (1, 1.65, "given"), (0, 1.80, "given")], ""),
        (
            (1.80, 1.65),
            [(0, 1.65, "given"), (1, 1.80, "given")],
            "person 0 is 1.65 m tall and person 1 is 1.80 m tall.",
        ),
        ((1.80, 1.65, 1.70), [(0, 1.80, "given")], "nobody was taken to be so tall: 1.65 m and 1.70 m."),
        ((1.84, 1.84), [(0, 1.84, "given"), (1, 1.84, "given"), (0, 1.62, "measured")], ""),
        ((1.80,), [(0, 1.62, "measured"), (0, 1.80, "given")], ""),
        ((1.80, 1.80), [(0, 1.80, "given"), (1, 1.80, "given"), (2, 1.74, "measured")], ""),
    ],
)
def test_heights_in_another_order_and_heights_of_nobody_are_named(given_m, taken, said):
    people = [(person, walk(height=_memo.BodyHeight(m, 0.02, source))) for person, m, source in taken]
    assert " ".join(given_height_sentences(given_m, people)).endswith(said)
    assert bool(said) == bool(given_height_sentences(given_m, people))


def test_a_height_of_nobody_is_named_by_the_track_of_everybody_alone(scene):
    said = "Given, but not used, as nobody was taken to be so tall: 1.50 m."
    track = tracked(scene, height_m=[scene.height_m, 1.5])
    assert track.sentences[0] == said
    assert tracked(scene, height_m=np.array([scene.height_m, 1.5])).sentences[0] == said
    assert not any("nobody" in sentence for sentence in track.of_person(0).sentences)


def test_without_camera_and_height_the_scale_is_the_population_s(scene):
    track, (height_m, sd_m) = tracked(scene), _memo.population_height_m()
    assert track.summary["height_m"] == height_m and track.summary["height_source"] == "assumed"
    assert track.summary["height_sd_m"] == sd_m
    assert track.sentences[0].startswith("No height and no camera were given")
    scale_sd = sd_m / height_m
    assert (track.columns["sd_z_m"] > scale_sd * track.columns["z_m"]).all()
    for quantity in ("speed", "stride_length"):
        row = lookup(track.gait_parameters, 0, quantity)
        assert row["ci_high"] - row["ci_low"] > 2 * 1.959 * scale_sd * row["value"]


def test_a_given_height_that_the_picture_contradicts_is_reported(scene):
    track = tracked(scene, camera=scene.camera, height_m=scene.height_m + 0.25)
    assert any("contradicts the picture" in said for said in track.sentences), track.sentences
    assert any("contradicts the picture" in doubt for doubt in track.summary["doubts"])
    assert track.summary["height_m"] == scene.height_m + 0.25


@pytest.mark.parametrize(("factor", "said"), [(1.0, []), (2.0, ["high"])])
def test_a_filmed_walk_at_twice_the_frame_rate_is_suspected(factor, said):
    clip = shared_video("sports2d_demo4")
    with VideoReader(clip / "demo4.mp4", start=45, stop=146) as video:
        frames = [(frame.luma.copy(), frame.time_s / factor) for frame in video]
    camera = memo.Camera.from_toml(clip / "camera.toml")
    lumas, times_s = zip(*frames, strict=True)
    doubts = memo.track(lumas, times_s=times_s, height_m=1.65, camera=camera).summary["doubts"]
    assert [
        rate for rate in ("high", "low") for doubt in doubts if f"frame rate is too {rate}" in doubt
    ] == said


def test_what_is_as_usual_is_not_mentioned():
    said = [
        assumed_height_sentences,
        measured_height_sentences,
        contradiction_sentences,
        beside_sentences,
        implausible_sentences,
    ]
    assert [sentence for told in said for sentence in told(walk())] == []
    assert implausible_sentences(walk(walk_ratio=None, fit=None)) == []


@pytest.mark.parametrize(
    ("camera_given", "why"), [(False, "no camera were given"), (True, "does not show it")]
)
def test_an_assumed_height_is_said_with_its_reason(camera_given, why):
    (said,) = assumed_height_sentences(
        walk(height=_memo.BodyHeight(1.7, 0.1, "assumed")), camera_given=camera_given
    )
    assert why in said and "1.70 m tall" in said and "by 12%" in said


def test_feet_off_the_ground_are_mentioned():
    (above,) = implausible_sentences(walk(fit=types.SimpleNamespace(sole_m=0.12, is_off_ground=True)))
    (below,) = implausible_sentences(walk(fit=types.SimpleNamespace(sole_m=-0.22, is_off_ground=True)))
    assert "12 cm above the ground" in above and "22 cm below the ground" in below


def test_a_ratio_outside_its_limits_is_mentioned():
    for ratio, rate in ((0.0036, "high"), (0.0125, "low")):
        (said,) = implausible_sentences(walk(walk_ratio=_memo.WalkRatio(ratio, 0.004, 0.011)))
        assert f"frame rate is too {rate}" in said and "4.00 to 11.00 are usual" in said
        assert f"{1000 * ratio:.2f} mm" in said


def test_steps_that_few_people_take_may_be_counted_wrongly():
    for ratio, is_usual in ((0.0036, False), (0.004, True), (0.011, True), (0.0125, False)):
        assert has_usual_steps(walk(walk_ratio=_memo.WalkRatio(ratio, 0.004, 0.011))) == is_usual
    assert has_usual_steps(walk(walk_ratio=None))


def test_the_verdict_gives_its_reason():
    angles = {name: np.ones(3) for name in TRACK_COLUMNS if name.endswith("_deg")}
    good = {"verdict": "well", "residual_px": 0.5, "height_px": 50.0, "missed": 0.01, "worst_length_sd": 1.0}
    good |= {"is_far": False, "is_beside_the_crown": False, "crown_off": 0.004, "off_parts": []}

    def said(columns=angles, **values):
        return fit_sentence(walk(fit=types.SimpleNamespace(**good | values), columns=columns))

    on_average = "its outline is on average 0.5 px from the edges in the video"
    assert said() == f"The model fits the person well: {on_average}, and 1% of it has no edge."
    assert said(verdict="poorly", is_far=True) == (
        f"The model fits the person poorly: {on_average}, 1.0% of the person's height, which is too far; "
        "1% of it has no edge. The model may be in a wrong place: check the overlay, and do not use the "
        "angles."
    )
    assert said(verdict="in part").endswith("Check the overlay before use.")
    assert "too far" not in said(verdict="poorly", missed=0.2)
    off = {"off_parts": ["left shank", "left foot"], "part_missed": {"left shank": 0.34, "left foot": 0.4}}
    off |= {"verdict": "in part", "part_residual_px": {"left shank": 1.2}}
    assert (
        "; worst at the left shank (34% without an edge, 1.2 px off) and the left foot (40% without an edge)."
        in said(**off)
    )
    assert "shank" not in said(**off | {"verdict": "well"}), "the table of the report has it"
    unseen = {name: np.full(3, np.nan) for name in angles}
    assert "No joint angle is known well enough" in said(unseen, verdict="poorly", missed=0.2)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_wrong_height_is_told_from_the_picture(share):
    """The model of a small person ends at the neck of a tall one, unless the crown of the person is seen."""
    scene = memo.demo_scene(8, frames=90)
    given_m = share * scene.height_m
    (walk,) = memo.track(scene.frames, fps=25, camera=scene.camera, height_m=given_m).walks
    assert walk.height_is_contradicted
    assert walk.measured_height.height_m == pytest.approx(scene.height_m, abs=0.05)
    assert not walk.fit.is_beside_the_crown
    (said,) = contradiction_sentences(walk)
    assert f"The given height of {given_m:.2f} m contradicts the picture" in said


def test_a_head_below_the_person_s_is_named():
    fit = types.SimpleNamespace(
        verdict="poorly",
        residual_px=0.5,
        height_px=200.0,
        missed=0.01,
        worst_length_sd=1.0,
        is_beside_the_crown=True,
        crown_off=0.15,
        is_far=False,
        off_parts=[],
    )
    angles = {name: np.array([1.0]) for name in TRACK_COLUMNS if name.endswith("_deg")}
    said = fit_sentence(types.SimpleNamespace(fit=fit, columns=angles))
    assert "its head is 15% of the height below the person's" in said


def in_the_shadow(scene, frames_later, columns):
    """The scene with the same walker once more, as some frames later, behind the first and mostly hidden."""
    empty = np.median(scene.frames, axis=0)
    is_seen = abs(scene.frames - empty) > 16
    middles = [np.nonzero(seen)[1].mean() for seen in is_seen]
    frames = []
    for k, frame in enumerate(scene.frames):
        later = min(k + frames_later, len(scene.frames) - 1)
        shift = round(middles[k] - middles[later]) + columns
        behind, is_behind = (np.roll(pixels[later], shift, axis=1) for pixels in (scene.frames, is_seen))
        frames.append(np.where(is_seen[k] | ~is_behind, frame, behind))
    return np.array(frames)


def test_legs_in_the_shadow_of_somebody_are_mentioned():
    scene = memo.demo_scene(0, frames=60)
    given = {"times_s": scene.times_s, "camera": scene.camera, "height_m": scene.height_m}
    alone = memo.track(scene.frames, **given)
    assert alone.walks[0].unexplained < 0.006 and not alone.walks[0].is_beside_somebody
    assert not any("Beside the legs" in said for said in alone.sentences)
    track = memo.track(in_the_shadow(scene, frames_later=5, columns=-8), **given)
    assert [said for said in track.sentences if said.startswith("Beside the legs something else moves")]
    assert any("Beside the legs" in doubt for doubt in track.summary["doubts"])
    assert 0.018 < track.walks[0].unexplained < 0.3


@pytest.mark.parametrize(
    ("speed_mps", "runs"), [(1.3, False), (2.0, False), (2.2, True), (float("nan"), False)]
)
def test_somebody_who_is_too_fast_to_walk_runs(speed_mps, runs):
    said = running_sentences(walk(), speed_mps)
    assert len(said) == runs and all(
        sentence.startswith("This is not walking: at 2.20 m/s") for sentence in said
    )


def test_a_walk_that_is_played_too_fast_is_not_called_walking(scene):
    track = tracked(scene, times_s=scene.times_s / 2.2, camera=scene.camera)
    assert any("not walking" in said for said in track.sentences), track.sentences
    assert any("not walking" in doubt for doubt in track.summary["doubts"])


def test_without_a_camera_a_height_is_measured_against_the_first_persons():
    measured = walk(height=_memo.BodyHeight(1.82, 0.04, "measured"))
    (without,), (calibrated,) = (
        measured_height_sentences(measured, camera_given=given) for given in (False, True)
    )
    assert "if the height of the other person" in without and "standard deviation" not in without
    assert "measured in the picture" in calibrated


def test_a_height_that_the_fit_did_not_measure_is_not_called_measured():
    measured = _memo.BodyHeight(1.82, 0.05, "measured")
    (said,) = measured_height_sentences(walk(height=measured, measured_height=None, fit=None))
    assert said.startswith("The person is taken to be 1.82 m tall, as the moving region at the start")
    assert said.endswith("so the height was not measured.") and "measured in the picture" not in said
    for verdict, is_doubtful in (("well", False), ("in part", False), ("poorly", True)):
        fit = types.SimpleNamespace(verdict=verdict)
        (said,) = measured_height_sentences(walk(height=measured, measured_height=measured, fit=fit))
        assert ("measured in the picture (standard deviation 0.05 m)" in said) and (
            ("by a model that fits poorly: the error may be much larger." in said) is is_doubtful
        )


def test_who_has_no_height_of_their_own_is_told_apart_from_nobody_having_one():
    assumed = walk(height=_memo.BodyHeight(1.70, 0.10, "assumed"))
    for heights_given, why in [
        (False, "No height and no camera were given"),
        (True, "No height was given for this person, and no camera"),
    ]:
        (said,) = assumed_height_sentences(assumed, heights_given=heights_given)
        assert said.startswith(f"{why}, so the person is taken to be 1.70 m tall")
