//! Differentiable contact between a hand and an object, and the losses of a grasp.

mod contact;
mod error;
mod kernel;
mod losses;
mod object;
mod params;
mod scene;
mod step;

pub use contact::ContactState;
pub use error::SimulationError;
pub use kernel::{ContactLoop, Precision};
pub use losses::{
    intersection_loss_gradient, limit_loss, limit_loss_gradient, range_loss, range_loss_gradient,
    sphere_overlap,
};
pub use object::SimulatedObject;
pub use params::{ContactParams, SimulationParams, Twist, Wrench};
pub use scene::{Scene, TaskOutcome};
pub use step::{step_twist, task_loss};
