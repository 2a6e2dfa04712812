//! Same seed, same inputs, same build: the same files, whatever the number of threads.

use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::tempdir;

use crate::outcome::{command, graspd, outcome, text};

fn synth(folder: &Path, name: &str, object: &str, flags: &[&str]) -> PathBuf {
    let output = folder.join(name);
    let mut arguments = vec!["synth", object, "--steps", "60", "--resolution", "48", "-q"];
    arguments.extend(["-o", text(&output)]);
    arguments.extend(flags);
    graspd(arguments).succeeds();
    output
}

/// The records in rank order without what may differ.
fn records(run: &Path) -> Vec<Value> {
    let file = std::fs::read_to_string(run.join("grasps.jsonl")).unwrap();
    let lines = file.lines().map(|line| {
        let mut record: Value = serde_json::from_str(line).unwrap();
        record.as_object_mut().unwrap().remove("seconds").unwrap();
        record
    });
    lines.collect()
}

/// Names and contents of the files that hold no timings.
fn other_files(run: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = vec![run.join("trajectory.npz")];
    let meshes = std::fs::read_dir(run.join("meshes")).unwrap();
    files.extend(meshes.map(|entry| entry.unwrap().path()));
    files.sort();
    let read = |path: PathBuf| {
        (
            path.strip_prefix(run).unwrap().to_owned(),
            std::fs::read(&path).unwrap(),
        )
    };
    files.into_iter().map(read).collect()
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let folder = tempdir().unwrap();
    let more = ["-n", "3", "--meshes", "--trajectory"];
    let with = |threads: &str| {
        let flags = [&["--threads", threads], &more[..]].concat();
        synth(folder.path(), threads, "mug", &flags)
    };
    let (one, two) = (with("1"), with("2"));
    let (serial, parallel) = (records(&one), records(&two));
    assert_eq!(serial.len(), 3);
    assert_eq!(serial, parallel);
    // Not even in how a number is written.
    assert_eq!(format!("{serial:?}"), format!("{parallel:?}"));
    assert_eq!(other_files(&one).len(), 5);
    assert!(other_files(&one) == other_files(&two));
}

/// Records of the built-in mug made with these vector instructions.
fn with_instructions(folder: &Path, name: &str) -> Vec<Value> {
    let output = folder.join(name);
    let mut synth = command(["synth", "mug", "-n", "2", "--hand", "human", "-q"]);
    synth.args(["--steps", "60", "--resolution", "48", "--no-cache", "-o"]);
    synth.arg(&output).env("GRASPD_INSTRUCTIONS", name);
    outcome(synth.output().unwrap()).succeeds();
    records(&output)
}

#[test]
fn vector_instructions_change_nothing() {
    let folder = tempdir().unwrap();
    let names = ["baseline", "avx2", "avx512"];
    let [baseline, avx2, avx512] = names.map(|name| with_instructions(folder.path(), name));
    assert_eq!(format!("{baseline:?}"), format!("{avx2:?}"));
    assert_eq!(format!("{baseline:?}"), format!("{avx512:?}"));

    let mut unknown = command(["objects"]);
    let unknown = unknown.env("GRASPD_INSTRUCTIONS", "sse9").output().unwrap();
    outcome(unknown).fails_at_once(&["GRASPD_INSTRUCTIONS", "sse9", "avx2"]);
}

#[test]
fn seeds_differ_and_starts_do_not_depend_on_how_many_there_are() {
    let folder = tempdir().unwrap();
    let seed = |name: &str, seed: &str, count: &str| {
        records(&synth(
            folder.path(),
            name,
            "box",
            &["--seed", seed, "-n", count],
        ))
    };
    let (first, again, other) = (
        seed("a", "7", "2"),
        seed("b", "7", "1"),
        seed("c", "8", "1"),
    );
    let of_index_0 = |records: &[Value]| {
        let record = records.iter().find(|record| record["index"] == 0).unwrap();
        (
            record["pose"].clone(),
            record["joints_rad"].clone(),
            record["metrics"].clone(),
        )
    };
    assert_eq!(of_index_0(&first), of_index_0(&again));
    assert_ne!(of_index_0(&first).0, of_index_0(&other).0);
    let poses: Vec<&Value> = first.iter().map(|record| &record["pose"]).collect();
    assert_ne!(poses[0], poses[1]);
}
