//! Signed distances of analytic shapes, and of meshes that are odd or have none.

use graspd_geom::{SdfGrid, SignedDistance, TriangleMesh, TriangleTree};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

/// Rounding in the distance of points some metres apart.
const ROUNDING: f64 = 1e-12;

fn mesh(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> TriangleMesh {
    TriangleMesh {
        vertices: vertices.iter().map(|&v| Point3::from(v)).collect(),
        faces: faces.to_vec(),
    }
}

/// The box [-1, 1]^3 scaled, with outward faces.
fn cuboid(half: [f64; 3]) -> TriangleMesh {
    let vertices: Vec<[f64; 3]> = (0..8)
        .map(|i| {
            [0, 1, 2].map(|axis| {
                if i >> axis & 1 == 0 {
                    -half[axis]
                } else {
                    half[axis]
                }
            })
        })
        .collect();
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces: Vec<_> = sides
        .iter()
        .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
        .collect();
    mesh(&vertices, &faces)
}

fn reversed(mut mesh: TriangleMesh) -> TriangleMesh {
    for face in &mut mesh.faces {
        face.swap(1, 2);
    }
    mesh
}

/// An octahedron whose faces are split in four, `times` over, and moved onto the unit sphere.
fn sphere(times: usize) -> TriangleMesh {
    let mut ball = mesh(
        &[
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ],
        &[
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ],
    );
    for _ in 0..times {
        let mut finer = TriangleMesh::default();
        for face in 0..ball.faces.len() {
            let [a, b, c] = ball.corners(face);
            let middle =
                |p: Point3<f64>, q: Point3<f64>| Point3::from((p.coords + q.coords).normalize());
            let first = finer.vertices.len() as u32;
            finer
                .vertices
                .extend([a, b, c, middle(a, b), middle(b, c), middle(c, a)]);
            for corners in [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]] {
                finer.faces.push(corners.map(|corner| first + corner));
            }
        }
        ball = finer;
    }
    ball
}

fn box_distance(p: &Point3<f64>, half: [f64; 3]) -> f64 {
    let beyond = Vector3::from(half).zip_map(&p.coords, |half, x| x.abs() - half);
    beyond.map(|x| x.max(0.0)).norm() + beyond.max().min(0.0)
}

fn points_in(low: f64, high: f64) -> impl Strategy<Value = Point3<f64>> {
    [low..high, low..high, low..high].prop_map(Point3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn box_is_met_exactly(p in points_in(-3.0, 3.0)) {
        let half = [1.0, 0.5, 1.5];
        let surface = SignedDistance::new(&cuboid(half)).unwrap();
        let (distance, gradient) = surface.distance_and_gradient(&p);
        prop_assert!((surface.signed_distance(&p) - box_distance(&p, half)).abs() < ROUNDING);
        prop_assert!((distance - box_distance(&p, half)).abs() < ROUNDING);
        prop_assert!((gradient.norm() - 1.0).abs() < ROUNDING);
        // Walking down the gradient leads to the surface.
        let foot = p - gradient * distance;
        prop_assert!(box_distance(&foot, half).abs() < ROUNDING);
        prop_assert_eq!(surface.is_inside(&p), box_distance(&p, half) < 0.0);
    }

    #[test]
    fn distances_move_with_the_mesh(
        p in points_in(-0.2, 0.2), turn in points_in(-2.0, 2.0), by in points_in(-1.0, 1.0),
    ) {
        let motion = Isometry3::new(by.coords, turn.coords);
        let ball = sphere(2).scaled(0.1);
        let still = SignedDistance::new(&ball).unwrap();
        let moved = SignedDistance::new(&ball.transformed(&motion)).unwrap();
        let (distance, gradient) = still.distance_and_gradient(&p);
        let (moved_distance, moved_gradient) = moved.distance_and_gradient(&(motion * p));
        prop_assert!((distance - moved_distance).abs() < ROUNDING);
        // Near the medial axis either of two directions is right.
        if distance > 0.0 {
            prop_assert!((motion * gradient - moved_gradient).norm() < 1e-9);
        }
    }
}

#[test]
fn sphere_is_met_within_the_height_of_its_facets() {
    let ball = sphere(4);
    let surface = SignedDistance::new(&ball).unwrap();
    let depth = |face| {
        1.0 - ball
            .area_vector(face)
            .normalize()
            .dot(&ball.corners(face)[0].coords)
    };
    let deepest = (0..ball.faces.len()).map(depth).fold(0.0, f64::max);
    assert!(deepest < 0.005);
    for i in 0..200 {
        let t = f64::from(i);
        let direction = Vector3::new(t.sin(), (1.7 * t).cos(), (2.3 * t).sin()).normalize();
        let p = Point3::from(direction * (0.1 + 0.01 * t));
        let exact = p.coords.norm() - 1.0;
        let (distance, gradient) = surface.distance_and_gradient(&p);
        assert!(
            (-ROUNDING..deepest + ROUNDING).contains(&(distance - exact)),
            "{distance} {exact}"
        );
        assert!((gradient.norm() - 1.0).abs() < ROUNDING);
        assert!(gradient.dot(&direction) > 0.99);
    }
}

#[test]
fn overlapping_and_nested_shells_bound_what_winds_positively() {
    let mut hollow = cuboid([1.0; 3]);
    hollow.append(&reversed(cuboid([0.5; 3])));
    let surface = SignedDistance::new(&hollow).unwrap();
    assert_eq!(surface.winding_number(&Point3::origin()), 0);
    assert!((surface.signed_distance(&Point3::origin()) - 0.5).abs() < ROUNDING);
    assert!((surface.signed_distance(&Point3::new(0.75, 0.0, 0.1)) + 0.25).abs() < ROUNDING);

    let mut twice = cuboid([1.0; 3]);
    twice.append(&cuboid([0.5; 3]));
    let surface = SignedDistance::new(&twice).unwrap();
    assert_eq!(surface.winding_number(&Point3::origin()), 2);
    assert!((surface.signed_distance(&Point3::origin()) + 0.5).abs() < ROUNDING);
}

#[test]
fn faces_without_area_do_no_harm() {
    // An edge of the box gets a vertex in its middle on one side only; a face without area closes the gap.
    let mut shape = cuboid([1.0; 3]);
    let face = shape.faces[0];
    let [a, b] = [face[0], face[1]].map(|index| shape.vertices[index as usize]);
    let middle = shape.vertices.len() as u32;
    shape.vertices.push(nalgebra::center(&a, &b));
    shape.faces[0] = [face[0], middle, face[2]];
    shape.faces.push([middle, face[1], face[2]]);
    shape.faces.push([face[0], face[1], middle]);
    let surface = SignedDistance::new(&shape).unwrap();
    for p in [
        [0.1, 0.2, 0.3],
        [-1.5, -1.2, 0.1],
        [-3.0, 0.0, -2.0],
        [-1.0, -1.0, -1.0],
    ] {
        let p = Point3::from(p);
        assert!((surface.signed_distance(&p) - box_distance(&p, [1.0; 3])).abs() < ROUNDING);
    }
}

#[test]
fn far_points_and_points_that_are_not_finite() {
    let surface = SignedDistance::new(&cuboid([0.1; 3])).unwrap();
    for far in [1e3, 1e9, 1e14, 1e20, 1e60] {
        let distance = surface.signed_distance(&Point3::new(far, 0.0, 0.0));
        assert!(
            (distance / (far - 0.1) - 1.0).abs() < ROUNDING,
            "{far} {distance}"
        );
    }
    assert!(
        surface
            .signed_distance(&Point3::new(0.0, f64::NAN, 0.0))
            .is_nan()
    );
    // Such points do not spoil the distances of others beside them.
    let mixed = [0.0, f64::NAN, 0.3, 1e20, f64::INFINITY].map(|x| Point3::new(x, 0.0, 0.0));
    let distances = surface.signed_distances(&mixed);
    assert!((distances[0] + 0.1).abs() < ROUNDING && (distances[2] - 0.2).abs() < ROUNDING);
    assert!(distances[1].is_nan() && distances[3] > 1e19 && !distances[4].is_finite());
    assert!(surface.signed_distances(&[]).is_empty());
    assert!(
        !surface
            .signed_distance(&Point3::new(0.0, f64::INFINITY, 0.0))
            .is_finite()
    );
}

#[test]
fn an_open_mesh_has_closest_points_but_no_inside() {
    let mut sheet = cuboid([1.0; 3]);
    sheet.faces.truncate(2);
    let tree = TriangleTree::new(&sheet).unwrap();
    let distance = tree.closest(&Point3::new(0.0, 0.5, 1.0)).distance;
    assert!((distance - 2.0).abs() < ROUNDING);
    let error = SignedDistance::new(&sheet).unwrap_err().to_string();
    assert!(error.contains("not closed: 4 edges"), "{error}");
}

#[test]
fn what_has_no_signed_distance_is_refused_with_the_reason() {
    let message = |mesh: &TriangleMesh| SignedDistance::new(mesh).unwrap_err().to_string();
    assert!(message(&TriangleMesh::default()).contains("no faces"));
    let mut bad = cuboid([1.0; 3]);
    bad.vertices[3].y = f64::NAN;
    assert!(message(&bad).contains("vertex 3"));
    let mut bad = cuboid([1.0; 3]);
    bad.faces[2][1] = 77;
    assert!(message(&bad).contains("vertex 77"));
    assert!(message(&reversed(cuboid([1.0; 3]))).contains("inside-out"));
    assert!(message(&cuboid([1.0, 1.0, 0.0])).contains("no volume"));

    let surface = SignedDistance::new(&cuboid([1.0; 3])).unwrap();
    let message = |resolution, padding| {
        SdfGrid::build(&surface, resolution, padding, &|_| {})
            .unwrap_err()
            .to_string()
    };
    assert!(message(1, 0.01).contains("2 to 1024"));
    assert!(message(100_000, 0.01).contains("2 to 1024"));
    assert!(message(8, f64::NAN).contains("padding"));
    assert!(message(8, -0.1).contains("padding"));
}
