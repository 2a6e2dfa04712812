//! Functions whose plain formula has no usable derivative somewhere.

use crate::Real;

/// Length of a vector, `sqrt(v_1^2 + ... + v_n^2)`; at 0 value and derivatives are 0.
///
/// The squares vanish, and the length and its derivatives with them, for vectors shorter than about 1e-160
/// (1e-22 in `f32`).
///
/// ```
/// use graspd_ad::{gradient, safe_norm};
///
/// assert_eq!(gradient(|x| safe_norm([x[0], x[1]]), &[3.0, 4.0]).0, 5.0);
/// assert_eq!(gradient(|x| safe_norm([x[0], x[1]]), &[0.0, 0.0]), (0.0, vec![0.0, 0.0]));
/// ```
#[inline(always)]
pub fn safe_norm<T: Real, const N: usize>(vector: [T; N]) -> T {
    let mut sum = T::zero();
    for axis in 0..N {
        sum += vector[axis].square();
    }
    sum.sqrt()
}

/// `numerator / denominator`; where the denominator is 0, value and derivatives are 0.
///
/// ```
/// use graspd_ad::{gradient, safe_divide};
///
/// assert_eq!(gradient(|x| safe_divide(x[0], x[1]), &[1.0, 4.0]), (0.25, vec![0.25, -0.0625]));
/// assert_eq!(gradient(|x| safe_divide(x[0], x[1]), &[1.0, 0.0]), (0.0, vec![0.0, 0.0]));
/// ```
#[inline(always)]
pub fn safe_divide<T: Real>(numerator: T, denominator: T) -> T {
    let zero = denominator.le(T::zero()) & denominator.ge(T::zero());
    T::select(zero, T::zero(), numerator / denominator)
}

/// Arc cosine of `cosine` clamped to [-1, 1], for cosines that rounding has carried outside; the derivative is 0
/// from -1 and 1 outwards.
///
/// ```
/// use graspd_ad::{gradient, safe_acos};
///
/// assert_eq!(gradient(|x| safe_acos(x[0]), &[1.0 + 1e-15]), (0.0, vec![0.0]));
/// ```
#[inline(always)]
pub fn safe_acos<T: Real>(cosine: T) -> T {
    cosine.clamp(-T::one(), T::one()).acos()
}

/// `min(distance, 0)` in value; the derivative is 1 where `distance <= 0`, and `leak` instead of 0 elsewhere.
///
/// So a point that touches nothing yet still feels in which way contact lies.
///
/// # Source
/// Grasp'D (Turpin et al., ECCV 2022): the leaky gradient, with `leak = 0.1`.
///
/// ```
/// use graspd_ad::{gradient, leaky_min};
///
/// assert_eq!(gradient(|x| leaky_min(x[0], 0.1), &[-2.0]), (-2.0, vec![1.0]));
/// assert_eq!(gradient(|x| leaky_min(x[0], 0.1), &[2.0]), (0.0, vec![0.1]));
/// ```
#[inline(always)]
pub fn leaky_min<T: Real>(distance: T, leak: f64) -> T {
    // Exactly 0 in value.
    let outside = (distance - distance.detach()).scale(leak);
    T::select(distance.le(T::zero()), distance, outside)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dual, Lanes};

    type Second = Dual<Dual<f64, 1>, 1>;

    fn second(x: f64) -> Second {
        Dual::variable(Dual::variable(x, 0), 0)
    }

    #[test]
    fn leaky_min_by_lane() {
        let distance = Lanes::from_lanes(|lane| lane as f64 - 4.0);
        let contact = leaky_min(Dual::<Lanes, 1>::variable(distance, 0), 0.1);
        assert_eq!(
            contact.value.to_array(),
            [-4.0, -3.0, -2.0, -1.0, 0.0, 0.0, 0.0, 0.0]
        );
        assert_eq!(
            contact.derivative[0].to_array(),
            [1.0, 1.0, 1.0, 1.0, 1.0, 0.1, 0.1, 0.1]
        );
    }

    #[test]
    fn leaky_min_is_straight_on_both_sides() {
        for x in [-3.0, 0.0, 1e-9, 0.3] {
            let contact = leaky_min(second(x), 0.1);
            let slope = if x <= 0.0 { 1.0 } else { 0.1 };
            assert_eq!(contact.value, Dual::new(x.min(0.0), [slope]));
            assert_eq!(contact.derivative[0], Dual::new(slope, [0.0]));
        }
        // The zero has no sign that a division could turn into minus infinity.
        assert!(leaky_min(0.3_f64, 0.1).is_sign_positive());
    }

    #[test]
    fn nothing_is_nan_where_the_formula_breaks_down() {
        let [x, y] = Dual::<Dual<f64, 2>, 2>::variables(Dual::variables([0.0, 0.0]));
        assert_eq!(safe_norm([x, y]), Dual::constant(Dual::constant(0.0)));
        assert_eq!(
            safe_divide(x + Real::constant(1.0), y),
            Dual::constant(Dual::constant(0.0))
        );
        let angle = safe_acos(second(-1.0 - 1e-12));
        assert_eq!(angle, Dual::constant(Dual::constant(std::f64::consts::PI)));
    }
}
