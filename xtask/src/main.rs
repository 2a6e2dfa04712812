//! Project automation: the checks of `cargo xtask ci`, and starters of what takes several commands.

mod bench;
mod ci;
mod circles;
mod duplicates;
mod edges;
mod graph;
mod laboratory;
mod links;
mod manual;
mod sources;
mod steps;
mod uses;
mod viewer;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask <command>

  ci                 format, layering and source rules, clippy, documentation, doctests, tests
  rules              of these, what needs no compiler
  bench [--save NAME]
                     processor times of a synthesis step by each backend, as one table; NAME keeps them for criterion
  man [DIR]          manual pages and shell completions of the graspd command, into target/man or DIR
  viewer [--check]   bundles the script of the page of graspd view with npm, or checks that it is up to date

experiments (the package bench-lab; each has --help)

  evaluate           grasps of many objects, judged, with intervals; comparison with an earlier run
  plot               contact, displacement and time of runs of evaluate as pictures
  reproduce-table4   the paper's RGB-D experiment
  engines            sets up PyBullet and MuJoCo for `graspd eval --engine`, and compares the engines";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // The manifest's folder at compile time: xtask is always run from a checkout.
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = manifest.parent().unwrap_or(manifest);
    let result = match words.as_slice() {
        ["ci"] => ci::check_all(root),
        ["rules"] => ci::check_rules(root),
        ["bench"] => bench::bench(root, None),
        ["bench", "--save", name] => bench::bench(root, Some(name)),
        ["man"] => manual::write(root, "target/man"),
        ["man", folder] => manual::write(root, folder),
        ["viewer"] => viewer::rebuild(root),
        ["viewer", "--check"] => viewer::check(root),
        ["evaluate" | "plot" | "reproduce-table4" | "engines", ..] => {
            laboratory::start(root, &words)
        }
        ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            Ok(())
        }
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
