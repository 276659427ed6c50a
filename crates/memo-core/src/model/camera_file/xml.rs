//! XML: OpenCV's `FileStorage`, and Tsai's parameters as PETS and ETISEO publish them.

use glam::{DVec2, DVec3};
use roxmltree::{Document, ParsingOptions};

use super::node::{Node, Value, check_depth};
use super::{CameraFileError, FileFormat, Place};
use crate::model::camera::{Camera, TsaiParameters};

/// Largest number of nodes; calibrations have some hundred.
const MAX_NODES: u32 = 1_000_000;

pub(super) fn parse(text: &str) -> Result<Document<'_>, CameraFileError> {
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let syntax = |error: roxmltree::Error| CameraFileError::Syntax {
        format: FileFormat::Xml,
        message: error.to_string(),
    };
    Document::parse_with_options(text.trim_start_matches('\u{feff}'), options).map_err(syntax)
}

/// Whether OpenCV wrote the document; otherwise Tsai's parameters are expected.
pub(super) fn is_opencv(document: &Document<'_>) -> bool {
    document.root_element().has_tag_name("opencv_storage")
}

/// Reads OpenCV's XML: elements are keys, `<_>` are items of a list, matrices hold numbers separated by
/// blanks.
pub(super) fn opencv(document: &Document<'_>) -> Result<Node, CameraFileError> {
    node(document, document.root_element(), 0)
}

fn node(
    document: &Document<'_>,
    element: roxmltree::Node<'_, '_>,
    depth: usize,
) -> Result<Node, CameraFileError> {
    let line = line(document, element);
    check_depth(depth, line)?;
    let children: Vec<_> = element.children().filter(roxmltree::Node::is_element).collect();
    let value = if children.is_empty() {
        leaf(line, element.text().unwrap_or_default())
    } else if children.iter().all(|child| child.has_tag_name("_")) {
        let items = children.into_iter().map(|child| node(document, child, depth + 1));
        Value::List(items.collect::<Result<_, _>>()?)
    } else {
        let entry = |child: roxmltree::Node<'_, '_>| {
            Ok((child.tag_name().name().to_owned(), node(document, child, depth + 1)?))
        };
        Value::Table(children.into_iter().map(entry).collect::<Result<_, CameraFileError>>()?)
    };
    Ok(Node { line, value })
}

/// One scalar, or a list where every word is a number.
fn leaf(line: usize, text: &str) -> Value {
    let items: Vec<Node> = text.split_whitespace().map(|word| Node::from_text(line, word)).collect();
    let is_list = items.len() > 1 && items.iter().all(|item| matches!(item.value, Value::Number(_)));
    if is_list {
        return Value::List(items);
    }
    Node::from_text(line, text.trim().trim_matches('"')).value
}

/// Tsai's parameters: attributes of `Geometry`, `Intrinsic` and `Extrinsic`, lengths in mm.
pub(super) fn tsai(document: &Document<'_>) -> Result<TsaiParameters, CameraFileError> {
    let [width, height] = [number(document, "width")?, number(document, "height")?];
    let [dpx, dpy, cx, cy] = numbers(document, ["dpx", "dpy", "cx", "cy"])?;
    let [tx, ty, tz, rx, ry, rz] = numbers(document, ["tx", "ty", "tz", "rx", "ry", "rz"])?;
    Ok(TsaiParameters {
        size: [width, height].map(|side| side.clamp(0.0, f64::from(u32::MAX)) as u32),
        pixel_mm: DVec2::new(dpx, dpy),
        focal_mm: number(document, "focal")?,
        kappa1_per_mm2: number(document, "kappa1")?,
        centre_px: DVec2::new(cx, cy),
        sx: number(document, "sx")?,
        translation_mm: DVec3::new(tx, ty, tz),
        rotation_rad: DVec3::new(rx, ry, rz),
    })
}

/// Tsai's camera.
pub(super) fn tsai_camera(document: &Document<'_>, mm: f64) -> Result<Camera, CameraFileError> {
    let tsai = tsai(document)?;
    let scaled = TsaiParameters { translation_mm: tsai.translation_mm * mm, ..tsai };
    let place = || Place { section: "Camera".to_owned(), key: "Tsai's parameters".to_owned(), line: None };
    Camera::from_tsai(&scaled).map_err(|source| CameraFileError::Camera { place: place(), source })
}

fn numbers<const N: usize>(
    document: &Document<'_>,
    keys: [&'static str; N],
) -> Result<[f64; N], CameraFileError> {
    let mut found = [0.0; N];
    for (slot, key) in found.iter_mut().zip(keys) {
        *slot = number(document, key)?;
    }
    Ok(found)
}

/// The attribute with that name, in any element.
fn number(document: &Document<'_>, key: &'static str) -> Result<f64, CameraFileError> {
    let having = document.descendants().find(|element| element.has_attribute(key));
    let missing = || CameraFileError::NotTsai { key };
    let element = having.ok_or_else(missing)?;
    let text = element.attribute(key).ok_or_else(missing)?;
    text.trim().parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| CameraFileError::Value {
        place: Place {
            section: element.tag_name().name().to_owned(),
            key: key.to_owned(),
            line: Some(line(document, element)),
        },
        expected: "a finite number",
        got: format!("{text:?}"),
    })
}

fn line(document: &Document<'_>, element: roxmltree::Node<'_, '_>) -> usize {
    document.text_pos_at(element.range().start).row as usize
}
