//! What can go wrong before a simulation starts.

/// Why a simulation cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// A parameter outside its range.
    #[error("simulation parameter `{field}` is {value}; it must be {wanted}")]
    InvalidParameter {
        /// The field's name.
        field: &'static str,
        /// The offending value.
        value: f64,
        /// What it should be.
        wanted: &'static str,
    },
    /// Mass properties that no rigid body has.
    #[error("the object's {what} is {value}; a closed mesh with a positive volume is needed")]
    InvalidMass {
        /// Mass, centre of mass, or moment of inertia.
        what: &'static str,
        /// The offending value.
        value: f64,
    },
}
