//! How far ahead of the body the feet are seen, and where the lowest changes lie on the ground.

use super::super::locate::{MASK_MARGIN_PX, Sighting};
use super::super::route::Route;
use super::super::search::Path;
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
/// The lowest changes of who goes away are nearer to the camera than the ankle, by so many lengths of the foot. Measured on
/// people drawn by two programs: in the mean of a walk, 24 of four people are -0.07 to 0.13 m off along the path, and ten of five
/// others -0.09 to 0.03 m. Of who comes nearer, 17 are -0.16 to -0.02 m off and nine of the others 0.17 to 0.33 m, so nothing
/// is added.
const SHOE: f64 = 1.25;

/// What the feet of one frame show: where the ray of the lowest row meets the ground, and that of one pixel farther up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Feet {
    pub(super) place: DVec2,
    above: DVec2,
}

/// How far the lowest row of the nearer foot lies ahead of the torso on the ground, metres, at places along a route.
#[derive(Debug, Clone)]
pub(super) struct Reach {
    pub(super) walker: Walker,
    pub(super) camera: Camera,
    route: Route,
    /// Height of the ankle of a foot that stands.
    ankle_m: f64,
    nodes: BTreeMap<i64, [f64; PHASES]>,
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
            nodes: BTreeMap::new(),
        }
    }

    /// The reach at a place and phase, with its slopes by both.
    pub(super) fn at(&mut self, along_m: f64, phase: f64) -> [f64; 3] {
        let (x, y) = (along_m / NODE_M, phase.rem_euclid(1.0) * PHASES as f64);
        let (node, t) = (x.floor() as i64, x - x.floor());
        let (k, u) = (y.floor() as usize % PHASES, y - y.floor());
        let [[a, b], [c, d]] = [node, node + 1].map(|node| {
            let values = self.node(node);
            [values[k], values[(k + 1) % PHASES]]
        });
        let [near, far] = [a + u * (b - a), c + u * (d - c)];
        let by_phase = PHASES as f64 * ((1.0 - t) * (b - a) + t * (d - c));
        [near + t * (far - near), (far - near) / NODE_M, by_phase]
    }

    fn node(&mut self, node: i64) -> [f64; PHASES] {
        if let Some(values) = self.nodes.get(&node) {
            return *values;
        }
        let along_m = node as f64 * NODE_M;
        let path = self.route.at(along_m);
        let foot_m = self.walker.body.proportions.foot * self.walker.body.height_m;
        let comes_nearer = comes_nearer(&path, along_m, &self.camera);
        let [lead, shoe_m] = if comes_nearer { [LEAD[0], 0.0] } else { [LEAD[1], -SHOE * foot_m] };
        let values = std::array::from_fn(|k| {
            let phase = k as f64 / PHASES as f64 + lead;
            // Both sides have the same curve, half a cycle apart.
            0.5 * (self.nearer(&path, along_m, phase) + self.nearer(&path, along_m, phase + 0.5)) + shoe_m
        });
        self.nodes.insert(node, values);
        values
    }

    /// The reach of the foot whose sole is lower in the image, below the torso; 0 where the camera does not see it.
    fn nearer(&self, path: &Path, along_m: f64, phase: f64) -> f64 {
        let height_m = self.walker.level_torso_height_m() + self.walker.gait.vertical_m(phase);
        let torso = path.point(along_m, height_m);
        let posed = self.walker.pose(torso, path.heading_rad, phase);
        let soles = [posed.right, posed.left].map(|side| side.ankle - self.ankle_m * DVec3::Z);
        let pixels = soles.iter().filter_map(|sole| self.camera.project_ideal(*sole));
        let lowest = pixels.map(|pixel| pixel.y).reduce(f64::max);
        let column = self.camera.project_ideal(torso).map(|pixel| pixel.x);
        let pixel = column.zip(lowest).map(|(x, y)| DVec2::new(x, y));
        let point = pixel.and_then(|pixel| self.camera.ground_point(pixel));
        point.map_or(0.0, |point| path.along(point.truncate()) - along_m)
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
            let [value, by_place, by_phase] = reach.at(along_m, phase);
            assert!((value - reach.at(along_m, phase + 0.5)[0]).abs() < 1e-9);
            let small = 1e-7;
            let numeric = [
                (reach.at(along_m + small, phase)[0] - value) / small,
                (reach.at(along_m, phase + small)[0] - value) / small,
            ];
            assert!((by_place - numeric[0]).abs() < 1e-3 && (by_phase - numeric[1]).abs() < 1e-3);
        }
    }
}
