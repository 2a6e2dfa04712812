//! Numbers that change along a run: rates, radii, weights.

use graspd_settings::{AT_LEAST_ONE, FINITE, FRACTION};

use crate::OptimizationError;

/// A number as a function of the step: a base curve times any number of factors.
///
/// ```
/// use graspd_opt::Schedule;
///
/// # fn main() -> Result<(), graspd_opt::OptimizationError> {
/// // A radius that falls to 0 over the first 5000 steps and stays there.
/// let radius = Schedule::linear(0.09, 0.0, 0, 5000)?;
/// assert_eq!((radius.value(0), radius.value(2500), radius.value(6999)), (0.09, 0.045, 0.0));
/// // A rate that warms up over 200 steps and from step 5000 to 7000 falls to a hundredth.
/// let rate = Schedule::constant(3e-3)?.with_warm_up(200)?.with_exponential_decay(5000, 7000, 0.01)?;
/// assert_eq!(rate.value(1000), 3e-3);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    base: Curve,
    factors: Vec<Curve>,
}

impl Schedule {
    /// The same value at every step.
    ///
    /// # Errors
    /// If it is not finite.
    pub fn constant(value: f64) -> Result<Self, OptimizationError> {
        Self::linear(value, value, 0, 1)
    }

    /// `from` up to step `start`, then along a line to `to` at step `end`, and `to` from there on.
    ///
    /// # Errors
    /// If a value is not finite, or the span is empty.
    pub fn linear(from: f64, to: f64, start: usize, end: usize) -> Result<Self, OptimizationError> {
        FINITE.check("schedule value at the start", &from)?;
        FINITE.check("schedule value at the end", &to)?;
        Ok(Self {
            base: Curve::new("linear schedule", from, to, start, end, Shape::Linear)?,
            factors: Vec::new(),
        })
    }

    /// For defaults: a constant that is known to be valid.
    pub(crate) fn literal(value: f64) -> Self {
        Self {
            base: Curve {
                from: value,
                to: value,
                start: 0,
                end: 1,
                shape: Shape::Linear,
            },
            factors: Vec::new(),
        }
    }

    /// The same, rising linearly over the first `steps` steps: times `(step + 1) / steps`, at most 1.
    ///
    /// # Errors
    /// If `steps` is 0.
    pub fn with_warm_up(self, steps: usize) -> Result<Self, OptimizationError> {
        AT_LEAST_ONE.check("warm-up steps", &steps)?;
        if steps == 1 {
            return Ok(self);
        }
        let first = 1.0 / steps as f64;
        self.with_factor("warm-up", first, 0, steps - 1, Shape::Linear, 1.0)
    }

    /// The same, falling by the same ratio each step from step `start` on, to `final_factor` times itself at step
    /// `end`, and so from there on.
    ///
    /// # Errors
    /// If the span is empty or the factor not in (0, 1].
    pub fn with_exponential_decay(
        self,
        start: usize,
        end: usize,
        final_factor: f64,
    ) -> Result<Self, OptimizationError> {
        FRACTION
            .more_than(0.0)
            .check("final_factor", &final_factor)?;
        self.with_factor(
            "exponential decay",
            1.0,
            start,
            end,
            Shape::Exponential,
            final_factor,
        )
    }

    fn with_factor(
        mut self,
        field: &'static str,
        from: f64,
        start: usize,
        end: usize,
        shape: Shape,
        to: f64,
    ) -> Result<Self, OptimizationError> {
        self.factors
            .push(Curve::new(field, from, to, start, end, shape)?);
        Ok(self)
    }

    /// The value at a step, counted from 0.
    pub fn value(&self, step: usize) -> f64 {
        self.factors
            .iter()
            .fold(self.base.value(step), |value, factor| {
                value * factor.value(step)
            })
    }
}

/// How a curve goes from its first value to its last.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Linear,
    Exponential,
}

/// Constant, then changing over a span of steps, then constant.
#[derive(Clone, Debug, PartialEq)]
struct Curve {
    from: f64,
    to: f64,
    start: usize,
    end: usize,
    shape: Shape,
}

impl Curve {
    fn new(
        field: &'static str,
        from: f64,
        to: f64,
        start: usize,
        end: usize,
        shape: Shape,
    ) -> Result<Self, OptimizationError> {
        if end <= start {
            return Err(OptimizationError::EmptySpan { field, start, end });
        }
        Ok(Self {
            from,
            to,
            start,
            end,
            shape,
        })
    }

    fn value(&self, step: usize) -> f64 {
        if step <= self.start {
            return self.from;
        }
        if step >= self.end {
            return self.to;
        }
        let progress = (step - self.start) as f64 / (self.end - self.start) as f64;
        let remaining = match self.shape {
            Shape::Linear => 1.0 - progress,
            Shape::Exponential => return self.from * (self.to / self.from).powf(progress),
        };
        self.to + (self.from - self.to) * remaining
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few roundings of numbers of order one.
    const ROUNDING: f64 = 1e-14;

    fn constant() -> Schedule {
        Schedule::constant(2.0).unwrap()
    }
    fn assert_values(schedule: Result<Schedule, OptimizationError>, expected: &[(usize, f64)]) {
        let schedule = schedule.unwrap();
        for &(step, value) in expected {
            let error = (schedule.value(step) - value).abs();
            assert!(error < ROUNDING, "step {step}: {}", schedule.value(step));
        }
    }

    #[test]
    fn linear_is_constant_outside_its_span() {
        let expected = [
            (0, 3.0),
            (10, 3.0),
            (15, 1.0),
            (20, -1.0),
            (usize::MAX, -1.0),
        ];
        assert_values(Schedule::linear(3.0, -1.0, 10, 20), &expected);
    }

    #[test]
    fn warm_up_starts_above_zero_and_ends_at_the_full_value() {
        let expected = [(0, 0.01), (99, 1.0), (198, 1.99), (199, 2.0), (5000, 2.0)];
        assert_values(constant().with_warm_up(200), &expected);
        assert_values(constant().with_warm_up(1), &[(0, 2.0), (1, 2.0)]);
    }

    #[test]
    fn decays_meet_their_ends_and_midpoints() {
        let ends = [(0, 2.0), (100, 2.0), (300, 0.02), (1000, 0.02)];
        assert_values(constant().with_exponential_decay(100, 300, 0.01), &ends);
        let middle = |value: f64| [(200, value)];
        assert_values(
            constant().with_exponential_decay(100, 300, 0.01),
            &middle(0.2),
        );
    }

    #[test]
    fn factors_multiply() {
        let schedule = Schedule::linear(1.0, 0.5, 0, 100)
            .and_then(|schedule| schedule.with_warm_up(10))
            .and_then(|schedule| schedule.with_exponential_decay(50, 150, 0.01));
        assert_values(
            schedule,
            &[(4, 0.49), (50, 0.75), (100, 0.05), (150, 0.005)],
        );
    }

    #[test]
    fn faults_are_named() {
        let message = |result: Result<Schedule, OptimizationError>| result.unwrap_err().to_string();
        assert!(message(Schedule::constant(f64::NAN)).contains("schedule value"));
        assert!(message(Schedule::linear(1.0, f64::INFINITY, 0, 1)).contains("at the end"));
        assert!(message(Schedule::linear(1.0, 0.0, 7, 7)).contains("step 7 to step 7"));
        assert!(message(constant().with_warm_up(0)).contains("warm-up"));
        assert!(message(constant().with_exponential_decay(5, 4, 0.5)).contains("decay"));
        assert!(message(constant().with_exponential_decay(0, 5, 1.5)).contains("final_factor"));
        assert!(
            message(constant().with_exponential_decay(0, 5, f64::NAN)).contains("final_factor")
        );
        assert!(message(constant().with_exponential_decay(0, 5, 0.0)).contains("final_factor"));
    }
}
