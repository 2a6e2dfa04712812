//! Grasp synthesis: starts, the alternating optimisation, evaluation, ranking and records.
//!
//! ```
//! use graspd::{ExecutionSettings, GraspObject, NamedMesh, RunSettings, SynthesisSettings, synthesize_grasps};
//! use graspd_eval::EvaluationSettings;
//! use graspd_hand::builtin_hand;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A built-in object or a mesh file, its signed distance on a grid of 48^3 samples, and its mass at 1000 kg/m^3.
//! let object = GraspObject::prepare(NamedMesh::load("mug", 1.0)?, 48, 1000.0, &|_| {})?;
//! let hand = builtin_hand("allegro").ok_or("no such hand")?;
//!
//! // One grasp in 60 steps, for a quick look; the presets take 7000.
//! let settings = SynthesisSettings::preset("paper")?.with_steps(60);
//! let run = RunSettings {
//!     seed: 0,
//!     count: 1,
//!     trajectory_every: None,
//!     execution: ExecutionSettings::default(),
//!     evaluation: EvaluationSettings { metrics: "ca,iv,pd,gws".parse()?, ..EvaluationSettings::default() },
//! };
//! for grasp in synthesize_grasps(&object, &*hand, &settings, &run, &())? {
//!     let metrics = grasp.record.metrics.unwrap_or_default();
//!     println!("contact area {:?} cm^2", metrics.contact_area_cm2);
//!     println!("interpenetration {:?} cm^3", metrics.interpenetration_volume_cm3);
//!     println!("epsilon {:?}", metrics.epsilon);
//!     assert!(metrics.max_penetration_mm.is_some_and(|depth| depth >= 0.0));
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # Along the way of a grasp
//!
//! | step | what it takes | what it gives |
//! |---|---|---|
//! | [`NamedMesh::load`] | a name or a mesh file | a closed mesh \[m\] |
//! | [`GraspObject::prepare`] | that mesh | distance grid, mass, inertia |
//! | [`draw_start`] | seed and index | the open hand before a random point of the surface |
//! | [`synthesize`] | that pose, [`SynthesisSettings`] | the pose of a grasp, its [`Losses`] |
//! | [`plan_pre_grasp`], [`plan_squeeze`] | that pose | where to come from, how to hold on |
//! | [`graspd_eval::evaluate`] | the posed hand's surface | metrics against the true mesh |
//! | [`rank_by_displacement`] | judged [`GraspRecord`]s | their order |
//! | [`Summary::of`], [`write_records`] | ranked records | means over the best; a `grasps.jsonl` |
//!
//! [`synthesize_grasps`] does all but the first two and the last, for many starts at once, on rayon's current thread
//! pool; a [`RunObserver`] sees it happen. [`run_batch`] does so for many objects, hands and seeds, into a folder from
//! which it goes on after a kill. [`ConfigurationLayers`] put all numbers together from a preset, files and flags.
//!
//! # What can be relied on
//!
//! * A start is a pure function of (seed, object's name, hand's name, index), and a run's grasps,
//!   timings apart, do not depend on the number of threads.
//! * Records are read back bit for bit ([`read_records`]) and written whole or not at all ([`write_atomically`]).
//! * Whatever is out of range is an error before the first step; an optimisation whose numbers overflow is an error,
//!   too. One that does not converge is a result, with [`Synthesis::task_satisfied`] false.
//!
//! Poses map hand-base coordinates into the object's mesh coordinates; lengths are metres.

mod ablation;
mod annealing;
mod antipodal_start;
mod aperture;
mod approach;
mod attempt;
mod batch;
mod bootstrap;
mod configuration;
mod dexgraspnet;
mod diversity;
mod error;
mod execution;
mod force_closure;
mod object;
mod preset;
mod pressing;
mod rank;
mod record;
mod record_file;
mod released;
mod run;
mod run_description;
mod start;
mod summary;
mod synthesis;

pub use ablation::{ConstraintMethod, MethodPart};
pub use annealing::{AnnealingSettings, anneal};
pub use approach::{ClosingOrder, PlannedPreGrasp};
pub use batch::{
    BatchFolder, BatchInput, BatchManifest, BatchObserver, BatchPlan, BatchTally, DatasetSummary,
    ObjectLoader, PlannedObject, PlannedRun, RunRow, RunState, Shard, StartFailure, StartOutcome,
    grasp_files, run_batch,
};
pub use bootstrap::grouped_interval_95;
pub use configuration::{
    Configuration, ConfigurationEntry, ConfigurationLayers, Origin, ResolvedConfiguration,
};
pub use dexgraspnet::read_dexgraspnet;
pub use diversity::{Diversity, diverse, pose_distances};
pub use error::GraspError;
pub use execution::{ExecutionSettings, PlannedSqueeze, plan_pre_grasp, plan_squeeze};
pub use graspd_ad::{INSTRUCTIONS_VARIABLE, Instructions, UnknownInstructions};
pub use graspd_settings::{OutOfRange, Range, Validate};
pub use object::{GraspObject, NamedMesh, PAPER_PADDING, PAPER_RESOLUTION};
pub use preset::{PRESETS, SynthesisSettings};
pub use pressing::{PressingContact, pressing_contacts};
pub use rank::rank_by_displacement;
pub use record::{
    GraspRecord, OptimizerRecord, PreGrasp, RecordedPose, Seconds, Squeeze, named_joints,
};
pub use record_file::{read_records, write_atomically, write_records};
pub use run::{Grasp, RunObserver, RunSettings, TrajectoryPoint, draw_start, synthesize_grasps};
pub use run_description::{Machine, ObjectRepair, RunDescription};
pub use start::{PAPER_STANDOFF, initial_pose, start_rng, transform_object_hand};
pub use summary::{MetricMeans, Summary};
pub use synthesis::{Losses, Synthesis, synthesize};

/// The schema of the records that this version writes.
pub const SCHEMA: &str = "graspd.grasp/1";

/// The code of the guide, so that it is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guides/use-from-rust.md")]
struct Guide;
