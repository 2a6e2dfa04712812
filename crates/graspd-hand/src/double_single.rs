//! Positions in double precision, stored as sums of two numbers of single precision.

use graspd_geom::Vec3;

use crate::{POINT_PADDING, PointBuffer};

/// A coordinate of a block of points, in double precision.
pub(crate) type Row = [f64; POINT_PADDING];

/// The rows of one coordinate: rounded, and what that leaves.
pub(crate) struct DoubleSingleRows<'a> {
    high: &'a mut [[f32; POINT_PADDING]],
    low: &'a mut [[f32; POINT_PADDING]],
}

impl<'a> DoubleSingleRows<'a> {
    /// The coordinates along x, y and z of points and what rounding leaves of them.
    #[inline(always)]
    pub(crate) fn of(
        points: &'a mut PointBuffer<f32>,
        remainder: &'a mut PointBuffer<f32>,
    ) -> [Self; 3] {
        [
            (&mut points.x, &mut remainder.x),
            (&mut points.y, &mut remainder.y),
            (&mut points.z, &mut remainder.z),
        ]
        .map(|(high, low)| Self {
            high: high.as_chunks_mut().0,
            low: low.as_chunks_mut().0,
        })
    }

    /// Writes a row.
    #[inline(always)]
    pub(crate) fn set(&mut self, block: usize, row: &Row) {
        let (high, low) = (&mut self.high[block], &mut self.low[block]);
        for lane in 0..POINT_PADDING {
            high[lane] = row[lane] as f32;
        }
        for lane in 0..POINT_PADDING {
            low[lane] = (row[lane] - f64::from(high[lane])) as f32;
        }
    }
}

/// Overwrites point `index`, and what rounding leaves of it.
pub(crate) fn set_double_single(
    points: &mut PointBuffer<f32>,
    remainder: &mut PointBuffer<f32>,
    index: usize,
    point: Vec3<f64>,
) {
    points.set(index, point);
    remainder.set(index, point - points.get(index));
}
