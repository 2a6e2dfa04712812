//! Depth projection and depenetration: push out what a fit has left too deep, with dense skin
//! points and the mesh itself.

use graspd_geom::{SdfGrid, SignedDistance};
use graspd_hand::HandPose;
use nalgebra::Vector3;

use crate::distance_field::ExactNearSurface;
use crate::fit::{FittedHand, HandFitter};
use crate::skin::SkinSamples;

/// The projection takes skin nearer to the object than this at its start \[m\] ...
const PROJECTION_BAND: f64 = 2e-3;
/// ... and the depenetration, which moves less and draws hardly anything in, skin nearer than this \[m\].
const DEPENETRATION_BAND: f64 = 1e-4;
/// Distances below this are taken from the mesh \[m\].
const EXACT_BAND: f64 = 3e-4;
/// Largest number of depenetrations, each to a depth less by this \[m\] ...
const MAX_DEPENETRATIONS: usize = 2;
const MARGIN: f64 = 1e-4;
/// ... until this much is left beyond the limit \[m\].
const TOLERANCE: f64 = 5e-5;

impl HandFitter<'_> {
    /// Pushes out what is deeper than allowed, with many points of the skin near the object and its
    /// mesh itself, whose edges a grid rounds; what touches is kept. Where that leaves some too
    /// deep, by still more points, the hand depenetrates from there with no regard for what
    /// touches.
    pub fn project(&self, sdf: &SdfGrid, mesh: &SignedDistance, start: &HandPose) -> FittedHand {
        let is_soft = self.is_soft();
        let field = ExactNearSurface {
            grid: sdf,
            mesh,
            band: EXACT_BAND,
        };
        let vertices = |pose| self.hand.surface(pose).vertices;
        let (near, _) =
            self.dense
                .nearer_than(PROJECTION_BAND, (sdf, grid_error(sdf)), &vertices(start));
        let stage = self.settings.projection_stage(is_soft);
        let mut best = self.run(&field, &near, &self.fine_spheres, &[stage], start);
        let mut close = self.close_skin(&field, &mut best);
        for round in 0..MAX_DEPENETRATIONS {
            if best.deepest <= self.settings.depths(is_soft).depth_limit + TOLERANCE {
                break;
            }
            let margin = round as f64 * MARGIN;
            let stage = self.settings.depenetration_stage(is_soft, margin);
            let mut next = self.run(&field, &close, &self.fine_spheres, &[stage], &best.pose);
            close = self.close_skin(&field, &mut next);
            if next.deepest >= best.deepest {
                break;
            }
            best = next;
        }
        best
    }

    /// Finds the deepest of all points, and returns those that touch or nearly touch.
    fn close_skin(&self, field: &ExactNearSurface, fitted: &mut FittedHand) -> SkinSamples {
        let vertices = self.hand.surface(&fitted.pose).vertices;
        let (close, distances) = self.densest.nearer_than(
            DEPENETRATION_BAND,
            (field, grid_error(field.grid)),
            &vertices,
        );
        let depths = distances.iter().map(|distance| -distance);
        fitted.deepest = depths.fold(fitted.deepest, f64::max);
        close.with_density(self.dense.area() / self.densest.area())
    }
}

/// Returns a bound on the error of a grid between its samples, half a cell's diagonal \[m\].
fn grid_error(grid: &SdfGrid) -> f64 {
    0.5 * Vector3::from(grid.spacing()).norm()
}
