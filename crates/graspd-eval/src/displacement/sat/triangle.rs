//! The separating-axis test of a triangle of the hand with a convex piece of the object.
//!
//! Of the triangles near a piece, 49 of 50 have no contacts: they are too far away, or the shortest
//! separating translation leads through their back, which is no contact of a closed surface. The
//! test finds these without a search for closest points, and where both overlap it yields the
//! penetration depth without an expanding polytope.

use parry3d_f64::math::Vector;
use parry3d_f64::shape::{SupportMap, TriMesh};

use super::super::hill_climbing::HillClimbingPolyhedron;
use super::penetration::{EdgePair, LeastOverlap};

/// Lengths that differ by less than this \[m\] are equal but for rounding.
const ROUNDING: f64 = 1e-9;

/// Returns for each triangle of a mesh whether contacts whose normal points through its back can be
/// dropped: not where it meets another at an edge sharper than a right angle, since the cone of
/// admissible normals there reaches a little backwards.
pub(in super::super) fn triangles_without_back(mesh: &TriMesh) -> Vec<bool> {
    let has_none = |index| {
        let cone = mesh.triangle_normal_constraints(index);
        cone.is_some_and(|cone| {
            let mut edges = cone.edges.iter();
            edges.all(|edge| cone.face.dot(*edge).powi(2) > 0.5 + ROUNDING)
        })
    };
    (0..mesh.num_triangles() as u32).map(has_none).collect()
}

/// The shortest translation that separates a triangle and a piece, in the piece's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Penetration {
    /// Unit direction in which the piece would have to move.
    pub(in super::super) direction: Vector,
    /// Deepest point of the triangle \[m\].
    pub(in super::super) on_triangle: Vector,
    /// Deepest point of the piece; the distance between both is the penetration depth \[m\].
    pub(in super::super) on_piece: Vector,
}

/// Result of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) enum Separation {
    /// The test does not decide: closest points must be searched.
    Undecided,
    /// They overlap; contacts, if any, are along this direction.
    Penetrating(Penetration),
    /// There is no contact: the shortest separating translation leads through the triangle's back.
    ThroughBack,
    /// They are at least this far apart \[m\].
    Apart(f64),
    /// The piece is behind the triangle and stays there unless one of both moves by this \[m\].
    Behind(f64),
}

/// Tests a triangle, given by its corners in the piece's frame, for contacts with a piece up to
/// `distance` \[m\] ahead.
///
/// `has_no_back`: see [`triangles_without_back`]. Undecided where two axes have the same least overlap.
pub(in super::super) fn separate(
    corners: &[Vector; 3],
    has_no_back: bool,
    piece: &HillClimbingPolyhedron,
    distance: f64,
) -> Separation {
    let distance = distance + ROUNDING;
    let apart = |gap: f64| Separation::Apart(gap - ROUNDING);
    let gap = piece.gap_to_box(corners);
    if gap > distance {
        return apart(gap);
    }
    let &[a, b, c] = corners;
    let Some(normal) = (b - a).cross(c - a).try_normalize() else {
        return Separation::Undecided;
    };
    let height = normal.dot(a);
    let (lowest, highest) = piece.extent_along(normal);
    let (lowest, highest) = (lowest - height, highest - height);
    if has_no_back && highest < -ROUNDING {
        return Separation::Behind(-highest - ROUNDING);
    }
    let gap = lowest.max(-highest);
    if gap > distance {
        return apart(gap);
    }
    let faces = &piece.faces;
    if faces.is_empty() {
        return Separation::Undecided;
    }
    let mut overlap = LeastOverlap {
        front: -lowest,
        back: highest,
        second: (-lowest).max(highest),
    };
    let by_face = faces.test_face_normals(corners, normal, ROUNDING, &mut overlap);
    let gap = -overlap.least();
    if gap > distance {
        return apart(gap);
    }
    let near = gap < 0.0 && by_face.has_corner_inside;
    if !near && (gap > 0.0 || !faces.has_few_edges()) {
        return Separation::Undecided;
    }
    let by_edge = faces.test_edge_pairs(corners, normal, ROUNDING, near, &mut overlap);
    let least = overlap.least();
    if -least > distance {
        return apart(-least);
    }
    if least < ROUNDING {
        return Separation::Undecided;
    }
    if has_no_back && overlap.back + ROUNDING < overlap.front {
        return Separation::ThroughBack;
    }
    if overlap.second < least + ROUNDING {
        return Separation::Undecided;
    }
    let penetration = if let Some(edges) = by_edge {
        between_edges(&edges, least)
    } else if let Some([normal, corner]) = by_face.nearest {
        Penetration {
            direction: -normal,
            on_triangle: corner,
            on_piece: corner + normal * least,
        }
    } else {
        let direction = if -lowest < highest { normal } else { -normal };
        let vertex = piece.local_support_point(-direction);
        Penetration {
            direction,
            on_triangle: vertex + direction * least,
            on_piece: vertex,
        }
    };
    Separation::Penetrating(penetration)
}

/// Returns the penetration by `depth` of two crossing edges.
fn between_edges(edges: &EdgePair, depth: f64) -> Penetration {
    let direction = edges.direction;
    let [start, along] = edges.of_triangle;
    // Normal to the other edge, within the tangent plane.
    let across = edges.of_polyhedron.direction().cross(direction);
    let part = across.dot(edges.of_polyhedron.start - start) / across.dot(along);
    let on_triangle = start + along * part;
    Penetration {
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

    /// parry's own result is off by about this [m], for bodies of a metre.
    const PARRY: f64 = 1e-7;
    /// Triangles that are taken for one face differ by about this [m].
    const SAME_PLANE: f64 = 1e-5;

    fn vector(size: f64) -> impl Strategy<Value = Vector> {
        prop::array::uniform3(-size..size).prop_map(Vector::from)
    }

    /// Returns the overlap of a triangle and a piece along an axis.
    fn overlap_along(
        direction: Vector,
        corners: &[Vector; 3],
        piece: &HillClimbingPolyhedron,
    ) -> f64 {
        let along = |point: &Vector| direction.dot(*point);
        let highest = corners.iter().map(along).fold(f64::MIN, f64::max);
        let points = piece.polyhedron().points();
        highest - points.iter().map(along).fold(f64::MAX, f64::min)
    }

    /// Returns the least overlap along the normals of all faces and across any two edges.
    fn depth_by_all_directions(corners: &[Vector; 3], piece: &HillClimbingPolyhedron) -> f64 {
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
        let overlaps = (directions.iter())
            .filter_map(|direction| direction.try_normalize())
            .map(|to| overlap_along(to, corners, piece).min(overlap_along(-to, corners, piece)));
        overlaps.fold(f64::MAX, f64::min)
    }

    fn is_within(point: Vector, piece: &HillClimbingPolyhedron, rounding: f64) -> bool {
        let (vertices, faces) = piece.polyhedron().to_trimesh();
        let mut normals = (faces.iter())
            .map(|face| face.map(|vertex| vertices[vertex as usize]))
            .filter_map(|[a, b, c]| Some(((b - a).cross(c - a).try_normalize()?, a)));
        normals.all(|(normal, on_face)| normal.dot(point - on_face) < rounding)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]
        /// Nothing is left out that parry would find: what cannot touch is too far away by parry's measure too, or
        /// its contact points through the triangle's back. And the penetration depth is the least overlap of all axes.
        #[test]
        fn what_cannot_touch_has_no_contacts(
            points in prop::collection::vec(vector(1.0), 8..40),
            triangles in prop::collection::vec((vector(1.2), [vector(0.6), vector(0.6), vector(0.6)]), 20),
            motion in (vector(0.3), vector(1.0)),
            distance in 0.0f64..0.3,
        ) {
            let Some(polyhedron) = ConvexPolyhedron::from_convex_hull(&points) else { return Ok(()); };
            let piece = HillClimbingPolyhedron::new(polyhedron);
            let pos12 = Pose::new(motion.0, motion.1);
            // Some of parry's hulls have a sliver with an arbitrary normal.
            prop_assume!(piece.polyhedron().points().iter().all(|point| is_within(*point, &piece, PARRY)));
            for (center, corners) in triangles {
                let [a, b, c] = corners.map(|corner| center + corner);
                let triangle = Triangle::new(a, b, c);
                let Some(normal) = triangle.normal() else { continue };
                let local = [a, b, c].map(|corner| pos12.inverse_transform_point(corner));
                let far = contact_support_map_support_map(&pos12, &triangle, &piece, 10.0);
                let Some(contact) = far else { continue };
                match separate(&local, false, &piece, distance) {
                    Separation::Undecided => {}
                    Separation::Apart(gap) => {
                        prop_assert!(gap > distance - ROUNDING);
                        prop_assert!(contact.dist > gap - PARRY, "{} {}", contact.dist, gap);
                    }
                    Separation::Penetrating(overlap) => {
                        prop_assert!(contact.dist < PARRY);
                        let between = overlap.on_triangle - overlap.on_piece;
                        let depth = between.dot(overlap.direction);
                        prop_assert!((between - overlap.direction * depth).length() < ROUNDING);
                        // Not parry's depth, which in some cases is less than the overlap along its own normal.
                        let least = depth_by_all_directions(&local, &piece);
                        prop_assert!((depth - least).abs() < SAME_PLANE, "{} {}", depth, least);
                        prop_assert!((depth - overlap_along(overlap.direction, &local, &piece)).abs() < SAME_PLANE);
                        // The deepest points are of both bodies.
                        prop_assert!(is_within(overlap.on_piece, &piece, SAME_PLANE));
                        let on_triangle = pos12.transform_point(overlap.on_triangle);
                        prop_assert!(triangle.distance_to_local_point(on_triangle, true) < PARRY);
                    }
                    other => prop_assert!(false, "{:?}", other),
                }
                let result = separate(&local, true, &piece, distance);
                if !matches!(result, Separation::Undecided | Separation::Penetrating(_)) {
                    let is_behind = contact.normal1.dot(normal) < PARRY;
                    prop_assert!(contact.dist > distance - PARRY || is_behind, "{:?}", contact);
                }
                // And of what parry finds far in front of the triangle nothing is kept from it.
                if contact.dist < distance - PARRY && contact.normal1.dot(normal) > PARRY {
                    let verdict = separate(&local, true, &piece, distance);
                    prop_assert!(matches!(verdict, Separation::Undecided | Separation::Penetrating(_)));
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
