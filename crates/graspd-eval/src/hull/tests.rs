//! Closed forms, degenerate input, and the two kinds of arithmetic against each other.

use super::*;
use crate::{Contact, grasp_wrenches};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;
use simplex::tests::{lattice, noise_source, noisy_lattice};

/// Rounding in sums of many products of order 1.
const ROUNDING: f64 = 1e-12;

/// How far a point may be above a facet: a few tolerances of the first run.
const COPLANAR: f64 = 1e-11;
/// Facets smaller than this may be so thin that they tilt when points move by one step of the grid.
const SLIVER: f64 = 1e-5;

/// The hull from the second run alone.
fn exact_hull<const D: usize>(points: &[[f64; D]]) -> ConvexHull<D> {
    match Frame::start(points).expect("finite points") {
        Start::Full { mut frame, simplex } => {
            frame.snap_to_grid();
            let (polytope, _) =
                quickhull::quickhull(&frame, &simplex, MAX_FACETS, Order::Found).expect("a hull");
            in_input_coordinates(&frame, &polytope)
        }
        Start::Flat { affine_dimension } => without_interior(HullShape::Flat { affine_dimension }),
        Start::Empty => without_interior(HullShape::Empty),
    }
}

/// Bounds on the depth of the origin; `None` for points without interior.
fn bounds<const D: usize>(points: &[[f64; D]], relative_gap: f64) -> Option<DepthBounds> {
    let search = DepthSearch {
        relative_gap,
        max_facets: MAX_FACETS,
    };
    match origin_depth(points, &search).expect("finite points") {
        OriginDepth::Between(bounds) => Some(bounds),
        OriginDepth::Empty | OriginDepth::Flat { .. } => None,
    }
}

fn both<const D: usize>(points: &[[f64; D]]) -> [ConvexHull<D>; 2] {
    let hulls = [convex_hull(points).expect("a hull"), exact_hull(points)];
    for hull in &hulls {
        check_surface(points, hull);
    }
    hulls
}

/// Every point is under every facet, and facets and neighbours form a closed oriented surface.
fn check_surface<const D: usize>(points: &[[f64; D]], hull: &ConvexHull<D>) {
    let extent = points
        .iter()
        .flatten()
        .fold(0.0f64, |most, x| most.max(x.abs()));
    let mut area_vector = [0.0; D];
    for (index, facet) in hull.facets.iter().enumerate() {
        for point in points.iter().filter(|_| facet.area > SLIVER) {
            let height = hyperplane::dot(&facet.normal, point) - facet.offset;
            assert!(height <= COPLANAR * extent, "a point is {height} outside");
        }
        for (k, &beyond) in facet.neighbours.iter().enumerate() {
            let neighbour = &hull.facets[beyond as usize];
            assert!(neighbour.neighbours.contains(&(index as u32)));
            assert!(!neighbour.vertices.contains(&facet.vertices[k]));
            for (j, vertex) in facet.vertices.iter().enumerate() {
                assert!(j == k || neighbour.vertices.contains(vertex));
            }
        }
        for k in 0..D {
            area_vector[k] += facet.area * facet.normal[k];
        }
    }
    // Minkowski: the outward areas of a closed surface cancel.
    let area: f64 = hull.facets.iter().map(|facet| facet.area).sum();
    for sum in area_vector {
        assert!(sum.abs() <= 1e-9 * area);
    }
}

fn check_value(value: f64, expected: f64, what: &str) {
    let error = (value / expected - 1.0).abs();
    assert!(error < ROUNDING, "{what} {value} differs from {expected}");
}

fn factorial(n: usize) -> f64 {
    (1..=n).map(|k| k as f64).product()
}

fn closed_forms<const D: usize>() {
    let unit = |axis: usize, length: f64| -> [f64; D] {
        std::array::from_fn(|k| if k == axis { length } else { 0.0 })
    };
    for hull in both::<D>(&lattice(&[-1.0, 1.0])) {
        check_value(hull.volume, 2f64.powi(D as i32), "cube volume");
        check_value(hull.origin_depth().unwrap(), 1.0, "cube depth");
        assert_eq!(hull.vertices().len(), 1 << D);
    }
    let cross: Vec<_> = (0..2 * D)
        .map(|i| unit(i / 2, [1.0, -1.0][i % 2]))
        .collect();
    for hull in both(&cross) {
        check_value(
            hull.volume,
            2f64.powi(D as i32) / factorial(D),
            "cross-polytope volume",
        );
        check_value(
            hull.origin_depth().unwrap(),
            1.0 / (D as f64).sqrt(),
            "its depth",
        );
        assert_eq!(hull.facets.len(), 1 << D);
    }
    // The corner simplex {0, e_k} with its incentre moved to the origin.
    let radius = 1.0 / (D as f64 + (D as f64).sqrt());
    let corners: Vec<_> = (0..=D).map(|i| unit(i, 1.0).map(|x| x - radius)).collect();
    for hull in both(&corners) {
        check_value(hull.volume, 1.0 / factorial(D), "simplex volume");
        check_value(hull.origin_depth().unwrap(), radius, "its inradius");
        assert_eq!(hull.facets.len(), D + 1);
    }
}

#[test]
fn cube_cross_polytope_and_simplex_in_every_dimension() {
    closed_forms::<2>();
    closed_forms::<3>();
    closed_forms::<4>();
    closed_forms::<5>();
    closed_forms::<6>();
}

#[test]
fn a_lattice_is_all_coplanar_points_and_still_a_cube() {
    for hull in both::<3>(&lattice(&[-1.0, -0.5, 0.0, 0.5, 1.0])) {
        check_value(hull.volume, 8.0, "volume");
    }
    for hull in both::<5>(&lattice(&[-1.0, 0.25, 1.0])) {
        check_value(hull.volume, 32.0, "volume");
    }
}

#[test]
fn flat_and_repeated_points_have_the_dimension_that_they_span() {
    let flat = |points: &[[f64; 4]]| convex_hull(points).expect("finite points").shape;
    let dimension = |affine_dimension| HullShape::Flat { affine_dimension };
    assert_eq!(flat(&[]), HullShape::Empty);
    assert_eq!(flat(&[[3.0; 4]; 9]), dimension(0));
    assert_eq!(flat(&[[0.0; 4], [1.0; 4], [7.0; 4]]), dimension(1));
    let on_plane: Vec<_> = (0..50)
        .map(|i| {
            let (s, c) = f64::from(i).sin_cos();
            [s + 2.0, c, s - c, 0.3 * s + 0.1 * c]
        })
        .collect();
    assert_eq!(flat(&on_plane), dimension(2));
    let noisy: Vec<_> = on_plane
        .iter()
        .map(|p| [p[0], p[1], p[2] + 3e-13 * (p[1] * 1e4).sin(), p[3]])
        .collect();
    assert_eq!(flat(&noisy), dimension(2));
    let far_away: Vec<_> = on_plane.iter().map(|p| p.map(|x| x + 1e6)).collect();
    assert_eq!(flat(&far_away), dimension(2));
}

#[test]
fn bad_input_is_an_error() {
    let nan = [[0.0, 0.0], [1.0, f64::NAN], [0.0, 1.0]];
    assert_eq!(
        convex_hull(&nan),
        Err(EvaluationError::NotFinite { index: 1 })
    );
    let on_circle: Vec<_> = (0..40)
        .map(|i| <[f64; 2]>::from(f64::from(i).sin_cos()))
        .collect();
    let limited = convex_hull_limited(&on_circle, 20);
    assert_eq!(limited, Err(EvaluationError::TooManyFacets { limit: 20 }));
    assert_eq!(convex_hull(&on_circle).unwrap().facets.len(), 40);
    // Coordinates near the ends of the range neither overflow nor vanish.
    for size in [1e-150, 1e150] {
        let square = [[size, 0.0], [0.0, size], [-size, 0.0], [0.0, -size]];
        check_value(
            convex_hull(&square).unwrap().origin_depth().unwrap(),
            size / 2f64.sqrt(),
            "depth",
        );
    }
}

#[test]
fn noise_of_any_size_is_survived() {
    for exponent in 6..17 {
        let noise = 10f64.powi(-exponent);
        for hull in both(&noisy_lattice::<3>(noise)) {
            assert!((hull.volume - 8.0).abs() < 30.0 * noise + 1e-11);
            assert!((hull.origin_depth().unwrap() - 1.0).abs() < 2.0 * noise + 1e-11);
        }
        for hull in both(&noisy_lattice::<4>(noise)) {
            assert!((hull.volume - 16.0).abs() < 80.0 * noise + 1e-11);
            assert!((hull.origin_depth().unwrap() - 1.0).abs() < 2.0 * noise + 1e-11);
        }
    }
}

/// Contacts around a can, known to within `noise`: whole friction pyramids are coplanar in wrench space, and
/// rounding decides on which side of each other they lie.
///
/// Rounded predicates go wrong on some of these in a way that leaves every ridge convex: facets fold back.
#[test]
fn grasps_of_a_can_are_the_same_in_both_runs() {
    let mut random = noise_source();
    for noise in [0.0, 1e-15] {
        for _ in 0..20 {
            let contact = |_| {
                let (s, c) = (7.0 * random()).sin_cos();
                let height = random();
                let mut near = |x: f64| x + noise * random();
                Contact {
                    point: Point3::new(near(c), near(s), height),
                    normal: Vector3::new(near(-c), near(-s), 0.0),
                }
            };
            let contacts: Vec<_> = (0..8).map(contact).collect();
            let wrenches = grasp_wrenches(&contacts, 0.8, 8, Point3::origin(), 1.2);
            let (rounded, exact) = (convex_hull(&wrenches).unwrap(), exact_hull(&wrenches));
            assert!((rounded.volume - exact.volume).abs() <= 1e-9 * exact.volume);
            if let (Some(a), Some(b)) = (rounded.origin_depth(), exact.origin_depth()) {
                assert!((a - b).abs() < 1e-10, "{a} {b}");
            }
        }
    }
}

#[test]
fn a_search_cut_short_still_brackets_the_depth() {
    let mut noise = noise_source();
    let mut point = || -> [f64; 6] {
        let raw: [f64; 6] = std::array::from_fn(|_| noise());
        let length = hyperplane::dot(&raw, &raw).sqrt();
        raw.map(|x| x / length)
    };
    let points: Vec<_> = (0..100).map(|_| point()).collect();
    let depth = bounds(&points, 0.0).expect("an interior").lower;
    let mut last = f64::INFINITY;
    for max_facets in [100, 1000, 10_000] {
        let search = DepthSearch {
            relative_gap: 0.0,
            max_facets,
        };
        let OriginDepth::Between(cut) = origin_depth(&points, &search).expect("finite points")
        else {
            panic!("points in general position have an interior");
        };
        assert!(cut.lower <= depth + ROUNDING && depth <= cut.upper + ROUNDING);
        let gap = cut.upper - cut.lower;
        assert!(gap <= last, "{gap} after {last}");
        last = gap;
    }
    assert!(last < 0.1 * depth, "{last}");
}

/// What the frontier finds, if rounding does not stop it, and what the whole polytope does.
fn depth_both_ways<const D: usize>(points: &[[f64; D]]) -> Option<[DepthBounds; 2]> {
    let Start::Full { mut frame, simplex } = Frame::start(points).expect("finite points") else {
        return None;
    };
    let body = PointSet::new(&frame.points);
    let search = DepthSearch::default();
    let by_frontier = depth_by_frontier(&mut frame, &body, &simplex, &search)?;
    let most = search.max_facets;
    let whole = expansion::expand(&mut frame, &body, &simplex, 0.0, most, Goal::Bounds).ok()?;
    Some([by_frontier, whole.bounds])
}

#[test]
fn the_facets_that_may_be_nearest_suffice() {
    fn check<const D: usize>(points: &[[f64; D]], what: &str) -> bool {
        let Some([frontier, whole]) = depth_both_ways(points) else {
            return false;
        };
        let is_same = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(
            is_same(frontier.lower, whole.lower) && is_same(frontier.upper, whole.upper),
            "{what}: {frontier:?} {whole:?}"
        );
        true
    }
    let mut noise = noise_source();
    let mut sound = 0;
    for round in 0..40 {
        let count = 10 + 3 * round;
        let cloud = (0..count).map(|_| std::array::from_fn(|_| noise()));
        sound += usize::from(check::<4>(&cloud.collect::<Vec<_>>(), "cloud"));
        let contacts: Vec<_> = (0..5 + round / 2)
            .map(|_| {
                let direction = Vector3::new(noise(), noise(), noise()).normalize();
                Contact {
                    point: Point3::from(direction.component_mul(&Vector3::new(1.0, 0.8, 0.6))),
                    normal: -direction,
                }
            })
            .collect();
        let wrenches = grasp_wrenches(&contacts, 0.8, 8, Point3::origin(), 1.0);
        sound += usize::from(check(&wrenches, "wrenches"));
    }
    // It is a rare set of points in general position that rounding gets the better of.
    assert!(sound > 70, "{sound}");
    // Many facets meet in the corners of lattices' polar polytopes: other ways must do, or agree.
    check::<3>(&lattice(&[-1.0, 0.0, 1.0]), "lattice");
    check::<4>(&noisy_lattice(1e-13), "noisy lattice");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Coordinates from few values: most points are coplanar with others, many coincide.
    #[test]
    fn rounded_and_exact_hulls_agree_on_degenerate_points(
        raw in prop::collection::vec(prop::array::uniform4(-2i8..3), 5..40),
        angle in 0.0f64..6.0,
    ) {
        let (s, c) = angle.sin_cos();
        let points: Vec<[f64; 4]> = raw
            .iter()
            .map(|p| p.map(f64::from))
            .map(|[x, y, z, w]| [c * x - s * w, y, z, s * x + c * w])
            .collect();
        let [rounded, exact] = both(&points);
        prop_assert_eq!(rounded.shape, exact.shape);
        prop_assert!((rounded.volume - exact.volume).abs() <= 1e-10 * exact.volume);
    }

    #[test]
    fn bounds_on_the_depth_meet_at_the_hulls(
        raw in prop::collection::vec(prop::array::uniform5(-1.0f64..1.0), 6..40),
        shift in -0.3f64..0.3,
    ) {
        let points: Vec<[f64; 5]> = raw.iter().map(|p| p.map(|x| x + shift)).collect();
        let depth = convex_hull(&points).unwrap().origin_depth();
        match (depth, bounds(&points, 0.0)) {
            (Some(depth), Some(tight)) if depth > 0.0 => {
                prop_assert!((tight.lower - depth).abs() < 1e-10);
                prop_assert!((tight.upper - depth).abs() < 1e-10);
                let loose = bounds(&points, 0.3).unwrap();
                prop_assert!(loose.lower <= depth + 1e-10 && depth <= loose.upper + 1e-10);
                prop_assert!(loose.upper - loose.lower <= 0.3 * loose.upper + 1e-10);
            }
            (Some(depth), Some(tight)) => {
                prop_assert!(depth <= tight.upper + 1e-10 && tight.upper <= 1e-10);
            }
            (depth, tight) => prop_assert_eq!(depth.is_some(), tight.is_some()),
        }
    }

    /// All sums of one of 0 and two points for each of up to five groups: few enough to list.
    #[test]
    fn the_sum_of_groups_is_the_hull_of_all_sums(
        raw in prop::collection::vec(prop::array::uniform3(-4i8..5), 2..10),
        scale in 0.1f64..10.0,
    ) {
        let points: Vec<[f64; 3]> = raw.iter().map(|p| p.map(|x| scale * f64::from(x))).collect();
        let mut sums = vec![[0.0; 3]];
        for group in points.chunks(2) {
            let mut next = sums.clone();
            for point in group {
                next.extend(sums.iter().map(|sum| -> [f64; 3] { std::array::from_fn(|k| sum[k] + point[k]) }));
            }
            sums = next;
        }
        let search = DepthSearch { relative_gap: 0.0, max_facets: MAX_FACETS };
        let listed = origin_depth(&sums, &search).unwrap();
        let implied = origin_depth_of_sum(&points, 2, &search).unwrap();
        match (listed, implied) {
            (OriginDepth::Between(a), OriginDepth::Between(b)) => {
                let tolerance = 1e-10 * scale;
                // An upper bound rounded below 0 ends the search before the lower one gets there.
                let is_inside = a.upper > tolerance;
                prop_assert!(!is_inside || (a.lower - b.lower).abs() < tolerance, "{a:?} {b:?}");
                prop_assert!((a.upper - b.upper).abs() < tolerance, "{a:?} {b:?}");
            }
            (a, b) => prop_assert_eq!(a, b),
        }
    }
}
