//! Scalars that carry derivatives.

mod real;

pub use real::{Element, Mask, Real};
