//! How large the steadied pictures of a camera that pans are.

use super::template::ray_of;
use super::{CameraMotion, CameraState, Steadier, Turned, matrix, places, vector};
use crate::OptionError;
use crate::model::Camera;
use glam::{DMat3, DVec2, DVec3};

/// Rays farther from the axis of the pictures are not shown, as the tangent of 55 degrees: there pixels are three times as
/// wide as on the axis.
pub(super) const FARTHEST_TAN: f64 = 1.428;

/// A camera pans if it shows more than this share of a frame's side beyond the first frame. One that shakes shows less.
const PAN_SHARE: f64 = 0.05;
/// The largest [`Reach`]: with more, pictures of a long lens would need gigabytes.
const MOST_TURN_RAD: f64 = 2.0;
const MOST_REACH_PX: u32 = 2_000;

/// How far steadied pictures go on beyond a frame. [`Steadier::wider`] says how far they should.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Reach {
    /// Rotation vector from the first frame's camera to that of the pictures, radians, camera axes: to the middle of a pan.
    pub turn_rad: DVec3,
    /// How far the pictures go on beyond a frame of that camera, pixels: left, top, right and bottom. Without a given camera it is the
    /// larger one of both sides.
    pub px: [u32; 4],
}

impl Reach {
    /// True if the pictures are larger than the frames.
    pub(crate) fn is_wide(&self) -> bool {
        *self != Self::default()
    }

    /// The reach about an image of a camera that is given or assumed.
    pub(crate) fn about(self, is_given: bool) -> Self {
        let [left, top, right, bottom] = self.px;
        let (aside, up) = (left.max(right), top.max(bottom));
        if is_given { self } else { Self { px: [aside, up, aside, up], ..self } }
    }

    /// The camera of the pictures.
    pub(crate) fn camera(&self, first: &Camera) -> Camera {
        if self.is_wide() { first.turned(self.turn_rad).widened(self.px) } else { first.clone() }
    }

    /// Refuses a reach beyond what is drawn.
    pub(super) fn check(&self) -> Result<(), OptionError> {
        let farthest = self.px.into_iter().max().unwrap_or(0);
        let turn_rad = self.turn_rad.length();
        OptionError::unless(
            turn_rad <= MOST_TURN_RAD,
            "reach_from_rad",
            "of a turn of at most 2 rad",
            turn_rad,
        )?;
        let is_possible = farthest <= MOST_REACH_PX;
        OptionError::unless(is_possible, "reach_px", "at most 2000 pixels", f64::from(farthest))
    }
}

impl Steadier {
    /// How far the steadied pictures should go on beyond the frames so far, of a camera that pans; `None` if they go on as far. A
    /// camera that has turned by more than 55 degrees from the middle of the pan shows parts that are not counted.
    pub fn wider(&self) -> Option<Reach> {
        let camera = self.view.as_ref().filter(|_| self.pans).map(|view| &view.camera)?;
        let given = self.options.reach;
        let turns = || {
            self.motions.iter().filter(|motion| motion.state != CameraState::Lost).map(CameraMotion::turned)
        };
        let turn_rad = if given.is_wide() { given.turn_rad } else { middle(turns()) };
        let from_pictures = matrix(turn_rad).transpose();
        let mut px = given.px;
        for needed in turns().map(|turned| reach_px(camera, &(turned * from_pictures))) {
            px = std::array::from_fn(|side| px[side].max(needed[side]).min(MOST_REACH_PX));
        }
        (px != given.px).then_some(Reach { turn_rad, px })
    }
}

/// True of a camera that is turned so far that it pans.
pub(super) fn is_panned(camera: &Camera, turned: &Turned) -> bool {
    // Through a lens, the first frame too may go on beyond its size.
    let [own, needed] = [&DMat3::IDENTITY, turned].map(|turned| reach_px(camera, turned));
    let side = |k: usize| f64::from(camera.size[k % 2]);
    (0..4).any(|k| f64::from(needed[k]) - f64::from(own[k]) > PAN_SHARE * side(k))
}

/// How far a camera that is turned from that of the pictures shows what is beyond a frame of that camera: left, top, right and
/// bottom, pixels.
fn reach_px(camera: &Camera, turned: &Turned) -> [u32; 4] {
    let last = DVec2::new(f64::from(camera.size[0] - 1), f64::from(camera.size[1] - 1));
    let mut most = [0.0f64; 4];
    for pixel in places(camera) {
        let Some(ray) = ray_of(camera, pixel).map(|ray| turned.transpose() * ray) else { continue };
        let plane = ray.truncate() / ray.z;
        if ray.z <= 0.0 || plane.length() > FARTHEST_TAN {
            continue;
        }
        let at = camera.centre_px + camera.focal_px * plane;
        let beyond = [-at.x, -at.y, at.x - last.x, at.y - last.y];
        most = std::array::from_fn(|side| most[side].max(beyond[side]));
    }
    most.map(|beyond| beyond.ceil() as u32)
}

/// The rotation to the camera that looks at the middle between the directions to which cameras are turned, upright as the first one.
fn middle(turns: impl Iterator<Item = Turned>) -> DVec3 {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for turned in turns {
        let ahead = turned.transpose() * DVec3::Z;
        let aside_and_down = DVec2::new(ahead.x.atan2(ahead.z), ahead.y.clamp(-1.0, 1.0).asin());
        (low, high) = (low.min(aside_and_down), high.max(aside_and_down));
    }
    let middle = if low.is_finite() { 0.5 * (low + high) } else { DVec2::ZERO };
    let turned = DMat3::from_rotation_x(middle.y) * DMat3::from_rotation_y(-middle.x);
    vector(&turned).clamp_length_max(MOST_TURN_RAD)
}
