use super::*;
use crate::image::Image;
use glam::DVec2;
use proptest::prelude::*;

/// Grey levels of a half plane, each pixel weighted by the part of its square that lies inside: a box of
/// width a = |n_x| smoothed by one of width b = |n_y|, integrated up to the distance of the border.
fn half_plane(size: usize, normal: Vec2, offset_px: f32, dark: f32, bright: f32) -> Image<u8> {
    let normal = normal.as_dvec2();
    let (a, b) = (normal.x.abs().max(1e-4), normal.y.abs().max(1e-4));
    let ramp_sq = |t: f64| t.max(0.0).powi(2);
    let part = |d: f64| {
        let (far, near) = (0.5 * (a + b), 0.5 * (a - b));
        (ramp_sq(d + far) - ramp_sq(d + near) - ramp_sq(d - near) + ramp_sq(d - far)) / (2.0 * a * b)
    };
    let data = (0..size * size).map(|p| {
        let at = DVec2::new((p % size) as f64, (p / size) as f64) - (size / 2) as f64;
        let part = part(normal.dot(at) - f64::from(offset_px)) as f32;
        (dark + (bright - dark) * part).round() as u8
    });
    Image::from_vec(size, size, data.collect()).unwrap()
}

fn clutter(width: usize, height: usize) -> Image<u8> {
    let value = |p: usize| {
        let (x, y) = ((p % width) as f32, (p / width) as f32);
        (128.0 + 60.0 * (0.31 * x + 0.11 * y).sin() + 50.0 * (0.17 * x - 0.4 * y).cos()) as u8
    };
    Image::from_vec(width, height, (0..width * height).map(value).collect()).unwrap()
}

fn sorted_pixels(edgels: impl Iterator<Item = Edgel>) -> Vec<[u32; 4]> {
    let key = |e: Edgel| [e.position_px.y, e.position_px.x, e.gradient.x, e.gradient.y].map(f32::to_bits);
    let mut keys: Vec<_> = edgels.map(key).collect();
    keys.sort_unstable();
    keys
}

#[test]
fn a_ramp_of_two_grey_levels_a_pixel_has_gradient_two() {
    let mut ramp = Image::filled(64, 32, 0u8);
    for y in 0..32 {
        ramp.row_mut(y).iter_mut().enumerate().for_each(|(x, g)| *g = 2 * x as u8 + y as u8);
    }
    let taps = Taps::new(1.3);
    let rows: Vec<FilteredRow> = (0..=2 * taps.radius())
        .map(|y| {
            let mut grey = vec![0.0; 48 + 2 * taps.radius()];
            pad_row(ramp.row(y), 0, &mut grey);
            let mut row = FilteredRow { smooth: vec![0.0; 48], slope: vec![0.0; 48] };
            filter_along_row(&grey, &taps, &mut row);
            row
        })
        .collect();
    let mut gradient = GradientRow { x: vec![0.0; 48], y: vec![0.0; 48], magnitude_sq: vec![0.0; 48] };
    filter_across_rows(&rows, &taps, &mut gradient);
    for i in 0..48 {
        assert!((gradient.x[i] - 2.0).abs() < 1e-4 && (gradient.y[i] - 1.0).abs() < 1e-4);
    }
}

#[test]
fn the_streamed_gradient_equals_the_convolution_sum() {
    let image = clutter(40, 30);
    let options = EdgeOptions { sigma_px: 1.7, low: 1.0, high: 1.0 };
    let taps = Taps::new(options.sigma_px);
    let r = taps.radius() as isize;
    let grey = |x: isize, y: isize| f32::from(image.at(x.clamp(0, 39) as usize, y.clamp(0, 29) as usize));
    let g = |k: isize| taps.smooth[k.unsigned_abs()];
    let d = |k: isize| taps.slope[k.unsigned_abs()] * k.signum() as f32;
    let chains = edge_chains(&image.as_frame(), &EdgeDomain::default(), &options).unwrap();
    assert!(chains.edgels().len() > 100);
    for edgel in chains.edgels() {
        let (x, y) = (edgel.position_px.x.round() as isize, edgel.position_px.y.round() as isize);
        let sum = |wx: &dyn Fn(isize) -> f32, wy: &dyn Fn(isize) -> f32| -> f32 {
            (-r..=r).map(|j| (-r..=r).map(|i| wx(i) * wy(j) * grey(x + i, y + j)).sum::<f32>()).sum()
        };
        let expected = Vec2::new(sum(&d, &g), sum(&g, &d));
        assert!(edgel.gradient.distance(expected) < 1e-3, "{edgel:?} against {expected}");
    }
}

#[test]
fn a_straight_step_is_one_chain_with_the_bright_side_on_its_right() {
    for degrees in [0.0f32, 17.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 300.0] {
        let normal = Vec2::from_angle(degrees.to_radians());
        let image = half_plane(48, normal, 0.3, 40.0, 160.0);
        let chains = edge_chains(&image.as_frame(), &EdgeDomain::default(), &EdgeOptions::default()).unwrap();
        assert_eq!(chains.iter().len(), 1, "at {degrees} degrees");
        let chain = chains.iter().next().unwrap();
        assert!(chain.len() >= 46, "{} edge points at {degrees} degrees", chain.len());
        let way = chain[chain.len() - 1].position_px - chain[0].position_px;
        assert!(way.normalize().perp_dot(normal) > 0.999, "at {degrees} degrees");
        assert!(chain.iter().all(|e| e.tangent().dot(way) > 0.0));
    }
}

#[test]
fn hysteresis_keeps_a_faint_part_only_where_it_continues_a_strong_one() {
    let mut image = Image::filled(40, 70, 100u8);
    for y in 0..70 {
        let bright = 118 + 2 * (40usize.saturating_sub(y));
        image.row_mut(y)[20..].fill(bright as u8);
    }
    let count = |window| {
        let domain = EdgeDomain { window: Some(window), mask: None };
        let chains = edge_chains(&image.as_frame(), &domain, &EdgeOptions::default()).unwrap();
        chains.edgels().iter().filter(|e| e.position_px.y > 40.0 && e.position_px.x < 21.0).count()
    };
    assert_eq!(count(Window { x: 0, y: 0, width: 30, height: 70 }), 29);
    assert_eq!(count(Window { x: 0, y: 41, width: 30, height: 29 }), 0);
}

#[test]
fn a_closed_edge_is_one_chain() {
    let mut image = Image::filled(50, 50, 60u8);
    for (p, grey) in image.pixels_mut().iter_mut().enumerate() {
        let d = Vec2::new((p % 50) as f32 - 25.2, (p / 50) as f32 - 24.7).length() - 15.0;
        *grey = (60.0 + 100.0 * (0.5 - d).clamp(0.0, 1.0)) as u8;
    }
    let chains = edge_chains(&image.as_frame(), &EdgeDomain::default(), &EdgeOptions::default()).unwrap();
    assert_eq!(chains.iter().len(), 1);
    assert!(
        chains
            .edgels()
            .iter()
            .all(|e| { (e.position_px.distance(Vec2::new(25.2, 24.7)) - 15.0).abs() < 0.15 })
    );
}

#[test]
fn bad_options_and_masks_are_refused_with_their_values() {
    let image = clutter(20, 20);
    let refusal =
        |options: EdgeOptions| edge_chains(&image.as_frame(), &EdgeDomain::default(), &options).unwrap_err();
    for sigma_px in [0.0, -1.0, 51.0, f32::INFINITY] {
        let error = refusal(EdgeOptions { sigma_px, ..Default::default() });
        let wanted = "between 0.4 and 50 px";
        let refused = OptionError { name: "sigma_px", wanted, got: f64::from(sigma_px) };
        assert_eq!(error, EdgeError::Option(refused));
    }
    assert!(matches!(
        refusal(EdgeOptions { sigma_px: f32::NAN, ..Default::default() }),
        EdgeError::Option(OptionError { name: "sigma_px", .. })
    ));
    for (low, high, name) in [(0.0, 1.0, "low"), (6.0, 5.0, "high"), (1.0, f32::INFINITY, "high")] {
        let error = refusal(EdgeOptions { low, high, ..Default::default() });
        assert!(matches!(error, EdgeError::Option(refused) if refused.name == name), "{error}");
    }
    let mask = Mask::filled(19, 20, true);
    let domain = EdgeDomain { mask: Some(&mask), window: None };
    let error = edge_chains(&image.as_frame(), &domain, &EdgeOptions::default()).unwrap_err();
    assert!(matches!(error, EdgeError::Mask(FrameError::SizeChanged { width: 19, .. })));
}

#[test]
fn frames_and_windows_of_any_size_are_searched() {
    for (width, height) in [(1, 1), (1, 9), (9, 1), (2, 2), (3, 17), (16, 5)] {
        let image = clutter(width, height);
        for sigma_px in [0.5, 1.0, 8.0] {
            let options = EdgeOptions { sigma_px, low: 0.1, high: 0.1 };
            edge_chains(&image.as_frame(), &EdgeDomain::default(), &options).unwrap();
        }
    }
    let image = clutter(20, 20);
    for window in [(0, 0, 0, 5), (25, 3, 4, 4), (19, 19, 9, 9), (0, 0, usize::MAX, usize::MAX)] {
        let (x, y, width, height) = window;
        let domain = EdgeDomain { mask: None, window: Some(Window { x, y, width, height }) };
        edge_chains(&image.as_frame(), &domain, &EdgeOptions::default()).unwrap();
    }
    let flat = Image::filled(30, 30, 77u8);
    let none = edge_chains(&flat.as_frame(), &EdgeDomain::default(), &EdgeOptions::default()).unwrap();
    assert!(none.edgels().is_empty() && none.iter().len() == 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn a_planted_edge_is_found_to_a_fraction_of_a_pixel(
        angle in 0.0f32..std::f32::consts::TAU,
        offset in -3.0f32..3.0,
        contrast in 40.0f32..200.0,
    ) {
        let normal = Vec2::from_angle(angle);
        let image = half_plane(40, normal, offset, 20.0, 20.0 + contrast);
        let window = Window { x: 5, y: 5, width: 30, height: 30 };
        let domain = EdgeDomain { mask: None, window: Some(window) };
        let options = EdgeOptions { low: 0.2 * contrast, high: 0.3 * contrast, ..Default::default() };
        let chains = edge_chains(&image.as_frame(), &domain, &options).unwrap();
        prop_assert!(chains.edgels().len() >= 25);
        for edgel in chains.edgels() {
            let distance = normal.dot(edgel.position_px - Vec2::splat(20.0)) - offset;
            prop_assert!(distance.abs() < 0.07, "{distance} px off");
            prop_assert!(edgel.gradient.normalize().dot(normal) > 0.999);
        }
    }

    #[test]
    fn a_restricted_search_finds_what_the_whole_frame_has_there(
        x in 0usize..30, y in 0usize..20, width in 1usize..30, height in 1usize..25, use_mask in any::<bool>(),
    ) {
        let image = clutter(47, 33);
        let options = EdgeOptions { low: 4.0, high: 4.0, ..Default::default() };
        let all = edge_chains(&image.as_frame(), &EdgeDomain::default(), &options).unwrap();
        let mut mask = Mask::filled(47, 33, false);
        for row in y..(y + height).min(33) {
            mask.row_mut(row)[x..(x + width).min(47)].fill(true);
        }
        let window = Window { x, y, width, height };
        let domain = if use_mask {
            EdgeDomain { mask: Some(&mask), window: None }
        } else {
            EdgeDomain { mask: None, window: Some(window) }
        };
        let part = edge_chains(&image.as_frame(), &domain, &options).unwrap();
        let is_inside = |e: &Edgel| {
            mask.at((e.position_px.x).round() as usize, (e.position_px.y).round() as usize)
        };
        let expected = sorted_pixels(all.edgels().iter().copied().filter(is_inside));
        prop_assert_eq!(sorted_pixels(part.edgels().iter().copied()), expected);
    }
}

fn edgel(x: f32, y: f32, gradient: Vec2) -> Edgel {
    Edgel { position_px: Vec2::new(x, y), gradient }
}

/// Edge points are linked where their gradients differ by up to 60 degrees, whatever their magnitude.
#[test]
fn gradients_up_to_sixty_degrees_apart_belong_to_one_edge() {
    for (degrees, is_one) in
        [(0.0f32, true), (50.0, true), (59.0, true), (61.0, false), (90.0, false), (180.0, false)]
    {
        let angle = 0.5 * degrees.to_radians();
        // The mean of both gradients points along x, so the step goes along y.
        let [a, b] = [Vec2::from_angle(angle), Vec2::from_angle(-angle)].map(|direction| 10.0 * direction);
        let step = step_between(&edgel(0.0, 0.0, a), &edgel(0.0, 1.0, b));
        assert_eq!(step.is_some(), is_one, "{degrees}");
        assert!(step.is_none_or(|step| (step.cost - 1.0).abs() < 1e-5));
        let stronger = step_between(&edgel(0.0, 0.0, a), &edgel(0.0, 1.0, 3.0 * b));
        assert_eq!(stronger.is_some(), is_one, "{degrees}");
    }
}

/// A step must go along the edge more than across it; a distance across costs four times as much as one along
/// it.
#[test]
fn steps_go_along_the_edge() {
    let gradient = Vec2::new(10.0, 0.0);
    let from = edgel(0.0, 0.0, gradient);
    for (x, y, cost) in [
        (0.0, 1.0, Some(1.0)),
        (0.5, 1.0, Some(2.0)),
        (0.9, -1.0, Some(4.24)),
        (1.1, 1.0, None),
        (1.0, 0.0, None),
    ] {
        let step = step_between(&from, &edgel(x, y, gradient));
        assert_eq!(step.is_some(), cost.is_some(), "{x} {y}");
        if let (Some(step), Some(cost)) = (step, cost) {
            assert!((step.cost - cost).abs() < 1e-5, "{}", step.cost);
            // The gradient points to the bright side, which is on the right of the direction of travel: y is
            // down, so ahead is up.
            assert_eq!(step.is_forward, y < 0.0, "{x} {y}");
        }
    }
}

/// The maximum of a Gaussian profile is found exactly.
#[test]
fn the_summit_of_a_gaussian_is_found_exactly() {
    for offset in [-0.45f32, -0.2, 0.0, 0.1, 0.4] {
        for width in [0.8f32, 1.3, 2.5] {
            let at = |x: f32| (-(x - offset).powi(2) / (width * width)).exp();
            let found = peak_offset(at(-1.0), at(0.0), at(1.0));
            assert!((found - offset).abs() < 1e-5, "{offset} {width}: {found}");
        }
    }
}

/// A vertical step in the middle, whose height changes linearly from `upper` to `lower` between rows 15 and
/// 45.
fn step(upper: u8, lower: u8) -> Image<u8> {
    let mut image = Image::filled(40, 60, 60u8);
    for y in 0..60 {
        let part = ((y as f32 - 15.0) / 30.0).clamp(0.0, 1.0);
        let height = f32::from(upper) + part * (f32::from(lower) - f32::from(upper));
        image.row_mut(y)[20..].fill(60 + height.round() as u8);
    }
    image
}

fn chains_of(image: &Image<u8>, mask: Option<&Mask>) -> EdgeChains {
    let domain = EdgeDomain { mask, window: Some(Window { x: 5, y: 5, width: 30, height: 50 }) };
    edge_chains(&image.as_frame(), &domain, &EdgeOptions::default()).unwrap()
}

/// Beside a step of h the smoothed gradient is h Σ k e^(-k²/2) / 2 Σ k² e^(-k²/2) over k = 1, 2, 3: 0.365 h.
/// An edge starts at 12 grey levels per pixel and continues down to 5.
#[test]
fn edges_begin_and_end_at_their_gradients() {
    let sums = (1..=3).map(f64::from).fold((0.0, 0.0), |(first, second), k: f64| {
        let g = (-0.5 * k * k).exp();
        (first + k * g, second + k * k * g)
    });
    let slope = sums.0 / (2.0 * sums.1);
    assert!((slope - 0.365).abs() < 1e-3, "{slope}");
    let least = |gradient: f64| (gradient / slope).ceil() as u8;
    for (height, is_edge) in [(least(12.0) - 1, false), (least(12.0), true)] {
        assert_eq!(chains_of(&step(height, height), None).iter().len() == 1, is_edge, "{height}");
    }
    // Faint below, strong above.
    for (height, goes_on) in [(least(5.0) - 1, false), (least(5.0), true)] {
        let chains = chains_of(&step(60, height), None);
        let below = chains.edgels().iter().filter(|e| e.position_px.y > 48.0).count();
        assert_eq!(below > 4, goes_on, "{height}");
    }
}

/// One missing edge point does not split an edge, two do; and a faint part does not continue over a missing
/// one.
#[test]
fn edges_bridge_a_single_missing_point() {
    let hole = |rows: std::ops::Range<usize>| {
        let mut mask = Image::filled(40, 60, true);
        rows.for_each(|y| mask.row_mut(y).fill(false));
        mask
    };
    let image = step(60, 60);
    for (rows, count) in [(0..0, 1), (20..21, 1), (20..22, 2)] {
        let chains = chains_of(&image, Some(&hole(rows.clone())));
        assert_eq!(chains.iter().len(), count, "{rows:?}");
    }
    // 0.365 times 20: a faint edge below a strong one.
    let image = step(60, 20);
    let faint = |mask: &Mask| {
        let chains = chains_of(&image, Some(mask));
        chains.edgels().iter().filter(|e| e.position_px.y > 40.0).count()
    };
    assert!(faint(&hole(0..0)) > 10);
    assert_eq!(faint(&hole(38..39)), 0);
}
