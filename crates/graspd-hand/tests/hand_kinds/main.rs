//! Every kind of hand: forward kinematics against the crate `k`, pullbacks against central differences and the tape,
//! mirror images, spheres.

mod autodiff;
#[path = "../jacobian_rows/mod.rs"]
mod jacobian_rows;
mod kinds;
mod motion;
mod pullback;
mod remainder;
mod rows;
mod spheres;

use graspd_geom::{Quaternion, Vec3, shared_file};
use graspd_hand::{ArticulatedHand, Hand, HandOptions, HandPose, UrdfOptions, load_urdf};
use rand_chacha::ChaCha8Rng;

pub(crate) const RIGHT: &str = concat!(
    "data/hands/simlab_allegro_hand_ros/",
    "allegro_hand_description/allegro_hand_description_right.urdf"
);
pub(crate) const LEFT: &str = concat!(
    "data/hands/simlab_allegro_hand_ros/",
    "allegro_hand_description/allegro_hand_description_left.urdf"
);
pub(crate) const ALLEGRO: &str = "data/hands/allegro_hand/allegro_hand_right.urdf";
pub(crate) const LEAP: &str = "data/hands/leap_hand/leap_hand_right.urdf";
pub(crate) const BARRETT: &str = "data/hands/barrett_hand/bhand_model.urdf";

/// The same numbers through another chain of roundings \[m\].
pub(crate) const SAME: f64 = 1e-9;
/// Descriptions round quarter turns to 1.57079, which moves a finger tip by micrometres \[m\].
pub(crate) const ROUNDED_TURNS: f64 = 1e-5;
/// Descriptions of one hand by two authors differ by tenths of a millimetre \[m\].
pub(crate) const OTHER_AUTHOR: f64 = 1e-3;

pub(crate) fn coarse() -> HandOptions {
    HandOptions {
        contact_points: 120,
        collision_spheres: 12,
        ..HandOptions::default()
    }
}

pub(crate) fn file(path: &str) -> Option<ArticulatedHand> {
    let options = UrdfOptions {
        hand: coarse(),
        ..UrdfOptions::default()
    };
    Some(load_urdf(shared_file(path)?, &options).expect("the file is sound"))
}

pub(crate) fn at_origin(articulation: Vec<f64>) -> HandPose {
    HandPose {
        translation: Vec3::zero(),
        rotation: Quaternion::identity(),
        articulation,
    }
}

pub(crate) fn within_limits(hand: &dyn Hand, random: &mut ChaCha8Rng) -> Vec<f64> {
    let limits = hand.limits().expect("a hand of rigid links has limits");
    limits.iter().map(|limit| limit.sample(random)).collect()
}
