//! Steadying of a camera held in the hand: every frame is turned into the camera of the first one.
//!
//! 1. The rotation of the camera is estimated from the strongest gradients of a key frame, spread over the picture
//!    (`template`), from coarse to fine (`pyramid`), with weights that leave out people (`estimate`; Baker and Matthews
//!    2004, *Lucas-Kanade 20 Years On*, inverse compositional). It starts at the rotation of the frame before, and where a camera
//!    that moves would be if it went on as it did.
//! 2. If the picture has moved by [`SteadyOptions::still_px`] or more, it is interpolated in the camera of the first
//!    frame (`warp`). Otherwise it is left as it is, bit for bit: a tripod costs the estimate only. For a camera that pans, the
//!    steadied pictures may be larger than the frames (`canvas`).
//! 3. A frame that overlaps the key frame little, or agrees with it less and less, becomes the next key frame; its rotation
//!    is chained with that of the key frame before. So does the frame before one that no key frame explains.
//! 4. If a frame and those after it agree with each other but not with the key frames, the shot has changed. If the focal
//!    length changes, the picture is zoomed. Both end the view ([`Loss`]).
//! 5. A frame that no rotation explains, but whose parts look as in the first frame, only brighter or darker, is lit unevenly.
//! 6. A rotation stands only if the camera of the first frame, unmoved, does not explain more: before faint texture it would
//!    creep along with a person who has more of it.
//!
//! Limits: the camera only rotates. A camera that is carried along changes the perspective: near a wall it cannot be told
//! from a rotation, and forwards it looks like a zoom. Without a calibration the rotation is that of the assumed field of
//! view; a wrong one leaves part of a pan uncorrected towards the sides. A rolling shutter is not modelled.
//! A fast zoom may be reported as a cut; before fine texture, a slow one may pass unnoticed. Before a wall of faint texture
//! motions of several pixels per frame may be missed, because its coarse scales show nothing, and somebody who covers a third of the
//! picture may be taken for the wall.

mod canvas;
mod estimate;
mod field;
mod pyramid;
mod reach;
mod template;
mod warp;

use crate::OptionError;
use crate::image::{Frame, FrameError, Image, Mask};
use crate::model::{Camera, assumed_field_of_view_rad};
use crate::wording::counted;
pub(crate) use canvas::turned_back;
pub use field::{FieldOfView, FieldSeeker};
pub use reach::Reach;

use canvas::Canvas;
use estimate::{Comparison, Estimate};
use glam::{DMat3, DQuat, DVec2, DVec3};
use pyramid::Pyramid;
use reach::FARTHEST_TAN;
use std::collections::VecDeque;
use template::{Template, pixel_of, ray_of};
use thiserror::Error;

/// Rotation from the first view's camera to that of a frame.
pub type Turned = DMat3;

/// Why no rotation can be estimated from a picture.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SteadyError {
    /// The picture has too few gradients.
    #[error("a picture with {} of strong gradient at one scale: a rotation needs {needed}", counted(*points, "point"))]
    NoTexture {
        /// Points found on the scale with the fewest.
        points: usize,
        /// Points needed.
        needed: usize,
    },
    /// The gradients are in a small part of the picture.
    #[error("gradients are in {:.0} % of the picture only: a rotation needs {:.0} %", 100.0 * share, 100.0 * needed)]
    PlainPicture {
        /// Share of the cells of the picture with strong gradients.
        share: f64,
        /// Share needed.
        needed: f64,
    },
}

/// Options of the steadying.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteadyOptions {
    /// Frames in which every pixel is nearer than this to its place in the first frame are left as they are, pixels.
    /// Default 0.3: jitter up to 0.5 px does not disturb tracking, and on a tripod the estimate scatters by less.
    pub still_px: f64,
    /// Share of the key frame's points that a rotation must explain. Default 0.35: a person who covers a third of the
    /// picture leaves twice as much.
    pub least_support: f64,
    /// Relative change of the focal length, as displacement of the corners in pixels, from which the picture is taken for
    /// zoomed. Default 3.
    pub most_zoom_px: f64,
    /// The size of the steadied pictures. Default: that of a frame, so what a camera shows that has turned farther is cut off.
    pub reach: Reach,
}

impl Default for SteadyOptions {
    fn default() -> Self {
        Self { still_px: 0.3, least_support: 0.35, most_zoom_px: 3.0, reach: Reach::default() }
    }
}

impl SteadyOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        OptionError::unless_at_least_0("still_px", self.still_px)?;
        let is_share = self.least_support > 0.0 && self.least_support < 1.0;
        OptionError::unless(is_share, "least_support", "between 0 and 1", self.least_support)?;
        OptionError::unless_positive("most_zoom_px", self.most_zoom_px)?;
        self.reach.check()
    }
}

/// What was found of the camera in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum CameraState {
    /// Where it was in the first frame: the frame was left as it is.
    Still,
    /// Turned: the frame was steadied.
    Turned,
    /// Where it was in the first frame, but the light is another one from place to place: the frame was left as it is.
    UnevenLight,
    /// Too little in the picture shows a rotation: the frame got the rotation of the one before.
    Unknown,
    /// The view has ended (see [`Loss`]); the frame was not used.
    Lost,
}

impl CameraState {
    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Turned => "turned",
            Self::UnevenLight => "uneven_light",
            Self::Unknown => "unknown",
            Self::Lost => "lost",
        }
    }
}

/// The camera in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraMotion {
    /// Number of the frame, from 0.
    pub frame: usize,
    /// What was found.
    pub state: CameraState,
    /// Rotation vector of `frame_camera_from_first_camera`, radians, camera axes; zero unless the frame was steadied.
    pub turn_rad: DVec3,
    /// Displacement of the picture against the first view, largest and root mean square over it, pixels.
    pub shift_px: [f64; 2],
    /// Share of the key frame's points that the rotation explains; NaN where none was estimated.
    pub support: f64,
}

impl CameraMotion {
    /// The rotation of `frame_camera_from_first_camera`.
    pub fn turned(&self) -> Turned {
        matrix(self.turn_rad)
    }
}

/// Why a view ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LossReason {
    /// From one frame to the next the picture is another one.
    Cut,
    /// The focal length changes, or the camera is carried forwards or backwards.
    Zoom,
    /// The picture has become another one over several frames.
    OtherView,
}

impl LossReason {
    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Cut => "cut",
            Self::Zoom => "zoom",
            Self::OtherView => "other view",
        }
    }
}

/// The end of a view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Loss {
    /// The first frame that does not belong to the view.
    pub frame: usize,
    /// What happened.
    pub reason: LossReason,
}

/// A frame for the stages that need a camera at rest.
#[derive(Debug, Clone, PartialEq)]
pub enum Steadied {
    /// The frame as it is.
    AsGiven,
    /// The picture in the camera of the first frame, and the pixels that the frame does not show.
    Moved {
        /// The picture; what it does not show is filled from the first frame.
        picture: Image<u8>,
        /// Pixels not shown.
        unseen: Mask,
    },
    /// No frame of the view.
    Lost,
}

/// Frames that must agree with each other before another shot is taken for one; after a sudden change, and otherwise. The
/// second line is of pictures that look much alike, as those of two brick rooms.
const NEW_SHOT_FRAMES: [usize; 2] = [3, 25];
const ALIKE_SHOT_FRAMES: [usize; 2] = [8, 25];
/// Support falls at a cut from one frame to the next by this much.
const CUT_FALL: f64 = 0.25;
/// With this share of the last frame's support, a rotation that the finest scale finds is the right one.
const USUAL_SHARE: f64 = 0.85;
/// Support that falls below this share of the last frame's is not trusted, unless it stays there for so many frames.
const SUDDEN_FALL: f64 = 0.6;
const FALLEN_FRAMES: usize = 3;
/// A jump, found by trying many shifts, needs this much support.
const JUMP_SUPPORT: f64 = 0.5;
/// At a cut at least this share of the picture, at its coarsest scale, changes by more than this many grey levels against
/// the last frame of the view, after the median change is taken off. What a codec leaves on a plain wall does not.
const CUT_SHARE: f64 = 0.25;
const CUT_GREY: i32 = 12;
/// The same of pictures that look much alike. Six drawn cuts between brick rooms change 0.47 to 0.61 of the picture by more,
/// and somebody who walks there 0.04.
const ALIKE_GREY: i32 = 6;
/// Squares of this side, pixels, whose grey levels scatter by at least so many, show whether two pictures are alike: their
/// correlation, which no gain and no offset changes, is then at least so large.
const ALIKE_CELL_PX: usize = 16;
const ALIKE_SCATTER: f64 = 4.0;
const ALIKE_CORRELATION: f64 = 0.8;
/// So many of them are alike if only the light differs. Under lamps that flicker in bands or in a part of the picture 0.47 to 1.00
/// are, and of frames after a motion of the camera, a zoom or a cut up to 0.20, and 0.48 of a cut that keeps half of the room.
const ALIKE_SHARE: f64 = 0.35;
/// Frames in which a zoom must be seen.
const ZOOM_FRAMES: usize = 4;
/// A frame that shares less than this with the key frame becomes a key frame, and one of several that support it less.
const KEY_OVERLAP: f64 = 0.6;
const KEY_SUPPORT: f64 = 0.5;
const FADING_FRAMES: usize = 5;
/// The first key frame and the latest of this number in all are kept.
const MOST_KEYS: usize = 12;
/// Motions kept: of the longest walk and more.
const MOST_MOTIONS: usize = 25_000;
/// Losses kept.
const MOST_LOSSES: usize = 100;
/// A camera that moves by more than this from frame to frame is looked for where it would be if it went on, too, pixels.
const PACE_PX: f64 = 0.5;
/// The coarsest level has about this many pixels along its shorter side.
const COARSEST_PX: usize = 100;

/// A frame to which others are compared.
#[derive(Debug, Clone)]
struct Key {
    template: Template,
    /// `key_from_first`.
    turned: Turned,
    /// Relative change of the focal length against the first frame.
    zoom: f64,
}

/// The first view: its camera, and its picture.
#[derive(Debug)]
struct View {
    camera: Camera,
    picture: Image<u8>,
    canvas: Canvas,
}

/// Frames that do not agree with the key frames but may agree with each other.
#[derive(Debug)]
struct Other {
    key: Key,
    picture: Image<u8>,
    /// The first of the frames that agree, and their number.
    frame: usize,
    agreeing: usize,
    /// Why the view has ended, if it has.
    reason: LossReason,
}

/// Steadies a stream of frames.
#[derive(Debug)]
pub struct Steadier {
    options: SteadyOptions,
    given: Option<Camera>,
    field_of_view_rad: Option<f64>,
    view: Option<View>,
    keys: Vec<Key>,
    last: Turned,
    last_support: f64,
    /// Its relative change of the focal length against the first frame.
    zoom: f64,
    /// Rotation from the frame before the last one to the last one.
    pace: Turned,
    /// The coarsest scale of the last frame that a key frame explained, and of a camera that moves the whole frame.
    last_coarse: Option<Image<u8>>,
    last_frame: Option<Image<u8>>,
    other: Option<Other>,
    /// Frames since the last one that a key frame explained, and frames of little support.
    unexplained: usize,
    fading: usize,
    zooming: usize,
    is_lost: bool,
    frames: usize,
    motions: VecDeque<CameraMotion>,
    losses: Vec<Loss>,
    news: Option<Loss>,
    /// Whether frames go on beyond the first one by more than shaking.
    pans: bool,
    /// Whether frames are compared with key frames only.
    keys_only: bool,
}

impl Steadier {
    /// A steadier for a new stream; without a camera, one of this horizontal field of view is assumed, or of the usual one
    /// across the longer side ([`assumed_field_of_view_rad`]).
    pub fn new(options: SteadyOptions, camera: Option<&Camera>, field_of_view_rad: Option<f64>) -> Self {
        Self {
            options,
            given: camera.cloned(),
            field_of_view_rad,
            view: None,
            keys: Vec::new(),
            last: DMat3::IDENTITY,
            last_support: 0.0,
            zoom: 0.0,
            pace: DMat3::IDENTITY,
            last_coarse: None,
            last_frame: None,
            other: None,
            unexplained: 0,
            fading: 0,
            zooming: 0,
            is_lost: false,
            frames: 0,
            motions: VecDeque::new(),
            losses: Vec::new(),
            news: None,
            pans: false,
            keys_only: false,
        }
    }

    /// The same, which does not go on from frame to frame where no key frame shows the camera: a wrong one would.
    fn by_keys_only(self) -> Self {
        Self { keys_only: true, ..self }
    }

    /// Steadies the next frame.
    ///
    /// # Errors
    ///
    /// The size of the frame differs from the frames before, or from that of the given camera.
    pub fn push(&mut self, frame: &Frame<'_>) -> Result<Steadied, FrameError> {
        self.look(frame)?;
        Ok(self.drawn(frame))
    }

    /// Finds the camera in the next frame.
    fn look(&mut self, frame: &Frame<'_>) -> Result<(), FrameError> {
        let number = self.frames;
        let [width, height] = [frame.width(), frame.height()];
        let camera = self.view.as_ref().map(|view| &view.camera).or(self.given.as_ref());
        if let Some([expected_width, expected_height]) =
            camera.map(|camera| camera.size.map(|side| side as usize))
            && [expected_width, expected_height] != [width, height]
        {
            return Err(FrameError::SizeChanged { expected_width, expected_height, width, height });
        }
        self.frames += 1;
        let pyramid = Pyramid::new(*frame, levels(frame));
        if self.view.is_none() {
            self.open(frame, &pyramid);
            let found = if self.view.is_some() { CameraState::Still } else { CameraState::Unknown };
            let support = if self.view.is_some() { 1.0 } else { f64::NAN };
            self.note(number, found, support);
            return Ok(());
        }
        let (found, support) = match self.compared(&pyramid).or_else(|| self.compared_with_last(&pyramid)) {
            Some((key, estimate)) => {
                self.follow(number, key, &estimate, &pyramid);
                (CameraState::Turned, estimate.support)
            }
            None if self.is_lit_unevenly(frame) => (CameraState::UnevenLight, f64::NAN),
            None => {
                self.unexplained += 1;
                self.look_for_another_shot(number, frame, &pyramid);
                (CameraState::Unknown, f64::NAN)
            }
        };
        self.note(number, found, support);
        Ok(())
    }

    /// True of a frame of the camera that has not moved, in which the light differs from place to place.
    fn is_lit_unevenly(&self, frame: &Frame<'_>) -> bool {
        let is_unmoved = |view: &&View| displacement_px(&view.camera, &self.last)[0] < self.options.still_px;
        let view = self.view.as_ref().filter(|_| !self.is_lost).filter(is_unmoved);
        view.is_some_and(|view| alike_share(&view.picture.as_frame(), frame) >= ALIKE_SHARE)
    }

    /// Where a pixel of a frame is in its steadied picture; the same pixel if the frame was left as it is.
    pub fn in_steadied(&self, frame: usize, pixel: DVec2) -> DVec2 {
        let at = |view: &View, turned: &Turned| view.canvas.pixel(&view.camera, turned, pixel);
        self.moved(frame, at).unwrap_or(pixel)
    }

    /// Where a pixel of the steadied picture of a frame is in the frame.
    pub fn in_frame(&self, frame: usize, pixel: DVec2) -> DVec2 {
        let at = |view: &View, turned: &Turned| view.canvas.frame_pixel(&view.camera, turned, pixel);
        self.moved(frame, at).unwrap_or(pixel)
    }

    /// A place that depends on the camera in a frame; `None` if the frame was left as it is.
    fn moved(&self, frame: usize, at: impl Fn(&View, &Turned) -> Option<DVec2>) -> Option<DVec2> {
        let view = self.view.as_ref()?;
        let motion = self.motions.get(frame.checked_sub(self.motions.front()?.frame)?)?;
        let is_as_given = motion.turn_rad == DVec3::ZERO && !view.canvas.is_wide();
        if is_as_given { None } else { at(view, &motion.turned()) }
    }

    /// The camera in the frames so far, of the last 25 000 of them.
    pub fn motions(&self) -> &VecDeque<CameraMotion> {
        &self.motions
    }

    /// The views that have ended, the first 100 of them.
    pub fn losses(&self) -> &[Loss] {
        &self.losses
    }

    /// True if a view has ended since the last [`Steadier::take_loss`].
    pub fn has_news(&self) -> bool {
        self.news.is_some()
    }

    /// The end of a view, once.
    pub fn take_loss(&mut self) -> Option<Loss> {
        self.news.take()
    }

    /// Makes a frame the first one of a view if it shows enough.
    fn open(&mut self, frame: &Frame<'_>, pyramid: &Pyramid<'_>) {
        let size = [frame.width() as u32, frame.height() as u32];
        let field_of_view_rad = self.field_of_view_rad.unwrap_or_else(|| assumed_field_of_view_rad(size));
        let assumed = || Camera::level(size, field_of_view_rad, 1.0, 1.0).ok();
        let Some(camera) = self.given.clone().or_else(assumed).filter(|c| c.size == size) else { return };
        let Ok(template) = Template::new(pyramid, &camera) else { return };
        let key = Key { template, turned: DMat3::IDENTITY, zoom: 0.0 };
        self.begin(key, self.view_of(camera, frame.to_image()));
        self.last_coarse = Some(pyramid.coarsest().to_image());
    }

    fn view_of(&self, camera: Camera, picture: Image<u8>) -> View {
        let canvas = Canvas::new(&camera, self.options.reach.about(self.given.is_some()), &picture);
        View { camera, picture, canvas }
    }

    fn begin(&mut self, key: Key, view: View) {
        self.view = Some(view);
        self.keys = vec![key];
        (self.last, self.pace) = (DMat3::IDENTITY, DMat3::IDENTITY);
        (self.last_support, self.zoom) = (0.0, 0.0);
        self.last_frame = None;
        self.other = None;
        (self.unexplained, self.fading, self.zooming) = (0, 0, 0);
        self.is_lost = false;
    }

    /// The estimate against the nearest key frame, or after a jump against it or the first one: its key and rotation.
    fn compared(&self, pyramid: &Pyramid<'_>) -> Option<(usize, Estimate)> {
        let view = self.view.as_ref()?;
        let comparison = Comparison { pyramid, camera: &view.camera };
        let nearest = self.nearest_key();
        let to = |key: usize| self.last * self.keys[key].turned.transpose();
        let usual = if self.last_support > 0.0 { USUAL_SHARE * self.last_support } else { 1.0 };
        let is_trusted = self.unexplained >= FALLEN_FRAMES;
        let expected = if is_trusted { 0.0 } else { SUDDEN_FALL * self.last_support };
        let good = |estimate: &Estimate| estimate.is_supported(expected.max(self.options.least_support));
        // A camera that pans goes on as it did. From where it was, an estimate may stay behind and lose more in each frame.
        let ahead = matrix((1 + self.unexplained) as f64 * vector(&self.pace));
        let pans = displacement_px(&view.camera, &ahead)[0] > PACE_PX;
        let of = |key: usize, from: &Turned| {
            let template = &self.keys[key].template;
            let near = comparison.near(template, from, usual);
            let further = pans.then(|| comparison.near(template, &(ahead * *from), usual)).flatten();
            let found = [near, further].into_iter().flatten().max_by(|a, b| a.support.total_cmp(&b.support));
            found.filter(good)
        };
        let jumped = |key: usize, from: &Turned| {
            let found = of(key, &comparison.jump(&self.keys[key].template, from));
            found.filter(|estimate| estimate.support >= JUMP_SUPPORT)
        };
        let first = || (nearest != 0 || self.is_lost).then(|| jumped(0, &DMat3::IDENTITY)).flatten();
        let near = of(nearest, &to(nearest)).or_else(|| jumped(nearest, &to(nearest)));
        let found =
            near.map(|estimate| (nearest, estimate)).or_else(|| first().map(|estimate| (0, estimate)));
        // In a picture of little texture, most of which is somebody's, the rotation creeps along with that person. Then the
        // camera of the first frame explains more.
        let still = found.and_then(|(key, found)| {
            let turned = found.rotation * self.keys[key].turned;
            let template = &self.keys[0].template;
            if displacement_px(&view.camera, &turned)[0] < self.options.still_px {
                return None;
            }
            let is_better = |a: &Estimate, b: &Estimate| a.support > b.support;
            let still = comparison.of(template, &DMat3::IDENTITY).filter(|still| is_better(still, &found))?;
            let near = comparison.estimate(template, &DMat3::IDENTITY, 1);
            near.filter(|near| is_better(near, &still)).or(Some(still)).filter(good)
        });
        still.map(|still| (0, still)).or(found)
    }

    /// The estimate against the last frame of a camera that moves, which becomes a key frame, when no key frame explains this one.
    fn compared_with_last(&mut self, pyramid: &Pyramid<'_>) -> Option<(usize, Estimate)> {
        if self.unexplained > 0 || self.is_lost || self.keys_only {
            return None;
        }
        let (camera, last) = (&self.view.as_ref()?.camera, self.last_frame.as_ref()?.as_frame());
        let template = Template::new(&Pyramid::new(last, levels(&last)), camera).ok()?;
        let comparison = Comparison { pyramid, camera };
        let near = [DMat3::IDENTITY, self.pace].map(|from| comparison.near(&template, &from, 1.0));
        let found = near.into_iter().flatten().max_by(|a, b| a.support.total_cmp(&b.support))?;
        if !found.is_supported(JUMP_SUPPORT) {
            return None;
        }
        self.add_key(Key { template, turned: self.last, zoom: self.zoom });
        Some((self.keys.len() - 1, found))
    }

    fn add_key(&mut self, key: Key) {
        if self.keys.len() >= MOST_KEYS {
            self.keys.remove(1);
        }
        self.keys.push(key);
    }

    /// The key frame that looks nearest to where the camera last looked.
    fn nearest_key(&self) -> usize {
        let angle = |key: &Key| vector(&(self.last * key.turned.transpose())).length();
        (0..self.keys.len())
            .min_by(|a, b| angle(&self.keys[*a]).total_cmp(&angle(&self.keys[*b])))
            .unwrap_or(0)
    }

    /// Takes over an estimate: rotation, zoom, and whether the frame becomes a key frame.
    fn follow(&mut self, number: usize, key: usize, estimate: &Estimate, pyramid: &Pyramid<'_>) {
        let Some(view) = &self.view else { return };
        let turned = estimate.rotation * self.keys[key].turned;
        let frames = (1 + self.unexplained) as f64;
        self.pace = matrix(vector(&(turned * self.last.transpose())) / frames);
        self.last = turned;
        self.last_support = estimate.support;
        self.unexplained = 0;
        self.fading = if estimate.support < KEY_SUPPORT { self.fading + 1 } else { 0 };
        self.last_coarse = Some(pyramid.coarsest().to_image());
        let is_moving = displacement_px(&view.camera, &self.pace)[0] > PACE_PX;
        self.last_frame = is_moving.then(|| pyramid.level(0).to_image());
        self.other = None;
        let zoom = self.keys[key].zoom + estimate.zoom[0];
        self.zoom = zoom;
        let corner_px =
            0.5 * DVec2::new(f64::from(view.camera.size[0]), f64::from(view.camera.size[1])).length();
        let is_zoomed =
            zoom.abs() * corner_px > self.options.most_zoom_px && zoom.abs() > 4.0 * estimate.zoom[1];
        self.zooming = if is_zoomed { self.zooming + 1 } else { 0 };
        if is_zoomed && self.is_lost {
            return;
        }
        self.is_lost = false;
        if self.zooming >= ZOOM_FRAMES {
            self.lose(Loss { frame: number + 1 - ZOOM_FRAMES, reason: LossReason::Zoom });
            self.reopen_without_camera(None);
            return;
        }
        let shared = shared_with(&view.camera, &estimate.rotation);
        if shared < KEY_OVERLAP || self.fading >= FADING_FRAMES {
            self.fading = 0;
            let Ok(template) = Template::new(pyramid, &view.camera) else { return };
            self.add_key(Key { template, turned: self.last, zoom });
        }
    }

    /// A frame that no key frame explains: another shot if enough frames after it agree with it.
    fn look_for_another_shot(&mut self, number: usize, frame: &Frame<'_>, pyramid: &Pyramid<'_>) {
        let Some(view) = &self.view else { return };
        let comparison = Comparison { pyramid, camera: &view.camera };
        let agrees = self.other.as_ref().is_some_and(|other| {
            let found = comparison.near(&other.key.template, &other.key.turned, 1.0);
            found.is_some_and(|e| e.is_supported(self.options.least_support))
        });
        if let Some(other) = self.other.as_mut().filter(|_| agrees) {
            other.agreeing += 1;
            let frames = |of: [usize; 2]| of[usize::from(other.reason == LossReason::OtherView)];
            let has_changed = |grey: i32| {
                let last = self.last_coarse.as_ref();
                last.is_some_and(|last| changed_share(last, &pyramid.coarsest(), grey) >= CUT_SHARE)
            };
            let is_another = other.reason == LossReason::Zoom
                || has_changed(CUT_GREY)
                || other.agreeing >= frames(ALIKE_SHOT_FRAMES) && has_changed(ALIKE_GREY);
            let needed = frames(NEW_SHOT_FRAMES);
            if other.agreeing >= needed && is_another && !self.is_lost {
                let loss = Loss { frame: other.frame, reason: other.reason };
                self.lose(loss);
                let other = self.other.take();
                self.reopen_without_camera(other);
            }
            return;
        }
        let support = comparison.near(&self.keys[self.nearest_key()].template, &self.last, 1.0);
        let fallen = self.last_support - support.map_or(0.0, |e| e.support);
        let reason = match self.other {
            _ if self.zooming > 0 => LossReason::Zoom,
            None if fallen > CUT_FALL => LossReason::Cut,
            _ => LossReason::OtherView,
        };
        let key = Template::new(pyramid, &view.camera).ok();
        self.other = key.map(|template| Other {
            key: Key { template, turned: DMat3::IDENTITY, zoom: 0.0 },
            picture: frame.to_image(),
            frame: number,
            agreeing: 1,
            reason,
        });
    }

    fn lose(&mut self, loss: Loss) {
        self.is_lost = true;
        self.zooming = 0;
        self.news = Some(loss);
        if self.losses.len() < MOST_LOSSES {
            self.losses.push(loss);
        }
    }

    /// Without a given camera, what follows is a view of its own. A given camera is that of the first view alone.
    fn reopen_without_camera(&mut self, other: Option<Other>) {
        if self.given.is_some() {
            return;
        }
        match (other, self.view.take()) {
            (Some(other), Some(View { camera, .. })) => {
                self.begin(other.key, self.view_of(camera, other.picture));
            }
            _ => {
                self.keys.clear();
                self.is_lost = false;
            }
        }
    }

    /// Records the camera in a frame, of which `found` says whether its rotation is known.
    fn note(&mut self, number: usize, found: CameraState, support: f64) {
        let shift_px = self.view.as_ref().map_or([0.0; 2], |view| displacement_px(&view.camera, &self.last));
        let is_moved = shift_px[0].is_nan() || shift_px[0] >= self.options.still_px;
        let state = match found {
            _ if self.is_lost => CameraState::Lost,
            CameraState::Turned if !is_moved => CameraState::Still,
            _ => found,
        };
        let turn_rad = if is_moved && !self.is_lost { vector(&self.last) } else { DVec3::ZERO };
        if self.motions.len() == MOST_MOTIONS {
            self.motions.pop_front();
        }
        self.motions.push_back(CameraMotion { frame: number, state, turn_rad, shift_px, support });
    }

    /// The frame whose camera was noted last, steadied.
    fn drawn(&mut self, frame: &Frame<'_>) -> Steadied {
        let turned = self.motions.back().map_or(DMat3::IDENTITY, CameraMotion::turned);
        match &mut self.view {
            _ if self.is_lost => Steadied::Lost,
            // Pictures of one stream are of one size.
            None if self.options.reach.is_wide() => Steadied::Lost,
            Some(view) if turned != DMat3::IDENTITY || view.canvas.is_wide() => {
                self.pans |= reach::is_panned(&view.camera, &turned);
                let (picture, unseen) = view.canvas.steadied(frame, &view.camera, &turned);
                Steadied::Moved { picture, unseen }
            }
            _ => Steadied::AsGiven,
        }
    }
}

/// Share of the pixels of two pictures whose difference is more grey levels from the median difference.
fn changed_share(a: &Image<u8>, b: &Frame<'_>, grey: i32) -> f64 {
    let row = |y: usize| a.row(y).iter().zip(b.row(y)).map(|(a, b)| i32::from(*b) - i32::from(*a));
    let mut differences: Vec<i32> = (0..a.height()).flat_map(row).collect();
    let middle = differences.len() / 2;
    let median = *differences.select_nth_unstable(middle).1;
    let far = differences.iter().filter(|d| (*d - median).abs() > grey).count();
    far as f64 / differences.len() as f64
}

/// Of the squares of a picture that have texture, the share that looks alike in another one but for gain and offset; 0 of a
/// picture without texture.
fn alike_share(a: &Frame<'_>, b: &Frame<'_>) -> f64 {
    let side = ALIKE_CELL_PX;
    let cells = (0..a.height() / side).flat_map(|row| (0..a.width() / side).map(move |column| (row, column)));
    let correlation = |(row, column): (usize, usize)| {
        let columns = column * side..(column + 1) * side;
        let ([mut sums, mut squares], mut product) = ([[0.0; 2]; 2], 0.0);
        for y in row * side..(row + 1) * side {
            for (a, b) in a.row(y)[columns.clone()].iter().zip(&b.row(y)[columns.clone()]) {
                let levels = [a, b].map(|level| f64::from(*level));
                for (k, level) in levels.into_iter().enumerate() {
                    sums[k] += level;
                    squares[k] += level * level;
                }
                product += levels[0] * levels[1];
            }
        }
        let count = (side * side) as f64;
        let variance = [0, 1].map(|k| squares[k] / count - (sums[k] / count).powi(2));
        let covariance = product / count - sums[0] * sums[1] / (count * count);
        (variance[0] >= ALIKE_SCATTER.powi(2))
            .then(|| covariance / (variance[0] * variance[1].max(1e-9)).sqrt())
    };
    let correlations: Vec<f64> = cells.filter_map(correlation).collect();
    let alike = correlations.iter().filter(|correlation| **correlation >= ALIKE_CORRELATION).count();
    alike as f64 / correlations.len().max(1) as f64
}

/// Number of levels of a picture.
fn levels(frame: &Frame<'_>) -> usize {
    let shorter = frame.width().min(frame.height());
    (0..5).take_while(|level| shorter >> level >= COARSEST_PX).count().max(1)
}

/// Places spread over a picture, 7 by 7 with the corners, pixels.
fn places(camera: &Camera) -> impl Iterator<Item = DVec2> {
    let last = DVec2::new(f64::from(camera.size[0] - 1), f64::from(camera.size[1] - 1));
    (0..49).map(move |k| last * DVec2::new(f64::from(k % 7), f64::from(k / 7)) / 6.0)
}

/// Places of a picture and where the turned camera shows them, pixels; `None` where it does not.
fn moved(camera: &Camera, turned: &Turned) -> impl Iterator<Item = (DVec2, Option<DVec2>)> {
    places(camera).map(|place| (place, ray_of(camera, place).and_then(|ray| pixel_of(camera, turned, ray))))
}

/// Largest and root mean square displacement over the picture, pixels; NaN if it shows nothing of the picture.
fn displacement_px(camera: &Camera, turned: &Turned) -> [f64; 2] {
    let (mut largest, mut sum, mut count) = (0.0f64, 0.0, 0.0);
    let axis_tan = |pixel: DVec2| ((pixel - camera.centre_px) / camera.focal_px).length();
    for (place, seen) in moved(camera, turned) {
        // What turns out of sight goes on to infinity.
        let in_sight = seen.filter(|seen| axis_tan(*seen) <= FARTHEST_TAN.max(axis_tan(place)));
        let off = in_sight.map(|seen| seen.distance(place));
        largest = largest.max(off.unwrap_or(0.0));
        sum += off.map_or(0.0, |off| off * off);
        count += f64::from(u8::from(off.is_some()));
    }
    if count == 0.0 { [f64::NAN; 2] } else { [largest, (sum / count).sqrt()] }
}

/// Share of the picture that a turned camera still shows.
fn shared_with(camera: &Camera, turned: &Turned) -> f64 {
    let last = DVec2::new(f64::from(camera.size[0] - 1), f64::from(camera.size[1] - 1));
    let is_inside = |seen: DVec2| seen.cmpge(DVec2::ZERO).all() && seen.cmple(last).all();
    moved(camera, turned).filter(|(_, seen)| seen.is_some_and(is_inside)).count() as f64 / 49.0
}

/// Rotation vector of a rotation.
fn vector(turned: &Turned) -> DVec3 {
    DQuat::from_mat3(turned).normalize().to_scaled_axis()
}

/// The rotation of a rotation vector.
fn matrix(turn_rad: DVec3) -> Turned {
    DMat3::from_quat(DQuat::from_scaled_axis(turn_rad))
}

#[cfg(test)]
mod tests;
