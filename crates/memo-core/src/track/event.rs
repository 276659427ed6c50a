//! Kinds of gait events.

/// Kind of gait event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
#[non_exhaustive]
pub enum EventKind {
    HeelStrike,
    ToeOff,
}

impl EventKind {
    /// The name in files: `heel_strike` (initial contact) or `toe_off`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HeelStrike => "heel_strike",
            Self::ToeOff => "toe_off",
        }
    }
}
