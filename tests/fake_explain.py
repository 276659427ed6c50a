"""A stand-in for `memo.explain.explain`: what was seen in a frame is planted, not found."""

from types import SimpleNamespace

import numpy as np
from memo.files import read_track_csv

SIZE = (64, 48)


def explain(run_folder, frames=None, progress=None, *, video=None):
    """A box for a model, and everything about it known."""
    width, height = SIZE
    chosen = read_track_csv(run_folder / "track.csv")["frame"] if frames is None else frames
    for frame in chosen:
        left, right = 10.0 + frame, 20.0 + frame
        model = np.array([[[left, 10], [left, 40]], [[right, 10], [right, 40]]])
        mask = np.zeros((height, width), bool)
        mask[12:38, int(left) : int(right)] = True
        yield SimpleNamespace(
            frame=int(frame),
            time_s=frame / 25,
            walk=0,
            luma=np.tile(np.arange(0, 4 * width, 4, dtype=np.uint8), (height, 1)),
            change_mask=mask,
            edge_points=np.array([[left, v] for v in range(12, 38)] + [[-3.0, 5.0], [1000.0, 5.0]]),
            segments=np.array([[[left, 12], [left, 38]], [[0, 0], [1, 0]]]),
            model=model,
            model_part=np.array([8, 11], np.uint8),
            matched=np.array([0.75, np.nan]),
            matched_edges=model[:1],
            phase_grid=np.linspace(0, 1, 20, endpoint=False),
            similarity=np.cos(np.linspace(0, 6, 20)) ** 2,
            phase=0.3,
            shrink=1,
        )
