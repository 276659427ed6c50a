//! Rates at which hinges and rods pass as planar: unrelated points, true limbs, false groups of one body.
//!
//! The thresholds of `planar::evidence` were chosen on other draws: strides, directions, joints and offsets
//! of the same four walkers, all pairs. The table keeps the pairs of one laboratory each apart from the other
//! four. Four walkers are few, so a rate is good to about one part in three. Run with `--nocapture` for the
//! tables.

use crate::mocap;

use glam::DVec2;
use memo_core::planar::{
    FalseTargetRate, FitOptions, PlanarEvidenceOptions, Undecided, Verdict, fit_hinge, fit_rod,
    hinge_evidence, rod_evidence,
};
use memo_core::synth::Random;
use mocap::JOINTS;
use mocap::stride::{LIMBS, Walk, azimuth_deg, noisy, walks};

/// 200 px/m.
const PIXEL_M: f64 = 0.005;
const DRAWS: usize = 1000;

/// Pairs of walkers, by where they were recorded.
const TWO_LABORATORIES: [[usize; 2]; 4] = [[0, 2], [0, 3], [1, 2], [1, 3]];
const SAME_LABORATORY: [[usize; 2]; 2] = [[0, 1], [2, 3]];

type Track = Vec<DVec2>;

/// Fractions of a sample by verdict, at one rate.
#[derive(Debug, Default, Clone, Copy)]
struct Shares {
    count: f64,
    planar: f64,
    little_motion: f64,
    edge_on: f64,
}

impl Shares {
    fn add(&mut self, verdict: Verdict) {
        self.count += 1.0;
        self.planar += f64::from(u8::from(verdict == Verdict::Planar));
        self.little_motion += f64::from(u8::from(verdict == Verdict::Undecided(Undecided::LittleMotion)));
        self.edge_on += f64::from(u8::from(verdict == Verdict::Undecided(Undecided::EdgeOn)));
    }

    fn planar_percent(&self) -> f64 {
        100.0 * self.planar / self.count
    }
}

/// Verdicts of groups of three (hinges) or two points at 1 % and 5 %.
fn shares(groups: &[Vec<Track>], noise_px: f64, random: &mut Random) -> [Shares; 2] {
    let noise_sd = noise_px * PIXEL_M;
    let fit_options = FitOptions { noise_sd, max_outlier_fraction: 0.0, ..FitOptions::default() };
    let mut shares = [Shares::default(); 2];
    for group in groups {
        let seen: Vec<Track> = group.iter().map(|track| noisy(track, noise_sd, random)).collect();
        for (share, rate) in
            shares.iter_mut().zip([FalseTargetRate::OnePercent, FalseTargetRate::FivePercent])
        {
            let options = PlanarEvidenceOptions { rate, ..PlanarEvidenceOptions::default() };
            let evidence = if let [first, pivot, second] = &seen[..] {
                hinge_evidence(&fit_hinge(first, pivot, second, &fit_options).unwrap(), noise_sd, &options)
            } else {
                rod_evidence(&fit_rod(&seen[0], &seen[1], &fit_options).unwrap(), noise_sd, &options)
            };
            share.add(evidence.verdict);
        }
    }
    shares
}

fn index(random: &mut Random, below: usize) -> usize {
    random.uniform(0.0, below as f64) as usize
}

/// Any joint of a walker seen from anywhere, about its mean, moved by 25 cm.
fn unrelated_joint(walk: &Walk, views: usize, random: &mut Random) -> Track {
    let seen = walk.views(random.uniform(0.0, 1.0), views, azimuth_deg(random));
    let joint = &seen.image[index(random, JOINTS.len())];
    let mean = joint.iter().sum::<DVec2>() / views as f64;
    let offset = 0.25 * DVec2::from_array(random.normal_pair().map(f64::from));
    joint.iter().map(|p| *p - mean + offset).collect()
}

/// Pivot of one walker, ends of the other.
fn of_two_walkers(
    walks: &[Walk],
    pairs: &[[usize; 2]],
    size: usize,
    views: usize,
    random: &mut Random,
) -> Vec<Vec<Track>> {
    let mut group = |_| {
        let mut pair = pairs[index(random, pairs.len())];
        if random.uniform(0.0, 1.0) < 0.5 {
            pair.reverse();
        }
        let walker = |k: usize| if k == size - 2 { pair[0] } else { pair[1] };
        (0..size).map(|k| unrelated_joint(&walks[walker(k)], views, random)).collect()
    };
    (0..DRAWS).map(&mut group).collect()
}

/// Points on paths of two harmonics.
fn smooth(size: usize, views: usize, random: &mut Random) -> Vec<Vec<Track>> {
    let mut track = |_| {
        let mut vector = || DVec2::from_array(random.normal_pair().map(f64::from));
        let [mean, a, b, c, d] = [(); 5].map(|()| vector());
        let amplitude = random.uniform(0.02, 0.2);
        let at = |view: usize| {
            let (sin, cos) = (std::f64::consts::TAU * view as f64 / views as f64).sin_cos();
            let second = 0.4 * (c * 2.0 * sin * cos + d * (cos * cos - sin * sin));
            0.25 * mean + amplitude * (a * cos + b * sin + second)
        };
        (0..views).map(at).collect()
    };
    (0..DRAWS).map(|_| (0..size).map(&mut track).collect()).collect()
}

/// Points anywhere in every view.
fn scattered(size: usize, views: usize, random: &mut Random) -> Vec<Vec<Track>> {
    let mut point = |_| 0.25 * DVec2::from_array(random.normal_pair().map(f64::from));
    (0..DRAWS).map(|_| (0..size).map(|_| (0..views).map(&mut point).collect()).collect()).collect()
}

/// One stride of every walk from 30 directions, `pick` choosing groups of joints.
fn of_one_body(
    walks: &[Walk],
    views: usize,
    random: &mut Random,
    pick: impl Fn(&mut Random) -> Vec<Vec<usize>>,
) -> Vec<Vec<Track>> {
    let mut groups = Vec::new();
    for walk in walks {
        for _ in 0..30 {
            let seen = walk.views(random.uniform(0.0, 1.0), views, azimuth_deg(random));
            let track = |joint: &usize| seen.image[*joint].clone();
            groups.extend(pick(random).iter().map(|group| group.iter().map(track).collect()));
        }
    }
    groups
}

/// Ordered groups of a body that are no limb's hinge or rod.
fn false_groups(size: usize, random: &mut Random) -> Vec<Vec<usize>> {
    let mut groups = Vec::new();
    while groups.len() < 4 {
        let group: Vec<usize> = (0..size).map(|_| index(random, 12)).collect();
        let differ = (0..size).all(|i| (0..i).all(|j| group[i] != group[j]));
        let is_limb = |limb: &[usize; 3]| {
            let at = |joint: usize| limb.iter().position(|l| *l == joint);
            match group[..] {
                [a, o, b] => at(o) == Some(1) && at(a).is_some() && at(b).is_some(),
                [a, b] => at(a).zip(at(b)).is_some_and(|(a, b)| a.abs_diff(b) == 1),
                _ => false,
            }
        };
        if differ && !LIMBS.iter().any(is_limb) {
            groups.push(group);
        }
    }
    groups
}

fn true_groups(size: usize) -> Vec<Vec<usize>> {
    LIMBS.iter().flat_map(|limb| limb.windows(size).map(<[usize]>::to_vec)).collect()
}

/// One line of the table: percent planar at 1 % and at 5 %, percent undecided.
fn row(name: &str, views: usize, noise_px: f64, shares: [Shares; 2]) {
    println!(
        "{name:<34} {views:>5} {noise_px:>5} {:>9.1} {:>9.1} {:>14.1} {:>9.1}",
        shares[0].planar_percent(),
        shares[1].planar_percent(),
        100.0 * shares[1].little_motion / shares[1].count,
        100.0 * shares[1].edge_on / shares[1].count,
    );
}

/// Shares at 1 % and 5 % of one number of views and noise.
struct Cell {
    views: usize,
    noise_px: f64,
    /// Pairs of one laboratory, of two, smooth, scattered.
    unrelated: Vec<[Shares; 2]>,
    limbs: [Shares; 2],
}

/// Prints all rates of groups of a size.
fn table(walks: &[Walk], size: usize) -> Vec<Cell> {
    println!(
        "{:<34} {:>5} {:>5} {:>9} {:>9} {:>14} {:>9}",
        "% planar", "views", "px", "at 1 %", "at 5 %", "little motion", "edge-on"
    );
    let mut results = Vec::new();
    for views in [15, 60] {
        for noise_px in [0.0, 1.0, 2.0] {
            let mut random = Random::new(7000 + views as u64);
            let nulls = [
                (
                    "unrelated, one laboratory",
                    of_two_walkers(walks, &SAME_LABORATORY, size, views, &mut random),
                ),
                (
                    "unrelated, two laboratories",
                    of_two_walkers(walks, &TWO_LABORATORIES, size, views, &mut random),
                ),
                ("unrelated, smooth synthetic", smooth(size, views, &mut random)),
                ("unrelated, scattered", scattered(size, views, &mut random)),
            ];
            let mut unrelated = Vec::new();
            for (name, groups) in nulls {
                let shares = shares(&groups, noise_px, &mut random);
                row(name, views, noise_px, shares);
                unrelated.push(shares);
            }
            let limbs = of_one_body(walks, views, &mut random, |_| true_groups(size));
            let limbs = shares(&limbs, noise_px, &mut random);
            row("true limbs", views, noise_px, limbs);
            let within = of_one_body(walks, views, &mut random, |random| false_groups(size, random));
            row("false groups of one body", views, noise_px, shares(&within, noise_px, &mut random));
            results.push(Cell { views, noise_px, unrelated, limbs });
        }
    }
    results
}

/// Largest percentage that `count` draws at a rate may show: two standard deviations above it.
fn allowed(rate: f64, count: f64) -> f64 {
    100.0 * (rate + 2.0 * (rate * (1.0 - rate) / count).sqrt())
}

/// Every kind of unrelated motion keeps its rate within the sampling error, and the pairs of walkers of all
/// views and noises together keep it outright.
fn assert_rates(results: &[Cell]) {
    for (level, rate) in [0.01, 0.05].into_iter().enumerate() {
        for cell in results {
            for shares in cell.unrelated.iter().map(|shares| shares[level]) {
                let (views, noise_px) = (cell.views, cell.noise_px);
                assert!(
                    shares.planar_percent() <= allowed(rate, shares.count),
                    "{rate} at {views} views, {noise_px} px: {shares:?}"
                );
            }
        }
        let pairs = || results.iter().flat_map(|cell| &cell.unrelated[..2]).map(|shares| shares[level]);
        let (planar, count) = pairs().fold((0.0, 0.0), |(p, n), s| (p + s.planar, n + s.count));
        println!("pairs of walkers at {rate}: {:.2} % of {count} pass", 100.0 * planar / count);
        assert!(planar <= rate * count);
    }
}

#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn hinges_keep_the_stated_rates() {
    let walks = walks();
    let results = table(&walks, 3);
    assert_rates(&results);
    for Cell { views, noise_px, limbs, .. } in results {
        // At 2 px 15 views do not tell so many at 1 %: 56 %.
        let at_one_percent = if views == 15 && noise_px == 2.0 { 50.0 } else { 60.0 };
        assert!(limbs[0].planar_percent() >= at_one_percent, "{views} views, {noise_px} px: {limbs:?}");
        assert!(limbs[1].planar_percent() >= 70.0, "{views} views, {noise_px} px: {limbs:?}");
    }
}

#[test]
#[cfg_attr(not(recordings), ignore = "skipped: no recordings (set MEMO_SHARED_DATA)")]
fn rods_keep_the_stated_rates() {
    let walks = walks();
    let results = table(&walks, 2);
    assert_rates(&results);
    // A rod is weaker evidence than a hinge: at 1 % and with noise few true ones pass.
    for cell in results {
        assert!(cell.limbs[1].planar_percent() >= 50.0, "{:?}", cell.limbs);
    }
}
