//! Initial poses: open hand, palm facing a random point of the surface.

use graspd_geom::{SurfaceSampler, Vec3};
use graspd_hand::{Hand, HandPose};
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::Rng;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// How far the palm starts from the approach point \[m\]; paper: 10 cm.
pub const PAPER_STANDOFF: f64 = 0.1;

/// The random numbers of one start: a pure function of (seed, object, hand, index).
pub fn start_rng(seed: u64, object: &str, hand: &str, index: usize) -> ChaCha8Rng {
    // FNV-1a: small, and the same on every platform and in every version of this program.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut absorb = |bytes: &[u8]| {
        for &byte in bytes {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    absorb(&seed.to_le_bytes());
    absorb(object.as_bytes());
    absorb(&[0]);
    absorb(hand.as_bytes());
    absorb(&[0]);
    absorb(&(index as u64).to_le_bytes());
    ChaCha8Rng::seed_from_u64(hash)
}

/// An initial pose: joints fully open, approach point uniform on the surface, the palm's normal against the surface
/// normal, roll uniform, and the palm's centre `standoff` \[m\] from the approach point along the outward normal.
///
/// # Source
/// Grasp'D (ECCV 2022), supplementary A.2.
pub fn initial_pose(
    hand: &dyn Hand,
    surface: &SurfaceSampler<'_>,
    standoff: f64,
    rng: &mut impl Rng,
) -> HandPose {
    let approach = surface.sample(rng);
    let outward = approach.normal;
    let roll = rng.random_range(0.0..std::f64::consts::TAU);
    let palm = hand.palm();

    // Maps the palm's axes (normal, fingers, their cross product) to (-outward, some tangent, ...), then rolls.
    let frame = |first: Vector3<f64>, second: Vector3<f64>| {
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[
            first,
            second,
            first.cross(&second),
        ]))
    };
    let normal = palm.normal.normalize();
    let fingers = (palm.fingers - normal * palm.fingers.dot(&normal)).normalize();
    let rolled = Rotation3::new(-outward * roll) * any_orthogonal(&outward);
    let rotation = frame(-outward, rolled) * frame(normal, fingers).inverse();

    let palm_center = approach.point + outward * standoff;
    let translation = palm_center - rotation * palm.center;
    HandPose {
        translation: Vec3::from(translation),
        rotation: UnitQuaternion::from_rotation_matrix(&rotation).into(),
        articulation: hand.open_articulation().to_vec(),
    }
}

/// A unit vector orthogonal to a unit vector.
fn any_orthogonal(v: &Vector3<f64>) -> Vector3<f64> {
    let axis = if v.x.abs() < 0.9 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    v.cross(&axis).normalize()
}

/// The transform that maps hand-base coordinates into the object frame.
pub fn transform_object_hand(pose: &HandPose) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::from(Vector3::from(pose.translation)),
        pose.rotation.into(),
    )
}
