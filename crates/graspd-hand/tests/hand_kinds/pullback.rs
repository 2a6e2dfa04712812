//! Pullbacks of every kind of hand, and of mirror images, against central differences and the tape.

use std::f64::consts::PI;

use graspd_ad::{Real, Tape};
use graspd_geom::{Mat3, Quaternion, Vec3};
use graspd_hand::{
    Hand, HandPose, Kinematics, Limit, MirroredHand, PointBuffer, PoseGradient, SkinnedHand,
    allegro, barrett, leap,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::kinds::{Kind, human_hand, make_human_hand, rigid, turning_gripper};
use crate::{ALLEGRO, BARRETT, LEAP, LEFT, RIGHT, coarse, file, within_limits};

pub(crate) struct Evaluated {
    contacts: PointBuffer<f64>,
    spheres: PointBuffer<f64>,
    pub(crate) gradient: PoseGradient,
}

/// What a scalar is made of.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Over {
    ContactsAndSpheres,
    Contacts,
}

/// Points, and the pullback of a scalar that is not symmetric in anything.
pub(crate) fn evaluated(hand: &dyn Hand, pose: &HandPose, over: Over) -> (f64, Evaluated) {
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
    let contact_gradient = derivative(&contacts);
    let sphere_gradient = match over {
        Over::ContactsAndSpheres => derivative(&spheres),
        Over::Contacts => PointBuffer::zeros(spheres.len()),
    };
    // What was there before must not count.
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    gradient.articulation.fill(f64::NAN);
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

pub(crate) fn flat(gradient: &PoseGradient) -> Vec<f64> {
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
/// Reverse mode sums up to 1600 points in another order.
const REVERSE: f64 = 1e-12;

/// Reverse mode through base and joints, for the contact points alone.
fn by_tape(kind: &Kind, pose: &HandPose) -> (f64, Vec<f64>) {
    let mut tape = Tape::new();
    tape.scope(|recording| {
        let base = [0.0; 6].map(|x| recording.variable(x));
        let articulation = recording.variables(&pose.articulation);
        let turn = Quaternion::exp(Vec3::new(base[3], base[4], base[5])).to_matrix();
        let rotation = turn.compose(&Mat3::constant(&pose.rotation.to_matrix()));
        let translation = Vec3::constant(pose.translation) + Vec3::new(base[0], base[1], base[2]);
        let mut sum = recording.variable(0.0);
        for (i, point) in kind.contacts_over(&articulation).into_iter().enumerate() {
            let (w, a) = coefficient(i);
            let p = rotation.apply(point) + translation;
            sum += p.dot(Vec3::constant(w)) + p.norm_squared().scale(a);
        }
        let adjoints = recording.adjoints(sum);
        let gradient = base.iter().chain(&articulation).map(|&x| adjoints.of(x));
        (sum.value(), gradient.collect())
    })
}

/// Everything that is claimed of one pose.
fn assert_pullback(kind: &Kind, pose: &HandPose) {
    let hand = kind.hand();
    let name = hand.name();
    let size_of = |gradient: &[f64]| gradient.iter().fold(1.0_f64, |m, g| m.max(g.abs()));

    let (_, all) = evaluated(hand, pose, Over::ContactsAndSpheres);
    let exact = flat(&all.gradient);
    let size = size_of(&exact);
    for (index, exact) in exact.iter().enumerate() {
        let value = |amount: f64| {
            let (value, _) = evaluated(hand, &moved(pose, index, amount), Over::ContactsAndSpheres);
            value
        };
        let difference = (value(STEP) - value(-STEP)) / (2.0 * STEP);
        assert!(
            (difference - exact).abs() <= DIFFERENCES * size,
            "{name}, coordinate {index}: pulled back {exact}, by differences {difference}"
        );
    }

    let (value, contacts) = evaluated(hand, pose, Over::Contacts);
    let exact = flat(&contacts.gradient);
    let (taped_value, taped) = by_tape(kind, pose);
    assert!((value - taped_value).abs() <= REVERSE * value.abs().max(1.0));
    let size = size_of(&exact);
    for (index, (exact, taped)) in exact.iter().zip(&taped).enumerate() {
        assert!(
            (exact - taped).abs() <= REVERSE * size,
            "{name}, coordinate {index}: pulled back {exact}, taped {taped}"
        );
    }
}

/// Where one joint is.
#[derive(Clone, Copy, Debug)]
enum Place {
    Zero,
    Lower,
    Upper,
    /// So far on the way from the lower to the upper limit.
    Within(f64),
}

impl Place {
    fn on(self, limit: &Limit) -> f64 {
        let half_turn = |bound: f64, sign: f64| if bound.is_finite() { bound } else { sign * PI };
        let (lower, upper) = (half_turn(limit.lower, -1.0), half_turn(limit.upper, 1.0));
        match self {
            Self::Zero => 0.0,
            Self::Lower => lower,
            Self::Upper => upper,
            Self::Within(share) => lower + share * (upper - lower),
        }
    }
}

/// The most joints that a hand here has.
const MAX_JOINTS: usize = 45;

/// Poses of any hand: joints at 0, at their limits and between, the base turned by 0, by pi, beside both and between.
fn poses() -> impl Strategy<Value = (HandPose, Vec<Place>)> {
    let place = prop_oneof![
        Just(Place::Zero),
        Just(Place::Lower),
        Just(Place::Upper),
        (0.0..1.0).prop_map(Place::Within),
    ];
    let angle = prop_oneof![
        Just(0.0),
        Just(1e-9),
        Just(PI - 1e-9),
        Just(PI),
        Just(PI + 1e-9),
        0.0..2.0 * PI,
    ];
    let vector = || prop::array::uniform3(-1.0..1.0);
    let places = prop::collection::vec(place, MAX_JOINTS);
    (vector(), vector(), angle, places).prop_map(|(shift, axis, angle, places)| {
        let axis = Vec3::from(axis) + Vec3::new(1e-3, 0.0, 0.0);
        let pose = HandPose {
            translation: Vec3::from(shift) * 0.3,
            rotation: Quaternion::exp(axis.normalize_or_zero() * angle).normalize(),
            articulation: Vec::new(),
        };
        (pose, places)
    })
}

/// Poses that no drawing would meet: all joints at once at 0 and at either limit, the base turned by 0 and by half a
/// turn about each axis.
fn corner_poses(limits: &[Limit]) -> Vec<HandPose> {
    let turns = [
        Vec3::zero(),
        Vec3::new(PI, 0.0, 0.0),
        Vec3::new(0.0, PI, 0.0),
        Vec3::new(0.0, 0.0, PI),
    ];
    let mut poses = Vec::new();
    for place in [Place::Zero, Place::Lower, Place::Upper] {
        for turn in turns {
            poses.push(HandPose {
                translation: Vec3::new(0.1, -0.2, 0.05),
                rotation: Quaternion::exp(turn).normalize(),
                articulation: limits.iter().map(|limit| place.on(limit)).collect(),
            });
        }
    }
    poses
}

/// Drawn poses of each kind of hand.
const CASES: u32 = 12;

/// Checks a kind of hand, unless its file is not there.
fn check(kind: Option<Kind>) {
    let Some(kind) = kind else { return };
    let limits = kind.hand().limits().expect("all of these have limits");
    for pose in corner_poses(limits) {
        assert_pullback(&kind, &pose);
    }
    let mut runner = TestRunner::new(ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::with_cases(CASES)
    });
    let outcome = runner.run(&poses(), |(mut pose, places)| {
        let places = places.iter().zip(limits);
        pose.articulation = places.map(|(place, limit)| place.on(limit)).collect();
        assert_pullback(&kind, &pose);
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{}: {failure}", kind.hand().name()));
}

#[test]
fn of_the_built_in_allegro_hand() {
    check(Some(Kind::Rigid(rigid(allegro))));
}

#[test]
fn of_the_built_in_leap_hand() {
    check(Some(Kind::Rigid(rigid(leap))));
}

#[test]
fn of_the_built_in_barrett_hand_and_its_image() {
    check(Some(Kind::Rigid(rigid(barrett))));
    check(Some(Kind::Rigid(rigid(barrett).mirrored())));
}

#[test]
fn of_slides_followers_and_endless_joints() {
    check(Some(Kind::Rigid(turning_gripper())));
}

#[test]
fn of_every_urdf() {
    for path in [ALLEGRO, RIGHT, LEFT, LEAP, BARRETT] {
        check(file(path).map(Kind::Rigid));
    }
}

#[test]
fn of_the_built_in_human_hand() {
    check(Some(Kind::Skinned(human_hand())));
}

#[test]
fn of_the_image_of_the_human_hand() {
    check(Some(Kind::mirrored(human_hand())));
}

#[test]
fn of_a_hand_in_manos_layout_from_a_file() {
    check(make_human_hand().map(Kind::Skinned));
}

/// Coefficients for rotation vectors of one length for every joint, each about an axis that it bends about.
fn with_every_joint_turned_by(hand: &SkinnedHand, angle: f64) -> Vec<f64> {
    let (components, mean) = (&hand.model().pose_components, &hand.model().pose_mean);
    let mut wanted = vec![0.0; mean.len()];
    for joint in wanted.chunks_exact_mut(3).enumerate() {
        let (index, vector) = joint;
        let entries =
            |row: &[f64; 45]| Vec3::new(row[3 * index], row[3 * index + 1], row[3 * index + 2]);
        let axis = components
            .iter()
            .map(entries)
            .find(|axis| axis.norm() > 1e-3);
        let axis = axis.expect("every joint moves").normalize_or_zero();
        vector.copy_from_slice(&[axis.x, axis.y, axis.z].map(|entry| entry * angle));
    }
    let basis = DMatrix::from_fn(mean.len(), components.len(), |row, column| {
        components[column][row]
    });
    let offset = DVector::from_fn(mean.len(), |row, _| wanted[row] - mean[row]);
    let solution = basis
        .svd(true, true)
        .solve(&offset, 1e-9)
        .expect("both sides were asked for");
    let coefficients: Vec<f64> = solution.as_slice().to_vec();
    let lengths = pose_lengths(hand, &coefficients);
    assert!(
        lengths
            .iter()
            .all(|length| (length - angle.abs()).abs() < 1e-9),
        "{lengths:?}"
    );
    coefficients
}

/// Length of each joint's rotation vector \[rad\].
fn pose_lengths(hand: &SkinnedHand, coefficients: &[f64]) -> Vec<f64> {
    let (components, mean) = (&hand.model().pose_components, &hand.model().pose_mean);
    let entry = |k: usize| {
        let terms = components.iter().zip(coefficients);
        mean[k] + terms.map(|(row, c)| row[k] * c).sum::<f64>()
    };
    (0..mean.len() / 3)
        .map(|joint| Vec3::new(entry(3 * joint), entry(3 * joint + 1), entry(3 * joint + 2)).norm())
        .collect()
}

#[test]
fn of_skinned_hands_at_rotation_vectors_of_length_0_and_pi() {
    for hand in [Some(human_hand()), make_human_hand()]
        .into_iter()
        .flatten()
    {
        for angle in [0.0, 1e-9, PI - 1e-9, PI, -PI, PI + 1e-9, 2.0 * PI] {
            let pose = HandPose {
                translation: Vec3::new(0.1, -0.2, 0.05),
                rotation: Quaternion::exp(Vec3::new(0.3, 2.0, -0.4)).normalize(),
                articulation: with_every_joint_turned_by(&hand, angle),
            };
            assert_pullback(&Kind::Skinned(hand.clone()), &pose);
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
        let [(_, a), (_, b)] = [a, b].map(|hand| evaluated(hand, &pose, Over::ContactsAndSpheres));
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
    let (_, exact) = evaluated(&inner, &pose, Over::ContactsAndSpheres);
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
