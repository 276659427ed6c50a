//! Figures from planar motion.

use crate::array::{motion_from_numpy, numpy_from_column, numpy_from_flat, rows_from_numpy};
use crate::error::value_error;
use crate::wait::watched;
use glam::DVec2;
use memo_core::planar::{
    Chain, DepthSource, EvidenceOptions, FalseTargetRate, Figure, FigureOptions, FitOptions, Interpretation,
    Method, Status, Undecided, Verdict, at_one_scale, hinge_depths, interpret_with_progress, joint_of,
    perspective_of_figure_px, rod_depths,
};
use memo_core::progress::Progress;
use numpy::PyArrayDyn;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::sync::Arc;

/// Depths z1, z2, z3 (N, 3) of N rods from three views each: image vectors (N, 3, 2) from pivot to end. NaN for
/// rods without a solution.
#[pyfunction]
pub fn planar_rods<'py>(py: Python<'py>, views: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let views = rows_from_numpy(views, 3)?;
    let views = views.as_slice()?;
    let (problems, _) = views.as_chunks::<2>().0.as_chunks::<3>();
    let mut depths = vec![[0.0; 3]; problems.len()];
    py.detach(|| rod_depths(problems, &mut depths));
    numpy_from_flat(py, depths.into_flattened(), vec![problems.len(), 3])
}

/// Depths (N, 4) of N hinges from two views each: image vectors (N, 4, 2) from the pivot to the first end in both
/// views, then to the second; depths in the same order. NaN for hinges without a solution.
#[pyfunction]
pub fn planar_hinges<'py>(
    py: Python<'py>,
    views: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let views = rows_from_numpy(views, 4)?;
    let views = views.as_slice()?;
    let (problems, _) = views.as_chunks::<2>().0.as_chunks::<4>();
    let mut depths = vec![[0.0; 4]; problems.len()];
    py.detach(|| hinge_depths(problems, &mut depths));
    numpy_from_flat(py, depths.into_flattened(), vec![problems.len(), 4])
}

/// Finds a linkage of limbs in planar motion in unnamed tracks (T, K, 2), NaN for points not seen.
///
/// `names`: names of the points that are joints (`RKN` or `right_knee`); joint limits then distinguish limbs from
/// their mirror images. `scales` (T,): scale of each frame, by which its points are divided. `focal_px`: focal
/// length in pixels. `progress` is called with the number of windows done and the number of all windows.
///
/// Returns windows (a list of dicts); depth (T, K) relative to the first point of each chain, NaN if unknown;
/// sources (T,) of "planar", "carried" or "unknown"; and perspective_px, the largest displacement of a point by
/// perspective, None without `focal_px`.
#[pyfunction]
#[pyo3(signature = (
    tracks, times_s, noise_px=0.0, *, window_s=1.2, size_px=None, carry=false, false_target_rate=0.01,
    max_tilt_deg=80.0, names=None, scales=None, focal_px=None, progress=None
))]
#[allow(clippy::too_many_arguments, reason = "keyword options")]
pub fn planar<'py>(
    py: Python<'py>,
    tracks: &Bound<'py, PyAny>,
    times_s: Vec<f64>,
    noise_px: f64,
    window_s: f64,
    size_px: Option<f64>,
    carry: bool,
    false_target_rate: f64,
    max_tilt_deg: f64,
    names: Option<Vec<String>>,
    scales: Option<Vec<f64>>,
    focal_px: Option<f64>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (points, frames, count) = motion_from_numpy::<2>(tracks)?;
    let rates = [FalseTargetRate::OnePercent, FalseTargetRate::FivePercent];
    let Some(rate) = rates.into_iter().find(|rate| rate.fraction() == false_target_rate) else {
        let message = format!("false_target_rate must be 0.01 or 0.05, got {false_target_rate}");
        return Err(PyValueError::new_err(message));
    };
    let options = FigureOptions {
        fit: FitOptions { noise_sd: noise_px, max_tilt_deg, ..FigureOptions::default().fit },
        evidence: EvidenceOptions { rate, ..EvidenceOptions::default() },
        size: size_px,
        window_s,
        carries_structure: carry,
        ..FigureOptions::default()
    };
    let mut tracks: Vec<Vec<DVec2>> =
        (0..count).map(|k| (0..frames).map(|t| DVec2::from(points[t * count + k])).collect()).collect();
    if let Some(scales) = scales {
        for track in &mut tracks {
            *track = at_one_scale(track, &scales).map_err(value_error)?;
        }
    }
    let joints: Option<Vec<_>> = names.map(|names| names.iter().map(|name| joint_of(name)).collect());
    let tracks = Arc::new(tracks);
    let of_worker = Arc::clone(&tracks);
    let interpret = move |progress: &Progress| {
        interpret_with_progress(&of_worker, joints.as_deref(), &times_s, &options, progress)
    };
    let found = watched(py, progress, interpret)?.map_err(value_error)?;
    let perspective_px = focal_px.map(|focal_px| perspective_of_figure_px(&tracks, &found.depth, focal_px));
    let result = dict_of(py, found, frames, count)?;
    result.set_item("perspective_px", perspective_px)?;
    Ok(result)
}

fn dict_of(
    py: Python<'_>,
    found: Interpretation,
    frames: usize,
    count: usize,
) -> PyResult<Bound<'_, PyDict>> {
    let windows = PyList::empty(py);
    for window in &found.windows {
        let row = figure(py, &window.figure)?;
        row.set_item("start", window.start)?;
        row.set_item("end", window.end)?;
        row.set_item("status", status(window.status))?;
        let [planar, refuted, undecided] = window.chains;
        row.set_item("planar", planar)?;
        row.set_item("refuted", refuted)?;
        row.set_item("undecided", undecided)?;
        windows.append(row)?;
    }
    let sources: Vec<&str> = found.sources.iter().map(|s| source(*s)).collect();
    let result = PyDict::new(py);
    result.set_item("windows", windows)?;
    result.set_item("depth", numpy_from_flat(py, found.depth, vec![frames, count])?)?;
    result.set_item("sources", sources)?;
    Ok(result)
}

fn figure<'py>(py: Python<'py>, figure: &Figure) -> PyResult<Bound<'py, PyDict>> {
    let chains = PyList::empty(py);
    for part in &figure.chains {
        chains.append(chain(py, part)?)?;
    }
    let row = PyDict::new(py);
    row.set_item("method", if figure.method == Method::Cover { "cover" } else { "forest" })?;
    row.set_item("chains", chains)?;
    row.set_item(
        "joints",
        figure.joints.iter().map(|j| (j.points[0], j.points[1], j.apart)).collect::<Vec<_>>(),
    )?;
    row.set_item("alone", figure.alone.clone())?;
    row.set_item("cost", figure.cost)?;
    row.set_item("size", figure.size)?;
    Ok(row)
}

fn chain<'py>(py: Python<'py>, chain: &Chain) -> PyResult<Bound<'py, PyDict>> {
    let links = PyList::empty(py);
    for link in &chain.links {
        let row = PyDict::new(py);
        row.set_item("points", (link.points[0], link.points[1]))?;
        row.set_item("length", link.length)?;
        row.set_item("length_sd", link.length_sd)?;
        row.set_item("margin", link.margin)?;
        row.set_item("confidence", link.confidence)?;
        links.append(row)?;
    }
    let row = PyDict::new(py);
    let frames = chain.depth.len();
    let depth: Vec<f64> = chain.depth.iter().flatten().copied().collect();
    row.set_item("points", chain.points.clone())?;
    row.set_item("links", links)?;
    row.set_item("slope", (chain.plane.p, chain.plane.q))?;
    row.set_item("tilt_deg", chain.plane.tilt_rad().to_degrees())?;
    row.set_item("residual", chain.residual_rms)?;
    row.set_item("reflection_margin_deg", chain.reflection_margin_deg)?;
    row.set_item("verdict", verdict(chain.evidence.verdict))?;
    row.set_item("statistic", chain.evidence.statistic)?;
    row.set_item("threshold", chain.evidence.threshold)?;
    row.set_item("motion", chain.evidence.motion)?;
    row.set_item("depth", numpy_from_flat(py, depth, vec![frames, chain.points.len()])?)?;
    row.set_item(
        "angle_deg",
        numpy_from_column(py, chain.angle_rad.iter().map(|a| a.to_degrees()).collect::<Vec<f64>>()),
    )?;
    Ok(row)
}

fn status(status: Status) -> &'static str {
    match status {
        Status::Interpreted => "interpreted",
        Status::Lost => "lost",
        Status::Still => "still",
        Status::Unseen => "unseen",
    }
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Planar => "planar",
        Verdict::NotPlanar => "not planar",
        Verdict::Undecided(Undecided::LittleMotion) => "little motion",
        Verdict::Undecided(Undecided::EdgeOn) => "edge-on",
        Verdict::Undecided(Undecided::FewViews) => "few views",
        Verdict::Unfalsifiable => "unfalsifiable",
    }
}

fn source(source: DepthSource) -> &'static str {
    match source {
        DepthSource::Planar => "planar",
        DepthSource::Carried => "carried",
        DepthSource::Unknown => "unknown",
    }
}
