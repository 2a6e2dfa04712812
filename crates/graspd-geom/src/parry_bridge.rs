//! The only file that names parry: its signed distance, as an oracle that shares no code with ours.

use nalgebra::Point3;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

use crate::TriangleMesh;

/// Signed distance to a closed mesh through parry (feature `testing`): a function from points to metres,
/// negative inside; `None` for a mesh that parry rejects.
///
/// Inside and outside come from pseudo-normals, so the sign can be trusted only where the surface does not
/// intersect itself.
pub fn parry_signed_distance(mesh: &TriangleMesh) -> Option<impl Fn(&Point3<f64>) -> f64 + use<>> {
    let vertices = mesh
        .vertices
        .iter()
        .map(|p| Vector::new(p.x, p.y, p.z))
        .collect();
    // Without this flag parry finds no point to be inside.
    let shape = TriMesh::with_flags(vertices, mesh.faces.clone(), TriMeshFlags::ORIENTED).ok()?;
    Some(move |p: &Point3<f64>| shape.distance_to_local_point(Vector::new(p.x, p.y, p.z), false))
}
