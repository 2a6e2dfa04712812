//! The `graspd` command, built and asked for JSON.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::steps::{cargo, output, run};

/// The release build of the command, made first where it is out of date.
pub(crate) fn graspd(root: &Path) -> Result<PathBuf> {
    run(&mut cargo(root, "build --locked --release -p graspd-cli"))?;
    let name = format!("graspd{}", std::env::consts::EXE_SUFFIX);
    Ok(target_folder(root)?.join("release").join(name))
}

/// The folder of build outputs.
pub(crate) fn target_folder(root: &Path) -> Result<PathBuf> {
    let text = output(&mut cargo(
        root,
        "metadata --locked --no-deps --format-version 1",
    ))?;
    let metadata: Value = serde_json::from_str(&text)?;
    match metadata["target_directory"].as_str() {
        Some(folder) => Ok(PathBuf::from(folder)),
        None => bail!("cargo metadata names no target folder"),
    }
}

/// The JSON that a command prints.
pub(crate) fn parsed(command: &mut Command) -> Result<Value> {
    serde_json::from_str(&output(command)?).with_context(|| format!("{command:?} printed no JSON"))
}
