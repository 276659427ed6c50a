//! Camera calibration from a person of known height who walks through the image.
//!
//! For a camera of focal length f, pitch, roll and height above the ground, the image of the feet determines
//! where the person stands; the predicted image of the head is compared with the measured one (the geometry
//! of Lv, Zhao and Nevatia 2006: the line through the feet of two positions and the line through their heads
//! meet on the horizon; the bodies point to the vertical vanishing point). All sightings are fitted together
//! by least squares; weights reduce the influence of outliers.
//!
//! ```text
//! x_cam = R_z(roll) R_x(pitch) R_level (x_world - (0, 0, height)),   R_level: looking along world Y
//! ```
//!
//! The origin of the world is on the ground below the mean position of the person; its Y axis is the viewing
//! direction of the camera. A camera is level up to some degrees: roll has a prior of 2 degrees, and the
//! focal length has a prior of a factor of e about the image width. Both are weak compared with any walk that
//! determines these parameters. The principal point is the image centre unless the lens is known.
//!
//! # Limits
//!
//! The distance between horizon and vertical vanishing point determines f, f² = -(v_y - c_y) (h_y - c_y): for
//! a level camera the latter is at infinity, and a person who always stays equally far away shows neither. In
//! these cases the focal length is refused; with a known field of view the other parameters may still be
//! determined. All lengths are proportional to the person's height. A walker bends and sways by a hundredth
//! of the height, more than the error of a detector; this is averaged, not modelled. A forward lean averages
//! out only if the person also comes back; the standard deviations for a walk in one direction allow for it.

use crate::wording::counted;
use glam::{DMat3, DVec2, DVec3};
use nalgebra::DVector;
use thiserror::Error;

use super::{CHANCE, Estimate, KnownLens, MAX_FOCAL_SD};
use crate::estimate::least_squares::{Fit, MOST_ITERATIONS, minimise};
use crate::model::camera::{Camera, CameraError};
use crate::model::distortion::Distortion;

/// Number of sightings needed.
const NEEDED: usize = 4;
/// Standard deviation of the prior of the camera's roll, radians (2 degrees).
const ROLL_SD_RAD: f64 = 0.035;
/// Standard deviation of the prior of an unknown focal length, as the logarithm of its ratio to the longer
/// side of the image: a factor of e.
const FOCAL_SD: f64 = 1.0;
/// Lower bound of the sway of a walker and the error of a detector, as a fraction of the height.
const LEAST_NOISE: f64 = 0.005;
/// The pitch is determined if its standard deviation is below this, radians.
const MAX_PITCH_SD_RAD: f64 = 0.09;
/// Common error of head or feet in all sightings if a person only walks in one direction, as a fraction of
/// the height. In three recorded walks the head was 0.03 to 0.04 in front of the midpoint of the feet; half
/// of that is the standard deviation, so it depends on these three walks.
const LEAN: f64 = 0.02;
const FOCAL: usize = 0;
const PITCH: usize = 1;
const ROLL: usize = 2;
const HEIGHT: usize = 3;

/// Why no camera was found.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WalkerError {
    /// The person's height is implausible.
    #[error("the person's height must be 0.5 to 2.5 metres, got {height_m}")]
    PersonHeight {
        /// The height given, metres.
        height_m: f64,
    },
    /// A pixel is NaN or infinite.
    #[error("sighting {index} has a pixel that is not finite")]
    NotFinite {
        /// Index of the sighting, from 0.
        index: usize,
    },
    /// There are not enough sightings.
    #[error("{} of the whole person from head to feet: {NEEDED} are needed", counted(*count, "sighting"))]
    TooFew {
        /// Number of sightings given.
        count: usize,
    },
    /// The person is upside down.
    #[error("in {count} of {} the head is not above the feet: v counts downwards", counted(*total, "sighting"))]
    UpsideDown {
        /// Number of sightings in which the head is below the feet.
        count: usize,
        /// Number of all sightings.
        total: usize,
    },
    /// The walk does not determine the focal length.
    #[error(
        "the walk does not tell the focal length (it would be known to ±{:.0} %): the person should come nearer and go farther under a camera that looks down; or give the field of view",
        relative_sd * 100.0
    )]
    FocalUnknown {
        /// Standard deviation of the focal length, divided by the focal length.
        relative_sd: f64,
    },
    /// The walk does not determine the pitch, even with the focal length known.
    #[error(
        "the walk does not tell how far the camera looks down (it would be known to ±{:.0} degrees): the person should come nearer and go farther",
        sd_rad.to_degrees()
    )]
    PitchUnknown {
        /// Standard deviation of the pitch, radians.
        sd_rad: f64,
    },
    /// No camera is consistent with the sightings.
    #[error(
        "no camera over flat ground shows a person of {height_m} m so: nearest is {rms_px:.0} px off at {person_px:.0} px of height"
    )]
    NoCamera {
        /// The person's height, metres.
        height_m: f64,
        /// Root mean square residual of the best camera, pixels.
        rms_px: f64,
        /// Median height of the person in the image, pixels.
        person_px: f64,
    },
    /// The camera is not valid.
    #[error(transparent)]
    Camera(#[from] CameraError),
}

/// A person in one frame, from head to feet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkerSighting {
    /// The lower point, pixels.
    pub foot_px: DVec2,
    /// The upper point, pixels.
    pub head_px: DVec2,
    /// Height of the lower point above the ground, as a fraction of the person's height.
    pub foot_share: f64,
    /// Height of the upper point above the ground, as a fraction of the person's height.
    pub head_share: f64,
}

impl WalkerSighting {
    /// A sighting from the midpoints of the lower and the upper side of a rectangle.
    pub fn from_rectangle(foot_px: DVec2, head_px: DVec2) -> Self {
        Self { foot_px, head_px, foot_share: 0.0, head_share: 1.0 }
    }
}

/// Known quantities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WalkerOptions {
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
    /// Height of the person, crown to sole, metres.
    pub height_m: f64,
    /// Known lens parameters.
    pub lens: KnownLens,
}

/// A camera and its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct WalkerCalibration {
    /// The camera; the origin is on the ground below the mean position of the person, Y is the viewing
    /// direction.
    pub camera: Camera,
    /// `focal_px` unless it was given, `pitch_deg` (down), `roll_deg`, and `height_m` of the camera. Their
    /// standard deviations take into account that the sightings of one stride have similar errors, and allow
    /// for a lean if the person walks in one direction.
    pub estimates: Vec<Estimate>,
    /// Fitted minus measured head of every sighting, pixels; NaN where the feet are above the horizon.
    pub residuals_px: Vec<DVec2>,
    /// Indices of the sightings left out, from 0.
    pub outliers: Vec<usize>,
    /// Root mean square of the residuals of the other sightings, pixels.
    pub rms_px: f64,
    /// Median distance between head and feet, pixels.
    pub person_px: f64,
    /// Number of consecutive sightings with similar errors.
    pub alike: f64,
    /// Where the person stood, world axes, metres; NaN where the feet are above the horizon.
    pub places: Vec<DVec3>,
}

/// The camera that fits the sightings of a walker.
///
/// `sightings` in the order of time.
///
/// # Errors
///
/// Sightings that are too few, not finite or upside down; walks that do not determine the camera; sightings
/// that are not consistent with any camera.
pub fn camera_from_walker(
    sightings: &[WalkerSighting],
    options: &WalkerOptions,
) -> Result<WalkerCalibration, WalkerError> {
    let problem = Problem::new(sightings, options)?;
    // 1. The best of a grid, then fits with weights that suppress outliers.
    let mut parameters = problem.start();
    let mut weights = vec![1.0; problem.sightings.len()];
    for _ in 0..10 {
        let distances = problem.distances(&parameters);
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let scale = (2.0 * sorted[sorted.len() / 2]).max(1e-6 * problem.person_px);
        for (weight, distance) in weights.iter_mut().zip(&distances) {
            let is_seen = *distance < problem.far_px();
            *weight = f64::from(u8::from(is_seen)) / (1.0 + (distance / scale).powi(2));
        }
        parameters = problem.fit(&parameters, &weights).map_or(parameters, |fit| problem.all(&fit));
    }
    // 2. Least squares on the inliers.
    let (fit, inliers) = problem.without_outliers(&parameters)?;
    // 3. Parameters and their uncertainties.
    problem.calibration(&fit, &inliers)
}

struct Problem {
    /// In ideal pixels, relative to the principal point, with square pixels.
    sightings: Vec<WalkerSighting>,
    options: WalkerOptions,
    centre_px: DVec2,
    known_focal_px: Option<f64>,
    person_px: f64,
    width_px: f64,
}

impl Problem {
    fn new(sightings: &[WalkerSighting], options: &WalkerOptions) -> Result<Self, WalkerError> {
        let height_m = options.height_m;
        if !(0.5..=2.5).contains(&height_m) {
            return Err(WalkerError::PersonHeight { height_m });
        }
        if options.size.contains(&0) {
            return Err(CameraError::Size { size: options.size }.into());
        }
        if let Some(index) = sightings.iter().position(|s| !(s.foot_px.is_finite() && s.head_px.is_finite()))
        {
            return Err(WalkerError::NotFinite { index });
        }
        let total = sightings.len();
        if total < NEEDED {
            return Err(WalkerError::TooFew { count: total });
        }
        let count = sightings.iter().filter(|s| s.head_px.y >= s.foot_px.y).count();
        if 2 * count > total {
            return Err(WalkerError::UpsideDown { count, total });
        }
        let sides = DVec2::new(f64::from(options.size[0]), f64::from(options.size[1]));
        let mut problem = Self {
            sightings: sightings.to_vec(),
            options: *options,
            centre_px: sides / 2.0 - 0.5,
            known_focal_px: None,
            person_px: 0.0,
            width_px: sides.x.max(sides.y),
        };
        let camera = problem.lens()?;
        for sighting in &mut problem.sightings {
            for pixel in [&mut sighting.foot_px, &mut sighting.head_px] {
                *pixel = (camera.undistort(*pixel)? - camera.centre_px)
                    * DVec2::new(1.0, camera.focal_px.x / camera.focal_px.y);
            }
        }
        problem.centre_px = camera.centre_px;
        let mut heights: Vec<f64> = problem.sightings.iter().map(|s| s.head_px.distance(s.foot_px)).collect();
        heights.sort_by(f64::total_cmp);
        problem.person_px = heights[heights.len() / 2].max(1e-3);
        Ok(problem)
    }

    /// A camera at the origin with the known lens; sets the known focal length.
    fn lens(&mut self) -> Result<Camera, WalkerError> {
        let (focal_px, centre_px, distortion) = match self.options.lens {
            KnownLens::Nothing => (DVec2::splat(self.width_px), self.centre_px, Distortion::None),
            KnownLens::Focal(focal) => (DVec2::splat(focal), self.centre_px, Distortion::None),
            KnownLens::All { focal_px, centre_px, distortion } => (focal_px, centre_px, distortion),
        };
        if self.options.lens != KnownLens::Nothing {
            self.known_focal_px = Some(focal_px.x);
        }
        let (size, rotation, translation) = (self.options.size, DMat3::IDENTITY, DVec3::ZERO);
        Ok(Camera { size, focal_px, centre_px, distortion, rotation, translation }.validated()?)
    }

    fn rotation(parameters: &[f64; 4]) -> DMat3 {
        let level = DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y);
        DMat3::from_rotation_z(parameters[ROLL]) * DMat3::from_rotation_x(parameters[PITCH]) * level
    }

    /// Where the person stands, if the feet are below the horizon.
    fn place(&self, parameters: &[f64; 4], rotation: &DMat3, sighting: &WalkerSighting) -> Option<DVec3> {
        let ray = rotation.transpose() * sighting.foot_px.extend(parameters[FOCAL].exp());
        let drop_m = parameters[HEIGHT].exp() - sighting.foot_share * self.options.height_m;
        let share = -drop_m / ray.z;
        (drop_m > 0.0 && share > 0.0 && share.is_finite()).then(|| (ray * share).with_z(0.0))
    }

    /// Fitted minus measured head, pixels.
    fn residual(&self, parameters: &[f64; 4], rotation: &DMat3, sighting: &WalkerSighting) -> Option<DVec2> {
        let place = self.place(parameters, rotation, sighting)?;
        let rise_m = sighting.head_share * self.options.height_m - parameters[HEIGHT].exp();
        let p = *rotation * place.with_z(rise_m);
        (p.z > 1e-6).then(|| p.truncate() / p.z * parameters[FOCAL].exp() - sighting.head_px)
    }

    fn residuals(&self, parameters: &[f64; 4]) -> Vec<Option<DVec2>> {
        let rotation = Self::rotation(parameters);
        self.sightings.iter().map(|s| self.residual(parameters, &rotation, s)).collect()
    }

    fn far_px(&self) -> f64 {
        10.0 * self.width_px
    }

    /// Lengths of the residuals; a large value where there is none.
    fn distances(&self, parameters: &[f64; 4]) -> Vec<f64> {
        let far = self.far_px();
        self.residuals(parameters).into_iter().map(|r| r.map_or(far, |r| r.length().min(far))).collect()
    }

    /// The best of some hundred cameras, by the median residual.
    fn start(&self) -> [f64; 4] {
        let focals: Vec<f64> = match self.known_focal_px {
            Some(focal) => vec![focal],
            None => [0.6, 0.9, 1.3, 2.0, 3.5].map(|share| share * self.width_px).to_vec(),
        };
        let mut best = (f64::INFINITY, [self.width_px.ln(), 0.0, 0.0, 0.0]);
        for focal in focals {
            for pitch_deg in [-15.0, -5.0, 0.0, 3.0, 8.0, 15.0, 25.0, 35.0, 50.0, 70.0_f64] {
                for step in 0..24 {
                    let height_m = 0.25 * 1.25_f64.powi(step);
                    let parameters = [focal.ln(), pitch_deg.to_radians(), 0.0, height_m.ln()];
                    let mut distances = self.distances(&parameters);
                    let middle = distances.len() / 2;
                    let (_, median, _) = distances.select_nth_unstable_by(middle, f64::total_cmp);
                    if *median < best.0 {
                        best = (*median, parameters);
                    }
                }
            }
        }
        best.1
    }

    fn is_free(&self) -> [bool; 4] {
        [self.known_focal_px.is_none(), true, true, true]
    }

    /// All four parameters of a fit.
    fn all(&self, fit: &Fit) -> [f64; 4] {
        let mut free = fit.parameters.iter();
        let fixed = self.known_focal_px.map_or(0.0, f64::ln);
        self.is_free().map(|is_free| if is_free { free.next().copied().unwrap_or_default() } else { fixed })
    }

    fn fit(&self, start: &[f64; 4], weights: &[f64]) -> Option<Fit> {
        let free: Vec<f64> =
            start.iter().zip(self.is_free()).filter(|(_, is_free)| *is_free).map(|(p, _)| *p).collect();
        let fixed = self.known_focal_px.map_or(0.0, f64::ln);
        let noise_px = LEAST_NOISE * self.person_px;
        let residuals = |free: &DVector<f64>| {
            let mut given = free.iter();
            let parameters =
                self.is_free().map(|is| if is { given.next().copied().unwrap_or_default() } else { fixed });
            let (focal, pitch) = (parameters[FOCAL], parameters[PITCH]);
            if pitch.abs() > 1.55 || !(0.0..20.0).contains(&focal) || parameters[HEIGHT].abs() > 8.0 {
                return None;
            }
            let mut all = Vec::with_capacity(2 * weights.len() + 1);
            for (residual, weight) in self.residuals(&parameters).into_iter().zip(weights) {
                if *weight > 0.0 {
                    // Head and foot are both measured with noise, and the noise of the foot moves the fitted
                    // head equally.
                    let r = residual? * (weight / 2.0).sqrt();
                    all.extend([r.x, r.y]);
                }
            }
            all.push(parameters[ROLL] / ROLL_SD_RAD * noise_px);
            all.push((parameters[FOCAL] - fixed.max(self.width_px.ln())) / FOCAL_SD * noise_px);
            Some(DVector::from_vec(all))
        };
        // Sightings above the horizon at the start cannot be fitted.
        minimise(DVector::from_vec(free.clone()), &vec![1e-6; free.len()], MOST_ITERATIONS, residuals)
    }

    fn without_outliers(&self, start: &[f64; 4]) -> Result<(Fit, Vec<usize>), WalkerError> {
        let mut parameters = *start;
        let count = self.sightings.len();
        let mut inliers: Vec<usize> = Vec::new();
        let mut last = None;
        for _ in 0..10 {
            let distances = self.distances(&parameters);
            let mut sorted = distances.clone();
            sorted.sort_by(f64::total_cmp);
            // For normal noise in two dimensions the median is 1.18 standard deviations.
            let variance = (sorted[count / 2] / 1.18).powi(2).max(1e-12);
            let limit = (2.0 * variance * (count as f64 / CHANCE).ln()).sqrt();
            let next: Vec<usize> = (0..count).filter(|&i| distances[i] <= limit).collect();
            if next == inliers {
                break;
            }
            inliers = next;
            let weights: Vec<f64> = (0..count).map(|i| f64::from(u8::from(inliers.contains(&i)))).collect();
            let Some(fit) = self.fit(&parameters, &weights) else { break };
            parameters = self.all(&fit);
            last = Some(fit);
        }
        let no_camera = || WalkerError::NoCamera {
            height_m: self.options.height_m,
            rms_px: f64::INFINITY,
            person_px: self.person_px,
        };
        match last {
            Some(fit) if inliers.len() >= NEEDED => Ok((fit, inliers)),
            _ => Err(no_camera()),
        }
    }

    fn calibration(&self, fit: &Fit, inliers: &[usize]) -> Result<WalkerCalibration, WalkerError> {
        let parameters = self.all(fit);
        let residuals = self.residuals(&parameters);
        let rms_px = {
            let of_inliers = inliers.iter().filter_map(|&i| residuals[i]).map(|r| r.length_squared());
            (of_inliers.sum::<f64>() / inliers.len() as f64).sqrt()
        };
        if rms_px > 0.15 * self.person_px || 2 * inliers.len() < self.sightings.len() {
            let (height_m, person_px) = (self.options.height_m, self.person_px);
            return Err(WalkerError::NoCamera { height_m, rms_px, person_px });
        }
        let alike = alike(&inliers.iter().filter_map(|&i| residuals[i]).map(|r| r.y).collect::<Vec<_>>());
        let lean_px = LEAN * self.person_px * self.one_way(&parameters, inliers);
        let covariance = fit.unit_covariance();
        let free: Vec<usize> = (0..4).filter(|&i| self.is_free()[i]).collect();
        let equations = (2 * inliers.len()).saturating_sub(free.len()).max(1);
        let fitted_px = (inliers.len() as f64 * rms_px.powi(2) / 2.0 / equations as f64).sqrt();
        let sd_of = |parameter: usize, variance_px: f64| {
            let row = free.iter().position(|&p| p == parameter);
            let (Some(covariance), Some(row)) = (&covariance, row) else { return f64::INFINITY };
            (covariance[(row, row)] * variance_px).sqrt()
        };
        // Whether a parameter is determined depends on the noise; its standard deviation also includes the
        // lean shared by all sightings.
        let shared_px = inliers.len() as f64 * lean_px.powi(2);
        let sd = |parameter: usize| sd_of(parameter, alike * fitted_px.powi(2) + shared_px);
        let assumed_px = alike * fitted_px.max(LEAST_NOISE * self.person_px).powi(2);
        if self.known_focal_px.is_none() {
            let relative_sd = sd_of(FOCAL, assumed_px);
            if relative_sd > MAX_FOCAL_SD {
                return Err(WalkerError::FocalUnknown { relative_sd: relative_sd.min(9.99) });
            }
        }
        let sd_rad = sd_of(PITCH, assumed_px);
        if sd_rad > MAX_PITCH_SD_RAD {
            return Err(WalkerError::PitchUnknown { sd_rad: sd_rad.min(1.57) });
        }
        let (focal_px, height_m) = (parameters[FOCAL].exp(), parameters[HEIGHT].exp());
        let mut estimates = Vec::new();
        if self.known_focal_px.is_none() {
            estimates.push(Estimate { name: "focal_px", value: focal_px, sd: focal_px * sd(FOCAL) });
        }
        for (name, parameter) in [("pitch_deg", PITCH), ("roll_deg", ROLL)] {
            let (value, sd) = (parameters[parameter].to_degrees(), sd(parameter).to_degrees());
            estimates.push(Estimate { name, value, sd });
        }
        estimates.push(Estimate { name: "height_m", value: height_m, sd: height_m * sd(HEIGHT) });
        self.described(&parameters, residuals, inliers, rms_px, alike, estimates)
    }

    /// 1 if the person always walks in the same direction, 0 if the path ends where it began: the distance
    /// between the ends divided by the path length in eight pieces, so that steps and noise do not add to the
    /// length.
    fn one_way(&self, parameters: &[f64; 4], inliers: &[usize]) -> f64 {
        let rotation = Self::rotation(parameters);
        let places: Vec<DVec3> =
            inliers.iter().filter_map(|&i| self.place(parameters, &rotation, &self.sightings[i])).collect();
        let Some(last) = places.len().checked_sub(1) else { return 1.0 };
        let corners: Vec<DVec3> = (0..=8).map(|piece| places[piece * last / 8]).collect();
        let length_m: f64 = corners.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        if length_m > 0.0 { (corners[0].distance(corners[8]) / length_m).min(1.0) } else { 1.0 }
    }

    fn described(
        &self,
        parameters: &[f64; 4],
        residuals: Vec<Option<DVec2>>,
        inliers: &[usize],
        rms_px: f64,
        alike: f64,
        estimates: Vec<Estimate>,
    ) -> Result<WalkerCalibration, WalkerError> {
        let rotation = Self::rotation(parameters);
        let place = |s: &WalkerSighting| self.place(parameters, &rotation, s);
        let mean =
            inliers.iter().filter_map(|&i| place(&self.sightings[i])).sum::<DVec3>() / inliers.len() as f64;
        let (focal_px, centre_px, distortion) = match self.options.lens {
            KnownLens::All { focal_px, centre_px, distortion } => (focal_px, centre_px, distortion),
            _ => (DVec2::splat(parameters[FOCAL].exp()), self.centre_px, Distortion::None),
        };
        let translation = rotation * (mean - DVec3::Z * parameters[HEIGHT].exp());
        let camera =
            Camera { size: self.options.size, focal_px, centre_px, distortion, rotation, translation };
        Ok(WalkerCalibration {
            camera: camera.validated()?,
            estimates,
            residuals_px: residuals.into_iter().map(|r| r.unwrap_or(DVec2::NAN)).collect(),
            outliers: (0..self.sightings.len()).filter(|i| !inliers.contains(i)).collect(),
            rms_px,
            person_px: self.person_px,
            alike,
            places: self.sightings.iter().map(|s| place(s).map_or(DVec3::NAN, |p| p - mean)).collect(),
        })
    }
}

/// 1 + 2 Σ ρ_k over the autocorrelations ρ_k up to the first that is not positive: the number of consecutive
/// values that are similar.
fn alike(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count.max(1.0);
    let product = |lag: usize| -> f64 {
        values.iter().zip(values.iter().skip(lag)).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let variance = product(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let lags = (1..values.len()).map(|lag| product(lag) / variance).take_while(|rho| *rho > 0.05);
    1.0 + 2.0 * lags.sum::<f64>()
}

/// Heights of detected points as fractions of body height: crown, eyes, tragions, nose and mid-shoulders
/// (after Drillis and Contini 1966 and the survey of Gordon et al. 1989). The first visible point is used;
/// ears precede the nose because they are above the ankles.
const HEADS: [(&[&str], f64); 5] = [
    (&["head_top"], 1.0),
    (&["right_ear", "left_ear"], 0.926),
    (&["right_eye", "left_eye"], 0.936),
    (&["nose"], 0.91),
    (&["neck"], 0.83),
];
/// Height of the ankle joint centre, as a fraction of body height.
const ANKLE_SHARE: f64 = 0.042;
/// Largest distance between ankles that pass each other, as a fraction of the height.
const MAX_APART: f64 = 0.15;

/// Sightings from joints over time: the frames in which the ankles pass each other, where the person is
/// highest and upright over one foot; all frames if there are too few of these.
///
/// `names` of the joints in this project's spelling; `points_px` has one row per frame with one pixel
/// position (u, v) per name, NaN where missing.
pub fn sightings_from_joints(names: &[&str], points_px: &[Vec<DVec2>]) -> Vec<WalkerSighting> {
    let column = |name: &str| names.iter().position(|n| *n == name);
    let point =
        |row: &[DVec2], name: &str| column(name).and_then(|c| row.get(c)).copied().filter(|p| p.is_finite());
    let mut seen: Vec<(f64, WalkerSighting)> = Vec::new();
    for row in points_px {
        let (Some(right), Some(left)) = (point(row, "right_ankle"), point(row, "left_ankle")) else {
            continue;
        };
        let head = HEADS.iter().find_map(|(names, share)| {
            let found: Vec<DVec2> = names.iter().filter_map(|name| point(row, name)).collect();
            (!found.is_empty()).then(|| (found.iter().sum::<DVec2>() / found.len() as f64, *share))
        });
        let Some((head_px, head_share)) = head else { continue };
        // The foot on the ground is the lower one; horizontally the body is between both.
        let foot_px = DVec2::new((right.x + left.x) / 2.0, right.y.max(left.y));
        let apart = right.distance(left) / head_px.distance(foot_px).max(1e-9);
        seen.push((apart, WalkerSighting { foot_px, head_px, foot_share: ANKLE_SHARE, head_share }));
    }
    let is_passing = |i: usize| {
        let near = seen[i.saturating_sub(3)..(i + 4).min(seen.len())].iter();
        seen[i].0 < MAX_APART && near.into_iter().all(|(apart, _)| *apart >= seen[i].0)
    };
    let passing: Vec<WalkerSighting> =
        (0..seen.len()).filter(|&i| is_passing(i)).map(|i| seen[i].1).collect();
    if passing.len() >= 2 * NEEDED { passing } else { seen.into_iter().map(|(_, s)| s).collect() }
}

#[cfg(test)]
mod tests;
