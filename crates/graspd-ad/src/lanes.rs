//! Eight `f32` side by side: the scalar of the hot loops, and the run-time choice of instruction set.
//!
//! [`LanesOver`] is written once over [`Register`], eight floats in vector registers. [`Lanes`] takes the
//! registers that every processor of the target has; wider ones, where the machine at hand has them, are reached
//! through [`vectorize`] alone. (Plain arrays would not do: in expressions as long as a contact law the compiler
//! leaves their arithmetic scalar.) No path uses fused multiply-add, and functions without a vector instruction
//! run lane by lane, so all paths give the same bits.
//!
//! This is the only file of the workspace with `unsafe` code. It is of three kinds: transmutation between a vector
//! register and an array of the same size, both plain numbers; loads from places in a slice that have been checked
//! together; and AVX2 instructions, which must not run on a processor without them. The type that issues these is
//! private, and only `vectorize` hands it out, to a generic kernel that cannot name it, once it has seen that the
//! processor has AVX2.

// Registers are public in name only, so that public types may be generic over them.
#![allow(unreachable_pub)]

#[cfg(any(test, not(target_arch = "x86_64")))]
mod array;
mod instructions;
mod mask;
mod register;
mod scalar;
#[cfg(test)]
mod tests;

pub use instructions::{INSTRUCTIONS_VARIABLE, Instructions, UnknownInstructions};
pub use mask::LaneMask;
pub(crate) use register::Register;
pub use scalar::LanesOver;

use crate::{Element, Kernel, Real};

/// The registers that every processor of the target has.
#[cfg(target_arch = "x86_64")]
type Baseline = x86::Sse2;
/// The registers that every processor of the target has.
#[cfg(not(target_arch = "x86_64"))]
type Baseline = array::Array;

/// Eight `f32` side by side, on any processor.
///
/// ```
/// use graspd_ad::{Lanes, Mask, Real};
///
/// let x = Lanes::from_lanes(|lane| lane as f64 - 4.0);
/// let negative = x.lt(Lanes::constant(0.0));
/// let clipped = Lanes::select(negative, Lanes::constant(0.0), x);
/// assert_eq!(clipped.to_array(), [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
/// assert!(negative.lane(3) && !negative.lane(4));
/// ```
pub type Lanes = LanesOver<Baseline>;

impl Element for f32 {
    const MAX_LANES: usize = Lanes::LANES;
    fn vectorize<K: Kernel<f32>>(kernel: K) -> K::Output {
        vectorize(kernel)
    }
}

/// Runs a kernel with the widest instructions of the machine, see [`Instructions::in_use`]; the result is the same bit
/// for bit with all of them.
///
/// ```
/// use graspd_ad::{Kernel, Real, vectorize};
///
/// struct SumOfSquares<'a>(&'a [f32]);
/// impl Kernel for SumOfSquares<'_> {
///     type Output = f64;
///     #[inline(always)]
///     fn run<L: Real<Element = f32>>(self) -> f64 {
///         let chunks = self.0.chunks_exact(L::LANES);
///         let sum = chunks.fold(L::zero(), |sum, values| sum + L::load(values).square());
///         (0..L::LANES).map(|lane| sum.lane(lane)).sum()
///     }
/// }
/// assert_eq!(vectorize(SumOfSquares(&[2.0; 16])), 64.0);
/// ```
pub fn vectorize<K: Kernel>(kernel: K) -> K::Output {
    vectorize_with(Instructions::in_use(), kernel)
}

/// [`vectorize`] with these instructions, or the widest below them that the processor has.
pub fn vectorize_with<K: Kernel>(instructions: Instructions, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn with_avx2<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<LanesOver<x86::Avx2>>()
        }
        // The same instructions with twice as many registers: long formulas spill less.
        #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
        fn with_avx512<K: Kernel>(kernel: K) -> K::Output {
            kernel.run::<LanesOver<x86::Avx2>>()
        }
        if instructions == Instructions::Avx512 && has_avx512() {
            // SAFETY: the processor has these instructions, as was just seen.
            return unsafe { with_avx512(kernel) };
        }
        if instructions >= Instructions::Avx2 && std::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2, as was just seen.
            return unsafe { with_avx2(kernel) };
        }
    }
    kernel.run::<Lanes>()
}

/// Whether the processor has the parts of AVX-512 that are used.
#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    std::is_x86_feature_detected!("avx2")
        && std::is_x86_feature_detected!("avx512f")
        && std::is_x86_feature_detected!("avx512bw")
        && std::is_x86_feature_detected!("avx512dq")
        && std::is_x86_feature_detected!("avx512vl")
}

/// All bits of a lane are set where the bit of its number is.
#[inline(always)]
fn lane_bits(bits: u8) -> [u32; 8] {
    let mut lanes = [0; 8];
    for lane in 0..8 {
        lanes[lane] = if bits & (1 << lane) != 0 { !0 } else { 0 };
    }
    lanes
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;
    use std::mem::transmute;

    use super::{Register, lane_bits};

    /// Implements [`Register`] for one or several vectors side by side, numbered by `$part`.
    macro_rules! register {
        (
            $register:ident($($part:tt: $vector:ty),+), $width:literal lanes each,
            $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $sqrt:ident, $max:ident, $floor:ident,
            $to_integers:ident, $lt:path, $le:path,
            $select:ident, $movemask:ident, $and:ident, $andnot:ident, $or:ident, $xor:ident
            $(, $gather:ident)?
        ) => {
            // SAFETY of the instructions: see the head of this file. SAFETY of the transmutations: both sides
            // are plain numbers, and the compiler checks that their sizes agree.
            impl Register for $register {
                type Mask = Self;

                #[inline(always)]
                fn from_array(values: [f32; 8]) -> Self {
                    unsafe { transmute::<[f32; 8], Self>(values) }
                }
                #[inline(always)]
                fn to_array(self) -> [f32; 8] {
                    unsafe { transmute::<Self, [f32; 8]>(self) }
                }
                $(
                    #[inline(always)]
                    fn gather(values: &[f32], indices: [u32; 8]) -> Self {
                        Self::from_array(unsafe { $gather(values, indices) })
                    }
                )?
                #[inline(always)]
                fn add(self, other: Self) -> Self {
                    unsafe { Self($($add(self.$part, other.$part)),+) }
                }
                #[inline(always)]
                fn sub(self, other: Self) -> Self {
                    unsafe { Self($($sub(self.$part, other.$part)),+) }
                }
                #[inline(always)]
                fn mul(self, other: Self) -> Self {
                    unsafe { Self($($mul(self.$part, other.$part)),+) }
                }
                #[inline(always)]
                fn div(self, other: Self) -> Self {
                    unsafe { Self($($div(self.$part, other.$part)),+) }
                }
                #[inline(always)]
                fn neg(self) -> Self {
                    unsafe { Self($($xor(self.$part, $splat(-0.0))),+) }
                }
                #[inline(always)]
                fn abs(self) -> Self {
                    unsafe { Self($($andnot($splat(-0.0), self.$part)),+) }
                }
                #[inline(always)]
                fn sqrt(self) -> Self {
                    unsafe { Self($($sqrt(self.$part)),+) }
                }
                #[inline(always)]
                fn floor(self) -> Self {
                    unsafe { Self($($floor(self.$part)),+) }
                }
                #[inline(always)]
                fn to_indices(self) -> [u32; 8] {
                    // In this order the maximum of NaN and 0 is 0.
                    unsafe { transmute([$($to_integers($max(self.$part, $splat(0.0)))),+]) }
                }
                #[inline(always)]
                fn lt(self, other: Self) -> Self {
                    unsafe { Self($($lt(self.$part, other.$part)),+) }
                }
                #[inline(always)]
                fn le(self, other: Self) -> Self {
                    unsafe { Self($($le(self.$part, other.$part)),+) }
                }
                #[inline(always)]
                fn select(mask: Self, on_true: Self, on_false: Self) -> Self {
                    unsafe { Self($($select(on_false.$part, on_true.$part, mask.$part)),+) }
                }
                #[inline(always)]
                fn mask_from_bits(bits: u8) -> Self {
                    Self::from_array(lane_bits(bits).map(f32::from_bits))
                }
                #[inline(always)]
                fn mask_bits(mask: Self) -> u8 {
                    (unsafe { $(($movemask(mask.$part) << ($width * $part)))|+ }) as u8
                }
                #[inline(always)]
                fn mask_and(a: Self, b: Self) -> Self {
                    unsafe { Self($($and(a.$part, b.$part)),+) }
                }
                #[inline(always)]
                fn mask_or(a: Self, b: Self) -> Self {
                    unsafe { Self($($or(a.$part, b.$part)),+) }
                }
                #[inline(always)]
                fn mask_not(mask: Self) -> Self {
                    let all = Self::mask_from_bits(!0);
                    unsafe { Self($($xor(mask.$part, all.$part)),+) }
                }
            }
        };
    }

    /// Two vectors of SSE2, which is part of x86-64.
    #[derive(Clone, Copy, Debug)]
    #[repr(C)]
    pub struct Sse2(__m128, __m128);
    register!(
        Sse2(0: __m128, 1: __m128), 4 lanes each,
        _mm_set1_ps, _mm_add_ps, _mm_sub_ps, _mm_mul_ps, _mm_div_ps, _mm_sqrt_ps, _mm_max_ps, floor_sse2,
        _mm_cvttps_epi32, _mm_cmplt_ps, _mm_cmple_ps,
        select_sse2, _mm_movemask_ps, _mm_and_ps, _mm_andnot_ps, _mm_or_ps, _mm_xor_ps
    );

    /// `on_true` where the mask is set, else `on_false`; the blend instruction came after SSE2.
    #[inline(always)]
    unsafe fn select_sse2(on_false: __m128, on_true: __m128, mask: __m128) -> __m128 {
        unsafe { _mm_or_ps(_mm_and_ps(mask, on_true), _mm_andnot_ps(mask, on_false)) }
    }

    /// Largest integer that is not above, by truncation; from 2^23 on every number is an integer.
    #[inline(always)]
    unsafe fn floor_sse2(x: __m128) -> __m128 {
        unsafe {
            let sign = _mm_and_ps(x, _mm_set1_ps(-0.0));
            let magnitude = _mm_xor_ps(x, sign);
            let truncated = _mm_cvtepi32_ps(_mm_cvttps_epi32(x));
            let excess = _mm_and_ps(_mm_cmplt_ps(x, truncated), _mm_set1_ps(1.0));
            let floor = _mm_or_ps(_mm_sub_ps(truncated, excess), sign);
            select_sse2(x, floor, _mm_cmplt_ps(magnitude, _mm_set1_ps(8_388_608.0)))
        }
    }

    /// A vector of AVX2.
    #[derive(Clone, Copy, Debug)]
    #[repr(C)]
    pub struct Avx2(__m256);
    register!(
        Avx2(0: __m256), 8 lanes each,
        _mm256_set1_ps, _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_sqrt_ps, _mm256_max_ps,
        _mm256_floor_ps, _mm256_cvttps_epi32,
        _mm256_cmp_ps::<_CMP_LT_OQ>, _mm256_cmp_ps::<_CMP_LE_OQ>,
        _mm256_blendv_ps, _mm256_movemask_ps, _mm256_and_ps, _mm256_andnot_ps, _mm256_or_ps, _mm256_xor_ps,
        gather_avx2
    );

    /// One range check for all places, then plain loads: those of the gather instruction are no faster on AMD's
    /// processors, and much slower on those of Intel's that need a remedy for data sampling.
    #[inline(always)]
    unsafe fn gather_avx2(values: &[f32], indices: [u32; 8]) -> [f32; 8] {
        let mut lanes = [0.0; 8];
        if values.is_empty() {
            // Panics.
            return indices.map(|index| values[index as usize]);
        }
        unsafe {
            let places = transmute::<[u32; 8], __m256i>(indices);
            let last = (values.len() - 1).min(u32::MAX as usize) as u32;
            let last = _mm256_set1_epi32(last as i32);
            let exist = _mm256_cmpeq_epi32(_mm256_min_epu32(places, last), places);
            assert!(
                _mm256_movemask_epi8(exist) == -1,
                "no value number {indices:?} among {}",
                values.len()
            );
            for lane in 0..8 {
                // SAFETY: no place is above the last, as was just seen.
                lanes[lane] = *values.get_unchecked(indices[lane] as usize);
            }
        }
        lanes
    }
}
