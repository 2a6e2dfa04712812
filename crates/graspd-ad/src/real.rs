//! The scalar that all differentiable code is written over.

use std::fmt::Debug;
use std::ops::{BitAnd, BitOr, Not};

use num_traits::{FromPrimitive, NumAssignOps, NumOps, One, Zero};

/// The result of comparing two [`Real`]s: one truth value for each lane.
pub trait Mask:
    Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self>
{
    /// The same truth value in every lane.
    fn splat(value: bool) -> Self;
    /// Whether any lane is true.
    fn any(self) -> bool;
    /// Whether every lane is true.
    fn all(self) -> bool;
    /// The truth value of one lane.
    fn lane(self, lane: usize) -> bool;
}

impl Mask for bool {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        value
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
    #[inline(always)]
    fn lane(self, _lane: usize) -> bool {
        self
    }
}

/// A plain floating point number, the element that buffers store: `f64` or `f32`.
pub trait Element:
    num_traits::Float + Real<Mask = bool, Element = Self> + Default + Send + Sync + 'static
{
    /// How many elements a kernel takes at a time at most.
    const MAX_LANES: usize;
    /// Runs a kernel over buffers of this element: `f32` as [`vectorize`](crate::vectorize) does, `f64` one element
    /// at a time.
    fn vectorize<K: Kernel<Self>>(kernel: K) -> K::Output;
}
impl Element for f64 {
    const MAX_LANES: usize = 1;
    fn vectorize<K: Kernel<f64>>(kernel: K) -> K::Output {
        kernel.run::<f64>()
    }
}
/// A hot loop over buffers of `E`, written for any lanes, which [`Element::vectorize`] and
/// [`vectorize`](crate::vectorize) run with the best ones of the machine.
pub trait Kernel<E: Element = f32> {
    /// What the loop returns.
    type Output;
    /// The loop. Only what is inlined into it is compiled for the wider registers, and what is not runs far slower
    /// than without them. So mark this function and all that it calls for each element `#[inline(always)]`, and
    /// let no lanes pass through closures, `std::array::from_fn`, `map` or iterators: write functions and loops.
    fn run<L: Real<Element = E>>(self) -> Self::Output;
}

/// A real number, possibly several side by side (lanes), possibly carrying derivatives.
///
/// Implemented by `f64`, `f32`, [`Lanes`](crate::Lanes), [`Dual`](crate::Dual) over any of these (and
/// over duals), and [`Var`](crate::Var). Code written once over `T: Real` runs on all of them.
///
/// Conventions:
/// * Comparisons look at real parts only and give a [`Mask`]; branch with [`Real::select`], which takes
///   value *and* derivative from the chosen side. A derivative of the side not chosen never leaks, even
///   when it is infinite or NaN.
/// * At a kink the derivative is one that the documentation of the function names; it is never NaN.
/// * `Real` does not require `'static`: a `Var` borrows its tape.
///
/// NaN and signed zeros are those of IEEE 754, in every lane as in a plain float, bit for bit but for which NaN it is:
/// * Comparisons with NaN are false, so `!x.lt(y)` is not `x.ge(y)`, and `select` then takes its last argument.
/// * [`Real::min`] and [`Real::max`] are such selections: `other` if either is NaN. So `x.min(NaN)` is NaN but
///   `NaN.min(x)` is `x`, other than `f32::min`; and `NaN.clamp(low, high)` is `low`.
/// * -0 equals 0, and of the two `min` and `max` give `self`. Negation and `abs` change the sign of zeros; `floor`,
///   `sqrt`, `sin`, `tan`, `asin`, `atan`, `tanh` keep it.
/// * [`Real::recip`] of -0 is -infinity; `sqrt` and `ln` of what is below 0 are NaN.
/// * Denormal numbers are kept: no instruction set flushes them to 0.
pub trait Real:
    Copy + Debug + Zero + One + NumOps + NumAssignOps + std::ops::Neg<Output = Self> + FromPrimitive
{
    /// What a comparison gives.
    type Mask: Mask;
    /// The plain float that buffers of this scalar's real parts hold.
    type Element: Element;
    /// How many numbers stand side by side.
    const LANES: usize;

    /// A constant, in every lane, with derivative zero.
    fn constant(value: f64) -> Self;
    /// A constant for each lane, with derivative zero.
    fn from_lanes(value: impl FnMut(usize) -> f64) -> Self;
    /// The real part of one lane.
    fn lane(self, lane: usize) -> f64;
    /// The first [`Self::LANES`] elements of a slice, as a constant.
    fn load(values: &[Self::Element]) -> Self;
    /// Writes the real parts to the first [`Self::LANES`] elements of a slice.
    fn store(self, values: &mut [Self::Element]);
    /// `values[indices[lane]]` in each lane, as a constant; of `indices` the first [`Self::LANES`] count.
    ///
    /// # Panics
    /// If there is no such value.
    fn gather(values: &[f32], indices: &[u32]) -> Self;
    /// Each lane rounded towards zero, to the first [`Self::LANES`] places of a slice: the indices for
    /// [`Real::gather`]. What is negative or NaN gives 0, what is beyond 2^31 gives 2^31.
    #[inline(always)]
    fn store_indices(self, indices: &mut [u32]) {
        for lane in 0..Self::LANES {
            indices[lane] = (self.lane(lane) as u32).min(1 << 31);
        }
    }
    /// The same value with derivative zero.
    fn detach(self) -> Self;

    /// `self < other`, by real parts.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`, by real parts.
    fn le(self, other: Self) -> Self::Mask;
    /// `self > other`, by real parts.
    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        other.lt(self)
    }
    /// `self >= other`, by real parts.
    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        other.le(self)
    }
    /// `on_true` where the mask holds, `on_false` elsewhere: value and derivative.
    fn select(mask: Self::Mask, on_true: Self, on_false: Self) -> Self;

    /// Smaller of the two; at a tie `self`, with its derivative.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.le(other), self, other)
    }
    /// Larger of the two; at a tie `self`, with its derivative.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.ge(other), self, other)
    }
    /// Clamped to `[low, high]`; at a bound `self`'s derivative passes.
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    /// `self * a + b`, rounded as the multiplication and the addition are.
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    /// `self * factor` for a constant factor; cheaper than multiplying with [`Real::constant`].
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }
    /// `self * factor.detach()`: the product with `factor` held constant, cheaper than writing it out.
    #[inline(always)]
    fn mul_detached(self, factor: Self) -> Self {
        self * factor.detach()
    }
    /// Square.
    #[inline(always)]
    fn square(self) -> Self {
        self * self
    }
    /// Largest integer that is not above `self`; derivative 0 everywhere.
    #[inline(always)]
    fn floor(self) -> Self {
        Self::from_lanes(|lane| self.lane(lane).floor())
    }
    /// `1 / self`.
    fn recip(self) -> Self;
    /// Square root. At 0 the value is 0 and the derivative 0 (the true one is infinite).
    fn sqrt(self) -> Self;
    /// Absolute value; derivative 0 at 0.
    fn abs(self) -> Self;
    /// Integer power.
    fn powi(self, exponent: i32) -> Self;
    /// Real power, for a positive base.
    fn powf(self, exponent: f64) -> Self;
    /// e^self.
    fn exp(self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// Sine, radians.
    fn sin(self) -> Self;
    /// Cosine, radians.
    fn cos(self) -> Self;
    /// Sine and cosine.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }
    /// Tangent.
    fn tan(self) -> Self;
    /// Arc sine; at -1 and 1 the derivative is 0 (the true one is infinite).
    fn asin(self) -> Self;
    /// Arc cosine; at -1 and 1 the derivative is 0 (the true one is infinite).
    fn acos(self) -> Self;
    /// Arc tangent.
    fn atan(self) -> Self;
    /// Angle of the point (`other`, `self`), in (-pi, pi]; derivative 0 at the origin.
    fn atan2(self, other: Self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
}

macro_rules! impl_real_for_float {
    ($float:ty) => {
        impl Real for $float {
            type Mask = bool;
            type Element = $float;
            const LANES: usize = 1;

            #[inline(always)]
            fn constant(value: f64) -> Self {
                value as $float
            }
            #[inline(always)]
            fn from_lanes(mut value: impl FnMut(usize) -> f64) -> Self {
                value(0) as $float
            }
            #[inline(always)]
            #[allow(clippy::unnecessary_cast)] // The macro also serves f32.
            fn lane(self, _lane: usize) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn load(values: &[$float]) -> Self {
                values[0]
            }
            #[inline(always)]
            fn store(self, values: &mut [$float]) {
                values[0] = self;
            }
            #[inline(always)]
            #[allow(clippy::unnecessary_cast)]
            fn gather(values: &[f32], indices: &[u32]) -> Self {
                values[indices[0] as usize] as $float
            }
            #[inline(always)]
            fn detach(self) -> Self {
                self
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn select(mask: bool, on_true: Self, on_false: Self) -> Self {
                if mask { on_true } else { on_false }
            }
            #[inline(always)]
            fn recip(self) -> Self {
                <$float>::recip(self)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$float>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$float>::abs(self)
            }
            #[inline(always)]
            fn powi(self, exponent: i32) -> Self {
                <$float>::powi(self, exponent)
            }
            #[inline(always)]
            fn powf(self, exponent: f64) -> Self {
                <$float>::powf(self, exponent as $float)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                <$float>::exp(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                <$float>::ln(self)
            }
            #[inline(always)]
            fn sin(self) -> Self {
                <$float>::sin(self)
            }
            #[inline(always)]
            fn cos(self) -> Self {
                <$float>::cos(self)
            }
            #[inline(always)]
            fn tan(self) -> Self {
                <$float>::tan(self)
            }
            #[inline(always)]
            fn asin(self) -> Self {
                <$float>::asin(self)
            }
            #[inline(always)]
            fn acos(self) -> Self {
                <$float>::acos(self)
            }
            #[inline(always)]
            fn atan(self) -> Self {
                <$float>::atan(self)
            }
            #[inline(always)]
            fn atan2(self, other: Self) -> Self {
                <$float>::atan2(self, other)
            }
            #[inline(always)]
            fn tanh(self) -> Self {
                <$float>::tanh(self)
            }
        }
    };
}
impl_real_for_float!(f64);
impl_real_for_float!(f32);
