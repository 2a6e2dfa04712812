//! Completions and manual pages.

use std::fs;

use tempfile::tempdir;

use crate::outcome::{graspd, text};

#[test]
fn completions_know_the_commands() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = graspd(["completions", shell]).succeeds();
        for word in ["synth", "batch", "--preset", "config"] {
            let word = if shell == "fish" {
                word.trim_start_matches("--")
            } else {
                word
            };
            assert!(script.contains(word), "no {word} for {shell}");
        }
    }
    graspd(["completions", "csh"]).fails_as_wrong_usage("csh");
    // Bash itself takes it.
    let script = graspd(["completions", "bash"]).succeeds();
    let check = std::process::Command::new("bash")
        .args(["-n", "-c", &script])
        .status();
    if let Ok(status) = check {
        assert!(status.success());
    }
}

#[test]
fn every_command_has_a_page() {
    let folder = tempdir().unwrap();
    let pages = folder.path().join("man");
    graspd(["man", text(&pages)]).succeeds();
    let help = graspd(["--help"]).succeeds();
    for (page, part) in [
        ("graspd.1", "Synthesises contact\\-rich grasps"),
        ("graspd-synth.1", "\\-\\-preset"),
        ("graspd-batch.1", "\\-\\-shard"),
        ("graspd-export.1", "parquet"),
        ("graspd-config-show.1", "\\-\\-toml"),
        ("graspd-hands-inspect.1", "URDF"),
    ] {
        let content = fs::read_to_string(pages.join(page)).unwrap();
        assert!(
            content.contains(".TH") && content.contains(part),
            "no {part} in {page}"
        );
    }
    for command in ["batch", "export", "config", "completions", "man"] {
        assert!(help.contains(command), "no {command} in {help}");
    }
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    graspd(["man", text(&file)]).fails_at_once(&[text(&file), "cannot write"]);
}
