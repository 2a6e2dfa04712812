//! Both steps of the optimisation in one pass over the contacts.
//!
//! The plain way takes four passes: the wrenches, the gradient by the targets, the optimiser's step, and L_phys
//! with its derivative by the positions. Here each contact is evaluated once, its targets and their optimiser's
//! moments go through memory once, what does not touch is spared the derivatives that are zero anyway, and what
//! never touched has its targets in common with all that never did.

use graspd_ad::{Dual, Element, Kernel, Mask, Real};
use graspd_geom::Vec3;
use graspd_hand::{POINT_PADDING, PointBuffer};

use crate::kernel::{ContactLoop, Precision, WRENCH_LEN};
use crate::params::Wrench;
use crate::targets::TargetWrenches;

/// One iteration of an optimiser, as far as a pass over the contacts needs to know it: by how much targets move, given
/// their gradient.
///
/// The numbers come in rows of 8, one row for each component of a wrench; `update` is given as many of each row as `T`
/// has lanes.
pub trait TargetRule<E: Element> {
    /// By how much the six components of a target wrench move, given the gradient by them. Component k is the target
    /// number `first + 8 k` in the first lane, and those after it in the other lanes.
    ///
    /// Called once for each target in a pass. Mark it `#[inline(always)]`, see [`Kernel::run`].
    fn update<T: Real<Element = E>>(&mut self, first: usize, gradient: [T; 6]) -> [T; 6];

    /// The targets that [`TargetRule::update`] would move for `first = to` take over all that is remembered of those
    /// for `first = from`.
    fn inherit<T: Real<Element = E>>(&mut self, from: usize, to: usize);
}

/// The weights of both losses in the force step: `physics` L_phys + `task` L_task.
#[derive(Clone, Copy, Debug)]
pub struct ForceWeights {
    /// Weight of L_phys.
    pub physics: f64,
    /// Weight of L_task: the derivative of the Lagrangian by it.
    pub task: f64,
}

/// Moves the targets against `weights` L_phys and L_task, then evaluates L_phys with the new targets.
pub(crate) struct FusedKernel<'a, E, R> {
    pub(crate) contacts: &'a ContactLoop<'a, E>,
    /// `[n]`
    pub(crate) weight: &'a [E],
    pub(crate) force_weights: ForceWeights,
    /// dL_task / d(wrench), `[J]`.
    pub(crate) task_gradient: &'a [Wrench<f64>],
    pub(crate) rule: &'a mut R,
    pub(crate) targets: &'a mut TargetWrenches<E>,
    /// dL_phys / d(position), `[n]`.
    pub(crate) gradient: &'a mut PointBuffer<E>,
}

impl<E: Precision, R: TargetRule<E>> Kernel<E> for FusedKernel<'_, E, R> {
    /// L_phys.
    type Output = f64;
    #[inline(always)]
    fn run<L: Real<Element = E>>(mut self) -> f64 {
        assert_eq!(L::LANES, self.targets.lanes, "contacts side by side");
        self.targets.own_sums.fill(E::zero());
        let shared_loss = self.move_shared::<L>();
        let mut total = L::zero();
        for first in (0..self.contacts.points.len()).step_by(L::LANES) {
            let point = self.contacts.point::<L>(first);
            let (distance, slope) = self.contacts.distance(first, point);
            let touches = distance.le(L::zero()).any();
            let mut own = self.targets.own[first / L::LANES];
            if touches && !own {
                self.separate::<L>(first);
                own = true;
            }
            let (loss, gradient) = if touches {
                self.touching(first, point)
            } else if own {
                self.apart(first, point, distance, slope)
            } else {
                (shared_loss, self.never_touched(point, distance, slope))
            };
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
}

impl<E: Precision, R: TargetRule<E>> FusedKernel<'_, E, R> {
    /// The force step of what never touched, once for all: its wrenches are 0. Returns L_phys of one such contact.
    #[inline(always)]
    fn move_shared<L: Real<Element = E>>(&mut self) -> L {
        let (now, before) = (self.targets.shared(), self.targets.shared_before());
        let mut loss = L::zero();
        for j in 0..self.contacts.velocities.len() {
            let row = j * WRENCH_LEN * POINT_PADDING;
            self.inherit::<L>(now + row, before + row);
            let target = self.advance(now + row, j, L::one(), [L::zero(); WRENCH_LEN]);
            for k in 0..WRENCH_LEN {
                let residual = -target[k];
                loss += residual * residual;
                (residual + residual).store(&mut self.targets.pull[row + k * POINT_PADDING..]);
            }
        }
        loss
    }

    /// Gives these contacts targets of their own: those that all others had before this step.
    #[inline(always)]
    fn separate<L: Real<Element = E>>(&mut self, first: usize) {
        let before = self.targets.shared_before();
        for j in 0..self.contacts.velocities.len() {
            let row = j * WRENCH_LEN * POINT_PADDING;
            self.inherit::<L>(before + row, self.contacts.offset(first, j));
        }
        self.targets.own[first / L::LANES] = true;
    }

    /// Copies the targets of one velocity, and what the rule remembers of them.
    #[inline(always)]
    fn inherit<L: Real<Element = E>>(&mut self, from: usize, to: usize) {
        for k in 0..WRENCH_LEN {
            let target = L::load(&self.targets.values[from + k * POINT_PADDING..]);
            target.store(&mut self.targets.values[to + k * POINT_PADDING..]);
        }
        self.rule.inherit::<L>(from, to);
    }

    /// Where some contact touches: each is evaluated with its derivative by its position.
    #[inline(always)]
    fn touching<L: Real<Element = E>>(&mut self, first: usize, point: Vec3<L>) -> (L, Vec3<L>) {
        let contacts = self.contacts;
        let lifted = Vec3::new(
            Dual::<L, 3>::variable(point.x, 0),
            Dual::variable(point.y, 1),
            Dual::variable(point.z, 2),
        );
        let state = contacts.state(first, lifted);
        let mut loss = Dual::<L, 3>::constant(L::zero());
        for j in 0..contacts.velocities.len() {
            let wrench = contacts.wrench(&state, &contacts.velocities[j]);
            let mut value = [L::zero(); WRENCH_LEN];
            for k in 0..WRENCH_LEN {
                value[k] = wrench[k].value;
            }
            let target = self.move_targets(first, j, value);
            for k in 0..WRENCH_LEN {
                let residual = wrench[k] - Dual::constant(target[k]);
                loss += residual * residual;
            }
        }
        let [x, y, z] = loss.derivative;
        (loss.value, Vec3::new(x, y, z))
    }

    /// Where no contact touches: all wrenches are 0, and depend on the position through the depth alone, whose
    /// derivative is the leak. So the chain rule by hand: no derivative goes through the contact law.
    #[inline(always)]
    fn apart<L: Real<Element = E>>(
        &mut self,
        first: usize,
        point: Vec3<L>,
        distance: L,
        slope: Vec3<L>,
    ) -> (L, Vec3<L>) {
        let contacts = self.contacts;
        let state = contacts.state_at(point, distance, slope);
        let (mut loss, mut loss_by_depth) = (L::zero(), L::zero());
        for j in 0..contacts.velocities.len() {
            let target = self.move_targets(first, j, [L::zero(); WRENCH_LEN]);
            let per_depth = contacts.wrench_per_depth(&state, &contacts.velocities[j]);
            for k in 0..WRENCH_LEN {
                let residual = -target[k];
                loss += residual * residual;
                loss_by_depth += (residual + residual) * per_depth[k];
            }
        }
        let depth_by_distance = L::constant(-contacts.contact.leak);
        (loss, slope * (loss_by_depth * depth_by_distance))
    }

    /// Where nothing ever touched: as [`Self::apart`], with the targets that all such contacts share. Their share of
    /// L_phys is known already.
    #[inline(always)]
    fn never_touched<L: Real<Element = E>>(
        &self,
        point: Vec3<L>,
        distance: L,
        slope: Vec3<L>,
    ) -> Vec3<L> {
        let contacts = self.contacts;
        let state = contacts.state_at(point, distance, slope);
        let pulls = self.targets.pull.chunks_exact(WRENCH_LEN * POINT_PADDING);
        let mut loss_by_depth = L::zero();
        for (velocity, pull) in contacts.velocities.iter().zip(pulls) {
            let per_depth = contacts.wrench_per_depth(&state, velocity);
            for k in 0..WRENCH_LEN {
                loss_by_depth += L::load(&pull[k * POINT_PADDING..]) * per_depth[k];
            }
        }
        let depth_by_distance = L::constant(-contacts.contact.leak);
        slope * (loss_by_depth * depth_by_distance)
    }

    /// The force step for one velocity: moves the own targets of these contacts and returns them.
    #[inline(always)]
    fn move_targets<L: Real<Element = E>>(
        &mut self,
        first: usize,
        j: usize,
        wrench: [L; WRENCH_LEN],
    ) -> [L; WRENCH_LEN] {
        let weight = L::load(&self.weight[first..]);
        let target = self.advance(self.contacts.offset(first, j), j, weight, wrench);
        let lane = first % POINT_PADDING;
        let sums = &mut self.targets.own_sums[j * WRENCH_LEN * POINT_PADDING + lane..]
            [..(WRENCH_LEN - 1) * POINT_PADDING + L::LANES];
        for k in 0..WRENCH_LEN {
            let sum = L::load(&sums[k * POINT_PADDING..]) + target[k];
            sum.store(&mut sums[k * POINT_PADDING..]);
        }
        target
    }

    /// Moves the targets for velocity `j` that begin at `offset`, and returns them.
    #[inline(always)]
    fn advance<L: Real<Element = E>>(
        &mut self,
        offset: usize,
        j: usize,
        weight: L,
        wrench: [L; WRENCH_LEN],
    ) -> [L; WRENCH_LEN] {
        let Wrench { torque, force } = self.task_gradient[j];
        let task = [torque.x, torque.y, torque.z, force.x, force.y, force.z];
        let physics = L::constant(2.0 * self.force_weights.physics);
        let end = offset + (WRENCH_LEN - 1) * POINT_PADDING + L::LANES;
        let targets = &mut self.targets.values[offset..end];
        let (mut target, mut gradient) = ([L::zero(); WRENCH_LEN], [L::zero(); WRENCH_LEN]);
        for k in 0..WRENCH_LEN {
            target[k] = L::load(&targets[k * POINT_PADDING..]);
            let task = L::constant(self.force_weights.task * task[k]);
            gradient[k] = weight * (physics * (target[k] - wrench[k]) + task);
        }
        let update = self.rule.update(offset, gradient);
        for k in 0..WRENCH_LEN {
            target[k] += update[k];
            target[k].store(&mut targets[k * POINT_PADDING..]);
        }
        target
    }
}
