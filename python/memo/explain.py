"""Explains frames of a finished run: computes the evidence again from its video.

A run's folder stores the search region of the tracker in every frame, the person and the camera
(`run.json`). With the video, the change mask, the edges, the model's contours, the terms of Rohr's
eqs. (7)-(11) and the similarity over the whole gait cycle are reproduced exactly: by the same code, at the
best point of the tracker's grid. The phase in `track.csv` is near that point, not equal to it: it is refined
between grid points and smoothed over all frames. The similarity is the one in `track.csv`. Pixels and
lengths in pixels are those of the video, even if the tracker was given pictures averaged down. Frames of a
camera that moved are compared as the first frame's camera would have seen them, and shown like this.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from memo import _memo
from memo.extras import install
from memo.pixels import of_video
from memo.run import NAME, RunError, read_run

if TYPE_CHECKING:
    from memo.video import VideoReader

__all__ = ["Why", "explain"]

Floats = npt.NDArray[np.float64]

# The video is another one if the similarity of a frame differs by this from the tracker's.
_SAME_SIMILARITY = 0.01


@dataclass(frozen=True)
class Why:
    """The evidence of a walk in one frame and the fit of the model to it, in pixels of the video."""

    frame: int
    """Number of the frame in the video."""
    time_s: float
    """Seconds since frame 0."""
    walk: int
    """Number of the walk in the run."""
    luma: npt.NDArray[np.uint8]
    """(H, W) grey values."""
    change_mask: npt.NDArray[np.bool_]
    """(H, W) pixels that differ from both the previous and the next frame, cleaned: eq. (1)."""
    window_px: tuple[int, int, int, int]
    """Left, top, right and bottom of the region searched for edges."""
    edge_points: Floats
    """(N, 2) edge points, pixels."""
    segments: Floats
    """(M, 2, 2) straight image edges, pixels."""
    model: Floats
    """(K, 2, 2) visible side lines of the model, pixels."""
    model_part: npt.NDArray[np.uint8]
    """(K,) their body parts, as in `Track.contour_parts`."""
    model_px: Floats
    """(K,) their lengths l_M, undistorted pixels; lines below 1 px (`shrink` px) are left out of the sums."""
    model_edge: npt.NDArray[np.int64]
    """(K,) the image edge of `segments` matched to each, -1 if there is none."""
    overlap_px: Floats
    """(K,) l: length of that edge within the line's window, undistorted pixels; NaN if there is none."""
    distance_px: Floats
    """(K,) d: distance of its midpoint from the line; NaN if there is none."""
    angle_rad: Floats
    """(K,) angle between edge and line; NaN if there is none."""
    similarity_px: Floats
    """(K,) s_i of eq. (7), weighted; their sum over that of `model_px` is the similarity of the frame."""
    matched: Floats
    """(K,) s_i / l_M: support of each line by an image edge, 0 to 1."""
    matched_edges: Floats
    """(J, 2, 2) the image edges matched to a line, each once, pixels."""
    phase_grid: Floats
    """(P,) phases in [0, 1), ascending, `phase` among them."""
    similarity: Floats
    """(P,) similarity at these phases with the trunk at its estimated position (eq. 11, Fig. 19)."""
    phase: float
    """The phase chosen: of the tracker's grid, in [0, 1)."""
    chosen_similarity: float
    """Similarity at the chosen phase, as in `track.csv`."""
    shrink: int = 1
    """Pixels of the video per pixel of the picture that was tracked, along each axis."""

    @property
    def twin_phase(self) -> float:
        """The phase half a cycle later, at which left and right are interchanged."""
        return (self.phase + 0.5) % 1.0

    @property
    def twin_similarity(self) -> float:
        """Similarity at that phase."""
        off = np.abs((self.phase_grid - self.twin_phase + 0.5) % 1.0 - 0.5)
        return float(self.similarity[np.argmin(off)])


def explain(
    run_folder: str | PathLike[str],
    frames: Iterable[int] | None = None,
    progress: Callable[[int, int], object] | None = None,
    *,
    video: str | PathLike[str] | None = None,
) -> Iterator[Why]:
    """Explains frames of a run of `memo track`, one after another in their order in the video.

    A frame with several people is explained for each of their walks.

    `frames`: numbers in the video, by default all tracked ones. `progress` is called with the number of
    frames read and the total. `video`: the path of the video, if it was moved. Memory does not
    grow with the number of frames. Needs the `app` extra for reading the video.
    """
    try:
        from memo.video import VideoReader
    except ModuleNotFoundError as error:
        raise ImportError(f"reading the video needs {error.name}: {install('app', 'av')}") from None
    run = read_run(run_folder)
    file = Path(run_folder) / NAME
    first = run["frames"][0]
    try:
        tracked = {first + int(frame) for walk in run["walks"] for frame in walk["frame"]}
    except (KeyError, TypeError, ValueError):
        raise RunError(f"{file}: walks: frame must be whole numbers") from None
    wanted = tracked if frames is None else {int(frame) for frame in frames}
    if unknown := sorted(wanted - tracked):
        seen = f"{min(tracked)} to {max(tracked)}" if tracked else "none"
        raise RunError(f"{run_folder}: frame {unknown[0]} was not tracked; tracked are {seen}")
    path = _video(run, file, video)
    try:
        # Older runs took the frames as they were.
        tracker = _memo.Tracker(camera=_given_camera(run), **{"steady": False, **run["options"]})
        explainer = _memo.Explainer(tracker, run["walks"], {frame - first for frame in wanted})
    except (TypeError, ValueError, OverflowError) as error:
        raise RunError(f"{file}: {error}") from None
    first, count = run["frames"][0], run["frames_read"]
    # The change mask of a frame needs the next frame.
    stop = min(first + count, max(wanted, default=first - 2) + 2)
    if stop <= first:
        return iter(())
    reader = VideoReader(path, start=first, stop=stop, rate_hz=run["fps_given"])
    return _explained(run, file, reader, stop - first, wanted, explainer, progress)


def _given_camera(run: dict[str, Any]) -> _memo.Camera | None:
    """The given camera, of the tracked pictures: with its lens, those of a moving camera are steadied."""
    if not run["camera_given"] or run["camera"] is None:
        return None
    return _memo.Camera.from_parameters(run["camera"]).shrunk(run["shrink"])


def _video(run: dict[str, Any], file: Path, given: str | PathLike[str] | None) -> Path:
    if given is not None:
        return Path(given)
    if run["video"] is None:
        raise RunError(f"{file}: the frames did not come from a video, so they cannot be explained")
    path = Path(run["video"])
    if not path.exists():
        raise RunError(f"{file}: the video is no longer at {path}; give its path as video=")
    return path


def _explained(
    run: dict[str, Any],
    file: Path,
    reader: VideoReader,
    count: int,
    wanted: set[int],
    explainer: _memo.Explainer,
    progress: Callable[[int, int], object] | None,
) -> Iterator[Why]:
    first, video = run["frames"][0], reader.path
    # Where other people are near, their bodies are those of the fit, and their edges are not left out.
    similarities = {
        (number, first + frame): similarity
        for number, walk in enumerate(run["walks"])
        for frame, similarity, shared in zip(
            walk["frame"],
            walk.get("similarity", ()),
            walk.get("shared", [False] * len(walk["frame"])),
            strict=False,
        )
        if not shared
    }
    left = set(wanted)
    with reader:
        for found, luma in _found(reader, explainer, run["shrink"], count, progress):
            why = _why(found, luma, first, run["shrink"])
            tracked = similarities.get((why.walk, why.frame), why.chosen_similarity)
            if abs(why.chosen_similarity - tracked) > _SAME_SIMILARITY:
                raise RunError(
                    f"{video}: not the video of {file}: the similarity in frame {why.frame} was "
                    f"{tracked:.3f}, here it is {why.chosen_similarity:.3f}"
                )
            left.discard(why.frame)
            yield why
    if left:
        raise RunError(f"{video}: ends before frame {min(left)}, which was tracked according to {file}")


#: Frames wait at most so long for the later ones with which they are compared.
_MOST_WAITING = 17


def _found(
    reader: VideoReader,
    explainer: _memo.Explainer,
    shrink: int,
    total: int,
    progress: Callable[[int, int], object] | None,
) -> Iterator[tuple[_memo.Explanation, npt.NDArray[np.uint8]]]:
    """The evidence in the pictures, averaged as for the tracker, each with its frame of the video."""
    recent: dict[int, npt.NDArray[np.uint8]] = {}
    for done, frame in enumerate(reader, 1):
        whole = frame.luma if shrink == 1 else np.array(frame.luma)
        found = explainer.update(whole if shrink == 1 else _memo.shrunk(whole, shrink), frame.time_s)
        if shrink > 1:
            recent[done - 1] = whole
            recent.pop(done - 1 - _MOST_WAITING, None)
        if progress is not None:
            progress(done, total)
        for each in found:  # from the frames before
            yield each, _whole(each.luma, recent.get(each.frame), shrink)
    for each in explainer.finish():
        yield each, _whole(each.luma, recent.get(each.frame), shrink)


def _whole(
    compared: npt.NDArray[np.uint8], whole: npt.NDArray[np.uint8] | None, shrink: int
) -> npt.NDArray[np.uint8]:
    """The picture that was compared, as large as the video; a steadied one is the average, enlarged.

    `whole` is the frame that was averaged; None if it was compared as it is.
    """
    if whole is None:
        return compared
    if np.array_equal(compared, _memo.shrunk(whole, shrink)):
        return whole
    shown = np.zeros_like(whole)
    enlarged = np.kron(compared, np.ones((shrink, shrink), np.uint8))
    shown[: enlarged.shape[0], : enlarged.shape[1]] = enlarged
    return shown


_EVIDENCE = tuple(field.name for field in fields(Why) if hasattr(_memo.Explanation, field.name))
_PLACES = ("edge_points", "segments", "model")
_LENGTHS = ("model_px", "overlap_px", "distance_px", "similarity_px")


def _why(explanation: _memo.Explanation, luma: npt.NDArray[np.uint8], first: int, shrink: int) -> Why:
    found = {name: getattr(explanation, name) for name in _EVIDENCE}
    with np.errstate(divide="ignore", invalid="ignore"):
        matched = np.where(found["model_px"] > 0, found["similarity_px"] / found["model_px"], 0.0)
    edges = np.unique(found["model_edge"][found["model_edge"] >= 0])
    if shrink > 1:
        left, top, right, bottom = found["window_px"]
        mask = np.zeros(luma.shape, bool)
        changed = np.kron(found["change_mask"], np.ones((shrink, shrink), bool))
        mask[: changed.shape[0], : changed.shape[1]] = changed
        found = {
            **found,
            **{name: of_video(found[name], shrink) for name in _PLACES},
            **{name: shrink * found[name] for name in _LENGTHS},
            "window_px": (left * shrink, top * shrink, (right + 1) * shrink - 1, (bottom + 1) * shrink - 1),
            "change_mask": mask,
            "luma": luma,
        }
    return Why(
        **{**found, "frame": found["frame"] + first},
        matched=np.clip(matched, 0.0, 1.0),
        matched_edges=found["segments"][edges],
        shrink=shrink,
    )
