//! Which way a trunk faces, from what shows a person's front in the image.
//!
//! A trunk and its mirror image exchange the sides to which the person is turned in the image: if one faces to
//! the right of the image, the other faces to the left. Feet and face point to the front, knees bend to the front
//! and elbows to the back, and people mostly move forwards. Each of these needs the image alone. The row `bare` of
//! `tests/score_postures.py` measures the share of frames that face the wrong way without feet and face, `lengths`
//! with toes.
//!
//! Limit: a trunk that leans to the camera and one that leans away look alike in these.

use glam::{DVec2, DVec3};

use super::{LinkFrame, Problem};
use crate::model::angles::{hip_axes, trunk_axes};
use crate::model::skeleton::{Joint, Side, StickFigure};

/// Rays to points that show a person's front, unit vectors, camera axes; NaN if not seen. Of pairs, right first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontPoints {
    /// Tips of the big toes.
    pub toes: [DVec3; 2],
    /// Heels.
    pub heels: [DVec3; 2],
    /// Tip of the nose.
    pub nose: DVec3,
    /// Ears.
    pub ears: [DVec3; 2],
}

impl FrontPoints {
    /// No such point is seen.
    pub const UNSEEN: Self =
        Self { toes: [DVec3::NAN; 2], heels: [DVec3::NAN; 2], nose: DVec3::NAN, ears: [DVec3::NAN; 2] };
}

/// A point in front of another, with the distance to the front and its standard deviation over people and
/// motions, as shares of the shank's length: from ankle to toes, from heel to toes, from the ears to the nose
/// (Drillis and Contini 1966: foot 0.152, shank 0.246 of body height; the head by Table A.2 of Lee and Chen).
const TOES_OF_ANKLE: [f64; 2] = [0.45, 0.25];
const TOES_OF_HEEL: [f64; 2] = [0.60, 0.30];
const NOSE_OF_EARS: [f64; 2] = [0.15, 0.20];
/// A point that is elsewhere costs at most this, nats.
const POINT_CAP: f64 = 8.0;
/// A knee is at most this far behind the line from hip to ankle, an elbow this far in front of that from shoulder
/// to wrist, metres; the standard deviations of joints that bend sideways.
const KNEE_SD_M: f64 = 0.05;
const ELBOW_SD_M: f64 = 0.08;
/// A joint bent the wrong way costs at most this, nats.
const BEND_CAP: f64 = 4.0;
/// Cost of moving backwards, nats per m/s, up to the speed of a run.
const BACKWARDS_PER_MPS: f64 = 1.0;
const MOST_SPEED_MPS: f64 = 3.0;
/// Time over which the speed is measured, to both sides, seconds.
const SPEED_S: f64 = 0.25;
/// Cost of facing opposite to a given moving direction, nats.
const AGAINST_DIRECTION: f64 = 6.0;

/// What the image of one frame says about the front.
pub(super) struct Front {
    /// Unit vector in the image plane, horizontal, to the right.
    across: DVec3,
    /// How far points are to the right of others, as shares of what is expected if they are to the front; and
    /// standard deviation in the same unit.
    points: Vec<[f64; 2]>,
    /// How far joints are bent to the right, in standard deviations; elbows negative.
    bends: Vec<f64>,
    /// Speed to the right, m/s.
    speed_mps: f64,
    /// The direction that the person mostly faces.
    direction: Option<DVec3>,
}

impl Front {
    /// What a frame says; nothing if up is not known.
    pub fn find(problem: &Problem, t: usize) -> Option<Self> {
        let frame = &problem.frames[t];
        let up = problem.options.up?.try_normalize()?;
        let across = -up.cross(frame.neck).try_normalize()?;
        let away = up.cross(across);
        let sight = Sight { across, away, depth_m: away.dot(frame.neck) };
        if sight.depth_m < 1e-6 {
            return None;
        }
        Some(Self {
            across,
            points: points(problem, frame, &sight),
            bends: bends(frame, &sight),
            speed_mps: speed(problem, t, across),
            direction: problem.options.facing.and_then(DVec3::try_normalize),
        })
    }

    /// Cost of a trunk, nats.
    pub fn cost(&self, figure: &StickFigure) -> f64 {
        let fronts = [trunk_axes(figure), hip_axes(figure)].into_iter().flatten().map(|axes| axes.x_axis);
        let Some(front) = fronts.sum::<DVec3>().try_normalize() else { return 0.0 };
        let right = self.across.dot(front);
        let square = |value: f64| 0.5 * value * value;
        let points = self.points.iter().map(|&[at, sd]| square((at - right) / sd).min(POINT_CAP));
        let wrong = self.bends.iter().filter(|&&bend| bend * right < 0.0);
        let bends = wrong.map(|bend| square(bend * right).min(BEND_CAP));
        let backwards = BACKWARDS_PER_MPS * (-self.speed_mps * right).max(0.0);
        let against = self.direction.map_or(0.0, |way| 0.5 * AGAINST_DIRECTION * (1.0 - way.dot(front)));
        points.sum::<f64>() + bends.sum::<f64>() + backwards + against
    }
}

/// Horizontal axes of the view of a person, and the person's depth.
struct Sight {
    across: DVec3,
    away: DVec3,
    depth_m: f64,
}

impl Sight {
    /// A ray's point in the vertical plane through the neck, metres to the right and in height.
    fn place(&self, ray: DVec3) -> DVec2 {
        let point = ray * (self.depth_m / self.away.dot(ray));
        DVec2::new(self.across.dot(point), self.across.cross(self.away).dot(point))
    }
}

fn points(problem: &Problem, frame: &LinkFrame, sight: &Sight) -> Vec<[f64; 2]> {
    let FrontPoints { toes, heels, nose, ears } = frame.front;
    let noise_m = std::f64::consts::SQRT_2 * frame.rays.noise_rad * sight.depth_m;
    let mut found = Vec::new();
    let mut add = |to: DVec3, from: DVec3, [share, sd]: [f64; 2], shank_m: f64| {
        let right_m = (sight.place(to) - sight.place(from)).x;
        if right_m.is_finite() {
            let expected_m = share * shank_m;
            found.push([right_m / expected_m, (sd * shank_m).hypot(noise_m) / expected_m]);
        }
    };
    for (i, side) in Side::BOTH.into_iter().enumerate() {
        let shank_m = problem.lengths.to[side.ankle()];
        if heels[i].is_nan() {
            add(toes[i], frame.rays.ray[side.ankle()], TOES_OF_ANKLE, shank_m);
        } else {
            add(toes[i], heels[i], TOES_OF_HEEL, shank_m);
        }
    }
    let seen: Vec<DVec3> = ears.into_iter().filter(|ear| !ear.is_nan()).collect();
    let ear = seen.iter().sum::<DVec3>() / seen.len() as f64;
    add(nose, ear, NOSE_OF_EARS, problem.lengths.to[Joint::RightAnkle]);
    found
}

/// How far knees and elbows are to the right of the line between their neighbours, in standard deviations.
fn bends(frame: &LinkFrame, sight: &Sight) -> Vec<f64> {
    let noise_m = 1.2 * frame.rays.noise_rad * sight.depth_m;
    let off = |[from, middle, to]: [Joint; 3], sd_m: f64| {
        let [from, middle, to] = [from, middle, to].map(|joint| sight.place(frame.rays.ray[joint]));
        let line = to - from;
        let share = ((middle - from).dot(line) / line.length_squared()).clamp(0.0, 1.0);
        (middle - from - share * line).x / sd_m.hypot(noise_m)
    };
    let of_side = |side: Side| {
        let knee = off([side.hip(), side.knee(), side.ankle()], KNEE_SD_M);
        let elbow = off([side.shoulder(), side.elbow(), side.wrist()], ELBOW_SD_M);
        [knee, -elbow]
    };
    Side::BOTH.into_iter().flat_map(of_side).filter(|bend| bend.is_finite()).collect()
}

/// Speed of the neck to the right, m/s; 0 if it is not known.
fn speed(problem: &Problem, t: usize, across: DVec3) -> f64 {
    let frames = problem.frames;
    let now_s = frames[t].time_s;
    let first = frames.partition_point(|frame| frame.time_s < now_s - SPEED_S);
    let last = frames.partition_point(|frame| frame.time_s <= now_s + SPEED_S) - 1;
    let span_s = frames[last].time_s - frames[first].time_s;
    let right_m = across.dot(frames[last].neck - frames[first].neck);
    let speed_mps = right_m / span_s;
    if speed_mps.is_finite() && span_s >= SPEED_S {
        speed_mps.clamp(-MOST_SPEED_MPS, MOST_SPEED_MPS)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::super::LinkOptions;
    use super::*;
    use crate::model::skeleton::{PerJoint, SegmentLengths};
    use crate::posture::lift::JointRays;
    use crate::reproduce::stick_walker::StickWalker;

    /// The paper's walker walks to the right of the image, 4 m away; and the mirror image of its trunk.
    fn walk() -> (Vec<LinkFrame>, [StickFigure; 2], SegmentLengths, LinkOptions) {
        let walker = StickWalker::lee_chen();
        let posed = |t: usize| {
            let figure = walker.posed(0.3 + t as f64 / 25.0, DVec3::ZERO);
            let way_m = 1.2 * t as f64 / 25.0;
            PerJoint(figure.0.map(|v| DVec3::new(v.x + way_m, -v.y, -v.z) + DVec3::new(0.0, -0.3, 4.0)))
        };
        let frames: Vec<LinkFrame> = (0..25)
            .map(|t| LinkFrame {
                time_s: t as f64 / 25.0,
                rays: JointRays::from_points(&posed(t)),
                neck: posed(t)[Joint::Neck],
                front: FrontPoints::UNSEEN,
            })
            .collect();
        let figure = posed(12);
        let mirrored = PerJoint(figure.0.map(|v| DVec3::new(v.x, v.y, 2.0 * figure[Joint::Neck].z - v.z)));
        let options = LinkOptions { up: Some(-DVec3::Y), ..LinkOptions::default() };
        (frames, [figure, mirrored], *walker.lengths(), options)
    }

    /// Cost of the mirrored trunk less that of the true one, in the middle frame.
    fn gain(change: impl Fn(&mut Vec<LinkFrame>, &mut LinkOptions, &StickFigure)) -> f64 {
        let (mut frames, [figure, mirrored], lengths, mut options) = walk();
        change(&mut frames, &mut options, &figure);
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let front = Front::find(&problem, 12).unwrap();
        front.cost(&mirrored) - front.cost(&figure)
    }

    /// How far the walker's front points to the right.
    fn front_right() -> f64 {
        let (_, [figure, _], ..) = walk();
        let fronts = [trunk_axes(&figure), hip_axes(&figure)].map(|axes| axes.unwrap().x_axis);
        (fronts[0] + fronts[1]).normalize().x
    }

    /// Legs and travel show the front; toes, face and a given direction do so more clearly.
    #[test]
    fn a_mirrored_trunk_costs_more_with_everything_that_shows_the_front() {
        let own = gain(|_, _, _| {});
        assert!(own > 1.0, "{own}");
        let toe = |figure: &StickFigure, by_m: f64| (figure[Joint::LeftAnkle] + by_m * DVec3::X).normalize();
        let with_toe = gain(|frames, _, figure| frames[12].front.toes[1] = toe(figure, 0.18));
        assert!(with_toe > own + 5.0, "{with_toe} {own}");
        let turned = gain(|frames, _, figure| frames[12].front.toes[1] = toe(figure, -0.18));
        assert!((with_toe - own + turned - own).abs() < 0.5, "{turned}");
        let face = gain(|frames, _, figure| {
            let head = figure[Joint::Neck] - 0.2 * DVec3::Y;
            frames[12].front.ears[0] = head.normalize();
            frames[12].front.nose = (head + 0.08 * DVec3::X).normalize();
        });
        assert!(face > own + 1.0, "{face} {own}");
        let stays = gain(|frames, _, figure| frames.iter_mut().for_each(|f| f.neck = figure[Joint::Neck]));
        let half_speed = 1.2 * BACKWARDS_PER_MPS * front_right();
        assert!((own - stays - half_speed).abs() < 0.3, "{own} {stays} {half_speed}");
        let given = gain(|_, options, _| options.facing = Some(DVec3::X));
        assert!((given - own - AGAINST_DIRECTION).abs() < 0.5, "{given} {own}");
    }

    /// Seen from the front, both trunks face the same way in the image.
    #[test]
    fn a_front_towards_the_camera_is_no_question() {
        let (mut frames, [figure, _], lengths, options) = walk();
        // The front, to the right, turns towards the camera.
        let turn = |v: DVec3| DVec3::new(v.z - 4.0, v.y, 4.0 - v.x);
        let [figure, mirrored] = {
            let turned = PerJoint(figure.0.map(turn));
            [turned, PerJoint(turned.0.map(|v| DVec3::new(v.x, v.y, 2.0 * turned[Joint::Neck].z - v.z)))]
        };
        frames.iter_mut().for_each(|frame| {
            frame.rays = JointRays::from_points(&figure);
            frame.neck = figure[Joint::Neck];
        });
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        let front = Front::find(&problem, 12).unwrap();
        assert!((front.cost(&mirrored) - front.cost(&figure)).abs() < 0.5);
    }

    #[test]
    fn without_up_nothing_is_said() {
        let (frames, _, lengths, options) = walk();
        let options = LinkOptions { up: None, ..options };
        let problem = Problem { frames: &frames, lengths: &lengths, options: &options };
        assert!(Front::find(&problem, 3).is_none());
    }
}
