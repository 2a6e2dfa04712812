//! What first-order optimisers have in common.

use std::ops::Range;

use graspd_ad::{Element, Real};

use crate::{Adam, AdamSettings, Adamax, AdamaxSettings, GradientDescent, OptimizationError};

/// Consecutive parameters that share a learning rate.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterGroup {
    /// Which parameters.
    pub range: Range<usize>,
    /// Their learning rate.
    pub rate: f64,
}

/// A first-order optimiser with its state, over a flat slice of parameters.
///
/// One call is one iteration: moments are updated from the gradient, then the parameters move *against* it.
/// `step` moves the parameters; `update` only writes by how much they are to move, for parameters that
/// live on a manifold (a rotation is moved by the exponential map of its update). No call allocates.
///
/// A NaN in the gradient makes the update of its own coordinate NaN and is never hidden.
///
/// # Panics
/// All four updating functions panic if a slice's length differs from the optimiser's, or if groups overlap, are out
/// of order or reach past the end: these are errors of the calling code, not of its input.
pub trait Optimizer<E: Element>: Send {
    /// How many parameters there are.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// How many iterations were made.
    fn iterations(&self) -> usize;
    /// Forgets everything: as if newly made.
    fn reset(&mut self);

    /// Moves the parameters, those of each group at the group's rate.
    ///
    /// Parameters in no group do not move, and their moments stay as they are. Groups must be in ascending order.
    fn step_groups(&mut self, groups: &[ParameterGroup], parameters: &mut [E], gradient: &[E]);
    /// Writes by how much [`Optimizer::step_groups`] would move the parameters.
    ///
    /// The update of parameters in no group is set to 0.
    fn update_groups(&mut self, groups: &[ParameterGroup], gradient: &[E], update: &mut [E]);

    /// Moves the parameters: `parameters += update`.
    fn step(&mut self, rate: f64, parameters: &mut [E], gradient: &[E]) {
        let group = whole(self.len(), rate);
        self.step_groups(&[group], parameters, gradient);
    }
    /// Writes by how much [`Optimizer::step`] would move the parameters.
    fn update(&mut self, rate: f64, gradient: &[E], update: &mut [E]) {
        let group = whole(self.len(), rate);
        self.update_groups(&[group], gradient, update);
    }
}

/// All parameters as one group.
fn whole(len: usize, rate: f64) -> ParameterGroup {
    ParameterGroup {
        range: 0..len,
        rate,
    }
}

/// Which optimiser to use: the form in which a preset names it.
#[derive(Clone, Debug, PartialEq)]
pub enum OptimizerKind {
    /// Plain gradient descent.
    GradientDescent,
    /// Adam.
    Adam(AdamSettings),
    /// Adam with the infinity norm.
    Adamax(AdamaxSettings),
}

impl Default for OptimizerKind {
    /// Adamax, as in the paper.
    fn default() -> Self {
        Self::Adamax(AdamaxSettings::default())
    }
}

impl OptimizerKind {
    /// The optimiser for `len` parameters.
    ///
    /// # Errors
    /// If a setting is out of range.
    pub fn build<E: Element>(
        &self,
        len: usize,
    ) -> Result<Box<dyn Optimizer<E>>, OptimizationError> {
        Ok(match self {
            Self::GradientDescent => Box::new(GradientDescent::new(len)),
            Self::Adam(settings) => Box::new(Adam::new(len, settings.clone())?),
            Self::Adamax(settings) => Box::new(Adamax::new(len, settings.clone())?),
        })
    }
}

/// What is done with an update: add it to a parameter, or store it.
pub(crate) trait Apply<E>: Copy {
    /// Takes the update of the coordinate that `target` belongs to.
    fn apply(self, target: &mut E, update: E);
}

/// Moves the parameter by the update.
#[derive(Clone, Copy)]
pub(crate) struct Move;
impl<E: Element> Apply<E> for Move {
    #[inline(always)]
    fn apply(self, target: &mut E, update: E) {
        *target += update;
    }
}

/// Stores the update.
#[derive(Clone, Copy)]
pub(crate) struct Store;
impl<E: Element> Apply<E> for Store {
    #[inline(always)]
    fn apply(self, target: &mut E, update: E) {
        *target = update;
    }
}

/// Checks that groups are in order, disjoint and within `len`, and that the slices are `len` long.
pub(crate) fn check_lengths(
    len: usize,
    groups: &[ParameterGroup],
    gradient_len: usize,
    target_len: usize,
) {
    assert_eq!(gradient_len, len, "length of the gradient");
    assert_eq!(target_len, len, "length of the parameters or the update");
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
    pub(crate) fn reset(&mut self) {
        self.power = 1.0;
    }
}
