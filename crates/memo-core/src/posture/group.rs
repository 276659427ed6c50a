//! Grouping of similar postures (Lee and Chen 1985, section 3.4).
//!
//! The distance of two postures is the largest distance of a joint. Groups are formed by complete linkage: the
//! two groups whose farthest members are nearest are joined, as long as these are within the given distance. So
//! no two members of a group differ by more in any joint. Among equal pairs, the groups of the earliest members
//! are joined. The result does not depend on threads; it depends on the order of the postures only for equal
//! distances.

use crate::model::skeleton::{Joint, StickFigure};

/// The distance within which the paper's figures look similar: 10 cm.
pub const DEFAULT_GROUP_M: f64 = 0.10;

/// A group of similar postures.
#[derive(Debug, Clone, PartialEq)]
pub struct PostureGroup {
    /// The member with the smallest distance to its farthest fellow: the middle of the group.
    pub representative: usize,
    /// Indices of all members in the given list, ascending.
    pub members: Vec<usize>,
    /// Largest distance between two members, metres.
    pub diameter_m: f64,
}

/// The largest distance of a joint known in both figures, metres; 0 if there is none.
pub fn figure_distance(a: &StickFigure, b: &StickFigure) -> f64 {
    let apart_sq = |joint: Joint| (a[joint] - b[joint]).length_squared();
    // `max` skips the NaN of unknown joints.
    Joint::ALL.into_iter().map(apart_sq).fold(0.0, f64::max).sqrt()
}

/// Groups postures by complete linkage within a distance, metres. Groups are in the order of their first members.
/// If the distance is NaN or negative, each posture is its own group.
pub fn group(figures: &[StickFigure], within_m: f64) -> Vec<PostureGroup> {
    let n = figures.len();
    let mut apart = vec![0f64; n * n];
    for i in 0..n {
        for j in 0..i {
            let distance = figure_distance(&figures[i], &figures[j]);
            (apart[i * n + j], apart[j * n + i]) = (distance, distance);
        }
    }
    let clusters = complete_linkage(apart.clone(), n, within_m);
    clusters.into_iter().map(|members| describe(members, &apart, n)).collect()
}

fn describe(members: Vec<usize>, apart: &[f64], n: usize) -> PostureGroup {
    let reach = |&i: &usize| members.iter().map(|&j| apart[i * n + j]).fold(0.0, f64::max);
    let representative = members.iter().min_by(|a, b| reach(a).total_cmp(&reach(b))).copied().unwrap_or(0);
    let diameter_m = members.iter().map(reach).fold(0.0, f64::max);
    PostureGroup { representative, members, diameter_m }
}

/// Joins the two nearest clusters repeatedly; each cluster has the index of its first member. The nearest
/// neighbour of every cluster is kept, so a step costs about n.
fn complete_linkage(mut apart: Vec<f64>, n: usize, within_m: f64) -> Vec<Vec<usize>> {
    let mut members: Vec<Vec<usize>> = (0..n).map(|i| vec![i]).collect();
    let nearest_of = |apart: &[f64], members: &[Vec<usize>], i: usize| {
        (i + 1..n)
            .filter(|&j| !members[j].is_empty())
            .map(|j| (apart[i * n + j], j))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
    };
    let mut nearest: Vec<Option<(f64, usize)>> = (0..n).map(|i| nearest_of(&apart, &members, i)).collect();
    loop {
        let closest =
            (0..n).filter_map(|i| nearest[i].map(|(d, j)| (d, i, j))).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i, j)) = closest.filter(|&(d, ..)| d <= within_m) else { break };
        let joined = std::mem::take(&mut members[j]);
        members[i].extend(joined);
        nearest[j] = None;
        for k in (0..n).filter(|&k| k != i && !members[k].is_empty()) {
            let distance = apart[i * n + k].max(apart[j * n + k]);
            (apart[i * n + k], apart[k * n + i]) = (distance, distance);
        }
        for k in 0..=i {
            let stale = k == i || nearest[k].is_some_and(|(_, to)| to == i || to == j);
            if stale && !members[k].is_empty() {
                nearest[k] = nearest_of(&apart, &members, k);
            }
        }
        for (k, to) in nearest.iter_mut().enumerate().skip(i + 1) {
            if to.is_some_and(|(_, to)| to == j) {
                *to = nearest_of(&apart, &members, k);
            }
        }
    }
    members.iter_mut().for_each(|cluster| cluster.sort_unstable());
    members.into_iter().filter(|cluster| !cluster.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use proptest::prelude::*;

    fn at(x: f64) -> StickFigure {
        let mut figure = StickFigure::UNKNOWN;
        figure[Joint::Neck] = DVec3::ZERO;
        figure[Joint::LeftWrist] = DVec3::new(x, 0.0, 0.0);
        figure
    }

    #[test]
    fn a_chain_is_not_drawn_into_one_group() {
        let figures: Vec<StickFigure> = [0.0, 0.06, 0.12, 0.18, 0.5].map(at).to_vec();
        let groups = group(&figures, 0.10);
        let members: Vec<_> = groups.iter().map(|g| g.members.clone()).collect();
        assert_eq!(members, [vec![0, 1], vec![2, 3], vec![4]]);
        let groups = group(&[0.0, 0.02, 0.05].map(at), 0.10);
        assert_eq!(groups.len(), 1);
        assert_eq!(groups[0].representative, 1);
        assert!((groups[0].diameter_m - 0.05).abs() < 1e-12);
        assert!(group(&[], 0.1).is_empty());
        assert_eq!(group(&[at(0.0), at(0.0)], f64::NAN).len(), 2);
    }

    proptest! {
        /// Compares with the plain algorithm, which searches all pairs of groups for the nearest.
        #[test]
        fn groups_are_those_of_the_plain_algorithm(
            places in prop::collection::vec((0.0..0.5_f64, 0.0..0.3_f64), 1..24), within_m in 0.02..0.3_f64
        ) {
            let figures: Vec<StickFigure> = places.iter().map(|&(x, y)| {
                let mut figure = at(x);
                figure[Joint::RightKnee] = DVec3::new(0.0, y, 0.0);
                figure
            }).collect();
            let mut plain: Vec<Vec<usize>> = (0..figures.len()).map(|i| vec![i]).collect();
            let apart = |a: &[usize], b: &[usize]| {
                let pairs = a.iter().flat_map(|&i| b.iter().map(move |&j| (i, j)));
                pairs.map(|(i, j)| figure_distance(&figures[i], &figures[j])).fold(0.0, f64::max)
            };
            loop {
                let pairs = (0..plain.len()).flat_map(|i| (i + 1..plain.len()).map(move |j| (i, j)));
                let best = pairs.map(|(i, j)| (apart(&plain[i], &plain[j]), i, j))
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                let Some((_, i, j)) = best.filter(|b| b.0 <= within_m) else { break };
                let joined = plain.remove(j);
                plain[i].extend(joined);
                plain[i].sort_unstable();
                plain.sort();
            }
            let groups = group(&figures, within_m);
            let members: Vec<_> = groups.iter().map(|g| g.members.clone()).collect();
            prop_assert_eq!(members, plain);
            for group in groups {
                prop_assert!(group.diameter_m <= within_m && group.members.contains(&group.representative));
            }
        }
    }
}
