//! The search for contacts between the pieces of an object and the triangles of a hand.
//!
//! A piece keeps the triangles about it. Those found too far away, or to face away from the whole piece, are not looked at again before
//! the object has moved as far as that takes; and while it has moved less than a quarter of a millimetre none is, but the contacts
//! follow its motion.
//!
//! # Source
//! When contacts are sought anew: rapier 0.36 (its contact recycling). Contact points: parry.

use std::sync::Arc;

use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query::details::{NormalConstraints, contact_manifold_pfm_pfm};
use parry3d_f64::shape::{TriMesh, Triangle, TrianglePseudoNormals};

use super::body::Body;
use super::climbing::ClimbingPolyhedron;
use super::overlap::find_contacts;
use super::patch::{Manifold, Patch, PatchMaker};
use super::separation::{Verdict, can_touch, triangles_without_back};

/// While the object has moved less than this since a contact was computed, the contact follows its motion instead
/// of being computed anew \[m\].
pub(super) const RECYCLE_DISTANCE: f64 = 0.25e-3;
/// Contacts follow at most a turn of this cosine.
const MOST_TURN: f64 = 0.98;
/// Contacts that there are follow the object up to a turn of this cosine (a degree) and a slide of this square \[m^2\], as in parry.
const FOLLOWED_TURN: f64 = 0.99984769515;
const FOLLOWED_SLIDE: f64 = 1e-6;
/// Triangles about a piece are gathered in a box that is wider than needed, by this part of its extents.
const MARGIN: f64 = 0.1;

/// The surface of a hand, for the search.
pub(super) struct HandSurface {
    pub(super) mesh: TriMesh,
    triangles: Vec<Triangle>,
    /// Directions that contact normals of each triangle may have.
    cones: Vec<Option<TrianglePseudoNormals>>,
    has_no_back: Vec<bool>,
    /// Largest distance of the bounding box's extreme corners from the origin \[m\].
    extent: f64,
}

impl HandSurface {
    /// The box about it.
    pub(super) fn bounds(&self) -> Aabb {
        self.mesh.local_aabb()
    }

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

/// A triangle near a piece.
#[derive(Clone)]
struct Near {
    triangle: u32,
    /// No contact before the object's travel and what is looked ahead make this together ...
    apart_until: f64,
    /// ... or the travel alone this.
    behind_until: f64,
    manifold: Manifold,
}

/// Where the object was when contacts were computed, and how far they may follow it.
#[derive(Clone, Copy)]
struct Frozen {
    pose: Pose,
    most_drift: f64,
}

/// What is known of the contacts of one piece.
#[derive(Clone)]
pub(super) struct Touch {
    piece: Arc<ClimbingPolyhedron>,
    /// Largest distance of the extreme corners of hand or piece from the origin \[m\].
    extent: f64,
    near: Vec<Near>,
    /// The box about the triangles gathered.
    gathered: Aabb,
    frozen: Option<Frozen>,
    pub(super) patches: Vec<Patch>,
}

/// What the search needs each time; kept, so that it need not allocate.
#[derive(Default)]
pub(super) struct SearchScratch {
    maker: PatchMaker,
    gathered: Vec<Near>,
}

impl Touch {
    pub(super) fn new(piece: Arc<ClimbingPolyhedron>, hand: &HandSurface) -> Self {
        let bounds = piece.bounds();
        let own = bounds.mins.length().max(bounds.maxs.length());
        Self {
            piece,
            extent: hand.extent.max(own),
            near: Vec::new(),
            gathered: Aabb::new_invalid(),
            frozen: None,
            patches: Vec::new(),
        }
    }

    /// The box about the piece at a pose.
    pub(super) fn bounds_at(&self, pose: &Pose) -> Aabb {
        self.piece.bounds_at(pose)
    }

    /// Whether there are contacts to be solved.
    pub(super) fn has_contacts(&self) -> bool {
        self.patches.iter().any(Patch::is_solved)
    }

    /// Finds the contacts up to `prediction` \[m\] ahead, unless the present ones may follow the object. `travel` is how far any
    /// point of the object may have moved up to now, all along its way \[m\], and `step` the time step \[s\].
    pub(super) fn update(
        &mut self,
        hand: &HandSurface,
        body: &Body,
        [travel, prediction, step]: [f64; 3],
        scratch: &mut SearchScratch,
    ) {
        let pose = body.pose();
        if (self.frozen).is_some_and(|frozen| frozen.still_holds(&pose, self.extent)) {
            return;
        }
        let bounds = self.piece.bounds_at(&pose).loosened(prediction);
        if !self.gathered.contains(&bounds) {
            self.gather(hand, bounds, &mut scratch.gathered);
        }
        for near in &mut self.near {
            near.update(hand, &self.piece, &pose, travel, prediction);
        }
        let manifolds = self.near.iter().map(|near| &near.manifold);
        let patches = &mut self.patches;
        scratch
            .maker
            .make(manifolds, body, prediction, step, patches);
        let most_drift = if !patches.iter().any(Patch::is_solved) {
            RECYCLE_DISTANCE.min(prediction)
        } else {
            RECYCLE_DISTANCE
        };
        self.frozen = Some(Frozen { pose, most_drift });
    }

    /// Looks up the triangles about the piece; those known before keep what is known of them.
    fn gather(&mut self, hand: &HandSurface, bounds: Aabb, old: &mut Vec<Near>) {
        std::mem::swap(&mut self.near, old);
        let margin = bounds.extents() * MARGIN;
        self.gathered = Aabb::new(bounds.mins - margin, bounds.maxs + margin);
        // The order is the tree's and not that of the numbers, so that some are forgotten: as in parry, whose contacts these are.
        let mut known = old.drain(..).peekable();
        for triangle in hand.mesh.bvh().intersect_aabb(&self.gathered) {
            if triangle as usize >= hand.triangles.len() {
                continue;
            }
            while known.next_if(|near| near.triangle < triangle).is_some() {}
            let same = known.next_if(|near| near.triangle == triangle);
            self.near.push(same.unwrap_or_else(|| Near {
                triangle,
                apart_until: f64::MIN,
                behind_until: f64::MIN,
                manifold: Manifold::with_data(triangle, 0, ()),
            }));
        }
    }
}

impl Near {
    fn update(
        &mut self,
        hand: &HandSurface,
        piece: &ClimbingPolyhedron,
        pose: &Pose,
        travel: f64,
        prediction: f64,
    ) {
        let index = self.triangle as usize;
        let triangle = &hand.triangles[index];
        let manifold = &mut self.manifold;
        if manifold.points.is_empty() {
            if travel + prediction < self.apart_until || travel < self.behind_until {
                return;
            }
        } else if manifold.try_update_contacts_eps(pose, FOLLOWED_TURN, FOLLOWED_SLIDE) {
            return;
        }
        let cone = hand.cones[index].as_ref();
        let corners = [triangle.a, triangle.b, triangle.c];
        let corners = corners.map(|corner| pose.inverse_transform_point(corner));
        match can_touch(&corners, hand.has_no_back[index], piece, prediction) {
            Verdict::Overlap(overlap) => {
                find_contacts(pose, triangle, cone, piece, &overlap, manifold);
            }
            Verdict::NotNow => manifold.clear(),
            Verdict::Apart(distance) => {
                self.apart_until = travel + distance;
                manifold.clear();
            }
            Verdict::Behind(depth) => {
                self.behind_until = travel + depth;
                manifold.clear();
            }
            Verdict::Perhaps => contact_manifold_pfm_pfm(
                pose,
                triangle,
                0.0,
                cone.map(|cone| cone as &dyn NormalConstraints),
                piece,
                0.0,
                None,
                prediction,
                manifold,
            ),
        }
    }
}

impl Frozen {
    fn still_holds(&self, pose: &Pose, extent: f64) -> bool {
        let turn = pose.rotation * self.pose.rotation.inverse();
        let turned = 2.0 * Vector::new(turn.x, turn.y, turn.z).length() * extent;
        let drift = (pose.translation - self.pose.translation).length() + turned;
        drift <= self.most_drift && cosine(&self.pose.rotation, &pose.rotation) > MOST_TURN
    }
}

/// Of the angle between two orientations.
fn cosine(a: &Rotation, b: &Rotation) -> f64 {
    let half = a.dot(*b);
    2.0 * half * half - 1.0
}
