//! What can be wrong with the settings of an optimiser.

/// A setting that cannot work, with the value that was given.
///
/// Not converging is no error: [`crate::Status`] tells it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OptimizationError {
    /// A number outside its range, or not a number at all.
    #[error("{field} is {value}, but must be {requirement}")]
    OutOfRange {
        /// Which setting.
        field: &'static str,
        /// What it was set to.
        value: f64,
        /// What it has to be.
        requirement: &'static str,
    },
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
    /// Two columns of a trace with one name.
    #[error("the trace has two columns named {name:?}; give each its own name")]
    DuplicateColumn {
        /// The name.
        name: String,
    },
    /// Nothing to optimise.
    #[error("{field} is empty, but must have at least one entry")]
    Empty {
        /// Which argument.
        field: &'static str,
    },
}

/// An error unless `holds`.
pub(crate) fn require(
    holds: bool,
    field: &'static str,
    value: f64,
    requirement: &'static str,
) -> Result<(), OptimizationError> {
    if holds {
        Ok(())
    } else {
        Err(OptimizationError::OutOfRange {
            field,
            value,
            requirement,
        })
    }
}

/// An error unless `value` is a positive finite number.
pub(crate) fn require_positive(field: &'static str, value: f64) -> Result<(), OptimizationError> {
    require(
        value > 0.0 && value.is_finite(),
        field,
        value,
        "positive and finite",
    )
}

/// An error unless `value` is a finite number.
pub(crate) fn require_finite(field: &'static str, value: f64) -> Result<(), OptimizationError> {
    require(value.is_finite(), field, value, "finite")
}

/// An error unless `value` is a decay rate in [0, 1).
pub(crate) fn require_decay(field: &'static str, value: f64) -> Result<(), OptimizationError> {
    require(
        (0.0..1.0).contains(&value),
        field,
        value,
        "at least 0 and below 1",
    )
}
