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
/// [`GeometryError::DuplicateFaces`]; [`GeometryError::Open`] with the holes' sizes; [`GeometryError::NotOriented`]; [`GeometryError::NoVolume`] for a
/// mesh without faces.
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
