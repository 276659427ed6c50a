use super::*;
use crate::image::Image;
use glam::Vec2;
use proptest::prelude::*;

/// Draws a shape given by its signed distance (positive = dark), anti-aliased over one pixel, with noise.
fn draw(size: usize, distance: impl Fn(DVec2) -> f64, contrast: f64, noise_sd: f64) -> Image<u8> {
    let mut state = 0x2545_f491_4f6c_dd1du64;
    let mut uniform = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let data = (0..size * size).map(|p| {
        let at = DVec2::new((p % size) as f64, (p / size) as f64);
        let noise = noise_sd * ((0..12).map(|_| uniform()).sum::<f64>() - 6.0);
        (50.0 + contrast * (0.5 - distance(at)).clamp(0.0, 1.0) + noise).round().clamp(0.0, 255.0) as u8
    });
    Image::from_vec(size, size, data.collect()).unwrap()
}

fn polygon(corners: Vec<DVec2>) -> impl Fn(DVec2) -> f64 {
    move |p| {
        let sides = corners.iter().zip(corners.iter().cycle().skip(1));
        sides.map(|(&a, &b)| -(b - a).normalize().perp_dot(p - a)).fold(f64::MIN, f64::max)
    }
}

fn segments(image: &Image<u8>) -> Vec<EdgeSegment> {
    let (edge_options, line_options) = (EdgeOptions::default(), LineOptions::default());
    edge_segments(&image.as_frame(), &EdgeDomain::default(), &edge_options, &line_options).unwrap()
}

/// Edge points with gradients perpendicular to the direction of the chain.
fn segments_through(points: &[DVec2], options: &LineOptions) -> Vec<EdgeSegment> {
    let edgel = |i: usize| {
        let way = points[(i + 1).min(points.len() - 1)] - points[i.saturating_sub(1)];
        Edgel { position_px: points[i].as_vec2(), gradient: 10.0 * way.perp().normalize_or_zero().as_vec2() }
    };
    let edgels: Vec<Edgel> = (0..points.len()).map(edgel).collect();
    let chain = Chain::new(&edgels);
    let pieces = chain.join(chain.split(options.max_deviation_px), options.max_deviation_px);
    pieces.into_iter().filter_map(|p| chain.segment(p, options)).collect()
}

#[test]
fn the_line_through_points_minimises_the_distances_across_it() {
    let points = [(0.0, 0.1), (1.0, -0.2), (2.0, 0.3), (3.0, 0.2), (4.0, -0.1)].map(DVec2::from);
    let line = points.iter().fold(Moments::default(), |m, &p| m.plus(p)).line();
    let sum_sq = |l: &Line| points.iter().map(|&p| l.distance(p).powi(2)).sum::<f64>();
    assert!((line.residual_sq - sum_sq(&line)).abs() < 1e-12);
    for turn in [-1e-3, 1e-3] {
        let turned = Line { direction: DVec2::from_angle(turn).rotate(line.direction), ..line };
        let moved = Line { point: line.point + turn * DVec2::Y, ..line };
        assert!(sum_sq(&turned) > line.residual_sq && sum_sq(&moved) > line.residual_sq);
    }
}

#[test]
fn planted_noisy_edges_are_recovered() {
    let (mut turn_sq, mut shift_sq, count) = (0.0, 0.0, 60);
    for i in 0..count {
        let normal = DVec2::from_angle(f64::from(i) * 0.1047);
        let offset = (f64::from(i) * 0.618).fract() - 0.5;
        let image = draw(64, |p| offset - normal.dot(p - 32.0), 60.0, 4.0);
        let longest = segments(&image).into_iter().max_by(|a, b| a.length_px().total_cmp(&b.length_px()));
        let found = longest.expect("an edge is there");
        assert!(found.length_px() > 55.0, "{found:?}");
        assert!(found.normal().dot(normal) > 0.99, "polarity of {found:?}");
        turn_sq += found.direction().dot(normal).powi(2);
        shift_sq += (normal.dot(found.midpoint_px() - 32.0) - offset).powi(2);
    }
    let (turn_sd, shift_sd) = ((turn_sq / f64::from(count)).sqrt(), (shift_sq / f64::from(count)).sqrt());
    assert!(turn_sd.to_degrees() < 0.1, "direction sd {} deg", turn_sd.to_degrees());
    assert!(shift_sd < 0.03, "offset sd {shift_sd} px");
}

#[test]
fn a_polygon_has_one_segment_a_side() {
    let corners: Vec<DVec2> = (0..5)
        .map(|i| 50.0 + 35.0 * DVec2::from_angle(0.3 + 0.4 * f64::from(i) * std::f64::consts::PI))
        .collect();
    let found = segments(&draw(100, polygon(corners.clone()), 100.0, 0.0));
    assert_eq!(found.len(), 5);
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % 5];
        let normal = (b - a).normalize().perp();
        let side = found.iter().find(|s| s.normal().dot(normal) > 0.999).expect("a segment along the side");
        assert!(normal.dot(side.midpoint_px() - a).abs() < 0.1, "{side:?}");
        assert!(side.start_px.distance(a) < 4.0 && side.end_px.distance(b) < 4.0, "{side:?}");
    }
}

#[test]
fn a_disc_becomes_a_polygon_within_the_tolerance() {
    let found = segments(&draw(120, |p| p.distance(DVec2::splat(60.0)) - 45.0, 100.0, 0.0));
    assert!((10..=18).contains(&found.len()), "{} segments", found.len());
    let length: f64 = found.iter().map(EdgeSegment::length_px).sum();
    assert!(length > 0.9 * 2.0 * std::f64::consts::PI * 45.0, "{length} px of outline");
    for s in &found {
        for p in [s.start_px, s.midpoint_px(), s.end_px] {
            assert!((p.distance(DVec2::splat(60.0)) - 45.0).abs() < 1.1, "{s:?}");
        }
        assert!(s.normal().dot(s.midpoint_px() - 60.0) < 0.0, "the disc is the bright side");
    }
}

#[test]
fn a_thin_bright_bar_has_two_sides_of_opposite_polarity() {
    let image = draw(80, |p| (p.x * 0.6 - p.y * 0.8 + 8.0).abs() - 3.0, 100.0, 0.0);
    let long: Vec<_> = segments(&image).into_iter().filter(|s| s.length_px() > 50.0).collect();
    assert_eq!(long.len(), 2);
    assert!(long[0].direction().dot(long[1].direction()) < -0.999);
    let gap = long[0].normal().dot(long[1].midpoint_px() - long[0].midpoint_px());
    assert!((gap - 6.0).abs() < 0.1, "the bar is {gap} px wide");
}

#[test]
fn few_points_and_degenerate_chains_do_no_harm() {
    let all = LineOptions { min_length_px: 0.0, ..Default::default() };
    assert!(segments_through(&[DVec2::ONE], &all).is_empty());
    for way in [DVec2::X, DVec2::Y, DVec2::new(1.0, -1.0)] {
        for count in 2..5 {
            let points: Vec<DVec2> = (0..count).map(|i| 7.0 + f64::from(i) * way).collect();
            let found = segments_through(&points, &all);
            assert_eq!(found.len(), 1);
            assert_eq!(found[0].edgel_count, points.len());
            assert!(found[0].start_px.distance(points[0]) < 1e-5 && found[0].residual_rms_px < 1e-5);
        }
    }
    let coincident = segments_through(&[DVec2::ONE; 4], &all);
    assert!(coincident.iter().all(|s| s.length_px() == 0.0 && s.direction() == DVec2::ZERO));
    let there_and_back: Vec<DVec2> = [0.0, 5.0, 10.0, 5.0, 0.0].map(|x| DVec2::new(x, x * x)).to_vec();
    assert!(segments_through(&there_and_back, &all).iter().all(|s| s.length_px().is_finite()));
}

#[test]
fn zero_gradients_leave_finite_segments() {
    let edgels: Vec<Edgel> =
        (0..9).map(|i| Edgel { position_px: Vec2::new(i as f32, 2.0), gradient: Vec2::ZERO }).collect();
    let segment = Chain::new(&edgels).segment(0..9, &LineOptions::default()).unwrap();
    assert_eq!((segment.mean_gradient, segment.length_px()), (0.0, 8.0));
}

#[test]
fn bad_options_are_refused_with_their_values() {
    let refuse = |options| segments_from_chains(&EdgeChains::default(), &options).unwrap_err();
    let error = refuse(LineOptions { max_deviation_px: 0.0, ..Default::default() });
    assert_eq!(error.to_string(), "max_deviation_px must be positive, got 0");
    let error = refuse(LineOptions { min_length_px: -1.0, ..Default::default() });
    assert_eq!(error.to_string(), "min_length_px must be 0 or more, got -1");
}

proptest! {
    #[test]
    fn every_point_is_near_its_segment_and_none_is_lost(
        turns in prop::collection::vec(-0.6f64..0.6, 2..60), tolerance in 0.2f64..3.0,
    ) {
        let mut heading = 0.0;
        let points: Vec<DVec2> = turns.iter().scan(DVec2::ZERO, |at, turn| {
            heading += turn;
            *at += DVec2::from_angle(heading);
            Some(*at)
        }).collect();
        let options = LineOptions { max_deviation_px: tolerance, min_length_px: 0.0 };
        let found = segments_through(&points, &options);
        // The point of a cut belongs to both segments.
        let mut first = 0;
        for s in &found {
            for p in &points[first..first + s.edgel_count] {
                prop_assert!(s.direction().perp_dot(*p - s.start_px).abs() <= tolerance + 1e-5);
            }
            first += s.edgel_count - 1;
        }
        prop_assert_eq!(first + 1, points.len());
        // From the other end, as in the negative picture, the segments are the same.
        let reversed: Vec<DVec2> = points.iter().rev().copied().collect();
        let back = segments_through(&reversed, &options);
        prop_assert_eq!(back.len(), found.len());
        for (s, r) in found.iter().zip(back.iter().rev()) {
            prop_assert!(s.start_px.distance(r.end_px).max(s.end_px.distance(r.start_px)) < 1e-4, "{s:?} {r:?}");
        }
    }
}

/// Least squares through points by the largest eigenvector of their scatter matrix.
fn fitted(points: &[DVec2]) -> (DVec2, DVec2) {
    let mean = points.iter().sum::<DVec2>() / points.len() as f64;
    let mut scatter = nalgebra::Matrix2::zeros();
    for p in points {
        let d = nalgebra::Vector2::new(p.x - mean.x, p.y - mean.y);
        scatter += d * d.transpose();
    }
    let eigen = scatter.symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    (mean, DVec2::new(along[0], along[1]))
}

/// A straight piece with rounded ends: points farther than two standard deviations are excluded, and the line
/// lies on the rest.
#[test]
fn rounded_ends_do_not_turn_a_line() {
    let mut points: Vec<DVec2> = (0..40).map(|i| DVec2::new(f64::from(i), 0.02 * f64::from(i % 3))).collect();
    for (i, bend) in [0.35, 0.6, 0.9].into_iter().enumerate() {
        points[37 + i].y = bend;
    }
    let [segment] = &segments_through(&points, &LineOptions::default())[..] else { panic!("one segment") };
    let (mean, along) = fitted(&points);
    let distance = |p: &DVec2| along.perp_dot(*p - mean).abs();
    let rms = (points.iter().map(|p| distance(p).powi(2)).sum::<f64>() / 40.0).sqrt();
    let near: Vec<DVec2> = points.iter().copied().filter(|p| distance(p) <= 2.0 * rms).collect();
    assert!(near.len() < 40 && near.len() > 35);
    let (_, expected) = fitted(&near);
    assert!(segment.direction().perp_dot(expected).abs() < 1e-9, "{segment:?} {expected}");
    // Including all points would turn it by more than twice as much.
    assert!(expected.y.abs() < 0.5 * along.y.abs(), "{expected} {along}");
    // If a point is farther from the refitted line than allowed, the line through all points is kept.
    let strict = LineOptions { max_deviation_px: 0.75, ..LineOptions::default() };
    let is_near =
        |direction: DVec2, mean: DVec2| points.iter().all(|p| direction.perp_dot(*p - mean).abs() <= 0.75);
    assert!(is_near(along, mean) && !is_near(expected, fitted(&near).0));
    let [segment] = &segments_through(&points, &strict)[..] else { panic!("one segment") };
    assert!(segment.direction().perp_dot(along).abs() < 1e-9, "{segment:?} {along}");
}

/// Pieces split unnecessarily are joined again: no two neighbouring pieces form one straight piece.
#[test]
fn neighbouring_pieces_are_not_one_line() {
    let mut joined = 0;
    for seed in 0..400 {
        let mut random = crate::synth::Random::new(seed);
        let mut heading: f64 = 0.0;
        let mut at = DVec2::ZERO;
        let points: Vec<DVec2> = (0..120)
            .map(|i| {
                heading += if i % 30 == 29 { random.uniform(-1.0, 1.0) } else { random.uniform(-0.12, 0.12) };
                at += DVec2::from_angle(heading);
                at
            })
            .collect();
        let edgels: Vec<Edgel> =
            points.iter().map(|p| Edgel { position_px: p.as_vec2(), gradient: Vec2::X }).collect();
        let chain = Chain::new(&edgels);
        let split = chain.split(1.0);
        let pieces = chain.join(split.clone(), 1.0);
        joined += split.len() - pieces.len();
        assert_eq!((pieces[0].start, pieces.last().unwrap().end), (0, 120));
        for pair in pieces.windows(2) {
            assert_eq!(pair[0].end, pair[1].start + 1);
            assert!(!chain.is_straight(&(pair[0].start..pair[1].end), 1.0), "{pair:?}");
        }
        // The segments are those of the joined pieces.
        let options = LineOptions { min_length_px: 0.0, ..LineOptions::default() };
        let chains = EdgeChains::single(&edgels);
        let found = segments_from_chains(&chains, &options).unwrap();
        assert_eq!(found.len(), pieces.iter().filter(|piece| piece.len() >= 2).count());
    }
    assert!(joined > 10, "{joined}");
}

/// A closed chain has no chord: it is split at the point farthest from its start.
#[test]
fn a_loop_is_cut_at_its_far_side() {
    let points: Vec<Edgel> = (0..=40)
        .map(|i| DVec2::from_angle(std::f64::consts::TAU * f64::from(i % 40) / 40.0) * 10.0)
        .map(|p| Edgel { position_px: p.as_vec2(), gradient: Vec2::X })
        .collect();
    let chain = Chain::new(&points);
    assert_eq!(chain.farthest_from_chord(&chain.whole()), 20);
}

/// Residual and gradient of a segment are means over its points: of the squared distances and of the
/// magnitudes.
#[test]
fn a_segment_has_the_means_of_its_points() {
    let edgels: Vec<Edgel> = (0..40)
        .map(|i| Edgel {
            position_px: Vec2::new(i as f32, if i % 2 == 0 { 0.2 } else { -0.2 }),
            gradient: 10.0
                * Vec2::from_angle(std::f32::consts::FRAC_PI_2 + if i % 4 < 2 { 0.5 } else { -0.5 }),
        })
        .collect();
    let chains = EdgeChains::single(&edgels);
    let [segment] = &segments_from_chains(&chains, &LineOptions::default()).unwrap()[..] else { panic!() };
    assert!((segment.residual_rms_px - 0.2).abs() < 2e-3, "{segment:?}");
    assert!((segment.mean_gradient - 10.0).abs() < 1e-5, "{segment:?}");
    assert_eq!(segment.edgel_count, 40);
}

/// Segments of eight pixels and more are kept.
#[test]
fn short_segments_are_left_out() {
    for (length, is_kept) in [(7.9, false), (8.1, true)] {
        let points: Vec<DVec2> = (0..10).map(|i| DVec2::new(length * f64::from(i) / 9.0, 0.0)).collect();
        let found = segments_through(&points, &LineOptions::default());
        assert_eq!(found.len() == 1, is_kept, "{length}");
    }
}
