//! Tips of the big toes of a linked motion.
//!
//! A foot is a segment from the ankle to the tip of the big toe, so its end has two roots on the toe's ray as every
//! segment of the paper has (eq. 7). Feet hardly turn sideways against the shank: of each frame's two roots those are
//! chosen that keep the foot near the plane of the leg, to the front, and turn it smoothly from frame to frame.
//!
//! The foot's length is the one with which this costs least.
//!
//! Limit: seen from the front only, length and flexion of a foot are known from how feet usually stand. Toes do not
//! bend.

use glam::{DMat3, DVec2, DVec3};

use super::LinkFrame;
use super::denoise::denoised_rays;
use crate::estimate::viterbi::least_path;
use crate::model::angles::{leg_axes, swing_rad};
use crate::model::skeleton::{SegmentLengths, Side, StickFigure};
use crate::posture::lift::{RootKind, roots};
use crate::posture::prior::acceleration_mps2;

/// Ankle to tip of the big toe as a share of the shank's length, and its standard deviation over people: 0.45 of it to
/// the front, 0.12 down (Drillis and Contini 1966: foot 0.152, shank 0.246 of body height, ankle 0.039 above the
/// ground); markers and detectors put the toe at the tip or at the ball of the foot.
const FOOT_OF_SHANK: [f64; 2] = [0.44, 0.06];
/// Lengths that are tried.
const FOOT_LENGTHS: [f64; 2] = [0.30, 0.56];
const TRIED_LENGTHS: usize = 14;
/// Toes point outwards by this against the plane of the leg; standard deviation, radians.
const OUTWARD_RAD: [f64; 2] = [0.12, 0.35];
/// Angle of the foot from the direction of the shank, to the front (1.3 in standing); standard deviation, radians.
const FLEXION_RAD: [f64; 2] = [1.3, 0.45];
/// Error of an ankle's position across the ray, metres.
const ANKLE_SD_M: f64 = 0.01;
/// Most usual speed at which a foot turns, rad/s, and error of its direction in a frame, radians.
const TURN_RAD_PER_S: f64 = 8.0;
const TURN_RAD: f64 = 0.15;
/// Frames farther apart are not compared, seconds.
const LONGEST_STEP_S: f64 = 0.25 + 1e-6;
/// A cost of one frame is at most this, nats.
const CAP: f64 = 8.0;

/// The tips of the right and the left big toe in every frame, in the axes of the figures, metres; NaN if the toe, the
/// ankle or the knee is not known.
pub(super) fn toes(
    frames: &[LinkFrame],
    lengths: &SegmentLengths,
    figures: &[StickFigure],
) -> Vec<[DVec3; 2]> {
    // 1. The toes' rays, with less noise.
    let tracks = Side::BOTH.map(|side| Track::of(frames, lengths, figures, side));
    // 2. The length of the feet with which their most probable motion costs least.
    let cost = |share: f64| {
        let off = (share - FOOT_OF_SHANK[0]) / FOOT_OF_SHANK[1];
        0.5 * off * off + tracks.iter().map(|track| track.least(share).0).sum::<f64>()
    };
    let [least, most] = FOOT_LENGTHS;
    let shares = (0..TRIED_LENGTHS).map(|k| least + (most - least) * k as f64 / (TRIED_LENGTHS - 1) as f64);
    let (_, share) = shares
        .map(|share| (cost(share), share))
        .fold((f64::INFINITY, least), |best, next| if next.0 < best.0 { next } else { best });
    // 3. That motion.
    let mut found = vec![[DVec3::NAN; 2]; frames.len()];
    for (side, track) in tracks.iter().enumerate() {
        for (t, toe) in track.least(share).1 {
            found[t][side] = toe;
        }
    }
    found
}

/// The rays to the toe of a side.
struct Track<'a> {
    frames: &'a [LinkFrame],
    figures: &'a [StickFigure],
    side: Side,
    shank_m: f64,
    /// Frame, ray and its standard deviation, where ankle and knee are known.
    rays: Vec<(usize, DVec3, f64)>,
}

impl<'a> Track<'a> {
    fn of(frames: &'a [LinkFrame], lengths: &SegmentLengths, figures: &'a [StickFigure], side: Side) -> Self {
        let toe = |frame: &LinkFrame| Some(frame.front.toes[side as usize]).filter(|toe| toe.is_finite());
        let seen: Vec<Option<DVec3>> = frames.iter().map(toe).collect();
        let leg_known = |t: usize| [side.knee(), side.ankle()].iter().all(|&j| figures[t][j].is_finite());
        let rays = denoised_rays(frames, &seen, acceleration_mps2(side.ankle())).into_iter().enumerate();
        let rays = rays
            .filter(|&(t, (ray, _))| ray.is_finite() && leg_known(t))
            .map(|(t, (ray, noise_rad))| (t, ray, noise_rad))
            .collect();
        Self { frames, figures, side, shank_m: lengths.to[side.ankle()], rays }
    }

    /// The cheapest motion of a foot of a length, as a share of the shank's: its cost, nats, and the toe's places.
    fn least(&self, share: f64) -> (f64, Vec<(usize, DVec3)>) {
        let feet: Vec<Vec<Foot>> =
            self.rays.iter().map(|&(t, ray, noise_rad)| self.feet(t, ray, noise_rad, share)).collect();
        let turn = |k: usize, before: usize, now: usize| {
            let step_s = self.frames[self.rays[k].0].time_s - self.frames[self.rays[k - 1].0].time_s;
            if step_s > LONGEST_STEP_S {
                return 0.0;
            }
            let turn_rad = feet[k - 1][before].direction.angle_between(feet[k][now].direction);
            (0.5 * (turn_rad / TURN_RAD.hypot(TURN_RAD_PER_S * step_s)).powi(2)).min(CAP)
        };
        let counts: Vec<usize> = feet.iter().map(Vec::len).collect();
        let states = least_path(
            &counts,
            |k, state| feet[k][state].cost,
            |k, first, before, now| turn(k, before, now) + if k == 2 { turn(1, first, before) } else { 0.0 },
        );
        let chosen: Vec<&Foot> = feet.iter().zip(&states).map(|(feet, &state)| &feet[state]).collect();
        let turns = (1..feet.len()).map(|k| turn(k, states[k - 1], states[k])).sum::<f64>();
        let cost = chosen.iter().map(|foot| foot.cost).sum::<f64>() + turns;
        (cost, self.rays.iter().zip(chosen).map(|(&(t, ..), foot)| (t, foot.toe)).collect())
    }

    /// The one or two feet of a frame.
    fn feet(&self, t: usize, ray: DVec3, noise_rad: f64, share: f64) -> Vec<Foot> {
        let (figure, length_m) = (&self.figures[t], share * self.shank_m);
        let ankle = figure[self.side.ankle()];
        let roots = roots(ankle, ray, length_m, noise_rad, 0.0);
        let gap = if let RootKind::None { gap_m } = roots.kind {
            gap_m / ANKLE_SD_M.hypot(noise_rad * ankle.length())
        } else {
            0.0
        };
        let axes = leg_axes(figure, self.side);
        let foot = |&toe: &DVec3| {
            let direction = (toe - ankle).normalize_or_zero();
            let off = axes.map_or(0.0, |axes| departure(&axes, direction, self.side));
            Foot { toe, direction, cost: (0.5 * gap * gap + off).min(CAP) }
        };
        let (places, count) = roots.candidates();
        places[..count].iter().map(foot).collect()
    }
}

/// A foot that its ray allows.
struct Foot {
    toe: DVec3,
    /// Unit vector from the ankle.
    direction: DVec3,
    /// Departure from how feet stand on shanks and from the foot's length, nats.
    cost: f64,
}

/// Cost of a foot's direction by the axes of its leg, nats.
fn departure(axes: &DMat3, direction: DVec3, side: Side) -> f64 {
    let outward = if side == Side::Left { axes.z_axis } else { -axes.z_axis };
    let outward_rad = outward.dot(direction).clamp(-1.0, 1.0).asin();
    let off = DVec2::new(
        (outward_rad - OUTWARD_RAD[0]) / OUTWARD_RAD[1],
        (swing_rad(axes, direction) - FLEXION_RAD[0]) / FLEXION_RAD[1],
    );
    0.5 * off.length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::skeleton::PerJoint;
    use crate::posture::lift::JointRays;
    use crate::posture::link::FrontPoints;
    use crate::reproduce::stick_walker::StickWalker;
    use crate::synth::Random;

    /// The paper's walker, turned about the vertical, 4 m away, with feet of a share of its shanks that swing by 0.4 rad.
    fn walk(
        turned_rad: f64,
        share: f64,
        noise_rad: f64,
    ) -> (Vec<LinkFrame>, Vec<StickFigure>, SegmentLengths, Vec<[DVec3; 2]>) {
        let walker = StickWalker::lee_chen();
        let turn = DMat3::from_rotation_y(turned_rad);
        let mut random = Random::new(5);
        let mut noisy = |point: DVec3| {
            let [u, v] = random.normal_pair().map(f64::from);
            (point / point.z + noise_rad * DVec3::new(u, v, 0.0)).normalize()
        };
        let (mut frames, mut figures, mut toes) = (Vec::new(), Vec::new(), Vec::new());
        for t in 0..40 {
            let time_s = f64::from(t) / 25.0;
            let figure = walker.posed(time_s, DVec3::ZERO);
            let figure: StickFigure =
                PerJoint(figure.0.map(|v| turn * DVec3::new(v.x, -v.y, -v.z) + DVec3::new(0.0, -0.3, 4.0)));
            let pair = Side::BOTH.map(|side| {
                let axes = leg_axes(&figure, side).unwrap();
                let swing_rad = 1.4 + 0.4 * (5.0 * time_s + side as usize as f64).sin();
                let outward = if side == Side::Left { axes.z_axis } else { -axes.z_axis };
                let ahead = swing_rad.sin() * axes.x_axis + swing_rad.cos() * axes.y_axis;
                let length_m = share * walker.lengths().to[side.ankle()];
                figure[side.ankle()] + length_m * (0.99 * ahead + 0.14 * outward).normalize()
            });
            let mut front = FrontPoints::UNSEEN;
            front.toes = pair.map(&mut noisy);
            let rays = JointRays { noise_rad, ..JointRays::from_points(&figure) };
            frames.push(LinkFrame { time_s, rays, neck: figure[crate::model::skeleton::Joint::Neck], front });
            figures.push(figure);
            toes.push(pair);
        }
        (frames, figures, *walker.lengths(), toes)
    }

    fn error_m(found: &[[DVec3; 2]], truth: &[[DVec3; 2]]) -> f64 {
        let apart = found.iter().flatten().zip(truth.iter().flatten()).map(|(a, b)| a.distance(*b));
        apart.sum::<f64>() / truth.len() as f64 / 2.0
    }

    /// From the side, obliquely and from behind, toes at the tip and at the ball of the foot are found; noise moves them
    /// little.
    #[test]
    fn planted_toes_are_found_from_every_side() {
        for turned_rad in [0.0, 0.8, -0.8, 2.6, 3.1] {
            for share in [0.36, 0.46] {
                let (frames, figures, lengths, truth) = walk(turned_rad, share, 0.0);
                let found = error_m(&toes(&frames, &lengths, &figures), &truth);
                assert!(found < 0.03, "{turned_rad} {share}: {found}");
                let (frames, figures, lengths, truth) = walk(turned_rad, share, 1e-3);
                let found = error_m(&toes(&frames, &lengths, &figures), &truth);
                assert!(found < 0.04, "{turned_rad} {share} with noise: {found}");
            }
        }
    }

    /// A toe, a knee or an ankle that is not seen leaves the toe of this frame and side unknown, and no other.
    #[test]
    fn toes_are_where_they_and_the_leg_are_seen() {
        let (mut frames, mut figures, lengths, truth) = walk(0.3, 0.42, 0.0);
        frames[4].front.toes[0] = DVec3::NAN;
        figures[9][Side::Left.ankle()] = DVec3::NAN;
        figures[12][Side::Right.knee()] = DVec3::NAN;
        let found = toes(&frames, &lengths, &figures);
        for (t, pair) in found.iter().enumerate() {
            for side in 0..2 {
                let missing = [(4, 0), (9, 1), (12, 0)].contains(&(t, side));
                assert_eq!(pair[side].is_nan(), missing, "{t} {side}");
                assert!(missing || pair[side].distance(truth[t][side]) < 0.06, "{t} {side}");
            }
        }
        let nothing = frames.iter().map(|frame| LinkFrame { front: FrontPoints::UNSEEN, ..*frame });
        let found = toes(&nothing.collect::<Vec<_>>(), &lengths, &figures);
        assert!(found.iter().flatten().all(|toe| toe.is_nan()));
        assert!(toes(&[], &lengths, &[]).is_empty());
    }
}
