//! Figures from planar motion.

use crate::array::{motion_from_numpy, numpy_from_column, numpy_from_flat, rows_from_numpy};
use crate::defaults::dict;
use crate::error::value_error;
use crate::result::{objects, result};
use crate::wait::watched;
use glam::DVec2;
use memo_core::planar::{
    Chain, DepthSource, FalseTargetRate, FigureInterpretation, FigureWindow, FitOptions, Link, Method,
    PlanarEvidenceOptions, Status, Undecided, Verdict, at_one_scale, hinge_depths, interpret_with_progress,
    joint_of, perspective_of_figure_px, rod_depths,
};
use memo_core::wording::counted;
use memo_core::{FigureOptions, Progress};
use numpy::{PyArray1, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

result! {
    /// Two points at a constant distance in space. Lengths are in pixels.
    PlanarLink |_py, link: &Link| {
        /// The two points, the lower number first.
        points: (usize, usize),
        /// Length.
        length: f64,
        /// Standard deviation of the length.
        length_sd: f64,
        /// Extra cost of the best figure without this link, infinite if there is none.
        margin: f64,
        /// Share of the weight of all figures that contain this link, 0 to 1; NaN for the method "forest".
        confidence: f64,
    }
    |own| format!("{} - {}, {:.1} px", own.points.0, own.points.1, own.length)
}

result! {
    /// One or two links in one plane over the frames of a window. Lengths are in pixels.
    PlanarChain |py, chain: &Chain| {
        /// End and end, or end, pivot and end.
        points: Vec<usize> = chain.points.clone(),
        /// The links, in that order.
        links: Vec<Py<PlanarLink>> = objects(py, chain.links.iter().map(|link| PlanarLink::of(py, link)))?,
        /// Slopes p and q of the plane.
        slope: (f64, f64) = (chain.plane.p, chain.plane.q),
        /// Angle between the plane and the image.
        tilt_deg: f64 = chain.plane.tilt_rad().to_degrees(),
        /// Root mean square of the residuals.
        residual: f64 = chain.residual_rms,
        /// By how much joint limits prefer this reflection, None if it is undecided.
        reflection_margin_deg: Option<f64> = chain.reflection_margin_deg,
        /// "planar", "not planar", "little motion", "edge-on", "few views" or "unfalsifiable".
        verdict: String = verdict(chain.evidence.verdict),
        /// F, infinite without redundancy.
        statistic: f64 = chain.evidence.statistic,
        /// Largest F that counts as planar.
        threshold: f64 = chain.evidence.threshold,
        /// Root mean square motion of the link that moves least.
        motion: f64 = chain.evidence.motion,
        /// (frames, points) depth relative to the first point, NaN if not seen; all signs may be opposite.
        depth: Py<PyArrayDyn<f64>> =
            numpy_from_flat(py, chain.depth.concat(), vec![chain.depth.len(), chain.points.len()])?,
        /// (frames,) angle at the pivot, 180 if straight; empty for one link.
        angle_deg: Py<PyArray1<f64>> =
            numpy_from_column(py, chain.angle_rad.iter().map(|angle| angle.to_degrees()).collect()),
    }
    |own| format!("{:?}, {}, tilted {:.0} deg", own.points, own.verdict, own.tilt_deg)
}

result! {
    /// The linkage in a window of time.
    PlanarWindow |py, window: &FigureWindow, tracks: &[Vec<DVec2>]| {
        /// First frame.
        start: usize = window.start,
        /// Last frame plus one.
        end: usize = window.end,
        /// "interpreted", "lost", "still", "unseen", or "nothing linked" if points are visible but none linked.
        status: String = status(window, tracks),
        /// Number of chains that move in their plane.
        planar: usize = window.chains[0],
        /// Number of chains that leave it.
        refuted: usize = window.chains[1],
        /// Number of chains without a verdict.
        undecided: usize = window.chains[2],
        /// Log odds of a body against dots that do not belong together, nats; None for the method "forest".
        evidence_nats: Option<f64> = window.evidence.map(|evidence| evidence.nats),
        /// The least that counts as a body.
        least_nats: Option<f64> = window.evidence.map(|evidence| evidence.least_nats),
        /// "cover", or "forest" if there are too many points to compare all links.
        method: String = if window.figure.method == Method::Cover { "cover" } else { "forest" },
        /// The chains of the best figure, also if the status is "lost".
        chains: Vec<Py<PlanarChain>> =
            objects(py, window.figure.chains.iter().map(|chain| PlanarChain::of(py, chain)))?,
        /// Contacts of chains and single points, best first: two points, and how far apart they are.
        joints: Vec<(usize, usize, f64)> =
            window.figure.joints.iter().map(|j| (j.points[0], j.points[1], j.apart)).collect::<Vec<_>>(),
        /// Points in no chain.
        alone: Vec<usize> = window.figure.alone.clone(),
        /// Cost of the figure, pixels; NaN for the method "forest".
        cost: f64 = window.figure.cost,
        /// Size to which costs are relative, pixels.
        size: f64 = window.figure.size,
    }
    |own| {
        let chains = counted(own.chains.len(), "chain");
        format!("frames {} to {}, {}, {chains}", own.start, own.end, own.status)
    }
}

result! {
    /// What `memo.PlanarFigure` is made of.
    PlanarInterpretation |py, found: FigureInterpretation, tracks: &[Vec<DVec2>], focal_px: Option<f64>| {
        windows: Vec<Py<PlanarWindow>> =
            objects(py, found.windows.iter().map(|window| PlanarWindow::of(py, window, tracks)))?,
        perspective_px: Option<f64> = focal_px.map(|px| perspective_of_figure_px(tracks, &found.depth, px)),
        depth: Py<PyArrayDyn<f64>> =
            numpy_from_flat(py, found.depth, vec![found.sources.len(), tracks.len()])?,
        sources: Vec<String> = found.sources.iter().map(|&of| source(of).to_owned()).collect::<Vec<_>>(),
    }
    |own| counted(own.windows.len(), "window")
}

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
#[pyfunction]
#[pyo3(signature = (
    tracks, times_s, noise_px=None, *, window_s=None, size_px=None, carry=false, false_target_rate=None,
    max_tilt_deg=None, names=None, scales=None, focal_px=None, progress=None
))]
#[allow(clippy::too_many_arguments, reason = "keyword options")]
pub fn planar(
    py: Python<'_>,
    tracks: &Bound<'_, PyAny>,
    times_s: Vec<f64>,
    noise_px: Option<f64>,
    window_s: Option<f64>,
    size_px: Option<f64>,
    carry: bool,
    false_target_rate: Option<f64>,
    max_tilt_deg: Option<f64>,
    names: Option<Vec<String>>,
    scales: Option<Vec<f64>>,
    focal_px: Option<f64>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<PlanarInterpretation> {
    if let Some(got) = focal_px.filter(|&px| !(px > 0.0 && px.is_finite())) {
        return Err(PyValueError::new_err(format!("focal_px must be positive and finite, got {got}")));
    }
    let (points, frames, count) = motion_from_numpy::<2>(tracks)?;
    let usual = FigureOptions::default();
    let options = FigureOptions {
        fit: FitOptions {
            noise_sd: noise_px.unwrap_or(usual.fit.noise_sd),
            max_tilt_deg: max_tilt_deg.unwrap_or(usual.fit.max_tilt_deg),
            ..usual.fit
        },
        evidence: false_target_rate.map_or(Ok(usual.evidence), evidence_at)?,
        size: size_px,
        window_s: window_s.unwrap_or(usual.window_s),
        carries_structure: carry,
        ..usual
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
    PlanarInterpretation::of(py, found, &tracks, focal_px)
}

pub fn defaults(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let usual = FigureOptions::default();
    dict!(py, {
        noise_px: usual.fit.noise_sd,
        window_s: usual.window_s,
        carry: usual.carries_structure,
        false_target_rate: usual.evidence.rate.fraction(),
        max_tilt_deg: usual.fit.max_tilt_deg,
    })
}

fn evidence_at(false_target_rate: f64) -> PyResult<PlanarEvidenceOptions> {
    let rates = [FalseTargetRate::OnePercent, FalseTargetRate::FivePercent];
    let Some(rate) = rates.into_iter().find(|rate| rate.fraction() == false_target_rate) else {
        let message = format!("false_target_rate must be 0.01 or 0.05, got {false_target_rate}");
        return Err(PyValueError::new_err(message));
    };
    Ok(PlanarEvidenceOptions { rate, ..FigureOptions::default().evidence })
}

fn status(window: &FigureWindow, tracks: &[Vec<DVec2>]) -> &'static str {
    match window.status {
        Status::Interpreted => "interpreted",
        Status::Lost => "lost",
        Status::Still => "still",
        Status::Unseen if tracks.iter().flat_map(|t| &t[window.start..window.end]).any(|p| p.is_finite()) => {
            "nothing linked"
        }
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
