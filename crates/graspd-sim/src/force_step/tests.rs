//! The closed forms of the force step against duals, the tape, differences, its conditions of optimality and a plain
//! first-order method.

use super::*;
use graspd_ad::{Dual, gradient};
use proptest::prelude::*;

const FRICTION: f64 = 0.6;
/// The closed form rounds otherwise than the chain rule.
const MODE_TOLERANCE: f64 = 1e-9;
/// Half width of central differences, and what they leave where the second derivative jumps.
const STEP: f64 = 1e-5;
const DIFFERENCE_TOLERANCE: f64 = 1e-3;
/// Relative to the sizes of forces and levers, which are of order 1.
const OPTIMAL: f64 = 1e-8;

type Numbers = Vec<[f64; 9]>;

fn contacts<T: Real>(numbers: &[T]) -> Vec<ForceContact<T>> {
    let contact = |n: &[T]| ForceContact {
        lever: Vec3::new(n[0], n[1], n[2]),
        inward: Vec3::new(n[3], n[4], n[5]).normalize_or_zero(),
        force: Vec3::new(n[6], n[7], n[8]),
    };
    numbers.chunks(9).map(contact).collect()
}

fn some_contacts() -> impl Strategy<Value = Numbers> {
    let numbers = prop::array::uniform9(-1.0..1.0f64);
    let has_normal = |n: &[f64; 9]| n[3..6].iter().map(|x| x * x).sum::<f64>() > 0.01;
    prop::collection::vec(numbers.prop_filter("a normal", has_normal), 0..12)
}

fn some_twist() -> impl Strategy<Value = [f64; 6]> {
    prop::array::uniform6(-1.0..1.0f64)
}

fn twist_of<T: Real>(n: &[T]) -> Twist<T> {
    Twist {
        linear: Vec3::new(n[0], n[1], n[2]),
        angular: Vec3::new(n[3], n[4], n[5]),
    }
}

fn step(relaxation: f64) -> ForceStep {
    ForceStep::normalized(0.7, FRICTION, relaxation)
}

fn is_in_cone(force: Vec3<f64>, axis: Vec3<f64>, friction: f64, slack: f64) -> bool {
    let normal = force.dot(axis);
    (force - axis * normal).norm() <= friction * normal + slack
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn derivatives_of_the_dual_are_those_of_both_modes_and_of_differences(
        numbers in some_contacts(),
        before in some_twist(),
        after in some_twist(),
        relaxation in 0.05..1.0f64,
    ) {
        let step = step(relaxation);
        let flat = numbers.concat();
        let (claimed, hessian, _) =
            step.dual_derivatives(&contacts(&flat), &before.into(), &after.into());
        let forward = {
            let fixed: Vec<_> = flat.iter().map(|x| Dual::<f64, 6>::constant(*x)).collect();
            let before = before.map(Dual::constant);
            step.dual(&contacts(&fixed), &twist_of(&before), &twist_of(&Dual::variables(after)))
        };
        let inputs = [&flat[..], &before, &after].concat();
        let (value, reverse) = gradient(|x| {
            let (points, twists) = x.split_at(flat.len());
            step.dual(&contacts(points), &twist_of(twists), &twist_of(&twists[6..]))
        }, &inputs);
        let at = |after: &[f64; 6]| step.dual_value(&contacts(&flat), &before.into(), &(*after).into());
        prop_assert!((value - at(&after)).abs() <= MODE_TOLERANCE);
        for k in 0..6 {
            prop_assert!((claimed[k] - forward.derivative[k]).abs() <= MODE_TOLERANCE);
            prop_assert!((claimed[k] - reverse[flat.len() + 6 + k]).abs() <= MODE_TOLERANCE);
            let (mut low, mut high) = (after, after);
            (low[k], high[k]) = (low[k] - STEP, high[k] + STEP);
            let numeric = (at(&high) - at(&low)) / (2.0 * STEP);
            prop_assert!((claimed[k] - numeric).abs() <= DIFFERENCE_TOLERANCE / relaxation);
        }
        prop_assert!(hessian.symmetric_eigenvalues().min() >= 1.0 - MODE_TOLERANCE);
    }

    #[test]
    fn solutions_satisfy_the_conditions_of_optimality(
        numbers in some_contacts(),
        before in some_twist(),
        relaxation in 1e-6..1.0f64,
    ) {
        let step = step(relaxation);
        let contacts = contacts(&numbers.concat());
        let solved = step.solve(&contacts, &twist_of(&before));
        let mut sum = Vector6::from(before);
        for (contact, &force) in contacts.iter().zip(&solved.forces) {
            sum += step.response(contact, force);
            // The gradient of the cost by the force is in the dual cone, and orthogonal to the force.
            let slope = step.pull(contact, &solved.twist_after) + (force - contact.force) * relaxation;
            prop_assert!(is_in_cone(force, contact.inward, FRICTION, OPTIMAL * (1.0 + force.norm())));
            prop_assert!(is_in_cone(slope, contact.inward, 1.0 / FRICTION, OPTIMAL));
            prop_assert!(slope.dot(force).abs() <= OPTIMAL * (1.0 + force.norm()));
        }
        prop_assert!((sum - vector(&solved.twist_after)).norm() <= OPTIMAL);
        prop_assert!((solved.task - sum.norm_squared()).abs() <= OPTIMAL);
        // What is left of a motion is never more than there was.
        let idle: f64 = before.iter().map(|x| x * x).sum();
        let forces: f64 = numbers.iter().flat_map(|n| &n[6..]).map(|x| x * x).sum();
        prop_assert!(solved.task <= idle + relaxation * forces + OPTIMAL);
    }

    #[test]
    fn the_least_value_changes_as_the_dual_says(
        numbers in some_contacts(),
        before in some_twist(),
        relaxation in 0.05..1.0f64,
    ) {
        // psi's minimum, its contacts changed; its derivative at the fixed solution.
        let step = step(relaxation);
        let flat = numbers.concat();
        let least = |flat: &[f64]| {
            let points = contacts(flat);
            let after = step.solve(&points, &twist_of(&before)).twist_after;
            (step.dual(&points, &twist_of(&before), &after), after)
        };
        let (_, after) = least(&flat);
        let (_, by_contacts) = gradient(|x| {
            let constant = |twist: &Twist<f64>| Twist {
                linear: Vec3::constant(twist.linear),
                angular: Vec3::constant(twist.angular),
            };
            step.dual(&contacts(x), &constant(&twist_of(&before)), &constant(&after))
        }, &flat);
        for k in 0..flat.len() {
            let moved = [-STEP, STEP].map(|change| {
                let mut moved = flat.clone();
                moved[k] += change;
                least(&moved).0
            });
            let numeric = (moved[1] - moved[0]) / (2.0 * STEP);
            prop_assert!((by_contacts[k] - numeric).abs() <= DIFFERENCE_TOLERANCE / relaxation);
        }
    }

    #[test]
    fn a_first_order_method_ends_at_the_same_forces(
        numbers in some_contacts(),
        before in some_twist(),
    ) {
        let relaxation = 0.5;
        let step = step(relaxation);
        let contacts = contacts(&numbers.concat());
        let solved = step.solve(&contacts, &twist_of(&before));
        // Projected gradient: levers are shorter than 2, so |B_c|^2 <= 1 + 4 / 0.49.
        let rate = 1.0 / (relaxation + 10.0 * contacts.len() as f64);
        let mut forces = vec![Vec3::<f64>::zero(); contacts.len()];
        for _ in 0..6000 {
            let mut after = Vector6::from(before);
            for (contact, &force) in contacts.iter().zip(&forces) {
                after += step.response(contact, force);
            }
            for (contact, force) in contacts.iter().zip(&mut forces) {
                let slope = step.pull(contact, &twist(&after)) + (*force - contact.force) * relaxation;
                *force = project(*force - slope * rate, contact.inward, FRICTION);
            }
        }
        for (a, b) in forces.iter().zip(&solved.forces) {
            prop_assert!((*a - *b).norm() < 1e-6, "{a:?} {b:?}");
        }
    }
}

#[test]
fn two_fingers_stop_what_friction_allows() {
    // Along y they press, along x they rub; nothing holds a turn about y but for the levers' own line.
    let finger = |side: f64| ForceContact {
        lever: Vec3::new(0.0, side, 0.0),
        inward: Vec3::new(0.0, -side, 0.0),
        force: Vec3::zero(),
    };
    let contacts = [finger(1.0), finger(-1.0)];
    let step = ForceStep::normalized(1.0, FRICTION, 1e-9);
    let left = |twist: [f64; 6]| step.solve(&contacts, &twist_of(&twist)).task;
    for axis in [0, 1, 2, 3, 5] {
        for sign in [-1.0, 1.0] {
            let mut twist = [0.0; 6];
            twist[axis] = sign;
            assert!(left(twist) < 1e-12, "{axis}: {}", left(twist));
        }
    }
    assert!((left([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]) - 1.0).abs() < 1e-12);
    // One finger alone cannot pull.
    let one = step.solve(&contacts[..1], &twist_of(&[0.0, -1.0, 0.0, 0.0, 0.0, 0.0]));
    assert_eq!((one.task, one.forces[0]), (1.0, Vec3::zero()));
    // Nothing touches.
    assert_eq!(step.solve(&[], &twist_of(&[1.0; 6])).task, 6.0);
}

#[test]
fn without_relaxation_and_friction_limits_it_is_the_closed_form() {
    // All targets within their cones move by the same wrench: f = F + w, here with one contact at the centre.
    let contact = ForceContact {
        lever: Vec3::zero(),
        inward: Vec3::new(0.0, 0.0, 1.0),
        force: Vec3::new(0.0, 0.0, 5.0),
    };
    let step = ForceStep::normalized(1.0, FRICTION, 1.0);
    let solved = step.solve(&[contact], &twist_of(&[0.0, 0.0, -4.0, 0.0, 0.0, 0.0]));
    // v' = -4 + f, rho (f - 5) + v' = 0.
    assert!(
        (solved.forces[0].z - 4.5).abs() < 1e-12
            && (solved.twist_after.linear.z - 0.5).abs() < 1e-12
    );
}
