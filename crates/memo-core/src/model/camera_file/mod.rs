//! Reads and writes camera calibration files.
//!
//! | format | file name ends in | written by |
//! |---|---|---|
//! | TOML | `.toml` | Pose2Sim, anipose, Caliscope; one section per camera |
//! | YAML | `.yml`, `.yaml` | OpenCV's `FileStorage`, its calibration sample, ROS `camera_info` |
//! | JSON | `.json` | `FileStorage`, and files with the same keys |
//! | XML | `.xml` | `FileStorage`; Tsai's parameters as PETS and ETISEO publish them |
//! | DLT | `.csv`, `.txt`, `.dlt` | eleven coefficients per column: DLTdv, Argus, Kinovea |
//!
//! ```toml
//! [cam_01]
//! name = "cam_01"
//! size = [1280, 720]
//! matrix = [[1000.0, 0.0, 639.5], [0.0, 1000.0, 359.5], [0.0, 0.0, 1.0]]
//! distortions = [0.0, 0.0, 0.0, 0.0]       # k1, k2, p1, p2 and optionally k3, as OpenCV
//! rotation = [1.570796327, 0.0, 0.0]       # rotation vector, or a 3x3 matrix
//! translation = [0.0, 1.18, 4.4]           # x_cam = R x_world + t
//! fisheye = false
//! ```
//!
//! `name` and `fisheye` are optional; a `[metadata]` section is skipped. In TOML, unknown keys are an error;
//! in the other formats they are ignored. Keys may have OpenCV's names: `camera_matrix`,
//! `distortion_coefficients`, `image_width` and `image_height`, `rvec` or `R`, `tvec` or `T`. Lengths are in
//! metres (in Tsai's XML in mm) unless [`CameraFileOptions::unit`] gives another unit.
//!
//! Limits: fisheye lenses, skew and OpenCV's longer distortion models are refused. A file does not specify
//! whether its rotation is that of `x_cam = R x_world + t` or its inverse; the former is assumed.

mod dlt;
mod entry;
mod json;
mod node;
mod toml;
mod write;
mod xml;
mod yaml;

pub use write::NearestLens;

use std::fmt;
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::camera::{Camera, CameraError};

/// Largest file size, bytes; larger files are not calibrations.
const MAX_BYTES: u64 = 64 << 20;

/// The file format of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum FileFormat {
    /// TOML: Pose2Sim, anipose, Caliscope.
    Toml,
    /// YAML: OpenCV, ROS.
    Yaml,
    /// JSON with OpenCV's keys.
    Json,
    /// XML: OpenCV, or Tsai's parameters.
    Xml,
    /// A table of eleven DLT coefficients per camera.
    Dlt,
}

impl FileFormat {
    /// The format for the end of a file name; `None` for an unknown one.
    pub fn of_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "toml" => Some(Self::Toml),
            "yml" | "yaml" => Some(Self::Yaml),
            "json" => Some(Self::Json),
            "xml" => Some(Self::Xml),
            "csv" | "txt" | "tsv" | "dlt" => Some(Self::Dlt),
            _ => None,
        }
    }
}

impl fmt::Display for FileFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Toml => "TOML file",
            Self::Yaml => "YAML file",
            Self::Json => "JSON file",
            Self::Xml => "XML file",
            Self::Dlt => "table of DLT coefficients",
        })
    }
}

/// The unit of the lengths in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum LengthUnit {
    /// Metres.
    #[default]
    Metre,
    /// Centimetres.
    Centimetre,
    /// Millimetres.
    Millimetre,
}

impl LengthUnit {
    /// The size of the unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
        }
    }

    /// The unit named "m", "cm" or "mm".
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "m" => Some(Self::Metre),
            "cm" => Some(Self::Centimetre),
            "mm" => Some(Self::Millimetre),
            _ => None,
        }
    }
}

/// Values that a file may lack.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraFileOptions<'a> {
    /// The camera to read: its section, its `name` or the number of its column. Required if the file has
    /// several.
    pub name: Option<&'a str>,
    /// Unit of the translation; `None` is the default unit of the format.
    pub unit: Option<LengthUnit>,
    /// Width and height of the image, pixels, for files without them.
    pub size: Option<[u32; 2]>,
    /// Whether only the intrinsics are needed; the file then needs no rotation and translation.
    pub is_lens_only: bool,
    /// Whether v of DLT coefficients increases upwards from the bottom row; `None` refuses matrices that
    /// mirror.
    pub v_up: Option<bool>,
}

/// A place in a calibration file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The section or element of the camera.
    pub section: String,
    /// The key.
    pub key: String,
    /// The line number, from 1, if known.
    pub line: Option<usize>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{}] {}", self.section, self.key)?;
        self.line.map_or(Ok(()), |line| write!(f, " (line {line})"))
    }
}

/// Why a calibration file was refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraFileError {
    /// The file cannot be read.
    #[error("{path}: {message}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason given by the operating system.
        message: String,
    },
    /// The end of the file name is not that of a calibration format.
    #[error(
        "not a calibration by its name: .toml, .yaml, .json, .xml, or .csv and .txt for DLT coefficients"
    )]
    UnknownFormat,
    /// The text is not valid in its format.
    #[error("not a {format}: {message}")]
    Syntax {
        /// The format.
        format: FileFormat,
        /// What is wrong and where.
        message: String,
    },
    /// Values are nested too deeply.
    #[error("line {line}: nested too deeply for a calibration")]
    TooDeep {
        /// The line number, from 1.
        line: usize,
    },
    /// A key lies outside any section.
    #[error("key `{key}` stands outside a section; each camera needs one, such as [cam]")]
    OutsideSection {
        /// The key.
        key: String,
    },
    /// The file contains no camera.
    #[error("the file has no camera section")]
    NoCamera,
    /// The file contains several cameras and no name was given.
    #[error("the file has {} cameras, choose one of: {}", names.len(), names.join(", "))]
    SeveralCameras {
        /// Their sections.
        names: Vec<String>,
    },
    /// The requested camera is not in the file.
    #[error("no camera `{name}` in the file, it has: {}", names.join(", "))]
    UnknownCamera {
        /// The name requested.
        name: String,
        /// The sections of the file.
        names: Vec<String>,
    },
    /// A key of a section is unknown.
    #[error(
        "[{section}]: unknown key `{key}` (line {line}); known are name, size, matrix, distortions, rotation, translation, fisheye"
    )]
    UnknownKey {
        /// The section of the camera.
        section: String,
        /// The key.
        key: String,
        /// The line number, from 1.
        line: usize,
    },
    /// A required key is missing.
    #[error("[{section}]: missing key `{key}`")]
    MissingKey {
        /// The section of the camera.
        section: String,
        /// The key.
        key: &'static str,
    },
    /// The file has intrinsics but neither rotation nor translation.
    #[error(
        "[{section}]: neither rotation nor translation: the file says how the camera images, not where it stands"
    )]
    NoPlace {
        /// The section of the camera.
        section: String,
    },
    /// A value has the wrong type, shape or range.
    #[error("{place}: expected {expected}, got {got}")]
    Value {
        /// The place of the value.
        place: Place,
        /// What is supported.
        expected: &'static str,
        /// The value in the file.
        got: String,
    },
    /// Well-formed values that do not describe a valid camera.
    #[error("{place}: {source}")]
    Camera {
        /// The place of the values.
        place: Place,
        /// Why the camera is invalid.
        source: CameraError,
    },
    /// The XML is neither OpenCV's nor Tsai's.
    #[error("not a Tsai calibration in XML: attribute `{key}` is missing")]
    NotTsai {
        /// The first parameter that was not found.
        key: &'static str,
    },
    /// The format does not contain the image size.
    #[error("a {format} does not say how large the picture is: give its size")]
    SizeNeeded {
        /// The format.
        format: FileFormat,
    },
    /// The matrix of the DLT coefficients has no inverse.
    #[error("the DLT coefficients are no camera: their matrix has no inverse")]
    DegenerateDlt,
    /// The matrix of the DLT coefficients mirrors.
    #[error(
        "the DLT coefficients mirror: either v is counted upwards, as DLTdv does, or the origin lies behind the camera; say which"
    )]
    MirroredDlt,
    /// The DLT coefficients have too much skew.
    #[error(
        "the DLT coefficients are skewed by {skew_px:.1} px at a focal length of {focal_px:.0} px: no pixels are"
    )]
    Skew {
        /// Element (1, 2) of the matrix, pixels.
        skew_px: f64,
        /// Focal length along u, pixels.
        focal_px: f64,
    },
    /// The DLT coefficients do not describe a valid camera.
    #[error("DLT coefficients: {source}")]
    Dlt {
        /// Why the camera is invalid.
        source: CameraError,
    },
    /// The lens cannot be written as k1, k2 and k3.
    #[error("the lens cannot be written as k1, k2, k3: they would be off by {error_px:.2} px")]
    Lens {
        /// Largest difference in the image, pixels.
        error_px: f64,
    },
}

impl Camera {
    /// Reads a camera from a file; the end of the file name determines the format.
    ///
    /// # Errors
    ///
    /// The file cannot be read, is not valid in its format or describes no camera. Only the first error names
    /// the file.
    pub fn from_file(path: &Path, options: &CameraFileOptions<'_>) -> Result<Self, CameraFileError> {
        let unreadable = |message: String| CameraFileError::Read { path: path.to_owned(), message };
        let format = FileFormat::of_path(path).ok_or(CameraFileError::UnknownFormat)?;
        let length = std::fs::metadata(path).map_err(|error| unreadable(error.to_string()))?.len();
        if length > MAX_BYTES {
            return Err(unreadable(format!("{length} bytes are no calibration")));
        }
        let bytes = std::fs::read(path).map_err(|error| unreadable(error.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|_| {
            let message = "it is not text in UTF-8".to_owned();
            CameraFileError::Syntax { format, message }
        })?;
        Self::from_text(&text, format, options)
    }

    /// Reads a camera from the text of a file.
    ///
    /// # Errors
    ///
    /// The text is not valid in its format or describes no camera.
    pub fn from_text(
        text: &str,
        format: FileFormat,
        options: &CameraFileOptions<'_>,
    ) -> Result<Self, CameraFileError> {
        let root = match format {
            FileFormat::Toml => toml::parse(text)?,
            FileFormat::Yaml => yaml::parse(text)?,
            FileFormat::Json => json::parse(text)?,
            FileFormat::Xml => {
                let document = xml::parse(text)?;
                if !xml::is_opencv(&document) {
                    let unit = options.unit.unwrap_or(LengthUnit::Millimetre);
                    return xml::tsai_camera(&document, unit.metres() / LengthUnit::Millimetre.metres());
                }
                xml::opencv(&document)?
            }
            FileFormat::Dlt => return dlt::camera(text, options),
        };
        entry::camera(&root, format, options)
    }

    /// Reads a camera from TOML; `name` is its section or its `name` key and may be `None` if the file has
    /// only one camera.
    ///
    /// # Errors
    ///
    /// As [`Camera::from_text`].
    pub fn from_toml_str(text: &str, name: Option<&str>) -> Result<Self, CameraFileError> {
        Self::from_text(text, FileFormat::Toml, &CameraFileOptions { name, ..Default::default() })
    }
}

#[cfg(test)]
mod tests;
