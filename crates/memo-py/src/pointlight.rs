//! Point-light displays.

use crate::array::{motion_from_numpy, numpy_from_column, numpy_from_flat};
use crate::camera::PyCamera;
use crate::error::value_error;
use glam::DVec3;
use memo_core::model::{Body, Gait, GaitStyle, Walker};
use memo_core::synth::{
    DotSource, LifeSites, LimitedLife, Locomotion, Motion, NoiseDots, NoiseKind, PhaseScramble,
    PointLightOptions, View, WalkOptions, point_light_display, sampled_walk,
};
use memo_core::wording::counted;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Motion of the body model walking through the origin: positions (T, 13, 3) in metres, times_s, names, cycle_s.
#[pyfunction]
#[pyo3(signature = (frames=60, *, rate_hz=60.0, speed_mps=1.3, heading_deg=0.0, phase=0.0, height_m=1.75))]
pub fn walker_motion<'py>(
    py: Python<'py>,
    frames: usize,
    rate_hz: f64,
    speed_mps: f64,
    heading_deg: f64,
    phase: f64,
    height_m: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let body = Body::from_height(height_m).map_err(value_error)?;
    let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
    let options = WalkOptions { frames, rate_hz, speed_mps, heading_rad: heading_deg.to_radians(), phase };
    let motion = py.detach(|| sampled_walk(&walker, &options)).map_err(value_error)?;
    let flat = motion.positions().iter().flat_map(|p| p.to_array()).collect();
    let result = PyDict::new(py);
    result.set_item("positions", numpy_from_flat(py, flat, vec![motion.frames(), motion.points(), 3])?)?;
    result.set_item("times_s", numpy_from_column(py, motion.times_s().to_vec()))?;
    result.set_item("names", motion.names().to_vec())?;
    result.set_item("cycle_s", options.cycle_s(&walker))?;
    Ok(result)
}

/// A point-light display of points over time (T, K, 3), world metres, Z up, NaN if unknown.
///
/// Returns times_s (T,); positions_px (T, N, 2), NaN for dots that are not visible; visible (T, N); labels (T,
/// N), the index of the point shown or of a limb's first end, -1 for noise; limb_ends (T, N), the index of the
/// limb's second end or -1; fractions (T, N) along the limb.
#[pyfunction]
#[pyo3(signature = (
    positions, times_s, names, *, azimuth_deg=0.0, elevation_deg=0.0, px_per_m=200.0, camera=None,
    locomotion="treadmill", inverted=false, mirrored=false, reversed=false, scramble_position=false,
    scramble_phase=None, period_s=None, max_shift_s=0.5, lifetime_frames=None, life_dots=8,
    life_sites="limbs", limbs=None, synchronous=false, noise_dots=0, noise_kind="scrambled", noise_area=1.5,
    noise_speed_px_s=60.0, noise_sd_px=0.0, seed=0
))]
#[allow(clippy::too_many_arguments, reason = "each is one of the usual conditions of a display")]
pub fn pointlight<'py>(
    py: Python<'py>,
    positions: &Bound<'py, PyAny>,
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
) -> PyResult<Bound<'py, PyDict>> {
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
    let shape = vec![shown.times_s.len(), shown.dots];
    let (labels, rest): (Vec<i64>, Vec<(i64, f64)>) = shown
        .sources
        .iter()
        .map(|source| match *source {
            DotSource::Joint(k) => (k as i64, (-1, 0.0)),
            DotSource::Limb([a, b], fraction) => (a as i64, (b as i64, fraction)),
            DotSource::Noise(_) => (-1, (-1, 0.0)),
        })
        .unzip();
    let (limb_ends, fractions): (Vec<i64>, Vec<f64>) = rest.into_iter().unzip();
    let visible: Vec<bool> = shown.positions_px.iter().map(|p| p.is_finite()).collect();
    let flat: Vec<f64> = shown.positions_px.iter().flat_map(|p| p.to_array()).collect();
    let result = PyDict::new(py);
    result.set_item("positions_px", numpy_from_flat(py, flat, vec![shape[0], shape[1], 2])?)?;
    result.set_item("visible", numpy_from_flat(py, visible, shape.clone())?)?;
    result.set_item("labels", numpy_from_flat(py, labels, shape.clone())?)?;
    result.set_item("limb_ends", numpy_from_flat(py, limb_ends, shape.clone())?)?;
    result.set_item("fractions", numpy_from_flat(py, fractions, shape)?)?;
    result.set_item("times_s", numpy_from_column(py, shown.times_s))?;
    Ok(result)
}

fn unknown(option: &str, given: &str, known: &str) -> PyErr {
    PyValueError::new_err(format!("{option} must be one of {known}; got {given}"))
}
