//! Placed solids for this crate's tests.

use graspd_geom::TriangleMesh;
use nalgebra::{Isometry3, Vector3};

/// An axis-aligned box of 12 faces.
pub(crate) fn box_mesh(center: [f64; 3], size: [f64; 3]) -> TriangleMesh {
    let size = Vector3::from(size);
    let motion = Isometry3::new(Vector3::from(center), Vector3::zeros());
    graspd_geom::box_mesh(size, size.max()).transformed(&motion)
}

/// A sphere with edges of at most `radius` / `fineness`.
pub(crate) fn sphere_mesh(center: [f64; 3], radius: f64, fineness: u32) -> TriangleMesh {
    let motion = Isometry3::new(Vector3::from(center), Vector3::zeros());
    graspd_geom::sphere_mesh(radius, radius / f64::from(fineness)).transformed(&motion)
}

/// Several meshes as one.
pub(crate) fn together(parts: &[TriangleMesh]) -> TriangleMesh {
    let mut mesh = TriangleMesh::default();
    for part in parts {
        mesh.append(part);
    }
    mesh
}
