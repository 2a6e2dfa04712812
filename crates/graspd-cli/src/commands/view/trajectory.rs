//! `trajectory.npz` read back: the poses along the optimisations, and the losses there.

use std::collections::HashMap;
use std::fs::File;
use std::path::Path;

use anyhow::{Context, Result, bail};
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::HandPose;
use graspd_view::Optimization;
use ndarray::{Array1, Array2};
use ndarray_npy::{NpzReader, ReadableElement};

/// The optimisations of a run by the index of their grasp.
#[derive(Default)]
pub(super) struct Trajectories {
    by_index: HashMap<usize, Optimization>,
}

impl Trajectories {
    /// Reads the file beside these records; none is none.
    ///
    /// # Errors
    /// If the file cannot be read, or is not about a hand of so many joints.
    pub(super) fn beside(records: &Path, joints: usize) -> Result<Self> {
        let path = records.with_file_name("trajectory.npz");
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(Self::default());
            }
            Err(error) => return Err(error).with_context(|| hint(&path)),
        };
        read(file, joints).with_context(|| hint(&path))
    }

    pub(super) fn of(&self, index: usize) -> Option<&Optimization> {
        self.by_index.get(&index)
    }
}

fn hint(path: &Path) -> String {
    format!(
        "{}: cannot be read as the trajectory of these grasps; remove it, or make it again with graspd synth \
        --trajectory",
        path.display()
    )
}

fn read(file: File, joints: usize) -> Result<Trajectories> {
    let mut npz = NpzReader::new(file)?;
    let index: Array1<u64> = column(&mut npz, "index")?;
    let rows = index.len();
    let step: Array1<u64> = column(&mut npz, "step")?;
    if step.len() != rows {
        bail!("`step` has {} rows, `index` has {rows}", step.len());
    }
    let mut matrix = |name: &str, columns: usize| -> Result<Array2<f64>> {
        let values: Array2<f64> = npz
            .by_name(name)
            .with_context(|| format!("array `{name}`"))?;
        if values.dim() != (rows, columns) {
            bail!("`{name}` is {:?}, not {rows} x {columns}", values.dim());
        }
        Ok(values)
    };
    let translation = matrix("translation_m", 3)?;
    let rotation = matrix("rotation_wxyz", 4)?;
    let articulation = matrix("articulation", joints)?;
    let losses = matrix("losses", super::page::LOSSES.len())?;

    let mut by_index: HashMap<usize, Optimization> = HashMap::new();
    for row in 0..rows {
        let (t, q) = (translation.row(row), rotation.row(row));
        let pose = HandPose {
            translation: Vec3::new(t[0], t[1], t[2]),
            rotation: Quaternion {
                w: q[0],
                x: q[1],
                y: q[2],
                z: q[3],
            }
            .normalize(),
            articulation: articulation.row(row).to_vec(),
        };
        let q = pose.rotation;
        let base = [t[0], t[1], t[2], q.w, q.x, q.y, q.z];
        let is_finite = |number: &f64| number.is_finite();
        if !(base.iter().all(is_finite) && pose.articulation.iter().all(is_finite)) {
            bail!("row {row} has a number that is not finite, or a zero quaternion");
        }
        let grasp = by_index.entry(index[row] as usize).or_default();
        if grasp.steps.last().is_some_and(|last| *last >= step[row]) {
            bail!("the steps of grasp {} do not increase", index[row]);
        }
        grasp.steps.push(step[row]);
        grasp.poses.push(pose);
        grasp.losses.push(losses.row(row).to_vec());
    }
    Ok(Trajectories { by_index })
}

fn column<T: ReadableElement>(npz: &mut NpzReader<File>, name: &str) -> Result<Array1<T>> {
    npz.by_name(name).with_context(|| format!("array `{name}`"))
}
