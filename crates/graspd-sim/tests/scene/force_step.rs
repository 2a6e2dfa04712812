//! The force step has a closed form: it moves the targets of all contacts by one and the same wrench.

use graspd_hand::{Hand, POINT_PADDING};
use graspd_sim::{Scene, SimulationParams, Wrench, step_twist};
use nalgebra::{DMatrix, DVector, Vector6};
use proptest::prelude::*;

use crate::setting::{BLOCK, CENTER, HAND, ball, object, params, pose_at, targets};

/// Sums of a thousand contacts' wrenches, and systems of condition 1e3.
const ROUNDING: f64 = 1e-9;

/// Relative error after descent.
const CONVERGED: f64 = 1e-6;
/// Weights of L_phys and L_task in the descent.
const PHYSICS: f64 = 1.0;
const TASK: f64 = 1e2;

fn wrenches(count: usize) -> impl Strategy<Value = Vec<Vector6<f64>>> {
    let one = prop::array::uniform6(-10.0..10.0f64).prop_map(Vector6::from);
    prop::collection::vec(one, count)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Minimises sum_c |f^_c - F_c|^2 subject to sum_c f^_c = S by its Karush-Kuhn-Tucker system, without use of its
    /// structure.
    #[test]
    fn a_constraint_on_the_sum_moves_every_target_by_one_wrench(
        forces in (1..8usize).prop_flat_map(wrenches),
        sum in prop::array::uniform6(-10.0..10.0f64).prop_map(Vector6::from),
    ) {
        let count = forces.len();
        let mut system = DMatrix::zeros(6 * count + 6, 6 * count + 6);
        let mut right = DVector::zeros(6 * count + 6);
        for (c, force) in forces.iter().enumerate() {
            for k in 0..6 {
                let (row, constraint) = (6 * c + k, 6 * count + k);
                system[(row, row)] = 2.0;
                system[(row, constraint)] = 1.0;
                system[(constraint, row)] = 1.0;
                right[row] = 2.0 * force[k];
            }
        }
        right.rows_mut(6 * count, 6).copy_from(&sum);
        let solution = system.lu().solve(&right).expect("the constraint has full rank");
        let shared = (sum - forces.iter().sum::<Vector6<f64>>()) / count as f64;
        for (c, force) in forces.iter().enumerate() {
            let moved = solution.rows(6 * c, 6) - force;
            prop_assert!((moved - shared).norm() < ROUNDING);
        }
    }
}

/// The targets for which PHYSICS L_phys + TASK L_task is least, by accelerated descent along the scene's own gradient
/// from unequal targets.
fn least(scene: &mut Scene<'_, f64>, params: &SimulationParams) -> Vec<f64> {
    const STEPS: usize = 2000;
    /// The moments of inertia here are larger \[kg m^2\].
    const MIN_MOMENT: f64 = 1e-4;
    scene.contact_wrenches();
    let mut now = targets(scene.wrench_len());
    let (mut before, mut gradient) = (now.clone(), vec![0.0; now.len()]);
    let contacts = HAND.contact_points().weight.len() as f64;
    let curvature = 2.0 * TASK * contacts * (params.time_step / MIN_MOMENT).powi(2);
    // Of the heavy ball, for a quadratic function with these least and largest second derivatives.
    let (low, high) = ((2.0 * PHYSICS).sqrt(), (2.0 * PHYSICS + curvature).sqrt());
    let rate = (2.0 / (low + high)).powi(2);
    let momentum = ((high - low) / (high + low)).powi(2);
    for _ in 0..STEPS {
        scene.task(&now);
        scene.target_gradient(&now, PHYSICS, TASK, &mut gradient);
        for ((now, before), slope) in now.iter_mut().zip(&mut before).zip(&gradient) {
            let next = *now - rate * slope + momentum * (*now - *before);
            *before = *now;
            *now = next;
        }
    }
    now
}

/// By how much each target of velocity `j` is beside its contact's wrench.
fn moves(
    scene: &Scene<'_, f64>,
    targets: &[f64],
    velocities: usize,
    j: usize,
) -> Vec<Vector6<f64>> {
    let weight = &HAND.contact_points().weight;
    let at = |c: usize, k: usize| {
        (c / POINT_PADDING * velocities + j) * BLOCK + k * POINT_PADDING + c % POINT_PADDING
    };
    let contacts = (0..weight.len()).filter(|&c| weight[c] > 0.0);
    let moved = |c: usize| Vector6::from_fn(|k, _| targets[at(c, k)] - scene.wrenches()[at(c, k)]);
    contacts.map(moved).collect()
}

fn soft() -> SimulationParams {
    let mut params = params();
    params.contact.normal_stiffness = 1e4;
    params.contact.friction_stiffness = 1e6;
    params
}

/// Also where most contacts do not touch: their targets are the shared wrench itself.
#[test]
fn the_force_step_moves_every_target_of_a_hand_by_one_wrench() {
    let (object, params) = (object(ball), soft());
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    scene.place(&pose_at(&object, CENTER, 6, 2e-3));
    let contacts = HAND
        .contact_points()
        .weight
        .iter()
        .filter(|&&w| w > 0.0)
        .count() as f64;
    let dt = params.time_step;
    let found = least(&mut scene, &params);
    let velocities = params.velocities.len();
    for (j, velocity) in params.velocities.iter().enumerate() {
        let moved = moves(&scene, &found, velocities, j);
        let shared = moved.iter().sum::<Vector6<f64>>() / contacts;
        // Where the derivative is 0: PHYSICS w_j + TASK dt M^-1 twist'_j = 0.
        let total = found_total(&found, velocities, j);
        let after = step_twist(&object, velocity, &total, dt);
        let wrench = |torque, force| Wrench { torque, force };
        let slope = object.impulse_response(&wrench(after.angular, after.linear), dt);
        let [a, l] = [slope.angular, slope.linear];
        let expected = -Vector6::new(a.x, a.y, a.z, l.x, l.y, l.z) * (TASK / PHYSICS);
        for part in [0, 3] {
            let part = |v: &Vector6<f64>| v.fixed_rows::<3>(part).into_owned();
            let size = part(&shared).norm();
            assert!(size > 0.0);
            let apart = moved.iter().map(|v| (part(v) - part(&shared)).norm());
            assert!(apart.fold(0.0, f64::max) < CONVERGED * size, "{shared}");
            let error = (part(&shared) - part(&expected)).norm();
            assert!(error < CONVERGED * size, "{shared} {expected}");
        }
    }
}

/// With nothing in contact, the task is met by each contact taking its share of stopping the object; of a velocity and
/// its opposite, the shares cancel, and with them the leaked pull of the normal forces, which are the same for both.
#[test]
fn the_shares_of_opposite_velocities_cancel_where_nothing_touches() {
    let (object, mut params) = (object(ball), SimulationParams::default());
    params.contact = soft().contact;
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    scene.place(&pose_at(&object, CENTER, 6, -1e-3));
    let found = least(&mut scene, &params);
    let [rest, ahead, back] = [0, 1, 2].map(|j| moves(&scene, &found, 3, j)[0]);
    assert!(scene.wrenches().iter().all(|&w| w == 0.0));
    assert!(rest.norm() < CONVERGED * ahead.norm());
    assert!((ahead + back).norm() < CONVERGED * ahead.norm());
    // Against the velocity.
    assert!(ahead[3] < 0.0 && ahead[4] < 0.0 && ahead[5] < 0.0);
}

fn found_total(targets: &[f64], velocities: usize, j: usize) -> Wrench<f64> {
    let mut sums = [0.0; 6];
    for block in targets.chunks_exact(BLOCK * velocities) {
        for (sum, row) in sums
            .iter_mut()
            .zip(block[j * BLOCK..].chunks_exact(POINT_PADDING))
        {
            *sum += row.iter().sum::<f64>();
        }
    }
    let [tx, ty, tz, fx, fy, fz] = sums;
    Wrench {
        torque: [tx, ty, tz].into(),
        force: [fx, fy, fz].into(),
    }
}
