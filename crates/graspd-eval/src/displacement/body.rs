//! The one body that moves: the object, let go.

use nalgebra::{Matrix3, Point3};
use parry3d_f64::mass_properties::MassProperties;
use parry3d_f64::math::{Matrix, Pose, Rotation, Vector};

/// Faster than this \[m/s\] no centre of mass becomes.
const MOST_SPEED: f64 = 40.0;
/// Farther than this \[rad\] no body turns in a step.
const MOST_TURN: f64 = std::f64::consts::FRAC_PI_4;

/// How a body moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Velocity {
    /// Of the centre of mass \[m/s\].
    pub(super) linear: Vector,
    /// \[rad/s\].
    pub(super) angular: Vector,
}

/// The object as a rigid body. Its mass is of no account: all that acts on it are gravity and contacts with a fixed hand whose
/// softness is relative to the mass.
#[derive(Clone)]
pub(super) struct Body {
    /// Where its centre of mass is \[m\].
    pub(super) center: Vector,
    pub(super) rotation: Rotation,
    pub(super) velocity: Velocity,
    /// The centre of mass in the object's own frame \[m\].
    center_in_object: Vector,
    /// Of 1 kg.
    mass: MassProperties,
}

impl Body {
    /// At rest, its frame at the identity. About an axis without inertia it does not turn.
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

    /// Where the object's frame is.
    pub(super) fn pose(&self) -> Pose {
        let translation = self.center - self.rotation * self.center_in_object;
        Pose::from_parts(translation, self.rotation)
    }

    /// A point of the object, given in its frame, from the centre of mass, along the object's axes.
    pub(super) fn offset_from_center(&self, point: Vector) -> Vector {
        point - self.center_in_object
    }

    /// The inverse of the inertia of 1 kg along the axes of the world \[1/m^2\].
    pub(super) fn inverse_inertia_in_world(&self) -> Matrix {
        let inverse = self.mass.world_inv_inertia(&self.rotation);
        Matrix::from_cols(
            Vector::new(inverse.m11, inverse.m12, inverse.m13),
            Vector::new(inverse.m12, inverse.m22, inverse.m23),
            Vector::new(inverse.m13, inverse.m23, inverse.m33),
        )
    }

    /// Lets gravity and the body's own spin act for `time` \[s\]: about other than a principal axis it does not keep its direction. The angular momentum
    /// keeps its size.
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

    /// The velocity of a point that the object has at `place` of the world \[m/s\].
    pub(super) fn velocity_at(&self, place: Vector) -> Vector {
        self.velocity.linear + self.velocity.angular.cross(place - self.center)
    }

    /// Moves on for `time` \[s\], a part of a step of the length `step` \[s\].
    pub(super) fn advance(&mut self, time: f64, step: f64) {
        let Velocity { linear, angular } = &mut self.velocity;
        *linear = linear.clamp_length_max(MOST_SPEED);
        let most_spin = if step > 0.0 { MOST_TURN / step } else { 0.0 };
        *angular = angular.clamp_length_max(most_spin);
        // To first order, and the quaternion of length 1 again.
        let half = *angular * (0.5 * time);
        let turn = Rotation::from_xyzw(half.x, half.y, half.z, 1.0);
        self.rotation = (turn * self.rotation).normalize();
        self.center += *linear * time;
    }

    /// Whether all numbers are.
    pub(super) fn is_finite(&self) -> bool {
        let Velocity { linear, angular } = self.velocity;
        self.center.is_finite()
            && self.rotation.is_finite()
            && linear.is_finite()
            && angular.is_finite()
    }
}
