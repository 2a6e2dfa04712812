//! `engines`: the physics engines that `graspd eval --engine` can ask, and how they agree with the one built in.

mod agreement;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use graspd::GraspRecord;
use serde::Deserialize;

use crate::command::{Laboratory, json_output, output, write_json, write_text};
use agreement::{Judged, document};

/// What is installed: versions that the figures of lab/engines.md are of.
const PACKAGES: [&str; 3] = ["numpy>=2,<3", "pybullet==3.2.7", "mujoco==4.0.0"];
/// All engines, by the names that `--engine` has for them.
const ENGINES: [&str; 4] = ["graspd", "rapier", "pybullet", "mujoco"];
/// Those that are Python packages.
const OUTSIDE: [&str; 2] = ["pybullet", "mujoco"];

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
pub(crate) fn set_up(laboratory: &Laboratory) -> Result<()> {
    let environment = laboratory.target.join("engines");
    let python = python_of(&environment);
    if !python.is_file() {
        let base = std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into());
        output(Command::new(&base).args(["-m", "venv"]).arg(&environment)).with_context(|| {
            format!(
                "{}: cannot make a virtual environment; install Python 3 with its module venv, or name another \
                 interpreter by the variable PYTHON",
                base.display()
            )
        })?;
    }
    output(
        Command::new(&python)
            .args(["-m", "pip", "install", "--quiet"])
            .args(PACKAGES),
    )?;
    let script = laboratory.root.join("tools/simulate_displacement.py");
    for name in OUTSIDE {
        print!(
            "{}",
            output(Command::new(&python).arg(&script).args(["--check", name]))?
        );
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

/// Makes sixty grasps of three qualities, judges them by every engine, and writes what came of it to
/// `lab/engines.json` and, as tables, to `target/engines/agreement.md`.
pub(crate) fn compare(laboratory: &Laboratory) -> Result<()> {
    set_up(laboratory)?;
    let folder = laboratory.target.join("engines");
    let mut judged = Vec::new();
    for object in OBJECTS {
        for hand in HANDS {
            for (quality, flags) in QUALITIES {
                let name = format!("{object} {hand} {quality}");
                println!("== {name}");
                let run = folder.join("grasps").join(name.replace(' ', "-"));
                if !run.join("summary.json").is_file() {
                    let mut synth = graspd(laboratory);
                    synth.args([
                        "synth",
                        object,
                        "--hand",
                        hand,
                        "-n",
                        &GRASPS.to_string(),
                        "--quiet",
                    ]);
                    output(synth.args(flags.split(' ')).arg("-o").arg(&run))?;
                }
                let grasp = |index| Judged::new(object, hand, quality, index);
                judged.extend(
                    judge(laboratory, &run, grasp).with_context(|| format!("{name} failed"))?,
                );
            }
        }
    }
    let text = document(&judged);
    println!("\n{text}");
    write_text(&folder.join("agreement.md"), &text)?;
    write_json(&laboratory.root.join("lab/engines.json"), &judged)
}

fn graspd(laboratory: &Laboratory) -> Command {
    let mut command = Command::new(&laboratory.graspd);
    // The virtual environment is found from the project's root.
    command.current_dir(&laboratory.root);
    command
}

/// What is read of the output of `graspd eval --json`.
#[derive(Deserialize)]
struct Report {
    grasps: Vec<GraspRecord>,
}

/// Judges a run's grasps by every engine; `grasp` makes what the findings are added to.
fn judge(
    laboratory: &Laboratory,
    run: &Path,
    grasp: impl Fn(usize) -> Judged,
) -> Result<Vec<Judged>> {
    let mut judged: BTreeMap<usize, Judged> = BTreeMap::new();
    for engine in ENGINES {
        let mut eval = graspd(laboratory);
        eval.arg("eval").arg(run).args(["--engine", engine]);
        eval.args(["--metrics", "sd,sd6,shake,pd", "--json", "--quiet"]);
        for record in json_output::<Report>(&mut eval)?.grasps {
            let index = record.index;
            let metrics = record
                .metrics
                .with_context(|| format!("grasp {index} was not judged"))?;
            judged
                .entry(index)
                .or_insert_with(|| grasp(index))
                .add(engine, &metrics)?;
        }
    }
    if judged.len() != GRASPS {
        bail!("{} grasps instead of {GRASPS}", judged.len());
    }
    Ok(judged.into_values().collect())
}
