"""
Why this phase?
===============

`memo.explain` computes again what the tracker saw in a frame of a finished run, and holds it against the
model: which contours are supported by the image, and how well every other phase would have done.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import memo
import numpy as np
from matplotlib.collections import LineCollection
from memo.explain import explain
from memo.run import Source, write_run
from memo.video import VideoReader

# %%
# A run: here of a drawn person, whose frames are written as a folder of images. `memo track` leaves
# such a folder of results; for that, nothing of this block is needed.

scene = memo.demo_scene(seed=0)
folder = Path(tempfile.mkdtemp())
images, results = folder / "images", folder / "results"
images.mkdir()
results.mkdir()
for index, frame in enumerate(scene.frames):
    plt.imsave(images / f"{index:03d}.png", frame, cmap="gray", vmin=0, vmax=255)
rate_hz = 1 / (scene.times_s[1] - scene.times_s[0])
options = {"height_m": scene.height_m, "camera": scene.camera}
tracker = memo.Tracker(**options)
with VideoReader(images, rate_hz=rate_hz) as video:
    for frame in video:
        tracker.update(frame.luma, frame.time_s)
track = tracker.finish()
source = Source(images, (0, None), rate_hz, fps_given=rate_hz, camera_given=True)
write_run(results, track, {"height_m": scene.height_m}, source, len(scene.frames))

# %%
# One frame of it.

(why,) = explain(results, [44])
print(f"frame {why.frame}: phase {why.phase:.2f}, similarity {why.chosen_similarity:.2f}")
print(f"half a cycle on: similarity {why.twin_similarity:.2f}")

# %%
# Contours by how well an image edge supports them, and the similarity of every phase at the same place.

fig, (picture, curve) = plt.subplots(1, 2, figsize=(9, 4.5), width_ratios=[1, 1.4], layout="constrained")
picture.imshow(why.luma, cmap="gray", vmin=0, vmax=255)
lines = LineCollection(why.model, cmap="RdYlGn", array=why.matched, linewidths=2.2, clim=(0, 1))
picture.add_collection(lines)
left, top, right, bottom = why.window_px
picture.set(xlim=(left, right), ylim=(bottom, top), title="model contours")
picture.set_axis_off()
fig.colorbar(lines, ax=picture, label="supported by an image edge", orientation="horizontal", shrink=0.7)
curve.plot(why.phase_grid, why.similarity)
curve.axvline(why.phase, color="tab:green", label="chosen")
curve.axvline(why.twin_phase, color="tab:green", ls=":", label="half a cycle on")
true = scene.truth["phase"][np.searchsorted(scene.truth["frame"], why.frame)]
curve.plot(true, why.chosen_similarity, "k+", ms=10, label="true phase")
curve.set(xlabel="gait phase", ylabel="similarity, eq. (11)")
curve.legend()
