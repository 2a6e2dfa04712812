//! Which triangles of a hand a convex piece cannot have contacts with, found out before the engine computes where it touches.
//!
//! The engine looks at every triangle about a piece, and 49 of 50 have no contacts in the end: they are too far away, or the
//! shortest way out of the overlap leads through their back, which is no contact of a closed surface. The first costs
//! the engine a search for the closest points each time, the second an expanding polytope on top of it. Both follow from the
//! few directions that can be the one of least overlap of two polyhedra: their faces' normals, and the products of those of
//! their edges that meet as edges of their Minkowski difference do.
//!
//! # Source
//! The test for edges: D. Gregorius, "The separating axis test between convex polyhedra", Game Developers Conference 2013.

use std::sync::Arc;

use parry3d_f64::math::{Pose, Real, Vector};
use parry3d_f64::query::details::{
    NormalConstraints, ShapeCastOptions, ShapeDistance, ShapeIntersection,
};
use parry3d_f64::query::{
    ClosestPoints, Contact, ContactManifold, ContactManifoldsWorkspace, DefaultQueryDispatcher,
    NonlinearRigidMotion, PersistentQueryDispatcher, QueryDispatcher, ShapeCastHit, Unsupported,
};
use parry3d_f64::shape::{Shape, TriMesh};
use rapier3d_f64::geometry::{ContactData, ContactManifoldData};

use super::climbing::{Clearing, ClimbingPolyhedron};

/// Lengths that differ by less than this \[m\] are equal but for rounding.
const ROUNDING: f64 = 1e-9;

/// The engine's own answers, but for triangles that cannot have contacts with a piece.
pub(super) struct TouchingOnly {
    /// Of each triangle of the hand, whether the engine drops all contacts through its back.
    has_no_back: Arc<[bool]>,
}

impl TouchingOnly {
    pub(super) fn new(has_no_back: Arc<[bool]>) -> Self {
        Self { has_no_back }
    }
}

/// Of each triangle of a mesh, whether all contacts whose normal points through its back are dropped: not where it meets
/// another at an edge of less than a right angle, since the normals there are allowed to point a little backwards.
pub(super) fn triangles_without_back(mesh: &TriMesh) -> Arc<[bool]> {
    let has_none = |index| {
        let cone = mesh.triangle_normal_constraints(index);
        cone.is_some_and(|cone| {
            let mut edges = cone.edges.iter();
            edges.all(|edge| cone.face.dot(*edge).powi(2) > 0.5 + ROUNDING)
        })
    };
    (0..mesh.num_triangles() as u32).map(has_none).collect()
}

type Manifold = ContactManifold<ContactManifoldData, ContactData>;

impl PersistentQueryDispatcher<ContactManifoldData, ContactData> for TouchingOnly {
    fn contact_manifolds(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        prediction: Real,
        manifolds: &mut Vec<Manifold>,
        workspace: &mut Option<ContactManifoldsWorkspace>,
    ) -> Result<(), Unsupported> {
        if shape1.as_trimesh().is_none() && shape2.as_trimesh().is_none() {
            return DefaultQueryDispatcher
                .contact_manifolds(pos12, shape1, shape2, prediction, manifolds, workspace);
        }
        // Asks for each triangle about the other shape here below.
        parry3d_f64::query::details::contact_manifolds_trimesh_shape_shapes(
            self, pos12, shape1, shape2, prediction, manifolds, workspace,
        );
        Ok(())
    }

    fn contact_manifold_convex_convex(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        normal_constraints1: Option<&dyn NormalConstraints>,
        normal_constraints2: Option<&dyn NormalConstraints>,
        prediction: Real,
        manifold: &mut Manifold,
    ) -> Result<(), Unsupported> {
        // Contacts that are there already are the engine's to follow or to drop.
        if manifold.points.is_empty()
            && let Some(triangle) = shape1.as_triangle()
            && let Some(piece) = shape2.as_shape::<ClimbingPolyhedron>()
        {
            let corners = [triangle.a, triangle.b, triangle.c];
            let corners = corners.map(|corner| pos12.inverse_transform_point(corner));
            let has_no_back = self.has_no_back.get(manifold.subshape1 as usize);
            if cannot_touch(&corners, has_no_back == Some(&true), piece, prediction) {
                return Ok(());
            }
        }
        DefaultQueryDispatcher.contact_manifold_convex_convex(
            pos12,
            shape1,
            shape2,
            normal_constraints1,
            normal_constraints2,
            prediction,
            manifold,
        )
    }
}

/// Whether a triangle, given in the piece's frame, is farther from the piece than `distance` \[m\] or, if `has_no_back`, the
/// shortest way to or out of the piece leads through its back. `false` where that is not certain.
fn cannot_touch(
    corners: &[Vector; 3],
    has_no_back: bool,
    piece: &ClimbingPolyhedron,
    distance: f64,
) -> bool {
    let distance = distance + ROUNDING;
    if piece.is_beyond_box(corners, distance) {
        return true;
    }
    let &[a, b, c] = corners;
    let Some(normal) = (b - a).cross(c - a).try_normalize() else {
        return false;
    };
    let height = normal.dot(a);
    let (lowest, highest) = piece.extent_along(normal);
    let (lowest, highest) = (lowest - height, highest - height);
    if lowest > distance || highest < -distance || (has_no_back && highest < -ROUNDING) {
        return true;
    }
    let Clearing { front, back } = piece.clearing_by_faces(corners, normal, ROUNDING);
    let (mut front, mut back) = (front.min(-lowest), back.min(highest));
    if front.min(back) < -distance {
        return true;
    }
    // Edges may only shorten either way: nothing is to be gained where the one in front is the shorter already.
    let is_clear = front.min(back) < 0.0;
    if !piece.knows_edges() || !is_clear && (!has_no_back || front < back) {
        return false;
    }
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let outward = (to - from).cross(normal);
        piece.for_each_crossing_edge(to - from, outward, |direction, start| {
            let way = direction.dot(from - start);
            if direction.dot(normal) < -ROUNDING {
                back = back.min(way);
            } else {
                front = front.min(way);
            }
        });
    }
    let least = front.min(back);
    least < -distance || has_no_back && least > ROUNDING && back + ROUNDING < front
}

impl QueryDispatcher for TouchingOnly {
    fn intersection_test(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
    ) -> Result<ShapeIntersection, Unsupported> {
        DefaultQueryDispatcher.intersection_test(pos12, shape1, shape2)
    }

    fn distance(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
    ) -> Result<ShapeDistance, Unsupported> {
        DefaultQueryDispatcher.distance(pos12, shape1, shape2)
    }

    fn contact(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        prediction: Real,
    ) -> Result<Option<Contact>, Unsupported> {
        DefaultQueryDispatcher.contact(pos12, shape1, shape2, prediction)
    }

    fn closest_points(
        &self,
        pos12: &Pose,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        max_dist: Real,
    ) -> Result<ClosestPoints, Unsupported> {
        DefaultQueryDispatcher.closest_points(pos12, shape1, shape2, max_dist)
    }

    fn cast_shapes(
        &self,
        pos12: &Pose,
        local_vel12: Vector,
        shape1: &dyn Shape,
        shape2: &dyn Shape,
        options: ShapeCastOptions,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        DefaultQueryDispatcher.cast_shapes(pos12, local_vel12, shape1, shape2, options)
    }

    fn cast_shapes_nonlinear(
        &self,
        motion1: &NonlinearRigidMotion,
        shape1: &dyn Shape,
        motion2: &NonlinearRigidMotion,
        shape2: &dyn Shape,
        start_time: Real,
        end_time: Real,
        stop_at_penetration: bool,
    ) -> Result<Option<ShapeCastHit>, Unsupported> {
        DefaultQueryDispatcher.cast_shapes_nonlinear(
            motion1,
            shape1,
            motion2,
            shape2,
            start_time,
            end_time,
            stop_at_penetration,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::query::details::contact_support_map_support_map;
    use parry3d_f64::shape::{ConvexPolyhedron, Triangle};
    use proptest::prelude::*;

    /// The engine's own result is off by about this [m], for bodies of a metre.
    const ENGINE: f64 = 1e-7;

    fn vector(size: f64) -> impl Strategy<Value = Vector> {
        prop::array::uniform3(-size..size).prop_map(Vector::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]
        /// Nothing is left out that the engine would find: what cannot touch is too far away by the engine's measure too, or
        /// its contact points through the triangle's back.
        #[test]
        fn what_cannot_touch_has_no_contacts(
            points in prop::collection::vec(vector(1.0), 8..40),
            triangles in prop::collection::vec((vector(1.2), [vector(0.6), vector(0.6), vector(0.6)]), 20),
            motion in (vector(0.3), vector(1.0)),
            distance in 0.0f64..0.3,
        ) {
            let Some(polyhedron) = ConvexPolyhedron::from_convex_hull(&points) else { return Ok(()); };
            let piece = ClimbingPolyhedron::new(polyhedron);
            let pos12 = Pose::new(motion.0, motion.1);
            for (center, corners) in triangles {
                let [a, b, c] = corners.map(|corner| center + corner);
                let triangle = Triangle::new(a, b, c);
                let Some(normal) = triangle.normal() else { continue };
                let local = [a, b, c].map(|corner| pos12.inverse_transform_point(corner));
                let far = contact_support_map_support_map(&pos12, &triangle, &piece, 10.0);
                let Some(contact) = far else { continue };
                if cannot_touch(&local, false, &piece, distance) {
                    prop_assert!(contact.dist > distance - ENGINE, "{}", contact.dist);
                }
                if cannot_touch(&local, true, &piece, distance) {
                    let is_behind = contact.normal1.dot(normal) < ENGINE;
                    prop_assert!(contact.dist > distance - ENGINE || is_behind, "{:?}", contact);
                }
                // And of what the engine finds far in front of the triangle nothing is kept from it.
                if contact.dist < distance - ENGINE && contact.normal1.dot(normal) > ENGINE {
                    prop_assert!(!cannot_touch(&local, true, &piece, distance));
                }
            }
        }
    }

    #[test]
    fn only_sharp_edges_give_a_triangle_a_back() {
        let no_back = |mesh: &graspd_geom::TriangleMesh| {
            let vertices = mesh
                .vertices
                .iter()
                .map(|p| Vector::new(p.x, p.y, p.z))
                .collect();
            let flags = parry3d_f64::shape::TriMeshFlags::FIX_INTERNAL_EDGES;
            let mesh = TriMesh::with_flags(vertices, mesh.faces.clone(), flags);
            triangles_without_back(&mesh.expect("a closed mesh"))
        };
        let ball = crate::test_shapes::sphere_mesh([0.0; 3], 0.1, 4);
        assert!(no_back(&ball).iter().all(|has_none| *has_none));
        let mut blade = crate::test_shapes::box_mesh([0.0; 3], [0.1; 3]);
        for vertex in &mut blade.vertices {
            // A wedge: the upper edge of one side is pulled out until its faces meet at a small angle.
            if vertex.z > 0.0 && vertex.x > 0.0 {
                vertex.x += 0.3;
            }
        }
        assert!(no_back(&blade).iter().any(|has_none| !has_none));
    }
}
