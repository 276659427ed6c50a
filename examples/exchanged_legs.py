"""
Exchanged legs
==============

Keypoint detectors take the left leg for the right one now and then. `memo.unswap` finds where, from the
motion of the points alone, and says what it did in every frame.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import memo
import numpy as np

# %%
# A walker seen from the side, with one pixel of noise. In frames 40 to 55 the labels of the legs are
# exchanged.

walker = memo.walker_motion(120, rate_hz=60, height_m=1.75)
camera = memo.Camera.level((1280, 960), 60, 1.2, 4.0)
points_px = np.stack([camera.project(joints) for joints in walker.positions])
points_px += np.random.default_rng(0).normal(0, 1, points_px.shape)
names = list(walker.names)
right, left = ([names.index(side + joint) for joint in ("HP", "KN", "AN")] for side in "RL")
points_px[40:56, right + left] = points_px[40:56, left + right]

folder = Path(tempfile.mkdtemp())
header = ",".join(f"{name}_x,{name}_y" for name in names)
rows = np.column_stack([walker.times_s, points_px.reshape(len(points_px), -1)])
np.savetxt(folder / "joints.csv", rows, delimiter=",", header="time_s," + header, comments="", fmt="%.5f")

# %%
# Nothing is moved or made up: only the labels of pairs are exchanged.

given = memo.read_keypoints(folder / "joints.csv")
repair = memo.unswap(given)
exchanged = sorted({flip["frame"] for flip in repair.flips if flip["verdict"] == "flipped"})
print(f"exchanged: {exchanged}")
print(repair.flips[0]["reason"])

# %%
ankle = given.names.index("right_ankle")
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.plot(given.frames, given.points[:, ankle, 0], color="0.7", lw=4, label="as labelled by the detector")
ax.plot(given.frames, repair.keypoints.points[:, ankle, 0], label="after memo.unswap")
ax.set(xlabel="frame", ylabel="right ankle, u [px]")
ax.legend()
