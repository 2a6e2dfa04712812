//! The loops over the skin: blendshapes and linear blend skinning, forward and transposed.
//!
//! Eight vertices at a time in vector registers for `f32`, one at a time for `f64`; both run the same code.

use std::ops::Range;

use graspd_ad::{Element, Kernel, Real};
use graspd_geom::{Mat3, Vec3};

use super::model::SKINNED_JOINTS;
use super::skin::{BLOCKS_PER_TILE, JOINT_FEATURES, Skin};
use crate::{POINT_PADDING, PointBuffer};

/// x -> R x + t for each joint, from the straight pose to the object frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motion<E> {
    pub(crate) rotation: [E; 9],
    pub(crate) translation: [E; 3],
}

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

pub(crate) type Features<E> = [[E; JOINT_FEATURES]; SKINNED_JOINTS];

/// u = rest + blendshapes . features, then x = sum_j w_j (R_j u + t_j). (Single precision has a loop of its own:
/// [`SplitPose`](super::split_pose::SplitPose).)
pub(crate) struct Pose<'a, E> {
    pub(crate) skin: &'a Skin<E>,
    pub(crate) features: &'a Features<E>,
    pub(crate) motions: &'a [Motion<E>; SKINNED_JOINTS],
    /// u, for the pullback.
    pub(crate) blended: &'a mut PointBuffer<E>,
    pub(crate) posed: &'a mut PointBuffer<E>,
}

impl<E: Element> Pose<'_, E> {
    #[inline(always)]
    pub(crate) fn over<L: Real<Element = E>>(self) {
        let skin = self.skin;
        let rest = Blocks::of(&skin.rest);
        let mut blended = BlocksMut::of(self.blended);
        let mut posed = BlocksMut::of(self.posed);
        for tile in 0..skin.influence_ranges.len() / BLOCKS_PER_TILE {
            let first = tile * BLOCKS_PER_TILE;
            let mut lane = 0;
            while lane < POINT_PADDING {
                let mut u = [L::zero(); 3 * BLOCKS_PER_TILE];
                for block in 0..BLOCKS_PER_TILE {
                    u[3 * block] = L::load(&rest.x[first + block][lane..]);
                    u[3 * block + 1] = L::load(&rest.y[first + block][lane..]);
                    u[3 * block + 2] = L::load(&rest.z[first + block][lane..]);
                }
                if let Some(range) = skin.tile_ranges.get(tile) {
                    blend(skin, range, self.features, lane, &mut u);
                }
                for block in 0..BLOCKS_PER_TILE {
                    let u = Vec3::new(u[3 * block], u[3 * block + 1], u[3 * block + 2]);
                    blended.store(first + block, lane, u);
                    let range = &skin.influence_ranges[first + block];
                    let motion = mean_motion::<L>(skin, range, self.motions, lane);
                    posed.store(first + block, lane, motion.0.apply(u) + motion.1);
                }
                lane += L::LANES;
            }
        }
    }
}

/// Adds the blendshapes of one tile to its vertices.
#[inline(always)]
pub(crate) fn blend<L: Real>(
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

/// sum_j w_j R_j and sum_j w_j t_j of a block.
#[inline(always)]
fn mean_motion<L: Real>(
    skin: &Skin<L::Element>,
    range: &Range<usize>,
    motions: &[Motion<L::Element>; SKINNED_JOINTS],
    lane: usize,
) -> (Mat3<L>, Vec3<L>) {
    let mut r = [L::zero(); 9];
    let mut t = [L::zero(); 3];
    for influence in &skin.influences[range.clone()] {
        let weight = L::load(&influence.weights[lane..]);
        let motion = &motions[influence.joint];
        for k in 0..9 {
            r[k] += weight * splat::<L>(motion.rotation[k]);
        }
        for k in 0..3 {
            t[k] += weight * splat::<L>(motion.translation[k]);
        }
    }
    let rotation = Mat3 {
        rows: [
            Vec3::new(r[0], r[1], r[2]),
            Vec3::new(r[3], r[4], r[5]),
            Vec3::new(r[6], r[7], r[8]),
        ],
    };
    (rotation, Vec3::new(t[0], t[1], t[2]))
}

/// The same number in all lanes.
#[inline(always)]
fn splat<L: Real>(value: L::Element) -> L {
    L::constant(value.lane(0))
}

/// The transpose of [`Pose`]: what the gradients at the posed vertices ask of each joint.
///
/// Sums are taken lane by lane in `E` and over the lanes in `f64`.
pub(crate) struct Pullback<'a, E> {
    pub(crate) skin: &'a Skin<E>,
    pub(crate) motions: &'a [Motion<E>; SKINNED_JOINTS],
    pub(crate) blended: &'a PointBuffer<E>,
    pub(crate) gradient: &'a PointBuffer<E>,
    pub(crate) loads: &'a mut [JointLoad; SKINNED_JOINTS],
}

impl<E: Element> Pullback<'_, E> {
    #[inline(always)]
    pub(crate) fn over<L: Real<Element = E>>(self) {
        let skin = self.skin;
        let blended = Blocks::of(self.blended);
        let gradient = Blocks::of(self.gradient);
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
                    let pulled = pull_block(skin, range, self.motions, lane, g, u, &mut sums);
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

impl Kernel for Pullback<'_, f32> {
    type Output = ();
    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        self.over::<L>();
    }
}

/// Adds w g and w g u^T to the sums of each joint; gives dL/du = sum_j w_j R_j^T g.
#[inline(always)]
fn pull_block<L: Real>(
    skin: &Skin<L::Element>,
    range: &Range<usize>,
    motions: &[Motion<L::Element>; SKINNED_JOINTS],
    lane: usize,
    g: Vec3<L>,
    u: Vec3<L>,
    sums: &mut [[L; 12]; SKINNED_JOINTS],
) -> Vec3<L> {
    let mut pulled = Vec3::zero();
    for influence in &skin.influences[range.clone()] {
        let weighted = g * L::load(&influence.weights[lane..]);
        let r = &motions[influence.joint].rotation;
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

/// Points in blocks of known length, so that access needs few checks.
struct Blocks<'a, E> {
    x: &'a [[E; POINT_PADDING]],
    y: &'a [[E; POINT_PADDING]],
    z: &'a [[E; POINT_PADDING]],
}

impl<'a, E: Element> Blocks<'a, E> {
    #[inline(always)]
    fn of(points: &'a PointBuffer<E>) -> Self {
        Self {
            x: points.x.as_chunks().0,
            y: points.y.as_chunks().0,
            z: points.z.as_chunks().0,
        }
    }
    #[inline(always)]
    fn load<L: Real<Element = E>>(&self, block: usize, lane: usize) -> Vec3<L> {
        Vec3::new(
            L::load(&self.x[block][lane..]),
            L::load(&self.y[block][lane..]),
            L::load(&self.z[block][lane..]),
        )
    }
}

struct BlocksMut<'a, E> {
    x: &'a mut [[E; POINT_PADDING]],
    y: &'a mut [[E; POINT_PADDING]],
    z: &'a mut [[E; POINT_PADDING]],
}

impl<'a, E: Element> BlocksMut<'a, E> {
    #[inline(always)]
    fn of(points: &'a mut PointBuffer<E>) -> Self {
        Self {
            x: points.x.as_chunks_mut().0,
            y: points.y.as_chunks_mut().0,
            z: points.z.as_chunks_mut().0,
        }
    }
    #[inline(always)]
    fn store<L: Real<Element = E>>(&mut self, block: usize, lane: usize, point: Vec3<L>) {
        point.x.store(&mut self.x[block][lane..]);
        point.y.store(&mut self.y[block][lane..]);
        point.z.store(&mut self.z[block][lane..]);
    }
}

/// The sum over the lanes, in `f64`.
#[inline(always)]
fn lane_sum<L: Real>(value: L) -> f64 {
    // By way of memory: taking lanes out of registers one by one costs more.
    let mut lanes = [L::Element::default(); POINT_PADDING];
    value.store(&mut lanes);
    let mut sum = 0.0;
    for lane in &lanes[..L::LANES] {
        sum += lane.lane(0);
    }
    sum
}
