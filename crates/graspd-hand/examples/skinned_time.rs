//! How long the kinematics of a skinned hand of MANO's size take, in both precisions:
//! `cargo run --release -p graspd-hand --example skinned_time`

#[path = "../tests/mano/synthetic.rs"]
#[allow(dead_code)] // The tests use more of it.
mod synthetic;

use std::time::Instant;

use graspd_ad::Element;
use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{
    Hand, HandPose, Kinematics, PointBuffer, PoseGradient, SkinnedHand, SkinnedHandOptions,
};

/// Passes that one figure is the least of.
const REPEATS: usize = 40;
/// Steps timed at once.
const STEPS: usize = 100;

fn main() -> Result<(), graspd_hand::HandError> {
    println!("us a step, least of {REPEATS}      forward   pullback");
    for (name, has_blendshapes) in [("with blendshapes", true), ("without", false)] {
        let mut model = synthetic::model(1);
        if !has_blendshapes {
            model.pose_directions = None;
        }
        let hand = SkinnedHand::new(model, &SkinnedHandOptions::default())?;
        let [forward, pullback] = times::<f32>(&hand);
        println!("f32 lanes, {name:20} {forward:8.1} {pullback:10.1}");
        let [forward, pullback] = times::<f64>(&hand);
        println!("f64,       {name:20} {forward:8.1} {pullback:10.1}");
    }
    Ok(())
}

fn times<E: Element>(hand: &SkinnedHand) -> [f64; 2]
where
    SkinnedHand: Kinematics<E>,
{
    let mut pose = HandPose {
        translation: Vec3::new(0.0, 0.1, 0.2),
        rotation: Quaternion::exp(Vec3::new(0.4, -0.3, 1.0)),
        articulation: hand.open_articulation().to_vec(),
    };
    let mut scratch = hand.new_scratch();
    let mut contacts = PointBuffer::<E>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::<E>::zeros(hand.collision_spheres().radius.len());
    let mut contact_gradient = contacts.clone();
    contact_gradient.z.fill(E::one());
    let sphere_gradient = spheres.clone();
    let mut gradient = PoseGradient::zero(pose.articulation.len());
    let mut least = [f64::INFINITY; 2];
    for repeat in 0..REPEATS {
        pose.articulation[0] = 1e-3 * repeat as f64;
        let start = Instant::now();
        for _ in 0..STEPS {
            hand.forward(&pose, &mut scratch, &mut contacts, &mut spheres);
        }
        let forward = start.elapsed().as_secs_f64();
        let start = Instant::now();
        for _ in 0..STEPS {
            hand.pullback(
                &pose,
                &mut scratch,
                &contacts,
                &contact_gradient,
                &spheres,
                &sphere_gradient,
                &mut gradient,
            );
        }
        for (least, time) in least
            .iter_mut()
            .zip([forward, start.elapsed().as_secs_f64()])
        {
            *least = least.min(time * 1e6 / STEPS as f64);
        }
    }
    least
}
