//! Meshes, exact signed distances and SDF grids.

mod closed;
mod distance;
mod error;
mod io;
mod lofting;
mod mass;
mod mesh;
mod objects;
#[cfg(feature = "testing")]
mod parry_bridge;
mod rigid;
mod sampling;
mod sdf;
mod shapes;
#[cfg(feature = "testing")]
mod test_data;
mod topology;

pub use closed::{ClosedSurface, closed_surface, flipped, require_closed, weld_exact};
pub use distance::{ClosestPoint, SignedDistance, TriangleTree};
pub use error::GeometryError;
pub use io::{load_mesh, save_mesh, save_obj, save_off, save_stl};
pub use mass::{MassProperties, signed_volume};
pub use mesh::TriangleMesh;
pub use objects::{BUILTIN_OBJECTS, BuiltinObject, builtin_object};
#[cfg(feature = "testing")]
pub use parry_bridge::parry_signed_distance;
pub use rigid::{Mat3, Quaternion, Rigid, Vec3};
pub use sampling::{SurfacePoint, SurfaceSampler, sample_evenly};
pub use sdf::SdfGrid;
pub use shapes::{box_mesh, capsule_mesh, cylinder_mesh, sphere_mesh};
#[cfg(feature = "testing")]
pub use test_data::shared_file;
pub use topology::{BoundaryLoop, Topology, topology};
