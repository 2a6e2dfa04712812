//! What first-order optimisers have in common.

use std::ops::Range;

use graspd_ad::{Element, Real};
use graspd_settings::{FRACTION, POSITIVE, Ranges, Validate, ranges};

use crate::OptimizationError;

/// Consecutive parameters that share a learning rate.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterGroup {
    /// Which parameters.
    pub range: Range<usize>,
    /// Their learning rate.
    pub rate: f64,
}

/// Settings of [`Adam`](crate::Adam) and [`Adamax`](crate::Adamax).
#[derive(Clone, Debug, PartialEq)]
pub struct AdamSettings {
    /// Decay of the mean of the gradient, in [0, 1). Paper: 0.9.
    pub beta1: f64,
    /// Decay of the mean of the squared gradient (Adamax: of the largest gradient magnitude), in [0, 1). Paper: 0.999.
    pub beta2: f64,
    /// Added to the gradient's magnitude, so that no division is by zero; positive.
    pub epsilon: f64,
}

impl Default for AdamSettings {
    fn default() -> Self {
        Self {
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
        }
    }
}

impl Validate for AdamSettings {
    fn ranges(&self) -> Ranges {
        let decay = FRACTION.less_than(1.0);
        ranges! { self => beta1: decay, beta2: decay, epsilon: POSITIVE }
    }
}

impl AdamSettings {
    /// Checks the settings, and that epsilon is not 0 once it is rounded to an `E`.
    pub(crate) fn check<E: Element>(&self) -> Result<(), OptimizationError> {
        self.validate()?;
        let rounded = E::constant(self.epsilon).lane(0);
        Ok(POSITIVE.check("epsilon (rounded to the parameters' type)", &rounded)?)
    }
}

/// A first-order optimiser with its state, over a flat slice of parameters.
///
/// One call is one iteration: moments are updated from the gradient, then the parameters move *against* it. No call
/// allocates. A NaN in the gradient makes the update of its own coordinate NaN and is never hidden.
///
/// # Panics
/// All functions panic if a slice's length differs from the optimiser's, or if groups overlap, are out of order or
/// reach past the end: these are errors of the calling code, not of its input.
pub trait Optimizer<E: Element>: Send {
    /// Moves the parameters, those of each group at the group's rate.
    ///
    /// Parameters in no group do not move, and their moments stay as they are. Groups must be in ascending order.
    fn step_groups(&mut self, groups: &[ParameterGroup], parameters: &mut [E], gradient: &[E]);

    /// Writes by how much [`Optimizer::step_groups`] would move the parameters, for those that live on a manifold: a
    /// rotation is moved by the exponential map of its update.
    ///
    /// The update of parameters in no group is set to 0.
    fn update_groups(&mut self, groups: &[ParameterGroup], gradient: &[E], update: &mut [E]) {
        update.fill(E::zero());
        self.step_groups(groups, update, gradient);
    }

    /// Moves all parameters at one rate.
    fn step(&mut self, rate: f64, parameters: &mut [E], gradient: &[E]) {
        let range = 0..parameters.len();
        self.step_groups(&[ParameterGroup { range, rate }], parameters, gradient);
    }
}

/// Checks that groups are in order, disjoint and within `len`, and that the slices are `len` long.
pub(crate) fn check_lengths(
    len: usize,
    groups: &[ParameterGroup],
    gradient_len: usize,
    parameters_len: usize,
) {
    assert_eq!(gradient_len, len, "length of the gradient");
    assert_eq!(parameters_len, len, "length of the parameters");
    let mut end = 0;
    for group in groups {
        let Range { start, end: stop } = group.range;
        assert!(
            end <= start && start <= stop && stop <= len,
            "parameter group {start}..{stop} of {len} parameters overlaps, is out of order or too long"
        );
        end = stop;
    }
}

/// Magnitudes below this count as zero in the moments.
///
/// Moments decay geometrically once a gradient vanishes; left alone they would pass through the denormal
/// numbers, on which x86 processors compute some twenty times slower. The margin of one machine epsilon above
/// the smallest normal number keeps the products formed from a moment normal too.
pub(crate) fn smallest_moment<E: Element>() -> E {
    E::min_positive_value() / E::epsilon()
}

/// `value`, or 0 where its magnitude is below `smallest`. NaN stays NaN.
#[inline(always)]
pub(crate) fn flush<T: Real>(value: T, smallest: T) -> T {
    T::select(value.abs().lt(smallest), T::zero(), value)
}

/// beta^t, kept by one multiplication an iteration.
#[derive(Clone, Debug)]
pub(crate) struct DecayPower {
    beta: f64,
    power: f64,
}

impl DecayPower {
    pub(crate) fn new(beta: f64) -> Self {
        Self { beta, power: 1.0 }
    }
    /// Goes on to the next iteration and returns the bias correction 1 - beta^t.
    pub(crate) fn advance(&mut self) -> f64 {
        // Below this the correction is exactly 1; going on would end in denormals.
        const NEGLIGIBLE: f64 = f64::EPSILON / 8.0;
        self.power = flush(self.power * self.beta, NEGLIGIBLE);
        1.0 - self.power
    }
}
