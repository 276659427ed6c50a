//! Selects a camera of a file and builds it from its keys.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::node::{Node, Value, plain};
use super::{CameraFileError, CameraFileOptions, FileFormat, Place};
use crate::model::camera::{Camera, CameraError, check_rotation};
use crate::model::distortion::Distortion;

// The names of the keys, without capitals and underscores. The first is that of Pose2Sim and anipose; those
// with `camera` are those of OpenCV and ROS.
const NAME: &[&str] = &["name", "cameraname"];
const SIZE: &[&str] = &["size", "imagesize", "resolution"];
const WIDTH: &[&str] = &["imagewidth", "width"];
const HEIGHT: &[&str] = &["imageheight", "height"];
const MATRIX: &[&str] = &["matrix", "cameramatrix", "intrinsicmatrix", "intrinsics", "k", "mtx"];
const DISTORTIONS: &[&str] =
    &["distortions", "distortioncoefficients", "distortioncoeffs", "distcoeffs", "distortion", "dist", "d"];
const ROTATION: &[&str] = &["rotation", "rvec", "rotationvector", "rotationmatrix", "r"];
const TRANSLATION: &[&str] = &["translation", "tvec", "translationvector", "t"];
const FISHEYE: &[&str] = &["fisheye", "fisheyemodel"];
const MODEL: &[&str] = &["distortionmodel"];
/// Keys that Caliscope and anipose add and that do not affect the camera.
const IGNORED: &[&str] =
    &["error", "gridcount", "exposure", "ignore", "port", "camid", "verticesflipped", "reprojectionerror"];
/// Quarter turns of the image, written by Caliscope.
const TURNS: &[&str] = &["rotationcount"];

/// In a unit other than metres, a camera closer to the origin than this, metres, has the wrong unit.
const MIN_DISTANCE_M: f64 = 0.05;
const SKIPPED_SECTION: &str = "metadata";
/// Largest deviation of a rotation matrix in a file from orthonormal: files round to four decimals or more.
const ROTATION_TOLERANCE: f64 = 1e-3;

/// The selected camera of a file.
pub(super) fn camera(
    root: &Node,
    format: FileFormat,
    options: &CameraFileOptions<'_>,
) -> Result<Camera, CameraFileError> {
    choose(&sections(root)?, options.name)?.camera(format, options)
}

/// One camera's table.
struct Section<'a> {
    title: String,
    node: &'a Node,
}

/// The whole file if it has a matrix; otherwise its list or table `cameras`, or its tables.
fn sections(root: &Node) -> Result<Vec<Section<'_>>, CameraFileError> {
    let Some(entries) = root.table() else { return Err(CameraFileError::NoCamera) };
    if root.entry(MATRIX).is_some() {
        let title = root.entry(NAME).and_then(|(_, name)| name.text()).unwrap_or("camera");
        return Ok(vec![Section { title: title.to_owned(), node: root }]);
    }
    if let Some((_, cameras)) = root.entry(&["cameras"]) {
        return Ok(match &cameras.value {
            Value::List(items) => items.iter().enumerate().map(numbered).collect(),
            _ => tables(cameras.table().unwrap_or_default()),
        });
    }
    if let (Some((key, _)), true) =
        (entries.iter().find(|(_, node)| node.table().is_none()), tables(entries).is_empty())
    {
        return Err(CameraFileError::OutsideSection { key: key.clone() });
    }
    Ok(tables(entries))
}

fn numbered((index, node): (usize, &Node)) -> Section<'_> {
    let name = node.entry(NAME).and_then(|(_, name)| name.text().map(str::to_owned));
    Section { title: name.unwrap_or_else(|| (index + 1).to_string()), node }
}

/// The tables that describe cameras; all tables if none does, so that the missing keys can be reported.
fn tables(entries: &[(String, Node)]) -> Vec<Section<'_>> {
    let tables =
        entries.iter().filter(|(title, node)| title.as_str() != SKIPPED_SECTION && node.table().is_some());
    let all: Vec<Section<'_>> = tables.map(|(title, node)| Section { title: title.clone(), node }).collect();
    let is_camera = |section: &Section<'_>| section.node.entry(MATRIX).is_some();
    if all.iter().any(is_camera) { all.into_iter().filter(is_camera).collect() } else { all }
}

/// The section with that title, otherwise the one with that `name`, otherwise the only one.
fn choose<'a, 'b>(
    sections: &'b [Section<'a>],
    name: Option<&str>,
) -> Result<&'b Section<'a>, CameraFileError> {
    let names = || sections.iter().map(|s| s.title.clone()).collect();
    let Some(name) = name else {
        return match sections {
            [] => Err(CameraFileError::NoCamera),
            [only] => Ok(only),
            _ => Err(CameraFileError::SeveralCameras { names: names() }),
        };
    };
    let is_called = |s: &&Section<'_>| s.node.entry(NAME).and_then(|(_, n)| n.text()) == Some(name);
    let by_title = sections.iter().find(|s| s.title == name);
    by_title
        .or_else(|| sections.iter().find(is_called))
        .ok_or_else(|| CameraFileError::UnknownCamera { name: name.to_owned(), names: names() })
}

impl Section<'_> {
    fn camera(&self, format: FileFormat, options: &CameraFileOptions<'_>) -> Result<Camera, CameraFileError> {
        if format == FileFormat::Toml {
            self.refuse_unknown_keys()?;
        }
        self.refuse_other_lenses()?;
        self.refuse_turned()?;
        let size = self.size(options.size)?;
        let (focal_px, centre_px) = self.intrinsics()?;
        let distortion = self.distortion()?;
        if options.is_lens_only {
            let (rotation, translation) = (DMat3::IDENTITY, DVec3::ZERO);
            let camera = Camera { size, focal_px, centre_px, distortion, rotation, translation };
            return camera.validated().map_err(|source| self.invalid(keys_of(&source), source));
        }
        if self.node.entry(ROTATION).is_none() && self.node.entry(TRANSLATION).is_none() {
            return Err(CameraFileError::NoPlace { section: self.title.clone() });
        }
        let (rotation, translation) = (self.rotation()?, self.translation()?);
        let unit_m = options.unit.map_or(1.0, |unit| unit.metres());
        let camera =
            Camera { size, focal_px, centre_px, distortion, rotation, translation: translation * unit_m };
        let camera = camera.validated().map_err(|source| self.invalid(keys_of(&source), source))?;
        // The caller gave millimetres but the file is in metres. A camera exactly at the origin is allowed.
        let distance_m = camera.translation.length();
        if unit_m < 1.0 && distance_m > 0.0 && distance_m < MIN_DISTANCE_M {
            let person_px = camera.focal_px.y * 1.7 / distance_m;
            let source = CameraError::LooksLikeMetres { distance_m, person_px };
            return Err(self.invalid(TRANSLATION, source));
        }
        Ok(camera)
    }

    fn refuse_unknown_keys(&self) -> Result<(), CameraFileError> {
        let known = [
            NAME,
            SIZE,
            WIDTH,
            HEIGHT,
            MATRIX,
            DISTORTIONS,
            ROTATION,
            TRANSLATION,
            FISHEYE,
            MODEL,
            IGNORED,
            TURNS,
        ];
        let is_known = |key: &str| known.iter().any(|aliases| aliases.contains(&plain(key).as_str()));
        match self.node.table().unwrap_or_default().iter().find(|(key, _)| !is_known(key)) {
            Some((key, node)) => Err(CameraFileError::UnknownKey {
                section: self.title.clone(),
                key: key.clone(),
                line: node.line,
            }),
            None => Ok(()),
        }
    }

    fn refuse_other_lenses(&self) -> Result<(), CameraFileError> {
        if let Some((key, node)) = self.node.entry(FISHEYE)
            && !matches!(node.value, Value::Bool(false) | Value::Null)
            && node.number() != Some(0.0)
        {
            let expected =
                "false (perspective lenses with k1, k2, p1, p2, k3 are supported, fisheye lenses are not)";
            return Err(self.unexpected(key, expected, node));
        }
        let perspective = ["plumb_bob", "rational_polynomial", "radtan", "brown", "none"];
        match self.node.entry(MODEL) {
            Some((key, node)) if !node.text().is_some_and(|model| perspective.contains(&model)) => {
                Err(self.unexpected(key, "plumb_bob or rational_polynomial", node))
            }
            _ => Ok(()),
        }
    }

    fn refuse_turned(&self) -> Result<(), CameraFileError> {
        match self.node.entry(TURNS) {
            Some((key, node)) if node.number() != Some(0.0) => {
                Err(self.unexpected(key, "0 (turned pictures are not supported)", node))
            }
            _ => Ok(()),
        }
    }

    fn size(&self, given: Option<[u32; 2]>) -> Result<[u32; 2], CameraFileError> {
        if let (Some((key, width)), Some((_, height))) = (self.node.entry(WIDTH), self.node.entry(HEIGHT)) {
            let sides = width.number().zip(height.number()).and_then(|(w, h)| whole([w, h]));
            return sides.ok_or_else(|| self.unexpected(key, "width and height in whole pixels", width));
        }
        if let (None, Some(given)) = (self.node.entry(SIZE), given) {
            return Ok(given);
        }
        let (key, node) = self.value(SIZE)?;
        let sides = node.numbers().and_then(|sides| whole(sides.try_into().ok()?));
        sides.ok_or_else(|| self.unexpected(key, "[width, height] in whole pixels", node))
    }

    /// (fx, fy), (cx, cy) of a matrix without skew.
    fn intrinsics(&self) -> Result<(DVec2, DVec2), CameraFileError> {
        let (key, node) = self.value(MATRIX)?;
        match nine(node) {
            Some([fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]) => Ok((DVec2::new(fx, fy), DVec2::new(cx, cy))),
            _ => {
                let expected = "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] with finite numbers (no skew)";
                Err(self.unexpected(key, expected, node))
            }
        }
    }

    /// Four or five coefficients; OpenCV's longer models are accepted if all further coefficients are zero.
    fn distortion(&self) -> Result<Distortion, CameraFileError> {
        let (key, node) = self.value(DISTORTIONS)?;
        let wrong = || self.unexpected(key, "4 or 5 finite numbers k1, k2, p1, p2(, k3)", node);
        let numbers = node.numbers().ok_or_else(wrong)?;
        let is_known = matches!(numbers.len(), 0 | 4 | 5 | 8 | 12 | 14);
        if !is_known || numbers.iter().skip(5).any(|&k| k != 0.0) {
            return Err(wrong());
        }
        let mut five = [0.0; 5];
        five.iter_mut().zip(&numbers).for_each(|(slot, &k)| *slot = k);
        Ok(Distortion::from_opencv(five))
    }

    /// A rotation vector (axis times angle), or a matrix that is a rotation up to rounding.
    fn rotation(&self) -> Result<DMat3, CameraFileError> {
        let (key, node) = self.value(ROTATION)?;
        if let Some(vector) = three(node) {
            return Ok(Camera::rotation_of_vector(vector));
        }
        let expected = "a rotation vector of 3 or a matrix of 3x3 finite numbers";
        let nine = nine(node).ok_or_else(|| self.unexpected(key, expected, node))?;
        let matrix = DMat3::from_cols_array(&nine).transpose();
        check_rotation(&matrix, ROTATION_TOLERANCE).map_err(|source| self.invalid(ROTATION, source))?;
        Ok(DMat3::from_quat(DQuat::from_mat3(&matrix).normalize()))
    }

    fn translation(&self) -> Result<DVec3, CameraFileError> {
        let (key, node) = self.value(TRANSLATION)?;
        three(node).ok_or_else(|| self.unexpected(key, "3 finite numbers", node))
    }

    fn value(&self, aliases: &'static [&'static str]) -> Result<(&str, &Node), CameraFileError> {
        let missing = || CameraFileError::MissingKey { section: self.title.clone(), key: aliases[0] };
        self.node.entry(aliases).ok_or_else(missing)
    }

    fn place(&self, key: &str, node: &Node) -> Place {
        Place { section: self.title.clone(), key: key.to_owned(), line: Some(node.line) }
    }

    fn unexpected(&self, key: &str, expected: &'static str, got: &Node) -> CameraFileError {
        CameraFileError::Value { place: self.place(key, got), expected, got: got.to_string() }
    }

    fn invalid(&self, aliases: &[&str], source: CameraError) -> CameraFileError {
        let place = match self.node.entry(aliases) {
            Some((key, node)) => self.place(key, node),
            None => Place { section: self.title.clone(), key: aliases[0].to_owned(), line: None },
        };
        CameraFileError::Camera { place, source }
    }
}

/// The key that causes this error.
fn keys_of(error: &CameraError) -> &'static [&'static str] {
    match error {
        CameraError::Size { .. } => SIZE,
        CameraError::NotARotation { .. } => ROTATION,
        CameraError::LooksLikeMillimetres { .. } | CameraError::LooksLikeMetres { .. } => TRANSLATION,
        _ => MATRIX,
    }
}

fn whole(sides: [f64; 2]) -> Option<[u32; 2]> {
    let is_whole = |s: &f64| s.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(s);
    sides.iter().all(is_whole).then(|| sides.map(|s| s as u32))
}

fn three(node: &Node) -> Option<DVec3> {
    let numbers: [f64; 3] = node.numbers()?.try_into().ok()?;
    Some(DVec3::from(numbers))
}

/// A matrix row by row: three lists of three, nine numbers, or a table of `rows`, `cols` and `data`.
fn nine(node: &Node) -> Option<[f64; 9]> {
    if let Value::List(rows) = &node.value
        && rows.iter().any(|row| matches!(row.value, Value::List(_)))
        && !(rows.len() == 3 && rows.iter().all(|row| row.numbers().is_some_and(|row| row.len() == 3)))
    {
        return None;
    }
    node.numbers()?.try_into().ok()
}
