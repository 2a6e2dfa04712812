//! Unit and source of every key. No values: those are in the presets and in the defaults of the structs.

/// What is known about a key besides its value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Unit; empty for names, switches and ratios.
    pub unit: &'static str,
    /// Where the number is from: a section of the paper (A.2 and the like: its supplementary material), the released
    /// code, the protocol that the paper follows, or this project's own measurements.
    pub source: &'static str,
    /// Whether `settings.steps` stretches it.
    pub stretches: bool,
}

const PAPER_3: &str = "Grasp'D 3";
const START: &str = "Grasp'D A.2";
const MESH: &str = "Grasp'D A.3";
const SIMULATION: &str = "Grasp'D A.5";
const JUDGE: &str = "Grasp'D A.6";
const OPTIMISER: &str = "Grasp'D A.7";
const RELEASED: &str = "released code";
const GANHAND: &str = "GANHand, by A.6";
const OWN: &str = "lab/tuning.md";
const EXECUTION: &str = "docs/hands.md";
const OWN_JUDGE: &str = "docs/judge.md";
const EVALUATION: &str = "lab/evaluation.md";
const RUN: &str = "of the run";

/// (key, unit, source); a name that ends in `*` is for all keys that begin so, and the first that fits counts.
const PARAMETERS: &[(&str, &str, &str)] = &[
    ("seed", "", RUN),
    ("grasps", "", JUDGE),
    ("sdf_resolution", "samples a side", MESH),
    ("sdf_padding_m", "m", MESH),
    ("settings.preset", "", OWN),
    ("settings.steps", "steps", START),
    ("settings.smoothing_steps", "steps", START),
    ("settings.smoothing_margin", "m", START),
    ("settings.standoff", "m", START),
    ("settings.force_rate", "N or N m a step", OPTIMISER),
    ("settings.translation_rate", "m a step", OPTIMISER),
    ("settings.rotation_rate", "rad a step", OPTIMISER),
    ("settings.articulation_rate", "rad or m a step", OPTIMISER),
    ("settings.pose_uses_adam", "", OPTIMISER),
    ("settings.warmup_steps", "steps", RELEASED),
    ("settings.decay_start", "steps", OWN),
    ("settings.decay_factor", "", OWN),
    ("settings.force_decay_factor", "", OWN),
    ("settings.relaxation_weight", "", RELEASED),
    ("settings.range_weight", "N^2/rad^2", OWN),
    ("settings.intersection_weight", "k_n^2", OWN),
    ("settings.clamp_joints", "", OWN),
    ("settings.task_limit", "m^2/s^2", OPTIMISER),
    ("settings.joint_limit", "rad^2", OPTIMISER),
    ("settings.damping", "", OPTIMISER),
    ("settings.normal_stiffness", "N/m", SIMULATION),
    ("settings.soft_stiffness", "N/m", OWN),
    ("settings.stiffening_start", "steps", OWN),
    ("settings.stiffening_end", "steps", OWN),
    ("settings.friction_stiffness", "N s/m^2", SIMULATION),
    ("settings.friction_coefficient", "", SIMULATION),
    ("settings.leak", "", SIMULATION),
    ("settings.time_step", "s", SIMULATION),
    ("settings.object_velocities", "m/s", PAPER_3),
    ("settings.density", "kg/m^3", RELEASED),
    ("settings.length_scale", "", RELEASED),
    ("settings.block_coordinate", "", RELEASED),
    ("settings.relaxation", "", PAPER_3),
    ("settings.constraint_method", "", OPTIMISER),
    ("settings.conformity.candidates", "starts", OWN),
    ("settings.conformity.promising", "starts", OWN),
    ("settings.conformity.finalists", "starts", OWN),
    ("settings.conformity.imbalance_discount", "", OWN),
    ("settings.conformity.closure_discount", "", OWN),
    ("settings.conformity.firm_closure", "", OWN),
    ("settings.conformity.coarse_samples", "points", OWN),
    ("settings.conformity.fine_samples", "points", OWN),
    ("settings.conformity.core_samples", "balls", OWN),
    ("settings.conformity.dense_samples", "points", OWN),
    ("settings.conformity.densest_samples", "points", OWN),
    (
        "settings.conformity.projection_iterations",
        "iterations",
        OWN,
    ),
    ("settings.conformity.retreat_iterations", "iterations", OWN),
    ("settings.conformity.deepest", "m", OWN),
    ("settings.conformity.rigid_deepest", "m", OWN),
    ("settings.conformity.limit_weight", "", OWN),
    ("settings.conformity.core_weights", "", OWN),
    ("settings.conformity.coarse_iterations", "iterations", OWN),
    ("settings.conformity.fine_iterations", "iterations", OWN),
    ("settings.conformity.reach", "m", OWN),
    ("settings.conformity.depth", "m", OWN),
    ("settings.conformity.most_depth", "m", OWN),
    ("settings.conformity.rigid_most_depth", "m", OWN),
    ("settings.conformity.depth_scale", "m", OWN),
    ("settings.conformity.deep_weights", "", OWN),
    ("settings.conformity.posture_weight", "points", OWN),
    ("settings.conformity.intersection_weight", "points/mm", OWN),
    ("settings.annealing.amplitudes", "", EVALUATION),
    ("settings.annealing.virtual_contacts", "points", EVALUATION),
    ("settings.annealing.checked_points", "points", EVALUATION),
    ("settings.annealing.attempts", "neighbours", EVALUATION),
    ("settings.annealing.alignment", "m", EVALUATION),
    ("settings.annealing.reach", "m", EVALUATION),
    ("settings.annealing.kept", "states", EVALUATION),
    ("settings.annealing.apart", "m", EVALUATION),
    ("settings.annealing.approach", "m", EVALUATION),
    ("settings.annealing.contact_depth", "m", EVALUATION),
    ("settings.annealing.friction", "", EVALUATION),
    ("execution.retreat", "m", EXECUTION),
    ("execution.squeeze", "m", EXECUTION),
    ("execution.squeeze_force", "N", EXECUTION),
    ("evaluation.metrics.*", "", JUDGE),
    ("evaluation.voxel_size", "m", JUDGE),
    ("evaluation.contact_threshold", "m", JUDGE),
    ("evaluation.contact_tolerance", "m", OWN_JUDGE),
    ("evaluation.friction", "", SIMULATION),
    ("evaluation.friction_edges", "", OWN_JUDGE),
    ("evaluation.torsional_friction", "m", OWN_JUDGE),
    ("evaluation.torque_scale", "m", JUDGE),
    ("evaluation.force_limit", "", JUDGE),
    ("evaluation.volume.relative_half_width", "", OWN_JUDGE),
    ("evaluation.volume.*", "", OWN_JUDGE),
    ("evaluation.displacement.mass", "kg", GANHAND),
    ("evaluation.displacement.gravity", "m/s^2", GANHAND),
    ("evaluation.displacement.gravity_direction", "", RELEASED),
    ("evaluation.displacement.time_step", "s", GANHAND),
    ("evaluation.displacement.steps", "steps", GANHAND),
    (
        "evaluation.displacement.solver_iterations",
        "iterations",
        GANHAND,
    ),
    ("evaluation.displacement.friction", "", JUDGE),
    ("evaluation.displacement.*", "", GANHAND),
    ("evaluation.shake.mass", "kg", OWN_JUDGE),
    ("evaluation.shake.acceleration", "m/s^2", OWN_JUDGE),
    ("evaluation.shake.duration", "s", OWN_JUDGE),
    ("evaluation.shake.time_step", "s", OWN_JUDGE),
    (
        "evaluation.shake.solver_iterations",
        "iterations",
        OWN_JUDGE,
    ),
    ("evaluation.shake.most_displacement", "m", OWN_JUDGE),
    ("evaluation.shake.most_rotation", "rad", OWN_JUDGE),
    ("evaluation.shake.friction", "", OWN_JUDGE),
];

/// What [`SynthesisSettings::with_steps`](crate::SynthesisSettings::with_steps) stretches.
const STRETCHED: [&str; 5] = [
    "settings.smoothing_steps",
    "settings.warmup_steps",
    "settings.decay_start",
    "settings.stiffening_start",
    "settings.stiffening_end",
];

fn fits(name: &str, key: &str) -> bool {
    match name.strip_suffix('*') {
        Some(start) => key.starts_with(start),
        None => key == name,
    }
}

/// Where a key stands among the others.
pub(super) fn place(key: &str) -> usize {
    let found = PARAMETERS.iter().position(|(name, ..)| fits(name, key));
    found.unwrap_or(PARAMETERS.len())
}

/// What is known about a key; nothing about one that does not exist.
pub fn parameter(key: &str) -> Parameter {
    let found = PARAMETERS.get(place(key));
    let (unit, source) = found.map_or(("", ""), |(_, unit, source)| (*unit, *source));
    Parameter {
        unit,
        source,
        stretches: STRETCHED.contains(&key),
    }
}

#[cfg(test)]
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    PARAMETERS.iter().map(|(name, ..)| *name)
}
