//! Files of records: read with a word on every fault, written whole or not at all.

use std::path::{Path, PathBuf};

use graspd::{GraspError, read_records, write_atomically, write_records};
use tempfile::TempDir;

use crate::fixtures::bare_record;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("the folder is ours");
    let mut names: Vec<_> = entries
        .map(|entry| entry.expect("the folder is ours").file_name())
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn file_with(folder: &TempDir, text: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.path().join("grasps.jsonl");
    std::fs::write(&path, text).expect("the folder is ours");
    path
}

fn line(index: usize) -> String {
    serde_json::to_string(&bare_record(index)).expect("plain numbers")
}

/// The line that the error names, and its text, which must name the file.
fn parse_error(path: &Path) -> (usize, String) {
    let error = read_records(path).expect_err("it is no file of records");
    let text = error.to_string();
    assert!(text.contains(&*path.to_string_lossy()), "{text}");
    match error {
        GraspError::ParseRecord { line, .. } => (line, text),
        other => panic!("{other:?}"),
    }
}

#[test]
fn records_are_read_back_in_order() {
    let folder = folder();
    let path = folder.path().join("grasps.jsonl");
    let records = [2, 0, 1].map(bare_record);
    write_records(&path, &records).expect("the folder is ours");
    assert_eq!(read_records(&path).expect("what was just written"), records);
    let text = std::fs::read_to_string(&path).expect("what was just written");
    assert_eq!(text.lines().count(), 3);
    assert!(text.ends_with('\n'));
}

#[test]
fn blank_lines_and_dos_line_ends_are_fine() {
    let folder = folder();
    let path = file_with(&folder, format!("\r\n{}\r\n\n{}", line(0), line(1)));
    let read = read_records(&path).expect("two records");
    assert_eq!(read, [0, 1].map(bare_record));
}

#[test]
fn a_fault_is_reported_with_file_and_line() {
    let folder = folder();
    for bad in [
        "not json",
        "{}",
        "[]",
        "\"x\"",
        r#"{"schema": "graspd.grasp/1""#,
        &line(1).replace("\"index\":1", "\"index\":-1"),
        &line(1).replace("0.3]", "null]"),
        &line(1).replace("0.3]", "1e999]"),
        &line(1).replace("\"hand\":\"allegro\",", ""),
    ] {
        let path = file_with(&folder, format!("{}\n\n{bad}\n{}\n", line(0), line(2)));
        let (line, text) = parse_error(&path);
        assert_eq!(line, 3, "{text}");
        assert!(text.contains("line 3"), "{text}");
    }
}

#[test]
fn another_schema_is_refused() {
    let folder = folder();
    for other in ["graspd.grasp/2", "something else", ""] {
        let path = file_with(&folder, line(0).replace(graspd::SCHEMA, other));
        let (line, text) = parse_error(&path);
        assert_eq!(line, 1);
        assert!(text.contains(&format!("`{other}`")), "{text}");
    }
}

#[test]
fn a_file_without_records_is_refused() {
    let folder = folder();
    for text in ["", "\n \n"] {
        let (line, _) = parse_error(&file_with(&folder, text));
        assert_eq!(line, 0);
    }
    for path in [
        folder.path().join("missing"),
        folder.path().to_owned(),
        file_with(&folder, [0xff]),
    ] {
        let error = read_records(&path).expect_err("it cannot be read");
        assert!(matches!(&error, GraspError::Read { path: named, .. } if *named == path));
    }
}

/// JSON has no NaN: such a record could be written but never read again.
#[test]
fn a_record_that_could_not_be_read_again_is_not_written() {
    let folder = folder();
    let path = file_with(&folder, "old");
    let mut bad = bare_record(1);
    bad.pose.translation_m[0] = f64::NAN;
    let error = write_records(&path, &[bare_record(0), bad]).expect_err("NaN is no number");
    assert!(
        matches!(error, GraspError::InvalidRecord { index: 1, .. }),
        "{error}"
    );
    assert_eq!(std::fs::read(&path).expect("it is there"), b"old");
}

#[test]
fn writing_replaces_the_file_and_leaves_nothing_else() {
    let folder = folder();
    let path = file_with(&folder, "a longer text than the next");
    for text in ["short", "", "a text that is longer again"] {
        write_atomically(&path, text.as_bytes()).expect("the folder is ours");
        assert_eq!(std::fs::read(&path).expect("it is there"), text.as_bytes());
        assert_eq!(names_in(folder.path()), ["grasps.jsonl"]);
    }
}

#[test]
fn a_failure_leaves_what_was_there() {
    let folder = folder();
    // A folder has the file's name: the new text can be written, but not put in its place.
    let path = folder.path().join("grasps.jsonl");
    std::fs::create_dir(&path).expect("the folder is ours");
    std::fs::write(path.join("old"), "old").expect("the folder is ours");
    let error = write_atomically(&path, b"new").expect_err("a folder is in the way");
    assert!(matches!(&error, GraspError::Write { path: named, .. } if *named == path));
    assert_eq!(
        std::fs::read(path.join("old")).expect("it is there"),
        b"old"
    );
    assert_eq!(names_in(folder.path()), ["grasps.jsonl"]);
}

#[test]
fn a_failure_at_the_last_moment_leaves_no_temporary_file() {
    let folder = folder();
    let path = folder.path().join("grasps.jsonl");
    // A folder that is not empty cannot be replaced by a file.
    std::fs::create_dir_all(path.join("inside")).expect("the folder is ours");
    let error = write_atomically(&path, b"new").expect_err("a folder is in the way");
    assert!(error.to_string().contains("grasps.jsonl"), "{error}");
    assert_eq!(names_in(folder.path()), ["grasps.jsonl"]);

    let nowhere = folder.path().join("no such folder").join("grasps.jsonl");
    let error = write_atomically(&nowhere, b"new").expect_err("there is no such folder");
    assert!(error.to_string().contains("no such folder"), "{error}");
    assert_eq!(names_in(folder.path()), ["grasps.jsonl"]);
}
