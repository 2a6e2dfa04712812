//! One run with everything on, that many tests look at.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use serde_json::Value;

use crate::outcome::{Outcome, graspd, text};

/// How many grasps it has.
pub(crate) const GRASPS: usize = 6;

/// One run with everything on, shared by the tests: its folder, and what it printed.
pub(crate) static RUN: LazyLock<(PathBuf, Outcome)> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graspd-run");
    // Left by an earlier test run, if any.
    let _ = fs::remove_dir_all(&folder);
    let picture = folder.join("best.png");
    let arguments = [
        "synth",
        "box",
        "-n",
        "6",
        "--seed",
        "3",
        "--steps",
        "60",
        "--resolution",
        "48",
        "--preset",
        "paper",
        "--trajectory",
        "--meshes",
        "--json",
        "--png",
        text(&picture),
        "-o",
        text(&folder),
    ];
    let outcome = graspd(arguments);
    assert_eq!(outcome.status, Some(0), "{outcome:?}");
    (folder, outcome)
});

/// The records of a file.
pub(crate) fn lines(file: &Path) -> Vec<Value> {
    let text = fs::read_to_string(file).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}
