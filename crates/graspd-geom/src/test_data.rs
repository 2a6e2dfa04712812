//! Where tests find real scans, hands and captures (feature `testing`).

use std::path::PathBuf;

/// The path of a file of the shared test data, such as `data/ycb/025_mug.obj` or `reference/gws/N16.csv`.
///
/// Looks under `$GRASPD_TEST_DATA` and then in the folder `shared` beside the project. Where the file is
/// absent, says on stderr that the calling test was skipped, and why, and gives `None`.
pub fn shared_file(path: &str) -> Option<PathBuf> {
    let beside_project =
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../..")).join("shared");
    let root = std::env::var_os("GRASPD_TEST_DATA").map_or(beside_project, PathBuf::from);
    let file = root.join(path);
    if file.exists() {
        return Some(file);
    }
    eprintln!(
        "SKIPPED: {} does not exist; set GRASPD_TEST_DATA to the folder that holds {path}",
        file.display()
    );
    None
}
