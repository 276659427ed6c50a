//! The field of view of a camera that is not calibrated, from the picture while it pans.
//!
//! A camera that turns by R in its place takes the ray of pixel x to the pixel of `R K^-1 x`, K of its focal length (Hartley 1997,
//! *Self-calibration of stationary cameras*; here for square pixels, a centre in the middle and no lens). A turn moves the borders of
//! the picture farther than its middle, and the shorter the focal length, the more.
//!
//! 1. The frames are steadied with several focal lengths; the one that explains most of all frames leads.
//! 2. Some frames in which the picture has moved more and more are kept.
//! 3. Between the neighbours of the leading one, the focal length is that with which rotations explain most of these frames.
//! 4. The standard deviation is that with which the borders of the picture would be seen to be displaced.
//!
//! Limits: somebody who fills the picture, a camera that is carried along and a lens that bends straight lines look like another
//! focal length.

use super::estimate::Comparison;
use super::pyramid::Pyramid;
use super::template::Template;
use super::{CameraState, Steadier, SteadyOptions, Turned, levels, matrix};
use crate::image::{Frame, FrameError, Image};
use crate::model::Camera;
use glam::DVec3;
use rayon::prelude::*;

/// Candidates for the field of view across the longer side, degrees: from a tele lens to a wide one. Neighbouring focal lengths are
/// apart by a factor of [`APART`]: with one that is off by a tenth, rotations explain little once the picture has moved by a
/// tenth of it.
const CANDIDATES_DEG: [f64; 2] = [25.0, 95.0];
const APART: f64 = 1.05;
/// A candidate that is behind the leading one by all points of so many frames is given up.
const BEHIND: f64 = 2.0;
/// Frames are kept when the middle of the picture has moved by these shares of its longer side; with fewer than [`LEAST_KEPT`] of
/// them, the camera did not pan.
const FIRST_SHARE: f64 = 0.06;
const SHARE_STEP: f64 = 0.03;
const MOST_SHARE: f64 = 0.42;
const LEAST_KEPT: usize = 4;
/// A camera that has not panned after so many frames is not waited for.
const MOST_FRAMES: usize = 500;
/// Focal lengths are compared up to this factor from the leading one, in as many steps at first and at last.
const WIDEST: f64 = 1.1;
const STEPS: usize = 9;
const MOST_ROWS: usize = 20;
/// The finest steps have this factor.
const FINEST: f64 = 1.004;
/// The standard deviation of the focal length is that of a displacement of the borders of so many pixels, and of a lens that is not
/// ideal this share. Of 37 drawn pans, the errors are up to 0.5 %, where 0.6 to 1.0 % are stated.
const SEEN_PX: f64 = 0.15;
const LEAST_SD: f64 = 0.005;

/// A measured field of view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldOfView {
    /// Across the width of the picture, radians.
    pub horizontal_rad: f64,
    /// Its standard deviation.
    pub sd_rad: f64,
}

/// Measures the field of view from a stream of frames that begins when the camera begins to turn.
#[derive(Debug, Default)]
pub struct FieldSeeker {
    size: Option<[u32; 2]>,
    candidates: Vec<Candidate>,
    first: Option<Image<u8>>,
    kept: Vec<Kept>,
    frames: usize,
}

#[derive(Debug)]
struct Candidate {
    focal_px: f64,
    steadier: Steadier,
    /// Sum of the shares that rotations explain.
    explained: f64,
}

/// A frame, and how the leading candidate was turned in it.
#[derive(Debug)]
struct Kept {
    image: Image<u8>,
    focal_px: f64,
    turn_rad: DVec3,
    /// How far the middle of the picture has moved, pixels.
    moved_px: f64,
}

impl FieldSeeker {
    /// Adds the next frame.
    ///
    /// # Errors
    ///
    /// The size of the frame differs from the frames before.
    pub fn push(&mut self, frame: &Frame<'_>) -> Result<(), FrameError> {
        if self.has_all() {
            return Ok(());
        }
        self.frames += 1;
        let [width, height] = [frame.width(), frame.height()];
        let size = *self.size.get_or_insert([width as u32, height as u32]);
        let [expected_width, expected_height] = size.map(|side| side as usize);
        if [width, height] != [expected_width, expected_height] {
            return Err(FrameError::SizeChanged { expected_width, expected_height, width, height });
        }
        if self.candidates.is_empty() {
            let [low_px, high_px] = focal_range_px(size);
            let count = ((high_px / low_px).ln() / APART.ln()).ceil() as i32;
            self.candidates = (0..=count).map(|k| Candidate::of(low_px * APART.powi(k), size)).collect();
        }
        // 1. All candidates, each by itself.
        self.candidates.par_iter_mut().try_for_each(|candidate| candidate.push(frame))?;
        let most = self.candidates.iter().map(|candidate| candidate.explained).fold(0.0, f64::max);
        self.candidates.retain(|candidate| candidate.explained >= most - BEHIND);
        // 2. The leading one says how far the picture has moved.
        let Some(leading) = self.leading() else { return Ok(()) };
        let focal_px = leading.focal_px;
        let Some(&motion) = leading.steadier.motions().back() else { return Ok(()) };
        if self.first.is_none() && motion.state == CameraState::Still {
            self.first = Some(frame.to_image());
        }
        let ahead = motion.turned() * DVec3::Z;
        let moved_px = focal_px * (ahead.truncate() / ahead.z).length();
        let share = moved_px / f64::from(size[0].max(size[1]));
        let next = FIRST_SHARE + SHARE_STEP * self.kept.len() as f64;
        if motion.state == CameraState::Turned && (next..MOST_SHARE).contains(&share) {
            self.kept.push(Kept { image: frame.to_image(), focal_px, turn_rad: motion.turn_rad, moved_px });
        }
        Ok(())
    }

    /// The candidate that explains most.
    fn leading(&self) -> Option<&Candidate> {
        self.candidates.iter().max_by(|a, b| a.explained.total_cmp(&b.explained))
    }

    /// True if further frames add nothing.
    pub fn has_all(&self) -> bool {
        self.frames >= MOST_FRAMES || FIRST_SHARE + SHARE_STEP * self.kept.len() as f64 >= MOST_SHARE
    }

    /// The field of view; `None` if the camera did not pan, or no focal length explains the frames better than others.
    pub fn found(&self) -> Option<FieldOfView> {
        let (size, first) = (self.size?, self.first.as_ref()?);
        if self.kept.len() < LEAST_KEPT {
            return None;
        }
        let first = first.as_frame();
        let first = Pyramid::new(first, levels(&first));
        let kept: Vec<(Pyramid<'_>, &Kept)> = self
            .kept
            .iter()
            .map(|kept| (Pyramid::new(kept.image.as_frame(), levels(&kept.image.as_frame())), kept))
            .collect();
        // How much rotations with a focal length explain of the kept frames.
        let explained = |focal_px: f64| -> Option<f64> {
            let camera = camera(focal_px, size)?;
            let template = Template::new(&first, &camera).ok()?;
            let share = |(pyramid, kept): &(Pyramid<'_>, &Kept)| {
                let comparison = Comparison { pyramid, camera: &camera };
                let found = comparison.near(&template, &kept.turned(focal_px), 1.0);
                found.map_or(0.0, |estimate| estimate.support)
            };
            Some(kept.par_iter().map(share).collect::<Vec<f64>>().into_iter().sum())
        };
        // 3. Finer and finer steps about the best.
        let mut best_px = self.leading()?.focal_px;
        let [low_px, high_px] = focal_range_px(size);
        let within = low_px / WIDEST..high_px * WIDEST;
        let mut factor = WIDEST.powf(2.0 / (STEPS - 1) as f64);
        for _ in 0..MOST_ROWS {
            let focal_px = |k: usize| best_px * factor.powf(k as f64 - (STEPS / 2) as f64);
            let of_steps: Vec<f64> = (0..STEPS).map(|k| explained(focal_px(k))).collect::<Option<_>>()?;
            let (at, _) = of_steps.iter().enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
            best_px = focal_px(at);
            if !within.contains(&best_px) {
                return None;
            }
            // From the end of a row, the best one may be farther.
            let is_inside = at > 0 && at + 1 < STEPS;
            if is_inside && factor <= FINEST {
                return Some(self.field(best_px, size));
            }
            factor = if is_inside { factor.sqrt().max(FINEST) } else { factor };
        }
        None
    }

    /// The field of view of a focal length. A share e more of it moves the borders, at the tangent t from the axis, by e t^2 times
    /// as far as the middle has moved.
    fn field(&self, focal_px: f64, size: [u32; 2]) -> FieldOfView {
        let moved_px = self.kept.iter().map(|kept| kept.moved_px).fold(0.0, f64::max);
        let tangent = f64::from(size[0].max(size[1])) / (2.0 * focal_px);
        let sd = LEAST_SD.hypot(SEEN_PX / (moved_px * tangent * tangent));
        let half = f64::from(size[0]) / (2.0 * focal_px);
        FieldOfView { horizontal_rad: 2.0 * half.atan(), sd_rad: 2.0 * half / (1.0 + half * half) * sd }
    }
}

impl Candidate {
    fn of(focal_px: f64, size: [u32; 2]) -> Self {
        let across_rad = 2.0 * (f64::from(size[0]) / (2.0 * focal_px)).atan();
        let steadier = Steadier::new(SteadyOptions::default(), None, Some(across_rad));
        Self { focal_px, steadier: steadier.by_keys_only(), explained: 0.0 }
    }

    fn push(&mut self, frame: &Frame<'_>) -> Result<(), FrameError> {
        self.steadier.look(frame)?;
        let support = self.steadier.motions().back().map_or(0.0, |motion| motion.support);
        self.explained += if support.is_finite() { support } else { 0.0 };
        Ok(())
    }
}

impl Kept {
    /// The rotation that moves the middle of the picture as far with another focal length.
    fn turned(&self, focal_px: f64) -> Turned {
        let angle = self.turn_rad.length();
        let other = (angle.tan() * self.focal_px / focal_px).atan();
        matrix(self.turn_rad * if angle > 0.0 { other / angle } else { 0.0 })
    }
}

/// The focal lengths of the candidates, the shortest and the longest.
fn focal_range_px(size: [u32; 2]) -> [f64; 2] {
    let half_px = f64::from(size[0].max(size[1])) / 2.0;
    let [narrow, wide] = CANDIDATES_DEG.map(|deg| half_px / (0.5 * deg.to_radians()).tan());
    [wide, narrow]
}

/// A level camera of this focal length.
fn camera(focal_px: f64, size: [u32; 2]) -> Option<Camera> {
    let across_rad = 2.0 * (f64::from(size[0]) / (2.0 * focal_px)).atan();
    Camera::level(size, across_rad, 1.0, 1.0).ok()
}
