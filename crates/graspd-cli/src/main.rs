//! The `graspd` command: grasps of objects by multi-fingered hands.

mod commands;
mod console;
mod progress;
mod table;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};

use commands::{
    batch, cache, configuration, eval, export, gws, hands, objects, reconstruct, repair, scan, sdf,
    shell, synth, view,
};

/// Synthesises contact-rich grasps for multi-fingered hands by optimising through a differentiable contact simulation.
#[derive(Parser)]
#[command(name = "graspd", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Synthesise, evaluate and rank grasps of an object (with no OBJECT: of a built-in mug)
    Synth(synth::Arguments),
    /// Make a dataset: many objects and hands, restartable at any point
    Batch(batch::Arguments),
    /// Evaluate grasps already made, by anyone
    Eval(eval::Arguments),
    /// Show the grasps of a run: a page in 3-D, or pictures
    View(view::Arguments),
    /// Write grasps as Parquet, NumPy, MuJoCo scenes, glTF or CSV
    Export(export::Arguments),
    /// Epsilon and volume of a set of wrenches
    Gws(gws::Arguments),
    /// Write the signed distance grid of an object
    Sdf(sdf::Arguments),
    /// Make one closed, consistently oriented surface of any triangles
    Repair(repair::Arguments),
    /// Render an RGB-D capture of an object on a turntable
    Scan(scan::Arguments),
    /// Make a closed mesh of an RGB-D capture
    Reconstruct(reconstruct::Arguments),
    /// Tell what is kept between runs, or remove it
    Cache(cache::Arguments),
    /// List the built-in hands, or inspect a URDF
    Hands(hands::Arguments),
    /// List the built-in objects
    Objects(objects::Arguments),
    /// Tell the settings that a run would have, and where each comes from
    Config(configuration::Arguments),
    /// Print completions for a shell
    Completions(shell::CompletionArguments),
    /// Write manual pages
    Man(shell::ManArguments),
}

fn main() -> ExitCode {
    match run(&Cli::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            console::tell(&format!("error: {}", console::describe(&error)));
            ExitCode::FAILURE
        }
    }
}

fn run(command: &Command) -> anyhow::Result<()> {
    // Else a mistake in its name would go unseen.
    graspd::Instructions::requested()?;
    match command {
        Command::Synth(arguments) => synth::run(arguments),
        Command::Batch(arguments) => batch::run(arguments),
        Command::Eval(arguments) => eval::run(arguments),
        Command::Export(arguments) => export::run(arguments),
        Command::View(arguments) => view::run(arguments),
        Command::Gws(arguments) => gws::run(arguments),
        Command::Sdf(arguments) => sdf::run(arguments),
        Command::Repair(arguments) => repair::run(arguments),
        Command::Scan(arguments) => scan::run(arguments),
        Command::Reconstruct(arguments) => reconstruct::run(arguments),
        Command::Cache(arguments) => cache::run(arguments),
        Command::Hands(arguments) => hands::run(arguments),
        Command::Objects(arguments) => objects::run(arguments),
        Command::Config(arguments) => configuration::run(arguments),
        Command::Completions(arguments) => shell::completions(arguments, Cli::command()),
        Command::Man(arguments) => shell::man(arguments, Cli::command()),
    }
}
