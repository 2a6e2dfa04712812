//! The loops over contacts: the whole cost of a step is here.

use graspd_ad::{Dual, Element, Kernel, Real};
use graspd_geom::Vec3;
use graspd_hand::{HandScratch, POINT_PADDING, PointBuffer};

use crate::contact::ContactState;
use crate::object::SimulatedObject;
use crate::params::{ContactParams, Twist, Wrench};

/// Numbers in a wrench: the torque's three, then the force's three.
pub(crate) const WRENCH_LEN: usize = 6;

/// A float type that contacts can be evaluated in, to be used through a [`Scene`](crate::Scene).
///
/// Implemented by `f64`, the reference: one contact at a time; and by `f32`: eight contacts at a time in the widest
/// vector registers of the machine. Both run the same code.
pub trait Precision: Element {
    /// Whether hands give what rounding has left of the contacts' coordinates.
    #[doc(hidden)]
    const HAS_REMAINDER: bool;

    /// What rounding left of the coordinates of contact points, if it is kept, `[n]`.
    #[doc(hidden)]
    fn remainder(scratch: &HandScratch) -> Option<&PointBuffer<Self>>;
}

impl Precision for f64 {
    const HAS_REMAINDER: bool = false;
    fn remainder(_scratch: &HandScratch) -> Option<&PointBuffer<f64>> {
        None
    }
}

impl Precision for f32 {
    const HAS_REMAINDER: bool = true;
    fn remainder(scratch: &HandScratch) -> Option<&PointBuffer<f32>> {
        Some(&scratch.contact_remainder)
    }
}

/// The contacts of a hand at an object, as the loops over them read them: made by a [`Scene`](crate::Scene).
pub(crate) struct ContactLoop<'a, E> {
    pub(crate) object: &'a SimulatedObject,
    pub(crate) velocities: &'a [Twist<f64>],
    pub(crate) contact: ContactParams,
    pub(crate) smoothing: f64,
    pub(crate) length_scale: f64,
    pub(crate) nearest_sample_outside: bool,
    pub(crate) points: &'a PointBuffer<E>,
    /// What rounding has left of the points' coordinates; empty without [`Precision::HAS_REMAINDER`].
    pub(crate) remainder: &'a PointBuffer<E>,
}

impl<E: Precision> ContactLoop<'_, E> {
    #[inline(always)]
    pub(crate) fn point<L: Real<Element = E>>(&self, first: usize) -> Vec3<L> {
        load(self.points, first)
    }

    /// The distance of contact `first`, at `point`, to the dilated object, and the gradient of the distance.
    #[inline(always)]
    pub(crate) fn distance<T: Real<Element = E>>(
        &self,
        first: usize,
        point: Vec3<T>,
    ) -> (T, Vec3<T>) {
        let sdf = self.object.sdf();
        let rest = E::HAS_REMAINDER.then(|| load(self.remainder, first));
        let (distance, gradient) = match rest {
            _ if self.nearest_sample_outside => {
                sdf.distance_and_gradient_by_nearest_sample(point, rest)
            }
            Some(rest) => sdf.distance_and_gradient_of_sum(point, rest),
            None => sdf.distance_and_gradient(point),
        };
        (distance - T::constant(self.smoothing), gradient)
    }

    #[inline(always)]
    pub(crate) fn state<T: Real<Element = E>>(
        &self,
        first: usize,
        point: Vec3<T>,
    ) -> ContactState<T> {
        let (distance, gradient) = self.distance(first, point);
        self.state_at(point, distance, gradient)
    }

    /// The state of a contact of which the distance is known already.
    #[inline(always)]
    pub(crate) fn state_at<T: Real>(
        &self,
        point: Vec3<T>,
        distance: T,
        gradient: Vec3<T>,
    ) -> ContactState<T> {
        let lever =
            (point - Vec3::constant(self.object.center_of_mass())) * T::constant(self.length_scale);
        ContactState::new(distance, gradient, lever, self.contact.leak)
    }

    #[inline(always)]
    pub(crate) fn wrench<T: Real>(
        &self,
        state: &ContactState<T>,
        twist: &Twist<f64>,
    ) -> [T; WRENCH_LEN] {
        components(state.wrench(&constant(twist), &self.contact))
    }

    #[inline(always)]
    pub(crate) fn wrench_per_depth<T: Real>(
        &self,
        state: &ContactState<T>,
        twist: &Twist<f64>,
    ) -> [T; WRENCH_LEN] {
        components(state.wrench_per_depth(&constant(twist), &self.contact))
    }

    /// Where component 0 of the wrench of contact `first` for velocity `j` is stored.
    #[inline(always)]
    pub(crate) fn offset(&self, first: usize, j: usize) -> usize {
        let (block, lane) = (first / POINT_PADDING, first % POINT_PADDING);
        (block * self.velocities.len() + j) * WRENCH_LEN * POINT_PADDING + lane
    }
}

#[inline(always)]
fn load<T: Real>(points: &PointBuffer<T::Element>, first: usize) -> Vec3<T> {
    Vec3::new(
        T::load(&points.x[first..]),
        T::load(&points.y[first..]),
        T::load(&points.z[first..]),
    )
}

#[inline(always)]
fn constant<T: Real>(twist: &Twist<f64>) -> Twist<T> {
    Twist {
        linear: Vec3::constant(twist.linear),
        angular: Vec3::constant(twist.angular),
    }
}

#[inline(always)]
fn components<T: Real>(Wrench { torque, force }: Wrench<T>) -> [T; WRENCH_LEN] {
    [torque.x, torque.y, torque.z, force.x, force.y, force.z]
}

/// Writes the wrench of every contact for every object velocity, `[blocks of 8][J][6][8]`.
pub(crate) struct WrenchKernel<'a, E> {
    pub(crate) contacts: &'a ContactLoop<'a, E>,
    pub(crate) wrenches: &'a mut [E],
}

impl<E: Precision> Kernel<E> for WrenchKernel<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) {
        let contacts = self.contacts;
        for first in (0..contacts.points.len()).step_by(L::LANES) {
            let state = contacts.state(first, contacts.point::<L>(first));
            for j in 0..contacts.velocities.len() {
                let wrench = contacts.wrench(&state, &contacts.velocities[j]);
                let offset = contacts.offset(first, j);
                for k in 0..WRENCH_LEN {
                    wrench[k].store(&mut self.wrenches[offset + k * POINT_PADDING..]);
                }
            }
        }
    }
}

/// Writes the derivative of sum_j sum_c pull_j . f_c(q, v_j) by the contact positions, each contact counted
/// `weight` times, to `gradient`, `[n]`. `pull`: one for each velocity, `[J]`.
pub(crate) struct PullKernel<'a, E> {
    pub(crate) contacts: &'a ContactLoop<'a, E>,
    pub(crate) weight: &'a [E],
    pub(crate) pull: &'a [Wrench<f64>],
    pub(crate) gradient: &'a mut PointBuffer<E>,
}

impl<E: Precision> Kernel<E> for PullKernel<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) {
        let contacts = self.contacts;
        for first in (0..contacts.points.len()).step_by(L::LANES) {
            let point = contacts.point::<L>(first);
            let state = contacts.state(
                first,
                Vec3::new(
                    Dual::<L, 3>::variable(point.x, 0),
                    Dual::variable(point.y, 1),
                    Dual::variable(point.z, 2),
                ),
            );
            let mut sum = Dual::<L, 3>::constant(L::zero());
            for (velocity, pull) in contacts.velocities.iter().zip(self.pull) {
                let wrench = contacts.wrench(&state, velocity);
                let pull = components(*pull);
                for k in 0..WRENCH_LEN {
                    sum += wrench[k] * Dual::constant(L::constant(pull[k]));
                }
            }
            let weight = L::load(&self.weight[first..]);
            (weight * sum.derivative[0]).store(&mut self.gradient.x[first..]);
            (weight * sum.derivative[1]).store(&mut self.gradient.y[first..]);
            (weight * sum.derivative[2]).store(&mut self.gradient.z[first..]);
        }
    }
}

/// Computes L_phys \[N^2, and (N m)^2 for torques\], each contact counted `weight` times, `[n]`, and writes its
/// derivative by the contact positions to `gradient`, `[n]`. `targets`: laid out as the wrenches.
pub(crate) struct LossKernel<'a, E> {
    pub(crate) contacts: &'a ContactLoop<'a, E>,
    pub(crate) weight: &'a [E],
    pub(crate) targets: &'a [E],
    pub(crate) gradient: &'a mut PointBuffer<E>,
}

impl<E: Precision> Kernel<E> for LossKernel<'_, E> {
    type Output = f64;
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) -> f64 {
        let contacts = self.contacts;
        let mut total = L::zero();
        for first in (0..contacts.points.len()).step_by(L::LANES) {
            let point = contacts.point::<L>(first);
            let lifted = Vec3::new(
                Dual::<L, 3>::variable(point.x, 0),
                Dual::variable(point.y, 1),
                Dual::variable(point.z, 2),
            );
            let state = contacts.state(first, lifted);
            let mut loss = Dual::<L, 3>::constant(L::zero());
            for j in 0..contacts.velocities.len() {
                let wrench = contacts.wrench(&state, &contacts.velocities[j]);
                let offset = contacts.offset(first, j);
                for k in 0..WRENCH_LEN {
                    let target = L::load(&self.targets[offset + k * POINT_PADDING..]);
                    let residual = wrench[k] - Dual::constant(target);
                    loss += residual * residual;
                }
            }
            let weight = L::load(&self.weight[first..]);
            total += weight * loss.value;
            (weight * loss.derivative[0]).store(&mut self.gradient.x[first..]);
            (weight * loss.derivative[1]).store(&mut self.gradient.y[first..]);
            (weight * loss.derivative[2]).store(&mut self.gradient.z[first..]);
        }
        let mut sum = 0.0;
        for lane in 0..L::LANES {
            sum += total.lane(lane);
        }
        sum
    }
}
