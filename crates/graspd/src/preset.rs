//! Every number that the synthesis depends on, and the named sets of them.

use graspd_fit::{DepthSettings, SkinFitSettings};
use graspd_geom::Vec3;
use graspd_opt::{AdamSettings, OptimizerKind, Schedule};
use graspd_settings::{
    ANY, AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Ranges, Validate, ranges,
};
use graspd_sim::{ContactParams, SimulationParams, Twist};
use serde::{Deserialize, Serialize};

use crate::GraspError;
use crate::ablation::ConstraintMethod;
use crate::annealing::AnnealingSettings;

/// The settings of one synthesis. [`Default`] is the preset that measures best.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SynthesisSettings {
    /// Name of the preset that these settings come from.
    pub preset: String,
    /// Optimiser steps; paper: 7000. Setting it sets the iterations of `skin_fit`, too.
    pub steps: usize,
    /// Steps over which the dilation radius falls to 0; 0 switches coarse-to-fine off; paper: 5000.
    pub smoothing_steps: usize,
    /// The dilation radius starts at the closest hand-object distance less this \[m\]; paper: 0.01.
    pub smoothing_margin: f64,
    /// Distance of the palm from the approach point at the start \[m\]; paper: 0.1.
    pub standoff: f64,

    /// Learning rate of the target wrenches \[N or N m a step\]; paper: 1e-2.
    pub force_rate: f64,
    /// Learning rate of the base's position \[m a step\]; paper: 3e-3.
    pub translation_rate: f64,
    /// Learning rate of the base's rotation \[rad a step\]; paper: 3e-3.
    pub rotation_rate: f64,
    /// Learning rate of the joints \[rad or m a step\]; paper: 3e-3.
    pub articulation_rate: f64,
    /// Optimiser of the pose: true for Adam, false for Adamax; paper: Adamax.
    pub pose_uses_adam: bool,
    /// Steps over which the pose rates rise from 0.
    pub warmup_steps: usize,
    /// Step after which the pose rates decay exponentially.
    pub decay_start: usize,
    /// What the pose rates have decayed to at the last step, as a fraction; 1 for no decay.
    pub decay_factor: f64,
    /// The same for the rate of the target wrenches.
    pub force_decay_factor: f64,

    /// Weight of L_phys in the force step; released code: 1e-2.
    pub relaxation_weight: f64,
    /// Weight of L_range in the pose step \[N^2/rad^2\].
    pub range_weight: f64,
    /// Weight of L_inter in the pose step, in units of k_n^2: with 1, links that overlap by some depth count as
    /// much as a contact of that depth.
    pub intersection_weight: f64,
    /// Keep the joints within their limits after every step, besides the constraint on L_limit; paper: no.
    pub clamp_joints: bool,
    /// C_task; paper: 1e-4.
    pub task_limit: f64,
    /// C_limit \[rad^2\]; paper: 1e-4.
    pub joint_limit: f64,
    /// Damping of both constraints; paper: 1.
    pub damping: f64,

    /// k_n \[N/m\]; paper: 1e6.
    pub normal_stiffness: f64,
    /// k_n at the start \[N/m\]; it stays there until `stiffening_start`, grows exponentially to
    /// `normal_stiffness` at `stiffening_end`, and k_f along with it; paper: constant.
    pub soft_stiffness: f64,
    /// Step at which the contacts begin to stiffen.
    pub stiffening_start: usize,
    /// Step at which the contacts have their full stiffness.
    pub stiffening_end: usize,
    /// k_f \[N s/m^2\]; paper: 1e8.
    pub friction_stiffness: f64,
    /// mu; paper: 0.8.
    pub friction_coefficient: f64,
    /// alpha of the leaky gradient; paper: 0.1.
    pub leak: f64,
    /// Length of the simulated step \[s\]; paper: 1e-5.
    pub time_step: f64,
    /// The object's velocities before the step \[m/s\], `[J, 3]`.
    pub object_velocities: Vec<[f64; 3]>,
    /// Density of the object \[kg/m^3\]; released code: 1000.
    pub density: f64,

    /// s: all happens to a hand and an object s times as large as they are, with these same constants: the rate of the
    /// base's position, margin, standoff and stiffnesses are of that larger world; paper: 1, released code: 2.
    #[serde(default = "one")]
    pub length_scale: f64,
    /// Whether L_range, L_limit, L_inter and the limits at the end apply to hands with a soft skin (the layout of
    /// MANO), too; paper: no.
    #[serde(default = "yes")]
    pub soft_hand_losses: bool,
    /// Does what the released code does where neither the paper nor another setting says so: the object's mass, the
    /// units and the multiplier of the task constraint, the rotation among the joints, one optimiser for both blocks,
    /// and distances outside the grid, see [`SynthesisSettings::released`].
    #[serde(default)]
    pub released_code: bool,
    /// Moves the base first and then, with L_phys evaluated anew, the joints; released code: yes, paper: both at once.
    #[serde(default)]
    pub block_coordinate: bool,
    /// The paper's problem relaxation: the task constraint is on target wrenches, which L_phys ties
    /// to the real contact wrenches. Without it, the constraint is on the real ones, by the pose
    /// alone.
    #[serde(default = "yes")]
    pub relaxation: bool,
    /// How constraints are enforced; paper: MDMM.
    #[serde(default)]
    pub constraint_method: ConstraintMethod,

    /// Solves by steps of second order through a smoothed contact law, from the best of several starts; of the rest
    /// above, the task, the contact law and the density say what the forces are. The paper does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skin_fit: Option<SkinFitSettings>,

    /// Plans by simulated annealing instead, `steps` of it; of all else here only density and standoff count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub annealing: Option<AnnealingSettings>,
}

/// The presets by name.
pub const PRESETS: [&str; 6] = ["default", "fast", "soft", "paper", "released", "annealing"];

fn one() -> f64 {
    1.0
}

fn yes() -> bool {
    true
}

impl Default for SynthesisSettings {
    /// The preset `default`, chosen by measurement (`lab/tuning.md`): the second-order solver.
    fn default() -> Self {
        let skin_fit = SkinFitSettings::default();
        Self {
            preset: "default".into(),
            skin_fit: Some(skin_fit.clone()),
            ..Self::soft().with_steps(skin_fit.iterations)
        }
    }
}

/// Sections of the paper, Grasp'D (ECCV 2022), and others, that the defaults are from.
const PAPER: &str = "Grasp'D 3";
const PAPER_START: &str = "Grasp'D A.2";
const PAPER_SIMULATION: &str = "Grasp'D A.5";
const PAPER_OPTIMIZER: &str = "Grasp'D A.7";
const RELEASED: &str = "released code";
const MEASURED: &str = "lab/tuning.md";

impl Validate for SynthesisSettings {
    fn ranges(&self) -> Ranges {
        // Rates do not grow.
        let decay = FRACTION.more_than(0.0);
        // Without stiffening, its span may be empty.
        let is_stiffening = self.soft_stiffness < self.normal_stiffness;
        let start = if is_stiffening {
            self.stiffening_start as f64
        } else {
            -1.0
        };
        ranges! { self =>
            preset: ANY,
            steps: AT_LEAST_ONE.unit("steps").source(PAPER_START),
            smoothing_steps: NOT_NEGATIVE.unit("steps").source(PAPER_START),
            smoothing_margin: NOT_NEGATIVE.unit("m").source(PAPER_START),
            standoff: NOT_NEGATIVE.unit("m").source(PAPER_START),
            force_rate: POSITIVE.unit("N or N m a step").source(PAPER_OPTIMIZER),
            translation_rate: POSITIVE.unit("m a step").source(PAPER_OPTIMIZER),
            rotation_rate: POSITIVE.unit("rad a step").source(PAPER_OPTIMIZER),
            articulation_rate: POSITIVE.unit("rad or m a step").source(PAPER_OPTIMIZER),
            pose_uses_adam: ANY.source(PAPER_OPTIMIZER),
            warmup_steps: NOT_NEGATIVE.unit("steps").source(RELEASED),
            decay_start: NOT_NEGATIVE.unit("steps"),
            decay_factor: decay,
            force_decay_factor: decay,
            relaxation_weight: NOT_NEGATIVE.source(RELEASED),
            range_weight: NOT_NEGATIVE.unit("N^2/rad^2"),
            intersection_weight: NOT_NEGATIVE.unit("k_n^2"),
            clamp_joints: ANY,
            task_limit: POSITIVE.unit("m^2/s^2").source(PAPER_OPTIMIZER),
            joint_limit: POSITIVE.unit("rad^2").source(PAPER_OPTIMIZER),
            damping: NOT_NEGATIVE.source(PAPER_OPTIMIZER),
            normal_stiffness: POSITIVE.unit("N/m").source(PAPER_SIMULATION),
            soft_stiffness: POSITIVE.at_most_setting("normal_stiffness", self.normal_stiffness).unit("N/m"),
            stiffening_start: NOT_NEGATIVE.unit("steps"),
            stiffening_end: FINITE.more_than_setting("stiffening_start", start).unit("steps"),
            friction_stiffness: POSITIVE.unit("N s/m^2").source(PAPER_SIMULATION),
            friction_coefficient: NOT_NEGATIVE.source(PAPER_SIMULATION),
            leak: FRACTION.source(PAPER_SIMULATION),
            time_step: POSITIVE.unit("s").source(PAPER_SIMULATION),
            object_velocities: FINITE.unit("m/s").source(PAPER),
            density: POSITIVE.unit("kg/m^3").source(RELEASED),
            length_scale: POSITIVE.source(RELEASED),
            soft_hand_losses: ANY.source(PAPER_OPTIMIZER),
            released_code: ANY.source(RELEASED),
            block_coordinate: ANY.source(RELEASED),
            relaxation: ANY.source(PAPER),
        }
        .with("constraint_method", &(), ANY.source(PAPER_OPTIMIZER))
        .require("constraint_method.penalty.weight", &self.constraint_method.penalty_weight(), POSITIVE)
        .require("object_velocities (their number)", &self.object_velocities.len(), AT_LEAST_ONE)
        .source(MEASURED)
        .nested("skin_fit", &self.skin_fit)
        .nested("annealing", &self.annealing)
    }
}

impl SynthesisSettings {
    /// The simulation by itself, made to settle. It departs from [`SynthesisSettings::paper`] in
    /// six ways: contacts are soft while the hand finds its place and stiffen at the end; rates
    /// decay, so that the last steps settle; joints are kept within their limits; the object has to
    /// be stopped from four directions (the corners of a tetrahedron) instead of one line; the
    /// final stiffness is lower; and soft hands have the losses of the others.
    pub fn soft() -> Self {
        Self {
            preset: "soft".into(),
            decay_start: 3500,
            decay_factor: 0.003,
            force_decay_factor: 0.01,
            clamp_joints: true,
            soft_hand_losses: true,
            normal_stiffness: 3e4,
            friction_stiffness: 3e6,
            soft_stiffness: 1e4,
            stiffening_start: 5000,
            stiffening_end: 6500,
            object_velocities: vec![
                [0.0; 3],
                [0.01, 0.01, 0.01],
                [0.01, -0.01, -0.01],
                [-0.01, 0.01, -0.01],
                [-0.01, -0.01, 0.01],
            ],
            ..Self::paper()
        }
    }

    /// The preset `default` with fewer points and iterations, but as many starts: these are worth more
    /// (`lab/tuning.md`). Soft skin is pressed in less, as far as makes contact for each volume what it is with
    /// [`SynthesisSettings::paper`].
    pub fn fast() -> Self {
        let usual = SkinFitSettings::default();
        let skin_fit = SkinFitSettings {
            promising: 5,
            iterations: 40,
            projection_iterations: 5,
            coarse_samples: 250,
            fine_samples: 1000,
            soft: DepthSettings {
                target_depth: 6e-4,
                depth_limit: 1.55e-3,
                dense_samples: 4000,
            },
            rigid: DepthSettings {
                dense_samples: 200_000,
                ..usual.rigid
            },
            ..usual
        };
        Self {
            preset: "fast".into(),
            skin_fit: Some(skin_fit.clone()),
            ..Self::default().with_steps(skin_fit.iterations)
        }
    }

    /// The paper's numbers to the letter. Where it is silent: L_range and L_inter are weighted so that they
    /// act at the scale of contact forces, and rates are in metres and radians.
    pub fn paper() -> Self {
        let contact = ContactParams::default();
        Self {
            preset: "paper".into(),
            steps: 7000,
            smoothing_steps: 5000,
            smoothing_margin: 0.01,
            standoff: 0.1,
            force_rate: 1e-2,
            translation_rate: 3e-3,
            rotation_rate: 3e-3,
            articulation_rate: 3e-3,
            pose_uses_adam: false,
            warmup_steps: 0,
            decay_start: 7000,
            decay_factor: 1.0,
            force_decay_factor: 1.0,
            relaxation_weight: 1e-2,
            range_weight: 1.0,
            intersection_weight: 1.0,
            clamp_joints: false,
            task_limit: 1e-4,
            joint_limit: 1e-4,
            damping: 1.0,
            normal_stiffness: contact.normal_stiffness,
            soft_stiffness: contact.normal_stiffness,
            stiffening_start: 0,
            stiffening_end: 7000,
            friction_stiffness: contact.friction_stiffness,
            friction_coefficient: contact.friction_coefficient,
            leak: contact.leak,
            time_step: 1e-5,
            object_velocities: vec![[0.0; 3], [0.01; 3], [-0.01; 3]],
            density: 1000.0,
            length_scale: 1.0,
            soft_hand_losses: false,
            released_code: false,
            block_coordinate: false,
            relaxation: true,
            constraint_method: ConstraintMethod::Mdmm,
            skin_fit: None,
            annealing: None,
        }
    }

    /// Not this method but one to compare with: simulated annealing on the contact energy, 70 000 steps, see
    /// [`anneal`](crate::anneal).
    pub fn annealing() -> Self {
        Self {
            preset: "annealing".into(),
            annealing: Some(AnnealingSettings::default()),
            ..Self::paper().with_steps(70_000)
        }
    }

    /// What the authors' released code does where it differs from the paper: Adam for the pose, at a lower rate for
    /// the base's position and after a warm-up; 10 000 steps; hand and object at twice their size; the base's position
    /// first, and then, with L_phys evaluated anew, its rotation and the joints. And by `released_code`:
    /// * every object weighs 4.71 kg at that size, with the centre of mass near the mesh's origin, see
    ///   `released.rs`;
    /// * the task constraint is 1e5 L_task < 10, which makes its damping 100 times as strong; its multiplier never
    ///   falls by less violation, and moves by Adamax; the targets' rate has the warm-up, too;
    /// * one Adam sees the whole gradient in both blocks' steps, of which each block takes its part;
    /// * outside the grid the distance is the nearest sample's plus that to the grid's box;
    /// * what does not touch leaks sliding friction at every speed.
    pub fn released() -> Self {
        Self {
            preset: "released".into(),
            steps: 10_000,
            stiffening_end: 10_000,
            translation_rate: 1e-3,
            pose_uses_adam: true,
            warmup_steps: 200,
            decay_start: 10_000,
            length_scale: 2.0,
            released_code: true,
            block_coordinate: true,
            ..Self::paper()
        }
    }

    /// The preset of that name.
    ///
    /// # Errors
    /// If there is none; names those that exist.
    pub fn preset(name: &str) -> Result<Self, GraspError> {
        match name {
            "default" => Ok(Self::default()),
            "fast" => Ok(Self::fast()),
            "soft" => Ok(Self::soft()),
            "paper" => Ok(Self::paper()),
            "released" => Ok(Self::released()),
            "annealing" => Ok(Self::annealing()),
            _ => Err(GraspError::UnknownPreset {
                name: name.into(),
                known: PRESETS.join(", "),
            }),
        }
    }

    /// The same schedule stretched or squeezed to `steps` steps, or iterations of the second-order solver.
    pub fn with_steps(mut self, steps: usize) -> Self {
        let scale =
            |value: usize| (value as f64 * steps as f64 / self.steps as f64).round() as usize;
        self.stiffening_start = scale(self.stiffening_start);
        // Even a run of one step has a stiffening span that is not empty.
        self.stiffening_end = scale(self.stiffening_end).max(self.stiffening_start + 1);
        let (smoothing, warmup, decay) = (
            scale(self.smoothing_steps),
            scale(self.warmup_steps),
            scale(self.decay_start),
        );
        self.smoothing_steps = smoothing;
        self.warmup_steps = warmup;
        self.decay_start = decay;
        self.steps = steps;
        if let Some(skin_fit) = &mut self.skin_fit {
            skin_fit.iterations = steps;
        }
        self
    }

    /// The simulation's part of the settings; its lengths are real ones.
    pub fn simulation(&self) -> SimulationParams {
        SimulationParams {
            contact: ContactParams {
                // A depth is `length_scale` times as large in the larger world.
                normal_stiffness: self.length_scale * self.normal_stiffness,
                friction_stiffness: self.length_scale * self.friction_stiffness,
                friction_coefficient: self.friction_coefficient,
                leak: self.leak,
                slides_at_zero_depth: self.released_code,
            },
            time_step: self.time_step,
            velocities: self
                .object_velocities
                .iter()
                .map(|&linear| Twist {
                    linear: linear.into(),
                    angular: Vec3::zero(),
                })
                .collect(),
            length_scale: self.length_scale,
            nearest_sample_outside: self.released_code,
        }
    }

    /// A length of the larger world in the real one \[m\].
    pub(crate) fn real_length(&self, length: f64) -> f64 {
        length / self.length_scale
    }

    /// By how much the contacts are softer than at the end, at each step.
    pub(crate) fn softness(&self) -> Result<Schedule, GraspError> {
        let softness = self.normal_stiffness / self.soft_stiffness;
        let schedule = Schedule::constant(softness)?;
        if softness == 1.0 {
            return Ok(schedule);
        }
        let (start, end) = (self.stiffening_start, self.stiffening_end);
        Ok(schedule.with_exponential_decay(start, end, 1.0 / softness)?)
    }

    /// The factor on the pose rates at each step.
    pub(crate) fn pose_decay(&self) -> Result<Schedule, GraspError> {
        self.decaying(self.warming_up()?, self.decay_factor)
    }

    /// The factor on the rate of the target wrenches at each step.
    pub(crate) fn force_decay(&self) -> Result<Schedule, GraspError> {
        let rate = if self.released_code {
            self.warming_up()?
        } else {
            Schedule::constant(1.0)?
        };
        self.decaying(rate, self.force_decay_factor)
    }

    fn warming_up(&self) -> Result<Schedule, GraspError> {
        Ok(Schedule::constant(1.0)?.with_warm_up(self.warmup_steps.max(1))?)
    }

    fn decaying(&self, rate: Schedule, factor: f64) -> Result<Schedule, GraspError> {
        if factor >= 1.0 || self.decay_start >= self.steps {
            return Ok(rate);
        }
        Ok(rate.with_exponential_decay(self.decay_start, self.steps, factor)?)
    }

    pub(crate) fn pose_optimizer(&self) -> OptimizerKind {
        if self.pose_uses_adam {
            OptimizerKind::Adam(AdamSettings::default())
        } else {
            OptimizerKind::Adamax(AdamSettings::default())
        }
    }
}
