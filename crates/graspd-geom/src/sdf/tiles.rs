//! How a grid's samples lie in memory: what is near in space is near in memory.
//!
//! A lookup needs the eight corners of a cell. Row by row they would lie in four cache lines on three pages, and a
//! hand's worth of lookups would wait for memory most of the time. So the samples lie in tiles of 4 x 2 x 2, each
//! one cache line, and these in blocks of 4 x 4 x 4 tiles, each one page: on average 2.8 lines on 1.3 pages. A
//! sample's place is the sum of three parts, each a function of its number along one axis.

/// Samples in a cache line of 64 bytes.
const LINE: usize = 16;
/// Samples in a block.
const BLOCK: usize = 1024;
/// Samples along the sides of a block.
pub(super) const BLOCK_SIDES: [usize; 3] = [16, 8, 8];

/// Where samples lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TileMap {
    /// Samples in a row of blocks along x, and in a layer of such rows.
    row: u32,
    layer: u32,
}

impl TileMap {
    /// Samples in the blocks that hold layers 8 b to 8 b + 7 along z: those of different b lie apart.
    pub(super) fn layer(&self) -> usize {
        self.layer as usize
    }

    /// The place of sample (i, j, k).
    #[inline(always)]
    pub(super) fn place(&self, [i, j, k]: [usize; 3]) -> usize {
        (self.x(i as u32) + self.y(j as u32) + self.z(k as u32)) as usize
    }

    /// The part of a place that depends on the number along x.
    #[inline(always)]
    pub(super) fn x(&self, i: u32) -> u32 {
        ((i >> 4) << 10) + ((i >> 2 & 3) << 4) + (i & 3)
    }

    /// The part of a place that depends on the number along y.
    #[inline(always)]
    pub(super) fn y(&self, j: u32) -> u32 {
        (j >> 3) * self.row + ((j >> 1 & 3) << 6) + ((j & 1) << 2)
    }

    /// The part of a place that depends on the number along z.
    #[inline(always)]
    pub(super) fn z(&self, k: u32) -> u32 {
        (k >> 3) * self.layer + ((k >> 1 & 3) << 8) + ((k & 1) << 3)
    }
}

/// The samples of a grid, in tiles and blocks. Places beyond the grid's last samples hold 0.
#[derive(Debug)]
pub(super) struct Tiles {
    dims: [usize; 3],
    map: TileMap,
    /// The samples from `start` on, which is the start of a cache line.
    buffer: Vec<f32>,
    start: usize,
}

impl Tiles {
    /// All samples 0; `None` if there is no memory. Each side has at most 1024 samples.
    pub(super) fn zeros(dims: [usize; 3]) -> Option<Self> {
        let [bx, by, bz] = [0, 1, 2].map(|axis| dims[axis].div_ceil(BLOCK_SIDES[axis]));
        let count = bx * by * bz * BLOCK;
        let mut buffer = Vec::new();
        buffer.try_reserve_exact(count + LINE).ok()?;
        let start = to_line(&buffer);
        buffer.resize(start + count, 0.0);
        Some(Self {
            dims,
            map: TileMap {
                row: (bx * BLOCK) as u32,
                layer: (bx * by * BLOCK) as u32,
            },
            buffer,
            start,
        })
    }

    pub(super) fn dims(&self) -> [usize; 3] {
        self.dims
    }

    pub(super) fn map(&self) -> TileMap {
        self.map
    }

    /// The samples, by place.
    #[inline(always)]
    pub(super) fn places(&self) -> &[f32] {
        &self.buffer[self.start..]
    }

    /// The samples, by place.
    pub(super) fn places_mut(&mut self) -> &mut [f32] {
        &mut self.buffer[self.start..]
    }
}

/// How many samples after the start of a buffer a cache line starts. A wrong answer would only cost time.
fn to_line(buffer: &[f32]) -> usize {
    buffer
        .as_ptr()
        .align_offset(LINE * size_of::<f32>())
        .min(LINE)
}

/// A copy, too, starts at a cache line.
impl Clone for Tiles {
    fn clone(&self) -> Self {
        let mut buffer = Vec::with_capacity(self.places().len() + LINE);
        let start = to_line(&buffer);
        buffer.resize(start, 0.0);
        buffer.extend_from_slice(self.places());
        Self {
            dims: self.dims,
            map: self.map,
            buffer,
            start,
        }
    }
}

impl PartialEq for Tiles {
    fn eq(&self, other: &Self) -> bool {
        self.dims == other.dims && self.places() == other.places()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_has_its_own_place_and_copies_are_equal() {
        let dims = [18, 9, 17];
        let mut tiles = Tiles::zeros(dims).unwrap();
        let map = tiles.map();
        let mut count = 0.0;
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                for i in 0..dims[0] {
                    count += 1.0;
                    let place = map.place([i, j, k]);
                    assert_eq!(
                        std::mem::replace(&mut tiles.places_mut()[place], count),
                        0.0
                    );
                    // Layers along z that are filled in parallel lie apart.
                    assert_eq!(place / map.layer(), k / BLOCK_SIDES[2]);
                }
            }
        }
        let copy = tiles.clone();
        assert!(copy == tiles);
        tiles.places_mut()[map.place([17, 8, 16])] = 0.0;
        assert!(copy != tiles);
    }

    #[test]
    fn a_tile_is_a_cache_line() {
        let tiles = Tiles::zeros([4, 2, 2]).unwrap();
        for index in [[0, 0, 0], [3, 0, 0], [0, 1, 0], [0, 0, 1], [3, 1, 1]] {
            let address = tiles.places()[tiles.map().place(index)..].as_ptr().addr();
            assert_eq!(address / 64, tiles.places().as_ptr().addr() / 64);
        }
        assert_eq!(tiles.places().as_ptr().addr() % 64, 0);
    }
}
