//! `graspd export`: grasps in the formats of others.

mod joints;
mod numpy;
mod parquet;
mod pickle;
mod scene_gltf;
mod scene_mujoco;
mod source;

use std::path::PathBuf;

use anyhow::Result;
use clap::builder::NonEmptyStringValueParser;
use clap::{Args, ValueEnum};

use super::configuration::ConfigurationChoice;
use super::input::{HandLoading, RepairChoice};
use super::output::prepare_folder;
use crate::console::{print, print_json};
use source::GraspSource;

#[derive(Args)]
pub(crate) struct Arguments {
    /// A folder that `graspd synth` or `graspd batch` wrote, or a grasps.jsonl
    grasps: PathBuf,
    /// What to write
    #[arg(long, value_enum)]
    format: Format,
    /// Output folder (`export` in the folder of the grasps by default)
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Only the K best of each run (by default all; of mjcf and gltf, which make a file for each, the best one)
    #[arg(long, value_name = "K")]
    top_k: Option<usize>,
    /// The hand, where the records do not name a built-in one
    #[arg(long, value_parser = NonEmptyStringValueParser::new())]
    hand: Option<String>,
    #[command(flatten)]
    loading: HandLoading,
    /// The object's mesh or built-in name, where the records do not tell it
    #[arg(long, value_name = "MESH", value_parser = NonEmptyStringValueParser::new())]
    object: Option<String>,
    #[command(flatten)]
    repair: RepairChoice,
    #[command(flatten)]
    configuration: ConfigurationChoice,
    /// Print the files that were written as JSON
    #[arg(long)]
    json: bool,
    /// No warnings
    #[arg(long, short)]
    quiet: bool,
}

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// One table of all grasps, a row each
    Parquet,
    /// For each hand and object, a list of dictionaries as DexGraspNet has them
    Npy,
    /// For each grasp, a MuJoCo scene: the hand fixed, the object free
    Mjcf,
    /// For each grasp, object and hand as a binary glTF
    Gltf,
    /// For each hand, a table of joint positions: pre-grasp, grasp and squeeze
    Csv,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut source = GraspSource::open(arguments)?;
    let folder = match &arguments.output {
        Some(folder) => folder.clone(),
        None => source.folder().join("export"),
    };
    prepare_folder(&folder)?;
    let files = match arguments.format {
        Format::Parquet => parquet::write(&mut source, &folder)?,
        Format::Npy => numpy::write(&mut source, &folder)?,
        Format::Mjcf => scene_mujoco::write(&mut source, &folder)?,
        Format::Gltf => scene_gltf::write(&mut source, &folder)?,
        Format::Csv => joints::write(&mut source, &folder)?,
    };
    if arguments.json {
        let files: Vec<_> = files.iter().map(|file| file.to_string_lossy()).collect();
        return print_json(&serde_json::json!({ "files": files }));
    }
    let mut text = String::new();
    for file in &files {
        text += &format!("{}\n", file.display());
    }
    print(&text)
}
