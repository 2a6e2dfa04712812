//! The geometric decisions that the construction of a hull rests on, rounded or exact.

use super::exact::{self, GRID};
use super::facet::Facet;
use super::frame::Frame;
use super::hyperplane::{Hyperplane, difference, dot, hyperplane, hyperplane_of_minors};

/// The corners of a facet lie at most this far from a hyperplane found by weighing two others; reflections do
/// no better.
const RESIDUAL: f64 = 1e-15;
/// Exact: a hyperplane that leaves heights more uncertain than this is found anew in integers.
const UNCERTAIN: f64 = 1e-11;
/// Bound on the length of a difference of points: |x| <= 1 in each of six coordinates.
const LONGEST: f64 = 5.0;
/// Bound on the relative change of the edges for which reflections yield the exact result.
const BACKWARD: f64 = 1e-13;
/// Bound on the rounding in `normal . point - offset`, and in normals rounded from integers.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// What a growing polytope asks of geometry.
pub(super) trait Predicates<const D: usize> {
    /// The oriented hyperplane through D points, `None` if they are dependent.
    fn hyperplane(&self, vertices: &[u32; D]) -> Option<Hyperplane<D>>;
    /// The same for the new facet that joins the point to the ridge between a facet that it is above and one
    /// that it is not.
    fn cone_hyperplane(
        &self,
        vertices: &[u32; D],
        point: u32,
        visible: &Facet<D>,
        hidden: &Facet<D>,
    ) -> Option<Hyperplane<D>>;
    /// How far the point is above the facet; positive where it counts as above.
    fn height(&self, facet: &Facet<D>, point: u32) -> f64;
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

    #[inline]
    fn cone_hyperplane(
        &self,
        vertices: &[u32; D],
        point: u32,
        visible: &Facet<D>,
        hidden: &Facet<D>,
    ) -> Option<Hyperplane<D>> {
        if self.is_exact {
            return self.hyperplane(vertices);
        }
        // All hyperplanes through the ridge are combinations of these two: the one through the point weighs
        // each by the point's height over the other. Both weights are positive, so nothing cancels.
        let tip = &self.points[point as usize];
        let above = dot(&visible.normal, tip) - visible.offset;
        let below = hidden.offset - dot(&hidden.normal, tip);
        let mut normal: [f64; D] =
            std::array::from_fn(|k| above * hidden.normal[k] + below * visible.normal[k]);
        let per_length = dot(&normal, &normal).sqrt().recip();
        for component in &mut normal {
            *component *= per_length;
        }
        let offset = dot(&normal, tip);
        let mut residual = 0.0f64;
        for corner in self.corners(vertices) {
            residual = residual.max((dot(&normal, corner) - offset).abs());
        }
        // What was rounded in the two adds up; start afresh before it shows.
        if residual > RESIDUAL || !offset.is_finite() {
            return self.hyperplane(vertices);
        }
        Some(Hyperplane {
            normal,
            offset,
            determinant: 0.0,
            uncertainty: 0.0,
        })
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

impl<const D: usize> Frame<D> {
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

    /// How far the point that is certainly inside is below the facet, in working coordinates.
    pub(super) fn depth_of_interior(&self, facet: &Facet<D>) -> f64 {
        facet.offset - dot(&facet.normal, &self.interior)
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

#[cfg(test)]
mod tests {
    use super::super::frame::Start;
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
