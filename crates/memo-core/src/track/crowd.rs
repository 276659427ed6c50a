//! Several people in one frame: where each is expected, whose edges are whose, and what nobody explains.
//!
//! People are followed side by side, each with filters and searches of their own. Three things keep them apart:
//!
//! * Nearer bodies hide farther ones in the hidden-line removal ([`Others`](crate::model::Others)).
//! * An edge belongs to one person. A wholly visible person would otherwise drift onto the edges of somebody behind.
//! * Changes that the bodies explain start nobody.

use super::decisions::{EXPLAINED, NEARER, OWNED, TURNED};
use super::score::{EdgeLine, ModelLine};
use super::search::{Hypothesis, Scene};
use crate::image::{Mask, Rectangle, Sides};
use crate::model::body::PART_COUNT;
use crate::model::{Camera, EllipticCylinder};
use glam::{DVec2, Vec2};

/// One person as expected in a frame.
#[derive(Debug, Clone)]
pub(super) struct Expected {
    /// Where the body is searched.
    pub window: Rectangle,
    /// Height in the image, pixels.
    pub height_px: f64,
    /// Distance from the camera, metres.
    pub distance_m: f64,
    /// Visible contours of both twins, ideal pixels.
    pub lines: Vec<ModelLine>,
    /// The body of the better twin.
    pub body: [EllipticCylinder; PART_COUNT],
}

impl Expected {
    /// True if the windows of both touch.
    pub fn meets(&self, other: &Self) -> bool {
        self.window.gap(&other.window) == [0, 0]
    }

    /// How far an edge is from the contours, as a share of the person's height.
    fn cost(&self, edge: &EdgeLine) -> f32 {
        let scale = self.height_px as f32;
        self.lines
            .iter()
            .map(|line| distance(line, edge) / scale + TURNED * turn(line, edge))
            .fold(f32::INFINITY, f32::min)
    }
}

/// Contours, window and body of a person at a place. The edges of both twins are the person's own.
pub(super) fn expected(
    scene: &Scene<'_>,
    twins: [Hypothesis; 2],
    window: Rectangle,
    height_px: f64,
) -> Expected {
    let body = scene.pose(&twins[0]);
    let lines = twins.iter().flat_map(|twin| scene.lines(twin)).collect();
    let distance_m = body.torso_centre.distance(scene.camera.position());
    Expected { window, height_px, distance_m, lines, body: body.cylinders }
}

/// Removes the edges that belong to another person.
pub(super) fn keep_own(edges: &mut Vec<EdgeLine>, own: &Expected, others: &[&Expected]) {
    if others.is_empty() {
        return;
    }
    edges.retain(|edge| {
        let cost = own.cost(edge);
        !others.iter().any(|other| {
            let of_other = other.cost(edge);
            of_other < OWNED && of_other + NEARER <= cost
        })
    });
}

/// Removes the edges of people who are followed.
pub(super) fn keep_unowned(edges: &mut Vec<EdgeLine>, others: &[&Expected]) {
    edges.retain(|edge| !others.iter().any(|other| other.cost(edge) < OWNED));
}

/// Mean distance of the two ends and the middle of an edge from a contour, pixels.
fn distance(line: &ModelLine, edge: &EdgeLine) -> f32 {
    let [start, end] = [line.start, line.end].map(Vec2::from);
    let along = end - start;
    let off = |point: Vec2| {
        let share = (point - start).dot(along) / along.length_squared().max(f32::MIN_POSITIVE);
        point.distance(start + along * share.clamp(0.0, 1.0))
    };
    let [a, b] = [edge.start, edge.end].map(Vec2::from);
    (off(a) + off(b) + off(0.5 * (a + b))) / 3.0
}

/// Sine of the angle between an edge and a contour, without direction.
fn turn(line: &ModelLine, edge: &EdgeLine) -> f32 {
    let direction = |a: [f32; 2], b: [f32; 2]| (Vec2::from(b) - Vec2::from(a)).normalize_or_zero();
    direction(line.start, line.end).perp_dot(direction(edge.start, edge.end)).abs()
}

/// Clears the changes that a body explains: within a margin of its parts.
pub(super) fn clear_explained(mask: &mut Mask, camera: &Camera, body: &[EllipticCylinder], height_px: f64) {
    paint_body(mask, [0, 0], camera, body, EXPLAINED * height_px, false);
}

/// Share of the image on and about a body, as far as nearer bodies leave it free, that changes; `None` if they leave
/// nothing.
pub(super) fn changing_share(
    mask: &Mask,
    camera: &Camera,
    own: &Expected,
    nearer: &[EllipticCylinder],
) -> Option<f32> {
    let (window, height_px) = (&own.window, own.height_px);
    let mut near = Mask::filled(window.width(), window.height(), false);
    let corner = [window.left, window.top];
    paint_body(&mut near, corner, camera, &own.body, EXPLAINED * height_px, true);
    paint_body(&mut near, corner, camera, nearer, EXPLAINED * height_px, false);
    let (mut all, mut changing) = (0_u32, 0_u32);
    for y in 0..near.height() {
        let row = &mask.row(window.top + y)[window.left..=window.right];
        for (near, changes) in near.row(y).iter().zip(row) {
            all += u32::from(*near);
            changing += u32::from(*near && *changes);
        }
    }
    (all > 0).then(|| changing as f32 / all as f32)
}

/// Sets all pixels within a margin of a body's parts in a part of the image that begins at a corner.
pub(super) fn paint_body(
    mask: &mut Mask,
    corner: [usize; 2],
    camera: &Camera,
    body: &[EllipticCylinder],
    margin_px: f64,
    value: bool,
) {
    let corner = DVec2::from(corner.map(|x| x as f64));
    for part in body {
        let axis = part.world_from_cylinder.matrix3.z_axis * part.half_length;
        let ends = [part.centre() - axis, part.centre() + axis].map(|p| camera.project(p));
        let [Some(a), Some(b)] = ends else { continue };
        let depth_m = camera.camera_from_world(part.centre()).z;
        let radius_px = part.semi_axes.max_element() * camera.focal_px.y / depth_m + margin_px;
        paint_capsule(mask, [a - corner, b - corner], radius_px, value);
    }
}

/// Sets all pixels within a radius of a segment.
fn paint_capsule(mask: &mut Mask, [a, b]: [DVec2; 2], radius_px: f64, value: bool) {
    let (low, high) = (a.min(b) - radius_px, a.max(b) + radius_px);
    let size = DVec2::new(mask.width() as f64, mask.height() as f64);
    if high.min_element() < 0.0 || low.x >= size.x || low.y >= size.y {
        return;
    }
    let (low, high) = (low.max(DVec2::ZERO).as_usizevec2(), high.min(size - 1.0).as_usizevec2());
    let along = b - a;
    let per_length = along / along.length_squared().max(f64::MIN_POSITIVE);
    for y in low.y..=high.y {
        for (x, pixel) in (low.x..).zip(&mut mask.row_mut(y)[low.x..=high.x]) {
            let from_a = DVec2::new(x as f64, y as f64) - a;
            let nearest = along * from_a.dot(per_length).clamp(0.0, 1.0);
            if from_a.distance_squared(nearest) <= radius_px * radius_px {
                *pixel = value;
            }
        }
    }
}

/// Bounding box of a body in the image, pixels.
pub(super) fn body_box(camera: &Camera, body: &[EllipticCylinder]) -> Option<Sides> {
    let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for cylinder in body {
        let end = cylinder.world_from_cylinder.matrix3.z_axis * cylinder.half_length;
        for point in [cylinder.centre() + end, cylinder.centre() - end] {
            let pixel = camera.project(point)?;
            (low, high) = (low.min(pixel), high.max(pixel));
        }
    }
    Some(Sides { left: low.x, top: low.y, right: high.x, bottom: high.y })
}

#[cfg(test)]
mod tests {
    use super::super::search::Path;
    use super::super::search::tests::{camera, walker};
    use super::*;
    use crate::image::Image;

    fn edge(start: [f32; 2], end: [f32; 2]) -> EdgeLine {
        EdgeLine { start, end, gradient: 20.0, velocity: 0.0 }
    }

    /// Somebody of 200 pixels with one upright contour.
    fn person(x: f32) -> Expected {
        let body = posed();
        Expected {
            window: Rectangle { left: 0, top: 0, right: 639, bottom: 479 },
            height_px: 200.0,
            distance_m: 5.0,
            lines: vec![ModelLine { part: 1, start: [x, 100.0], end: [x, 200.0] }],
            body,
        }
    }

    fn posed() -> [EllipticCylinder; PART_COUNT] {
        let (walker, camera) = (walker(), camera());
        let path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };
        let height_m = walker.level_torso_height_m();
        let hypothesis = Hypothesis { along_m: 0.0, height_m, phase: 0.2 };
        Scene::new(&walker, &camera, &path).pose(&hypothesis).cylinders
    }

    #[test]
    fn an_edge_belongs_to_whom_it_is_nearest_or_to_both() {
        let upright = |x: f32| edge([x, 110.0], [x, 190.0]);
        // Edges between two people whose contours are at 300 and at 320 or 308: within 8 pixels and 3 pixels nearer
        // makes an owner.
        for (x, second_at, first, second) in [
            (300.0, 320.0, true, false),
            (307.0, 320.0, true, false),
            (309.0, 320.0, true, true),
            (311.0, 320.0, true, true),
            (313.0, 320.0, false, true),
            (320.0, 320.0, false, true),
            (250.0, 320.0, true, true),
            (302.0, 308.0, true, false),
            (303.0, 308.0, true, true),
            (305.0, 308.0, true, true),
            (306.0, 308.0, false, true),
        ] {
            let kept = |own: f32, other: f32| {
                let mut edges = vec![upright(x)];
                keep_own(&mut edges, &person(own), &[&person(other)]);
                !edges.is_empty()
            };
            assert_eq!((kept(300.0, second_at), kept(second_at, 300.0)), (first, second), "{x} {second_at}");
        }
        let mut alone = vec![upright(500.0)];
        keep_own(&mut alone, &person(300.0), &[]);
        assert_eq!(alone.len(), 1, "without others every edge stays");
    }

    #[test]
    fn a_turned_or_distant_edge_is_nobody_s() {
        let across = edge([296.0, 150.0], [304.0, 150.0]);
        // Its middle is on the contour, its end 90 pixels below.
        let long = edge([300.0, 110.0], [300.0, 290.0]);
        let beside = edge([310.0, 110.0], [310.0, 190.0]);
        let mut edges = vec![across, beside, long, edge([302.0, 110.0], [302.0, 190.0])];
        keep_unowned(&mut edges, &[&person(300.0)]);
        assert_eq!(
            edges,
            [across, beside, long],
            "90 degrees count 15 pixels, and 10 pixels are more than 8"
        );
    }

    #[test]
    fn a_body_explains_the_changes_on_and_about_it() {
        let (body, camera) = (posed(), camera());
        let mut mask = Image::filled(640, 480, true);
        clear_explained(&mut mask, &camera, &body, 200.0);
        for part in &body {
            let pixel = camera.project(part.centre()).unwrap();
            assert!(!mask.at(pixel.x as usize, pixel.y as usize));
        }
        // About the body, as far as a share of its height.
        let mut bare = Image::filled(640, 480, true);
        clear_explained(&mut bare, &camera, &body, 0.0);
        let cleared: Vec<(i32, i32)> = (0..480)
            .flat_map(|y| (0..640).map(move |x| (x, y)))
            .filter(|&(x, y)| !bare.at(x, y))
            .map(|(x, y)| (x as i32, y as i32))
            .collect();
        let margin_px = EXPLAINED * 200.0;
        for (x, y) in (0..480).step_by(5).flat_map(|y| (0..640).step_by(5).map(move |x| (x, y))) {
            let apart_sq = cleared.iter().map(|(u, v)| (u - x as i32).pow(2) + (v - y as i32).pow(2)).min();
            let apart_px = f64::from(apart_sq.unwrap()).sqrt();
            assert!(apart_px > margin_px - 1.0 || !mask.at(x, y), "{x}, {y} is {apart_px} px off");
            assert!(apart_px < margin_px + 1.5 || mask.at(x, y), "{x}, {y} is {apart_px} px off");
        }
        let Sides { left, top, right, bottom } = body_box(&camera, &body).unwrap();
        let (low, high) = (DVec2::new(left, top), DVec2::new(right, bottom));
        let far = |x: usize, y: usize| {
            let point = DVec2::new(x as f64, y as f64);
            (point - point.clamp(low, high)).length() > 40.0
        };
        for (x, y) in (0..480).step_by(7).flat_map(|y| (0..640).step_by(7).map(move |x| (x, y))) {
            assert!(mask.at(x, y) || !far(x, y), "{x}, {y}");
        }
    }
    /// Changes on the left half of the image, then behind somebody who hides the rest of the body.
    #[test]
    fn the_changing_share_is_that_of_the_visible_body() {
        let camera = camera();
        let own =
            Expected { window: Rectangle { left: 100, top: 60, right: 539, bottom: 439 }, ..person(300.0) };
        let mut explained = Image::filled(640, 480, true);
        clear_explained(&mut explained, &camera, &own.body, own.height_px);
        let counted = |changes: &dyn Fn(usize, usize) -> bool| {
            let near = (60..440).flat_map(|y| (100..540).map(move |x| (x, y)));
            let near: Vec<(usize, usize)> = near.filter(|&(x, y)| !explained.at(x, y)).collect();
            near.iter().filter(|&&(x, y)| changes(x, y)).count() as f32 / near.len() as f32
        };
        let mask_of = |changes: &dyn Fn(usize, usize) -> bool| {
            let mut mask = Image::filled(640, 480, false);
            (0..480).for_each(|y| (0..640).for_each(|x| mask.set(x, y, changes(x, y))));
            mask
        };
        let centre_px = camera.project(own.body[0].centre()).unwrap();
        let left = |x: usize, _: usize| (x as f64) < centre_px.x;
        let share = changing_share(&mask_of(&left), &camera, &own, &[]).unwrap();
        assert!((0.2..0.8).contains(&share) && (share - counted(&left)).abs() < 1e-6, "{share}");
        // What a nearer body hides counts neither as changing nor as still.
        let upper: Vec<EllipticCylinder> =
            own.body.iter().filter(|part| part.centre().z > 0.9).copied().collect();
        let mut free = Image::filled(640, 480, true);
        clear_explained(&mut free, &camera, &upper, own.height_px);
        let is_seen = |x: usize, y: usize| free.at(x, y);
        assert_eq!(changing_share(&mask_of(&is_seen), &camera, &own, &upper), Some(1.0));
        let is_hidden = |x: usize, y: usize| !free.at(x, y);
        assert_eq!(changing_share(&mask_of(&is_hidden), &camera, &own, &upper), Some(0.0));
        assert_eq!(changing_share(&mask_of(&left), &camera, &own, &own.body), None, "all hidden");
    }
}
