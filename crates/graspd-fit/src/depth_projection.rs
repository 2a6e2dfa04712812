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
/// ... but no more points of it than this ...
const MAX_PROJECTION_POINTS: usize = 8000;
/// ... and the depenetration, which moves less and draws nothing in, all that is nearer than this \[m\].
const DEPENETRATION_BAND: f64 = 1e-4;
/// Distances below this are taken from the mesh \[m\].
const EXACT_BAND: f64 = 3e-4;
/// Largest number of depenetrations, each to a depth less by this \[m\] ...
const MAX_DEPENETRATIONS: usize = 2;
const MARGIN: f64 = 1e-4;
/// ... until this much is left beyond the limit \[m\].
const TOLERANCE: f64 = 5e-5;
/// Iterations of a depenetration for each of the projection.
const DEPENETRATION_ITERATIONS: usize = 2;

impl HandFitter<'_> {
    /// Pushes out what is deeper than allowed, with many points of the skin near the object and its
    /// mesh itself, whose edges a grid rounds; what touches is kept. Where that leaves some too
    /// deep, by still more points, the hand depenetrates from there with no regard for what
    /// touches.
    pub fn project(&self, sdf: &SdfGrid, mesh: &SignedDistance, start: &HandPose) -> FittedHand {
        let (is_soft, settings) = (self.is_soft(), self.settings);
        let field = ExactNearSurface {
            grid: sdf,
            mesh,
            band: EXACT_BAND,
        };
        let run = |skin: &SkinSamples, cost, iterations, pose: &HandPose| {
            let costs = vec![cost; iterations];
            self.run(
                &field,
                (skin, &self.fine.spheres),
                &costs,
                pose,
                &mut |_, _| {},
            )
        };
        let vertices = self.hand.surface(start).vertices;
        let (near, _) =
            (self.dense).nearer_than(PROJECTION_BAND, (sdf, grid_error(sdf)), &vertices);
        let near = near.thinned(MAX_PROJECTION_POINTS);
        let cost = settings.projection_cost(is_soft);
        let mut best = run(&near, cost, settings.projection_iterations, start);
        let mut close = self.close_skin(&field, &mut best);
        for round in 0..MAX_DEPENETRATIONS {
            if best.deepest <= settings.depths(is_soft).depth_limit + TOLERANCE {
                break;
            }
            let cost = settings.depenetration_cost(is_soft, round as f64 * MARGIN);
            let iterations = DEPENETRATION_ITERATIONS * settings.projection_iterations;
            let mut next = run(&close, cost, iterations, &best.pose);
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
        let (close, distances) = self.dense.nearer_than(
            DEPENETRATION_BAND,
            (field, grid_error(field.grid)),
            &vertices,
        );
        let depths = distances.iter().map(|distance| -distance);
        fitted.deepest = depths.fold(fitted.deepest, f64::max);
        close
    }
}

/// Returns a bound on the error of a grid between its samples, half a cell's diagonal \[m\].
fn grid_error(grid: &SdfGrid) -> f64 {
    0.5 * Vector3::from(grid.spacing()).norm()
}
