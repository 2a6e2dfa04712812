//! CSV: joint positions in the order of the URDF.

use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use graspd::{GraspRecord, RecordedPose, named_joints, write_atomically};

use super::source::{GraspSource, sanitised};

/// One table for each hand; three rows for each grasp that has a pre-grasp and a squeeze. Poses map hand-base
/// coordinates into the object's.
pub(super) fn write(source: &mut GraspSource<'_>, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut tables: BTreeMap<String, String> = BTreeMap::new();
    for number in 0..source.len() {
        let run = source.run(number)?;
        let hand = source.hand(&run)?;
        let names = hand.articulation_names();
        let table = tables
            .entry(hand.name().to_owned())
            .or_insert_with(|| header(names));
        for record in &run.records {
            let pose = record
                .hand_pose(names)
                .with_context(|| source.context(&run, record))?;
            let grasp = named_joints(names, &pose.articulation);
            let mut rows = Vec::new();
            if let Some(before) = &record.pre_grasp {
                rows.push(("pre_grasp", &before.pose, &before.joints_rad));
            }
            rows.push(("grasp", &record.pose, &grasp));
            if let Some(after) = &record.squeeze {
                rows.push(("squeeze", &record.pose, &after.joints_rad));
            }
            for (stage, pose, joints) in rows {
                *table += &row(run.name.as_deref(), record, stage, pose, joints, names);
            }
        }
    }
    let mut written = Vec::new();
    let mut taken = HashSet::new();
    for (hand, table) in &tables {
        let mut name = format!("joints_{}.csv", sanitised(hand));
        if !taken.insert(name.clone()) {
            name = format!("joints_{}_{}.csv", sanitised(hand), taken.len());
        }
        let path = folder.join(name);
        write_atomically(&path, table.as_bytes())?;
        written.push(path);
    }
    Ok(written)
}

fn header(joints: &[String]) -> String {
    let fixed = "run,object,object_scale,hand,seed,index,rank,stage,x_m,y_m,z_m,qw,qx,qy,qz";
    let joints: Vec<String> = joints.iter().map(|name| quoted(name)).collect();
    format!("{fixed},{}\n", joints.join(","))
}

fn row(
    run: Option<&str>,
    record: &GraspRecord,
    stage: &str,
    pose: &RecordedPose,
    joints: &BTreeMap<String, f64>,
    names: &[String],
) -> String {
    let mut cells = vec![
        quoted(run.unwrap_or_default()),
        quoted(record.object_path.as_ref().unwrap_or(&record.object)),
        record.object_scale.to_string(),
        quoted(&record.hand),
        record
            .seed
            .map_or_else(String::new, |seed| seed.to_string()),
        record.index.to_string(),
        record
            .rank
            .map_or_else(String::new, |rank| rank.to_string()),
        stage.to_owned(),
    ];
    let numbers = pose.translation_m.iter().chain(&pose.rotation_wxyz);
    cells.extend(numbers.map(f64::to_string));
    let joint = |name| joints.get(name).map_or_else(String::new, f64::to_string);
    cells.extend(names.iter().map(joint));
    cells.join(",") + "\n"
}

/// A cell, in quotes where it needs them.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_quoted_where_they_must_be() {
        assert_eq!(quoted("joint_0.0"), "joint_0.0");
        assert_eq!(quoted("a,b \"c\""), "\"a,b \"\"c\"\"\"");
    }
}
