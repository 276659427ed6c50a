//! Calibration files: TOML as Pose2Sim and anipose write it, one section per camera.
//!
//! ```toml
//! [cam_01]
//! name = "cam_01"
//! size = [1280, 720]
//! matrix = [[1000.0, 0.0, 639.5], [0.0, 1000.0, 359.5], [0.0, 0.0, 1.0]]
//! distortions = [0.0, 0.0, 0.0, 0.0]       # k1, k2, p1, p2 and optionally k3, as OpenCV
//! rotation = [1.570796327, 0.0, 0.0]       # rotation vector, or a 3x3 matrix
//! translation = [0.0, 1.18, 4.4]           # x_cam = R x_world + t, metres
//! fisheye = false
//! ```
//!
//! `name` and `fisheye` may be left out, a `[metadata]` section is skipped. Fisheye lenses, skew and OpenCV's
//! longer distortion models are refused.

use glam::{DMat3, DQuat, DVec2, DVec3};
use thiserror::Error;
use toml::{Table, Value};

use super::camera::{Camera, CameraError, check_rotation};
use super::distortion::Distortion;

const KEYS: [&str; 7] = ["name", "size", "matrix", "distortions", "rotation", "translation", "fisheye"];
const SKIPPED_SECTION: &str = "metadata";

/// A written rotation matrix may be off orthonormal by this: files round to four decimals or more.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// Why a calibration file was refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CameraFileError {
    /// The text is not TOML.
    #[error("not a TOML file: {0}")]
    Syntax(#[from] toml::de::Error),
    /// A key outside any section.
    #[error("key `{key}` stands outside a section; each camera needs one, such as [cam]")]
    OutsideSection {
        /// The key.
        key: String,
    },
    /// The file holds no camera.
    #[error("the file has no camera section")]
    NoCamera,
    /// Several cameras and none was asked for.
    #[error("the file has {} cameras, choose one of: {}", names.len(), names.join(", "))]
    SeveralCameras {
        /// Their sections.
        names: Vec<String>,
    },
    /// The camera asked for is not there.
    #[error("no camera `{name}` in the file, it has: {}", names.join(", "))]
    UnknownCamera {
        /// The camera asked for.
        name: String,
        /// The sections of the file.
        names: Vec<String>,
    },
    /// A key that means nothing here.
    #[error("[{section}]: unknown key `{key}`; known are {}", KEYS.join(", "))]
    UnknownKey {
        /// The camera's section.
        section: String,
        /// The key.
        key: String,
    },
    /// A key that is needed.
    #[error("[{section}]: missing key `{key}`")]
    MissingKey {
        /// The camera's section.
        section: String,
        /// The key.
        key: &'static str,
    },
    /// A value of another kind, shape or range.
    #[error("[{section}] {key}: expected {expected}, got {got}")]
    Value {
        /// The camera's section.
        section: String,
        /// The key.
        key: &'static str,
        /// What is supported.
        expected: &'static str,
        /// What the file says.
        got: String,
    },
    /// Well-formed values that make no camera.
    #[error("[{section}] {key}: {source}")]
    Camera {
        /// The camera's section.
        section: String,
        /// The key.
        key: &'static str,
        /// What is wrong with it.
        source: CameraError,
    },
}

impl Camera {
    /// Reads a camera; `name` is its section or its `name` key and may be `None` if the file has only one.
    pub fn from_toml_str(text: &str, name: Option<&str>) -> Result<Self, CameraFileError> {
        let file: Table = text.parse()?;
        let sections = camera_sections(&file)?;
        choose(&sections, name)?.camera()
    }
}

/// One camera's table.
struct Section<'a> {
    title: &'a str,
    table: &'a Table,
}

fn camera_sections(file: &Table) -> Result<Vec<Section<'_>>, CameraFileError> {
    let is_camera = |(title, _): &(&String, _)| title.as_str() != SKIPPED_SECTION;
    file.iter()
        .filter(is_camera)
        .map(|(title, value)| match value {
            Value::Table(table) => Ok(Section { title, table }),
            _ => Err(CameraFileError::OutsideSection { key: title.clone() }),
        })
        .collect()
}

/// The section of that title, else the one of that `name`, else the only one.
fn choose<'a, 'b>(
    sections: &'b [Section<'a>],
    name: Option<&str>,
) -> Result<&'b Section<'a>, CameraFileError> {
    let names = || sections.iter().map(|s| s.title.to_owned()).collect();
    let Some(name) = name else {
        return match sections {
            [] => Err(CameraFileError::NoCamera),
            [only] => Ok(only),
            _ => Err(CameraFileError::SeveralCameras { names: names() }),
        };
    };
    let by_title = sections.iter().find(|s| s.title == name);
    let by_name = || sections.iter().find(|s| s.table.get("name").and_then(Value::as_str) == Some(name));
    by_title
        .or_else(by_name)
        .ok_or_else(|| CameraFileError::UnknownCamera { name: name.to_owned(), names: names() })
}

impl Section<'_> {
    fn camera(&self) -> Result<Camera, CameraFileError> {
        self.refuse_unknown_keys()?;
        self.refuse_fisheye()?;
        let [size, matrix, distortions] = ["size", "matrix", "distortions"].map(|key| self.value(key));
        let (focal_px, centre_px) = self.intrinsics(matrix?)?;
        let camera = Camera {
            size: self.size(size?)?,
            focal_px,
            centre_px,
            distortion: self.distortion(distortions?)?,
            rotation: self.rotation(self.value("rotation")?)?,
            translation: self.translation(self.value("translation")?)?,
        };
        camera.validated().map_err(|source| self.invalid(key_of(&source), source))
    }

    fn refuse_unknown_keys(&self) -> Result<(), CameraFileError> {
        match self.table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            Some(key) => {
                Err(CameraFileError::UnknownKey { section: self.title.to_owned(), key: key.clone() })
            }
            None => Ok(()),
        }
    }

    fn refuse_fisheye(&self) -> Result<(), CameraFileError> {
        match self.table.get("fisheye") {
            None | Some(Value::Boolean(false)) => Ok(()),
            Some(other) => {
                let expected = "false (perspective lenses with k1, k2, p1, p2, k3 are supported, fisheye lenses are not)";
                Err(self.unexpected("fisheye", expected, other))
            }
        }
    }

    fn size(&self, value: &Value) -> Result<[u32; 2], CameraFileError> {
        let expected = "[width, height] in whole pixels";
        let wrong = || self.unexpected("size", expected, value);
        let sides = numbers::<2>(value).ok_or_else(wrong)?;
        let is_whole = |s: &f64| s.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(s);
        if sides.iter().all(is_whole) { Ok(sides.map(|s| s as u32)) } else { Err(wrong()) }
    }

    /// (fx, fy), (cx, cy) of a matrix without skew.
    fn intrinsics(&self, value: &Value) -> Result<(DVec2, DVec2), CameraFileError> {
        let expected = "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with finite numbers (no skew)";
        match rows(value) {
            Some([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]) => {
                Ok((DVec2::new(fx, fy), DVec2::new(cx, cy)))
            }
            _ => Err(self.unexpected("matrix", expected, value)),
        }
    }

    fn distortion(&self, value: &Value) -> Result<Distortion, CameraFileError> {
        let expected = "4 or 5 finite numbers k1, k2, p1, p2(, k3)";
        let four = || numbers::<4>(value).map(|[k1, k2, p1, p2]| [k1, k2, p1, p2, 0.0]);
        let five = numbers::<5>(value).or_else(four);
        five.map(Distortion::from_opencv).ok_or_else(|| self.unexpected("distortions", expected, value))
    }

    /// A rotation vector (axis times angle), or a matrix that is a rotation up to rounding.
    fn rotation(&self, value: &Value) -> Result<DMat3, CameraFileError> {
        if let Some(vector) = numbers::<3>(value).map(DVec3::from) {
            return Ok(DMat3::from_quat(DQuat::from_scaled_axis(vector)));
        }
        let expected = "a rotation vector of 3 or a matrix of 3x3 finite numbers";
        let rows = rows(value).ok_or_else(|| self.unexpected("rotation", expected, value))?;
        let matrix = DMat3::from_cols_array_2d(&rows).transpose();
        check_rotation(&matrix, ROTATION_TOLERANCE).map_err(|source| self.invalid("rotation", source))?;
        Ok(DMat3::from_quat(DQuat::from_mat3(&matrix).normalize()))
    }

    fn translation(&self, value: &Value) -> Result<DVec3, CameraFileError> {
        let expected = "3 finite numbers in metres";
        numbers(value).map(DVec3::from_array).ok_or_else(|| self.unexpected("translation", expected, value))
    }

    fn value(&self, key: &'static str) -> Result<&Value, CameraFileError> {
        let missing = || CameraFileError::MissingKey { section: self.title.to_owned(), key };
        self.table.get(key).ok_or_else(missing)
    }

    fn unexpected(&self, key: &'static str, expected: &'static str, got: &Value) -> CameraFileError {
        CameraFileError::Value { section: self.title.to_owned(), key, expected, got: got.to_string() }
    }

    fn invalid(&self, key: &'static str, source: CameraError) -> CameraFileError {
        CameraFileError::Camera { section: self.title.to_owned(), key, source }
    }
}

/// The key a refused camera owes its fault to.
fn key_of(error: &CameraError) -> &'static str {
    match error {
        CameraError::Size { .. } => "size",
        CameraError::NotARotation { .. } => "rotation",
        CameraError::LooksLikeMillimetres { .. } => "translation",
        _ => "matrix",
    }
}

/// An array of exactly N finite numbers.
fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let array = value.as_array().filter(|a| a.len() == N)?;
    let mut found = [0.0; N];
    for (slot, item) in found.iter_mut().zip(array) {
        *slot = item.as_float().or_else(|| item.as_integer().map(|i| i as f64)).filter(|x| x.is_finite())?;
    }
    Some(found)
}

/// Three rows of three finite numbers.
fn rows(value: &Value) -> Option<[[f64; 3]; 3]> {
    match value.as_array()?.as_slice() {
        [a, b, c] => Some([numbers(a)?, numbers(b)?, numbers(c)?]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(
            camera.distortion,
            Distortion::Brown { k1: -0.1, k2: 0.02, p1: 0.001, p2: -0.002, k3: 0.0 }
        );
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
        let unknown = refusal("fisheye", "fish_eye");
        assert_eq!(
            unknown,
            "[cam]: unknown key `fish_eye`; known are name, size, matrix, distortions, rotation, translation, fisheye"
        );
        for key in ["size", "matrix", "distortions", "rotation", "translation"] {
            let without: String =
                ONE.lines().filter(|l| !l.starts_with(key)).flat_map(|l| [l, "\n"]).collect();
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
            "[cam] size: expected [width, height] in whole pixels, got [1280.5, 720]",
        );
        starts("[1280.0, 720]", "[1280, -720]", "[cam] size: expected [width, height] in whole pixels");
        starts("[1280.0, 720]", "[1280]", "[cam] size: expected");
        starts("[1280.0, 720]", "[0, 720]", "[cam] size: image size must be positive, got 0x720");
        starts(
            "[[1000.0, 0.0,",
            "[[1000.0, 0.3,",
            "[cam] matrix: expected [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with finite",
        );
        starts("[[1000.0, 0.0,", "[[nan, 0.0,", "[cam] matrix: expected [[fx, 0, cx]");
        starts(
            "[[1000.0, 0.0,",
            "[[-1000.0, 0.0,",
            "[cam] matrix: focal lengths must be positive pixels, got fx = -1000",
        );
        starts(
            "639.5]",
            "63950]",
            "[cam] matrix: principal point (63950, 359.5) lies far outside the 1280x720 image",
        );
        starts("-0.002]", "-0.002, 0, 0]", "[cam] distortions: expected 4 or 5 finite numbers");
        starts("-0.002]", "inf]", "[cam] distortions: expected 4 or 5 finite numbers");
        starts("-0.002]", "\"a\"]", "[cam] distortions: expected 4 or 5 finite numbers");
        starts(
            "[1.623156204, 0.0, 0.0]",
            "[1.6, 0.0]",
            "[cam] rotation: expected a rotation vector of 3 or a matrix",
        );
        starts(
            "[0.1, 1.18, 4.4]",
            "[0.1, 1.18, nan]",
            "[cam] translation: expected 3 finite numbers in metres",
        );
        starts(
            "[0.1, 1.18, 4.4]",
            "[100, 1180, 4400]",
            "[cam] translation: camera is 4557 m from the world's origin: the translation looks like millimetres, metres are expected",
        );
        starts("fisheye = false", "fisheye = true", "[cam] fisheye: expected false (perspective lenses");
    }

    #[test]
    fn a_matrix_that_is_no_rotation_is_refused_with_its_determinant() {
        let mirror = refusal("[1.623156204, 0.0, 0.0]", "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]");
        assert!(mirror.starts_with("[cam] rotation: not a rotation: determinant -1.000000"), "{mirror}");
        let stretched = refusal("[1.623156204, 0.0, 0.0]", "[[1, 0, 0], [0, 1, 0], [0, 0, 1.1]]");
        assert!(stretched.starts_with("[cam] rotation: not a rotation: determinant 1.100000"), "{stretched}");
    }
}
