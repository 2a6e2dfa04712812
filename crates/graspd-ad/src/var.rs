//! Reverse mode: a value that a [`Tape`](crate::Tape) remembers the making of.

use std::ops::{
    Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign,
};

use num_traits::{FromPrimitive, One, Zero};

use crate::Real;
use crate::rule::{self, functions_by_rule};
use crate::tape::Place;

/// A value whose computation is recorded, so that a sweep back gives its derivatives with respect to all inputs.
///
/// Variables come from [`Recording::variable`](crate::Recording::variable); constants carry no tape, and
/// operations among them record nothing. Base `T`: see [`Tape`](crate::Tape).
///
/// Two are equal (`==`) when they have the same value *and* are the same recorded value, or both constants: code
/// that skips work for zeros and ones then never skips a derivative. The comparisons of [`Real`] look at values.
#[derive(Clone, Copy, Debug)]
pub struct Var<'t, T = f64> {
    pub(crate) value: T,
    place: Option<Place<'t, T>>,
}

impl<'t, T: Real<Mask = bool> + 'static> Var<'t, T> {
    /// A value that depends on no variable.
    pub fn constant(value: T) -> Self {
        Self { value, place: None }
    }

    /// The value.
    pub fn value(self) -> T {
        self.value
    }

    pub(crate) fn recorded(value: T, place: Place<'t, T>) -> Self {
        Self {
            value,
            place: Some(place),
        }
    }

    pub(crate) fn place(self) -> Option<Place<'t, T>> {
        self.place
    }

    /// Records `f(self)`, given `f` and `f'` there.
    fn chain(self, value: T, slope: T) -> Self {
        Self {
            value,
            place: self.place.map(|place| place.record(slope)),
        }
    }

    /// Records `f(self, other)`, given `f` and its partial derivatives there.
    fn chain2(self, other: Self, value: T, slope_self: T, slope_other: T) -> Self {
        let place = match (self.place, other.place) {
            (Some(one), Some(two)) => Some(one.record2(two, slope_self, slope_other)),
            (Some(one), None) => Some(one.record(slope_self)),
            (None, Some(two)) => Some(two.record(slope_other)),
            (None, None) => None,
        };
        Self { value, place }
    }
}

impl<T: PartialEq> PartialEq for Var<'_, T> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value && self.place == other.place
    }
}

macro_rules! operator {
    ($trait:ident, $method:ident, $assign_trait:ident, $assign_method:ident,
     |$x:ident, $y:ident| $rule:expr) => {
        impl<T: Real<Mask = bool> + 'static> $trait for Var<'_, T> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                let ($x, $y) = (self.value, other.value);
                let (value, slope_self, slope_other) = $rule;
                self.chain2(other, value, slope_self, slope_other)
            }
        }
        impl<T: Real<Mask = bool> + 'static> $assign_trait for Var<'_, T> {
            fn $assign_method(&mut self, other: Self) {
                *self = $trait::$method(*self, other);
            }
        }
    };
}
operator!(Add, add, AddAssign, add_assign, |x, y| (
    x + y,
    T::one(),
    T::one()
));
operator!(Sub, sub, SubAssign, sub_assign, |x, y| (
    x - y,
    T::one(),
    -T::one()
));
operator!(Mul, mul, MulAssign, mul_assign, |x, y| (x * y, y, x));
operator!(Div, div, DivAssign, div_assign, |x, y| rule::div(x, y));
operator!(Rem, rem, RemAssign, rem_assign, |x, y| rule::rem(x, y));

impl<T: Real<Mask = bool> + 'static> Neg for Var<'_, T> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -T::one())
    }
}

impl<T: Real<Mask = bool> + 'static> Zero for Var<'_, T> {
    fn zero() -> Self {
        Self::constant(T::zero())
    }
    /// Whether this is the constant zero.
    fn is_zero(&self) -> bool {
        self.value.is_zero() && self.place.is_none()
    }
}

impl<T: Real<Mask = bool> + 'static> One for Var<'_, T> {
    fn one() -> Self {
        Self::constant(T::one())
    }
}

impl<T: Real<Mask = bool> + 'static> FromPrimitive for Var<'_, T> {
    fn from_i64(n: i64) -> Option<Self> {
        T::from_i64(n).map(Self::constant)
    }
    fn from_u64(n: u64) -> Option<Self> {
        T::from_u64(n).map(Self::constant)
    }
    fn from_f64(n: f64) -> Option<Self> {
        T::from_f64(n).map(Self::constant)
    }
}

impl<T: Real<Mask = bool> + 'static> Real for Var<'_, T> {
    type Mask = bool;
    type Element = T::Element;
    const LANES: usize = T::LANES;

    fn constant(value: f64) -> Self {
        Self::constant(T::constant(value))
    }
    fn from_lanes(value: impl FnMut(usize) -> f64) -> Self {
        Self::constant(T::from_lanes(value))
    }
    fn lane(self, lane: usize) -> f64 {
        self.value.lane(lane)
    }
    fn load(values: &[Self::Element]) -> Self {
        Self::constant(T::load(values))
    }
    fn store(self, values: &mut [Self::Element]) {
        self.value.store(values);
    }
    fn gather(values: &[f32], indices: &[u32]) -> Self {
        Self::constant(T::gather(values, indices))
    }
    fn detach(self) -> Self {
        Self::constant(self.value.detach())
    }

    fn lt(self, other: Self) -> bool {
        self.value.lt(other.value)
    }
    fn le(self, other: Self) -> bool {
        self.value.le(other.value)
    }
    fn select(mask: bool, on_true: Self, on_false: Self) -> Self {
        if mask { on_true } else { on_false }
    }

    fn scale(self, factor: f64) -> Self {
        self.chain(self.value.scale(factor), T::constant(factor))
    }
    fn mul_detached(self, factor: Self) -> Self {
        let factor = factor.value.detach();
        self.chain(self.value.mul_detached(factor), factor)
    }
    fn floor(self) -> Self {
        Self::constant(self.value.floor())
    }
    functions_by_rule!();
}
