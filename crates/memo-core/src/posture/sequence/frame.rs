//! One frame: its tree, and its surviving postures in groups.

use glam::DVec3;
use thiserror::Error;

use super::figure_in_world;
use super::neck::{NeckTrack, Scene};
use crate::model::camera::Camera;
use crate::model::skeleton::{Joint, StickFigure};
use crate::posture::constraint::Constraint;
use crate::posture::group::group;
use crate::posture::tree::{Cut, Interpretations, TreeError, TreeOptions, View};

/// Why a frame is not used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FrameProblem {
    /// The neck is not seen, and all joints depend on it.
    #[error("the neck is not seen")]
    NeckNotSeen,
    /// The neck's distance is not known, so there is no posture.
    #[error("the distance of the neck is not known")]
    NoDistance,
    /// The distance is smaller than its standard deviation.
    #[error("the distance of the neck is not known: {distance_m:.2} ± {sd_m:.2} m is too uncertain")]
    VagueDistance {
        /// The distance, metres.
        distance_m: f64,
        /// Its standard deviation, metres.
        sd_m: f64,
    },
    /// No joint adjacent to the neck is seen, so there is no figure.
    #[error("no joint connected to the neck is visible")]
    NeckAlone,
    /// The tree cannot be grown from the view.
    #[error(transparent)]
    Tree(TreeError),
}

/// A group of similar postures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RepresentedGroup {
    /// The representative member, world axes, metres.
    pub figure: StickFigure,
    /// Number of members.
    pub size: usize,
    /// Largest distance of a joint between two members, metres.
    pub diameter_m: f64,
}

/// The postures that a frame allows.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameReading {
    /// The tree: counts per level, reasons for cuts, paths to all survivors and, if there are none, the least
    /// violating posture. Its figures are in camera axes.
    pub tree: Interpretations,
    /// Groups of similar survivors, largest first, at most [`super::SequenceOptions::max_groups`].
    pub groups: Vec<RepresentedGroup>,
    /// Number of all groups; `None` if more than [`MOST_GROUPED`] postures survive. Then the groups are those of
    /// [`MOST_GROUPED`] evenly spaced survivors.
    pub group_count: Option<usize>,
}

impl FrameReading {
    /// Number of surviving postures.
    pub fn survivors(&self) -> usize {
        self.tree.survivors.len()
    }

    /// The surviving postures, world axes, metres, in the order of the tree.
    pub fn survivor_figures(&self, camera: &Camera) -> Vec<StickFigure> {
        self.tree.figures().iter().map(|figure| figure_in_world(figure, camera)).collect()
    }

    /// Every cut branch with the constraint that cut it, if [`SequenceOptions::keep_cuts`](super::SequenceOptions) asked
    /// for them: its joints down to the level of the constraint, world axes, metres, and NaN below. The postures of a
    /// view are the survivors and all that hang on cut branches.
    pub fn cut_figures(&self, camera: &Camera) -> Vec<(StickFigure, Constraint)> {
        let branch = |cut: &Cut| {
            let constraint = cut.violation.constraint;
            let mut figure = self.tree.view.interpretation(cut.path).figure;
            let below = |joint: &&Joint| **joint as usize > constraint.level() as usize;
            Joint::ALL.iter().filter(below).for_each(|&joint| figure[joint] = DVec3::NAN);
            (figure_in_world(&figure, camera), constraint)
        };
        self.tree.cuts.iter().map(branch).collect()
    }

    /// If nothing survives, the violations of the least violating posture, one sentence each.
    pub fn cut_all(&self) -> Option<Vec<String>> {
        let least = self.tree.least_violating.as_ref()?;
        Some(least.violations.iter().map(ToString::to_string).collect())
    }
}

/// Maximum number of postures that are grouped; the cost grows with the square of their number.
pub const MOST_GROUPED: usize = 1024;

/// The tree of a frame and its groups.
pub(super) fn read(
    scene: &Scene,
    options: &TreeOptions,
    track: &NeckTrack,
    neck: DVec3,
    t: usize,
) -> Result<FrameReading, FrameProblem> {
    let rays = scene.rays[t];
    if !rays.sees(Joint::Neck) {
        return Err(FrameProblem::NeckNotSeen);
    }
    if let Some([distance_m, sd_m]) = track.vague[t] {
        return Err(FrameProblem::VagueDistance { distance_m, sd_m });
    }
    if neck.is_nan() {
        return Err(FrameProblem::NoDistance);
    }
    let hangs_on_neck = |joint: &Joint| joint.start() == Some(Joint::Neck);
    if !Joint::ALL.iter().filter(|joint| hangs_on_neck(joint)).any(|&joint| rays.sees(joint)) {
        return Err(FrameProblem::NeckAlone);
    }
    let view = View {
        neck_sd_m: track.sd_m[t],
        length_sd_m: scene.lengths.own_sd_m,
        ..View::new(rays, neck, scene.lengths.lengths)
    };
    let tree = view.interpret(options).map_err(FrameProblem::Tree)?;
    let (groups, group_count) = groups(scene, &tree);
    Ok(FrameReading { tree, groups, group_count })
}

fn groups(scene: &Scene, tree: &Interpretations) -> (Vec<RepresentedGroup>, Option<usize>) {
    let step = tree.survivors.len().div_ceil(MOST_GROUPED).max(1);
    let figures: Vec<StickFigure> =
        tree.survivors.iter().step_by(step).map(|&path| tree.view.interpretation(path).figure).collect();
    let mut found = group(&figures, scene.options.group_m);
    let count = (step == 1).then_some(found.len());
    // Stable sort: groups of the same size stay in the order of the walk.
    found.sort_by_key(|group| std::cmp::Reverse(group.members.len()));
    let represented = found.iter().take(scene.options.max_groups).map(|group| RepresentedGroup {
        figure: figure_in_world(&figures[group.representative], scene.camera),
        size: group.members.len(),
        diameter_m: group.diameter_m,
    });
    (represented.collect(), count)
}

/// Number of cuts of one constraint over the whole sequence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReasonTotal {
    /// The constraint; [`Constraint::description`] says what it is.
    pub constraint: Constraint,
    /// The level at which it cuts.
    pub joint: Joint,
    /// Number of branches it cut in all frames.
    pub branches: u64,
    /// Number of frames in which it cut any.
    pub frames: usize,
}

/// Sums the reasons of all frames, largest number of branches first.
pub fn reason_totals(frames: &[Result<FrameReading, FrameProblem>]) -> Vec<ReasonTotal> {
    let mut totals: Vec<ReasonTotal> = Constraint::ALL
        .into_iter()
        .map(|constraint| ReasonTotal { constraint, joint: constraint.level(), branches: 0, frames: 0 })
        .collect();
    for cut in frames.iter().flatten().flat_map(|frame| &frame.tree.reasons) {
        let place = Constraint::ALL.iter().position(|&constraint| constraint == cut.constraint);
        if let Some(total) = place.map(|place| &mut totals[place]) {
            total.branches += u64::from(cut.branches);
            total.frames += 1;
        }
    }
    totals.retain(|total| total.branches > 0);
    totals.sort_by_key(|total| std::cmp::Reverse(total.branches));
    totals
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::sequence::example::{walk, with_lengths};
    use crate::posture::sequence::{Motion, SequenceOptions};
    use crate::posture::tree::TreePath;

    /// Seen from the front with much noise, thousands of postures are possible, too many to compare all.
    #[test]
    fn the_number_of_groups_is_known_of_few_postures_alone() {
        let walk = walk(0.0, 6, 0.5);
        let mut counts = Vec::new();
        for noise_px in [0.5, 25.0] {
            let options = SequenceOptions { motion: Motion::Physical, noise_px, ..with_lengths() };
            for frame in walk.postures(&options).unwrap().frames.iter().flatten() {
                let is_few = frame.survivors() <= MOST_GROUPED;
                assert_eq!(frame.group_count.is_some(), is_few, "{}", frame.survivors());
                counts.push(is_few);
                let members: usize = frame.groups.iter().map(|group| group.size).sum();
                assert!(members <= MOST_GROUPED && frame.groups.is_sorted_by(|a, b| a.size >= b.size));
            }
        }
        assert!(counts.contains(&true) && counts.contains(&false), "{counts:?}");
    }

    /// The tree of a frame uses the deviations of the neck and of the lengths for a known scale.
    #[test]
    fn a_frame_knows_how_sure_neck_and_lengths_are() {
        let walk = walk(60.0, 12, 0.5);
        let options = SequenceOptions { lengths: None, height_m: Some(1.61), ..with_lengths() };
        let found = walk.postures(&options).unwrap();
        assert!(found.lengths.own_sd_m > 0.006, "{}", found.lengths.own_sd_m);
        for (t, frame) in found.frames.iter().enumerate() {
            let view = &frame.as_ref().unwrap().tree.view;
            assert_eq!((view.neck_sd_m, view.length_sd_m), (found.neck.sd_m[t], found.lengths.own_sd_m));
            assert_eq!(view.lengths, found.lengths.lengths);
        }
    }

    /// Survivors and cut branches together are all postures of a view; every branch breaks its constraint in all of them.
    #[test]
    fn every_posture_of_a_view_survives_or_hangs_on_one_cut_branch() {
        let walk = walk(60.0, 3, 0.5);
        let options = SequenceOptions { keep_cuts: true, ..with_lengths() };
        let camera = &walk.camera;
        let found = walk.postures(&options).unwrap();
        for frame in found.frames.iter().flatten() {
            let (survivors, cuts) = (frame.survivor_figures(camera), frame.cut_figures(camera));
            assert_eq!(survivors.len(), frame.survivors());
            let mut counts = std::collections::HashMap::new();
            let key = |figure: &StickFigure, level: usize| {
                figure.0[..=level]
                    .iter()
                    .map(|p| p.to_array().map(|x| (x * 1e7).round() as i64))
                    .collect::<Vec<_>>()
            };
            // All 8192 paths of 13 segments with two roots each, less those of segments with one.
            let mut all = std::collections::HashMap::new();
            for bits in 0..1 << 13 {
                let figure = frame.tree.view.interpretation(TreePath(bits << 1)).figure;
                let figure = figure_in_world(&figure, camera);
                all.insert(key(&figure, 13), figure);
            }
            for figure in &survivors {
                *counts.entry(key(figure, 13)).or_insert(0) += 1;
            }
            for (branch, constraint) in &cuts {
                let level = constraint.level() as usize;
                assert!(branch.0[..=level].iter().all(|p| p.is_finite()));
                assert!(branch.0[level + 1..].iter().all(|p| p.is_nan()));
                let prefix = key(branch, level);
                for figure in all.values().filter(|figure| key(figure, level) == prefix) {
                    *counts.entry(key(figure, 13)).or_insert(0) += 1;
                }
            }
            assert_eq!(counts.len(), all.len(), "each posture once");
            assert!(counts.values().all(|&count| count == 1));
        }
    }

    /// Reasons of all frames, compared with an independent count.
    #[test]
    fn reasons_add_up_with_the_strongest_first() {
        let walk = walk(60.0, 6, 0.5);
        let found = walk.postures(&with_lengths()).unwrap();
        let totals = reason_totals(&found.frames);
        assert!(totals.len() > 3 && totals.is_sorted_by(|a, b| a.branches >= b.branches));
        for total in &totals {
            let cuts =
                found.frames.iter().flatten().filter_map(|frame| {
                    frame.tree.reasons.iter().find(|cut| cut.constraint == total.constraint)
                });
            let branches: Vec<u64> = cuts.map(|cut| u64::from(cut.branches)).collect();
            assert_eq!((total.branches, total.frames), (branches.iter().sum(), branches.len()));
        }
    }
}
