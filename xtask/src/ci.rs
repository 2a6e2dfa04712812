//! `cargo xtask ci`: everything that must hold before a change is accepted.

use std::path::Path;

use anyhow::Result;

use crate::steps::{Steps, cargo, report, run, status};
use crate::{circles, duplicates, edges, links, sources, viewer};

/// A rule, and how the project at a folder is checked for it.
type Rule = (&'static str, fn(&Path) -> Result<()>);

/// The rules that need no compiler.
const RULES: [Rule; 6] = [
    ("format", |root| run(&mut cargo(root, "fmt --all --check"))),
    ("layers", edges::check_workspace),
    (
        "one version of each mathematics crate",
        duplicates::check_workspace,
    ),
    ("source rules", sources::check_workspace),
    ("circles of modules", circles::check_workspace),
    ("links of documents", links::check_workspace),
];

/// Checks all rules and names every fault.
pub(crate) fn check_rules(root: &Path) -> Result<()> {
    let faults = RULES
        .iter()
        .filter_map(|(name, check)| check(root).err().map(|error| format!("{name}: {error:#}")));
    report(faults.collect())
}

/// Does all steps, quick ones first, and the tests last and with nothing printed after them: whoever reads the
/// log finds their closing lines at its end.
///
/// All steps use the dev profile, so that documentation tests and tests share what they compile.
pub(crate) fn check_all(root: &Path) -> Result<()> {
    let mut steps = Steps::new();
    let succeed = |line| run(&mut cargo(root, line));
    steps.step("rules", || check_rules(root))?;
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
