//! An independent judge of the hidden-line removal: rays instead of intervals.
//!
//! A point of a side line is hidden when the segment from the camera to it meets the interior of another
//! cylinder. Here that is decided point by point with the analytic intersection of a ray and a solid
//! cylinder, on random articulated bodies seen from everywhere. The ends of the visible pieces are refined by
//! bisection, so the reported length on which the two disagree is not rounded to the sampling. A piece hidden
//! between two samples of the oracle and unknown to the code under test too goes unseen in that length; the
//! samples are jittered, so their own count of disagreements has no such blind spot on average.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3};
use memo_core::model::{
    ContourKind, EllipticCylinder, VisibilityOptions, VisibleSegment, side_lines, visible_contours,
};

const POSTURES: u64 = 1000;
const SAMPLES: usize = 400;
/// Of the summed length.
const MAX_DISAGREEMENT: f64 = 1e-4;
/// On any one line: the sum alone would forgive a few lines that are wholly wrong.
const MAX_ON_ONE_LINE_M: f64 = 1e-3;

// The oracle

/// A side line of one part, as the oracle finds it.
#[derive(Debug, Clone, Copy)]
struct SideLine {
    part: usize,
    start: DVec3,
    end: DVec3,
}

impl SideLine {
    fn at(&self, s: f64) -> DVec3 {
        self.start.lerp(self.end, s)
    }

    fn length(&self) -> f64 {
        self.start.distance(self.end)
    }

    /// Position along the line in [0, 1] and distance from it.
    fn locate(&self, point: DVec3) -> (f64, f64) {
        let direction = self.end - self.start;
        let s = (point - self.start).dot(direction) / direction.length_squared();
        (s, self.at(s).distance(point))
    }
}

/// The two lines along which planes through the camera touch the cylinder, `None` from within its endless
/// extension.
///
/// In the cylinder's frame the outward normal at (a cos θ, b sin θ) is (cos θ / a, sin θ / b); it faces the
/// camera c where g(θ) = cx cos θ / a + cy sin θ / b - 1 > 0. The tangent lines are the two zeros on either
/// side of g's maximum.
fn tangent_lines(part: usize, cylinder: &EllipticCylinder, camera: DVec3) -> Option<[SideLine; 2]> {
    let c = cylinder.world_from_cylinder.inverse().transform_point3(camera);
    let (a, b) = cylinder.semi_axes.into();
    let facing = |angle: f64| c.x * angle.cos() / a + c.y * angle.sin() / b - 1.0;
    let nearest = maximum(facing);
    if facing(nearest) <= 0.0 {
        return None;
    }
    Some([-PI, PI].map(|turn| {
        let angle = boundary(nearest, nearest + turn, |angle| facing(angle) > 0.0);
        let end = |z: f64| {
            cylinder.world_from_cylinder.transform_point3(DVec3::new(a * angle.cos(), b * angle.sin(), z))
        };
        SideLine { part, start: end(-cylinder.half_length), end: end(cylinder.half_length) }
    }))
}

/// Where a function of one sinusoid is largest: the best of 16 angles, refined by ternary search.
fn maximum(f: impl Fn(f64) -> f64) -> f64 {
    let coarse = (0..16).map(|k| TAU * f64::from(k) / 16.0);
    let best = coarse.max_by(|x, y| f(*x).total_cmp(&f(*y))).unwrap_or(0.0);
    let (mut low, mut high) = (best - TAU / 16.0, best + TAU / 16.0);
    for _ in 0..50 {
        let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if f(left) < f(right) { low = left } else { high = right }
    }
    0.5 * (low + high)
}

/// The place between `inside` (where the predicate holds) and `outside` (where it does not) at which it
/// changes.
fn boundary(mut inside: f64, mut outside: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = 0.5 * (inside + outside);
        if holds(middle) { inside = middle } else { outside = middle }
    }
    0.5 * (inside + outside)
}

/// Whether the segment meets the interior of x² + y² <= 1, |z| <= 1.
fn meets_unit_cylinder(from: DVec3, to: DVec3) -> bool {
    let d = to - from;
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    // Lateral surface: A t² + 2 B t + C < 0.
    let (a, b) = (d.x * d.x + d.y * d.y, from.x * d.x + from.y * d.y);
    let c = from.x * from.x + from.y * from.y - 1.0;
    if a > 0.0 {
        let discriminant = b * b - a * c;
        if discriminant <= 0.0 {
            return false;
        }
        let q = -(b + discriminant.sqrt().copysign(b));
        let (t0, t1) = (q / a, c / q);
        enter = enter.max(t0.min(t1));
        leave = leave.min(t0.max(t1));
    } else if c >= 0.0 {
        return false;
    }
    // End caps: -1 < z < 1.
    if d.z != 0.0 {
        let (t0, t1) = ((-1.0 - from.z) / d.z, (1.0 - from.z) / d.z);
        enter = enter.max(t0.min(t1));
        leave = leave.min(t0.max(t1));
    } else if from.z.abs() >= 1.0 {
        return false;
    }
    enter < leave
}

/// What one other part can do to one side line, in the frame in which that part is the unit cylinder.
struct Occluder {
    camera: DVec3,
    start: DVec3,
    end: DVec3,
}

impl Occluder {
    fn new(cylinder: &EllipticCylinder, camera: DVec3, line: &SideLine) -> Self {
        let to_unit = cylinder.world_from_cylinder.inverse();
        let size = cylinder.semi_axes.extend(cylinder.half_length);
        let map = |p: DVec3| to_unit.transform_point3(p) / size;
        Self { camera: map(camera), start: map(line.start), end: map(line.end) }
    }

    fn hides(&self, s: f64) -> bool {
        meets_unit_cylinder(self.camera, self.start.lerp(self.end, s))
    }
}

/// The other parts as occluders of a line.
fn occluders(parts: &[EllipticCylinder], camera: DVec3, line: &SideLine) -> Vec<Occluder> {
    let others = parts.iter().enumerate().filter(|(i, _)| *i != line.part);
    others.map(|(_, cylinder)| Occluder::new(cylinder, camera, line)).collect()
}

/// The intervals of [0, 1] on which the predicate holds, given its values at the places and bisected between
/// them.
fn intervals_where(places: &[f64], values: &[bool], holds: impl Fn(f64) -> bool) -> Vec<[f64; 2]> {
    let mut intervals = Vec::new();
    let mut since = values[0].then_some(places[0]);
    for (place, value) in places.windows(2).zip(values.windows(2)) {
        match since {
            None if value[1] => since = Some(boundary(place[1], place[0], &holds)),
            Some(start) if !value[1] => {
                intervals.push([start, boundary(place[0], place[1], &holds)]);
                since = None;
            }
            _ => {}
        }
    }
    intervals.extend(since.map(|start| [start, places[places.len() - 1]]));
    intervals
}

fn measure(intervals: &[[f64; 2]]) -> f64 {
    intervals.iter().map(|[from, to]| to - from).sum()
}

fn overlap(left: &[[f64; 2]], right: &[[f64; 2]]) -> f64 {
    let shared = |l: &[f64; 2], r: &[f64; 2]| (l[1].min(r[1]) - l[0].max(r[0])).max(0.0);
    left.iter().flat_map(|l| right.iter().map(move |r| shared(l, r))).sum()
}

// The comparison

/// Lengths summed over side lines, metres, and counts of samples.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    length_m: f64,
    visible_m: f64,
    disagreement_m: f64,
    worst_line_m: f64,
    samples: usize,
    disagreeing_samples: usize,
}

impl Tally {
    fn fraction(&self) -> f64 {
        self.disagreement_m / self.length_m
    }

    fn report(&self) -> String {
        let Self { length_m, worst_line_m, disagreeing_samples, samples, .. } = self;
        format!(
            "{length_m:.0} m of side lines, {:.1} % visible, disagreement {:.3e} of the length, \
             worst line {worst_line_m:.3e} m, {disagreeing_samples} of {samples} samples",
            100.0 * self.visible_m / length_m,
            self.fraction(),
        )
    }

    fn add_line(&mut self, length_m: f64, oracle: &[[f64; 2]], claimed: &[[f64; 2]]) {
        let difference = measure(oracle) + measure(claimed) - 2.0 * overlap(oracle, claimed);
        self.length_m += length_m;
        self.visible_m += length_m * measure(oracle);
        self.disagreement_m += length_m * difference;
        self.worst_line_m = self.worst_line_m.max(length_m * difference);
    }

    /// Counts the samples where the claim differs, rounding at the ends of the claimed pieces aside.
    fn add_samples(&mut self, places: &[f64], values: &[bool], claimed: &[[f64; 2]]) {
        let is_claimed = |s: f64| claimed.iter().any(|[from, to]| (*from..=*to).contains(&s));
        let is_end = |s: f64| claimed.iter().flatten().any(|end| (end - s).abs() < 1e-9);
        let wrong = places.iter().zip(values).filter(|(s, v)| **v != is_claimed(**s) && !is_end(**s));
        self.samples += places.len();
        self.disagreeing_samples += wrong.count();
    }
}

/// Compares claimed visible segments of one view with the rays.
fn compare(
    parts: &[EllipticCylinder],
    camera: DVec3,
    claims: &[VisibleSegment],
    draw: &mut Draw,
    tally: &mut Tally,
) {
    let mut judged = 0;
    for line in all_tangent_lines(parts, camera) {
        let claimed = claimed_intervals(claims, &line);
        let occluders = occluders(parts, camera, &line);
        let visible = |s: f64| !occluders.iter().any(|o| o.hides(s));
        let places = sample_places(&claimed, draw);
        let values: Vec<bool> = places.iter().map(|s| visible(*s)).collect();
        tally.add_line(line.length(), &intervals_where(&places, &values, visible), &claimed);
        tally.add_samples(&places, &values, &claimed);
        judged += claimed.len();
    }
    assert_eq!(judged, claims.len(), "segments on none of the tangent lines of their parts");
}

fn all_tangent_lines(parts: &[EllipticCylinder], camera: DVec3) -> Vec<SideLine> {
    let lines = parts.iter().enumerate().filter_map(|(i, part)| tangent_lines(i, part, camera));
    lines.flatten().collect()
}

/// Jittered samples, the middle of every claimed piece and gap, however small, and both ends of the line.
fn sample_places(claimed: &[[f64; 2]], draw: &mut Draw) -> Vec<f64> {
    let mut ends: Vec<f64> = claimed.iter().flatten().copied().chain([0.0, 1.0]).collect();
    ends.sort_by(f64::total_cmp);
    let mut places: Vec<f64> = ends.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    places.extend((0..SAMPLES).map(|k| (k as f64 + draw.between(0.0, 1.0)) / SAMPLES as f64));
    places.extend([0.0, 1.0]);
    places.sort_by(f64::total_cmp);
    places
}

/// The claims about one line as sorted intervals of [0, 1]; they must lie on it and not overlap.
fn claimed_intervals(claims: &[VisibleSegment], line: &SideLine) -> Vec<[f64; 2]> {
    let on_line = |p: DVec3| line.locate(p).1 < 1e-8;
    let mine = claims
        .iter()
        .filter(|c| is_side(c.kind) && c.part == line.part && on_line(c.start) && on_line(c.end));
    let ends = mine.map(|c| [line.locate(c.start).0, line.locate(c.end).0]);
    let mut intervals: Vec<[f64; 2]> = ends.map(|[s, e]| [s.min(e), s.max(e)]).collect();
    intervals.sort_by(|l, r| l[0].total_cmp(&r[0]));
    assert!(
        intervals.iter().flatten().all(|s| (-1e-9..=1.0 + 1e-9).contains(s)),
        "beyond the line: {intervals:?}"
    );
    assert!(intervals.windows(2).all(|w| w[1][0] >= w[0][1] - 1e-9), "overlapping pieces: {intervals:?}");
    intervals
}

fn is_side(kind: ContourKind) -> bool {
    matches!(kind, ContourKind::Left | ContourKind::Right)
}

// Scenes

/// Seeded numbers (SplitMix64).
struct Draw(u64);

impl Draw {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn degrees(&mut self, low: f64, high: f64) -> f64 {
        self.between(low, high).to_radians()
    }
}

/// A body under construction; limbs hang along -z of their axes, x is forward, y left.
struct Body<'a> {
    draw: &'a mut Draw,
    height_m: f64,
    parts: Vec<EllipticCylinder>,
}

impl Body<'_> {
    /// Adds a limb below a joint, lengths as fractions of the height, and returns its far end.
    fn hang(&mut self, joint: DVec3, axes: DMat3, length: f64, semi_axes: [f64; 2]) -> DVec3 {
        let length_m = length * self.height_m;
        let girth = DVec2::new(self.draw.between(0.7, 1.3), self.draw.between(0.7, 1.3));
        self.parts.push(EllipticCylinder {
            world_from_cylinder: DAffine3::from_mat3_translation(
                axes,
                joint - axes.z_axis * (0.5 * length_m),
            ),
            semi_axes: DVec2::from(semi_axes) * girth * self.height_m,
            half_length: 0.5 * length_m * self.draw.between(0.95, 1.1),
        });
        joint - axes.z_axis * length_m
    }

    fn add_arm(&mut self, shoulder: DVec3, trunk: DMat3, side: f64) {
        let d = &mut *self.draw;
        let upper = trunk
            * DMat3::from_rotation_y(-d.degrees(-60.0, 170.0))
            * DMat3::from_rotation_x(side * d.degrees(0.0, 90.0))
            * DMat3::from_rotation_z(d.degrees(-60.0, 60.0));
        let fore = upper * DMat3::from_rotation_y(-d.degrees(0.0, 145.0));
        let hand = fore
            * DMat3::from_rotation_y(d.degrees(-60.0, 60.0))
            * DMat3::from_rotation_x(d.degrees(-20.0, 20.0));
        let elbow = self.hang(shoulder, upper, 0.19, [0.030, 0.028]);
        let wrist = self.hang(elbow, fore, 0.15, [0.024, 0.020]);
        self.hang(wrist, hand, 0.10, [0.010, 0.022]);
    }

    fn add_leg(&mut self, hip: DVec3, trunk: DMat3, side: f64) {
        let d = &mut *self.draw;
        let thigh = trunk
            * DMat3::from_rotation_y(-d.degrees(-25.0, 110.0))
            * DMat3::from_rotation_x(side * d.degrees(-15.0, 40.0));
        let shank = thigh * DMat3::from_rotation_y(d.degrees(0.0, 130.0));
        let foot = shank * DMat3::from_rotation_y(-d.degrees(60.0, 130.0));
        let knee = self.hang(hip, thigh, 0.245, [0.048, 0.045]);
        let ankle = self.hang(knee, shank, 0.246, [0.032, 0.030]);
        self.hang(ankle, foot, 0.12, [0.020, 0.026]);
    }
}

/// Torso, head, and three parts for each arm and leg, in a random posture near the origin.
fn random_body(draw: &mut Draw) -> Vec<EllipticCylinder> {
    let height_m = draw.between(1.5, 1.95);
    let pelvis = DVec3::new(draw.between(-0.3, 0.3), draw.between(-0.3, 0.3), 0.53 * height_m);
    let trunk = DMat3::from_rotation_z(draw.degrees(-180.0, 180.0))
        * DMat3::from_rotation_y(draw.degrees(-20.0, 30.0))
        * DMat3::from_rotation_x(draw.degrees(-15.0, 15.0));
    let head = trunk * DMat3::from_rotation_y(draw.degrees(-40.0, 50.0));
    let neck = pelvis + trunk.z_axis * (0.29 * height_m);

    let mut body = Body { draw, height_m, parts: Vec::with_capacity(14) };
    body.hang(neck, trunk, 0.29, [0.065, 0.100]);
    body.hang(neck + head.z_axis * (0.18 * height_m), head, 0.15, [0.055, 0.045]);
    for side in [-1.0, 1.0] {
        body.add_arm(neck + trunk * DVec3::new(0.0, side * 0.11, -0.03) * height_m, trunk, side);
        body.add_leg(pelvis + trunk * DVec3::new(0.0, side * 0.05, 0.0) * height_m, trunk, side);
    }
    body.parts
}

/// Anywhere around the origin, 0.8 to 30 m away, 0.2 to 6 m high; near cameras as frequent as far ones.
fn random_camera(draw: &mut Draw) -> DVec3 {
    let distance = draw.between(0.8_f64.ln(), 30.0_f64.ln()).exp();
    let (sin, cos) = draw.between(0.0, TAU).sin_cos();
    DVec3::new(distance * cos, distance * sin, draw.between(0.2, 6.0))
}

fn random_scene(seed: u64) -> (Vec<EllipticCylinder>, DVec3, Draw) {
    let mut draw = Draw(seed.wrapping_mul(0x2545_f491_4f6c_dd1d));
    let parts = random_body(&mut draw);
    let camera = random_camera(&mut draw);
    (parts, camera, draw)
}

fn side_segments(parts: &[EllipticCylinder], camera: DVec3) -> Vec<VisibleSegment> {
    let mut segments = Vec::new();
    let options = VisibilityOptions { rims: false, ..VisibilityOptions::default() };
    visible_contours(parts, camera, &options, &mut segments);
    segments
}

// The code under test against the oracle

#[test]
fn visible_lengths_agree_with_rays_on_random_bodies() {
    let mut tally = Tally::default();
    for seed in 0..POSTURES {
        let (parts, camera, mut draw) = random_scene(seed);
        let segments = side_segments(&parts, camera);
        assert!(segments.iter().all(|s| is_side(s.kind)), "an end ellipse without being asked for");
        compare(&parts, camera, &segments, &mut draw, &mut tally);
    }
    println!("{POSTURES} views: {}", tally.report());
    assert!((0.2..0.9).contains(&(tally.visible_m / tally.length_m)), "scenes that test nothing: {tally:?}");
    assert!(tally.fraction() < MAX_DISAGREEMENT && tally.worst_line_m < MAX_ON_ONE_LINE_M, "{tally:?}");
    assert!((tally.disagreeing_samples as f64) < MAX_DISAGREEMENT * tally.samples as f64, "{tally:?}");
}

#[test]
fn visible_lengths_agree_with_rays_among_parallels() {
    let mut tally = Tally::default();
    for seed in 0..200 {
        let mut draw = Draw(seed);
        let parts: Vec<_> = (0..8).map(|_| cylinder_on_grid(&mut draw)).collect();
        let camera = [3.0, 3.0, 1.5].map(|reach| on_grid(&mut draw, reach)).into();
        compare(&parts, camera, &side_segments(&parts, camera), &mut draw, &mut tally);
    }
    println!("200 views along the grid: {}", tally.report());
    assert!(tally.fraction() < MAX_DISAGREEMENT, "{tally:?}");
}

/// Axes along x, y or z and sizes and places in whole decimetres: rays parallel to axes, lines parallel to
/// ends.
fn cylinder_on_grid(draw: &mut Draw) -> EllipticCylinder {
    let axis = [DVec3::X, DVec3::Y, DVec3::Z][draw.between(0.0, 3.0) as usize];
    let centre = [1.0; 3].map(|reach| on_grid(draw, reach) + draw.between(-1e-7, 1e-7));
    let semi_axes = [0.4; 2].map(|reach| 0.1 + on_grid(draw, reach).abs());
    along(axis, centre, semi_axes, 0.2 + on_grid(draw, 0.8).abs())
}

fn on_grid(draw: &mut Draw, reach: f64) -> f64 {
    (draw.between(-reach, reach) * 10.0).round() / 10.0
}

#[test]
fn every_segment_lies_on_a_tangent_line_of_its_kind() {
    for seed in 0..200 {
        let (parts, camera, _) = random_scene(seed);
        for segment in side_segments(&parts, camera) {
            let contours =
                side_lines(&parts[segment.part], camera).expect("a visible line of a part without lines");
            let own = contours.iter().find(|c| c.kind == segment.kind).expect("the kind exists");
            let line = SideLine { part: segment.part, start: own.start, end: own.end };
            for point in [segment.start, segment.end] {
                assert!(line.locate(point).1 < 1e-9, "seed {seed}: {segment:?} off {own:?}");
            }
        }
    }
}

#[test]
fn tangent_lines_agree_with_the_search() {
    let mut worst = 0.0_f64;
    for seed in 0..POSTURES {
        let (parts, camera, _) = random_scene(seed);
        for (i, part) in parts.iter().enumerate() {
            let (searched, closed) = (tangent_lines(i, part, camera), side_lines(part, camera));
            assert_eq!(searched.is_some(), closed.is_some(), "seed {seed} part {i}");
            let (Some(searched), Some(closed)) = (searched, closed) else { continue };
            assert!(closed.iter().all(|c| is_side(c.kind)) && closed[0].kind != closed[1].kind);
            worst = worst.max(pair_distance(&searched, &closed.map(|c| [c.start, c.end])));
        }
    }
    println!("tangent lines: largest distance between end points {worst:.2e} m");
    assert!(worst < 1e-9, "{worst:e}");
}

/// Largest distance between corresponding end points of two pairs of lines, order and direction left open.
fn pair_distance(lines: &[SideLine; 2], ends: &[[DVec3; 2]; 2]) -> f64 {
    let apart = |l: &SideLine, e: &[DVec3; 2]| {
        let same = l.start.distance(e[0]).max(l.end.distance(e[1]));
        same.min(l.start.distance(e[1]).max(l.end.distance(e[0])))
    };
    let straight = apart(&lines[0], &ends[0]).max(apart(&lines[1], &ends[1]));
    straight.min(apart(&lines[0], &ends[1]).max(apart(&lines[1], &ends[0])))
}

#[test]
fn asking_for_end_ellipses_leaves_side_lines_alone_and_shows_no_hidden_point() {
    let options = VisibilityOptions { rims: true, ..VisibilityOptions::default() };
    let (mut shown_m, mut hidden_m) = (0.0, 0.0);
    for seed in 0..100 {
        let (parts, camera, _) = random_scene(seed);
        let mut segments = Vec::new();
        visible_contours(&parts, camera, &options, &mut segments);
        let (sides, rims): (Vec<_>, Vec<_>) = segments.into_iter().partition(|s| is_side(s.kind));
        let place = |s: &VisibleSegment| (s.part, s.start, s.end);
        let alone = side_segments(&parts, camera);
        assert_eq!(sides.iter().map(place).collect::<Vec<_>>(), alone.iter().map(place).collect::<Vec<_>>());
        for rim in rims {
            let line = SideLine { part: rim.part, start: rim.start, end: rim.end };
            let occluders = occluders(&parts, camera, &line);
            let hidden =
                (0..16).filter(|k| occluders.iter().any(|o| o.hides((f64::from(*k) + 0.5) / 16.0))).count();
            shown_m += line.length();
            hidden_m += line.length() * hidden as f64 / 16.0;
        }
    }
    println!("end ellipses: {shown_m:.1} m shown, {:.2e} of it hidden", hidden_m / shown_m);
    assert!(shown_m > 10.0 && hidden_m < 1e-3 * shown_m, "{hidden_m} m of {shown_m} m");
}

// Scenes with answers known on paper

/// A cylinder with its axis along world x, y or z.
fn along(axis: DVec3, centre: [f64; 3], semi_axes: [f64; 2], half_length: f64) -> EllipticCylinder {
    let (x, y) = axis.any_orthonormal_pair();
    EllipticCylinder {
        world_from_cylinder: DAffine3::from_mat3_translation(DMat3::from_cols(x, y, axis), centre.into()),
        semi_axes: semi_axes.into(),
        half_length,
    }
}

/// Sorted intervals of one coordinate over the visible segments of one part, each side line in its own list.
fn pieces(segments: &[VisibleSegment], part: usize, coordinate: usize) -> [Vec<[f64; 2]>; 2] {
    [ContourKind::Left, ContourKind::Right].map(|kind| {
        let mine = segments.iter().filter(|s| s.part == part && s.kind == kind);
        let ends = mine.map(|s| (s.start[coordinate], s.end[coordinate]));
        let mut found: Vec<[f64; 2]> = ends.map(|(s, e)| [s.min(e), s.max(e)]).collect();
        found.sort_by(|l, r| l[0].total_cmp(&r[0]));
        found
    })
}

fn assert_pieces(found: &[Vec<[f64; 2]>; 2], expected: &[[f64; 2]]) {
    for line in found {
        assert_eq!(line.len(), expected.len(), "{line:?} instead of {expected:?}");
        for (l, r) in line.iter().flatten().zip(expected.iter().flatten()) {
            assert!((l - r).abs() < 1e-9, "{line:?} instead of {expected:?}");
        }
    }
}

#[test]
fn a_part_alone_shows_both_lines_whole() {
    // Polar line of (-0.5, 0) in the circle of radius 0.3: x = -0.09 / 0.5, y = ±0.3 sqrt(1 - 0.36).
    let part = along(DVec3::Z, [0.0; 3], [0.3, 0.3], 0.7);
    let camera = DVec3::new(-0.5, 0.0, 0.2);
    let segments = side_segments(&[part], camera);
    assert_eq!(segments.len(), 2);
    assert_pieces(&pieces(&segments, 0, 2), &[[-0.7, 0.7]]);
    let mut y: Vec<f64> = segments.iter().map(|s| s.start.y).collect();
    y.sort_by(f64::total_cmp);
    assert!((y[0] + 0.24).abs() < 1e-12 && (y[1] - 0.24).abs() < 1e-12, "{y:?}");
    assert!(segments.iter().all(|s| (s.start.x + 0.18).abs() < 1e-12));
}

#[test]
fn a_part_behind_a_larger_one_disappears() {
    let wall = along(DVec3::Z, [0.0; 3], [0.5, 0.5], 1.0);
    let rod = along(DVec3::Y, [1.0, 0.0, 0.1], [0.05, 0.08], 0.3);
    let segments = side_segments(&[rod, wall], DVec3::new(-3.0, 0.0, 0.0));
    assert!(segments.iter().all(|s| s.part == 1), "{segments:?}");
    assert_pieces(&pieces(&segments, 1, 2), &[[-1.0, 1.0]]);
}

#[test]
fn a_part_inside_another_disappears() {
    let shell = along(DVec3::Z, [0.0; 3], [0.5, 0.4], 1.0);
    let core = along(DVec3::Y, [0.0; 3], [0.05, 0.05], 0.3);
    let segments = side_segments(&[shell, core], DVec3::new(-3.0, 0.5, 0.3));
    assert!(segments.iter().all(|s| s.part == 0), "{segments:?}");
}

#[test]
fn a_bar_hides_what_lies_between_its_tangent_planes() {
    // The front bar, radius 0.6 and 1 m from the camera, spans angles up to sin = 0.6, tan = 0.75. The side
    // lines of the rear one, radius 1.6 and 4 m away, lie 4 - 1.6²/4 = 3.36 m off: hidden for |z| < 0.75 *
    // 3.36 = 2.52.
    let front = along(DVec3::Y, [-3.0, 0.0, 0.0], [0.6, 0.6], 1.0);
    let rear = along(DVec3::Z, [0.0; 3], [1.6, 1.6], 5.0);
    let segments = side_segments(&[rear, front], DVec3::new(-4.0, 0.0, 0.0));
    assert_pieces(&pieces(&segments, 0, 2), &[[-5.0, -2.52], [2.52, 5.0]]);
    assert_pieces(&pieces(&segments, 1, 1), &[[-1.0, 1.0]]);
}

#[test]
fn a_short_bar_hides_up_to_its_end() {
    // A vertical bar in front of a horizontal one, its top at eye height: hidden below, seen above.
    let camera = DVec3::new(-4.0, 0.0, 0.0);
    let front = along(DVec3::Z, [-3.0, 0.0, -1.0], [0.6, 0.6], 1.0);
    let rear = along(DVec3::Y, [0.0; 3], [1.6, 1.6], 5.0);
    let segments = side_segments(&[rear, front], camera);
    let (upper, lower): (Vec<_>, Vec<_>) = segments.into_iter().partition(|s| s.start.z > 0.0);
    assert_eq!(pieces(&upper, 0, 1).concat(), [[-5.0, 5.0]]);
    let lower = pieces(&lower, 0, 1).concat();
    let expected = [[-5.0, -2.52], [2.52, 5.0]];
    assert_eq!(lower.len(), 2);
    assert!(
        lower.iter().flatten().zip(expected.iter().flatten()).all(|(l, r)| (l - r).abs() < 1e-9),
        "{lower:?}"
    );
}

#[test]
fn a_part_running_through_another_comes_out_where_the_rim_lets_it() {
    // A disc (radius 0.5, |z| < 0.3) around a rod of radius 0.1 seen from 5 m at mid height. A horizontal
    // tangent to the rod meets the disc sqrt(0.5² - 0.1²) before the point of contact, which is sqrt(5² -
    // 0.1²) from the camera.
    let (rod, disc) =
        (along(DVec3::Z, [0.0; 3], [0.1, 0.1], 1.0), along(DVec3::Z, [0.0; 3], [0.5, 0.5], 0.3));
    let segments = side_segments(&[rod, disc], DVec3::new(0.0, -5.0, 0.0));
    let z = 0.3 / (1.0 - (0.24_f64 / 24.99).sqrt());
    assert_pieces(&pieces(&segments, 0, 2), &[[-1.0, -z], [z, 1.0]]);
    assert_pieces(&pieces(&segments, 1, 2), &[[-0.3, 0.3]]);
}

#[test]
fn from_the_axis_a_part_has_no_side_lines_but_hides_with_its_near_end() {
    // Seen from z = 3 the near end, radius 0.5 at z = 0.5, covers the cone of slope 0.5 / 2.5. The side lines
    // of the bar at z = -2, radius 0.1, lie 5 - 0.1²/5 = 4.998 below the camera and 0.1 sqrt(1 - 0.02²) off
    // the middle.
    let post = along(DVec3::Z, [0.0; 3], [0.5, 0.5], 0.5);
    let bar = along(DVec3::X, [0.0, 0.0, -2.0], [0.1, 0.1], 3.0);
    let camera = DVec3::new(0.0, 0.0, 3.0);
    assert!(side_lines(&post, camera).is_none());
    let segments = side_segments(&[post, bar], camera);
    assert!(segments.iter().all(|s| s.part == 1), "{segments:?}");
    let y_sq = 0.01 * (1.0 - 0.02_f64.powi(2));
    let x = ((0.2_f64 * 4.998).powi(2) - y_sq).sqrt();
    assert_pieces(&pieces(&segments, 1, 0), &[[-3.0, -x], [x, 3.0]]);
}

#[test]
fn from_inside_a_part_nothing_is_seen() {
    let post = along(DVec3::Z, [0.0; 3], [0.5, 0.4], 1.0);
    let bar = along(DVec3::X, [0.0, 2.0, 0.0], [0.1, 0.1], 3.0);
    let crossing = along(DVec3::Y, [0.0; 3], [0.1, 0.1], 3.0);
    assert_eq!(side_segments(&[post, bar, crossing], DVec3::new(0.2, 0.1, 0.3)).len(), 0);
}

#[test]
fn no_parts_show_nothing() {
    assert_eq!(side_segments(&[], DVec3::ZERO).len(), 0);
}

// The oracle itself: it must accept the truth and reject wrong answers

/// The answer of an imagined implementation which takes a point for visible when the predicate says so.
fn answer(
    parts: &[EllipticCylinder],
    camera: DVec3,
    sees: impl Fn(&SideLine, &[Occluder], f64) -> bool,
) -> Vec<VisibleSegment> {
    let places: Vec<f64> = (0..=600).map(|k| f64::from(k) / 600.0).collect();
    let mut segments = Vec::new();
    for (i, line) in all_tangent_lines(parts, camera).into_iter().enumerate() {
        let occluders = occluders(parts, camera, &line);
        let sees_at = |s: f64| sees(&line, &occluders, s);
        let values: Vec<bool> = places.iter().map(|s| sees_at(*s)).collect();
        let kind = if i % 2 == 0 { ContourKind::Left } else { ContourKind::Right };
        for [from, to] in intervals_where(&places, &values, sees_at) {
            segments.push(VisibleSegment { part: line.part, kind, start: line.at(from), end: line.at(to) });
        }
    }
    segments
}

/// Disagreement of the imagined implementation over some views, after a change to its segments.
fn judge(
    sees: impl Fn(&[EllipticCylinder], &SideLine, &[Occluder], f64) -> bool,
    change: impl Fn(&mut VisibleSegment),
) -> Tally {
    let mut tally = Tally::default();
    for seed in 5000..5060 {
        let (parts, camera, mut draw) = random_scene(seed);
        let mut segments = answer(&parts, camera, |line, occluders, s| sees(&parts, line, occluders, s));
        segments.iter_mut().for_each(&change);
        compare(&parts, camera, &segments, &mut draw, &mut tally);
    }
    tally
}

fn rays_see(_: &[EllipticCylinder], _: &SideLine, occluders: &[Occluder], s: f64) -> bool {
    !occluders.iter().any(|o| o.hides(s))
}

#[test]
fn oracle_accepts_an_answer_found_with_other_samples() {
    let tally = judge(rays_see, |_| ());
    assert!(tally.fraction() < 1e-5, "{tally:?}");
}

#[test]
fn oracle_rejects_ends_shifted_by_a_millimetre() {
    let shifted = judge(rays_see, |segment| {
        let direction = (segment.end - segment.start).normalize();
        segment.end -= direction * segment.start.distance(segment.end).min(1e-3);
    });
    println!("ends 1 mm short: {:.2e}", shifted.fraction());
    assert!(shifted.fraction() > 5.0 * MAX_DISAGREEMENT, "{shifted:?}");
}

#[test]
fn oracle_rejects_a_tenth_of_a_millimetre() {
    let shifted = judge(rays_see, |segment| {
        let direction = (segment.end - segment.start).normalize();
        segment.end -= direction * segment.start.distance(segment.end).min(1e-4);
    });
    println!("ends 0.1 mm short: {:.2e}", shifted.fraction());
    assert!(shifted.fraction() > MAX_DISAGREEMENT, "{shifted:?}");
}

#[test]
fn oracle_rejects_missing_cases() {
    let nothing_hidden = judge(|_, _, _, _| true, |_| ());
    let one_part_ignored = judge(|_, _, occluders, s| !occluders[1..].iter().any(|o| o.hides(s)), |_| ());
    // A removal by depth order alone knows nothing of points inside another part, unless something else hides
    // them.
    let inside_seen = judge(
        |parts, line, occluders, s| {
            parts.iter().any(|p| contains(p, line.at(s))) || rays_see(parts, line, occluders, s)
        },
        |_| (),
    );
    let endless_parts = judge(
        |_, _, occluders, s| {
            let flat = |p: DVec3| p.truncate().extend(0.0);
            !occluders.iter().any(|o| meets_unit_cylinder(flat(o.camera), flat(o.start.lerp(o.end, s))))
        },
        |_| (),
    );
    let open_tubes = judge(|_, _, occluders, s| !occluders.iter().any(|o| meets_open_tube(o, s)), |_| ());
    let cases = [
        ("no removal", nothing_hidden),
        ("one part ignored", one_part_ignored),
        ("insides seen", inside_seen),
        ("endless parts", endless_parts),
        ("open tubes", open_tubes),
    ];
    for (name, tally) in cases {
        println!("{name}: {:.2e}", tally.fraction());
        assert!(tally.fraction() > 10.0 * MAX_DISAGREEMENT, "{name}: {tally:?}");
    }
}

/// Strictly inside, away from the surface the point may lie on.
fn contains(part: &EllipticCylinder, point: DVec3) -> bool {
    let p = part.world_from_cylinder.inverse().transform_point3(point);
    p.z.abs() < part.half_length && (p.truncate() / part.semi_axes).length_squared() < 1.0 - 1e-9
}

/// Occlusion by the lateral surface only, as if the ends were open.
fn meets_open_tube(occluder: &Occluder, s: f64) -> bool {
    let (from, to) = (occluder.camera, occluder.start.lerp(occluder.end, s));
    let d = to - from;
    let (a, b) = (d.truncate().length_squared(), from.truncate().dot(d.truncate()));
    let discriminant = b * b - a * (from.truncate().length_squared() - 1.0);
    let crossings = [-1.0, 1.0].map(|sign| (-b + sign * discriminant.sqrt()) / a);
    crossings.iter().any(|t| (0.0..1.0).contains(t) && (from + d * *t).z.abs() < 1.0)
}

#[test]
fn rays_meet_the_unit_cylinder_where_they_should() {
    let v = DVec3::new;
    let cases = [
        (v(-3.0, 0.0, 0.0), v(3.0, 0.0, 0.0), true, "through the side"),
        (v(-3.0, 0.0, 0.0), v(-1.01, 0.0, 0.0), false, "ends before"),
        (v(-3.0, 0.0, 0.0), v(-0.99, 0.0, 0.0), true, "ends inside"),
        (v(1.01, 0.0, 0.0), v(3.0, 0.0, 0.0), false, "starts behind"),
        (v(0.5, 0.0, 0.5), v(0.6, 0.1, 0.4), true, "wholly inside"),
        (v(-3.0, 1.001, 0.0), v(3.0, 1.001, 0.0), false, "passes the side"),
        (v(-3.0, 0.999, 0.0), v(3.0, 0.999, 0.0), true, "cuts the side"),
        (v(-3.0, 1.0, 0.0), v(3.0, 1.0, 0.0), false, "touches the side"),
        (v(-3.0, 0.0, 1.001), v(3.0, 0.0, 1.001), false, "passes the end"),
        (v(-3.0, 0.0, 1.0), v(3.0, 0.0, 1.0), false, "touches the end"),
        (v(0.3, 0.2, 4.0), v(0.3, 0.2, -4.0), true, "along the axis"),
        (v(0.3, 0.2, 4.0), v(0.3, 0.2, 1.01), false, "along the axis, short"),
        (v(1.0, 0.1, 4.0), v(1.0, 0.1, -4.0), false, "beside, along the axis"),
        (v(0.0, 0.0, 2.0), v(1.9, 0.0, 0.0), true, "end into side"),
        (v(0.0, 0.0, 2.0), v(2.1, 0.0, 0.0), false, "past the rim"),
    ];
    for (from, to, expected, name) in cases {
        assert_eq!(meets_unit_cylinder(from, to), expected, "{name}");
        assert_eq!(meets_unit_cylinder(to, from), expected, "{name}, backwards");
    }
}

#[test]
fn searched_tangent_lines_touch_and_do_not_cut() {
    for seed in 0..50 {
        let (parts, camera, _) = random_scene(seed);
        for (i, part) in parts.iter().enumerate() {
            for line in tangent_lines(i, part, camera).into_iter().flatten() {
                let on_axis = part.centre();
                for s in [0.0, 0.3, 1.0] {
                    let nudged = |by: f64| camera + (line.at(s) + (line.at(s) - on_axis) * by - camera) * 3.0;
                    let endless = EllipticCylinder { half_length: 1e3, ..*part };
                    let meets = |by: f64| {
                        let sight = SideLine { part: i, start: nudged(by), end: nudged(by) };
                        Occluder::new(&endless, camera, &sight).hides(0.0)
                    };
                    assert!(!meets(1e-6) && meets(-1e-6), "seed {seed} part {i} at {s}");
                }
            }
        }
    }
}
