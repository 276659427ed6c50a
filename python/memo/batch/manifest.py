"""The manifest: the videos and their options, as CSV or TOML, all checked before any work.

CSV has a header row and one row per video; TOML has one table `[[video]]` per video and may have `[defaults]`
for all. Both use the same names: `video`, `name` and the options of `memo track` in `OPTIONS`. Relative paths
are relative to the manifest; an empty cell means that the option is not given.
"""

from __future__ import annotations

import contextlib
import difflib
import hashlib
import math
import os
import re
import tomllib
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from memo.given import frame_range, heights, is_url, load_camera, nothing_at, place_in_frame, tracker_options
from memo.spreadsheet import CsvRows, Error
from memo.wording import counted

__all__ = ["OPTIONS", "Manifest", "ManifestError", "Row", "read_manifest"]

Value = str | float | bool | Path


class Option(NamedTuple):
    """How a column is passed to `memo track`."""

    flag: str
    kind: type
    off: str = ""
    """The flag for false, if it is not `--no-` and the name."""


OPTIONS = {
    "camera": Option("--camera", Path),
    "camera_name": Option("--camera-name", str),
    "camera_unit": Option("--camera-unit", str),
    "camera_size": Option("--camera-size", str),
    "camera_v_up": Option("--camera-v-up", bool, "--camera-v-down"),
    "height_m": Option("--height", float),
    "fov_deg": Option("--fov-deg", float),
    "steady": Option("--steady", bool),
    "treadmill": Option("--treadmill", bool),
    "frames": Option("--frames", str),
    "fps": Option("--fps", float),
    "shrink": Option("--shrink", int),
    "follow": Option("--follow", str),
    "boxes": Option("--boxes", Path),
    "overlay": Option("--overlay", bool),
    "plots": Option("--plots", bool),
    "report": Option("--report", bool),
}
"""Columns that are options of `memo track`."""

_KNOWN = ("video", "name", *OPTIONS)
_TRUTHS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
TAKEN = (".batch", "logs", "status.csv", "gait_parameters.csv")
"""Reserved names in the folder of results."""

_LONGEST_NAME = 150  # bytes; file systems allow 255, and temporary names are a little longer


class ManifestError(ValueError):
    """The errors of a manifest: one problem per line, also in `problems`."""

    def __init__(self, problems: Iterable[str]) -> None:
        self.problems: list[str] = list(problems)
        super().__init__("\n".join(self.problems))


@dataclass(frozen=True)
class Row:
    """One video of the manifest."""

    name: str
    """Name of the video's folder of results."""
    video: Path
    """Absolute path."""
    options: Mapping[str, Value]
    """The values given, by column; paths are absolute."""
    place: str
    """Place of the row: `walks.csv, line 3`."""
    problems: tuple[str, ...] = ()
    """Why the video cannot be tracked as written, each with the place; empty if nothing is wrong."""

    @property
    def arguments(self) -> list[str]:
        """The row as arguments of `memo track`."""
        arguments = [str(self.video)]
        for name, value in self.options.items():
            flag, _, off = OPTIONS[name]
            if isinstance(value, bool):
                arguments.append(flag if value else off or flag.replace("--", "--no-", 1))
            else:
                arguments += [flag, str(value)]
        return arguments

    @staticmethod
    def of_arguments(arguments: Sequence[str]) -> tuple[Path, dict[str, Value]]:
        """The video and the options that gave these `arguments`."""
        switches = {option.flag: (name, True) for name, option in OPTIONS.items() if option.kind is bool}
        switches |= {
            option.off or option.flag.replace("--", "--no-", 1): (name, False)
            for name, option in OPTIONS.items()
            if option.kind is bool
        }
        valued = {option.flag: (name, option.kind) for name, option in OPTIONS.items()}
        video, *rest = arguments
        options: dict[str, Value] = {}
        words = iter(rest)
        for word in words:
            if word in switches:
                name, value = switches[word]
                options[name] = value
            elif word in valued:
                name, kind = valued[word]
                text = next(words)
                options[name] = text if kind is float and "," in text else kind(text)
            else:
                raise ValueError(f"{word} is no option of a row")
        return Path(video), options

    @property
    def fingerprint(self) -> dict[str, Any]:
        """What the result depends on: options, size and time of the video, content of other files."""
        stats = [file.stat() for file in _files(self.video)]
        print_: dict[str, Any] = {
            "video_bytes": sum(stat.st_size for stat in stats),
            "video_files": len(stats),
            "video_modified_s": max((int(stat.st_mtime) for stat in stats), default=0),
            **self.options,
        }
        for name, file in self.options.items():
            if isinstance(file, Path):
                print_[name] = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else None
        return print_


@dataclass(frozen=True)
class Manifest:
    """The rows, in order, and problems that concern none or several of them."""

    rows: list[Row]
    problems: list[str] = field(default_factory=list)
    """What must be corrected before anything can run: unknown columns, names used twice."""


class _Given(NamedTuple):
    """A row as it was written."""

    place: str
    cells: dict[str, Any]


def read_manifest(
    manifest: str | PathLike[str] | Iterable[Mapping[str, Any]], defaults: Mapping[str, Value] | None = None
) -> Manifest:
    """Reads and checks a manifest: a CSV or TOML file, or mappings with the same keys (`None`: not given).

    `defaults` are options for rows that do not give them. Videos are not opened; only their existence is
    checked. Raises `ManifestError` for a file that is not a manifest at all.
    """
    problems: list[str] = []
    if isinstance(manifest, str | PathLike):
        path = Path(manifest)
        base = path.resolve().parent
        given = _read_toml(path, problems) if path.suffix.lower() == ".toml" else _read_csv(path)
    else:
        base = Path.cwd()
        given = [_Given(f"row {k}", dict(row)) for k, row in enumerate(manifest, 1)]
        problems += [
            f"{row.place}: unknown key {_suggested(key)}"
            for row in given
            for key in row.cells
            if key not in _KNOWN
        ]
    if not given and not problems:
        raise ManifestError([f"{manifest}: holds no video"])
    unnamed = [_row(row, base, defaults or {}) for row in given]
    rows = [_checked(row) for row in _named(unnamed)]
    return Manifest(rows, problems + _name_problems(rows))


# The two formats.


def _read_csv(path: Path) -> list[_Given]:
    text = _text(path)
    lines = text.splitlines() or [""]
    delimiter = max(",;\t", key=lines[0].count)
    try:
        table = CsvRows(text.splitlines(keepends=True), delimiter=delimiter, strict=True, strip=True)
        header = next(table, [])
        problems = [
            f"{path}, line 1: unknown column {_suggested(name)}" for name in header if name not in _KNOWN
        ]
        problems += [f"{path}, line 1: column {name!r} twice" for name, n in Counter(header).items() if n > 1]
        if "video" not in header:
            problems.append(f"{path}, line 1: no column 'video'")
        given = []
        line = table.line_num + 1
        for cells in table:
            here = f"{path}, line {line}"
            line = table.line_num + 1
            if not any(cells):
                continue
            if len(cells) > len(header):
                problems.append(
                    f"{here}: {counted(len(cells), 'cell')} under {counted(len(header), 'column')}"
                )
            pairs = zip(header, cells, strict=False)
            given.append(_Given(here, {name: cell for name, cell in pairs if cell}))
    except Error as error:
        raise ManifestError([f"{path}, line {table.line_num}: {error}"]) from None
    if problems:
        raise ManifestError(problems)
    return given


def _read_toml(path: Path, problems: list[str]) -> list[_Given]:
    text = _text(path)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ManifestError([f"{path}: {error}"]) from None
    lines = text.splitlines()
    for key in tables:
        if key not in ("video", "defaults"):
            problems.append(f"{path}{_line_of(lines, key)}: unknown key {key!r}; videos are tables [[video]]")
    videos, defaults = tables.get("video", []), tables.get("defaults", {})
    if not (isinstance(videos, list) and all(isinstance(video, dict) for video in videos)):
        raise ManifestError([f"{path}: each video must be a table [[video]]"])
    if not isinstance(defaults, dict):
        raise ManifestError([f"{path}: [defaults] must be a table"])
    starts = [k for k, line in enumerate(lines) if re.match(r"\s*\[\[\s*video\s*\]\]", line)]
    for key in defaults:
        if key not in OPTIONS:
            problems.append(f"{path}{_line_of(lines, key)}: unknown key {_suggested(key)} in [defaults]")
    given = []
    for k, video in enumerate(videos):
        start = starts[k] if len(starts) == len(videos) else None
        place = f"{path}, video {k + 1}" if start is None else f"{path}, line {start + 1}"
        for key in video:
            if key not in _KNOWN:
                line = _line_of(lines, key, start or 0)
                problems.append(f"{path}{line}: unknown key {_suggested(key)}")
        given.append(_Given(place, {**defaults, **video}))
    return given


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ManifestError([f"{path}: not text in UTF-8"]) from None
    except FileNotFoundError:
        raise ManifestError([nothing_at(path)]) from None
    except OSError as error:
        raise ManifestError([f"{path}: cannot be read: {error.strerror}"]) from None


def _line_of(lines: list[str], key: str, start: int = 0) -> str:
    """`, line 7` where the key is given at or after line `start`, counted from 0."""
    pattern = re.compile(rf"\s*(\[+\s*)?[\"']?{re.escape(key)}[\"']?\s*[\]=]")
    return next((f", line {k + 1}" for k in range(start, len(lines)) if pattern.match(lines[k])), "")


def _suggested(name: str) -> str:
    near = difflib.get_close_matches(name, _KNOWN, n=1)
    return f"{name!r} (is it {near[0]!r}?)" if near else f"{name!r} (known: {', '.join(_KNOWN)})"


# A row.


def _row(given: _Given, base: Path, defaults: Mapping[str, Value]) -> Row:
    """The row with its values converted, and without a name if none is given."""
    cells = {key: value for key, value in given.cells.items() if value is not None and value != ""}
    problems = []
    options: dict[str, Value] = dict(defaults)
    for key, option in OPTIONS.items():
        if key in cells:
            try:
                several = _several_heights(cells[key]) if key == "height_m" else None
                options[key] = several or _converted(cells[key], option.kind, base)
            except ValueError as error:
                problems.append(f"{given.place}: {key} {error}")
    video = cells.get("video")
    if video is None:
        problems.append(f"{given.place}: no video")
    elif not isinstance(video, str | PathLike):
        problems.append(f"{given.place}: video {video!r} is not a path")
        video = None
    name = cells.get("name", "")
    if not isinstance(name, str):
        problems.append(f"{given.place}: name {name!r} is not text")
        name = ""
    # a missing video has the path of the folder's parent; `_checked` ignores it
    path = base if video is None else _located(video, base)
    return Row(name, path, options, given.place, tuple(problems))


def _several_heights(value: Any) -> str | None:
    """Heights of people in order of appearance as text such as 1.80,1.65; None for anything else.

    Each height has its decimal point, so 1,80 is not taken for two heights.
    """
    if isinstance(value, list) and len(value) > 1:
        value = ",".join(map(str, value))
    given = re.fullmatch(r"\s*\d+\.\d+(\s*,\s*\d+\.\d+)+\s*", str(value))
    return None if given is None else re.sub(r"\s", "", str(value))


def _converted(value: Any, kind: type, base: Path) -> Value:
    """A cell's text, or a TOML value, converted to the type of the option."""
    if kind is bool:
        truth = value if isinstance(value, bool) else _TRUTHS.get(str(value).lower())
        if truth is None:
            raise ValueError(f"{value!r} is not true or false")
        return truth
    if kind is float:
        try:
            if isinstance(value, bool):
                raise ValueError
            return float(value)
        except (TypeError, ValueError):
            hint = ": write a decimal point" if re.fullmatch(r"\d+,\d+", str(value)) else ""
            raise ValueError(f"{value!r} is not a number{hint}") from None
    if kind is int:
        if not re.fullmatch(r"[1-9]\d{0,3}", str(value)):
            raise ValueError(f"{value!r} is not a whole number from 1 to 9999")
        return int(value)
    if not isinstance(value, str | PathLike):
        raise ValueError(f"{value!r} is not text")
    return _located(value, base) if kind is Path else str(value)


def _located(path: str | PathLike[str], base: Path) -> Path:
    """The path, relative ones from `base`; an address stays one."""
    return Path(path) if is_url(path) else base / os.path.expanduser(path)


def _named(rows: list[Row]) -> list[Row]:
    """Gives nameless rows the video's name, with enough folders before it to make it unique: `s01-walk`."""
    depth = [1] * len(rows)

    def name(k: int) -> str:
        row = rows[k]
        if row.name:
            return row.name
        last = row.video.name if _is_folder(row.video) else row.video.stem
        folders = row.video.parts[1:-1]
        return "-".join([*folders[len(folders) - depth[k] + 1 :], last] if depth[k] > 1 else [last])

    while True:
        alike = defaultdict(list)
        for k in range(len(rows)):
            alike[name(k).casefold()].append(k)
        deeper = [
            k
            for several in alike.values()
            if len({rows[k].video for k in several}) > 1
            for k in several
            if not rows[k].name and depth[k] < len(rows[k].video.parts) - 1
        ]
        if not deeper:
            break
        for k in deeper:
            depth[k] += 1
    return [Row(name(k), row.video, row.options, row.place, row.problems) for k, row in enumerate(rows)]


def _name_problems(rows: list[Row]) -> list[str]:
    """Reports names that cannot be a folder's, and names of several rows."""
    problems = []
    alike = defaultdict(list)
    for row in rows:
        alike[row.name.casefold()].append(row)
        unfit = re.search(r"[/\\:*?\"<>|\x00-\x1f\ud800-\udfff]", row.name) or row.name.startswith(".")
        if unfit or row.name.casefold() in TAKEN or not 0 < len(row.name.encode()) <= _LONGEST_NAME:
            problems.append(
                f"{row.place}: {row.name!r} cannot be the name of a folder here; give another name"
            )
    for several in alike.values():
        if len(several) > 1:
            others = ", ".join(row.place.rpartition(", ")[2] for row in several[1:])
            problems.append(
                f"{several[0].place}: the name {several[0].name!r} is also used in {others}; give other names"
            )
    return problems


def _checked(row: Row) -> Row:
    """The row with all errors that can be found before the video is opened."""
    problems = list(row.problems)
    if not problems:
        for check in (_check_video, _check_options):
            try:
                check(row)
            except (ValueError, OSError) as error:
                text = " ".join(str(error).split())
                for column, option in OPTIONS.items():
                    text = re.sub(rf"{option.flag}\b(?!-)", column, text)
                problems.append(f"{row.place}: {text}")
    return Row(row.name, row.video, row.options, row.place, tuple(problems))


def _check_video(row: Row) -> None:
    if not row.video.exists():
        raise ValueError(nothing_at(row.video, "video"))
    if row.video.is_dir() and "fps" not in row.options:
        raise ValueError(f"{row.video}: a folder of images has no time stamps; give fps")
    if row.video.is_file():
        if row.video.stat().st_size == 0:
            raise ValueError(f"{row.video}: the file is empty")
        with open(row.video, "rb"):
            pass


def _check_options(row: Row) -> None:
    options: dict[str, Any] = dict(row.options)
    fps = options.get("fps")
    if fps is not None and not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"fps {fps:g} is not a frame rate")
    frame_range(options.get("frames", ":"))
    if "follow" in options:
        place_in_frame(options["follow"])
    if "boxes" in options and not options["boxes"].is_file():
        raise ValueError(nothing_at(options["boxes"], "file"))
    camera = options.get("camera")
    reading = {name: options.get(f"camera_{name}") for name in ("name", "unit", "size", "v_up")}
    height = heights(str(options["height_m"])) if "height_m" in options else None
    if camera is None or options.get("fov_deg") is not None:
        tracker_options(height, camera, reading, options.get("fov_deg"))
    else:
        tracker_options(height, None, {}, None)
        _check_camera(camera, *reading.values(), camera.stat().st_mtime_ns if camera.is_file() else 0)


@cache
def _check_camera(
    camera: Path, name: str | None, unit: str | None, size: str | None, v_up: bool | None, modified_ns: int
) -> None:
    """Reads a camera once for all the rows that share it."""
    load_camera(camera, name, unit, size, v_up)


def _files(video: Path) -> list[Path]:
    """The files of a video, as far as they exist and can be accessed."""
    with contextlib.suppress(OSError, ValueError):
        return [file for file in (video.iterdir() if video.is_dir() else [video]) if file.is_file()]
    return []


def _is_folder(path: Path) -> bool:
    return os.path.isdir(path)  # unlike `Path.is_dir`, no error for an invalid file name
