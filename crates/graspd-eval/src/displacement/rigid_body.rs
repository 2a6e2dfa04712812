//! The one body that moves: the object.

use nalgebra::{Matrix3, Point3};
use parry3d_f64::mass_properties::MassProperties;
use parry3d_f64::math::{Matrix, Pose, Rotation, Vector};

/// Largest speed of the centre of mass \[m/s\].
const MAX_SPEED: f64 = 40.0;
/// Largest rotation in one step \[rad\].
const MAX_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// Linear and angular velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Velocity {
    /// Velocity of the centre of mass \[m/s\].
    pub(super) linear: Vector,
    /// Angular velocity \[rad/s\].
    pub(super) angular: Vector,
}

impl Velocity {
    /// Returns an upper bound on the speed of points within `radius` \[m\] of the centre of mass \[m/s\].
    pub(super) fn max_speed(&self, radius: f64) -> f64 {
        self.linear.length() + self.angular.length() * radius
    }
}

/// The object as a rigid body of 1 kg: under gravity and contacts with a fixed hand whose softness
/// is relative to the mass, its motion does not depend on the mass.
#[derive(Clone)]
pub(super) struct RigidBody {
    /// Position of the centre of mass \[m\].
    pub(super) center: Vector,
    pub(super) rotation: Rotation,
    pub(super) velocity: Velocity,
    /// The centre of mass in the object's own frame \[m\].
    center_in_object: Vector,
    /// Mass properties for 1 kg.
    mass: MassProperties,
}

impl RigidBody {
    /// Makes a body at rest with its frame at the identity. It does not rotate about an axis without inertia.
    pub(super) fn at_rest(center: Point3<f64>, unit_inertia: &Matrix3<f64>) -> Self {
        let columns = unit_inertia.as_slice().try_into().unwrap_or_default();
        let inertia = Matrix::from_cols_array(&columns);
        let center = Vector::new(center.x, center.y, center.z);
        Self {
            center,
            rotation: Rotation::IDENTITY,
            velocity: Velocity {
                linear: Vector::ZERO,
                angular: Vector::ZERO,
            },
            center_in_object: center,
            mass: MassProperties::with_inertia_matrix(center, 1.0, inertia),
        }
    }

    /// Returns the pose of the object's frame.
    pub(super) fn pose(&self) -> Pose {
        let translation = self.center - self.rotation * self.center_in_object;
        Pose::from_parts(translation, self.rotation)
    }

    /// Returns the vector from the centre of mass to a point, both along the object's axes.
    pub(super) fn offset_from_center(&self, point: Vector) -> Vector {
        point - self.center_in_object
    }

    /// Returns the inverse inertia for 1 kg along the axes of the world \[1/m^2\].
    pub(super) fn inverse_inertia_in_world(&self) -> Matrix {
        let inverse = self.mass.world_inv_inertia(&self.rotation);
        Matrix::from_cols(
            Vector::new(inverse.m11, inverse.m12, inverse.m13),
            Vector::new(inverse.m12, inverse.m22, inverse.m23),
            Vector::new(inverse.m13, inverse.m23, inverse.m33),
        )
    }

    /// Integrates gravity and the gyroscopic torque for `time` \[s\], keeping the magnitude of the angular momentum.
    pub(super) fn accelerate(&mut self, gravity: Vector, time: f64) {
        self.velocity.linear += gravity * time;
        let axes = self.rotation * self.mass.principal_inertia_local_frame;
        let inertia = self.mass.principal_inertia();
        let spin = axes.inverse() * self.velocity.angular;
        let momentum = inertia * spin;
        let turned = momentum - spin.cross(momentum) * time;
        let square = turned.length_squared();
        if square > 0.0 {
            let kept = turned * (momentum.length_squared() / square).sqrt();
            self.velocity.angular = axes * (self.mass.inv_principal_inertia * kept);
        }
    }

    /// Returns the velocity of the object's point at `place`, world frame \[m/s\].
    pub(super) fn velocity_at(&self, place: Vector) -> Vector {
        self.velocity.linear + self.velocity.angular.cross(place - self.center)
    }

    /// Integrates the velocity for `time` \[s\], part of a step of length `step` \[s\].
    pub(super) fn advance(&mut self, time: f64, step: f64) {
        let Velocity { linear, angular } = &mut self.velocity;
        *linear = linear.clamp_length_max(MAX_SPEED);
        let most_spin = if step > 0.0 { MAX_TURN / step } else { 0.0 };
        *angular = angular.clamp_length_max(most_spin);
        // To first order, then normalised.
        let half = *angular * (0.5 * time);
        let turn = Rotation::from_xyzw(half.x, half.y, half.z, 1.0);
        self.rotation = (turn * self.rotation).normalize();
        self.center += *linear * time;
    }

    /// Returns whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let Velocity { linear, angular } = self.velocity;
        self.center.is_finite()
            && self.rotation.is_finite()
            && linear.is_finite()
            && angular.is_finite()
    }
}
