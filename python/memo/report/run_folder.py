"""What `memo track` left in a folder, read for the page, with what is missing said in sentences.

The tables must be right where they are there: an error names the file. What other files would add
(`run.json`, `gait_parameters.csv`, the overlay) may be absent, as after an interrupt or from an older memo.
"""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from memo.files import read_events_csv, read_track_csv

__all__ = ["PARAMETER_COLUMNS", "RunFolder", "read_run_folder"]

PARAMETER_COLUMNS = ("walk", "parameter", "side", "value", "unit", "ci_low", "ci_high", "n")
"""Columns of `gait_parameters.csv`."""

_MOST_BYTES = 64 << 20  # run.json is a few kilobytes


@dataclass(frozen=True)
class RunFolder:
    """One run of `memo track`."""

    path: Path
    columns: dict[str, Any]
    """`track.csv`: an array per column; no rows where nobody was tracked."""
    events: list[dict[str, Any]]
    """`events.csv`."""
    parameters: list[dict[str, Any]]
    """`gait_parameters.csv`: numbers as float, None where empty."""
    run: dict[str, Any]
    """`run.json`; empty where it is not there."""
    missing: list[str]
    """Files a finished run has that are not there."""

    @property
    def overlay(self) -> Path | None:
        """The video with the model drawn on it, if there is one."""
        path = self.path / "overlay.mp4"
        return path if path.is_file() else None

    @property
    def video(self) -> Path | None:
        """The video that was tracked, as the run tells; it need not be there any more."""
        name = self.run.get("video")
        return Path(name) if name else None

    @property
    def first_frame(self) -> int:
        """Number in the video of the first frame the run read."""
        frames = self.run.get("frames")
        return int(frames[0]) if frames else 0

    @property
    def name(self) -> str:
        """What the run is called: the video's name, else the folder's."""
        return self.video.name if self.video else self.path.resolve().name


def read_run_folder(folder: Path) -> RunFolder:
    """Reads a folder of `memo track`; ValueError names the file that cannot be used."""
    missing = []

    def read(name: str, reader: Any, instead: Any) -> Any:
        path = folder / name
        if not path.is_file():
            missing.append(name)
            return instead
        try:
            return reader(path)
        except (ValueError, OverflowError, csv.Error, RecursionError) as error:
            told = str(error) if str(path) in str(error) else f"{path}: {error}"
            raise ValueError(told) from None

    return RunFolder(
        path=folder,
        columns=read("track.csv", read_track_csv, {}),
        events=read("events.csv", read_events_csv, []),
        parameters=read("gait_parameters.csv", _read_parameters, []),
        run=read("run.json", _read_run, {}),
        missing=missing,
    )


def _read_parameters(path: Path) -> list[dict[str, Any]]:
    with open(path, newline="", encoding="utf-8") as file:
        table = csv.DictReader(file)
        absent = set(PARAMETER_COLUMNS) - set(table.fieldnames or ())
        if absent:
            raise ValueError(f"{path}: columns missing: {sorted(absent)}")
        return [_parameter(path, table.line_num, row) for row in table]


def _parameter(path: Path, line: int, row: dict[str, str]) -> dict[str, Any]:
    parameter: dict[str, Any] = {name: row[name] or "" for name in PARAMETER_COLUMNS}
    for name in ("value", "ci_low", "ci_high", "n"):
        try:
            parameter[name] = float(parameter[name]) if parameter[name] else None
        except ValueError:
            raise ValueError(f"{path}: line {line}: {name} {parameter[name]!r} is not a number") from None
    return parameter


def _read_run(path: Path) -> dict[str, Any]:
    if path.stat().st_size > _MOST_BYTES:
        raise ValueError(f"{path}: {path.stat().st_size} bytes are no run.json")
    run = json.loads(path.read_text(encoding="utf-8"))
    if not isinstance(run, dict):
        raise ValueError(f"{path}: not an object")
    expected = {
        "video": str,
        "frames": list,
        "camera": dict,
        "options": dict,
        "summary": dict,
        "sentences": list,
    }
    for name, kind in expected.items():
        if not isinstance(run.get(name, None), kind | None):
            raise ValueError(f"{path}: {name} is {json.dumps(run[name])[:40]}")
    frames = run.get("frames")
    if frames is not None and not (frames and isinstance(frames[0], int)):
        raise ValueError(f"{path}: frames is {json.dumps(frames)[:40]}, not [first, stop]")
    return run
