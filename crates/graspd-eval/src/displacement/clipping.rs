//! Contact points of a triangle and a convex piece that overlap, by clipping their facing features.
//!
//! The separating-axis test yields the direction of least penetration. It is projected into the
//! cone of normals that the triangle's neighbours allow; then the triangle and the piece's
//! supporting face along it are clipped against each other.
//!
//! # Source
//! Contact manifolds of polygonal features: parry 0.31.

use parry3d_f64::math::Pose;
use parry3d_f64::query::TrackedContact;
use parry3d_f64::query::details::NormalConstraints;
use parry3d_f64::shape::{
    PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Triangle, TrianglePseudoNormals,
};

use super::hill_climbing::HillClimbingPolyhedron;
use super::manifold::TriangleContacts;
use super::sat::Penetration;

/// Points deeper than the penetration by this factor are artefacts of a projected normal.
const MAX_DEPTH_FACTOR: f64 = 5.0;

/// Replaces the contacts of a triangle with a piece at `pose` by those of their penetration.
pub(super) fn clip(
    pose: &Pose,
    triangle: &Triangle,
    cone: Option<&TrianglePseudoNormals>,
    piece: &HillClimbingPolyhedron,
    penetration: &Penetration,
    contacts: &mut TriangleContacts,
) {
    contacts.clear();
    let direction = pose.rotation * penetration.direction;
    let mut normal = direction;
    if cone.is_some_and(|cone| !cone.project_local_normal_mut(&mut normal)) {
        return;
    }
    let opposite = if normal == direction {
        -penetration.direction
    } else {
        pose.rotation.inverse() * -normal
    };
    let mut face = PolygonalFeature::default();
    piece.local_support_feature(opposite, &mut face);
    PolygonalFeature::contacts(
        pose,
        &pose.inverse(),
        normal,
        opposite,
        &PolygonalFeature::from(*triangle),
        &face,
        contacts,
        false,
    );
    let on_triangle = pose.transform_point(penetration.on_triangle);
    let distance = (pose.transform_point(penetration.on_piece) - on_triangle).dot(direction);
    if normal == direction {
        contacts.points.push(TrackedContact::new(
            on_triangle,
            penetration.on_piece,
            PackedFeatureId::UNKNOWN,
            PackedFeatureId::UNKNOWN,
            distance,
        ));
    }
    if cone.is_some() {
        let is_plausible = |depth: f64| distance >= 0.0 || depth >= distance * MAX_DEPTH_FACTOR;
        (contacts.points).retain(|point| point.dist >= 0.0 || is_plausible(point.dist));
    }
    (contacts.local_n1, contacts.local_n2) = (normal, opposite);
}
