//! The derivative of each elementary function: `(f(x), f'(x))`, stated once for forward and reverse mode.
//!
//! Where the true derivative is infinite or undefined, the one returned here is 0. The zero is selected as a
//! constant, so that it also holds for the second derivative when `T` itself carries derivatives.

use crate::Real;

/// `slope` where `x > 0`, else the constant 0.
#[inline(always)]
fn where_positive<T: Real>(x: T, slope: T) -> T {
    T::select(T::zero().lt(x), slope, T::zero())
}

/// x / y and its derivatives 1 / y and -(x / y) / y.
#[inline(always)]
pub(crate) fn div<T: Real>(x: T, y: T) -> (T, T, T) {
    let quotient = x / y;
    let inverse = y.recip();
    (quotient, inverse, -quotient * inverse)
}

/// x % y = x - n y, with the integer n = trunc(x / y) that is constant between jumps: derivatives 1 and -n.
#[inline(always)]
pub(crate) fn rem<T: Real>(x: T, y: T) -> (T, T, T) {
    let rest = x % y;
    let count = T::from_lanes(|lane| ((x.lane(lane) - rest.lane(lane)) / y.lane(lane)).round());
    (rest, T::one(), -count)
}

/// (x^2)' = 2 x.
#[inline(always)]
pub(crate) fn square<T: Real>(x: T) -> (T, T) {
    (x.square(), x + x)
}

/// (1 / x)' = -1 / x^2.
#[inline(always)]
pub(crate) fn recip<T: Real>(x: T) -> (T, T) {
    let inverse = x.recip();
    (inverse, -inverse.square())
}

/// sqrt(x)' = 1 / (2 sqrt(x)); 0 at 0.
#[inline(always)]
pub(crate) fn sqrt<T: Real>(x: T) -> (T, T) {
    let root = x.sqrt();
    (root, where_positive(x, T::constant(0.5) / root))
}

/// |x|' = sign(x); 0 at 0.
#[inline(always)]
pub(crate) fn abs<T: Real>(x: T) -> (T, T) {
    let sign = where_positive(x, T::one()) - where_positive(-x, T::one());
    (x.abs(), sign)
}

/// (x^n)' = n x^(n-1); 0 for n = 0.
#[inline(always)]
pub(crate) fn powi<T: Real>(x: T, exponent: i32) -> (T, T) {
    if exponent == 0 {
        return (T::one(), T::zero());
    }
    let slope = x.powi(exponent.saturating_sub(1));
    (x.powi(exponent), slope.scale(f64::from(exponent)))
}

/// (x^p)' = p x^(p-1); 0 for p = 0, and 0 at x = 0 for p < 1.
#[inline(always)]
pub(crate) fn powf<T: Real>(x: T, exponent: f64) -> (T, T) {
    if exponent == 0.0 {
        return (T::one(), T::zero());
    }
    let slope = x.powf(exponent - 1.0).scale(exponent);
    let slope = if exponent < 1.0 {
        where_positive(x.abs(), slope)
    } else {
        slope
    };
    (x.powf(exponent), slope)
}

/// exp(x)' = exp(x).
#[inline(always)]
pub(crate) fn exp<T: Real>(x: T) -> (T, T) {
    let value = x.exp();
    (value, value)
}

/// ln(x)' = 1 / x.
#[inline(always)]
pub(crate) fn ln<T: Real>(x: T) -> (T, T) {
    (x.ln(), x.recip())
}

/// sin(x)' = cos(x).
#[inline(always)]
pub(crate) fn sin<T: Real>(x: T) -> (T, T) {
    x.sin_cos()
}

/// cos(x)' = -sin(x).
#[inline(always)]
pub(crate) fn cos<T: Real>(x: T) -> (T, T) {
    let (sin, cos) = x.sin_cos();
    (cos, -sin)
}

/// tan(x)' = 1 + tan(x)^2.
#[inline(always)]
pub(crate) fn tan<T: Real>(x: T) -> (T, T) {
    let tan = x.tan();
    (tan, T::one() + tan.square())
}

/// asin(x)' = 1 / sqrt(1 - x^2); 0 at -1 and 1.
#[inline(always)]
pub(crate) fn asin<T: Real>(x: T) -> (T, T) {
    // As a product, 1 - x^2 keeps its digits near its zeros.
    let rest = (T::one() - x) * (T::one() + x);
    (x.asin(), where_positive(rest, rest.sqrt().recip()))
}

/// acos(x)' = -1 / sqrt(1 - x^2); 0 at -1 and 1.
#[inline(always)]
pub(crate) fn acos<T: Real>(x: T) -> (T, T) {
    let (_, slope) = asin(x);
    (x.acos(), -slope)
}

/// atan(x)' = 1 / (1 + x^2).
#[inline(always)]
pub(crate) fn atan<T: Real>(x: T) -> (T, T) {
    (x.atan(), (T::one() + x.square()).recip())
}

/// atan2(y, x) and its derivatives x / (x^2 + y^2) and -y / (x^2 + y^2); both 0 at the origin.
#[inline(always)]
pub(crate) fn atan2<T: Real>(y: T, x: T) -> (T, T, T) {
    // Divided by the larger coordinate, the squares neither overflow nor vanish. The divisor cancels, so it
    // may count as a constant.
    let size = x.abs().max(y.abs()).detach();
    let (unit_y, unit_x) = (y / size, x / size);
    let inverse = ((unit_x.square() + unit_y.square()) * size).recip();
    (
        y.atan2(x),
        where_positive(size, unit_x * inverse),
        where_positive(size, -unit_y * inverse),
    )
}

/// tanh(x)' = 1 - tanh(x)^2.
#[inline(always)]
pub(crate) fn tanh<T: Real>(x: T) -> (T, T) {
    let value = x.tanh();
    (value, T::one() - value.square())
}

/// Implements the elementary functions of [`Real`] by the rules of this module, for a scalar with a field
/// `value` and a method `chain(value, slope)`.
macro_rules! functions_by_rule {
    () => {
        $crate::rule::functions_by_rule!(
            square, recip, sqrt, abs, exp, ln, sin, cos, tan, asin, acos, atan, tanh
        );
    };
    ($($function:ident),+) => {
        $(
            #[inline(always)]
            fn $function(self) -> Self {
                let (value, slope) = $crate::rule::$function(self.value);
                self.chain(value, slope)
            }
        )+
        #[inline(always)]
        fn sin_cos(self) -> (Self, Self) {
            let (sin, cos) = self.value.sin_cos();
            (self.chain(sin, cos), self.chain(cos, -sin))
        }
        #[inline(always)]
        fn powi(self, exponent: i32) -> Self {
            let (value, slope) = $crate::rule::powi(self.value, exponent);
            self.chain(value, slope)
        }
        #[inline(always)]
        fn powf(self, exponent: f64) -> Self {
            let (value, slope) = $crate::rule::powf(self.value, exponent);
            self.chain(value, slope)
        }
        #[inline(always)]
        fn atan2(self, other: Self) -> Self {
            let (value, slope_self, slope_other) = $crate::rule::atan2(self.value, other.value);
            self.chain2(other, value, slope_self, slope_other)
        }
    };
}
pub(crate) use functions_by_rule;
