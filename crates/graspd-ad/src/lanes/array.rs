//! Eight `f32` in an array: for processors without a register type here, and the reference for those with one.

use std::array::from_fn;

use super::Register;

/// Eight `f32` in memory.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Array([f32; 8]);

impl Register for Array {
    type Mask = [u32; 8];

    #[inline(always)]
    fn from_array(values: [f32; 8]) -> Self {
        Self(values)
    }
    #[inline(always)]
    fn to_array(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] + other.0[lane]))
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] - other.0[lane]))
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] * other.0[lane]))
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Self(from_fn(|lane| self.0[lane] / other.0[lane]))
    }
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0.map(|x| -x))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        Self(self.0.map(f32::floor))
    }
    #[inline(always)]
    fn to_indices(self) -> [u32; 8] {
        self.0.map(|x| (x as u32).min(1 << 31))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> [u32; 8] {
        from_fn(|lane| if self.0[lane] < other.0[lane] { !0 } else { 0 })
    }
    #[inline(always)]
    fn le(self, other: Self) -> [u32; 8] {
        from_fn(|lane| if self.0[lane] <= other.0[lane] { !0 } else { 0 })
    }
    #[inline(always)]
    fn select(mask: [u32; 8], on_true: Self, on_false: Self) -> Self {
        Self(from_fn(|lane| {
            if mask[lane] != 0 {
                on_true.0[lane]
            } else {
                on_false.0[lane]
            }
        }))
    }
    #[inline(always)]
    fn mask_from_bits(bits: u8) -> [u32; 8] {
        super::lane_bits(bits)
    }
    #[inline(always)]
    fn mask_bits(mask: [u32; 8]) -> u8 {
        (0..8).fold(0, |bits, lane| bits | (u8::from(mask[lane] != 0) << lane))
    }
    #[inline(always)]
    fn mask_and(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        from_fn(|lane| a[lane] & b[lane])
    }
    #[inline(always)]
    fn mask_or(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        from_fn(|lane| a[lane] | b[lane])
    }
    #[inline(always)]
    fn mask_not(mask: [u32; 8]) -> [u32; 8] {
        mask.map(|bits| !bits)
    }
}
