//! Hulls in two and three dimensions against the definition: all hyperplanes through points with none beyond.

use graspd_eval::{ConvexHull, HullShape, convex_hull};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Rounding of sums of a few dozen products of order 1.
const ROUNDING: f64 = 1e-11;

fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Andrew's monotone chain and the shoelace formula.
fn area_of_polygon_around(points: &[[f64; 2]]) -> f64 {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while chain.len() >= 2
                && cross(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut polygon = chain(&mut sorted.iter().copied());
    polygon.extend(chain(&mut sorted.iter().rev().copied()));
    let next = |i: usize| polygon[(i + 1) % polygon.len()];
    let shoelace = |i: usize| polygon[i][0] * next(i)[1] - polygon[i][1] * next(i)[0];
    0.5 * (0..polygon.len()).map(shoelace).sum::<f64>()
}

/// Volume and depth of the origin from all supporting planes through three points; O(n^4).
fn volume_and_depth(points: &[Vector3<f64>]) -> (f64, f64) {
    let mut planes: Vec<(Vector3<f64>, f64)> = Vec::new();
    let (mut volume, mut depth) = (0.0, f64::INFINITY);
    for a in 0..points.len() {
        for b in 0..points.len() {
            for c in 0..b {
                let normal = (points[b] - points[a]).cross(&(points[c] - points[a]));
                if normal.norm() < 1e-9 {
                    continue;
                }
                for normal in [normal.normalize(), -normal.normalize()] {
                    let offset = normal.dot(&points[a]);
                    let is_supporting = points.iter().all(|p| normal.dot(p) <= offset + 1e-9);
                    let is_new = planes
                        .iter()
                        .all(|(n, o)| (n - normal).norm() > 1e-7 || (o - offset).abs() > 1e-7);
                    if !is_supporting || !is_new {
                        continue;
                    }
                    planes.push((normal, offset));
                    depth = depth.min(offset);
                    // Turned by some angle, for the chain needs abscissas that differ by more than noise.
                    let edge = (points[b] - points[a]).normalize();
                    let u = edge * 0.5f64.cos() + normal.cross(&edge) * 0.5f64.sin();
                    let v = normal.cross(&u);
                    let on_plane: Vec<_> = points
                        .iter()
                        .filter(|p| normal.dot(p) > offset - 1e-9)
                        .map(|p| [u.dot(p), v.dot(p)])
                        .collect();
                    volume += area_of_polygon_around(&on_plane) * offset / 3.0;
                }
            }
        }
    }
    (volume, depth)
}

fn euler_characteristic(hull: &ConvexHull<3>) -> i64 {
    let faces = hull.facets.len() as i64;
    hull.vertices().len() as i64 - 3 * faces / 2 + faces
}

fn check_in_space(raw: &[[f64; 3]]) {
    let hull = convex_hull(raw).unwrap();
    if hull.shape != HullShape::Full {
        return;
    }
    assert_eq!(euler_characteristic(&hull), 2);
    let points: Vec<_> = raw.iter().map(|p| Vector3::from(*p)).collect();
    let (volume, depth) = volume_and_depth(&points);
    let size = 8.0
        * points
            .iter()
            .fold(1.0, |most: f64, p| most.max(p.norm()))
            .powi(3);
    assert!(
        (hull.volume - volume).abs() < ROUNDING * size,
        "{} {volume}",
        hull.volume
    );
    assert!((hull.origin_depth().unwrap() - depth).abs() < ROUNDING * size);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn polygons(points in prop::collection::vec(prop::array::uniform2(-1.0f64..1.0), 3..60)) {
        let hull = convex_hull(&points).unwrap();
        prop_assert!((hull.volume - area_of_polygon_around(&points)).abs() < ROUNDING);
        prop_assert_eq!(hull.facets.len(), hull.vertices().len());
    }

    #[test]
    fn polygons_of_whole_numbers(raw in prop::collection::vec(prop::array::uniform2(-3i8..4), 3..40)) {
        let points: Vec<_> = raw.iter().map(|p| p.map(f64::from)).collect();
        let hull = convex_hull(&points).unwrap();
        prop_assert!((hull.volume - area_of_polygon_around(&points)).abs() < 100.0 * ROUNDING);
    }

    #[test]
    fn polyhedra(points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 4..14)) {
        check_in_space(&points);
    }

    #[test]
    fn polyhedra_of_whole_numbers(raw in prop::collection::vec(prop::array::uniform3(-1i8..2), 4..14)) {
        let points: Vec<_> = raw.iter().map(|p| p.map(f64::from)).collect();
        check_in_space(&points);
    }
}

#[test]
fn many_points_on_a_sphere_take_little_time() {
    let points: Vec<[f64; 3]> = (0..20_000)
        .map(|k| {
            let height: f64 = 1.0 - (2.0 * f64::from(k) + 1.0) / 20_000.0;
            let (sine, cosine) = (2.4 * f64::from(k)).sin_cos();
            let radius = (1.0 - height * height).sqrt();
            [radius * cosine, radius * sine, height]
        })
        .collect();
    let hull = convex_hull(&points).unwrap();
    assert_eq!(hull.facets.len(), 2 * 20_000 - 4);
    assert!((hull.volume - 4.0 / 3.0 * std::f64::consts::PI).abs() < 2e-3);
}
