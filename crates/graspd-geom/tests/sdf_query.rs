//! Looking up distances between the nodes of a grid: every scalar, every side of every kink.

use graspd_ad::{Dual, Lanes, Real};
use graspd_geom::{SdfGrid, Vec3};
use proptest::prelude::*;

/// Rounding of a handful of operations on numbers of order 1.
const ROUNDING: f64 = 1e-12;
/// The same in single precision, where a grid coordinate of order 10 loses a digit.
const SINGLE: f64 = 1e-4;
/// Central differences of a piecewise polynomial: exact up to rounding over the step.
const STEP: f64 = 1e-6;
const DIFFERENCES: f64 = 1e-7;

/// A wavy field on an anisotropic 7 x 5 x 6 grid that is not at the origin.
fn wavy() -> SdfGrid {
    let (origin, spacing) = (Vec3::new(-0.4, 0.2, 1.0), Vec3::new(0.125, 0.25, 0.5));
    SdfGrid::from_function(origin, spacing, [7, 5, 6], |p| {
        (3.0 * p.x).sin() + (2.0 * p.y * p.z).cos() + p.x * p.z
    })
    .unwrap()
}

/// A point in or around the box of [`wavy`], at least 1e-4 cells from cell faces, by cell and place in it.
fn off_faces() -> impl Strategy<Value = Vec3<f64>> {
    let axis = |cells: i32| (-2..cells + 2, 1e-4..1.0 - 1e-4).prop_map(|(c, at)| f64::from(c) + at);
    (axis(6), axis(4), axis(5))
        .prop_map(|(x, y, z)| Vec3::new(-0.4 + 0.125 * x, 0.2 + 0.25 * y, 1.0 + 0.5 * z))
}

/// Distance to the grid's box from outside.
fn outside(grid: &SdfGrid, p: Vec3<f64>) -> Option<f64> {
    let (low, high) = grid.bounds();
    let nearest = Vec3::new(
        p.x.clamp(low.x, high.x),
        p.y.clamp(low.y, high.y),
        p.z.clamp(low.z, high.z),
    );
    let distance = (p - nearest).norm();
    (distance > 0.0).then_some(distance)
}

fn lift<T: Real, const N: usize>(p: Vec3<T>) -> Vec3<Dual<T, N>> {
    Vec3::new(
        Dual::variable(p.x, 0),
        Dual::variable(p.y, 1),
        Dual::variable(p.z, 2),
    )
}

fn moved(p: Vec3<f64>, axis: usize, by: f64) -> Vec3<f64> {
    let mut step = [0.0; 3];
    step[axis] = by;
    p + Vec3::from(step)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn gradient_is_forward_derivative_and_central_difference(p in off_faces()) {
        let grid = wavy();
        let (distance, gradient) = grid.distance_and_gradient(p);
        prop_assert!((distance - grid.distance(p)).abs() < ROUNDING);
        let dual = grid.distance(lift::<f64, 3>(p));
        let (dual_distance, dual_gradient) = grid.distance_and_gradient(lift::<f64, 3>(p));
        prop_assert_eq!(dual_distance.value, distance);
        for axis in 0..3 {
            prop_assert!((dual.derivative[axis] - gradient.get(axis)).abs() < ROUNDING);
            prop_assert!((dual_distance.derivative[axis] - gradient.get(axis)).abs() < ROUNDING);
            let (ahead, behind) = (moved(p, axis, STEP), moved(p, axis, -STEP));
            let difference = (grid.distance(ahead) - grid.distance(behind)) / (2.0 * STEP);
            prop_assert!((difference - gradient.get(axis)).abs() < DIFFERENCES);
            // Second derivatives.
            let (ahead, behind) =
                (grid.distance_and_gradient(ahead).1, grid.distance_and_gradient(behind).1);
            for of in 0..3 {
                prop_assert_eq!(dual_gradient.get(of).value, gradient.get(of));
                let difference = (ahead.get(of) - behind.get(of)) / (2.0 * STEP);
                let second = dual_gradient.get(of).derivative[axis];
                // Near the box the distance to it is as curved as 1 / distance, hence the relative part.
                prop_assert!((difference - second).abs() < 1e-6 * (1.0 + second.abs().powi(3)));
            }
        }
    }

    #[test]
    fn second_derivatives_are_those_of_duals(p in off_faces()) {
        let grid = wavy();
        let (distance, gradient, second) = grid.distance_to_second_order(p);
        let (dual_distance, dual_gradient) = grid.distance_and_gradient(lift::<f64, 3>(p));
        prop_assert_eq!(distance, dual_distance.value);
        let terms = outside(&grid, p).map_or(0.0, f64::recip);
        for axis in 0..3 {
            prop_assert_eq!(gradient.get(axis), dual_gradient.get(axis).value);
            for by in 0..3 {
                let expected = dual_gradient.get(axis).derivative[by];
                let error = (second.rows[axis].get(by) - expected).abs();
                prop_assert!(error < ROUNDING * (1.0 + expected.abs() + terms));
            }
        }
    }

    #[test]
    fn reverse_mode_equals_forward_mode(p in off_faces()) {
        let grid = wavy();
        let forward = grid.distance(lift::<f64, 3>(p));
        let (distance, gradient) = grid.distance_and_gradient(lift::<f64, 3>(p));
        let outputs = [forward, distance, gradient.x, gradient.y, gradient.z];
        // Second derivatives of the distance to the box are differences of terms of 1 / distance, which may cancel.
        let terms = outside(&grid, p).map_or(0.0, f64::recip);
        let (values, rows) = graspd_ad::jacobian(
            |x| {
                let p = Vec3::new(x[0], x[1], x[2]);
                let (distance, gradient) = grid.distance_and_gradient(p);
                vec![grid.distance(p), distance, gradient.x, gradient.y, gradient.z]
            },
            &[p.x, p.y, p.z],
        );
        for (output, (value, row)) in outputs.into_iter().zip(values.into_iter().zip(rows)) {
            prop_assert_eq!(output.value, value);
            for (forward, reverse) in output.derivative.into_iter().zip(row) {
                prop_assert!((forward - reverse).abs() < ROUNDING * (1.0 + forward.abs() + terms));
            }
        }
    }

    #[test]
    fn lanes_in_different_cells_agree_with_doubles(
        points in proptest::collection::vec(off_faces(), 8),
    ) {
        let grid = wavy();
        let p = Vec3::new(
            Lanes::from_lanes(|lane| points[lane].x),
            Lanes::from_lanes(|lane| points[lane].y),
            Lanes::from_lanes(|lane| points[lane].z),
        );
        let distance = grid.distance(p);
        let (same_distance, gradient) = grid.distance_and_gradient(p);
        let dual = grid.distance(lift::<Lanes, 3>(p));
        let (dual_distance, dual_gradient) = grid.distance_and_gradient(lift::<Lanes, 3>(p));
        for lane in 0..8 {
            // The point as rounded to single precision, seen in double precision: the same cell.
            let point = Vec3::new(p.x.lane(lane), p.y.lane(lane), p.z.lane(lane));
            let (expected, slope) = grid.distance_and_gradient(point);
            let (_, second) = grid.distance_and_gradient(lift::<f64, 3>(point));
            let (single, single_slope) = grid.distance_and_gradient(
                Vec3::new(point.x as f32, point.y as f32, point.z as f32),
            );
            prop_assert!((distance.lane(lane) - expected).abs() < SINGLE);
            prop_assert!((f64::from(single) - expected).abs() < SINGLE);
            prop_assert!((same_distance.lane(lane) - expected).abs() < SINGLE);
            prop_assert!((dual.value.lane(lane) - expected).abs() < SINGLE);
            for axis in 0..3 {
                let slope = slope.get(axis);
                prop_assert!((gradient.get(axis).lane(lane) - slope).abs() < 10.0 * SINGLE);
                prop_assert!((f64::from(single_slope.get(axis)) - slope).abs() < 10.0 * SINGLE);
                prop_assert!((dual.derivative[axis].lane(lane) - slope).abs() < 10.0 * SINGLE);
                prop_assert!((dual_distance.derivative[axis].lane(lane) - slope).abs() < 10.0 * SINGLE);
                for by in 0..3 {
                    let second = second.get(axis).derivative[by];
                    let lane = dual_gradient.get(axis).derivative[by].lane(lane);
                    prop_assert!((lane - second).abs() < 0.01 * (1.0 + second.abs()));
                }
            }
        }
    }
}

/// With what rounding left of coordinates, single precision is as good as the grid's samples.
#[test]
fn sums_of_two_singles_are_looked_up_as_doubles() {
    // 256 samples along 20 cm, a decimetre from the origin, in units that no binary number is a multiple of.
    let (origin, spacing) = (
        Vec3::new(-0.11, 0.07, -0.3),
        Vec3::new(0.2, 0.19, 0.21) * (1.0 / 255.0),
    );
    let grid = SdfGrid::from_function(origin, spacing, [256, 4, 200], |p| {
        (50.0 * p.x).sin() * 1e-3 + (40.0 * p.z).cos() * 1e-3 + (p.y - 0.0715)
    })
    .unwrap();
    let (low, high) = grid.bounds();
    let (mut worst, mut worst_alone) = (0.0_f64, 0.0_f64);
    let (mut slope, mut slope_alone) = (0.0_f64, 0.0_f64);
    for number in 0..4000 {
        // Golden sections: everywhere in the box, off the cells' faces.
        let at = |share: f64| (f64::from(number) * share).fract() * 0.998 + 0.001;
        let p = Vec3::new(
            low.x + at(0.618_033_988_7) * (high.x - low.x),
            low.y + at(0.754_877_666_2) * (high.y - low.y),
            low.z + at(0.569_840_290_9) * (high.z - low.z),
        );
        let place = (p - origin).x / spacing.x;
        let other = (p - origin).z / spacing.z;
        let height = (p - origin).y / spacing.y;
        if [place, other, height]
            .iter()
            .any(|x| (x - x.round()).abs() < 1e-4)
        {
            continue;
        }
        let rounded = Vec3::new(p.x as f32, p.y as f32, p.z as f32);
        let back = Vec3::new(
            f64::from(rounded.x),
            f64::from(rounded.y),
            f64::from(rounded.z),
        );
        let rest = p - back;
        let rest = Vec3::new(rest.x as f32, rest.y as f32, rest.z as f32);
        let expected = grid.distance_and_gradient(p);
        let error = |found: (f32, Vec3<f32>)| {
            let gradient = Vec3::new(
                f64::from(found.1.x),
                f64::from(found.1.y),
                f64::from(found.1.z),
            );
            (
                (f64::from(found.0) - expected.0).abs(),
                (gradient - expected.1).norm(),
            )
        };
        let (distance, gradient) = error(grid.distance_and_gradient_of_sum(rounded, rest));
        worst = worst.max(distance);
        slope = slope.max(gradient);
        let (distance, gradient) = error(grid.distance_and_gradient(rounded));
        worst_alone = worst_alone.max(distance);
        slope_alone = slope_alone.max(gradient);
        let double = grid.distance_and_gradient_of_sum(back, p - back);
        assert!((double.0 - expected.0).abs() < 1e-15 && (double.1 - expected.1).norm() < 1e-12);
        let dual =
            grid.distance_and_gradient_of_sum(lift::<f32, 3>(rounded), Vec3::constant(p - back));
        let alone = grid.distance_and_gradient_of_sum(rounded, rest);
        assert_eq!(dual.0.value, alone.0);
        for axis in 0..3 {
            assert!((dual.0.derivative[axis] - alone.1.get(axis)).abs() < 1e-5);
        }
    }
    assert!(
        worst < 1e-9 && worst_alone > 5.0 * worst,
        "{worst:e} {worst_alone:e}"
    );
    assert!(
        slope < 1e-3 && slope_alone < 1e-3,
        "{slope:e} {slope_alone:e}"
    );
    println!(
        "distance {worst:.1e} with the rest, {worst_alone:.1e} without; gradient {slope:.1e} and {slope_alone:.1e}"
    );
}

#[test]
fn nodes_are_met_and_trilinear_functions_reproduced() {
    let grid = wavy();
    for k in 0..6 {
        for j in 0..5 {
            for i in 0..7 {
                let at_node = grid.distance(Vec3::from(grid.node([i, j, k])));
                assert!((at_node - f64::from(grid.value([i, j, k]))).abs() < ROUNDING);
            }
        }
    }
    // Coefficients with few digits, so that the samples are exact in single precision.
    let function = |p: Vec3<f64>| 0.5 + p.x - 2.0 * p.y + p.z * p.x + 4.0 * p.x * p.y * p.z;
    let (origin, spacing) = (Vec3::zero(), Vec3::new(0.25, 0.5, 1.0));
    let grid = SdfGrid::from_function(origin, spacing, [5, 3, 2], function).unwrap();
    for p in [
        [0.1, 0.2, 0.3],
        [0.9, 0.9, 0.9],
        [0.25, 0.5, 0.0],
        [1.0, 1.0, 1.0],
    ] {
        let p = Vec3::from(p);
        let (distance, gradient) = grid.distance_and_gradient(p);
        assert!((distance - function(p)).abs() < ROUNDING);
        let exact = [
            1.0 + p.z + 4.0 * p.y * p.z,
            -2.0 + 4.0 * p.x * p.z,
            p.x + 4.0 * p.x * p.y,
        ];
        for axis in 0..3 {
            assert!((gradient.get(axis) - exact[axis]).abs() < ROUNDING);
        }
    }
}

#[test]
fn outside_the_value_at_the_nearest_point_of_the_box_and_the_distance_to_it_add_up() {
    let grid = wavy();
    let (low, high) = grid.bounds();
    for far in [1e-9, 0.01, 1.0, 1e3] {
        // Beyond a face, an edge and a corner.
        for beyond in [
            [0.0, 0.0, 1.0],
            [-0.6, 0.0, 0.8],
            [2.0 / 3.0, -2.0 / 3.0, 1.0 / 3.0],
        ] {
            let nearest: [f64; 3] = std::array::from_fn(|axis| match beyond[axis] {
                b if b > 0.0 => high[axis],
                b if b < 0.0 => low[axis],
                _ => low[axis] + 0.37 * (high[axis] - low[axis]),
            });
            let nearest = Vec3::from(nearest);
            let beyond = Vec3::from(beyond);
            let (distance, gradient) = grid.distance_and_gradient(nearest + beyond * far);
            let (inside, slope) = grid.distance_and_gradient(nearest);
            assert!((distance - inside - far).abs() < 1e-9 * (1.0 + far));
            for axis in 0..3 {
                let along = if beyond.get(axis) == 0.0 {
                    slope.get(axis)
                } else {
                    0.0
                };
                // The direction from the box is known to rounding of coordinates over distance.
                assert!((gradient.get(axis) - along - beyond.get(axis)).abs() < 1e-15 / far + 1e-9);
            }
        }
    }
}

#[test]
fn continuous_across_cell_faces_and_the_boundary() {
    let grid = wavy();
    for axis in 0..3 {
        for cell in 0..grid.dims()[axis] {
            for at in [0.0, 0.3, 0.5, 1.0] {
                let (low, high) = grid.bounds();
                let mut p: [f64; 3] = std::array::from_fn(|a| low[a] + at * (high[a] - low[a]));
                p[axis] = low[axis] + cell as f64 * grid.spacing().get(axis);
                let p = Vec3::from(p);
                let step = 1e-10;
                let before = grid.distance(moved(p, axis, -step));
                let after = grid.distance(moved(p, axis, step));
                // No slope exceeds 10 a metre.
                assert!((before - grid.distance(p)).abs() < 10.0 * step);
                assert!((after - grid.distance(p)).abs() < 10.0 * step);
            }
        }
    }
}

#[test]
fn on_faces_of_cells_the_gradient_is_that_of_the_documented_side() {
    // Slopes 1, 2, 4 along x.
    let grid = SdfGrid::from_values(
        Vec3::zero(),
        Vec3::new(1.0, 1.0, 1.0),
        [4, 2, 2],
        [0.0, 1.0, 3.0, 7.0].repeat(4),
    )
    .unwrap();
    let slope = |x: f64| grid.distance_and_gradient(Vec3::new(x, 0.5, 0.5)).1.x;
    assert_eq!(slope(0.0), 1.0);
    assert_eq!(slope(1.0), 2.0);
    assert_eq!(slope(2.0), 4.0);
    assert_eq!(slope(3.0), 4.0);
    assert_eq!(slope(-1.0), -1.0);
    assert_eq!(slope(4.0), 1.0);
    // At the corner too, the outside adds nothing.
    let corner = grid.distance_and_gradient(lift::<f64, 3>(Vec3::new(3.0, 1.0, 1.0)));
    assert_eq!(corner.0, Dual::new(7.0, [4.0, 0.0, 0.0]));
}

#[test]
fn never_nan() {
    let grid = wavy();
    let places = [
        -1e30,
        -1e3,
        -0.4,
        -0.4 - 1e-16,
        0.0,
        0.2,
        0.35,
        1.0,
        1.2,
        3.5,
        1e3,
        1e30,
    ];
    for x in places {
        for y in places {
            for z in places {
                let p = Vec3::new(x, y, z);
                let (distance, gradient) = grid.distance_and_gradient(lift::<f64, 3>(p));
                let lanes = grid.distance_and_gradient(lift::<Lanes, 3>(Vec3::constant(p)));
                assert!(distance.value.is_finite() && !lanes.0.value.lane(0).is_nan());
                for axis in 0..3 {
                    assert!(distance.derivative[axis].is_finite());
                    assert!(gradient.get(axis).derivative.iter().all(|d| d.is_finite()));
                    assert!(!lanes.0.derivative[axis].lane(0).is_nan(), "{p:?}");
                    let second = lanes.1.get(axis).derivative;
                    assert!(second.iter().all(|d| !d.lane(0).is_nan()), "{p:?}");
                }
            }
        }
    }
}

#[test]
fn by_the_nearest_sample_the_outside_knows_nothing_of_the_shape() {
    let grid = wavy();
    // Two cells beyond the box in x and one below it in y; along z between nodes 2 and 3, nearer to 3.
    let (high, low) = (-0.4 + 6.0 * 0.125, 0.2);
    let p = Vec3::new(high + 0.25, low - 0.25, 1.0 + 2.7 * 0.5);
    let (distance, gradient) = grid.distance_and_gradient_by_nearest_sample(p, None);
    let node = Vec3::new(high, low, 1.0 + 3.0 * 0.5);
    let beyond = 0.25 * 2f64.sqrt();
    assert!((distance - (grid.distance(node) + beyond)).abs() < ROUNDING);
    let outward = Vec3::new(1.0, -1.0, 0.0) * 0.5f64.sqrt();
    assert!((gradient - outward).norm() < ROUNDING, "{gradient:?}");
    // The interpolant changes along z there.
    assert!(grid.distance_and_gradient(p).1.z.abs() > 0.01);
    let dual = grid.distance_and_gradient_by_nearest_sample(lift::<f64, 3>(p), None);
    for axis in 0..3 {
        assert!((dual.0.derivative[axis] - outward.get(axis)).abs() < ROUNDING);
    }
    // On the last node along x, whichever cell rounding puts it in.
    for at in [high - 1e-17, high, high + 1e-12] {
        let p = Vec3::new(at, low - 0.25, 1.0);
        let (distance, _) = grid.distance_and_gradient_by_nearest_sample(p, None);
        let node = grid.distance(Vec3::new(high, low, 1.0));
        assert!((distance - (node + 0.25)).abs() < 1e-9);
    }
}

proptest! {
    #[test]
    fn by_the_nearest_sample_the_inside_is_the_same(at in prop::array::uniform3(0.001..0.999f64)) {
        let grid = wavy();
        let p = Vec3::new(-0.4 + 0.75 * at[0], 0.2 + at[1], 1.0 + 2.5 * at[2]);
        let found = grid.distance_and_gradient_by_nearest_sample(p, None);
        prop_assert_eq!(found, grid.distance_and_gradient(p));
        let single = Vec3::new(p.x as f32, p.y as f32, p.z as f32);
        let rest = Vec3::new((p.x - f64::from(single.x)) as f32, 0.0, 0.0);
        let found = grid.distance_and_gradient_by_nearest_sample(single, Some(rest));
        prop_assert_eq!(found, grid.distance_and_gradient_of_sum(single, rest));
    }
}
