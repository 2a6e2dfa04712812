//! Readers that go away, and outputs that are full.

use std::fs::File;
use std::process::Stdio;

use crate::outcome::{command, outcome};

#[test]
fn a_reader_that_has_seen_enough_is_no_failure() {
    for arguments in [
        &["objects"][..],
        &["hands"],
        &["hands", "inspect", "allegro"],
        &["objects", "--json"],
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let run = command(arguments)
            .stdout(writer)
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        let run = outcome(run);
        assert_eq!((run.status, run.stderr.as_str()), (Some(0), ""));
    }
}

#[test]
fn a_full_disk_behind_stdout_is_told() {
    let Ok(full) = File::options().write(true).open("/dev/full") else {
        return;
    };
    let run = command(["objects"])
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    outcome(run).fails_at_once(&["standard output", "No space left"]);
}

#[test]
fn progress_that_cannot_be_told_stops_nothing() {
    let Ok(full) = File::options().write(true).open("/dev/full") else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("box.npz");
    let arguments = [
        "sdf",
        "box",
        "--resolution",
        "8",
        "-o",
        file.to_str().unwrap(),
    ];
    let run = command(arguments).stderr(full).output().unwrap();
    assert_eq!(run.status.code(), Some(0));
    assert!(file.exists());
}
