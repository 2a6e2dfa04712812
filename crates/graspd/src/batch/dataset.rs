//! A batch that is done, in a few files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::folder::{BatchFolder, RunState, json, json_lines};
use super::journal::StartFailure;
use super::plan::{BatchPlan, PlannedRun};
use crate::GraspError;
use crate::rank::rank_by_displacement;
use crate::record::GraspRecord;
use crate::record_file::{read_records, write_atomically};
use crate::summary::{MetricMeans, Summary};

/// A run in a line of `runs.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunRow {
    /// Its folder under `runs`.
    pub run: String,
    /// The object's name or file.
    pub object: String,
    /// The hand's name or file.
    pub hand: String,
    /// The seed.
    pub seed: u64,
    /// How many grasps are kept.
    pub grasps: usize,
    /// How many of them hold, see [`HOLDS_BELOW_CM`](graspd_eval::HOLDS_BELOW_CM); `None` where
    /// displacements were not asked for.
    pub holding: Option<usize>,
    /// How many starts failed.
    pub failed_starts: usize,
    /// The least simulation displacement \[cm\].
    pub best_displacement_cm: Option<f64>,
}

/// `dataset.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DatasetSummary {
    /// Objects of the batch.
    pub objects: usize,
    /// Runs of the batch: objects times hands times seeds.
    pub runs: usize,
    /// Runs that gave no grasp.
    pub failed_runs: usize,
    /// Starts that gave no grasp, besides those of objects that could not be loaded.
    pub failed_starts: usize,
    /// Grasps.
    pub grasps: usize,
    /// Share of grasps that hold, see [`HOLDS_BELOW_CM`](graspd_eval::HOLDS_BELOW_CM).
    pub holding_share: Option<f64>,
    /// Means over all grasps.
    pub all: MetricMeans,
    /// Means over the best grasp of each run.
    pub best_of_each_run: MetricMeans,
    /// Means over all grasps of each hand, by its name.
    pub by_hand: BTreeMap<String, MetricMeans>,
}

/// `failures.jsonl`.
#[derive(Serialize)]
struct FailureRow<'a> {
    run: &'a str,
    object: &'a str,
    hand: &'a str,
    seed: u64,
    #[serde(flatten)]
    failure: StartFailure,
}

fn displacement(record: &GraspRecord) -> Option<f64> {
    record.metrics.as_ref()?.sim_displacement_cm
}

/// Whether a grasp holds; `None` without a displacement.
fn holds(record: &GraspRecord) -> Option<bool> {
    record.metrics.as_ref()?.holds()
}

impl BatchFolder {
    /// Whether every run of the batch, whichever shard it is of, is done or has failed.
    pub fn is_complete(&self, plan: &BatchPlan) -> bool {
        let is_over = |run| matches!(self.state(run), RunState::Done | RunState::Failed);
        plan.runs.iter().all(is_over)
    }

    /// The grasps of a run, best first; none if it failed.
    ///
    /// # Errors
    /// If its file cannot be read.
    pub fn records(&self, run: &PlannedRun) -> Result<Vec<GraspRecord>, GraspError> {
        match self.state(run) {
            RunState::Done => read_records(&self.run_folder(run).join("grasps.jsonl")),
            _ => Ok(Vec::new()),
        }
    }

    /// The starts of a run that failed.
    ///
    /// # Errors
    /// If its file cannot be read.
    pub fn failures(&self, run: &PlannedRun) -> Result<Vec<StartFailure>, GraspError> {
        let path = self.run_folder(run).join("failures.jsonl");
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(source) => return Err(GraspError::Read { path, source }),
        };
        let parse = |(number, line)| {
            serde_json::from_str(line).map_err(|error: serde_json::Error| GraspError::ParseRecord {
                path: path.clone(),
                line: number + 1,
                fault: error.to_string(),
            })
        };
        text.lines().enumerate().map(parse).collect()
    }

    /// Writes `runs.jsonl`, `failures.jsonl` and `dataset.json`. To be called [alone](Self::alone), when all is done.
    ///
    /// # Errors
    /// If a file cannot be read or written.
    pub fn write_summary(&self, plan: &BatchPlan) -> Result<DatasetSummary, GraspError> {
        let (mut rows, mut failures) = (Vec::new(), Vec::new());
        let (mut all, mut best) = (Vec::new(), Vec::new());
        for run in &plan.runs {
            let (object, hand) = (
                &plan.objects[run.object].name_or_path,
                &plan.hands[run.hand],
            );
            let records = self.records(run)?;
            let failed = self.failures(run)?;
            let is_all = failed.iter().any(|failure| failure.index.is_none());
            let holding: Vec<bool> = records.iter().filter_map(holds).collect();
            rows.push(RunRow {
                run: run.name.clone(),
                object: object.clone(),
                hand: hand.clone(),
                seed: run.seed,
                grasps: records.len(),
                holding: (!holding.is_empty()).then(|| holding.iter().filter(|h| **h).count()),
                failed_starts: if is_all { plan.starts } else { failed.len() },
                best_displacement_cm: records.first().and_then(displacement),
            });
            failures.extend(failed.into_iter().map(|failure| FailureRow {
                run: &run.name,
                object,
                hand,
                seed: run.seed,
                failure,
            }));
            let mut records = records.into_iter().map(without_pose);
            let first = records.next();
            best.extend(first.clone());
            all.extend(first.into_iter().chain(records));
        }
        write_atomically(&self.path().join("runs.jsonl"), &json_lines(&rows)?)?;
        write_atomically(&self.path().join("failures.jsonl"), &json_lines(&failures)?)?;
        let summary = summarise(plan, &rows, &failures, &mut all, &best);
        write_atomically(&self.path().join("dataset.json"), &json(&summary)?)?;
        Ok(summary)
    }
}

/// What the means need of a record: a large dataset's poses would fill the memory.
fn without_pose(record: GraspRecord) -> GraspRecord {
    GraspRecord {
        joints_rad: None,
        mano: None,
        pre_grasp: None,
        squeeze: None,
        optimizer: None,
        ..record
    }
}

fn summarise(
    plan: &BatchPlan,
    rows: &[RunRow],
    failures: &[FailureRow<'_>],
    all: &mut [GraspRecord],
    best: &[GraspRecord],
) -> DatasetSummary {
    let mut by_hand: BTreeMap<String, Vec<GraspRecord>> = BTreeMap::new();
    for record in &*all {
        by_hand
            .entry(record.hand.clone())
            .or_default()
            .push(record.clone());
    }
    let holding: Vec<bool> = all.iter().filter_map(holds).collect();
    // In an order that does not depend on that of the runs.
    rank_by_displacement(all);
    let failed_runs = rows.iter().filter(|row| row.grasps == 0).count();
    let of_a_start = |failure: &&FailureRow<'_>| failure.failure.index.is_some();
    DatasetSummary {
        objects: plan.objects.len(),
        runs: rows.len(),
        failed_runs,
        failed_starts: failures.iter().filter(of_a_start).count(),
        grasps: all.len(),
        holding_share: (!holding.is_empty())
            .then(|| holding.iter().filter(|h| **h).count() as f64 / holding.len() as f64),
        all: Summary::of(all).all,
        best_of_each_run: Summary::of(best).all,
        by_hand: (by_hand.into_iter())
            .map(|(hand, records)| (hand, Summary::of(&records).all))
            .collect(),
    }
}

/// The `grasps.jsonl` files of a folder: its own, or those of the runs of a batch, in their order.
///
/// # Errors
/// If there is none.
pub fn grasp_files(folder: &Path) -> Result<Vec<PathBuf>, GraspError> {
    let own = folder.join("grasps.jsonl");
    if own.is_file() {
        return Ok(vec![own]);
    }
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder.join("runs"))
        .into_iter()
        .flatten()
        .filter_map(|entry| Some(entry.ok()?.path().join("grasps.jsonl")))
        // A run without its description is not done.
        .filter(|file| file.is_file() && file.with_file_name("run.toml").is_file())
        .collect();
    if files.is_empty() {
        let nothing = "neither grasps.jsonl nor runs with one are there".to_owned();
        return Err(GraspError::Read {
            path: folder.to_owned(),
            source: std::io::Error::new(std::io::ErrorKind::NotFound, nothing),
        });
    }
    files.sort();
    Ok(files)
}
