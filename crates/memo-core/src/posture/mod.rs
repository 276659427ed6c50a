//! One view, known lengths: three-dimensional postures from the image points of a detector or of marks.

pub mod detector;
pub mod person;
