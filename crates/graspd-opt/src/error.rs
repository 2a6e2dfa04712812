//! What can be wrong with the settings of an optimiser.

use graspd_settings::OutOfRange;

/// A setting that cannot work, with the value that was given.
///
/// Not converging is no error: [`crate::Status`] tells it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OptimizationError {
    /// A number outside its range, or not a number at all.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// A span of steps that ends before it has begun.
    #[error("{field} runs from step {start} to step {end}, but must end after it starts")]
    EmptySpan {
        /// Which setting.
        field: &'static str,
        /// First step of the span.
        start: usize,
        /// Last step of the span.
        end: usize,
    },
    /// Nothing to optimise.
    #[error("{field} is empty, but must have at least one entry")]
    Empty {
        /// Which argument.
        field: &'static str,
    },
}
