//! Rohr (1994): constants, equations, model and the stages of the figures.

use crate::array::{
    frame_from_numpy, numpy_from_column, numpy_from_flat, numpy_from_image, numpy_from_rows,
    numpy_from_segments, segments_from_numpy,
};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::record::{SegmentsWithParts, segments_with_parts};
use crate::result::result;
use crate::wait::pooled;
use crate::walk::Walk;
use crate::whole::{FROM_0, Whole, WholeNumbers};
use glam::{DVec2, DVec3};
use memo_core::image::{ChangeDetector, ChangeOptions, Outline, Rectangle, outlines};
use memo_core::model::{GaitStyle, Part, VisibilityOptions, VisibleSegment, visible_contours};
use memo_core::reproduce::rohr;
use memo_core::track::evidence::{Evidence, EvidenceOptions, EvidenceStream, WindowEdges};
use memo_core::track::score::{EdgeLine, SimilarityOptions};
use memo_core::track::search::{Axis, Grid, Hypothesis, SearchResult, search};
use memo_core::wording::counted;
use memo_core::{Body, Gait, Mask, Walker};
use numpy::{PyArray1, PyArray2, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

result! {
    /// Results of the image stages: `changed`, eq. (1) against either neighbour; `cleaned` after the binary operations;
    /// `outlines` (n, 2) in pixels; `rectangle` (left, top, right, bottom) of the largest candidate, and `edges` (n, 5)
    /// in it: u0, v0, u1, v1 and gradient.
    ImageStages |py, evidence: Evidence, change: Mask, main: Rectangle, found: WindowEdges| {
        outlines: Vec<Py<PyArray2<f64>>> = {
            let rows = |o: Outline| o.pixels.into_iter().map(|p| p.map(|v| v as f64)).collect();
            let outlines = outlines(&evidence.firm_mask).into_iter();
            outlines.map(|o| Ok(numpy_from_rows(py, rows(o))?.unbind())).collect::<PyResult<Vec<_>>>()?
        },
        rectangle: [usize; 4] = [main.left, main.top, main.right, main.bottom],
        edges: Py<PyArray2<f64>> = numpy_from_rows(py, found.lines.iter().map(edge_row).collect())?,
        changed: Py<PyArray2<bool>> = numpy_from_image(py, change)?,
        cleaned: Py<PyArray2<bool>> = numpy_from_image(py, evidence.firm_mask)?,
    }
    |own| format!("rectangle {:?}", own.rectangle)
}

result! {
    /// Similarity (eq. 11) over the whole cycle: `scores` (phases, along, heights), the values of the axes, the last
    /// two as differences in metres, and the best of each.
    WalkSimilarity |py, found: SearchResult, grid: &Grid, at: &Hypothesis| {
        best: [f64; 3] = {
            let best = found.best();
            [best.phase, best.along_m - at.along_m, best.height_m - at.height_m]
        },
        scores: Py<PyArrayDyn<f32>> =
            numpy_from_flat(py, found.scores, vec![grid.phase.count, grid.along.count, grid.height.count])?,
        phase: Py<PyArray1<f64>> = numpy_from_column(py, values(&grid.phase, 0.0)),
        along: Py<PyArray1<f64>> = numpy_from_column(py, values(&grid.along, at.along_m)),
        height: Py<PyArray1<f64>> = numpy_from_column(py, values(&grid.height, at.height_m)),
    }
    |own| format!("best at phase {:.3}", own.best[0])
}

/// The paper's constants as used by the code, by name.
#[pyfunction]
pub fn rohr_numbers() -> Vec<(&'static str, f64)> {
    rohr::numbers()
}

/// Largest difference of the two sides of each equation, computed in two ways, by name.
#[pyfunction]
#[pyo3(signature = (seed=Whole::from(0)), text_signature = "(seed=0)")]
pub fn rohr_deviations(py: Python<'_>, seed: Whole<u64>) -> PyResult<Vec<(&'static str, f64)>> {
    let seed = seed.must_be("seed", FROM_0)?;
    Ok(py.detach(|| rohr::deviations(seed)))
}

fn gait_of(name: &str) -> PyResult<Gait> {
    match name {
        "dense" => Ok(Gait::dense()),
        "sampled_10" => Ok(Gait::sampled_10()),
        other => Err(PyValueError::new_err(format!("gait must be 'dense' or 'sampled_10', got {other:?}"))),
    }
}

/// The right side's curves at phases: (N, 5) of hip, knee, shoulder, elbow in degrees and the body's vertical
/// displacement in metres.
#[pyfunction]
pub fn gait_curves<'py>(
    py: Python<'py>,
    gait: &str,
    phases: Vec<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let gait = gait_of(gait)?;
    let row = |phase: &f64| {
        let a = gait.posture(*phase, &GaitStyle::default()).right;
        let [hip, knee, shoulder, elbow] = [a.hip, a.knee, a.shoulder, a.elbow].map(f64::to_degrees);
        [hip, knee, shoulder, elbow, gait.vertical_m(*phase)]
    };
    numpy_from_rows(py, phases.iter().map(row).collect())
}

/// The parts of a body: name, length and the two semi-axes, metres.
#[pyfunction]
pub fn body_parts(height_m: f64) -> PyResult<Vec<(String, f64, f64, f64)>> {
    let body = Body::from_height(height_m).map_err(value_error)?;
    let posed = body.pose(DVec3::ZERO, 0.0, &Gait::dense().posture(0.0, &GaitStyle::default()));
    let row = |(part, cylinder): (Part, &memo_core::model::EllipticCylinder)| {
        let a = cylinder.semi_axes;
        (format!("{part:?}"), 2.0 * cylinder.half_length, a.x, a.y)
    };
    Ok(Part::ALL.into_iter().zip(&posed.cylinders).map(row).collect())
}

/// Segments (n, 2, 2) in pixels, and for each its part and its walker.
type Contours<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<i64>>);

/// Contours of walkers on the ground, each (x_m, y_m, heading_rad, phase, height_m). Parts hidden by the same or
/// another walker are removed unless `hidden` is true.
#[pyfunction]
#[pyo3(signature = (camera, walkers, *, gait="dense", hidden=false))]
pub fn model_contours<'py>(
    py: Python<'py>,
    camera: PyCamera,
    walkers: Vec<[f64; 5]>,
    gait: &str,
    hidden: bool,
) -> PyResult<Contours<'py>> {
    let camera = camera.0;
    let gait = gait_of(gait)?;
    let mut cylinders = Vec::new();
    for [x, y, heading_rad, phase, height_m] in walkers {
        if ![x, y, heading_rad, phase].iter().all(|value| value.is_finite()) {
            return Err(PyValueError::new_err("place, heading and phase of a walker must be finite"));
        }
        let body = Body::from_height(height_m).map_err(value_error)?;
        let walker = Walker { body, gait: gait.clone(), style: GaitStyle::default() };
        let centre = DVec3::new(x, y, walker.level_torso_height_m());
        cylinders.extend(walker.pose(centre, heading_rad, phase).cylinders);
    }
    let mut visible = Vec::new();
    if hidden {
        for (part, cylinder) in cylinders.iter().enumerate() {
            let mut alone = Vec::new();
            visible_contours(
                std::slice::from_ref(cylinder),
                camera.position(),
                &VisibilityOptions::DRAWN,
                &mut alone,
            );
            visible.extend(alone.into_iter().map(|piece| VisibleSegment { part, ..piece }));
        }
    } else {
        visible_contours(&cylinders, camera.position(), &VisibilityOptions::DRAWN, &mut visible);
    }
    let (mut segments, mut parts, mut owners) = (Vec::new(), Vec::new(), Vec::new());
    for piece in &visible {
        let Some(ends_px) = piece.ends_px(&camera) else { continue };
        segments.push(ends_px.map(|p| p.to_array()));
        parts.push((piece.part % Part::ALL.len()) as u8);
        owners.push((piece.part / Part::ALL.len()) as i64);
    }
    Ok((numpy_from_segments(py, segments)?, numpy_from_column(py, parts), numpy_from_column(py, owners)))
}

/// Image stages for a frame with its neighbours; None if nothing moves.
#[pyfunction]
pub fn image_stages(
    py: Python<'_>,
    before: &Bound<'_, PyAny>,
    frame: &Bound<'_, PyAny>,
    after: &Bound<'_, PyAny>,
) -> PyResult<Option<ImageStages>> {
    let arrays = [frame_from_numpy(before)?, frame_from_numpy(frame)?, frame_from_numpy(after)?];
    let [before, frame, after] = [arrays[0].as_frame()?, arrays[1].as_frame()?, arrays[2].as_frame()?];
    let options = EvidenceOptions::default();
    let firm = ChangeOptions { min_threshold: options.rectangle_threshold, ..options.change };
    let (mut detector, mut stream) =
        (ChangeDetector::new(firm).map_err(value_error)?, EvidenceStream::new(options));
    let (mut changed, mut evidence) = (None, None);
    for (index, frame) in [before, frame, after].iter().enumerate() {
        changed = detector.push(frame).map_err(value_error)?;
        evidence = stream.push(frame, index as f64).map_err(value_error)?.pop();
    }
    let (Some(changed), Some(evidence)) = (changed, evidence) else {
        return Err(PyValueError::new_err("three frames gave no evidence"));
    };
    let Some(main) = evidence.candidates(&options).into_iter().next() else { return Ok(None) };
    let edges = evidence.edges(&main.rectangle, None, &options).map_err(value_error)?;
    ImageStages::of(py, evidence, changed, main.rectangle, edges).map(Some)
}

fn edge_row(edge: &EdgeLine) -> [f64; 5] {
    let ([a, b], [c, d]) = (edge.start, edge.end);
    [a, b, c, d, edge.gradient].map(f64::from)
}

/// The search windows of contours (N, 2, 2): their corners (N, 4, 2), pixels.
#[pyfunction]
#[pyo3(signature = (lines, c_r=f64::from(SimilarityOptions::DEFAULT.c_r)))]
pub fn search_windows<'py>(
    py: Python<'py>,
    lines: &Bound<'py, PyAny>,
    c_r: f64,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let lines = segments_from_numpy(lines)?;
    let point = |p: [f32; 2]| DVec2::from_array(p.map(f64::from));
    let corners = |[start, end]: &[[f32; 2]; 2]| rohr::search_window(point(*start), point(*end), c_r);
    let flat: Vec<f64> = lines.iter().flat_map(corners).flat_map(|corner| corner.to_array()).collect();
    numpy_from_flat(py, flat, vec![lines.len(), 4, 2])
}

/// State of the Kalman filter after each frame of a walk, not smoothed: (rows, 6) of world x, z in metres, phase,
/// and their standard deviations.
#[pyfunction]
pub fn walk_filtered<'py>(py: Python<'py>, walk: PyRef<'py, Walk>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (tracked, _) = walk.tracked()?;
    let row = |step: &memo_core::track::walk::Step| {
        let (s, path) = (&step.state, step.look.path);
        let phase = s.phase.position.rem_euclid(1.0);
        let z = s.height.position + tracked.walk.walker.gait.vertical_m(phase);
        let sd_x = s.along.position_sd() * path.heading_rad.cos().abs();
        let x = path.point(s.along.position, 0.0).x;
        [x, z, phase, sd_x, s.height.position_sd(), s.phase.position_sd()]
    };
    numpy_from_rows(py, tracked.steps().iter().map(row).collect())
}

/// Visible side lines of the model in a row, or at the same position with another phase: segments (n, 2, 2) in
/// pixels and the part of each.
#[pyfunction]
#[pyo3(signature = (walk, row, phase=None))]
pub fn walk_lines<'py>(
    py: Python<'py>,
    walk: PyRef<'py, Walk>,
    row: Whole<usize>,
    phase: Option<f64>,
) -> PyResult<SegmentsWithParts<'py>> {
    let at = hypothesis(&walk, row)?;
    let at = Hypothesis { phase: phase.unwrap_or(at.phase), ..at };
    let (tracked, _) = walk.tracked()?;
    let visible = tracked.scene(at.along_m).visible(&at, &VisibilityOptions::default());
    segments_with_parts(py, &visible, &tracked.camera)
}

/// Similarity (eq. 11) of a frame's edges (N, 4 or more) in pixels and a walk's model near the position of a row,
/// over the whole cycle. `along_m` and `height_m` are half widths; 0 keeps the position.
#[pyfunction]
#[pyo3(signature = (walk, row, edges, *, along_m=0.0, height_m=0.0))]
pub fn walk_similarity(
    py: Python<'_>,
    walk: PyRef<'_, Walk>,
    row: Whole<usize>,
    edges: Vec<Vec<f64>>,
    along_m: f64,
    height_m: f64,
) -> PyResult<WalkSimilarity> {
    for (name, value) in [("along_m", along_m), ("height_m", height_m)] {
        if !(0.0..=2.0).contains(&value) {
            return Err(PyValueError::new_err(format!("{name} must lie between 0 and 2, got {value}")));
        }
    }
    let at = hypothesis(&walk, row)?;
    let (tracked, _) = walk.tracked()?;
    let camera = &tracked.camera;
    let ideal = |u: f64, v: f64| {
        let p = DVec2::new(u, v);
        camera.undistort(p).unwrap_or(p).as_vec2().to_array()
    };
    let edges: Vec<EdgeLine> = edges
        .iter()
        .map(|row| match row[..] {
            [a, b, c, d, ..] => {
                Ok(EdgeLine { start: ideal(a, b), end: ideal(c, d), gradient: 0.0, velocity: 0.0 })
            }
            _ => Err(PyValueError::new_err(format!("an edge has four numbers, got {}", row.len()))),
        })
        .collect::<PyResult<_>>()?;
    let grid = Grid::whole_cycle_within(at.along_m, at.height_m, [along_m, height_m]);
    let found = pooled(py, || {
        let options = &tracked.options;
        search(&edges, &tracked.scene(at.along_m), &grid, &options.similarity, options.hidden_lines)
    })?;
    WalkSimilarity::of(py, found, &grid, &at)
}

fn values(axis: &Axis, from: f64) -> Vec<f64> {
    (0..axis.count).map(|i| axis.at(i) - from).collect()
}

fn hypothesis(walk: &Walk, row: Whole<usize>) -> PyResult<Hypothesis> {
    let (tracked, rows) = walk.tracked()?;
    if tracked.fitted().is_some() {
        return Err(PyValueError::new_err("the person was fitted: give a walk of Tracker(adapt=False)"));
    }
    let row = row.index(rows.len(), "row", &format!("a walk with {}", counted(rows.len(), "row")))?;
    Ok(rows[row].hypothesis)
}
