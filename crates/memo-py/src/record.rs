//! The record of a walk: with the video, it is enough to compare the walk's frames again, and to draw it.

use crate::array::{numpy_from_column, numpy_from_segments};
use crate::camera::PyCamera;
use crate::error::value_error;
use crate::whole::{Whole, WholeNumbers};
use glam::{DVec2, DVec3};
use memo_core::image::Rectangle;
use memo_core::model::{
    GaitStyle, PosedBody, Posture, Proportions, VisibilityOptions, VisibleSegment, visible_contours,
};
use memo_core::track::Row;
use memo_core::track::search::{Axis, Hypothesis, POSITION_STEP_M, Path, Scene};
use memo_core::track::walk::Look;
use memo_core::wording::counted;
use memo_core::{Body, Camera, Gait, TrackedWalk, Walker};
use numpy::{PyArray1, PyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

/// Segments (n, 2, 2) and the body part of each (n,).
pub type SegmentsWithParts<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<u8>>);

/// Visible pieces of contours in image pixels; pieces the camera does not see are omitted.
pub fn segments_with_parts<'py>(
    py: Python<'py>,
    visible: &[VisibleSegment],
    camera: &Camera,
) -> PyResult<SegmentsWithParts<'py>> {
    let seen = |v: &VisibleSegment| Some((v.ends_px(camera)?.map(|p| p.to_array()), v.part as u8));
    let (segments, parts) = visible.iter().filter_map(seen).unzip();
    Ok((numpy_from_segments(py, segments)?, numpy_from_column(py, parts)))
}

/// A walk as plain numbers: a dictionary in Python, an object in `run.json`. Lists have a value for each frame.
#[derive(IntoPyObject, FromPyObject)]
#[pyo3(from_item_all)]
pub struct WalkRecord<'py> {
    camera: Bound<'py, PyDict>,
    /// A point of the path, or of its first frame.
    origin_m: [f64; 2],
    heading_rad: f64,
    /// The path on which each frame was searched, unless all are the same.
    #[pyo3(default)]
    searched_origin_m: Option<Vec<[f64; 2]>>,
    #[pyo3(default)]
    searched_heading_rad: Option<Vec<f64>>,
    /// The body and the gait that were searched with.
    height_m: f64,
    proportions: [f64; Proportions::COUNT],
    curves_rad: [Vec<f64>; 4],
    frame: Vec<usize>,
    window_px: Vec<[usize; 4]>,
    /// The grid of positions along the path; without it, hidden lines are those at the best position.
    #[pyo3(default)]
    middle_along_m: Option<Vec<f64>>,
    #[pyo3(default)]
    alongs: Option<Vec<usize>>,
    /// The grid of heights of the torso.
    middle_height_m: Vec<f64>,
    heights: Vec<usize>,
    /// The best point of the grid.
    along_m: Vec<f64>,
    height_of_torso_m: Vec<f64>,
    phase: Vec<f64>,
    #[pyo3(default)]
    similarity: Option<Vec<f64>>,
    /// Whether the edges of other people were near.
    #[pyo3(default)]
    shared: Option<Vec<bool>>,
    /// The body that is drawn.
    drawn_height_m: f64,
    drawn_proportions: [f64; Proportions::COUNT],
    drawn_torso_m: Vec<[f64; 3]>,
    drawn_heading_rad: Vec<f64>,
    drawn_posture_rad: Vec<[f64; Posture::COUNT]>,
    /// Rotation vectors of the camera, unless it stood still.
    #[pyo3(default)]
    camera_turn_rad: Option<Vec<[f64; 3]>>,
    /// The camera of the frames, if `camera` is that of steadied pictures that are larger.
    #[pyo3(default)]
    frame_camera: Option<Bound<'py, PyDict>>,
}

impl<'py> WalkRecord<'py> {
    /// The record of a walk.
    pub fn of(py: Python<'py>, walk: &TrackedWalk, rows: &[Row]) -> PyResult<Self> {
        let Walker { body, gait, style } = &walk.walk.walker;
        let drawn = walk.fitted().map_or(body, |fit| &fit.body);
        let (steps, start) = (walk.steps(), walk.walk.route.at(f64::NEG_INFINITY));
        let is_curved = !walk.walk.route.is_straight();
        let turns = || walk.camera_turns.iter().map(|turn| turn.to_array()).collect();
        Ok(Self {
            camera: PyCamera(walk.camera.clone()).parameters(py)?,
            origin_m: start.origin.to_array(),
            heading_rad: start.heading_rad,
            searched_origin_m: is_curved.then(|| each(steps, |s| s.look.path.origin.to_array())),
            searched_heading_rad: is_curved.then(|| each(steps, |s| s.look.path.heading_rad)),
            height_m: body.height_m,
            proportions: body.proportions.to_array(),
            curves_rad: gait.sampled(style),
            frame: each(steps, |s| s.frame),
            window_px: each(steps, |s| {
                let Rectangle { left, top, right, bottom } = s.look.window;
                [left, top, right, bottom]
            }),
            middle_along_m: Some(each(steps, |s| s.look.alongs.centre)),
            alongs: Some(each(steps, |s| s.look.alongs.count)),
            middle_height_m: each(steps, |s| s.look.heights.centre),
            heights: each(steps, |s| s.look.heights.count),
            along_m: each(steps, |s| s.look.best.along_m),
            height_of_torso_m: each(steps, |s| s.look.best.height_m),
            phase: each(steps, |s| s.look.best.phase),
            similarity: Some(each(steps, |s| f64::from(s.similarity))),
            shared: Some(each(steps, |s| s.shared)),
            drawn_height_m: drawn.height_m,
            drawn_proportions: drawn.proportions.to_array(),
            drawn_torso_m: each(rows, |r| r.torso_centre.to_array()),
            drawn_heading_rad: each(rows, |r| r.heading_rad),
            drawn_posture_rad: each(rows, |r| r.posture.to_array()),
            camera_turn_rad: (!walk.camera_turns.is_empty()).then(turns),
            frame_camera: walk
                .frame_camera
                .as_ref()
                .map(|c| PyCamera(c.clone()).parameters(py))
                .transpose()?,
        })
    }

    /// As a dictionary, without what is None.
    pub fn into_dict(self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = self.into_pyobject(py)?;
        for (key, value) in dict.copy()? {
            if value.is_none() {
                dict.del_item(key)?;
            }
        }
        Ok(dict)
    }

    /// Refuses lists that have not a value for each frame, and numbers that are not finite.
    fn check(&self) -> PyResult<()> {
        let frames = self.frame.len();
        let lengths = [
            ("window_px", Some(self.window_px.len())),
            ("middle_along_m", self.middle_along_m.as_ref().map(Vec::len)),
            ("alongs", self.alongs.as_ref().map(Vec::len)),
            ("middle_height_m", Some(self.middle_height_m.len())),
            ("heights", Some(self.heights.len())),
            ("along_m", Some(self.along_m.len())),
            ("height_of_torso_m", Some(self.height_of_torso_m.len())),
            ("phase", Some(self.phase.len())),
            ("drawn_torso_m", Some(self.drawn_torso_m.len())),
            ("drawn_heading_rad", Some(self.drawn_heading_rad.len())),
            ("drawn_posture_rad", Some(self.drawn_posture_rad.len())),
            ("searched_origin_m", self.searched_origin_m.as_ref().map(Vec::len)),
            ("searched_heading_rad", self.searched_heading_rad.as_ref().map(Vec::len)),
            ("camera_turn_rad", self.camera_turn_rad.as_ref().map(Vec::len)),
        ];
        for (name, length) in lengths {
            if let Some(length) = length.filter(|length| *length != frames) {
                let (values, wanted) = (counted(length, "value"), counted(frames, "frame"));
                return Err(refused(name, &format!("has {values} for {wanted}")));
            }
        }
        if self.searched_origin_m.is_some() != self.searched_heading_rad.is_some() {
            return Err(refused("searched_heading_rad", "is missing, or searched_origin_m is"));
        }
        if self.middle_along_m.is_some() != self.alongs.is_some() {
            return Err(refused("alongs", "is missing, or middle_along_m is"));
        }
        let curves_fit = |c: &Vec<f64>| (3..=MOST_SAMPLES).contains(&c.len());
        if !self.curves_rad.iter().all(curves_fit) {
            return Err(refused(
                "curves_rad",
                &format!("must be four curves of 3 to {MOST_SAMPLES} numbers"),
            ));
        }
        for (name, mut numbers) in self.numbers() {
            if !numbers.all(f64::is_finite) {
                return Err(refused(name, "is not finite"));
            }
        }
        for window in &self.window_px {
            let [left, top, right, bottom] = window;
            if left > right || top > bottom {
                return Err(refused("window_px", &format!("{window:?} is no rectangle")));
            }
        }
        for (name, counts) in [("heights", Some(&self.heights)), ("alongs", self.alongs.as_ref())] {
            if let Some(count) =
                counts.into_iter().flatten().find(|count| !(1..=MOST_VALUES).contains(*count))
            {
                return Err(refused(name, &format!("must be 1 to {MOST_VALUES}, got {count}")));
            }
        }
        Ok(())
    }

    /// All numbers that must be finite.
    fn numbers(&self) -> [(&'static str, Numbers<'_>); 17] {
        fn flat<const N: usize>(rows: &[[f64; N]]) -> Numbers<'_> {
            Box::new(rows.iter().flatten().copied())
        }
        fn list(numbers: &[f64]) -> Numbers<'_> {
            Box::new(numbers.iter().copied())
        }
        [
            ("origin_m", list(&self.origin_m)),
            ("heading_rad", list(std::slice::from_ref(&self.heading_rad))),
            ("height_m", list(std::slice::from_ref(&self.height_m))),
            ("proportions", list(&self.proportions)),
            ("curves_rad", Box::new(self.curves_rad.iter().flatten().copied())),
            ("middle_along_m", list(self.middle_along_m.as_deref().unwrap_or_default())),
            ("middle_height_m", list(&self.middle_height_m)),
            ("along_m", list(&self.along_m)),
            ("height_of_torso_m", list(&self.height_of_torso_m)),
            ("phase", list(&self.phase)),
            ("drawn_proportions", list(&self.drawn_proportions)),
            ("drawn_torso_m", flat(&self.drawn_torso_m)),
            ("drawn_heading_rad", list(&self.drawn_heading_rad)),
            ("drawn_posture_rad", flat(&self.drawn_posture_rad)),
            ("searched_origin_m", flat(self.searched_origin_m.as_deref().unwrap_or_default())),
            ("searched_heading_rad", list(self.searched_heading_rad.as_deref().unwrap_or_default())),
            ("camera_turn_rad", flat(self.camera_turn_rad.as_deref().unwrap_or_default())),
        ]
    }

    /// What was searched in a frame.
    fn look(&self, k: usize) -> Look {
        let [left, top, right, bottom] = self.window_px[k];
        let (origin, heading_rad) = match (&self.searched_origin_m, &self.searched_heading_rad) {
            (Some(origins), Some(headings_rad)) => (origins[k], headings_rad[k]),
            _ => (self.origin_m, self.heading_rad),
        };
        let (centre, count) = match (&self.middle_along_m, &self.alongs) {
            (Some(middles_m), Some(counts)) => (middles_m[k], counts[k]),
            _ => (self.along_m[k], 1),
        };
        Look {
            window: Rectangle { left, top, right, bottom },
            alongs: Axis { centre, step: POSITION_STEP_M, count },
            heights: Axis { centre: self.middle_height_m[k], step: POSITION_STEP_M, count: self.heights[k] },
            best: Hypothesis {
                along_m: self.along_m[k],
                height_m: self.height_of_torso_m[k],
                phase: self.phase[k].rem_euclid(1.0),
            },
            path: Path { origin: DVec2::from_array(origin), heading_rad },
        }
    }
}

type Numbers<'a> = Box<dyn Iterator<Item = f64> + 'a>;

fn each<T, U>(items: &[T], value: impl Fn(&T) -> U) -> Vec<U> {
    items.iter().map(value).collect()
}

/// Maximum number of positions or heights of a grid; the tracker's own has at most 21.
const MOST_VALUES: usize = 100;
/// Maximum number of samples of a curve; memo's own have fifty.
const MOST_SAMPLES: usize = 10_000;

/// A walk read from its record.
pub struct Recorded {
    pub camera: Camera,
    walker: Walker,
    frames: Vec<usize>,
    looks: HashMap<usize, Look>,
    drawn: HashMap<usize, PosedBody>,
    /// Frames in which nobody else was near, to the tracker.
    alone: HashSet<usize>,
    /// Rotation vectors of the camera by frame; empty if it stood still.
    turns: HashMap<usize, DVec3>,
    /// The camera of the frames.
    frame_camera: Camera,
}

impl Recorded {
    /// Reads and checks a record.
    pub fn read(record: &Bound<'_, PyDict>) -> PyResult<Self> {
        let found: WalkRecord<'_> = record.extract().map_err(|error: PyErr| {
            let why = error.value(record.py()).str().map_or_else(|_| error.to_string(), |s| s.to_string());
            PyValueError::new_err(format!("record of a walk: {why}"))
        })?;
        found.check()?;
        let body = |height_m, proportions| {
            let body = Body::from_height(height_m).map_err(value_error)?;
            Ok::<_, PyErr>(Body { proportions: Proportions::from_array(proportions), ..body })
        };
        let drawn = body(found.drawn_height_m, &found.drawn_proportions)?;
        let posed = |k: usize| {
            let torso = DVec3::from_array(found.drawn_torso_m[k]);
            let posture = Posture::from_array(&found.drawn_posture_rad[k]);
            drawn.pose(torso, found.drawn_heading_rad[k], &posture)
        };
        let turns = found.camera_turn_rad.iter().flatten().map(|turn| DVec3::from_array(*turn));
        let shared = found.shared.iter().flatten().copied();
        let frames = || found.frame.iter().copied();
        let camera = PyCamera::from_parameters(&found.camera)?.0;
        let frame_camera = match &found.frame_camera {
            Some(parameters) => PyCamera::from_parameters(parameters)?.0,
            None => camera.clone(),
        };
        Ok(Self {
            camera,
            frame_camera,
            walker: Walker {
                body: body(found.height_m, &found.proportions)?,
                gait: Gait::from_samples(found.curves_rad.each_ref().map(Vec::as_slice)),
                style: GaitStyle::default(),
            },
            looks: frames().enumerate().map(|(k, frame)| (frame, found.look(k))).collect(),
            drawn: frames().enumerate().map(|(k, frame)| (frame, posed(k))).collect(),
            alone: frames().zip(shared).filter(|(_, shared)| !shared).map(|(frame, _)| frame).collect(),
            turns: frames().zip(turns).collect(),
            frames: found.frame,
        })
    }

    /// The frame of a row.
    pub fn frame(&self, row: usize) -> usize {
        self.frames[row]
    }

    /// What was searched in a frame; `None` in one that is not part of the walk.
    pub fn look(&self, frame: usize) -> Option<Look> {
        self.looks.get(&frame).copied()
    }

    /// The body that is drawn in a frame.
    pub fn drawn(&self, frame: usize) -> Option<&PosedBody> {
        self.drawn.get(&frame)
    }

    /// True if nobody else was near in a frame, to the tracker: then nobody hid the person.
    pub fn is_alone(&self, frame: usize) -> bool {
        self.alone.contains(&frame)
    }

    pub fn scene(&self, look: &Look) -> Scene<'_> {
        Scene::new(&self.walker, &self.camera, &look.path)
    }

    /// Visible contours in a frame, in its pixels; none in a frame that is not part of the walk.
    pub fn contours<'py>(&self, py: Python<'py>, frame: usize) -> PyResult<SegmentsWithParts<'py>> {
        let mut visible = Vec::new();
        if let Some(posed) = self.drawn(frame) {
            let eye = self.camera.position();
            visible_contours(&posed.cylinders, eye, &VisibilityOptions::DRAWN, &mut visible);
        }
        let camera = match self.turns.get(&frame) {
            None => Cow::Borrowed(&self.frame_camera),
            Some(turn) => Cow::Owned(self.frame_camera.turned(*turn)),
        };
        segments_with_parts(py, &visible, &camera)
    }
}

/// Visible contours of a recorded walk in these frames, as returned by `Walk.contours`; none in a frame that is not
/// part of the walk.
#[pyfunction]
pub fn recorded_contours<'py>(
    py: Python<'py>,
    record: &Bound<'py, PyDict>,
    frames: Vec<Whole<i64>>,
) -> PyResult<Vec<SegmentsWithParts<'py>>> {
    let frames = frames.must_be("frames", "whole numbers of 64 bits")?;
    let walk = Recorded::read(record)?;
    let contours = |frame: i64| walk.contours(py, usize::try_from(frame).unwrap_or(usize::MAX));
    frames.into_iter().map(contours).collect()
}

/// The error of a value of a record.
pub fn refused(key: &str, why: &str) -> PyErr {
    PyValueError::new_err(format!("record of a walk: {key}: {why}"))
}
