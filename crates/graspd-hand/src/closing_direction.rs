//! Which way each joint closes a hand.

use graspd_geom::{Quaternion, Vec3};
use nalgebra::{Point3, Vector3};

use crate::{Hand, HandPose, Kinematics, Limit, PalmFrame, PointBuffer};

/// A joint closes if this share of the movement that it causes goes towards the focus.
const CLOSING_SHARE: f64 = 0.3;
/// How far a joint is moved to see where it leads, of the way to its limit.
const TRIAL: f64 = 0.5;
/// The same where there is no limit \[rad or m\].
const UNLIMITED_TRIAL: f64 = 0.5;

/// Returns the point that fingers close around: on the palm's normal, half as far from the palm as the middle of the
/// fingers is from it.
pub(crate) fn focus(palm: &PalmFrame, fingers: &[Point3<f64>]) -> Point3<f64> {
    let count = fingers.len().max(1) as f64;
    let middle: Vector3<f64> = fingers
        .iter()
        .map(|p| p - palm.center)
        .sum::<Vector3<f64>>()
        / count;
    palm.center + palm.normal * (0.5 * middle.norm())
}

/// Returns for each joint 1 or -1, the direction in which it moves the hand's points towards the focus, or 0 where it
/// does not clearly do so either way (such as joints that spread fingers).
///
/// `positions`: the points for an articulation. A joint is tried half way to each of its limits; what counts is the
/// sum of changes of distance to the focus over the sum of movements.
pub(crate) fn directions(
    limits: &[Limit],
    open: &[f64],
    focus: Point3<f64>,
    mut positions: impl FnMut(&[f64]) -> Vec<Point3<f64>>,
) -> Vec<f64> {
    let at_open = positions(open);
    let mut share_towards = |joint: usize, change: f64| {
        let mut moved = open.to_vec();
        moved[joint] += change;
        share_towards(&at_open, &positions(&moved), focus)
    };
    (0..open.len())
        .map(|joint| {
            let trial = |limit: f64, sign: f64| {
                let room = (limit - open[joint]).abs();
                sign * if room.is_finite() {
                    TRIAL * room
                } else {
                    UNLIMITED_TRIAL
                }
            };
            let up = share_towards(joint, trial(limits[joint].upper, 1.0));
            let down = share_towards(joint, trial(limits[joint].lower, -1.0));
            match (up > CLOSING_SHARE, down > CLOSING_SHARE) {
                (true, _) if up >= down => 1.0,
                (_, true) => -1.0,
                _ => 0.0,
            }
        })
        .collect()
}

/// Returns how much of the movement from one set of points to another is towards the focus: 1 straight to it, -1 away.
pub(crate) fn share_towards(
    before: &[Point3<f64>],
    after: &[Point3<f64>],
    focus: Point3<f64>,
) -> f64 {
    let (mut nearer, mut moved) = (0.0, 0.0);
    for (before, after) in before.iter().zip(after) {
        nearer += (before - focus).norm() - (after - focus).norm();
        moved += (after - before).norm();
    }
    if moved > 1e-9 { nearer / moved } else { 0.0 }
}

/// Returns for each joint of a hand 1 or -1, the direction in which it closes from the open pose, or 0 where it does
/// not clearly close either way; `[n]`. What the hand's description says counts before what is found.
pub fn closing_directions(hand: &dyn Hand) -> Vec<f64> {
    let unlimited = vec![Limit::UNLIMITED; hand.open_articulation().len()];
    let limits = hand.limits().unwrap_or(&unlimited);
    let mut scratch = hand.new_scratch();
    let mut points = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    let mut positions = |articulation: &[f64]| {
        let pose = HandPose {
            translation: Vec3::zero(),
            rotation: Quaternion::identity(),
            articulation: articulation.to_vec(),
        };
        Kinematics::<f64>::forward(hand, &pose, &mut scratch, &mut points, &mut spheres);
        (0..points.len())
            .map(|i| Point3::from(points.get(i)))
            .collect::<Vec<_>>()
    };
    let open = hand.open_articulation();
    let on_fingers = hand.contact_points().body.iter().map(|&body| body != 0);
    let fingers: Vec<Point3<f64>> = (positions(open).into_iter().zip(on_fingers))
        .filter_map(|(point, is_finger)| is_finger.then_some(point))
        .collect();
    let mut found = directions(limits, open, focus(hand.palm(), &fingers), positions);
    for (found, described) in found.iter_mut().zip(hand.closing_overrides()) {
        *found = described.unwrap_or(*found);
    }
    found
}

/// Returns the hand closed by a share of the way from the open pose to the limits that its joints close towards;
/// joints that close no way stay open, and an unlimited joint counts as having pi/2 to go. `[n]`.
pub fn closed_articulation(hand: &dyn Hand, share: f64) -> Vec<f64> {
    let limits = hand.limits();
    let open = hand.open_articulation().iter().enumerate();
    open.zip(closing_directions(hand))
        .map(|((joint, open), direction)| {
            let limit = limits.map_or(Limit::UNLIMITED, |limits| limits[joint]);
            let end = if direction > 0.0 {
                limit.upper
            } else {
                limit.lower
            };
            let way = (end - open).abs().min(std::f64::consts::FRAC_PI_2);
            open + share * direction * way
        })
        .collect()
}
