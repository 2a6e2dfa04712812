//! What of a skinned model a hand is made with.

use graspd_settings::{AT_LEAST_ONE, OutOfRange, between, ranges};

use super::model::SkinnedModel;

/// How a skinned hand is made from its [`SkinnedModel`](crate::SkinnedModel).
#[derive(Clone, Debug, PartialEq)]
pub struct SkinnedHandOptions {
    /// Shape parameters, in order; those not given are 0 (the mean shape).
    pub shape: Vec<f64>,
    /// How many pose components to use; the model's own number where it has fewer. 45 are all of MANO's.
    pub components: usize,
    /// Count poses from the flat hand instead of from the model's mean pose.
    pub flat_mean: bool,
    /// Whether spheres keep the fingers from passing through each other.
    pub collision_spheres: bool,
}

impl Default for SkinnedHandOptions {
    fn default() -> Self {
        Self {
            shape: Vec::new(),
            components: 45,
            flat_mean: false,
            collision_spheres: true,
        }
    }
}

impl SkinnedHandOptions {
    /// Checks the options against a model.
    ///
    /// # Errors
    /// Names the option that is out of range.
    pub fn validate(&self, model: &SkinnedModel) -> Result<(), OutOfRange> {
        let count = between(0.0, model.shape_count() as f64).unit("parameters");
        ranges! { self =>
            // Standard deviations: what lies beyond this is no hand.
            shape: between(-10.0, 10.0),
            components: AT_LEAST_ONE,
        }
        .require("shape", &self.shape.len(), count)
        .check()
    }
}
