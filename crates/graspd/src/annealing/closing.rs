//! From a state of the search to a grasp: approach until something touches, then close each joint until it is stopped.

use graspd_geom::Vec3;
use graspd_hand::{Hand, HandPose, closing_directions};

use super::eigengrasps::Eigengrasps;
use super::probe::Probe;
use super::settings::AnnealingSettings;

/// Length of a step of the approach \[m\].
const APPROACH_STEP: f64 = 5e-4;
/// Steps in which a joint goes through its range.
const CLOSING_STEPS: usize = 150;
/// Movements that deepen or overlap by less than this are free \[m\].
const FREE: f64 = 1e-9;

/// Approaches along the palm's normal and closes.
///
/// Every joint that closes moves by small steps until it pushes a point deeper than `contact_depth`, or fingers
/// into each other, or comes to its limit; the others go on. A hand with a pose space closes along its first
/// amplitude.
///
/// # Source
/// GraspIt!'s approach-to-contact and auto-grasp: A. Miller, P. Allen, "GraspIt! A versatile simulator for robotic
/// grasping", IEEE RAM 11(4), 2004.
pub(super) fn close(
    hand: &dyn Hand,
    probe: &mut Probe<'_>,
    eigengrasps: &Eigengrasps,
    settings: &AnnealingSettings,
    start: &HandPose,
) -> HandPose {
    let mut pose = start.clone();
    approach(hand, probe, settings, &mut pose);
    let steps: Vec<Vec<f64>> = match hand.limits() {
        Some(limits) => (closing_directions(hand).iter().zip(limits).enumerate())
            .filter(|(_, (direction, _))| **direction != 0.0)
            .map(|(joint, (direction, limit))| {
                let range = limit.upper - limit.lower;
                let range = if range.is_finite() {
                    range
                } else {
                    std::f64::consts::PI
                };
                let mut step = vec![0.0; pose.articulation.len()];
                step[joint] = direction * range / CLOSING_STEPS as f64;
                step
            })
            .collect(),
        None => [-1.0, 1.0]
            .iter()
            .map(|sign| {
                let direction = &eigengrasps.directions[0];
                direction
                    .iter()
                    .map(|d| sign * 5.0 * d / CLOSING_STEPS as f64)
                    .collect()
            })
            .collect(),
    };
    let mut is_free = vec![true; steps.len()];
    if hand.limits().is_none() {
        // Only one of the two senses closes.
        is_free[opening_sense(probe, &pose, &steps)] = false;
    }
    probe.place(&pose);
    let mut excess = probe.excess(settings.contact_depth);
    let mut overlap = probe.overlap();
    for _ in 0..CLOSING_STEPS {
        for (step, is_free) in steps.iter().zip(&mut is_free) {
            if !*is_free {
                continue;
            }
            let before = pose.articulation.clone();
            for (joint, change) in pose.articulation.iter_mut().zip(step) {
                *joint += change;
            }
            let is_beyond = hand.limits().is_some_and(|limits| {
                let mut joints = pose.articulation.iter().zip(limits);
                joints.any(|(value, limit)| *value < limit.lower || *value > limit.upper)
            });
            if !is_beyond {
                probe.place(&pose);
                let (deeper, closer) = (probe.excess(settings.contact_depth), probe.overlap());
                if deeper <= excess + FREE && closer <= overlap + FREE {
                    (excess, overlap) = (deeper, closer);
                    continue;
                }
            }
            pose.articulation = before;
            *is_free = false;
        }
        if !is_free.contains(&true) {
            break;
        }
    }
    pose
}

/// Moves along the palm's normal until a point is `contact_depth` deep; not at all if none would be.
fn approach(
    hand: &dyn Hand,
    probe: &mut Probe<'_>,
    settings: &AnnealingSettings,
    pose: &mut HandPose,
) {
    let normal = (pose.rotation.to_matrix()).apply(Vec3::from(hand.palm().normal));
    let start = pose.translation;
    let steps = (settings.approach / APPROACH_STEP) as usize;
    for step in 0..=steps {
        let next = start + normal * (step as f64 * APPROACH_STEP);
        let before = std::mem::replace(&mut pose.translation, next);
        probe.place(pose);
        if probe.excess(settings.contact_depth) > 0.0 {
            // The last place without excess, or where it all began.
            pose.translation = before;
            return;
        }
    }
    pose.translation = start;
}

/// Which of two opposite steps moves the points away from the object.
fn opening_sense(probe: &mut Probe<'_>, pose: &HandPose, steps: &[Vec<f64>]) -> usize {
    let mut mean_distance = |step: &[f64]| {
        let mut pose = pose.clone();
        for (joint, change) in pose.articulation.iter_mut().zip(step) {
            *joint += 10.0 * change;
        }
        probe.place(&pose);
        let distances = probe
            .numbers
            .iter()
            .map(|&n| probe.sdf.distance(probe.point(n)));
        distances.sum::<f64>()
    };
    usize::from(mean_distance(&steps[0]) < mean_distance(&steps[1]))
}
