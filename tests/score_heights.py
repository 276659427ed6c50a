"""Tracks every drawn walk with a height that is wrong, or without one, and tells what memo says of it.

    python tests/score_heights.py [--times 0.9 1.1 ...] [--only PATTERN] [--clips DIR] [--rows]

`--times` multiplies the true height; 0 stands for no height. Per factor: in how many of the clips that are
measured the height is contradicted, and how far the measured height is from the true one.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import re
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from score_walks import HALF_WIDTH_SD, Clip, clips_of, shared_clips, track_video


@dataclass(frozen=True)
class Said:
    """What memo says of the height of a clip."""

    clip: Clip
    walks: int
    is_contradicted: bool
    height_m: float
    sd_m: float

    @property
    def error_cm(self) -> float:
        """Measured minus true, `nan` if nothing was measured."""
        return 100.0 * (self.height_m - self.clip.height_m)


def track(clip: Clip, times: float) -> Said:
    """What memo says of the longest walk of a clip."""
    import memo

    camera = memo.Camera.from_toml(clip.folder / "camera.toml")
    given = clip.height_m * times if times else None
    return said_of(clip, track_video(clip.folder / "video.mp4", given, camera))


def said_of(clip: Clip, found: Any) -> Said:
    """What a track says of its longest walk."""
    rows = found.columns["walk"].tolist() if found.walks else []
    longest = max(range(len(found.walks)), key=rows.count, default=None)
    walk = None if longest is None else found.walks[longest]
    seen = walk.measured_height if walk else None
    return Said(
        clip,
        len(found.walks),
        walk is not None and walk.height_is_contradicted,
        seen.height_m if seen else math.nan,
        seen.sd_m if seen else math.nan,
    )


def report(times: float, said: Sequence[Said]) -> str:
    """One line for a factor."""
    label = f"{times:g} times the height" if times else "without a height"
    named = [row for row in said if math.isfinite(row.height_m)]
    if not named:
        return f"{label}: measured in 0 of {len(said)} clips"
    errors = [row.error_cm for row in named]
    rms = math.sqrt(sum(e * e for e in errors) / len(errors))
    worst = max(errors, key=abs)
    within = sum(abs(row.error_cm) <= 100.0 * HALF_WIDTH_SD * row.sd_m for row in named)
    contradicted = sum(row.is_contradicted for row in named)
    return (
        f"{label}: measured in {len(named)} of {len(said)} clips, contradicted in {contradicted}; "
        f"measured minus true {sum(errors) / len(errors):+.1f} cm, rms {rms:.1f}, worst {worst:+.1f}; "
        f"within 1.64 sd {within}"
    )


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--times", type=float, nargs="+", default=[0.9, 0.95, 1.0, 1.05, 1.1, 0.0])
    parser.add_argument("--only", default="", metavar="PATTERN", help="clips whose names contain it")
    parser.add_argument("--clips", type=Path, metavar="DIR", help="other clips, listed in DIR/clips.csv")
    parser.add_argument("--rows", action="store_true", help="every clip too")
    args = parser.parse_args()
    clips = clips_of(args.clips) if args.clips else shared_clips()
    clips = [clip for clip in clips if re.search(args.only, clip.name)]
    # The tracker has threads of its own: a forked copy of them would wait for ever.
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        for times in args.times:
            said = list(pool.map(track, clips, [times] * len(clips)))
            print(report(times, said), flush=True)
            for row in said if args.rows else ():
                print(
                    f"  {row.clip.name:24} {row.walks} walks, {row.error_cm:+5.1f} cm +- {100 * row.sd_m:.1f}"
                    f"{', contradicted' if row.is_contradicted else ''}"
                )


if __name__ == "__main__":
    main()
