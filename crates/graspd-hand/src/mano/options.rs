//! What of a skinned model a hand is made with.

use super::model::SkinnedModel;
use crate::HandError;

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
    /// [`HandError::BadOption`] naming the option.
    pub fn validate(&self, model: &SkinnedModel) -> Result<(), HandError> {
        let bad = |option, value: String, remedy| {
            Err(HandError::BadOption {
                option,
                value,
                remedy,
            })
        };
        if self.shape.len() > model.shape_count() {
            let value = format!("{} numbers", self.shape.len());
            return bad("shape", value, "the model has fewer shape parameters");
        }
        if let Some(value) = self
            .shape
            .iter()
            .find(|value| !(-LARGEST_SHAPE..=LARGEST_SHAPE).contains(*value))
        {
            return bad(
                "shape",
                value.to_string(),
                "give numbers from -10 to 10, in standard deviations",
            );
        }
        if self.components == 0 {
            return bad("components", "0".into(), "give 1 to 45");
        }
        Ok(())
    }
}

/// Shape parameters are counted in standard deviations: hands beyond this are no hands.
const LARGEST_SHAPE: f64 = 10.0;
