"""
Similarity over the gait cycle
==============================

Rohr (1994, Fig. 19) holds the position fixed and asks for every gait phase how well the model's contours fit
the edges of one frame. The curve has two high places half a cycle apart: from the side, left and right look
alike.
"""

import matplotlib.pyplot as plt
import memo
import numpy as np
from memo.plot import plot_start

scene = memo.demo_scene(seed=0)
track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)

# %%
# `Track.start` keeps the curves of the starting frames: `similarity` is (frames, phases).

start = track.start
phases = np.arange(start.similarity.shape[1]) / start.similarity.shape[1]
frame = 6
true_phase = scene.truth["phase"][np.searchsorted(scene.truth["frame"], start.frame[frame])]

fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
ax.plot(phases, start.similarity[frame])
ax.axvline(true_phase, color="tab:green", label="true phase")
ax.axvline((true_phase + 0.5) % 1, color="tab:green", ls=":", label="half a cycle away")
ax.set(xlabel="gait phase", ylabel="similarity, eq. (11)", title=f"frame {start.frame[frame]}")
ax.legend()

# %%
# One frame cannot decide between the two. Phase grows steadily, so over the starting frames the best phases
# lie on a line and on its twin; memo follows both and says how likely it is that the sides are interchanged.

fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
plot_start(ax, track)
print(f"probability that left and right are interchanged: {track.summary['p_swapped']:.3f}")

# %%
# Eq. (7) itself is a function, too: model lines and image edges in, overlap, distance and angle of each match
# out.

model_line = np.array([[[100.0, 50.0], [100.0, 150.0]]])
image_edge = np.array([[[104.0, 60.0], [106.0, 160.0]]])
similarity, matches = memo.similarity(model_line, image_edge)
_, _, overlap_px, distance_px, angle_rad = matches[0][:5]
print(f"similarity {similarity:.3f}")
print(f"overlap {overlap_px:.1f} px, distance {distance_px:.1f} px, angle {angle_rad:.3f} rad")
