//! Comparison of claimed derivatives with central differences, for tests.

use std::fmt;

use crate::{Dual, Function, gradient};

/// How many roundings of its values a difference quotient may suffer: one in each of four values, and those inside
/// the function.
const ROUNDINGS: f64 = 16.0;

/// How a claimed derivative compares with the numeric one, at the entry where they differ most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivativeError {
    /// The output that the entry belongs to; 0 for a gradient.
    pub output: usize,
    /// The variable that the entry belongs to.
    pub index: usize,
    /// The derivative under test.
    pub claimed: f64,
    /// The derivative by central differences.
    pub numeric: f64,
    /// Their distance, beyond what the rounding of the function's values explains, relative to the larger of the
    /// two (see [`Checker::floor`]); infinite if one is NaN.
    pub error: f64,
}

impl fmt::Display for DerivativeError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            output,
            index,
            claimed,
            numeric,
            error,
        } = self;
        write!(
            formatter,
            "derivative of output {output} by variable {index}: claimed {claimed:e}, numeric {numeric:e} \
             (relative error {error:e})"
        )
    }
}

/// Compares derivatives with central differences.
///
/// ```
/// use graspd_ad::check::Checker;
///
/// let f = |x: &[f64]| x[0] * x[0] * x[1];
/// let checker = Checker::default();
/// assert!(checker.gradient(f, &[2.0, 3.0], &[12.0, 4.0]).error < 1e-9);
/// let wrong = checker.gradient(f, &[2.0, 3.0], &[12.0, 5.0]);
/// assert_eq!(wrong.index, 1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Checker {
    /// Half width of the differences, in the unit of the variables. It must stay well below the distance to the
    /// next kink; for a smooth function at scale 1 the default leaves an error of about 1e-12.
    pub step: f64,
    /// Entries smaller than this part of the largest entry are compared with that part instead of with
    /// themselves, since differences cannot resolve them.
    pub floor: f64,
}

impl Default for Checker {
    fn default() -> Self {
        Self {
            step: 1e-3,
            floor: 1e-3,
        }
    }
}

impl Checker {
    /// Derivative of a function of one variable at 0, such as one along a path: the central differences with the
    /// step and with half of it, extrapolated to step 0, so that the error falls with its fourth power.
    pub fn derivative(&self, mut function: impl FnMut(f64) -> f64) -> f64 {
        let mut difference = |step: f64| (function(step) - function(-step)) / (2.0 * step);
        let (wide, narrow) = (difference(self.step), difference(self.step / 2.0));
        (4.0 * narrow - wide) / 3.0
    }

    /// The worst entry of a gradient that is claimed for a function at `x`.
    pub fn gradient(
        &self,
        mut function: impl FnMut(&[f64]) -> f64,
        x: &[f64],
        claimed: &[f64],
    ) -> DerivativeError {
        self.jacobian(|x| vec![function(x)], x, &[claimed])
    }

    /// The worst entry of a Jacobian that is claimed for a function at `x`; row `i` belongs to output `i`.
    ///
    /// # Panics
    /// If the Jacobian has not one row for each output and one column for each variable.
    pub fn jacobian(
        &self,
        mut function: impl FnMut(&[f64]) -> Vec<f64>,
        x: &[f64],
        claimed: &[impl AsRef<[f64]>],
    ) -> DerivativeError {
        let outputs = function(x).len();
        assert_eq!(
            claimed.len(),
            outputs,
            "one row of the Jacobian for each output"
        );
        let mut numeric = vec![vec![0.0; x.len()]; outputs];
        let mut largest = vec![0.0_f64; outputs];
        let mut moved = x.to_vec();
        for index in 0..x.len() {
            let mut difference = |step: f64| -> Vec<f64> {
                moved[index] = x[index] + step;
                let ahead = function(&moved);
                moved[index] = x[index] - step;
                let behind = function(&moved);
                moved[index] = x[index];
                for output in 0..outputs {
                    let size = ahead[output].abs().max(behind[output].abs());
                    largest[output] = largest[output].max(size);
                }
                ahead
                    .iter()
                    .zip(&behind)
                    .map(|(a, b)| (a - b) / (2.0 * step))
                    .collect()
            };
            let (wide, narrow) = (difference(self.step), difference(self.step / 2.0));
            for output in 0..outputs {
                numeric[output][index] = (4.0 * narrow[output] - wide[output]) / 3.0;
            }
        }
        let rounding: Vec<f64> = largest
            .iter()
            .map(|value| ROUNDINGS * f64::EPSILON * value / self.step)
            .collect();
        self.compare(claimed, &numeric, &rounding)
    }

    /// The worst entry of the gradient of a generic function, by reverse and by forward mode.
    pub fn function(&self, function: &impl Function, x: &[f64]) -> DerivativeError {
        let value = |x: &[f64]| function.call(x);
        let (_, reverse) = gradient(|x| function.call(x), x);
        let forward: Vec<f64> = (0..x.len())
            .map(|index| {
                let mut point: Vec<Dual<f64, 1>> = x.iter().map(|&x| Dual::constant(x)).collect();
                point[index].derivative[0] = 1.0;
                function.call(&point).derivative[0]
            })
            .collect();
        let by_reverse = self.gradient(value, x, &reverse);
        let by_forward = self.gradient(value, x, &forward);
        if by_forward.error > by_reverse.error {
            by_forward
        } else {
            by_reverse
        }
    }

    fn compare(
        &self,
        claimed: &[impl AsRef<[f64]>],
        numeric: &[Vec<f64>],
        rounding: &[f64],
    ) -> DerivativeError {
        let all = claimed
            .iter()
            .flat_map(|row| row.as_ref())
            .chain(numeric.iter().flatten());
        let largest = all.fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
        let mut worst = DerivativeError {
            output: 0,
            index: 0,
            claimed: 0.0,
            numeric: 0.0,
            error: 0.0,
        };
        for (output, (claimed, numeric)) in claimed.iter().zip(numeric).enumerate() {
            let claimed = claimed.as_ref();
            assert_eq!(
                claimed.len(),
                numeric.len(),
                "one derivative for each variable"
            );
            for (index, (&claimed, &numeric)) in claimed.iter().zip(numeric).enumerate() {
                let scale = claimed.abs().max(numeric.abs()).max(self.floor * largest);
                let distance = (claimed - numeric).abs();
                let error = if distance.is_nan() {
                    f64::INFINITY
                } else if distance <= rounding[output] {
                    0.0
                } else {
                    (distance - rounding[output]) / scale
                };
                if error > worst.error || (output, index) == (0, 0) {
                    worst = DerivativeError {
                        output,
                        index,
                        claimed,
                        numeric,
                        error,
                    };
                }
            }
        }
        worst
    }
}

/// Asserts that a claimed gradient agrees with central differences, with the default [`Checker`].
///
/// # Panics
/// If the worst relative error is above `tolerance`.
#[track_caller]
pub fn assert_gradient(
    function: impl FnMut(&[f64]) -> f64,
    x: &[f64],
    claimed: &[f64],
    tolerance: f64,
) {
    let worst = Checker::default().gradient(function, x, claimed);
    assert!(worst.error <= tolerance, "{worst}, at {x:?}");
}

/// Asserts that forward and reverse mode of a generic function agree with central differences, with the default
/// [`Checker`].
///
/// # Panics
/// If the worst relative error is above `tolerance`.
#[track_caller]
pub fn assert_function(function: &impl Function, x: &[f64], tolerance: f64) {
    let worst = Checker::default().function(function, x);
    assert!(worst.error <= tolerance, "{worst}, at {x:?}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Real;

    struct Product;
    impl Function for Product {
        fn call<T: Real>(&self, x: &[T]) -> T {
            x[0] * x[1].sin() + x[2].exp()
        }
    }

    #[test]
    fn right_derivatives_pass_closely() {
        assert_function(&Product, &[1.5, 0.7, -0.3], 1e-10);
    }

    #[test]
    fn the_wrong_entry_is_named() {
        let function = |x: &[f64]| vec![x[0] * x[1], x[0] + x[1]];
        let worst = Checker::default().jacobian(function, &[2.0, 3.0], &[[3.0, 2.0], [1.0, 1.5]]);
        assert_eq!((worst.output, worst.index, worst.claimed), (1, 1, 1.5));
        assert!((worst.error - 1.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn nan_is_the_worst_error() {
        let worst = Checker::default().gradient(|x| x[0] + x[1], &[1.0, 1.0], &[1.0, f64::NAN]);
        assert_eq!((worst.index, worst.error), (1, f64::INFINITY));
    }

    #[test]
    fn noise_at_a_stationary_point_is_no_error() {
        let worst = Checker::default().gradient(|x| 1.0 + x[0].cos(), &[0.0], &[1e-17]);
        assert_eq!(worst.error, 0.0);
    }

    #[test]
    fn tiny_entries_are_compared_with_the_largest() {
        let function = |x: &[f64]| 1e6 * x[0] + 1e-12 * x[1];
        let worst = Checker::default().gradient(function, &[1.0, 1.0], &[1e6, 0.0]);
        assert!(worst.error < 1e-9, "{worst}");
    }
}
