//! Whether a mesh is the boundary of a solid.

use std::collections::HashMap;

use crate::mass::encloses_volume;
use crate::{GeometryError, TriangleMesh, signed_volume};

/// Checks indices and coordinates.
pub fn check_finite(mesh: &TriangleMesh) -> Result<(), GeometryError> {
    if mesh.faces.is_empty() {
        return Err(GeometryError::EmptyMesh);
    }
    for (vertex, position) in mesh.vertices.iter().enumerate() {
        if !position.iter().all(|x| x.is_finite()) {
            return Err(GeometryError::NotFinite {
                vertex,
                position: position.coords.into(),
            });
        }
    }
    for (face, indices) in mesh.faces.iter().enumerate() {
        for &index in indices {
            if index as usize >= mesh.vertices.len() {
                return Err(GeometryError::FaceOutOfRange {
                    face,
                    index,
                    vertices: mesh.vertices.len(),
                });
            }
        }
    }
    Ok(())
}

/// Checks that every edge is walked as often one way as the other, so that a winding number is defined, and
/// that the faces look outward.
///
/// Edges are compared by the positions of their ends: a winding number does not depend on which of several
/// vertices at one place a face names.
pub(super) fn check_closed(mesh: &TriangleMesh) -> Result<(), GeometryError> {
    let mut first_at = HashMap::new();
    let place: Vec<u32> = mesh
        .vertices
        .iter()
        .enumerate()
        .map(|(index, p)| {
            // -0 and 0 are one place.
            let key = [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
            *first_at.entry(key).or_insert(index as u32)
        })
        .collect();
    let mut surplus: HashMap<(u32, u32), i32> = HashMap::new();
    for face in &mesh.faces {
        let corners = face.map(|index| place[index as usize]);
        for side in 0..3 {
            let (from, to) = (corners[side], corners[(side + 1) % 3]);
            if from < to {
                *surplus.entry((from, to)).or_default() += 1;
            } else if to < from {
                *surplus.entry((to, from)).or_default() -= 1;
            }
        }
    }
    let open = surplus.iter().filter(|(_, count)| **count != 0);
    if let Some(((from, to), _)) = open.clone().min_by_key(|(edge, _)| **edge) {
        return Err(GeometryError::NotClosed {
            edges: open.count(),
            from: mesh.vertices[*from as usize].coords.into(),
            to: mesh.vertices[*to as usize].coords.into(),
        });
    }
    let volume = signed_volume(mesh);
    if encloses_volume(volume, mesh) {
        Ok(())
    } else if encloses_volume(-volume, mesh) {
        Err(GeometryError::InsideOut { volume })
    } else {
        let name = "the mesh".into();
        Err(GeometryError::NoVolume { name })
    }
}
