//! One constraint with its Lagrange multiplier.

use graspd_settings::{FINITE, NOT_NEGATIVE};

use crate::{AdamSettings, Adamax, OptimizationError, Optimizer};

/// What is asked of a constrained value.
#[derive(Clone, Copy, Debug)]
enum Bound {
    EqualTo(f64),
    LessThan(f64),
}

/// How an inequality `value < limit`, with excess `h = value - limit`, becomes an infeasibility `g`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InequalityForm {
    /// `g = h + s` with a slack `s >= 0` that is eliminated: at every value it takes its best value
    /// `s = max(0, -h - lambda / damping)`, so that `g = max(h, -lambda / damping)`.
    ///
    /// The term is the augmented Lagrangian of inequalities; its derivative is continuous, the multiplier falls
    /// again where the constraint is not needed, and converges to the Karush-Kuhn-Tucker one. The recommended form.
    Slack,
    /// `g = max(h, 0)`: no effect at all where the constraint holds; at `h = 0` the derivative is 0.
    ///
    /// The multiplier never falls. It ends at or above the Karush-Kuhn-Tucker one, as the weight of an exact penalty,
    /// and the parameters settle at the limit only as finely as their step.
    Max,
}

/// A constraint on a scalar, with its Lagrange multiplier.
///
/// The Lagrangian of an objective `f` and constrained values `h_i(x)` with infeasibilities `g_i` is
///
/// ```text
/// L(x, lambda) = f(x) + sum_i (lambda_i g_i + damping_i g_i^2 / 2)
/// ```
///
/// `x` descends and `lambda` ascends along its derivatives, in the same step. The sign
/// convention: a value that is too large has `g > 0` and gets a positive multiplier, so that at the solution
/// `grad f + sum_i lambda_i grad h_i = 0`, and multipliers of inequalities are >= 0.
///
/// In each step the caller adds [`weight`](Self::weight)` * grad h` to the gradient of its objective and then calls
/// [`ascend`](Self::ascend).
///
/// ```
/// use graspd_opt::Constraint;
///
/// // Minimise x^2 subject to 1 - x < 0.
/// let mut constraint = Constraint::less_than(0.0).with_damping(1.0);
/// let mut x = 0.0;
/// for _ in 0..2000 {
///     let value = 1.0 - x;
///     let gradient = 2.0 * x + constraint.weight(value) * -1.0;
///     constraint.ascend(0.05, value);
///     x -= 0.05 * gradient;
/// }
/// assert!((x - 1.0).abs() < 1e-9 && (constraint.multiplier() - 2.0).abs() < 1e-9);
/// ```
///
/// A value of NaN gives a weight and, once ascended, a multiplier of NaN.
///
/// # Source
/// Platt and Barr, "Constrained differential optimization for neural networks", 1988: the basic differential
/// multiplier method with damping (there called the modified one). Eliminated slacks: Rockafellar, "The multiplier
/// method of Hestenes and Powell applied to convex programming", 1973.
#[derive(Clone, Debug)]
pub struct Constraint {
    bound: Bound,
    form: InequalityForm,
    damping: f64,
    multiplier: f64,
    /// Moments of the multiplier, if it moves by Adamax.
    adamax: Option<Adamax<f64>>,
}

impl Constraint {
    fn new(bound: Bound) -> Self {
        Self {
            bound,
            form: InequalityForm::Slack,
            damping: 1.0,
            multiplier: 0.0,
            adamax: None,
        }
    }
    /// value = target, with damping 1.
    pub fn equal_to(target: f64) -> Self {
        Self::new(Bound::EqualTo(target))
    }
    /// value < limit, with damping 1.
    pub fn less_than(limit: f64) -> Self {
        Self::new(Bound::LessThan(limit))
    }
    /// The same with another form; only inequalities look at it.
    pub fn with_form(mut self, form: InequalityForm) -> Self {
        self.form = form;
        self
    }
    /// The same with a multiplier that moves by Adamax, as if it were one more parameter with a negative rate:
    /// by about the rate, whatever the infeasibility's size.
    ///
    /// # Errors
    /// If a setting of Adamax is out of range.
    pub fn with_adamax(mut self, settings: AdamSettings) -> Result<Self, OptimizationError> {
        self.adamax = Some(Adamax::new(1, settings)?);
        Ok(self)
    }
    /// The same with another damping, >= 0. Paper: 1.0.
    ///
    /// Damping makes the dynamics settle instead of circling the solution; it does not move the solution.
    pub fn with_damping(mut self, damping: f64) -> Self {
        self.damping = damping;
        self
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// If the bound is not finite or the damping negative; the error names it.
    pub(crate) fn validate(&self) -> Result<(), OptimizationError> {
        match self.bound {
            Bound::EqualTo(target) => FINITE.check("constraint target", &target)?,
            Bound::LessThan(limit) => FINITE.check("constraint limit", &limit)?,
        }
        Ok(NOT_NEGATIVE.check("constraint damping", &self.damping)?)
    }

    /// lambda. The derivative of the optimal objective with respect to the bound is `-lambda`.
    pub fn multiplier(&self) -> f64 {
        self.multiplier
    }

    /// `g`, which the multiplier and the damping multiply. It is 0 at the solution.
    ///
    /// With eliminated slack also where the constraint is inactive and its multiplier 0, and only there:
    /// feasibility and complementarity at once.
    pub fn infeasibility(&self, value: f64) -> f64 {
        match self.bound {
            Bound::EqualTo(target) => value - target,
            Bound::LessThan(limit) => {
                let excess = value - limit;
                match self.form {
                    InequalityForm::Max => positive_part(excess),
                    InequalityForm::Slack => excess + self.best_slack(excess),
                }
            }
        }
    }

    /// The constraint's term in the Lagrangian: `lambda g + damping g^2 / 2`.
    pub fn term(&self, value: f64) -> f64 {
        let g = self.infeasibility(value);
        (self.multiplier + 0.5 * self.damping * g) * g
    }

    /// The derivative of the Lagrangian with respect to the value: `lambda + damping g`, and 0 where the form is flat.
    pub fn weight(&self, value: f64) -> f64 {
        match (self.bound, self.form) {
            (Bound::LessThan(limit), InequalityForm::Max) if value <= limit => 0.0,
            (Bound::LessThan(limit), InequalityForm::Slack) => {
                positive_part(self.multiplier + self.damping * (value - limit))
            }
            _ => self.multiplier + self.damping * self.infeasibility(value),
        }
    }

    /// Moves the multiplier up the Lagrangian's derivative at `value`: `lambda += rate g` or a step of Adamax, then
    /// clamped to `lambda >= 0` for inequalities.
    pub fn ascend(&mut self, rate: f64, value: f64) {
        let g = self.infeasibility(value);
        match &mut self.adamax {
            None => self.multiplier += rate * g,
            // It descends, so it is given the slope with its sign turned.
            Some(adamax) => adamax.step(rate, std::slice::from_mut(&mut self.multiplier), &[-g]),
        }
        if matches!(self.bound, Bound::LessThan(_)) {
            self.multiplier = positive_part(self.multiplier);
        }
    }

    /// The `s >= 0` that minimises `lambda (h + s) + damping (h + s)^2 / 2`.
    fn best_slack(&self, excess: f64) -> f64 {
        let pull = self.multiplier + self.damping * excess;
        if pull < 0.0 {
            // The derivative at s = 0 is negative, which takes damping > 0 or lambda < 0; the latter is ruled out.
            -pull / self.damping
        } else if self.multiplier == 0.0 && excess < 0.0 {
            // Without damping or multiplier any slack is best: take the one without infeasibility.
            -excess
        } else {
            0.0
        }
    }
}

/// max(x, 0), but NaN for NaN.
fn positive_part(x: f64) -> f64 {
    if x <= 0.0 { 0.0 } else { x }
}
