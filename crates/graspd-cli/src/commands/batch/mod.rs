//! `graspd batch`: many objects, hands and seeds into one folder.

mod histogram;
mod page;
mod progress;
mod report;

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use graspd::{
    BatchFolder, BatchInput, BatchManifest, BatchPlan, BatchTally, ConfigurationLayers,
    DatasetSummary, PlannedObject, RunState, Shard, run_batch,
};
use graspd_hand::{Hand, LoadOptions};
use serde::Serialize;

use super::cache::CacheChoice;
use super::configuration::{ConfigurationChoice, resolve};
use super::input::{RepairChoice, load_hand_to_scale, load_object, thread_pool};
use crate::console::{describe, print, print_json, warn};
use progress::BatchProgress;

#[derive(Args)]
pub(crate) struct Arguments {
    /// What to make: objects, hands, starts, seeds and settings in TOML (docs/guides/datasets.md)
    manifest: PathBuf,
    /// Output folder
    #[arg(short, long, default_value = "dataset")]
    output: PathBuf,
    /// Only part I of N, I from 1 to N; parts may share the output folder, even at the same time
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// Go on where an earlier run was cut short (or begin, if there was none)
    #[arg(long)]
    resume: bool,
    /// Make runs again that gave no grasp
    #[arg(long, requires = "resume")]
    retry_failed: bool,
    /// Only list the runs, and how far each is
    #[arg(long, visible_alias = "dry-run")]
    list: bool,
    #[command(flatten)]
    configuration: ConfigurationChoice,
    /// Worker threads (one for each core by default); results do not depend on it
    #[arg(long)]
    threads: Option<usize>,
    /// Make no report.html
    #[arg(long)]
    no_report: bool,
    /// Print the outcome as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    cache: CacheChoice,
    /// No progress and no warnings
    #[arg(long, short)]
    quiet: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    runs: usize,
    runs_failed: usize,
    starts_made: usize,
    starts_done_before: usize,
    seconds: f64,
    /// Of the whole batch; none while other shards are at it.
    dataset: Option<&'a DatasetSummary>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let quiet = arguments.quiet;
    let manifest = BatchManifest::read(&arguments.manifest)?;
    let mut layers: ConfigurationLayers = arguments.configuration.file_layer(quiet)?;
    manifest.lay_settings(&mut layers);
    arguments.configuration.lay_flags(&mut layers)?;
    let plan = BatchPlan::new(&manifest, resolve(&layers, quiet)?.configuration)?;
    if arguments.list {
        return list(arguments, &plan);
    }
    let pool = thread_pool(arguments.threads)?;
    let hands = load_hands(&plan)?;
    let folder = BatchFolder::open(&arguments.output, &plan, arguments.shard, arguments.resume)?;
    if arguments.retry_failed {
        forget_failed(&folder, &plan, arguments.shard)?;
    }

    let started = Instant::now();
    let cache = arguments.cache.open();
    let repair = RepairChoice::of(plan.repair);
    let load = |object: &PlannedObject| {
        load_object(&object.name_or_path, plan.object_scale, &repair, quiet)
            .map_err(|error| describe(&error))
    };
    let progress = BatchProgress::new(quiet);
    let input = BatchInput {
        plan: &plan,
        shard: arguments.shard,
        hands: &hands,
        load: &load,
        cache: cache.clone(),
    };
    let tally = run_batch(&input, &folder, &pool, &progress)?;
    progress.finish();
    let seconds = started.elapsed().as_secs_f64();
    CacheChoice::tell_fault(cache.as_ref(), quiet);

    let summary = folder.alone(|| -> Result<_> {
        if !folder.is_complete(&plan) {
            return Ok(None);
        }
        let summary = folder.write_summary(&plan)?;
        // The report of a batch that was done already is there, unless a kill came between.
        let is_new = tally.runs_done_before < tally.runs;
        let is_there = arguments.output.join("report.html").is_file();
        if !arguments.no_report && (is_new || !is_there) {
            pool.install(|| report::write(&folder, &plan, &hands, &repair, &summary))?;
        }
        Ok(Some(summary))
    })?;
    tell(arguments, &tally, summary.as_ref(), seconds)?;
    if tally.runs > 0 && tally.runs_failed == tally.runs {
        bail!(
            "{}: none of the {} runs gave a grasp; failures.jsonl in their folders tells why",
            arguments.output.display(),
            tally.runs
        );
    }
    Ok(())
}

fn load_hands(plan: &BatchPlan) -> Result<Vec<Box<dyn Hand>>> {
    let options = LoadOptions {
        package_paths: plan.package_paths.clone(),
        mirrored: plan.mirror,
        ..LoadOptions::default()
    };
    let hands = plan.hands.iter();
    hands
        .map(|hand| load_hand_to_scale(hand, &options))
        .collect()
}

fn forget_failed(folder: &BatchFolder, plan: &BatchPlan, shard: Shard) -> Result<()> {
    for object in plan.objects_of(shard) {
        for run in &plan.runs[plan.objects[object].runs.clone()] {
            if folder.state(run) == RunState::Failed {
                folder.forget(run)?;
            }
        }
    }
    Ok(())
}

/// One line a run: its name, its state, object, hand, seed.
fn list(arguments: &Arguments, plan: &BatchPlan) -> Result<()> {
    let mut text = String::new();
    let (mut runs, mut missing) = (0, 0);
    for object in plan.objects_of(arguments.shard) {
        let PlannedObject {
            name_or_path,
            runs: range,
        } = &plan.objects[object];
        let is_file = std::path::Path::new(name_or_path).is_file();
        let is_there = is_file || graspd_mesh::builtin_object(name_or_path).is_some();
        missing += usize::from(!is_there);
        for run in &plan.runs[range.clone()] {
            let state = match BatchFolder::state_in(&arguments.output, run) {
                _ if !is_there => "no mesh",
                RunState::New => "new",
                RunState::Begun => "begun",
                RunState::Done => "done",
                RunState::Failed => "failed",
            };
            let (name, hand, seed) = (&run.name, &plan.hands[run.hand], run.seed);
            text += &format!("{name}\t{state}\t{name_or_path}\t{hand}\t{seed}\n");
            runs += 1;
        }
    }
    warn(
        arguments.quiet || missing == 0,
        &format!("{missing} of the objects are not there; their runs are going to fail"),
    );
    if !arguments.quiet {
        let starts = plan.starts;
        crate::console::tell(&format!(
            "{runs} runs of {starts} starts: {} grasps",
            runs * starts
        ));
    }
    print(&text)
}

fn tell(
    arguments: &Arguments,
    tally: &BatchTally,
    summary: Option<&DatasetSummary>,
    seconds: f64,
) -> Result<()> {
    if arguments.json {
        return print_json(&Report {
            runs: tally.runs,
            runs_failed: tally.runs_failed,
            starts_made: tally.starts_made,
            starts_done_before: tally.starts_done_before,
            seconds,
            dataset: summary,
        });
    }
    let folder = arguments.output.display();
    let mut text = format!("{} runs of shard {}", tally.runs, arguments.shard);
    if tally.runs_done_before > 0 {
        text += &format!(", {} of them done before", tally.runs_done_before);
    }
    let rate = tally.starts_made as f64 / seconds.max(1e-9);
    text += &format!(
        "; {} starts made now in {seconds:.1} s ({rate:.2} a second); {} runs without a grasp\n",
        tally.starts_made, tally.runs_failed
    );
    match summary {
        None => {
            text += &format!(
                "{folder}: other shards are not done yet; the last one makes the report\n"
            );
        }
        Some(summary) => {
            let holding = summary.holding_share.map_or_else(String::new, |share| {
                format!(", {:.0} % of them hold", 100.0 * share)
            });
            text += &format!(
                "{folder}: {} grasps of {} objects{holding}\n",
                summary.grasps, summary.objects
            );
            if !arguments.no_report {
                text += &format!(
                    "report: {}\n",
                    arguments.output.join("report.html").display()
                );
            }
        }
    }
    print(&text)
}
