//! The groups of a window: all rods and hinges that may be part of the figure, their costs, and the division into
//! groups with the smallest cost.

use super::FigureOptions;
use super::cover::{MOST_POINTS, Piece, best_cover};
use super::linkage::{Chain, Contact, Figure, Link, Method};
use crate::planar::{
    FitError, HingeFit, RodFit, fit_hinge, hinge_evidence, rod_evidence, test_pairs, test_triples,
};
use glam::{DVec2, DVec3};

/// Fits and distances of all rods of a window.
struct Rods {
    points: usize,
    /// For i < j at index i * points + j; `None` if they cannot be fitted.
    fits: Vec<Option<RodFit>>,
    /// Separation of two points, in both directions, relative to the size.
    apart: Vec<f64>,
}

impl Rods {
    fn fitted(tracks: &[&[DVec2]], size: f64, options: &FigureOptions) -> Self {
        let points = tracks.len();
        let both_ways = |index: usize| (index / points, index % points);
        let none = || Err(FitError::TooFewViews { found: 0, needed: 0 });
        let mut results: Vec<Result<RodFit, FitError>> = (0..points * points).map(|_| none()).collect();
        for pair in test_pairs(tracks, &options.fit, &options.evidence) {
            results[pair.points[0] * points + pair.points[1]] = pair.tested.map(|(fit, _)| fit);
        }
        let apart = (0..points * points).map(|index| {
            let (i, j) = both_ways(index);
            match &results[i.min(j) * points + i.max(j)] {
                Ok(fit) => {
                    (unexplained(fit.residual_rms, options) + clean_motion(fit.motion, options)) / size
                }
                // What keeps its separation is nearer than what moves less than noise does.
                Err(FitError::NoMotion { .. }) => unexplained(0.0, options) / size,
                Err(_) => f64::INFINITY,
            }
        });
        let apart = apart.collect();
        Self { points, fits: results.into_iter().map(Result::ok).collect(), apart }
    }

    fn fit(&self, i: usize, j: usize) -> Option<&RodFit> {
        self.fits[i.min(j) * self.points + i.max(j)].as_ref()
    }

    fn apart(&self, i: usize, j: usize) -> f64 {
        self.apart[i * self.points + j]
    }

    /// Separation of a group from the nearest point outside it, measured at one of its ends.
    fn detachment(&self, ends: &[usize], group: &[usize], most: f64) -> f64 {
        let outside = |j: &usize| !group.contains(j);
        let nearest = |&end: &usize| (0..self.points).filter(outside).map(move |j| self.apart(end, j));
        ends.iter().flat_map(nearest).fold(most, f64::min)
    }
}

/// A residual without (a share of) the contribution of noise.
fn unexplained(residual_rms: f64, options: &FigureOptions) -> f64 {
    residual_rms - options.costs.noise * std::f64::consts::SQRT_2 * options.fit.noise_sd
}

/// RMS motion of an image vector without the contribution of noise to its four coordinates.
fn clean_motion(motion: f64, options: &FigureOptions) -> f64 {
    (motion * motion - 4.0 * options.fit.noise_sd.powi(2)).max(0.0).sqrt()
}

/// A hinge of the window that may be part of the figure.
struct Candidate {
    /// End, pivot, end; or end, end; or a single point.
    points: Vec<usize>,
    cost: f64,
}

/// The figure with the smallest cost in one window.
pub(super) fn best_figure(tracks: &[&[DVec2]], size: f64, options: &FigureOptions) -> Figure {
    let rods = Rods::fitted(tracks, size, options);
    if tracks.len() > options.most_covered.min(MOST_POINTS) {
        return forest(tracks, &rods, size, options);
    }
    let candidates = candidates(tracks, &rods, size, options);
    let pieces: Vec<Piece> = candidates
        .iter()
        .map(|c| Piece { mask: c.points.iter().fold(0, |mask, &p| mask | 1 << p), cost: c.cost })
        .collect();
    let cover = best_cover(tracks.len(), &pieces, options.costs.temperature)
        .expect("single points are among the pieces");
    let rival = |link: [usize; 2]| {
        // Every cover contains one piece with the link's first point.
        let holds = |c: &Candidate| c.points.contains(&link[0]) && !links_of(&c.points).any(|l| l == link);
        let others = candidates.iter().zip(&cover.cost_with).filter(|(c, _)| holds(c));
        others.map(|(_, &cost)| cost).fold(f64::INFINITY, f64::min)
    };
    let share = |link: [usize; 2]| {
        let having =
            candidates.iter().zip(&cover.share).filter(|(c, _)| links_of(&c.points).any(|l| l == link));
        having.map(|(_, share)| share).sum::<f64>().min(1.0)
    };
    let judge = |link: [usize; 2]| ((rival(link) - cover.cost) * size, share(link));
    let groups: Vec<Vec<usize>> = cover.chosen.iter().map(|&i| candidates[i].points.clone()).collect();
    let joints = joints(&groups, &rods, size, options);
    let chains = groups.iter().filter(|g| g.len() > 1);
    let chains = chains.filter_map(|group| chain(group, tracks, &rods, &joints, options, &judge)).collect();
    let alone = groups.iter().filter(|g| g.len() == 1).map(|g| g[0]).collect();
    Figure { method: Method::Cover, chains, joints, alone, cost: cover.cost * size, size }
}

/// The links of a chain, from its points in order.
fn links_of(points: &[usize]) -> impl Iterator<Item = [usize; 2]> {
    points.windows(2).map(|pair| [pair[0].min(pair[1]), pair[0].max(pair[1])])
}

/// All single points, rods and hinges with their costs.
fn candidates(tracks: &[&[DVec2]], rods: &Rods, size: f64, options: &FigureOptions) -> Vec<Candidate> {
    let (points, costs) = (tracks.len(), &options.costs);
    let most = 3.0 * costs.alone + costs.detached;
    let mut found: Vec<Candidate> = (0..points)
        .map(|i| Candidate { points: vec![i], cost: rods.detachment(&[i], &[i], costs.alone) })
        .collect();
    for i in 0..points {
        for j in i + 1..points {
            let Some(fit) = rods.fit(i, j) else { continue };
            let own =
                unexplained(fit.residual_rms, options) / size + costs.length * fit.length / size + costs.rod;
            let cost = own + rods.detachment(&[i, j], &[i, j], costs.detached);
            if cost < most {
                found.push(Candidate { points: vec![i, j], cost });
            }
        }
    }
    for triple in test_triples(tracks, &options.fit, &options.evidence) {
        let ([i, pivot, j], Ok((fit, _))) = (triple.points, triple.tested) else { continue };
        let length = (fit.lengths[0] + fit.lengths[1]) / size;
        let own = unexplained(fit.residual_rms, options) / size + costs.length * length;
        let cost = own + rods.detachment(&[i, j], &[i, pivot, j], costs.detached);
        if cost < most {
            found.push(Candidate { points: vec![i, pivot, j], cost });
        }
    }
    found
}

/// Contacts between groups: the minimum spanning forest over ends that stay together.
fn joints(groups: &[Vec<usize>], rods: &Rods, size: f64, options: &FigureOptions) -> Vec<Contact> {
    let ends = |group: &[usize]| [group[0], group[group.len() - 1]];
    let mut pairs = Vec::new();
    for (a, first) in groups.iter().enumerate() {
        for (b, second) in groups.iter().enumerate().skip(a + 1) {
            let between =
                ends(first).into_iter().flat_map(|i| ends(second).map(|j| (rods.apart(i, j), i, j)));
            if let Some((apart, i, j)) = between.min_by(|x, y| x.0.total_cmp(&y.0)) {
                pairs.push((apart, a, b, [i, j]));
            }
        }
    }
    pairs.retain(|pair| pair.0 < options.costs.detached);
    let edges = spanning_forest(groups.len(), &mut pairs);
    edges.into_iter().map(|(apart, points)| Contact { points, apart: (apart * size).max(0.0) }).collect()
}

/// Kruskal's forest over edges (weight, node, node, label). Returns weights and labels, smallest weight first.
fn spanning_forest(nodes: usize, edges: &mut [(f64, usize, usize, [usize; 2])]) -> Vec<(f64, [usize; 2])> {
    edges.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.3.cmp(&y.3)));
    let mut tree: Vec<usize> = (0..nodes).collect();
    let mut kept = Vec::new();
    for &(weight, a, b, what) in edges.iter() {
        let (a, b) = (tree[a], tree[b]);
        if a != b {
            tree.iter_mut().filter(|t| **t == b).for_each(|t| *t = a);
            kept.push((weight, what));
        }
    }
    kept
}

/// A group of the figure with all its results; `None` if its points cannot be fitted.
fn chain(
    group: &[usize],
    tracks: &[&[DVec2]],
    rods: &Rods,
    joints: &[Contact],
    options: &FigureOptions,
    judge: &impl Fn([usize; 2]) -> (f64, f64),
) -> Option<Chain> {
    let mut points = group.to_vec();
    let sits_on = |end: usize| {
        joints.iter().filter(|j| j.points.contains(&end)).map(|j| j.apart).fold(f64::INFINITY, f64::min)
    };
    if sits_on(points[points.len() - 1]) < sits_on(points[0]) {
        points.reverse();
    }
    let lengths = |lengths: &[f64], sds: &[f64]| -> Vec<Link> {
        let of = |(k, pair): (usize, [usize; 2])| {
            let (margin, confidence) = judge(pair);
            Link { points: pair, length: lengths[k], length_sd: sds[k], margin, confidence }
        };
        links_of(&points).enumerate().map(of).collect()
    };
    if let [a, b] = points[..] {
        let fit = rods.fit(a, b)?;
        let depth_of = |sign: f64| fit.depth.iter().map(|z| sign * z).collect::<Vec<_>>();
        // The pivot of the fit is the lower index.
        let depth = depth_of(if a < b { 1.0 } else { -1.0 });
        return Some(Chain {
            links: lengths(&[fit.length], &[fit.covariance.z_axis.z.sqrt()]),
            plane: fit.plane,
            residual_rms: fit.residual_rms,
            evidence: rod_evidence(fit, options.fit.noise_sd, &options.evidence),
            depth: depth.iter().map(|&z| vec![0.0, z]).collect(),
            reflection_margin_deg: None,
            angle_rad: Vec::new(),
            points,
        });
    }
    let [a, pivot, b] = points[..] else { return None };
    let fit = fit_hinge(tracks[a], tracks[pivot], tracks[b], &options.fit).ok()?;
    let sd = |k: usize| fit.covariance[(2 + k, 2 + k)].sqrt();
    Some(Chain {
        links: lengths(&fit.lengths, &[sd(0), sd(1)]),
        plane: fit.plane,
        residual_rms: fit.residual_rms,
        evidence: hinge_evidence(&fit, options.fit.noise_sd, &options.evidence),
        depth: fit.depth.iter().map(|[first, second]| vec![0.0, -first, second - first]).collect(),
        reflection_margin_deg: None,
        angle_rad: (0..tracks[pivot].len())
            .map(|t| angle(&fit, [a, pivot, b].map(|p| tracks[p][t]), t))
            .collect(),
        points,
    })
}

/// Angle at the pivot of a hinge in one frame, radians; NaN if a point is not seen.
fn angle(fit: &HingeFit, [a, pivot, b]: [DVec2; 3], frame: usize) -> f64 {
    let [first, second] = fit.depth[frame];
    let (u, v): (DVec3, DVec3) = ((a - pivot).extend(first), (b - pivot).extend(second));
    u.cross(v).length().atan2(u.dot(v))
}

/// Links by a minimum spanning tree over rods; each link is a chain of its own.
///
/// The weight of a rod is its residual plus twice the cover's cost of its length: for rods alone, length is more
/// important than for hinges. (Residual times length loses a few more limbs at 0 px and many at 2 px.)
fn forest(tracks: &[&[DVec2]], rods: &Rods, size: f64, options: &FigureOptions) -> Figure {
    let points = tracks.len();
    let mut edges = Vec::new();
    for i in 0..points {
        for j in i + 1..points {
            if let Some(fit) = rods.fit(i, j) {
                edges.push((fit.residual_rms + 2.0 * options.costs.length * fit.length, i, j, [i, j]));
            }
        }
    }
    let kept: Vec<[usize; 2]> =
        spanning_forest(points, &mut edges).into_iter().map(|(_, pair)| pair).collect();
    let judge = |_: [usize; 2]| (f64::NAN, f64::NAN);
    let chains: Vec<Chain> =
        kept.iter().filter_map(|pair| chain(pair, tracks, rods, &[], options, &judge)).collect();
    let alone = (0..points).filter(|p| !kept.iter().any(|pair| pair.contains(p))).collect();
    Figure { method: Method::Forest, chains, joints: Vec::new(), alone, cost: f64::NAN, size }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::FitOptions;
    use crate::planar::figure::example::{limbs, sorted_links, walker};
    use crate::planar::figure::{FigureOptions, Status, interpret_figure};

    #[test]
    fn the_model_is_linked_with_its_lengths_depths_and_angles() {
        let (tracks, times_s, truth) = walker(66, |_| 0.0, 0.0);
        let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
        let [window] = &found.windows[..] else { panic!("one window") };
        assert_eq!((window.status, window.chains), (Status::Interpreted, [4, 0, 0]));
        assert_eq!(sorted_links(&window.figure), limbs());
        for chain in &window.figure.chains {
            for link in &chain.links {
                let [a, b] = link.points;
                let depth = truth[b] - truth[a];
                let length = (tracks[b][0] - tracks[a][0]).extend(depth).length();
                assert!((link.length / length - 1.0).abs() < 1e-3, "{link:?} {length}");
                assert!(link.confidence > 0.9 && link.margin > 0.0);
            }
            let [a, pivot, b] = chain.points[..] else { panic!() };
            let sign = (chain.depth[0][1] * (truth[pivot] - truth[a])).signum();
            for t in 0..66 {
                let at = |k: usize| truth[t * 12 + k] - truth[t * 12 + a];
                assert!((sign * chain.depth[t][2] - at(b)).abs() < 1.0, "frame {t}");
                let point = |k: usize| tracks[k][t].extend(truth[t * 12 + k]);
                let angle = (point(a) - point(pivot)).angle_between(point(b) - point(pivot));
                assert!((chain.angle_rad[t] - angle).abs() < 0.02);
            }
        }
        // The four chains are in contact by shoulders and hips.
        assert_eq!(window.figure.joints.len(), 3);
        assert!(window.figure.joints.iter().all(|j| j.points.iter().all(|p| p % 3 == 0)));
    }

    #[test]
    fn many_points_are_linked_by_a_forest() {
        let (mut tracks, times_s, _) = walker(66, |_| 0.0, 0.0);
        let options = FigureOptions { most_covered: 4, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let links = sorted_links(&found.windows[0].figure);
        assert_eq!(found.windows[0].figure.method, Method::Forest);
        assert_eq!(links.len(), 11);
        tracks.extend(
            (0..8).map(|i| tracks[i].iter().map(|p| *p + 5.0).collect::<Vec<_>>()).collect::<Vec<_>>(),
        );
        let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
        assert_eq!(found.windows[0].figure.method, Method::Forest);
    }

    fn options(noise_sd: f64) -> FigureOptions {
        let fit = FitOptions { noise_sd, ..FigureOptions::default().fit };
        FigureOptions { fit, ..FigureOptions::default() }
    }

    /// The share of a residual that noise explains costs nothing, and neither does the noise's part of a motion.
    #[test]
    fn noise_costs_nothing() {
        let share = FigureOptions::default().costs.noise;
        assert!((unexplained(0.05, &options(0.02)) - (0.05 - share * 2f64.sqrt() * 0.02)).abs() < 1e-12);
        assert_eq!(unexplained(0.05, &options(0.0)), 0.05);
        // Points at rest have an apparent motion of 2 standard deviations.
        assert!(clean_motion(0.04, &options(0.02)) < 1e-9);
        assert!((clean_motion(0.05, &options(0.02)) - 0.03).abs() < 1e-12);
    }

    /// Two rods and a hinge that all rotate about one point of a body, and a pair far from it.
    fn rods_of(tracks: &[Vec<DVec2>], size: f64) -> (Vec<&[DVec2]>, Rods) {
        let part: Vec<&[DVec2]> = tracks.iter().map(|track| &track[..]).collect();
        let rods = Rods::fitted(&part, size, &FigureOptions::default());
        (part, rods)
    }

    /// A chain starts at the end that is in contact with another one. Depths are relative to its first point,
    /// whatever the indices of its points.
    #[test]
    fn a_chain_starts_where_it_sits_on_others() {
        let (tracks, _, truth) = walker(66, |_| 0.0, 0.0);
        let (part, rods) = rods_of(&tracks, 100.0);
        let judge = |_: [usize; 2]| (0.0, 1.0);
        let options = FigureOptions::default();
        // Right leg: hip 6, knee 7, ankle 8; the hip is near another chain's end, then the ankle.
        for (near, expected) in [(6, [6, 7, 8]), (8, [8, 7, 6])] {
            let joints =
                [Contact { points: [near, 9], apart: 0.1 }, Contact { points: [14 - near, 2], apart: 5.0 }];
            let chain = chain(&[6, 7, 8], &part, &rods, &joints, &options, &judge).unwrap();
            assert_eq!(chain.points, expected);
        }
        let sign_of = |points: [usize; 2], t: usize, z: f64| {
            z * (truth[t * 12 + points[1]] - truth[t * 12 + points[0]])
        };
        let forth = chain(&[6, 7], &part, &rods, &[], &options, &judge).unwrap();
        let joints = [Contact { points: [7, 9], apart: 0.1 }];
        let back = chain(&[6, 7], &part, &rods, &joints, &options, &judge).unwrap();
        assert_eq!((&forth.points, &back.points), (&vec![6, 7], &vec![7, 6]));
        for (t, (from, to)) in tracks[6].iter().zip(&tracks[7]).enumerate() {
            // The same rod in the same plane from the other end has the opposite depth.
            assert!((forth.depth[t][1] + back.depth[t][1]).abs() < 1e-9);
            let z = forth.plane.depth(*to - *from);
            assert!((forth.depth[t][1] - z).abs() < 1e-9);
            assert!(sign_of([6, 7], t, z) * sign_of([6, 7], 0, forth.depth[0][1]) >= 0.0);
        }
        // Standard deviations of lengths are square roots of the covariance.
        let hinge = fit_hinge(part[6], part[7], part[8], &options.fit).unwrap();
        let hinged = chain(&[6, 7, 8], &part, &rods, &[], &options, &judge).unwrap();
        for (k, link) in hinged.links.iter().enumerate() {
            assert!((link.length_sd.powi(2) - hinge.covariance[(2 + k, 2 + k)]).abs() < 1e-12);
        }
    }

    /// An obtuse angle is reported as such, not as its supplement.
    #[test]
    fn angles_are_between_the_segments() {
        let (tracks, times_s, truth) = walker(66, |_| 0.0, 0.0);
        let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
        let mut obtuse = 0;
        for chain in &found.windows[0].figure.chains {
            let [a, pivot, b] = chain.points[..] else { continue };
            for t in 0..66 {
                let point = |k: usize| tracks[k][t].extend(truth[t * 12 + k]);
                let angle = (point(a) - point(pivot)).angle_between(point(b) - point(pivot));
                assert!((chain.angle_rad[t] - angle).abs() < 0.02);
                obtuse += usize::from(angle > 2.0);
            }
        }
        assert!(obtuse > 100);
    }

    /// The cost of a cover is that of its pieces: the residual without noise, plus 2 % of the length, divided by
    /// the figure's size; in addition the cost of a rod or of a single point.
    #[test]
    fn pieces_cost_residual_length_and_what_they_are() {
        let (tracks, ..) = walker(66, |_| 0.0, 1.0);
        let (part, rods) = rods_of(&tracks, 100.0);
        let options = options(0.0);
        let costs = options.costs;
        let found = candidates(&part, &rods, 100.0, &options);
        let cost = |points: &[usize]| found.iter().find(|c| c.points == points).unwrap().cost;
        let alone = cost(&[8]);
        assert!(alone <= costs.alone, "{alone}");
        let rod = rods.fit(6, 7).unwrap();
        let own = rod.residual_rms / 100.0 + 0.02 * rod.length / 100.0 + costs.rod;
        let apart = |ends: &[usize], group: &[usize]| {
            let others = (0..12).filter(|j| !group.contains(j));
            let nearest =
                others.flat_map(|j| ends.iter().map(move |&i| (i, j))).map(|(i, j)| rods.apart(i, j));
            nearest.fold(costs.detached, f64::min)
        };
        assert!((cost(&[6, 7]) - own - apart(&[6, 7], &[6, 7])).abs() < 1e-12);
        let hinge = fit_hinge(part[6], part[7], part[8], &options.fit).unwrap();
        let own = hinge.residual_rms / 100.0 + 0.02 * (hinge.lengths[0] + hinge.lengths[1]) / 100.0;
        assert!((cost(&[6, 7, 8]) - own - apart(&[6, 8], &[6, 7, 8])).abs() < 1e-12);
    }

    /// Points that keep their separation exactly are as near as those that keep it but for a rounding error.
    #[test]
    fn distances_are_continuous_where_nothing_moves() {
        let (mut tracks, ..) = walker(66, |_| 0.0, 0.0);
        tracks.push(tracks[0].iter().map(|point| *point + DVec2::new(4.0, 3.0)).collect());
        let part: Vec<&[DVec2]> = tracks.iter().map(|track| &track[..]).collect();
        let still = Rods::fitted(&part, 100.0, &options(0.5)).apart(0, 12);
        let mut moved = tracks.clone();
        moved[12].iter_mut().enumerate().for_each(|(t, point)| point.x += 1e-7 * (t as f64).sin());
        let part: Vec<&[DVec2]> = moved.iter().map(|track| &track[..]).collect();
        let nearly = Rods::fitted(&part, 100.0, &options(0.5)).apart(0, 12);
        assert!((still - nearly).abs() < 1e-6, "{still} {nearly}");
    }

    /// Chains are not in contact if their distance is larger than the cost of a detached group.
    #[test]
    fn only_what_is_near_sits_on_each_other() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 0.0);
        // Two walkers; the second one is far away, with the same gait and out of step.
        let (other, ..) = walker(120, |_| 0.0, 0.0);
        let mut both: Vec<Vec<DVec2>> = tracks[..6].to_vec();
        let wander = |t: usize| DVec2::new(900.0 + 3.0 * t as f64, 200.0 * (0.11 * t as f64).sin());
        both.extend(
            other[..6].iter().map(|track| (0..66).map(|t| track[t + 31] + wander(t)).collect::<Vec<_>>()),
        );
        let found = interpret_figure(&both, &times_s, &FigureOptions::default()).unwrap();
        let figure = &found.windows[0].figure;
        let limit = figure.size * FigureOptions::default().costs.detached;
        assert!(figure.joints.iter().all(|joint| joint.apart < limit), "{:?} {limit}", figure.joints);
        assert!(figure.joints.iter().all(|j| (j.points[0] < 6) == (j.points[1] < 6)), "{:?}", figure.joints);
    }

    /// Edges of a forest are weighted by residual and length together: a near point that moves differently is
    /// farther than the next one of the limb.
    #[test]
    fn a_forest_spans_what_moves_together() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 0.0);
        let options = FigureOptions { most_covered: 4, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let (_, rods) = rods_of(&tracks, found.windows[0].figure.size);
        let weight = |i: usize, j: usize| rods.fit(i, j).map(|fit| fit.residual_rms + 0.04 * fit.length);
        // No omitted edge joins points that are joined by an edge of larger weight.
        let links = sorted_links(&found.windows[0].figure);
        for i in 0..12 {
            for j in i + 1..12 {
                // Two shoulders without relative motion are not a rod.
                let Some(direct) = weight(i, j) else { continue };
                let mut reached = vec![(i, 0.0f64)];
                let mut at = 0;
                while at < reached.len() {
                    let (from, most) = reached[at];
                    for &[a, b] in &links {
                        let next = if a == from {
                            b
                        } else if b == from {
                            a
                        } else {
                            continue;
                        };
                        if reached.iter().all(|(seen, _)| *seen != next) {
                            reached.push((next, most.max(weight(a, b).unwrap())));
                        }
                    }
                    at += 1;
                }
                let (_, most) = reached.iter().find(|(point, _)| *point == j).unwrap();
                assert!(*most <= direct + 1e-9, "{i} {j}");
            }
        }
    }

    /// The margin of a link is the extra cost of the best figure without it, scaled by the figure's size.
    #[test]
    fn the_margin_of_a_link_is_the_cost_of_its_rival() {
        let (tracks, times_s, _) = walker(66, |_| 0.0, 0.5);
        let options = options(0.5);
        let figure = interpret_figure(&tracks, &times_s, &options).unwrap().windows.remove(0).figure;
        for link in figure.links() {
            assert!(link.margin > 0.0 && link.margin < figure.cost, "{link:?} {}", figure.cost);
        }
    }
}
