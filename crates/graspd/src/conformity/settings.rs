//! What a fit depends on.

use graspd_settings::{
    AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Ranges, Validate, between, ranges,
};
use serde::{Deserialize, Serialize};

use super::cost::SkinCost;

/// How hands are fitted to objects, see [`fit_hand`](crate::fit_hand). Lengths are \[m\].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConformitySettings {
    /// Starts that are tried for each grasp; the one that a coarse fit makes touch most is kept.
    pub candidates: usize,
    /// How many of these, those of least cost after the first part of the coarse fit, go through its second.
    pub promising: usize,
    /// How many of these, from the best on, are taken to the end at most: as long as none is shallow enough.
    pub finalists: usize,
    /// By how much a coarse fit that presses on one side only counts less than one that presses evenly from all sides,
    /// when the best is chosen: 0 to 1.
    pub imbalance_discount: f64,
    /// By how much one without force closure counts less than one that holds firmly: 0 to 1.
    pub closure_discount: f64,
    /// Epsilon of a few of the points that touch from which on a fit holds firmly.
    pub firm_closure: f64,
    /// Points of the hand's skin in a coarse fit.
    pub coarse_samples: usize,
    /// Points of the hand's skin in the final fit.
    pub fine_samples: usize,
    /// Balls inside the hand by which a wall is noticed that has cut into it, in coarse fits and afterwards.
    pub core_samples: [usize; 2],
    /// Points of the hand's skin in the projection, of soft skin and of rigid links: between points of these, edges of
    /// the object come in deeper. Only those near the object count, and all vertices come on top.
    pub dense_samples: [usize; 2],
    /// The same for whether the projection has left some too deep, and for the retreat: between points a fraction of a
    /// millimetre apart, too, edges of the object come in deeper.
    pub densest_samples: [usize; 2],
    /// Iterations of the coarse fit: from afar, and close to the surface.
    pub coarse_iterations: [usize; 2],
    /// Iterations of the final fit: drawing skin in, and then pushing out what is too deep.
    pub fine_iterations: [usize; 2],
    /// Iterations of the projection.
    pub projection_iterations: usize,
    /// Iterations in which a hand retreats that the projection has left deeper than `deepest`.
    pub retreat_iterations: usize,
    /// Points farther from touching than about this are hardly drawn in any more: at the start of a coarse fit, at the
    /// end of its first part, at its end, at the start of the final fit, and at its end; falls exponentially.
    pub reach: [f64; 5],
    /// Points at least this deep need not be drawn in further.
    pub depth: f64,
    /// Points of soft skin (of hands in MANO's layout) deeper than this are pushed out.
    pub most_depth: f64,
    /// The same for rigid links.
    pub rigid_most_depth: f64,
    /// A point that is this much deeper than `most_depth` costs `deep_weights` times what one that touches gains.
    pub depth_scale: f64,
    /// See there: in both parts of the coarse fit, and both of the final one.
    pub deep_weights: [f64; 4],
    /// The greatest depth of soft skin that the projection leaves, where it can.
    pub deepest: f64,
    /// The same for rigid links.
    pub rigid_deepest: f64,
    /// A point that is `depth_scale` deeper than that costs this many times what one that touches gains.
    pub limit_weight: f64,
    /// What a ball of the hand's core costs that something is deeper in than allowed by `depth_scale`, in points of
    /// skin: in both parts of the coarse fit, in the final one, and in the projection. At first hands may pass
    /// through edges on their way around an object.
    pub core_weights: [f64; 4],
    /// What each joint costs at a whole range from the relaxed posture, in points of skin.
    pub posture_weight: f64,
    /// What a self-intersection of 1 mm costs, in points of skin.
    pub intersection_weight: f64,
}

impl Default for ConformitySettings {
    /// As measured best (`lab/tuning.md`).
    fn default() -> Self {
        Self {
            candidates: 8,
            promising: 8,
            finalists: 8,
            imbalance_discount: 0.0,
            closure_discount: 0.5,
            firm_closure: 0.2,
            coarse_samples: 800,
            fine_samples: 5000,
            core_samples: [800, 6000],
            dense_samples: [40_000, 100_000],
            densest_samples: [40_000, 400_000],
            coarse_iterations: [30, 20],
            fine_iterations: [40, 20],
            projection_iterations: 10,
            retreat_iterations: 20,
            reach: [5e-2, 5e-3, 1.5e-3, 2e-3, 8e-4],
            depth: 1.5e-4,
            most_depth: 1.75e-3,
            rigid_most_depth: 4e-4,
            depth_scale: 4e-4,
            deep_weights: [0.02, 1.0, 1.0, 4.0],
            deepest: 2.55e-3,
            rigid_deepest: 6.5e-4,
            limit_weight: 30.0,
            core_weights: [0.01, 2.0, 0.33, 2.0],
            posture_weight: 2.0,
            intersection_weight: 1.0,
        }
    }
}

/// How many times as much depth beyond the limit and walls in the core cost in a retreat.
const RETREAT: f64 = 30.0;
/// No reach is shorter \[m\].
const MIN_REACH: f64 = 1e-5;

/// More points than any skin needs: at 10^6 they lie a few tenths of a millimetre apart.
const MAX_SAMPLES: f64 = 1e6;

impl Validate for ConformitySettings {
    fn ranges(&self) -> Ranges {
        let samples = between(1.0, MAX_SAMPLES).unit("points");
        let deeper = |setting, depth| FINITE.at_least_setting(setting, depth).unit("m");
        ranges! { self =>
            candidates: AT_LEAST_ONE.unit("starts"),
            promising: AT_LEAST_ONE.unit("starts"),
            finalists: AT_LEAST_ONE.unit("starts"),
            imbalance_discount: FRACTION,
            closure_discount: FRACTION,
            firm_closure: POSITIVE,
            coarse_samples: samples,
            fine_samples: samples,
            core_samples: samples.unit("balls"),
            dense_samples: samples,
            densest_samples: samples,
            coarse_iterations: NOT_NEGATIVE.unit("iterations"),
            fine_iterations: NOT_NEGATIVE.unit("iterations"),
            projection_iterations: NOT_NEGATIVE.unit("iterations"),
            retreat_iterations: NOT_NEGATIVE.unit("iterations"),
            reach: POSITIVE.unit("m"),
            depth: NOT_NEGATIVE.unit("m"),
            most_depth: deeper("depth", self.depth),
            rigid_most_depth: deeper("depth", self.depth),
            depth_scale: POSITIVE.unit("m"),
            deep_weights: NOT_NEGATIVE,
            deepest: deeper("most_depth", self.most_depth),
            rigid_deepest: deeper("rigid_most_depth", self.rigid_most_depth),
            limit_weight: NOT_NEGATIVE,
            core_weights: NOT_NEGATIVE,
            posture_weight: NOT_NEGATIVE.unit("points"),
            intersection_weight: NOT_NEGATIVE.unit("points/mm"),
        }
        .source("lab/tuning.md")
    }
}

impl ConformitySettings {
    /// The stages of the coarse fit.
    pub(super) fn coarse_stages(&self, is_rigid: bool) -> [Stage; 2] {
        let [far, near, touching, ..] = self.reach;
        let cost =
            |part: usize| self.cost(is_rigid, self.deep_weights[part], self.core_weights[part]);
        [
            Stage::new(self.coarse_iterations[0], [far, near], cost(0)),
            Stage::new(self.coarse_iterations[1], [near, touching], cost(1)),
        ]
    }

    /// The stages of the final fit.
    pub(super) fn fine_stages(&self, is_rigid: bool) -> [Stage; 2] {
        let [.., start, end] = self.reach;
        let cost = |part: usize| self.cost(is_rigid, self.deep_weights[part], self.core_weights[2]);
        [
            Stage::new(self.fine_iterations[0], [start, end], cost(2)),
            Stage::new(self.fine_iterations[1], [end, end], cost(3)),
        ]
    }

    /// The stage of the projection that keeps what touches.
    pub(super) fn projection_stage(&self, is_rigid: bool) -> Stage {
        let cost = SkinCost {
            limit_factor: self.factor(self.limit_weight),
            ..self.cost(is_rigid, self.deep_weights[3], self.core_weights[3])
        };
        Stage::new(self.projection_iterations, [self.reach[4]; 2], cost)
    }

    /// The one for where that leaves some skin too deep: to a depth less than what is asked for by `farther` \[m\].
    pub(super) fn retreat_stage(&self, is_rigid: bool, farther: f64) -> Stage {
        let core_weight = RETREAT * self.core_weights[3];
        let cost = self.cost(is_rigid, self.deep_weights[3], core_weight);
        let cost = SkinCost {
            limit_factor: self.factor(RETREAT * self.limit_weight),
            most_depth: (cost.most_depth - farther).max(self.depth),
            limit_depth: (cost.limit_depth - farther).max(self.depth),
            ..cost
        };
        // Hardly any skin is drawn in from so near.
        let reach = self.depth.max(MIN_REACH);
        Stage::new(self.retreat_iterations, [reach; 2], cost)
    }

    /// The depth that the projection is to leave at most \[m\].
    pub(super) fn deepest_of(&self, is_rigid: bool) -> f64 {
        if is_rigid {
            self.rigid_deepest
        } else {
            self.deepest
        }
    }

    /// The factor on squared depths of a weight \[1/m^2\].
    fn factor(&self, weight: f64) -> f64 {
        weight / (self.depth_scale * self.depth_scale)
    }

    /// The cost but for its reach and what the projection adds.
    fn cost(&self, is_rigid: bool, deep_weight: f64, core_weight: f64) -> SkinCost {
        SkinCost {
            reach: 0.0,
            depth: self.depth,
            most_depth: if is_rigid {
                self.rigid_most_depth
            } else {
                self.most_depth
            },
            deep_factor: self.factor(deep_weight),
            limit_depth: self.deepest_of(is_rigid),
            limit_factor: 0.0,
            core_factor: self.factor(core_weight),
        }
    }
}

/// Iterations with one cost but for its reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    pub(super) iterations: usize,
    /// At the first and the last iteration.
    reach: [f64; 2],
    cost: SkinCost,
}

impl Stage {
    fn new(iterations: usize, reach: [f64; 2], cost: SkinCost) -> Self {
        Self {
            iterations,
            reach,
            cost,
        }
    }

    /// Whether all iterations have the same cost.
    pub(super) fn is_constant(&self) -> bool {
        self.reach[0] == self.reach[1]
    }

    /// Skin farther from the object than this costs nothing at any iteration \[m\].
    pub(super) fn farthest(&self) -> f64 {
        let ends = self.reach.map(|reach| {
            let cost = SkinCost { reach, ..self.cost };
            cost.farthest()
        });
        ends[0].max(ends[1])
    }

    /// The cost at an iteration.
    pub(super) fn cost(&self, iteration: usize) -> SkinCost {
        let share = iteration as f64 / (self.iterations.max(2) - 1) as f64;
        let [first, last] = self.reach;
        SkinCost {
            reach: first * (last / first).powf(share),
            ..self.cost
        }
    }
}
