//! Which triangles of a hand a convex piece cannot have contacts with, and the shortest way out of the others.
//!
//! The engine looks at every triangle about a piece, and 49 of 50 have no contacts in the end: they are too far away, or the
//! shortest way out of the overlap leads through their back, which is no contact of a closed surface. The first costs
//! the engine a search for the closest points each time, the second an expanding polytope on top of it. Both follow from the
//! few directions that can be the one of least overlap of two polyhedra: their faces' normals, and the products of those of
//! their edges that meet as edges of their Minkowski difference do. Where both overlap, the shortest of these ways is what the engine's
//! polytope would find.
//!
//! # Source
//! The test for edges: D. Gregorius, "The separating axis test between convex polyhedra", Game Developers Conference 2013.

use parry3d_f64::math::Vector;
use parry3d_f64::shape::{SupportMap, TriMesh};

use super::clearing::{Clearing, CrossingEdges};
use super::climbing::ClimbingPolyhedron;

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

/// How a triangle and a piece overlap, in the piece's frame: the shortest way to part them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Overlap {
    /// In which direction the piece would have to move, of length one.
    pub(super) direction: Vector,
    /// The deepest points, as far apart as that is \[m\].
    pub(super) on_triangle: Vector,
    pub(super) on_piece: Vector,
}

/// What is known of a triangle and a piece without a search for contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// There may be contacts.
    Perhaps,
    /// There may be contacts, and if so then along this direction.
    Overlap(Overlap),
    /// There are none.
    NotNow,
    /// There are none up to at least this distance \[m\].
    Apart(f64),
    /// There are none, however far is looked ahead, unless one of both moves by this \[m\]: the piece is behind the triangle.
    Behind(f64),
}

/// Whether a triangle, given in the piece's frame, is farther from the piece than `distance` \[m\] or, if `has_no_back`, the
/// shortest way to or out of the piece leads through its back; and where both overlap, what the shortest way out is, unless two are as short.
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
    let sides = &piece.sides;
    if sides.are_unknown() {
        return Verdict::Perhaps;
    }
    let mut clearing = Clearing {
        front: -lowest,
        back: highest,
        second: (-lowest).max(highest),
    };
    let by_side = sides.clear_by_sides(corners, normal, ROUNDING, &mut clearing);
    let gap = -clearing.least();
    if gap > distance {
        return apart(gap);
    }
    let near = gap < 0.0 && by_side.has_corner_inside;
    if !near && (gap > 0.0 || !sides.has_few_edges()) {
        return Verdict::Perhaps;
    }
    let by_edge = sides.clear_by_edges(corners, normal, ROUNDING, near, &mut clearing);
    let least = clearing.least();
    if -least > distance {
        return apart(-least);
    }
    if least < ROUNDING {
        return Verdict::Perhaps;
    }
    if has_no_back && clearing.back + ROUNDING < clearing.front {
        return Verdict::NotNow;
    }
    if clearing.second < least + ROUNDING {
        return Verdict::Perhaps;
    }
    let overlap = if let Some(edges) = by_edge {
        between_edges(&edges, least)
    } else if let Some([normal, corner]) = by_side.nearest {
        Overlap {
            direction: -normal,
            on_triangle: corner,
            on_piece: corner + normal * least,
        }
    } else {
        let direction = if -lowest < highest { normal } else { -normal };
        let vertex = piece.local_support_point(-direction);
        Overlap {
            direction,
            on_triangle: vertex + direction * least,
            on_piece: vertex,
        }
    };
    Verdict::Overlap(overlap)
}

/// The overlap by `depth` of two edges.
fn between_edges(edges: &CrossingEdges, depth: f64) -> Overlap {
    let direction = edges.direction;
    let [start, along] = edges.of_triangle;
    // Across the other edge, within the plane.
    let across = edges.of_body.along().cross(direction);
    let part = across.dot(edges.of_body.start - start) / across.dot(along);
    let on_triangle = start + along * part;
    Overlap {
        direction,
        on_triangle,
        on_piece: on_triangle - direction * depth,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::math::Pose;
    use parry3d_f64::query::PointQuery;
    use parry3d_f64::query::details::contact_support_map_support_map;
    use parry3d_f64::shape::{ConvexPolyhedron, Triangle};
    use proptest::prelude::*;

    /// The engine's own result is off by about this [m], for bodies of a metre.
    const ENGINE: f64 = 1e-7;
    /// Faces that are taken for one side differ by about this.
    const SAME_PLANE: f64 = 1e-5;

    fn vector(size: f64) -> impl Strategy<Value = Vector> {
        prop::array::uniform3(-size..size).prop_map(Vector::from)
    }

    /// How far a piece would have to move along a direction to be clear of a triangle.
    fn way(direction: Vector, corners: &[Vector; 3], piece: &ClimbingPolyhedron) -> f64 {
        let along = |point: &Vector| direction.dot(*point);
        let highest = corners.iter().map(along).fold(f64::MIN, f64::max);
        let points = piece.polyhedron().points();
        highest - points.iter().map(along).fold(f64::MAX, f64::min)
    }

    /// The least way along the normals of all faces and across any two edges.
    fn depth_by_all_directions(corners: &[Vector; 3], piece: &ClimbingPolyhedron) -> f64 {
        let (vertices, faces) = piece.polyhedron().to_trimesh();
        let edges = |[a, b, c]: [Vector; 3]| [b - a, c - b, a - c];
        let own = edges(*corners);
        let mut directions = vec![own[0].cross(own[1])];
        for face in faces {
            let others = edges(face.map(|vertex| vertices[vertex as usize]));
            directions.push(others[0].cross(others[1]));
            directions.extend(
                own.iter()
                    .flat_map(|edge| others.map(|other| edge.cross(other))),
            );
        }
        let ways = (directions.iter())
            .filter_map(|direction| direction.try_normalize())
            .map(|to| way(to, corners, piece).min(way(-to, corners, piece)));
        ways.fold(f64::MAX, f64::min)
    }

    fn is_within(point: Vector, piece: &ClimbingPolyhedron, rounding: f64) -> bool {
        let (vertices, faces) = piece.polyhedron().to_trimesh();
        let mut normals = (faces.iter())
            .map(|face| face.map(|vertex| vertices[vertex as usize]))
            .filter_map(|[a, b, c]| Some(((b - a).cross(c - a).try_normalize()?, a)));
        normals.all(|(normal, on_face)| normal.dot(point - on_face) < rounding)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]
        /// Nothing is left out that the engine would find: what cannot touch is too far away by the engine's measure too, or
        /// its contact points through the triangle's back. And the shortest way out of an overlap is the shortest.
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
            // Some of the library's hulls have a sliver with any normal.
            prop_assume!(piece.polyhedron().points().iter().all(|point| is_within(*point, &piece, ENGINE)));
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
                    Verdict::Overlap(overlap) => {
                        prop_assert!(contact.dist < ENGINE);
                        let between = overlap.on_triangle - overlap.on_piece;
                        let depth = between.dot(overlap.direction);
                        prop_assert!((between - overlap.direction * depth).length() < ROUNDING);
                        // Not the engine's depth, which is wrong in some cases: less than the way along its own normal.
                        let least = depth_by_all_directions(&local, &piece);
                        prop_assert!((depth - least).abs() < SAME_PLANE, "{} {}", depth, least);
                        prop_assert!((depth - way(overlap.direction, &local, &piece)).abs() < SAME_PLANE);
                        // The deepest points are of both bodies.
                        prop_assert!(is_within(overlap.on_piece, &piece, SAME_PLANE));
                        let on_triangle = pos12.transform_point(overlap.on_triangle);
                        prop_assert!(triangle.distance_to_local_point(on_triangle, true) < ENGINE);
                    }
                    other => prop_assert!(false, "{:?}", other),
                }
                if let Verdict::NotNow | Verdict::Apart(_) | Verdict::Behind(_) = can_touch(&local, true, &piece, distance) {
                    let is_behind = contact.normal1.dot(normal) < ENGINE;
                    prop_assert!(contact.dist > distance - ENGINE || is_behind, "{:?}", contact);
                }
                // And of what the engine finds far in front of the triangle nothing is kept from it.
                if contact.dist < distance - ENGINE && contact.normal1.dot(normal) > ENGINE {
                    let verdict = can_touch(&local, true, &piece, distance);
                    prop_assert!(matches!(verdict, Verdict::Perhaps | Verdict::Overlap(_)));
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
