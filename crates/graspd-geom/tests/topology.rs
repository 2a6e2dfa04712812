//! Holes, orientation and components of meshes whose defects are known.

use graspd_geom::{TriangleMesh, box_mesh, sphere_mesh, topology};
use nalgebra::{Point3, Vector3};

fn unit_box() -> TriangleMesh {
    box_mesh(Vector3::new(1.0, 1.0, 1.0), 0.25)
}

/// A box without the faces whose centres satisfy a condition.
fn box_without(is_missing: impl Fn(Point3<f64>) -> bool) -> TriangleMesh {
    let mut mesh = unit_box();
    let whole = mesh.clone();
    mesh.faces = (0..whole.faces.len())
        .filter(|&face| {
            let [a, b, c] = whole.corners(face);
            !is_missing(Point3::from((a.coords + b.coords + c.coords) / 3.0))
        })
        .map(|face| whole.faces[face])
        .collect();
    mesh
}

#[test]
fn closed_surfaces() {
    let mut two = unit_box();
    two.append(&sphere_mesh(0.1, 0.05));
    two.vertices.push(Point3::origin()); // belongs to no face
    let found = topology(&two);
    assert!(found.is_closed());
    assert_eq!((found.components, found.euler_number), (2, 4));
    assert_eq!((found.boundary_edges, found.non_manifold_edges), (0, 0));
    assert_eq!(topology(&TriangleMesh::default()).euler_number, 0);
}

#[test]
fn holes_are_measured() {
    // The top is missing (a square of side 1), and the middle of the bottom (of side 1/2).
    let open = box_without(|p| p.z > 0.49 || (p.z < -0.49 && p.x.abs() < 0.25 && p.y.abs() < 0.25));
    let found = topology(&open);
    assert!(!found.is_closed());
    assert_eq!(found.boundary_edges, 16 + 8);
    let mut loops = found.boundary_loops;
    loops.sort_by(|a, b| a.length.total_cmp(&b.length));
    assert_eq!(loops.len(), 2);
    for (one, side) in loops.iter().zip([0.5, 1.0]) {
        assert!((one.length - 4.0 * side).abs() < 1e-12, "{one:?}");
        assert!(
            (one.diameter - 2.0_f64.sqrt() * side).abs() < 1e-12,
            "{one:?}"
        );
        for (k, &vertex) in one.vertices.iter().enumerate() {
            let next = one.vertices[(k + 1) % one.vertices.len()];
            let step = open.vertices[next as usize] - open.vertices[vertex as usize];
            assert!((step.norm() - 0.25).abs() < 1e-12);
        }
    }
}

#[test]
fn holes_that_touch_at_a_vertex_are_told_apart() {
    let open = box_without(|p| p.z > 0.49 && p.x * p.y > 0.0 && p.x.abs().max(p.y.abs()) < 0.25);
    let loops = topology(&open).boundary_loops;
    assert_eq!(loops.len(), 2);
    assert!(loops.iter().all(|one| (one.length - 1.0).abs() < 1e-12));
}

#[test]
fn reversed_and_repeated_faces_are_counted() {
    let mut mesh = unit_box();
    mesh.faces[0].swap(0, 1);
    let found = topology(&mesh);
    assert_eq!(
        (found.misoriented_edges, found.boundary_loops.len()),
        (3, 0)
    );
    assert!(!found.is_closed());

    let mut mesh = unit_box();
    let [a, b, c] = mesh.faces[5];
    mesh.faces.push([b, c, a]);
    let found = topology(&mesh);
    assert_eq!((found.duplicate_faces, found.non_manifold_edges), (1, 3));
    assert!(!found.is_closed());
}

#[test]
fn a_flap_is_open_and_not_manifold() {
    let mut mesh = unit_box();
    let [a, b, _] = mesh.faces[0];
    mesh.vertices.push(Point3::new(2.0, 2.0, 2.0));
    mesh.faces.push([a, b, mesh.vertices.len() as u32 - 1]);
    let found = topology(&mesh);
    assert_eq!((found.boundary_edges, found.non_manifold_edges), (2, 1));
    assert_eq!(found.boundary_loops.len(), 1);
    assert_eq!(found.boundary_loops[0].vertices.len(), 3);
}
