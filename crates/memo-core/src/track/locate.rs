//! The path from the rectangles of a person: depth, direction and speed (Rohr 1994, sections 4.2 and 6).
//!
//! As in the paper, [`locate`] assumes that the person walks parallel to the image plane on level ground;
//! [`locate_slanting`] finds oblique paths. A single rectangle is not accurate (arms and feet move its centre by
//! 7-10 cm, reflections change the depth by half a metre), so rows are pooled over the frames before they become
//! a depth.

use super::decisions::SLANT_M;
use super::search::Path;
use crate::estimate::line::line_through;
use crate::image::Rectangle;
use crate::model::position::{
    FootPosition, Midpoints, PositionError, PositionOptions, position_from_feet, position_from_head,
    position_on_ground,
};
use crate::model::{Camera, CameraError, Tilt};
use glam::{DVec2, DVec3};
use thiserror::Error;

/// Why no path was found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LocateError {
    /// No frame shows the person.
    #[error("a person must be sighted in at least one frame, got none")]
    NoSighting,
    /// The rectangles do not fit a person standing on the ground in front of this camera.
    #[error(transparent)]
    Position(#[from] PositionError),
    /// No camera could be made from the person.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The height of the person in the image does not fit the distance found.
    #[error(
        "a person {height_m} m tall would stand {distance_m:.1} m away, where the image should show {expected_px:.0} px, not {got_px:.0} px; check height and camera"
    )]
    Size {
        /// Body height, metres.
        height_m: f64,
        /// Distance found, metres.
        distance_m: f64,
        /// Pixels that such a person would span at that distance.
        expected_px: f64,
        /// Pixels measured.
        got_px: f64,
    },
}

/// The bounding rectangle of a person in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sighting {
    /// Time of the frame, seconds.
    pub time_s: f64,
    /// The rectangle of the moving region.
    pub rectangle: Rectangle,
}

impl Sighting {
    /// Row of the crown, pixels.
    pub(super) fn crown_px(&self) -> f64 {
        self.rectangle.top as f64 + MASK_MARGIN_PX
    }
}

/// The 5x5 windows of eq. (1) mark pixels this far outside the person's upper edge.
pub(super) const MASK_MARGIN_PX: f64 = 2.0;
/// Shadows and reflections move the bottom row down and nothing moves it up, so a low quantile is the row of the
/// soles. It needs no margin: shoes change less than hair does, and the far foot is higher in the image than the
/// near one.
const SOLE_QUANTILE: f64 = 0.3;
/// The crown moves up and down symmetrically about its median row.
const CROWN_QUANTILE: f64 = 0.5;

/// The bottom row is not used if its depth is smaller than the crown's by more than this many standard
/// deviations.
const REFLECTION_SD: f64 = 1.0;

/// The rows of a person are at least this share of the height apart, and at most the next.
const WHOLE_SHARE: f64 = 0.67;
const LARGEST_SHARE: f64 = 1.5;
/// The least share if only one of the rows is used: of somebody before a wall of the colour of the clothes, the legs may
/// be all that changes.
const LEGS_SHARE: f64 = 0.5;

/// Row of the soles and of the crown over all sightings, pixels.
///
/// # Errors
///
/// There is no sighting.
pub fn person_rows(sightings: &[Sighting]) -> Result<(f64, f64), LocateError> {
    if sightings.is_empty() {
        return Err(LocateError::NoSighting);
    }
    let rows =
        |row: fn(&Rectangle) -> usize| sightings.iter().map(|s| row(&s.rectangle) as f64).collect::<Vec<_>>();
    let sole = quantile(rows(|r| r.bottom), SOLE_QUANTILE);
    let crown = quantile(rows(|r| r.top), CROWN_QUANTILE) + MASK_MARGIN_PX;
    Ok((sole, crown))
}

/// A quantile of at least one value.
fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = q * (values.len() as f64 - 1.0);
    let (low, high) = (values[at.floor() as usize], values[at.ceil() as usize]);
    low + at.fract() * (high - low)
}

/// The camera assumed from the sightings of one person of known height; see [`Camera::from_person`].
///
/// A tilted camera is the level one that sees soles and crown in the rows in which they would be, turned.
///
/// # Errors
///
/// There is no sighting, or the rows do not fit a person of this height.
pub fn camera_from_sightings(
    sightings: &[Sighting],
    size: [u32; 2],
    field_of_view_rad: f64,
    height_m: f64,
    tilt: &Tilt,
) -> Result<Camera, LocateError> {
    let (sole, crown) = person_rows(sightings)?;
    let middle = sightings.iter().map(column).sum::<f64>() / sightings.len() as f64;
    let level = Camera::assumed(size, field_of_view_rad)?;
    // 1. The upright line through the middle of the rectangle meets its lower and its upper side.
    let centre = DVec2::new(middle, 0.5 * (sole + crown));
    let down = tilt.down();
    let downwards = down.truncate() - down.z * (centre - level.centre_px) / level.focal_px;
    let at = |row: f64| DVec2::new(middle + downwards.x / downwards.y * (row - centre.y), row);
    // 2. Their rows in a level camera.
    let level_row = |pixel: DVec2| {
        let ray = tilt.rotation().transpose() * ((pixel - level.centre_px) / level.focal_px).extend(1.0);
        level.centre_px.y + level.focal_px.y * ray.y / ray.z
    };
    let [sole, crown] = [sole, crown].map(|row| level_row(at(row)));
    Ok(Camera::from_person(size, field_of_view_rad, height_m, sole, crown)?.tilted(tilt))
}

/// Path, positions along it and speed of a person.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// The line walked, in the direction of movement. `along` is 0 where it crosses the vertical plane of the
    /// camera's axis.
    pub path: Path,
    /// Position along the path at each sighting, metres.
    pub along_m: Vec<f64>,
    /// Mean speed along the path, m/s, never negative.
    pub speed_mps: f64,
    /// Standard deviation of the path's distance from the camera, metres.
    pub depth_sd_m: f64,
}

/// Mean height of the crown while walking, and its standard deviation, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crown {
    /// Mean height above the ground.
    pub height_m: f64,
    /// Its standard deviation.
    pub sd_m: f64,
}

/// The pooled rectangle of a person: the middles of its lower and its upper side, as an ideal camera sees them.
pub(super) fn person_midpoints(sightings: &[Sighting], camera: &Camera) -> Result<Midpoints, LocateError> {
    let (sole, crown) = person_rows(sightings)?;
    let middle = sightings.iter().map(column).sum::<f64>() / sightings.len() as f64;
    Ok(Midpoints::undistorted(camera, DVec2::new(middle, sole), DVec2::new(middle, crown))?)
}

/// Middle column of a rectangle, pixels.
fn column(sighting: &Sighting) -> f64 {
    0.5 * (sighting.rectangle.left + sighting.rectangle.right) as f64
}

/// Which row of a rectangle shows how far away a person is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Rows {
    /// Both, but the soles' not where it is that of a reflection or a shadow ([`stand`]).
    Both,
    /// The soles' alone: the changes may end below the crown.
    Soles,
    /// The crown's alone: the changes may end above the soles or below them.
    Crown,
}

impl Rows {
    fn stand(
        self,
        camera: &Camera,
        midpoints: &Midpoints,
        crown: &Crown,
    ) -> Result<FootPosition, PositionError> {
        let options = PositionOptions { height_sd_m: crown.sd_m, ..PositionOptions::default() };
        let way = match self {
            Self::Both => stand,
            Self::Soles => position_from_feet,
            Self::Crown => position_from_head,
        };
        way(camera, midpoints, crown.height_m, &options)
    }

    /// The share of the height that the rectangle shows at least.
    fn least_share(self) -> f64 {
        match self {
            Self::Both => WHOLE_SHARE,
            Self::Soles | Self::Crown => LEGS_SHARE,
        }
    }
}

/// Finds the line parallel to the image plane on which the sighted person moves.
///
/// # Errors
///
/// There is no sighting, or the rows do not fit a person of this height.
pub fn locate(sightings: &[Sighting], camera: &Camera, crown: &Crown) -> Result<Course, LocateError> {
    locate_by(Rows::Both, sightings, camera, crown)
}

/// The same by some of the rows.
pub(super) fn locate_by(
    rows: Rows,
    sightings: &[Sighting],
    camera: &Camera,
    crown: &Crown,
) -> Result<Course, LocateError> {
    // 1. Depth of the line from the pooled rows at the sightings' mean column.
    let (sole_row, crown_row) = person_rows(sightings)?;
    let midpoints = person_midpoints(sightings, camera)?;
    let foot = rows.stand(camera, &midpoints, crown)?;
    let least_share = rows.least_share();
    check_size(camera, &foot.point_in_world, crown.height_m, sole_row - crown_row, least_share)?;
    // 2. The line is parallel to the image's x axis, on the ground.
    let right = (camera.rotation.transpose() * DVec3::X).truncate().normalize_or(DVec2::X);
    let origin = camera.position().truncate();
    let depth = (foot.point_in_world.truncate() - origin).dot(right.perp());
    let mut path = Path { origin: origin + right.perp() * depth, heading_rad: right.to_angle() };
    // 3. Where the rays of the columns meet the vertical plane above the line, and the direction of movement.
    let row = 0.5 * (sole_row + crown_row);
    let places: Vec<(f64, f64)> =
        sightings.iter().map(|s| (s.time_s, place(camera, &path, column(s), row))).collect();
    let (speed, _) = line_through(&places);
    if speed < 0.0 {
        path.heading_rad += std::f64::consts::PI;
    }
    let along_m = places.iter().map(|(_, along)| along * speed.signum()).collect();
    Ok(Course { path, along_m, speed_mps: speed.abs(), depth_sd_m: foot.depth_sd_m })
}

/// Finds the oblique path of a person who approaches or moves away; `None` if the sightings do not show one
/// clearly.
///
/// This goes beyond the paper, whose walkers move parallel to the image plane. `along_m` has one value per
/// sighting.
pub fn locate_slanting(sightings: &[Sighting], camera: &Camera, crown: &Crown) -> Option<Course> {
    let third = sightings.len() / 3;
    if third == 0 {
        return None;
    }
    // 1. Position of the first and the last third, each on its own line parallel to the image plane.
    let standing = |part: &[Sighting]| {
        let course = locate(part, camera, crown).ok()?;
        let along = course.along_m.iter().sum::<f64>() / part.len() as f64;
        Some((course.path.point(along, 0.0).truncate(), course.depth_sd_m))
    };
    let (start, depth_sd_m) = standing(&sightings[..third])?;
    let (end, _) = standing(&sightings[sightings.len() - third..])?;
    // 2. The line through both, if they differ enough in depth.
    let view = (camera.rotation.transpose() * DVec3::Z).truncate().normalize_or(DVec2::Y);
    if (end - start).dot(view).abs() < SLANT_M {
        return None;
    }
    let path = Path { origin: start, heading_rad: (end - start).to_angle() };
    // 3. Positions along it.
    let (sole_row, crown_row) = person_rows(sightings).ok()?;
    let row = 0.5 * (sole_row + crown_row);
    let places: Vec<(f64, f64)> =
        sightings.iter().map(|s| (s.time_s, place(camera, &path, column(s), row))).collect();
    let (speed_mps, _) = line_through(&places);
    Some(Course {
        path,
        along_m: places.into_iter().map(|(_, along)| along).collect(),
        speed_mps,
        depth_sd_m,
    })
}

/// Where the person of one rectangle stands, by some of its rows.
pub(super) fn foot(
    rows: Rows,
    sighting: &Sighting,
    camera: &Camera,
    crown: &Crown,
) -> Result<FootPosition, LocateError> {
    let midpoints = person_midpoints(std::slice::from_ref(sighting), camera)?;
    Ok(rows.stand(camera, &midpoints, crown)?)
}

/// The position from both rows, weighted. If the depth from the soles is much smaller than that from the crown,
/// the bottom row belongs to a reflection or a shadow, which are always below the feet, and only the crown is
/// used.
fn stand(
    camera: &Camera,
    midpoints: &Midpoints,
    height_m: f64,
    options: &PositionOptions,
) -> Result<FootPosition, PositionError> {
    let (feet, head) = (
        position_from_feet(camera, midpoints, height_m, options),
        position_from_head(camera, midpoints, height_m, options),
    );
    if let (Ok(feet), Ok(head)) = (feet, head)
        && head.depth_m - feet.depth_m > REFLECTION_SD * feet.depth_sd_m.hypot(head.depth_sd_m)
    {
        return Ok(head);
    }
    position_on_ground(camera, midpoints, height_m, options)
}

/// Distance along the path, metres, at which the ray of a pixel meets the vertical plane above the path.
pub(crate) fn place(camera: &Camera, path: &Path, column_px: f64, row_px: f64) -> f64 {
    let pixel = DVec2::new(column_px, row_px);
    let ray = camera.ray_in_world(camera.undistort(pixel).unwrap_or(pixel)).truncate();
    let across = path.direction().perp();
    let eye = camera.position().truncate();
    let t = (path.origin - eye).dot(across) / ray.dot(across);
    path.along(eye + t * ray)
}

/// The rows must agree with the height. They do not if the person is cut off or a unit is wrong.
fn check_size(
    camera: &Camera,
    foot: &DVec3,
    height_m: f64,
    got_px: f64,
    least_share: f64,
) -> Result<(), LocateError> {
    let expected_px = camera.pixel_height_at(*foot, height_m).unwrap_or(0.0);
    if (least_share..LARGEST_SHARE).contains(&(got_px / expected_px)) {
        return Ok(());
    }
    let distance_m = (*foot - camera.position()).length();
    Err(LocateError::Size { height_m, distance_m, expected_px, got_px })
}

/// True if two rectangles of neighbouring frames can enclose the same person.
pub(super) fn same_person(a: &Rectangle, b: &Rectangle) -> bool {
    let ratio = a.height() as f64 / b.height() as f64;
    a.gap(b) == [0, 0] && (0.6..1.6).contains(&ratio)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Distortion;

    fn sightings(camera: &Camera, depth: f64, speed: f64, height_m: f64) -> Vec<Sighting> {
        (0..13)
            .map(|k| {
                let time_s = f64::from(k) * 0.04;
                let foot = DVec3::new(0.3 + speed * time_s, depth, 0.0);
                let at = |z: f64| camera.project(foot + DVec3::Z * z).unwrap();
                let (sole, crown) = (at(0.0), at(height_m));
                let rectangle = Rectangle {
                    left: (sole.x - 40.0) as usize,
                    right: (sole.x + 40.0) as usize,
                    top: (crown.y - MASK_MARGIN_PX).round() as usize,
                    bottom: sole.y.round() as usize,
                };
                Sighting { time_s, rectangle }
            })
            .collect()
    }

    fn crown(height_m: f64) -> Crown {
        Crown { height_m, sd_m: 0.02 }
    }

    #[test]
    fn nobody_is_nowhere() {
        let camera = Camera::level([640, 480], 1.0, 1.2, 5.0).unwrap();
        assert_eq!(person_rows(&[]), Err(LocateError::NoSighting));
        assert_eq!(locate(&[], &camera, &crown(1.7)), Err(LocateError::NoSighting));
        let camera = camera_from_sightings(&[], [640, 480], 1.0, 1.7, &Tilt::default());
        assert_eq!(camera, Err(LocateError::NoSighting));
    }

    fn sighted(left: usize, top: usize, right: usize, bottom: usize) -> Sighting {
        Sighting { time_s: 0.0, rectangle: Rectangle { left, top, right, bottom } }
    }

    #[test]
    fn a_quantile_lies_between_the_sorted_values() {
        let values = vec![30.0, 10.0, 50.0, 20.0, 40.0];
        for (q, value) in [(0.0, 10.0), (0.25, 20.0), (0.3, 22.0), (0.5, 30.0), (0.9, 46.0), (1.0, 50.0)] {
            assert!((quantile(values.clone(), q) - value).abs() < 1e-12, "{q}");
        }
        assert_eq!(quantile(vec![7.0], 0.3), 7.0);
    }

    #[test]
    fn the_sole_is_a_low_bottom_row_and_the_crown_the_middle_top_row_inside_the_mask() {
        let bottoms = [400, 402, 404, 406, 408, 410, 470, 480, 490, 460, 450];
        let tops = [100, 103, 106, 109, 112, 115, 118, 121, 124, 127, 130];
        let seen: Vec<_> = bottoms.iter().zip(tops).map(|(b, t)| sighted(10, t, 60, *b)).collect();
        // 30 % of the way through 400, 402, ... and 50 % through the tops; the windows of eq. (1) extend 2 px
        // out.
        assert_eq!(person_rows(&seen), Ok((406.0, 117.0)));
    }

    #[test]
    fn a_planted_course_is_recovered_in_both_directions() {
        let camera = Camera::level([1280, 720], 1.08, 1.2, 5.0).unwrap();
        for speed in [1.4, -1.2] {
            let course = locate(&sightings(&camera, 0.5, speed, 1.8), &camera, &crown(1.8)).unwrap();
            assert!((course.path.origin.y - 0.5).abs() < 0.05, "{course:?}");
            assert!((course.speed_mps - speed.abs()).abs() < 0.05, "{course:?}");
            let start = course.path.point(course.along_m[0], 0.0);
            assert!((start.x - 0.3).abs() < 0.03, "{start}");
            assert!((course.path.direction().x - speed.signum()).abs() < 1e-9);
        }
    }

    #[test]
    fn reflections_below_the_feet_move_the_depth_little() {
        let camera = Camera::level([1280, 720], 1.08, 1.2, 5.0).unwrap();
        let mut seen = sightings(&camera, 0.0, 1.4, 1.8);
        for reflected in [2, 1] {
            seen.iter_mut().step_by(reflected).for_each(|s| s.rectangle.bottom += 60);
            let course = locate(&seen, &camera, &crown(1.8)).unwrap();
            assert!(course.path.origin.y.abs() < 0.15, "{course:?}");
        }
    }

    #[test]
    fn a_camera_made_from_the_person_puts_the_walk_on_its_origin() {
        let truth = Camera::level([640, 480], 1.0, 1.1, 6.0).unwrap();
        let seen = sightings(&truth, 0.0, 1.4, 1.7);
        let camera = camera_from_sightings(&seen, [640, 480], 1.0, 1.7, &Tilt::default()).unwrap();
        let course = locate(&seen, &camera, &crown(1.7)).unwrap();
        assert!(course.path.origin.length() < 0.05 && (course.speed_mps - 1.4).abs() < 0.05, "{course:?}");
    }

    #[test]
    fn a_tilted_camera_is_made_from_the_person() {
        for (roll_rad, pitch_rad, x_m) in [(0.1, 0.0, -0.6), (-0.07, 0.25, 0.0), (0.05, -0.1, -0.3)] {
            let tilt = Tilt { roll_rad, pitch_rad };
            let truth = Camera::level([640, 480], 1.0, 1.1, 6.0).unwrap().tilted(&tilt);
            let mut seen = sightings(&truth, 0.0, 1.4, 1.7);
            // The rectangle reaches from the foot to the head, which leans.
            for sighting in &mut seen {
                let foot = DVec3::new(x_m + 1.4 * sighting.time_s, 0.0, 0.0);
                let [sole, crown] = [0.0, 1.7].map(|z| truth.project(foot + DVec3::Z * z).unwrap());
                sighting.rectangle.left = (sole.x.min(crown.x) - 40.0) as usize;
                sighting.rectangle.right = (sole.x.max(crown.x) + 40.0) as usize;
                sighting.rectangle.top = (crown.y - MASK_MARGIN_PX).round() as usize;
                sighting.rectangle.bottom = sole.y.round() as usize;
            }
            let camera = camera_from_sightings(&seen, [640, 480], 1.0, 1.7, &tilt).unwrap();
            let off = (camera.position() - truth.position()).abs();
            assert!(off.y < 0.15 && off.z < 0.05, "{roll_rad} {pitch_rad}: {off}");
            let course = locate(&seen, &camera, &crown(1.7)).unwrap();
            assert!((course.speed_mps - 1.4).abs() < 0.06, "{course:?}");
        }
    }

    #[test]
    fn a_slanting_path_is_found_and_a_parallel_one_left_alone() {
        let camera = Camera::level([1280, 720], 1.08, 1.2, 6.0).unwrap();
        assert!(locate_slanting(&sightings(&camera, 0.0, 1.4, 1.8), &camera, &crown(1.8)).is_none());
        let slanting: Vec<Sighting> = (0..40)
            .flat_map(|k| {
                let time_s = f64::from(k) * 0.04;
                let mut one = sightings(&camera, 0.5 * time_s, 1.0, 1.8)[0];
                let foot = camera.project(DVec3::new(1.0 * time_s, 0.5 * time_s, 0.0)).unwrap();
                (one.rectangle.left, one.rectangle.right) =
                    ((foot.x - 40.0) as usize, (foot.x + 40.0) as usize);
                one.time_s = time_s;
                Some(one)
            })
            .collect();
        let course = locate_slanting(&slanting, &camera, &crown(1.8)).unwrap();
        assert!((course.path.heading_rad - 0.5f64.atan()).abs() < 0.1, "{course:?}");
        assert!((course.speed_mps - 1.25f64.sqrt()).abs() < 0.1, "{course:?}");
    }

    #[test]
    fn slight_slants_are_left_alone_and_larger_ones_found_coming_and_going() {
        let camera = Camera::level([1280, 720], 1.08, 1.2, 6.0).unwrap();
        // The middles of the first and the last third of a walk of 1.2 s are 0.8 s apart.
        for (towards_mps, found) in [(0.15, false), (-0.15, false), (0.4, true), (-0.4, true)] {
            let course = locate_slanting(&slanting(&camera, towards_mps), &camera, &crown(1.8));
            assert_eq!(course.is_some(), found, "{towards_mps} m/s: {course:?}");
            let Some(course) = course else { continue };
            assert!((course.path.heading_rad - towards_mps.atan()).abs() < 0.1, "{course:?}");
            let end = course.path.point(*course.along_m.last().unwrap(), 0.0);
            assert!((end.x - 1.2).abs() < 0.05 && (end.y - 1.2 * towards_mps).abs() < 0.15, "{end}");
        }
        assert!(locate_slanting(&slanting(&camera, 0.4)[..2], &camera, &crown(1.8)).is_none(), "no thirds");
    }

    /// Sightings over 1.2 s of a person who walks at 1 m/s to the right and at `back_mps` away from the camera.
    fn slanting(camera: &Camera, back_mps: f64) -> Vec<Sighting> {
        let at = |k: i32| {
            let time_s = f64::from(k) * 0.04;
            let foot = DVec3::new(time_s, back_mps * time_s, 0.0);
            let [sole, crown] = [0.0, 1.8].map(|z| camera.project(foot + DVec3::Z * z).unwrap());
            let rectangle = Rectangle {
                left: (sole.x - 40.0).round() as usize,
                right: (sole.x + 40.0).round() as usize,
                top: (crown.y - MASK_MARGIN_PX).round() as usize,
                bottom: sole.y.round() as usize,
            };
            Sighting { time_s, rectangle }
        };
        (0..31).map(at).collect()
    }

    /// Depth of a person whose reflection reaches `reflected` pixels below the feet: the depth used, and the
    /// depths by the feet, the crown and both.
    fn stood(camera: &Camera, reflected: f64) -> (f64, [f64; 3]) {
        let [sole, crown] = [0.0, 1.8].map(|z| camera.project(DVec3::new(0.2, 0.0, z)).unwrap());
        let midpoints = Midpoints { bottom_px: sole + reflected * DVec2::Y, top_px: crown };
        let options = PositionOptions { height_sd_m: 0.02, ..PositionOptions::default() };
        let found = stand(camera, &midpoints, 1.8, &options).unwrap().depth_m;
        let ways = [position_from_feet, position_from_head, position_on_ground];
        (found, ways.map(|way| way(camera, &midpoints, 1.8, &options).unwrap().depth_m))
    }

    #[test]
    fn only_soles_far_below_the_crown_s_place_are_taken_for_a_reflection() {
        // A high camera: crown and soles both determine a depth.
        let camera = Camera::level([1280, 720], 1.08, 2.6, 6.0).unwrap();
        let (found, [_, head, _]) = stood(&camera, 60.0);
        assert!(found == head && (found - 6.0).abs() < 0.01, "the crown alone: {found}");
        for reflected in [3.0, 0.0, -60.0] {
            let (found, [feet, head, both]) = stood(&camera, reflected);
            assert_eq!(found, both, "{reflected} px");
            assert!(found >= feet.min(head) - 1e-9 && found <= feet.max(head) + 1e-9);
        }
        // The limit between the two cases is one standard deviation of the difference.
        let options = PositionOptions { height_sd_m: 0.02, ..PositionOptions::default() };
        let excess = |reflected: f64| {
            let [sole, crown] = [0.0, 1.8].map(|z| camera.project(DVec3::new(0.2, 0.0, z)).unwrap());
            let midpoints = Midpoints { bottom_px: sole + reflected * DVec2::Y, top_px: crown };
            let feet = position_from_feet(&camera, &midpoints, 1.8, &options).unwrap();
            let head = position_from_head(&camera, &midpoints, 1.8, &options).unwrap();
            (head.depth_m - feet.depth_m) / feet.depth_sd_m.hypot(head.depth_sd_m)
        };
        let border = (0..600).map(|k| 0.1 * f64::from(k)).find(|r| excess(*r) > 1.0).unwrap();
        let (below, [_, _, both]) = stood(&camera, border - 0.3);
        let (above, [_, head, _]) = stood(&camera, border + 0.3);
        assert!(below == both && above == head, "at {border} px: {below}, {above}");
    }

    #[test]
    fn a_person_up_to_a_third_too_small_or_half_too_large_is_accepted() {
        let camera = Camera::level([640, 480], 1.0, 1.1, 6.0).unwrap();
        let foot = DVec3::new(0.3, 0.5, 0.0);
        let [sole, crown] = [0.0, 1.7].map(|z| camera.project(foot + DVec3::Z * z).unwrap().y);
        for (share, fits) in
            [(0.6, false), (0.66, false), (0.68, true), (1.0, true), (1.48, true), (1.52, false)]
        {
            let checked = check_size(&camera, &foot, 1.7, share * (sole - crown), WHOLE_SHARE);
            assert_eq!(checked.is_ok(), fits, "{share}");
            if let Err(LocateError::Size { height_m, distance_m, expected_px, got_px }) = checked {
                assert!((expected_px - (sole - crown)).abs() < 0.5 && height_m == 1.7);
                assert!((got_px / expected_px - share).abs() < 0.01);
                assert!((distance_m - foot.distance(camera.position())).abs() < 1e-9);
            }
        }
    }

    /// Compares the standard deviation with depths for rows of sole and crown and a height changed by their
    /// standard deviations.
    #[test]
    fn the_depth_s_standard_deviation_is_that_of_rows_and_height() {
        let camera = Camera::level([1280, 720], 1.08, 1.2, 6.0).unwrap();
        let seen = sightings(&camera, 0.0, 1.0, 1.8);
        let course = locate(&seen, &camera, &crown(1.8)).unwrap();
        let depth = |bottom: isize, top: isize, height_m: f64| {
            let moved: Vec<Sighting> = seen
                .iter()
                .map(|s| {
                    let r = s.rectangle;
                    let rectangle = Rectangle {
                        bottom: r.bottom.strict_add_signed(bottom),
                        top: r.top.strict_add_signed(top),
                        ..r
                    };
                    Sighting { rectangle, ..*s }
                })
                .collect();
            locate(&moved, &camera, &crown(height_m)).unwrap().path.origin.y
        };
        let at = depth(0, 0, 1.8);
        // Rows changed by their 4 and 2 px, the height by 2 cm.
        let changes = [depth(-4, 0, 1.8) - at, depth(0, 2, 1.8) - at, depth(0, 0, 1.82) - at];
        let sum = changes.iter().map(|d| d * d).sum::<f64>().sqrt();
        assert!((course.depth_sd_m / sum - 1.0).abs() < 0.15, "{} against {sum}", course.depth_sd_m);
    }

    #[test]
    fn places_are_where_the_columns_meet_the_path() {
        let mut camera = Camera::level([1280, 720], 1.08, 1.2, 6.0).unwrap();
        let path = Path { origin: DVec2::new(0.3, 0.4), heading_rad: 0.4 };
        for (along, height) in [(-0.8, 0.2), (0.0, 1.0), (0.9, 1.6)] {
            let pixel = camera.project(path.point(along, height)).unwrap();
            assert!((place(&camera, &path, pixel.x, pixel.y) - along).abs() < 1e-9);
        }
        camera.distortion = Distortion::Brown { k1: -0.2, k2: 0.05, p1: 0.0, p2: 0.0, k3: 0.0 };
        let pixel = camera.project(path.point(0.9, 1.6)).unwrap();
        assert!((place(&camera, &path, pixel.x, pixel.y) - 0.9).abs() < 1e-6);
    }

    #[test]
    fn a_height_that_cannot_be_is_refused() {
        let camera = Camera::level([640, 480], 1.0, 1.1, 6.0).unwrap();
        assert!(locate(&sightings(&camera, 0.0, 1.4, 1.7), &camera, &crown(0.5)).is_err());
    }
}
