//! Settings of the fit: one law, one schedule.

use graspd_settings::{
    ANY, AT_LEAST_ONE, FINITE, NOT_NEGATIVE, POSITIVE, Ranges, Validate, between, ranges,
};
use serde::{Deserialize, Serialize};

use crate::cost::ContactCost;

/// How hands are fitted to objects, see [`HandFitter`](crate::HandFitter). Lengths are \[m\].
///
/// Of the iterations four fifths have a smoothing R that falls geometrically, and the rest the last R. A start is
/// brought to the object in the first half of the falling ones (`approach`) and into contact up to three quarters of
/// them (`contact`), both with the coarse samples; what is left has the fine ones (`refine`). Then the projection
/// bounds the depth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkinFitSettings {
    /// Starts that are tried for each grasp; the best after `contact` is kept.
    pub candidates: usize,
    /// How many of them, those of least cost after `approach`, are taken into contact.
    pub promising: usize,
    /// R of the first iteration: how far the tail of the contact law reaches.
    pub start_smoothing: f64,
    /// R of the last iterations.
    pub end_smoothing: f64,
    /// Number of iterations from the start to the last R.
    pub iterations: usize,
    /// Iterations of the depth projection; the depenetration after it has twice as many.
    pub projection_iterations: usize,
    /// Skin points, and at most as many medial spheres, while R is large.
    pub coarse_samples: usize,
    /// Skin points, and at most as many medial spheres, while R is small.
    pub fine_samples: usize,
    /// Length of the contact law's tail in R; with 0 nothing is drawn to what it does not touch.
    pub tail: f64,
    /// Steps of Levenberg-Marquardt; otherwise along the gradient, scaled by the curvature of each unknown.
    pub second_order: bool,
    /// Cost of each joint at a whole range from the relaxed posture, in skin points.
    pub posture_weight: f64,
    /// Cost of a self-intersection of 1 mm, in skin points.
    pub intersection_weight: f64,
    /// Cost of a medial sphere that the object enters by the depth wanted beyond the limit, in skin points.
    pub medial_weight: f64,
    /// Whether candidates are rated by what their contact forces can stop, too.
    pub task: bool,
    /// Depths of hands with soft skin.
    pub soft: DepthSettings,
    /// Depths of hands of rigid links.
    pub rigid: DepthSettings,
}

/// Depths \[m\] and samples that depend on whether the skin is soft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthSettings {
    /// Depth that skin is wanted to have.
    pub target_depth: f64,
    /// Greatest depth that the projection leaves, where it can.
    pub depth_limit: f64,
    /// Skin points of the projection and of the check after it; edges of the object come in deeper between them. Only
    /// those near the object count, and all vertices come on top.
    pub dense_samples: usize,
}

impl Default for SkinFitSettings {
    /// As measured best (`lab/tuning.md`).
    fn default() -> Self {
        Self {
            candidates: 8,
            promising: 8,
            start_smoothing: 5e-2,
            end_smoothing: 5e-4,
            iterations: 50,
            projection_iterations: 10,
            coarse_samples: 800,
            fine_samples: 5000,
            tail: 6.0,
            second_order: true,
            posture_weight: 2.0,
            intersection_weight: 1.0,
            medial_weight: 3.0,
            task: true,
            soft: DepthSettings {
                target_depth: 9.75e-4,
                depth_limit: 2.45e-3,
                dense_samples: 40_000,
            },
            rigid: DepthSettings {
                target_depth: 3e-4,
                depth_limit: 6.5e-4,
                dense_samples: 400_000,
            },
        }
    }
}

/// Weight of the projection on depths beyond the limit, in units of the depth wanted.
const LIMIT_WEIGHT: f64 = 40.0;
/// Factor of the depenetration on the costs of depths beyond the limit and of medial spheres.
const DEPENETRATION_FACTOR: f64 = 30.0;
/// Smallest R and depth \[m\].
const MIN_LENGTH: f64 = 1e-6;
/// Longest tail: by then nothing of it is left.
const MAX_TAIL: f64 = 1e3;
/// More points than any skin needs: at 10^6 they lie a few tenths of a millimetre apart.
const MAX_SAMPLES: f64 = 1e6;

impl Validate for DepthSettings {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            target_depth: FINITE.at_least(MIN_LENGTH).unit("m"),
            depth_limit: FINITE.at_least_setting("target_depth", self.target_depth).unit("m"),
            dense_samples: between(1.0, MAX_SAMPLES).unit("points"),
        }
    }
}

impl Validate for SkinFitSettings {
    fn ranges(&self) -> Ranges {
        let samples = between(1.0, MAX_SAMPLES).unit("points");
        let smoothing = FINITE.at_least(MIN_LENGTH);
        ranges! { self =>
            candidates: AT_LEAST_ONE.unit("starts"),
            promising: AT_LEAST_ONE.unit("starts"),
            start_smoothing: POSITIVE.at_least_setting("end_smoothing", self.end_smoothing).unit("m"),
            end_smoothing: smoothing.unit("m"),
            iterations: NOT_NEGATIVE.unit("iterations"),
            projection_iterations: NOT_NEGATIVE.unit("iterations"),
            coarse_samples: samples,
            fine_samples: samples,
            tail: between(0.0, MAX_TAIL),
            second_order: ANY,
            posture_weight: NOT_NEGATIVE.unit("points"),
            intersection_weight: NOT_NEGATIVE.unit("points/mm"),
            medial_weight: NOT_NEGATIVE.unit("points"),
            task: ANY,
        }
        .nested("soft", &self.soft)
        .nested("rigid", &self.rigid)
        .source("lab/tuning.md")
    }
}

impl SkinFitSettings {
    /// Returns the depths of soft or rigid hands.
    pub(crate) fn depths(&self, is_soft: bool) -> &DepthSettings {
        if is_soft { &self.soft } else { &self.rigid }
    }

    /// Returns the iterations before which `approach`, `contact` and `refine` end.
    pub(crate) fn ends(&self) -> [usize; 3] {
        let falling = self.falling();
        [falling / 2, 3 * falling / 4, self.iterations]
    }

    /// Returns the number of iterations in which R falls.
    fn falling(&self) -> usize {
        4 * self.iterations / 5
    }

    /// Returns R in an iteration \[m\].
    pub(crate) fn smoothing(&self, iteration: usize) -> f64 {
        let last = self.falling().saturating_sub(1);
        if iteration >= last {
            return self.end_smoothing;
        }
        let share = iteration as f64 / last as f64;
        self.start_smoothing * (self.end_smoothing / self.start_smoothing).powf(share)
    }

    /// Returns the cost of an iteration.
    pub(crate) fn cost(&self, iteration: usize, is_soft: bool) -> ContactCost {
        let depths = self.depths(is_soft);
        ContactCost {
            smoothing: self.smoothing(iteration),
            target_depth: depths.target_depth,
            depth_limit: depths.depth_limit,
            tail: self.tail,
            limit_weight: 0.0,
            medial_weight: self.medial_weight,
        }
    }

    /// Returns the cost of the depth projection.
    pub(crate) fn projection_cost(&self, is_soft: bool) -> ContactCost {
        ContactCost {
            limit_weight: LIMIT_WEIGHT,
            ..self.cost(self.iterations, is_soft)
        }
    }

    /// Returns the cost of the depenetration to a depth less than the limit by `margin` \[m\]: nothing is drawn in.
    pub(crate) fn depenetration_cost(&self, is_soft: bool, margin: f64) -> ContactCost {
        let cost = self.projection_cost(is_soft);
        ContactCost {
            depth_limit: (cost.depth_limit - margin).max(cost.target_depth),
            tail: 0.0,
            limit_weight: DEPENETRATION_FACTOR * cost.limit_weight,
            medial_weight: DEPENETRATION_FACTOR * cost.medial_weight,
            ..cost
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_falls_and_then_stays() {
        let settings = SkinFitSettings::default();
        assert_eq!(settings.ends(), [20, 30, 50]);
        assert_eq!(settings.smoothing(0), settings.start_smoothing);
        for iteration in 0..60 {
            let [now, next] = [0, 1].map(|more| settings.smoothing(iteration + more));
            assert!(if iteration < 39 {
                next < now
            } else {
                next == settings.end_smoothing
            });
        }
        for iterations in 0..4 {
            let short = SkinFitSettings {
                iterations,
                ..settings.clone()
            };
            assert!((0..4).all(|iteration| short.smoothing(iteration).is_finite()));
        }
    }
}
