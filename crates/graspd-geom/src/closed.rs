//! Closed surfaces: the check that everything physical needs, and the harmless ways to pass it.

use std::collections::HashMap;

use crate::mass::encloses_volume;
use crate::topology::duplicates;
use crate::{GeometryError, Topology, TriangleMesh, signed_volume, topology};

/// A closed, outward oriented surface, and what was done to get it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedSurface {
    /// Every directed edge has as many opposite ones, no face is there twice, and the volume is positive.
    pub mesh: TriangleMesh,
    /// Whether vertices at exactly the same position had to be merged.
    pub was_welded: bool,
    /// How many copies of faces were left out.
    pub duplicates_dropped: usize,
    /// Whether the mesh was inside-out and all faces were reversed.
    pub was_flipped: bool,
}

impl ClosedSurface {
    /// Takes the mesh as indexed if it is closed, else with [`weld_exact`]; leaves out copies of faces; reverses the
    /// mesh if it is inside-out.
    ///
    /// `name`: the mesh's file or name, for errors.
    ///
    /// # Errors
    /// As [`require_closed`]; [`GeometryError::NoVolume`] if it is closed but encloses nothing.
    pub fn new(mesh: &TriangleMesh, name: &str) -> Result<Self, GeometryError> {
        let mut surface = Self {
            mesh: mesh.clone(),
            was_welded: false,
            duplicates_dropped: 0,
            was_flipped: false,
        };
        surface.duplicates_dropped = drop_duplicates(&mut surface.mesh);
        if require_closed(&surface.mesh, name).is_err() {
            surface.was_welded = true;
            surface.mesh = weld_exact(mesh);
            surface.duplicates_dropped = drop_duplicates(&mut surface.mesh);
            // The holes left after welding are the real ones; before, every seam counts as one.
            require_closed(&surface.mesh, name)?;
        }
        let volume = signed_volume(&surface.mesh);
        if !encloses_volume(volume.abs(), &surface.mesh) {
            return Err(GeometryError::NoVolume { name: name.into() });
        }
        if volume < 0.0 {
            surface.was_flipped = true;
            surface.mesh = flipped(&surface.mesh);
        }
        Ok(surface)
    }
}

/// Leaves out faces that repeat an earlier one; gives how many.
fn drop_duplicates(mesh: &mut TriangleMesh) -> usize {
    let repeated = duplicates(mesh);
    let mut next = repeated.iter().peekable();
    let mut index = 0;
    mesh.faces.retain(|_| {
        let is_repeated = next.next_if_eq(&&index).is_some();
        index += 1;
        !is_repeated
    });
    repeated.len()
}

/// The mesh as a closed, outward oriented surface: [`ClosedSurface::new`] for callers who need no notes.
///
/// # Errors
/// As [`ClosedSurface::new`].
pub fn closed_surface(mesh: &TriangleMesh, name: &str) -> Result<TriangleMesh, GeometryError> {
    Ok(ClosedSurface::new(mesh, name)?.mesh)
}

/// Checks that every directed edge of the mesh, as indexed, has as many opposite ones.
///
/// Such a surface divides space into inside and outside, even where it touches or crosses itself, has several
/// components or faces without area. Whether it is inside-out is not looked at.
///
/// # Errors
/// [`GeometryError::DuplicateFaces`]; [`GeometryError::Open`] with the holes' sizes;
/// [`GeometryError::NotOriented`]; [`GeometryError::NoVolume`] for a mesh without faces.
pub fn require_closed(mesh: &TriangleMesh, name: &str) -> Result<(), GeometryError> {
    if mesh.faces.is_empty() {
        return Err(GeometryError::NoVolume { name: name.into() });
    }
    let topology = topology(mesh);
    if topology.duplicate_faces > 0 {
        return Err(GeometryError::DuplicateFaces {
            name: name.into(),
            faces: topology.duplicate_faces,
        });
    }
    if !topology.boundary_loops.is_empty() {
        return Err(open_error(&topology, name));
    }
    if topology.misoriented_edges > 0 {
        return Err(GeometryError::NotOriented {
            name: name.into(),
            edges: topology.misoriented_edges,
        });
    }
    Ok(())
}

fn open_error(topology: &Topology, name: &str) -> GeometryError {
    const MM_PER_M: f64 = 1000.0;
    let loops = &topology.boundary_loops;
    let largest = |values: &mut dyn Iterator<Item = f64>| MM_PER_M * values.fold(0.0, f64::max);
    GeometryError::Open {
        name: name.into(),
        boundary_edges: loops.iter().map(|one| one.vertices.len()).sum(),
        loops: loops.len(),
        total_mm: MM_PER_M * loops.iter().map(|one| one.length).sum::<f64>(),
        longest_mm: largest(&mut loops.iter().map(|one| one.length)),
        diameter_mm: largest(&mut loops.iter().map(|one| one.diameter)),
    }
}

/// The mesh with all faces reversed.
pub fn flipped(mesh: &TriangleMesh) -> TriangleMesh {
    TriangleMesh {
        vertices: mesh.vertices.clone(),
        faces: mesh.faces.iter().map(|&[a, b, c]| [a, c, b]).collect(),
    }
}

/// Merges vertices at exactly the same position (zero and minus zero are the same), drops faces that lose a corner
/// by it, and vertices without faces.
///
/// For files that store each face's or each patch's vertices apart. Not for closed scans: distinct vertices at the
/// same position are how a surface touches itself without becoming non-manifold.
pub fn weld_exact(mesh: &TriangleMesh) -> TriangleMesh {
    let mut index_of = HashMap::new();
    let mut welded = TriangleMesh::default();
    for &face in &mesh.faces {
        let face = face.map(|index| {
            let p = mesh.vertices[index as usize];
            *index_of
                .entry([p.x, p.y, p.z].map(|coordinate| (coordinate + 0.0).to_bits()))
                .or_insert_with(|| {
                    welded.vertices.push(p);
                    welded.vertices.len() as u32 - 1
                })
        });
        if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
            welded.faces.push(face);
        }
    }
    welded
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::box_mesh;

    fn unit_box() -> TriangleMesh {
        box_mesh(Vector3::new(1.0, 1.0, 1.0), 0.5)
    }

    /// The mesh with three vertices of its own for each face.
    fn unwelded(mesh: &TriangleMesh) -> TriangleMesh {
        let corners = (0..mesh.faces.len()).flat_map(|face| mesh.corners(face));
        TriangleMesh {
            vertices: corners.collect(),
            faces: (0..mesh.faces.len() as u32)
                .map(|face| [3 * face, 3 * face + 1, 3 * face + 2])
                .collect(),
        }
    }

    #[test]
    fn closed_meshes_are_left_alone() {
        let surface = ClosedSurface::new(&unit_box(), "box").unwrap();
        assert_eq!(surface.mesh, unit_box());
        assert!(!surface.was_welded && !surface.was_flipped);
        assert_eq!(surface.duplicates_dropped, 0);
    }

    #[test]
    fn seams_reversal_and_copies_are_mended() {
        let mut mesh = flipped(&unwelded(&unit_box()));
        mesh.vertices.iter_mut().for_each(|p| {
            // Seams across zero, once as 0 and once as -0.
            if p.x == 0.0 && p.z > 0.0 {
                p.x = -0.0;
            }
        });
        mesh.faces.push(mesh.faces[3]);
        assert!(require_closed(&mesh, "seams").is_err());
        let surface = ClosedSurface::new(&mesh, "seams").unwrap();
        assert!(surface.was_welded && surface.was_flipped);
        assert_eq!(surface.duplicates_dropped, 1);
        assert_eq!(surface.mesh.vertices.len(), unit_box().vertices.len());
        assert!((signed_volume(&surface.mesh) - 1.0).abs() < 1e-12);
        assert_eq!(closed_surface(&mesh, "seams").unwrap(), surface.mesh);
    }

    #[test]
    fn surfaces_that_touch_themselves_need_no_welding() {
        // Two boxes side by side, their faces in the common plane opposite and their vertices apart: welding would
        // make those faces cancel.
        let mut mesh = unit_box();
        let mut other = unit_box();
        other.vertices.iter_mut().for_each(|p| p.x += 1.0);
        mesh.append(&other);
        let surface = ClosedSurface::new(&mesh, "boxes").unwrap();
        assert!(!surface.was_welded);
        assert_eq!(surface.mesh, mesh);
    }

    #[test]
    fn open_flat_and_contradictory_meshes_are_refused() {
        let mut open = unwelded(&unit_box());
        open.faces.pop();
        let error = ClosedSurface::new(&open, "open").unwrap_err();
        // The one real hole, not the seams: a right triangle with legs of 500 mm.
        assert!(error.to_string().starts_with(
            "open: the surface is open: 3 boundary edges in 1 loop, 1707.1 mm of boundary in total, the longest \
             1707.1 mm, the largest 707.1 mm across;"
        ), "{error}");

        let mut contradictory = unit_box();
        contradictory.faces[0].swap(0, 1);
        let error = ClosedSurface::new(&contradictory, "x").unwrap_err();
        assert!(
            matches!(error, GeometryError::NotOriented { edges: 3, .. }),
            "{error}"
        );

        let mut copied = unit_box();
        copied.faces.extend(unit_box().faces);
        let error = require_closed(&copied, "x").unwrap_err();
        assert!(
            matches!(error, GeometryError::DuplicateFaces { faces: 48, .. }),
            "{error}"
        );
        assert_eq!(closed_surface(&copied, "x").unwrap(), unit_box());

        let sheet = TriangleMesh {
            vertices: vec![
                Point3::origin(),
                Point3::new(1.0, 0.0, 0.0),
                Point3::new(0.0, 1.0, 0.0),
            ],
            faces: vec![[0, 1, 2], [0, 2, 1]],
        };
        for mesh in [sheet, TriangleMesh::default()] {
            let error = ClosedSurface::new(&mesh, "x").unwrap_err();
            assert!(matches!(error, GeometryError::NoVolume { .. }), "{error}");
        }
    }
}
