//! What the annealing depends on.

use graspd_settings::{AT_LEAST_ONE, NOT_NEGATIVE, Ranges, Validate, between, ranges};
use serde::{Deserialize, Serialize};

/// Simulated annealing of a hand's base and eigengrasp amplitudes on the contact energy, see
/// [`anneal`](super::anneal).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnnealingSettings {
    /// How many eigengrasp amplitudes are searched, at most 2.
    pub amplitudes: usize,
    /// Points of the palm's side of the hand that should touch.
    pub virtual_contacts: usize,
    /// Points of the hand that must not enter the object while the search goes on.
    pub checked_points: usize,
    /// How many neighbours are drawn in each step until one is allowed; GraspIt!: 11.
    pub attempts: usize,
    /// What a contact that faces at right angles to the object costs, as a distance \[m\]; GraspIt!: 0.05.
    pub alignment: f64,
    /// How far from the object the base's position is searched, beyond its largest radius \[m\].
    pub reach: f64,
    /// The search's best states, so many, are closed, and of these the one of the greatest epsilon is taken.
    pub kept: usize,
    /// States closer than this to a better one are not kept: mean distance of the virtual contacts \[m\].
    pub apart: f64,
    /// How far the approaching hand may have to go to touch \[m\].
    pub approach: f64,
    /// Closing joints stop where a point is this deep in the object \[m\]; the judge counts what is inside as contact.
    pub contact_depth: f64,
    /// Friction coefficient for epsilon.
    pub friction: f64,
}

impl Default for AnnealingSettings {
    fn default() -> Self {
        Self {
            amplitudes: 2,
            virtual_contacts: 40,
            checked_points: 600,
            attempts: 11,
            alignment: 0.05,
            reach: 0.25,
            kept: 10,
            apart: 0.01,
            approach: 0.05,
            contact_depth: 5e-4,
            friction: 0.8,
        }
    }
}

impl Validate for AnnealingSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            amplitudes: between(1.0, 2.0),
            virtual_contacts: AT_LEAST_ONE.unit("points"),
            checked_points: AT_LEAST_ONE.unit("points"),
            attempts: AT_LEAST_ONE.unit("neighbours"),
            alignment: NOT_NEGATIVE.unit("m"),
            reach: NOT_NEGATIVE.unit("m"),
            kept: AT_LEAST_ONE.unit("states"),
            apart: NOT_NEGATIVE.unit("m"),
            approach: NOT_NEGATIVE.unit("m"),
            contact_depth: NOT_NEGATIVE.unit("m"),
            friction: NOT_NEGATIVE,
        }
        .source("lab/evaluation.md")
    }
}
