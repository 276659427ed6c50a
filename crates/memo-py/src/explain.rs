//! `Explainer`: frames compared with the model of finished walks again, as in tracking.

use crate::array::{
    frame_from_numpy, numpy_from_column, numpy_from_image, numpy_from_rows, numpy_from_segments,
};
use crate::error::value_error;
use crate::record::{Recorded, refused};
use crate::result::result;
use crate::tracker::PyTracker;
use crate::wait::pooled;
use crate::whole::{FROM_0, Whole, WholeNumbers};
use glam::{DVec2, Vec2};
use memo_core::image::Rectangle;
use memo_core::model::{EllipticCylinder, Others};
use memo_core::track::evidence::{Evidence, EvidenceStream};
use memo_core::track::explain::{Explanation as Why, explain};
use memo_core::track::score::{Match, ModelLine};
use memo_core::track::walk::Look;
use memo_core::{Camera, TrackerOptions};
use numpy::{PyArray1, PyArray2, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashSet;

result! {
    /// The evidence of a walk in one frame and the fit of the model to it; its attributes are those of `memo.explain.Why`,
    /// in frames of the stream and pixels of the frames.
    Explanation |py, evidence: &Evidence, number: usize, look: &Look, why: &Why, camera: &Camera| {
        frame: usize = evidence.frame,
        time_s: f64 = evidence.time_s,
        walk: usize = number,
        window_px: (usize, usize, usize, usize) = {
            let Rectangle { left, top, right, bottom } = look.window;
            (left, top, right, bottom)
        },
        luma: Py<PyArray2<u8>> = numpy_from_image(py, evidence.grey.clone())?,
        change_mask: Py<PyArray2<bool>> = numpy_from_image(py, evidence.mask.clone())?,
        edge_points: Py<PyArray2<f64>> = {
            let edgels = why.edges.chains.edgels().iter();
            numpy_from_rows(py, edgels.map(|e| e.position_px.as_dvec2().to_array()).collect())?
        },
        segments: Py<PyArrayDyn<f64>> = {
            let ends = why.edges.segments.iter().map(|s| [s.start_px.to_array(), s.end_px.to_array()]);
            numpy_from_segments(py, ends.collect())?
        },
        model: Py<PyArrayDyn<f64>> = {
            let pixel = |p: [f32; 2]| camera.distort(Vec2::from(p).as_dvec2()).unwrap_or(DVec2::NAN).to_array();
            numpy_from_segments(py, why.lines.iter().map(|l| [pixel(l.start), pixel(l.end)]).collect())?
        },
        model_part: Py<PyArray1<u8>> = numpy_from_column(py, why.lines.iter().map(|l| l.part).collect()),
        model_px: Py<PyArray1<f64>> = numpy_from_column(py, why.lines.iter().map(length_px).collect()),
        model_edge: Py<PyArray1<i64>> = numpy_from_column(py, of_lines(why, -1, |m| m.edge as i64)),
        overlap_px: Py<PyArray1<f64>> =
            numpy_from_column(py, of_lines(why, f64::NAN, |m| f64::from(m.overlap_px))),
        distance_px: Py<PyArray1<f64>> =
            numpy_from_column(py, of_lines(why, f64::NAN, |m| f64::from(m.distance_px))),
        angle_rad: Py<PyArray1<f64>> =
            numpy_from_column(py, of_lines(why, f64::NAN, |m| f64::from(m.angle_rad))),
        similarity_px: Py<PyArray1<f64>> =
            numpy_from_column(py, of_lines(why, 0.0, |m| f64::from(m.similarity_px))),
        phase_grid: Py<PyArray1<f64>> =
            numpy_from_column(py, why.cycle.iter().map(|s| s.phase).collect()),
        similarity: Py<PyArray1<f64>> =
            numpy_from_column(py, why.cycle.iter().map(|s| f64::from(s.similarity)).collect()),
        phase: f64 = why.chosen.phase,
        chosen_similarity: f64 = f64::from(why.similarity.value),
    }
    |own| format!("walk {} in frame {}, similarity {:.3}", own.walk, own.frame, own.chosen_similarity)
}

fn length_px(line: &ModelLine) -> f64 {
    f64::from(Vec2::from(line.start).distance(Vec2::from(line.end)))
}

/// A value for each line of the model, from the edge matched with it, or else this one.
fn of_lines<T: Copy>(why: &Why, unmatched: T, value: impl Fn(&Match) -> T) -> Vec<T> {
    let mut values = vec![unmatched; why.lines.len()];
    for found in &why.similarity.matches {
        values[found.line] = value(found);
    }
    values
}

/// The options of a tracker.
fn options_of(tracker: &Bound<'_, PyTracker>) -> PyResult<TrackerOptions> {
    tracker.get().read(tracker.py(), |tracker| tracker.options().clone())
}

/// Explains selected frames of a stream, one frame late, or a thirtieth of a second.
#[pyclass(name = "Explainer", module = "memo._memo")]
pub struct PyExplainer {
    options: TrackerOptions,
    walks: Vec<Recorded>,
    wanted: HashSet<usize>,
    stream: Option<EvidenceStream>,
}

#[pymethods]
impl PyExplainer {
    /// `tracker` has the options of the run. `records` are those of its walks. `wanted` are the frames to explain,
    /// counted from the first frame given.
    #[new]
    fn new(
        tracker: &Bound<'_, PyTracker>,
        records: Vec<Bound<'_, PyDict>>,
        wanted: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let frame = |n: PyResult<Bound<'_, PyAny>>| n?.extract::<Whole<usize>>()?.must_be("wanted", FROM_0);
        let wanted = wanted.try_iter()?.map(frame).collect::<PyResult<_>>()?;
        let options = options_of(tracker)?;
        let walks = records.iter().map(|r| Recorded::read(r)).collect::<PyResult<_>>()?;
        let stream = Some(options.evidence_stream());
        Ok(Self { options, walks, wanted, stream })
    }

    /// Adds the next frame, (H, W) uint8, and its time in seconds. Returns the explanations of the frames whose
    /// neighbours are there now, one of each walk that they are part of, if they were requested.
    fn update(
        &mut self,
        py: Python<'_>,
        frame: &Bound<'_, PyAny>,
        time_s: f64,
    ) -> PyResult<Vec<Explanation>> {
        let array = frame_from_numpy(frame)?;
        let frame = array.as_frame()?;
        let Some(stream) = &mut self.stream else {
            return Err(PyValueError::new_err("the frames have ended"));
        };
        let evidence = py.detach(|| stream.push(&frame, time_s)).map_err(value_error)?;
        self.all_explained(py, &evidence)
    }

    /// Returns the explanations of the last frames.
    fn finish(&mut self, py: Python<'_>) -> PyResult<Vec<Explanation>> {
        let Some(mut stream) = self.stream.take() else { return Ok(Vec::new()) };
        let evidence = py.detach(|| stream.finish()).map_err(value_error)?;
        self.all_explained(py, &evidence)
    }
}

impl PyExplainer {
    fn all_explained(&self, py: Python<'_>, evidence: &[Evidence]) -> PyResult<Vec<Explanation>> {
        let mut all = Vec::new();
        for evidence in evidence {
            all.extend(self.explained(py, evidence)?);
        }
        Ok(all)
    }

    fn explained(&self, py: Python<'_>, evidence: &Evidence) -> PyResult<Vec<Explanation>> {
        if !self.wanted.contains(&evidence.frame) {
            return Ok(Vec::new());
        }
        let look = |(index, walk): (usize, &Recorded)| Some((index, walk.look(evidence.frame)?));
        let seen = self.walks.iter().enumerate().filter_map(look);
        seen.map(|(index, look)| self.explained_walk(py, evidence, index, &look)).collect()
    }

    fn explained_walk(
        &self,
        py: Python<'_>,
        evidence: &Evidence,
        index: usize,
        look: &Look,
    ) -> PyResult<Explanation> {
        let (width, height) = (evidence.grey.width(), evidence.grey.height());
        if look.window.right >= width || look.window.bottom >= height {
            let message = format!("{:?} lies outside frames of {width}x{height} pixels", look.window);
            return Err(refused("window_px", &message));
        }
        // The tracker takes two who start at once for alone until then, however near they are.
        let is_alone = self.walks[index].is_alone(evidence.frame);
        let around = self.walks.iter().enumerate().filter(|(k, _)| *k != index && !is_alone);
        let bodies = around.filter_map(|(_, walk)| walk.drawn(evidence.frame));
        let cylinders: Vec<EllipticCylinder> = bodies.flat_map(|body| body.cylinders).collect();
        let others = Others::new(&cylinders, self.walks[index].camera.position());
        let scene = self.walks[index].scene(look).among(&others);
        let why = pooled(py, || explain(evidence, look, &scene, &self.options.evidence, &self.options.walk))?
            .map_err(value_error)?;
        Explanation::of(py, evidence, index, look, &why, scene.camera)
    }
}
