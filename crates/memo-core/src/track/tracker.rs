//! The tracker: frames in, walks out (Rohr 1994, Fig. 3).
//!
//! 1. It looks for moving regions that could be people and that nobody explains who is followed already (`seeking`).
//! 2. It starts on 13 frames of such a region ([`TrackerOptions::start_frames`], `starting`), or on more if these show no walk.
//! 3. It follows both half-cycle twins with filters (`following`). Nearer people hide farther ones (`crowd`).
//! 4. It looks for an oblique path once [`TrackerOptions::path_frames`] frames are followed, or for as long at a low frame
//!    rate, and for turns from then on (`bend`).
//! 5. It ends the walk when the person leaves the image or stops walking (`ending`), and fits the person to all its frames
//!    ([`fit`](super::fit)). Whoever walks on where the person was expected has the same number (`people`).
//!
//! Something that stays in one place for `path_frames` frames may walk on a treadmill or along the line of sight
//! (`on_the_spot`, [`treadmill`](super::treadmill)): before a given camera whoever else is followed, without one only while
//! nobody is.
//!
//! Boxes around people from elsewhere, such as those of a detector, can be given instead of looking for moving regions
//! ([`Tracker::update_with_boxes`]).
//!
//! Memory does not grow with the length of the stream. The tracker keeps two frames, of each person the rows of the current
//! walk and its edges (without a fit, those of the latest frames, some more than `path_frames`) and, for the fit, 32 frames of the stream (64 for a walk on a treadmill) and the part of each frame of the walk that shows the
//! person. A walk longer than [`FitOptions::longest`](super::fit::FitOptions::longest) frames, or [`LONGEST_WALK`]
//! without a fit, is returned in pieces of that length. Who moves and is not followed is noted in bounded memory too
//! ([`left_out`](super::left_out)).
//!
//! Edges are matched within a few pixels, whatever the image size. Shrink images whose longer side exceeds about
//! 1280 pixels first, and their camera with [`Camera::shrunk`]: a 720p walk enlarged to 1080p was tracked as
//! well, but enlarged to 1440p it was taken for backward walking.

mod ending;
mod following;
mod on_the_spot;
mod seeking;
mod starting;
mod unfollowed;
mod wide;

use super::active::Active;
use super::candidate::{Candidate, MISSED_FRAMES, Seen};
use super::evidence::{Evidence, EvidenceError, EvidenceOptions, EvidenceStream, MOST_WAITING};
use super::fit::views::Backdrop;
use super::left_out::{LeftOut, Unfollowed};
use super::locate::Sighting;
use super::options::TrackerOptions;
use super::people::Identities;
pub use super::people::Now;
use super::rate::{FrameRate, lasting};
use super::result::TrackedWalk;
use super::standing::Standing;
use super::steady::{CameraMotion, Loss, Reach};

use super::walk::FrameEdges;
use crate::OptionError;
use crate::calibrate::{TiltError, TiltEstimate};
use crate::image::{Frame, LightReport, Rectangle};
use crate::model::body::BodyError;
use crate::model::{Body, Camera};
use std::collections::BTreeMap;
use std::sync::Arc;
use thiserror::Error;
use unfollowed::{Moving, with_small_ones};

/// Why tracking stopped with an error.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TrackError {
    /// The body height is not valid.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A frame or an option of the image stages was refused.
    #[error(transparent)]
    Evidence(#[from] EvidenceError),
    /// The tilt of the assumed camera.
    #[error(transparent)]
    Tilt(#[from] TiltError),
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// [`Tracker::finish`] was called before.
    #[error("the stream has ended: make a new tracker for further frames")]
    Finished,
    /// A box is not within its frame.
    #[error(
        "a box must be within its {width}x{height} frame, got columns {} to {} and rows {} to {}",
        given.left, given.right, given.top, given.bottom
    )]
    Box {
        /// The box.
        given: Rectangle,
        /// Width of the frame.
        width: usize,
        /// Height of the frame.
        height: usize,
    },
    /// The camera is calibrated for another image size.
    #[error(
        "the camera is calibrated for {camera_width}x{camera_height} images, the frames are {width}x{height}"
    )]
    CameraSize {
        /// Image width of the camera.
        camera_width: u32,
        /// Image height of the camera.
        camera_height: u32,
        /// Width of the frames.
        width: usize,
        /// Height of the frames.
        height: usize,
    },
}

/// A walk of this many frames is returned and continues as a new walk.
pub const LONGEST_WALK: usize = 20_000;
/// Edges are searched this far around the predicted body, pixels.
const WINDOW_MARGIN_PX: f64 = 16.0;

/// Counts over the whole stream, walks included. If nobody was followed, they show why.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SeekReport {
    /// Frames seen.
    pub frames: usize,
    /// Frames with a moving region large enough for a person.
    pub frames_with_candidate: usize,
    /// Of these, frames in which the image border cut the region.
    pub frames_cut_off: usize,
    /// Refused starts: the region moved too slowly, did not fit the height, or did not walk. Walks that were taken back count too.
    pub refused_starts: usize,
    /// Frames of a starting phase at the rate of the frames.
    pub start_frames: usize,
    /// People and things that moved and were not followed ([`Tracker::left_out`]).
    pub left_out: usize,
    /// The light: frames whose brightness differed suddenly and was made that of the others.
    pub light: LightReport,
}

/// A tracker for one stream of frames.
#[derive(Debug)]
pub struct Tracker {
    /// As they were given, but numbers of frames are those of the frame rate, and camera and field of view those of the
    /// steadied pictures, which may be larger than the frames.
    options: TrackerOptions,
    given: TrackerOptions,
    /// Width and height of the frames, pixels, once there is one.
    size: Option<[usize; 2]>,
    rate: FrameRate,
    /// What is sought is dropped after this many consecutive frames without it.
    most_missed: usize,
    stream: EvidenceStream,
    backdrop: Backdrop,
    candidates: Vec<Candidate>,
    /// What the regions of the latest frames showed.
    sought: Vec<Arc<Seen>>,
    /// The regions of the last frame in which people seem to be side by side, and for how many frames they have been.
    side_by_side: Vec<(Rectangle, usize)>,
    /// Which of the given heights each person has, in order of appearance.
    order_of_heights: Vec<usize>,
    /// Everybody who is followed.
    people: Vec<Active>,
    /// Walks that are over, and since when. Somebody may start there again.
    fading: Vec<(f64, Active)>,
    identities: Identities,
    /// Frames of what may walk on the spot or along the line of sight.
    standings: Vec<Standing>,
    /// What moves and is not followed.
    unfollowed: Unfollowed,
    /// How a camera that is not given is tilted, by the first frame with something that may be a person.
    tilt: Option<TiltEstimate>,
    /// Boxes around people that were given, by frame.
    boxes: BTreeMap<usize, Vec<Rectangle>>,
    finished: Vec<TrackedWalk>,
    /// Walks that were returned, as long as others of their time are not over.
    returned: Vec<TrackedWalk>,
    report: SeekReport,
    is_finished: bool,
    /// Number of frames after which a walk is returned.
    longest_walk: usize,
}

impl Tracker {
    /// A tracker for a new stream; an error if the body height or an option is out of range.
    pub fn new(options: TrackerOptions) -> Result<Self, TrackError> {
        let heights_m = options.height_m.iter().chain(&options.further_heights_m);
        heights_m.copied().try_for_each(|height_m| Body::from_height(height_m).map(|_| ()))?;
        options.check()?;
        let stream = options.evidence_stream();
        let longest_walk = options.fit.map_or(LONGEST_WALK, |fit| fit.longest.min(LONGEST_WALK));
        let order_of_heights = (0..=options.further_heights_m.len()).collect();
        Ok(Self {
            given: options.clone(),
            options,
            size: None,
            stream,
            backdrop: Backdrop::default(),
            rate: FrameRate::default(),
            most_missed: MISSED_FRAMES,
            candidates: Vec::new(),
            sought: Vec::new(),
            side_by_side: Vec::new(),
            order_of_heights,
            people: Vec::new(),
            fading: Vec::new(),
            identities: Identities::default(),
            standings: Vec::new(),
            unfollowed: Unfollowed::default(),
            tilt: None,
            boxes: BTreeMap::new(),
            finished: Vec::new(),
            returned: Vec::new(),
            report: SeekReport::default(),
            is_finished: false,
            longest_walk,
        })
    }

    /// Adds the next frame. Its evidence is processed when the frame after it arrives, at more than 30 frames per second the one
    /// that is a thirtieth of a second later.
    pub fn update(&mut self, frame: &Frame<'_>, time_s: f64) -> Result<(), TrackError> {
        if self.is_finished {
            return Err(TrackError::Finished);
        }
        self.check_camera(frame)?;
        if self.size.is_none() {
            self.size = Some([frame.width(), frame.height()]);
            self.widen([frame.width() as u32, frame.height() as u32]);
        }
        let evidence = self.stream.push(frame, time_s)?;
        self.report.frames += 1;
        if let Some(every_s) = self.rate.push(time_s) {
            self.options.start_frames = lasting(self.given.start_frames, every_s);
            self.options.path_frames = lasting(self.given.path_frames, every_s);
            self.most_missed = lasting(MISSED_FRAMES, every_s);
        }
        if let Some(loss) = self.stream.take_loss() {
            self.end_view(&loss);
        }
        evidence.iter().try_for_each(|evidence| self.advance(evidence))
    }

    /// The same with boxes around the people in the frame, from a detector or another tracker: nobody is looked for
    /// elsewhere, and boxes that overlap are of different people. A box reaches from the crown to the soles.
    ///
    /// # Errors
    ///
    /// Those of [`Tracker::update`]; a box is not within the frame.
    pub fn update_with_boxes(
        &mut self,
        frame: &Frame<'_>,
        time_s: f64,
        boxes: &[Rectangle],
    ) -> Result<(), TrackError> {
        let (width, height) = (frame.width(), frame.height());
        let is_within =
            |r: &&Rectangle| r.left <= r.right && r.right < width && r.top <= r.bottom && r.bottom < height;
        if let Some(given) = boxes.iter().find(|given| !is_within(given)) {
            return Err(TrackError::Box { given: *given, width, height });
        }
        let number = self.stream.frame_count();
        // Those of frames whose view was lost are never asked for.
        self.boxes = self.boxes.split_off(&number.saturating_sub(MOST_WAITING));
        self.boxes.insert(number, boxes.to_vec());
        self.update(frame, time_s).inspect_err(|_| {
            self.boxes.remove(&number);
        })
    }

    /// Ends the stream: processes the last frame and ends the current walk.
    pub fn finish(&mut self) -> Result<(), TrackError> {
        self.is_finished = true;
        let evidence = self.stream.finish()?;
        evidence.iter().try_for_each(|evidence| self.advance(evidence))?;
        self.end_everybody();
        self.unfollowed.finish(self.options.start_frames);
        Ok(())
    }

    /// The walks that have ended since the last call, in order of their first frames. Should a later walk turn out to be the
    /// better model of a person whose walk was taken already, both are returned.
    #[must_use]
    pub fn take_finished(&mut self) -> Vec<TrackedWalk> {
        let mut walks = std::mem::take(&mut self.finished);
        let since_s = self.since_s();
        self.returned.extend(walks.iter().cloned());
        self.returned.retain(|walk| walk.steps().last().is_some_and(|last| last.time_s >= since_s));
        walks.sort_by_key(|walk| (walk.steps().first().map(|step| step.frame), walk.person));
        walks
    }

    /// The state of the person who appeared first of those who are followed at the last processed frame; `None` while
    /// nobody is followed.
    pub fn current(&self) -> Option<Now> {
        self.people().into_iter().next()
    }

    /// The filtered states of everybody who is followed, each of the better twin, in order of appearance.
    pub fn people(&self) -> Vec<Now> {
        let mut people: Vec<Now> =
            self.people.iter().filter_map(|active| active.now(&self.options)).collect();
        people.sort_by_key(|now| now.person);
        people
    }

    /// The options as they were given.
    #[allow(clippy::misnamed_getters, reason = "those in use depend on the frames")]
    pub fn options(&self) -> &TrackerOptions {
        &self.given
    }

    /// Counts of candidates and refused starts so far.
    pub fn seek_report(&self) -> SeekReport {
        SeekReport {
            left_out: self.unfollowed.count(),
            light: self.stream.light(),
            start_frames: self.options.start_frames,
            ..self.report
        }
    }

    /// Who or what moved and was not followed, with the reason, in order of the first frames. The list is complete after
    /// [`Tracker::finish`]; before, it has those who are gone. Of a long stream it has the 100 who were seen longest.
    pub fn left_out(&self) -> Vec<LeftOut> {
        let Some(size) = self.size else { return Vec::new() };
        let mut left_out = self.unfollowed.left_out();
        for shot in left_out.iter_mut().flat_map(|left| &mut left.shots) {
            shot.rectangle = self.stream.in_frame(shot.frame, &shot.rectangle, size);
        }
        left_out
    }

    /// How far the steadied pictures of a camera that pans should go on beyond the frames, for people to be followed there; `None` if
    /// they do. Another tracker with it as [`SteadyOptions::reach`](super::steady::SteadyOptions::reach) sees all of them.
    pub fn wider(&self) -> Option<Reach> {
        self.stream.wider()
    }

    /// What was found of the camera in the latest frames.
    pub fn camera_motions(&self) -> impl Iterator<Item = &CameraMotion> {
        self.stream.camera_motions()
    }

    /// Where a view of the camera ended.
    pub fn losses(&self) -> &[Loss] {
        self.stream.losses()
    }

    fn check_camera(&self, frame: &Frame<'_>) -> Result<(), TrackError> {
        let Some(camera) = &self.given.camera else { return Ok(()) };
        let (width, height) = (frame.width(), frame.height());
        let [camera_width, camera_height] = camera.size;
        if (width, height) == (camera_width as usize, camera_height as usize) {
            return Ok(());
        }
        Err(TrackError::CameraSize { camera_width, camera_height, width, height })
    }

    /// 1. Where everybody is expected; whoever has left the image ends.
    /// 2. Everybody is followed, near to far.
    /// 3. Walks that are over end.
    /// 4. Changes that nobody explains may be somebody else.
    fn advance(&mut self, evidence: &Evidence) -> Result<(), TrackError> {
        if self.options.fit.is_some() {
            self.backdrop.push(evidence.frame, &evidence.grey, evidence.unseen.as_ref());
        }
        let expected = self.expect(evidence);
        let given = self.given_boxes(evidence);
        let are_given = given.is_some();
        // People side by side are sought apart, but somebody who is followed alone has the whole region.
        let (moving, apart) = match given {
            Some(boxes) => (Moving::of_size(boxes.clone()), Moving::of_size(boxes)),
            None => {
                let group = with_small_ones(&self.options.evidence.group);
                let options = EvidenceOptions { group, ..self.options.evidence };
                let regions = evidence.candidates_of(&options, |r| self.can_be_one(r));
                let apart = self.apart(regions.clone(), group.min_area);
                let of = |regions| Moving::new(regions, &self.options.evidence.group);
                (of(regions), of(apart))
            }
        };
        let regions = &moving.regions;
        if self.options.camera.is_none() && self.tilt.is_none() && !regions.is_empty() {
            self.tilt = Some(evidence.tilt(self.options.field_of_view_rad)?);
        }
        self.follow(evidence, &expected, regions)?;
        self.end_walks(evidence);
        self.seek(evidence, apart, are_given)
    }

    fn edges(
        &self,
        evidence: &Evidence,
        window: &Rectangle,
        camera: Option<&Camera>,
    ) -> Result<FrameEdges, TrackError> {
        let edges = evidence.edges(window, camera, &self.options.evidence)?.lines;
        let (frame, time_s, window) = (evidence.frame, evidence.time_s, *window);
        Ok(FrameEdges::of_one_alone(frame, time_s, window, edges))
    }

    /// The given camera, or the one assumed for somebody who is followed.
    fn camera(&self) -> Option<&Camera> {
        self.options.camera.as_ref().or(self.people.first().map(|active| &active.camera))
    }
}

/// The sighting of all changes at a sighting; `None` if the image border cuts them.
fn feet(sighting: &Sighting, evidence: &Evidence, options: &TrackerOptions) -> Option<Sighting> {
    let rectangle = evidence.all_changes(&sighting.rectangle, &options.evidence)?;
    let is_cut = rectangle.bottom + 2 >= evidence.grey.height();
    (!is_cut).then_some(Sighting { rectangle, ..*sighting })
}

/// The sighting of a region that the image border does not cut.
fn whole(region: &Rectangle, evidence: &Evidence) -> Option<Sighting> {
    let rectangle = *region;
    let is_cut = touches_border(&rectangle, evidence.grey.width()) || evidence.is_cut_off(&rectangle);
    (!is_cut).then_some(Sighting { time_s: evidence.time_s, rectangle })
}

/// Reflections may reach the lower border, so only the sides and the top count.
fn touches_border(r: &Rectangle, width: usize) -> bool {
    r.left <= 1 || r.top <= 1 || r.right + 2 >= width
}

/// A rectangle enlarged by a margin, clipped to the image.
fn grown(r: &Rectangle, evidence: &Evidence, margin_px: f64) -> Rectangle {
    let m = margin_px as usize;
    Rectangle {
        left: r.left.saturating_sub(m),
        top: r.top.saturating_sub(m),
        right: (r.right + m).min(evidence.grey.width() - 1),
        bottom: (r.bottom + m).min(evidence.grey.height() - 1),
    }
}

#[cfg(test)]
mod tests;
