//! What `graspd synth` prints and leaves in its folder: records, description, summary.

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;

use crate::outcome::text;
use crate::shared_run::{GRASPS, RUN, lines};

fn keys(value: &Value) -> Vec<&str> {
    value
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect()
}

#[test]
fn records_have_every_field() {
    let records = lines(&RUN.0.join("grasps.jsonl"));
    assert_eq!(records.len(), GRASPS);
    let sorted = |names: &[&'static str]| BTreeSet::from_iter(names.iter().copied());
    let fields = sorted(&[
        "schema",
        "object",
        "object_path",
        "object_scale",
        "object_repair",
        "hand",
        "seed",
        "index",
        "pose",
        "joints_rad",
        "mano",
        "pre_grasp",
        "squeeze",
        "metrics",
        "optimizer",
        "rank",
        "seconds",
    ]);
    let metrics = sorted(&[
        "contact_area_cm2",
        "interpenetration_volume_cm3",
        "ca_over_iv",
        "epsilon",
        "gws_volume",
        "sim_displacement_cm",
        "max_penetration_mm",
    ]);
    let optimizer = sorted(&[
        "preset",
        "steps",
        "l_phys",
        "l_task",
        "l_range",
        "l_limit",
        "l_inter",
        "task_satisfied",
    ]);
    let mut indices = BTreeSet::new();
    for (place, record) in records.iter().enumerate() {
        assert_eq!(BTreeSet::from_iter(keys(record)), fields);
        assert_eq!(record["schema"], "graspd.grasp/1");
        assert_eq!(
            (&record["object"], &record["hand"]),
            (&"box".into(), &"allegro".into())
        );
        assert_eq!(
            (record["object_scale"].as_f64(), record["seed"].as_u64()),
            (Some(1.0), Some(3))
        );
        // Absent parts are null, not omitted.
        assert!(record["object_path"].is_null() && record["mano"].is_null());
        assert_eq!(record["rank"], place + 1);
        indices.insert(record["index"].as_u64().unwrap());
        assert!(metrics.is_subset(&BTreeSet::from_iter(keys(&record["metrics"]))));
        assert_eq!(BTreeSet::from_iter(keys(&record["optimizer"])), optimizer);
        assert_eq!(record["optimizer"]["preset"], "paper");
        assert_eq!(record["optimizer"]["steps"], 60);
        assert_eq!(keys(&record["seconds"]), ["evaluation", "synthesis"]);
        for pose in [&record["pose"], &record["pre_grasp"]["pose"]] {
            assert_eq!(pose["translation_m"].as_array().unwrap().len(), 3);
            let rotation = pose["rotation_wxyz"].as_array().unwrap();
            let norm: f64 = rotation.iter().map(|q| q.as_f64().unwrap().powi(2)).sum();
            assert!(rotation.len() == 4 && (norm - 1.0).abs() < 1e-9);
        }
        for joints in [
            &record["joints_rad"],
            &record["pre_grasp"]["joints_rad"],
            &record["squeeze"]["joints_rad"],
            &record["squeeze"]["torques_nm"],
        ] {
            assert_eq!(joints.as_object().unwrap().len(), 16);
        }
    }
    assert_eq!(indices, (0..GRASPS as u64).collect());
    let displacement: Vec<f64> = records
        .iter()
        .map(|record| record["metrics"]["sim_displacement_cm"].as_f64().unwrap())
        .collect();
    assert!(displacement.is_sorted(), "{displacement:?}");
}

#[test]
fn the_run_is_described() {
    let text = fs::read_to_string(RUN.0.join("run.toml")).unwrap();
    let run: toml::Table = text.parse().unwrap();
    let string = |name: &str| run[name].as_str().unwrap();
    let integer = |name: &str| run[name].as_integer().unwrap();
    assert_eq!((string("object"), string("hand")), ("box", "allegro"));
    assert_eq!(string("graspd_version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(
        (
            integer("seed"),
            integer("grasps"),
            integer("sdf_resolution")
        ),
        (3, 6, 48)
    );
    assert!(run["machine"]["threads"].as_integer().unwrap() >= 1);
    // The settings are those that the library understands.
    let settings: graspd::SynthesisSettings = run["settings"].clone().try_into().unwrap();
    assert_eq!(settings, graspd::SynthesisSettings::paper().with_steps(60));
    let evaluation: graspd_eval::EvaluationSettings = run["evaluation"].clone().try_into().unwrap();
    assert_eq!(evaluation, graspd_eval::EvaluationSettings::default());
}

#[test]
fn the_summary_has_means_and_medians() {
    const ROUNDING: f64 = 1e-12;
    let text = fs::read_to_string(RUN.0.join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    let records = lines(&RUN.0.join("grasps.jsonl"));
    for metric in [
        "sim_displacement_cm",
        "contact_area_cm2",
        "epsilon",
        "max_penetration_mm",
    ] {
        let mut values: Vec<f64> = records
            .iter()
            .map(|r| r["metrics"][metric].as_f64().unwrap())
            .collect();
        for (name, count) in [("top_2", 2), ("top_5", 5), ("all", GRASPS)] {
            let mean = values[..count].iter().sum::<f64>() / count as f64;
            let found = summary[name][metric].as_f64().unwrap();
            assert!(
                (found - mean).abs() <= ROUNDING * mean.abs(),
                "{name} {metric} {found} {mean}"
            );
            assert_eq!(summary[name]["grasps"], count);
        }
        values.sort_by(f64::total_cmp);
        let median = 0.5 * (values[2] + values[3]);
        let found = summary["median"][metric].as_f64().unwrap();
        assert!(
            (found - median).abs() <= ROUNDING * median.abs(),
            "{metric} {found} {median}"
        );
    }
    for name in ["mean_synthesis_seconds", "mean_evaluation_seconds"] {
        assert!(summary[name].as_f64().unwrap() > 0.0);
    }
}

#[test]
fn json_is_all_that_stdout_gets() {
    let (folder, outcome) = &*RUN;
    let printed: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(
        printed["grasps"].as_array().unwrap(),
        &lines(&folder.join("grasps.jsonl"))
    );
    let summary = fs::read_to_string(folder.join("summary.json")).unwrap();
    assert_eq!(
        printed["summary"],
        serde_json::from_str::<Value>(&summary).unwrap()
    );
    assert_eq!(printed["output"], text(folder));
    // Without a terminal, progress is plain lines on stderr.
    assert!(
        outcome.stderr.contains("6 grasps, 60 steps"),
        "{}",
        outcome.stderr
    );
    assert!(!outcome.stderr.contains('\u{1b}'), "{}", outcome.stderr);
}
