//! The working frame: points shifted and scaled into the unit cube, and the predicates on them.

use super::exact::{self, GRID};
use super::hyperplane::{Hyperplane, difference, dot, hyperplane, hyperplane_of_minors};
use super::polytope::{Facet, Polytope};
use super::simplex::widest_simplex;
use crate::error::EvaluationError;

/// Points closer than this to an affine subspace lie in it: thousands of roundings, and so thin that a hull
/// of them would be made of noise.
const FLAT: f64 = 1e-10;
/// Points less than this above a hyperplane are not above it. The hyperplane of a simplex a thousand times
/// longer than it is thick is still known to better than this.
const COPLANAR: f64 = 1e-12;
/// A hyperplane that leaves heights more uncertain than this is found anew in integers.
const UNCERTAIN: f64 = 1e-11;
/// Bound on the length of a difference of points: |x| <= 1 in each of six coordinates.
const LONGEST: f64 = 5.0;
/// Bound on the relative change of the edges for which reflections yield the exact result.
const BACKWARD: f64 = 1e-13;
/// Bound on the rounding in `normal . point - offset`, and in normals rounded from integers.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

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

    /// The facet's measure in working coordinates.
    pub(super) fn area(&self, facet: &Facet<D>) -> f64 {
        let factorial: f64 = (1..D).map(|k| k as f64).product();
        self.hyperplane(&facet.vertices)
            .map_or(0.0, |plane| plane.determinant / factorial)
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
            let term = self.area(facet) * (facet.offset - dot(&facet.normal, &self.interior));
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

    /// The hyperplane through the corners, and how far off the heights above it may be.
    fn certain_hyperplane(&self, corners: &[&[f64; D]; D]) -> Hyperplane<D> {
        if let Some(plane) = hyperplane(corners) {
            let uncertainty = LONGEST * tilt(&plane, corners) + ROUNDING;
            if uncertainty < UNCERTAIN {
                return Hyperplane {
                    uncertainty,
                    ..plane
                };
            }
        }
        let unit = GRID.powi(D as i32 - 1);
        let minors = exact::normal_minors(corners).map(|minor| minor.to_f64() / unit);
        Hyperplane {
            uncertainty: ROUNDING,
            ..hyperplane_of_minors(&minors, corners[0])
        }
    }

    #[cold]
    fn exact_side(&self, facet: &Facet<D>, point: u32) -> f64 {
        let corners = self.corners(&facet.vertices);
        f64::from(exact::side(&corners, &self.points[point as usize])) * f64::MIN_POSITIVE
    }
}

impl<const D: usize> Predicates<D> for Frame<D> {
    #[inline]
    fn hyperplane(&self, vertices: &[u32; D]) -> Option<Hyperplane<D>> {
        let corners = self.corners(vertices);
        if self.is_exact {
            Some(self.certain_hyperplane(&corners))
        } else {
            hyperplane(&corners)
        }
    }

    #[inline(always)]
    fn height(&self, facet: &Facet<D>, point: u32) -> f64 {
        let height = dot(&facet.normal, &self.points[point as usize]) - facet.offset;
        if !self.is_exact {
            height - self.tolerance
        } else if height.abs() > facet.uncertainty {
            height
        } else {
            self.exact_side(facet, point)
        }
    }
}

/// Bound on the error of `normal . x` for unit vectors x, from what the normal's products with the edges, which
/// should be 0, turned out to be.
///
/// With edges E and x = E c + h n, that error is the sum of `c_j (normal . e_j)`, and |c| <= |x| / s for the least
/// singular value s of E. The product of all is known, and that of the others is bounded by their mean square.
fn tilt<const D: usize>(plane: &Hyperplane<D>, corners: &[&[f64; D]; D]) -> f64 {
    let (mut residual, mut squares) = (0.0f64, 0.0);
    for corner in &corners[1..] {
        let edge = difference(corner, corners[0]);
        let rounding = 8.0 * f64::EPSILON * dot(&edge.map(f64::abs), &plane.normal.map(f64::abs));
        residual = residual.max(dot(&plane.normal, &edge).abs() + rounding);
        squares += dot(&edge, &edge);
    }
    let others = D as f64 - 2.0;
    let most_of_others = (squares / others.max(1.0)).powf(0.5 * others);
    // The reflections found the determinant of edges off by a few roundings, and their least singular value.
    let least = plane.determinant / most_of_others - BACKWARD * squares.sqrt();
    if least <= 0.0 {
        return f64::INFINITY;
    }
    // sqrt(D - 1) turns the Euclidean norm of c into the sum of its entries.
    (D as f64 - 1.0).sqrt() * residual / least
}

#[cfg(test)]
mod tests {
    use super::super::simplex::tests::noisy_lattice;
    use super::*;

    /// Whatever the filter lets pass has the sign that integers find, however thin the simplex.
    #[test]
    fn certain_heights_have_the_exact_sign() {
        for exponent in 5..17 {
            let points: Vec<[f64; 4]> = noisy_lattice(10f64.powi(-exponent));
            let Ok(Start::Full { mut frame, .. }) = Frame::start(&points) else {
                panic!("the lattice is not flat");
            };
            frame.snap_to_grid();
            let count = points.len();
            let mut certain = 0;
            for first in 0..count {
                // Steps that take in neighbours on common lines and planes as well as points far apart.
                let vertices = [first, first + 1, first + 9, first + 4 * exponent as usize]
                    .map(|index| (index % count) as u32);
                let corners = frame.corners(&vertices);
                let plane = frame.certain_hyperplane(&corners);
                for point in &frame.points {
                    let height = dot(&plane.normal, point) - plane.offset;
                    let side = exact::side(&corners, point);
                    if height.abs() > plane.uncertainty {
                        assert_eq!(height.signum(), f64::from(side));
                        certain += 1;
                    }
                }
            }
            assert!(certain > count * count / 4);
        }
    }
}
