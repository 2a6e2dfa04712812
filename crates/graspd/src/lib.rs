//! Grasp synthesis: starts, the alternating optimisation, evaluation, ranking and records.

mod error;
mod object;
mod preset;
mod rank;
mod record;
mod run;
mod start;
mod summary;
mod synthesis;

pub use error::GraspError;
pub use object::{GraspObject, NamedMesh, PAPER_PADDING, PAPER_RESOLUTION};
pub use preset::{PRESETS, SynthesisSettings};
pub use rank::rank_by_displacement;
pub use record::{
    GraspRecord, OptimizerRecord, PreGrasp, RecordedPose, SCHEMA, Seconds, named_joints,
    read_records, write_atomically, write_records,
};
pub use run::{Grasp, RunObserver, RunSettings, TrajectoryPoint, draw_start, synthesize_grasps};
pub use start::{PAPER_STANDOFF, initial_pose, start_rng, transform_object_hand};
pub use summary::{MetricMeans, Summary};
pub use synthesis::{Losses, Synthesis, synthesize};
