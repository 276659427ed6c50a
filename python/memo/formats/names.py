"""Maps the points of a file to the twelve joints of memo, by the names in use.

A file is read by one naming scheme, the one in which most of the joints are found, since the same word
means different joints in different schemes: `RightShoulder` is the shoulder in a list of keypoints, and
the inner end of the collar bone in a BVH file, where the shoulder is called `RightArm`. Plug-in Gait's
skin markers are not joints and are not used as joints; its virtual points are (`RFEP`, the proximal end of
the femur, is the hip).

What is before the last colon of a name is its subject ("Anna:RKNE"). The joints of one body are those of one
subject; files with the joints of several are refused where one body is wanted.
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.files import JOINTS
from memo.formats.motion import FormatError, Motion, Up

__all__ = [
    "NAMINGS",
    "SHORT",
    "joint_places",
    "joint_points",
    "joints_found",
    "mapped_points",
    "read_marker_map",
    "renamed",
    "standing_up",
]

_PARTS = ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")

SHORT = {
    f"{side}_{part}": side[0].upper() + short
    for side in ("right", "left")
    for part, short in zip(_PARTS, ("SH", "EL", "WR", "HP", "KN", "AN"), strict=True)
}
"""memo's short name of each joint, as in point-light displays."""

_POSE2SIM = {
    f"{side}_{part}": side[0].upper() + part.capitalize() for side in ("right", "left") for part in _PARTS
} | {"head": "Head", "neck": "Neck", "pelvis": "Hip"}
"""The markers of Pose2Sim's OpenSim models (Markers_Halpe26.xml) at memo's joints."""

NAMINGS = ("memo", "pose2sim", "gait2392")
"""Names in which motions can be written: memo's own joints, and those of two families of OpenSim models."""

_KEY = re.compile(r"^[ \t]*[\"']?([\w-]+)[\"']?[ \t]*=", re.MULTILINE)  # of a line of TOML

_MIDDLE = {
    "head": ("head", "headtop", "nose"),
    "neck": ("neck", "c7"),
    "pelvis": ("pelvis", "hips", "midhip", "root"),
}


def _sided(**parts: str) -> dict[str, tuple[str, ...]]:
    """Names of a scheme with `{}` for the side; letters, lower case."""
    table = {}
    for part, names in parts.items():
        for side in ("right", "left"):
            spelled = []
            for name in names.split():
                if "{s}" in name:
                    spelled.append(name.format(s=side[0]))
                else:
                    spelled += [side + name, side[0] + name, name + side, name + side[0]]
            table[f"{side}_{part}"] = tuple(spelled)
    return table


_SCHEMES: tuple[dict[str, tuple[str, ...]], ...] = (
    # Keypoints and joint centres: right_shoulder, RShoulder, R_Shoulder, shoulder_r, RSH.
    _sided(
        shoulder="shoulder {s}sh {s}sjc shoulderjoint",
        elbow="elbow {s}el {s}ejc",
        wrist="wrist {s}wr {s}wjc",
        hip="hip {s}hp {s}hjc hipjoint",
        knee="knee {s}kn {s}kjc",
        ankle="ankle {s}an {s}ajc",
    )
    | _MIDDLE,
    # Motion capture skeletons: a joint has the name of the bone that begins there.
    _sided(
        shoulder="arm upperarm uparm",
        elbow="forearm lowerarm loarm",
        wrist="hand wrist",
        hip="upleg upperleg thigh",
        knee="leg lowerleg lowleg shin calf",
        ankle="foot ankle",
    )
    | {"head": ("head",), "neck": ("neck", "neck1"), "pelvis": ("hips", "hip", "pelvis", "root")},
    # Plug-in Gait's virtual points: O is the distal end of a segment, P the proximal one.
    _sided(shoulder="{s}clo", elbow="{s}huo", wrist="{s}rao", hip="{s}fep", knee="{s}feo", ankle="{s}tio")
    | {"head": ("hedo",), "neck": ("trxo",), "pelvis": ("pelo",)},
)


def joints_found(names: Sequence[str]) -> dict[str, int]:
    """Indices of memo's joints among the names: the twelve, and head, neck and pelvis if they exist.

    Raises `FormatError` if several subjects have joints.
    """
    found = _joints_of_subjects(names)
    if len(found) > 1:
        raise FormatError(
            f"joints of {len(found)} subjects ({listed([*found])}), and those of one are wanted"
        )
    return next(iter(found.values()))


def _joints_of_subjects(names: Sequence[str]) -> dict[str, dict[str, int]]:
    """The joints of each subject that has any of the twelve, together with the points without a subject.

    If no subject has any, all points are of one whose name is empty.
    """
    subjects = dict.fromkeys(subject for name in names if (subject := _subject(name)))
    bodies = [subject for subject in subjects if not _joints_among(names, subject).keys().isdisjoint(JOINTS)]
    found = {subject: _joints_among(names, subject, "") for subject in bodies}
    return found or {"": _joints_among(names, *subjects, "")}


def _joints_among(names: Sequence[str], *subjects: str) -> dict[str, int]:
    """The joints among the points of these subjects, in the scheme in which most are found."""
    plain: dict[str, int] = {}
    for index, name in enumerate(names):
        if _subject(name) in subjects:
            plain.setdefault(_letters(name), index)
    found = [
        {joint: plain[spelled[0]] for joint, names in scheme.items() if (spelled := _those(names, plain))}
        for scheme in _SCHEMES
    ]
    return max(found, key=lambda joints: sum(joint in joints for joint in JOINTS))


def joint_places(
    names: Sequence[str], markers: Mapping[str, Sequence[str]] | None = None
) -> dict[str, list[int]]:
    """Indices of the points at whose mean each joint is: as in `markers`, and else by its usual names.

    Of several subjects the one with the most joints is taken.
    """
    most = max(_joints_of_subjects(names).values(), key=len)
    usual = {joint: [index] for joint, index in most.items()}
    place = _finder(names)
    found = {joint: [place(name) for name in wanted] for joint, wanted in (markers or {}).items()}
    known = {joint: [k for k in places if k is not None] for joint, places in found.items()}
    return usual | {joint: places for joint, places in known.items() if len(places) == len(found[joint])}


def standing_up(
    names: Sequence[str],
    points: npt.NDArray[np.float64],
    markers: Mapping[str, Sequence[str]] | None = None,
) -> Up | None:
    """The axis along which shoulders and head, or else the hips, are above the ankles; None if no figure is
    upright.

    `points` (T, K, 3) in the axes of a file. Upright is twice as high as wide, in the median frame.
    """
    found = joint_places(names, markers)

    def those(*joints: str) -> list[int]:
        return [index for joint in joints for index in found.get(joint, ())]

    low = those("right_ankle", "left_ankle")
    high = those("right_shoulder", "left_shoulder", "neck", "head") or those("right_hip", "left_hip")
    if not low or not high:
        return None
    rise = points[:, high].mean(axis=1) - points[:, low].mean(axis=1)
    rise = rise[np.isfinite(rise).all(axis=1)]
    if not len(rise):
        return None
    x, y, z = np.median(rise, axis=0)
    if y > 2 * max(abs(x), abs(z)):
        return "y"
    return "z" if z > 2 * max(abs(x), abs(y)) else None


def joint_points(motion: Motion) -> Motion:
    """The motion of only the twelve joints, in memo's order, and of the head if it is known.

    They have memo's short names (`RSH`, `HEAD`), by which point-light displays identify limbs.
    """
    found = joints_found(motion.names)
    absent = [joint for joint in JOINTS if joint not in found]
    if absent:
        raise FormatError(f"no points for {', '.join(absent)}; the file has {listed(motion.names)}")
    kept = [*JOINTS, *(("head",) if "head" in found else ())]
    names = tuple(SHORT.get(joint, joint.upper()) for joint in kept)
    return replace(motion, names=names, points=motion.points[:, [found[joint] for joint in kept]])


def renamed(motion: Motion, naming: str) -> tuple[Motion, list[str]]:
    """The motion with its joints named as in a naming of `NAMINGS`, and what kept its name, in sentences."""
    if naming == "gait2392":
        raise FormatError(
            "gait2392 has markers on the skin, and memo's joints are joint centres: write joint angles"
            " (.mot) for this model, or joints for Pose2Sim's models (--names pose2sim)"
        )
    if naming not in NAMINGS:
        raise FormatError(f"the names must be one of {', '.join(NAMINGS)}, got {naming!r}")
    spelt = {index: joint for joint, index in joints_found(motion.names).items()}
    known = {index: _POSE2SIM[joint] if naming == "pose2sim" else joint for index, joint in spelt.items()}
    names = tuple(known.get(index, name) for index, name in enumerate(motion.names))
    others = [name for index, name in enumerate(motion.names) if index not in known]
    notes = [f"Not joints of memo, so they keep their names: {listed(others)}."] if others else []
    return replace(motion, names=names), notes


def read_marker_map(path: Path) -> dict[str, tuple[str, ...]]:
    """The markers of each joint from a TOML file: `right_hip = "RASI"`, or a list whose mean is the joint.

    The joints have memo's names. Raises `FormatError` for joints that memo does not know.
    """
    try:
        text = path.read_text("utf-8-sig")
    except OSError as error:
        raise FormatError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: not TOML: {error}") from None
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        keys = Counter(_KEY.findall(text))
        twice = [joint for joint, count in keys.items() if count > 1]
        if twice:
            raise FormatError(f"{path}: {_two_entries(twice)}") from None
        raise FormatError(f"{path}: not TOML: {error}") from None
    markers = {}
    for joint, value in table.items():
        names = [value] if isinstance(value, str) else value
        if not (isinstance(names, list) and names and all(isinstance(name, str) for name in names)):
            raise FormatError(
                f"{path}: {joint}: wanted the name of a marker or a list of names, got {value!r}"
            )
        markers[joint] = tuple(names)
    return _joints_of(markers, path)


def _joints_of(markers: Mapping[str, tuple[str, ...]], path: Path) -> dict[str, tuple[str, ...]]:
    """The same with memo's names of the joints."""
    try:
        names = {joint: _memo.joint_name(joint) for joint in markers}
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from None
    spelt = {joint: "head" if name == "head_top" else name for joint, name in names.items()}
    known = ", ".join([*JOINTS, "head"])
    if not markers:
        raise FormatError(
            f'{path}: names no joint; wanted lines such as right_hip = "RASI" for any of {known}'
        )
    unknown = [joint for joint, name in spelt.items() if name is None]
    if unknown:
        raise FormatError(f"{path}: joints of memo wanted ({known}), got {', '.join(unknown)}")
    twice = [str(joint) for joint, count in Counter(spelt.values()).items() if count > 1]
    if twice:
        raise FormatError(f"{path}: {_two_entries(twice)}")
    return {str(spelt[joint]): wanted for joint, wanted in markers.items()}


def _two_entries(joints: Sequence[str]) -> str:
    return f'{listed(joints)} has two entries; list the markers of a joint in one: ["A", "B"]'


def mapped_points(
    names: Sequence[str], points: npt.NDArray[np.float64], markers: Mapping[str, Sequence[str]]
) -> tuple[list[str], npt.NDArray[np.float64]]:
    """Names of joints and their points (T, K, D), each the mean of its markers, NaN where one is missing.

    The joints have memo's short names. Raises `FormatError` for markers that do not exist; a marker may be
    named without its subject ("RKNE" for "Anna:RKNE") and in any case, if only one subject has the markers.
    """
    place = _finder(names)
    _check_one_subject(names, [name for wanted in markers.values() for name in wanted])
    absent = [
        f"{name} ({joint})" for joint, wanted in markers.items() for name in wanted if place(name) is None
    ]
    if absent:
        raise FormatError(f"no points for {', '.join(absent)}; the file has {listed(names)}")
    found = joint_places(names, markers)
    means = [points[:, found[joint]].mean(axis=1) for joint in markers]
    return [SHORT.get(joint, joint.upper()) for joint in markers], np.stack(means, axis=1)


def _finder(names: Sequence[str]) -> Callable[[str], int | None]:
    """A function that gives the index of a name: exactly, or else by its letters.

    If the points have subjects, a name with a subject is only that subject's.
    """
    exact = {name: index for index, name in reversed(list(enumerate(names)))}
    plain = {_letters(name): index for index, name in reversed(list(enumerate(names)))}
    own = {(_subject(name).lower(), _letters(name)): index for name, index in exact.items()}
    have_subjects = any(map(_subject, names))

    def place(name: str) -> int | None:
        if name in exact:
            return exact[name]
        if _subject(name) and have_subjects:
            return own.get((_subject(name).lower(), _letters(name)))
        return plain.get(_letters(name))

    return place


def _check_one_subject(names: Sequence[str], wanted: Sequence[str]) -> None:
    """Refuses markers named without their subject if several subjects have markers of these names."""
    place = _finder(names)
    implied = [name for name in wanted if name not in names and not _subject(name)]
    letters = {_letters(name) for name in implied}
    places = {place(name) for name in wanted if name not in implied}
    subjects = dict.fromkeys(
        subject
        for index, name in enumerate(names)
        if (subject := _subject(name)) and (index in places or _letters(name) in letters)
    )
    if implied and len(subjects) > 1:
        raise FormatError(
            f"markers of {len(subjects)} subjects ({listed([*subjects])}): name those of one, such as "
            f'"{next(iter(subjects))}:{implied[0]}"'
        )


def listed(names: Sequence[str], most: int = 40) -> str:
    """Names for a message, limited in number."""
    shown = ", ".join(names[:most]) or "none"
    return shown + (f" and {len(names) - most} more" if len(names) > most else "")


def _subject(name: str) -> str:
    """What is before the last colon of a name: its subject; empty without one."""
    return name.rpartition(":")[0].strip()


def _letters(name: str) -> str:
    """A name in lower-case letters and digits, without its subject's ("Anna:RKNE") or FreeMoCap's `body_`."""
    return re.sub(r"[^a-z0-9]", "", name.rpartition(":")[2].lower().removeprefix("body_"))


def _those(spelled: Sequence[str], plain: dict[str, int]) -> list[str]:
    """The spellings that exist."""
    return [name for name in spelled if name in plain]
