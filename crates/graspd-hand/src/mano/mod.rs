//! Skinned hands in the layout of MANO.

mod model;
mod options;

pub use model::{
    JointPlacement, POSE_FEATURES, POSE_VALUES, SKINNED_JOINT_NAMES, SKINNED_JOINT_PARENTS,
    SKINNED_JOINTS, SkinnedModel,
};
pub use options::SkinnedHandOptions;
