//! `graspd eval`: anyone's grasps.

use std::fs;

use graspd_mesh::{builtin_object, save_obj};
use serde_json::{Value, json};
use tempfile::tempdir;

use crate::outcome::{graspd, text};
use crate::shared_run::RUN;

/// All that a record needs: the Allegro, open, with its palm in the middle of the mug.
pub(crate) fn bare() -> Value {
    let hand = graspd_hand::load_hand("allegro").unwrap();
    let joints = hand
        .articulation_names()
        .iter()
        .zip(hand.open_articulation());
    json!({
        "object": "mug",
        "hand": "allegro",
        "pose": {"translation_m": [0, 0.01, 0], "rotation_wxyz": [2, 0, 0, 0]},
        "joints_rad": joints.map(|(name, &value)| (name.clone(), value.into())).collect::<serde_json::Map<_, Value>>(),
    })
}

/// A record with some fields replaced, in one line.
pub(crate) fn line(fields: &[(&str, Value)]) -> String {
    let mut record = bare();
    for (name, value) in fields {
        record[name] = value.clone();
    }
    record.to_string()
}

fn without_seconds(grasps: &Value) -> Vec<Value> {
    let mut grasps = grasps.as_array().unwrap().clone();
    for grasp in &mut grasps {
        grasp.as_object_mut().unwrap().remove("seconds");
    }
    grasps
}

#[test]
fn judging_a_run_again_gives_the_same_metrics() {
    let (folder, made) = &*RUN;
    let made: Value = serde_json::from_str(&made.stdout).unwrap();
    let folder_given = graspd(["eval", text(folder), "--json", "--quiet"]);
    assert_eq!(folder_given.stderr, "");
    let judged = folder_given.gives_json();
    assert_eq!(
        without_seconds(&judged["grasps"]),
        without_seconds(&made["grasps"])
    );
    for part in ["top_2", "top_5", "all", "median"] {
        assert_eq!(judged["summary"][part], made["summary"][part]);
    }
}

#[test]
fn a_bare_record_is_enough() {
    let folder = tempdir().unwrap();
    let (file, output) = (
        folder.path().join("mine.jsonl"),
        folder.path().join("judged.jsonl"),
    );
    let unknown = line(&[
        ("made_by", json!("hand")),
        ("index", Value::Null),
        ("metrics", Value::Null),
    ]);
    // Far off: touches nothing, falls freely.
    let far = line(&[(
        "pose",
        json!({"translation_m": [2, 0, 0], "rotation_wxyz": [1, 0, 0, 0]}),
    )]);
    fs::write(&file, format!("{far}\n{unknown}\n")).unwrap();
    let table = graspd(["eval", text(&file), "-o", text(&output), "-q"]).succeeds();
    assert!(
        table.contains("#0") && table.contains("#1") && table.contains("CA cm2"),
        "{table}"
    );

    let records = graspd::read_records(&output).unwrap();
    assert_eq!((records[0].rank, records[1].rank), (Some(1), Some(2)));
    let by_index = |index| records.iter().find(|record| record.index == index).unwrap();
    let metrics = by_index(1).metrics.as_ref().unwrap();
    assert!(
        metrics.contact_area_cm2 > Some(1.0) && metrics.interpenetration_volume_cm3 > Some(1.0)
    );
    assert!(metrics.max_penetration_mm > Some(1.0) && metrics.contacts > Some(10));
    let metrics = by_index(0).metrics.as_ref().unwrap();
    assert_eq!(
        (metrics.contact_area_cm2, metrics.ca_over_iv),
        (Some(0.0), None)
    );
    assert_eq!(metrics.epsilon, Some(0.0));
    // Free fall during the protocol's 35 steps of 1/240 s.
    assert!((metrics.sim_displacement_cm.unwrap() - 10.4).abs() < 0.3);
    assert!(!fs::read_to_string(&output).unwrap().contains("-0.0,"));
}

#[test]
fn metrics_not_asked_for_are_null() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("mine.jsonl");
    fs::write(&file, line(&[("rank", json!(4))])).unwrap();
    let judged = graspd(["eval", text(&file), "--metrics", "ca,iv", "--json"]).gives_json();
    let grasp = &judged["grasps"][0];
    let metrics = grasp["metrics"].as_object().unwrap();
    for (name, value) in metrics {
        let asked = [
            "contact_area_cm2",
            "contact_area_voxel_count_cm2",
            "interpenetration_volume_cm3",
            "ca_over_iv",
        ]
        .contains(&name.as_str());
        assert_eq!(value.is_number(), asked, "{name}: {value}");
    }
    assert_eq!(metrics.len(), 17);
    // No displacement, no new ranks.
    assert_eq!(grasp["rank"], 4);
    assert!(judged["summary"]["all"]["sim_displacement_cm"].is_null());
}

#[test]
fn object_and_scale_can_be_set() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("mine.jsonl");
    fs::write(&file, line(&[("object", json!("an unknown mug"))])).unwrap();
    let mesh = folder.path().join("mug_mm.obj");
    save_obj(&builtin_object("mug").unwrap().scaled(1000.0), &mesh).unwrap();
    let judge = |flags: &[&str]| {
        let arguments = [
            &["eval", text(&file), "--json", "-q", "--metrics", "ca,iv"],
            flags,
        ]
        .concat();
        graspd(arguments).gives_json()["grasps"][0].clone()
    };
    let of_file = judge(&["--object", text(&mesh), "--scale", "0.001"]);
    let of_name = judge(&["--object", "mug"]);
    assert_eq!(
        (&of_file["object"], &of_file["object_path"]),
        (&"mug_mm".into(), &text(&mesh).into())
    );
    assert_eq!(
        (&of_name["object"], &of_name["object_path"]),
        (&"mug".into(), &Value::Null)
    );
    let area = |grasp: &Value| grasp["metrics"]["contact_area_cm2"].as_f64().unwrap();
    // Scaling there and back rounds.
    assert!(
        area(&of_file) > 1.0 && (area(&of_file) - area(&of_name)).abs() < 0.01 * area(&of_name)
    );
}

#[test]
fn joints_that_look_wrong_draw_a_warning() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("degrees.jsonl");
    let mut joints = bare()["joints_rad"].clone();
    joints["joint_1.0"] = json!(45.0);
    joints["elbow"] = json!(0.0);
    let record = line(&[("joints_rad", joints)]);
    fs::write(&file, format!("{record}\n{record}\n")).unwrap();
    let judged = graspd(["eval", text(&file), "--metrics", "ca"]);
    let warnings: Vec<&str> = judged
        .stderr
        .lines()
        .filter(|l| l.starts_with("warning: "))
        .collect();
    assert_eq!(warnings.len(), 2, "{judged:?}");
    assert!(warnings[0].contains("no joint `elbow`"), "{judged:?}");
    assert!(
        warnings[1].contains("`joint_1.0` is 45") && warnings[1].contains("radians"),
        "{judged:?}"
    );
    judged.succeeds();
}

#[test]
fn a_run_of_a_urdf_hand_finds_its_hand_again() {
    let Some(urdf) = graspd_geom::shared_file("data/hands/leap_hand/leap_hand_right.urdf") else {
        return;
    };
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    let synth = [
        "synth",
        "box",
        "--hand",
        text(&urdf),
        "-n",
        "1",
        "--steps",
        "30",
        "--resolution",
        "24",
        "--json",
    ];
    let made = graspd([&synth[..], &["-o", text(&run)]].concat()).gives_json();
    let judged = graspd(["eval", text(&run), "--json"]).gives_json();
    assert_eq!(judged["grasps"][0]["metrics"], made["grasps"][0]["metrics"]);
    // Another hand's grasps in the same folder are not taken for this one's.
    fs::write(run.join("others.jsonl"), line(&[])).unwrap();
    let others = graspd([
        "eval",
        text(&run.join("others.jsonl")),
        "--metrics",
        "ca",
        "--json",
    ])
    .gives_json();
    assert_eq!(others["grasps"][0]["hand"], "allegro");
}

#[test]
fn either_built_in_engine_judges_and_is_named() {
    let folder = &RUN.0;
    let engine = |arguments: &[&str]| {
        let common = ["eval", text(folder), "--metrics", "sd", "--json", "-q"];
        let judged = graspd(common.iter().chain(arguments).copied()).gives_json();
        let metrics = judged["grasps"][0]["metrics"].clone();
        assert!(metrics["sim_displacement_cm"].as_f64().is_some());
        metrics["sim_engine"]
            .as_str()
            .unwrap_or_default()
            .to_owned()
    };
    assert_eq!(engine(&[]), "graspd 1");
    assert!(engine(&["--engine", "rapier"]).starts_with("rapier 0."));
    assert!(engine(&["--set", "evaluation.engine=\"rapier\""]).starts_with("rapier 0."));
    assert_eq!(
        engine(&[
            "--set",
            "evaluation.engine=\"rapier\"",
            "--engine",
            "graspd"
        ]),
        "graspd 1"
    );
}
