//! Physics engines: those inside this program, and those outside, which a Python script runs.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use anyhow::{Context, Result, anyhow, bail};
use clap::ValueEnum;
use graspd_eval::{PhysicsEngine, SimulationAnswer, SimulationJob};
use tempfile::TempDir;

/// The script, which is part of this program so that it is at hand wherever the program is.
const SCRIPT: &str = include_str!("../../../../tools/simulate_displacement.py");
/// A virtual environment for the engines, seen from the project's root.
const ENVIRONMENT: &str = "target/engines/bin/python";

/// Which engine simulates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Engine {
    /// The built-in solver
    #[default]
    Graspd,
    /// The general-purpose engine rapier, built in
    Rapier,
    /// Bullet, through the Python package pybullet
    Pybullet,
    /// MuJoCo, through the Python package mujoco
    Mujoco,
}

/// An engine outside this program, ready to run jobs.
pub(crate) struct OutsideEngine {
    name: &'static str,
    python: PathBuf,
    script: PathBuf,
    /// Goes when this does.
    folder: TempDir,
}

impl Engine {
    /// Returns the engine if it is inside this program.
    pub(crate) fn built_in(self) -> Option<PhysicsEngine> {
        match self {
            Self::Graspd => Some(PhysicsEngine::Graspd),
            Self::Rapier => Some(PhysicsEngine::Rapier),
            Self::Pybullet | Self::Mujoco => None,
        }
    }

    /// The engine, if it is not the one built in.
    ///
    /// # Errors
    /// If Python or the engine's package cannot be started; says how to get them.
    pub(crate) fn open(self, python: Option<&Path>) -> Result<Option<OutsideEngine>> {
        let name = match self {
            Self::Graspd | Self::Rapier if python.is_some() => {
                bail!("--python is for engines outside this program; choose one with --engine")
            }
            Self::Graspd | Self::Rapier => return Ok(None),
            Self::Pybullet => "pybullet",
            Self::Mujoco => "mujoco",
        };
        let usual = Path::new(ENVIRONMENT);
        let python = match python {
            Some(python) => python,
            None if usual.is_file() => usual,
            None => Path::new("python3"),
        };
        let folder = TempDir::with_prefix("graspd-engine-")
            .context("cannot make a temporary folder; set TMPDIR to another place")?;
        let script = folder.path().join("simulate_displacement.py");
        write(&script, SCRIPT.as_bytes())?;
        let engine = OutsideEngine {
            name,
            python: python.to_owned(),
            script,
            folder,
        };
        let output = engine.start(&["--check".as_ref(), name.as_ref()])?;
        if !output.status.success() {
            let python = python.display();
            bail!(
                "{python}: cannot import {name} ({}); run `{python} -m pip install numpy {name}`, or `cargo xtask \
                 engines` in the project's folder, or name another interpreter with --python",
                last_line(&output)
            );
        }
        Ok(Some(engine))
    }
}

impl OutsideEngine {
    /// Whether hands must come as convex pieces: MuJoCo takes the hull of any mesh.
    pub(crate) fn wants_hand_pieces(&self) -> bool {
        self.name == "mujoco"
    }

    /// Runs a job.
    ///
    /// # Errors
    /// If the script fails; quotes its last words.
    pub(crate) fn run(&self, job: &SimulationJob) -> Result<SimulationAnswer> {
        let [question, answer] =
            ["job.json", "answer.json"].map(|name| self.folder.path().join(name));
        write(&question, &serde_json::to_vec(job)?)?;
        let arguments = [self.name.as_ref(), question.as_os_str(), answer.as_os_str()];
        let output = self.start(&arguments)?;
        if !output.status.success() {
            bail!(
                "{}: the simulation failed: {}",
                self.name,
                last_line(&output)
            );
        }
        let text =
            std::fs::read(&answer).with_context(|| format!("{} left no answer", self.name))?;
        serde_json::from_slice(&text).with_context(|| format!("the answer of {}", self.name))
    }

    fn start(&self, arguments: &[&std::ffi::OsStr]) -> Result<Output> {
        let mut command = Command::new(&self.python);
        command.arg(&self.script).args(arguments);
        let output = command.stdin(Stdio::null()).output();
        output.map_err(|error| {
            anyhow!(
                "{}: cannot be started: {error}; name a Python interpreter that has {} with --python",
                self.python.display(),
                self.name
            )
        })
    }
}

/// What a Python program that failed says in the end is the error.
fn last_line(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr);
    let last = text.lines().rfind(|line| !line.trim().is_empty());
    last.unwrap_or("without a word").trim().to_owned()
}

fn write(file: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::File::create(file)
        .and_then(|mut file| file.write_all(bytes))
        .with_context(|| format!("cannot write {}", file.display()))
}
