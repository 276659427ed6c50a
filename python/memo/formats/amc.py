"""AMC with its ASF (Acclaim): rotations of bones over time, and the skeleton that they move, as text.

The skeleton of `01_05.amc` is `01_05.asf` or `01.asf` beside it, or the only `.asf` file in its folder.
Reading is forward kinematics: a bone whose own axes are turned by C and which the frame turns by M about them
has

    R_world(bone) = R_world(parent) C M C^-1,   end(bone) = end(parent) + R_world(bone) length direction

Rotations are about fixed axes in the order written, `rx ry rz` first about x. Points are the ends of the
bones: those of the CMU recordings by memo's names of joints (`lfemur` ends at `left_knee`), others by the
bone's.

One unit of length is an inch divided by the `length` of `:units` (0.45 at CMU: 0.05644 m). The up axis is Y
unless another is given. The files hold no frame rate: 120 per second (CMU) is assumed and reported.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from memo.formats.motion import MAX_POINTS, FormatError, Motion, to_z_up
from memo.formats.reading import Given, chosen_up
from memo.formats.text import number, read_lines
from memo.wording import counted

__all__ = ["read_amc"]

Array = npt.NDArray[np.float64]

_INCH_M = 0.0254
_USUAL_RATE_HZ = 120.0
_MOST_BONES = 1000
_AXES = "xyz"
_ENDS = {
    "hipjoint": "hip",
    "femur": "knee",
    "tibia": "ankle",
    "clavicle": "shoulder",
    "humerus": "elbow",
    "radius": "wrist",
}
_JOINTS = {"head": "head"} | {
    f"{side[0]}{bone}": f"{side}_{joint}" for side in ("right", "left") for bone, joint in _ENDS.items()
}


@dataclass
class _Bone:
    name: str
    parent: int = -1
    direction: Array = field(default_factory=lambda: np.zeros(3))
    length: float = 0.0
    axes: Array = field(default_factory=lambda: np.eye(3))
    """C, the rotation from its own axes to those of the file at rest."""
    channels: tuple[str, ...] = ()
    """`tx` ... `rz` of a frame, in their order."""


@dataclass
class _Skeleton:
    bones: list[_Bone]
    """Parents first; the root, whose end is its position, comes first of all."""
    unit_m: float
    degrees: bool
    position: Array


def read_amc(path: Path, given: Given) -> Motion:
    """Reads the positions of the ends of the bones."""
    skeleton_path = _skeleton_of(path)
    try:
        skeleton = _read_skeleton(read_lines(skeleton_path))
    except FormatError as error:
        raise FormatError(f"its skeleton {skeleton_path.name}: {error}") from None
    values, degrees = _frames(read_lines(path), skeleton)
    frames = len(values[0])
    kept = [k for k, bone in enumerate(skeleton.bones) if k == 0 or bone.length > 0]
    if frames * len(kept) > MAX_POINTS:
        raise FormatError(
            f"{counted(frames, 'frame')} of {counted(len(kept), 'bone')} are more than memo reads"
        )
    with np.errstate(over="ignore", invalid="ignore"):
        ends = _ends(skeleton, values, degrees, frames)
        unit_m = skeleton.unit_m if given.unit_m is None else given.unit_m
        points = unit_m * np.stack([ends[k] for k in kept], axis=1)
    if not np.isfinite(points).all():
        raise FormatError("lengths or positions so large that they overflow")
    up, notes = chosen_up(given, None, "y", "most files have it")
    rate_hz = given.rate_hz
    if rate_hz is None:
        rate_hz = _USUAL_RATE_HZ
        notes = (
            *notes,
            f"An AMC file has no frame rate: {rate_hz:g} Hz was assumed, as of CMU's recordings.",
        )
    return Motion(
        tuple(_JOINTS.get(skeleton.bones[k].name, skeleton.bones[k].name) for k in kept),
        np.arange(frames, dtype=np.float64) / rate_hz,
        to_z_up(points, up),
        metadata={"format": "amc", "up": up, "unit_m": unit_m, "rate_hz": rate_hz},
        notes=(*notes, f"Skeleton: {skeleton_path.name}."),
    )


def _skeleton_of(path: Path) -> Path:
    folder = sorted(entry for entry in path.parent.iterdir() if entry.suffix.lower() == ".asf")
    for stem in (path.stem, path.stem.rsplit("_", 1)[0]):
        for entry in folder:
            if entry.stem.lower() == stem.lower():
                return entry
    if len(folder) != 1:
        beside = f"{counted(len(folder), '.asf file')} beside it"
        raise FormatError(f"an AMC file needs its skeleton {path.stem}.asf in the same folder: {beside}")
    return folder[0]


# The skeleton.


def _read_skeleton(lines: list[str]) -> _Skeleton:
    sections = _sections(lines)
    units = {words[0].lower(): words[1:] for _, words in sections.get("units", []) if words}
    per_inch = number(units.get("length", ["1"])[0], ":units length")
    if not 1e-6 < per_inch < 1e6:
        raise FormatError(f":units length {per_inch:g}")
    degrees = units.get("angle", ["deg"])[0].lower().startswith("deg")
    root, position = _root(sections.get("root", []), degrees)
    bones = {bone.name: bone for bone in _bones(sections.get("bonedata", []), degrees)}
    if not bones or "root" in bones:
        raise FormatError("no bones in :bonedata" if not bones else "a bone is called root")
    ordered = [root]
    places = {"root": 0}
    for line, words in sections.get("hierarchy", []):
        if words in (["begin"], ["end"]):
            continue
        parent, *children = words
        if parent not in places:
            raise FormatError(f"line {line}: {parent[:40]!r} has no parent yet")
        for child in children:
            if child not in bones or child in places:
                raise FormatError(f"line {line}: {child[:40]!r} is no bone, or has a parent already")
            places[child] = len(ordered)
            bones[child].parent = places[parent]
            ordered.append(bones[child])
    missing = sorted(bones.keys() - places.keys())
    if missing:
        raise FormatError(f"bone {missing[0][:40]!r} is not in :hierarchy")
    return _Skeleton(ordered, _INCH_M / per_inch, degrees, position)


def _sections(lines: list[str]) -> dict[str, list[tuple[int, list[str]]]]:
    """The lines below each `:name`, as numbers of lines and words."""
    found: dict[str, list[tuple[int, list[str]]]] = {}
    section: list[tuple[int, list[str]]] = []
    for index, line in enumerate(lines, 1):
        words = line.split("#")[0].split()
        if words and words[0].startswith(":"):
            section = found.setdefault(words[0][1:].lower(), [])
        elif words:
            section.append((index, words))
    if "bonedata" not in found or "hierarchy" not in found:
        raise FormatError("not an ASF file: it has no :bonedata and :hierarchy")
    return found


def _root(lines: list[tuple[int, list[str]]], degrees: bool) -> tuple[_Bone, Array]:
    root, position, orientation, order = _Bone("root"), np.zeros(3), np.zeros(3), "XYZ"
    for line, (key, *cells) in lines:
        if key.lower() == "order":
            root.channels = _channels(cells, line)
        elif key.lower() == "axis":
            order = _order(cells, line)
        elif key.lower() == "position":
            position = _three(cells, line)
        elif key.lower() == "orientation":
            orientation = _three(cells, line)
    root.axes = _turn(_radians(orientation, degrees)[:, None], order)[0]
    return root, position


def _bones(lines: list[tuple[int, list[str]]], degrees: bool) -> list[_Bone]:
    bones: list[_Bone] = []
    for line, (key, *cells) in lines:
        key = key.lower()
        if key == "begin":
            if len(bones) >= _MOST_BONES:
                raise FormatError(f"line {line}: more than {_MOST_BONES} bones")
            bones.append(_Bone(""))
        elif not bones:
            raise FormatError(f"line {line}: {key[:40]!r} outside a bone")
        elif key == "name":
            bones[-1].name = cells[0] if cells else ""
        elif key == "direction":
            bones[-1].direction = _three(cells, line)
        elif key == "length":
            bones[-1].length = number(cells[0] if cells else "", f"line {line}, length")
        elif key == "axis":
            bones[-1].axes = _turn(
                _radians(_three(cells[:3], line), degrees)[:, None], _order(cells[3:], line)
            )[0]
        elif key == "dof":
            bones[-1].channels = _channels(cells, line)
    for bone in bones:
        size = float(np.linalg.norm(bone.direction))
        if not bone.name or not 0 <= bone.length < 1e9 or (bone.length > 0 and not 1e-9 < size < 1e9):
            raise FormatError(f"bone {bone.name[:40]!r} has no name, no direction or no length")
        if size > 0:
            bone.direction = bone.direction / size
    if len({bone.name for bone in bones}) < len(bones):
        raise FormatError("two bones have the same name")
    return bones


def _three(cells: list[str], line: int) -> Array:
    values = np.array([number(cell, f"line {line}") for cell in cells])
    if len(values) != 3 or not np.isfinite(values).all() or np.abs(values).max() > 1e9:
        raise FormatError(f"line {line}: wanted three numbers, got {' '.join(cells)[:60]!r}")
    return values


def _channels(cells: list[str], line: int) -> tuple[str, ...]:
    channels = tuple(cell.lower() for cell in cells)
    known = {kind + axis for kind in "tr" for axis in _AXES} | {"l"}
    if len(set(channels)) < len(channels) or not known.issuperset(channels):
        raise FormatError(f"line {line}: wanted some of tx ty tz rx ry rz, got {' '.join(cells)[:60]!r}")
    return channels


def _order(cells: list[str], line: int) -> str:
    order = cells[0].lower() if cells else "xyz"
    if sorted(order) != sorted(_AXES):
        raise FormatError(f"line {line}: wanted an order of axes such as XYZ, got {order[:40]!r}")
    return order


def _radians(angles: Array, degrees: bool) -> Array:
    return np.deg2rad(angles) if degrees else angles


# The frames.


def _frames(lines: list[str], skeleton: _Skeleton) -> tuple[list[Array], bool]:
    """(T, channels) of each bone, and whether angles are degrees."""
    places = {bone.name: k for k, bone in enumerate(skeleton.bones)}
    frames: list[list[list[float] | None]] = []
    degrees = skeleton.degrees
    for index, line in enumerate(lines, 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        if words[0].startswith(":"):
            if words[0].lower() in (":degrees", ":radians"):
                degrees = words[0].lower() == ":degrees"
        elif len(words) == 1 and words[0].isdigit():
            frames.append([None] * len(places))
        elif words[0] in places and frames:
            channels = skeleton.bones[places[words[0]]].channels
            cells = [number(cell, f"line {index}") for cell in words[1:]]
            if len(cells) != len(channels) or not all(abs(cell) < 1e12 for cell in cells):
                wanted = f"the skeleton has {counted(len(channels), 'channel')} of {words[0]}"
                raise FormatError(f"line {index}: {counted(len(cells), 'usable number')}, {wanted}")
            frames[-1][places[words[0]]] = cells
        else:
            raise FormatError(f"line {index}: {words[0][:40]!r} is no bone of the skeleton")
    if not frames:
        raise FormatError("no frames")
    values = []
    for k, bone in enumerate(skeleton.bones):
        own = [frame[k] for frame in frames]
        missing = next((number for number, cells in enumerate(own, 1) if cells is None), None)
        if bone.channels and missing is not None:
            raise FormatError(f"frame {missing} has no line of {bone.name}")
        values.append(np.array([cells or [] for cells in own], dtype=np.float64).reshape(len(frames), -1))
    return values, degrees


def _ends(skeleton: _Skeleton, values: list[Array], degrees: bool, frames: int) -> list[Array]:
    """(T, 3) end of each bone in the file's axes and unit; that of the root is its position."""
    ends: list[Array] = []
    turns: list[Array] = []
    for bone, channels in zip(skeleton.bones, values, strict=True):
        turn, moved = np.broadcast_to(np.eye(3), (frames, 3, 3)), np.zeros((frames, 3))
        for channel, column in zip(bone.channels, channels.T, strict=True):
            if channel[0] == "t":
                moved[:, _AXES.index(channel[1])] += column
            elif channel[0] == "r":
                turn = _turn(_radians(column, degrees)[None], channel[1]) @ turn
        local = bone.axes @ turn @ bone.axes.T
        if bone.parent < 0:
            ends.append(skeleton.position + moved)
            turns.append(turn @ bone.axes)
        else:
            turns.append(turns[bone.parent] @ local)
            ends.append(ends[bone.parent] + turns[-1] @ (bone.length * bone.direction))
    return ends


def _turn(angles_rad: Array, order: str) -> Array:
    """(T, 3, 3) rotations by angles (axes, T) about fixed axes in an order; the angle about x comes first."""
    turn = np.broadcast_to(np.eye(3), (angles_rad.shape[1], 3, 3))
    for axis in order.lower():
        k = _AXES.index(axis)
        angle = angles_rad[k if len(order) > 1 else 0]
        i, j = (k + 1) % 3, (k + 2) % 3
        own = np.zeros((len(angle), 3, 3))
        own[:, k, k] = 1.0
        own[:, i, i] = own[:, j, j] = np.cos(angle)
        own[:, j, i] = np.sin(angle)
        own[:, i, j] = -own[:, j, i]
        turn = own @ turn
    return turn
