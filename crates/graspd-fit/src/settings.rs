//! Settings of the skin fit.

use graspd_settings::{
    AT_LEAST_ONE, FINITE, FRACTION, NOT_NEGATIVE, POSITIVE, Ranges, Validate, between, ranges,
};
use serde::{Deserialize, Serialize};

use crate::cost::SkinCost;

/// How hands are fitted to objects, see [`fit_hand`](crate::fit_hand). Lengths are \[m\].
///
/// A start goes through the stages in the order of their fields; the last two use denser samples of
/// the skin and the object's mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkinFitSettings {
    /// Starts that are tried for each grasp; the best after `contact` is kept.
    pub candidates: usize,
    /// How many of them, those of least cost after `approach`, go through `contact`.
    pub promising: usize,
    /// How many of them, from the best on, are taken to the end at most: until one is shallow enough.
    pub finalists: usize,
    /// Discount on the rating of a fit that presses on one side only, relative to one that presses
    /// evenly from all sides.
    pub imbalance_discount: f64,
    /// Discount on the rating of a fit without force closure, relative to one that holds firmly.
    pub closure_discount: f64,
    /// Epsilon, over a few of the points that touch, from which on a fit holds firmly.
    pub firm_closure: f64,
    /// Skin points in `approach` and `contact`.
    pub coarse_samples: usize,
    /// Skin points in `draw_in` and `push_out`.
    pub fine_samples: usize,
    /// Medial spheres in `approach` and `contact`; they notice walls that cut into the hand.
    pub coarse_medial_spheres: usize,
    /// Medial spheres afterwards.
    pub fine_medial_spheres: usize,
    /// Iterations of the depenetration, which follows where the projection leaves skin deeper than the limit.
    pub depenetration_iterations: usize,
    /// Target penetration: skin at least this deep is not drawn in further.
    pub target_depth: f64,
    /// Unit of excess depth: a point this much too deep costs the stage's `depth_weight`.
    pub depth_scale: f64,
    /// Cost, in the projection, of a point that is `depth_scale` deeper than the limit.
    pub limit_weight: f64,
    /// Cost of each joint at a whole range from the relaxed posture, in skin points.
    pub posture_weight: f64,
    /// Cost of a self-intersection of 1 mm, in skin points.
    pub intersection_weight: f64,
    /// Brings the hand to the object from afar.
    pub approach: FitStage,
    /// Brings the skin into contact.
    pub contact: FitStage,
    /// Draws more skin into contact, after the simulation.
    pub draw_in: FitStage,
    /// Pushes out what is too deep.
    pub push_out: FitStage,
    /// Depth projection: bounds the depth by dense samples and the object's mesh, and keeps what touches.
    pub projection: FitStage,
    /// Depths of hands with soft skin.
    pub soft: DepthSettings,
    /// Depths of hands of rigid links.
    pub rigid: DepthSettings,
}

/// Iterations of Levenberg-Marquardt with one cost, whose reach shrinks geometrically from the first to the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitStage {
    /// Number of iterations.
    pub iterations: usize,
    /// Reach of the first iteration \[m\]: points farther from touching than about this are hardly drawn in.
    pub start_reach: f64,
    /// Reach of the last iteration \[m\].
    pub end_reach: f64,
    /// Cost of a point that is `depth_scale` too deep, relative to the gain of one that touches.
    pub depth_weight: f64,
    /// Cost of a medial sphere that the object enters `depth_scale` too deep, in skin points.
    pub medial_weight: f64,
}

/// Depths \[m\] and samples that depend on whether the skin is soft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DepthSettings {
    /// Skin deeper than this is pushed out.
    pub max_depth: f64,
    /// Greatest depth that the projection leaves, where it can.
    pub depth_limit: f64,
    /// Skin points of the projection: between them, edges of the object come in deeper. Only those
    /// near the object count, and all vertices come on top.
    pub projection_samples: usize,
    /// Skin points by which the depth is checked, and those of the depenetration.
    pub check_samples: usize,
}

impl Default for SkinFitSettings {
    /// As measured best (`lab/tuning.md`).
    fn default() -> Self {
        let stage = |iterations,
                     [start_reach, end_reach]: [f64; 2],
                     depth_weight,
                     medial_weight| FitStage {
            iterations,
            start_reach,
            end_reach,
            depth_weight,
            medial_weight,
        };
        Self {
            candidates: 8,
            promising: 8,
            finalists: 8,
            imbalance_discount: 0.0,
            closure_discount: 0.5,
            firm_closure: 0.2,
            coarse_samples: 800,
            fine_samples: 5000,
            coarse_medial_spheres: 800,
            fine_medial_spheres: 6000,
            // At first hands may pass through edges on their way around an object.
            approach: stage(30, [5e-2, 5e-3], 0.02, 0.01),
            contact: stage(20, [5e-3, 1.5e-3], 1.0, 2.0),
            draw_in: stage(40, [2e-3, 8e-4], 1.0, 0.33),
            push_out: stage(20, [8e-4, 8e-4], 4.0, 0.33),
            projection: stage(10, [8e-4, 8e-4], 4.0, 2.0),
            depenetration_iterations: 20,
            target_depth: 1.5e-4,
            depth_scale: 4e-4,
            limit_weight: 30.0,
            posture_weight: 2.0,
            intersection_weight: 1.0,
            soft: DepthSettings {
                max_depth: 1.75e-3,
                depth_limit: 2.55e-3,
                projection_samples: 40_000,
                check_samples: 40_000,
            },
            rigid: DepthSettings {
                max_depth: 4e-4,
                depth_limit: 6.5e-4,
                projection_samples: 100_000,
                check_samples: 400_000,
            },
        }
    }
}

/// Factor of the depenetration on the costs of excess depth and of medial spheres.
const DEPENETRATION_FACTOR: f64 = 30.0;
/// Smallest reach of a stage \[m\].
const MIN_REACH: f64 = 1e-5;
/// More points than any skin needs: at 10^6 they lie a few tenths of a millimetre apart.
const MAX_SAMPLES: f64 = 1e6;

impl Validate for FitStage {
    fn ranges(&self) -> Ranges {
        ranges! { self =>
            iterations: NOT_NEGATIVE.unit("iterations"),
            start_reach: POSITIVE.unit("m"),
            end_reach: POSITIVE.unit("m"),
            depth_weight: NOT_NEGATIVE,
            medial_weight: NOT_NEGATIVE,
        }
    }
}

impl Validate for DepthSettings {
    fn ranges(&self) -> Ranges {
        let samples = between(1.0, MAX_SAMPLES).unit("points");
        ranges! { self =>
            max_depth: NOT_NEGATIVE.unit("m"),
            depth_limit: FINITE.at_least_setting("max_depth", self.max_depth).unit("m"),
            projection_samples: samples,
            check_samples: samples,
        }
    }
}

impl Validate for SkinFitSettings {
    fn ranges(&self) -> Ranges {
        let samples = between(1.0, MAX_SAMPLES).unit("points");
        ranges! { self =>
            candidates: AT_LEAST_ONE.unit("starts"),
            promising: AT_LEAST_ONE.unit("starts"),
            finalists: AT_LEAST_ONE.unit("starts"),
            imbalance_discount: FRACTION,
            closure_discount: FRACTION,
            firm_closure: POSITIVE,
            coarse_samples: samples,
            fine_samples: samples,
            coarse_medial_spheres: samples.unit("spheres"),
            fine_medial_spheres: samples.unit("spheres"),
            depenetration_iterations: NOT_NEGATIVE.unit("iterations"),
            target_depth: NOT_NEGATIVE.unit("m"),
            depth_scale: POSITIVE.unit("m"),
            limit_weight: NOT_NEGATIVE,
            posture_weight: NOT_NEGATIVE.unit("points"),
            intersection_weight: NOT_NEGATIVE.unit("points/mm"),
        }
        .nested("approach", &self.approach)
        .nested("contact", &self.contact)
        .nested("draw_in", &self.draw_in)
        .nested("push_out", &self.push_out)
        .nested("projection", &self.projection)
        .nested("soft", &self.soft)
        .nested("rigid", &self.rigid)
        .require("soft.max_depth", &self.soft.max_depth, self.deep_enough())
        .require("rigid.max_depth", &self.rigid.max_depth, self.deep_enough())
        .source("lab/tuning.md")
    }
}

impl SkinFitSettings {
    fn deep_enough(&self) -> graspd_settings::Range {
        FINITE.at_least_setting("target_depth", self.target_depth)
    }

    /// Returns the depths of soft or rigid hands.
    pub(crate) fn depths(&self, is_soft: bool) -> &DepthSettings {
        if is_soft { &self.soft } else { &self.rigid }
    }

    /// Returns a stage with its cost.
    pub(crate) fn stage(&self, stage: &FitStage, is_soft: bool) -> CostStage {
        CostStage {
            iterations: stage.iterations,
            reach: [stage.start_reach, stage.end_reach],
            cost: self.cost(is_soft, stage.depth_weight, stage.medial_weight),
        }
    }

    /// Returns the stages before the simulation.
    pub(crate) fn coarse_stages(&self, is_soft: bool) -> [CostStage; 2] {
        [&self.approach, &self.contact].map(|stage| self.stage(stage, is_soft))
    }

    /// Returns the stages after the simulation.
    pub(crate) fn fine_stages(&self, is_soft: bool) -> [CostStage; 2] {
        [&self.draw_in, &self.push_out].map(|stage| self.stage(stage, is_soft))
    }

    /// Returns the depth projection.
    pub(crate) fn projection_stage(&self, is_soft: bool) -> CostStage {
        let mut stage = self.stage(&self.projection, is_soft);
        stage.cost.limit_factor = self.factor(self.limit_weight);
        stage
    }

    /// Returns the depenetration to a depth less than the limit by `margin` \[m\].
    pub(crate) fn depenetration_stage(&self, is_soft: bool, margin: f64) -> CostStage {
        let medial_weight = DEPENETRATION_FACTOR * self.projection.medial_weight;
        let cost = self.cost(is_soft, self.projection.depth_weight, medial_weight);
        CostStage {
            iterations: self.depenetration_iterations,
            // Hardly any skin is drawn in from so near.
            reach: [self.target_depth.max(MIN_REACH); 2],
            cost: SkinCost {
                limit_factor: self.factor(DEPENETRATION_FACTOR * self.limit_weight),
                max_depth: (cost.max_depth - margin).max(self.target_depth),
                limit_depth: (cost.limit_depth - margin).max(self.target_depth),
                ..cost
            },
        }
    }

    /// Returns the factor on squared depths of a weight \[1/m^2\].
    fn factor(&self, weight: f64) -> f64 {
        weight / (self.depth_scale * self.depth_scale)
    }

    /// Returns a cost without reach and limit.
    fn cost(&self, is_soft: bool, depth_weight: f64, medial_weight: f64) -> SkinCost {
        let depths = self.depths(is_soft);
        SkinCost {
            reach: 0.0,
            depth: self.target_depth,
            max_depth: depths.max_depth,
            deep_factor: self.factor(depth_weight),
            limit_depth: depths.depth_limit,
            limit_factor: 0.0,
            medial_factor: self.factor(medial_weight),
        }
    }
}

/// A stage with its cost, but for the reach.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CostStage {
    pub(crate) iterations: usize,
    /// Reach of the first and of the last iteration \[m\].
    reach: [f64; 2],
    cost: SkinCost,
}

impl CostStage {
    /// Returns whether all iterations have the same cost.
    pub(crate) fn is_constant(&self) -> bool {
        self.reach[0] == self.reach[1]
    }

    /// Returns the distance beyond which skin costs nothing in any iteration \[m\].
    pub(crate) fn farthest(&self) -> f64 {
        let ends = self.reach.map(|reach| {
            let cost = SkinCost { reach, ..self.cost };
            cost.farthest()
        });
        ends[0].max(ends[1])
    }

    /// Returns the cost of an iteration.
    pub(crate) fn cost(&self, iteration: usize) -> SkinCost {
        let share = iteration as f64 / (self.iterations.max(2) - 1) as f64;
        let [first, last] = self.reach;
        SkinCost {
            reach: first * (last / first).powf(share),
            ..self.cost
        }
    }
}
