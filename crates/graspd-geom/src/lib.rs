//! Meshes, exact signed distances and SDF grids.
//!
//! ```
//! use graspd_geom::{MassProperties, SignedDistance, closed_surface, cylinder_mesh};
//! use nalgebra::Point3;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A can of 3 cm radius and 10 cm height; meshes of files come from the crate graspd-mesh.
//! let can = cylinder_mesh(0.03, 0.1, 0.005);
//!
//! // A mesh must be closed to have an inside; where it is not, the error says how large its holes are.
//! let can = closed_surface(&can, "can")?;
//!
//! let mass = MassProperties::new(&can, 1000.0, "can")?;
//! assert!((0.27..0.29).contains(&mass.mass)); // kg
//!
//! let surface = SignedDistance::new(&can)?;
//! assert!(surface.signed_distance(&Point3::new(0.0, 0.0, 0.06)) > 0.0);
//! assert!(surface.signed_distance(&mass.center_of_mass) < -0.02);
//! # Ok(())
//! # }
//! ```

mod cache;
mod closed;
mod distance;
mod error;
mod lofting;
mod mass;
mod mesh;
#[cfg(feature = "parry")]
mod parry_bridge;
mod parts;
mod rigid;
mod sampling;
mod sdf;
mod sequence_sampling;
mod shapes;
#[cfg(feature = "testing")]
mod test_data;
mod topology;
mod whole_file;

pub use cache::{CacheKey, CacheSize, DiskCache};
pub use closed::{ClosedSurface, closed_surface, flipped, require_closed, weld_exact};
pub use distance::{
    ClosestPoint, RayHit, SignedDistance, TriangleTree, WindingField, check_finite,
};
pub use error::GeometryError;
pub use lofting::{Loft, Ring, arc, on_circle, pieces, refined, revolved};
pub use mass::{MassProperties, encloses_volume, signed_volume};
pub use mesh::TriangleMesh;
#[cfg(feature = "parry")]
pub use parry_bridge::parry_signed_distance;
pub use parts::{Groups, components, connected_parts, submesh};
pub use rigid::{Mat3, Quaternion, Rigid, Vec3};
pub use sampling::{SurfacePoint, SurfaceSampler, sample_evenly};
pub use sdf::{SdfGrid, SdfSampling};
pub use sequence_sampling::sample_by_sequence;
pub use shapes::{box_mesh, capsule_mesh, cylinder_mesh, sphere_mesh};
#[cfg(feature = "testing")]
pub use test_data::shared_file;
pub use topology::{BoundaryLoop, Topology, boundary_loop, topology};
pub use whole_file::write_atomically;
