"""
Track a walker
==============

A drawn person crosses a room. The motion is known, so what tracking finds can be compared.
"""

import matplotlib.pyplot as plt
import memo
import numpy as np
from memo.overlay import draw_row

# %%
# The scene: grey frames (T, H, W), their times, a calibrated camera and the true motion.

scene = memo.demo_scene(seed=0)
print(scene.frames.shape, f"{scene.height_m:.2f} m tall")

# %%
# One call tracks it. `memo.Tracker` does the same frame by frame, for streams.

track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
print(track.summary["message"])
for event in track.events[:4]:
    print(f"{event['time_s']:.2f} s: {event['side']} {event['event']}")

# %%
# The model drawn over a frame: right side red, left side blue.

row = 40
fig, ax = plt.subplots(figsize=(7, 5.2), layout="constrained")
ax.imshow(draw_row(scene.frames[track.columns["frame"][row]], track, row))
ax.set_axis_off()

# %%
# Against the truth. This person walks by curves of their own, which the fit measures: body, path and joint
# curves are fitted to all frames of the walk.

found, true = track.columns, scene.truth
rows = np.searchsorted(true["frame"], found["frame"])
fig, (top, bottom) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
top.plot(true["time_s"], true["right_knee_deg"], color="0.7", lw=4, label="true")
top.plot(found["time_s"], found["right_knee_deg"], color="tab:red", label="tracked")
top.set(ylabel="right knee [deg]")
top.legend()
error_cm = 100 * (found["x_m"] - true["x_m"][rows])
sd_cm = 100 * found["sd_x_m"]
bottom.fill_between(found["time_s"], -2 * sd_cm, 2 * sd_cm, color="0.9", label="±2 standard deviations")
bottom.plot(found["time_s"], error_cm, label="error of the torso along the path")
bottom.set(xlabel="time [s]", ylabel="error [cm]")
bottom.legend()

# %%
# The numbers of this one scene:

phase = (found["phase"] - true["phase"][rows] + 0.5) % 1 - 0.5
print(f"position along the path: {np.sqrt(np.mean(error_cm**2)):.2f} cm RMS")
print(f"gait phase: {np.sqrt(np.mean(phase**2)):.4f} of a cycle RMS")
