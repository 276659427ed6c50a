//! The reflection of each limb, for points with known names.
//!
//! Hoffman and Flinchbaugh 1982 leave every limb's reflection about the image plane undetermined. The limits of
//! the body determine it: knees bend backward, elbows forward, thighs and upper arms stay in their ranges (Lee
//! and Chen 1985, Table 1, as in [`crate::posture::limits`]). This requires the facing direction of the body,
//! which the same points show: a body that faces away from the camera has its right hip and shoulder on the
//! right. Among the facing directions on that side, the one is chosen in which the limbs, each in its better
//! reflection, exceed their ranges least and, among equal ones, swing nearest to the sagittal plane.
//!
//! Limits: seen from the side, both reflections of a sagittal plane are equal; from the front, the hips do not
//! show the facing direction. The margins show this. The image's v axis is taken as the vertical of an upright
//! trunk.

use super::{Figure, FigureWindow, Verdict};
use crate::model::angles::{abduction_rad, elbow_rad, knee_rad, swing_rad};
use crate::model::limits::Limits;
use crate::model::skeleton::{Joint, Side};
use glam::{DMat3, DVec2, DVec3};

/// Number of facing directions tried, over the full circle.
const FACINGS: usize = 48;

/// Weight of the angle out of the sagittal plane relative to the excess over a range: it decides only if no range
/// does.
const SAGITTAL: f64 = 0.3;

/// The joint with a name such as `right_knee` or `RKN`; `None` for other points.
pub fn joint_of(name: &str) -> Option<Joint> {
    let short = |joint: &Joint| {
        let (side, part) = joint.name().split_once('_')?;
        let part = match part {
            "shoulder" => "SH",
            "elbow" => "EL",
            "wrist" => "WR",
            "hip" => "HP",
            "knee" => "KN",
            "ankle" => "AN",
            _ => return None,
        };
        Some(format!("{}{part}", side[..1].to_uppercase()))
    };
    Joint::from_name(name).or_else(|| Joint::ALL.into_iter().find(|j| short(j).is_some_and(|s| s == name)))
}

/// A limb, identified by the names of its joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Limb {
    side: Side,
    is_leg: bool,
    /// True if the chain starts at the trunk.
    from_trunk: bool,
}

impl Limb {
    fn of(joints: [Option<Joint>; 3]) -> Option<Self> {
        let find = |joints: [Joint; 3], from_trunk: bool| {
            Side::BOTH.into_iter().find_map(|side| {
                let leg = [side.hip(), side.knee(), side.ankle()];
                let arm = [side.shoulder(), side.elbow(), side.wrist()];
                (joints == leg || joints == arm).then_some(Self { side, is_leg: joints == leg, from_trunk })
            })
        };
        let [a, b, c] = joints;
        let (a, b, c) = (a?, b?, c?);
        find([a, b, c], true).or_else(|| find([c, b, a], false))
    }

    /// Mean cost of a reflection, degrees squared, for a body with these axes; `frames` are the chain's points in
    /// space by frame.
    fn cost(&self, frames: &[[DVec3; 3]], sign: f64, axes: &DMat3, limits: &Limits) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for points in frames {
            let [a, b, c] = points.map(|p| DVec3::new(p.x, p.y, sign * p.z));
            let (trunk, end) = if self.from_trunk { (a, c) } else { (c, a) };
            let (Some(u), Some(v)) = ((b - trunk).try_normalize(), (end - b).try_normalize()) else {
                continue;
            };
            let (swing, bend) = if self.is_leg {
                (limits.hip_swing, limits.knee.excess(knee_rad(axes, u, v)))
            } else {
                (limits.shoulder_swing, limits.elbow.excess(elbow_rad(axes, u, v)))
            };
            let sideways = if self.is_leg { limits.hip_abduction } else { limits.shoulder_abduction };
            // For a bend in the wrong direction, the full angle of the bend. A bend out of the sagittal plane
            // counts less.
            let excess = [
                swing.excess(swing_rad(axes, u)),
                sideways.excess(abduction_rad(axes, u, self.side)),
                bend,
                SAGITTAL * axes.z_axis.dot(u).asin(),
                SAGITTAL * axes.z_axis.dot(v).asin(),
            ];
            sum += excess.iter().map(|e| e.to_degrees().powi(2)).sum::<f64>();
            count += 1;
        }
        if count == 0 { f64::NAN } else { sum / f64::from(count) }
    }
}

/// Axes of an upright trunk that faces this angle from the image's right, away from the camera.
fn upright(facing_rad: f64) -> DMat3 {
    let forward = DVec3::new(facing_rad.cos(), 0.0, facing_rad.sin());
    DMat3::from_cols(forward, DVec3::Y, forward.cross(DVec3::Y))
}

/// Mean difference of u between right and left shoulders and hips, over frames; `None` if neither pair is known.
fn right_of_left(tracks: &[&[DVec2]], joints: &[Option<Joint>]) -> Option<f64> {
    let at = |joint: Joint| joints.iter().position(|j| *j == Some(joint)).map(|k| tracks[k]);
    let pairs = [[Joint::RightShoulder, Joint::LeftShoulder], [Joint::RightHip, Joint::LeftHip]];
    let known = pairs.into_iter().filter_map(|[right, left]| at(right).zip(at(left)));
    let apart: Vec<f64> = known
        .flat_map(|(right, left)| right.iter().zip(left).map(|(r, l)| r.x - l.x))
        .filter(|x| x.is_finite())
        .collect();
    (!apart.is_empty()).then(|| apart.iter().sum::<f64>() / apart.len() as f64)
}

/// Chooses for every named limb of a window the reflection within the limits of the body, and stores the margin
/// in the chain. Limbs that leave their planes stay undetermined.
fn reflect(figure: &mut Figure, tracks: &[&[DVec2]], joints: &[Option<Joint>], limits: &Limits) {
    let Some(apart) = right_of_left(tracks, joints) else { return };
    let mut limbs: Vec<(usize, Limb, Vec<[DVec3; 3]>)> = Vec::new();
    for (index, chain) in figure.chains.iter().enumerate() {
        let [a, b, c] = chain.points[..] else { continue };
        let Some(limb) = Limb::of([a, b, c].map(|p| joints[p])) else { continue };
        if chain.evidence.verdict == Verdict::NotPlanar {
            continue;
        }
        let point = |t: usize, k: usize| tracks[chain.points[k]][t].extend(chain.depth[t][k]);
        let frames = (0..chain.depth.len()).map(|t| [0, 1, 2].map(|k| point(t, k)));
        limbs.push((index, limb, frames.filter(|f| f.iter().all(|p| p.is_finite())).collect()));
    }
    // sin of the facing angle has the sign of `apart`: a body facing away has its right side on the right.
    let facings = (0..=FACINGS / 2).map(|i| std::f64::consts::TAU * i as f64 / FACINGS as f64);
    let costs_at = |facing_rad: f64| -> Vec<[f64; 2]> {
        let axes = upright(facing_rad.copysign(apart));
        limbs
            .iter()
            .map(|(_, limb, frames)| [1.0, -1.0].map(|s| limb.cost(frames, s, &axes, limits)))
            .collect()
    };
    let total =
        |costs: &[[f64; 2]]| costs.iter().map(|[a, b]| a.min(*b)).filter(|x| !x.is_nan()).sum::<f64>();
    let best = facings.map(costs_at).min_by(|a, b| total(a).total_cmp(&total(b)));
    for ((index, ..), [given, mirrored]) in limbs.iter().zip(best.unwrap_or_default()) {
        let chain = &mut figure.chains[*index];
        if given.is_nan() {
            continue;
        }
        if mirrored < given {
            chain.plane = chain.plane.mirror();
            chain.depth.iter_mut().flatten().for_each(|z| *z = -*z);
        }
        chain.reflection_margin_deg = Some((given.max(mirrored)).sqrt() - (given.min(mirrored)).sqrt());
    }
}

/// Chooses for every limb the reflection within the limits of the body, given the joint of each point. If the
/// margin of a chain is `None`, its reflection is undetermined.
pub(super) fn reflect_by_anatomy(
    windows: &mut [FigureWindow],
    tracks: &[Vec<DVec2>],
    joints: &[Option<Joint>],
) {
    let limits = Limits::measured();
    for window in windows {
        let part: Vec<&[DVec2]> = tracks.iter().map(|track| &track[window.start..window.end]).collect();
        reflect(&mut window.figure, &part, joints, &limits);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_known_long_and_short() {
        assert_eq!(joint_of("RKN"), Some(Joint::RightKnee));
        assert_eq!(joint_of("left_wrist"), Some(Joint::LeftWrist));
        assert_eq!((joint_of("dot03"), joint_of("")), (None, None));
        let joints = ["LAN", "LKN", "LHP"].map(joint_of);
        assert_eq!(Limb::of(joints), Some(Limb { side: Side::Left, is_leg: true, from_trunk: false }));
        assert_eq!(Limb::of(["LAN", "LKN", "RHP"].map(joint_of)), None);
    }

    #[test]
    fn a_knee_bends_backwards_and_an_elbow_forwards() {
        // Facing the camera: the knee is nearer to it (z < 0), the ankle behind; for arms the opposite.
        let leg = vec![[DVec3::ZERO, DVec3::new(2.0, 80.0, -30.0), DVec3::new(3.0, 160.0, 10.0)]; 5];
        let axes = upright(-std::f64::consts::FRAC_PI_2);
        let cost = |is_leg: bool, sign: f64| {
            let limb = Limb { side: Side::Right, is_leg, from_trunk: true };
            limb.cost(&leg, sign, &axes, &Limits::measured())
        };
        assert!(cost(true, 1.0) + 100.0 < cost(true, -1.0));
        assert!(cost(false, -1.0) + 100.0 < cost(false, 1.0));
    }

    const FREE: DMat3 = DMat3::IDENTITY;

    /// A limb of one frame in the axes of a person who faces along x, y down, z to the left.
    fn cost(limb: &Limb, segments: [DVec3; 2]) -> f64 {
        let points = [DVec3::ZERO, segments[0], segments[0] + segments[1]];
        let points = if limb.from_trunk { points } else { [points[2], points[1], points[0]] };
        limb.cost(&[points], 1.0, &FREE, &Limits::measured())
    }

    /// Squares of the degrees by which a limb exceeds each limit, and of 0.3 of its angles out of the sagittal
    /// plane, for the upper and the lower segment separately.
    #[test]
    fn a_limb_costs_what_it_leaves_its_limits_and_its_plane_by() {
        let swung = |deg: f64| DVec3::new(deg.to_radians().sin(), deg.to_radians().cos(), 0.0);
        let aside = |deg: f64| DVec3::new(0.0, deg.to_radians().cos(), deg.to_radians().sin());
        for from_trunk in [true, false] {
            let [leg, arm] = [true, false].map(|is_leg| Limb { side: Side::Left, is_leg, from_trunk });
            let cases = [
                // Straight down; thigh 55 degrees back, 10 beyond the limit of 45; arm 75 back, 15 beyond 60.
                (&leg, [DVec3::Y, DVec3::Y], 0.0),
                (&leg, [swung(-55.0), swung(-60.0)], 100.0),
                (&arm, [swung(-75.0), swung(-70.0)], 225.0),
                // Knee bent forward by 20, 12 beyond; elbow bent back by 20, 15 beyond.
                (&leg, [DVec3::Y, swung(20.0)], 144.0),
                (&arm, [DVec3::Y, swung(-20.0)], 225.0),
                // Shank 30 degrees to the side: 9 of 30. The thigh as well: 9 for each, and a leg spread by 40 is
                // allowed.
                (&leg, [DVec3::Y, aside(30.0)], 81.0),
                (&leg, [aside(30.0), aside(30.0)], 162.0),
                // Across the other leg by 45 degrees: 10 beyond 35, and 13.5 squared twice.
                (&leg, [aside(-45.0), aside(-45.0)], 100.0 + 2.0 * 13.5 * 13.5),
            ];
            for (limb, segments, expected) in cases {
                let found = cost(limb, segments);
                assert!((found - expected).abs() < 1e-6, "{limb:?} {segments:?}: {found} for {expected}");
            }
            // The right leg is spread the other way.
            let right = Limb { side: Side::Right, ..leg };
            assert!((cost(&right, [aside(45.0), aside(45.0)]) - 100.0 - 2.0 * 13.5 * 13.5).abs() < 1e-6);
        }
    }

    /// A person who walks to the right of the image, seen 30 degrees from behind or from the front: the nearer
    /// side determines the reflection, and so does the shoulder that is on the right.
    #[test]
    fn anatomy_finds_the_reflection_of_a_walk() {
        use crate::planar::figure::example::walker;
        use crate::synth::motion::WALKER_NAMES;
        use crate::{FigureOptions, interpret_figure};
        for turn in [0.0, -1.2, 0.9, 2.0, 3.0, 4.4] {
            let (tracks, times_s, truth) = walker(66, |_| turn, 0.0);
            let found = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap();
            let joints: Vec<Option<Joint>> =
                WALKER_NAMES.iter().take(12).map(|name| joint_of(name)).collect();
            // Starting from either reflection of every chain.
            for mirrored in [false, true] {
                let mut windows = found.windows.clone();
                for chain in &mut windows[0].figure.chains {
                    if mirrored {
                        chain.plane = chain.plane.mirror();
                        chain.depth.iter_mut().flatten().for_each(|z| *z = -*z);
                    }
                }
                reflect_by_anatomy(&mut windows, &tracks, &joints);
                for chain in &windows[0].figure.chains {
                    let Some(margin) = chain.reflection_margin_deg else { continue };
                    assert!(margin >= 0.0);
                    let [a, pivot, b] = chain.points[..] else { continue };
                    let depth = |t: usize, k: usize| truth[t * 12 + k] - truth[t * 12 + a];
                    let agreement: f64 = (0..66)
                        .map(|t| chain.depth[t][1] * depth(t, pivot) + chain.depth[t][2] * depth(t, b))
                        .sum();
                    assert!(agreement > 0.0 || margin < 5.0, "{turn} {:?} {margin}", chain.points);
                    // The plane is that of the depths.
                    let z = chain.plane.depth(tracks[pivot][0] - tracks[a][0]);
                    assert!((z - chain.depth[0][1]).abs() < 1e-6);
                }
            }
        }
    }

    /// The margin is the difference of the root mean squares of both reflections, degrees.
    #[test]
    fn the_margin_is_in_degrees() {
        use crate::planar::figure::example::walker;
        use crate::synth::motion::WALKER_NAMES;
        use crate::{FigureOptions, interpret_figure};
        let (tracks, times_s, _) = walker(66, |_| 0.3, 0.0);
        let joints: Vec<Option<Joint>> = WALKER_NAMES.iter().take(12).map(|name| joint_of(name)).collect();
        let mut windows = interpret_figure(&tracks, &times_s, &FigureOptions::default()).unwrap().windows;
        reflect_by_anatomy(&mut windows, &tracks, &joints);
        let part: Vec<&[DVec2]> = tracks.iter().map(|track| &track[..]).collect();
        let apart = right_of_left(&part, &joints).unwrap();
        let mean =
            |a: usize, b: usize| part[a].iter().zip(part[b]).map(|(r, l)| r.x - l.x).sum::<f64>() / 66.0;
        assert!((apart - 0.5 * (mean(0, 3) + mean(6, 9))).abs() < 1e-9, "right less left");
        let limits = Limits::measured();
        let of_chains = |axes: &DMat3| -> Vec<[f64; 2]> {
            let chains = windows[0].figure.chains.iter();
            chains
                .map(|chain| {
                    let limb = Limb::of([0, 1, 2].map(|k| joints[chain.points[k]])).unwrap();
                    let frames: Vec<[DVec3; 3]> = (0..66)
                        .map(|t| [0, 1, 2].map(|k| tracks[chain.points[k]][t].extend(chain.depth[t][k])))
                        .collect();
                    [1.0, -1.0].map(|sign| limb.cost(&frames, sign, axes, &limits))
                })
                .collect()
        };
        // Among the facing directions with the right side as seen, the one with the smallest cost over all limbs.
        let facing = |i: i32| (f64::from(i) * std::f64::consts::TAU / 48.0).copysign(apart);
        let total = |costs: &[[f64; 2]]| costs.iter().map(|[a, b]| a.min(*b)).sum::<f64>();
        let best = (0..=24)
            .map(|i| of_chains(&upright(facing(i))))
            .min_by(|a, b| total(a).total_cmp(&total(b)))
            .unwrap();
        for (chain, [kept, other]) in windows[0].figure.chains.iter().zip(best) {
            let margin = chain.reflection_margin_deg.unwrap();
            assert!((other.sqrt() - kept.sqrt() - margin).abs() < 1e-9, "{margin} {kept} {other}");
        }
    }
}
