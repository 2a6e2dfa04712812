//! `graspd eval` of other projects' files, and by other projects' engines.

use std::fs;

use serde_json::{Value, json};
use tempfile::tempdir;

use crate::judging::{bare, line};
use crate::outcome::{graspd, text};

/// Three grasps of the Allegro hand as `numpy.save` wrote them: two with the object at its size, one with it halved.
const GRASPS: &str = "tests/data/dexgraspnet_allegro.npy";
const FLAGS: [&str; 6] = ["--hand", "allegro", "--object", "mug", "--metrics", "ca,iv"];

fn judged(file: &str, more: &[&str]) -> Value {
    let arguments = [&["eval", file, "--json", "-q"], &FLAGS[..], more].concat();
    graspd(arguments).gives_json()
}

#[test]
fn grasps_of_dexgraspnet() {
    let folder = tempdir().unwrap();
    let output = folder.path().join("judged.jsonl");
    let report = judged(GRASPS, &["-o", text(&output)]);
    let grasps = report["grasps"].as_array().unwrap();
    assert_eq!(grasps.len(), 3);
    let number = |grasp: &Value, name: &str| grasp["metrics"][name].as_f64().unwrap();
    assert!(number(&grasps[0], "contact_area_cm2") > 1.0);
    assert_eq!(number(&grasps[1], "contact_area_cm2"), 0.0);
    let scales: Vec<_> = grasps.iter().map(|g| g["object_scale"].as_f64()).collect();
    assert_eq!(scales, [Some(1.0), Some(1.0), Some(0.5)]);
    assert_eq!(grasps[0]["joints_rad"]["joint_12.0"], 0.3);

    // The same grasps as our own records: the rotation is about the fixed axes x, y, z in turn.
    let mut joints = bare()["joints_rad"].clone();
    for (name, value) in joints.as_object_mut().unwrap() {
        *value = grasps[0]["joints_rad"][name].clone();
    }
    let half = |angle: f64| (0.5 * angle).sin_cos();
    let ((sx, cx), (sy, cy), (sz, cz)) = (half(0.3), half(-0.7), half(1.1));
    let turned = [
        cx * cy * cz + sx * sy * sz,
        sx * cy * cz - cx * sy * sz,
        cx * sy * cz + sx * cy * sz,
        cx * cy * sz - sx * sy * cz,
    ];
    for (found, expected) in (grasps[1]["pose"]["rotation_wxyz"].as_array().unwrap())
        .iter()
        .zip(turned)
    {
        assert!((found.as_f64().unwrap() - expected).abs() < 1e-12);
    }
    let file = folder.path().join("own.jsonl");
    let own = |scale: f64| {
        line(&[
            ("joints_rad", joints.clone()),
            ("object_scale", json!(scale)),
        ])
    };
    fs::write(&file, format!("{}\n{}\n", own(1.0), own(0.5))).unwrap();
    let own = judged(text(&file), &[]);
    // Each against the object of its own scale.
    assert_eq!(own["grasps"][0]["metrics"], grasps[0]["metrics"]);
    assert_eq!(own["grasps"][1]["metrics"], grasps[2]["metrics"]);
    assert_ne!(grasps[0]["metrics"], grasps[2]["metrics"]);
    // What was written is a file of records like any other.
    let again = judged(text(&output), &[]);
    assert_eq!(again["grasps"][0]["metrics"], grasps[0]["metrics"]);
}

#[test]
fn files_that_are_none_of_dexgraspnets() {
    let folder = tempdir().unwrap();
    let refused = |bytes: &[u8], parts: &[&str]| {
        let file = folder.path().join("grasps.npy");
        fs::write(&file, bytes).unwrap();
        let name = text(&file);
        let eval = graspd([&["eval", name], &FLAGS[..]].concat());
        eval.fails_at_once(&[&[name], parts].concat());
    };
    refused(b"", &["no .npy array"]);
    let whole = fs::read(GRASPS).unwrap();
    refused(&whole[..whole.len() / 2], &["damaged"]);
    // The same length, so that only the name changes.
    let renamed = |from: &str, to: &str| {
        let at = (whole.windows(from.len())).position(|part| part == from.as_bytes());
        let at = at.unwrap();
        [&whole[..at], to.as_bytes(), &whole[at + from.len()..]].concat()
    };
    refused(
        &renamed("qpos", "qqqq"),
        &["grasp 0", "`qpos`", "DexGraspNet"],
    );
    refused(&renamed("WRJTy", "WRJTq"), &["grasp 0", "`WRJTy`"]);
    refused(
        &renamed("joint_7.0", "joint_x.0"),
        &["grasp 0", "lacks the joint `joint_7.0`"],
    );
    refused(
        &renamed("_reconstruct", "_unconstruct"),
        &["_unconstruct`: refused, and nothing was run"],
    );
    let eval = graspd(["eval", GRASPS, "--object", "mug"]);
    eval.fails_at_once(&["does not tell its hand", "--hand"]);
    let eval = graspd(["eval", GRASPS, "--hand", "allegro"]);
    eval.fails_at_once(&["does not tell its object's mesh", "--object"]);
}

#[test]
fn engines_that_are_not_installed_say_how_to_install_them() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("mine.jsonl");
    fs::write(&file, line(&[])).unwrap();
    let eval = |engine: &str, python: &str| {
        graspd(["eval", text(&file), "--engine", engine, "--python", python])
    };
    eval("pybullet", "no-such-python").fails_at_once(&[
        "no-such-python",
        "cannot be started",
        "--python",
    ]);
    // An interpreter without any package, which is all that Python itself is.
    let bare = folder.path().join("python");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let words =
            "#!/bin/sh\necho \"ModuleNotFoundError: No module named 'mujoco'\" >&2\nexit 1\n";
        fs::write(&bare, words).unwrap();
        fs::set_permissions(&bare, fs::Permissions::from_mode(0o755)).unwrap();
        eval("mujoco", text(&bare)).fails_at_once(&[
            "cannot import mujoco",
            "No module named 'mujoco'",
            "-m pip install numpy mujoco",
            "cargo xtask engines",
        ]);
    }
    for engine in ["graspd", "rapier"] {
        eval(engine, "python3").fails_at_once(&["--python is for engines outside"]);
    }
}
