//! Every number of a run in one tree, put together from a preset, files and flags.
//!
//! The tree is that of `run.toml`: the structs that the pipeline itself takes, under `settings`, `execution` and
//! `evaluation`. There is no second list of the defaults: keys and values are those that serialising the structs
//! gives.

mod keys;
mod layers;
mod origin;
mod resolved;
#[cfg(test)]
mod tests;
mod tree;

use graspd_eval::EvaluationSettings;
use graspd_geom::SdfSampling;
use graspd_settings::{ANY, AT_LEAST_ONE, Ranges, Validate, between, ranges};
use serde::{Deserialize, Serialize};

pub(crate) use keys::{is_section, nearest_key, present_leaves};
pub use layers::ConfigurationLayers;
pub use origin::Origin;
pub use resolved::{ConfigurationEntry, ResolvedConfiguration};

use crate::execution::ExecutionSettings;
use crate::object::{PAPER_PADDING, PAPER_RESOLUTION};
use crate::preset::SynthesisSettings;

/// Starts of a run; paper: 10 (supplementary A.6).
const USUAL_GRASPS: usize = 10;

/// Everything that grasps depend on besides object and hand.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Configuration {
    /// Seed of the starts.
    pub seed: u64,
    /// How many starts; paper: 10.
    pub grasps: usize,
    /// Samples of the distance grid along each axis; paper: 256.
    pub sdf_resolution: usize,
    /// How far the grid reaches beyond the object's bounding box \[m\]; paper: 0.01.
    pub sdf_padding_m: f64,
    /// The optimisation.
    pub settings: SynthesisSettings,
    /// Pre-grasps and squeezes.
    pub execution: ExecutionSettings,
    /// The judge.
    pub evaluation: EvaluationSettings,
}

impl Default for Configuration {
    fn default() -> Self {
        Self::with_settings(SynthesisSettings::default())
    }
}

impl Validate for Configuration {
    fn ranges(&self) -> Ranges {
        const GRID: &str = "Grasp'D A.3";
        ranges! { self =>
            seed: ANY.source("of the run"),
            grasps: AT_LEAST_ONE.source("Grasp'D A.6"),
            // Fewer make no cell, and more fill gigabytes.
            sdf_resolution: between(2.0, 1024.0).unit("samples a side").source(GRID),
            sdf_padding_m: between(0.0, 1.0).unit("m").source(GRID),
        }
        .nested("settings", &self.settings)
        .nested("execution", &self.execution)
        .nested("evaluation", &self.evaluation)
    }
}

impl Configuration {
    /// Returns the defaults of everything else, with these settings of the optimisation.
    pub fn with_settings(settings: SynthesisSettings) -> Self {
        Self {
            seed: 0,
            grasps: USUAL_GRASPS,
            sdf_resolution: PAPER_RESOLUTION,
            sdf_padding_m: PAPER_PADDING,
            settings,
            execution: ExecutionSettings::default(),
            evaluation: EvaluationSettings::default(),
        }
    }

    /// Returns how the distance grid is sampled.
    pub fn sdf_sampling(&self) -> SdfSampling {
        SdfSampling::exact(self.sdf_resolution, self.sdf_padding_m)
    }
}
