//! Adam.

use graspd_ad::{Element, Real};

use crate::OptimizationError;
use crate::optimizer::{
    AdamSettings, DecayPower, Optimizer, ParameterGroup, check_lengths, flush, smallest_moment,
};

/// Adam: steps by the mean gradient over the gradient's root mean square, coordinate by coordinate.
///
/// With m = v = 0 at first, iteration t = 1, 2, ... computes from the gradient g
///
/// ```text
/// m <- beta1 m + (1 - beta1) g
/// v <- beta2 v + (1 - beta2) g^2
/// update = -rate m / (1 - beta1^t) / (sqrt(v / (1 - beta2^t)) + epsilon)
/// ```
///
/// Squares of gradients below the square root of the smallest moment that is kept (`f32`: 3e-16) count as zero.
///
/// # Source
/// Kingma and Ba, "Adam: a method for stochastic optimization", ICLR 2015, Algorithm 1.
#[derive(Clone, Debug)]
pub struct Adam<E> {
    settings: AdamSettings,
    mean: Vec<E>,
    mean_square: Vec<E>,
    beta1_power: DecayPower,
    beta2_power: DecayPower,
}

impl<E: Element> Adam<E> {
    /// An optimiser for `len` parameters.
    ///
    /// # Errors
    /// If a setting is out of range, or epsilon is too small for the element type.
    pub fn new(len: usize, settings: AdamSettings) -> Result<Self, OptimizationError> {
        settings.check::<E>()?;
        Ok(Self {
            mean: vec![E::zero(); len],
            mean_square: vec![E::zero(); len],
            beta1_power: DecayPower::new(settings.beta1),
            beta2_power: DecayPower::new(settings.beta2),
            settings,
        })
    }

    /// The first moment m: the decaying mean of the gradient, not corrected for its bias, `[len]`.
    pub fn mean(&self) -> &[E] {
        &self.mean
    }
    /// The second moment v: the decaying mean of the squared gradient, not corrected for its bias, `[len]`.
    pub fn mean_square(&self) -> &[E] {
        &self.mean_square
    }
}

impl<E: Element> Optimizer<E> for Adam<E> {
    fn step_groups(&mut self, groups: &[ParameterGroup], parameters: &mut [E], gradient: &[E]) {
        check_lengths(self.mean.len(), groups, gradient.len(), parameters.len());
        let correction1 = self.beta1_power.advance();
        let correction2 = self.beta2_power.advance();
        for group in groups {
            let range = group.range.clone();
            adam_kernel(
                &self.settings,
                E::constant(-group.rate / correction1),
                E::constant(1.0 / correction2),
                &mut self.mean[range.clone()],
                &mut self.mean_square[range.clone()],
                &gradient[range.clone()],
                &mut parameters[range],
            );
        }
    }
}

/// One iteration over slices of equal length; the compiler turns it into SIMD code.
#[allow(clippy::too_many_arguments)] // Plain slices, so that the loop vectorises.
fn adam_kernel<E: Element>(
    settings: &AdamSettings,
    negative_rate: E,
    inverse_correction2: E,
    mean: &mut [E],
    mean_square: &mut [E],
    gradient: &[E],
    parameters: &mut [E],
) {
    let (beta1, beta2) = (E::constant(settings.beta1), E::constant(settings.beta2));
    let one_minus_beta1 = E::constant(1.0 - settings.beta1);
    let one_minus_beta2 = E::constant(1.0 - settings.beta2);
    let epsilon = E::constant(settings.epsilon);
    let smallest = smallest_moment::<E>();
    // A gradient whose square would be flushed is left out before it is squared.
    let smallest_squared = Real::sqrt(smallest);
    // Equal lengths, said in a way that removes the bounds checks.
    let len = parameters.len();
    let (mean, mean_square, gradient) =
        (&mut mean[..len], &mut mean_square[..len], &gradient[..len]);
    for i in 0..len {
        let g = flush(gradient[i], smallest);
        let m = flush(beta1 * mean[i] + one_minus_beta1 * g, smallest);
        let squared = Real::square(flush(g, smallest_squared));
        let v = flush(beta2 * mean_square[i] + one_minus_beta2 * squared, smallest);
        mean[i] = m;
        mean_square[i] = v;
        let root_mean_square = Real::sqrt(v * inverse_correction2);
        let update = negative_rate * m / (root_mean_square + epsilon);
        parameters[i] += update;
    }
}
