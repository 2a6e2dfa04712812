//! Meshes damaged at random, in ways that files are.

use graspd_geom::TriangleMesh;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The mesh with parts of its faces removed, turned over, doubled, or given vertices of their own.
pub(crate) fn damaged(mesh: &TriangleMesh, seed: u64, parts: [f64; 4]) -> TriangleMesh {
    let [removed, turned, doubled, split] = parts;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut result = TriangleMesh {
        vertices: mesh.vertices.clone(),
        faces: Vec::new(),
    };
    for &face in &mesh.faces {
        let mut face = face;
        if rng.random_bool(removed) {
            continue;
        }
        if rng.random_bool(turned) {
            face.swap(1, 2);
        }
        if rng.random_bool(split) {
            let corner = rng.random_range(0..3);
            result.vertices.push(mesh.vertices[face[corner] as usize]);
            face[corner] = result.vertices.len() as u32 - 1;
        }
        result.faces.push(face);
        if rng.random_bool(doubled) {
            if rng.random_bool(0.5) {
                face.swap(0, 1);
            }
            result.faces.push(face);
        }
    }
    result
}
