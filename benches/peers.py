"""What memo costs beside the tools a user would otherwise take, on the same frames in the same process.

    pip install opencv-contrib-python-headless av
    python benches/peers.py CLIP [--camera CAMERA.toml] [--height 1.75] [--frames A:B]

Without a clip a moving square with sensor noise is drawn, and nothing is tracked. Peers are OpenCV's, on one
thread, as are memo's image stages. Each round runs memo, then every peer; a ratio is the median over rounds
of (peer's time / memo's time), so that load on the machine falls on both. Speed is all that is compared:
the results are not the same thing (MOG2 and KNN keep a background model, DIS and Farneback give a velocity
where there is no texture).
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from itertools import cycle, pairwise
from pathlib import Path
from typing import Any

import cv2
import memo
import numpy as np
import numpy.typing as npt

Luma = npt.NDArray[np.uint8]
Work = Callable[[], object]

CHANGE_SIZE = (1920, 1080)
EDGE_SIZES = ((768, 576), (1280, 720))
REGION_SIZE = (200, 400)  # a walker 350 pixels high with room around
ROUNDS = 25


def main() -> None:
    options = arguments()
    cv2.setNumThreads(1)
    frames = read(options.clip, options.frames) if options.clip else drawn_frames()
    print(f"{options.clip or 'drawn frames'}, {ROUNDS} rounds, medians\n")
    print(f"{'work':46}{'tool':24}{'ms':>8}{'peer / memo':>13}")
    change_detection([resized(frame, CHANGE_SIZE) for frame in frames[:30]])
    for size in EDGE_SIZES:
        edges_and_segments([resized(frame, size) for frame in frames[:30]])
    velocities(frames)
    if options.clip:
        tracking(options)


def change_detection(frames: list[Luma]) -> None:
    models = {
        "OpenCV MOG2": cv2.createBackgroundSubtractorMOG2(),
        "OpenCV KNN": cv2.createBackgroundSubtractorKNN(),
    }
    for model in models.values():
        for frame in frames:
            model.apply(frame)
    peers = {name: over(frames, model.apply) for name, model in models.items()}
    pairs = list(pairwise(frames))
    for what, threshold in (("T from noise", None), ("T = 4", 4.0)):
        ours = over(pairs, lambda pair, threshold=threshold: memo.change_mask(*pair, threshold))
        compare(f"change detection, {what}, {size_of(frames)}", ours, peers)


def edges_and_segments(frames: list[Luma]) -> None:
    drawing = cv2.ximgproc.createEdgeDrawing()

    def edlines(frame: Luma) -> object:
        drawing.detectEdges(frame)
        return drawing.detectLines()

    peers = {
        "OpenCV EDLines": over(frames, edlines),
        "OpenCV LSD": over(frames, cv2.createLineSegmentDetector().detect),
    }
    compare(f"edges and segments, {size_of(frames)}", over(frames, memo.edge_segments), peers)


def velocities(frames: list[Luma]) -> None:
    crops = around_motion(frames)
    pairs = list(pairwise(crops))
    whole = np.ones(crops[0].shape, bool)
    dis = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    peers = {
        "OpenCV DIS medium": over(pairs, lambda pair: dis.calc(*pair, None)),
        "OpenCV Farneback": over(
            pairs, lambda pair: cv2.calcOpticalFlowFarneback(*pair, None, 0.5, 3, 15, 3, 5, 1.2, 0)
        ),
    }
    ours = over(pairs, lambda pair: memo.velocity_field(*pair, whole))
    compare(f"velocity field, {size_of(crops)}", ours, peers)


def tracking(options: argparse.Namespace) -> None:
    """Tracking alone and with decoding, against the clip's own rate; all cores."""
    from memo.video import VideoReader

    camera = memo.Camera.from_toml(str(options.camera)) if options.camera else None
    start, stop = options.frames
    with VideoReader(options.clip, start=start, stop=stop) as reader:
        rate_hz, began = reader.rate_hz, time.perf_counter()
        tracker, inside_s, count = memo.Tracker(options.height, camera), 0.0, 0
        for frame in reader:
            before = time.perf_counter()
            tracker.update(frame.luma, frame.time_s)
            inside_s, count = inside_s + time.perf_counter() - before, count + 1
        track = tracker.finish()
    whole_s = time.perf_counter() - began
    print(f"\n{track.summary['message']}")
    for what, seconds in (("tracking", inside_s), ("tracking and decoding", whole_s)):
        speed_hz = count / seconds
        print(f"{what:46}{speed_hz:8.1f} frames/s, {speed_hz / rate_hz:.2f} times the clip's {rate_hz:g}")


def compare(what: str, ours: Work, peers: dict[str, Work]) -> None:
    """Runs ours and every peer in turn, round after round, and prints a line for each."""
    works = {"memo": ours, **peers}
    for work in works.values():
        work()
    rounds = [{name: milliseconds(work) for name, work in works.items()} for _ in range(ROUNDS)]
    for name in works:
        median_ms = statistics.median(times[name] for times in rounds)
        ratio = statistics.median(times[name] / times["memo"] for times in rounds)
        shown = "" if name == "memo" else f"{ratio:.2f}"
        print(f"{what if name == 'memo' else '':46}{name:24}{median_ms:8.2f}{shown:>13}")


def milliseconds(work: Work) -> float:
    before = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - before)


def over(inputs: list[Any], work: Callable[[Any], object]) -> Work:
    """`work` on the next of the inputs with every call."""
    following = cycle(inputs)
    return lambda: work(next(following))


def resized(frame: Luma, size: tuple[int, int]) -> Luma:
    return np.ascontiguousarray(cv2.resize(frame, size, interpolation=cv2.INTER_CUBIC))


def size_of(frames: list[Luma]) -> str:
    return f"{frames[0].shape[1]}x{frames[0].shape[0]}"


def around_motion(frames: list[Luma]) -> list[Luma]:
    """A window of a walker's size where most pixels change, cut from some frames in the middle."""
    frames = frames[len(frames) // 2 :][:8]
    changed = sum(memo.change_mask(a, b).astype(np.float32) for a, b in pairwise(frames))
    width, height = (min(*sides) for sides in zip(REGION_SIZE, frames[0].shape[::-1], strict=True))
    v, u = np.unravel_index(cv2.blur(changed, (width, height)).argmax(), changed.shape)
    left = int(np.clip(u - width // 2, 0, changed.shape[1] - width))
    top = int(np.clip(v - height // 2, 0, changed.shape[0] - height))
    return [np.ascontiguousarray(frame[top : top + height, left : left + width]) for frame in frames]


def read(clip: Path, frames: tuple[int, int | None]) -> list[Luma]:
    """Up to 60 frames from the middle of the range."""
    from memo.video import VideoReader

    start, stop = frames
    with VideoReader(clip, start=start, stop=stop) as reader:
        skipped = max(0, (reader.frame_count or 0) - 60) // 2
        numbered = enumerate(reader)
        return [frame.luma.copy() for i, frame in numbered if skipped <= i < skipped + 60]


def drawn_frames() -> list[Luma]:
    """A striped square that moves before a wall of smooth texture, under noise of 2 grey levels."""
    width, height = 1280, 720
    random = np.random.default_rng(1)
    wall = cv2.resize(random.normal(120, 15, (height // 16, width // 16)), (width, height))
    stripes = 60 * (np.arange(250) // 20 % 2) + 100.0

    def frame(index: int) -> Luma:
        scene = wall.copy()
        left = 300 + 8 * index
        scene[250:500, left : left + 250] = stripes[:, None]
        return np.clip(scene + random.normal(0, 2, scene.shape), 0, 255).astype(np.uint8)

    return [frame(index) for index in range(30)]


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("clip", type=Path, nargs="?")
    parser.add_argument("--camera", type=Path)
    parser.add_argument("--height", type=float, default=1.75)
    parser.add_argument("--frames", default=":", help="A up to, not including, B", metavar="A:B")
    options = parser.parse_args()
    start, _, stop = options.frames.partition(":")
    options.frames = (int(start or 0), int(stop) if stop else None)
    return options


if __name__ == "__main__":
    main()
