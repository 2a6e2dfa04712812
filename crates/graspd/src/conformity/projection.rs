//! The projection: what a fit has left too deep is pushed out, with many points of the skin and distances from the
//! mesh.

use graspd_geom::{SdfGrid, SignedDistance};
use graspd_hand::HandPose;
use nalgebra::Vector3;

use super::field::ExactNearSurface;
use super::fit::{FittedHand, HandFitter};
use super::skin::SkinSamples;

/// The projection looks at skin that is nearer to the object than this at its start \[m\] ...
const NEAR: f64 = 2e-3;
/// ... and the retreat, which moves less and draws hardly anything in, at skin nearer than this \[m\].
const CLOSE: f64 = 1e-4;
/// Distances below this are taken from the mesh \[m\].
const EXACT: f64 = 3e-4;
/// A hand that is too deep retreats so many times at most, each time to a depth less by this \[m\] ...
const RETREATS: usize = 2;
const FARTHER: f64 = 1e-4;
/// ... until only so much is left beyond what was asked for \[m\].
const NEARLY: f64 = 5e-5;

impl HandFitter<'_> {
    /// Pushes out what is deeper than allowed, with many points of the skin near the object and its mesh itself,
    /// whose edges a grid rounds; what touches is kept. Where that leaves some too deep, by still more points, the
    /// hand retreats from there with no regard for what touches.
    pub fn project(&self, sdf: &SdfGrid, mesh: &SignedDistance, start: &HandPose) -> FittedHand {
        let is_rigid = self.is_rigid();
        let field = ExactNearSurface {
            grid: sdf,
            mesh,
            band: EXACT,
        };
        let vertices = |pose| self.hand.surface(pose).vertices;
        let (near, _) = self
            .dense
            .nearer_than(NEAR, (sdf, off(sdf)), &vertices(start));
        let stage = self.settings.projection_stage(is_rigid);
        let mut best = self.run(&field, &near, &self.fine_core, &[stage], start);
        let mut close = self.close_skin(&field, &mut best);
        for round in 0..RETREATS {
            if best.deepest <= self.settings.deepest_of(is_rigid) + NEARLY {
                break;
            }
            let farther = round as f64 * FARTHER;
            let stage = self.settings.retreat_stage(is_rigid, farther);
            let mut next = self.run(&field, &close, &self.fine_core, &[stage], &best.pose);
            close = self.close_skin(&field, &mut next);
            if next.deepest >= best.deepest {
                break;
            }
            best = next;
        }
        best
    }

    /// Looks for what is deepest by all points, and returns those that touch or nearly so.
    fn close_skin(&self, field: &ExactNearSurface, fitted: &mut FittedHand) -> SkinSamples {
        let vertices = self.hand.surface(&fitted.pose).vertices;
        let (close, distances) =
            self.densest
                .nearer_than(CLOSE, (field, off(field.grid)), &vertices);
        let depths = distances.iter().map(|distance| -distance);
        fitted.deepest = depths.fold(fitted.deepest, f64::max);
        close.with_density(self.dense.area() / self.densest.area())
    }
}

/// Between its samples a grid is a mean of distances that far away \[m\]: by no more can it be off.
fn off(grid: &SdfGrid) -> f64 {
    0.5 * Vector3::from(grid.spacing()).norm()
}
