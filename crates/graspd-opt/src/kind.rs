//! The choice between optimisers.

use graspd_ad::Element;

use crate::{Adam, AdamSettings, Adamax, OptimizationError, Optimizer};

/// Which optimiser to use: the form in which a preset names it.
#[derive(Clone, Debug, PartialEq)]
pub enum OptimizerKind {
    /// Adam.
    Adam(AdamSettings),
    /// Adam with the infinity norm.
    Adamax(AdamSettings),
}

impl OptimizerKind {
    /// Returns the optimiser for `len` parameters.
    ///
    /// # Errors
    /// If a setting is out of range.
    pub fn build<E: Element>(
        &self,
        len: usize,
    ) -> Result<Box<dyn Optimizer<E>>, OptimizationError> {
        Ok(match self {
            Self::Adam(settings) => Box::new(Adam::new(len, settings.clone())?),
            Self::Adamax(settings) => Box::new(Adamax::new(len, settings.clone())?),
        })
    }
}
