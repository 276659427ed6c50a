//! Tells the compiler whether the recordings are there, so that tests that need them are reported as skipped.

use std::path::PathBuf;

fn main() {
    println!("cargo::rustc-check-cfg=cfg(recordings)");
    println!("cargo::rerun-if-env-changed=MEMO_SHARED_DATA");
    let beside_project = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    let folder = std::env::var_os("MEMO_SHARED_DATA").map_or_else(|| beside_project.into(), PathBuf::from);
    println!("cargo::rerun-if-changed={}", folder.display());
    println!("cargo::rustc-env=MEMO_RECORDINGS={}", folder.display());
    if folder.is_dir() {
        println!("cargo::rustc-cfg=recordings");
    }
}
