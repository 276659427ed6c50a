//! What each frame contributes to tracking: moving regions and straight edges (Rohr 1994, sections 4.1 and
//! 4.3).
//!
//! Change detection compares a frame with the one before and the one after, so evidence comes one frame late.
//! Two frames are kept, however long the stream.

use super::score::EdgeLine;
use crate::image::edge::{EdgeChains, EdgeDomain, EdgeOptions, Window, edge_chains};
use crate::image::flow::{FlowField, FlowOptions, velocity_field};
use crate::image::line::{EdgeSegment, LineError, LineOptions, segments_from_chains};
use crate::image::{
    Background, BackgroundOptions, ChangeDetector, ChangeOptions, CleanError, CleanOptions, Frame,
    FrameError, GroupOptions, Image, Mask, Rectangle, Region, clean, dilate, fill_holes, group_regions,
    regions,
};
use crate::model::Camera;
use glam::DVec2;
use thiserror::Error;

/// Why a frame gave no evidence.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EvidenceError {
    /// The frame does not fit the ones before.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The options of the binary operations make no sense.
    #[error(transparent)]
    Clean(#[from] CleanError),
    /// The options of edge or line finding make no sense.
    #[error(transparent)]
    Line(#[from] LineError),
    /// A frame needs a time.
    #[error("the time of a frame must be a finite number of seconds, got {time_s}")]
    Time {
        /// Time given.
        time_s: f64,
    },
    /// Frames must come in order.
    #[error("frame times must increase: {time_s} s came after {previous_s} s")]
    TimeOrder {
        /// Time of the frame before.
        previous_s: f64,
        /// Time of this frame.
        time_s: f64,
    },
}

/// Options of the stages from pixels to regions and edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EvidenceOptions {
    /// Change detection, eq. (1), for where edges are looked for: the low threshold loses no limb.
    pub change: ChangeOptions,
    /// Least threshold of the change detection for the rectangle, grey levels. 10: floor reflections and
    /// shadows change by less; at 4 they stretch the rectangle by up to 60 px.
    pub rectangle_threshold: f64,
    /// Recursive binary operations.
    pub clean: CleanOptions,
    /// A slowly varying background whose foreground joins the changes, for people who stop; needs some frames
    /// without them.
    pub background: Option<BackgroundOptions>,
    /// Velocity field of the changed pixels, for w_V; costs some 10 ms a frame.
    pub flow: Option<FlowOptions>,
    /// Grouping of regions into candidates.
    pub group: GroupOptions,
    /// Edge points.
    pub edge: EdgeOptions,
    /// Straight edges.
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

/// Edges are taken this far outside the moving region, pixels: the change mask covers the outline, this
/// covers the parts of a limb that stood still between two frames.
const EDGE_MARGIN_PX: f64 = 5.0;

/// The edges found in a window of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowEdges {
    /// Edge points, in image pixels.
    pub chains: EdgeChains,
    /// Straight edges, in image pixels.
    pub segments: Vec<EdgeSegment>,
    /// The same straight edges in ideal pixels of the camera, as they are compared with the model.
    pub lines: Vec<EdgeLine>,
}

/// One frame with its change mask.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// The frame.
    pub grey: Image<u8>,
    /// Changed pixels after the binary operations.
    pub mask: Mask,
    /// The same with the higher threshold of the rectangle.
    pub firm_mask: Mask,
    /// Velocities of the changed pixels towards the next frame, where asked for and determined.
    pub velocity: Option<FlowField>,
}

impl Evidence {
    /// Candidate regions, largest first.
    pub fn candidates(&self, options: &EvidenceOptions) -> Vec<Region> {
        group_regions(&regions(&self.firm_mask, options.group.min_part_area), &options.group)
    }

    /// Straight edges in and near the changed pixels of a rectangle, with the edge points they were made of;
    /// in the whole rectangle where nothing changed in it.
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

    /// Speed of the image at a point, pixels per frame; 0 where it is not known.
    fn speed_px(&self, point: DVec2) -> f32 {
        let at = |field: &FlowField| {
            field.at(point.x.round().max(0.0) as usize, point.y.round().max(0.0) as usize)
        };
        self.velocity.as_ref().and_then(at).map_or(0.0, |velocity| velocity.length() as f32)
    }

    /// The dilated change mask, `None` where nothing changed in the window.
    fn mask_near(&self, window: &Window) -> Option<Mask> {
        let rows = window.y..window.y + window.height;
        let moved = rows.clone().any(|y| self.mask.row(y)[window.x..window.x + window.width].contains(&true));
        moved.then(|| dilate(&self.mask, EDGE_MARGIN_PX))
    }
}

/// Frames in, evidence out, one frame later.
#[derive(Debug)]
pub struct EvidenceStream {
    options: EvidenceOptions,
    detectors: [ChangeDetector; 2],
    waiting: Option<(usize, f64, Image<u8>)>,
    background: Option<Background>,
    frames: usize,
}

impl EvidenceStream {
    /// A stream that has seen no frame.
    pub fn new(options: EvidenceOptions) -> Self {
        Self { options, detectors: detectors(&options), waiting: None, background: None, frames: 0 }
    }

    /// Takes a frame and gives the evidence of the one before.
    pub fn push(&mut self, frame: &Frame<'_>, time_s: f64) -> Result<Option<Evidence>, EvidenceError> {
        if !time_s.is_finite() {
            return Err(EvidenceError::Time { time_s });
        }
        if let Some((_, previous_s, _)) = self.waiting
            && time_s <= previous_s
        {
            return Err(EvidenceError::TimeOrder { previous_s, time_s });
        }
        let [low, firm] = &mut self.detectors;
        let masks = low.push(frame)?.zip(firm.push(frame)?);
        let before = self.waiting.replace((self.frames, time_s, frame.to_image()));
        self.frames += 1;
        self.evidence(before, masks, Some(frame))
    }

    /// The evidence of the last frame.
    pub fn finish(mut self) -> Result<Option<Evidence>, EvidenceError> {
        let last = self.waiting.take();
        let [low, firm] = std::mem::replace(&mut self.detectors, detectors(&self.options));
        self.evidence(last, low.finish().zip(firm.finish()), None)
    }

    fn evidence(
        &mut self,
        frame: Option<(usize, f64, Image<u8>)>,
        masks: Option<(Mask, Mask)>,
        next: Option<&Frame<'_>>,
    ) -> Result<Option<Evidence>, EvidenceError> {
        let (Some((frame, time_s, grey)), Some((mut low, mut firm))) = (frame, masks) else {
            return Ok(None);
        };
        self.add_foreground(&grey, &mut low, &mut firm)?;
        let tidy = |mask: &Mask| Ok::<Mask, CleanError>(fill_holes(&clean(mask, &self.options.clean)?));
        let (mask, firm_mask) = (tidy(&low)?, tidy(&firm)?);
        let velocity = match (&self.options.flow, next) {
            (Some(options), Some(next)) => velocity_field(&grey.as_frame(), next, &mask, options).ok(),
            _ => None,
        };
        Ok(Some(Evidence { frame, time_s, grey, mask, firm_mask, velocity }))
    }

    /// Adds what differs from the background to the changes, then lets the background follow where nothing
    /// is.
    fn add_foreground(
        &mut self,
        grey: &Image<u8>,
        low: &mut Mask,
        firm: &mut Mask,
    ) -> Result<(), EvidenceError> {
        let Some(options) = self.options.background else { return Ok(()) };
        let background = self.background.get_or_insert_with(|| Background::new(&grey.as_frame(), options));
        let foreground = background.foreground(&grey.as_frame())?;
        for mask in [&mut *low, firm] {
            mask.pixels_mut().iter_mut().zip(foreground.pixels()).for_each(|(pixel, new)| *pixel |= new);
        }
        Ok(background.update(&grey.as_frame(), Some(low))?)
    }
}

/// Change detection with the low threshold and with the rectangle's.
fn detectors(options: &EvidenceOptions) -> [ChangeDetector; 2] {
    let min_threshold = options.rectangle_threshold.max(options.change.min_threshold);
    [options.change, ChangeOptions { min_threshold, ..options.change }].map(ChangeDetector::new)
}
