//! Skinned hands in the layout of MANO.

mod anatomy;
mod archive;
mod bones;
mod file;
mod fingers;
mod hand;
mod jacobian;
mod kinematics;
mod model;
mod numpy;
mod numpy_value;
mod open;
mod options;
mod pickle;
mod pickle_literals;
mod pickled_arrays;
mod pose_space;
mod skin;
mod skin_kernels;
mod skinning;
mod spheres;
mod wrist_cap;

pub use file::{load_skinned_hand, load_skinned_model, parse_skinned_model};
pub use hand::SkinnedHand;
pub use model::{
    JointPlacement, POSE_FEATURES, POSE_VALUES, SKINNED_JOINT_PARENTS, SKINNED_JOINTS, SkinnedModel,
};
pub use numpy_value::{NumpyValue, read_npy};
pub use options::SkinnedHandOptions;
