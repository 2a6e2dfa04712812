//! The working frame: points shifted and scaled into the unit cube, and the predicates on them.

use super::exact::{self, GRID};
use super::hyperplane::{Hyperplane, difference, dot, hyperplane, hyperplane_of_minors};
use super::polytope::{Facet, Polytope};
use crate::error::EvaluationError;

/// Points closer than this to an affine subspace lie in it: thousands of roundings, and so thin that a hull
/// of them would be made of noise.
const FLAT: f64 = 1e-10;
/// Points less than this above a hyperplane are not above it. The hyperplane of a simplex a thousand times
/// longer than it is thick is still known to better than this.
const COPLANAR: f64 = 1e-12;
/// Bound on the relative error of a sum of D products of rounded normals and exact differences.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// The input in coordinates of magnitude at most 1: `working = (input - middle) / scale`.
pub(super) struct Frame<const D: usize> {
    pub(super) points: Vec<[f64; D]>,
    middle: [f64; D],
    /// A power of two, so that scaling is exact.
    pub(super) scale: f64,
    /// A point well inside the hull.
    interior: [f64; D],
    tolerance: f64,
    is_exact: bool,
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

/// The geometric decisions that the construction of a hull rests on.
pub(super) trait Predicates<const D: usize> {
    /// The oriented hyperplane through D points, `None` if they are dependent.
    fn hyperplane(&self, vertices: &[u32; D]) -> Option<Hyperplane<D>>;
    /// How far the point is above the facet; positive where it counts as above.
    fn height(&self, facet: &Facet<D>, point: u32) -> f64;
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
        let scale = half_extent.log2().ceil().exp2();
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

    /// Moves the points onto the integer grid and makes all predicates exact from now on.
    pub(super) fn snap_to_grid(&mut self) {
        for point in &mut self.points {
            *point = point.map(exact::snap);
        }
        self.is_exact = true;
    }

    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The point inside relative to which volumes are summed.
    pub(super) fn interior(&self) -> &[f64; D] {
        &self.interior
    }

    /// The facet's offset in input coordinates.
    pub(super) fn offset_from_origin(&self, facet: &Facet<D>) -> f64 {
        facet.offset * self.scale + dot(&facet.normal, &self.middle)
    }

    /// How far the input's origin is below the facet, in working coordinates.
    pub(super) fn depth_of_origin(&self, facet: &Facet<D>) -> f64 {
        facet.offset + dot(&facet.normal, &self.middle) / self.scale
    }

    /// The volume in working coordinates: pyramids over the facets with a common tip inside.
    pub(super) fn volume(&self, polytope: &Polytope<D>) -> f64 {
        // Neumaier's compensated sum: there may be half a million terms.
        let (mut sum, mut lost) = (0.0f64, 0.0);
        for (_, facet) in polytope.facets() {
            let term = facet.area * (facet.offset - dot(&facet.normal, &self.interior));
            let total = sum + term;
            lost += if sum.abs() >= term.abs() {
                (sum - total) + term
            } else {
                (term - total) + sum
            };
            sum = total;
        }
        (sum + lost) / D as f64
    }

    fn corners(&self, vertices: &[u32; D]) -> [&[f64; D]; D] {
        vertices.map(|vertex| &self.points[vertex as usize])
    }

    #[cold]
    fn exact_height(&self, facet: &Facet<D>, point: u32) -> f64 {
        let corners = self.corners(&facet.vertices);
        let step = difference(&self.points[point as usize], corners[0]);
        let height = dot(&facet.normal, &step);
        let bound = ROUNDING * dot(&facet.normal.map(f64::abs), &step.map(f64::abs));
        if height.abs() > bound {
            return height;
        }
        f64::from(exact::side(&corners, &self.points[point as usize])) * f64::MIN_POSITIVE
    }
}

impl<const D: usize> Predicates<D> for Frame<D> {
    #[inline]
    fn hyperplane(&self, vertices: &[u32; D]) -> Option<Hyperplane<D>> {
        let corners = self.corners(vertices);
        if !self.is_exact {
            return hyperplane(&corners);
        }
        let unit = GRID.powi(D as i32 - 1);
        let minors = exact::normal_minors(&corners).map(|minor| minor.to_f64() / unit);
        Some(hyperplane_of_minors(&minors, corners[0]))
    }

    #[inline(always)]
    fn height(&self, facet: &Facet<D>, point: u32) -> f64 {
        if self.is_exact {
            return self.exact_height(facet, point);
        }
        dot(&facet.normal, &self.points[point as usize]) - facet.offset - self.tolerance
    }
}

/// Up to D + 1 points: the farthest from the middle, then again and again the one farthest from the affine
/// hull of those chosen. Stops early where the rest lie within `flat` of that hull.
fn widest_simplex<const D: usize>(points: &[[f64; D]], flat: f64) -> Vec<u32> {
    let mut residuals = points.to_vec();
    let mut simplex = vec![farthest(&residuals).0];
    let first = residuals[simplex[0] as usize];
    for residual in &mut residuals {
        *residual = difference(residual, &first);
    }
    while simplex.len() <= D {
        let (next, squared) = farthest(&residuals);
        if squared.sqrt() <= flat {
            break;
        }
        simplex.push(next);
        let direction = residuals[next as usize].map(|x| x / squared.sqrt());
        for residual in &mut residuals {
            // Twice, so that what is left is orthogonal to the direction to the last digit.
            for _ in 0..2 {
                let along = dot(residual, &direction);
                for k in 0..D {
                    residual[k] -= along * direction[k];
                }
            }
        }
    }
    simplex
}

/// The longest vector, the first among equals, and its squared length.
fn farthest<const D: usize>(vectors: &[[f64; D]]) -> (u32, f64) {
    let mut best = (0, -1.0);
    for (index, vector) in vectors.iter().enumerate() {
        let squared = dot(vector, vector);
        if squared > best.1 {
            best = (index as u32, squared);
        }
    }
    best
}
