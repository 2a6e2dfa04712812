//! `graspd eval`: judges grasps already made.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use graspd::{GraspRecord, Summary, rank_by_displacement, read_records, write_records};
use graspd_eval::{EvaluationSettings, Metrics, ObjectUnderTest, SimulationJob, evaluate};
use graspd_geom::TriangleMesh;
use graspd_hand::HandPose;
use rayon::prelude::*;
use serde::Serialize;

use super::cache::CacheChoice;
use super::configuration::ConfigurationChoice;
use super::engine::{Engine, OutsideEngine};
use super::input::{HandLoading, RepairChoice, on_threads};
use super::output::prepare_file;
use super::subject::{hand_of, object_of, poses_of};
use crate::console::{print, print_json};
use crate::progress::Progress;
use crate::table::grasps_table;

#[derive(Args)]
pub(crate) struct Arguments {
    /// A folder that holds grasps.jsonl, or such a file
    grasps: PathBuf,
    /// The object's mesh or built-in name, where the records do not tell it (or tell another place)
    #[arg(long, value_name = "MESH", value_parser = NonEmptyStringValueParser::new())]
    object: Option<String>,
    /// Multiplies the object's coordinates (as recorded by default)
    #[arg(long, allow_negative_numbers = true)]
    scale: Option<f64>,
    /// The hand, where the records do not name a built-in one
    #[arg(long, value_parser = NonEmptyStringValueParser::new())]
    hand: Option<String>,
    #[command(flatten)]
    loading: HandLoading,
    /// Only these metrics, separated by commas (all by default): ca, iv, pd (penetration depth), gws (epsilon and volume), sd, sd6, shake
    #[arg(long, value_name = "LIST")]
    metrics: Option<Metrics>,
    #[command(flatten)]
    configuration: ConfigurationChoice,
    /// Physics engine of sd, sd6 and shake (docs/engines.md)
    #[arg(long, value_enum, default_value_t = Engine::default())]
    engine: Engine,
    /// The Python interpreter that has the engine's package (by default that in target/engines, or python3)
    #[arg(long, value_name = "FILE")]
    python: Option<PathBuf>,
    /// Write the records with their metrics to this file
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Worker threads (one for each core by default)
    #[arg(long)]
    threads: Option<usize>,
    /// Print the summary and the grasps as JSON instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    repair: RepairChoice,
    #[command(flatten)]
    cache: CacheChoice,
    /// No progress and no warnings
    #[arg(long, short)]
    quiet: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    summary: &'a Summary,
    grasps: &'a [GraspRecord],
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    on_threads(arguments.threads, || judge(arguments))?
}

fn judge(arguments: &Arguments) -> Result<()> {
    let quiet = arguments.quiet;
    let file = if arguments.grasps.is_dir() {
        arguments.grasps.join("grasps.jsonl")
    } else {
        arguments.grasps.clone()
    };
    let mut records = read_records(&file)?;
    let hand = hand_of(
        &records,
        &file,
        arguments.hand.as_deref(),
        &arguments.loading.options()?,
        quiet,
    )?;
    let poses = poses_of(&records, &file, hand.as_ref(), quiet)?;
    let source = object_of(
        &records,
        &file,
        arguments.object.as_deref(),
        arguments.scale,
        &arguments.repair,
        quiet,
    )?;
    if let Some(output) = &arguments.output {
        prepare_file(output, "-o")?;
    }
    let outside = arguments.engine.open(arguments.python.as_deref())?;
    let configured = arguments.configuration.resolve(quiet)?;
    let configured = configured.configuration.evaluation;
    let metrics = arguments.metrics.unwrap_or(configured.metrics);
    let wanted = EvaluationSettings {
        metrics,
        ..configured
    };
    let settings = match outside {
        None => wanted.clone(),
        // The rest of the metrics are the same whatever the engine.
        Some(_) => EvaluationSettings {
            metrics: Metrics {
                displacement: false,
                displacement_mean6: false,
                shake: false,
                ..metrics
            },
            ..wanted.clone()
        },
    };
    let cache = arguments.cache.open();
    let object = ObjectUnderTest::new(&source.mesh).with_context(|| source.label())?;
    let object = object.with_cache(cache.clone());

    if arguments.object.is_some() || arguments.scale.is_some() {
        // The records now speak of this object: the metrics are against it.
        for record in &mut records {
            record.object.clone_from(&source.name);
            record.object_path = source.path_text();
            record.object_scale = source.scale;
        }
    }
    for record in &mut records {
        record.object_repair = source.repair_name();
    }
    let progress = Progress::start("evaluation", records.len() as u64, quiet);
    let judge_one = |record: &mut GraspRecord, pose: &HandPose| -> Result<()> {
        let started = Instant::now();
        let surface = hand.surface(pose);
        record.metrics = Some(evaluate(&object, &surface, &settings)?);
        record.seconds.get_or_insert_default().evaluation = started.elapsed().as_secs_f64();
        Ok(())
    };
    records
        .par_iter_mut()
        .zip(&poses)
        .try_for_each(|(record, pose)| -> Result<()> {
            judge_one(record, pose)
                .with_context(|| format!("{}: grasp {}", file.display(), record.index))?;
            progress.advance(1);
            Ok(())
        })?;
    progress.finish();
    if let Some(engine) = &outside {
        let hands = poses.iter().map(|pose| hand.surface(pose));
        simulate_outside(engine, &object, &wanted, hands, &mut records)
            .with_context(|| file.display().to_string())?;
    }
    CacheChoice::tell_fault(cache.as_ref(), quiet);
    if metrics.displacement {
        rank_by_displacement(&mut records);
    }
    let summary = Summary::of(&records);
    if let Some(output) = &arguments.output {
        write_records(output, &records)?;
    }
    if arguments.json {
        return print_json(&Report {
            summary: &summary,
            grasps: &records,
        });
    }
    print(&grasps_table(&records, &summary))
}

/// The simulated metrics by an engine outside this program.
fn simulate_outside(
    engine: &OutsideEngine,
    object: &ObjectUnderTest,
    settings: &EvaluationSettings,
    hands: impl Iterator<Item = TriangleMesh>,
    records: &mut [GraspRecord],
) -> Result<()> {
    let mut job = SimulationJob::new(object, settings)?;
    if job.is_empty() {
        return Ok(());
    }
    for (hand, record) in hands.zip(records.iter()) {
        job.add_hand(&hand, engine.wants_hand_pieces())
            .with_context(|| format!("grasp {}", record.index))?;
    }
    let answer = engine.run(&job)?;
    for (index, record) in records.iter_mut().enumerate() {
        job.fill(&answer, index, record.metrics.get_or_insert_default())?;
    }
    Ok(())
}
