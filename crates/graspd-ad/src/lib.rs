//! Scalars that carry derivatives.

mod dual;
mod lanes;
mod real;
mod rule;

pub use dual::Dual;
pub use lanes::{LaneMask, Lanes, vectorize};
pub use real::{Element, Mask, Real};
