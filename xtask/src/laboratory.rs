//! Experiments: the package `bench-lab`, which finds the `graspd` command beside itself.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};

use crate::steps::{cargo, run};

/// Builds the release builds of the command and of the experiments, and starts an experiment.
pub(crate) fn start(root: &Path, arguments: &[&str]) -> Result<()> {
    run(&mut cargo(
        root,
        "build --locked --release -p graspd-cli -p bench-lab",
    ))?;
    // This program is <target>/<profile>/xtask.
    let own = std::env::current_exe().context("cannot find this program's own folder")?;
    let target = own
        .ancestors()
        .nth(2)
        .context("this program is not in a target folder")?;
    let program = format!("release/bench-lab{}", std::env::consts::EXE_SUFFIX);
    run(Command::new(target.join(program)).args(arguments))
}
