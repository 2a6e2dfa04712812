//! Exact distances to triangle meshes, and their sign.

mod boundary;
mod oriented_box;
mod packet;
mod signed;
mod tree;
mod triangle;
mod winding;

pub(crate) use packet::{PACKET, Packet};
pub use signed::SignedDistance;
pub use tree::{ClosestPoint, TriangleTree};
pub(crate) use winding::Column;
