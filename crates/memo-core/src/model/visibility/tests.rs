use super::*;
use glam::{DAffine3, DMat3, DQuat, DVec2};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// A cylinder from the centre of one end to that of the other; its x axis is as close to `forward` as
/// possible.
fn limb(bottom: DVec3, top: DVec3, forward: DVec3, a: f64, b: f64) -> EllipticCylinder {
    let z = (top - bottom).normalize();
    let y = z.cross(forward).normalize();
    let pose = DAffine3::from_mat3_translation(DMat3::from_cols(y.cross(z), y, z), (top + bottom) * 0.5);
    let half_length = (top - bottom).length() * 0.5;
    EllipticCylinder { world_from_cylinder: pose, semi_axes: DVec2::new(a, b), half_length }
}

/// A person of 1.8 m walking along +x, with overlapping joints; `swing_rad` moves the right leg and the left
/// arm forward.
pub(in crate::model) fn walker(swing_rad: f64) -> Vec<EllipticCylinder> {
    let down = |angle: f64| DVec3::new(angle.sin(), 0.0, -angle.cos());
    let along = |from: DVec3, angle: f64, length: f64, a: f64, b: f64| {
        limb(from + down(angle) * length, from, DVec3::X, a, b)
    };
    let hip = DVec3::new(0.0, 0.0, 0.93);
    let shoulder = DVec3::new(0.0, 0.0, 1.45);
    let mut parts = vec![
        limb(shoulder + DVec3::Z * 0.05, shoulder + DVec3::Z * 0.35, DVec3::X, 0.10, 0.08),
        limb(hip - DVec3::Z * 0.03, shoulder + DVec3::Z * 0.05, DVec3::X, 0.11, 0.17),
    ];
    for (side, forward) in [(1.0, -swing_rad), (-1.0, swing_rad)] {
        let (arm, leg) = (-0.7 * forward, forward);
        let from = shoulder + DVec3::Y * (0.2 * side);
        let elbow = from + down(arm) * 0.31;
        let wrist = elbow + down(arm + 0.3) * 0.26;
        parts.push(along(from, arm, 0.31, 0.05, 0.045));
        parts.push(along(elbow, arm + 0.3, 0.26, 0.04, 0.035));
        parts.push(along(wrist, arm + 0.3, 0.18, 0.04, 0.02));
        let from = hip + DVec3::Y * (0.09 * side);
        let knee = from + down(leg) * 0.44;
        let ankle = knee + down(leg - 0.25) * 0.43;
        parts.push(along(from, leg, 0.44, 0.085, 0.075));
        parts.push(along(knee, leg - 0.25, 0.43, 0.055, 0.05));
        parts.push(limb(ankle - DVec3::X * 0.06, ankle + DVec3::X * 0.2, DVec3::Z, 0.04, 0.045));
    }
    parts
}

/// Camera positions around the walker, metres.
pub(in crate::model) fn viewpoints() -> Vec<DVec3> {
    let round = (0..12).map(|i| (DVec2::from_angle(i as f64 * TAU / 12.0) * 6.0).extend(1.2));
    round.chain([DVec3::new(0.5, -1.0, 4.0), DVec3::new(1.0, 1.5, 0.1), DVec3::new(0.0, 0.0, 5.0)]).collect()
}

fn scaled(cylinder: &EllipticCylinder, factor: f64) -> EllipticCylinder {
    EllipticCylinder {
        semi_axes: cylinder.semi_axes * factor,
        half_length: cylinder.half_length * factor,
        ..*cylinder
    }
}

/// Whether the line of sight from the camera to a point intersects the solid: ray against slab and quadric.
fn is_hidden(point: DVec3, k: &EllipticCylinder, camera: DVec3) -> bool {
    let (c, p) = (k.cylinder_from_world(camera), k.cylinder_from_world(point));
    let d = p - c;
    let (mut s0, mut s1) = (0.0_f64, 1.0_f64);
    if d.z != 0.0 {
        let (e0, e1) = ((-k.half_length - c.z) / d.z, (k.half_length - c.z) / d.z);
        (s0, s1) = (s0.max(e0.min(e1)), s1.min(e0.max(e1)));
    } else if c.z.abs() > k.half_length {
        return false;
    }
    let (c, d) = (c.truncate() / k.semi_axes, d.truncate() / k.semi_axes);
    let nearest = (-c.dot(d) / d.length_squared()).clamp(s0.min(s1), s1);
    let nearest = if nearest.is_nan() { s0 } else { nearest };
    s0 <= s1 && (c + d * nearest).length_squared() <= 1.0
}

/// Compares visibility at regular samples, except within 1e-6 of the size of the surface from a change.
fn check_against_samples(start: DVec3, end: DVec3, k: &EllipticCylinder, camera: DVec3) {
    let hidden = hidden_interval(start, end, k, camera);
    let (smaller, larger) = (scaled(k, 1.0 - 1e-6), scaled(k, 1.0 + 1e-6));
    for i in 0..=200 {
        let t = i as f64 / 200.0;
        let point = start.lerp(end, t);
        let ours = hidden.is_some_and(|(t0, t1)| t0 <= t && t <= t1);
        if is_hidden(point, &smaller, camera) {
            assert!(ours, "{hidden:?} misses the hidden t = {t}");
        } else if !is_hidden(point, &larger, camera) {
            assert!(!ours, "{hidden:?} contains the visible t = {t}");
        }
    }
}

fn upright(a: f64, b: f64, half_length: f64) -> EllipticCylinder {
    EllipticCylinder { world_from_cylinder: DAffine3::IDENTITY, semi_axes: DVec2::new(a, b), half_length }
}

fn visible(cylinders: &[EllipticCylinder], camera: DVec3) -> Vec<VisibleSegment> {
    let mut out = Vec::new();
    visible_contours(cylinders, camera, &VisibilityOptions::default(), &mut out);
    out
}

fn vector(range: f64) -> impl Strategy<Value = DVec3> {
    [-range..range, -range..range, -range..range].prop_map(DVec3::from)
}

/// Coordinates on a coarse grid: tangent, coplanar, collinear and coincident draws are frequent.
fn grid_vector() -> impl Strategy<Value = DVec3> {
    [-4..=4i32, -4..=4i32, -4..=4i32].prop_map(|v| DVec3::from(v.map(|x| f64::from(x) * 0.5)))
}

fn cylinder() -> impl Strategy<Value = EllipticCylinder> {
    (vector(0.5), vector(3.0), 0.02..0.6, 0.02..0.6, 0.02..0.8).prop_map(|(centre, turn, a, b, h)| {
        EllipticCylinder {
            world_from_cylinder: DAffine3::from_rotation_translation(DQuat::from_scaled_axis(turn), centre),
            semi_axes: DVec2::new(a, b),
            half_length: h,
        }
    })
}

/// The hidden interval of a segment along y, behind or in a post of radius 1 and half length 1, seen from x =
/// 2.
#[test]
fn a_post_hides_the_tangents_chord() {
    let post = upright(1.0, 1.0, 1.0);
    let camera = DVec3::new(2.0, 0.0, 0.0);
    let hidden = |x: f64, z: f64| {
        let (start, end) = (DVec3::new(x, -10.0, z), DVec3::new(x, 10.0, z));
        hidden_interval(start, end, &post, camera).map(|(t0, t1)| (20.0 * t0 - 10.0, 20.0 * t1 - 10.0))
    };
    // Behind: the tangent planes make an angle of 30 degrees with the line of sight.
    let (y0, y1) = hidden(-1.0, 0.0).unwrap();
    let expected = 3.0 / 3.0_f64.sqrt();
    assert!((y0 + expected).abs() < 1e-7 && (y1 - expected).abs() < 1e-7);
    // Through the body before the tangent points (at x = 1/2): the chord of the circle.
    let (y0, y1) = hidden(0.8, 0.0).unwrap();
    assert!((y0 + 0.6).abs() < 1e-7 && (y1 - 0.6).abs() < 1e-7);
    // In front, and beside the camera.
    assert_eq!(hidden(1.5, 0.0), None);
    assert_eq!(hidden(3.0, 0.0), None);
    // Four times as far as the near side: the shadow ends at z = 4; from the far side it ends at z = 4/3.
    assert_eq!(hidden(-2.0, 4.1), None);
    assert!(hidden(-2.0, 3.9).is_some());
    // Above the shadow of the near side only the end ellipse bounds the hidden set: (s y)² + (2 - 4 s)² = 1
    // with s = 1/z.
    let (y0, y1) = hidden(-2.0, 3.0).unwrap();
    let expected = 3.0 * (1.0 - (2.0 - 4.0 / 3.0_f64).powi(2)).sqrt();
    assert!((y0 + expected).abs() < 1e-6 && (y1 - expected).abs() < 1e-6, "{y0} {y1} {expected}");
}

#[test]
fn from_beyond_an_end_only_the_cone_over_it_hides() {
    let post = upright(1.0, 1.0, 1.0);
    let camera = DVec3::new(0.0, 0.0, 3.0);
    assert!(side_lines(&post, camera).is_none());
    let hidden = |z: f64| {
        let hidden = hidden_interval(DVec3::new(-5.0, 0.0, z), DVec3::new(5.0, 0.0, z), &post, camera);
        hidden.map(|(t0, t1)| (10.0 * t0 - 5.0, 10.0 * t1 - 5.0))
    };
    assert_eq!(hidden(1.5), None);
    for (z, radius) in [(0.999, 1.0005), (0.0, 1.5), (-1.0, 2.0), (-3.0, 3.0)] {
        let (x0, x1) = hidden(z).unwrap();
        assert!((x0 + radius).abs() < 1e-7 && (x1 - radius).abs() < 1e-7);
    }
    // Down the axis: hidden from the end face on.
    let (t0, t1) = hidden_interval(DVec3::Z * 4.0, DVec3::Z * -1.0, &post, camera).unwrap();
    assert!((t0 - 0.6).abs() < 1e-8 && t1 == 1.0);
}

#[test]
fn a_segment_through_the_camera_is_hidden_on_one_side_only() {
    let post = upright(1.0, 1.0, 1.0);
    let camera = DVec3::new(2.0, 0.0, 0.0);
    let along = |end: DVec3| hidden_interval(camera - (end - camera), end, &post, camera);
    let (t0, t1) = along(DVec3::new(-2.0, 0.0, 0.0)).unwrap();
    assert!((t0 - 0.625).abs() < 1e-8 && t1 == 1.0);
    assert_eq!(along(DVec3::new(2.0, 3.0, 0.0)), None);
    // Half of the segment is behind the camera and passes beside it: it is hidden on the side of the post,
    // from the tangent plane on.
    let (start, end) = (DVec3::new(-4.0, 0.0, 0.0), DVec3::new(8.0, 1e-3, 0.0));
    let (t0, t1) = hidden_interval(start, end, &post, camera).unwrap();
    assert!(t0 == 0.0 && t1 > 0.25 && t1 < 0.5, "{t1}");
}

#[test]
fn a_point_is_hidden_wholly_or_not() {
    let post = upright(1.0, 1.0, 1.0);
    let camera = DVec3::new(2.0, 0.0, 0.5);
    let point = |p: DVec3| hidden_interval(p, p, &post, camera);
    assert_eq!(point(DVec3::new(-3.0, 0.5, 0.0)), Some((0.0, 1.0)));
    assert_eq!(point(DVec3::ZERO), Some((0.0, 1.0)));
    assert_eq!(point(DVec3::new(1.5, 0.0, 0.0)), None);
    assert_eq!(point(DVec3::new(0.0, 2.0, 0.0)), None);
    assert_eq!(point(camera), None);
}

#[test]
fn contact_does_not_hide() {
    let camera = DVec3::new(3.0, 1.0, 0.3);
    let post = upright(1.0, 0.5, 1.0);
    let raised =
        |z: f64| EllipticCylinder { world_from_cylinder: DAffine3::from_translation(DVec3::Z * z), ..post };
    // In a row, touching or overlapping: the common contour stays visible.
    for step in [2.0, 1.5] {
        let length: f64 =
            visible(&[raised(step), post], camera).iter().map(|s| (s.end - s.start).length()).sum();
        assert!((length - 8.0).abs() < 1e-6, "{length}");
    }
    // A line across an end face, seen from above.
    let camera = DVec3::new(0.3, 2.0, 4.0);
    assert_eq!(hidden_interval(DVec3::new(-2.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 1.0), &post, camera), None);
}

#[test]
fn one_part_shows_both_lines_and_a_hidden_part_none() {
    let camera = DVec3::new(5.0, 0.0, 0.0);
    let small = EllipticCylinder {
        world_from_cylinder: DAffine3::from_translation(DVec3::X * -3.0),
        ..upright(0.2, 0.2, 0.2)
    };
    let lines = visible(&[small], camera);
    assert_eq!(lines.iter().map(|s| s.kind).collect::<Vec<_>>(), [ContourKind::Left, ContourKind::Right]);
    // Looking along -x with z up, left is -y.
    assert!(lines[0].start.y < 0.0 && lines[1].start.y > 0.0 && lines[0].start.z < lines[0].end.z);
    let lines = visible(&[small, upright(1.0, 1.0, 1.0)], camera);
    assert!(lines.len() == 2 && lines.iter().all(|s| s.part == 1));
    // A part inside another part is hidden; a part that sticks out is visible outside.
    let inner = upright(0.3, 0.3, 2.0);
    let lines = visible(&[inner, upright(1.0, 1.0, 1.0)], camera);
    assert_eq!(lines.iter().filter(|s| s.part == 0).count(), 4);
    assert!(lines.iter().filter(|s| s.part == 0).all(|s| (s.start.z * s.end.z) > 1.0));
}

#[test]
fn nothing_is_visible_from_inside_and_a_flat_part_is_ignored() {
    let bodies = walker(0.4);
    assert!(visible(&bodies, bodies[1].centre()).is_empty());
    let camera = DVec3::new(1.0, -6.0, 1.0);
    let mut with_flat = bodies.clone();
    with_flat.push(upright(10.0, 0.0, 10.0));
    with_flat.push(upright(f64::NAN, 1.0, 10.0));
    assert_eq!(visible(&with_flat, camera), visible(&bodies, camera));
    assert!(visible(&[], camera).is_empty());
}

/// A camera in the plane of an end, up to rounding: the cone over that end is flat.
#[test]
fn from_the_plane_of_an_end_the_other_end_and_the_side_hide() {
    let post = upright(0.5, 1.0, 0.5);
    for (camera, p, q) in [
        ([0.5, 2.0, 0.5], [-0.5, 1.0, 1.5], [1.0, 0.0, -1.0]),
        ([-2.0, -1.0, 0.5], [1.0, 1.5, -0.5], [-2.0, -1.5, 1.5]),
        ([-0.5, 1.5, 0.5], [2.0, 1.5, -2.0], [-1.5, -1.5, 1.5]),
        ([-1.0, 1.5, 0.5], [0.0, 0.0, 0.0], [0.0, 0.0, 0.5]),
    ] {
        let (camera, p, q) = (DVec3::from(camera), DVec3::from(p), DVec3::from(q));
        assert!(hidden_interval(p, q, &post, camera).is_some());
        for shift in [0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-10, -1e-10, 1e-8, -1e-8] {
            check_against_samples(p, q, &post, camera + DVec3::Z * shift);
        }
    }
}

#[test]
fn memory_kept_between_views_changes_nothing() {
    let (mut view, mut out) = (PreparedView::default(), Vec::new());
    for rims in [true, false] {
        let options = VisibilityOptions { rims, ..VisibilityOptions::default() };
        for (i, camera) in viewpoints().into_iter().enumerate() {
            let bodies = &walker(0.5)[..14 - i % 3];
            let mut fresh = Vec::new();
            visible_contours(bodies, camera, &options, &mut fresh);
            view.visible_contours(bodies, camera, &options, &mut out);
            assert_eq!(out, fresh);
        }
    }
}

/// No point of a visible chord of an end ellipse is hidden by another part or by its own.
#[test]
fn visible_end_ellipses_are_hidden_by_nothing() {
    let options = VisibilityOptions { rims: true, rim_chords: 64 };
    let mut out = Vec::new();
    for camera in viewpoints() {
        let bodies = walker(0.3);
        visible_contours(&bodies, camera, &options, &mut out);
        let is_rim = |s: &&VisibleSegment| matches!(s.kind, ContourKind::BottomRim | ContourKind::TopRim);
        assert!(out.iter().filter(is_rim).count() > 200);
        for segment in out.iter().filter(is_rim) {
            let point = segment.start.lerp(segment.end, 0.5);
            // A chord lies inside its ellipse by up to 0.13 % of the semi-axis.
            assert!(bodies.iter().enumerate().all(|(part, k)| {
                !is_hidden(point, &scaled(k, if part == segment.part { 0.995 } else { 1.0 - 1e-9 }), camera)
            }));
        }
    }
}

/// On every contour of a walker, the visible length is that of the points that no other part hides.
#[test]
fn walker_agrees_with_samples() {
    for (swing, camera) in viewpoints().iter().enumerate().map(|(i, c)| (0.1 * i as f64 - 0.6, c)) {
        let bodies = walker(swing);
        let segments = visible(&bodies, *camera);
        for (part, body) in bodies.iter().enumerate() {
            for line in side_lines(body, *camera).iter().flatten() {
                let own = segments.iter().filter(|s| s.part == part && s.kind == line.kind);
                let length: f64 = own.map(|s| (s.end - s.start).length()).sum();
                let shown = (0..1000).filter(|i| {
                    let point = line.start.lerp(line.end, (*i as f64 + 0.5) / 1000.0);
                    (0..bodies.len()).all(|j| j == part || !is_hidden(point, &bodies[j], *camera))
                });
                let expected = shown.count() as f64 / 1000.0 * (line.end - line.start).length();
                assert!((length - expected).abs() < 4e-3 * (line.end - line.start).length());
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn interval_agrees_with_samples(k in cylinder(), camera in vector(3.0), p in vector(2.0), q in vector(2.0)) {
        check_against_samples(p, q, &k, camera);
    }

    #[test]
    fn interval_agrees_with_samples_far_away(k in cylinder(), toward in vector(1.0), p in vector(0.6), q in vector(0.6)) {
        prop_assume!(toward.length() > 0.1);
        let camera = toward.normalize() * 30.0;
        check_against_samples(p - toward * 0.5, q - toward * 0.5, &k, camera);
    }

    #[test]
    fn interval_agrees_with_samples_on_a_grid(camera in grid_vector(), p in grid_vector(), q in grid_vector()) {
        check_against_samples(p, q, &upright(0.5, 1.0, 0.5), camera);
    }

    /// The visible pieces are the complement of the hidden intervals of all other parts, each computed alone.
    #[test]
    fn visible_pieces_are_what_no_part_hides(
        bodies in proptest::collection::vec(cylinder().prop_map(|k| scaled(&k, 0.5)), 1..9),
        camera in vector(0.8),
    ) {
        let segments = visible(&bodies, camera);
        let inside = bodies.iter().any(|k| k.contains(camera));
        for (part, body) in bodies.iter().enumerate().filter(|_| !inside) {
            for line in side_lines(body, camera).iter().flatten() {
                let own: Vec<_> = segments.iter().filter(|s| s.part == part && s.kind == line.kind).collect();
                let others = bodies.iter().enumerate().filter(|(j, _)| *j != part);
                let hidden: Vec<_> = others
                    .filter_map(|(_, k)| hidden_interval(line.start, line.end, k, camera))
                    .collect();
                let along = line.end - line.start;
                for i in 0..50 {
                    let t = (f64::from(i) + 0.5) / 50.0;
                    let place = |p: DVec3| (p - line.start).dot(along) / along.length_squared();
                    let is_shown = own.iter().any(|s| place(s.start) <= t && t <= place(s.end));
                    prop_assert_eq!(is_shown, !hidden.iter().any(|&(t0, t1)| t0 <= t && t <= t1));
                }
            }
        }
        prop_assert!(!inside || segments.is_empty());
    }

    #[test]
    fn a_side_line_is_not_hidden_by_its_own_cylinder(k in cylinder(), camera in vector(4.0)) {
        for line in side_lines(&k, camera).iter().flatten() {
            let length = hidden_interval(line.start, line.end, &k, camera).map_or(0.0, |(t0, t1)| t1 - t0);
            prop_assert!(length < 1e-9, "{length}");
        }
    }
}
