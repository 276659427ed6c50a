//! The one error of an option outside its range.

use thiserror::Error;

/// An option outside its range.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("{name} must be {wanted}, got {got}")]
pub struct OptionError {
    /// Name of the option, as the field is called.
    pub name: &'static str,
    /// The values that are accepted.
    pub wanted: &'static str,
    /// The value that came; of a list the first that is refused.
    pub got: f64,
}

impl OptionError {
    /// Refuses `got` unless `is_good`.
    pub(crate) fn unless(
        is_good: bool,
        name: &'static str,
        wanted: &'static str,
        got: f64,
    ) -> Result<(), Self> {
        if is_good { Ok(()) } else { Err(Self { name, wanted, got }) }
    }

    /// Refuses what is not a positive, finite number.
    pub(crate) fn unless_positive(name: &'static str, got: f64) -> Result<(), Self> {
        Self::unless(got > 0.0 && got.is_finite(), name, "positive and finite", got)
    }

    /// Refuses negative numbers and what is not finite.
    pub(crate) fn unless_at_least_0(name: &'static str, got: f64) -> Result<(), Self> {
        Self::unless(got >= 0.0 && got.is_finite(), name, "finite and not negative", got)
    }
}
