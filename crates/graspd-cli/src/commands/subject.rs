//! Which hand, poses and object grasp records speak of.

use std::path::Path;

use anyhow::{Context, Result, bail};
use graspd::{GraspRecord, NamedMesh, RunDescription};
use graspd_hand::{Hand, HandPose, LoadOptions, load_hand, load_hand_from};

use super::input::{RepairChoice, load_object};
use crate::console::warn;

/// Joints may lie this far beyond their limits without a word \[rad or m\]: rounding, and optimisers that treat
/// limits as soft.
const LIMIT_TOLERANCE: f64 = 0.1;

/// Shape parameters that differ by less are rounded ones \[standard deviations\].
const SHAPE_TOLERANCE: f64 = 1e-3;

/// Each scale of an object is an object of its own, decomposed and kept in memory.
const MAX_SCALES: usize = 32;

/// Loads the hand that is asked for, or else the one that the records name.
pub(crate) fn hand_of(
    records: &[GraspRecord],
    file: &Path,
    asked: Option<&str>,
    options: &LoadOptions,
    quiet: bool,
) -> Result<Box<dyn Hand>> {
    if let Some(asked) = asked {
        let hand = load_hand_from(asked, options)?;
        if let Some(other) = records.iter().find(|record| record.hand != hand.name()) {
            let (asked, made_for) = (hand.name(), &other.hand);
            let text = format!(
                "{}: made for `{made_for}`, judged as `{asked}`",
                file.display()
            );
            warn(quiet, &text);
        }
        return Ok(hand);
    }
    let name = common(file, records, "hand", |record| record.hand.clone())?;
    // A record has the hand's name, but not its file; the run that made the record told that.
    if let Some((recorded, options)) = recorded_hand(file, options) {
        match load_hand_from(&recorded, &options) {
            Ok(hand) if hand.name() == name => return Ok(hand),
            Err(error) if Path::new(&recorded).exists() => return Err(error.into()),
            _ => {}
        }
    }
    load_hand(&name).with_context(|| {
        format!(
            "{}: cannot load the hand of these grasps; name its file with --hand",
            file.display()
        )
    })
}

/// Returns the hand that `run.toml` beside the records names, and how it was loaded, with the given folders first.
fn recorded_hand(records: &Path, given: &LoadOptions) -> Option<(String, LoadOptions)> {
    let run = RunDescription::beside(records)?;
    let mut options = given.clone();
    options.mirrored = run.hand_mirrored;
    options.skin = run.hand_skin.unwrap_or_default();
    options.package_paths.extend(run.package_paths);
    Some((run.hand, options))
}

/// Returns the hand's poses; warns of the first joint that the hand lacks, and of the first beyond its limits.
pub(crate) fn poses_of(
    records: &[GraspRecord],
    file: &Path,
    hand: &dyn Hand,
    quiet: bool,
) -> Result<Vec<HandPose>> {
    let names = hand.articulation_names();
    let poses = records.iter().map(|record| record.hand_pose(names));
    let poses = poses
        .collect::<Result<Vec<_>, _>>()
        .with_context(|| file.display().to_string())?;
    let doubts = [
        records.iter().find_map(|record| other_shape(record, hand)),
        records.iter().find_map(|record| unused_joint(record, hand)),
        records
            .iter()
            .zip(&poses)
            .find_map(|(record, pose)| joint_beyond_limits(record, pose, hand)),
    ];
    for doubt in doubts.iter().flatten() {
        let file = file.display();
        warn(
            quiet,
            &format!("{file}: {doubt}; there may be more of the kind"),
        );
    }
    Ok(poses)
}

/// Grasps of a skinned hand tell the shape that it had, which only the run's `run.toml` or a flag gives the loader.
fn other_shape(record: &GraspRecord, hand: &dyn Hand) -> Option<String> {
    let recorded = record.mano.as_ref()?.get("shape")?.as_array()?;
    let own = hand.shape_parameters()?;
    let value = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(0.0);
    let recorded: Vec<f64> = recorded.iter().filter_map(|x| x.as_f64()).collect();
    let is_same = (0..recorded.len().max(own.len()))
        .all(|k| (value(&recorded, k) - value(own, k)).abs() < SHAPE_TOLERANCE);
    let index = record.index;
    (!is_same).then(|| {
        format!(
            "grasp {index}: made by a hand of the shape {recorded:?}, but this one has {own:?}; give that with \
             --hand-shape, or keep the run's run.toml beside the grasps"
        )
    })
}

fn unused_joint(record: &GraspRecord, hand: &dyn Hand) -> Option<String> {
    let mut joints = record.joints_rad.iter().flatten();
    let (unused, _) = joints.find(|(name, _)| !hand.articulation_names().contains(name))?;
    let (index, hand) = (record.index, hand.name());
    Some(format!(
        "grasp {index}: `{hand}` has no joint `{unused}` that could be set; ignored"
    ))
}

fn joint_beyond_limits(record: &GraspRecord, pose: &HandPose, hand: &dyn Hand) -> Option<String> {
    let names = hand.articulation_names();
    let mut joints = names.iter().zip(&pose.articulation).zip(hand.limits()?);
    let ((name, value), limit) = joints.find(|((_, value), limit)| {
        **value < limit.lower - LIMIT_TOLERANCE || **value > limit.upper + LIMIT_TOLERANCE
    })?;
    let (index, lower, upper) = (record.index, limit.lower, limit.upper);
    Some(format!(
        "grasp {index}: joint `{name}` is {value}, but its limits are {lower} to {upper}; joints are in radians"
    ))
}

/// Loads the object that is asked for, or else that the records name, at each of the records' scales (or the one
/// asked for).
pub(crate) fn objects_of(
    records: &[GraspRecord],
    file: &Path,
    asked: Option<&str>,
    scale: Option<f64>,
    repair: &RepairChoice,
    quiet: bool,
) -> Result<Vec<NamedMesh>> {
    let mut scales: Vec<f64> = Vec::new();
    for record in records {
        let scale = scale.unwrap_or(record.object_scale);
        if !scales.contains(&scale) {
            scales.push(scale);
        }
    }
    if scales.len() > MAX_SCALES {
        bail!(
            "{}: the grasps are for {} scales of the object, more than {MAX_SCALES}; evaluate them in parts, or set \
             --scale",
            file.display(),
            scales.len()
        );
    }
    let at = |name: &str, scale: f64| load_object(name, scale, repair, quiet);
    if let Some(asked) = asked {
        return scales.iter().map(|&scale| at(asked, scale)).collect();
    }
    let name = common(file, records, "object", |record| {
        let path = record.object_path.as_ref();
        path.unwrap_or(&record.object).clone()
    })?;
    let load = |&scale: &f64| {
        at(&name, scale).with_context(|| {
            format!(
                "{}: cannot load the object of these grasps; name its mesh with --object",
                file.display()
            )
        })
    };
    scales.iter().map(load).collect()
}

/// Returns what all records agree on.
fn common<T: PartialEq + std::fmt::Display>(
    file: &Path,
    records: &[GraspRecord],
    what: &str,
    of: impl Fn(&GraspRecord) -> T,
) -> Result<T> {
    let mut values = records.iter().map(of);
    let first = values.next().context("there are no grasps")?;
    if let Some(other) = values.find(|value| *value != first) {
        bail!(
            "{}: the grasps are for more than one {what} ({first}, {other}); evaluate them one at a time, or set \
             --{what}",
            file.display()
        );
    }
    Ok(first)
}
