//! The contact law differentiated by hand, which the benchmarks measure, is the law's derivative.

#[path = "../benches/backends/by_hand.rs"]
mod by_hand;

use std::sync::LazyLock;

use graspd::{GraspObject, NamedMesh};
use graspd_ad::{Dual, Element, Real, vectorize};
use graspd_geom::Vec3;
use graspd_hand::{POINT_PADDING, PointBuffer};
use graspd_sim::{ContactParams, ContactState, Twist};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use by_hand::ByHand;

/// Contacts, most of them near the object's surface.
const COUNT: usize = 4000;
/// Of sums of products of some ten factors.
const ROUNDING: f64 = 1e-9;

static MUG: LazyLock<GraspObject> = LazyLock::new(|| {
    let source = NamedMesh::load("mug", 1.0).expect("a built-in object");
    GraspObject::prepare(source, 48, 1000.0, &|_| {}).expect("it has a volume")
});

/// At rest, sliding, and turning slowly enough to stick.
fn velocities() -> Vec<Twist<f64>> {
    [
        ([0.0; 3], [0.0; 3]),
        ([0.01, -0.02, 0.01], [0.0; 3]),
        ([1e-3, 0.0, 2e-3], [0.02, -0.01, 0.03]),
    ]
    .map(|(linear, angular): ([f64; 3], [f64; 3])| Twist {
        linear: Vec3::from(linear),
        angular: Vec3::from(angular),
    })
    .to_vec()
}

struct Contacts<E> {
    points: PointBuffer<E>,
    weight: Vec<E>,
    targets: Vec<E>,
}

/// Points in the grid's box and a little around it, and targets of the size of contact forces.
fn contacts<E: Element>() -> Contacts<E> {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let (low, high) = MUG.simulated.sdf().bounds();
    let mut points = PointBuffer::zeros(COUNT);
    for index in 0..COUNT {
        let mut within = |low: f64, high: f64| {
            random.random_range(low - 0.1 * (high - low)..high + 0.1 * (high - low))
        };
        let point = [
            within(low.x, high.x),
            within(low.y, high.y),
            within(low.z, high.z),
        ];
        // Single precision throughout: both precisions are given the same numbers.
        points.set(index, Vec3::from(point.map(|x| f64::from(x as f32))));
    }
    let mut number = |low: f32, high: f32| E::constant(f64::from(random.random_range(low..high)));
    Contacts {
        points,
        weight: (0..COUNT).map(|_| number(0.0, 2.0)).collect(),
        targets: (0..COUNT * 6 * velocities().len())
            .map(|_| number(-3.0, 3.0))
            .collect(),
    }
}

/// The squared residuals of one contact, times its weight, by the law.
fn loss<E: Element, T: Real<Element = E>>(
    contacts: &Contacts<E>,
    params: &ContactParams,
    index: usize,
    point: Vec3<T>,
) -> T {
    let object = &MUG.simulated;
    let (distance, gradient) = object.sdf().distance_and_gradient(point);
    let lever = point - Vec3::constant(object.center_of_mass());
    let state = ContactState::new(distance, gradient, lever, params.leak);
    let velocities = velocities();
    let mut loss = T::zero();
    for (j, twist) in velocities.iter().enumerate() {
        let wrench = state.wrench(
            &Twist {
                linear: Vec3::constant(twist.linear),
                angular: Vec3::constant(twist.angular),
            },
            params,
        );
        let (torque, force) = (wrench.torque, wrench.force);
        let row = (index / POINT_PADDING * velocities.len() + j) * 6;
        for (k, value) in [torque.x, torque.y, torque.z, force.x, force.y, force.z]
            .into_iter()
            .enumerate()
        {
            let target = contacts.targets[(row + k) * POINT_PADDING + index % POINT_PADDING];
            loss += (value - T::constant(target.lane(0))).square();
        }
    }
    loss.scale(contacts.weight[index].lane(0))
}

fn by_hand<'a, E: Element>(
    contacts: &'a Contacts<E>,
    params: &'a ContactParams,
    velocities: &'a [Twist<f64>],
    gradient: &'a mut PointBuffer<E>,
) -> ByHand<'a, E> {
    ByHand {
        object: &MUG.simulated,
        velocities,
        contact: params,
        points: &contacts.points,
        weight: &contacts.weight,
        targets: &contacts.targets,
        gradient,
    }
}

/// Stiffnesses with which the contacts' forces are of the size of the targets.
fn params() -> ContactParams {
    ContactParams {
        normal_stiffness: 1e3,
        friction_stiffness: 1e5,
        ..ContactParams::default()
    }
}

#[test]
fn by_hand_is_by_duals() {
    let (contacts, params) = (contacts::<f64>(), params());
    let velocities = velocities();
    let mut gradient = PointBuffer::zeros(COUNT);
    let found = by_hand(&contacts, &params, &velocities, &mut gradient).over::<f64>();
    let (mut total, mut touching) = (0.0, 0);
    for index in 0..COUNT {
        let point = contacts.points.get(index);
        let [x, y, z] = Dual::<f64, 3>::variables([point.x, point.y, point.z]);
        let expected = loss(&contacts, &params, index, Vec3::new(x, y, z));
        total += expected.value;
        let expected = Vec3::from(expected.derivative);
        let error = (gradient.get(index) - expected).norm();
        assert!(
            error <= ROUNDING * (1.0 + expected.norm()),
            "contact {index}: {:?}, not {expected:?}",
            gradient.get(index)
        );
        touching += usize::from(MUG.simulated.sdf().distance(point) <= 0.0);
    }
    assert!((found - total).abs() <= ROUNDING * total, "{found} {total}");
    assert!((COUNT / 40..COUNT / 2).contains(&touching), "{touching}");
}

#[test]
fn lanes_give_the_bits_of_single_contacts() {
    let (contacts, params) = (contacts::<f32>(), params());
    let velocities = velocities();
    let [mut single, mut lanes] = [PointBuffer::zeros(COUNT), PointBuffer::zeros(COUNT)];
    by_hand(&contacts, &params, &velocities, &mut single).over::<f32>();
    vectorize(by_hand(&contacts, &params, &velocities, &mut lanes));
    assert!(single == lanes);
}
