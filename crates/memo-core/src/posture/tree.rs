//! The interpretation tree: every posture that the joints of one view allow (Lee and Chen 1985, sections 2.2,
//! 3.1-3.3).
//!
//! The tree has a level for each joint in the order of [`Joint::ALL`]. A node of a level has two successors,
//! the two roots of the next segment: near (first) and far. It is walked depth first, and a branch is cut as
//! soon as the joints that a constraint needs are there; of several the first in the order of
//! [`Constraint::ALL`] is the reason. A segment without a real root has one successor, the nearest point on
//! its ray; so has a joint that is not seen, which is left open together with all that hangs on it.
//!
//! The walk is the plain one, but what a constraint says of the same limbs on the same trunk is asked once.
//!
//! What it cannot do: choose. Hard constraints that true postures keep leave tens to hundreds of leaves.

use std::sync::LazyLock;

use glam::DVec3;
use thiserror::Error;

use super::collision::Collisions;
use super::constraint::{CONSTRAINT_COUNT, Constraint, ConstraintKind, JointSet, Violation};
use super::lift::{JointRays, RootKind, roots};
use super::limits::Limits;
use super::placed::{Bearings, HeadingSource, Placed, PlacedFigure, Trunk};
use super::rules::{MotionModel, Rule};
use super::skeleton::{JOINT_COUNT, Joint, LengthError, PerJoint, SegmentLengths, StickFigure};

/// Uncertainty of a segment's length, with that of the joints' places on the body, metres: medians over walks
/// of motion capture leave 3-8 mm.
pub const DEFAULT_LENGTH_SD_M: f64 = 0.005;

/// Why a tree cannot be grown.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TreeError {
    /// The neck is not a point before the camera.
    #[error("the neck must be a point before the camera (z > 0, finite), got {neck}")]
    Neck {
        /// The point.
        neck: DVec3,
    },
    /// A ray is not a unit vector.
    #[error("the ray of {} must have length 1 (NaN where it is not seen), got {ray}", joint.name())]
    Ray {
        /// Its joint.
        joint: Joint,
        /// The vector.
        ray: DVec3,
    },
    /// A quantity that must not be negative is, or is not finite.
    #[error("{name} must be finite and not negative, got {value}")]
    Quantity {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A direction of the bearings is no direction.
    #[error("{name} must be a finite direction, got {value}")]
    Direction {
        /// Its name.
        name: &'static str,
        /// The vector.
        value: DVec3,
    },
    /// The segment lengths are not usable.
    #[error(transparent)]
    Length(#[from] LengthError),
}

/// One view of one person, with what is known of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rays of the joints.
    pub rays: JointRays,
    /// The neck, camera axes, metres. The ray of the neck is not used.
    pub neck: DVec3,
    /// Standard deviation of the neck's distance, metres. It moves the whole figure and cuts nothing.
    pub neck_sd_m: f64,
    /// Lengths of the segments.
    pub lengths: SegmentLengths,
    /// Standard deviation of each length, metres.
    pub length_sd_m: f64,
    /// Roots nearer to each other are taken for one, their middle, metres. 0: only equal ones; the paper's
    /// counts are met at 0.04.
    pub merge_m: f64,
}

/// What cuts.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeOptions {
    /// Limits of angles and rigid distances.
    pub limits: Option<Limits>,
    /// Collisions of parts of the body.
    pub collisions: Option<Collisions>,
    /// Rules of a motion.
    pub motion: Option<MotionModel>,
    /// Vertical, moving direction and head, camera axes.
    pub bearings: Bearings,
    /// Whether to return every cut branch with its reason.
    pub keep_cuts: bool,
}

impl TreeOptions {
    /// Physical constraints at limits that real people keep; no motion model.
    pub fn physical() -> Self {
        Self {
            limits: Some(Limits::measured()),
            collisions: Some(Collisions::measured()),
            motion: None,
            bearings: Bearings::default(),
            keep_cuts: false,
        }
    }

    /// Physical constraints as the paper prints them.
    pub fn physical_paper() -> Self {
        Self { limits: Some(Limits::paper()), collisions: Some(Collisions::paper()), ..Self::physical() }
    }

    /// With the rules of a motion.
    pub fn with_motion(self, motion: MotionModel) -> Self {
        Self { motion: Some(motion), ..self }
    }

    /// With bearings in camera axes.
    pub fn with_bearings(self, bearings: Bearings) -> Self {
        Self { bearings, ..self }
    }

    /// The same limits with no room for noise.
    pub fn without_noise(&self) -> Self {
        let mut options = self.clone();
        options.limits.iter_mut().for_each(|limits| limits.noise_factor = 0.0);
        options.collisions.iter_mut().for_each(|collisions| collisions.noise_factor = 0.0);
        options.motion.iter_mut().for_each(|motion| motion.noise_factor = 0.0);
        options
    }

    /// Whether a constraint is asked for.
    pub fn asks(&self, constraint: Constraint) -> bool {
        use Constraint::{NeckBending, NeckExtension, NeckFlexion, NeckRotation};
        match constraint.kind() {
            ConstraintKind::Distance => self.limits.is_some(),
            ConstraintKind::Angle => {
                let neck = [NeckFlexion, NeckExtension, NeckRotation, NeckBending].contains(&constraint);
                self.limits.is_some() && (!neck || self.bearings.head.is_some())
            }
            ConstraintKind::Collision => self.collisions.is_some(),
            ConstraintKind::Rule => {
                let rule = Rule::of(constraint);
                self.motion.as_ref().zip(rule).is_some_and(|(motion, rule)| motion.tolerance(rule).is_some())
            }
        }
    }

    fn check(
        &self,
        constraint: Constraint,
        figure: &PlacedFigure,
        trunk: &Trunk,
        lengths: &SegmentLengths,
    ) -> Option<Violation> {
        match constraint.kind() {
            ConstraintKind::Collision => self.collisions.as_ref()?.check(constraint, figure),
            ConstraintKind::Rule => self.motion.as_ref()?.check(constraint, figure, trunk),
            ConstraintKind::Angle | ConstraintKind::Distance => {
                let head = self.bearings.head.as_ref();
                self.limits.as_ref()?.check(constraint, figure, trunk, lengths, head)
            }
        }
    }
}

impl Default for TreeOptions {
    fn default() -> Self {
        Self::physical()
    }
}

/// A way down the tree: for each joint near or far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Path(
    /// Bit n is set where the joint of level n is at the far root.
    pub u16,
);

impl Path {
    /// Whether a joint is at the far root; false where it has but one.
    pub fn is_far(self, joint: Joint) -> bool {
        self.0 >> joint as u16 & 1 == 1
    }

    /// The same with a joint at the far root.
    pub fn with_far(self, joint: Joint) -> Self {
        Self(self.0 | 1 << joint as u16)
    }
}

/// A posture that the tree leads to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpretation {
    /// The joints, camera axes, metres; NaN where unknown.
    pub figure: StickFigure,
    /// Its way down the tree.
    pub path: Path,
    /// How many roots each segment had; None for the neck and unknown joints. A segment without a real root
    /// has its gap here.
    pub kinds: PerJoint<Option<RootKind>>,
    /// Standard deviation of the extent of each segment along its ray, metres; NaN for the neck.
    pub segment_sd_m: PerJoint<f64>,
    /// Standard deviation of each joint's distance from the camera, metres: those of the neck and of the
    /// segments down to it.
    pub depth_sd_m: PerJoint<f64>,
}

impl Interpretation {
    /// Segments without a real root and by how much their joint's ray passes too far, metres.
    pub fn gaps_m(&self) -> impl Iterator<Item = (Joint, f64)> + '_ {
        Joint::ALL.into_iter().filter_map(|joint| match self.kinds[joint] {
            Some(RootKind::None { gap_m }) => Some((joint, gap_m)),
            _ => None,
        })
    }
}

/// Nodes of one level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LevelCount {
    /// Nodes the walk came to and no constraint cut.
    pub reached: u32,
    /// Those of them from which a leaf survives: the paper's way of counting (Tables 3 and 4).
    pub survived: u32,
    /// Nodes the walk came to, cut or not, whose segment has one root: equal, or merged into their middle.
    pub degenerate: u32,
    /// Nodes the walk came to, cut or not, whose segment has no real root.
    pub without_root: u32,
}

/// How many branches a constraint cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CutCount {
    /// The constraint.
    pub constraint: Constraint,
    /// The level at which it cuts.
    pub joint: Joint,
    /// Branches cut.
    pub branches: u32,
}

/// A branch that was cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// The way down to the level of the violation.
    pub path: Path,
    /// Why.
    pub violation: Violation,
}

/// The posture that breaks the constraints least, where all break some.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastViolating {
    /// The posture.
    pub interpretation: Interpretation,
    /// What it breaks.
    pub violations: Vec<Violation>,
    /// Sum of the squares of their severities ([`Violation::severity`]); no posture has less.
    pub total: f64,
}

/// What is left of the tree, and what was cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpretations {
    /// The view they are of.
    pub view: View,
    /// Ways to the leaves that survived, in the order of the walk.
    pub survivors: Vec<Path>,
    /// Nodes of each level.
    pub counts: PerJoint<LevelCount>,
    /// Branches cut by each constraint that cut any, in the order of [`Constraint::ALL`].
    pub reasons: Vec<CutCount>,
    /// Constraints that were asked for and could not be tried, because joints are unknown.
    pub open: Vec<Constraint>,
    /// Where rules took the moving direction from.
    pub heading_source: HeadingSource,
    /// Every cut branch in the order of the walk, if asked for.
    pub cuts: Vec<Cut>,
    /// Where nothing survived: the posture nearest to surviving.
    pub least_violating: Option<LeastViolating>,
}

impl Interpretations {
    /// The surviving postures.
    pub fn interpretations(&self) -> impl ExactSizeIterator<Item = Interpretation> + '_ {
        self.survivors.iter().map(|&path| self.view.interpretation(path))
    }

    /// The figures of the surviving postures.
    pub fn figures(&self) -> Vec<StickFigure> {
        self.survivors.iter().map(|&path| self.view.place(path).points()).collect()
    }
}

impl View {
    /// A view with a neck of known place and lengths of the usual uncertainty; only equal roots are merged.
    pub fn new(rays: JointRays, neck: DVec3, lengths: SegmentLengths) -> Self {
        Self { rays, neck, neck_sd_m: 0.0, lengths, length_sd_m: DEFAULT_LENGTH_SD_M, merge_m: 0.0 }
    }

    /// Grows and prunes the tree.
    ///
    /// That nothing survives is no error: `reasons` say why and `least_violating` is the nearest posture.
    pub fn interpret(&self, options: &TreeOptions) -> Result<Interpretations, TreeError> {
        self.check(options)?;
        let mut walk = Walk::new(self, options);
        walk.descend(1, Path::default());
        Ok(walk.finish())
    }

    /// The posture at the end of a path.
    pub fn interpretation(&self, path: Path) -> Interpretation {
        let placed = self.place(path);
        let mut kinds = PerJoint([None; JOINT_COUNT]);
        let mut depth_sd_m = PerJoint([self.neck_sd_m; JOINT_COUNT]);
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = joint.start().unwrap_or(Joint::Neck);
            kinds[joint] = placed[joint].point.is_finite().then_some(placed[joint].kind);
            depth_sd_m[joint] = depth_sd_m[start].hypot(placed[joint].sd_m);
        }
        let segment_sd_m = PerJoint(placed.0.map(|joint| joint.sd_m));
        Interpretation { figure: placed.points(), path, kinds, segment_sd_m, depth_sd_m }
    }

    /// The path to the posture nearest to a figure: at every segment the root whose segment vector is nearer
    /// to the figure's (near where the figure's is unknown).
    pub fn nearest_path(&self, figure: &StickFigure) -> Path {
        let mut path = Path::default();
        let mut placed = self.root();
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = placed[joint.start().unwrap_or(Joint::Neck)].point;
            let (candidates, count) = self.candidates(&placed, joint);
            let distance = |c: &Placed| (c.point - start).distance(figure.segment(joint));
            let far = count == 2 && distance(&candidates[1]) < distance(&candidates[0]);
            if far {
                path = path.with_far(joint);
            }
            placed[joint] = candidates[usize::from(far)];
        }
        path
    }

    /// All constraints that the posture at the end of a path breaks.
    pub fn violations(&self, path: Path, options: &TreeOptions) -> Vec<Violation> {
        all_violations(&self.place(path), &self.lengths, options)
    }

    /// Sum of the squared severities of what a posture breaks when no room is given to noise; 0 for one that
    /// uses none of that room.
    pub fn soft_excess(&self, path: Path, options: &TreeOptions) -> f64 {
        let violations = self.violations(path, &options.without_noise());
        violations.iter().map(|violation| violation.severity().powi(2)).sum()
    }

    fn check(&self, options: &TreeOptions) -> Result<(), TreeError> {
        if !(self.neck.is_finite() && self.neck.z > 0.0) {
            return Err(TreeError::Neck { neck: self.neck });
        }
        for joint in Joint::ALL {
            let ray = self.rays.ray[joint];
            if self.rays.sees(joint) && !(1.0 - 1e-6..1.0 + 1e-6).contains(&ray.length()) {
                return Err(TreeError::Ray { joint, ray });
            }
        }
        let quantities = [
            ("noise_rad", self.rays.noise_rad),
            ("neck_sd_m", self.neck_sd_m),
            ("length_sd_m", self.length_sd_m),
            ("merge_m", self.merge_m),
        ];
        for (name, value) in quantities {
            if !(value.is_finite() && value >= 0.0) {
                return Err(TreeError::Quantity { name, value });
            }
        }
        let bearings = &options.bearings;
        let head = bearings.head.map(|head| head.x_axis);
        for (name, direction) in [("up", bearings.up), ("heading", bearings.heading), ("head", head)] {
            if let Some(value) = direction.filter(|d| d.try_normalize().is_none()) {
                return Err(TreeError::Direction { name, value });
            }
        }
        self.lengths.validated()?;
        Ok(())
    }

    fn root(&self) -> PlacedFigure {
        let mut placed = PlacedFigure::UNKNOWN_PLACES;
        let ray = self.neck.normalize();
        placed[Joint::Neck] = Placed { point: self.neck, ray, ..Placed::UNKNOWN };
        placed
    }

    /// The places of a joint whose starting joint is placed: two, or one (which may be unknown).
    fn candidates(&self, placed: &PlacedFigure, joint: Joint) -> ([Placed; 2], usize) {
        let start = placed[joint.start().unwrap_or(Joint::Neck)].point;
        self.candidates_from(start, joint)
    }

    /// The length's uncertainty enters d of eq. (7) as an image noise of length_sd / (√2 distance) would.
    fn candidates_from(&self, start: DVec3, joint: Joint) -> ([Placed; 2], usize) {
        let ray = self.rays.ray[joint];
        if start.is_nan() || ray.is_nan() {
            return ([Placed::UNKNOWN; 2], 1);
        }
        let noise_rad = self.rays.noise_rad;
        let length_noise_sq = 0.5 * self.length_sd_m * self.length_sd_m / start.length_squared();
        let noise = (noise_rad * noise_rad + length_noise_sq).sqrt();
        let found = roots(start, ray, self.lengths.to[joint], noise, self.merge_m);
        let (points, count) = found.candidates();
        (points.map(|point| Placed::at_root(start, point, ray, &found, noise_rad)), count)
    }

    fn place(&self, path: Path) -> PlacedFigure {
        let mut placed = self.root();
        for joint in Joint::ALL.into_iter().skip(1) {
            let (candidates, count) = self.candidates(&placed, joint);
            placed[joint] = candidates[usize::from(count == 2 && path.is_far(joint))];
        }
        placed
    }
}

/// All constraints that a figure in space breaks, without noise; those that need unknown joints are left out.
///
/// The figure may be in any axes that the bearings of the options are in too.
pub fn explain(figure: &StickFigure, lengths: &SegmentLengths, options: &TreeOptions) -> Vec<Violation> {
    all_violations(&PlacedFigure::of_points(figure), lengths, options)
}

fn all_violations(figure: &PlacedFigure, lengths: &SegmentLengths, options: &TreeOptions) -> Vec<Violation> {
    let known = figure.known();
    let trunk = Trunk::of(figure, &options.bearings);
    Constraint::ALL
        .into_iter()
        .filter(|&constraint| options.asks(constraint) && known.contains(constraint.joints()))
        .filter_map(|constraint| options.check(constraint, figure, &trunk, lengths))
        .collect()
}

/// First level of the limbs: elbows, wrists, knees, ankles, whose constraints depend on few of the levels.
const FIRST_LIMB: usize = Joint::RightElbow as usize;

/// Constraints of one level that look at the same joints of limbs, at most four: one verdict for each of the
/// 16 choices of roots.
#[derive(Debug, Clone, Copy, Default)]
struct Group {
    /// First and last + 1 of its constraints in [`Walk::asked`].
    range: [u8; 2],
    /// Its joints, as levels, `count` of them.
    joints: [u8; 4],
    count: u8,
}

impl Group {
    /// Which of the 16 choices a path makes.
    fn key(&self, path: Path) -> usize {
        let bit = |i: usize| usize::from(path.0 >> self.joints[i] & 1) << i;
        (0..usize::from(self.count)).map(bit).sum()
    }
}

/// Level and joints of each constraint; those of limbs alone decide which verdicts are shared.
static NEEDS: LazyLock<[(Joint, JointSet); CONSTRAINT_COUNT]> =
    LazyLock::new(|| Constraint::ALL.map(|constraint| (constraint.level(), constraint.joints())));

fn limb_joints(joints: JointSet) -> JointSet {
    JointSet(joints.0 >> FIRST_LIMB << FIRST_LIMB)
}

/// Which of the four limbs a set of their joints belongs to, one bit each.
fn limbs_of(joints: JointSet) -> u8 {
    let limb = |middle: Joint, end: Joint| u8::from(joints.0 & (1 << middle as u16 | 1 << end as u16) != 0);
    limb(Joint::RightElbow, Joint::RightWrist)
        | limb(Joint::LeftElbow, Joint::LeftWrist) << 1
        | limb(Joint::RightKnee, Joint::RightAnkle) << 2
        | limb(Joint::LeftKnee, Joint::LeftAnkle) << 3
}

/// The candidates of one limb on its shoulder or hip.
#[derive(Debug, Clone, Copy)]
struct Limb {
    middle: ([Placed; 2], usize),
    end: [([Placed; 2], usize); 2],
}

const NO_LIMB: Limb = Limb { middle: ([Placed::UNKNOWN; 2], 1), end: [([Placed::UNKNOWN; 2], 1); 2] };

/// Verdicts of a group: not asked yet, held, or the place in [`Constraint::ALL`] of the one broken, from 2 on.
const UNASKED: u8 = 0;
const HOLDS: u8 = 1;
const BROKEN: u8 = 2;

const MAX_GROUPS: usize = 4;

/// The walk down the tree.
struct Walk<'a> {
    view: &'a View,
    options: &'a TreeOptions,
    /// Constraints asked for that can be tried, as places in [`Constraint::ALL`], sorted by level.
    asked: Vec<u8>,
    /// Of a level, those before the limbs.
    trunk_ranges: [[u8; 2]; FIRST_LIMB],
    /// Of a level of limbs.
    groups: [[Group; MAX_GROUPS]; JOINT_COUNT],
    group_counts: [u8; JOINT_COUNT],
    open: Vec<Constraint>,
    verdicts: [[[u8; 16]; MAX_GROUPS]; JOINT_COUNT],
    limbs: [Limb; 4],
    placed: PlacedFigure,
    trunk: Trunk,
    survivors: Vec<Path>,
    counts: PerJoint<LevelCount>,
    cut: [u32; CONSTRAINT_COUNT],
    cuts: Vec<Cut>,
}

/// The limb that hangs on a joint, as place in [`Walk::limbs`].
fn limb_on(joint: Joint) -> Option<usize> {
    match joint {
        Joint::RightShoulder => Some(0),
        Joint::LeftShoulder => Some(1),
        Joint::RightHip => Some(2),
        Joint::LeftHip => Some(3),
        _ => None,
    }
}

/// Limb, middle joint and whether it is the end, of the joint of a limb.
fn on_limb(joint: Joint) -> (usize, Joint, bool) {
    match joint {
        Joint::LeftElbow => (1, joint, false),
        Joint::RightWrist => (0, Joint::RightElbow, true),
        Joint::LeftWrist => (1, Joint::LeftElbow, true),
        Joint::RightKnee => (2, joint, false),
        Joint::LeftKnee => (3, joint, false),
        Joint::RightAnkle => (2, Joint::RightKnee, true),
        Joint::LeftAnkle => (3, Joint::LeftKnee, true),
        _ => (0, Joint::RightElbow, false),
    }
}

impl<'a> Walk<'a> {
    fn new(view: &'a View, options: &'a TreeOptions) -> Self {
        let mut walk = Self {
            view,
            options,
            asked: Vec::with_capacity(CONSTRAINT_COUNT),
            trunk_ranges: [[0; 2]; FIRST_LIMB],
            groups: [[Group::default(); MAX_GROUPS]; JOINT_COUNT],
            group_counts: [0; JOINT_COUNT],
            open: Vec::new(),
            verdicts: [[[UNASKED; 16]; MAX_GROUPS]; JOINT_COUNT],
            limbs: [NO_LIMB; 4],
            placed: view.root(),
            trunk: Trunk::UNKNOWN,
            survivors: Vec::with_capacity(256),
            counts: PerJoint::default(),
            cut: [0; CONSTRAINT_COUNT],
            cuts: Vec::new(),
        };
        walk.counts[Joint::Neck].reached = 1;
        walk.sort_constraints();
        walk
    }

    /// Sorts what is asked for by level and by the limbs it looks at.
    fn sort_constraints(&mut self) {
        let known = self.known();
        let asked: Vec<usize> =
            (0..CONSTRAINT_COUNT).filter(|&i| self.options.asks(Constraint::ALL[i])).collect();
        self.open =
            asked.iter().filter(|&&i| !known.contains(NEEDS[i].1)).map(|&i| Constraint::ALL[i]).collect();
        for level in 1..JOINT_COUNT {
            let start = self.asked.len() as u8;
            let mut limbs = JointSet(0);
            for &i in asked.iter().filter(|&&i| NEEDS[i].0 as usize == level && known.contains(NEEDS[i].1)) {
                self.add(level, i, &mut limbs);
            }
            if level < FIRST_LIMB {
                self.trunk_ranges[level] = [start, self.asked.len() as u8];
            }
        }
    }

    /// Adds a constraint to the last group of its level, or to a new one where it looks at other limbs.
    fn add(&mut self, level: usize, constraint: usize, group_limbs: &mut JointSet) {
        let at = self.asked.len() as u8;
        self.asked.push(constraint as u8);
        if level < FIRST_LIMB {
            return;
        }
        let limbs = limb_joints(NEEDS[constraint].1);
        let count = &mut self.group_counts[level];
        if *count > 0 && limbs_of(*group_limbs) == limbs_of(limbs) {
            *group_limbs = group_limbs.with(limbs);
        } else {
            *count += 1;
            *group_limbs = limbs;
            self.groups[level][usize::from(*count) - 1].range[0] = at;
        }
        let group = &mut self.groups[level][usize::from(*count) - 1];
        group.range[1] = at + 1;
        group.count = 0;
        for joint in (0..JOINT_COUNT as u8).filter(|joint| group_limbs.0 >> joint & 1 == 1) {
            group.joints[usize::from(group.count)] = joint;
            group.count += 1;
        }
    }

    /// Joints that are seen and hang on known ones.
    fn known(&self) -> JointSet {
        let mut known = JointSet::of(&[Joint::Neck]);
        for joint in Joint::ALL.into_iter().skip(1) {
            let start = JointSet::of(&[joint.start().unwrap_or(Joint::Neck)]);
            if self.view.rays.sees(joint) && known.contains(start) {
                known = known.with(JointSet::of(&[joint]));
            }
        }
        known
    }

    /// Walks the branches below a node; the number of leaves that survive.
    fn descend(&mut self, level: usize, path: Path) -> u32 {
        if level == JOINT_COUNT {
            self.survivors.push(path);
            return 1;
        }
        let joint = Joint::ALL[level];
        let (candidates, count) = self.successors(joint, path);
        let mut leaves = 0;
        for (i, candidate) in candidates.iter().take(count).enumerate() {
            let path = if i == 1 { path.with_far(joint) } else { path };
            self.step(joint, candidate);
            if let Some(broken) = self.first_broken(level, path) {
                self.cut[broken] += 1;
                self.keep_cut(broken, path);
                continue;
            }
            self.counts[joint].reached += 1;
            let below = self.descend(level + 1, path);
            self.counts[joint].survived += u32::from(below > 0);
            leaves += below;
        }
        leaves
    }

    fn successors(&self, joint: Joint, path: Path) -> ([Placed; 2], usize) {
        if (joint as usize) < FIRST_LIMB {
            return self.view.candidates(&self.placed, joint);
        }
        let (limb, middle, is_end) = on_limb(joint);
        let limb = &self.limbs[limb];
        if is_end { limb.end[usize::from(path.is_far(middle))] } else { limb.middle }
    }

    /// Places a joint, and what depends on it alone.
    fn step(&mut self, joint: Joint, candidate: &Placed) {
        self.placed[joint] = *candidate;
        if candidate.point.is_finite() {
            match candidate.kind {
                RootKind::Two => {}
                RootKind::Degenerate => self.counts[joint].degenerate += 1,
                RootKind::None { .. } => self.counts[joint].without_root += 1,
            }
        }
        if let Some(limb) = limb_on(joint) {
            self.limbs[limb] = self.limb(joint);
        }
        if joint == Joint::Pelvis {
            self.trunk = Trunk::of_torso(&self.placed, &self.options.bearings);
        }
        if joint == Joint::LeftHip {
            self.trunk = self.trunk.with_hips(&self.placed);
            self.verdicts = [[[UNASKED; 16]; MAX_GROUPS]; JOINT_COUNT];
        }
    }

    fn limb(&self, root: Joint) -> Limb {
        let (middle, end) = match root {
            Joint::RightShoulder => (Joint::RightElbow, Joint::RightWrist),
            Joint::LeftShoulder => (Joint::LeftElbow, Joint::LeftWrist),
            Joint::RightHip => (Joint::RightKnee, Joint::RightAnkle),
            _ => (Joint::LeftKnee, Joint::LeftAnkle),
        };
        let middle = self.view.candidates_from(self.placed[root].point, middle);
        let end = middle.0.map(|placed| self.view.candidates_from(placed.point, end));
        Limb { middle, end }
    }

    /// The first constraint that the node just placed breaks, as place in [`Constraint::ALL`].
    fn first_broken(&mut self, level: usize, path: Path) -> Option<usize> {
        if level < FIRST_LIMB {
            return self.ask(self.trunk_ranges[level]);
        }
        for g in 0..usize::from(self.group_counts[level]) {
            let group = self.groups[level][g];
            let key = group.key(path);
            let mut verdict = self.verdicts[level][g][key];
            if verdict == UNASKED {
                verdict = self.ask(group.range).map_or(HOLDS, |broken| broken as u8 + BROKEN);
                self.verdicts[level][g][key] = verdict;
            }
            if verdict >= BROKEN {
                return Some(usize::from(verdict - BROKEN));
            }
        }
        None
    }

    fn ask(&self, [from, to]: [u8; 2]) -> Option<usize> {
        let asked = &self.asked[usize::from(from)..usize::from(to)];
        asked.iter().map(|&i| usize::from(i)).find(|&i| self.violation(i).is_some())
    }

    fn violation(&self, constraint: usize) -> Option<Violation> {
        self.options.check(Constraint::ALL[constraint], &self.placed, &self.trunk, &self.view.lengths)
    }

    fn keep_cut(&mut self, broken: usize, path: Path) {
        if self.options.keep_cuts {
            self.cuts.extend(self.violation(broken).map(|violation| Cut { path, violation }));
        }
    }

    fn finish(mut self) -> Interpretations {
        let survives = !self.survivors.is_empty();
        self.counts[Joint::Neck].survived = u32::from(survives);
        let reasons = (0..CONSTRAINT_COUNT)
            .filter(|&i| self.cut[i] > 0)
            .map(|i| CutCount { constraint: Constraint::ALL[i], joint: NEEDS[i].0, branches: self.cut[i] })
            .collect();
        let least_violating = (!survives).then(|| self.least_violating());
        Interpretations {
            view: *self.view,
            survivors: self.survivors,
            counts: self.counts,
            reasons,
            open: self.open,
            heading_source: self.options.bearings.heading_source(),
            cuts: self.cuts,
            least_violating,
        }
    }

    /// Branch and bound for the leaf of the least sum of squared severities.
    fn least_violating(&mut self) -> LeastViolating {
        let mut costs = Box::new([[[f64::NAN; 16]; MAX_GROUPS]; JOINT_COUNT]);
        let mut best = (f64::INFINITY, Path::default());
        self.bound(1, Path::default(), 0.0, &mut costs, &mut best);
        let (total, path) = best;
        let violations = self.view.violations(path, self.options);
        LeastViolating { interpretation: self.view.interpretation(path), violations, total }
    }

    fn bound(
        &mut self,
        level: usize,
        path: Path,
        cost: f64,
        costs: &mut [[[f64; 16]; MAX_GROUPS]; JOINT_COUNT],
        best: &mut (f64, Path),
    ) {
        if level == JOINT_COUNT {
            *best = (cost, path);
            return;
        }
        let joint = Joint::ALL[level];
        let counts = self.counts;
        let (candidates, count) = self.successors(joint, path);
        for (i, candidate) in candidates.iter().take(count).enumerate() {
            let path = if i == 1 { path.with_far(joint) } else { path };
            self.step(joint, candidate);
            if joint == Joint::LeftHip {
                *costs = [[[f64::NAN; 16]; MAX_GROUPS]; JOINT_COUNT];
            }
            let cost = cost + self.cost(level, path, costs);
            if cost < best.0 {
                self.bound(level + 1, path, cost, costs, best);
            }
        }
        self.counts = counts;
    }

    fn cost(&self, level: usize, path: Path, costs: &mut [[[f64; 16]; MAX_GROUPS]; JOINT_COUNT]) -> f64 {
        let of = |[from, to]: [u8; 2]| -> f64 {
            let asked = &self.asked[usize::from(from)..usize::from(to)];
            let violations = asked.iter().filter_map(|&i| self.violation(usize::from(i)));
            violations.map(|violation| violation.severity().powi(2)).sum()
        };
        if level < FIRST_LIMB {
            return of(self.trunk_ranges[level]);
        }
        let mut total = 0.0;
        let count = usize::from(self.group_counts[level]);
        for (group, costs) in self.groups[level].iter().zip(&mut costs[level]).take(count) {
            let known = &mut costs[group.key(path)];
            if known.is_nan() {
                *known = of(group.range);
            }
            total += *known;
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::lift::JointRays;
    use crate::synth::Random;
    use std::collections::{BTreeMap, BTreeSet};

    /// Someone upright in camera axes, 4 m away, every segment turned at random by up to `spread_rad`.
    fn figure(
        lengths: &SegmentLengths,
        facing_rad: f64,
        spread_rad: f64,
        random: &mut Random,
    ) -> StickFigure {
        let turn = glam::DQuat::from_rotation_y(facing_rad);
        let rest = |joint: Joint| match joint {
            Joint::RightShoulder => DVec3::new(-1.0, 0.0, 0.1),
            Joint::LeftShoulder => DVec3::new(1.0, 0.0, 0.1),
            Joint::RightHip => DVec3::new(-0.85, 0.5, 0.0),
            Joint::LeftHip => DVec3::new(0.85, 0.5, 0.0),
            _ => DVec3::Y,
        };
        let mut figure = StickFigure::UNKNOWN;
        figure[Joint::Neck] = DVec3::new(random.uniform(-0.3, 0.3), -0.3, 4.0);
        for joint in Joint::ALL.into_iter().skip(1) {
            let spread = if joint < Joint::RightElbow { 0.2 * spread_rad } else { spread_rad };
            let mut angle = || random.uniform(-spread, spread);
            let bend = glam::DQuat::from_euler(glam::EulerRot::XYZ, angle(), angle(), angle());
            let direction = turn * bend * rest(joint).normalize();
            figure[joint] = figure[joint.start().unwrap()] + lengths.to[joint] * direction;
        }
        figure
    }

    fn view_of(seed: u64, noise_rad: f64) -> View {
        let lengths = SegmentLengths::lee_chen();
        let mut random = Random::new(seed);
        let facing_rad = random.uniform(-3.0, 3.0);
        let spread_rad = random.uniform(0.05, 0.5);
        let figure = figure(&lengths, facing_rad, spread_rad, &mut random);
        let mut rays = JointRays::from_points(&figure);
        for ray in &mut rays.ray.0 {
            let [a, b] = random.normal_pair().map(f64::from);
            *ray = (*ray + noise_rad * DVec3::new(a, b, 0.0)).normalize();
        }
        rays.noise_rad = noise_rad;
        View::new(rays, figure[Joint::Neck], lengths)
    }

    fn every_rule() -> MotionModel {
        Rule::ALL.into_iter().fold(MotionModel::walking(), |model, rule| {
            let tolerance = model.tolerance(rule).unwrap_or(super::super::rules::Tolerance::from_deg(35.0));
            model.with(rule, tolerance)
        })
    }

    /// What the walk must give, by looking at every one of the 2^13 leaves alone and asking every constraint
    /// on the way down to it anew.
    #[derive(Default)]
    struct Plain {
        survivors: BTreeSet<Path>,
        reached: [BTreeSet<Path>; JOINT_COUNT],
        survived: [BTreeSet<Path>; JOINT_COUNT],
        cuts: BTreeMap<(usize, Path), String>,
    }

    fn plain(view: &View, options: &TreeOptions) -> Plain {
        let mut plain = Plain::default();
        'leaf: for bits in 0..1u16 << 13 {
            let leaf = Path(bits << 1);
            let mut placed = view.root();
            let mut way = Vec::new();
            for joint in Joint::ALL.into_iter().skip(1) {
                let (candidates, count) = view.candidates(&placed, joint);
                if count == 1 && leaf.is_far(joint) {
                    continue 'leaf;
                }
                placed[joint] = candidates[usize::from(leaf.is_far(joint))];
                let path = Path(leaf.0 & ((1u32 << (joint as u32 + 1)) - 1) as u16);
                let known = placed.known();
                let trunk = Trunk::of(&placed, &options.bearings);
                let broken = Constraint::ALL.into_iter().find(|&constraint| {
                    constraint.level() == joint
                        && options.asks(constraint)
                        && known.contains(constraint.joints())
                        && options.check(constraint, &placed, &trunk, &view.lengths).is_some()
                });
                if let Some(constraint) = broken {
                    plain.cuts.insert((joint as usize, path), constraint.name());
                    continue 'leaf;
                }
                plain.reached[joint as usize].insert(path);
                way.push((joint as usize, path));
            }
            plain.survivors.insert(leaf);
            for (level, path) in way {
                plain.survived[level].insert(path);
            }
        }
        plain
    }

    fn assert_same(view: &View, options: &TreeOptions) -> usize {
        let found = view.interpret(options).unwrap();
        let plain = plain(view, options);
        let survivors: BTreeSet<Path> = found.survivors.iter().copied().collect();
        assert_eq!(survivors, plain.survivors);
        assert_eq!(survivors.len(), found.survivors.len());
        for joint in Joint::ALL.into_iter().skip(1) {
            let level = joint as usize;
            assert_eq!(found.counts[joint].reached as usize, plain.reached[level].len(), "{joint:?}");
            assert_eq!(found.counts[joint].survived as usize, plain.survived[level].len(), "{joint:?}");
        }
        let mut reasons = BTreeMap::<String, u32>::new();
        plain.cuts.values().for_each(|name| *reasons.entry(name.clone()).or_default() += 1);
        let found_reasons = found.reasons.iter().map(|r| (r.constraint.name(), r.branches)).collect();
        assert_eq!(reasons, found_reasons);
        let cuts: BTreeMap<(usize, Path), String> = found
            .cuts
            .iter()
            .map(|cut| ((cut.violation.joint as usize, cut.path), cut.violation.constraint.name()))
            .collect();
        assert_eq!(cuts, plain.cuts);
        found.survivors.len()
    }

    #[test]
    fn the_walk_is_the_plain_tree() {
        let bearings = Bearings {
            up: Some(DVec3::new(0.02, -1.0, 0.05).normalize()),
            heading: None,
            head: Some(glam::DMat3::from_rotation_y(0.4)),
        };
        let mut survivors = Vec::new();
        for seed in 0..14 {
            let mut view = view_of(seed, [0.0, 1e-3, 3e-3][seed as usize % 3]);
            view.merge_m = [0.0, 0.04][seed as usize % 2];
            let mut options = match seed % 4 {
                0 => TreeOptions::physical(),
                1 => TreeOptions::physical_paper().with_motion(MotionModel::walking_general_paper()),
                2 => TreeOptions::physical().with_motion(every_rule()),
                _ => TreeOptions { limits: None, ..TreeOptions::physical().with_motion(every_rule()) },
            };
            options.keep_cuts = true;
            if seed % 3 == 1 {
                options.bearings = bearings;
            }
            if seed % 5 == 4 {
                view.rays.ray[Joint::LeftElbow] = DVec3::NAN;
            }
            if seed == 13 {
                view.rays.ray[Joint::RightHip] = DVec3::NAN;
            }
            survivors.push(assert_same(&view, &options));
        }
        assert!(survivors.iter().filter(|&&n| n > 0).count() >= 6, "{survivors:?}");
    }

    #[test]
    fn without_constraints_every_leaf_survives() {
        let options = TreeOptions { limits: None, collisions: None, ..TreeOptions::physical() };
        // Beyond a wrong root the next segment may have none, so not every view has all 2^13 leaves.
        let full = |view: &View| view.interpret(&options).unwrap().survivors.len() == 8192;
        let view = (0..50).map(|seed| view_of(seed, 0.0)).find(full).unwrap();
        let found = view.interpret(&options).unwrap();
        for joint in Joint::ALL {
            assert_eq!(found.counts[joint].reached, 1 << joint as u32);
            assert_eq!(found.counts[joint].survived, 1 << joint as u32);
        }
        assert!(found.reasons.is_empty() && found.least_violating.is_none());
        for interpretation in found.interpretations().take(100) {
            for joint in Joint::ALL.into_iter().skip(1) {
                let length = interpretation.figure.segment(joint).length();
                assert!((length - view.lengths.to[joint]).abs() < 1e-9);
            }
        }
    }

    /// The least violating posture is that of an exhaustive search, and it breaks what it is said to break.
    #[test]
    fn the_least_violating_posture_has_no_better() {
        let mut tried = 0;
        for seed in 0..40 {
            let view = view_of(seed, 0.0);
            let options = TreeOptions::physical_paper().with_motion(MotionModel::walking_paper());
            let found = view.interpret(&options).unwrap();
            let Some(least) = &found.least_violating else {
                assert!(!found.survivors.is_empty());
                continue;
            };
            tried += 1;
            let total =
                |path| view.violations(path, &options).iter().map(|v| v.severity().powi(2)).sum::<f64>();
            let exhaustive = (0..1u16 << 13).map(|bits| total(Path(bits << 1))).fold(f64::MAX, f64::min);
            assert!((least.total - exhaustive).abs() < 1e-9 * (1.0 + exhaustive));
            assert!((total(least.interpretation.path) - exhaustive).abs() < 1e-9 * (1.0 + exhaustive));
            assert!(!least.violations.is_empty());
            if tried == 3 {
                break;
            }
        }
        assert_eq!(tried, 3);
    }

    #[test]
    fn unseen_joints_are_left_open_with_all_that_hangs_on_them() {
        let mut view = view_of(5, 0.0);
        view.rays.ray[Joint::RightElbow] = DVec3::NAN;
        let found = view.interpret(&TreeOptions::physical()).unwrap();
        assert!(found.open.contains(&Constraint::ElbowExtension(super::super::skeleton::Side::Right)));
        assert!(!found.open.contains(&Constraint::ElbowExtension(super::super::skeleton::Side::Left)));
        let first = found.interpretations().next();
        let interpretation = first.or(found.least_violating.map(|l| l.interpretation));
        let interpretation = interpretation.unwrap();
        assert!(interpretation.figure[Joint::RightWrist].is_nan());
        assert!(interpretation.kinds[Joint::RightWrist].is_none());
        assert!(interpretation.figure[Joint::RightKnee].is_finite());

        view.rays.ray = PerJoint([DVec3::NAN; JOINT_COUNT]);
        let nothing = view.interpret(&TreeOptions::physical()).unwrap();
        assert_eq!(nothing.survivors, [Path::default()]);
        assert!(nothing.reasons.is_empty() && !nothing.open.is_empty());
    }

    #[test]
    fn bad_input_is_refused_with_its_values() {
        let view = view_of(1, 0.0);
        let options = TreeOptions::physical();
        let refused = |change: &dyn Fn(&mut View)| {
            let mut view = view;
            change(&mut view);
            view.interpret(&options).unwrap_err().to_string()
        };
        assert!(refused(&|view| view.neck.z = -1.0).contains("neck"));
        assert!(refused(&|view| view.neck.x = f64::NAN).contains("neck"));
        assert!(refused(&|view| view.rays.ray[Joint::LeftKnee] *= 2.0).contains("left_knee"));
        assert!(refused(&|view| view.rays.noise_rad = f64::NAN).contains("noise_rad"));
        assert!(refused(&|view| view.merge_m = -0.1).contains("merge_m"));
        assert!(refused(&|view| view.lengths.to[Joint::LeftKnee] = 38.0).contains("metres"));
        let options =
            options.clone().with_bearings(Bearings { up: Some(DVec3::ZERO), ..Bearings::default() });
        assert!(view.interpret(&options).unwrap_err().to_string().contains("up"));
    }

    /// Constraints of a level are tried in their order, and no level has more groups than there is room for.
    #[test]
    fn groups_keep_the_order_of_the_constraints() {
        let view = view_of(1, 0.0);
        let head = Some(glam::DMat3::IDENTITY);
        let options = TreeOptions::physical()
            .with_motion(every_rule())
            .with_bearings(Bearings { head, ..Bearings::default() });
        let walk = Walk::new(&view, &options);
        assert_eq!(walk.asked.len(), CONSTRAINT_COUNT);
        for level in FIRST_LIMB..JOINT_COUNT {
            let count = usize::from(walk.group_counts[level]);
            assert!(count <= MAX_GROUPS);
            let groups = &walk.groups[level][..count];
            let order: Vec<u8> = groups
                .iter()
                .flat_map(|g| walk.asked[usize::from(g.range[0])..usize::from(g.range[1])].to_vec())
                .collect();
            let here = |&i: &u8| NEEDS[usize::from(i)].0 as usize == level;
            let expected: Vec<u8> = (0..CONSTRAINT_COUNT as u8).filter(here).collect();
            assert_eq!(order, expected);
        }
    }
}
