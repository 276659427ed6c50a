//! How far ahead of the body the feet are seen, and where the lowest changes lie on the ground.

use super::super::locate::{MASK_MARGIN_PX, Sighting};
use super::super::route::Route;
use super::super::search::Path;
use crate::model::body::Part;
use crate::model::{Camera, Walker};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// Phases in the table of reaches.
const PHASES: usize = 64;
/// Distance of the places in the table of reaches, metres.
const NODE_M: f64 = 0.5;
/// How much earlier in the cycle the nearer foot is seen than it stands there, of people who come nearer and who go away.
/// Changes show feet while they move: in front, a foot goes out of sight soon after it has landed, and behind, it comes
/// into sight only when it is lifted. Measured on people drawn by two programs: 0.11 to 0.15, and -0.10 to -0.21.
pub(super) const LEAD: [f64; 2] = [0.12, -0.15];
/// By so many lengths of the foot the lowest changes are ahead of the ankle of who comes nearer, if they are all changes, and
/// nearer to the camera than that of who goes away. Firm changes do not show the tip of a shoe that comes nearer. Measured on
/// people drawn by two programs, in the mean of a walk: of who comes nearer, 1.05 (13 people of the one, 0.7 to 1.4) and about
/// 0.75 (read off the lowest rows of four walks of two people of the other); of who goes away, 24 walks of four people are -0.07
/// to 0.13 m off along the path with it, and ten of five others -0.09 to 0.03 m.
const SHOE: [f64; 2] = [0.9, -1.25];

/// How far the lowest changes are off the reach of a nearer and of a swinging foot, the scales of Cauchy's distribution, metres.
pub(super) const NEARER_OFF_M: f64 = 0.06;
const SWINGING_OFF_M: f64 = 0.12;
/// From and up to which phase after its contact, as the lowest changes show it, a foot has stood so long that the swinging one is
/// seen, in so many of the frames; elsewhere in so many. Of four drawn walks of two people who come nearer, about 0.8 and 0.02.
const STANDS: std::ops::Range<f64> = 0.08..0.27;
const SWINGS: [f64; 2] = [0.75, 0.03];

/// What the feet of one frame show: where the ray of the lowest row meets the ground, and that of one pixel farther up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feet {
    pub(super) place: DVec2,
    above: DVec2,
}

/// How far the lowest row of a foot lies ahead of the torso on the ground, metres, at places along a route.
#[derive(Debug, Clone)]
pub(super) struct Reach {
    pub(super) walker: Walker,
    pub(super) camera: Camera,
    route: Route,
    /// Height of the ankle of a foot that stands.
    ankle_m: f64,
    /// Whether the changes are firm ones, which show a foot only while it moves.
    pub(super) is_firm: bool,
    /// Of the nearer foot and of the swinging one.
    nodes: BTreeMap<i64, [[f64; PHASES]; 2]>,
}

/// What may be the lowest row at a place and phase: the foot that is nearer to the camera, or the swinging one while the
/// other has stood for a while.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// The reach of each, with its slopes by place and phase.
    reach: [[f64; 3]; 2],
    /// Probability that it is the swinging one.
    swings: f64,
}

impl Expected {
    /// The reach, with its slopes, of the foot that is the likelier one where something is seen so far ahead of the torso,
    /// the scale of Cauchy's distribution of how far it is off, and the logarithm of the likelihood.
    pub(super) fn likelier(&self, ahead_m: f64) -> ([f64; 3], f64, f64) {
        let of = |n: usize, share: f64, scale_m: f64| {
            let off = (ahead_m - self.reach[n][0]) / scale_m;
            (self.reach[n], scale_m, share.ln() - scale_m.ln() - (off * off).ln_1p())
        };
        let nearer = of(0, 1.0 - self.swings, NEARER_OFF_M);
        let swinging = of(1, self.swings, SWINGING_OFF_M);
        if swinging.2 > nearer.2 { swinging } else { nearer }
    }
}

impl Reach {
    pub(super) fn new(walker: &Walker, camera: &Camera, route: &Route) -> Self {
        let ankle_m = |k: usize| walker.pose(DVec3::ZERO, 0.0, k as f64 / PHASES as f64).right.ankle.z;
        let lowest_m = (0..PHASES).map(ankle_m).fold(f64::INFINITY, f64::min);
        Self {
            walker: walker.clone(),
            camera: camera.clone(),
            route: route.clone(),
            ankle_m: lowest_m + walker.level_torso_height_m(),
            is_firm: true,
            nodes: BTreeMap::new(),
        }
    }

    /// The same on another route.
    pub(super) fn on(&self, route: &Route) -> Self {
        Self { route: route.clone(), nodes: BTreeMap::new(), ..self.clone() }
    }

    /// What may be seen at a place and phase.
    pub(super) fn at(&mut self, along_m: f64, phase: f64) -> Expected {
        let (x, y) = (along_m / NODE_M, phase.rem_euclid(1.0) * PHASES as f64);
        let (node, t) = (x.floor() as i64, x - x.floor());
        let (k, u) = (y.floor() as usize % PHASES, y - y.floor());
        let [of_near, of_far] = [node, node + 1].map(|node| self.node(node));
        let reach = [0, 1].map(|foot| {
            let [[a, b], [c, d]] =
                [of_near, of_far].map(|values| [values[foot][k], values[foot][(k + 1) % PHASES]]);
            let [near, far] = [a + u * (b - a), c + u * (d - c)];
            let by_phase = PHASES as f64 * ((1.0 - t) * (b - a) + t * (d - c));
            [near + t * (far - near), (far - near) / NODE_M, by_phase]
        });
        let is_seen = self.is_firm && comes_nearer(&self.route.at(along_m), along_m, &self.camera);
        let stands = STANDS.contains(&phase.rem_euclid(0.5));
        Expected { reach, swings: if is_seen { if stands { SWINGS[0] } else { SWINGS[1] } } else { 0.0 } }
    }

    fn node(&mut self, node: i64) -> [[f64; PHASES]; 2] {
        if let Some(values) = self.nodes.get(&node) {
            return *values;
        }
        let along_m = node as f64 * NODE_M;
        let path = self.route.at(along_m);
        let foot_m = self.walker.body.proportions.foot * self.walker.body.height_m;
        let comes_nearer = comes_nearer(&path, along_m, &self.camera);
        let way = usize::from(!comes_nearer);
        let shoe_m = if comes_nearer && self.is_firm { 0.0 } else { SHOE[way] * foot_m };
        let both: [[f64; 2]; PHASES] =
            std::array::from_fn(|k| self.of_feet(&path, along_m, k as f64 / PHASES as f64 + LEAD[way]));
        let values = [0, 1].map(|foot| {
            // Both sides have the same curve, half a cycle apart.
            let mean = |k: usize| 0.5 * (both[k][foot] + both[(k + PHASES / 2) % PHASES][foot]);
            std::array::from_fn(|k| mean(k) + shoe_m)
        });
        self.nodes.insert(node, values);
        values
    }

    /// The reach of the foot whose sole is lower in the image, below the torso, and of the other one, half of the way from the
    /// ankle's sole to the tip of the toes; 0 where the camera does not see it.
    fn of_feet(&self, path: &Path, along_m: f64, phase: f64) -> [f64; 2] {
        let height_m = self.walker.level_torso_height_m() + self.walker.gait.vertical_m(phase);
        let torso = path.point(along_m, height_m);
        let posed = self.walker.pose(torso, path.heading_rad, phase);
        let Some(column) = self.camera.project_ideal(torso).map(|pixel| pixel.x) else { return [0.0; 2] };
        let reach_m = |point: DVec3| {
            let row = self.camera.project_ideal(point)?.y;
            let on_ground = self.camera.ground_point(DVec2::new(column, row))?;
            Some((row, path.along(on_ground.truncate()) - along_m))
        };
        let feet = [(posed.right, Part::RightFoot), (posed.left, Part::LeftFoot)].map(|(side, foot)| {
            let foot = &posed.cylinders[foot as usize];
            let toes = foot.centre() + foot.half_length * foot.world_from_cylinder.matrix3.z_axis;
            [side.ankle - self.ankle_m * DVec3::Z, toes].map(reach_m)
        });
        let row = |foot: &[Option<(f64, f64)>; 2]| foot[0].map_or(f64::MIN, |(row, _)| row);
        let [lower, higher] =
            if row(&feet[0]) > row(&feet[1]) { [feet[0], feet[1]] } else { [feet[1], feet[0]] };
        let nearer_m = lower[0].map_or(0.0, |(_, reach_m)| reach_m);
        let swinging_m = match higher {
            [Some((_, ankle_m)), Some((_, toes_m))] => 0.5 * (ankle_m + toes_m),
            _ => nearer_m,
        };
        [nearer_m, swinging_m]
    }
}

impl Feet {
    /// Metres on the ground per pixel of the lowest row.
    pub(super) fn row_m(&self) -> f64 {
        self.place.distance(self.above)
    }
}

/// Where the lowest changes of a rectangle lie on the ground, and one pixel farther up; `None` above the horizon.
pub(super) fn feet(sighting: &Sighting, camera: &Camera) -> Option<Feet> {
    let r = &sighting.rectangle;
    let (middle, bottom) = (0.5 * (r.left + r.right) as f64, r.bottom as f64 - MASK_MARGIN_PX);
    let on_ground = |row: f64| {
        let pixel = DVec2::new(middle, row);
        camera.ground_point(camera.undistort(pixel).ok()?).map(DVec3::truncate)
    };
    Some(Feet { place: on_ground(bottom)?, above: on_ground(bottom - 1.0)? })
}

/// The angle between a path and the line of sight to a place on it, in either direction.
pub(in crate::track) fn off_the_sight_rad(path: &Path, along_m: f64, camera: &Camera) -> f64 {
    let place = path.point(along_m, 0.0).truncate();
    let sight = (place - camera.position().truncate()).normalize_or_zero();
    path.direction().perp_dot(sight).abs().asin()
}

/// Whether who walks on a path comes nearer to the camera at a place on it.
pub(super) fn comes_nearer(path: &Path, along_m: f64, camera: &Camera) -> bool {
    let place = path.point(along_m, 0.0).truncate();
    path.direction().dot(camera.position().truncate() - place) > 0.0
}

#[cfg(test)]
mod tests {
    use super::super::super::search::tests::{camera, walker};
    use super::super::tests::{MIDDLE, towards};
    use super::*;

    #[test]
    fn reach_repeats_every_half_cycle_and_its_slopes_are_those_of_its_values() {
        let path = Path { origin: MIDDLE, heading_rad: towards().to_angle() };
        let mut reach = Reach::new(&walker(), &camera(), &path.into());
        for k in 0..40 {
            let (along_m, phase) = (-1.0 + 0.053 * f64::from(k), 0.037 * f64::from(k));
            let of = |at: Expected| at.reach;
            for foot in [0, 1] {
                let [value, by_place, by_phase] = of(reach.at(along_m, phase))[foot];
                assert!((value - of(reach.at(along_m, phase + 0.5))[foot][0]).abs() < 1e-9);
                let small = 1e-7;
                let numeric = [(small, 0.0), (0.0, small)]
                    .map(|(x, p)| (of(reach.at(along_m + x, phase + p))[foot][0] - value) / small);
                assert!((by_place - numeric[0]).abs() < 1e-3 && (by_phase - numeric[1]).abs() < 1e-3);
            }
        }
    }

    /// Behind a foot that has stood for a while the other one is seen, in firm changes of who comes nearer alone. All changes
    /// show the tip of the shoe.
    #[test]
    fn the_likelier_foot_is_the_one_that_is_seen() {
        let path = Path { origin: MIDDLE, heading_rad: towards().to_angle() };
        let away = Path { heading_rad: towards().to_angle() + std::f64::consts::PI, ..path };
        let firm = Reach::new(&walker(), &camera(), &path.into());
        let all = Reach { is_firm: false, ..firm.clone() };
        let [stands, steps] = [0.15, 0.4];
        let nearest = |reach: &Reach, phase: f64, foot: usize| {
            let expected = reach.clone().at(0.5, phase);
            let ahead_m = expected.reach[foot][0];
            expected.likelier(ahead_m).0[0] == ahead_m
        };
        assert!(nearest(&firm, stands, 0) && nearest(&firm, stands, 1) && nearest(&firm, stands + 0.5, 1));
        assert!(nearest(&firm, steps, 0));
        assert!(nearest(&all, stands, 0) && !nearest(&all, stands, 1));
        let away = Reach::new(&walker(), &camera(), &away.into());
        assert!(nearest(&away, stands, 0) && !nearest(&away, stands, 1));
        let [of_all, of_firm] = [&all, &firm].map(|reach| reach.clone().at(0.5, steps).reach[0][0]);
        let foot_m = walker().body.proportions.foot * walker().body.height_m;
        assert!((of_all - of_firm - SHOE[0] * foot_m).abs() < 1e-9);
    }
}
