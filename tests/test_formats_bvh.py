"""BVH: what memo writes, read by pybvh; a real file, read by both; grammar and damage."""

import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pybvh
import pytest
from memo.files import JOINTS
from memo.formats import FormatError, Motion, read_motion, write_motion
from motions import shared_motion, stick_figure, walk

BONES = {
    f"{side}_{joint}": f"{side.capitalize()}{bone}"
    for side in ("right", "left")
    for joint, bone in (
        ("shoulder", "Arm"),
        ("elbow", "ForeArm"),
        ("wrist", "Hand"),
        ("hip", "UpLeg"),
        ("knee", "Leg"),
        ("ankle", "Foot"),
    )
}


def by_pybvh(path, up="y"):
    """Joint names and (T, K, 3) metres with Z up, from centimetres, as pybvh places them."""
    file = pybvh.read_bvh_file(path)
    points = file.joint_positions() / 100
    if up == "y":
        points = np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)
    return file, file.joint_names, points


@pytest.mark.parametrize("up", ["y", "z"])
def test_pybvh_finds_every_joint_where_it_was(tmp_path, up):
    motion, path = walk(frames=80, start_s=0.4, gaps=False), tmp_path / "walk.bvh"
    notes = write_motion(path, motion, up)
    file, names, points = by_pybvh(path, up)
    for k, joint in enumerate(JOINTS):
        place = points[:, names.index(BONES[joint])]
        assert np.abs(place - motion.points[:, k]).max() < 1e-6, joint
    assert file.world_up == f"+{up}" and file.rest_up == f"+{up}"
    assert file.fps == 50 and file.frame_count == 80
    assert notes == [
        "A BVH file begins at 0 s; this motion began at 0.4 s.",
        "A BVH file cannot store events: left out.",
        "A BVH file cannot store joint angles as such: left out.",
    ]
    read = read_motion(path)
    assert read.metadata["up"] == up and read.metadata["unit_m"] == 0.01
    assert np.abs(read.points - points[:, [names.index(name) for name in read.names]]).max() < 1e-9
    assert abs(read.times_s[-1] - 79 / 50) < 1e-6


def test_the_first_rotation_of_a_knee_is_its_flexion(tmp_path):
    motion, path = walk(frames=60, gaps=False), tmp_path / "walk.bvh"
    write_motion(path, motion)
    file, names, _ = by_pybvh(path)
    knee = names.index("RightLeg")
    assert file.euler_orders[knee] == "XZY" and file.euler_orders[names.index("Hips")] == "YXZ"
    hip, knee_m, ankle = (
        motion.points[:, JOINTS.index(f"right_{part}")] for part in ("hip", "knee", "ankle")
    )
    thigh, shank = knee_m - hip, ankle - knee_m
    cosine = (thigh * shank).sum(axis=1) / np.linalg.norm(thigh, axis=1) / np.linalg.norm(shank, axis=1)
    flexion = np.arccos(np.clip(cosine, -1, 1))
    assert np.abs(np.abs(file.joint_angles[:, knee, 0]) - flexion).max() < 1e-6
    assert np.abs(file.joint_angles[:, knee, 1:]).max() < 1e-6
    heading = np.unwrap(file.joint_angles[:, names.index("Hips"), 0])
    forward = np.array([0.8, 0.6])  # figures face +Z at rest, which is -Y of the world
    assert np.allclose(heading, np.arctan2(forward[0], -forward[1]), atol=1e-6)


def test_limbs_that_change_their_length_are_told(tmp_path):
    points, times_s = stick_figure(40)
    wrist = JOINTS.index("right_wrist")
    points[:, wrist] += np.outer(np.linspace(-0.05, 0.05, 40), [0, 0, 1.0])
    path = tmp_path / "elastic.bvh"
    notes = write_motion(path, Motion(JOINTS, times_s, points))
    assert len(notes) == 1 and "RightHand is up to" in notes[0]
    _, names, read = by_pybvh(path)
    off = np.linalg.norm(read[:, names.index("RightHand")] - points[:, wrist], axis=1)
    assert f"{100 * off.max():.1f} cm" in notes[0]
    others = [k for k, joint in enumerate(JOINTS) if k != wrist]
    columns = [names.index(BONES[JOINTS[k]]) for k in others]
    assert np.abs(read[:, columns] - points[:, others]).max() < 1e-6


def test_a_real_file_is_read_as_pybvh_reads_it(tmp_path):
    path = shared_motion("mocap", "formats", "cmu_12_01_walk.bvh")
    motion = read_motion(path)
    assert len(motion.times_s) == 524 and motion.at_constant_rate()[0] == 120
    assert motion.notes[1].startswith("The file names no unit: CMU's unit")
    file = pybvh.read_bvh_file(path)
    places = file.node_positions() * motion.metadata["unit_m"]
    places = np.stack([places[..., 0], -places[..., 2], places[..., 1]], axis=-1)
    nodes = [node.name.removeprefix("EndSite") + "_end" * node.is_end_site() for node in file.nodes]
    assert np.abs(motion.points - places[:, [nodes.index(name) for name in motion.names]]).max() < 1e-12
    assert read_motion(path, unit_m=1).points == pytest.approx(motion.points / motion.metadata["unit_m"])
    # Its joints again in a skeleton of memo's: legs are as rigid there, shoulders and back are not.
    again = tmp_path / "again.bvh"
    notes = write_motion(again, motion)
    _, names, points = by_pybvh(again)
    off_m = {}
    for bone in [*BONES.values(), "Head"]:
        difference = points[:, names.index(bone)] - motion.points[:, motion.names.index(bone)]
        off_m[bone] = np.linalg.norm(difference, axis=1).max()
    assert max(off_m[bone] for bone in BONES.values() if bone.endswith(("Leg", "Foot"))) < 1e-6
    worst = max(off_m, key=off_m.get)
    assert f"Hand is up to {100 * off_m[worst]:.1f} cm from its given position" in notes[1]
    assert off_m[worst] < 0.05


def test_what_is_known_of_a_skeleton_is_written(tmp_path):
    points, times_s = stick_figure(10)
    legs = [JOINTS.index(f"{side}_{part}") for side in ("right", "left") for part in ("hip", "knee")]
    names = tuple(JOINTS[k] for k in legs)
    head = Motion(
        (*names, "head", "spare"), times_s, np.concatenate([points[:, legs], points[:, :2]], axis=1)
    )
    notes = write_motion(tmp_path / "legs.bvh", head)
    assert notes == ["Left out, not part of the skeleton: head, spare."]
    _, names, _ = by_pybvh(tmp_path / "legs.bvh")
    assert names == ["Hips", "RightUpLeg", "RightLeg", "LeftUpLeg", "LeftLeg"]
    no_hips = Motion(("a", "b"), times_s, points[:, :2])
    with pytest.raises(FormatError, match="needs right_hip and left_hip; the motion has a, b"):
        write_motion(tmp_path / "no.bvh", no_hips)
    points[3:6, 2] = np.nan
    with pytest.raises(FormatError, match=r"right_wrist is missing in 3 frames, the first at 0.06 s"):
        write_motion(tmp_path / "no.bvh", Motion(JOINTS, times_s, points))
    assert not (tmp_path / "no.bvh").exists()


def test_empty_frames_at_the_ends_are_left_out(tmp_path):
    points, times_s = stick_figure(30)
    points[:4] = points[26:] = np.nan
    points[25, 2] = np.nan
    notes = write_motion(tmp_path / "cut.bvh", Motion(JOINTS, times_s, points))
    assert notes == [
        "Left out: 9 frames at the ends, where a joint is missing.",
        "A BVH file begins at 0 s; this motion began at 0.08 s.",
    ]
    _, names, read = by_pybvh(tmp_path / "cut.bvh")
    assert np.abs(read[:, names.index("RightFoot")] - points[4:25, JOINTS.index("right_ankle")]).max() < 1e-6


def test_heads_turn_upside_down_and_limbs_straight_up(tmp_path):
    points, times_s = stick_figure(6)
    wrist, elbow = JOINTS.index("right_wrist"), JOINTS.index("right_elbow")
    points[:, wrist] = points[:, elbow] + [0, 0, 0.25]  # straight up, opposite to rest
    upside_down = points * [1, 1, -1]
    for turned in (points, upside_down):
        write_motion(tmp_path / "up.bvh", Motion(JOINTS, times_s, turned))
        _, names, read = by_pybvh(tmp_path / "up.bvh")
        for k, joint in enumerate(JOINTS):
            assert np.abs(read[:, names.index(BONES[joint])] - turned[:, k]).max() < 1e-6


FILE = """HIERARCHY
ROOT Hips
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Left Leg { OFFSET 0 -40 0 CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0 -40 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.04
0 100 0 0 0 0 0
0 100 0 90 0 0 90
"""


def test_hand_written_grammar_and_rotation_order(tmp_path):
    path = tmp_path / "hand.bvh"
    path.write_text(FILE)
    motion = read_motion(path)
    assert motion.names == ("Hips", "Left_Leg", "Left_Leg_end")
    assert motion.notes[1] == "The file names no unit, and has no legs to measure: cm was assumed."
    assert motion.points[0] == pytest.approx(np.array([[0, 0, 1], [0, 0, 0.6], [0, 0, 0.2]]))
    # A quarter turn about Z brings -Y to +X; one about X before it brings -Y to -Z, which Z leaves.
    wanted = np.array([[0, 0, 1], [0.4, 0, 1], [0.4, 0.4, 1]])
    assert motion.points[1] == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize(
    ("was", "becomes", "says"),
    [
        ("HIERARCHY", "", "line 1: not a BVH file"),
        ("ROOT Hips", "ROOT", "line 2: ROOT without a name"),
        ("ROOT Hips\n{", "ROOT Hips", "line 3: wanted { after the name of a joint, got 'OFFSET'"),
        ("ROOT", "JOINT", "line 2: JOINT is not allowed here"),
        ("JOINT", "ROOT", "line 6: ROOT is not allowed here"),
        ("1 2 3", "1 2 nan", "line 4: OFFSET 1 2 nan is implausibly large"),
        ("  OFFSET 1 2 3\n", "", "joint Hips: no OFFSET"),
        ("1 2 3", "1 2 1e300", "line 4: OFFSET 1 2 1e300 is implausibly large"),
        ("1 2 3", "1 2", "line 4: OFFSET has 2 numbers"),
        ("CHANNELS 6", "CHANNELS 7", "line 5, CHANNELS: wanted a whole number from 0 to 6, got '7'"),
        ("CHANNELS 1 Xrotation", "CHANNELS 1 Wrotation", "line 6: CHANNELS 1 Wrotation: wanted 1 of Xpos"),
        ("      OFFSET 0 -40 0\n", "      JOINT x {", "line 9: JOINT inside an End Site"),
        ("}\nMOTION", "MOTION", "line 12: MOTION, but 1 joint still open"),
        ("MOTION", "motion", "line 13: 'motion' does not belong in a hierarchy"),
        ("Frames: 2", "Frames: 3", "Frames: 3, but there are 2 lines of 7 numbers"),
        ("Frames: 2", "Frames: 1e12", "line 14, Frames: wanted a whole number"),
        ("0.04", "0", "line 15: Frame Time 0 s"),
        ("Frame Time: 0.04\n", "", "line 14: wanted Frames: and Frame Time: after MOTION"),
        ("0 100 0 90 0 0 90", "0 100 0 90 0 0", "line 17: 6 numbers, the joints have 7 channels"),
        ("0 100 0 90 0 0 90", "0 100 0 90 0 0 x", "line 17, column 7: 'x' is not a finite number"),
        ("0 100 0 90 0 0 90", "0 100 0 90 0 0 nan", "line 17: a channel is not a number"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path, was, becomes, says):
    path = tmp_path / "bad.bvh"
    path.write_text(FILE.replace(was, becomes, 1))
    with pytest.raises(FormatError, match=says) as caught:
        read_motion(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_deep_and_wide_skeletons_do_no_harm(tmp_path):
    path = tmp_path / "deep.bvh"
    depth = 3000
    joints = "".join(f"JOINT j{k} {{ OFFSET 0 1 0 CHANNELS 1 Xrotation\n" for k in range(depth))
    head = "HIERARCHY\nROOT r\n{ OFFSET 0 0 0 CHANNELS 1 Xrotation\n"
    rows = " ".join(["0"] * (depth + 1))
    path.write_text(f"{head}{joints}{'}' * (depth + 1)}\nMOTION\nFrames: 1\nFrame Time: 1\n{rows}\n")
    motion = read_motion(path)
    assert motion.points[0, -1] == pytest.approx([0, 0, 0.01 * depth])
    path.write_text(head + "JOINT j { OFFSET 0 0 0 }\n" * 20_000)
    with pytest.raises(FormatError, match="more than 10000 joints"):
        read_motion(path)


IN_BLENDER = """
import sys, bpy, addon_utils, numpy
path, out, up = sys.argv[1:]
addon_utils.enable("io_anim_bvh")
axes = {"axis_forward": "-Z", "axis_up": "Y"} if up == "y" else {"axis_forward": "Y", "axis_up": "Z"}
bpy.ops.import_anim.bvh(filepath=path, global_scale=0.01, update_scene_fps=True, **axes)
figure, scene = bpy.context.object, bpy.context.scene
names = [bone.name for bone in figure.pose.bones]
places = []
for frame in range(1, int(bpy.data.actions[0].frame_range[1]) + 1):
    scene.frame_set(frame)
    places.append([figure.matrix_world @ bone.head for bone in figure.pose.bones])
numpy.savez(out, names=names, places=places, fps=scene.render.fps / scene.render.fps_base)
"""


@pytest.mark.skipif(find_spec("bpy") is None, reason="Blender is not there (pip install bpy)")
@pytest.mark.parametrize("up", ["y", "z"])
def test_blender_places_every_joint_where_it_was(tmp_path, up):
    motion, path, out = walk(frames=30, gaps=False), tmp_path / "walk.bvh", tmp_path / "blender.npz"
    write_motion(path, motion, up)
    subprocess.run([sys.executable, "-c", IN_BLENDER, str(path), str(out), up], check=True)
    found = np.load(out)
    assert found["fps"] == pytest.approx(50) and len(found["places"]) == 30
    for k, joint in enumerate(JOINTS):
        place = found["places"][:, [*found["names"]].index(BONES[joint])]
        assert np.abs(place - motion.points[:, k]).max() < 1e-5, joint


MOVING = """HIERARCHY
ROOT Hips
{
	OFFSET 0 0 0
	CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
	JOINT LeftUpLeg
	{
		OFFSET 10 0 0
		CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
		JOINT LeftLeg
		{
			OFFSET 0 -40 0
			CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
			JOINT LeftFoot
			{
				OFFSET 0 -40 0
				CHANNELS 3 Zrotation Xrotation Yrotation
				End Site
				{
					OFFSET 0 -5 0
				}
			}
		}
	}
}
MOTION
Frames: 2
Frame Time: 0.04
"""


def test_positions_below_the_root_stand_in_the_place_of_the_offset(tmp_path):
    """The places are those of Blender 5.0.1 and bvhio 1.5.4."""
    path = tmp_path / "moving.bvh"
    path.write_text(
        MOVING
        + "0 90 0 0 0 0 10 0 0 0 0 0 0 -40 0 0 0 0 0 0 0\n0 90 0 0 0 0 10 1 0 0 0 0 0 -41 0 0 0 0 0 0 0\n"
    )
    motion = read_motion(path)
    wanted = [[0, 90], [10, 91], [10, 50], [10, 10], [10, 5]]
    assert motion.points[1][:, [0, 2]] == pytest.approx(np.array(wanted) / 100)
    assert motion.notes[-1].startswith("Positions below the root, of 2 joints, the first LeftUpLeg: they")
    # Programs that add write what is left of the offset, nearly nothing.
    path.write_text(
        MOVING + "0 90 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\n0 90 0 0 0 0 0 1 0 0 0 0 0 -1 0 0 0 0 0 0 0\n"
    )
    assert read_motion(path).points[1][:, [0, 2]] == pytest.approx(np.array(wanted) / 100)
