//! Derivatives of whole functions, each in one call.
//!
//! A closure cannot be generic, so each of these takes one over the scalar that it runs on. Call a generic
//! function from it: `gradient(|x| rosenbrock(x), &point)`.

use std::fmt;

use crate::{Dual, Real, Tape, Var};

/// A function that is generic over its scalar, for code that runs it on several.
pub trait Function {
    /// The value at `x`.
    fn call<T: Real>(&self, x: &[T]) -> T;
}

/// The number of cotangents or tangents is not that of the outputs or inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LengthMismatch {
    /// How many the function has.
    pub expected: usize,
    /// How many were given.
    pub found: usize,
}

impl fmt::Display for LengthMismatch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { expected, found } = self;
        write!(
            formatter,
            "{found} entries were given for a vector of {expected}: give one for each"
        )
    }
}

impl std::error::Error for LengthMismatch {}

impl LengthMismatch {
    fn check(expected: usize, found: usize) -> Result<(), Self> {
        if expected == found {
            Ok(())
        } else {
            Err(Self { expected, found })
        }
    }
}

/// Value and gradient of a function of many variables, by reverse mode: the cost does not grow with their number.
///
/// For repeated calls without allocation, keep a [`Tape`].
///
/// ```
/// let (value, gradient) = graspd_ad::gradient(|x| x[0] * x[1] + x[2], &[2.0, 3.0, 4.0]);
/// assert_eq!(value, 10.0);
/// assert_eq!(gradient, [3.0, 2.0, 1.0]);
/// ```
pub fn gradient(
    function: impl for<'t> FnOnce(&[Var<'t>]) -> Var<'t>,
    x: &[f64],
) -> (f64, Vec<f64>) {
    Tape::new().scope(|recording| {
        let x = recording.variables(x);
        let output = function(&x);
        (output.value(), recording.adjoints(output).of_all(&x))
    })
}

/// Value and gradient of a function of few variables, by forward mode: no allocation.
///
/// ```
/// use graspd_ad::Real;
///
/// let (value, gradient) = graspd_ad::gradient_forward(|[x, y]| x * y.square(), [2.0, 3.0]);
/// assert_eq!(value, 18.0);
/// assert_eq!(gradient, [9.0, 12.0]);
/// ```
pub fn gradient_forward<const N: usize>(
    function: impl FnOnce([Dual<f64, N>; N]) -> Dual<f64, N>,
    x: [f64; N],
) -> (f64, [f64; N]) {
    let Dual { value, derivative } = function(Dual::variables(x));
    (value, derivative)
}

/// Values and Jacobian of a function with several outputs, by reverse mode: row `i` is the gradient of output `i`.
///
/// ```
/// let (values, rows) = graspd_ad::jacobian(|x| vec![x[0] * x[1], x[0] - x[1]], &[2.0, 3.0]);
/// assert_eq!(values, [6.0, -1.0]);
/// assert_eq!(rows, [[3.0, 2.0], [1.0, -1.0]]);
/// ```
pub fn jacobian(
    function: impl for<'t> FnOnce(&[Var<'t>]) -> Vec<Var<'t>>,
    x: &[f64],
) -> (Vec<f64>, Vec<Vec<f64>>) {
    Tape::new().scope(|recording| {
        let x = recording.variables(x);
        let outputs = function(&x);
        let rows = outputs
            .iter()
            .map(|&output| recording.adjoints(output).of_all(&x));
        (values(&outputs), rows.collect())
    })
}

/// Values, and the product of a cotangent with the Jacobian, `cotangent^T J`, by one sweep of reverse mode.
///
/// # Errors
/// If there is not one cotangent for each output.
///
/// ```
/// let (values, pulled) = graspd_ad::vjp(|x| vec![x[0] * x[1], x[0] - x[1]], &[2.0, 3.0], &[1.0, 10.0])?;
/// assert_eq!(values, [6.0, -1.0]);
/// assert_eq!(pulled, [13.0, -8.0]);
/// # Ok::<(), graspd_ad::LengthMismatch>(())
/// ```
pub fn vjp(
    function: impl for<'t> FnOnce(&[Var<'t>]) -> Vec<Var<'t>>,
    x: &[f64],
    cotangent: &[f64],
) -> Result<(Vec<f64>, Vec<f64>), LengthMismatch> {
    Tape::new().scope(|recording| {
        let x = recording.variables(x);
        let outputs = function(&x);
        LengthMismatch::check(outputs.len(), cotangent.len())?;
        let weighted = outputs.iter().copied().zip(cotangent.iter().copied());
        Ok((values(&outputs), recording.adjoints_of(weighted).of_all(&x)))
    })
}

/// Values, and the product of the Jacobian with a tangent, `J tangent`, by one run of forward mode.
///
/// # Errors
/// If there is not one tangent entry for each variable.
///
/// ```
/// let (values, pushed) = graspd_ad::jvp(|x| vec![x[0] * x[1], x[0] - x[1]], &[2.0, 3.0], &[1.0, 10.0])?;
/// assert_eq!(values, [6.0, -1.0]);
/// assert_eq!(pushed, [23.0, -9.0]);
/// # Ok::<(), graspd_ad::LengthMismatch>(())
/// ```
pub fn jvp(
    function: impl FnOnce(&[Dual<f64, 1>]) -> Vec<Dual<f64, 1>>,
    x: &[f64],
    tangent: &[f64],
) -> Result<(Vec<f64>, Vec<f64>), LengthMismatch> {
    LengthMismatch::check(x.len(), tangent.len())?;
    let x: Vec<_> = x
        .iter()
        .zip(tangent)
        .map(|(&x, &tangent)| Dual::new(x, [tangent]))
        .collect();
    Ok(function(&x)
        .iter()
        .map(|output| (output.value, output.derivative[0]))
        .unzip())
}

/// How many columns of a Hessian one run computes.
const HESSIAN_COLUMNS: usize = 4;

/// The scalar of [`hessian`]: reverse mode over duals.
pub type HessianVar<'t> = Var<'t, Dual<f64, HESSIAN_COLUMNS>>;

/// Value, gradient and Hessian (by rows), by forward over reverse mode.
///
/// ```
/// let (value, gradient, rows) = graspd_ad::hessian(|x| x[0] * x[0] * x[1], &[2.0, 3.0]);
/// assert_eq!(value, 12.0);
/// assert_eq!(gradient, [12.0, 4.0]);
/// assert_eq!(rows, [[6.0, 4.0], [4.0, 0.0]]);
/// ```
pub fn hessian(
    function: impl for<'t> Fn(&[HessianVar<'t>]) -> HessianVar<'t>,
    x: &[f64],
) -> (f64, Vec<f64>, Vec<Vec<f64>>) {
    let mut tape = Tape::new();
    let mut value = 0.0;
    let mut gradient = vec![0.0; x.len()];
    let mut rows = vec![vec![0.0; x.len()]; x.len()];
    for first in (0..x.len().max(1)).step_by(HESSIAN_COLUMNS) {
        let columns = first..x.len().min(first + HESSIAN_COLUMNS);
        tape.scope(|recording| {
            let mut point: Vec<_> = x.iter().map(|&x| Dual::constant(x)).collect();
            for column in columns.clone() {
                point[column].derivative[column - first] = 1.0;
            }
            let x = recording.variables(&point);
            let output = function(&x);
            value = output.value().value;
            let adjoints = recording.adjoints(output);
            for (row, &x) in x.iter().enumerate() {
                let adjoint = adjoints.of(x);
                gradient[row] = adjoint.value;
                for column in columns.clone() {
                    rows[row][column] = adjoint.derivative[column - first];
                }
            }
        });
    }
    (value, gradient, rows)
}

fn values(outputs: &[Var<'_>]) -> Vec<f64> {
    outputs.iter().map(|output| output.value()).collect()
}
