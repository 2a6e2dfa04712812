//! L_phys and its derivative by the contact positions with the contact law differentiated by hand, in reverse.
//!
//! This is what the loops of graspd-sim could do instead of carrying duals through the law: it is here to be
//! measured, and to show what it would take. `tests/derivative_by_hand` holds it against the law.

use graspd_ad::{Element, Kernel, Real};
use graspd_geom::Vec3;
use graspd_hand::{POINT_PADDING, PointBuffer};
use graspd_sim::{ContactParams, SimulatedObject, Twist};

/// What the loss of contacts depends on, and where its derivative goes.
pub(crate) struct ByHand<'a, E> {
    pub(crate) object: &'a SimulatedObject,
    pub(crate) velocities: &'a [Twist<f64>],
    pub(crate) contact: &'a ContactParams,
    pub(crate) points: &'a PointBuffer<E>,
    /// `[n]`
    pub(crate) weight: &'a [E],
    /// `[blocks of 8][J][6][8]`
    pub(crate) targets: &'a [E],
    /// dL_phys / d(position), `[n]`.
    pub(crate) gradient: &'a mut PointBuffer<E>,
}

/// What of a contact depends on no velocity, and the derivative of the loss by it.
struct Contact<T> {
    depth: T,
    normal: Vec3<T>,
    lever: Vec3<T>,
    by_depth: T,
    by_normal: Vec3<T>,
    by_lever: Vec3<T>,
}

impl<E: Element> ByHand<'_, E> {
    /// L_phys.
    #[inline(always)]
    pub(crate) fn over<L: Real<Element = E>>(self) -> f64 {
        let mut total = L::zero();
        for first in (0..self.points.len()).step_by(L::LANES) {
            let point = Vec3::new(
                L::load(&self.points.x[first..]),
                L::load(&self.points.y[first..]),
                L::load(&self.points.z[first..]),
            );
            let (loss, gradient) = self.contact(first, point);
            let weight = L::load(&self.weight[first..]);
            total += weight * loss;
            (weight * gradient.x).store(&mut self.gradient.x[first..]);
            (weight * gradient.y).store(&mut self.gradient.y[first..]);
            (weight * gradient.z).store(&mut self.gradient.z[first..]);
        }
        let mut sum = 0.0;
        for lane in 0..L::LANES {
            sum += total.lane(lane);
        }
        sum
    }

    #[inline(always)]
    fn contact<L: Real<Element = E>>(&self, first: usize, point: Vec3<L>) -> (L, Vec3<L>) {
        let (distance, slope, curvature) = self.object.sdf().distance_to_second_order(point);
        let touches = distance.le(L::zero());
        let steepness_squared = slope.norm_squared();
        let is_steep = steepness_squared.gt(L::zero());
        let per_steepness = L::select(
            is_steep,
            L::one() / L::select(is_steep, steepness_squared, L::one()).sqrt(),
            L::zero(),
        );
        let mut contact = Contact {
            depth: L::select(touches, -distance, L::zero()),
            normal: slope * per_steepness,
            lever: point - Vec3::constant(self.object.center_of_mass()),
            by_depth: L::zero(),
            by_normal: Vec3::zero(),
            by_lever: Vec3::zero(),
        };
        let mut loss = L::zero();
        let stride = 6 * POINT_PADDING;
        let (block, lane) = (first / POINT_PADDING, first % POINT_PADDING);
        for j in 0..self.velocities.len() {
            let offset = (block * self.velocities.len() + j) * stride + lane;
            let targets = &self.targets[offset..][..5 * POINT_PADDING + L::LANES];
            loss += contact.residual(&self.velocities[j], self.contact, targets);
        }
        let leak = L::constant(-self.contact.leak);
        let by_distance = contact.by_depth * L::select(touches, -L::one(), leak);
        // Of the normal, only what turns it.
        let turning = contact.by_normal - contact.normal * contact.by_normal.dot(contact.normal);
        let by_slope = turning * per_steepness;
        let gradient = contact.by_lever + slope * by_distance + curvature.apply(by_slope);
        (loss, gradient)
    }
}

impl<T: Real> Contact<T> {
    /// The squared residual of one velocity's wrench; adds its derivatives.
    #[inline(always)]
    fn residual(
        &mut self,
        twist: &Twist<f64>,
        params: &ContactParams,
        targets: &[T::Element],
    ) -> T {
        let Self {
            depth,
            normal,
            lever,
            ..
        } = *self;
        let (linear, angular) = (
            Vec3::<T>::constant(twist.linear),
            Vec3::<T>::constant(twist.angular),
        );
        // Forward.
        let slip = -(linear + angular.cross(lever));
        let approach = slip.dot(normal);
        let tangential = slip - normal * approach;
        let speed_squared = tangential.norm_squared();
        let slips = speed_squared.gt(T::zero());
        let speed_squared = T::select(slips, speed_squared, T::one());
        let sticking = T::constant(params.friction_stiffness);
        let limit = T::constant(params.friction_coefficient * params.normal_stiffness);
        let sliding = limit / speed_squared.sqrt();
        let sticks = sticking.le(sliding);
        let friction = T::select(slips, T::select(sticks, sticking, sliding), T::zero());
        let stiffness = T::constant(params.normal_stiffness);
        let per_depth = tangential * friction - normal * stiffness;
        let force = per_depth * depth;
        let torque = lever.cross(force);
        let target = |k: usize| T::load(&targets[k * POINT_PADDING..]);
        let torque_off = torque - Vec3::new(target(0), target(1), target(2));
        let force_off = force - Vec3::new(target(3), target(4), target(5));
        let loss = torque_off.norm_squared() + force_off.norm_squared();

        // Back.
        let by_torque = torque_off + torque_off;
        let by_force = force_off + force_off + by_torque.cross(lever);
        let mut by_lever = force.cross(by_torque);
        self.by_depth += by_force.dot(per_depth);
        let by_per_depth = by_force * depth;
        // Sliding friction falls with the speed.
        let slides = slips & !sticks;
        let falls = T::select(
            slides,
            by_per_depth.dot(tangential) * friction / speed_squared,
            T::zero(),
        );
        let by_tangential = by_per_depth * friction - tangential * falls;
        let along = by_tangential.dot(normal);
        let by_slip = by_tangential - normal * along;
        self.by_normal -= by_per_depth * stiffness + by_tangential * approach + slip * along;
        by_lever += angular.cross(by_slip);
        self.by_lever += by_lever;
        loss
    }
}

impl Kernel for ByHand<'_, f32> {
    type Output = f64;
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> f64 {
        self.over::<L>()
    }
}
