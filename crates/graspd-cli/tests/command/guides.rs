//! The commands of the guides, run as they stand there.
//!
//! Few steps and coarse grids come from a `graspd.toml` in the folder where they run, as a user might have one.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use graspd_mesh::{builtin_object, save_obj};
use tempfile::tempdir;

use crate::export::python_with;

const QUICK: &str = "grasps = 2\nsdf_resolution = 24\n[settings]\npreset = \"paper\"\nsteps = 20\n\
    [settings.conformity]\ncandidates = 1\ncoarse_samples = 50\nfine_samples = 50\n\
    [evaluation]\nmetrics = \"ca,pd,sd\"\n";

/// The blocks of a language in a guide, in their order.
fn blocks(guide: &str) -> Vec<(String, String)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../docs/guides")
        .join(guide);
    let text = fs::read_to_string(path).unwrap();
    let mut found = Vec::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let block: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            found.push((language.to_owned(), block.join("\n")));
        }
    }
    found
}

/// Runs all blocks of a guide in one folder; the files that it speaks of are put there before.
fn follow(guide: &str, prepare: impl FnOnce(&Path)) {
    let folder = tempdir().unwrap();
    fs::write(folder.path().join("graspd.toml"), QUICK).unwrap();
    prepare(folder.path());
    let programs = Path::new(env!("CARGO_BIN_EXE_graspd")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let cache = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graspd-cache");
    let mut commands = 0;
    for (language, block) in blocks(guide) {
        let mut command = match language.as_str() {
            "sh" => {
                commands += block
                    .lines()
                    .filter(|line| line.starts_with("graspd "))
                    .count();
                let mut command = Command::new("bash");
                command.args(["-euc", &block]);
                command
            }
            "python" => {
                let package = if block.contains("pyarrow") {
                    "pyarrow.parquet"
                } else {
                    "numpy"
                };
                let Some(python) = python_with(package) else {
                    continue;
                };
                let mut command = Command::new(python);
                command.args(["-c", &block]);
                command
            }
            _ => continue,
        };
        command
            .current_dir(folder.path())
            .env("PATH", &path)
            .env("GRASPD_CACHE_DIR", &cache);
        let output = command.output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{guide}:\n{block}\n{errors}");
        assert!(!errors.contains("panicked"), "{guide}:\n{block}\n{errors}");
    }
    assert!(commands > 0, "{guide} has no command");
}

/// A built-in object as a file.
fn put_mesh(file: PathBuf, object: &str, scale: f64) {
    fs::create_dir_all(file.parent().unwrap()).unwrap();
    save_obj(&builtin_object(object).unwrap().scaled(scale), file).unwrap();
}

#[test]
fn grasp_my_object() {
    follow("grasp-my-object.md", |folder| {
        put_mesh(folder.join("bottle.obj"), "can", 1.0);
        put_mesh(folder.join("bottle-mm.obj"), "can", 1000.0);
    });
}

#[test]
fn add_my_hand() {
    follow("add-my-hand.md", |_| {});
}

#[test]
fn rgbd() {
    follow("rgbd.md", |_| {});
}

#[test]
fn datasets() {
    follow("datasets.md", |folder| {
        put_mesh(folder.join("meshes/box.obj"), "box", 1.0);
        put_mesh(folder.join("meshes/more/small.obj"), "box", 0.9);
    });
}

#[test]
fn evaluate_others() {
    follow("evaluate-others.md", |_| {});
}

#[test]
fn every_guide_is_listed_and_links_lead_somewhere() {
    let guides = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guides");
    let list = fs::read_to_string(guides.join("README.md")).unwrap();
    for entry in fs::read_dir(&guides).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            name == "README.md" || list.contains(&name),
            "{name} is not listed"
        );
        let text = fs::read_to_string(guides.join(&name)).unwrap();
        for link in text.split("](").skip(1) {
            let link = link.split(')').next().unwrap();
            assert!(guides.join(link).exists(), "{name}: {link} leads nowhere");
        }
    }
}
