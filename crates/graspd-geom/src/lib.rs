//! Meshes, exact signed distances and SDF grids.
//!
//! ```
//! use graspd_geom::{MassProperties, SignedDistance, builtin_object, closed_surface, load_mesh, save_obj};
//! use nalgebra::Point3;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("mug.obj");
//! // A mesh file, here one made from a built-in object.
//! save_obj(&builtin_object("mug").ok_or("no such object")?, &path)?;
//!
//! // A mesh must be closed to have an inside; where it is not, the error says how large its holes are.
//! let mug = closed_surface(&load_mesh(&path)?, "mug.obj")?;
//!
//! let mass = MassProperties::new(&mug, 1000.0, "mug.obj")?;
//! assert!((0.10..0.12).contains(&mass.mass)); // kg
//!
//! // The centre of mass of a mug is in the air that it surrounds: the distance is positive.
//! let surface = SignedDistance::new(&mug)?;
//! assert!(surface.signed_distance(&mass.center_of_mass) > 0.02);
//! # Ok(())
//! # }
//! ```

mod cache;
mod closed;
mod distance;
mod error;
mod io;
mod isosurface;
mod lofting;
mod mass;
mod mesh;
mod objects;
#[cfg(feature = "testing")]
mod parry_bridge;
mod pointcloud;
mod poisson;
mod remeshing;
mod repair;
mod rgbd;
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
pub use distance::{ClosestPoint, RayHit, SignedDistance, TriangleTree, WindingField};
pub use error::GeometryError;
pub use io::{
    load_mesh, load_point_cloud, parse_mesh, require_mesh_format, save_mesh, save_obj, save_off,
    save_ply, save_stl,
};
pub use isosurface::{NodeGrid, isosurface};
pub use mass::{MassProperties, signed_volume};
pub use mesh::TriangleMesh;
pub use objects::{BUILTIN_OBJECTS, BuiltinObject, builtin_object};
#[cfg(feature = "testing")]
pub use parry_bridge::parry_signed_distance;
pub use pointcloud::{KdTree, PointCloud};
pub use poisson::{PoissonSettings, PoissonSurface, poisson_surface};
pub use remeshing::{RemeshTarget, remesh};
pub use repair::{
    FilledHole, RepairReport, RepairSettings, RepairTier, RepairedMesh, connected_parts, repair,
};
pub use rgbd::{
    DepthImage, DepthIntrinsics, DepthNoise, DepthScene, DepthView, FusedCloud, FusedView,
    FusionSettings, ObjectMask, PinholeCamera, Plane, Reconstruction, ReconstructionSettings,
    Registration, RgbdCapture, ScanSettings, TurntableViews, align_to_mesh, fuse, is_ycb_capture,
    read_capture, read_simple_capture, read_ycb_capture, reconstruct, scan_on_turntable,
    standing_on_table,
};
pub use rigid::{Mat3, Quaternion, Rigid, Vec3};
pub use sampling::{SurfacePoint, SurfaceSampler, sample_evenly};
pub use sdf::{SdfGrid, SdfSampling};
pub use sequence_sampling::sample_by_sequence;
pub use shapes::{box_mesh, capsule_mesh, cylinder_mesh, sphere_mesh};
#[cfg(feature = "testing")]
pub use test_data::shared_file;
pub use topology::{BoundaryLoop, Topology, topology};
pub use whole_file::write_atomically;
