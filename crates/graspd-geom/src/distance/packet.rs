//! Distances of eight points at a time.

use graspd_ad::{Mask, Real};

use super::eight_boxes::Slack;
use super::tree::TriangleTree;
use super::wide_tree::{Child, STACK};

/// How many points a packet holds.
pub(crate) const PACKET: usize = 8;

/// The x, y and z of eight points.
pub(crate) type Points = [[f64; PACKET]; 3];

/// Finds the distances of packets of points, one after the other. What is found for one is a good guess for the
/// next: the nearer the points of a packet are to each other and to those of the last, the faster.
///
/// To be used within a [`graspd_ad::Kernel`], with eight lanes.
pub(crate) struct PacketSearch<'a, L> {
    tree: &'a TriangleTree,
    /// The first and the last point of the packet before, and their distances; infinite before the first packet.
    known: [([f64; 3], f64); 2],
    /// The triangles that are nearest to those, in leaf order.
    nearest: [usize; 2],
    /// What is yet to be looked at, and lower bounds of its squared distances.
    children: [Child; STACK],
    lower_bounds: [L; STACK],
}

/// The lanes of the points of a packet by which the next one is guessed.
const ENDS: [usize; 2] = [0, PACKET - 1];

impl<'a, L: Real<Element = f32>> PacketSearch<'a, L> {
    #[inline(always)]
    pub(crate) fn new(tree: &'a TriangleTree) -> Self {
        const { assert!(L::LANES == PACKET) };
        Self {
            tree,
            known: [([0.0; 3], f64::INFINITY); 2],
            nearest: [0; 2],
            children: [Child::Node(0); STACK],
            lower_bounds: [L::zero(); STACK],
        }
    }

    /// The distances of eight points.
    #[inline(always)]
    pub(crate) fn distances(&mut self, points: &Points, slack: Slack) -> [f64; PACKET] {
        let middle = self.tree.middle();
        let relative = [
            L::from_lanes(|lane| points[0][lane] - middle.x),
            L::from_lanes(|lane| points[1][lane] - middle.y),
            L::from_lanes(|lane| points[2][lane] - middle.z),
        ];
        let bounds = self.bounds_squared(points);
        let guesses = self.nearest;
        let mut best = [f64::INFINITY; PACKET];
        self.improve(points, guesses[0], &mut best);
        if guesses[1] != guesses[0] {
            self.improve(points, guesses[1], &mut best);
        }
        let mut widened = slack.widen(L::from_lanes(|lane| best[lane]).min(bounds));
        self.children[0] = Child::Node(0);
        self.lower_bounds[0] = L::zero();
        let mut top = 1;
        while top > 0 {
            top -= 1;
            if !self.lower_bounds[top].le(widened).any() {
                continue;
            }
            match self.children[top] {
                Child::Triangle(at) => {
                    let at = at as usize;
                    if at != guesses[0] && at != guesses[1] {
                        self.improve(points, at, &mut best);
                        widened = slack.widen(L::from_lanes(|lane| best[lane]).min(bounds));
                    }
                }
                Child::Node(index) => top = self.push_children(index, relative, widened, top),
            }
        }
        for end in 0..ENDS.len() {
            let lane = ENDS[end];
            let point = [points[0][lane], points[1][lane], points[2][lane]];
            self.known[end] = (point, best[lane].sqrt());
        }
        let mut distances = best;
        for lane in 0..PACKET {
            distances[lane] = best[lane].sqrt();
        }
        distances
    }

    /// Pushes the children of a node that may hold what is nearest to one of the points, the one nearest to the
    /// first point last; gives the new height of the stack.
    #[inline(always)]
    fn push_children(&mut self, index: u32, relative: [L; 3], widened: L, base: usize) -> usize {
        let node = &self.tree.wide[index as usize];
        let mut top = base;
        let (mut least, mut least_at) = (f64::INFINITY, base);
        for place in 0..node.count {
            let lower_bound: L = node.boxes.distances_squared_to(place, relative);
            if lower_bound.le(widened).any() {
                self.children[top] = node.children[place];
                self.lower_bounds[top] = lower_bound;
                if lower_bound.lane(0) < least {
                    (least, least_at) = (lower_bound.lane(0), top);
                }
                top += 1;
            }
        }
        if top > base {
            self.children.swap(least_at, top - 1);
            self.lower_bounds.swap(least_at, top - 1);
        }
        top
    }

    /// Upper bounds from the packet before: |d(p)| <= |d(q)| + |p - q|.
    #[inline(always)]
    fn bounds_squared(&self, points: &Points) -> L {
        let mut bounds = [0.0; PACKET];
        for lane in 0..PACKET {
            let mut bound = f64::INFINITY;
            for (q, distance) in self.known {
                let [x, y, z] = [
                    points[0][lane] - q[0],
                    points[1][lane] - q[1],
                    points[2][lane] - q[2],
                ];
                bound = bound.min(distance + (x * x + y * y + z * z).sqrt());
            }
            bounds[lane] = bound * bound;
        }
        L::from_lanes(|lane| bounds[lane])
    }

    /// Takes the triangle number `at` into account.
    #[inline(always)]
    fn improve(&mut self, points: &Points, at: usize, best: &mut [f64; PACKET]) {
        let triangle = &self.tree.triangles[at];
        let mut squared = [0.0; PACKET];
        let [x, y, z] = points;
        for lane in 0..PACKET {
            squared[lane] = triangle.distance_squared([x[lane], y[lane], z[lane]]);
        }
        for end in 0..ENDS.len() {
            if squared[ENDS[end]] < best[ENDS[end]] {
                self.nearest[end] = at;
            }
        }
        for lane in 0..PACKET {
            best[lane] = if squared[lane] < best[lane] {
                squared[lane]
            } else {
                best[lane]
            };
        }
    }
}
