//! Spheres that keep the fingers of skinned hands apart.

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{Hand, HandPose, Kinematics, PointBuffer};

use crate::kinds::human_hand;

/// Skin of the outer two bones of fingers may stand out of the spheres of its finger so far, on average and anywhere
/// \[m\]: fingers are broader than deep.
const MEAN_GAP: f64 = 1.2e-3;
const MAX_GAP: f64 = 4e-3;

#[test]
fn the_human_hands_spheres_cover_its_fingers() {
    let hand = human_hand();
    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: hand.open_articulation().to_vec(),
    };
    let mut points = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut centers = PointBuffer::zeros(hand.collision_spheres().radius.len());
    hand.forward(&pose, &mut hand.new_scratch(), &mut points, &mut centers);
    let finger = |body: u32| body.div_ceil(3);
    let spheres = hand.collision_spheres();
    let gaps: Vec<f64> = (hand.contact_points().body.iter().enumerate())
        .filter(|&(_, body)| *body != 0 && body % 3 != 1)
        .map(|(i, &body)| {
            let own = (0..centers.len()).filter(|&s| finger(spheres.body[s]) == finger(body));
            own.map(|s| (points.get(i) - centers.get(s)).norm() - spheres.radius[s])
                .fold(f64::INFINITY, f64::min)
        })
        .collect();
    let mean = gaps.iter().sum::<f64>() / gaps.len() as f64;
    let largest = gaps.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert!(gaps.len() > 200, "{}", gaps.len());
    assert!(mean < MEAN_GAP && largest < MAX_GAP, "{mean} {largest}");
}
