//! The moving direction of a sequence.

use glam::{DVec2, DVec3};

use super::Warning;
use super::neck::{Head, NeckTrack, Scene};

/// From where the moving direction was taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HeadingFrom {
    /// It was given.
    Given,
    /// The way of the neck over the ground.
    Travel,
    /// The way the face looks, in each frame.
    Head,
    /// The trunk's forward axis, in each branch of the tree.
    Trunk,
}

impl HeadingFrom {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Travel => "travel",
            Self::Head => "head",
            Self::Trunk => "trunk",
        }
    }
}

/// The moving direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Heading {
    /// Level unit vector in the world, one for all frames; none where each frame or branch has its own.
    pub direction: Option<DVec3>,
    /// From where it was taken.
    pub from: HeadingFrom,
    /// Distance over the ground from the beginning to the end of the sequence, metres; NaN if not known.
    pub travelled_m: f64,
}

/// Standard deviations of the way that are needed before its direction is believed.
const TRAVEL_SIGMAS: f64 = 4.0;
/// A way that turns by more than this is not straight, degrees.
const STRAIGHT_DEG: f64 = 30.0;

/// The direction given, else of the way, else of the faces, else that of the trunk.
pub(super) fn find(
    scene: &Scene,
    necks: &[DVec3],
    track: &NeckTrack,
    heads: &[Option<Head>],
    warnings: &mut Vec<Warning>,
) -> Heading {
    let on_ground: Vec<(DVec2, f64)> = necks
        .iter()
        .zip(&track.sd_m)
        .filter(|(neck, _)| neck.is_finite())
        .map(|(neck, sd_m)| {
            let world = scene.camera.rotation.transpose() * (*neck - scene.camera.translation);
            (world.truncate(), (sd_m * sd_m - track.common_sd_m * track.common_sd_m).max(0.0).sqrt())
        })
        .collect();
    let way = way(&on_ground);
    let travelled_m = way.map_or(f64::NAN, |(way, _)| way.length());
    if let Some(direction) = scene.options.moving_direction {
        let direction = direction.with_z(0.0).try_normalize();
        return Heading { direction, from: HeadingFrom::Given, travelled_m };
    }
    if let Some((way, sd_m)) = way
        && way.length() >= scene.options.min_travel_m
        && way.length() > TRAVEL_SIGMAS * sd_m
    {
        warnings.extend(turn(&on_ground, scene.options.min_travel_m));
        let direction = way.extend(0.0).try_normalize();
        return Heading { direction, from: HeadingFrom::Travel, travelled_m };
    }
    let faces = heads.iter().flatten().filter(|head| head.axes.is_some()).count();
    let from = if 2 * faces > necks.len() { HeadingFrom::Head } else { HeadingFrom::Trunk };
    if scene.options.motion.needs_heading() {
        warnings.push(Warning::NoTravel { travelled_m, from });
    }
    Heading { direction: None, from, travelled_m }
}

/// From the mean place of the first fifth to that of the last, and the standard deviation of its length.
fn way(places: &[(DVec2, f64)]) -> Option<(DVec2, f64)> {
    if places.len() < 2 {
        return None;
    }
    let count = places.len().div_ceil(5);
    let mean = |part: &[(DVec2, f64)]| part.iter().map(|p| p.0).sum::<DVec2>() / part.len() as f64;
    let way = mean(&places[places.len() - count..]) - mean(&places[..count]);
    let sd_m = places[0].1.hypot(places[places.len() - 1].1);
    Some((way, sd_m))
}

/// Whether the second half of the way leads elsewhere than the first.
fn turn(places: &[(DVec2, f64)], min_travel_m: f64) -> Option<Warning> {
    let (first, second) = places.split_at(places.len() / 2);
    let [first, second] = [way(first)?.0, way(second)?.0];
    let is_long = first.length() >= min_travel_m && second.length() >= min_travel_m;
    let turn_deg = first.angle_to(second).to_degrees().abs();
    (is_long && turn_deg > STRAIGHT_DEG).then_some(Warning::Turns { turn_deg })
}
