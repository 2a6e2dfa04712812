//! Adam with the infinity norm.

use graspd_ad::{Element, Real};

use crate::OptimizationError;
use crate::error::{require_decay, require_positive};
use crate::optimizer::{
    Apply, DecayPower, Move, Optimizer, ParameterGroup, Store, check_lengths, flush,
    smallest_moment,
};

/// Settings of [`Adamax`].
#[derive(Clone, Debug, PartialEq)]
pub struct AdamaxSettings {
    /// Decay of the mean of the gradient, in [0, 1). Paper: 0.9.
    pub beta1: f64,
    /// Decay of the largest gradient magnitude seen, in [0, 1). Paper: 0.999.
    pub beta2: f64,
    /// Added to the gradient's magnitude, so that no division is by zero; positive.
    pub epsilon: f64,
}

impl Default for AdamaxSettings {
    fn default() -> Self {
        Self {
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
        }
    }
}

impl AdamaxSettings {
    /// Checks every field.
    ///
    /// # Errors
    /// If a field is out of range; the error names it.
    pub fn validate(&self) -> Result<(), OptimizationError> {
        require_decay("Adamax beta1", self.beta1)?;
        require_decay("Adamax beta2", self.beta2)?;
        require_positive("Adamax epsilon", self.epsilon)
    }
}

/// Adamax: steps by the mean gradient over the largest recent gradient magnitude, coordinate by coordinate.
///
/// With m = u = 0 at first, iteration t = 1, 2, ... computes from the gradient g
///
/// ```text
/// m <- beta1 m + (1 - beta1) g
/// u <- max(beta2 u, |g| + epsilon)
/// update = -rate / (1 - beta1^t) m / u
/// ```
///
/// The update does not depend on the gradient's scale (but for epsilon), and the first one is `-rate sign(g)`.
///
/// # Source
/// Kingma and Ba, "Adam: a method for stochastic optimization", ICLR 2015, Algorithm 2. There u may be zero; epsilon
/// stands where PyTorch has it.
#[derive(Clone, Debug)]
pub struct Adamax<E> {
    settings: AdamaxSettings,
    mean: Vec<E>,
    largest: Vec<E>,
    beta1_power: DecayPower,
    iterations: usize,
}

impl<E: Element> Adamax<E> {
    /// An optimiser for `len` parameters.
    ///
    /// # Errors
    /// If a setting is out of range, or epsilon is too small for the element type.
    pub fn new(len: usize, settings: AdamaxSettings) -> Result<Self, OptimizationError> {
        settings.validate()?;
        require_positive(
            "Adamax epsilon, rounded to the parameters' type,",
            E::constant(settings.epsilon).lane(0),
        )?;
        Ok(Self {
            mean: vec![E::zero(); len],
            largest: vec![E::zero(); len],
            beta1_power: DecayPower::new(settings.beta1),
            iterations: 0,
            settings,
        })
    }

    /// The first moment m: the decaying mean of the gradient, not corrected for its bias, `[len]`.
    pub fn mean(&self) -> &[E] {
        &self.mean
    }
    /// The decaying maximum u of the gradient's magnitude, `[len]`.
    pub fn largest(&self) -> &[E] {
        &self.largest
    }

    fn advance(
        &mut self,
        groups: &[ParameterGroup],
        gradient: &[E],
        target: &mut [E],
        apply: impl Apply<E>,
    ) {
        check_lengths(self.mean.len(), groups, gradient.len(), target.len());
        self.iterations += 1;
        let correction = self.beta1_power.advance();
        for group in groups {
            let range = group.range.clone();
            adamax_kernel(
                &self.settings,
                E::constant(-group.rate / correction),
                &mut self.mean[range.clone()],
                &mut self.largest[range.clone()],
                &gradient[range.clone()],
                &mut target[range],
                apply,
            );
        }
    }
}

impl<E: Element> Optimizer<E> for Adamax<E> {
    fn len(&self) -> usize {
        self.mean.len()
    }
    fn iterations(&self) -> usize {
        self.iterations
    }
    fn reset(&mut self) {
        self.mean.fill(E::zero());
        self.largest.fill(E::zero());
        self.beta1_power.reset();
        self.iterations = 0;
    }
    fn step_groups(&mut self, groups: &[ParameterGroup], parameters: &mut [E], gradient: &[E]) {
        self.advance(groups, gradient, parameters, Move);
    }
    fn update_groups(&mut self, groups: &[ParameterGroup], gradient: &[E], update: &mut [E]) {
        update.fill(E::zero());
        self.advance(groups, gradient, update, Store);
    }
}

/// One iteration over slices of equal length; the compiler turns it into SIMD code.
fn adamax_kernel<E: Element>(
    settings: &AdamaxSettings,
    negative_rate: E,
    mean: &mut [E],
    largest: &mut [E],
    gradient: &[E],
    target: &mut [E],
    apply: impl Apply<E>,
) {
    let (beta1, beta2) = (E::constant(settings.beta1), E::constant(settings.beta2));
    let (one_minus_beta1, epsilon) = (
        E::constant(1.0 - settings.beta1),
        E::constant(settings.epsilon),
    );
    let smallest = smallest_moment::<E>();
    // Equal lengths, said in a way that removes the bounds checks.
    let len = target.len();
    let (mean, largest, gradient) = (&mut mean[..len], &mut largest[..len], &gradient[..len]);
    for i in 0..len {
        let g = flush(gradient[i], smallest);
        let m = flush(beta1 * mean[i] + one_minus_beta1 * g, smallest);
        let u = Real::max(beta2 * largest[i], Real::abs(g) + epsilon);
        mean[i] = m;
        largest[i] = u;
        apply.apply(&mut target[i], negative_rate * m / u);
    }
}
