//! Options of the tracker.

use super::evidence::{EvidenceOptions, EvidenceStream};
use super::fit::{FitOptions, LEAST_FRAMES};
use super::height::{BodyHeight, HeightSource, POPULATION_HEIGHT_M, combined, from_rectangles};
use super::locate::Sighting;
use super::start::CadenceRange;
use super::steady::{Steadier, SteadyOptions};
use super::walk::WalkOptions;
use crate::OptionError;
use crate::model::body::BodyError;
use crate::model::{Body, Camera, Gait, GaitStyle, Walker};

/// Which average gait the model uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GaitChoice {
    /// Fifty samples per joint curve.
    #[default]
    Dense,
    /// Ten samples per joint curve, as in the paper.
    Sampled10,
}

impl From<GaitChoice> for Gait {
    fn from(choice: GaitChoice) -> Self {
        match choice {
            GaitChoice::Dense => Self::dense(),
            GaitChoice::Sampled10 => Self::sampled_10(),
        }
    }
}

/// What is known of the person and the camera, and options of the stages.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackerOptions {
    /// Body height of the person, metres. `None` measures it in a calibrated camera; without one, that of the
    /// population is assumed ([`height`](super::height)).
    pub height_m: Option<f64>,
    /// Body heights of further people in order of appearance, metres. In a given camera, a person has the one of the
    /// heights that the image shows if that is clear. If there are none, everybody has `height_m`; otherwise people
    /// beyond the list are measured.
    pub further_heights_m: Vec<f64>,
    /// The camera; `None` assumes one from field of view and body height.
    pub camera: Option<Camera>,
    /// Horizontal field of view of an assumed camera, radians. `None` assumes
    /// [`DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD`](crate::model::DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD) across the longer
    /// side of the frames.
    pub field_of_view_rad: Option<f64>,
    /// Average gait.
    pub gait: GaitChoice,
    /// Number of frames of the starting phase. The paper uses images 2 to 14. At more than 30 frames per second, as many frames
    /// as last as long.
    pub start_frames: usize,
    /// Fit of the person's body and motion to all frames of a walk; `None` keeps the average.
    pub fit: Option<FitOptions>,
    /// Number of frames that must be followed before an oblique path is looked for. 40: one and a half strides at
    /// 25 frames per second. At lower rates fewer frames are enough, if they last as long; at more than 30 frames per second, it
    /// is as many as last as long.
    pub path_frames: usize,
    /// Whether the person walks on a treadmill; `None` finds out.
    pub treadmill: Option<bool>,
    /// Range of cadences to consider.
    pub cadence: CadenceRange,
    /// Options of the stages from pixels to regions and edges.
    pub evidence: EvidenceOptions,
    /// Steadying of a camera that moves; `None` takes every frame as it is.
    pub steady: Option<SteadyOptions>,
    /// Options of search and filter.
    pub walk: WalkOptions,
}

impl Default for TrackerOptions {
    /// Those for a person of unknown height.
    fn default() -> Self {
        Self {
            height_m: None,
            further_heights_m: Vec::new(),
            camera: None,
            field_of_view_rad: None,
            gait: GaitChoice::default(),
            start_frames: 13,
            fit: Some(FitOptions::default()),
            path_frames: 40,
            treadmill: None,
            cadence: CadenceRange::default(),
            evidence: EvidenceOptions::default(),
            steady: Some(SteadyOptions::default()),
            walk: WalkOptions::default(),
        }
    }
}

impl TrackerOptions {
    /// Defaults for a person of the given height.
    pub fn for_height(height_m: f64) -> Self {
        Self { height_m: Some(height_m), ..Self::default() }
    }

    /// Somebody beside a followed person is soon hidden or mistaken for that person, so half as many frames must do.
    pub(super) fn start_frames_beside_others(&self) -> usize {
        self.start_frames.div_ceil(2)
    }

    /// Refuses options outside their ranges; [`Tracker::new`](super::tracker::Tracker::new) asks it first.
    pub fn check(&self) -> Result<(), OptionError> {
        if let Some(fov_deg) = self.field_of_view_rad.map(f64::to_degrees) {
            let is_seen = (5.0..=170.0).contains(&fov_deg);
            OptionError::unless(is_seen, "field of view", "between 5 and 170 degrees", fov_deg)?;
        }
        let is_enough = (5..=100).contains(&self.start_frames);
        OptionError::unless(is_enough, "start_frames", "between 5 and 100", self.start_frames as f64)?;
        let is_enough = (LEAST_FRAMES..=1000).contains(&self.path_frames);
        OptionError::unless(is_enough, "path_frames", "between 15 and 1000", self.path_frames as f64)?;
        self.fit.map_or(Ok(()), |fit| fit.check())?;
        OptionError::unless_positive("low_hz", self.cadence.low_hz)?;
        let is_above = self.cadence.high_hz >= self.cadence.low_hz && self.cadence.high_hz <= 100.0;
        OptionError::unless(is_above, "high_hz", "at least low_hz and at most 100", self.cadence.high_hz)?;
        self.evidence.check()?;
        self.steady.map_or(Ok(()), |steady| steady.check())?;
        self.walk.check()
    }

    /// The time of [`path_frames`](Self::path_frames) frames at 25 frames per second: at lower rates, fewer frames show a
    /// path as well.
    pub(super) fn path_s(&self) -> f64 {
        (self.path_frames as f64 - 1.0) / 25.0
    }

    /// The given height of a place in the list; of everybody if there is no list.
    pub fn height_of(&self, person: usize) -> Option<f64> {
        match person.checked_sub(1) {
            Some(further) if !self.further_heights_m.is_empty() => {
                self.further_heights_m.get(further).copied()
            }
            _ => self.height_m,
        }
    }

    /// The evidence of a new stream of frames.
    pub fn evidence_stream(&self) -> EvidenceStream {
        let steadier = |steady| Steadier::new(steady, self.camera.as_ref(), self.field_of_view_rad);
        EvidenceStream::new(self.evidence).steadied_by(self.steady.map(steadier))
    }

    /// The average walker of a body height in metres.
    pub fn walker(&self, height_m: f64) -> Result<Walker, BodyError> {
        let body = Body::from_height(height_m)?;
        Ok(Walker { body, gait: self.gait.into(), style: GaitStyle::default() })
    }
}

/// The height with which a walk starts: the given one, or the one that a known camera shows.
pub(super) fn start_height(
    options: &TrackerOptions,
    height_m: Option<f64>,
    camera: Option<&Camera>,
    sightings: &[Sighting],
) -> BodyHeight {
    let population = BodyHeight::POPULATION;
    match (height_m, camera) {
        (Some(height_m), _) => BodyHeight::given(height_m),
        (None, None) => population,
        (None, Some(camera)) => {
            shown_height(options, camera, sightings).map_or(population, |shown| combined(&population, &shown))
        }
    }
}

/// The height that the rectangles show, whatever height was given; `None` if it is not that of an adult.
pub(super) fn shown_height(
    options: &TrackerOptions,
    camera: &Camera,
    sightings: &[Sighting],
) -> Option<BodyHeight> {
    let average = options.walker(POPULATION_HEIGHT_M).ok()?;
    from_rectangles(camera, sightings, &average)
}

/// The same of somebody who comes nearer or goes away: each rectangle has its own rows.
pub(super) fn approaching_height(
    options: &TrackerOptions,
    height_m: Option<f64>,
    camera: &Camera,
    sightings: &[Sighting],
) -> BodyHeight {
    let of = |sighting: &Sighting| {
        let one = std::slice::from_ref(sighting);
        start_height(options, height_m, Some(camera), one)
    };
    let is_known = |height: &BodyHeight| height.source != HeightSource::Assumed;
    let mut all: Vec<BodyHeight> = sightings.iter().map(of).filter(is_known).collect();
    all.sort_by(|a, b| a.height_m.total_cmp(&b.height_m));
    all.get(all.len() / 2).copied().unwrap_or(BodyHeight::POPULATION)
}
