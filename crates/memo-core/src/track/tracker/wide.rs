//! Steadied pictures that are larger than the frames, for a camera that pans: the camera with which people are tracked, and that
//! of the frames.

use super::Tracker;
use crate::model::{Camera, assumed_field_of_view_rad};
use glam::DVec2;

impl Tracker {
    /// How far the steadied pictures go on beyond the frames.
    fn widened_by(&self) -> [u32; 4] {
        self.given.steady.map_or([0; 4], |steady| steady.reach_about(self.given.camera.is_some()))
    }

    /// Takes the camera, or the field of view of an assumed one, from frames of this size to the steadied pictures.
    pub(super) fn widen(&mut self, size: [u32; 2]) {
        let reach_px = self.widened_by();
        if reach_px == [0; 4] {
            return;
        }
        match &self.given.camera {
            Some(camera) => self.options.camera = Some(camera.widened(reach_px)),
            None => {
                let field_rad =
                    self.given.field_of_view_rad.unwrap_or_else(|| assumed_field_of_view_rad(size));
                let wider = f64::from(size[0] + 2 * reach_px[0]) / f64::from(size[0]);
                self.options.field_of_view_rad = Some(2.0 * (wider * (0.5 * field_rad).tan()).atan());
            }
        }
    }

    /// The camera of the frames, of one of the steadied pictures; `None` if these are as large.
    pub(super) fn frame_camera(&self, steadied: &Camera) -> Option<Camera> {
        let reach_px = self.widened_by();
        let [width, height] = self.size.filter(|_| reach_px != [0; 4])?.map(|side| side as u32);
        let corner_px = DVec2::new(f64::from(reach_px[0]), f64::from(reach_px[1]));
        let narrowed = || Camera {
            size: [width, height],
            centre_px: steadied.centre_px - corner_px,
            ..steadied.clone()
        };
        Some(self.given.camera.clone().unwrap_or_else(narrowed))
    }
}
