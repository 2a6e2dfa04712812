//! Object meshes from point clouds and RGB-D captures.
//!
//! ```
//! use graspd_geom::sphere_mesh;
//! use graspd_scan::{PointCloud, PoissonSettings, poisson_surface};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Points of a ball with their outward normals.
//! let ball = sphere_mesh(0.05, 0.005);
//! let mut cloud = PointCloud::from_points(ball.vertices.clone());
//! cloud.normals = ball.vertices.iter().map(|p| p.coords.normalize()).collect();
//!
//! let surface = poisson_surface(&cloud, &PoissonSettings { depth: 5, ..PoissonSettings::default() })?;
//! let off = |p: &nalgebra::Point3<f64>| (p.coords.norm() - 0.05).abs();
//! assert!(surface.mesh.vertices.iter().all(|p| off(p) < 2e-3));
//! # Ok(())
//! # }
//! ```
//!
//! | | module |
//! |---|---|
//! | point clouds, neighbours, normals | `pointcloud` |
//! | screened Poisson reconstruction | `poisson` |
//! | cameras, captures, rendering, fusing, reconstruction | `rgbd` |

mod pointcloud;
mod poisson;
mod rgbd;

pub use pointcloud::{KdTree, PointCloud, load_point_cloud};
pub use poisson::{PoissonSettings, PoissonSurface, poisson_surface};
pub use rgbd::{
    DepthImage, DepthIntrinsics, DepthNoise, DepthScene, DepthView, FusedCloud, FusedView,
    FusionSettings, ObjectMask, PinholeCamera, Plane, Reconstruction, ReconstructionSettings,
    Registration, RgbdCapture, ScanSettings, TurntableViews, align_to_mesh, fuse, read_capture,
    read_simple_capture, read_ycb_capture, reconstruct, scan_on_turntable,
};
