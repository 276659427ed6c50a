//! The velocity field of a moving region between two frames.
//!
//! Minimises, over the region R alone and without a boundary condition,
//!
//! ```text
//! J(u, v) = integral over R of (I_x u + I_y v + I_t)^2 + lambda^2 (|grad u|^2 + |grad v|^2)
//! ```
//!
//! Sources: Rohr 1994, section 4.1; Horn & Schunck, Artificial Intelligence 17, 1981 (the functional);
//! Schnörr, "Determining optical flow for irregular domains", IJCV 6(1), 1991 (irregular domains, existence
//! and uniqueness).
//!
//! Discretisation: one unknown vector per pixel and one difference for each pair of neighbours that both lie
//! in the region. Omitting all other differences is the natural boundary condition: the field is not pulled
//! towards the background, and a constant motion is reproduced up to the border.
//!
//! Existence and uniqueness (Schnörr 1991): on each connected component the smoothness term does not
//! determine the constant vectors, so there is exactly one minimum if and only if the gradients in the
//! component have two directions, that is, if the sum of grad I grad I^T over the component is regular.
//! Components that fail this test get no velocity, and [`FlowEvidence`] gives the reason.
//!
//! The functional is minimised by conjugate gradients with a multigrid preconditioner, from coarse to fine
//! over a pyramid; the second frame is warped by the motion found so far. Nagel's oriented smoothness is not
//! implemented.
//!
//! Limits: the motion is smoothed across the borders of limbs that move differently. Grey values must persist
//! from frame to frame. A motion of more than the moving object's own size on the coarsest pyramid level is
//! not found.

mod domain;
mod multigrid;

use self::domain::Domain;
use self::multigrid::{Goal, Multigrid, Vectors};
use super::edge::Window;
use super::frame::{Frame, FrameError, Image, Mask};
use crate::OptionError;
use glam::{DVec2, Vec2};
use thiserror::Error;

/// Why no velocity field was computed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FlowError {
    /// The frames or the mask differ in size.
    #[error(transparent)]
    Size(#[from] FrameError),
    /// The region has no pixel.
    #[error("the region is empty")]
    EmptyRegion,
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Options for computing the velocity field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowOptions {
    /// Weight lambda of the smoothness term, grey levels. Default 25: at 10 the field diverges at limb
    /// crossings in real footage, where grey values do not persist; at 60 the swing leg and the stance leg
    /// are no longer separated.
    pub smoothness: f64,
    /// Number of pyramid levels; each level has half the size of the one below. Default 5: 16 px of motion
    /// are 1 px on the coarsest level. Small frames get fewer levels.
    pub levels: usize,
    /// Linearisations per level. Default 2: 95 % of a walker's velocities are within 0.01 px of those after
    /// twelve in slow footage (6 px per frame), and within 0.15 px in fast footage (20 px per frame).
    pub warps: usize,
    /// Residual of the linear equations, relative to their right-hand side, at which the solver stops. The
    /// default 1e-4 leaves 99 % of a walker's velocities within 0.01 px of the exact solution.
    pub tolerance: f64,
    /// Maximum number of solver iterations per linearisation. Default 200: thirty times what regions of a
    /// person need.
    pub max_iterations: usize,
    /// Smallest RMS gradient, along the weaker principal direction, of a component whose motion is
    /// determined, grey levels per pixel. Default 0.5: about what noise of one grey level leaves after
    /// smoothing.
    pub min_gradient: f64,
}

impl Default for FlowOptions {
    fn default() -> Self {
        Self {
            smoothness: 25.0,
            levels: 5,
            warps: 2,
            tolerance: 1e-4,
            max_iterations: 200,
            min_gradient: 0.5,
        }
    }
}

impl FlowOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let fields = [
            ("smoothness", self.smoothness),
            ("levels", self.levels as f64),
            ("warps", self.warps as f64),
            ("tolerance", self.tolerance),
            ("max_iterations", self.max_iterations as f64),
            ("min_gradient", self.min_gradient),
        ];
        for (name, value) in fields {
            OptionError::unless_positive(name, value)?;
        }
        Ok(())
    }
}

/// What the grey values of a connected component determine about its motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlowEvidence {
    /// Gradients in two directions: the velocity field is unique.
    Determined,
    /// Gradients in one direction only: the motion along the edges is undetermined (aperture problem).
    OneDirection,
    /// No gradients.
    Textureless,
}

/// A connected component of the region (neighbours share a side).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlowComponent {
    /// Column of its first pixel in reading order.
    pub x: usize,
    /// Row of its first pixel in reading order.
    pub y: usize,
    /// Number of pixels.
    pub pixel_count: usize,
    /// RMS gradient along the weaker and the stronger principal direction, grey levels per pixel.
    pub gradient_rms: [f64; 2],
    /// Whether its motion is determined.
    pub evidence: FlowEvidence,
}

/// Velocities of the pixels of a region.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowField {
    /// The bounding rectangle of the region.
    pub window: Window,
    /// Velocity to the right, pixels per frame, for each pixel of the window; NaN outside the determined
    /// components.
    pub u_px: Image<f32>,
    /// Velocity downwards, pixels per frame, for each pixel of the window; NaN outside the determined
    /// components.
    pub v_px: Image<f32>,
    /// The connected components of the region, in reading order of their first pixels.
    pub components: Vec<FlowComponent>,
    /// Solver iterations on the finest level, summed over all linearisations.
    pub iterations: usize,
    /// Relative residual of the last linear system solved.
    pub relative_residual: f64,
}

impl FlowField {
    /// The velocity of the pixel at column `x`, row `y` of the frame, pixels per frame.
    pub fn at(&self, x: usize, y: usize) -> Option<DVec2> {
        let (i, j) = (x.checked_sub(self.window.x)?, y.checked_sub(self.window.y)?);
        let is_inside = i < self.window.width && j < self.window.height;
        let velocity = is_inside.then(|| Vec2::new(self.u_px.at(i, j), self.v_px.at(i, j)))?;
        velocity.is_finite().then(|| velocity.as_dvec2())
    }
}

/// Computes the velocity field of a region from one frame to the next.
///
/// 1. Smooth both frames around the region and remove components whose motion is not determined.
/// 2. Build a pyramid of grey values, gradients and region.
/// 3. From the coarsest level down: linearise about the motion found so far, solve, repeat.
///
/// # Errors
///
/// The frames and the mask differ in size, the region is empty, or an option is not positive.
pub fn velocity_field(
    first: &Frame<'_>,
    second: &Frame<'_>,
    region: &Mask,
    options: &FlowOptions,
) -> Result<FlowField, FlowError> {
    options.check()?;
    first.check_same_size(second)?;
    let window = window_of_region(first, region)?;
    let levels = levels_for(first, options);
    let margin = 1 << levels;
    let grey = Raster::smoothed(first, &window, margin);
    let mut domain = Domain::of_region(region, &window);
    let components = refuse_undetermined(&mut domain, &grey, margin, &window, options.min_gradient);
    let pyramid = pyramid(grey, Raster::smoothed(second, &window, margin), domain, margin, levels);
    let mut motion = Motion::still(&pyramid[pyramid.len() - 1].domain);
    for (k, level) in pyramid.iter().enumerate().rev() {
        if k + 1 < pyramid.len() {
            motion = motion.refined(&pyramid[k + 1].domain, &level.domain);
        }
        motion.iterations = 0;
        let mut solver = Multigrid::new(&level.domain, options.smoothness * options.smoothness);
        for _ in 0..options.warps {
            improve(&mut motion, level, &mut solver, options);
        }
    }
    Ok(field_of_motion(motion, &pyramid[0].domain, window, components))
}

/// The requested number of levels, limited so that no motion of more than half the frame is searched for.
fn levels_for(frame: &Frame<'_>, options: &FlowOptions) -> usize {
    let side = frame.width().max(frame.height());
    options.levels.min((side / 2).max(2).ilog2() as usize)
}

/// The bounding rectangle of the region.
fn window_of_region(frame: &Frame<'_>, region: &Mask) -> Result<Window, FlowError> {
    let (width, height) = (region.width(), region.height());
    if (width, height) != (frame.width(), frame.height()) {
        let (expected_width, expected_height) = (frame.width(), frame.height());
        return Err(FrameError::SizeChanged { expected_width, expected_height, width, height }.into());
    }
    let inside = || (0..width * height).filter(|&p| region.pixels()[p]);
    let (Some(first), Some(last)) = (inside().next(), inside().next_back()) else {
        return Err(FlowError::EmptyRegion);
    };
    let (x0, x1) = inside().fold((width, 0), |(x0, x1), p| (x0.min(p % width), x1.max(p % width)));
    let (y0, y1) = (first / width, last / width);
    Ok(Window { x: x0, y: y0, width: x1 - x0 + 1, height: y1 - y0 + 1 })
}

/// Removes the components without gradients in two directions from the domain and describes all components.
fn refuse_undetermined(
    domain: &mut Domain,
    grey: &Raster,
    margin: usize,
    window: &Window,
    min_gradient: f64,
) -> Vec<FlowComponent> {
    let mut components = Vec::new();
    let mut is_seen = vec![false; domain.is_inside.len()];
    for start in 0..domain.is_inside.len() {
        if is_seen[start] || !domain.is_inside[start] {
            continue;
        }
        let cells = domain.connected_to(start, &mut is_seen);
        let place = |cell: usize| (cell % domain.stride() - 1, cell / domain.stride() - 1);
        let gradients = cells.iter().map(|&cell| {
            let (x, y) = place(cell);
            grey.at(x + margin, y + margin).gradient.as_dvec2()
        });
        let gradient_rms = principal_rms(gradients);
        let evidence = match gradient_rms {
            [weaker, _] if weaker >= min_gradient => FlowEvidence::Determined,
            [_, stronger] if stronger >= min_gradient => FlowEvidence::OneDirection,
            _ => FlowEvidence::Textureless,
        };
        let (x, y) = place(start);
        let (x, y) = (window.x + x, window.y + y);
        components.push(FlowComponent { x, y, pixel_count: cells.len(), gradient_rms, evidence });
        if evidence != FlowEvidence::Determined {
            cells.iter().for_each(|&cell| domain.is_inside[cell] = false);
        }
    }
    components
}

/// Square roots of the eigenvalues of the mean of g g^T, smaller first.
fn principal_rms(gradients: impl Iterator<Item = DVec2>) -> [f64; 2] {
    let (mut n, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0);
    for g in gradients {
        (n, xx, xy, yy) = (n + 1.0, xx + g.x * g.x, xy + g.x * g.y, yy + g.y * g.y);
    }
    let (half_trace, spread) = (0.5 * (xx + yy), 0.5 * (xx - yy).hypot(2.0 * xy));
    [half_trace - spread, half_trace + spread].map(|sum| (sum.max(0.0) / n).sqrt())
}

/// Grey value and gradient at a pixel.
#[derive(Clone, Copy, Default)]
struct Sample {
    grey: f32,
    gradient: Vec2,
}

/// Number of pixels that smoothing (2) and central differences (1) read beyond a pixel.
const REACH: usize = 3;

/// Smoothed grey values with gradients.
struct Raster {
    width: usize,
    height: usize,
    samples: Vec<Sample>,
    /// The part that shows the frame rather than its replicated border.
    low: Vec2,
    high: Vec2,
}

impl Raster {
    /// The window and `margin` pixels around it, smoothed with the binomial of 5 taps (sigma 1); the border
    /// of the frame is replicated outwards.
    fn smoothed(frame: &Frame<'_>, window: &Window, margin: usize) -> Self {
        let margin = margin + REACH;
        let (width, height) = (window.width + 2 * margin, window.height + 2 * margin);
        let origin = [window.x, window.y].map(|o| o as isize - margin as isize);
        let clamp = |i: isize, size: usize| i.clamp(0, size as isize - 1) as usize;
        let columns: Vec<usize> = (0..width).map(|x| clamp(origin[0] + x as isize, frame.width())).collect();
        let mut grey = Vec::with_capacity(width * height);
        for y in 0..height {
            let row = frame.row(clamp(origin[1] + y as isize, frame.height()));
            grey.extend(columns.iter().map(|&x| f32::from(row[x])));
        }
        let low = Vec2::new(-origin[0] as f32, -origin[1] as f32);
        let high = low + Vec2::new(frame.width() as f32 - 1.0, frame.height() as f32 - 1.0);
        Self::with_gradients(width, height, &smoothed(width, height, &grey), low, high).without_rim()
    }

    /// The inner pixels, whose smoothing and differences read nothing beyond the raster.
    fn without_rim(&self) -> Self {
        let (width, height) = (self.width - 2 * REACH, self.height - 2 * REACH);
        let rows = self.samples.chunks_exact(self.width).skip(REACH).take(height);
        let samples = rows.flat_map(|row| &row[REACH..][..width]).copied().collect();
        let end = Vec2::new(width as f32 - 1.0, height as f32 - 1.0);
        let rim = Vec2::splat(REACH as f32);
        Self {
            width,
            height,
            samples,
            low: (self.low - rim).max(Vec2::ZERO),
            high: (self.high - rim).min(end),
        }
    }

    /// Adds central differences.
    fn with_gradients(width: usize, height: usize, grey: &[f32], low: Vec2, high: Vec2) -> Self {
        let mut samples = Vec::with_capacity(width * height);
        for y in 0..height {
            let rows = [y.saturating_sub(1), y, (y + 1).min(height - 1)];
            let [above, row, below] = rows.map(|y| &grey[y * width..(y + 1) * width]);
            for x in 0..width {
                let dx = row[(x + 1).min(width - 1)] - row[x.saturating_sub(1)];
                samples.push(Sample { grey: row[x], gradient: 0.5 * Vec2::new(dx, below[x] - above[x]) });
            }
        }
        let end = Vec2::new(width as f32 - 1.0, height as f32 - 1.0);
        Self { width, height, samples, low: low.max(Vec2::ZERO), high: high.min(end) }
    }

    fn at(&self, x: usize, y: usize) -> Sample {
        self.samples[y * self.width + x]
    }

    /// Between pixels, the gradient is bilinear, and the grey value is the weighted mean of the four linear
    /// extrapolations I + g.d / 2: the factor 1/2 cancels the error of bilinear interpolation where the image
    /// is curved. `None` outside the frame.
    fn sample(&self, at: Vec2) -> Option<Sample> {
        if !(at.cmpge(self.low).all() && at.cmple(self.high).all()) {
            return None;
        }
        let (x, y) = (at.x as usize, at.y as usize);
        let part = at - Vec2::new(x as f32, y as f32);
        let mut mean = Sample::default();
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let corner = self.at((x + i).min(self.width - 1), (y + j).min(self.height - 1));
            let step = part - Vec2::new(i as f32, j as f32);
            let weight = (1.0 - step.x.abs()) * (1.0 - step.y.abs());
            mean.grey += weight * (corner.grey + 0.5 * corner.gradient.dot(step));
            mean.gradient += weight * corner.gradient;
        }
        Some(mean)
    }

    /// Half the size: pixel i lies between pixels 2 i and 2 i + 1 and is a mean of four pixels with weights
    /// (1, 3, 3, 1) / 8.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let taps = [0.125, 0.375, 0.375, 0.125];
        let from = |i: usize, k: usize, size: usize| (2 * i + k).saturating_sub(1).min(size - 1);
        let mut narrow = vec![0.0f32; width * self.height];
        for (p, grey) in narrow.iter_mut().enumerate() {
            let (x, y) = (p % width, p / width);
            *grey = (0..4).map(|k| taps[k] * self.at(from(x, k, self.width), y).grey).sum();
        }
        let mut grey = vec![0.0f32; width * height];
        for (p, grey) in grey.iter_mut().enumerate() {
            let (x, y) = (p % width, p / width);
            *grey = (0..4).map(|k| taps[k] * narrow[from(y, k, self.height) * width + x]).sum();
        }
        let halve = |v: Vec2| 0.5 * (v - 0.5);
        Self::with_gradients(width, height, &grey, halve(self.low), halve(self.high))
    }
}

/// The binomial (1, 4, 6, 4, 1) / 16 along both axes.
fn smoothed(width: usize, height: usize, grey: &[f32]) -> Vec<f32> {
    let taps = [0.0625, 0.25, 0.375, 0.25, 0.0625f32];
    let from = |i: usize, k: usize, size: usize| (i + k).saturating_sub(2).min(size - 1);
    let mut along = Vec::with_capacity(grey.len());
    for row in grey.chunks_exact(width) {
        along.extend((0..width).map(|x| (0..5).map(|k| taps[k] * row[from(x, k, width)]).sum::<f32>()));
    }
    let mut out = vec![0.0; grey.len()];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        for (k, tap) in taps.into_iter().enumerate() {
            let start = from(y, k, height) * width;
            out.iter_mut().zip(&along[start..start + width]).for_each(|(out, &g)| *out += tap * g);
        }
    }
    out
}

/// One level of the pyramid. The rasters reach `margin` pixels beyond the domain.
struct Level {
    first: Raster,
    second: Raster,
    domain: Domain,
    margin: usize,
}

/// Finest level first; stops early when the region is a single pixel.
fn pyramid(first: Raster, second: Raster, domain: Domain, margin: usize, levels: usize) -> Vec<Level> {
    let mut pyramid = vec![Level { first, second, domain, margin }];
    for _ in 1..levels {
        let fine = &pyramid[pyramid.len() - 1];
        if fine.domain.width.max(fine.domain.height) == 1 {
            break;
        }
        pyramid.push(Level {
            first: fine.first.halved(),
            second: fine.second.halved(),
            domain: fine.domain.halved(),
            margin: fine.margin / 2,
        });
    }
    pyramid
}

/// The motion found so far.
struct Motion {
    velocity: Vectors,
    iterations: usize,
    relative_residual: f64,
}

impl Motion {
    fn still(domain: &Domain) -> Self {
        let velocity = Vectors::zero(domain.is_inside.len());
        Self { velocity, iterations: 0, relative_residual: 0.0 }
    }

    /// The same motion on the next finer level: each pixel takes twice the velocity of the coarse pixel that
    /// covers it.
    fn refined(&self, coarse: &Domain, fine: &Domain) -> Self {
        let mut refined = Self::still(fine);
        for (x, y, cell) in fine.pixels() {
            let parent = coarse.cell(x / 2, y / 2);
            refined.velocity.u[cell] = 2.0 * self.velocity.u[parent];
            refined.velocity.v[cell] = 2.0 * self.velocity.v[parent];
        }
        refined
    }
}

/// Linearises the grey value constraint about the current motion and minimises.
fn improve(motion: &mut Motion, level: &Level, solver: &mut Multigrid, options: &FlowOptions) {
    for (x, y, cell) in level.domain.pixels() {
        let velocity = DVec2::new(motion.velocity.u[cell], motion.velocity.v[cell]);
        let (gradient, offset) = constraint(level, x, y, velocity).unwrap_or_default();
        solver.set_constraint(cell, gradient, offset);
    }
    let goal = Goal { tolerance: options.tolerance, max_iterations: options.max_iterations };
    let solved = solver.solve(&mut motion.velocity, goal);
    motion.iterations += solved.iterations;
    motion.relative_residual = solved.relative_residual;
}

/// The gradient g and the offset c of the constraint g . (u, v) + c = 0 at a pixel whose current velocity is
/// w: g is the mean of the gradients of both frames at the two places of the pixel, c = `I_2`(x + w) -
/// `I_1`(x) - g . w. `None` if the pixel has left the frame.
fn constraint(level: &Level, x: usize, y: usize, velocity: DVec2) -> Option<(DVec2, f64)> {
    let (x, y) = (x + level.margin, y + level.margin);
    let before = level.first.at(x, y);
    let after = level.second.sample(Vec2::new(x as f32, y as f32) + velocity.as_vec2())?;
    let gradient = 0.5 * (before.gradient + after.gradient).as_dvec2();
    Some((gradient, f64::from(after.grey - before.grey) - gradient.dot(velocity)))
}

/// Removes the padding and marks the pixels without a velocity.
fn field_of_motion(
    motion: Motion,
    domain: &Domain,
    window: Window,
    components: Vec<FlowComponent>,
) -> FlowField {
    let mut u_px = Image::filled(window.width, window.height, f32::NAN);
    let mut v_px = u_px.clone();
    for (x, y, cell) in domain.pixels() {
        u_px.set(x, y, motion.velocity.u[cell] as f32);
        v_px.set(x, y, motion.velocity.v[cell] as f32);
    }
    let Motion { iterations, relative_residual, .. } = motion;
    FlowField { window, u_px, v_px, components, iterations, relative_residual }
}

#[cfg(test)]
mod tests;
