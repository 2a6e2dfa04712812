//! The force step solved exactly: target forces within friction cones, by Newton's method on their dual.

use graspd_ad::Real;
use graspd_geom::Vec3;
use nalgebra::{Matrix6, Vector6};

use crate::object::SimulatedObject;
use crate::params::Twist;

/// Newton steps; a handful are enough.
const MAX_ITERATIONS: usize = 50;
/// Halvings of a step.
const MAX_HALVINGS: usize = 30;
/// Part of the decrease that a step promises by the gradient which it has to bring.
const SUFFICIENT: f64 = 1e-4;
/// The gradient is 0 at this part of its terms.
const CONVERGED: f64 = 1e-12;

/// A contact on the object: object frame, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceContact<T> {
    /// r_c, from the object's centre of mass to the contact \[m\].
    pub lever: Vec3<T>,
    /// Unit normal of the object's surface, inward: what touches can only push along it.
    pub inward: Vec3<T>,
    /// F_c, what the contact law gives \[N\].
    pub force: Vec3<T>,
}

/// The force step: given the contact forces F_c, target forces f_c that stop the object as well as they can.
///
/// ```text
/// min over f_c in K_c of  1/2 |v'|^2 + rho/2 sum_c |f_c - F_c|^2,      v' = v + B sum_c (r_c x f_c, f_c)
/// ```
///
/// with the friction cones K_c, the object's twist v before the step and its response B = dt M^-1. Its dual is over
/// the twist after the step alone, in six unknowns however many contacts there are: with B_c = B (r_c x ., .),
///
/// ```text
/// min over v' of  psi(v') = 1/2 |v'|^2 - v . v' + rho/2 sum_c |P_c(F_c - B_c^T v' / rho)|^2
/// ```
///
/// where P_c projects onto K_c; f_c = P_c(F_c - B_c^T v' / rho). psi is strictly convex and once differentiable, so
/// Newton's method with a line search ends, in a handful of steps, at the one minimum.
///
/// # Source
/// Grasp'D (ECCV 2022), section 3.3, with the forces in their cones; Qi and Sun, A nonsmooth version of Newton's
/// method, 1993.
#[derive(Clone, Copy, Debug)]
pub struct ForceStep {
    /// dt / m: change of velocity by a force.
    linear: f64,
    /// dt I^-1: change of angular velocity by a torque.
    angular: [Vec3<f64>; 3],
    /// mu.
    friction: f64,
    /// rho: with little of it, forces are as large as the task needs.
    relaxation: f64,
}

/// What came of a force step.
#[derive(Clone, Debug)]
pub struct TargetForces {
    /// f_c, `[n]` \[N\].
    pub forces: Vec<Vec3<f64>>,
    /// v'.
    pub twist_after: Twist<f64>,
    /// L_phys, sum_c |f_c - F_c|^2 \[N^2\].
    pub physics: f64,
    /// L_task, |v'|^2.
    pub task: f64,
}

impl ForceStep {
    /// Makes the force step of an object over `time_step` \[s\].
    ///
    /// `friction`: the coefficient, at least 0; `relaxation`: rho, more than 0.
    pub fn new(object: &SimulatedObject, time_step: f64, friction: f64, relaxation: f64) -> Self {
        Self {
            linear: time_step / object.mass(),
            angular: object.inverse_inertia().map(|row| row * time_step),
            friction,
            relaxation,
        }
    }

    /// Makes the force step of a unit mass at a radius of `length` \[m\] over a unit of time. Angular velocities are
    /// in that radius, too: v = (linear, `length` angular), so that both parts count alike.
    pub fn normalized(length: f64, friction: f64, relaxation: f64) -> Self {
        let axis =
            |k: usize| Vec3::from([0, 1, 2].map(|i| if i == k { 1.0 / length } else { 0.0 }));
        Self {
            linear: 1.0,
            angular: [0, 1, 2].map(axis),
            friction,
            relaxation,
        }
    }

    /// Solves the force step from a twist.
    pub fn solve(&self, contacts: &[ForceContact<f64>], twist: &Twist<f64>) -> TargetForces {
        let before = vector(twist);
        let mut after = before;
        let mut value = self.dual_value(contacts, &before, &after);
        for _ in 0..MAX_ITERATIONS {
            let (gradient, hessian, size) = self.dual_derivatives(contacts, &before, &after);
            if gradient.norm() <= CONVERGED * size {
                break;
            }
            let Some(factor) = hessian.cholesky() else {
                break;
            };
            let step = -factor.solve(&gradient);
            let promised = SUFFICIENT * gradient.dot(&step);
            let mut share = 1.0;
            let mut is_better = false;
            for _ in 0..MAX_HALVINGS {
                let next = after + step * share;
                let reached = self.dual_value(contacts, &before, &next);
                is_better = reached <= value + share * promised;
                if is_better {
                    (after, value) = (next, reached);
                    break;
                }
                share *= 0.5;
            }
            if !is_better {
                break;
            }
        }
        let twist_after = Twist {
            linear: Vec3::new(after[0], after[1], after[2]),
            angular: Vec3::new(after[3], after[4], after[5]),
        };
        let forces = contacts
            .iter()
            .map(|contact| self.force(contact, &twist_after));
        let forces: Vec<_> = forces.collect();
        let off = |(force, contact): (&Vec3<f64>, &ForceContact<f64>)| {
            (*force - contact.force).norm_squared()
        };
        TargetForces {
            physics: forces.iter().zip(contacts).map(off).sum(),
            task: after.norm_squared(),
            forces,
            twist_after,
        }
    }

    /// Computes psi, over any scalar: at the solution its derivative by anything that it depends on is minus that of
    /// the step's least value, but for what rho/2 sum |F_c|^2 + 1/2 |v|^2 adds (envelope theorem).
    ///
    /// Once differentiable; where a projection lies on the edge of its cone the second derivative jumps.
    pub fn dual<T: Real>(
        &self,
        contacts: &[ForceContact<T>],
        twist: &Twist<T>,
        after: &Twist<T>,
    ) -> T {
        let dot = |a: &Twist<T>, b: &Twist<T>| a.linear.dot(b.linear) + a.angular.dot(b.angular);
        let squares = contacts
            .iter()
            .map(|contact| self.force(contact, after).norm_squared());
        let squares = squares.fold(T::zero(), |sum, square| sum + square);
        dot(after, after).scale(0.5) - dot(twist, after) + squares.scale(0.5 * self.relaxation)
    }

    /// f_c at a twist after the step.
    fn force<T: Real>(&self, contact: &ForceContact<T>, after: &Twist<T>) -> Vec3<T> {
        let pull = self.pull(contact, after) * T::constant(1.0 / self.relaxation);
        project(contact.force - pull, contact.inward, self.friction)
    }

    /// B_c^T v'.
    fn pull<T: Real>(&self, contact: &ForceContact<T>, after: &Twist<T>) -> Vec3<T> {
        // I^-1 is symmetric.
        let [a, b, c] = self.angular.map(Vec3::<T>::constant);
        let spin = after.angular;
        let turned = Vec3::new(a.dot(spin), b.dot(spin), c.dot(spin));
        after.linear * T::constant(self.linear) + turned.cross(contact.lever)
    }

    fn dual_value(
        &self,
        contacts: &[ForceContact<f64>],
        before: &Vector6<f64>,
        after: &Vector6<f64>,
    ) -> f64 {
        self.dual(contacts, &twist(before), &twist(after))
    }

    /// The gradient of psi, an element of its generalised Hessian, and the size of the gradient's terms.
    fn dual_derivatives(
        &self,
        contacts: &[ForceContact<f64>],
        before: &Vector6<f64>,
        after: &Vector6<f64>,
    ) -> (Vector6<f64>, Matrix6<f64>, f64) {
        let twist = twist(after);
        let mut gradient = after - before;
        let mut hessian = Matrix6::identity();
        let mut size = after.norm() + before.norm();
        for contact in contacts {
            let target = contact.force - self.pull(contact, &twist) * (1.0 / self.relaxation);
            let (force, axes) = projection_axes(target, contact.inward, self.friction);
            if axes[0].1 == 0.0 {
                continue;
            }
            let change = self.response(contact, force);
            gradient -= change;
            size += change.norm();
            for (axis, rate) in axes {
                let column = self.response(contact, axis);
                hessian.ger(rate / self.relaxation, &column, &column, 1.0);
            }
        }
        (gradient, hessian, size)
    }

    /// B_c f.
    fn response(&self, contact: &ForceContact<f64>, force: Vec3<f64>) -> Vector6<f64> {
        let torque = contact.lever.cross(force);
        let spin = self.angular.map(|row| row.dot(torque));
        let shift = force * self.linear;
        Vector6::new(shift.x, shift.y, shift.z, spin[0], spin[1], spin[2])
    }
}

fn vector(twist: &Twist<f64>) -> Vector6<f64> {
    let Twist {
        linear: v,
        angular: w,
    } = twist;
    Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

fn twist(vector: &Vector6<f64>) -> Twist<f64> {
    Twist {
        linear: Vec3::new(vector[0], vector[1], vector[2]),
        angular: Vec3::new(vector[3], vector[4], vector[5]),
    }
}

/// Projects a force onto the friction cone about a unit vector: the nearest force f with |f_t| <= mu f_n.
///
/// Continuous, and differentiable but at the cone and at its polar one, where the derivative is that within them.
fn project<T: Real>(force: Vec3<T>, axis: Vec3<T>, friction: f64) -> Vec3<T> {
    let normal = force.dot(axis);
    let tangential = force - axis * normal;
    let squared = tangential.norm_squared();
    let slips = squared.gt(T::zero());
    let size = T::select(slips, T::select(slips, squared, T::one()).sqrt(), T::zero());
    let is_inside = size.le(normal.scale(friction));
    let is_polar = size.scale(friction).le(-normal);
    // On the cone's surface.
    let along = (normal + size.scale(friction)).scale(1.0 / (1.0 + friction * friction));
    let across = along.scale(friction) / T::select(slips, size, T::one());
    let surface = axis * along + tangential * across;
    let select = |on_true: T, on_false: T| T::select(is_inside, on_true, on_false);
    let keep = |value: T| T::select(is_polar, T::zero(), value);
    Vec3::new(
        select(force.x, keep(surface.x)),
        select(force.y, keep(surface.y)),
        select(force.z, keep(surface.z)),
    )
}

/// The projection, and its derivative as a sum of rate axis axis^T over orthogonal unit axes.
fn projection_axes(
    force: Vec3<f64>,
    axis: Vec3<f64>,
    friction: f64,
) -> (Vec3<f64>, [(Vec3<f64>, f64); 3]) {
    let normal = force.dot(axis);
    let tangential = force - axis * normal;
    let size = tangential.norm();
    let unit = |k: usize| Vec3::from([0, 1, 2].map(|i| f64::from(u8::from(i == k))));
    if size <= friction * normal {
        return (force, [0, 1, 2].map(|k| (unit(k), 1.0)));
    }
    if friction * size <= -normal {
        return (Vec3::zero(), [0, 1, 2].map(|k| (unit(k), 0.0)));
    }
    // More than the friction, hence not 0.
    let along_slip = tangential * (1.0 / size);
    let edge = axis + along_slip * friction;
    let length = (1.0 + friction * friction).sqrt();
    let along = (normal + friction * size) / (length * length);
    let axes = [
        (edge * (1.0 / length), 1.0),
        (axis.cross(along_slip), friction * along / size),
        (Vec3::zero(), 0.0),
    ];
    (edge * along, axes)
}

#[cfg(test)]
mod tests;
