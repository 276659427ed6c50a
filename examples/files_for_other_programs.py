"""
Files for other programs
========================

A tracked walk as TRC and MOT for OpenSim, as C3D for Visual3D and Mokka, as BVH for Blender. `memo convert`
does the same from the command line.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import memo
import numpy as np
from memo.files import write_events_csv, write_track_csv
from memo.formats import read_motion, write_motion

scene = memo.demo_scene(seed=0)
track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
folder = Path(tempfile.mkdtemp())
write_track_csv(folder / "track.csv", track.columns)
write_events_csv(folder / "events.csv", track.events)

# %%
# A folder of `memo track` is a motion: points in metres with Z up, joint angles, events.

motion = read_motion(folder)
print(motion.points.shape, motion.names[:3], list(motion.angles)[:2], motion.events[0])

# %%
# Every format has its usual up axis, Y for OpenSim and BVH, Z for C3D; `up=` chooses. What a format has no
# place for is said.

for name in ("walk.trc", "walk.mot", "walk.c3d", "walk.bvh"):
    left_out = write_motion(folder / name, motion)
    print(name, (folder / name).stat().st_size, "bytes.", *left_out)

# %%
# Read back: the axes are turned to Z up again, and points agree to the digits written.

fig, ax = plt.subplots(figsize=(7, 3.5), layout="constrained")
k = motion.names.index("right_ankle")
ax.plot(motion.times_s, motion.points[:, k, 2], color="0.7", lw=4, label="tracked")
for name in ("walk.trc", "walk.c3d"):
    back = read_motion(folder / name)
    points = back.points[:, back.names.index("right_ankle")]
    ax.plot(back.times_s, points[:, 2], "--", label=name)
    print(name, f"differs by at most {1000 * np.nanmax(np.abs(points - motion.points[:, k])):.3f} mm")
ax.set(xlabel="time [s]", ylabel="right ankle above ground [m]")
ax.legend()
