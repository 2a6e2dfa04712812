//! Plain gradient descent.

use std::marker::PhantomData;

use graspd_ad::Element;

use crate::optimizer::{Apply, Move, Optimizer, ParameterGroup, Store, check_lengths};

/// Gradient descent: `update = -rate g`.
///
/// The dynamics for which the differential method of multipliers was stated, and a yardstick for the others.
#[derive(Clone, Debug)]
pub struct GradientDescent<E> {
    len: usize,
    iterations: usize,
    element: PhantomData<E>,
}

impl<E: Element> GradientDescent<E> {
    /// An optimiser for `len` parameters.
    pub fn new(len: usize) -> Self {
        Self {
            len,
            iterations: 0,
            element: PhantomData,
        }
    }

    fn advance(
        &mut self,
        groups: &[ParameterGroup],
        gradient: &[E],
        target: &mut [E],
        apply: impl Apply<E>,
    ) {
        check_lengths(self.len, groups, gradient.len(), target.len());
        self.iterations += 1;
        for group in groups {
            let negative_rate = E::constant(-group.rate);
            let range = group.range.clone();
            for (target, &g) in target[range.clone()].iter_mut().zip(&gradient[range]) {
                apply.apply(target, negative_rate * g);
            }
        }
    }
}

impl<E: Element> Optimizer<E> for GradientDescent<E> {
    fn len(&self) -> usize {
        self.len
    }
    fn iterations(&self) -> usize {
        self.iterations
    }
    fn reset(&mut self) {
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
