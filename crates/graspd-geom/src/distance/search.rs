//! The search for the triangle nearest to one point: eight boxes at a time.

use graspd_ad::{Kernel, Real, vectorize};
use nalgebra::Point3;

use super::eight_boxes::{BOXES, Slack};
use super::tree::TriangleTree;
use super::wide_tree::{Child, STACK, WideNode};

/// A search under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search<'a> {
    tree: &'a TriangleTree,
    point: [f64; 3],
    /// The square of the least distance so far.
    best_squared: f64,
    /// The triangle at that distance, in leaf order.
    nearest: Option<usize>,
}

impl<'a> Search<'a> {
    /// Nothing found yet; only what is nearer than `bound` will be.
    pub(super) fn new(tree: &'a TriangleTree, p: &Point3<f64>, bound: f64) -> Self {
        Self {
            tree,
            point: [p.x, p.y, p.z],
            best_squared: bound * bound,
            nearest: None,
        }
    }

    /// The square of the least distance and its triangle in leaf order.
    pub(super) fn best(&self) -> Option<(f64, usize)> {
        Some((self.best_squared, self.nearest?))
    }

    /// Looks at every triangle.
    pub(super) fn look_at_all(&mut self) {
        for at in 0..self.tree.triangles.len() {
            self.look_at(at);
        }
    }

    /// Walks the tree, nearest box first.
    pub(super) fn walk(&mut self, slack: Slack) {
        vectorize(Walk {
            search: self,
            slack,
        });
    }

    #[inline(always)]
    fn look_at(&mut self, at: usize) {
        let squared = self.tree.triangles[at].distance_squared(self.point);
        if squared < self.best_squared {
            self.best_squared = squared;
            self.nearest = Some(at);
        }
    }
}

struct Walk<'s, 'a> {
    search: &'s mut Search<'a>,
    slack: Slack,
}

impl Kernel for Walk<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Real<Element = f32>>(self) {
        let Self { search, slack } = self;
        let tree = search.tree;
        let middle = tree.middle();
        let [x, y, z] = search.point;
        let relative = [
            L::constant(x - middle.x),
            L::constant(y - middle.y),
            L::constant(z - middle.z),
        ];
        let mut widened = slack.widen(search.best_squared) as f32;
        let mut stack = [(Child::Node(0), 0.0); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (child, lower_bound) = stack[top];
            if lower_bound >= widened {
                continue;
            }
            match child {
                Child::Triangle(at) => {
                    search.look_at(at as usize);
                    widened = slack.widen(search.best_squared) as f32;
                }
                Child::Node(index) => {
                    let node = &tree.wide[index as usize];
                    let bounds = lower_bounds(node, relative);
                    // Without branches, which could not be predicted.
                    let base = top;
                    let (mut least, mut least_at) = (f32::INFINITY, base);
                    for place in 0..BOXES {
                        let bound = bounds[place];
                        stack[top] = (node.children[place], bound);
                        least_at = if bound < least.min(widened) {
                            top
                        } else {
                            least_at
                        };
                        least = if bound < least { bound } else { least };
                        top += usize::from(bound < widened);
                    }
                    if top > base {
                        stack.swap(least_at, top - 1);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn lower_bounds<L: Real<Element = f32>>(node: &WideNode, p: [L; 3]) -> [f32; BOXES] {
    const { assert!(L::LANES == BOXES) };
    let mut bounds = [0.0; BOXES];
    node.boxes.distances_squared(p).store(&mut bounds);
    bounds
}
