//! Signed distance to a closed mesh.

use nalgebra::{Point3, Vector3};

use super::boundary::check_closed;
use super::tree::{ClosestPoint, TriangleTree};
use crate::{GeometryError, TriangleMesh};

/// Exact signed distance to a closed mesh whose faces look outward: negative inside.
///
/// Inside is where the winding number is positive. So a surface that intersects itself bounds the union of its
/// parts, a shell turned inside out within another is a cavity, and no crack appears along edges and vertices.
///
/// Queries allocate nothing and can run on many threads at once.
#[derive(Clone, Debug)]
pub struct SignedDistance {
    tree: TriangleTree,
}

impl SignedDistance {
    /// Prepares a mesh for queries.
    ///
    /// # Errors
    /// A mesh that is empty, refers to vertices that it does not have, has coordinates that are not finite, is
    /// not closed, encloses no volume or is inside out.
    pub fn new(mesh: &TriangleMesh) -> Result<Self, GeometryError> {
        let tree = TriangleTree::new(mesh)?;
        check_closed(mesh)?;
        Ok(Self { tree })
    }

    /// The unsigned distance queries.
    pub fn tree(&self) -> &TriangleTree {
        &self.tree
    }

    /// The lowest and highest corner of the box around the mesh \[m\].
    pub fn bounds(&self) -> (Point3<f64>, Point3<f64>) {
        self.tree.bounds()
    }

    /// The nearest point of the surface.
    pub fn closest(&self, p: &Point3<f64>) -> ClosestPoint {
        self.tree.closest(p)
    }

    /// The nearest point of the surface if it is nearer than `bound` \[m\].
    pub fn closest_within(&self, p: &Point3<f64>, bound: f64) -> Option<ClosestPoint> {
        self.tree.closest_within(p, bound)
    }

    /// How often the surface winds about `p`: 1 inside a simple solid, 0 outside. Exact; on the surface itself
    /// that of one of its sides.
    pub fn winding_number(&self, p: &Point3<f64>) -> i32 {
        self.tree.winding_number(p)
    }

    /// Whether the winding number is positive.
    pub fn is_inside(&self, p: &Point3<f64>) -> bool {
        self.winding_number(p) > 0
    }

    /// The distance from `p` to the surface, negative inside, 0 on it \[m\].
    pub fn signed_distance(&self, p: &Point3<f64>) -> f64 {
        let distance = self.tree.distance(p);
        if distance > 0.0 && self.is_inside(p) {
            -distance
        } else {
            distance
        }
    }

    /// The signed distance \[m\] and its gradient, a unit vector.
    ///
    /// Where several points of the surface are nearest the gradient belongs to one of them; on the surface it
    /// is a face's normal, and zero on a face without area.
    pub fn distance_and_gradient(&self, p: &Point3<f64>) -> (f64, Vector3<f64>) {
        self.signed(p, &self.closest(p), None)
    }

    /// [`SignedDistance::distance_and_gradient`] at a point of which something is known already: it is nearer to the
    /// surface than `bound` \[m\] (if not, only time is lost), and perhaps whether it is inside, which must be right.
    pub fn distance_and_gradient_within(
        &self,
        p: &Point3<f64>,
        bound: f64,
        is_inside: Option<bool>,
    ) -> (f64, Vector3<f64>) {
        let closest = self.closest_within(p, bound);
        self.signed(p, &closest.unwrap_or_else(|| self.closest(p)), is_inside)
    }

    fn signed(
        &self,
        p: &Point3<f64>,
        closest: &ClosestPoint,
        is_inside: Option<bool>,
    ) -> (f64, Vector3<f64>) {
        // So near the surface that nothing is left of the difference, the normal stands in for it.
        let Some(away) = (p - closest.point).try_normalize(f64::MIN_POSITIVE) else {
            return (closest.distance, closest.normal);
        };
        if is_inside.unwrap_or_else(|| self.is_inside(p)) {
            (-closest.distance, -away)
        } else {
            (closest.distance, away)
        }
    }
}
