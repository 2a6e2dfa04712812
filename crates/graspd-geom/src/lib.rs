//! Meshes, exact signed distances and SDF grids.

mod distance;
mod mesh;
mod rigid;
mod sdf;
#[cfg(feature = "testing")]
mod test_data;

pub use distance::{ClosestPoint, DistanceError, SignedDistance, TriangleTree};
pub use mesh::TriangleMesh;
pub use rigid::{Mat3, Quaternion, Rigid, Vec3};
pub use sdf::SdfGrid;
#[cfg(feature = "testing")]
pub use test_data::shared_file;
