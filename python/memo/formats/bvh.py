"""BVH (Biovision): a skeleton of fixed limbs and its joints' rotations over time, as text.

Reading is forward kinematics: with R_j the product of a joint's rotation channels in their order in the
file, `R_world(j) = R_world(parent) R_j` and `p(j) = p(parent) + R_world(parent) offset_j`. Position
channels replace the offset, as in Blender; below the root some programs add the two, so
positions there that are nearer to 0 than to the offset are added to it. Points are the joints and, as
`NAME_end`, the ends of the last bones if these have a length.

The format names neither unit nor up axis. The up axis is the one along which the resting skeleton is
tallest between feet and head; the unit is the one that gives the legs a human length: metres,
centimetres, millimetres, or that of the CMU recordings (0.05644 m). The choice is reported. Without legs
to measure, Y up and centimetres are assumed.

The unit written is the centimetre. The skeleton, as far as the joints are known:

    Hips (between the hips) - RightUpLeg - RightLeg - RightFoot, the same left
                            - LowerBack (same place) - Chest (between the shoulders)
                                - RightArm - RightForeArm - RightHand, the same left
                                - Neck (same place) - Head

At rest the figure stands upright with all limbs straight down, facing +Z with Y up and -Y with Z up, +X
to its left. Channels are Y X Z (Y up) or Z X Y (Z up) for Hips, LowerBack and Chest, so that the heading
comes first, and X Z Y or X Y Z for the rest, so that the first is flexion. Rotation of a limb about
its own axis cannot be computed from joints; the smallest is used. Lengths are medians over time, so joints
with varying distances move: the largest shift is reported. Frames at the ends in which a joint is missing
are left out; between them every joint must be known in every frame.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.formats.motion import MAX_POINTS, FormatError, Motion, Up, from_z_up, to_z_up
from memo.formats.names import joint_places, joints_found, listed
from memo.formats.reading import METRIC_M, Given, unit_of_legs
from memo.formats.text import number, numbers, read_lines, whole_number
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = ["read_bvh", "write_bvh"]

Array = npt.NDArray[np.float64]

_MOST_NODES = 10_000
_CMU_UNIT_M = 0.0254 / 0.45
_UNITS_M = METRIC_M | {"CMU's unit of 0.05644 m": _CMU_UNIT_M}
_CHANNELS = {f"{axis}{kind}": (kind, k) for kind in ("position", "rotation") for k, axis in enumerate("XYZ")}


@dataclass
class _Node:
    name: str
    parent: int
    offset: Array
    channels: list[str] = field(default_factory=list)
    is_end: bool = False
    column: int = 0
    """Index of its first channel in a frame."""


# Reading.


def read_bvh(path: Path, given: Given) -> Motion:
    """Reads the positions of the joints."""
    given.check_used("unit_m")
    lines = read_lines(path)
    nodes, start = _hierarchy(lines)
    values, frame_s = _frames(lines, start, sum(len(node.channels) for node in nodes))
    kept = [k for k, node in enumerate(nodes) if not node.is_end or np.any(node.offset)]
    names = [nodes[k].name for k in kept]
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise FormatError(f"joint {twice[0]} occurs twice")
    if len(values) * len(kept) > MAX_POINTS:
        raise FormatError(
            f"{counted(len(values), 'frame')} of {counted(len(kept), 'joint')} are more than memo reads"
        )
    up, unit_m, notes = _conventions(nodes, given)
    moving = [node.name for node in nodes if node.parent >= 0 and _has_place(node)]
    if moving:
        notes.append(
            f"Positions below the root, of {counted(len(moving), 'joint')}, the first {moving[0]}: they"
            " replace the offsets, but are added to them where they are near 0."
        )
    with np.errstate(over="ignore", invalid="ignore"):
        points = unit_m * np.stack([*_positions(nodes, values, kept)], axis=1)
    if not np.isfinite(points).all():
        raise FormatError("offsets or positions so large that they overflow")
    rate_hz = 1 / frame_s
    if abs(round(rate_hz) / rate_hz - 1) < 1e-4:  # frame times are written with few digits
        rate_hz = float(round(rate_hz))
    metadata = {"format": "bvh", "up": up, "unit_m": unit_m, "rate_hz": rate_hz}
    return Motion(
        tuple(names),
        np.arange(len(values), dtype=np.float64) / rate_hz,
        to_z_up(points, up),
        metadata=metadata,
        notes=tuple(notes),
    )


def _hierarchy(lines: list[str]) -> tuple[list[_Node], int]:
    """The nodes, parents first, and the index of the line MOTION."""
    nodes: list[_Node] = []
    open_nodes: list[int] = []
    awaits_brace = False
    column = 0
    if not lines or lines[0].split()[:1] != ["HIERARCHY"]:
        raise FormatError("line 1: not a BVH file (which begins with HIERARCHY)")
    for index, line in enumerate(lines[1:], 1):
        words = line.replace("{", " { ").replace("}", " } ").split()
        where = f"line {index + 1}"
        while words:
            word = words.pop(0)
            if awaits_brace and word != "{":
                raise FormatError(f"{where}: wanted {{ after the name of a joint, got {word[:40]!r}")
            if word == "MOTION":
                if open_nodes or not nodes:
                    raise FormatError(f"{where}: MOTION, but {counted(len(open_nodes), 'joint')} still open")
                for node in nodes:
                    if not node.is_end and not np.isfinite(node.offset).all():
                        raise FormatError(f"joint {node.name}: no OFFSET")
                return nodes, index
            if word in ("ROOT", "JOINT", "End"):
                nodes.append(_joint(word, words, nodes, open_nodes, where))
                awaits_brace = True
            elif word == "{":
                if not awaits_brace:
                    raise FormatError(f"{where}: {{ without a joint")
                open_nodes.append(len(nodes) - 1)
                awaits_brace = False
            elif word == "}":
                if not open_nodes:
                    raise FormatError(f"{where}: }} without a joint")
                open_nodes.pop()
            elif word == "OFFSET" and open_nodes:
                nodes[open_nodes[-1]].offset = _offset(words[:3], where)
                del words[:3]
            elif word == "CHANNELS" and open_nodes:
                node = nodes[open_nodes[-1]]
                node.channels, node.column = _channels(words, node, where), column
                column += len(node.channels)
            else:
                raise FormatError(f"{where}: {word[:40]!r} does not belong in a hierarchy")
    raise FormatError(f"line {len(lines)}: no line MOTION")


def _joint(word: str, words: list[str], nodes: list[_Node], open_nodes: list[int], where: str) -> _Node:
    """The node that ROOT, JOINT or End begins; consumes its name."""
    if (word == "ROOT") == bool(open_nodes) or (word == "ROOT" and nodes):
        raise FormatError(f"{where}: {word} is not allowed here; all joints must be in one ROOT")
    if len(nodes) >= _MOST_NODES:
        raise FormatError(f"{where}: more than {_MOST_NODES} joints")
    if open_nodes and nodes[open_nodes[-1]].is_end:
        raise FormatError(f"{where}: {word} inside an End Site")
    parent = open_nodes[-1] if open_nodes else -1
    given = "_".join(_until_brace(words))
    name = f"{nodes[parent].name}_end" if word == "End" else given
    if not name:
        raise FormatError(f"{where}: {word} without a name")
    return _Node(name, parent, np.full(3, np.nan), is_end=word == "End")


def _offset(cells: list[str], where: str) -> npt.NDArray[np.float64]:
    """The place of a joint in its parent, (3,), in the file's unit."""
    if len(cells) < 3:
        raise FormatError(f"{where}: OFFSET has {counted(len(cells), 'number')}, wanted 3")
    place = [number(cell, f"{where}, OFFSET") for cell in cells]
    if not all(abs(x) < 1e9 for x in place):
        raise FormatError(f"{where}: OFFSET {' '.join(cells)[:60]} is implausibly large")
    return np.array(place)


def _channels(words: list[str], node: _Node, where: str) -> list[str]:
    """The names of a joint's channels; consumes their number and them."""
    count = whole_number(words[0] if words else "", f"{where}, CHANNELS", 6)
    channels = words[1 : 1 + count]
    del words[: 1 + count]
    unknown = [name for name in channels if name not in _CHANNELS]
    if unknown or len(channels) != count or len(set(channels)) != count:
        got = f"{count} {' '.join(channels)[:80]}"
        raise FormatError(f"{where}: CHANNELS {got}: wanted {count} of Xposition ... Zrotation")
    if node.channels or node.is_end:
        raise FormatError(f"{where}: CHANNELS of {node.name} are not allowed here")
    return channels


def _until_brace(words: list[str]) -> list[str]:
    """Consumes the words of a name, up to the brace."""
    end = words.index("{") if "{" in words else len(words)
    name = words[:end]
    del words[:end]
    return name


def _frames(lines: list[str], motion: int, channels: int) -> tuple[Array, float]:
    """(T, channels) and seconds from frame to frame."""
    said: dict[str, tuple[str, int]] = {}
    index = motion + 1
    while index < len(lines) and len(said) < 2:
        key, colon, value = lines[index].partition(":")
        if colon:
            said[" ".join(key.split()).lower()] = (value.strip(), index + 1)
        elif lines[index].strip():
            break
        index += 1
    for key in ("frames", "frame time"):
        if key not in said:
            raise FormatError(f"line {motion + 2}: wanted Frames: and Frame Time: after MOTION")
    frames = whole_number(said["frames"][0], f"line {said['frames'][1]}, Frames")
    frame_s = number(said["frame time"][0], f"line {said['frame time'][1]}, Frame Time")
    if not 1e-6 <= frame_s <= 1e4:
        raise FormatError(f"line {said['frame time'][1]}: Frame Time {frame_s:g} s")
    columns = [f"{k + 1}" for k in range(channels)]
    rows = []
    for line_index, line in enumerate(lines[index:], index + 1):
        cells = line.split()
        if not cells:
            continue
        if len(cells) != channels:
            raise FormatError(
                f"line {line_index}: {counted(len(cells), 'number')},"
                f" the joints have {counted(channels, 'channel')}"
            )
        row = numbers(cells, line_index, columns)
        if any(x != x or abs(x) > 1e12 for x in row):
            raise FormatError(f"line {line_index}: a channel is not a number or implausibly large")
        rows.append(row)
    if len(rows) != frames or not rows or not channels:
        raise FormatError(
            f"Frames: {frames}, but there are {counted(len(rows), 'line')} of {counted(channels, 'number')}"
        )
    return np.array(rows), frame_s


def _positions(nodes: list[_Node], values: Array, kept: list[int]) -> Iterable[Array]:
    """(T, 3) of each node kept, in the file's axes and unit."""
    places: list[Array] = []
    turns: list[Array | None] = []
    last_use = {node.parent: k for k, node in enumerate(nodes)}
    wanted = set(kept)
    for k, node in enumerate(nodes):
        channels = values[:, node.column : node.column + len(node.channels)]
        moved = np.zeros((len(values), 3))
        turn = np.broadcast_to(np.eye(3), (len(values), 3, 3))
        for name, column in zip(node.channels, channels.T, strict=True):
            kind, axis = _CHANNELS[name]
            if kind == "position":
                moved[:, axis] += column
            else:
                turn = turn @ _about(axis, np.deg2rad(column))
        has_place = _has_place(node)
        offset = moved if has_place else np.broadcast_to(node.offset, moved.shape)
        if node.parent < 0:
            places.append(offset)
            turns.append(turn)
        else:
            above = turns[node.parent]
            assert above is not None
            if has_place and _is_added(moved, node.offset):
                offset = moved + node.offset
            places.append(places[node.parent] + np.einsum("tij,tj->ti", above, offset))
            turns.append(above @ turn if k in last_use else None)
            if last_use[node.parent] == k:
                turns[node.parent] = None  # no longer needed
        if k in wanted:
            yield places[k]


def _has_place(node: _Node) -> bool:
    return any(_CHANNELS[name][0] == "position" for name in node.channels)


def _is_added(moved: Array, offset: Array) -> bool:
    """Whether positions (T, 3) of a joint below the root are added to its offset, not used in its place."""
    return bool(np.abs(moved).sum() < np.abs(moved - offset).sum())


def _about(axis: int, angle_rad: Array) -> Array:
    """(T, 3, 3) rotations about a coordinate axis."""
    turn = np.zeros((len(angle_rad), 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[:, axis, axis] = 1
    turn[:, i, i] = turn[:, j, j] = np.cos(angle_rad)
    turn[:, j, i] = np.sin(angle_rad)
    turn[:, i, j] = -turn[:, j, i]
    return turn


def _conventions(nodes: list[_Node], given: Given) -> tuple[Up, float, list[str]]:
    """Up axis and metres per unit, as given or from the resting skeleton, and notes on the choice."""
    rest = np.zeros((len(nodes), 3))
    for k, node in enumerate(nodes):
        rest[k] = node.offset + (rest[node.parent] if node.parent >= 0 else 0)
    places = joint_places([node.name for node in nodes], given.markers)
    found = {joint: rest[place].mean(axis=0) for joint, place in places.items()}
    notes = []
    up = given.up
    if up is None:
        low = [found[joint] for joint in ("right_ankle", "left_ankle") if joint in found]
        high = [found[joint] for joint in ("head", "neck", "right_shoulder", "right_hip") if joint in found]
        tall = np.abs(high[0] - low[0]) if low and high else np.array([0.0, 1.0, 0.0])
        up = "z" if tall[2] > tall[1] else "y"
        why = "from the figure at rest" if low and high else "as most files have"
        notes.append(f"The file does not say which axis is up: {up.upper()} was assumed, {why}.")
    if given.unit_m is not None:
        return up, given.unit_m, notes
    legs = []
    for side in ("right", "left"):
        if {f"{side}_knee", f"{side}_ankle"} <= found.keys():
            above = nodes[places[f"{side}_knee"][0]].parent
            hip, knee, ankle = (
                found.get(f"{side}_hip", rest[above]),
                found[f"{side}_knee"],
                found[f"{side}_ankle"],
            )
            legs.append(float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee)))
    unit_m, note = unit_of_legs(legs[0] if legs else None, _UNITS_M, "cm")
    return up, unit_m, [*notes, note]


# Writing.

_TRUNK = ("Hips", "LowerBack", "Chest")
_CM = 100.0


@dataclass
class _Bone:
    """A joint of the written skeleton; T frames."""

    name: str
    parent: int
    points: Array
    """(T, 3) its given position."""
    offset: Array
    """(3,) from its parent, at rest."""
    turn: Array
    """(T, 3, 3) its rotation in the world."""
    place: Array
    """(T, 3) its resulting position."""


def write_bvh(path: Path, motion: Motion, up: Up) -> list[str]:
    """Writes skeleton and rotations; returns what was left out, in sentences."""
    rate_hz, motion = motion.at_constant_rate()
    joints, notes = _complete_joints(motion)
    # All computations use figure axes, X left, Y up, Z forward, and convert to those of the file at the end.
    bones = _skeleton({name: from_z_up(points, "y") for name, points in joints.items()})
    off_m = {bone.name: float(np.linalg.norm(bone.place - bone.points, axis=1).max()) for bone in bones}
    worst = max(off_m, key=lambda name: off_m[name])
    if off_m[worst] > 1e-3:
        notes.append(
            f"Limbs in a BVH file have one length each: {worst} is up to"
            f" {off_m[worst] * 100:.1f} cm from its given position, the others less."
        )
    text = ["HIERARCHY", *_hierarchy_lines(bones, up), "MOTION"]
    frames = len(bones[0].points)
    text += [f"Frames: {frames}", f"Frame Time: {1 / rate_hz:.9f}"]
    columns = [_turned(bones[0].place, up) * _CM]
    for bone in bones:
        local = bone.turn if bone.parent < 0 else np.swapaxes(bones[bone.parent].turn, 1, 2) @ bone.turn
        columns.append(_angles_deg(local, bone.name, up))
    table = np.concatenate(columns, axis=1)
    with complete_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        file.writelines(line + "\n" for line in text)
        for row in table.tolist():
            file.write(" ".join(f"{x:.6f}" for x in row) + "\n")
    left_out = ["events"] * bool(motion.events) + ["joint angles as such"] * bool(motion.angles)
    return notes + [f"A BVH file cannot store {what}: left out." for what in left_out]


def _complete_joints(motion: Motion) -> tuple[dict[str, Array], list[str]]:
    """(T, 3) of each joint of the skeleton, without gaps, and what was left out."""
    found = joints_found(motion.names)
    known = {
        joint: motion.points[:, k] for joint, k in found.items() if np.isfinite(motion.points[:, k]).any()
    }
    for joint in ("pelvis", "neck"):  # in the skeleton these are between the hips and between the shoulders
        known.pop(joint, None)
    if not {"right_hip", "left_hip"} <= known.keys():
        raise FormatError(
            f"a BVH skeleton needs right_hip and left_hip; the motion has {listed(motion.names)}"
        )
    for side in ("right", "left"):
        for chain in (("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")):
            for above, below in pairwise(chain):
                if f"{side}_{above}" not in known:
                    known.pop(f"{side}_{below}", None)
    if not {"right_shoulder", "left_shoulder"} <= known.keys():
        known = {joint: points for joint, points in known.items() if joint.endswith(("hip", "knee", "ankle"))}
    there = np.logical_and.reduce([np.isfinite(points[:, 0]) for points in known.values()])
    if not there.any():
        raise FormatError("no frame has all joints: " + ", ".join(known))
    first, last = np.flatnonzero(there)[[0, -1]]
    for joint, points in known.items():
        missing = np.flatnonzero(~np.isfinite(points[first : last + 1, 0]))
        if len(missing):
            time_s = motion.times_s[first + missing[0]]
            raise FormatError(
                f"{joint} is missing in {counted(len(missing), 'frame')}, the first at {time_s:g} s, and BVH"
                " cannot store missing joints: give --fill, --walk, or another format"
            )
    notes = []
    if last - first + 1 < len(there):
        cut = len(there) - (last - first + 1)
        notes.append(f"Left out: {counted(cut, 'frame')} at the ends, where a joint is missing.")
    if motion.times_s[first] > 0:
        notes.append(f"A BVH file begins at 0 s; this motion began at {motion.times_s[first]:g} s.")
    places = {found[joint] for joint in known}
    others = [name for k, name in enumerate(motion.names) if k not in places]
    if others:
        notes.append(f"Left out, not part of the skeleton: {listed(others, 8)}.")
    return {joint: points[first : last + 1] for joint, points in known.items()}, notes


def _skeleton(joints: dict[str, Array]) -> list[_Bone]:
    """The bones, parents first, with lengths, rotations and resulting positions; figure axes, metres."""
    left, up = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    hips = (joints["right_hip"] + joints["left_hip"]) / 2
    has_chest = "right_shoulder" in joints
    chest = (joints["right_shoulder"] + joints["left_shoulder"]) / 2 if has_chest else hips + up
    pelvis_turn = _frame(joints["left_hip"] - joints["right_hip"], chest - hips)
    bones = [_Bone("Hips", -1, hips, np.zeros(3), pelvis_turn, hips)]

    def add(name: str, parent: int, points: Array, rest: Array, turn: Array) -> int:
        """A bone in a resting direction from its parent, at the median distance; returns its number."""
        above = bones[parent]
        offset = float(np.median(np.linalg.norm(points - above.points, axis=1))) * rest
        place = above.place + np.einsum("tij,j->ti", above.turn, offset)
        bones.append(_Bone(name, parent, points, offset, turn, place))
        return len(bones) - 1

    def add_limb(parent: int, rest: Array, side: str, parts: dict[str, str]) -> None:
        chain = [(side.capitalize() + name, joints.get(f"{side}_{part}")) for part, name in parts.items()]
        for (name, points), (_, below) in zip(chain, [*chain[1:], ("", None)], strict=True):
            if points is None:
                return
            turn = bones[parent].turn
            if below is not None:
                turn = _least_turn(turn, -up, below - points)
            parent, rest = add(name, parent, points, rest, turn), -up

    for side, outwards in (("right", -left), ("left", left)):
        add_limb(0, outwards, side, {"hip": "UpLeg", "knee": "Leg", "ankle": "Foot"})
    if has_chest:
        spine = add("LowerBack", 0, hips, up, _least_turn(pelvis_turn, up, chest - hips))
        chest_turn = _frame(joints["left_shoulder"] - joints["right_shoulder"], chest - hips)
        top = add("Chest", spine, chest, up, chest_turn)
        for side, outwards in (("right", -left), ("left", left)):
            add_limb(top, outwards, side, {"shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand"})
        if "head" in joints:
            turn = _least_turn(chest_turn, up, joints["head"] - chest)
            add("Head", add("Neck", top, chest, up, turn), joints["head"], up, turn)
    return bones


def _frame(leftwards: Array, upwards: Array) -> Array:
    """(T, 3, 3) rotations whose first column is exactly leftwards and whose second is nearest to upwards."""
    x = _unit(leftwards, np.array([1.0, 0, 0]))
    z = _unit(np.cross(x, upwards), np.array([0, 0, 1.0]))
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _least_turn(above: Array, rest: Array, towards: Array) -> Array:
    """(T, 3, 3) the rotation nearest to `above` that turns `rest` to the direction `towards`."""
    start = np.einsum("tij,j->ti", above, rest)
    end = _unit(towards, start)
    axis = np.cross(start, end)
    cosine = np.einsum("ti,ti->t", start, end)
    cross = np.zeros((len(axis), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, j, i], cross[:, i, j] = axis[:, k], -axis[:, k]
    opposite = cosine < -1 + 1e-9
    share = 1 / np.where(opposite, 1, 1 + cosine)
    turn = np.eye(3) + cross + cross @ cross * share[:, None, None]
    side = above[:, :, 0]
    turn[opposite] = 2 * np.einsum("ti,tj->tij", side, side)[opposite] - np.eye(3)
    product: Array = turn @ above
    return product


def _unit(vectors: Array, otherwise: Array) -> Array:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(lengths > 1e-9, vectors / np.where(lengths > 1e-9, lengths, 1), otherwise)


def _turned(points: Array, up: Up) -> Array:
    """From figure axes (Y up) to those of the file."""
    return points if up == "y" else to_z_up(points, "y")


def _order(name: str, up: Up) -> str:
    return ("YXZ" if up == "y" else "ZXY") if name in _TRUNK else ("XZY" if up == "y" else "XYZ")


def _angles_deg(turns: Array, name: str, up: Up) -> Array:
    """(T, 3) angles of the channels of a joint, in their order; without jumps of a full turn."""
    if up == "z":
        axes = to_z_up(np.eye(3), "y").T
        turns = axes @ turns @ axes.T
    a, b, c = _memo.euler_angles(turns, _order(name, up)).T
    return np.rad2deg(np.stack([np.unwrap(a), b, np.unwrap(c)], axis=-1))


def _hierarchy_lines(bones: list[_Bone], up: Up) -> Iterable[str]:
    children: dict[int, list[int]] = {}
    for k, bone in enumerate(bones):
        children.setdefault(bone.parent, []).append(k)

    def lines(k: int, depth: int) -> Iterable[str]:
        bone, tab = bones[k], "\t" * depth
        x, y, z = _turned(bone.offset * _CM, up).tolist()
        rotations = " ".join(f"{axis}rotation" for axis in _order(bone.name, up))
        channels = f"6 Xposition Yposition Zposition {rotations}" if k == 0 else f"3 {rotations}"
        yield f"{tab}{'JOINT' if k else 'ROOT'} {bone.name}"
        yield f"{tab}{{"
        yield f"{tab}\tOFFSET {x + 0.0:.6f} {y + 0.0:.6f} {z + 0.0:.6f}"
        yield f"{tab}\tCHANNELS {channels}"
        for child in children.get(k, []):
            yield from lines(child, depth + 1)
        if k not in children:
            yield from (
                f"{tab}\tEnd Site",
                f"{tab}\t{{",
                f"{tab}\t\tOFFSET 0.000000 0.000000 0.000000",
                f"{tab}\t}}",
            )
        yield f"{tab}}}"

    return lines(0, 0)
