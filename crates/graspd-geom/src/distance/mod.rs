//! Exact distances to triangle meshes, and their sign.

mod batch;
mod boundary;
mod cluster;
mod eight_boxes;
mod oriented_box;
mod packet;
mod ray;
mod search;
mod signed;
mod tree;
mod triangle;
mod wide_tree;
mod winding;
mod winding_field;

pub use boundary::check_finite;
pub(crate) use eight_boxes::Slack;
pub(crate) use packet::{PACKET, PacketSearch};
pub use ray::RayHit;
pub use signed::SignedDistance;
pub use tree::{ClosestPoint, TriangleTree};
pub(crate) use winding::Column;
pub use winding_field::WindingField;
