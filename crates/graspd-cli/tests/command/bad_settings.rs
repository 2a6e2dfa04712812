//! Flags with values out of range, and wrong usage.

use tempfile::tempdir;

use crate::outcome::{graspd, text};

#[test]
fn values_out_of_range_name_the_setting_and_what_it_must_be() {
    let folder = tempdir().unwrap();
    let run = folder.path().join("run");
    let run = text(&run);
    for (flags, setting, wanted) in [
        (["-n", "0"], "`grasps`", "at least 1"),
        (["--top-k", "0"], "--top-k", "at least 1"),
        (["--threads", "0"], "--threads", "1 to 1024"),
        (["--threads", "100000"], "--threads", "1 to 1024"),
        (["--resolution", "1"], "--resolution", "2 to 1024"),
        (["--resolution", "1025"], "--resolution", "2 to 1024"),
        (
            ["--resolution", "18446744073709551615"],
            "--resolution",
            "2 to 1024",
        ),
        (["--steps", "0"], "`settings.steps`", "at least 1"),
        (["--scale", "0"], "`scale`", "positive"),
        (["--scale", "-1"], "`scale`", "positive"),
        (["--scale", "NaN"], "`scale`", "positive"),
        (["--scale", "inf"], "`scale`", "positive"),
        (["--scale", "1e300"], "mug", "--scale"),
        (["--scale", "1e-300"], "mug", "--scale"),
    ] {
        let synth = graspd(["synth", "-o", run, flags[0], flags[1]]);
        synth.fails_at_once(&[setting, wanted]);
        if !["-n", "--top-k", "--steps"].contains(&flags[0]) {
            let sdf = graspd(["sdf", "mug", "-o", run, flags[0], flags[1]]);
            sdf.fails_at_once(&[setting, wanted]);
        }
    }
    for padding in ["-0.01", "NaN", "inf"] {
        let sdf = graspd(["sdf", "mug", "-o", run, "--padding", padding]);
        sdf.fails_at_once(&["--padding", "at least 0"]);
    }
    assert!(
        !folder.path().join("run").exists(),
        "a mistake leaves nothing behind"
    );
}

#[test]
fn a_file_of_settings_is_checked_before_the_work() {
    let folder = tempdir().unwrap();
    let (file, run) = (folder.path().join("quick.toml"), folder.path().join("run"));
    for (content, part) in [
        ("", ""),
        ("settings.pace = 3", "settings.pace"),
        ("settings.steps = -3", "quick.toml"),
        ("settings.steps 3", "quick.toml"),
        ("settings.task_limit = -1.0", "task_limit"),
        (
            "[settings.conformity]\ncandidates = 0",
            "skin_fit.candidates",
        ),
    ] {
        if !content.is_empty() {
            std::fs::write(&file, content).unwrap();
        }
        let synth = graspd(["synth", "-o", text(&run), "--config", text(&file)]);
        synth.fails_at_once(&[part]);
        assert!(!run.exists());
    }
}

#[test]
fn wrong_usage_has_its_own_status() {
    for (arguments, part) in [
        (&[][..], "Usage: graspd"),
        (&["grasp"], "unrecognized subcommand"),
        (&["synth", "--colour", "red"], "--colour"),
        (&["synth", "--preset", "sloppy"], "paper"),
        (&["synth", "-n", "many"], "many"),
        (&["synth", "-n", "1.5"], "1.5"),
        (&["synth", "--scale", "big"], "big"),
        (&["synth", "mug", "can"], "can"),
        (&["synth", ""], "OBJECT"),
        (&["synth", "--hand", ""], "--hand"),
        (&["synth", "-o", ""], "--output"),
        // TOML knows no such integer, so run.toml could not keep it.
        (
            &["synth", "--seed", "9223372036854775808"],
            "9223372036854775808",
        ),
        (&["synth", "--without", "luck"], "leaky-gradient"),
        (&["synth", "--diverse"], "--top-k"),
        (&["eval"], "GRASPS"),
        (
            &["eval", "run", "--metrics", "ca,beauty"],
            "no metric `beauty`",
        ),
        (&["sdf"], "OBJECT"),
        (&["hands", "inspect"], "HAND"),
    ] {
        graspd(arguments).fails_as_wrong_usage(part);
    }
}
