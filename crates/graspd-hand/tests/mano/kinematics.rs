//! Positions against the plain implementation; the pullback against reverse mode and central differences.

use std::f64::consts::PI;
use std::sync::LazyLock;

use graspd_ad::{Element, Real, Tape};
use graspd_geom::{Mat3, Quaternion, Vec3, topology};
use graspd_hand::{
    Hand, HandPose, Kinematics, POSE_FEATURES, PointBuffer, PoseGradient, SkinnedHand,
    SkinnedHandOptions,
};
use nalgebra::Vector3;
use proptest::prelude::*;

use crate::jacobian_rows::assert_jacobian_rows;
use crate::{plain, synthetic};

/// Positions are about 0.3 m: double precision leaves nothing else.
const DOUBLE: f64 = 1e-12;
/// 0.5 m in single precision, after about 150 additions.
const SINGLE: f64 = 1e-6;
/// Rounding to single precision, relative.
const HALF_ULP: f64 = 6e-8;
/// Reverse mode sums in another order.
const REVERSE: f64 = 1e-10;
/// Step of central differences [rad or m]: truncation about 1e-10, cancellation about 1e-11 relative.
const STEP: f64 = 1e-5;
/// Agreement with central differences, relative to the gradient's size.
const DIFFERENCES: f64 = 1e-6;
/// Single-precision sums over 778 vertices, relative to the gradient's size.
const SINGLE_GRADIENT: f64 = 1e-5;

const SHAPE: [f64; 3] = [1.0, -0.5, 2.0];

static HAND: LazyLock<SkinnedHand> = LazyLock::new(|| {
    let options = SkinnedHandOptions {
        shape: SHAPE.to_vec(),
        ..SkinnedHandOptions::default()
    };
    SkinnedHand::new(synthetic::model(1), &options).expect("the made-up model is sound")
});

struct Placed<E> {
    contacts: PointBuffer<E>,
    spheres: PointBuffer<E>,
    scratch: graspd_hand::HandScratch,
}

fn forward<E: Element>(hand: &SkinnedHand, pose: &HandPose) -> Placed<E>
where
    SkinnedHand: Kinematics<E>,
{
    let mut placed = Placed {
        contacts: PointBuffer::zeros(hand.contact_points().weight.len()),
        spheres: PointBuffer::zeros(hand.collision_spheres().radius.len()),
        scratch: hand.new_scratch(),
    };
    let Placed {
        contacts,
        spheres,
        scratch,
    } = &mut placed;
    hand.forward(pose, scratch, contacts, spheres);
    placed
}

/// A scalar of all positions that is not symmetric in anything: sum of w_i . p_i + |p_i|^2 a_i.
fn coefficient(index: usize) -> (Vec3<f64>, f64) {
    let i = index as f64;
    let w = Vec3::new((i * 1.3).sin(), (i * 0.7).cos(), (i * 2.1).sin());
    (w, (i * 0.37).cos())
}

fn scalar_of<T: Real>(points: impl Iterator<Item = Vec3<T>>) -> T {
    let terms = points.enumerate().map(|(i, p)| {
        let (w, a) = coefficient(i);
        p.dot(Vec3::constant(w)) + p.norm_squared().scale(a)
    });
    terms.fold(T::zero(), |sum, term| sum + term)
}

/// Gradient of [`scalar_of`] over contact points that are not padding, and over sphere centers, pulled back.
fn pulled_back<E: Element>(hand: &SkinnedHand, pose: &HandPose) -> Vec<f64>
where
    SkinnedHand: Kinematics<E>,
{
    let mut placed = forward::<E>(hand, pose);
    let gradient_of = |points: &PointBuffer<E>, count: usize| {
        let mut gradient = PointBuffer::<E>::zeros(points.len());
        for i in 0..count {
            let (w, a) = coefficient(i);
            gradient.set(i, w + points.get(i) * (2.0 * a));
        }
        gradient
    };
    let contact_gradient = gradient_of(&placed.contacts, hand.contact_points().count);
    let sphere_gradient = gradient_of(&placed.spheres, placed.spheres.len());
    // What was there before must not count.
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    gradient.articulation.fill(f64::NAN);
    hand.pullback(
        pose,
        &mut placed.scratch,
        &placed.contacts,
        &contact_gradient,
        &placed.spheres,
        &sphere_gradient,
        &mut gradient,
    );
    let (t, r) = (gradient.translation, gradient.rotation);
    [t.x, t.y, t.z, r.x, r.y, r.z]
        .into_iter()
        .chain(gradient.articulation)
        .collect()
}

fn scalar(hand: &SkinnedHand, pose: &HandPose) -> f64 {
    let placed = forward::<f64>(hand, pose);
    let count = hand.contact_points().count;
    scalar_of((0..count).map(|i| placed.contacts.get(i)))
        + scalar_of((0..placed.spheres.len()).map(|i| placed.spheres.get(i)))
}

/// The pose moved by `amount` along coordinate `index` of the tangent space.
fn moved(pose: &HandPose, index: usize, amount: f64) -> HandPose {
    let mut moved = pose.clone();
    let unit = |axis: usize| {
        let mut v = [0.0; 3];
        v[axis] = amount;
        Vec3::from(v)
    };
    match index {
        0..3 => moved.translation += unit(index),
        3..6 => moved.rotation = Quaternion::exp(unit(index - 3)).compose(pose.rotation),
        _ => moved.articulation[index - 6] += amount,
    }
    moved
}

fn by_differences(hand: &SkinnedHand, pose: &HandPose) -> Vec<f64> {
    let at = |index, amount| scalar(hand, &moved(pose, index, amount));
    (0..6 + pose.articulation.len())
        .map(|index| (at(index, STEP) - at(index, -STEP)) / (2.0 * STEP))
        .collect()
}

/// The gradient of the contact points' scalar by reverse mode through the plain generic functions.
fn by_tape(hand: &SkinnedHand, pose: &HandPose) -> Vec<f64> {
    let mut tape = Tape::new();
    tape.scope(|recording| {
        let base = [0.0; 6].map(|x| recording.variable(x));
        let articulation: Vec<_> = pose
            .articulation
            .iter()
            .map(|&x| recording.variable(x))
            .collect();
        let turn = Quaternion::exp(Vec3::new(base[3], base[4], base[5])).to_matrix();
        let rotation = turn.compose(&Mat3::constant(&pose.rotation.to_matrix()));
        let translation = Vec3::constant(pose.translation) + Vec3::new(base[0], base[1], base[2]);
        let rest: Vec<_> = hand
            .rest_vertices()
            .iter()
            .map(|&v| Vec3::constant(v))
            .collect();
        let joints = hand.rest_joints().map(Vec3::constant);
        let posed = hand.model().posed_vertices(
            &rest,
            &joints,
            &hand.pose_of(&articulation),
            &rotation,
            translation,
        );
        let slots = &hand.contact_vertices()[..hand.contact_points().count];
        let sum = scalar_of(slots.iter().map(|&v| posed[v as usize]));
        let adjoints = recording.adjoints(sum);
        base.iter()
            .chain(&articulation)
            .map(|&x| adjoints.of(x))
            .collect()
    })
}

fn without_spheres() -> SkinnedHand {
    let options = SkinnedHandOptions {
        shape: SHAPE.to_vec(),
        collision_spheres: false,
        ..SkinnedHandOptions::default()
    };
    SkinnedHand::new(synthetic::model(1), &options).expect("the made-up model is sound")
}

#[track_caller]
fn assert_near(left: &[f64], right: &[f64], relative: f64) {
    assert_eq!(left.len(), right.len());
    let size = right.iter().fold(1e-3_f64, |size, x| size.max(x.abs()));
    for (index, (a, b)) in left.iter().zip(right).enumerate() {
        assert!(
            (a - b).abs() <= relative * size,
            "entry {index}: {a} and {b}, size {size}"
        );
    }
}

fn poses() -> impl Strategy<Value = HandPose> {
    (
        prop::array::uniform6(-1.0..1.0),
        prop::collection::vec(-1.0..1.0, 45),
    )
        .prop_map(|(b, articulation)| HandPose {
            translation: Vec3::new(b[0], b[1], b[2]) * 0.3,
            rotation: Quaternion::exp(Vec3::new(b[3], b[4], b[5]) * 3.0),
            articulation,
        })
}

/// A pose whose rotation vectors are exactly those given.
fn pose_with(theta: &[f64; 45]) -> HandPose {
    let hand = &*HAND;
    let mean = hand.model().pose_mean;
    let offset: Vec<f64> = theta.iter().zip(mean).map(|(t, m)| t - m).collect();
    // The components are orthonormal.
    let coefficient = |row: &[f64; 45]| row.iter().zip(&offset).map(|(r, o)| r * o).sum();
    HandPose {
        translation: Vec3::new(0.1, -0.2, 0.05),
        rotation: Quaternion::exp(Vec3::new(0.3, 2.0, -0.4)),
        articulation: hand
            .model()
            .pose_components
            .iter()
            .map(coefficient)
            .collect(),
    }
}

#[track_caller]
fn assert_placed_as_plain<E: Element>(hand: &SkinnedHand, pose: &HandPose, tolerance: f64)
where
    SkinnedHand: Kinematics<E>,
{
    let theta = plain::pose(hand.model(), &pose.articulation, false);
    let expected = plain::skinned(hand.model(), &SHAPE, &theta, pose);
    let placed = forward::<E>(hand, pose);
    for (slot, &vertex) in hand.contact_vertices().iter().enumerate() {
        let error = (Vector3::from(placed.contacts.get(slot)) - expected[vertex as usize]).norm();
        assert!(error <= tolerance, "vertex {vertex} is off by {error}");
    }
}

/// Only the blendshapes are rounded to single precision, and the sums of their 135 terms.
fn assert_remainder_is_kept(hand: &SkinnedHand, pose: &HandPose) {
    let (single, double) = (forward::<f32>(hand, pose), forward::<f64>(hand, pose));
    let remainder = &single.scratch.contact_remainder;
    let directions = hand.model().pose_directions.as_deref().unwrap_or_default();
    let of_vertex = 3 * POSE_FEATURES;
    for (slot, &vertex) in hand.contact_vertices().iter().enumerate() {
        let sum = single.contacts.get(slot) + remainder.get(slot);
        let error = (sum - double.contacts.get(slot)).norm();
        // Entries of a rotation less those of the identity are at most 2.
        let terms = directions.chunks(of_vertex).nth(vertex as usize);
        let most: f64 = terms.map_or(0.0, |terms| terms.iter().map(|d| 2.0 * d.abs()).sum());
        let tolerance = DOUBLE + 16.0 * HALF_ULP * most;
        assert!(
            error <= tolerance,
            "slot {slot} is off by {error:e}, allowed {tolerance:e}"
        );
    }
}

/// Everything that is claimed of one pose.
fn check(pose: &HandPose) {
    let hand = &*HAND;
    assert_remainder_is_kept(hand, pose);
    assert_placed_as_plain::<f64>(hand, pose, DOUBLE);
    assert_placed_as_plain::<f32>(hand, pose, SINGLE);
    let pulled = pulled_back::<f64>(hand, pose);
    assert_near(&pulled, &by_differences(hand, pose), DIFFERENCES);
    assert_near(&pulled_back::<f32>(hand, pose), &pulled, SINGLE_GRADIENT);
    let bare = without_spheres();
    assert_near(
        &pulled_back::<f64>(&bare, pose),
        &by_tape(&bare, pose),
        REVERSE,
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn positions_and_pullback_at_random_poses(pose in poses()) {
        check(&pose);
    }
}

#[test]
fn at_rotation_vectors_of_zero_and_near_it() {
    check(&pose_with(&[0.0; 45]));
    for angle in [1e-12, 1e-6, 1e-3, 0.0099, 0.0101] {
        check(&pose_with(&std::array::from_fn(|k| {
            angle * (k as f64).sin()
        })));
    }
}

#[test]
fn at_rotation_vectors_of_length_pi_and_beyond() {
    for angle in [PI - 1e-9, PI, PI + 1e-9, 2.0 * PI, 7.0] {
        // Another axis for each joint.
        let theta = std::array::from_fn(|k| {
            let axis = Vector3::from_fn(|i, _| (1.0 + (3 * (k / 3) + i) as f64).sin()).normalize();
            angle * axis[k % 3]
        });
        check(&pose_with(&theta));
    }
}

#[test]
fn coefficients_at_zero_and_a_base_turned_by_half() {
    check(&HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion {
            w: 0.0,
            x: 1.0,
            y: 0.0,
            z: 0.0,
        },
        articulation: vec![0.0; 45],
    });
}

#[test]
fn shape_blending_and_joint_regression_are_the_plain_ones() {
    let hand = &*HAND;
    let (vertices, joints) = plain::shaped(&synthetic::model(1), &SHAPE);
    for (a, b) in hand.rest_vertices().iter().zip(&vertices) {
        assert!((Vector3::from(*a) - b).norm() <= DOUBLE);
    }
    for (a, b) in hand.rest_joints().iter().zip(&joints) {
        assert!((Vector3::from(*a) - b).norm() <= DOUBLE);
    }
}

#[test]
fn fewer_components_and_the_flat_hand() {
    let options = SkinnedHandOptions {
        components: 6,
        flat_mean: true,
        ..SkinnedHandOptions::default()
    };
    let hand = SkinnedHand::new(synthetic::model(2), &options).unwrap();
    assert_eq!(
        hand.articulation_names(),
        ["pca_0", "pca_1", "pca_2", "pca_3", "pca_4", "pca_5"]
    );
    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: vec![0.5, -0.25, 1.0, 0.0, 0.125, -1.0],
    };
    let theta = plain::pose(hand.model(), &pose.articulation, true);
    let expected = plain::skinned(hand.model(), &[], &theta, &pose);
    let placed = forward::<f64>(&hand, &pose);
    for (slot, &vertex) in hand.contact_vertices().iter().enumerate() {
        let error = (Vector3::from(placed.contacts.get(slot)) - expected[vertex as usize]).norm();
        assert!(error <= DOUBLE);
    }
    // Counted from the flat hand, the open hand is the flat one.
    assert!(hand.open_articulation().iter().all(|c| c.abs() < 1e-12));
}

#[test]
fn the_open_hand_is_flat_where_the_components_span_all_poses() {
    let hand = &*HAND;
    let pose = hand.pose_of(hand.open_articulation());
    assert!(pose.iter().all(|angle: &f64| angle.abs() < 1e-12));
}

#[test]
fn the_surface_is_closed_outward_and_follows_the_contact_points() {
    let hand = &*HAND;
    let pose = pose_with(&std::array::from_fn(|k| 0.3 * (k as f64).sin()));
    let surface = hand.surface(&pose);
    assert!(topology(&surface).is_closed());
    let volume: f64 = (0..surface.faces.len())
        .map(|face| {
            surface.corners(face)[0]
                .coords
                .dot(&surface.area_vector(face))
        })
        .sum();
    assert!(volume > 0.0);
    let placed = forward::<f64>(hand, &pose);
    for (slot, &vertex) in hand.contact_vertices().iter().enumerate() {
        let point = Vector3::from(placed.contacts.get(slot));
        assert!((surface.vertices[vertex as usize].coords - point).norm() < DOUBLE);
    }
    // One middle for the wrist's ring of 16.
    assert_eq!(surface.vertices.len(), synthetic::VERTICES + 1);
    assert_eq!(surface.faces.len(), synthetic::FACES + 16);
}

#[test]
fn manos_own_placement_goes_there_and_back() {
    let hand = &*HAND;
    let (orient, trans) = ([0.4, -1.2, 0.7], [0.05, 0.1, -0.2]);
    let pose = hand.pose_from_mano(orient, trans, &[0.5, -0.5]);
    // The wrist joint is the point that only moves by `trans`.
    let wrist = hand.rest_joints()[0];
    let moved = pose.rotation.to_matrix().apply(wrist) + pose.translation;
    assert!((moved - wrist - Vec3::from(trans)).norm() < DOUBLE);
    let (orient_again, trans_again) = hand.mano_placement(&pose);
    for (a, b) in orient
        .iter()
        .zip(orient_again)
        .chain(trans.iter().zip(trans_again))
    {
        assert!((a - b).abs() < DOUBLE);
    }
    assert_eq!(pose.articulation[..3], [0.5, -0.5, 0.0]);
}

#[test]
fn the_palm_of_either_hand_is_found() {
    let mut model = synthetic::model(1);
    // No mean pose: joints and tips alone must tell.
    model.pose_mean = [0.0; 45];
    let mut mirrored = model.clone();
    for vertex in &mut mirrored.template {
        vertex[0] = -vertex[0];
    }
    for face in &mut mirrored.faces {
        face.swap(0, 1);
    }
    for model in [model, mirrored] {
        let hand = SkinnedHand::new(model, &SkinnedHandOptions::default()).unwrap();
        let palm = hand.palm();
        assert!(
            palm.normal.z > 0.9 && palm.fingers.y > 0.9 && palm.center.z > 0.005,
            "{palm:?}"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn points_follow_joints_and_blendshapes_as_differences_say(seed: u64) {
        assert_jacobian_rows(&*HAND, seed)?;
    }
}
