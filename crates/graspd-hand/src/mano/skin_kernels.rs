//! The loops over the skin: blendshapes and linear blend skinning, forward and transposed.
//!
//! Eight vertices at a time in vector registers for `f32`, one at a time for `f64`; both run the same code.
//! Blendshapes move vertices by millimetres, so single precision gives them to 1e-10 m. The rest moves them by
//! decimetres and is done in double precision: it costs little.

use std::ops::Range;

use graspd_ad::{Element, Kernel, Real};
use graspd_geom::{Rigid, Vec3};

use super::model::{POSE_FEATURES, SKINNED_JOINTS};
use super::skin::{BLOCKS_PER_TILE, JOINT_FEATURES, Skin};
use crate::points::{Row, lane_sum, store_split};
use crate::{POINT_PADDING, PointBuffer};

/// What the skin asks of each joint.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct JointLoad {
    /// sum of w g over the vertices.
    pub(crate) force: [f64; 3],
    /// sum of w g u^T, row by row, with u the blended vertices of the straight pose.
    pub(crate) moment: [f64; 9],
    /// Derivative by the pose features of this joint.
    pub(crate) features: [f64; JOINT_FEATURES],
}

/// The pose features of each joint; the wrist's are 0.
type Features<E> = [[E; JOINT_FEATURES]; SKINNED_JOINTS];

/// Computes u = rest + blendshapes . features, then x = sum_j w_j (R_j u + t_j), stored as the sum of two numbers.
pub(crate) struct Skinning<'a, E> {
    /// For the blendshapes.
    pub(crate) skin: &'a Skin<E>,
    /// For the rest: the same skin.
    pub(crate) exact: &'a Skin<f64>,
    pub(crate) features: &'a [f64; POSE_FEATURES],
    /// x -> R x + t for each joint, from the straight pose to the object frame.
    pub(crate) motions: &'a [Rigid<f64>; SKINNED_JOINTS],
    /// u, for the pullback.
    pub(crate) blended: &'a mut PointBuffer<E>,
    pub(crate) posed: &'a mut PointBuffer<E>,
    pub(crate) remainder: &'a mut PointBuffer<f32>,
}

impl<E: Element> Kernel<E> for Skinning<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) {
        let (skin, exact) = (self.skin, self.exact);
        let mut features: Features<E> = [[E::zero(); JOINT_FEATURES]; SKINNED_JOINTS];
        for joint in 1..SKINNED_JOINTS {
            for k in 0..JOINT_FEATURES {
                features[joint][k] = E::constant(self.features[JOINT_FEATURES * (joint - 1) + k]);
            }
        }
        let rest = exact.rest.blocks(0..exact.rest.len());
        let [bx, by, bz] = self.blended.rows_mut();
        let posed = self.posed.rows_mut();
        let remainder = self.remainder.rows_mut();
        for tile in 0..skin.influence_ranges.len() / BLOCKS_PER_TILE {
            let mut offsets = [[E::zero(); POINT_PADDING]; 3 * BLOCKS_PER_TILE];
            if let Some(range) = skin.tile_ranges.get(tile) {
                let mut lane = 0;
                while lane < POINT_PADDING {
                    let mut moved = [L::zero(); 3 * BLOCKS_PER_TILE];
                    blend(skin, range, &features, lane, &mut moved);
                    for row in 0..3 * BLOCKS_PER_TILE {
                        moved[row].store(&mut offsets[row][lane..]);
                    }
                    lane += L::LANES;
                }
            }
            for in_tile in 0..BLOCKS_PER_TILE {
                let block = tile * BLOCKS_PER_TILE + in_tile;
                let x = blended_row(&rest.x[block], &offsets[3 * in_tile], &mut bx[block]);
                let y = blended_row(&rest.y[block], &offsets[3 * in_tile + 1], &mut by[block]);
                let z = blended_row(&rest.z[block], &offsets[3 * in_tile + 2], &mut bz[block]);
                let mut sums: [Row<f64>; 3] = [[0.0; POINT_PADDING]; 3];
                for influence in &exact.influences[exact.influence_ranges[block].clone()] {
                    let motion = &self.motions[influence.joint];
                    let weights = &influence.weights;
                    for row in 0..3 {
                        let (r, t) = (motion.rotation.rows[row], motion.translation.get(row));
                        let sum = &mut sums[row];
                        for lane in 0..POINT_PADDING {
                            let moved = r.x * x[lane] + r.y * y[lane] + r.z * z[lane] + t;
                            sum[lane] += weights[lane] * moved;
                        }
                    }
                }
                for axis in 0..3 {
                    store_split(
                        &sums[axis],
                        &mut posed[axis][block],
                        &mut remainder[axis][block],
                    );
                }
            }
        }
    }
}

/// Computes one coordinate of blended vertices, and writes it in the buffers' precision.
#[inline(always)]
fn blended_row<E: Element>(rest: &Row<f64>, offset: &Row<E>, rounded: &mut Row<E>) -> Row<f64> {
    let mut blended = [0.0; POINT_PADDING];
    for lane in 0..POINT_PADDING {
        blended[lane] = rest[lane] + offset[lane].lane(0);
    }
    for lane in 0..POINT_PADDING {
        rounded[lane] = E::constant(blended[lane]);
    }
    blended
}

/// Adds the blendshapes of one tile to its vertices.
#[inline(always)]
fn blend<L: Real>(
    skin: &Skin<L::Element>,
    range: &Range<usize>,
    features: &Features<L::Element>,
    lane: usize,
    u: &mut [L; 3 * BLOCKS_PER_TILE],
) {
    let tiles = &skin.tiles[range.clone()];
    for (tile, &joint) in tiles.iter().zip(&skin.tile_joints[range.clone()]) {
        let features = &features[joint];
        for k in 0..JOINT_FEATURES {
            let feature = splat::<L>(features[k]);
            for row in 0..3 * BLOCKS_PER_TILE {
                u[row] += feature * L::load(&tile[k][row][lane..]);
            }
        }
    }
}

/// Returns the same number in all lanes.
#[inline(always)]
fn splat<L: Real>(value: L::Element) -> L {
    L::constant(value.lane(0))
}

/// Computes what the gradients at the posed vertices ask of each joint: the transpose of [`Skinning`].
///
/// Sums are taken lane by lane in `E` and over the lanes in `f64`.
pub(crate) struct SkinningPullback<'a, E> {
    pub(crate) skin: &'a Skin<E>,
    pub(crate) motions: &'a [Rigid<f64>; SKINNED_JOINTS],
    pub(crate) blended: &'a PointBuffer<E>,
    pub(crate) gradient: &'a PointBuffer<E>,
    pub(crate) loads: &'a mut [JointLoad; SKINNED_JOINTS],
}

impl<E: Element> Kernel<E> for SkinningPullback<'_, E> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = E>>(self) {
        let skin = self.skin;
        let mut rotations: Rotations<E> = [[E::zero(); 9]; SKINNED_JOINTS];
        for joint in 0..SKINNED_JOINTS {
            let [x, y, z] = self.motions[joint].rotation.rows;
            let entries = [x.x, x.y, x.z, y.x, y.y, y.z, z.x, z.y, z.z];
            for k in 0..9 {
                rotations[joint][k] = E::constant(entries[k]);
            }
        }
        let blended = self.blended.blocks(0..self.blended.len());
        let gradient = self.gradient.blocks(0..self.gradient.len());
        let mut sums = [[L::zero(); 12]; SKINNED_JOINTS];
        let mut feature_sums = [[L::zero(); JOINT_FEATURES]; SKINNED_JOINTS];
        for tile in 0..skin.influence_ranges.len() / BLOCKS_PER_TILE {
            let first = tile * BLOCKS_PER_TILE;
            let mut lane = 0;
            while lane < POINT_PADDING {
                let mut du = [L::zero(); 3 * BLOCKS_PER_TILE];
                for block in 0..BLOCKS_PER_TILE {
                    let g = gradient.load::<L>(first + block, lane);
                    let u = blended.load::<L>(first + block, lane);
                    let range = &skin.influence_ranges[first + block];
                    let pulled = pull_block(skin, range, &rotations, lane, g, u, &mut sums);
                    du[3 * block] = pulled.x;
                    du[3 * block + 1] = pulled.y;
                    du[3 * block + 2] = pulled.z;
                }
                if let Some(range) = skin.tile_ranges.get(tile) {
                    pull_blending(skin, range, lane, &du, &mut feature_sums);
                }
                lane += L::LANES;
            }
        }
        for joint in 0..SKINNED_JOINTS {
            let load = &mut self.loads[joint];
            for k in 0..3 {
                load.force[k] = lane_sum(sums[joint][k]);
            }
            for k in 0..9 {
                load.moment[k] = lane_sum(sums[joint][3 + k]);
            }
            for k in 0..JOINT_FEATURES {
                load.features[k] = lane_sum(feature_sums[joint][k]);
            }
        }
    }
}

/// The rotation of each joint, row by row.
type Rotations<E> = [[E; 9]; SKINNED_JOINTS];

/// Adds w g and w g u^T to the sums of each joint; gives dL/du = sum_j w_j R_j^T g.
#[inline(always)]
fn pull_block<L: Real>(
    skin: &Skin<L::Element>,
    range: &Range<usize>,
    rotations: &Rotations<L::Element>,
    lane: usize,
    g: Vec3<L>,
    u: Vec3<L>,
    sums: &mut [[L; 12]; SKINNED_JOINTS],
) -> Vec3<L> {
    let mut pulled = Vec3::zero();
    for influence in &skin.influences[range.clone()] {
        let weighted = g * L::load(&influence.weights[lane..]);
        let r = &rotations[influence.joint];
        pulled.x += weighted.x * splat::<L>(r[0])
            + weighted.y * splat::<L>(r[3])
            + weighted.z * splat::<L>(r[6]);
        pulled.y += weighted.x * splat::<L>(r[1])
            + weighted.y * splat::<L>(r[4])
            + weighted.z * splat::<L>(r[7]);
        pulled.z += weighted.x * splat::<L>(r[2])
            + weighted.y * splat::<L>(r[5])
            + weighted.z * splat::<L>(r[8]);
        let sums = &mut sums[influence.joint];
        sums[0] += weighted.x;
        sums[1] += weighted.y;
        sums[2] += weighted.z;
        sums[3] += weighted.x * u.x;
        sums[4] += weighted.x * u.y;
        sums[5] += weighted.x * u.z;
        sums[6] += weighted.y * u.x;
        sums[7] += weighted.y * u.y;
        sums[8] += weighted.y * u.z;
        sums[9] += weighted.z * u.x;
        sums[10] += weighted.z * u.y;
        sums[11] += weighted.z * u.z;
    }
    pulled
}

/// Adds blendshapes^T . du of one tile.
#[inline(always)]
fn pull_blending<L: Real>(
    skin: &Skin<L::Element>,
    range: &Range<usize>,
    lane: usize,
    du: &[L; 3 * BLOCKS_PER_TILE],
    sums: &mut [[L; JOINT_FEATURES]; SKINNED_JOINTS],
) {
    let tiles = &skin.tiles[range.clone()];
    for (tile, &joint) in tiles.iter().zip(&skin.tile_joints[range.clone()]) {
        let sums = &mut sums[joint];
        for k in 0..JOINT_FEATURES {
            let mut sum = sums[k];
            for row in 0..3 * BLOCKS_PER_TILE {
                sum += du[row] * L::load(&tile[k][row][lane..]);
            }
            sums[k] = sum;
        }
    }
}
