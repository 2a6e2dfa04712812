//! Contact points in single precision, with what rounding left of them.

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{
    Hand, HandPose, MirroredHand, PointBuffer, allegro, barrett, builtin_hand, leap,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::coarse;

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
    let remainder = &scratch.contact_remainder;
    (0..count)
        .map(|i| [single.get(i) + remainder.get(i), double.get(i)])
        .collect()
}

#[test]
fn rounded_points_and_their_remainders_are_the_points() {
    /// Rounding of the remainder, and of sums in another order.
    const EXACT: f64 = 1e-14;
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let human = || builtin_hand("human").expect("it is built in");
    let rigid = || allegro(&coarse()).expect("default dimensions");
    let hands: Vec<Box<dyn Hand>> = vec![
        Box::new(leap(&coarse()).expect("default dimensions")),
        Box::new(barrett(&coarse()).expect("default dimensions")),
        Box::new(MirroredHand::new(Box::new(rigid()))),
        human(),
        Box::new(MirroredHand::new(human())),
    ];
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
