"""`memo demo`: draws a person with known motion, tracks it and compares.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import memo
from memo.cli.delivery import Delivery, Interrupt, guarded, with_steps
from memo.cli.track import deliver_interrupted, report
from memo.exits import Exit
from memo.files import JOINTS
from memo.given import check_writable
from memo.recording import Recorded, draw_overlay, draw_plots, follow, write_tables
from memo.run import Source
from memo.wording import counted

if TYPE_CHECKING:
    import typer

    from memo.video import Frame

EPILOG = """Examples:
  memo demo
  memo demo --seed 3 --out another
  memo demo --json

Exit codes: 0 the person was tracked; 1 the results cannot be written; 2 wrong usage; \
3 nobody was tracked; 4 the app extra is not installed; 130 interrupted \
(what was tracked until then is written)."""


#: A heel strike farther from the drawn one counts as missed: about a sixth of a cycle, seconds.
NEAR_S = 0.15


def add_demo(app: "typer.Typer") -> None:
    import typer

    @app.command(epilog=EPILOG)
    def demo(
        seed: Annotated[int, typer.Option(help="Seed of the drawn scene.", min=0)] = 0,
        out: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("memo-out/demo"),
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Draws a person whose motion is known, tracks the person and compares."""
        delivery = Delivery(out, as_json=as_json, quiet=quiet)
        raise typer.Exit(guarded(lambda: _demo(delivery, seed)))


def _demo(delivery: Delivery, seed: int) -> Exit:
    check_writable(delivery.out)
    scene, frames = _draw_scene(seed)
    tracker = memo.Tracker(height_m=scene.height_m, camera=scene.camera)
    rate_hz = 1 / float(np.median(np.diff(scene.times_s)))
    source = Source(None, (0, None), rate_hz, camera_given=True)
    with with_steps(delivery) as progress:
        recorded = follow(frames, tracker, source, delivery.out, len(frames), progress, Interrupt())
        write_tables(recorded, delivery.out)
        if not recorded.interrupted:
            draw_overlay(recorded, delivery.out, frames, len(frames), progress=progress)
            draw_plots(recorded, delivery.out)
    if recorded.interrupted:
        return deliver_interrupted(recorded, delivery)
    differences = from_truth(recorded.columns, scene.truth) | strikes_from_truth(recorded, scene.events)
    report(recorded, delivery, {"rms_from_truth": differences})
    if delivery.talks:
        for line in _described(differences):
            print(line)
        print("Next, your own video of one person walking across the picture, camera on a tripod:")
        print("  memo track VIDEO --height 1.75")
    return recorded.exit


def _draw_scene(seed: int) -> tuple[Any, "list[Frame]"]:
    from memo.video import Frame

    scene = memo.demo_scene(seed=seed)
    timed = zip(scene.times_s, scene.frames, strict=True)
    return scene, [Frame(index, float(time_s), luma) for index, (time_s, luma) in enumerate(timed)]


def from_truth(columns: dict[str, Any], truth: dict[str, Any]) -> dict[str, float]:
    """Root mean square differences from the scene's truth over all tracked frames; empty if none."""
    rows = np.searchsorted(truth["frame"], columns["frame"])
    if not len(rows):
        return {}

    def rms(names: Iterable[str]) -> float:
        return math.sqrt(np.nanmean([(columns[name] - np.asarray(truth[name])[rows]) ** 2 for name in names]))

    phase = (columns["phase"] - np.asarray(truth["phase"])[rows] + 0.5) % 1 - 0.5
    return {
        "frames": len(rows),
        **{name: rms([name]) for name in ("x_m", "y_m", "z_m")},
        "phase": math.sqrt(np.mean(phase**2)),
        "hips_and_knees_deg": rms(
            f"{side}_{joint}_deg" for side in ("right", "left") for joint in ("hip", "knee")
        ),
        "joints_m": math.sqrt(3) * rms(f"{joint}_{axis}_m" for joint in JOINTS for axis in "xyz"),
    }


def strikes_from_truth(recorded: Recorded, drawn: dict[str, Any]) -> dict[str, float]:
    """Heel strikes drawn while the person was tracked, how many of them were found within `NEAR_S`, and the
    root mean square difference of these in seconds; empty if nobody was tracked or no heel strike drawn."""
    times_s = recorded.columns["time_s"]
    if not len(times_s):
        return {}
    is_strike = (
        (drawn["event"] == "heel_strike") & (drawn["time_s"] >= times_s[0]) & (drawn["time_s"] <= times_s[-1])
    )
    nearest = []
    for time_s, side in zip(drawn["time_s"][is_strike], drawn["side"][is_strike], strict=True):
        found = [e["time_s"] for e in recorded.events if e["event"] == "heel_strike" and e["side"] == side]
        nearest.append(min((abs(other - time_s) for other in found), default=math.inf))
    near = [difference for difference in nearest if difference <= NEAR_S]
    if not nearest:
        return {}
    figures = {"heel_strikes": len(nearest), "heel_strikes_found": len(near)}
    return figures | ({"heel_strike_s": math.sqrt(np.mean(np.square(near)))} if near else {})


def _described(differences: dict[str, float]) -> list[str]:
    """Reports the differences in sentences."""
    if not differences:
        return []
    torso = ", ".join(f"{axis} {100 * differences[f'{axis}_m']:.1f} cm" for axis in "xyz")
    phase, angles = differences["phase"], differences["hips_and_knees_deg"]
    lines = [
        f"Against the drawn truth, root mean square over {counted(differences['frames'], 'frame')}:",
        f"  torso {torso}",
        f"  phase {phase:.3f} of a cycle, hips and knees {angles:.1f} degrees",
        f"  joints {100 * differences['joints_m']:.1f} cm in space",
    ]
    if "heel_strike_s" in differences:
        found, drawn = differences["heel_strikes_found"], differences["heel_strikes"]
        off_ms = 1e3 * differences["heel_strike_s"]
        lines.append(f"  {found} of {counted(drawn, 'heel strike')} found, {off_ms:.0f} ms off")
    return lines
