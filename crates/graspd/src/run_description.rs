//! `run.toml`: everything that a run depends on.

use std::num::NonZero;
use std::path::{Path, PathBuf};

use graspd_hand::SkinOptions;
use graspd_mesh::RepairReport;
use serde::{Deserialize, Serialize};

use crate::GraspError;
use crate::configuration::Configuration;
use crate::record_file::write_atomically;

const FILE_NAME: &str = "run.toml";

/// What a run was made from, as the `run.toml` beside its records tells. Keys that a file lacks have their defaults.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RunDescription {
    /// The version that made it.
    pub graspd_version: String,
    /// The layout of its records.
    pub record_schema: String,
    /// The object, by its built-in name or its file.
    pub object: String,
    /// Multiplies the object's coordinates.
    pub object_scale: f64,
    /// The hand, as a loader takes it.
    pub hand: String,
    /// Whether it is the mirror image.
    pub hand_mirrored: bool,
    /// Where a URDF's meshes were looked for.
    pub package_paths: Vec<PathBuf>,
    /// How many grasps are kept; absent where all are.
    pub top_k: Option<usize>,
    /// All numbers. `None` in a description that was read, for those of earlier versions have other keys:
    /// [`ConfigurationLayers::push_file`](crate::ConfigurationLayers::push_file) understands them.
    #[serde(flatten, skip_deserializing)]
    pub configuration: Option<Configuration>,
    /// Where the run was made; absent from the runs of a batch, which are the same on every machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub machine: Option<Machine>,
    /// Of skinned hands, what they were made with where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hand_skin: Option<SkinOptions>,
    /// What was done to close the object's surface; absent where nothing was. All else is about the repaired surface.
    pub object_repair: Option<ObjectRepair>,
}

impl RunDescription {
    /// Reads the description beside a file of records; `None` where there is none that can be read.
    pub fn beside(records: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(records.with_file_name(FILE_NAME)).ok()?;
        toml::from_str(&text).ok()
    }

    /// Writes the description into a run's folder.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), GraspError> {
        let path = folder.join(FILE_NAME);
        let text = toml::to_string(self).map_err(|error| GraspError::Write {
            path: path.clone(),
            source: std::io::Error::other(error),
        })?;
        write_atomically(&path, text.as_bytes())
    }
}

/// Where a run was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    os: String,
    arch: String,
    /// Cores that the program may use; absent where the system does not tell.
    cores: Option<usize>,
    threads: usize,
}

impl Machine {
    /// Returns this machine, with the threads of rayon's current pool.
    pub fn current() -> Self {
        Self {
            os: std::env::consts::OS.into(),
            arch: std::env::consts::ARCH.into(),
            cores: std::thread::available_parallelism().ok().map(NonZero::get),
            threads: rayon::current_num_threads(),
        }
    }
}

/// What a repair did, as files have it. Lengths in metres, areas in m^2.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ObjectRepair {
    /// `untouched`, `mended` or `resurfaced`.
    tier: String,
    summary: String,
    holes_filled: usize,
    largest_hole_m: f64,
    degenerate_faces_dropped: usize,
    repeated_faces_dropped: usize,
    vertices_welded: usize,
    vertices_split: usize,
    faces_flipped: usize,
    slivers_removed: usize,
    small_components_dropped: usize,
    inner_components_dropped: usize,
    flat_components_dropped: usize,
    /// Greatest distance found from the input to the result, and the other way.
    input_to_result_m: f64,
    result_to_input_m: f64,
    /// Of the grid, where the surface was made anew.
    #[serde(skip_serializing_if = "Option::is_none")]
    spacing_m: Option<f64>,
    thickened_fraction: f64,
}

impl From<&RepairReport> for ObjectRepair {
    fn from(report: &RepairReport) -> Self {
        let diameters = report.holes.iter().map(|hole| hole.diameter);
        Self {
            tier: report.tier.name().into(),
            summary: report.summary(),
            holes_filled: report.holes.len(),
            largest_hole_m: diameters.fold(0.0, f64::max),
            degenerate_faces_dropped: report.degenerate_dropped,
            repeated_faces_dropped: report.copies_dropped,
            vertices_welded: report.vertices_welded,
            vertices_split: report.vertices_split,
            faces_flipped: report.faces_flipped,
            slivers_removed: report.slivers_removed,
            small_components_dropped: report.small_components_dropped,
            inner_components_dropped: report.inner_components_dropped,
            flat_components_dropped: report.flat_components_dropped,
            input_to_result_m: report.input_to_result,
            result_to_input_m: report.result_to_input,
            spacing_m: report.spacing,
            thickened_fraction: report.thickened,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_a_batch_of_before_is_read() {
        let before = r#"
            graspd_version = "0.1.0"
            record_schema = "graspd.grasp/1"
            object = "pot.stl"
            object_scale = 0.5
            hand = "hand.urdf"
            hand_mirrored = true
            package_paths = ["meshes"]
            seed = 3
            grasps = 10

            [settings.conformity]
            candidates = 8
            reach = [0.05, 0.005, 0.0015, 0.002, 0.0008]

            [object_repair]
            tier = "mended"
        "#;
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(FILE_NAME), before).unwrap();
        let read = RunDescription::beside(&folder.path().join("grasps.jsonl")).unwrap();
        let expected = RunDescription {
            graspd_version: "0.1.0".into(),
            record_schema: "graspd.grasp/1".into(),
            object: "pot.stl".into(),
            object_scale: 0.5,
            hand: "hand.urdf".into(),
            hand_mirrored: true,
            package_paths: vec!["meshes".into()],
            object_repair: Some(ObjectRepair {
                tier: "mended".into(),
                ..ObjectRepair::default()
            }),
            ..RunDescription::default()
        };
        assert_eq!(read, expected);
    }

    #[test]
    fn a_description_is_read_as_written_but_for_its_numbers() {
        let written = RunDescription {
            hand: "mano.pkl".into(),
            configuration: Some(Configuration::default()),
            machine: Some(Machine::current()),
            hand_skin: Some(SkinOptions {
                shape: vec![0.5],
                ..SkinOptions::default()
            }),
            ..RunDescription::default()
        };
        let folder = tempfile::tempdir().unwrap();
        written.write(folder.path()).unwrap();
        let read = RunDescription::beside(&folder.path().join("grasps.jsonl")).unwrap();
        let expected = RunDescription {
            configuration: None,
            ..written
        };
        assert_eq!(read, expected);
    }
}
