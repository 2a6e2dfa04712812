//! Forward mode: a value and its derivatives with respect to `N` variables.

use std::ops::{
    Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign,
};

use num_traits::{FromPrimitive, One, Zero};

use crate::Real;
use crate::rule::{self, functions_by_rule};

/// The array of an expression for each index. A plain loop: the closures of `std::array::from_fn` are not always
/// inlined, and then miss the instruction set that [`vectorize`](crate::vectorize) chose.
macro_rules! each {
    ($index:ident => $expression:expr) => {{
        let mut array = [T::zero(); N];
        for $index in 0..N {
            array[$index] = $expression;
        }
        array
    }};
}

/// A value with its derivatives with respect to `N` variables, `x + x_1 e_1 + ... + x_N e_N` with `e_i e_j = 0`.
///
/// Every function follows its expansion to first order, `f(x + x_i e_i) = f(x) + f'(x) x_i e_i`.
/// A dual over a dual carries second derivatives, a dual over [`Lanes`](crate::Lanes) eight points at a time.
///
/// Equality (`==`) compares value and derivatives; the comparisons of [`Real`] look at values only.
///
/// ```
/// use graspd_ad::{Dual, Real};
///
/// let x = Dual::<f64, 2>::variable(3.0, 0);
/// let y = Dual::variable(4.0, 1);
/// assert_eq!(x * x * y, Dual::new(36.0, [24.0, 9.0]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Dual<T, const N: usize> {
    /// The value.
    pub value: T,
    /// The derivative with respect to each variable.
    pub derivative: [T; N],
}

impl<T: Real, const N: usize> Dual<T, N> {
    /// A value with given derivatives.
    #[inline(always)]
    pub fn new(value: T, derivative: [T; N]) -> Self {
        Self { value, derivative }
    }

    /// A value that depends on no variable.
    #[inline(always)]
    pub fn constant(value: T) -> Self {
        Self::new(value, [T::zero(); N])
    }

    /// The variable number `index`: derivative one with respect to itself.
    ///
    /// # Panics
    /// If `index >= N`.
    #[inline(always)]
    pub fn variable(value: T, index: usize) -> Self {
        let mut dual = Self::constant(value);
        dual.derivative[index] = T::one();
        dual
    }

    /// The variables at a point, in order.
    #[inline(always)]
    pub fn variables(point: [T; N]) -> [Self; N] {
        let mut duals = [Self::zero(); N];
        for index in 0..N {
            duals[index] = Self::variable(point[index], index);
        }
        duals
    }

    /// Chain rule for one argument: `f(self)`, given `f` and `f'` there.
    #[inline(always)]
    fn chain(self, value: T, slope: T) -> Self {
        Self::new(value, each!(i => self.derivative[i] * slope))
    }

    /// Chain rule for two arguments: `f(self, other)`, given `f` and its partial derivatives there.
    #[inline(always)]
    fn chain2(self, other: Self, value: T, slope_self: T, slope_other: T) -> Self {
        Self::new(
            value,
            each!(i => self.derivative[i] * slope_self + other.derivative[i] * slope_other),
        )
    }
}

impl<T: Real, const N: usize> Add for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(
            self.value + other.value,
            each!(i => self.derivative[i] + other.derivative[i]),
        )
    }
}

impl<T: Real, const N: usize> Sub for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(
            self.value - other.value,
            each!(i => self.derivative[i] - other.derivative[i]),
        )
    }
}

impl<T: Real, const N: usize> Mul for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.chain2(other, self.value * other.value, other.value, self.value)
    }
}

impl<T: Real, const N: usize> Div for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (value, slope_self, slope_other) = rule::div(self.value, other.value);
        self.chain2(other, value, slope_self, slope_other)
    }
}

impl<T: Real, const N: usize> Rem for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn rem(self, other: Self) -> Self {
        let (value, slope_self, slope_other) = rule::rem(self.value, other.value);
        self.chain2(other, value, slope_self, slope_other)
    }
}

impl<T: Real, const N: usize> Neg for Dual<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.value, each!(i => -self.derivative[i]))
    }
}

macro_rules! assign_operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl<T: Real, const N: usize> $trait for Dual<T, N> {
            #[inline(always)]
            fn $method(&mut self, other: Self) {
                *self = *self $operator other;
            }
        }
    };
}
assign_operator!(AddAssign, add_assign, +);
assign_operator!(SubAssign, sub_assign, -);
assign_operator!(MulAssign, mul_assign, *);
assign_operator!(DivAssign, div_assign, /);
assign_operator!(RemAssign, rem_assign, %);

impl<T: Real, const N: usize> Zero for Dual<T, N> {
    #[inline(always)]
    fn zero() -> Self {
        Self::constant(T::zero())
    }
    /// Whether value and derivatives are zero.
    #[inline(always)]
    fn is_zero(&self) -> bool {
        self.value.is_zero() && self.derivative.iter().all(T::is_zero)
    }
}

impl<T: Real, const N: usize> One for Dual<T, N> {
    #[inline(always)]
    fn one() -> Self {
        Self::constant(T::one())
    }
}

impl<T: Real, const N: usize> FromPrimitive for Dual<T, N> {
    #[inline(always)]
    fn from_i64(n: i64) -> Option<Self> {
        T::from_i64(n).map(Self::constant)
    }
    #[inline(always)]
    fn from_u64(n: u64) -> Option<Self> {
        T::from_u64(n).map(Self::constant)
    }
    #[inline(always)]
    fn from_f64(n: f64) -> Option<Self> {
        T::from_f64(n).map(Self::constant)
    }
}

impl<T: Real, const N: usize> Real for Dual<T, N> {
    type Mask = T::Mask;
    type Element = T::Element;
    const LANES: usize = T::LANES;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::constant(T::constant(value))
    }
    #[inline(always)]
    fn from_lanes(value: impl FnMut(usize) -> f64) -> Self {
        Self::constant(T::from_lanes(value))
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.value.lane(lane)
    }
    #[inline(always)]
    fn load(values: &[Self::Element]) -> Self {
        Self::constant(T::load(values))
    }
    #[inline(always)]
    fn store(self, values: &mut [Self::Element]) {
        self.value.store(values);
    }
    #[inline(always)]
    fn gather(values: &[f32], indices: &[u32]) -> Self {
        Self::constant(T::gather(values, indices))
    }
    #[inline(always)]
    fn store_indices(self, indices: &mut [u32]) {
        self.value.store_indices(indices);
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self::constant(self.value.floor())
    }
    #[inline(always)]
    fn detach(self) -> Self {
        Self::constant(self.value.detach())
    }

    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        self.value.lt(other.value)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        self.value.le(other.value)
    }
    #[inline(always)]
    fn select(mask: Self::Mask, on_true: Self, on_false: Self) -> Self {
        Self::new(
            T::select(mask, on_true.value, on_false.value),
            each!(i => T::select(mask, on_true.derivative[i], on_false.derivative[i])),
        )
    }

    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        Self::new(
            self.value.scale(factor),
            each!(i => self.derivative[i].scale(factor)),
        )
    }
    #[inline(always)]
    fn mul_detached(self, factor: Self) -> Self {
        let factor = factor.value.detach();
        Self::new(
            self.value.mul_detached(factor),
            each!(i => self.derivative[i].mul_detached(factor)),
        )
    }
    functions_by_rule!();
}
