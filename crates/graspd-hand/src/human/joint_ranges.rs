//! How far the joints move: axes, ranges, and the relaxed and the open hand.
//!
//! # Source
//! Ranges of flexion of the fingers follow Hume, Gellman, McKellop and Brumfield, "Functional range of motion of the
//! joints of the hand", Journal of Hand Surgery 15A, 1990 (active flexion of about 100, 105 and 85 degrees at the
//! three joints of a finger, 56 and 73 degrees at the last two of the thumb), and the American Academy of Orthopaedic
//! Surgeons' "Joint Motion" (about 20 degrees of ab- and adduction of the fingers; 70 degrees of palmar abduction of
//! the thumb, of which the rest pose has about 15 already), rounded to 5 degrees and kept a little inside the
//! extremes. The relaxed posture and the turn of the thumb about its own bone are by eye.

use nalgebra::Vector3;

use super::proportions::{Chain, RAYS, THUMB, chains};
use crate::mano::POSE_VALUES;

/// One way in which one joint turns.
#[derive(Clone, Debug)]
pub(crate) struct Freedom {
    /// Such as `index_mcp_flexion`.
    pub(crate) name: String,
    /// Unit rotation axis in the rest pose; the three axes of a joint are at right angles.
    pub(crate) axis: Vector3<f64>,
    /// Lowest, relaxed, open and highest angle \[rad\].
    pub(crate) lower: f64,
    pub(crate) relaxed: f64,
    pub(crate) open: f64,
    pub(crate) upper: f64,
}

/// Play of joints in directions in which they do not move by themselves \[degrees\]: a pressed finger gives a little.
const PLAY: [f64; 4] = [-3.0, 0.0, 0.0, 3.0];

/// Lowest, relaxed, open and highest angle in degrees of flexion, sideways movement and twist of a joint.
fn angles(ray: usize, joint: usize) -> [[f64; 4]; 3] {
    let name = RAYS[ray].name;
    match (ray, joint) {
        // Across the palm; away from its plane; pad turning towards the fingers.
        (THUMB, 0) => [
            [-15.0, 0.0, -5.0, 35.0],
            [-10.0, 15.0, 30.0, 45.0],
            [-10.0, 10.0, 20.0, 40.0],
        ],
        (THUMB, 1) => [
            [-10.0, 12.0, 0.0, 55.0],
            [-8.0, 0.0, 0.0, 8.0],
            [-5.0, 0.0, 0.0, 8.0],
        ],
        (THUMB, _) => [[-15.0, 15.0, 5.0, 75.0], PLAY, PLAY],
        (_, 0) => {
            // Sideways is towards the little finger; the rest pose has the fingers a little spread already.
            let sideways = match name {
                "index" => [-18.0, 2.0, 0.0, 15.0],
                "middle" => [-12.0, 0.0, 0.0, 12.0],
                "ring" => [-12.0, -2.0, 0.0, 14.0],
                _ => [-14.0, -5.0, 0.0, 22.0],
            };
            [[-15.0, 28.0, 8.0, 90.0], sideways, [-5.0, 0.0, 0.0, 5.0]]
        }
        (_, 1) => [[-3.0, 38.0, 10.0, 105.0], PLAY, PLAY],
        _ => [[-5.0, 22.0, 6.0, 80.0], PLAY, PLAY],
    }
}

/// Returns the axes of flexion, sideways movement and twist of a joint.
fn axes(ray: usize, joint: usize, chain: &Chain) -> [Vector3<f64>; 3] {
    let (along, pad) = (chain.along[joint], chain.pads[joint]);
    if (ray, joint) == (THUMB, 0) {
        // The saddle joint moves across the palm and away from it.
        let away = along.cross(&-Vector3::y()).normalize();
        return [away.cross(&along), away, -along];
    }
    [chain.flexion_axes[joint], pad, along]
}

/// Returns what each of the 45 pose values is replaced by: three freedoms for each joint but the wrist, in MANO's
/// order.
pub(crate) fn freedoms() -> Vec<Freedom> {
    let mut freedoms = Vec::with_capacity(POSE_VALUES);
    for (ray, chain) in chains().iter().enumerate() {
        for joint in 0..3 {
            let joint_name = match (ray, joint) {
                (THUMB, _) => ["cmc", "mcp", "ip"][joint],
                _ => ["mcp", "pip", "dip"][joint],
            };
            let ranges = angles(ray, joint);
            for (kind, axis) in axes(ray, joint, chain).into_iter().enumerate() {
                let movement = ["flexion", "abduction", "twist"][kind];
                let [lower, relaxed, open, upper] = ranges[kind].map(f64::to_radians);
                freedoms.push(Freedom {
                    name: format!("{}_{joint_name}_{movement}", RAYS[ray].name),
                    axis,
                    lower,
                    relaxed,
                    open,
                    upper,
                });
            }
        }
    }
    freedoms
}

/// Returns the rotation vectors of a pose given by the angles of all freedoms \[rad\].
pub(crate) fn pose_of_angles(freedoms: &[Freedom], angles: &[f64]) -> [f64; POSE_VALUES] {
    let mut pose = [0.0; POSE_VALUES];
    for (index, (freedom, angle)) in freedoms.iter().zip(angles).enumerate() {
        for axis in 0..3 {
            pose[index / 3 * 3 + axis] += freedom.axis[axis] * angle;
        }
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_ordered_and_axes_orthonormal() {
        let freedoms = freedoms();
        assert_eq!(freedoms.len(), POSE_VALUES);
        for f in &freedoms {
            for angle in [f.relaxed, f.open] {
                assert!(f.lower <= angle && angle <= f.upper, "{}", f.name);
            }
        }
        for joint in freedoms.chunks(3) {
            for (i, a) in joint.iter().enumerate() {
                for (j, b) in joint.iter().enumerate() {
                    let wanted = f64::from(u8::from(i == j));
                    assert!((a.axis.dot(&b.axis) - wanted).abs() < 1e-12, "{}", a.name);
                }
            }
        }
    }

    #[test]
    fn the_thumb_flexes_across_the_palm_and_abducts_away_from_it() {
        let freedoms = freedoms();
        let along = chains()[THUMB].along[0];
        let moved = |name: &str| {
            let freedom = freedoms.iter().find(|f| f.name == name).unwrap();
            freedom.axis.cross(&along)
        };
        assert!(moved("thumb_cmc_flexion").z < -0.5);
        assert!(moved("thumb_cmc_abduction").y < -0.5);
    }
}
