//! How a fitted pose changes with the object's shape.

use graspd_geom::SdfGrid;
use graspd_hand::HandPose;
use nalgebra::Point3;

use crate::fit::HandFitter;
use crate::levenberg_marquardt::LevenbergMarquardt;
use crate::linearization::{Placement, PoseCost};

impl HandFitter<'_> {
    /// Computes the derivative of a fitted pose by the object's shape, `[6 + n]`: translation \[m\], rotation vector
    /// in the object frame and joints, for each unit of a parameter by which the signed distance at a point p (object
    /// frame \[m\]) changes at the rate `change(p)`.
    ///
    /// So `change` is -n . t for an object that moves along t, -1 for one that grows, and for the values of a grid
    /// their change, interpolated. By the implicit function theorem, at a minimum of the last iteration's cost, with
    /// the residuals' gradients r_i' by the pose q and the change of distance d_i:
    ///
    /// ```text
    /// dq = -H^-1 sum_i w_i d_i r_i',      H = sum_i w_i r_i' r_i'^T + H_posture + H_intersection
    /// ```
    ///
    /// H is Gauss and Newton's, without the second derivatives of distances. Exact for rigid motions of the object.
    /// Joints at a limit stay there. It jumps where skin begins to touch, or a joint meets its limit.
    pub fn sensitivity(
        &self,
        sdf: &SdfGrid,
        fitted: &HandPose,
        change: &dyn Fn(Point3<f64>) -> f64,
    ) -> Vec<f64> {
        let cost = self.settings.cost(self.settings.iterations, self.is_soft());
        let (skin, spheres) = (&self.fine.skin, &self.fine.spheres);
        let mut cost_of = PoseCost::new(
            self.hand,
            sdf,
            skin,
            spheres,
            self.settings,
            cost.farthest(),
        );
        let mut placement = Placement::default();
        cost_of.place(fitted, None, &mut placement);
        let mut steps = LevenbergMarquardt::undamped(6 + fitted.articulation.len());
        let gradient = cost_of
            .normal_equations(fitted, &placement, &cost)
            .1
            .clone();
        steps.hold(self.hand, fitted, &gradient);
        let system = cost_of.change_of_gradient(fitted, &placement, &cost, &|p| change(p.into()));
        steps.set(system);
        steps.solve();
        steps.solution().to_vec()
    }
}
