"""
Limbs from unnamed dots
=======================

Which dots belong together, and how do they move in depth? Hoffman and Flinchbaugh (1982) answer for limbs
that swing in a plane: a few views of the end points fix the lengths and the plane. No names, no camera and no
body are needed.
"""

import matplotlib.pyplot as plt
import memo
import numpy as np
from memo.linkage import Points
from memo.linkage_plot import plot_linkage

# %%
# Twelve dots of a walker seen 45 degrees off the side, without their names, half a pixel of noise.

walker = memo.walker_motion(150, rate_hz=60)
joints = [k for k, name in enumerate(walker.names) if name != "HEAD"]
display = memo.pointlight(
    walker.positions[:, joints],
    walker.times_s,
    [walker.names[k] for k in joints],
    azimuth_deg=45,
    noise_sd_px=0.5,
)
tracks, times_s = display.positions_px, display.times_s
figure = memo.planar(tracks, times_s, noise_px=0.5)
print([window.status for window in figure.windows])

# %%
# The linkage, with the length of every link in pixels and how sure it is.

names = [walker.names[k] for k in joints]
for link in figure.links():
    limb, sure = f"{names[link.a]}-{names[link.b]}", f"confidence {link.confidence:.2f}"
    print(f"{limb}: {link.length_px:.0f} px, {sure}, {link.verdict}, in {link.windows} windows")

fig, ax = plt.subplots(figsize=(5, 6), layout="constrained")
plot_linkage(ax, Points(names, times_s, tracks), figure, 0)

# %%
# Depth of the right shank's end against its knee, and the truth. A view of planar motion cannot tell a limb
# from its mirror image in depth, so the sign is open; the picture takes the better one.

knee, ankle = names.index("RKN"), names.index("RAN")
found = figure.depth[:, ankle] - figure.depth[:, knee]
azimuth = np.radians(45)
positions = walker.positions[:, joints]
view = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
away = -(positions[:, ankle] - positions[:, knee]) @ view * 200
known = np.isfinite(found)
sign = np.sign(np.sum(found[known] * away[known]))

fig, ax = plt.subplots(figsize=(7, 3.2), layout="constrained")
ax.plot(times_s, away, color="0.7", lw=4, label="true")
ax.plot(times_s, sign * found, label="found")
ax.set(xlabel="time [s]", ylabel="ankle behind knee [px]")
ax.legend()
