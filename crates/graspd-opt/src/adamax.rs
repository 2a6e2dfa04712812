//! Adam with the infinity norm.

use graspd_ad::{Element, Real};

use crate::OptimizationError;
use crate::optimizer::{
    AdamSettings, DecayPower, Optimizer, ParameterGroup, check_lengths, flush, smallest_moment,
};

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
    settings: AdamSettings,
    mean: Vec<E>,
    largest: Vec<E>,
    beta1_power: DecayPower,
}

impl<E: Element> Adamax<E> {
    /// An optimiser for `len` parameters.
    ///
    /// # Errors
    /// If a setting is out of range, or epsilon is too small for the element type.
    pub fn new(len: usize, settings: AdamSettings) -> Result<Self, OptimizationError> {
        settings.check::<E>()?;
        Ok(Self {
            mean: vec![E::zero(); len],
            largest: vec![E::zero(); len],
            beta1_power: DecayPower::new(settings.beta1),
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

    /// Begins an iteration whose coordinates are handed over piece by piece, by whoever computes the gradient: the
    /// same numbers as [`Optimizer::step`], without a second pass over memory. Each coordinate must come once.
    pub fn begin_iteration(&mut self, rate: f64) -> AdamaxIteration<'_, E> {
        let correction = self.beta1_power.advance();
        AdamaxIteration {
            rule: Rule::new::<E>(&self.settings, rate / correction),
            mean: &mut self.mean,
            largest: &mut self.largest,
        }
    }

    /// Lets coordinates inherit moments between two iterations, see [`AdamaxIteration::inherit`].
    #[inline(always)]
    pub fn inherit<T: Real<Element = E>, const ROWS: usize>(
        &mut self,
        from: usize,
        to: usize,
        stride: usize,
    ) {
        inherit::<T, ROWS>([&mut self.mean, &mut self.largest], from, to, stride);
    }
}

impl<E: Element> Optimizer<E> for Adamax<E> {
    fn step_groups(&mut self, groups: &[ParameterGroup], parameters: &mut [E], gradient: &[E]) {
        check_lengths(self.mean.len(), groups, gradient.len(), parameters.len());
        let correction = self.beta1_power.advance();
        for group in groups {
            let range = group.range.clone();
            adamax_kernel(
                &Rule::new::<E>(&self.settings, group.rate / correction),
                &mut self.mean[range.clone()],
                &mut self.largest[range.clone()],
                &gradient[range.clone()],
                &mut parameters[range],
            );
        }
    }
}

/// One iteration over slices of equal length; the compiler turns it into SIMD code.
fn adamax_kernel<E: Element>(
    rule: &Rule,
    mean: &mut [E],
    largest: &mut [E],
    gradient: &[E],
    parameters: &mut [E],
) {
    // Equal lengths, said in a way that removes the bounds checks.
    let len = parameters.len();
    let (mean, largest, gradient) = (&mut mean[..len], &mut largest[..len], &gradient[..len]);
    for i in 0..len {
        let update = rule.advance(&mut mean[i], &mut largest[i], gradient[i]);
        parameters[i] += update;
    }
}

/// One iteration of [`Adamax`] in progress; see [`Adamax::begin_iteration`].
#[derive(Debug)]
pub struct AdamaxIteration<'a, E> {
    rule: Rule,
    mean: &'a mut [E],
    largest: &'a mut [E],
}

impl<E: Element> AdamaxIteration<'_, E> {
    /// By how much `ROWS` groups of coordinates have to move against their gradient. Group k has a coordinate for each
    /// lane: those from number `first + k stride` on.
    ///
    /// # Panics
    /// If there are no such coordinates.
    #[inline(always)]
    pub fn update<T: Real<Element = E>, const ROWS: usize>(
        &mut self,
        first: usize,
        stride: usize,
        gradient: [T; ROWS],
    ) -> [T; ROWS] {
        // One range check for all groups.
        let range = first..first + (ROWS - 1) * stride + T::LANES;
        let (mean, largest) = (&mut self.mean[range.clone()], &mut self.largest[range]);
        let mut update = [T::zero(); ROWS];
        for k in 0..ROWS {
            let (mut m, mut u) = (
                T::load(&mean[k * stride..]),
                T::load(&largest[k * stride..]),
            );
            update[k] = self.rule.advance(&mut m, &mut u, gradient[k]);
            m.store(&mut mean[k * stride..]);
            u.store(&mut largest[k * stride..]);
        }
        update
    }

    /// The coordinates that [`AdamaxIteration::update`] would move for `first = to` take over the moments of those for
    /// `first = from`, as they are now.
    ///
    /// # Panics
    /// If there are no such coordinates.
    #[inline(always)]
    pub fn inherit<T: Real<Element = E>, const ROWS: usize>(
        &mut self,
        from: usize,
        to: usize,
        stride: usize,
    ) {
        inherit::<T, ROWS>([self.mean, self.largest], from, to, stride);
    }
}

#[inline(always)]
fn inherit<T: Real, const ROWS: usize>(
    all: [&mut [T::Element]; 2],
    from: usize,
    to: usize,
    stride: usize,
) {
    for moments in all {
        for row in (0..ROWS * stride).step_by(stride) {
            T::load(&moments[from + row..]).store(&mut moments[to + row..]);
        }
    }
}

/// The arithmetic of one coordinate, or of one in each lane.
#[derive(Clone, Copy, Debug)]
struct Rule {
    beta1: f64,
    one_minus_beta1: f64,
    beta2: f64,
    epsilon: f64,
    negative_rate: f64,
    /// What is smaller counts as zero in the mean.
    smallest: f64,
}

impl Rule {
    /// `rate`: already divided by the bias correction.
    fn new<E: Element>(settings: &AdamSettings, rate: f64) -> Self {
        Self {
            beta1: settings.beta1,
            one_minus_beta1: 1.0 - settings.beta1,
            beta2: settings.beta2,
            epsilon: settings.epsilon,
            negative_rate: -rate,
            smallest: smallest_moment::<E>().lane(0),
        }
    }

    /// Advances m and u by one iteration and returns the update.
    #[inline(always)]
    fn advance<T: Real>(&self, mean: &mut T, largest: &mut T, gradient: T) -> T {
        let smallest = T::constant(self.smallest);
        let g = flush(gradient, smallest);
        let m = T::constant(self.beta1) * *mean + T::constant(self.one_minus_beta1) * g;
        *mean = flush(m, smallest);
        let magnitude = g.abs() + T::constant(self.epsilon);
        *largest = (T::constant(self.beta2) * *largest).max(magnitude);
        T::constant(self.negative_rate) * *mean / *largest
    }
}
