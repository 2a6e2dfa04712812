//! The forward loop over the skin for single-precision buffers, to double precision where that counts.
//!
//! Blendshapes move vertices by millimetres, so single precision gives them to 1e-10 m. The rest moves them by
//! decimetres, and is done in double precision: it costs little.

use graspd_ad::{Kernel, Real};

use super::model::SKINNED_JOINTS;
use super::skin::{BLOCKS_PER_TILE, Skin};
use super::skin_kernels::{Features, Motion, blend};
use crate::double_single::{DoubleSingleRows, Row};
use crate::{POINT_PADDING, PointBuffer};

/// u = rest + blendshapes . features, then x = sum_j w_j (R_j u + t_j), as the sum of two numbers.
pub(crate) struct SplitPose<'a> {
    /// For the blendshapes.
    pub(crate) skin: &'a Skin<f32>,
    /// For the rest: the same skin.
    pub(crate) exact: &'a Skin<f64>,
    pub(crate) features: &'a Features<f32>,
    pub(crate) motions: &'a [Motion<f64>; SKINNED_JOINTS],
    /// u, for the pullback.
    pub(crate) blended: &'a mut PointBuffer<f32>,
    pub(crate) posed: &'a mut PointBuffer<f32>,
    pub(crate) remainder: &'a mut PointBuffer<f32>,
}

impl Kernel for SplitPose<'_> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        let (skin, exact) = (self.skin, self.exact);
        let rest = [&exact.rest.x, &exact.rest.y, &exact.rest.z].map(|x| x.as_chunks().0);
        let blended = self.blended;
        let blended = [&mut blended.x, &mut blended.y, &mut blended.z];
        let [bx, by, bz] = blended.map(|x| x.as_chunks_mut().0);
        let mut posed = DoubleSingleRows::of(self.posed, self.remainder);
        for tile in 0..skin.influence_ranges.len() / BLOCKS_PER_TILE {
            let mut offsets = [[0.0_f32; POINT_PADDING]; 3 * BLOCKS_PER_TILE];
            if let Some(range) = skin.tile_ranges.get(tile) {
                let mut lane = 0;
                while lane < POINT_PADDING {
                    let mut moved = [L::zero(); 3 * BLOCKS_PER_TILE];
                    blend(skin, range, self.features, lane, &mut moved);
                    for row in 0..3 * BLOCKS_PER_TILE {
                        moved[row].store(&mut offsets[row][lane..]);
                    }
                    lane += L::LANES;
                }
            }
            for in_tile in 0..BLOCKS_PER_TILE {
                let block = tile * BLOCKS_PER_TILE + in_tile;
                let x = blended_row(&rest[0][block], &offsets[3 * in_tile], &mut bx[block]);
                let y = blended_row(&rest[1][block], &offsets[3 * in_tile + 1], &mut by[block]);
                let z = blended_row(&rest[2][block], &offsets[3 * in_tile + 2], &mut bz[block]);
                let mut sums: [Row; 3] = [[0.0; POINT_PADDING]; 3];
                for influence in &exact.influences[exact.influence_ranges[block].clone()] {
                    let Motion {
                        rotation: r,
                        translation: t,
                    } = &self.motions[influence.joint];
                    let weights = &influence.weights;
                    for row in 0..3 {
                        let [rx, ry, rz, t] = [r[3 * row], r[3 * row + 1], r[3 * row + 2], t[row]];
                        let sum = &mut sums[row];
                        for lane in 0..POINT_PADDING {
                            let moved = rx * x[lane] + ry * y[lane] + rz * z[lane] + t;
                            sum[lane] += weights[lane] * moved;
                        }
                    }
                }
                for axis in 0..3 {
                    posed[axis].set(block, &sums[axis]);
                }
            }
        }
    }
}

/// One coordinate of blended vertices, also written in single precision.
#[inline(always)]
fn blended_row(
    rest: &Row,
    offset: &[f32; POINT_PADDING],
    rounded: &mut [f32; POINT_PADDING],
) -> Row {
    let mut blended = [0.0; POINT_PADDING];
    for lane in 0..POINT_PADDING {
        blended[lane] = rest[lane] + f64::from(offset[lane]);
        rounded[lane] = blended[lane] as f32;
    }
    blended
}
