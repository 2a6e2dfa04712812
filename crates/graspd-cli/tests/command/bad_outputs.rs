//! Outputs that cannot be written are found before the work and not after.
//!
//! Paths below a regular file cannot be written by anyone, not even by root.

use tempfile::tempdir;

use crate::outcome::{graspd, text};

#[test]
fn output_folders() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "content").unwrap();
    for output in [file.clone(), file.join("run")] {
        let parts = [text(&output), "cannot write", "choose another", "-o"];
        graspd(["synth", "-o", text(&output)]).fails_at_once(&parts);
    }
    assert_eq!(std::fs::read_to_string(file).unwrap(), "content");
}

#[test]
fn output_files() {
    let folder = tempdir().unwrap();
    let at = |name: &str| text(&folder.path().join(name)).to_owned();
    let (file, run, records) = (at("file"), at("run"), at("grasps.jsonl"));
    std::fs::write(&file, "content").unwrap();
    std::fs::write(&records, crate::judging::line(&[])).unwrap();
    let folder_itself = text(folder.path()).to_owned();
    for (output, fault) in [
        (at("file/out"), "cannot be written"),
        (at("no such folder/out"), "cannot be written"),
        (folder_itself, "this is a folder"),
    ] {
        let synth = graspd(["synth", "-o", &run, "--png", &output]);
        synth.fails_at_once(&[&output, fault, "--png"]);
        graspd(["sdf", "mug", "-o", &output]).fails_at_once(&[&output, fault, "-o"]);
        graspd(["eval", &records, "-o", &output]).fails_at_once(&[&output, fault, "-o"]);
    }
    assert_eq!(std::fs::read_to_string(file).unwrap(), "content");
    // What the checks wrote is gone.
    let mut left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    left.sort();
    assert_eq!(left, ["file", "grasps.jsonl", "run"]);
    assert_eq!(
        std::fs::read_dir(folder.path().join("run"))
            .unwrap()
            .count(),
        0
    );
}
