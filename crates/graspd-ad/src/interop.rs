//! The traits of num-traits that our scalars can keep the promises of, beyond those that [`Real`] demands.
//!
//! `Num`, `Signed` and `FloatConst` let generic numeric code run on them; `Inv`, `Pow` and `MulAdd` name single
//! operations. Not `Float`, `Real`, `NumCast` and `ToPrimitive`: they demand an order, which a scalar with lanes or
//! derivatives has only in part, or a conversion to a plain number, which would drop the derivatives unsaid.
//! Not `Signed` for lanes, whose signs differ.

use num_traits::{FloatConst, Inv, MulAdd, MulAddAssign, Num, Pow, Signed, Zero};

use crate::lanes::Register;
use crate::{Dual, LanesOver, Real, Var};

macro_rules! operations {
    ([$($parameters:tt)*] $scalar:ty) => {
        impl<$($parameters)*> Inv for $scalar {
            type Output = Self;
            #[inline(always)]
            fn inv(self) -> Self {
                self.recip()
            }
        }
        impl<$($parameters)*> Pow<i32> for $scalar {
            type Output = Self;
            #[inline(always)]
            fn pow(self, exponent: i32) -> Self {
                self.powi(exponent)
            }
        }
        impl<$($parameters)*> Pow<f64> for $scalar {
            type Output = Self;
            #[inline(always)]
            fn pow(self, exponent: f64) -> Self {
                self.powf(exponent)
            }
        }
        impl<$($parameters)*> MulAdd for $scalar {
            type Output = Self;
            /// Rounded as the multiplication and the addition are.
            #[inline(always)]
            fn mul_add(self, a: Self, b: Self) -> Self {
                Real::mul_add(self, a, b)
            }
        }
        impl<$($parameters)*> MulAddAssign for $scalar {
            #[inline(always)]
            fn mul_add_assign(&mut self, a: Self, b: Self) {
                *self = Real::mul_add(*self, a, b);
            }
        }
        constants!([$($parameters)*] $scalar:
            E FRAC_1_PI FRAC_1_SQRT_2 FRAC_2_PI FRAC_2_SQRT_PI FRAC_PI_2 FRAC_PI_3 FRAC_PI_4 FRAC_PI_6 FRAC_PI_8
            LN_10 LN_2 LOG10_E LOG2_E PI SQRT_2 TAU LOG10_2 LOG2_10);
    };
}
macro_rules! constants {
    ([$($parameters:tt)*] $scalar:ty: $($constant:ident)*) => {
        impl<$($parameters)*> FloatConst for $scalar {
            $(
                #[inline(always)]
                fn $constant() -> Self {
                    <Self as Real>::constant(<f64 as FloatConst>::$constant())
                }
            )*
        }
    };
}
operations!([T: Real, const N: usize] Dual<T, N>);
operations!([R: Register] LanesOver<R>);
operations!([T: Real<Mask = bool> + 'static] Var<'_, T>);

macro_rules! numbers {
    ([$($parameters:tt)*] $scalar:ty) => {
        impl<$($parameters)*> Num for $scalar {
            type FromStrRadixErr = T::FromStrRadixErr;
            /// A constant.
            fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
                T::from_str_radix(text, radix).map(Self::constant)
            }
        }
        impl<$($parameters)*> Signed for $scalar {
            /// As [`Real::abs`]: derivative 0 at 0.
            #[inline(always)]
            fn abs(&self) -> Self {
                Real::abs(*self)
            }
            #[inline(always)]
            fn abs_sub(&self, other: &Self) -> Self {
                Self::select(self.le(*other), Self::zero(), *self - *other)
            }
            /// A constant.
            #[inline(always)]
            fn signum(&self) -> Self {
                Self::constant(self.value.signum())
            }
            #[inline(always)]
            fn is_positive(&self) -> bool {
                self.value.is_positive()
            }
            #[inline(always)]
            fn is_negative(&self) -> bool {
                self.value.is_negative()
            }
        }
    };
}
numbers!([T: Real<Mask = bool> + Signed, const N: usize] Dual<T, N>);
numbers!([T: Real<Mask = bool> + Signed + 'static] Var<'_, T>);

impl<R: Register> Num for LanesOver<R> {
    type FromStrRadixErr = <f32 as Num>::FromStrRadixErr;
    /// The same number in every lane.
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        <f32 as Num>::from_str_radix(text, radix).map(Self::splat)
    }
}

#[cfg(test)]
mod tests {
    use num_traits::{FromPrimitive, NumOps, One};

    use super::*;
    use crate::{Lanes, gradient};

    /// `x^3 / 2 + x % 2 - 1`, over num-traits alone.
    fn polynomial<T>(x: T) -> T
    where
        T: Copy + Zero + One + NumOps + FromPrimitive,
    {
        let two = T::from_f64(2.0).unwrap();
        num_traits::pow(x, 3) / two + x % (T::one() + T::one()) - T::from_u8(1).unwrap()
    }

    fn length<T: Num + Copy + Signed + Pow<f64, Output = T>>(values: &[T]) -> T {
        let squares = values.iter().fold(T::zero(), |sum, &x| sum + x * x);
        squares.pow(0.5) + values[0].abs_sub(&values[1]) * values[0].signum()
    }

    #[test]
    fn generic_code_runs_on_every_scalar() {
        assert_eq!(polynomial(3.0), 13.5);
        assert_eq!(polynomial(Dual::new(3.0, [1.0])), Dual::new(13.5, [14.5]));
        assert_eq!(gradient(|x| polynomial(x[0]), &[3.0]), (13.5, vec![14.5]));
        assert_eq!(polynomial(Lanes::splat(3.0)), Lanes::splat(13.5));
        assert_eq!(
            polynomial(Dual::<Lanes, 1>::variable(Lanes::splat(3.0), 0)),
            Dual::new(Lanes::splat(13.5), [Lanes::splat(14.5)])
        );
    }

    #[test]
    fn signed_numbers() {
        let (value, slopes) = gradient(|x| length(x), &[-3.0, -4.0]);
        assert_eq!(value, 4.0);
        assert!((slopes[0] + 1.6).abs() < 1e-15 && (slopes[1] - 0.2).abs() < 1e-15);
        let point = Dual::variables([-3.0, -4.0]);
        assert_eq!(length(&point).derivative.to_vec(), slopes);
        assert!(point[0].is_negative() && !point[0].is_positive());
    }

    #[test]
    fn single_operations_and_constants() {
        let x = Dual::new(4.0, [1.0]);
        assert_eq!(x.inv(), Dual::new(0.25, [-0.0625]));
        assert_eq!(Pow::pow(x, 2), Dual::new(16.0, [8.0]));
        assert_eq!(MulAdd::mul_add(x, x, x), Dual::new(20.0, [9.0]));
        let mut y = x;
        y.mul_add_assign(x, x);
        assert_eq!(y, Dual::new(20.0, [9.0]));
        assert_eq!(Dual::<f64, 1>::PI(), Dual::new(std::f64::consts::PI, [0.0]));
        assert_eq!(Lanes::TAU(), Lanes::splat(std::f32::consts::TAU));
        assert_eq!(
            Dual::from_str_radix("2.5", 10).unwrap(),
            Dual::new(2.5, [0.0])
        );
        assert_eq!(Lanes::from_str_radix("2.5", 10).unwrap(), Lanes::splat(2.5));
    }

    #[test]
    fn a_variable_that_happens_to_be_zero_or_one_is_no_constant() {
        assert!(!Dual::new(0.0, [1.0]).is_zero() && Dual::new(0.0, [0.0]).is_zero());
        assert!(!Dual::new(1.0, [1.0]).is_one() && Dual::new(1.0, [0.0]).is_one());
        crate::Tape::new().scope(|recording| {
            let (zero, one) = (recording.variable(0.0), recording.variable(1.0));
            assert!(!zero.is_zero() && !one.is_one());
            assert!(Var::<f64>::zero().is_zero() && Var::<f64>::one().is_one());
            assert!(one == one && one != recording.variable(1.0) && one != Var::one());
        });
    }
}
