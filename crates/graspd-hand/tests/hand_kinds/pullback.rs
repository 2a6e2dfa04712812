//! Pullbacks of every kind of hand, and of mirror images, against central differences and the tape.

use graspd_geom::{Quaternion, Rigid, Vec3};
use graspd_hand::{
    ArticulatedHand, Hand, HandPose, Kinematics, MirroredHand, PointBuffer, PoseGradient, allegro,
    barrett, leap,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{BARRETT, LEAP, LEFT, at_origin, coarse, file, within_limits};

struct Evaluated {
    contacts: PointBuffer<f64>,
    spheres: PointBuffer<f64>,
    gradient: PoseGradient,
}

/// Points, and the pullback of a scalar that is not symmetric in anything.
fn evaluated(hand: &dyn Hand, pose: &HandPose) -> (f64, Evaluated) {
    let mut scratch = hand.new_scratch();
    let mut contacts = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(hand.collision_spheres().radius.len());
    hand.forward(pose, &mut scratch, &mut contacts, &mut spheres);
    let mut value = 0.0;
    let mut derivative = |points: &PointBuffer<f64>| {
        let mut gradient = PointBuffer::zeros(points.len());
        for i in 0..points.len() {
            let (w, a) = coefficient(i);
            let p = points.get(i);
            value += w.dot(p) + a * p.norm_squared();
            gradient.set(i, w + p * (2.0 * a));
        }
        gradient
    };
    let (contact_gradient, sphere_gradient) = (derivative(&contacts), derivative(&spheres));
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    hand.pullback(
        pose,
        &mut scratch,
        &contacts,
        &contact_gradient,
        &spheres,
        &sphere_gradient,
        &mut gradient,
    );
    (
        value,
        Evaluated {
            contacts,
            spheres,
            gradient,
        },
    )
}

fn coefficient(index: usize) -> (Vec3<f64>, f64) {
    let i = index as f64;
    (
        Vec3::new((i * 1.3).sin(), (i * 0.7).cos(), (i * 2.1).sin()),
        (i * 0.37).cos(),
    )
}

fn flat(gradient: &PoseGradient) -> Vec<f64> {
    let (t, r) = (gradient.translation, gradient.rotation);
    [t.x, t.y, t.z, r.x, r.y, r.z]
        .into_iter()
        .chain(gradient.articulation.iter().copied())
        .collect()
}

fn moved(pose: &HandPose, index: usize, amount: f64) -> HandPose {
    let mut moved = pose.clone();
    let mut unit = [0.0; 3];
    if index < 6 {
        unit[index % 3] = amount;
    }
    match index {
        0..3 => moved.translation += Vec3::from(unit),
        3..6 => moved.rotation = Quaternion::exp(Vec3::from(unit)).compose(pose.rotation),
        _ => moved.articulation[index - 6] += amount,
    }
    moved
}

/// Central differences: truncation about 1e-10 and cancellation about 1e-11 relative at this step.
const STEP: f64 = 1e-5;
const DIFFERENCES: f64 = 1e-6;

fn assert_pullback(hand: &dyn Hand, pose: &HandPose) {
    let (_, exact) = evaluated(hand, pose);
    let exact = flat(&exact.gradient);
    let size = exact.iter().fold(1.0_f64, |m, g| m.max(g.abs()));
    for (index, exact) in exact.iter().enumerate() {
        let value = |amount: f64| evaluated(hand, &moved(pose, index, amount)).0;
        let difference = (value(STEP) - value(-STEP)) / (2.0 * STEP);
        let error = (difference - exact).abs();
        assert!(
            error <= DIFFERENCES * size,
            "{}, coordinate {index}: {exact} {difference}",
            hand.name()
        );
    }
}

/// The built-in hands, a hand with slides and followers, and mirror images of both kinds.
fn kinds() -> Vec<Box<dyn Hand>> {
    let mut kinds: Vec<Box<dyn Hand>> = vec![
        Box::new(leap(&coarse()).expect("default dimensions")),
        Box::new(barrett(&coarse()).expect("default dimensions")),
        Box::new(barrett(&coarse()).expect("default dimensions").mirrored()),
        Box::new(MirroredHand::new(Box::new(
            allegro(&coarse()).expect("default dimensions"),
        ))),
    ];
    for path in [LEAP, BARRETT, LEFT] {
        kinds.extend(file(path).map(|hand| Box::new(hand) as Box<dyn Hand>));
    }
    kinds
}

/// Contact points at `pose` in single precision with what rounding left of them, and in double.
fn both_ways(hand: &dyn Hand, pose: &HandPose) -> Vec<[Vec3<f64>; 2]> {
    let count = hand.contact_points().weight.len();
    let spheres = hand.collision_spheres().radius.len();
    let mut scratch = hand.new_scratch();
    let (mut single, mut double) = (PointBuffer::<f32>::zeros(count), PointBuffer::zeros(count));
    let mut centers = PointBuffer::<f64>::zeros(spheres);
    hand.forward(pose, &mut scratch, &mut double, &mut centers);
    let mut centers = PointBuffer::<f32>::zeros(spheres);
    hand.forward(pose, &mut scratch, &mut single, &mut centers);
    let remainder = scratch.contact_remainder();
    (0..count)
        .map(|i| [single.get(i) + remainder.get(i), double.get(i)])
        .collect()
}

#[test]
fn rounded_points_and_their_remainders_are_the_points() {
    /// Rounding of the remainder, and of sums in another order.
    const EXACT: f64 = 1e-14;
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut hands = kinds();
    let human = || graspd_hand::builtin_hand("human").expect("it is built in");
    hands.push(human());
    hands.push(Box::new(MirroredHand::new(human())));
    for hand in hands {
        let mut draw = || random.random_range(-1.0..1.0);
        let pose = HandPose {
            translation: Vec3::new(draw(), draw(), draw()) * 0.2,
            rotation: Quaternion::exp(Vec3::new(draw(), draw(), draw()) * 3.0),
            articulation: hand.open_articulation().to_vec(),
        };
        for (index, [found, expected]) in both_ways(hand.as_ref(), &pose).iter().enumerate() {
            let error = (*found - *expected).norm();
            assert!(error <= EXACT, "{}, point {index}: {error:e}", hand.name());
        }
    }
}

#[test]
fn pullbacks_are_derivatives_at_rest_at_limits_and_anywhere() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for hand in kinds() {
        let limits = hand.limits().expect("limits").to_vec();
        let count = limits.len();
        let mut articulations = vec![
            vec![0.0; count],
            limits.iter().map(|limit| limit.lower).collect(),
            limits.iter().map(|limit| limit.upper).collect(),
        ];
        articulations.extend((0..4).map(|_| within_limits(hand.as_ref(), &mut random)));
        for (index, articulation) in articulations.into_iter().enumerate() {
            let mut draw = || random.random_range(-1.0..1.0);
            // The first one with the base at rest, too.
            let turn = if index == 0 {
                Vec3::zero()
            } else {
                Vec3::new(draw(), draw(), draw()) * 3.0
            };
            let pose = HandPose {
                translation: Vec3::new(draw(), draw(), draw()) * 0.2,
                rotation: Quaternion::exp(turn).normalize(),
                articulation,
            };
            assert_pullback(hand.as_ref(), &pose);
        }
    }
}

/// The scalar of [`evaluated`] for a hand with its base at the origin, over any scalar type of articulation.
fn over_any_scalar<T: graspd_ad::Real>(hand: &ArticulatedHand, x: &[T]) -> T {
    let mut poses = vec![Rigid::identity(); hand.tree().body_count()];
    hand.tree().forward(&Rigid::identity(), x, &mut poses);
    let local = hand.local_contact_points();
    let contacts = (0..local.len()).map(|i| (i, hand.contact_points().body[i], local.get(i)));
    let centers = hand.local_sphere_centers().iter().enumerate();
    let spheres = centers.map(|(i, center)| (i, hand.collision_spheres().body[i], *center));
    let mut sum = T::zero();
    for (i, body, point) in contacts.chain(spheres) {
        let p = poses[body as usize].apply(Vec3::constant(point));
        let (w, a) = coefficient(i);
        sum += Vec3::constant(w).dot(p) + p.norm_squared() * T::constant(a);
    }
    sum
}

#[test]
fn pullbacks_through_followers_and_mirrors_are_reverse_mode() {
    let original = barrett(&coarse()).expect("default dimensions");
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for hand in [original.mirrored(), original] {
        let articulation = within_limits(&hand, &mut random);
        let (value, exact) = evaluated(&hand, &at_origin(articulation.clone()));
        let (taped_value, taped) =
            graspd_ad::gradient(|x| over_any_scalar(&hand, x), &articulation);
        assert!((value - taped_value).abs() < 1e-12 * value.abs().max(1.0));
        for (a, b) in taped.iter().zip(&exact.gradient.articulation) {
            assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} {b}");
        }
    }
}

#[test]
fn both_ways_of_mirroring_give_the_same_hand_and_twice_gives_the_original() {
    let original = leap(&coarse()).expect("default dimensions");
    let inner = original.mirrored();
    let outer = MirroredHand::new(Box::new(original.clone()));
    assert_eq!(
        (inner.name(), outer.name()),
        ("leap_mirrored", "leap_mirrored")
    );
    let twice = inner.mirrored();
    assert_eq!(twice.name(), "leap");
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let pose = HandPose {
        translation: Vec3::new(0.1, -0.2, 0.3),
        rotation: Quaternion::exp(Vec3::new(0.4, 2.0, -1.0)).normalize(),
        articulation: within_limits(&original, &mut random),
    };
    let near = |a: &dyn Hand, b: &dyn Hand| {
        let [(_, a), (_, b)] = [a, b].map(|hand| evaluated(hand, &pose));
        for (p, q) in [(&a.contacts, &b.contacts), (&a.spheres, &b.spheres)] {
            assert!((0..p.len()).all(|i| (p.get(i) - q.get(i)).norm() < 1e-12));
        }
        let size = flat(&a.gradient)
            .iter()
            .fold(1.0_f64, |m, g| m.max(g.abs()));
        assert!(
            flat(&a.gradient)
                .iter()
                .zip(flat(&b.gradient))
                .all(|(p, q)| (p - q).abs() < 1e-11 * size)
        );
    };
    near(&inner, &outer);
    near(&original, &twice);
    assert!((inner.palm().normal - outer.palm().normal).norm() < 1e-12);
    // In single precision, too; and the surface encloses as much as before.
    let mut scratch = outer.new_scratch();
    let mut points = PointBuffer::<f32>::zeros(outer.contact_points().weight.len());
    let mut spheres = PointBuffer::zeros(outer.collision_spheres().radius.len());
    outer.forward(&pose, &mut scratch, &mut points, &mut spheres);
    let (_, exact) = evaluated(&inner, &pose);
    assert!((0..points.len()).all(|i| (points.get(i) - exact.contacts.get(i)).norm() < 1e-6));
    let volumes = [&inner as &dyn Hand, &outer, &original]
        .map(|hand| graspd_geom::signed_volume(&hand.surface(&pose)));
    assert!(
        volumes
            .iter()
            .all(|volume| (volume - volumes[2]).abs() < 1e-9 * volumes[2]),
        "{volumes:?}"
    );
}
