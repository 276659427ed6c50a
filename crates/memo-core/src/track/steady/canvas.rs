//! The steadied pictures: those of the first view's camera, or larger ones for a camera that pans, whose camera looks at the middle
//! of the pan.

use super::template::{pixel_of, ray_of};
use super::warp::Warp;
use super::{Reach, Turned, matrix};
use crate::image::{Frame, Image, Mask};
use crate::model::Camera;
use glam::{DVec2, DVec3};

/// What is drawn of the frames.
#[derive(Debug)]
pub(super) struct Canvas {
    /// The first view's camera, turned and widened.
    camera: Camera,
    /// The rotation from it to the first view's.
    first_turned: Turned,
    warp: Warp,
    /// What pixels show that a frame does not show: of a wide canvas what the first frame that showed them did.
    beyond: Image<u8>,
    /// The pixels of a wide canvas that no frame has shown yet.
    blank: Option<Mask>,
}

impl Canvas {
    /// The canvas of a reach beyond the frames.
    pub fn new(first: &Camera, reach: Reach, picture: &Image<u8>) -> Self {
        let camera = reach.camera(first);
        let first_turned = matrix(reach.turn_rad).transpose();
        let warp = Warp::new(&camera);
        if !reach.is_wide() {
            return Self { camera, first_turned, warp, beyond: picture.clone(), blank: None };
        }
        let [width, height] = camera.size.map(|side| side as usize);
        let empty = Image::filled(width, height, 0);
        let (beyond, unseen) = warp.steadied(&picture.as_frame(), first, &first_turned, &empty);
        Self { camera, first_turned, warp, beyond, blank: Some(unseen) }
    }

    /// True if the pictures are larger than the frames.
    pub fn is_wide(&self) -> bool {
        self.blank.is_some()
    }

    /// A frame of a camera that has turned, and the pixels that it does not show.
    pub fn steadied(&mut self, frame: &Frame<'_>, camera: &Camera, turned: &Turned) -> (Image<u8>, Mask) {
        let turned = *turned * self.first_turned;
        let (picture, unseen) = self.warp.steadied(frame, camera, &turned, &self.beyond);
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
        pixel_of(&self.camera, &(*turned * self.first_turned).transpose(), ray_of(camera, pixel)?)
    }

    /// Where one of its pixels is in a frame of a turned camera; `None` of one that is behind it.
    pub fn frame_pixel(&self, camera: &Camera, turned: &Turned, pixel: DVec2) -> Option<DVec2> {
        pixel_of(camera, &(*turned * self.first_turned), ray_of(&self.camera, pixel)?)
    }
}

/// A picture of a camera that has turned from the first view's, in the pictures of another camera in its place; what it does not show
/// is that of `beyond`, which is as large as these.
pub(crate) fn turned_back(
    picture: &Image<u8>,
    first: &Camera,
    pictures: &Camera,
    turn_rad: DVec3,
    beyond: &Image<u8>,
) -> (Image<u8>, Mask) {
    let turned = matrix(turn_rad) * first.rotation * pictures.rotation.transpose();
    Warp::new(pictures).steadied(&picture.as_frame(), first, &turned, beyond)
}
