//! YAML as OpenCV's `FileStorage`, ROS and PyYAML write it.
//!
//! OpenCV up to version 4 begins its files with `%YAML:1.0`, which is not valid YAML: that line is removed.
//! Anchors and aliases are refused; of several documents only the first is read.

use saphyr_parser::{Event, Parser, ScalarStyle, Span};

use super::node::{Node, Value, check_depth};
use super::{CameraFileError, FileFormat};

/// A list or table whose end has not been read yet.
enum Open {
    List(usize, Vec<Node>),
    Table(usize, Vec<(String, Node)>, Option<String>),
}

pub(super) fn parse(text: &str) -> Result<Node, CameraFileError> {
    let text = text.trim_start_matches('\u{feff}');
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    let is_directive = first.starts_with("%YAML");
    let body = if is_directive { rest } else { text };
    let mut open: Vec<Open> = Vec::new();
    for event in Parser::new_from_str(body) {
        let shifted = |line: usize| line + usize::from(is_directive);
        let (event, span): (Event<'_>, Span) = event.map_err(|error| {
            let message = format!("line {}: {}", shifted(error.marker().line()), error.info());
            CameraFileError::Syntax { format: FileFormat::Yaml, message }
        })?;
        let line = shifted(span.start.line());
        check_depth(open.len(), line)?;
        let complete = match event {
            Event::Scalar(value, ScalarStyle::Plain, ..) => Some(Node::from_text(line, &value)),
            Event::Scalar(value, ..) => Some(Node { line, value: Value::Text(value.into_owned()) }),
            Event::SequenceStart(..) => {
                open.push(Open::List(line, Vec::new()));
                None
            }
            Event::MappingStart(..) => {
                open.push(Open::Table(line, Vec::new(), None));
                None
            }
            Event::SequenceEnd | Event::MappingEnd => open.pop().map(closed),
            Event::Alias(_) => return Err(syntax(line, "aliases are not supported")),
            _ => None,
        };
        let Some(node) = complete else { continue };
        match open.last_mut() {
            None => return Ok(node),
            Some(Open::List(_, items)) => items.push(node),
            Some(Open::Table(_, entries, key)) => match key.take() {
                Some(key) => entries.push((key, node)),
                None => *key = Some(key_of(&node)?),
            },
        }
    }
    Ok(Node { line: 1, value: Value::Null })
}

fn closed(open: Open) -> Node {
    match open {
        Open::List(line, items) => Node { line, value: Value::List(items) },
        Open::Table(line, entries, _) => Node { line, value: Value::Table(entries) },
    }
}

fn key_of(node: &Node) -> Result<String, CameraFileError> {
    match &node.value {
        Value::Text(text) => Ok(text.clone()),
        Value::Number(_) | Value::Bool(_) | Value::Null => Ok(node.to_string()),
        _ => Err(syntax(node.line, "a key is a list or table")),
    }
}

fn syntax(line: usize, what: &str) -> CameraFileError {
    CameraFileError::Syntax { format: FileFormat::Yaml, message: format!("line {line}: {what}") }
}
