//! `engines`: the physics engines that `graspd eval --engine` can ask, and how they agree with the one built in.

mod agreement;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::command::{graspd, parsed, target_folder};
use crate::steps::{output, run};
use agreement::{Judged, document};

/// What is installed: versions that the figures of docs/engines.md are of.
const PACKAGES: [&str; 3] = ["numpy>=2,<3", "pybullet==3.2.7", "mujoco==4.0.0"];
/// Those of them that are engines, by the names that `--engine` has for them.
pub(crate) const OUTSIDE: [&str; 2] = ["pybullet", "mujoco"];

/// Objects, hands and ways to make grasps of the comparison: good ones, and ones that were stopped too early.
const OBJECTS: [&str; 2] = ["mug", "bottle"];
const HANDS: [&str; 2] = ["allegro", "human"];
const QUALITIES: [(&str, &str); 3] = [
    ("good", "--preset default"),
    ("mediocre", "--preset soft --steps 1500"),
    ("bad", "--preset soft --steps 400"),
];
/// Of each.
const GRASPS: usize = 5;

/// Makes a virtual environment in `target/engines` with the packages that the engines need.
pub(crate) fn set_up(root: &Path) -> Result<()> {
    let environment = target_folder(root)?.join("engines");
    let python = python_of(&environment);
    if !python.is_file() {
        let base = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
        run(Command::new(&base).args(["-m", "venv"]).arg(&environment)).with_context(|| {
            format!(
                "{}: cannot make a virtual environment; install Python 3 with its module venv, or name another interpreter by the variable PYTHON",
                base.display()
            )
        })?;
    }
    run(Command::new(&python)
        .args(["-m", "pip", "install", "--quiet"])
        .args(PACKAGES))?;
    for name in OUTSIDE {
        let mut check = Command::new(&python);
        check.arg(root.join("tools/simulate_displacement.py"));
        print!("{}", output(check.args(["--check", name]))?);
    }
    println!(
        "{} is what `graspd eval --engine` looks for",
        python.display()
    );
    Ok(())
}

fn python_of(environment: &Path) -> PathBuf {
    if cfg!(windows) {
        environment.join("Scripts/python.exe")
    } else {
        environment.join("bin/python")
    }
}

/// Makes sixty grasps of three qualities, judges them by every engine, and writes what came of it to `docs/engines.json` and,
/// as tables, to `target/engines/agreement.md`.
pub(crate) fn compare(root: &Path) -> Result<()> {
    set_up(root)?;
    let graspd = graspd(root)?;
    let target = target_folder(root)?;
    let work = target.join("engines").join("grasps");
    let mut judged = Vec::new();
    for object in OBJECTS {
        for hand in HANDS {
            for (quality, flags) in QUALITIES {
                let name = format!("{object} {hand} {quality}");
                let folder = work.join(name.replace(' ', "-"));
                println!("== {name}");
                judged.extend(
                    case(&graspd, root, object, hand, quality, flags, &folder)
                        .with_context(|| format!("{name} failed"))?,
                );
            }
        }
    }
    let text = document(&judged);
    println!("\n{text}");
    write(&target.join("engines").join("agreement.md"), &text)?;
    let json = Value::Array(judged.iter().map(Judged::json).collect());
    write(&root.join("docs/engines.json"), &format!("{json:#}\n"))
}

/// The grasps of one object, hand and quality, judged by every engine.
fn case(
    graspd: &Path,
    root: &Path,
    object: &str,
    hand: &str,
    quality: &str,
    flags: &str,
    folder: &Path,
) -> Result<Vec<Judged>> {
    let count = GRASPS.to_string();
    let command = || {
        let mut command = Command::new(graspd);
        command.current_dir(root);
        command
    };
    if !folder.join("summary.json").is_file() {
        let mut synth = command();
        synth.args(["synth", object, "--hand", hand, "-n", &count, "--quiet"]);
        run(synth.args(flags.split(' ')).arg("-o").arg(folder))?;
    }
    let mut judged: Vec<Judged> = Vec::new();
    for engine in std::iter::once("rapier").chain(OUTSIDE) {
        let mut eval = command();
        eval.arg("eval").arg(folder).args(["--engine", engine]);
        eval.args(["--metrics", "sd,sd6,shake,pd", "--json", "--quiet"]);
        let report = parsed(&mut eval)?;
        let grasps = report["grasps"].as_array().context("no grasps")?;
        for grasp in grasps {
            let index = grasp["index"].as_u64().context("a grasp without index")?;
            let known = judged.iter().position(|other| other.index == index);
            let at = known.unwrap_or(judged.len());
            if known.is_none() {
                judged.push(Judged::new(object, hand, quality, index));
            }
            judged[at].add(engine, &grasp["metrics"])?;
        }
    }
    if judged.len() != GRASPS {
        bail!("{} grasps instead of {GRASPS}", judged.len());
    }
    judged.sort_by_key(|grasp| grasp.index);
    Ok(judged)
}

fn write(path: &Path, text: &str) -> Result<()> {
    // Under another name first, so that a run cut short leaves the old file.
    let unfinished = path.with_extension("unfinished");
    fs::write(&unfinished, text)
        .and_then(|()| fs::rename(&unfinished, path))
        .with_context(|| format!("cannot write {}", path.display()))
}
