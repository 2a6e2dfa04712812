//! The task constraint on the contacts' own wrenches, and the larger world.

use graspd_geom::Vec3;
use graspd_hand::{Hand, PoseGradient};
use graspd_sim::{
    ContactParams, ContactState, Scene, SimulatedObject, SimulationParams, Twist, Wrench,
    step_twist, task_loss,
};
use nalgebra::Point3;

use crate::setting::{
    BLOCK, CENTER, CENTER_OF_MASS, HAND, ball, flat, inertia, moved, object, params, pose_at,
};

/// Central differences of step 1e-7 over losses of hundreds of contacts, few of which cross a cell of the grid.
const DIFFERENCE: f64 = 1e-4;
/// Sums of the same terms in another order.
const ROUNDING: f64 = 1e-12;

/// Soft contacts, so that wrenches do not dwarf the velocities; without leak, so that the gradient is the loss's own.
fn soft() -> SimulationParams {
    SimulationParams {
        contact: ContactParams {
            normal_stiffness: 1e4,
            friction_stiffness: 1e6,
            leak: 0.0,
            ..ContactParams::default()
        },
        ..params()
    }
}

#[test]
fn the_gradient_of_the_task_of_contacts_is_that_of_differences() {
    let (object, params) = (object(ball), soft());
    let pose = pose_at(&object, CENTER, 6, 2e-3);
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    let mut loss = |index: usize, step: f64| {
        scene.place(&moved(&pose, index, step));
        scene.task_of_contacts(|_| 1.0)
    };
    const STEP: f64 = 1e-7;
    let numeric: Vec<[f64; 2]> = (0..22)
        .map(|i| {
            let middle = loss(i, 0.0);
            [
                (loss(i, STEP) - middle) / STEP,
                (middle - loss(i, -STEP)) / STEP,
            ]
        })
        .collect();
    scene.place(&pose);
    let mut seen = 0.0;
    let value = scene.task_of_contacts(|loss| {
        seen = loss;
        3.0
    });
    assert_eq!(value, seen);
    assert!(value > 0.0 && value != task_loss(&params.velocities));
    let mut gradient = PoseGradient::zero(16);
    scene.pull_back(&pose, &mut gradient);
    let claimed = flat(&gradient);
    let largest = claimed.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(largest > 0.0);
    let mut checked = 0;
    for (claimed, [right, left]) in claimed.iter().zip(&numeric) {
        // Beside a kink the two sides differ.
        if (right - left).abs() > DIFFERENCE * largest {
            continue;
        }
        checked += 1;
        let central = 3.0 * 0.5 * (right + left);
        assert!(
            (claimed - central).abs() <= DIFFERENCE * largest,
            "{claimed} {central}"
        );
    }
    assert!(checked >= 15, "{checked}");
}

#[test]
fn single_precision_has_the_same_task_of_contacts() {
    let (object, params) = (object(ball), soft());
    let pose = pose_at(&object, CENTER, 6, 2e-3);
    let mut exact = Scene::<f64>::new(&*HAND, &object, &params);
    let mut quick = Scene::<f32>::new(&*HAND, &object, &params);
    exact.place(&pose);
    quick.place(&pose);
    let (a, b) = (
        exact.task_of_contacts(|_| 1.0),
        quick.task_of_contacts(|_| 1.0),
    );
    assert!((a - b).abs() <= 1e-3 * a, "{a} {b}");
    let mut gradients = [PoseGradient::zero(16), PoseGradient::zero(16)];
    exact.pull_back(&pose, &mut gradients[0]);
    quick.pull_back(&pose, &mut gradients[1]);
    let [a, b] = gradients.map(|gradient| flat(&gradient));
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let apart: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    assert!(norm(&apart) < 1e-3 * norm(&a));
}

/// Hand and object at s times their size, computed contact by contact as if they were that large.
#[test]
fn a_length_scale_is_a_larger_world() {
    const SCALE: f64 = 2.0;
    let object = object(ball);
    let pose = pose_at(&object, CENTER, 6, 2e-3);
    let larger = soft();
    let mut params = larger.clone();
    params.length_scale = SCALE;
    // Depths are real ones: stiffnesses are those of the larger world times its scale.
    params.contact.normal_stiffness *= SCALE;
    params.contact.friction_stiffness *= SCALE;
    let mut scene = Scene::<f64>::new(&*HAND, &object, &params);
    scene.place(&pose);
    let loss = scene.task_of_contacts(|_| 1.0);

    let giant = SimulatedObject::new(
        object.sdf().clone(),
        object.mass() * SCALE.powi(3),
        Point3::from(CENTER_OF_MASS) * SCALE,
        inertia() * SCALE.powi(5),
    )
    .unwrap();
    let weight = &HAND.contact_points().weight;
    let mut touching = 0;
    let twists: Vec<Twist<f64>> = (larger.velocities.iter().enumerate())
        .map(|(j, twist)| {
            let mut total = Wrench {
                torque: Vec3::zero(),
                force: Vec3::zero(),
            };
            for c in 0..weight.len() {
                let p = scene.contacts().get(c);
                let (distance, gradient) = object.sdf().distance_and_gradient(p);
                let lever = p * SCALE - giant.center_of_mass();
                let state =
                    ContactState::new(distance * SCALE, gradient, lever, larger.contact.leak);
                let Wrench { torque, force } = state.wrench(twist, &larger.contact);
                let claimed =
                    |k: usize| scene.wrenches()[((c / 8 * 3) + j) * BLOCK + 8 * k + c % 8];
                let expected = [torque.x, torque.y, torque.z, force.x, force.y, force.z];
                for (k, expected) in expected.into_iter().enumerate() {
                    assert!((claimed(k) - expected).abs() <= ROUNDING * (1.0 + expected.abs()));
                }
                if weight[c] > 0.0 {
                    touching += usize::from(distance < 0.0);
                    total.torque += torque;
                    total.force += force;
                }
            }
            step_twist(&giant, twist, &total, larger.time_step)
        })
        .collect();
    assert!(touching > 10, "{touching}");
    let expected = task_loss(&twists);
    assert!(
        (loss - expected).abs() <= ROUNDING * expected,
        "{loss} {expected}"
    );
}
