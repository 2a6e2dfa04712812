//! `graspd eval`: judges grasps already made.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use graspd::{GraspRecord, NamedMesh, Summary, rank_by_displacement, read_records, write_records};
use graspd_eval::{EvaluationSettings, ObjectUnderTest, evaluate};
use graspd_hand::load_hand;
use rayon::prelude::*;

use super::input::{load_object, on_threads};
use crate::progress::Progress;
use crate::table::print_grasps;

#[derive(Args)]
pub(crate) struct Arguments {
    /// A folder that holds grasps.jsonl, or such a file
    grasps: PathBuf,
    /// The object, where the records do not name it (or name another place)
    #[arg(long)]
    object: Option<String>,
    /// Multiplies the object's coordinates (as recorded by default)
    #[arg(long)]
    scale: Option<f64>,
    /// The hand, where the records do not name a built-in one
    #[arg(long)]
    hand: Option<String>,
    /// Only these metrics, separated by commas: ca, iv, pd (penetration depth), gws (epsilon and volume), sd, sd6
    #[arg(long, default_value = "all", value_name = "LIST")]
    metrics: graspd_eval::Metrics,
    /// Write the records with their metrics to this file
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Worker threads (one for each core by default)
    #[arg(long)]
    threads: Option<usize>,
    /// Print the summary and the grasps as JSON instead of a table
    #[arg(long)]
    json: bool,
    /// No progress and no warnings
    #[arg(long, short)]
    quiet: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || judge(arguments))?
}

fn judge(arguments: &Arguments) -> Result<()> {
    let file = if arguments.grasps.is_dir() {
        arguments.grasps.join("grasps.jsonl")
    } else {
        arguments.grasps.clone()
    };
    let mut records = read_records(&file)?;
    let source = object_of(arguments, &records)?;
    let hand_name = match arguments.hand.clone().or_else(|| recorded_hand(&file)) {
        Some(hand) => hand,
        None => common(&records, "hand", |record| record.hand.clone())?,
    };
    let hand = load_hand(&hand_name).with_context(|| {
        format!("the records' hand is `{hand_name}`; name the file with --hand if it is a URDF")
    })?;
    let settings = EvaluationSettings {
        metrics: arguments.metrics,
        ..EvaluationSettings::default()
    };
    let object = ObjectUnderTest::new(&source.mesh)?;

    let progress = Progress::start("evaluation", records.len() as u64, arguments.quiet);
    records
        .par_iter_mut()
        .try_for_each(|record| -> Result<()> {
            let started = std::time::Instant::now();
            let pose = record.hand_pose(hand.articulation_names())?;
            record.metrics = Some(evaluate(&object, &hand.surface(&pose), &settings)?);
            record.seconds.get_or_insert_default().evaluation = started.elapsed().as_secs_f64();
            progress.advance(1);
            Ok(())
        })?;
    progress.finish();
    rank_by_displacement(&mut records);
    let summary = Summary::of(&records);
    if let Some(output) = &arguments.output {
        write_records(output, &records)?;
    }
    if arguments.json {
        let value = serde_json::json!({"summary": summary, "grasps": records});
        println!("{}", serde_json::to_string_pretty(&value)?);
    } else {
        print_grasps(&records, &summary);
    }
    Ok(())
}

fn object_of(arguments: &Arguments, records: &[GraspRecord]) -> Result<NamedMesh> {
    let name = match &arguments.object {
        Some(object) => object.clone(),
        None => common(records, "object", |record| {
            record
                .object_path
                .clone()
                .unwrap_or_else(|| record.object.clone())
        })?,
    };
    let scale = match arguments.scale {
        Some(scale) => scale,
        None => records.first().map_or(1.0, |record| record.object_scale),
    };
    load_object(&name, scale, arguments.quiet)
}

/// The hand that `run.toml` beside the records names: a record has the hand's name, but not its file.
fn recorded_hand(records: &Path) -> Option<String> {
    let text = std::fs::read_to_string(records.with_file_name("run.toml")).ok()?;
    let run: toml::Table = text.parse().ok()?;
    run.get("hand")?.as_str().map(str::to_owned)
}

/// What all records agree on.
fn common(
    records: &[GraspRecord],
    what: &str,
    of: impl Fn(&GraspRecord) -> String,
) -> Result<String> {
    let mut names = records.iter().map(of);
    let first = names.next().context("there are no grasps")?;
    if let Some(other) = names.find(|name| *name != first) {
        bail!(
            "the records name several {what}s ({first}, {other}); evaluate one at a time, or set --{what}"
        );
    }
    Ok(first)
}
