//! The depth of the origin without the whole hull: an inner polytope that grows only where it matters.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::DepthBounds;
use super::body::Body;
use super::frame::Frame;
use super::hyperplane::dot;
use super::polytope::{Polytope, Stop};
use super::predicates::Predicates;

/// The origin is well inside once the nearest facet is this part of the upper bound away.
const WELL_INSIDE: f64 = 0.1;

/// A facet in the queue: the least deep first.
pub(super) struct Queued {
    /// Signed distance of the origin below the facet, in the working frame.
    pub(super) depth: f64,
    pub(super) slot: u32,
    pub(super) birth: u32,
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> Ordering {
        // Reversed, for the heap gives its greatest; slots settle ties so that the order is one.
        let key = |queued: &Self| (queued.slot, queued.birth);
        other
            .depth
            .total_cmp(&self.depth)
            .then_with(|| key(other).cmp(&key(self)))
    }
}
impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Queued {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Queued {}

/// What an expansion found.
pub(super) struct Expansion<const D: usize> {
    /// Bounds on the depth of the origin, in input units.
    pub(super) bounds: DepthBounds,
    pub(super) polytope: Polytope<D>,
    /// Whether it ended since the origin was well inside, rather than with the best bounds.
    pub(super) is_begun: bool,
}

/// When an expansion ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// With the best bounds.
    Bounds,
    /// As soon as the origin is well inside.
    OriginInside,
}

/// Expands the simplex at its facet nearest to the origin, by the point of the body that lies farthest beyond that
/// facet, until that facet is one of the body or the bounds are within `relative_gap` of each other.
///
/// The polytope lies within the body, so its nearest facet bounds the depth from below. A hyperplane beyond
/// which no point lies holds the body on one side, so its distance bounds the depth from above. A negative
/// upper bound ends the search: a hyperplane separates the origin from the body. So does a polytope of more than
/// `max_facets`, with the bounds reached by then, and the goal of having the origin inside.
pub(super) fn expand<const D: usize>(
    frame: &mut Frame<D>,
    body: &impl Body<D>,
    simplex: &[u32],
    relative_gap: f64,
    max_facets: usize,
    goal: Goal,
) -> Result<Expansion<D>, Stop> {
    let mut polytope = Polytope::simplex(frame, simplex, max_facets)?;
    let mut is_vertex = vec![false; frame.points.len()];
    for &corner in simplex {
        is_vertex[corner as usize] = true;
    }
    let mut queue = BinaryHeap::new();
    let mut upper = f64::INFINITY;
    let mut is_begun = false;
    let lower = loop {
        for &slot in &polytope.fresh {
            let facet = polytope.facet(slot);
            let depth = frame.depth_of_origin(facet);
            // Farther than a known bound it will never be the nearest.
            if depth <= upper {
                let birth = facet.birth;
                queue.push(Queued { depth, slot, birth });
            }
        }
        let Some(nearest) = pop_current(&mut queue, &polytope) else {
            break upper;
        };
        let facet = polytope.facet(nearest.slot);
        let point = body.farthest(frame, &facet.normal);
        let support = dot(&facet.normal, &frame.points[point as usize]);
        upper = upper.min(nearest.depth + (support - facet.offset).max(0.0));
        let is_final = frame.height(facet, point) <= 0.0;
        if is_final || upper < 0.0 || upper - nearest.depth <= relative_gap * upper {
            break nearest.depth;
        }
        if goal == Goal::OriginInside && nearest.depth > WELL_INSIDE * upper {
            is_begun = true;
            break nearest.depth;
        }
        is_vertex.resize(frame.points.len(), false);
        if std::mem::replace(&mut is_vertex[point as usize], true) {
            return Err(Stop::Contradiction);
        }
        match polytope.insert(frame, point, nearest.slot) {
            // The polytope is as it was before.
            Err(Stop::TooManyFacets) => break nearest.depth,
            result => result?,
        }
    };
    let bounds = DepthBounds {
        lower: lower * frame.scale,
        upper: upper * frame.scale,
    };
    Ok(Expansion {
        bounds,
        polytope,
        is_begun,
    })
}

/// The first of the queue that has not given way since.
fn pop_current<const D: usize>(
    queue: &mut BinaryHeap<Queued>,
    polytope: &Polytope<D>,
) -> Option<Queued> {
    std::iter::from_fn(|| queue.pop()).find(|queued| polytope.holds(queued.slot, queued.birth))
}
