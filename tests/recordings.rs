//! Where the recordings are: motion capture, footage and keypoints that are not part of the project.
//!
//! The environment variable `MEMO_SHARED_DATA` names their folder; without it, `../shared/data` beside the project.
//! Tests that need them are reported as skipped where there is no such folder.

use std::path::PathBuf;

/// A file or folder of the recordings.
pub fn path(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("MEMO_RECORDINGS")).join(name);
    assert!(path.exists(), "the recordings lack {}", path.display());
    path
}

/// The text of a file of the recordings.
pub fn text(name: &str) -> String {
    std::fs::read_to_string(path(name)).unwrap()
}
