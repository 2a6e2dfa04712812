//! What of a skinned model a hand is made with.

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
