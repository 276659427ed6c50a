"""C3D (c3d.org): points, joint angles and events in the binary format of motion laboratories.

A file is blocks of 512 bytes: a header of 256 words, a section of parameters in groups, then the frames one
after another: X, Y, Z and a fourth word of every point, whose sign tells whether the point is valid.
The reader accepts integers and floats of all three processors (Intel, DEC, MIPS); the writer uses floats in
Intel's order, millimetres, residual 0 or -1.

The reader is memo's own. Of 150 damaged files, the C++ library ezc3d 1.7 crashed the process on 15, and
the Python library c3d 0.6 let struct errors and assertions through on 27; here every size in a file is
checked against the bytes present before it is used, and a damaged file is read, if its sizes still agree,
or ends in one `FormatError`.

Conventions: the time of the first frame is (its number - 1) / rate, as Vicon counts, and events (group
EVENT, labels `Foot Strike` and `Foot Off`, contexts `Right` and `Left`) are on the same clock; of other
events only the number is reported. Points that POINT:ANGLES names are joint angles in degrees,
`RKneeAngles` with flexion in X, and POINT:DESCRIPTIONS says what each is between; those that FORCES, MOMENTS,
POWERS and SCALARS name, and analog channels, are left out. POINT:Y_SCREEN names the up axis; without it, it
is the axis along which the figure stands.
Frames beyond 65535 are counted by TRIAL:ACTUAL_END_FIELD; labels and events beyond 255 continue in LABELS2,
TIMES2 and so on.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from memo import _memo
from memo.formats.motion import (
    MAX_FRAMES,
    STAMP_ERROR_S,
    FormatError,
    GaitEvent,
    Motion,
    Up,
    from_z_up,
    to_z_up,
)
from memo.formats.names import standing_up
from memo.formats.reading import Given, chosen_up, unit_of
from memo.unfinished import complete_file
from memo.wording import counted

__all__ = ["read_c3d", "write_c3d"]

_BLOCK = 512
_MOST_BYTES = 2 << 30
_MOST_POINTS = 10_000
_FARTHEST = 1e12  # largest coordinate, in the file's unit; a larger one is damage
_KEY = 0x50
_INTEL, _DEC, _MIPS = 84, 85, 86
_OTHER_KINDS = ("FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_STRIKES = {
    "footstrike": "heel_strike",
    "heelstrike": "heel_strike",
    "footoff": "toe_off",
    "toeoff": "toe_off",
}
_STRIKES |= {"hs": "heel_strike", "fs": "heel_strike", "to": "toe_off", "fo": "toe_off"}
_LABELS = {"heel_strike": "Foot Strike", "toe_off": "Foot Off"}
_TEXTS = {
    "heel_strike": "The instant the heel strikes the ground",
    "toe_off": "The instant the toe leaves the ground",
}
_FLEXIONS = {
    f"{side}_{part}": f"{side[0].upper()}{part.capitalize()}Angles"
    for side in ("right", "left")
    for part in ("hip", "knee", "ankle", "shoulder", "elbow")
}
_OURS = {label: joint for joint, label in _FLEXIONS.items()}


# Reading.


def read_c3d(path: Path, given: Given) -> Motion:
    """Reads points, angles and gait events."""
    given.check_used()
    size = path.stat().st_size
    if size > _MOST_BYTES:
        raise FormatError(f"{size >> 20} MiB are more than the {_MOST_BYTES >> 20} MiB that memo reads")
    data = path.read_bytes()
    file = _open(data)
    labels = _labels(file)
    values, valid = _frames(data, file)
    rate_hz, first = file.rate_hz, file.first
    times_s = (first - 1 + np.arange(file.frames)) / rate_hz
    kinds = {kind: set(file.texts("POINT", kind)) for kind in ("ANGLES", *_OTHER_KINDS)}
    others = {label for kind in _OTHER_KINDS for label in kinds[kind]}
    is_angle = np.array([label in kinds["ANGLES"] for label in labels], bool)
    is_point = np.array([label not in kinds["ANGLES"] | others for label in labels], bool)
    notes = []
    if not file.has("POINT", "UNITS"):
        notes.append("The file names no unit of length: millimetres were assumed.")
    unit, unit_m = unit_of(file.text("POINT", "UNITS") or "mm", "parameter POINT:UNITS")
    names, renamed = _unique([label for label, kept in zip(labels, is_point, strict=True) if kept])
    points = np.where(valid[:, is_point, None], values[:, is_point] * unit_m, np.nan)
    said = file.text("POINT", "Y_SCREEN") or None
    up, up_note = chosen_up(
        given, said, "z", "most laboratories have", standing_up(names, points, given.markers)
    )
    points = to_z_up(points, up)
    angles = _angles(values, valid, labels, is_angle)
    events, other_events = _events(file)
    notes += [
        *up_note,
        *(["Empty and repeated labels were numbered."] if renamed else []),
        *(
            [f"Left out: {counted(len(others), 'force, moment or power', 'forces, moments or powers')}."]
            if others
            else []
        ),
        *(
            [f"Left out: {counted(file.analog_words, 'analog value')} per frame."]
            if file.analog_words
            else []
        ),
        *(
            [f"Left out: {counted(other_events, 'event')}, neither heel strike nor toe-off."]
            if other_events
            else []
        ),
    ]
    metadata = {"format": "c3d", "up": up, "unit": unit, "rate_hz": rate_hz, "first_frame": first}
    frames = first - 1 + np.arange(file.frames)
    return Motion(tuple(names), times_s, points, tuple(events), angles, metadata, tuple(notes), frames)


@dataclass
class _File:
    """Header and parameters of a file, with sizes checked against its length."""

    order: str
    processor: int
    parameters: dict[tuple[str, str], Any]
    points: int = 0
    frames: int = 0
    first: int = 1
    rate_hz: float = 0.0
    scale: float = -1.0
    analog_words: int = 0
    start: int = 0
    header_events: tuple[tuple[str, float], ...] = ()

    def has(self, group: str, name: str) -> bool:
        return (group, name) in self.parameters

    def texts(self, group: str, name: str) -> list[str]:
        """All texts of a parameter, with those of NAME2, NAME3, ... if there are more than 255."""
        found: list[str] = []
        for suffix in ("", *range(2, 100)):
            value = self.parameters.get((group, f"{name}{suffix}"))
            if not isinstance(value, list):
                break
            found += value
        return found

    def text(self, group: str, name: str) -> str:
        value = self.parameters.get((group, name))
        return value[0].strip() if isinstance(value, list) and value else ""

    def numbers(self, group: str, name: str) -> np.ndarray:
        value = self.parameters.get((group, name))
        return value.ravel() if isinstance(value, np.ndarray) else np.empty(0)

    def number(self, group: str, name: str) -> float | None:
        values = self.numbers(group, name)
        return float(values[0]) if len(values) else None


def _open(data: bytes) -> _File:
    if len(data) < 2 * _BLOCK or data[1] != _KEY:
        raise FormatError("byte 1: not a C3D file (its second byte must be 0x50, in two blocks of 512 bytes)")
    start = (data[0] - 1) * _BLOCK
    if data[0] < 2 or start + 4 > len(data):
        raise FormatError(
            f"byte 0: the parameters begin at block {data[0]}, the file has {counted(len(data), 'byte')}"
        )
    processor = data[start + 3]
    if processor not in (_INTEL, _DEC, _MIPS):
        raise FormatError(
            f"byte {start + 3}: processor {processor}, wanted 84 (Intel), 85 (DEC) or 86 (MIPS)"
        )
    order = ">" if processor == _MIPS else "<"
    file = _File(order, processor, {})
    blocks = data[start + 2]
    # Some programs leave the number of blocks at 0: the parameters then end where the data begin.
    (data_block,) = struct.unpack_from(order + "H", data, 16)
    stop = start + blocks * _BLOCK if blocks else (data_block - 1) * _BLOCK
    file.parameters = _parameters(data, start + 4, min(stop, len(data)), file)
    _sizes(data, file, data_block)
    file.header_events = _header_events(data, file)
    return file


def _parameters(data: bytes, at: int, stop: int, file: _File) -> dict[tuple[str, str], Any]:
    """Every parameter by group and name: a list of texts, or an array of numbers."""
    groups: dict[int, str] = {}
    found: list[tuple[int, str, Any]] = []
    while at + 2 <= stop:
        length, group = abs(int(np.int8(np.uint8(data[at])))), int(np.int8(np.uint8(data[at + 1])))
        if length == 0:
            break
        where = f"byte {at}"
        after_name = at + 2 + length
        if after_name + 2 > stop:
            raise FormatError(f"{where}: the name of a parameter ends outside the parameter section")
        name = data[at + 2 : after_name].decode("latin-1").strip().upper()
        (offset,) = struct.unpack_from(file.order + "h", data, after_name)
        if offset < 0 or (offset and after_name + offset > stop):
            raise FormatError(
                f"{where}, parameter {name}: the next one is {counted(offset, 'byte')} further,"
                " outside the section"
            )
        if group < 0:
            groups[-group] = name
        elif group > 0:
            found.append(
                (group, name, _value(data, after_name + 2, stop, file, f"{where}, parameter {name}"))
            )
        if offset == 0:
            break
        at = after_name + offset
    return {(groups.get(group, ""), name): value for group, name, value in found}


def _value(data: bytes, at: int, stop: int, file: _File, where: str) -> list[str] | np.ndarray:
    """A parameter's value; `at` is the byte that holds the size of its elements."""
    if at + 2 > stop:
        raise FormatError(f"{where}: cut off")
    kind, rank = int(np.int8(np.uint8(data[at]))), data[at + 1]
    if rank > 7 or kind not in (-1, 1, 2, 4) or at + 2 + rank > stop:
        raise FormatError(
            f"{where}: elements of size {kind} in {rank} dimensions, wanted -1, 1, 2 or 4 in 0 to 7"
        )
    shape = list(data[at + 2 : at + 2 + rank])
    count = math.prod(shape)
    begin = at + 2 + rank
    if begin + count * abs(kind) > stop:
        raise FormatError(f"{where}: elements of shape {shape} end outside the parameter section")
    raw = data[begin : begin + count * abs(kind)]
    if kind == -1:
        width = shape[0] if shape else 1
        rows = math.prod(shape[1:])
        return [
            raw[k * width : (k + 1) * width].decode("latin-1").strip(" \0")
            for k in range(rows if width else 0)
        ]
    if kind == 4:
        return _floats(np.frombuffer(raw, np.uint8), file)
    return np.frombuffer(raw, np.int8 if kind == 1 else file.order + "i2")


def _floats(raw: np.ndarray, file: _File) -> np.ndarray:
    """Bytes (..., 4 n) as float64 (..., n); DEC's F format has 16-bit words swapped and a bias 2 larger."""
    with np.errstate(invalid="ignore"):  # damaged floats may be signalling NaN
        if file.processor != _DEC:
            return np.ascontiguousarray(raw).view(file.order + "f4").astype(np.float64)
        words = np.ascontiguousarray(raw).view("<u2")
        whole = words[..., ::2].astype(np.uint32) << 16 | words[..., 1::2]
        return whole.view(np.float32).astype(np.float64) / 4


def _sizes(data: bytes, file: _File, header_data_block: int) -> None:
    """Points, frames, rate, scale and the start of the data, if header and parameters agree."""
    points, analog, first, last = struct.unpack_from(file.order + "4H", data, 2)
    scale, rate_hz = (float(x) for x in _floats(np.frombuffer(data[12:16] + data[20:24], np.uint8), file))
    used = file.number("POINT", "USED")
    file.points = points if used is None else int(used) % 65536
    if file.points != points:
        raise FormatError(
            f"bytes 2-3: {counted(points, 'point')} in the header, parameter POINT:USED has {file.points}"
        )
    if not 1 <= points <= _MOST_POINTS:
        raise FormatError(f"parameter POINT:USED: {counted(points, 'point')}, wanted 1 to {_MOST_POINTS}")
    named = file.number("POINT", "SCALE")
    file.scale = scale if named is None else named
    if not (math.isfinite(file.scale) and 0 < abs(file.scale) < 1e6):
        raise FormatError(f"parameter POINT:SCALE: {file.scale:g} is not a scale")
    named = file.number("POINT", "RATE")
    file.rate_hz = rate_hz if named is None else named
    if not 1e-3 <= file.rate_hz <= 1e6:
        raise FormatError(f"parameter POINT:RATE: {file.rate_hz:g} is not a rate in Hz")
    file.first, file.frames = _frame_range(file, first, last)
    file.analog_words = analog
    begin = file.number("POINT", "DATA_START")
    file.start = ((header_data_block or int(begin or 0)) - 1) * _BLOCK
    frame_bytes = (4 * points + analog) * (4 if file.scale < 0 else 2)
    room = (len(data) - file.start) // frame_bytes if 0 < file.start <= len(data) else 0
    if room < file.frames:
        raise FormatError(
            f"byte {max(file.start, 0)}: room for {counted(file.frames, 'frame')} of"
            f" {counted(frame_bytes, 'byte')} is needed from here on,"
            f" the file ends at byte {len(data)}, after {room}"
        )


def _frame_range(file: _File, first: int, last: int) -> tuple[int, int]:
    """Number of the first frame, from 1, and the number of frames."""
    ends = []
    for name in ("ACTUAL_START_FIELD", "ACTUAL_END_FIELD"):
        words = [int(word) % 65536 for word in file.numbers("TRIAL", name)]
        if words and len(words) <= 2:
            ends.append(words[0] + (words[1] << 16 if len(words) == 2 else 0))
    if len(ends) == 2 and ends[1] >= ends[0] >= 1:
        first, count = ends[0], ends[1] - ends[0] + 1
    else:
        count = last - first + 1
        named = file.number("POINT", "LONG_FRAMES") or file.number("POINT", "FRAMES")
        if last == 65535 and named is not None and math.isfinite(named):
            count = int(named) if named > 0 else int(named) % 65536
    if not 1 <= count <= MAX_FRAMES:
        raise FormatError(f"bytes 6-9: frames {first} to {last}")
    return first, count


def _labels(file: _File) -> list[str]:
    """A label for every point, empty if the file has none."""
    labels = [label.strip() for label in file.texts("POINT", "LABELS")]
    return (labels + [""] * file.points)[: file.points]


def _frames(data: bytes, file: _File) -> tuple[np.ndarray, np.ndarray]:
    """(T, P, 3) in the file's unit, and (T, P) which of them are valid."""
    size = 4 if file.scale < 0 else 2
    words = 4 * file.points + file.analog_words
    raw = np.frombuffer(data, np.uint8, file.frames * words * size, file.start)
    raw = raw.reshape(file.frames, words * size)[:, : 4 * file.points * size]
    if size == 4:
        values = _floats(raw, file).reshape(file.frames, file.points, 4)
    else:
        whole = np.ascontiguousarray(raw).view(file.order + "i2")
        values = whole.astype(np.float64).reshape(file.frames, file.points, 4)
        values[..., :3] *= file.scale
    with np.errstate(invalid="ignore"):
        valid = (values[..., 3] >= 0) & (np.abs(values[..., :3]) < _FARTHEST).all(axis=2)
    return values[..., :3], valid


def _unique(labels: list[str]) -> tuple[list[str], bool]:
    """The labels, numbered if they are empty or repeated, and whether any was changed."""
    taken: set[str] = set(labels)
    seen: set[str] = set()
    names, changed, count = [], False, 0
    for index, label in enumerate(labels):
        name = label
        if not label or label in seen:
            changed = True
            while not name or name in taken:
                count += 1
                name = f"{label or 'point'}_{index + count}"
            taken.add(name)
        seen.add(name)
        names.append(name)
    return names, changed


def _angles(
    values: np.ndarray, valid: np.ndarray, labels: list[str], is_angle: np.ndarray
) -> dict[str, np.ndarray]:
    """Flexions by memo's names; other angles, and other rotation axes, as LABEL_x, LABEL_y, LABEL_z."""
    angles: dict[str, np.ndarray] = {}
    for point in np.flatnonzero(is_angle):
        columns = np.where(valid[:, point, None], values[:, point], np.nan)
        flexion = _OURS.get(labels[point])
        if flexion is not None:
            angles.setdefault(flexion, columns[:, 0])
        rest = zip("xyz", columns.T, strict=True)
        for axis, column in rest:
            if flexion is None or (axis != "x" and np.nan_to_num(column).any()):
                angles.setdefault(f"{labels[point] or point}_{axis}", column)
    return angles


def _events(file: _File) -> tuple[list[GaitEvent], int]:
    """The gait events, and the number of others; those in the header if there is no group EVENT."""
    times = _joined(file, "EVENT", "TIMES")
    labels, contexts = file.texts("EVENT", "LABELS"), file.texts("EVENT", "CONTEXTS")
    given = [
        (label, context, 60 * minutes + seconds)
        for label, context, (minutes, seconds) in zip(labels, contexts, times.reshape(-1, 2), strict=False)
    ]
    if not given:
        offset_s = (file.first - 1) / file.rate_hz  # those of the header count from the first frame
        given = [(label[1:], label[:1], offset_s + time_s) for label, time_s in file.header_events]
    events = []
    for label, context, time_s in given:
        kind = _STRIKES.get("".join(c for c in label.lower() if c.isalpha()))
        side = {"r": "right", "l": "left"}.get(context[:1].lower())
        if kind and side and math.isfinite(time_s) and abs(time_s) < 1e9:
            events.append(GaitEvent(float(time_s), kind, side))
    return events, len(given) - len(events)


def _joined(file: _File, group: str, name: str) -> np.ndarray:
    """All numbers of a parameter in pairs, with those of NAME2, ..., as float64."""
    parts = [file.numbers(group, f"{name}{suffix}") for suffix in ("", *range(2, 100))]
    values = np.concatenate(parts).astype(np.float64)
    return values[: len(values) // 2 * 2]


def _header_events(data: bytes, file: _File) -> tuple[tuple[str, float], ...]:
    """The events of the header, at most 18: labels of four characters, seconds from the first frame."""
    key, count = struct.unpack_from(file.order + "2H", data, 298)
    if key != 12345 or count > 18:
        return ()
    times = _floats(np.frombuffer(data[304:376], np.uint8), file)
    labels = [data[396 + 4 * k : 400 + 4 * k].decode("latin-1").strip(" \0") for k in range(count)]
    return tuple(zip(labels, (float(time_s) for time_s in times[:count]), strict=True))


# Writing.


def write_c3d(path: Path, motion: Motion, up: Up) -> list[str]:
    """Writes points in millimetres, angles in degrees and events; returns what was changed, in sentences."""
    rate_hz, motion = motion.at_constant_rate()
    first = max(1, round(float(motion.times_s[0]) * rate_hz) + 1)
    frames = len(motion.times_s)
    if first + frames >= 1 << 31:
        raise FormatError(f"frames {first} to {first + frames - 1}: more than a C3D file can count")
    labels, values = _columns(motion, up)
    if len(labels) > _MOST_POINTS:
        raise FormatError(
            f"a C3D file is written with at most {_MOST_POINTS} points and angles, got {len(labels)}"
        )
    if not (np.isnan(values) | (np.abs(values) < _FARTHEST)).all():
        raise FormatError(f"a point or an angle is beyond {_FARTHEST:g} mm or degrees")
    parameters = _parameter_section(motion, labels, first, rate_hz, up)
    data_block = 2 + len(parameters) // _BLOCK
    header = bytearray(_BLOCK)
    struct.pack_into("<BB", header, 0, 2, _KEY)
    last = min(first + frames - 1, 65535)
    struct.pack_into("<4H", header, 2, len(labels), 0, min(first, 65535), last)
    struct.pack_into("<Hf", header, 10, 0, -1.0)
    struct.pack_into("<HHf", header, 16, data_block, 1, rate_hz)
    struct.pack_into("<H", header, 298, 12345)
    known = np.isfinite(values).all(axis=2)
    words = np.empty((frames, len(labels), 4), "<f4")
    words[..., :3] = np.where(known[..., None], values, 0)
    words[..., 3] = np.where(known, 0, -1)
    with complete_file(path) as temporary, open(temporary, "wb") as file:
        file.write(header)
        file.write(parameters)
        file.write(words.tobytes())
        if frames <= 65535:  # for longer files, other programs read all frames up to the end of the file
            file.write(bytes(-words.nbytes % _BLOCK))
    began_s, begins_s = float(motion.times_s[0]), (first - 1) / rate_hz
    if abs(begins_s - began_s) <= STAMP_ERROR_S:  # no more than the time stamps themselves are rounded
        return []
    return [
        f"A C3D file counts whole frames from 0 s: this motion, from {began_s:g} s, begins at {begins_s:g} s."
    ]


def _columns(motion: Motion, up: Up) -> tuple[list[tuple[str, bool]], np.ndarray]:
    """Labels, each with whether it is an angle, and (T, P, 3) millimetres and degrees."""
    labels = [(name, False) for name in motion.names]
    parts = [from_z_up(motion.points, up) * 1000]
    grouped: dict[str, dict[str, str]] = {}
    for name in motion.angles:
        label, _, axis = name.rpartition("_")
        if name in _FLEXIONS or not label or axis not in ("x", "y", "z"):
            label, axis = _FLEXIONS.get(name, name), "x"
        other = grouped.setdefault(label, {}).setdefault(axis, name)
        if other != name:
            raise FormatError(f"angles {other} and {name} are both {axis} of the label {label} in a C3D file")
    for label, axes in grouped.items():
        known = np.logical_or.reduce([np.isfinite(motion.angles[name]) for name in axes.values()])
        filled = np.where(known[:, None], 0.0, np.nan) * np.ones(3)
        for axis, name in axes.items():
            filled[:, "xyz".index(axis)] = motion.angles[name]
        labels.append((label, True))
        parts.append(filled[:, None, :])
    names = [label for label, _ in labels]
    for name in names:
        if len(name.encode("latin-1", "replace")) > 127 or not name.isascii() or not name.isprintable():
            raise FormatError(f"point {name[:60]!r}: labels of a C3D file are up to 127 ASCII characters")
    if len(set(names)) < len(names):
        raise FormatError("a point has the label of an angle")
    return labels, np.concatenate(parts, axis=1)


def _parameter_groups(
    motion: Motion, labels: Sequence[tuple[str, bool]], first: int, rate_hz: float, up: Up
) -> dict[str, list[bytes]]:
    """The parameters by group; where the data starts is still to be added."""
    frames = len(motion.times_s)
    names = [label for label, _ in labels]
    angles = [label for label, is_angle in labels if is_angle]
    references = motion.metadata.get("references", {})
    descriptions = [references.get(_OURS.get(name, name), "") if own else "" for name, own in labels]
    split = [(value & 0xFFFF, value >> 16) for value in (first, first + frames - 1)]
    return {
        "TRIAL": [
            _integers("ACTUAL_START_FIELD", split[0], (2,)),
            _integers("ACTUAL_END_FIELD", split[1], (2,)),
            _reals("CAMERA_RATE", [rate_hz], ()),
        ],
        "POINT": [
            _integers("USED", [len(labels)], ()),
            _integers("FRAMES", [min(frames, 65535)], ()),
            *([_reals("LONG_FRAMES", [frames], ())] if frames > 65535 else []),
            _reals("SCALE", [-1.0], ()),
            _reals("RATE", [rate_hz], ()),
            _characters("UNITS", ["mm"]),
            _characters("X_SCREEN", ["+X"]),
            _characters("Y_SCREEN", [f"+{up.upper()}"]),
            *_many("LABELS", names),
            *_many("DESCRIPTIONS", descriptions),
            *((*_many("ANGLES", angles), _characters("ANGLE_UNITS", ["deg"])) if angles else ()),
        ],
        "ANALOG": [
            _integers("USED", [0], ()),
            _reals("GEN_SCALE", [1.0], ()),
            _reals("RATE", [rate_hz], ()),
        ],
        "FORCE_PLATFORM": [_integers("USED", [0], ()), _integers("ZERO", [1, 0], (2,))],
        "MANUFACTURER": [
            _characters("COMPANY", ["memo"]),
            _characters("SOFTWARE", ["memo"]),
            _characters("VERSION_LABEL", [_memo.__version__]),
        ],
        "EVENT_CONTEXT": [
            _integers("USED", [3], ()),
            _integers("ICON_IDS", [0, 1, 2], (3,)),
            _characters("LABELS", ["General", "Left", "Right"]),
            _characters("DESCRIPTIONS", ["For other events", "Left side", "Right side"]),
            _integers("COLOURS", [0, 0, 0, 255, 0, 0, 0, 255, 0], (3, 3)),
        ],
        "EVENT": _event_parameters(motion, first, rate_hz),
    }


def _parameter_section(
    motion: Motion, labels: Sequence[tuple[str, bool]], first: int, rate_hz: float, up: Up
) -> bytes:
    """The parameter section, whole blocks."""
    groups = _parameter_groups(motion, labels, first, rate_hz, up)
    data_start = _integers("DATA_START", [0], ())
    groups["POINT"].insert(2, data_start)
    content = bytearray()
    for number, (group, parameters) in enumerate(groups.items(), 1):
        content += struct.pack("<bb", len(group), -number) + group.encode() + struct.pack("<hB", 3, 0)
        for parameter in parameters:
            content += parameter[:1] + bytes([number]) + parameter[2:]
    blocks = -(-(4 + len(content) + 2) // _BLOCK)
    if blocks > 255:
        raise FormatError(
            f"labels and events fill {counted(blocks, 'block')}, the parameters of a C3D file at most 255"
        )
    content = bytearray(struct.pack("<BBBB", 1, _KEY, blocks, _INTEL)) + content
    # The start of the data is known only now.
    content = content.replace(data_start[2:], _integers("DATA_START", [2 + blocks], ())[2:], 1)
    return bytes(content + bytes(blocks * _BLOCK - len(content)))


def _event_parameters(motion: Motion, first: int, rate_hz: float) -> list[bytes]:
    """The group EVENT; times are minutes and seconds on the clock of the frame numbers."""
    events = motion.events
    shift_s = (first - 1) / rate_hz - float(motion.times_s[0])
    times = [x for event in events for x in (0.0, event.time_s + shift_s)]
    count = len(events)
    return [
        _integers("USED", [count], ()),
        *_many("CONTEXTS", [event.side.capitalize() for event in events]),
        *_many("LABELS", [_LABELS[event.kind] for event in events]),
        *_many("DESCRIPTIONS", [_TEXTS[event.kind] for event in events]),
        *_many("SUBJECTS", [""] * count),
        *(_reals(name, times[2 * a : 2 * b], (2, b - a)) for name, a, b in _chunks("TIMES", count)),
        *(
            _integers(name, [1 if event.kind == "heel_strike" else 2 for event in events[a:b]], (b - a,))
            for name, a, b in _chunks("ICON_IDS", count)
        ),
        *(_integers(name, [0] * (b - a), (b - a,)) for name, a, b in _chunks("GENERIC_FLAGS", count)),
    ]


def _chunks(name: str, count: int) -> Iterable[tuple[str, int, int]]:
    """NAME, NAME2, ... for 255 elements each, the most that one byte can count."""
    for number, a in enumerate(range(0, count, 255), 1):
        yield (name if number == 1 else f"{name}{number}"), a, min(a + 255, count)


def _many(name: str, texts: Sequence[str]) -> list[bytes]:
    return [_characters(part, texts[a:b]) for part, a, b in _chunks(name, len(texts))]


def _integers(name: str, values: Iterable[int], shape: tuple[int, ...]) -> bytes:
    words = [value & 0xFFFF for value in values]
    return _parameter(name, 2, shape, struct.pack(f"<{len(words)}H", *words))


def _reals(name: str, values: Iterable[float], shape: tuple[int, ...]) -> bytes:
    return _parameter(name, 4, shape, np.array(list(values), "<f4").tobytes())


def _characters(name: str, texts: Sequence[str]) -> bytes:
    width = max(1, *(len(text) for text in texts))
    shape = (width, len(texts)) if len(texts) > 1 or name.startswith(("LABELS", "ANGLES")) else (width,)
    return _parameter(name, -1, shape, "".join(text.ljust(width) for text in texts).encode("ascii"))


def _parameter(name: str, kind: int, shape: tuple[int, ...], value: bytes) -> bytes:
    """A parameter without description; its second byte, the group, is filled in by the caller."""
    body = struct.pack("<bB", kind, len(shape)) + bytes(shape) + value + b"\0"
    if len(body) + 2 > 32767:
        raise FormatError(f"parameter {name}: {counted(len(body), 'byte')}, a C3D file holds at most 32765")
    return struct.pack("<bb", len(name), 0) + name.encode() + struct.pack("<h", len(body) + 2) + body
