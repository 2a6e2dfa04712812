//! One simulation step from several velocities, and what the grasp should make of it.

use graspd_ad::Real;

use crate::object::SimulatedObject;
use crate::params::{Twist, Wrench};

/// The object's twist after one semi-implicit Euler step: twist + dt M^-1 w, without gravity.
///
/// # Source
/// Grasp'D (ECCV 2022), section 3.1 and supplementary A.5.
#[inline(always)]
pub fn step_twist<T: Real>(
    object: &SimulatedObject,
    twist: &Twist<T>,
    total_wrench: &Wrench<T>,
    time_step: f64,
) -> Twist<T> {
    let change = object.impulse_response(total_wrench, time_step);
    Twist {
        linear: twist.linear + change.linear,
        angular: twist.angular + change.angular,
    }
}

/// L_task: the sum over the velocities of ||twist'||^2, with linear parts in m/s and angular parts in rad/s.
///
/// `twists_after`: `[J]`, from [`step_twist`].
pub fn task_loss<T: Real>(twists_after: &[Twist<T>]) -> T {
    twists_after.iter().fold(T::zero(), |sum, twist| {
        sum + twist.linear.norm_squared() + twist.angular.norm_squared()
    })
}
