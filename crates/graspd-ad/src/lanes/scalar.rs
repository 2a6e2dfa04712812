//! The scalar over a register of eight `f32`.

use std::ops::{
    Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign,
};

use num_traits::{FromPrimitive, One, Zero};

use super::LaneMask;
use super::register::{COUNT, Register};
use crate::Real;

/// Eight `f32` side by side, in one kind of vector register; see [`Lanes`](crate::Lanes).
#[derive(Clone, Copy, Debug)]
pub struct LanesOver<R>(R);

impl<R: Register> LanesOver<R> {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(value: f32) -> Self {
        Self::from_array([value; COUNT])
    }
    /// A number for each lane.
    #[inline(always)]
    pub fn from_array(values: [f32; COUNT]) -> Self {
        Self(R::from_array(values))
    }
    /// The number in each lane.
    #[inline(always)]
    pub fn to_array(self) -> [f32; COUNT] {
        self.0.to_array()
    }

    #[inline(always)]
    fn map(self, function: impl Fn(f32) -> f32) -> Self {
        let mut lanes = self.to_array();
        for lane in &mut lanes {
            *lane = function(*lane);
        }
        Self::from_array(lanes)
    }
    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(f32, f32) -> f32) -> Self {
        let mut lanes = self.to_array();
        for (lane, other) in lanes.iter_mut().zip(other.to_array()) {
            *lane = function(*lane, other);
        }
        Self::from_array(lanes)
    }
}

impl<R: Register> PartialEq for LanesOver<R> {
    /// Whether all lanes are equal.
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.to_array() == other.to_array()
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $assign_trait:ident, $assign_method:ident, $operator:tt) => {
        impl<R: Register> $trait for LanesOver<R> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(R::$method(self.0, other.0))
            }
        }
        operator!($assign_trait, $assign_method, $operator);
    };
    ($assign_trait:ident, $assign_method:ident, $operator:tt) => {
        impl<R: Register> $assign_trait for LanesOver<R> {
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
operator!(RemAssign, rem_assign, %);

impl<R: Register> Rem for LanesOver<R> {
    type Output = Self;
    #[inline(always)]
    fn rem(self, other: Self) -> Self {
        self.zip(other, |a, b| a % b)
    }
}

impl<R: Register> Neg for LanesOver<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.neg())
    }
}

impl<R: Register> Zero for LanesOver<R> {
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

impl<R: Register> One for LanesOver<R> {
    #[inline(always)]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

impl<R: Register> FromPrimitive for LanesOver<R> {
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

impl<R: Register> Real for LanesOver<R> {
    type Mask = LaneMask<R>;
    type Element = f32;
    const LANES: usize = COUNT;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::splat(value as f32)
    }
    #[inline(always)]
    fn from_lanes(mut value: impl FnMut(usize) -> f64) -> Self {
        let mut lanes = [0.0; COUNT];
        for lane in 0..COUNT {
            lanes[lane] = value(lane) as f32;
        }
        Self::from_array(lanes)
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        f64::from(self.to_array()[lane])
    }
    #[inline(always)]
    fn load(values: &[f32]) -> Self {
        let mut lanes = [0.0; COUNT];
        lanes.copy_from_slice(&values[..COUNT]);
        Self::from_array(lanes)
    }
    #[inline(always)]
    fn store(self, values: &mut [f32]) {
        values[..COUNT].copy_from_slice(&self.to_array());
    }
    #[inline(always)]
    fn gather(values: &[f32], indices: &[u32]) -> Self {
        let mut lanes = [0; COUNT];
        lanes.copy_from_slice(&indices[..COUNT]);
        Self(R::gather(values, lanes))
    }
    #[inline(always)]
    fn store_indices(self, indices: &mut [u32]) {
        indices[..COUNT].copy_from_slice(&self.0.to_indices());
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.floor())
    }
    #[inline(always)]
    fn detach(self) -> Self {
        self
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<R> {
        LaneMask(self.0.lt(other.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<R> {
        LaneMask(self.0.le(other.0))
    }
    #[inline(always)]
    fn select(mask: LaneMask<R>, on_true: Self, on_false: Self) -> Self {
        Self(R::select(mask.0, on_true.0, on_false.0))
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::one() / self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs())
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
    functions_by_lane!(exp, ln, sin, cos, tan, asin, acos, atan, tanh);
}
