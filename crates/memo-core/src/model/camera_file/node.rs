//! The content of a calibration file, whatever its format: values, lists and tables with their line numbers.

use std::fmt;

use super::CameraFileError;

/// Largest nesting depth: files nest two or three levels deep, and the readers recurse.
pub(super) const MAX_DEPTH: usize = 24;

/// A value and the line number at which it begins, from 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    pub(super) line: usize,
    pub(super) value: Value,
}

/// The value of a node.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// Nothing.
    Null,
    /// true or false.
    Bool(bool),
    /// Any number, including NaN and infinities.
    Number(f64),
    /// Any other text.
    Text(String),
    /// Values in order.
    List(Vec<Node>),
    /// Named values, in order.
    Table(Vec<(String, Node)>),
}

impl Node {
    /// A scalar as YAML and XML write it, without a type.
    pub(super) fn from_text(line: usize, text: &str) -> Self {
        let value = match text {
            "" | "~" | "null" => Value::Null,
            "true" | "True" => Value::Bool(true),
            "false" | "False" => Value::Bool(false),
            _ => text.parse().map_or_else(|_| Value::Text(text.to_owned()), Value::Number),
        };
        Self { line, value }
    }

    /// The entries, if the node is a table.
    pub(super) fn table(&self) -> Option<&[(String, Self)]> {
        match &self.value {
            Value::Table(entries) => Some(entries),
            _ => None,
        }
    }

    /// The first entry of a table under any of several names, in the order of the names.
    pub(super) fn entry(&self, aliases: &[&str]) -> Option<(&str, &Self)> {
        let entries = self.table()?;
        let under = |alias: &&str| entries.iter().find(|(key, _)| plain(key) == **alias);
        aliases.iter().find_map(under).map(|(key, node)| (key.as_str(), node))
    }

    /// The text, if the node is text.
    pub(super) fn text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The number, if the node is a finite number.
    pub(super) fn number(&self) -> Option<f64> {
        match self.value {
            Value::Number(number) if number.is_finite() => Some(number),
            _ => None,
        }
    }

    /// All numbers row by row: of a list, of a list of lists, or of a table of `rows`, `cols` and `data`.
    ///
    /// `None` if any other value is among them, or if their count differs from that of the matrix.
    pub(super) fn numbers(&self) -> Option<Vec<f64>> {
        match &self.value {
            Value::List(items) => {
                let nested = items.iter().map(|item| match item.value {
                    Value::List(_) => item.numbers(),
                    _ => item.number().map(|number| vec![number]),
                });
                nested.collect::<Option<Vec<_>>>().map(|parts| parts.concat())
            }
            Value::Table(_) => {
                let side = |key| self.entry(&[key])?.1.number();
                let data = self.entry(&["data"])?.1.numbers()?;
                // OpenCV 5 writes one-dimensional arrays as `opencv-nd-matrix` with `sizes`.
                let count = match self.entry(&["sizes"]) {
                    Some((_, sizes)) => sizes.number().or_else(|| Some(sizes.numbers()?.iter().product()))?,
                    None => side("rows")? * side("cols")?,
                };
                (count == data.len() as f64).then_some(data)
            }
            _ => None,
        }
    }
}

/// A key without the differences between writers: capitals and underscores.
pub(super) fn plain(key: &str) -> String {
    key.chars().filter(|c| !matches!(c, '_' | '-')).flat_map(char::to_lowercase).collect()
}

/// The line number of a byte, from 1.
pub(super) fn line_of(text: &str, byte: usize) -> usize {
    1 + text.as_bytes().iter().take(byte).filter(|&&b| b == b'\n').count()
}

/// Refuses values nested deeper than in any calibration.
pub(super) fn check_depth(depth: usize, line: usize) -> Result<(), CameraFileError> {
    if depth <= MAX_DEPTH { Ok(()) } else { Err(CameraFileError::TooDeep { line }) }
}

impl fmt::Display for Node {
    /// At most one line of the value.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        write_short(&mut text, self);
        match text.char_indices().nth(80) {
            Some((end, _)) => write!(f, "{}...", &text[..end]),
            None => f.write_str(&text),
        }
    }
}

fn write_short(text: &mut String, node: &Node) {
    if text.len() > 400 {
        return;
    }
    match &node.value {
        Value::Null => text.push_str("nothing"),
        Value::Bool(value) => text.push_str(&value.to_string()),
        Value::Number(number) => text.push_str(&number.to_string()),
        Value::Text(words) => text.push_str(&format!("{words:?}")),
        Value::List(items) => {
            text.push('[');
            for (i, item) in items.iter().enumerate() {
                text.push_str(if i > 0 { ", " } else { "" });
                write_short(text, item);
            }
            text.push(']');
        }
        Value::Table(entries) => {
            text.push('{');
            for (i, (key, item)) in entries.iter().enumerate() {
                text.push_str(if i > 0 { ", " } else { "" });
                text.push_str(key);
                text.push_str(": ");
                write_short(text, item);
            }
            text.push('}');
        }
    }
}
