//! Points stored coordinate by coordinate, and how loops read and write them in blocks of eight.

use std::ops::Range;

use graspd_ad::{Element, Real};
use graspd_geom::Vec3;

/// Lanes that buffers of contact points and spheres are padded to, so that a kernel never sees half a block.
pub const POINT_PADDING: usize = 8;

/// One coordinate of a block of points.
pub(crate) type Row<E> = [E; POINT_PADDING];

/// Points (or vectors) stored coordinate by coordinate, for SIMD.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointBuffer<E> {
    /// First coordinates, `[n]`.
    pub x: Vec<E>,
    /// Second coordinates, `[n]`.
    pub y: Vec<E>,
    /// Third coordinates, `[n]`.
    pub z: Vec<E>,
}

impl<E: Element> PointBuffer<E> {
    /// Makes `len` points at the origin.
    pub fn zeros(len: usize) -> Self {
        let zeros = vec![E::default(); len];
        Self {
            x: zeros.clone(),
            y: zeros.clone(),
            z: zeros,
        }
    }
    /// Counts the points, padding included.
    pub fn len(&self) -> usize {
        self.x.len()
    }
    /// Tells whether there are none.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
    /// Returns point `index` in `f64`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn get(&self, index: usize) -> Vec3<f64> {
        Vec3::new(
            self.x[index].lane(0),
            self.y[index].lane(0),
            self.z[index].lane(0),
        )
    }
    /// Overwrites point `index`.
    ///
    /// # Panics
    /// If `index` is out of range.
    pub fn set(&mut self, index: usize, point: Vec3<f64>) {
        self.x[index] = E::constant(point.x);
        self.y[index] = E::constant(point.y);
        self.z[index] = E::constant(point.z);
    }
    /// Overwrites point `index`, and in `remainder` what rounding leaves of it.
    pub(crate) fn set_split(
        &mut self,
        remainder: &mut PointBuffer<f32>,
        index: usize,
        point: Vec3<f64>,
    ) {
        self.set(index, point);
        remainder.set(index, point - self.get(index));
    }

    /// Views the points of a range, which must begin and end at whole blocks.
    #[inline(always)]
    pub(crate) fn blocks(&self, range: Range<usize>) -> Blocks<'_, E> {
        Blocks {
            x: self.x[range.clone()].as_chunks().0,
            y: self.y[range.clone()].as_chunks().0,
            z: self.z[range].as_chunks().0,
        }
    }
    /// Views the coordinates along x, y and z as rows to be written.
    #[inline(always)]
    pub(crate) fn rows_mut(&mut self) -> [&mut [Row<E>]; 3] {
        [&mut self.x, &mut self.y, &mut self.z].map(|x| x.as_chunks_mut().0)
    }
}

/// Points in blocks of known length, so that access needs few checks.
pub(crate) struct Blocks<'a, E> {
    pub(crate) x: &'a [Row<E>],
    pub(crate) y: &'a [Row<E>],
    pub(crate) z: &'a [Row<E>],
}

impl<E: Element> Blocks<'_, E> {
    /// Loads the points of a block from lane `lane` on.
    #[inline(always)]
    pub(crate) fn load<L: Real<Element = E>>(&self, block: usize, lane: usize) -> Vec3<L> {
        Vec3::new(
            L::load(&self.x[block][lane..]),
            L::load(&self.y[block][lane..]),
            L::load(&self.z[block][lane..]),
        )
    }
}

/// Writes coordinates in double precision as the sum of `rounded` and `remainder` (which is 0 if `E` is `f64`): at the
/// contacts' stiffness the rounding of a position is most of the rounding of a force.
#[inline(always)]
pub(crate) fn store_split<E: Element>(
    row: &Row<f64>,
    rounded: &mut Row<E>,
    remainder: &mut Row<f32>,
) {
    for lane in 0..POINT_PADDING {
        rounded[lane] = E::constant(row[lane]);
    }
    for lane in 0..POINT_PADDING {
        remainder[lane] = (row[lane] - rounded[lane].lane(0)) as f32;
    }
}

/// Sums each coordinate over the lanes.
#[inline(always)]
pub(crate) fn lane_sums<L: Real>(v: Vec3<L>) -> Vec3<f64> {
    Vec3::new(lane_sum(v.x), lane_sum(v.y), lane_sum(v.z))
}

/// Sums the lanes in `f64`.
#[inline(always)]
pub(crate) fn lane_sum<L: Real>(value: L) -> f64 {
    // By way of memory: taking lanes out of registers one by one costs more.
    let mut lanes = [L::Element::default(); POINT_PADDING];
    value.store(&mut lanes);
    let mut sum = 0.0;
    for lane in &lanes[..L::LANES] {
        sum += lane.lane(0);
    }
    sum
}

// Blocks must be whole for the widest lanes.
const _: () = assert!(POINT_PADDING.is_multiple_of(<f32 as Element>::MAX_LANES));
