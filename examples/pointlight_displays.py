"""
Point-light displays
====================

A walker reduced to dots, and the controls that vision science compares it with. Every random choice follows
from the seed; switching one control on does not change the others.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import memo
import numpy as np
from memo.display import write_display_video

walker = memo.walker_motion(60, rate_hz=60)
motion = (walker.positions, walker.times_s, walker.names)

# %%
# Six displays of the same motion. Crosses are noise dots, which the display does not tell apart; here the
# labels do.

displays = {
    "side": {},
    "45 degrees": {"azimuth_deg": 45},
    "inverted": {"inverted": True},
    "scrambled places": {"scramble_position": True},
    "limited lifetime": {"lifetime_frames": 2, "life_dots": 8},
    "in noise": {"noise_dots": 40},
}
fig, axes = plt.subplots(2, 3, figsize=(9, 6.5), layout="constrained")
for ax, (title, options) in zip(axes.flat, displays.items(), strict=True):
    display = memo.pointlight(*motion, seed=1, **options)
    dots, noise = display.positions_px, display.labels[0] < 0
    for k in range(dots.shape[1] if "lifetime_frames" not in options else 0):
        ax.plot(*dots[:24, k].T, color="0.75", lw=0.7)
    ax.plot(*dots[0, ~noise].T, "o", color="k", ms=5)
    ax.plot(*dots[0, noise].T, "x", color="tab:red", ms=4)
    ax.set(aspect="equal", title=title)
    ax.invert_yaxis()
    ax.set_axis_off()

# %%
# As a video for an experiment: white dots on black, at the display's own times. `memo pointlight` writes the
# same, with a table of the dots and one of what each dot shows.

display = memo.pointlight(*motion, azimuth_deg=45)
video = Path(tempfile.mkdtemp()) / "display.mp4"
write_display_video(video, display)
print(video.name, display.positions_px.shape, f"{np.diff(display.times_s).mean():.4f} s a frame")
