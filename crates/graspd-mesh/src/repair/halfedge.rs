//! Sides of faces: three to a face, number 3 f + e running from its corner e to the next.

use graspd_geom::TriangleMesh;

/// No other side.
pub(super) const NONE: u32 = u32::MAX;

/// The next side of the same face.
pub(super) fn next(side: u32) -> u32 {
    if side % 3 == 2 { side - 2 } else { side + 1 }
}

/// The vertices that a side runs from and to.
pub(super) fn ends(faces: &[[u32; 3]], side: u32) -> [u32; 2] {
    let face = faces[side as usize / 3];
    let corner = side as usize % 3;
    [face[corner], face[(corner + 1) % 3]]
}

/// The sides of all faces as (lower vertex, higher vertex, side), sorted.
pub(super) fn sorted_sides(faces: &[[u32; 3]]) -> Vec<(u32, u32, u32)> {
    let mut sides: Vec<_> = (0..3 * faces.len() as u32)
        .map(|side| {
            let [from, to] = ends(faces, side);
            (from.min(to), from.max(to), side)
        })
        .collect();
    sides.sort_unstable();
    sides
}

/// Whether every edge has exactly two faces, which run along it in opposite directions, and every face three
/// different vertices.
pub(super) fn is_edge_manifold(mesh: &TriangleMesh) -> bool {
    let is_face = |&[a, b, c]: &[u32; 3]| a != b && b != c && c != a;
    mesh.faces.iter().all(is_face)
        && sorted_sides(&mesh.faces)
            .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
            .all(|uses| {
                uses.len() == 2
                    && ends(&mesh.faces, uses[0].2)[0] != ends(&mesh.faces, uses[1].2)[0]
            })
}

/// The mesh without vertices that no face uses.
pub(super) fn compacted(mut mesh: TriangleMesh) -> TriangleMesh {
    let mut number = vec![NONE; mesh.vertices.len()];
    for &vertex in mesh.faces.iter().flatten() {
        number[vertex as usize] = 0;
    }
    let mut kept = 0;
    for (vertex, new) in number.iter_mut().enumerate() {
        if *new != NONE {
            *new = kept;
            mesh.vertices[kept as usize] = mesh.vertices[vertex];
            kept += 1;
        }
    }
    mesh.vertices.truncate(kept as usize);
    for vertex in mesh.faces.iter_mut().flatten() {
        *vertex = number[*vertex as usize];
    }
    mesh
}
