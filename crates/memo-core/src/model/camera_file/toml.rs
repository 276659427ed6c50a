//! TOML with line numbers.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::node::{Node, Value, check_depth, line_of};
use super::{CameraFileError, FileFormat};

pub(super) fn parse(text: &str) -> Result<Node, CameraFileError> {
    let syntax = |error: toml::de::Error| {
        let line = error.span().map(|span| format!("line {}: ", line_of(text, span.start)));
        let message = format!("{}{}", line.unwrap_or_default(), error.message());
        CameraFileError::Syntax { format: FileFormat::Toml, message }
    };
    let table = DeTable::parse(text).map_err(syntax)?;
    Ok(Node { line: 1, value: entries(text, table.get_ref(), 0)? })
}

fn entries(text: &str, table: &DeTable<'_>, depth: usize) -> Result<Value, CameraFileError> {
    let entry = |(key, value): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        let key: &std::borrow::Cow<'_, str> = key.get_ref();
        Ok((key.clone().into_owned(), node(text, value, depth + 1)?))
    };
    Ok(Value::Table(table.iter().map(entry).collect::<Result<_, CameraFileError>>()?))
}

fn node(text: &str, value: &Spanned<DeValue<'_>>, depth: usize) -> Result<Node, CameraFileError> {
    let line = line_of(text, value.span().start);
    check_depth(depth, line)?;
    let value = match value.get_ref() {
        DeValue::String(words) => Value::Text(words.clone().into_owned()),
        DeValue::Integer(number) => {
            i64::from_str_radix(number.as_str(), number.radix()).map_or(f64::NAN, |i| i as f64).into()
        }
        DeValue::Float(number) => number.as_str().parse().unwrap_or(f64::NAN).into(),
        DeValue::Boolean(value) => Value::Bool(*value),
        DeValue::Datetime(time) => Value::Text(time.to_string()),
        DeValue::Array(items) => {
            Value::List(items.iter().map(|item| node(text, item, depth + 1)).collect::<Result<_, _>>()?)
        }
        DeValue::Table(table) => entries(text, table, depth)?,
    };
    Ok(Node { line, value })
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}
