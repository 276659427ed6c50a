//! JSON with line numbers.

use std::collections::BTreeMap;

use serde_json::value::RawValue;

use super::node::{Node, Value, check_depth, line_of};
use super::{CameraFileError, FileFormat};

pub(super) fn parse(text: &str) -> Result<Node, CameraFileError> {
    let text = text.trim_start_matches('\u{feff}');
    let root: &RawValue = serde_json::from_str(text).map_err(syntax)?;
    node(text, root, 0)
}

fn node(text: &str, raw: &RawValue, depth: usize) -> Result<Node, CameraFileError> {
    let written = raw.get();
    // A raw value is a slice of the text, so the difference of the two addresses is its offset.
    let line = line_of(text, (written.as_ptr() as usize).saturating_sub(text.as_ptr() as usize));
    check_depth(depth, line)?;
    let value = match written.as_bytes().first() {
        Some(b'{') => {
            let entries: BTreeMap<String, &RawValue> = serde_json::from_str(written).map_err(syntax)?;
            let entry = |(key, raw)| Ok((key, node(text, raw, depth + 1)?));
            Value::Table(entries.into_iter().map(entry).collect::<Result<_, CameraFileError>>()?)
        }
        Some(b'[') => {
            let items: Vec<&RawValue> = serde_json::from_str(written).map_err(syntax)?;
            Value::List(items.into_iter().map(|raw| node(text, raw, depth + 1)).collect::<Result<_, _>>()?)
        }
        Some(b'"') => Value::Text(serde_json::from_str(written).map_err(syntax)?),
        _ => Node::from_text(line, written).value,
    };
    Ok(Node { line, value })
}

fn syntax(error: serde_json::Error) -> CameraFileError {
    CameraFileError::Syntax { format: FileFormat::Json, message: error.to_string() }
}
