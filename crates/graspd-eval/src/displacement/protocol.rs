//! The simulation-displacement protocol: what is held constant, and what a physics engine has to do.

use graspd_settings::{
    AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Ranges, Validate, ranges,
};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::EvaluationError;

/// The protocol's constants (defaults: those of the paper's supplement, section A.6, and of the GANHand release
/// that it follows).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisplacementSettings {
    /// Mass of the object, whatever its volume; inertia is that of the solid object scaled to this mass \[kg\].
    pub mass: f64,
    /// Gravitational acceleration \[m/s^2\].
    pub gravity: f64,
    /// Which way gravity pulls, in the object's frame; normalised before use.
    pub gravity_direction: [f64; 3],
    /// Time step \[s\].
    pub time_step: f64,
    /// How many steps are simulated.
    pub steps: usize,
    /// Solver iterations in each step.
    pub solver_iterations: usize,
    /// Friction coefficient between hand and object (of the pair, not of each).
    pub friction: f64,
    /// Restitution of the hand. The pair's restitution is the product of both.
    pub hand_restitution: f64,
    /// Restitution of the object.
    pub object_restitution: f64,
}

impl Default for DisplacementSettings {
    fn default() -> Self {
        Self {
            mass: 1.0,
            gravity: 9.8,
            gravity_direction: [0.0, 1.0, 0.0],
            time_step: 1.0 / 240.0,
            steps: 35,
            solver_iterations: 150,
            friction: 1.2,
            hand_restitution: 0.0,
            object_restitution: 0.5,
        }
    }
}

impl Validate for DisplacementSettings {
    fn ranges(&self) -> Ranges {
        let direction = Vector3::from(self.gravity_direction).norm();
        ranges! { self =>
            mass: POSITIVE.unit("kg"),
            gravity: NOT_NEGATIVE.unit("m/s^2"),
            gravity_direction: FINITE.source("released code"),
            time_step: POSITIVE.unit("s"),
            steps: NOT_NEGATIVE.unit("steps"),
            solver_iterations: AT_LEAST_ONE.unit("iterations"),
            friction: NOT_NEGATIVE.source("Grasp'D A.6"),
            hand_restitution: FRACTION,
            object_restitution: FRACTION,
        }
        .require("gravity_direction (its length)", &direction, POSITIVE)
        .source("GANHand, by A.6")
    }
}

impl DisplacementSettings {
    /// How far an object falls that nothing piece_contacts, g t^2 / 2 \[m\] (10.4 cm by default): the largest
    /// displacement that gravity alone can cause.
    pub fn free_fall(&self) -> f64 {
        let time = self.time_step * self.steps as f64;
        0.5 * self.gravity * time * time
    }
}

/// How the object moved during one simulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectMotion {
    /// Displacement of the centre of mass \[m\], object frame.
    pub displacement: [f64; 3],
    /// Angle of the rotation from the first orientation to the last \[rad\].
    pub rotation: f64,
}

impl ObjectMotion {
    /// Distance between the centre of mass before and after \[cm\]: the metric SD.
    pub fn displacement_cm(&self) -> f64 {
        Vector3::from(self.displacement).norm() * 100.0
    }
}

/// A free object beside a fixed hand, at rest, with the contacts of that pose: common to all directions of gravity.
pub(super) trait World: Sync {
    /// Releases the object under gravity along `direction`, of any length.
    fn release(&self, direction: [f64; 3]) -> Box<dyn Simulation>;

    /// Releases the object for `steps` time steps.
    ///
    /// # Errors
    /// [`EvaluationError::Diverged`].
    fn simulate(&self, direction: [f64; 3], steps: usize) -> Result<ObjectMotion, EvaluationError> {
        let mut simulation = self.release(direction);
        for _ in 0..steps {
            simulation.step()?;
        }
        Ok(simulation.motion())
    }
}

/// An object moving beside a fixed hand.
pub(super) trait Simulation {
    /// Advances by one time step.
    ///
    /// # Errors
    /// [`EvaluationError::Diverged`].
    fn step(&mut self) -> Result<(), EvaluationError>;
    /// Returns an upper bound on the speed of the object's fastest point \[m/s\].
    fn max_speed(&self) -> f64;
    /// Returns how the object has moved since it was released.
    fn motion(&self) -> ObjectMotion;
}

/// Displacements under gravity along each axis of the object's frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SixDisplacements {
    /// \[cm\], under gravity along +x, -x, +y, -y, +z, -z.
    pub per_direction_cm: [f64; 6],
    /// Their mean \[cm\].
    pub mean_cm: f64,
}

/// The directions of [`SixDisplacements::per_direction_cm`].
pub const SIX_DIRECTIONS: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];
