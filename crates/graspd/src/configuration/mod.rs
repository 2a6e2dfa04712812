//! Every number of a run in one tree, put together from a preset, files and flags.
//!
//! The tree is that of `run.toml`: the structs that the pipeline itself takes, under `settings`, `execution` and
//! `evaluation`. There is no second list of the defaults: keys and values are those that serialising the structs gives.

mod descriptions;
mod layers;
#[cfg(test)]
mod tests;
mod tree;

use graspd_eval::EvaluationSettings;
use graspd_geom::SdfSampling;
use serde::{Deserialize, Serialize};

pub use descriptions::{Parameter, parameter};
pub use layers::{ConfigurationEntry, ConfigurationLayers, Origin, ResolvedConfiguration};
pub(crate) use layers::{is_section, nearest_key};
pub(crate) use tree::{at as leaf_at, leaves as table_leaves};

use crate::GraspError;
use crate::execution::ExecutionSettings;
use crate::object::{PAPER_PADDING, PAPER_RESOLUTION};
use crate::preset::SynthesisSettings;

/// Starts of a run; paper: 10 (supplementary A.6).
const USUAL_GRASPS: usize = 10;
/// Samples of a distance grid along each axis: fewer make no cell, and more fill gigabytes.
const RESOLUTIONS: std::ops::RangeInclusive<usize> = 2..=1024;

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

impl Configuration {
    /// The defaults of everything else, with these settings of the optimisation.
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

    /// How the distance grid is sampled.
    pub fn sdf_sampling(&self) -> SdfSampling {
        SdfSampling::exact(self.sdf_resolution, self.sdf_padding_m)
    }

    /// Checks every field.
    ///
    /// # Errors
    /// Names the first field that is out of range.
    pub fn validate(&self) -> Result<(), GraspError> {
        let invalid = |field, value, wanted| {
            Err(GraspError::InvalidSetting {
                field,
                value,
                wanted,
            })
        };
        if self.grasps == 0 {
            return invalid("n (the number of grasps)", 0.0, "at least 1");
        }
        if !RESOLUTIONS.contains(&self.sdf_resolution) {
            let value = self.sdf_resolution as f64;
            return invalid("sdf_resolution", value, "2 to 1024");
        }
        if !(0.0..=1.0).contains(&self.sdf_padding_m) {
            return invalid("sdf_padding_m", self.sdf_padding_m, "0 to 1 m");
        }
        self.settings.validate()?;
        self.execution.validate()?;
        self.evaluation.validate()?;
        Ok(())
    }
}
