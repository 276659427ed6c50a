//! Point-light displays.

use crate::array::{motion_from_numpy, numpy_from_column, numpy_from_flat};
use crate::camera::PyCamera;
use crate::defaults::dict;
use crate::error::value_error;
use crate::result::result;
use crate::whole::{A_BYTE, FROM_0, FROM_1, Whole, WholeNumbers};
use glam::{DVec2, DVec3};
use memo_core::model::GaitStyle;
use memo_core::synth::{
    CycleOptions, DisplayView, DotPicture, DotShape, DotSource, LifeSites, LimitedLife, Locomotion,
    NoiseDots, NoiseKind, PhaseScramble, PointMotion, PositionScramble, SampledWalkOptions, ScrambleAxes,
    WALKER_HEIGHT_M, common_cycle, displays_together,
};
use memo_core::wording::counted;
use memo_core::{Body, Gait, PointLightOptions, Walker, point_light_display, sampled_walk, synth};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

result! {
    /// Motion of the body model.
    WalkerMotion |py, motion: PointMotion, cycle: f64| {
        /// Points (T, 13, 3), metres, Z up.
        positions: Py<PyArrayDyn<f64>> = {
            let flat = motion.positions().iter().flat_map(|p| p.to_array()).collect();
            numpy_from_flat(py, flat, vec![motion.frames(), motion.points(), 3])?
        },
        /// Times (T,) of the frames.
        times_s: Py<PyArray1<f64>> = numpy_from_column(py, motion.times_s().to_vec()),
        /// Names of the points.
        names: Vec<String> = motion.names().to_vec(),
        /// Duration of a gait cycle.
        cycle_s: f64 = cycle,
    }
    |own| format!("{}, {:.3} s per cycle", counted(own.names.len(), "point"), own.cycle_s)
}

result! {
    /// A point-light display of N dots over T frames.
    PointLightDisplay |py, shown: synth::PointLightDisplay| {
        /// The dots (T, N, 2), NaN for dots that are not visible.
        positions_px: Py<PyArrayDyn<f64>> = {
            let flat = shown.positions_px.iter().flat_map(|p| p.to_array()).collect();
            numpy_from_flat(py, flat, vec![shown.times_s.len(), shown.dots, 2])?
        },
        /// Whether each dot is visible, (T, N).
        visible: Py<PyArrayDyn<bool>> = per_dot(py, &shown, shown.positions_px.iter().map(|p| p.is_finite()))?,
        /// Index of the point shown or of a limb's first end (T, N); -1 for noise.
        labels: Py<PyArrayDyn<i64>> = per_dot(py, &shown, shown.sources.iter().map(|s| shows(s).0))?,
        /// Index of the limb's second end (T, N); -1 for others.
        limb_ends: Py<PyArrayDyn<i64>> = per_dot(py, &shown, shown.sources.iter().map(|s| shows(s).1))?,
        /// Place along the limb (T, N), 0 to 1.
        fractions: Py<PyArrayDyn<f64>> = per_dot(py, &shown, shown.sources.iter().map(|s| shows(s).2))?,
        /// Times (T,) of the frames.
        times_s: Py<PyArray1<f64>> = numpy_from_column(py, shown.times_s),
        /// Pixel that `frames` draws in the middle of the picture.
        centre_px: (f64, f64) = (shown.centre_px.x, shown.centre_px.y),
        /// Number of points of the motion, or of all motions of a display of several.
        points: usize,
        /// Duration of the cycle that the display repeats, if it does.
        period_s: Option<f64>,
    }
    |own| Python::attach(|py| match own.visible.bind(py).shape() {
        [frames, dots] => format!("{} in {}", counted(*dots, "dot"), counted(*frames, "frame")),
        _ => String::new(),
    });
    methods {
        /// Frames `start` to `stop` as pictures (T, H, W, 3), red, green and blue; with `alpha` (T, H, W, 4), the
        /// colour of the dots and how much of it, without background.
        ///
        /// One pixel of the display is one pixel of the picture: nothing is scaled to fit. `centre_px` is the pixel
        /// of the display in the middle of the picture, by default `self.centre_px`; `size_px` is width and height;
        /// `shape` is "disc", "square" (`dot_px` is the diameter or side) or "gaussian" (`dot_px` is the full width
        /// at half maximum); without `smooth`, a pixel is covered wholly or not at all.
        ///
        /// Defaults: `size_px` (640, 640), `dot_px` 10, `shape` "disc", `colour` (255, 255, 255), `background`
        /// (0, 0, 0), `smooth` True.
        #[pyo3(
            signature = (
                *, size_px=None, centre_px=None, dot_px=None, shape=None, colour=None, background=None, smooth=true,
                alpha=false, start=Whole::from(0), stop=None
            ),
            text_signature = "($self, *, size_px=None, centre_px=None, dot_px=None, shape=None, colour=None, background=None, smooth=True, alpha=False, start=0, stop=None)"
        )]
        #[allow(clippy::too_many_arguments, reason = "each is a property of a picture")]
        fn frames<'py>(
            &self,
            py: Python<'py>,
            size_px: Option<[Whole<usize>; 2]>,
            centre_px: Option<[f64; 2]>,
            dot_px: Option<f64>,
            shape: Option<&str>,
            colour: Option<[Whole<u8>; 3]>,
            background: Option<[Whole<u8>; 3]>,
            smooth: bool,
            alpha: bool,
            start: Whole<usize>,
            stop: Option<Whole<usize>>,
        ) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
            let usual = DotPicture::default();
            let picture = DotPicture {
                size_px: size_px.must_be("size_px", "between 1 and 16384 pixels")?.unwrap_or(usual.size_px),
                centre_px: centre_px.map(DVec2::from),
                dot_px: dot_px.unwrap_or(usual.dot_px),
                shape: shape.map(|name| chosen("shape", name, SHAPES)).transpose()?.unwrap_or(usual.shape),
                colour: colour.must_be("colour", A_BYTE)?.unwrap_or(usual.colour),
                background: background.must_be("background", A_BYTE)?.unwrap_or(usual.background),
                is_smooth: smooth,
            };
            picture.check().map_err(value_error)?;
            let (start, stop) = (start.must_be("start", FROM_0)?, stop.must_be("stop", FROM_0)?);
            drawn(py, &self.core(py)?, &picture, alpha, start, stop)
        }
    }
}

const SHAPES: [(&str, DotShape); 3] =
    [("disc", DotShape::Disc), ("square", DotShape::Square), ("gaussian", DotShape::Gaussian)];

/// Largest array of pictures, bytes.
const MOST_BYTES: usize = 8 << 30;

fn drawn<'py>(
    py: Python<'py>,
    shown: &synth::PointLightDisplay,
    picture: &DotPicture,
    alpha: bool,
    start: usize,
    stop: Option<usize>,
) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
    let ([width, height], channels) = (picture.size_px, if alpha { 4 } else { 3 });
    let stop = stop.unwrap_or(usize::MAX).min(shown.times_s.len());
    let start = start.min(stop);
    let bytes = (stop - start).saturating_mul(width * height * channels);
    if bytes > MOST_BYTES {
        return Err(PyValueError::new_err(format!(
            "{} of size {width}x{height} would take {:.0} GB: draw fewer at a time, from start to stop",
            counted(stop - start, "frame"),
            bytes as f64 / 1e9
        )));
    }
    let pixels = py.detach(|| (start..stop).flat_map(|t| picture.pixels(shown, t, alpha)).collect());
    numpy_from_flat(py, pixels, vec![stop - start, height, width, channels])
}

impl PointLightDisplay {
    /// The display as the core has it; noise dots without the point that they copy.
    fn core(&self, py: Python<'_>) -> PyResult<synth::PointLightDisplay> {
        let (positions, frames, dots) = motion_from_numpy::<2>(self.positions_px.bind(py).as_any())?;
        let (labels, ends, fractions) = (
            self.labels.bind(py).to_vec()?,
            self.limb_ends.bind(py).to_vec()?,
            self.fractions.bind(py).to_vec()?,
        );
        let times_s = self.times_s.bind(py).to_vec()?;
        if times_s.len() != frames || [labels.len(), ends.len(), fractions.len()] != [frames * dots; 3] {
            return Err(PyValueError::new_err("the arrays of the display have different shapes"));
        }
        let source = |i: usize| match (usize::try_from(labels[i]), usize::try_from(ends[i])) {
            (Ok(a), Ok(b)) => DotSource::Limb([a, b], fractions[i]),
            (Ok(k), Err(_)) => DotSource::Joint(k),
            _ => DotSource::Noise(None),
        };
        Ok(synth::PointLightDisplay {
            times_s,
            dots,
            points: self.points,
            centre_px: DVec2::from(self.centre_px),
            period_s: self.period_s,
            positions_px: positions.into_iter().map(DVec2::from).collect(),
            sources: (0..frames * dots).map(source).collect(),
        })
    }
}

/// The displays of several actors as one, with `offsets_px`, (u, v) for each, added to their dots.
///
/// The displays must have the same times. Dots, and the points that `labels` count, continue from one display to the
/// next. The centre is the mean of the centres. Without offsets, everything stays where it is.
#[pyfunction]
#[pyo3(signature = (displays, offsets_px=None))]
pub fn pointlight_together(
    py: Python<'_>,
    displays: Vec<PyRef<'_, PointLightDisplay>>,
    offsets_px: Option<Vec<[f64; 2]>>,
) -> PyResult<PointLightDisplay> {
    let all: Vec<_> = displays.iter().map(|one| one.core(py)).collect::<PyResult<_>>()?;
    let offsets = offsets_px.unwrap_or_else(|| vec![[0.0; 2]; all.len()]);
    let offsets: Vec<DVec2> = offsets.into_iter().map(DVec2::from).collect();
    PointLightDisplay::of(py, displays_together(&all, &offsets).map_err(value_error)?)
}

/// The cycle that several actors have in common: its period, and its start after the first frame, seconds.
///
/// `positions` and `names` have one entry per actor: points (T, K, 3) and their K names. All have the same times. The
/// period, if it is not given, and the start are those that fit all actors best together. `memo.pointlight` takes them
/// as `period_s` and `cycle_start_s`, so that the displays keep the timing between the actors.
#[pyfunction]
#[pyo3(signature = (positions, times_s, names, *, period_s=None))]
pub fn pointlight_cycle(
    py: Python<'_>,
    positions: Vec<Bound<'_, PyAny>>,
    times_s: Vec<f64>,
    names: Vec<Vec<String>>,
    period_s: Option<f64>,
) -> PyResult<(f64, f64)> {
    if positions.len() != names.len() {
        let [actors, lists] = [counted(positions.len(), "actor"), counted(names.len(), "list")];
        return Err(PyValueError::new_err(format!("positions are of {actors}, but names are {lists}")));
    }
    let each = positions.iter().zip(names);
    let motions: Vec<_> =
        each.map(|(points, names)| motion_of(points, times_s.clone(), names)).collect::<PyResult<_>>()?;
    let cut = py.detach(|| common_cycle(&motions, period_s)).map_err(value_error)?;
    Ok((cut.period_s, cut.start_s))
}

/// Motion of the body model walking through the origin.
///
/// `cycles`, in place of `frames`: a whole number of gait cycles, each of a whole number of frames, so that the motion
/// on the spot loops without a jump; the speed is the nearest that allows this.
///
/// Defaults: `frames` 60, `rate_hz` 60, `speed_mps` 1.3, `heading_deg` 0, `phase` 0, `height_m` 1.75.
#[pyfunction]
#[pyo3(signature = (
    frames=None, *, rate_hz=None, speed_mps=None, heading_deg=None, phase=None, height_m=None, cycles=None
))]
#[allow(clippy::too_many_arguments, reason = "each is a property of the walk")]
pub fn walker_motion(
    py: Python<'_>,
    frames: Option<Whole<usize>>,
    rate_hz: Option<f64>,
    speed_mps: Option<f64>,
    heading_deg: Option<f64>,
    phase: Option<f64>,
    height_m: Option<f64>,
    cycles: Option<Whole<usize>>,
) -> PyResult<WalkerMotion> {
    let frames = frames.must_be("frames", "between 1 and 1000000")?;
    let cycles = cycles.must_be("cycles", FROM_1)?;
    if frames.is_some() && cycles.is_some() {
        return Err(PyValueError::new_err("give either frames or cycles"));
    }
    let body = Body::from_height(height_m.unwrap_or(WALKER_HEIGHT_M)).map_err(value_error)?;
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let usual = SampledWalkOptions::default();
    let options = SampledWalkOptions {
        frames: frames.unwrap_or(usual.frames),
        rate_hz: rate_hz.unwrap_or(usual.rate_hz),
        speed_mps: speed_mps.unwrap_or(usual.speed_mps),
        heading_rad: heading_deg.map_or(usual.heading_rad, f64::to_radians),
        phase: phase.unwrap_or(usual.phase),
    };
    let options = match cycles {
        Some(cycles) => options.of_whole_cycles(&walker, cycles).map_err(value_error)?,
        None => options,
    };
    let motion = py.detach(|| sampled_walk(&walker, &options)).map_err(value_error)?;
    WalkerMotion::of(py, motion, options.cycle_s(&walker))
}

const LOCOMOTIONS: [(&str, Locomotion); 3] = [
    ("treadmill", Locomotion::Treadmill),
    ("translating", Locomotion::Translating),
    ("pelvis", Locomotion::PelvisFixed),
];

/// A point-light display of points over time (T, K, 3), world metres, Z up, NaN if unknown.
///
/// `cycles`: one cycle of the motion, that many times, without a jump from its end to its start, `tempo` times as
/// fast. `period_s`: its period, for `cycles` and `scramble_phase="periodic"`; by default the whole motion, if its end
/// leads to its start, or else the lag at which it repeats itself best. `cycle_start_s`: where the cycle starts, seconds
/// after the first frame; by default where it closes best. `scramble_limit_px`: largest shift along each of
/// `scramble_axes`; by default, the extent of the figure. `locomotion="pelvis"` needs both hips among the names;
/// joints may have any usual name. `max_shift_s` needs `scramble_phase="shortened"`.
///
/// Defaults: `azimuth_deg` 0, `elevation_deg` 0, `px_per_m` 200, `locomotion` "treadmill", `tempo` 1,
/// `scramble_axes` "both", `max_shift_s` 0.5, `life_dots` 8, `life_sites` "limbs", `noise_dots` 0,
/// `noise_kind` "scrambled", `noise_area` 1.5, `noise_speed_px_s` 60, `noise_sd_px` 0, `seed` 0.
#[pyfunction]
#[pyo3(signature = (
    positions, times_s, names, *, azimuth_deg=None, elevation_deg=None, px_per_m=None, camera=None,
    locomotion=None, cycles=None, tempo=None, inverted=false, mirrored=false, reversed=false,
    scramble_position=false, scramble_axes=None, scramble_limit_px=None, scramble_phase=None, period_s=None,
    cycle_start_s=None, max_shift_s=None, lifetime_frames=None, life_dots=None, life_sites=None, limbs=None, synchronous=false,
    noise_dots=None, noise_kind=None, noise_area=None, noise_speed_px_s=None, noise_sd_px=None, seed=None
))]
#[allow(clippy::too_many_arguments, reason = "each is one of the usual conditions of a display")]
pub fn pointlight(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    times_s: Vec<f64>,
    names: Vec<String>,
    azimuth_deg: Option<f64>,
    elevation_deg: Option<f64>,
    px_per_m: Option<f64>,
    camera: Option<PyCamera>,
    locomotion: Option<&str>,
    cycles: Option<Whole<usize>>,
    tempo: Option<f64>,
    inverted: bool,
    mirrored: bool,
    reversed: bool,
    scramble_position: bool,
    scramble_axes: Option<&str>,
    scramble_limit_px: Option<f64>,
    scramble_phase: Option<&str>,
    period_s: Option<f64>,
    cycle_start_s: Option<f64>,
    max_shift_s: Option<f64>,
    lifetime_frames: Option<Whole<usize>>,
    life_dots: Option<Whole<usize>>,
    life_sites: Option<&str>,
    limbs: Option<Vec<[Whole<usize>; 2]>>,
    synchronous: bool,
    noise_dots: Option<Whole<usize>>,
    noise_kind: Option<&str>,
    noise_area: Option<f64>,
    noise_speed_px_s: Option<f64>,
    noise_sd_px: Option<f64>,
    seed: Option<Whole<u64>>,
) -> PyResult<PointLightDisplay> {
    let lifetime_frames = lifetime_frames.must_be("lifetime_frames", FROM_1)?;
    let life_dots = life_dots.must_be("life_dots", FROM_1)?;
    let limbs = limbs.must_be("limbs", "pairs of indices from 0")?;
    let motion = motion_of(positions, times_s, names)?;
    let usual = PointLightOptions::default();
    let parallel = parallel(&usual.view, azimuth_deg, elevation_deg, px_per_m);
    let locomotion = locomotion.map(|name| chosen("locomotion", name, LOCOMOTIONS)).transpose()?;
    let life = |frames| limited_life(frames, life_dots, life_sites, limbs, synchronous);
    let options = PointLightOptions {
        seed: seed.must_be("seed", FROM_0)?.unwrap_or(usual.seed),
        view: camera.map_or(parallel, |camera| DisplayView::Perspective(Box::new(camera.0))),
        locomotion: locomotion.unwrap_or(usual.locomotion),
        is_inverted: inverted,
        is_mirrored: mirrored,
        is_reversed: reversed,
        cycles: repeated(cycles.must_be("cycles", FROM_1)?, tempo)?,
        period_s,
        cycle_start_s,
        scrambles_position: moved(scramble_position, scramble_axes, scramble_limit_px)?,
        scrambles_phase: shifts(scramble_phase, max_shift_s)?,
        limited_life: lifetime_frames.map(life).transpose()?,
        noise_dots: noise(
            noise_dots.must_be("noise_dots", FROM_0)?,
            noise_kind,
            noise_area,
            noise_speed_px_s,
        )?,
        noise_sd_px: noise_sd_px.unwrap_or(usual.noise_sd_px),
    };
    let shown = py.detach(|| point_light_display(&motion, &options)).map_err(value_error)?;
    PointLightDisplay::of(py, shown)
}

fn motion_of(positions: &Bound<'_, PyAny>, times_s: Vec<f64>, names: Vec<String>) -> PyResult<PointMotion> {
    let (points, frames, count) = motion_from_numpy::<3>(positions)?;
    if times_s.len() != frames || names.len() != count {
        let given = format!("{} and {}", counted(times_s.len(), "time"), counted(names.len(), "name"));
        return Err(PyValueError::new_err(format!(
            "positions are ({frames}, {count}, 3), but there are {given}"
        )));
    }
    PointMotion::new(points.into_iter().map(DVec3::from).collect(), names, times_s).map_err(value_error)
}

/// A parallel projection; what is not given is as in `usual`.
fn parallel(
    usual: &DisplayView,
    azimuth: Option<f64>,
    elevation: Option<f64>,
    scale: Option<f64>,
) -> DisplayView {
    match usual {
        &DisplayView::Orthographic { azimuth_rad, elevation_rad, px_per_m } => DisplayView::Orthographic {
            azimuth_rad: azimuth.map_or(azimuth_rad, f64::to_radians),
            elevation_rad: elevation.map_or(elevation_rad, f64::to_radians),
            px_per_m: scale.unwrap_or(px_per_m),
        },
        DisplayView::Perspective(_) => usual.clone(),
    }
}

fn repeated(cycles: Option<usize>, tempo: Option<f64>) -> PyResult<Option<CycleOptions>> {
    let tempo_of = || tempo.unwrap_or(CycleOptions::default().tempo);
    match (cycles, tempo) {
        (None, Some(_)) => Err(PyValueError::new_err("tempo needs cycles")),
        _ => Ok(cycles.map(|cycles| CycleOptions { cycles, tempo: tempo_of() })),
    }
}

const AXES: [(&str, ScrambleAxes); 3] = [
    ("both", ScrambleAxes::Both),
    ("horizontal", ScrambleAxes::Horizontal),
    ("vertical", ScrambleAxes::Vertical),
];

fn moved(is_moved: bool, axes: Option<&str>, limit_px: Option<f64>) -> PyResult<Option<PositionScramble>> {
    if !is_moved && (axes.is_some() || limit_px.is_some()) {
        let message = "scramble_axes and scramble_limit_px need scramble_position";
        return Err(PyValueError::new_err(message));
    }
    let axes = axes.map(|name| chosen("scramble_axes", name, AXES)).transpose()?;
    let axes = axes.unwrap_or(PositionScramble::default().axes);
    Ok(is_moved.then_some(PositionScramble { axes, limit_px }))
}

fn shifts(kind: Option<&str>, max_shift_s: Option<f64>) -> PyResult<Option<PhaseScramble>> {
    let shortened =
        PhaseScramble::Shortened { max_shift_s: max_shift_s.unwrap_or(PhaseScramble::MAX_SHIFT_S) };
    let kinds = [("periodic", PhaseScramble::Periodic), ("shortened", shortened)];
    let kind = kind.map(|name| chosen("scramble_phase", name, kinds)).transpose()?;
    if max_shift_s.is_some() && !matches!(kind, Some(PhaseScramble::Shortened { .. })) {
        return Err(PyValueError::new_err("max_shift_s needs scramble_phase \"shortened\""));
    }
    Ok(kind)
}

fn limited_life(
    frames: usize,
    dots: Option<usize>,
    sites: Option<&str>,
    limbs: Option<Vec<[usize; 2]>>,
    synchronous: bool,
) -> PyResult<LimitedLife> {
    let usual = LimitedLife::default();
    let limbs = LifeSites::Limbs(limbs.unwrap_or_default());
    let kinds = [("limbs", limbs), ("joints", LifeSites::Joints)];
    let sites = sites.unwrap_or(sites_name(&usual.sites));
    let sites = chosen("life_sites", sites, kinds)?;
    Ok(LimitedLife { dots: dots.unwrap_or(usual.dots), frames, sites, synchronous })
}

fn sites_name(sites: &LifeSites) -> &'static str {
    match sites {
        LifeSites::Limbs(_) => "limbs",
        LifeSites::Joints => "joints",
    }
}

fn noise(
    count: Option<usize>,
    kind: Option<&str>,
    area: Option<f64>,
    speed_px_s: Option<f64>,
) -> PyResult<Option<NoiseDots>> {
    let usual = NoiseDots::default();
    let kinds = noise_kinds(speed_px_s.unwrap_or(NoiseKind::SPEED_PX_S));
    let kind = kind.map(|name| chosen("noise_kind", name, kinds)).transpose()?.unwrap_or(usual.kind);
    let area_scale = area.unwrap_or(usual.area_scale);
    Ok(count.filter(|&count| count > 0).map(|count| NoiseDots { count, kind, area_scale }))
}

fn noise_kinds(speed_px_s: f64) -> [(&'static str, NoiseKind); 3] {
    [
        ("scrambled", NoiseKind::ScrambledWalker),
        ("linear", NoiseKind::Linear { speed_px_s }),
        ("flicker", NoiseKind::Flicker),
    ]
}

pub fn walker_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let SampledWalkOptions { frames, rate_hz, speed_mps, heading_rad, phase } = SampledWalkOptions::default();
    dict!(py, {
        frames: frames,
        rate_hz: rate_hz,
        speed_mps: speed_mps,
        heading_deg: heading_rad.to_degrees(),
        phase: phase,
        height_m: WALKER_HEIGHT_M,
    })
}

pub fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let (usual, life, noise) = (PointLightOptions::default(), LimitedLife::default(), NoiseDots::default());
    let [azimuth_rad, elevation_rad, px_per_m] = match usual.view {
        DisplayView::Orthographic { azimuth_rad, elevation_rad, px_per_m } => {
            [azimuth_rad, elevation_rad, px_per_m]
        }
        DisplayView::Perspective(_) => [f64::NAN; 3],
    };
    dict!(py, {
        azimuth_deg: azimuth_rad.to_degrees(),
        elevation_deg: elevation_rad.to_degrees(),
        px_per_m: px_per_m,
        locomotion: name_of(&usual.locomotion, &LOCOMOTIONS),
        inverted: usual.is_inverted,
        mirrored: usual.is_mirrored,
        reversed: usual.is_reversed,
        tempo: CycleOptions::default().tempo,
        scramble_position: usual.scrambles_position.is_some(),
        scramble_axes: name_of(&PositionScramble::default().axes, &AXES),
        max_shift_s: PhaseScramble::MAX_SHIFT_S,
        life_dots: life.dots,
        life_sites: sites_name(&life.sites),
        synchronous: life.synchronous,
        noise_dots: usual.noise_dots.map_or(0, |noise| noise.count),
        noise_kind: name_of(&noise.kind, &noise_kinds(NoiseKind::SPEED_PX_S)),
        noise_area: noise.area_scale,
        noise_speed_px_s: NoiseKind::SPEED_PX_S,
        noise_sd_px: usual.noise_sd_px,
        seed: usual.seed,
    })
}

pub fn picture_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let DotPicture { size_px, centre_px: _, dot_px, shape, colour, background, is_smooth } =
        DotPicture::default();
    dict!(py, {
        size_px: (size_px[0], size_px[1]),
        dot_px: dot_px,
        shape: name_of(&shape, &SHAPES),
        colour: (colour[0], colour[1], colour[2]),
        background: (background[0], background[1], background[2]),
        smooth: is_smooth,
    })
}

fn name_of<T: PartialEq>(value: &T, all: &[(&'static str, T)]) -> Option<&'static str> {
    all.iter().find(|(_, other)| other == value).map(|(name, _)| *name)
}

/// The point or the limb's first end, the limb's second end, and the place along the limb.
fn shows(source: &DotSource) -> (i64, i64, f64) {
    match *source {
        DotSource::Joint(k) => (k as i64, -1, 0.0),
        DotSource::Limb([a, b], fraction) => (a as i64, b as i64, fraction),
        DotSource::Noise(_) => (-1, -1, 0.0),
    }
}

fn per_dot<'py, T: numpy::Element>(
    py: Python<'py>,
    shown: &synth::PointLightDisplay,
    values: impl Iterator<Item = T>,
) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
    numpy_from_flat(py, values.collect(), vec![shown.times_s.len(), shown.dots])
}

/// The value of this name.
fn chosen<T, const N: usize>(option: &str, given: &str, all: [(&'static str, T); N]) -> PyResult<T> {
    let known = all.each_ref().map(|(name, _)| *name).join(", ");
    all.into_iter()
        .find(|(name, _)| *name == given)
        .map(|(_, value)| value)
        .ok_or_else(|| PyValueError::new_err(format!("{option} must be one of {known}; got {given}")))
}
