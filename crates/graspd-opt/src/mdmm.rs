//! The differential method of multipliers as a ready-made solver.

use graspd_settings::{FINITE, NOT_NEGATIVE, POSITIVE, Ranges, Validate, ranges};

use crate::{Constraint, OptimizationError, Schedule};

/// A differentiable function: returns its value at the first argument and writes its gradient to the second.
///
/// The gradient holds arbitrary numbers on entry.
pub trait ValueAndGradient: FnMut(&[f64], &mut [f64]) -> f64 {}
impl<F: FnMut(&[f64], &mut [f64]) -> f64> ValueAndGradient for F {}

/// Settings of [`Mdmm`].
#[derive(Clone, Debug, PartialEq)]
pub struct MdmmSettings {
    /// Rate of the parameters at each step.
    pub rate: Schedule,
    /// Rate of the multipliers relative to that of the parameters; positive.
    pub multiplier_rate_ratio: f64,
    /// Most steps to take.
    pub max_steps: usize,
    /// Stop once no derivative of the Lagrangian and no infeasibility exceeds this; not negative.
    pub tolerance: f64,
}

impl Default for MdmmSettings {
    /// A rate of 0.02, for problems whose derivatives are of order one.
    fn default() -> Self {
        Self {
            rate: Schedule::literal(0.02),
            multiplier_rate_ratio: 1.0,
            max_steps: 50_000,
            tolerance: 1e-8,
        }
    }
}

impl Validate for MdmmSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self => multiplier_rate_ratio: POSITIVE, tolerance: NOT_NEGATIVE }
    }
}

/// How a minimisation ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Stationarity and infeasibility are within the tolerance.
    Converged,
    /// The steps ran out first.
    StepLimit,
    /// A value or a gradient was infinite or NaN: the rate is too high, or a function is undefined there.
    NotFinite,
}

/// Where a minimisation ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The parameters; with [`Status::NotFinite`] those at which a function failed.
    pub x: Vec<f64>,
    /// The objective at `x`.
    pub value: f64,
    /// The multipliers, in the order of the constraints.
    pub multipliers: Vec<f64>,
    /// The largest magnitude of the Lagrangian's derivatives with respect to the parameters at `x`.
    pub stationarity: f64,
    /// The largest magnitude of an infeasibility at `x`.
    pub infeasibility: f64,
    /// How many steps were taken.
    pub steps: usize,
    /// Why it ended.
    pub status: Status,
}

/// A constrained minimisation by the differential method of multipliers.
///
/// Every step evaluates the objective and the constrained values with their gradients, then moves the
/// parameters down and the multipliers up the Lagrangian (see [`Constraint`]) at once, each by a rate times its
/// derivative.
pub struct Mdmm<'a> {
    settings: MdmmSettings,
    constraints: Vec<(Constraint, Box<dyn ValueAndGradient + 'a>)>,
}

impl<'a> Mdmm<'a> {
    /// A minimisation without constraints as yet.
    ///
    /// # Errors
    /// If a setting is out of range.
    pub fn new(settings: MdmmSettings) -> Result<Self, OptimizationError> {
        settings.validate()?;
        Ok(Self {
            settings,
            constraints: Vec::new(),
        })
    }

    /// The same with one more constraint, on the value of `function`.
    ///
    /// # Errors
    /// If a number of the constraint is out of range.
    pub fn subject_to(
        mut self,
        constraint: Constraint,
        function: impl ValueAndGradient + 'a,
    ) -> Result<Self, OptimizationError> {
        constraint.validate()?;
        self.constraints.push((constraint, Box::new(function)));
        Ok(self)
    }

    /// Minimises `objective` from `start`.
    ///
    /// # Errors
    /// If `start` is empty or not finite. Not converging is a
    /// [`Status`], no error.
    pub fn minimize(
        mut self,
        start: &[f64],
        mut objective: impl ValueAndGradient,
    ) -> Result<Outcome, OptimizationError> {
        if start.is_empty() {
            return Err(OptimizationError::Empty { field: "start" });
        }
        FINITE.check("start", start)?;
        let mut x = start.to_vec();
        let mut gradient = vec![0.0; x.len()];
        let mut constraint_gradient = vec![0.0; x.len()];
        let mut values = vec![0.0; self.constraints.len()];

        let mut steps = 0;
        let (value, stationarity, infeasibility, status) = loop {
            let value = objective(&x, &mut gradient);
            let mut infeasibility = 0.0;
            for ((constraint, function), stored) in self.constraints.iter_mut().zip(&mut values) {
                let value = function(&x, &mut constraint_gradient);
                add_scaled(
                    &mut gradient,
                    constraint.weight(value),
                    &constraint_gradient,
                );
                infeasibility = larger(infeasibility, constraint.infeasibility(value).abs());
                *stored = value;
            }
            let stationarity = gradient.iter().fold(0.0, |a, g| larger(a, g.abs()));

            let is_finite = (value + stationarity + infeasibility).is_finite();
            let is_optimal = larger(stationarity, infeasibility) <= self.settings.tolerance;
            let status = match (is_finite, is_optimal, steps < self.settings.max_steps) {
                (false, _, _) => Some(Status::NotFinite),
                (true, true, _) => Some(Status::Converged),
                (true, false, false) => Some(Status::StepLimit),
                (true, false, true) => None,
            };
            if let Some(status) = status {
                break (value, stationarity, infeasibility, status);
            }

            let rate = self.settings.rate.value(steps);
            add_scaled(&mut x, -rate, &gradient);
            for ((constraint, _), &value) in self.constraints.iter_mut().zip(&values) {
                constraint.ascend(rate * self.settings.multiplier_rate_ratio, value);
            }
            steps += 1;
        };
        Ok(Outcome {
            x,
            value,
            multipliers: self
                .constraints
                .iter()
                .map(|(constraint, _)| constraint.multiplier())
                .collect(),
            stationarity,
            infeasibility,
            steps,
            status,
        })
    }
}

/// `sum += factor * addend`
fn add_scaled(sum: &mut [f64], factor: f64, addend: &[f64]) {
    for (sum, &addend) in sum.iter_mut().zip(addend) {
        *sum += factor * addend;
    }
}

/// The larger of the two, NaN if either is.
fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}
