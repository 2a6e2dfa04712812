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

use parry3d_f64::math::Vector;
use parry3d_f64::shape::TriMesh;

use super::climbing::{Clearing, ClimbingPolyhedron};

/// Lengths that differ by less than this \[m\] are equal but for rounding.
const ROUNDING: f64 = 1e-9;

/// Of each triangle of a mesh, whether all contacts whose normal points through its back are dropped: not where it meets
/// another at an edge of less than a right angle, since the normals there are allowed to point a little backwards.
pub(super) fn triangles_without_back(mesh: &TriMesh) -> Vec<bool> {
    let has_none = |index| {
        let cone = mesh.triangle_normal_constraints(index);
        cone.is_some_and(|cone| {
            let mut edges = cone.edges.iter();
            edges.all(|edge| cone.face.dot(*edge).powi(2) > 0.5 + ROUNDING)
        })
    };
    (0..mesh.num_triangles() as u32).map(has_none).collect()
}

/// What is known of a triangle and a piece without a search for contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// There may be contacts.
    Perhaps,
    /// There are none.
    NotNow,
    /// There are none up to at least this distance \[m\].
    Apart(f64),
    /// There are none, however far is looked ahead, unless one of both moves by this \[m\]: the piece is behind the triangle.
    Behind(f64),
}

/// Whether a triangle, given in the piece's frame, is farther from the piece than `distance` \[m\] or, if `has_no_back`, the
/// shortest way to or out of the piece leads through its back.
pub(super) fn can_touch(
    corners: &[Vector; 3],
    has_no_back: bool,
    piece: &ClimbingPolyhedron,
    distance: f64,
) -> Verdict {
    let distance = distance + ROUNDING;
    let apart = |gap: f64| Verdict::Apart(gap - ROUNDING);
    let gap = piece.gap_to_box(corners);
    if gap > distance {
        return apart(gap);
    }
    let &[a, b, c] = corners;
    let Some(normal) = (b - a).cross(c - a).try_normalize() else {
        return Verdict::Perhaps;
    };
    let height = normal.dot(a);
    let (lowest, highest) = piece.extent_along(normal);
    let (lowest, highest) = (lowest - height, highest - height);
    if has_no_back && highest < -ROUNDING {
        return Verdict::Behind(-highest - ROUNDING);
    }
    let gap = lowest.max(-highest);
    if gap > distance {
        return apart(gap);
    }
    let Clearing { front, back } = piece.clearing_by_faces(corners, normal, ROUNDING);
    let (mut front, mut back) = (front.min(-lowest), back.min(highest));
    let gap = -front.min(back);
    if gap > distance {
        return apart(gap);
    }
    // Edges may only shorten either way: nothing is to be gained where the one in front is the shorter already.
    let is_clear = front.min(back) < 0.0;
    if !piece.knows_edges() || !is_clear && (!has_no_back || front < back) {
        return Verdict::Perhaps;
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
    if -least > distance {
        apart(-least)
    } else if has_no_back && least > ROUNDING && back + ROUNDING < front {
        Verdict::NotNow
    } else {
        Verdict::Perhaps
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::math::Pose;
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
                match can_touch(&local, false, &piece, distance) {
                    Verdict::Perhaps => {}
                    Verdict::Apart(gap) => {
                        prop_assert!(gap > distance - ROUNDING);
                        prop_assert!(contact.dist > gap - ENGINE, "{} {}", contact.dist, gap);
                    }
                    other => prop_assert!(false, "{:?}", other),
                }
                if can_touch(&local, true, &piece, distance) != Verdict::Perhaps {
                    let is_behind = contact.normal1.dot(normal) < ENGINE;
                    prop_assert!(contact.dist > distance - ENGINE || is_behind, "{:?}", contact);
                }
                // And of what the engine finds far in front of the triangle nothing is kept from it.
                if contact.dist < distance - ENGINE && contact.normal1.dot(normal) > ENGINE {
                    prop_assert_eq!(can_touch(&local, true, &piece, distance), Verdict::Perhaps);
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
