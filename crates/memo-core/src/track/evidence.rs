//! Evidence of each frame for tracking: moving regions and straight edges (Rohr 1994, sections 4.1 and 4.3).
//!
//! Change detection compares a frame with the one before and the one after, so evidence comes one frame late. At more than 30
//! frames per second, in which hardly anything moves from one to the next, these are the nearest ones that are about a
//! thirtieth of a second away, and the frames of that time are kept. With a [`Steadier`], frames of a moving camera are first
//! turned into the camera of the first frame; what a frame does not show there is no evidence. If the light flickers, frames
//! have the brightness before ([`SteadyLight`]).

use super::score::EdgeLine;
use super::steady::{CameraMotion, Loss, Reach, Steadied, Steadier};
use crate::OptionError;
use crate::calibrate::tilt::camera_tilt;
use crate::calibrate::{TiltError, TiltEstimate};
use crate::image::edge::{EdgeChains, EdgeDomain, EdgeOptions, Window, edge_chains};
use crate::image::flow::{FlowField, FlowOptions, velocity_field};
use crate::image::line::{EdgeSegment, LineError, LineOptions, segments_from_chains};
use crate::image::{
    Background, BackgroundOptions, ChangeError, ChangeOptions, CleanOptions, Frame, FrameError, GroupOptions,
    Image, LightReport, Mask, Rectangle, Region, SteadyLight, clean, dilate, fill_holes, group_regions_of,
    pair_changes, regions, unite,
};
use crate::model::Camera;
use glam::DVec2;
use std::collections::VecDeque;
use thiserror::Error;

/// Why a frame was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EvidenceError {
    /// The size of the frame differs from the frames before.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The options of edge or line detection are not valid.
    #[error(transparent)]
    Line(#[from] LineError),
    /// The time of a frame is not finite.
    #[error("the time of a frame must be a finite number of seconds, got {time_s}")]
    Time {
        /// Time given, seconds.
        time_s: f64,
    },
    /// The time of a frame is not after the time of the frame before.
    #[error("frame times must increase: {time_s} s came after {previous_s} s")]
    TimeOrder {
        /// Time of the frame before, seconds.
        previous_s: f64,
        /// Time of this frame, seconds.
        time_s: f64,
    },
}

impl From<ChangeError> for EvidenceError {
    fn from(error: ChangeError) -> Self {
        match error {
            ChangeError::Frame(error) => Self::Frame(error),
            ChangeError::Option(error) => Self::Option(error),
        }
    }
}

/// Options of the stages from pixels to regions and edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvidenceOptions {
    /// Change detection, eq. (1), for the mask near which edges are searched. Its low threshold loses no limb.
    pub change: ChangeOptions,
    /// Minimum threshold of the change detection for the rectangle, grey levels. Default 10: floor reflections
    /// and shadows change by less; at 4 they enlarge the rectangle by up to 60 px.
    pub rectangle_threshold: f64,
    /// Recursive binary operations.
    pub clean: CleanOptions,
    /// Optional slowly varying background. Its foreground is added to the change mask, so people who stop are
    /// still detected. It needs some frames without people.
    pub background: Option<BackgroundOptions>,
    /// Optional velocity field of the changed pixels, for w_V; about 10 ms per frame.
    pub flow: Option<FlowOptions>,
    /// Grouping of regions into candidates.
    pub group: GroupOptions,
    /// Edge-point detection.
    pub edge: EdgeOptions,
    /// Fit of straight edges.
    pub line: LineOptions,
}

impl Default for EvidenceOptions {
    fn default() -> Self {
        Self {
            change: ChangeOptions::default(),
            rectangle_threshold: 10.0,
            clean: CleanOptions::default(),
            background: None,
            flow: None,
            group: GroupOptions::default(),
            edge: EdgeOptions::default(),
            line: LineOptions::default(),
        }
    }
}

impl EvidenceOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        self.change.check()?;
        OptionError::unless_at_least_0("rectangle_threshold", self.rectangle_threshold)?;
        self.clean.check()?;
        self.background.map_or(Ok(()), |background| background.check())?;
        self.flow.map_or(Ok(()), |flow| flow.check())?;
        self.group.check()?;
        self.edge.check()?;
        self.line.check()
    }
}

/// Edges are taken up to this far outside the moving region, pixels. The change mask covers the outline; this
/// margin covers parts of a limb that did not move between two frames.
const EDGE_MARGIN_PX: f64 = 5.0;

/// The edges found in a window of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowEdges {
    /// Edge points, in image pixels.
    pub chains: EdgeChains,
    /// Straight edges, in image pixels.
    pub segments: Vec<EdgeSegment>,
    /// The same straight edges in ideal pixels of the camera, in which they are compared with the model.
    pub lines: Vec<EdgeLine>,
}

/// One frame with its change masks.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// The grey image.
    pub grey: Image<u8>,
    /// Changed pixels after the binary operations.
    pub mask: Mask,
    /// The same with the higher threshold for the rectangle.
    pub firm_mask: Mask,
    /// Velocities of the changed pixels towards the later frame with which this one is compared; `None` if not requested or not
    /// determined.
    pub velocity: Option<FlowField>,
    /// Of a steadied frame, the pixels that it or its neighbours do not show, with those near them.
    pub unseen: Option<Mask>,
}

/// Pixels this near to those not shown are not used: the windows of change and edge detection reach 2 px.
const UNSEEN_MARGIN_PX: f64 = 4.0;

impl Evidence {
    /// True if a rectangle touches what the frame does not show, at its top or a side.
    pub fn is_cut_off(&self, r: &Rectangle) -> bool {
        let Some(unseen) = &self.unseen else { return false };
        let (right, top) = ((r.right + 1).min(unseen.width() - 1), r.top.saturating_sub(1));
        let at_side = |y: usize| unseen.at(r.left.saturating_sub(1), y) || unseen.at(right, y);
        (r.top..=r.bottom).any(at_side) || unseen.row(top)[r.left..=r.right].contains(&true)
    }

    /// Candidate regions, largest first.
    pub fn candidates(&self, options: &EvidenceOptions) -> Vec<Region> {
        self.candidates_of(options, |_| true)
    }

    /// The same; no areas are joined whose rectangle cannot be that of one person.
    pub(crate) fn candidates_of(
        &self,
        options: &EvidenceOptions,
        can_be_one: impl Fn(&Rectangle) -> bool,
    ) -> Vec<Region> {
        let parts = regions(&self.firm_mask, options.group.min_part_area);
        group_regions_of(&parts, &options.group, can_be_one)
    }

    /// The rectangle of all changes at one of the firm ones. It reaches down to feet that hardly move.
    pub(crate) fn all_changes(&self, firm: &Rectangle, options: &EvidenceOptions) -> Option<Rectangle> {
        let parts = regions(&self.mask, options.group.min_part_area);
        let found = group_regions_of(&parts, &options.group, |_| true);
        found.into_iter().map(|region| region.rectangle).find(|all| all.gap(firm) == [0, 0])
    }

    /// Straight edges in and near the changed pixels of a rectangle, with their edge points. If nothing changed
    /// in the rectangle, those of the whole rectangle.
    pub fn edges(
        &self,
        window: &Rectangle,
        camera: Option<&Camera>,
        options: &EvidenceOptions,
    ) -> Result<WindowEdges, EvidenceError> {
        let window = Window { x: window.left, y: window.top, width: window.width(), height: window.height() };
        let moving = self.mask_near(&window);
        let domain = EdgeDomain { mask: moving.as_ref(), window: Some(window) };
        let chains = edge_chains(&self.grey.as_frame(), &domain, &options.edge).map_err(LineError::from)?;
        let segments = segments_from_chains(&chains, &options.line)?;
        let ideal = |p: DVec2| camera.and_then(|c| c.undistort(p).ok()).unwrap_or(p).as_vec2().to_array();
        let line = |s: &EdgeSegment| EdgeLine {
            start: ideal(s.start_px),
            end: ideal(s.end_px),
            gradient: s.mean_gradient as f32,
            velocity: self.speed_px(s.midpoint_px()),
        };
        let lines = segments.iter().map(line).collect();
        Ok(WindowEdges { chains, segments, lines })
    }

    /// How a camera with this horizontal field of view, radians, is tilted: by the upright lines of what does not move.
    pub fn tilt(&self, field_of_view_rad: Option<f64>) -> Result<TiltEstimate, TiltError> {
        let mut still = Image::filled(self.grey.width(), self.grey.height(), true);
        clear(&mut still, &dilate(&self.mask, EDGE_MARGIN_PX));
        self.unseen.iter().for_each(|unseen| clear(&mut still, unseen));
        camera_tilt(&self.grey.as_frame(), Some(&still), field_of_view_rad)
    }

    /// Image speed at a point, pixels per frame; 0 if it is not known.
    fn speed_px(&self, point: DVec2) -> f32 {
        let at = |field: &FlowField| {
            field.at(point.x.round().max(0.0) as usize, point.y.round().max(0.0) as usize)
        };
        self.velocity.as_ref().and_then(at).map_or(0.0, |velocity| velocity.length() as f32)
    }

    /// The dilated change mask without unseen pixels; if nothing changed in the window, all seen pixels, or `None`.
    fn mask_near(&self, window: &Window) -> Option<Mask> {
        let rows = window.y..window.y + window.height;
        let moved = rows.clone().any(|y| self.mask.row(y)[window.x..window.x + window.width].contains(&true));
        let near = moved.then(|| dilate(&self.mask, EDGE_MARGIN_PX));
        let Some(unseen) = &self.unseen else { return near };
        let mut near = near.unwrap_or_else(|| Image::filled(unseen.width(), unseen.height(), true));
        clear(&mut near, unseen);
        Some(near)
    }
}

/// Frames at least so long before and after a frame are compared with it, seconds: at up to 33 frames per second, its neighbours.
const COMPARED_S: f64 = 0.03;
/// So many frames wait at most, whatever their rate.
pub(super) const MOST_WAITING: usize = 16;

/// Evidence of a stream of frames, one frame late, or a thirtieth of a second.
#[derive(Debug)]
pub struct EvidenceStream {
    options: EvidenceOptions,
    /// The frames whose later neighbour has not come, in order.
    waiting: VecDeque<Waiting>,
    /// Time of the last frame, seconds.
    last_s: Option<f64>,
    background: Option<Background>,
    frames: usize,
    steadier: Option<Steadier>,
    light: SteadyLight,
}

/// A frame that waits for its later neighbour.
#[derive(Debug)]
struct Waiting {
    frame: usize,
    time_s: f64,
    grey: Image<u8>,
    /// The changes since its earlier neighbour, with the low threshold and with the rectangle's; `None` without one.
    since: Option<[Mask; 2]>,
    /// What the frame does not show, and what its earlier neighbour does not show.
    unseen: [Option<Mask>; 2],
}

impl EvidenceStream {
    /// A stream without frames, of a camera at rest.
    pub fn new(options: EvidenceOptions) -> Self {
        Self {
            options,
            waiting: VecDeque::new(),
            last_s: None,
            background: None,
            frames: 0,
            steadier: None,
            light: SteadyLight::default(),
        }
    }

    /// The same stream, of a camera that may move.
    #[must_use]
    pub fn steadied_by(self, steadier: Option<Steadier>) -> Self {
        Self { steadier, ..self }
    }

    /// What was found of the light.
    pub fn light(&self) -> LightReport {
        self.light.report()
    }

    /// Number of frames so far.
    pub(crate) fn frame_count(&self) -> usize {
        self.frames
    }

    /// The camera in the latest frames; none without a steadier.
    pub fn camera_motions(&self) -> impl Iterator<Item = &CameraMotion> {
        self.steadier.iter().flat_map(|steadier| steadier.motions())
    }

    /// Where a rectangle of a frame is in its steadied picture, whose size is given.
    pub(crate) fn in_steadied(&self, frame: usize, r: &Rectangle, size: [usize; 2]) -> Rectangle {
        let Some(steadier) = &self.steadier else { return *r };
        moved(r, size, |pixel| steadier.in_steadied(frame, pixel))
    }

    /// Where a rectangle of a steadied picture is in its frame, whose size is given.
    pub(crate) fn in_frame(&self, frame: usize, r: &Rectangle, size: [usize; 2]) -> Rectangle {
        let Some(steadier) = &self.steadier else { return *r };
        moved(r, size, |pixel| steadier.in_frame(frame, pixel))
    }

    /// How far the steadied pictures of a camera that pans should go on beyond the frames; `None` if they do.
    pub fn wider(&self) -> Option<Reach> {
        self.steadier.as_ref().and_then(Steadier::wider)
    }

    /// The views that have ended.
    pub fn losses(&self) -> &[Loss] {
        self.steadier.as_ref().map_or(&[], |steadier| steadier.losses())
    }

    /// The end of a view, once; there is no evidence of frames before and after it together.
    pub fn take_loss(&mut self) -> Option<Loss> {
        self.steadier.as_mut()?.take_loss()
    }

    /// Adds a frame and returns the evidence of the frames of which it is the later neighbour: none for the first frames of a
    /// view, then one, or several after a pause of a stream with a high frame rate.
    pub fn push(&mut self, frame: &Frame<'_>, time_s: f64) -> Result<Vec<Evidence>, EvidenceError> {
        if !time_s.is_finite() {
            return Err(EvidenceError::Time { time_s });
        }
        if let Some(previous_s) = self.last_s.filter(|last_s| time_s <= *last_s) {
            return Err(EvidenceError::TimeOrder { previous_s, time_s });
        }
        let evidence = self.push_next(frame, time_s)?;
        self.frames += 1;
        self.last_s = Some(time_s);
        Ok(evidence)
    }

    fn push_next(&mut self, frame: &Frame<'_>, time_s: f64) -> Result<Vec<Evidence>, EvidenceError> {
        let lit = self.light.push(frame, self.options.change.min_threshold)?;
        let lit = lit.as_ref().map(|lit| lit.as_frame());
        let frame = lit.as_ref().unwrap_or(frame);
        let Some(steadier) = &mut self.steadier else {
            return self.push_steady(frame, time_s, None);
        };
        let steadied = steadier.push(frame)?;
        if steadier.has_news() {
            self.begin_view();
        }
        match steadied {
            Steadied::AsGiven => self.push_steady(frame, time_s, None),
            Steadied::Moved { picture, unseen } => {
                self.push_steady(&picture.as_frame(), time_s, Some(unseen))
            }
            Steadied::Lost => Ok(Vec::new()),
        }
    }

    /// Forgets the frames of a view that has ended.
    fn begin_view(&mut self) {
        self.light.begin_view();
        self.waiting.clear();
        self.background = None;
    }

    fn push_steady(
        &mut self,
        frame: &Frame<'_>,
        time_s: f64,
        unseen: Option<Mask>,
    ) -> Result<Vec<Evidence>, EvidenceError> {
        if let Some(waiting) = self.waiting.front() {
            waiting.grey.as_frame().check_same_size(frame)?;
        }
        // 1. The frames of which this is the later neighbour. If too many wait, the first of them too.
        let compared_s = time_s - COMPARED_S;
        let is_compared = |waiting: &Waiting| waiting.time_s <= compared_s;
        let count = self.waiting.partition_point(is_compared);
        let count = count.max((self.waiting.len() + 1).saturating_sub(MOST_WAITING));
        // 2. Their changes since their earlier neighbours and up to this one.
        let changes = |waiting: &Waiting| -> Result<[Mask; 2], ChangeError> {
            let [low, firm] = change_options(&self.options);
            let grey = waiting.grey.as_frame();
            Ok([pair_changes(&grey, frame, &low)?, pair_changes(&grey, frame, &firm)?])
        };
        let until: Vec<[Mask; 2]> = self.waiting.iter().take(count).map(changes).collect::<Result<_, _>>()?;
        let (mut since, mut unseen_before) = (None, None);
        let mut found = Vec::with_capacity(count);
        for until in until {
            let Some(waiting) = self.waiting.pop_front() else { break };
            (since, unseen_before) = (Some(until.clone()), waiting.unseen[0].clone());
            found.push(self.evidence(waiting, Some((until, frame, &unseen)))?);
        }
        // 3. This one waits.
        let (number, grey) = (self.frames, frame.to_image());
        self.waiting.push_back(Waiting {
            frame: number,
            time_s,
            grey,
            since,
            unseen: [unseen, unseen_before],
        });
        Ok(found)
    }

    /// The evidence of the last frames, from their earlier neighbours.
    pub fn finish(&mut self) -> Result<Vec<Evidence>, EvidenceError> {
        let last: Vec<Waiting> = self.waiting.drain(..).filter(|waiting| waiting.since.is_some()).collect();
        last.into_iter().map(|waiting| self.evidence(waiting, None)).collect()
    }

    /// The evidence of a frame, with its changes up to its later neighbour, that neighbour, and what it does not show.
    fn evidence(
        &mut self,
        waiting: Waiting,
        later: Option<([Mask; 2], &Frame<'_>, &Option<Mask>)>,
    ) -> Result<Evidence, EvidenceError> {
        let Waiting { frame, time_s, grey, since, unseen } = waiting;
        let (until, next, unseen_later) = match later {
            Some((until, next, unseen)) => (Some(until), Some(next), unseen.as_ref()),
            None => (None, None, None),
        };
        let blank = || [0; 2].map(|_| Image::filled(grey.width(), grey.height(), false));
        let [mut low, mut firm] = match (since, until) {
            (Some(mut since), Some(until)) => {
                since.iter_mut().zip(&until).for_each(|(mask, other)| unite(mask, other));
                since
            }
            (since, until) => since.or(until).unwrap_or_else(blank),
        };
        // What the frame or a neighbour does not show, with a margin.
        let not_shown = unseen.iter().flatten().chain(unseen_later).cloned().reduce(|mut all, other| {
            unite(&mut all, &other);
            all
        });
        let unseen = not_shown.map(|all| dilate(&all, UNSEEN_MARGIN_PX));
        if let Some(unseen) = &unseen {
            clear(&mut low, unseen);
            clear(&mut firm, unseen);
        }
        self.add_foreground(&grey, &mut low, &mut firm)?;
        let tidy = |mask: &Mask| Ok::<Mask, OptionError>(fill_holes(&clean(mask, &self.options.clean)?));
        let (mask, firm_mask) = (tidy(&low)?, tidy(&firm)?);
        let velocity = match (&self.options.flow, next) {
            (Some(options), Some(next)) => velocity_field(&grey.as_frame(), next, &mask, options).ok(),
            _ => None,
        };
        Ok(Evidence { frame, time_s, grey, mask, firm_mask, velocity, unseen })
    }

    /// Adds pixels that differ from the background to the change masks, then updates the background where the low
    /// mask is empty.
    fn add_foreground(
        &mut self,
        grey: &Image<u8>,
        low: &mut Mask,
        firm: &mut Mask,
    ) -> Result<(), EvidenceError> {
        let Some(options) = self.options.background else { return Ok(()) };
        let background = match &mut self.background {
            Some(background) => background,
            none => none.insert(Background::new(&grey.as_frame(), options)?),
        };
        let foreground = background.foreground(&grey.as_frame())?;
        for mask in [&mut *low, firm] {
            mask.pixels_mut().iter_mut().zip(foreground.pixels()).for_each(|(pixel, new)| *pixel |= new);
        }
        Ok(background.update(&grey.as_frame(), Some(low))?)
    }
}

/// Clears the pixels of a mask that are not seen.
fn clear(mask: &mut Mask, unseen: &Mask) {
    mask.pixels_mut().iter_mut().zip(unseen.pixels()).for_each(|(pixel, unseen)| *pixel &= !unseen);
}

/// Change detection with the low threshold and with the rectangle's.
fn change_options(options: &EvidenceOptions) -> [ChangeOptions; 2] {
    let min_threshold = options.rectangle_threshold.max(options.change.min_threshold);
    [options.change, ChangeOptions { min_threshold, ..options.change }]
}

/// The rectangle of the places of the corners of another one, in an image of this size.
fn moved(r: &Rectangle, size: [usize; 2], place: impl Fn(DVec2) -> DVec2) -> Rectangle {
    let corners = [[r.left, r.top], [r.right, r.top], [r.left, r.bottom], [r.right, r.bottom]];
    let places = corners.map(|[x, y]| place(DVec2::new(x as f64, y as f64)));
    let last = DVec2::new(size[0] as f64, size[1] as f64) - 1.0;
    let low = places.into_iter().fold(DVec2::INFINITY, DVec2::min).round().clamp(DVec2::ZERO, last);
    let high = places.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max).round().clamp(DVec2::ZERO, last);
    Rectangle { left: low.x as usize, top: low.y as usize, right: high.x as usize, bottom: high.y as usize }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Distortion;

    const SIZE: [usize; 2] = [120, 90];

    fn blank() -> Image<u8> {
        Image::filled(SIZE[0], SIZE[1], 100)
    }

    /// A grey box of columns x and rows y.
    fn fill(image: &mut Image<u8>, x: std::ops::Range<usize>, y: std::ops::Range<usize>, grey: u8) {
        y.for_each(|y| image.row_mut(y)[x.clone()].fill(grey));
    }

    fn boxed(x: usize, grey: u8) -> Image<u8> {
        let mut image = blank();
        fill(&mut image, x..x + 14, 30..65, grey);
        image
    }

    /// All evidence of frames 0.04 s apart.
    fn evidence_of(options: EvidenceOptions, frames: &[Image<u8>]) -> Vec<Evidence> {
        let mut stream = EvidenceStream::new(options);
        let push = |(k, frame): (usize, &Image<u8>)| stream.push(&frame.as_frame(), 0.04 * k as f64).unwrap();
        let mut all: Vec<Evidence> = frames.iter().enumerate().flat_map(push).collect();
        all.extend(stream.finish().unwrap());
        all
    }

    /// Two boxes, the left one marked as moving, the other one not.
    fn two_boxes() -> Evidence {
        let mut grey = boxed(20, 180);
        fill(&mut grey, 80..100, 30..65, 180);
        let mut mask = Image::filled(SIZE[0], SIZE[1], false);
        (28..67).for_each(|y| mask.row_mut(y)[18..36].fill(true));
        Evidence { frame: 3, time_s: 0.12, grey, firm_mask: mask.clone(), mask, velocity: None, unseen: None }
    }

    const WHOLE: Rectangle = Rectangle { left: 0, top: 0, right: 119, bottom: 89 };

    fn lines_of(evidence: &Evidence, window: &Rectangle) -> Vec<EdgeLine> {
        evidence.edges(window, None, &EvidenceOptions::default()).unwrap().lines
    }

    #[test]
    fn evidence_of_a_frame_comes_with_the_next_and_of_the_last_one_at_the_end() {
        let frames = [10, 20, 30, 40].map(|x| boxed(x, 180));
        let mut stream = EvidenceStream::new(EvidenceOptions::default());
        for (k, frame) in frames.iter().enumerate() {
            let found = stream.push(&frame.as_frame(), 1.0 + 0.5 * k as f64).unwrap();
            assert_eq!(found.len(), usize::from(k > 0));
            let Some(found) = found.first() else { continue };
            assert_eq!((found.frame, found.time_s), (k - 1, 0.5 + 0.5 * k as f64));
            assert!(found.grey == frames[k - 1], "its own picture");
            // The mask covers the box, where it goes and, after the first frame, where it was before.
            let marked = |x: usize| found.mask.at(x + 7, 47);
            assert!(marked(10 * k) && marked(10 * (k + 1)) && (k == 1 || marked(10 * (k - 1))));
        }
        let last = stream.finish().unwrap().pop().expect("the last frame has one neighbour");
        assert_eq!((last.frame, last.time_s), (3, 2.5));
        assert!(last.mask.at(47, 47) && last.mask.at(37, 47) && !last.mask.at(18, 47));
        let one = evidence_of(EvidenceOptions::default(), &frames[..1]);
        assert!(one.is_empty() && evidence_of(EvidenceOptions::default(), &[]).is_empty());
    }

    /// At 100 frames per second a box that moves by a pixel is seen to move by three, and every frame has its evidence.
    #[test]
    fn at_a_high_rate_frames_are_compared_that_are_a_thirtieth_of_a_second_apart() {
        let frames: Vec<Image<u8>> = (0..12).map(|k| boxed(40 + k, 180)).collect();
        let mut stream = EvidenceStream::new(EvidenceOptions::default());
        let mut all = Vec::new();
        for (k, frame) in frames.iter().enumerate() {
            let found = stream.push(&frame.as_frame(), 0.01 * k as f64).unwrap();
            assert!(found.iter().map(|found| found.frame).eq((k >= 3).then(|| k - 3)), "{k}");
            all.extend(found);
        }
        all.extend(stream.finish().unwrap());
        assert!(all.iter().map(|found| found.frame).eq(0..12));
        let slow: Vec<Image<u8>> = frames.iter().step_by(3).cloned().collect();
        let slow = evidence_of(EvidenceOptions::default(), &slow);
        assert_eq!((&all[3].mask, &all[6].mask), (&slow[1].mask, &slow[2].mask));
        // After a pause, the frames before it have their later neighbour at once.
        let mut stream = EvidenceStream::new(EvidenceOptions::default());
        let found =
            [0.0, 0.01, 0.02, 0.5].map(|time_s| stream.push(&frames[0].as_frame(), time_s).unwrap().len());
        assert_eq!(found, [0, 0, 0, 3]);
        // However high the rate is, few frames wait.
        let push = |k: usize| stream.push(&frames[0].as_frame(), 1.0 + 1e-4 * k as f64).unwrap().len();
        assert_eq!((0..100).map(push).sum::<usize>(), 1 + 100 - MOST_WAITING);
    }

    #[test]
    fn frames_out_of_order_are_refused_and_not_counted() {
        let mut stream = EvidenceStream::new(EvidenceOptions::default());
        let (first, second) = (boxed(10, 180), boxed(20, 180));
        stream.push(&first.as_frame(), 0.5).unwrap();
        for time_s in [0.5, 0.4] {
            let refused = stream.push(&second.as_frame(), time_s);
            assert_eq!(refused, Err(EvidenceError::TimeOrder { previous_s: 0.5, time_s }));
        }
        for time_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let refused = stream.push(&second.as_frame(), time_s);
            assert!(matches!(refused, Err(EvidenceError::Time { .. })), "{time_s}");
        }
        let small = Image::filled(32, 32, 100u8);
        assert!(matches!(stream.push(&small.as_frame(), 0.6), Err(EvidenceError::Frame(_))));
        assert_eq!(stream.push(&second.as_frame(), 0.7).unwrap()[0].frame, 0);
        let last = stream.finish().unwrap().pop().unwrap();
        assert_eq!((last.frame, last.time_s), (1, 0.7));
    }

    #[test]
    fn faint_changes_are_in_the_mask_and_strong_ones_in_the_rectangle_as_well() {
        let mut changed = blank();
        // 2, 7 and 60 grey levels: below, between and above the thresholds 4 and 10.
        for (x, grey) in [(10, 102), (45, 107), (80, 160)] {
            fill(&mut changed, x..x + 14, 30..65, grey);
        }
        let found = |rectangle_threshold: f64| {
            let options = EvidenceOptions { rectangle_threshold, ..EvidenceOptions::default() };
            let all = evidence_of(options, &[blank(), changed.clone()]);
            let columns = [17, 52, 87];
            let candidates: Vec<usize> =
                all[0].candidates(&options).iter().map(|r| r.rectangle.left).collect();
            (columns.map(|x| all[0].mask.at(x, 47)), columns.map(|x| all[0].firm_mask.at(x, 47)), candidates)
        };
        let (mask, firm, candidates) = found(EvidenceOptions::default().rectangle_threshold);
        assert_eq!((mask, firm), ([false, true, true], [false, false, true]));
        assert!(candidates.len() == 1 && (76..=80).contains(&candidates[0]), "{candidates:?}");
        // The rectangle's threshold is at least that of the change detection.
        let (mask, firm, candidates) = found(0.0);
        assert_eq!((mask, firm, candidates.len()), ([false, true, true], [false, true, true], 2));
    }

    #[test]
    fn a_ring_that_appears_is_filled() {
        let mut ring = blank();
        fill(&mut ring, 40..80, 20..70, 170);
        fill(&mut ring, 50..70, 30..60, 100);
        let found = &evidence_of(EvidenceOptions::default(), &[blank(), ring])[0];
        assert!(found.mask.at(60, 45) && found.firm_mask.at(60, 45) && !found.mask.at(20, 45));
    }

    #[test]
    fn before_a_background_somebody_who_stands_still_is_seen_on() {
        let mut frames = vec![blank(); 6];
        frames.extend(vec![boxed(50, 180); 30]);
        // The rate is high enough to absorb the box within ten frames if it were not masked.
        let background = BackgroundOptions { rate: 8.0, ..BackgroundOptions::default() };
        let with = EvidenceOptions { background: Some(background), ..EvidenceOptions::default() };
        let (seen, unseen) = (evidence_of(with, &frames), evidence_of(EvidenceOptions::default(), &frames));
        for (k, (seen, unseen)) in seen.iter().zip(&unseen).enumerate() {
            let at = |mask: &Mask| mask.at(57, 47);
            let (is_there, appears) = (k >= 6, k == 5 || k == 6);
            assert_eq!(
                (at(&seen.mask), at(&seen.firm_mask)),
                (is_there || appears, is_there || appears),
                "{k}"
            );
            assert_eq!((at(&unseen.mask), at(&unseen.firm_mask)), (appears, appears), "{k}");
            assert!(!seen.mask.at(10, 10));
        }
        assert!(seen[35].candidates(&with).len() == 1 && unseen[35].candidates(&with).is_empty());
    }

    #[test]
    fn edges_are_those_near_the_moving_pixels_of_the_window() {
        let evidence = two_boxes();
        let ends =
            |lines: &[EdgeLine]| -> Vec<[f32; 2]> { lines.iter().flat_map(|l| [l.start, l.end]).collect() };
        let moving = ends(&lines_of(&evidence, &WHOLE));
        assert!(moving.len() >= 8 && moving.iter().all(|p| p[0] < 41.0), "{moving:?}");
        let narrow = Rectangle { left: 10, top: 20, right: 27, bottom: 50 };
        let cut = ends(&lines_of(&evidence, &narrow));
        assert!(!cut.is_empty() && cut.iter().all(|p| p[0] <= 28.0 && p[1] <= 51.0), "{cut:?}");
        // Nothing moves near the right box, so edges of the whole rectangle count.
        let still = Rectangle { left: 60, ..WHOLE };
        let lines = ends(&lines_of(&evidence, &still));
        assert!(lines.len() >= 8 && lines.iter().all(|p| p[0] > 75.0), "{lines:?}");
    }

    #[test]
    fn edges_a_few_pixels_outside_the_moving_ones_are_taken_too() {
        let mut evidence = two_boxes();
        // The box's left side is between the columns 19 and 20.
        for (first, found) in [(18, true), (23, true), (27, false)] {
            evidence.mask = Image::filled(SIZE[0], SIZE[1], false);
            (28..67).for_each(|y| evidence.mask.row_mut(y)[first..31].fill(true));
            let lines = lines_of(&evidence, &WHOLE);
            let is_left = |l: &EdgeLine| (l.start[0] - 19.5).abs() < 1.0 && (l.end[0] - 19.5).abs() < 1.0;
            assert_eq!(lines.iter().any(is_left), found, "marked from {first}: {lines:?}");
        }
    }

    #[test]
    fn an_edge_has_the_speed_of_the_image_at_its_middle() {
        let mut evidence = two_boxes();
        assert!(lines_of(&evidence, &WHOLE).iter().all(|l| l.velocity == 0.0), "no field");
        let window = Window { x: 10, y: 20, width: 50, height: 60 };
        let mut field = FlowField {
            window,
            u_px: Image::filled(50, 60, 3.0),
            v_px: Image::filled(50, 60, 4.0),
            components: Vec::new(),
            iterations: 0,
            relative_residual: 0.0,
        };
        evidence.velocity = Some(field.clone());
        assert!(lines_of(&evidence, &WHOLE).iter().all(|l| (l.velocity - 5.0).abs() < 1e-6));
        // Speed grows downwards: at the ends of the upright sides it differs from that in their middles.
        (0..60).for_each(|y| field.v_px.row_mut(y).fill(0.1 * y as f32));
        field.u_px = Image::filled(50, 60, 0.0);
        evidence.velocity = Some(field.clone());
        let upright = |l: &&EdgeLine| (l.start[0] - l.end[0]).abs() < 1.0;
        let lines = lines_of(&evidence, &WHOLE);
        assert!(lines.iter().filter(upright).count() >= 2);
        for line in lines.iter().filter(upright) {
            let middle = 0.5 * (line.start[1] + line.end[1]);
            assert!((line.velocity - 0.1 * (middle - 20.0)).abs() < 0.06, "{line:?}");
        }
        field.v_px = Image::filled(50, 60, f32::NAN);
        evidence.velocity = Some(field);
        assert!(lines_of(&evidence, &WHOLE).iter().all(|l| l.velocity == 0.0), "not determined");
    }

    #[test]
    fn velocities_lead_to_the_next_frame() {
        // A textured plate that moves 2 pixels to the right and 1 down.
        let plate = |k: usize| {
            let mut image = blank();
            let (left, top) = (30 + 2 * k, 15 + k);
            for (x, y) in (0..44).flat_map(|x| (0..50).map(move |y| (x, y))) {
                let texture = (0.5 * x as f32).sin() * (0.4 * y as f32).cos();
                image.set(left + x, top + y, (150.0 + 40.0 * texture) as u8);
            }
            image
        };
        let frames = [plate(0), plate(1), plate(2)];
        let options = EvidenceOptions { flow: Some(FlowOptions::default()), ..EvidenceOptions::default() };
        let all = evidence_of(options, &frames);
        for evidence in &all[..2] {
            let velocity = evidence.velocity.as_ref().unwrap().at(54, 40).unwrap();
            assert!(velocity.distance(DVec2::new(2.0, 1.0)) < 0.3, "{velocity}");
        }
        assert!(all[2].velocity.is_none(), "nothing follows the last frame");
        assert!(evidence_of(EvidenceOptions::default(), &frames).iter().all(|e| e.velocity.is_none()));
    }

    #[test]
    fn edges_are_compared_in_ideal_pixels_with_their_gradients() {
        let mut camera = Camera::level([120, 90], 0.9, 1.1, 6.0).unwrap();
        camera.distortion = Distortion::Brown { k1: -0.3, k2: 0.1, p1: 0.0, p2: 0.0, k3: 0.0 };
        let evidence = two_boxes();
        let found = evidence.edges(&WHOLE, Some(&camera), &EvidenceOptions::default()).unwrap();
        assert!(found.segments.len() == found.lines.len() && found.chains.iter().len() > 0);
        for (segment, line) in found.segments.iter().zip(&found.lines) {
            for (seen, ideal) in [(segment.start_px, line.start), (segment.end_px, line.end)] {
                let ideal = DVec2::new(f64::from(ideal[0]), f64::from(ideal[1]));
                assert!(camera.distort(ideal).unwrap().distance(seen) < 1e-3);
                assert!(ideal.distance(seen) > 0.05, "the lens bends");
            }
            assert!((f64::from(line.gradient) - segment.mean_gradient).abs() < 1e-4 && line.gradient > 5.0);
        }
        let plain = evidence.edges(&WHOLE, None, &EvidenceOptions::default()).unwrap();
        assert!(
            plain.segments.iter().zip(&plain.lines).all(|(s, l)| s.start_px.as_vec2().to_array() == l.start)
        );
    }
}
