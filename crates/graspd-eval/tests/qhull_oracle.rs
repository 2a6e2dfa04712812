//! Our hull against Qhull itself, on grasps of shapes with all the degeneracies of real objects.
//!
//! `cargo test -p graspd-eval --features qhull-oracle`; building Qhull needs libclang.
#![cfg(feature = "qhull-oracle")]

use graspd_eval::{Contact, EpsilonSettings, convex_hull, ferrari_canny, grasp_wrenches};
use nalgebra::{DMatrix, Point3, Vector3};
use proptest::prelude::*;
use qhull::Qh;

/// Agreement of depths and volumes of order 1. Qhull merges facets that are within 1e-13 or so of coplanar,
/// and our hull leaves points within 1e-12 of a facet out.
const AGREEMENT: f64 = 1e-9;

/// Volumes are compared on points moved by this much: where Qhull triangulates facets that it merged (option Qt),
/// simplices may overlap, and their sum is too large by up to 1e-3 of itself.
const MOVE: f64 = 1e-9;

/// Depth of the origin and volume of the hull, by Qhull with its facets triangulated.
fn by_qhull<const D: usize>(points: &[[f64; D]]) -> (f64, f64) {
    let hull = Qh::builder()
        .compute(true)
        .triangulate(true)
        .build_from_iter(points.iter().copied())
        .expect("points with an interior");
    let center: Vec<f64> = (0..D)
        .map(|k| points.iter().map(|point| point[k]).sum::<f64>() / points.len() as f64)
        .collect();
    let (mut depth, mut volume) = (f64::INFINITY, 0.0);
    for facet in hull.facets() {
        depth = depth.min(-facet.offset());
        let vertices = facet.vertices().expect("a facet has vertices");
        let rows: Vec<usize> = vertices
            .iter()
            .map(|vertex| vertex.index(&hull).expect("an input point"))
            .collect();
        assert_eq!(rows.len(), D);
        let edges = DMatrix::from_fn(D, D, |row, k| points[rows[row]][k] - center[k]);
        volume += edges.determinant().abs();
    }
    (depth, volume / (1..=D).map(|k| k as f64).product::<f64>())
}

/// The points, each moved by about `MOVE` so that no more than D of them share a hyperplane.
fn in_general_position<const D: usize>(points: &[[f64; D]]) -> Vec<[f64; D]> {
    let mut phase = 0.0f64;
    let mut moved = |x: f64| {
        phase += 1.0;
        x + MOVE * (phase * phase * 0.7549).sin()
    };
    points.iter().map(|point| point.map(&mut moved)).collect()
}

fn check<const D: usize>(points: &[[f64; D]]) {
    let hull = convex_hull(points).unwrap();
    let Some(depth) = hull.origin_depth() else {
        return;
    };
    let (qhull_depth, _) = by_qhull(points);
    assert!(
        (depth - qhull_depth).abs() < AGREEMENT,
        "depth {depth} {qhull_depth}"
    );

    let moved = in_general_position(points);
    let moved_hull = convex_hull(&moved).unwrap();
    let (_, qhull_volume) = by_qhull(&moved);
    let error = (moved_hull.volume - qhull_volume).abs();
    assert!(
        error < AGREEMENT * qhull_volume,
        "volume {} {qhull_volume}",
        moved_hull.volume
    );
    let difference = (moved_hull.volume - hull.volume).abs();
    assert!(
        difference < 1e3 * MOVE,
        "volume {} {qhull_volume}",
        hull.volume
    );
}

fn check_grasp(contacts: &[Contact], friction: f64, edges: usize) {
    let wrenches = grasp_wrenches(contacts, friction, edges, Point3::origin(), 1.0);
    check(&wrenches);
    let depth = convex_hull(&wrenches)
        .unwrap()
        .origin_depth()
        .unwrap_or(0.0);
    let bounds = ferrari_canny(&wrenches, &EpsilonSettings::sum()).unwrap();
    assert!((bounds.lower - depth.max(0.0)).abs() < AGREEMENT);
    assert!((bounds.upper - depth.max(0.0)).abs() < AGREEMENT);
}

fn on_ellipsoid(raw: [f64; 3], axes: [f64; 3]) -> Contact {
    let direction = Vector3::from(raw).normalize();
    let axes = Vector3::from(axes);
    let point = direction.component_mul(&axes);
    Contact {
        point: point.into(),
        normal: -direction.component_div(&axes).normalize(),
    }
}

/// A contact on a face of the cube, at one of a few places: normals repeat and points line up.
fn on_cube(face: usize, place: [i8; 2]) -> Contact {
    let mut contact = Contact {
        point: Point3::origin(),
        normal: Vector3::zeros(),
    };
    let (axis, side) = (face / 2, [1.0, -1.0][face % 2]);
    contact.point[axis] = 0.5 * side;
    contact.point[(axis + 1) % 3] = 0.2 * f64::from(place[0]);
    contact.point[(axis + 2) % 3] = 0.2 * f64::from(place[1]);
    contact.normal[axis] = -side;
    contact
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn grasps_of_ellipsoids(
        raw in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 4..16),
        axes in prop::array::uniform3(0.2f64..1.0),
        friction in 0.1f64..1.0,
        edges in 3usize..9,
    ) {
        let contacts: Vec<_> = raw
            .into_iter()
            .filter(|v| Vector3::from(*v).norm() > 0.1)
            .map(|v| on_ellipsoid(v, axes))
            .collect();
        check_grasp(&contacts, friction, edges);
    }

    #[test]
    fn grasps_of_cubes(
        raw in prop::collection::vec((0usize..6, prop::array::uniform2(-2i8..3)), 4..16),
        friction in 0.0f64..1.0,
        edges in 3usize..9,
    ) {
        let contacts: Vec<_> = raw.into_iter().map(|(face, place)| on_cube(face, place)).collect();
        check_grasp(&contacts, friction, edges);
    }

    #[test]
    fn points_in_four_dimensions(points in prop::collection::vec(prop::array::uniform4(-1.0f64..1.0), 5..60)) {
        check(&points);
    }

    #[test]
    fn points_in_five_dimensions(points in prop::collection::vec(prop::array::uniform5(-1.0f64..1.0), 6..50)) {
        check(&points);
    }
}
