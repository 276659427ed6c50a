use super::*;
use crate::model::camera::check_rotation;
use crate::model::distortion::Distortion;
use glam::{DMat3, DVec2, DVec3};
use proptest::prelude::*;

const ONE: &str = r#"
[cam]
name = "kitchen"
size = [1280.0, 720]
matrix = [[1000.0, 0.0, 639.5], [0.0, 1000, 359.5], [0.0, 0.0, 1.0]]
distortions = [-0.1, 0.02, 0.001, -0.002]
rotation = [1.623156204, 0.0, 0.0]
translation = [0.1, 1.18, 4.4]
fisheye = false
"#;

fn two() -> String {
    format!(
        "{ONE}\n{}\n[metadata]\nadjusted = false\nerror = 0.0\n",
        ONE.replace("[cam]", "[cam_02]").replace("kitchen", "hall")
    )
}

/// The message for the file with one piece of text replaced.
fn refusal(from: &str, to: &str) -> String {
    assert!(ONE.contains(from), "{from}");
    Camera::from_toml_str(&ONE.replace(from, to), None).unwrap_err().to_string()
}

#[test]
fn a_file_is_read() {
    let camera = Camera::from_toml_str(ONE, None).unwrap();
    assert_eq!(camera.size, [1280, 720]);
    assert_eq!((camera.focal_px, camera.centre_px), (DVec2::splat(1000.0), DVec2::new(639.5, 359.5)));
    assert_eq!(camera.distortion, Distortion::Brown { k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.002, k3: 0.0 });
    assert_eq!(camera.translation, DVec3::new(0.1, 1.18, 4.4));
    assert!((camera.rotation - DMat3::from_rotation_x(1.623156204)).abs_diff_eq(DMat3::ZERO, 1e-15));
}

#[test]
fn a_rotation_vector_is_read_as_opencv_does() {
    let camera =
        Camera::from_toml_str(&ONE.replace("[1.623156204, 0.0, 0.0]", "[1.2, -0.7, 0.4]"), None).unwrap();
    // cv2.Rodrigues, rows.
    let expected = DMat3::from_cols_array(&[
        0.72780455,
        -0.62628336,
        -0.27940954,
        -0.07723718,
        0.32998044,
        -0.94082269,
        0.68142127,
        0.70631584,
        0.1917889,
    ]);
    assert!(camera.rotation.abs_diff_eq(expected.transpose(), 1e-8));
}

#[test]
fn a_rotation_may_be_a_rounded_matrix() {
    let matrix = "rotation = [[0.8, -0.6, 0.0], [0.6001, 0.8, 0.0], [0, 0, 1]]";
    let camera =
        Camera::from_toml_str(&ONE.replace("rotation = [1.623156204, 0.0, 0.0]", matrix), None).unwrap();
    let expected = DMat3::from_rotation_z(0.6_f64.atan2(0.8));
    assert!(camera.rotation.abs_diff_eq(expected, 1e-4), "{}", camera.rotation);
    assert!(check_rotation(&camera.rotation, 1e-14).is_ok());
}

#[test]
fn no_rotation_and_a_fifth_coefficient_are_read() {
    let text = ONE.replace("[1.623156204, 0.0, 0.0]", "[0, 0, 0]").replace("-0.002]", "-0.002, 0.5]");
    let camera = Camera::from_toml_str(&text.replace("fisheye = false", ""), None).unwrap();
    assert_eq!(camera.rotation, DMat3::IDENTITY);
    assert!(matches!(camera.distortion, Distortion::Brown { k3: 0.5, .. }));
}

#[test]
fn a_camera_is_chosen_by_section_or_name() {
    for name in ["cam_02", "hall", "cam", "kitchen"] {
        assert!(Camera::from_toml_str(&two(), Some(name)).is_ok(), "{name}");
    }
    let message = |name| Camera::from_toml_str(&two(), name).unwrap_err().to_string();
    assert_eq!(message(None), "the file has 2 cameras, choose one of: cam, cam_02");
    assert_eq!(message(Some("cam_03")), "no camera `cam_03` in the file, it has: cam, cam_02");
    assert_eq!(message(Some("metadata")), "no camera `metadata` in the file, it has: cam, cam_02");
    assert_eq!(Camera::from_toml_str("[metadata]\n", None), Err(CameraFileError::NoCamera));
}

#[test]
fn text_that_is_no_camera_file_is_refused() {
    let message = |text| Camera::from_toml_str(text, None).unwrap_err().to_string();
    assert!(message("[cam").starts_with("not a TOML file: "));
    assert!(message("size = [1, 2]").starts_with("key `size` stands outside a section"));
}

#[test]
fn keys_are_unknown_or_missing_by_name() {
    let unknown = refusal("fisheye", "fishy");
    assert_eq!(
        unknown,
        "[cam]: unknown key `fishy` (line 9); known are name, size, matrix, distortions, rotation, translation, fisheye"
    );
    for key in ["size", "matrix", "distortions", "rotation", "translation"] {
        let without: String = ONE.lines().filter(|l| !l.starts_with(key)).flat_map(|l| [l, "\n"]).collect();
        let error = Camera::from_toml_str(&without, None).unwrap_err();
        assert_eq!(error.to_string(), format!("[cam]: missing key `{key}`"));
    }
}

#[test]
fn bad_values_are_refused_with_their_key() {
    let starts = |from, to, start: &str| {
        let message = refusal(from, to);
        assert!(message.starts_with(start), "{message}");
    };
    starts(
        "[1280.0, 720]",
        "[1280.5, 720]",
        "[cam] size (line 4): expected [width, height] in whole pixels, got [1280.5, 720]",
    );
    starts("[1280.0, 720]", "[1280, -720]", "[cam] size (line 4): expected [width, height] in whole pixels");
    starts("[1280.0, 720]", "[1280]", "[cam] size (line 4): expected");
    starts("[1280.0, 720]", "[0, 720]", "[cam] size (line 4): image size must be positive, got 0x720");
    starts(
        "[[1000.0, 0.0,",
        "[[1000.0, 0.3,",
        "[cam] matrix (line 5): expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with finite",
    );
    starts("[[1000.0, 0.0,", "[[nan, 0.0,", "[cam] matrix (line 5): expected [[fx, 0, cx]");
    starts(
        "[[1000.0, 0.0,",
        "[[-1000.0, 0.0,",
        "[cam] matrix (line 5): focal lengths must be positive pixels, got fx = -1000",
    );
    starts(
        "639.5]",
        "63950]",
        "[cam] matrix (line 5): principal point (63950, 359.5) lies far outside the 1280x720 image",
    );
    starts("-0.002]", "-0.002, 0, 0]", "[cam] distortions (line 6): expected 4 or 5 finite numbers");
    starts("-0.002]", "inf]", "[cam] distortions (line 6): expected 4 or 5 finite numbers");
    starts("-0.002]", "\"a\"]", "[cam] distortions (line 6): expected 4 or 5 finite numbers");
    starts(
        "[1.623156204, 0.0, 0.0]",
        "[1.6, 0.0]",
        "[cam] rotation (line 7): expected a rotation vector of 3 or a matrix",
    );
    starts("[0.1, 1.18, 4.4]", "[0.1, 1.18, nan]", "[cam] translation (line 8): expected 3 finite numbers");
    starts(
        "[0.1, 1.18, 4.4]",
        "[100, 1180, 4400]",
        "[cam] translation (line 8): camera is 4557 m from the world's origin, a 1.7 m person there 0.37 px high: the translation looks like millimetres, in which it would be 373 px; say so by the unit mm (--camera-unit mm)",
    );
    starts("fisheye = false", "fisheye = true", "[cam] fisheye (line 9): expected false (perspective lenses");
}

#[test]
fn a_matrix_that_is_no_rotation_is_refused_with_its_determinant() {
    let mirror = refusal("[1.623156204, 0.0, 0.0]", "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]");
    assert!(mirror.starts_with("[cam] rotation (line 7): not a rotation: determinant -1.000000"), "{mirror}");
    let stretched = refusal("[1.623156204, 0.0, 0.0]", "[[1, 0, 0], [0, 1, 0], [0, 0, 1.1]]");
    assert!(
        stretched.starts_with("[cam] rotation (line 7): not a rotation: determinant 1.100000"),
        "{stretched}"
    );
}

const OPENCV_YAML: &str = "%YAML:1.0\n---\ncalibration_time: \"Mon 3 Feb\"\nimage_width: 1280\nimage_height: 720\n\
camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1000., 0., 639.5, 0., 1000., 359.5, 0.,\n       0., 1. ]\n\
distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -0.1, 0.02, 0.001, -0.002, 0. ]\n\
rvec: [ 1.623156204, 0., 0. ]\ntvec: [ 0.1, 1.18, 4.4 ]\n";

fn read(text: &str, format: FileFormat) -> Result<Camera, CameraFileError> {
    Camera::from_text(text, format, &CameraFileOptions::default())
}

#[test]
fn all_formats_say_the_same() {
    let expected = Camera::from_toml_str(ONE, None).unwrap();
    assert_eq!(read(OPENCV_YAML, FileFormat::Yaml).unwrap(), expected);
    let block =
        OPENCV_YAML.replace("rvec: [ 1.623156204, 0., 0. ]", "rvec:\n- - 1.623156204\n- - 0\n- - 0.0");
    assert_eq!(read(&block, FileFormat::Yaml).unwrap(), expected);
    let json = r#"{"cameras": [{"name": "kitchen", "resolution": [1280, 720], "K": [1000, 0, 639.5, 0, 1000, 359.5, 0, 0, 1],
            "distCoeffs": [[-0.1, 0.02, 0.001, -0.002]], "rvec": [[1.623156204], [0], [0]], "tvec": [0.1, 1.18, 4.4]}]}"#;
    assert_eq!(read(json, FileFormat::Json).unwrap(), expected);
    let xml = r#"<?xml version="1.0"?><opencv_storage><image_width>1280</image_width><image_height>720</image_height>
            <cameraMatrix type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt><data>1000. 0. 639.5 0. 1000. 359.5 0. 0. 1.</data></cameraMatrix>
            <dist_coeffs type_id="opencv-matrix"><rows>1</rows><cols>4</cols><dt>d</dt><data>-0.1 0.02 0.001 -0.002</data></dist_coeffs>
            <rvec>1.623156204 0 0</rvec><tvec>0.1 1.18 4.4</tvec></opencv_storage>"#;
    assert_eq!(read(xml, FileFormat::Xml).unwrap(), expected);
}

#[test]
fn faults_of_opencv_files_are_told_with_their_line() {
    let message = |from: &str, to: &str| {
        assert!(OPENCV_YAML.contains(from), "{from}");
        read(&OPENCV_YAML.replace(from, to), FileFormat::Yaml).unwrap_err().to_string()
    };
    let started = |from, to, start: &str| {
        let said = message(from, to);
        assert!(said.starts_with(start), "{said}");
    };
    started(
        "rows: 5",
        "rows: 4",
        "[camera] distortion_coefficients (line 12): expected 4 or 5 finite numbers",
    );
    started("-0.1, 0.02", "-0.1, .Nan", "[camera] distortion_coefficients (line 12): expected 4 or 5");
    started(
        "tvec: [ 0.1",
        "tvec: [ x",
        "[camera] tvec (line 18): expected 3 finite numbers, got [\"x\", 1.18, 4.4]",
    );
    started("image_width: 1280\n", "", "[camera]: missing key `size`");
    started("4.4 ]", "4.4", "not a YAML file: line 1");
    started(
        "rvec: [ 1.623156204, 0., 0. ]\ntvec: [ 0.1, 1.18, 4.4 ]",
        "",
        "[camera]: neither rotation nor translation",
    );
    started("rvec:", "fisheye_model: 1\nrvec:", "[camera] fisheye_model (line 17): expected false");
}

#[test]
fn the_unit_is_checked_and_told_in_both_readings() {
    let millimetres = ONE.replace("[0.1, 1.18, 4.4]", "[100, 1180, 4400]");
    let unit = |text: &str, unit| {
        let options = CameraFileOptions { unit: Some(unit), ..Default::default() };
        Camera::from_text(text, FileFormat::Toml, &options)
    };
    let camera = unit(&millimetres, LengthUnit::Millimetre).unwrap();
    assert!((camera.translation - DVec3::new(0.1, 1.18, 4.4)).length() < 1e-12);
    assert!(unit(&millimetres, LengthUnit::Metre).is_err());
    let said = unit(ONE, LengthUnit::Millimetre).unwrap_err().to_string();
    assert!(said.contains("4.6 mm from the world's origin, a 1.7 m person there 373087 px high"), "{said}");
}

/// The eleven coefficients of a camera; `v_up`: v increases upwards.
fn coefficients(camera: &Camera, v_up: bool) -> [f64; 11] {
    let mut p = camera.matrix();
    if v_up {
        let bottom = f64::from(camera.size[1]) - 1.0;
        let flipped = p.row(2) * bottom - p.row(1);
        p.set_row(1, &flipped);
    }
    let p = p / p[(2, 3)];
    std::array::from_fn(|i| p[(i / 4, i % 4)])
}

proptest! {
    #[test]
    fn dlt_coefficients_are_the_camera_they_were_made_of(
        axis in prop::array::uniform3(-2.0..2.0_f64), place in prop::array::uniform3(-8.0..8.0_f64),
        focal in 300.0..3000.0_f64, aspect in 0.9..1.1_f64, v_up: bool,
    ) {
        let rotation = DMat3::from_quat(glam::DQuat::from_scaled_axis(DVec3::from(axis)));
        let translation = DVec3::from(place) + DVec3::Z * if v_up { 0.0 } else { 9.0 };
        prop_assume!(translation.z.abs() > 0.5 && (v_up || translation.z > 0.5));
        let (focal_px, centre_px) = (DVec2::new(focal, focal * aspect), DVec2::new(650.0, 340.0));
        let camera = Camera {
            size: [1280, 720], focal_px, centre_px, distortion: Distortion::None, rotation, translation,
        };
        let l = coefficients(&camera, v_up);
        let read = dlt::from_coefficients(&l, camera.size, v_up.then_some(true), 1.0).unwrap();
        prop_assert!((read.focal_px - focal_px).length() < 1e-6 * focal);
        prop_assert!((read.centre_px - centre_px).length() < 1e-6 * focal);
        prop_assert!((read.translation - translation).length() < 1e-6);
        prop_assert!((read.rotation - rotation).to_cols_array().iter().all(|e| e.abs() < 1e-8));
    }
}

#[test]
fn dlt_tables_are_chosen_from_by_column() {
    let camera =
        Camera::from_toml_str(&ONE.replace("[-0.1, 0.02, 0.001, -0.002]", "[0, 0, 0, 0]"), None).unwrap();
    let row = |x: &f64| format!("{x:?},{x:?}\n");
    let text: String = coefficients(&camera, false).iter().map(row).collect();
    let read = |text: &str, name, size| {
        Camera::from_text(text, FileFormat::Dlt, &CameraFileOptions { name, size, ..Default::default() })
    };
    let size = Some([1280, 720]);
    let found = read(&text, Some("2"), size).unwrap();
    let point = DVec3::new(0.3, -0.2, 1.1);
    assert!((found.project(point).unwrap() - camera.project(point).unwrap()).length() < 1e-9);
    assert!(read(&format!("left, right\n{text}"), Some("right"), size).is_ok());
    let said = |text: &str, name, size| read(text, name, size).unwrap_err().to_string();
    assert_eq!(said(&text, None, size), "the file has 2 cameras, choose one of: 1, 2");
    assert!(said(&text, Some("1"), None).contains("does not say how large the picture is"));
    assert!(said("1 2\n3\n", None, size).ends_with("line 2: 1 number, 2 in the first row"));
    assert!(said("1\n2\nx\n", None, size).ends_with("line 3: \"x\" is no number"));
    assert!(said(&"1\n".repeat(13), None, size).ends_with("line 12: more than 11 rows of coefficients"));
    assert!(said("1\n2\n", None, size).ends_with("expected 11 rows, a column a camera; got 2 rows of 1"));
    let up: String = coefficients(&camera, true).iter().map(|x| format!("{x:?}\n")).collect();
    assert_eq!(read(&up, None, size), Err(CameraFileError::MirroredDlt));
    let zeros = "0\n".repeat(11);
    assert_eq!(read(&zeros, None, size), Err(CameraFileError::DegenerateDlt));
}

#[test]
fn what_is_written_is_read_back() {
    let camera = Camera::from_toml_str(ONE, None).unwrap();
    let text = camera.to_toml_string("the \"old\" hall").unwrap();
    let back = Camera::from_toml_str(&text, Some("the \"old\" hall")).unwrap();
    assert_eq!(
        (back.focal_px, back.centre_px, back.distortion),
        (camera.focal_px, camera.centre_px, camera.distortion)
    );
    let point = DVec3::new(0.3, -0.2, 1.1);
    assert!((back.project(point).unwrap() - camera.project(point).unwrap()).length() < 1e-9);
    let tsai = Camera { distortion: Distortion::Tsai { kappa: 0.158 }, ..camera.clone() };
    let back = Camera::from_toml_str(&tsai.to_toml_string("cam").unwrap(), None).unwrap();
    let far = DVec3::new(2.0, -0.2, 1.9);
    assert!((back.project(far).unwrap() - tsai.project(far).unwrap()).length() < 0.1);
    let folded = Camera { distortion: Distortion::Tsai { kappa: -2.0 }, ..camera };
    assert!(matches!(folded.to_toml_string("cam"), Err(CameraFileError::Lens { .. })));
}

#[test]
fn endless_nesting_is_refused() {
    for depth in [100, 100_000] {
        let open = "[".repeat(depth);
        for (format, text) in [
            (FileFormat::Json, format!("{{\"K\": {open}")),
            (FileFormat::Yaml, format!("K: {open}")),
            (FileFormat::Toml, format!("K = {open}")),
            (FileFormat::Xml, format!("<opencv_storage>{}", "<a>".repeat(depth))),
        ] {
            assert!(read(&text, format).is_err(), "{format}");
        }
    }
}

/// Parts of a file replaced, duplicated, removed or moved.
fn mutated(text: &str, edits: &[(usize, usize, u8, u8)]) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for &(at, length, kind, byte) in edits {
        let start = at % (bytes.len() + 1);
        let end = (start + length).min(bytes.len());
        match kind % 4 {
            0 => drop(bytes.drain(start..end)),
            1 => bytes[start..end].fill(byte),
            2 => {
                let piece = bytes[start..end].to_vec();
                bytes.splice(start..start, piece);
            }
            _ => bytes.insert(start, b"[]{}<>:,-&*!%#\"'\n\t 0e.N"[byte as usize % 23]),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// No change to a file makes a reader panic, hang or return an invalid camera.
#[test]
fn mutated_files_are_read_or_refused() {
    let cases = if std::env::var_os("MEMO_FULL").is_some() { 100_000 } else { 1_000 };
    let json = r#"{"cam": {"size": [1280, 720], "K": [[1000, 0, 639.5], [0, 1000, 359.5], [0, 0, 1]], "D": [0, 0, 0, 0], "R": [1.6, 0, 0], "T": [0.1, 1.18, 4.4]}}"#;
    let opencv = "<opencv_storage><image_width>1280</image_width><image_height>720</image_height><K>9 0 3 0 9 2 0 0 1</K><D>0 0 0 0</D><R>1.6 0 0</R><T>0.1 1 4</T></opencv_storage>";
    let tsai = r#"<Camera><Geometry width="768" height="576" dpx="5e-3" dpy="4e-3"/><Intrinsic focal="5.5" kappa1="5e-3" cx="324" cy="282" sx="1"/><Extrinsic tx="8" ty="-3" tz="3e4" rx="2" ry="-0.8" rz="-0.4"/></Camera>"#;
    let dlt = "800\n-10\n3\n600\n2\n-700\n5\n300\n0.1\n0.2\n0.05\n";
    for (format, text) in [
        (FileFormat::Toml, ONE),
        (FileFormat::Yaml, OPENCV_YAML),
        (FileFormat::Json, json),
        (FileFormat::Xml, opencv),
        (FileFormat::Xml, tsai),
        (FileFormat::Dlt, dlt),
    ] {
        let edit = (0_usize..2000, 0_usize..30, any::<u8>(), any::<u8>());
        let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
            cases,
            failure_persistence: None,
            ..ProptestConfig::default()
        });
        let read_count = std::cell::Cell::new(0_u32);
        let options = CameraFileOptions { size: Some([1280, 720]), ..Default::default() };
        let result = runner.run(&prop::collection::vec(edit, 1..4), |edits| {
            if let Ok(camera) = Camera::from_text(&mutated(text, &edits), format, &options) {
                read_count.set(read_count.get() + 1);
                prop_assert!(camera.validated().is_ok());
            }
            Ok(())
        });
        assert!(result.is_ok(), "{format}: {result:?}");
        println!("{format}: {cases} mutated files, {} of them still cameras", read_count.get());
        assert!(read_count.get() < cases);
    }
}
