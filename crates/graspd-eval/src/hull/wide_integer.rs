//! Signed integers of 384 bits: wide enough for any 6 x 6 determinant of 52-bit entries.

const LIMBS: usize = 6;

/// A two's-complement integer, least significant limb first. Arithmetic wraps; callers stay within range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct WideInteger([u64; LIMBS]);

impl WideInteger {
    pub(super) const ZERO: Self = Self([0; LIMBS]);
    pub(super) const ONE: Self = {
        let mut limbs = [0; LIMBS];
        limbs[0] = 1;
        Self(limbs)
    };

    pub(super) fn add(&self, other: &Self) -> Self {
        let mut sum = [0; LIMBS];
        let mut carry = 0u128;
        for k in 0..LIMBS {
            let total = u128::from(self.0[k]) + u128::from(other.0[k]) + carry;
            sum[k] = total as u64;
            carry = total >> 64;
        }
        Self(sum)
    }

    pub(super) fn negate(&self) -> Self {
        Self(self.0.map(|limb| !limb)).add(&Self::ONE)
    }

    /// The product with a machine integer.
    pub(super) fn times(&self, factor: i64) -> Self {
        // Multiplication modulo 2^384 by the magnitude is right for negative values too.
        let magnitude = u128::from(factor.unsigned_abs());
        let mut product = [0; LIMBS];
        let mut carry = 0u128;
        for k in 0..LIMBS {
            let total = u128::from(self.0[k]) * magnitude + carry;
            product[k] = total as u64;
            carry = total >> 64;
        }
        let product = Self(product);
        if factor < 0 {
            product.negate()
        } else {
            product
        }
    }

    /// -1, 0 or 1.
    pub(super) fn signum(&self) -> i32 {
        if self.0[LIMBS - 1] >> 63 == 1 {
            -1
        } else {
            i32::from(self.0.iter().any(|&limb| limb != 0))
        }
    }

    /// The nearest double, to within one unit in the last place.
    pub(super) fn to_f64(self) -> f64 {
        let is_negative = self.signum() < 0;
        let magnitude = if is_negative { self.negate() } else { self };
        // Horner from the top limb: each limb below the leading two adds less than one rounding.
        let mut value = 0.0;
        for limb in magnitude.0.iter().rev() {
            value = value * 18_446_744_073_709_551_616.0 + *limb as f64;
        }
        if is_negative { -value } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn of(value: i64) -> WideInteger {
        WideInteger::ONE.times(value)
    }

    proptest! {
        #[test]
        fn sums_and_products_agree_with_128_bits(a: i64, b: i64, c: i32) {
            let expected = i128::from(a) * i128::from(b) + i128::from(c);
            let wide = of(a).times(b).add(&of(i64::from(c)));
            prop_assert_eq!(wide.signum(), expected.signum() as i32);
            let value = expected as f64;
            prop_assert!((wide.to_f64() - value).abs() <= 2.0 * f64::EPSILON * value.abs());
        }
    }

    #[test]
    fn six_factors_of_52_bits_fit_with_room_for_a_determinant() {
        let factor = -(1i64 << 52) + 1;
        let mut product = WideInteger::ONE;
        for _ in 0..6 {
            product = product.times(factor);
        }
        assert_eq!(product.signum(), 1);
        let expected = (factor as f64).powi(6);
        assert!((product.to_f64() / expected - 1.0).abs() < 1e-14);
        // 6^3 times as much is Hadamard's bound, and must not wrap.
        assert_eq!(product.times(-216).signum(), -1);
        assert_eq!(product.add(&product.negate()), WideInteger::ZERO);
    }
}
