//! One constraint with its Lagrange multiplier.

use graspd_settings::{FINITE, NOT_NEGATIVE, POSITIVE};

use crate::{Adamax, AdamaxSettings, OptimizationError, Optimizer};

/// What is asked of a constrained value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// value = target
    EqualTo(f64),
    /// value < limit
    LessThan(f64),
}

/// How an inequality `value < limit`, with excess `h = value - limit`, becomes an infeasibility `g`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum InequalityForm {
    /// `g = h + s` with a slack `s >= 0` that is eliminated: at every value it takes its best value
    /// `s = max(0, -h - lambda / damping)`, so that `g = max(h, -lambda / damping)`.
    ///
    /// The term is the augmented Lagrangian of inequalities; its derivative is continuous, the multiplier falls
    /// again where the constraint is not needed, and converges to the Karush-Kuhn-Tucker one. The recommended form.
    #[default]
    Slack,
    /// `g = h + s^2` with a slack variable `s` that descends with the parameters (Platt and Barr's form).
    ///
    /// `s = 0` is stationary, so a slack that has decayed grows again only slowly.
    SquaredSlack,
    /// `g = max(h, 0)`: no effect at all where the constraint holds; at `h = 0` the derivative is 0.
    ///
    /// The multiplier never falls. It ends at or above the Karush-Kuhn-Tucker one, as the weight of an exact penalty,
    /// and the parameters settle at the limit only as finely as their step.
    Max,
}

/// How multipliers (and slack variables) move along the derivative of the Lagrangian.
#[derive(Clone, Debug, PartialEq, Default)]
pub enum MultiplierUpdate {
    /// By the rate times the derivative, as Platt and Barr do.
    #[default]
    GradientAscent,
    /// By an Adamax step, as if the multiplier were one more parameter, with a negative rate. It moves by about
    /// the rate whatever the infeasibility's size.
    Adamax(AdamaxSettings),
}

/// A constraint on a scalar, with its Lagrange multiplier and slack.
///
/// The Lagrangian of an objective `f` and constrained values `h_i(x)` with infeasibilities `g_i` is
///
/// ```text
/// L(x, lambda) = f(x) + sum_i scale_i (lambda_i g_i + damping_i g_i^2 / 2)
/// ```
///
/// `x` (and slack variables) descend and `lambda` ascends along its derivatives, in the same step. The sign
/// convention: a value that is too large has `g > 0` and gets a positive multiplier, so that at the solution
/// `grad f + sum_i scale_i lambda_i grad h_i = 0`, and multipliers of inequalities are >= 0.
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
    scale: f64,
    damping: f64,
    multiplier: f64,
    slack: Option<f64>,
    /// Moments of (multiplier, slack), if these move by Adamax.
    adamax: Option<Adamax<f64>>,
}

impl Constraint {
    /// The constraint `bound` with damping 1, scale 1, the default form and gradient ascent.
    pub fn new(bound: Bound) -> Self {
        Self {
            bound,
            form: InequalityForm::default(),
            scale: 1.0,
            damping: 1.0,
            multiplier: 0.0,
            slack: None,
            adamax: None,
        }
    }
    /// value = target
    pub fn equal_to(target: f64) -> Self {
        Self::new(Bound::EqualTo(target))
    }
    /// value < limit
    pub fn less_than(limit: f64) -> Self {
        Self::new(Bound::LessThan(limit))
    }
    /// The same with another form; only inequalities look at it.
    pub fn with_form(mut self, form: InequalityForm) -> Self {
        self.form = form;
        self
    }
    /// The same with another damping, >= 0. Paper: 1.0.
    ///
    /// Damping makes the dynamics settle instead of circling the solution; it does not move the solution.
    pub fn with_damping(mut self, damping: f64) -> Self {
        self.damping = damping;
        self
    }
    /// The same with another scale, > 0: the weight of the constraint's whole term in the Lagrangian.
    pub fn with_scale(mut self, scale: f64) -> Self {
        self.scale = scale;
        self
    }
    /// The same with another way of moving the multiplier, which starts at 0 again.
    ///
    /// # Errors
    /// If a setting of Adamax is out of range.
    pub fn with_update(mut self, update: MultiplierUpdate) -> Result<Self, OptimizationError> {
        self.adamax = match update {
            MultiplierUpdate::GradientAscent => None,
            MultiplierUpdate::Adamax(settings) => Some(Adamax::new(2, settings)?),
        };
        self.reset();
        Ok(self)
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// If the bound is not finite, the damping negative or the scale not positive; the error names it.
    pub fn validate(&self) -> Result<(), OptimizationError> {
        match self.bound {
            Bound::EqualTo(target) => FINITE.check("constraint target", &target)?,
            Bound::LessThan(limit) => FINITE.check("constraint limit", &limit)?,
        }
        POSITIVE.check("constraint scale", &self.scale)?;
        Ok(NOT_NEGATIVE.check("constraint damping", &self.damping)?)
    }

    /// Forgets the multiplier and the slack: as if newly made.
    pub fn reset(&mut self) {
        self.multiplier = 0.0;
        self.slack = None;
        if let Some(adamax) = &mut self.adamax {
            adamax.reset();
        }
    }
    /// What is asked of the value.
    pub fn bound(&self) -> Bound {
        self.bound
    }
    /// lambda. The derivative of the optimal objective with respect to the bound is `-scale * lambda`.
    pub fn multiplier(&self) -> f64 {
        self.multiplier
    }
    /// The slack `s` as of the last [`ascend`](Self::ascend); `None` before it, and for forms without one.
    pub fn slack(&self) -> Option<f64> {
        self.slack
    }

    /// By how much the value violates the constraint: `|h|` or `max(h, 0)`, whatever the form.
    pub fn violation(&self, value: f64) -> f64 {
        match self.bound {
            Bound::EqualTo(target) => (value - target).abs(),
            Bound::LessThan(limit) => positive_part(value - limit),
        }
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
                    InequalityForm::SquaredSlack => excess + self.squared_slack(excess).powi(2),
                }
            }
        }
    }

    /// The constraint's term in the Lagrangian: `scale (lambda g + damping g^2 / 2)`.
    pub fn term(&self, value: f64) -> f64 {
        let g = self.infeasibility(value);
        self.scale * (self.multiplier + 0.5 * self.damping * g) * g
    }

    /// The derivative of the Lagrangian with respect to the value: `scale (lambda + damping g)`, and 0 where the
    /// form is flat.
    pub fn weight(&self, value: f64) -> f64 {
        match (self.bound, self.form) {
            (Bound::LessThan(limit), InequalityForm::Max) if value <= limit => 0.0,
            (Bound::LessThan(limit), InequalityForm::Slack) => {
                self.scale * positive_part(self.multiplier + self.damping * (value - limit))
            }
            _ => self.scale * (self.multiplier + self.damping * self.infeasibility(value)),
        }
    }

    /// Moves the multiplier up (and a slack variable down) the Lagrangian's derivatives at `value`: for gradient
    /// ascent `lambda += rate scale g`, then clamped to `lambda >= 0` for inequalities.
    pub fn ascend(&mut self, rate: f64, value: f64) {
        let g = self.infeasibility(value);
        let multiplier_slope = self.scale * g;
        let mut slack_slope = 0.0;
        if let Bound::LessThan(limit) = self.bound {
            let excess = value - limit;
            match self.form {
                InequalityForm::Max => {}
                InequalityForm::Slack => self.slack = Some(self.best_slack(excess)),
                InequalityForm::SquaredSlack => {
                    let slack = self.squared_slack(excess);
                    self.slack = Some(slack);
                    slack_slope = 2.0 * slack * self.weight(value);
                }
            }
        }
        // In the order (multiplier, slack). Adamax descends, so it is given the multiplier's slope with its sign
        // turned.
        let mut change = [rate * multiplier_slope, -rate * slack_slope];
        if let Some(adamax) = &mut self.adamax {
            adamax.update(rate, &[-multiplier_slope, slack_slope], &mut change);
        }
        self.multiplier += change[0];
        if matches!(self.bound, Bound::LessThan(_)) {
            self.multiplier = positive_part(self.multiplier);
            if self.form == InequalityForm::SquaredSlack {
                self.slack = self.slack.map(|slack| slack + change[1]);
            }
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

    /// The slack variable, or before the first step the one that makes the constraint hold.
    fn squared_slack(&self, excess: f64) -> f64 {
        // A slack of exactly 0 could never grow again, and the inequality would be an equality.
        const SMALLEST_SHARE: f64 = 1e-6;
        const SMALLEST: f64 = 1e-12;
        self.slack.unwrap_or_else(|| {
            let smallest = SMALLEST + SMALLEST_SHARE * excess.abs();
            (-excess).max(smallest).sqrt()
        })
    }
}

/// max(x, 0), but NaN for NaN.
fn positive_part(x: f64) -> f64 {
    if x <= 0.0 { 0.0 } else { x }
}
