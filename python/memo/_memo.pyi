"""The compiled core; see the docstrings of the `memo` package for shapes, units and axes."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, Final, Self, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "BodyHeight",
    "Camera",
    "CameraTilt",
    "ClothedScene",
    "CountTable",
    "Departure",
    "Explainer",
    "Explanation",
    "FieldSeeker",
    "FrameMotion",
    "FrameSurvivors",
    "GaitCycle",
    "GaitEvent",
    "GaitParameter",
    "HeadColumn",
    "HingeTrials",
    "ImageStages",
    "InternalError",
    "LastStage",
    "LeftOut",
    "LimbSides",
    "LostView",
    "PhaseLine",
    "PlanarChain",
    "PlanarInterpretation",
    "PlanarLink",
    "PlanarWindow",
    "PointCalibration",
    "PointLightDisplay",
    "PostureSequence",
    "PrintedRod",
    "RodTrials",
    "Scene",
    "SecondMotion",
    "SeekReport",
    "SteadiedFrame",
    "Steadier",
    "TableInputs",
    "Tracker",
    "Treadmill",
    "Walk",
    "WalkFit",
    "WalkRatio",
    "WalkSimilarity",
    "WalkStart",
    "WalkerCalibration",
    "WalkerMotion",
    "WalkerState",
    "__version__",
    "_camera",
    "_panic",
    "body_parts",
    "calibrate_points",
    "calibrate_walker",
    "camera_tilt",
    "change_mask",
    "defaults",
    "edge_segments",
    "euler_angles",
    "fit_walk",
    "follow_everyone",
    "foot_points",
    "gait_curves",
    "guess_layout",
    "head_points",
    "hoffman_flinchbaugh_degenerate",
    "hoffman_flinchbaugh_false_targets",
    "hoffman_flinchbaugh_hinges",
    "hoffman_flinchbaugh_rod",
    "hoffman_flinchbaugh_rods",
    "image_stages",
    "joint_name",
    "joint_names",
    "keypoint_layout",
    "keypoint_layouts",
    "lee_chen_counts",
    "lee_chen_figures",
    "lee_chen_head",
    "lee_chen_inputs",
    "lee_chen_last_stage",
    "lee_chen_walker",
    "model_contours",
    "moving_regions",
    "normal_cycle",
    "planar",
    "planar_hinges",
    "planar_rods",
    "pointlight",
    "pointlight_cycle",
    "pointlight_together",
    "population_height_m",
    "posture",
    "posture_tree",
    "recorded_contours",
    "rohr_deviations",
    "rohr_numbers",
    "search_windows",
    "segment_names",
    "shrunk",
    "side_pairs",
    "silhouettes",
    "similarity",
    "stick_joints",
    "unswap",
    "velocity_field",
    "walk_filtered",
    "walk_lines",
    "walk_similarity",
    "walker_motion",
    "walker_sightings",
]

__version__: str

class InternalError(RuntimeError):
    """A bug in memo, not a mistake in the input; standard error gives its place."""

def _panic(message: str, way: str) -> None: ...
def defaults(function: str) -> dict[str, Any]: ...
def normal_cycle(joint: str) -> npt.NDArray[np.float64]: ...

@final
class Camera:
    """A calibrated camera: OpenCV axes, world Z up, metres."""

    def __new__(
        cls,
        matrix: npt.ArrayLike,
        rotation: npt.ArrayLike,
        translation: npt.ArrayLike,
        size: tuple[int, int],
        *,
        distortion: npt.ArrayLike | None = None,
    ) -> Self: ...
    @property
    def matrix(self) -> npt.NDArray[np.float64]: ...
    @property
    def rotation(self) -> npt.NDArray[np.float64]: ...
    @property
    def translation(self) -> npt.NDArray[np.float64]: ...
    @staticmethod
    def from_toml(path: str | PathLike[str], name: str | None = None) -> Camera: ...
    @staticmethod
    def from_file(
        path: str | PathLike[str],
        name: str | None = None,
        unit: str | None = None,
        *,
        size: tuple[int, int] | None = None,
        v_up: bool | None = None,
        lens_only: bool = False,
    ) -> Camera: ...
    def to_toml(self, path: str | PathLike[str], name: str = "cam") -> None: ...
    def pixel_height(self, point: tuple[float, float, float], height_m: float) -> float: ...
    @staticmethod
    def from_tsai(
        *,
        size: tuple[int, int],
        pixel_mm: tuple[float, float],
        focal_mm: float,
        kappa1_per_mm2: float,
        centre_px: tuple[float, float],
        sx: float,
        translation_mm: tuple[float, float, float],
        rotation_rad: tuple[float, float, float],
    ) -> Camera: ...
    @staticmethod
    def level(size: tuple[int, int], fov_deg: float, camera_height_m: float, distance_m: float) -> Camera: ...
    @staticmethod
    def from_parameters(parameters: dict[str, Any]) -> Camera: ...
    def shrunk(self, n: int) -> Camera: ...
    def parameters(self) -> dict[str, Any]: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def position(self) -> tuple[float, float, float]: ...
    def camera_from_world(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]: ...
    def project(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]: ...
    def ground_points(self, pixels: npt.ArrayLike, z_m: float = 0.0) -> npt.NDArray[np.float64]: ...
    def position_from_rectangle(
        self, bottom_px: tuple[float, float], top_px: tuple[float, float], height_m: float
    ) -> tuple[float, float, float]: ...
    def position_on_ground(
        self, bottom_px: tuple[float, float], top_px: tuple[float, float], height_m: float
    ) -> tuple[float, float, float]: ...

def _camera(
    size: tuple[int, int],
    focal_px: tuple[float, float],
    centre_px: tuple[float, float],
    lens: tuple[str, list[float]],
    rotation: Sequence[float],
    translation_m: tuple[float, float, float],
) -> Camera: ...

@final
class ClothedScene:
    """A person in clothes who walks through a room; `memo.demo_scene` wraps it."""

    def __new__(
        cls,
        seed: int = 0,
        *,
        frames: int = 80,
        noise_sd: float | None = None,
        leftward: bool | None = None,
        late_left: float | None = None,
        slant_rad: float | None = None,
        turn_rad: float = 0.0,
        pause_s: tuple[float, float] | None = None,
        mover: str = "walker",
    ) -> Self: ...
    def frame(self, index: int) -> npt.NDArray[np.uint8]: ...
    def time_s(self, index: int) -> float: ...
    def truth(
        self, index: int
    ) -> tuple[tuple[float, float, float], float, tuple[npt.NDArray[np.float64], list[float]]] | None: ...
    def heading_at(self, index: int) -> float | None: ...
    def contacts(self) -> list[tuple[float, str, str]]: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def height_m(self) -> float: ...
    @property
    def speed_mps(self) -> float: ...
    @property
    def heading_rad(self) -> float: ...
    def __len__(self) -> int: ...

@final
class Scene:
    """The model as a walker before a wall; `memo.scene.model_scene` wraps it."""

    def __new__(
        cls,
        seed: int = 0,
        *,
        frames: int = 80,
        noise_sd: float = 5.0,
        leftward: bool | None = None,
        late_left: float = 0.0,
    ) -> Self: ...
    def frame(self, index: int) -> npt.NDArray[np.uint8]: ...
    def time_s(self, index: int) -> float: ...
    def truth(
        self, index: int
    ) -> tuple[tuple[float, float, float], float, npt.NDArray[np.float64]] | None: ...
    def angles_deg(self, phase: float) -> list[float]: ...
    @property
    def camera(self) -> Camera: ...
    @property
    def height_m(self) -> float: ...
    @property
    def speed_mps(self) -> float: ...
    @property
    def heading_rad(self) -> float: ...
    def __len__(self) -> int: ...

@final
class Tracker:
    """Tracks everybody who walks; `memo.Tracker` wraps it."""

    def __new__(
        cls,
        height_m: float | Sequence[float] | None = None,
        camera: Camera | None = None,
        *,
        fov_deg: float | None = None,
        gait: str | None = None,
        adapt: bool = True,
        start_frames: int | None = None,
        treadmill: bool | None = None,
        compensate_gain: bool = False,
        background: bool = False,
        steady: bool = True,
        measure: str | None = None,
        full_gradient: float | None = None,
        full_velocity: float | None = None,
        part_weights: Sequence[float] | None = None,
        reach_px: Sequence[int] | None = None,
        reach_from_rad: Sequence[float] | None = None,
    ) -> Self: ...
    def update(
        self, frame: npt.NDArray[np.uint8], time_s: float, boxes: npt.ArrayLike | None = None
    ) -> None: ...
    def finish(self) -> None: ...
    def take_finished(self) -> list[Walk]: ...
    def people(self) -> list[WalkerState]: ...
    def seek_report(self) -> SeekReport: ...
    def left_out(self) -> list[LeftOut]: ...
    def camera_motion(self) -> list[FrameMotion]: ...
    def wider(self) -> tuple[list[int], list[float]] | None: ...
    def lost_views(self) -> list[LostView]: ...

@final
class WalkerState:
    """Filtered state of a person who is followed."""

    person: Final[int]
    """Number of the person, in order of appearance."""
    frame: Final[int]
    time_s: Final[float]
    x_m: Final[float]
    """Centre of the torso, world metres."""
    y_m: Final[float]
    z_m: Final[float]
    heading_rad: Final[float]
    """Angle of the body's forward axis about world Z."""
    phase: Final[float]
    """Gait phase in [0, 1), 0 at right heel strike."""
    p_swapped: Final[float]
    """Probability that left and right are swapped."""
    speed_mps: Final[float]
    """Speed along the path, m/s."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class SeekReport:
    """Counts over a stream; if nobody was followed, they show why."""

    frames: Final[int]
    frames_with_candidate: Final[int]
    """Frames with a moving region large enough for a person."""
    frames_cut_off: Final[int]
    """Of these, frames in which the image border cut the region."""
    refused_starts: Final[int]
    """Refused starts: the region moved too slowly, did not fit the height, or did not walk.

    Walks that were taken back count too.
    """
    start_frames: Final[int]
    """Frames of a starting phase at the rate of the frames."""
    left_out: Final[int]
    """People and things that moved and were not followed."""
    frames_relit: Final[int]
    """Frames whose brightness differed suddenly and was made that of the others."""
    largest_flicker: Final[float]
    """Largest such difference, as a share of the brightness."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class LeftOut:
    """Somebody or something that moved and was not followed."""

    first_frame: Final[int]
    """First frame in which it was seen, from 0."""
    last_frame: Final[int]
    start_s: Final[float]
    end_s: Final[float]
    frames: Final[int]
    """Number of frames in which it was seen."""
    reason: Final[str]
    """Why it was not followed."""
    value: Final[float | None]
    """The figure of the reason: pixels, m/s or frames."""
    boxes: Final[list[list[int]]]
    """Frame, left, top, width and height of up to 16 boxes, from the first frame to the last, pixels."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class FrameMotion:
    """The camera in a frame."""

    frame: Final[int]
    state: Final[str]
    """"still", "turned", "uneven_light", "unknown" or "lost"."""
    turn_rad: Final[list[float]]
    """Rotation vector from the first frame's camera to this one's, camera axes."""
    shift_px: Final[float]
    """Largest displacement of the picture against the first frame, pixels."""
    rms_px: Final[float]
    """Its root mean square over the picture, pixels."""
    support: Final[float]
    """Share of the points that the rotation explains; NaN where none was estimated."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class LostView:
    """Where a view of the camera ended."""

    frame: Final[int]
    """The first frame of another view."""
    reason: Final[str]
    """"cut", "zoom" or "other view"."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class SteadiedFrame:
    """A frame after steadying."""

    motion: Final[FrameMotion]
    """The camera in it."""
    picture: Final[npt.NDArray[np.uint8] | None]
    """(H, W) as the camera of the first frame would have seen it; None if the frame was left as it is."""
    unseen: Final[npt.NDArray[np.bool_] | None]
    """(H, W) pixels that the frame does not show."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class Steadier:
    """Steadies frames of a camera held in the hand, as `Tracker` does."""

    def __new__(
        cls,
        camera: Camera | None = None,
        *,
        fov_deg: float | None = None,
        still_px: float | None = None,
        reach_px: Sequence[int] | None = None,
        reach_from_rad: Sequence[float] | None = None,
    ) -> Self: ...
    def update(self, frame: npt.NDArray[np.uint8]) -> SteadiedFrame: ...
    def wider(self) -> tuple[list[int], list[float]] | None: ...
    def losses(self) -> list[LostView]: ...

@final
class FieldSeeker:
    """Measures the field of view of a camera that pans; `memo.field_of_view` wraps it."""

    def __new__(cls) -> Self: ...
    def update(self, frame: npt.NDArray[np.uint8]) -> bool: ...
    def found(self) -> tuple[float, float] | None: ...

@final
class Explainer:
    """Takes frames and explains the requested ones, one frame later; `memo.explain` wraps it."""

    def __new__(cls, tracker: Tracker, records: Sequence[dict[str, Any]], wanted: set[int]) -> Self: ...
    def update(self, frame: npt.NDArray[np.uint8], time_s: float) -> list[Explanation]: ...
    def finish(self) -> list[Explanation]: ...

@final
class Explanation:
    """The evidence of a walk in one frame; its attributes are those of `memo.explain.Why`."""

    frame: Final[int]
    time_s: Final[float]
    walk: Final[int]
    window_px: Final[tuple[int, int, int, int]]
    luma: Final[npt.NDArray[np.uint8]]
    change_mask: Final[npt.NDArray[np.bool_]]
    edge_points: Final[npt.NDArray[np.float64]]
    segments: Final[npt.NDArray[np.float64]]
    model: Final[npt.NDArray[np.float64]]
    model_part: Final[npt.NDArray[np.uint8]]
    model_px: Final[npt.NDArray[np.float64]]
    model_edge: Final[npt.NDArray[np.int64]]
    overlap_px: Final[npt.NDArray[np.float64]]
    distance_px: Final[npt.NDArray[np.float64]]
    angle_rad: Final[npt.NDArray[np.float64]]
    similarity_px: Final[npt.NDArray[np.float64]]
    phase_grid: Final[npt.NDArray[np.float64]]
    similarity: Final[npt.NDArray[np.float64]]
    phase: Final[float]
    chosen_similarity: Final[float]

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

def population_height_m() -> tuple[float, float]: ...
def recorded_contours(
    record: dict[str, Any], frames: Sequence[int]
) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8]]]: ...

@final
class WalkFit:
    """The measured person of a walk: how well the model fits, and the person's own body and curves."""

    residual_px: Final[float]
    """Mean distance of the edges from the outline of the model, pixels."""
    height_px: Final[float]
    """Height of the person in the middle of the walk, pixels."""
    missed: Final[float]
    """Share of the outline without an edge in the frames."""
    missed_inside: Final[float]
    """The same of the lines inside the body."""
    worst_length_sd: Final[float]
    """The farthest that a length of the body is from its mean over people, standard deviations."""
    sole_m: Final[float | None]
    """Mean height of the lower sole above the ground, metres; None in an assumed camera."""
    crown_off: Final[float | None]
    """How far the moving region reaches above the model's head, in the median of the frames, as a share of
    the person's height in the image; None if no frame shows the person alone."""
    is_far: Final[bool]
    """Whether the edges are too far from the outline for a good fit, as a share of the person's height."""
    is_beside_the_crown: Final[bool]
    """Whether the head of the model is not where the person's is."""
    is_off_ground: Final[bool]
    """Whether the feet do not stand on the ground of a calibrated camera."""
    verdict: Final[str]
    """How well the model fits: "well", "in part" (look at the overlay) or "poorly"."""
    part_missed: Final[dict[str, float]]
    """Share of the outline of each part without an edge: `right shank`, `head` ...; only parts on the
    outline."""
    part_residual_px: Final[dict[str, float]]
    """Mean distance of the other edges from the outline of each part, pixels."""
    off_parts: Final[list[str]]
    """The parts that miss more of their outline than a good fit does, or are farther from the edges; the
    worst first."""
    lengths_m: Final[dict[str, float]]
    """Lengths of the body, metres: ankle_height, shank, thigh, torso, stature, upper_arm, forearm."""
    mean_sd: Final[dict[str, float]]
    """Standard deviations of the means over the frames of the walk: of the measured angles (`right_hip_deg`
    ...), of the torso's centre (`along_m`, `across_m` and `height_m`, of the path) and of the phase (`phase`,
    cycles)."""
    curves_deg: Final[npt.NDArray[np.float64]]
    """The person's curves at fifty equally spaced phases from initial contact, (2, 5, 50) degrees: right and
    left; hip, knee, ankle, shoulder, elbow. NaN where a joint was not measured."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...

@final
class GaitEvent:
    """A gait event."""

    time_s: Final[float]
    frame: Final[float]
    """The time as a frame, between frames."""
    event: Final[str]
    """"heel_strike" or "toe_off"."""
    side: Final[str]
    """"right" or "left"."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class GaitParameter:
    """A gait parameter with its 95 % interval."""

    parameter: Final[str]
    """A key of `memo.gait.DEFINITIONS`."""
    side: Final[str]
    """"right", "left", or "" for both."""
    value: Final[float]
    """NaN if unknown, as are the ends of the interval."""
    unit: Final[str]
    low: Final[float]
    high: Final[float]
    n: Final[int]
    """Number of steps or cycles used."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class GaitCycle:
    """A gait cycle of one side, or the mean of its cycles."""

    side: Final[str]
    curve: Final[str]
    """"cycle", "partial" or "mean"."""
    start_s: Final[float]
    """NaN for a mean, as is the end."""
    end_s: Final[float]
    values: Final[npt.NDArray[np.float64]]
    """(5, 101, 6): of hip, knee, ankle, shoulder and elbow, at 0 to 100 %, angle, stated standard deviation,
    standard deviation over cycles, low and high end of the 95 % interval (degrees), and number of cycles."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class Departure:
    """A joint whose mean cycle is outside of average walking."""

    side: Final[str]
    joint: Final[str]
    """"hip" or "knee"."""
    excess_deg: Final[float]
    """How far outside, where that is most; positive is more flexed."""
    half_deg: Final[float]
    """Half of its 95 % interval."""
    at_percent: Final[int]
    """Where that is, per cent of the cycle."""
    share: Final[float]
    """Share of the cycle that is outside with the whole interval."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class BodyHeight:
    """A body height."""

    height_m: Final[float]
    sd_m: Final[float]
    source: Final[str]
    """"given", "measured" or "assumed"."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class WalkRatio:
    """Step length over cadence, metres per step per minute."""

    value: Final[float]
    low: Final[float]
    """The smallest that is usual at this height."""
    high: Final[float]
    """The largest."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class CameraTilt:
    """How a camera is tilted, by the upright lines in its picture."""

    roll_deg: Final[float]
    """Rotation about the viewing direction; positive if upright lines lean to the right."""
    pitch_deg: Final[float]
    """Downwards from the horizon, for the focal length that was given or assumed."""
    roll_sd_deg: Final[float]
    """Standard deviation of the roll."""
    pitch_sd_deg: Final[float]
    """Standard deviation of the pitch."""
    upright_lines: Final[float]
    """How many lines are upright under this tilt, less those expected by chance."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class Treadmill:
    """A treadmill under a walk."""

    belt_mps: Final[float]
    belt_sd_mps: Final[float]
    other_heading_rad: Final[float | None]
    """The heading that looks alike from the camera; None if there is none."""
    p_other_heading: Final[float | None]
    """Probability of that heading."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class PhaseLine:
    """A line of the gait phase over time."""

    phase_at_start: Final[float]
    """Phase at the first frame, in [0, 1)."""
    rate_hz: Final[float]
    """Gait cycles per second; negative for a cycle run backwards."""
    similarity: Final[float]
    """Mean similarity along the line."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class WalkStart:
    """The starting phase of a walk."""

    frame: Final[npt.NDArray[np.int64]]
    time_s: Final[npt.NDArray[np.float64]]
    phase: Final[npt.NDArray[np.float64]]
    """The most similar phase of each frame."""
    similarity: Final[npt.NDArray[np.float32]]
    """(frames, phases)."""
    line: Final[PhaseLine]
    """The chosen line."""
    twin: Final[PhaseLine]
    """The best line of the other half cycle."""
    other_direction: Final[PhaseLine]
    """The best line in the other walking direction."""
    two_line_rule: Final[PhaseLine]
    """The line of the paper's rule, for comparison."""
    p_other_direction: Final[float]

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...

@final
class Walk:
    """One walk that has ended."""

    person: Final[int]
    """Number of the person, in order of appearance."""
    direction: Final[str]
    """"forward" or "backward"."""
    p_other_direction: Final[float]
    """Probability that the person walks in the other direction."""
    p_swapped: Final[float]
    """Probability that left and right are swapped."""
    is_frontal: Final[bool]
    """True for a walk towards the camera or away from it, whose place and phase the feet show: left and right
    stay open, and the angles are those of average walking."""
    columns: Final[dict[str, npt.NDArray[Any]]]
    """The columns of `track.csv`, one array per column."""
    events: Final[list[GaitEvent]]
    gait_parameters: Final[list[GaitParameter]]
    """Every walk has the same."""
    cycles: Final[list[GaitCycle]]
    """Right, then left, each side's mean last."""
    departures: Final[list[Departure]]
    height: Final[BodyHeight]
    """The body height that the walk was tracked with."""
    measured_height: Final[BodyHeight | None]
    """The height measured in a calibrated camera, also if another was given."""
    height_is_contradicted: Final[bool]
    """Whether the measured height contradicts the given one by more than three standard deviations."""
    walk_ratio: Final[WalkRatio | None]
    """None for backward or very short walks."""
    unexplained: Final[float | None]
    """Changes beside the legs that nobody explains who is followed, as a share of the area of two legs: the
    median over the frames. None if too few frames show it."""
    is_beside_somebody: Final[bool]
    """Whether so much changes there that somebody else may walk there who is not followed, or something
    moves with the person."""
    treadmill: Final[Treadmill | None]
    """None for a walk over ground."""
    fit: Final[WalkFit | None]
    """The measured person; None if there was no fit, or if it failed."""
    fit_problem: Final[str | None]
    """Why no person was measured; None if there is a fit, or if none was asked for."""
    camera: Final[Camera]
    """The camera, given or assumed."""
    camera_tilt: Final[CameraTilt | None]
    """How the assumed camera is tilted; None if a camera was given."""
    start: Final[WalkStart]
    """The starting phase."""
    measured: Final[npt.NDArray[np.float64]]
    """Best measured hypotheses per frame, (rows, 3): world x of the position along the path and z in metres,
    phase; NaN for frames without a measurement."""
    record: Final[dict[str, Any]]
    """What `memo.explain` needs besides the video, as plain numbers."""

    def __new__(cls, *fields: Any) -> Self: ...
    def __getnewargs__(self) -> tuple[Any, ...]: ...
    def _repr_html_(self) -> str: ...
    def contours(self, row: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8]]: ...
    def __len__(self) -> int: ...

def change_mask(
    a: npt.NDArray[np.uint8], b: npt.NDArray[np.uint8], threshold: float | None = None
) -> npt.NDArray[np.bool_]: ...
def moving_regions(mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.float64]: ...
def silhouettes(
    frames: Sequence[npt.NDArray[np.uint8]] | npt.NDArray[np.uint8], threshold: float | None = None
) -> list[npt.NDArray[np.bool_]]: ...
def similarity(
    lines: npt.NDArray[np.float64],
    edges: npt.NDArray[np.float64],
    *,
    c_l: float = 1.0,
    c_d: float = 0.5,
    c_r: float = 0.25,
    sigma_phi_rad: float = 0.20943952,
) -> tuple[float, npt.NDArray[np.float64]]: ...
def shrunk(frame: npt.NDArray[np.uint8], n: int) -> npt.NDArray[np.uint8]: ...
def edge_segments(
    frame: npt.NDArray[np.uint8],
    mask: npt.NDArray[np.bool_] | None = None,
    *,
    sigma_px: float | None = None,
    low: float | None = None,
    high: float | None = None,
    min_length_px: float | None = None,
) -> npt.NDArray[np.float64]: ...
def camera_tilt(
    frame: npt.NDArray[np.uint8],
    still: npt.NDArray[np.bool_] | None = None,
    *,
    fov_deg: float | None = None,
) -> CameraTilt: ...
def velocity_field(
    first: npt.NDArray[np.uint8], second: npt.NDArray[np.uint8], region: npt.NDArray[np.bool_]
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]: ...

@final
class WalkerMotion:
    """Motion of the body model."""

    def __new__(cls, *fields: object) -> Self: ...
    positions: Final[npt.NDArray[np.float64]]
    times_s: Final[npt.NDArray[np.float64]]
    names: Final[list[str]]
    cycle_s: Final[float]

@final
class PointLightDisplay:
    """A point-light display."""

    def __new__(cls, *fields: object) -> Self: ...
    positions_px: Final[npt.NDArray[np.float64]]
    visible: Final[npt.NDArray[np.bool_]]
    labels: Final[npt.NDArray[np.int64]]
    limb_ends: Final[npt.NDArray[np.int64]]
    fractions: Final[npt.NDArray[np.float64]]
    times_s: Final[npt.NDArray[np.float64]]
    centre_px: Final[tuple[float, float]]
    points: Final[int]
    period_s: Final[float | None]
    def frames(
        self,
        *,
        size_px: tuple[int, int] | None = None,
        centre_px: tuple[float, float] | None = None,
        dot_px: float | None = None,
        shape: str | None = None,
        colour: tuple[int, int, int] | None = None,
        background: tuple[int, int, int] | None = None,
        smooth: bool = True,
        alpha: bool = False,
        start: int = 0,
        stop: int | None = None,
    ) -> npt.NDArray[np.uint8]: ...

def fit_walk(
    walk: Walk,
    pictures: Sequence[npt.NDArray[np.uint8]],
    *,
    empty: npt.NDArray[np.uint8] | None = None,
    height_sd: float | None = None,
    frame_sd_deg: float | None = None,
) -> Walk: ...
def euler_angles(rotations: npt.NDArray[np.float64], order: str) -> npt.NDArray[np.float64]: ...
def walker_motion(
    frames: int | None = None,
    *,
    rate_hz: float | None = None,
    speed_mps: float | None = None,
    heading_deg: float | None = None,
    phase: float | None = None,
    height_m: float | None = None,
    cycles: int | None = None,
) -> WalkerMotion: ...
def pointlight(
    positions: npt.NDArray[np.float64],
    times_s: Sequence[float] | npt.NDArray[np.float64],
    names: Sequence[str],
    *,
    azimuth_deg: float | None = None,
    elevation_deg: float | None = None,
    px_per_m: float | None = None,
    camera: Camera | None = None,
    locomotion: str | None = None,
    cycles: int | None = None,
    tempo: float | None = None,
    inverted: bool = False,
    mirrored: bool = False,
    reversed: bool = False,
    scramble_position: bool = False,
    scramble_axes: str | None = None,
    scramble_limit_px: float | None = None,
    scramble_phase: str | None = None,
    period_s: float | None = None,
    cycle_start_s: float | None = None,
    max_shift_s: float | None = None,
    lifetime_frames: int | None = None,
    life_dots: int | None = None,
    life_sites: str | None = None,
    limbs: Sequence[tuple[int, int]] | None = None,
    synchronous: bool = False,
    noise_dots: int | None = None,
    noise_kind: str | None = None,
    noise_area: float | None = None,
    noise_speed_px_s: float | None = None,
    noise_sd_px: float | None = None,
    seed: int | None = None,
) -> PointLightDisplay: ...
def pointlight_cycle(
    positions: Sequence[npt.NDArray[np.float64]],
    times_s: Sequence[float] | npt.NDArray[np.float64],
    names: Sequence[Sequence[str]],
    *,
    period_s: float | None = None,
) -> tuple[float, float]: ...
def pointlight_together(
    displays: Sequence[PointLightDisplay], offsets_px: Sequence[tuple[float, float]] | None = None
) -> PointLightDisplay: ...

@final
class PlanarLink:
    """Two points at a constant distance in space."""

    def __new__(cls, *fields: object) -> Self: ...
    points: Final[tuple[int, int]]
    length: Final[float]
    length_sd: Final[float]
    margin: Final[float]
    confidence: Final[float]

@final
class PlanarChain:
    """One or two links in one plane."""

    def __new__(cls, *fields: object) -> Self: ...
    points: Final[list[int]]
    links: Final[list[PlanarLink]]
    slope: Final[tuple[float, float]]
    tilt_deg: Final[float]
    residual: Final[float]
    reflection_margin_deg: Final[float | None]
    verdict: Final[str]
    statistic: Final[float]
    threshold: Final[float]
    motion: Final[float]
    depth: Final[npt.NDArray[np.float64]]
    angle_deg: Final[npt.NDArray[np.float64]]

@final
class PlanarWindow:
    """The linkage in a window of time."""

    def __new__(cls, *fields: object) -> Self: ...
    start: Final[int]
    end: Final[int]
    status: Final[str]
    planar: Final[int]
    refuted: Final[int]
    undecided: Final[int]
    evidence_nats: Final[float | None]
    least_nats: Final[float | None]
    method: Final[str]
    chains: Final[list[PlanarChain]]
    joints: Final[list[tuple[int, int, float]]]
    alone: Final[list[int]]
    cost: Final[float]
    size: Final[float]

@final
class PlanarInterpretation:
    def __new__(cls, *fields: object) -> Self: ...
    windows: Final[list[PlanarWindow]]
    perspective_px: Final[float | None]
    depth: Final[npt.NDArray[np.float64]]
    sources: Final[list[str]]

def planar(
    tracks: npt.NDArray[np.float64],
    times_s: Sequence[float] | npt.NDArray[np.float64],
    noise_px: float | None = None,
    *,
    window_s: float | None = None,
    size_px: float | None = None,
    carry: bool = False,
    false_target_rate: float | None = None,
    max_tilt_deg: float | None = None,
    names: Sequence[str] | None = None,
    scales: Sequence[float] | npt.NDArray[np.float64] | None = None,
    focal_px: float | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> PlanarInterpretation: ...
def planar_rods(views: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]: ...
def planar_hinges(views: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]: ...
def keypoint_layouts() -> list[str]: ...
def keypoint_layout(name: str) -> tuple[str, list[str]]: ...
def guess_layout(points: npt.NDArray[np.float64]) -> str: ...
def joint_name(name: str) -> str | None: ...
def stick_joints(
    layout_or_names: str | Sequence[str],
    points: npt.NDArray[np.float64],
    scores: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
def foot_points(
    layout_or_names: str | Sequence[str],
    points: npt.NDArray[np.float64],
    scores: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
def head_points(
    layout_or_names: str | Sequence[str],
    points: npt.NDArray[np.float64],
    scores: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
def side_pairs(layout_or_names: str | Sequence[str]) -> list[tuple[str, str, int, int]]: ...
def follow_everyone(
    frames: Sequence[int], points: npt.NDArray[np.float64], scores: npt.NDArray[np.float64]
) -> tuple[list[int | None], list[tuple[int, int, int, float]]]: ...

@final
class LimbSides:
    def __new__(cls, *fields: object) -> Self: ...
    levels: Final[list[str]]
    decided: Final[npt.NDArray[np.bool_]]
    p_flipped: Final[npt.NDArray[np.float64]]
    reason: Final[list[str]]
    level_flipped: Final[npt.NDArray[np.bool_]]
    level_decided: Final[npt.NDArray[np.bool_]]
    level_p_flipped: Final[npt.NDArray[np.float64]]
    p_global: Final[float]

def unswap(
    times_s: npt.NDArray[np.float64],
    points: npt.NDArray[np.float64],
    scores: npt.NDArray[np.float64] | None = None,
    *,
    groups: dict[str, dict[str, list[tuple[int, int]]]],
    as_is_nats: float | None = None,
    partial_begin_nats: float | None = None,
    partial_stay_nats: float | None = None,
    decided_at: float | None = None,
) -> dict[str, LimbSides]: ...

@final
class SecondMotion:
    def __new__(cls, *fields: object) -> Self: ...
    joints: Final[list[str]]
    first_row: Final[int]
    postures_m: Final[npt.NDArray[np.float64]]
    margin_nats: Final[float]
    p: Final[float]

@final
class PostureSequence:
    def __new__(cls, *fields: object) -> Self: ...
    camera: Final[Camera]
    lengths_m: Final[dict[str, float]]
    length_sd_m: Final[dict[str, float]]
    length_basis: Final[dict[str, str]]
    scale_from: Final[str]
    anchor_source: Final[list[str]]
    anchor_conflicts: Final[list[str]]
    anchor_m: Final[npt.NDArray[np.float64]]
    anchor_sd_m: Final[npt.NDArray[np.float64]]
    level_reached: Final[npt.NDArray[np.int64]]
    level_survived: Final[npt.NDArray[np.int64]]
    level_without_root: Final[npt.NDArray[np.int64]]
    reasons: Final[list[list[tuple[str, str, int]]]]
    reason_totals: Final[list[tuple[str, str, str, int, int, str]]]
    survivors: Final[npt.NDArray[np.int64]]
    groups_m: Final[list[npt.NDArray[np.float64]]]
    interpretations: Final[list[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], list[str]]]]
    group_sizes: Final[list[npt.NDArray[np.int64]]]
    group_counts: Final[list[int | None]]
    cut_all: Final[list[list[str] | None]]
    problems: Final[list[str | None]]
    linked_m: Final[npt.NDArray[np.float64]]
    linked_breaks: Final[list[list[str]]]
    smoothed_m: Final[npt.NDArray[np.float64]]
    toes_m: Final[npt.NDArray[np.float64]]
    angles_deg: Final[dict[str, npt.NDArray[np.float64]]]
    sd_m: Final[npt.NDArray[np.float64]]
    gap_m: Final[npt.NDArray[np.float64]]
    margin_nats: Final[npt.NDArray[np.float64]]
    p_mirrored: Final[npt.NDArray[np.float64]]
    second: Final[SecondMotion | None]
    heading_source: Final[str]
    rules: Final[str]
    warnings: Final[list[str]]

def posture(
    times_s: npt.NDArray[np.float64],
    points: npt.NDArray[np.float64],
    weights: npt.NDArray[np.float64],
    camera: Camera | None = None,
    *,
    size: tuple[int, int] | None = None,
    fov_deg: float | None = None,
    lengths: dict[str, float] | None = None,
    height_m: float | None = None,
    noise_px: float | None = None,
    rules: str | None = None,
    strength: str | None = None,
    anchor: str | None = None,
    distance_m: float | Sequence[float] | npt.NDArray[np.float64] | None = None,
    distance_sd_m: float | None = None,
    moving_direction: Sequence[float] | None = None,
    head_points: npt.NDArray[np.float64] | None = None,
    foot_points: npt.NDArray[np.float64] | None = None,
    group_m: float | None = None,
    max_groups: int | None = None,
    keep_all: bool = False,
    progress: Callable[[int, int], object] | None = None,
) -> PostureSequence: ...
def posture_tree(
    rays: npt.NDArray[np.float64],
    neck: Sequence[float],
    lengths: dict[str, float],
    *,
    rules: str | None = None,
    strength: str | None = None,
    noise_rad: float = 0.0,
) -> npt.NDArray[np.float64]: ...

@final
class PointCalibration:
    """A camera calibrated from measured points."""

    def __new__(cls, *fields: object) -> Self: ...
    camera: Final[Camera]
    estimates: Final[dict[str, tuple[float, float]]]
    covariance: Final[npt.NDArray[np.float64]]
    residuals_px: Final[npt.NDArray[np.float64]]
    outliers: Final[list[int]]
    rms_px: Final[float]
    noise_px: Final[float]
    degrees_of_freedom: Final[int]
    is_planar: Final[bool]

@final
class WalkerCalibration:
    """A camera calibrated from a walker."""

    def __new__(cls, *fields: object) -> Self: ...
    camera: Final[Camera]
    estimates: Final[dict[str, tuple[float, float]]]
    residuals_px: Final[npt.NDArray[np.float64]]
    outliers: Final[list[int]]
    rms_px: Final[float]
    person_px: Final[float]
    alike: Final[float]
    places: Final[npt.NDArray[np.float64]]

def calibrate_points(
    places: npt.ArrayLike,
    pixels: npt.ArrayLike,
    size: tuple[int, int],
    *,
    focal_px: float | None = None,
    lens: Camera | None = None,
) -> PointCalibration: ...
def calibrate_walker(
    feet: npt.ArrayLike,
    heads: npt.ArrayLike,
    size: tuple[int, int],
    height_m: float,
    *,
    foot_share: Sequence[float] | npt.NDArray[np.float64] | None = None,
    head_share: Sequence[float] | npt.NDArray[np.float64] | None = None,
    focal_px: float | None = None,
    lens: Camera | None = None,
) -> WalkerCalibration: ...
def walker_sightings(
    names: Sequence[str], points: npt.NDArray[np.float64]
) -> tuple[
    npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]
]: ...
def joint_names() -> list[str]: ...
def segment_names() -> list[str]: ...

@final
class CountTable:
    def __new__(cls, *fields: object) -> Self: ...
    phases: Final[list[float]]
    counts: Final[dict[str, npt.NDArray[np.uint32]]]
    printed: Final[dict[str, npt.NDArray[np.uint32]]]
    truth_kept: Final[list[list[bool]]]

@final
class LastStage:
    def __new__(cls, *fields: object) -> Self: ...
    phase: Final[float]
    postures: Final[int]
    groups: Final[int]
    truth_kept: Final[bool]
    broken: Final[list[str]]

@final
class FrameSurvivors:
    def __new__(cls, *fields: object) -> Self: ...
    figures: Final[npt.NDArray[np.float64]]
    truth: Final[npt.NDArray[np.float64]]
    groups: Final[list[tuple[int, list[int]]]]
    true_one: Final[int | None]
    passes: Final[list[bool]]

@final
class HeadColumn:
    def __new__(cls, *fields: object) -> Self: ...
    method: Final[str]
    transform: Final[npt.NDArray[np.float64]]
    rotation: Final[npt.NDArray[np.float64]]
    focal: Final[float]
    camera_position: Final[list[float]]
    camera_position_sd: Final[list[float] | None]
    points: Final[dict[str, list[float]]]

@final
class TableInputs:
    def __new__(cls, *fields: object) -> Self: ...
    angles: Final[list[tuple[str, tuple[float, float]]]]
    lengths_cm: Final[list[tuple[str, float]]]
    head_cm: Final[npt.NDArray[np.float64]]
    projections_cm: Final[npt.NDArray[np.float64]]
    frame_s: Final[float]
    cameras_cm: Final[list[list[float]]]

def lee_chen_counts(sequence: str, merge_m: float = ...) -> CountTable: ...
def lee_chen_figures(sequence: str) -> FrameSurvivors: ...
def lee_chen_head() -> list[HeadColumn]: ...
def lee_chen_last_stage(sequence: str, reading: str, merge_m: float = ...) -> list[LastStage]: ...
def lee_chen_inputs() -> TableInputs: ...
def lee_chen_walker(
    sequence: str, frames: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...

@final
class RodTrials:
    def __new__(cls, *fields: object) -> Self: ...
    trials: Final[int]
    recovered: Final[int]
    recovered_by_ellipse: Final[int]
    recovered_as_printed: Final[int]
    one_root: Final[int]
    printed_z1: Final[int]
    full_rank: Final[int]
    triple_product_error: Final[float]
    jacobian_error: Final[float]
    never_extended: Final[int]
    never_extended_recovered: Final[int]
    equal_images: Final[int]
    equal_images_one_root: Final[int]

@final
class HingeTrials:
    def __new__(cls, *fields: object) -> Self: ...
    trials: Final[int]
    recovered: Final[int]
    full_rank: Final[int]
    searched: Final[int]
    one_plane: Final[int]
    most_planes: Final[int]
    joint_in_the_middle: Final[int]
    joint_at_an_end: Final[int]

@final
class PrintedRod:
    def __new__(cls, *fields: object) -> Self: ...
    k: Final[list[float]]
    roots: Final[list[float] | None]
    z3_sq: Final[list[float]]
    valid_roots: Final[int]
    depths: Final[list[float] | None]

def hoffman_flinchbaugh_rods(trials: int, seed: int) -> RodTrials: ...
def hoffman_flinchbaugh_hinges(trials: int, searched: int, seed: int) -> HingeTrials: ...
def hoffman_flinchbaugh_false_targets(trials: int, seed: int) -> list[int]: ...
def hoffman_flinchbaugh_degenerate(trials: int, seed: int) -> list[tuple[str, int]]: ...
def hoffman_flinchbaugh_rod(views: npt.NDArray[np.float64]) -> PrintedRod: ...
def rohr_numbers() -> list[tuple[str, float]]: ...
def rohr_deviations(seed: int = 0) -> list[tuple[str, float]]: ...
def gait_curves(gait: str, phases: Sequence[float]) -> npt.NDArray[np.float64]: ...
def body_parts(height_m: float) -> list[tuple[str, float, float, float]]: ...
def model_contours(
    camera: Camera,
    walkers: Sequence[tuple[float, float, float, float, float]],
    *,
    gait: str = "dense",
    hidden: bool = False,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8], npt.NDArray[np.int64]]: ...

@final
class ImageStages:
    def __new__(cls, *fields: object) -> Self: ...
    outlines: Final[list[npt.NDArray[np.float64]]]
    rectangle: Final[list[int]]
    edges: Final[npt.NDArray[np.float64]]
    changed: Final[npt.NDArray[np.bool_]]
    cleaned: Final[npt.NDArray[np.bool_]]

@final
class WalkSimilarity:
    def __new__(cls, *fields: object) -> Self: ...
    best: Final[list[float]]
    scores: Final[npt.NDArray[np.float32]]
    phase: Final[npt.NDArray[np.float64]]
    along: Final[npt.NDArray[np.float64]]
    height: Final[npt.NDArray[np.float64]]

def image_stages(
    before: npt.NDArray[np.uint8], frame: npt.NDArray[np.uint8], after: npt.NDArray[np.uint8]
) -> ImageStages | None: ...
def search_windows(lines: npt.NDArray[np.float64], c_r: float = ...) -> npt.NDArray[np.float64]: ...
def walk_filtered(walk: Walk) -> npt.NDArray[np.float64]: ...
def walk_lines(
    walk: Walk, row: int, phase: float | None = None
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint8]]: ...
def walk_similarity(
    walk: Walk,
    row: int,
    edges: npt.NDArray[np.float64],
    *,
    along_m: float = 0.0,
    height_m: float = 0.0,
) -> WalkSimilarity: ...
