//! Contour generators of an elliptic cylinder under central projection (Rohr 1994, sections 3.1 and 3.2).
//!
//! A contour generator is the curve on a surface whose image is the silhouette. For an elliptic cylinder it
//! consists of the two **side lines**, along which planes through the camera touch the lateral surface, and
//! of arcs of the two **end ellipses**. Everything is solved in the cylinder's *unit frame*, in which x, y
//! and z are divided by a, b and the half length, so that the solid is x² + y² <= 1, |z| <= 1. Scaling the
//! axes is an affine map, and affine maps preserve lines, tangency and what lies in front of what.
//!
//! This module handles only self-occlusion of a cylinder; [`visibility`](super::visibility) removes what
//! other parts hide. A cylinder with a semi-axis or a half length that is not positive is not a solid and has
//! no contour.

use super::EllipticCylinder;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Which contour of a cylinder a segment belongs to.
///
/// Left and right are those of an observer at the camera who faces the cylinder with the head towards its +z:
/// with v the direction from the camera to the axis, the right line lies on the side of v × z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ContourKind {
    /// The side line on the observer's left.
    Left,
    /// The side line on the observer's right.
    Right,
    /// The end ellipse at z = -`half_length`.
    BottomRim,
    /// The end ellipse at z = +`half_length`.
    TopRim,
}

/// A straight piece of a contour generator in the world, metres.
///
/// A side line runs from the bottom to the top end of its cylinder; a chord of an end ellipse runs with
/// increasing parameter angle (counterclockwise about +z).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contour {
    /// Which contour this is part of.
    pub kind: ContourKind,
    /// First end point, metres.
    pub start: DVec3,
    /// Second end point, metres.
    pub end: DVec3,
}

/// How a chord of an end ellipse appears to the camera, considering its own cylinder alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum RimAspect {
    /// Either the end face or the lateral surface faces the camera, but not both: part of the silhouette.
    Outline,
    /// Both face the camera: a visible edge inside the silhouette.
    Crease,
    /// Both face away from the camera: hidden by the cylinder itself.
    Hidden,
}

/// A chord of an end ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RimChord {
    /// The chord; its end points lie on the ellipse.
    pub contour: Contour,
    /// How the chord appears to the camera.
    pub aspect: RimAspect,
}

/// The two side lines, left then right. `None` where no plane through the camera touches the lateral surface:
/// the camera looks along the axis from beyond an end, or is inside.
///
/// In the unit frame, with c the camera's (x, y), the tangent points n satisfy |n| = 1 and n·c = 1: n =
/// c/|c|² ∓ sqrt(1 - 1/|c|²) c⊥/|c|, with c⊥ = (-c_y, c_x) pointing to the observer's right.
pub fn side_lines(cylinder: &EllipticCylinder, camera_position: DVec3) -> Option<[Contour; 2]> {
    let camera = camera_in_unit_frame(cylinder, camera_position)?;
    let [left, right] = tangent_points(camera.truncate())?;
    let line = |kind, n: DVec2| Contour {
        kind,
        start: world_from_unit_frame(cylinder, n.extend(-1.0)),
        end: world_from_unit_frame(cylinder, n.extend(1.0)),
    };
    Some([line(ContourKind::Left, left), line(ContourKind::Right, right)])
}

/// Both end ellipses as chords of equal parameter angle, bottom then top; appended to `out`.
///
/// Each ellipse has about `chords` (at least 3) chords. Where the end points of the side lines divide the
/// ellipse into two arcs, each arc is subdivided separately, so the aspect changes exactly at the end of a
/// chord.
pub fn rims(cylinder: &EllipticCylinder, camera_position: DVec3, chords: usize, out: &mut Vec<RimChord>) {
    let Some(camera) = camera_in_unit_frame(cylinder, camera_position) else { return };
    for (kind, z) in [(ContourKind::BottomRim, -1.0), (ContourKind::TopRim, 1.0)] {
        let end_face_visible = camera.z * z > 1.0;
        for arc in arcs(camera.truncate(), chords.max(3)) {
            let aspect = match (end_face_visible, arc.lateral_visible) {
                (true, true) => RimAspect::Crease,
                (false, false) => RimAspect::Hidden,
                _ => RimAspect::Outline,
            };
            let point = |i: usize| {
                let angle = arc.start_rad + arc.sweep_rad * i as f64 / arc.chords as f64;
                world_from_unit_frame(cylinder, DVec2::from_angle(angle).extend(z))
            };
            out.extend(
                (0..arc.chords).map(|i| RimChord {
                    contour: Contour { kind, start: point(i), end: point(i + 1) },
                    aspect,
                }),
            );
        }
    }
}

/// An arc of the unit circle on which the lateral surface faces the camera everywhere, or nowhere.
struct Arc {
    start_rad: f64,
    sweep_rad: f64,
    chords: usize,
    lateral_visible: bool,
}

/// The unit circle divided at the two tangent points seen from c: the near arc, on which n·c > 1, and the far
/// arc. If c is inside the circle, the lateral surface faces away everywhere and the near arc has no chords.
fn arcs(c: DVec2, chords: usize) -> [Arc; 2] {
    let distance = c.length();
    let half_rad = if distance > 1.0 { (1.0 / distance).acos() } else { 0.0 };
    let toward_rad = if distance > 1.0 { c.to_angle() } else { 0.0 };
    let near_share = 2.0 * half_rad / TAU;
    let near_chords = if half_rad > 0.0 { ((near_share * chords as f64).round() as usize).max(1) } else { 0 };
    let near = Arc {
        start_rad: toward_rad - half_rad,
        sweep_rad: 2.0 * half_rad,
        chords: near_chords,
        lateral_visible: true,
    };
    let far = Arc {
        start_rad: toward_rad + half_rad,
        sweep_rad: TAU - 2.0 * half_rad,
        chords: chords - near_chords,
        lateral_visible: false,
    };
    [near, far]
}

/// The camera in the unit frame; `None` for a cylinder that is not a solid.
pub(super) fn camera_in_unit_frame(cylinder: &EllipticCylinder, camera_position: DVec3) -> Option<DVec3> {
    let extents = cylinder.semi_axes.extend(cylinder.half_length);
    extents.cmpgt(DVec3::ZERO).all().then(|| cylinder.cylinder_from_world(camera_position) / extents)
}

fn world_from_unit_frame(cylinder: &EllipticCylinder, point: DVec3) -> DVec3 {
    let extents = cylinder.semi_axes.extend(cylinder.half_length);
    cylinder.world_from_cylinder.transform_point3(point * extents)
}

/// Where the tangents from c touch the unit circle, left then right; `None` if c is inside or on the circle.
fn tangent_points(c: DVec2) -> Option<[DVec2; 2]> {
    let distance_sq = c.length_squared();
    (distance_sq > 1.0).then(|| {
        let toward = c / distance_sq;
        let across = c.perp() * ((distance_sq - 1.0).sqrt() / distance_sq);
        [toward - across, toward + across]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DAffine3, DQuat};
    use proptest::prelude::*;

    fn posed(turn: DVec3, centre: DVec3, semi_axes: DVec2, half_length: f64) -> EllipticCylinder {
        let pose = DAffine3::from_rotation_translation(DQuat::from_scaled_axis(turn), centre);
        EllipticCylinder { world_from_cylinder: pose, semi_axes, half_length }
    }

    fn vector(range: f64) -> impl Strategy<Value = DVec3> {
        [-range..range, -range..range, -range..range].prop_map(DVec3::from)
    }

    fn cylinder() -> impl Strategy<Value = EllipticCylinder> {
        (vector(3.0), vector(1.0), 0.02..0.5, 0.02..0.5, 0.02..1.0)
            .prop_map(|(turn, centre, a, b, h)| posed(turn, centre, DVec2::new(a, b), h))
    }

    #[test]
    fn tangents_of_a_circular_cylinder_make_the_known_angle() {
        let post = posed(DVec3::ZERO, DVec3::ZERO, DVec2::splat(0.5), 2.0);
        let [left, right] = side_lines(&post, DVec3::new(1.0, 0.0, 9.0)).unwrap();
        let y = 0.75_f64.sqrt() * 0.5;
        assert!((left.start - DVec3::new(0.25, -y, -2.0)).length() < 1e-15);
        assert!((left.end - DVec3::new(0.25, -y, 2.0)).length() < 1e-15);
        assert!((right.end - DVec3::new(0.25, y, 2.0)).length() < 1e-15);
    }

    #[test]
    fn no_side_lines_from_within_the_infinite_cylinder_or_of_a_flat_one() {
        let post = posed(DVec3::ZERO, DVec3::ZERO, DVec2::new(0.5, 0.2), 2.0);
        assert!(side_lines(&post, DVec3::new(0.4, 0.0, 9.0)).is_none());
        assert!(side_lines(&post, DVec3::new(0.0, 0.4, 9.0)).is_some());
        let flat = EllipticCylinder { half_length: 0.0, ..post };
        assert!(side_lines(&flat, DVec3::new(0.0, 4.0, 0.0)).is_none());
        let mut chords = Vec::new();
        rims(&flat, DVec3::new(0.0, 4.0, 0.0), 12, &mut chords);
        assert!(chords.is_empty());
    }

    /// Whether the line of sight to a point of the surface does not enter the solid: a step towards the
    /// camera is outside.
    fn is_visible(point: DVec3, cylinder: &EllipticCylinder, camera: DVec3) -> bool {
        !cylinder.contains(point + (camera - point) * 1e-7)
    }

    #[test]
    fn from_beyond_an_end_its_whole_ellipse_is_outline() {
        let post = posed(DVec3::ZERO, DVec3::ZERO, DVec2::new(0.5, 0.2), 2.0);
        let mut chords = Vec::new();
        rims(&post, DVec3::new(0.4, 0.0, 9.0), 12, &mut chords);
        let of =
            |kind, aspect| chords.iter().filter(|c| c.contour.kind == kind && c.aspect == aspect).count();
        assert_eq!(of(ContourKind::TopRim, RimAspect::Outline), 12);
        assert_eq!(of(ContourKind::BottomRim, RimAspect::Hidden), 12);
    }

    proptest! {
        /// The whole solid lies on one side of each plane through the camera and a side line: to the right of
        /// the left line's plane, and vice versa.
        #[test]
        fn side_lines_bound_the_cylinder(k in cylinder(), camera in vector(4.0)) {
            let Some([left, right]) = side_lines(&k, camera) else { return Ok(()) };
            let scale = k.semi_axes.length() * (camera - k.centre()).length() * k.half_length;
            for (line, sign) in [(left, 1.0), (right, -1.0)] {
                let normal = (line.end - line.start).cross(camera - line.start) * sign;
                prop_assert!((line.end - line.start - k.world_from_cylinder.matrix3.z_axis * 2.0 * k.half_length).length() < 1e-12);
                for i in 0..64 {
                    let n = DVec2::from_angle(TAU * f64::from(i) / 64.0);
                    let point = world_from_unit_frame(&k, n.extend(0.0));
                    prop_assert!(normal.dot(point - line.start) > -1e-9 * scale);
                }
            }
        }

        /// The chords close both ellipses and lie on them, and their aspect agrees with the visibility of the
        /// edge.
        #[test]
        fn rims_close_and_know_what_is_seen(k in cylinder(), camera in vector(4.0), count in 3usize..40) {
            prop_assume!(!k.contains(camera));
            let mut chords = Vec::new();
            rims(&k, camera, count, &mut chords);
            for kind in [ContourKind::BottomRim, ContourKind::TopRim] {
                let ring: Vec<_> = chords.iter().filter(|c| c.contour.kind == kind).collect();
                prop_assert_eq!(ring.len(), count);
                for (i, chord) in ring.iter().enumerate() {
                    let next = ring[(i + 1) % ring.len()];
                    prop_assert!((chord.contour.end - next.contour.start).length() < 1e-12);
                    let middle = k.cylinder_from_world((chord.contour.start + chord.contour.end) * 0.5);
                    let angle = (middle.truncate() / k.semi_axes).to_angle();
                    let on_edge = world_from_unit_frame(&k, DVec2::from_angle(angle).extend(middle.z.signum()));
                    prop_assert_eq!(is_visible(on_edge, &k, camera), chord.aspect != RimAspect::Hidden);
                }
            }
        }

        /// The aspect changes where the side lines end.
        #[test]
        fn arcs_end_at_the_side_lines(k in cylinder(), camera in vector(4.0)) {
            let Some(lines) = side_lines(&k, camera) else { return Ok(()) };
            let mut chords = Vec::new();
            rims(&k, camera, 16, &mut chords);
            for corner in lines.iter().flat_map(|l| [l.start, l.end]) {
                let touching = chords.iter().filter(|c| (c.contour.start - corner).length() < 1e-7);
                prop_assert!(touching.count() >= 1);
            }
        }
    }

    /// A round post of radius 1, seen from the side and above its top, at a distance of 2: the third of its
    /// top edge that faces the camera is a crease between two visible faces, the rest is outline. Of its
    /// bottom edge that third is outline and the rest is hidden.
    #[test]
    fn an_edge_between_two_visible_faces_is_a_crease() {
        let post = posed(DVec3::ZERO, DVec3::ZERO, DVec2::ONE, 1.0);
        let mut chords = Vec::new();
        rims(&post, DVec3::new(2.0, 0.0, 3.0), 12, &mut chords);
        for chord in chords {
            let middle = (chord.contour.start + chord.contour.end) * 0.5;
            let is_facing = middle.truncate().to_angle().abs() < std::f64::consts::FRAC_PI_3;
            let expected = match (chord.contour.kind, is_facing) {
                (ContourKind::TopRim, true) => RimAspect::Crease,
                (ContourKind::TopRim, false) | (ContourKind::BottomRim, true) => RimAspect::Outline,
                _ => RimAspect::Hidden,
            };
            assert_eq!(chord.aspect, expected, "{middle}");
        }
    }
}
