//! The order in which points join the polytope: each facet's farthest outside point first.

use super::frame::Frame;
use super::polytope::{NONE, Polytope, Stop};
use super::predicates::Predicates;

/// Grows the simplex until no point is outside; `false` where that would take more than `most_facets`, with the
/// polytope of the points taken in by then.
///
/// A point that is outside belongs to one of the facets that it is above; a facet's points form a linked list
/// that begins with the farthest. When facets give way, their points move to new facets, or turn out inside.
pub(super) fn quickhull<const D: usize>(
    frame: &Frame<D>,
    simplex: &[u32],
    most_facets: usize,
) -> Result<(Polytope<D>, bool), Stop> {
    let mut polytope = Polytope::simplex(frame, simplex, most_facets)?;
    let mut outside = OutsideSets {
        next: vec![NONE; frame.points.len()],
        heights: vec![0.0; frame.points.len()],
        pending: Default::default(),
    };
    for point in 0..frame.points.len() as u32 {
        if !simplex.contains(&point) {
            outside.assign(frame, &mut polytope, point);
        }
    }
    while let Some(slot) = outside.pending.pop_front() {
        // A slot may have been emptied, or reused, since it was noted; then another note is due or none.
        let point = polytope.facet(slot).outside;
        if point == NONE {
            continue;
        }
        polytope.facet_mut(slot).outside = outside.next[point as usize];
        match polytope.insert(frame, point, slot) {
            Err(Stop::TooManyFacets) => return Ok((polytope, false)),
            result => result?,
        }
        outside.redistribute(frame, &mut polytope);
    }
    Ok((polytope, true))
}

/// The points that are not in the polytope yet.
struct OutsideSets {
    /// The next point outside the same facet.
    next: Vec<u32>,
    /// How far each is above its facet.
    heights: Vec<f64>,
    /// Facets that got points, in the order in which they did.
    pending: std::collections::VecDeque<u32>,
}

impl OutsideSets {
    /// Moves the points of the facets that gave way.
    fn redistribute<const D: usize>(&mut self, frame: &Frame<D>, polytope: &mut Polytope<D>) {
        for index in 0..polytope.visible.len() {
            let slot = polytope.visible[index];
            let mut point = std::mem::replace(&mut polytope.facet_mut(slot).outside, NONE);
            while point != NONE {
                let next = self.next[point as usize];
                self.assign(frame, polytope, point);
                point = next;
            }
        }
    }

    /// Gives the point to the first new facet that it is above, if there is one.
    fn assign<const D: usize>(&mut self, frame: &Frame<D>, polytope: &mut Polytope<D>, point: u32) {
        for index in 0..polytope.fresh.len() {
            let slot = polytope.fresh[index];
            let facet = polytope.facet_mut(slot);
            let height = frame.height(facet, point);
            if height <= 0.0 {
                continue;
            }
            self.heights[point as usize] = height;
            let head = facet.outside;
            if head == NONE || height > self.heights[head as usize] {
                self.next[point as usize] = head;
                facet.outside = point;
            } else {
                self.next[point as usize] = self.next[head as usize];
                self.next[head as usize] = point;
            }
            if head == NONE {
                self.pending.push_back(slot);
            }
            return;
        }
    }
}
