//! Contact points of a triangle and a convex piece that overlap.
//!
//! The library finds the shortest way out of an overlap by an expanding polytope. Here it is known from the test whether both can touch at
//! all, and what follows is as in the library: the way is turned into the directions that the triangle's neighbours allow, and the
//! triangle and the side of the piece that faces it are clipped against each other.
//!
//! # Source
//! parry 0.31: its contact manifolds of polygonal features, whose steps and constants these are.

use parry3d_f64::math::Pose;
use parry3d_f64::query::TrackedContact;
use parry3d_f64::query::details::NormalConstraints;
use parry3d_f64::shape::{
    PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Triangle, TrianglePseudoNormals,
};

use super::climbing::ClimbingPolyhedron;
use super::patch::Manifold;
use super::separation::Overlap;

/// Points deeper than the overlap by this factor are an artefact of a turned normal.
const MOST_DEEPER: f64 = 5.0;

/// Replaces the contacts of a triangle with a piece at a pose by those of their overlap.
pub(super) fn find_contacts(
    pose: &Pose,
    triangle: &Triangle,
    cone: Option<&TrianglePseudoNormals>,
    piece: &ClimbingPolyhedron,
    overlap: &Overlap,
    manifold: &mut Manifold,
) {
    manifold.clear();
    let direction = pose.rotation * overlap.direction;
    let mut normal = direction;
    if cone.is_some_and(|cone| !cone.project_local_normal_mut(&mut normal)) {
        return;
    }
    let opposite = if normal == direction {
        -overlap.direction
    } else {
        pose.rotation.inverse() * -normal
    };
    let mut side = PolygonalFeature::default();
    piece.local_support_feature(opposite, &mut side);
    PolygonalFeature::contacts(
        pose,
        &pose.inverse(),
        normal,
        opposite,
        &PolygonalFeature::from(*triangle),
        &side,
        manifold,
        false,
    );
    let on_triangle = pose.transform_point(overlap.on_triangle);
    let distance = (pose.transform_point(overlap.on_piece) - on_triangle).dot(direction);
    if normal == direction {
        manifold.points.push(TrackedContact::new(
            on_triangle,
            overlap.on_piece,
            PackedFeatureId::UNKNOWN,
            PackedFeatureId::UNKNOWN,
            distance,
        ));
    }
    if cone.is_some() {
        let is_plausible = |depth: f64| distance >= 0.0 || depth >= distance * MOST_DEEPER;
        (manifold.points).retain(|point| point.dist >= 0.0 || is_plausible(point.dist));
    }
    (manifold.local_n1, manifold.local_n2) = (normal, opposite);
}
