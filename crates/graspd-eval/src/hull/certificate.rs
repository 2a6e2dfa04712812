//! The check that a polytope built with rounded predicates is what it should be.

use super::frame::Frame;
use super::hyperplane::dot;
use super::polytope::{NONE, Polytope, position};

/// How far, in tolerances, a vertex may stick out over a neighbouring facet: points were dropped within one
/// tolerance of a facet, and facets later replaced by others within one more.
const SLACK: f64 = 4.0;

/// Whether every facet faces away from the interior, every ridge joins exactly two facets, and no facet's
/// neighbour rises above it by more than a few tolerances.
///
/// A closed surface that is convex at every ridge bounds a convex body (van Heijenoort 1952), so this local
/// check vouches for the whole.
pub(super) fn is_convex<const D: usize>(frame: &Frame<D>, polytope: &Polytope<D>) -> bool {
    polytope.facets().all(|(slot, facet)| {
        let depth = facet.offset - dot(&facet.normal, frame.interior());
        depth > frame.tolerance()
            && facet.neighbours.iter().enumerate().all(|(k, &beyond)| {
                if beyond == NONE {
                    return false;
                }
                let neighbour = polytope.facet(beyond);
                let Some(back) = position(&neighbour.neighbours, slot) else {
                    return false;
                };
                let shares_ridge = facet
                    .vertices
                    .iter()
                    .enumerate()
                    .all(|(j, vertex)| j == k || neighbour.vertices.contains(vertex));
                let opposite = &frame.points[neighbour.vertices[back] as usize];
                let height = dot(&facet.normal, opposite) - facet.offset;
                shares_ridge && height <= SLACK * frame.tolerance()
            })
    })
}
