//! What the page of a run holds.

use anyhow::Result;
use graspd::{GraspRecord, PressingContact, pressing_contacts};
use graspd_eval::Metric;
use graspd_geom::Quaternion;
use graspd_hand::{Hand, HandPose};
use graspd_view::{
    ContactForce, GraspPage, Keyframe, LossName, MetricColumn, Optimization, PageGrasp, page_html,
};
use rayon::prelude::*;

use super::Subject;

/// Columns of `losses` in `trajectory.npz`, and their units.
pub(super) const LOSSES: [(&str, &str); 5] = [
    ("physics", "N²"),
    ("task", ""),
    ("range", "rad²"),
    ("limit", "rad²"),
    ("intersection", "m²"),
];
/// Sum of the contact forces where a record does not tell its squeeze's \[N\].
const FORCE: f64 = 10.0;
/// Poses from one station of the way to the next, without the last.
const WAY_POINTS: usize = 8;

/// The page of the first `count` grasps.
pub(super) fn html(subject: &Subject, count: usize) -> Result<String> {
    let records = &subject.records[..count];
    let mut columns = Metric::columns();
    columns.retain(|column| {
        let metrics = records.iter().filter_map(|record| record.metrics.as_ref());
        metrics.filter_map(column.get).next().is_some()
    });
    let grasps = (0..count)
        .into_par_iter()
        .map(|place| grasp(subject, place, &columns))
        .collect::<Result<Vec<_>>>()?;
    let page = GraspPage {
        object_name: subject.object.name.clone(),
        object: &subject.object.mesh,
        hand: subject.hand.as_ref(),
        facts: facts(subject, count),
        columns: (columns.iter())
            .map(|metric| MetricColumn {
                label: metric.label.into(),
                unit: metric.unit.into(),
                about: metric.about.into(),
                digits: metric.digits,
            })
            .collect(),
        loss_names: (LOSSES.iter())
            .map(|(label, unit)| LossName {
                label: (*label).into(),
                unit: (*unit).into(),
            })
            .collect(),
        grasps,
    };
    Ok(page_html(&page)?)
}

/// What holds for all grasps.
fn facts(subject: &Subject, count: usize) -> Vec<(String, String)> {
    let records = &subject.records;
    let total = records.len();
    let mut facts = vec![(
        "grasps".to_owned(),
        if count == total {
            total.to_string()
        } else {
            format!("{count} best of {total}")
        },
    )];
    let mut add = |label: &str, value: Option<String>| {
        facts.extend(value.map(|value| (label.to_owned(), value)));
    };
    let first = &records[0];
    let preset = first.optimizer.as_ref();
    add("preset", preset.map(|end| end.preset.clone()));
    add("steps", preset.map(|end| end.steps.to_string()));
    add("seed", first.seed.map(|seed| seed.to_string()));
    add("object file", subject.object.path_text());
    add("object repaired:", subject.object.repair_name());
    let engine = first.metrics.as_ref();
    add("engine", engine.and_then(|m| m.sim_engine.clone()));
    facts
}

fn grasp(subject: &Subject, place: usize, columns: &[&Metric]) -> Result<PageGrasp> {
    let (record, pose) = (&subject.records[place], &subject.poses[place]);
    let metrics = record.metrics.as_ref();
    let contacts = contacts(subject, place);
    let mut details = details(record);
    details.insert(0, ("pressing contacts".into(), contacts.len().to_string()));
    Ok(PageGrasp {
        rank: record.rank,
        index: record.index,
        metrics: (columns.iter())
            .map(|column| metrics.and_then(column.get))
            .collect(),
        details,
        motion: keyframes(record, subject.hand.as_ref(), pose)?,
        contacts: contacts.iter().map(contact_force).collect(),
        optimization: optimization(subject, place),
    })
}

/// The contacts of a grasp, at the force of its squeeze.
pub(super) fn contacts(subject: &Subject, place: usize) -> Vec<PressingContact> {
    let record = &subject.records[place];
    let force = record.squeeze.as_ref().and_then(|squeeze| squeeze.force_n);
    pressing_contacts(
        subject.hand.as_ref(),
        &subject.distance,
        &subject.poses[place],
        force.filter(|force| *force > 0.0).unwrap_or(FORCE),
    )
}

/// A contact as pictures take it.
pub(crate) fn contact_force(contact: &PressingContact) -> ContactForce {
    ContactForce {
        position: contact.position.into(),
        force: contact.force.into(),
    }
}

/// The recorded optimisation and, at its end, the grasp that came of it.
pub(super) fn optimization(subject: &Subject, place: usize) -> Option<Optimization> {
    let record = &subject.records[place];
    let mut optimization = subject.trajectories.of(record.index)?.clone();
    let last = optimization.steps.last().copied().unwrap_or(0);
    let end = record
        .optimizer
        .as_ref()
        .map_or(last + 1, |end| end.steps as u64);
    optimization.steps.push(end.max(last + 1));
    optimization.poses.push(subject.poses[place].clone());
    Some(optimization)
}

/// The way from pre-grasp to squeeze, as far as the record has it.
pub(super) fn keyframes(
    record: &GraspRecord,
    hand: &dyn Hand,
    grasp: &HandPose,
) -> Result<Vec<Keyframe>> {
    let names = hand.articulation_names();
    let mut way = Vec::new();
    if let Some(before) = record.pre_grasp_pose(names)? {
        let order = record.pre_grasp.as_ref().and_then(|p| p.order.as_deref());
        let base_first = order == Some("approach_then_close");
        for point in 0..2 * WAY_POINTS {
            let time = point as f64 / (2 * WAY_POINTS) as f64;
            let [base, joints] = if base_first {
                [(2.0 * time).min(1.0), (2.0 * time - 1.0).max(0.0)]
            } else {
                [time; 2]
            };
            let pose = between(&before, grasp, base, joints);
            way.push(Keyframe { time, pose });
        }
    }
    way.push(Keyframe {
        time: 1.0,
        pose: grasp.clone(),
    });
    if let Some(after) = record.squeeze_pose(names)? {
        for point in 1..=WAY_POINTS / 2 {
            let share = point as f64 / (WAY_POINTS / 2) as f64;
            way.push(Keyframe {
                time: 1.0 + share,
                pose: between(grasp, &after, share, share),
            });
        }
    }
    Ok(way)
}

/// The hand with a share `base` of the way of its base and a share `joints` of that of its joints behind it.
fn between(from: &HandPose, to: &HandPose, base: f64, joints: f64) -> HandPose {
    let (a, b) = (from.rotation, to.rotation);
    let is_opposite = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0;
    let sign = if is_opposite { -1.0 } else { 1.0 };
    let mix = |a: f64, b: f64| a + base * (sign * b - a);
    HandPose {
        translation: from.translation + (to.translation - from.translation) * base,
        rotation: Quaternion {
            w: mix(a.w, b.w),
            x: mix(a.x, b.x),
            y: mix(a.y, b.y),
            z: mix(a.z, b.z),
        }
        .normalize(),
        articulation: (from.articulation.iter().zip(&to.articulation))
            .map(|(from, to)| from + joints * (to - from))
            .collect(),
    }
}

/// What else a record tells.
fn details(record: &GraspRecord) -> Vec<(String, String)> {
    let mut details = Vec::new();
    let mut add = |label: &str, value: Option<String>| {
        details.extend(value.map(|value| (label.to_owned(), value)));
    };
    if let Some(before) = &record.pre_grasp {
        let clearance = before.clearance_m;
        add(
            "pre-grasp clearance",
            clearance.map(|m| format!("{:.1} mm", 1000.0 * m)),
        );
        let word = |is_free| if is_free { "free" } else { "collides" };
        add("way to the grasp", before.is_free.map(|f| word(f).into()));
    }
    let squeeze = record.squeeze.as_ref().and_then(|s| s.force_n);
    add("squeeze force", squeeze.map(|n| format!("{n:.1} N")));
    if let Some(end) = &record.optimizer {
        let held = if end.task_satisfied {
            "holds"
        } else {
            "broken"
        };
        add("task constraint", Some(held.into()));
        for (label, value, unit) in [
            ("L_phys", end.l_phys, "N²"),
            ("L_task", end.l_task, ""),
            ("L_range", end.l_range, "rad²"),
            ("L_limit", end.l_limit, "rad²"),
            ("L_inter", end.l_inter, "m²"),
        ] {
            add(label, Some(format!("{value:.3e} {unit}").trim_end().into()));
        }
    }
    if let Some(metrics) = &record.metrics {
        let displacement = metrics.sim_displacement_mean6_cm;
        add(
            "SD, mean of 6",
            displacement.map(|cm| format!("{cm:.2} cm")),
        );
        add("epsilon is 0:", metrics.epsilon_reason.clone());
    }
    add(
        "made in",
        (record.seconds).map(|s| format!("{:.2} s", s.synthesis + s.evaluation)),
    );
    details
}
