//! Project automation: `cargo xtask ci`.

mod bench;
mod ci;
mod command;
mod duplicates;
mod edges;
mod engines;
mod evaluate;
mod manual;
mod objects;
mod sources;
mod steps;
mod table4;
mod viewer;

use std::path::Path;
use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask <command>

  ci    format, layering and source rules, clippy, documentation, doctests, tests
  bench [--save NAME]
        processor times of a synthesis step by each backend, as one table; NAME keeps them for criterion
  engines [--compare]
        set up PyBullet and MuJoCo for `graspd eval --engine`; judge sixty grasps by each of them and the one built in
  evaluate [--objects ycb|table4|NAME,...] [--hand HAND] [--preset P] [--starts N] [--steps N] [--seed S] [--resolution N]
           [--without PART]... [--config FILE.toml] [--against FILE|DIR] [-o DIR] [--threads T] [--graspd PROGRAM]
        grasps of many objects, judged, with intervals; goes on where it was interrupted; --against says which
        differences to an earlier run are significant
  man [DIR]
        manual pages and shell completions of the graspd command, into target/man or DIR
  plot DIR RUN...
        contact, displacement and time of runs of evaluate (their evaluation.json or folders) as pictures in DIR
  reproduce-table4 [--ycb DIR] [--objects LIST] [--quick] [--fresh]
        the paper's RGB-D experiment: grasps on true and reconstructed meshes, judged on the true ones; an
        interrupted run goes on where it was, --fresh begins anew
  viewer [--check]
        bundles the script of the page of graspd view with npm, or checks that it is what its sources give";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    // The manifest's folder at compile time: xtask is always run from a checkout.
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = manifest.parent().unwrap_or(manifest).to_owned();
    match words.as_slice() {
        ["bench"] => exit_code(bench::bench(&root, None)),
        ["bench", "--save", name] => exit_code(bench::bench(&root, Some(name))),
        ["ci"] => match ci::check_all(&root) {
            Ok(code) => code,
            Err(error) => {
                eprintln!("error: {error:#}");
                ExitCode::FAILURE
            }
        },
        ["engines"] => exit_code(engines::set_up(&root)),
        ["engines", "--compare"] => exit_code(engines::compare(&root)),
        ["evaluate", rest @ ..] => match evaluate::Options::parse(rest) {
            Some(options) => exit_code(evaluate::evaluate(&root, &options)),
            None => {
                eprintln!("{USAGE}");
                ExitCode::from(2)
            }
        },
        ["man"] => exit_code(manual::write(&root, "target/man")),
        ["man", folder] => exit_code(manual::write(&root, folder)),
        ["plot", folder, runs @ ..] if !runs.is_empty() => exit_code(evaluate::plot(runs, folder)),
        ["reproduce-table4", rest @ ..] => match table4::Options::parse(rest) {
            Some(options) => exit_code(table4::reproduce(&root, &options)),
            None => {
                eprintln!("{USAGE}");
                ExitCode::from(2)
            }
        },
        ["viewer"] => exit_code(viewer::rebuild(&root)),
        ["viewer", "--check"] => exit_code(viewer::check(&root)),
        ["help" | "--help" | "-h"] => {
            println!("{USAGE}");
            ExitCode::SUCCESS
        }
        _ => {
            eprintln!("{USAGE}");
            ExitCode::from(2)
        }
    }
}

fn exit_code(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
