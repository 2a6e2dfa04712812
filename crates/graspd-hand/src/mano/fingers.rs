//! Where a skinned hand's palm and fingers are and which way they bend, from its bones and skin alone.

use graspd_geom::{TriangleMesh, Vec3};
use nalgebra::{Point3, Vector3};

use super::model::{POSE_VALUES, SKINNED_JOINTS, SkinnedModel};
use crate::PalmFrame;
use crate::palm::ray_hit;

/// The first joints of index, middle, ring and pinky: the knuckles, from the thumb's side on.
pub(crate) const KNUCKLES: [usize; 4] = [1, 4, 10, 7];
/// The first joint of the thumb.
pub(crate) const THUMB: usize = 13;
/// The first joints of all fingers.
pub(crate) const FINGERS: [usize; 5] = [1, 4, 7, 10, THUMB];

/// A shaped hand in its straight pose, taken apart.
#[derive(Clone, Debug)]
pub(crate) struct Fingers {
    /// The joints \[m\].
    pub(crate) joints: [Vector3<f64>; SKINNED_JOINTS],
    /// The tips of index, middle, pinky, ring and thumb: where the skin of the last joint reaches farthest along its
    /// bone.
    pub(crate) tips: [Vector3<f64>; 5],
    /// From the wrist along the hand, unit.
    pub(crate) forward: Vector3<f64>,
    /// Out of the palm, orthogonal to `forward`, unit.
    pub(crate) palmar: Vector3<f64>,
}

impl Fingers {
    /// Finds them; says in `notes` what had to be guessed.
    ///
    /// * Forward is from the wrist to the middle of the four knuckles.
    /// * The palm lies in the plane of that and of the line from the pinky's to the index's knuckle. Its outer side is
    ///   the one that the thumb and the finger tips lie on: none of them bends back in any hand's rest pose. A mean
    ///   pose other than 0 has a say too: hands at rest are half closed.
    pub(crate) fn find(
        model: &SkinnedModel,
        vertices: &[Vec3<f64>],
        joints: &[Vec3<f64>; SKINNED_JOINTS],
        notes: &mut Vec<String>,
    ) -> Self {
        let tips = FINGERS.map(|first| tip(model, vertices, joints, first + 2));
        let joints = joints.map(Vector3::from);
        let knuckles = KNUCKLES.iter().map(|&k| joints[k]).sum::<Vector3<f64>>() / 4.0;
        let forward = (knuckles - joints[0])
            .try_normalize(0.0)
            .unwrap_or(Vector3::x());
        let across = joints[KNUCKLES[0]] - joints[KNUCKLES[3]];
        let normal = across
            .cross(&forward)
            .try_normalize(1e-9)
            .unwrap_or_else(|| {
                notes.push(
                    "the knuckles lie on a line with the wrist: the palm's side is a guess".into(),
                );
                Vector3::z()
            });
        let mut side = 0.0;
        for (finger, &first) in FINGERS.iter().enumerate() {
            let root = if first == THUMB {
                joints[0]
            } else {
                joints[first]
            };
            side += normal.dot(&(tips[finger] - root));
            // The mean pose turns each bone a little about its joint.
            for joint in first..first + 3 {
                let turn = Vector3::from_column_slice(&rotation_of(&model.pose_mean, joint));
                side += normal.dot(&turn.cross(&(tips[finger] - joints[joint])));
            }
        }
        Self {
            joints,
            tips,
            forward,
            palmar: if side < 0.0 { -normal } else { normal },
        }
    }

    /// Returns the end of the bone that begins at `joint`.
    pub(crate) fn bone_end(&self, joint: usize) -> Vector3<f64> {
        if joint == 0 {
            KNUCKLES
                .iter()
                .map(|&k| self.joints[k])
                .sum::<Vector3<f64>>()
                / 4.0
        } else if joint.is_multiple_of(3) {
            self.tips[joint / 3 - 1]
        } else {
            self.joints[joint + 1]
        }
    }

    /// Returns the palm: its center is where the ray out of the palm from between the wrist and the knuckles leaves
    /// the skin.
    pub(crate) fn palm(&self, surface: &TriangleMesh) -> PalmFrame {
        let knuckles = self.bone_end(0);
        // Nearer to the knuckles: the wrist joint lies behind the palm.
        let start = Point3::from(self.joints[0] + (knuckles - self.joints[0]) * 0.6);
        let depth = (0..surface.faces.len())
            .filter_map(|face| ray_hit(start, self.palmar, surface.corners(face)))
            // Curled fingers may stand before the palm.
            .filter(|&depth| depth > 0.0)
            .fold(f64::INFINITY, f64::min);
        PalmFrame {
            center: start + self.palmar * if depth.is_finite() { depth } else { 0.0 },
            normal: self.palmar,
            fingers: self.forward,
        }
    }
}

/// Returns the rotation vector of a joint in a pose.
fn rotation_of(pose: &[f64; POSE_VALUES], joint: usize) -> [f64; 3] {
    let at = 3 * (joint - 1);
    [pose[at], pose[at + 1], pose[at + 2]]
}

/// Returns the vertex that follows `joint` most of all and lies farthest along its bone.
fn tip(
    model: &SkinnedModel,
    vertices: &[Vec3<f64>],
    joints: &[Vec3<f64>; SKINNED_JOINTS],
    joint: usize,
) -> Vector3<f64> {
    let origin = Vector3::from(joints[joint]);
    let along = origin - Vector3::from(joints[joint - 1]);
    let own = (0..vertices.len()).filter(|&v| heaviest(&model.weights[v]) == joint);
    own.map(|v| Vector3::from(vertices[v]))
        .max_by(|a, b| {
            along
                .dot(&(a - origin))
                .total_cmp(&along.dot(&(b - origin)))
        })
        .unwrap_or(origin + along)
}

/// Returns the joint of largest weight.
pub(crate) fn heaviest(weights: &[f64; SKINNED_JOINTS]) -> usize {
    // The first of equals, so that the choice does not depend on the order of comparison.
    (0..SKINNED_JOINTS)
        .rev()
        .max_by(|&a, &b| weights[a].total_cmp(&weights[b]))
        .unwrap_or(0)
}
