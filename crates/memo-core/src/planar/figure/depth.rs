//! Depths over time: from windows with planar motion, and carried through the others with known lengths.

use super::{Chain, FigureWindow, Status};
use crate::planar::Verdict;
use glam::DVec2;

/// Source of the depths of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthSource {
    /// From a plane.
    Planar,
    /// Carried with lengths from an earlier or later window with planar motion.
    Carried,
    /// Not known.
    Unknown,
}

/// Depths of all points over all frames. They come from the interpreted window with the nearest middle, and each
/// chain's reflection follows the window before. Then, if requested, they are carried through the remaining
/// frames.
pub(super) fn depth_over_time(
    tracks: &[Vec<DVec2>],
    windows: &[FigureWindow],
    carries: bool,
) -> (Vec<f64>, Vec<DepthSource>) {
    let (points, frames) = (tracks.len(), tracks[0].len());
    let mut depth = vec![f64::NAN; points * frames];
    let mut sources = vec![DepthSource::Unknown; frames];
    let read: Vec<&FigureWindow> = windows.iter().filter(|w| w.status == Status::Interpreted).collect();
    let mut signs = reflections(&read);
    if carries {
        carry(tracks, &read, &mut signs, &mut depth);
        for (source, row) in sources.iter_mut().zip(depth.chunks(points)) {
            if row.iter().any(|z| z.is_finite()) {
                *source = DepthSource::Carried;
            }
        }
    }
    let nearest = |frame: usize| {
        let holding = read.iter().enumerate().filter(|(_, w)| (w.start..w.end).contains(&frame));
        holding.min_by_key(|(_, w)| (w.start + w.end).abs_diff(2 * frame + 1)).map(|(index, _)| index)
    };
    for frame in 0..frames {
        let Some(index) = nearest(frame) else { continue };
        sources[frame] = DepthSource::Planar;
        let chains = read[index].figure.chains.iter().zip(&signs[index]);
        for (chain, sign) in chains.filter(|(chain, _)| chain.evidence.verdict != Verdict::NotPlanar) {
            for (&point, z) in chain.points.iter().zip(&chain.depth[frame - read[index].start]) {
                depth[frame * points + point] = sign * z;
            }
        }
    }
    (depth, sources)
}

/// The chain of a window with the same points in the same order.
fn same_chain(window: &FigureWindow, chain: &Chain) -> Option<usize> {
    window.figure.chains.iter().position(|other| other.points == chain.points)
}

/// For each chain of each window, the sign that fits the same points in the window before where they overlap.
/// Signs from joint limits are kept.
fn reflections(windows: &[&FigureWindow]) -> Vec<Vec<f64>> {
    let mut signs: Vec<Vec<f64>> = Vec::with_capacity(windows.len());
    for (index, window) in windows.iter().enumerate() {
        let sign_of = |chain: &Chain| {
            if chain.reflection_margin_deg.is_some() {
                return 1.0;
            }
            let Some(before) = index.checked_sub(1) else { return 1.0 };
            let previous = windows[before];
            let Some(k) = same_chain(previous, chain) else { return 1.0 };
            let other = &previous.figure.chains[k];
            let agreement: f64 = (window.start..previous.end.max(window.start))
                .flat_map(|t| chain.depth[t - window.start].iter().zip(&other.depth[t - previous.start]))
                .map(|(a, b)| a * b)
                .filter(|product| product.is_finite())
                .sum();
            if agreement * signs[before][k] < 0.0 { -1.0 } else { 1.0 }
        };
        signs.push(window.figure.chains.iter().map(sign_of).collect());
    }
    signs
}

/// Carries the lengths of the chains that did not leave their planes through the frames before, between and after
/// the windows.
///
/// A link of length L with image vector d has |z| = sqrt(L^2 - |d|^2), or 0 if the image is too long. The signs
/// are those of the path from the depths before to those after with the smallest acceleration (sum of squared
/// second differences). If both ends are known, they also determine the reflection after the gap, unless joint
/// limits have done so. When a link becomes parallel to the image, the two signs give the same depth, and the
/// path may continue with the wrong one.
fn carry(tracks: &[Vec<DVec2>], read: &[&FigureWindow], signs: &mut [Vec<f64>], depth: &mut [f64]) {
    let frames = tracks[0].len();
    for after in 0..=read.len() {
        let before = after.checked_sub(1);
        let from = before.map_or(0, |b| read[b].end);
        let to = read.get(after).map_or(frames, |w| w.start);
        if from >= to {
            continue;
        }
        let is_kept = |chain: &Chain| chain.evidence.verdict != Verdict::NotPlanar;
        for k in 0..before.map_or(0, |b| read[b].figure.chains.len()) {
            let (window, sign) = (read[after - 1], signs[after - 1][k]);
            let chain = &window.figure.chains[k];
            if !is_kept(chain) {
                continue;
            }
            let met = read.get(after).and_then(|next| same_chain(next, chain));
            let gap = Gap { tracks, chain, from, to, is_backwards: false };
            let last = chain.depth.len();
            let start = [2, 1].map(|back| row(chain, last.checked_sub(back), sign));
            let Some(met) = met else {
                gap.fill(&gap.paths(&start, None).0, depth);
                continue;
            };
            let next = &read[after].figure.chains[met];
            let reach = |sign: f64| {
                let end = [0, 1].map(|t| row(next, Some(t), sign));
                gap.paths(&start, Some(&end))
            };
            let sign = signs[after][met];
            let (kept, turned) = (reach(sign), reach(-sign));
            if turned.1 < kept.1 && next.reflection_margin_deg.is_none() {
                for (later, signs) in read[after..].iter().zip(&mut signs[after..]) {
                    let Some(same) = same_chain(later, chain) else { continue };
                    // Signs from joint limits are kept.
                    if later.figure.chains[same].reflection_margin_deg.is_some() {
                        break;
                    }
                    signs[same] = -signs[same];
                }
                gap.fill(&turned.0, depth);
            } else {
                gap.fill(&kept.0, depth);
            }
        }
        let Some(next) = read.get(after) else { continue };
        for (k, chain) in next.figure.chains.iter().enumerate() {
            let is_new = before.is_none_or(|b| {
                same_chain(read[b], chain).is_none_or(|same| !is_kept(&read[b].figure.chains[same]))
            });
            if is_kept(chain) && is_new {
                let gap = Gap { tracks, chain, from, to, is_backwards: true };
                let start = [1, 0].map(|t| row(chain, Some(t), signs[after][k]));
                gap.fill(&gap.paths(&start, None).0, depth);
            }
        }
    }
}

/// Depths of a chain in a frame of its window, for one reflection; empty if the frame is not in the window.
fn row(chain: &Chain, frame: Option<usize>, sign: f64) -> Vec<f64> {
    let depths = frame.and_then(|t| chain.depth.get(t));
    depths.map_or(Vec::new(), |depths| depths.iter().map(|z| sign * z).collect())
}

/// Frames without a plane, for a chain whose lengths are known.
struct Gap<'a> {
    tracks: &'a [Vec<DVec2>],
    chain: &'a Chain,
    from: usize,
    to: usize,
    /// True if depths are known only after the gap.
    is_backwards: bool,
}

impl Gap<'_> {
    /// Paths of all links from two rows of depths to two others, if given, and their costs. Backwards in time the
    /// two first rows are those after the gap, the later one first.
    fn paths(&self, start: &[Vec<f64>; 2], end: Option<&[Vec<f64>; 2]>) -> (Vec<Vec<f64>>, f64) {
        let (mut paths, mut total) = (Vec::new(), 0.0);
        for (k, link) in self.chain.links.iter().enumerate() {
            let [a, b] = [0, 1].map(|i| &self.tracks[self.chain.points[k + i]]);
            let size = |t: usize| {
                (link.length * link.length - (b[t] - a[t]).length_squared()).max(0.0).sqrt()
                    + if (b[t] - a[t]).is_finite() { 0.0 } else { f64::NAN }
            };
            let mut sizes: Vec<f64> = (self.from..self.to).map(size).collect();
            if self.is_backwards {
                sizes.reverse();
            }
            let of_link = |row: &Vec<f64>| Some(row.get(k + 1)? - row.get(k)?).filter(|z| z.is_finite());
            let pair = |rows: &[Vec<f64>; 2]| Some([of_link(&rows[0])?, of_link(&rows[1])?]);
            let (mut path, cost) = match pair(start) {
                Some(start) => smoothest(&sizes, start, end.and_then(pair)),
                None => (vec![f64::NAN; sizes.len()], 0.0),
            };
            if self.is_backwards {
                path.reverse();
            }
            paths.push(path);
            total += cost;
        }
        (paths, total)
    }

    fn fill(&self, paths: &[Vec<f64>], depth: &mut [f64]) {
        let points = self.tracks.len();
        for t in self.from..self.to {
            let mut z = 0.0 * paths[0][t - self.from];
            depth[t * points + self.chain.points[0]] = z;
            for (path, &point) in paths.iter().zip(&self.chain.points[1..]) {
                z += path[t - self.from];
                depth[t * points + point] = z;
            }
        }
    }
}

/// Signs of `sizes` for the smallest sum of squared second differences, after two known values and before two
/// others, if given. Unknown sizes are bridged by a straight line and stay unknown.
fn smoothest(sizes: &[f64], start: [f64; 2], end: Option<[f64; 2]>) -> (Vec<f64>, f64) {
    let mut choices: Vec<[f64; 2]> = start.iter().map(|&z| [z; 2]).collect();
    let known: Vec<usize> = (0..sizes.len()).filter(|&t| sizes[t].is_finite()).collect();
    for t in 0..sizes.len() {
        let size = if sizes[t].is_finite() {
            sizes[t]
        } else {
            let after = known.partition_point(|&k| k < t);
            match (after.checked_sub(1).map(|i| known[i]), known.get(after)) {
                (Some(a), Some(&b)) => sizes[a] + (sizes[b] - sizes[a]) * (t - a) as f64 / (b - a) as f64,
                (Some(k), None) => sizes[k],
                (None, Some(&k)) => sizes[k],
                (None, None) => 0.0,
            }
        };
        choices.push([size, -size]);
    }
    choices.extend(end.into_iter().flatten().map(|z| [z; 2]));
    // costs[i][j]: cost of the best path with last two choices i and j; came[t][i][j]: the choice before them.
    let mut costs = [[0.0f64; 2]; 2];
    let mut came: Vec<[[usize; 2]; 2]> = Vec::with_capacity(choices.len());
    for window in choices.windows(3) {
        let (mut next, mut from) = ([[f64::INFINITY; 2]; 2], [[0; 2]; 2]);
        for (h, i, j) in [0, 1].iter().flat_map(|h| (0..4).map(move |ij| (*h, ij / 2, ij % 2))) {
            let second = window[2][j] - 2.0 * window[1][i] + window[0][h];
            let cost = costs[h][i] + second * second;
            if cost < next[i][j] {
                (next[i][j], from[i][j]) = (cost, h);
            }
        }
        costs = next;
        came.push(from);
    }
    let last = (0..4).min_by(|&a, &b| costs[a / 2][a % 2].total_cmp(&costs[b / 2][b % 2])).unwrap_or(0);
    let (mut i, mut j) = (last / 2, last % 2);
    let cost = costs[i][j];
    let mut taken = vec![0; choices.len()];
    for t in (2..choices.len()).rev() {
        (taken[t], taken[t - 1]) = (j, i);
        (i, j) = (came[t - 2][i][j], i);
    }
    let path = (0..sizes.len()).map(|t| choices[t + 2][taken[t + 2]] + 0.0 * sizes[t]).collect();
    (path, cost)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::FitOptions;
    use crate::planar::figure::example::{limbs, sorted_links, walker};
    use crate::{FigureOptions, interpret_figure};
    use std::f64::consts::TAU;

    /// One full turn between 1.8 and 2.6 s of 4.4 s.
    fn spin(time_s: f64) -> f64 {
        TAU * ((time_s - 1.8) / 0.8).clamp(0.0, 1.0)
    }

    #[test]
    fn a_spin_is_lost_and_found_again() {
        let (tracks, times_s, _) = walker(264, spin, 0.5);
        let fit = FitOptions { noise_sd: 0.5, ..FigureOptions::default().fit };
        let options = FigureOptions { fit, window_s: 0.9, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let mut seen = Vec::new();
        for window in &found.windows {
            let (from, to) = (times_s[window.start], times_s[window.end - 1]);
            println!("{from:.2} to {to:.2} s: {:?} {:?}", window.status, window.chains);
            if to < 1.8 || from > 2.6 {
                assert_eq!(window.status, Status::Interpreted, "{from} to {to} s");
                assert_eq!(sorted_links(&window.figure), limbs(), "{from} to {to} s");
            }
            if from > 1.6 && to < 2.8 || from < 2.0 && to > 2.4 {
                assert_eq!(window.status, Status::Lost, "{from} to {to} s");
            }
            seen.push(window.status);
        }
        assert!(seen.contains(&Status::Lost));
        let middle = (2.2 * 60.0) as usize;
        assert_eq!(found.sources[middle], DepthSource::Unknown);
        assert!(found.depth[middle * 12..][..12].iter().all(|z| z.is_nan()));
        assert_eq!((found.sources[0], found.sources[263]), (DepthSource::Planar, DepthSource::Planar));
    }

    #[test]
    fn lengths_are_carried_into_a_turn() {
        let (tracks, times_s, truth) = walker(264, spin, 0.0);
        let options = FigureOptions { window_s: 0.9, carries_structure: true, ..FigureOptions::default() };
        let found = interpret_figure(&tracks, &times_s, &options).unwrap();
        let carried: Vec<usize> = (0..264).filter(|&t| found.sources[t] == DepthSource::Carried).collect();
        assert!(carried.len() > 10, "{carried:?}");
        let limb_depth = |z: &[f64], t: usize, [a, b]: [usize; 2]| z[t * 12 + b] - z[t * 12 + a];
        let mut errors = Vec::new();
        for &t in &carried {
            for [a, b] in limbs() {
                let depth = |z: &[f64]| z[t * 12 + b] - z[t * 12 + a];
                let length = (tracks[b][t] - tracks[a][t]).extend(depth(&truth)).length();
                // The chain's reflection is arbitrary; here it is that of the first frame.
                let sign = (limb_depth(&found.depth, 0, [a, b]) * limb_depth(&truth, 0, [a, b])).signum();
                errors.push((sign * depth(&found.depth) - depth(&truth)).abs() / length);
            }
        }
        errors.sort_by(f64::total_cmp);
        println!(
            "carried depth, relative to length: median {:.4}, p90 {:.4}",
            errors[errors.len() / 2],
            errors[errors.len() * 9 / 10]
        );
        assert!(errors[errors.len() * 9 / 10] < 0.1);
    }

    #[test]
    fn the_smoothest_path_goes_through_zero_and_over_what_is_unseen() {
        let truth = |t: i32| (0.1 * f64::from(t)).sin();
        let mut sizes: Vec<f64> = (0..60).map(|t| truth(t).abs()).collect();
        sizes[10] = f64::NAN;
        let start = [truth(-2), truth(-1)];
        let (path, _) = smoothest(&sizes, start, None);
        for t in (0..60).filter(|&t| t != 10) {
            assert!((path[t] - truth(t as i32)).abs() < 1e-12, "{t}");
        }
        assert!(path[10].is_nan());
        let reach = |sign: f64| smoothest(&sizes, start, Some([60, 61].map(|t| sign * truth(t)))).1;
        assert!(reach(1.0) < reach(-1.0));
    }

    /// A window with one rod between points 0 and 1, with these depths and a known or unknown reflection.
    fn window(start: usize, depths: &[f64], margin: Option<f64>) -> FigureWindow {
        use crate::planar::figure::{Figure, Link, Method};
        use crate::planar::{FalseTargetRate, PlanarEvidence, Plane};
        let evidence = PlanarEvidence {
            verdict: Verdict::Planar,
            statistic: 0.0,
            threshold: 1.0,
            motion: 1.0,
            least_motion: 0.0,
            rate: FalseTargetRate::OnePercent,
        };
        let link = Link { points: [0, 1], length: 1.0, length_sd: 0.0, margin: 0.0, confidence: 1.0 };
        let chain = Chain {
            points: vec![0, 1],
            links: vec![link],
            plane: Plane { p: 0.0, q: 0.0 },
            residual_rms: 0.0,
            evidence,
            depth: depths.iter().map(|&z| vec![0.0, z]).collect(),
            reflection_margin_deg: margin,
            angle_rad: vec![],
        };
        let figure = Figure {
            method: Method::Cover,
            chains: vec![chain],
            joints: vec![],
            alone: vec![],
            cost: 0.0,
            size: 1.0,
        };
        let end = start + depths.len();
        FigureWindow { start, end, status: Status::Interpreted, chains: [1, 0, 0], evidence: None, figure }
    }

    /// The overlap with the window before decides whether a window is reflected, and a reflected one affects the
    /// next.
    #[test]
    fn the_sign_is_carried_from_window_to_window() {
        let depth = |t: usize| (0.5 * t as f64).sin();
        let part =
            |from: usize, to: usize, sign: f64| (from..to).map(|t| sign * depth(t)).collect::<Vec<_>>();
        // The truth, with the second, the third and the fifth window reflected.
        let windows = [
            window(0, &part(0, 10, 1.0), None),
            window(5, &part(5, 15, -1.0), None),
            window(10, &part(10, 20, -1.0), None),
            window(15, &part(15, 25, 1.0), None),
            window(20, &part(20, 30, -1.0), None),
        ];
        let read: Vec<&FigureWindow> = windows.iter().collect();
        assert_eq!(reflections(&read), [[1.0], [-1.0], [-1.0], [1.0], [-1.0]]);
        let tracks = vec![vec![DVec2::ZERO; 30]; 2];
        let (found, sources) = depth_over_time(&tracks, &windows, false);
        for t in 0..30 {
            assert!((found[2 * t + 1] - depth(t)).abs() < 1e-12, "frame {t}");
            assert_eq!((found[2 * t], sources[t]), (0.0, DepthSource::Planar));
        }
        // A reflection from joint limits is kept, and the following windows depend on it.
        let told = [
            window(0, &part(0, 10, 1.0), None),
            window(5, &part(5, 15, -1.0), Some(9.0)),
            window(10, &part(10, 20, 1.0), None),
        ];
        let read: Vec<&FigureWindow> = told.iter().collect();
        assert_eq!(reflections(&read), [[1.0], [1.0], [-1.0]]);
    }

    /// If two windows contain a frame, the one with the nearer middle is used.
    #[test]
    fn a_frame_is_read_by_the_window_around_it() {
        let windows = [window(0, &[1.0; 10], None), window(4, &[2.0; 10], None)];
        let tracks = vec![vec![DVec2::ZERO; 14]; 2];
        let (found, _) = depth_over_time(&tracks, &windows, false);
        // Middles at frames 4.5 and 8.5: the first is used up to frame 6.
        let first: Vec<usize> = (0..14).filter(|&t| found[2 * t + 1] == 1.0).collect();
        assert_eq!(first, [0, 1, 2, 3, 4, 5, 6]);
    }

    /// A rod carried through a gap determines the reflection of the window after it and of those that follow.
    #[test]
    fn the_sign_is_carried_through_a_gap() {
        let depth = |t: usize| (0.15 * t as f64).sin();
        let part =
            |from: usize, to: usize, sign: f64| (from..to).map(|t| sign * depth(t)).collect::<Vec<_>>();
        // The image of a rod of length 1 at these depths.
        let image = |t: usize| DVec2::new((1.0 - depth(t) * depth(t)).sqrt(), 0.0);
        let tracks = vec![vec![DVec2::ZERO; 60], (0..60).map(image).collect()];
        for sign in [1.0, -1.0] {
            let windows = [
                window(0, &part(0, 20, 1.0), None),
                window(30, &part(30, 45, sign), None),
                window(40, &part(40, 55, sign), None),
            ];
            let (found, sources) = depth_over_time(&tracks, &windows, true);
            for t in 0..55 {
                assert!((found[2 * t + 1] - depth(t)).abs() < 1e-6, "{sign} frame {t}: {}", found[2 * t + 1]);
            }
            assert_eq!(
                [sources[10], sources[25], sources[35]],
                [DepthSource::Planar, DepthSource::Carried, DepthSource::Planar]
            );
            // After the last window the depths are carried on.
            assert!((found[2 * 58 + 1] - depth(58)).abs() < 1e-6 && sources[58] == DepthSource::Carried);
        }
        // A reflection from joint limits is kept, and so are the depths before it.
        let windows = [window(0, &part(0, 20, 1.0), None), window(30, &part(30, 45, -1.0), Some(9.0))];
        let (found, _) = depth_over_time(&tracks, &windows, true);
        assert!((found[2 * 40 + 1] + depth(40)).abs() < 1e-6 && (found[2 * 10 + 1] - depth(10)).abs() < 1e-6);
        // Before the first window the depths are carried backwards.
        let (found, sources) = depth_over_time(&tracks, &[window(8, &part(8, 30, 1.0), None)], true);
        for t in 0..8 {
            assert!((found[2 * t + 1] - depth(t)).abs() < 1e-6, "frame {t}");
            assert_eq!(sources[t], DepthSource::Carried);
        }
    }
}
