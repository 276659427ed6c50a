//! The rotation between a template and a picture: robust Gauss-Newton, inverse compositional (Baker and Matthews 2004,
//! sections 3.2 and 5; Tukey's weights as Huber 1981).
//!
//! With T the template, I the picture, R the rotation so far and W(r; R) the pixel at which the turned camera sees the ray
//! r, every round solves, weighted,
//!
//! ```text
//! I(W(r; R)) - (a T(r) + b)  =  a S(r) w + da T(r) + db
//! ```
//!
//! for the rotation vector w and for changes of the gain a and offset b, which a flickering lamp and automatic exposure
//! need, and composes R <- R exp(w)^-1. S is computed once per template.

use super::Turned;
use super::pyramid::{Pyramid, at_level};
use super::template::{Point, Template, flow_per_turn, pixel_of};
use crate::estimate::median::median;
use crate::image::Frame;
use crate::model::Camera;
use glam::{DMat3, DQuat, DVec2, DVec3};
use nalgebra::{SMatrix, SVector};

/// Rounds per level.
const MOST_ROUNDS: usize = 12;
/// Rounds end at a step of this many pixels of the level: of the coarser levels, and of the finest.
const SMALL_STEPS_PX: [f64; 2] = [0.02, 0.003];
/// Tukey's constant, in standard deviations: 95 % efficient for normal residuals.
const TUKEY: f64 = 4.685;
/// Smallest standard deviation of the residuals, grey levels: that of rounding, and of the codec.
const LEAST_SD: f64 = 1.0;
/// A point supports the rotation if its residual is below that of a shift by this many pixels, ...
const SUPPORT_PX: f64 = 0.5;
/// ... or below this many grey levels, and if the picture has at least this share of the point's gradient there. The
/// noise of a codec on a plain wall passes the first test, but its gradients are others in the next frame.
const SUPPORT_GREY: f64 = 6.0;
const SUPPORT_GRADIENT: f64 = 0.4;
/// Fewest points seen in the picture, as a share of the template's.
const LEAST_SEEN: f64 = 0.25;
/// The gain between template and picture is within this factor.
const MOST_GAIN: f64 = 3.0;
/// Standard deviation of the displacement, largest over the corners, above which a rotation is not determined, pixels.
const MOST_SD_PX: f64 = 0.15;
/// Reach of the search for a sudden jump, pixels of the coarsest level, and the number of points it uses.
const JUMP_REACH_PX: i32 = 12;
const JUMP_POINTS: usize = 300;
/// Residuals beyond this many grey levels count alike in that search.
const JUMP_CAP: f64 = 24.0;

/// An estimate with what supports it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// `picture_from_template`: rotates rays of the template's camera into the picture's.
    pub rotation: Turned,
    /// Contrast and brightness of the picture against the template: I = gain T + offset.
    pub gain: f64,
    pub offset: f64,
    /// Share of the points seen that the rotation explains within half a pixel.
    pub support: f64,
    /// Standard deviation of the displacement, the largest over the corners of the picture, pixels.
    pub sd_px: f64,
    /// Relative change of the focal length that the residuals show, and its standard deviation.
    pub zoom: [f64; 2],
}

impl Estimate {
    const START: Self = Self {
        rotation: DMat3::IDENTITY,
        gain: 1.0,
        offset: 0.0,
        support: 0.0,
        sd_px: f64::INFINITY,
        zoom: [0.0, f64::INFINITY],
    };

    /// True if the rotation is determined and explains at least this share of the points.
    pub fn is_supported(&self, least: f64) -> bool {
        self.support >= least && self.sd_px <= MOST_SD_PX
    }
}

/// A picture to which templates are compared, with the camera that took both.
#[derive(Debug)]
pub struct Comparison<'a> {
    pub pyramid: &'a Pyramid<'a>,
    pub camera: &'a Camera,
}

/// A residual: index of the point, grey value in the picture, residual.
struct Residual {
    point: usize,
    off: f64,
}

impl Comparison<'_> {
    /// The rotation, from the coarsest of the `levels` finest ones on, starting at `from`; `None` if too little of the
    /// template is in the picture or the equations are singular.
    pub fn estimate(&self, template: &Template, from: &Turned, levels: usize) -> Option<Estimate> {
        let mut at = Estimate { rotation: *from, ..Estimate::START };
        for level in (0..levels).rev() {
            for round in 0..MOST_ROUNDS {
                let is_first = round == 0 && level + 1 == levels;
                let step_px = self.round(&template.levels[level], level, is_first, &mut at)?;
                if step_px < SMALL_STEPS_PX[usize::from(level == 0)] {
                    break;
                }
            }
        }
        self.judge(&template.levels[0], &mut at)?;
        (1.0 / MOST_GAIN..MOST_GAIN).contains(&at.gain).then_some(at)
    }

    /// A rotation as it is, without a change of brightness.
    pub fn of(&self, template: &Template, rotation: &Turned) -> Option<Estimate> {
        let mut at = Estimate { rotation: *rotation, ..Estimate::START };
        self.judge(&template.levels[0], &mut at)?;
        Some(at)
    }

    /// The rotation by the finest level alone if it is supported by `expected`; otherwise by all levels, if that is
    /// supported more. Where a wall has fine texture only, the coarse levels show people rather than the wall.
    pub fn near(&self, template: &Template, from: &Turned, expected: f64) -> Option<Estimate> {
        let fine = self.estimate(template, from, 1);
        if fine.is_some_and(|found| found.support >= expected) {
            return fine;
        }
        let coarse = self.estimate(template, from, self.pyramid.levels());
        match (fine, coarse) {
            (Some(fine), Some(coarse)) if coarse.support <= fine.support => Some(fine),
            (fine, coarse) => coarse.or(fine),
        }
    }

    /// One round; returns the step in pixels of the level.
    fn round(&self, points: &[Point], level: usize, is_first: bool, at: &mut Estimate) -> Option<f64> {
        let mut residuals = self.residuals(points, level, at)?;
        if is_first {
            // A change of brightness is no motion.
            let middle = median(&mut residuals.iter().map(|r| r.off).collect::<Vec<_>>()).unwrap_or(0.0);
            residuals.iter_mut().for_each(|r| r.off -= middle);
            at.offset += middle;
        }
        let cut = TUKEY * robust_sd(&residuals);
        let equations = Equations::<5>::new(points, &residuals, cut, row);
        let step = equations.normal.cholesky()?.solve(&equations.right);
        at.gain += step[3] / GREY_UNIT;
        at.offset += step[4] - step[3] / GREY_UNIT * GREY_MIDDLE;
        let turn = DVec3::new(step[0], step[1], step[2]) / at.gain.max(0.1);
        at.rotation *= DMat3::from_quat(DQuat::from_scaled_axis(turn)).transpose();
        let scale = f64::from(1u32 << level);
        (turn.is_finite() && turn.length() < 0.5)
            .then(|| turn.length() * self.camera.focal_px.max_element() / scale)
    }

    /// Support, uncertainty and zoom at the end, on the finest level.
    fn judge(&self, points: &[Point], at: &mut Estimate) -> Option<()> {
        let residuals = self.residuals(points, 0, at)?;
        let supports = |r: &&Residual| self.is_supporting(&points[r.point], r.off, at);
        at.support = residuals.iter().filter(supports).count() as f64 / residuals.len() as f64;
        let sd = robust_sd(&residuals);
        let equations = Equations::<6>::new(points, &residuals, TUKEY * sd, |p| {
            let [x, y, z, grey, one] = row(p);
            [x, y, z, grey, one, p.per_zoom]
        });
        let factor = equations.normal.cholesky()?;
        let covariance = factor.inverse() * (sd * sd / (at.gain * at.gain));
        at.zoom = [factor.solve(&equations.right)[5] / at.gain, covariance[(5, 5)].sqrt()];
        let turn = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        at.sd_px = self.corners().map(|plane| displacement_sd(self.camera, &turn, plane)).fold(0.0, f64::max);
        Some(())
    }

    /// True if the picture has the grey value and the gradient of a point where the rotation shows it.
    fn is_supporting(&self, p: &Point, off: f64, at: &Estimate) -> bool {
        let steep = at.gain * p.gradient;
        if off.abs() > (SUPPORT_PX * steep).max(SUPPORT_GREY) {
            return false;
        }
        let frame = self.pyramid.level(0);
        let along = |step: DVec2| {
            let pixel = pixel_of(self.camera, &at.rotation, p.ray)? + step;
            frame.between(pixel)
        };
        let rise = along(p.uphill).zip(along(-p.uphill)).map(|(above, below)| (above - below) / 2.0);
        rise.is_some_and(|rise| rise >= SUPPORT_GRADIENT * steep)
    }

    /// The corners of the picture on the normalised plane, without the lens.
    fn corners(&self) -> impl Iterator<Item = DVec2> {
        let [width, height] = self.camera.size.map(f64::from);
        let corners = [[0.0, 0.0], [width, 0.0], [0.0, height], [width, height]];
        corners.into_iter().map(|c| (DVec2::from(c) - self.camera.centre_px) / self.camera.focal_px)
    }

    /// Residuals of all points that the picture shows.
    fn residuals(&self, points: &[Point], level: usize, at: &Estimate) -> Option<Vec<Residual>> {
        let frame = self.pyramid.level(level);
        let of = |(point, p): (usize, &Point)| {
            let pixel = pixel_of(self.camera, &at.rotation, p.ray)?;
            let grey = frame.between(DVec2::new(at_level(pixel.x, level), at_level(pixel.y, level)))?;
            Some(Residual { point, off: grey - at.gain * p.grey - at.offset })
        };
        let residuals: Vec<Residual> = points.iter().enumerate().filter_map(of).collect();
        let is_enough = residuals.len() as f64 >= LEAST_SEEN * points.len() as f64 && residuals.len() > 20;
        is_enough.then_some(residuals)
    }

    /// The rotation nearest to `from` by pan and tilt whose coarsest picture agrees best, for a sudden jump.
    pub fn jump(&self, template: &Template, from: &Turned) -> Turned {
        let level = self.pyramid.levels() - 1;
        let frame = self.pyramid.level(level);
        let points = &template.levels[level];
        let every = points.len().div_ceil(JUMP_POINTS);
        let place = |p: &Point| {
            let pixel = pixel_of(self.camera, from, p.ray)?;
            Some((at_level(pixel.x, level), at_level(pixel.y, level), p.grey))
        };
        let places: Vec<(f64, f64, f64)> = points.iter().step_by(every).filter_map(place).collect();
        let mut best = (f64::INFINITY, 0, 0);
        for dy in -JUMP_REACH_PX..=JUMP_REACH_PX {
            for dx in -JUMP_REACH_PX..=JUMP_REACH_PX {
                let cost = jump_cost(&frame, &places, dx, dy);
                if cost < best.0 {
                    best = (cost, dx, dy);
                }
            }
        }
        let scale = f64::from(1u32 << level);
        let shift = DVec2::new(f64::from(best.1), f64::from(best.2)) * scale / self.camera.focal_px;
        DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(-shift.y, shift.x, 0.0))) * *from
    }
}

/// Mean capped residual at the nearest pixels after a shift; pixels outside count as capped.
fn jump_cost(frame: &Frame<'_>, places: &[(f64, f64, f64)], dx: i32, dy: i32) -> f64 {
    let cost = |&(x, y, grey): &(f64, f64, f64)| {
        let (x, y) = (x.round() as i32 + dx, y.round() as i32 + dy);
        let is_inside = x >= 0 && y >= 0 && (x as usize) < frame.width() && (y as usize) < frame.height();
        let off = |x: i32, y: i32| (f64::from(frame.at(x as usize, y as usize)) - grey).abs().min(JUMP_CAP);
        if is_inside { off(x, y) } else { JUMP_CAP }
    };
    places.iter().map(cost).sum::<f64>() / places.len().max(1) as f64
}

/// Grey values are centred and scaled in the equations, so that all unknowns have sizes alike.
const GREY_MIDDLE: f64 = 128.0;
const GREY_UNIT: f64 = 64.0;

/// The coefficients of the unknowns (w, gain, offset) of a point.
fn row(point: &Point) -> [f64; 5] {
    let [x, y, z] = point.per_turn.to_array();
    [x, y, z, (point.grey - GREY_MIDDLE) / GREY_UNIT, 1.0]
}

/// Weighted normal equations.
struct Equations<const N: usize> {
    normal: SMatrix<f64, N, N>,
    right: SVector<f64, N>,
}

impl<const N: usize> Equations<N> {
    fn new(points: &[Point], residuals: &[Residual], cut: f64, row: impl Fn(&Point) -> [f64; N]) -> Self {
        let (mut normal, mut right) = ([[0.0; N]; N], [0.0; N]);
        for residual in residuals.iter().filter(|r| r.off.abs() < cut) {
            let part = 1.0 - (residual.off / cut).powi(2);
            let (weight, of) = (part * part, row(&points[residual.point]));
            for i in 0..N {
                let weighted = weight * of[i];
                right[i] += weighted * residual.off;
                for j in 0..=i {
                    normal[i][j] += weighted * of[j];
                }
            }
        }
        let whole = |i: usize, j: usize| if j <= i { normal[i][j] } else { normal[j][i] };
        Self { normal: SMatrix::from_fn(whole), right: SVector::from(right) }
    }
}

/// Standard deviation of the displacement of a pixel, given the covariance of the rotation vector.
fn displacement_sd(camera: &Camera, turn: &SMatrix<f64, 3, 3>, plane: DVec2) -> f64 {
    let variance = |of: DVec3, focal_px: f64| {
        let of = SVector::<f64, 3>::from(of.to_array()) * focal_px;
        (of.transpose() * turn * of)[0]
    };
    let [of_x, of_y] = flow_per_turn(plane);
    (variance(of_x, camera.focal_px.x) + variance(of_y, camera.focal_px.y)).sqrt()
}

/// 1.4826 times the median of the absolute residuals, at least [`LEAST_SD`].
fn robust_sd(residuals: &[Residual]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(|r| r.off.abs()).collect();
    (1.4826 * median(&mut sizes).unwrap_or(0.0)).max(LEAST_SD)
}
