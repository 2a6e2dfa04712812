//! Many objects, hands and seeds into one folder, restartable at any point and shardable.
//!
//! ```text
//! DIR/batch.toml                 everything that the batch depends on: what --resume compares
//! DIR/runs/NAME/journal.jsonl    while a run goes on: each start as soon as it is done
//! DIR/runs/NAME/grasps.jsonl     then, as `graspd synth` writes it, with summary.json
//! DIR/runs/NAME/failures.jsonl   starts (or the whole object) that failed, if any did
//! DIR/runs/NAME/timings.json     all that differs between identical batches
//! DIR/runs/NAME/run.toml         written last: the run is done
//! DIR/runs.jsonl, failures.jsonl, dataset.json     once all runs are done
//! ```
//!
//! A run is one object, one hand and one seed. A process that is killed leaves at worst a line of a journal half
//! written, which counts as not there; the start is then made again, and with the same seed comes out the same.

mod dataset;
mod drive;
mod folder;
mod journal;
mod lock;
mod manifest;
mod plan;

pub use dataset::{DatasetSummary, RunRow, grasp_files};
pub use drive::{BatchInput, BatchObserver, BatchTally, ObjectLoader, run_batch};
pub use folder::{BatchFolder, RunState};
pub use journal::{StartFailure, StartOutcome};
pub use manifest::BatchManifest;
pub use plan::{BatchPlan, PlannedObject, PlannedRun, Shard};
