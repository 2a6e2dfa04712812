//! Moving hand and object together changes nothing, and dilating is subtracting a radius.

use graspd_geom::{Quaternion, Rigid, SdfGrid, Vec3};
use graspd_hand::{HandPose, POINT_PADDING, PoseGradient};
use graspd_sim::{Scene, SimulatedObject, SimulationParams, Twist};
use nalgebra::{Matrix3, Point3, Vector3};

use crate::setting::{
    BLOCK, CENTER, CENTER_OF_MASS, HAND, ball, inertia, object, params, pose_at, targets,
};

/// A half-space is interpolated exactly but for the single precision of its samples: 3e-8 m of depths of 1 mm, and
/// as much of its normal over the 10 mm of a cell.
const FLAT: f64 = 1e-5;
/// The same samples in another order, interpolated along the axes in another order.
const EXACT: f64 = 1e-11;

/// Distance above a tilted table through the ball's centre.
fn table(p: Vec3<f64>) -> f64 {
    (p - CENTER).dot(Vec3::new(0.6, -0.48, 0.64))
}

fn cube_grid(distance: impl FnMut(Vec3<f64>) -> f64, center: Vec3<f64>) -> SdfGrid {
    // All of the hand is inside: beyond the grid the distance depends on where its faces are.
    let origin = center - Vec3::new(0.35, 0.35, 0.35);
    let spacing = Vec3::new(0.01, 0.01, 0.01);
    SdfGrid::from_function(origin, spacing, [71; 3], distance).unwrap()
}

/// The same grasp in a frame moved by `motion`: object, velocities, pose, and targets.
fn everything_moved(
    motion: &Rigid<f64>,
    quaternion: Quaternion<f64>,
    distance: impl Fn(Vec3<f64>) -> f64,
    pose: &HandPose,
    targets: &[f64],
) -> (SimulatedObject, SimulationParams, HandPose, Vec<f64>) {
    let turn = |v: Vec3<f64>| motion.rotation.apply(v);
    let back = |p: Vec3<f64>| motion.rotation.apply_transposed(p - motion.translation);
    let rows = motion
        .rotation
        .rows
        .map(|row| Vector3::from(row).transpose());
    let matrix = Matrix3::from_rows(&rows);
    let object = SimulatedObject::new(
        cube_grid(|p| distance(back(p)), motion.apply(CENTER)),
        0.3,
        Point3::from(motion.apply(CENTER_OF_MASS.into())),
        matrix * inertia() * matrix.transpose(),
    );
    let mut params = params();
    for Twist { linear, angular } in &mut params.velocities {
        (*linear, *angular) = (turn(*linear), turn(*angular));
    }
    let pose = HandPose {
        translation: motion.apply(pose.translation),
        rotation: quaternion.compose(pose.rotation),
        articulation: pose.articulation.clone(),
    };
    let mut moved = targets.to_vec();
    for (block, out) in targets
        .chunks_exact(BLOCK)
        .zip(moved.chunks_exact_mut(BLOCK))
    {
        for lane in 0..POINT_PADDING {
            for first in [0, 3] {
                let at = |k: usize| (first + k) * POINT_PADDING + lane;
                let turned = turn(Vec3::new(block[at(0)], block[at(1)], block[at(2)]));
                (out[at(0)], out[at(1)], out[at(2)]) = (turned.x, turned.y, turned.z);
            }
        }
    }
    (object.unwrap(), params, pose, moved)
}

/// L_phys, L_task and the pose gradient.
fn evaluate(
    (object, params, pose, targets): &(SimulatedObject, SimulationParams, HandPose, Vec<f64>),
) -> (f64, f64, PoseGradient) {
    let mut scene = Scene::<f64>::new(&*HAND, object, params);
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    scene.place(pose);
    let loss = scene.physics_loss(targets);
    scene.pull_back(pose, &mut gradient);
    (loss, scene.task(targets).loss, gradient)
}

fn assert_invariant(
    motion: &Rigid<f64>,
    quaternion: Quaternion<f64>,
    distance: impl Fn(Vec3<f64>) -> f64 + Copy,
    tolerance: f64,
) {
    let still = Quaternion::identity();
    let at = SimulatedObject::new(
        cube_grid(distance, CENTER),
        0.3,
        Point3::from(CENTER_OF_MASS),
        inertia(),
    )
    .unwrap();
    let pose = pose_at(&at, CENTER, 8, 3e-3);
    let params = params();
    let targets = targets(Scene::<f64>::new(&*HAND, &at, &params).wrench_len());
    let before = evaluate(&everything_moved(
        &Rigid::identity(),
        still,
        distance,
        &pose,
        &targets,
    ));
    let after = evaluate(&everything_moved(
        motion, quaternion, distance, &pose, &targets,
    ));
    assert!((before.0 - after.0).abs() <= tolerance * before.0);
    assert!((before.1 - after.1).abs() <= 1e-9 * before.1);
    // The gradient by the base turns with it; that by the joints stays.
    let (a, b) = (before.2, after.2);
    let turned = motion.rotation.apply(a.translation);
    assert!((turned - b.translation).norm() <= tolerance * turned.norm());
    let turned = motion.rotation.apply(a.rotation);
    assert!((turned - b.rotation).norm() <= tolerance * turned.norm());
    let largest = a.articulation.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    assert!(largest > 0.0);
    for (a, b) in a.articulation.iter().zip(&b.articulation) {
        assert!((a - b).abs() <= tolerance * largest);
    }
}

#[test]
fn any_motion_of_hand_and_table_together_changes_nothing() {
    for turn in [[0.4, -1.1, 2.0], [-2.5, 0.3, 0.7]] {
        let rotation = Quaternion::exp(Vec3::from(turn));
        let motion = Rigid {
            rotation: rotation.to_matrix(),
            translation: Vec3::new(0.03, 0.07, -0.05),
        };
        assert_invariant(&motion, rotation, table, FLAT);
    }
}

#[test]
fn turning_axes_into_axes_changes_nothing_at_a_ball() {
    // x to y, y to z, z to x.
    let rotation = Quaternion {
        w: 0.5,
        x: 0.5,
        y: 0.5,
        z: 0.5,
    };
    let motion = Rigid {
        rotation: rotation.to_matrix(),
        translation: Vec3::zero(),
    };
    assert_invariant(&motion, rotation, ball, EXACT);
}

#[test]
fn dilating_is_subtracting_a_radius_from_the_distance() {
    let radius = 0.004;
    let (thin, thick) = (object(ball), object(|p| ball(p) - radius));
    let params = params();
    let pose = pose_at(&thick, CENTER, 9, 3e-3);
    let mut dilated = Scene::<f64>::new(&*HAND, &thin, &params);
    let mut exact = Scene::<f64>::new(&*HAND, &thick, &params);
    let targets = targets(exact.wrench_len());
    dilated.set_smoothing(radius);
    dilated.place(&pose);
    exact.place(&pose);
    let (a, b) = (dilated.physics_loss(&targets), exact.physics_loss(&targets));
    assert!((a - b).abs() <= FLAT * b);
    dilated.set_smoothing(0.0);
    assert!(
        dilated.physics_loss(&targets) < 0.9 * b,
        "only the dilated ball touches"
    );
}
