//! What one point of the skin costs at its distance from the object.

use graspd_ad::Real;

/// Points farther from touching than this many reaches are not drawn in at all.
const CUTOFF: f64 = 6.0;

/// What the skin of a hand and the medial spheres cost.
///
/// The cost of a point of the skin at the signed distance d \[m\]: it gains by touching, up to 1 if it faces the
/// object, and loses by being too deep.
///
/// ```text
/// -f max(R^2 / (R^2 + x^2) - 1 / 37, 0) + w max(-d - D min(2 f, 1), 0)^2 + W max(-d - L, 0)^2,    x = max(d + d_0, 0)
/// ```
///
/// with f how far the skin faces the object (0 to 1), the reach R, d_0 the depth at which a point
/// touches, D the depth from which on it is too deep, that from which on it is far too deep, L, and
/// w and W \[1/m^2\]. The gain ends at x = 6 R. In sum over the skin this is (with R small) minus
/// the area that touches, and so no point that cannot reach the object holds back those that can.
/// Skin inside the object that faces away from it is never right, however shallow: it belongs to a
/// finger that has gone through a thin wall.
///
/// A medial sphere of the hand to whose centre the object is nearer than its radius by l costs
/// `w_c max(l - D, 0)^2`.
///
/// The derivative is continuous but for x = 6 R, where it falls from a 20th of its peak to 0; at
/// that distance itself it is 0.
///
/// # Source
/// The gain is the robust loss of Geman and McClure, Statistical methods for tomographic image reconstruction, 1987,
/// solved by iteratively reweighted least squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinCost {
    /// R \[m\].
    pub reach: f64,
    /// d_0 \[m\].
    pub depth: f64,
    /// D \[m\], at least d_0.
    pub max_depth: f64,
    /// w \[1/m^2\].
    pub deep_factor: f64,
    /// L \[m\].
    pub limit_depth: f64,
    /// W \[1/m^2\].
    pub limit_factor: f64,
    /// w_c \[1/m^2\].
    pub medial_factor: f64,
}

impl SkinCost {
    /// Skin this far from the object costs and gains nothing \[m\], and neither does any that is farther.
    pub(crate) fn farthest(&self) -> f64 {
        CUTOFF * self.reach - self.depth
    }

    /// Whether skin at a signed distance \[m\] may cost or gain anything.
    #[inline]
    pub(crate) fn reaches(&self, distance: f64) -> bool {
        distance + self.depth < CUTOFF * self.reach || distance < 0.0
    }

    /// The cost at signed distance `distance` \[m\] of a point that faces the object by `facing`.
    pub fn value<T: Real>(&self, distance: T, facing: f64) -> T {
        let zero = T::zero();
        let miss = (distance + T::constant(self.depth)).max(zero);
        let over = (-distance - T::constant(self.allowed_depth(facing))).max(zero);
        let squared_reach = T::constant(self.reach * self.reach);
        let gain = squared_reach / (squared_reach + miss.square());
        let gain = (gain - T::constant(1.0 / (1.0 + CUTOFF * CUTOFF))).max(zero);
        let beyond = (-distance - T::constant(self.limit_depth)).max(zero);
        over.square().scale(self.deep_factor) + beyond.square().scale(self.limit_factor)
            - gain.scale(facing)
    }

    /// Returns the cost of a medial sphere to whose centre the object is nearer than its radius by `lack` \[m\].
    pub fn medial_value<T: Real>(&self, lack: T) -> T {
        let over = (lack - T::constant(self.max_depth)).max(T::zero());
        over.square().scale(self.medial_factor)
    }

    /// The derivative of [`SkinCost::medial_value`] by the distance of its centre, which is minus that by the lack
    /// \[1/m\], and the weight \[1/m^2\] by which a squared residual has it. 0 at the kink.
    #[inline]
    pub fn medial_slope_and_weight(&self, lack: f64) -> (f64, f64) {
        let over = (lack - self.max_depth).max(0.0);
        if over > 0.0 {
            return (-2.0 * self.medial_factor * over, 2.0 * self.medial_factor);
        }
        (0.0, 0.0)
    }

    /// D min(2 f, 1) \[m\].
    #[inline]
    fn allowed_depth(&self, facing: f64) -> f64 {
        self.max_depth * (2.0 * facing).min(1.0)
    }

    /// The derivative of [`SkinCost::value`] by the distance \[1/m\], and the weight \[1/m^2\] by which the squared
    /// residuals of iteratively reweighted least squares have that derivative: never negative.
    #[inline]
    pub fn slope_and_weight(&self, distance: f64, facing: f64) -> (f64, f64) {
        let miss = (distance + self.depth).max(0.0);
        if miss < CUTOFF * self.reach {
            let squared = self.reach * self.reach;
            let sum = squared + miss * miss;
            let weight = 2.0 * facing * squared / (sum * sum);
            let over = (-distance - self.allowed_depth(facing)).max(0.0);
            // Skin that hardly faces the object is too deep before it is as deep as it would touch best.
            let deep = if over > 0.0 {
                2.0 * self.deep_factor
            } else {
                0.0
            };
            let beyond = (-distance - self.limit_depth).max(0.0);
            let limit = if beyond > 0.0 {
                2.0 * self.limit_factor
            } else {
                0.0
            };
            return (
                weight * miss - deep * over - limit * beyond,
                weight + deep + limit,
            );
        }
        (0.0, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use graspd_ad::{Dual, gradient};
    use proptest::prelude::*;

    const COST: SkinCost = SkinCost {
        reach: 0.8,
        depth: 0.15,
        max_depth: 0.9,
        deep_factor: 3.0,
        limit_depth: 1.4,
        limit_factor: 7.0,
        medial_factor: 5.0,
    };
    /// The closed form rounds otherwise than the chain rule.
    const MODE_TOLERANCE: f64 = 1e-12;
    /// Half width of central differences.
    const STEP: f64 = 1e-6;
    /// Half a step at a jump of the second derivative (at most 6), and cancellation.
    const DIFFERENCE_TOLERANCE: f64 = 1e-5;

    fn slope(distance: f64, facing: f64) -> f64 {
        COST.slope_and_weight(distance, facing).0
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        #[test]
        fn the_slope_is_that_of_both_modes_and_of_differences(
            distance in -3.0..7.0f64,
            facing in 0.0..1.0f64,
        ) {
            // Differences across the cutoff are not small.
            let cutoff = CUTOFF * COST.reach - COST.depth;
            prop_assume!((distance - cutoff).abs() > 2.0 * STEP);
            let claimed = slope(distance, facing);
            let forward = COST.value(Dual::<f64, 1>::variable(distance, 0), facing);
            let (value, reverse) = gradient(|x| COST.value(x[0], facing), &[distance]);
            prop_assert!((claimed - forward.derivative[0]).abs() <= MODE_TOLERANCE);
            prop_assert!((claimed - reverse[0]).abs() <= MODE_TOLERANCE);
            prop_assert!((value - COST.value(distance, facing)).abs() <= MODE_TOLERANCE);
            let at = |d: f64| COST.value(d, facing);
            let numeric = (at(distance + STEP) - at(distance - STEP)) / (2.0 * STEP);
            prop_assert!((claimed - numeric).abs() <= DIFFERENCE_TOLERANCE);
        }

        #[test]
        fn the_slope_of_the_core_is_that_of_both_modes_and_of_differences(lack in -3.0..7.0f64) {
            let (claimed, weight) = COST.medial_slope_and_weight(lack);
            let forward = COST.medial_value(Dual::<f64, 1>::variable(lack, 0));
            let (value, reverse) = gradient(|x| COST.medial_value(x[0]), &[lack]);
            // The distance falls as the lack grows.
            prop_assert!((claimed + forward.derivative[0]).abs() <= MODE_TOLERANCE);
            prop_assert!((claimed + reverse[0]).abs() <= MODE_TOLERANCE);
            prop_assert_eq!(value, COST.medial_value(lack));
            let numeric = (COST.medial_value(lack + STEP) - COST.medial_value(lack - STEP)) / (2.0 * STEP);
            prop_assert!((claimed + numeric).abs() <= DIFFERENCE_TOLERANCE);
            prop_assert_eq!(weight > 0.0, lack > COST.max_depth);
        }

        #[test]
        fn touching_gains_and_deep_costs(distance in -3.0..7.0f64, facing in 0.0..1.0f64) {
            let cost = COST.value(distance, facing);
            // Skin that faces away is best outside.
            let best = COST.value(-COST.depth, facing).min(COST.value(0.0, facing));
            prop_assert!(facing < 0.5 || best <= cost);
            prop_assert!(COST.slope_and_weight(distance, facing).1 >= 0.0);
            let is_right = (-COST.max_depth..=-COST.depth).contains(&distance);
            if facing >= 0.5 && is_right {
                prop_assert_eq!((cost, slope(distance, facing)), (best, 0.0));
            }
            if facing == 0.0 {
                let deep = COST.deep_factor * distance.min(0.0).powi(2);
                let beyond = (distance + COST.limit_depth).min(0.0);
                prop_assert_eq!(cost, deep + COST.limit_factor * beyond.powi(2));
            }
        }
    }

    #[test]
    fn at_its_kinks_the_slope_is_zero() {
        assert_eq!(COST.medial_slope_and_weight(COST.max_depth), (0.0, 0.0));
        let cutoff = CUTOFF * COST.reach - COST.depth;
        for distance in [-COST.depth, -COST.max_depth, cutoff + 1e-12] {
            assert_eq!(slope(distance, 1.0), 0.0);
        }
        // A jump only at the cutoff, from a 20th of the steepest slope.
        let steepest = (0..500)
            .map(|i| slope(f64::from(i) * 0.01, 1.0))
            .fold(0.0, f64::max);
        let last = slope(cutoff - 1e-9, 1.0);
        assert!(0.0 < last && last < 0.05 * steepest, "{last} {steepest}");
    }
}
