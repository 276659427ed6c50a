"""What must work where numpy is all there is beside memo; run as a program, without pytest.

It prints what it used and ends with an error where something is missing.
"""

import importlib.util
import logging
import pickle
import subprocess
import sys

import memo
import numpy as np


def main() -> None:
    for absent in ("av", "matplotlib", "rich", "typer", "pandas", "scipy"):
        assert importlib.util.find_spec(absent) is None, f"{absent} is here: this environment is not empty"
    scene = memo.demo_scene(0, frames=50)
    track = memo.track(scene.frames, times_s=scene.times_s, height_m=scene.height_m, camera=scene.camera)
    error_m = np.abs(
        track.columns["x_m"] - np.interp(track.columns["frame"], scene.truth["frame"], scene.truth["x_m"])
    )
    assert len(track) > 40 and error_m.max() < 0.1, (len(track), error_m.max())
    assert repr(pickle.loads(pickle.dumps(track))) == repr(track)
    walk = memo.walker_motion(60, rate_hz=30)
    dots = memo.pointlight(walk.positions, walk.times_s, walk.names, azimuth_deg=30)
    figure = memo.planar(dots.positions_px, dots.times_s)
    assert len(figure.links()) >= 8, figure
    command = subprocess.run([sys.executable, "-m", "memo.cli", "demo"], capture_output=True, text=True)
    assert command.returncode == 4 and "typer: pip install " in command.stderr, command
    assert logging.getLogger("memo").handlers
    print(f"memo {memo.__version__}, Python {sys.version.split()[0]}, numpy {np.__version__}: {track!r}")


if __name__ == "__main__":
    main()
