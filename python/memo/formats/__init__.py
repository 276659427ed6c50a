"""Motion files, read and written: TRC, MOT and STO, C3D, BVH and tables of joints (CSV, Parquet).

`read_motion` and `write_motion` choose the format by the ending of the file's name; `READERS` and
`WRITERS` hold the function for each ending, and a new format is one entry in each; AMC is only read.
Assumptions made in reading are in `Motion.notes`; `write_motion` returns what a format cannot store. A file
appears complete or not at all, and any problem with a file is a `FormatError` that names the file and the
line, byte or field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path

from memo.formats.amc import read_amc
from memo.formats.bvh import read_bvh, write_bvh
from memo.formats.c3d import read_c3d, write_c3d
from memo.formats.clinical import clinical
from memo.formats.mot import GAIT2392, read_mot, write_mot
from memo.formats.motion import FormatError, GaitEvent, Motion, Up
from memo.formats.names import renamed
from memo.formats.parquet import read_parquet_motion, write_parquet_motion
from memo.formats.reading import Given
from memo.formats.run_folder import read_run_folder
from memo.formats.table import read_table, write_table
from memo.formats.trc import read_trc, write_trc

__all__ = [
    "READERS",
    "USUAL_UP",
    "WRITERS",
    "FormatError",
    "GaitEvent",
    "Given",
    "Motion",
    "clinical",
    "read_motion",
    "write_motion",
]

Reader = Callable[[Path, Given], Motion]
"""Reads a file; raises `FormatError` without the name of the file, which `read_motion` prepends."""

Writer = Callable[[Path, Motion, Up], list[str]]
"""Writes a whole file; returns what was left out, in sentences."""

READERS: dict[str, Reader] = {
    ".amc": read_amc,
    ".bvh": read_bvh,
    ".c3d": read_c3d,
    ".csv": read_table,
    ".mot": read_mot,
    ".parquet": read_parquet_motion,
    ".sto": read_mot,
    ".trc": read_trc,
}
"""The reader for each ending."""

WRITERS: dict[str, Writer] = {
    ".bvh": write_bvh,
    ".c3d": write_c3d,
    ".csv": write_table,
    ".mot": write_mot,
    ".parquet": write_parquet_motion,
    ".sto": write_mot,
    ".trc": write_trc,
}
"""The writer for each ending."""

USUAL_UP: dict[str, Up] = {".bvh": "y", ".mot": "y", ".sto": "y", ".trc": "y"}
"""The up axis that programs expect for an ending; Z for all others."""


def read_motion(
    path: str | PathLike[str],
    *,
    up: Up | None = None,
    rate_hz: float | None = None,
    unit_m: float | None = None,
    walk: int | None = None,
    markers: Mapping[str, Sequence[str]] | None = None,
) -> Motion:
    """Reads a motion file, or the folder of `memo track` or `memo posture`.

    `up`: the file's up axis, in place of the one it names. `rate_hz`: frame rate of an AMC file, or of a
    table without times. `unit_m`: metres in one unit of a BVH or AMC file, or of a table that names none.
    `walk`: one walk of a track, from 0; all of them otherwise, if they are of one person. `markers`: names of
    the points at whose mean a joint is, such as `{"right_hip": ["RASI"]}`, in files with names of their own:
    figures are measured by them if a file names neither unit nor up axis.
    """
    path = Path(path)
    check_up(up)
    given = Given(up, rate_hz, unit_m, markers)
    for name, value in (("rate_hz", rate_hz), ("unit_m", unit_m)):
        if value is not None and not 0 < value < 1e9:
            raise FormatError(f"{name} must be positive and finite, got {value:g}")
    try:
        if path.is_dir():
            return read_run_folder(path, given, walk)
        if path.name == "track.csv":
            return read_run_folder(path, given, walk)
        if walk is not None:
            raise FormatError("a walk can be chosen only for track.csv")
        reader = READERS.get(path.suffix.lower())
        if reader is None:
            raise FormatError(
                f"cannot read a motion from {path.suffix or 'a file without ending'}: {endings(READERS)}"
            )
        return reader(path, given)
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from None
    except MemoryError:
        raise FormatError(f"{path}: does not fit in memory") from None


def write_motion(
    path: str | PathLike[str], motion: Motion, up: Up | None = None, *, names: str | None = None
) -> list[str]:
    """Writes a motion in the format of the ending; returns what the format cannot store, in sentences.

    `up`: "z" or "y"; by default the format's usual one, Y for TRC, MOT, STO and BVH, else Z. `names`: "memo"
    for memo's own joints, "pose2sim" for the markers of Pose2Sim's OpenSim models, "gait2392" for the joint
    angles of OpenSim's models gait2392 and gait2354 (MOT, STO); by default, points keep their names.
    """
    path = Path(path)
    check_up(up)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        raise FormatError(
            f"{path}: cannot write a motion to {path.suffix or 'a file without ending'}: {endings(WRITERS)}"
        )
    try:
        if names == "gait2392" and writer is write_mot:
            return write_mot(path, motion, up or usual_up(path), GAIT2392)
        notes: list[str] = []
        if names is not None:
            motion, notes = renamed(motion, names)
        return notes + writer(path, motion, up or usual_up(path))
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from None


def usual_up(path: Path) -> Up:
    """The default up axis of a file."""
    return USUAL_UP.get(path.suffix.lower(), "z")


def check_up(up: str | None) -> None:
    if up not in ("z", "y", None):
        raise FormatError(f"the up axis must be z or y, got {up!r}")


def endings(table: dict[str, Reader] | dict[str, Writer]) -> str:
    return "wanted " + ", ".join(sorted(table))
