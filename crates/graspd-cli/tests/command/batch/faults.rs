//! Objects, folders and manifests that are not as they should be, and very many objects.

use std::fs;
use std::time::Instant;

use tempfile::tempdir;

use super::{TWO_STARTS, batch, workplace};
use crate::outcome::{graspd, text};
use crate::shared_run::lines;

#[test]
fn broken_objects_are_recorded_and_the_rest_is_made() {
    let head = "objects = [\"meshes/00.obj\", \"meshes/none.obj\", \"meshes/broken.obj\", \"nonesuch\"]\n\
        hands = [\"allegro\"]\nstarts = 1";
    let (folder, manifest) = workplace(1, head);
    fs::write(folder.path().join("meshes/broken.obj"), "f 1 2 3\n").unwrap();
    let dataset = folder.path().join("dataset");
    let report = batch(&manifest, &dataset, &["--json"]).gives_json();
    assert_eq!(
        (&report["runs"], &report["runs_failed"]),
        (&4.into(), &3.into())
    );
    let failures = lines(&dataset.join("failures.jsonl"));
    let told: Vec<(&str, &str)> = (failures.iter())
        .map(|row| (row["run"].as_str().unwrap(), row["error"].as_str().unwrap()))
        .collect();
    assert_eq!(told.len(), 3, "{told:?}");
    for ((run, error), part) in told.iter().zip(["none.obj", "broken.obj", "nonesuch"]) {
        assert!(
            run.contains(part.trim_end_matches(".obj")) && error.contains(part),
            "{run}: {error}"
        );
    }
    let page = fs::read_to_string(dataset.join("report.html")).unwrap();
    assert!(page.contains("Failures") && page.contains("runs without a grasp"));
    // Once mended, they can be made; what was done stays.
    let before = fs::read(dataset.join("runs/00000_00_allegro_0/grasps.jsonl")).unwrap();
    for name in ["none.obj", "broken.obj"] {
        fs::copy(
            folder.path().join("meshes/00.obj"),
            folder.path().join("meshes").join(name),
        )
        .unwrap();
    }
    let again = batch(&manifest, &dataset, &["--json", "--resume"]).gives_json();
    assert_eq!(
        (&again["runs_failed"], &again["starts_made"]),
        (&3.into(), &0.into())
    );
    let again = batch(
        &manifest,
        &dataset,
        &["--json", "--resume", "--retry-failed"],
    )
    .gives_json();
    assert_eq!(
        (&again["runs_failed"], &again["starts_made"]),
        (&1.into(), &2.into())
    );
    assert_eq!(
        before,
        fs::read(dataset.join("runs/00000_00_allegro_0/grasps.jsonl")).unwrap()
    );
    assert_eq!(lines(&dataset.join("failures.jsonl")).len(), 1);
    // Nothing at all is no success.
    let none = folder.path().join("none.toml");
    fs::write(&none, "objects = [\"nonesuch\"]\nhands = [\"allegro\"]\n").unwrap();
    let failed = batch(&none, &folder.path().join("none"), &[]);
    assert_eq!(failed.status, Some(1));
    assert!(
        failed.stderr.contains("none of the 1 runs gave a grasp"),
        "{failed:?}"
    );
}

#[test]
fn folders_that_cannot_be_written_and_bad_manifests() {
    let (folder, manifest) = workplace(1, TWO_STARTS);
    let file = folder.path().join("file");
    fs::write(&file, "content").unwrap();
    batch(&manifest, &file, &[]).fails_at_once(&[text(&file), "cannot be written"]);
    batch(&manifest, &file.join("dataset"), &[]).fails_at_once(&[text(&file), "cannot be written"]);

    let bad = folder.path().join("bad.toml");
    let dataset = folder.path().join("dataset");
    for (content, parts) in [
        ("", &["bad.toml", "objects"][..]),
        ("objects = [\"mug\"]", &["bad.toml", "hands"]),
        ("objects = []\nhands = []", &["`objects` names none"]),
        (
            "object = [\"mug\"]\nhands = [\"allegro\"]",
            &["`object`", "`objects`"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\nstart = 3",
            &["`start`", "`starts`"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\n[setings]\nsteps = 3",
            &["`setings`", "settings"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\n[settings]\nstepz = 3",
            &["settings.stepz", "settings.steps"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\nstarts = 0",
            &["`starts` is 0"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\nstarts = \"many\"",
            &["bad.toml", "invalid type"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\nobject_scale = -1",
            &["object_scale", "positive"],
        ),
        (
            "objects = [\"mug\"\nhands = [\"allegro\"]",
            &["bad.toml, line "],
        ),
        (
            "objects = [\"none/*.obj\"]\nhands = [\"allegro\"]",
            &["`none/*.obj` matches no mesh"],
        ),
        (
            "objects = [\"meshes/[\"]\nhands = [\"allegro\"]",
            &["`meshes/[` is no pattern"],
        ),
        (
            "objects = [\"meshes/*.obj\"]\nexclude = [\"**/*\"]\nhands = [\"allegro\"]",
            &["leaves no object"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"nonesuch.urdf\"]",
            &["nonesuch.urdf"],
        ),
        (
            "objects = [\"mug\"]\nhands = [\"allegro\"]\npreset = \"best\"",
            &["best", "default, fast"],
        ),
    ] {
        fs::write(&bad, content).unwrap();
        batch(&bad, &dataset, &[]).fails_at_once(parts);
    }
    assert!(!dataset.exists(), "a mistake leaves nothing behind");
    batch(&folder.path().join("none.toml"), &dataset, &[])
        .fails_at_once(&["none.toml", "cannot be read"]);
}

#[test]
fn ten_thousand_objects_are_listed_at_once() {
    const OBJECTS: usize = 10_000;
    /// What a person waits without noticing \[s\].
    const MAX_SECONDS: f64 = 1.0;
    let folder = tempdir().unwrap();
    let meshes = folder.path().join("meshes");
    fs::create_dir(&meshes).unwrap();
    for number in 0..OBJECTS {
        fs::write(meshes.join(format!("{number}.stl")), "").unwrap();
    }
    fs::write(meshes.join("notes.txt"), "").unwrap();
    let manifest = folder.path().join("manifest.toml");
    fs::write(
        &manifest,
        "objects = [\"meshes/*\"]\nhands = [\"allegro\"]\n",
    )
    .unwrap();
    let output = folder.path().join("dataset");
    // Other work on the machine may come between: the best of a few.
    let mut least = f64::INFINITY;
    for _ in 0..5 {
        let started = Instant::now();
        let listed = graspd(["batch", text(&manifest), "--list", "-o", text(&output)]);
        least = least.min(started.elapsed().as_secs_f64());
        assert!(
            listed
                .stderr
                .contains("10000 runs of 10 starts: 100000 grasps"),
            "{}",
            listed.stderr
        );
        assert_eq!(listed.succeeds().lines().count(), OBJECTS);
        if least < MAX_SECONDS {
            break;
        }
    }
    assert!(least < MAX_SECONDS, "{least} s");
    let part = graspd([
        "batch",
        text(&manifest),
        "--dry-run",
        "--shard",
        "3/7",
        "-o",
        text(&output),
    ]);
    assert_eq!(
        part.succeeds().lines().count(),
        (2..OBJECTS).step_by(7).count()
    );
    assert!(!output.exists(), "listing makes nothing");
}
