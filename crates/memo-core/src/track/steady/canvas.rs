//! The steadied pictures: those of the first view's camera, which may go on beyond its borders for a camera that pans.

use super::template::pixel_of;
use super::warp::Warp;
use super::{Turned, matrix, places};
use crate::image::{Frame, Image, Mask};
use crate::model::Camera;
use glam::{DMat3, DVec2, DVec3};

/// Rays farther from the first view's axis are not shown, as the tangent of 55 degrees: there pixels are three times as
/// wide as on the axis.
const FARTHEST_TAN: f64 = 1.428;

/// What is drawn of the frames.
#[derive(Debug)]
pub(super) struct Canvas {
    /// The first view's camera, widened.
    camera: Camera,
    warp: Warp,
    /// What pixels show that a frame does not show: of a wide canvas what the first frame that showed them did.
    beyond: Image<u8>,
    /// The pixels of a wide canvas that no frame has shown yet.
    blank: Option<Mask>,
}

impl Canvas {
    /// A canvas that goes on beyond the first picture by so many pixels: left, top, right and bottom.
    pub fn new(camera: &Camera, reach_px: [u32; 4], first: &Image<u8>) -> Self {
        if reach_px == [0; 4] {
            let warp = Warp::new(camera);
            return Self { camera: camera.clone(), warp, beyond: first.clone(), blank: None };
        }
        let wide = camera.widened(reach_px);
        let warp = Warp::new(&wide);
        let [width, height] = wide.size.map(|side| side as usize);
        let empty = Image::filled(width, height, 0);
        let (beyond, unseen) = warp.steadied(&first.as_frame(), camera, &DMat3::IDENTITY, &empty);
        Self { camera: wide, warp, beyond, blank: Some(unseen) }
    }

    /// True if the pictures are larger than the frames.
    pub fn is_wide(&self) -> bool {
        self.blank.is_some()
    }

    /// A frame of a camera that has turned, and the pixels that it does not show.
    pub fn steadied(&mut self, frame: &Frame<'_>, camera: &Camera, turned: &Turned) -> (Image<u8>, Mask) {
        let (picture, unseen) = self.warp.steadied(frame, camera, turned, &self.beyond);
        if let Some(blank) = &mut self.blank {
            let shown = unseen.pixels().iter().zip(blank.pixels_mut()).zip(picture.pixels());
            for (((unseen, blank), grey), beyond) in shown.zip(self.beyond.pixels_mut()) {
                if *blank && !unseen {
                    (*blank, *beyond) = (false, *grey);
                }
            }
        }
        (picture, unseen)
    }

    /// Where a pixel of a turned camera is; `None` of one that is behind the first view's camera.
    pub fn pixel(&self, camera: &Camera, turned: &Turned, pixel: DVec2) -> Option<DVec2> {
        pixel_of(&self.camera, &turned.transpose(), ray(camera, pixel)?)
    }

    /// Where one of its pixels is in a frame of a turned camera; `None` of one that is behind it.
    pub fn frame_pixel(&self, camera: &Camera, turned: &Turned, pixel: DVec2) -> Option<DVec2> {
        pixel_of(camera, turned, ray(&self.camera, pixel)?)
    }

    /// How far a turned camera shows what is beyond the first picture: left, top, right and bottom, pixels.
    pub fn reach_px(&self, camera: &Camera, turned: &Turned) -> [u32; 4] {
        let last = DVec2::new(f64::from(camera.size[0] - 1), f64::from(camera.size[1] - 1));
        let mut most = [0.0f64; 4];
        for pixel in places(camera) {
            let Some(ray) = ray(camera, pixel).map(|ray| turned.transpose() * ray) else { continue };
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
}

/// The direction of a pixel, in the axes of its camera.
fn ray(camera: &Camera, pixel: DVec2) -> Option<DVec3> {
    Some(((camera.undistort(pixel).ok()? - camera.centre_px) / camera.focal_px).extend(1.0))
}

/// A picture of a camera that has turned, in a canvas of the first view; what it does not show is that of `beyond`, which is as
/// large as the canvas.
pub(crate) fn turned_back(
    picture: &Image<u8>,
    camera: &Camera,
    canvas: &Camera,
    turn_rad: DVec3,
    beyond: &Image<u8>,
) -> (Image<u8>, Mask) {
    Warp::new(canvas).steadied(&picture.as_frame(), camera, &matrix(turn_rad), beyond)
}
