//! Scalars that carry derivatives: write a function once, over [`Real`], and run it on any of them.
//!
//! ```
//! use graspd_ad::{Dual, Lanes, Real, Tape};
//!
//! /// Distance of a point from a sphere.
//! fn distance<T: Real>(point: [T; 3], radius: f64) -> T {
//!     let [x, y, z] = point;
//!     (x.square() + y.square() + z.square()).sqrt() - T::constant(radius)
//! }
//!
//! // Plain numbers: the value.
//! assert_eq!(distance([2.0, 3.0, 6.0], 5.0), 2.0);
//!
//! // Forward mode: the value with its derivatives with respect to a few variables.
//! let point = Dual::variables([2.0, 3.0, 6.0]);
//! let outward = distance(point, 5.0).derivative;
//!
//! // Reverse mode: the derivatives with respect to many variables at once.
//! let mut tape = Tape::new();
//! tape.scope(|recording| {
//!     let point = [2.0, 3.0, 6.0].map(|x| recording.variable(x));
//!     let adjoints = recording.adjoints(distance(point, 5.0));
//!     assert_eq!(point.map(|x| adjoints.of(x)), outward);
//! });
//!
//! // Eight points at a time, each with its own derivatives.
//! let x = Lanes::from_lanes(|lane| lane as f64);
//! let points = Dual::<Lanes, 3>::variables([x, Lanes::constant(0.0), Lanes::constant(2.0)]);
//! assert_eq!(distance(points, 1.0).value.lane(0), 1.0);
//! ```
//!
//! | scalar | carries | for |
//! |---|---|---|
//! | `f64`, `f32` | a value | reference, finite differences |
//! | [`Dual<T, N>`](Dual) | `N` derivatives | few inputs; second derivatives, as a dual over a dual |
//! | [`Var`] | its place on a [`Tape`] | many inputs, few outputs; over duals, Hessians |
//! | [`Lanes`] | eight `f32` values | hot loops; [`vectorize`] picks the processor's best registers |
//!
//! [`gradient`], [`jacobian`], [`vjp`], [`jvp`] and [`hessian`] differentiate a whole function in one call.
//!
//! # Rules
//!
//! * Comparisons look at values and give a [`Mask`]; [`Real::select`] branches lane by lane. The side that is not
//!   chosen never reaches the result or its derivatives, even where it is infinite or NaN.
//! * Where a function has a kink or an infinite derivative at a finite value ([`Real::sqrt`] at 0, [`Real::atan2`] at
//!   the origin ...), its documentation names the derivative that is returned, which is finite, in every mode and
//!   for second derivatives too. At a pole (`1 / 0`, `ln 0`) value and derivatives are not finite: guard it with
//!   `select` or use [`safe_divide`].
//! * All modes share one statement of each derivative, and all compute the value by the same operations as plain
//!   numbers do, so that values agree bit for bit.
//!
//! Scalars work with code written over num-traits as far as they can keep its promises: `Num`, `Signed` (not
//! [`Lanes`]), `FloatConst`, `Inv`, `Pow`, `MulAdd`. They do not claim `PartialOrd` and what builds on it, such as
//! `num_traits::Float`: an order of values would say nothing of lanes or derivatives.
//!
//! Feature `testing`: module `check` compares derivatives with central differences.

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
pub use lanes::{
    INSTRUCTIONS_VARIABLE, Instructions, LaneMask, Lanes, LanesOver, UnknownInstructions,
    vectorize, vectorize_with,
};
pub use real::{Element, Kernel, Mask, Real};
pub use smooth::{leaky_min, safe_acos, safe_divide, safe_norm};
pub use tape::{Adjoints, Recording, Tape};
pub use var::Var;
