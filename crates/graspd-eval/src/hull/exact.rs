//! Exact predicates on points whose coordinates are whole multiples of one grid step.

use super::wide_integer::WideInteger;

/// Grid steps per unit of the working frame, in which coordinates have magnitude at most 1.
///
/// Differences are then below 2^52 and exact in `f64` as well as in [`WideInteger`]'s determinants.
pub(super) const GRID: f64 = (1u64 << 50) as f64;

/// The grid point nearest to `x`, |x| <= 1; applying it twice changes nothing.
pub(super) fn snap(x: f64) -> f64 {
    (x * GRID).round() / GRID
}

/// The integer vector `(a - b) GRID` of two snapped points.
fn grid_difference<const D: usize>(a: &[f64; D], b: &[f64; D]) -> [i64; D] {
    std::array::from_fn(|k| ((a[k] - b[k]) * GRID) as i64)
}

/// The vector m with `m . x = det(p_1 - p_0, ..., p_{D-1} - p_0, x)` for every x, exactly, in grid steps.
///
/// Laplace expansion by rows: the minor of the first r rows and a set of r columns follows from the minors of
/// the first r - 1 rows. Sets of columns are bit masks: 180 products for D = 6.
pub(super) fn normal_minors<const D: usize>(corners: &[&[f64; D]; D]) -> [WideInteger; D] {
    let mut minors = [WideInteger::ZERO; 64];
    minors[0] = WideInteger::ONE;
    for row in 1..D {
        let edge = grid_difference(corners[row], corners[0]);
        for columns in 1usize..1 << D {
            if columns.count_ones() as usize == row {
                minors[columns] = expand(&minors, columns, &edge);
            }
        }
    }
    let all = (1 << D) - 1;
    std::array::from_fn(|column| {
        let minor = minors[all & !(1 << column)];
        // Position of the last row and this column in the full matrix gives the cofactor's sign.
        if (D - 1 + column).is_multiple_of(2) {
            minor
        } else {
            minor.negate()
        }
    })
}

/// Expands along the last of `columns.count_ones()` rows, whose entries are `edge`.
fn expand<const D: usize>(
    minors: &[WideInteger; 64],
    columns: usize,
    edge: &[i64; D],
) -> WideInteger {
    let mut sum = WideInteger::ZERO;
    let mut sign_is_positive = columns.count_ones() % 2 == 1;
    for (column, &entry) in edge.iter().enumerate() {
        if columns >> column & 1 == 1 {
            let signed = if sign_is_positive { entry } else { -entry };
            sum = sum.add(&minors[columns & !(1 << column)].times(signed));
            sign_is_positive = !sign_is_positive;
        }
    }
    sum
}

/// On which side of the hyperplane through `corners` the point lies: 1 above, 0 on it, -1 below.
pub(super) fn side<const D: usize>(corners: &[&[f64; D]; D], point: &[f64; D]) -> i32 {
    let minors = normal_minors(corners);
    let step = grid_difference(point, corners[0]);
    let mut determinant = WideInteger::ZERO;
    for column in 0..D {
        determinant = determinant.add(&minors[column].times(step[column]));
    }
    determinant.signum()
}

#[cfg(test)]
mod tests {
    use super::super::hyperplane::{dot, hyperplane, hyperplane_of_minors};
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_single_grid_step_off_the_plane_is_seen() {
        let step = 1.0 / GRID;
        let a = [0.5, 0.25, -0.125];
        let b = [-0.75, 1.0, 0.5];
        let c = [1.0, -1.0, 0.25];
        // The midpoint of b and c lies on the plane exactly.
        let on: [f64; 3] = std::array::from_fn(|k| 0.5 * (b[k] + c[k]));
        let corners = [&a, &b, &c];
        assert_eq!(side(&corners, &on), 0);
        let normal = hyperplane(&corners).expect("a proper triangle").normal;
        let mut off = on;
        off[0] += step.copysign(normal[0]);
        assert_eq!(side(&corners, &off), 1);
        off[0] = on[0] - step.copysign(normal[0]);
        assert_eq!(side(&corners, &off), -1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn exact_and_rounded_hyperplanes_agree(raw in prop::array::uniform6(prop::array::uniform6(-1.0f64..1.0))) {
            let points = raw.map(|point| point.map(snap));
            let corners = points.each_ref();
            let rounded = hyperplane(&corners).expect("random points are independent");
            let scale = GRID.powi(5);
            let minors = normal_minors(&corners).map(|minor| minor.to_f64() / scale);
            let exact = hyperplane_of_minors(&minors, corners[0]);
            prop_assert!((exact.determinant / rounded.determinant - 1.0).abs() < 1e-9);
            prop_assert!(dot(&exact.normal, &rounded.normal) > 1.0 - 1e-9);
            for corner in corners {
                prop_assert_eq!(side(&corners, corner), 0);
            }
        }
    }
}
