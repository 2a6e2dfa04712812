//! The physics loss against the formulas of the method written out, and what must not change it.

use graspd_hand::{Hand, HandPose, POINT_PADDING, PoseGradient};
use graspd_sim::{Scene, SimulatedObject, SimulationParams};
use nalgebra::Vector3;

use crate::setting::{
    BLOCK, CENTER, HAND, ball, cube, flat, object, params, pose_at, targets, touching,
};

/// Sums of the same products in another order.
const ROUNDING: f64 = 1e-12;
/// Single precision knows positions of 0.2 m to about 1e-8 m, 1e-5 of the depths of 1 mm and more that count in the
/// sums, where part of it averages out: 2e-6 is measured.
const SINGLE: f64 = 2e-5;
/// How deep the deepest contact is \[m\].
const DEPTH: f64 = 3e-3;
const SMOOTHING: f64 = 2e-3;

/// The wrench of one contact at distance `d` with normal `n` on an object that moves with (v, w), from the method.
fn wrench_by_the_book(
    d: f64,
    n: Vector3<f64>,
    r: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
) -> [f64; 6] {
    let (k_n, k_f, mu) = (1e6, 1e8, 0.8);
    let depth = d.min(0.0).abs();
    let u = -(v + w.cross(&r));
    let u_t = u - u.dot(&n) * n;
    let pressure = k_n * depth;
    let friction = (k_f * depth * u_t.norm()).min(mu * pressure);
    let mut on_hand = pressure * n;
    if u_t.norm() > 0.0 {
        on_hand -= friction * u_t.normalize();
    }
    let force = -on_hand;
    let torque = r.cross(&force);
    [torque.x, torque.y, torque.z, force.x, force.y, force.z]
}

/// The wrenches of all contacts as a scene stores them; 0 at padding.
fn wrenches_by_the_book(
    scene: &Scene<'_, f64>,
    object: &SimulatedObject,
    params: &SimulationParams,
    smoothing: f64,
) -> Vec<f64> {
    let mut wrenches = vec![0.0; scene.wrench_len()];
    for (i, &weight) in HAND.contact_points().weight.iter().enumerate() {
        if weight == 0.0 {
            continue;
        }
        let p = scene.contacts().get(i);
        let (phi, gradient) = object.sdf().distance_and_gradient(p);
        let lever = Vector3::from(p) - Vector3::from(object.center_of_mass());
        for (j, twist) in params.velocities.iter().enumerate() {
            let wrench = wrench_by_the_book(
                phi - smoothing,
                Vector3::from(gradient).normalize(),
                lever,
                twist.linear.into(),
                twist.angular.into(),
            );
            let block = (i / POINT_PADDING) * params.velocities.len() + j;
            for (k, value) in wrench.into_iter().enumerate() {
                wrenches[block * BLOCK + k * POINT_PADDING + i % POINT_PADDING] = value;
            }
        }
    }
    wrenches
}

fn is_near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs())
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    norm(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// Loss and pose gradient.
fn evaluate(scene: &mut Scene<'_, f64>, pose: &HandPose, targets: &[f64]) -> (f64, Vec<f64>) {
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    scene.place(pose);
    let loss = scene.physics_loss(targets);
    scene.pull_back(pose, &mut gradient);
    (loss, flat(&gradient))
}

#[test]
fn loss_and_wrenches_are_those_of_the_method() {
    let params = params();
    for (variant, object) in [object(ball), object(cube)].iter().enumerate() {
        let pose = pose_at(object, CENTER, variant, DEPTH);
        assert!(touching(object, &pose, 0.0) >= 3);
        let mut scene = Scene::<f64>::new(&*HAND, object, &params);
        let targets = targets(scene.wrench_len());
        scene.place(&pose);
        for smoothing in [0.0, SMOOTHING] {
            scene.set_smoothing(smoothing);
            scene.contact_wrenches();
            let expected = wrenches_by_the_book(&scene, object, &params, smoothing);
            let weight = &HAND.contact_points().weight;
            for (index, (&wrench, &expected)) in scene.wrenches().iter().zip(&expected).enumerate()
            {
                let point = index / (3 * BLOCK) * POINT_PADDING + index % POINT_PADDING;
                let is_padding = weight[point] == 0.0;
                assert!(is_padding || (wrench - expected).abs() <= ROUNDING * 1e4);
            }
            let residuals = expected
                .iter()
                .zip(&targets)
                .map(|(f, t)| (f - t) * (f - t));
            let expected: f64 = residuals.sum();
            assert!(is_near(scene.physics_loss(&targets), expected, ROUNDING));
        }
    }
}

#[test]
fn other_constants_of_the_law_take_effect_at_once() {
    let (object, params) = (object(ball), params());
    let pose = pose_at(&object, CENTER, 0, DEPTH);
    let mut softer = params.clone();
    softer.contact.normal_stiffness = 2e5;
    softer.contact.friction_coefficient = 0.3;
    softer.contact.friction_stiffness = 3e7;
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let targets = targets(scene.wrench_len());
    let stiff = evaluate(&mut scene, &pose, &targets);
    scene.set_contact(softer.contact);
    let changed = evaluate(&mut scene, &pose, &targets);
    let fresh = evaluate(&mut Scene::new(&*HAND, &object, &softer), &pose, &targets);
    assert_eq!(changed, fresh);
    assert!(changed.0 < 0.5 * stiff.0);
}

#[test]
fn single_precision_agrees_with_double() {
    let params = params();
    for (variant, object) in [object(ball), object(cube)].iter().enumerate() {
        let pose = pose_at(object, CENTER, variant, DEPTH);
        let mut double = Scene::<f64>::new(&*HAND, object, &params);
        let mut single = Scene::<f32>::new(&*HAND, object, &params);
        let targets = targets(double.wrench_len());
        let targets_single: Vec<f32> = targets.iter().map(|&v| v as f32).collect();
        for smoothing in [0.0, SMOOTHING] {
            double.set_smoothing(smoothing);
            single.set_smoothing(smoothing);
            let (expected, expected_gradient) = evaluate(&mut double, &pose, &targets);
            let mut gradient = PoseGradient::zero(16);
            single.place(&pose);
            let loss = single.physics_loss(&targets_single);
            single.pull_back(&pose, &mut gradient);
            assert!(is_near(loss, expected, SINGLE), "{loss} against {expected}");
            let off = distance(&flat(&gradient), &expected_gradient);
            assert!(off <= SINGLE * norm(&expected_gradient));

            double.contact_wrenches();
            single.contact_wrenches();
            let wrenches: Vec<f64> = single.wrenches().iter().map(|&v| v.into()).collect();
            let off = distance(&wrenches, double.wrenches());
            assert!(off <= SINGLE * norm(double.wrenches()));

            let task = double.task(&targets).loss;
            let task_single = single.task(&targets_single).loss;
            assert!(is_near(task_single, task, 1e-5));
            let mut by_target = vec![0.0; targets.len()];
            let mut by_target_single = vec![0.0; targets.len()];
            double.target_gradient(&targets, 1e-2, 3.0, &mut by_target);
            single.target_gradient(&targets_single, 1e-2, 3.0, &mut by_target_single);
            let by_target_single: Vec<f64> = by_target_single.iter().map(|&v| v.into()).collect();
            assert!(distance(&by_target_single, &by_target) <= SINGLE * norm(&by_target));
        }
        assert!(is_near(
            single.closest_distance(),
            double.closest_distance(),
            SINGLE
        ));
    }
}

#[test]
fn padding_has_no_influence() {
    let (object, params) = (object(ball), params());
    let pose = pose_at(&object, CENTER, 2, DEPTH);
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let targets = targets(scene.wrench_len());
    let weight = &HAND.contact_points().weight;
    assert!(
        weight.contains(&0.0),
        "this hand has no padding: the test tests nothing"
    );
    let is_padding =
        |index: usize| weight[index / (3 * BLOCK) * POINT_PADDING + index % POINT_PADDING] == 0.0;
    let mut disturbed = targets.clone();
    for (index, value) in disturbed.iter_mut().enumerate() {
        if is_padding(index) {
            *value = 1e9;
        }
    }
    let expected = evaluate(&mut scene, &pose, &targets);
    assert_eq!(evaluate(&mut scene, &pose, &disturbed), expected);

    scene.contact_wrenches();
    scene.task(&targets);
    let mut gradient = vec![f64::NAN; targets.len()];
    scene.target_gradient(&targets, 1e-2, 1.0, &mut gradient);
    let padding = (0..targets.len()).filter(|&i| is_padding(i));
    assert!(padding.clone().all(|i| gradient[i] == 0.0));
    assert!(gradient.iter().all(|v| v.is_finite()));
    assert_eq!(
        padding.count(),
        (weight.len() - HAND.contact_points().count) * 18
    );
}

#[test]
fn a_scene_remembers_nothing_of_earlier_poses() {
    let (object, params) = (object(cube), params());
    let poses = [3, 4].map(|variant| pose_at(&object, CENTER, variant, DEPTH));
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let targets = targets(scene.wrench_len());
    let first = evaluate(&mut scene, &poses[0], &targets);
    let second = evaluate(&mut scene, &poses[1], &targets);
    assert_ne!(first, second);
    assert_eq!(evaluate(&mut scene, &poses[0], &targets), first);
}

#[test]
fn the_closest_distance_is_that_of_the_undilated_object() {
    let (object, params) = (object(ball), params());
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    scene.set_smoothing(SMOOTHING);
    scene.place(&pose_at(&object, CENTER, 5, DEPTH));
    let points = (0..scene.contacts().len()).map(|i| ball(scene.contacts().get(i)));
    let exact = points.fold(f64::INFINITY, f64::min);
    // Interpolation between samples 3 mm apart on a ball of 4 cm: spacing^2 / (8 radius) per axis.
    assert!((scene.closest_distance() - exact).abs() < 1e-4);
    assert!((scene.closest_distance() + DEPTH).abs() < 1e-9);
}

/// Dilated by 5 cm, the object touches contacts outside its grid, where the nearest sample gives no shape.
#[test]
fn distances_outside_the_grid_are_by_the_nearest_sample_if_so_set() {
    const RADIUS: f64 = 0.05;
    let object = object(ball);
    let params = SimulationParams {
        nearest_sample_outside: true,
        ..params()
    };
    let pose = pose_at(&object, CENTER, 6, -0.02);
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    scene.set_smoothing(RADIUS);
    scene.place(&pose);
    scene.contact_wrenches();
    let mut outside = 0;
    let sdf = object.sdf();
    for c in 0..scene.contacts().len() {
        let p = scene.contacts().get(c);
        let (distance, gradient) = sdf.distance_and_gradient_by_nearest_sample(p, None);
        // The object is at rest in the first simulation: normal force alone.
        let force = gradient.normalize_or_zero()
            * (params.contact.normal_stiffness * (distance - RADIUS).min(0.0));
        for (k, expected) in [force.x, force.y, force.z].into_iter().enumerate() {
            let found = scene.wrenches()[c / 8 * 3 * BLOCK + (3 + k) * 8 + c % 8];
            assert!(
                (found - expected).abs() <= 1e-9 * (1.0 + expected.abs()),
                "{found} {expected}"
            );
        }
        outside += usize::from(distance < RADIUS && gradient != sdf.distance_and_gradient(p).1);
    }
    assert!(outside > 10, "{outside}");
}
