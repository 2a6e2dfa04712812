//! The optimisation of one grasp: a force step and a pose step, over and over.

use graspd_ad::Real;
use graspd_geom::Quaternion;
use graspd_hand::{
    Hand, HandPose, Kinematics, Limit, POINT_PADDING, PoseGradient, clamp_to_limits,
};
use graspd_opt::{
    AdamSettings, Adamax, AdamaxIteration, Constraint, InequalityForm, Optimizer, ParameterGroup,
    Schedule,
};
use graspd_settings::Validate;
use graspd_sim::{
    ContactParams, ForceWeights, Precision, Scene, SimulatedObject, SimulationParams, TargetRule,
    TargetWrenches, limit_loss_gradient, range_loss_gradient,
};

use crate::GraspError;
use crate::ablation::ConstraintMethod;
use crate::preset::SynthesisSettings;
use crate::released::with_released_mass;

/// The losses at one step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// L_phys \[N^2\].
    pub physics: f64,
    /// L_task of the target wrenches.
    pub task: f64,
    /// L_range \[rad^2\].
    pub range: f64,
    /// L_limit \[rad^2\].
    pub limit: f64,
    /// L_inter \[m^2\].
    pub intersection: f64,
}

/// Where an optimisation ended.
#[derive(Clone, Debug)]
pub struct Synthesis {
    /// The grasp, its joints within their limits (those of a soft hand only with `soft_hand_losses`).
    pub pose: HandPose,
    /// The losses before the last step.
    pub losses: Losses,
    /// Whether the task constraint held then.
    pub task_satisfied: bool,
    /// Steps taken.
    pub steps: usize,
}

/// Optimises one grasp from a start. `observe` sees the step's number, the pose and the losses before each step moves
/// them.
///
/// `E` is the precision of the contact evaluation: `f32` for speed, `f64` as the reference.
///
/// # Errors
/// If a setting is out of range.
///
/// # Source
/// Grasp'D (ECCV 2022), section 3 and supplementary A.2, A.5, A.7.
pub fn synthesize<E: Precision>(
    hand: &dyn Hand,
    object: &SimulatedObject,
    start: HandPose,
    settings: &SynthesisSettings,
    observe: &mut dyn FnMut(usize, &HandPose, &Losses),
) -> Result<Synthesis, GraspError>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    settings.validate()?;
    let simulation = settings.simulation();
    let released;
    let object = if settings.released_code {
        released = with_released_mass(object, settings.length_scale)?;
        &released
    } else {
        object
    };
    let mut state = Optimization::<E>::new(hand, object, &simulation, start, settings)?;
    let smoothing = state.smoothing_schedule()?;
    let softness = settings.softness()?;
    for step in 0..settings.steps {
        state.scene.set_smoothing(smoothing.value(step));
        state.contact = contact_at(&simulation.contact, softness.value(step));
        state.scene.set_contact(state.contact);
        state.scene.place(&state.pose);
        state.force_step(step);
        state.pose_gradient();
        observe(step, &state.pose, &state.losses);
        state.pose_step(step);
    }
    Ok(state.finish())
}

/// The contact law with both stiffnesses divided by `softness`.
fn contact_at(contact: &ContactParams, softness: f64) -> ContactParams {
    ContactParams {
        normal_stiffness: contact.normal_stiffness / softness,
        friction_stiffness: contact.friction_stiffness / softness,
        ..*contact
    }
}

/// The constraint value < limit, in a unit in which one damping and one rate suit constraints of any limit.
struct RelativeConstraint {
    unit: f64,
    constraint: Constraint,
    has_multiplier: bool,
}

impl RelativeConstraint {
    /// In units of the limit.
    fn new(limit: f64, settings: &SynthesisSettings) -> Self {
        Self::in_parts(limit, 1.0, settings)
    }
    /// In units of the limit's part of which there are `parts` in it.
    fn in_parts(limit: f64, parts: f64, settings: &SynthesisSettings) -> Self {
        // With a multiplier that stays 0, damping is a quadratic penalty.
        let (damping, has_multiplier) = match settings.constraint_method {
            ConstraintMethod::Mdmm => (settings.damping, true),
            ConstraintMethod::Penalty { weight } => (weight, false),
        };
        Self {
            unit: limit / parts,
            constraint: Constraint::less_than(parts).with_damping(damping),
            has_multiplier,
        }
    }
    /// In units of a tenth of the limit, and with a multiplier that moves as in the released code.
    fn released(limit: f64, settings: &SynthesisSettings) -> Result<Self, GraspError> {
        let mut made = Self::in_parts(limit, 10.0, settings);
        made.constraint = (made.constraint)
            .with_form(InequalityForm::Max)
            .with_adamax(AdamSettings::default())?;
        Ok(made)
    }
    /// d Lagrangian / d value.
    fn weight(&self, value: f64) -> f64 {
        self.constraint.weight(value / self.unit) / self.unit
    }
    fn ascend(&mut self, rate: f64, value: f64) {
        if self.has_multiplier {
            self.constraint.ascend(rate, value / self.unit);
        }
    }
}

/// Adamax as the rule by which target wrenches move.
struct AdamaxRule<'a, E>(AdamaxIteration<'a, E>);

impl<E: Precision> TargetRule<E> for AdamaxRule<'_, E> {
    #[inline(always)]
    fn update<T: Real<Element = E>>(&mut self, first: usize, gradient: [T; 6]) -> [T; 6] {
        self.0.update(first, POINT_PADDING, gradient)
    }
    #[inline(always)]
    fn inherit<T: Real<Element = E>>(&mut self, from: usize, to: usize) {
        self.0.inherit::<T, 6>(from, to, POINT_PADDING);
    }
}

/// Targets that stay where they are, and only pass on what Adamax remembers of them.
struct HeldRule<'a, E>(&'a mut Adamax<E>);

impl<E: Precision> TargetRule<E> for HeldRule<'_, E> {
    #[inline(always)]
    fn update<T: Real<Element = E>>(&mut self, _first: usize, _gradient: [T; 6]) -> [T; 6] {
        [T::zero(); 6]
    }
    #[inline(always)]
    fn inherit<T: Real<Element = E>>(&mut self, from: usize, to: usize) {
        self.0.inherit::<T, 6>(from, to, POINT_PADDING);
    }
}

/// Which part of the pose moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    All,
    Base,
    Joints,
}

/// Everything that changes while one grasp is optimised.
struct Optimization<'a, E: Precision> {
    settings: &'a SynthesisSettings,
    limits: Option<&'a [Limit]>,
    intersection_weight: f64,
    scene: Scene<'a, E>,
    contact: ContactParams,
    pose: HandPose,
    losses: Losses,
    pose_decay: Schedule,
    force_decay: Schedule,

    /// f_hat, the target wrench of each contact for each velocity, and its optimiser.
    targets: TargetWrenches<E>,
    force_optimizer: Adamax<E>,
    task: RelativeConstraint,

    gradient: PoseGradient,
    /// Translation, rotation vector, articulation.
    flat_gradient: Vec<f64>,
    flat_update: Vec<f64>,
    groups: [ParameterGroup; 3],
    pose_optimizer: Box<dyn Optimizer<f64>>,
    /// Of the joints, where they move by themselves and each block counts its own steps.
    joint_optimizer: Box<dyn Optimizer<f64>>,
    limit: RelativeConstraint,
}

impl<'a, E: Precision> Optimization<'a, E>
where
    for<'h> dyn Hand + 'h: Kinematics<E>,
{
    fn new(
        hand: &'a dyn Hand,
        object: &'a SimulatedObject,
        simulation: &'a SimulationParams,
        start: HandPose,
        settings: &'a SynthesisSettings,
    ) -> Result<Self, GraspError> {
        let scene = Scene::<E>::new(hand, object, simulation);
        let targets = scene.new_targets();
        let articulation = start.articulation.len();
        let pose_len = 6 + articulation;
        let group = |range, rate| ParameterGroup { range, rate };
        let has_losses = settings.soft_hand_losses || !hand.is_soft();
        Ok(Self {
            settings,
            limits: hand.limits().filter(|_| has_losses),
            intersection_weight: if has_losses {
                settings.intersection_weight
            } else {
                0.0
            },
            scene,
            contact: simulation.contact,
            pose: start,
            losses: Losses::default(),
            pose_decay: settings.pose_decay()?,
            force_decay: settings.force_decay()?,
            force_optimizer: Adamax::new(targets.state_len(), AdamSettings::default())?,
            targets,
            task: if settings.released_code {
                RelativeConstraint::released(settings.task_limit, settings)?
            } else {
                RelativeConstraint::new(settings.task_limit, settings)
            },
            gradient: PoseGradient::zero(articulation),
            flat_gradient: vec![0.0; pose_len],
            flat_update: vec![0.0; pose_len],
            groups: [
                group(0..3, settings.real_length(settings.translation_rate)),
                group(3..6, settings.rotation_rate),
                group(6..pose_len, settings.articulation_rate),
            ],
            pose_optimizer: settings.pose_optimizer().build(pose_len)?,
            joint_optimizer: settings.pose_optimizer().build(pose_len)?,
            limit: RelativeConstraint::new(settings.joint_limit, settings),
        })
    }

    /// The dilation radius: from the closest hand-object distance less the margin, linearly to 0.
    fn smoothing_schedule(&mut self) -> Result<Schedule, GraspError> {
        if self.settings.smoothing_steps == 0 {
            return Ok(Schedule::constant(0.0)?);
        }
        self.scene.place(&self.pose);
        let margin = self.settings.real_length(self.settings.smoothing_margin);
        let radius = (self.scene.closest_distance() - margin).max(0.0);
        Ok(Schedule::linear(
            radius,
            0.0,
            0,
            self.settings.smoothing_steps,
        )?)
    }

    /// Moves the target wrenches: minimises `relaxation_weight` L_phys subject to L_task < C_task, the pose fixed. The
    /// same pass over the contacts gives L_phys with the new targets, and its derivative, to the pose step.
    fn force_step(&mut self, step: usize) {
        if !self.settings.relaxation {
            self.constrain_contacts();
            return;
        }
        self.losses.task = self.scene.task_of_moved_targets(&self.targets).loss;
        let weights = ForceWeights {
            physics: self.settings.relaxation_weight,
            task: self.task.weight(self.losses.task),
        };
        let rate = self.settings.force_rate * self.force_decay.value(step);
        let mut rule = AdamaxRule(self.force_optimizer.begin_iteration(rate));
        self.losses.physics = self
            .scene
            .move_targets(weights, &mut rule, &mut self.targets);
        self.task.ascend(self.settings.force_rate, self.losses.task);
    }

    /// Instead of the force step, without relaxation: the task constraint on the contacts themselves, for the pose
    /// step.
    fn constrain_contacts(&mut self) {
        let task = &self.task;
        self.losses.task = self.scene.task_of_contacts(|loss| task.weight(loss));
        self.task.ascend(self.settings.force_rate, self.losses.task);
    }

    /// The gradient of L_phys (without relaxation: of the task constraint) + L_range + L_inter and of the joint
    /// limit constraint by the pose, the targets fixed.
    fn pose_gradient(&mut self) {
        let stiffness = self.contact.normal_stiffness;
        self.losses.intersection = self
            .scene
            .intersection_loss(self.intersection_weight * stiffness * stiffness);
        self.scene.pull_back(&self.pose, &mut self.gradient);
        if let Some(limits) = self.limits {
            let articulation = &self.pose.articulation;
            let gradient = &mut self.gradient.articulation;
            let range_weight = self.settings.range_weight;
            self.losses.range = range_loss_gradient(articulation, limits, range_weight, gradient);
            let violation = graspd_sim::limit_loss(articulation, limits);
            let weight = self.limit.weight(violation);
            self.losses.limit = limit_loss_gradient(articulation, limits, weight, gradient);
        }
    }

    /// Moves the pose against its gradient; block by block, with the gradient evaluated anew, if so set.
    fn pose_step(&mut self, step: usize) {
        if self.settings.block_coordinate {
            self.move_pose(step, Block::Base);
            self.scene.place(&self.pose);
            self.evaluate_anew();
            self.pose_gradient();
            self.move_pose(step, Block::Joints);
        } else {
            self.move_pose(step, Block::All);
        }
        self.limit
            .ascend(self.settings.articulation_rate, self.losses.limit);
        if self.settings.clamp_joints {
            self.clamp_joints();
        }
    }

    /// L_phys (without relaxation: the task constraint) at another pose, with the same targets and multipliers.
    fn evaluate_anew(&mut self) {
        if !self.settings.relaxation {
            let task = &self.task;
            self.losses.task = self.scene.task_of_contacts(|loss| task.weight(loss));
            return;
        }
        let nothing = ForceWeights {
            physics: 0.0,
            task: 0.0,
        };
        let mut held = HeldRule(&mut self.force_optimizer);
        self.losses.physics = self
            .scene
            .move_targets(nothing, &mut held, &mut self.targets);
    }

    /// Moves a block of the pose against its gradient, the rotation on its manifold.
    fn move_pose(&mut self, step: usize, block: Block) {
        let gradient = &self.gradient;
        let base = [gradient.translation, gradient.rotation];
        for (slot, v) in self.flat_gradient.chunks_exact_mut(3).zip(base) {
            slot.copy_from_slice(&[v.x, v.y, v.z]);
        }
        self.flat_gradient[6..].copy_from_slice(&gradient.articulation);

        let decay = self.pose_decay.value(step);
        let settings = self.settings;
        let rates = [
            settings.real_length(settings.translation_rate),
            settings.rotation_rate,
            settings.articulation_rate,
        ];
        for (group, rate) in self.groups.iter_mut().zip(rates) {
            group.rate = rate * decay;
        }
        let (optimizer, groups) = match block {
            _ if settings.released_code => (&mut self.pose_optimizer, &self.groups[..]),
            Block::All => (&mut self.pose_optimizer, &self.groups[..]),
            Block::Base => (&mut self.pose_optimizer, &self.groups[..2]),
            Block::Joints => (&mut self.joint_optimizer, &self.groups[2..]),
        };
        optimizer.update_groups(groups, &self.flat_gradient, &mut self.flat_update);
        if settings.released_code {
            // The one optimiser has seen all; only the block moves, and the rotation counts among the joints.
            let held = match block {
                Block::All => 0..0,
                Block::Base => 3..self.flat_update.len(),
                Block::Joints => 0..3,
            };
            self.flat_update[held].fill(0.0);
        }

        let update = &self.flat_update;
        let vector = |first: usize| [update[first], update[first + 1], update[first + 2]].into();
        self.pose.translation += vector(0);
        let turn = Quaternion::exp(vector(3));
        self.pose.rotation = turn.compose(self.pose.rotation).normalize();
        for (value, change) in self.pose.articulation.iter_mut().zip(&update[6..]) {
            *value += change;
        }
    }

    fn clamp_joints(&mut self) {
        if let Some(limits) = self.limits {
            clamp_to_limits(&mut self.pose.articulation, limits);
        }
    }

    /// The result, with the joints put back into their limits.
    fn finish(mut self) -> Synthesis {
        self.clamp_joints();
        Synthesis {
            task_satisfied: self.losses.task < self.settings.task_limit,
            pose: self.pose,
            losses: self.losses,
            steps: self.settings.steps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_task_constraint_of_the_released_code_is_stronger_and_moves_by_adamax() {
        let settings = SynthesisSettings::released();
        let limit = settings.task_limit;
        let mut usual = RelativeConstraint::new(limit, &settings);
        let mut released = RelativeConstraint::released(limit, &settings).unwrap();
        // 1e5 L - 10 = 10 against L / 1e-4 - 1 = 1 at twice the limit.
        let weights = |a: &RelativeConstraint, b: &RelativeConstraint, value: f64| {
            (a.weight(value), b.weight(value))
        };
        let (a, b) = weights(&usual, &released, 2.0 * limit);
        assert!(
            (a - 1e4).abs() < 1e-9 * a && (b - 1e6).abs() < 1e-9 * b,
            "{a} {b}"
        );
        // Plain ascent by rate times violation; Adamax by the rate, whatever the violation.
        for constraint in [&mut usual, &mut released] {
            constraint.ascend(0.01, 3.0 * limit);
        }
        assert!((usual.constraint.multiplier() - 0.02).abs() < 1e-9);
        assert!((released.constraint.multiplier() - 0.01).abs() < 1e-9);
        // Where the limit holds, nothing is left of the multiplier's pull.
        let (a, b) = weights(&usual, &released, 0.99 * limit);
        assert!(a > 0.0 && b == 0.0, "{a} {b}");
    }

    #[test]
    fn the_targets_warm_up_in_the_released_code() {
        let first = |settings: &SynthesisSettings| settings.force_decay().unwrap().value(0);
        let released = SynthesisSettings::released();
        assert_eq!(first(&released), 1.0 / 200.0);
        let other = SynthesisSettings {
            released_code: false,
            ..released
        };
        assert_eq!(first(&other), 1.0);
    }
}
