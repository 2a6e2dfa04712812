//! Closed meshes of simple solids, centred on the origin and outward oriented.

use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;

use nalgebra::{Point3, Vector3};

use crate::TriangleMesh;
use crate::lofting::{arc, pieces, revolved};

/// A box with the given side lengths \[m\], gridded with lines at most `edge` \[m\] apart (diagonals are longer).
///
/// With `edge` as long as the longest side, the mesh has 8 vertices and 12 faces.
pub fn box_mesh(sides: Vector3<f64>, edge: f64) -> TriangleMesh {
    let counts = [0, 1, 2].map(|axis| pieces(sides[axis], edge));
    let mut mesh = TriangleMesh::default();
    let mut index_of = HashMap::new();
    let mut vertex = |mesh: &mut TriangleMesh, lattice: [usize; 3]| {
        *index_of.entry(lattice).or_insert_with(|| {
            let along =
                |axis: usize| sides[axis] * (lattice[axis] as f64 / counts[axis] as f64 - 0.5);
            mesh.vertices
                .push(Point3::new(along(0), along(1), along(2)));
            mesh.vertices.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for is_high in [false, true] {
            for (i, j) in (0..counts[u]).flat_map(|i| (0..counts[v]).map(move |j| (i, j))) {
                let mut corner = |di: usize, dj: usize| {
                    let mut lattice = [0; 3];
                    lattice[axis] = if is_high { counts[axis] } else { 0 };
                    lattice[u] = i + di;
                    lattice[v] = j + dj;
                    vertex(&mut mesh, lattice)
                };
                let quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                // u x v points along the axis: outward on the high side only.
                let [a, b, c, d] = if is_high {
                    quad
                } else {
                    [quad[0], quad[3], quad[2], quad[1]]
                };
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    mesh
}

/// A cylinder about the z axis, with edges of at most about `edge` \[m\] (diagonals are longer).
pub fn cylinder_mesh(radius: f64, height: f64, edge: f64) -> TriangleMesh {
    let z = 0.5 * height;
    revolved(&[[0.0, -z], [radius, -z], [radius, z], [0.0, z]], edge)
}

/// A cylinder of the given `length` \[m\] about the z axis between two half spheres, with edges of at most about
/// `edge` \[m\]; its whole length is `length` + 2 `radius`.
pub fn capsule_mesh(radius: f64, length: f64, edge: f64) -> TriangleMesh {
    let z = 0.5 * length;
    let mut profile = arc([0.0, -z], radius, [-FRAC_PI_2, 0.0], edge);
    profile.extend(arc([0.0, z], radius, [0.0, FRAC_PI_2], edge));
    // Exactly on the axis, where cosines only come near.
    profile[0][0] = 0.0;
    if let Some(last) = profile.last_mut() {
        last[0] = 0.0;
    }
    revolved(&profile, edge)
}

/// A sphere: an icosahedron with each face cut into n^2 triangles, its vertices on the sphere; edges at most `edge`
/// \[m\].
pub fn sphere_mesh(radius: f64, edge: f64) -> TriangleMesh {
    let corners = icosahedron_corners();
    // Central projection stretches the edges in the middle of a face by up to 1.26.
    let icosahedron_edge = (corners[0] - corners[1]).norm() * radius;
    let n = pieces(1.26 * icosahedron_edge, edge) as u32;
    let mut mesh = TriangleMesh::default();
    let mut index_of = HashMap::new();
    for face in icosahedron_faces(&corners) {
        // The vertex with weights (n - i - j, i, j) over n; shared between faces where a weight is 0.
        let mut vertex = |i: u32, j: u32| {
            let mut key =
                [(face[0], n - i - j), (face[1], i), (face[2], j)].map(|(corner, weight)| {
                    if weight == 0 {
                        (0, 0)
                    } else {
                        (corner, weight)
                    }
                });
            key.sort_unstable();
            *index_of.entry(key).or_insert_with(|| {
                let sum: Vector3<f64> = (key.iter())
                    .map(|&(corner, weight)| corners[corner] * f64::from(weight))
                    .sum();
                mesh.vertices.push(Point3::from(sum.normalize() * radius));
                mesh.vertices.len() as u32 - 1
            })
        };
        for i in 0..n {
            for j in 0..n - i {
                let [a, b, c] = [vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)];
                mesh.faces.push([a, b, c]);
                if i + j + 1 < n {
                    mesh.faces.push([b, vertex(i + 1, j + 1), c]);
                }
            }
        }
    }
    mesh
}

/// The cyclic permutations of (0, +-1, +-golden ratio), as unit vectors.
fn icosahedron_corners() -> Vec<Vector3<f64>> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    (0..3)
        .flat_map(|axis| {
            [
                (1.0, golden),
                (-1.0, golden),
                (1.0, -golden),
                (-1.0, -golden),
            ]
            .map(|(short, long)| {
                let mut corner = Vector3::zeros();
                corner[(axis + 1) % 3] = short;
                corner[(axis + 2) % 3] = long;
                corner.normalize()
            })
        })
        .collect()
}

/// The triples of corners that are all neighbours, outward oriented.
fn icosahedron_faces(corners: &[Vector3<f64>]) -> Vec<[usize; 3]> {
    // Neighbours have a dot product of 1/sqrt(5), others -1/sqrt(5) or -1.
    let are_neighbours = |a: usize, b: usize| corners[a].dot(&corners[b]) > 0.0;
    let mut faces = Vec::new();
    for a in 0..corners.len() {
        for b in (a + 1..corners.len()).filter(|&b| are_neighbours(a, b)) {
            for c in
                (b + 1..corners.len()).filter(|&c| are_neighbours(a, c) && are_neighbours(b, c))
            {
                let is_outward = corners[a].dot(&corners[b].cross(&corners[c])) > 0.0;
                faces.push(if is_outward { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{require_closed, signed_volume, topology};

    fn longest_edge(mesh: &TriangleMesh) -> f64 {
        (0..mesh.faces.len())
            .flat_map(|face| {
                let [a, b, c] = mesh.corners(face);
                [(b - a).norm(), (c - b).norm(), (a - c).norm()]
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn solids_are_closed_spheres_with_the_right_volume_and_edges() {
        let edge = 0.004;
        for (name, mesh, volume, tolerance) in [
            (
                "box",
                box_mesh(Vector3::new(0.03, 0.05, 0.02), edge),
                3e-5,
                1e-12,
            ),
            (
                "cylinder",
                cylinder_mesh(0.03, 0.1, edge),
                PI * 0.03_f64.powi(2) * 0.1,
                0.004,
            ),
            (
                "sphere",
                sphere_mesh(0.03, edge),
                4.0 / 3.0 * PI * 0.03_f64.powi(3),
                0.008,
            ),
            (
                "capsule",
                capsule_mesh(0.02, 0.05, edge),
                PI * 0.02_f64.powi(2) * (0.05 + 4.0 / 3.0 * 0.02),
                0.012,
            ),
        ] {
            require_closed(&mesh, name).unwrap();
            let topology = topology(&mesh);
            assert_eq!(
                (
                    topology.euler_number,
                    topology.components,
                    topology.non_manifold_edges
                ),
                (2, 1, 0),
                "{name}"
            );
            let ratio = signed_volume(&mesh) / volume;
            assert!(
                ratio <= 1.0 + 1e-12 && ratio > 1.0 - tolerance,
                "{name} {ratio}"
            );
            assert!(
                longest_edge(&mesh) < 1.7 * edge,
                "{name} {}",
                longest_edge(&mesh) / edge
            );
            let (low, high) = mesh.bounds().unwrap();
            assert!((low.coords + high.coords).norm() < 1e-3, "{name}");
        }
        assert!(longest_edge(&sphere_mesh(0.03, edge)) <= edge);
    }

    #[test]
    fn coarse_shapes_are_the_simplest_ones() {
        let cube = box_mesh(Vector3::repeat(1.0), 2.0);
        assert_eq!((cube.vertices.len(), cube.faces.len()), (8, 12));
        let icosahedron = sphere_mesh(1.0, 2.0);
        assert_eq!(
            (icosahedron.vertices.len(), icosahedron.faces.len()),
            (12, 20)
        );
        for mesh in [
            cylinder_mesh(1.0, 1.0, 100.0),
            capsule_mesh(1.0, 1.0, 100.0),
        ] {
            require_closed(&mesh, "coarse").unwrap();
            assert!(signed_volume(&mesh) > 1.0);
        }
    }

    #[test]
    fn absurd_edge_lengths_cost_bounded_memory() {
        for edge in [f64::MAX, f64::INFINITY] {
            require_closed(&cylinder_mesh(0.03, 0.1, edge), "coarse").unwrap();
        }
        assert_eq!(pieces(1.0, 0.0), 2048);
        assert_eq!(pieces(1.0, f64::NAN), 1);
        assert_eq!(pieces(1.0, -1.0), 1);
    }
}
