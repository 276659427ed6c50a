"""MOT and STO (OpenSim, SIMM): joint angles over time, as text.

A header of `key=value` lines up to `endheader`, a row of labels that begins with `time`, one row per
instant; `nColumns` counts the time. Other lines of the header say what each angle is between, as far as that
is known. Both endings have the same format here. The older header of SIMM (`datacolumns`, `datarows`) is read
too.

Angles have the names of OpenSim's gait models (`hip_flexion_r`, `knee_angle_r`) and are written in degrees.
Flexion is positive as in the model of Rajagopal 2016. For gait2392 and gait2354 (`GAIT2392`) the knee has the
other sign, and arms are left out, since these models have none. If both hips, a knee and the flexion of that
hip are known, the position of the pelvis is written too, Y up unless another axis is requested; the header
names it. The pelvis of OpenSim has X forward, Y up, Z to the right, and

    R = R_z(pelvis_tilt) R_x(pelvis_list) R_y(pelvis_rotation).

Its Z is the line from the left hip to the right one, and it is tilted such that the thigh, at its
`hip_flexion`, points to the knee. So it is the trunk for `memo track`, whose trunk is upright, and for `memo
posture`, whose hip angles are against the trunk. `pelvis_tx`, `pelvis_ty`, `pelvis_tz` are its origin, midway
between the anterior superior iliac spines, as far from the hips as in the unscaled model. Instants with a
missing value are left out, since OpenSim stops reading there.

In reading, a triple `NAME_tx`, `NAME_ty`, `NAME_tz` is a point; one or two of them, as in planar models, are
left out. Columns of forces, moments and the like are left out, as are columns of a states file that are not
the value of a coordinate; `/jointset/hip_r/hip_flexion_r/value` is `hip_flexion_r`. All other columns are
assumed to be angles, as the format does not tell. A knee that bends further backwards than knees can has the
sign of gait2392, and is reversed. Tables of vectors (`DataType=Vec3`) are not read.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from memo import _memo
from memo.formats.motion import FormatError, Motion, Up, from_z_up, to_z_up
from memo.formats.names import joints_found, listed
from memo.formats.reading import Given, chosen_up
from memo.formats.text import numbers, read_lines, whole_number
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = ["read_mot", "write_mot"]

OPENSIM = {
    f"{side}_{part}": f"{name}_{side[0]}"
    for side in ("right", "left")
    for part, name in (
        ("hip", "hip_flexion"),
        ("hip_adduction", "hip_adduction"),
        ("knee", "knee_angle"),
        ("ankle", "ankle_angle"),
        ("shoulder", "arm_flex"),
        ("shoulder_adduction", "arm_add"),
        ("elbow", "elbow_flex"),
    )
}
"""OpenSim's coordinate for each angle of `track.csv` and `postures.csv`."""

PELVIS = ("pelvis_tilt", "pelvis_list", "pelvis_rotation")


class Model(NamedTuple):
    """What differs between OpenSim's gait models in a file of coordinates."""

    hips_m: tuple[float, float, float]
    """The point between the hips in the axes of the pelvis, of the unscaled model."""
    knee_sign: float
    """1 if flexion of the knee is positive, else -1."""
    has_arms: bool


RAJAGOPAL = Model((-0.056276, -0.07849, 0.0), 1.0, has_arms=True)
GAIT2392 = Model((-0.0707, -0.0661, 0.0), -1.0, has_arms=False)

_PLUG_IN_GAIT = {
    f"{side.upper()}{part}Angles_{axis}": f"{name}_{side}"
    for side in "rl"
    for part, axis, name in (
        ("Hip", "y", "hip_adduction"),
        ("Hip", "z", "hip_rotation"),
    )
}
"""OpenSim's coordinate for angles of a C3D file with the same meaning and sign."""

_OURS = {name: joint for joint, name in OPENSIM.items()}
_NO_ANGLES = ("/", "force", "moment", "torque", "ground_", "activation", "power", "emg")
_TRANSLATIONS = ("_tx", "_ty", "_tz")
_OF_ARMS = ("shoulder", "elbow")
_MOST_HEADER_LINES = 1000
_BACKWARDS_DEG = 30.0  # farther than any knee bends backwards


def read_mot(path: Path, given: Given) -> Motion:
    """Reads the angles, in degrees, and the points given by translations."""
    given.check_used()
    lines = read_lines(path)
    header, start = _header(lines)
    if header.get("datatype", "double") != "double":
        raise FormatError(f"field DataType: tables of {header['datatype']} are not read, only of double")
    while start < len(lines) and not lines[start].strip():
        start += 1
    labels = lines[start].split() if start < len(lines) else []
    if not labels or labels[0].lower() != "time":
        raise FormatError(f"line {start + 1}: wanted a row of labels that begins with time")
    labels = ["time", *map(_coordinate, labels[1:])]
    if len(set(labels)) < len(labels):
        repeated = next(name for k, name in enumerate(labels) if name in labels[:k])
        raise FormatError(f"line {start + 1}: column {repeated} occurs twice")
    _check_count(header, ("ncolumns", "datacolumns"), len(labels), "labels")
    table = _rows(lines, start + 1, labels)
    _check_count(header, ("nrows", "datarows"), len(table), "rows of numbers")
    column = {name: table[:, k] for k, name in enumerate(labels)}
    up, up_note = chosen_up(given, header.get("up"), "y", "OpenSim's files have")
    names, points, up_note = _points(column, up, up_note)
    in_degrees = header.get("indegrees")
    if in_degrees not in ("yes", "no", None):
        raise FormatError(f"field inDegrees: {in_degrees!r}, wanted yes or no")
    angles, others, partial = {}, [], []
    for name in labels[1:]:
        if name.endswith(_TRANSLATIONS):
            partial += [name] * (name[:-3] not in names)
            continue
        if any(word in name.lower() for word in _NO_ANGLES):
            others.append(name)
            continue
        values = column[name]
        angles[_OURS.get(name, name)] = np.rad2deg(values) if in_degrees == "no" else values
    notes = [*up_note]
    turned = [name for name in ("right_knee", "left_knee") if name in angles and _is_turned(angles[name])]
    for name in turned:
        angles[name] = -angles[name]
    if turned:
        notes.append("Knees bend towards negative angles, as in gait2392: their sign was reversed.")
    if in_degrees is None:
        notes.append("The file does not say whether angles are in degrees: degrees were assumed.")
    if partial:
        notes.append(f"Left out, positions without all of x, y and z: {listed(partial)}.")
    if others:
        notes.append(f"Left out, not angles: {counted(len(others), 'column')}, the first {others[0]}.")
    if not names and not angles:
        raise FormatError(f"line {start + 1}: no column of an angle or a position")
    metadata = {"format": "mot", "up": up}
    return Motion(tuple(names), column["time"], points, (), angles, metadata, tuple(notes))


def write_mot(path: Path, motion: Motion, up: Up, model: Model = RAJAGOPAL) -> list[str]:
    """Writes the angles and the position of the pelvis; returns what was left out, in sentences."""
    motion, armless = _of_model(motion, model)
    if not motion.angles:
        raise FormatError("a MOT or STO file holds joint angles, and there are none")
    columns = {"time": motion.times_s}
    pelvis_angles, origin = _pelvis(motion, model)
    if up == "y":
        columns |= pelvis_angles
    if origin is not None:
        turned = from_z_up(origin, up)
        columns |= {f"pelvis_t{axis}": turned[:, k] for k, axis in enumerate("xyz")}
    names = OPENSIM | _PLUG_IN_GAIT
    columns |= {names.get(name, name): values for name, values in motion.angles.items()}
    # A joint that is hardly seen must not cost the others their instants.
    rare = {name: v for name, v in columns.items() if 2 * np.isfinite(v).sum() < len(v)}
    columns = {name: values for name, values in columns.items() if name not in rare}
    rare = {name: values for name, values in rare.items() if np.isfinite(values).any()}
    for name in columns:
        if not name.isprintable() or " " in name:
            raise FormatError(f"angle {name!r}: the labels of a MOT file have no white space")
    table = np.column_stack(list(columns.values()))
    known = np.flatnonzero(np.isfinite(table).all(axis=1))
    if len(columns) == 1 or not len(known):
        raise FormatError("no instant at which all angles are known")
    gaps = len(table) - len(known)
    table = table[known]
    head = [
        " ".join(["motion", *path.stem.split()]),  # a title that is no key, whatever the file's name
        "version=1",
        f"nRows={len(table)}",
        f"nColumns={len(columns)}",
        "inDegrees=yes",
        f"up={up.upper()}",
        *_references(motion, columns),
        "endheader",
        "\t".join(columns),
    ]
    with complete_file(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as file:
        file.writelines(line + "\n" for line in head)
        for row in table.tolist():
            file.write("\t".join(f"{x:.7f}" for x in row) + "\n")
    notes = (
        [f"Left out: {counted(gaps, 'instant')} at which an angle or the pelvis is missing."] if gaps else []
    )
    if rare:
        notes.append(f"Left out, missing at most instants: {', '.join(rare)}.")
    if pelvis_angles and up != "y":
        notes.append("OpenSim's pelvis angles are those of a world with Y up: left out.")
    if origin is None and motion.names:
        notes.append("The pelvis position needs both hips, a knee and the flexion of that hip: left out.")
    left_out = ["events"] * bool(motion.events)
    points = "points except the pelvis" if "pelvis_tx" in columns else "points"
    left_out += [points] * (len(motion.names) > 1)
    if armless:
        notes.append(f"The model has no arms: {', '.join(armless)} left out.")
    return notes + [f"A MOT or STO file cannot store {what}: left out." for what in left_out]


def _references(motion: Motion, columns: Collection[str]) -> list[str]:
    """Lines of text, as OpenSim's own files have them in the header: what the angles are between."""
    known = motion.metadata.get("references", {})
    named = {OPENSIM[name]: said for name, said in known.items() if OPENSIM.get(name) in columns}
    return [f"{name}: {said}" for name, said in named.items()]


def _of_model(motion: Motion, model: Model) -> tuple[Motion, list[str]]:
    """The motion with the model's signs, and the angles that the model does not have."""
    armless = [] if model.has_arms else [a for a in motion.angles if a.partition("_")[2].startswith(_OF_ARMS)]
    sign = {f"{side}_knee": model.knee_sign for side in ("right", "left")}
    angles = {
        name: sign.get(name, 1.0) * values for name, values in motion.angles.items() if name not in armless
    }
    return (replace(motion, angles=angles) if angles or motion.names else motion), armless


def _header(lines: list[str]) -> tuple[dict[str, str], int]:
    """Keys (lower case) with their values, and the index of the line after `endheader`."""
    head = [line.strip() for line in lines[:_MOST_HEADER_LINES]]
    ends = [index for index, text in enumerate(head) if text.lower() == "endheader"]
    if not ends:
        raise FormatError(f"no line endheader among the first {len(head)}")
    end = ends[1] if ends[0] == 0 and len(ends) > 1 else ends[0]
    header: dict[str, str] = {}
    for text in head[1:end] + head[:1]:  # the first line may be a title, which may look like a key
        key, is_pair, value = text.partition("=")
        if not is_pair:
            key, _, value = text.partition(" ")
        header.setdefault(key.strip().lower(), value.strip().lower())
    return header, end + 1


def _coordinate(label: str) -> str:
    """The coordinate whose value a column of an OpenSim states file holds; other labels are unchanged."""
    parts = label.split("/")
    return parts[-2] if label.startswith("/jointset/") and parts[-1] == "value" else label


def _check_count(header: dict[str, str], keys: tuple[str, str], count: int, what: str) -> None:
    for key in keys:
        if key in header and whole_number(header[key], f"field {key}") != count:
            raise FormatError(f"field {key}: {header[key]}, but there are {count} {what}")


def _rows(lines: list[str], start: int, labels: list[str]) -> np.ndarray:
    rows = []
    for index, line in enumerate(lines[start:], start + 1):
        cells = line.split()
        if not cells:
            continue
        if len(cells) != len(labels):
            raise FormatError(f"line {index}: {counted(len(cells), 'cell')}, wanted {len(labels)}")
        rows.append(numbers(cells, index, labels))
        if len(rows) > 1 and not rows[-1][0] > rows[-2][0]:
            raise FormatError(f"line {index}, column time: {cells[0]} does not come after {rows[-2][0]:g}")
    return np.array(rows).reshape(len(rows), len(labels))


def _points(
    column: dict[str, np.ndarray], up: Up, up_note: tuple[str, ...]
) -> tuple[list[str], np.ndarray, tuple[str, ...]]:
    """Names and (T, K, 3) of the points given by translations; without points, the up axis needs no note."""
    names = [
        name.removesuffix("_tx")
        for name in column
        if name.endswith("_tx") and all(f"{name[:-1]}{axis}" in column for axis in "yz")
    ]
    if not names:
        return [], np.empty((len(column["time"]), 0, 3)), ()
    points = [np.stack([column[f"{name}_t{axis}"] for axis in "xyz"], axis=-1) for name in names]
    return names, to_z_up(np.stack(points, axis=1), up), up_note


def _is_turned(knee_deg: np.ndarray) -> bool:
    """Whether a knee's flexion is negative: it bends more to that side, and more than knees can."""
    known = knee_deg[np.isfinite(knee_deg)]
    return bool(len(known)) and known.min() < -_BACKWARDS_DEG and -known.min() > known.max()


def _pelvis(motion: Motion, model: Model) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
    """The pelvis' angles (T,) in degrees, and (T, 3) its origin; the origin in a file is kept."""
    found = joints_found(motion.names)
    hips = [f"{side}_hip" for side in ("right", "left")]
    sides = [side for side in ("right", "left") if f"{side}_knee" in found and f"{side}_hip" in motion.angles]
    if not (sides and all(hip in found for hip in hips)):
        return {}, motion.points[:, found["pelvis"]] if "pelvis" in found else None
    with np.errstate(over="ignore", invalid="ignore"):
        angles, origin = _pelvis_of_legs(motion, found, sides, model)
    return (angles, origin) if np.isfinite(origin).any() else ({}, None)


def _pelvis_of_legs(
    motion: Motion, found: dict[str, int], sides: list[str], model: Model
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The angles and the origin of the pelvis that give the directions of the thighs on these sides."""
    points = {name: from_z_up(motion.points[:, k], "y") for name, k in found.items()}
    right = _unit(points["right_hip"] - points["left_hip"])
    ups = []
    for side in sides:
        thigh = points[f"{side}_knee"] - points[f"{side}_hip"]
        thigh = _unit(thigh - (thigh * right).sum(axis=1, keepdims=True) * right)
        flexion = np.deg2rad(motion.angles[f"{side}_hip"])[:, None]
        ups.append(np.sin(flexion) * np.cross(right, thigh) - np.cos(flexion) * thigh)
    up = _unit(np.where(np.isfinite(ups), ups, 0).sum(axis=0))
    turn = np.stack([np.cross(up, right), up, right], axis=-1)
    tilt, sideways, heading = _memo.euler_angles(turn, "ZXY").T
    known = np.isfinite(heading)
    heading[known] = np.unwrap(heading[known])
    middle = (points["right_hip"] + points["left_hip"]) / 2
    angles = dict(zip(PELVIS, np.rad2deg([tilt, sideways, heading]), strict=True))
    return angles, to_z_up(middle - turn @ np.array(model.hips_m), "y")


def _unit(vectors: np.ndarray) -> np.ndarray:
    """(T, 3) of length one; NaN if there is no direction."""
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: np.ndarray = vectors / np.where(lengths > 1e-9, lengths, np.nan)
    return unit
