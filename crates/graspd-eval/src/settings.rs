//! Which metrics are computed, and how.

use std::str::FromStr;

use graspd_settings::{ANY, Ranges, Validate, between, ranges};
use serde::{Deserialize, Serialize};

use crate::EvaluationError;
use crate::displacement::{DisplacementSettings, PhysicsEngine, ShakeSettings};
use crate::ferrari_canny::ForceLimit;
use crate::hull::VolumeSettings;
use crate::wrench_space::FRICTION_EDGES;

/// Which metrics to compute; default: all.
///
/// Reads from a list such as `ca,iv,sd`: `ca` contact area, `iv` interpenetration volume, `pd` penetration depth,
/// `spd` self-penetration depth, `gws` wrench space (epsilon and volume), `sd` displacement, `sd6` mean displacement
/// over six directions, `shake` the shake test, `all`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Metrics {
    /// Contact area.
    pub contact_area: bool,
    /// Interpenetration volume.
    pub interpenetration_volume: bool,
    /// Maximum penetration depth.
    pub max_penetration: bool,
    /// Penetration of the hand into itself.
    #[serde(default)]
    pub self_penetration: bool,
    /// Epsilon and volume of the grasp wrench space.
    pub wrench_space: bool,
    /// Simulation displacement along the protocol's gravity.
    pub displacement: bool,
    /// Mean simulation displacement over six directions of gravity: six simulations.
    pub displacement_mean6: bool,
    /// The shake test: six longer simulations.
    #[serde(default)]
    pub shake: bool,
}

impl Metrics {
    /// All metrics.
    pub const ALL: Self = Self {
        contact_area: true,
        interpenetration_volume: true,
        max_penetration: true,
        self_penetration: true,
        wrench_space: true,
        displacement: true,
        displacement_mean6: true,
        shake: true,
    };
    /// No metrics.
    pub const NONE: Self = Self {
        contact_area: false,
        interpenetration_volume: false,
        max_penetration: false,
        self_penetration: false,
        wrench_space: false,
        displacement: false,
        displacement_mean6: false,
        shake: false,
    };

    /// Returns whether any of them looks at the hand's surface.
    pub(crate) fn needs_surface(&self) -> bool {
        self.contact_area || self.max_penetration || self.wrench_space
    }

    /// Returns whether any of them is a simulation.
    pub(crate) fn needs_physics(&self) -> bool {
        self.displacement || self.displacement_mean6 || self.shake
    }
}

impl Default for Metrics {
    fn default() -> Self {
        Self::ALL
    }
}

impl FromStr for Metrics {
    type Err = EvaluationError;

    fn from_str(list: &str) -> Result<Self, EvaluationError> {
        let mut metrics = Self::NONE;
        for name in list.split(',').map(str::trim) {
            match name {
                "all" => metrics = Self::ALL,
                "ca" => metrics.contact_area = true,
                "iv" => metrics.interpenetration_volume = true,
                "pd" => metrics.max_penetration = true,
                "spd" => metrics.self_penetration = true,
                "gws" => metrics.wrench_space = true,
                "sd" => metrics.displacement = true,
                "sd6" => metrics.displacement_mean6 = true,
                "shake" => metrics.shake = true,
                _ => return Err(EvaluationError::UnknownMetric { name: name.into() }),
            }
        }
        Ok(metrics)
    }
}

/// How grasps are judged; every metric is against the object's true mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct EvaluationSettings {
    /// Which metrics to compute.
    pub metrics: Metrics,
    /// Side of the voxels of the contact area, the interpenetration volume and the contacts \[m\] (paper: 1 mm).
    pub voxel_size: f64,
    /// A surface voxel is in contact if its centre's signed distance is below this \[m\] (paper: 0).
    pub contact_threshold: f64,
    /// A point of the hand's surface this near to the object, or inside it, is a contact of the wrench space \[m\].
    pub contact_tolerance: f64,
    /// Friction coefficient of the wrench space (paper: that of its contact model, 0.8).
    pub friction: f64,
    /// Edges of the friction pyramids of the wrench space.
    pub friction_edges: usize,
    /// Largest torque about the normal per unit of normal force \[m\]: 0 for hard fingers, whose contacts are points.
    pub torsional_friction: f64,
    /// What torques are divided by to be commensurate with forces \[m\]; by default the largest distance of the
    /// object's surface from its centre of mass.
    pub torque_scale: Option<f64>,
    /// Whether the normal forces that epsilon allows are limited in sum (L1, the paper's) or each (L-infinity). The
    /// volume is always that of the former's wrench space.
    pub force_limit: ForceLimit,
    /// The effort for the wrench space's volume.
    pub volume: VolumeSettings,
    /// Which physics engine simulates.
    pub engine: PhysicsEngine,
    /// The simulation's protocol.
    pub displacement: DisplacementSettings,
    /// The shake test's constants.
    pub shake: ShakeSettings,
}

impl Default for EvaluationSettings {
    fn default() -> Self {
        Self {
            metrics: Metrics::ALL,
            voxel_size: 1e-3,
            contact_threshold: 0.0,
            contact_tolerance: 0.5e-3,
            friction: 0.8,
            friction_edges: FRICTION_EDGES,
            torsional_friction: 0.0,
            torque_scale: None,
            force_limit: ForceLimit::Sum,
            volume: VolumeSettings::default(),
            engine: PhysicsEngine::default(),
            displacement: DisplacementSettings::default(),
            shake: ShakeSettings::default(),
        }
    }
}

/// The supplementary material of the paper, Grasp'D (ECCV 2022), on its metrics.
const PAPER_METRICS: &str = "Grasp'D A.6";
const PAPER_SIMULATION: &str = "Grasp'D A.5";

impl Validate for Metrics {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            contact_area: ANY,
            interpenetration_volume: ANY,
            max_penetration: ANY,
            self_penetration: ANY,
            wrench_space: ANY,
            displacement: ANY,
            displacement_mean6: ANY,
            shake: ANY,
        }
        .source(PAPER_METRICS)
    }
}

impl Validate for EvaluationSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            // Below a tenth of a millimetre the voxels of one hand fill the memory.
            voxel_size: between(1e-4, 0.1).unit("m").source(PAPER_METRICS),
            contact_threshold: between(-0.01, 0.01).unit("m").source(PAPER_METRICS),
            contact_tolerance: between(0.0, 0.01).unit("m"),
            friction: between(0.0, 10.0).source(PAPER_SIMULATION),
            friction_edges: between(3.0, 64.0),
            torsional_friction: between(0.0, 1.0).unit("m"),
            torque_scale: between(1e-4, 100.0).unit("m").source(PAPER_METRICS),
        }
        .with("force_limit", &(), ANY.source(PAPER_METRICS))
        .with("engine", &(), ANY)
        .nested("metrics", &self.metrics)
        .nested("volume", &self.volume)
        .nested("displacement", &self.displacement)
        .nested("shake", &self.shake)
        .source("docs/metrics.md")
    }
}

impl EvaluationSettings {
    /// Half the diagonal of a voxel \[m\].
    pub(crate) fn half_diagonal(&self) -> f64 {
        0.5 * 3.0_f64.sqrt() * self.voxel_size
    }

    /// Returns how far from the object the centres of surface voxels matter to some metric \[m\].
    pub(crate) fn reach(&self) -> f64 {
        (self.contact_tolerance + self.half_diagonal()).max(self.contact_threshold)
    }
}
