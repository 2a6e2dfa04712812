//! What was cut short, split or met by another process ends in the same bytes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::{TWO_STARTS, batch, workplace};
use crate::outcome::{command, outcome, text};

/// Everything in a dataset but timings and locks.
fn files(dataset: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![dataset.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap();
            if path.is_dir() && name != ".locks" {
                folders.push(path);
            } else if path.is_file() && name != "timings.json" {
                let inner = path.strip_prefix(dataset).unwrap().to_owned();
                found.insert(inner, fs::read(&path).unwrap());
            }
        }
    }
    found
}

fn assert_same(dataset: &Path, reference: &Path) {
    let (found, expected) = (files(dataset), files(reference));
    let names: Vec<_> = found.keys().collect();
    assert_eq!(names, expected.keys().collect::<Vec<_>>());
    for (name, content) in &found {
        assert!(*content == expected[name], "{} differs", name.display());
    }
}

fn start(manifest: &Path, output: &Path, flags: &[&str]) -> Child {
    let arguments = ["batch", text(manifest), "-q", "-o", text(output)];
    let mut command = command([&arguments[..], flags].concat());
    command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Fractions of 1 that differ from run to run no more than they must.
struct Moments(u64);

impl Moments {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Kills a batch at `kills` random moments, resumes it to its end, and compares with an uninterrupted one. Tells how
/// many of the kills met a process that was at work.
fn kill_and_resume(manifest: &Path, folder: &Path, kills: usize) -> usize {
    let (whole, cut) = (folder.join("whole"), folder.join("cut"));
    let started = Instant::now();
    batch(manifest, &whole, &[]).succeeds();
    let seconds = started.elapsed().as_secs_f64();
    let mut moments = Moments(20);
    let mut met = 0;
    for _ in 0..kills {
        let mut child = start(manifest, &cut, &["--resume"]);
        // Together about as long as the uninterrupted run.
        std::thread::sleep(Duration::from_secs_f64(
            2.0 * seconds / kills as f64 * moments.next(),
        ));
        met += usize::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    batch(manifest, &cut, &["--resume"]).succeeds();
    assert_same(&cut, &whole);
    // Once more, with nothing left to do.
    batch(manifest, &cut, &["--resume"]).succeeds();
    assert_same(&cut, &whole);
    met
}

#[test]
fn killed_and_resumed_it_is_the_same_to_the_last_byte() {
    // GRASPD_KILL_TEST=full: 20 objects, 4 starts of the quick preset, 20 kills; minutes.
    let is_full = std::env::var("GRASPD_KILL_TEST").is_ok_and(|size| size == "full");
    if !is_full {
        let (folder, manifest) = workplace(3, TWO_STARTS);
        let met = kill_and_resume(&manifest, folder.path(), 4);
        assert!(met >= 2, "only {met} kills met a process");
        return;
    }
    let (folder, manifest) = workplace(20, "");
    let head = "objects = [\"meshes/*.obj\"]\nhands = [\"allegro\"]\nstarts = 4\npreset = \"fast\"\n\
        sdf_resolution = 48\n[evaluation]\nmetrics = \"ca,iv,pd,gws,sd\"\n";
    fs::write(&manifest, head).unwrap();
    let started = Instant::now();
    let met = kill_and_resume(&manifest, folder.path(), 20);
    println!(
        "{met} of 20 kills met a process at work; {:.0} s in all",
        started.elapsed().as_secs_f64()
    );
    assert!(met >= 15, "only {met} kills met a process");
    let dataset = fs::read_to_string(folder.path().join("cut/dataset.json")).unwrap();
    assert_eq!(
        serde_json::from_str::<Value>(&dataset).unwrap()["grasps"],
        80
    );
}

#[test]
fn shards_make_the_same_dataset_together() {
    let (folder, manifest) = workplace(3, TWO_STARTS);
    let (whole, parts) = (folder.path().join("whole"), folder.path().join("parts"));
    batch(&manifest, &whole, &["--threads", "1"]).succeeds();
    let children: Vec<Child> = ["1/2", "2/2"]
        .map(|shard| start(&manifest, &parts, &["--shard", shard]))
        .into();
    for mut child in children {
        assert!(child.wait().unwrap().success());
    }
    assert_same(&parts, &whole);
    batch(&manifest, &parts, &["--shard", "0/2"]).fails_as_wrong_usage("count from 1");
    batch(&manifest, &parts, &["--shard", "3/2"]).fails_as_wrong_usage("I from 1 to N");
}

#[test]
fn the_scripts_of_clusters_run_their_shards() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let slurm = fs::read_to_string(examples.join("slurm_array.sh")).unwrap();
    let kubernetes = fs::read_to_string(examples.join("kubernetes_indexed_job.yaml")).unwrap();
    // The block of the container's command, less its indentation.
    let block = kubernetes.split("- |\n").nth(1).unwrap();
    let indent = block.len() - block.trim_start().len();
    let block: Vec<&str> = block
        .lines()
        .take_while(|line| line.len() > indent && line.starts_with(&" ".repeat(indent)))
        .collect();
    let kubernetes: String = block
        .iter()
        .map(|line| format!("{}\n", &line[indent..]))
        .collect();

    let (folder, manifest) = workplace(2, TWO_STARTS);
    let whole = folder.path().join("whole");
    batch(&manifest, &whole, &[]).succeeds();
    let programs = Path::new(env!("CARGO_BIN_EXE_graspd")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    for (script, shard, count, first) in [
        (slurm, "SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", 1),
        (kubernetes, "JOB_COMPLETION_INDEX", "SHARDS", 0),
    ] {
        let dataset = folder.path().join(shard);
        for index in first..first + 2 {
            let output = std::process::Command::new("bash")
                .args(["-c", &script])
                .current_dir(folder.path())
                .envs([
                    ("PATH", path.as_str()),
                    (count, "2"),
                    ("MANIFEST", text(&manifest)),
                    ("DATASET", text(&dataset)),
                ])
                .env("GRASPD_CACHE_DIR", folder.path().join("cache"))
                .env(shard, index.to_string())
                .env("SLURM_ARRAY_TASK_MIN", "1")
                .output()
                .unwrap();
            outcome(output).succeeds();
        }
        assert_same(&dataset, &whole);
    }
}

#[test]
fn a_second_process_is_refused_and_a_dead_one_is_no_obstacle() {
    let (folder, manifest) = workplace(4, &TWO_STARTS.replace("starts = 2", "starts = 40"));
    let dataset = folder.path().join("dataset");
    let mut first = start(&manifest, &dataset, &["--threads", "1"]);
    let is_at_work =
        || fs::read_dir(dataset.join("runs")).is_ok_and(|mut runs| runs.next().is_some());
    let waiting = Instant::now();
    while !is_at_work() {
        assert!(waiting.elapsed() < Duration::from_secs(60) && first.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(10));
    }
    let refused = [
        "another process works on it",
        "choose another folder with -o",
    ];
    batch(&manifest, &dataset, &["--resume"]).fails_at_once(&refused);
    batch(&manifest, &dataset, &["--resume", "--shard", "1/2"]).fails_at_once(&["another --shard"]);
    first.kill().unwrap();
    first.wait().unwrap();
    // What it left is not overwritten by mistake, nor mixed with another batch's.
    batch(&manifest, &dataset, &[]).fails_at_once(&["a batch has been begun", "--resume"]);
    let other = folder.path().join("other.toml");
    fs::write(
        &other,
        fs::read_to_string(&manifest)
            .unwrap()
            .replace("steps = 30", "steps = 31"),
    )
    .unwrap();
    let differs = ["batch.toml", "`settings.", "choose another folder"];
    batch(&other, &dataset, &["--resume"]).fails_at_once(&differs);
    fs::write(
        &other,
        fs::read_to_string(&manifest)
            .unwrap()
            .replace("starts = 40", "starts = 1"),
    )
    .unwrap();
    batch(&other, &folder.path().join("new"), &["--resume"]).succeeds();
    batch(&other, &dataset, &["--resume"]).fails_at_once(&["`grasps` differs"]);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_told_and_costs_nothing() {
    let (folder, manifest) = workplace(2, TWO_STARTS);
    let (whole, full) = (folder.path().join("whole"), folder.path().join("full"));
    batch(&manifest, &whole, &["--no-report"]).succeeds();
    // Files of 4 KiB at most: a journal holds one start, and half of the next.
    let script = format!(
        "trap '' XFSZ; ulimit -f 4; exec '{}' batch '{}' -q --no-report --no-cache --threads 1 -o '{}'",
        env!("CARGO_BIN_EXE_graspd"),
        manifest.display(),
        full.display()
    );
    let output = std::process::Command::new("bash")
        .args(["-c", &script])
        .output()
        .unwrap();
    outcome(output).fails(&["cannot be written", "not full"]);
    batch(&manifest, &full, &["--resume", "--no-report"]).succeeds();
    assert_same(&full, &whole);
}
