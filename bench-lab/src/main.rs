//! Experiments with the `graspd` command: grasps of many objects, the paper's Table 4, physics engines side by side.
//!
//! Started by `cargo xtask evaluate`, `plot`, `reproduce-table4` and `engines`, which build the command first.

mod command;
mod engines;
mod evaluate;
mod objects;
mod table4;

use std::path::PathBuf;

use anyhow::Result;
use clap::Parser;

use command::Laboratory;

#[derive(Parser)]
#[command(name = "cargo xtask", version, max_term_width = 100)]
enum Experiment {
    /// Makes and judges grasps of many objects; an interrupted run goes on where it stopped
    Evaluate(Box<evaluate::Options>),
    /// Draws contact, displacement and time of runs of `evaluate` as pictures
    Plot {
        /// Where the pictures go
        folder: PathBuf,
        /// Files `evaluation.json`, or the folders that hold them
        #[arg(required = true)]
        runs: Vec<PathBuf>,
    },
    /// Repeats the paper's RGB-D experiment: grasps on true and reconstructed meshes, judged on the true ones
    ReproduceTable4(table4::Options),
    /// Sets up PyBullet and MuJoCo for `graspd eval --engine`
    Engines {
        /// Also judge sixty grasps with each engine and compare the results
        #[arg(long)]
        compare: bool,
    },
}

fn main() -> Result<()> {
    let laboratory = Laboratory::find()?;
    match Experiment::parse() {
        Experiment::Evaluate(options) => evaluate::evaluate(&laboratory, &options),
        Experiment::Plot { folder, runs } => evaluate::plot(&runs, &folder),
        Experiment::ReproduceTable4(options) => table4::reproduce(&laboratory, &options),
        Experiment::Engines { compare: false } => engines::set_up(&laboratory).map(drop),
        Experiment::Engines { compare: true } => engines::compare(&laboratory),
    }
}
