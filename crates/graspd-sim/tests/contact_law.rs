//! The contact law: its values, its kinks, and its derivative in every mode.

use graspd_ad::{Dual, Lanes, Real, gradient};
use graspd_geom::Vec3;
use graspd_sim::{ContactParams, ContactState, Twist, Wrench};
use proptest::prelude::*;

/// The object: a ball about the origin \[m\]; its centre of mass is the origin too.
const RADIUS: f64 = 0.05;
/// Central differences in f64 with step 1e-7 m on forces of about 1e4 N/mm leave this relative error.
const DIFFERENCE_TOLERANCE: f64 = 1e-6;
/// Forward and reverse mode multiply the same factors in another order.
const MODE_TOLERANCE: f64 = 1e-10;

fn wrench<T: Real>(point: Vec3<T>, twist: &Twist<f64>, leak: f64) -> [T; 6] {
    let params = ContactParams::default();
    let distance = point.norm() - T::constant(RADIUS);
    let state = ContactState::new(distance, point, point, leak);
    let twist = Twist {
        linear: Vec3::constant(twist.linear),
        angular: Vec3::constant(twist.angular),
    };
    let Wrench { torque, force } = state.wrench(&twist, &params);
    [torque.x, torque.y, torque.z, force.x, force.y, force.z]
}

/// A scalar that mixes all six components differently.
fn mixed<T: Real>(point: Vec3<T>, twist: &Twist<f64>, leak: f64) -> T {
    wrench(point, twist, leak)
        .into_iter()
        .zip([70.0, -50.0, 30.0, 1.0, -2.0, 3.0])
        .fold(T::zero(), |sum, (component, factor)| {
            sum + component * T::constant(factor)
        })
}

fn forward(point: [f64; 3], twist: &Twist<f64>, leak: f64) -> [f64; 3] {
    let [x, y, z] = point;
    let variables = Vec3::new(
        Dual::<f64, 3>::variable(x, 0),
        Dual::variable(y, 1),
        Dual::variable(z, 2),
    );
    mixed(variables, twist, leak).derivative
}

fn at_depth(direction: [f64; 3], depth: f64) -> [f64; 3] {
    let norm = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
    direction.map(|v| v / norm * (RADIUS - depth))
}

fn twist(linear: [f64; 3], angular: [f64; 3]) -> Twist<f64> {
    Twist {
        linear: linear.into(),
        angular: angular.into(),
    }
}

fn direction() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-1.0..1.0f64).prop_filter("not too short", |v| {
        v.iter().map(|x| x * x).sum::<f64>() > 0.05
    })
}

/// Tangential speed at the contact; sticking and sliding meet at mu k_n / k_f = 8 mm/s.
fn slip_speed(point: [f64; 3], twist: &Twist<f64>) -> f64 {
    let p = Vec3::from(point);
    let n = p.normalize_or_zero();
    let u = -(twist.linear + twist.angular.cross(p));
    (u - n * u.dot(n)).norm()
}

proptest! {
    #[test]
    fn derivative_is_the_same_in_every_mode(
        direction in direction(),
        depth in 1e-5..2e-3f64,
        linear in prop::array::uniform3(-0.02..0.02f64),
        angular in prop::array::uniform3(-0.2..0.2f64),
    ) {
        let point = at_depth(direction, depth);
        let twist = twist(linear, angular);
        let speed = slip_speed(point, &twist);
        prop_assume!((speed - 0.008).abs() > 1e-4 && speed > 1e-4);

        let by_dual = forward(point, &twist, 0.1);
        let (_, by_tape) = gradient(|x| mixed(Vec3::new(x[0], x[1], x[2]), &twist, 0.1), &point);
        let scale = by_dual.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for axis in 0..3 {
            let moved = |by: f64| {
                let mut p = point;
                p[axis] += by;
                mixed(Vec3::from(p), &twist, 0.1)
            };
            let numeric = (moved(1e-7) - moved(-1e-7)) / 2e-7;
            prop_assert!((by_dual[axis] - by_tape[axis]).abs() <= MODE_TOLERANCE * scale);
            prop_assert!((by_dual[axis] - numeric).abs() <= DIFFERENCE_TOLERANCE * scale,
                "axis {axis}: {} against {numeric}", by_dual[axis]);
        }
    }

    #[test]
    fn force_stays_in_the_friction_cone_and_opposes_sliding(
        direction in direction(),
        depth in 1e-6..2e-3f64,
        linear in prop::array::uniform3(-0.02..0.02f64),
    ) {
        let point = at_depth(direction, depth);
        let [_, _, _, x, y, z] = wrench(Vec3::from(point), &twist(linear, [0.0; 3]), 0.1);
        let (force, normal) = (Vec3::new(x, y, z), Vec3::from(point).normalize_or_zero());
        let pressure = -force.dot(normal);
        let friction = force + normal * pressure;
        prop_assert!((pressure - 1e6 * depth).abs() < 1e-6 * pressure);
        prop_assert!(friction.norm() <= 0.8 * pressure * (1.0 + 1e-9));
        prop_assert!(friction.dot(Vec3::from(linear)) <= 1e-9);
    }

    #[test]
    fn lanes_agree_with_f64(
        direction in direction(),
        depth in 1e-4..2e-3f64,
        linear in prop::array::uniform3(-0.02..0.02f64),
    ) {
        let point = at_depth(direction, depth);
        let twist = twist(linear, [0.0; 3]);
        let exact = wrench(Vec3::from(point), &twist, 0.1);
        let lanes = wrench(Vec3::<Lanes>::constant(point), &twist, 0.1);
        let scale = exact[3..].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        for (a, b) in exact.iter().zip(lanes) {
            for lane in 0..8 {
                // f32 knows the depth, a difference of 5 cm numbers, to about 4e-9 m of at least 1e-4 m.
                prop_assert!((a - b.lane(lane)).abs() < 2e-4 * scale);
            }
        }
    }
}

#[test]
fn resting_object_feels_only_the_normal_force() {
    let point = at_depth([0.0, 0.0, 1.0], 1e-3);
    let at_rest = twist([0.0; 3], [0.0; 3]);
    let [tx, ty, tz, fx, fy, fz] = wrench(Vec3::from(point), &at_rest, 0.1);
    assert_eq!([tx, ty, tz, fx, fy], [0.0; 5]);
    assert!(
        (fz + 1000.0).abs() < 1e-6,
        "1 mm deep at 1e6 N/m is 1000 N, not {fz}"
    );
    let derivative = forward(point, &at_rest, 0.1);
    assert!(derivative.iter().all(|d| d.is_finite()));
}

#[test]
fn sliding_friction_is_mu_times_the_normal_force() {
    let point = at_depth([0.0, 0.0, 1.0], 1e-3);
    let [.., fx, fy, fz] = wrench(Vec3::from(point), &twist([0.02, 0.0, 0.0], [0.0; 3]), 0.1);
    assert!((fx + 800.0).abs() < 1e-6 && fy == 0.0 && (fz + 1000.0).abs() < 1e-6);
}

#[test]
fn sticking_friction_is_proportional_to_the_slip() {
    let point = at_depth([0.0, 0.0, 1.0], 1e-3);
    let [.., fx, _, _] = wrench(Vec3::from(point), &twist([0.004, 0.0, 0.0], [0.0; 3]), 0.1);
    assert!((fx + 1e8 * 1e-3 * 0.004).abs() < 1e-6);
}

#[test]
fn distant_points_feel_the_leaked_fraction_of_the_gradient_and_no_force() {
    let moving = twist([0.02, 0.01, 0.0], [0.0; 3]);
    let (inside, outside) = (
        at_depth([1.0, 2.0, 3.0], 1e-12),
        at_depth([1.0, 2.0, 3.0], -1e-12),
    );
    assert_eq!(wrench(Vec3::from(outside), &moving, 0.1), [0.0; 6]);
    let (touching, leaked) = (
        forward(inside, &moving, 0.1),
        forward(outside, &moving, 0.1),
    );
    for axis in 0..3 {
        assert!((leaked[axis] - 0.1 * touching[axis]).abs() < 1e-6 * touching[axis].abs());
    }
    assert_eq!(forward(outside, &moving, 0.0), [0.0; 3]);
}

#[test]
fn no_derivative_is_nan_where_the_distance_has_no_gradient() {
    // The ball's centre: the distance field has no normal there.
    let derivative = forward([0.0; 3], &twist([0.01; 3], [0.0; 3]), 0.1);
    assert!(derivative.iter().all(|d| d.is_finite()), "{derivative:?}");
}

#[test]
fn what_does_not_touch_may_leak_sliding_friction_at_every_speed() {
    let sliding = ContactParams {
        slides_at_zero_depth: true,
        ..ContactParams::default()
    };
    let per_depth = |depth: f64, speed: f64, params: &ContactParams| {
        let state = ContactState {
            depth,
            normal: Vec3::new(0.0, 0.0, 1.0),
            lever: Vec3::new(0.0, 0.0, RADIUS),
        };
        let wrench = state.wrench_per_depth(&twist([speed, 0.0, 0.0], [0.0; 3]), params);
        wrench.force.x
    };
    // Below 8 mm/s contacts stick: k_f |u_t| for each metre of depth, against mu k_n for sliding.
    let slow = 0.004;
    assert!((per_depth(0.0, slow, &ContactParams::default()) + 1e8 * slow).abs() < 1e-6);
    assert!((per_depth(0.0, slow, &sliding) + 0.8e6).abs() < 1e-6);
    // What touches still sticks, what slides anyway is the same, and at rest there is no friction.
    assert!((per_depth(1e-9, slow, &sliding) + 1e8 * slow).abs() < 1e-6);
    assert!((per_depth(0.0, 0.02, &sliding) + 0.8e6).abs() < 1e-6);
    assert_eq!(per_depth(0.0, 0.0, &sliding), 0.0);
}
