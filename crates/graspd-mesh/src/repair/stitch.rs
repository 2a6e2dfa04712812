//! Welding along open edges, and dropping faces that are degenerate or there twice.

use std::collections::HashMap;

use nalgebra::Point3;

use super::halfedge::{ends, sorted_sides};
use graspd_geom::Groups;
use graspd_geom::TriangleMesh;

/// Drops faces that name a vertex twice, and all but the first of those with the same three vertices, whichever way
/// they face. Gives how many of either kind.
pub(super) fn drop_useless_faces(mesh: &mut TriangleMesh) -> [usize; 2] {
    let before = mesh.faces.len();
    mesh.faces.retain(|&[a, b, c]| a != b && b != c && c != a);
    let distinct = mesh.faces.len();
    let mut sorted: Vec<([u32; 3], u32)> = (0u32..)
        .zip(&mesh.faces)
        .map(|(face, corners)| {
            let mut corners = *corners;
            corners.sort_unstable();
            (corners, face)
        })
        .collect();
    sorted.sort_unstable();
    let mut is_copy = vec![false; distinct];
    for pair in sorted.windows(2) {
        is_copy[pair[1].1 as usize] = pair[0].0 == pair[1].0;
    }
    let mut index = 0;
    mesh.faces.retain(|_| {
        index += 1;
        !is_copy[index - 1]
    });
    [before - distinct, distinct - mesh.faces.len()]
}

/// Unites the ends of open edges that lie within `tolerance` \[m\] of each other end for end, so that vertices are
/// only welded where that closes an edge. Gives how many vertices went.
///
/// Vertices inside a closed stretch of surface are never touched, wherever they lie.
pub(super) fn stitch(mesh: &mut TriangleMesh, tolerance: f64) -> usize {
    let sides = sorted_sides(&mesh.faces);
    let open: Vec<[u32; 2]> = sides
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .filter(|uses| uses.len() == 1)
        .map(|uses| ends(&mesh.faces, uses[0].2))
        .collect();
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let key = |edge: &[u32; 2]| cell(&nalgebra::center(&at(edge[0]), &at(edge[1])), tolerance);
    let mut in_cell: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(open.len());
    let mut groups = Groups::new(mesh.vertices.len());
    let reach = i64::from(tolerance > 0.0);
    for (number, edge) in (0u32..).zip(&open) {
        let [x, y, z] = key(edge);
        for dx in -reach..=reach {
            for dy in -reach..=reach {
                for dz in -reach..=reach {
                    let near = [x.wrapping_add(dx), y.wrapping_add(dy), z.wrapping_add(dz)];
                    for &other in in_cell.get(&near).into_iter().flatten() {
                        let other = open[other as usize];
                        for [a, b] in [[0, 1], [1, 0]] {
                            let gaps = [(edge[0], other[a]), (edge[1], other[b])]
                                .map(|(p, q)| (at(p) - at(q)).norm());
                            if gaps.iter().all(|&gap| gap <= tolerance) {
                                groups.join(edge[0], other[a]);
                                groups.join(edge[1], other[b]);
                            }
                        }
                    }
                }
            }
        }
        in_cell.entry([x, y, z]).or_default().push(number);
    }
    let mut welded = 0;
    let root: Vec<u32> = (0..mesh.vertices.len() as u32)
        .map(|vertex| {
            let root = groups.root(vertex);
            welded += usize::from(root != vertex);
            root
        })
        .collect();
    for vertex in mesh.faces.iter_mut().flatten() {
        *vertex = root[*vertex as usize];
    }
    welded
}

/// The cell of a grid with the given spacing; without one, the position itself.
fn cell(p: &Point3<f64>, spacing: f64) -> [i64; 3] {
    [p.x, p.y, p.z].map(|x| {
        if spacing > 0.0 {
            // Saturates; neighbours are compared by distance anyway.
            (x / spacing).floor() as i64
        } else {
            (x + 0.0).to_bits() as i64
        }
    })
}
