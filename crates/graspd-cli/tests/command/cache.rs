//! What is kept between runs changes no result, however damaged it is, and no run fails for want of it.

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::tempdir;

use crate::outcome::{command, graspd, outcome, text};
use crate::shared_run::lines;

fn synth(output: &Path, cache: &[&str]) -> Vec<String> {
    let mut arguments = vec![
        "synth",
        "box",
        "-n",
        "2",
        "--steps",
        "40",
        "--resolution",
        "40",
    ];
    arguments.extend(["-o", text(output)]);
    arguments.extend(cache);
    let run = graspd(arguments);
    assert_eq!(run.status, Some(0), "{run:?}");
    assert!(!run.stderr.contains("warning"), "{run:?}");
    records(output)
}

/// The records as they are written, but for the seconds.
fn records(output: &Path) -> Vec<String> {
    let without_times = |mut record: Value| {
        record.as_object_mut().unwrap().remove("seconds").unwrap();
        record.to_string()
    };
    let records = lines(&output.join("grasps.jsonl"));
    records.into_iter().map(without_times).collect()
}

fn entries(cache: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(cache).unwrap();
    let mut entries: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    entries
}

#[test]
fn grasps_are_the_same_without_with_and_with_a_damaged_cache() {
    let folder = tempdir().unwrap();
    let cache = folder.path().join("cache");
    let with = ["--cache-dir", text(&cache)];
    let output = |name| folder.path().join(name);
    let without = synth(&output("none"), &["--no-cache"]);
    assert_eq!(without.len(), 2);
    assert!(!cache.exists());
    assert_eq!(synth(&output("cold"), &with), without);
    // The distance grid and the judge's decomposition.
    assert_eq!(entries(&cache).len(), 2);
    let stored: Vec<_> = entries(&cache)
        .iter()
        .map(|path| fs::read(path).unwrap())
        .collect();
    assert_eq!(synth(&output("warm"), &with), without);
    for entry in entries(&cache) {
        let bytes = fs::read(&entry).unwrap();
        let mut damaged = bytes.clone();
        damaged[bytes.len() / 2] ^= 0x10;
        fs::write(&entry, damaged).unwrap();
    }
    assert_eq!(synth(&output("damaged"), &with), without);
    for (entry, bytes) in entries(&cache).iter().zip(&stored) {
        fs::write(entry, &bytes[..bytes.len() / 3]).unwrap();
    }
    assert_eq!(synth(&output("cut"), &with), without);
    // Mended by the last run.
    let mended: Vec<_> = entries(&cache)
        .iter()
        .map(|path| fs::read(path).unwrap())
        .collect();
    assert!(mended == stored);
}

#[test]
fn a_cache_that_cannot_be_written_is_a_warning() {
    let folder = tempdir().unwrap();
    let blocked = folder.path().join("file");
    fs::write(&blocked, "").unwrap();
    let output = folder.path().join("out.npz");
    let arguments = ["sdf", "box", "--resolution", "12", "-o", text(&output)];
    let run = graspd(arguments.into_iter().chain(["--cache-dir", text(&blocked)]));
    assert!(
        run.stderr.contains("warning: the cache is of no use: "),
        "{run:?}"
    );
    assert!(run.stderr.contains(text(&blocked)), "{run:?}");
    run.succeeds();
    let written = fs::read(&output).unwrap();
    graspd(arguments.into_iter().chain(["--no-cache"])).succeeds();
    assert!(fs::read(&output).unwrap() == written);
}

/// Where files may not grow beyond 100 KiB, as on a disk that fills up.
#[test]
#[cfg(unix)]
fn a_full_disk_is_a_warning() {
    let folder = tempdir().unwrap();
    let (cache, output) = (folder.path().join("cache"), folder.path().join("out"));
    let run = command([
        "synth",
        "box",
        "-n",
        "1",
        "--steps",
        "5",
        "--resolution",
        "40",
    ]);
    let mut limited = std::process::Command::new("sh");
    limited
        .args(["-c", "trap '' XFSZ; ulimit -f 200; exec \"$0\" \"$@\""])
        .arg(run.get_program())
        .args(run.get_args())
        .args(["-o", text(&output), "--cache-dir", text(&cache)]);
    let run = outcome(limited.output().unwrap());
    assert!(
        run.stderr.contains("warning: the cache is of no use: "),
        "{run:?}"
    );
    assert_eq!(run.status, Some(0), "{run:?}");
    assert_eq!(records(&output).len(), 1);
    // Nothing half written is left; the decomposition is small enough.
    assert_eq!(entries(&cache).len(), 1);
}

#[test]
fn the_cache_can_be_looked_at_and_cleared() {
    let folder = tempdir().unwrap();
    let cache = folder.path().join("cache");
    let run = |flags: &[&str]| {
        let mut command = command([&["cache", "--json"], flags].concat());
        command.env("GRASPD_CACHE_DIR", &cache);
        outcome(command.output().unwrap()).gives_json()
    };
    assert_eq!(run(&[])["files"], 0);
    let output = folder.path().join("out.npz");
    let flags = [
        "--resolution",
        "12",
        "-o",
        text(&output),
        "--cache-dir",
        text(&cache),
    ];
    graspd(["sdf", "box"].into_iter().chain(flags)).succeeds();
    let told = run(&[]);
    assert_eq!(
        (&told["files"], &told["cleared"]),
        (&1.into(), &false.into())
    );
    assert_eq!(told["folder"], text(&cache));
    assert!(told["bytes"].as_u64().unwrap() > 4 * 12 * 12 * 12);
    assert_eq!(run(&["--clear"])["files"], 1);
    assert_eq!(run(&[])["files"], 0);
    let stdout = graspd(["cache", "--cache-dir", text(&cache)]).succeeds();
    assert!(stdout.contains("0 files, 0.0 MiB"), "{stdout}");
}

#[test]
fn a_band_that_is_no_length_is_refused() {
    for band in ["-0.01", "nan", "inf"] {
        graspd(["sdf", "box", "--band", band]).fails_at_once(&["`--band` is", "at least 0"]);
    }
}
