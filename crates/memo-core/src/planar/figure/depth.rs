//! Depths over time: from the planar windows, and carried with known lengths through the others.

use super::{Chain, FigureWindow, Status};
use crate::planar::Verdict;
use glam::DVec2;

/// Where the points of a frame in space come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DepthSource {
    /// From a plane.
    Planar,
    /// From lengths of an earlier or later planar period.
    Carried,
    /// Not known.
    Unknown,
}

/// Depths of all points over all frames: from the interpreted window whose middle is nearest, each chain's
/// reflection following the window before; then, if asked, carried through the rest.
pub(super) fn depth_over_time(
    tracks: &[Vec<DVec2>],
    windows: &[FigureWindow],
    carries: bool,
) -> (Vec<f64>, Vec<DepthSource>) {
    let (points, frames) = (tracks.len(), tracks[0].len());
    let mut depth = vec![f64::NAN; points * frames];
    let mut sources = vec![DepthSource::Unknown; frames];
    let read: Vec<&FigureWindow> = windows.iter().filter(|w| w.status == Status::Interpreted).collect();
    let nearest = |frame: usize| {
        let holding = read.iter().enumerate().filter(|(_, w)| (w.start..w.end).contains(&frame));
        holding.min_by_key(|(_, w)| (w.start + w.end).abs_diff(2 * frame + 1)).map(|(index, _)| index)
    };
    let signs = reflections(&read);
    for frame in 0..frames {
        let Some(index) = nearest(frame) else { continue };
        sources[frame] = DepthSource::Planar;
        for (chain, sign) in read[index].figure.chains.iter().zip(&signs[index]) {
            for (&point, z) in chain.points.iter().zip(&chain.depth[frame - read[index].start]) {
                depth[frame * points + point] = sign * z;
            }
        }
    }
    if carries {
        carry(tracks, &read, &mut depth, &mut sources);
    }
    (depth, sources)
}

/// For each chain of each window the sign that fits the same points in the window before where they overlap.
fn reflections(windows: &[&FigureWindow]) -> Vec<Vec<f64>> {
    let mut signs: Vec<Vec<f64>> = Vec::with_capacity(windows.len());
    for (index, window) in windows.iter().enumerate() {
        let sign_of = |chain: &Chain| {
            let Some(before) = index.checked_sub(1) else { return 1.0 };
            let previous = windows[before];
            let pair = |other: &Chain| other.points == chain.points;
            let Some(k) = previous.figure.chains.iter().position(pair) else { return 1.0 };
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

/// Goes on with the lengths of the chains that did not leave their planes where no plane is known, forwards from the window before, then
/// backwards from the window after.
///
/// A link of length L and image vector d has |z| = sqrt(L² - |d|²), or 0 where the image is too long. The sign
/// is the one nearer to the depth that goes on as before (z + dz/dt). Where the link passes parallel to the
/// image the two signs meet: there continuity of the motion decides, and may decide wrongly.
fn carry(tracks: &[Vec<DVec2>], read: &[&FigureWindow], depth: &mut [f64], sources: &mut [DepthSource]) {
    let (points, frames) = (tracks.len(), sources.len());
    for step in [1isize, -1] {
        for window in read {
            let from = if step > 0 { window.end as isize } else { window.start as isize - 1 };
            let mut frame = from;
            while frame >= 0 && (frame as usize) < frames && sources[frame as usize] == DepthSource::Unknown {
                frame += step;
            }
            let last = frame;
            let kept = window.figure.chains.iter().filter(|c| c.evidence.verdict != Verdict::NotPlanar);
            for chain in kept {
                for (pair, link) in chain.points.windows(2).zip(&chain.links) {
                    let at = |depth: &[f64], t: isize| {
                        let row = usize::try_from(t).ok().filter(|&t| t < frames)? * points;
                        Some(depth[row + pair[1]] - depth[row + pair[0]]).filter(|z| z.is_finite())
                    };
                    let mut state =
                        at(depth, from - step).map(|z| (z, at(depth, from - 2 * step).unwrap_or(z)));
                    let mut t = from;
                    while t != last {
                        let image = tracks[pair[1]][t as usize] - tracks[pair[0]][t as usize];
                        let (Some((now, before)), true) = (state, image.is_finite()) else { break };
                        let expected = 2.0 * now - before;
                        let size = (link.length * link.length - image.length_squared()).max(0.0).sqrt();
                        let z = if expected < 0.0 { -size } else { size };
                        let row = t as usize * points;
                        if pair[0] == chain.points[0] {
                            depth[row + pair[0]] = 0.0;
                        }
                        depth[row + pair[1]] = depth[row + pair[0]] + z;
                        state = Some((z, now));
                        t += step;
                    }
                }
            }
            let mut t = from;
            while t != last {
                let row = t as usize * points;
                if depth[row..row + points].iter().any(|z| z.is_finite()) {
                    sources[t as usize] = DepthSource::Carried;
                }
                t += step;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::figure::example::{limbs, sorted_links, walker};
    use crate::planar::{FigureOptions, FitOptions, interpret_figure};
    use std::f64::consts::TAU;

    /// One full turn between 1.8 and 2.6 s of 4.4 s.
    fn spin(time_s: f64) -> f64 {
        TAU * ((time_s - 1.8) / 0.8).clamp(0.0, 1.0)
    }

    #[test]
    fn a_spin_is_lost_and_found_again() {
        let (tracks, times_s, _) = walker(264, spin, 0.5);
        let fit = FitOptions { noise_sd: 0.5, ..FitOptions::default() };
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
        let mut errors = Vec::new();
        for &t in &carried {
            for [a, b] in limbs() {
                let depth = |z: &[f64]| z[t * 12 + b] - z[t * 12 + a];
                let length = (tracks[b][t] - tracks[a][t]).extend(depth(&truth)).length();
                // Up to the chain's reflection: the sign is open.
                errors.push((depth(&found.depth).abs() - depth(&truth).abs()).abs() / length);
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
}
