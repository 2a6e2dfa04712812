//! The loops over contacts: the whole cost of a step is here.

use graspd_ad::{Dual, Element, Kernel, Lanes, Real, vectorize};
use graspd_geom::Vec3;
use graspd_hand::{HandScratch, POINT_PADDING, PointBuffer};

use crate::contact::ContactState;
use crate::fused::{FusedKernel, TargetRule};
use crate::object::SimulatedObject;
use crate::params::{ContactParams, Twist, Wrench};

/// Numbers in a wrench: the torque's three, then the force's three.
pub(crate) const WRENCH_LEN: usize = 6;

/// A float type that contacts can be evaluated in, to be used through a [`Scene`](crate::Scene).
///
/// Implemented by `f64`, the reference: one contact at a time; and by `f32`: eight contacts at a time in the widest
/// vector registers of the machine. Both run the same code.
pub trait Precision: Element {
    /// How many contacts are evaluated at a time.
    const CONTACTS_AT_A_TIME: usize;
    /// Whether hands give what rounding has left of the contacts' coordinates.
    #[doc(hidden)]
    const HAS_REMAINDER: bool;

    /// What rounding left of the coordinates of contact points, if it is kept, `[n]`.
    #[doc(hidden)]
    fn remainder(scratch: &HandScratch) -> Option<&PointBuffer<Self>>;

    /// The wrench of every contact for every object velocity, `[blocks of 8][J][6][8]`.
    fn wrenches(contacts: &ContactLoop<'_, Self>, wrenches: &mut [Self]);

    /// L_phys \[N^2, and (N m)^2 for torques\], each contact counted `weight` times, `[n]`; writes its derivative by the
    /// contact positions to `gradient`, `[n]`. `targets`: laid out as the wrenches.
    fn physics_loss(
        contacts: &ContactLoop<'_, Self>,
        weight: &[Self],
        targets: &[Self],
        gradient: &mut PointBuffer<Self>,
    ) -> f64;

    /// Writes the derivative of sum_j sum_c pull_j . f_c(q, v_j) by the contact positions, each contact counted `weight`
    /// times, to `gradient`, `[n]`. `pull`: one for each velocity, `[J]`.
    fn pulled_wrenches(
        contacts: &ContactLoop<'_, Self>,
        weight: &[Self],
        pull: &[Wrench<f64>],
        gradient: &mut PointBuffer<Self>,
    );

    /// Runs a [`FusedKernel`].
    #[doc(hidden)]
    fn fused<R: TargetRule<Self>>(kernel: FusedKernel<'_, Self, R>) -> f64;
}

impl Precision for f64 {
    const CONTACTS_AT_A_TIME: usize = 1;
    const HAS_REMAINDER: bool = false;
    fn remainder(_scratch: &HandScratch) -> Option<&PointBuffer<f64>> {
        None
    }
    fn wrenches(contacts: &ContactLoop<'_, f64>, wrenches: &mut [f64]) {
        WrenchKernel { contacts, wrenches }.run_with::<f64>();
    }
    fn physics_loss(
        contacts: &ContactLoop<'_, f64>,
        weight: &[f64],
        targets: &[f64],
        gradient: &mut PointBuffer<f64>,
    ) -> f64 {
        LossKernel {
            contacts,
            weight,
            targets,
            gradient,
        }
        .run_with::<f64>()
    }
    fn pulled_wrenches(
        contacts: &ContactLoop<'_, f64>,
        weight: &[f64],
        pull: &[Wrench<f64>],
        gradient: &mut PointBuffer<f64>,
    ) {
        PullKernel {
            contacts,
            weight,
            pull,
            gradient,
        }
        .run_with::<f64>();
    }
    fn fused<R: TargetRule<f64>>(kernel: FusedKernel<'_, f64, R>) -> f64 {
        kernel.run_with::<f64>()
    }
}

impl Precision for f32 {
    const CONTACTS_AT_A_TIME: usize = Lanes::LANES;
    const HAS_REMAINDER: bool = true;
    fn remainder(scratch: &HandScratch) -> Option<&PointBuffer<f32>> {
        Some(scratch.contact_remainder())
    }
    fn wrenches(contacts: &ContactLoop<'_, f32>, wrenches: &mut [f32]) {
        vectorize(WrenchKernel { contacts, wrenches });
    }
    fn physics_loss(
        contacts: &ContactLoop<'_, f32>,
        weight: &[f32],
        targets: &[f32],
        gradient: &mut PointBuffer<f32>,
    ) -> f64 {
        vectorize(LossKernel {
            contacts,
            weight,
            targets,
            gradient,
        })
    }
    fn pulled_wrenches(
        contacts: &ContactLoop<'_, f32>,
        weight: &[f32],
        pull: &[Wrench<f64>],
        gradient: &mut PointBuffer<f32>,
    ) {
        vectorize(PullKernel {
            contacts,
            weight,
            pull,
            gradient,
        });
    }
    fn fused<R: TargetRule<f32>>(kernel: FusedKernel<'_, f32, R>) -> f64 {
        vectorize(kernel)
    }
}

/// The contacts of a hand at an object, as the loops over them read them: made by a [`Scene`](crate::Scene).
pub struct ContactLoop<'a, E> {
    pub(crate) object: &'a SimulatedObject,
    pub(crate) velocities: &'a [Twist<f64>],
    pub(crate) contact: ContactParams,
    pub(crate) smoothing: f64,
    pub(crate) length_scale: f64,
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
        let (distance, gradient) = if E::HAS_REMAINDER {
            sdf.distance_and_gradient_of_sum(point, load(self.remainder, first))
        } else {
            sdf.distance_and_gradient(point)
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

struct WrenchKernel<'a, E> {
    contacts: &'a ContactLoop<'a, E>,
    wrenches: &'a mut [E],
}

impl<E: Precision> WrenchKernel<'_, E> {
    #[inline(always)]
    fn run_with<L: Real<Element = E>>(self) {
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

impl Kernel for WrenchKernel<'_, f32> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        self.run_with::<L>();
    }
}

struct PullKernel<'a, E> {
    contacts: &'a ContactLoop<'a, E>,
    weight: &'a [E],
    pull: &'a [Wrench<f64>],
    gradient: &'a mut PointBuffer<E>,
}

impl<E: Element> PullKernel<'_, E> {
    #[inline(always)]
    fn run_with<L: Real<Element = E>>(self) {
        let contacts = self.contacts;
        for first in (0..contacts.points.len()).step_by(L::LANES) {
            let point = contacts.point::<L>(first);
            let state = contacts.state(Vec3::new(
                Dual::<L, 3>::variable(point.x, 0),
                Dual::variable(point.y, 1),
                Dual::variable(point.z, 2),
            ));
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

impl Kernel for PullKernel<'_, f32> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        self.run_with::<L>();
    }
}

struct LossKernel<'a, E> {
    contacts: &'a ContactLoop<'a, E>,
    weight: &'a [E],
    targets: &'a [E],
    gradient: &'a mut PointBuffer<E>,
}

impl<E: Precision> LossKernel<'_, E> {
    #[inline(always)]
    fn run_with<L: Real<Element = E>>(self) -> f64 {
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

impl Kernel for LossKernel<'_, f32> {
    type Output = f64;
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) -> f64 {
        self.run_with::<L>()
    }
}
