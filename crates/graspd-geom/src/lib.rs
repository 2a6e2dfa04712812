//! Meshes, exact signed distances and SDF grids.

mod mesh;
mod rigid;
#[cfg(feature = "testing")]
mod test_data;

pub use mesh::TriangleMesh;
pub use rigid::{Mat3, Quaternion, Rigid, Vec3};
#[cfg(feature = "testing")]
pub use test_data::shared_file;
