//! Hands: kinematics, limits and contact points.

mod allegro;
mod articulated;
mod articulated_kinematics;
mod builtin;
mod contact_points;
mod error;
mod hand;
mod joint;
mod limits;
mod outline;
mod part;
mod self_collision;
mod tree;

pub use allegro::allegro;
pub use articulated::{ArticulatedHand, HandDescription, HandOptions};
pub use builtin::{BUILTIN_HANDS, BuiltinHand, builtin_hand, load_hand};
pub use error::HandError;
pub use hand::{
    CollisionSpheres, ContactPoints, Hand, HandPose, HandScratch, Kinematics, Limit, POINT_PADDING,
    PalmFrame, PointBuffer, PoseGradient,
};
pub use joint::{Joint, JointKind, Mimic};
pub use limits::{clamp_to_limits, middle_of_limits};
pub use part::Part;
pub use tree::{KinematicTree, LinkFrame};
