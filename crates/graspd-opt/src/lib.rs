//! First-order optimisation under constraints: [`Adam`], [`Adamax`], the differential method of multipliers
//! ([`Constraint`], [`Mdmm`]), and [`Schedule`]s.
//!
//! ```
//! use graspd_opt::{Constraint, Mdmm, MdmmSettings, Status};
//!
//! # fn main() -> Result<(), graspd_opt::OptimizationError> {
//! // The point of the line x + y = 1 nearest to the origin.
//! let outcome = Mdmm::new(MdmmSettings::default())?
//!     .subject_to(Constraint::equal_to(1.0), |x: &[f64], gradient: &mut [f64]| {
//!         gradient.fill(1.0);
//!         x[0] + x[1]
//!     })?
//!     .minimize(&[3.0, -1.0], |x: &[f64], gradient: &mut [f64]| {
//!         gradient.copy_from_slice(&[2.0 * x[0], 2.0 * x[1]]);
//!         x[0] * x[0] + x[1] * x[1]
//!     })?;
//! assert_eq!(outcome.status, Status::Converged);
//! assert!((outcome.x[0] - 0.5).abs() < 1e-6 && (outcome.x[1] - 0.5).abs() < 1e-6);
//! assert!((outcome.multipliers[0] + 1.0).abs() < 1e-6);
//! # Ok(())
//! # }
//! ```
//!
//! Loops with structure of their own (rotations, alternating blocks) use the parts instead: an [`Optimizer`] for
//! each block and a [`Constraint`] for each multiplier.

mod adam;
mod adamax;
mod constraint;
mod error;
mod kind;
mod mdmm;
mod optimizer;
mod schedule;

pub use adam::Adam;
pub use adamax::{Adamax, AdamaxIteration};
pub use constraint::{Constraint, InequalityForm};
pub use error::OptimizationError;
pub use kind::OptimizerKind;
pub use mdmm::{Mdmm, MdmmSettings, Outcome, Status, ValueAndGradient};
pub use optimizer::{AdamSettings, Optimizer, ParameterGroup};
pub use schedule::Schedule;
