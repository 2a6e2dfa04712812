//! The constants of the contact law and of the one-step simulation.

use graspd_geom::Vec3;

use crate::SimulationError;

/// Stiffness and friction of the contact between hand and object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactParams {
    /// k_n, normal stiffness \[N/m\]; paper: 1e6.
    pub normal_stiffness: f64,
    /// k_f, friction stiffness \[N s/m^2\]; paper: 1e8.
    pub friction_stiffness: f64,
    /// mu, Coulomb friction coefficient; paper: 0.8.
    pub friction_coefficient: f64,
    /// alpha, the fraction of the gradient that reaches points which do not touch; paper: 0.1. With 0 a point
    /// that does not touch feels nothing.
    pub leak: f64,
}

impl Default for ContactParams {
    fn default() -> Self {
        Self {
            normal_stiffness: 1e6,
            friction_stiffness: 1e8,
            friction_coefficient: 0.8,
            leak: 0.1,
        }
    }
}

/// A rigid body's velocity: of its centre of mass, and angular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist<T> {
    /// Velocity of the centre of mass \[m/s\], object frame.
    pub linear: Vec3<T>,
    /// Angular velocity \[rad/s\], object frame.
    pub angular: Vec3<T>,
}

/// A torque about the object's centre of mass and a force, object frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrench<T> {
    /// Torque about the centre of mass \[N m\].
    pub torque: Vec3<T>,
    /// Force \[N\].
    pub force: Vec3<T>,
}

/// Everything that the simulated loss depends on besides hand and object.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationParams {
    /// The contact law.
    pub contact: ContactParams,
    /// Length of the single time step \[s\]; paper: 1e-5.
    pub time_step: f64,
    /// The object's velocities before the step, `[J]`; the grasp has to stop it from each of them.
    pub velocities: Vec<Twist<f64>>,
}

impl Default for SimulationParams {
    /// At rest, and 0.01 (1, 1, 1) m/s back and forth.
    fn default() -> Self {
        let moving = |speed: f64| Twist {
            linear: Vec3::new(speed, speed, speed),
            angular: Vec3::new(0.0, 0.0, 0.0),
        };
        Self {
            contact: ContactParams::default(),
            time_step: 1e-5,
            velocities: vec![moving(0.0), moving(0.01), moving(-0.01)],
        }
    }
}

impl SimulationParams {
    /// Checks every field.
    ///
    /// # Errors
    /// Names the first field that is not finite, has the wrong sign, or is empty.
    pub fn validate(&self) -> Result<(), SimulationError> {
        let invalid = |field: &'static str, value: f64, wanted: &'static str| {
            Err(SimulationError::InvalidParameter {
                field,
                value,
                wanted,
            })
        };
        let contact = &self.contact;
        for (field, value) in [
            ("normal_stiffness", contact.normal_stiffness),
            ("friction_stiffness", contact.friction_stiffness),
            ("time_step", self.time_step),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return invalid(field, value, "a positive number");
            }
        }
        if !(contact.friction_coefficient.is_finite() && contact.friction_coefficient >= 0.0) {
            return invalid(
                "friction_coefficient",
                contact.friction_coefficient,
                "a number >= 0",
            );
        }
        if !(0.0..=1.0).contains(&contact.leak) {
            return invalid("leak", contact.leak, "a number between 0 and 1");
        }
        if self.velocities.is_empty() {
            return invalid("velocities", 0.0, "at least one object velocity");
        }
        Ok(())
    }
}
