//! Resection: the pose of known points from their image.
//!
//! Lee and Chen (1985, section 2.1) determine the pose of a head from six feature points; a camera is
//! calibrated in the same way from points with measured positions.
//!
//! | function | needs | gives |
//! |---|---|---|
//! | [`linear_resection`] | 6 points, not coplanar | eqs. (1)-(5): `[T]`, `[R]`, f and position, no uncertainty |
//! | [`resect`] | 4 points with f known, 6 with f free | every least-squares pose, with covariance |
//! | [`resect_in_image`] | a [`Camera`](crate::model::Camera), 4 pixels | the same, through its lens |
//!
//! # Frames
//!
//! Head: right-handed; x forward, y up, z to the head's right (Table A.2). The *head plane* is spanned by y
//! and z, so its normal, the facing direction, is x: the paper uses the normal without defining the plane.
//!
//! Camera: OpenCV axes (x right, y down, z forward) with the origin in the centre of projection. The paper's
//! camera is left-handed (y up) with its origin on the image plane, f in front of the centre of projection:
//!
//! ```text
//! x = x_paper,   y = -y_paper,   z = z_paper + f
//! ```
//!
//! Its "camera position" is that origin, which requires that image and head have the same unit. Only
//! [`LinearResection`], [`PaperView`] and the reproduction of Table 2 use the paper's axes.
//!
//! # Limits
//!
//! A head is 20 cm long. Seen from 4 m at 480 px/m, the depth of its neck is uncertain by 5 to 7 cm per pixel
//! of noise and its facing direction by 1 to 3 degrees; with f free the depth is nearly undetermined. Points
//! are assumed to be matched and independent, with one common standard deviation. Outliers are not searched
//! for; they increase [`ResectedPose::chi_squared`] if the standard deviation is given.

mod linear;
mod pose;
mod search;
mod three_points;

pub use linear::{Conditioning, LinearResection, PaperView, linear_resection};
pub use pose::{Facing, PointEstimate, ResectedPose};
pub use search::{Focal, Resection, ResectionOptions, resect, resect_in_image};

use crate::OptionError;
use crate::model::body::BodyError;
use crate::model::camera::CameraError;
use crate::wording::counted;
use glam::{DMat3, DVec2, DVec3};
use nalgebra::{DMatrix, Matrix3};
use thiserror::Error;

/// Largest accepted coordinate, in the caller's unit.
pub const MAX_COORDINATE: f64 = 1e9;
/// Smallest accepted spread of points, in the caller's unit.
pub const MIN_SPREAD: f64 = 1e-9;
/// Points are collinear or coplanar below this ratio of the singular values of their centred coordinates.
pub const MIN_SHAPE_RATIO: f64 = 1e-6;

/// Why no pose of the head was found.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ResectionError {
    /// There are not enough points.
    #[error("{method} needs at least {needed} points, got {count}")]
    TooFewPoints {
        /// The method requested.
        method: &'static str,
        /// Points given.
        count: usize,
        /// Points needed.
        needed: usize,
    },
    /// The numbers of head points and image points differ.
    #[error("{} but {}", counted(*head, "head point"), counted(*image, "image point"))]
    Unpaired {
        /// Number of head points.
        head: usize,
        /// Number of image points.
        image: usize,
    },
    /// A coordinate is NaN, infinite or larger than [`MAX_COORDINATE`].
    #[error("{kind} point {index} must be finite and at most {MAX_COORDINATE:e} in size, got {value}")]
    Coordinate {
        /// "head" or "image".
        kind: &'static str,
        /// Index of the point.
        index: usize,
        /// The offending coordinate.
        value: f64,
    },
    /// Two head points coincide.
    #[error("head points {first} and {second} coincide")]
    Duplicate {
        /// Index of one point.
        first: usize,
        /// Index of the other point.
        second: usize,
    },
    /// The head points lie on one line: the rotation about it is undetermined.
    #[error("head points are collinear: singular value ratio {ratio:.1e}, needed {MIN_SHAPE_RATIO:e}")]
    Collinear {
        /// Second over first singular value of the centred points.
        ratio: f64,
    },
    /// The head points lie in one plane; eq. (3) then does not determine `[T]`.
    #[error("head points are coplanar: singular value ratio {ratio:.1e}, needed {MIN_SHAPE_RATIO:e}")]
    Coplanar {
        /// Third over first singular value of the centred points.
        ratio: f64,
    },
    /// All image points coincide.
    #[error("image points lie within {spread:.1e} of each other")]
    ImageSpread {
        /// Root mean square distance from their centroid.
        spread: f64,
    },
    /// The equations have more than one solution.
    #[error("the points leave the answer undetermined: singular value ratio {ratio:.1e}, needed {needed:e}")]
    Undetermined {
        /// Ratio of the singular value that must not vanish to the largest one.
        ratio: f64,
        /// Smallest allowed ratio.
        needed: f64,
    },
    /// The linear solution puts points on both sides of the camera.
    #[error("the linear solution puts point {index} behind the camera (H = {scale:.3e})")]
    BehindCamera {
        /// Index of the point.
        index: usize,
        /// Its homogeneous scale H of eq. (1).
        scale: f64,
    },
    /// The linear solution mirrors the head.
    #[error("the linear solution is no rotation: determinant {determinant:.3}")]
    Mirrored {
        /// Determinant of `[R]`.
        determinant: f64,
    },
    /// The search converged from no start.
    #[error("none of {starts} starting poses led to a pose with all points in front of the camera")]
    NoPose {
        /// Number of poses tried.
        starts: usize,
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// The camera is invalid, or its lens model does not cover a pixel.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The body height is implausible.
    #[error(transparent)]
    Body(#[from] BodyError),
}

/// The centroid of points and their spread.
#[derive(Debug, Clone, Copy)]
struct Shape {
    centroid: DVec3,
    /// Root mean square distance from the centroid.
    radius: f64,
    /// Second and third over first singular value of the centred points.
    ratios: [f64; 2],
    /// Unit direction in which the points spread least.
    thin_axis: DVec3,
}

/// Returns an error for points that are unpaired, too few, not finite, duplicate or collinear.
fn checked_shape(
    method: &'static str,
    needed: usize,
    points_in_head: &[DVec3],
    image_points: &[DVec2],
) -> Result<Shape, ResectionError> {
    let (head, image) = (points_in_head.len(), image_points.len());
    if head != image {
        return Err(ResectionError::Unpaired { head, image });
    }
    if head < needed {
        return Err(ResectionError::TooFewPoints { method, count: head, needed });
    }
    check_coordinates("head", points_in_head.iter().map(DVec3::to_array))?;
    check_coordinates("image", image_points.iter().map(DVec2::to_array))?;
    let shape = shape_of(points_in_head)?;
    check_duplicates(points_in_head, shape.radius)?;
    if shape.ratios[0] < MIN_SHAPE_RATIO {
        return Err(ResectionError::Collinear { ratio: shape.ratios[0] });
    }
    let (_, spread) = centroid_and_spread(image_points);
    if spread < MIN_SPREAD {
        return Err(ResectionError::ImageSpread { spread });
    }
    Ok(shape)
}

fn check_coordinates<const N: usize>(
    kind: &'static str,
    points: impl Iterator<Item = [f64; N]>,
) -> Result<(), ResectionError> {
    for (index, point) in points.enumerate() {
        if let Some(&value) = point.iter().find(|x| x.is_nan() || x.abs() > MAX_COORDINATE) {
            return Err(ResectionError::Coordinate { kind, index, value });
        }
    }
    Ok(())
}

fn check_duplicates(points: &[DVec3], radius: f64) -> Result<(), ResectionError> {
    for (first, a) in points.iter().enumerate() {
        if let Some(gap) = points[first + 1..].iter().position(|b| a.distance(*b) <= 1e-9 * radius) {
            return Err(ResectionError::Duplicate { first, second: first + 1 + gap });
        }
    }
    Ok(())
}

fn shape_of(points: &[DVec3]) -> Result<Shape, ResectionError> {
    let centroid = points.iter().sum::<DVec3>() / points.len() as f64;
    let centred: Vec<DVec3> = points.iter().map(|p| *p - centroid).collect();
    let radius = (centred.iter().map(|p| p.length_squared()).sum::<f64>() / points.len() as f64).sqrt();
    if radius <= MIN_SPREAD {
        return Err(ResectionError::Duplicate { first: 0, second: 1 });
    }
    let matrix =
        DMatrix::from_fn(points.len().max(3), 3, |i, j| centred.get(i).map_or(0.0, |p| p[j] / radius));
    let (sigma, v_t) = right_svd(matrix).ok_or(ResectionError::Collinear { ratio: 0.0 })?;
    let ratios = [sigma[1] / sigma[0], sigma[2] / sigma[0]];
    let thin_axis = DVec3::new(v_t[(2, 0)], v_t[(2, 1)], v_t[(2, 2)]);
    Ok(Shape { centroid, radius, ratios, thin_axis })
}

fn centroid_and_spread(points: &[DVec2]) -> (DVec2, f64) {
    let count = points.len() as f64;
    let centroid = points.iter().sum::<DVec2>() / count;
    let sum_sq: f64 = points.iter().map(|p| p.distance_squared(centroid)).sum();
    (centroid, (sum_sq / count).sqrt())
}

/// Singular values in descending order, and Vᵀ; `None` if the iteration does not converge.
fn right_svd(matrix: DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let svd = matrix.try_svd(false, true, f64::EPSILON, 10_000)?;
    let v_t = svd.v_t?;
    Some((svd.singular_values.iter().copied().collect(), v_t))
}

/// The rotation nearest to a matrix in the Frobenius norm.
fn nearest_rotation(matrix: DMat3) -> Option<DMat3> {
    let svd = to_nalgebra(matrix).try_svd(true, true, f64::EPSILON, 10_000)?;
    let (u, v_t) = (svd.u?, svd.v_t?);
    let handedness = (u * v_t).determinant().signum();
    let fixed = u * Matrix3::from_diagonal(&[1.0, 1.0, handedness].into()) * v_t;
    let rotation = DMat3::from_cols_slice(fixed.as_slice());
    rotation.is_finite().then_some(rotation)
}

fn to_nalgebra(matrix: DMat3) -> Matrix3<f64> {
    Matrix3::from_column_slice(&matrix.to_cols_array())
}
