//! Rotation vectors of the joints from pose coefficients, rotations from rotation vectors, and both transposed.

use graspd_ad::Real;
use graspd_geom::{Mat3, Quaternion, Vec3};

use super::model::{POSE_VALUES, SKINNED_JOINTS};

/// Squared angle below which the left Jacobian takes its Taylor series: the next term is about 1e-12 of the last kept.
const SMALL_ANGLE_SQUARED: f64 = 1e-4;

/// pose = mean + coefficients . components \[rad\]: the rotation vectors of joints 1 to 15.
///
/// `coefficients`: as many of the first components as are used.
pub(crate) fn pose_of<T: Real>(
    components: &[[f64; POSE_VALUES]],
    mean: &[f64; POSE_VALUES],
    coefficients: &[T],
) -> [T; POSE_VALUES] {
    let mut pose = mean.map(T::constant);
    for (component, &coefficient) in components.iter().zip(coefficients) {
        for (value, &direction) in pose.iter_mut().zip(component) {
            *value += coefficient.scale(direction);
        }
    }
    pose
}

/// Applies the transpose of [`pose_of`]: the derivative by each coefficient, from that by the pose.
pub(crate) fn pose_pullback(
    components: &[[f64; POSE_VALUES]],
    pose_gradient: &[f64; POSE_VALUES],
    coefficient_gradient: &mut [f64],
) {
    for (component, slot) in components.iter().zip(coefficient_gradient) {
        let terms = component.iter().zip(pose_gradient);
        *slot = terms
            .map(|(direction, gradient)| direction * gradient)
            .sum();
    }
}

/// Returns the rotation vector of joint 1 + `index` in a pose.
pub(crate) fn rotation_vector<T: Real>(pose: &[T; POSE_VALUES], index: usize) -> Vec3<T> {
    Vec3::new(pose[3 * index], pose[3 * index + 1], pose[3 * index + 2])
}

/// Returns the local rotation of each joint; the wrist's is the identity.
///
/// By way of the unit quaternion, whose series at 0 is exact to second derivatives; nothing happens at pi.
pub(crate) fn local_rotations<T: Real>(pose: &[T; POSE_VALUES]) -> [Mat3<T>; SKINNED_JOINTS] {
    let mut rotations = [Mat3::identity(); SKINNED_JOINTS];
    for joint in 1..SKINNED_JOINTS {
        rotations[joint] = Quaternion::exp(rotation_vector(pose, joint - 1)).to_matrix();
    }
    rotations
}

/// J^T `turn` for the left Jacobian J of the rotation exp(v), d exp(v) = \[J dv\]x exp(v): the derivative by the
/// rotation vector v from the derivative by a small rotation before exp(v).
///
/// J = I + (1 - cos a)/a^2 \[v\]x + (a - sin a)/a^3 \[v\]x^2 with a = |v|, smooth everywhere.
pub(crate) fn left_jacobian_transposed(v: Vec3<f64>, turn: Vec3<f64>) -> Vec3<f64> {
    let squared = v.norm_squared();
    let (first, second) = if squared < SMALL_ANGLE_SQUARED {
        (
            0.5 - squared / 24.0 * (1.0 - squared / 30.0),
            1.0 / 6.0 - squared / 120.0 * (1.0 - squared / 42.0),
        )
    } else {
        let angle = squared.sqrt();
        let (sine, cosine) = angle.sin_cos();
        ((1.0 - cosine) / squared, (angle - sine) / (squared * angle))
    };
    // [v]x is antisymmetric: its transpose turns the other way.
    let once = v.cross(turn);
    turn - once * first + v.cross(once) * second
}
