//! Grouping of similar postures (Lee and Chen 1985, section 3.4).
//!
//! The distance of two postures is the largest distance of a joint. Complete linkage: of all groups the two
//! whose farthest members are nearest are joined, while these are within the given distance, so no two
//! members of a group differ by more in any joint. Ties go to the groups of the earliest members. The result
//! does not depend on threads; on the order of the postures only through ties.

use super::skeleton::{Joint, StickFigure};

/// The distance within which the paper's figures look alike: 10 cm.
pub const DEFAULT_GROUP_M: f64 = 0.10;

/// Postures that look alike.
#[derive(Debug, Clone, PartialEq)]
pub struct PostureGroup {
    /// The member whose farthest fellow is nearest: the middle of the group.
    pub representative: usize,
    /// All members, ascending, as places in the list given.
    pub members: Vec<usize>,
    /// Largest distance of two members, metres.
    pub diameter_m: f64,
}

/// The largest distance of a joint known in both figures, metres; 0 where there is none.
pub fn figure_distance(a: &StickFigure, b: &StickFigure) -> f64 {
    let apart_sq = |joint: Joint| (a[joint] - b[joint]).length_squared();
    // max skips the NaN of unknown joints.
    Joint::ALL.into_iter().map(apart_sq).fold(0.0, f64::max).sqrt()
}

/// Groups postures by complete linkage within a distance, metres. Groups come in the order of their first
/// members. A distance that is NaN or negative leaves each posture alone.
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

/// Joins the nearest two clusters again and again; each cluster stands at its first member. The nearest
/// neighbour of every cluster is kept, so that a step costs about n.
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
        for k in i + 1..n {
            if nearest[k].is_some_and(|(_, to)| to == j) {
                nearest[k] = nearest_of(&apart, &members, k);
            }
        }
    }
    members.iter_mut().for_each(|cluster| cluster.sort_unstable());
    members.into_iter().filter(|cluster| !cluster.is_empty()).collect()
}
