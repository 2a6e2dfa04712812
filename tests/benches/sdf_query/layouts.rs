//! Ways to lay a grid's samples out in memory, and to fetch the eight corners of a cell from them.

use graspd_ad::Real;
use graspd_geom::{SdfGrid, Vec3};

use super::{LANES, RESOLUTION};

const N: u32 = RESOLUTION as u32;

/// The cell of each lane, by its lowest node along x, y and z.
pub(crate) type Cell = [[u32; LANES]; 3];

/// Where the grid lies.
pub(crate) struct Geometry {
    origin: Vec3<f64>,
    per_length: Vec3<f64>,
}

impl Geometry {
    pub(crate) fn new(grid: &SdfGrid) -> Self {
        let spacing = grid.spacing();
        Self {
            origin: grid.origin(),
            per_length: Vec3::new(1.0 / spacing.x, 1.0 / spacing.y, 1.0 / spacing.z),
        }
    }

    /// The cell around a point, and the coordinates in it; beyond the grid, of its last cell.
    #[inline(always)]
    pub(crate) fn cell<L: Real>(&self, p: [L; 3]) -> (Cell, [L; 3]) {
        let mut cell = [[0; LANES]; 3];
        let mut at = [L::zero(); 3];
        for axis in 0..3 {
            let steps = p[axis] - L::constant(self.origin.get(axis));
            let steps = steps * L::constant(self.per_length.get(axis));
            let steps = steps.clamp(L::zero(), L::constant(f64::from(N - 1)));
            let low = steps.floor().min(L::constant(f64::from(N - 2)));
            low.store_indices(&mut cell[axis]);
            at[axis] = steps - low;
        }
        (cell, at)
    }

    /// Distance and gradient from a cell's corners, x fastest.
    #[inline(always)]
    pub(crate) fn interpolate<L: Real>(&self, c: [L; 8], [x, y, z]: [L; 3]) -> (L, [L; 3]) {
        let dx = [c[1] - c[0], c[3] - c[2], c[5] - c[4], c[7] - c[6]];
        let v = [
            c[0] + dx[0] * x,
            c[2] + dx[1] * x,
            c[4] + dx[2] * x,
            c[6] + dx[3] * x,
        ];
        let slope_x = [dx[0] + (dx[1] - dx[0]) * y, dx[2] + (dx[3] - dx[2]) * y];
        let slope_y = [v[1] - v[0], v[3] - v[2]];
        let value = [v[0] + slope_y[0] * y, v[2] + slope_y[1] * y];
        let slope_z = value[1] - value[0];
        let gradient = [
            (slope_x[0] + (slope_x[1] - slope_x[0]) * z) * L::constant(self.per_length.x),
            (slope_y[0] + (slope_y[1] - slope_y[0]) * z) * L::constant(self.per_length.y),
            slope_z * L::constant(self.per_length.z),
        ];
        (value[0] + slope_z * z, gradient)
    }
}

/// Fetches the corners of cells, x fastest; `block` numbers the eight contacts that ask.
pub(crate) trait Corners {
    fn corners<L: Real<Element = f32>>(&mut self, cell: &Cell, block: usize) -> [L; 8];
}

/// A sample's place as the sum of three parts.
pub(crate) trait Map {
    fn x(i: u32) -> u32;
    fn y(j: u32) -> u32;
    fn z(k: u32) -> u32;
}

/// Row by row.
pub(crate) struct Plain;
impl Map for Plain {
    #[inline(always)]
    fn x(i: u32) -> u32 {
        i
    }
    #[inline(always)]
    fn y(j: u32) -> u32 {
        j * N
    }
    #[inline(always)]
    fn z(k: u32) -> u32 {
        k * N * N
    }
}

/// Bricks of 2^LOG samples along each side.
pub(crate) struct Bricks<const LOG: u32>;
impl<const LOG: u32> Map for Bricks<LOG> {
    #[inline(always)]
    fn x(i: u32) -> u32 {
        ((i >> LOG) << (3 * LOG)) + (i & ((1 << LOG) - 1))
    }
    #[inline(always)]
    fn y(j: u32) -> u32 {
        ((j >> LOG) << (2 * LOG)) * N + ((j & ((1 << LOG) - 1)) << LOG)
    }
    #[inline(always)]
    fn z(k: u32) -> u32 {
        ((k >> LOG) << LOG) * N * N + ((k & ((1 << LOG) - 1)) << (2 * LOG))
    }
}

/// Tiles of 4 x 2 x 2 samples, a cache line, in blocks of 4 x 4 x 4 tiles, a page: what the library does.
pub(crate) struct Tiles;
impl Map for Tiles {
    #[inline(always)]
    fn x(i: u32) -> u32 {
        ((i >> 4) << 10) + ((i >> 2 & 3) << 4) + (i & 3)
    }
    #[inline(always)]
    fn y(j: u32) -> u32 {
        (j >> 3) * (N << 6) + ((j >> 1 & 3) << 6) + ((j & 1) << 2)
    }
    #[inline(always)]
    fn z(k: u32) -> u32 {
        (k >> 3) * (N * N * 8) + ((k >> 1 & 3) << 8) + ((k & 1) << 3)
    }
}

/// Samples in some order, at the start of a cache line.
struct Samples {
    buffer: Vec<f32>,
    start: usize,
}

impl Samples {
    fn new(len: usize) -> Self {
        let buffer = vec![0.0_f32; len + 16];
        let start = buffer.as_ptr().align_offset(64).min(16);
        Self { buffer, start }
    }
    #[inline(always)]
    fn all(&self) -> &[f32] {
        &self.buffer[self.start..]
    }
}

/// One copy of each sample.
pub(crate) struct Gathered<M> {
    samples: Samples,
    map: std::marker::PhantomData<M>,
}

impl<M: Map> Gathered<M> {
    /// From values x fastest.
    pub(crate) fn new(values: &[f32]) -> Self {
        let mut samples = Samples::new(values.len());
        let start = samples.start;
        for (at, value) in values.iter().enumerate() {
            let at = at as u32;
            let place = M::x(at % N) + M::y(at / N % N) + M::z(at / (N * N));
            samples.buffer[start + place as usize] = *value;
        }
        Self {
            samples,
            map: std::marker::PhantomData,
        }
    }

    #[inline(always)]
    fn place(cell: &Cell, corner: u32, lane: usize) -> usize {
        let [i, j, k] = cell;
        let place = M::x(i[lane] + (corner & 1))
            + M::y(j[lane] + (corner >> 1 & 1))
            + M::z(k[lane] + (corner >> 2));
        place as usize
    }
}

impl<M: Map> Corners for Gathered<M> {
    #[inline(always)]
    fn corners<L: Real<Element = f32>>(&mut self, cell: &Cell, _block: usize) -> [L; 8] {
        // Each part once for all corners that share it.
        let mut parts = [[[0; LANES]; 2]; 3];
        for side in 0..2 {
            for lane in 0..LANES {
                parts[0][side][lane] = M::x(cell[0][lane] + side as u32);
                parts[1][side][lane] = M::y(cell[1][lane] + side as u32);
                parts[2][side][lane] = M::z(cell[2][lane] + side as u32);
            }
        }
        let mut corners = [L::zero(); 8];
        for corner in 0..8 {
            let x = &parts[0][corner & 1];
            let y = &parts[1][corner >> 1 & 1];
            let z = &parts[2][corner >> 2];
            let mut places = [0; LANES];
            for lane in 0..LANES {
                places[lane] = x[lane] + y[lane] + z[lane];
            }
            corners[corner] = L::gather(self.samples.all(), &places);
        }
        corners
    }
}

/// Each node with its upper neighbours along z (2 values), or along y, z and both (4), side by side; row by row.
pub(crate) struct Interleaved<const COPIES: usize>(Samples);

impl<const COPIES: usize> Interleaved<COPIES> {
    pub(crate) fn new(values: &[f32]) -> Self {
        let mut samples = Samples::new(COPIES * values.len());
        let start = samples.start;
        let offsets = if COPIES == 2 {
            [0, RESOLUTION * RESOLUTION, 0, 0]
        } else {
            let (y, z) = (RESOLUTION, RESOLUTION * RESOLUTION);
            [0, y, z, y + z]
        };
        for at in 0..values.len() {
            for copy in 0..COPIES {
                let neighbour = values.get(at + offsets[copy]);
                samples.buffer[start + COPIES * at + copy] = neighbour.copied().unwrap_or(0.0);
            }
        }
        Self(samples)
    }
}

impl<const COPIES: usize> Corners for Interleaved<COPIES> {
    #[inline(always)]
    fn corners<L: Real<Element = f32>>(&mut self, [i, j, k]: &Cell, _block: usize) -> [L; 8] {
        let mut low = [0; LANES];
        for lane in 0..LANES {
            low[lane] = COPIES as u32 * (i[lane] + N * (j[lane] + N * k[lane]));
        }
        let mut corners = [L::zero(); 8];
        for corner in 0..8 {
            let (dx, dy, dz) = (
                corner as u32 & 1,
                corner as u32 >> 1 & 1,
                corner as u32 >> 2,
            );
            // Which of the copies, and which row.
            let (copy, row) = if COPIES == 2 {
                (dz, dy)
            } else {
                (dy + 2 * dz, 0)
            };
            let offset = COPIES as u32 * (dx + N * row) + copy;
            let mut places = [0; LANES];
            for lane in 0..LANES {
                places[lane] = low[lane] + offset;
            }
            corners[corner] = L::gather(self.0.all(), &places);
        }
        corners
    }
}

/// Remembers each contact's cell and its corners.
pub(crate) struct CellCache<M> {
    grid: Gathered<M>,
    /// The cell of each lane, and its corners, `[corner][lane]`; by block of contacts.
    blocks: Vec<([u32; LANES], [[f32; LANES]; 8])>,
}

impl<M: Map> CellCache<M> {
    pub(crate) fn new(values: &[f32], contacts: usize) -> Self {
        Self {
            grid: Gathered::new(values),
            blocks: vec![([u32::MAX; LANES], [[0.0; LANES]; 8]); contacts.div_ceil(LANES)],
        }
    }
}

impl<M: Map> Corners for CellCache<M> {
    #[inline(always)]
    fn corners<L: Real<Element = f32>>(&mut self, cell: &Cell, block: usize) -> [L; 8] {
        let (known, corners) = &mut self.blocks[block];
        let samples = self.grid.samples.all();
        for lane in 0..LANES {
            let number = cell[0][lane] + N * (cell[1][lane] + N * cell[2][lane]);
            if number != known[lane] {
                known[lane] = number;
                for corner in 0..8 {
                    let place = Gathered::<M>::place(cell, corner as u32, lane);
                    corners[corner][lane] = samples[place];
                }
            }
        }
        let mut loaded = [L::zero(); 8];
        for corner in 0..8 {
            loaded[corner] = L::load(&corners[corner]);
        }
        loaded
    }
}
