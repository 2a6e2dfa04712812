//! Gradients by target wrenches and of self-intersection, against central differences.

use graspd_hand::{Hand, HandPose, PoseGradient};
use graspd_sim::{Scene, Wrench, step_twist, task_loss};

use crate::setting::{BLOCK, CENTER, HAND, ball, flat, moved, object, params, pose_at, targets};

/// Quadratic functions: differences of any step are exact but for rounding.
const QUADRATIC: f64 = 1e-7;
/// Central differences of a function with a continuous gradient, step 1e-6, over tens of overlaps of 1e-3 m and more.
const DIFFERENCE: f64 = 1e-5;

const PHYSICS_WEIGHT: f64 = 1e-2;
const TASK_WEIGHT: f64 = 3e3;

#[test]
fn target_gradient_is_that_of_differences() {
    let (object, params) = (object(ball), params());
    let pose = pose_at(&object, CENTER, 6, 3e-3);
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let targets = targets(scene.wrench_len());
    scene.place(&pose);
    scene.contact_wrenches();
    scene.task(&targets);
    let mut claimed = vec![f64::NAN; targets.len()];
    scene.target_gradient(&targets, PHYSICS_WEIGHT, TASK_WEIGHT, &mut claimed);

    let mut loss = |targets: &[f64]| {
        PHYSICS_WEIGHT * scene.physics_loss(targets) + TASK_WEIGHT * scene.task(targets).loss
    };
    // Some of each component, velocity and lane: 7 and 11 have no factor in common with their numbers.
    let last_block = targets.len() / (3 * BLOCK) - 1;
    let wanted = (0..3 * BLOCK)
        .step_by(7)
        .chain((0..3 * BLOCK).step_by(11).map(|i| i + 5 * 3 * BLOCK));
    let mut checked = 0;
    for index in wanted.chain([last_block * 3 * BLOCK]) {
        let mut at = |by: f64| {
            let mut targets = targets.clone();
            targets[index] += by;
            loss(&targets)
        };
        let numeric = (at(10.0) - at(-10.0)) / 20.0;
        if claimed[index] != 0.0 {
            checked += 1;
            assert!((claimed[index] - numeric).abs() <= QUADRATIC * numeric.abs().max(1.0));
        }
    }
    assert!(checked > 30);
}

#[test]
fn task_is_one_step_under_the_sum_of_the_targets() {
    let (object, params) = (object(ball), params());
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let targets = targets(scene.wrench_len());
    let twists: Vec<_> = params
        .velocities
        .iter()
        .enumerate()
        .map(|(j, twist)| {
            let sum = |component: usize| -> f64 {
                let of_velocity = targets.chunks_exact(BLOCK).skip(j).step_by(3);
                of_velocity
                    .flat_map(|block| &block[8 * component..8 * (component + 1)])
                    .sum()
            };
            let [tx, ty, tz, fx, fy, fz] = [0, 1, 2, 3, 4, 5].map(sum);
            let total = Wrench {
                torque: [tx, ty, tz].into(),
                force: [fx, fy, fz].into(),
            };
            step_twist(&object, twist, &total, params.time_step)
        })
        .collect();
    let outcome = scene.task(&targets);
    assert_eq!(outcome.loss, task_loss(&twists));
    // A wrench at any one contact counts as much as at any other, for its own velocity only.
    let gradient = outcome.wrench_gradient.clone();
    for (j, expected) in gradient.iter().enumerate() {
        let expected = [expected.torque, expected.force]
            .map(|v| [v.x, v.y, v.z])
            .concat();
        for (component, expected) in expected.into_iter().enumerate() {
            let mut at = |by: f64| {
                let mut targets = targets.clone();
                targets[(12 + j) * BLOCK + 8 * component + 3] += by;
                scene.task(&targets).loss
            };
            let numeric = (at(10.0) - at(-10.0)) / 20.0;
            assert!((expected - numeric).abs() <= QUADRATIC * expected.abs());
        }
    }
}

#[test]
fn zero_targets_leave_the_object_moving() {
    let (object, params) = (object(ball), params());
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let nothing = vec![0.0; scene.wrench_len()];
    assert_eq!(scene.task(&nothing).loss, task_loss(&params.velocities));
}

#[test]
fn intersection_pulls_back_to_the_joints() {
    let (object, params) = (object(ball), params());
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    // A fist: the thumb runs into the fingers, and the index finger is spread against the middle one.
    let limits = HAND.limits().unwrap().iter();
    let mut articulation: Vec<f64> = limits.map(|l| l.lower + 0.9 * l.range()).collect();
    articulation[0] = -0.4;
    let pose = HandPose {
        articulation,
        ..pose_at(&object, CENTER, 7, 1e-3)
    };
    let mut value = |pose: &HandPose| {
        scene.place(pose);
        scene.intersection_loss(2.0)
    };
    let numeric: Vec<f64> = (0..22)
        .map(|i| 2.0 * (value(&moved(&pose, i, 1e-6)) - value(&moved(&pose, i, -1e-6))) / 2e-6)
        .collect();
    assert!(value(&pose) > 1e-6, "the fist does not run into itself");
    let mut gradient = PoseGradient::zero(16);
    scene.pull_back(&pose, &mut gradient);
    let claimed = flat(&gradient);
    let largest = claimed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (claimed, numeric) in claimed.iter().zip(&numeric) {
        assert!((claimed - numeric).abs() <= DIFFERENCE * largest);
    }
    // Moving the whole hand does not part it from itself.
    assert!(
        claimed[..6]
            .iter()
            .all(|v| v.abs() <= 1e-12 * largest.max(1.0))
    );
}
