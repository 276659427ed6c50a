//! The visible surface of a body for each pixel (the 2½-D description of Rohr 1994, section 2, after Marr):
//! depth, part, normal.
//!
//! The line of sight of each pixel, C + s d, with d of depth 1 in the camera, is intersected with each part
//! in the part's unit frame ([`silhouette`](super::silhouette)): the slab |z| <= 1 gives one interval of s,
//! the infinite cylinder |c + s d|² <= 1 another; the solid is their intersection, and the smallest entry
//! over all parts is visible. There is no tessellation; values are exact at pixel centres. Detail between
//! pixel centres is not represented; for exact contours see [`visibility`](super::visibility).
//!
//! Pixels are those of an ideal camera; lens distortion is not applied.

use super::silhouette::camera_in_unit_frame;
use super::{Camera, EllipticCylinder};
use crate::image::{Image, Window};
use glam::{DMat3, DVec2, DVec3};
use std::ops::Range;
use thiserror::Error;

/// The part index of a pixel without a part.
pub const NO_PART: u8 = u8::MAX;

/// Why no surface map was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// There are too many parts: part indices are bytes, and one value means "none".
    #[error("{count} parts, at most 255 can be told apart")]
    TooManyParts {
        /// Number of parts given.
        count: usize,
    },
}

/// The surface seen by each pixel of a window; all images have the size of the window.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceMap {
    /// The pixels covered: the given window, clipped to the camera's image.
    pub window: Window,
    /// Depth along the optical axis, metres; infinite where no part is visible.
    pub depth_m: Image<f32>,
    /// Index of the visible part; [`NO_PART`] where there is none.
    pub part: Image<u8>,
    /// Outward unit normal of the surface in camera axes (x right, y down, z forward); zero where no part is
    /// visible.
    pub normal: Image<[f32; 3]>,
}

/// Depth, part and normal at each pixel of `window`; `None` means the whole image.
///
/// From a camera inside a part nothing is visible, as in [`visible_contours`](super::visible_contours); a
/// part with a semi-axis or half length that is not positive is not visible either.
///
/// # Errors
///
/// There are more than 255 parts.
pub fn surface_map(
    cylinders: &[EllipticCylinder],
    camera: &Camera,
    window: Option<Window>,
) -> Result<SurfaceMap, SurfaceError> {
    if cylinders.len() > usize::from(NO_PART) {
        return Err(SurfaceError::TooManyParts { count: cylinders.len() });
    }
    let mut map = SurfaceMap::empty(within_image(window, camera));
    let camera_position = camera.position();
    if !cylinders.iter().any(|k| k.contains(camera_position)) {
        for (part, cylinder) in (0..NO_PART).zip(cylinders) {
            if let Some(view) = PartView::new(cylinder, camera) {
                map.draw(part, &view, projected_box(cylinder, camera, map.window));
            }
        }
    }
    Ok(map)
}

impl SurfaceMap {
    fn empty(window: Window) -> Self {
        let Window { width, height, .. } = window;
        Self {
            window,
            depth_m: Image::perhaps_empty(width, height, f32::INFINITY),
            part: Image::perhaps_empty(width, height, NO_PART),
            normal: Image::perhaps_empty(width, height, [0.0; 3]),
        }
    }

    /// Draws one part where it is closer than the parts drawn before.
    fn draw(&mut self, part: u8, view: &PartView, area: Window) {
        for v in area.rows() {
            let row = v - self.window.y;
            let depths = self.depth_m.row_mut(row);
            let parts = self.part.row_mut(row);
            let normals = self.normal.row_mut(row);
            for u in area.columns() {
                let column = u - self.window.x;
                let Some(hit) = view.entry(DVec2::new(u as f64, v as f64)) else { continue };
                if (hit.depth_m as f32) < depths[column] {
                    depths[column] = hit.depth_m as f32;
                    parts[column] = part;
                    normals[column] = view.normal(&hit);
                }
            }
        }
    }
}

impl Window {
    fn columns(&self) -> Range<usize> {
        self.x..self.x + self.width
    }

    fn rows(&self) -> Range<usize> {
        self.y..self.y + self.height
    }
}

/// One part in its unit frame, as the camera sees it.
struct PartView {
    camera: DVec3,
    /// Direction of the line of sight of pixel (0, 0), and its change per pixel to the right and down.
    origin: DVec3,
    right: DVec3,
    down: DVec3,
    /// Transforms the unit-frame gradient of the lateral surface to camera axes: R diag(1/a, 1/b, 1).
    camera_from_gradient: DMat3,
}

/// The entry point of a line of sight into a part.
struct Entry {
    depth_m: f64,
    /// The point in the unit frame.
    point: DVec3,
    on_end_face: bool,
}

impl PartView {
    fn new(cylinder: &EllipticCylinder, camera: &Camera) -> Option<Self> {
        let position = camera_in_unit_frame(cylinder, camera.position())?;
        let camera_from_cylinder = camera.rotation * cylinder.world_from_cylinder.matrix3;
        let extents = cylinder.semi_axes.extend(cylinder.half_length);
        let unit_from_camera = DMat3::from_diagonal(extents.recip()) * camera_from_cylinder.transpose();
        let focal = camera.focal_px;
        let corner = (-camera.centre_px / focal).extend(1.0);
        Some(Self {
            camera: position,
            origin: unit_from_camera * corner,
            right: unit_from_camera.x_axis / focal.x,
            down: unit_from_camera.y_axis / focal.y,
            camera_from_gradient: camera_from_cylinder
                * DMat3::from_diagonal(cylinder.semi_axes.recip().extend(1.0)),
        })
    }

    /// Intersects the line of sight of a pixel with slab and infinite cylinder; `None` where it misses the
    /// part.
    fn entry(&self, pixel: DVec2) -> Option<Entry> {
        let d = self.origin + self.right * pixel.x + self.down * pixel.y;
        let (c_xy, d_xy) = (self.camera.truncate(), d.truncate());
        let a = d_xy.length_squared();
        let half = -c_xy.dot(d_xy);
        let discriminant = a - c_xy.perp_dot(d_xy).powi(2);
        if discriminant < 0.0 {
            return None;
        }
        let root = discriminant.sqrt();
        let (side_in, side_out) = ((half - root) / a, (half + root) / a);
        let (z0, z1) = ((-1.0 - self.camera.z) / d.z, (1.0 - self.camera.z) / d.z);
        let (slab_in, slab_out) = (z0.min(z1), z0.max(z1));
        let depth_m = side_in.max(slab_in);
        (depth_m > 0.0 && depth_m <= side_out.min(slab_out)).then(|| Entry {
            depth_m,
            point: self.camera + d * depth_m,
            on_end_face: slab_in > side_in,
        })
    }

    fn normal(&self, entry: &Entry) -> [f32; 3] {
        let gradient = if entry.on_end_face {
            DVec3::Z * entry.point.z.signum()
        } else {
            entry.point.truncate().extend(0.0)
        };
        (self.camera_from_gradient * gradient).normalize().as_vec3().to_array()
    }
}

/// The window clipped to the image.
fn within_image(window: Option<Window>, camera: &Camera) -> Window {
    let [width, height] = camera.size.map(|n| n as usize);
    let Some(asked) = window else { return Window { x: 0, y: 0, width, height } };
    let (x, y) = (asked.x.min(width), asked.y.min(height));
    Window { x, y, width: asked.width.min(width - x), height: asked.height.min(height - y) }
}

/// The pixels of `window` that can show a part: the bounding rectangle of its bounding box, or the whole
/// window if the box reaches behind the camera.
fn projected_box(cylinder: &EllipticCylinder, camera: &Camera, window: Window) -> Window {
    let extents = cylinder.semi_axes.extend(cylinder.half_length);
    let corners = (0..8).map(|i| {
        let sign = |bit: usize| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let corner = extents * DVec3::new(sign(0), sign(1), sign(2));
        camera.project_ideal(cylinder.world_from_cylinder.transform_point3(corner))
    });
    let bounds = corners.map(|corner| corner.map(|p| (p, p)));
    let hull = |p: Option<(DVec2, DVec2)>, q: Option<(DVec2, DVec2)>| {
        p.zip(q).map(|((p0, p1), (q0, q1))| (p0.min(q0), p1.max(q1)))
    };
    let Some(Some((low, high))) = bounds.reduce(hull) else { return window };
    // Casts saturate: coordinates outside the image end at its border.
    let clip = |range: Range<usize>, low: f64, high: f64| {
        let start = (low.ceil() as usize).clamp(range.start, range.end);
        let end = ((high.floor() + 1.0) as usize).clamp(start, range.end.max(start));
        (start, end - start)
    };
    let (x, width) = clip(window.columns(), low.x, high.x);
    let (y, height) = clip(window.rows(), low.y, high.y);
    Window { x, y, width, height }
}

#[cfg(test)]
mod tests {
    use super::super::visibility::tests::{viewpoints, walker};
    use super::super::{VisibilityOptions, side_lines, visible_contours};
    use super::*;
    use glam::DAffine3;

    /// A camera that looks at a point, with the world's up upwards in the image (if it looks along that axis,
    /// world x upwards).
    fn looking_at(position: DVec3, target: DVec3, focal_px: f64) -> Camera {
        let forward = (target - position).normalize();
        let up = if forward.z.abs() > 0.99 { DVec3::X } else { DVec3::Z };
        let right = forward.cross(up).normalize();
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        Camera {
            distortion: crate::model::Distortion::None,
            size: [640, 480],
            focal_px: DVec2::splat(focal_px),
            centre_px: DVec2::new(319.5, 239.5),
            rotation,
            translation: -(rotation * position),
        }
    }

    fn post(semi_axes: DVec2, half_length: f64) -> EllipticCylinder {
        EllipticCylinder { world_from_cylinder: DAffine3::IDENTITY, semi_axes, half_length }
    }

    fn views() -> impl Iterator<Item = (Vec<EllipticCylinder>, Camera)> {
        viewpoints().into_iter().enumerate().map(|(i, position)| {
            (walker(0.1 * i as f64 - 0.6), looking_at(position, DVec3::new(0.0, 0.0, 0.9), 900.0))
        })
    }

    #[test]
    fn a_post_from_beside_and_from_above() {
        let post = post(DVec2::new(0.5, 0.25), 1.0);
        let mut camera = looking_at(DVec3::new(4.5, 0.0, 0.0), DVec3::ZERO, 500.0);
        camera.centre_px = DVec2::new(320.0, 240.0);
        let map = surface_map(&[post], &camera, None).unwrap();
        assert_eq!((map.depth_m.at(320, 240), map.part.at(320, 240)), (4.0, 0));
        assert_eq!(map.normal.at(320, 240), [0.0, 0.0, -1.0]);
        assert_eq!((map.depth_m.at(0, 0), map.part.at(0, 0)), (f32::INFINITY, NO_PART));
        // The tangent planes touch at y = ±b sqrt(1 - (a/d)²), x = a²/d.
        let half_width_px = 500.0 * 0.25 * (1.0 - 1.0 / 81.0_f64).sqrt() / (4.5 - 0.25 / 4.5);
        let shown = map.part.row(240).iter().filter(|&&p| p == 0).count();
        assert_eq!(shown, 2 * half_width_px.floor() as usize + 1);

        let mut camera = looking_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 500.0);
        camera.centre_px = DVec2::new(320.0, 240.0);
        let map = surface_map(&[post], &camera, None).unwrap();
        assert_eq!((map.depth_m.at(330, 250), map.normal.at(330, 250)), (2.0, [0.0, 0.0, -1.0]));
        // World x points up in this view: the end face is 2 · 125 + 1 pixels high.
        assert_eq!((0..480).filter(|&v| map.part.at(320, v) == 0).count(), 251);
    }

    #[test]
    fn a_window_is_cut_out_of_the_whole_map() {
        let (bodies, camera) = views().nth(1).unwrap();
        let whole = surface_map(&bodies, &camera, None).unwrap();
        let asked = Window { x: 300, y: 150, width: 1000, height: 120 };
        let cut = surface_map(&bodies, &camera, Some(asked)).unwrap();
        assert_eq!(cut.window, Window { width: 340, ..asked });
        for (u, v) in (0..340).flat_map(|u| (0..120).map(move |v| (u, v))) {
            assert_eq!(cut.depth_m.at(u, v), whole.depth_m.at(u + 300, v + 150));
            assert_eq!(cut.normal.at(u, v), whole.normal.at(u + 300, v + 150));
        }
        let outside = surface_map(&bodies, &camera, Some(Window { x: 700, ..asked })).unwrap();
        assert!(outside.part.pixels().is_empty());
    }

    #[test]
    fn from_inside_nothing_is_seen_and_too_many_parts_are_refused() {
        let (bodies, _) = views().next().unwrap();
        let camera = looking_at(bodies[1].centre(), DVec3::X * 9.0, 500.0);
        let map = surface_map(&bodies, &camera, None).unwrap();
        assert!(map.part.pixels().iter().all(|&p| p == NO_PART));
        let many = vec![bodies[0]; 256];
        assert_eq!(surface_map(&many, &camera, None), Err(SurfaceError::TooManyParts { count: 256 }));
    }

    /// A part that reaches behind the camera is drawn too: a floor under the camera, up to its horizon.
    #[test]
    fn a_part_reaching_behind_the_camera_is_seen_before_it() {
        let floor = post(DVec2::splat(1000.0), 1.0);
        let camera = looking_at(DVec3::new(0.0, 0.0, 2.0), DVec3::new(10.0, 0.0, 2.0), 500.0);
        let map = surface_map(&[floor], &camera, None).unwrap();
        assert_eq!(map.part.at(10, 239), NO_PART);
        assert_eq!(map.part.at(10, 240), NO_PART);
        assert!((241..480).all(|v| map.part.at(10, v) == 0));
        assert!((map.depth_m.at(10, 479) - 500.0 / 239.5).abs() < 1e-5);
    }

    /// The visible point lies on the surface of its part, no part hides it, and its normal faces the camera
    /// along the gradient of the surface.
    #[test]
    fn what_is_seen_is_the_nearest_surface() {
        for (bodies, camera) in views() {
            let map = surface_map(&bodies, &camera, None).unwrap();
            for (u, v) in (0..640).step_by(17).flat_map(|u| (0..480).step_by(13).map(move |v| (u, v))) {
                let pixel = DVec2::new(u as f64, v as f64);
                let sight = ((pixel - camera.centre_px) / camera.focal_px).extend(1.0);
                let at = |depth: f64| camera.position() + camera.rotation.transpose() * (sight * depth);
                let depth = f64::from(map.depth_m.at(u, v));
                let Some(part) = bodies.get(usize::from(map.part.at(u, v))) else {
                    assert!(bodies.iter().all(|k| (0..300).all(|i| !k.contains(at(i as f64 * 0.03)))));
                    continue;
                };
                let normal = DVec3::from(map.normal.at(u, v).map(f64::from));
                assert!((normal.length() - 1.0).abs() < 1e-6 && normal.dot(sight) < 1e-6);
                let outward = camera.rotation.transpose() * normal;
                assert!(
                    part.contains(at(depth) - outward * 2e-5) && !part.contains(at(depth) + outward * 2e-5)
                );
                assert!(
                    bodies
                        .iter()
                        .all(|k| (0..100).all(|i| !k.contains(at((depth - 1e-5) * i as f64 / 100.0))))
                );
            }
        }
    }

    /// The visible part at an image point between pixel centres, from a pixel of a camera shifted by the
    /// difference.
    fn part_at(bodies: &[EllipticCylinder], camera: &Camera, point_px: DVec2) -> Option<usize> {
        let pixel = point_px.round();
        if pixel.min_element() < 0.0 || pixel.x > 639.0 || pixel.y > 479.0 {
            return None;
        }
        let shifted = Camera { centre_px: camera.centre_px + pixel - point_px, ..camera.clone() };
        let window = Window { x: pixel.x as usize, y: pixel.y as usize, width: 1, height: 1 };
        surface_map(bodies, &shifted, Some(window)).ok().map(|map| usize::from(map.part.at(0, 0)))
    }

    /// Just inside a visible contour its part is visible, just outside it never is: ray casting agrees with
    /// the closed form of hidden-line removal. One in a thousand differs, only where a piece begins or ends
    /// within the step.
    #[test]
    fn visible_contours_bound_their_parts() {
        let (mut inside, mut agreeing, mut out) = (0, 0, Vec::new());
        for (bodies, camera) in views() {
            visible_contours(&bodies, camera.position(), &VisibilityOptions::default(), &mut out);
            for segment in &out {
                let [left, right] = side_lines(&bodies[segment.part], camera.position()).unwrap();
                let other = if segment.kind == left.kind { right } else { left };
                let own = if segment.kind == left.kind { left } else { right };
                let inward = (other.start - own.start).normalize();
                for i in 1..20 {
                    let point = segment.start.lerp(segment.end, f64::from(i) / 20.0);
                    let step_m = 1e-3 * camera.camera_from_world(point).z / camera.focal_px.x;
                    let seen = [inward, -inward].map(|way| {
                        let pixel = camera.project_ideal(point + way * step_m)?;
                        part_at(&bodies, &camera, pixel)
                    });
                    inside += usize::from(seen[0].is_some());
                    agreeing += usize::from(seen[0] == Some(segment.part));
                    assert_ne!(seen[1], Some(segment.part), "{segment:?}");
                }
            }
        }
        assert!(inside > 4000 && inside - agreeing <= inside / 1000, "{agreeing} of {inside}");
    }
}
