//! What a run leaves in its folder.

use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use graspd::{Grasp, GraspRecord, Summary, TrajectoryPoint, write_atomically, write_records};
use graspd_geom::TriangleMesh;
use graspd_hand::Hand;
use graspd_mesh::save_obj;
use ndarray::{Array1, Array2};

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
