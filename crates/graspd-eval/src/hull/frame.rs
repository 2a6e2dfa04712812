//! The working frame: points shifted and scaled into the unit cube.

use super::exact;
use super::hyperplane::difference;
use super::simplex::widest_simplex;
use crate::error::EvaluationError;

/// Points closer than this to an affine subspace lie in it: thousands of roundings, and so thin that a hull
/// of them would be made of noise.
const FLAT: f64 = 1e-10;
/// Points less than this above a hyperplane are not above it. The hyperplane of a simplex a thousand times
/// longer than it is thick is still known to better than this.
const COPLANAR: f64 = 1e-12;

/// The input in coordinates of magnitude at most 1: `working = (input - middle) / scale`.
pub(super) struct Frame<const D: usize> {
    pub(super) points: Vec<[f64; D]>,
    pub(super) middle: [f64; D],
    /// A power of two, so that scaling is exact.
    pub(super) scale: f64,
    /// A point well inside the hull.
    pub(super) interior: [f64; D],
    /// How far above a hyperplane a point must be to count as above, while predicates are rounded.
    pub(super) tolerance: f64,
    pub(super) is_exact: bool,
}

/// How the work on a set of points begins.
pub(super) enum Start<const D: usize> {
    Empty,
    Flat {
        affine_dimension: usize,
    },
    /// D + 1 points that span a simplex about as large as any.
    Full {
        frame: Frame<D>,
        simplex: Vec<u32>,
    },
}

impl<const D: usize> Frame<D> {
    /// Chooses the frame and the first simplex.
    pub(super) fn start(points: &[[f64; D]]) -> Result<Start<D>, EvaluationError> {
        if let Some(index) = points
            .iter()
            .position(|point| point.iter().any(|x| !x.is_finite()))
        {
            return Err(EvaluationError::NotFinite { index });
        }
        let Some(first) = points.first() else {
            return Ok(Start::Empty);
        };
        let (mut low, mut high) = (*first, *first);
        for point in points {
            for k in 0..D {
                low[k] = low[k].min(point[k]);
                high[k] = high[k].max(point[k]);
            }
        }
        let middle: [f64; D] = std::array::from_fn(|k| 0.5 * low[k] + 0.5 * high[k]);
        let half_extent = (0..D)
            .map(|k| 0.5 * high[k] - 0.5 * low[k])
            .fold(0.0, f64::max);
        let magnitude = points
            .iter()
            .flatten()
            .fold(0.0, |most: f64, x| most.max(x.abs()));
        // Far from the origin the input itself is rounded more coarsely than its extent suggests.
        let coarseness = (magnitude / half_extent).max(1.0);
        if half_extent < f64::MIN_POSITIVE / f64::EPSILON || FLAT * coarseness > 1.0 {
            return Ok(Start::Flat {
                affine_dimension: 0,
            });
        }
        let scale = half_extent.log2().ceil().min(1023.0).exp2();
        let points: Vec<[f64; D]> = points
            .iter()
            .map(|point| difference(point, &middle).map(|x| x / scale))
            .collect();
        let simplex = widest_simplex(&points, FLAT * coarseness);
        if simplex.len() <= D {
            return Ok(Start::Flat {
                affine_dimension: simplex.len() - 1,
            });
        }
        let mut interior = [0.0; D];
        for &vertex in &simplex {
            for k in 0..D {
                interior[k] += points[vertex as usize][k] / (D + 1) as f64;
            }
        }
        let frame = Self {
            points,
            middle,
            scale,
            interior,
            tolerance: COPLANAR * coarseness,
            is_exact: false,
        };
        Ok(Start::Full { frame, simplex })
    }

    /// A point of the input's space in working coordinates.
    pub(super) fn in_frame(&self, point: &[f64; D]) -> [f64; D] {
        difference(point, &self.middle).map(|x| x / self.scale)
    }

    /// Moves the points onto the integer grid and makes all predicates exact from now on.
    pub(super) fn snap_to_grid(&mut self) {
        for point in &mut self.points {
            *point = point.map(exact::snap);
        }
        self.is_exact = true;
    }

    /// Where the vertices are.
    pub(super) fn corners(&self, vertices: &[u32; D]) -> [&[f64; D]; D] {
        vertices.map(|vertex| &self.points[vertex as usize])
    }
}
