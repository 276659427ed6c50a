//! Steadied pictures that are larger than the frames, for a camera that pans: the camera with which people are tracked, and that
//! of the first frame.

use super::super::steady::Reach;
use super::Tracker;
use crate::model::{Camera, assumed_field_of_view_rad};
use glam::DVec2;

impl Tracker {
    /// How far the steadied pictures go on beyond the frames.
    fn reach(&self) -> Reach {
        let is_given = self.given.camera.is_some();
        self.given.steady.map_or_else(Reach::default, |steady| steady.reach.about(is_given))
    }

    /// Takes the camera, or the field of view of an assumed one, from frames of this size to the steadied pictures.
    pub(super) fn widen(&mut self, size: [u32; 2]) {
        let reach = self.reach();
        if !reach.is_wide() {
            return;
        }
        match &self.given.camera {
            Some(first) => self.options.camera = Some(reach.camera(first)),
            None => {
                let field_rad =
                    self.given.field_of_view_rad.unwrap_or_else(|| assumed_field_of_view_rad(size));
                let wider = f64::from(size[0] + 2 * reach.px[0]) / f64::from(size[0]);
                self.options.field_of_view_rad = Some(2.0 * (wider * (0.5 * field_rad).tan()).atan());
            }
        }
    }

    /// The camera of the first frame, of that of the steadied pictures; `None` if it is the same.
    pub(super) fn frame_camera(&self, pictures: &Camera) -> Option<Camera> {
        let reach = self.reach();
        let [width, height] = self.size.filter(|_| reach.is_wide())?.map(|side| side as u32);
        let corner_px = DVec2::new(f64::from(reach.px[0]), f64::from(reach.px[1]));
        let assumed = || Camera {
            size: [width, height],
            centre_px: pictures.centre_px - corner_px,
            ..pictures.turned(-reach.turn_rad)
        };
        Some(self.given.camera.clone().unwrap_or_else(assumed))
    }
}
