//! Sample points on the visible contours of the figure, and how they move with its coordinates.
//!
//! A contour point moves along its normal in the image as the point of the surface does on which it lies: the contour
//! slips over the surface only in the direction of sight, which the image does not show. So with X that point of the
//! surface, J the derivative of the projection and n the normal, the derivative by a coordinate q is n · J ∂X/∂q,
//! exactly. ∂X/∂q is a translation, a rotation a × (X - c) about a joint, or a stretch along a limb.
//!
//! Limbs taper: a contour point at the height z of a cylinder, -1 to 1, is moved outwards by the share z · taper of
//! its radius. Hidden-line removal uses the cylinders without taper.

use super::contacts::Feet;
use super::edge_search::Profile;
use super::unknowns::{
    ACROSS, ALONG, ANGLES, ANKLE, BODY, CROWN, FOOT, FOREARM, HEAD_FORWARD, HEADING, HEEL, HEIGHT, HIP_WIDTH,
    JOINTS, LEAN, LEG, PELVIS, SHANK, SHOULDER_WIDTH, TAPERS, THIGH, TILTS, TORSO, UPPER_ARM, WIDTHS,
};
use crate::model::body::Part;
use crate::model::visibility::{PreparedView, VisibleSegment};
use crate::model::{Body, Camera, ContourKind, EllipticCylinder, Others, PosedBody, side_lines};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// The figure of one frame in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    pub body: Body,
    pub posed: PosedBody,
    /// Middle of the hips.
    pub pelvis: DVec3,
    /// Unit vector in which the body faces.
    pub ahead: DVec2,
    /// The point of the ground about which the heading turns the path.
    pub origin: DVec2,
}

/// A point on the surface of a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    pub part: Part,
    /// Where it is, metres.
    pub world: DVec3,
    /// From the axis of the part to the surface, without taper; 0 at an end of the part.
    pub radius: DVec3,
    /// Height in the cylinder, from -1 to 1.
    pub z: f64,
    /// The taper of the part.
    pub taper: f64,
}

/// A point on a visible contour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub point: SurfacePoint,
    /// In the image, pixels.
    pub point_px: DVec2,
    /// Unit normal in the image, outwards.
    pub normal: DVec2,
    /// Whether the background lies beyond it, and not another part.
    pub is_outer: bool,
}

/// What [`samples`] needs again and again.
#[derive(Debug, Default)]
pub struct Workspace {
    view: PreparedView,
    visible: Vec<VisibleSegment>,
    outlines: Vec<Option<Outline>>,
    /// Those that may cover what is beside a line.
    near: Vec<usize>,
    pub samples: Vec<Sample>,
    pub motion: Vec<(usize, DVec3)>,
    pub profile: Profile,
}

/// Number of kinds of parts.
pub const KINDS: usize = 8;

/// The kind of a part: the row of its thickness in the body's table.
pub fn row_of(part: Part) -> usize {
    match part {
        Part::Head => 0,
        Part::Torso => 1,
        Part::RightUpperArm | Part::LeftUpperArm => 2,
        Part::RightForearm | Part::LeftForearm => 3,
        Part::RightHand | Part::LeftHand => 4,
        Part::RightThigh | Part::LeftThigh => 5,
        Part::RightShank | Part::LeftShank => 6,
        Part::RightFoot | Part::LeftFoot => 7,
    }
}

/// The taper of a part, counted from `TAPERS`.
fn taper_of(part: Part) -> Option<usize> {
    match row_of(part) {
        1 => Some(0),
        2 => Some(1),
        3 => Some(2),
        5 => Some(3),
        6 => Some(4),
        _ => None,
    }
}

/// 0 for the right side and the trunk, 1 for the left.
fn side_of(part: Part) -> usize {
    let index = part as usize;
    usize::from((5..8).contains(&index) || index >= 11)
}

/// Whether end ellipses of a part are compared: the top of the head, and toes and heel.
fn has_ends(part: Part) -> bool {
    matches!(row_of(part), 0 | 7)
}

/// Outlines of the head are compared only in the middle of its sides and of its top: real heads are round.
const HEAD_PART: f64 = 0.4;
const CROWN_PART: f64 = 0.5;
/// End ellipses are drawn with this many chords.
const RIM_CHORDS: usize = 12;

/// Writes sample points into the workspace, about `spacing_px` apart. The bodies of other people hide contours, and a
/// contour before or beside them does not border on the background.
pub fn samples(
    figure: &Figure,
    others: &[EllipticCylinder],
    camera: &Camera,
    whole: &[f64],
    spacing_px: f64,
    work: &mut Workspace,
) {
    let Workspace { view, visible, outlines, near, samples, .. } = work;
    samples.clear();
    let (cylinders, eye) = (&figure.posed.cylinders, camera.position());
    let has_ends = |part: usize| has_ends(Part::ALL[part]);
    view.contours_and_rims_of(cylinders, &Others::new(others, eye), eye, has_ends, RIM_CHORDS, visible);
    outlines.clear();
    outlines.extend(cylinders.iter().chain(others).map(|cylinder| Outline::new(cylinder, camera, eye)));
    for segment in visible.iter() {
        let part = Part::ALL[segment.part];
        let Some(line) = Line::new(segment, part, &cylinders[segment.part], whole, camera) else { continue };
        let count = (line.length_px / spacing_px).round().max(1.0) as usize;
        let first = samples.len();
        let on_cylinder = |n: usize| segment.start.lerp(segment.end, (n as f64 + 0.5) / count as f64);
        samples.extend((0..count).filter_map(|n| line.sample(on_cylinder(n), camera)));
        let beyond = |sample: &Sample| sample.point_px + 0.75 * spacing_px * sample.normal;
        let [low, high] =
            [DVec2::min, DVec2::max].map(|most| samples[first..].iter().map(beyond).reduce(most));
        let Some((low, high)) = low.zip(high) else { continue };
        let beside = outlines.iter().enumerate().filter(|(other, _)| *other != segment.part);
        near.clear();
        near.extend(beside.filter_map(|(n, outline)| outline.as_ref()?.meets(low, high).then_some(n)));
        for sample in &mut samples[first..] {
            let point = beyond(sample);
            let covers = |&n: &usize| outlines[n].as_ref().is_some_and(|outline| outline.contains(point));
            sample.is_outer = !near.iter().any(covers);
        }
    }
}

/// A visible piece of a contour in the image.
struct Line<'a> {
    part: Part,
    cylinder: &'a EllipticCylinder,
    is_rim: bool,
    taper: f64,
    normal: DVec2,
    length_px: f64,
}

impl<'a> Line<'a> {
    /// `None` for contours that are not compared, and for those that the camera does not see as lines. A fit that goes astray
    /// may pass close to the camera, where lines grow without limit: those longer than the picture are not compared either.
    fn new(
        segment: &VisibleSegment,
        part: Part,
        cylinder: &'a EllipticCylinder,
        whole: &[f64],
        camera: &Camera,
    ) -> Option<Self> {
        let is_rim = matches!(segment.kind, ContourKind::TopRim | ContourKind::BottomRim);
        if part == Part::Head && segment.kind == ContourKind::BottomRim {
            return None;
        }
        let taper = taper_of(part).map_or(0.0, |taper| whole[TAPERS + taper]);
        let mut line = Self { part, cylinder, is_rim, taper, normal: DVec2::ZERO, length_px: 0.0 };
        let ends = [segment.start, segment.end].map(|end| camera.project(line.on_surface(end).0));
        let across = ends[1]? - ends[0]?;
        line.length_px = across.length();
        let [width, height] = camera.size.map(f64::from);
        if line.length_px > width.hypot(height) {
            return None;
        }
        let axis = cylinder.world_from_cylinder.matrix3.z_axis;
        let middle = segment.start.midpoint(segment.end);
        let outwards = match segment.kind {
            ContourKind::TopRim => axis,
            ContourKind::BottomRim => -axis,
            _ => line.on_surface(middle).1,
        };
        let outwards_px = camera.project(middle + 0.05 * outwards)? - camera.project(middle)?;
        let normal = across.perp().try_normalize()?;
        line.normal = if normal.dot(outwards_px) < 0.0 { -normal } else { normal };
        Some(line)
    }

    /// The point of the tapered surface, its radius without taper, and its height from -1 to 1.
    fn on_surface(&self, on_cylinder: DVec3) -> (DVec3, DVec3, f64) {
        let axis = self.cylinder.world_from_cylinder.matrix3.z_axis;
        let from_centre = on_cylinder - self.cylinder.centre();
        let z = from_centre.dot(axis) / self.cylinder.half_length;
        let radius = from_centre - axis * (z * self.cylinder.half_length);
        (on_cylinder + radius * (self.taper * z), radius, z)
    }

    fn sample(&self, on_cylinder: DVec3, camera: &Camera) -> Option<Sample> {
        let (world, radius, z) = self.on_surface(on_cylinder);
        let depth = radius.dot(self.cylinder.world_from_cylinder.matrix3.x_axis).abs();
        let is_round = match (self.part, self.is_rim) {
            (Part::Head, true) => depth > CROWN_PART * self.cylinder.semi_axes.x,
            (Part::Head, false) => z.abs() > HEAD_PART,
            _ => false,
        };
        if is_round {
            return None;
        }
        let radius = if self.is_rim { DVec3::ZERO } else { radius };
        let point_px = camera.project(world)?;
        let (normal, taper) = (self.normal, self.taper);
        let point = SurfacePoint { part: self.part, world, radius, z, taper };
        Some(Sample { point, point_px, normal, is_outer: true })
    }
}

/// The quadrangle between the side lines of a part, pixels.
#[derive(Debug, Clone)]
struct Outline {
    corners: [DVec2; 4],
    low: DVec2,
    high: DVec2,
}

impl Outline {
    fn new(cylinder: &EllipticCylinder, camera: &Camera, eye: DVec3) -> Option<Self> {
        let [left, right] = side_lines(cylinder, eye)?;
        let [a, b, c, d] =
            [left.start, left.end, right.end, right.start].map(|corner| camera.project(corner));
        let corners = [a?, b?, c?, d?];
        let [low, high] = [DVec2::min, DVec2::max].map(|most| corners.into_iter().reduce(most));
        Some(Self { corners, low: low?, high: high? })
    }

    /// Whether it may contain points between two corners.
    fn meets(&self, low: DVec2, high: DVec2) -> bool {
        low.cmple(self.high).all() && high.cmpge(self.low).all()
    }

    /// Whether a point is inside; the quadrangle is convex.
    fn contains(&self, point: DVec2) -> bool {
        if point.cmplt(self.low).any() || point.cmpgt(self.high).any() {
            return false;
        }
        let corners = &self.corners;
        let turns = (0..4).map(|n| (corners[(n + 1) % 4] - corners[n]).perp_dot(point - corners[n]) > 0.0);
        let left = turns.filter(|&is_left| is_left).count();
        left == 0 || left == 4
    }
}

impl Figure {
    /// Writes ∂X/∂q of a point of the surface for every coordinate q of the figure on which it depends.
    pub fn motion(&self, point: &SurfacePoint, out: &mut Vec<(usize, DVec3)>) {
        out.clear();
        let (ahead, left) = (self.ahead.extend(0.0), self.ahead.perp().extend(0.0));
        let x = point.world;
        out.extend([
            (ALONG, ahead),
            (ACROSS, left),
            (HEIGHT, DVec3::Z),
            (HEADING, DVec3::Z.cross(x - self.origin.extend(0.0))),
            (BODY + WIDTHS + row_of(point.part), point.radius * (1.0 + point.taper * point.z)),
        ]);
        out.extend(taper_of(point.part).map(|taper| (BODY + TAPERS + taper, point.radius * point.z)));
        if point.part.is_leg() { self.leg_motion(point, out) } else { self.trunk_motion(point, out) }
    }

    fn axes(&self, part: usize) -> DMat3 {
        self.posed.cylinders[part].world_from_cylinder.matrix3
    }

    /// Trunk, head and arms turn with the lean about the hips and rise with the length of the torso.
    fn trunk_motion(&self, point: &SurfacePoint, out: &mut Vec<(usize, DVec3)>) {
        let (row, height_m) = (row_of(point.part), self.body.height_m);
        let left = self.ahead.perp().extend(0.0);
        let trunk = self.axes(Part::Torso as usize);
        // Share of the part from its upper end down, 0 to 1.
        let down = 0.5 * (1.0 - point.z);
        let share = if row == 1 { 1.0 - down } else { 1.0 };
        out.push((LEAN, left.cross(point.world - self.pelvis)));
        out.push((BODY + TORSO, trunk.z_axis * (height_m * share)));
        if row == 0 {
            out.push((BODY + CROWN, trunk.z_axis * (height_m * (1.0 - down))));
            out.push((BODY + HEAD_FORWARD, trunk.x_axis * height_m));
        }
        if row < 2 {
            return;
        }
        let side = side_of(point.part);
        let (joints, outwards) =
            if side == 0 { (&self.posed.right, -left) } else { (&self.posed.left, left) };
        let upper = if side == 0 { Part::RightUpperArm } else { Part::LeftUpperArm } as usize;
        let angle = |joint: usize| ANGLES + side * JOINTS + joint;
        let bend = self.axes(point.part as usize).y_axis;
        out.push((BODY + SHOULDER_WIDTH, outwards * height_m));
        out.push((angle(3), -bend.cross(point.world - joints.shoulder)));
        let share = if row == 2 { down } else { 1.0 };
        out.push((BODY + UPPER_ARM, -self.axes(upper).z_axis * (height_m * share)));
        if row >= 3 {
            let share = if row == 3 { down } else { 1.0 };
            out.push((angle(4), -bend.cross(point.world - joints.elbow)));
            out.push((BODY + FOREARM, -self.axes(upper + 1).z_axis * (height_m * share)));
        }
    }

    /// Legs turn about the hips, which the pelvis carries along.
    fn leg_motion(&self, point: &SurfacePoint, out: &mut Vec<(usize, DVec3)>) {
        let (row, height_m) = (row_of(point.part), self.body.height_m);
        let ahead = self.ahead.extend(0.0);
        let down = 0.5 * (1.0 - point.z);
        let side = side_of(point.part);
        let (joints, sign) = if side == 0 { (&self.posed.right, -1.0) } else { (&self.posed.left, 1.0) };
        let thigh = if side == 0 { Part::RightThigh } else { Part::LeftThigh } as usize;
        let angle = |joint: usize| ANGLES + side * JOINTS + joint;
        let axes = self.axes(point.part as usize);
        let (bend, bend_of_thigh, x) = (axes.y_axis, self.axes(thigh).y_axis, point.world);
        // What turns about the hip moves shank and foot as far as the knee.
        let thigh_point = if row == 5 { x } else { joints.knee };
        let hip = joints.hip - self.pelvis;
        out.push((LEAN, self.ahead.perp().extend(0.0).cross(hip)));
        out.push((PELVIS, self.axes(Part::Torso as usize).z_axis.cross(hip)));
        out.push((BODY + HIP_WIDTH, hip / self.body.proportions.hip_half_width));
        out.push((TILTS + side * LEG, sign * ahead.cross(thigh_point - joints.hip)));
        out.push((angle(0), -bend_of_thigh.cross(thigh_point - joints.hip) - bend.cross(x - thigh_point)));
        let share = if row == 5 { down } else { 1.0 };
        out.push((BODY + THIGH, -self.axes(thigh).z_axis * (height_m * share)));
        if row >= 6 {
            let share = if row == 6 { down } else { 1.0 };
            out.push((TILTS + side * LEG + 1, sign * ahead.cross(x - joints.knee)));
            out.push((angle(1), bend.cross(x - joints.knee)));
            out.push((BODY + SHANK, -self.axes(thigh + 1).z_axis * (height_m * share)));
        }
        if row == 7 {
            // The foot's axis points to the toes, its x axis away from or to the sole.
            let sole = axes.x_axis * -axes.x_axis.dot(self.axes(thigh + 1).z_axis).signum();
            out.push((angle(2), -bend.cross(x - joints.ankle)));
            out.push((BODY + FOOT, axes.z_axis * (height_m * (1.0 - down))));
            out.push((BODY + HEEL, -axes.z_axis * height_m));
            out.push((BODY + ANKLE, sole * height_m));
            // The sole stays where it is when the foot is thicker, and the axis rises.
            let thickness = self.posed.cylinders[point.part as usize].semi_axes.x;
            out.push((BODY + WIDTHS + 7, -sole * thickness));
        }
    }

    /// The lowest point of the lower foot: under the heel, or under the ball of the toes.
    pub fn lowest_point(&self) -> SurfacePoint {
        let side = usize::from(self.posed.left.ankle.z < self.posed.right.ankle.z);
        let [heel, ball] = [-1.0, BALL].map(|share| self.sole(side, share));
        if heel.world.z < ball.world.z { heel } else { ball }
    }

    /// The point of a sole below a place on the foot's axis, from -1 at the heel to 1 at the tip of the toes.
    fn sole(&self, side: usize, share: f64) -> SurfacePoint {
        let part = if side == 0 { Part::RightFoot } else { Part::LeftFoot };
        let foot = &self.posed.cylinders[part as usize];
        let axes = foot.world_from_cylinder.matrix3;
        let radius = axes.x_axis * (-axes.x_axis.z.signum() * foot.semi_axes.x);
        let world = foot.centre() + axes.z_axis * (share * foot.half_length) + radius;
        SurfacePoint { part, world, radius, z: share, taper: 0.0 }
    }

    /// Heel and toes of the right and the left foot.
    pub fn feet(&self) -> Feet {
        [0, 1].map(|side| [-1.0, 1.0].map(|end| self.sole(side, end).world))
    }
}

/// Where the ball of the foot is on its axis, -1 at the heel, 1 at the toes: at 0.8 of the foot's length.
const BALL: f64 = 0.6;

/// n · J: how far the image of a world point moves along the normal, pixels per metre in each direction.
pub fn gradient(camera: &Camera, world: DVec3, normal: DVec2) -> DVec3 {
    let p = camera.camera_from_world(world);
    let ideal_px = p.truncate() / p.z * camera.focal_px + camera.centre_px;
    let lens = camera.distortion_slope(ideal_px).unwrap_or(DMat2::IDENTITY);
    let n = lens.transpose() * normal * camera.focal_px / p.z;
    camera.rotation.transpose() * DVec3::new(n.x, n.y, -n.dot(p.truncate()) / p.z)
}

#[cfg(test)]
mod tests {
    use super::super::super::search::tests::camera;
    use super::super::unknowns::{FIGURE, WHOLE, side_angles};
    use super::*;
    use crate::model::{Distortion, Posture};

    /// A figure by its coordinates, away from symmetry.
    fn figure(q: &[f64]) -> Figure {
        let whole = &q[BODY..];
        let body = super::super::unknowns::body(&Body::from_height(1.75).unwrap(), whole);
        let ahead = DVec2::from_angle(q[HEADING]);
        let pelvis = (q[ALONG] * ahead + q[ACROSS] * ahead.perp()).extend(q[HEIGHT]);
        let side = |n: usize| side_angles(&q[ANGLES + n * JOINTS..], &q[TILTS + n * LEG..]);
        let posture =
            Posture { right: side(0), left: side(1), trunk_lean: q[LEAN], pelvis_rotation: q[PELVIS] };
        let up = (q[LEAN].sin() * ahead).extend(q[LEAN].cos());
        let posed = body.pose(pelvis + 0.5 * body.torso_length_m() * up, q[HEADING], &posture);
        Figure { body, posed, pelvis, ahead, origin: DVec2::ZERO }
    }

    fn coordinates() -> Vec<f64> {
        let mut q = vec![0.0; FIGURE];
        q[ALONG] = 0.3;
        q[ACROSS] = 0.2;
        q[HEIGHT] = 0.93;
        q[HEADING] = 0.35;
        q[LEAN] = 0.06;
        q[PELVIS] = 0.07;
        let angles = [0.4, 0.2, 0.1, -0.3, 0.5, -0.2, 0.6, -0.15, 0.2, 0.7];
        q[ANGLES..TILTS].copy_from_slice(&angles);
        q[TILTS..BODY].copy_from_slice(&[0.04, -0.06, 0.07, -0.03]);
        q[BODY + TAPERS + 3] = 0.2;
        q[BODY + HEAD_FORWARD] = 0.02;
        q
    }

    fn sampled(q: &[f64], spacing_px: f64) -> Vec<Sample> {
        let mut work = Workspace::default();
        let mut whole = q[BODY..].to_vec();
        whole.resize(WHOLE, 0.0);
        samples(&figure(q), &[], &camera(), &whole, spacing_px, &mut work);
        work.samples
    }

    /// How far the contour of the same part has moved along the normal of a sample: the line through the two samples
    /// nearest to the normal.
    fn moved(sample: &Sample, after: &[Sample]) -> Option<f64> {
        let tangent = sample.normal.perp();
        let mut same: Vec<DVec2> = after
            .iter()
            .filter(|s| s.point.part == sample.point.part && s.normal.dot(sample.normal) > 0.99)
            .map(|s| s.point_px - sample.point_px)
            .filter(|p| p.length() < 4.0)
            .collect();
        same.sort_by(|a, b| a.dot(tangent).abs().total_cmp(&b.dot(tangent).abs()));
        let [a, b] = [*same.first()?, *same.get(1)?];
        let t = a.dot(tangent) / (a - b).dot(tangent);
        let on_normal = a + t * (b - a);
        (a.distance(b) > 0.5).then_some(on_normal.dot(sample.normal))
    }

    #[test]
    fn contours_move_along_their_normals_as_the_surface_under_them() {
        let q = coordinates();
        let (before, now) = (sampled(&q, 12.0), figure(&q));
        let mut motion = Vec::new();
        let mut seen = [0; FIGURE];
        for (coordinate, seen) in seen.iter_mut().enumerate() {
            // Steps of a few tenths of a pixel.
            let step = if coordinate < 3 { 2e-3 } else { 4e-3 };
            let [low, high] = [-step, step].map(|by| {
                let mut q = q.clone();
                q[coordinate] += by;
                sampled(&q, 1.0)
            });
            for sample in &before {
                // Ends of parts are not lines.
                if sample.point.radius == DVec3::ZERO || sample.point.z.abs() > 0.9 {
                    continue;
                }
                let (Some(from), Some(to)) = (moved(sample, &low), moved(sample, &high)) else { continue };
                now.motion(&sample.point, &mut motion);
                let dx: DVec3 = motion.iter().filter(|m| m.0 == coordinate).map(|m| m.1).sum();
                let slope = gradient(&camera(), sample.point.world, sample.normal).dot(dx);
                let expected = (to - from) / (2.0 * step);
                let scale = expected.abs().max(30.0);
                assert!(
                    (slope - expected).abs() < 0.03 * scale,
                    "{coordinate} of {:?} at {:.2}: {slope:.1} for {expected:.1}",
                    sample.point.part,
                    sample.point.z
                );
                *seen += usize::from(expected.abs() > 3.0);
            }
        }
        // Every coordinate but heel, foot and crown, which move ends of parts, moves some line.
        for coordinate in [
            ALONG,
            HEIGHT,
            HEADING,
            LEAN,
            ANGLES,
            ANGLES + 1,
            ANGLES + 8,
            TILTS,
            TILTS + 3,
            BODY + THIGH,
            BODY + WIDTHS + 5,
        ] {
            assert!(seen[coordinate] > 0, "{coordinate}");
        }
    }

    /// Lengths of the legs and of the foot, angles, tilts and the pelvis move the soles, whichever of heel and toes is lower.
    #[test]
    fn the_lowest_point_of_the_feet_moves_with_everything_that_carries_it() {
        let mut motion = Vec::new();
        for turned in [-0.4, 0.6] {
            let mut q = coordinates();
            q[ANGLES + 2] += turned;
            q[ANGLES + JOINTS + 2] += turned;
            q[BODY + WIDTHS + 7] = 0.1;
            let lowest = figure(&q).lowest_point();
            figure(&q).motion(&lowest, &mut motion);
            for coordinate in 0..FIGURE {
                let at = |by: f64| {
                    let mut q = q.clone();
                    q[coordinate] += by;
                    let point = figure(&q).lowest_point();
                    assert_eq!((point.part, point.z), (lowest.part, lowest.z));
                    point.world.z
                };
                let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
                let slope: f64 = motion.iter().filter(|m| m.0 == coordinate).map(|m| m.1.z).sum();
                assert!((slope - expected).abs() < 1e-6, "{turned}: {coordinate} {slope} {expected}");
            }
        }
    }

    #[test]
    fn the_lens_stretches_the_gradient() {
        let sample_at = DVec3::new(1.4, 0.3, 1.6);
        let mut camera = camera();
        camera.distortion = Distortion::Brown { k1: -0.2, k2: 0.03, p1: 1e-3, p2: -2e-3, k3: 0.0 };
        let normal = DVec2::from_angle(0.4);
        let found = gradient(&camera, sample_at, normal);
        for (n, axis) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            let at = |by: f64| camera.project(sample_at + by * axis).unwrap().dot(normal);
            let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((found[n] - expected).abs() < 1e-3 * expected.abs().max(10.0), "{n}: {found} {expected}");
        }
    }
}
