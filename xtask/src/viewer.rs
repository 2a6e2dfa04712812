//! `cargo xtask viewer`: the script of the page of `graspd view`, bundled from its sources and npm packages.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};

use crate::steps::{output, run};

/// Where the sources and the bundle are.
const FOLDER: &str = "crates/graspd-view/viewer";
const BUNDLE: &str = "viewer.js";
/// What the bundle is made from.
const SOURCES: [&str; 6] = [
    ".npmrc",
    "build.mjs",
    "package-lock.json",
    "package.json",
    "tsconfig.json",
    "src",
];

/// Rebuilds the bundle in place.
pub(crate) fn rebuild(root: &Path) -> Result<()> {
    let built = build(root)?;
    let bundle = root.join(FOLDER).join(BUNDLE);
    fs::copy(&built, &bundle)
        .with_context(|| format!("cannot copy {} to {}", built.display(), bundle.display()))?;
    println!("{FOLDER}/{BUNDLE}: {} bytes", fs::metadata(&bundle)?.len());
    Ok(())
}

/// Checks that the bundle is what its sources give.
pub(crate) fn check(root: &Path) -> Result<()> {
    let built = build(root)?;
    let bundle = root.join(FOLDER).join(BUNDLE);
    if fs::read(&built)? != fs::read(&bundle)? {
        bail!("{FOLDER}/{BUNDLE} is not what its sources give: run cargo xtask viewer");
    }
    Ok(())
}

/// As [`check`], where npm is installed and its packages can be had; says so where not.
pub(crate) fn check_if_possible(root: &Path) -> Result<()> {
    let is_there = |program: &str| {
        let mut command = Command::new(program);
        let command = command.arg("--version").stdout(Stdio::null());
        command
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    if !(is_there("npm") && is_there("node")) {
        println!("SKIPPED: npm is not installed; a test still compares the bundle's digest");
        return Ok(());
    }
    if let Err(error) = install(root) {
        println!("SKIPPED: the viewer's packages cannot be had: {error:#}");
        return Ok(());
    }
    check(root)
}

/// A copy of the sources in the build folder, with their packages installed as the lock file says.
fn install(root: &Path) -> Result<PathBuf> {
    let work = root.join("target").join("viewer");
    let source = root.join(FOLDER);
    let lock = fs::read(source.join("package-lock.json"))?;
    let installed = work.join("installed-lock.json");
    let is_installed = fs::read(&installed).is_ok_and(|there| there == lock);
    fs::create_dir_all(work.join("src"))?;
    for file in fs::read_dir(work.join("src"))? {
        fs::remove_file(file?.path())?;
    }
    for name in SOURCES {
        let (from, to) = (source.join(name), work.join(name));
        if from.is_dir() {
            for file in fs::read_dir(&from)? {
                let file = file?;
                fs::copy(file.path(), to.join(file.file_name()))?;
            }
        } else {
            fs::copy(&from, &to).with_context(|| format!("cannot copy {}", from.display()))?;
        }
    }
    if !is_installed {
        let mut npm = Command::new("npm");
        npm.current_dir(&work).stdin(Stdio::null());
        // No package needs to run anything on being installed.
        npm.args([
            "ci",
            "--ignore-scripts",
            "--no-audit",
            "--no-fund",
            "--loglevel=error",
        ]);
        npm.args(["--fetch-timeout=20000", "--fetch-retries=1"]);
        output(&mut npm)?;
        fs::write(&installed, &lock)?;
    }
    Ok(work)
}

/// Type-checks and bundles; gives the bundle's file.
fn build(root: &Path) -> Result<PathBuf> {
    let work = install(root)?;
    let node = |arguments: &[&str]| {
        let mut command = Command::new("node");
        command.current_dir(&work).stdin(Stdio::null());
        run(command.args(arguments))
    };
    node(&["node_modules/typescript/bin/tsc", "--noEmit"])?;
    node(&["build.mjs", BUNDLE])?;
    Ok(work.join(BUNDLE))
}
