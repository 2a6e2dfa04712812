//! Skin fit: surface registration of a hand's skin to an object.
//!
//! As much skin as possible is pressed into the object by a fraction of a millimetre, by least
//! squares over all degrees of freedom of the hand: some 50 unknowns and a few thousand skin
//! points, in tens of iterations. The contact forces of the simulation say whether a grasp holds,
//! but a few points suffice for that; here the area that touches is itself what is maximised.
//!
//! | stage | module |
//! |---|---|
//! | cost of a skin point and of a medial sphere | `cost` |
//! | skin points, medial spheres, dense patches | `skin`, `medial_spheres`, `patches` |
//! | distances of many points at once | `distance_field` |
//! | cost of a pose, rows of the Jacobian, normal equations | `linearization`, `normal_equations`, `cholesky` |
//! | Levenberg-Marquardt within joint limits | `fit` |
//! | depth projection, depenetration | `depth_projection` |

mod cholesky;
mod cost;
mod depth_projection;
mod distance_field;
mod error;
mod fit;
mod linearization;
mod medial_spheres;
mod normal_equations;
mod patches;
mod settings;
mod skin;
#[cfg(test)]
mod tests;

pub use cost::SkinCost;
pub use error::FitError;
pub use fit::{FittedHand, HandFitter, fit_hand};
pub use settings::{DepthSettings, FitStage, SkinFitSettings};
pub use skin::SkinSamples;
