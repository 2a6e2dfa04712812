//! Fitting the hand to the object: as much skin as possible pressed in by a fraction of a millimetre.
//!
//! The contact forces of the simulation say whether a grasp holds, but a few points suffice for that, and nothing
//! draws the skin between them to the object. Here the area that touches is itself what is maximised, by least
//! squares over all degrees of freedom of the hand: some 50 unknowns and a few thousand points of skin, in tens of
//! iterations instead of thousands of gradient steps.

mod core;
mod cost;
mod field;
mod fit;
mod linearization;
mod normal_matrix;
mod patches;
mod projection;
mod settings;
mod skin;
#[cfg(test)]
mod tests;

pub use cost::SkinCost;
pub use fit::{FittedHand, HandFitter, fit_hand};
pub use settings::ConformitySettings;
pub use skin::SkinSamples;
