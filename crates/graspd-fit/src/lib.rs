//! The second-order solver: a hand is fitted to an object through a smoothed contact law.
//!
//! Of the paper's simulation it keeps the contact law over all points, its leak and coarse-to-fine, here one
//! smoothing that falls ([`ContactCost`]), the forces (`graspd_sim::ForceStep`) and the losses of joints and
//! self-intersection. Pose steps are Levenberg-Marquardt's over all degrees of freedom of the hand: some 50 unknowns
//! and a few thousand skin points, in tens of iterations. That a few points suffice to hold an object is no obstacle:
//! the area that touches is itself what is fitted; forces choose among candidates.
//!
//! | part | module |
//! |---|---|
//! | contact law of a skin point and of a medial sphere | `cost` |
//! | schedule | `settings` |
//! | skin points, medial spheres, dense patches | `skin`, `medial_spheres`, `patches` |
//! | distances of many points at once | `distance_field` |
//! | cost of a pose, rows of the Jacobian, normal equations | `linearization`, `normal_equations`, `cholesky` |
//! | main loop, steps | `fit`, `levenberg_marquardt` |
//! | depth projection, depenetration | `depth_projection` |
//! | contacts, force step, rating | `holding` |
//! | derivative of a fit by the object's shape | `sensitivity` |

mod cholesky;
mod cost;
mod depth_projection;
mod distance_field;
mod error;
mod fit;
mod holding;
mod levenberg_marquardt;
mod linearization;
mod medial_spheres;
mod normal_equations;
mod patches;
mod sensitivity;
mod settings;
mod skin;
#[cfg(test)]
mod tests;

pub use cost::ContactCost;
pub use error::FitError;
pub use fit::{FitObserver, FittedHand, HandFitter};
pub use settings::{DepthSettings, SkinFitSettings};
pub use skin::SkinSamples;
