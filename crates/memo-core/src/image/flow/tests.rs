use super::multigrid::Solved;
use super::*;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const EXACT: FlowOptions = FlowOptions {
    smoothness: 3.0,
    levels: 1,
    warps: 1,
    tolerance: 1e-12,
    max_iterations: 500,
    min_gradient: 0.5,
};

fn domain_of(rows: &[&str]) -> Domain {
    let mut domain = Domain::empty(rows[0].len(), rows.len());
    for (y, row) in rows.iter().enumerate() {
        for (x, c) in row.bytes().enumerate() {
            let cell = domain.cell(x, y);
            domain.is_inside[cell] = c == b'#';
        }
    }
    domain
}

/// The normal equations derived from the functional term by term and solved directly.
fn dense_solution(domain: &Domain, g: &[DVec2], c: &[f64], lambda: f64) -> Option<DVector<f64>> {
    let pixels: Vec<_> = domain.pixels().collect();
    let mut terms: Vec<(Vec<(usize, f64)>, f64)> = Vec::new();
    for (i, &(x, y, cell)) in pixels.iter().enumerate() {
        terms.push((vec![(2 * i, g[cell].x), (2 * i + 1, g[cell].y)], -c[cell]));
        let is_neighbour =
            |&&(x2, y2, _): &&(usize, usize, usize)| (x2, y2) == (x + 1, y) || (x2, y2) == (x, y + 1);
        for neighbour in pixels.iter().filter(is_neighbour) {
            let j = pixels.iter().position(|p| p == neighbour).unwrap();
            terms.extend((0..2).map(|k| (vec![(2 * i + k, lambda), (2 * j + k, -lambda)], 0.0)));
        }
    }
    let mut a = DMatrix::zeros(terms.len(), 2 * pixels.len());
    for (row, (entries, _)) in terms.iter().enumerate() {
        entries.iter().for_each(|&(column, value)| a[(row, column)] = value);
    }
    let b = DVector::from_iterator(terms.len(), terms.iter().map(|t| t.1));
    (a.transpose() * &a).cholesky().map(|f| f.solve(&(a.transpose() * b)))
}

fn iterated_solution(domain: &Domain, g: &[DVec2], c: &[f64], options: &FlowOptions) -> (Vectors, Solved) {
    let mut solver = Multigrid::new(domain, options.smoothness * options.smoothness);
    for (_, _, cell) in domain.pixels() {
        solver.set_constraint(cell, g[cell], c[cell]);
    }
    let mut x = Vectors::zero(g.len());
    let goal = Goal { tolerance: options.tolerance, max_iterations: options.max_iterations };
    let solved = solver.solve(&mut x, goal);
    (x, solved)
}

const RING_WITH_TAIL: [&str; 8] = [
    ".######....",
    ".######....",
    ".##..##....",
    ".##..######",
    ".##..######",
    ".######..##",
    "..####...##",
    ".........##",
];

#[test]
fn constant_motion_is_reproduced_up_to_the_border_of_a_ring() {
    let domain = domain_of(&RING_WITH_TAIL);
    let motion = DVec2::new(1.3, -0.4);
    let g: Vec<DVec2> =
        (0..domain.is_inside.len()).map(|i| 8.0 * DVec2::from_angle((i * i % 17) as f64)).collect();
    let c: Vec<f64> = g.iter().map(|g| -g.dot(motion)).collect();
    let (x, solved) = iterated_solution(&domain, &g, &c, &EXACT);
    assert!(solved.relative_residual <= 1e-12);
    for (_, _, cell) in domain.pixels() {
        assert!(DVec2::new(x.u[cell], x.v[cell]).distance(motion) < 1e-9);
    }
    assert!((0..g.len()).all(|i| domain.is_inside[i] || x.u[i] == 0.0));
}

#[test]
fn the_number_of_solver_steps_does_not_grow_with_the_region() {
    for size in [8, 32, 128] {
        let mut domain = Domain::empty(size, size);
        let cells: Vec<usize> = (0..size * size).map(|p| domain.cell(p % size, p / size)).collect();
        cells.iter().for_each(|&cell| domain.is_inside[cell] = true);
        let g: Vec<DVec2> =
            (0..domain.is_inside.len()).map(|i| 4.0 * DVec2::from_angle((i * i % 29) as f64)).collect();
        let c: Vec<f64> = (0..g.len()).map(|i| (0.37 * i as f64).sin()).collect();
        let options = FlowOptions { smoothness: 25.0, tolerance: 1e-6, ..EXACT };
        let (_, solved) = iterated_solution(&domain, &g, &c, &options);
        assert!(solved.iterations <= 15, "{} steps at {size}x{size}", solved.iterations);
    }
}

/// On a chain of pixels without data between its ends, u is a straight line between them.
#[test]
fn a_flat_stretch_interpolates_linearly_between_textured_ends() {
    let domain = domain_of(&["#####################"]);
    let mut g = vec![DVec2::ZERO; domain.is_inside.len()];
    let mut c = vec![0.0; g.len()];
    for (x, u) in [(0, 1.0), (20, 3.0)] {
        let cell = domain.cell(x, 0);
        (g[cell], c[cell]) = (1e4 * DVec2::X, -1e4 * u);
    }
    let (x, _) = iterated_solution(&domain, &g, &c, &EXACT);
    for i in 0..21 {
        assert!((x.u[domain.cell(i, 0)] - (1.0 + 0.1 * i as f64)).abs() < 1e-5);
    }
}

/// Grey values of a non-periodic texture after a motion by `shift`.
fn textured(width: usize, height: usize, shift: DVec2, texture: impl Fn(DVec2) -> f64) -> Image<u8> {
    let at = |p: usize| DVec2::new((p % width) as f64, (p / width) as f64) - shift;
    let data = (0..width * height).map(|p| (128.0 + texture(at(p))).round() as u8).collect();
    Image::from_vec(width, height, data).unwrap()
}

fn waves(p: DVec2) -> f64 {
    let wave =
        |angle: f64, length: f64| (DVec2::from_angle(angle).dot(p) * std::f64::consts::TAU / length).sin();
    20.0 * wave(0.3, 83.0)
        + 20.0 * wave(1.9, 71.0)
        + 15.0 * wave(1.1, 37.0)
        + 15.0 * wave(2.6, 29.0)
        + 12.0 * wave(0.7, 11.3)
        + 12.0 * wave(2.2, 9.1)
}

fn ring_mask(width: usize, height: usize) -> Mask {
    let inside = |p: usize| {
        let r = DVec2::new((p % width) as f64 - 60.0, (p / width) as f64 - 50.0).length();
        r < 38.0 && (r > 12.0 || p % width > 60)
    };
    Mask::from_vec(width, height, (0..width * height).map(inside).collect()).unwrap()
}

#[test]
fn translations_of_a_textured_ring_are_recovered() {
    let region = ring_mask(120, 100);
    let first = textured(120, 100, DVec2::ZERO, waves);
    for shift in [(0.0, 0.0), (0.4, -0.3), (2.6, 1.2), (-6.0, 3.5), (11.0, -4.0), (-13.0, 7.5)] {
        let shift = DVec2::from(shift);
        let second = textured(120, 100, shift, waves);
        let field =
            velocity_field(&first.as_frame(), &second.as_frame(), &region, &FlowOptions::default()).unwrap();
        assert_eq!(field.components.len(), 1);
        assert_eq!(field.components[0].evidence, FlowEvidence::Determined);
        let mut worst = 0.0f64;
        for p in (0..region.pixels().len()).filter(|&p| region.pixels()[p]) {
            worst = worst.max(field.at(p % 120, p / 120).unwrap().distance(shift));
        }
        assert!(worst < 0.05, "{shift}: {worst} px off");
    }
}

#[test]
fn components_without_two_directions_are_refused_by_name() {
    let (width, height) = (90, 30);
    let texture = |p: DVec2| match p.x {
        x if x < 30.0 => waves(p),
        x if x < 60.0 => 40.0 * (0.4 * p.x).sin(),
        _ => 0.0,
    };
    let image = textured(width, height, DVec2::ZERO, texture);
    let mut region = Mask::filled(width, height, false);
    for y in 5..25 {
        [5, 35, 65].iter().for_each(|&x| region.row_mut(y)[x..x + 20].fill(true));
    }
    let frame = image.as_frame();
    let field = velocity_field(&frame, &frame, &region, &FlowOptions::default()).unwrap();
    let evidence: Vec<FlowEvidence> = field.components.iter().map(|c| c.evidence).collect();
    assert_eq!(evidence, [FlowEvidence::Determined, FlowEvidence::OneDirection, FlowEvidence::Textureless]);
    assert_eq!((field.components[1].x, field.components[1].pixel_count), (35, 400));
    assert!(field.at(10, 10).unwrap().length() < 1e-3);
    assert_eq!(
        (field.at(40, 10), field.at(70, 10), field.at(30, 10), field.at(0, 0)),
        (None, None, None, None)
    );
}

#[test]
fn bad_input_is_refused_with_its_values() {
    let image = Image::filled(8, 8, 1u8);
    let frame = image.as_frame();
    let run = |region: &Mask, options: FlowOptions| velocity_field(&frame, &frame, region, &options);
    let none = Mask::filled(8, 8, false);
    assert_eq!(run(&none, FlowOptions::default()), Err(FlowError::EmptyRegion));
    let all = Mask::filled(8, 8, true);
    let error = run(&all, FlowOptions { smoothness: 0.0, ..Default::default() });
    assert_eq!(
        error,
        Err(FlowError::Option(OptionError { name: "smoothness", wanted: "positive and finite", got: 0.0 }))
    );
    let error = run(&Mask::filled(7, 8, true), FlowOptions::default()).unwrap_err();
    assert!(matches!(error, FlowError::Size(FrameError::SizeChanged { width: 7, .. })));
    let other = Image::filled(9, 8, 1u8);
    assert!(velocity_field(&frame, &other.as_frame(), &all, &FlowOptions::default()).is_err());
    let flat = run(&all, FlowOptions { levels: usize::MAX, ..Default::default() }).unwrap();
    assert!(flat.u_px.pixels().iter().all(|u| u.is_nan()));
}

#[test]
fn regions_at_the_border_and_of_single_pixels_are_computed() {
    let (first, second) = (textured(40, 30, DVec2::ZERO, waves), textured(40, 30, DVec2::X, waves));
    let mut region = Mask::filled(40, 30, true);
    let field =
        velocity_field(&first.as_frame(), &second.as_frame(), &region, &FlowOptions::default()).unwrap();
    assert!(field.at(20, 15).unwrap().distance(DVec2::X) < 0.05);
    region = Mask::filled(40, 30, false);
    region.set(39, 29, true);
    let field =
        velocity_field(&first.as_frame(), &second.as_frame(), &region, &FlowOptions::default()).unwrap();
    assert_ne!(field.components[0].evidence, FlowEvidence::Determined);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn the_solution_is_that_of_the_dense_equations(
        seeds in prop::collection::vec((0.0f64..1.0, -6.0f64..6.0, -6.0f64..6.0, -9.0f64..9.0), 63),
        share in 0.4f64..1.0, smoothness in 0.3f64..20.0,
    ) {
        let mut domain = Domain::empty(9, 7);
        let mut g = vec![DVec2::ZERO; domain.is_inside.len()];
        let mut c = vec![0.0; g.len()];
        for (p, &(inside, gx, gy, offset)) in seeds.iter().enumerate() {
            let cell = domain.cell(p % 9, p / 9);
            domain.is_inside[cell] = inside < share;
            (g[cell], c[cell]) = (DVec2::new(gx, gy), offset);
        }
        drop_small_components(&mut domain);
        let expected = dense_solution(&domain, &g, &c, smoothness).unwrap();
        let (x, _) = iterated_solution(&domain, &g, &c, &FlowOptions { smoothness, ..EXACT });
        for (i, (_, _, cell)) in domain.pixels().enumerate() {
            prop_assert!((x.u[cell] - expected[2 * i]).abs() < 1e-6);
            prop_assert!((x.v[cell] - expected[2 * i + 1]).abs() < 1e-6);
        }
    }
}

/// Keeps components of three pixels and more, whose random gradients have two directions.
fn drop_small_components(domain: &mut Domain) {
    let mut is_seen = vec![false; domain.is_inside.len()];
    for start in 0..is_seen.len() {
        if domain.is_inside[start] && !is_seen[start] {
            let cells = domain.connected_to(start, &mut is_seen);
            if cells.len() < 3 {
                cells.iter().for_each(|&cell| domain.is_inside[cell] = false);
            }
        }
    }
}

/// Two frames of a texture with a small motion, and a region.
fn moving(motion: Vec2, width: usize, height: usize) -> [Image<u8>; 2] {
    let grey = |p: Vec2| {
        let wave = |a: f32, b: f32, c: f32| (a * p.x + b * p.y + c).sin();
        128.0 + 50.0 * wave(0.5, 0.2, 0.3) + 40.0 * wave(-0.25, 0.6, 1.0) + 20.0 * wave(0.9, 0.8, 2.0)
    };
    [Vec2::ZERO, motion].map(|shift| {
        let pixels = (0..width * height).map(|i| {
            let p = Vec2::new((i % width) as f32, (i / width) as f32);
            grey(p - shift).round() as u8
        });
        Image::from_vec(width, height, pixels.collect()).unwrap()
    })
}

/// One linearisation on one level is the minimum of the functional, written out pixel by pixel: grey levels
/// smoothed by binomial weights, mean gradient of both frames by central differences, smoothness squared.
#[test]
fn one_step_is_the_minimum_of_the_functional() {
    let [first, second] = moving(Vec2::new(0.4, -0.3), 30, 26);
    let smoothed = |image: &Image<u8>, x: isize, y: isize| {
        let taps = [1.0, 4.0, 6.0, 4.0, 1.0f64];
        let grey = |i: isize, j: isize| f64::from(image.at((x + i - 2) as usize, (y + j - 2) as usize));
        let row = |j: isize| (0..5).map(|i| taps[i as usize] * grey(i, j)).sum::<f64>();
        (0..5).map(|j| taps[j as usize] * row(j)).sum::<f64>() / 256.0
    };
    let (a, b) = (|x, y| smoothed(&first, x, y), |x, y| smoothed(&second, x, y));
    let rows = ["..###..", ".#####.", "#######", "####.##", ".##..##"];
    let mut region = Image::filled(30, 26, false);
    let domain = domain_of(&rows);
    for (x, y, _) in domain.pixels() {
        region.set(10 + x, 9 + y, true);
    }
    let mut g = vec![DVec2::ZERO; domain.is_inside.len()];
    let mut c = vec![0.0; domain.is_inside.len()];
    for (x, y, cell) in domain.pixels() {
        let (x, y) = (10 + x as isize, 9 + y as isize);
        let slope = |f: &dyn Fn(isize, isize) -> f64| {
            0.5 * DVec2::new(f(x + 1, y) - f(x - 1, y), f(x, y + 1) - f(x, y - 1))
        };
        g[cell] = 0.5 * (slope(&a) + slope(&b));
        c[cell] = b(x, y) - a(x, y);
    }
    for smoothness in [2.0, 20.0] {
        let options = FlowOptions { smoothness, ..EXACT };
        let found = velocity_field(&first.as_frame(), &second.as_frame(), &region, &options).unwrap();
        let expected = dense_solution(&domain, &g, &c, smoothness).unwrap();
        for (i, (x, y, _)) in domain.pixels().enumerate() {
            let velocity = found.at(10 + x, 9 + y).unwrap();
            let expected = DVec2::new(expected[2 * i], expected[2 * i + 1]);
            assert!(velocity.distance(expected) < 1e-4, "{smoothness} {x} {y}: {velocity} {expected}");
        }
    }
}

/// Between pixels a quadratic is interpolated exactly; bilinear interpolation would not do so.
#[test]
fn quadratics_are_interpolated_exactly() {
    let f = |x: f32, y: f32| 3.0 + 0.5 * x - 0.25 * y + 0.125 * x * x - 0.25 * x * y + 0.0625 * y * y;
    let grey: Vec<f32> = (0..12 * 10).map(|i| f((i % 12) as f32, (i / 12) as f32)).collect();
    let raster = Raster::with_gradients(12, 10, &grey, Vec2::ZERO, Vec2::new(11.0, 9.0));
    for at in [Vec2::new(4.5, 3.5), Vec2::new(2.25, 6.75), Vec2::new(7.9, 4.1), Vec2::new(5.0, 5.0)] {
        let found = raster.sample(at).unwrap();
        assert!((found.grey - f(at.x, at.y)).abs() < 1e-4, "{at} {}", found.grey);
        let slope = Vec2::new(0.5 + 0.25 * at.x - 0.25 * at.y, -0.25 - 0.25 * at.x + 0.125 * at.y);
        assert!(found.gradient.distance(slope) < 1e-4, "{at} {}", found.gradient);
    }
    assert!(raster.sample(Vec2::new(-0.1, 3.0)).is_none() && raster.sample(Vec2::new(11.1, 3.0)).is_none());
}

/// A pixel of the half-size image lies between two pixels of the full-size image: grey levels and borders
/// correspond.
#[test]
fn half_a_picture_shows_the_same_places() {
    let f = |x: f32, y: f32| 5.0 + 2.0 * x - 3.0 * y;
    let grey: Vec<f32> = (0..16 * 12).map(|i| f((i % 16) as f32, (i / 16) as f32)).collect();
    let raster = Raster::with_gradients(16, 12, &grey, Vec2::new(2.0, 1.0), Vec2::new(12.0, 9.0));
    let half = raster.halved();
    assert_eq!((half.width, half.height), (8, 6));
    for y in 1..5 {
        for x in 1..7 {
            let sample = half.at(x, y);
            assert!((sample.grey - f(2.0 * x as f32 + 0.5, 2.0 * y as f32 + 0.5)).abs() < 1e-3);
        }
    }
    assert!(half.at(3, 3).gradient.distance(Vec2::new(4.0, -6.0)) < 1e-3);
    assert!(
        half.low.distance(Vec2::new(0.75, 0.25)) < 1e-6 && half.high.distance(Vec2::new(5.75, 4.25)) < 1e-6
    );
}

/// A motion too large for one linearisation is found by several.
#[test]
fn every_warp_comes_nearer_to_the_motion() {
    let motion = Vec2::new(1.1, -0.8);
    let [first, second] = moving(motion, 48, 40);
    let mut region = Image::filled(48, 40, false);
    (8..32).for_each(|y| region.row_mut(y)[8..40].fill(true));
    let error = |warps: usize| {
        let options = FlowOptions { smoothness: 5.0, warps, ..EXACT };
        let found = velocity_field(&first.as_frame(), &second.as_frame(), &region, &options).unwrap();
        let errors = (8..32).flat_map(|y| (8..40).map(move |x| (x, y)));
        errors.map(|(x, y)| found.at(x, y).unwrap().distance(motion.as_dvec2())).sum::<f64>() / (24.0 * 32.0)
    };
    let [one, five] = [1, 5].map(error);
    assert!(five < 0.5 * one && five < 0.03, "{one} {five}");
}

/// A component counts as determined from the given gradient on, along its weaker direction.
#[test]
fn evidence_begins_at_the_least_gradient() {
    let [first, second] = moving(Vec2::new(0.2, 0.1), 40, 40);
    let mut region = Image::filled(40, 40, false);
    (10..30).for_each(|y| region.row_mut(y)[10..30].fill(true));
    let evidence = |min_gradient: f64| {
        let options = FlowOptions { min_gradient, ..EXACT };
        let found = velocity_field(&first.as_frame(), &second.as_frame(), &region, &options).unwrap();
        (found.components[0].evidence, found.components[0].gradient_rms)
    };
    let (_, [weaker, stronger]) = evidence(0.1);
    assert_eq!(evidence(0.999 * weaker).0, FlowEvidence::Determined);
    assert_eq!(evidence(1.001 * weaker).0, FlowEvidence::OneDirection);
    assert_eq!(evidence(0.999 * stronger).0, FlowEvidence::OneDirection);
    assert_eq!(evidence(1.001 * stronger).0, FlowEvidence::Textureless);
}

/// Iterations and residual are those of the full-size level, and a solution stopped early reports its
/// residual.
#[test]
fn steps_are_counted_on_the_last_level() {
    let [first, second] = moving(Vec2::new(0.6, 0.3), 64, 64);
    let mut region = Image::filled(64, 64, false);
    (10..54).for_each(|y| region.row_mut(y)[10..54].fill(true));
    let options = FlowOptions { levels: 4, warps: 2, max_iterations: 2, tolerance: 1e-14, ..EXACT };
    let found = velocity_field(&first.as_frame(), &second.as_frame(), &region, &options).unwrap();
    assert_eq!(found.iterations, 4);
    assert!(found.relative_residual > 1e-14, "{}", found.relative_residual);
}
