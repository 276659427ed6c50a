"""Finds postures of drawn walks with the body height, and with what `memo track` found in the same video.

    python tests/score_tracked.py [--only PATTERN] [--clips DIR]

Keypoints are the true joints in the image with independent noise of `NOISE_PX` in each coordinate, and no
toes. One row per clip and way, in cm: `absolute`, the mean distance of the 14 smoothed joints from where they
are; `relative`, that of the 13 joints other than the neck, relative to the neck; `bias` and `rms` of the
neck's distance, mean and root mean square over the frames; `sd`, as stated. Then the means over the clips of
people that memo is tuned on and of the others (the RMS of `bias` over the clips, as a bias has a sign).

Clips without a walk that `memo track` finds have one row.

Cannot do: keypoints of a detector, several people.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import memo
import numpy as np
import score_postures
import score_walks
import truth as gt
from memo.keypoints import Keypoints

NOISE_PX = 1.5
CODES = {code: name for code, name in score_postures.CODES.items() if not code.endswith("TO")}
WAYS = ("height", "track")
COLUMNS = ("absolute", "relative", "bias", "rms", "sd")


@dataclass(frozen=True)
class Row:
    """What one way finds in a clip, cm."""

    clip: score_walks.ClipScore
    way: str
    values: tuple[float, ...]


def rows_of(clip: score_walks.Clip) -> Iterator[Row]:
    """A row for each way that works."""
    named = score_walks.ClipScore(clip.name, 0.0, 0)
    camera_file = clip.folder / "camera.toml"
    camera, truth = memo.Camera.from_toml(camera_file), gt.read_columns(clip.folder / "truth.csv")
    figures = score_postures.stick({CODES[code]: gt.points(truth, f"{code}_") for code in CODES})
    keypoints = _keypoints(clip.name, truth, camera)
    with tempfile.TemporaryDirectory() as out:
        command = [str(Path(sys.executable).with_name("memo")), "track", str(clip.folder / "video.mp4")]
        command += ["--height", str(clip.height_m), "--camera", str(camera_file), "--out", f"{out}/track"]
        subprocess.run([*command, "--no-overlay", "--no-plots", "--quiet"], check=True)
        for way in WAYS:
            given = (
                {"height_m": clip.height_m, "camera": camera}
                if way == "height"
                else {"track": f"{out}/track"}
            )
            try:
                postures = memo.posture(keypoints, **given, noise_px=NOISE_PX, unswap=False, max_groups=1)
            except ValueError as error:
                print(f"{clip.name}, {way}: {error}", file=sys.stderr)
                continue
            yield Row(named, way, errors_cm(postures, figures, camera))


def _keypoints(name: str, truth: gt.Columns, camera: memo.Camera) -> Keypoints:
    """The true joints with noise. Frame numbers are those of the video: the walk's times are compared."""
    first = int(truth["frame"][0])
    step_s = float(np.median(np.diff(truth["time_s"]) / np.diff(truth["frame"])))
    pixels = np.full((int(truth["frame"][-1]) + 1, len(CODES), 2), np.nan)
    random = np.random.default_rng(zlib.crc32(name.encode()))
    seen = camera.project(np.stack([gt.points(truth, f"{code}_") for code in CODES], axis=1))
    pixels[truth["frame"].astype(int)] = seen + random.normal(0.0, NOISE_PX, seen.shape)
    times_s = truth["time_s"][0] + (np.arange(len(pixels)) - first) * step_s
    return Keypoints.from_arrays(pixels, names=list(CODES.values()), times_s=times_s, image_size=camera.size)


def errors_cm(postures: memo.Postures, figures: np.ndarray, camera: memo.Camera) -> tuple[float, ...]:
    """The figures of `COLUMNS`; `figures` are those of the last frames."""
    found = postures.found[-len(figures) :]
    smooth, true = postures.smoothed_m[-len(figures) :][found], figures[found]
    off = smooth - true
    relative = np.linalg.norm(off - off[:, :1], axis=-1)[:, 1:]
    away = postures.anchor_m[-len(figures) :][found] - np.linalg.norm(true[:, 0] - camera.position, axis=-1)
    sd = postures.anchor_sd_m[-len(figures) :][found]
    absolute = np.linalg.norm(off, axis=-1)
    means = [np.nanmean(values) for values in (absolute, relative, away)]
    return tuple(100.0 * float(value) for value in (*means, np.sqrt(np.nanmean(away**2)), np.nanmean(sd)))


def pooled(rows: Sequence[Row]) -> tuple[float, ...]:
    """Means over the clips; of biases the root mean square."""
    values = np.array([row.values for row in rows])
    means = values.mean(axis=0)
    means[2] = np.sqrt(np.mean(values[:, 2] ** 2))
    return tuple(means.tolist())


def main() -> int:
    """Prints the table as it grows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", metavar="PATTERN", default="", help="clips whose name has this (regex)")
    parser.add_argument("--clips", type=Path, metavar="DIR", help="other clips, listed in DIR/clips.csv")
    args = parser.parse_args()
    clips = score_walks.clips_of(args.clips) if args.clips else score_walks.shared_clips()
    print(f"{'clip':24}{'way':8}" + "".join(f"{name:>10}" for name in COLUMNS))
    rows: list[Row] = []
    for clip in (clip for clip in clips if re.search(args.only, clip.name)):
        for row in rows_of(clip):
            rows.append(row)
            print(_line(clip.name, row.way, row.values), flush=True)
    for people in score_walks.PEOPLE:
        for way in WAYS:
            own = [row for row in rows if row.clip.people == people and row.way == way]
            if own:
                print(_line(f"{people} ({len(own)})", way, pooled(own)))
    return 0


def _line(name: str, way: str, values: Sequence[float]) -> str:
    return f"{name:24}{way:8}" + "".join(f"{value:10.1f}" for value in values)


if __name__ == "__main__":
    sys.exit(main())
