//! Points that follow a skinned hand: each is moved by the joints that its vertices' weights name, by those between
//! them and the wrist, and, with blendshapes, by all.

use graspd_geom::{Mat3, Vec3};
use nalgebra::{DMatrix, Point3};

use super::bones::{BonePose, antisymmetric};
use super::hand::SkinnedHand;
use super::model::{POSE_FEATURES, POSE_VALUES, SKINNED_JOINTS};
use super::pose_space::{left_jacobian_transposed, rotation_vector};
use super::skin::JOINT_FEATURES;
use super::skinning::skinned;
use crate::{HandPoint, HandPose, JacobianRows, PointForces, PosedHand};

/// What [`PosedHand`] keeps of a skinned hand.
#[derive(Clone, Debug, Default)]
struct PosedSkin {
    bones: BonePose,
    /// The summands of each vertex: where a joint alone would put it, times its weight; as `VertexInfluences::joints`.
    parts: Vec<Vec3<f64>>,
}

/// The forces on the joints, and their torques about the object frame's origin, of one pull.
struct Loads {
    force: [Vec3<f64>; SKINNED_JOINTS],
    torque: [Vec3<f64>; SKINNED_JOINTS],
    /// The derivative by the pose features of each joint, if there are blendshapes.
    features: [[f64; JOINT_FEATURES]; SKINNED_JOINTS],
    /// A bit for each joint that anything pulls at.
    pulled: u32,
}

impl Loads {
    const NONE: Self = Self {
        force: [ZERO; SKINNED_JOINTS],
        torque: [ZERO; SKINNED_JOINTS],
        features: [[0.0; JOINT_FEATURES]; SKINNED_JOINTS],
        pulled: 0,
    };

    #[inline]
    fn add(&mut self, joint: usize, force: Vec3<f64>, torque: Vec3<f64>) {
        self.pulled |= 1 << joint;
        self.force[joint] += force;
        self.torque[joint] += torque;
    }
}

const ZERO: Vec3<f64> = Vec3 {
    x: 0.0,
    y: 0.0,
    z: 0.0,
};

impl SkinnedHand {
    pub(crate) fn place(&self, pose: &HandPose, posed: &mut PosedHand) {
        let PosedHand {
            vertices,
            spheres,
            bodies,
            state,
        } = posed;
        let PosedSkin { bones, parts } = state.get_or_default();
        self.set_bones(pose, bones);
        let blending = (self.model.pose_directions.is_some())
            .then(|| self.model.pose_blending(&bones.rotations));
        parts.clear();
        vertices.clear();
        for (vertex, &rest) in self.rest.iter().enumerate() {
            let blended = blending
                .as_ref()
                .map_or(rest, |blending| rest + blending[vertex]);
            let influences = &self.influences.joints[self.influences.range(vertex)];
            let influences = influences
                .iter()
                .map(|&(joint, weight)| (joint as usize, weight));
            let place = |joint: usize| bones.motions[joint].apply(blended);
            let position = skinned(influences, place, |part| parts.push(part));
            vertices.push(position.into());
        }
        self.cap.close(vertices);
        spheres.clear();
        spheres.extend(self.sphere_centers.iter().zip(&self.spheres.body).map(
            |(&center, &body)| {
                let body = body as usize;
                Point3::from(bones.frames[body].apply(center - self.joints[body]))
            },
        ));
        bodies.clear();
        bodies.extend_from_slice(&bones.frames);
    }

    /// Computes rows whose columns are the rotation vectors of joints 1 to 15.
    pub(crate) fn rows_of(
        &self,
        pose: &HandPose,
        posed: &PosedHand,
        forces: &[PointForces],
        rows: &mut JacobianRows,
    ) {
        let bones = &posed.state.get::<PosedSkin>().bones;
        let by_vector = turns_by_vectors(bones);
        let mut loads = Loads::NONE;
        rows.clear();
        for forces in forces {
            for &(point, force) in &forces.points {
                match point {
                    HandPoint::Vertex(vertex) => self.load_vertex(posed, vertex, force, &mut loads),
                    HandPoint::Sphere(sphere) => {
                        let body = self.spheres.body[sphere as usize] as usize;
                        loads.add(body, force, posed.position(point).cross(force));
                    }
                }
            }
            // From the finger tips inwards: parents come before their children.
            for joint in (1..SKINNED_JOINTS).rev() {
                if loads.pulled & (1 << joint) == 0 {
                    continue;
                }
                let (force, torque) = (loads.force[joint], loads.torque[joint]);
                let parent = self.model.parents[joint].unwrap_or(0);
                loads.add(parent, force, torque);
                let turn = torque - bones.frames[joint].translation.cross(force);
                let mut turn = bones.frames[parent].rotation.apply_transposed(turn);
                if self.model.pose_directions.is_some() {
                    let [a, b, c] = [0, 3, 6].map(|k| {
                        let f = &loads.features[joint];
                        Vec3::new(f[k], f[k + 1], f[k + 2])
                    });
                    let bent = Mat3 { rows: [a, b, c] };
                    turn += antisymmetric(&bent.compose(&bones.rotations[joint].transpose()));
                    loads.features[joint] = [0.0; JOINT_FEATURES];
                }
                let Vec3 { x, y, z } = by_vector[joint].apply(turn);
                let column = 3 * (joint as u32 - 1);
                rows.push(column, x);
                rows.push(column + 1, y);
                rows.push(column + 2, z);
                (loads.force[joint], loads.torque[joint]) = (ZERO, ZERO);
            }
            (loads.force[0], loads.torque[0], loads.pulled) = (ZERO, ZERO, 0);
            rows.end(forces, posed, pose.translation);
        }
    }

    fn load_vertex(&self, posed: &PosedHand, vertex: u32, force: Vec3<f64>, loads: &mut Loads) {
        let vertex = vertex as usize;
        if let Some(middle) = vertex.checked_sub(self.rest.len()) {
            let wrist = &self.cap.loops[middle];
            let share = force * (1.0 / wrist.len() as f64);
            for &vertex in wrist {
                self.load_vertex(posed, vertex, share, loads);
            }
            return;
        }
        let range = self.influences.range(vertex);
        let PosedSkin { bones, parts } = posed.state.get();
        let mut before_skinning = Vec3::zero();
        for (&(joint, weight), part) in self.influences.joints[range.clone()]
            .iter()
            .zip(&parts[range])
        {
            let joint = joint as usize;
            loads.add(joint, force * weight, part.cross(force));
            if self.model.pose_directions.is_some() {
                let turned = bones.frames[joint].rotation.apply_transposed(force);
                before_skinning += turned * weight;
            }
        }
        let Some(directions) = &self.model.pose_directions else {
            return;
        };
        // Blendshapes hang on all joints.
        loads.pulled = (1 << SKINNED_JOINTS) - 1;
        let axes = [before_skinning.x, before_skinning.y, before_skinning.z];
        for (axis, pull) in axes.into_iter().enumerate() {
            let start = (3 * vertex + axis) * POSE_FEATURES;
            let row = &directions[start..start + POSE_FEATURES];
            for (features, row) in loads.features[1..].iter_mut().zip(row.as_chunks().0) {
                let row: &[f64; JOINT_FEATURES] = row;
                for (feature, direction) in features.iter_mut().zip(row) {
                    *feature += pull * direction;
                }
            }
        }
    }

    /// Returns the components, one a column.
    pub(crate) fn component_basis(&self) -> DMatrix<f64> {
        DMatrix::from_fn(POSE_VALUES, self.components.len(), |value, component| {
            self.components[component][value]
        })
    }
}

/// Returns for each joint the transposed left Jacobian of its rotation vector: from the derivative by a small turn of
/// what hangs on it to that by the vector.
fn turns_by_vectors(bones: &BonePose) -> [Mat3<f64>; SKINNED_JOINTS] {
    std::array::from_fn(|joint| {
        let Some(number) = joint.checked_sub(1) else {
            return Mat3::identity();
        };
        let vector = rotation_vector(&bones.pose, number);
        let columns = Mat3::identity()
            .rows
            .map(|axis| left_jacobian_transposed(vector, axis));
        Mat3 { rows: columns }.transpose()
    })
}
