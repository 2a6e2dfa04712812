//! What a run leaves in its folder.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use graspd::{
    ExecutionSettings, Grasp, GraspRecord, Summary, SynthesisSettings, TrajectoryPoint,
    write_atomically, write_records,
};
use graspd_geom::TriangleMesh;
use graspd_hand::{Hand, SkinOptions};
use graspd_mesh::{RepairReport, save_obj};
use ndarray::{Array1, Array2};
use serde::Serialize;

/// `run.toml`: everything that a run depends on.
#[derive(Serialize)]
pub(crate) struct RunDescription<'a> {
    pub(crate) graspd_version: &'static str,
    pub(crate) record_schema: &'static str,
    pub(crate) object: &'a str,
    pub(crate) object_scale: f64,
    pub(crate) hand: &'a str,
    pub(crate) hand_mirrored: bool,
    /// Where a URDF's meshes were looked for.
    pub(crate) package_paths: &'a [PathBuf],
    pub(crate) seed: u64,
    pub(crate) grasps: usize,
    /// How many of them are kept; absent where all are.
    pub(crate) top_k: Option<usize>,
    pub(crate) sdf_resolution: usize,
    pub(crate) sdf_padding_m: f64,
    pub(crate) machine: Machine,
    /// Of skinned hands, what they were made with where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) hand_skin: Option<&'a SkinOptions>,
    /// What was done to close the object's surface; absent where nothing was. All else is about the repaired surface.
    pub(crate) object_repair: Option<RepairOutcome>,
    pub(crate) settings: &'a SynthesisSettings,
    pub(crate) execution: &'a ExecutionSettings,
    pub(crate) evaluation: &'a graspd_eval::EvaluationSettings,
}

/// What a repair did, as files have it. Lengths in metres, areas in m^2.
#[derive(Serialize)]
pub(crate) struct RepairOutcome {
    /// `untouched`, `mended` or `resurfaced`.
    tier: &'static str,
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

impl RepairOutcome {
    pub(crate) fn of(report: &RepairReport) -> Self {
        let diameters = report.holes.iter().map(|hole| hole.diameter);
        Self {
            tier: report.tier.name(),
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

/// Where a run was made.
#[derive(Serialize)]
pub(crate) struct Machine {
    pub(crate) os: &'static str,
    pub(crate) arch: &'static str,
    /// Cores that the program may use; absent where the system does not tell.
    pub(crate) cores: Option<usize>,
    pub(crate) threads: usize,
}

/// Makes the folder and tries to write in it, so that a mistaken path is found before the work and not after.
pub(crate) fn prepare_folder(folder: &Path) -> Result<()> {
    let probe = folder.join(format!(".graspd.{}.probe", std::process::id()));
    std::fs::create_dir_all(folder)
        .and_then(|()| try_to_write(&probe))
        .map_err(|error| {
            anyhow!(
                "{}: cannot write into this folder: {error}; choose another one with -o",
                folder.display()
            )
        })
}

/// Tries to write beside a file that is to be written, for the same reason; `flag` is the option that names it.
pub(crate) fn prepare_file(file: &Path, flag: &str) -> Result<()> {
    let name = file.file_name().unwrap_or_default();
    if name.is_empty() || file.is_dir() {
        bail!(
            "{}: this is a folder, not a file; add a file name to {flag}",
            file.display()
        );
    }
    let mut probe = name.to_owned();
    probe.push(format!(".{}.probe", std::process::id()));
    try_to_write(&file.with_file_name(probe)).map_err(|error| {
        anyhow!(
            "{}: cannot be written: {error}; name a file in a folder that exists and is writable with {flag}",
            file.display()
        )
    })
}

fn try_to_write(probe: &Path) -> std::io::Result<()> {
    std::fs::write(probe, b"")?;
    std::fs::remove_file(probe)
}

/// Removes what an earlier run with other options left in the folder and this run is not going to replace: poses
/// and trajectories that do not belong to the grasps beside them.
pub(crate) fn remove_leftovers(folder: &Path) -> Result<()> {
    let mut leftovers = vec![folder.join("trajectory.npz")];
    // Where there are no meshes, there are none left over.
    for entry in std::fs::read_dir(folder.join("meshes"))
        .into_iter()
        .flatten()
    {
        let entry = entry.with_context(|| format!("cannot list {}", folder.display()))?;
        let name = entry.file_name();
        let number = name
            .to_str()
            .and_then(|name| name.strip_suffix("_hand.obj"));
        let is_hand = number.is_some_and(|n| n.len() >= 3 && n.bytes().all(|b| b.is_ascii_digit()));
        if is_hand || name == "object.obj" {
            leftovers.push(entry.path());
        }
    }
    for file in leftovers {
        match std::fs::remove_file(&file) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => bail!(
                "{}: left by an earlier run, and cannot be removed: {error}; choose another output folder with -o",
                file.display()
            ),
            _ => {}
        }
    }
    Ok(())
}

/// Writes `run.toml`.
pub(crate) fn write_run(folder: &Path, run: &RunDescription<'_>) -> Result<()> {
    let text = toml::to_string(run).context("run.toml")?;
    Ok(write_atomically(&folder.join("run.toml"), text.as_bytes())?)
}

/// Writes `grasps.jsonl` and `summary.json`.
pub(crate) fn write_results(
    folder: &Path,
    records: &[GraspRecord],
    summary: &Summary,
) -> Result<()> {
    write_records(&folder.join("grasps.jsonl"), records)?;
    let text = serde_json::to_string_pretty(summary).context("summary.json")?;
    Ok(write_atomically(
        &folder.join("summary.json"),
        text.as_bytes(),
    )?)
}

/// Writes the posed hands and the object as closed OBJ files in the object frame.
pub(crate) fn write_meshes(
    folder: &Path,
    object: &TriangleMesh,
    hand: &dyn Hand,
    grasps: &[Grasp],
) -> Result<()> {
    let folder = folder.join("meshes");
    prepare_folder(&folder)?;
    save_obj(object, folder.join("object.obj"))?;
    for grasp in grasps {
        let name = format!("{:03}_hand.obj", grasp.record.index);
        save_obj(&hand.surface(&grasp.pose), folder.join(name))?;
    }
    Ok(())
}

/// Writes `trajectory.npz`: `index` \[m\], `step` \[m\], `translation_m` \[m, 3\], `rotation_wxyz` \[m, 4\],
/// `articulation` \[m, n\], `losses` \[m, 5\] (physics, task, range, limit, intersection).
pub(crate) fn write_trajectories(folder: &Path, grasps: &[Grasp]) -> Result<()> {
    let points: Vec<(usize, &TrajectoryPoint)> = (grasps.iter())
        .flat_map(|grasp| {
            grasp
                .trajectory
                .iter()
                .map(|point| (grasp.record.index, point))
        })
        .collect();
    let joints = points
        .first()
        .map_or(0, |(_, point)| point.pose.articulation.len());
    let index = Array1::from_iter(points.iter().map(|(index, _)| *index as u64));
    let step = Array1::from_iter(points.iter().map(|(_, point)| point.step as u64));
    let matrix = |columns: usize, row: &dyn Fn(&TrajectoryPoint) -> Vec<f64>| {
        let values = points.iter().flat_map(|(_, point)| row(point)).collect();
        Array2::from_shape_vec((points.len(), columns), values).context("trajectory.npz")
    };
    let translation = matrix(3, &|point| {
        let t = point.pose.translation;
        vec![t.x, t.y, t.z]
    })?;
    let rotation = matrix(4, &|point| {
        let q = point.pose.rotation;
        vec![q.w, q.x, q.y, q.z]
    })?;
    let articulation = matrix(joints, &|point| point.pose.articulation.clone())?;
    let losses = matrix(5, &|point| {
        let l = point.losses;
        vec![l.physics, l.task, l.range, l.limit, l.intersection]
    })?;
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut npz = ndarray_npy::NpzWriter::new_compressed(&mut bytes);
    npz.add_array("index", &index)?;
    npz.add_array("step", &step)?;
    npz.add_array("translation_m", &translation)?;
    npz.add_array("rotation_wxyz", &rotation)?;
    npz.add_array("articulation", &articulation)?;
    npz.add_array("losses", &losses)?;
    npz.finish()?;
    Ok(write_atomically(
        &folder.join("trajectory.npz"),
        bytes.get_ref(),
    )?)
}
