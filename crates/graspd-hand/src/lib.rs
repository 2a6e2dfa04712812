//! Hands: kinematics, limits and contact points.

mod hand;

pub use hand::{
    CollisionSpheres, ContactPoints, Hand, HandPose, HandScratch, Kinematics, Limit, POINT_PADDING,
    PalmFrame, PointBuffer, PoseGradient,
};
