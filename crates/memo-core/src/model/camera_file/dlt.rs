//! The eleven coefficients of the direct linear transformation (Abdel-Aziz and Karara 1971), one column per
//! camera, as DLTdv, Argus and Kinovea write them.
//!
//! ```text
//! u = (L1 X + L2 Y + L3 Z + L4) / (L9 X + L10 Y + L11 Z + 1)
//! v = (L5 X + L6 Y + L7 Z + L8) / (L9 X + L10 Y + L11 Z + 1)
//! ```
//!
//! Their matrix is K (R | t) up to scale, so K, R and t follow from orthogonalising its rows from the last to
//! the first (Hartley and Zisserman 2004, section 6.2.4).
//!
//! The coefficients contain neither the image size nor distortion. Their skew is ignored; they are refused if
//! it exceeds a hundredth of the focal length. If the matrix mirrors, either v increases upwards, as in
//! DLTdv, or the origin lies behind the camera; only the caller can tell which.

use crate::wording::counted;
use glam::{DMat3, DVec2, DVec3};

use super::{CameraFileError, CameraFileOptions, FileFormat};
use crate::model::camera::Camera;
use crate::model::distortion::Distortion;

const COEFFICIENTS: usize = 11;
/// Largest skew that is ignored, as a fraction of the focal length.
const MAX_SKEW: f64 = 0.01;

/// Reads the camera whose column is called `name`, or whose column has that number, counted from 1.
pub(super) fn camera(text: &str, options: &CameraFileOptions<'_>) -> Result<Camera, CameraFileError> {
    let (names, rows) = table(text)?;
    let columns: Vec<Vec<f64>> = if rows.len() == COEFFICIENTS {
        (0..rows[0].len()).map(|c| rows.iter().map(|row| row[c]).collect()).collect()
    } else {
        rows
    };
    let names: Vec<String> = match names {
        Some(names) if names.len() == columns.len() => names,
        _ => (1..=columns.len()).map(|number| number.to_string()).collect(),
    };
    let chosen = match options.name {
        None if columns.len() == 1 => 0,
        None => return Err(CameraFileError::SeveralCameras { names }),
        Some(name) => {
            let place = names.iter().position(|n| n == name);
            place.ok_or_else(|| CameraFileError::UnknownCamera { name: name.to_owned(), names })?
        }
    };
    let mut coefficients = [0.0; COEFFICIENTS];
    coefficients.copy_from_slice(&columns[chosen]);
    let size = options.size.ok_or(CameraFileError::SizeNeeded { format: FileFormat::Dlt })?;
    from_coefficients(&coefficients, size, options.v_up, options.unit.map_or(1.0, |unit| unit.metres()))
}

/// The names in the first row, if it has no numbers, and the rows of numbers: 11 rows of equal length, or
/// rows of 11 numbers.
#[expect(clippy::type_complexity, reason = "a table is its header and its rows")]
fn table(text: &str) -> Result<(Option<Vec<String>>, Vec<Vec<f64>>), CameraFileError> {
    let syntax = |line: usize, what: String| CameraFileError::Syntax {
        format: FileFormat::Dlt,
        message: if line > 0 { format!("line {line}: {what}") } else { what },
    };
    let (mut names, mut rows): (Option<Vec<String>>, Vec<Vec<f64>>) = (None, Vec::new());
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let separated = |c: char| matches!(c, ',' | ';') || c.is_whitespace();
        let cells: Vec<&str> = line.split(separated).filter(|cell| !cell.is_empty()).collect();
        if cells.is_empty() || line.trim_start().starts_with('#') {
            continue;
        }
        let numbers: Option<Vec<f64>> = cells.iter().map(|cell| cell.parse().ok()).collect();
        match numbers {
            Some(row) if row.iter().any(|x| !x.is_finite()) => {
                return Err(syntax(index + 1, format!("expected finite numbers, got {}", line.trim())));
            }
            Some(row) if rows.first().is_some_and(|first: &Vec<f64>| first.len() != row.len()) => {
                let expected = rows[0].len();
                return Err(syntax(
                    index + 1,
                    format!("{}, {expected} in the first row", counted(row.len(), "number")),
                ));
            }
            Some(row) => rows.push(row),
            None if rows.is_empty() && names.is_none() => {
                names = Some(cells.iter().map(|cell| cell.trim_matches('"').to_owned()).collect());
            }
            None => {
                let word = cells.iter().find(|cell| cell.parse::<f64>().is_err()).unwrap_or(&"");
                return Err(syntax(index + 1, format!("{word:?} is no number")));
            }
        }
        if rows.len() > COEFFICIENTS && rows[0].len() != COEFFICIENTS {
            return Err(syntax(index + 1, "more than 11 rows of coefficients".to_owned()));
        }
    }
    let is_by_rows = rows.first().is_some_and(|row| row.len() == COEFFICIENTS);
    if rows.len() != COEFFICIENTS && !is_by_rows {
        let got = (rows.len(), rows.first().map_or(0, Vec::len));
        return Err(syntax(
            0,
            format!("expected 11 rows, a column a camera; got {} of {}", counted(got.0, "row"), got.1),
        ));
    }
    Ok((names, rows))
}

/// The camera of eleven coefficients; `unit_m` is the unit of X, Y, Z in metres.
pub(crate) fn from_coefficients(
    coefficients: &[f64; 11],
    size: [u32; 2],
    v_up: Option<bool>,
    unit_m: f64,
) -> Result<Camera, CameraFileError> {
    let l = coefficients;
    let mut rows =
        [DVec3::new(l[0], l[1], l[2]), DVec3::new(l[4], l[5], l[6]), DVec3::new(l[8], l[9], l[10])];
    let mut last = DVec3::new(l[3], l[7], 1.0);
    if v_up == Some(true) {
        let bottom = f64::from(size[1]) - 1.0;
        rows[1] = bottom * rows[2] - rows[1];
        last.y = bottom - last.y;
    }
    // 1. K R from the rows of λ K R, from the last to the first.
    let scale = rows[2].length();
    let [m1, m2, m3] = rows.map(|row| row / scale);
    let (cx, cy) = (m1.dot(m3), m2.dot(m3));
    let fy = (m2 - cy * m3).length();
    let r2 = (m2 - cy * m3) / fy;
    let skew = m1.dot(r2);
    let fx = (m1 - cx * m3 - skew * r2).length();
    let r1 = (m1 - cx * m3 - skew * r2) / fx;
    let degenerate = |ratio: f64| !ratio.is_finite() || ratio < 1e-9;
    if degenerate(scale) || degenerate(fx / (1.0 + cx.abs())) || degenerate(fy / (1.0 + cy.abs())) {
        return Err(CameraFileError::DegenerateDlt);
    }
    if skew.abs() > MAX_SKEW * fx {
        return Err(CameraFileError::Skew { skew_px: skew, focal_px: fx });
    }
    // 2. The sign of λ makes R a rotation.
    let sign = r1.cross(r2).dot(m3).signum();
    if sign < 0.0 && v_up.is_none() {
        return Err(CameraFileError::MirroredDlt);
    }
    let rotation = DMat3::from_cols(r1, r2, m3).transpose() * sign;
    let t = sign * last / scale;
    let y = (t.y - cy * t.z) / fy;
    let x = (t.x - cx * t.z - skew * y) / fx;
    let camera = Camera {
        size,
        focal_px: DVec2::new(fx, fy),
        centre_px: DVec2::new(cx, cy),
        distortion: Distortion::None,
        rotation,
        translation: DVec3::new(x, y, t.z) * unit_m,
    };
    camera.validated().map_err(|source| CameraFileError::Dlt { source })
}
