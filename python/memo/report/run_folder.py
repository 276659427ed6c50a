"""Reads a folder of `memo track` for the page; sentences report what is missing.

The tables must be valid if they exist: an error names the file. Additional files
(`run.json`, `gait_parameters.csv`, the overlay) may be absent, as in the folder of an older memo.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from memo.cycles import read_cycles_csv
from memo.files import read_events_csv, read_track_csv
from memo.gait import read_gait_parameters_csv
from memo.run import read_run
from memo.wording import counted

__all__ = ["RunFolder", "read_run_folder"]


@dataclass(frozen=True)
class RunFolder:
    """One run of `memo track`."""

    path: Path
    columns: dict[str, Any]
    """`track.csv`: one array per column; no rows if nobody was tracked."""
    events: list[dict[str, Any]]
    """`events.csv`."""
    parameters: dict[str, Any]
    """`gait_parameters.csv`: one array per column; empty if the file is missing."""
    cycles: dict[str, Any]
    """`cycles.csv`: one array per column; empty if the file is missing."""
    run: dict[str, Any]
    """`run.json`; empty if it is missing."""
    missing: list[str]
    """Files of a run that are missing."""
    video: Path | None
    """The video that was tracked, named by the run or the user; it may no longer exist."""

    @property
    def overlay(self) -> Path | None:
        """The video with the model drawn on it, if there is one."""
        path = self.path / "overlay.mp4"
        return path if path.is_file() else None

    @property
    def frames(self) -> list[int]:
        """Number in the video of the frame of each row."""
        return [int(frame) for frame in self.columns["frame"]]

    @property
    def people(self) -> dict[int, list[int]]:
        """The numbers of each person's walks, by the number of the person."""
        walks = zip(self.columns["person"], self.columns["walk"], strict=True)
        people: dict[int, list[int]] = {}
        for person, walk in sorted({(int(person), int(walk)) for person, walk in walks}):
            people.setdefault(person, []).append(walk)
        return people

    def walk_of(self, event: Mapping[str, Any]) -> int:
        """Number of the walk of an event; in tables without it, that of the nearest tracked frame."""
        nearest = np.argmin(np.abs(self.columns["frame"] - event["frame"]))
        return int(event.get("walk", self.columns["walk"][nearest]))

    def fit(self, walk: int) -> dict[str, Any]:
        """What `run.json` says of the fit of the person; nothing in results of older versions."""
        walks = self.run.get("walks") or []
        fit = walks[walk].get("fit") if 0 <= walk < len(walks) else None
        return fit if isinstance(fit, dict) else {}

    def p_other_heading(self, walk: int) -> float:
        """The probability that a walk on a treadmill has the mirrored heading; 0 where there is none."""
        walks = self.run.get("walks") or []
        known = walks[walk].get("p_other_heading") if 0 <= walk < len(walks) else None
        return float(known or 0.0)

    def verdict(self, walk: int) -> str | None:
        """How well the model fits the person: `well`, `in part`, `poorly` or `not measured`; None in results
        of older versions."""
        fit = self.fit(walk)
        if not fit:
            return None
        return str(fit.get("fits")) if fit.get("measured") else "not measured"

    @property
    def first_frame(self) -> int:
        """Number in the video of the first frame the run read."""
        return int(self.run["frames"][0]) if self.run else 0

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the video, pixels, if the run has a camera."""
        camera = self.run.get("camera") or {}
        size = camera.get("size")
        return (int(size[0]), int(size[1])) if size else None

    @property
    def name(self) -> str:
        """Name of the run: the video's name, else the folder's."""
        return self.video.name if self.video else self.path.resolve().name


def read_run_folder(folder: Path, video: Path | None = None) -> RunFolder:
    """Reads a folder of `memo track`; `video` is the path of its video, if not that in `run.json`.

    ValueError names the file that cannot be used.
    """
    missing = []

    def read(name: str, reader: Callable[[Path], Any], instead: Any) -> Any:
        path = folder / name
        if not path.is_file():
            missing.append(name)
            return instead
        try:
            return reader(path)
        except (ValueError, OverflowError) as error:
            raise ValueError(str(error) if str(path) in str(error) else f"{path}: {error}") from None

    columns = read("track.csv", read_track_csv, {})
    run = read("run.json", lambda path: _checked(path, read_run(path.parent)), {})
    return RunFolder(
        path=folder,
        columns=columns,
        events=read("events.csv", read_events_csv, []),
        parameters=read("gait_parameters.csv", read_gait_parameters_csv, {}),
        cycles=read("cycles.csv", read_cycles_csv, {}),
        run=run,
        missing=missing,
        video=video if video is not None or not run.get("video") else Path(run["video"]),
    )


def _checked(path: Path, run: dict[str, Any]) -> dict[str, Any]:
    """Checks the camera of a run, which the page draws."""
    camera = run["camera"] or {}
    for name, count in (("size", 2), ("rotation", 3), ("translation", 3)):
        values = camera.get(name, [0] * count)
        numbers = isinstance(values, list) and all(isinstance(value, int | float) for value in values)
        if not numbers or len(values) != count:
            raise ValueError(
                f"{path}: camera {name} must be {counted(count, 'number')}, got {str(values)[:60]}"
            )
    return run
