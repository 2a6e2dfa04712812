//! Eight `f32` side by side: the scalar of the hot loops.
//!
//! Plain arrays and loops that the compiler turns into vector instructions, rather than a type bound to one
//! instruction set: so one binary runs on every machine, and [`vectorize`] compiles the same code a second time
//! for AVX2 and picks it where the processor has it. The arithmetic is that of `f32`, lane by lane and without
//! fused multiply-add: every path gives the same bits.

use std::ops::{
    Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Rem, RemAssign, Sub,
    SubAssign,
};

use num_traits::{FromPrimitive, One, Zero};

use crate::{Mask, Real};

/// How many numbers [`Lanes`] holds.
const COUNT: usize = 8;

/// Eight `f32` side by side.
///
/// ```
/// use graspd_ad::{Lanes, Mask, Real};
///
/// let x = Lanes::from_lanes(|lane| lane as f64 - 4.0);
/// let negative = x.lt(Lanes::constant(0.0));
/// let clipped = Lanes::select(negative, Lanes::constant(0.0), x);
/// assert_eq!(clipped.0, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
/// assert!(negative.lane(3) && !negative.lane(4));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(32))]
pub struct Lanes(pub [f32; COUNT]);

/// The result of comparing [`Lanes`]: all bits of a lane are set where it is true, none where it is false.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(32))]
pub struct LaneMask([u32; COUNT]);

impl Lanes {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(value: f32) -> Self {
        Self([value; COUNT])
    }

    #[inline(always)]
    fn map(self, function: impl Fn(f32) -> f32) -> Self {
        let mut result = self;
        for lane in 0..COUNT {
            result.0[lane] = function(self.0[lane]);
        }
        result
    }

    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(f32, f32) -> f32) -> Self {
        let mut result = self;
        for lane in 0..COUNT {
            result.0[lane] = function(self.0[lane], other.0[lane]);
        }
        result
    }

    #[inline(always)]
    fn compare(self, other: Self, holds: impl Fn(f32, f32) -> bool) -> LaneMask {
        let mut mask = [0; COUNT];
        for lane in 0..COUNT {
            mask[lane] = if holds(self.0[lane], other.0[lane]) {
                !0
            } else {
                0
            };
        }
        LaneMask(mask)
    }
}

impl LaneMask {
    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(u32, u32) -> u32) -> Self {
        let mut result = self;
        for lane in 0..COUNT {
            result.0[lane] = function(self.0[lane], other.0[lane]);
        }
        result
    }
}

impl Mask for LaneMask {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self([if value { !0 } else { 0 }; COUNT])
    }
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |bits, lane| bits | lane) != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.0.iter().fold(!0, |bits, lane| bits & lane) != 0
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        self.0[lane] != 0
    }
}

impl BitAnd for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        self.zip(other, |a, b| a & b)
    }
}

impl BitOr for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        self.zip(other, |a, b| a | b)
    }
}

impl Not for LaneMask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        self.zip(self, |bits, _| !bits)
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $assign_trait:ident, $assign_method:ident, $operator:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $operator b)
            }
        }
        impl $assign_trait for Lanes {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = *self $operator other;
            }
        }
    };
}
operator!(Add, add, AddAssign, add_assign, +);
operator!(Sub, sub, SubAssign, sub_assign, -);
operator!(Mul, mul, MulAssign, mul_assign, *);
operator!(Div, div, DivAssign, div_assign, /);
operator!(Rem, rem, RemAssign, rem_assign, %);

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl Zero for Lanes {
    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }
    /// Whether every lane is zero.
    #[inline(always)]
    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl One for Lanes {
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

impl FromPrimitive for Lanes {
    #[inline(always)]
    fn from_i64(n: i64) -> Option<Self> {
        f32::from_i64(n).map(Self::splat)
    }
    #[inline(always)]
    fn from_u64(n: u64) -> Option<Self> {
        f32::from_u64(n).map(Self::splat)
    }
    #[inline(always)]
    fn from_f64(n: f64) -> Option<Self> {
        f32::from_f64(n).map(Self::splat)
    }
}

/// Functions that have no vector instruction run lane by lane.
macro_rules! functions_by_lane {
    ($($function:ident),*) => {
        $(
            #[inline(always)]
            fn $function(self) -> Self {
                self.map(f32::$function)
            }
        )*
    };
}

impl Real for Lanes {
    type Mask = LaneMask;
    type Element = f32;
    const LANES: usize = COUNT;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::splat(value as f32)
    }
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> f64) -> Self {
        let mut result = Self::zero();
        for lane in 0..COUNT {
            result.0[lane] = value(lane) as f32;
        }
        result
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        f64::from(self.0[lane])
    }
    #[inline(always)]
    fn load(values: &[f32]) -> Self {
        let mut result = Self::zero();
        result.0.copy_from_slice(&values[..COUNT]);
        result
    }
    #[inline(always)]
    fn store(self, values: &mut [f32]) {
        values[..COUNT].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn gather(values: &[f32], mut index: impl FnMut(usize) -> usize) -> Self {
        let mut result = Self::zero();
        for lane in 0..COUNT {
            result.0[lane] = values[index(lane)];
        }
        result
    }
    #[inline(always)]
    fn detach(self) -> Self {
        self
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn select(mask: LaneMask, on_true: Self, on_false: Self) -> Self {
        let mut result = on_true;
        for lane in 0..COUNT {
            let bits = mask.0[lane];
            result.0[lane] = f32::from_bits(
                (bits & on_true.0[lane].to_bits()) | (!bits & on_false.0[lane].to_bits()),
            );
        }
        result
    }
    /// By repeated squaring, as for `f32`.
    #[inline(always)]
    fn powi(self, exponent: i32) -> Self {
        let mut rest = exponent.unsigned_abs();
        let mut power = self;
        let mut product = Self::one();
        while rest != 0 {
            if rest & 1 != 0 {
                product *= power;
            }
            rest >>= 1;
            if rest != 0 {
                power *= power;
            }
        }
        if exponent < 0 {
            product.recip()
        } else {
            product
        }
    }
    #[inline(always)]
    fn powf(self, exponent: f64) -> Self {
        self.map(|x| x.powf(exponent as f32))
    }
    #[inline(always)]
    fn atan2(self, other: Self) -> Self {
        self.zip(other, f32::atan2)
    }
    functions_by_lane!(
        recip, sqrt, abs, exp, ln, sin, cos, tan, asin, acos, atan, tanh
    );
}

/// Runs `work`, compiled for AVX2 where the processor has it.
///
/// The result is the same bit for bit with and without, because fused multiply-add stays off.
///
/// Only code that is inlined into `work` is compiled for AVX2: mark the functions it calls in its hot loop
/// `#[inline(always)]`, as the arithmetic of this crate is, and put the loop inside, not around.
///
/// ```
/// use graspd_ad::{Lanes, Real, vectorize};
///
/// #[inline(always)]
/// fn sum_of_squares(values: &[f32]) -> Lanes {
///     values.chunks_exact(8).fold(Lanes::constant(0.0), |sum, x| sum + Lanes::load(x).square())
/// }
/// let values = [2.0; 16];
/// assert_eq!(vectorize(|| sum_of_squares(&values)), Lanes::constant(8.0));
/// ```
#[inline]
pub fn vectorize<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<R>(work: impl FnOnce() -> R) -> R {
            work()
        }
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: calling a function compiled for AVX2 is sound on a processor that has AVX2, which was
            // just tested; `with_avx2` does nothing else.
            return unsafe { with_avx2(work) };
        }
    }
    work()
}
