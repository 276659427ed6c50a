//! A finished walk from its record: frames compared with the model again as in tracking (`Explainer`), and
//! contours.

use crate::array::{
    frame_from_numpy, numpy_from_column, numpy_from_image, numpy_from_rows, numpy_from_segments,
};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::tracker::{PyTracker, SegmentsWithParts, segments_with_parts};
use crate::wait::pooled;
use glam::{DVec2, DVec3, Vec2};
use memo_core::image::Rectangle;
use memo_core::model::visibility::visible_contours;
use memo_core::model::{
    Body, Camera, EllipticCylinder, Gait, GaitStyle, Others, PosedBody, Posture, Proportions,
    VisibilityOptions, Walker,
};
use memo_core::track::evidence::{Evidence, EvidenceStream};
use memo_core::track::explain::{Explanation, explain};
use memo_core::track::options::TrackerOptions;
use memo_core::track::result::{Row, TrackedWalk};
use memo_core::track::search::{Axis, Hypothesis, POSITION_STEP_M, Path, Scene};
use memo_core::track::walk::Look;
use memo_core::wording::counted;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

/// The record of a walk, as plain numbers: with the video, it is enough to compare the walk's frames again.
pub fn record_of<'py>(py: Python<'py>, walk: &TrackedWalk, rows: &[Row]) -> PyResult<Bound<'py, PyDict>> {
    let steps = walk.steps();
    let Walker { body, gait, style } = &walk.walk.walker;
    let window = |r: &Rectangle| [r.left, r.top, r.right, r.bottom];
    let dict = PyDict::new(py);
    dict.set_item("camera", PyCamera(walk.camera.clone()).parameters(py)?)?;
    let start = walk.walk.route.at(f64::NEG_INFINITY);
    dict.set_item("origin_m", start.origin.to_array())?;
    dict.set_item("heading_rad", start.heading_rad)?;
    if !walk.walk.route.is_straight() {
        let paths = || steps.iter().map(|step| step.look.path);
        dict.set_item("searched_origin_m", paths().map(|p| p.origin.to_array()).collect::<Vec<_>>())?;
        dict.set_item("searched_heading_rad", paths().map(|p| p.heading_rad).collect::<Vec<_>>())?;
    }
    dict.set_item("height_m", body.height_m)?;
    dict.set_item("proportions", body.proportions.to_array())?;
    dict.set_item("curves_rad", gait.sampled(style))?;
    dict.set_item("frame", steps.iter().map(|s| s.frame).collect::<Vec<_>>())?;
    dict.set_item("window_px", steps.iter().map(|s| window(&s.look.window)).collect::<Vec<_>>())?;
    dict.set_item("middle_height_m", steps.iter().map(|s| s.look.heights.centre).collect::<Vec<_>>())?;
    dict.set_item("heights", steps.iter().map(|s| s.look.heights.count).collect::<Vec<_>>())?;
    dict.set_item("along_m", steps.iter().map(|s| s.look.best.along_m).collect::<Vec<_>>())?;
    dict.set_item("height_of_torso_m", steps.iter().map(|s| s.look.best.height_m).collect::<Vec<_>>())?;
    dict.set_item("shared", steps.iter().map(|s| s.shared).collect::<Vec<_>>())?;
    dict.set_item("similarity", steps.iter().map(|s| s.similarity).collect::<Vec<_>>())?;
    dict.set_item("phase", steps.iter().map(|s| s.look.best.phase).collect::<Vec<_>>())?;
    let drawn = walk.fitted().map_or(body, |fit| &fit.body);
    dict.set_item("drawn_height_m", drawn.height_m)?;
    dict.set_item("drawn_proportions", drawn.proportions.to_array())?;
    dict.set_item("drawn_torso_m", rows.iter().map(|r| r.torso_centre.to_array()).collect::<Vec<_>>())?;
    dict.set_item("drawn_heading_rad", rows.iter().map(|r| r.heading_rad).collect::<Vec<_>>())?;
    dict.set_item("drawn_posture_rad", rows.iter().map(|r| r.posture.to_array()).collect::<Vec<_>>())?;
    if !walk.camera_turns.is_empty() {
        let turns: Vec<_> = walk.camera_turns.iter().map(|turn| turn.to_array()).collect();
        dict.set_item("camera_turn_rad", turns)?;
    }
    Ok(dict)
}

/// A walk read from its record.
struct Recorded {
    camera: Camera,
    walker: Walker,
    looks: HashMap<usize, Look>,
    drawn: HashMap<usize, PosedBody>,
    /// Rotation vectors of the camera by frame; empty if it stood still.
    turns: HashMap<usize, DVec3>,
}

/// Maximum number of heights of a grid; the tracker's own has eleven.
const MOST_HEIGHTS: usize = 1000;
/// Maximum number of samples of a curve; memo's own have fifty.
const MOST_SAMPLES: usize = 10_000;

impl Recorded {
    fn read(record: &Bound<'_, PyDict>) -> PyResult<Self> {
        let camera: Bound<'_, PyDict> = value(record, "camera")?;
        let mut body = Body::from_height(number(record, "height_m")?).map_err(value_error)?;
        let curves: [Vec<f64>; 4] = value(record, "curves_rad")?;
        if !curves.iter().all(|c| (3..=MOST_SAMPLES).contains(&c.len()) && c.iter().all(|x| x.is_finite())) {
            return Err(refused("curves_rad", format!("must be four curves of 3 to {MOST_SAMPLES} numbers")));
        }
        let gait = Gait::from_samples(curves.each_ref().map(Vec::as_slice));
        let drawn = drawn(record)?;
        body.proportions = Proportions::from_array(&finite("proportions", value(record, "proportions")?)?);
        Ok(Self {
            camera: PyCamera::from_parameters(&camera)?.0,
            walker: Walker { body, gait, style: GaitStyle::default() },
            looks: looks(record)?,
            drawn,
            turns: turns(record)?,
        })
    }

    /// The camera that took a frame.
    fn camera_of(&self, frame: usize) -> Cow<'_, Camera> {
        match self.turns.get(&frame) {
            None => Cow::Borrowed(&self.camera),
            Some(turn) => Cow::Owned(self.camera.turned(*turn)),
        }
    }

    fn scene(&self, look: &Look) -> Scene<'_> {
        Scene::new(&self.walker, &self.camera, &look.path)
    }
}

/// Visible contours of a recorded walk in these frames, as returned by `Walk.contours`; none in a frame that is not
/// part of the walk.
#[pyfunction]
pub fn recorded_contours<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyDict>,
    frames: Vec<i64>,
) -> PyResult<Vec<SegmentsWithParts<'py>>> {
    let walk = Recorded::read(record)?;
    let mut visible = Vec::new();
    let contours = |frame: i64| {
        visible.clear();
        let frame = usize::try_from(frame).unwrap_or(usize::MAX);
        if let Some(posed) = walk.drawn.get(&frame) {
            visible_contours(
                &posed.cylinders,
                walk.camera.position(),
                &VisibilityOptions::DRAWN,
                &mut visible,
            );
        }
        segments_with_parts(py, &visible, &walk.camera_of(frame))
    };
    frames.into_iter().map(contours).collect()
}

/// The bodies that a record draws, by frame.
fn drawn(record: &Bound<'_, PyDict>) -> PyResult<HashMap<usize, PosedBody>> {
    let frames: Vec<usize> = value(record, "frame")?;
    let proportions =
        Proportions::from_array(&finite("drawn_proportions", value(record, "drawn_proportions")?)?);
    let height_m = number(record, "drawn_height_m")?;
    let body = Body { proportions, ..Body::from_height(height_m).map_err(value_error)? };
    let torsos: Vec<[f64; 3]> = column(record, "drawn_torso_m", frames.len())?;
    let headings = numbers(record, "drawn_heading_rad", frames.len())?;
    let postures: Vec<[f64; Posture::COUNT]> = column(record, "drawn_posture_rad", frames.len())?;
    let posed = |k: usize| {
        let torso = DVec3::from_array(finite("drawn_torso_m", torsos[k])?);
        let posture = Posture::from_array(&finite("drawn_posture_rad", postures[k])?);
        Ok((frames[k], body.pose(torso, headings[k], &posture)))
    };
    (0..frames.len()).map(posed).collect()
}

/// The rotations of the camera, by frame; runs of a camera at rest, and older ones, have none.
fn turns(record: &Bound<'_, PyDict>) -> PyResult<HashMap<usize, DVec3>> {
    if !record.contains("camera_turn_rad")? {
        return Ok(HashMap::new());
    }
    let frames: Vec<usize> = value(record, "frame")?;
    let turns: Vec<[f64; 3]> = column(record, "camera_turn_rad", frames.len())?;
    let turn = |(frame, turn)| Ok((frame, DVec3::from_array(finite("camera_turn_rad", turn)?)));
    frames.into_iter().zip(turns).map(turn).collect()
}

/// The options of a tracker.
fn options_of(tracker: &Bound<'_, PyTracker>) -> PyResult<TrackerOptions> {
    tracker.get().read(tracker.py(), |tracker| tracker.options().clone())
}

fn looks(record: &Bound<'_, PyDict>) -> PyResult<HashMap<usize, Look>> {
    let frames: Vec<usize> = value(record, "frame")?;
    let windows: Vec<[usize; 4]> = column(record, "window_px", frames.len())?;
    let counts: Vec<usize> = column(record, "heights", frames.len())?;
    let [middles, alongs, heights, phases] = [
        numbers(record, "middle_height_m", frames.len())?,
        numbers(record, "along_m", frames.len())?,
        numbers(record, "height_of_torso_m", frames.len())?,
        numbers(record, "phase", frames.len())?,
    ];
    let paths = paths(record, frames.len())?;
    let look = |k: usize| {
        let [left, top, right, bottom] = windows[k];
        if left > right || top > bottom {
            return Err(refused("window_px", format!("{:?} is no rectangle", windows[k])));
        }
        if !(1..=MOST_HEIGHTS).contains(&counts[k]) {
            return Err(refused("heights", format!("must be 1 to {MOST_HEIGHTS}, got {}", counts[k])));
        }
        let heights_of = Axis { centre: middles[k], step: POSITION_STEP_M, count: counts[k] };
        let best = Hypothesis { along_m: alongs[k], height_m: heights[k], phase: phases[k].rem_euclid(1.0) };
        let window = Rectangle { left, top, right, bottom };
        Ok((frames[k], Look { window, heights: heights_of, best, path: paths[k] }))
    };
    (0..frames.len()).map(look).collect()
}

/// The path on which each frame was searched: those of a curved route are recorded for each frame.
fn paths(record: &Bound<'_, PyDict>, frames: usize) -> PyResult<Vec<Path>> {
    let path = |(origin, heading_rad): ([f64; 2], f64)| {
        Ok(Path { origin: DVec2::from_array(finite("origin_m", origin)?), heading_rad })
    };
    if !record.contains("searched_heading_rad")? {
        let path = path((value(record, "origin_m")?, number(record, "heading_rad")?))?;
        return Ok(vec![path; frames]);
    }
    let origins: Vec<[f64; 2]> = column(record, "searched_origin_m", frames)?;
    origins.into_iter().zip(numbers(record, "searched_heading_rad", frames)?).map(path).collect()
}

fn value<'py, T: FromPyObjectOwned<'py>>(record: &Bound<'py, PyDict>, key: &str) -> PyResult<T> {
    let item = record.get_item(key)?.ok_or_else(|| refused(key, "is missing".to_owned()))?;
    item.extract::<T>().map_err(|error| {
        let error: PyErr = error.into();
        refused(key, error.to_string())
    })
}

fn column<'py, T: FromPyObjectOwned<'py>>(
    record: &Bound<'py, PyDict>,
    key: &str,
    wanted: usize,
) -> PyResult<Vec<T>> {
    let values: Vec<T> = value(record, key)?;
    if values.len() != wanted {
        return Err(refused(
            key,
            format!("has {} for {}", counted(values.len(), "value"), counted(wanted, "frame")),
        ));
    }
    Ok(values)
}

fn number(record: &Bound<'_, PyDict>, key: &str) -> PyResult<f64> {
    finite(key, [value(record, key)?]).map(|[x]| x)
}

fn numbers(record: &Bound<'_, PyDict>, key: &str, wanted: usize) -> PyResult<Vec<f64>> {
    let values: Vec<f64> = column(record, key, wanted)?;
    if values.iter().all(|x| x.is_finite()) {
        Ok(values)
    } else {
        Err(refused(key, "is not finite".to_owned()))
    }
}

fn finite<const N: usize>(key: &str, values: [f64; N]) -> PyResult<[f64; N]> {
    if values.iter().all(|x| x.is_finite()) {
        Ok(values)
    } else {
        Err(refused(key, "is not finite".to_owned()))
    }
}

fn refused(key: &str, why: String) -> PyErr {
    PyValueError::new_err(format!("record of a walk: {key}: {why}"))
}

/// Explains selected frames of a stream, one frame late.
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
        wanted: HashSet<usize>,
    ) -> PyResult<Self> {
        let options = options_of(tracker)?;
        let walks = records.iter().map(|r| Recorded::read(r)).collect::<PyResult<_>>()?;
        let stream = Some(options.evidence_stream());
        Ok(Self { options, walks, wanted, stream })
    }

    /// Adds the next frame, (H, W) uint8, and its time in seconds. Returns the explanations of the frame before, one
    /// of each walk that it is part of, if it was requested.
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        frame: &Bound<'py, PyAny>,
        time_s: f64,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let array = frame_from_numpy(frame)?;
        let frame = array.as_frame()?;
        let Some(stream) = &mut self.stream else {
            return Err(PyValueError::new_err("the frames have ended"));
        };
        let evidence = py.detach(|| stream.push(&frame, time_s)).map_err(value_error)?;
        evidence.map_or(Ok(Vec::new()), |evidence| self.explained(py, &evidence))
    }

    /// Returns the explanations of the last frame.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let Some(mut stream) = self.stream.take() else { return Ok(Vec::new()) };
        let evidence = py.detach(|| stream.finish()).map_err(value_error)?;
        evidence.map_or(Ok(Vec::new()), |evidence| self.explained(py, &evidence))
    }
}

impl PyExplainer {
    fn explained<'py>(&self, py: Python<'py>, evidence: &Evidence) -> PyResult<Vec<Bound<'py, PyDict>>> {
        if !self.wanted.contains(&evidence.frame) {
            return Ok(Vec::new());
        }
        let look = |walk: &Recorded| walk.looks.get(&evidence.frame).copied();
        let seen = self.walks.iter().enumerate().filter_map(|(index, walk)| Some((index, look(walk)?)));
        seen.map(|(index, look)| self.explained_walk(py, evidence, index, &look)).collect()
    }

    fn explained_walk<'py>(
        &self,
        py: Python<'py>,
        evidence: &Evidence,
        index: usize,
        look: &Look,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (width, height) = (evidence.grey.width(), evidence.grey.height());
        if look.window.right >= width || look.window.bottom >= height {
            let message = format!("{:?} lies outside frames of {width}x{height} pixels", look.window);
            return Err(refused("window_px", message));
        }
        let around = self.walks.iter().enumerate().filter(|(k, _)| *k != index);
        let bodies = around.filter_map(|(_, walk)| walk.drawn.get(&evidence.frame));
        let cylinders: Vec<EllipticCylinder> = bodies.flat_map(|body| body.cylinders).collect();
        let others = Others::new(&cylinders, self.walks[index].camera.position());
        let scene = self.walks[index].scene(look).among(&others);
        let why = pooled(py, || explain(evidence, look, &scene, &self.options.evidence, &self.options.walk))?
            .map_err(value_error)?;
        dict_of(py, evidence, index, look, &why, scene.camera)
    }
}

fn dict_of<'py>(
    py: Python<'py>,
    evidence: &Evidence,
    walk: usize,
    look: &Look,
    why: &Explanation,
    camera: &Camera,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("frame", evidence.frame)?;
    dict.set_item("time_s", evidence.time_s)?;
    dict.set_item("walk", walk)?;
    let Rectangle { left, top, right, bottom } = look.window;
    dict.set_item("window_px", (left, top, right, bottom))?;
    dict.set_item("luma", numpy_from_image(py, evidence.grey.clone())?)?;
    dict.set_item("change_mask", numpy_from_image(py, evidence.mask.clone())?)?;
    let points = why.edges.chains.edgels().iter().map(|e| e.position_px.as_dvec2().to_array()).collect();
    dict.set_item("edge_points", numpy_from_rows(py, points)?)?;
    let segments = why.edges.segments.iter().map(|s| [s.start_px.to_array(), s.end_px.to_array()]).collect();
    dict.set_item("segments", numpy_from_segments(py, segments)?)?;
    set_model(&dict, why, camera)?;
    let cycle = why.cycle.iter();
    dict.set_item("phase_grid", numpy_from_column(py, cycle.clone().map(|s| s.phase).collect()))?;
    dict.set_item("similarity", numpy_from_column(py, cycle.map(|s| f64::from(s.similarity)).collect()))?;
    dict.set_item("phase", why.chosen.phase)?;
    dict.set_item("chosen_similarity", f64::from(why.similarity.value))?;
    Ok(dict)
}

/// Adds the model's lines in image pixels with the edge matched with each.
fn set_model(dict: &Bound<'_, PyDict>, why: &Explanation, camera: &Camera) -> PyResult<()> {
    let py = dict.py();
    let count = why.lines.len();
    let pixel = |p: [f32; 2]| camera.distort(Vec2::from(p).as_dvec2()).unwrap_or(DVec2::NAN).to_array();
    let length =
        |l: &memo_core::track::score::ModelLine| f64::from(Vec2::from(l.start).distance(Vec2::from(l.end)));
    let mut edge = vec![-1i64; count];
    let mut terms = [const { Vec::new() }; 4];
    terms.iter_mut().for_each(|column| column.resize(count, f64::NAN));
    for m in &why.similarity.matches {
        edge[m.line] = m.edge as i64;
        for (column, term) in
            terms.iter_mut().zip([m.overlap_px, m.distance_px, m.angle_rad, m.similarity_px])
        {
            column[m.line] = f64::from(term);
        }
    }
    let [overlap, distance, angle, similarity] = terms;
    let answered: Vec<f64> = similarity.iter().map(|s| if s.is_nan() { 0.0 } else { *s }).collect();
    let lengths: Vec<f64> = why.lines.iter().map(length).collect();
    let lines = why.lines.iter().map(|l| [pixel(l.start), pixel(l.end)]).collect();
    dict.set_item("model", numpy_from_segments(py, lines)?)?;
    dict.set_item("model_part", numpy_from_column(py, why.lines.iter().map(|l| l.part).collect()))?;
    dict.set_item("model_px", numpy_from_column(py, lengths))?;
    dict.set_item("model_edge", numpy_from_column(py, edge))?;
    dict.set_item("overlap_px", numpy_from_column(py, overlap))?;
    dict.set_item("distance_px", numpy_from_column(py, distance))?;
    dict.set_item("angle_rad", numpy_from_column(py, angle))?;
    dict.set_item("similarity_px", numpy_from_column(py, answered))?;
    Ok(())
}
