//! The height of the person: given, measured in a calibrated camera, or assumed.
//!
//! A calibrated camera shows where the ground is, so the row of the soles gives the distance, and with it the row of
//! the crown gives the height. A walk starts with the height of the rectangles (`start_height`); the fit of the
//! person ([`fit`](super::fit)) then measures it from the outlines of all frames ([`WalkFit::height`]). Without a
//! calibrated camera, a small person nearby looks like a tall one far away. Then the height must be given, or that of
//! the population is assumed and its standard deviation enters every length.
//!
//! [`WalkFit::height`]: super::fit::WalkFit::height

use super::locate::{Sighting, person_midpoints};
use crate::image::Rectangle;
use crate::model::position::{PositionOptions, height_on_ground};
use crate::model::{Camera, Walker};

/// Mean and standard deviation of the height of adults, metres. Men of 1.77 ± 0.07 m and women of 1.64 ± 0.07 m, as
/// in many countries, equally frequent, have 1.705 ± 0.096 m.
pub const POPULATION_HEIGHT_M: f64 = 1.70;
/// See [`POPULATION_HEIGHT_M`].
pub const POPULATION_SD_M: f64 = 0.10;
/// Standard deviation of a given body height, metres: shoes and hair.
pub const GIVEN_SD_M: f64 = 0.02;
/// Standard deviation of a height from the rectangles of the start, metres, without shadows and reflections. Measured
/// on the drawn walks of four people: 0.02 to 0.05.
const RECTANGLE_SD_M: f64 = 0.05;
/// A height from rectangles that is farther from the population's, in its standard deviations, is not used: shadows or
/// reflections belong to the rectangle, or a limb alone.
const MOST_POPULATION_SD: f64 = 3.5;
/// A given height that is farther from a measured one contradicts it, standard deviations.
const CONTRADICTION_SD: f64 = 3.0;

/// Rectangles of people are not taller, metres, nor lower, unless a height is given; then this share of it.
const TALLEST_M: f64 = 2.4;
const SMALLEST_M: f64 = 1.0;
const OF_GIVEN: f64 = 0.8;

/// Where a height comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HeightSource {
    /// It was given.
    Given,
    /// It was measured in a calibrated camera.
    Measured,
    /// It is that of the population.
    Assumed,
}

impl HeightSource {
    /// The name in files: `given`, `measured` or `assumed`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Given => "given",
            Self::Measured => "measured",
            Self::Assumed => "assumed",
        }
    }
}

/// Body height of a person with its standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyHeight {
    /// From the sole to the crown, metres.
    pub height_m: f64,
    /// Its standard deviation, metres.
    pub sd_m: f64,
    /// Where it comes from.
    pub source: HeightSource,
    /// Relative standard deviation of the scale of the camera, if that is assumed from the height of another person; else
    /// 0. That of a measured height contains it.
    pub scale_sd: f64,
}

impl BodyHeight {
    /// The height of the population.
    pub const POPULATION: Self = Self {
        height_m: POPULATION_HEIGHT_M,
        sd_m: POPULATION_SD_M,
        source: HeightSource::Assumed,
        scale_sd: 0.0,
    };

    /// A given height.
    #[must_use]
    pub fn given(height_m: f64) -> Self {
        Self { height_m, sd_m: GIVEN_SD_M, source: HeightSource::Given, scale_sd: 0.0 }
    }

    /// The same height in a camera whose scale has this relative standard deviation: a measured one is as wrong.
    pub(super) fn on_scale(self, scale_sd: f64) -> Self {
        let sd_m = match self.source {
            HeightSource::Measured => self.sd_m.hypot(scale_sd * self.height_m),
            _ => self.sd_m,
        };
        Self { sd_m, scale_sd, ..self }
    }

    /// Relative standard deviation that all lengths of a walk have in common: that of an assumed height, or that of the
    /// camera in which it was measured. A given height is the scale of its walk.
    pub(super) fn assumed_scale_sd(&self) -> f64 {
        match self.source {
            HeightSource::Assumed => self.sd_m / self.height_m,
            HeightSource::Measured => self.scale_sd,
            HeightSource::Given => 0.0,
        }
    }

    /// Standard deviation of the height in the scale of the camera, metres: that of a measured one without the scale's, that
    /// of a given one with it.
    pub(super) fn sd_in_camera_m(&self) -> f64 {
        let of_scale_m = self.scale_sd * self.height_m;
        match self.source {
            HeightSource::Measured => (self.sd_m.powi(2) - of_scale_m.powi(2)).max(0.0).sqrt(),
            HeightSource::Given => self.sd_m.hypot(of_scale_m),
            HeightSource::Assumed => self.sd_m,
        }
    }

    /// Relative standard deviation of the scale of a camera that is assumed from this height.
    pub(super) fn relative_sd(&self) -> f64 {
        self.sd_m / self.height_m
    }

    /// How far another measurement is from it, standard deviations of the difference.
    pub(super) fn distance_sd(&self, other: &Self) -> f64 {
        (self.height_m - other.height_m).abs() / self.sd_m.hypot(other.sd_m)
    }

    /// True if it contradicts a measured height by more than three standard deviations.
    #[must_use]
    pub fn contradicts(&self, measured: &Self) -> bool {
        self.distance_sd(measured) > CONTRADICTION_SD
    }
}

/// False if a rectangle that stands on the ground is taller than a person; where it reaches down to the border of the picture,
/// its feet may be below.
pub(super) fn is_of_one_person(camera: &Camera, rectangle: &Rectangle) -> bool {
    let sighting = Sighting { time_s: 0.0, rectangle: *rectangle };
    let is_cut = rectangle.bottom + 2 >= camera.size[1] as usize;
    is_cut || height_of(camera, &sighting).is_none_or(|height_m| height_m < TALLEST_M)
}

/// True if a rectangle that stands on the ground is as tall as a person of this height.
pub(super) fn is_as_tall(camera: &Camera, rectangle: &Rectangle, height: &BodyHeight) -> bool {
    let sighting = Sighting { time_s: 0.0, rectangle: *rectangle };
    let seen = |height_m| BodyHeight { height_m, sd_m: RECTANGLE_SD_M, ..*height };
    height_of(camera, &sighting).is_some_and(|height_m| !height.contradicts(&seen(height_m)))
}

fn height_of(camera: &Camera, sighting: &Sighting) -> Option<f64> {
    let weight = PositionOptions::default().bottom_weight;
    let midpoints = person_midpoints(std::slice::from_ref(sighting), camera).ok()?;
    height_on_ground(camera, &midpoints, weight).ok()
}

/// True if a rectangle that stands on the ground can enclose a person: 1.0 to 2.4 m, or nearly as small as the smallest
/// of the given heights.
pub(super) fn is_of_a_person(
    camera: &Camera,
    sighting: &Sighting,
    given_m: impl Iterator<Item = f64>,
) -> bool {
    let least_m = given_m.map(|height_m| OF_GIVEN * height_m).fold(SMALLEST_M, f64::min);
    height_of(camera, sighting).is_some_and(|height_m| (least_m..TALLEST_M).contains(&height_m))
}

/// The height of a person whose rectangles stand on the ground; `average` walks with the share of the height by which
/// bent legs lower the crown.
pub(super) fn from_rectangles(
    camera: &Camera,
    sightings: &[Sighting],
    average: &Walker,
) -> Option<BodyHeight> {
    let midpoints = person_midpoints(sightings, camera).ok()?;
    let weight = PositionOptions::default().bottom_weight;
    let crown_m = height_on_ground(camera, &midpoints, weight).ok()?;
    let height_m = crown_m * average.body.height_m / average.level_crown_height_m();
    let off_m = (height_m - POPULATION_HEIGHT_M).abs();
    (off_m < MOST_POPULATION_SD * POPULATION_SD_M).then_some(BodyHeight {
        height_m,
        sd_m: RECTANGLE_SD_M,
        source: HeightSource::Measured,
        scale_sd: 0.0,
    })
}

/// Mean of two heights weighted by their variances, as measured.
pub(super) fn combined(a: &BodyHeight, b: &BodyHeight) -> BodyHeight {
    let [of_a, of_b] = [a, b].map(|height| height.sd_m.powi(-2));
    let height_m = (of_a * a.height_m + of_b * b.height_m) / (of_a + of_b);
    let sd_m = (of_a + of_b).sqrt().recip();
    BodyHeight { height_m, sd_m, source: HeightSource::Measured, scale_sd: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::options::{TrackerOptions, start_height};
    use super::*;
    use crate::image::Rectangle;
    use glam::DVec3;

    /// Rectangles of a person with the crown of an average walker.
    fn sightings(camera: &Camera, height_m: f64) -> Vec<Sighting> {
        let crown_m = TrackerOptions::default().walker(height_m).unwrap().level_crown_height_m();
        (0..13)
            .map(|k| {
                let foot = DVec3::new(-0.3 + 0.05 * f64::from(k), 0.4, 0.0);
                let [sole, crown] = [0.0, crown_m].map(|z| camera.project(foot + DVec3::Z * z).unwrap());
                let rectangle = Rectangle {
                    left: (sole.x - 40.0) as usize,
                    right: (sole.x + 40.0) as usize,
                    top: (crown.y - 2.0).round() as usize,
                    bottom: sole.y.round() as usize,
                };
                Sighting { time_s: 0.04 * f64::from(k), rectangle }
            })
            .collect()
    }

    fn camera() -> Camera {
        Camera::level([1280, 720], 1.08, 1.2, 5.0).unwrap()
    }

    fn measured(height_m: f64) -> BodyHeight {
        BodyHeight { height_m, sd_m: 0.04, source: HeightSource::Measured, scale_sd: 0.0 }
    }

    #[test]
    fn two_people_one_behind_the_other_are_taller_than_one() {
        let camera = Camera::level([640, 1000], 0.5, 7.0, 25.0).unwrap();
        let person = |y: f64| {
            let [sole, crown] = [0.0, 1.75].map(|z| camera.project(DVec3::new(0.2, y, z)).unwrap());
            Rectangle {
                left: sole.x as usize - 12,
                right: sole.x as usize + 12,
                top: crown.y as usize,
                bottom: sole.y as usize,
            }
        };
        let (near, far) = (person(0.0), person(8.0));
        assert!(is_of_one_person(&camera, &near) && is_of_one_person(&camera, &far));
        assert!(!is_of_one_person(&camera, &near.union(&far)));
        let cut = Rectangle { bottom: 998, ..near.union(&far) };
        assert!(is_of_one_person(&camera, &cut), "the feet are below the picture");
    }

    /// The first person is 1.70 ± 0.10 m tall, so everything beside is known to 6 %.
    #[test]
    fn a_height_measured_against_another_person_s_is_no_better_known_than_that() {
        let scale_sd = BodyHeight::POPULATION.relative_sd();
        let second = measured(1.87).on_scale(scale_sd);
        assert!((second.sd_m - 0.04f64.hypot(0.11)).abs() < 1e-12, "{second:?}");
        assert!((second.assumed_scale_sd() - 0.1 / 1.7).abs() < 1e-12, "so are its lengths");
        // A person whose height is given has its own scale, and the picture contradicts it less surely.
        let given = BodyHeight::given(1.6).on_scale(scale_sd);
        assert_eq!((given.sd_m, given.assumed_scale_sd()), (GIVEN_SD_M, 0.0));
        assert!(given.contradicts(&measured(1.87)) && !given.contradicts(&second));
        // In that camera, the measured height is as well known as in a calibrated one, and the given one is not.
        assert!((second.sd_in_camera_m() - 0.04).abs() < 1e-12);
        assert!((given.sd_in_camera_m() - GIVEN_SD_M.hypot(1.6 * scale_sd)).abs() < 1e-12);
        assert_eq!(measured(1.7).on_scale(0.0), measured(1.7));
    }

    #[test]
    fn a_calibrated_camera_shows_the_height_at_the_start() {
        let options = TrackerOptions { camera: Some(camera()), ..TrackerOptions::default() };
        for height_m in [1.5, 1.7, 1.9] {
            let found =
                start_height(&options, None, options.camera.as_ref(), &sightings(&camera(), height_m));
            assert_eq!(found.source, HeightSource::Measured);
            // A fifth of the weight is the population's.
            let expected_m = 0.8 * height_m + 0.2 * 1.7;
            assert!((found.height_m - expected_m).abs() < 0.02, "{height_m}: {found:?}");
            assert!((found.sd_m - 0.0447).abs() < 1e-4);
        }
        let small = start_height(&options, None, options.camera.as_ref(), &sightings(&camera(), 1.2));
        assert_eq!(small, BodyHeight::POPULATION, "not the height of an adult");
    }

    #[test]
    fn what_is_lower_than_adults_is_a_person_of_a_given_height_alone() {
        let is_one = |height_m: f64, given_m: &[f64]| {
            is_of_a_person(&camera(), &sightings(&camera(), height_m)[0], given_m.iter().copied())
        };
        assert!(is_one(1.7, &[]) && is_one(1.1, &[1.8]) && is_one(1.7, &[0.9]));
        assert!(!is_one(0.9, &[]) && !is_one(0.9, &[1.8]) && is_one(0.9, &[1.8, 0.95]));
        assert!(!is_one(0.5, &[0.95]) && !is_one(2.6, &[2.5]));
    }

    #[test]
    fn a_height_is_given_or_that_of_the_population_without_a_camera() {
        let seen = sightings(&camera(), 1.9);
        assert_eq!(start_height(&TrackerOptions::default(), None, None, &seen), BodyHeight::POPULATION);
        let given = start_height(&TrackerOptions::default(), Some(1.6), Some(&camera()), &seen);
        assert_eq!(given, BodyHeight::given(1.6));
    }

    #[test]
    fn heights_three_standard_deviations_apart_contradict_each_other() {
        let measured = |height_m| BodyHeight { sd_m: 0.03, ..measured(height_m) };
        let apart_m = 3.0 * 0.02f64.hypot(0.03);
        assert!(!BodyHeight::given(1.7).contradicts(&measured(1.7 + apart_m - 1e-9)));
        assert!(BodyHeight::given(1.7).contradicts(&measured(1.7 - apart_m - 1e-9)));
    }

    #[test]
    fn only_an_assumed_height_leaves_the_scale_open() {
        assert_eq!(BodyHeight::given(1.7).assumed_scale_sd(), 0.0);
        assert!((BodyHeight::POPULATION.assumed_scale_sd() - 0.1 / 1.7).abs() < 1e-12);
    }
}
