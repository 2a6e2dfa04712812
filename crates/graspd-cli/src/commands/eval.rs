//! `graspd eval`: judges grasps already made.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use graspd::{
    GraspRecord, NamedMesh, Summary, rank_by_displacement, read_dexgraspnet, read_records,
    write_records,
};
use graspd_eval::{EvaluationSettings, Metrics, ObjectUnderTest, SimulationJob, evaluate};
use graspd_geom::TriangleMesh;
use graspd_hand::{Hand, HandPose, load_hand_from};
use rayon::prelude::*;
use serde::Serialize;

use super::cache::CacheChoice;
use super::configuration::ConfigurationChoice;
use super::engine::{Engine, OutsideEngine};
use super::input::{HandLoading, RepairChoice, on_threads};
use super::output::prepare_file;
use super::subject::{hand_of, objects_of, poses_of};
use crate::console::{print, print_json};
use crate::progress::Progress;
use crate::table::grasps_table;

#[derive(Args)]
pub(crate) struct Arguments {
    /// A folder that holds grasps.jsonl, such a file, or an .npy file of DexGraspNet's (with --hand and --object)
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
    /// Only these metrics, separated by commas (all by default): ca, iv, pd (penetration depth), spd
    /// (self-penetration), gws (epsilon and volume), sd, sd6, shake
    #[arg(long, value_name = "LIST")]
    metrics: Option<Metrics>,
    #[command(flatten)]
    configuration: ConfigurationChoice,
    /// Physics engine of sd, sd6 and shake (docs/metrics.md); the setting evaluation.engine by default
    #[arg(long, value_enum)]
    engine: Option<Engine>,
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
    let (mut records, hand) = grasps_of(arguments, &file)?;
    let poses = poses_of(&records, &file, hand.as_ref(), quiet)?;
    let sources = objects_of(
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
    let outside = arguments
        .engine
        .unwrap_or_default()
        .open(arguments.python.as_deref())?;
    let configured = arguments.configuration.resolve(quiet)?;
    let configured = configured.configuration.evaluation;
    let metrics = arguments.metrics.unwrap_or(configured.metrics);
    let engine = arguments.engine.and_then(Engine::built_in);
    let wanted = EvaluationSettings {
        metrics,
        engine: engine.unwrap_or(configured.engine),
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
    let under_test = |source: &NamedMesh| -> Result<ObjectUnderTest> {
        let object = ObjectUnderTest::new(&source.mesh).with_context(|| source.label())?;
        let object = object.with_cache(cache.clone());
        if !settings.metrics.self_penetration {
            return Ok(object);
        }
        Ok(object.grasped_by(&hand.surface_at_rest())?)
    };
    let objects = sources.iter().map(under_test);
    let objects = objects.collect::<Result<Vec<_>>>()?;
    // Which of them each grasp is of.
    let of_scale = |scale: f64| sources.iter().position(|source| source.scale == scale);
    let groups: Vec<usize> = (records.iter())
        .map(|record| of_scale(record.object_scale).unwrap_or(0))
        .collect();

    for (record, &group) in records.iter_mut().zip(&groups) {
        let source = &sources[group];
        if arguments.object.is_some() || arguments.scale.is_some() {
            // The records now speak of this object: the metrics are against it.
            record.object.clone_from(&source.name);
            record.object_path = source.path_text();
            record.object_scale = source.scale;
        }
        record.object_repair = source.repair_name();
    }
    let progress = Progress::start("evaluation", records.len() as u64, quiet);
    let judge_one = |record: &mut GraspRecord, pose: &HandPose, group: usize| -> Result<()> {
        let started = Instant::now();
        let surface = hand.surface(pose);
        record.metrics = Some(evaluate(&objects[group], &surface, &settings)?);
        record.seconds.get_or_insert_default().evaluation = started.elapsed().as_secs_f64();
        Ok(())
    };
    records
        .par_iter_mut()
        .zip(&poses)
        .zip(&groups)
        .try_for_each(|((record, pose), &group)| -> Result<()> {
            judge_one(record, pose, group)
                .with_context(|| format!("{}: grasp {}", file.display(), record.index))?;
            progress.advance(1);
            Ok(())
        })?;
    progress.finish();
    if let Some(engine) = &outside {
        for (group, object) in objects.iter().enumerate() {
            let own = (records.iter_mut().zip(&poses).zip(&groups))
                .filter(|(_, other)| **other == group)
                .map(|((record, pose), _)| (record, hand.surface(pose)));
            simulate_outside(engine, object, &wanted, own.collect())
                .with_context(|| file.display().to_string())?;
        }
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

/// The grasps, and the hand that they are of.
fn grasps_of(arguments: &Arguments, file: &Path) -> Result<(Vec<GraspRecord>, Box<dyn Hand>)> {
    let options = arguments.loading.options()?;
    if file.extension().is_some_and(|extension| extension == "npy") {
        let asked = arguments.hand.as_ref().with_context(|| {
            let file = file.display();
            format!("{file}: such a file does not tell its hand; name it with --hand")
        })?;
        if arguments.object.is_none() {
            bail!(
                "{}: such a file does not tell its object's mesh; name it with --object",
                file.display()
            );
        }
        let hand = load_hand_from(asked, &options)?;
        return Ok((read_dexgraspnet(file, hand.as_ref())?, hand));
    }
    let records = read_records(file)?;
    let asked = arguments.hand.as_deref();
    let hand = hand_of(&records, file, asked, &options, arguments.quiet)?;
    Ok((records, hand))
}

/// The simulated metrics by an engine outside this program, of grasps of one object.
fn simulate_outside(
    engine: &OutsideEngine,
    object: &ObjectUnderTest,
    settings: &EvaluationSettings,
    grasps: Vec<(&mut GraspRecord, TriangleMesh)>,
) -> Result<()> {
    let mut job = SimulationJob::new(object, settings)?;
    if job.is_empty() {
        return Ok(());
    }
    for (record, hand) in &grasps {
        job.add_hand(hand, engine.wants_hand_pieces())
            .with_context(|| format!("grasp {}", record.index))?;
    }
    let answer = engine.run(&job)?;
    for (index, (record, _)) in grasps.into_iter().enumerate() {
        job.fill(&answer, index, record.metrics.get_or_insert_default())?;
    }
    Ok(())
}
