//! The generalised winding number of a closed mesh, counted exactly.
//!
//! A ray leaves the point along +x. Each triangle that it crosses counts +1 where it leaves the solid and -1
//! where it enters. Rays through edges and vertices are decided by moving the point by (0, e, e^2) with an
//! infinitely small e > 0: then the ray meets no edge, and as every edge is seen alike from both its faces, each
//! crossing counts exactly once. All signs come from exact predicates.
//!
//! # Source
//! Edelsbrunner & Mücke, "Simulation of Simplicity", ACM Trans. Graphics 1990.

use nalgebra::Point3;
use robust::{Coord, Coord3D, orient2d, orient3d};

use super::tree::TriangleTree;

/// A triangle as a ray along +x sees it.
pub(crate) struct Column<'a> {
    corners: &'a [Point3<f64>; 3],
}

impl<'a> Column<'a> {
    pub(crate) fn new(corners: &'a [Point3<f64>; 3]) -> Self {
        Self { corners }
    }

    /// Which way the line through (y, z) along +x crosses the triangle: 1 outward, -1 inward, 0 not at all.
    #[inline]
    pub(crate) fn crossing(&self, y: f64, z: f64) -> i32 {
        let [a, b, c] = self.corners;
        let side = side_of_edge(a, b, y, z);
        if side != 0 && side == side_of_edge(b, c, y, z) && side == side_of_edge(c, a, y, z) {
            side
        } else {
            0
        }
    }

    /// Whether the triangle's plane lies beyond `p` along +x, given the line's `crossing`.
    #[inline]
    pub(crate) fn is_beyond(&self, p: &Point3<f64>, crossing: i32) -> bool {
        let [a, b, c] = self.corners.map(coord3);
        f64::from(crossing) * orient3d(a, b, c, coord3(*p)) > 0.0
    }
}

/// On which side of the edge from `a` to `b`, seen along -x, (y + e, z + e^2) lies: 1 left, -1 right; 0 for an
/// edge that is seen as a point.
#[inline]
fn side_of_edge(a: &Point3<f64>, b: &Point3<f64>, y: f64, z: f64) -> i32 {
    let flat = |p: &Point3<f64>| Coord { x: p.y, y: p.z };
    let sign = |value: f64| i32::from(value > 0.0) - i32::from(value < 0.0);
    let area = orient2d(flat(a), flat(b), Coord { x: y, y: z });
    if area != 0.0 {
        sign(area)
    } else if a.z != b.z {
        // d(area)/dy = a.z - b.z
        if a.z > b.z { 1 } else { -1 }
    } else {
        // d(area)/dz = b.y - a.y
        sign(b.y - a.y)
    }
}

fn coord3(p: Point3<f64>) -> Coord3D<f64> {
    Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    }
}

impl TriangleTree {
    /// How often the surface, which must be closed, winds about `p`.
    pub(super) fn winding_number(&self, p: &Point3<f64>) -> i32 {
        let mut winding = 0;
        let mut index = 0;
        while index < self.nodes.len() {
            let node = &self.nodes[index];
            let [low, high] = &self.extents[index];
            let is_met =
                high.x >= p.x && low.y <= p.y && high.y >= p.y && low.z <= p.z && high.z >= p.z;
            if is_met && node.is_leaf() {
                for corners in &self.corners[node.triangles()] {
                    let column = Column::new(corners);
                    let crossing = column.crossing(p.y, p.z);
                    if crossing != 0 && column.is_beyond(p, crossing) {
                        winding += crossing;
                    }
                }
            }
            // Depth first, in storage order.
            index = if is_met { index + 1 } else { node.end as usize };
        }
        winding
    }
}
