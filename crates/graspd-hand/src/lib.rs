//! Hands: kinematics, limits, contact points and self-intersection.
//!
//! Every hand, built in or loaded, is a [`Hand`]: positions of its contact points as a function of its [`HandPose`],
//! and the transposed Jacobian of that function, which turns forces on the points into a [`PoseGradient`].
//!
//! ```
//! use graspd_geom::{Quaternion, Vec3};
//! use graspd_hand::{Hand, HandPose, Kinematics, PointBuffer, PoseGradient, load_hand};
//!
//! // A name of a built-in hand, or the path of a URDF file.
//! let hand = load_hand("allegro")?;
//! let pose = HandPose {
//!     translation: Vec3::new(0.0, 0.0, 0.3),
//!     rotation: Quaternion::identity(),
//!     articulation: hand.open_articulation().to_vec(),
//! };
//!
//! // Where its points are, in single precision.
//! let mut scratch = hand.new_scratch();
//! let mut contacts = PointBuffer::<f32>::zeros(hand.contact_points().weight.len());
//! let mut spheres = PointBuffer::<f32>::zeros(hand.collision_spheres().radius.len());
//! hand.forward(&pose, &mut scratch, &mut contacts, &mut spheres);
//!
//! // Which way to move it so that the first point rises.
//! let mut upward = PointBuffer::<f32>::zeros(contacts.len());
//! upward.z[0] = 1.0;
//! let no_push = PointBuffer::<f32>::zeros(spheres.len());
//! let mut gradient = PoseGradient::zero(pose.articulation.len());
//! hand.pullback(&pose, &mut scratch, &contacts, &upward, &spheres, &no_push, &mut gradient);
//! assert_eq!(gradient.translation, Vec3::new(0.0, 0.0, 1.0));
//! # Ok::<(), graspd_hand::HandError>(())
//! ```

mod allegro;
mod articulated;
mod articulated_jacobian;
mod articulated_kinematics;
mod autodiff_hand;
mod barrett;
mod body_motion;
mod body_points;
mod builtin;
mod closing_direction;

mod collision_pairs;
mod contact_points;
mod error;
mod hand;
mod hand_options;
mod human;
mod jacobian_rows;
mod joint;
mod leap;
mod limits;
mod mano;
mod mirroring;
mod palm;
mod points;
mod primitive_hand;
mod scratch;
mod self_collision;
mod sharp_edges;
mod swept_solids;
mod tree;
mod urdf;

pub use allegro::allegro;
pub use articulated::{ArticulatedHand, HandDescription};
pub use autodiff_hand::{AutodiffHand, HandModel, HandModelDescription};
pub use barrett::barrett;
pub use builtin::{
    BUILTIN_HANDS, BuiltinHand, LoadOptions, SkinOptions, builtin_hand, load_hand, load_hand_from,
};
pub use closing_direction::{closed_articulation, closing_directions};
pub use error::HandError;
pub use hand::{
    CollisionSpheres, ContactPoints, Hand, HandPose, Kinematics, PalmFrame, Part, PoseGradient,
};
pub use hand_options::HandOptions;
pub use human::{HUMAN_SHAPE_NAMES, human};
pub use jacobian_rows::{JacobianRow, JacobianRows, PointForces};
pub use joint::{Joint, JointKind, Mimic};
pub use leap::leap;
pub use limits::{Limit, clamp_to_limits};
pub use mano::{
    JointPlacement, NumpyValue, POSE_FEATURES, POSE_VALUES, SKINNED_JOINT_PARENTS, SKINNED_JOINTS,
    SkinnedHand, SkinnedHandOptions, SkinnedModel, load_skinned_hand, load_skinned_model,
    parse_skinned_model, read_npy,
};
pub use mirroring::MirroredHand;
pub use points::{POINT_PADDING, PointBuffer};
pub use scratch::{HandPoint, HandScratch, HandState, PosedHand};
pub use tree::{KinematicTree, LinkFrame};
pub use urdf::{UrdfOptions, load_urdf, parse_urdf};
