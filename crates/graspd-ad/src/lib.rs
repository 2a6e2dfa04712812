//! Scalars that carry derivatives.

mod dual;
mod lanes;
mod real;
mod rule;

pub use dual::Dual;
pub use lanes::{Kernel, LaneMask, Lanes, LanesOver, vectorize};
pub use real::{Element, Mask, Real};
