//! Camera calibration from measured points: their positions in the world and in the image.
//!
//! 1. Initial poses come from [`resect`], which tries all directions and the linear solution of Lee and Chen
//!    1985 (their eqs. (1)-(5), the direct linear transformation): from all points, and from several sets of
//!    six points so that a wrong point does not affect all of them.
//! 2. Focal length and pose are fitted by least squares (Levenberg and Marquardt), with weights that suppress
//!    outliers. Points farther off than chance would cause in one calibration in a hundred are left out.
//! 3. The principal point, k1 and k2 are fitted too if Akaike's criterion for small samples (Hurvich and Tsai
//!    1989) improves by a margin; otherwise the principal point is the image centre and the lens has no
//!    distortion.
//!
//! The standard deviation of a pixel coordinate is estimated from the residuals and one more of a pixel. The covariance is that of
//! the fit alone: it assumes that pixels are square and that the distortion is no more than k1, k2.
//!
//! Limits: points in one plane do not determine the focal length if the camera looks straight at the plane. A
//! parameter that the points do not determine is an error that names it, not a number with a large standard
//! deviation.

use crate::wording::counted;
use glam::{DMat3, DQuat, DVec2, DVec3};
use nalgebra::{DMatrix, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use thiserror::Error;

use super::{CHANCE, Estimate, MAX_FOCAL_SD};
use crate::estimate::least_squares::{Fit, MOST_ITERATIONS, minimise};
use crate::model::camera::{Camera, CameraError};
use crate::model::distortion::Distortion;
use crate::model::resection::{Focal, ResectionOptions, resect};

/// Number of points that the fit needs in space, and in a plane.
const NEEDED: usize = 6;
const NEEDED_IN_PLANE: usize = 4;
/// Points are coplanar or collinear below this ratio of the singular values of their centred coordinates.
const FLAT: f64 = 1e-4;
/// Lower bound of the noise in the test of what the points determine, pixels.
const LEAST_NOISE_PX: f64 = 0.5;
/// How well pixels are usually pointed at by hand.
const USUAL_NOISE_PX: f64 = 1.0;
/// An additional parameter must lower Akaike's criterion by this much (odds of 20 to 1).
const MARGIN: f64 = 6.0;
/// Largest accepted coordinate, metres or pixels.
const MAX_COORDINATE: f64 = 1e6;

/// Why no camera was found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PointError {
    /// The numbers of positions and pixels differ.
    #[error("{} but {}", counted(*world, "place"), counted(*image, "pixel"))]
    Unpaired {
        /// Number of positions.
        world: usize,
        /// Number of pixels.
        image: usize,
    },
    /// A coordinate is NaN, infinite or too large.
    #[error("point {index}: {column} must be finite and at most {MAX_COORDINATE:e} in size, got {value}")]
    Coordinate {
        /// Index of the point, from 0.
        index: usize,
        /// `x_m`, `y_m`, `z_m`, `u_px` or `v_px`.
        column: &'static str,
        /// Its value.
        value: f64,
    },
    /// There are not enough points.
    #[error("{}: {NEEDED} are needed, or {NEEDED_IN_PLANE} if all lie in one plane", counted(*count, "point"))]
    TooFew {
        /// Number of points given.
        count: usize,
    },
    /// Two points coincide.
    #[error("points {first} and {second} have the same place: {NEEDED} different ones are needed")]
    SamePlace {
        /// Index of one point, from 0.
        first: usize,
        /// Index of the other point.
        second: usize,
    },
    /// All points lie on a line.
    #[error("all points lie on one line: the camera could be turned about it; measure points beside it")]
    Collinear,
    /// All pixels coincide or lie on a line.
    #[error("all pixels lie on one line: the camera would stand in the plane of the points")]
    PixelsOnALine,
    /// The points do not determine focal length and distance separately.
    #[error(
        "the points do not tell focal length from distance (the focal length would be known to ±{:.0} %): they are seen at too similar depths; measure points nearer and farther, or give the field of view",
        relative_sd * 100.0
    )]
    FocalUnknown {
        /// Standard deviation of the focal length, divided by the focal length.
        relative_sd: f64,
    },
    /// The points leave the camera undetermined in some way.
    #[error("the points do not determine the camera: more than one fits them alike")]
    Undetermined,
    /// No camera has all points in front of it and close to their pixels.
    #[error(
        "no camera shows the points at these pixels: nearest is {rms_px:.0} px off; are places and pixels of the same points, in metres and pixels?"
    )]
    NoCamera {
        /// Root mean square residual of the best camera, pixels; infinite if there is none.
        rms_px: f64,
    },
    /// The points fit a mirrored image.
    #[error(
        "the points fit a mirrored picture: the axes are left-handed, v counts upwards, or the picture is mirrored"
    )]
    Mirrored,
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

/// Known lens parameters.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum KnownLens {
    /// No parameter is known: square pixels, and a principal point at the image centre unless the points show
    /// otherwise.
    #[default]
    Nothing,
    /// The focal length is known, pixels.
    Focal(f64),
    /// All parameters are known.
    All {
        /// Focal lengths along u and v, pixels.
        focal_px: DVec2,
        /// Principal point, pixels.
        centre_px: DVec2,
        /// Distortion.
        distortion: Distortion,
    },
}

/// Known quantities and options of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointOptions {
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
    /// Known lens parameters.
    pub lens: KnownLens,
}

/// A camera and its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCalibration {
    /// The camera.
    pub camera: Camera,
    /// The fitted parameters: `focal_px`, `centre_u_px`, `centre_v_px`, `k1`, `k2` if they were fitted, then
    /// the position `x_m`, `y_m`, `z_m` of the camera. Standard deviations are NaN where there are as many
    /// equations as unknowns.
    pub estimates: Vec<Estimate>,
    /// Covariance of the fitted parameters: those of the lens as in `estimates`, but with the logarithm of
    /// the focal length, then the rotation (a vector in camera axes, radians) and the translation, metres.
    pub covariance: DMatrix<f64>,
    /// Projected minus given pixel of every point, including the points left out.
    pub residuals_px: Vec<DVec2>,
    /// Indices of the points left out, from 0.
    pub outliers: Vec<usize>,
    /// Root mean square distance between projected and given pixels, over the points not left out.
    pub rms_px: f64,
    /// Standard deviation of a pixel coordinate, estimated from the residuals and one more of a pixel, pixels.
    pub noise_px: f64,
    /// Number of equations minus number of unknowns.
    pub degrees_of_freedom: usize,
    /// Whether all points lie in one plane.
    pub is_planar: bool,
}

/// The camera that images `places` (world axes, metres) at `pixels` (u, v).
///
/// # Errors
///
/// Coordinates that are not finite or too large, too few points, points that leave the camera undetermined,
/// mirrored points, and points that are not consistent with any camera.
pub fn camera_from_points(
    places: &[DVec3],
    pixels: &[DVec2],
    options: &PointOptions,
) -> Result<PointCalibration, PointError> {
    check(places, pixels)?;
    let shape = Shape::of(places);
    if shape.ratios[0] < FLAT {
        return Err(PointError::Collinear);
    }
    let is_planar = shape.ratios[1] < FLAT;
    if places.len() < NEEDED && !is_planar {
        return Err(PointError::TooFew { count: places.len() });
    }
    let flat: Vec<DVec3> = pixels.iter().map(|p| p.extend(0.0)).collect();
    if Shape::of(&flat).ratios[0] < FLAT {
        return Err(PointError::PixelsOnALine);
    }
    let problem = Problem::new(places, pixels, options)?;
    let fitted = problem.fitted();
    let is_good = |found: &Fitted| found.rms_px < 0.02 * problem.diagonal_px;
    // Mirrored points in a plane fit as well as others, with the camera below the plane.
    let mirrored = || problem.mirrored().fitted().is_some_and(|other| is_good(&other));
    let found = match fitted {
        Some(found) if is_good(&found) => found,
        Some(_) | None if !is_planar && mirrored() => return Err(PointError::Mirrored),
        Some(found) => return Err(PointError::NoCamera { rms_px: found.rms_px }),
        None => return Err(PointError::NoCamera { rms_px: f64::INFINITY }),
    };
    if !is_planar
        && found.rms_px > 3.0
        && problem.mirrored().fitted().is_some_and(|other| other.rms_px < 0.2 * found.rms_px)
    {
        return Err(PointError::Mirrored);
    }
    let calibration = problem.calibration(found, is_planar)?;
    let is_ground = is_planar && shape.normal.z.abs() > 0.9;
    if is_ground && calibration.camera.position().z < places.iter().map(|p| p.z).fold(f64::INFINITY, f64::min)
    {
        return Err(PointError::Mirrored);
    }
    Ok(calibration)
}

fn check(places: &[DVec3], pixels: &[DVec2]) -> Result<(), PointError> {
    if places.len() != pixels.len() {
        return Err(PointError::Unpaired { world: places.len(), image: pixels.len() });
    }
    for (index, (place, pixel)) in places.iter().zip(pixels).enumerate() {
        let values = [place.x, place.y, place.z, pixel.x, pixel.y];
        let columns = ["x_m", "y_m", "z_m", "u_px", "v_px"];
        for (value, column) in values.into_iter().zip(columns) {
            if value.is_nan() || value.abs() > MAX_COORDINATE {
                return Err(PointError::Coordinate { index, column, value });
            }
        }
    }
    if places.len() < NEEDED_IN_PLANE {
        return Err(PointError::TooFew { count: places.len() });
    }
    for (first, place) in places.iter().enumerate() {
        if let Some(gap) = places[first + 1..].iter().position(|other| other.distance(*place) < 1e-6) {
            return Err(PointError::SamePlace { first, second: first + 1 + gap });
        }
    }
    Ok(())
}

/// The spread of points.
#[derive(Debug)]
struct Shape {
    /// Second and third over first singular value of the centred points.
    ratios: [f64; 2],
    /// Unit direction in which the points spread least.
    normal: DVec3,
}

impl Shape {
    fn of(points: &[DVec3]) -> Self {
        let centre = points.iter().sum::<DVec3>() / points.len() as f64;
        let mut scatter = nalgebra::Matrix3::zeros();
        for point in points {
            let d = nalgebra::Vector3::from((*point - centre).to_array());
            scatter += d * d.transpose();
        }
        let eigen = scatter.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let sigma = order.map(|i| eigen.eigenvalues[i].max(0.0).sqrt());
        let normal = eigen.eigenvectors.column(order[2]);
        Self {
            ratios: [sigma[1] / sigma[0].max(1e-300), sigma[2] / sigma[0].max(1e-300)],
            normal: DVec3::new(normal[0], normal[1], normal[2]),
        }
    }
}

/// The parameters: logarithm of the focal length, principal point, k1, k2, rotation vector, translation.
const PARAMETERS: usize = 11;
const FOCAL: usize = 0;
const CENTRE: [usize; 2] = [1, 2];
const K1: usize = 3;
const K2: usize = 4;
const NAMES: [&str; 5] = ["focal_px", "centre_u_px", "centre_v_px", "k1", "k2"];
/// Steps of the numerical derivatives.
const STEPS: [f64; PARAMETERS] = [1e-6, 1e-3, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6];

struct Problem<'a> {
    places: &'a [DVec3],
    /// The pixels to fit: undistorted and with square pixels if the lens is known.
    pixels: Vec<DVec2>,
    size: [u32; 2],
    lens: KnownLens,
    /// The assumed principal point.
    centre_px: DVec2,
    known_focal_px: Option<f64>,
    diagonal_px: f64,
}

/// A camera given by the parameters of the problem.
#[derive(Clone, Copy)]
struct State {
    focal_px: f64,
    centre_px: DVec2,
    k: [f64; 2],
    rotation: DMat3,
    translation: DVec3,
}

struct Fitted {
    state: State,
    fit: Fit,
    free: Vec<usize>,
    inliers: Vec<usize>,
    rms_px: f64,
}

impl<'a> Problem<'a> {
    fn new(places: &'a [DVec3], pixels: &[DVec2], options: &PointOptions) -> Result<Self, PointError> {
        let size = options.size;
        let sides = DVec2::new(f64::from(size[0]), f64::from(size[1]));
        if size.contains(&0) {
            return Err(CameraError::Size { size }.into());
        }
        let (mut pixels, mut centre_px) = (pixels.to_vec(), sides / 2.0 - 0.5);
        let known_focal_px = match options.lens {
            KnownLens::Nothing => None,
            KnownLens::Focal(focal_px) => {
                let is_good = focal_px.is_finite() && focal_px > 0.0;
                if !is_good {
                    return Err(
                        CameraError::NotPositive { parameter: "focal length", value: focal_px }.into()
                    );
                }
                Some(focal_px)
            }
            KnownLens::All { focal_px, centre_px: centre, distortion } => {
                let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
                let camera = Camera { size, focal_px, centre_px: centre, distortion, rotation, translation }
                    .validated()?;
                for pixel in &mut pixels {
                    *pixel = camera.undistort(*pixel)?;
                    pixel.y = centre.y + (pixel.y - centre.y) * focal_px.x / focal_px.y;
                }
                centre_px = centre;
                Some(focal_px.x)
            }
        };
        let diagonal_px = sides.length();
        Ok(Self { places, pixels, size, lens: options.lens, centre_px, known_focal_px, diagonal_px })
    }

    /// The same problem with the image mirrored.
    fn mirrored(&self) -> Self {
        let pixels = self.pixels.iter().map(|p| DVec2::new(2.0 * self.centre_px.x - p.x, p.y)).collect();
        Self { pixels, ..*self }
    }

    /// Steps 1 to 3 of the module documentation.
    fn fitted(&self) -> Option<Fitted> {
        let mut free: Vec<usize> = (5..PARAMETERS).collect();
        if self.known_focal_px.is_none() {
            free.insert(0, FOCAL);
        }
        let all: Vec<usize> = (0..self.places.len()).collect();
        let start = self.start()?;
        let robust = self.robust(start, &free)?;
        let mut found = self.without_outliers(robust, &free, &all)?;
        if self.known_focal_px.is_some() {
            return Some(found);
        }
        // 3. Add one parameter at a time, or the two of the principal point.
        loop {
            let extensions: [&[usize]; 3] = [&CENTRE, &[K1], &[K2]];
            let allowed = |extra: &&[usize]| {
                !extra.iter().any(|p| found.free.contains(p)) && (extra[0] != K2 || found.free.contains(&K1))
            };
            let tried = extensions.into_iter().filter(allowed).filter_map(|extra| {
                let mut free = found.free.clone();
                free.extend(extra);
                free.sort_unstable();
                let more = self.without_outliers(found.state, &free, &all)?;
                let gain = self.criterion(&found, &more.inliers)? - self.criterion(&more, &more.inliers)?;
                let focal = free.iter().position(|p| *p == FOCAL)?;
                let sd =
                    more.fit.unit_covariance()?[(focal, focal)].sqrt() * noise_px(&more).max(LEAST_NOISE_PX);
                (gain > MARGIN && sd < MAX_FOCAL_SD).then_some((gain, more))
            });
            match tried.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((_, more)) => found = more,
                None => return Some(found),
            }
        }
    }

    /// The best initial pose, by the median distance of its pixels.
    fn start(&self) -> Option<State> {
        let all: Vec<usize> = (0..self.places.len()).collect();
        let mut subsets = vec![all.clone()];
        if all.len() > NEEDED {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
            for _ in 0..12 {
                let mut shuffled = all.clone();
                for i in 0..NEEDED {
                    let other = i + (random.next_u64() % (shuffled.len() - i) as u64) as usize;
                    shuffled.swap(i, other);
                }
                shuffled.truncate(NEEDED);
                subsets.push(shuffled);
            }
        }
        let mut best: Option<(f64, State)> = None;
        for (number, subset) in subsets.iter().enumerate() {
            // If the pose from all points has no outliers, no wrong point affects it.
            if number == 1
                && best.as_ref().is_some_and(|(middle, state)| self.leaves_none_far(state, *middle))
            {
                break;
            }
            for state in self.poses(subset) {
                let mut distances: Vec<f64> = (0..all.len())
                    .map(|i| self.residual(&state, i).map_or(f64::INFINITY, DVec2::length))
                    .collect();
                distances.sort_by(f64::total_cmp);
                // The median, shifted so that the points which a fit passes through do not make it small.
                let middle = distances[(distances.len() + NEEDED.min(distances.len() / 2)) / 2];
                if best.as_ref().is_none_or(|(least, _)| middle < *least) {
                    best = Some((middle, state));
                }
            }
        }
        best.map(|(_, state)| state).filter(|state| all.iter().any(|&i| self.residual(state, i).is_some()))
    }

    /// Whether no point is much farther off than most. The limit holds for images of any size: a pixel read
    /// from an image may be off by one, and a pose that misses most points by a visible fraction of the image
    /// is not that of the camera.
    fn leaves_none_far(&self, state: &State, middle_px: f64) -> bool {
        let limit_px = (2.5 * middle_px).min(0.003 * self.diagonal_px).max(1.0);
        (0..self.places.len()).all(|i| self.residual(state, i).is_some_and(|r| r.length() < limit_px))
    }

    /// Poses that fit some of the points.
    fn poses(&self, subset: &[usize]) -> Vec<State> {
        let places: Vec<DVec3> = subset.iter().map(|&i| self.places[i]).collect();
        let pixels: Vec<DVec2> = subset.iter().map(|&i| self.pixels[i] - self.centre_px).collect();
        let options = ResectionOptions { min_probability: 1e-12, ..ResectionOptions::default() };
        let width = f64::from(self.size[0].max(self.size[1]));
        let known = |focal: f64| Focal::Known(DVec2::splat(focal));
        let mut focals: Vec<Focal> = match self.known_focal_px {
            Some(focal) => vec![known(focal)],
            None if subset.len() >= NEEDED => vec![Focal::Free],
            None => Vec::new(),
        };
        if self.known_focal_px.is_none() && (subset.len() == self.places.len() || subset.len() < NEEDED) {
            focals.extend([0.6, 0.85, 1.2, 2.0, 4.0].map(|share| known(share * width)));
        }
        let found = focals.into_iter().filter_map(|focal| resect(&places, &pixels, focal, &options).ok());
        let poses = found.flat_map(|solution| solution.poses.into_iter().take(3));
        poses
            .map(|pose| State {
                focal_px: pose.focal.x,
                centre_px: self.centre_px,
                k: [0.0; 2],
                rotation: pose.rotation,
                translation: pose.translation,
            })
            .collect()
    }

    /// Projected minus given pixel; `None` behind the camera.
    fn residual(&self, state: &State, point: usize) -> Option<DVec2> {
        let p = state.rotation * self.places[point] + state.translation;
        if p.z < 1e-6 {
            return None;
        }
        let x = p.truncate() / p.z;
        let s = x.length_squared();
        let radial = 1.0 + s * (state.k[0] + s * state.k[1]);
        Some(state.centre_px + state.focal_px * radial * x - self.pixels[point])
    }

    /// `start` changed by the free parameters; rotation and translation are relative to `start`.
    fn state(&self, start: &State, free: &[usize], parameters: &DVector<f64>) -> State {
        let mut change = [0.0; PARAMETERS];
        free.iter().zip(parameters.iter()).for_each(|(&i, &value)| change[i] = value);
        let turn = DQuat::from_scaled_axis(DVec3::new(change[5], change[6], change[7]));
        State {
            focal_px: start.focal_px * change[FOCAL].clamp(-20.0, 20.0).exp(),
            centre_px: start.centre_px + DVec2::new(change[CENTRE[0]], change[CENTRE[1]]),
            k: [start.k[0] + change[K1], start.k[1] + change[K2]],
            rotation: DMat3::from_quat(turn) * start.rotation,
            translation: start.translation + DVec3::new(change[8], change[9], change[10]),
        }
    }

    /// The weighted fit to some points.
    fn fit(&self, start: &State, free: &[usize], points: &[usize], weights: &[f64]) -> Option<(State, Fit)> {
        let residuals = |parameters: &DVector<f64>| {
            let state = self.state(start, free, parameters);
            let mut all = Vec::with_capacity(2 * points.len());
            for (&point, weight) in points.iter().zip(weights) {
                let residual = self.residual(&state, point)? * weight.sqrt();
                all.extend([residual.x, residual.y]);
            }
            Some(DVector::from_vec(all))
        };
        let steps: Vec<f64> = free.iter().map(|&i| STEPS[i]).collect();
        let fit = minimise(DVector::zeros(free.len()), &steps, MOST_ITERATIONS, residuals)?;
        let state = self.state(start, free, &fit.parameters);
        Some((state, fit))
    }

    /// A fit with weights 1 / (1 + (r / s)²), s from the median distance, repeated ten times.
    fn robust(&self, start: State, free: &[usize]) -> Option<State> {
        let seen: Vec<usize> =
            (0..self.places.len()).filter(|&i| self.residual(&start, i).is_some()).collect();
        let mut state = start;
        for _ in 0..10 {
            let distances: Vec<f64> =
                seen.iter().map(|&i| self.residual(&state, i).map_or(f64::INFINITY, DVec2::length)).collect();
            let mut sorted = distances.clone();
            sorted.sort_by(f64::total_cmp);
            let scale = (2.0 * sorted[sorted.len() / 2]).max(1e-3);
            let weights: Vec<f64> = distances.iter().map(|d| 1.0 / (1.0 + (d / scale).powi(2))).collect();
            state = self.fit(&state, free, &seen, &weights)?.0;
        }
        Some(state)
    }

    /// The fit without the points that are farther off than chance allows.
    fn without_outliers(&self, start: State, free: &[usize], all: &[usize]) -> Option<Fitted> {
        let mut state = start;
        let mut inliers: Vec<usize> = all.to_vec();
        // At most a quarter of the points may be wrong, and one point more than the unknowns need must
        // remain.
        let least = (all.len() - all.len() / 4).max(free.len() / 2 + 1).min(all.len());
        // The robust pose shows which points may be wrong: initially those six times as far off as most.
        let mut distances: Vec<(f64, usize)> =
            all.iter().map(|&i| (self.residual(&state, i).map_or(f64::INFINITY, DVec2::length), i)).collect();
        distances.sort_by(|a, b| a.0.total_cmp(&b.0));
        let limit = (6.0 * distances[distances.len() / 2].0).max(1e-3);
        let near = distances.iter().enumerate().filter(|(rank, (d, _))| *rank < least || *d < limit);
        let mut next: Vec<usize> = near.map(|(_, &(_, i))| i).collect();
        next.sort_unstable();
        for _ in 0..10 {
            inliers = next.clone();
            let (found, fit) = self.fit(&state, free, &inliers, &vec![1.0; inliers.len()])?;
            state = found;
            let freedom = (2 * inliers.len()).saturating_sub(free.len());
            if freedom < 2 {
                break;
            }
            // No pixel coordinate is measured more accurately than a twentieth of a pixel.
            let variance = (fit.sum_sq() / freedom as f64).max(0.05 * 0.05);
            // F of 2 and `freedom` degrees: P(F > x) = (1 + 2 x / freedom)^(-freedom / 2).
            let chance = |distance: f64| {
                let x = distance * distance / (2.0 * variance);
                (1.0 + 2.0 * x / freedom as f64).powf(-(freedom as f64) / 2.0) * all.len() as f64
            };
            let mut ranked: Vec<(f64, usize)> = all
                .iter()
                .map(|&i| (self.residual(&state, i).map_or(f64::INFINITY, DVec2::length), i))
                .collect();
            ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
            let kept =
                ranked.iter().enumerate().filter(|(rank, (d, _))| *rank < least || chance(*d) > CHANCE);
            next = kept.map(|(_, &(_, i))| i).collect();
            next.sort_unstable();
            if next == inliers {
                break;
            }
        }
        let (state, fit) = self.fit(&state, free, &inliers, &vec![1.0; inliers.len()])?;
        let rms_px = (fit.sum_sq() / inliers.len() as f64).sqrt();
        Some(Fitted { state, fit, free: free.to_vec(), inliers, rms_px })
    }

    /// m ln(S / m) + 2 p + 2 p (p + 1) / (m - p - 1), with S the sum of the squared residuals of some points.
    fn criterion(&self, found: &Fitted, points: &[usize]) -> Option<f64> {
        let (m, p) = (2.0 * points.len() as f64, found.free.len() as f64 + 1.0);
        let sum_sq: Option<f64> =
            points.iter().map(|&i| self.residual(&found.state, i).map(|r| r.length_squared())).sum();
        // Residuals below a millionth of a pixel leave nothing to explain.
        let mean_sq = (sum_sq? / m).max(1e-12);
        (m - p - 1.0 > 0.0).then(|| m * mean_sq.ln() + 2.0 * p + 2.0 * p * (p + 1.0) / (m - p - 1.0))
    }

    fn calibration(&self, found: Fitted, is_planar: bool) -> Result<PointCalibration, PointError> {
        let freedom = (2 * found.inliers.len()).saturating_sub(found.free.len());
        let unit = found.fit.unit_covariance();
        let focal = found.free.iter().position(|&p| p == FOCAL);
        let assumed_px = if freedom > 0 { noise_px(&found).max(LEAST_NOISE_PX) } else { LEAST_NOISE_PX };
        if let Some(focal) = focal {
            let sd = unit.as_ref().map_or(f64::INFINITY, |unit| unit[(focal, focal)].sqrt() * assumed_px);
            if sd > MAX_FOCAL_SD {
                return Err(PointError::FocalUnknown { relative_sd: sd.min(9.99) });
            }
        }
        let unit = unit.ok_or(PointError::Undetermined)?;
        // With few residuals more than points need, these may be small by chance: they count beside one of a pixel.
        let noise_px = match freedom {
            0 => f64::NAN,
            _ => ((found.fit.sum_sq() + USUAL_NOISE_PX.powi(2)) / (freedom + 1) as f64).sqrt(),
        };
        let covariance = unit * (noise_px * noise_px);
        let camera = self.camera(&found.state).validated()?;
        let residual = |point: usize| {
            let pixel =
                camera.project(self.places[point]).map(|projected| projected - self.given(&camera, point));
            pixel.unwrap_or(DVec2::NAN)
        };
        Ok(PointCalibration {
            estimates: self.estimates(&found, &covariance),
            residuals_px: (0..self.places.len()).map(residual).collect(),
            outliers: (0..self.places.len()).filter(|i| !found.inliers.contains(i)).collect(),
            rms_px: found.rms_px,
            noise_px,
            degrees_of_freedom: freedom,
            covariance,
            is_planar,
            camera,
        })
    }

    /// The pixel as given.
    fn given(&self, camera: &Camera, point: usize) -> DVec2 {
        let pixel = self.pixels[point];
        match self.lens {
            KnownLens::All { focal_px, centre_px, .. } => {
                let v = centre_px.y + (pixel.y - centre_px.y) * focal_px.y / focal_px.x;
                camera.distort(DVec2::new(pixel.x, v)).unwrap_or(DVec2::NAN)
            }
            _ => pixel,
        }
    }

    fn camera(&self, state: &State) -> Camera {
        let (focal_px, centre_px, distortion) = match self.lens {
            KnownLens::All { focal_px, centre_px, distortion } => (focal_px, centre_px, distortion),
            _ => (
                DVec2::splat(state.focal_px),
                state.centre_px,
                Distortion::from_opencv([state.k[0], state.k[1], 0.0, 0.0, 0.0]),
            ),
        };
        let (rotation, translation) = (state.rotation, state.translation);
        Camera { size: self.size, focal_px, centre_px, distortion, rotation, translation }
    }

    fn estimates(&self, found: &Fitted, covariance: &DMatrix<f64>) -> Vec<Estimate> {
        let state = &found.state;
        let values = [state.focal_px, state.centre_px.x, state.centre_px.y, state.k[0], state.k[1]];
        let of_lens = found.free.iter().enumerate().filter(|(_, p)| **p < NAMES.len()).map(|(row, &p)| {
            let scale = if p == FOCAL { state.focal_px } else { 1.0 };
            Estimate { name: NAMES[p], value: values[p], sd: covariance[(row, row)].sqrt() * scale }
        });
        let mut estimates: Vec<Estimate> = of_lens.collect();
        // c = -Rᵀ t; with R -> exp(w) R and t -> t + d: dc = -Rᵀ d + Rᵀ (w x t), and r . (w x t) = w . (t x r).
        let rows: Vec<usize> =
            found.free.iter().enumerate().filter(|(_, p)| **p >= 5).map(|(i, _)| i).collect();
        let place = -(state.rotation.transpose() * state.translation);
        let t = state.translation;
        for (axis, name) in ["x_m", "y_m", "z_m"].into_iter().enumerate() {
            let r = state.rotation.col(axis);
            let turn = t.cross(r);
            let gradient = [turn.x, turn.y, turn.z, -r.x, -r.y, -r.z];
            let mut variance = 0.0;
            for (i, a) in rows.iter().zip(gradient) {
                for (j, b) in rows.iter().zip(gradient) {
                    variance += a * covariance[(*i, *j)] * b;
                }
            }
            estimates.push(Estimate { name, value: place[axis], sd: variance.sqrt() });
        }
        estimates
    }
}

/// Standard deviation of a pixel coordinate.
fn noise_px(found: &Fitted) -> f64 {
    let freedom = (2 * found.inliers.len()).saturating_sub(found.free.len());
    (found.fit.sum_sq() / freedom.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests;
