//! A tree of bounding boxes over a mesh's triangles, for closest points.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::boundary::check_finite;
use super::oriented_box::{OrientedBox, Slack};
use super::triangle::Triangle;
use crate::{GeometryError, TriangleMesh};

/// Most triangles in a leaf.
const LEAF: usize = 2;
/// More than the tree's depth: halving 2^32 triangles takes 32 levels.
pub(super) const STACK: usize = 40;
/// Farther away than this \[m\] single precision is no use, and every triangle is looked at.
const FAR: f64 = 1e15;

/// The point of a mesh that is nearest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// The point on the surface \[m\].
    pub point: Point3<f64>,
    /// How far it is, never negative \[m\].
    pub distance: f64,
    /// The face it lies on; one of them where it lies on an edge or a vertex.
    pub face: usize,
    /// Unit outward normal of that face; zero if it has no area.
    pub normal: Vector3<f64>,
}

/// A node's place in the tree. Nodes are stored depth first, so the left child is the next node.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// The node after this one's subtree: the right child of its parent, if it is a left child.
    pub(super) end: u32,
    /// The first of its triangles in leaf order.
    pub(super) first: u32,
    /// How many triangles there are in its subtree.
    pub(super) count: u32,
}

impl Node {
    pub(super) fn is_leaf(&self) -> bool {
        self.count as usize <= LEAF
    }
    pub(super) fn triangles(&self) -> std::ops::Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// A bounding volume hierarchy over triangles, open or closed: exact closest points in logarithmic time.
///
/// Queries allocate nothing and can run on many threads at once.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    pub(super) nodes: Vec<Node>,
    /// A box along the axes for each node: its lowest and highest corner.
    pub(super) extents: Vec<[Point3<f64>; 2]>,
    /// A box turned to fit, for each node.
    pub(super) boxes: Vec<OrientedBox>,
    /// In leaf order.
    pub(super) triangles: Vec<Triangle>,
    pub(super) corners: Vec<[Point3<f64>; 3]>,
    pub(super) faces: Vec<u32>,
}

impl TriangleTree {
    /// Builds the tree. Faces without area count as the segment or point that they are.
    ///
    /// # Errors
    /// A mesh without faces, with an index out of range or with a coordinate that is not finite.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, GeometryError> {
        check_finite(mesh)?;
        let centers: Vec<Point3<f64>> = (0..mesh.faces.len())
            .map(|face| {
                let [a, b, c] = mesh.corners(face);
                Point3::from((a.coords + b.coords + c.coords) / 3.0)
            })
            .collect();
        let mut faces: Vec<u32> = (0..mesh.faces.len() as u32).collect();
        let mut nodes = Vec::with_capacity(mesh.faces.len());
        split(&centers, &mut faces, 0, &mut nodes);
        let corners: Vec<_> = faces.iter().map(|&f| mesh.corners(f as usize)).collect();
        let extents: Vec<_> = nodes
            .par_iter()
            .map(|node| extent(&corners[node.triangles()]))
            .collect();
        let middle = nalgebra::center(&extents[0][0], &extents[0][1]);
        let boxes = nodes
            .par_iter()
            .map(|node| OrientedBox::around(&corners[node.triangles()], &middle))
            .collect();
        Ok(Self {
            nodes,
            extents,
            boxes,
            triangles: corners.iter().map(|c| Triangle::new(*c)).collect(),
            corners,
            faces,
        })
    }

    /// The lowest and highest corner of the box around all triangles \[m\].
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let [low, high] = self.extents[0];
        (low, high)
    }

    /// The corners of all triangles.
    pub(crate) fn corners(&self) -> impl Iterator<Item = &[Point3<f64>; 3]> {
        self.corners.iter()
    }

    /// The middle of that box: the origin of the oriented boxes.
    pub(super) fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.extents[0][0], &self.extents[0][1])
    }

    /// The slack of single precision for points that are, along each axis, at most `farthest` from the middle.
    pub(super) fn slack(&self, farthest: f64) -> Slack {
        let [low, high] = self.extents[0];
        Slack::new(farthest + (high - low).amax())
    }

    /// The nearest point of the surface. Where `p` is not finite, the distance is not finite either.
    pub fn closest(&self, p: &Point3<f64>) -> ClosestPoint {
        self.closest_within(p, f64::INFINITY)
            .unwrap_or_else(|| self.found(p, 0, self.corners[0][0] - p))
    }

    /// The nearest point of the surface if it is nearer than `bound` \[m\].
    pub fn closest_within(&self, p: &Point3<f64>, bound: f64) -> Option<ClosestPoint> {
        let relative = p - self.middle();
        let farthest = relative.amax();
        let mut best = (bound * bound, usize::MAX);
        if farthest < FAR {
            self.search(
                p,
                [0, 1, 2].map(|i| relative[i] as f32),
                self.slack(farthest),
                &mut best,
            );
        } else {
            self.look_at(p, 0..self.triangles.len(), &mut best);
        }
        let (_, at) = best;
        let triangle = self.triangles.get(at)?;
        Some(self.found(p, at, triangle.to_closest(p)))
    }

    /// Improves the best squared distance so far and its triangle by those in a range of the leaf order.
    #[inline(always)]
    fn look_at(&self, p: &Point3<f64>, range: std::ops::Range<usize>, best: &mut (f64, usize)) {
        for at in range {
            let squared = self.triangles[at].distance_squared([p.x, p.y, p.z]);
            if squared < best.0 {
                *best = (squared, at);
            }
        }
    }

    /// Depth first, nearer box first; `relative` is `p` from the middle.
    fn search(&self, p: &Point3<f64>, relative: [f32; 3], slack: Slack, best: &mut (f64, usize)) {
        let mut widened = slack.widen(best.0) as f32;
        let mut stack = [(0, 0.0); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (index, lower_bound) = stack[top];
            if lower_bound > widened {
                continue;
            }
            let node = &self.nodes[index];
            if node.is_leaf() {
                self.look_at(p, node.triangles(), best);
                widened = slack.widen(best.0) as f32;
                continue;
            }
            let (left, right) = (index + 1, self.nodes[index + 1].end as usize);
            let mut near = (left, self.boxes[left].distance_squared(relative));
            let mut far = (right, self.boxes[right].distance_squared(relative));
            if far.1 < near.1 {
                std::mem::swap(&mut near, &mut far);
            }
            stack[top] = far;
            stack[top + 1] = near;
            top += 2;
        }
    }

    fn found(&self, p: &Point3<f64>, at: usize, to_closest: Vector3<f64>) -> ClosestPoint {
        let [a, b, c] = self.corners[at];
        let normal = (b - a).cross(&(c - a));
        ClosestPoint {
            point: p + to_closest,
            distance: to_closest.norm(),
            face: self.faces[at] as usize,
            normal: normal
                .try_normalize(f64::MIN_POSITIVE)
                .unwrap_or_else(Vector3::zeros),
        }
    }
}

/// The box along the axes around some triangles.
fn extent(triangles: &[[Point3<f64>; 3]]) -> [Point3<f64>; 2] {
    let first = triangles[0][0];
    triangles
        .iter()
        .flatten()
        .fold([first, first], |[low, high], p| [low.inf(p), high.sup(p)])
}

/// Appends the subtree of `faces`, the first of which is number `first` in leaf order, halving them at the median
/// of their centres along the longest axis.
fn split(centers: &[Point3<f64>], faces: &mut [u32], first: usize, nodes: &mut Vec<Node>) {
    let at = nodes.len();
    nodes.push(Node {
        end: 0,
        first: first as u32,
        count: faces.len() as u32,
    });
    if faces.len() > LEAF {
        let center = |face: u32| &centers[face as usize];
        let start = *center(faces[0]);
        let (low, high) = faces.iter().fold((start, start), |(low, high), &face| {
            (low.inf(center(face)), high.sup(center(face)))
        });
        let axis = (high - low).imax();
        let half = faces.len() / 2;
        faces.select_nth_unstable_by(half, |&i, &j| {
            center(i)[axis].total_cmp(&center(j)[axis]).then(i.cmp(&j))
        });
        let (left, right) = faces.split_at_mut(half);
        split(centers, left, first, nodes);
        split(centers, right, first + half, nodes);
    }
    nodes[at].end = nodes.len() as u32;
}
