//! The check that a polytope built with rounded predicates is what it should be.

use super::frame::Frame;
use super::hyperplane::dot;
use super::polytope::{NONE, Polytope, position};
use super::predicates::Predicates;

/// How far, in tolerances, a vertex may stick out over a neighbouring facet: points were dropped within one
/// tolerance of a facet, and facets later replaced by others within one more.
pub(super) const DEPTH_SLACK: f64 = 4.0;
/// The same where the volume alone matters, which changes by no more than the slack: 1e-9 of the extent.
pub(super) const VOLUME_SLACK: f64 = 1000.0;

/// The least cosine between a facet's normal and the one that its corners have in their order.
const AGREEMENT: f64 = 0.5;

/// Whether every facet faces away from the interior, as the order of its corners says too, and no neighbour
/// rises above it by more than `slack` tolerances.
///
/// The surface began as that of a simplex, and each step replaced a piece by a cone over its rim, so it encloses
/// the interior once. Where all facets face outward it therefore does not fold, and as it is convex at every ridge,
/// it bounds a convex body (van Heijenoort 1952): this local check vouches for the whole.
pub(super) fn is_convex<const D: usize>(
    frame: &Frame<D>,
    polytope: &Polytope<D>,
    slack: f64,
) -> bool {
    polytope.facets().all(|(slot, facet)| {
        let faces_outward = frame.depth_of_interior(facet) > frame.tolerance
            && frame
                .hyperplane(&facet.vertices)
                .is_some_and(|plane| dot(&plane.normal, &facet.normal) > AGREEMENT);
        faces_outward
            && facet.neighbours.iter().all(|&beyond| {
                if beyond == NONE {
                    return false;
                }
                let neighbour = polytope.facet(beyond);
                let Some(back) = position(&neighbour.neighbours, slot) else {
                    return false;
                };
                let opposite = &frame.points[neighbour.vertices[back] as usize];
                let height = dot(&facet.normal, opposite) - facet.offset;
                height <= slack * frame.tolerance
            })
    })
}
