//! The tracker: frames in, walks out (Rohr 1994, Fig. 3).
//!
//! 1. It looks for moving regions that could be people and that nobody explains who is followed already.
//! 2. It starts on 13 frames of such a region ([`TrackerOptions::start_frames`]).
//! 3. It follows both half-cycle twins with filters. Nearer people hide farther ones (`crowd`).
//! 4. It looks for an oblique path once [`TrackerOptions::path_frames`] frames are followed, or for as long at a low frame
//!    rate, and for turns from then on (`bend`).
//! 5. It ends the walk when the person leaves the image or stops walking, and fits the person to all its frames
//!    ([`fit`](super::fit)). Whoever walks on where the person was expected has the same number (`people`).
//!
//! Something that stays in one place for `path_frames` frames may walk on a treadmill ([`treadmill`](super::treadmill)),
//! while nobody else is followed.
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

mod on_the_spot;
mod unfollowed;

use super::active::Active;
use super::before::Beside;
use super::candidate::{Candidate, Given, MISSED_FRAMES, Seen};
use super::crowd::{Expected, body_box, changing_share, clear_explained, expected, keep_own, keep_unowned};
use super::decisions::{OUTSIDE_SHARE, SAME_BODY, SAME_PLACE_M};
use super::evidence::{Evidence, EvidenceError, EvidenceOptions, EvidenceStream};
use super::fit::views::{Backdrop, Piece};
use super::fit::{FitError, WalkFit};
use super::height::{is_as_tall, is_of_a_person, is_of_one_person};
use super::left_out::{Hindrance, LeftOut, Reason, Unfollowed};
use super::locate::{Sighting, same_person};
use super::options::TrackerOptions;
pub use super::people::Now;
use super::people::{Identities, Sign};
use super::result::TrackedWalk;
use super::standing::Standing;
use super::steady::{CameraMotion, Loss};
use super::walk::FrameEdges;
use crate::OptionError;
use crate::calibrate::{TiltError, TiltEstimate};
use crate::image::{
    Frame, GroupOptions, LightReport, Mask, Rectangle, Region, Sides, group_regions_of, regions, side_by_side,
};
use crate::model::body::BodyError;
use crate::model::{Body, Camera, EllipticCylinder};
use glam::DVec2;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;
use thiserror::Error;
use unfollowed::{Moving, walk_boxes, with_small_ones};

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
/// At most this many regions are looked at in a frame, the largest: they bound its time.
const MOST_CANDIDATES: usize = 8;
/// Given heights are put in another order than that of appearance if the picture is nearer to another one by so many standard
/// deviations of what it shows.
const CLEAR_SD: f64 = 2.0;
/// People are sought apart after they have been side by side in so many frames in a row.
const APART_FRAMES: usize = 4;
/// A walk that is over is returned after this time, in which somebody may start where it ended, seconds.
const FADING_S: f64 = 1.0;
/// The same with a calibrated camera: the feet of somebody who turned into the line of sight show a walk later.
const FADING_BY_FEET_S: f64 = 3.0;
/// A box belongs to somebody who is followed if it overlaps the body's box by this, intersection over union.
const OWN_BOX: f64 = 0.3;
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
    /// Refused starts: the region moved too slowly, did not fit the height, or did not walk.
    pub refused_starts: usize,
    /// People and things that moved and were not followed ([`Tracker::left_out`]).
    pub left_out: usize,
    /// The light: frames whose brightness differed suddenly and was made that of the others.
    pub light: LightReport,
}

/// A tracker for one stream of frames.
#[derive(Debug)]
pub struct Tracker {
    options: TrackerOptions,
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
    /// Frames of something that may walk on the spot.
    standing: Standing,
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
            options,
            stream,
            backdrop: Backdrop::default(),
            candidates: Vec::new(),
            sought: Vec::new(),
            side_by_side: Vec::new(),
            order_of_heights,
            people: Vec::new(),
            fading: Vec::new(),
            identities: Identities::default(),
            standing: Standing::default(),
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

    /// Adds the next frame. Its evidence is processed when the frame after it arrives.
    pub fn update(&mut self, frame: &Frame<'_>, time_s: f64) -> Result<(), TrackError> {
        if self.is_finished {
            return Err(TrackError::Finished);
        }
        self.check_camera(frame)?;
        self.report.frames += 1;
        let evidence = self.stream.push(frame, time_s)?;
        if let Some(loss) = self.stream.take_loss() {
            self.end_view(&loss);
        }
        evidence.map_or(Ok(()), |evidence| self.advance(&evidence))
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
        self.boxes.insert(number, boxes.to_vec());
        self.update(frame, time_s).inspect_err(|_| {
            self.boxes.remove(&number);
        })
    }

    /// Ends the stream: processes the last frame and ends the current walk.
    pub fn finish(&mut self) -> Result<(), TrackError> {
        self.is_finished = true;
        if let Some(evidence) = self.stream.finish()? {
            self.advance(&evidence)?;
        }
        self.end_everybody();
        self.unfollowed.finish(self.options.start_frames);
        Ok(())
    }

    /// Ends the walks of everybody who is followed or was until lately, one by one: others may have stood in front.
    fn end_everybody(&mut self) {
        while !self.fading.is_empty() {
            let (_, active) = self.fading.remove(0);
            self.end_walk(active);
        }
        while !self.people.is_empty() {
            let active = self.people.remove(0);
            self.end_walk(active);
        }
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

    /// The options in use.
    pub fn options(&self) -> &TrackerOptions {
        &self.options
    }

    /// Counts of candidates and refused starts so far.
    pub fn seek_report(&self) -> SeekReport {
        SeekReport { left_out: self.unfollowed.count(), light: self.stream.light(), ..self.report }
    }

    /// Who or what moved and was not followed, with the reason, in order of the first frames. The list is complete after
    /// [`Tracker::finish`]; before, it has those who are gone. Of a long stream it has the 100 who were seen longest.
    pub fn left_out(&self) -> Vec<LeftOut> {
        self.unfollowed.left_out()
    }

    /// What was found of the camera in the latest frames.
    pub fn camera_motions(&self) -> impl Iterator<Item = &CameraMotion> {
        self.stream.camera_motions()
    }

    /// Where a view of the camera ended.
    pub fn losses(&self) -> &[Loss] {
        self.stream.losses()
    }

    /// Ends all walks before the view ended; what follows is another scene.
    fn end_view(&mut self, loss: &Loss) {
        let fading = self.fading.iter_mut().map(|(_, active)| active);
        fading.chain(&mut self.people).for_each(|active| active.drop_from(loss.frame.saturating_sub(1)));
        let is_short = |active: &Active| active.steps().len() < self.options.start_frames;
        let fading = self.fading.extract_if(.., |(_, active)| is_short(active)).map(|(_, active)| active);
        let short: Vec<Active> =
            fading.chain(self.people.extract_if(.., |active| is_short(active))).collect();
        for active in short {
            let reason = Reason::TooBrief { frames: active.steps().len() };
            self.withdraw(active.person, walk_boxes(&active), reason);
        }
        self.end_everybody();
        self.unfollowed.finish(self.options.start_frames);
        self.candidates.clear();
        self.sought.clear();
        self.side_by_side.clear();
        self.standing = Standing::default();
        self.tilt = None;
        self.identities.forget_ended();
        self.backdrop = Backdrop::default();
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

    /// 1. Where everybody is expected; whoever has left the image ends.
    /// 2. Everybody is followed, near to far.
    /// 3. Walks that are over end.
    /// 4. Changes that nobody explains may be somebody else.
    fn advance(&mut self, evidence: &Evidence) -> Result<(), TrackError> {
        if self.options.fit.is_some() {
            self.backdrop.push(evidence.frame, &evidence.grey);
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

    /// The boxes given for a frame, the largest first; `None` if none were given.
    fn given_boxes(&mut self, evidence: &Evidence) -> Option<Vec<Rectangle>> {
        let later = self.boxes.split_off(&(evidence.frame + 1));
        let given = std::mem::replace(&mut self.boxes, later).remove(&evidence.frame)?;
        let size = [evidence.grey.width(), evidence.grey.height()];
        let place = |r: &Rectangle| self.stream.in_first_view(evidence.frame, r, size);
        let mut boxes: Vec<Rectangle> = given.iter().map(place).collect();
        boxes.sort_by_key(|r| std::cmp::Reverse(r.width() * r.height()));
        Some(boxes)
    }

    /// Sorts the people by distance and predicts each.
    fn expect(&mut self, evidence: &Evidence) -> Vec<Expected> {
        let (mut all, mut gone) = (Vec::new(), Vec::new());
        for active in std::mem::take(&mut self.people) {
            match self.predicted(&active, evidence) {
                Some(expected) => all.push((active, expected)),
                None => gone.push(active),
            }
        }
        all.sort_by(|a, b| a.1.distance_m.total_cmp(&b.1.distance_m));
        let expected;
        (self.people, expected) = all.into_iter().unzip();
        gone.into_iter().for_each(|active| self.end_walk(active));
        expected
    }

    /// Where a person is expected; `None` if too much of the body is outside the image.
    fn predicted(&self, active: &Active, evidence: &Evidence) -> Option<Expected> {
        let best = active.walk.best();
        let predict = |twin| active.walk.predict(twin, evidence.time_s, &self.options.walk.filter);
        let (predicted, other) = (predict(best), predict(1 - best));
        let scene = active.scene(predicted.along.position);
        let body = scene.pose(&predicted.hypothesis()).cylinders;
        let Sides { left, top, right, bottom } = body_box(&active.camera, &body)?;
        let (low, high) = (DVec2::new(left, top), DVec2::new(right, bottom));
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
        let (low_in, high_in) = ((low - margin).max(DVec2::ZERO), (high + margin).min(size - 1.0));
        let window = Rectangle {
            left: low_in.x as usize,
            top: low_in.y as usize,
            right: high_in.x as usize,
            bottom: high_in.y as usize,
        };
        let twins = [predicted.hypothesis(), other.hypothesis()];
        Some(expected(&scene, twins, window, high.y - low.y))
    }

    /// Follows everybody into a frame.
    fn follow(
        &mut self,
        evidence: &Evidence,
        expected: &[Expected],
        regions: &[Rectangle],
    ) -> Result<(), TrackError> {
        let cameras: Vec<&Camera> = self.people.iter().map(|active| &active.camera).collect();
        let windows = expected.par_iter().zip(cameras);
        let edges: Vec<FrameEdges> = windows
            .map(|(own, camera)| self.edges(evidence, &own.window, Some(camera)))
            .collect::<Result<_, _>>()?;
        for (k, (own, mut edges)) in expected.iter().zip(edges).enumerate() {
            let meeting: Vec<usize> =
                (0..expected.len()).filter(|&other| other != k && own.meets(&expected[other])).collect();
            // 1. Nearer people, whose places in this frame are known, stand in front.
            let nearer = meeting.iter().filter(|&&other| other < k);
            let others: Vec<EllipticCylinder> =
                nearer.filter_map(|&other| self.people[other].body()).flatten().collect();
            // 2. Edges of one's own.
            keep_own(
                &mut edges.edges,
                own,
                &meeting.iter().map(|&other| &expected[other]).collect::<Vec<_>>(),
            );
            edges.shared = !meeting.is_empty();
            edges.newcomer = self.candidates.iter().any(|candidate| candidate.is_newcomer(&own.window));
            let camera = &self.people[k].camera;
            edges.changing = changing_share(&evidence.mask, camera, own, &others);
            edges.others.clone_from(&others);
            // 3. A rectangle that nobody else is in.
            let overlaps = |region: &&Rectangle| region.gap(&own.window) == [0, 0];
            let is_alone = meeting.iter().all(|&other| self.is_unproven(other));
            let region = if is_alone { regions.iter().find(overlaps) } else { None };
            let region = region.filter(|region| meeting.is_empty() || self.is_of(k, region, own));
            let sighting = region.and_then(|region| whole(region, evidence));
            let active = &mut self.people[k];
            active.walk.follow(&edges, &active.camera, &self.options.walk);
            if self.options.fit.is_some() {
                let piece = Piece::new(evidence.frame, &evidence.grey, own.window, others);
                active.pieces.push(piece.with_crown(sighting.as_ref()));
                self.backdrop.occupy(evidence.frame, own.window);
            }
            if self.options.camera.is_some() && !active.is_on_treadmill {
                let feet = sighting.and_then(|sighting| feet(&sighting, evidence, &self.options));
                active.feet.extend(feet.map(|feet| (evidence.frame, feet)));
            }
            active.pace(sighting);
            active.kept.push((sighting, edges));
            self.settle(k);
            self.people[k].turn(&self.options);
        }
        Ok(())
    }

    /// True for somebody who was started beside another person and may be a part of that person.
    fn is_unproven(&self, k: usize) -> bool {
        self.people[k].started_near && !self.people[k].settled
    }

    /// True if a region shows one trunk, is as tall as somebody who is followed, and does not reach beyond where that person is
    /// expected.
    fn is_of(&self, k: usize, region: &Rectangle, expected: &Expected) -> bool {
        let Active { camera, height, .. } = &self.people[k];
        let has_trunks = self.side_by_side.iter().any(|(other, _)| other == region);
        let is_within = expected.window.union(region) == expected.window;
        is_within && !has_trunks && is_as_tall(camera, region, height)
    }

    /// Settles path and person of somebody who was followed for long enough.
    fn settle(&mut self, k: usize) {
        let active = &self.people[k];
        if active.settled || !active.shows_path(&self.options) {
            return;
        }
        if self.people.len() == 1 {
            let active = self.people.remove(k);
            let active = self.begun_on_the_spot(active);
            self.people.insert(k, active);
        }
        self.people[k].settle(&self.backdrop, &self.options);
        let standing = std::mem::take(&mut self.standing);
        let active = &mut self.people[k];
        active.earlier = standing.before(active.kept.first().map_or(0, |(_, edges)| edges.frame));
        let active = self.people.remove(k);
        let (person, joined) = (active.person, self.gone_on(&active));
        // Two walks became one.
        if joined.is_some() {
            self.identities.withdraw(person);
        }
        self.people.insert(k, joined.unwrap_or(active));
    }

    /// Ends walks that are over. On a wrong path a walk can seem to be over, so a turn is looked for first.
    fn end_walks(&mut self, evidence: &Evidence) {
        let (time_s, longest) = (evidence.time_s, self.longest_walk);
        let is_long = |active: &mut Active| active.settled && active.walk.twins[0].steps.len() >= longest;
        let mut ended: Vec<Active> = self.people.extract_if(.., is_long).collect();
        let options = &self.options;
        let is_over = |active: &mut Active| {
            active.settled && (active.is_hidden() || active.is_over() && !active.goes_on(options))
        };
        self.fading.extend(self.people.extract_if(.., is_over).map(|active| (time_s, active)));
        let fading_s = if self.options.camera.is_some() { FADING_BY_FEET_S } else { FADING_S };
        let is_gone = |(end_s, _): &mut (f64, Active)| time_s - *end_s > fading_s;
        ended.extend(self.fading.extract_if(.., is_gone).map(|(_, active)| active));
        ended.into_iter().for_each(|active| self.end_walk(active));
    }

    /// The walk that seemed to be over but went on as a later one, which the feet in between and since show.
    fn gone_on(&mut self, later: &Active) -> Option<Active> {
        let options = &self.options;
        let (n, joined) = self
            .fading
            .iter()
            .enumerate()
            .find_map(|(n, (_, old))| Some((n, old.joined(later, options)?)))?;
        self.fading.remove(n);
        Some(joined)
    }

    /// The number of somebody who starts to be followed. A walk can leave its person, who turns or slows. Who starts
    /// where that person was is the same person, whose first walk ends there.
    fn identified(&mut self, new: &Active) -> usize {
        let start = new.sign_at(0).expect("a walk starts with frames");
        let Some(n) = self.faded(&start) else { return self.identities.appear(&start) };
        let (_, mut old) = self.fading.remove(n);
        old.end_before(start.time_s);
        let person = old.person;
        self.identities.is_back(person);
        self.end_walk(old);
        self.identities.forget_end(person);
        person
    }

    /// Which of the walks that are over leads to a start.
    fn faded(&self, start: &Sign) -> Option<usize> {
        // The old walk may have gone on for some frames while the person turned round.
        let stood = |end: Sign| Sign { time_s: end.time_s.min(start.time_s), ..end };
        let end = |old: &Active| old.standing().map(stood).or_else(|| old.sign_before(start.time_s));
        self.fading.iter().position(|(_, old)| end(old).is_some_and(|end| end.leads_to(start)))
    }

    /// True if a walk would get the number of this person, whose walk is over.
    fn is_back(&self, person: usize, new: &Active) -> bool {
        let Some(start) = new.sign_at(0) else { return false };
        let known = self.faded(&start).map(|n| self.fading[n].1.person);
        known.or_else(|| self.identities.known(&start)) == Some(person)
    }

    /// People who may be back, and whose given heights are not that of the next person.
    fn of_other_height(&self, time_s: f64) -> Vec<usize> {
        let height_m = |person: usize| self.given_height(person);
        let next_m = height_m(self.identities.count());
        let fading = self.fading.iter().map(|(_, old)| old.person);
        let mut people: Vec<usize> = fading.chain(self.identities.expected(time_s)).collect();
        people.retain(|&person| height_m(person) != next_m);
        people.sort_unstable();
        people.dedup();
        people
    }

    /// Adds the regions that nobody explains to the candidates, and starts those that walk.
    fn seek(&mut self, evidence: &Evidence, moving: Moving, are_given: bool) -> Result<(), TrackError> {
        let regions = &moving.regions;
        self.report.frames_with_candidate += usize::from(!regions.is_empty());
        let is_cut_off = regions.first().is_some_and(|region| whole(region, evidence).is_none());
        self.report.frames_cut_off += usize::from(is_cut_off);
        if self.people.is_empty() {
            self.stand(evidence, regions.first().and_then(|region| whole(region, evidence)))?;
        }
        let moving = match are_given {
            _ if self.people.is_empty() => moving,
            true => Moving::of_size(self.unclaimed(moving.regions)),
            false => self.unexplained(evidence),
        };
        self.candidates.iter_mut().for_each(|candidate| candidate.missed += 1);
        let camera = if self.people.is_empty() { None } else { self.camera() };
        let can_be = |sighting: &Sighting| camera.is_none_or(|camera| is_of_a_person(camera, sighting));
        let most = if are_given { usize::MAX } else { MOST_CANDIDATES };
        let mut sightings: Vec<Sighting> = Vec::new();
        let mut hinder = |region: &Rectangle| {
            let Some(sighting) = whole(region, evidence) else { return Some(Hindrance::CutOff) };
            if !can_be(&sighting) {
                return Some(Hindrance::WrongSize);
            }
            if sightings.len() == most {
                return Some(Hindrance::Crowded);
            }
            sightings.push(sighting);
            None
        };
        let hindrances: Vec<Option<Hindrance>> = moving.regions.iter().map(&mut hinder).collect();
        self.notice(evidence, &moving, &hindrances);
        let first = evidence.frame.saturating_sub(self.options.path_frames);
        self.sought.retain(|seen| seen.edges.frame >= first);
        for sighting in sightings {
            let seen = self.seen(evidence, sighting)?;
            self.sought.push(Arc::new(seen.clone()));
            let rectangle = &sighting.rectangle;
            let known = self.candidates.iter_mut().filter(|c| c.missed > 0 && c.is_at(rectangle));
            let nearest = known.max_by(|a, b| a.overlap(rectangle).total_cmp(&b.overlap(rectangle)));
            match nearest {
                Some(candidate) => candidate.add(seen),
                None => self.candidates.push(Candidate { seen: vec![seen], ..Candidate::default() }),
            }
        }
        self.candidates.retain(|candidate| candidate.missed <= MISSED_FRAMES);
        self.start(evidence);
        self.start_on_the_spot(evidence);
        self.settle_unfollowed();
        Ok(())
    }

    /// Boxes that are not those of the people who are followed: each has the box that overlaps the body most.
    fn unclaimed(&self, mut boxes: Vec<Rectangle>) -> Vec<Rectangle> {
        for active in &self.people {
            let Some(body) = active.as_followed().and_then(|seen| body_box(&active.camera, &seen.body))
            else {
                continue;
            };
            let overlaps = boxes.iter().map(|r| r.sides(0.0).overlap(&body)).enumerate();
            let own = overlaps.max_by(|a, b| a.1.total_cmp(&b.1));
            if let Some((k, _)) = own.filter(|(_, part)| *part >= OWN_BOX) {
                boxes.remove(k);
            }
        }
        boxes
    }

    /// Regions of change that the bodies of the people do not explain.
    fn unexplained(&self, evidence: &Evidence) -> Moving {
        let mut mask: Mask = evidence.firm_mask.clone();
        for active in &self.people {
            if let Some(seen) = active.as_followed() {
                clear_explained(&mut mask, &active.camera, &seen.body, seen.height_px);
            }
        }
        let group: &GroupOptions = &self.options.evidence.group;
        let parts = regions(&mask, group.min_part_area);
        Moving::new(group_regions_of(&parts, &with_small_ones(group), |r| self.can_be_one(r)), group)
    }

    /// Regions divided where people have been side by side for some frames, largest first.
    fn apart(&mut self, regions: Vec<Region>, min_area: usize) -> Vec<Region> {
        let before = std::mem::take(&mut self.side_by_side);
        let mut apart = Vec::new();
        for region in regions {
            let parts = side_by_side(region.clone());
            let last = before.iter().filter(|(last, _)| same_person(last, &region.rectangle));
            let frames = 1 + last.map(|(_, frames)| *frames).max().unwrap_or(0);
            if parts.len() > 1 {
                self.side_by_side.push((region.rectangle, frames));
            }
            if parts.len() > 1 && frames >= APART_FRAMES {
                // What was seen of them as one thing belongs to neither.
                if frames == APART_FRAMES {
                    self.candidates.retain(|candidate| !candidate.is_at(&region.rectangle));
                }
                apart.extend(parts.into_iter().filter(|part| part.area >= min_area));
            } else {
                apart.push(region);
            }
        }
        apart.sort_by_key(|region| std::cmp::Reverse(region.area));
        apart
    }

    /// False if a rectangle is too tall for one person who stands on the ground of a given camera.
    fn can_be_one(&self, rectangle: &Rectangle) -> bool {
        self.options.camera.as_ref().is_none_or(|camera| is_of_one_person(camera, rectangle))
    }

    /// What a candidate shows in a frame, without the edges of people who are followed.
    fn seen(&mut self, evidence: &Evidence, sighting: Sighting) -> Result<Seen, TrackError> {
        let window = grown(&sighting.rectangle, evidence, WINDOW_MARGIN_PX);
        let mut edges = self.edges(evidence, &window, self.camera())?;
        for active in &self.people {
            let Some(expected) = active.as_followed() else { continue };
            if expected.window.gap(&window) == [0, 0] {
                edges.shared = true;
                keep_unowned(&mut edges.edges, &[&expected]);
                edges.others.extend(expected.body);
            }
        }
        let piece = self.options.fit.map(|_| {
            self.backdrop.occupy(evidence.frame, sighting.rectangle);
            let alone = (!edges.shared).then_some(&sighting);
            Piece::new(evidence.frame, &evidence.grey, sighting.rectangle, edges.others.clone())
                .with_crown(alone)
        });
        Ok(Seen { sighting, edges, piece })
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

    /// Relative standard deviation of the scale of that camera, if it is that of somebody who is followed.
    fn scale_sd(&self) -> f64 {
        let borrowed = self.people.first().filter(|_| self.options.camera.is_none());
        borrowed.map_or(0.0, |active| active.height.relative_sd().max(active.height.scale_sd))
    }

    /// Starts walks on candidates that have enough frames, in order of appearance, or drops their oldest ones.
    fn start(&mut self, evidence: &Evidence) {
        let size = [evidence.grey.width() as u32, evidence.grey.height() as u32];
        for mut candidate in std::mem::take(&mut self.candidates) {
            if candidate.seen.len() < self.frames_to_start(&candidate) || candidate.missed > 0 {
                self.candidates.push(candidate);
                continue;
            }
            let order = self.order_of_heights.clone();
            self.order_heights(&candidate);
            let begun = self.begun(&candidate, size).and_then(|active| {
                let is_own = self.is_somebody_else(&active) && !self.is_left_over(&active);
                if is_own { Ok(active) } else { Err(Reason::Beside) }
            });
            match begun {
                Ok(mut active) => {
                    let known = self.identities.count();
                    active.person = self.identified(&active);
                    active.started_near = !self.people.is_empty();
                    active.before = self.before(&candidate);
                    // In the frames before somebody is back, there may be the earlier walk.
                    if active.person < known {
                        active.before.clear();
                        self.order_of_heights = order;
                    }
                    active.started_frame = Some(evidence.frame);
                    self.people.push(active);
                }
                Err(reason) => {
                    self.order_of_heights = order;
                    self.report.refused_starts += 1;
                    let last = candidate.last_rectangle();
                    last.iter().for_each(|r| self.unfollowed.refuse(evidence.frame, r, reason));
                    candidate.refuse(&self.options);
                    self.candidates.push(candidate);
                }
            }
        }
    }

    /// What the regions of the frames before those of a candidate showed.
    fn before(&self, candidate: &Candidate) -> Vec<Arc<Seen>> {
        let first = candidate.seen.first().map_or(0, |seen| seen.edges.frame);
        self.sought.iter().filter(|seen| seen.edges.frame < first).cloned().collect()
    }

    /// The given height of a person; `None` if it is to be measured.
    fn given_height(&self, person: usize) -> Option<f64> {
        self.options.height_of(self.order_of_heights.get(person).copied().unwrap_or(person))
    }

    /// Gives the next person the one of the heights of nobody yet that a calibrated camera shows, if that is clearly not the
    /// first of them.
    fn order_heights(&mut self, candidate: &Candidate) {
        let next = self.identities.count();
        let Some(camera) = &self.options.camera else { return };
        let Some(left) = self.order_of_heights.get(next..).filter(|left| left.len() > 1) else { return };
        let seen = candidate.seen_height(&self.options, camera);
        let off_m = |k: usize| {
            let given = self.options.height_of(left[k]);
            given.map_or(f64::INFINITY, |height_m| (height_m - seen.height_m).abs())
        };
        let nearest = (0..left.len()).min_by(|&a, &b| off_m(a).total_cmp(&off_m(b)));
        if let Some(k) = nearest.filter(|&k| off_m(0) > off_m(k) + CLEAR_SD * seen.sd_m) {
            self.order_of_heights[next..=next + k].rotate_right(1);
        }
    }

    /// The walk of a candidate, with the height of its person: of somebody who is expected back and is back with it, or
    /// of the next one.
    fn begun(&self, candidate: &Candidate, size: [u32; 2]) -> Result<Active, Reason> {
        let begin = |person: usize| {
            let (options, camera, tilt) = (&self.options, self.camera(), self.tilt);
            let (scale_sd, height_m) = (self.scale_sd(), self.given_height(person));
            candidate.begin(&Given { options, camera, tilt, scale_sd, height_m, size })
        };
        let is_back = |person: usize| begin(person).ok().filter(|active| self.is_back(person, active));
        let time_s = candidate.seen.first().map_or(0.0, |seen| seen.edges.time_s);
        let back = self.of_other_height(time_s).into_iter().find_map(is_back);
        back.map_or_else(|| begin(self.identities.count()), Ok)
    }

    /// Somebody beside a followed person is soon hidden or mistaken for that person, so half as many frames must do.
    fn frames_to_start(&self, candidate: &Candidate) -> usize {
        let all = self.options.start_frames;
        let is_beside =
            |active: &Active| active.as_followed().is_some_and(|followed| candidate.is_in(&followed.window));
        if self.people.iter().any(is_beside) { all.div_ceil(2) } else { all }
    }

    /// False if somebody is followed where a walk would start: on the ground or, as far as distances are known badly, in
    /// the picture.
    fn is_somebody_else(&self, new: &Active) -> bool {
        let place = |active: &Active| active.sign().map(|sign| sign.place_m);
        let near =
            |other: &Active| place(other).zip(place(new)).is_some_and(|(a, b)| a.distance(b) < SAME_PLACE_M);
        !self.people.iter().any(|other| near(other) || new.overlap(other) > SAME_BODY)
    }

    /// True if the changes were left over from somebody who turned: that person's contours are more similar on a curve.
    fn is_left_over(&mut self, new: &Active) -> bool {
        let Some(found) = new.as_followed() else { return false };
        let beside = |person: &&mut Active| person.as_followed().is_some_and(|other| other.meets(&found));
        let options = &self.options;
        self.people.iter_mut().filter(beside).any(|person| person.has_turned(options))
    }

    /// 1. The route and its frames, from before and after each of them.
    /// 2. The person, fitted to all of them.
    /// 3. What is no walk, or a second model of somebody else, is withdrawn.
    fn end_walk(&mut self, active: Active) {
        let mut active = if active.settled { active } else { self.begun_on_the_spot(active) };
        let standing = self.complete(&mut active);
        let walk_boxes = walk_boxes(&active);
        if !active.is_walk() {
            return self.withdraw(active.person, walk_boxes, Reason::NotWalking);
        }
        let p_swapped = active.p_swapped(&self.options);
        let fit = active.fit(&self.backdrop, &self.options, Some(p_swapped));
        if let Some(reason) = self.no_walk(&active, fit.as_ref()) {
            return self.withdraw(active.person, walk_boxes, reason);
        }
        let sign = standing.or_else(|| active.sign());
        let walk = self.tracked(active, fit);
        // Two models can come to lie on one person, the fitted ones too.
        if self.finished.iter().chain(&self.returned).any(|other| walk.is_double_of(other)) {
            return self.withdraw(walk.person, walk_boxes, Reason::Beside);
        }
        if let Some(k) = self.finished.iter().position(|other| other.is_double_of(&walk)) {
            let double = self.finished.remove(k);
            self.withdraw(double.person, None, Reason::Beside);
        }
        walk_boxes.into_iter().for_each(|walk_boxes| self.unfollowed.followed(walk_boxes));
        if let Some(sign) = sign {
            self.identities.end(walk.person, sign);
        }
        self.finished.push(walk);
    }

    /// Completes the route and the frames of a walk that is over; returns where the person stands, if so.
    fn complete(&self, active: &mut Active) -> Option<Sign> {
        active.settle(&self.backdrop, &self.options);
        // On a smoothed route, the feet would walk on.
        let standing = active.standing();
        let fading = self.fading.iter().map(|(_, other)| other);
        let followed = self.people.iter().chain(fading).map(|other| (&other.walk, &other.camera));
        let ended = self.finished.iter().chain(&self.returned).map(|other| (&other.walk, &other.camera));
        let beside =
            followed.chain(ended).filter_map(|(walk, camera)| Beside::new(walk, camera, &self.options));
        active.begin_before(&beside.collect::<Vec<_>>(), &self.options);
        active.begin_earlier(&self.options);
        active.turned(&self.options);
        active.pace_all();
        active.straighten(&self.options.walk);
        let standing = standing.or_else(|| active.standing());
        active.trim();
        standing
    }

    /// Why something that was followed is no walk. What was left over from somebody else can look like a walker, but then
    /// the contours do not fit.
    fn no_walk(&self, active: &Active, fit: Option<&Result<WalkFit, FitError>>) -> Option<Reason> {
        let frames = active.steps().len();
        if active.started_near && frames < self.options.start_frames {
            return Some(Reason::TooBrief { frames });
        }
        let is_left_over = active.started_near && matches!(fit, Some(Err(FitError::Misfit { .. })));
        let takes_steps = active.takes_steps(fit.and_then(|fit| fit.as_ref().ok()));
        (is_left_over || !takes_steps).then_some(Reason::NotWalking)
    }

    fn tracked(&self, active: Active, fit: Option<Result<WalkFit, FitError>>) -> TrackedWalk {
        TrackedWalk {
            person: active.person,
            camera_turns: active.turns(self.stream.camera_motions()),
            crowns_px: active.crowns_px(),
            height: active.height_by(fit.as_ref().and_then(|fit| fit.as_ref().ok())),
            is_frontal: active.is_frontal(),
            walk: active.walk,
            camera: active.camera,
            average: active.average,
            depth_sd_m: active.depth_sd_m,
            start: active.start,
            tilt: active.tilt,
            gait_speed_mps: active.gait_speed_mps,
            is_on_treadmill: active.is_on_treadmill,
            fit,
            options: self.options.walk,
        }
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
