//! Scalars that carry derivatives.

#[cfg(feature = "testing")]
pub mod check;
mod derivative;
mod dual;
mod interop;
mod lanes;
mod real;
mod rule;
mod smooth;
mod tape;
mod var;

pub use derivative::{
    Function, HessianVar, LengthMismatch, gradient, gradient_forward, hessian, jacobian, jvp, vjp,
};
pub use dual::Dual;
pub use lanes::{Kernel, LaneMask, Lanes, LanesOver, vectorize};
pub use real::{Element, Mask, Real};
pub use smooth::{leaky_min, safe_acos, safe_divide, safe_norm};
pub use tape::{Adjoints, Recording, Tape};
pub use var::Var;
