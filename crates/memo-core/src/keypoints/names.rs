//! Names of points: one name here, and the spellings of detectors, motion capture and tables that map to it.

use thiserror::Error;

use crate::wording::counted;

/// Names of the joints of the stick figure in the order of the paper's tree, the root first.
pub const STICK_JOINTS: [&str; 14] = [
    "neck",
    "right_shoulder",
    "left_shoulder",
    "pelvis",
    "right_hip",
    "left_hip",
    "right_elbow",
    "left_elbow",
    "right_wrist",
    "left_wrist",
    "right_knee",
    "left_knee",
    "right_ankle",
    "left_ankle",
];

/// Why points were refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DetectorError {
    /// There is no layout with this name.
    #[error("unknown keypoint layout `{name}`{}; known are {}", hint(nearest), known.join(", "))]
    UnknownLayout {
        /// The name given.
        name: String,
        /// The most similar known name, if one is similar.
        nearest: Option<&'static str>,
        /// The known names.
        known: Vec<&'static str>,
    },
    /// There is no point with this name.
    #[error("unknown joint `{name}`{}; known are {}", hint(nearest), joint_names().join(", "))]
    UnknownJoint {
        /// The name given.
        name: String,
        /// The most similar known name, if one is similar.
        nearest: Option<&'static str>,
    },
    /// Two points have the same name.
    #[error("joint `{name}` is named twice, at places {first} and {second}")]
    RepeatedJoint {
        /// The joint.
        name: &'static str,
        /// Index of the first one.
        first: usize,
        /// Index of the second one.
        second: usize,
    },
    /// The number of points or scores differs from the number of names.
    #[error("expected {expected} {what}, got {got}")]
    Count {
        /// "points" or "scores".
        what: &'static str,
        /// The number of names.
        expected: usize,
        /// The number given.
        got: usize,
    },
    /// No layout has this number of points.
    #[error("no keypoint layout has {}; known are {}", counted(*count, "point"), known.join(", "))]
    UnknownCount {
        /// The number of points.
        count: usize,
        /// The known numbers of points, each with its layout.
        known: Vec<String>,
    },
    /// Two layouts have this number of points and the points do not determine which.
    #[error(
        "{count} points may be {} or {}, and they do not tell which{}: name the layout",
        names[0], names[1], distance.map_or(String::new(), |far| format!(" (middle test {far:.3})"))
    )]
    UnclearLayout {
        /// The number of points.
        count: usize,
        /// The layouts with that number of points.
        names: [&'static str; 2],
        /// Result of the middle test, if a frame has the points; see
        /// [`Layout::from_points`](super::layouts::Layout::from_points).
        distance: Option<f64>,
    },
}

fn hint(nearest: &Option<&'static str>) -> String {
    nearest.map_or(String::new(), |name| format!(", did you mean `{name}`?"))
}

/// Points that are swapped together when a detector confuses right and left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum SwapGroup {
    /// Hip, knee, ankle, heel and toes.
    Legs,
    /// Shoulder, elbow, wrist and fingers.
    Arms,
    /// Eyes, ears and mouth.
    Head,
}

impl SwapGroup {
    /// The name of the group in files: "legs", "arms" or "head".
    pub fn name(self) -> &'static str {
        match self {
            Self::Legs => "legs",
            Self::Arms => "arms",
            Self::Head => "head",
        }
    }
}

/// Points without a side, with their other spellings (lower case, letters and digits only).
const MIDDLE_PARTS: [(&str, &[&str]); 6] = [
    ("nose", &[]),
    ("neck", &[]),
    ("upper_neck", &[]),
    ("head_top", &["head"]),
    ("mid_hip", &["hip", "chip", "mhip"]),
    ("pelvis", &[]),
];

/// Parts with a right and a left point: group, right name, left name, other spellings of the part.
pub(super) const SIDE_PARTS: [(SwapGroup, &str, &str, &[&str]); 17] = [
    (SwapGroup::Legs, "right_hip", "left_hip", &["hp"]),
    (SwapGroup::Legs, "right_knee", "left_knee", &["kn"]),
    (SwapGroup::Legs, "right_ankle", "left_ankle", &["an"]),
    (SwapGroup::Legs, "right_heel", "left_heel", &["hee"]),
    (SwapGroup::Legs, "right_big_toe", "left_big_toe", &["footindex"]),
    (SwapGroup::Legs, "right_small_toe", "left_small_toe", &[]),
    (SwapGroup::Arms, "right_shoulder", "left_shoulder", &["sh"]),
    (SwapGroup::Arms, "right_elbow", "left_elbow", &["el"]),
    (SwapGroup::Arms, "right_wrist", "left_wrist", &["wr"]),
    (SwapGroup::Arms, "right_pinky", "left_pinky", &[]),
    (SwapGroup::Arms, "right_index", "left_index", &[]),
    (SwapGroup::Arms, "right_thumb", "left_thumb", &[]),
    (SwapGroup::Head, "right_eye", "left_eye", &[]),
    (SwapGroup::Head, "right_ear", "left_ear", &[]),
    (SwapGroup::Head, "right_eye_inner", "left_eye_inner", &[]),
    (SwapGroup::Head, "right_eye_outer", "left_eye_outer", &[]),
    (SwapGroup::Head, "right_mouth", "left_mouth", &[]),
];

/// The names of all points.
pub fn joint_names() -> Vec<&'static str> {
    let middle = MIDDLE_PARTS.iter().map(|(name, _)| *name);
    middle.chain(SIDE_PARTS.iter().flat_map(|(_, right, left, _)| [*right, *left])).collect()
}

/// The name used here for a point spelled in any known way: `RKnee`, `right_knee`, `RIGHT_KNEE`, `RKN`.
///
/// # Errors
///
/// There is no point with this name.
pub fn joint_name(name: &str) -> Result<&'static str, DetectorError> {
    let plain = plain(name);
    let spelt = |own: &str, others: &[&str]| plain_is(own, &plain) || others.contains(&plain.as_str());
    if let Some((found, _)) = MIDDLE_PARTS.iter().find(|(own, others)| spelt(own, others)) {
        return Ok(found);
    }
    for (_, right, left, others) in &SIDE_PARTS {
        let part = right.trim_start_matches("right_");
        for (side, own) in [("right", right), ("left", left)] {
            let sides = [side, &side[..1]];
            let before =
                |side: &str| plain.strip_prefix(side).is_some_and(|rest| rest_is(rest, part, others));
            let after = |side: &str| plain.strip_suffix(side).is_some_and(|rest| rest_is(rest, part, others));
            if sides.into_iter().any(before) || after(side) {
                return Ok(own);
            }
        }
    }
    Err(DetectorError::UnknownJoint { name: name.to_owned(), nearest: nearest(&plain, joint_names()) })
}

fn rest_is(rest: &str, part: &str, others: &[&str]) -> bool {
    plain_is(part, rest) || others.contains(&rest)
}

/// Lower case, letters and digits only.
pub(super) fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_ascii_alphanumeric()).map(|c| c.to_ascii_lowercase()).collect()
}

/// Whether a name of this project equals `plain` without its underscores.
fn plain_is(own: &str, plain: &str) -> bool {
    own.bytes().filter(|&b| b != b'_').eq(plain.bytes())
}

/// The known name most similar to `plain`, if at most one letter differs, or two from eight letters on.
pub(super) fn nearest(plain_name: &str, known: Vec<&'static str>) -> Option<&'static str> {
    const LONGEST: usize = 40;
    if plain_name.is_empty() || plain_name.len() > LONGEST {
        return None;
    }
    let allowed = if plain_name.len() < 8 { 1 } else { 2 };
    let distances = known.into_iter().map(|name| (edit_distance(&plain(name), plain_name), name));
    distances.filter(|(distance, _)| *distance <= allowed).min().map(|(_, name)| name)
}

/// Number of letters to insert, delete, replace or exchange with their neighbour to turn one text into the
/// other (distance of Damerau and Levenshtein, each stretch edited once).
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    let mut before = vec![0; b.len() + 1];
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let changed = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = changed.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}
