//! Point-light displays.

use crate::array::{motion_from_numpy, numpy_from_column, numpy_from_flat};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::result::result;
use glam::DVec3;
use memo_core::model::{Body, Gait, GaitStyle, Walker};
use memo_core::synth::{
    self, DotSource, LifeSites, LimitedLife, Locomotion, Motion, NoiseDots, NoiseKind, PhaseScramble,
    PointLightOptions, View, WalkOptions, point_light_display, sampled_walk,
};
use memo_core::wording::counted;
use numpy::{PyArray1, PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

result! {
    /// Motion of the body model.
    WalkerMotion |py, motion: Motion, cycle: f64| {
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
    }
    |own| Python::attach(|py| match own.visible.bind(py).shape() {
        [frames, dots] => format!("{} in {}", counted(*dots, "dot"), counted(*frames, "frame")),
        _ => String::new(),
    })
}

/// Motion of the body model walking through the origin.
#[pyfunction]
#[pyo3(signature = (frames=60, *, rate_hz=60.0, speed_mps=1.3, heading_deg=0.0, phase=0.0, height_m=1.75))]
pub fn walker_motion(
    py: Python<'_>,
    frames: usize,
    rate_hz: f64,
    speed_mps: f64,
    heading_deg: f64,
    phase: f64,
    height_m: f64,
) -> PyResult<WalkerMotion> {
    let body = Body::from_height(height_m).map_err(value_error)?;
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let options = WalkOptions { frames, rate_hz, speed_mps, heading_rad: heading_deg.to_radians(), phase };
    let motion = py.detach(|| sampled_walk(&walker, &options)).map_err(value_error)?;
    WalkerMotion::of(py, motion, options.cycle_s(&walker))
}

/// A point-light display of points over time (T, K, 3), world metres, Z up, NaN if unknown.
#[pyfunction]
#[pyo3(signature = (
    positions, times_s, names, *, azimuth_deg=0.0, elevation_deg=0.0, px_per_m=200.0, camera=None,
    locomotion="treadmill", inverted=false, mirrored=false, reversed=false, scramble_position=false,
    scramble_phase=None, period_s=None, max_shift_s=0.5, lifetime_frames=None, life_dots=8,
    life_sites="limbs", limbs=None, synchronous=false, noise_dots=0, noise_kind="scrambled", noise_area=1.5,
    noise_speed_px_s=60.0, noise_sd_px=0.0, seed=0
))]
#[allow(clippy::too_many_arguments, reason = "each is one of the usual conditions of a display")]
pub fn pointlight(
    py: Python<'_>,
    positions: &Bound<'_, PyAny>,
    times_s: Vec<f64>,
    names: Vec<String>,
    azimuth_deg: f64,
    elevation_deg: f64,
    px_per_m: f64,
    camera: Option<PyCamera>,
    locomotion: &str,
    inverted: bool,
    mirrored: bool,
    reversed: bool,
    scramble_position: bool,
    scramble_phase: Option<&str>,
    period_s: Option<f64>,
    max_shift_s: f64,
    lifetime_frames: Option<usize>,
    life_dots: usize,
    life_sites: &str,
    limbs: Option<Vec<[usize; 2]>>,
    synchronous: bool,
    noise_dots: usize,
    noise_kind: &str,
    noise_area: f64,
    noise_speed_px_s: f64,
    noise_sd_px: f64,
    seed: u64,
) -> PyResult<PointLightDisplay> {
    let (points, frames, count) = motion_from_numpy::<3>(positions)?;
    if times_s.len() != frames || names.len() != count {
        let given = format!("{} and {}", counted(times_s.len(), "time"), counted(names.len(), "name"));
        return Err(PyValueError::new_err(format!(
            "positions are ({frames}, {count}, 3), but there are {given}"
        )));
    }
    let motion =
        Motion::new(points.into_iter().map(DVec3::from).collect(), names, times_s).map_err(value_error)?;
    let (azimuth_rad, elevation_rad) = (azimuth_deg.to_radians(), elevation_deg.to_radians());
    let parallel = View::Orthographic { azimuth_rad, elevation_rad, px_per_m };
    let limited = |frames| -> PyResult<LimitedLife> {
        let sites = match life_sites {
            "limbs" => LifeSites::Limbs(limbs.unwrap_or_default()),
            "joints" => LifeSites::Joints,
            other => return Err(unknown("life_sites", other, "limbs, joints")),
        };
        Ok(LimitedLife { dots: life_dots, frames, sites, synchronous })
    };
    let kind = match noise_kind {
        "scrambled" => NoiseKind::ScrambledWalker,
        "linear" => NoiseKind::Linear { speed_px_s: noise_speed_px_s },
        "flicker" => NoiseKind::Flicker,
        other => return Err(unknown("noise_kind", other, "scrambled, linear, flicker")),
    };
    let options = PointLightOptions {
        seed,
        view: camera.map_or(parallel, |camera| View::Perspective(Box::new(camera.0))),
        locomotion: match locomotion {
            "treadmill" => Locomotion::Treadmill,
            "translating" => Locomotion::Translating,
            "pelvis" => Locomotion::PelvisFixed,
            other => return Err(unknown("locomotion", other, "treadmill, translating, pelvis")),
        },
        is_inverted: inverted,
        is_mirrored: mirrored,
        is_reversed: reversed,
        scrambles_position: scramble_position,
        scrambles_phase: match scramble_phase {
            None => None,
            Some("periodic") => Some(PhaseScramble::Periodic { period_s }),
            Some("shortened") => Some(PhaseScramble::Shortened { max_shift_s }),
            Some(other) => return Err(unknown("scramble_phase", other, "periodic, shortened")),
        },
        limited_life: lifetime_frames.map(limited).transpose()?,
        noise_dots: (noise_dots > 0).then_some(NoiseDots { count: noise_dots, kind, area_scale: noise_area }),
        noise_sd_px,
    };
    let shown = py.detach(|| point_light_display(&motion, &options)).map_err(value_error)?;
    PointLightDisplay::of(py, shown)
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

fn unknown(option: &str, given: &str, known: &str) -> PyErr {
    PyValueError::new_err(format!("{option} must be one of {known}; got {given}"))
}
