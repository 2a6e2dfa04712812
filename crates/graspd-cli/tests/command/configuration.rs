//! Settings by flag and file, and `graspd config show`.

use std::fs;

use serde_json::Value;
use tempfile::tempdir;

use crate::outcome::{command, graspd, outcome, text};

fn entry<'a>(list: &'a Value, key: &str) -> &'a Value {
    let entries = list.as_array().unwrap();
    entries
        .iter()
        .find(|entry| entry["key"] == key)
        .unwrap_or_else(|| panic!("no {key}"))
}

#[test]
fn every_value_tells_where_it_comes_from() {
    let folder = tempdir().unwrap();
    fs::write(
        folder.path().join("graspd.toml"),
        "seed = 7\n[settings]\npreset = \"soft\"\nleak = 0.3\n[evaluation]\nfriction = 0.5\n",
    )
    .unwrap();
    let show = |flags: &[&str]| {
        let mut command = command([&["config", "show"][..], flags].concat());
        outcome(command.current_dir(folder.path()).output().unwrap())
    };
    let list = show(&[
        "--json",
        "--steps",
        "700",
        "--set",
        "evaluation.friction=0.6",
    ])
    .gives_json();
    for (key, value, from, unit, source) in [
        ("seed", Value::from(7), "graspd.toml", "", "of the run"),
        (
            "settings.leak",
            0.3.into(),
            "graspd.toml",
            "",
            "Grasp'D A.5",
        ),
        (
            "settings.steps",
            700.into(),
            "--steps",
            "steps",
            "Grasp'D A.2",
        ),
        (
            "settings.decay_start",
            350.into(),
            "preset soft, stretched",
            "steps",
            "lab/tuning.md",
        ),
        (
            "settings.force_rate",
            0.01.into(),
            "preset soft",
            "N or N m a step",
            "Grasp'D A.7",
        ),
        (
            "evaluation.friction",
            0.6.into(),
            "--set evaluation.friction",
            "",
            "Grasp'D A.5",
        ),
        (
            "evaluation.displacement.mass",
            1.0.into(),
            "default",
            "kg",
            "GANHand, by A.6",
        ),
    ] {
        let entry = entry(&list, key);
        assert_eq!(
            (&entry["value"], &entry["from"]),
            (&value, &from.into()),
            "{key}"
        );
        assert_eq!(
            (&entry["unit"], &entry["source"]),
            (&unit.into(), &source.into()),
            "{key}"
        );
    }
    assert_eq!(entry(&list, "settings.normal_stiffness")["paper"], 1e6);
    let table = show(&[]).succeeds();
    for part in [
        "settings.standoff",
        "graspd.toml",
        "N s/m^2",
        "(preset paper: 1e8)",
        "(of the object)",
    ] {
        assert!(table.contains(part), "no {part} in {table}");
    }
    // As a file, it gives the same, wherever it is.
    let file = folder.path().join("all.toml");
    fs::write(&file, show(&["--toml", "--steps", "700"]).succeeds()).unwrap();
    let again = graspd(["config", "show", "--config", text(&file), "--json"]).gives_json();
    let first = show(&["--json", "--steps", "700"]).gives_json();
    for (a, b) in first
        .as_array()
        .unwrap()
        .iter()
        .zip(again.as_array().unwrap())
    {
        assert_eq!((&a["key"], &a["value"]), (&b["key"], &b["value"]));
    }
}

#[test]
fn runs_and_judges_follow_the_file() {
    let folder = tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(
        at("graspd.toml"),
        "grasps = 1\nsdf_resolution = 24\nsdf_padding_m = 0.02\n[settings]\n\
        preset = \"paper\"\nsteps = 20\n[evaluation]\nmetrics = \"ca\"\n",
    )
    .unwrap();
    let here = |arguments: &[&str]| {
        let mut command = command(arguments);
        outcome(command.current_dir(folder.path()).output().unwrap())
    };
    let run = here(&[
        "synth",
        "box",
        "-o",
        "run",
        "--set",
        "settings.force_rate=0.02",
    ]);
    assert!(
        run.stderr.contains("settings are taken from graspd.toml"),
        "{}",
        run.stderr
    );
    run.succeeds();
    let table: toml::Table = fs::read_to_string(at("run/run.toml"))
        .unwrap()
        .parse()
        .unwrap();
    let settings = &table["settings"];
    assert_eq!(settings["force_rate"].as_float(), Some(0.02));
    assert_eq!(
        (settings["steps"].as_integer(), table["grasps"].as_integer()),
        (Some(20), Some(1))
    );
    assert_eq!(table["sdf_padding_m"].as_float(), Some(0.02));
    let report = here(&["eval", "run", "--json", "-q"]).gives_json();
    let metrics = &report["grasps"][0]["metrics"];
    assert!(metrics["contact_area_cm2"].is_number() && metrics["epsilon"].is_null());
    let report = here(&["eval", "run", "--json", "-q", "--metrics", "pd"]).gives_json();
    assert!(report["grasps"][0]["metrics"]["contact_area_cm2"].is_null());
    // The sections of a run's description are those of a configuration.
    let sections =
        ["settings", "execution", "evaluation"].map(|name| (name.to_owned(), table[name].clone()));
    let sections: toml::Table = sections.into_iter().collect();
    fs::write(at("again.toml"), toml::to_string(&sections).unwrap()).unwrap();
    here(&[
        "synth",
        "box",
        "-o",
        "again",
        "-q",
        "--config",
        "again.toml",
        "-n",
        "1",
        "--resolution",
        "24",
        "--set",
        "sdf_padding_m=0.02",
    ])
    .succeeds();
    let bare = |run: &str| {
        let mut record: Value = serde_json::from_str(
            fs::read_to_string(at(run).join("grasps.jsonl"))
                .unwrap()
                .trim(),
        )
        .unwrap();
        record["seconds"] = Value::Null;
        record
    };
    assert_eq!(bare("run"), bare("again"));
}

#[test]
fn mistakes_name_file_and_key() {
    let folder = tempdir().unwrap();
    let file = folder.path().join("mine.toml");
    let with = |content: &str| {
        fs::write(&file, content).unwrap();
        graspd(["synth", "--config", text(&file)])
    };
    with("[settings]\nstepz = 3").fails_at_once(&[
        "mine.toml",
        "`settings.stepz`",
        "`settings.steps`",
    ]);
    with("[settings]\nleak = \"much\"").fails_at_once(&[
        "mine.toml",
        "`settings.leak`",
        "invalid type",
    ]);
    with("[settings\n").fails_at_once(&["mine.toml, line 1"]);
    with("[settings]\nleak = 3").fails_at_once(&["`settings.leak` is 3", "0 to 1"]);
    graspd(["synth", "--config", "none.toml"]).fails_at_once(&["none.toml", "cannot be read"]);
    graspd(["synth", "--set", "leak=0.1"]).fails_at_once(&["--set leak", "`settings.leak`"]);
    graspd(["synth", "--set", "leak"]).fails_at_once(&["--set leak", "KEY=VALUE"]);
    let run = text(&crate::shared_run::RUN.0);
    let eval = graspd(["eval", run, "--set", "evaluation.frictions=1"]);
    eval.fails(&["--set evaluation.frictions", "`evaluation.friction`"]);
}
