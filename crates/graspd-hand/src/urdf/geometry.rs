//! The solids of a URDF's links.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use graspd_geom::{
    GeometryError, SignedDistance, TriangleMesh, box_mesh, capsule_mesh, closed_surface,
    cylinder_mesh, sphere_mesh,
};
use graspd_mesh::load_mesh;
use nalgebra::{Isometry3, Translation3, Vector3};
use urdf_rs::{Geometry, Link, Pose};

use super::mesh_files::MeshFinder;
use super::placement;
use crate::{HandError, LinkFrame, Part};

/// Edge length of round primitives as a share of their radius: about 21 edges around, at most 1.1 % of the radius
/// below the surface.
const EDGE_PER_RADIUS: f64 = 0.3;

/// Reads the geometry of one URDF's links.
pub(crate) struct GeometryReader {
    finder: MeshFinder,
    /// Meshes already read, by file and scale: closed, or why not.
    meshes: HashMap<(PathBuf, [u64; 3]), ReadMesh>,
    notes: Vec<String>,
}

#[derive(Clone)]
enum ReadMesh {
    Closed(TriangleMesh),
    /// As read, and what keeps it from being closed.
    Open(TriangleMesh, String),
}

impl GeometryReader {
    pub(crate) fn new(urdf: &Path, search_paths: &[PathBuf]) -> Self {
        Self {
            finder: MeshFinder::new(urdf, search_paths),
            meshes: HashMap::new(),
            notes: Vec::new(),
        }
    }

    /// Returns what had to be mended, one sentence each.
    pub(crate) fn into_notes(self) -> Vec<String> {
        self.notes
    }

    /// Returns the closed solids of a link, in the frame of its body: its collision geometry, or its visual geometry
    /// where there is no collision geometry or only that is closed, or bounding boxes where nothing is.
    pub(crate) fn parts(&mut self, link: &Link, frame: &LinkFrame) -> Result<Vec<Part>, HandError> {
        let collision: Vec<_> = (link.collision.iter().map(|c| (&c.origin, &c.geometry))).collect();
        let visual: Vec<_> = (link.visual.iter().map(|v| (&v.origin, &v.geometry))).collect();
        let (first, second) = if collision.is_empty() {
            (visual, Vec::new())
        } else {
            (collision, visual)
        };
        let read = self.read_all(&first, link)?;
        let is_closed = |meshes: &[(Isometry3<f64>, ReadMesh)]| {
            meshes
                .iter()
                .all(|(_, mesh)| matches!(mesh, ReadMesh::Closed(_)))
        };
        let mut chosen = read;
        if !is_closed(&chosen) && !second.is_empty() {
            // A visual mesh that cannot be read does not matter while the collision mesh has a stand-in.
            let visual = self.read_all(&second, link).ok().filter(|v| is_closed(v));
            if let Some(visual) = visual {
                self.notes.push(format!(
                    "link `{}`: the collision mesh is not closed, the visual geometry is taken",
                    link.name
                ));
                chosen = visual;
            }
        }
        let body_from_link = Isometry3::from(frame.placement);
        let mut parts = Vec::new();
        for (link_from_mesh, mesh) in chosen {
            let mesh = match mesh {
                ReadMesh::Closed(mesh) => mesh,
                ReadMesh::Open(mesh, fault) => {
                    let Some(stand_in) = bounding_box(&mesh) else {
                        self.notes.push(format!(
                            "link `{}`: a flat mesh is left out ({fault})",
                            link.name
                        ));
                        continue;
                    };
                    self.notes.push(format!(
                        "link `{}`: a mesh is replaced by its bounding box ({fault})",
                        link.name
                    ));
                    stand_in
                }
            };
            parts.push(Part {
                body: frame.body,
                mesh: mesh.transformed(&(body_from_link * link_from_mesh)),
            });
        }
        Ok(parts)
    }

    fn read_all(
        &mut self,
        geometries: &[(&Pose, &Geometry)],
        link: &Link,
    ) -> Result<Vec<(Isometry3<f64>, ReadMesh)>, HandError> {
        let mut meshes = Vec::new();
        for (pose, geometry) in geometries {
            if !pose
                .xyz
                .iter()
                .chain(pose.rpy.iter())
                .all(|v| v.is_finite())
            {
                return Err(HandError::NotFinite {
                    what: format!("the origin of a geometry of link `{}`", link.name),
                });
            }
            let mesh = self.read(geometry, &link.name)?;
            meshes.push((Isometry3::from(placement(pose)), mesh));
        }
        Ok(meshes)
    }

    fn read(&mut self, geometry: &Geometry, link: &str) -> Result<ReadMesh, HandError> {
        let check = |shape: &'static str, sizes: &[f64]| {
            if sizes.iter().all(|size| size.is_finite() && *size > 0.0) {
                return Ok(());
            }
            Err(HandError::BadSize {
                link: link.into(),
                shape,
                size: format!("{sizes:?}"),
            })
        };
        let closed = |mesh| Ok(ReadMesh::Closed(mesh));
        // Thin rods would otherwise be cut into very many pieces.
        let edge = |radius: f64, length: f64| (EDGE_PER_RADIUS * radius).max(length / 64.0);
        match geometry {
            Geometry::Box { size } => {
                check("box", &size.0)?;
                let sides = Vector3::from(size.0);
                closed(box_mesh(sides, sides.max()))
            }
            Geometry::Cylinder { radius, length } => {
                check("cylinder", &[*radius, *length])?;
                closed(cylinder_mesh(*radius, *length, edge(*radius, *length)))
            }
            Geometry::Capsule { radius, length } => {
                check("capsule", &[*radius, *length])?;
                closed(capsule_mesh(*radius, *length, edge(*radius, *length)))
            }
            Geometry::Sphere { radius } => {
                check("sphere", &[*radius])?;
                closed(sphere_mesh(*radius, edge(*radius, 0.0)))
            }
            Geometry::Mesh { filename, scale } => {
                let scale = scale.map_or([1.0; 3], |scale| scale.0);
                if !scale.iter().all(|s| s.is_finite() && *s != 0.0) {
                    return Err(HandError::BadSize {
                        link: link.into(),
                        shape: "mesh",
                        size: format!("scale {scale:?}"),
                    });
                }
                self.read_mesh(filename, scale, link)
            }
        }
    }

    fn read_mesh(
        &mut self,
        name: &str,
        scale: [f64; 3],
        link: &str,
    ) -> Result<ReadMesh, HandError> {
        let file = self.finder.find(name, link)?;
        let key = (file.clone(), scale.map(f64::to_bits));
        if let Some(mesh) = self.meshes.get(&key) {
            return Ok(mesh.clone());
        }
        let bad = |error: GeometryError| HandError::BadMesh {
            link: link.into(),
            error,
        };
        let mut mesh = load_mesh(&file).map_err(bad)?;
        for vertex in &mut mesh.vertices {
            vertex.coords.component_mul_assign(&Vector3::from(scale));
        }
        let closed = closed_surface(&mesh, &file.display().to_string());
        // What distances cannot be measured to is of no more use than an open mesh.
        let usable = closed.and_then(|closed| SignedDistance::new(&closed).map(|_| closed));
        let read = match usable {
            Ok(closed) => ReadMesh::Closed(closed),
            Err(error) => ReadMesh::Open(mesh, error.to_string()),
        };
        self.meshes.insert(key, read.clone());
        Ok(read)
    }
}

/// Returns the axis-aligned box around a mesh; `None` if it has no volume.
fn bounding_box(mesh: &TriangleMesh) -> Option<TriangleMesh> {
    let (low, high) = mesh.bounds()?;
    let sides = high - low;
    if !(sides.min() > 0.0 && sides.max().is_finite()) {
        return None;
    }
    let center = Translation3::from(nalgebra::center(&low, &high).coords);
    Some(box_mesh(sides, sides.max()).transformed(&center.into()))
}
