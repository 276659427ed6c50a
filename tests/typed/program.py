"""A program as users write it; a test has it checked by pyright in its strict mode."""

from pathlib import Path

import memo
import numpy as np
import numpy.typing as npt
from memo.files import read_events_csv, read_track_csv, write_events_csv, write_track_csv


def knee_range(track: memo.Track) -> float:
    """Flexion of the right knee from least to most, degrees."""
    knee: npt.NDArray[np.float64] = track.columns["right_knee_deg"]
    return float(np.ptp(knee))


def shown(done: int, total: int | None) -> None:
    print(f"{done} of {total}")


def main(out: Path) -> None:
    scene = memo.demo_scene(0, progress=shown)
    tracker = memo.Tracker(scene.height_m, scene.camera)
    for frame, time_s in zip(scene.frames, scene.times_s.tolist(), strict=True):
        state = tracker.update(frame, time_s)
        if state is not None:
            print(f"x = {state.x_m:.2f} m")
    track = tracker.finish()
    print(track, knee_range(track), track.summary["message"], [event["side"] for event in track.events])
    write_track_csv(out / "track.csv", track.columns)
    write_events_csv(out / "events.csv", track.events)
    assert len(read_track_csv(out / "track.csv")["frame"]) == len(track)
    assert len(read_events_csv(out / "events.csv")) == len(track.events)

    mask = memo.change_mask(scene.frames[0], scene.frames[1])
    regions = memo.moving_regions(mask)
    edges = memo.edge_segments(scene.frames[0], mask)
    print(int(mask.sum()), regions.shape, edges.shape)

    camera = memo.Camera.level((1280, 720), 60.0, 1.2, 4.0)
    walk = memo.walker_motion(60, rate_hz=30.0)
    dots = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30.0)
    figure = memo.planar(dots.positions_px, dots.times_s)
    for a, b, length_px, confidence, windows, verdict in figure.links():
        print(
            figure.points.names[a] if figure.points else a,
            b,
            f"{length_px:.0f} {confidence:.2f} {windows} {verdict}",
        )

    layouts: dict[str, tuple[str, ...]] = memo.layouts()
    keypoints = memo.read_keypoints(out / "keypoints", layout=next(iter(layouts)), fps=25.0)
    postures = memo.posture(memo.unswap(keypoints).keypoints, camera, height_m=1.75, progress=shown)
    print(postures.survivors.tolist(), postures.smoothed_m.shape, postures.second, postures.warnings)
