//! What a vector register does to eight `f32` at once.

use std::fmt::Debug;

/// How many numbers stand side by side.
pub(super) const COUNT: usize = 8;

/// Eight `f32` in vector registers, and what the processor does to them at once.
pub trait Register: Copy + Debug {
    /// One truth value for each lane: all bits set, or none.
    type Mask: Copy + Debug;

    /// The lanes from memory.
    fn from_array(values: [f32; COUNT]) -> Self;
    /// The lanes to memory.
    fn to_array(self) -> [f32; COUNT];
    /// The values at these places; panics if there is no such value.
    #[inline(always)]
    fn gather(values: &[f32], indices: [u32; COUNT]) -> Self {
        let mut lanes = [0.0; COUNT];
        for lane in 0..COUNT {
            lanes[lane] = values[indices[lane] as usize];
        }
        Self::from_array(lanes)
    }
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// Quotient.
    fn div(self, other: Self) -> Self;
    /// The opposite sign.
    fn neg(self) -> Self;
    /// The sign cleared.
    fn abs(self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Largest integer that is not above.
    fn floor(self) -> Self;
    /// Rounded towards zero; negative and NaN give 0, what is beyond 2^31 gives 2^31.
    fn to_indices(self) -> [u32; COUNT];
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `on_true` where the mask is set, else `on_false`.
    fn select(mask: Self::Mask, on_true: Self, on_false: Self) -> Self;
    /// The mask with lane `i` set where bit `i` is.
    fn mask_from_bits(bits: u8) -> Self::Mask;
    /// Bit `i` is set where lane `i` is.
    fn mask_bits(mask: Self::Mask) -> u8;
    /// Set where both are.
    fn mask_and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Set where one is.
    fn mask_or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Set where `mask` is not.
    fn mask_not(mask: Self::Mask) -> Self::Mask;
}
