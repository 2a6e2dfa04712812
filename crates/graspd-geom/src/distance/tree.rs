//! A tree over a mesh's triangles, for closest points.

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::boundary::check_finite;
use super::eight_boxes::{BOXES, Slack};
use super::search::Search;
use super::triangle::Triangle;
use super::wide_tree::{WideNode, widened};
use crate::{GeometryError, TriangleMesh};

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

/// A node of a binary tree, stored depth first: the left child is the next node.
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
        self.count == 1
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
    /// For rays: a binary tree, and the lowest and highest corner of a box along the axes for each node.
    pub(super) nodes: Vec<Node>,
    pub(super) extents: Vec<[Point3<f64>; 2]>,
    /// For closest points.
    pub(super) wide: Vec<WideNode>,
    pub(super) triangles: Vec<Triangle>,
    /// In leaf order.
    pub(super) corners: Vec<[Point3<f64>; 3]>,
    faces: Vec<u32>,
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
        Ok(Self {
            wide: widened(&nodes, &corners, &middle),
            triangles: corners.iter().map(|c| Triangle::new(*c)).collect(),
            nodes,
            extents,
            corners,
            faces,
        })
    }

    /// The lowest and highest corner of the box around all triangles \[m\].
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        let [low, high] = self.extents[0];
        (low, high)
    }

    /// The nearest point of the surface. Where `p` is not finite, the distance is not finite either.
    pub fn closest(&self, p: &Point3<f64>) -> ClosestPoint {
        let (squared, at) = self.nearest(p, f64::INFINITY).unwrap_or((f64::NAN, 0));
        self.found(p, squared, at)
    }

    /// The nearest point of the surface if it is nearer than `bound` \[m\].
    pub fn closest_within(&self, p: &Point3<f64>, bound: f64) -> Option<ClosestPoint> {
        let (squared, at) = self.nearest(p, bound)?;
        Some(self.found(p, squared, at))
    }

    /// The distance to the surface \[m\].
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        self.nearest(p, f64::INFINITY)
            .map_or(f64::NAN, |(squared, _)| squared.sqrt())
    }

    /// The corners of all triangles.
    pub(crate) fn corners(&self) -> impl Iterator<Item = &[Point3<f64>; 3]> {
        self.corners.iter()
    }

    /// The face that is number `at` in leaf order.
    pub(super) fn face(&self, at: usize) -> usize {
        self.faces[at] as usize
    }

    /// The middle of the mesh's box: the origin of the oriented boxes.
    pub(super) fn middle(&self) -> Point3<f64> {
        nalgebra::center(&self.extents[0][0], &self.extents[0][1])
    }

    /// The slack of single precision for points that are, along each axis, at most `farthest` from the middle;
    /// `None` if that is too far for it, or NaN.
    #[inline]
    pub(super) fn slack(&self, farthest: f64) -> Option<Slack> {
        let [low, high] = self.extents[0];
        (farthest < FAR).then(|| Slack::new(farthest + (high - low).amax()))
    }

    /// The slack for points within a box.
    pub(crate) fn slack_within(&self, low: &Point3<f64>, high: &Point3<f64>) -> Option<Slack> {
        let middle = self.middle();
        self.slack((low - middle).amax().max((high - middle).amax()))
    }

    /// The square of the distance, if less than that of `bound`, and the triangle, in leaf order.
    fn nearest(&self, p: &Point3<f64>, bound: f64) -> Option<(f64, usize)> {
        let mut search = Search::new(self, p, bound);
        match self.slack((p - self.middle()).amax()) {
            Some(slack) => search.walk(slack),
            None => search.look_at_all(),
        }
        search.best()
    }

    fn found(&self, p: &Point3<f64>, squared: f64, at: usize) -> ClosestPoint {
        let [a, b, c] = self.corners[at];
        let normal = (b - a).cross(&(c - a));
        ClosestPoint {
            point: p + self.triangles[at].to_closest(p),
            distance: squared.sqrt(),
            face: self.face(at),
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
    if faces.len() > 1 {
        let center = |face: u32| &centers[face as usize];
        let start = *center(faces[0]);
        let (low, high) = faces.iter().fold((start, start), |(low, high), &face| {
            (low.inf(center(face)), high.sup(center(face)))
        });
        let axis = (high - low).imax();
        let half = faces.len() / 2;
        let half = if faces.len() > BOXES {
            half.next_multiple_of(BOXES)
        } else {
            half
        };
        faces.select_nth_unstable_by(half, |&i, &j| {
            center(i)[axis].total_cmp(&center(j)[axis]).then(i.cmp(&j))
        });
        let (left, right) = faces.split_at_mut(half);
        split(centers, left, first, nodes);
        split(centers, right, first + half, nodes);
    }
    nodes[at].end = nodes.len() as u32;
}
