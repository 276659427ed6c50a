"""How soon Ctrl-C ends a long call: SIGINT while each is at work, seconds until KeyboardInterrupt is raised.

python benches/interrupt.py
"""

import signal
import subprocess
import sys
import time

SET_UP = """
import sys, time
import numpy as np
import memo
walk = memo.walker_motion(90, rate_hz=30)
dots = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30).positions_px
"""

CALLS = {
    "memo.planar, 40,000 frames": """
tracks = np.concatenate([dots] * 450)
call = lambda: memo.planar(tracks, np.arange(len(tracks)) / 30)
""",
    "memo.posture, 20,000 frames": """
from memo.keypoints import Keypoints
camera = memo.Camera.level((1280, 720), 60.0, 1.2, 4.0)
pixels = np.stack([camera.project(np.ascontiguousarray(row)) for row in walk.positions])
pixels = np.concatenate([pixels] * 222)
names = list(walk.names)
keypoints = Keypoints.from_arrays(pixels, np.ones(pixels.shape[:2]), names=names, fps=30)
call = lambda: memo.posture(keypoints, camera, height_m=1.75, unswap=False)
""",
    "memo.velocity_field, 3840x2160": """
a = np.random.default_rng(0).integers(0, 255, (2160, 3840), dtype=np.uint8)
region = np.ones(a.shape, bool)
call = lambda: memo.velocity_field(a, np.roll(a, 1, 1), region)
""",
    "memo.track, frame by frame": """
scene = memo.demo_scene(0)
call = lambda: [memo.track(scene.frames, fps=25, height_m=scene.height_m) for _ in range(20)]
""",
}

RUN = """
print("started", flush=True)
try:
    call()
except KeyboardInterrupt:
    print(time.time(), flush=True)
    import os
    os._exit(0)
print("ended before the signal", flush=True)
"""


def main() -> None:
    for name, prepared in CALLS.items():
        latencies_s = []
        for delay_s in (0.3, 0.5, 0.7, 0.9, 1.1):
            command = [sys.executable, "-c", SET_UP + prepared + RUN]
            process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
            assert process.stdout is not None
            process.stdout.readline()
            time.sleep(delay_s)
            sent = time.time()
            process.send_signal(signal.SIGINT)
            answer = process.communicate()[0].strip()
            try:
                latencies_s.append(float(answer) - sent)
            except ValueError:
                print(f"{name}: {answer or 'no answer'}")
        if latencies_s:
            print(f"{name}: {max(latencies_s):.3f} s at most, of {len(latencies_s)}")


if __name__ == "__main__":
    main()
