//! Warnings about the postures of a sequence.

use glam::DVec2;
use rayon::prelude::*;

use super::frame::{FrameProblem, FrameReading};
use super::heading::{Heading, HeadingFrom};
use super::neck::{NeckTrack, Scene, SourceConflict};
use super::{Allowed, AnchorChoice, Motion, SequenceOptions, Strength};
use crate::model::angles::trunk_axes;
use crate::model::skeleton::{Joint, PerJoint};
use crate::posture::constraint::{Constraint, ConstraintKind};
use crate::posture::link::LinkedPath;
use crate::posture::tree::TreeOptions;

/// A reason to doubt a result. Its text is a sentence with the numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// Joints were ignored because of their weights.
    LightJoints {
        /// Number of joints ignored.
        light: usize,
        /// Number of all points.
        all: usize,
        /// Minimum weight.
        min_weight: f64,
    },
    /// Joints are where the lens shows nothing.
    OutsideLens {
        /// Number of such joints.
        outside: usize,
        /// Number of all points.
        all: usize,
    },
    /// Joints are outside the image for which the camera is calibrated.
    OutsidePicture {
        /// Number of such joints.
        beyond: usize,
        /// Number of all points.
        all: usize,
        /// Width and height of the image, pixels.
        size: [u32; 2],
        /// Largest coordinates found, pixels.
        farthest_px: DVec2,
    },
    /// The camera is not above the ground.
    NoGround {
        /// Its height, metres.
        camera_height_m: f64,
    },
    /// The lengths come from proportions alone.
    LengthsNotSeen {
        /// The reason.
        reason: String,
    },
    /// The scale of the lengths is that of an adult of assumed height.
    ScaleAssumed {
        /// Relative standard deviation of the scale.
        scale_sd: f64,
    },
    /// A segment looks longer than it can be.
    SegmentTooShort {
        /// Its name.
        segment: String,
        /// Its length, metres.
        length_m: f64,
        /// The smallest length that fits the image, median, metres.
        seen_m: f64,
        /// Number of such frames.
        frames: usize,
        /// Number of frames in which it is seen.
        of: usize,
    },
    /// Sources of the neck's distance contradict each other in many frames.
    Conflict(SourceConflict),
    /// There is no moving direction for the rules of the motion.
    NoTravel {
        /// Displacement on the ground, metres; NaN if not known.
        travelled_m: f64,
        /// The direction used instead.
        from: HeadingFrom,
    },
    /// The person turns.
    Turns {
        /// Angle between the first and the second half of the path, degrees.
        turn_deg: f64,
    },
    /// The person walks backward, or right and left are swapped in the whole sequence.
    Backwards {
        /// Frames in which the trunk of the linked posture faces against the moving direction.
        frames: usize,
        /// Number of frames compared.
        of: usize,
    },
    /// Frames are not used.
    SilentFrames {
        /// Number of such frames.
        silent: usize,
        /// Number of all frames.
        of: usize,
        /// Why the first of them is not used.
        reason: FrameProblem,
    },
    /// Many segments look longer than they are.
    WithoutRoot {
        /// Their share.
        share: f64,
        /// The largest share explained by the given noise.
        usual: f64,
    },
    /// The points are noisier than stated.
    Noisy {
        /// Standard deviation of a coordinate, estimated from the jumps of the points, pixels.
        seen_px: f64,
        /// Standard deviation given, pixels.
        stated_px: f64,
    },
    /// In most frames no posture survives the physical limits.
    NothingPossible {
        /// Number of such frames.
        frames: usize,
        /// Number of all frames.
        of: usize,
    },
    /// In most frames the linked posture breaks physical limits.
    LinkedBreaks {
        /// Number of such frames.
        frames: usize,
        /// Number of all frames.
        of: usize,
    },
    /// With the habits of the motion, the most probable postures break limits of the body, so its habits and rules were
    /// not used.
    HabitsDropped {
        /// The motion.
        motion: Motion,
        /// Number of frames whose posture broke a limit of the body, or whose limbs swung against themselves.
        frames: usize,
        /// Number of frames.
        of: usize,
    },
    /// The rules of the motion leave no posture in many frames, so its habits and rules were not used.
    RulesDropped {
        /// The motion.
        motion: Motion,
        /// Number of frames in which its rules leave no posture.
        frames: usize,
        /// Number of frames in which the physical limits leave a posture.
        of: usize,
    },
    /// The rules of the motion leave no posture in frames in which the physical limits do.
    AgainstRules {
        /// The motion.
        motion: Motion,
        /// Their strength.
        strength: Strength,
        /// Number of frames in which the rules leave no posture.
        frames: usize,
        /// Number of frames in which the physical limits leave a posture.
        of: usize,
        /// Share of linked postures that break a rule.
        linked: f64,
    },
}

/// Largest share of segments without real root that noise explains: 36 % at 8 px, measured on walks.
const USUAL_WITHOUT_ROOT: f64 = 0.36;
/// Sources that conflict in a larger share of frames give a warning.
const MANY_CONFLICTS: f64 = 0.1;

/// All results, with figures in camera axes.
pub(super) struct Found<'a> {
    /// The constraints used, per frame.
    pub trees: &'a [TreeOptions],
    pub frames: &'a [Result<FrameReading, FrameProblem>],
    pub linked: &'a LinkedPath,
    /// Constraints that the linked postures break.
    pub linked_breaks: &'a [Vec<Constraint>],
    pub neck: &'a NeckTrack,
}

/// Adds the warnings about all results.
pub(super) fn judge(scene: &Scene, found: &Found, warnings: &mut Vec<Warning>) {
    let Found { frames, linked, neck, .. } = found;
    let many = |conflict: &&SourceConflict| conflict.frames as f64 > MANY_CONFLICTS * conflict.of as f64;
    warnings.extend(neck.conflicts.iter().filter(many).map(|&conflict| Warning::Conflict(conflict)));
    let silent = frames.iter().filter(|frame| frame.is_err()).count();
    if let Some(reason) = frames.iter().find_map(|frame| frame.as_ref().err()) {
        warnings.push(Warning::SilentFrames { silent, of: frames.len(), reason: reason.clone() });
    }
    warnings.extend(without_root(&linked.gap_m));
    warnings.extend(noisy(scene));
    warnings.extend(rejected(scene, found));
}

/// Warns if the linked trunk faces against the displacement in most frames, and rules or prior are for forward
/// motion.
pub(super) fn backwards(scene: &Scene, heading: &Heading, linked: &LinkedPath) -> Option<Warning> {
    let heading = heading.direction.filter(|_| scene.options.motion.needs_heading())?;
    let in_camera = scene.camera.rotation * heading;
    let trunks = linked.figures.iter().filter_map(trunk_axes);
    let ahead: Vec<f64> = trunks.map(|axes| axes.x_axis.dot(in_camera)).collect();
    let frames = ahead.iter().filter(|ahead| **ahead < 0.0).count();
    (2 * frames > ahead.len()).then_some(Warning::Backwards { frames, of: ahead.len() })
}

fn without_root(gap_m: &[PerJoint<f64>]) -> Option<Warning> {
    let gaps: Vec<f64> =
        gap_m.iter().flat_map(|gaps| gaps.0[1..].iter().copied()).filter(|gap| !gap.is_nan()).collect();
    let share = gaps.iter().filter(|&&gap| gap > 0.0).count() as f64 / gaps.len().max(1) as f64;
    (share > USUAL_WITHOUT_ROOT).then_some(Warning::WithoutRoot { share, usual: USUAL_WITHOUT_ROOT })
}

/// For three frames at equal intervals the second difference of a coordinate has √6 times its noise. Medians are
/// used, because limbs that move fast and joints that jump to the other side are few.
fn noisy(scene: &Scene) -> Option<Warning> {
    let (points_px, times_s) = (scene.sequence.points_px, scene.sequence.times_s);
    let mut jumps_px = Vec::new();
    for t in 2..times_s.len() {
        let [before_s, after_s] = [times_s[t - 1] - times_s[t - 2], times_s[t] - times_s[t - 1]];
        let share = before_s / (before_s + after_s);
        // x₁ - (1-s) x₀ - s x₂: variance 1 + (1-s)² + s².
        let factor = (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt();
        for joint in Joint::ALL.into_iter().filter(|&joint| (t - 2..=t).all(|t| scene.rays[t].sees(joint))) {
            let [a, b, c]: [DVec2; 3] = [2, 1, 0].map(|back| points_px[t - back][joint]);
            let jump = (b - a.lerp(c, share)) / factor;
            jumps_px.extend([jump.x.abs(), jump.y.abs()]);
        }
    }
    if jumps_px.is_empty() {
        return None;
    }
    jumps_px.sort_by(f64::total_cmp);
    let seen_px = 1.4826 * jumps_px[jumps_px.len() / 2];
    let stated_px = scene.options.noise_px;
    // Half a pixel: rounding.
    (seen_px > 2.0 * stated_px + 0.5).then_some(Warning::Noisy { seen_px, stated_px })
}

/// Rules that leave no posture in this share of the frames in which the body allows one are dropped: then they also cut
/// true postures. Of upright motion-captured walks they leave none in at most WALKS %, of crouched ones up to 55 %.
const MISFIT: f64 = 0.32;
/// The habits of a motion are dropped if the linked posture breaks limits of the body, or rule 3, in this share of the
/// frames: of motion-captured walks, crouched and limping ones too, in at most 21 %.
const BROKEN_BODIES: f64 = 0.3;

/// True of limits of the body, and of rule 3, by which the segments of one limb swing together: walkers of all kinds keep
/// them, unlike the other rules.
fn is_of_any_walk(constraint: &Constraint) -> bool {
    use Constraint::{ElbowWrist, HipKnee, KneeAnkle, ShoulderElbow};
    let is_rule_3 = matches!(constraint, ShoulderElbow(_) | ElbowWrist(_) | HipKnee(_) | KneeAnkle(_));
    is_rule_3 || constraint.kind() != ConstraintKind::Rule
}

/// A warning that rules or habits of the motion are dropped, if they do not fit. The printed rules, which fit hardly any
/// real walk, are kept.
pub(super) fn misfit(scene: &Scene, allowed: &Allowed, linked_breaks: &[Vec<Constraint>]) -> Option<Warning> {
    let SequenceOptions { motion, strength, .. } = *scene.options;
    if motion == Motion::Physical || strength == Strength::Paper {
        return None;
    }
    let frames = allowed.frames.iter().flatten().count();
    let broken = linked_breaks.iter().filter(|broken| broken.iter().any(is_of_any_walk)).count();
    if broken as f64 > BROKEN_BODIES * frames as f64 {
        return Some(Warning::HabitsDropped { motion, frames: broken, of: frames });
    }
    let Rejected { of, empty, impossible } = Rejected::count(scene, &allowed.frames, &allowed.trees);
    let (frames, of) = (empty - impossible, of - impossible);
    let is_misfit = frames as f64 > MISFIT * of as f64;
    is_misfit.then_some(Warning::RulesDropped { motion, frames, of })
}

/// Number of frames with a tree, of those without a posture left, and of those in which the body alone allows none.
struct Rejected {
    of: usize,
    empty: usize,
    impossible: usize,
}

impl Rejected {
    fn count(scene: &Scene, frames: &[Result<FrameReading, FrameProblem>], trees: &[TreeOptions]) -> Self {
        let of = frames.iter().flatten().count();
        let is_empty = |frame: &FrameReading| frame.survivors() == 0;
        let empty: Vec<(usize, &FrameReading)> = frames
            .iter()
            .enumerate()
            .filter_map(|(t, frame)| Some((t, frame.as_ref().ok().filter(|frame| is_empty(frame))?)))
            .collect();
        let has_rules = scene.options.motion != Motion::Physical;
        let is_impossible = |&&(t, frame): &&(usize, &FrameReading)| {
            let body = TreeOptions { motion: None, keep_cuts: false, ..trees[t].clone() };
            !has_rules || frame.tree.view.interpret(&body).is_ok_and(|tree| tree.survivors.is_empty())
        };
        let impossible = empty.par_iter().filter(is_impossible).count();
        Self { of, empty: empty.len(), impossible }
    }
}

/// Warns if limits or rules reject most frames.
fn rejected(scene: &Scene, found: &Found) -> Vec<Warning> {
    let Rejected { of, empty, impossible } = Rejected::count(scene, found.frames, found.trees);
    let has_rules = scene.options.motion != Motion::Physical;
    let mut warnings = Vec::new();
    if 2 * impossible > of {
        warnings.push(Warning::NothingPossible { frames: impossible, of });
    }
    let breaking = |is_rule: bool| {
        let is_of_kind = |c: &Constraint| (c.kind() == ConstraintKind::Rule) == is_rule;
        found.linked_breaks.iter().filter(|broken| broken.iter().any(is_of_kind)).count()
    };
    let against_bodies = breaking(false);
    if 2 * against_bodies > of && 2 * impossible <= of {
        warnings.push(Warning::LinkedBreaks { frames: against_bodies, of });
    }
    if !has_rules {
        return warnings;
    }
    let linked = breaking(true) as f64 / of.max(1) as f64;
    let (against, possible) = (empty - impossible, of - impossible);
    // Where no body is possible, nothing speaks for or against a way of moving.
    if possible > 0 && (2 * against > possible || linked > 0.5) {
        let (motion, strength) = (scene.options.motion, scene.options.strength);
        warnings.push(Warning::AgainstRules { motion, strength, frames: against, of: possible, linked });
    }
    warnings
}

/// Warnings about scale and lengths, before any frame is processed.
pub(super) fn of_scale(scene: &Scene) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let camera_height_m = scene.camera.position().z;
    // Of an assumed camera nobody expects a ground.
    if scene.ground.is_none() && scene.options.focal_sd == 0.0 {
        warnings.push(Warning::NoGround { camera_height_m });
    }
    let is_given = matches!(scene.options.anchor, AnchorChoice::Given { .. });
    if !is_given && scene.lengths.scale_name() == "assumed" {
        warnings.push(Warning::ScaleAssumed { scale_sd: scene.lengths.scale_sd });
    }
    warnings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::camera::Camera;
    use crate::model::skeleton::{JOINT_COUNT, Side};
    use crate::posture::anchor::{AnchorSource, Ground};
    use crate::posture::lift::JointRays;
    use crate::posture::sequence::example::{Walk, walk, with_lengths};
    use crate::posture::sequence::{PostureSequence, SequenceOptions};

    #[test]
    fn many_segments_too_long_are_told_from_the_share_that_noise_explains() {
        for (long, is_told) in [(30, false), (40, true)] {
            // Exactly this share of 100 known segments looks too long; unknown segments do not count.
            let gaps: Vec<f64> = (0..104)
                .map(|i| {
                    if i >= 100 {
                        f64::NAN
                    } else if i < long {
                        0.01
                    } else {
                        0.0
                    }
                })
                .collect();
            let gap_m: Vec<PerJoint<f64>> = gaps
                .chunks(13)
                .map(|gaps| {
                    let mut frame = PerJoint([0.5; JOINT_COUNT]);
                    frame.0[1..].copy_from_slice(gaps);
                    frame
                })
                .collect();
            let told = without_root(&gap_m);
            assert_eq!(told.is_some(), is_told, "{told:?}");
            if let Some(Warning::WithoutRoot { share, .. }) = told {
                assert!((share - 0.4).abs() < 1e-12);
            }
        }
    }

    fn warnings(walk: &Walk, change: impl Fn(&mut SequenceOptions)) -> Vec<Warning> {
        let mut options = with_lengths();
        change(&mut options);
        walk.postures(&options).unwrap().warnings
    }

    /// The noise of a walk's points is estimated from their jumps, also for unequal intervals.
    #[test]
    fn points_noisier_than_stated_are_told_by_how_much() {
        let mut walk = walk(60.0, 60, 5.0);
        for t in (0..60).rev().filter(|t| t % 3 == 1) {
            walk.times_s.remove(t);
            walk.points_px.remove(t);
            walk.weights.remove(t);
        }
        let told = warnings(&walk, |options| options.noise_px = 1.0);
        let seen = told.iter().find_map(|warning| match warning {
            Warning::Noisy { seen_px, stated_px: 1.0 } => Some(*seen_px),
            _ => None,
        });
        // The walk's own acceleration between frames adds to the estimate.
        assert!(seen.is_some_and(|seen_px| (4.5..6.5).contains(&seen_px)), "{seen:?}");
        assert!(!warnings(&walk, |o| o.noise_px = 4.0).iter().any(|w| matches!(w, Warning::Noisy { .. })));
    }

    /// Left and right swapped, or backward walking: seen from the front, a person who faces away.
    #[test]
    fn a_trunk_against_the_way_is_told() {
        let mut walk = walk(15.0, 20, 0.5);
        let is_told = |told: &[Warning]| told.iter().any(|w| matches!(w, Warning::Backwards { .. }));
        assert!(!is_told(&warnings(&walk, |options| options.motion = Motion::WalkingGeneral)));
        for points in &mut walk.points_px {
            *points = PerJoint(Joint::ALL.map(|joint| points[joint.mirrored()]));
        }
        let told = warnings(&walk, |options| options.motion = Motion::WalkingGeneral);
        assert!(is_told(&told), "{told:?}");
    }

    /// The warnings for a sequence in which this many frames have no survivors and linked postures break these
    /// limits.
    fn judged(
        found: &PostureSequence,
        walk: &Walk,
        motion: Motion,
        empty: usize,
        breaks: &[Constraint],
    ) -> Vec<Warning> {
        let mut frames = found.frames.clone();
        for frame in frames.iter_mut().take(empty) {
            frame.as_mut().unwrap().tree.survivors.clear();
        }
        // Six of ten linked postures break it.
        let linked_breaks: Vec<Vec<Constraint>> =
            (0..10).map(|t| if t < 6 { breaks.to_vec() } else { vec![] }).collect();
        let options = SequenceOptions { motion, ..with_lengths() };
        let trees = vec![motion.tree(options.strength); 10];
        let rays: Vec<JointRays> = frames.iter().map(|f| f.as_ref().unwrap().tree.view.rays).collect();
        let ground = Some(Ground::of(&walk.camera));
        let (sequence, lengths) = (walk.sequence(), &found.lengths);
        let scene = Scene {
            sequence: &sequence,
            camera: &walk.camera,
            ground,
            rays: &rays,
            lengths,
            options: &options,
        };
        let of = Found {
            trees: &trees,
            frames: &frames,
            linked: &found.linked,
            linked_breaks: &linked_breaks,
            neck: &found.neck,
        };
        rejected(&scene, &of)
    }

    #[test]
    fn what_leaves_no_posture_is_told_from_half_the_frames_on() {
        let walk = walk(60.0, 10, 0.5);
        let found = walk.postures(&with_lengths()).unwrap();
        let judge = |motion, empty, breaks: &[Constraint]| judged(&found, &walk, motion, empty, breaks);
        assert_eq!(judge(Motion::Walking, 5, &[]), []);
        // The physical limits leave postures, so the warning is about the rules.
        let against = judge(Motion::Walking, 6, &[]);
        assert!(
            matches!(against[..], [Warning::AgainstRules { frames: 6, of: 10, linked: 0.0, .. }]),
            "{against:?}"
        );
        // Without rules, the warning is about the physical limits.
        assert_eq!(judge(Motion::Physical, 5, &[]), []);
        assert_eq!(judge(Motion::Physical, 6, &[]), [Warning::NothingPossible { frames: 6, of: 10 }]);
        // Constraints that the linked postures break.
        let linked = judge(Motion::Walking, 0, &[Constraint::ArmsOpposed]);
        assert!(matches!(linked[..], [Warning::AgainstRules { frames: 0, linked: 0.6, .. }]), "{linked:?}");
        let limits = [Constraint::NeckFlexion];
        assert_eq!(judge(Motion::Walking, 0, &limits), [Warning::LinkedBreaks { frames: 6, of: 10 }]);
        // If no posture is possible, there is no second warning about linked postures.
        assert_eq!(judge(Motion::Physical, 6, &limits), [Warning::NothingPossible { frames: 6, of: 10 }]);
    }

    /// Rules are dropped from a third of the frames on, habits from three tenths on, never the printed ones.
    #[test]
    fn rules_and_habits_are_dropped_where_too_many_frames_speak_against_them() {
        let walk = walk(60.0, 10, 0.5);
        let found = walk.postures(&with_lengths()).unwrap();
        let rays: Vec<JointRays> = found.frames.iter().map(|f| f.as_ref().unwrap().tree.view.rays).collect();
        let (sequence, lengths) = (walk.sequence(), &found.lengths);
        let judge =
            |motion: Motion, strength: Strength, empty: usize, broken: &[Constraint], count: usize| {
                let mut frames = found.frames.clone();
                for frame in frames.iter_mut().take(empty) {
                    frame.as_mut().unwrap().tree.survivors.clear();
                }
                let breaks: Vec<Vec<Constraint>> =
                    (0..10).map(|t| if t < count { broken.to_vec() } else { vec![] }).collect();
                let options = SequenceOptions { motion, strength, ..with_lengths() };
                let trees = vec![motion.tree(strength); 10];
                let allowed = Allowed { heading: found.heading, trees, frames, warnings: Vec::new() };
                let (camera, rays, options) = (&walk.camera, &rays, &options);
                let scene = Scene { sequence: &sequence, camera, ground: None, rays, lengths, options };
                misfit(&scene, &allowed, &breaks)
            };
        let (measured, knee, rule) =
            (Strength::Measured, [Constraint::NeckFlexion], [Constraint::ArmsOpposed]);
        for motion in [Motion::Walking, Motion::WalkingGeneral] {
            assert_eq!(judge(motion, measured, 3, &knee, 3), None);
            let rules = Warning::RulesDropped { motion, frames: 4, of: 10 };
            assert_eq!(judge(motion, measured, 4, &rule, 10), Some(rules));
            let habits = Warning::HabitsDropped { motion, frames: 4, of: 10 };
            assert_eq!(judge(motion, measured, 10, &knee, 4), Some(habits.clone()));
            assert_eq!(judge(motion, measured, 0, &[Constraint::HipKnee(Side::Left)], 4), Some(habits));
            assert_eq!(judge(motion, Strength::Paper, 10, &knee, 10), None);
        }
        assert_eq!(judge(Motion::Physical, measured, 10, &knee, 10), None);
    }

    /// Frames in which no body posture is possible do not count against the rules.
    #[test]
    fn impossible_frames_are_not_held_against_the_rules() {
        let walk = walk(60.0, 10, 0.5);
        let mut found = walk.postures(&with_lengths()).unwrap();
        // Legs as thick as trees collide in every posture.
        let mut thick = Motion::Walking.tree(Strength::Measured);
        thick.collisions.as_mut().unwrap().leg_m = 2.0;
        for frame in found.frames.iter_mut().flatten() {
            frame.tree.survivors.clear();
        }
        let options = with_lengths();
        let rays: Vec<JointRays> = found.frames.iter().map(|f| f.as_ref().unwrap().tree.view.rays).collect();
        let sequence = walk.sequence();
        let scene = Scene {
            sequence: &sequence,
            camera: &walk.camera,
            ground: None,
            rays: &rays,
            lengths: &found.lengths,
            options: &options,
        };
        let of = Found {
            trees: &vec![thick; 10],
            frames: &found.frames,
            linked: &found.linked,
            linked_breaks: &vec![vec![]; 10],
            neck: &found.neck,
        };
        assert_eq!(rejected(&scene, &of), [Warning::NothingPossible { frames: 10, of: 10 }]);
        let broken = vec![vec![Constraint::ArmsOpposed]; 10];
        let breaking = rejected(&scene, &Found { linked_breaks: &broken, ..of });
        assert_eq!(breaking, [Warning::NothingPossible { frames: 10, of: 10 }]);
        // Conflicts give a warning if they occur in more than one frame in ten.
        let conflict = |frames| SourceConflict {
            sources: [AnchorSource::Ground, AnchorSource::Trunk],
            frames,
            of: 100,
            distances_m: [4.0, 5.0],
            sigmas: 4.0,
        };
        let neck = NeckTrack { conflicts: vec![conflict(9), conflict(11)], ..found.neck.clone() };
        let mut told = Vec::new();
        judge(&scene, &Found { neck: &neck, ..of }, &mut told);
        let conflicts: Vec<&Warning> = told.iter().filter(|w| matches!(w, Warning::Conflict(_))).collect();
        assert_eq!(conflicts, [&Warning::Conflict(conflict(11))]);
    }

    #[test]
    fn a_scale_that_nobody_told_is_told() {
        let walk = walk(60.0, 10, 0.5);
        let mut low = Camera::level([1920, 1920], 0.9273, 1.2, 5.0).unwrap();
        low.translation.y = -0.3;
        let is_assumed = |told: &[Warning]| told.iter().any(|w| matches!(w, Warning::ScaleAssumed { .. }));
        let trunk = AnchorChoice::Source(AnchorSource::Trunk);
        assert!(is_assumed(&warnings(&walk, |o| (o.lengths, o.anchor) = (None, trunk.clone()))));
        assert!(!is_assumed(
            &warnings(&walk, |o| (o.lengths, o.height_m, o.anchor) = (None, Some(1.6), trunk.clone()))
        ));
        assert!(!is_assumed(&warnings(&walk, |o| o.anchor = trunk.clone())));
        let given = AnchorChoice::Given { distance_m: vec![5.0], sd_m: 0.1 };
        assert!(!is_assumed(&warnings(&walk, |o| (o.lengths, o.anchor) = (None, given.clone()))));
        let sunk = Walk { camera: low, ..walk };
        let told = warnings(&sunk, |_| {});
        assert!(told.iter().any(|w| matches!(w, Warning::NoGround { .. })), "{told:?}");
    }
}
