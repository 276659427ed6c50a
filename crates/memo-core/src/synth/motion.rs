//! Named points moving in space: the motion behind a point-light display, whether recorded, tracked or
//! synthetic.
//!
//! A NaN coordinate means that the point is unknown at that instant.

use super::scene::stride_length_m;
use crate::keypoints::joint_name;
use crate::model::body::Part;
use crate::model::{PosedBody, Walker};
use crate::wording::counted;
use glam::DVec3;
use thiserror::Error;

/// Names of the points of [`sampled_walk`]: right then left shoulder, elbow, wrist (`RSH`, `REL`, `RWR`,
/// `LSH`, `LEL`, `LWR`); right then left hip, knee, ankle (`RHP`, `RKN`, `RAN`, `LHP`, `LKN`, `LAN`); head
/// (`HEAD`). [`joint_name`](crate::keypoints::joint_name) maps them to full names.
pub const WALKER_NAMES: [&str; 13] =
    ["RSH", "REL", "RWR", "LSH", "LEL", "LWR", "RHP", "RKN", "RAN", "LHP", "LKN", "LAN", "HEAD"];

/// The eight limb segments, by name: upper arms, forearms, thighs, shanks.
pub const WALKER_LIMBS: [[&str; 2]; 8] = [
    ["RSH", "REL"],
    ["REL", "RWR"],
    ["LSH", "LEL"],
    ["LEL", "LWR"],
    ["RHP", "RKN"],
    ["RKN", "RAN"],
    ["LHP", "LKN"],
    ["LKN", "LAN"],
];

/// Why positions over time are not a motion.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// There is no frame or no point.
    #[error("a motion needs frames and points, got {} of {}", counted(*frames, "frame"), counted(*points, "point"))]
    Empty {
        /// Number of frames given.
        frames: usize,
        /// Number of points given.
        points: usize,
    },
    /// The lengths of the arguments disagree.
    #[error("wanted a position for each of {} and {}, got {positions}", counted(*frames, "time"), counted(*points, "name"))]
    Shape {
        /// Number of positions given; frames times points are expected.
        positions: usize,
        /// Number of times given.
        frames: usize,
        /// Number of names given.
        points: usize,
    },
    /// The times do not increase or are not finite.
    #[error("times must be finite and increase: frame {frame} is at {time_s} s after {previous_s} s")]
    Times {
        /// The frame with the invalid time.
        frame: usize,
        /// Its time, seconds.
        time_s: f64,
        /// The previous time, seconds.
        previous_s: f64,
    },
    /// A position is infinite or farther away than 1e6 m (NaN is allowed and means unknown).
    #[error("point {name} at frame {frame} is at ({x}, {y}, {z}): metres wanted, NaN for unknown")]
    Position {
        /// Name of the point.
        name: String,
        /// The frame.
        frame: usize,
        /// Coordinate x, metres.
        x: f64,
        /// Coordinate y, metres.
        y: f64,
        /// Coordinate z, metres.
        z: f64,
    },
    /// A parameter of a synthetic walk is out of range.
    #[error("a walk with a {parameter} of {value} cannot be sampled")]
    Walk {
        /// Its name.
        parameter: &'static str,
        /// Its value.
        value: f64,
    },
}

/// Largest accepted distance of a position from the origin, metres.
const FARTHEST_M: f64 = 1e6;

/// Largest number of sampled frames: over four hours at 60 Hz.
const MOST_FRAMES: usize = 1_000_000;

/// Named points over time in the world, metres, Z up.
#[derive(Debug, Clone, PartialEq)]
pub struct PointMotion {
    /// Positions, frame after frame; within a frame, the points are in the order of the names.
    positions: Vec<DVec3>,
    names: Vec<String>,
    times_s: Vec<f64>,
}

impl PointMotion {
    /// A motion from positions (frames x points, frame after frame; world axes, metres), names and times
    /// (seconds).
    ///
    /// # Errors
    ///
    /// There is no frame or no point, the lengths disagree, the times do not increase, or a position is
    /// farther than 1e6 m from the origin.
    pub fn new(positions: Vec<DVec3>, names: Vec<String>, times_s: Vec<f64>) -> Result<Self, MotionError> {
        let (frames, points) = (times_s.len(), names.len());
        if frames == 0 || points == 0 {
            return Err(MotionError::Empty { frames, points });
        }
        if frames.checked_mul(points) != Some(positions.len()) {
            return Err(MotionError::Shape { positions: positions.len(), frames, points });
        }
        for (frame, &time_s) in times_s.iter().enumerate() {
            let previous_s = if frame == 0 { f64::NEG_INFINITY } else { times_s[frame - 1] };
            if !(time_s.is_finite() && time_s > previous_s) {
                return Err(MotionError::Times { frame, time_s, previous_s });
            }
        }
        let is_absurd = |p: &DVec3| p.to_array().iter().any(|x| x.abs() > FARTHEST_M);
        if let Some(i) = positions.iter().position(is_absurd) {
            let DVec3 { x, y, z } = positions[i];
            return Err(MotionError::Position {
                name: names[i % points].clone(),
                frame: i / points,
                x,
                y,
                z,
            });
        }
        Ok(Self { positions, names, times_s })
    }

    /// Number of frames, at least 1.
    pub fn frames(&self) -> usize {
        self.times_s.len()
    }

    /// Number of points, at least 1.
    pub fn points(&self) -> usize {
        self.names.len()
    }

    /// Names of the points.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Times of the frames, seconds, increasing.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// All positions, frame after frame.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The position of a point at a frame, metres; `None` where it is unknown or does not exist.
    pub fn at(&self, frame: usize, point: usize) -> Option<DVec3> {
        let of_frame = self.positions.chunks_exact(self.points()).nth(frame)?;
        let p = *of_frame.get(point)?;
        (!p.is_nan()).then_some(p)
    }

    /// Index of a name among the points.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Mean time between frames, seconds; 0 for a single frame.
    pub fn frame_interval_s(&self) -> f64 {
        let last = self.times_s.len() - 1;
        if last == 0 { 0.0 } else { (self.times_s[last] - self.times_s[0]) / last as f64 }
    }

    /// Indices of the right and the left hip, by any name that [`joint_name`] knows, if both are among the
    /// points.
    pub fn hips(&self) -> Option<[usize; 2]> {
        Some([index_of_joint(&self.names, "RHP")?, index_of_joint(&self.names, "LHP")?])
    }

    /// Position of the body in each frame: the midpoint of the [hips](Self::hips) if both are among the points,
    /// otherwise the mean of the points known in all frames, otherwise of those known in the frame. Gaps repeat
    /// the previous position.
    pub fn pelvis_path(&self) -> Vec<DVec3> {
        let always = |k: &usize| (0..self.frames()).all(|frame| self.at(frame, *k).is_some());
        let mut anchors = self.hips().map_or_else(|| (0..self.points()).collect(), |hips| hips.to_vec());
        if anchors.iter().any(&always) {
            anchors.retain(|k| always(k));
        }
        let mut place = DVec3::ZERO;
        let mean = |frame: usize| {
            let known: Vec<DVec3> = anchors.iter().filter_map(|&k| self.at(frame, k)).collect();
            (!known.is_empty()).then(|| known.iter().sum::<DVec3>() / known.len() as f64)
        };
        (0..self.frames())
            .map(|frame| {
                place = mean(frame).unwrap_or(place);
                place
            })
            .collect()
    }

    /// The motion with every position replaced by `moved(frame, point, position)`.
    pub(super) fn map(&self, moved: impl Fn(usize, usize, DVec3) -> DVec3) -> Self {
        let points = self.points();
        let positions =
            self.positions.iter().enumerate().map(|(i, &p)| moved(i / points, i % points, p)).collect();
        Self { positions, ..self.clone() }
    }

    /// Other positions of the same points, frame after frame, at other times.
    pub(super) fn replaced(&self, positions: Vec<DVec3>, times_s: Vec<f64>) -> Self {
        Self { positions, names: self.names.clone(), times_s }
    }

    /// The points of all motions as those of one, at the times of the first. All need as many frames.
    pub(super) fn beside(motions: &[Self]) -> Self {
        let frame = |t: usize| {
            motions.iter().flat_map(move |one| &one.positions[t * one.points()..(t + 1) * one.points()])
        };
        let times_s = motions.first().map_or(Vec::new(), |first| first.times_s.clone());
        let positions = (0..times_s.len()).flat_map(frame).copied().collect();
        let names = motions.iter().flat_map(|one| one.names.clone()).collect();
        Self { positions, names, times_s }
    }

    /// The first `frames` frames.
    pub(super) fn truncated(mut self, frames: usize) -> Self {
        self.positions.truncate(frames * self.points());
        self.times_s.truncate(frames);
        self
    }
}

/// The place of a joint among names: of this name, or of another one for the same joint.
fn index_of_joint(names: &[String], wanted: &str) -> Option<usize> {
    let joint = joint_name(wanted).ok();
    let is_it = |name: &String| joint.is_some() && joint_name(name).ok() == joint;
    names.iter().position(|name| name == wanted).or_else(|| names.iter().position(is_it))
}

/// The limb segments whose two ends are among the names, as pairs of indices. Joints may have any name that
/// [`joint_name`] knows.
pub fn limbs_of(names: &[String]) -> Vec<[usize; 2]> {
    let index = |name: &str| index_of_joint(names, name);
    WALKER_LIMBS.iter().filter_map(|[a, b]| Some([index(a)?, index(b)?])).collect()
}

/// Default height of a walker, metres.
pub const WALKER_HEIGHT_M: f64 = 1.75;

/// Options of [`sampled_walk`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledWalkOptions {
    /// Number of frames.
    pub frames: usize,
    /// Frames per second. Default 60, a common display rate.
    pub rate_hz: f64,
    /// Speed, m/s. Default 1.3, a comfortable walk; the duration of the cycle follows from the stride of the
    /// gait.
    pub speed_mps: f64,
    /// Heading, radians about world Z, 0 along world X.
    pub heading_rad: f64,
    /// Gait phase of the first frame, cycles.
    pub phase: f64,
}

impl Default for SampledWalkOptions {
    fn default() -> Self {
        Self { frames: 60, rate_hz: 60.0, speed_mps: 1.3, heading_rad: 0.0, phase: 0.0 }
    }
}

impl SampledWalkOptions {
    /// The same with a whole number of cycles, each of a whole number of frames, at the nearest possible speed.
    ///
    /// # Errors
    ///
    /// No cycle, or a speed, rate or stride that is not positive and finite.
    pub fn of_whole_cycles(self, walker: &Walker, cycles: usize) -> Result<Self, MotionError> {
        let in_cycle = (self.cycle_s(walker) * self.rate_hz).round();
        let frames = in_cycle * cycles as f64;
        let most = MOST_FRAMES as f64;
        for (parameter, value) in [("cycle in frames", in_cycle), ("number of frames", frames)] {
            if !(1.0..=most).contains(&value) {
                return Err(MotionError::Walk { parameter, value });
            }
        }
        let speed_mps = stride_length_m(walker) * self.rate_hz / in_cycle;
        Ok(Self { frames: frames as usize, speed_mps, ..self })
    }

    /// Duration of one gait cycle of this walker, seconds.
    pub fn cycle_s(&self, walker: &Walker) -> f64 {
        stride_length_m(walker) / self.speed_mps
    }
}

/// The body model walking on a straight line through the origin at half time, as 13 points: the joints of
/// both sides and the centre of the head.
///
/// The limbs of the model swing in planes parallel to the walking direction, so the motion is as planar as
/// walking is assumed to be.
///
/// # Errors
///
/// An option out of range, or a walker with a stride that is not positive.
pub fn sampled_walk(walker: &Walker, options: &SampledWalkOptions) -> Result<PointMotion, MotionError> {
    let SampledWalkOptions { frames, rate_hz, speed_mps, heading_rad, phase } = *options;
    let positive = |value: f64| value > 0.0 && value.is_finite();
    let cycle_s = options.cycle_s(walker);
    for (parameter, value, is_possible) in [
        ("number of frames", frames as f64, (1..=MOST_FRAMES).contains(&frames)),
        ("frame rate in Hz", rate_hz, positive(rate_hz)),
        ("speed in m/s", speed_mps, positive(speed_mps)),
        ("heading in radians", heading_rad, heading_rad.is_finite()),
        ("gait phase", phase, phase.is_finite()),
        ("duration of a cycle in seconds", cycle_s, positive(cycle_s)),
    ] {
        if !is_possible {
            return Err(MotionError::Walk { parameter, value });
        }
    }
    let forward = DVec3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
    let level = DVec3::Z * walker.level_torso_height_m();
    let times_s: Vec<f64> = (0..frames).map(|frame| frame as f64 / rate_hz).collect();
    let middle_s = 0.5 * (frames - 1) as f64 / rate_hz;
    let positions = times_s.iter().flat_map(|&time_s| {
        let centre = level + forward * (speed_mps * (time_s - middle_s));
        points_of(&walker.pose(centre, heading_rad, (phase + time_s / cycle_s).rem_euclid(1.0)))
    });
    PointMotion::new(positions.collect(), WALKER_NAMES.map(String::from).to_vec(), times_s)
}

/// The points of a posed body in the order of [`WALKER_NAMES`].
fn points_of(posed: &PosedBody) -> [DVec3; 13] {
    let (r, l) = (posed.right, posed.left);
    let head = posed.cylinders[Part::Head as usize].centre();
    [
        r.shoulder, r.elbow, r.wrist, l.shoulder, l.elbow, l.wrist, r.hip, r.knee, r.ankle, l.hip, l.knee,
        l.ankle, head,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Body, Gait, GaitStyle};

    fn walk(options: &SampledWalkOptions) -> Result<PointMotion, MotionError> {
        let body = Body::from_height(1.75).unwrap();
        sampled_walk(&Walker { body, gait: Gait::dense(), style: GaitStyle::default() }, options)
    }

    #[test]
    fn limbs_keep_their_lengths_and_the_body_moves_at_its_speed() {
        let motion = walk(&SampledWalkOptions { heading_rad: 0.8, ..SampledWalkOptions::default() }).unwrap();
        for [a, b] in limbs_of(motion.names()) {
            let length = |t| motion.at(t, a).unwrap().distance(motion.at(t, b).unwrap());
            assert!((0..60).all(|t| (length(t) - length(0)).abs() < 1e-9));
        }
        let path = motion.pelvis_path();
        let travelled = path[59] - path[0];
        assert!((travelled.truncate().length() - 1.3 * 59.0 / 60.0).abs() < 1e-9);
        assert!((travelled.y / travelled.x - 0.8f64.tan()).abs() < 1e-9);
    }

    #[test]
    fn whole_cycles_have_whole_frames_and_the_nearest_speed() {
        let walker = Walker {
            body: Body::from_height(1.75).unwrap(),
            gait: Gait::dense(),
            style: GaitStyle::default(),
        };
        for speed_mps in [0.4, 1.3, 2.0] {
            let asked = SampledWalkOptions { speed_mps, ..SampledWalkOptions::default() };
            let whole = asked.of_whole_cycles(&walker, 3).unwrap();
            assert!((whole.cycle_s(&walker) * 60.0 * 3.0 - whole.frames as f64).abs() < 1e-9);
            assert!((whole.speed_mps / speed_mps - 1.0).abs() < 0.5 / (asked.cycle_s(&walker) * 60.0 - 0.5));
        }
        for speed_mps in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e-9] {
            let bad = SampledWalkOptions { speed_mps, ..SampledWalkOptions::default() };
            assert!(bad.of_whole_cycles(&walker, 1).is_err(), "{speed_mps}");
        }
        assert!(SampledWalkOptions::default().of_whole_cycles(&walker, 0).is_err());
        assert!(SampledWalkOptions::default().of_whole_cycles(&walker, usize::MAX).is_err());
    }

    #[test]
    fn joints_are_found_by_any_of_their_names() {
        let motion = walk(&SampledWalkOptions::default()).unwrap();
        let renamed = |names: [&str; 13]| {
            let names = names.map(String::from).to_vec();
            PointMotion::new(motion.positions().to_vec(), names, motion.times_s().to_vec()).unwrap()
        };
        let other = renamed([
            "RShoulder",
            "RElbow",
            "RWrist",
            "LShoulder",
            "LElbow",
            "LWrist",
            "RHip",
            "right_knee",
            "R_ANKLE",
            "left_hip",
            "LKnee",
            "LAnkle",
            "Head",
        ]);
        assert_eq!(other.hips(), Some([6, 9]));
        assert_eq!(other.pelvis_path(), motion.pelvis_path());
        assert_eq!(limbs_of(other.names()), limbs_of(motion.names()));
        let unnamed = renamed(["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "RHP"]);
        assert_eq!(unnamed.hips(), None);
    }

    #[test]
    fn a_stance_ankle_stands_nearly_still() {
        let motion = walk(&SampledWalkOptions::default()).unwrap();
        let ankle = motion.index_of("RAN").unwrap();
        // Phase 0.15 to 0.35 of a cycle of a little over a second.
        let moved = motion.at(20, ankle).unwrap() - motion.at(10, ankle).unwrap();
        assert!(moved.x.abs() < 0.06, "{moved}");
    }

    #[test]
    fn a_point_or_a_frame_that_does_not_exist_is_nowhere() {
        let walk = walk(&SampledWalkOptions::default()).unwrap();
        let [frames, points] = [walk.frames(), walk.points()];
        assert!(walk.at(frames - 1, points - 1).is_some());
        assert_eq!([walk.at(0, points), walk.at(frames, 0), walk.at(usize::MAX, usize::MAX)], [None; 3]);
    }

    #[test]
    fn what_is_no_motion_is_refused() {
        let names = vec!["a".to_owned(), "b".to_owned()];
        let at = |x: f64| vec![DVec3::splat(x); 4];
        assert!(matches!(PointMotion::new(vec![], vec![], vec![]), Err(MotionError::Empty { .. })));
        assert!(matches!(
            PointMotion::new(at(0.0), names.clone(), vec![0.0]),
            Err(MotionError::Shape { .. })
        ));
        for times in [vec![0.0, 0.0], vec![1.0, 0.5], vec![0.0, f64::NAN]] {
            assert!(matches!(
                PointMotion::new(at(0.0), names.clone(), times),
                Err(MotionError::Times { .. })
            ));
        }
        for far in [f64::INFINITY, 1e300] {
            assert!(matches!(
                PointMotion::new(at(far), names.clone(), vec![0.0, 1.0]),
                Err(MotionError::Position { .. })
            ));
        }
        let unknown = PointMotion::new(at(f64::NAN), names, vec![0.0, 1.0]).unwrap();
        assert_eq!(unknown.at(0, 0), None);
        assert_eq!(unknown.pelvis_path(), vec![DVec3::ZERO; 2]);
        for bad in [f64::NAN, 0.0, f64::INFINITY] {
            assert!(walk(&SampledWalkOptions { rate_hz: bad, ..SampledWalkOptions::default() }).is_err());
            assert!(walk(&SampledWalkOptions { speed_mps: bad, ..SampledWalkOptions::default() }).is_err());
        }
        assert!(walk(&SampledWalkOptions { frames: 0, ..SampledWalkOptions::default() }).is_err());
        assert!(walk(&SampledWalkOptions { frames: usize::MAX, ..SampledWalkOptions::default() }).is_err());
        assert!(walk(&SampledWalkOptions { phase: f64::NAN, ..SampledWalkOptions::default() }).is_err());
    }
}
