"""
A camera from measured points
=============================

Six points whose places were measured, on the floor and above it, and where the picture shows them: that fixes
the camera. `memo calibrate points` does the same from a table, and `memo calibrate walker` from a person of
known height who walks about.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import memo
import numpy as np

# %%
# Eight points: corners of a mat on the floor and tops of poles. The camera is known here, to compare with.

true = memo.Camera.level((1280, 720), 60, 1.2, 5.0)
mat = [[x, y, 0.0] for x in (-1.5, 1.5) for y in (-0.5, 1.5)]
poles = [[x, y, 1.6] for x in (-1.5, 1.5) for y in (-0.5, 1.5)]
places = np.array(mat + poles)
pixels = true.project(places) + np.random.default_rng(0).normal(0, 0.5, (len(places), 2))

# %%
# The fit says how far off the points are, in pixels, and leaves out what chance would not put there.

found = memo.calibrate_points(places, pixels, (1280, 720))
camera = found.camera
print(f"reprojection error {found.rms_px:.2f} px; left out: {len(found.outliers)}")
print("camera at", np.round(camera.position, 2), "m; truly at", np.round(true.position, 2))

# %%
# What the error means on the ground: a person's place, found with this camera, against the truth.

grid = np.array([[x, y, 0.0] for x in np.linspace(-2, 2, 9) for y in np.linspace(-1, 4, 11)])
seen = true.project(grid)
inside = np.isfinite(seen).all(axis=1)
error_m = camera.ground_points(seen[inside]) - grid[inside]
fig, ax = plt.subplots(figsize=(7, 4.2), layout="constrained")
ax.quiver(*grid[inside, :2].T, *(20 * error_m[:, :2]).T, angles="xy", scale_units="xy", scale=1, width=0.003)
ax.plot(*places[:, :2].T, "s", color="tab:orange", label="measured points, from above")
ax.set(xlabel="x [m]", ylabel="y, away from the camera [m]", title="error on the ground, 20 times enlarged")
ax.legend(loc="lower right")
print(f"on the ground: median error {100 * np.median(np.linalg.norm(error_m, axis=1)):.1f} cm")

# %%
# Written for `memo track --camera`, as Pose2Sim and anipose read it, too.

file = Path(tempfile.mkdtemp()) / "camera.toml"
camera.to_toml(file)
print(file.read_text())
