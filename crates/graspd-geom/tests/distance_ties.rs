//! Closed meshes full of coincident corners, edges and faces: exact signs, and distances as found without a tree.

use graspd_geom::{SdfGrid, SignedDistance, TriangleMesh, TriangleTree};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// Rounding in the distance of points some metres apart.
const ROUNDING: f64 = 1e-12;

/// Tetrahedra with corners on a coarse lattice: a closed mesh full of coincident vertices, edges and faces.
type Tetrahedra = Vec<[[i64; 3]; 4]>;

fn tetrahedra() -> impl Strategy<Value = Tetrahedra> {
    let corner = [-3..4_i64, -3..4_i64, -3..4_i64];
    proptest::collection::vec(
        [corner.clone(), corner.clone(), corner.clone(), corner],
        1..12,
    )
    .prop_map(|mut all| {
        // One that surely has a volume.
        all.push([[-3, -3, -3], [3, -3, -3], [-3, 3, -3], [-3, -3, 3]]);
        for t in &mut all {
            if volume(t[0], t[1], t[2], t[3]) < 0 {
                t.swap(0, 1);
            }
        }
        all
    })
}

/// Six times the volume of a tetrahedron.
fn volume(a: [i64; 3], b: [i64; 3], c: [i64; 3], d: [i64; 3]) -> i64 {
    let from_a = |p: [i64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let ([u, v, w], [x, y, z], [r, s, t]) = (from_a(b), from_a(c), from_a(d));
    u * (y * t - z * s) - v * (x * t - z * r) + w * (x * s - y * r)
}

fn to_mesh(all: &Tetrahedra) -> TriangleMesh {
    let mut result = TriangleMesh::default();
    for t in all {
        result.append(&TriangleMesh {
            vertices: t
                .map(|corner| Point3::from(corner.map(|x| x as f64)))
                .to_vec(),
            faces: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        });
    }
    result
}

/// How many tetrahedra hold p / 2, or `None` if it lies on the boundary of one.
fn holding(all: &Tetrahedra, p: [i64; 3]) -> Option<i32> {
    let mut count = 0;
    for t in all {
        let [a, b, c, d] = t.map(|corner| corner.map(|x| 2 * x));
        if volume(a, b, c, d) == 0 {
            continue;
        }
        let parts = [
            volume(p, b, c, d),
            volume(a, p, c, d),
            volume(a, b, p, d),
            volume(a, b, c, p),
        ];
        let least = parts.into_iter().min()?;
        if least == 0 {
            return None;
        }
        count += i32::from(least > 0);
    }
    Some(count)
}

/// The distance to a triangle in another way: its plane if the foot is within all edges, else the edges.
fn triangle_distance(p: &Point3<f64>, corners: [Point3<f64>; 3]) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let edges = [(a, b), (b, c), (c, a)];
    let within = |&(from, to): &(Point3<f64>, Point3<f64>)| {
        normal.cross(&(to - from)).dot(&(p - from)) >= 0.0
    };
    if normal.norm() > 0.0 && edges.iter().all(within) {
        return (normal.dot(&(p - a)) / normal.norm()).abs();
    }
    let to_edge = |&(from, to): &(Point3<f64>, Point3<f64>)| {
        let edge: Vector3<f64> = to - from;
        let length = edge.norm_squared();
        let along = if length > 0.0 {
            ((p - from).dot(&edge) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        (p - (from + edge * along)).norm()
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}

fn brute_distance(mesh: &TriangleMesh, p: &Point3<f64>) -> f64 {
    (0..mesh.faces.len())
        .map(|face| triangle_distance(p, mesh.corners(face)))
        .fold(f64::INFINITY, f64::min)
}

fn points_in(low: f64, high: f64) -> impl Strategy<Value = Point3<f64>> {
    [low..high, low..high, low..high].prop_map(Point3::from)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn ties_are_broken_so_that_every_crossing_counts_once(
        all in tetrahedra(), points in proptest::collection::vec([-8..9_i64, -8..9_i64, -8..9_i64], 64),
    ) {
        let surface = SignedDistance::new(&to_mesh(&all)).unwrap();
        let to_point = |p: &[i64; 3]| Point3::from(p.map(|x| x as f64 / 2.0));
        let all_at_once = surface.signed_distances(&points.iter().map(to_point).collect::<Vec<_>>());
        for (p, distance) in points.into_iter().zip(all_at_once) {
            let point = to_point(&p);
            prop_assert_eq!(distance.to_bits(), surface.signed_distance(&point).to_bits());
            if let Some(count) = holding(&all, p) {
                prop_assert_eq!(surface.winding_number(&point), count, "{:?}", point);
            } else {
                prop_assert!(surface.signed_distance(&point).abs() < ROUNDING);
            }
        }
    }

    #[test]
    fn tree_finds_what_a_look_at_every_triangle_finds(
        all in tetrahedra(), mut points in proptest::collection::vec(points_in(-6.0, 6.0), 16),
    ) {
        let mesh = to_mesh(&all);
        let tree = TriangleTree::new(&mesh).unwrap();
        for face in 0..mesh.faces.len().min(16) {
            let [a, b, c] = mesh.corners(face);
            points.extend([a, nalgebra::center(&a, &b), Point3::from((a.coords + b.coords + c.coords) / 3.0)]);
        }
        for p in points {
            let closest = tree.closest(&p);
            prop_assert!((closest.distance - brute_distance(&mesh, &p)).abs() < ROUNDING);
            // What is reported belongs together.
            prop_assert!(((closest.point - p).norm() - closest.distance).abs() < ROUNDING);
            prop_assert!(triangle_distance(&closest.point, mesh.corners(closest.face)) < ROUNDING);
            let area = mesh.area_vector(closest.face);
            prop_assert!((closest.normal * area.norm() - area).norm() < ROUNDING);
            // A bound is obeyed.
            prop_assert_eq!(tree.closest_within(&p, closest.distance * 0.999), None);
            let within = tree.closest_within(&p, closest.distance * 1.001 + 1e-9);
            prop_assert_eq!(within.map(|within| within.distance), Some(closest.distance));
        }
    }

    #[test]
    fn grid_nodes_equal_direct_queries(all in tetrahedra(), resolution in 2..20_usize) {
        // At resolution 9, 13 and 17 all nodes lie on the lattice or halfway.
        let surface = SignedDistance::new(&to_mesh(&all)).unwrap();
        let grid = SdfGrid::build(&surface, resolution, 1.0, &|_| {}).unwrap();
        for k in 0..resolution {
            for j in 0..resolution {
                for i in 0..resolution {
                    let direct = surface.signed_distance(&grid.node([i, j, k])) as f32;
                    prop_assert_eq!(grid.value([i, j, k]).to_bits(), direct.to_bits());
                }
            }
        }
    }
}
