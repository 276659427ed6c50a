"""
Gait parameters with intervals
==============================

Cadence, speed, stride and step with 95 % intervals, over several walks. The definitions say how each is
measured.
"""

import matplotlib.pyplot as plt
import memo
import numpy as np
from memo.gait import DEFINITIONS

# %%
# One walk: the table that `memo track` writes to `gait_parameters.csv`, and what it says in words.

scene = memo.demo_scene(seed=0)
track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
table = track.gait_parameters
for k in range(len(table["parameter"])):
    side = f" {table['side'][k]}" if table["side"][k] else ""
    interval = f"[{table['ci_low'][k]:.3f}, {table['ci_high'][k]:.3f}]"
    print(f"{table['parameter'][k]}{side}: {table['value'][k]:.3f} {table['unit'][k]} {interval}")

# %%
for sentence in track.sentences:
    print(sentence)

# %%
# Several walks: speed with its interval, and the speed with which each person was drawn. (For many videos
# there is `memo batch`.)

seeds = range(3)
fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
inside = 0
for seed in seeds:
    scene = memo.demo_scene(seed=seed)
    track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
    table = track.gait_parameters
    row = np.flatnonzero(table["parameter"] == "speed")[0]
    low, value, high = (table[name][row] for name in ("ci_low", "value", "ci_high"))
    true = np.median(scene.truth["speed_mps"])
    inside += low <= true <= high
    ax.errorbar(seed, value, yerr=[[value - low], [high - value]], fmt="o", color="tab:blue", capsize=4)
    ax.plot(seed, true, "_", color="k", ms=18)
ax.set(xlabel="seed of the walk", ylabel="speed [m/s]", title="tracked, with 95 % interval; lines: the truth")
print(f"the truth is inside the interval in {inside} of {len(seeds)} walks")

# %%
# What a parameter means:

print(DEFINITIONS["step_length"])
