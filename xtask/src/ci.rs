//! `cargo xtask ci`: everything that must hold before a change is accepted.

use std::path::Path;

use anyhow::Result;

use crate::steps::{Steps, cargo, run, status};
use crate::{duplicates, edges, sources, viewer};

/// Does all steps, quick ones first, and the tests last and with nothing printed after them: whoever reads the
/// log finds their closing lines at its end.
///
/// All steps use the dev profile, so that documentation tests and tests share what they compile.
pub(crate) fn check_all(root: &Path) -> Result<()> {
    let mut steps = Steps::new();
    let succeed = |line| run(&mut cargo(root, line));
    steps.step("format", || succeed("fmt --all --check"))?;
    steps.step("layers", || edges::check_workspace(root))?;
    steps.step("one version of each mathematics crate", || {
        duplicates::check_workspace(root)
    })?;
    steps.step("source rules", || sources::check_workspace(root))?;
    steps.step("bundle of the viewer", || viewer::check_if_possible(root))?;
    steps.step("clippy", || {
        succeed("clippy --locked --workspace --all-targets -- -D warnings")
    })?;
    steps.step("documentation", || {
        let mut command = cargo(root, "doc --locked --workspace --no-deps");
        run(command.env("RUSTDOCFLAGS", "-D warnings"))
    })?;
    steps.step("documentation tests", || {
        succeed("test --locked --workspace --doc")
    })?;
    steps.print_summary();
    println!("== tests");
    // The same random cases in every run, so that a failure is the change's; PROPTEST_RNG_SEED draws others.
    let seed = std::env::var("PROPTEST_RNG_SEED").unwrap_or_else(|_| "20220904".into());
    // Benchmarks are compiled by clippy and run by hand: their times mean nothing here.
    let line = "test --locked --workspace --lib --bins --tests --examples --no-fail-fast";
    let tests = status(cargo(root, line).env("PROPTEST_RNG_SEED", seed))?;
    // The tests' own closing lines stay the last.
    if !tests.success() {
        std::process::exit(1);
    }
    Ok(())
}
