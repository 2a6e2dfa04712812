//! `graspd batch`: datasets that survive kills, full disks and broken objects.

mod faults;
mod interruptions;

use std::fs;
use std::path::{Path, PathBuf};

use graspd_mesh::{builtin_object, save_obj};
use serde_json::Value;
use tempfile::{TempDir, tempdir};

use crate::outcome::{graspd, text};
use crate::shared_run::lines;

/// Starts that take milliseconds; a report has no pictures without displacements and depths.
const QUICK: &str = "preset = \"paper\"\nsdf_resolution = 24\n[settings]\nsteps = 30\n[evaluation]\n\
    metrics = \"ca\"\n";

/// A folder with meshes `meshes/NN.obj`, each a little different, and a manifest of them.
fn workplace(objects: usize, head: &str) -> (TempDir, PathBuf) {
    let folder = tempdir().unwrap();
    let meshes = folder.path().join("meshes");
    fs::create_dir(&meshes).unwrap();
    let mesh = builtin_object("box").unwrap();
    for number in 0..objects {
        let mesh = mesh.scaled(1.0 - 0.01 * number as f64);
        save_obj(&mesh, meshes.join(format!("{number:02}.obj"))).unwrap();
    }
    let manifest = folder.path().join("manifest.toml");
    fs::write(&manifest, format!("{head}\n{QUICK}")).unwrap();
    (folder, manifest)
}

const TWO_STARTS: &str = "objects = [\"meshes/*.obj\"]\nhands = [\"allegro\"]\nstarts = 2";

fn batch(manifest: &Path, output: &Path, flags: &[&str]) -> crate::outcome::Outcome {
    let arguments = ["batch", text(manifest), "-q", "-o", text(output)];
    graspd([&arguments[..], flags].concat())
}

#[test]
fn a_dataset_is_described_and_its_runs_are_runs() {
    let head = "objects = [\"meshes/*.obj\", \"can\"]\nexclude = [\"meshes/01.obj\"]\n\
        hands = [\"allegro\", \"barrett\"]\nstarts = 2\nseeds = [4, 5]\ntop_k = 1";
    let (folder, manifest) = workplace(2, head);
    let text_of = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text_of.replace("\"ca\"", "\"ca,pd,sd\"")).unwrap();
    let dataset = folder.path().join("dataset");
    let report = batch(&manifest, &dataset, &["--json"]).gives_json();
    assert_eq!(
        (&report["runs"], &report["starts_made"]),
        (&8.into(), &16.into())
    );
    let summary = &report["dataset"];
    assert_eq!(
        (&summary["objects"], &summary["grasps"]),
        (&2.into(), &8.into())
    );
    assert_eq!(summary["by_hand"]["barrett"]["grasps"], 4);
    assert!(summary["holding_share"].as_f64().is_some());
    let rows = lines(&dataset.join("runs.jsonl"));
    assert_eq!(rows.len(), 8);
    for row in &rows {
        let run = dataset.join("runs").join(row["run"].as_str().unwrap());
        let records = lines(&run.join("grasps.jsonl"));
        assert_eq!((records.len(), &records[0]["seconds"]), (1, &Value::Null));
        assert_eq!(
            (&records[0]["rank"], &records[0]["seed"]),
            (&1.into(), &row["seed"])
        );
        let timings: Value =
            serde_json::from_slice(&fs::read(run.join("timings.json")).unwrap()).unwrap();
        assert_eq!(timings["grasps"].as_object().unwrap().len(), 2);
        assert!(!run.join("journal.jsonl").exists());
    }
    // A run is what `graspd synth` would have made, timings apart.
    let run = dataset.join("runs").join("00001_can_barrett_5");
    let alone = folder.path().join("alone");
    let flags = [
        "--hand", "barrett", "-n", "2", "--seed", "5", "--preset", "paper", "--steps", "30",
    ];
    let more = [
        "--resolution",
        "24",
        "--top-k",
        "1",
        "--set",
        "evaluation.metrics=ca,pd,sd",
        "-q",
        "-o",
        text(&alone),
    ];
    graspd([&["synth", "can"][..], &flags, &more].concat()).succeeds();
    let bare = |file: &Path| {
        let mut records = lines(file);
        for record in &mut records {
            record["seconds"] = Value::Null;
        }
        records
    };
    assert_eq!(
        bare(&run.join("grasps.jsonl")),
        bare(&alone.join("grasps.jsonl"))
    );
    let table = graspd(["eval", text(&run), "--metrics", "ca", "-q"]).succeeds();
    assert!(table.contains("#"), "{table}");

    let page = fs::read_to_string(dataset.join("report.html")).unwrap();
    for part in [
        "<svg",
        "data:image/png;base64,",
        "00001_can_barrett_5",
        "of grasps hold",
        "median",
    ] {
        assert!(page.contains(part), "no {part}");
    }
    assert!(!page.contains("http"), "it loads nothing from elsewhere");
}
