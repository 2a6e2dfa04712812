//! Closes each joint of a hand by itself, and prints how far that moves the hand's contact points: the joint's part
//! of the Jacobian, by one pullback for each direction.
//!
//! `cargo run --release -p graspd-hand --example reach -- [HAND]`: a built-in name or a file; by default `allegro`

use graspd_geom::{Quaternion, Vec3};
use graspd_hand::{HandPose, PointBuffer, PoseGradient, load_hand};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "allegro".into());
    let hand = load_hand(&name)?;
    let pose = HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation: hand.open_articulation().to_vec(),
    };
    let mut scratch = hand.new_scratch();
    let mut contacts = PointBuffer::<f64>::zeros(hand.contact_points().weight.len());
    let mut spheres = PointBuffer::<f64>::zeros(hand.collision_spheres().radius.len());
    hand.forward(&pose, &mut scratch, &mut contacts, &mut spheres);

    let no_push = PointBuffer::<f64>::zeros(spheres.len());
    let mut motion = vec![[0.0; 3]; pose.articulation.len()];
    for axis in 0..3 {
        // The sum of all points' coordinate along one axis.
        let mut ones = PointBuffer::<f64>::zeros(contacts.len());
        match axis {
            0 => ones.x.fill(1.0),
            1 => ones.y.fill(1.0),
            _ => ones.z.fill(1.0),
        }
        let mut gradient = PoseGradient::zero(pose.articulation.len());
        hand.pullback(
            &pose,
            &mut scratch,
            &contacts,
            &ones,
            &spheres,
            &no_push,
            &mut gradient,
        );
        for (motion, slope) in motion.iter_mut().zip(&gradient.articulation) {
            motion[axis] = slope / contacts.len() as f64;
        }
    }
    println!("{name}: {} contact points", contacts.len());
    println!("joint                      mean motion of all points [mm/rad]");
    for (joint, [x, y, z]) in hand.articulation_names().iter().zip(motion) {
        let length = 1e3 * (x * x + y * y + z * z).sqrt();
        println!("{joint:26} {length:8.2}");
        assert!(length.is_finite());
    }
    Ok(())
}
