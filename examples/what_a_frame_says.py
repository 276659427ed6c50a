"""
What one frame says
===================

Every step from grey values to a match can be looked at: what changed, where the moving region is, which
straight edges it has, and which of them answer a contour of the model.
"""

import matplotlib.pyplot as plt
import memo
import numpy as np
from matplotlib.collections import LineCollection

scene = memo.demo_scene(seed=0)
track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
row = 40
frame = int(track.columns["frame"][row])
before, now, after = scene.frames[frame - 1 : frame + 2]

# %%
# **Change** (eq. 1): a pixel changed if the second-order fits of its 5x5 window differ from those of the
# frame before or after by more than a threshold, which follows from the noise.

mask = memo.change_mask(now, before) | memo.change_mask(now, after)
left, top, right, bottom, area = memo.moving_regions(mask)[0]

fig, axes = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
axes[0].imshow(now, cmap="gray", vmin=0, vmax=255)
axes[1].imshow(mask, cmap="gray")
axes[1].add_patch(plt.Rectangle((left, top), right - left, bottom - top, fill=False, ec="tab:orange", lw=2))
axes[0].set_title("frame")
axes[1].set_title("change mask and region")
for ax in axes:
    ax.set_axis_off()

# %%
# **Edges**: within the region, edge points are linked and cut into straight segments.
# **Contours**: the model at the position and phase found, hidden lines removed.

around = np.zeros_like(mask)
around[int(top) : int(bottom) + 1, int(left) : int(right) + 1] = True
edges = memo.edge_segments(now, around)[:, :4].reshape(-1, 2, 2)
contours = track.contours(row)

# %%
# **Similarity** (eqs. 7 and 11) matches the two. The best edge answers for each contour.

similarity, matches = memo.similarity(contours, edges)
answered = np.isin(np.arange(len(contours)), matches[:, 0].astype(int))
length_px = np.linalg.norm(contours[:, 1] - contours[:, 0], axis=1)
share = length_px[answered].sum() / length_px.sum()
print(f"similarity {similarity:.2f}; {100 * share:.0f} % of the contours' length is answered")

fig, axes = plt.subplots(1, 2, figsize=(9, 5.5), sharex=True, sharey=True, layout="constrained")
axes[0].add_collection(LineCollection(edges, colors="tab:orange", linewidths=1.2))
axes[0].set_title("straight edges of the image")
axes[1].add_collection(LineCollection(contours[answered], colors="tab:green", linewidths=1.8))
axes[1].add_collection(LineCollection(contours[~answered], colors="tab:red", linewidths=1.2))
axes[1].set_title("contours: answered green, not red")
for ax in axes:
    ax.imshow(now, cmap="gray", vmin=0, vmax=255)
    ax.set(xlim=(left - 20, right + 20), ylim=(bottom + 20, top - 20))
    ax.set_axis_off()
