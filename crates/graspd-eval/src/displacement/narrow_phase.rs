//! Narrow phase: contacts between the convex pieces of an object and the triangles of a hand.
//!
//! Each piece keeps the triangles near it. A triangle found too far away, or facing away from the
//! whole piece, is not tested again before the object has moved as far as that takes. While the
//! object has moved less than [`RECYCLE_DISTANCE`], no triangle is tested: contacts follow its
//! motion.
//!
//! # Source
//! Contact recycling: rapier 0.36. Contact points: parry 0.31.

use std::sync::Arc;

use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query::details::{NormalConstraints, contact_manifold_pfm_pfm};
use parry3d_f64::shape::{TriMesh, Triangle, TrianglePseudoNormals};

use super::clipping::clip;
use super::hill_climbing::HillClimbingPolyhedron;
use super::manifold::{Manifold, ManifoldBuilder, TriangleContacts};
use super::rigid_body::RigidBody;
use super::sat::{Separation, separate, triangles_without_back};

/// While the object has moved less than this since a contact was computed, the contact follows its motion instead
/// of being computed anew \[m\].
pub(super) const RECYCLE_DISTANCE: f64 = 0.25e-3;
/// Contacts are recycled up to a rotation with this cosine.
const MIN_TURN_COSINE: f64 = 0.98;
/// The contacts of one triangle are updated in place up to a rotation with this cosine (one degree) ...
const UPDATE_MIN_TURN_COSINE: f64 = 0.99984769515;
/// ... and a tangential displacement with this square \[m^2\].
const UPDATE_MAX_SLIDE_SQUARED: f64 = 1e-6;
/// Triangles are gathered from the bounding box of a piece, enlarged by this fraction of its extents on each side.
const MARGIN: f64 = 0.1;

/// The surface of a hand with what the narrow phase precomputes for each triangle.
pub(super) struct HandSurface {
    pub(super) mesh: TriMesh,
    triangles: Vec<Triangle>,
    /// Cone of admissible contact normals of each triangle.
    cones: Vec<Option<TrianglePseudoNormals>>,
    /// See [`triangles_without_back`].
    has_no_back: Vec<bool>,
    /// Largest distance of the bounding box's extreme corners from the origin \[m\].
    extent: f64,
}

impl HandSurface {
    pub(super) fn new(mesh: TriMesh) -> Self {
        let count = mesh.num_triangles() as u32;
        let bounds = mesh.local_aabb();
        Self {
            triangles: (0..count).map(|index| mesh.triangle(index)).collect(),
            cones: (0..count)
                .map(|index| mesh.triangle_normal_constraints(index))
                .collect(),
            has_no_back: triangles_without_back(&mesh),
            extent: bounds.mins.length().max(bounds.maxs.length()),
            mesh,
        }
    }
}

/// A triangle near a piece and its contacts with it.
#[derive(Clone)]
struct NearbyTriangle {
    triangle: u32,
    /// There is no contact before travel plus prediction distance reach this \[m\] ...
    apart_until: f64,
    /// ... nor before the travel alone reaches this \[m\].
    behind_until: f64,
    contacts: TriangleContacts,
}

/// Pose at which contacts were computed, and the drift up to which they are recycled.
#[derive(Clone, Copy)]
struct RecycledContacts {
    pose: Pose,
    max_drift: f64,
}

/// The contacts of one piece of the object.
#[derive(Clone)]
pub(super) struct PieceContacts {
    piece: Arc<HillClimbingPolyhedron>,
    /// Largest distance of the extreme corners of hand or piece from the origin \[m\].
    extent: f64,
    near: Vec<NearbyTriangle>,
    /// Box from which `near` was gathered.
    gathered: Aabb,
    recycled: Option<RecycledContacts>,
    pub(super) manifolds: Vec<Manifold>,
}

/// Buffers of the narrow phase, reused from step to step.
#[derive(Default)]
pub(super) struct NarrowPhaseScratch {
    builder: ManifoldBuilder,
    indices: Vec<u32>,
    known: Vec<NearbyTriangle>,
}

impl PieceContacts {
    pub(super) fn new(piece: Arc<HillClimbingPolyhedron>, hand: &HandSurface) -> Self {
        let bounds = piece.bounds();
        let own = bounds.mins.length().max(bounds.maxs.length());
        Self {
            piece,
            extent: hand.extent.max(own),
            near: Vec::new(),
            gathered: Aabb::new_invalid(),
            recycled: None,
            manifolds: Vec::new(),
        }
    }

    /// Finds the contacts up to `prediction` \[m\] ahead, unless those of an earlier step can be recycled.
    ///
    /// `travel`: upper bound on the path length of any point of the object so far \[m\]; `step`: time step \[s\].
    pub(super) fn update(
        &mut self,
        hand: &HandSurface,
        body: &RigidBody,
        [travel, prediction, step]: [f64; 3],
        scratch: &mut NarrowPhaseScratch,
    ) {
        let pose = body.pose();
        if (self.recycled).is_some_and(|recycled| recycled.are_valid_at(&pose, self.extent)) {
            return;
        }
        let bounds = self.piece.bounds_at(&pose).loosened(prediction);
        if !self.gathered.contains(&bounds) {
            self.gather(hand, bounds, scratch);
        }
        for near in &mut self.near {
            near.update(hand, &self.piece, &pose, travel, prediction);
        }
        let triangles = self.near.iter().map(|near| &near.contacts);
        let manifolds = &mut self.manifolds;
        scratch
            .builder
            .build(triangles, body, prediction, step, manifolds);
        let max_drift = if !manifolds.iter().any(Manifold::is_active) {
            RECYCLE_DISTANCE.min(prediction)
        } else {
            RECYCLE_DISTANCE
        };
        self.recycled = Some(RecycledContacts { pose, max_drift });
    }

    /// Collects the triangles near the piece in ascending order; those known before keep their contacts.
    fn gather(&mut self, hand: &HandSurface, bounds: Aabb, scratch: &mut NarrowPhaseScratch) {
        let margin = bounds.extents() * MARGIN;
        self.gathered = Aabb::new(bounds.mins - margin, bounds.maxs + margin);
        let NarrowPhaseScratch { indices, known, .. } = scratch;
        indices.clear();
        let found = hand.mesh.bvh().intersect_aabb(&self.gathered);
        indices.extend(found.filter(|index| (*index as usize) < hand.triangles.len()));
        indices.sort_unstable();
        std::mem::swap(&mut self.near, known);
        let mut known = known.drain(..).peekable();
        for &triangle in indices.iter() {
            while known.next_if(|near| near.triangle < triangle).is_some() {}
            let same = known.next_if(|near| near.triangle == triangle);
            self.near.push(same.unwrap_or_else(|| NearbyTriangle {
                triangle,
                apart_until: f64::MIN,
                behind_until: f64::MIN,
                contacts: TriangleContacts::with_data(triangle, 0, ()),
            }));
        }
    }
}

impl NearbyTriangle {
    fn update(
        &mut self,
        hand: &HandSurface,
        piece: &HillClimbingPolyhedron,
        pose: &Pose,
        travel: f64,
        prediction: f64,
    ) {
        let index = self.triangle as usize;
        let triangle = &hand.triangles[index];
        let contacts = &mut self.contacts;
        if contacts.points.is_empty() {
            if travel + prediction < self.apart_until || travel < self.behind_until {
                return;
            }
        } else if contacts.try_update_contacts_eps(
            pose,
            UPDATE_MIN_TURN_COSINE,
            UPDATE_MAX_SLIDE_SQUARED,
        ) {
            return;
        }
        let cone = hand.cones[index].as_ref();
        let corners = [triangle.a, triangle.b, triangle.c];
        let corners = corners.map(|corner| pose.inverse_transform_point(corner));
        match separate(&corners, hand.has_no_back[index], piece, prediction) {
            Separation::Penetrating(penetration) => {
                clip(pose, triangle, cone, piece, &penetration, contacts);
            }
            Separation::ThroughBack => contacts.clear(),
            Separation::Apart(distance) => {
                self.apart_until = travel + distance;
                contacts.clear();
            }
            Separation::Behind(depth) => {
                self.behind_until = travel + depth;
                contacts.clear();
            }
            Separation::Undecided => contact_manifold_pfm_pfm(
                pose,
                triangle,
                0.0,
                cone.map(|cone| cone as &dyn NormalConstraints),
                piece,
                0.0,
                None,
                prediction,
                contacts,
            ),
        }
    }
}

impl RecycledContacts {
    fn are_valid_at(&self, pose: &Pose, extent: f64) -> bool {
        let turn = pose.rotation * self.pose.rotation.inverse();
        let turned = 2.0 * Vector::new(turn.x, turn.y, turn.z).length() * extent;
        let drift = (pose.translation - self.pose.translation).length() + turned;
        drift <= self.max_drift && cosine(&self.pose.rotation, &pose.rotation) > MIN_TURN_COSINE
    }
}

/// The cosine of the angle between two orientations.
fn cosine(a: &Rotation, b: &Rotation) -> f64 {
    let half = a.dot(*b);
    2.0 * half * half - 1.0
}
