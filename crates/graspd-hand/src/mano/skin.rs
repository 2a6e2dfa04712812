//! The skin laid out for the kernels: vertices sorted by the joints that move them, in blocks of lanes.

use std::ops::Range;

use graspd_ad::Element;
use graspd_geom::Vec3;

use super::model::{POSE_FEATURES, SKINNED_JOINTS, SkinnedModel};
use crate::{POINT_PADDING, PointBuffer};

/// Blocks that blendshapes are stored for at once: their rows share the loads of features and accumulators.
pub(crate) const BLOCKS_PER_TILE: usize = 2;
/// Vertices that blendshapes are stored for at once.
pub(crate) const TILE_VERTICES: usize = BLOCKS_PER_TILE * POINT_PADDING;
/// Numbers in a row of a tile: x, y and z of each block.
const TILE_ROW: usize = 3 * TILE_VERTICES;
/// Features that one joint has, and so rows of a tile.
pub(crate) const JOINT_FEATURES: usize = 9;

/// The blendshapes of 16 vertices by the 9 features of one joint: rows of `[block][x, y, z][8]`.
pub(crate) type Tile<E> = [[[E; POINT_PADDING]; 3 * BLOCKS_PER_TILE]; JOINT_FEATURES];

/// How much a block of vertices follows one joint.
#[derive(Clone, Debug)]
pub(crate) struct Influence<E> {
    pub(crate) joint: usize,
    pub(crate) weights: [E; POINT_PADDING],
}

/// Which model vertex stands in each slot: sorted by the joints that move them, padded to whole tiles.
#[derive(Clone, Debug)]
pub(crate) struct SlotOrder {
    /// Vertex of each slot, `[n]`; padding repeats the last.
    pub(crate) vertex: Vec<u32>,
    /// How many slots are not padding.
    pub(crate) count: usize,
}

impl SlotOrder {
    /// Sorts `vertices`, so that neighbours in the order share joints and few joints move each block.
    pub(crate) fn new(model: &SkinnedModel, mut vertices: Vec<u32>) -> Self {
        let key = |&vertex: &u32| {
            let weights = &model.weights[vertex as usize];
            let by_weight = |a: &usize, b: &usize| weights[*b].total_cmp(&weights[*a]);
            let mut joints: Vec<usize> =
                (0..SKINNED_JOINTS).filter(|&j| weights[j] != 0.0).collect();
            joints.sort_by(by_weight);
            (joints, vertex)
        };
        vertices.sort_by_cached_key(key);
        let count = vertices.len();
        if let Some(&last) = vertices.last() {
            vertices.resize(count.next_multiple_of(TILE_VERTICES), last);
        }
        Self {
            vertex: vertices,
            count,
        }
    }
}

/// What moves each vertex: joints, and the vertex's weights.
#[derive(Clone, Debug, Default)]
pub(crate) struct VertexInfluences {
    /// Where the joints of each vertex end, `[v]`.
    ends: Vec<u32>,
    pub(crate) joints: Vec<(u32, f64)>,
}

impl VertexInfluences {
    pub(crate) fn new(weights: &[[f64; SKINNED_JOINTS]]) -> Self {
        let mut influences = Self::default();
        for weights in weights {
            let joints = weights
                .iter()
                .enumerate()
                .filter(|(_, weight)| **weight != 0.0);
            (influences.joints).extend(joints.map(|(joint, &weight)| (joint as u32, weight)));
            influences.ends.push(influences.joints.len() as u32);
        }
        influences
    }

    pub(crate) fn range(&self, vertex: usize) -> Range<usize> {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        start as usize..self.ends[vertex] as usize
    }
}

/// The skin in the precision of one kind of buffer.
#[derive(Clone, Debug)]
pub(crate) struct Skin<E> {
    /// Vertices of the shaped hand in its straight pose \[m\], `[n]`.
    pub(crate) rest: PointBuffer<E>,
    /// What moves each block, `[n / 8]` ranges of `influences`.
    pub(crate) influence_ranges: Vec<Range<usize>>,
    pub(crate) influences: Vec<Influence<E>>,
    /// The joints whose rotation bends each tile, `[n / 16]` ranges of `tiles`; empty without blendshapes. Joints
    /// whose blendshapes are all 0 there are left out.
    pub(crate) tile_ranges: Vec<Range<usize>>,
    pub(crate) tile_joints: Vec<usize>,
    pub(crate) tiles: Vec<Tile<E>>,
}

impl<E: Element> Skin<E> {
    /// `rest`: the shaped vertices in the model's order.
    pub(crate) fn new(model: &SkinnedModel, rest: &[Vec3<f64>], order: &SlotOrder) -> Self {
        let len = order.vertex.len();
        let mut skin = Self {
            rest: PointBuffer::zeros(len),
            influence_ranges: Vec::new(),
            influences: Vec::new(),
            tile_ranges: Vec::new(),
            tile_joints: Vec::new(),
            tiles: Vec::new(),
        };
        for (slot, &vertex) in order.vertex.iter().enumerate() {
            skin.rest.set(slot, rest[vertex as usize]);
        }
        for block in order.vertex.as_chunks::<POINT_PADDING>().0 {
            skin.add_influences(model, block);
        }
        if let Some(directions) = &model.pose_directions {
            for vertices in order.vertex.as_chunks::<TILE_VERTICES>().0 {
                skin.add_tiles(directions, vertices);
            }
        }
        skin
    }

    fn add_influences(&mut self, model: &SkinnedModel, vertices: &[u32; POINT_PADDING]) {
        let start = self.influences.len();
        for joint in 0..SKINNED_JOINTS {
            let weights = vertices.map(|vertex| model.weights[vertex as usize][joint]);
            if weights.iter().any(|&weight| weight != 0.0) {
                self.influences.push(Influence {
                    joint,
                    weights: weights.map(E::constant),
                });
            }
        }
        self.influence_ranges.push(start..self.influences.len());
    }

    fn add_tiles(&mut self, directions: &[f64], vertices: &[u32; TILE_VERTICES]) {
        let start = self.tiles.len();
        for joint in 1..SKINNED_JOINTS {
            let mut tile = [[[E::zero(); POINT_PADDING]; 3 * BLOCKS_PER_TILE]; JOINT_FEATURES];
            let mut is_empty = true;
            for (index, &vertex) in vertices.iter().enumerate() {
                let (block, lane) = (index / POINT_PADDING, index % POINT_PADDING);
                for axis in 0..3 {
                    for (k, row) in tile.iter_mut().enumerate() {
                        let feature = JOINT_FEATURES * (joint - 1) + k;
                        let at = (3 * vertex as usize + axis) * POSE_FEATURES + feature;
                        is_empty &= directions[at] == 0.0;
                        row[3 * block + axis][lane] = E::constant(directions[at]);
                    }
                }
            }
            if !is_empty {
                self.tiles.push(tile);
                self.tile_joints.push(joint);
            }
        }
        self.tile_ranges.push(start..self.tiles.len());
    }
}

// The rows of a tile are what the kernels take them for.
const _: () = assert!(TILE_ROW == 3 * BLOCKS_PER_TILE * POINT_PADDING);
