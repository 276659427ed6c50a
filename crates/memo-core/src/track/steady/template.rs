//! What of a picture shows a rotation of the camera: pixels of strong gradient, spread over the picture.
//!
//! A ray r = (x, y, 1) of a camera that turns by a small rotation vector w appears at
//!
//! ```text
//! dx = -x y w_x + (1 + x^2) w_y - y w_z
//! dy = -(1 + y^2) w_x + x y w_y + x w_z
//! ```
//!
//! (Longuet-Higgins and Prazdny 1980, the part that does not depend on depth). With the gradient of the picture and the
//! derivative of the lens this gives the steepest-descent image S of the inverse compositional algorithm (Baker and
//! Matthews 2004, eq. 35): the change of a pixel's grey value per radian.

use super::pyramid::{Pyramid, at_finest};
use super::{SteadyError, Turned};
use crate::image::Frame;
use crate::model::Camera;
use glam::{DVec2, DVec3};

/// About this many tiles cover a picture; points come from every tile with texture, so no part of the scene decides
/// alone.
const TILES: f64 = 1200.0;
/// Smallest side of a tile, pixels.
const LEAST_TILE_PX: usize = 8;
/// Points taken from a tile of the finest level and of the others.
const POINTS_PER_TILE: [usize; 2] = [5, 3];
/// Gradients below this are noise, grey levels per pixel; or below this many standard deviations of the noise, of which
/// a gradient has 0.43 along each axis.
const LEAST_GRADIENT: f64 = 6.0;
const LEAST_GRADIENT_SDS: f64 = 3.0;
/// A template needs this many points at every level.
const LEAST_POINTS: usize = 60;
/// So many points are wanted in this share of the cells of the picture, 16 by 12. Before a plain wall all gradients are
/// the person's, whose motion would be taken for that of the camera, and those that a codec leaves. Of the clips measured,
/// textured ones have 0.53 and more, drawn ones with a plain wall 0.19 and less.
const LEAST_CELLS: f64 = 0.5;
const POINTS_PER_CELL: usize = 5;
const CELLS: [usize; 2] = [16, 12];

/// A pixel of the template.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Its ray in the template's camera, (x, y, 1).
    pub ray: DVec3,
    /// Its grey value.
    pub grey: f64,
    /// Its gradient, grey levels per pixel of its level, and the direction of it.
    pub gradient: f64,
    pub uphill: DVec2,
    /// S: change of the grey value per radian of rotation.
    pub per_turn: DVec3,
    /// Change of the grey value per relative change of the focal length.
    pub per_zoom: f64,
}

/// The points of every level, the finest first.
#[derive(Debug, Clone)]
pub struct Template {
    pub levels: Vec<Vec<Point>>,
}

impl Template {
    /// The points of a picture.
    pub fn new(pyramid: &Pyramid<'_>, camera: &Camera) -> Result<Self, SteadyError> {
        let levels: Vec<Vec<Point>> =
            (0..pyramid.levels()).map(|level| points(&pyramid.level(level), level, camera)).collect();
        let fewest = levels.iter().map(Vec::len).min().unwrap_or(0);
        if fewest < LEAST_POINTS {
            return Err(SteadyError::NoTexture { points: fewest, needed: LEAST_POINTS });
        }
        let share = cells_with_points(&levels[0], camera);
        if share < LEAST_CELLS {
            return Err(SteadyError::PlainPicture { share, needed: LEAST_CELLS });
        }
        Ok(Self { levels })
    }
}

/// Share of the cells of the picture that contain enough points.
fn cells_with_points(points: &[Point], camera: &Camera) -> f64 {
    let mut counts = [0; CELLS[0] * CELLS[1]];
    for pixel in points.iter().filter_map(|point| pixel_of(camera, &Turned::IDENTITY, point.ray)) {
        let part = |at: f64, side: u32, count: usize| {
            ((at.max(0.0) / f64::from(side) * count as f64) as usize).min(count - 1)
        };
        let [across, down] = CELLS;
        let cell = part(pixel.y, camera.size[1], down) * across + part(pixel.x, camera.size[0], across);
        counts[cell] += 1;
    }
    counts.iter().filter(|count| **count >= POINTS_PER_CELL).count() as f64 / counts.len() as f64
}

/// Standard deviation of the noise, from the median of the filter that cancels planes and edges (Immerkaer 1996);
/// texture in more than half of the picture enlarges it.
fn noise_sd_of_one(frame: &Frame<'_>) -> f64 {
    let step = ((frame.width() * frame.height()) as f64 / 4096.0).sqrt().max(1.0) as usize;
    let mut found: Vec<i32> = Vec::with_capacity(8192);
    for y in (1..frame.height() - 1).step_by(step) {
        let [above, here, below] = [frame.row(y - 1), frame.row(y), frame.row(y + 1)];
        for x in (1..frame.width() - 1).step_by(step) {
            let second = |row: &[u8]| i32::from(row[x - 1]) - 2 * i32::from(row[x]) + i32::from(row[x + 1]);
            found.push((second(above) - 2 * second(here) + second(below)).abs());
        }
    }
    let middle = found.len() / 2;
    f64::from(*found.select_nth_unstable(middle).1) / (0.6745 * 6.0)
}

/// The strongest gradients of every tile.
fn points(frame: &Frame<'_>, level: usize, camera: &Camera) -> Vec<Point> {
    let (width, height) = (frame.width(), frame.height());
    if width < 8 || height < 8 {
        return Vec::new();
    }
    let side = ((width * height) as f64 / TILES).sqrt().ceil().max(LEAST_TILE_PX as f64) as usize;
    let least = (LEAST_GRADIENT_SDS * noise_sd_of_one(frame)).max(LEAST_GRADIENT);
    let taken = POINTS_PER_TILE[level.min(1)];
    let mut all = Vec::new();
    let mut tile = Vec::with_capacity(side * side);
    for top in (2..height - 2).step_by(side) {
        for left in (2..width - 2).step_by(side) {
            tile.clear();
            for y in top..(top + side).min(height - 2) {
                for x in left..(left + side).min(width - 2) {
                    let length_sq = gradient(frame, x, y).length_squared();
                    if length_sq >= least * least {
                        tile.push((length_sq, x, y));
                    }
                }
            }
            tile.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then((a.2, a.1).cmp(&(b.2, b.1))));
            all.extend(tile.iter().take(taken).filter_map(|&(_, x, y)| point(frame, [x, y], level, camera)));
        }
    }
    all
}

/// Sobel's gradient, grey levels per pixel.
fn gradient(frame: &Frame<'_>, x: usize, y: usize) -> DVec2 {
    let [above, here, below] = [frame.row(y - 1), frame.row(y), frame.row(y + 1)];
    let at = |row: &[u8], x: usize| i32::from(row[x]);
    let column = |x: usize| at(above, x) + 2 * at(here, x) + at(below, x);
    let line = |row: &[u8]| at(row, x - 1) + 2 * at(row, x) + at(row, x + 1);
    DVec2::new(f64::from(column(x + 1) - column(x - 1)), f64::from(line(below) - line(above))) / 8.0
}

/// The point of a pixel; `None` where the lens has no ideal pixel.
fn point(frame: &Frame<'_>, [x, y]: [usize; 2], level: usize, camera: &Camera) -> Option<Point> {
    let pixel = DVec2::new(at_finest(x as f64, level), at_finest(y as f64, level));
    let ideal = camera.undistort(pixel).ok()?;
    let gradient_px = gradient(frame, x, y);
    let per_ideal = camera.distortion_slope(ideal)?.transpose() * gradient_px / f64::from(1u32 << level);
    let plane = (ideal - camera.centre_px) / camera.focal_px;
    let [of_x, of_y] = flow_per_turn(plane);
    let per_turn = of_x * per_ideal.x * camera.focal_px.x + of_y * per_ideal.y * camera.focal_px.y;
    Some(Point {
        ray: plane.extend(1.0),
        grey: f64::from(frame.at(x, y)),
        gradient: gradient_px.length(),
        uphill: gradient_px.normalize_or_zero(),
        per_turn,
        per_zoom: per_ideal.dot(ideal - camera.centre_px),
    })
}

/// dx and dy of the module's equation, as vectors of the coefficients of w.
pub fn flow_per_turn(plane: DVec2) -> [DVec3; 2] {
    let DVec2 { x, y } = plane;
    [DVec3::new(-x * y, 1.0 + x * x, -y), DVec3::new(-1.0 - y * y, x * y, x)]
}

/// The ray of a pixel of the finest level, (x, y, 1) in the camera's axes; `None` where the lens has no ideal pixel.
pub fn ray_of(camera: &Camera, pixel: DVec2) -> Option<DVec3> {
    Some(((camera.undistort(pixel).ok()? - camera.centre_px) / camera.focal_px).extend(1.0))
}

/// The pixel of the finest level at which a turned camera sees a ray; `None` behind the camera or beyond its lens.
pub fn pixel_of(camera: &Camera, turned: &Turned, ray: DVec3) -> Option<DVec2> {
    let seen = *turned * ray;
    if seen.z <= 0.0 {
        return None;
    }
    camera.distort(seen.truncate() / seen.z * camera.focal_px + camera.centre_px)
}
