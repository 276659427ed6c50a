//! The tracker: frames in, walks out (Rohr 1994, Fig. 3).
//!
//! 1. It looks for a moving region that could be a person.
//! 2. It starts on 13 frames of that region ([`TrackerOptions::start_frames`]).
//! 3. It follows both half-cycle twins with filters.
//! 4. It looks for an oblique path once [`TrackerOptions::path_frames`] frames are followed.
//! 5. It ends the walk when the person leaves the image or stops walking, fits the person to all its frames
//!    ([`fit`](super::fit)), and looks for a person again.
//!
//! It tracks one person at a time: the largest moving region that is fully visible.
//!
//! Memory does not grow with the length of the stream. The tracker keeps two frames, the edges of at most
//! [`TrackerOptions::path_frames`] or `start_frames` frames, whichever is more, the rows of the current walk and, for
//! the fit, 32 frames of the stream and the part of each frame of the walk that shows the person. A walk longer than
//! [`FitOptions::longest`](super::fit::FitOptions::longest) frames, or [`LONGEST_WALK`] without a fit, is returned in
//! pieces of that length.
//!
//! Edges are matched within a few pixels, whatever the image size. Shrink images whose longer side exceeds about
//! 1280 pixels first, and their camera with [`Camera::shrunk`]: a 720p walk enlarged to 1080p was tracked as
//! well, but enlarged to 1440p it was taken for backward walking.

use super::active::{Active, SLOWEST_MPS};
use super::evidence::{Evidence, EvidenceError, EvidenceStream};
use super::fit::views::{Backdrop, Piece};
use super::height::{BodyHeight, GIVEN_SD_M, start_height};
use super::locate::{Course, Crown, LocateError, Sighting, camera_from_sightings, locate};
use super::options::TrackerOptions;
use super::result::TrackedWalk;
use super::search::{Hypothesis, Scene};
use super::start::{StartReport, start};
use super::walk::{FrameEdges, Walk};
use crate::image::{Frame, Rectangle};
use crate::model::body::BodyError;
use crate::model::{Body, Camera, GaitStyle, Walker};
use crate::option_error::OptionError;
use glam::{DVec2, DVec3};
use thiserror::Error;

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
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// [`Tracker::finish`] was called before.
    #[error("the stream has ended: make a new tracker for further frames")]
    Finished,
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
/// A candidate is dropped after this many consecutive frames without it.
const MISSED_FRAMES: usize = 3;
/// Speed of a comfortable walk, used before the speed is known, m/s.
const COMFORTABLE_MPS: f64 = 1.3;
/// Nobody walks faster than this, m/s.
const FASTEST_MPS: f64 = 3.0;
/// A moving region is a walker if the similarity along the best line of phase exceeds the mean over all phases by
/// this factor. Measured: walkers 1.35 and more, backward walkers 1.23; sliding boxes up to 1.20.
const LEAST_CONTRAST: f64 = 1.22;
/// Gaits other than the average with which a walk can start.
const OTHER_GAITS: [GaitStyle; 1] = [GaitStyle::CROUCHED];
/// Another gait starts if it is more similar than the average one by this factor.
const OTHER_GAIN: f64 = 1.05;
/// A walk ends when this share of the body's height or width is outside the image.
const OUTSIDE_SHARE: f64 = 0.4;
/// Edges are searched this far around the predicted body, pixels.
const WINDOW_MARGIN_PX: f64 = 16.0;

/// Counts over the whole stream, walks included. If nobody was followed, they show why.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SeekReport {
    /// Frames seen.
    pub frames: usize,
    /// Frames with a moving region large enough for a person.
    pub frames_with_candidate: usize,
    /// Of these, frames in which the image border cut the region.
    pub frames_cut_off: usize,
    /// Refused starts: the region moved too slowly, did not fit the height, or did not walk.
    pub refused_starts: usize,
}

/// The latest filtered estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Now {
    /// Number of the frame.
    pub frame: usize,
    /// Its time, seconds.
    pub time_s: f64,
    /// Centre of the torso, metres.
    pub torso_centre: DVec3,
    /// Direction the body faces, radians about world Z.
    pub heading_rad: f64,
    /// Gait phase in [0, 1), 0 = right heel strike (initial contact).
    pub phase: f64,
    /// Probability, from the frames so far, that left and right are swapped.
    pub p_swapped: f64,
    /// Speed along the path, m/s.
    pub speed_mps: f64,
}

/// A tracker for one stream of frames.
#[derive(Debug)]
pub struct Tracker {
    options: TrackerOptions,
    stream: EvidenceStream,
    seen: Vec<(Sighting, FrameEdges)>,
    /// The pictures of `seen`, kept only for a fit.
    seen_pieces: Vec<Piece>,
    backdrop: Backdrop,
    missed: usize,
    walking: Option<Active>,
    finished: Vec<TrackedWalk>,
    report: SeekReport,
    is_finished: bool,
    /// Number of frames after which a walk is returned.
    longest_walk: usize,
}

impl Tracker {
    /// A tracker for a new stream; an error if the body height or an option is out of range.
    pub fn new(options: TrackerOptions) -> Result<Self, TrackError> {
        options.height_m.map(Body::from_height).transpose()?;
        options.check()?;
        let stream = EvidenceStream::new(options.evidence);
        let longest_walk = options.fit.map_or(LONGEST_WALK, |fit| fit.longest.min(LONGEST_WALK));
        Ok(Self {
            options,
            stream,
            seen: Vec::new(),
            seen_pieces: Vec::new(),
            backdrop: Backdrop::default(),
            missed: 0,
            walking: None,
            finished: Vec::new(),
            report: SeekReport::default(),
            is_finished: false,
            longest_walk,
        })
    }

    /// Adds the next frame. Its evidence is processed when the frame after it arrives.
    pub fn update(&mut self, frame: &Frame<'_>, time_s: f64) -> Result<(), TrackError> {
        if self.is_finished {
            return Err(TrackError::Finished);
        }
        self.check_camera(frame)?;
        self.report.frames += 1;
        if let Some(evidence) = self.stream.push(frame, time_s)? {
            self.advance(&evidence)?;
        }
        Ok(())
    }

    /// Ends the stream: processes the last frame and ends the current walk.
    pub fn finish(&mut self) -> Result<(), TrackError> {
        self.is_finished = true;
        let stream = std::mem::replace(&mut self.stream, EvidenceStream::new(self.options.evidence));
        if let Some(evidence) = stream.finish()? {
            self.advance(&evidence)?;
        }
        self.end_walk();
        Ok(())
    }

    /// The walks that have ended since the last call.
    #[must_use]
    pub fn take_finished(&mut self) -> Vec<TrackedWalk> {
        std::mem::take(&mut self.finished)
    }

    /// The filtered state of the better twin at the last processed frame; `None` while nobody is followed.
    pub fn current(&self) -> Option<Now> {
        let active = self.walking.as_ref()?;
        let step = active.walk.last()?;
        let hypothesis = step.state.hypothesis();
        let scene = Scene { walker: &active.walk.walker, camera: &active.camera, path: &active.walk.path };
        Some(Now {
            frame: step.frame,
            time_s: step.time_s,
            torso_centre: scene.pose(&hypothesis).torso_centre,
            heading_rad: active.walk.path.heading_rad,
            phase: hypothesis.phase,
            p_swapped: active.walk.swap_probability(&self.options.walk.swap),
            speed_mps: step.state.along.velocity,
        })
    }

    /// The options in use.
    pub fn options(&self) -> &TrackerOptions {
        &self.options
    }

    /// Counts of candidates and refused starts so far.
    pub fn seek_report(&self) -> SeekReport {
        self.report
    }

    fn check_camera(&self, frame: &Frame<'_>) -> Result<(), TrackError> {
        let Some(camera) = &self.options.camera else { return Ok(()) };
        let (width, height) = (frame.width(), frame.height());
        let [camera_width, camera_height] = camera.size;
        if (width, height) == (camera_width as usize, camera_height as usize) {
            return Ok(());
        }
        Err(TrackError::CameraSize { camera_width, camera_height, width, height })
    }

    fn advance(&mut self, evidence: &Evidence) -> Result<(), TrackError> {
        if self.options.fit.is_some() {
            self.backdrop.push(evidence.frame, &evidence.grey);
        }
        if self.walking.is_some() { self.follow(evidence) } else { self.seek(evidence) }
    }

    /// Collects sightings of one candidate and tries to start when there are enough.
    fn seek(&mut self, evidence: &Evidence) -> Result<(), TrackError> {
        match self.sighting(evidence, None) {
            Some(sighting) => {
                let edges = self.edges(evidence, &grown(&sighting.rectangle, evidence, WINDOW_MARGIN_PX))?;
                if self
                    .seen
                    .last()
                    .is_some_and(|(last, _)| !same_person(&last.rectangle, &sighting.rectangle))
                {
                    self.forget();
                }
                if self.options.fit.is_some() {
                    self.seen_pieces.push(Piece::new(evidence.frame, &evidence.grey, sighting.rectangle));
                }
                self.seen.push((sighting, edges));
                self.missed = 0;
            }
            None => {
                self.missed += 1;
                if self.missed > MISSED_FRAMES {
                    self.forget();
                }
            }
        }
        if self.seen.len() >= self.options.start_frames {
            self.try_start(evidence);
        }
        Ok(())
    }

    /// Drops the candidate.
    fn forget(&mut self) {
        self.seen.clear();
        self.seen_pieces.clear();
    }

    /// The candidate if it is fully visible: the largest region, or the one that overlaps `expected`.
    fn sighting(&mut self, evidence: &Evidence, expected: Option<&Rectangle>) -> Option<Sighting> {
        let candidates = evidence.candidates(&self.options.evidence);
        let region = candidates.iter().find(|r| expected.is_none_or(|e| overlaps(&r.rectangle, e)))?;
        let rectangle = region.rectangle;
        self.report.frames_with_candidate += 1;
        if touches_border(&rectangle, evidence.grey.width()) {
            self.report.frames_cut_off += 1;
            return None;
        }
        Some(Sighting { time_s: evidence.time_s, rectangle })
    }

    fn edges(&self, evidence: &Evidence, window: &Rectangle) -> Result<FrameEdges, TrackError> {
        let camera = self.walking.as_ref().map(|active| &active.camera).or(self.options.camera.as_ref());
        let edges = evidence.edges(window, camera, &self.options.evidence)?.lines;
        Ok(FrameEdges { frame: evidence.frame, time_s: evidence.time_s, window: *window, edges })
    }

    /// Starts a walk on the collected sightings, or drops the oldest ones.
    fn try_start(&mut self, evidence: &Evidence) {
        let size = [evidence.grey.width() as u32, evidence.grey.height() as u32];
        match self.begin(size) {
            Some(mut active) => {
                active.pieces = std::mem::take(&mut self.seen_pieces);
                self.forget();
                self.walking = Some(active);
            }
            None => {
                self.report.refused_starts += 1;
                let dropped = self.options.start_frames / 3;
                self.seen.drain(..dropped);
                self.seen_pieces.drain(..dropped.min(self.seen_pieces.len()));
            }
        }
    }

    /// 1. Camera and course from the rectangles.
    /// 2. Lines of phase over the whole cycle, of several gaits; the most similar gait starts.
    /// 3. Both twins followed through the start frames.
    fn begin(&self, size: [u32; 2]) -> Option<Active> {
        let sightings: Vec<Sighting> = self.seen.iter().map(|(s, _)| *s).collect();
        if feet_cut_off(&sightings, size[1] as usize) {
            return None;
        }
        let height = start_height(&self.options, &sightings);
        let average = self.started(&sightings, size, &height, &GaitStyle::default())?;
        let similarity = |started: &Started| started.start.lines.best.similarity;
        let others = if self.options.fit.is_some() { &OTHER_GAITS[..] } else { &[] };
        let Started { camera, course, walker, start } = others
            .iter()
            .filter_map(|style| self.started(&sightings, size, &height, style))
            .filter(|other| similarity(other) > OTHER_GAIN * similarity(&average))
            .max_by(|a, b| similarity(a).total_cmp(&similarity(b)))
            .unwrap_or(average);
        // A thing carried along in one posture looks like a walker, but then a constant phase explains it best.
        if start.contrast() < LEAST_CONTRAST || start.frozen.similarity >= start.lines.best.similarity {
            return None;
        }
        let mut walk = Walk::new(walker.clone(), start.path, start.beginning);
        let kept: Vec<_> = self.seen.iter().map(|(s, e)| (Some(*s), e.clone())).collect();
        for (_, edges) in &kept {
            walk.follow(edges, &camera, &self.options.walk);
        }
        Some(Active {
            camera,
            height,
            depth_sd_m: course.depth_sd_m,
            start,
            walk,
            average: Walker { style: GaitStyle::default(), ..walker },
            kept,
            gait_speed_mps: course.speed_mps,
            settled: false,
            pieces: Vec::new(),
        })
    }

    /// The course and the lines of phase of one gait; `None` for things that do not move like a walker.
    fn started(
        &self,
        sightings: &[Sighting],
        size: [u32; 2],
        height: &BodyHeight,
        style: &GaitStyle,
    ) -> Option<Started> {
        let styled = |speed_mps: f64| {
            Some(Walker { style: *style, ..self.options.walker(height.height_m, speed_mps).ok()? })
        };
        let (camera, course) =
            self.course(sightings, size, styled(COMFORTABLE_MPS)?.level_crown_height_m(), height).ok()?;
        if !(SLOWEST_MPS..FASTEST_MPS).contains(&course.speed_mps) {
            return None;
        }
        let walker = styled(course.speed_mps)?;
        let edges: Vec<&FrameEdges> = self.seen.iter().map(|(_, e)| e).collect();
        let start = start(&edges, &course, &walker, &camera, &self.options.cadence, &self.options.walk)?;
        Some(Started { camera, course, walker, start })
    }

    fn course(
        &self,
        sightings: &[Sighting],
        size: [u32; 2],
        crown_m: f64,
        height: &BodyHeight,
    ) -> Result<(Camera, Course), LocateError> {
        let Some(camera) = &self.options.camera else {
            // The assumed camera has the scale of the height, so in it the height is known. Its error moves the walk
            // nearer or farther with all its lengths.
            let camera = camera_from_sightings(sightings, size, self.options.field_of_view_rad, crown_m)?;
            let crown = Crown { height_m: crown_m, sd_m: GIVEN_SD_M };
            let course = locate(sightings, &camera, &crown)?;
            let distance_m = course.path.distance(camera.position().truncate());
            let depth_sd_m = course.depth_sd_m.hypot(height.assumed_scale_sd() * distance_m);
            return Ok((camera, Course { depth_sd_m, ..course }));
        };
        let course = locate(sightings, camera, &Crown { height_m: crown_m, sd_m: height.sd_m })?;
        Ok((camera.clone(), course))
    }

    /// Follows the person into a frame, or ends the walk.
    fn follow(&mut self, evidence: &Evidence) -> Result<(), TrackError> {
        let Some(window) = self.predicted_window(evidence) else {
            self.end_walk();
            return self.seek(evidence);
        };
        let sighting = self.sighting(evidence, Some(&window));
        let edges = self.edges(evidence, &window)?;
        let Some(active) = &mut self.walking else { return Ok(()) };
        active.walk.follow(&edges, &active.camera, &self.options.walk);
        if self.options.fit.is_some() {
            active.pieces.push(Piece::new(evidence.frame, &evidence.grey, window));
        }
        if !active.settled {
            active.kept.push((sighting, edges));
            if active.kept.len() >= self.options.path_frames {
                active.settle(&self.backdrop, &self.options);
            }
        }
        // On a wrong path a walk can seem to be over, so the path is looked for first.
        if active.settled && (active.is_over() || active.walk.twins[0].steps.len() >= self.longest_walk) {
            self.end_walk();
        }
        Ok(())
    }

    /// The image rectangle in which the body is expected; `None` if too much of it is outside the image.
    fn predicted_window(&self, evidence: &Evidence) -> Option<Rectangle> {
        let active = self.walking.as_ref()?;
        let predicted = active.walk.predict(active.walk.best(), evidence.time_s, &self.options.walk.filter);
        let scene = Scene { walker: &active.walk.walker, camera: &active.camera, path: &active.walk.path };
        let (low, high) = body_box(&scene, &predicted.hypothesis())?;
        let size = DVec2::new(evidence.grey.width() as f64, evidence.grey.height() as f64);
        let (low_in, high_in) = (low.max(DVec2::ZERO), high.min(size - 1.0));
        let shown = (high_in - low_in) / (high - low);
        if shown.min_element() < 1.0 - OUTSIDE_SHARE {
            return None;
        }
        let reach =
            DVec2::new(predicted.along.position_sd().min(0.2), predicted.height.position_sd().min(0.1));
        let scale = (high.y - low.y) / active.walk.walker.body.height_m;
        let margin = reach * scale + WINDOW_MARGIN_PX;
        let (low, high) = ((low - margin).max(DVec2::ZERO), (high + margin).min(size - 1.0));
        Some(Rectangle {
            left: low.x as usize,
            top: low.y as usize,
            right: high.x as usize,
            bottom: high.y as usize,
        })
    }

    fn end_walk(&mut self) {
        if let Some(mut active) = self.walking.take() {
            active.settle(&self.backdrop, &self.options);
            active.trim();
            if !active.is_walk() {
                self.report.refused_starts += 1;
                return;
            }
            let p_swapped = active.walk.swap_probability(&self.options.walk.swap);
            let fit = active.fit(&self.backdrop, &self.options, Some(p_swapped));
            let height = active.height_by(fit.as_ref().and_then(|fit| fit.as_ref().ok()));
            self.finished.push(TrackedWalk {
                walk: active.walk,
                height,
                camera: active.camera,
                depth_sd_m: active.depth_sd_m,
                start: active.start,
                camera_is_guessed: self.options.camera.is_none(),
                gait_speed_mps: active.gait_speed_mps,
                fit,
                options: self.options.walk,
            });
        }
    }
}

/// A start with one gait.
struct Started {
    camera: Camera,
    course: Course,
    walker: Walker,
    start: StartReport,
}

/// Bounding box of the body in the image, pixels.
fn body_box(scene: &Scene<'_>, hypothesis: &Hypothesis) -> Option<(DVec2, DVec2)> {
    let posed = scene.pose(hypothesis);
    let mut bounds = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for cylinder in &posed.cylinders {
        let end = cylinder.world_from_cylinder.matrix3.z_axis * cylinder.half_length;
        for point in [cylinder.centre() + end, cylinder.centre() - end] {
            let pixel = scene.camera.project(point)?;
            bounds = (bounds.0.min(pixel), bounds.1.max(pixel));
        }
    }
    Some(bounds)
}

/// Reflections may reach the lower border, so only the sides and the top count.
fn touches_border(r: &Rectangle, width: usize) -> bool {
    r.left <= 1 || r.top <= 1 || r.right + 2 >= width
}

/// True if the rectangle touches the lower border in most frames. A reflection touches it only now and then.
fn feet_cut_off(sightings: &[Sighting], height: usize) -> bool {
    2 * sightings.iter().filter(|s| s.rectangle.bottom + 2 >= height).count() > sightings.len()
}

fn overlaps(a: &Rectangle, b: &Rectangle) -> bool {
    a.gap(b) == [0, 0]
}

/// True if two rectangles of neighbouring frames can enclose the same person.
fn same_person(a: &Rectangle, b: &Rectangle) -> bool {
    let ratio = a.height() as f64 / b.height() as f64;
    overlaps(a, b) && (0.6..1.6).contains(&ratio)
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
