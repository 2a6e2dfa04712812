//! The sixteen joints: their frames in a pose, and the pose gradient from what the skin asks of them.

use graspd_geom::{Mat3, Rigid, Vec3};

use super::model::{POSE_VALUES, SKINNED_JOINTS};
use super::pose_space::{left_jacobian_transposed, local_rotations, rotation_vector};
use super::skin_kernels::JointLoad;
use super::skinning::{joint_frames, joint_motions};
use crate::PoseGradient;

/// The joints in one pose.
#[derive(Clone, Debug)]
pub(crate) struct BonePose {
    /// Rotation vectors of joints 1 to 15 \[rad\].
    pub(crate) pose: [f64; POSE_VALUES],
    /// Local rotations.
    pub(crate) rotations: [Mat3<f64>; SKINNED_JOINTS],
    /// Frames of the joints in the object frame.
    pub(crate) frames: [Rigid<f64>; SKINNED_JOINTS],
    /// What each joint does to points of the straight pose: x -> R x + t, to the object frame.
    pub(crate) motions: [Rigid<f64>; SKINNED_JOINTS],
}

impl Default for BonePose {
    fn default() -> Self {
        Self {
            pose: [0.0; POSE_VALUES],
            rotations: [Mat3::identity(); SKINNED_JOINTS],
            frames: [Rigid::identity(); SKINNED_JOINTS],
            motions: [Rigid::identity(); SKINNED_JOINTS],
        }
    }
}

impl BonePose {
    pub(crate) fn set(
        &mut self,
        parents: &[Option<usize>],
        joints: &[Vec3<f64>; SKINNED_JOINTS],
        pose: [f64; POSE_VALUES],
        base: &Rigid<f64>,
    ) {
        self.pose = pose;
        self.rotations = local_rotations(&pose);
        self.frames = joint_frames(parents, joints, &self.rotations, base);
        self.motions = joint_motions(&self.frames, joints);
    }
}

/// Forces on the joints, and torques about the joints' origins, object frame.
#[derive(Clone, Debug)]
pub(crate) struct JointForces {
    pub(crate) force: [Vec3<f64>; SKINNED_JOINTS],
    pub(crate) torque: [Vec3<f64>; SKINNED_JOINTS],
}

impl Default for JointForces {
    fn default() -> Self {
        Self {
            force: [Vec3::zero(); SKINNED_JOINTS],
            torque: [Vec3::zero(); SKINNED_JOINTS],
        }
    }
}

impl JointForces {
    /// Computes the forces of the skin: weighted vertices w (R (u - J) + p) push each joint like points of a rigid
    /// body.
    pub(crate) fn of_skin(
        loads: &[JointLoad; SKINNED_JOINTS],
        joints: &[Vec3<f64>; SKINNED_JOINTS],
        bones: &BonePose,
    ) -> Self {
        let mut forces = Self::default();
        for (joint, load) in loads.iter().enumerate() {
            let force = Vec3::from(load.force);
            // sum of w g (u - J)^T; with arm r = R (u - J), sum of w g r^T follows as this times R^T.
            let mut arms = matrix(&load.moment);
            for (row, force) in arms.rows.iter_mut().zip([force.x, force.y, force.z]) {
                *row -= joints[joint] * force;
            }
            let arms = arms.compose(&bones.frames[joint].rotation.transpose());
            forces.force[joint] = force;
            // r x g is the antisymmetric part of g r^T.
            forces.torque[joint] = antisymmetric(&arms);
        }
        forces
    }

    /// Adds a force at a point of the object frame to a joint.
    pub(crate) fn add_at(&mut self, joint: usize, force: Vec3<f64>, arm: Vec3<f64>) {
        self.force[joint] += force;
        self.torque[joint] += arm.cross(force);
    }

    /// Sums the forces up the tree; writes the base's part of the gradient, and the gradient by the rotation vectors.
    pub(crate) fn pull_back(
        mut self,
        parents: &[Option<usize>],
        bones: &BonePose,
        loads: &[JointLoad; SKINNED_JOINTS],
        base: Vec3<f64>,
        gradient: &mut PoseGradient,
    ) -> [f64; POSE_VALUES] {
        let mut by_pose = [0.0; POSE_VALUES];
        for joint in (1..SKINNED_JOINTS).rev() {
            let Some(parent) = parents[joint] else {
                continue;
            };
            let (force, torque) = (self.force[joint], self.torque[joint]);
            let arm = bones.frames[joint].translation - bones.frames[parent].translation;
            self.force[parent] += force;
            self.torque[parent] += torque + arm.cross(force);
            // Turning the joint turns all that hangs on it, and bends the skin.
            let turn = bones.frames[parent].rotation.apply_transposed(torque);
            let bent = matrix(&loads[joint].features).compose(&bones.rotations[joint].transpose());
            let turn = turn + antisymmetric(&bent);
            let v = rotation_vector(&bones.pose, joint - 1);
            let d = left_jacobian_transposed(v, turn);
            by_pose[3 * (joint - 1)..3 * joint].copy_from_slice(&[d.x, d.y, d.z]);
        }
        let arm = bones.frames[0].translation - base;
        gradient.translation = self.force[0];
        gradient.rotation = self.torque[0] + arm.cross(self.force[0]);
        by_pose
    }
}

/// (m_zy - m_yz, m_xz - m_zx, m_yx - m_xy): the derivative of m : (\[w\]x) by w.
pub(super) fn antisymmetric(m: &Mat3<f64>) -> Vec3<f64> {
    let [x, y, z] = m.rows;
    Vec3::new(z.y - y.z, x.z - z.x, y.x - x.y)
}

fn matrix(entries: &[f64; 9]) -> Mat3<f64> {
    let row = |k: usize| Vec3::new(entries[k], entries[k + 1], entries[k + 2]);
    Mat3 {
        rows: [row(0), row(3), row(6)],
    }
}
