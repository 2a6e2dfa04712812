//! `.npy` files in the layout of DexGraspNet: for each object an array of dictionaries.
//!
//! `qpos` has the joints by name, the base's translation as `WRJTx`, `WRJTy`, `WRJTz` \[m\] and its rotation as the
//! Euler angles `WRJRx`, `WRJRy`, `WRJRz` \[rad\] about fixed axes (`sxyz` of transforms3d); `scale` is what the
//! object's mesh is multiplied by.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use graspd::{GraspRecord, write_atomically};
use graspd_eval::{Metric, MetricKind};
use graspd_hand::HandPose;
use nalgebra::UnitQuaternion;

use super::super::output::prepare_folder;
use super::pickle::{Python, npy_of_objects};
use super::source::{GraspSource, sanitised};

/// `FOLDER/HAND/OBJECT.npy`; objects of the same name from different files are told apart by a number.
pub(super) fn write(source: &mut GraspSource<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut groups: BTreeMap<PathBuf, Vec<Python>> = BTreeMap::new();
    // The files of the objects of each name.
    let mut origins: HashMap<String, Vec<Option<String>>> = HashMap::new();
    for number in 0..source.len() {
        let run = source.run(number)?;
        let hand = source.hand(&run)?;
        for record in &run.records {
            let names = hand.articulation_names();
            let pose = record
                .hand_pose(names)
                .with_context(|| source.context(&run, record))?;
            let seen = origins.entry(sanitised(&record.object)).or_default();
            let place = seen
                .iter()
                .position(|path| *path == record.object_path)
                .unwrap_or_else(|| {
                    seen.push(record.object_path.clone());
                    seen.len() - 1
                });
            let object = sanitised(&record.object);
            let file = match place {
                0 => format!("{object}.npy"),
                more => format!("{object}_{more}.npy"),
            };
            let path = folder.join(sanitised(hand.name())).join(file);
            groups
                .entry(path)
                .or_default()
                .push(dictionary(record, &pose, names));
        }
    }
    for (path, values) in &groups {
        prepare_folder(path.parent().unwrap_or(folder))?;
        write_atomically(path, &npy_of_objects(values))?;
    }
    Ok(groups.into_keys().collect())
}

/// Metrics without an entry.
const LEFT_OUT: [&str; 5] = [
    "contact_area_voxel_count_cm2",
    "ca_over_iv",
    "sim_displacement_mean6_cm",
    "shake_withstood",
    "self_penetration_mm",
];

fn dictionary(record: &GraspRecord, pose: &HandPose, names: &[String]) -> Python {
    let text = |text: &str| Python::Text(text.to_owned());
    let mut items = vec![
        ("scale".to_owned(), Python::Float(record.object_scale)),
        ("qpos".to_owned(), qpos(pose, names)),
        (
            "object".to_owned(),
            text(record.object_path.as_ref().unwrap_or(&record.object)),
        ),
        ("hand".to_owned(), text(&record.hand)),
        ("index".to_owned(), Python::Int(record.index as i64)),
    ];
    if let Some(seed) = record.seed {
        items.push(("seed".to_owned(), Python::Int(seed as i64)));
    }
    if let Some(metrics) = &record.metrics {
        let entry = |metric: &Metric| {
            let value = (metric.get)(metrics);
            let value = match metric.kind {
                MetricKind::Truth => value.map_or(Python::None, |v| Python::Bool(v != 0.0)),
                MetricKind::Count => value.map_or(Python::None, |v| Python::Int(v as i64)),
                MetricKind::Number | MetricKind::Ratio(..) => Python::from(value),
            };
            (metric.key.to_owned(), value)
        };
        let metrics_items = Metric::exported(&LEFT_OUT).into_iter().map(entry).collect();
        items.push(("metrics".to_owned(), Python::Dict(metrics_items)));
    }
    Python::Dict(items)
}

fn qpos(pose: &HandPose, names: &[String]) -> Python {
    let mut items: Vec<(String, Python)> = (names.iter().cloned())
        .zip(pose.articulation.iter().map(|value| Python::Float(*value)))
        .collect();
    let rotation: UnitQuaternion<f64> = pose.rotation.into();
    let (roll, pitch, yaw) = rotation.euler_angles();
    let t = pose.translation;
    for (name, value) in [
        ("WRJRx", roll),
        ("WRJRy", pitch),
        ("WRJRz", yaw),
        ("WRJTx", t.x),
        ("WRJTy", t.y),
        ("WRJTz", t.z),
    ] {
        items.push((name.to_owned(), Python::Float(value)));
    }
    Python::Dict(items)
}
