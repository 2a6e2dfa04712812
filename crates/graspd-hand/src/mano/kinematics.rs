//! Positions of a skinned hand's points and their transposed Jacobian, for buffers of either precision.

use graspd_ad::{Element, vectorize};
use graspd_geom::{Rigid, Vec3};

use super::bones::{BonePose, JointForces};
use super::hand::SkinnedHand;
use super::model::{POSE_VALUES, SKINNED_JOINTS};
use super::pose_space::{pose_of, pose_pullback};
use super::skin::{JOINT_FEATURES, Skin};
use super::skin_kernels::{JointLoad, Motion, Pose, Pullback};
use super::skinning::pose_features;
use super::split_pose::SplitPose;
use crate::{HandPose, HandScratch, Kinematics, PointBuffer, PoseGradient};

/// What the forward pass leaves for the pullback.
#[derive(Clone, Debug)]
pub(crate) struct SkinnedScratch {
    bones: BonePose,
    loads: [JointLoad; SKINNED_JOINTS],
    in_f64: SkinScratch<f64>,
    in_f32: SkinScratch<f32>,
}

/// The part that is kept in the buffers' precision.
#[derive(Clone, Debug)]
pub(crate) struct SkinScratch<E> {
    motions: [Motion<E>; SKINNED_JOINTS],
    features: [[E; JOINT_FEATURES]; SKINNED_JOINTS],
    blended: PointBuffer<E>,
}

impl SkinnedScratch {
    /// For a hand with `points` contact points, padding included.
    pub(crate) fn new(points: usize) -> Self {
        Self {
            bones: BonePose::default(),
            loads: [JointLoad::default(); SKINNED_JOINTS],
            in_f64: SkinScratch::new(points),
            in_f32: SkinScratch::new(points),
        }
    }
}

impl<E: Element> SkinScratch<E> {
    fn new(points: usize) -> Self {
        Self {
            motions: [Motion {
                rotation: [E::zero(); 9],
                translation: [E::zero(); 3],
            }; SKINNED_JOINTS],
            features: [[E::zero(); JOINT_FEATURES]; SKINNED_JOINTS],
            blended: PointBuffer::zeros(points),
        }
    }

    /// The motion x -> R (x - J) + p of each joint, and the pose features.
    fn set(&mut self, joints: &[Vec3<f64>; SKINNED_JOINTS], bones: &BonePose) {
        let features = pose_features(&bones.rotations);
        for joint in 0..SKINNED_JOINTS {
            let Rigid {
                rotation,
                translation,
            } = bones.frames[joint];
            let t = translation - rotation.apply(joints[joint]);
            let [x, y, z] = rotation.rows;
            self.motions[joint] = Motion {
                rotation: [x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z].map(E::constant),
                translation: [t.x, t.y, t.z].map(E::constant),
            };
            for k in 0..JOINT_FEATURES {
                // The wrist has none.
                let at = (JOINT_FEATURES * joint + k).checked_sub(JOINT_FEATURES);
                self.features[joint][k] = E::constant(at.map_or(0.0, |at| features[at]));
            }
        }
    }
}

/// The precisions of a hand's buffers: which skin they use, and which lanes go through it.
trait Precision: Element {
    fn skin(hand: &SkinnedHand) -> &Skin<Self>;
    fn split(scratch: &mut SkinnedScratch) -> Parts<'_, Self>;
    /// Poses the contact points with the bones of `scratch`.
    fn pose(hand: &SkinnedHand, scratch: &mut HandScratch, contacts: &mut PointBuffer<Self>);
    fn pull(kernel: Pullback<'_, Self>);
}

struct Parts<'a, E> {
    bones: &'a mut BonePose,
    loads: &'a mut [JointLoad; SKINNED_JOINTS],
    skin: &'a mut SkinScratch<E>,
}

impl Precision for f64 {
    fn skin(hand: &SkinnedHand) -> &Skin<Self> {
        &hand.skin_f64
    }
    fn split(scratch: &mut SkinnedScratch) -> Parts<'_, Self> {
        Parts {
            bones: &mut scratch.bones,
            loads: &mut scratch.loads,
            skin: &mut scratch.in_f64,
        }
    }
    fn pose(hand: &SkinnedHand, scratch: &mut HandScratch, contacts: &mut PointBuffer<Self>) {
        let Parts { bones, skin, .. } = Self::split(own(scratch));
        skin.set(&hand.joints, bones);
        let kernel = Pose {
            skin: &hand.skin_f64,
            features: &skin.features,
            motions: &skin.motions,
            blended: &mut skin.blended,
            posed: contacts,
        };
        kernel.over::<f64>();
    }
    fn pull(kernel: Pullback<'_, Self>) {
        kernel.over::<f64>();
    }
}

impl Precision for f32 {
    fn skin(hand: &SkinnedHand) -> &Skin<Self> {
        &hand.skin_f32
    }
    fn split(scratch: &mut SkinnedScratch) -> Parts<'_, Self> {
        Parts {
            bones: &mut scratch.bones,
            loads: &mut scratch.loads,
            skin: &mut scratch.in_f32,
        }
    }
    fn pose(hand: &SkinnedHand, scratch: &mut HandScratch, contacts: &mut PointBuffer<Self>) {
        let HandScratch {
            skinned,
            contact_remainder,
            ..
        } = scratch;
        let skinned = skinned.as_deref_mut().expect(OWN_SCRATCH);
        skinned.in_f32.set(&hand.joints, &skinned.bones);
        skinned.in_f64.set(&hand.joints, &skinned.bones);
        vectorize(SplitPose {
            skin: &hand.skin_f32,
            exact: &hand.skin_f64,
            features: &skinned.in_f32.features,
            motions: &skinned.in_f64.motions,
            blended: &mut skinned.in_f32.blended,
            posed: contacts,
            remainder: contact_remainder,
        });
    }
    fn pull(kernel: Pullback<'_, Self>) {
        vectorize(kernel);
    }
}

impl SkinnedHand {
    /// The rotation vectors of joints 1 to 15 \[rad\] for this hand's pose coefficients.
    pub fn pose_of<T: graspd_ad::Real>(&self, articulation: &[T]) -> [T; POSE_VALUES] {
        pose_of(&self.components, &self.mean, articulation)
    }

    pub(crate) fn set_bones(&self, pose: &HandPose, bones: &mut BonePose) {
        let base = Rigid {
            rotation: pose.rotation.to_matrix(),
            translation: pose.translation,
        };
        let vectors = self.pose_of(&pose.articulation);
        bones.set(&self.model.parents, &self.joints, vectors, &base);
    }
}

/// Scratch made by another kind of hand cannot serve this one.
fn own(scratch: &mut HandScratch) -> &mut SkinnedScratch {
    scratch.skinned.as_deref_mut().expect(OWN_SCRATCH)
}

const OWN_SCRATCH: &str = "scratch must come from this hand's new_scratch";

impl<E: Precision> Kinematics<E> for SkinnedHand {
    fn forward(
        &self,
        pose: &HandPose,
        scratch: &mut HandScratch,
        contacts: &mut PointBuffer<E>,
        spheres: &mut PointBuffer<E>,
    ) {
        self.set_bones(pose, &mut own(scratch).bones);
        E::pose(self, scratch, contacts);
        let bones = &own(scratch).bones;
        let centers = self.sphere_centers.iter();
        for (index, (&center, &body)) in centers.zip(&self.spheres.body).enumerate() {
            let body = body as usize;
            spheres.set(index, bones.frames[body].apply(center - self.joints[body]));
        }
        let frames = bones.frames;
        scratch.body_poses.copy_from_slice(&frames);
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
        let Parts { bones, loads, skin } = E::split(own(scratch));
        E::pull(Pullback {
            skin: E::skin(self),
            motions: &skin.motions,
            blended: &skin.blended,
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
