//! The physics engines that can run the displacement and the shake test inside this program.

use serde::{Deserialize, Serialize};

use super::bodies::{DynamicObject, FixedHand};
use super::protocol::{DisplacementSettings, World};
use super::world;
use crate::EvaluationError;

/// Name and version of the built-in solver, as records keep it; the version counts up whenever results change.
///
/// Records that say `rapier` without a version are of an earlier version of this solver, which solved contacts in
/// rapier's order.
pub(crate) const GRASPD_ENGINE: &str = "graspd 1";
/// Name and version of rapier, as records keep it.
#[cfg(any(test, feature = "rapier"))]
pub(super) const RAPIER_ENGINE: &str = "rapier 0.36.1";

/// Which engine simulates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PhysicsEngine {
    /// The built-in solver for one object against a fixed hand.
    #[default]
    Graspd,
    /// The general engine rapier; needs the feature `rapier` of this crate.
    Rapier,
}

impl PhysicsEngine {
    /// Returns name and version, as records keep them.
    ///
    /// # Errors
    /// [`EvaluationError::MissingEngine`] where this program was built without the engine.
    pub fn label(self) -> Result<&'static str, EvaluationError> {
        match self {
            Self::Graspd => Ok(GRASPD_ENGINE),
            #[cfg(any(test, feature = "rapier"))]
            Self::Rapier => Ok(RAPIER_ENGINE),
            #[cfg(not(any(test, feature = "rapier")))]
            Self::Rapier => Err(EvaluationError::MissingEngine { engine: "rapier" }),
        }
    }

    /// Builds the world of a protocol; `settings` are valid.
    pub(super) fn world(
        self,
        object: &DynamicObject,
        hand: &FixedHand,
        settings: &DisplacementSettings,
    ) -> Result<Box<dyn World>, EvaluationError> {
        match self {
            Self::Graspd => Ok(Box::new(world::ContactWorld::new(object, hand, settings))),
            #[cfg(any(test, feature = "rapier"))]
            Self::Rapier => Ok(Box::new(super::rapier::RapierWorld::new(
                object, hand, settings,
            ))),
            #[cfg(not(any(test, feature = "rapier")))]
            Self::Rapier => Err(EvaluationError::MissingEngine { engine: "rapier" }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_label_of_rapier_names_the_version_in_use() {
        let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../../Cargo.toml");
        let manifest = std::fs::read_to_string(manifest).unwrap();
        let version = RAPIER_ENGINE.strip_prefix("rapier ").unwrap();
        assert!(manifest.contains(&format!("rapier3d-f64 = \"={version}\"")));
    }

    #[test]
    fn engines_are_named_in_lower_case() {
        assert_eq!(
            serde_json::to_string(&PhysicsEngine::Rapier).unwrap(),
            "\"rapier\""
        );
        assert_eq!(PhysicsEngine::default().label().unwrap(), GRASPD_ENGINE);
    }
}
