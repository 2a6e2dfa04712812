//! What can go wrong before a simulation starts.

/// Why a simulation cannot be set up.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// Mass properties that no rigid body has.
    #[error("the object's {what} is {value}; a closed mesh with a positive volume is needed")]
    InvalidMass {
        /// Mass, centre of mass, or moment of inertia.
        what: &'static str,
        /// The offending value.
        value: f64,
    },
}
