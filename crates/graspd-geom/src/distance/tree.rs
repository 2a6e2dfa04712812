//! A tree of bounding boxes over a mesh's triangles, for closest points.

use nalgebra::{Point3, Vector3};

use super::closed::check_finite;
use super::error::DistanceError;
use super::triangle::Triangle;
use crate::TriangleMesh;

/// Most triangles in a leaf.
const LEAF: usize = 4;
/// More than the tree's depth: halving 2^32 triangles takes 32 levels.
pub(super) const STACK: usize = 40;

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

#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
    /// First triangle of a leaf, or the right child (the left one is the next node).
    pub(super) start: u32,
    /// Triangles of a leaf, 0 for an inner node.
    pub(super) count: u32,
}

impl Node {
    fn distance_squared(&self, p: &Point3<f64>) -> f64 {
        let outside = |p: f64, low: f64, high: f64| (low - p).max(p - high).max(0.0);
        Vector3::new(
            outside(p.x, self.low.x, self.high.x),
            outside(p.y, self.low.y, self.high.y),
            outside(p.z, self.low.z, self.high.z),
        )
        .norm_squared()
    }
}

/// A bounding volume hierarchy over triangles, open or closed: exact closest points in logarithmic time.
///
/// Queries allocate nothing and can run on many threads at once.
#[derive(Clone, Debug)]
pub struct TriangleTree {
    pub(super) nodes: Vec<Node>,
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
    pub fn new(mesh: &TriangleMesh) -> Result<Self, DistanceError> {
        check_finite(mesh)?;
        let centers: Vec<Point3<f64>> = (0..mesh.faces.len())
            .map(|face| {
                let [a, b, c] = mesh.corners(face);
                Point3::from((a.coords + b.coords + c.coords) / 3.0)
            })
            .collect();
        let mut faces: Vec<u32> = (0..mesh.faces.len() as u32).collect();
        let mut nodes = Vec::with_capacity(mesh.faces.len());
        split(mesh, &centers, &mut faces, 0, &mut nodes);
        let corners: Vec<_> = faces.iter().map(|&f| mesh.corners(f as usize)).collect();
        Ok(Self {
            nodes,
            triangles: corners.iter().map(|c| Triangle::new(*c)).collect(),
            corners,
            faces,
        })
    }

    /// The lowest and highest corner of the box around all triangles \[m\].
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        (self.nodes[0].low, self.nodes[0].high)
    }

    /// The nearest point of the surface. Where `p` is not finite, so is the distance.
    pub fn closest(&self, p: &Point3<f64>) -> ClosestPoint {
        self.closest_within(p, f64::INFINITY)
            .unwrap_or_else(|| self.found(p, 0, self.corners[0][0] - p))
    }

    /// The nearest point of the surface if it is nearer than `bound` \[m\].
    pub fn closest_within(&self, p: &Point3<f64>, bound: f64) -> Option<ClosestPoint> {
        let mut best_squared = bound * bound;
        let mut best = None;
        let mut stack = [(0, 0.0); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (index, squared) = stack[top];
            if squared >= best_squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            let start = node.start as usize;
            for at in start..start + node.count as usize {
                let to_closest = self.triangles[at].to_closest(p);
                let squared = to_closest.norm_squared();
                if squared < best_squared {
                    (best, best_squared) = (Some((at, to_closest)), squared);
                }
            }
            if node.count == 0 {
                let (left, right) = (index + 1, node.start);
                let mut near = (left, self.nodes[left as usize].distance_squared(p));
                let mut far = (right, self.nodes[right as usize].distance_squared(p));
                if far.1 < near.1 {
                    std::mem::swap(&mut near, &mut far);
                }
                stack[top] = far;
                stack[top + 1] = near;
                top += 2;
            }
        }
        best.map(|(at, to_closest)| self.found(p, at, to_closest))
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

/// Appends the subtree of `faces`, whose first is number `first` in leaf order, halving them at the median of
/// their centres along the longest axis.
fn split(
    mesh: &TriangleMesh,
    centers: &[Point3<f64>],
    faces: &mut [u32],
    first: usize,
    nodes: &mut Vec<Node>,
) {
    let mut low = Point3::from(Vector3::repeat(f64::INFINITY));
    let mut high = Point3::from(Vector3::repeat(f64::NEG_INFINITY));
    let (mut low_center, mut high_center) = (low, high);
    for &face in faces.iter() {
        for corner in mesh.corners(face as usize) {
            (low, high) = (low.inf(&corner), high.sup(&corner));
        }
        let center = &centers[face as usize];
        (low_center, high_center) = (low_center.inf(center), high_center.sup(center));
    }
    let at = nodes.len();
    nodes.push(Node {
        low,
        high,
        start: first as u32,
        count: faces.len() as u32,
    });
    if faces.len() <= LEAF {
        return;
    }
    let axis = (high_center - low_center).imax();
    let half = faces.len() / 2;
    faces.select_nth_unstable_by(half, |&i, &j| {
        let (a, b) = (centers[i as usize][axis], centers[j as usize][axis]);
        a.total_cmp(&b).then(i.cmp(&j))
    });
    let (left, right) = faces.split_at_mut(half);
    split(mesh, centers, left, first, nodes);
    nodes[at].start = nodes.len() as u32;
    nodes[at].count = 0;
    split(mesh, centers, right, first + half, nodes);
}
