//! Grasps as PNG pictures.

use anyhow::Result;
use graspd::{GraspRecord, PressingContact};
use graspd_eval::Metric;
use graspd_view::{
    Captioned, Dot, Image, SheetGrasp, contact_dots, contact_sheet, trajectory_strip,
};
use rayon::prelude::*;

use super::Subject;
use super::page::{contact_force, contacts, keyframes, optimization};

/// Width and height of a picture of a sheet, without its caption \[px\].
const CELL: (usize, usize) = (380, 320);
/// Width and height of a picture of a strip, without its caption \[px\].
const PANEL: (usize, usize) = (300, 300);
/// Pictures of a strip.
const FRAMES: usize = 7;
/// Columns of a sheet by default, at most.
const MAX_COLUMNS: usize = 5;

/// Marks of contacts by their force.
pub(crate) fn marks(contacts: &[PressingContact]) -> Vec<Dot> {
    let contacts: Vec<_> = contacts.iter().map(contact_force).collect();
    contact_dots(&contacts)
}

/// Rank and metrics of a grasp.
pub(crate) fn caption(record: &GraspRecord) -> Captioned {
    let rank = (record.rank).map_or_else(String::new, |rank| format!("{rank}   "));
    let title = format!("{rank}grasp #{} of {}", record.index, record.object);
    let Some(metrics) = &record.metrics else {
        return Captioned {
            title,
            lines: vec!["not judged".into()],
        };
    };
    let line = |keys: &[&str]| {
        let chosen = keys.iter().filter_map(|key| Metric::named(key));
        let parts: Vec<_> = chosen
            .map(|metric| metric.describe(Some(metrics)))
            .collect();
        parts.join("  ")
    };
    let mut second = line(&["epsilon", "max_penetration_mm"]);
    if let Some(count) = metrics.shake_withstood {
        second += &format!("  shake {count}/6");
    }
    let first = [
        "sim_displacement_cm",
        "contact_area_cm2",
        "interpenetration_volume_cm3",
    ];
    let lines = vec![line(&first), second];
    Captioned { title, lines }
}

/// The first `count` grasps.
pub(super) fn sheet(subject: &Subject, count: usize, columns: Option<usize>) -> Result<Image> {
    let grasps: Vec<SheetGrasp> = (0..count)
        .into_par_iter()
        .map(|place| SheetGrasp {
            pose: subject.poses[place].clone(),
            marks: marks(&contacts(subject, place)),
            caption: caption(&subject.records[place]),
        })
        .collect();
    let columns = columns.unwrap_or_else(|| {
        let square = (count as f64).sqrt().ceil() as usize;
        // Small numbers in one row.
        if count <= MAX_COLUMNS {
            count
        } else {
            square.max(3)
        }
    });
    let (object, hand) = (&subject.object.mesh, subject.hand.as_ref());
    Ok(contact_sheet(object, hand, &grasps, columns, CELL)?)
}

/// The grasp at `place`, step by step.
pub(super) fn strip(subject: &Subject, place: usize) -> Result<Image> {
    let record = &subject.records[place];
    let times: Vec<(String, _)> = match optimization(subject, place) {
        Some(optimization) => {
            let steps = optimization.steps.iter().map(|step| format!("step {step}"));
            steps.zip(optimization.poses).collect()
        }
        None => keyframes(record, subject.hand.as_ref(), &subject.poses[place])?
            .into_iter()
            .map(|keyframe| (station(keyframe.time), keyframe.pose))
            .collect(),
    };
    let marks = marks(&contacts(subject, place));
    let frames: Vec<SheetGrasp> = (spread(times.len(), FRAMES).into_iter())
        .map(|at| {
            let (title, pose) = &times[at];
            let is_grasp = *pose == subject.poses[place];
            SheetGrasp {
                pose: pose.clone(),
                marks: if is_grasp { marks.clone() } else { Vec::new() },
                caption: Captioned {
                    title: title.clone(),
                    lines: Vec::new(),
                },
            }
        })
        .collect();
    let (object, hand) = (&subject.object.mesh, subject.hand.as_ref());
    Ok(trajectory_strip(object, hand, &frames, PANEL)?)
}

/// What a time of the execution is called.
fn station(time: f64) -> String {
    match time {
        0.0 => "pre-grasp".into(),
        1.0 => "grasp".into(),
        2.0 => "squeeze".into(),
        _ if time < 1.0 => format!("closing {:.0} %", 100.0 * time),
        _ => format!("squeezing {:.0} %", 100.0 * (time - 1.0)),
    }
}

/// At most `most` of `count` places, the first and the last among them, closer together at the start, where an
/// optimisation moves most.
fn spread(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    let last = (count - 1) as f64;
    let mut places: Vec<usize> = (0..most)
        .map(|i| (last * (i as f64 / (most - 1) as f64).powf(1.5)).round() as usize)
        .collect();
    places.dedup();
    places
}
