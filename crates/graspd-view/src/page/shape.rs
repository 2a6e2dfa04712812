//! Meshes in a page: coordinates of 16 bits, and no more faces than a page needs.

use std::collections::{HashMap, HashSet};

use graspd_geom::{TriangleMesh, weld_exact};
use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::block::{Block, Section};

/// Vertex i is `origin` + `step` (x, y, z), of unsigned integers below 65536.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct MeshDescription {
    vertices: Section,
    faces: Section,
    origin: [f64; 3],
    step: f64,
}

impl MeshDescription {
    /// Stores a mesh, thinned out where it has more than `max_faces`. Faces with a missing or non-finite corner are
    /// left out.
    pub(super) fn store(mesh: &TriangleMesh, max_faces: usize, block: &mut Block) -> Self {
        let drawable = TriangleMesh {
            vertices: mesh.vertices.clone(),
            faces: (mesh.faces.iter().copied())
                .filter(|face| face.iter().all(|corner| is_finite(mesh, *corner)))
                .collect(),
        };
        // Vertices that a file repeats would be creases.
        let mesh = thinned(&without_loose_vertices(&weld_exact(&drawable)), max_faces);
        let (low, high) = mesh
            .bounds()
            .unwrap_or((Point3::origin(), Point3::origin()));
        let step = ((high - low).max() / 65535.0).max(f64::MIN_POSITIVE);
        let vertices: Vec<u32> = (mesh.vertices.iter())
            .flat_map(|vertex| {
                let offset = (vertex - low) / step;
                [offset.x, offset.y, offset.z].map(|c| c.round() as u32)
            })
            .collect();
        let faces: Vec<u32> = mesh.faces.iter().flatten().copied().collect();
        Self {
            vertices: block.push(&vertices, 2, 3),
            faces: block.push(&faces, 4, 1),
            origin: low.coords.into(),
            step,
        }
    }
}

#[cfg(test)]
impl MeshDescription {
    /// Returns the vertices as the page reads them.
    pub(super) fn read(&self, block: &Block) -> Vec<Point3<f64>> {
        let integers = block.read(self.vertices);
        let corner = |v: &[u32]| [0, 1, 2].map(|c| self.origin[c] + self.step * f64::from(v[c]));
        integers.chunks_exact(3).map(|v| corner(v).into()).collect()
    }
}

fn is_finite(mesh: &TriangleMesh, vertex: u32) -> bool {
    (mesh.vertices.get(vertex as usize))
        .is_some_and(|vertex| vertex.coords.iter().all(|c| c.is_finite()))
}

fn without_loose_vertices(mesh: &TriangleMesh) -> TriangleMesh {
    let mut place_of = vec![u32::MAX; mesh.vertices.len()];
    let mut used = TriangleMesh::default();
    for face in &mesh.faces {
        used.faces.push(face.map(|corner| {
            let place = &mut place_of[corner as usize];
            if *place == u32::MAX {
                *place = used.vertices.len() as u32;
                used.vertices.push(mesh.vertices[corner as usize]);
            }
            *place
        }));
    }
    used
}

/// Thins out a mesh to at most `max_faces` faces: all vertices of a cell of a cubic grid become their mean.
///
/// Meant for the eye: the result need not be closed.
fn thinned(mesh: &TriangleMesh, max_faces: usize) -> TriangleMesh {
    let Some((low, high)) = mesh
        .bounds()
        .filter(|_| mesh.faces.len() > max_faces.max(1))
    else {
        return mesh.clone();
    };
    let mut cells = 512.0;
    loop {
        let coarse = clustered(mesh, low, (high - low).max() / cells);
        if coarse.faces.len() <= max_faces.max(1) || cells <= 2.0 {
            return coarse;
        }
        // The number of faces goes with the square of the number of cells.
        let wanted = (max_faces as f64 / coarse.faces.len() as f64).sqrt();
        cells *= wanted.clamp(0.3, 0.95);
    }
}

fn clustered(mesh: &TriangleMesh, low: Point3<f64>, cell: f64) -> TriangleMesh {
    let mut place_of: HashMap<[i64; 3], u32> = HashMap::new();
    let mut sums: Vec<(Vector3<f64>, f64)> = Vec::new();
    let places: Vec<u32> = (mesh.vertices.iter())
        .map(|vertex| {
            let offset = (vertex - low) / cell;
            let key = [offset.x, offset.y, offset.z].map(|c| c.floor() as i64);
            let place = *place_of.entry(key).or_insert_with(|| {
                sums.push((Vector3::zeros(), 0.0));
                (sums.len() - 1) as u32
            });
            let (sum, count) = &mut sums[place as usize];
            *sum += vertex.coords;
            *count += 1.0;
            place
        })
        .collect();
    let mut seen = HashSet::new();
    let faces = (mesh.faces.iter())
        .map(|face| face.map(|corner| places[corner as usize]))
        .filter(|&[a, b, c]| a != b && b != c && c != a)
        .filter(|face| {
            let mut corners = *face;
            corners.sort_unstable();
            seen.insert(corners)
        });
    TriangleMesh {
        faces: faces.collect(),
        vertices: (sums.iter())
            .map(|(sum, count)| Point3::from(sum / *count))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use graspd_geom::sphere_mesh;

    use super::*;

    #[test]
    fn large_meshes_are_thinned_and_keep_their_shape() {
        let sphere = sphere_mesh(0.05, 0.002);
        assert!(sphere.faces.len() > 5000);
        let coarse = thinned(&sphere, 1000);
        assert!((200..=1000).contains(&coarse.faces.len()));
        for vertex in &coarse.vertices {
            assert!((vertex.coords.norm() - 0.05).abs() < 0.003);
        }
        assert_eq!(thinned(&sphere, 100_000).faces.len(), sphere.faces.len());
    }

    #[test]
    fn what_cannot_be_drawn_is_left_out() {
        let mut mesh = sphere_mesh(0.05, 0.03);
        let whole = mesh.faces.len();
        mesh.vertices.push(Point3::new(f64::NAN, 0.0, 0.0));
        let last = mesh.vertices.len() as u32 - 1;
        mesh.faces.extend([[0, 1, last], [0, 1, last + 7]]);
        let mut block = Block::default();
        let stored = MeshDescription::store(&mesh, 10_000, &mut block);
        let text = serde_json::to_value(&stored).unwrap();
        assert_eq!(text["faces"]["count"], 3 * whole);
        assert!(text["origin"][0].as_f64().unwrap() < -0.04);
        // Nothing at all is a mesh, too.
        MeshDescription::store(&TriangleMesh::default(), 10, &mut block);
    }
}
