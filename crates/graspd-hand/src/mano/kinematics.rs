//! Positions of a skinned hand's points and their transposed Jacobian, for buffers of either precision.

use graspd_ad::Element;

use super::bones::{BonePose, JointForces};
use super::hand::SkinnedHand;
use super::model::{POSE_VALUES, SKINNED_JOINTS};
use super::pose_space::{pose_of, pose_pullback};
use super::skin::Skin;
use super::skin_kernels::{JointLoad, Skinning, SkinningPullback};
use super::skinning::pose_features;
use crate::scratch::{choose, choose_mut};
use crate::{HandPose, HandScratch, HandState, Kinematics, PointBuffer, PoseGradient};

/// What the forward pass leaves for the pullback.
#[derive(Debug)]
struct SkinnedScratch {
    bones: BonePose,
    loads: [JointLoad; SKINNED_JOINTS],
    /// The vertices before skinning, in the precision of the buffers.
    blended_f32: PointBuffer<f32>,
    blended_f64: PointBuffer<f64>,
}

impl SkinnedHand {
    /// Returns the rotation vectors of joints 1 to 15 \[rad\] for this hand's pose coefficients.
    pub fn pose_of<T: graspd_ad::Real>(&self, articulation: &[T]) -> [T; POSE_VALUES] {
        pose_of(&self.components, &self.mean, articulation)
    }

    pub(crate) fn set_bones(&self, pose: &HandPose, bones: &mut BonePose) {
        let vectors = self.pose_of(&pose.articulation);
        bones.set(&self.model.parents, &self.joints, vectors, &pose.base());
    }

    /// Makes working memory.
    pub(crate) fn scratch(&self) -> HandScratch {
        let points = self.contact_vertices().len();
        HandScratch {
            contact_remainder: PointBuffer::zeros(points),
            state: HandState::new(SkinnedScratch {
                bones: BonePose::default(),
                loads: [JointLoad::default(); SKINNED_JOINTS],
                blended_f32: PointBuffer::zeros(points),
                blended_f64: PointBuffer::zeros(points),
            }),
        }
    }

    fn skin<E: Element>(&self) -> &Skin<E> {
        choose([&self.skin_f32, &self.skin_f64])
    }
}

impl<E: Element> Kinematics<E> for SkinnedHand {
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    ) {
        let SkinnedScratch {
            bones,
            blended_f32,
            blended_f64,
            ..
        } = scratch.state.get_mut();
        self.set_bones(pose, bones);
        E::vectorize(Skinning {
            skin: self.skin(),
            exact: &self.skin_f64,
            features: &pose_features(&bones.rotations),
            motions: &bones.motions,
            blended: choose_mut([blended_f32, blended_f64]),
            posed: contacts,
            remainder: &mut scratch.contact_remainder,
        });
        let centers = self.sphere_centers.iter();
        for (index, (&center, &body)) in centers.zip(&self.spheres.body).enumerate() {
            let body = body as usize;
            spheres.set(index, bones.frames[body].apply(center - self.joints[body]));
        }
    }

    fn pullback(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        _contacts: &PointBuffer<E>,
        contact_gradient: &PointBuffer<E>,
        spheres: &PointBuffer<E>,
        sphere_gradient: &PointBuffer<E>,
        gradient: &mut PoseGradient,
    ) {
        let SkinnedScratch {
            bones,
            loads,
            blended_f32,
            blended_f64,
        } = scratch.state.get_mut();
        let blended: &mut PointBuffer<E> = choose_mut([blended_f32, blended_f64]);
        E::vectorize(SkinningPullback {
            skin: self.skin(),
            motions: &bones.motions,
            blended,
            gradient: contact_gradient,
            loads,
        });
        let mut forces = JointForces::of_skin(loads, &self.joints, bones);
        for (index, &body) in self.spheres.body.iter().enumerate() {
            let body = body as usize;
            let arm = spheres.get(index) - bones.frames[body].translation;
            forces.add_at(body, sphere_gradient.get(index), arm);
        }
        let by_pose = forces.pull_back(
            &self.model.parents,
            bones,
            loads,
            pose.translation,
            gradient,
        );
        pose_pullback(&self.components, &by_pose, &mut gradient.articulation);
    }
}
