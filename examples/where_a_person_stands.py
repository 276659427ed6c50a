"""
Where a person stands
=====================

A calibrated camera, the rectangle around a person and the person's height give the position in 3D (Rohr 1994,
eqs. 2 to 6). How well depends on what the depth hangs on.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import memo
import numpy as np

# %%
# Calibrations are read from TOML as Pose2Sim and anipose write it.

calibration = Path(tempfile.mkdtemp()) / "camera.toml"
calibration.write_text(
    """
[cam]
name = "cam"
size = [1280, 720]
matrix = [[1000.0, 0.0, 639.5], [0.0, 1000.0, 359.5], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0]
rotation = [1.570796327, 0.0, 0.0]
translation = [0.0, 1.2, 5.0]
"""
)
camera = memo.Camera.from_toml(calibration)
print("camera at", np.round(camera.position, 3))

# %%
# A person of 1.75 m stands on a few places. The rectangle's bottom edge is read with two pixels of error, its
# top with six: hair, a hat, a bent head.

rng = np.random.default_rng(0)
places = np.array([[x, y, 0.0] for x in (-1.5, 0.0, 1.5) for y in (-0.5, 1.0, 3.0)])
fig, ax = plt.subplots(figsize=(7, 4.5), layout="constrained")
for place in places:
    ends = camera.project(np.array([place, place + np.array([0, 0, 1.75])]))
    for _ in range(40):
        bottom, top = ends + rng.normal(0, 1, (2, 2)) * [[2], [6]]
        by_height = camera.position_from_rectangle(tuple(bottom), tuple(top), 1.75)
        by_ground = camera.position_on_ground(tuple(bottom), tuple(top), 1.75)
        ax.plot(*by_height[:2], ".", color="tab:orange", ms=4)
        ax.plot(*by_ground[:2], ".", color="tab:blue", ms=4)
ax.plot(*places[:, :2].T, "+", color="k", ms=10)
ax.plot([], [], ".", color="tab:orange", label="from the rectangle's height, eq. (6)")
ax.plot([], [], ".", color="tab:blue", label="with the soles on the ground")
ax.set(xlabel="x [m]", ylabel="y, away from the camera [m]", aspect="equal")
fig.legend(loc="outside right upper")
