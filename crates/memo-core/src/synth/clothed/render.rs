//! Rendering of solids in front of a room by ray casting.

use super::person::Solid;
use super::room::Room;
use crate::image::Image;
use crate::model::Camera;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Fine pixels per side of a pixel.
const FINE: usize = 2;

/// A window of fine pixels with the nearest surface of each.
struct Canvas {
    /// First fine column and row.
    origin: [usize; 2],
    size: [usize; 2],
    /// Ray parameter and grey level; infinite where there is no surface.
    nearest: Vec<(f64, f32)>,
}

/// Renders the solids and their contact shadow on the floor.
pub(super) fn draw(
    solids: &[Solid],
    shadows: &[(DVec3, f64)],
    room: &Room,
    camera: &Camera,
    levels: &mut Image<f32>,
) {
    let windows: Vec<Option<[usize; 4]>> =
        solids.iter().map(|solid| window(&spheres(solid), camera)).collect();
    shade_floor(shadows, room, camera, levels);
    let Some(all) = windows.iter().flatten().copied().reduce(union) else { return };
    let mut canvas = Canvas {
        origin: [all[0], all[1]],
        size: [all[2] - all[0], all[3] - all[1]],
        nearest: vec![(f64::INFINITY, 0.0); (all[2] - all[0]) * (all[3] - all[1])],
    };
    for (solid, window) in solids.iter().zip(&windows) {
        if let Some(window) = window {
            canvas.add(solid, *window, room.light, camera);
        }
    }
    canvas.blend(levels);
}

fn spheres(solid: &Solid) -> [(DVec3, f64); 2] {
    [0, 1].map(|end| (solid.shape.ends[end], solid.shape.radii[end]))
}

/// Fine pixels from (left, top) to before (right, bottom) that can show the spheres; `None` outside the image
/// or if the camera is inside one of them.
fn window(spheres: &[(DVec3, f64)], camera: &Camera) -> Option<[usize; 4]> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for (centre, radius) in spheres {
        let depth = camera.camera_from_world(*centre).z;
        if depth <= 2.0 * radius {
            return None;
        }
        let pixel = camera.project_ideal(*centre)?;
        // A sphere off the axis appears larger than radius / depth, by a factor of less than 1.5 within 45
        // degrees.
        let reach = 1.5 * camera.focal_px * *radius / (depth - radius);
        (low, high) = (low.min(pixel - reach), high.max(pixel + reach));
    }
    let size = DVec2::new(f64::from(camera.size[0]), f64::from(camera.size[1]));
    let pixel = |p: DVec2| p.clamp(DVec2::ZERO, size);
    let (low, high) = (pixel(low.floor()), pixel(high.ceil() + 1.0));
    let fine = |v: f64| v as usize * FINE;
    (low.x < high.x && low.y < high.y).then(|| [fine(low.x), fine(low.y), fine(high.x), fine(high.y)])
}

fn union(a: [usize; 4], b: [usize; 4]) -> [usize; 4] {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
}

impl Canvas {
    /// Casts the rays of a window at a solid.
    fn add(&mut self, solid: &Solid, [left, top, right, bottom]: [usize; 4], light: DVec3, camera: &Camera) {
        let eye = camera.position();
        // Rays are affine in the pixel: the ray at a corner plus its change along each side.
        let sample = |x: usize, y: usize| {
            let at = |fine: usize| (fine as f64 + 0.5) / FINE as f64 - 0.5;
            let in_camera = ((DVec2::new(at(x), at(y)) - camera.centre_px) / camera.focal_px).extend(1.0);
            camera.rotation.transpose() * in_camera
        };
        let corner = sample(left, top);
        let (across, down) = (sample(left + 1, top) - corner, sample(left, top + 1) - corner);
        for y in top..bottom {
            let row = corner + (y - top) as f64 * down;
            let start = (y - self.origin[1]) * self.size[0];
            for x in left..right {
                let ray = row + (x - left) as f64 * across;
                let Some(hit) = solid.shape.hit(eye, ray) else { continue };
                let nearest = &mut self.nearest[start + x - self.origin[0]];
                if hit.t < nearest.0 {
                    let lit = 0.55 + 0.45 * hit.normal.dot(light).max(0.0);
                    let (depth, count) = solid.cloth.stripes;
                    let stripe = 1.0 - depth * (0.5 + 0.5 * (TAU * count * hit.along).sin());
                    *nearest = (hit.t, (solid.cloth.grey * lit * stripe) as f32);
                }
            }
        }
    }

    /// Averages the fine pixels over the background.
    fn blend(&self, levels: &mut Image<f32>) {
        for y in (0..self.size[1]).step_by(FINE) {
            for x in (0..self.size[0]).step_by(FINE) {
                let (column, row) = ((self.origin[0] + x) / FINE, (self.origin[1] + y) / FINE);
                let behind = levels.at(column, row);
                let sum: f32 = (0..FINE * FINE)
                    .map(|k| self.nearest[(y + k / FINE) * self.size[0] + x + k % FINE])
                    .map(|(t, level)| if t.is_finite() { level } else { behind })
                    .sum();
                levels.set(column, row, sum / (FINE * FINE) as f32);
            }
        }
    }
}

/// Darkens the floor close to the bodies.
fn shade_floor(bodies: &[(DVec3, f64)], room: &Room, camera: &Camera, levels: &mut Image<f32>) {
    let on_floor: Vec<(DVec3, f64)> = bodies.iter().map(|(centre, _)| (centre.with_z(0.0), 0.35)).collect();
    let Some([left, top, right, bottom]) = window(&on_floor, camera) else { return };
    for y in top / FINE..bottom / FINE {
        for x in left / FINE..right / FINE {
            if let Some(floor) = camera.ground_point(DVec2::new(x as f64, y as f64)) {
                let lit = room.lit(floor.truncate(), bodies);
                levels.set(x, y, levels.at(x, y) * lit as f32);
            }
        }
    }
}
