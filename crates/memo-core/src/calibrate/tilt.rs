//! How a camera is tilted, from the vertical lines of its picture.
//!
//! Vertical edges of houses, doors, poles and bricks meet where the vertical through the camera meets the image plane.
//! With the vertical g in camera axes (x right, y down, z forward), an upright line through the point (u, v) of the
//! plane at depth 1 has the direction
//!
//! ```text
//! (g_x - u g_z, g_y - v g_z),    g = (-sin roll cos pitch, cos roll cos pitch, sin pitch).
//! ```
//!
//! No line is known to be upright. Each is so with a share w, off by a Cauchy distribution, and otherwise has any
//! direction. The likelihood of all lines, averaged over w, and the prior of people who hold cameras level give roll and
//! pitch. Without upright lines the prior remains.
//!
//! The pitch depends on the focal length: with one that is too small by a factor, its tangent is too.

use crate::image::edge::{EdgeDomain, EdgeOptions};
use crate::image::line::{EdgeSegment, LineError, LineOptions, edge_segments};
use crate::image::{Frame, Mask};
use crate::model::{Camera, CameraError, Tilt, assumed_field_of_view_rad};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use thiserror::Error;

/// Lines shorter than this tell little and are not used, pixels.
pub const MIN_LINE_PX: f64 = 12.0;
/// Faint edges count, because noise makes no long lines.
const FAINT: EdgeOptions = EdgeOptions { sigma_px: 1.0, low: 3.0, high: 7.0 };
/// At most this many lines are used, the longest.
const MOST_LINES: usize = 400;
/// Lines farther than this from the columns of the picture are not considered.
const STEEP_RAD: f64 = 45.0 * PI / 180.0;
/// Scale of the direction of an upright line about the predicted one: of every line, and over its length, pixels.
const LINE_SD_RAD: f64 = 0.4 * PI / 180.0;
const LINE_SD_PX: f64 = 0.7;
/// Shares of upright lines among the steep ones, equally likely.
const SHARES: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.4];
/// Weight of the logarithm of the likelihood: pieces of one edge are not independent.
const INDEPENDENT_SHARE: f64 = 0.25;
/// Prior of cameras on tripods and in hands: Student's distribution with three degrees of freedom of this scale for roll,
/// a normal one for pitch.
const ROLL_PRIOR_RAD: f64 = 2.0 * PI / 180.0;
const PITCH_PRIOR_RAD: f64 = 10.0 * PI / 180.0;
/// Real lines lean together, and lenses bend them. In the calibrated street of PETS 2009 the result is off by 0.7° in roll
/// and, with the true focal length, by 6° in pitch.
const ROLL_SYSTEMATIC_RAD: f64 = 0.7 * PI / 180.0;
const PITCH_SYSTEMATIC_RAD: f64 = 3.0 * PI / 180.0;
/// The tilts that are compared: half the range and the step of the coarse grid. Cells that matter are divided by
/// `FINE` in both directions.
const ROLLS: (i32, f64) = (20, 1.0 * PI / 180.0);
const PITCHES: (i32, f64) = (20, 2.0 * PI / 180.0);
const FINE: i32 = 5;
/// Cells whose logarithm is this far below the best are left out.
const NEGLIGIBLE: f64 = 10.0;

/// The tilt of a camera, estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltEstimate {
    /// The mean.
    pub tilt: Tilt,
    /// Standard deviation of the roll, radians.
    pub roll_sd_rad: f64,
    /// Standard deviation of the pitch for this focal length, radians.
    pub pitch_sd_rad: f64,
    /// How many lines are upright under this tilt, less those expected by chance.
    pub upright_lines: f64,
}

/// Why the tilt of a camera was not estimated.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum TiltError {
    /// The field of view, or a side of the picture, is out of range.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The mask differs in size from the picture.
    #[error("the mask must be as large as the picture, {}x{}, got {}x{}", wanted[0], wanted[1], got[0], got[1])]
    Mask {
        /// Width and height of the picture.
        wanted: [usize; 2],
        /// Width and height of the mask.
        got: [usize; 2],
    },
    /// No edges were computed.
    #[error(transparent)]
    Line(#[from] LineError),
}

/// A steep line of the picture.
struct Steep {
    /// Its middle on the plane at depth 1.
    middle: DVec2,
    /// Its angle against the x axis, radians.
    angle_rad: f64,
    /// Scale of this angle.
    scale_rad: f64,
}

impl Steep {
    /// Density of the line's angle, relative to that of lines of any steep direction, if it is upright.
    fn likelihood(&self, down: DVec3) -> f64 {
        let direction = down.truncate() - self.middle * down.z;
        let off = (self.angle_rad - direction.to_angle() + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2;
        let scale = self.scale_rad;
        scale / PI / (scale * scale + off * off) * (2.0 * STEEP_RAD)
    }
}

/// The tilt of a camera from one picture, of a horizontal field of view in radians; without one,
/// [`assumed_field_of_view_rad`]. Pixels outside the mask `still` are not used: people are not upright.
///
/// # Errors
///
/// A field of view outside 0 to 180 degrees, or a mask of another size.
pub fn camera_tilt(
    frame: &Frame<'_>,
    still: Option<&Mask>,
    field_of_view_rad: Option<f64>,
) -> Result<TiltEstimate, TiltError> {
    let size = [frame.width() as u32, frame.height() as u32];
    let field_of_view_rad = field_of_view_rad.unwrap_or_else(|| assumed_field_of_view_rad(size));
    let camera = Camera::assumed(size, field_of_view_rad)?;
    let wanted = [frame.width(), frame.height()];
    if let Some(got) = still.map(|mask| [mask.width(), mask.height()]).filter(|got| *got != wanted) {
        return Err(TiltError::Mask { wanted, got });
    }
    let domain = EdgeDomain { mask: still, window: None };
    let line_options = LineOptions { min_length_px: MIN_LINE_PX, ..LineOptions::default() };
    let edges = edge_segments(frame, &domain, &FAINT, &line_options)?;
    Ok(tilt_of_lines(&edges, size, camera.focal_px.x))
}

/// The tilt of a camera from the straight edges of one picture, for a focal length in pixels and a principal point in the
/// middle of the picture.
///
/// 1. The steep lines, the longest ones.
/// 2. The posterior on a coarse grid of roll and pitch, refined where it is not negligible.
/// 3. Mean and standard deviations.
pub fn tilt_of_lines(segments: &[EdgeSegment], [width, height]: [u32; 2], focal_px: f64) -> TiltEstimate {
    // 1. The steep lines.
    let centre = 0.5 * DVec2::new(f64::from(width) - 1.0, f64::from(height) - 1.0);
    let mut lines: Vec<&EdgeSegment> = segments
        .iter()
        .filter(|s| s.length_px() >= MIN_LINE_PX && s.direction().y.abs() > STEEP_RAD.sin())
        .collect();
    lines.sort_by(|a, b| b.length_px().total_cmp(&a.length_px()));
    lines.truncate(MOST_LINES);
    let lines: Vec<Steep> = lines
        .into_iter()
        .map(|s| Steep {
            middle: (s.midpoint_px() - centre) / focal_px,
            angle_rad: s.direction().to_angle(),
            scale_rad: LINE_SD_RAD.hypot(LINE_SD_PX / s.length_px()),
        })
        .collect();
    // 2. The posterior, relative to its largest value.
    let cell = |roll: f64, pitch: f64| {
        let tilt = Tilt { roll_rad: roll, pitch_rad: pitch };
        (tilt, log_prior(&tilt) + INDEPENDENT_SHARE * log_likelihood(&lines, &tilt))
    };
    let coarse: Vec<(Tilt, f64)> = (-ROLLS.0..=ROLLS.0)
        .flat_map(|r| {
            (-PITCHES.0..=PITCHES.0).map(move |p| (f64::from(r) * ROLLS.1, f64::from(p) * PITCHES.1))
        })
        .map(|(roll, pitch)| cell(roll, pitch))
        .collect();
    let best = |cells: &[(Tilt, f64)]| cells.iter().map(|(_, log)| *log).fold(f64::NEG_INFINITY, f64::max);
    let floor = best(&coarse) - NEGLIGIBLE;
    let within = |n: i32| (2 * n + 1 - FINE) as f64 / (2 * FINE) as f64;
    let fine: Vec<(Tilt, f64)> = coarse
        .iter()
        .filter(|(_, log)| *log > floor)
        .flat_map(|(tilt, _)| (0..FINE * FINE).map(move |n| (tilt, within(n / FINE), within(n % FINE))))
        .map(|(tilt, r, p)| cell(tilt.roll_rad + r * ROLLS.1, tilt.pitch_rad + p * PITCHES.1))
        .collect();
    // 3. Mean and standard deviations.
    let highest = best(&fine);
    let weighted: Vec<(Tilt, f64)> = fine.iter().map(|(tilt, log)| (*tilt, (log - highest).exp())).collect();
    let total: f64 = weighted.iter().map(|(_, w)| w).sum();
    let moments = |of: fn(&Tilt) -> f64| {
        let mean = weighted.iter().map(|(tilt, w)| w * of(tilt)).sum::<f64>() / total;
        let variance = weighted.iter().map(|(tilt, w)| w * (of(tilt) - mean).powi(2)).sum::<f64>() / total;
        (mean, variance.sqrt())
    };
    let (roll_rad, roll_sd_rad) = moments(|tilt| tilt.roll_rad);
    let (pitch_rad, pitch_sd_rad) = moments(|tilt| tilt.pitch_rad);
    let tilt = Tilt { roll_rad, pitch_rad };
    TiltEstimate {
        tilt,
        roll_sd_rad: roll_sd_rad.hypot(ROLL_SYSTEMATIC_RAD),
        pitch_sd_rad: pitch_sd_rad.hypot(PITCH_SYSTEMATIC_RAD),
        upright_lines: upright_lines(&lines, &tilt),
    }
}

fn log_prior(tilt: &Tilt) -> f64 {
    let (roll, pitch) = (tilt.roll_rad / ROLL_PRIOR_RAD, tilt.pitch_rad / PITCH_PRIOR_RAD);
    -2.0 * (roll * roll / 3.0).ln_1p() - 0.5 * pitch * pitch
}

/// The logarithm of the likelihood of all lines, relative to that of lines of any direction, averaged over the share of
/// upright ones.
fn log_likelihood(lines: &[Steep], tilt: &Tilt) -> f64 {
    let down = tilt.down();
    let mut logs = [0.0_f64; SHARES.len()];
    // The product of eight factors is far from the limits of a number, so that one logarithm does for eight.
    for eight in lines.chunks(8) {
        let mut products = [1.0; SHARES.len()];
        for likelihood in eight.iter().map(|line| line.likelihood(down)) {
            products.iter_mut().zip(SHARES).for_each(|(p, w)| *p *= 1.0 - w + w * likelihood);
        }
        logs.iter_mut().zip(products).for_each(|(log, p)| *log += p.ln());
    }
    let highest = logs.into_iter().fold(f64::NEG_INFINITY, f64::max);
    highest + (logs.iter().map(|log| (log - highest).exp()).sum::<f64>() / SHARES.len() as f64).ln()
}

/// Lines within three scales of upright, less their number by chance.
fn upright_lines(lines: &[Steep], tilt: &Tilt) -> f64 {
    let down = tilt.down();
    let near = |line: &Steep| {
        let at_most = 3.0 * line.scale_rad;
        let limit = line.scale_rad / PI / (10.0 * line.scale_rad * line.scale_rad) * (2.0 * STEEP_RAD);
        let by_chance = at_most / STEEP_RAD;
        f64::from(u8::from(line.likelihood(down) >= limit)) - by_chance
    };
    lines.iter().map(near).sum::<f64>().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SIZE: [u32; 2] = [640, 480];
    const FIELD_RAD: f64 = 1.08;

    fn segment(start_px: DVec2, end_px: DVec2) -> EdgeSegment {
        EdgeSegment { start_px, end_px, mean_gradient: 20.0, residual_rms_px: 0.1, edgel_count: 20 }
    }

    fn tilted(tilt: &Tilt) -> Camera {
        Camera::level(SIZE, FIELD_RAD, 1.5, 0.0).unwrap().tilted(tilt)
    }

    #[test]
    fn upright_lines_lean_as_the_formula_says() {
        let tilt = Tilt { roll_rad: 0.1, pitch_rad: 0.2 };
        let expected =
            DVec3::new(-0.1_f64.sin() * 0.2_f64.cos(), 0.1_f64.cos() * 0.2_f64.cos(), 0.2_f64.sin());
        assert!((tilt.down() - expected).length() < 1e-12);
        for x in [-2.0, 0.0, 1.0] {
            let camera = tilted(&tilt);
            let [low, high] = [0.2, 1.1].map(|z| camera.project(DVec3::new(x, 5.0, z)).unwrap());
            let middle = (low - camera.centre_px) / camera.focal_px.x;
            let direction = tilt.down().truncate() - middle * tilt.down().z;
            let along = (low - high).normalize();
            assert!(along.perp_dot(direction.normalize()).abs() < 1e-9, "{x}");
            assert!(along.dot(direction) > 0.0, "downwards");
        }
        let leaning = tilted(&Tilt { roll_rad: 0.1, pitch_rad: 0.0 });
        let [foot, head] = [0.0, 1.7].map(|z| leaning.project(DVec3::new(0.0, 5.0, z)).unwrap());
        assert!(head.x > foot.x, "to the right");
    }

    /// Without lines, and with as many in every direction, the camera is taken to be level, and the standard deviations
    /// are those of the prior.
    #[test]
    fn a_picture_without_upright_lines_says_nothing() {
        let every_way: Vec<EdgeSegment> = (0..180)
            .map(|k| {
                let at = DVec2::new(f64::from(k * 37 % 640), f64::from(k * 91 % 480));
                segment(at, at + 30.0 * DVec2::from_angle(f64::from(k).to_radians()))
            })
            .collect();
        for lines in [&[][..], &every_way] {
            let found = tilt_of_lines(lines, SIZE, 530.0);
            assert!(found.tilt.roll_rad.abs() < 0.01 && found.tilt.pitch_rad.abs() < 0.02, "{found:?}");
            assert!((0.04..0.08).contains(&found.roll_sd_rad), "{found:?}");
            assert!((0.12..0.20).contains(&found.pitch_sd_rad), "{found:?}");
            assert!(found.upright_lines < 4.0, "{found:?}");
        }
    }

    /// Lines that are short, and lines that lie, are left out, the shortest beyond the most that are used.
    #[test]
    fn short_and_lying_lines_do_not_count() {
        let upright =
            |x: f64, length: f64| segment(DVec2::new(x, 100.0), DVec2::new(x + 0.1 * length, 100.0 + length));
        let few: Vec<_> = (0..30).map(|k| upright(20.0 * f64::from(k), 60.0)).collect();
        let alone = tilt_of_lines(&few, SIZE, 530.0);
        assert!(alone.tilt.roll_rad < -0.05, "{alone:?}");
        let short = (0..300).map(|k| segment(DVec2::new(f64::from(k), 9.0), DVec2::new(f64::from(k), 20.9)));
        let lying =
            (0..300).map(|k| segment(DVec2::new(9.0, f64::from(k)), DVec2::new(60.0, f64::from(k) + 50.0)));
        let more: Vec<_> = short.chain(lying).chain(few.clone()).collect();
        assert_eq!(tilt_of_lines(&more, SIZE, 530.0), alone);
        let long = (0..MOST_LINES as i32)
            .map(|k| segment(DVec2::new(f64::from(k), 9.0), DVec2::new(f64::from(k), 99.0)));
        let longer: Vec<_> = few.iter().copied().chain(long.clone()).collect();
        assert_eq!(
            tilt_of_lines(&longer, SIZE, 530.0),
            tilt_of_lines(&long.collect::<Vec<_>>(), SIZE, 530.0)
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]
        /// Vertical lines 4 to 15 m away with errors of up to half a pixel at their ends, among others of any direction.
        #[test]
        fn a_planted_tilt_is_recovered_among_other_lines(
            roll_rad in -0.2..0.2_f64, pitch_rad in -0.3..0.45_f64,
            upright in prop::collection::vec((4.0..15.0_f64, -0.5..0.5_f64, 0.0..1.5_f64, 0.5..1.5_f64, [-0.5..0.5_f64, -0.5..0.5_f64]), 60),
            others in prop::collection::vec((0.0..640.0_f64, 0.0..480.0_f64, 0.0..PI, 12.0..60.0_f64), 0..150),
        ) {
            let planted = Tilt { roll_rad, pitch_rad };
            let camera = tilted(&planted);
            let drawn = upright.iter().map(|&(depth, side, low, long, off)| {
                let ends = [low, low + long].map(|z| camera.project(DVec3::new(side * depth, depth, z)).unwrap());
                segment(ends[0] + DVec2::X * off[0], ends[1] + DVec2::X * off[1])
            });
            let more = others.iter().map(|&(x, y, angle, long)| {
                let at = DVec2::new(x, y);
                segment(at, at + long * DVec2::from_angle(angle))
            });
            let segments: Vec<_> = drawn.chain(more).collect();
            let found = tilt_of_lines(&segments, SIZE, camera.focal_px.x);
            prop_assert!((found.tilt.roll_rad - roll_rad).abs() < 0.02 && found.roll_sd_rad < 0.03, "{found:?}");
            prop_assert!((found.tilt.pitch_rad - pitch_rad).abs() < 0.06 && found.pitch_sd_rad < 0.09, "{found:?}");
            prop_assert!(found.upright_lines > 35.0, "{found:?}");
        }
    }
}
