//! The skinned hand as its authors define it, stage by stage, plainly and for any scalar.
//!
//! This is what the fast kernels are tested against, and what a user differentiates by whatever they like.

use graspd_ad::Real;
use graspd_geom::{Mat3, Rigid, Vec3};

use super::model::{JointPlacement, POSE_FEATURES, POSE_VALUES, SKINNED_JOINTS, SkinnedModel};
use super::pose_space::{local_rotations, pose_of};

impl SkinnedModel {
    /// Returns the vertices of the hand with shape parameters `shape` in its straight pose \[m\]: template +
    /// shape_directions . shape. Parameters that are not given are 0.
    pub fn shaped_vertices<T: Real>(&self, shape: &[T]) -> Vec<Vec3<T>> {
        displaced(&self.template, &self.shape_directions, shape)
    }

    /// Returns the joints of the hand with shape parameters `shape` \[m\]; `vertices`: its
    /// [`SkinnedModel::shaped_vertices`].
    pub fn shaped_joints<T: Real>(
        &self,
        shape: &[T],
        vertices: &[Vec3<T>],
    ) -> [Vec3<T>; SKINNED_JOINTS] {
        let mut joints = [Vec3::zero(); SKINNED_JOINTS];
        match &self.joints {
            JointPlacement::Regressed(rows) => {
                for (joint, row) in joints.iter_mut().zip(rows) {
                    for &(vertex, factor) in row {
                        *joint += vertices[vertex as usize] * T::constant(factor);
                    }
                }
            }
            JointPlacement::Given {
                template,
                shape_directions,
            } => {
                let placed = displaced(template, shape_directions, shape);
                joints.copy_from_slice(&placed);
            }
        }
        joints
    }

    /// Returns the rotation vectors of joints 1 to 15 \[rad\] for pose coefficients, counted from the flat hand or
    /// from the model's mean.
    pub fn pose<T: Real>(&self, coefficients: &[T], flat_mean: bool) -> [T; POSE_VALUES] {
        let mean = if flat_mean {
            [0.0; POSE_VALUES]
        } else {
            self.pose_mean
        };
        pose_of(&self.pose_components, &mean, coefficients)
    }

    /// Returns the movement of the vertices by the pose \[m\]: pose_directions . (R - I of joints 1 to 15).
    pub fn pose_blending<T: Real>(&self, rotations: &[Mat3<T>; SKINNED_JOINTS]) -> Vec<Vec3<T>> {
        let Some(directions) = &self.pose_directions else {
            return vec![Vec3::zero(); self.template.len()];
        };
        let features = pose_features(rotations);
        let rows = directions.chunks_exact(3 * POSE_FEATURES);
        rows.map(|rows| {
            let axis = |axis: usize| {
                let row = &rows[axis * POSE_FEATURES..(axis + 1) * POSE_FEATURES];
                let terms = row.iter().zip(&features);
                terms.fold(T::zero(), |sum, (&factor, &feature)| {
                    sum + feature.scale(factor)
                })
            };
            Vec3::new(axis(0), axis(1), axis(2))
        })
        .collect()
    }

    /// Returns the vertices in the object frame \[m\], in the model's order: linear blend skinning of `vertices`
    /// (shaped, in the straight pose) by `joints` in the pose `pose`, then x -> rotation x + translation.
    ///
    /// x_v = sum_j w_vj (G_j (u_v - J_j) + p_j), with u_v = vertices\[v\] + [`SkinnedModel::pose_blending`], J_j the
    /// joints of the straight pose, and G_j, p_j their posed frames. Smooth in all arguments, also at rotation vectors
    /// of length 0 and pi.
    ///
    /// # Source
    /// Romero, Tzionas, Black: Embodied Hands, ACM TOG 36(6), 2017, eqs. 1-5.
    pub fn posed_vertices<T: Real>(
        &self,
        vertices: &[Vec3<T>],
        joints: &[Vec3<T>; SKINNED_JOINTS],
        pose: &[T; POSE_VALUES],
        rotation: &Mat3<T>,
        translation: Vec3<T>,
    ) -> Vec<Vec3<T>> {
        let rotations = local_rotations(pose);
        let base = Rigid {
            rotation: *rotation,
            translation,
        };
        let frames = joint_frames(&self.parents, joints, &rotations, &base);
        let blending = self.pose_blending(&rotations);
        let blended = vertices.iter().zip(&blending).zip(&self.weights);
        blended
            .map(|((&rest, &blending), weights)| {
                let influences = weights.iter().copied().enumerate();
                let influences = influences.filter(|(_, weight)| *weight != 0.0);
                let place = |joint: usize| frames[joint].apply(rest + blending - joints[joint]);
                skinned(influences, place, |_| ())
            })
            .collect()
    }
}

/// Computes sum_j w_j x_j, the linear blend skinning of a vertex that joint j alone would place at x_j; `visit` is
/// shown each summand.
#[inline]
pub(crate) fn skinned<T: Real>(
    influences: impl Iterator<Item = (usize, f64)>,
    place: impl Fn(usize) -> Vec3<T>,
    mut visit: impl FnMut(Vec3<T>),
) -> Vec3<T> {
    let mut sum = Vec3::zero();
    for (joint, weight) in influences {
        let part = place(joint) * T::constant(weight);
        visit(part);
        sum += part;
    }
    sum
}

/// rest + directions . parameters, with directions `[n, 3, s]`.
fn displaced<T: Real>(rest: &[[f64; 3]], directions: &[f64], parameters: &[T]) -> Vec<Vec3<T>> {
    let count = directions.len() / (3 * rest.len()).max(1);
    let at = |index: usize| {
        let axis = |axis: usize| {
            let start = (3 * index + axis) * count;
            let row = directions[start..start + count].iter().zip(parameters);
            row.fold(
                T::constant(rest[index][axis]),
                |sum, (&factor, &parameter)| sum + parameter.scale(factor),
            )
        };
        Vec3::new(axis(0), axis(1), axis(2))
    };
    (0..rest.len()).map(at).collect()
}

/// Returns the entries of R - I of joints 1 to 15, row by row.
pub(crate) fn pose_features<T: Real>(rotations: &[Mat3<T>; SKINNED_JOINTS]) -> [T; POSE_FEATURES] {
    let mut features = [T::zero(); POSE_FEATURES];
    for joint in 1..SKINNED_JOINTS {
        for row in 0..3 {
            let v = rotations[joint].rows[row];
            let entries = [v.x, v.y, v.z];
            for column in 0..3 {
                let unit = if row == column { T::one() } else { T::zero() };
                features[9 * (joint - 1) + 3 * row + column] = entries[column] - unit;
            }
        }
    }
    features
}

/// Returns the frame of each joint in the object frame: its origin at the joint, its axes those of the model in the
/// straight pose. `base` maps the model's own coordinates into the object frame.
pub(crate) fn joint_frames<T: Real>(
    parents: &[Option<usize>],
    joints: &[Vec3<T>; SKINNED_JOINTS],
    rotations: &[Mat3<T>; SKINNED_JOINTS],
    base: &Rigid<T>,
) -> [Rigid<T>; SKINNED_JOINTS] {
    let mut frames = [Rigid::identity(); SKINNED_JOINTS];
    for joint in 0..SKINNED_JOINTS {
        let (parent, offset) = match parents[joint] {
            Some(parent) => (frames[parent], joints[joint] - joints[parent]),
            None => (*base, joints[joint]),
        };
        frames[joint] = Rigid {
            rotation: parent.rotation.compose(&rotations[joint]),
            translation: parent.apply(offset),
        };
    }
    frames
}

/// Computes what each joint does to points of the straight pose: x -> R (x - J) + p for its frame (R, p).
pub(crate) fn joint_motions<T: Real>(
    frames: &[Rigid<T>; SKINNED_JOINTS],
    joints: &[Vec3<T>; SKINNED_JOINTS],
) -> [Rigid<T>; SKINNED_JOINTS] {
    let mut motions = *frames;
    for (motion, &joint) in motions.iter_mut().zip(joints) {
        motion.translation -= motion.rotation.apply(joint);
    }
    motions
}
