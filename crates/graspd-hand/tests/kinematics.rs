//! The hand's pullback against finite differences, in both precisions.

use graspd_geom::{Quaternion, Rigid, Vec3};
use graspd_hand::{
    ArticulatedHand, Hand, HandOptions, HandPose, Kinematics, PointBuffer, PoseGradient, allegro,
};
use proptest::prelude::*;
use rand::SeedableRng;
use std::sync::LazyLock;

/// Step of central differences [rad or m]: truncation about 1e-10, cancellation about 1e-11 relative.
const STEP: f64 = 1e-5;
/// Agreement of gradients with central differences, relative to the gradient's size.
const RELATIVE: f64 = 1e-6;
/// Single precision: positions near 0.5 m carry errors of 3e-8 m each.
const SINGLE: f64 = 1e-6;

static HAND: LazyLock<ArticulatedHand> = LazyLock::new(|| {
    let options = HandOptions {
        contact_points: 200,
        ..HandOptions::default()
    };
    allegro(&options).expect("the built-in hand is sound")
});

/// Buffers and scratch for one evaluation in precision E.
struct Buffers<E> {
    contacts: PointBuffer<E>,
    spheres: PointBuffer<E>,
}

fn forward<E: graspd_ad::Element>(pose: &HandPose) -> (Buffers<E>, graspd_hand::HandScratch)
where
    ArticulatedHand: Kinematics<E>,
{
    let mut scratch = HAND.new_scratch();
    let mut buffers = Buffers {
        contacts: PointBuffer::zeros(HAND.contact_points().weight.len()),
        spheres: PointBuffer::zeros(HAND.collision_spheres().radius.len()),
    };
    HAND.forward(
        pose,
        &mut scratch,
        &mut buffers.contacts,
        &mut buffers.spheres,
    );
    (buffers, scratch)
}

/// A scalar of all positions that is not symmetric in anything: sum of w_i . p_i + |p_i|^2 a_i.
fn coefficient(index: usize) -> (Vec3<f64>, f64) {
    let i = index as f64;
    let w = Vec3::new((i * 1.3).sin(), (i * 0.7).cos(), (i * 2.1).sin());
    (w, (i * 0.37).cos())
}

fn scalar_and_gradient(points: &PointBuffer<f64>, gradient: &mut PointBuffer<f64>) -> f64 {
    (0..points.len())
        .map(|i| {
            let (p, (w, a)) = (points.get(i), coefficient(i));
            gradient.set(i, w + p * (2.0 * a));
            w.dot(p) + a * p.norm_squared()
        })
        .sum()
}

fn scalar(pose: &HandPose) -> f64 {
    let (buffers, _) = forward::<f64>(pose);
    let mut unused = PointBuffer::zeros(buffers.contacts.len().max(buffers.spheres.len()));
    scalar_and_gradient(&buffers.contacts, &mut unused)
        + scalar_and_gradient(&buffers.spheres, &mut unused)
}

fn pulled_back(pose: &HandPose) -> PoseGradient {
    let (buffers, mut scratch) = forward::<f64>(pose);
    let mut contact_gradient = PointBuffer::zeros(buffers.contacts.len());
    let mut sphere_gradient = PointBuffer::zeros(buffers.spheres.len());
    scalar_and_gradient(&buffers.contacts, &mut contact_gradient);
    scalar_and_gradient(&buffers.spheres, &mut sphere_gradient);
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    HAND.pullback(
        pose,
        &mut scratch,
        &buffers.contacts,
        &contact_gradient,
        &buffers.spheres,
        &sphere_gradient,
        &mut gradient,
    );
    gradient
}

fn flat(gradient: &PoseGradient) -> Vec<f64> {
    let (t, r) = (gradient.translation, gradient.rotation);
    let base = [t.x, t.y, t.z, r.x, r.y, r.z];
    base.into_iter()
        .chain(gradient.articulation.iter().copied())
        .collect()
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

fn poses() -> impl Strategy<Value = HandPose> {
    let base = prop::array::uniform6(-1.0..1.0);
    (base, prop::collection::vec(-1.5..1.5, 16)).prop_map(|(b, articulation)| HandPose {
        translation: Vec3::new(b[0], b[1], b[2]) * 0.3,
        rotation: Quaternion::exp(Vec3::new(b[3], b[4], b[5]) * 3.0).normalize(),
        articulation,
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn pullback_is_the_derivative(pose in poses()) {
        let gradient = flat(&pulled_back(&pose));
        let size = gradient.iter().fold(1.0_f64, |m, g| m.max(g.abs()));
        for (index, exact) in gradient.iter().enumerate() {
            let ahead = scalar(&moved(&pose, index, STEP));
            let behind = scalar(&moved(&pose, index, -STEP));
            let difference = (ahead - behind) / (2.0 * STEP);
            prop_assert!(
                (difference - exact).abs() <= RELATIVE * size,
                "coordinate {index}: pullback {exact}, differences {difference}"
            );
        }
    }

    #[test]
    fn single_precision_is_close_to_double(pose in poses()) {
        let (double, mut scratch) = forward::<f64>(&pose);
        let (single, mut scratch_f32) = forward::<f32>(&pose);
        for i in 0..double.contacts.len() {
            let distance = (double.contacts.get(i) - single.contacts.get(i)).norm();
            prop_assert!(distance < SINGLE, "point {i} is {distance} m off");
        }
        let mut gradient = [PoseGradient::zero(16), PoseGradient::zero(16)];
        let (c, s) = (&double.contacts, &double.spheres);
        HAND.pullback(&pose, &mut scratch, c, c, s, s, &mut gradient[0]);
        let (c, s) = (&single.contacts, &single.spheres);
        HAND.pullback(&pose, &mut scratch_f32, c, c, s, s, &mut gradient[1]);
        let [exact, rounded] = gradient.map(|g| flat(&g));
        let size = exact.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        for (a, b) in exact.iter().zip(&rounded) {
            prop_assert!((a - b).abs() < 10.0 * SINGLE * size, "{a} {b}");
        }
    }
}

/// The scalar of `scalar`, over any scalar type, of translation, rotation vector (before `pose.rotation`) and
/// articulation.
fn scalar_over<T: graspd_ad::Real>(pose: &HandPose, x: &[T]) -> T {
    let turn = Quaternion::exp(Vec3::new(x[3], x[4], x[5]));
    let base = Rigid {
        rotation: turn
            .compose(Quaternion::constant(pose.rotation))
            .to_matrix(),
        translation: Vec3::new(x[0], x[1], x[2]),
    };
    let mut poses = vec![Rigid::identity(); HAND.tree().body_count()];
    HAND.tree().forward(&base, &x[6..], &mut poses);
    let local = HAND.local_contact_points();
    let contacts = (0..local.len()).map(|i| (i, HAND.contact_points().body[i], local.get(i)));
    let centers = HAND.local_sphere_centers().iter().enumerate();
    let spheres = centers.map(|(i, center)| (i, HAND.collision_spheres().body[i], *center));
    let mut sum = T::zero();
    for (i, body, point) in contacts.chain(spheres) {
        let p = poses[body as usize].apply(Vec3::constant(point));
        let (w, a) = coefficient(i);
        sum += Vec3::constant(w).dot(p) + p.norm_squared() * T::constant(a);
    }
    sum
}

/// Rounding of sums over some hundred points.
const EXACT: f64 = 1e-12;

#[test]
fn pullback_is_reverse_mode() {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    for _ in 0..8 {
        let limits = HAND
            .limits()
            .expect("an articulated hand has limits")
            .iter();
        let pose = HandPose {
            translation: Vec3::new(0.1, -0.2, 0.3),
            rotation: Quaternion::exp(Vec3::new(0.4, 2.0, -1.0)).normalize(),
            articulation: limits.map(|limit| limit.sample(&mut random)).collect(),
        };
        let t = pose.translation;
        let mut x = vec![t.x, t.y, t.z, 0.0, 0.0, 0.0];
        x.extend(&pose.articulation);
        let (value, reverse) = graspd_ad::gradient(|x| scalar_over(&pose, x), &x);
        assert!((value - scalar(&pose)).abs() < EXACT * value.abs().max(1.0));
        let pulled = flat(&pulled_back(&pose));
        let size = reverse.iter().fold(1.0_f64, |m, g| m.max(g.abs()));
        for (a, b) in reverse.iter().zip(&pulled) {
            assert!((a - b).abs() < EXACT * size, "{reverse:?} {pulled:?}");
        }
    }
}

#[test]
fn padding_without_gradient_has_no_influence() {
    let pose = HandPose {
        translation: Vec3::new(0.1, 0.2, -0.3),
        rotation: Quaternion::exp(Vec3::new(0.3, -0.5, 1.0)).normalize(),
        articulation: HAND.open_articulation().to_vec(),
    };
    let (mut buffers, mut scratch) = forward::<f64>(&pose);
    let weight = &HAND.contact_points().weight;
    assert!(weight.contains(&0.0), "nothing is padded");
    let mut gradient = PointBuffer::zeros(weight.len());
    scalar_and_gradient(&buffers.contacts, &mut gradient);
    let no_force = PointBuffer::zeros(buffers.spheres.len());
    let mut results = Vec::new();
    for displacement in [0.0, 1e3] {
        for i in (0..weight.len()).filter(|&i| weight[i] == 0.0) {
            gradient.set(i, Vec3::zero());
            let p = buffers.contacts.get(i);
            buffers
                .contacts
                .set(i, p + Vec3::new(displacement, 0.0, 0.0));
        }
        let mut result = PoseGradient::zero(16);
        HAND.pullback(
            &pose,
            &mut scratch,
            &buffers.contacts,
            &gradient,
            &buffers.spheres,
            &no_force,
            &mut result,
        );
        results.push(result);
    }
    assert_eq!(results[0], results[1]);
}
