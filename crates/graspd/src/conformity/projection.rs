//! The projection: what a fit has left too deep is pushed out, with many points of the skin and distances from the mesh.

use graspd_geom::{SdfGrid, SignedDistance};
use graspd_hand::HandPose;

use super::field::{Answer, DistanceField, ExactNearSurface, LookUpScratch, Query};
use super::fit::{FittedHand, HandFitter};
use super::skin::SkinSamples;

/// The projection looks at skin that is nearer to the object than this at its start \[m\] ...
const NEAR: f64 = 2e-3;
/// ... and the retreat, which moves less, at skin nearer than this \[m\].
const CLOSE: f64 = 5e-4;
/// Distances below this are taken from the mesh \[m\].
const EXACT: f64 = 3e-4;
/// A hand that is too deep retreats so many times at most, each time to a depth less by this \[m\] ...
const RETREATS: usize = 4;
const FARTHER: f64 = 1e-4;
/// ... until only so much is left beyond what was asked for \[m\].
const NEARLY: f64 = 5e-5;

impl HandFitter<'_> {
    /// Pushes out what is deeper than allowed, with many points of the skin near the object and its mesh itself, whose
    /// edges a grid rounds; what touches is kept. Where that leaves some too deep, by still more points, the hand retreats from there
    /// with no regard for what touches.
    pub fn project(&self, sdf: &SdfGrid, mesh: &SignedDistance, start: &HandPose) -> FittedHand {
        let is_rigid = self.is_rigid();
        let field = ExactNearSurface {
            grid: sdf,
            mesh,
            band: EXACT,
        };
        let near = self.skin_nearer_than(NEAR, &self.dense, sdf, start);
        let stage = self.settings.projection_stage(is_rigid);
        let mut best = self.run(&field, &near, &self.fine_core, &[stage], start);
        let close = self.skin_nearer_than(CLOSE, &self.densest, sdf, &best.pose);
        let distances = self.distances(&close, &field, &best.pose);
        best.deepest = (distances.iter()).fold(best.deepest, |deepest, d| deepest.max(-d.distance));
        // Costs are in points of the skin.
        let points = self.dense.area() / self.densest.area();
        for round in 0..RETREATS {
            if best.deepest <= self.settings.deepest_of(is_rigid) + NEARLY {
                break;
            }
            let farther = round as f64 * FARTHER;
            let stage = self.settings.retreat_stage(is_rigid, farther, points);
            let next = self.run(&field, &close, &self.fine_core, &[stage], &best.pose);
            if next.deepest >= best.deepest {
                break;
            }
            best = FittedHand {
                cost: next.cost / points,
                ..next
            };
        }
        best
    }

    /// The points of the skin that are nearer to the object than this.
    fn skin_nearer_than(
        &self,
        distance: f64,
        skin: &SkinSamples,
        field: &dyn DistanceField,
        pose: &HandPose,
    ) -> SkinSamples {
        let answers = self.distances(skin, field, pose);
        let mut near = skin.clone();
        near.keep(|point| answers[point].distance < distance);
        near
    }

    fn distances(
        &self,
        skin: &SkinSamples,
        field: &dyn DistanceField,
        pose: &HandPose,
    ) -> Vec<Answer> {
        let vertices = self.hand.surface(pose).vertices;
        let query = |point| Query {
            at: skin.position(&vertices, point),
            seen: None,
        };
        let queries: Vec<Query> = (0..skin.len()).map(query).collect();
        let mut answers = Vec::new();
        field.look_up(&queries, &mut LookUpScratch::default(), &mut answers);
        answers
    }
}
