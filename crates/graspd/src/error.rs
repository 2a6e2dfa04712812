//! What can go wrong in the pipeline.

use std::path::PathBuf;

use graspd_settings::OutOfRange;

use crate::SCHEMA;

/// Why grasps could not be made, read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GraspError {
    /// The object's mesh.
    #[error(transparent)]
    Geometry(#[from] graspd_geom::GeometryError),
    /// The hand.
    #[error(transparent)]
    Hand(#[from] graspd_hand::HandError),
    /// The skin fit.
    #[error(transparent)]
    Fit(#[from] graspd_fit::FitError),
    /// The simulation's parameters.
    #[error(transparent)]
    Simulation(#[from] graspd_sim::SimulationError),
    /// The optimiser's parameters.
    #[error(transparent)]
    Optimization(#[from] graspd_opt::OptimizationError),
    /// The judge.
    #[error(transparent)]
    Evaluation(#[from] graspd_eval::EvaluationError),
    /// A setting outside its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// A setting outside its range, in a file or flag.
    #[error("{origin}: {fault}")]
    SettingFrom {
        /// The file or flag.
        origin: String,
        /// The setting.
        fault: OutOfRange,
    },
    /// A preset that does not exist.
    #[error("there is no preset `{name}`; known presets: {known}")]
    UnknownPreset {
        /// The name asked for.
        name: String,
        /// The names that exist.
        known: String,
    },
    /// A part of the method that a preset does not have.
    #[error("the method of preset `{preset}` has no part `{part}` to leave out; parts: {parts}")]
    NoSuchPart {
        /// The preset.
        preset: String,
        /// The part.
        part: String,
        /// Those that there are.
        parts: String,
    },
    /// No built-in object and no file has the name that was given.
    #[error(
        "{name}: neither a built-in object ({built_in}) nor an existing file; give one of those names or the path \
        of a .obj, .stl, .ply, .off, .glb, .gltf or .dae file"
    )]
    UnknownObject {
        /// The name.
        name: String,
        /// Names of the built-in objects.
        built_in: String,
    },
    /// A file that cannot be read.
    #[error("{path}: cannot be read: {source}; check the path and its permissions")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file that cannot be written.
    #[error(
        "{path}: cannot be written: {source}; check that its folder exists, is writable and not full"
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file of another project's grasps that is not as that project writes it.
    #[error(
        "{path}: {fault}; give an array of dictionaries with `qpos` (a number for each joint, WRJTx to WRJTz and \
        WRJRx to WRJRz for the wrist) and `scale`, as DexGraspNet saves them"
    )]
    ParseGrasps {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
    },
    /// A line that is no grasp record.
    #[error("{path}{}: {fault}; each line must be one {SCHEMA} record", at_line(*line))]
    ParseRecord {
        /// The file.
        path: PathBuf,
        /// Line number from 1; 0 for the file as a whole.
        line: usize,
        /// What is wrong.
        fault: String,
    },
    /// A record whose content makes no sense.
    #[error("grasp {index} cannot be used: {fault}; correct the record or leave it out")]
    InvalidRecord {
        /// The record's index.
        index: usize,
        /// What is wrong.
        fault: String,
    },
    /// An optimisation whose numbers left the range of floats.
    #[error(
        "grasp {index}: the optimisation diverged to numbers that are not finite; lower the learning rates or the \
        stiffness"
    )]
    Diverged {
        /// The start's index.
        index: usize,
    },
    /// A file that is no TOML.
    #[error("{path}{}: {fault}; write it as `graspd config show --toml` does", at_line(*line))]
    ParseConfiguration {
        /// The file.
        path: PathBuf,
        /// Line number from 1; 0 for the file as a whole.
        line: usize,
        /// What is wrong.
        fault: String,
    },
    /// A key that no setting has.
    #[error(
        "{origin}: there is no setting `{key}`; did you mean `{nearest}`? (`graspd config show` lists all)"
    )]
    UnknownKey {
        /// The file or flag.
        origin: String,
        /// The key.
        key: String,
        /// The setting whose key is most like it.
        nearest: String,
    },
    /// A value that its setting cannot have.
    #[error("{origin}: `{key}`: {fault}; `graspd config show` tells what it usually is")]
    BadConfiguration {
        /// The file or flag.
        origin: String,
        /// The key.
        key: String,
        /// What is wrong.
        fault: String,
    },
    /// A manifest of a batch that cannot be followed.
    #[error("{path}: {fault}; correct the manifest (docs/guides/datasets.md)")]
    Manifest {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
    },
    /// A folder that another process writes to.
    #[error("{path}: {what}; wait for it to end, or choose another folder with -o")]
    Locked {
        /// The folder.
        path: PathBuf,
        /// Who is at it.
        what: String,
    },
    /// A folder with a batch that has been begun.
    #[error(
        "{path}: a batch has been begun there; go on with it with --resume, or choose another folder with -o"
    )]
    BatchExists {
        /// The folder.
        path: PathBuf,
    },
    /// A folder with another batch.
    #[error(
        "{path}: this batch is another one: `{key}` differs; make the manifest and the flags as they were, or \
        choose another folder with -o"
    )]
    BatchDiffers {
        /// The folder's `batch.toml`.
        path: PathBuf,
        /// What differs.
        key: String,
    },
    /// The worker threads.
    #[error("cannot start the worker threads: {0}; try fewer with --threads")]
    Threads(String),
}

fn at_line(line: usize) -> String {
    if line == 0 {
        String::new()
    } else {
        format!(", line {line}")
    }
}
