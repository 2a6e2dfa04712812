//! The smoothed contact law, and what one point of the skin costs by it.

use graspd_ad::Real;

/// The cost of the skin of a hand and of its medial spheres.
///
/// The depth of a point of the skin at the signed distance d \[m\] is smoothed by R \[m\], the depth wanted is c:
///
/// ```text
/// s_R(d) = R g(d / R),   g(x) = (sqrt(x^2 + 1) - x) / 2,        r(d) = s_R(d) / s_R(-c) - 1
/// ```
///
/// For R -> 0 this is the contact law's depth max(-d, 0); for large R it has a tail R^2 / (4 d) by which points are
/// drawn to an object that they do not touch. A point costs
///
/// ```text
/// r(d)^2 - r(t R)^2 + W (max(-d - L, 0) / c)^2        d < t R
/// ```
///
/// and nothing from d = t R on, with the tail's length t, the depth limit L and its weight W. So each point gains up
/// to 1 by being as deep as wanted, and loses by being deeper.
///
/// A medial sphere to whose centre the object is nearer than its radius by l costs `w (max(l - L, 0) / s_R(-c))^2`.
///
/// The derivative by d is continuous but for d = t R, where it falls from a small part of its peak to 0; at that
/// distance itself it is 0.
///
/// # Source
/// The smoothing of max(-d, 0) is that of Chen and Harker, and Kanzow, for complementarity problems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactCost {
    /// R \[m\], more than 0.
    pub smoothing: f64,
    /// c \[m\], more than 0.
    pub target_depth: f64,
    /// L \[m\], at least c.
    pub depth_limit: f64,
    /// t: with 0, only what is inside the object feels it.
    pub tail: f64,
    /// W.
    pub limit_weight: f64,
    /// w.
    pub medial_weight: f64,
}

impl ContactCost {
    /// Skin at this distance \[m\] or farther costs and gains nothing.
    pub(crate) fn farthest(&self) -> f64 {
        self.tail * self.smoothing
    }

    /// s_R(d) \[m\], see [`ContactCost`].
    #[inline(always)]
    fn smoothed_depth<T: Real>(&self, distance: T) -> T {
        let squared = T::constant(self.smoothing * self.smoothing);
        ((distance.square() + squared).sqrt() - distance).scale(0.5)
    }

    /// r(d), see [`ContactCost`].
    #[inline(always)]
    fn residual<T: Real>(&self, distance: T) -> T {
        let wanted = self.smoothed_depth(-self.target_depth);
        self.smoothed_depth(distance).scale(1.0 / wanted) - T::one()
    }

    /// Computes the cost of a point at signed distance `distance` \[m\].
    #[inline(always)]
    pub fn value<T: Real>(&self, distance: T) -> T {
        let outer = self.residual(self.farthest());
        let beyond = (-distance - T::constant(self.depth_limit)).max(T::zero());
        let limit = beyond.scale(1.0 / self.target_depth).square();
        let near = self.residual(distance).square() - T::constant(outer * outer)
            + limit.scale(self.limit_weight);
        let is_near = T::constant(self.farthest()).gt(distance);
        T::select(is_near, near, T::zero())
    }

    /// Computes the derivative of [`ContactCost::value`] by the distance \[1/m\], and the Gauss-Newton weight of the
    /// distance's own derivative \[1/m^2\]: never negative.
    #[inline]
    pub fn slope_and_weight(&self, distance: f64) -> (f64, f64) {
        if distance >= self.farthest() {
            return (0.0, 0.0);
        }
        let wanted = self.smoothed_depth(-self.target_depth);
        let root = (distance * distance + self.smoothing * self.smoothing).sqrt();
        let rate = 0.5 * (distance / root - 1.0) / wanted;
        let residual = 0.5 * (root - distance) / wanted - 1.0;
        let beyond = (-distance - self.depth_limit).max(0.0);
        let limit = if beyond > 0.0 {
            2.0 * self.limit_weight / (self.target_depth * self.target_depth)
        } else {
            0.0
        };
        (
            2.0 * rate * residual - limit * beyond,
            2.0 * rate * rate + limit,
        )
    }

    /// Computes the cost of a medial sphere to whose centre the object is nearer than its radius by `lack` \[m\].
    pub fn medial_value<T: Real>(&self, lack: T) -> T {
        let over = (lack - T::constant(self.depth_limit)).max(T::zero());
        let unit = self.smoothed_depth(-self.target_depth);
        over.scale(1.0 / unit).square().scale(self.medial_weight)
    }

    /// Computes the derivative of [`ContactCost::medial_value`] by the distance of its centre, which is minus that by
    /// the lack \[1/m\], and the Gauss-Newton weight \[1/m^2\]. 0 at the kink.
    #[inline]
    pub fn medial_slope_and_weight(&self, lack: f64) -> (f64, f64) {
        let over = lack - self.depth_limit;
        if over <= 0.0 {
            return (0.0, 0.0);
        }
        let unit = self.smoothed_depth(-self.target_depth);
        let weight = 2.0 * self.medial_weight / (unit * unit);
        (-weight * over, weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_ad::{Dual, gradient};
    use proptest::prelude::*;

    const COST: ContactCost = ContactCost {
        smoothing: 0.8,
        target_depth: 0.5,
        depth_limit: 1.4,
        tail: 6.0,
        limit_weight: 7.0,
        medial_weight: 5.0,
    };
    /// The closed form rounds otherwise than the chain rule.
    const MODE_TOLERANCE: f64 = 1e-12;
    /// Half width of central differences, in units of the smoothing.
    const STEP: f64 = 1e-6;
    /// Half a step at a jump of the second derivative (at most 100), and cancellation.
    const DIFFERENCE_TOLERANCE: f64 = 1e-4;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn the_slope_is_that_of_both_modes_and_of_differences(
            distance in -3.0..7.0f64,
            smoothing in 0.05..2.0f64,
            tail in 0.0..8.0f64,
        ) {
            let cost = ContactCost { smoothing, tail, ..COST };
            // Differences across the end of the tail are not small.
            prop_assume!((distance - cost.farthest()).abs() > 2.0 * STEP);
            let (claimed, weight) = cost.slope_and_weight(distance);
            let forward = cost.value(Dual::<f64, 1>::variable(distance, 0));
            let (value, reverse) = gradient(|x| cost.value(x[0]), &[distance]);
            let size = 1.0 + claimed.abs();
            prop_assert!((claimed - forward.derivative[0]).abs() <= MODE_TOLERANCE * size);
            prop_assert!((claimed - reverse[0]).abs() <= MODE_TOLERANCE * size);
            prop_assert_eq!(value, cost.value(distance));
            let at = |d: f64| cost.value(d);
            let numeric = (at(distance + STEP) - at(distance - STEP)) / (2.0 * STEP);
            prop_assert!((claimed - numeric).abs() <= DIFFERENCE_TOLERANCE * size);
            prop_assert!(weight >= 0.0);
        }

        #[test]
        fn the_slope_of_a_medial_sphere_is_that_of_both_modes_and_of_differences(lack in -3.0..7.0f64) {
            let (claimed, weight) = COST.medial_slope_and_weight(lack);
            let forward = COST.medial_value(Dual::<f64, 1>::variable(lack, 0));
            let (value, reverse) = gradient(|x| COST.medial_value(x[0]), &[lack]);
            // The distance falls as the lack grows.
            prop_assert!((claimed + forward.derivative[0]).abs() <= MODE_TOLERANCE * (1.0 + claimed.abs()));
            prop_assert!((claimed + reverse[0]).abs() <= MODE_TOLERANCE * (1.0 + claimed.abs()));
            prop_assert_eq!(value, COST.medial_value(lack));
            let numeric = (COST.medial_value(lack + STEP) - COST.medial_value(lack - STEP)) / (2.0 * STEP);
            prop_assert!((claimed + numeric).abs() <= DIFFERENCE_TOLERANCE);
            prop_assert_eq!(weight > 0.0, lack > COST.depth_limit);
        }

        #[test]
        fn the_depth_wanted_is_best(distance in -3.0..7.0f64) {
            let best = COST.value(-COST.target_depth);
            prop_assert!(best <= 0.0 && best <= COST.value(distance));
            prop_assert!(COST.slope_and_weight(-COST.target_depth).0.abs() < MODE_TOLERANCE);
        }

        #[test]
        fn without_smoothing_it_is_the_depth_of_the_contact_law(distance in -3.0..3.0f64) {
            let sharp = ContactCost { smoothing: 1e-12, ..COST };
            prop_assert!((sharp.smoothed_depth(distance) - (-distance).max(0.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn kinks_and_limits_are_pinned() {
        // g(0) = 1/2, g'(0) = -1/2, whatever R is.
        for smoothing in [1e-12, 1e-3, 1.0] {
            let cost = ContactCost { smoothing, ..COST };
            let at_surface = cost.smoothed_depth(Dual::<f64, 1>::variable(0.0, 0));
            assert_eq!(
                (at_surface.value, at_surface.derivative[0]),
                (0.5 * smoothing, -0.5)
            );
        }
        // R -> 0: the slope is that of (-d / c - 1)^2 inside, and none is left outside.
        let sharp = ContactCost {
            smoothing: 1e-12,
            tail: 1e13,
            ..COST
        };
        let inside = 2.0 * (0.2 / 0.5 - 1.0) / -0.5;
        assert!((sharp.slope_and_weight(-0.2).0 - inside).abs() < 1e-9);
        assert!(sharp.slope_and_weight(0.2).0.abs() < 1e-9);
        assert_eq!(COST.medial_slope_and_weight(COST.depth_limit), (0.0, 0.0));
        // The slope jumps at the end of the tail only, from a part of its peak.
        let slope = |distance| COST.slope_and_weight(distance).0;
        let end = COST.farthest();
        assert_eq!((slope(end), COST.value(end)), (0.0, 0.0));
        let peak = (0..500)
            .map(|i| slope(f64::from(i) * 0.01))
            .fold(0.0, f64::max);
        let last = slope(end - 1e-9);
        assert!(0.0 < last && last < 0.05 * peak, "{last} {peak}");
        assert!(COST.value(end - 1e-9).abs() < 1e-9);
    }
}
