//! The truth values of eight lanes.

use std::ops::{BitAnd, BitOr, Not};

use super::register::Register;
use crate::Mask;

/// The result of comparing [`Lanes`](crate::Lanes): a truth value for each lane.
#[derive(Clone, Copy, Debug)]
pub struct LaneMask<R: Register>(pub(super) R::Mask);

impl<R: Register> Mask for LaneMask<R> {
    #[inline(always)]
    fn splat(value: bool) -> Self {
        Self(R::mask_from_bits(if value { !0 } else { 0 }))
    }
    #[inline(always)]
    fn any(self) -> bool {
        R::mask_bits(self.0) != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        R::mask_bits(self.0) == !0
    }
    #[inline(always)]
    fn lane(self, lane: usize) -> bool {
        R::mask_bits(self.0) & (1 << lane) != 0
    }
}

impl<R: Register> BitAnd for LaneMask<R> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(R::mask_and(self.0, other.0))
    }
}

impl<R: Register> BitOr for LaneMask<R> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(R::mask_or(self.0, other.0))
    }
}

impl<R: Register> Not for LaneMask<R> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(R::mask_not(self.0))
    }
}
