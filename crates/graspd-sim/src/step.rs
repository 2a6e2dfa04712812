//! One simulation step from several velocities, and what the grasp should make of it.
//!
//! Both functions are polynomials of what they are given: differentiable everywhere.

use graspd_ad::Real;

use crate::object::SimulatedObject;
use crate::params::{Twist, Wrench};

/// The object's twist after one semi-implicit Euler step of `time_step` \[s\]: twist + dt M^-1 w.
///
/// There is no gravity, and no gyroscopic torque either: over 1e-5 s at the velocities of a grasp both are far below
/// the contact forces.
///
/// # Source
/// Grasp'D (ECCV 2022), section 3.1 and supplementary A.5.
#[inline(always)]
pub fn step_twist<T: Real>(
    object: &SimulatedObject,
    twist: &Twist<T>,
    total_wrench: &Wrench<T>,
    time_step: f64,
) -> Twist<T> {
    let change = object.impulse_response(total_wrench, time_step);
    Twist {
        linear: twist.linear + change.linear,
        angular: twist.angular + change.angular,
    }
}

/// L_task: the sum over the velocities of ||twist'||^2, with linear parts in m/s and angular parts in rad/s.
///
/// `twists_after`: `[J]`, from [`step_twist`].
pub fn task_loss<T: Real>(twists_after: &[Twist<T>]) -> T {
    twists_after.iter().fold(T::zero(), |sum, twist| {
        sum + twist.linear.norm_squared() + twist.angular.norm_squared()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_ad::gradient;
    use graspd_geom::{SdfGrid, Vec3};
    use nalgebra::{Matrix3, Point3, Vector3};
    use proptest::prelude::*;

    /// Sums of a few products, some with an inverted matrix of condition 10.
    const ROUNDING: f64 = 1e-12;

    fn object(mass: f64, inertia: Matrix3<f64>) -> SimulatedObject {
        let unit = Vec3::new(1.0, 1.0, 1.0);
        let sdf = SdfGrid::from_values(Vec3::zero(), unit, [2; 3], vec![1.0; 8]).unwrap();
        SimulatedObject::new(sdf, mass, Point3::origin(), inertia).unwrap()
    }

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
    }

    /// Sums of three random outer products and a share of the identity.
    fn inertia() -> impl Strategy<Value = Matrix3<f64>> {
        (vector(), vector(), vector()).prop_map(|(a, b, c)| {
            let outer = a * a.transpose() + b * b.transpose() + c * c.transpose();
            outer + Matrix3::from_diagonal_element(0.5)
        })
    }

    #[test]
    fn step_by_hand() {
        // Half a kilogram with moments 1, 2 and 4 kg m^2, for a tenth of a second.
        let object = object(0.5, Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 4.0)));
        let twist = Twist {
            linear: Vec3::new(1.0, 0.0, -1.0),
            angular: Vec3::new(0.0, 3.0, 0.0),
        };
        let wrench = Wrench {
            torque: Vec3::new(10.0, 20.0, -80.0),
            force: Vec3::new(-5.0, 10.0, 0.0),
        };
        let after = step_twist(&object, &twist, &wrench, 0.125);
        assert_eq!(after.linear, Vec3::new(-0.25, 2.5, -1.0));
        assert_eq!(after.angular, Vec3::new(1.25, 4.25, -2.5));
        let expected = 0.0625 + 6.25 + 1.0 + 1.5625 + 18.0625 + 6.25;
        assert_eq!(task_loss(&[after]), expected);
        assert_eq!(task_loss(&[after, after]), 2.0 * expected);
        assert_eq!(task_loss::<f64>(&[]), 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Momentum gains the impulse; kinetic energy gains the work along the mean velocity.
        #[test]
        fn a_step_keeps_the_books_of_momentum_and_energy(
            mass in 0.1..2.0f64,
            inertia in inertia(),
            (linear, angular) in (vector(), vector()),
            (torque, force) in (vector(), vector()),
        ) {
            let step = 0.25;
            let before = Twist { linear: linear.into(), angular: angular.into() };
            let wrench = Wrench { torque: torque.into(), force: force.into() };
            let after = step_twist(&object(mass, inertia), &before, &wrench, step);
            let (linear_after, angular_after) = (
                Vector3::from(after.linear),
                Vector3::from(after.angular),
            );
            let pushed = mass * (linear_after - linear) - step * force;
            let turned = inertia * (angular_after - angular) - step * torque;
            prop_assert!(pushed.norm() <= ROUNDING && turned.norm() <= ROUNDING);

            let energy = |v: Vector3<f64>, w: Vector3<f64>| {
                0.5 * mass * v.norm_squared() + 0.5 * w.dot(&(inertia * w))
            };
            let gained = energy(linear_after, angular_after) - energy(linear, angular);
            let work = step * 0.5 * (force.dot(&(linear + linear_after)) + torque.dot(&(angular + angular_after)));
            prop_assert!((gained - work).abs() <= ROUNDING * (1.0 + work.abs()));
        }

        /// d||twist'||^2 / d wrench = 2 dt M^-1 twist'.
        #[test]
        fn reverse_mode_gives_the_closed_form(
            mass in 0.1..2.0f64,
            inertia in inertia(),
            wrench in prop::array::uniform6(-1.0..1.0f64),
        ) {
            let object = object(mass, inertia);
            let before = Twist { linear: Vec3::new(1.0, -2.0, 0.5), angular: Vec3::new(0.3, 0.1, -0.7) };
            let (_, claimed) = gradient(
                |x| {
                    let wrench = Wrench {
                        torque: Vec3::new(x[0], x[1], x[2]),
                        force: Vec3::new(x[3], x[4], x[5]),
                    };
                    let before = Twist {
                        linear: Vec3::constant(before.linear),
                        angular: Vec3::constant(before.angular),
                    };
                    task_loss(&[step_twist(&object, &before, &wrench, 0.25)])
                },
                &wrench,
            );
            let [tx, ty, tz, fx, fy, fz] = wrench;
            let inverse = inertia.try_inverse().unwrap();
            let linear = Vector3::from(before.linear) + Vector3::new(fx, fy, fz) * (0.25 / mass);
            let angular = Vector3::from(before.angular) + inverse * Vector3::new(tx, ty, tz) * 0.25;
            let expected = [inverse * angular * 0.5, linear * (0.5 / mass)];
            for (axis, expected) in expected.iter().flat_map(|v| v.iter()).enumerate() {
                prop_assert!((claimed[axis] - expected).abs() <= ROUNDING * (1.0 + expected.abs()));
            }
        }
    }
}
