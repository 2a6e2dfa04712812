//! Exact distances to triangle meshes, and their sign.

mod closed;
mod error;
mod signed;
mod tree;
mod triangle;
mod winding;

pub use error::DistanceError;
pub use signed::SignedDistance;
pub use tree::{ClosestPoint, TriangleTree};
