//! The folder of a batch: what is done, and how it gets there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use toml::Value;

use super::journal::{Journal, StartFailure, StartOutcome};
use super::lock::{ShardLock, gate};
use super::plan::{BatchPlan, PlannedRun, Shard};
use crate::GraspError;
use crate::configuration::present_leaves;
use crate::rank::rank_by_displacement;
use crate::record::{GraspRecord, Seconds};
use crate::record_file::{write_atomically, write_records};
use crate::run_description::ObjectRepair;
use crate::summary::Summary;

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunState {
    /// Nothing is there.
    New,
    /// Some starts are in its journal.
    Begun,
    /// Its files are all there.
    Done,
    /// As done, and there is no grasp.
    Failed,
}

/// A folder that this process may write its shard into.
#[derive(Debug)]
pub struct BatchFolder {
    path: PathBuf,
    _lock: ShardLock,
}

/// `timings.json`: what differs between identical batches.
#[derive(Serialize)]
struct Timings {
    grasps: BTreeMap<usize, Seconds>,
}

impl BatchFolder {
    /// Opens a folder for a shard of a batch, and makes it if need be.
    ///
    /// # Errors
    /// [`GraspError::Locked`] if another process is at it; [`GraspError::BatchExists`] if there is
    /// something to go on with but `resume` is false; [`GraspError::BatchDiffers`] if the folder is
    /// of another batch.
    pub fn open(
        path: &Path,
        plan: &BatchPlan,
        shard: Shard,
        resume: bool,
    ) -> Result<Self, GraspError> {
        let failed = |source| GraspError::Write {
            path: path.to_owned(),
            source,
        };
        fs::create_dir_all(path.join("runs")).map_err(failed)?;
        let lock = ShardLock::take(path, shard)?;
        let folder = Self {
            path: path.to_owned(),
            _lock: lock,
        };
        // Shards that start together must not both find no description.
        let _gate = gate(path)?;
        folder.claim(plan)?;
        let is_begun = |object: usize| {
            let runs = &plan.runs[plan.objects[object].runs.clone()];
            runs.iter().any(|run| folder.state(run) != RunState::New)
        };
        if !resume && plan.objects_of(shard).any(is_begun) {
            return Err(GraspError::BatchExists {
                path: path.to_owned(),
            });
        }
        Ok(folder)
    }

    /// Writes `batch.toml`, or compares it with the one that is there.
    fn claim(&self, plan: &BatchPlan) -> Result<(), GraspError> {
        remove_unfinished(&self.path)?;
        let path = self.path.join("batch.toml");
        let asked = plan.description()?;
        let recorded = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return write_atomically(&path, asked.as_bytes());
            }
            Err(source) => return Err(GraspError::Read { path, source }),
        };
        if recorded == asked {
            return Ok(());
        }
        let values = |text: &str| -> BTreeMap<String, Value> {
            let values = present_leaves(&text.parse().unwrap_or_default());
            values.into_iter().collect()
        };
        let (recorded, asked) = (values(&recorded), values(&asked));
        let differs = |key: &&String| recorded.get(*key) != asked.get(*key);
        let Some(key) = recorded.keys().chain(asked.keys()).find(differs) else {
            return Ok(());
        };
        Err(GraspError::BatchDiffers {
            path,
            key: key.clone(),
        })
    }

    /// Where the batch is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of a run.
    pub fn run_folder(&self, run: &PlannedRun) -> PathBuf {
        run_folder(&self.path, run)
    }

    /// How far a run is.
    pub fn state(&self, run: &PlannedRun) -> RunState {
        Self::state_in(&self.path, run)
    }

    /// How far a run is in a folder that nobody need have opened.
    pub fn state_in(folder: &Path, run: &PlannedRun) -> RunState {
        let folder = run_folder(folder, run);
        let has = |name: &str| folder.join(name).is_file();
        match (has("run.toml"), has("grasps.jsonl"), has("journal.jsonl")) {
            (true, true, _) => RunState::Done,
            (true, false, _) => RunState::Failed,
            (false, _, true) => RunState::Begun,
            (false, true, false) => RunState::Begun,
            (false, false, false) => RunState::New,
        }
    }

    /// Forgets a run that failed, so that it is made again.
    ///
    /// # Errors
    /// If its files cannot be removed.
    pub fn forget(&self, run: &PlannedRun) -> Result<(), GraspError> {
        let folder = self.run_folder(run);
        // What tells that the run is done goes first.
        remove(&folder.join("run.toml"))?;
        fs::remove_dir_all(&folder).map_err(|source| GraspError::Write {
            path: folder,
            source,
        })
    }

    /// Begins or goes on with a run: its journal, and the starts that are in it.
    pub(super) fn begin(
        &self,
        run: &PlannedRun,
    ) -> Result<(Journal, Vec<StartOutcome>), GraspError> {
        let folder = self.run_folder(run);
        let failed = |source| GraspError::Write {
            path: folder.clone(),
            source,
        };
        fs::create_dir_all(&folder).map_err(failed)?;
        remove_unfinished(&folder)?;
        Journal::open(&folder.join("journal.jsonl"))
    }

    /// Writes a run's files from its starts; `run.toml` is the last, and then the journal goes.
    pub(super) fn finish(
        &self,
        plan: &BatchPlan,
        run: &PlannedRun,
        outcomes: Vec<StartOutcome>,
        repair: Option<ObjectRepair>,
    ) -> Result<(Vec<GraspRecord>, Vec<StartFailure>), GraspError> {
        let folder = self.run_folder(run);
        let (mut records, mut failures) = (Vec::new(), Vec::new());
        for outcome in outcomes {
            match outcome {
                StartOutcome::Grasp(record) => records.push(*record),
                StartOutcome::Failure(failure) => failures.push(failure),
            }
        }
        failures.sort_by_key(|failure| failure.index);
        rank_by_displacement(&mut records);
        let summary = Summary::of(&records);
        let timings = Timings {
            grasps: (records.iter_mut())
                .filter_map(|record| Some((record.index, record.seconds.take()?)))
                .collect(),
        };
        records.truncate(plan.top_k.unwrap_or(usize::MAX));
        write_atomically(&folder.join("timings.json"), &json(&timings)?)?;
        if !failures.is_empty() {
            write_atomically(&folder.join("failures.jsonl"), &json_lines(&failures)?)?;
        }
        if !records.is_empty() {
            write_records(&folder.join("grasps.jsonl"), &records)?;
            write_atomically(
                &folder.join("summary.json"),
                &json(&without_timings(&summary)?)?,
            )?;
        }
        plan.run_description(run, repair).write(&folder)?;
        remove(&folder.join("journal.jsonl"))?;
        Ok((records, failures))
    }

    /// Clears what a kill may have left of a run that is done.
    pub(super) fn tidy(&self, run: &PlannedRun) -> Result<(), GraspError> {
        remove(&self.run_folder(run).join("journal.jsonl"))
    }

    /// Does something that only one process may do at a time.
    ///
    /// # Errors
    /// What `work` gives, and if the lock cannot be had.
    pub fn alone<R, E: From<GraspError>>(
        &self,
        work: impl FnOnce() -> Result<R, E>,
    ) -> Result<R, E> {
        let _gate = gate(&self.path)?;
        work()
    }
}

fn run_folder(folder: &Path, run: &PlannedRun) -> PathBuf {
    folder.join("runs").join(&run.name)
}

/// The summary without the fields that differ between identical batches.
fn without_timings(summary: &Summary) -> Result<serde_json::Value, GraspError> {
    let mut value = serde_json::to_value(summary).map_err(json_error)?;
    if let Some(fields) = value.as_object_mut() {
        fields.retain(|name, _| !name.ends_with("_seconds"));
    }
    Ok(value)
}

pub(super) fn json(value: &impl Serialize) -> Result<Vec<u8>, GraspError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(json_error)?;
    bytes.push(b'\n');
    Ok(bytes)
}

pub(super) fn json_lines(values: &[impl Serialize]) -> Result<Vec<u8>, GraspError> {
    let mut bytes = Vec::new();
    for value in values {
        serde_json::to_writer(&mut bytes, value).map_err(json_error)?;
        bytes.push(b'\n');
    }
    Ok(bytes)
}

fn json_error(error: serde_json::Error) -> GraspError {
    GraspError::Write {
        path: "JSON".into(),
        source: error.into(),
    }
}

/// Removes half-written files of a process that is gone.
fn remove_unfinished(folder: &Path) -> Result<(), GraspError> {
    let failed = |source| GraspError::Write {
        path: folder.to_owned(),
        source,
    };
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path
            .extension()
            .is_some_and(|extension| extension == "part")
        {
            remove(&path)?;
        }
    }
    Ok(())
}

fn remove(path: &Path) -> Result<(), GraspError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(GraspError::Write {
            path: path.to_owned(),
            source: error,
        }),
        _ => Ok(()),
    }
}
