//! A hand at an object: where gradients of the simulated losses with respect to the hand's pose are computed.

use graspd_geom::Vec3;
use graspd_hand::{
    Hand, HandPose, HandScratch, Kinematics, POINT_PADDING, PointBuffer, PoseGradient,
};

use crate::fused::{ForceWeights, FusedKernel, TargetRule};
use crate::kernel::{ContactLoop, LossKernel, Precision, PullKernel, WRENCH_LEN, WrenchKernel};
use crate::losses::intersection_loss_gradient;
use crate::object::SimulatedObject;
use crate::params::{ContactParams, SimulationParams, Twist, Wrench};
use crate::step::{step_twist, task_loss};
use crate::targets::TargetWrenches;

/// The outcome of the simulated steps under a set of contact wrenches.
#[derive(Clone, Debug)]
pub struct TaskOutcome {
    /// L_task, see [`task_loss`].
    pub loss: f64,
    /// dL_task / d(total wrench) = 2 dt M^-1 twist', for each velocity; the same for the wrench at each contact,
    /// `[J]`.
    pub wrench_gradient: Vec<Wrench<f64>>,
}

/// The contacts as the kernels read them; a macro, since a method would borrow the outputs too.
macro_rules! contact_loop {
    ($scene:ident) => {
        ContactLoop {
            object: $scene.object,
            velocities: &$scene.params.velocities,
            contact: $scene.contact,
            smoothing: $scene.smoothing,
            length_scale: $scene.params.length_scale,
            nearest_sample_outside: $scene.params.nearest_sample_outside,
            points: &$scene.contacts,
            remainder: E::remainder(&$scene.scratch)
                .filter(|remainder| remainder.len() == $scene.contacts.len())
                .unwrap_or(&$scene.no_remainder),
        }
    };
}

/// One hand, one object and all working memory of one optimisation; a step through it allocates nothing.
///
/// `E` is the precision that contacts are evaluated in: `f64`, the reference, one contact at a time, or `f32`,
/// eight at a time in vector registers. Each contact is evaluated as a dual number over its own position, and the
/// position derivatives are pulled back to the pose by the hand.
///
/// Contact wrenches, and targets for them, are stored as `[blocks of 8 contacts][J][6][8]`, torque before force:
/// number k of the wrench of contact c for velocity j is at `((c / 8 * J + j) * 6 + k) * 8 + c % 8`. Padding
/// (weight 0 in [`ContactPoints`](graspd_hand::ContactPoints)) has wrenches too, which count nowhere; its targets
/// must stay 0.
pub struct Scene<'a, E> {
    hand: &'a dyn Hand,
    object: &'a SimulatedObject,
    params: &'a SimulationParams,
    contact: ContactParams,
    smoothing: f64,
    scratch: HandScratch,
    contacts: PointBuffer<E>,
    /// Zeros, for hands that tell none; empty where none is needed.
    no_remainder: PointBuffer<E>,
    contact_gradient: PointBuffer<E>,
    spheres: PointBuffer<E>,
    sphere_gradient: PointBuffer<E>,
    weight: Vec<E>,
    wrenches: Vec<E>,
    task: TaskOutcome,
    twists_after: Vec<Twist<f64>>,
}

impl<'a, E: Precision> Scene<'a, E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    /// A scene with the object undilated; call [`Scene::place`] before anything else.
    ///
    /// `params`: valid ones, see [`Validate::validate`](graspd_settings::Validate::validate).
    pub fn new(
        hand: &'a dyn Hand,
        object: &'a SimulatedObject,
        params: &'a SimulationParams,
    ) -> Self {
        let points = hand.contact_points();
        let len = points.weight.len();
        let spheres = hand.collision_spheres().radius.len();
        let velocities = params.velocities.len();
        Self {
            hand,
            object,
            params,
            contact: params.contact,
            smoothing: 0.0,
            scratch: hand.new_scratch(),
            contacts: PointBuffer::zeros(len),
            no_remainder: PointBuffer::zeros(if E::HAS_REMAINDER { len } else { 0 }),
            contact_gradient: PointBuffer::zeros(len),
            spheres: PointBuffer::zeros(spheres),
            sphere_gradient: PointBuffer::zeros(spheres),
            weight: points
                .weight
                .iter()
                .map(|&w| E::constant(f64::from(w)))
                .collect(),
            wrenches: vec![E::constant(0.0); len * velocities * WRENCH_LEN],
            task: TaskOutcome {
                loss: 0.0,
                wrench_gradient: vec![
                    Wrench {
                        torque: Vec3::zero(),
                        force: Vec3::zero(),
                    };
                    velocities
                ],
            },
            twists_after: params.velocities.clone(),
        }
    }

    /// How many numbers a set of target wrenches has: 6 J for each contact, padding included.
    pub fn wrench_len(&self) -> usize {
        self.wrenches.len()
    }

    /// Target wrenches for [`Scene::move_targets`], all 0.
    pub fn new_targets(&self) -> TargetWrenches<E> {
        TargetWrenches::new(&self.weight, self.params.velocities.len(), E::MAX_LANES)
    }

    /// Sets the radius r by which the object is dilated \[m\] (coarse-to-fine smoothing): contacts feel the distance
    /// phi - r.
    pub fn set_smoothing(&mut self, radius: f64) {
        self.smoothing = radius;
    }

    /// Replaces the contact law's constants, for stiffness that changes along an optimisation.
    pub fn set_contact(&mut self, contact: ContactParams) {
        self.contact = contact;
    }

    /// Moves the hand; wrenches, losses and gradients stay those of the earlier pose until they are asked for again.
    pub fn place(&mut self, pose: &HandPose) {
        self.hand.forward(
            pose,
            &mut self.scratch,
            &mut self.contacts,
            &mut self.spheres,
        );
    }

    /// The signed distance \[m\] of the contact point that is closest to (or deepest in) the undilated object.
    pub fn closest_distance(&self) -> f64 {
        let sdf = self.object.sdf();
        (0..self.contacts.len())
            .map(|i| sdf.distance(self.contacts.get(i)))
            .fold(f64::INFINITY, f64::min)
    }

    /// The contact points in the object frame, padding included.
    pub fn contacts(&self) -> &PointBuffer<E> {
        &self.contacts
    }

    /// The contact wrenches of the last [`Scene::contact_wrenches`], in \[N m\] and \[N\].
    pub fn wrenches(&self) -> &[E] {
        &self.wrenches
    }

    /// Evaluates f_c(q, v_j), the wrench of every contact for every object velocity.
    pub fn contact_wrenches(&mut self) {
        let contacts = contact_loop!(self);
        E::vectorize(WrenchKernel {
            contacts: &contacts,
            wrenches: &mut self.wrenches,
        });
    }

    /// L_phys = sum_j sum_c ||f_c(q, v_j) - target_jc||^2 \[N^2, and (N m)^2 for torques\], keeping its derivative
    /// by the contact positions for [`Scene::pull_back`].
    ///
    /// The derivative is exact in each cell of the distance grid, and leaks where contacts do not touch. It jumps
    /// where a contact meets the surface, a face of a cell, or the corner between sticking and sliding; what it is
    /// there is said at [`ContactState`](crate::ContactState) and at [`SdfGrid`](graspd_geom::SdfGrid). With
    /// targets 0, what does not touch has no derivative, as its residual is 0.
    ///
    /// # Panics
    /// If `targets` is not [`Scene::wrench_len`] long.
    pub fn physics_loss(&mut self, targets: &[E]) -> f64 {
        assert_eq!(
            targets.len(),
            self.wrenches.len(),
            "one target for each wrench"
        );
        let contacts = contact_loop!(self);
        E::vectorize(LossKernel {
            contacts: &contacts,
            weight: &self.weight,
            targets,
            gradient: &mut self.contact_gradient,
        })
    }

    /// Steps the object under the target wrenches from each velocity: L_task and its gradient. Depends neither on the
    /// pose nor on the contacts, and all numbers of `targets` count.
    ///
    /// # Panics
    /// If `targets` is not [`Scene::wrench_len`] long.
    pub fn task(&mut self, targets: &[E]) -> &TaskOutcome {
        assert_eq!(
            targets.len(),
            self.wrenches.len(),
            "one target for each wrench"
        );
        let velocities = self.params.velocities.len();
        for j in 0..velocities {
            let total = total_wrench(targets, None, velocities, j);
            self.step_object(j, &total);
        }
        self.finish_task()
    }

    /// [`Scene::task`] for the targets that [`Scene::move_targets`] moves, which keep their sums.
    ///
    /// # Panics
    /// If `targets` are not those of [`Scene::new_targets`].
    pub fn task_of_moved_targets(&mut self, targets: &TargetWrenches<E>) -> &TaskOutcome {
        self.check_targets(targets);
        for j in 0..self.params.velocities.len() {
            self.step_object(j, &targets.total(j));
        }
        self.finish_task()
    }

    fn check_targets(&self, targets: &TargetWrenches<E>) {
        assert_eq!(
            targets.shared(),
            self.wrenches.len(),
            "targets made by this scene"
        );
    }

    /// Steps the object from velocity `j`.
    fn step_object(&mut self, j: usize, total: &Wrench<f64>) {
        let twist = &self.params.velocities[j];
        let total = self.per_mass(total);
        self.twists_after[j] = step_twist(self.object, twist, &total, self.params.time_step);
    }

    /// A wrench divided by how much mass and inertia are larger in the simulation: s^3 and s^5.
    fn per_mass(&self, wrench: &Wrench<f64>) -> Wrench<f64> {
        let scale = self.params.length_scale;
        Wrench {
            torque: wrench.torque * scale.powi(-5),
            force: wrench.force * scale.powi(-3),
        }
    }

    /// L_task and its gradient from the twists after the step.
    fn finish_task(&mut self) -> &TaskOutcome {
        self.task.loss = task_loss(&self.twists_after);
        for j in 0..self.twists_after.len() {
            // d||twist'||^2 / d wrench = 2 dt M^-1 twist', since M is symmetric.
            let twist = self.twists_after[j];
            let doubled = self.per_mass(&Wrench {
                torque: twist.angular * 2.0,
                force: twist.linear * 2.0,
            });
            let change = self
                .object
                .impulse_response(&doubled, self.params.time_step);
            self.task.wrench_gradient[j] = Wrench {
                torque: change.angular,
                force: change.linear,
            };
        }
        &self.task
    }

    /// The gradient of `physics_weight` L_phys + `task_weight` L_task with respect to the target wrenches, with the
    /// contact wrenches of the last [`Scene::contact_wrenches`] and the outcome of the last [`Scene::task`].
    ///
    /// `gradient` is overwritten; it is 0 at padding.
    ///
    /// # Panics
    /// If `targets` or `gradient` is not [`Scene::wrench_len`] long.
    pub fn target_gradient(
        &self,
        targets: &[E],
        physics_weight: f64,
        task_weight: f64,
        gradient: &mut [E],
    ) {
        assert_eq!(
            (targets.len(), gradient.len()),
            (self.wrenches.len(), self.wrenches.len()),
            "one target and one slot for each wrench"
        );
        let velocities = self.params.velocities.len();
        let physics = E::constant(2.0 * physics_weight);
        let stride = POINT_PADDING * WRENCH_LEN;
        let blocks = gradient
            .chunks_exact_mut(stride * velocities)
            .zip(targets.chunks_exact(stride * velocities))
            .zip(self.wrenches.chunks_exact(stride * velocities))
            .zip(self.weight.chunks_exact(POINT_PADDING));
        for (((gradient, targets), wrenches), weight) in blocks {
            for (j, wrench) in self.task.wrench_gradient.iter().enumerate() {
                let (torque, force) = (wrench.torque, wrench.force);
                let task = [torque.x, torque.y, torque.z, force.x, force.y, force.z];
                for (k, task) in task.into_iter().enumerate() {
                    let task = E::constant(task_weight * task);
                    let range =
                        j * stride + k * POINT_PADDING..j * stride + (k + 1) * POINT_PADDING;
                    let rows = gradient[range.clone()]
                        .iter_mut()
                        .zip(&targets[range.clone()])
                        .zip(&wrenches[range])
                        .zip(weight);
                    for (((slot, &target), &wrench), &weight) in rows {
                        *slot = weight * (physics * (target - wrench) + task);
                    }
                }
            }
        }
    }

    /// Moves the targets by one iteration of `rule` against `weights.physics` L_phys + `weights.task` L_task, then
    /// returns L_phys with the new targets, keeping its derivative by the contact positions for
    /// [`Scene::pull_back`]: the force step and most of the pose step in one pass over the contacts.
    ///
    /// Up to rounding this is [`Scene::contact_wrenches`], [`Scene::target_gradient`] with the outcome of the last
    /// [`Scene::task`] or [`Scene::task_of_moved_targets`], the optimiser's step, and [`Scene::physics_loss`]; what
    /// holds for those holds here. The wrenches are not kept.
    ///
    /// # Panics
    /// If `targets` are not those of [`Scene::new_targets`], or `rule` knows fewer than
    /// [`TargetWrenches::state_len`] of them.
    pub fn move_targets<R: TargetRule<E>>(
        &mut self,
        weights: ForceWeights,
        rule: &mut R,
        targets: &mut TargetWrenches<E>,
    ) -> f64 {
        self.check_targets(targets);
        E::vectorize(FusedKernel {
            contacts: &contact_loop!(self),
            weight: &self.weight,
            force_weights: weights,
            task_gradient: &self.task.wrench_gradient,
            rule,
            targets,
            gradient: &mut self.contact_gradient,
        })
    }

    /// L_task of the contacts' own wrenches, keeping `weight(L_task)` times its derivative by the contact positions
    /// for [`Scene::pull_back`]: the task constraint without targets in between. The derivative has the kinks of
    /// [`Scene::physics_loss`], and leaks where contacts do not touch.
    pub fn task_of_contacts(&mut self, weight: impl FnOnce(f64) -> f64) -> f64 {
        self.contact_wrenches();
        let velocities = self.params.velocities.len();
        for j in 0..velocities {
            let total = total_wrench(&self.wrenches, Some(&self.weight), velocities, j);
            self.step_object(j, &total);
        }
        let loss = self.finish_task().loss;
        let weight = weight(loss);
        for pull in &mut self.task.wrench_gradient {
            pull.torque = pull.torque * weight;
            pull.force = pull.force * weight;
        }
        let contacts = contact_loop!(self);
        E::vectorize(PullKernel {
            contacts: &contacts,
            weight: &self.weight,
            pull: &self.task.wrench_gradient,
            gradient: &mut self.contact_gradient,
        });
        loss
    }

    /// L_inter \[m^2\], see [`intersection_loss_gradient`], keeping `weight` times its derivative by the sphere
    /// centres for [`Scene::pull_back`].
    pub fn intersection_loss(&mut self, weight: f64) -> f64 {
        intersection_loss_gradient(
            &self.spheres,
            self.hand.collision_spheres(),
            weight,
            &mut self.sphere_gradient,
        )
    }

    /// The derivative of the last [`Scene::physics_loss`] plus `weight` times the last
    /// [`Scene::intersection_loss`] with respect to the pose that the hand was placed at; a loss that has not been
    /// asked for counts as 0. `gradient` is overwritten.
    pub fn pull_back(&mut self, pose: &HandPose, gradient: &mut PoseGradient) {
        self.hand.pullback(
            pose,
            &mut self.scratch,
            &self.contacts,
            &self.contact_gradient,
            &self.spheres,
            &self.sphere_gradient,
            gradient,
        );
    }
}

/// The sum of the wrenches of velocity `j` over all contacts, each counted `weight` times if that is given, `[n]`.
fn total_wrench<E: Precision>(
    wrenches: &[E],
    weight: Option<&[E]>,
    velocities: usize,
    j: usize,
) -> Wrench<f64> {
    let stride = POINT_PADDING * WRENCH_LEN;
    let mut sums = [0.0; WRENCH_LEN];
    for (number, block) in wrenches.chunks_exact(stride * velocities).enumerate() {
        let rows = block[j * stride..(j + 1) * stride].chunks_exact(POINT_PADDING);
        let counts = weight.map(|weight| &weight[number * POINT_PADDING..][..POINT_PADDING]);
        for (sum, row) in sums.iter_mut().zip(rows) {
            *sum += match counts {
                Some(counts) => row
                    .iter()
                    .zip(counts)
                    .map(|(v, w)| v.lane(0) * w.lane(0))
                    .sum(),
                None => row.iter().map(|v| v.lane(0)).sum::<f64>(),
            };
        }
    }
    let [tx, ty, tz, fx, fy, fz] = sums;
    Wrench {
        torque: Vec3::new(tx, ty, tz),
        force: Vec3::new(fx, fy, fz),
    }
}
