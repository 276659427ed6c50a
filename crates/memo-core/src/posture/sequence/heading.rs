//! The moving direction of a sequence.

use glam::{DVec2, DVec3};

use super::Warning;
use super::neck::{Head, NeckTrack, Scene};

/// Source of the moving direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HeadingFrom {
    /// Given by the caller.
    Given,
    /// The displacement of the neck on the ground.
    Travel,
    /// The direction the face looks, in each frame.
    Head,
    /// The trunk's forward axis, in each branch of the tree.
    Trunk,
}

impl HeadingFrom {
    /// The name in tables.
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
    /// Horizontal unit vector in world axes, one for all frames; `None` if each frame or branch has its own.
    pub direction: Option<DVec3>,
    /// Source of the direction.
    pub from: HeadingFrom,
    /// Displacement on the ground from the beginning to the end of the sequence, metres; NaN if not known.
    pub travelled_m: f64,
}

/// The displacement is used if it exceeds this many of its standard deviations.
const TRAVEL_SIGMAS: f64 = 4.0;
/// A path that turns by more than this is not straight, degrees.
const STRAIGHT_DEG: f64 = 30.0;

/// The given direction, otherwise that of the displacement, the faces or the trunk, in this order.
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

/// Displacement from the mean position of the first fifth to that of the last, and the standard deviation of its
/// length.
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

/// A warning if the second half of the path has another direction than the first.
fn turn(places: &[(DVec2, f64)], min_travel_m: f64) -> Option<Warning> {
    let (first, second) = places.split_at(places.len() / 2);
    let [first, second] = [way(first)?.0, way(second)?.0];
    let is_long = first.length() >= min_travel_m && second.length() >= min_travel_m;
    let turn_deg = first.angle_to(second).to_degrees().abs();
    (is_long && turn_deg > STRAIGHT_DEG).then_some(Warning::Turns { turn_deg })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::posture::sequence::example::{Walk, walk, with_lengths};
    use crate::posture::sequence::{AnchorChoice, SequenceOptions};

    /// Positions along straight lines, 10 cm apart: this many in each direction.
    fn places(legs: &[(usize, DVec2)]) -> Vec<(DVec2, f64)> {
        let mut at = DVec2::ZERO;
        let steps = legs.iter().flat_map(|&(count, direction)| std::iter::repeat_n(direction, count));
        steps
            .map(|direction| {
                at += 0.1 * direction;
                (at, 0.03)
            })
            .collect()
    }

    /// From the mean of the first fifth to that of the last: two frames of ten.
    #[test]
    fn the_way_leads_from_the_first_fifth_to_the_last() {
        let mut places = places(&[(10, DVec2::X)]);
        places[0].0.y = 0.4;
        (places[0].1, places[9].1) = (0.03, 0.04);
        let (way, sd_m) = way(&places).unwrap();
        assert!((way - DVec2::new(0.8, -0.2)).length() < 1e-12, "{way}");
        assert!((sd_m - 0.05).abs() < 1e-12);
        assert_eq!(super::way(&places[..1]), None);
    }

    #[test]
    fn a_way_that_turns_is_no_straight_one_to_either_side() {
        for (turn_deg, is_told) in [(45.0, true), (-45.0, true), (120.0, true), (20.0, false), (-20.0, false)]
        {
            let places = places(&[(20, DVec2::X), (20, DVec2::from_angle(f64::to_radians(turn_deg)))]);
            let told = turn(&places, 0.5);
            assert_eq!(told.is_some(), is_told, "{turn_deg}");
            if let Some(Warning::Turns { turn_deg: told }) = told {
                assert!((told - f64::abs(turn_deg)).abs() < 1e-9);
            }
            // The halves are too short to have a direction.
            assert_eq!(turn(&places, 5.0), None);
        }
    }

    fn heading(walk: &Walk, change: impl Fn(&mut SequenceOptions)) -> (Heading, bool) {
        let mut options = with_lengths();
        change(&mut options);
        let found = walk.postures(&options).unwrap();
        let is_told = found.warnings.iter().any(|warning| matches!(warning, Warning::NoTravel { .. }));
        (found.heading, is_told)
    }

    /// The given direction is used first, then displacement, face and trunk.
    #[test]
    fn the_direction_is_taken_from_the_best_source() {
        let mut walk = walk(60.0, 20, 0.2);
        let (found, is_told) = heading(&walk, |o| o.moving_direction = Some(DVec3::new(0.0, 2.0, 1.0)));
        assert_eq!((found.direction, found.from, is_told), (Some(DVec3::Y), HeadingFrom::Given, false));
        let (found, is_told) = heading(&walk, |_| {});
        assert_eq!((found.from, is_told), (HeadingFrom::Travel, false));
        let direction = found.direction.unwrap();
        assert!(direction.dot(walk.forward) > 0.98 && direction.z == 0.0, "{direction}");
        // 19 intervals of 4.8 cm, between the means of four frames at either end.
        assert!((found.travelled_m - 16.0 * 0.048).abs() < 0.15, "{}", found.travelled_m);
        // The displacement is too small, or no larger than its noise.
        for change in
            [|o: &mut SequenceOptions| o.min_travel_m = 3.0, |o: &mut SequenceOptions| o.noise_px = 300.0]
        {
            let (found, is_told) = heading(&walk, change);
            assert_eq!((found.direction, found.from, is_told), (None, HeadingFrom::Trunk, true));
        }
        // If most frames show a face, it is used before the trunk.
        for (seen, from) in [(12, HeadingFrom::Head), (8, HeadingFrom::Trunk)] {
            let face = |t: usize| if t < seen { walk.head_px(t) } else { [DVec2::NAN; 6] };
            walk.head_points_px = Some((0..20).map(face).collect());
            let (found, _) = heading(&walk, |o| o.min_travel_m = 3.0);
            assert_eq!(found.from, from, "{seen} faces");
        }
    }

    /// An error of the distance that is the same in all frames shifts the path and does not bend it.
    #[test]
    fn an_error_common_to_all_frames_does_not_hide_the_way() {
        let walk = walk(60.0, 20, 0.2);
        let necks = walk.truth.iter().map(|f| walk.camera.camera_from_world(f.0[0]).length());
        let anchor = AnchorChoice::Given { distance_m: necks.collect(), sd_m: 2.0 };
        let (found, _) = heading(&walk, |o| o.anchor = anchor.clone());
        assert_eq!(found.from, HeadingFrom::Travel);
    }
}
