//! The order in which points join the polytope: each facet's farthest outside point first.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, VecDeque};

use super::frame::Frame;
use super::polytope::{NONE, Polytope, Stop};
use super::predicates::Predicates;

/// With this many facets, where volume counts, a hull ...
const LOOK_AT_FACETS: usize = 8000;
/// ... with more points than this outside is left as it is: it would have hundreds of thousands in the end.
const MAX_OUTSIDE: usize = 500;

/// Which facet's farthest point is next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// Of the facet that got points before any other.
    Found,
    /// Of the facet whose pyramid with its farthest point has the most volume, so that a polytope
    /// that ends early lacks little; and it does where there is little hope of an end.
    MostVolume,
}

/// Grows the simplex until no point is outside; `false` where that would take more than
/// `max_facets`, or where the order gives up, with the polytope of the points taken in by then.
///
/// A point that is outside belongs to one of the facets that it is above; a facet's points form a linked list
/// that begins with the farthest. When facets give way, their points move to new facets, or turn out inside.
pub(super) fn quickhull<const D: usize>(
    frame: &Frame<D>,
    simplex: &[u32],
    max_facets: usize,
    order: Order,
) -> Result<(Polytope<D>, bool), Stop> {
    let mut polytope = Polytope::simplex(frame, simplex, max_facets)?;
    let mut outside = OutsideSets {
        next: vec![NONE; frame.points.len()],
        heights: vec![0.0; frame.points.len()],
        count: 0,
        pending: Pending::new(order),
    };
    for point in 0..frame.points.len() as u32 {
        if !simplex.contains(&point) {
            outside.assign(frame, &mut polytope, point);
        }
    }
    outside.note_fresh(frame, &polytope);
    while let Some(slot) = outside.pending.pop(&polytope) {
        // A slot may have been emptied, or reused, since it was noted; then another note is due or none.
        let point = polytope.facet(slot).outside;
        if point == NONE {
            continue;
        }
        if order == Order::MostVolume
            && polytope.count() >= LOOK_AT_FACETS
            && outside.count > MAX_OUTSIDE
        {
            return Ok((polytope, false));
        }
        polytope.facet_mut(slot).outside = outside.next[point as usize];
        outside.count -= 1;
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
    /// How many there are.
    count: usize,
    /// Facets that got points.
    pending: Pending,
}

/// Facets with points outside, in the order in which they are due.
enum Pending {
    Found(VecDeque<u32>),
    MostVolume(BinaryHeap<Due>),
}

impl Pending {
    fn new(order: Order) -> Self {
        match order {
            Order::Found => Self::Found(VecDeque::new()),
            Order::MostVolume => Self::MostVolume(BinaryHeap::new()),
        }
    }

    /// The next one. A slot may have been emptied, or reused, since it was noted; then another note is due or none.
    fn pop<const D: usize>(&mut self, polytope: &Polytope<D>) -> Option<u32> {
        match self {
            Self::Found(slots) => slots.pop_front(),
            Self::MostVolume(due) => std::iter::from_fn(|| due.pop())
                .find(|due| polytope.holds(due.slot, due.birth))
                .map(|due| due.slot),
        }
    }
}

/// A facet and the volume of its pyramid with its farthest point, times the dimension.
struct Due {
    gain: f64,
    slot: u32,
    birth: u32,
}

impl Ord for Due {
    fn cmp(&self, other: &Self) -> Ordering {
        // Slots settle ties, so that the order is one.
        let key = |due: &Self| (due.birth, due.slot);
        (self.gain.total_cmp(&other.gain)).then_with(|| key(other).cmp(&key(self)))
    }
}
impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Due {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Due {}

impl OutsideSets {
    /// Moves the points of the facets that gave way.
    fn redistribute<const D: usize>(&mut self, frame: &Frame<D>, polytope: &mut Polytope<D>) {
        for index in 0..polytope.visible.len() {
            let slot = polytope.visible[index];
            let mut point = std::mem::replace(&mut polytope.facet_mut(slot).outside, NONE);
            while point != NONE {
                let next = self.next[point as usize];
                self.count -= 1;
                self.assign(frame, polytope, point);
                point = next;
            }
        }
        self.note_fresh(frame, polytope);
    }

    /// Notes the new facets that have points, if that waits until each has its farthest.
    fn note_fresh<const D: usize>(&mut self, frame: &Frame<D>, polytope: &Polytope<D>) {
        if let Pending::MostVolume(due) = &mut self.pending {
            for &slot in &polytope.fresh {
                let facet = polytope.facet(slot);
                if facet.outside != NONE {
                    let gain = self.heights[facet.outside as usize] * frame.area(facet);
                    let birth = facet.birth;
                    due.push(Due { gain, slot, birth });
                }
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
            self.count += 1;
            let head = facet.outside;
            if head == NONE || height > self.heights[head as usize] {
                self.next[point as usize] = head;
                facet.outside = point;
            } else {
                self.next[point as usize] = self.next[head as usize];
                self.next[head as usize] = point;
            }
            if head == NONE
                && let Pending::Found(slots) = &mut self.pending
            {
                slots.push_back(slot);
            }
            return;
        }
    }
}
