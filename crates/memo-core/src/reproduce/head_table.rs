//! Table 2 of Lee and Chen 1985, recomputed from Table A.2 by the linear solution and by least squares.
//!
//! A.2(b) is printed with five digits, but Table 2 was computed from more: no method reproduces them from the
//! printed digits. [`exact_projections`] does, because it is A.2(b) before rounding.

use crate::model::resection::{
    Conditioning, Focal, LinearResection, PaperView, ResectedPose, ResectionError, ResectionOptions,
    linear_resection, resect,
};
use crate::posture::head::TABLE_A2_POINTS_CM;
use glam::{DMat3, DVec2, DVec3, DVec4};

/// Table A.2(b): (x', y') of the head's points, y' up, in units of f = 5.
const TABLE_A2_PROJECTIONS: [DVec2; 6] = [
    DVec2::new(-0.00024, 0.59320),
    DVec2::new(-0.00025, 0.70944),
    DVec2::new(-0.06329, 0.74631),
    DVec2::new(0.06280, 0.74631),
    DVec2::new(-0.09680, 0.68273),
    DVec2::new(0.09631, 0.68273),
];
/// f used for A.2(b), centimetres.
const FOCAL_CM: f64 = 5.0;
/// The camera of SEQ1 in the head's frame, centimetres.
const CAMERA_CM: DVec3 = DVec3::new(400.0, 0.0, 0.0);
/// Standard deviation of a number rounded to five digits: 1e-5 / sqrt 12.
const ROUNDING_SD: f64 = 1e-5 * 0.288_675_134_594_812_9;

/// One computation of Table 2; centimetres, the paper's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadTableColumn {
    /// Name of the method.
    pub method: &'static str,
    /// (a) `[T]`: its columns.
    pub transform: [DVec4; 3],
    /// (b) `[R]`.
    pub rotation: DMat3,
    /// f.
    pub focal: f64,
    /// Standard deviation of f: 0 if f was given, `None` if the method gives no uncertainty.
    pub focal_sd: Option<f64>,
    /// (c) Camera position (x0, y0, z0).
    pub camera_position: DVec3,
    /// Its standard deviations.
    pub camera_position_sd: Option<DVec3>,
    /// (d) Head points in the camera frame, in the order of [`crate::posture::head::HeadPoint::ALL`].
    pub points: [DVec3; 6],
    /// Their standard deviations.
    pub point_sds: Option<[DVec3; 6]>,
}

/// Table 2 as printed and as recomputed from A.2(b).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadTable {
    /// The paper's numbers; f follows from `[T]`.
    pub printed: HeadTableColumn,
    /// Eqs. (1)-(5) on A.2(b) as printed, without conditioning.
    pub linear: HeadTableColumn,
    /// Eqs. (1)-(5) on the projections before rounding.
    pub linear_exact: HeadTableColumn,
    /// Least squares on A.2(b), f free.
    pub focal_free: HeadTableColumn,
    /// Least squares on A.2(b), f = 5.
    pub focal_known: HeadTableColumn,
}

/// A.2(b) before rounding: the head seen from (400, 0, 0) with f = 5, y' up.
pub fn exact_projections() -> [DVec2; 6] {
    let axes = DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X);
    let view = PaperView { rotation: axes, camera_position: CAMERA_CM, focal: FOCAL_CM };
    TABLE_A2_POINTS_CM.map(|point| view.project(point).unwrap_or(DVec2::NAN))
}

/// Table 2 by all methods, side by side.
///
/// # Errors
///
/// None for the printed data; the type is the error of the methods.
pub fn table_2() -> Result<HeadTable, ResectionError> {
    let linear = |image: &[DVec2; 6]| linear_resection(&TABLE_A2_POINTS_CM, image, Conditioning::AsPrinted);
    let downwards = TABLE_A2_PROJECTIONS.map(|q| DVec2::new(q.x, -q.y));
    let options = ResectionOptions { image_sd: Some(ROUNDING_SD), ..ResectionOptions::default() };
    let fitted = |focal| resect(&TABLE_A2_POINTS_CM, &downwards, focal, &options);
    Ok(HeadTable {
        printed: PRINTED,
        linear: from_linear("linear, A.2(b) as printed", &linear(&TABLE_A2_PROJECTIONS)?),
        linear_exact: from_linear("linear, exact projections", &linear(&exact_projections())?),
        focal_free: from_pose("least squares, f free", fitted(Focal::Free)?.best()),
        focal_known: from_pose("least squares, f = 5", fitted(Focal::Known(DVec2::splat(FOCAL_CM)))?.best()),
    })
}

fn from_linear(method: &'static str, linear: &LinearResection) -> HeadTableColumn {
    HeadTableColumn {
        method,
        transform: linear.transform,
        rotation: linear.rotation,
        focal: linear.focal,
        focal_sd: None,
        camera_position: linear.camera_position,
        camera_position_sd: None,
        points: TABLE_A2_POINTS_CM.map(|p| linear.point_in_paper_camera(p)),
        point_sds: None,
    }
}

fn from_pose(method: &'static str, pose: &ResectedPose) -> HeadTableColumn {
    let view = pose.paper_view();
    let camera = pose.paper_camera_in_head();
    let points = TABLE_A2_POINTS_CM.map(|p| pose.point_in_paper_camera(p));
    HeadTableColumn {
        method,
        transform: view.transform(),
        rotation: view.rotation,
        focal: view.focal,
        focal_sd: Some(pose.focal_sd()),
        camera_position: camera.position,
        camera_position_sd: Some(camera.sd()),
        points: points.map(|point| point.position),
        point_sds: Some(points.map(|point| point.sd())),
    }
}

/// Table 2 of the paper.
const PRINTED: HeadTableColumn = HeadTableColumn {
    method: "as printed",
    transform: [
        DVec4::new(0.00003, 0.0, -1.0, -0.02061),
        DVec4::new(-0.00002, 0.99999, -0.00001, 0.00085),
        DVec4::new(-0.2, 0.00001, -0.00001, 80.99937),
    ],
    rotation: DMat3::from_cols(
        DVec3::new(0.00003, 0.0, -1.0),
        DVec3::new(-0.00002, 0.99999, -0.00001),
        DVec3::new(1.00001, -0.00004, 0.00007),
    ),
    focal: 5.0,
    focal_sd: None,
    camera_position: DVec3::new(400.00116, -0.01535, 0.00595),
    camera_position_sd: None,
    points: [
        DVec3::new(-0.00499, 52.12662, 434.17551),
        DVec3::new(-0.00485, 61.62641, 429.17581),
        DVec3::new(-5.50490, 65.12637, 431.17560),
        DVec3::new(5.49510, 65.12647, 431.17633),
        DVec3::new(-8.50501, 60.12647, 435.17526),
        DVec3::new(8.49499, 60.12663, 435.17639),
    ],
    point_sds: None,
};

#[cfg(test)]
mod tests {
    use super::*;

    fn is_close(a: DVec3, b: DVec3, tolerance: DVec3) -> bool {
        (a - b).abs().cmple(tolerance).all()
    }

    #[test]
    fn the_linear_solution_of_the_printed_input_is_where_it_was_measured() {
        let table = table_2().unwrap();
        let half_digit = DVec3::splat(0.005);
        assert!(is_close(table.linear.camera_position, DVec3::new(404.18, 0.35, 0.82), half_digit));
    }

    #[test]
    fn least_squares_are_where_they_were_measured() {
        let table = table_2().unwrap();
        let (free, known) = (table.focal_free, table.focal_known);
        assert!(is_close(free.camera_position, DVec3::new(399.69, 0.04, -0.02), DVec3::splat(0.005)));
        assert!((free.camera_position_sd.unwrap().x - 0.61).abs() < 0.005);
        let measured = DVec3::new(399.998, -0.009, -0.023);
        assert!(is_close(known.camera_position, measured, DVec3::splat(0.0005)));
        assert!((known.camera_position_sd.unwrap().x - 0.006).abs() < 0.0005);
        // scipy.optimize.least_squares on the same equations.
        let scipy = DVec3::new(399.692_271, 0.037_780_6, -0.023_277_7);
        assert!(is_close(free.camera_position, scipy, DVec3::splat(2e-6)), "{}", free.camera_position);
        let scipy_sd = DVec3::new(0.610_131, 0.096_328, 0.022_301);
        assert!(is_close(free.camera_position_sd.unwrap(), scipy_sd, DVec3::splat(1e-6)));
        assert!(
            (free.focal_sd.unwrap() - 0.007_231).abs() < 1e-6 && (free.focal - 4.996_380_27).abs() < 1e-7
        );
        let scipy = DVec3::new(399.997_694, -0.009_070_6, -0.023_296_6);
        assert!(is_close(known.camera_position, scipy, DVec3::splat(1e-6)));
        let scipy_sd = DVec3::new(0.006_359, 0.022_802, 0.022_317);
        assert!(is_close(known.camera_position_sd.unwrap(), scipy_sd, DVec3::splat(1e-6)));
    }

    /// Table 2(d) itself differs from the geometry of A.2 by up to (0.0051, 0.0237, 0.0085) cm.
    #[test]
    fn exact_projections_give_table_2_to_its_digits() {
        let table = table_2().unwrap();
        let (exact, printed) = (table.linear_exact, table.printed);
        assert!(is_close(exact.camera_position, CAMERA_CM, DVec3::splat(1e-5)), "{}", exact.camera_position);
        assert!((exact.focal - 5.0).abs() < 1e-6);
        for (exact, printed) in exact.points.iter().zip(printed.points) {
            assert!(is_close(*exact, printed, DVec3::new(0.0051, 0.0237, 0.0085)), "{exact} {printed}");
        }
        for (exact, printed) in exact.transform.iter().zip(printed.transform) {
            assert!((*exact - printed).abs().max_element() < 0.021);
            assert!((exact.truncate() - printed.truncate()).abs().max_element() < 3.5e-5);
        }
        assert!((exact.rotation.x_axis - printed.rotation.x_axis).abs().max_element() < 3.5e-5);
        assert!((exact.rotation.z_axis - printed.rotation.z_axis).abs().max_element() < 7.5e-5);
    }

    #[test]
    fn rounding_the_exact_projections_gives_a2_but_for_a_shift_of_x() {
        for (exact, printed) in exact_projections().iter().zip(TABLE_A2_PROJECTIONS) {
            assert!((exact.y - printed.y).abs() < 0.5e-5);
            // A.2(b) is shifted by 2.45e-4 to the left of the symmetric projection: T41 = -0.02061 of Table 2(a).
            assert!((exact.x - printed.x - 2.45e-4).abs() < 0.6e-5);
        }
    }
}
